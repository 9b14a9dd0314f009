//! Running a campaign: every core takes the next run that has not ended yet, until there is none.
//!
//! Runs know nothing of each other, so that their order, the number of threads, and how often the campaign was
//! stopped leave no trace in what comes out. Time is stepped by the one loop of `linkwork_runner`.
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

/// How far a campaign is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Runs that ended, those of earlier calls too.
    pub done: u64,
    /// Of those, the ones that failed.
    pub failed: u64,
    /// All runs.
    pub runs: u64,
    /// Wall time until the last run ends, from the pace of this call; `None` before its first run.
    pub left: Option<Duration>,
}

/// A campaign cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The journal.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// A run cannot be made.
    #[error(transparent)]
    Run(#[from] MakeError),
}

/// How a campaign is to be run.
pub struct Orders<'a> {
    /// Models and assemblies.
    pub library: &'a Library,
    /// Threads; at least one works.
    pub threads: usize,
    /// Set from outside to stop: what is under way is given up, what has ended is kept.
    pub stop: Stop,
}

/// What a worker tells.
enum Told {
    Outcome(Outcome),
    Error(CampaignError),
}

/// Runs what has not ended yet. True when all runs have ended, false when it was stopped before.
///
/// # Errors
/// [`CampaignError`]; what has ended is in the journal.
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
                // Nothing is written behind a line that may be torn: these runs are made again.
                Told::Outcome(_) if error.is_some() => continue,
                Told::Outcome(outcome) => {
                    let known = folder.journal.outcomes.contains_key(&outcome.run);
                    shown.failed += u64::from(!known && !outcome.ended.is_orderly());
                    folder.add(outcome).map_err(CampaignError::from)
                }
                Told::Error(e) => Err(e),
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
    tell: &Sender<Told>,
) {
    while let Some(&run) = todo.get(next.fetch_add(1, Ordering::Relaxed) as usize) {
        if orders.stop.is_set() {
            return;
        }
        let means = Means { library: orders.library, folder: Some(folder), stop: &orders.stop };
        let message = match one(campaign, run, &means) {
            Ok(Some(outcome)) => Told::Outcome(outcome),
            Ok(None) => return,
            Err(e) => Told::Error(e.into()),
        };
        // Nobody listens any more only when the campaign is over.
        if tell.send(message).is_err() {
            return;
        }
    }
}
