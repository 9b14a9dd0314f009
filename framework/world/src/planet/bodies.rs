//! Constants of the Sun, the planets and the Moon.
//!
//! Gravitational parameters are from DE440 (Park et al., *Astron. J.* 161 (2021) 105); those of the giant planets include their moons. `Ellipsoid`
//! has the shapes.

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
