//! Earth and Moon with SOFA's series.

use crate::ephemeris::{date, seconds};
use crate::error::WorldError;
use crate::planet::{AU, JD_J2000, PointMotion};
use linkwork_spatial::Vec3;

/// TDB days past J2000 for which the Earth's series is valid, 1900 to 2100; the Moon's series was compared from 1950 to 2100.
pub(super) const DAYS: [f64; 2] = [-36_525.0, 36_525.0];

fn from_au(pv: [[f64; 3]; 2]) -> PointMotion {
    PointMotion { position: Vec3::from(pv[0]) * AU, velocity: Vec3::from(pv[1]) * (AU / 86400.0) }
}

/// Returns the motion of the Earth relative to the Sun (`epv00`). Takes 26 µs.
///
/// # Errors
/// A time outside 1900 to 2100, where the series are not valid.
pub fn earth(tdb: (f64, f64)) -> Result<PointMotion, WorldError> {
    match sofars::eph::epv00(JD_J2000 + tdb.0, tdb.1) {
        Some((heliocentric, _)) => Ok(from_au(heliocentric)),
        None => {
            let fact = format!(
                "the Earth's series are valid from 1900 to 2100, not at {}",
                date(seconds(tdb))
            );
            Err(WorldError::Uncovered { fact, help: "use a kernel that covers it" })
        }
    }
}

/// Returns the motion of the Sun relative to the Earth.
///
/// # Errors
/// As [`earth`].
pub fn sun(tdb: (f64, f64)) -> Result<PointMotion, WorldError> {
    let e = earth(tdb)?;
    Ok(PointMotion { position: -e.position, velocity: -e.velocity })
}

/// Returns the motion of the Moon relative to the Earth (`moon98`). Uses TDB as TT, an error of 2 m. Takes 2 µs.
#[must_use]
pub fn moon(tdb: (f64, f64)) -> PointMotion {
    from_au(sofars::eph::moon98(JD_J2000 + tdb.0, tdb.1))
}
