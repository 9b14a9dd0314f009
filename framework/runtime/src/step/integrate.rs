//! Advancing from an instant towards the next row: steps of the integrator, and of blocks with their own stepping method. A guard that reaches its
//! threshold within a step ends the step there.
use super::evaluate::{self, Running};
use super::pinned::Pins;
use super::simulation::Purpose;
use super::simulation::{RunError, Simulation, Stop};
use super::state::State;
use super::stopped::Stopped;
use super::{observe, turning};
use crate::author::block::{EvalTime, Evaluation};
use crate::author::value::{Fault, Origin};
use crate::author::variable::Place;
use crate::plan::compiled::Plan;
use linkwork_integrate::Failure;

/// Number of successive steps and events without progress beyond which a run stops.
const TINY_MAX: u32 = 10_000;
/// Number of steps between two rows or events at which a run warns.
const MANY: u32 = 1_000_000;

impl Simulation {
    /// Advances to the end of the present row, or to the first event before it.
    #[inline]
    pub(super) fn integrate(&mut self, plan: &Plan) -> Result<Stop, RunError> {
        let gap = plan.base.times(plan.table[self.state.row as usize].gap);
        self.observe_start();
        if plan.derivs.is_empty() && plan.steps.is_empty() && !plan.located {
            self.observe_step(plan, (gap - self.state.since, true), None);
            return Ok(Stop::Row);
        }
        if !plan.steps.is_empty() {
            // Advance these parts once, up to the row, independently of the number of steps that the
            // integrator takes for the other states.
            let moved = self.advance(plan, gap - self.state.since);
            moved.map_err(|failure| self.failed(failure))?;
            self.hear_steps(plan);
        }
        // The first step computes k₁ from the signals of this instant, unless parts return averages over the
        // step.
        let (mut known, mut anew) = (!plan.averages, plan.averages);
        let mut steps = 0_u32;
        loop {
            let rest = gap - self.state.since;
            if rest <= 0.0 {
                return Ok(Stop::Row);
            }
            let result = self.one_step(plan, rest, (known, anew));
            let (h, end) = result.map_err(|failure| self.failed(failure))?;
            self.observe_used(plan, end);
            let event = match plan.located {
                false => None,
                true => self.crossing(plan, (h, end)).map_err(|failure| self.failed(failure))?,
            };
            self.observe_step(plan, (h, end), event);
            let length = event.map_or(h, |theta| theta * h);
            self.advances(length, gap)?;
            if let Some(theta) = event {
                let moved = self.go_to_event(plan, h, theta, gap);
                moved.map_err(|failure| self.failed(failure))?;
                return Ok(Stop::Event);
            }
            if end {
                return Ok(Stop::Row);
            }
            self.state.since += h;
            self.state.micro = 0;
            known = false;
            anew = self.rearrange_within(plan).map_err(|stopped| self.stopped(stopped))?;
            steps += 1;
            if steps == MANY {
                self.tell_many(h);
            }
            // Blocks that advance their own states have reached the row already: a plan with such blocks is not interrupted here.
            if plan.steps.is_empty() && self.is_interrupted() {
                let settled = self.refresh().map_err(Failure::System);
                settled.map_err(|failure| self.failed(failure))?;
                return Ok(Stop::Interrupted);
            }
        }
    }

    /// Checks that a run makes progress: fewer than [`TINY_MAX`] successive steps and events are shorter than a billionth of a row.
    #[inline]
    fn advances(&mut self, length: f64, gap: f64) -> Result<(), RunError> {
        if length >= 1e-9 * gap {
            self.work.tiny = 0;
            return Ok(());
        }
        self.work.tiny += 1;
        if self.work.tiny < TINY_MAX { Ok(()) } else { Err(self.chatters(length)) }
    }

