//! `linkwork run` and `resume`: stepping with taps, checkpoints, progress, and an orderly end.
use crate::figures::{Figures, Running};
use crate::load::{self, Ready};
use crate::summary::{self, Ending, Picture, Summary};
use crate::{exit, scene};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use linkwork_assembly::{Failure, match_patterns};
use linkwork_record::{Log, LogSpec};
use linkwork_runtime::{
    Checkpoint, Fault, Place, Plan, Role, RunError, Seconds, Simulation, Snapshot, Tap, Value,
};
use linkwork_viz::{Scene, Sink, Viewer};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// What a run may be told.
#[derive(Args, Clone, Debug, Default)]
pub struct RunOptions {
    /// Simulated time at which to stop, e.g. 20, "20 s", "2 min".
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub until: Option<String>,
    /// Folder for the files; `runs/NAME` unless given.
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Write a checkpoint every so much simulated time, e.g. "10 s".
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub checkpoint_every: Option<String>,
    /// Also stream to a running Rerun viewer (at an address, or at Rerun's usual one).
    #[arg(long, value_name = "URL", num_args = 0..=1, default_missing_value = "")]
    pub rerun: Option<String>,
    /// Where the Rerun recording goes; `off` writes none.
    #[arg(long, value_name = "FILE|off")]
    pub save_rrd: Option<String>,
    /// Write no MCAP log.
    #[arg(long)]
    pub no_log: bool,
    /// Do not run faster than real time.
    #[arg(long)]
    pub realtime: bool,
    /// No progress bar and no summary on the terminal.
    #[arg(long, short)]
    pub quiet: bool,
}

/// What is looked up before a run: nothing is written before all of it is right.
pub struct Prepared {
    /// The scene and the period of its rows.
    pub scene: (Scene, Seconds),
    /// Variables to log.
    pub groups: Vec<(Seconds, Vec<String>)>,
    /// Figures.
    pub figures: Figures,
    /// The variable that stops the run.
    pub stop_when: Option<Place>,
}

/// Looks up every pattern and variable that the file names.
pub fn prepare(ready: &Ready) -> Result<Prepared, u8> {
    let (plan, file) = (&ready.plan, &ready.loaded.simulation);
    let mut faults: Vec<Fault> = Vec::new();
    let names = load::names(plan);
    let mut groups = Vec::new();
    for rule in &file.log {
        match match_patterns(&rule.channels, &names) {
            Ok(found) => groups.push((
                rule.rate.unwrap_or(plan.step),
                found.iter().map(|&k| names[k].to_string()).collect(),
            )),
            Err(mut f) => faults.append(&mut f),
        }
    }
    let figures = Figures::new(plan, &file.figures).map_err(|mut f| faults.append(&mut f));
    let stop_when = file.stop_when.as_ref().and_then(|t| match plan.variable(&t.text) {
        Ok(v) => Some(v.place),
        Err(e) => {
            faults.push(Fault::new(t.origin, format!("stop_when: {}", e.message)).help(e.help));
            None
        }
    });
    let title = title(ready);
    let scene = scene::scene(&title, &ready.loaded, plan).map_err(|mut f| faults.append(&mut f));
    match (scene, figures) {
        (Ok(scene), Ok(figures)) if faults.is_empty() => {
            Ok(Prepared { scene, groups, figures, stop_when })
        }
        _ => Err(load::report(&Failure { faults, sources: ready.loaded.sources.clone() })),
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
        Ok(ready) => start(ready, &name, options, None),
        Err(code) => code,
    }
}

fn title_of(sim: &Path) -> String {
    let file = load::sim_file(sim);
    let absolute = std::path::absolute(&file).unwrap_or(file);
    let stem = absolute.file_stem().and_then(|s| s.to_str()).unwrap_or("simulation");
    let folder = absolute.parent().and_then(Path::file_name).and_then(|f| f.to_str());
    if stem == "sim" { folder.unwrap_or(stem).to_string() } else { stem.to_string() }
}

