//! Below 86 km: layers with a constant gradient of molecular-scale temperature over geopotential altitude.
//!
//! ```text
//! T_M = T_b + L (H − H_b)
//! p = p_b (T_b/T_M)^(g₀ M₀/(R* L)),   p_b e^(−g₀ M₀ (H − H_b)/(R* T_b)) where L = 0
//! ρ = p M₀/(R* T_M),   T = T_M M/M₀ (M/M₀ below 1 from 80 km, Table 8 of the standard)
//! ```

use super::super::gas::Air;
use super::{G0, GAMMA, M0, R_STAR, geopotential_altitude};

/// H_b, m, and L, K/m.
const BASES: [(f64, f64); 7] = [
    (0.0, -6.5e-3),
    (11_000.0, 0.0),
    (20_000.0, 1e-3),
    (32_000.0, 2.8e-3),
    (47_000.0, 0.0),
    (51_000.0, -2.8e-3),
    (71_000.0, -2e-3),
];

/// M/M₀ every half kilometre of geometric altitude from 80 to 86 km.
const WEIGHT: [f64; 13] = [
    1.000000, 0.999996, 0.999989, 0.999971, 0.999941, 0.999909, 0.999870, 0.999829, 0.999786,
    0.999741, 0.999694, 0.999641, 0.999579,
];

/// T_b and p_b of the layers.
#[derive(Clone, Debug)]
pub(super) struct Layers([(f64, f64); 7]);

impl Layers {
    pub(super) fn new() -> Self {
        let mut bases = [(288.15, 101_325.0); 7];
        for k in 1..bases.len() {
            bases[k] = ahead(bases[k - 1], BASES[k - 1].1, BASES[k].0 - BASES[k - 1].0);
        }
        Self(bases)
    }

    pub(super) fn at(&self, z: f64) -> Air {
        let H = geopotential_altitude(z);
        let k = BASES.iter().rposition(|(base, _)| H >= *base).unwrap_or(0);
        let (tm, pressure) = ahead(self.0[k], BASES[k].1, H - BASES[k].0);
        Air {
            density: pressure * M0 / (R_STAR * tm),
            temperature: tm * weight(z),
            pressure,
            sound_speed: (GAMMA * R_STAR * tm / M0).sqrt(),
        }
    }
}

/// T_M and p, `dH` above the base of a layer.
fn ahead((t, p): (f64, f64), gradient: f64, dH: f64) -> (f64, f64) {
    let tm = t + gradient * dH;
    let k = G0 * M0 / R_STAR;
    let ratio = if gradient == 0.0 { (-k * dH / t).exp() } else { (t / tm).powf(k / gradient) };
    (tm, p * ratio)
}

fn weight(z: f64) -> f64 {
    let x = (z - 80_000.0) / 500.0;
    if x <= 0.0 {
        return 1.0;
    }
    let k = (x as usize).min(WEIGHT.len() - 2);
    WEIGHT[k] + (WEIGHT[k + 1] - WEIGHT[k]) * (x - k as f64).min(1.0)
}
