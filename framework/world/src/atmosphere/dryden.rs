//! Gusts: the Dryden spectra of MIL-F-8785C, discretised exactly.
//!
//! Filters for white noise ⟨w w⟩ = δ(τ), with T = L/V:
//! ```text
//! H_u = σ √(2T)/(1 + T s),    H_v,w = σ √T (1 + √3 T s)/(1 + T s)²
//! R_u = σ² e^(−x),            R_v = σ² e^(−x) (1 − x/2),   x = τ/T
//! ```
//! Beware of √(2L/πV) in place of √(2L/V): it belongs to one-sided spectra and noise of another density. The transverse filter has two states q₁, q₂
//! in dimensionless time:
//! ```text
//! q₁' = −q₁ + w, q₂' = q₁ − q₂,   v = σ (√3 q₁ + (1 − √3) q₂)
//! over a step x:  q₁ ← e^(−x) q₁ + n₁,   q₂ ← e^(−x)(q₂ + x q₁) + n₂
//! ⟨n₁n₁⟩ = (1 − e^(−2x))/2,  ⟨n₁n₂⟩ = (1 − (1 + 2x) e^(−2x))/4,  ⟨n₂n₂⟩ = (1 − (1 + 2x + 2x²) e^(−2x))/4
//! ```
//! The states are dimensionless and do not change if V, L or σ change, so that these may vary along a flight.

use crate::error::{WorldError, number};
use linkwork_spatial::Vec3;

const FOOT: f64 = 0.3048;

/// Lengths and intensities of gusts: longitudinal, lateral, vertical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turbulence {
    /// L_u, L_v, L_w, m.
    pub length: Vec3,
    /// σ_u, σ_v, σ_w, m/s.
    pub sigma: Vec3,
}

impl Turbulence {
    /// Returns the model of MIL-F-8785C at `height` (m) above the ground, at least 3 m. `wind_20ft` (m/s) is the wind at 20 ft (15, 30, 45 knots:
    /// light, moderate, severe), which applies below 1000 ft. `sigma_high` (m/s) is the intensity above 2000 ft, where L is 1750 ft. Between 1000 and
    /// 2000 ft, values are interpolated linearly.
    /// ```text
    /// h in ft below 1000:  L_w = h,  L_u = L_v = h/(0.177 + 0.000823 h)^1.2
    ///                      σ_w = 0.1 W₂₀,  σ_u = σ_v = σ_w/(0.177 + 0.000823 h)^0.4
    /// ```
    ///
    /// # Errors
    /// A wind or intensity is negative, or the height is not finite.
    pub fn mil_f_8785c(height: f64, wind_20ft: f64, sigma_high: f64) -> Result<Self, WorldError> {
        number("height above the ground, m", height, |_| true, "a finite height")?;
        number("wind at 20 ft, m/s", wind_20ft, |x| x >= 0.0, "a speed of at least 0")?;
        number("sigma above 2000 ft, m/s", sigma_high, |x| x >= 0.0, "at least 0")?;
        let low = |h: f64| {
            let k = 0.177 + 0.000823 * h;
            let (along, sigma) = (h / k.powf(1.2) * FOOT, 0.1 * wind_20ft);
            let across = sigma / k.powf(0.4);
            Self {
                length: Vec3::new(along, along, h * FOOT),
                sigma: Vec3::new(across, across, sigma),
            }
        };
        let high = Self {
            length: Vec3::from_element(1750.0 * FOOT),
            sigma: Vec3::from_element(sigma_high),
        };
        let h = (height / FOOT).max(10.0);
        Ok(if h <= 1000.0 {
            low(h)
        } else if h >= 2000.0 {
            high
        } else {
            let (a, s) = (low(1000.0), (h - 1000.0) / 1000.0);
            Self {
                length: a.length + (high.length - a.length) * s,
                sigma: a.sigma + (high.sigma - a.sigma) * s,
            }
        })
    }
}

