//! Pins: variables that keep a value until they are unpinned, independent of the model.
//!
//! ```text
//! state              its derivative is zero at every stage; its value is restored after steps, updates and events
//! input, no wire     no other writer exists
//! output, sum               restored after each operation that writes it, before dependent operations are evaluated
//! ```
//! Therefore every reader sees the pinned value, at every stage of the integrator and at every tick before its rows. This includes the part that
//! writes the variable, if it also reads it (a machine integrates the accelerations that it outputs).
//! A part with its own stepping method (a machine with contact by impulses) uses internal values: its states cannot be pinned, and pins of its
//! outputs (contact reports, accelerations) affect only readers. Without pins, a step costs one additional comparison for each list of operations.
use super::pinned::{Pins, Target};
use super::simulation::{Simulation, VariableError};
use crate::author::model::lanes;
use crate::author::variable::{Place, Role, Variable};
use crate::plan::compiled::{Op, Plan};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Returns the signal slots that an operation writes.
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
            let report = l.work as usize..l.work as usize + crate::plan::compiled::REPORT;
            let sought = l.tears.iter().map(|t| t.0 as usize..t.0 as usize + 1);
            let inside = l.ops.iter().flat_map(|op| writes(plan, *op));
            inside.chain(sought).chain([report]).collect()
        }
    }
}

fn no<T>(message: String, help: impl Into<String>) -> Result<T, VariableError> {
    Err(VariableError { message, help: help.into() })
}

/// Information about a plan that pinning needs.
struct Lanes<'a> {
    plan: &'a Plan,
    /// The operation that writes each signal slot.
    writer: Vec<Option<u32>>,
    /// The part of each state, and whether the state is coupled to others by a constraint (a rotation, a closed loop).
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

/// Returns where a variable of a plan can be pinned, or an error with the reason why it cannot.
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
                        "`{path}` cannot be pinned: its part couples it to other numbers (a rotation, a closed loop)"
                    ),
                    "pin a rate without this constraint, or prescribe the hinge and pin the variable that prescribes it",
                ),
            };
        }
        Place::D(k) => return Ok(Target::D(k)),
        Place::Channel(_) | Place::Phase(_) => {
            return no(
                format!("`{path}` has no stored value in this plan"),
                "report this as a bug in Linkwork",
            );
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
            "pin an input of the loop",
        ),
        (Role::Input, Some((_, Op::Outputs(k) | Op::Feedthrough(k)))) => {
            let is = |w: &&Variable| w.role == Role::Output && w.place == v.place;
            let source = plan.lanes.iter().find(|(_, w)| is(w));
            match source {
                Some((source, _)) => no(
                    format!("`{path}` cannot be pinned, because it only reads `{source}`"),
                    format!("pin `{source}`: all its readers then receive the pinned value"),
                ),
                None => no(
                    format!(
                        "`{path}` cannot be pinned, because it is bound to `{}`",
                        plan.parts[*k as usize].path
                    ),
                    "pin a coordinate or a rate of a body, or an output of the part that reads it",
                ),
            }
        }
        (_, Some((op, _))) => Ok(Target::Signal(lane as u32, Some(op))),
        // The output is written by a part with its own stepping method, or it is a state that is shown as an output.
        (Role::Output, None) => Ok(Target::Signal(lane as u32, None)),
        (_, None) => no(
            format!("`{path}` cannot be pinned: a constant drives it"),
            "change the constant, or remove the wire and pin the input",
        ),
    }
}

const ADVANCES: &str = "its part integrates its own states (a machine with contact by impulses)";
const PRESCRIBE: &str =
    "prescribe the hinge and pin the variable that prescribes it, or use compliant contact";

impl Simulation {
    /// Pins a variable: every reader sees this value from the current instant on until it is unpinned, whatever the model computes. States (whose
    /// derivative is then zero), inputs without a wire, outputs and sums of a `sum` input can be pinned. A pin is part of the state, of
    /// checkpoints, snapshots and forks, and is carried over to phases that have the variable. The value may be changed later.
    ///
    /// Linearizations ignore pins.
    ///
    /// # Errors
    /// Returns an error for an unknown variable, for a value that is not finite, and for a variable that cannot be pinned: an input with a wire (pin
    /// its source), a signal inside a solved loop, or one of several coupled states. Nothing is changed then.
    pub fn pin(&mut self, path: &str, value: f64) -> Result<(), VariableError> {
        self.pin_all(&[(path.to_string(), value)])
    }

    /// Pins several variables: all of them or none.
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

    /// Unpins a variable: states and inputs continue from the pinned value, outputs follow the model again; outputs of a sampled part do so at its
    /// next sample.
    ///
    /// # Errors
    /// Returns an error if the variable is not pinned.
    pub fn unpin(&mut self, path: &str) -> Result<(), VariableError> {
        self.unpin_all(&[path])
    }

    /// Unpins several variables: all of them or none.
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

    /// Returns the pinned variables and values, by path.
    pub fn pins(&self) -> impl Iterator<Item = (&str, f64)> {
        self.state.pins.iter().flat_map(|pins| pins.values())
    }

    /// Returns the pinned value of a variable.
    pub(super) fn pinned(&self, path: &str) -> Option<f64> {
        self.state.pins.as_ref()?.values.get(path).map(|(value, _)| *value)
    }

    /// Replaces the current pins. If the model cannot be evaluated with them, nothing is changed.
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
        })?;
        self.tell_observer_of_change();
        Ok(())
    }

    /// Restores the pins of a checkpoint; the states and signals already have their values.
    pub(crate) fn take_pins(&mut self, values: &BTreeMap<String, f64>) -> Result<(), String> {
        self.state.pins = None;
        let values = values.iter().map(|(path, value)| (path.as_str(), *value));
        let (pins, gone) = find(&self.plan, values);
        self.state.pins = pins;
        gone.first().map_or(Ok(()), |(path, why)| Err(format!("the pin of `{path}`: {why}")))
    }

    /// Sets every pinned slot to its value.
    pub(super) fn hold(&mut self) {
        if let Some(pins) = self.state.pins.clone() {
            let state = &mut self.state;
            pins.hold(&mut state.x, &mut state.d, &mut state.sig);
        }
    }
}

/// Returns the pins of a plan, and the pins that it cannot have, with path and reason.
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
            gone.push((path.to_string(), "it does not exist".to_string()));
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
