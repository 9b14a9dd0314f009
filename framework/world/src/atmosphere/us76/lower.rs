//! US Standard Atmosphere below 86 km: layers with a constant gradient of molecular-scale temperature over geopotential altitude.
//!
//! ```text
//! T_M = T_b + L (H − H_b)
//! p = p_b (T_b/T_M)^(g₀ M₀/(R* L)),   p_b e^(−g₀ M₀ (H − H_b)/(R* T_b)) where L = 0
//! ρ = p M₀/(R* T_M),   T = T_M M/M₀ (M/M₀ below 1 from 80 km, Table 8 of the standard)
//! ```

use super::super::gas::Air;
use super::{G0, GAMMA, M0, R_STAR, SEAM, geopotential_altitude};

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

/// The base of a layer: H_b, m; L, K/m; T_b, K; p_b, Pa.
#[derive(Clone, Copy, Debug)]
struct Layer {
    base: f64,
    gradient: f64,
    temperature: f64,
    pressure: f64,
}

/// The layers, with an offset of the temperature.
#[derive(Clone, Debug)]
pub(super) struct Layers([Layer; 7]);

impl Layers {
    /// Creates the layers. `offset`, K, is added to T_M up to the highest layer, within which it fades to zero at 86 km. The pressure follows from
    /// hydrostatic balance.
    pub(super) fn new(offset: f64) -> Self {
        let (base, gradient) = BASES[0];
        let first = Layer { base, gradient, temperature: 288.15 + offset, pressure: 101_325.0 };
        let mut layers = [first; 7];
        for k in 1..layers.len() {
            let (base, gradient) = BASES[k];
            let below = layers[k - 1];
            let (temperature, pressure) = ahead(&below, base - below.base);
            layers[k] = Layer { base, gradient, temperature, pressure };
        }
        layers[6].gradient -= offset / (geopotential_altitude(SEAM) - layers[6].base);
        Self(layers)
    }

    pub(super) fn at(&self, z: f64) -> Air {
        let H = geopotential_altitude(z);
        let layer = self.0.iter().rfind(|layer| H >= layer.base).unwrap_or(&self.0[0]);
        let (tm, pressure) = ahead(layer, H - layer.base);
        Air {
            density: pressure * M0 / (R_STAR * tm),
            temperature: tm * weight(z),
            pressure,
            sound_speed: (GAMMA * R_STAR * tm / M0).sqrt(),
        }
    }
}

/// Returns T_M and p, `dH` above the base of a layer.
fn ahead(layer: &Layer, dH: f64) -> (f64, f64) {
    let Layer { gradient, temperature: t, pressure: p, .. } = *layer;
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
