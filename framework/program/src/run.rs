//! `linkwork run` and `resume`: a run with its files, progress on the terminal, and a regular end.
use crate::begin::{keeps_earlier, warn_of_version};
use crate::edge::Edges;
use crate::fork::Fork;
use crate::load::{self, Ready};
use crate::options::{RunOptions, period, time};
use crate::picture::Picture;
use crate::summary::{self, Ending, Summary};
use crate::voice::report;
use crate::{exit, profile, recorders, scene};
use indicatif::{ProgressBar, ProgressStyle};
use linkwork_assembly::Failure;
use linkwork_live::{Live, Server, Ticket};
use linkwork_record::LogSpec;
use linkwork_runner::{
    BUILT, Balance, Ended, Folder, Goal, Need, Pause, Prepared, RecorderEnd, Runner, Saves, Watch,
    assignment, changed, time_name,
};
use linkwork_runtime::{Change, Checkpoint, Fault, Profile, Seconds, Simulation, Sources};
use linkwork_viz::Scene;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Data that are resolved before a run, so that no file is written for a wrong input.
pub struct Looked {
    /// The scene and its sample period.
    pub scene: (Scene, Seconds),
    /// Everything else.
    pub prepared: Prepared,
}

/// Resolves all patterns and variables in the file.
pub fn prepare(ready: &Ready) -> Result<Looked, u8> {
    let (plan, file) = (ready.plan(), &ready.loaded.simulation);
    let mut faults: Vec<Fault> = Vec::new();
    let prepared = linkwork_runner::prepare(plan, file).map_err(|mut f| faults.append(&mut f));
    let title = title(ready);
    let scene =
        scene::scene(&title, &ready.loaded, &ready.program).map_err(|mut f| faults.append(&mut f));
    match (scene, prepared) {
        (Ok(scene), Ok(prepared)) => Ok(Looked { scene, prepared }),
        _ => Err(report(&Failure { faults, sources: ready.loaded.sources.clone() })),
    }
}

fn title(ready: &Ready) -> String {
    let name = ready.loaded.sources.files.first().map_or("simulation", |f| f.0.as_str());
    let path = Path::new(name);
    let stem = path.file_stem().and_then(|s| s.to_str()).unwrap_or("simulation");
    let folder = path.parent().and_then(Path::file_name).and_then(|f| f.to_str());
    if stem == "sim" { folder.unwrap_or("simulation").to_string() } else { stem.to_string() }
}

/// `linkwork run`.
pub fn run(sim: &Path, options: &RunOptions, set: &[String], seed: Option<u64>) -> u8 {
    let name = title_of(sim);
    match load::ready(sim, set, seed) {
        Ok(ready) => start(ready, &name, options, Source { file: sim, begin: Begin::New }),
        Err(code) => code,
    }
}

/// Runs a loaded simulation of the file `sim`.
pub fn run_ready(ready: Ready, sim: &Path, name: &str, options: &RunOptions) -> u8 {
    start(ready, name, options, Source { file: sim, begin: Begin::New })
}

pub(crate) fn title_of(sim: &Path) -> String {
    let file = load::sim_file(sim);
    let absolute = std::path::absolute(&file).unwrap_or(file);
    let stem = absolute.file_stem().and_then(|s| s.to_str()).unwrap_or("simulation");
    let folder = absolute.parent().and_then(Path::file_name).and_then(|f| f.to_str());
    if stem == "sim" { folder.unwrap_or(stem).to_string() } else { stem.to_string() }
}

/// `linkwork resume`.
pub fn resume(file: &Path, options: &RunOptions) -> u8 {
    let (checkpoint, name) = match read(file) {
        Ok(read) => read,
        Err(code) => return code,
    };
    match load::ready_text(&format!("{name}.ron"), &checkpoint.configuration) {
        Ok(ready) => {
            start(ready, &name, options, Source { file, begin: Begin::Resumed(&checkpoint) })
        }
        Err(code) => code,
    }
}

