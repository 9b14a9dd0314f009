//! Execution of a campaign: each thread takes the next run that has not ended yet, until all have ended.
//!
//! Runs are independent, so results do not depend on their order, the number of threads, or interruptions of the campaign. Time is stepped by the
//! loop of `linkwork_runner`.
use crate::campaign::Campaign;
use crate::folder::Folder;
use crate::journal::{Journal, JournalError};
use crate::one::{MakeError, Means, now, one};
use crate::outcome::Outcome;
use linkwork_runner::{Library, Stop};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

/// Progress of a campaign.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Number of runs that have ended, including earlier calls.
    pub done: u64,
    /// Number of failed runs among them.
    pub failed: u64,
    /// Number of all runs.
    pub runs: u64,
    /// Estimated wall time until the last run ends, from the pace of this call; `None` before its first run.
    pub left: Option<Duration>,
}

/// A campaign cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The journal cannot be used.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// A run cannot be made.
    #[error(transparent)]
    Run(#[from] MakeError),
}

/// Settings of the execution of a campaign.
pub struct Orders<'a> {
    /// Models and assemblies.
    pub library: &'a Library,
    /// Number of threads; at least one is used.
    pub threads: usize,
    /// Set from outside to stop: active runs are aborted, completed runs are kept.
    pub stop: Stop,
}

/// Message of a worker thread.
enum WorkerMessage {
    Outcome(Outcome),
    Error(CampaignError),
}

/// Executes all runs that have not ended yet. Returns true if all runs have ended, false if it was stopped.
///
/// # Errors
/// [`CampaignError`]. Runs that have ended are in the journal.
pub fn execute(
    campaign: &Campaign,
    orders: &Orders<'_>,
    folder: &mut Folder,
    mut progress: impl FnMut(&Progress),
) -> Result<bool, CampaignError> {
    let runs = campaign.form().runs;
    let todo = folder.todo(campaign);
    let path = folder.path().to_path_buf();
    let next = AtomicU64::new(0);
    let begin = now();
    let failed = |j: &Journal| j.outcomes.values().filter(|o| !o.ended.is_orderly()).count() as u64;
    let done = runs - todo.len() as u64;
    let mut shown = Progress { done, failed: failed(&folder.journal), runs, left: None };
    progress(&shown);
    let mut error = None;
    std::thread::scope(|scope| {
        let (tell, told) = channel();
        for _ in 0..orders.threads.clamp(1, todo.len().max(1)) {
            let (tell, next, todo, path) = (tell.clone(), &next, &todo, &path);
            scope.spawn(move || work(campaign, orders, path, next, todo, &tell));
        }
        drop(tell);
        let mut here = 0;
        for message in told {
            let added = match message {
                // Do not write a line after one that may be incomplete; these runs are repeated.
                WorkerMessage::Outcome(_) if error.is_some() => continue,
                WorkerMessage::Outcome(outcome) => {
                    let known = folder.journal.outcomes.contains_key(&outcome.run);
                    shown.failed += u64::from(!known && !outcome.ended.is_orderly());
                    folder.add(outcome).map_err(CampaignError::from)
                }
                WorkerMessage::Error(e) => Err(e),
            };
            if let Err(e) = added {
                orders.stop.set();
                error.get_or_insert(e);
                continue;
            }
            here += 1;
            shown.done += 1;
            let each = begin.elapsed().as_secs_f64() / f64::from(here);
            shown.left = Some(Duration::from_secs_f64(each * (runs - shown.done) as f64));
            progress(&shown);
        }
    });
    folder.journal.sync()?;
    match error {
        Some(e) => Err(e),
        None => Ok(shown.done == runs),
    }
}

fn work(
    campaign: &Campaign,
    orders: &Orders<'_>,
    folder: &Path,
    next: &AtomicU64,
    todo: &[u64],
    tell: &Sender<WorkerMessage>,
) {
    while let Some(&run) = todo.get(next.fetch_add(1, Ordering::Relaxed) as usize) {
        if orders.stop.is_set() {
            return;
        }
        let means = Means { library: orders.library, folder: Some(folder), stop: &orders.stop };
        let message = match one(campaign, run, &means) {
            Ok(Some(outcome)) => WorkerMessage::Outcome(outcome),
            Ok(None) => return,
            Err(e) => WorkerMessage::Error(e.into()),
        };
        // The receiver is gone only after the end of the campaign.
        if tell.send(message).is_err() {
            return;
        }
    }
}
