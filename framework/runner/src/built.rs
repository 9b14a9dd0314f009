//! The build of the program, for logs, checkpoints and summaries. Results of builds for different processors differ at round-off level.

/// Returns version, system, processor with the instruction set extensions that the compiler may use, and profile: `linkwork 0.1.0 x86_64-linux avx2
/// fma, optimized`.
pub fn built() -> String {
    let mut text = format!(
        "linkwork {} {}-{}",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::ARCH,
        std::env::consts::OS
    );
    let extensions = [
        ("sse4.2", cfg!(target_feature = "sse4.2")),
        ("avx2", cfg!(target_feature = "avx2")),
        ("fma", cfg!(target_feature = "fma")),
        ("avx512f", cfg!(target_feature = "avx512f")),
        ("neon", cfg!(target_feature = "neon")),
    ];
    for (name, _) in extensions.iter().filter(|(_, there)| *there) {
        text.push(' ');
        text.push_str(name);
    }
    text.push_str(if cfg!(debug_assertions) { ", for development" } else { ", release" });
    text
}