/// Reads a checkpoint; returns it and the name of its simulation.
pub(crate) fn read(file: &Path) -> Result<(Checkpoint, String), u8> {
    let checkpoint = Checkpoint::read(file).map_err(|e| {
        tell!("error: {e}\n  help: give a complete .lwck file that `linkwork run` wrote");
        exit::INPUT
    })?;
    warn_of_version(&checkpoint);
    let name = checkpoint
        .extra
        .get("name")
        .map_or_else(|| "resumed".to_string(), |n| String::from_utf8_lossy(n).into_owned());
    Ok((checkpoint, name))
}

/// Runs `ready` from the state of `fork`, which was made from the checkpoint `file`.
pub(crate) fn run_fork(
    ready: Ready,
    name: &str,
    options: &RunOptions,
    file: &Path,
    fork: Fork,
) -> u8 {
    start(ready, name, options, Source { file, begin: Begin::Forked(Box::new(fork)) })
}

/// Source of a run.
struct Source<'a> {
    file: &'a Path,
    begin: Begin<'a>,
}

/// Start of a run.
enum Begin<'a> {
    /// At the start of its configuration.
    New,
    /// From the state of an earlier run of this configuration.
    Resumed(&'a Checkpoint),
    /// From the state of a run of another configuration.
    Forked(Box<Fork>),
}

/// The metric, sampled at every tick.
struct Watched {
    picture: Picture,
}

impl Watch for Watched {
    fn tick(&mut self, sim: &Simulation) {
        self.picture.sample(sim);
    }
}

/// An active run and its messages.
struct Run {
    runner: Runner<Watched>,
    goal: Goal,
    name: String,
    /// Locked until the end.
    folder: Folder,
    files: Vec<PathBuf>,
    /// Errors of files that could not be written.
    problems: Vec<String>,
    dropped: u64,
    bar: ProgressBar,
    edges: Edges,
    /// Texts to which messages refer.
    sources: Sources,
    /// The socket, and the file that names it.
    live: Option<(Live, Ticketed)>,
    /// The profile, if requested.
    profile: Option<Profile>,
    /// Transitions are printed with all details.
    verbose: bool,
}

/// The file live.json, which is removed when the socket is closed.
struct Ticketed(PathBuf);