/// `linkwork resume`.
pub fn resume(file: &Path, options: &RunOptions) -> u8 {
    let checkpoint = match Checkpoint::read(file) {
        Ok(c) => c,
        Err(e) => {
            eprintln!("error: {e}\n  help: give a .lwck file that `linkwork run` wrote, whole");
            return exit::INPUT;
        }
    };
    let name = checkpoint
        .extra
        .get("name")
        .map_or_else(|| "resumed".to_string(), |n| String::from_utf8_lossy(n).into_owned());
    match load::ready_text(&format!("{name}.ron"), &checkpoint.configuration) {
        Ok(ready) => start(ready, &name, options, Some(&checkpoint)),
        Err(code) => code,
    }
}

fn time(text: &str, what: &str) -> Result<Seconds, u8> {
    let value = text.parse::<f64>().map_or_else(|_| Value::Text(text.to_string()), Value::Number);
    let read = match &value {
        Value::Number(x) => (*x >= 0.0).then(|| Seconds::from_decimal(*x)).flatten(),
        // A rate is no time here: "2 Hz" would mean half a second.
        text => Seconds::period(text).ok().filter(|_| !value.to_string().contains("Hz")),
    };
    read.ok_or_else(|| {
        eprintln!("error: {what} `{text}` is not a time\n  help: write 20, \"20 s\" or \"2 min\"");
        exit::INPUT
    })
}

/// What a tap feeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Feeds {
    /// The log: without it a run is not worth going on.
    Log,
    /// The viewer: it never changes the run, not even when it fails.
    Viewer,
}

struct Runner {
    sim: Simulation,
    name: String,
    out: PathBuf,
    configuration: String,
    figures: Figures,
    picture: Picture,
    taps: Vec<(Tap, Feeds)>,
    files: Vec<PathBuf>,
    stop_when: Option<Place>,
    until: Option<Seconds>,
    every: Option<Seconds>,
    realtime: bool,
    bar: ProgressBar,
}

fn start(ready: Ready, name: &str, options: &RunOptions, from: Option<&Checkpoint>) -> u8 {
    match try_start(ready, name, options, from) {
        Ok(code) | Err(code) => code,
    }
}

