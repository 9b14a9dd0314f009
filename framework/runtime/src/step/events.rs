//! Events: where guards change their sign, and what they fire.
//!
//! ```text
//! after a step:   guards at its end, and inside where they may have crossed twice
//! a crossing:     sought on the dense output, then located to 1 ps by steps that end there; all guards that cross
//!                 within 1 ns of it are due, in path order
//! an event:       the first that is due fires → operations that follow → guards again
//! ```
//! A guard that has fired counts again when it has left its zero. Conditions of transitions are due
//! as soon as they hold.
use super::evaluate::{self, Running, Stopped};
use super::integrate::Purpose;
use super::{GuardState, Simulation, State};
use crate::block::{Evaluation, Failure, Now};
use crate::plan::{Fires, GuardPlan, Plan};
use linkwork_integrate::Failure as StepFailure;
use linkwork_integrate::events::{Crossing, Direction, Search, SearchError, Side, first_crossing};

/// Guards that cross within this time (s) of the first are one instant.
const WINDOW: f64 = 1e-9;
/// A crossing is located to this (s): errors of a thousand events in a row stay below the window.
const EXACT: f64 = 1e-12;
/// Events at one instant, beyond which a cascade has no end.
const CASCADE_MAX: u32 = 1000;

fn sign(value: f64) -> i8 {
    i8::from(value > 0.0) - i8::from(value < 0.0)
}

/// Whether a change to this side counts.
fn counts(direction: Direction, to: i8) -> bool {
    match direction {
        Direction::Rising => to > 0,
        Direction::Falling => to < 0,
        Direction::Either => to != 0,
    }
}

impl GuardState {
    /// Looks at a value: whether it has changed sides in a direction that counts.
    fn see(&mut self, value: f64, direction: Direction, level: bool) -> bool {
        self.value = value;
        let to = sign(value);
        let crossed = to != 0 && self.side != 0 && to != self.side && counts(direction, to);
        if to != 0 {
            self.side = to;
        }
        crossed || (level && value > 0.0)
    }

    /// Due no more where the state was changed from outside, or the part, so that the value stands where it came from again. `change`: its last one in a step; within a
    /// millionth of that it is rounding.
    pub(super) fn go_back(&mut self, value: f64, change: f64, guard: &GuardPlan) {
        let rounding = if change.is_finite() { 1e-6 * change.abs() } else { 1e-9 };
        let back = match guard.direction {
            Direction::Rising => value < -rounding,
            Direction::Falling => value > rounding,
            Direction::Either => false,
        };
        if self.due && back && !guard.level() {
            (self.due, self.value, self.side) = (false, value, sign(value));
        }
    }
}

impl Simulation {
    pub(super) fn is_due(&self) -> bool {
        self.state.guards.iter().any(|g| g.due)
    }

    /// Guards at the present instant, into `work.end`.
    fn values_now(&mut self, plan: &Plan) -> Result<(), Stopped> {
        let now = self.next(Evaluation::Tick);
        let State { x, d, sig, .. } = &self.state;
        evaluate::guards(&mut self.blocks, plan, &now, (x, d, sig), &mut self.work.end)
    }

    /// At the start of a run or phase: the side on which each guard stands.
    pub(super) fn arm(&mut self) -> Result<(), Stopped> {
        let plan = self.plan.clone();
        self.values_now(&plan)?;
        for (k, guard) in plan.guards.iter().enumerate() {
            let (state, value) = (&mut self.state.guards[k], self.work.end[k]);
            state.due |= guard.level() && value > 0.0;
            (state.value, state.side, state.change) = (value, sign(value), f64::INFINITY);
        }
        Ok(())
    }

    /// After a state was set: guards that are due and stand where they came from are due no more.
    pub(super) fn go_back(&mut self) -> Result<(), Stopped> {
        let plan = self.plan.clone();
        if self.is_due() {
            self.values_now(&plan)?;
            for (k, guard) in plan.guards.iter().enumerate() {
                let state = &mut self.state.guards[k];
                state.go_back(self.work.end[k], state.change, guard);
            }
        }
        Ok(())
    }