impl Drop for Ticketed {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Opens the socket, before any file is written.
fn listen(address: &str, name: &str) -> Result<Server, u8> {
    Server::start(address, name).map_err(|e| {
        tell!("error: {e}");
        exit::INPUT
    })
}

/// Writes and prints the address of the socket.
fn announce(server: Server, out: &Path) -> Result<(Live, Ticketed), u8> {
    let at = server.address();
    let path = out.join(Ticket::FILE);
    let token = server.token().to_string();
    let ticket = Ticket { version: linkwork_live::VERSION, address: at.to_string(), token };
    ticket.write(&path).map_err(|e| fail(format!("`{}`: {e}", path.display())))?;
    tell!("note: the run listens at {at}: linkwork attach {}", out.display());
    if !at.ip().is_loopback() {
        tell!(
            "warning: {at} is accessible to other machines, and the connection is not encrypted\n  help: use 127.0.0.1 and a \
             tunnel"
        );
    }
    Ok((Live::new(server), Ticketed(path)))
}

fn start(ready: Ready, name: &str, options: &RunOptions, source: Source<'_>) -> u8 {
    match open(ready, name, options, source) {
        Ok(mut run) => run.go(options.quiet),
        Err(code) => code,
    }
}

fn open(ready: Ready, name: &str, options: &RunOptions, mut source: Source<'_>) -> Result<Run, u8> {
    let Looked { scene: (scene, scene_period), prepared } = prepare(&ready)?;
    load::warn(&ready);
    let until = match &options.until {
        Some(text) => Some(time(text, "--until")?),
        None => ready.loaded.simulation.until,
    };
    if until.is_none() && prepared.stop_when.is_none() {
        tell!("error: the end time is missing\n  help: give --until, or write `until` in the file");
        return Err(exit::INPUT);
    }
    let every =
        options.checkpoint_every.as_deref().map(|t| period(t, "--checkpoint-every")).transpose()?;
    let configuration = ready.loaded.resolved.to_string();
    let sources = ready.loaded.sources.clone();
    let balance = ready.loaded.simulation.balance.then(|| Balance::new(&ready.program)).flatten();
    let mut sim = Simulation::of(Arc::new(ready.program));
    let mut begins = None;
    match &mut source.begin {
        Begin::New => {}
        Begin::Resumed(c) => {
            not_past(c.time, until)?;
            restore(&mut sim, c)?;
            // Variables that were set in the earlier run are in the checkpoint, but not in this log.
            begins = Some(c.to_bytes().map_err(fail)?);
        }
        Begin::Forked(fork) => {
            not_past(fork.time(), until)?;
            sim = fork.take_over(sim.program().clone())?;
            if !options.no_log {
                let start = sim.checkpoint(&configuration).map_err(|e| e.to_string());
                begins = Some(start.and_then(|c| c.to_bytes()).map_err(fail)?);
            }
        }
    }
    let pinned = pin(&mut sim, options)?;
    let out = folder_of(name, options, &source);
    let log = out.join("run.mcap");
    let products = ["summary.json", "plots.svg", profile::FILE].map(|f| out.join(f));
    let mut others = [&products[..], &[log.clone(), load::sim_file(source.file)]].concat();
    if let Begin::Forked(fork) = &source.begin {
        others.extend(fork.simulation().map(load::sim_file));
    }
    let recording = recorders::recording(options, &out, &others)?;
    if !options.no_log {
        match &source.begin {
            Begin::New => {}
            Begin::Resumed(checkpoint) => keeps_earlier(&log, checkpoint.time)?,
            Begin::Forked(fork) => keeps_earlier(&log, fork.time())?,
        }
    }
    let server = options.serve.as_deref().map(|address| listen(address, name)).transpose()?;
    let folder = claim(&out, &sim, &configuration)?;
    let mut saves = Saves::new(&sim, out.clone(), name, &configuration, every);
    if let Some(most) = options.keep {
        saves = saves.keep_last(most as usize);
    }
    let picture = Picture::new(&sim, &scene, until.map(|t| t.times(1)));
    let edges = Edges::new(sim.plan());
    let profile = options.profile.then(|| sim.profile());
    let mut runner = Runner::new(sim, Watched { picture });
    let earlier = match &source.begin {
        Begin::New => None,
        Begin::Resumed(checkpoint) => Some(*checkpoint),
        Begin::Forked(fork) => Some(fork.checkpoint()),
    };
    let mut metrics = prepared.metrics;
    metrics.balance = balance;
    if let Err(e) = runner.metric(metrics, earlier) {
        tell!("warning: {e}\n  help: the metrics of this run begin at the checkpoint");
    }
    runner.save_with(saves);
    let mut files = Vec::new();
    if !options.no_log {
        let spec = LogSpec {
            groups: prepared.groups,
            transforms: Some(scene_period),
            configuration,
            about: [
                ("simulation".to_string(), name.to_string()),
                (BUILT.to_string(), linkwork_runner::built()),
            ]
            .into(),
            start: begins,
        };
        let resumed = match &source.begin {
            Begin::Resumed(checkpoint) => Some(*checkpoint),
            // A fork is a separate run: its history is in the log of the original run.
            Begin::New | Begin::Forked(_) => None,
        };
        recorders::log(&mut runner, &log, &spec, resumed).map_err(fail)?;
        files.push(log);
    }
    recorders::viewers(
        &mut runner,
        recording.as_deref(),
        options.rerun.as_deref(),
        &scene,
        scene_period,
    )
    .map_err(fail)?;
    files.extend(recording);
    if let Some(factor) = options.realtime {
        runner.pace(factor);
    }
    for (change, all) in &pinned {
        runner.tell(*change, all);
    }
    let live = server.map(|server| announce(server, &out)).transpose()?;
    Ok(Run {
        runner,
        goal: Goal { until, stop_when: prepared.stop_when, ..Goal::default() },
        name: name.to_string(),
        folder,
        files,
        problems: Vec::new(),
        dropped: 0,
        bar: bar(until, options.quiet),
        edges,
        sources,
        live,
        profile,
        verbose: options.verbose,
    })
}

/// Changes of variables, and their values.
type Pinned = Vec<(Change, Vec<(String, f64)>)>;

/// Unpins and pins variables according to the options.
fn pin(sim: &mut Simulation, options: &RunOptions) -> Result<Pinned, u8> {
    let unpin =
        options.unpin.iter().map(|path| ("--unpin", path, Change::Unpin, (path.clone(), None)));
    let pin = options.pin.iter().map(|text| ("--pin", text, Change::Pin, assignment(text)));
    let mut all = Vec::new();
    for (option, written, change, (path, value)) in unpin.chain(pin) {
        let done = changed(sim, &path, change, value.as_ref()).map_err(|e| {
            tell!("error: {option} `{written}`: {}\n  help: {}", e.message, e.help);
            exit::INPUT
        })?;
        let told = if change == Change::Pin { "pinned to" } else { "no longer pinned, at" };
        done.iter().for_each(|(path, value)| tell!("note: `{path}` is {told} {value}"));
        all.push((change, done));
    }
    Ok(all)
}

fn claim(out: &Path, sim: &Simulation, configuration: &str) -> Result<Folder, u8> {
    let folder = Folder::claim(out, sim.plan(), configuration).map_err(|e| {
        tell!("error: {e}");
        exit::INPUT
    })?;
    if let Some((aside, count)) = &folder.moved {
        tell!(
            "note: {count} checkpoints of another run or configuration were moved to `{}`",
            aside.display()
        );
    }
    Ok(folder)
}

fn restore(sim: &mut Simulation, c: &Checkpoint) -> Result<(), u8> {
    sim.restore(c).map_err(|e| {
        tell!("error: {e}");
        exit::INPUT
    })
}

fn not_past(time: f64, until: Option<Seconds>) -> Result<(), u8> {
    let Some(u) = until.filter(|u| u.seconds() < time) else { return Ok(()) };
    tell!(
        "error: the checkpoint is at {time} s, after the end at {} s\n  help: give a later --until",
        u.seconds()
    );
    Err(exit::INPUT)
}

/// Returns the folder of a run. A resumed or forked run has its own folder, so that the earlier log is kept.
fn folder_of(name: &str, options: &RunOptions, source: &Source<'_>) -> PathBuf {
    let own = match &source.begin {
        Begin::New => name.to_string(),
        Begin::Resumed(c) => format!("{name}_from_{}", time_name(c.time)),
        Begin::Forked(fork) => format!("{name}_fork_{}", time_name(fork.time())),
    };
    let folder = |own: &str| PathBuf::from("runs").join(own);
    options.out.clone().unwrap_or_else(|| match &source.begin {
        // Forks with different changes have different folders, so that they do not overwrite each other.
        Begin::Forked(_) => {
            let more = (2..).map(|n| folder(&format!("{own}_{n}")));
            let mut all = std::iter::once(folder(&own)).chain(more);
            all.find(|f| f.symlink_metadata().is_err()).unwrap_or_else(|| folder(&own))
        }
        _ => folder(&own),
    })
}

fn fail(e: String) -> u8 {
    tell!(
        "error: {e}\n  help: choose another folder with --out, or free disk space; --no-log disables the log"
    );
    exit::FAILED
}

fn bar(until: Option<Seconds>, quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let Some(until) = until else { return ProgressBar::new_spinner() };
    let bar = ProgressBar::new((until.seconds() * 1000.0) as u64);
    // The template is a valid constant.
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3}%  {msg}  eta {eta}") {
        bar.set_style(style);
    }
    bar
}

