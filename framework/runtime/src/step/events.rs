//! Events: the instants at which guards reach their thresholds, and their handlers.
//!
//! ```text
//! after a step:   guards at its end, and inside where they may have crossed twice
//! a crossing:     sought on the dense output, then located to 1 ps by steps that end there; all guards that have reached
//!                 zero at that instant are due, and one that has not, by however little, waits for its own
//! an event:       the first part in path order of which a guard is due: `handle_event` once, with all of its guards that are due
//!                 → operations that follow → guards again
//! ```
//! A guard with a direction is a level: it is due at the start of the run, or of the phase that adds its part, if it has reached zero there. Later it
//! is due when it reaches zero from the other side. Conditions of transitions are due as soon as they hold.
use super::evaluate::{self, Running};
use super::simulation::Purpose;
use super::simulation::Simulation;
use super::state::{GuardState, State};
use super::stopped::Stopped;
use crate::author::block::{EvalTime, Evaluation, Failure};
use crate::author::model::Fired;
use crate::plan::compiled::{Fires, GuardPlan, Plan};
use linkwork_integrate::Failure as StepFailure;
use linkwork_integrate::events::{Crossing, Direction, Search, SearchError, Side, first_crossing};

/// A change of a guard within this time (s) counts as round-off at the instant of its event. After a step of this length it is known on which side a
/// guard is that fired at the start of the step.
const INSTANT: f64 = 1e-9;
/// Accuracy of a located crossing (s): the errors of a thousand successive events remain below the duration that counts as one instant.
const EXACT: f64 = 1e-12;
/// Number of events at one instant beyond which a cascade counts as endless.
const CASCADE_MAX: u32 = 1000;

/// Returns the side of a value: −1 or 1.
fn side(value: f64, direction: Direction) -> i8 {
    if Side::of(value, direction) == Side::Above { 1 } else { -1 }
}

/// Returns the direction of a change to this side, if it counts for the guard.
fn way(direction: Direction, to: i8) -> Option<i8> {
    match direction {
        Direction::Rising if to < 0 => None,
        Direction::Falling if to > 0 => None,
        _ => Some(to),
    }
}

impl GuardState {
    /// Updates the guard with a value at a later instant; it is due if it has changed its side in a direction that counts.
    fn see(&mut self, value: f64, guard: &GuardPlan) {
        self.value = value;
        let to = side(value, guard.direction);
        if self.side != 0
            && to != self.side
            && let Some(way) = way(guard.direction, to)
        {
            self.due = way;
        }
        self.side = to;
    }

    /// Updates the guard with a value at the same instant. The side of a guard that has fired at this instant remains unknown, because it is zero
    /// within round-off.
    pub(super) fn see_now(&mut self, value: f64, guard: &GuardPlan) {
        let fired = self.side == 0;
        self.see(value, guard);
        if fired {
            self.side = 0;
        }
        if guard.level() && value >= 0.0 {
            self.due = 1;
        }
        self.go_back(value, guard);
    }

    /// Updates the guard after an event of its part: a guard of the new piece that begins at zero within round-off is not due. Its side is known
    /// after the next step.
    fn settle(&mut self, guard: &GuardPlan) {
        let edge = guard.direction == Direction::Either && self.slack > 0.0;
        if edge && self.value.abs() <= self.slack {
            (self.due, self.side) = (0, 0);
        }
    }

    /// Cancels a due guard whose value is on its original side again, because the user, the part or an event of the same instant changed the state.
    pub(super) fn go_back(&mut self, value: f64, guard: &GuardPlan) {
        let back = match (self.due, guard.direction) {
            (0, _) => false,
            (_, Direction::Rising) => value < -self.slack,
            (_, Direction::Falling) => value > self.slack,
            (way, Direction::Either) => f64::from(way) * value < -self.slack,
        };
        if back {
            (self.due, self.value, self.side) = (0, value, side(value, guard.direction));
        }
    }

    /// Updates the guard after a step of h s with its new value. For blocks with their own stepping method, an event is located on their interpolated
    /// motion, and the step that ends there reaches a slightly different state.
    fn moved(&mut self, end: f64, h: f64, plan: &Plan) {
        self.change = end - self.value;
        let least = if plan.steps.is_empty() { 1e-12 } else { 1e-3 };
        let part = (2.0 * INSTANT / h).clamp(least, 1.0);
        self.slack = if self.change.is_finite() { part * self.change.abs() } else { 0.0 };
    }
}

