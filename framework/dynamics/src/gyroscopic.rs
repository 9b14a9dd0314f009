//! Free rotation over an explicit step with the implicit midpoint rule.
//!
//! ```text
//! explicit Euler       J Δω = −h ω × J ω                       ½ ω·J ω grows in every step
//! implicit midpoint    J Δω = −h ω̄ × J ω̄,   ω̄ = ω + Δω/2      conserves ½ ω·J ω and |J ω| up to round-off
//! moment               ω × J ω − ω̄ × J ω̄                      added to the first, it gives the second
//! ```
//! Both invariants are quadratic, and the midpoint rule conserves quadratic invariants. The moment is a couple, so it does not affect the centre of
//! mass. It vanishes for rotation about a principal axis.

use crate::linear::{S3, V3};
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_multibody::BodyId;
use linkwork_spatial::{Force, Vec3};

/// Angle of a step (rad) below which the explicit step is used, because its energy error is below 1e-12.
const SMALL: f64 = 1e-6;
/// Maximum number of Newton steps. A step of 0.1 rad needs three.
const STEPS: usize = 12;

impl Workspace {
    /// Returns the sum of the external wrenches on the link that carries a body: moment about the link's origin (N m) and force (N), world axes,
    /// without gravity of [`Workspace::apply_uniform_gravity`].
    #[must_use]
    pub fn link_wrench(&self, tree: &Tree, body: BodyId) -> Force {
        let w = &self.work.f_ext[tree.body(body).slot as usize];
        Force::new(Vec3::new(w.n.x, w.n.y, w.n.z), Vec3::new(w.f.x, w.f.y, w.f.z))
    }

    /// Replaces the wrench that [`Workspace::link_wrench`] returns.
    pub fn set_link_wrench(&mut self, tree: &Tree, body: BodyId, wrench: Force) {
        let w = &mut self.work.f_ext[tree.body(body).slot as usize];
        w.n = V3::new(wrench.moment.x, wrench.moment.y, wrench.moment.z);
        w.f = V3::new(wrench.force.x, wrench.force.y, wrench.force.z);
    }

    /// Adds a moment to a body, so that an explicit Euler step of `h` s of its free rotation becomes a step of the implicit midpoint rule. Call
    /// [`kinematics`](crate::kinematics()) first; the body must have a [`Tree::lone_com`]. Returns the angular acceleration of the free rotation by
    /// that rule (rad/s², world axes). Returns `None` and adds no moment for a body that hardly rotates, and when the rule has no solution near the
    /// present rate.
    pub fn add_midpoint_moment(&mut self, tree: &Tree, body: BodyId, h: f64) -> Option<Vec3> {
        let slot = tree.body(body).slot as usize;
        let kin = &self.work.kin[slot];
        let w = kin.R.tmul(kin.V.n);
        let (moment, change) = midpoint_moment(&tree.compounds.get(slot).J, w, h)?;
        let (moment, turn) = (kin.R.mul(moment), kin.R.mul(change.scale(1.0 / h)));
        let wrench = &mut self.work.f_ext[slot];
        wrench.n = wrench.n + moment;
        Some(Vec3::new(turn.x, turn.y, turn.z))
    }
}

impl Tree {
    /// Returns the centre of mass of a body with everything that is locked to it, relative to the origin and in the axes of its hinge (m), if the
    /// hinge is free and hangs on the world, and no moving body hangs on the body. `None` in mechanisms with flexible bodies.
    #[must_use]
    pub fn lone_com(&self, body: BodyId) -> Option<Vec3> {
        let slot = self.body(body).slot as usize;
        let link = self.links.get(slot.checked_sub(1)?)?;
        let own = link.lone && link.body as usize == body.index() && self.flexible.is_none();
        let c = self.compounds.get(slot).com;
        own.then(|| Vec3::new(c.x, c.y, c.z))
    }
}

/// Returns the moment for the inertia `J` about the centre of mass and the rate `w`, and the resulting change of angular acceleration, all in the
/// axes of the body.
fn midpoint_moment(J: &S3<f64>, w: V3<f64>, h: f64) -> Option<(V3<f64>, V3<f64>)> {
    if !(h * h * w.dot(w) > SMALL * SMALL) {
        return None;
    }
    let explicit = w.cross(J.mul(w));
    let axes = [V3::new(1.0, 0.0, 0.0), V3::new(0.0, 1.0, 0.0), V3::new(0.0, 0.0, 1.0)];
    let mut change = V3::default();
    let mut last = f64::INFINITY;
    for _ in 0..STEPS {
        let mid = change.scale_add(0.5, w);
        let L = J.mul(mid);
        let turn = mid.cross(L);
        let off = turn.scale_add(h, J.mul(change));
        // Compute the columns of the Jacobian of `off`.
        let [a, b, c] = axes.map(|e| {
            let Je = J.mul(e);
            (e.cross(L) + mid.cross(Je)).scale_add(0.5 * h, Je)
        });
        let det = a.dot(b.cross(c));
        let step = V3::new(off.dot(b.cross(c)), a.dot(off.cross(c)), a.dot(b.cross(off)));
        let step = step.scale(1.0 / det);
        change = change - step;
        let size = step.dot(step) / w.dot(w);
        if !size.is_finite() {
            return None;
        }
        if size < 1e-28 || (size < 1e-20 && size >= last) {
            let mid = change.scale_add(0.5, w);
            return Some((explicit - mid.cross(J.mul(mid)), change));
        }
        last = size;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Energy and the magnitude of the angular momentum are conserved over a step of 0.3 rad; the explicit step changes both.
    #[test]
    fn the_moment_keeps_energy_and_momentum() {
        let J = S3 { xx: 0.2, xy: 0.01, xz: -0.02, yy: 0.5, yz: 0.03, zz: 0.6 };
        let (w, h) = (V3::new(2.0, -20.0, 5.0), 0.015);
        let (inverse, _) = J.inverse();
        let step = |moment: V3<f64>| w + inverse.mul(moment - w.cross(J.mul(w))).scale(h);
        let sizes = |w: V3<f64>| [w.dot(J.mul(w)), J.mul(w).dot(J.mul(w))];
        let off = |moment: V3<f64>| {
            let (before, after) = (sizes(w), sizes(step(moment)));
            (after[0] / before[0] - 1.0).abs().max((after[1] / before[1] - 1.0).abs())
        };
        let (moment, change) = midpoint_moment(&J, w, h).expect("it turns");
        let off_change = step(moment) - w - change;
        assert!(off_change.dot(off_change) < 1e-24 * w.dot(w));
        assert!(off(moment) < 1e-14, "{:e}", off(moment));
        assert!(off(V3::default()) > 1e-4, "{:e}", off(V3::default()));
    }

    #[test]
    fn what_hardly_turns_is_left_alone() {
        let J = S3 { xx: 0.2, xy: 0.0, xz: 0.0, yy: 0.5, yz: 0.0, zz: 0.6 };
        assert!(midpoint_moment(&J, V3::new(1e-4, 1e-4, 0.0), 1e-3).is_none());
        assert!(midpoint_moment(&J, V3::new(f64::NAN, 1.0, 0.0), 1e-3).is_none());
    }
}
