//! `control.plan`: sequence of activities (a day plan) that switches commands by conditions and times.
//! ```text
//! waiting ── `when` holds ──> begun: commands `set` ── `until` holds and `duration` is over ──> ended: commands `then`
//!    └── `wait_max` is over ──> failed <── `time_out` is over ──┘            failed: commands `then`, then `on_failure`
//! ```
//! Steps run one after the other. Conditions have the syntax of phase conditions (`"charge > 40 % and local_time > 10 h"`) over the plan's signals,
//! `time`, and `elapsed`: the time since the step began to wait, or began. They are evaluated at each sample. A sample may advance several steps, but
//! each step at most once; the outputs change at the next sample. Commands keep their values from step to step. The whole state is discrete.

use crate::plan_settings::{Command, Settings};
use linkwork_runtime::prelude::*;
use linkwork_runtime::{Condition, Place, Role, Times, Unit, Variable};
use std::collections::BTreeMap;

/// Signal that conditions read: a number or a truth value.
#[derive(Params, Clone, Debug)]
pub struct Signal {
    /// Name of the input.
    pub name: String,
    /// Unit of the number. Default: a truth value, for conditions such as `arrived > 0.5`.
    pub unit: Option<String>,
    /// Value (SI) while the input is not connected, for example in a phase without its source. Default: the input must be connected.
    pub unwired: Option<f64>,
}

/// A step of the plan.
#[derive(Params, Clone, Debug)]
pub struct Step {
    /// Name.
    pub name: String,
    /// Condition on which the step begins. Default: immediately after the previous step.
    pub when: Option<String>,
    /// Maximum wait for `when`, after which the step fails. Default: no limit.
    #[param(unit = "s", range = 0.0..)]
    pub wait_max: Option<f64>,
    /// Commands that the step sets when it begins: `{ "radio": true, "level": "50 %" }`.
    #[param(default = Settings::default())]
    pub set: Settings,
    /// Minimum time from beginning to end.
    #[param(unit = "s", range = 0.0..)]
    pub duration: Option<f64>,
    /// Condition on which the step ends. Default: when `duration` is over.
    pub until: Option<String>,
    /// Maximum time from beginning to end, after which the step fails. Default: no limit.
    #[param(unit = "s", range = 0.0..)]
    pub time_out: Option<f64>,
    /// Commands that the step sets when it ends or fails.
    #[param(default = Settings::default())]
    pub then: Settings,
    /// Action after a failure: `next`, `abort` (all commands return to their `start` and the plan ends), or the name of a step.
    #[param(default = "next".to_string(), needs = "wait_max or time_out")]
    pub on_failure: String,
}

/// Signals, commands and steps.
#[derive(Params, Clone, Debug)]
pub struct PlanParams {
    /// Inputs that conditions read.
    #[param(default = Vec::new())]
    pub signals: Vec<Signal>,
    /// Outputs that steps set.
    pub commands: Vec<Command>,
    /// The steps, in their order.
    pub steps: Vec<Step>,
}

/// Continuation of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Goes {
    To(usize),
    Aborts,
}

/// A step with compiled conditions and the indices of its commands.
struct Compiled {
    when: Option<Condition>,
    until: Option<Condition>,
    set: Vec<(usize, f64)>,
    then: Vec<(usize, f64)>,
    on_failure: Goes,
}

/// A plan. Discrete state: the slots of `FIXED`, then the commands.
pub struct Plan {
    p: PlanParams,
    steps: Vec<Compiled>,
}

/// Discrete state before the commands: name, unit, meaning.
const FIXED: [(&str, &str, &str); 7] = [
    ("step", "1", "Number of finished steps, which is the index of the current step."),
    ("since", "s", "Time at which the current step began to wait, or began."),
    ("begun", "1", "The current step has begun."),
    ("started", "1", "A sample has been taken."),
    ("aborted", "1", "The plan was aborted."),
    ("failures", "1", "Number of failed steps."),
    ("failed_step", "1", "Number of the last step that failed, from 1; 0: none."),
];
const STEP: usize = 0;
const SINCE: usize = 1;
const BEGUN: usize = 2;
const STARTED: usize = 3;
const ABORTED: usize = 4;
const FAILURES: usize = 5;
const FAILED: usize = 6;

