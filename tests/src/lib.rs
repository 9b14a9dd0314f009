//! What the acceptance tests share: the tidy checks as plain functions, and a system of toy models.

pub mod tidy;
pub mod zoo;

use std::path::{Path, PathBuf};

/// The top of the repository.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().map_or_else(|| here.to_path_buf(), Path::to_path_buf)
}
