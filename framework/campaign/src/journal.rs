//! The journal of a campaign: a line for each run that ended, each with a checksum.
//!
//! ```text
//! crc32 {"campaign":"…identity…","runs":1000,…}      the header
//! crc32 {"run":4,"ended":"until",…}                  a run, in the order in which runs ended
//! ```
//! Lines are only appended. A killed process leaves an incomplete last line, which is removed when the campaign continues. A damaged line stays in
//! the file and is reported; its run is repeated. A journal without a readable header is rejected, because only the header identifies its campaign.
//! Numbers are written as texts that convert back bit-identically.
use crate::outcome::Outcome;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The journal cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The journal cannot be read or written.
    #[error("the journal `{}` cannot be read or written: {source}\n  help: choose another folder, or free disk space", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// Another process uses it.
    #[error("another campaign is writing into `{}`\n  help: wait for it to end, or choose another folder", .path.display())]
    Taken {
        /// The file.
        path: PathBuf,
    },
    /// A line is damaged.
    #[error("the journal `{}`, line {line}: {why}\n  help: use an intact copy, or delete the folder to restart the campaign", .path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// The kind of damage.
        why: String,
    },
    /// A repeated run ended differently.
    #[error("run {run} of the campaign in `{}` ended with the state {now:016x}, but before with {was:016x}\n  help: this is a bug in a model or in Linkwork: repeated runs must be bit-identical", .path.display())]
    Differs {
        /// The campaign's folder.
        path: PathBuf,
        /// The run.
        run: u64,
        /// Hash of its last state, in the journal.
        was: u64,
        /// Hash of the repeated run.
        now: u64,
    },
    /// A run that was repeated for its history exceeded the limit of wall time.
    #[error("run {run} of the campaign in `{}` has ended before, but its repetition for the history exceeded the wall time of `limits`: (wall: ..)\n  help: repeat the command when the machine is idle, or with a larger limit", .path.display())]
    Slow {
        /// The campaign's folder.
        path: PathBuf,
        /// The run.
        run: u64,
    },
    /// The journal belongs to another campaign.
    #[error("the journal `{}` belongs to another campaign: the file, its simulation, or this program has changed\n  help: choose another folder, or delete that one", .path.display())]
    Other {
        /// The file.
        path: PathBuf,
    },
}

/// The header line.
#[derive(Serialize, Deserialize, PartialEq, Eq, Debug)]
struct Head {
    campaign: String,
    runs: u64,
    linkwork: String,
}

/// Interval at which lines are synchronized with the disk. A power failure loses the runs since the last time.
const SYNC: Duration = Duration::from_secs(1);

/// An open journal, locked until it is dropped.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    synced: Instant,
    /// Outcomes of the runs that have ended, by number.
    pub outcomes: BTreeMap<u64, Outcome>,
    /// Damaged lines: number (from 1), and reason.
    pub damaged: Vec<(usize, String)>,
}

/// The wall clock determines when lines are synchronized with the disk, not their content.
#[allow(clippy::disallowed_methods)]
fn now() -> Instant {
    Instant::now()
}

impl Journal {
    /// Opens or creates the journal of a campaign. Runs that have already ended are in `outcomes`.
    ///
    /// # Errors
    /// [`JournalError`].
    pub fn open(path: &Path, identity: u64, runs: u64) -> Result<Journal, JournalError> {
        let io = |source| JournalError::Io { path: path.into(), source };
        let mut file = OpenOptions::new()
            .create(true)
            .truncate(false)
            .read(true)
            .write(true)
            .open(path)
            .map_err(io)?;
        file.try_lock().map_err(|e| match e {
            TryLockError::WouldBlock => JournalError::Taken { path: path.into() },
            TryLockError::Error(e) => io(e),
        })?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(io)?;
        let head = Head {
            campaign: format!("{identity:016x}"),
            runs,
            linkwork: env!("CARGO_PKG_VERSION").into(),
        };
        // Bytes after the last line end are an incomplete line.
        let whole = bytes.iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
        let (outcomes, damaged) = read(&bytes[..whole], &head, path)?;
        file.set_len(whole as u64).map_err(io)?;
        file.seek(SeekFrom::Start(whole as u64)).map_err(io)?;
        let synced = now();
        let mut journal = Journal { path: path.into(), file, synced, outcomes, damaged };
        if whole == 0 {
            journal.line(&head)?;
            journal.sync()?;
            // Synchronize the folder, too, so that the file name is on the disk.
            if let Some(folder) = path.parent().and_then(|p| File::open(p).ok()) {
                let _ = folder.sync_all();
            }
        }
        Ok(journal)
    }

