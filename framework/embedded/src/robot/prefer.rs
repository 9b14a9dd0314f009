//! Of the configurations that meet a goal, the one that is liked best.
//!
//! ```text
//! c = a ½ Σ ((q − middle)/(upper − lower))² + n ½ Σ ((q − q₀)/(upper − lower))² − b ln w(q)
//! ```
//! a: `centred`; n: `near`, q₀ the configuration that the search is given; b: `manipulable`.
//! Each start that leads to the goal is improved along the null space to a local minimum of c; the least is the answer.
//! Coordinates without limits are not drawn to a middle; for `near` their range is 2π or 2π m.

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

/// What is liked among solutions, and how hard to look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prefer {
    /// What distance from the middle of the limits counts; not negative.
    pub centred: f64,
    /// What distance from the configuration that the search is given counts; not negative.
    pub near: f64,
    /// What ln w counts; not negative.
    pub manipulable: f64,
    /// What 1 rad counts in w, m.
    pub length: f64,
    /// Starts: the given one and others, the same ones each time.
    pub starts: usize,
    /// Evaluations of the kinematics to improve each solution, at most.
    pub steps: usize,
}

impl Prefer {
    /// Near the middle of the limits; 1 start.
    #[must_use]
    pub fn centred() -> Self {
        Self { centred: 1.0, near: 0.0, manipulable: 0.0, length: 1.0, starts: 1, steps: 400 }
    }

    /// Near the configuration that the search is given; 1 start.
    #[must_use]
    pub fn near() -> Self {
        Self { centred: 0.0, near: 1.0, ..Self::centred() }
    }

    /// Far from singular configurations; 1 start.
    #[must_use]
    pub fn manipulable() -> Self {
        Self { centred: 0.0, manipulable: 1.0, ..Self::centred() }
    }

    /// So many starts.
    #[must_use]
    pub fn starts(mut self, starts: usize) -> Self {
        self.starts = starts;
        self
    }
}

/// The best of several solutions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Best {
    /// `Met`, or `Nearest` when no start led to the goal.
    pub outcome: Outcome,
    /// c of the answer; infinite when the goal is not met.
    pub cost: f64,
    /// Starts that led to the goal.
    pub solutions: usize,
    /// Evaluations of the kinematics in all.
    pub kinematics: usize,
}

impl Robot {
    /// As [`reach`](Self::reach), from several starts, each improved among the configurations that meet the goal.
    /// `effort.restarts` does not count; `effort.kinematics` bounds all evaluations together. When no start leads there, q
    /// is the nearest of the last of them.
    ///
    /// # Errors
    /// As [`reach`](Self::reach); [`RobotError::OutOfRange`] for weights that are negative or all zero.
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

/// Weights that can be.
pub(super) fn check_prefer(prefer: &Prefer) -> Result<(), RobotError> {
    let bad = |x: f64| !(x >= 0.0 && x.is_finite());
    let Prefer { centred, near, manipulable, .. } = *prefer;
    for (what, value) in [("centred", centred), ("near", near), ("manipulable", manipulable)] {
        if bad(value) || centred + near + manipulable == 0.0 {
            let help = "weights are not negative, and one of them is above zero";
            return Err(RobotError::OutOfRange { what, value, help });
        }
    }
    if !(prefer.length > 0.0 && prefer.length.is_finite()) {
        let (what, value, help) = ("length", prefer.length, "a length is above zero");
        return Err(RobotError::OutOfRange { what, value, help });
    }
    Ok(())
}

/// The middle of the limits of a coordinate and how far they are apart, where it has both: its place in q, too.
fn range(limits: &Option<(usize, Limits)>) -> Option<(usize, f64, f64)> {
    let (at, l) = limits.as_ref()?;
    let wide = l.upper - l.lower;
    (wide.is_finite() && wide > 0.0).then_some((*at, 0.5 * (l.lower + l.upper), wide))
}

/// What a unit of each coordinate counts.
pub(super) fn scales(limits: &[Option<(usize, Limits)>], prefer: &Prefer, scale: &mut [f64]) {
    for (d, l) in scale.iter_mut().zip(limits) {
        let wide = range(l).map_or(TAU, |r| r.2);
        *d = (prefer.centred + prefer.near + prefer.manipulable) / (wide * wide);
    }
}

/// c of the distances from the middle of the limits and from what was given, by its places in q; adds its gradient.
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

/// c of the manipulability of a chain at its own q, and its gradient over its own degrees of freedom. Moves the chain's poses.
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

/// Improves `memory.q`; c, and evaluations.
fn improve(
    chain: &Chain,
    memory: &mut ChainMemory,
    (prefer, given): (&Prefer, &dyn Fn(usize) -> f64),
    steps: usize,
) -> (f64, usize) {
    let ChainMemory { ik, ws, J, q, scale, .. } = memory;
    // Positions do not count: the chain stands on its base.
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