fn try_start(
    ready: Ready,
    name: &str,
    options: &RunOptions,
    from: Option<&Checkpoint>,
) -> Result<u8, u8> {
    let prepared = prepare(&ready)?;
    let file = &ready.loaded.simulation;
    let until = match &options.until {
        Some(text) => Some(time(text, "--until")?),
        None => file.until,
    };
    if until.is_none() && prepared.stop_when.is_none() {
        eprintln!(
            "error: nothing says when to stop\n  help: give --until, or write `until` in the file"
        );
        return Err(exit::INPUT);
    }
    let every =
        options.checkpoint_every.as_deref().map(|t| time(t, "--checkpoint-every")).transpose()?;
    if every.is_some_and(|e| e.num == 0) {
        eprintln!("error: --checkpoint-every is zero\n  help: write 10, \"10 s\" or \"2 min\"");
        return Err(exit::INPUT);
    }
    let mut sim = Simulation::new(Arc::new(ready.plan));
    let mut figures = prepared.figures;
    if let Some(c) = from {
        if let Err(e) = sim.restore(c) {
            eprintln!("error: {e}");
            return Err(exit::INPUT);
        }
        if let Some(u) = until.filter(|u| u.seconds() < c.time) {
            eprintln!(
                "error: the checkpoint is at {} s, which is past the end at {} s\n  help: give a later --until",
                c.time,
                u.seconds()
            );
            return Err(exit::INPUT);
        }
        let kept: Option<Vec<Running>> =
            c.extra.get("figures").and_then(|b| rmp_serde::from_slice(b).ok());
        if let Some(kept) = kept.filter(|k| k.len() == figures.running.len()) {
            figures.running = kept;
        }
    }
    // A resumed run has a folder of its own: the log of what came before is kept.
    let folder = from.map_or(name.to_string(), |c| format!("{name}_from_{}", trim(c.time)));
    let out = options.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(folder));
    std::fs::create_dir_all(&out).map_err(|e| {
        eprintln!("error: the folder `{}` cannot be made: {e}", out.display());
        exit::INPUT
    })?;
    let (mut taps, mut files) = (Vec::new(), Vec::new());
    if !options.no_log {
        let path = out.join("run.mcap");
        let spec = LogSpec {
            groups: prepared.groups,
            transforms: Some(prepared.scene.1),
            configuration: ready.loaded.resolved.clone(),
            about: [("simulation".to_string(), name.to_string())].into(),
        };
        let opened = Log::create(&path, sim.plan(), &spec).map_err(|e| e.to_string()).and_then(
            |(log, groups)| Tap::start(&sim, groups, 256, Box::new(log)).map_err(|e| e.to_string()),
        );
        taps.push((opened.map_err(fail)?, Feeds::Log));
        files.push(path);
    }
    if let Some(sink) = sink(options, &out) {
        if let Sink::File(path) | Sink::Both(path, _) = &sink {
            files.push(path.clone());
        }
        let opened = Viewer::open(&sink, sim.plan(), &prepared.scene.0, prepared.scene.1)
            .map_err(|e| e.to_string())
            .and_then(|(viewer, groups)| {
                Tap::start(&sim, groups, 256, Box::new(viewer)).map_err(|e| e.to_string())
            });
        taps.push((opened.map_err(fail)?, Feeds::Viewer));
    }
    let picture = Picture::new(&sim, &prepared.scene.0);
    let bar = bar(until, options.quiet);
    let mut runner = Runner {
        picture,
        sim,
        name: name.to_string(),
        out,
        configuration: ready.loaded.resolved,
        figures,
        taps,
        files,
        stop_when: prepared.stop_when,
        until,
        every,
        realtime: options.realtime,
        bar,
    };
    Ok(runner.go(options.quiet))
}

fn fail(e: String) -> u8 {
    eprintln!(
        "error: {e}\n  help: choose another folder with --out, or make room; --no-log writes no log"
    );
    exit::FAILED
}

fn sink(options: &RunOptions, out: &Path) -> Option<Sink> {
    let file = match options.save_rrd.as_deref() {
        Some("off") => None,
        Some(path) => Some(PathBuf::from(path)),
        None => Some(out.join("run.rrd")),
    };
    let live = options.rerun.as_ref().map(|u| (!u.is_empty()).then(|| u.clone()));
    match (file, live) {
        (Some(f), Some(l)) => Some(Sink::Both(f, l)),
        (Some(f), None) => Some(Sink::File(f)),
        (None, Some(l)) => Some(Sink::Live(l)),
        (None, None) => None,
    }
}

fn bar(until: Option<Seconds>, quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let Some(until) = until else { return ProgressBar::new_spinner() };
    let bar = ProgressBar::new((until.seconds() * 1000.0) as u64);
    // The template is a constant that parses.
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3}%  {msg}  eta {eta}") {
        bar.set_style(style);
    }
    bar
}

