//! Distance of impulses from a solution: the same measure for every method, computed only from λ and b.
//!
//! ```text
//! y = Eᵀ λ,   v = E y + b + R λ                                     velocity after
//! w_g = tr(W_gg + R_g) / rows                                       scale of the group's compliance
//! p = w_g λ                                                         impulses as velocities
//! natural map, by row:
//!   equality     v
//!   unilateral   p − max(0, p − v)
//!   dry          p − clamp(p − v, ± w_g bound)
//!   Coulomb      pn − max(0, pn − vn),   pt − disc(pt − vt; μ max(0, pn)),   spin as dry, μs max(0, pn)
//! residual   = max over rows |natural map| / velocity               0 at a solution, and only there
//! ```
//! The natural map is a velocity (m/s or rad/s): the error of the velocity after, or the change of velocity if the impulse were corrected. `velocity`
//! is the scale of the problem; by default the largest |b|, or 1 if all are 0. residual × velocity is in m/s.

use super::largest::larger;
use super::layout::Layout;
use super::problem::{Cone, Problem};
use wide::f64x4;

/// Distance of impulses from a solution.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measure {
    /// Largest entry of the natural map, divided by `velocity`.
    pub residual: f64,
    /// Largest |λ·(v + De Saxcé's term)| of a group, divided by `velocity` and the largest impulse: work of the contact forces that should be zero.
    pub complementarity: f64,
    /// Largest violation of −λn ≤ 0, |λt| ≤ μ λn, |λ| ≤ bound, divided by the largest impulse.
    pub violation: f64,
    /// Scale of velocities (m/s or rad/s): [`Problem::scaled`](super::Problem::scaled), by default the largest |b|, or 1.
    pub velocity: f64,
}

/// Measures `lambda`, whose Eᵀ λ is `layout.y`; the batches of `layout` have the same impulses. O(entries).
pub(crate) fn measure(problem: &Problem, layout: &mut Layout, lambda: &[[f64; 4]]) -> Measure {
    let (mut residual, mut work, mut violation, mut impulse) = (0.0, 0.0, 0.0, 0.0f64);
    layout.each(|g, block, rows, y| {
        let (cone, l) = (&problem.cones[g], &lambda[g]);
        let v = block.velocity(rows.gathered(y), f64x4::new(*l)).to_array();
        for x in l {
            impulse = impulse.max(x.abs());
        }
        for x in natural(cone, block.scale, l, &v) {
            larger(&mut residual, x);
        }
        larger(&mut work, idle_work(cone, l, &v));
        larger(&mut violation, outside(cone, l));
    });
    if !layout.lanes.is_empty() {
        let worst = layout.lanes.measure(&layout.y);
        larger(&mut residual, worst.natural);
        larger(&mut work, worst.work);
        larger(&mut violation, worst.violation);
        impulse = impulse.max(worst.impulse);
    }
    let impulse = if impulse > 0.0 { impulse } else { 1.0 };
    Measure {
        residual: residual / problem.scale,
        complementarity: work / problem.scale / impulse,
        violation: violation / impulse,
        velocity: problem.scale,
    }
}

/// Computes the natural map of a group (m/s or rad/s).
#[inline(always)]
pub(crate) fn natural(cone: &Cone, w: f64, l: &[f64; 4], v: &[f64; 4]) -> [f64; 4] {
    let p = l.map(|x| x * w);
    let dry = |k: usize, bound: f64| p[k] - (p[k] - v[k]).clamp(-bound, bound);
    match *cone {
        Cone::Equality { .. } => *v,
        Cone::Unilateral => [p[0] - (p[0] - v[0]).max(0.0), 0.0, 0.0, 0.0],
        Cone::Dry { bound } => [dry(0, w * bound), 0.0, 0.0, 0.0],
        Cone::Coulomb { friction } => coulomb(friction, &p, v),
        Cone::Spinning { friction, spin } => {
            let mut out = coulomb(friction, &p, v);
            out[3] = dry(3, spin * p[0].max(0.0));
            out
        }
    }
}

