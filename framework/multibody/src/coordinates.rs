//! The configuration manifold: neutral, integrate, difference, raw derivative, random.
//!
//! Rates are body rates, so ball and free subhinges move by right multiplication:
//! ```text
//! ball   R' = R exp(ω h)
//! free   X' = X exp([ω h; v h])        (SE(3): the path of constant body twist)
//! ```
//! Modal coordinates of flexible bodies add, like angles and displacements.

use crate::{BodyId, Coordinate, Multibody, SubhingeKind, SubhingeRange};
use linkwork_spatial::nalgebra::{Matrix6, Quaternion};
use linkwork_spatial::{Quat, Vec3, skew, turned};

impl Multibody {
    /// Returns the configuration with all angles and displacements zero.
    #[must_use]
    pub fn neutral_q(&self) -> Vec<f64> {
        let mut q = vec![0.0; self.nq()];
        for (_, s) in self.subhinges() {
            if matches!(s.subhinge.kind, SubhingeKind::Ball | SubhingeKind::Free) {
                q[s.q.end - 1] = 1.0;
            }
        }
        q
    }

    /// Returns a random configuration without zeros, the same for the same seed: angles and displacements ±(0.1 … 1), any attitude.
    #[must_use]
    pub fn random_q(&self, seed: u64) -> Vec<f64> {
        let mut q = self.random(seed, self.nq());
        self.normalize(&mut q);
        q
    }

    /// Returns a random configuration within the limits, the same for the same seed: uniform between two limits, at most 1 (rad or m) from a single
    /// limit, and as in [`Multibody::random_q`] without limits.
    #[must_use]
    pub fn random_q_within_limits(&self, seed: u64) -> Vec<f64> {
        let (mut q, mut state) = (self.random_q(seed), seed ^ 0x9e37_79b9);
        for (_, s) in self.subhinges() {
            if s.q.len() != 1 {
                continue;
            }
            let part = uniform(&mut state);
            let (lower, upper) = (s.subhinge.limits.lower, s.subhinge.limits.upper);
            q[s.q.start] = match (lower.is_finite(), upper.is_finite()) {
                (true, true) => (lower + part * (upper - lower)).clamp(lower, upper),
                (true, false) => lower + part,
                (false, true) => upper - part,
                (false, false) => continue,
            };
        }
        q
    }

    /// Returns random rates (or forces) without zeros, ±(0.1 … 1), the same for the same seed.
    #[must_use]
    pub fn random_v(&self, seed: u64) -> Vec<f64> {
        self.random(seed ^ 0x5bd1_e995, self.nv())
    }

    fn random(&self, seed: u64, n: usize) -> Vec<f64> {
        let mut state = seed;
        (0..n)
            .map(|_| {
                let bits = splitmix(&mut state);
                let x = 0.1 + 0.9 * (bits >> 11) as f64 / (1u64 << 53) as f64;
                if bits & 1 == 0 { x } else { -x }
            })
            .collect()
    }

    /// Normalizes each quaternion in q to unit length; a zero quaternion becomes the identity.
    pub fn normalize(&self, q: &mut [f64]) {
        self.check(q.len(), self.nq(), "q");
        for (_, s) in self.subhinges() {
            if matches!(s.subhinge.kind, SubhingeKind::Ball | SubhingeKind::Free) {
                let quat = quaternion(&q[s.q.end - 4..s.q.end]);
                write(&quat, &mut q[s.q.end - 4..s.q.end]);
            }
        }
    }

    /// Computes `out` = q moved by `dv` = β h (rad, m). Exact for constant body rates.
    pub fn integrate(&self, q: &[f64], dv: &[f64], out: &mut [f64]) {
        self.check(q.len(), self.nq(), "q");
        self.check(dv.len(), self.nv(), "dv");
        self.check(out.len(), self.nq(), "out");
        for (_, s) in self.subhinges() {
            let (q, dv, out) = (&q[s.q.clone()], &dv[s.v.clone()], &mut out[s.q.clone()]);
            match s.subhinge.kind {
                SubhingeKind::Locked => {}
                SubhingeKind::Ball => {
                    write(&(quaternion(q) * Quat::from_scaled_axis(vec3(dv))), out);
                }
                SubhingeKind::Free => {
                    let (R, w, v) = (quaternion(&q[3..]), vec3(dv), vec3(&dv[3..]));
                    let p = vec3(q) + R * (v_matrix(&w) * v);
                    out[..3].copy_from_slice(p.as_slice());
                    write(&(R * Quat::from_scaled_axis(w)), &mut out[3..]);
                }
                _ => out[0] = q[0] + dv[0],
            }
        }
        for (at, v) in self.modal() {
            out[at] = q[at] + dv[v];
        }
    }

