//! Rows of loops between bodies in the world.
//!
//! Notation: p is from A's origin to B's, and the acceleration of every body is an unknown:
//! ```text
//! v = v_B − v_A − ω_A × p,   a = (α_B, a_B, α_A, a_A) + quadratic terms
//! slide   n · p − Σ c u        turns with A: −2 ω_A × v − ω_A × (ω_A × p)
//! across  (R_A a) · (R_B b)    twice differentiated: a product of two turning vectors
//! turn    angle about R_A n − u
//! screw   n · p − pitch · angle
//! ```

use linkwork_multibody::{LoopMotion, LoopRow};
use linkwork_spatial::{Mat3, Vec3};
use std::f64::consts::TAU;

/// A frame on a body: its pose and motion, and the acceleration of its origin if the body's own acceleration is zero.
#[derive(Clone, Debug)]
pub(super) struct End {
    pub R: Mat3,
    pub p: Vec3,
    pub w: Vec3,
    pub v: Vec3,
    pub a: Vec3,
}

/// One row: moment and force on B at B's origin, error, rate, and d̈ with zero acceleration of every body.
pub(super) struct RowAt {
    pub n: Vec3,
    pub f: Vec3,
    pub error: f64,
    pub rate: f64,
    pub bias: f64,
}

pub(super) fn row(row: &LoopRow, A: &End, B: &End, motions: &[LoopMotion]) -> RowAt {
    let p = B.p - A.p;
    let v = B.v - A.v - A.w.cross(&p);
    let a = B.a - A.a - A.w.cross(&A.w.cross(&p)) - 2.0 * A.w.cross(&v);
    let w = B.w - A.w;
    let none = Vec3::zeros();
    match row {
        LoopRow::Slide { axis, motions: given } => {
            let n = A.R * axis;
            let sum = |of: fn(&LoopMotion) -> f64| -> f64 {
                given.iter().map(|(u, c)| c * of(&motions[*u])).sum()
            };
            let error = n.dot(&p) - sum(|u| u.position);
            let rate = n.dot(&v) - sum(|u| u.rate);
            RowAt { n: none, f: n, error, rate, bias: n.dot(&a) - sum(|u| u.acceleration) }
        }
        LoopRow::Across { a, b, cosine } => {
            let (a, b) = (A.R * a, B.R * b);
            let (a1, b1) = (A.w.cross(&a), B.w.cross(&b));
            let (a2, b2) = (A.w.cross(&a1), B.w.cross(&b1));
            let bias = a2.dot(&b) + 2.0 * a1.dot(&b1) + a.dot(&b2);
            let rate = a1.dot(&b) + a.dot(&b1);
            RowAt { n: b.cross(&a), f: none, error: a.dot(&b) - cosine, rate, bias }
        }
        LoopRow::Turn { axis, reference, motion } => {
            let (n, angle) = angle(A, B, axis, reference);
            let u = &motions[*motion];
            let bias = w.dot(&A.w.cross(&n)) - u.acceleration;
            let error = wrapped(angle - u.position);
            RowAt { n, f: none, error, rate: n.dot(&w) - u.rate, bias }
        }
        LoopRow::Screw { axis, reference, pitch } => {
            let (n, angle) = angle(A, B, axis, reference);
            let error = pitch * wrapped(n.dot(&p) / pitch - angle);
            let rate = n.dot(&v) - pitch * n.dot(&w);
            let bias = n.dot(&a) - pitch * w.dot(&A.w.cross(&n));
            RowAt { n: n * -*pitch, f: n, error, rate, bias }
        }
    }
}

fn angle(A: &End, B: &End, axis: &Vec3, reference: &Vec3) -> (Vec3, f64) {
    let n = A.R * axis;
    let (x, to) = (A.R * reference, B.R * reference);
    (n, x.cross(&to).dot(&n).atan2(x.dot(&to)))
}

/// Wraps an angle to −π … π.
fn wrapped(x: f64) -> f64 {
    x - TAU * (x / TAU).round()
}
