//! Sampled controllers around a mechanism: whether their loops are stable, from the linearised system at the start of a run.
//!
//! ```text
//! plant       ẋ = A x + B s        x: states that the loop measures, and those of its actuators; s: outputs that are held
//!             Φ = e^(A T), Γ = ∫ e^(A t) dt B        T: the sample period
//! at a sample u = C x;  s = G_u u + G_d d,  d' = H_u u + H_d d           d: discrete states of the sampled parts with this period
//! return map  M(g) = [Φ + g Γ G_u C, g Γ G_d; H_u C, H_d]                 g = 1: as it is
//! unstable    ρ(M(1)) > 1.002 max(1, ρ(M(0)))      nearly: ρ(M(1.25))
//! ```
//! The plant is differentiated while driven hinges turn at [`TURNING`], so that dry friction and brakes do not hold them; at rest these would hide a
//! loop that oscillates as soon as it moves. Sampled parts are differentiated by secants over several amplitudes. The slope is the one on which
//! neighbouring amplitudes agree best, so that a quantised sensor has the mean gradient of its steps, and a controller the gradient inside of its
//! limits.
//!
//! Each controller is examined alone: the outputs of all others are held. Parts with another sample period are held, too, and so are stores. The
//! following are not examined: discrete states without a unit (counts, indices), simulations with contact by impulses, which have no ẋ, and plans
//! with more than [`STATES_MAX`] states.
#![allow(non_snake_case)]
use super::evaluate;
use super::simulation::Simulation;
use super::state::State;
use super::stiffness::{STATES_MAX, growth, round_down};
use super::stopped::Stopped;
use crate::author::block::{Block, EvalTime, Evaluation};
use crate::author::model::lanes;
use crate::author::ports::PortKind;
use crate::author::value::{Fault, Value};
use crate::plan::compiled::{Op, Plan};
use linkwork_integrate::System;
use linkwork_spatial::nalgebra::DMatrix;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Rates (rad/s or m/s) of driven hinges at which the plant is differentiated: at the higher rate a motor may be at its limits, at the lower rate dry
/// friction may hold.
const TURNING: [f64; 2] = [2.0, 0.3];
/// Smallest fraction of its gain at which an unstable loop is stable; below it, the gain is not the cause.
const SHARE_MIN: f64 = 0.01;
/// Growth per period, relative to that of the open loop, that still counts as round-off.
const SLACK: f64 = 1.002;
/// Gain at which a loop must still be stable.
const MARGIN: f64 = 1.25;
/// Number of rows that a run is advanced, so that sampled parts have had their first samples.
const ROWS_MAX: u64 = 300;
/// Maximum number of states of one loop that is examined, including discrete states.
const SIZE_MAX: usize = 150;
/// Amplitudes of secants.
const AMPLITUDES: [f64; 9] = [1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0, 1000.0];
/// Names of parameters that are gains of a controller.
const GAINS: [&str; 5] = ["gain", "kp", "stiffness", "frequency", "damping"];

/// A controller, and the lanes that it reads and writes.
struct Loop {
    /// Its block.
    controller: u32,
    /// Sample period, s.
    period: f64,
    /// Operations of a sample, in order.
    ops: Vec<u32>,
    /// Blocks that are updated at it.
    blocks: Vec<u32>,
    /// Signal lanes of outputs that continuous parts read.
    outputs: Vec<u32>,
    /// Signal lanes that it reads and that change at any time.
    inputs: Vec<u32>,
    /// Its discrete states that are numbers.
    discrete: Vec<usize>,
}

/// Response of the system to a lane.
struct Plant {
    /// Derivatives of measured lanes with respect to states: (state, slope) for each input lane of all loops.
    measures: BTreeMap<u32, Vec<(usize, f64)>>,
    /// ∂ẋ/∂s by output lane.
    drives: BTreeMap<u32, Vec<f64>>,
    /// ∂ẋ/∂x by state.
    states: BTreeMap<usize, Vec<f64>>,
}

