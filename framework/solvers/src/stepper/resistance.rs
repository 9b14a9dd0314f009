//! Resistance to rolling and spinning, and surfaces that move over their bodies.
//!
//! ```text
//! spinning    |m_n| ≤ μ_s λn        a fourth row of the contact's own cone
//! rolling     |m_t| ≤ μ_r λn        two rows with bounds that follow from λn: solve, set the bounds, solve again
//!                                   until they no longer change
//! belt        v = v_b + s_b − v_a − s_a  across the normal, s the velocity of the surface over its body
//! ```
//! A ball of radius r that rolls without slip decelerates by μ_r g / (r (1 + 2/5)) = 5/7 g μ_r / r: about the contact point (I + m r²) α = −μ_r m g.
//! The first rolling axis is the axis of the relative rotation, so that the bound is exact for a rolling body. The axis of a body that does not roll
//! yet is perpendicular to gravity; the bound for a load in another direction may then be up to √2 too large.

use super::{ContactStepper, Kind, StepError};
use crate::contact::{Cone, Report};
use linkwork_collision::{ContactPoint, SurfaceVelocities};
use linkwork_dynamics::{Tree, Workspace};
use linkwork_multibody::BodyId;
use linkwork_spatial::Vec3;

/// Maximum number of solutions of a step while the bounds of rolling friction change.
const ROUNDS: usize = 20;
/// Relative change of the largest bound that counts as settled, as a fraction of the solver's tolerance.
const SETTLED: f64 = 0.1;
/// Relative rotation that counts as zero, rad/s.
const STILL: f64 = 1e-9;

/// A row of rolling friction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rolling {
    /// Its group, and the group of its contact.
    pub group: u32,
    pub contact: u32,
    /// Its contact point.
    pub point: u32,
    /// μ_r, m.
    pub coefficient: f64,
    /// Axis, W.
    pub axis: Vec3,
}

/// Returns the axes about which a contact's own group measures rotation, and its cone.
pub(super) fn contact_cone(frame: &[Vec3; 3], friction: f64, spin: f64) -> (&[Vec3], Cone) {
    if spin > 0.0 {
        (&frame[..1], Cone::Spinning { friction, spin })
    } else {
        (&[], Cone::Coulomb { friction })
    }
}

/// Returns two axes perpendicular to the normal, the first along the relative rotation of the bodies.
pub(super) fn rolling_axes(
    tree: &Tree,
    ws: &Workspace,
    p: &ContactPoint,
    frame: &[Vec3; 3],
) -> [Vec3; 2] {
    let turn =
        |body: Option<BodyId>| body.map_or_else(Vec3::zeros, |b| ws.body_velocity(tree, b).angular);
    let n = &frame[0];
    let w = turn(p.body_b) - turn(p.body_a);
    let (across, down) = (w - n * n.dot(&w), n.cross(&ws.uniform_gravity()));
    let axis = [(across, STILL), (down, 1e-3)].into_iter().find(|(a, least)| a.norm() > *least);
    axis.map_or([frame[1], frame[2]], |(a, _)| {
        let a = a.normalize();
        [a, n.cross(&a)]
    })
}

/// Returns the surface velocity of b minus the surface velocity of a, in the frame of a contact point; 0 along the normal.
pub(super) fn belt(
    surfaces: &SurfaceVelocities,
    tree: &Tree,
    ws: &Workspace,
    p: &ContactPoint,
    frame: &[Vec3; 3],
) -> [f64; 3] {
    let turned = |body: Option<BodyId>, s: Vec3| body.map_or(s, |b| ws.body_rotation(tree, b) * s);
    let s = turned(p.body_b, surfaces.of(p.b)) - turned(p.body_a, surfaces.of(p.a));
    [0.0, frame[1].dot(&s), frame[2].dot(&s)]
}

impl ContactStepper {
    /// Solves the step. If contacts resist rolling, repeats until their bounds agree with the normal impulses.
    pub(super) fn solve_with_rolling(&mut self) -> Result<Report, StepError> {
        if self.rolling.is_empty() {
            return self.solve();
        }
        self.set_rolling_bounds();
        let mut report = self.solve()?;
        let close = SETTLED * self.settings.solver.tolerance;
        for _ in 1..ROUNDS {
            let (changed, most) = self.set_rolling_bounds();
            if changed <= close * most {
                return Ok(report);
            }
            report = self.solve()?;
        }
        report.converged = false;
        Ok(report)
    }

    /// Sets the bounds from the normal impulses. Returns their largest change, and the largest bound.
    fn set_rolling_bounds(&mut self) -> (f64, f64) {
        let (mut changed, mut most) = (0.0_f64, 0.0_f64);
        for r in &self.rolling {
            let new = r.coefficient * self.lambda[r.contact as usize][0].max(0.0);
            let cone = &mut self.cones[r.group as usize];
            if let Cone::Dry { bound } = *cone {
                changed = changed.max((new - bound).abs());
            }
            most = most.max(new);
            *cone = Cone::Dry { bound: new };
        }
        (changed, most)
    }

    /// Stores the moments of the solution at the contact points.
    pub(super) fn keep_moments(&mut self) {
        self.moments.clear();
        if !self.colliders.resists() {
            return;
        }
        self.moments.resize(self.points.len(), Vec3::zeros());
        for (kind, lambda) in self.kinds.iter().zip(&self.lambda) {
            if let Kind::Contact(i) = kind {
                self.moments[*i as usize] += self.frames[*i as usize][0] * lambda[3];
            }
        }
        for r in &self.rolling {
            self.moments[r.point as usize] += r.axis * self.lambda[r.group as usize][0];
        }
    }
}