impl Simulation {
    pub(super) fn is_due(&self) -> bool {
        self.state.guards.iter().any(GuardState::is_due)
    }

    /// Evaluates the guards at the present instant into `work.end`.
    fn values_now(&mut self, plan: &Plan) -> Result<(), Stopped> {
        let now = self.next(Evaluation::Tick);
        let (began, State { x, d, sig, .. }) = (self.state.began(), &self.state);
        let lanes = (&x[..], &d[..], &sig[..]);
        evaluate::guards(&mut self.blocks, plan, (&now, began), lanes, &mut self.work.end)
    }

    /// Sets the side of each guard at the start of a run or phase; a guard that has reached zero is due.
    pub(super) fn arm(&mut self) -> Result<(), Stopped> {
        let plan = self.plan.clone();
        self.values_now(&plan)?;
        for (k, guard) in plan.guards.iter().enumerate() {
            let (state, value) = (&mut self.state.guards[k], self.work.end[k]);
            let on = side(value, guard.direction);
            (state.value, state.side) = (value, on);
            (state.change, state.slack) = (f64::INFINITY, 0.0);
            if guard.direction != Direction::Either
                && let Some(way) = way(guard.direction, on)
            {
                state.due = way;
            }
        }
        Ok(())
    }

    /// Updates the guards at the end of a step, after the work of a row or event, and after a change from outside: guards that have reached zero are
    /// due, and due guards that are on their original side again are cancelled.
    pub(super) fn look(&mut self, plan: &Plan) -> Result<(), Stopped> {
        self.values_now(plan)?;
        for (k, guard) in plan.guards.iter().enumerate() {
            self.state.guards[k].see_now(self.work.end[k], guard);
        }
        Ok(())
    }

    /// Fires the first due guard; returns the monitored condition if one has become true.
    pub(super) fn fire(&mut self) -> Result<Option<u32>, Stopped> {
        let plan = self.plan.clone();
        let Some(k) = self.state.guards.iter().position(GuardState::is_due) else {
            return Ok(None);
        };
        let guard = &plan.guards[k];
        self.work.last = Some(k as u32);
        match guard.fires {
            Fires::Part { block, .. } => self.fire_part(&plan, block)?,
            Fires::Transition { to } => {
                self.count_event(&plan)?;
                self.state.guards[k].due = 0;
                self.transition(to, &guard.name)?;
            }
            Fires::Watch { which } => {
                let guard = &mut self.state.guards[k];
                (guard.due, guard.side) = (0, 0);
                // The condition holds from this instant on, so a negative value is round-off.
                guard.value = guard.value.max(0.0);
                return Ok(Some(which));
            }
        }
        // The last step size and error do not apply after an event.
        self.state.memory = linkwork_integrate::Memory::START;
        Ok(None)
    }

    /// Counts one more event at this instant.
    fn count_event(&mut self, plan: &Plan) -> Result<(), Stopped> {
        self.state.micro += 1;
        if self.state.micro > CASCADE_MAX {
            return Err(self.endless(plan));
        }
        Ok(())
    }

    /// Calls `handle_event` of a part with all of its guards that are due.
    fn fire_part(&mut self, plan: &Plan, block: u32) -> Result<(), Stopped> {
        let Some(g) = plan.guarded.iter().find(|g| g.block == block) else { return Ok(()) };
        let all = g.first as usize..(g.first + g.count) as usize;
        let mut ways = std::mem::take(&mut self.work.ways);
        for k in all.clone() {
            if self.state.guards[k].is_due() {
                ways.fill(0);
                ways[k - all.start] = self.state.guards[k].due;
                // A guard that stops the run stays due, so that a run that continues from here
                // stops again.
                let which = Fired::new(&ways[..all.len()]);
                if let Err(stopped) = self.hear(plan, &plan.guards[k].name, block, which) {
                    self.work.ways = ways;
                    return Err(stopped);
                }
            }
        }
        self.count_event(plan)?;
        for (way, k) in ways.iter_mut().zip(all.clone()) {
            let guard = &mut self.state.guards[k];
            *way = std::mem::take(&mut guard.due);
            if *way != 0 {
                guard.side = 0;
            }
        }
        let now = self.next(Evaluation::Tick);
        let State { x, d, sig, pins, .. } = &mut self.state;
        let which = Fired::new(&ways[..all.len()]);
        let done = self.blocks[block as usize].handle_event(&now, which, x, d, sig);
        if let Some(pins) = pins {
            pins.hold(x, d, sig);
        }
        let done = done.map_err(|failure| Stopped { block, failure });
        let done = done.and_then(|()| self.refresh()).and_then(|()| self.look(plan));
        for (k, &way) in all.clone().zip(ways.iter()) {
            match way {
                0 => self.state.guards[k].settle(&plan.guards[k]),
                _ => self.leave_zero(plan, k, way),
            }
        }
        // The rates of the guards are unknown after an event.
        self.state.guards.iter_mut().for_each(|g| g.change = f64::INFINITY);
        self.work.ways = ways;
        done
    }

