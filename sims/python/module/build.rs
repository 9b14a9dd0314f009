//! Binds the mathematical functions inside the library ([`linkwork_maths`]), because the process that loads it has its own.
//!
//! [`linkwork_maths`]: ../../../framework/maths

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "linux") {
        println!("cargo:rustc-cdylib-link-arg=-Wl,-Bsymbolic");
    }
}
