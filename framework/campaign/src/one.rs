//! One run of a campaign: from its number to its outcome. The command line, the threads of [`crate::execute`], and the Python package all use these
//! functions.
//!
//! ```text
//! campaign, number → draws → load → [`Under`] → one loop (linkwork_runner) → [`Outcome`]; failures write files
//! ```
use crate::campaign::{Campaign, LoadError};
use crate::folder::failures;
use crate::histories::History;
use crate::outcome::{Cause, Outcome};
use linkwork_assembly::Resolved;
use linkwork_runner::{Ended, Goal, Library, Pause, Prepared, Runner, Saves, Stop, Watch, prepare};
use linkwork_runtime::{Fault, Origin, Rule, Seconds, Simulation};
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A run cannot be made. A failed run is an outcome, not an error.
#[derive(Debug, thiserror::Error)]
pub enum MakeError {
    /// The campaign has no run of this number.
    #[error("there is no run {run}\n  help: the runs of this campaign are 0 to {}", .runs - 1)]
    Number {
        /// The requested number.
        run: u64,
        /// The number of runs.
        runs: u64,
    },
    /// A file has changed since the campaign began, so the runs would not be comparable.
    #[error(
        "`{file}` has changed since the campaign began\n  help: restore it and continue, or restart the campaign in another folder"
    )]
    Changed {
        /// Its name.
        file: String,
    },
    /// The files of a failure cannot be written.
    #[error("`{}` cannot be written: {source}\n  help: free disk space, or choose another folder", .path.display())]
    Keep {
        /// The file or folder.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// A requested log cannot be written.
    #[error("{0}")]
    Recorder(String),
}

/// Resources that a run needs in addition to the campaign.
pub struct Means<'a> {
    /// Models and assemblies.
    pub library: &'a Library,
    /// The campaign's folder, in which a run writes its history (`histories/run_N.parquet`), and a failed run its configuration and last checkpoint
    /// (`failures/run_N`); `None`: no files are written.
    pub folder: Option<&'a Path>,
    /// Set from outside to abort the run.
    pub stop: &'a Stop,
}

/// The wall clock is used for limits and displays, never for the simulation.
#[allow(clippy::disallowed_methods)]
pub(crate) fn now() -> Instant {
    Instant::now()
}

/// Makes one run. Returns `None` if it was stopped. The outcome is a pure function of the campaign and the number, except for `wall`, the limit of
/// wall time, and stops.
///
/// # Errors
/// [`MakeError`].
pub fn one(campaign: &Campaign, run: u64, means: &Means<'_>) -> Result<Option<Outcome>, MakeError> {
    match Begun::new(campaign, run, means)? {
        Begun::Ended(outcome) => Ok(Some(outcome)),
        Begun::Under(under) => under.finish(),
    }
}

/// A run after loading.
pub enum Begun<'a> {
    /// The run is at its first tick.
    Under(Box<Under<'a>>),
    /// Its configuration cannot be loaded; this is its outcome.
    Ended(Outcome),
}

/// An active run. Recorders can be added before it is finished.
pub struct Under<'a> {
    campaign: &'a Campaign,
    means: &'a Means<'a>,
    set: Set,
    begin: Instant,
    outcome: Outcome,
}

impl<'a> Begun<'a> {
    /// Loads a run.
    ///
    /// # Errors
    /// [`MakeError`].
    pub fn new(
        campaign: &'a Campaign,
        run: u64,
        means: &'a Means<'a>,
    ) -> Result<Begun<'a>, MakeError> {
        let runs = campaign.form().runs;
        if run >= runs {
            return Err(MakeError::Number { run, runs });
        }
        let begin = now();
        let mut outcome = Outcome {
            run,
            ended: Cause::Until,
            why: String::new(),
            time: 0.0,
            seed: campaign.seed_of(run),
            hash: 0,
            wall: 0.0,
            metrics: Vec::new(),
            phases: Vec::new(),
            history: None,
        };
        let set = catch_unwind(AssertUnwindSafe(|| set_up(campaign, run, means)));
        (outcome.ended, outcome.why) = match set {
            Ok(Ok(set)) => {
                return Ok(Begun::Under(Box::new(Under { campaign, means, set, begin, outcome })));
            }
            Ok(Err(LoadError::Changed(file))) => return Err(MakeError::Changed { file }),
            Ok(Err(LoadError::Refused(failure))) => (Cause::Refused, plain(&failure)),
            Err(panic) => (Cause::Panicked, words(panic.as_ref())),
        };
        outcome.wall = begin.elapsed().as_secs_f64();
        keep_text(campaign, means, &outcome)?;
        Ok(Begun::Ended(outcome))
    }
}