    #[cold]
    fn chatters(&self, length: f64) -> RunError {
        let last = self.work.last.and_then(|k| self.plan.guards.get(k as usize));
        let guard = last.map_or(String::new(), |g| format!(", the last event is `{}`", g.name));
        RunError {
            time: self.time(),
            path: last.map_or(String::new(), |g| g.name.clone()),
            message: format!(
                "the run does not advance: {TINY_MAX} consecutive steps and events were shorter than a billionth of the row interval, the last {length:.1e} s{guard}"
            ),
            help: Some(
                "a typical cause is a discontinuity in a feedback loop: give it two thresholds (hysteresis), or use a fixed step (`accuracy: \"fixed\"`)".into(),
            ),
        }
    }

    #[cold]
    fn tell_many(&mut self, h: f64) {
        let (time, row) = (self.time(), self.plan.step.seconds());
        let message = format!(
            "the integrator has made {MANY} steps since the last row or event, now of {h:.1e} s, while rows are {row} s apart"
        );
        let help = "loosen `accuracy`, use `rodas4p` for stiff parts, or give a discontinuity in a feedback loop two thresholds";
        self.notices.add("many steps", time, Fault::new(Origin::NONE, message).help(help));
    }

    /// Updates states that are constant within a step, at the end of a step between rows. Returns whether the derivatives at its end are to be
    /// computed anew.
    #[inline]
    fn rearrange_within(&mut self, plan: &Plan) -> Result<bool, Stopped> {
        if plan.rearranged.is_empty() {
            return Ok(plan.averages);
        }
        let now = self.next(Evaluation::Stage);
        let State { x, d, pins, .. } = &mut self.state;
        let changed = evaluate::rearrange(&mut self.blocks, plan, &now, (x, d), pins.as_deref())?;
        Ok(changed || plan.averages)
    }

    /// Performs one step of at most `rest` s; returns its length, and whether it ends at the row. `known`: the signals belong to the start of the
    /// step; `anew`: derivatives of the last step cannot be used.
    #[inline]
    fn one_step(
        &mut self,
        plan: &Plan,
        rest: f64,
        (known, anew): (bool, bool),
    ) -> Result<(f64, bool), Failure<Stopped>> {
        let t = self.time();
        let now = EvalTime {
            t,
            dt: plan.step.seconds(),
            tick: self.state.tick,
            evaluation: Evaluation::Tick,
            span: plan.averages.then_some([t, t + rest]),
            number: self.work.number,
        };
        if plan.derivs.is_empty() {
            return Ok((rest, true));
        }
        let Simulation { state, blocks, work, .. } = self;
        let began = state.began();
        let State { x, d, sig, memory, pins, .. } = state;
        let pins = pins.as_deref();
        let turns = !turning::of(plan).is_empty();
        let k1 = match known {
            // Compute k₁ again, because the last step used other averages or a state has changed
            // since.
            false if anew => None,
            false => work.integrator.end_derivatives().map(|k| work.xdot.copy_from_slice(k)),
            true => {
                let derived =
                    evaluate::derivatives(blocks, plan, &now, (x, d, sig), pins, &mut work.xdot);
                derived.map_err(Failure::System)?;
                turning::enter_rates(turning::of(plan), x, &mut work.xdot);
                Some(())
            }
        };
        let k1 = k1.map(|()| &work.xdot[..]);
        let moved = if turns {
            work.inside.copy_from_slice(x);
            turning::enter(turning::of(plan), &mut work.inside);
            &mut work.inside
        } else {
            &mut *x
        };
        let (number, linear) = (&mut work.number, work.linear.as_deref_mut());
        let stage = turns.then_some(&mut work.stage[..]);
        let mut system = Running { plan, blocks, d, sig, now, began, pins, number, linear, stage };
        let taken = match &plan.integration.control {
            None => {
                work.integrator.step_fixed(&mut system, t, rest, moved, k1)?;
                (rest, true)
            }
            Some(control) => {
                let integrator = &mut work.integrator;
                let step = integrator.advance(&mut system, control, t, rest, moved, k1, memory)?;
                (step.h, step.end)
            }
        };
        if turns {
            std::mem::swap(x, &mut work.start);
            x.copy_from_slice(&work.inside);
            end_of_step(plan, pins, &work.start, x);
        }
        Ok(taken)
    }

