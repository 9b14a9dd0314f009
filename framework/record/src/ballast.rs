//! A file with reserved disk space, so that a full disk still leaves a readable log.
//!
//! The reserve is an unnamed file, so the system frees it however the process ends. If the disk or a quota is full, the reserve is released and
//! writing continues. If the limit on the file size is close, or the disk fails, the owner is notified in time for a regular end. A file that cannot
//! be completed is truncated to its last complete part.
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

/// Reserved bytes: enough for the last chunk, the log's index and a checkpoint.
const RESERVE: usize = 4 << 20;

/// The unnamed reserve file. It contains real bytes, because a sparse file would not reserve space. It is freed when it is closed.
fn reserve(beside: &Path) -> std::io::Result<File> {
    let folder = beside.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = tempfile::tempfile_in(folder)?;
    file.write_all(&vec![0x5a; RESERVE])?;
    file.sync_all()?;
    Ok(file)
}

/// The state of a file, visible outside the writers that wrap it.
#[derive(Debug, Default)]
pub struct Gauge {
    spent: AtomicU8,
    /// Position of the next byte.
    at: AtomicU64,
    /// Number of bytes that form a readable file.
    whole: AtomicU64,
}

impl Gauge {
    /// Returns the reason for which the owner should end the file, if there is one.
    pub fn spent(&self) -> Option<&'static str> {
        match self.spent.load(Ordering::Relaxed) {
            0 => None,
            1 => Some("the disk is full"),
            _ => Some("the limit on the size of files (ulimit -f) is reached"),
        }
    }

    /// Marks all bytes written so far as a readable file, to which a later failure truncates the file.
    pub fn mark_whole(&self) {
        self.whole.store(self.at.load(Ordering::Relaxed), Ordering::Relaxed);
    }
}

/// A file with a reserve. When the reserve is needed, or will soon be needed, the gauge reports it and writing continues, so that the owner can end
/// the file regularly.
pub struct Ballast {
    file: File,
    reserve: Option<File>,
    gauge: Arc<Gauge>,
    /// Position beyond which the limit on the file size is close.
    limit: u64,
}

impl Ballast {
    /// Creates `path` and its reserve.
    ///
    /// # Errors
    /// Either file cannot be written. This is reported at the start instead of at the end of a long run.
    pub fn create(path: &Path, gauge: Arc<Gauge>) -> std::io::Result<Ballast> {
        let file =
            OpenOptions::new().create(true).truncate(true).write(true).read(true).open(path)?;
        let limit = size_limit().map_or(u64::MAX, |l| l.saturating_sub(RESERVE as u64));
        let reserve = reserve(path).and_then(|r| match limit {
            0 => Err(std::io::Error::from(ErrorKind::FileTooLarge)),
            _ => Ok(r),
        });
        match reserve {
            Ok(r) => Ok(Ballast { file, reserve: Some(r), gauge, limit }),
            Err(e) => {
                if file.metadata().is_ok_and(|m| m.is_file()) {
                    let _ = std::fs::remove_file(path);
                }
                Err(e)
            }
        }
    }

    /// Returns a second handle of the file.
    ///
    /// # Errors
    /// The error of the system.
    pub fn twin(&self) -> std::io::Result<File> {
        self.file.try_clone()
    }

    /// Truncates the file to its last complete part.
    ///
    /// # Errors
    /// The error of the system.
    pub fn cut(&mut self) -> std::io::Result<()> {
        self.file.set_len(self.gauge.whole.load(Ordering::Relaxed))
    }

    fn give_up(&mut self) -> bool {
        let had = self.reserve.take().is_some();
        if had {
            self.gauge.spent.store(1, Ordering::Relaxed);
        }
        had
    }
}

impl Write for Ballast {
    fn write(&mut self, buf: &[u8]) -> std::io::Result<usize> {
        let full = |e: &std::io::Error| {
            matches!(e.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded)
        };
        let written = match self.file.write(buf) {
            Err(e) if full(&e) && self.give_up() => self.file.write(buf),
            other => other,
        }?;
        let at = self.gauge.at.fetch_add(written as u64, Ordering::Relaxed) + written as u64;
        if at > self.limit {
            self.gauge.spent.store(2, Ordering::Relaxed);
        }
        Ok(written)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

impl Seek for Ballast {
    fn seek(&mut self, pos: SeekFrom) -> std::io::Result<u64> {
        let at = self.file.seek(pos)?;
        self.gauge.at.store(at, Ordering::Relaxed);
        Ok(at)
    }
}

/// Returns the limit on the file size of this process (bytes), if the system reports one.
fn size_limit() -> Option<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|l| l.strip_prefix("Max file size"))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room() -> tempfile::TempDir {
        tempfile::tempdir().unwrap()
    }

    #[test]
    fn the_reserve_is_given_up_once_and_then_the_error_is_told() {
        // Every write to this device fails because the disk is full.
        let Ok(file) = OpenOptions::new().write(true).open("/dev/full") else {
            println!("skipped: there is no /dev/full here");
            return;
        };
        let (folder, gauge) = (room(), Arc::new(Gauge::default()));
        let reserve = Some(reserve(&folder.path().join("full.log")).unwrap());
        let mut b = Ballast { file, reserve, gauge: gauge.clone(), limit: u64::MAX };
        let e = b.write(b"row").unwrap_err();
        assert_eq!(e.kind(), ErrorKind::StorageFull);
        assert_eq!(gauge.spent(), Some("the disk is full"));
        assert!(b.reserve.is_none(), "the reserve is kept");
        assert!(b.write(b"row").is_err());
    }

    #[test]
    fn the_reserve_has_no_name_that_a_killed_process_could_leave() {
        let (folder, gauge) = (room(), Arc::new(Gauge::default()));
        let path = folder.path().join("run.log");
        let mut b = Ballast::create(&path, gauge.clone()).unwrap();
        b.write_all(b"row").unwrap();
        if cfg!(unix) {
            let entries = std::fs::read_dir(folder.path()).unwrap();
            let names: Vec<_> = entries.map(|e| e.unwrap().file_name()).collect();
            assert_eq!(names, ["run.log"]);
            let held = b.reserve.as_ref().unwrap().metadata().unwrap();
            assert_eq!(held.len(), RESERVE as u64);
        }
        assert_eq!(gauge.spent(), None);
        drop(b);
        assert_eq!(std::fs::read(&path).unwrap(), b"row");
    }

    #[test]
    fn near_the_limit_the_owner_is_told_and_a_cut_leaves_what_is_whole() {
        let (folder, gauge) = (room(), Arc::new(Gauge::default()));
        let path = folder.path().join("run.log");
        let mut b = Ballast::create(&path, gauge.clone()).unwrap();
        b.limit = 10;
        b.write_all(b"0123456789").unwrap();
        gauge.mark_whole();
        assert_eq!(gauge.spent(), None);
        b.write_all(b"half a row").unwrap();
        assert!(gauge.spent().is_some_and(|why| why.contains("ulimit")), "nobody was told");
        b.cut().unwrap();
        drop(b);
        assert_eq!(std::fs::read(&path).unwrap(), b"0123456789");
    }
}
