//! What the acceptance tests share: the tidy checks as plain functions, and a system of toy models.

pub mod tidy;
pub mod zoo;

use std::path::{Path, PathBuf};

/// Returns the size of a test: `short`, or `long` where `.ci/verify` runs it (`LINKWORK_VERIFY`).
pub fn size<T>(short: T, long: T) -> T {
    if std::env::var_os("LINKWORK_VERIFY").is_some() { long } else { short }
}

/// The top of the repository.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().map_or_else(|| here.to_path_buf(), Path::to_path_buf)
}