    /// Advances blocks with their own stepping method by `length` (s) from the current instant.
    fn advance(&mut self, plan: &Plan, length: f64) -> Result<(), Failure<Stopped>> {
        if length <= 0.0 {
            return Ok(());
        }
        if plan.located || (self.observed.is_some() && observe::keeps_start(plan)) {
            self.keep(plan);
        }
        self.work.advanced = (self.state.since, length);
        let now = EvalTime {
            t: self.time(),
            dt: plan.step.seconds(),
            tick: self.state.tick,
            evaluation: Evaluation::Tick,
            span: plan.averages.then(|| [self.time(), self.time() + length]),
            number: self.work.number,
        };
        let State { x, d, sig, pins, .. } = &mut self.state;
        let (blocks, pins) = (&mut self.blocks, pins.as_deref());
        let averaged = match plan.averages {
            true => evaluate::run_all(blocks, plan, &plan.stage_ops, &now, (x, d, sig), pins),
            false => Ok(()),
        };
        averaged
            .and_then(|()| evaluate::advance(blocks, plan, &now, length, (x, sig), pins))
            .map_err(Failure::System)?;
        self.work.number += 1;
        Ok(())
    }

    /// Saves the state at the start of a step with blocks that have their own stepping method.
    fn keep(&mut self, plan: &Plan) {
        self.work.before.copy_from(&self.state);
        for (&k, slot) in plan.steps.iter().zip(&mut self.work.stores) {
            self.blocks[k as usize].copy_store(slot);
        }
    }

    /// Sets the state at θ of the last step and evaluates everything there. Parts with modes stay on their pieces, because only
    /// their guards, which have yet to fire, end a piece between rows.
    fn go_to_event(
        &mut self,
        plan: &Plan,
        h: f64,
        theta: f64,
        gap: f64,
    ) -> Result<(), Failure<Stopped>> {
        self.state_at(plan, h, theta, Purpose::Event)?;
        self.state.x.copy_from_slice(&self.work.inside);
        self.state.since = (self.state.since + theta * h).min(gap);
        self.state.micro = 0;
        let State { x, pins, .. } = &mut self.state;
        evaluate::project(&mut self.blocks, plan, pins.as_deref(), x).map_err(Failure::System)?;
        let now = self.next(Evaluation::Tick);
        let State { x, d, sig, pins, .. } = &mut self.state;
        let (ops, lanes) = (&plan.continuous_ops, (&x[..], &d[..], &mut sig[..]));
        evaluate::run_all(&mut self.blocks, plan, ops, &now, lanes, pins.as_deref())
            .and_then(|()| self.rearrange(plan, now))
            .and_then(|_| self.look(plan))
            .map_err(Failure::System)
    }

