//! Soil of a terrain as parameters: a published kind, any constant of which may be replaced.
//!
//! Sources: lunar: Apollo source book values as used in public rover demonstrations; dry sand and sandy loam:
//! Wong, Theory of Ground Vehicles; silica sand: a fit with isotropic shear to published single-wheel
//! measurements (58 mm smooth wheel). Constants of dry sand and sandy loam are from secondary sources.

use linkwork_runtime::prelude::*;

/// Published soils.
#[derive(Params, Clone, Copy, Debug, PartialEq)]
pub enum SoilKind {
    /// Lunar regolith, nominal.
    Lunar,
    /// Dry sand.
    DrySand,
    /// Sandy loam, 15 % water.
    SandyLoam,
    /// Loose silica sand of a wheel test bed.
    SilicaSand,
}

/// A soil: a kind, and constants that differ from it.
#[derive(Params, Clone, Debug)]
pub struct SoilParams {
    /// Published set to start from.
    #[param(default = SoilKind::Lunar)]
    pub kind: SoilKind,
    /// Sinkage exponent without slip.
    #[param(default = None)]
    pub n: Option<f64>,
    /// Growth of the sinkage exponent with slip.
    #[param(default = None)]
    pub n1: Option<f64>,
    /// Cohesive modulus, N/m^(n+1).
    #[param(default = None)]
    pub k_c: Option<f64>,
    /// Frictional modulus, N/m^(n+2).
    #[param(default = None)]
    pub k_phi: Option<f64>,
    /// Cohesion.
    #[param(unit = "Pa", default = None)]
    pub cohesion: Option<f64>,
    /// Angle of internal friction.
    #[param(unit = "rad", default = None)]
    pub friction_angle: Option<f64>,
    /// Shear deformation modulus.
    #[param(unit = "m", default = None)]
    pub shear_modulus: Option<f64>,
    /// Coulomb coefficient of the ground when it is treated as rigid.
    #[param(default = None)]
    pub friction: Option<f64>,
}

impl Default for SoilParams {
    fn default() -> Self {
        SoilParams {
            kind: SoilKind::Lunar,
            n: None,
            n1: None,
            k_c: None,
            k_phi: None,
            cohesion: None,
            friction_angle: None,
            shear_modulus: None,
            friction: None,
        }
    }
}

/// The constants of a kind.
pub fn published(kind: SoilKind) -> Soil {
    let lunar = Soil {
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
        friction: 0.7,
    };
    match kind {
        SoilKind::Lunar => lunar,
        SoilKind::DrySand => Soil {
            n: 1.1,
            k_c: 990.0,
            k_phi: 1.528e6,
            cohesion: 1040.0,
            friction_angle: 28f64.to_radians(),
            shear_modulus: 0.025,
            a0: 0.18,
            a1: 0.32,
            density: 1520.0,
            ..lunar
        },
        SoilKind::SandyLoam => Soil {
            n: 0.7,
            k_c: 5270.0,
            k_phi: 1.515e6,
            cohesion: 1720.0,
            friction_angle: 29f64.to_radians(),
            shear_modulus: 0.025,
            ..lunar
        },
        SoilKind::SilicaSand => Soil {
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
            friction: 0.5,
        },
    }
}

impl SoilParams {
    /// The soil; refuses constants that no soil has.
    pub fn soil(&self) -> Result<Soil, BuildError> {
        let s = published(self.kind);
        let soil = Soil {
            n: self.n.unwrap_or(s.n),
            n1: self.n1.unwrap_or(s.n1),
            k_c: self.k_c.unwrap_or(s.k_c),
            k_phi: self.k_phi.unwrap_or(s.k_phi),
            cohesion: self.cohesion.unwrap_or(s.cohesion),
            friction_angle: self.friction_angle.unwrap_or(s.friction_angle),
            shear_modulus: self.shear_modulus.unwrap_or(s.shear_modulus),
            friction: self.friction.unwrap_or(s.friction),
            ..s
        };
        let faults = [
            (soil.n > 0.0 && soil.n < 3.0, "the sinkage exponent lies between 0 and 3"),
            (soil.cohesion >= 0.0, "cohesion cannot be negative"),
            (
                (0.0..1.5).contains(&soil.friction_angle),
                "the friction angle lies between 0 and 1.5 rad (write \"33 deg\" for degrees)",
            ),
            (soil.shear_modulus > 0.0, "the shear modulus is a positive length"),
            (soil.friction >= 0.0, "the coefficient of friction cannot be negative"),
        ];
        match faults.iter().find(|(fine, _)| !fine) {
            Some((_, why)) => Err(BuildError::new(*why).at("soil")),
            None => Ok(soil),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_replaces_the_kind() {
        let p = SoilParams { kind: SoilKind::DrySand, n: Some(1.3), ..Default::default() };
        let s = p.soil().unwrap();
        assert_eq!((s.n, s.k_phi), (1.3, 1.528e6));
        let p = SoilParams { friction_angle: Some(33.0), ..Default::default() };
        assert!(p.soil().unwrap_err().message.contains("33 deg"));
    }
}