/// An unstable, or nearly unstable, loop.
struct Finding {
    controller: u32,
    period: f64,
    radius: f64,
    unstable: bool,
    /// Fraction of the gain at which it is stable with a margin.
    share: f64,
}

impl Simulation {
    /// Warnings about sampled controllers whose loops are unstable, or nearly so, each with a sufficiently small gain. The run is advanced by some
    /// samples and must not be used afterwards.
    pub fn sampled_loops(&mut self) -> Vec<Fault> {
        let plan = self.plan.clone();
        if !plan.steps.is_empty() || plan.derivs.is_empty() || plan.sizes.x > STATES_MAX {
            return Vec::new();
        }
        let loops = loops(&plan);
        if loops.is_empty() {
            return Vec::new();
        }
        let longest = loops.iter().map(|l| l.period).fold(0.0, f64::max);
        let until = self.time() + 2.5 * longest;
        for _ in 0..ROWS_MAX {
            if self.time() >= until {
                break;
            }
            if self.step().is_err() || !Arc::ptr_eq(&plan, &self.plan) {
                return Vec::new();
            }
        }
        let mut found: Vec<Finding> = Vec::new();
        for rate in TURNING {
            let Some(plant) = self.plant(&plan, &loops, rate) else { return Vec::new() };
            for l in &loops {
                // Report a loop once, even if it was found at several rates.
                if found.iter().all(|f| f.controller != l.controller) {
                    found.extend(self.examine(&plan, l, &plant));
                }
            }
        }
        tell(&plan, &found)
    }

