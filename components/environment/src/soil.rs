//! Soil of a terrain as parameters: a published set of constants, each of which may be replaced.
//!
//! | kind | n₀ | n₁ | k_c | k_φ | c Pa | φ ° | K m | source |
//! |---|---|---|---|---|---|---|---|---|
//! | Lunar | 1.0 | 0 | 1400 | 8.2e5 | 170 | 33 | 0.018 | Apollo source book, as in public rover demonstrations |
//! | LunarSimulant | 1.0 | 0 | 1370 | 8.14e5 | 800 | 37.2 | 0.036 | Ishigami et al. 2007, as in public code; a₀ 0.40, a₁ 0.15 |
//! | DrySand | 1.1 | 0 | 990 | 1.528e6 | 1040 | 28 | 0.025 | after Wong; secondary; c₁ 0.18, c₂ 0.32 |
//! | DrySandRover | 1.1 | 0 | 900 | 1.5234e6 | 1000 | 30 | 0.025 | after Iagnemma; as in public code |
//! | SandyLoam | 0.7 | 0 | 5270 | 1.515e6 | 1720 | 29 | 0.025 | 15 % water; secondary |
//! | ClayeySoil | 0.5 | 0 | 1.319e4 | 6.92e5 | 4140 | 13 | 0.01 | Thailand, after Wong; secondary |
//! | Snow | 1.6 | 0 | 4370 | 1.967e5 | 1030 | 19.7 | 0.04 | USA, after Wong; secondary |
//! | LeteSand | 0.79 | 0 | 1.02e5 | 5.30e6 | 1300 | 31.1 | 0.012 | after Wong; secondary |
//! | SoilSimulant | 0.86 | 0.65 | 1.56e4 | 2.407e6 | 250 | 31.9 | 0.0114 | after Ding et al. 2011; n₀, n₁ fitted to its sinkage |
//! | SilicaSand | 1.204 | 0.093 | 0 | 2.01e6 | 569 | 22.06 | 0.0147 | fit with isotropic shear to measurements with a smooth 58 mm wheel (data of robomechanics/3d-terramechanics) |
//! | CrushedGranite | 1.15 | 0 | 0 | 1.85e6 | 5000 | 38 | 0.04 | outdoor rover yard, middle of the published range; public code |
//! | MarsDrift | 1.0 | 0.1 | 1400 | 8.2e5 | 250 | 32 | 0.039 | estimate: slip of a wheel on slopes on Earth, see below |
//!
//! *Secondary*: the values are cited from other works; the original source was not checked. Values that a source does not give (a₀, a₁, λ, density,
//! friction) are taken from Lunar. The constants are valid for the wheel size and the slip range of their measurements. A soil with n₁ = 0 has no
//! slip sinkage.
//!
//! MarsDrift is an estimate of loose drift, which is not based on measurements of Mars soil. Its constants are chosen so that a 0.25 m × 0.4 m wheel
//! under 560 N slips by 43 % on a slope of 15° and 76 % on 20° (`tests/tests/rover/wheels.rs` checks this). These slips come from a single-wheel rig
//! on Earth: a wheel of a lunar rover prototype, 0.225 m in radius, on a lunar simulant of the type GRC-1.

use linkwork_surroundings::prelude::*;

/// Published soils.
#[derive(Params, Clone, Copy, Debug, PartialEq)]
pub enum SoilKind {
    /// Lunar regolith, nominal.
    Lunar,
    /// Lunar simulant of a single-wheel test bed.
    LunarSimulant,
    /// Dry sand.
    DrySand,
    /// Dry sand of rover studies.
    DrySandRover,
    /// Sandy loam, 15 % water.
    SandyLoam,
    /// Clayey soil.
    ClayeySoil,
    /// Snow.
    Snow,
    /// LETE sand, dense.
    LeteSand,
    /// Planetary soil simulant with strong slip sinkage.
    SoilSimulant,
    /// Loose silica sand of a wheel test bed.
    SilicaSand,
    /// Crushed granite of an outdoor rover yard.
    CrushedGranite,
    /// Estimate of loose drift on Mars, fitted to the slip of a wheel on a test rig on Earth.
    MarsDrift,
}

