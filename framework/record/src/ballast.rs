//! A file that keeps some room in reserve, so that a full disk still leaves a readable log.
use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Bytes kept in reserve: the last chunk, the log's index and a checkpoint fit.
const RESERVE: usize = 4 << 20;

/// A file with a reserve beside it. When the disk is full the reserve is given up, `spent` is set
/// and writing goes on: the owner then comes to an orderly end.
pub struct Ballast {
    file: File,
    reserve: Option<PathBuf>,
    spent: Arc<AtomicBool>,
}

impl Ballast {
    /// Creates `path` and its reserve; `spent` is set when the reserve was needed.
    ///
    /// # Errors
    /// When either cannot be written: better at the start than at the end of a long run.
    pub fn create(path: &Path, spent: Arc<AtomicBool>) -> std::io::Result<Ballast> {
        let file =
            OpenOptions::new().create(true).truncate(true).write(true).read(true).open(path)?;
        let reserve = path.with_extension("reserve");
        let mut r = File::create(&reserve)?;
        // Real bytes: a sparse file would reserve nothing.
        if let Err(e) = r.write_all(&vec![0x5a; RESERVE]).and_then(|()| r.sync_all()) {
            let _ = std::fs::remove_file(&reserve);
            let _ = std::fs::remove_file(path);
            return Err(e);
        }
        Ok(Ballast { file, reserve: Some(reserve), spent })
    }

    fn give_up(&mut self) -> bool {
        match self.reserve.take() {
            Some(path) => {
                self.spent.store(true, Ordering::Relaxed);
                std::fs::remove_file(path).is_ok()
            }
            None => false,
        }
    }
}

impl Write for Ballast {
    fn write(&mut self, buf: &[u8]) -> std::io::Result<usize> {
        match self.file.write(buf) {
            Err(e) if e.kind() == std::io::ErrorKind::StorageFull && self.give_up() => {
                self.file.write(buf)
            }
            other => other,
        }
    }
    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

impl Seek for Ballast {
    fn seek(&mut self, pos: SeekFrom) -> std::io::Result<u64> {
        self.file.seek(pos)
    }
}

impl Drop for Ballast {
    fn drop(&mut self) {
        self.give_up();
    }
}
