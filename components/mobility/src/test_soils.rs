//! Published soils, and a wheel on one of them, for the tests of this crate.

use crate::terramechanics::{Rim, Shear, Sinkage, WheelSoil};
use linkwork_surroundings::prelude::Soil;

/// The wheel of the reference tables, which were computed by an independent integration: 0.15 m × 0.10 m on lunar regolith.
pub(crate) fn golden_wheel() -> WheelSoil {
    WheelSoil {
        rim: Rim { radius: 0.15, width: 0.10 },
        soil: lunar(),
        shear: Shear::Isotropic,
        sinkage: Sinkage::Bekker,
        gravity: 9.81,
        approach: None,
        grousers: None,
    }
}

/// Lunar regolith of the Apollo source book, as used in public rover demonstrations.
pub(crate) fn lunar() -> Soil {
    Soil {
        n: 1.0,
        n1: 0.0,
        k_c: 1400.0,
        k_phi: 8.2e5,
        cohesion: 170.0,
        friction_angle: 33f64.to_radians(),
        shear_modulus: 0.018,
        a0: 0.4,
        a1: 0.15,
        lambda: 0.5,
        density: 1600.0,
        friction: 0.65,
    }
}

/// Silica sand under a smooth 58 mm wheel: a fit with isotropic shear to published
/// single-wheel measurements (slip 0.2 to 0.9, slip angle 0° to 45°).
pub(crate) fn silica_sand() -> Soil {
    Soil {
        n: 1.204,
        n1: 0.093,
        k_c: 0.0,
        k_phi: 2.01e6,
        cohesion: 569.0,
        friction_angle: 22.06f64.to_radians(),
        shear_modulus: 0.0147,
        a0: 0.496,
        a1: 0.139,
        lambda: 0.42,
        density: 1330.0,
        friction: 0.4,
    }
}

/// The simulant of Ishigami et al. 2007 (independent shear has its own moduli).
pub(crate) fn ishigami_simulant() -> Soil {
    Soil {
        n: 1.0,
        n1: 0.0,
        k_c: 1.37e3,
        k_phi: 8.14e5,
        cohesion: 800.0,
        friction_angle: 37.2f64.to_radians(),
        shear_modulus: 0.036,
        a0: 0.4,
        a1: 0.15,
        lambda: 0.9,
        density: 1600.0,
        friction: 0.75,
    }
}