    /// Marks a guard that has just fired: it is zero within round-off, and its side is unknown until the end of the next step. If the event has moved
    /// it away from zero, its side is known, and a later change of side counts as usual.
    fn leave_zero(&mut self, plan: &Plan, fired: usize, went: i8) {
        let (guard, direction) = (&mut self.state.guards[fired], plan.guards[fired].direction);
        let to = side(guard.value, direction);
        if guard.value.abs() <= guard.slack {
            return;
        }
        if to == -went {
            guard.side = to;
            guard.due = way(direction, to).unwrap_or(0);
        } else if guard.slack > 0.0 {
            guard.side = to;
        }
    }

    #[cold]
    fn endless(&self, plan: &Plan) -> Stopped {
        let due = |(_, s): &(&GuardPlan, &GuardState)| s.is_due();
        let both = || plan.guards.iter().zip(&self.state.guards).filter(due);
        let names: Vec<&str> = both().map(|(g, _)| &*g.name).collect();
        let message = format!(
            "there were {CASCADE_MAX} events at one instant, and more are due: {}",
            names.join(", ")
        );
        let help = "they trigger each other, or themselves, without end: let each event change the state so that its guard leaves zero";
        let block = both().find_map(|(g, _)| match g.fires {
            Fires::Part { block, .. } => Some(block),
            _ => None,
        });
        let failure = Box::new(Failure { message, help: Some(help.into()) });
        Stopped { block: block.unwrap_or(0), failure }
    }

