//! Hides the mathematical functions of [`linkwork_maths`] inside the shared library. The library calls its own functions, and a program that is linked
//! with the library calls the functions of the C library.
//!
//! [`linkwork_maths`]: ../maths

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "linux") {
        println!("cargo:rustc-cdylib-link-arg=-Wl,--exclude-libs,ALL");
    }
}
