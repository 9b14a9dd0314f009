//! The rows of a loop at a state: error, rate, bias and the wrench that each row is.
//!
//! With p from A's origin to B's, everything in world axes, and a row's wrench w = [m; f] acting at
//! B's origin on B, its opposite at the same point on A:
//! ```text
//! v = v_B − v_A − ω_A × p                        velocity of B's origin as A sees it
//! a = a_B − a_A − α_A × p − ω_A × (ω_A × p) − 2 ω_A × v
//! ω = ω_B − ω_A,  α = α_B − α_A
//! slide    f = n          d = n · p − Σ c u       ḋ = f · v − Σ c u̇     d̈ = f · a − Σ c ü
//! across   m = b × a      d = a · b − cos         ḋ = m · ω             d̈ = m · α + ω · ṁ
//! turn     m = n          d = angle − u           ḋ = m · ω − u̇         d̈ = m · α + ω · (ω_A × n) − ü
//! screw    f = n, m = −pitch n                    the sum of a slide and a turn
//! ```
//! With accelerations for every β̇ = 0 in place of a and α, d̈ is the bias J̇β.

use crate::linear::{V3, V6};
use crate::query::{v3, vec3};
use crate::tree::OnLink;
use crate::work::Kin;
use linkwork_multibody::{LoopMotion, Row};
use linkwork_spatial::{Mat3, Vec3};

/// The most rows that a loop can have.
pub(crate) const ROWS: usize = 6;

/// Rows of a loop, world axes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LoopRows {
    pub n: usize,
    /// Wrench about B's origin.
    pub wrench: [V6<f64>; ROWS],
    pub error: [f64; ROWS],
    pub rate: [f64; ROWS],
    pub bias: [f64; ROWS],
    /// A's and B's link's origin to B's origin.
    pub arms: [V3<f64>; 2],
}

/// A loop laid out for the kernels.
#[derive(Clone, Debug)]
pub(crate) struct Closure {
    pub a: OnLink,
    pub b: OnLink,
    pub rows: Vec<Row>,
}

struct Ends {
    R: Mat3,
    w: Vec3,
    alpha: Vec3,
    v: Vec3,
    a: Vec3,
}

/// A frame on a link: rotation, and rates and bias accelerations of its origin.
fn end(at: &OnLink, kin: &[Kin<f64>]) -> (Ends, Vec3) {
    let k = &kin[at.slot as usize];
    let R = crate::query::mat3(&k.R);
    let arm = R * at.p;
    let (w, alpha) = (vec3(&k.V.n), vec3(&k.A.n));
    let v = vec3(&k.V.f) + w.cross(&arm);
    let a = vec3(&k.A.f) + alpha.cross(&arm) + w.cross(&w.cross(&arm));
    (Ends { R: R * at.R, w, alpha, v, a }, arm)
}

impl Closure {
    /// `r`: each link's origin from that of its root. Between roots, world positions are used.
    pub fn rows(
        &self,
        kin: &[Kin<f64>],
        r: &[V3<f64>],
        root: &[u32],
        motions: &[LoopMotion],
    ) -> LoopRows {
        let ((A, arm_a), (B, arm_b)) = (end(&self.a, kin), end(&self.b, kin));
        let (sa, sb) = (self.a.slot as usize, self.b.slot as usize);
        let between = if sa != 0 && sb != 0 && root[sa] == root[sb] {
            r[sb] - r[sa]
        } else {
            kin[sb].p - kin[sa].p
        };
        let p = vec3(&between) + arm_b - arm_a;
        let v = B.v - A.v - A.w.cross(&p);
        let a = B.a - A.a - A.alpha.cross(&p) - A.w.cross(&A.w.cross(&p)) - 2.0 * A.w.cross(&v);
        let (w, alpha) = (B.w - A.w, B.alpha - A.alpha);
        let mut out = LoopRows { n: self.rows.len(), ..LoopRows::default() };
        out.arms = [v3(&(arm_a + p)), v3(&arm_b)];
        for (i, row) in self.rows.iter().enumerate() {
            let (m, f);
            (m, f, out.error[i], out.rate[i], out.bias[i]) = match row {
                Row::Slide { axis, motions: given } => {
                    let n = A.R * axis;
                    let mut s = [n.dot(&p), n.dot(&v), n.dot(&a)];
                    for (u, c) in given {
                        let u = &motions[*u];
                        s[0] -= c * u.position;
                        s[1] -= c * u.rate;
                        s[2] -= c * u.acceleration;
                    }
                    (Vec3::zeros(), n, s[0], s[1], s[2])
                }
                Row::Across { a, b, cosine } => {
                    let (a, b) = (A.R * a, B.R * b);
                    let m = b.cross(&a);
                    let m_dot = B.w.cross(&b).cross(&a) + b.cross(&A.w.cross(&a));
                    let bias = m.dot(&alpha) + w.dot(&m_dot);
                    (m, Vec3::zeros(), a.dot(&b) - cosine, m.dot(&w), bias)
                }
                Row::Turn { axis, reference, motion } => {
                    let (n, angle) = angle(&A.R, &B.R, axis, reference);
                    let u = &motions[*motion];
                    let bias = n.dot(&alpha) + w.dot(&A.w.cross(&n)) - u.acceleration;
                    (n, Vec3::zeros(), wrap(angle - u.position), n.dot(&w) - u.rate, bias)
                }
                Row::Screw { axis, reference, pitch } => {
                    let (n, angle) = angle(&A.R, &B.R, axis, reference);
                    let error = pitch * wrap(n.dot(&p) / pitch - angle);
                    let rate = n.dot(&v) - pitch * n.dot(&w);
                    let turn = n.dot(&alpha) + w.dot(&A.w.cross(&n));
                    (-*pitch * n, n, error, rate, n.dot(&a) - pitch * turn)
                }
            };
            out.wrench[i] = V6 { n: v3(&m), f: v3(&f) };
        }
        out
    }
}

/// The axis in the world and the turn about it.
fn angle(R_A: &Mat3, R_B: &Mat3, axis: &Vec3, reference: &Vec3) -> (Vec3, f64) {
    let (n, x, to) = (R_A * axis, R_A * reference, R_B * reference);
    (n, n.cross(&x).dot(&to).atan2(x.dot(&to)))
}

/// To −π … π.
fn wrap(x: f64) -> f64 {
    use std::f64::consts::TAU;
    x - TAU * (x / TAU).round()
}
