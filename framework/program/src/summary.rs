//! `summary.json`, and the messages at the end of a run.
use linkwork_runner::{Balances, Ended, Metrics, Realtime};
use linkwork_runtime::doc::number;
use linkwork_runtime::{RunError, Seconds, Simulation};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Reason for the end of a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// The run reached the time `until`.
    Until,
    /// The condition `stop_when` became true.
    StopWhen,
    /// Ctrl-C.
    Interrupted,
    /// A state diverged.
    Failed(String),
    /// The log could not be written.
    LogFailed(String),
}

/// Returns a warning if a run ended later than `until`, because `until` is between two steps.
pub fn late(ended: &Ended, until: Option<Seconds>, now: f64) -> Option<String> {
    let until = until.filter(|_| *ended == Ended::Goal)?.seconds();
    (now - until > 1e-9 * until.max(1e-3)).then(|| {
        format!(
            "warning: the run ended at {now} s: `until`, {until} s, is between two steps\n  help: write a multiple of the \
             step; or end the run by `stop_when: \"time >= {until} s\"`, which acts within the step"
        )
    })
}

/// Content of summary.json.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Name of the simulation.
    pub simulation: String,
    /// Reason for the end of the run.
    pub ended: Ending,
    /// Simulated time at the end (s).
    pub time: f64,
    /// Hash of the state at the end.
    pub state_hash: String,
    /// Wall time of stepping (s).
    pub wall_time: f64,
    /// Ratio of simulated time to wall time, averaged over this process's part of the run, from the first tick to the last, including waits for
    /// recorders.
    pub real_time_factor: f64,
    /// Lateness of ticks, if the run was paced.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub realtime: Option<Realtime>,
    /// Seed of all noise.
    pub seed: u64,
    /// Build of the program: version, processor, profile.
    pub built: String,
    /// Last start of each phase (s); null for a phase that has not begun. Empty for a simulation without phases.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub phases: BTreeMap<String, Option<f64>>,
    /// Metrics of the simulation: value and unit.
    pub metrics: BTreeMap<String, (f64, String)>,
    /// Balances of energy, mass and charge; empty with `balance: false`.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub balances: Balances,
    /// Files written.
    pub files: Vec<PathBuf>,
    /// Errors of files that could not be written.
    pub problems: Vec<String>,
    /// Number of samples that a viewer lost.
    pub rows_dropped: u64,
}

impl Summary {
    /// Writes the file to a temporary name and renames it, so that a full disk does not leave an incomplete file.
    ///
    /// # Errors
    /// A message with the path.
    pub fn write(&self, path: &Path) -> Result<(), String> {
        let fail = |e: &dyn std::fmt::Display| format!("`{}`: {e}", path.display());
        let text = serde_json::to_string_pretty(self).map_err(|e| fail(&e))? + "\n";
        linkwork_record::replace(path, text.as_bytes(), linkwork_record::Durable::Now)
    }
}

/// Returns how a run ended, with the remedy for a failure.
pub fn ending(ended: Ended) -> Ending {
    match ended {
        Ended::Goal => Ending::Until,
        Ended::StopWhen => Ending::StopWhen,
        Ended::Stopped => Ending::Interrupted,
        Ended::Failed(e) => Ending::Failed(explain(&e)),
        Ended::Bad(e) if e.help.is_some() => Ending::Failed(e.to_string()),
        Ended::Bad(e) => Ending::Failed(format!(
            "{e}\n  help: this is already the case at the start; check the inputs of `{}`, and its parameters",
            e.path
        )),
        Ended::Recorder(e) => Ending::LogFailed(e),
    }
}

fn explain(e: &RunError) -> String {
    if e.help.is_some() {
        return format!(
            "{e}\n  note: the log and before_failure.lwck contain the time before the failure"
        );
    }
    // A failure in the first steps is mostly caused by the start.
    let start = if e.time < 0.2 {
        "; a machine that starts inside the ground is pushed out violently: see `place`"
    } else {
        ""
    };
    format!(
        "{e}\n  help: the log and before_failure.lwck contain the time before the failure; try a smaller step, and check the inputs of `{}`{start}",
        e.path
    )
}

/// Returns the last start of each phase of a run (s).
pub fn phases(sim: &Simulation) -> BTreeMap<String, Option<f64>> {
    let all = sim.program().phases.iter().zip(&sim.state().entered);
    all.filter(|(phase, _)| !phase.name.is_empty())
        .map(|(phase, t)| (phase.name.clone(), t.is_finite().then_some(*t)))
        .collect()
}

/// Returns the metrics as name → (value, unit).
pub fn metrics(metrics: &Metrics) -> BTreeMap<String, (f64, String)> {
    metrics.results().map(|(n, v, u)| (n.to_string(), (v, u.to_string()))).collect()
}