    /// Linearizes the plant around the present state, with driven hinges turning at a rate.
    fn plant(&mut self, plan: &Plan, loops: &[Loop], rate: f64) -> Option<Plant> {
        let n = plan.sizes.x;
        let mut x = self.state.x.clone();
        let inputs: BTreeSet<u32> = loops.iter().flat_map(|l| l.inputs.clone()).collect();
        let outputs: BTreeSet<u32> = loops.iter().flat_map(|l| l.outputs.clone()).collect();
        let measure = plan.flow.upstream(inputs.iter().copied());
        let mut measures: BTreeMap<u32, Vec<(usize, f64)>> = BTreeMap::new();
        let mut drives = BTreeMap::new();
        let mut states = BTreeMap::new();
        let turned = plan.parts.iter().flat_map(|p| p.prototype.driven_rates());
        let turned: Vec<usize> = turned.filter(|k| *k < n).collect();
        let done = self.beside(|system, t| {
            let read = |system: &mut evaluate::Running<'_>, x: &[f64]| {
                let now = system.next(t);
                let lanes = (x, system.d, &mut *system.sig);
                evaluate::run_all(system.blocks, plan, &measure, &now, lanes, None)?;
                Ok::<Vec<f64>, Stopped>(inputs.iter().map(|u| system.sig[*u as usize]).collect())
            };
            let base = read(system, &x)?;
            for k in 0..n {
                let (old, step) = (x[k], 1e-6 * (1.0 + x[k].abs()));
                x[k] = old + step;
                let moved = read(system, &x)?;
                x[k] = old;
                for ((u, a), b) in inputs.iter().zip(&base).zip(&moved) {
                    if a != b {
                        measures.entry(*u).or_default().push((k, (b - a) / step));
                    }
                }
            }
            for k in turned {
                x[k] = rate;
            }
            let [mut f0, mut f1, mut f2] = [(); 3].map(|()| vec![0.0; n]);
            system.derivatives(t, &x, &mut f0)?;
            for s in outputs {
                let (lane, old) = (s as usize, system.sig[s as usize]);
                let step = 1e-3 * (1.0 + old.abs());
                system.sig[lane] = old + step;
                system.derivatives(t, &x, &mut f1)?;
                system.sig[lane] = old - step;
                system.derivatives(t, &x, &mut f2)?;
                system.sig[lane] = old;
                // If an actuator is at its limit, a change in one direction has no effect.
                let side = |k: usize| [(f1[k] - f0[k]) / step, (f0[k] - f2[k]) / step];
                let greater = |[a, b]: [f64; 2]| if a.abs() >= b.abs() { a } else { b };
                drives.insert(s, (0..n).map(|k| greater(side(k))).collect());
            }
            let measured = measures.values().flatten().map(|(k, _)| *k);
            let measured: BTreeSet<usize> = measured.collect();
            let driven = |k: &usize| drives.values().any(|b: &Vec<f64>| b[*k] != 0.0);
            let others = plan.parts.iter().flat_map(|p| {
                let own = p.wiring.x..p.wiring.x + p.lanes().x;
                if p.prototype.driven_rates().is_empty() { own } else { 0..0 }
            });
            let actuators: Vec<usize> = others.filter(driven).collect();
            for k in measured.into_iter().chain(actuators) {
                let (old, step) = (x[k], 1e-6 * (1.0 + x[k].abs()));
                x[k] = old + step;
                system.derivatives(t, &x, &mut f1)?;
                x[k] = old - step;
                system.derivatives(t, &x, &mut f2)?;
                x[k] = old;
                states.insert(k, (0..n).map(|i| (f1[i] - f2[i]) / (2.0 * step)).collect());
            }
            Ok(())
        });
        done.ok()?;
        Some(Plant { measures, drives, states })
    }

    /// Computes the return map of one loop.
    fn examine(&mut self, plan: &Plan, l: &Loop, plant: &Plant) -> Option<Finding> {
        let measured = l.inputs.iter().filter_map(|u| plant.measures.get(u)).flatten();
        let mut lanes: BTreeSet<usize> = measured.map(|(k, _)| *k).collect();
        let drives: Vec<&Vec<f64>> = l.outputs.iter().filter_map(|s| plant.drives.get(s)).collect();
        let acts = |k: &usize| drives.iter().any(|b| b[*k] != 0.0);
        // States of actuators: the outputs drive them, and they drive the measured states.
        let actuators: Vec<usize> = (plant.states.iter())
            .filter(|(k, column)| {
                !lanes.contains(k) && acts(k) && lanes.iter().any(|row| column[*row] != 0.0)
            })
            .map(|(k, _)| *k)
            .collect();
        lanes.extend(actuators);
        let lanes: Vec<usize> = lanes.into_iter().collect();
        if !lanes.iter().any(acts) {
            return None;
        }
        let (n, m, k) = (lanes.len(), l.outputs.len(), l.discrete.len());
        if n + m + k > SIZE_MAX || drives.len() != m {
            return None;
        }
        let column = |lane: &usize| plant.states.get(lane);
        let A = DMatrix::from_fn(n, n, |i, j| column(&lanes[j]).map_or(0.0, |c| c[lanes[i]]));
        let B = DMatrix::from_fn(n, m, |i, j| drives[j][lanes[i]]);
        let (flow, input) = discrete(&A, &B, l.period)?;
        let C = DMatrix::from_fn(l.inputs.len(), n, |i, j| {
            let measures = plant.measures.get(&l.inputs[i]);
            let own = measures.and_then(|all| all.iter().find(|(k, _)| *k == lanes[j]));
            own.map_or(0.0, |(_, slope)| *slope)
        });
        let (G, H) = self.sample(plan, l)?;
        let u = l.inputs.len();
        let (Gu, Gd) = (G.columns(0, u) * &C, G.columns(u, k).into_owned());
        let (Hu, Hd) = (H.columns(0, u) * &C, H.columns(u, k).into_owned());
        let radius = |gain: f64| {
            let mut M = DMatrix::zeros(n + k, n + k);
            M.view_mut((0, 0), (n, n)).copy_from(&(&flow + &input * &Gu * gain));
            M.view_mut((0, n), (n, k)).copy_from(&(&input * &Gd * gain));
            M.view_mut((n, 0), (k, n)).copy_from(&Hu);
            M.view_mut((n, n), (k, k)).copy_from(&Hd);
            growth(M).map_or(0.0, |(radius, _)| radius)
        };
        let limit = SLACK * radius(0.0).max(1.0);
        let (one, more) = (radius(1.0), radius(MARGIN));
        if one <= limit && more <= limit {
            return None;
        }
        let (mut low, mut high) = (0.0, MARGIN);
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if radius(middle) > limit { high = middle } else { low = middle }
        }
        if low < SHARE_MIN {
            return None;
        }
        let (controller, period, unstable) = (l.controller, l.period, one > limit);
        let radius = if unstable { one } else { more };
        Some(Finding { controller, period, radius, unstable, share: 0.5 * low })
    }

    /// Returns the derivatives of outputs and next discrete states of the sampled parts of a loop with respect to its inputs and discrete states;
    /// columns are inputs, then discrete states. Operations are differentiated one by one and joined by the chain rule, so that an encoder is
    /// examined over many of its ticks and a controller inside of its limits.
    fn sample(&mut self, plan: &Plan, l: &Loop) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let width = l.inputs.len() + l.discrete.len();
        let now = self.next(Evaluation::Tick);
        let State { x, d, sig, .. } = &self.state;
        let mut at = Scratch { blocks: &mut self.blocks, now, x, d: d.clone(), sig: sig.clone() };
        let unit = |column: usize| {
            let mut row = vec![0.0; width];
            row[column] = 1.0;
            row
        };
        let mut signals: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        let mut states: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for (column, lane) in l.inputs.iter().enumerate() {
            signals.insert(*lane as usize, unit(column));
        }
        for (k, state) in l.discrete.iter().enumerate() {
            states.insert(*state, unit(l.inputs.len() + k));
        }
        for op in &l.ops {
            let op = plan.ops[*op as usize];
            let (block, role) = match op {
                Op::Outputs(k) => (k, Role::Outputs),
                Op::Feedthrough(k) => (k, Role::Feedthrough),
                Op::Sum(j) => {
                    let sum = &plan.sums[j as usize];
                    let n = sum.lanes as usize;
                    for k in 0..n {
                        let own = sum.sources[k..].iter().step_by(n);
                        let rows = own.filter_map(|s| signals.get(&(*s as usize)));
                        let total = rows.fold(vec![0.0; width], |sum, row| added(sum, 1.0, row));
                        signals.insert(sum.dst as usize + k, total);
                    }
                    continue;
                }
                Op::Loop(_) => continue,
            };
            let rows = at.chain(plan, block, role, (&signals, &states), width)?;
            signals.extend(rows);
        }
        let mut next: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for &block in &l.blocks {
            next.extend(at.chain(plan, block, Role::Update, (&signals, &states), width)?);
        }
        let matrix = |rows: Vec<Option<&Vec<f64>>>| {
            DMatrix::from_fn(rows.len(), width, |i, j| rows[i].map_or(0.0, |row| row[j]))
        };
        let outputs = l.outputs.iter().map(|s| signals.get(&(*s as usize))).collect();
        let (G, H) = (matrix(outputs), matrix(l.discrete.iter().map(|k| next.get(k)).collect()));
        (G.iter().chain(H.iter()).all(|v| v.is_finite())).then_some((G, H))
    }
}

