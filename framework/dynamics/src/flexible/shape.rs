//! A station at modal coordinates η: its pose on the link, the columns Ψ, their rates.
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

impl Turn {
    pub fn new(theta: V3<f64>) -> Self {
        let s = theta.dot(theta);
        let t = s.sqrt();
        if s < 0.04 {
            // Series to the eighth order: closed forms lose digits here. The next terms are < 1e-16.
            let series = |c: [f64; 6]| c.iter().rev().fold(0.0, |sum, c| c + s * sum);
            let f = |n: u32| (1..=n).map(f64::from).product::<f64>();
            let (a, b) = ([2, 4, 6, 8, 10, 12, 14], [3, 5, 7, 9, 11, 13, 15]);
            let sign = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            let of = |n: [u32; 7]| std::array::from_fn(|k| sign(k) / f(n[k]));
            let rate =
                |n: [u32; 7]| std::array::from_fn(|k| sign(k + 1) * (k + 1) as f64 / f(n[k + 1]));
            return Self {
                theta,
                sinc: series(of([1, 3, 5, 7, 9, 11, 13])),
                a: series(of(a)),
                b: series(of(b)),
                a1: series(rate(a)),
                b1: series(rate(b)),
            };
        }
        let (sin, cos) = t.sin_cos();
        let (a, b) = ((1.0 - cos) / s, (t - sin) / (s * t));
        // da/dθ = sin/θ² − 2 a/θ, db/dθ = (1 − cos)/θ³ − 3 b/θ, and d/ds = d/dθ / 2θ.
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
    /// Σ v_i x_i.
    pub fn sum(v: &[V3<f64>], x: &[f64]) -> V3<f64> {
        v.iter().zip(x).fold(V3::default(), |sum, (v, x)| v.scale_add(*x, sum))
    }

    /// Place of the origin in the link.
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

    /// Entry i of G η.
    fn bent(&self, i: usize, eta: &[f64]) -> f64 {
        let row = |G: &[f64]| G[i * eta.len()..].iter().zip(eta).map(|(g, x)| g * x).sum();
        self.shortening.as_ref().map_or(0.0, |(_, G)| row(G))
    }

    /// Column i of Ψ.
    pub fn column(&self, turn: &Turn, i: usize, eta: &[f64]) -> V6<f64> {
        let mut f = self.translation[i];
        if let Some((x, _)) = &self.shortening {
            f = x.scale_add(-self.bent(i, eta), f);
        }
        V6 { n: turn.rate(self.rotation[i]), f }
    }

    /// Column i of Ψ̇; `theta_dot` = Φ_r η̇.
    pub fn column_rate(&self, turn: &Turn, i: usize, theta_dot: V3<f64>, rate: &[f64]) -> V6<f64> {
        let f = self.shortening.as_ref().map(|(x, _)| x.scale(-self.bent(i, rate)));
        V6 { n: turn.rate_dot(theta_dot, self.rotation[i]), f: f.unwrap_or_default() }
    }
}