    /// Computes the derivatives of [`integrate`](Self::integrate) along β (nv × nv each, row by row). If q moves by δ and dv changes by ε, the result
    /// moves by `by_q` δ + `by_dv` ε, to first order. They do not depend on q. Blocks of the subhinges:
    /// ```text
    /// by_q = Ad(exp(−d)) = Σ (−ad d)ᵏ/k!      by_dv = Σ (−ad d)ᵏ/(k + 1)!      ad [ω; v] = [ω~ 0; v~ ω~]
    /// ```
    pub fn integrate_derivatives(&self, dv: &[f64], by_q: &mut [f64], by_dv: &mut [f64]) {
        let n = self.nv();
        self.check(dv.len(), n, "dv");
        self.check(by_q.len(), n * n, "by_q");
        self.check(by_dv.len(), n * n, "by_dv");
        for out in [&mut *by_q, &mut *by_dv] {
            out.fill(0.0);
            (0..n).for_each(|i| out[i * n + i] = 1.0);
        }
        for (_, s) in self.subhinges() {
            let d = &dv[s.v.clone()];
            let (ad, size) = match s.subhinge.kind {
                SubhingeKind::Ball => (adjoint(&vec3(d), &Vec3::zeros()), 3),
                SubhingeKind::Free => (adjoint(&vec3(d), &vec3(&d[3..])), 6),
                _ => continue,
            };
            // Terms fall as |d|ᵏ/k!, where |d| is the rotation or displacement of one step.
            let (mut term, mut sums) = (Matrix6::identity(), [Matrix6::identity(); 2]);
            for k in 1..=TERMS {
                term = -ad * term / f64::from(k);
                sums[0] += term;
                sums[1] += term / f64::from(k + 1);
                if term.amax() < 1e-18 {
                    break;
                }
            }
            for (out, sum) in [&mut *by_q, &mut *by_dv].into_iter().zip(sums) {
                for i in 0..size {
                    for j in 0..size {
                        out[(s.v.start + i) * n + s.v.start + j] = sum[(i, j)];
                    }
                }
            }
        }
    }

    /// Computes `dv` such that `integrate(from, dv)` gives `to` (rad, m). Rotations take the shorter direction.
    pub fn difference(&self, from: &[f64], to: &[f64], dv: &mut [f64]) {
        self.check(from.len(), self.nq(), "from");
        self.check(to.len(), self.nq(), "to");
        self.check(dv.len(), self.nv(), "dv");
        for (_, s) in self.subhinges() {
            let (a, b, dv) = (&from[s.q.clone()], &to[s.q.clone()], &mut dv[s.v.clone()]);
            match s.subhinge.kind {
                SubhingeKind::Locked => {}
                SubhingeKind::Ball => {
                    let w = (quaternion(a).inverse() * quaternion(b)).scaled_axis();
                    dv.copy_from_slice(w.as_slice());
                }
                SubhingeKind::Free => {
                    let R = quaternion(&a[3..]);
                    let w = (R.inverse() * quaternion(&b[3..])).scaled_axis();
                    let d = R.inverse() * (vec3(b) - vec3(a));
                    let v = straight(&w, &d);
                    dv[..3].copy_from_slice(w.as_slice());
                    dv[3..].copy_from_slice(v.as_slice());
                }
                _ => dv[0] = b[0] - a[0],
            }
        }
        for (at, v) in self.modal() {
            dv[v] = to[at] - from[at];
        }
    }

    /// Computes `out` = dq/dt element by element at rates `v`, for integrators that treat q as plain numbers (call [`Multibody::normalize`] after
    /// each step).
    /// ```text
    /// quaternion: q̇ = ½ q ⊗ [ω, 0]      free position: ṗ = R v
    /// ```
    pub fn qdot(&self, q: &[f64], v: &[f64], out: &mut [f64]) {
        self.check(q.len(), self.nq(), "q");
        self.check(v.len(), self.nv(), "v");
        self.check(out.len(), self.nq(), "out");
        for body in self.bodies() {
            for s in body.subhinges() {
                let (at, from) = (s.q.start, s.v.start);
                match s.subhinge.kind {
                    SubhingeKind::Locked => {}
                    SubhingeKind::Ball => {
                        let rate = quat_dot(four(&q[at..]), &vec3(&v[from..]));
                        out[at..at + 4].copy_from_slice(&rate);
                    }
                    SubhingeKind::Free => {
                        let (attitude, v, out) =
                            (four(&q[at + 3..]), &v[from..from + 6], &mut out[at..at + 7]);
                        let p = turned(attitude, &vec3(&v[3..]));
                        out[..3].copy_from_slice(p.as_slice());
                        out[3..].copy_from_slice(&quat_dot(attitude, &vec3(v)));
                    }
                    _ => out[at] = v[from],
                }
            }
            for (at, rate) in body.modes_q().zip(body.modes_v()) {
                out[at] = v[rate];
            }
        }
    }