    /// After the work of a row, or of an event: guards that jumped are due.
    pub(super) fn look(&mut self, plan: &Plan) -> Result<(), Stopped> {
        self.values_now(plan)?;
        for (k, guard) in plan.guards.iter().enumerate() {
            let (state, value) = (&mut self.state.guards[k], self.work.end[k]);
            state.due |= state.see(value, guard.direction, guard.level());
        }
        Ok(())
    }

    /// Fires the first guard that is due.
    pub(super) fn fire(&mut self) -> Result<(), Stopped> {
        let plan = self.plan.clone();
        let Some(k) = self.state.guards.iter().position(|g| g.due) else { return Ok(()) };
        let guard = &plan.guards[k];
        if let Fires::Part { block, which } = guard.fires {
            // What stops the run stays due: a run that goes on from here stops again.
            self.hear(&plan, &guard.name, block, which as usize)?;
        }
        self.state.micro += 1;
        if self.state.micro > CASCADE_MAX {
            return Err(self.endless(&plan, k));
        }
        self.state.guards[k].due = false;
        let GuardState { change, side, .. } = self.state.guards[k];
        match guard.fires {
            Fires::Part { block, which } => {
                let now = self.next(Evaluation::Tick);
                let State { x, d, sig, pins, .. } = &mut self.state;
                let fired = self.blocks[block as usize].fired(&now, which as usize, x, d, sig);
                fired.map_err(|failure| Stopped { block, failure })?;
                if let Some(pins) = pins {
                    pins.hold(x, d, sig);
                }
                self.refresh()?;
                self.state.guards[k].side = 0;
                self.look(&plan)?;
                self.leave_zero(&plan, k, side, change);
            }
            Fires::Transition { to } => self.transition(to, &guard.name)?,
        }
        // The step size of before says nothing about after.
        self.state.memory = linkwork_integrate::Memory::START;
        Ok(())
    }

    /// The guard that has just fired stands at its zero and waits until it leaves it; unless what it
    /// fired threw it back to the other side, which is a change of sign like any other. Within a
    /// millionth of its last change a value is rounding.
    fn leave_zero(&mut self, plan: &Plan, fired: usize, side: i8, change: f64) {
        let guard = &mut self.state.guards[fired];
        let rounding = if change.is_finite() { 1e-6 * change.abs() } else { 0.0 };
        let to = sign(guard.value);
        let back = to == -side && to != 0 && guard.value.abs() > rounding;
        guard.due |= back && counts(plan.guards[fired].direction, to);
        guard.side = if back { to } else { 0 };
        // How fast guards move after an event is not known.
        self.state.guards.iter_mut().for_each(|g| g.change = f64::INFINITY);
    }

    #[cold]
    fn endless(&self, plan: &Plan, k: usize) -> Stopped {
        let names: Vec<&str> = (plan.guards.iter().zip(&self.state.guards))
            .filter(|(_, s)| s.due)
            .map(|(g, _)| &*g.name)
            .collect();
        let message =
            format!("{CASCADE_MAX} events at one instant, and still due: {}", names.join(", "));
        let help = "each fires the other, or itself, without end: let a guard change its state so that it leaves zero";
        let block = match plan.guards[k].fires {
            Fires::Part { block, .. } => block,
            Fires::Transition { .. } => 0,
        };
        Stopped { block, failure: Box::new(Failure { message, help: Some(help.into()) }) }
    }