impl Runner {
    fn go(&mut self, quiet: bool) -> u8 {
        let stop = Arc::new(AtomicBool::new(false));
        let flag = stop.clone();
        // Fails only when a handler is already set (several runs in one process).
        let _ = ctrlc::set_handler(move || {
            if flag.swap(true, Ordering::SeqCst) {
                std::process::exit(i32::from(exit::STOPPED));
            }
        });
        let (ending, wall) = self.steps(&stop);
        let mut ending = ending;
        for (tap, feeds) in self.taps.drain(..) {
            match (tap.finish(), feeds, &ending) {
                (Ok(()), ..) => {}
                (Err(e), Feeds::Viewer, _) => no_viewer(&e),
                (Err(e), _, Ending::Until | Ending::StopWhen | Ending::Interrupted) => {
                    ending = Ending::LogFailed(e);
                }
                _ => {}
            }
        }
        self.bar.finish_and_clear();
        if matches!(ending, Ending::Interrupted | Ending::LogFailed(_)) {
            self.save(
                &self.sim.checkpoint(&self.configuration).map_err(|e| e.to_string()),
                "interrupted.lwck",
            );
        }
        let picture = self.out.join("plots.svg");
        match self.picture.draw(&picture) {
            Ok(()) if picture.exists() => self.files.push(picture),
            Ok(()) => {}
            Err(e) => eprintln!("warning: {e}"),
        }
        let time = self.sim.time();
        let summary = Summary {
            simulation: self.name.clone(),
            time,
            state_hash: format!("{:016x}", self.sim.hash()),
            wall_time: wall.0,
            real_time_factor: wall.1 / wall.0.max(1e-9),
            seed: self.sim.plan().seed,
            figures: summary::figures(&self.figures),
            files: self.files.clone(),
            ended: ending.clone(),
        };
        let path = self.out.join("summary.json");
        let text = serde_json::to_string_pretty(&summary).unwrap_or_default();
        if let Err(e) = std::fs::write(&path, text + "\n") {
            eprintln!("error: `{}`: {e}", path.display());
        }
        if !quiet {
            summary::print(&Summary {
                files: [summary.files.clone(), vec![path]].concat(),
                ..summary
            });
        }
        match ending {
            Ending::Until | Ending::StopWhen => exit::OK,
            Ending::Interrupted => exit::STOPPED,
            Ending::Failed(e) => {
                eprintln!("error: {e}");
                exit::FAILED
            }
            Ending::LogFailed(e) => {
                eprintln!(
                    "error: {e}\n  help: make room, then go on with: linkwork resume {}",
                    self.out.join("interrupted.lwck").display()
                );
                exit::FAILED
            }
        }
    }

    /// Steps to the end. Gives the ending, the wall time and the simulated time of this process.
    #[allow(clippy::disallowed_methods)] // The wall clock is shown, never simulated.
    fn steps(&mut self, stop: &AtomicBool) -> (Ending, (f64, f64)) {
        let clock = Instant::now();
        let begin = self.sim.time();
        let mut shown = 0.0;
        let mut next_save = self.every.map(|e| self.next_multiple(e));
        let mut rescue = (Snapshot::default(), self.figures.running.clone());
        let mut next_rescue = begin;
        self.figures.begin(&self.sim);
        let ending = loop {
            if let Err(e) = self.observe() {
                break Ending::LogFailed(e);
            }
            // A step checks itself: this finds what is bad from the start.
            if self.sim.time() == begin
                && let Err(e) = self.sim.check()
            {
                break Ending::Failed(format!(
                    "{e}\n  help: it is so from the start; look at what drives `{}`, and at its parameters",
                    e.path
                ));
            }
            if let Some((at, every)) = next_save
                && !self.sim.before(at)
            {
                let name = format!("checkpoint_{}.lwck", trim(self.sim.time()));
                self.save(
                    &self.sim.checkpoint(&self.configuration).map_err(|e| e.to_string()),
                    &name,
                );
                next_save = Some(self.next_multiple(every));
            }
            if self.stop_when.is_some_and(|p| self.sim.value(p) > 0.5) {
                break Ending::StopWhen;
            }
            if self.until.is_some_and(|u| !self.sim.before(u)) {
                break Ending::Until;
            }
            if stop.load(Ordering::Relaxed) {
                break Ending::Interrupted;
            }
            let t = self.sim.time();
            if t >= next_rescue {
                // For a failed run: the state a second before.
                let _ = self.sim.save_into(&mut rescue.0);
                rescue.1.clone_from(&self.figures.running);
                next_rescue = t + 1.0;
            }
            if let Err(e) = self.sim.step() {
                self.rescue(&rescue.0, &rescue.1);
                break Ending::Failed(explain(&e));
            }
            self.figures.sample(&self.sim);
            if self.realtime || !self.bar.is_hidden() {
                let wall = clock.elapsed().as_secs_f64();
                let ahead = t - begin - wall;
                if self.realtime && ahead > 0.0 {
                    std::thread::sleep(std::time::Duration::from_secs_f64(ahead));
                }
                if wall > shown + 0.1 {
                    shown = wall;
                    self.bar.set_position((t * 1000.0) as u64);
                    self.bar.set_message(format!(
                        "t = {t:.1} s, {:.0} × real time",
                        (t - begin) / wall
                    ));
                }
            }
        };
        (ending, (clock.elapsed().as_secs_f64(), self.sim.time() - begin))
    }

