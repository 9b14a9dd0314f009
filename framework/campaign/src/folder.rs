//! The folder of a campaign: the journal during the campaign, then tables and report. The command line, Python and clusters all use this module, so
//! they write the same files.
//!
//! | name | content |
//! |---|---|
//! | `journal` | a line for each run that has ended |
//! | `failures/run_N` | files of a failed run |
//! | `histories/run_N.parquet` | with `retain`: samples of every run |
//! | `results`, `statistics`, `sensitivity`, `bands` | tables, as `.csv` and `.parquet` |
//! | `report.html` | the report |
use crate::campaign::Campaign;
use crate::histories::{is_whole, remove};
use crate::journal::{Journal, JournalError};
use crate::outcome::{Cause, Outcome};
use crate::report;
use crate::results::Results;
use std::path::{Path, PathBuf};

/// The folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The folder cannot be created.
    #[error("the folder `{}` cannot be created: {source}\n  help: choose another one", .path.display())]
    Make {
        /// The folder.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// Its journal cannot be used.
    #[error(transparent)]
    Journal(#[from] JournalError),
}

/// Returns the folder for the files of failed runs.
pub(crate) fn failures(campaign: &Path) -> PathBuf {
    campaign.join("failures")
}

/// Removes the files of a run. Errors are ignored, because the files are checked again when the folder is opened.
fn discard(campaign: &Path, run: u64) {
    remove(campaign, run);
    let _ = std::fs::remove_dir_all(failures(campaign).join(format!("run_{run}")));
}

/// A campaign's folder, locked by one process until it is dropped.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// The runs that have ended.
    pub journal: Journal,
}

impl Folder {
    /// Creates the folder, or continues the campaign in it.
    ///
    /// # Errors
    /// [`FolderError`].
    pub fn open(path: &Path, campaign: &Campaign) -> Result<Folder, FolderError> {
        std::fs::create_dir_all(path)
            .map_err(|source| FolderError::Make { path: path.into(), source })?;
        let journal =
            Journal::open(&Self::journal_in(path), campaign.identity(), campaign.form().runs)?;
        Ok(Folder { path: path.into(), journal })
    }

    /// Returns the path of the journal in the folder of a campaign.
    pub fn journal_in(path: &Path) -> PathBuf {
        path.join("journal")
    }

    /// Returns the folder, into which runs write their files.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the runs that must be made: those that have not ended, and those whose history file is missing or has changed. Cost: every history is
    /// read.
    pub fn todo(&self, campaign: &Campaign) -> Vec<u64> {
        let ended = |run: &u64| {
            self.journal.outcomes.get(run).is_some_and(|o| {
                // The end of a run that was stopped by the limit of wall time is not reproducible, and neither is its history.
                let kept = o.history.filter(|_| o.ended != Cause::WallLimit);
                kept.is_none_or(|checksum| is_whole(&self.path, *run, checksum))
            })
        };
        (0..campaign.form().runs).filter(|run| !ended(run)).collect()
    }

    /// Records how a run ended. A run that was repeated for its history must end as before.
    ///
    /// # Errors
    /// [`JournalError`].
    pub fn add(&mut self, outcome: Outcome) -> Result<(), JournalError> {
        match self.journal.outcomes.get(&outcome.run) {
            None => self.journal.add(outcome),
            Some(was) if was.is_again(&outcome) => Ok(()),
            Some(was) => {
                let (path, run, hash) = (self.path.clone(), outcome.run, was.hash);
                // The files of this attempt do not belong to the run in the journal.
                discard(&path, run);
                if outcome.ended == Cause::WallLimit {
                    return Err(JournalError::Slow { path, run });
                }
                Err(JournalError::Differs { path, run, was: hash, now: outcome.hash })
            }
        }
    }

    /// Writes tables and report of the runs that have ended, with several threads; returns the results and the files.
    ///
    /// # Errors
    /// A message with the file; the results are returned nevertheless.
    pub fn write(
        &self,
        campaign: &Campaign,
        threads: usize,
    ) -> (Results, Result<Vec<PathBuf>, String>) {
        let mut results = Results::new(campaign, &self.journal);
        let bands = results.bands(campaign, &self.journal, &self.path, threads);
        let written = results.write(&self.path).and_then(|mut files| {
            let page = self.path.join("report.html");
            report::write(&page, campaign, &results)?;
            files.push(page);
            bands.map(|()| files)
        });
        (results, written)
    }
}