#[inline(always)]
fn coulomb(friction: f64, p: &[f64; 4], v: &[f64; 4]) -> [f64; 4] {
    let radius = friction * p[0].max(0.0);
    let t = [p[1] - v[1], p[2] - v[2]];
    let size = (t[0] * t[0] + t[1] * t[1]).sqrt();
    let keep = if size <= radius { 1.0 } else { radius / size };
    [p[0] - (p[0] - v[0]).max(0.0), p[1] - keep * t[0], p[2] - keep * t[1], 0.0]
}

/// Computes λ·v plus the work dissipated by correct friction: 0 at a solution.
pub(crate) fn idle_work(cone: &Cone, l: &[f64; 4], v: &[f64; 4]) -> f64 {
    let slide = l[1] * v[1] + l[2] * v[2];
    let speed = (v[1] * v[1] + v[2] * v[2]).sqrt();
    match *cone {
        Cone::Equality { .. } => 0.0,
        Cone::Unilateral => l[0] * v[0],
        Cone::Dry { bound } => l[0] * v[0] + bound * v[0].abs(),
        Cone::Coulomb { friction } => l[0] * v[0] + slide + friction * speed * l[0],
        Cone::Spinning { friction, spin } => {
            let turn = l[3] * v[3] + spin * v[3].abs() * l[0];
            l[0] * v[0] + slide + friction * speed * l[0] + turn
        }
    }
}

/// Returns the distance of an impulse from its cone; 0 inside.
pub(crate) fn outside(cone: &Cone, l: &[f64; 4]) -> f64 {
    let tangent = (l[1] * l[1] + l[2] * l[2]).sqrt();
    let most = match *cone {
        Cone::Equality { .. } => 0.0,
        Cone::Unilateral => -l[0],
        Cone::Dry { bound } => l[0].abs() - bound,
        Cone::Coulomb { friction } => (-l[0]).max(tangent - friction * l[0]),
        Cone::Spinning { friction, spin } => {
            (-l[0]).max(tangent - friction * l[0]).max(l[3].abs() - spin * l[0])
        }
    };
    most.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_stays_the_largest() {
        let mut most = 0.0;
        for x in [1.0, f64::NAN, 7.0] {
            larger(&mut most, x);
        }
        assert!(most.is_nan());
    }

    #[test]
    fn impulses_outside_their_cone_are_told() {
        let cone = Cone::Coulomb { friction: 0.5 };
        assert!((outside(&cone, &[1.0, 0.6, 0.8, 0.0]) - 0.5).abs() < 1e-15);
        assert_eq!(outside(&cone, &[2.0, 0.6, 0.8, 0.0]), 0.0);
        assert_eq!(outside(&cone, &[-0.3, 0.0, 0.0, 0.0]), 0.3);
        let cone = Cone::Spinning { friction: 0.5, spin: 0.1 };
        assert!((outside(&cone, &[2.0, 0.6, 0.8, -0.3]) - 0.1).abs() < 1e-15);
        assert_eq!(outside(&Cone::Unilateral, &[-0.3, 0.0, 0.0, 0.0]), 0.3);
        assert_eq!(outside(&Cone::Dry { bound: 1.0 }, &[-1.5, 0.0, 0.0, 0.0]), 0.5);
        assert_eq!(outside(&Cone::Equality { rows: 1 }, &[-9.0, 0.0, 0.0, 0.0]), 0.0);
    }

    /// Sliding friction that does not oppose the motion does spurious work.
    #[test]
    fn idle_work_vanishes_only_for_lawful_friction() {
        let (cone, v) = (Cone::Coulomb { friction: 0.5 }, [0.0, 3.0, -4.0, 0.0]);
        assert!(idle_work(&cone, &[2.0, -0.6, 0.8, 0.0], &v).abs() < 1e-15);
        assert!((idle_work(&cone, &[2.0, 0.8, 0.6, 0.0], &v) - 5.0).abs() < 1e-14);
        let (cone, v) = (Cone::Spinning { friction: 0.5, spin: 0.1 }, [0.0, 3.0, -4.0, 5.0]);
        assert!(idle_work(&cone, &[2.0, -0.6, 0.8, -0.2], &v).abs() < 1e-14);
        assert!((idle_work(&cone, &[2.0, -0.6, 0.8, 0.2], &v) - 2.0).abs() < 1e-14);
    }
}