/// Outputs in addition to the commands and `running`: name, whether it is a truth value, unit, meaning.
const OUTPUTS: [(&str, bool, &str, &str); 7] = [
    (
        "step",
        false,
        "1",
        "Number of the current step, from 1; the number of steps plus 1 when the plan is over.",
    ),
    ("elapsed", false, "s", "Time since the current step began to wait, or began."),
    ("waiting", true, "", "The current step waits for its `when`."),
    ("done", true, "", "All steps are over."),
    ("aborted", true, "", "The plan was aborted."),
    ("failures", false, "1", "Number of failed steps."),
    ("failed_step", false, "1", "Number of the last step that failed, from 1; 0: none."),
];

/// Names that are reserved in conditions.
const WORDS: [&str; 7] = ["time", "phase_time", "elapsed", "and", "or", "not", "abs"];

/// Tolerance for the comparison of times, s, because times are sums of sample periods.
const SAME: f64 = 1e-6;

fn port(name: &str, unit: Option<&str>, doc: String) -> PortSpec {
    let kind = if unit.is_some() { PortKind::Numbers } else { PortKind::Bool };
    PortSpec::named(name.to_string(), kind, 1).unit_of(unit.unwrap_or("").to_string()).doc_of(doc)
}

/// Returns an error for invalid and duplicate names.
fn check_names<'a>(all: impl Iterator<Item = (&'static str, &'a str)>) -> Result<(), BuildError> {
    let mut seen: Vec<&str> = Vec::new();
    for (param, name) in all {
        let letters = |c: char| c.is_alphanumeric() || c == '_';
        if !name.starts_with(char::is_alphabetic) || !name.chars().all(letters) {
            let help = "write a letter, then letters, digits and `_`";
            return Err(BuildError::new(format!("`{name}` is not a valid name"))
                .help(help)
                .at(param));
        }
        if WORDS.contains(&name) {
            let fact = format!("`{name}` is reserved in conditions");
            return Err(BuildError::new(fact).help("use another name").at(param));
        }
        if seen.contains(&name) {
            let fact = format!("`{name}` is defined twice");
            let help = "signals, commands and the outputs `step`, `waiting`, `done`, … share one namespace";
            return Err(BuildError::new(fact).help(help).at(param));
        }
        seen.push(name);
    }
    Ok(())
}

fn unit_of(text: Option<&str>, param: &str) -> Result<Unit, BuildError> {
    Unit::parse(text.unwrap_or("1"))
        .map_err(|e| BuildError::of(&e).help("write a unit such as `K` or `m/s`").at(param))
}

/// Returns the variables of conditions: the signals, followed by `elapsed`.
fn variables(signals: &[Signal]) -> BTreeMap<String, Variable> {
    let variable = |place: usize, unit: &str, doc: &'static str| Variable {
        place: Place::Signal(place as u32),
        role: Role::Input,
        unit: unit.to_string().into(),
        doc: doc.into(),
        kind: PortKind::Numbers,
        part: "".into(),
    };
    let named = signals
        .iter()
        .enumerate()
        .map(|(k, s)| (s.name.clone(), variable(k, s.unit.as_deref().unwrap_or("1"), "A signal.")));
    let elapsed = variable(signals.len(), "s", "Time since the step began to wait, or began.");
    named.chain([("elapsed".to_string(), elapsed)]).collect()
}

