//! The Earth's magnetic field: IAGA's reference field, and a dipole.
//!
//! ```text
//! B = −∇V,   V = a Σ_n (a/r)ⁿ⁺¹ Σ_m P̃_nm(sin φ) (g_nm cos mλ + h_nm sin mλ)
//! dipole:    B = (a/r)³ (3 (m·r̂) r̂ − m),   m = (g₁₁, h₁₁, g₁₀)
//! ```
//! Schmidt's semi-normalised functions are P̃ = P̄/√(2n+1), so the evaluator of gravity fields is used, which is also valid at the poles. The
//! thirteenth generation is described in Alken et al., *Earth, Planets and Space* 73 (2021) 49.

mod dipole;
mod igrf;

pub use dipole::dipole;
pub use igrf::{Igrf, MagneticField};

/// Reference radius a of the field, m.
pub const RADIUS: f64 = 6_371_200.0;
