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

#[cfg(test)]
mod tests {
    use super::*;

    fn reserve(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("linkwork-{name}-{}", std::process::id()));
        std::fs::write(&path, [0; 16]).unwrap();
        path
    }

    #[test]
    fn the_reserve_is_given_up_once_and_then_the_error_is_told() {
        // Every write to this device says that the disk is full.
        let Ok(file) = OpenOptions::new().write(true).open("/dev/full") else {
            println!("skipped: there is no /dev/full here");
            return;
        };
        let (path, spent) = (reserve("full"), Arc::new(AtomicBool::new(false)));
        let mut b = Ballast { file, reserve: Some(path.clone()), spent: spent.clone() };
        let e = b.write(b"row").unwrap_err();
        assert_eq!(e.kind(), std::io::ErrorKind::StorageFull);
        assert!(spent.load(Ordering::Relaxed) && !path.exists(), "the reserve is kept");
        assert!(b.write(b"row").is_err());
    }

    #[test]
    fn without_need_the_reserve_stays_until_the_end() {
        let path =
            std::env::temp_dir().join(format!("linkwork-ballast-{}.log", std::process::id()));
        let spent = Arc::new(AtomicBool::new(false));
        let mut b = Ballast::create(&path, spent.clone()).unwrap();
        let beside = path.with_extension("reserve");
        b.write_all(b"row").unwrap();
        assert_eq!(std::fs::metadata(&beside).unwrap().len(), RESERVE as u64);
        assert!(!spent.load(Ordering::Relaxed));
        drop(b);
        assert!(!beside.exists());
        assert_eq!(std::fs::read(&path).unwrap(), b"row");
        std::fs::remove_file(path).unwrap();
    }
}
