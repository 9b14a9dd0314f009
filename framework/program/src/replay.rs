//! `linkwork replay`: repeats the simulation of a log and compares every number.
use crate::voice::report;
use crate::{exit, load, recorders};
use linkwork_assembly::Failure;
use linkwork_record::{End, LogContents, Series, read_log_contents, seconds};
use linkwork_runner::BUILT;
use linkwork_runtime::{Checkpoint, Consumer, Program, Recorder, Rule, Sample, SetRow, Simulation};
use std::collections::BTreeMap;
use std::iter::Peekable;
use std::path::Path;
use std::slice::Iter;
use std::sync::{Arc, Mutex, PoisonError};

/// The first number that differs from the log.
#[derive(Clone, Debug, PartialEq)]
pub struct Deviation {
    /// The variable.
    pub path: String,
    /// Simulated time (s).
    pub time: f64,
    /// The number in the log.
    pub logged: f64,
    /// The number in the repeated simulation.
    pub now: f64,
    /// Number of other variables that differ first at the same time.
    pub others: usize,
}

/// The compared data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compared {
    /// Numbers.
    pub numbers: usize,
    /// Simulated time of the last sample (s).
    pub until: f64,
}

/// Repeats the changes from outside (set, pin, unpin) at the present tick, before its samples.
fn set(sim: &mut Simulation, sets: &mut Peekable<Iter<'_, SetRow>>) -> Result<(), String> {
    while let Some(set) = sets.next_if(|set| set.tick <= sim.state().tick) {
        let done = sim.change(&set.path, set.change, set.value);
        done.map_err(|e| format!("a variable that was set: {e}"))?;
    }
    Ok(())
}

/// A series of the log, and which of its samples have been compared.
struct Logged {
    path: String,
    series: Series,
    /// Index of the next expected sample.
    next: usize,
    came: Vec<bool>,
}

impl Logged {
    /// Returns the place of the row at this time; `None` without such a row.
    fn place(&mut self, t: f64) -> Option<usize> {
        let times = &self.series.t;
        if times.get(self.next) != Some(&t) {
            self.next = times.partition_point(|u| *u < t);
        }
        let place = self.next;
        (times.get(place) == Some(&t)).then(|| {
            self.next += 1;
            place
        })
    }
}

/// State of the comparison.
#[derive(Default)]
struct Findings {
    logged: Vec<Logged>,
    found: Option<Deviation>,
    fault: Option<String>,
}

/// Compares each sample with the log. It does not write files, and the run ends at the first difference.
struct Verify {
    findings: Arc<Mutex<Findings>>,
    /// The series of each group's columns, and whether a column is a truth value.
    columns: Vec<Vec<(usize, bool)>>,
    /// Largest delay (s) of samples that wait for an event.
    beyond: f64,
}

impl Consumer for Verify {
    fn row(&mut self, row: &Sample) -> Result<(), String> {
        let mut findings = self.findings.lock().unwrap_or_else(PoisonError::into_inner);
        let Findings { logged, found, fault } = &mut *findings;
        let t = seconds(row.ns);
        if found.as_ref().is_some_and(|d| t > d.time + self.beyond) {
            return Err("they differ".into());
        }
        for ((series, truth), y) in self.columns[row.group as usize].iter().zip(&row.values) {
            let Logged { series: Series { t: times, .. }, path, .. } = &logged[*series];
            // In a truncated log, some variables end earlier than others.
            if times.last().is_none_or(|last| t > *last) {
                continue;
            }
            let now = if *truth { f64::from(u8::from(*y > 0.5)) } else { *y };
            let path = path.clone();
            let Some(place) = logged[*series].place(t) else {
                *fault = Some(format!(
                    "the simulation has a sample of `{path}` at t = {t} s, but the log does not"
                ));
                return Err("they differ".into());
            };
            logged[*series].came[place] = true;
            let was = logged[*series].series.y[place];
            if was.to_bits() == now.to_bits() || (was.is_nan() && now.is_nan()) {
                continue;
            }
            let one = Deviation { path, time: t, logged: was, now, others: 0 };
            *found = Some(match found.take() {
                Some(d) if d.time < t => d,
                Some(d) if d.time == t && d.path == one.path => d,
                Some(d) if d.time == t => Deviation { others: d.others + 1, ..d },
                _ => one,
            });
        }
        Ok(())
    }
    fn finish(&mut self) -> Result<(), String> {
        Ok(())
    }
}