impl Run {
    /// Prints the transitions, one line each, with details on request. The end of a pin is always printed.
    fn told_moves(&mut self) {
        for (t, what, report) in self.runner.new_moves() {
            let list = |what: &str, names: &[String]| {
                (!names.is_empty()).then(|| format!("{what}: {}", names.join(", ")))
            };
            let lines = [list("new parts", &report.new), list("parts gone", &report.dropped)];
            let pins = report
                .unpinned
                .iter()
                .map(|(path, why)| format!("no longer pinned: {path}: {why}"));
            let details = lines.into_iter().flatten().chain(report.notes);
            let details = details.filter(|_| self.verbose);
            let lines: String = details.chain(pins).map(|l| format!("\n    {l}")).collect();
            self.bar.suspend(|| tell!("t = {t:.6} s: {what}{lines}"));
        }
    }

    /// Prints the notices of parts and services.
    fn told_notices(&mut self) {
        for (t, mut fault) in self.runner.new_notices() {
            fault.message.insert_str(0, &format!("t = {t:.6} s: "));
            self.bar.suspend(|| load::warn_of(&[fault], &self.sources));
        }
    }

    /// Prints the bodies that have fallen off their map.
    fn told_edges(&mut self) {
        for line in self.edges.fallen(self.runner.sim()) {
            self.bar.suspend(|| tell!("{line}"));
        }
    }

