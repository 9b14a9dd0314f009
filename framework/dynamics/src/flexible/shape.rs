//! A station at modal coordinates η: its pose on the link, the columns Ψ and their rates.
//!
//! With s = θ·θ, a = (1 − cos θ)/s, b = (θ − sin θ)/θ³, a' = da/ds, b' = db/ds:
//! ```text
//! exp(θ~) u = u + (sin θ/θ) θ × u + a θ × (θ × u)
//! Γ u       = u + a θ × u + b θ × (θ × u)
//! Γ̇ u       = a' ṡ θ × u + a θ̇ × u + b' ṡ θ × (θ × u) + b (θ̇ × (θ × u) + θ × (θ̇ × u)),   ṡ = 2 θ·θ̇
//! ```

use super::StationAt;
use crate::linear::{M3, V3, V6};

/// The rotation vector of a station and the factors of the closed forms.
pub(crate) struct Turn {
    theta: V3<f64>,
    /// sin θ/θ, a, b, a', b'.
    sinc: f64,
    a: f64,
    b: f64,
    a1: f64,
    b1: f64,
}

const SINC: [f64; 7] = over_factorials(1);
const A: [f64; 7] = over_factorials(2);
const B: [f64; 7] = over_factorials(3);

/// Returns the coefficients (−1)ᵏ/(2k + n)!.
const fn over_factorials(n: usize) -> [f64; 7] {
    let (mut out, mut k) = ([0.0; 7], 0);
    while k < 7 {
        let (mut f, mut i) = (1.0, 2);
        while i <= 2 * k + n {
            f *= i as f64;
            i += 1;
        }
        out[k] = if k % 2 == 0 { 1.0 / f } else { -1.0 / f };
        k += 1;
    }
    out
}

/// Returns the coefficients of the derivative.
#[inline(always)]
fn slopes(c: [f64; 7]) -> [f64; 6] {
    std::array::from_fn(|k| (k + 1) as f64 * c[k + 1])
}

#[inline(always)]
fn series<const N: usize>(c: &[f64; N], s: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| c + s * sum)
}

impl Turn {
    pub fn new(theta: V3<f64>) -> Self {
        let s = theta.dot(theta);
        if s < 0.04 {
            // The closed forms suffer from cancellation here. The next terms of the series are < 1e-16.
            return Self {
                theta,
                sinc: series(&SINC, s),
                a: series(&A, s),
                b: series(&B, s),
                a1: series(&slopes(A), s),
                b1: series(&slopes(B), s),
            };
        }
        let t = s.sqrt();
        let (sin, cos) = t.sin_cos();
        let (a, b) = ((1.0 - cos) / s, (t - sin) / (s * t));
        // The derivatives are da/dθ = sin/θ² − 2 a/θ, db/dθ = (1 − cos)/θ³ − 3 b/θ, and d/ds = d/dθ
        // / 2θ.
        let a1 = (sin / t - 2.0 * a) / (2.0 * s);
        let b1 = (a - 3.0 * b) / (2.0 * s);
        Self { theta, sinc: sin / t, a, b, a1, b1 }
    }

    fn exp(&self, u: V3<f64>) -> V3<f64> {
        let c = self.theta.cross(u);
        self.theta.cross(c).scale_add(self.a, c.scale_add(self.sinc, u))
    }

    pub fn rotation(&self, R: &M3<f64>) -> M3<f64> {
        M3 { x: self.exp(R.x), y: self.exp(R.y), z: self.exp(R.z) }
    }

    pub fn rate(&self, u: V3<f64>) -> V3<f64> {
        let c = self.theta.cross(u);
        self.theta.cross(c).scale_add(self.b, c.scale_add(self.a, u))
    }

    pub fn rate_dot(&self, theta_dot: V3<f64>, u: V3<f64>) -> V3<f64> {
        let (theta, s_dot) = (self.theta, 2.0 * self.theta.dot(theta_dot));
        let (c, d) = (theta.cross(u), theta_dot.cross(u));
        let sum = c.scale(self.a1 * s_dot) + d.scale(self.a);
        let sum = theta.cross(c).scale_add(self.b1 * s_dot, sum);
        (theta_dot.cross(c) + theta.cross(d)).scale_add(self.b, sum)
    }
}