/// A function of a block.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    Outputs,
    Feedthrough,
    Update,
}

/// Returns the state around which sampled parts are differentiated.
struct Scratch<'a> {
    blocks: &'a mut [Box<dyn Block>],
    now: EvalTime,
    x: &'a [f64],
    d: Vec<f64>,
    sig: Vec<f64>,
}

/// `sum` + `by` · `row`.
fn added(mut sum: Vec<f64>, by: f64, row: &[f64]) -> Vec<f64> {
    sum.iter_mut().zip(row).for_each(|(sum, y)| *sum += by * y);
    sum
}

impl Scratch<'_> {
    /// Returns the values that a function of a block writes, in the order of their lanes.
    fn values(&mut self, plan: &Plan, block: u32, role: Role) -> Option<Vec<f64>> {
        let part = &plan.parts[block as usize];
        let (w, d) = (&part.wiring, part.prototype.description());
        let own = &mut self.blocks[block as usize];
        let (mut sig, mut next) = (self.sig.clone(), self.d.clone());
        Some(match role {
            Role::Outputs => {
                own.outputs(&self.now, self.x, &self.d, &mut sig).ok()?;
                sig[w.ym..w.ym + lanes(&d.outputs)].to_vec()
            }
            Role::Feedthrough => {
                own.feedthrough(&self.now, self.x, &self.d, &mut sig).ok()?;
                sig[w.yd..w.yd + lanes(&d.feedthrough_outputs)].to_vec()
            }
            Role::Update => {
                own.update(&self.now, self.x, &mut next, &self.sig).ok()?;
                next[w.d..w.d + lanes(&d.discrete)].to_vec()
            }
        })
    }

    /// Computes the Jacobian of the lanes that a function of a block writes with respect to inputs and discrete states of the loop.
    fn chain(
        &mut self,
        plan: &Plan,
        block: u32,
        role: Role,
        (signals, states): (&BTreeMap<usize, Vec<f64>>, &BTreeMap<usize, Vec<f64>>),
        width: usize,
    ) -> Option<BTreeMap<usize, Vec<f64>>> {
        let w = &plan.parts[block as usize].wiring;
        let first = match role {
            Role::Outputs => w.ym,
            Role::Feedthrough => w.yd,
            Role::Update => w.d,
        };
        let read: BTreeSet<usize> = match role {
            Role::Outputs => BTreeSet::new(),
            Role::Feedthrough => w.ud.iter().map(|l| *l as usize).collect(),
            Role::Update => w.u.iter().chain(&w.ud).map(|l| *l as usize).collect(),
        };
        let n = self.values(plan, block, role)?.len();
        let mut rows = vec![vec![0.0; width]; n];
        let own: Vec<usize> = numbers(plan, block);
        let moving = read.iter().filter_map(|l| Some((false, *l, signals.get(l)?)));
        let moving = moving.chain(own.iter().filter_map(|k| Some((true, *k, states.get(k)?))));
        for (is_state, lane, row) in moving {
            let mut secants = vec![[0.0; AMPLITUDES.len()]; n];
            for (j, by) in AMPLITUDES.into_iter().enumerate() {
                let mut at = |by: f64| {
                    let old = if is_state { self.d[lane] } else { self.sig[lane] };
                    let put = |own: &mut Self, value: f64| match is_state {
                        true => own.d[lane] = value,
                        false => own.sig[lane] = value,
                    };
                    put(&mut *self, old + by);
                    let values = self.values(plan, block, role);
                    put(&mut *self, old);
                    values
                };
                let (plus, minus) = (at(by)?, at(-by)?);
                for (k, secants) in secants.iter_mut().enumerate() {
                    secants[j] = (plus[k] - minus[k]) / (2.0 * by);
                }
            }
            for (k, secants) in secants.iter().enumerate() {
                let slope = plateau(secants);
                if slope != 0.0 {
                    rows[k] = added(std::mem::take(&mut rows[k]), slope, row);
                }
            }
        }
        Some(rows.into_iter().enumerate().map(|(k, row)| (first + k, row)).collect())
    }
}

