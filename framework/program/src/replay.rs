//! `linkwork replay`: simulates again what a log holds, and compares every number.
use crate::voice::report;
use crate::{exit, load, taps};
use linkwork_assembly::Failure;
use linkwork_record::{End, Log, LogContents, LogSpec, Series, read_log, read_log_contents};
use linkwork_runtime::{Checkpoint, Program, Rule, SetRow, Simulation, Tap};
use std::collections::BTreeMap;
use std::iter::Peekable;
use std::path::Path;
use std::slice::Iter;
use std::sync::Arc;

/// The first number that is not as logged.
#[derive(Clone, Debug, PartialEq)]
pub struct Deviation {
    /// The variable.
    pub path: String,
    /// Simulated time (s).
    pub time: f64,
    /// What the log says.
    pub logged: f64,
    /// What came out now.
    pub now: f64,
    /// Other variables that deviate first at the same time.
    pub others: usize,
}

/// What was compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compared {
    /// Numbers.
    pub numbers: usize,
    /// Simulated time of the last row (s).
    pub until: f64,
}

/// Sets, pins and unpins what was set, pinned and unpinned from outside at the present tick, before its rows.
fn set(sim: &mut Simulation, sets: &mut Peekable<Iter<'_, SetRow>>) -> Result<(), String> {
    while let Some(set) = sets.next_if(|set| set.tick <= sim.state().tick) {
        let done = sim.change(&set.path, set.change, set.value);
        done.map_err(|e| format!("what was set: {e}"))?;
    }
    Ok(())
}

/// Simulates from the start, or from the checkpoint that the log carries, as far as `logged` goes, with a log of its own in `file`, and compares the two, bit
/// for bit.
fn compare(
    program: &Arc<Program>,
    (start, sets): (Option<&Checkpoint>, &[SetRow]),
    spec: &LogSpec,
    logged: &BTreeMap<String, Series>,
    file: &Path,
) -> Result<Result<Compared, Deviation>, String> {
    let last = logged.values().filter_map(|s| s.t.last()).copied().fold(0.0, f64::max);
    let (log, groups) = Log::create(file, program, spec).map_err(|e| e.to_string())?;
    let mut sim = Simulation::of(program.clone());
    if let Some(start) = start {
        sim.restore(start).map_err(|e| e.to_string())?;
    }
    let tap = Tap::start(&sim, groups, 64, Box::new(log));
    let mut tap = tap.map_err(|e| e.to_string())?;
    if let Some(start) = start {
        // What it does not remember the log did not know either.
        let _ = taps::go_on(&mut tap, start, &sim);
    }
    let mut sets = sets.iter().peekable();
    set(&mut sim, &mut sets)?;
    tap.sample(&sim)?;
    // The last rows may be those before an event, and nothing else says when it came.
    let before = |rule: &Rule| rule.around.as_ref().map_or(0.0, |a| a.before.seconds());
    let beyond = spec.groups.iter().map(before).fold(0.0, f64::max);
    // Times in logs are rounded to nanoseconds.
    while sim.time() < last + beyond - 1e-9 {
        match sim.step() {
            Ok(()) => {}
            Err(_) if sim.time() > last - 1e-9 => break,
            Err(e) => return Err(format!("the run fails where the log goes on: {e}")),
        }
        set(&mut sim, &mut sets)?;
        tap.sample(&sim)?;
    }
    tap.finish()?;
    let now = read_log(file).map_err(|e| e.to_string())?;
    let mut compared = Compared { numbers: 0, until: last };
    let mut found: Option<Deviation> = None;
    for (path, was) in logged {
        let Some(is) = now.get(path) else {
            return Err(format!("the simulation of its configuration logs no `{path}`"));
        };
        // A log of a resumed run begins later.
        let first = was.t.first().map_or(0, |t| is.t.partition_point(|u| u < t));
        if is.t.get(first..first + was.t.len()) != Some(&was.t[..]) {
            return Err(format!("`{path}` has rows at other times than the simulation gives it"));
        }
        compared.numbers += was.y.len();
        let pairs = was.y.iter().zip(&is.y[first..]);
        let differs =
            |(a, b): (&f64, &f64)| a.to_bits() != b.to_bits() && !(a.is_nan() && b.is_nan());
        let Some(k) = pairs.clone().position(differs) else { continue };
        let one = |others: usize| Deviation {
            path: path.clone(),
            time: was.t[k],
            logged: was.y[k],
            now: is.y[first + k],
            others,
        };
        found = Some(match found {
            Some(d) if d.time < was.t[k] => d,
            Some(d) if d.time == was.t[k] => Deviation { others: d.others + 1, ..d },
            _ => one(0),
        });
    }
    Ok(found.map_or(Ok(compared), Err))
}

/// `linkwork replay LOG --verify`.
pub fn verify(file: &Path) -> u8 {
    let log = match read_log_contents(file) {
        Ok(log) => log,
        Err(e) => {
            tell!("error: {e}");
            return exit::INPUT;
        }
    };
    let name = file.display();
    let LogContents { series, configuration, about, start, sets, end } = log;
    let missing = match (configuration.is_empty(), series.is_empty()) {
        (true, _) => Some("carries no configuration"),
        (_, true) => Some("holds no numbers"),
        _ => None,
    };
    if let Some(what) = missing {
        tell!("error: log `{name}` {what}\n  help: give a .mcap file that `linkwork run` wrote");
        return exit::INPUT;
    }
    let start = match start.as_deref().map(Checkpoint::from_bytes).transpose() {
        Ok(start) => start,
        Err(e) => {
            tell!(
                "error: log `{name}`: the checkpoint that it begins from: {e}\n  help: make the log again"
            );
            return exit::INPUT;
        }
    };
    let ready = match load::ready_text("configuration.ron", &configuration) {
        Ok(ready) => ready,
        Err(code) => return code,
    };
    let plan = format!("{:016x}", ready.plan().hash());
    if about.get("plan").is_some_and(|logged| *logged != plan) {
        tell!(
            "warning: the plan is not that of the log ({} then, {plan} now): a file that it reads has changed, or this \
             program is another version",
            about["plan"]
        );
    }
    let prepared = match linkwork_runner::prepare(ready.plan(), &ready.loaded.simulation) {
        Ok(prepared) => prepared,
        Err(faults) => {
            return report(&Failure { faults, sources: ready.loaded.sources.clone() });
        }
    };
    let spec = LogSpec { groups: prepared.groups, ..LogSpec::default() };
    let base = ready.plan().base;
    let program = Arc::new(ready.program);
    let own = std::env::temp_dir().join(format!("linkwork-replay-{}.mcap", std::process::id()));
    let outcome = compare(&program, (start.as_ref(), &sets), &spec, &series, &own);
    let _ = std::fs::remove_file(&own);
    match outcome {
        Ok(Ok(Compared { numbers, until })) => {
            let n = series.len();
            say!("verified: {numbers} numbers of {n} variables until {until} s, bit for bit");
            if let End::Cut { at } = end {
                say!("    the log has no end: it was cut after {at} bytes");
            }
            exit::OK
        }
        Ok(Err(d)) => {
            let others = match d.others {
                0 => String::new(),
                n => format!(" ({n} more variables at this tick)"),
            };
            say!(
                "`{}` deviates first, at tick {} (t = {} s): logged {:?}, now {:?}{others}",
                d.path,
                (d.time / base.seconds()).round(),
                d.time,
                d.logged,
                d.now
            );
            exit::FAILED
        }
        Err(e) => {
            tell!("error: log `{name}`: {e}");
            exit::FAILED
        }
    }
}