impl StationAt {
    /// Returns Σ v_i x_i.
    pub fn sum(v: &[V3<f64>], x: &[f64]) -> V3<f64> {
        v.iter().zip(x).fold(V3::default(), |sum, (v, x)| v.scale_add(*x, sum))
    }

    /// Returns the position of the origin in the link.
    pub fn position(&self, eta: &[f64]) -> V3<f64> {
        let p = self.p + Self::sum(&self.translation, eta);
        match &self.shortening {
            Some((x, _)) => {
                let twice: f64 = (0..eta.len()).map(|i| eta[i] * self.bent(i, eta)).sum();
                x.scale_add(-0.5 * twice, p)
            }
            None => p,
        }
    }

    /// Returns entry i of G η.
    fn bent(&self, i: usize, eta: &[f64]) -> f64 {
        let row = |G: &[f64]| G[i * eta.len()..].iter().zip(eta).map(|(g, x)| g * x).sum();
        self.shortening.as_ref().map_or(0.0, |(_, G)| row(G))
    }

    /// Returns column i of Ψ.
    pub fn column(&self, turn: &Turn, i: usize, eta: &[f64]) -> V6<f64> {
        let mut f = self.translation[i];
        if let Some((x, _)) = &self.shortening {
            f = x.scale_add(-self.bent(i, eta), f);
        }
        V6 { n: turn.rate(self.rotation[i]), f }
    }

    /// Returns column i of Ψ̇; `theta_dot` = Φ_r η̇.
    pub fn column_rate(&self, turn: &Turn, i: usize, theta_dot: V3<f64>, rate: &[f64]) -> V6<f64> {
        let f = self.shortening.as_ref().map(|(x, _)| x.scale(-self.bent(i, rate)));
        V6 { n: turn.rate_dot(theta_dot, self.rotation[i]), f: f.unwrap_or_default() }
    }
}

#[cfg(test)]
mod tests {
    use super::Turn;
    use crate::linear::{M3, V3};
    use crate::query::{v3, vec3};
    use linkwork_spatial::{Quat, Vec3};

    #[test]
    fn turns_of_any_size_are_rotations_and_their_rates() {
        let n = Vec3::new(0.48, -0.6, 0.64);
        let (theta_dot, u) = (Vec3::new(0.3, 0.7, -0.5), Vec3::new(-0.2, 0.9, 0.4));
        // Test on both sides of 0.2, where the series is replaced by closed forms.
        for size in [0.0, 1e-9, 1e-3, 0.15, 0.199_999, 0.200_001, 0.25, 1.5, 3.0] {
            let at = |t: f64| n * size + theta_dot * t;
            let turn = |t: f64| Turn::new(v3(&at(t)));
            let R = turn(0.0).rotation(&M3::identity());
            let want = Quat::from_scaled_axis(at(0.0)) * u;
            assert!((vec3(&R.mul(v3(&u))) - want).norm() < 2e-15, "{size}");
            let (h, near) = (1e-5, |a: V3<f64>, b: Vec3| (vec3(&a) - b).norm());
            let (before, after) = (Quat::from_scaled_axis(at(-h)), Quat::from_scaled_axis(at(h)));
            let rate = (after * before.inverse()).scaled_axis() / (2.0 * h);
            let e = near(turn(0.0).rate(v3(&theta_dot)), rate);
            assert!(e < 1e-8, "{size}: {e:e}");
            let step = vec3(&turn(h).rate(v3(&u))) - vec3(&turn(-h).rate(v3(&u)));
            let rate = turn(0.0).rate_dot(v3(&theta_dot), v3(&u));
            let e = near(rate, step / (2.0 * h));
            assert!(e < 1e-8, "{size}: {e:e}");
        }
    }
}
