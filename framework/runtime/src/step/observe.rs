//! Observed variables between two rows: their values at the ends of each stretch of time without a jump, and anywhere
//! inside it.
//!
//! ```text
//! stretch     a step of the integrator, or its part up to an event
//! start       the values right after the instant at which it begins (a row, an event, a variable that was set)
//! end         the values right before the instant at which it ends: sampled parts have not been updated there yet
//! inside      the dense output of the step; up to an event a step that ends at the place asked for
//! ```
//! used        the values that the integrator used last in a fixed step: averages over the step, and with `rk4` the values at its end
//! Variables that are observed sparingly ([`ObserverRequest::sparing`]) and the accounts of blocks cost no evaluation in fixed steps: their values are those at rows
//! and events, and those used.
//! Observing a run does not change it: the signals are restored before `observe_step` returns.
use super::evaluate;
use super::observed::{Columns, Lane, ObserverRequest};
use super::simulation::Purpose;
use super::simulation::Simulation;
use super::simulation::{Observed, Observer, Stretch};
use super::state::State;
use crate::author::block::{EvalTime, Evaluation};
use crate::plan::compiled::Plan;
use crate::plan::condition::Times;
use linkwork_integrate::Method;
use std::any::Any;

/// The values at the end of a stretch are taken earlier by this fraction of its length, because a jump at its end belongs to the next stretch.
const BEFORE: f64 = 1e-9;

/// Returns whether the start of a step is kept where parts have their own stepping method, so that values inside it are known.
pub(super) fn keeps_start(plan: &Plan) -> bool {
    !plan.guards.is_empty() || plan.integration.control.is_some()
}

/// Returns whether a step that ends at the row (`last`) ends at the work of sampled parts.
fn ends_at_sample(plan: &Plan, row: u32, last: bool) -> bool {
    let row = &plan.table[(row as usize + 1) % plan.table.len()];
    let work = &plan.works[row.work as usize];
    let held = |op: &u32| !plan.flow.continuous[*op as usize];
    last && (!work.updates.is_empty() || work.ops.iter().any(held))
}

