//! Pins: variables that keep a value until they are unpinned, whatever the model does.
//!
//! ```text
//! state              its derivative is zero at every stage; after steps, updates and events it has its value again
//! input, no wire     nothing writes it
//! output, sum        set again after each operation that writes it, before what follows from it is evaluated
//! ```
//! So every reader sees the pin, at every stage of the integrator and at every tick before its rows; the part that
//! writes the variable, too, where it reads it (a machine integrates the accelerations that it shows).
//! A part that takes its steps by itself, a machine with contact by impulses, moves on by numbers of its own: its
//! states cannot be pinned, and what it shows (contact reports, accelerations) is pinned for readers alone.
//! Without a pin a step costs one comparison more for each list of operations.
use super::{Simulation, VariableError};
use crate::model::lanes;
use crate::plan::{Op, Place, Plan, Role, Variable};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// What is pinned, by path, and where that is in the lanes of a plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Pins {
    values: BTreeMap<String, (f64, Target)>,
    x: Vec<(u32, f64)>,
    d: Vec<(u32, f64)>,
    sig: Vec<(u32, f64)>,
    /// Operation, lane that it writes, value: in the order of the operations.
    written: Vec<(u32, u32, f64)>,
}

impl Pins {
    /// States to their values.
    pub fn states(&self, x: &mut [f64]) {
        for &(k, value) in &self.x {
            x[k as usize] = value;
        }
    }

    /// Discrete states to their values.
    pub fn discrete(&self, d: &mut [f64]) {
        for &(k, value) in &self.d {
            d[k as usize] = value;
        }
    }

    /// Signals to their values.
    pub fn signals(&self, sig: &mut [f64]) {
        for &(k, value) in &self.sig {
            sig[k as usize] = value;
        }
    }

    /// Everything to its value.
    pub fn hold(&self, x: &mut [f64], d: &mut [f64], sig: &mut [f64]) {
        self.states(x);
        self.discrete(d);
        self.signals(sig);
    }

    /// Derivatives of pinned states to zero.
    pub fn still(&self, xdot: &mut [f64]) {
        for &(k, _) in &self.x {
            xdot[k as usize] = 0.0;
        }
    }

    /// What an operation has just written to its values.
    pub fn after(&self, op: u32, sig: &mut [f64]) {
        let first = self.written.partition_point(|w| w.0 < op);
        for &(_, k, value) in self.written[first..].iter().take_while(|w| w.0 == op) {
            sig[k as usize] = value;
        }
    }

    /// What is pinned, and to what, by path.
    pub fn values(&self) -> impl Iterator<Item = (&str, f64)> {
        self.values.iter().map(|(path, (value, _))| (path.as_str(), *value))
    }

    /// Of what is pinned; `None` when nothing is.
    fn of(values: BTreeMap<String, (f64, Target)>) -> Option<Arc<Pins>> {
        let mut pins = Pins { values, ..Pins::default() };
        for &(value, target) in pins.values.values() {
            match target {
                Target::X(k) => pins.x.push((k, value)),
                Target::D(k) => pins.d.push((k, value)),
                Target::Signal(k, op) => {
                    pins.sig.push((k, value));
                    pins.written.extend(op.map(|op| (op, k, value)));
                }
            }
        }
        pins.written.sort_by_key(|w| (w.0, w.1));
        (!pins.values.is_empty()).then(|| Arc::new(pins))
    }
}

/// Where a variable can be pinned.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Target {
    X(u32),
    D(u32),
    /// A signal, and the operation that writes it.
    Signal(u32, Option<u32>),
}

/// Signal lanes that an operation writes.
fn writes(plan: &Plan, op: Op) -> Vec<Range<usize>> {
    match op {
        Op::Outputs(k) | Op::Feedthrough(k) => {
            let part = &plan.parts[k as usize];
            let (d, w) = (part.prototype.description(), &part.wiring);
            vec![match op {
                Op::Outputs(_) => w.ym..w.ym + lanes(&d.outputs),
                _ => w.yd..w.yd + lanes(&d.feedthrough_outputs),
            }]
        }
        Op::Sum(j) => {
            let sum = &plan.sums[j as usize];
            std::iter::once(sum.dst as usize..(sum.dst + sum.lanes) as usize).collect()
        }
        Op::Loop(j) => {
            let l = &plan.loops[j as usize];
            let report = l.work as usize..l.work as usize + crate::compile::REPORT;
            let sought = l.tears.iter().map(|t| t.0 as usize..t.0 as usize + 1);
            let inside = l.ops.iter().flat_map(|op| writes(plan, *op));
            inside.chain(sought).chain([report]).collect()
        }
    }
}