impl PlanParams {
    /// Compiles a step; errors contain its name.
    fn compile(
        &self,
        step: &Step,
        variables: &BTreeMap<String, Variable>,
    ) -> Result<Compiled, BuildError> {
        let at = |e: BuildError| BuildError {
            message: format!("step `{}`: {}", step.name, e.message),
            ..e.at("steps")
        };
        let refuse = |fact: &str, help: &str| at(BuildError::new(fact).help(help));
        let condition = |text: &Option<String>| {
            let read = |t: &String| Condition::parse(t, variables);
            let error = |e: linkwork_runtime::ConditionError| {
                at(BuildError::new(e.to_string()).help(e.help))
            };
            let read = text.as_ref().map(read).transpose().map_err(error)?;
            if read.as_ref().is_some_and(Condition::tests_phase_time) {
                let fact = "`phase_time` is the time of a phase of the simulation and is not available in a plan";
                let help = "write `elapsed`: the time since the step began to wait, or began";
                return Err(refuse(fact, help));
            }
            Ok(read)
        };
        if step.wait_max.is_some() && step.when.is_none() {
            return Err(refuse("`wait_max` without `when`", "write `when`, or remove `wait_max`"));
        }
        if step.time_out.is_some() && step.until.is_none() {
            let help = "write `until`, or remove `time_out`: the step ends when `duration` is over";
            return Err(refuse("`time_out` without `until`", help));
        }
        if let (Some(duration), Some(time_out)) = (step.duration, step.time_out)
            && time_out <= duration
        {
            let fact = "`time_out` is not longer than `duration`, so the step always fails";
            return Err(refuse(fact, "write a `time_out` longer than `duration`"));
        }
        let places = |s: &Settings| s.places(&self.commands).map_err(at);
        let on_failure = match (step.on_failure.as_str(), self.steps.iter()) {
            ("next", mut all) => Goes::To(1 + all.position(|s| s.name == step.name).unwrap_or(0)),
            ("abort", _) => Goes::Aborts,
            (name, mut all) => match all.position(|s| s.name == name) {
                Some(k) => Goes::To(k),
                None => {
                    let names: Vec<&str> = self.steps.iter().map(|s| s.name.as_str()).collect();
                    let fact = format!("`on_failure` names `{name}`, which is not a step");
                    let help = format!("write `next`, `abort`, or one of: {}", names.join(", "));
                    return Err(refuse(&fact, &help));
                }
            },
        };
        Ok(Compiled {
            when: condition(&step.when)?,
            until: condition(&step.until)?,
            set: places(&step.set)?,
            then: places(&step.then)?,
            on_failure,
        })
    }
}

fn apply(settings: &[(usize, f64)], d: &mut [f64]) {
    for (place, value) in settings {
        d[FIXED.len() + place] = *value;
    }
}

impl Plan {
    /// Ends the current step and continues with another.
    fn leave(&self, k: usize, to: Goes, t: f64, d: &mut [f64]) {
        apply(&self.steps[k].then, d);
        (d[SINCE], d[BEGUN]) = (t, 0.0);
        match to {
            Goes::To(next) => d[STEP] = next as f64,
            Goes::Aborts => {
                (d[STEP], d[ABORTED]) = (self.steps.len() as f64, 1.0);
                for (value, command) in d[FIXED.len()..].iter_mut().zip(&self.p.commands) {
                    *value = command.start;
                }
            }
        }
    }

    /// Makes one transition of the current step. Returns whether there was one.
    fn advance(&self, t: f64, d: &mut [f64], u: &[f64]) -> bool {
        let k = d[STEP] as usize;
        let (Some(step), Some(compiled)) = (self.p.steps.get(k), self.steps.get(k)) else {
            return false;
        };
        let elapsed = t - d[SINCE];
        let over = |limit: Option<f64>| limit.is_some_and(|limit| elapsed >= limit - SAME);
        let value = |place| match place {
            Place::Signal(lane) => u.get(lane as usize).copied().unwrap_or(elapsed),
            _ => f64::NAN,
        };
        let times = Times { time: t, phase: f64::NAN };
        let holds = |c: &Option<Condition>| c.as_ref().is_none_or(|c| c.holds(times, value));
        let failed = if d[BEGUN] == 0.0 {
            if holds(&compiled.when) {
                (d[SINCE], d[BEGUN]) = (t, 1.0);
                apply(&compiled.set, d);
                return true;
            }
            over(step.wait_max)
        } else {
            if holds(&compiled.until) && (step.duration.is_none() || over(step.duration)) {
                self.leave(k, Goes::To(k + 1), t, d);
                return true;
            }
            over(step.time_out)
        };
        if failed {
            d[FAILURES] += 1.0;
            d[FAILED] = k as f64 + 1.0;
            self.leave(k, compiled.on_failure, t, d);
        }
        failed
    }
}

/// Day plan: steps with conditions, durations and time-outs that switch named commands, with a continuation after failures.
#[model("control.plan")]
impl SizedModel for Plan {
    type Params = PlanParams;

