//! Constants of the Sun, the planets and the Moon.
//!
//! Gravitational parameters: DE440 (Park et al., *Astron. J.* 161 (2021) 105), those of the giant
//! planets with their moons. Shapes: WGS 84 for the Earth, IAU Working Group on Cartographic
//! Coordinates (Archinal et al. 2018) for the others.

use super::Ellipsoid;

/// μ of the Sun, m³/s².
pub const MU_SUN: f64 = 1.32712440041279419e20;
/// μ of Mercury, m³/s².
pub const MU_MERCURY: f64 = 2.2031868551e13;
/// μ of Venus, m³/s².
pub const MU_VENUS: f64 = 3.24858592e14;
/// μ of the Earth without the Moon, m³/s².
pub const MU_EARTH: f64 = 3.98600435507e14;
/// μ of the Moon, m³/s².
pub const MU_MOON: f64 = 4.902800118e12;
/// μ of Mars and its moons, m³/s².
pub const MU_MARS: f64 = 4.2828375816e13;
/// μ of Jupiter and its moons, m³/s².
pub const MU_JUPITER: f64 = 1.267127641e17;
/// μ of Saturn and its moons, m³/s².
pub const MU_SATURN: f64 = 3.79405848418e16;
/// μ of Uranus and its moons, m³/s².
pub const MU_URANUS: f64 = 5.7945564e15;
/// μ of Neptune and its moons, m³/s².
pub const MU_NEPTUNE: f64 = 6.83652710058e15;

/// The astronomical unit, m; exact (IAU 2012, resolution B2).
pub const AU: f64 = 149_597_870_700.0;
/// Nominal radius of the Sun, m (IAU 2015, resolution B3).
pub const RADIUS_SUN: f64 = 6.957e8;

/// The Earth: WGS 84, a 6378137 m, 1/f 298.257223563.
#[must_use]
pub fn wgs84() -> Ellipsoid {
    Ellipsoid::known(6_378_137.0, 1.0 / 298.257_223_563)
}

/// Mars: radii 3396190 and 3376200 m.
#[must_use]
pub fn mars() -> Ellipsoid {
    Ellipsoid::known(3_396_190.0, (3_396_190.0 - 3_376_200.0) / 3_396_190.0)
}

/// The Moon: a sphere of 1737400 m.
#[must_use]
pub fn moon() -> Ellipsoid {
    Ellipsoid::known(1_737_400.0, 0.0)
}
