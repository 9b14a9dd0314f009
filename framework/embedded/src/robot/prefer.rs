//! Inverse kinematics with a secondary cost: the best of the configurations that meet a goal.
//!
//! ```text
//! c = a ½ Σ ((q − middle)/(upper − lower))² + n ½ Σ ((q − q₀)/(upper − lower))² − b ln w(q)
//! ```
//! a: `centred`; n: `near`, with q₀ the configuration that the search is given; b: `manipulable`. Each start that leads to the goal is improved along
//! the null space to a local minimum of c; the smallest one is the result. Coordinates without limits do not contribute to `centred`; for `near`
//! their range is taken as 2π rad or 2π m.

use super::inverse_kinematics::{Effort, Frame, Outcome};
use super::{ChainMemory, Robot};
use crate::error::RobotError;
use crate::manipulability::{Manipulability, Rows};
use crate::part::{Chain, Part};
use linkwork_dynamics::inverse_kinematics::{Goal, Progress};
use linkwork_dynamics::{Workspace, node_jacobian, poses};
use linkwork_multibody::Limits;
use linkwork_spatial::{Motion, Pose};
use std::f64::consts::TAU;

/// Cost of a solution, and the amount of search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prefer {
    /// Weight of the distance from the middle of the limits; not negative.
    pub centred: f64,
    /// Weight of the distance from the configuration that the search is given; not negative.
    pub near: f64,
    /// Weight of ln w; not negative.
    pub manipulable: f64,
    /// Length by which angular rows of the Jacobian are multiplied in w, m.
    pub length: f64,
    /// Number of starts: the given one and others, the same for each search.
    pub starts: usize,
    /// Maximum number of kinematics evaluations for the improvement of each solution.
    pub steps: usize,
}

impl Prefer {
    /// Prefers configurations near the middle of the limits; 1 start.
    #[must_use]
    pub fn centred() -> Self {
        Self { centred: 1.0, near: 0.0, manipulable: 0.0, length: 1.0, starts: 1, steps: 400 }
    }

    /// Prefers configurations near the one that the search is given; 1 start.
    #[must_use]
    pub fn near() -> Self {
        Self { centred: 0.0, near: 1.0, ..Self::centred() }
    }

    /// Prefers configurations far from singular ones; 1 start.
    #[must_use]
    pub fn manipulable() -> Self {
        Self { centred: 0.0, manipulable: 1.0, ..Self::centred() }
    }

    /// Sets the number of starts.
    #[must_use]
    pub fn starts(mut self, starts: usize) -> Self {
        self.starts = starts;
        self
    }
}

/// Result of a search with a secondary cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Best {
    /// `Met`, or `Nearest` when no start led to the goal.
    pub outcome: Outcome,
    /// c of the result; infinite when the goal is not met.
    pub cost: f64,
    /// Number of starts that led to the goal.
    pub solutions: usize,
    /// Total number of kinematics evaluations.
    pub kinematics: usize,
}

impl Robot {
    /// Like [`inverse_kinematics`](Self::inverse_kinematics), but searches from several starts, and improves each solution among the configurations
    /// that meet the goal. `effort.restarts` has no effect. `effort.kinematics` bounds the sum of all evaluations. If no start leads to the goal, `q`
    /// is the nearest configuration of the last start.
    ///
    /// # Errors
    /// Like [`inverse_kinematics`](Self::inverse_kinematics); [`RobotError::OutOfRange`] for weights that are negative or all zero.
    pub fn inverse_kinematics_best(
        &mut self,
        part: Part,
        goal: &Goal,
        frame: Frame,
        prefer: &Prefer,
        effort: &Effort,
        q: &mut [f64],
    ) -> Result<Best, RobotError> {
        check_prefer(prefer)?;
        let mut best =
            Best { outcome: Outcome::Nearest, cost: f64::INFINITY, solutions: 0, kinematics: 0 };
        for start in 0..prefer.starts.max(1) {
            let left = effort.kinematics - best.kinematics.min(effort.kinematics);
            if left == 0 {
                break;
            }
            let one = Effort { restarts: start, ..*effort };
            self.begin_inverse_kinematics(part, goal, frame, &one, q)?;
            let model = &self.model;
            let chain = model.chain(part)?;
            let Some(memory) = self.chains[part.index()].as_mut() else {
                return Err(RobotError::NotAChain { part: part.index() });
            };
            memory.ik.skip_to(start);
            match memory.ik.advance(&chain.tree, left, &mut memory.q) {
                Progress::Met(found) => {
                    best.kinematics += found.kinematics;
                    let left = effort.kinematics - best.kinematics.min(effort.kinematics);
                    let given = |at: usize| q[chain.q[at]];
                    let steps = left.min(prefer.steps);
                    let (cost, used) = improve(chain, memory, (prefer, &given), steps);
                    best.kinematics += used;
                    best.solutions += 1;
                    if cost < best.cost || best.solutions == 1 {
                        (best.cost, best.outcome) = (cost, Outcome::Met);
                        memory.best.copy_from_slice(&memory.q);
                    }
                }
                Progress::Nearest(found) | Progress::Open(found) | Progress::Unfinished(found) => {
                    best.kinematics += found.kinematics;
                    if best.solutions == 0 {
                        memory.best.copy_from_slice(&memory.q);
                    }
                }
            }
        }
        let chain = self.model.chain(part)?;
        if let Some(memory) = &self.chains[part.index()] {
            for (at, x) in chain.q.iter().zip(&memory.best) {
                q[*at] = *x;
            }
        }
        Ok(best)
    }
}

