//! Start at rest: groups of coordinates move under the forces of the plan until all their velocities vanish.
//!
//! ```text
//! ẋ = f(x) at the first instant, sampled outputs held        v ← v/(1 + c h) after each step
//! at rest        max |v| of a group below a limit; it is held from there on, until all groups rest
//! again          where one does not come to rest, from the beginning with all its joints held but those given, then with all
//! held           lanes without a derivative: they stay where they are written
//! kept           coordinates, and the states of parts that have come to rest too (bristles, soil, brakes);
//!                what still runs (charge, propellant) starts as it was
//! ```
//! The forces are the plan's own, so the equilibrium is also an equilibrium of the run that follows.
use super::evaluate::{self, Running};
use super::simulation::{Work, initial, show};
use super::state::State;
use super::stopped::Stopped;
use crate::author::block::{Block, EvalTime, Evaluation};
use crate::plan::compiled::blocks_of;
use crate::plan::compiled::{Plan, SettledStart};
use linkwork_integrate::System;
use std::collections::BTreeSet;
use std::ops::Range;

/// A run in which some velocities remain zero.
struct HeldRun<'a> {
    run: Running<'a>,
    /// Their lanes.
    held: &'a [usize],
}

fn held_run<'a>(
    plan: &'a Plan,
    blocks: &'a mut [Box<dyn Block>],
    (d, sig): (&'a [f64], &'a mut [f64]),
    now: EvalTime,
    (number, held): (&'a mut u64, &'a [usize]),
) -> HeldRun<'a> {
    let (linear, stage) = (None, None);
    let (began, pins) = (0.0, None);
    let run = Running { plan, blocks, d, sig, now, began, pins, number, linear, stage };
    HeldRun { run, held }
}

impl System for HeldRun<'_> {
    type Error = Stopped;
    fn derivatives(&mut self, t: f64, x: &[f64], xdot: &mut [f64]) -> Result<(), Stopped> {
        self.run.derivatives(t, x, xdot)?;
        self.held.iter().for_each(|&k| xdot[k] = 0.0);
        Ok(())
    }
    fn project(&mut self, t: f64, x: &mut [f64]) -> Result<(), Stopped> {
        self.run.project(t, x)
    }
    fn project_change(&mut self, t: f64, x: &[f64], change: &mut [f64]) -> Result<(), Stopped> {
        self.run.project_change(t, x, change)
    }
    fn projects(&self) -> bool {
        self.run.projects()
    }
    fn positions(&self) -> &[Range<usize>] {
        self.run.positions()
    }
    fn retract(&mut self, x: &mut [f64], xdot: &[f64], h: f64) -> Result<(), Stopped> {
        self.run.retract(x, xdot, h)
    }
}

/// Damping c, 1/s.
const DAMPING: f64 = 30.0;
/// Longest settling, s.
const LONGEST: f64 = 20.0;
/// Speed (m/s, rad/s) that counts as rest, and the larger speed that is accepted at the end.
const REST: [f64; 2] = [1e-7, 1e-4];
/// Divisors of the step of the plan; they are tried until the step is short enough.
const FINER: [f64; 3] = [1.0, 4.0, 16.0];
/// A group whose speed has not decreased within this time does not come to rest, s.
const SLOWS: f64 = 2.0;

/// Velocities that come to rest together, such as all velocities of one machine. The lists contain slots in the continuous state.
pub struct SettleGroup {
    /// All velocities of the group.
    pub own: Vec<usize>,
    /// Velocities that remain free in a second attempt, in which the others are zero: of the root, and of joints that adapt to the ground.
    pub adapting: Vec<usize>,
}

/// Free velocities of a group while it settles.
#[derive(Clone, Copy, PartialEq)]
enum Free {
    Own,
    Adapting,
    None,
}

impl SettleGroup {
    fn free(&self, free: Free) -> &[usize] {
        match free {
            Free::Own => &self.own,
            Free::Adapting => &self.adapting,
            Free::None => &[],
        }
    }
}

/// Result of a settling without errors.
struct End {
    /// State and derivative; `None` if a group still moves.
    rest: Option<(Vec<f64>, Vec<f64>)>,
    /// The groups that still move.
    moves: Vec<bool>,
}

