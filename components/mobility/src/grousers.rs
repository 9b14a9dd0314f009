//! Straight grousers: bars across the rim that hold the soil between them. Each pushes soil backwards until the soil in front of it fails.
//! ```text
//! P   = b (½ γ h² N_φ + σ h N_φ + 2 c h √N_φ),  N_φ = tan²(45° + φ/2)      passive earth pressure on one bar (Rankine; Bekker 1969, Wong 2008)
//! B   = b Δ [r_g (c (1 + 2 h/b) + σ tan φ (1 + 0.64 (h/b) atan(b/h))) − r (c + σ tan φ)]          block of soil between two bars (Bekker 1956)
//! F_k = min(P, B) τ_x/(c + σ tan φ)      at θ_k = ψ + k Δ,  Δ = 2π/N
//! F_x += Σ F_k cos θ_k,   F_z += Σ F_k sin θ_k,   T += r Σ F_k
//! ```
//! σ and τ are the stresses of the rim at θ_k, r the shear radius, r_g = rim + h. B is the strength of the block at the tips and at its side walls
//! beyond the strength that the rim itself already uses. Soil fails in the weaker of the two ways: around single bars if these are far apart, below
//! the blocks if they are close together. A bar that is not completely in the ground has the height r (cos θ − cos θ_f), so that the force does not
//! jump when the bar enters or leaves the ground (on `mobility.scm_ground` it does). The sum over the bars that are in the ground oscillates with the
//! period Δ of the wheel's angle ψ. F_k acts at the place and in the direction of the shear stress of the rim, so it takes work from the wheel like
//! that stress.

use linkwork_surroundings::prelude::*;
use std::f64::consts::{FRAC_PI_4, TAU};

/// Grousers of a wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grousers {
    /// Number around the wheel.
    pub count: u32,
    /// Height over the rim, m.
    pub height: f64,
    /// Radius of the tips: rim plus height, m.
    pub tips: f64,
    /// Angle of one grouser from the bottom towards the front, rad.
    pub phase: f64,
}

/// Grousers of a wheel, as a parameter.
#[derive(Params, Clone, Copy, Debug, PartialEq)]
pub struct GrouserParams {
    /// Number around the wheel.
    #[param(range = 1.0..=720.0)]
    pub count: u32,
    /// Height over the rim.
    #[param(unit = "m", range = 1e-5..)]
    pub height: f64,
    /// Fraction of the height that is added to the shear radius.
    #[param(default = 1.0, range = 0.0..=1.0)]
    pub share: f64,
}

impl GrouserParams {
    /// Returns the grousers on a rim (m).
    pub fn on(&self, rim: f64) -> Grousers {
        let GrouserParams { count, height, .. } = *self;
        Grousers { count, height, tips: rim + height, phase: 0.0 }
    }
}

/// Returns the radius at which the soil is sheared by a rim (m) with these grousers, m.
pub fn shear_radius(rim: f64, grousers: &Option<GrouserParams>) -> f64 {
    rim + grousers.map_or(0.0, |g| g.share * g.height)
}

/// Checks the height of the grousers of a rim (m).
///
/// # Errors
/// Returns an error if the height exceeds the radius.
pub fn check(rim: f64, grousers: &Option<GrouserParams>) -> Result<(), BuildError> {
    let Some(GrouserParams { height, .. }) = *grousers else { return Ok(()) };
    if height > rim {
        let fact = format!("grousers {height} m high are higher than the radius of {rim} m");
        return Err(BuildError::new(fact)
            .at("grousers")
            .help("write a height in m that does not exceed the radius of the wheel"));
    }
    Ok(())
}

/// Force (N) at which the soil in front of one bar fails: width `b` and height `h` in the ground (m), pressure `sigma` (Pa) next to it, specific
/// weight `gamma` of the soil (N/m³).
pub fn passive(soil: &Soil, gamma: f64, [b, h]: [f64; 2], sigma: f64) -> f64 {
    let n = (FRAC_PI_4 + 0.5 * soil.friction_angle).tan().powi(2);
    b * h * (0.5 * gamma * h * n + sigma * n + 2.0 * soil.cohesion * n.sqrt())
}

/// Strength (Pa) of the soil below the block between two bars and at its sides, over the area at the tips.
pub fn block(soil: &Soil, [b, h]: [f64; 2], sigma: f64) -> f64 {
    let sides = if h > 0.0 { 0.64 * (h / b) * (b / h).atan() } else { 0.0 };
    soil.cohesion * (1.0 + 2.0 * h / b) + sigma * soil.friction_angle.tan() * (1.0 + sides)
}

impl Grousers {
    /// Returns the largest force (N) of the bar at a place where the rim of width `b` and shear radius `r` (m) is `depth` (m) below the surface and
    /// presses with `sigma` (Pa).
    pub fn limit(
        &self,
        soil: &Soil,
        gamma: f64,
        [b, r]: [f64; 2],
        [depth, sigma]: [f64; 2],
    ) -> f64 {
        let h = self.height.min(depth);
        if h <= 0.0 {
            return 0.0;
        }
        let apart = TAU / f64::from(self.count);
        let rim = soil.cohesion + sigma * soil.friction_angle.tan();
        let tips = r.max(self.tips - self.height + h);
        let beyond = b * apart * (tips * block(soil, [b, h], sigma) - r * rim);
        passive(soil, gamma, [b, h], sigma).min(beyond.max(0.0))
    }

    /// Returns the angles of the bars between two angles (rad).
    pub fn between(&self, rear: f64, front: f64) -> impl Iterator<Item = f64> + use<> {
        let apart = TAU / f64::from(self.count.max(1));
        let phase = self.phase;
        let first = ((rear - phase) / apart).ceil();
        (0..self.count)
            .map(move |k| phase + (first + f64::from(k)) * apart)
            .take_while(move |theta| *theta < front)
    }
}

#[cfg(test)]
#[path = "grousers_tests.rs"]
mod tests;
