//! Rotation of the air over the span b of an aircraft, with the spectra of MIL-F-8785C.
//!
//! ```text
//! Φ_p = σ_w²/L_w · 0.8 (π L_w/4b)^⅓/(1 + (4bΩ/π)²)     so that σ_p² = σ_w² · 0.8 (π L_w/4b)^⅓ π²/(8 b L_w)
//! Φ_q = Ω² Φ_w/(1 + (4bΩ/π)²)                          Φ_r = Ω² Φ_v/(1 + (3bΩ/π)²)
//! ```
//! q and r follow from the gusts w and v: q = (π/4b)(w − f), where f is w through a low-pass filter of length 4b/π. The transverse filter has the
//! time x = V t/L (`dryden.rs`), and a = πL/4b:
//! ```text
//! q₁' = −q₁ + n,  q₂' = q₁ − q₂,  f' = a (√3 q₁ + (1 − √3) q₂ − f)
//! over a step: state ← Φ state + N,   ⟨N Nᵀ⟩ = ∫ e^(Ay) b bᵀ e^(Aᵀy) dy      series for a short step, doubled up to the whole
//! ```
//! The standard defines p, q, r of the aircraft relative to the air; the air itself rotates in the opposite direction. [`DrydenRates::rotation`]
//! returns the rotation of the air.

use super::dryden::{DrydenState, Turbulence, across};
use linkwork_spatial::{Mat3, Vec3};
use std::f64::consts::PI;

/// Low-pass states of the rotation of the air, of unit intensity; zeros mean air at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DrydenRates {
    /// Rotation about the direction of flight.
    pub p: f64,
    /// The vertical gust through its low-pass filter.
    pub w: f64,
    /// The lateral gust through its low-pass filter.
    pub v: f64,
}

impl DrydenRates {
    /// Returns the state in statistical equilibrium from the five numbers passed to [`Dryden::stationary`](super::Dryden::stationary), and three
    /// more.
    #[must_use]
    pub fn stationary(
        turbulence: &Turbulence,
        span: f64,
        noise: &[f64; 5],
        more: &[f64; 3],
    ) -> Self {
        let third = |a: f64, pair: [f64; 2], own: f64| {
            // Everything has decayed after forty times the longer time constant.
            let (_, l) = over(40.0 / a.min(1.0), a);
            l.x * pair[0] + l.y * pair[1] + l.z * own
        };
        let [a_w, a_v] = ratios(turbulence, span);
        Self {
            p: more[0],
            w: third(a_w, [noise[3], noise[4]], more[1]),
            v: third(a_v, [noise[1], noise[2]], more[2]),
        }
    }

    /// Returns the state `dt` (s) later at `airspeed` (m/s), given the gusts at the start, the five numbers passed to
    /// [`Dryden::step`](super::Dryden::step) for the same step, and three more. Exact for every dt while airspeed, lengths and span (m) are constant.
    #[must_use]
    pub fn step(
        &self,
        gusts: &DrydenState,
        (turbulence, span): (&Turbulence, f64),
        (airspeed, dt): (f64, f64),
        noise: &[f64; 5],
        more: &[f64; 3],
    ) -> Self {
        let third = |length: f64, a: f64, q: [f64; 2], f: f64, pair: [f64; 2], own: f64| {
            let (phi, l) = over((airspeed * dt / length).max(0.0), a);
            phi.dot(&Vec3::new(q[0], q[1], f)) + l.dot(&Vec3::new(pair[0], pair[1], own))
        };
        let ([a_w, a_v], length) = (ratios(turbulence, span), turbulence.length);
        let x = (airspeed * dt * PI / (4.0 * span)).max(0.0);
        Self {
            p: (-x).exp() * self.p + (-f64::exp_m1(-2.0 * x)).sqrt() * more[0],
            w: third(length.z, a_w, gusts.w, self.w, [noise[3], noise[4]], more[1]),
            v: third(length.y, a_v, gusts.v, self.v, [noise[1], noise[2]], more[2]),
        }
    }