impl Under<'_> {
    /// Returns its simulation, recorders and checkpoints.
    pub fn runner(&mut self) -> &mut Runner<Watched> {
        &mut self.set.runner
    }

    /// Returns the log rules of its file.
    pub fn log_groups(&self) -> &[Rule] {
        &self.set.groups
    }

    /// Returns the whole configuration as one text.
    pub fn configuration(&self) -> &str {
        &self.set.configuration
    }

    /// Steps to the end of the run, whatever its cause. Returns `None` if it was stopped.
    ///
    /// # Errors
    /// [`MakeError::Recorder`].
    pub fn go(&mut self) -> Result<Option<Outcome>, MakeError> {
        let wall = self.campaign.form().wall;
        let stepped = step(&mut self.set, self.means.stop, wall, self.begin);
        let outcome = &mut self.outcome;
        (outcome.ended, outcome.why) = match stepped {
            Stepped::Stopped => return Ok(None),
            Stepped::Ended(Ended::Goal) if self.set.limited => (Cause::TimeLimit, String::new()),
            Stepped::Ended(Ended::Goal) => (Cause::Until, String::new()),
            Stepped::Ended(Ended::StopWhen) => (Cause::StopWhen, String::new()),
            Stepped::Ended(Ended::Failed(e) | Ended::Bad(e)) => (Cause::Failed, e.to_string()),
            Stepped::Ended(Ended::Recorder(e)) => return Err(MakeError::Recorder(e)),
            // Nobody requests this runner to stop, so this case does not occur.
            Stepped::Ended(Ended::Stopped) => return Ok(None),
            Stepped::Wall => (Cause::WallLimit, String::new()),
            Stepped::Panicked(words) => (Cause::Panicked, words),
        };
        let sim = self.set.runner.sim();
        outcome.seed = sim.plan().seed;
        outcome.time = sim.time();
        outcome.hash = sim.hash();
        // A drawn choice can have other phases than the campaign.
        let (program, entered) = (sim.program(), &sim.state().entered);
        let began = |name: &String| {
            let k = program.phases.iter().position(|p| p.name == *name)?;
            entered.get(k).copied().filter(|t| t.is_finite())
        };
        let phases = self.campaign.phases().iter();
        outcome.phases = phases.map(|name| began(name).unwrap_or(f64::NAN)).collect();
        let metrics = self.set.runner.metrics();
        outcome.metrics =
            metrics.map_or_else(Vec::new, |f| f.results().map(|(_, y, _)| y).collect());
        outcome.wall = self.begin.elapsed().as_secs_f64();
        Ok(Some(outcome.clone()))
    }

    /// Steps to the end, and writes the files for the analysis of a failure. Returns `None` if it was stopped.
    fn finish(mut self) -> Result<Option<Outcome>, MakeError> {
        let Some(mut outcome) = self.go()? else { return Ok(None) };
        let history = self.set.runner.watch.history.as_ref();
        if let (Some(folder), Some(history), Some(retained)) =
            (self.means.folder, history, self.campaign.retained())
        {
            let written = history.write(folder, outcome.run, retained).map_err(|(path, why)| {
                MakeError::Keep { path, source: std::io::Error::other(why) }
            })?;
            outcome.history = Some(written);
        }
        // If the campaign was stopped while the files of a failure were written, the run is
        // repeated.
        if !outcome.ended.is_orderly() && !keep(self.campaign, self.means, self.set, &outcome)? {
            return Ok(None);
        }
        Ok(Some(outcome))
    }
}

/// The history of a run, sampled at every tick.
pub struct Watched {
    history: Option<History>,
}

impl Watch for Watched {
    fn tick(&mut self, sim: &Simulation) {
        if let Some(history) = &mut self.history {
            history.sample(sim);
        }
    }
}

/// The runner of a run, its configuration, and the end time of its simulation.
struct Set {
    runner: Runner<Watched>,
    goal: Goal,
    groups: Vec<Rule>,
    configuration: Resolved,
    /// Whether the campaign's limit is before the simulation's end.
    limited: bool,
}

/// Returns the end of a run: that of the simulation or the campaign's limit, whichever is first.
pub fn end(own: Option<Seconds>, limit: Option<Seconds>) -> (Option<Seconds>, bool) {
    let product = |a: u64, b: u64| u128::from(a) * u128::from(b);
    match (own, limit) {
        (Some(a), Some(b)) if product(a.num, b.den) <= product(b.num, a.den) => (own, false),
        (_, Some(_)) => (limit, true),
        (own, None) => (own, false),
    }
}

