//! Atomic replacement of files: a file is complete or does not exist.
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// Time at which a file must be on the disk.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Durable {
    /// Before the call returns.
    Now,
    /// When the system writes it; a power failure may lose it.
    Later,
}

/// Writes a temporary file next to the target and renames it, so that neither a killed process nor a full disk leaves an incomplete file.
///
/// # Errors
/// A message with the path. The previous file is then unchanged.
pub fn replace(path: &Path, bytes: &[u8], durable: Durable) -> Result<(), String> {
    let beside = path.with_extension("part");
    let write = || {
        let mut file = File::create(&beside)?;
        file.write_all(bytes)?;
        if durable == Durable::Later {
            return std::fs::rename(&beside, path);
        }
        file.sync_all()?;
        std::fs::rename(&beside, path)?;
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        // Systems on which folders cannot be opened make the rename durable themselves.
        if let Ok(folder) = File::open(folder) {
            folder.sync_all()?;
        }
        Ok(())
    };
    write().map_err(|e: std::io::Error| {
        let _ = std::fs::remove_file(&beside);
        format!("`{}` cannot be written: {e}", path.display())
    })
}