    /// Computes the state at θ of the last step into `work.inside`: by dense output during the search for an event, and by a step that ends there
    /// when the state is accepted. Blocks with their own stepping method are interpolated, and repeat their step when it is accepted.
    pub(super) fn state_at(
        &mut self,
        plan: &Plan,
        h: f64,
        theta: f64,
        purpose: Purpose,
    ) -> Result<(), Failure<Stopped>> {
        let (t, part) = (self.time(), if purpose == Purpose::Look { 1.0 } else { theta });
        let now = EvalTime {
            t,
            dt: plan.step.seconds(),
            tick: self.state.tick,
            evaluation: Evaluation::Stage,
            span: plan.averages.then_some([t, t + part * h]),
            number: self.work.number,
        };
        let Simulation { state, blocks, work, .. } = self;
        if plan.derivs.is_empty() {
            work.inside.copy_from_slice(&state.x);
        } else {
            let began = state.began();
            let State { d, sig, pins, .. } = state;
            let (number, pins) = (&mut work.number, pins.as_deref());
            let (linear, stage) =
                (None, (!turning::of(plan).is_empty()).then_some(&mut work.stage[..]));
            let mut system =
                Running { plan, blocks, d, sig, now, began, pins, number, linear, stage };
            // A step must have a length; at the start of the step, the dense output is the state.
            if purpose == Purpose::Look || theta == 0.0 {
                work.integrator.dense(&mut system)?.at(theta, &mut work.inside);
            } else if plan.averages {
                work.integrator.again_anew(&mut system, (now.t, theta * h), &mut work.inside)?;
            } else {
                work.integrator.again(&mut system, (now.t, theta * h), &mut work.inside)?;
            }
            end_of_step(plan, pins, &work.start, &mut work.inside);
        }
        if plan.steps.is_empty() {
            return Ok(());
        }
        let (from, length) = work.advanced;
        let so_far = state.since + theta * h - from;
        if purpose != Purpose::Event {
            let part = so_far / length;
            for lanes in plan.stepped.iter().flat_map(Clone::clone) {
                let (a, b) = (work.before.x[lanes], state.x[lanes]);
                work.inside[lanes] = a + part * (b - a);
            }
            return Ok(());
        }
        // Advance these parts again, from the start of the step to the event.
        for (&k, slot) in plan.steps.iter().zip(&work.stores) {
            if let Some(store) = slot {
                blocks[k as usize].take_store(&**store);
            }
        }
        work.number += 1;
        let span =
            plan.averages.then_some([t - state.since + from, t - state.since + from + so_far]);
        let now = EvalTime { evaluation: Evaluation::Tick, span, number: work.number, ..now };
        let State { x, d, sig, pins, .. } = &mut work.before;
        let pins = pins.as_deref();
        evaluate::run_all(blocks, plan, &plan.continuous_ops, &now, (x, d, sig), pins)
            .and_then(|()| evaluate::advance(blocks, plan, &now, so_far, (x, sig), pins))
            .map_err(Failure::System)?;
        work.number += 1;
        for lanes in &plan.stepped {
            work.inside[lanes.clone()].copy_from_slice(&x[lanes.clone()]);
        }
        // Copy the outputs that the parts write while they advance.
        for lanes in &plan.stepped_outputs {
            state.sig[lanes.clone()].copy_from_slice(&sig[lanes.clone()]);
        }
        Ok(())
    }

    /// Converts the error of a step, with names instead of lanes.
    #[cold]
    fn failed(&self, failure: Failure<Stopped>) -> RunError {
        let name = |lane: usize| {
            let at = |p: &Place| *p == Place::X(lane as u32);
            let found = self.plan.lanes.iter().find(|(_, v)| at(&v.place));
            found.map_or_else(|| format!("state {lane}"), |(path, _)| path.clone())
        };
        let error = |lane: usize, message: String, help: &str| RunError {
            time: self.time(),
            path: name(lane),
            message,
            help: Some(help.to_string()),
        };
        match failure {
            Failure::System(stopped) => self.stopped(stopped),
            Failure::Start { lane, .. } => error(
                lane,
                format!("`{}` or its rate became infinite or NaN", name(lane)),
                "check its inputs at this instant",
            ),
            Failure::NotFinite { lane, h, .. } => error(
                lane,
                format!("`{}` became infinite or NaN in a step of {h} s", name(lane)),
                "use a shorter step, or check its inputs",
            ),
            Failure::StepTooSmall { lane, h, error: e, .. } => error(
                lane,
                format!(
                    "the error of `{}` is {e:.3} times its tolerance in a step of {h:.3e} s, the smallest step",
                    name(lane)
                ),
                "loosen its tolerance, or use the stiff method `rodas4p`",
            ),
            Failure::Rejections { lane, rejections, .. } => error(
                lane,
                format!("{rejections} steps in a row were rejected, the last for `{}`", name(lane)),
                "loosen its tolerance; a typical cause is a model with a discontinuity but without a guard",
            ),
            Failure::NoStep => {
                error(0, "no step was taken".into(), "report this as a bug in Linkwork")
            }
        }
    }
}

/// Stores the final state of a step from `start` in the run: in body axes, with pinned values.
#[inline]
fn end_of_step(plan: &Plan, pins: Option<&Pins>, start: &[f64], x: &mut [f64]) {
    turning::end(turning::of(plan), start, x);
    if let Some(pins) = pins {
        pins.states(x);
    }
}