/// State of the filters; zeros mean calm air.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DrydenState {
    /// The longitudinal filter.
    pub u: f64,
    /// The two states of the lateral filter.
    pub v: [f64; 2],
    /// The two states of the vertical filter.
    pub w: [f64; 2],
}

/// Functions of the filters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dryden;

impl Dryden {
    /// Returns a state in statistical equilibrium from five standard normal numbers, so that the first step is as gusty as any later one.
    #[must_use]
    pub fn stationary(noise: &[f64; 5]) -> DrydenState {
        // In the limit x → ∞, ⟨q₁q₁⟩ = ½, ⟨q₁q₂⟩ = ¼ and ⟨q₂q₂⟩ = ¼.
        let pair = |a: f64, b: f64| [a * 0.5f64.sqrt(), a * 0.125f64.sqrt() + b * 0.125f64.sqrt()];
        DrydenState { u: noise[0], v: pair(noise[1], noise[2]), w: pair(noise[3], noise[4]) }
    }

    /// Returns the state `dt` (s) later at `airspeed` V (m/s), given five independent standard normal numbers. Exact for every dt while V and L are
    /// constant. At zero airspeed the state stays unchanged.
    #[must_use]
    pub fn step(
        state: &DrydenState,
        turbulence: &Turbulence,
        airspeed: f64,
        dt: f64,
        noise: &[f64; 5],
    ) -> DrydenState {
        let x = turbulence.length.map(|l| (airspeed * dt / l).max(0.0));
        let u = (-x.x).exp() * state.u + (-f64::exp_m1(-2.0 * x.x)).sqrt() * noise[0];
        DrydenState {
            u,
            v: transverse(state.v, x.y, [noise[1], noise[2]]),
            w: transverse(state.w, x.z, [noise[3], noise[4]]),
        }
    }

    /// Returns the gust velocity, m/s: along the flight through the air, to the side, and perpendicular to both.
    #[must_use]
    pub fn gust(state: &DrydenState, turbulence: &Turbulence) -> Vec3 {
        turbulence.sigma.component_mul(&Vec3::new(state.u, across(state.v), across(state.w)))
    }
}

/// Returns the transverse gust of unit intensity.
pub(super) fn across(q: [f64; 2]) -> f64 {
    let root3 = 3.0_f64.sqrt();
    root3 * q[0] + (1.0 - root3) * q[1]
}

/// Makes one step of the transverse filter: adds the Cholesky factor of the noise's covariance times the noise.
fn transverse(q: [f64; 2], x: f64, noise: [f64; 2]) -> [f64; 2] {
    let [c11, c12, c22] = covariance(x);
    let l11 = c11.sqrt();
    let l21 = if l11 > 0.0 { c12 / l11 } else { 0.0 };
    let l22 = (c22 - l21 * l21).max(0.0).sqrt();
    let e = (-x).exp();
    [e * q[0] + l11 * noise[0], e * (q[1] + x * q[0]) + l21 * noise[0] + l22 * noise[1]]
}

/// Returns ⟨n₁n₁⟩, ⟨n₁n₂⟩, ⟨n₂n₂⟩. Uses series for small steps, where the closed forms lose digits to cancellation.
fn covariance(x: f64) -> [f64; 3] {
    let first = -0.5 * f64::exp_m1(-2.0 * x);
    if x < 0.02 {
        // Integrate y e^(−2y) and y² e^(−2y) from 0 to x as power series.
        let (mut term, mut c12, mut c22) = (1.0, 0.0, 0.0);
        for k in 0..8 {
            let k = f64::from(k);
            c12 += term * x * x / (k + 2.0);
            c22 += term * x * x * x / (k + 3.0);
            term *= -2.0 * x / (k + 1.0);
        }
        return [first, c12, c22];
    }
    let e = (-2.0 * x).exp();
    [first, 0.25 * (1.0 - (1.0 + 2.0 * x) * e), 0.25 * (1.0 - (1.0 + 2.0 * x + 2.0 * x * x) * e)]
}