/// Brings groups of coordinates to rest, all in one run, and writes the result to [`Plan::rest`]. `q` and `v` are the slots of all coordinates
/// and velocities of their part. Returns for each group whether it rests; the others start as they were written.
pub fn settle(
    plan: &mut Plan,
    (q, v): (Range<usize>, Range<usize>),
    groups: &[SettleGroup],
) -> Vec<bool> {
    let mut free = vec![Free::Own; groups.len()];
    // A mechanism that advances by impulses has no derivatives to integrate.
    if plan.derivs.is_empty() || !plan.steps.is_empty() {
        return vec![false; groups.len()];
    }
    let (x, rates) = loop {
        if free.iter().all(|f| *f == Free::None) {
            return vec![false; groups.len()];
        }
        let parts: Vec<&[usize]> = groups.iter().zip(&free).map(|(m, f)| m.free(*f)).collect();
        let end = FINER.into_iter().find_map(|f| relax(plan, &v, &parts, plan.step.seconds() / f));
        let moves = match end {
            Some(End { rest: Some(rest), .. }) => break rest,
            Some(End { rest: None, moves }) => moves,
            None => vec![true; groups.len()],
        };
        for (free, _) in free.iter_mut().zip(moves).filter(|(_, moves)| *moves) {
            *free = if *free == Free::Own { Free::Adapting } else { Free::None };
        }
    };
    let mut start = initial(plan).x;
    let mut parts = plan.rest.take().map_or_else(Vec::new, |before| before.parts);
    for (number, part) in (0..).zip(&plan.parts) {
        let own = part.wiring.x..part.wiring.x + part.lanes().x;
        let rests =
            own.clone().all(|k| 10.0 * rates[k].abs() <= 0.2 * (x[k] - start[k]).abs() + 1e-9);
        let moved = x[own.clone()] != start[own.clone()];
        if rests && moved && own.start != q.start {
            start[own.clone()].copy_from_slice(&x[own]);
            parts.push(number);
        }
    }
    parts.sort_unstable();
    parts.dedup();
    start[q.clone()].copy_from_slice(&x[q]);
    plan.rest = Some(SettledStart { x: start, parts });
    free.iter().map(|f| *f != Free::None).collect()
}

/// Returns the greatest magnitude of some lanes; NaN if one of them is NaN.
fn greatest(x: &[f64], lanes: &[usize]) -> f64 {
    lanes.iter().map(|k| x[*k]).fold(0.0_f64, |a, v| if v.abs() <= a { a } else { v.abs() })
}

/// Advances a plan with steps of h s until all groups rest; `free` are the lanes of each group that may move. Returns `None` if the step is too long
/// or an evaluation fails.
fn relax(plan: &Plan, v: &Range<usize>, free: &[&[usize]], h: f64) -> Option<End> {
    let (mut blocks, mut state, mut work) = (blocks_of(plan), initial(plan), Work::new(plan));
    plan.fields.iter().for_each(|field| show(&mut blocks, field));
    let now = EvalTime {
        t: plan.base.times(state.tick),
        dt: plan.step.seconds(),
        tick: state.tick,
        evaluation: Evaluation::Tick,
        span: None,
        number: 1,
    };
    let all: Vec<u32> = (0..plan.ops.len() as u32).collect();
    let State { x, d, sig, .. } = &mut state;
    let unseen = (&[][..], &mut [][..]);
    if evaluate::run_all_now(&mut blocks, plan, &all, &now, (x, d, sig), None, unseen).is_err() {
        return None;
    }
    let Work { integrator, xdot, .. } = &mut work;
    let mut number = 1;
    let moving: BTreeSet<usize> = free.iter().flat_map(|f| f.iter().copied()).collect();
    let first: Vec<usize> = v.clone().filter(|k| !moving.contains(k)).collect();
    let mut held = first.clone();
    let State { x, d, sig, .. } = &mut state;
    held.iter().for_each(|&k| x[k] = 0.0);
    let mut speed = vec![f64::INFINITY; free.len()];
    let mut before = speed.clone();
    let mut moves = vec![false; free.len()];
    // Groups that have neither come to rest nor been found to keep moving.
    let mut left: Vec<usize> = (0..free.len()).filter(|m| !free[*m].is_empty()).collect();
    let (steps, look) = ((LONGEST / h) as u64, (SLOWS / h) as u64);
    for k in 1..=steps {
        let number = &mut number;
        let mut system = held_run(plan, &mut blocks, (d, sig), now, (number, &held));
        integrator.step_fixed(&mut system, now.t, h, x, None).ok()?;
        x[v.clone()].iter_mut().for_each(|v| *v /= 1.0 + DAMPING * h);
        let looks = k.is_multiple_of(look.max(1));
        for &m in &left {
            speed[m] = greatest(x, free[m]);
            if speed[m].is_nan() {
                return None;
            }
            if looks {
                moves[m] = speed[m] > REST[1].max(0.9 * before[m]);
                before[m] = speed[m];
            }
            if moves[m] || speed[m] < REST[0] {
                held.extend(free[m]);
                free[m].iter().for_each(|&k| x[k] = 0.0);
            }
        }
        *number += 1;
        let at_end = EvalTime { number: *number, ..now };
        evaluate::rearrange(&mut blocks, plan, &at_end, (x, d), None).ok()?;
        left.retain(|&m| !moves[m] && speed[m] >= REST[0]);
        if left.is_empty() {
            break;
        }
    }
    left.iter().for_each(|&m| moves[m] = speed[m] > REST[1]);
    if moves.contains(&true) {
        return Some(End { rest: None, moves });
    }
    x[v.clone()].fill(0.0);
    let mut system = held_run(plan, &mut blocks, (d, sig), now, (&mut number, &first));
    system.derivatives(now.t, x, xdot).ok()?;
    Some(End { rest: Some((state.x, std::mem::take(xdot))), moves })
}