    /// Returns one flag per element of q and one per element of β: `true` if the element is not independent of the others. The elements of a rotation
    /// share a unit length. Those on the path of a loop, and the terms of a coupling, share its equation, except prescribed ones. O(bodies × loops).
    #[must_use]
    pub fn held_together(&self) -> (Vec<bool>, Vec<bool>) {
        let (mut q, mut v) = (vec![false; self.nq()], vec![false; self.nv()]);
        for (_, s) in self.subhinges() {
            if matches!(s.subhinge.kind, SubhingeKind::Ball | SubhingeKind::Free) {
                q[s.q.end - 4..s.q.end].fill(true);
            }
        }
        for l in self.loops() {
            let [a, b] = [l.a.body, l.b.body];
            let inboard = |end: Option<BodyId>, body| end.is_some_and(|e| self.on_path(body, e));
            for (id, body) in self.body_ids().zip(self.bodies()) {
                let (ia, ib) = (inboard(a, id), inboard(b, id));
                if ia != ib {
                    let free = |s: &&SubhingeRange| s.subhinge.coordinate != Coordinate::Prescribed;
                    for s in body.subhinges().iter().filter(free) {
                        q[s.q.clone()].fill(true);
                        v[s.v.clone()].fill(true);
                    }
                }
                // If the last common body bends, the two frames of the loop move relative to each other.
                let last = ia && ib && !self.bends_further(id, (a, b));
                if ia != ib || last {
                    q[body.modes_q()].fill(true);
                    v[body.modes_v()].fill(true);
                }
            }
        }
        let prescribed = self.prescribed();
        for c in self.couplings() {
            // The builder omits terms whose factors are all zero.
            for &(at, rate, _) in &c.terms {
                if !prescribed[rate] {
                    (q[at], v[rate]) = (true, true);
                }
            }
        }
        (q, v)
    }

    /// Returns whether both ends are outboard of a body that is itself outboard of `body`.
    fn bends_further(&self, body: BodyId, ends: (Option<BodyId>, Option<BodyId>)) -> bool {
        let (Some(a), Some(b)) = ends else { return false };
        self.subtree(body).skip(1).any(|c| self.on_path(c, a) && self.on_path(c, b))
    }

    /// Returns the indices in q and β of all modal coordinates.
    fn modal(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.bodies().iter().flat_map(|b| b.modes_q().zip(b.modes_v()))
    }

    #[track_caller]
    #[inline(always)]
    fn check(&self, got: usize, want: usize, what: &str) {
        if got != want {
            wrong(got, want, what);
        }
    }
}

#[track_caller]
#[cold]
#[inline(never)]
fn wrong(got: usize, want: usize, what: &str) -> ! {
    panic!("{what} has {got} numbers, the mechanism has {want}");
}

/// Returns the next number in 0 … 1, 1 excluded (splitmix64).
pub fn uniform(state: &mut u64) -> f64 {
    (splitmix(state) >> 11) as f64 / (1u64 << 53) as f64
}

fn splitmix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[inline(always)]
fn vec3(s: &[f64]) -> Vec3 {
    let s = &s[..3];
    Vec3::new(s[0], s[1], s[2])
}

/// Returns the first four elements, which must exist.
#[inline(always)]
fn four(s: &[f64]) -> &[f64; 4] {
    s.first_chunk().unwrap_or(&[0.0; 4])
}

/// Returns the unit quaternion of [x y z w], normalized.
pub(crate) fn quaternion(s: &[f64]) -> Quat {
    let raw = Quaternion::new(s[3], s[0], s[1], s[2]);
    Quat::try_new(raw, 0.0).unwrap_or_else(Quat::identity)
}

fn write(q: &Quat, out: &mut [f64]) {
    out.copy_from_slice(&[q.i, q.j, q.k, q.w]);
}

/// Computes ½ q ⊗ [ω, 0] without normalization. It is linear in q, so drift of the norm is harmless.
#[inline(always)]
fn quat_dot(q: &[f64; 4], w: &Vec3) -> [f64; 4] {
    let (u, s) = (vec3(q), q[3]);
    let d = (w * s + u.cross(w)) * 0.5;
    [d.x, d.y, d.z, -0.5 * u.dot(w)]
}