    /// After a step of h s, the `last` before the row or not: where in it the first guard crosses; all that cross within 1 ns of that are
    /// due. Without a crossing the guards take their values at the end.
    pub(super) fn crossing(
        &mut self,
        plan: &Plan,
        (h, last): (f64, bool),
    ) -> Result<Option<f64>, StepFailure<Stopped>> {
        let mut end = std::mem::take(&mut self.work.end);
        let seen = if last || plan.steps.is_empty() {
            let (t1, x) = (self.time() + h, std::mem::take(&mut self.state.x));
            let seen = self.guards_at(plan, t1, &x, &mut end);
            self.state.x = x;
            seen.map_err(StepFailure::System)
        } else {
            // What advances by itself is at the row already.
            self.look_at(plan, h, 1.0).map(|()| end.copy_from_slice(&self.work.middle))
        };
        let found = seen.and_then(|()| self.first_crossing(plan, h, &end));
        if let Ok(None) = found {
            for (k, guard) in plan.guards.iter().enumerate() {
                let state = &mut self.state.guards[k];
                state.change = end[k] - state.value;
                state.see(end[k], guard.direction, false);
            }
        }
        self.work.end = end;
        found
    }

    fn guards_at(
        &mut self,
        plan: &Plan,
        t: f64,
        x: &[f64],
        values: &mut [f64],
    ) -> Result<(), Stopped> {
        let now = Now {
            t,
            dt: plan.step.seconds(),
            tick: self.state.tick,
            evaluation: Evaluation::Stage,
            number: 0,
        };
        let Simulation { state, blocks, work, .. } = self;
        let State { d, sig, pins, .. } = state;
        let (number, pins) = (&mut work.number, pins.as_deref());
        let (linear, stage) = (None, None);
        let mut running = Running { plan, blocks, d, sig, now, pins, number, linear, stage };
        running.guards_at(t, x, values)
    }

    /// Value of every guard at θ of the last step, into `work.middle`.
    fn look_at(&mut self, plan: &Plan, h: f64, theta: f64) -> Result<(), StepFailure<Stopped>> {
        self.look_for(plan, h, theta, Purpose::Look)
    }

    fn look_for(
        &mut self,
        plan: &Plan,
        h: f64,
        theta: f64,
        purpose: Purpose,
    ) -> Result<(), StepFailure<Stopped>> {
        self.state_at(plan, h, theta, purpose)?;
        let t = self.time() + theta * h;
        let inside = std::mem::take(&mut self.work.inside);
        let mut values = std::mem::take(&mut self.work.middle);
        let seen = self.guards_at(plan, t, &inside, &mut values);
        (self.work.inside, self.work.middle) = (inside, values);
        seen.map_err(StepFailure::System)
    }

    fn first_crossing(
        &mut self,
        plan: &Plan,
        h: f64,
        end: &[f64],
    ) -> Result<Option<f64>, StepFailure<Stopped>> {
        let mut first: Option<(Crossing, usize)> = None;
        for k in 0..plan.guards.len() {
            if let Some(found) = self.find(plan, h, k, end[k])?
                && found.theta < first.map_or(f64::INFINITY, |f| f.0.theta)
            {
                first = Some((found, k));
            }
        }
        let Some((found, k)) = first else { return Ok(None) };
        let theta = found.theta;
        for (state, end) in self.state.guards.iter_mut().zip(end) {
            state.change = end - state.value;
        }
        self.state.guards[k].due = true;
        // Others within the window: on the other side by its end.
        let later = (theta + WINDOW / h).min(1.0);
        self.look_at(plan, h, later)?;
        for (k, guard) in plan.guards.iter().enumerate() {
            let value = self.work.middle[k];
            let state = &mut self.state.guards[k];
            if !state.due {
                state.due = state.see(value, guard.direction, guard.level());
            }
        }
        self.by_steps(plan, h, k, found).map(Some)
    }