/// Returns the secant on which three neighbouring amplitudes agree best to 5 %, or else two; the middle secant if none agree. Three are required,
/// because two amplitudes of a few steps of a quantised sensor may agree by chance.
fn plateau(secants: &[f64; AMPLITUDES.len()]) -> f64 {
    let agreed = |count: usize| {
        let spread = |all: &[f64]| {
            let (low, high) = all
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), s| (l.min(*s), h.max(*s)));
            (high - low) / low.abs().max(high.abs())
        };
        let near = secants.windows(count).filter(|w| w.iter().any(|s| *s != 0.0));
        let near = near.map(|w| (spread(w), w[count - 1])).filter(|(error, _)| *error <= 0.05);
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, slope)| slope)
    };
    if let Some(slope) = agreed(3).or_else(|| agreed(2)) {
        return slope;
    }
    let flat = secants.windows(2).any(|w| w == [0.0, 0.0]);
    if flat { 0.0 } else { secants[AMPLITUDES.len() / 2] }
}

/// e^(A T) and ∫ e^(A t) dt B over a period T.
fn discrete(
    A: &DMatrix<f64>,
    B: &DMatrix<f64>,
    period: f64,
) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let (n, m) = (A.nrows(), B.ncols());
    let mut both = DMatrix::zeros(n + m, n + m);
    both.view_mut((0, 0), (n, n)).copy_from(&(A * period));
    both.view_mut((0, n), (n, m)).copy_from(&(B * period));
    // The exponential is computed by scaling and squaring with a Taylor series.
    let norm = both.norm();
    if !norm.is_finite() {
        return None;
    }
    let halvings = (norm.max(1e-300).log2().ceil() + 3.0).clamp(0.0, 60.0);
    both /= halvings.exp2();
    let one = DMatrix::identity(n + m, n + m);
    let (mut term, mut sum) = (one.clone(), one);
    for k in 1..=12 {
        term = &term * &both / f64::from(k);
        sum += &term;
    }
    for _ in 0..halvings as u32 {
        sum = &sum * &sum;
    }
    sum.iter()
        .all(|v| v.is_finite())
        .then(|| (sum.view((0, 0), (n, n)).into_owned(), sum.view((0, n), (n, m)).into_owned()))
}

