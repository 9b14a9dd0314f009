//! Gaps of loops: a loop that is not closed immediately keeps the initial distance of its ends, and can then close it.
//!
//! ```text
//! d(q) = g                          each row of the loop; where the ends are found g = d
//! over a time T                     g̈ = −2 ω ġ − ω² g from ġ = ḋ,  ω = W/T,  (1 + W) e^−W = 1/100
//! as found                          ġ = g̈ = 0
//! ```
//! g and ġ are states. If the gap closes over a time, neither poses nor velocities jump; if it is kept, velocities jump by the relative velocity of
//! the ends.
use linkwork_dynamics::{Tree, Workspace, kinematics};
use linkwork_multibody::{LoopMotion, Multibody};
use linkwork_solvers::ConstrainedSolver;
use std::collections::BTreeMap;
use std::ops::Range;

/// W: after T a gap that was at rest has a hundredth of its initial size.
const SETTLED: f64 = 6.638_352_067_993_813;

/// Treatment of a loop with gaps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Closing {
    /// The gap closes to a hundredth in this time, s.
    Over(f64),
    /// The gap is kept.
    AsFound,
}

/// The gaps of one loop.
#[derive(Clone, Debug)]
pub(crate) struct Gaps {
    /// Place among the loops.
    pub which: usize,
    /// Indices of the loop motions.
    pub motions: Range<usize>,
    /// ω, rad/s; zero: as found.
    omega: f64,
}

impl Gaps {
    /// Returns the gaps of all loops that have gaps; loops that `closings` does not name keep their gaps.
    pub fn all(m: &Multibody, closings: &BTreeMap<String, Closing>) -> Vec<Gaps> {
        let apart = m.loops().iter().enumerate().filter(|(_, l)| !l.gaps.is_empty());
        let gaps = apart.map(|(which, l)| {
            let omega = match closings.get(&l.closure.name) {
                Some(Closing::Over(time)) => SETTLED / time,
                Some(Closing::AsFound) | None => 0.0,
            };
            Gaps { which, motions: l.gaps.clone(), omega }
        });
        gaps.collect()
    }

    /// g̈.
    pub fn acceleration(&self, g: f64, rate: f64) -> f64 {
        -self.omega * (2.0 * rate + self.omega * g)
    }

    /// ∂g̈/∂g and ∂g̈/∂ġ.
    pub fn jacobian(&self) -> [f64; 2] {
        [-self.omega * self.omega, -2.0 * self.omega]
    }

    /// Computes g and ġ of the ends at the state (q, β) of `ws`.
    pub fn find(
        &self,
        tree: &Tree,
        ws: &mut Workspace,
        solver: &mut ConstrainedSolver,
        (q, v): (&[f64], &[f64]),
        motions: &mut [LoopMotion],
    ) {
        motions[self.motions.clone()].fill(LoopMotion::default());
        kinematics(tree, ws, q, v);
        let mut found = Vec::with_capacity(self.motions.len());
        solver.loop_errors(tree, ws, self.which, motions, |d, rate| found.push((d, rate)));
        for (motion, (d, rate)) in motions[self.motions.clone()].iter_mut().zip(found) {
            motion.position = d;
            motion.rate = if self.omega > 0.0 { rate } else { 0.0 };
            motion.acceleration = self.acceleration(motion.position, motion.rate);
        }
    }
}