fn no<T>(message: String, help: impl Into<String>) -> Result<T, VariableError> {
    Err(VariableError { message, help: help.into() })
}

/// What there is to know of a plan before its variables are pinned.
struct Lanes<'a> {
    plan: &'a Plan,
    /// The operation that writes each signal lane.
    writer: Vec<Option<u32>>,
    /// The part of each state, and whether it is held together with others.
    states: Vec<(Option<u32>, bool)>,
}

impl<'a> Lanes<'a> {
    fn of(plan: &'a Plan) -> Lanes<'a> {
        let mut writer = vec![None; plan.sizes.sig];
        for (k, op) in (0..).zip(&plan.ops) {
            for lane in writes(plan, *op).into_iter().flatten() {
                writer[lane].get_or_insert(k);
            }
        }
        let mut states = vec![(None, false); plan.sizes.x];
        for (k, part) in (0..).zip(&plan.parts) {
            let (first, n) = (part.wiring.x, part.lanes().x);
            states[first..first + n].fill((Some(k), false));
            let held = part.prototype.held_together();
            states[first..].iter_mut().zip(held).for_each(|(state, held)| state.1 = held);
        }
        Lanes { plan, writer, states }
    }
}

/// Where a variable of a plan can be pinned; the message says why it cannot.
fn target(lanes: &Lanes<'_>, (path, v): (&str, &Variable)) -> Result<Target, VariableError> {
    let plan = lanes.plan;
    let lane = match v.place {
        Place::X(k) => {
            return match lanes.states[k as usize] {
                (Some(part), _) if plan.steps.contains(&part) => {
                    no(format!("`{path}` cannot be pinned: {ADVANCES}"), PRESCRIBE)
                }
                (_, false) => Ok(Target::X(k)),
                (_, true) => no(
                    format!(
                        "`{path}` cannot be pinned: its part holds it together with other numbers (a rotation, a closed loop)"
                    ),
                    "pin a rate that is not so held, or prescribe the hinge and pin what prescribes it",
                ),
            };
        }
        Place::D(k) => return Ok(Target::D(k)),
        Place::Channel(_) | Place::Phase(_) => {
            return no(format!("`{path}` is in no lane here"), "tell the authors");
        }
        Place::Signal(k) => k as usize,
    };
    if v.role == Role::Free {
        return Ok(Target::Signal(lane as u32, None));
    }
    let op = lanes.writer[lane].map(|op| (op, &plan.ops[op as usize]));
    match (v.role, op) {
        (_, Some((_, Op::Loop(_)))) => no(
            format!(
                "`{path}` cannot be pinned: it is inside an algebraic loop, which is solved as a whole"
            ),
            "pin what drives the loop",
        ),
        (Role::Input, Some((_, Op::Outputs(k) | Op::Feedthrough(k)))) => {
            let is = |w: &&Variable| w.role == Role::Output && w.place == v.place;
            let source = plan.lanes.iter().find(|(_, w)| is(w));
            match source {
                Some((source, _)) => no(
                    format!(
                        "`{path}` cannot be pinned: it has no number of its own, it reads `{source}`"
                    ),
                    format!("pin `{source}`: all its readers then see that"),
                ),
                None => no(
                    format!(
                        "`{path}` cannot be pinned: it has no number of its own, it is bound to `{}`",
                        plan.parts[*k as usize].path
                    ),
                    "pin a coordinate or a rate of a body, or an output of the part that reads it",
                ),
            }
        }
        (_, Some((op, _))) => Ok(Target::Signal(lane as u32, Some(op))),
        // Written while a part advances by itself, or a state that is shown as an output.
        (Role::Output, None) => Ok(Target::Signal(lane as u32, None)),
        (_, None) => no(
            format!("`{path}` cannot be pinned: a constant drives it"),
            "change the constant, or remove the wire and pin the input",
        ),
    }
}

const ADVANCES: &str = "its part takes its steps by itself (a machine with contact by impulses), and moves on by numbers of its own";
const PRESCRIBE: &str = "prescribe the hinge and pin what prescribes it, or take compliant contact";

impl Simulation {
    /// Pins a variable: it has this value from the present instant on, until it is unpinned, for every reader,
    /// whatever the model does. States (their derivative is then zero), inputs without a wire, outputs and sums
    /// of a `sum` input can be pinned. A pin is part of the state: of checkpoints, snapshots and forks; it
    /// goes over to other phases where they have the variable. Another value may be given later.
    ///
    /// Linearisations are those of the model without pins.
    ///
    /// # Errors
    /// No such variable; a value that is not finite; a variable that cannot be pinned: an input that a wire drives
    /// (its source can), a number inside a solved loop, one of several that its part holds together. Nothing is
    /// changed then.
    pub fn pin(&mut self, path: &str, value: f64) -> Result<(), VariableError> {
        self.pin_all(&[(path.to_string(), value)])
    }

