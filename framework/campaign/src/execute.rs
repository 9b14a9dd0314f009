//! Running a campaign: every core takes the next run that has not ended yet, until there is none.
//!
//! Runs know nothing of each other, so that their order, the number of threads, and how often the campaign was
//! stopped leave no trace in what comes out. Time is stepped by the one loop of `linkwork_runner`.
use crate::campaign::{Campaign, LoadError};
use crate::journal::{Journal, JournalError};
use crate::outcome::{Cause, Outcome};
use linkwork_runner::{
    Ended, Figures, Goal, Library, Pause, Prepared, Runner, Saves, Stop, Watch, prepare,
};
use linkwork_runtime::{Seconds, Simulation};
use std::collections::BTreeMap;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

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
    /// A file is another than at the beginning: the runs would not belong together.
    #[error(
        "`{file}` has changed since the campaign began\n  help: bring it back and go on, or begin anew in another folder with --out"
    )]
    Changed {
        /// Its name.
        file: String,
    },
    /// What a failure leaves cannot be written.
    #[error("`{}` cannot be written: {source}\n  help: make room, or choose another folder with --out", .path.display())]
    Keep {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// How a campaign is to be run.
pub struct Orders<'a> {
    /// Models and assemblies.
    pub library: &'a Library,
    /// Threads; at least one works.
    pub threads: usize,
    /// Where failed runs leave their configuration and last checkpoint, each in a folder `run_N`.
    pub failures: &'a Path,
    /// Set from outside to stop: what is under way is given up, what has ended is kept.
    pub stop: Stop,
}