/// Returns the block of an operation.
fn block_of(op: Op) -> Option<u32> {
    match op {
        Op::Outputs(k) | Op::Feedthrough(k) => Some(k),
        Op::Sum(_) | Op::Loop(_) => None,
    }
}

/// Returns the controllers of a plan: sampled parts whose outputs reach continuous parts.
fn loops(plan: &Plan) -> Vec<Loop> {
    let flow = &plan.flow;
    let held = |lane: u32| {
        let op = flow.producer.get(lane as usize).copied()?;
        let continuous = flow.continuous.get(op as usize).copied()?;
        (!continuous).then_some(op)
    };
    let reads = |k: u32| {
        let wiring = &plan.parts[k as usize].wiring;
        wiring.u.iter().chain(&wiring.ud).copied()
    };
    let mut acting: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    let moving = (0..plan.ops.len()).filter(|op| flow.continuous[*op]);
    let moving = moving.filter_map(|op| block_of(plan.ops[op])).chain(plan.derivs.iter().copied());
    for k in moving.collect::<BTreeSet<u32>>() {
        for lane in reads(k) {
            if let Some(op) = held(lane) {
                acting.entry(op).or_default().insert(lane);
            }
        }
    }
    // Returns the operations that change only at samples and on which `op` depends directly or
    // through others of this kind, including `op`.
    let upstream = |op: u32| {
        let (mut seen, mut stack) = (BTreeSet::new(), vec![op]);
        while let Some(op) = stack.pop() {
            if !flow.continuous[op as usize] && seen.insert(op) {
                stack.extend(&flow.depends[op as usize]);
                // A discrete state depends on the signals that its update reads.
                if let Some(k) = block_of(plan.ops[op as usize]) {
                    stack.extend(reads(k).filter_map(held));
                }
            }
        }
        seen
    };
    let period = |k: u32| plan.parts[k as usize].rate.map_or(0.0, |r| r.seconds());
    let mut all: BTreeMap<u32, Loop> = BTreeMap::new();
    for (op, lanes) in acting {
        let ops = upstream(op);
        let sampled = |op: &u32| block_of(plan.ops[*op as usize]).filter(|k| period(*k) > 0.0);
        // The controller is the sampled part that computes the output; parts without a rate may
        // follow it.
        let own = sampled(&op).or_else(|| ops.iter().rev().find_map(sampled));
        let Some(controller) = own else { continue };
        let own = all.entry(controller).or_insert_with(|| Loop {
            controller,
            period: period(controller),
            ops: Vec::new(),
            blocks: Vec::new(),
            outputs: Vec::new(),
            inputs: Vec::new(),
            discrete: Vec::new(),
        });
        own.outputs.extend(lanes);
        own.ops.extend(ops);
    }
    for own in all.values_mut() {
        // Outputs of parts with another period are treated as constant.
        let sample = own.period;
        let same = |op: &u32| {
            block_of(plan.ops[*op as usize]).is_none_or(|k| [0.0, sample].contains(&period(k)))
        };
        let ops: BTreeSet<u32> = own.ops.iter().copied().filter(same).collect();
        let blocks: BTreeSet<u32> =
            ops.iter().filter_map(|op| block_of(plan.ops[*op as usize])).collect();
        let inputs = blocks.iter().flat_map(|k| reads(*k));
        let inputs: BTreeSet<u32> = inputs.filter(|lane| flow.is_continuous(*lane)).collect();
        let sums = ops.iter().filter_map(|op| match plan.ops[*op as usize] {
            Op::Sum(j) => Some(&plan.sums[j as usize].sources),
            _ => None,
        });
        let inputs =
            inputs.into_iter().chain(sums.flatten().copied().filter(|l| flow.is_continuous(*l)));
        own.inputs = inputs.collect::<BTreeSet<u32>>().into_iter().collect();
        let updated = |k: &u32| {
            let part = &plan.parts[*k as usize];
            part.prototype.description().functions.update && !part.prototype.stored()
        };
        own.blocks = blocks.iter().copied().filter(updated).collect();
        own.discrete = own.blocks.iter().flat_map(|k| numbers(plan, *k)).collect();
        own.ops = ops.into_iter().collect();
    }
    all.into_values().filter(|l| !l.inputs.is_empty()).collect()
}