impl Stretch<'_> {
    /// Returns the instant at which it begins (s).
    pub fn begin(&self) -> f64 {
        self.sim.time()
    }

    /// Returns the time of an instant in it, and the time since the phase began.
    pub fn times(&self, t: f64) -> Times {
        Times { time: t, phase: t - self.sim.state.began() }
    }

    /// Returns its length (s).
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Returns the values right after its begin.
    pub fn start(&self) -> &[f64] {
        self.start
    }

    /// Returns the values right before its end.
    pub fn end(&self) -> &[f64] {
        self.end
    }

    /// Returns whether a variable keeps its value from begin to end.
    pub fn is_held(&self, column: usize) -> bool {
        matches!(self.columns.lanes[column], Lane::Held(_) | Lane::Absent)
    }

    /// Returns whether a variable may bend strongly within it: the step size is adaptive, or the plan integrates no state.
    pub fn is_wide(&self) -> bool {
        self.plan.integration.control.is_some() || self.plan.derivs.is_empty()
    }

    /// Returns whether its end and inner values include the variables that are observed sparingly.
    pub fn has_all(&self) -> bool {
        self.all
    }

    /// Returns whether it ends at a row at which sampled parts change their outputs.
    pub fn ends_at_sample(&self) -> bool {
        self.sampled
    }

    /// Returns the average of a variable that is an average over a fixed step, or that follows from such a variable.
    pub fn average(&self, column: usize) -> Option<f64> {
        self.columns.averaged[column].then(|| self.used[column])
    }

    /// Returns the value right before the end, where it is known without an evaluation although the values at the end are not ([`Stretch::has_all`]).
    pub fn before_end(&self, column: usize) -> Option<f64> {
        (!self.all && self.columns.staged[column]).then(|| self.used[column])
    }

    /// Returns whether forces at its begin are held over it: semi-implicit Euler and contact by impulses.
    pub fn is_first_order(&self) -> bool {
        let euler = matches!(self.plan.integration.method, Method::SemiImplicitEuler);
        euler || !self.plan.steps.is_empty()
    }

    /// Returns whether values inside it are known. They are unknown if a part has its own stepping method, which advances from row to row.
    pub fn is_dense(&self) -> bool {
        self.plan.steps.is_empty() || keeps_start(self.plan)
    }

    /// Returns the values at this part of it (0: begin, 1: end); `None` where they are not known.
    pub fn at(&mut self, part: f64) -> Option<&[f64]> {
        if !self.is_dense() {
            return None;
        }
        self.evaluate_at(part, None).then_some(&self.inner[..])
    }

    /// Evaluates the values at this part of it into `inner`; with a span (s), averages over it.
    fn evaluate_at(&mut self, part: f64, span: Option<[f64; 2]>) -> bool {
        let (t, theta) = (self.sim.time() + part * self.length, part * self.length / self.step);
        if self.sim.state_at(self.plan, self.step, theta, self.purpose).is_err() {
            return false;
        }
        let inside = std::mem::take(&mut self.sim.work.inside);
        let done = self.evaluate(t, &inside, span);
        if done {
            let State { d, sig, entered, .. } = &self.sim.state;
            self.columns.read(entered, &inside, d, sig, self.inner);
        }
        self.sim.work.inside = inside;
        done
    }

    /// Evaluates the operations of the columns; returns false when one of them fails.
    fn evaluate(&mut self, t: f64, x: &[f64], span: Option<[f64; 2]>) -> bool {
        let ops = if self.all { &self.columns.all_ops } else { &self.columns.ops };
        if ops.is_empty() {
            return true;
        }
        let sim = &mut *self.sim;
        if !std::mem::replace(self.disturbed, true) {
            self.signals.copy_from_slice(&sim.state.sig);
        }
        sim.work.number += 1;
        let (tick, number) = (sim.state.tick, sim.work.number);
        let dt = self.plan.step.seconds();
        let now = EvalTime { t, dt, tick, evaluation: Evaluation::Stage, span, number };
        let State { d, sig, pins, .. } = &mut sim.state;
        let lanes = (x, &d[..], &mut sig[..]);
        evaluate::run_all(&mut sim.blocks, self.plan, ops, &now, lanes, pins.as_deref()).is_ok()
    }
}

impl Simulation {
    /// Passes the values of these variables over time to an observer, from the present instant on. A simulation has one
    /// observer; a second replaces the first. Forks have none.
    pub fn observe(&mut self, wanted: &ObserverRequest, observer: Box<dyn Observer>) {
        let phases = self.program.phases.iter().zip(&self.program.channels);
        let phases = phases.map(|(phase, channels)| Columns::of(&phase.plan, wanted, channels));
        let most = self.program.phases.iter().map(|p| p.plan.sizes.sig).max().unwrap_or(0);
        let values = || vec![f64::NAN; wanted.width()];
        self.observed = Some(Box::new(Observed {
            phases: phases.collect(),
            observer,
            start: values(),
            end: values(),
            inner: values(),
            used: values(),
            signals: Vec::with_capacity(most),
            disturbed: false,
        }));
    }

    /// Returns the observer, when it has this type.
    pub fn observer<O: Observer>(&self) -> Option<&O> {
        let observer: &dyn Any = &*self.observed.as_ref()?.observer;
        observer.downcast_ref()
    }

    /// Returns the observer for changes, when it has this type.
    pub fn observer_mut<O: Observer>(&mut self) -> Option<&mut O> {
        let observer: &mut dyn Any = &mut *self.observed.as_mut()?.observer;
        observer.downcast_mut()
    }

    /// Tells the observer that a state or a pin was changed from outside.
    pub(super) fn tell_observer_of_change(&mut self) {
        if let Some(observed) = &mut self.observed {
            observed.observer.changed();
        }
    }

    /// Passes the present instant to the observer.
    pub fn observe_now(&mut self) {
        let time = self.time();
        let t = Times { time, phase: time - self.state.began() };
        let (tick, number) = (self.state.tick, self.work.number);
        let dt = self.plan.step.seconds();
        let now = EvalTime { t: time, dt, tick, evaluation: Evaluation::Tick, span: None, number };
        if let Some(observed) = &mut self.observed {
            let State { x, d, sig, phase, entered, .. } = &self.state;
            let Observed { phases, observer, start, .. } = &mut **observed;
            let columns = &phases[*phase as usize];
            columns.read(entered, x, d, sig, start);
            for &(block, first, n) in &columns.accounts {
                let out = &mut start[first..first + n];
                self.blocks[block as usize].accounts(&now, x, sig, out);
            }
            observer.instant(t, start);
        }
    }