    fn go(&mut self, quiet: bool) -> u8 {
        let stop = self.runner.stop();
        // This fails only if a handler is already set (several runs in one process).
        let _ = ctrlc::set_handler(move || {
            if stop.set() {
                std::process::exit(i32::from(exit::STOPPED));
            }
        });
        let (ended, wall, simulated) = self.steps();
        let late = summary::late(&ended, self.goal.until, self.runner.sim().time());
        late.inspect(|text| self.bar.suspend(|| tell!("{text}")));
        // The state is saved before the run waits for other threads.
        if matches!(ended, Ended::Stopped | Ended::Recorder(_)) {
            self.runner.save("interrupted.lwck");
        }
        let finished = self.runner.finish_taps();
        let mut ending = summary::ending(ended);
        if let Some(e) = self.recorders(finished)
            && matches!(ending, Ending::Until | Ending::StopWhen | Ending::Interrupted)
        {
            self.runner.save("interrupted.lwck");
            ending = Ending::LogFailed(e);
        }
        self.bar.finish_and_clear();
        self.told_moves();
        self.told_notices();
        self.told_edges();
        self.told_saves();
        self.told_balance();
        let summary = self.summary(&ending, wall, simulated);
        let failed = !self.problems.is_empty();
        if !quiet {
            summary::print(&summary);
            if let Some(profile) = &self.profile {
                profile::print(profile, wall);
            }
        }
        match ending {
            Ending::Failed(e) => {
                tell!("error: {e}");
                exit::FAILED
            }
            Ending::LogFailed(e) => {
                tell!(
                    "error: {e}\n  help: free disk space, then continue with: linkwork resume {}",
                    self.folder.path().join("interrupted.lwck").display()
                );
                exit::FAILED
            }
            Ending::Interrupted if !failed => exit::STOPPED,
            _ if failed => exit::FAILED,
            _ => exit::OK,
        }
    }

    /// Steps to the end. Returns the ending, the wall time and the simulated time of this process.
    #[allow(clippy::disallowed_methods)] // The wall clock is only shown; the simulation does not use it.
    fn steps(&mut self) -> (Ended, f64, f64) {
        let clock = Instant::now();
        let begin = self.runner.sim().time();
        let (mut chunk, mut last) = (1, clock);
        let ended = loop {
            let mut steps = chunk;
            let mut brisk = false;
            if let Some((live, _)) = &mut self.live {
                let stood;
                (steps, stood) = live.attend(&mut self.runner, chunk);
                brisk = live.is_attended();
                if stood {
                    self.runner.pace_again();
                }
                last = Instant::now();
            }
            match self.runner.go(&mut self.goal, steps) {
                Pause::Ended(ended) => break ended,
                Pause::Calls(_) | Pause::Chunk => {}
            }
            // Make steps for some hundredths of a second, or some milliseconds if a client waits.
            let now = Instant::now();
            let took = now - last;
            last = now;
            let [short, long] = if brisk { [2, 5] } else { [20, 80] }.map(Duration::from_millis);
            if took < short && steps == chunk {
                chunk = (2 * chunk).min(1 << 20);
            } else if took > long {
                chunk = (chunk / 2).max(1);
            }
            let failed = self.runner.ended_taps();
            self.recorders(failed);
            self.told_saves();
            self.told_moves();
            self.told_notices();
            self.told_edges();
            if !self.bar.is_hidden() {
                let (t, wall) = (self.runner.sim().time(), clock.elapsed().as_secs_f64());
                self.bar.set_position((t * 1000.0) as u64);
                let factor = (t - begin) / wall.max(1e-9);
                self.bar.set_message(format!("t = {t:.1} s, {factor:.0} × real time"));
            }
        };
        let time = self.runner.sim().time();
        if let Some((mut live, _)) = self.live.take() {
            live.finish(time);
        }
        (ended, clock.elapsed().as_secs_f64(), self.runner.sim().time() - begin)
    }

