//! Evaluations: operations in order, derivatives, and the interface to integrators.
use super::linear::Linear;
use super::operation::run;
use super::pinned::Pins;
use super::state::GuardState;
use super::stopped::{Stopped, of};
use super::turning;
use crate::author::block::{Block, EvalTime, Evaluation, Outcome};
use crate::plan::compiled::{Op, Plan};
use crate::plan::condition::Times;
use linkwork_integrate::{At, System};
use std::ops::Range;

/// Runs operations in order; after each one the pins on its outputs are applied.
#[inline]
pub(super) fn run_all(
    blocks: &mut [Box<dyn Block>],
    plan: &Plan,
    ops: &[u32],
    now: &EvalTime,
    (x, d, sig): (&[f64], &[f64], &mut [f64]),
    pins: Option<&Pins>,
) -> Result<(), Stopped> {
    let Some(pins) = pins else {
        for &k in ops {
            run(blocks, plan, plan.ops[k as usize], now, x, d, sig)?;
        }
        return Ok(());
    };
    for &k in ops {
        run(blocks, plan, plan.ops[k as usize], now, x, d, sig)?;
        pins.after(k, sig);
    }
    Ok(())
}

/// The state of every guard, and storage for their values; empty before their first evaluation.
pub(super) type Guards<'a> = (&'a [GuardState], &'a mut [f64]);

/// Runs operations at a row or an event; before the outputs of a part with modes, its piece is computed from the levels, unless an event determines
/// it.
#[inline]
pub(super) fn run_all_now(
    blocks: &mut [Box<dyn Block>],
    plan: &Plan,
    ops: &[u32],
    now: &EvalTime,
    (x, d, sig): (&[f64], &mut [f64], &mut [f64]),
    pins: Option<&Pins>,
    (guards, values): Guards<'_>,
) -> Result<(), Stopped> {
    if plan.moded.is_empty() {
        return run_all(blocks, plan, ops, now, (x, d, sig), pins);
    }
    for &k in ops {
        let op = plan.ops[k as usize];
        if let Op::Feedthrough(block) = op
            && plan.moded[block as usize]
            && !is_decided(blocks, plan, (block, now), (x, d, sig), (guards, &mut *values))?
        {
            blocks[block as usize].mode(now, x, d, sig).map_err(of(block))?;
            if let Some(pins) = pins {
                pins.discrete(d);
            }
        }
        run(blocks, plan, op, now, x, d, sig)?;
        if let Some(pins) = pins {
            pins.after(k, sig);
        }
    }
    Ok(())
}

/// Returns whether an event determines the present piece of a part: a guard of it is due, or has fired at this instant and is zero within round-off.
/// There the levels are not meaningful.
fn is_decided(
    blocks: &mut [Box<dyn Block>],
    plan: &Plan,
    (block, now): (u32, &EvalTime),
    (x, d, sig): (&[f64], &[f64], &[f64]),
    (guards, values): Guards<'_>,
) -> Result<bool, Stopped> {
    let Ok(k) = plan.guarded.binary_search_by_key(&block, |g| g.block) else { return Ok(false) };
    let (first, count) = (plan.guarded[k].first as usize, plan.guarded[k].count as usize);
    let own = first..first + count;
    let Some(states) = guards.get(own.clone()) else { return Ok(false) };
    let due = states.iter().any(GuardState::is_due);
    if due || states.iter().all(|g| g.side != 0) {
        return Ok(due);
    }
    let values = &mut values[own];
    blocks[block as usize].guards(now, x, d, sig, values).map_err(of(block))?;
    Ok(states.iter().zip(values).any(|(g, value)| g.side == 0 && value.abs() <= g.slack))
}