    /// Returns the angular velocity of the air (rad/s): about the direction of flight, about the axis to its left, and about the axis perpendicular
    /// to both.
    #[must_use]
    pub fn rotation(&self, gusts: &DrydenState, turbulence: &Turbulence, span: f64) -> Vec3 {
        let (length, sigma) = (turbulence.length, turbulence.sigma);
        let ratio = PI * length.z / (4.0 * span);
        let roll = sigma.z * (0.8 * ratio.cbrt() * PI * PI / (8.0 * span * length.z)).sqrt();
        // w increases ahead if the air rotates against the axis to the left; v increases ahead if it rotates with the upward axis.
        let about_left = -sigma.z * PI / (4.0 * span) * (across(gusts.w) - self.w);
        let about_up = sigma.y * PI / (3.0 * span) * (across(gusts.v) - self.v);
        Vec3::new(roll * self.p, about_left, about_up)
    }
}

/// Returns the ratios of the gusts' lengths to the lengths of the low-pass filters: for w, for v.
fn ratios(turbulence: &Turbulence, span: f64) -> [f64; 2] {
    [PI * turbulence.length.z / (4.0 * span), PI * turbulence.length.y / (3.0 * span)]
}

/// Returns the rows of f in Φ and in the Cholesky factor of ⟨N Nᵀ⟩ over a step x.
fn over(x: f64, a: f64) -> (Vec3, Vec3) {
    let root3 = 3.0_f64.sqrt();
    let A = Mat3::new(-1.0, 0.0, 0.0, 1.0, -1.0, 0.0, a * root3, a * (1.0 - root3), -a);
    let doublings = (x * (2.0 + 2.0 * a) / 0.1).log2().ceil().clamp(0.0, 60.0) as i32;
    let h = x / 2.0_f64.powi(doublings);
    let (mut phi, mut term) = (Mat3::identity(), Mat3::identity());
    let mut rate = Mat3::zeros();
    rate[(0, 0)] = 1.0;
    let (mut covariance, mut factor) = (rate * h, h);
    for n in 1..=10 {
        let n = f64::from(n);
        term = A * term * (h / n);
        phi += term;
        rate = A * rate + rate * A.transpose();
        factor *= h / (n + 1.0);
        covariance += rate * factor;
    }
    for _ in 0..doublings {
        covariance += phi * covariance * phi.transpose();
        phi *= phi;
    }
    let c = &covariance;
    let over = |x: f64, y: f64| if y > 0.0 { x / y } else { 0.0 };
    let l11 = c[(0, 0)].max(0.0).sqrt();
    let l21 = over(c[(1, 0)], l11);
    let l22 = (c[(1, 1)] - l21 * l21).max(0.0).sqrt();
    let l31 = over(c[(2, 0)], l11);
    let l32 = over(c[(2, 1)] - l31 * l21, l22);
    let l33 = (c[(2, 2)] - l31 * l31 - l32 * l32).max(0.0).sqrt();
    (phi.row(2).transpose(), Vec3::new(l31, l32, l33))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atmosphere::Dryden;

    const SPAN: f64 = 20.0;
    const V: f64 = 150.0;

    fn turbulence() -> Turbulence {
        Turbulence { length: Vec3::new(500.0, 400.0, 300.0), sigma: Vec3::new(1.0, 2.0, 3.0) }
    }

    /// Returns a normal number: the sum of twelve uniform numbers from a fixed recursion.
    fn normal(state: &mut u64) -> f64 {
        (0..12).fold(-6.0, |sum, _| {
            *state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum + (*state >> 11) as f64 / (1_u64 << 53) as f64
        })
    }

    /// Returns ∫ Φ cos(Ω V τ) dΩ of the spectra of MIL-F-8785C for Ω from 0 on, by the midpoint rule.
    fn correlation(tau: f64) -> [f64; 3] {
        let t = turbulence();
        let transverse = |sigma: f64, l: f64, o: f64| {
            let x2 = (l * o).powi(2);
            sigma * sigma * l / PI * (1.0 + 3.0 * x2) / (1.0 + x2).powi(2)
        };
        let (l, s) = (t.length, t.sigma);
        let step = 2e-5;
        let mut sum = [0.0; 3];
        for k in 0..500_000 {
            let o = (f64::from(k) + 0.5) * step;
            let roll = s.z * s.z / l.z * 0.8 * (PI * l.z / (4.0 * SPAN)).cbrt()
                / (1.0 + (4.0 * SPAN * o / PI).powi(2));
            let pitch = o * o * transverse(s.z, l.z, o) / (1.0 + (4.0 * SPAN * o / PI).powi(2));
            let yaw = o * o * transverse(s.y, l.y, o) / (1.0 + (3.0 * SPAN * o / PI).powi(2));
            let wave = (o * V * tau).cos() * step;
            [roll, pitch, yaw].iter().zip(&mut sum).for_each(|(y, sum)| *sum += y * wave);
        }
        sum
    }

    /// Long series have the standard deviations and correlations of the spectra, for short and long steps.
    #[test]
    fn the_air_rotates_with_the_spectra_of_the_standard() {
        let t = turbulence();
        for (dt, lag) in [(0.02, 10), (0.2, 1)] {
            let mut seed = 7;
            let five = |seed: &mut u64| -> [f64; 5] { std::array::from_fn(|_| normal(seed)) };
            let three = |seed: &mut u64| -> [f64; 3] { std::array::from_fn(|_| normal(seed)) };
            let (noise, more) = (five(&mut seed), three(&mut seed));
            let mut gusts = Dryden::stationary(&noise);
            let mut rates = DrydenRates::stationary(&t, SPAN, &noise, &more);
            let rows: Vec<Vec3> = (0..400_000)
                .map(|_| {
                    let row = rates.rotation(&gusts, &t, SPAN);
                    let (noise, more) = (five(&mut seed), three(&mut seed));
                    rates = rates.step(&gusts, (&t, SPAN), (V, dt), &noise, &more);
                    gusts = Dryden::step(&gusts, &t, V, dt, &noise);
                    row
                })
                .collect();
            for (tau, lag) in [(0.0, 0), (0.2, lag)] {
                let want = correlation(tau);
                let squares = correlation(0.0);
                for k in 0..3 {
                    let pairs = rows.iter().zip(&rows[lag..]).map(|(a, b)| a[k] * b[k]);
                    let found = pairs.sum::<f64>() / (rows.len() - lag) as f64;
                    let off = (found - want[k]) / squares[k];
                    // The spectrum of r beyond the midpoint rule's end at 10 rad/m contributes less than 1e-3.
                    assert!(off.abs() < 0.02, "dt {dt}, lag {lag}, {k}: {found} for {}", want[k]);
                }
            }
        }
    }

    /// The initial state has the equilibrium distribution: checks q and r of many initial states.
    #[test]
    fn the_start_is_as_gusty_as_any_time() {
        let (t, n, mut seed) = (turbulence(), 40_000, 3);
        let mut squares = Vec3::zeros();
        for _ in 0..n {
            let noise: [f64; 5] = std::array::from_fn(|_| normal(&mut seed));
            let more: [f64; 3] = std::array::from_fn(|_| normal(&mut seed));
            let rates = DrydenRates::stationary(&t, SPAN, &noise, &more);
            squares += rates.rotation(&Dryden::stationary(&noise), &t, SPAN).map(|x| x * x);
        }
        let want = correlation(0.0);
        for k in 0..3 {
            let found = squares[k] / f64::from(n);
            assert!((found / want[k] - 1.0).abs() < 0.03, "{k}: {found} for {}", want[k]);
        }
    }

    /// Two steps equal one step of twice the length, also for a filter as long as the gust (a = 1) and for zero-length steps.
    #[test]
    fn steps_add_up() {
        for a in [0.3, 1.0, 12.0] {
            let (one, two) = (over(0.35, a).0, over(0.7, a).0);
            let x = (-0.35_f64).exp();
            // The squaring is Φ(2x) = Φ(x)², in the row of f.
            let again = Vec3::new(
                one.x * x + one.y * 0.35 * x + one.z * one.x,
                one.y * x + one.z * one.y,
                one.z * one.z,
            );
            assert!((two - again).norm() < 1e-12, "{a}: {two} {again}");
            let (phi, l) = over(0.0, a);
            assert_eq!((phi, l), (Vec3::z(), Vec3::zeros()));
        }
    }
}