    /// θ of a crossing of guard k that was found on the dense output, located again by steps that end there: the stages of a step across
    /// the event have seen what lies behind it. Most often the first of these steps comes to where it was found.
    fn by_steps(
        &mut self,
        plan: &Plan,
        h: f64,
        k: usize,
        found: Crossing,
    ) -> Result<f64, StepFailure<Stopped>> {
        let theta = found.theta;
        // What advances by itself is interpolated, and a jump is where it is.
        if theta == 0.0 || plan.derivs.is_empty() {
            return Ok(theta);
        }
        let sign = if found.direction == Direction::Rising { 1.0 } else { -1.0 };
        let start = sign * self.state.guards[k].value;
        let back = theta.min(1e-3);
        self.look_at(plan, h, theta - back)?;
        let slope = sign * (found.value - self.work.middle[k]) / back;
        let mut value = |theta: f64| {
            self.look_for(plan, h, theta, Purpose::Again).map(|()| sign * self.work.middle[k])
        };
        let width = (EXACT / h).max(4.0 * f64::EPSILON);
        let there = value(theta)?;
        if (0.0..=slope * width).contains(&there) {
            return Ok(theta);
        }
        // A bracket around it, whose width follows from how far off the value is.
        let mut reach = if slope > 0.0 { (2.0 * there.abs() / slope).max(width) } else { width };
        let (mut low, mut high) = ((theta, there), (theta, there));
        while low.1 >= 0.0 {
            high = low;
            let to = (theta - reach).max(0.0);
            low = (to, if to > 0.0 { value(to)? } else { start });
            if to == 0.0 && low.1 >= 0.0 {
                return Ok(theta);
            }
            reach *= 2.0;
        }
        while high.1 < 0.0 {
            if high.0 == 1.0 {
                // It touches zero within the error of the step.
                return Ok(theta);
            }
            low = high;
            let to = (theta + reach).min(1.0);
            high = (to, value(to)?);
            reach *= 2.0;
        }
        let wide = high.0 - low.0;
        let search =
            Search { direction: Direction::Rising, h: wide * h, tolerance: EXACT, samples: 1 };
        let inside = |part: f64| value(low.0 + part * wide);
        match first_crossing(inside, [low.1, high.1], Side::Below, &search) {
            Ok(found) => Ok(found.crossing.map_or(theta, |c| low.0 + c.theta * wide)),
            Err(SearchError::Guard(failure)) => Err(failure),
            Err(SearchError::NotANumber { .. }) => Err(StepFailure::System(self.nan(plan, k))),
        }
    }

    /// Where in the last step guard k first changes its side in its direction: at the end of the step,
    /// or inside it, where it may also have come back.
    fn find(
        &mut self,
        plan: &Plan,
        h: f64,
        k: usize,
        end: f64,
    ) -> Result<Option<Crossing>, StepFailure<Stopped>> {
        let GuardState { value: start, change, side, .. } = self.state.guards[k];
        // It may have gone to zero and come back only if it moved about as far as it stands from it.
        let moved = (end - start).abs().max(change.abs());
        let near = start.abs().min(end.abs());
        if side != 0 && sign(end) == side && near > 2.0 * moved {
            return Ok(None);
        }
        let side = match side {
            -1 => Side::Below,
            1 => Side::Above,
            _ => Side::Zero,
        };
        let direction = plan.guards[k].direction;
        let search = Search { direction, h, tolerance: EXACT, samples: 1 };
        let value = |theta: f64| self.look_at(plan, h, theta).map(|()| self.work.middle[k]);
        match first_crossing(value, [start, end], side, &search) {
            Ok(found) => Ok(found.crossing),
            Err(SearchError::Guard(failure)) => Err(failure),
            Err(SearchError::NotANumber { .. }) => Err(StepFailure::System(self.nan(plan, k))),
        }
    }

    #[cold]
    fn nan(&self, plan: &Plan, k: usize) -> Stopped {
        let guard = &plan.guards[k];
        let block = match guard.fires {
            Fires::Part { block, .. } => block,
            Fires::Transition { .. } => 0,
        };
        let message = format!("guard `{}` is no number", guard.name);
        Stopped { block, failure: Box::new(Failure { message, help: None }) }
    }
}