/// Computes derivatives; the signals must belong to this state. Derivatives of pinned states are zero.
#[inline]
pub(super) fn derivatives(
    blocks: &mut [Box<dyn Block>],
    plan: &Plan,
    now: &EvalTime,
    (x, d, sig): (&[f64], &[f64], &[f64]),
    pins: Option<&Pins>,
    xdot: &mut [f64],
) -> Result<(), Stopped> {
    for still in &plan.still {
        xdot[still.clone()].fill(0.0);
    }
    for &k in &plan.derivs {
        blocks[k as usize].derivatives(now, x, d, sig, xdot).map_err(of(k))?;
    }
    if let Some(pins) = pins {
        pins.still(xdot);
    }
    Ok(())
}

/// Computes the values of all guards; the signals must belong to this state. `began`: start time of the phase (s).
pub(super) fn guards(
    blocks: &mut [Box<dyn Block>],
    plan: &Plan,
    (now, began): (&EvalTime, f64),
    (x, d, sig): (&[f64], &[f64], &[f64]),
    values: &mut [f64],
) -> Result<(), Stopped> {
    let times = Times { time: now.t, phase: now.t - began };
    for g in &plan.guarded {
        let values = &mut values[g.first as usize..(g.first + g.count) as usize];
        blocks[g.block as usize].guards(now, x, d, sig, values).map_err(of(g.block))?;
    }
    for c in &plan.conditions {
        let value = c.condition.value(times, x, d, sig);
        // A condition on an absent or NaN variable is false.
        values[c.guard as usize] = if value.is_nan() { -1.0 } else { value };
    }
    Ok(())
}

/// Interface of a run for an integrator.
pub(super) struct Running<'a> {
    pub plan: &'a Plan,
    pub blocks: &'a mut [Box<dyn Block>],
    pub d: &'a [f64],
    pub sig: &'a mut [f64],
    pub now: EvalTime,
    /// Start time of the phase (s).
    pub began: f64,
    /// Pinned variables.
    pub pins: Option<&'a Pins>,
    /// Counter of evaluations.
    pub number: &'a mut u64,
    /// Storage for the Jacobian, if the method needs it.
    pub linear: Option<&'a mut Linear>,
    /// If its states are those [within a step](turning): storage for a state in body axes. Without this storage the states are in body axes.
    pub stage: Option<&'a mut [f64]>,
}

impl Running<'_> {
    /// Returns the time of another evaluation.
    #[inline(always)]
    pub(super) fn next(&mut self, t: f64) -> EvalTime {
        *self.number += 1;
        EvalTime { t, evaluation: Evaluation::Stage, number: *self.number, ..self.now }
    }

    /// Computes the values of the guards at a state within a step.
    pub fn guards_at(&mut self, t: f64, x: &[f64], values: &mut [f64]) -> Result<(), Stopped> {
        let now = self.next(t);
        let Running { plan, blocks, d, sig, pins, began, .. } = self;
        run_all(blocks, plan, &plan.guard_ops, &now, (x, d, sig), *pins)?;
        guards(blocks, plan, (&now, *began), (x, d, sig), values)
    }
}