/// Prints a readable summary.
pub fn print(s: &Summary) {
    let how = match &s.ended {
        Ending::Until => "reached its end".to_string(),
        Ending::StopWhen => "stopped by its own condition".to_string(),
        Ending::Interrupted => "interrupted".to_string(),
        Ending::Failed(_) => "FAILED".to_string(),
        Ending::LogFailed(_) => "STOPPED, because the log could not be written,".to_string(),
    };
    say!("{}: {how} at t = {:.3} s", s.simulation, s.time);
    say!(
        "  {:.2} s of wall time after loading, {} times real time on average; state {}",
        s.wall_time,
        factor(s.real_time_factor),
        s.state_hash
    );
    if let Some(r) = s.realtime.as_ref().filter(|r| r.ticks > 0) {
        let ms = |s: f64| number(1e3 * s);
        say!(
            "  paced at {} times real time: 99 % of {} ticks at most {} ms late, the worst {} ms",
            number(r.factor),
            r.ticks,
            ms(r.late_99),
            ms(r.late_worst)
        );
        if r.overruns > 0 {
            say!(
                "  {} ticks were late because the work before them took too long, by at most {} ms",
                r.overruns,
                ms(r.overrun_worst)
            );
        }
    }
    if s.rows_dropped > 0 {
        say!("  the viewer lost {} samples, which are in the log", s.rows_dropped);
    }
    let width = s.metrics.keys().map(String::len).max().unwrap_or(0);
    for (name, (value, unit)) in &s.metrics {
        if value.is_nan() {
            say!(
                "  {name:width$}  n/a: the variable never existed in this run or its condition never held"
            );
            continue;
        }
        let unit = if unit == "1" { "" } else { unit };
        let line = format!("  {name:width$}  {} {unit}", number(*value));
        say!("{}", line.trim_end());
    }
    balances(&s.balances);
    if s.files.is_empty() {
        return;
    }
    say!("files:");
    for file in &s.files {
        let hint = match file.extension().and_then(|e| e.to_str()) {
            Some("rrd") => "   open with: rerun <file>     (pip install rerun-sdk==0.36.3)",
            Some("mcap") => "   open with Rerun, Foxglove or PlotJuggler",
            Some("folded") => "   open with a flame graph tool: inferno, speedscope",
            Some("svg") => "   open with a browser",
            Some("lwck") => "   continue with: linkwork resume <file>",
            _ => "",
        };
        say!("  {}{hint}", file.display());
    }
}

/// Prints a line per quantity with the exchanged amount and the residual, then the sums by kind of term.
fn balances(all: &Balances) {
    for (name, report) in all.iter().filter(|(_, report)| report.carried > 0.0) {
        let (carried, left) = (report.carried, report.residual);
        let share = 100.0 * left.abs() / carried;
        let unit = report.unit;
        let checked = report.parts.values().any(|part| part.residual.is_some());
        let largest = number(carried);
        match checked {
            true => {
                let uncertain: Vec<String> = (report.parts.iter())
                    .filter(|(_, part)| part.is_uncertain())
                    .map(|(path, part)| format!("{} {unit} in `{path}`", number(part.uncertainty)))
                    .collect();
                let closed = match (report.not_closed.len(), uncertain.len()) {
                    (0, 0) => "closed".to_string(),
                    (0, _) => format!(
                        "closed within the uncertainty of samples ({})",
                        uncertain.join(", ")
                    ),
                    _ => format!("not closed for `{}`", report.not_closed.join("`, `")),
                };
                say!(
                    "balance of {name}: {closed}, residual {} {unit} ({share:.2} % of {largest} {unit}, the largest amount of one part)",
                    number(left)
                );
            }
            false => {
                let why = match report.not_counted.is_empty() {
                    true => "not checked, because all parts only transmit it".to_string(),
                    false => format!(
                        "not checked, because it does not count {}",
                        report.not_counted.join(", ")
                    ),
                };
                say!(
                    "balance of {name}: {why}; the largest amount of one part is {largest} {unit}"
                );
            }
        }
        // Amounts at round-off level are omitted.
        let counts = |amount: f64| amount.abs() > 1e-12 * carried;
        for (kind, amount) in report.totals.iter().filter(|(_, amount)| counts(**amount)) {
            let what = match (*kind, report.not_counted.is_empty()) {
                ("not counted", false) => format!("{kind}: {}", report.not_counted.join(", ")),
                _ => (*kind).to_string(),
            };
            say!("  {} {unit}  {what}", number(*amount));
        }
    }
}

/// Formats a factor with two digits, or as an integer.
fn factor(x: f64) -> String {
    if x < 10.0 { format!("{x:.2}") } else { format!("{x:.0}") }
}
