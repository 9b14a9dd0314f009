//! A start at rest: a machine that was put down sinks into its ground until nothing moves any more.
//!
//! ```text
//! ẋ = f(x) at the first instant, sampled outputs held        v ← v/(1 + c h) after each step
//! at rest        max |v| below a limit; where it does not come to rest, again with all joints held but those given
//! held           other machines in any case: their lanes have no derivative and stay where they are written
//! kept           coordinates, and the states of parts that have come to rest too (bristles, soil, brakes);
//!                what still runs (charge, propellant) starts as it was
//! ```
//! The forces are the plan's own, so the balance is that of the run that follows.
use super::evaluate::{self, Running, Stopped};
use super::{State, Work, blocks_of, initial, show};
use crate::block::{Evaluation, Now};
use crate::plan::{Plan, SettledStart};
use linkwork_integrate::System;
use std::ops::Range;

/// A run of which some velocities stay zero.
struct Held<'a> {
    run: Running<'a>,
    /// Their lanes.
    held: &'a [usize],
}

impl System for Held<'_> {
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
/// Speed (m/s, rad/s) at which nothing moves any more, and at which it hardly moves at the end.
const REST: [f64; 2] = [1e-7, 1e-4];
/// Steps of the plan are divided by these until one is short enough.
const FINER: [f64; 3] = [1.0, 4.0, 16.0];
/// What moves as fast as this long ago goes on moving, s.
const SLOWS: f64 = 2.0;

/// The end of a settling.
enum End {
    /// The state, and its derivative.
    Rests(Vec<f64>, Vec<f64>),
    /// It goes on moving.
    Moves,
    /// The step is too long, or something fails.
    Fails,
}

/// Brings the start of a machine to rest: coordinates and velocities at `q` and `v`, of which `adapting` (lanes) move in any case,
/// the others of the machine (`own`) where they come to rest, and what is not of the machine never. Gives whether it
/// rests; when it does not, the start is as it was.
pub(crate) fn settle(
    plan: &mut Plan,
    (q, v): (Range<usize>, Range<usize>),
    own: &[usize],
    adapting: &[usize],
) -> bool {
    // What advances by impulses has no derivative to follow.
    if plan.derivs.is_empty() || !plan.steps.is_empty() {
        return false;
    }
    let but =
        |moves: &[usize]| -> Vec<usize> { v.clone().filter(|k| !moves.contains(k)).collect() };
    let found = [but(own), but(adapting)].into_iter().find_map(|held| {
        let ends = FINER.into_iter().map(|f| relax(plan, &v, &held, plan.step.seconds() / f));
        match ends.into_iter().find(|end| !matches!(end, End::Fails)) {
            Some(End::Rests(x, rates)) => Some((x, rates)),
            _ => None,
        }
    });
    let Some((x, rates)) = found else { return false };
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
    true
}

/// Follows a plan until it rests, with steps of h s.
fn relax(plan: &Plan, v: &Range<usize>, held: &[usize], h: f64) -> End {
    let (mut blocks, mut state, mut work) = (blocks_of(plan), initial(plan), Work::new(plan));
    plan.fields.iter().for_each(|field| show(&mut blocks, field));
    let now = Now {
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
        return End::Fails;
    }
    let Work { integrator, xdot, .. } = &mut work;
    let (blocks, number) = (&mut blocks[..], &mut 1);
    let (d, sig) = (&state.d, &mut state.sig);
    let (linear, stage) = (None, None);
    let (began, pins) = (0.0, None);
    let run = Running { plan, blocks, d, sig, now, began, pins, number, linear, stage };
    let mut system = Held { run, held };
    let x = &mut state.x;
    held.iter().for_each(|&k| x[k] = 0.0);
    let (mut fastest, mut before) = (f64::INFINITY, f64::INFINITY);
    let (steps, look) = ((LONGEST / h) as u64, (SLOWS / h) as u64);
    for k in 1..=steps {
        if integrator.step_fixed(&mut system, now.t, h, x, None).is_err() {
            return End::Fails;
        }
        x[v.clone()].iter_mut().for_each(|v| *v /= 1.0 + DAMPING * h);
        fastest = x[v.clone()].iter().fold(0.0_f64, |a, v| if v.abs() <= a { a } else { v.abs() });
        if fastest.is_nan() {
            return End::Fails;
        }
        if fastest < REST[0] {
            break;
        }
        if k.is_multiple_of(look.max(1)) {
            if fastest > REST[1].max(0.9 * before) {
                return End::Moves;
            }
            before = fastest;
        }
    }
    if fastest > REST[1] {
        return End::Moves;
    }
    x[v.clone()].fill(0.0);
    match system.derivatives(now.t, x, xdot) {
        Ok(()) => End::Rests(state.x, std::mem::take(xdot)),
        Err(_) => End::Fails,
    }
}