    /// Adds a run.
    ///
    /// # Errors
    /// [`JournalError::Io`].
    pub fn add(&mut self, outcome: Outcome) -> Result<(), JournalError> {
        self.line(&outcome)?;
        self.outcomes.insert(outcome.run, outcome);
        if self.synced.elapsed() >= SYNC {
            self.sync()?;
        }
        Ok(())
    }

    /// Synchronizes all lines with the disk.
    ///
    /// # Errors
    /// [`JournalError::Io`].
    pub fn sync(&mut self) -> Result<(), JournalError> {
        self.synced = now();
        self.file.sync_data().map_err(|source| JournalError::Io { path: self.path.clone(), source })
    }

    fn line(&mut self, what: &impl Serialize) -> Result<(), JournalError> {
        let io = |source| JournalError::Io { path: self.path.clone(), source };
        let text = serde_json::to_string(what).map_err(|e| io(std::io::Error::other(e)))?;
        let line = format!("{:08x} {text}\n", crc32fast::hash(text.as_bytes()));
        self.file.write_all(line.as_bytes()).map_err(io)
    }
}

/// Reads the runs by number, and the damaged lines.
type Lines = (BTreeMap<u64, Outcome>, Vec<(usize, String)>);

/// All complete lines.
fn read(bytes: &[u8], head: &Head, path: &Path) -> Result<Lines, JournalError> {
    let mut outcomes: BTreeMap<u64, Outcome> = BTreeMap::new();
    let mut damaged = Vec::new();
    for (k, line) in bytes.split(|b| *b == b'\n').enumerate() {
        if line.is_empty() && k > 0 {
            // The text after the last line end is empty.
            continue;
        }
        if bytes.is_empty() {
            break;
        }
        let text = checked(line).ok_or_else(|| "the checksum is wrong".to_string());
        if k == 0 {
            let found =
                text.and_then(|t| serde_json::from_str::<Head>(t).map_err(|e| e.to_string()));
            let found =
                found.map_err(|why| JournalError::Damaged { path: path.into(), line: 1, why })?;
            if found != *head {
                return Err(JournalError::Other { path: path.into() });
            }
            continue;
        }
        let read = text.and_then(|t| serde_json::from_str::<Outcome>(t).map_err(|e| e.to_string()));
        let read = read.and_then(|outcome| match outcomes.get(&outcome.run) {
            _ if outcome.run >= head.runs => Err(format!("there is no run {}", outcome.run)),
            Some(was) if was.hash != outcome.hash => {
                Err(format!("run {} is recorded twice with different states", outcome.run))
            }
            _ => Ok(outcome),
        });
        match read {
            Ok(outcome) => {
                outcomes.insert(outcome.run, outcome);
            }
            Err(why) => damaged.push((k + 1, why)),
        }
    }
    Ok((outcomes, damaged))
}

