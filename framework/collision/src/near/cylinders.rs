//! Nearest points of a cylinder and a box or another cylinder: guessed from the possible locations and verified by their normal.
//!
//! ```text
//! on the side   the nearest point of the axis is not one of its ends: distance minus the radius
//! on an end     the other's lowest point above it, if that is above the disc: always exact
//! on a rim      x(θ) on the circle, e(θ) the vector from there to the other: e·x' = 0 by secants, verified by sep(e/|e|) = |e|
//! ```
//! All other cases, and guesses that are not verified, are solved by the GJK iteration.

use super::{Gap, PROOF, exact, lines, proof};
use crate::axis::direction;
use crate::core::{Core, Placed, Poly};
use linkwork_multibody::spatial::Vec3;

/// Maximum number of secant steps: five are usual, a kink needs more.
const MOST: usize = 30;

/// Computes the gap from the cylinder `a` with radius r and half height h; `None` if no guess is verified.
pub(super) fn from_cylinder(a: &Placed, r: f64, h: f64, b: &Placed, size: f64) -> Option<Gap> {
    if !exact(b.core) {
        return None;
    }
    let axis = match b.core {
        Core::Poly(Poly { half: Some(half), .. }) => lines::segment_box(a, h, b, half),
        Core::Cylinder { r, h: height } => lines::segment_cylinder(a, h, b, *r, *height),
        _ => return None,
    };
    let z: Vec3 = a.R.column(2).into_owned();
    let along = z.dot(&(axis.pa - a.p));
    if !(axis.d > r) {
        return None;
    }
    // Between the ends the gap vector is perpendicular to the axis.
    let up = z.dot(&axis.way);
    if along.abs() < h && up.abs() < 0.5 * axis.d {
        let n = direction(&(axis.way - z * up));
        let gap = Gap::new(axis.pa + n * r, axis.way - n * r);
        if gap.d - proof(a, b, &n) <= PROOF * size {
            return Some(gap);
        }
    }
    let top = z * 1f64.copysign(if along.abs() < h { up } else { along });
    on_end(a, r, h, &top, b).or_else(|| on_rim(a, r, h, &top, b, &axis, size))
}

/// Case of the other's lowest point above the disc.
fn on_end(a: &Placed, r: f64, h: f64, top: &Vec3, b: &Placed) -> Option<Gap> {
    let low = b.support(&-top);
    let from = low - a.p;
    let height = from.dot(top) - h;
    let beside = (from - top * (height + h)).norm_squared();
    let over = height > 0.0 && beside <= r * r;
    over.then(|| Gap { pa: low - top * height, way: top * height, d: height })
}

/// Case of the nearest point on the rim.
fn on_rim(
    a: &Placed,
    r: f64,
    h: f64,
    top: &Vec3,
    b: &Placed,
    axis: &Gap,
    size: f64,
) -> Option<Gap> {
    let centre = a.p + top * h;
    // θ = 0 points from the centre of the end towards the other core.
    let out = axis.pa + axis.way - centre;
    let across = out - top * top.dot(&out);
    let length = across.norm();
    if !(length > 1e-9 * r) {
        return None;
    }
    // Orthogonalize again, because a short vector has lost digits.
    let x = across / length;
    let x = (x - top * top.dot(&x)).normalize();
    let y = top.cross(&x);
    // The position, the gap vector, and the function whose zero is searched for.
    let at = |(c, s): (f64, f64)| {
        let p = centre + (x * c + y * s) * r;
        let e = b.toward(&p);
        (p, e, e.dot(&(y * c - x * s)))
    };
    let (p, e, f) = at((1.0, 0.0));
    // Start where the disc is nearest to the point that is nearest to the last position.
    let to = p + e - centre;
    let mut turn = (y.dot(&to) / x.dot(&to)).atan();
    let (mut old, mut before) = ((0.0, f), (0.0, f));
    let (mut pa, mut way) = (p, e);
    for _ in 0..MOST {
        let (s, c) = turn.sin_cos();
        let f;
        (pa, way, f) = at((c, s));
        if f.abs() <= 1e-15 * (way.norm() + r) {
            break;
        }
        // The Illinois rule keeps the other end while the sign changes between both, and halves its value when it is
        // kept twice, because the derivative may have a kink.
        if f * before.1 < 0.0 {
            old = before;
        } else if f * old.1 < 0.0 {
            old.1 *= 0.5;
        } else {
            old = before;
        }
        before = (turn, f);
        let next = turn - f * (turn - old.0) / (f - old.1);
        if !(next.abs() < 3.0) || (next - turn).abs() < 1e-16 {
            break;
        }
        turn = next;
    }
    let d = way.norm();
    (d - proof(a, b, &(way / d)) <= PROOF * size).then_some(Gap { pa, way, d })
}
