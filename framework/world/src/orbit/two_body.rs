//! Kepler's problem for all eccentricities, in universal variables.
//!
//! ```text
//! α = 2/r₀ − v₀²/μ,  σ = r₀·v₀/√μ,  ψ = α χ²
//! √μ t = r₀ χ c₁(ψ) + σ χ² c₂(ψ) + χ³ c₃(ψ)
//! r = r₀ c₀(ψ) + σ χ c₁(ψ) + χ² c₂(ψ)
//! f = 1 − χ² c₂/r₀,  g = t − χ³ c₃/√μ,  ḟ = −√μ χ c₁/(r r₀),  ġ = 1 − χ² c₂/r
//! ```
//! c_k are Stumpff's functions, Σ (−ψ)ⁿ/(2n + k)!. The solver is Laguerre's iteration of fifth order (Conway, *Celestial Mechanics* 39 (1986)). Whole
//! revolutions are subtracted first, so that months do not cost precision.

use crate::error::{WorldError, number};
use crate::planet::PointMotion;

/// Returns c₀ … c₃ at ψ: series at a quarter, a sixteenth, … of ψ, then formulas for the doubled angle.
fn stumpff(psi: f64) -> [f64; 4] {
    let (mut x, mut halvings) = (psi, 0);
    while x.abs() > 0.1 {
        x *= 0.25;
        halvings += 1;
    }
    let series = |k: f64| {
        let (mut sum, mut term) = (0.0, 1.0);
        for n in 0..8 {
            sum += term;
            let m = 2.0 * f64::from(n) + k;
            term *= -x / ((m + 1.0) * (m + 2.0));
        }
        sum
    };
    let (mut c2, mut c3) = (series(2.0) / 2.0, series(3.0) / 6.0);
    let (mut c0, mut c1) = (1.0 - x * c2, 1.0 - x * c3);
    for _ in 0..halvings {
        c3 = (c2 + c0 * c3) * 0.25;
        c2 = c1 * c1 * 0.5;
        c1 *= c0;
        c0 = 2.0 * c0 * c0 - 1.0;
    }
    [c0, c1, c2, c3]
}

/// Returns position and velocity `dt` (s) later (or earlier) about a point mass μ (m³/s²), any inertial axes. Supports circles, ellipses, parabolas
/// and hyperbolas. Takes 0.3 µs.
///
/// # Errors
/// μ is not above zero, the position is at the centre, the time is not finite, or the iteration does not converge (a straight line through the
/// centre).
pub fn propagate(mu: f64, start: &PointMotion, dt: f64) -> Result<PointMotion, WorldError> {
    number("mu, m³/s²", mu, |x| x > 0.0, "a gravitational parameter is above 0")?;
    number("time, s", dt, |_| true, "a finite time")?;
    let (p, v) = (start.position, start.velocity);
    let r0 = number("distance, m", p.norm(), |x| x > 0.0, "a position away from the centre")?;
    let v2 = number("speed squared, m²/s²", v.norm_squared(), |_| true, "a finite velocity")?;
    let root = mu.sqrt();
    let (alpha, sigma) = (2.0 / r0 - v2 / mu, p.dot(&v) / root);
    let t = if alpha > 0.0 {
        let period = std::f64::consts::TAU / (root * alpha * alpha.sqrt());
        // The fused multiply-add makes the remainder exact.
        (-(dt / period).round()).mul_add(period, dt)
    } else {
        dt
    };
    let (chi, [_, c1, c2, c3]) = solve(root * t, r0, sigma, alpha)?;
    let (x2, x3) = (chi * chi, chi * chi * chi);
    let (f, g) = (1.0 - x2 * c2 / r0, t - x3 * c3 / root);
    let position = p * f + v * g;
    let r = position.norm();
    let (df, dg) = (-root * chi * c1 / (r * r0), 1.0 - x2 * c2 / r);
    Ok(PointMotion { position, velocity: p * df + v * dg })
}

/// Returns χ, and Stumpff's functions there.
fn solve(s: f64, r0: f64, sigma: f64, alpha: f64) -> Result<(f64, [f64; 4]), WorldError> {
    // On a circle, χ = s/r₀ is the solution.
    let mut chi = if alpha > 0.0 {
        s * alpha
    } else {
        s.signum() * (s.abs() / r0).cbrt().min(1.0) * r0.sqrt()
    };
    let mut last = f64::INFINITY;
    for _ in 0..100 {
        let c = stumpff(alpha * chi * chi);
        let (x, x2) = (chi, chi * chi);
        let F = r0 * x * c[1] + sigma * x2 * c[2] + x2 * x * c[3] - s;
        let dF = r0 * c[0] + sigma * x * c[1] + x2 * c[2];
        let ddF = sigma * c[0] + (1.0 - alpha * r0) * x * c[1];
        let root = (16.0 * dF * dF - 20.0 * F * ddF).abs().sqrt();
        let step = 5.0 * F / (dF + root.copysign(dF));
        chi -= step;
        // The iteration has converged, or round-off prevents smaller steps.
        let size = step.abs();
        if size <= 1e-15 * chi.abs() || (size >= last && size <= 1e-9 * chi.abs()) {
            return Ok((chi, stumpff(alpha * chi * chi)));
        }
        last = size;
    }
    let help = "an orbit that does not pass through the centre";
    Err(WorldError::Number { what: "universal anomaly, √m", value: chi, help })
}