    /// Prints how recorders ended. Returns the message of one that the run needs.
    fn recorders(&mut self, ends: Vec<RecorderEnd>) -> Option<String> {
        let mut fatal = None;
        for end in ends {
            self.dropped += end.dropped;
            for when in &end.unmet {
                self.bar.suspend(|| {
                    tell!("warning: the log does not have samples around `{when}`, because it never became true");
                });
            }
            match (end.result, end.need) {
                (Ok(()), _) => {}
                (Err(e), Need::Must) => fatal = Some(e),
                (Err(e), Need::Should) => {
                    self.problem(
                        &format!("the recording: {e}"),
                        "the run and its log are complete",
                    );
                }
                (Err(e), Need::May) => no_viewer(&e),
            }
        }
        fatal
    }

    /// Reports a file that could not be written, now and in the exit code.
    fn problem(&mut self, e: &str, help: &str) {
        self.bar.suspend(|| tell!("error: {e}\n  help: {help}"));
        self.problems.push(e.to_string());
    }

    /// Reports checkpoints that could not be written since the last call.
    fn told_saves(&mut self) {
        let failures = self.runner.new_save_failures();
        for e in failures {
            self.problem(
                &e,
                "free disk space, or choose another folder with --out; the run continues",
            );
        }
    }

    /// Prints a warning for each part whose balance is not closed.
    fn told_balance(&self) {
        let warnings = self.balance().map(Balance::warnings).unwrap_or_default();
        self.bar.suspend(|| load::warn_of(&warnings, &self.sources));
    }

    /// Returns the balances of the run, if enabled.
    fn balance(&self) -> Option<&Balance> {
        self.runner.metrics().and_then(|metrics| metrics.balance.as_ref())
    }

    /// Writes the summary, then the picture: a picture can wait, and can fail.
    fn summary(&mut self, ending: &Ending, wall: f64, simulated: f64) -> Summary {
        if let Some(saves) = self.runner.saves() {
            self.files.extend(saves.written.iter().cloned());
            if saves.failed > 1 {
                self.problems.push(format!("{} checkpoints were not written", saves.failed));
            }
        }
        if let Some(profile) = self.profile.clone() {
            let folded = self.folder.path().join(profile::FILE);
            match profile::write(&profile, wall, &self.name, &folded) {
                Ok(()) => self.files.push(folded),
                Err(e) => self.problem(&e, "free disk space, or choose another folder with --out"),
            }
        }
        let sim = self.runner.sim();
        let mut summary = Summary {
            simulation: self.name.clone(),
            ended: ending.clone(),
            time: sim.time(),
            state_hash: format!("{:016x}", sim.hash()),
            wall_time: wall,
            real_time_factor: simulated / wall.max(1e-9),
            realtime: self.runner.realtime(),
            seed: sim.plan().seed,
            built: linkwork_runner::built(),
            phases: summary::phases(sim),
            metrics: self.runner.metrics().map(summary::metrics).unwrap_or_default(),
            balances: self.balance().map(Balance::report).unwrap_or_default(),
            files: self.files.clone(),
            problems: self.problems.clone(),
            rows_dropped: self.dropped,
        };
        let path = self.folder.path().join("summary.json");
        let mut written = summary.write(&path);
        let picture = self.folder.path().join("plots.svg");
        if !self.runner.watch.picture.is_empty() {
            match self.runner.watch.picture.draw(&picture) {
                Ok(()) => summary.files.push(picture),
                Err(e) => {
                    let _ = std::fs::remove_file(&picture);
                    self.problem(&e, "free disk space, or choose another folder with --out");
                }
            }
            summary.problems.clone_from(&self.problems);
            written = summary.write(&path);
        }
        match written {
            Ok(()) => summary.files.push(path),
            Err(e) => self.problem(&e, "free disk space, or choose another folder with --out"),
        }
        summary
    }
}

fn no_viewer(e: &str) {
    tell!(
        "warning: the viewer: {e}\n  help: the run and its log are complete; for --rerun start a viewer first: \
         `rerun` (pip install rerun-sdk==0.36.3)"
    );
}