/// Returns the text of a line if its checksum is correct.
fn checked(line: &[u8]) -> Option<&str> {
    let (crc, text) = std::str::from_utf8(line).ok()?.split_once(' ')?;
    (crc == format!("{:08x}", crc32fast::hash(text.as_bytes()))).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::Cause;

    fn outcome(run: u64, y: f64) -> Outcome {
        Outcome {
            run,
            ended: Cause::Until,
            why: String::new(),
            time: 0.1 + 0.2,
            seed: 3,
            hash: u64::MAX - run,
            wall: 0.5,
            metrics: vec![y, f64::NAN, -0.0, f64::INFINITY, 5e-324],
            phases: vec![0.0, f64::NAN],
            history: (run > 0).then_some(u32::MAX - run as u32),
        }
    }

    fn bits(o: &Outcome) -> (u64, u64, Vec<u64>, Option<u32>) {
        let metrics = o.metrics.iter().map(|y| y.to_bits()).collect();
        (o.hash, o.time.to_bits(), metrics, o.history)
    }

    fn journal() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let mut j = Journal::open(&path, 7, 100).unwrap();
        for run in [4, 0, 9] {
            j.add(outcome(run, 1.0 / 3.0 + run as f64)).unwrap();
        }
        (folder, path)
    }

    #[test]
    fn what_was_written_is_read_bit_for_bit() {
        let (_folder, path) = journal();
        let j = Journal::open(&path, 7, 100).unwrap();
        assert!(j.outcomes.keys().eq([&0, &4, &9]));
        for (run, o) in &j.outcomes {
            assert_eq!(bits(o), bits(&outcome(*run, 1.0 / 3.0 + *run as f64)));
        }
    }

    #[test]
    fn cut_anywhere_it_keeps_the_whole_lines_and_goes_on() {
        let (_folder, path) = journal();
        let bytes = std::fs::read(&path).unwrap();
        let ends: Vec<usize> =
            bytes.iter().enumerate().filter(|(_, b)| **b == b'\n').map(|(k, _)| k + 1).collect();
        for cut in 0..=bytes.len() {
            std::fs::write(&path, &bytes[..cut]).unwrap();
            let mut j = Journal::open(&path, 7, 100).unwrap();
            let whole = ends.iter().filter(|e| **e <= cut).count().saturating_sub(1);
            assert_eq!(j.outcomes.len(), whole, "cut at {cut}");
            j.add(outcome(50, 2.0)).unwrap();
            drop(j);
            assert_eq!(Journal::open(&path, 7, 100).unwrap().outcomes.len(), whole + 1);
        }
    }

    /// A flipped bit costs the run of its line, or of the two lines that it joins, but no other.
    #[test]
    fn a_flipped_bit_anywhere_costs_one_run() {
        let (_folder, path) = journal();
        let bytes = std::fs::read(&path).unwrap();
        let head = Head {
            campaign: format!("{:016x}", 7),
            runs: 100,
            linkwork: env!("CARGO_PKG_VERSION").into(),
        };
        let lines = |at: usize| bytes[..at].iter().filter(|b| **b == b'\n').count();
        let runs = [4, 0, 9];
        let (whole, none) = read(&bytes, &head, &path).unwrap();
        assert!(whole.keys().eq([&0, &4, &9]) && none.is_empty());
        for at in 0..bytes.len() {
            for bit in 0..8 {
                let mut wrong = bytes.clone();
                wrong[at] ^= 1 << bit;
                let whole = wrong.iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
                match (read(&wrong[..whole], &head, &path), lines(at)) {
                    (Err(e), 0) => {
                        assert!(matches!(e, JournalError::Damaged { line: 1, .. }), "{e}")
                    }
                    (Ok((found, damaged)), line) if line > 0 => {
                        let joined = if bytes[at] == b'\n' { line + 1 } else { line };
                        let lost = |k: &usize| line <= k + 1 && *k < joined;
                        let mut left: Vec<u64> =
                            (0..3).filter(|k| !lost(k)).map(|k| runs[k]).collect();
                        left.sort_unstable();
                        assert!(found.keys().copied().eq(left), "byte {at} bit {bit}");
                        // Without the end of the last line, that line is incomplete, and its run is
                        // repeated.
                        assert!(
                            at + 1 == bytes.len() || !damaged.is_empty(),
                            "byte {at} bit {bit}"
                        );
                        found.iter().for_each(|(run, o)| {
                            assert_eq!(bits(o), bits(&outcome(*run, 1.0 / 3.0 + *run as f64)));
                        });
                    }
                    (other, line) => panic!("byte {at} bit {bit} of line {line}: {other:?}"),
                }
            }
        }
        // A flipped bit in a line repeats the run, and the line stays.
        let mut wrong = bytes.clone();
        let second = bytes.iter().position(|b| *b == b'\n').unwrap() + 30;
        wrong[second] ^= 1;
        std::fs::write(&path, &wrong).unwrap();
        let mut j = Journal::open(&path, 7, 100).unwrap();
        assert_eq!(j.damaged, [(2, "the checksum is wrong".to_string())]);
        assert!(j.outcomes.keys().eq([&0, &9]));
        j.add(outcome(4, 1.0 / 3.0 + 4.0)).unwrap();
        drop(j);
        let j = Journal::open(&path, 7, 100).unwrap();
        assert!(j.outcomes.keys().eq([&0, &4, &9]) && j.damaged.len() == 1);
    }

    #[test]
    fn another_campaign_and_another_process_are_refused() {
        let (_folder, path) = journal();
        for (identity, runs) in [(8, 100), (7, 101)] {
            let e = Journal::open(&path, identity, runs).unwrap_err();
            assert!(matches!(e, JournalError::Other { .. }), "{e}");
        }
        let open = Journal::open(&path, 7, 100).unwrap();
        let e = Journal::open(&path, 7, 100).unwrap_err();
        assert!(matches!(e, JournalError::Taken { .. }), "{e}");
        drop(open);
        Journal::open(&path, 7, 100).unwrap();
    }
}