    /// Copies the values at the beginning of a stretch from the signals, which belong to this instant.
    #[inline]
    pub(super) fn observe_start(&mut self) {
        if let Some(observed) = &mut self.observed {
            let State { x, d, sig, phase, entered, .. } = &self.state;
            observed.phases[*phase as usize].read(entered, x, d, sig, &mut observed.start);
        }
    }

    /// Copies the values that the integrator used last in a fixed step. `last`: the step ends at the row.
    #[inline]
    pub(super) fn observe_used(&mut self, plan: &Plan, last: bool) {
        let Some(observed) = &mut self.observed else { return };
        if plan.integration.control.is_none()
            && (plan.averages || ends_at_sample(plan, self.state.row, last))
        {
            let State { x, d, sig, phase, entered, .. } = &self.state;
            observed.phases[*phase as usize].read(entered, x, d, sig, &mut observed.used);
        }
    }

    /// Passes a step of h s to the observer; the run uses it up to an event at θ, or completely; `last`: the step ends at the row.
    pub(super) fn observe_step(&mut self, plan: &Plan, (h, last): (f64, bool), event: Option<f64>) {
        let Some(mut observed) = self.observed.take() else { return };
        let Observed { phases, observer, start, end, inner, used, signals, disturbed } =
            &mut *observed;
        let columns = &phases[self.state.phase as usize];
        let length = event.unwrap_or(1.0) * h;
        *disturbed = false;
        signals.resize(self.state.sig.len(), 0.0);
        if length > 0.0 {
            let purpose = if event.is_some() { Purpose::Again } else { Purpose::Look };
            let (known, step): (&[f64], f64) = (&[], h);
            let all = event.is_some() || plan.integration.control.is_some();
            let sampled = ends_at_sample(plan, self.state.row, last);
            let mut over = Stretch {
                sim: self,
                plan,
                columns,
                start,
                end: known,
                inner,
                used: &[],
                signals,
                disturbed,
                all,
                sampled,
                step,
                length,
                purpose,
            };
            // Parts with their own stepping method are already at the row.
            let whole = event.is_none() && (last || plan.steps.is_empty());
            let known = if all { start.len() } else { columns.often };
            if over.evaluate_end(whole) {
                end[..known].copy_from_slice(&over.inner[..known]);
            } else {
                end.copy_from_slice(start);
            }
            over.end = end;
            if event.is_some() && plan.averages {
                // The integrator averages over the part of the step up to the event.
                let begin = over.begin();
                let span = Some([begin, begin + length]);
                if over.is_dense() && over.evaluate_at(1.0 - BEFORE, span) {
                    used.copy_from_slice(over.inner);
                } else {
                    used.copy_from_slice(over.end);
                }
            }
            over.used = used;
            observer.stretch(&mut over);
        }
        if *disturbed {
            self.state.sig.copy_from_slice(signals);
        }
        // If no row or event follows in between, the next stretch begins with the values at the end
        // of this one.
        std::mem::swap(start, end);
        self.observed = Some(observed);
    }
}

impl Stretch<'_> {
    /// Computes the values immediately before the end of the stretch into `inner`.
    fn evaluate_end(&mut self, whole: bool) -> bool {
        if !whole && self.is_dense() {
            return self.at(1.0 - BEFORE).is_some();
        }
        let t = self.sim.time() + self.length * (1.0 - BEFORE);
        let x = std::mem::take(&mut self.sim.state.x);
        let done = self.evaluate(t, &x, None);
        if done {
            let State { d, sig, entered, .. } = &self.sim.state;
            let known = if self.all { self.inner.len() } else { self.columns.often };
            self.columns.read(entered, &x, d, sig, &mut self.inner[..known]);
        }
        self.sim.state.x = x;
        done
    }
}