/// Simulates from the start, or from the checkpoint in the log, as far as `logged` extends, and compares the two bit by bit. It ends at the first
/// difference. A sample that the log does not have at its time is a difference, so a damaged or forged log cannot make it run longer than there are
/// samples.
fn compare(
    program: &Arc<Program>,
    (start, sets): (Option<&Checkpoint>, &[SetRow]),
    rules: &[Rule],
    logged: BTreeMap<String, Series>,
) -> Result<Result<Compared, Deviation>, String> {
    let last = logged.values().filter_map(|s| s.t.last()).copied().fold(0.0, f64::max);
    let mut sim = Simulation::of(program.clone());
    if let Some(start) = start {
        sim.restore(start).map_err(|e| e.to_string())?;
        if sim.time() > last {
            return Err(format!(
                "its samples end at {last} s, before the checkpoint at {} s from which it begins",
                sim.time()
            ));
        }
    }
    let logged: Vec<Logged> = logged
        .into_iter()
        .map(|(path, series)| Logged { came: vec![false; series.t.len()], path, series, next: 0 })
        .collect();
    let (mut groups, mut columns) = (Vec::new(), Vec::new());
    for rule in rules {
        let linkwork_record::Columns { group, variables } =
            linkwork_record::columns(sim.plan(), rule);
        let place = |path: &String| logged.iter().position(|l| l.path == *path);
        let own = variables.iter().map(|(path, truth)| {
            let place = place(path).ok_or_else(|| {
                format!(
                    "it does not contain `{path}`, which the simulation of its configuration logs"
                )
            });
            Ok((place?, *truth))
        });
        columns.push(own.collect::<Result<Vec<_>, String>>()?);
        groups.push(group);
    }
    let known = |k: &usize| columns.iter().flatten().any(|(series, _)| series == k);
    if let Some(k) = (0..logged.len()).find(|k| !known(k)) {
        return Err(format!(
            "the simulation of its configuration does not log `{}`",
            logged[k].path
        ));
    }
    // The last samples may precede an event whose time the log does not contain, so run further by
    // this time.
    let before = |rule: &Rule| rule.around.as_ref().map_or(0.0, |a| a.before.seconds());
    let beyond = rules.iter().map(before).fold(0.0, f64::max);
    let findings = Arc::new(Mutex::new(Findings { logged, ..Findings::default() }));
    let verify = Verify { findings: findings.clone(), columns, beyond };
    let recorder = Recorder::start(&sim, groups, 64, Box::new(verify));
    let mut recorder = recorder.map_err(|e| e.to_string())?;
    if let Some(start) = start {
        // If the checkpoint does not have the entry, the run did not have a log.
        let _ = recorders::resume(&mut recorder, start, &sim);
    }
    let outcome = step_to(&mut sim, &mut recorder, sets, last, beyond);
    let ended = recorder.finish();
    let Findings { logged, found, fault } =
        std::mem::take(&mut *findings.lock().unwrap_or_else(PoisonError::into_inner));
    if let Some(fault) = fault {
        return Err(fault);
    }
    if let Some(found) = found {
        return Ok(Err(found));
    }
    outcome.and(ended)?;
    for Logged { path, series, came, .. } in &logged {
        if let Some(k) = came.iter().position(|came| !came) {
            let t = series.t[k];
            return Err(format!(
                "it has a sample of `{path}` at t = {t} s, but the simulation does not"
            ));
        }
    }
    let numbers = logged.iter().map(|l| l.series.t.len()).sum();
    Ok(Ok(Compared { numbers, until: last }))
}

/// Steps to `last` (s) and by `beyond` (s) further, or to the first difference.
fn step_to(
    sim: &mut Simulation,
    recorder: &mut Recorder,
    sets: &[SetRow],
    last: f64,
    beyond: f64,
) -> Result<(), String> {
    let mut sets = sets.iter().peekable();
    set(sim, &mut sets)?;
    recorder.sample(sim)?;
    // Times in logs are rounded to nanoseconds.
    while sim.time() < last + beyond - 1e-9 {
        match sim.step() {
            Ok(()) => {}
            Err(_) if sim.time() > last - 1e-9 => break,
            Err(e) => return Err(format!("the run fails, but the log continues: {e}")),
        }
        set(sim, &mut sets)?;
        recorder.sample(sim)?;
    }
    Ok(())
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
        (true, _) => Some("does not contain a configuration"),
        (_, true) => Some("does not contain numbers"),
        _ => None,
    };
    if let Some(what) = missing {
        tell!("error: log `{name}` {what}\n  help: give a .mcap file that `linkwork run` wrote");
        return exit::INPUT;
    }
    let start = match start.as_deref().map(Checkpoint::from_bytes).transpose() {
        Ok(start) => start,
        Err(e) => {
            tell!("error: log `{name}`: its first checkpoint: {e}\n  help: repeat the run");
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
            "warning: the plan differs from the plan of the log ({} then, {plan} now): a file that it reads has changed, or this \
             program has another version",
            about["plan"]
        );
    }
    let prepared = match linkwork_runner::prepare(ready.plan(), &ready.loaded.simulation) {
        Ok(prepared) => prepared,
        Err(faults) => {
            return report(&Failure { faults, sources: ready.loaded.sources.clone() });
        }
    };
    let base = ready.plan().base;
    let program = Arc::new(ready.program);
    let n = series.len();
    let outcome = compare(&program, (start.as_ref(), &sets), &prepared.groups, series);
    match outcome {
        Ok(Ok(Compared { numbers, until })) => {
            say!("verified: {numbers} numbers of {n} variables until {until} s, bit by bit");
            if let End::Cut { at } = end {
                say!("    the log is truncated after {at} bytes");
            }
            exit::OK
        }
        Ok(Err(d)) => {
            let others = match d.others {
                0 => String::new(),
                n => format!(" ({n} more variables at this tick)"),
            };
            say!(
                "`{}` differs first, at tick {} (t = {} s): logged {:?}, now {:?}{others}",
                d.path,
                (d.time / base.seconds()).round(),
                d.time,
                d.logged,
                d.now
            );
            let (was, now) = (about.get(BUILT), linkwork_runner::built());
            if let Some(was) = was.filter(|was| **was != now) {
                say!(
                    "    the log was written by {was}, but this is {now}: results differ at round-off level"
                );
            }
            exit::FAILED
        }
        Err(e) => {
            tell!("error: log `{name}`: {e}");
            exit::FAILED
        }
    }
}