    /// The same of several variables: all of it, or nothing.
    pub(super) fn pin_all(&mut self, all: &[(String, f64)]) -> Result<(), VariableError> {
        let mut values = self.pinned_values();
        let lanes = Lanes::of(&self.plan);
        for (path, value) in all {
            let v = self.here(path)?;
            if !value.is_finite() {
                return no(format!("`{path}` cannot be pinned to {value}"), "give a finite number");
            }
            values.insert(path.clone(), (*value, target(&lanes, (path, v))?));
        }
        self.repin(values)
    }

    fn pinned_values(&self) -> BTreeMap<String, (f64, Target)> {
        self.state.pins.as_ref().map_or_else(BTreeMap::new, |p| p.values.clone())
    }

    /// Lets a pinned variable go: states and inputs go on from the pinned value, outputs are again what the model
    /// says; those of a sampled part at its next sample.
    ///
    /// # Errors
    /// It is not pinned.
    pub fn unpin(&mut self, path: &str) -> Result<(), VariableError> {
        self.unpin_all(&[path])
    }

    /// The same of several variables: all of it, or nothing.
    pub(super) fn unpin_all(&mut self, all: &[&str]) -> Result<(), VariableError> {
        let mut values = self.pinned_values();
        for path in all {
            if values.remove(*path).is_none() {
                let known: Vec<&str> = values.keys().map(String::as_str).collect();
                let help = match known.is_empty() {
                    true => "nothing is".to_string(),
                    false => format!("pinned are: {}", known.join(", ")),
                };
                self.here(path)?;
                return no(format!("`{path}` is not pinned"), help);
            }
        }
        self.repin(values)
    }

    /// What is pinned, and to what, by path.
    pub fn pins(&self) -> impl Iterator<Item = (&str, f64)> {
        self.state.pins.iter().flat_map(|pins| pins.values())
    }

    /// The pinned value of a variable.
    pub(super) fn pinned(&self, path: &str) -> Option<f64> {
        self.state.pins.as_ref()?.values.get(path).map(|(value, _)| *value)
    }

    /// These pins in place of the present ones. What cannot be evaluated with them changes nothing.
    fn repin(&mut self, values: BTreeMap<String, (f64, Target)>) -> Result<(), VariableError> {
        let before = self.state.clone();
        self.state.pins = Pins::of(values);
        self.hold();
        let plan = self.plan.clone();
        self.refresh().and_then(|()| self.look(&plan)).map_err(|stopped| {
            let e = self.stopped(stopped);
            self.state.copy_from(&before);
            self.replaced();
            VariableError { message: e.message, help: e.help.unwrap_or_default() }
        })
    }

    /// Puts the pins of a checkpoint in force; its lanes hold their values already.
    pub(crate) fn take_pins(&mut self, values: &BTreeMap<String, f64>) -> Result<(), String> {
        self.state.pins = None;
        let values = values.iter().map(|(path, value)| (path.as_str(), *value));
        let (pins, gone) = find(&self.plan, values);
        self.state.pins = pins;
        gone.first().map_or(Ok(()), |(path, why)| Err(format!("the pin of `{path}`: {why}")))
    }

    /// Every pinned lane to its value.
    pub(super) fn hold(&mut self) {
        if let Some(pins) = self.state.pins.clone() {
            let state = &mut self.state;
            pins.hold(&mut state.x, &mut state.d, &mut state.sig);
        }
    }
}

/// Pins in the lanes of a plan, and those that it cannot have: path and why.
pub(super) fn find<'a>(
    plan: &Plan,
    values: impl Iterator<Item = (&'a str, f64)>,
) -> (Option<Arc<Pins>>, Vec<(String, String)>) {
    let mut values = values.peekable();
    if values.peek().is_none() {
        return (None, Vec::new());
    }
    let lanes = Lanes::of(plan);
    let (mut pins, mut gone) = (BTreeMap::new(), Vec::new());
    for (path, value) in values {
        let Some(v) = plan.lanes.get(path) else {
            gone.push((path.to_string(), "it is not there".to_string()));
            continue;
        };
        match target(&lanes, (path, v)) {
            Ok(target) => {
                pins.insert(path.to_string(), (value, target));
            }
            Err(e) => gone.push((path.to_string(), e.message)),
        }
    }
    (Pins::of(pins), gone)
}