    fn observe(&mut self) -> Result<(), String> {
        self.picture.sample(&self.sim);
        let mut gone = None;
        for (k, (tap, feeds)) in self.taps.iter_mut().enumerate() {
            match (tap.sample(&self.sim), feeds) {
                (Ok(()), _) => {}
                (Err(e), Feeds::Log) => return Err(e),
                (Err(e), Feeds::Viewer) => {
                    no_viewer(&e);
                    gone = Some(k);
                }
            }
        }
        if let Some(k) = gone {
            self.taps.remove(k);
        }
        Ok(())
    }

    fn next_multiple(&self, every: Seconds) -> (Seconds, Seconds) {
        let k = (self.sim.time() / every.seconds() + 1e-9).floor() as u128 + 1;
        let at = Seconds::new(u128::from(every.num) * k, u128::from(every.den)).unwrap_or(every);
        (at, every)
    }

    fn save(&mut self, checkpoint: &Result<Checkpoint, String>, name: &str) {
        let path = self.out.join(name);
        let written = checkpoint.clone().and_then(|mut c| {
            c.extra.insert("name".into(), self.name.clone().into_bytes());
            let figures =
                rmp_serde::to_vec_named(&self.figures.running).map_err(|e| e.to_string())?;
            c.extra.insert("figures".into(), figures);
            let signals =
                rmp_serde::to_vec(&signals(self.sim.plan())).map_err(|e| e.to_string())?;
            c.extra.insert("signals".into(), signals);
            c.write(&path).map_err(|e| e.to_string())
        });
        match written {
            Ok(()) => self.files.push(path),
            Err(e) => eprintln!("error: {e}"),
        }
    }

    /// After a failure: writes the last good state, about a second before.
    fn rescue(&mut self, snapshot: &Snapshot, figures: &[Running]) {
        let mut sim = self.sim.fork();
        if sim.load_from(snapshot).is_ok() {
            let checkpoint = sim.checkpoint(&self.configuration).map_err(|e| e.to_string());
            let last = std::mem::replace(&mut self.figures.running, figures.to_vec());
            self.save(&checkpoint, "before_failure.lwck");
            self.figures.running = last;
        }
    }
}

/// Names of the signal lanes, for `diff`; a lane that only carries an input goes without.
fn signals(plan: &Plan) -> Vec<String> {
    let mut names = vec![String::new(); plan.sizes.sig];
    for (path, v) in &plan.variables {
        if let (Place::Signal(k), true) = (v.place, v.role != Role::Input) {
            names[k as usize].clone_from(path);
        }
    }
    names
}

fn explain(e: &RunError) -> String {
    // What fails at once mostly starts where it cannot be.
    let start = if e.time < 0.2 {
        "; a machine that starts inside the ground is thrown out of it: see `place`"
    } else {
        ""
    };
    format!(
        "{e}\n  help: the log and before_failure.lwck hold what led to it; try a smaller step, and look at what drives `{}`{start}",
        e.path
    )
}

fn no_viewer(e: &str) {
    eprintln!(
        "warning: {e}\n  help: the run and its log are whole; for --rerun start a viewer first: \
         `rerun` (pip install rerun-sdk==0.36.3)"
    );
}

/// `10`, `2.5`: a time in a file name.
fn trim(t: f64) -> String {
    format!("{t:.3}").trim_end_matches('0').trim_end_matches('.').to_string()
}