/// A soil: a published set, and constants that replace its values.
#[derive(Params, Clone, Debug)]
pub struct SoilParams {
    /// Published set to start from.
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
    /// Ratio of the angle of greatest stress to the entry angle, without slip.
    #[param(default = None)]
    pub a0: Option<f64>,
    /// Growth with slip of the ratio `a0`.
    #[param(default = None)]
    pub a1: Option<f64>,
    /// Ratio of the rear contact angle to the entry angle: with 0 the soil keeps a rut, with 1 it recovers completely.
    #[param(default = None)]
    pub lambda: Option<f64>,
    /// Bulk density.
    #[param(unit = "kg/m^3", default = None)]
    pub density: Option<f64>,
    /// Coulomb coefficient of the ground when it is treated as rigid.
    #[param(default = None)]
    pub friction: Option<f64>,
}

impl SoilParams {
    /// Returns the parameters of a published soil without changes.
    pub fn of(kind: SoilKind) -> Self {
        SoilParams {
            kind,
            n: None,
            n1: None,
            k_c: None,
            k_phi: None,
            cohesion: None,
            friction_angle: None,
            shear_modulus: None,
            a0: None,
            a1: None,
            lambda: None,
            density: None,
            friction: None,
        }
    }
}

/// Returns the constants of a published soil.
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
        SoilKind::LunarSimulant => Soil {
            k_c: 1370.0,
            k_phi: 8.14e5,
            cohesion: 800.0,
            friction_angle: 37.2f64.to_radians(),
            shear_modulus: 0.036,
            ..lunar
        },
        SoilKind::DrySandRover => Soil {
            n: 1.1,
            k_c: 900.0,
            k_phi: 1.5234e6,
            cohesion: 1000.0,
            friction_angle: 30f64.to_radians(),
            shear_modulus: 0.025,
            ..lunar
        },
        SoilKind::ClayeySoil => Soil {
            n: 0.5,
            k_c: 1.319e4,
            k_phi: 6.92e5,
            cohesion: 4140.0,
            friction_angle: 13f64.to_radians(),
            shear_modulus: 0.01,
            ..lunar
        },
        SoilKind::Snow => Soil {
            n: 1.6,
            k_c: 4370.0,
            k_phi: 1.967e5,
            cohesion: 1030.0,
            friction_angle: 19.7f64.to_radians(),
            shear_modulus: 0.04,
            ..lunar
        },
        SoilKind::LeteSand => Soil {
            n: 0.79,
            k_c: 1.02e5,
            k_phi: 5.30e6,
            cohesion: 1300.0,
            friction_angle: 31.1f64.to_radians(),
            shear_modulus: 0.012,
            ..lunar
        },
        SoilKind::SoilSimulant => Soil {
            n: 0.86,
            n1: 0.65,
            k_c: 1.56e4,
            k_phi: 2.407e6,
            cohesion: 250.0,
            friction_angle: 31.9f64.to_radians(),
            shear_modulus: 0.0114,
            ..lunar
        },
        SoilKind::CrushedGranite => Soil {
            n: 1.15,
            k_c: 0.0,
            k_phi: 1.85e6,
            cohesion: 5000.0,
            friction_angle: 38f64.to_radians(),
            shear_modulus: 0.04,
            density: 1705.0,
            ..lunar
        },
        SoilKind::MarsDrift => Soil {
            n1: 0.1,
            cohesion: 250.0,
            friction_angle: 32f64.to_radians(),
            shear_modulus: 0.039,
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
    /// Returns the soil, or an error for constants that are not physically possible.
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
            a0: self.a0.unwrap_or(s.a0),
            a1: self.a1.unwrap_or(s.a1),
            lambda: self.lambda.unwrap_or(s.lambda),
            density: self.density.unwrap_or(s.density),
            friction: self.friction.unwrap_or(s.friction),
        };
        let within = |v: f64, low: f64, high: f64| v >= low && v <= high;
        let positive = |v: f64| v > 0.0 && v.is_finite();
        let not_negative = |v: f64| v >= 0.0 && v.is_finite();
        let degrees = "an angle between 0 and 1.5 rad (write \"33 deg\" for degrees)";
        let faults = [
            ("n", soil.n, soil.n > 0.0 && soil.n < 3.0, "above 0 and below 3"),
            ("n1", soil.n1, within(soil.n1, 0.0, 2.0), "from 0 to 2"),
            ("k_c", soil.k_c, soil.k_c.is_finite(), "a finite number of N/m^(n+1)"),
            ("k_phi", soil.k_phi, positive(soil.k_phi), "positive, in N/m^(n+2)"),
            ("cohesion", soil.cohesion, not_negative(soil.cohesion), "zero or positive, in Pa"),
            ("friction_angle", soil.friction_angle, within(soil.friction_angle, 0.0, 1.5), degrees),
            (
                "shear_modulus",
                soil.shear_modulus,
                positive(soil.shear_modulus),
                "a positive length",
            ),
            ("a0", soil.a0, within(soil.a0, 0.0, 1.0), "from 0 to 1"),
            ("a1", soil.a1, within(soil.a1, -1.0, 1.0), "from -1 to 1"),
            ("lambda", soil.lambda, within(soil.lambda, 0.0, 1.5), "from 0 to 1.5"),
            ("density", soil.density, not_negative(soil.density), "zero or positive, in kg/m^3"),
            ("friction", soil.friction, not_negative(soil.friction), "zero or positive"),
        ];
        match faults.iter().find(|(_, _, fine, _)| !fine) {
            Some((name, value, _, what)) => {
                let fact = format!("{name} = {value} is not possible for a soil");
                Err(BuildError::new(fact)
                    .at(format!("soil.{name}"))
                    .help(format!("{name} is {what}")))
            }
            None => Ok(soil),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_replaces_the_kind() {
        let p =
            SoilParams { kind: SoilKind::DrySand, n: Some(1.3), ..SoilParams::of(SoilKind::Lunar) };
        let s = p.soil().unwrap();
        assert_eq!((s.n, s.k_phi), (1.3, 1.528e6));
        let p = SoilParams {
            a0: Some(0.3),
            a1: Some(0.2),
            lambda: Some(0.9),
            density: Some(1700.0),
            ..SoilParams::of(SoilKind::Lunar)
        };
        let s = p.soil().unwrap();
        assert_eq!((s.a0, s.a1, s.lambda, s.density), (0.3, 0.2, 0.9, 1700.0));
        let p = SoilParams { lambda: Some(-1.0), ..SoilParams::of(SoilKind::Lunar) };
        assert!(p.soil().unwrap_err().message.contains("lambda"));
        let p = SoilParams { friction_angle: Some(33.0), ..SoilParams::of(SoilKind::Lunar) };
        let told = p.soil().unwrap_err();
        assert!(told.help.unwrap().contains("33 deg"));
        assert_eq!(told.param.unwrap(), "soil.friction_angle");
        for p in [
            SoilParams { k_phi: Some(f64::INFINITY), ..SoilParams::of(SoilKind::Lunar) },
            SoilParams { k_phi: Some(-1.0), ..SoilParams::of(SoilKind::Lunar) },
            SoilParams { n: Some(f64::NAN), ..SoilParams::of(SoilKind::Lunar) },
            SoilParams { density: Some(f64::INFINITY), ..SoilParams::of(SoilKind::Lunar) },
            SoilParams { shear_modulus: Some(0.0), ..SoilParams::of(SoilKind::Lunar) },
        ] {
            let told = p.soil().unwrap_err();
            assert!(
                told.message.contains("is not possible for a soil") && told.help.is_some(),
                "{told:?}"
            );
        }
    }
}