impl System for Running<'_> {
    type Error = Stopped;

    #[inline]
    fn derivatives(&mut self, t: f64, x: &[f64], xdot: &mut [f64]) -> Result<(), Stopped> {
        let now = self.next(t);
        let Running { plan, blocks, d, sig, pins, stage, .. } = self;
        let Some(stage) = stage else {
            run_all(blocks, plan, &plan.stage_ops, &now, (x, d, sig), *pins)?;
            return derivatives(blocks, plan, &now, (x, d, sig), *pins, xdot);
        };
        stage.copy_from_slice(x);
        turning::leave(turning::of(plan), stage);
        if let Some(pins) = pins {
            pins.states(stage);
        }
        run_all(blocks, plan, &plan.stage_ops, &now, (stage, d, sig), *pins)?;
        derivatives(blocks, plan, &now, (stage, d, sig), *pins, xdot)?;
        turning::enter_rates(turning::of(plan), stage, xdot);
        Ok(())
    }

    fn jacobian(&mut self, t: f64, at: &At<'_>, out: &mut [f64]) -> Result<bool, Stopped> {
        // Use finite differences if variables are pinned, because analytic derivatives ignore pins.
        if self.pins.is_some() {
            return Ok(false);
        }
        let Some(linear) = self.linear.take() else { return Ok(false) };
        let done = self.linearise(linear, t, at, out);
        self.linear = Some(linear);
        done
    }

    #[inline]
    fn project(&mut self, _: f64, x: &mut [f64]) -> Result<(), Stopped> {
        let Some(own) = &mut self.stage else {
            return project(self.blocks, self.plan, self.pins, x);
        };
        own.copy_from_slice(x);
        turning::leave(turning::of(self.plan), own);
        project(self.blocks, self.plan, self.pins, own)?;
        turning::enter_projected(turning::of(self.plan), own, x);
        Ok(())
    }

    fn project_change(&mut self, _: f64, x: &[f64], change: &mut [f64]) -> Result<(), Stopped> {
        let Some(own) = &mut self.stage else {
            return project_change(self.blocks, self.plan, x, change);
        };
        let turning = turning::of(self.plan);
        own.copy_from_slice(x);
        turning::leave(turning, own);
        turning::leave_change(turning, own, change);
        project_change(self.blocks, self.plan, own, change)?;
        turning::enter_change(turning, own, change);
        Ok(())
    }

    fn projects(&self) -> bool {
        !self.plan.manifold.is_empty()
    }

    fn positions(&self) -> &[Range<usize>] {
        &self.plan.positions
    }

    fn retract(&mut self, x: &mut [f64], _: &[f64], h: f64) -> Result<(), Stopped> {
        for &k in &self.plan.positioned {
            self.blocks[k as usize].retract(x, h).map_err(of(k))?;
        }
        if let Some(pins) = self.pins {
            pins.states(x);
        }
        Ok(())
    }
}

/// Removes from a small change of the state the part that a projection would remove.
fn project_change(
    blocks: &mut [Box<dyn Block>],
    plan: &Plan,
    x: &[f64],
    change: &mut [f64],
) -> Result<(), Stopped> {
    for &k in &plan.manifold {
        blocks[k as usize].project_change(x, change).map_err(of(k))?;
    }
    Ok(())
}

/// Projects every state onto its manifold.
pub(super) fn project(
    blocks: &mut [Box<dyn Block>],
    plan: &Plan,
    pins: Option<&Pins>,
    x: &mut [f64],
) -> Result<(), Stopped> {
    for &k in &plan.manifold {
        blocks[k as usize].project(x).map_err(of(k))?;
    }
    if let Some(pins) = pins {
        pins.states(x);
    }
    Ok(())
}

/// Updates states that are constant within a step. Returns whether the operations have to be evaluated again.
pub(super) fn rearrange(
    blocks: &mut [Box<dyn Block>],
    plan: &Plan,
    now: &EvalTime,
    (x, d): (&mut [f64], &mut [f64]),
    pins: Option<&Pins>,
) -> Result<bool, Stopped> {
    let mut changed = false;
    for &k in &plan.rearranged {
        changed |= blocks[k as usize].rearrange(now, x, d).map_err(of(k))?;
    }
    if let Some(pins) = pins.filter(|_| !plan.rearranged.is_empty()) {
        pins.states(x);
        pins.discrete(d);
    }
    Ok(changed)
}

/// Advances blocks with their own stepping method by `h` (s).
pub(super) fn advance(
    blocks: &mut [Box<dyn Block>],
    plan: &Plan,
    now: &EvalTime,
    h: f64,
    (x, sig): (&mut [f64], &mut [f64]),
    pins: Option<&Pins>,
) -> Result<(), Stopped> {
    for &k in &plan.steps {
        let outcome: Outcome = blocks[k as usize].advance(now, h, x, sig);
        outcome.map_err(of(k))?;
    }
    if let Some(pins) = pins {
        pins.states(x);
        pins.signals(sig);
    }
    Ok(())
}
