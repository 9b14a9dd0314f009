//! Files that are whole or not there.
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// When a file is on the disk.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Durable {
    /// Before the call returns.
    Now,
    /// When the system comes to it: a power cut may take it.
    Later,
}

/// Writes beside the target and renames: a process that is killed leaves no half file, nor does a full disk.
///
/// # Errors
/// A message with the path; then what was there before is there still.
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
        // Where folders cannot be opened the system keeps names by itself.
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
