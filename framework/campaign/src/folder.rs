//! The folder of a campaign: the journal while it runs, then tables and report. Whoever runs a campaign (the command
//! line, Python, a cluster) opens and closes it here, so that all leave the same files.
//!
//! | name | what |
//! |---|---|
//! | `journal` | a line for each run that ended |
//! | `failures/run_N` | what a failed run leaves |
//! | `histories/run_N.parquet` | with `retain`: rows of every run |
//! | `results`, `statistics`, `sensitivity`, `bands` | tables, as `.csv` and `.parquet` |
//! | `report.html` | the page |
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
    /// It cannot be made.
    #[error("the folder `{}` cannot be made: {source}\n  help: choose another one", .path.display())]
    Make {
        /// The folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Its journal.
    #[error(transparent)]
    Journal(#[from] JournalError),
}

/// Where failed runs leave their files.
pub(crate) fn failures(campaign: &Path) -> PathBuf {
    campaign.join("failures")
}

/// Takes away what a run has left. What is not there, or stays, is looked at again when the folder is opened.
fn discard(campaign: &Path, run: u64) {
    remove(campaign, run);
    let _ = std::fs::remove_dir_all(failures(campaign).join(format!("run_{run}")));
}

/// A campaign's folder, held by one process until it is dropped.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// What has ended.
    pub journal: Journal,
}

impl Folder {
    /// Makes the folder, or goes on in it.
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

    /// The journal in the folder of a campaign.
    pub fn journal_in(path: &Path) -> PathBuf {
        path.join("journal")
    }

    /// The folder itself, into which runs leave their files.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The runs that are to be made: those that have not ended, and those whose history is not as it was written.
    /// Cost: every history is read.
    pub fn todo(&self, campaign: &Campaign) -> Vec<u64> {
        let ended = |run: &u64| {
            self.journal.outcomes.get(run).is_some_and(|o| {
                // Where a limit of wall time ended a run differs from time to time, and so does its history.
                let kept = o.history.filter(|_| o.ended != Cause::WallLimit);
                kept.is_none_or(|checksum| is_whole(&self.path, *run, checksum))
            })
        };
        (0..campaign.form().runs).filter(|run| !ended(run)).collect()
    }

    /// Takes down how a run ended. One that was made again for its history has to end as it did.
    ///
    /// # Errors
    /// [`JournalError`].
    pub fn add(&mut self, outcome: Outcome) -> Result<(), JournalError> {
        match self.journal.outcomes.get(&outcome.run) {
            None => self.journal.add(outcome),
            Some(was) if was.is_again(&outcome) => Ok(()),
            Some(was) => {
                let (path, run, hash) = (self.path.clone(), outcome.run, was.hash);
                // What this attempt left is not of the run that the journal has.
                discard(&path, run);
                if outcome.ended == Cause::WallLimit {
                    return Err(JournalError::Slow { path, run });
                }
                Err(JournalError::Differs { path, run, was: hash, now: outcome.hash })
            }
        }
    }

    /// Writes tables and report of what has ended, by so many threads; gives the results and the files.
    ///
    /// # Errors
    /// A message with the file; the results are there all the same.
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