/// The wall clock limits and shows, and is never simulated.
#[allow(clippy::disallowed_methods)]
fn now() -> Instant {
    Instant::now()
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
    journal: &mut Journal,
    mut progress: impl FnMut(&Progress),
) -> Result<bool, CampaignError> {
    let runs = campaign.form().runs;
    let todo: Vec<u64> = (0..runs).filter(|r| !journal.outcomes.contains_key(r)).collect();
    let next = AtomicU64::new(0);
    let begin = now();
    let failed = |j: &Journal| j.outcomes.values().filter(|o| !o.ended.is_orderly()).count() as u64;
    let mut shown =
        Progress { done: journal.outcomes.len() as u64, failed: failed(journal), runs, left: None };
    progress(&shown);
    let mut error = None;
    std::thread::scope(|scope| {
        let (tell, told) = channel();
        for _ in 0..orders.threads.clamp(1, todo.len().max(1)) {
            let (tell, next, todo) = (tell.clone(), &next, &todo);
            scope.spawn(move || work(campaign, orders, next, todo, &tell));
        }
        drop(tell);
        let mut here = 0;
        for message in told {
            let added = match message {
                // Nothing is written behind a line that may be torn: these runs are made again.
                Told::Outcome(_) if error.is_some() => continue,
                Told::Outcome(outcome) => {
                    shown.failed += u64::from(!outcome.ended.is_orderly());
                    journal.add(outcome).map_err(CampaignError::from)
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
    journal.sync()?;
    match error {
        Some(e) => Err(e),
        None => Ok(journal.outcomes.len() as u64 == runs),
    }
}

fn work(
    campaign: &Campaign,
    orders: &Orders<'_>,
    next: &AtomicU64,
    todo: &[u64],
    tell: &Sender<Told>,
) {
    while let Some(&run) = todo.get(next.fetch_add(1, Ordering::Relaxed) as usize) {
        if orders.stop.is_set() {
            return;
        }
        let message = match one(campaign, orders, run) {
            Ok(Some(outcome)) => Told::Outcome(outcome),
            Ok(None) => return,
            Err(e) => Told::Error(e),
        };
        // Nobody listens any more only when the campaign is over.
        if tell.send(message).is_err() {
            return;
        }
    }
}

/// The figures of a run, taken at every tick.
struct Watched(Figures);

impl Watch for Watched {
    fn tick(&mut self, sim: &Simulation) {
        self.0.sample(sim);
    }
    fn carry(&self, extra: &mut BTreeMap<String, Vec<u8>>) -> Result<(), String> {
        extra.insert("figures".into(), self.0.save()?);
        Ok(())
    }
}

/// What a run is stepped by, its configuration, and where its simulation would end by itself.
struct Set {
    runner: Runner<Watched>,
    goal: Goal,
    configuration: String,
    /// The campaign's limit comes before the simulation's end.
    limited: bool,
}

/// The end of a run: the simulation's own or the campaign's limit, whichever is first.
pub fn end(own: Option<Seconds>, limit: Option<Seconds>) -> (Option<Seconds>, bool) {
    let product = |a: u64, b: u64| u128::from(a) * u128::from(b);
    match (own, limit) {
        (Some(a), Some(b)) if product(a.num, b.den) <= product(b.num, a.den) => (own, false),
        (_, Some(_)) => (limit, true),
        (own, None) => (own, false),
    }
}

fn set_up(campaign: &Campaign, run: u64, library: &Library) -> Result<Set, LoadError> {
    let ready = campaign.load(run, library)?;
    let settings = &ready.loaded.simulation;
    let prepared = prepare(ready.plan(), settings).map_err(|faults| {
        let sources = ready.loaded.sources.clone();
        LoadError::Refused(linkwork_assembly::Failure { faults, sources })
    })?;
    let Prepared { figures, stop_when, .. } = prepared;
    let (until, limited) = end(settings.until, campaign.until());
    let sim = Simulation::of(Arc::new(ready.program));
    let goal = Goal { until, steps: None, stop_when };
    let runner = Runner::new(sim, Watched(figures));
    Ok(Set { runner, goal, configuration: ready.loaded.resolved, limited })
}

/// How stepping ended.
enum Stepped {
    Ended(Ended),
    Wall,
    Stopped,
    Panicked(String),
}

/// As many steps at once as take about so long.
const PIECE: Duration = Duration::from_millis(20);

fn step(set: &mut Set, stop: &Stop, wall: Option<f64>, begin: Instant) -> Stepped {
    let (mut piece, mut last) = (1, begin);
    loop {
        let (runner, goal) = (&mut set.runner, &mut set.goal);
        match catch_unwind(AssertUnwindSafe(|| runner.go(goal, piece))) {
            Ok(Pause::Ended(ended)) => return Stepped::Ended(ended),
            Ok(Pause::Calls(_) | Pause::Chunk) => {}
            Err(panic) => return Stepped::Panicked(words(panic.as_ref())),
        }
        let time = now();
        if time - last < PIECE {
            piece = (2 * piece).min(1 << 20);
        } else if time - last > 4 * PIECE {
            piece = (piece / 2).max(1);
        }
        last = time;
        if stop.is_set() {
            return Stepped::Stopped;
        }
        if wall.is_some_and(|w| (time - begin).as_secs_f64() > w) {
            return Stepped::Wall;
        }
    }
}

/// What a panic said.
fn words(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|s| (*s).to_string());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "a panic without words".into())
}

/// One run from its configuration to its end; `None` when it was stopped before.
fn one(
    campaign: &Campaign,
    orders: &Orders<'_>,
    run: u64,
) -> Result<Option<Outcome>, CampaignError> {
    let begin = now();
    let mut outcome = Outcome {
        run,
        ended: Cause::Until,
        why: String::new(),
        time: 0.0,
        seed: campaign.seed_of(run),
        hash: 0,
        wall: 0.0,
        figures: Vec::new(),
    };
    let set = catch_unwind(AssertUnwindSafe(|| set_up(campaign, run, orders.library)));
    let mut set = match set {
        Ok(Ok(set)) => set,
        Ok(Err(LoadError::Changed(file))) => return Err(CampaignError::Changed { file }),
        Ok(Err(LoadError::Refused(failure))) => {
            (outcome.ended, outcome.why) = (Cause::Refused, plain(&failure));
            outcome.wall = begin.elapsed().as_secs_f64();
            keep_text(campaign, orders, &outcome)?;
            return Ok(Some(outcome));
        }
        Err(panic) => {
            (outcome.ended, outcome.why) = (Cause::Panicked, words(panic.as_ref()));
            outcome.wall = begin.elapsed().as_secs_f64();
            keep_text(campaign, orders, &outcome)?;
            return Ok(Some(outcome));
        }
    };
    let stepped = step(&mut set, &orders.stop, campaign.form().wall, begin);
    (outcome.ended, outcome.why) = match stepped {
        Stepped::Stopped => return Ok(None),
        Stepped::Ended(Ended::Goal) if set.limited => (Cause::TimeLimit, String::new()),
        Stepped::Ended(Ended::Goal) => (Cause::Until, String::new()),
        Stepped::Ended(Ended::StopWhen) => (Cause::StopWhen, String::new()),
        Stepped::Ended(Ended::Failed(e) | Ended::Bad(e)) => (Cause::Failed, e.to_string()),
        // The runner of a campaign has no taps, and is not asked to stop itself.
        Stepped::Ended(Ended::Tap(e)) => (Cause::Failed, e),
        Stepped::Ended(Ended::Stopped) => return Ok(None),
        Stepped::Wall => (Cause::WallLimit, String::new()),
        Stepped::Panicked(words) => (Cause::Panicked, words),
    };
    let sim = set.runner.sim();
    outcome.seed = sim.plan().seed;
    outcome.time = sim.time();
    outcome.hash = sim.hash();
    outcome.figures = set.runner.watch.0.results().map(|(_, y, _)| y).collect();
    outcome.wall = begin.elapsed().as_secs_f64();
    // Stopped while it left what it takes to look at it: it is made again.
    if !outcome.ended.is_orderly() && !keep(campaign, orders, set, &outcome)? {
        return Ok(None);
    }
    Ok(Some(outcome))
}

fn plain(failure: &linkwork_assembly::Failure) -> String {
    let text = failure.to_string();
    text.trim_start_matches("error: ").trim_end().to_string()
}

/// The folder of a failed run, with what was set and why it failed.
fn keep_text(
    campaign: &Campaign,
    orders: &Orders<'_>,
    outcome: &Outcome,
) -> Result<PathBuf, CampaignError> {
    let folder = orders.failures.join(format!("run_{}", outcome.run));
    let fail = |path: &Path| {
        let path = path.to_path_buf();
        move |source| CampaignError::Keep { path, source }
    };
    std::fs::create_dir_all(&folder).map_err(fail(&folder))?;
    let mut text = format!("{}: {}\n\nseed {}\n", outcome.ended.name(), outcome.why, outcome.seed);
    for set in campaign.overrides(outcome.run) {
        text.push_str(&set);
        text.push('\n');
    }
    let path = folder.join("cause.txt");
    std::fs::write(&path, text).map_err(fail(&path))?;
    Ok(folder)
}

/// Keeps the configuration and a checkpoint. A run that failed is run again with states kept on the way, up to the
/// same failure: that costs the runs that do not fail nothing. False when it was stopped meanwhile.
fn keep(
    campaign: &Campaign,
    orders: &Orders<'_>,
    mut set: Set,
    outcome: &Outcome,
) -> Result<bool, CampaignError> {
    let folder = keep_text(campaign, orders, outcome)?;
    let path = folder.join("configuration.ron");
    std::fs::write(&path, &set.configuration)
        .map_err(|source| CampaignError::Keep { path: path.clone(), source })?;
    let name = format!("run_{}", outcome.run);
    let saves =
        |set: &Set| Saves::new(set.runner.sim(), folder.clone(), &name, &set.configuration, None);
    let failures = if outcome.ended == Cause::WallLimit {
        let saves = saves(&set);
        set.runner.save_with(saves);
        set.runner.save("interrupted.lwck");
        set.runner.new_save_failures()
    } else {
        let again =
            catch_unwind(AssertUnwindSafe(|| set_up(campaign, outcome.run, orders.library)));
        // It was loaded once: it loads again, unless a file has gone meanwhile.
        let Ok(Ok(mut set)) = again else { return Ok(true) };
        let saves = saves(&set);
        set.runner.save_with(saves);
        match step(&mut set, &orders.stop, None, now()) {
            Stepped::Panicked(_) => set.runner.save_before_failure(),
            Stepped::Stopped => return Ok(false),
            Stepped::Ended(_) | Stepped::Wall => {}
        }
        set.runner.new_save_failures()
    };
    // A part that cannot give its state leaves no checkpoint, and the cause says so.
    if let Some(why) = failures.first() {
        let path = folder.join("cause.txt");
        let add = || -> std::io::Result<()> {
            let mut file = std::fs::OpenOptions::new().append(true).open(&path)?;
            writeln!(file, "\nthere is no checkpoint: {why}")
        };
        add().map_err(|source| CampaignError::Keep { path: path.clone(), source })?;
    }
    Ok(true)
}