impl Multibody {
    /// Returns bodies whose hinge is one free subhinge with free coordinates, with the index in v. Their velocities are in axes that rotate with the
    /// body.
    pub fn turning(&self) -> impl Iterator<Item = (BodyId, usize)> + '_ {
        self.body_ids().filter_map(|body| match self.get(body).subhinges() {
            [s] if s.subhinge.kind == SubhingeKind::Free
                && s.subhinge.coordinate == Coordinate::Free =>
            {
                Some((body, s.v.start))
            }
            _ => None,
        })
    }

    /// Computes the positions of semi-implicit Euler: `out` = q after `h` s with the velocities `v` of the end of the step. `dv` is workspace.
    /// Velocities of free hinges were stepped as v + h (a − ω × v) in rotating axes, which alone would increase the speed of a tumbling body by ω²h/2
    /// per second. They become
    /// ```text
    /// w = (1 − h ω~)⁻¹ v = (v + u × v + u (u·v)) / (1 + u²)      u = h ω: in the axes at the start
    /// p⁺ = p + h R w,   v = exp(−h ω) w
    /// ```
    /// so that free flight at a constant angular rate is straight and keeps its speed. At a changing rate this holds to first order.
    pub fn step_positions(
        &self,
        q: &[f64],
        v: &mut [f64],
        h: f64,
        dv: &mut [f64],
        out: &mut [f64],
    ) {
        dv.iter_mut().zip(&*v).for_each(|(dv, v)| *dv = h * v);
        for (_, at) in self.turning() {
            let (u, old) = (h * vec3(&v[at..]), vec3(&v[at + 3..]));
            let w = (old + u.cross(&old) + u * u.dot(&old)) / (1.0 + u.norm_squared());
            dv[at + 3..at + 6].copy_from_slice(straight(&u, &(h * w)).as_slice());
            v[at + 3..at + 6].copy_from_slice((Quat::from_scaled_axis(-u) * w).as_slice());
        }
        self.integrate(q, dv, out);
    }
}

/// Returns the linear part (m) of a displacement with rotation `w` (rad) that moves the origin of a free hinge by `d` (m), both in the axes at its
/// start: V⁻¹ d, where
/// ```text
/// V⁻¹ = 1 − ½ ω~ + (1 − ½θ cot ½θ)/θ² ω~²
/// ```
/// A rotation by a full revolution has no such part. The function returns, from 6 rad on, the linear part of the same rotation without the last term.
#[must_use]
pub fn straight(w: &Vec3, d: &Vec3) -> Vec3 {
    let t2 = w.norm_squared();
    let c = if t2 < 1e-2 {
        1.0 / 12.0 + t2 / 720.0 * (1.0 + t2 / 42.0 * (1.0 + t2 / 40.0))
    } else if t2 < 36.0 {
        let half = 0.5 * t2.sqrt();
        (1.0 - half / half.tan()) / t2
    } else {
        0.0
    };
    d - w.cross(d) * 0.5 + w.cross(&w.cross(d)) * c
}

/// Maximum number of terms of an exp series: accurate to round-off for arguments up to 10.
const TERMS: u32 = 60;

/// Returns ad of [ω; v].
fn adjoint(w: &Vec3, v: &Vec3) -> Matrix6<f64> {
    let mut ad = Matrix6::zeros();
    ad.fixed_view_mut::<3, 3>(0, 0).copy_from(&skew(w));
    ad.fixed_view_mut::<3, 3>(3, 3).copy_from(&skew(w));
    ad.fixed_view_mut::<3, 3>(3, 0).copy_from(&skew(v));
    ad
}

/// Returns V with exp([ω; v]) = (exp ω, V v):  1 + (1−cos θ)/θ² ω~ + (θ−sin θ)/θ³ ω~².
fn v_matrix(w: &Vec3) -> linkwork_spatial::Mat3 {
    let (t2, W) = (w.norm_squared(), skew(w));
    let t = t2.sqrt();
    let (a, b) = if t < 1e-2 {
        // Use the series here, because the closed forms lose digits to cancellation; the next term is < 1e-17.
        (
            0.5 - t2 / 24.0 * (1.0 - t2 / 30.0 * (1.0 - t2 / 56.0)),
            1.0 / 6.0 - t2 / 120.0 * (1.0 - t2 / 42.0 * (1.0 - t2 / 72.0)),
        )
    } else {
        (2.0 * (0.5 * t).sin().powi(2) / t2, (t - t.sin()) / (t2 * t))
    };
    linkwork_spatial::Mat3::identity() + W * a + W * W * b
}
