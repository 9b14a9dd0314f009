//! Processor levels of this build and of this processor: `x86-64-v2` to `-v4`, as defined by the x86-64 psABI.
//!
//! A wheel can contain several builds. `python/linkwork/_choose.py` asks the build for the lowest level which of them it may load.
use pyo3::prelude::*;

/// The level that this build requires.
pub const BUILT_FOR: &str = if cfg!(not(target_arch = "x86_64")) {
    std::env::consts::ARCH
} else if cfg!(all(
    target_feature = "avx512f",
    target_feature = "avx512bw",
    target_feature = "avx512cd",
    target_feature = "avx512dq",
    target_feature = "avx512vl"
)) {
    "x86-64-v4"
} else if cfg!(all(
    target_feature = "avx2",
    target_feature = "bmi1",
    target_feature = "bmi2",
    target_feature = "f16c",
    target_feature = "fma",
    target_feature = "lzcnt",
    target_feature = "movbe"
)) {
    "x86-64-v3"
} else if cfg!(all(target_feature = "popcnt", target_feature = "sse4.2")) {
    "x86-64-v2"
} else {
    "x86-64"
};

/// Returns the levels that this processor and its operating system support, of "v2", "v3", "v4". Empty on other architectures.
#[pyfunction]
pub fn _levels() -> Vec<&'static str> {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::is_x86_feature_detected as has;
        let v2 = has!("cmpxchg16b") && has!("popcnt") && has!("sse4.2") && has!("ssse3");
        let v3 = v2
            && has!("avx2")
            && has!("bmi1")
            && has!("bmi2")
            && has!("f16c")
            && has!("fma")
            && has!("lzcnt")
            && has!("movbe");
        let v4 = v3
            && has!("avx512f")
            && has!("avx512bw")
            && has!("avx512cd")
            && has!("avx512dq")
            && has!("avx512vl");
        let levels = [("v2", v2), ("v3", v3), ("v4", v4)];
        levels.into_iter().filter(|l| l.1).map(|l| l.0).collect()
    }
    #[cfg(not(target_arch = "x86_64"))]
    Vec::new()
}
