//! Deterministic sin, cos, exp, pow and similar functions: bit-identical results on every machine.
//!
//! Rust's `f64::sin` calls the function `sin` of the system's C library. glibc has several versions of it and selects one for the processor, and
//! different glibc versions differ, so that results differ in round-off from machine to machine. This crate defines the functions with these names in
//! the program itself, using the crate `libm` (a translation of musl's). The linker uses them for calls from all crates instead of those in the C
//! library.
//!
//! Programs that contain `linkwork-runtime` use these functions without calling them by path. A shared library must be linked with
//! `-Bsymbolic`; otherwise its calls are bound to the C library of the process that loads it.
//!
//! Accuracy: below 1 ulp of glibc's for sin, cos, tan, exp, log, pow, atan2, hypot, below 2 ulp for tanh. Compared
//! with glibc 2.36 with FMA, sin and cos take half the time, atan2 and hypot three quarters, exp and tanh 1.3 times and pow three times the time.
//!
//! This applies to Linux. Other systems use the functions of their C library.
//! ```
//! # extern crate linkwork_maths as _;
//! assert_eq!(1.0_f64.sin().to_bits(), 0x3fea_ed54_8f09_0cee);
//! ```

/// Defines C functions of doubles with these names.
#[cfg(target_os = "linux")]
macro_rules! functions {
    ($($name:ident($($x:ident),+)),* $(,)?) => {$(
        /// The C function of this name.
        // SAFETY: it has the signature and the meaning that C requires for this name.
        #[unsafe(no_mangle)]
        pub extern "C" fn $name($($x: f64),+) -> f64 {
            libm::$name($($x),+)
        }
    )*};
}

/// Defines C functions of floats with these names.
#[cfg(target_os = "linux")]
macro_rules! functions_of_floats {
    ($($name:ident($($x:ident),+)),* $(,)?) => {$(
        /// The C function of this name.
        // SAFETY: it has the signature and the meaning that C requires for this name.
        #[unsafe(no_mangle)]
        pub extern "C" fn $name($($x: f32),+) -> f32 {
            libm::$name($($x),+)
        }
    )*};
}

#[cfg(target_os = "linux")]
functions! {
    sin(x), cos(x), tan(x), asin(x), acos(x), atan(x), atan2(y, x), sinh(x), cosh(x), tanh(x), asinh(x), acosh(x), atanh(x),
    exp(x), exp2(x), exp10(x), expm1(x), log(x), log2(x), log10(x), log1p(x), pow(x, y), cbrt(x), hypot(x, y), tgamma(x), erf(x), erfc(x),
}

#[cfg(target_os = "linux")]
functions_of_floats! {
    sinf(x), cosf(x), tanf(x), asinf(x), acosf(x), atanf(x), atan2f(y, x), sinhf(x), coshf(x), tanhf(x), expf(x), exp2f(x),
    expm1f(x), logf(x), log2f(x), log10f(x), log1pf(x), powf(x, y), cbrtf(x), hypotf(x, y),
}

/// Sine and cosine. Compilers generate calls of it when both are needed.
///
/// # Safety
/// The pointers `sin` and `cos` must be valid for writing.
// SAFETY: it has the signature and the meaning that glibc requires for this name.
#[cfg(target_os = "linux")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sincos(x: f64, sin: *mut f64, cos: *mut f64) {
    let (s, c) = libm::sincos(x);
    // SAFETY: the caller guarantees that both are valid for writing.
    unsafe {
        *sin = s;
        *cos = c;
    }
}

/// Sine and cosine of a float.
///
/// # Safety
/// The pointers `sin` and `cos` must be valid for writing.
// SAFETY: it has the signature and the meaning that glibc requires for this name.
#[cfg(target_os = "linux")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sincosf(x: f32, sin: *mut f32, cos: *mut f32) {
    let (s, c) = libm::sincosf(x);
    // SAFETY: the caller guarantees that both are valid for writing.
    unsafe {
        *sin = s;
        *cos = c;
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    /// Calls through `f64` reach this crate's functions: results are bit-identical for many numbers, and `sin_cos` gives sine and cosine.
    #[test]
    fn the_functions_of_numbers_are_these() {
        let bits = |x: f64| x.to_bits();
        let x = |k: u64| (k * 2_654_435_761 % 1_000_003) as f64 / 1_000_003.0;
        for k in 0..100_000 {
            let (u, a) = (std::hint::black_box(x(k)), std::hint::black_box(20.0 * x(k) - 10.0));
            let pairs = [
                (a.sin(), libm::sin(a)),
                (a.cos(), libm::cos(a)),
                (a.sin_cos().0, libm::sin(a)),
                (a.sin_cos().1, libm::cos(a)),
                (a.tan(), libm::tan(a)),
                (u.asin(), libm::asin(u)),
                (u.acos(), libm::acos(u)),
                (a.atan(), libm::atan(a)),
                (a.atan2(u), libm::atan2(a, u)),
                (a.exp(), libm::exp(a)),
                (a.exp2(), libm::exp2(a)),
                (a.exp_m1(), libm::expm1(a)),
                (u.ln(), libm::log(u)),
                (u.log10(), libm::log10(u)),
                (u.log2(), libm::log2(u)),
                (u.ln_1p(), libm::log1p(u)),
                (u.powf(a), libm::pow(u, a)),
                (a.tanh(), libm::tanh(a)),
                (a.sinh(), libm::sinh(a)),
                (a.cosh(), libm::cosh(a)),
                (a.hypot(u), libm::hypot(a, u)),
                (a.cbrt(), libm::cbrt(a)),
            ];
            for (n, (own, wanted)) in pairs.into_iter().enumerate() {
                assert_eq!(
                    bits(own),
                    bits(wanted),
                    "function {n} of {a} or {u}: {own} and {wanted}"
                );
            }
        }
    }
}
