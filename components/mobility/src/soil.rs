//! Soil constants of the wheel-soil model, with a few published sets.

/// Constants of a homogeneous soil, SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Soil {
    /// Sinkage exponent without slip, `n₀`.
    pub n: f64,
    /// Growth of the sinkage exponent with slip, `n = n₀ + n₁ |s|`.
    pub n1: f64,
    /// Cohesive modulus, N/m^(n+1).
    pub k_c: f64,
    /// Frictional modulus, N/m^(n+2).
    pub k_phi: f64,
    /// Cohesion, Pa.
    pub cohesion: f64,
    /// Angle of internal friction, rad.
    pub friction_angle: f64,
    /// Shear deformation modulus `K`, m.
    pub shear_modulus: f64,
    /// Angle of greatest stress as a fraction of the entry angle, without slip.
    pub a0: f64,
    /// Growth of that fraction with slip.
    pub a1: f64,
    /// Rear contact ratio λ: depth of the trailing contact over the sinkage.
    pub lambda: f64,
    /// Bulk density, kg/m³.
    pub density: f64,
    /// Coulomb coefficient when the ground is treated as rigid.
    pub friction: f64,
}

impl Soil {
    /// Lunar regolith of the Apollo source book, as used in public rover demonstrations.
    pub fn lunar() -> Soil {
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
    pub fn silica_sand() -> Soil {
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
    pub fn ishigami_simulant() -> Soil {
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
}
