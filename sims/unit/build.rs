//! Binds calls of mathematical functions ([`linkwork_maths`]) to the definitions inside the library, because the host process has its own.
//!
//! [`linkwork_maths`]: ../../../framework/maths

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "linux") {
        println!("cargo:rustc-cdylib-link-arg=-Wl,-Bsymbolic");
    }
}