fn set_up(campaign: &Campaign, run: u64, means: &Means<'_>) -> Result<Set, LoadError> {
    let ready = campaign.load(run, means.library)?;
    let settings = &ready.loaded.simulation;
    let prepared = prepare(ready.plan(), settings).map_err(|faults| {
        let sources = ready.loaded.sources.clone();
        LoadError::Refused(linkwork_assembly::Failure { faults, sources })
    })?;
    let Prepared { metrics, stop_when, groups, .. } = prepared;
    // The history is not needed if no folder is given.
    let retained = campaign.retained().filter(|_| means.folder.is_some());
    let history = match retained.map(|kept| History::new(kept, ready.plan())) {
        None => None,
        Some(Ok(history)) => Some(history),
        // The value that was drawn for a choice has removed the variable.
        Some(Err(e)) => {
            let sources = ready.loaded.sources.clone();
            let fault = Fault::of(Origin::NONE, &e);
            return Err(LoadError::Refused(linkwork_assembly::Failure {
                faults: vec![fault],
                sources,
            }));
        }
    };
    let (until, limited) = end(settings.until, campaign.until());
    let sim = Simulation::of(Arc::new(ready.program));
    let goal = Goal { until, stop_when, ..Goal::default() };
    let mut runner = Runner::new(sim, Watched { history });
    // No checkpoint is given, so no state is restored and this cannot fail.
    let _ = runner.metric(metrics, None);
    Ok(Set { runner, goal, groups, configuration: ready.loaded.resolved, limited })
}

/// Reason for which stepping stopped.
enum Stepped {
    Ended(Ended),
    Wall,
    Stopped,
    Panicked(String),
}

/// Duration of a piece of the run between two checks.
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

/// Returns the message of a panic.
fn words(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|s| (*s).to_string());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "a panic without a message".into())
}

fn plain(failure: &linkwork_assembly::Failure) -> String {
    let text = failure.to_string();
    text.trim_start_matches("error: ").trim_end().to_string()
}

/// Creates the folder of a failed run, with its settings and the reason of the failure; `None` if no files are written.
fn keep_text(
    campaign: &Campaign,
    means: &Means<'_>,
    outcome: &Outcome,
) -> Result<Option<PathBuf>, MakeError> {
    let Some(folder) = means.folder else { return Ok(None) };
    let folder = failures(folder).join(format!("run_{}", outcome.run));
    let fail = |path: &Path| {
        let path = path.to_path_buf();
        move |source| MakeError::Keep { path, source }
    };
    std::fs::create_dir_all(&folder).map_err(fail(&folder))?;
    let mut text = format!("{}: {}\n\nseed {}\n", outcome.ended.name(), outcome.why, outcome.seed);
    for set in campaign.overrides(outcome.run) {
        text.push_str(&set);
        text.push('\n');
    }
    let path = folder.join("cause.txt");
    std::fs::write(&path, text).map_err(fail(&path))?;
    Ok(Some(folder))
}

/// Writes the configuration and a checkpoint. A failed run is repeated with periodically kept states, up to the same failure, so runs that do not
/// fail have no additional cost. Returns false if it was stopped.
fn keep(
    campaign: &Campaign,
    means: &Means<'_>,
    mut set: Set,
    outcome: &Outcome,
) -> Result<bool, MakeError> {
    let Some(folder) = keep_text(campaign, means, outcome)? else { return Ok(true) };
    let path = folder.join("configuration.ron");
    std::fs::write(&path, &*set.configuration)
        .map_err(|source| MakeError::Keep { path: path.clone(), source })?;
    let name = format!("run_{}", outcome.run);
    let saves =
        |set: &Set| Saves::new(set.runner.sim(), folder.clone(), &name, &set.configuration, None);
    let failures = if outcome.ended == Cause::WallLimit {
        let saves = saves(&set);
        set.runner.save_with(saves);
        set.runner.save("interrupted.lwck");
        set.runner.new_save_failures()
    } else {
        let again = catch_unwind(AssertUnwindSafe(|| set_up(campaign, outcome.run, means)));
        // The run was loaded before, so loading fails only if a file has disappeared meanwhile.
        let Ok(Ok(mut set)) = again else {
            return no_checkpoint(&folder, "the run cannot be loaded again").map(|()| true);
        };
        let saves = saves(&set);
        set.runner.save_with(saves);
        match step(&mut set, means.stop, None, now()) {
            Stepped::Panicked(_) => set.runner.save_before_failure(),
            Stepped::Stopped => return Ok(false),
            Stepped::Ended(_) | Stepped::Wall => {}
        }
        set.runner.new_save_failures()
    };
    // A part that cannot save its state prevents the checkpoint, and the cause states this.
    if let Some(why) = failures.first() {
        no_checkpoint(&folder, &why.to_string())?;
    }
    Ok(true)
}

/// Adds to the cause why there is no checkpoint.
fn no_checkpoint(folder: &Path, why: &str) -> Result<(), MakeError> {
    let path = folder.join("cause.txt");
    let add = || -> std::io::Result<()> {
        let mut file = std::fs::OpenOptions::new().append(true).open(&path)?;
        writeln!(file, "\nthere is no checkpoint: {why}")
    };
    add().map_err(|source| MakeError::Keep { path: path.clone(), source })
}