    fn ports(p: &PlanParams) -> SizedPorts {
        let input = |s: &Signal| {
            let port = port(&s.name, s.unit.as_deref(), "A signal that conditions read.".into());
            s.unwired.map_or(port.clone(), |value| port.or(value))
        };
        let command = |c: &Command| port(&c.name, c.unit.as_deref(), "A command.".into());
        let output = |&(name, truth, unit, doc): &(&'static str, bool, &str, &str)| {
            port(name, (!truth).then_some(unit), doc.to_string())
        };
        let running = |s: &Step| {
            let doc = format!("Step `{}` has begun and is not over.", s.name);
            port(&format!("running.{}", s.name), None, doc)
        };
        let fixed = |&(name, unit, doc): &(&'static str, &'static str, &'static str)| {
            PortSpec::named(name, PortKind::Numbers, 1).unit_of(unit).doc_of(doc)
        };
        SizedPorts {
            inputs: p.signals.iter().map(input).collect(),
            outputs: (p.commands.iter().map(command))
                .chain(OUTPUTS.iter().map(output))
                .chain(p.steps.iter().map(running))
                .collect(),
            discrete: FIXED.iter().map(fixed).chain(p.commands.iter().map(command)).collect(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(p: PlanParams) -> Result<Self, BuildError> {
        if p.steps.is_empty() {
            return Err(BuildError::new("`steps` is empty")
                .help("write at least one step")
                .at("steps"));
        }
        let signals = p.signals.iter().map(|s| ("signals", s.name.as_str()));
        let commands = p.commands.iter().map(|c| ("commands", c.name.as_str()));
        let outputs = OUTPUTS.iter().filter(|o| o.0 != "elapsed").map(|o| ("signals", o.0));
        check_names(outputs.chain(signals).chain(commands))?;
        check_names(p.steps.iter().map(|s| ("steps", s.name.as_str())))?;
        for signal in &p.signals {
            unit_of(signal.unit.as_deref(), "signals")?;
        }
        for command in &p.commands {
            unit_of(command.unit.as_deref(), "commands")?;
            if command.unit.is_none() && command.start != 0.0 && command.start != 1.0 {
                let fact = format!(
                    "`{}` is a truth value and cannot start at {}",
                    command.name, command.start
                );
                let help = "write 0 or 1, or add a `unit` for a number";
                return Err(BuildError::new(fact).help(help).at("commands"));
            }
        }
        let variables = variables(&p.signals);
        let steps: Result<Vec<_>, _> = p.steps.iter().map(|s| p.compile(s, &variables)).collect();
        Ok(Plan { steps: steps?, p })
    }

    fn initial(&self, _: &mut [f64], d: &mut [f64]) {
        for (value, command) in d[FIXED.len()..].iter_mut().zip(&self.p.commands) {
            *value = command.start;
        }
    }

    fn outputs(&self, clock: &Clock, d: &[f64], y: &mut [f64]) {
        let (fixed, commands) = d.split_at(FIXED.len());
        let (out, rest) = y.split_at_mut(commands.len());
        out.copy_from_slice(commands);
        let (out, running) = rest.split_at_mut(OUTPUTS.len());
        let truth = |b: bool| f64::from(u8::from(b));
        let done = fixed[STEP] >= self.steps.len() as f64;
        let begun = fixed[BEGUN] != 0.0;
        out.copy_from_slice(&[
            fixed[STEP] + 1.0,
            if done || fixed[STARTED] == 0.0 { 0.0 } else { clock.t - fixed[SINCE] },
            truth(!done && !begun),
            truth(done),
            fixed[ABORTED],
            fixed[FAILURES],
            fixed[FAILED],
        ]);
        for (k, running) in running.iter_mut().enumerate() {
            *running = truth(begun && fixed[STEP] == k as f64);
        }
    }

    fn update(&self, clock: &Clock, d: &mut [f64], u: &[f64]) {
        if d[STARTED] == 0.0 {
            (d[STARTED], d[SINCE]) = (1.0, clock.t);
        }
        for _ in 0..2 * self.steps.len() {
            if !self.advance(clock.t, d, u) {
                break;
            }
        }
    }
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