/// Checks that no weight is negative and that at least one is positive.
pub(super) fn check_prefer(prefer: &Prefer) -> Result<(), RobotError> {
    let bad = |x: f64| !(x >= 0.0 && x.is_finite());
    let Prefer { centred, near, manipulable, .. } = *prefer;
    for (what, value) in [("centred", centred), ("near", near), ("manipulable", manipulable)] {
        if bad(value) || centred + near + manipulable == 0.0 {
            let help = "weights must not be negative, and one must be positive";
            return Err(RobotError::OutOfRange { what, value, help });
        }
    }
    if !(prefer.length > 0.0 && prefer.length.is_finite()) {
        let (what, value, help) = ("length", prefer.length, "the length must be positive");
        return Err(RobotError::OutOfRange { what, value, help });
    }
    Ok(())
}

/// Returns index in q, middle and width of the range of a coordinate that has both limits.
fn range(limits: &Option<(usize, Limits)>) -> Option<(usize, f64, f64)> {
    let (at, l) = limits.as_ref()?;
    let wide = l.upper - l.lower;
    (wide.is_finite() && wide > 0.0).then_some((*at, 0.5 * (l.lower + l.upper), wide))
}

/// Computes the scale of each coordinate in the cost.
pub(super) fn scales(limits: &[Option<(usize, Limits)>], prefer: &Prefer, scale: &mut [f64]) {
    for (d, l) in scale.iter_mut().zip(limits) {
        let wide = range(l).map_or(TAU, |r| r.2);
        *d = (prefer.centred + prefer.near + prefer.manipulable) / (wide * wide);
    }
}

/// Returns the part of the cost for the distances from the middle of the limits and from the given configuration; adds its gradient.
pub(super) fn distances(
    limits: &[Option<(usize, Limits)>],
    (prefer, given): (&Prefer, &dyn Fn(usize) -> f64),
    q: &[f64],
    gradient: &mut [f64],
) -> f64 {
    let mut cost = 0.0;
    for (g, l) in gradient.iter_mut().zip(limits) {
        let mut drawn = |weight: f64, at: usize, to: f64, wide: f64| {
            let x = (q[at] - to) / wide;
            cost += 0.5 * weight * x * x;
            *g += weight * x / wide;
        };
        let limited = range(l);
        if let Some((at, middle, wide)) = limited {
            drawn(prefer.centred, at, middle, wide);
        }
        if let Some((at, _)) = l.filter(|_| prefer.near > 0.0) {
            drawn(prefer.near, at, given(at), limited.map_or(TAU, |r| r.2));
        }
    }
    cost
}

/// Returns the part of the cost for the manipulability of a chain at its own q, and its gradient over the chain's degrees of freedom. Overwrites the
/// chain's poses.
pub(super) fn agility(
    chain: &Chain,
    (ws, J): (&mut Workspace, &mut [f64]),
    prefer: &Prefer,
    q: &[f64],
    gradient: &mut [f64],
) -> f64 {
    poses(&chain.tree, ws, q);
    node_jacobian(&chain.tree, ws, chain.tip, J);
    let rows = Rows::All { length: prefer.length };
    let w = Manipulability::new(J, &chain.first, rows, Some(&mut *gradient)).w;
    gradient.iter_mut().for_each(|g| *g *= -prefer.manipulable / w.max(f64::MIN_POSITIVE));
    -prefer.manipulable * w.ln()
}

/// Improves `memory.q`. Returns the cost and the number of evaluations.
fn improve(
    chain: &Chain,
    memory: &mut ChainMemory,
    (prefer, given): (&Prefer, &dyn Fn(usize) -> f64),
    steps: usize,
) -> (f64, usize) {
    let ChainMemory { ik, ws, J, q, scale, .. } = memory;
    // The position of the base does not matter here, so the chain is evaluated on a base at the origin.
    ws.set_base(&Pose::identity(), &Motion::zero(), &Motion::zero());
    scales(&chain.limits, prefer, scale);
    let mut objective = |q: &[f64], gradient: &mut [f64]| {
        gradient.fill(0.0);
        let mut cost = 0.0;
        if prefer.manipulable > 0.0 {
            cost += agility(chain, (&mut *ws, &mut *J), prefer, q, gradient);
        }
        cost + distances(&chain.limits, (prefer, given), q, gradient)
    };
    let improved = ik.improve(&chain.tree, &mut objective, scale, steps, q);
    (improved.cost, improved.kinematics)
}