/// Returns the discrete states of a block that are quantities. Numbers without a unit are counts, indices and flags, whose other values may have no
/// meaning.
fn numbers(plan: &Plan, block: u32) -> Vec<usize> {
    let part = &plan.parts[block as usize];
    let (mut all, mut at) = (Vec::new(), part.wiring.d);
    for port in &part.prototype.description().discrete {
        if port.kind != PortKind::Bool && port.unit != "1" {
            all.extend(at..at + port.lanes);
        }
        at += port.lanes;
    }
    all
}

/// Two digits, rounded down.
fn digits(x: f64) -> String {
    let decimals = (1.0 - x.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{:.decimals$}", round_down(x))
}

/// Merges the warnings of all controllers with the same model and parameters into one.
fn tell(plan: &Plan, found: &[Finding]) -> Vec<Fault> {
    let mut groups: BTreeMap<String, Vec<&Finding>> = BTreeMap::new();
    for finding in found {
        let part = &plan.parts[finding.controller as usize];
        let key = format!("{} {:?} {}", part.model, part.prototype.params(), finding.unstable);
        groups.entry(key).or_default().push(finding);
    }
    let mut faults: Vec<(u32, Fault)> = Vec::new();
    for group in groups.into_values() {
        let Some(worst) = group.iter().min_by(|a, b| a.share.total_cmp(&b.share)) else { continue };
        let part = &plan.parts[worst.controller as usize];
        let others = match group.len() {
            1 => String::new(),
            n => format!(" and {} like it", n - 1),
        };
        let state = match worst.unstable {
            true => format!(
                "unstable: a deviation grows by a factor of {:.3} in each sample",
                worst.radius
            ),
            false => format!(
                "nearly unstable: with {MARGIN} times its gain, a deviation grows by a factor of {:.3} in each sample",
                worst.radius
            ),
        };
        let fact = format!(
            "the sampled loop of `{}`{others} (a sample every {} s) is {state}",
            part.path, worst.period
        );
        let gain = GAINS.iter().find_map(|name| {
            let Value::Map(entries) = part.prototype.params() else { return None };
            let (_, value) = entries.iter().find(|(key, _)| key.as_str() == *name)?;
            let Value::Number(gain) = &value.value else { return None };
            (*gain > 0.0).then(|| format!("write `{name}: {}`", digits(gain * worst.share)))
        });
        let by = digits(worst.share);
        let help = match gain {
            Some(gain) => format!("{gain} or less ({by} of its value), or sample more often"),
            None => format!("multiply its gains by {by} or less, or sample more often"),
        };
        faults.push((worst.controller, Fault::new(part.origin, fact).help(help)));
    }
    faults.sort_by_key(|(k, _)| *k);
    faults.into_iter().map(|(_, fault)| fault).collect()
}