    /// Finds the position in a step of h s at which the first guard crosses zero, and makes this guard due; `last`: the step ends at the row. If no
    /// guard crosses zero, all take their values at the end.
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
            // Blocks with their own stepping method are already at the row.
            self.look_at(plan, h, 1.0).map(|()| end.copy_from_slice(&self.work.middle))
        };
        let found = seen.and_then(|()| self.first_crossing(plan, h, &end));
        if let Ok(None) = found {
            for (k, guard) in plan.guards.iter().enumerate() {
                let state = &mut self.state.guards[k];
                state.moved(end[k], h, plan);
                state.see(end[k], guard);
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
        let now = EvalTime {
            t,
            dt: plan.step.seconds(),
            tick: self.state.tick,
            evaluation: Evaluation::Stage,
            span: None,
            number: 0,
        };
        let Simulation { state, blocks, work, .. } = self;
        let began = state.began();
        let State { d, sig, pins, .. } = state;
        let (number, pins) = (&mut work.number, pins.as_deref());
        let (linear, stage) = (None, None);
        let mut running = Running { plan, blocks, d, sig, now, began, pins, number, linear, stage };
        running.guards_at(t, x, values)
    }

    /// Evaluates every guard at θ of the last step into `work.middle`.
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
            state.moved(*end, h, plan);
        }
        self.state.guards[k].due = if found.direction == Direction::Rising { 1 } else { -1 };
        // Guards that had fired before this step: the step has shown on which side of zero they
        // are.
        if theta * h > INSTANT && self.state.guards.iter().any(|g| g.side == 0) {
            self.look_at(plan, h, theta)?;
            for (state, (guard, value)) in
                self.state.guards.iter_mut().zip(plan.guards.iter().zip(&self.work.middle))
            {
                if state.side == 0 {
                    state.side = side(*value, guard.direction);
                }
            }
        }
        self.by_steps(plan, h, k, found).map(Some)
    }

    /// Locates a crossing of guard k that was found on the dense output again by steps that end there, because the stages of a step across the event
    /// use values from beyond it; returns its θ. In most cases the first of these steps confirms the position.
    fn by_steps(
        &mut self,
        plan: &Plan,
        h: f64,
        k: usize,
        found: Crossing,
    ) -> Result<f64, StepFailure<Stopped>> {
        let theta = found.theta;
        // Blocks with their own stepping method are interpolated linearly, and a jump is at the
        // start of the step; neither needs a refinement.
        if theta == 0.0 || plan.derivs.is_empty() {
            return Ok(theta);
        }
        let sign = if found.direction == Direction::Rising { 1.0 } else { -1.0 };
        // For a rising guard that fires in both directions, zero itself is on the old side.
        let strict =
            plan.guards[k].direction == Direction::Either && found.direction == Direction::Rising;
        let reached = |y: f64| y > 0.0 || (y == 0.0 && !strict);
        let start = sign * self.state.guards[k].value;
        let back = theta.min(1e-3);
        self.look_at(plan, h, theta - back)?;
        let slope = sign * (found.value - self.work.middle[k]) / back;
        let mut value = |theta: f64| {
            self.look_for(plan, h, theta, Purpose::Again).map(|()| sign * self.work.middle[k])
        };
        let width = (EXACT / h).max(4.0 * f64::EPSILON);
        let there = value(theta)?;
        if reached(there) && there <= slope * width {
            return Ok(theta);
        }
        // Find a bracket around the crossing. Its first width follows from the error of the value.
        let mut reach = if slope > 0.0 { (2.0 * there.abs() / slope).max(width) } else { width };
        let (mut low, mut high) = ((theta, there), (theta, there));
        while reached(low.1) {
            high = low;
            let to = (theta - reach).max(0.0);
            low = (to, if to > 0.0 { value(to)? } else { start });
            if to == 0.0 && reached(low.1) {
                return Ok(theta);
            }
            reach *= 2.0;
        }
        while !reached(high.1) {
            if high.0 == 1.0 {
                // The guard touches zero within the error of the step.
                return Ok(theta);
            }
            low = high;
            let to = (theta + reach).min(1.0);
            high = (to, value(to)?);
            reach *= 2.0;
        }
        let wide = high.0 - low.0;
        let direction = if strict { Direction::Either } else { Direction::Rising };
        let search = Search { direction, h: wide * h, tolerance: EXACT, samples: 1 };
        let inside = |part: f64| value(low.0 + part * wide);
        match first_crossing(inside, [low.1, high.1], Side::Below, &search) {
            Ok(found) => Ok(found.crossing.map_or(theta, |c| low.0 + c.theta * wide)),
            Err(SearchError::Guard(failure)) => Err(failure),
            Err(SearchError::NotANumber { .. }) => Err(StepFailure::System(self.nan(plan, k))),
        }
    }

    /// Finds the first position in the last step at which guard k changes its side in its direction; it may have changed back before the end of the
    /// step.
    fn find(
        &mut self,
        plan: &Plan,
        h: f64,
        k: usize,
        end: f64,
    ) -> Result<Option<Crossing>, StepFailure<Stopped>> {
        let GuardState { value: start, change, side: was, .. } = self.state.guards[k];
        let direction = plan.guards[k].direction;
        // The guard can have reached zero and returned only if its change is comparable with its
        // distance from zero.
        let moved = (end - start).abs().max(change.abs());
        let near = start.abs().min(end.abs());
        if was != 0 && side(end, direction) == was && near > 2.0 * moved {
            return Ok(None);
        }
        let was = match was {
            -1 => Side::Below,
            1 => Side::Above,
            _ => Side::Unknown,
        };
        let search = Search { direction, h, tolerance: EXACT, samples: 1 };
        let value = |theta: f64| self.look_at(plan, h, theta).map(|()| self.work.middle[k]);
        match first_crossing(value, [start, end], was, &search) {
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
            _ => 0,
        };
        let message = format!("guard `{}` is not a number", guard.name);
        Stopped { block, failure: Box::new(Failure { message, help: None }) }
    }
}
