//! NRLMSISE-00: atmosphere from the ground to the exosphere, with solar and geomagnetic activity.
//!
//! Picone et al., *NRLMSISE-00 empirical model of the atmosphere*, J. Geophys. Res. 107 (2002) 1468; Hedin, *J. Geophys. Res.* 92 (1987) 4649 and 96
//! (1991) 1159. This is the model of the Naval Research Laboratory with all variations switched on, in double precision. Its rounded constants (a day
//! of 0.0172142 rad, an hour of 0.2618 rad, a degree of 0.0174533 rad) belong to its coefficients and are kept. Internal units are the model's: km,
//! K, 1/cm³, degrees, hours.
//!
//! ```text
//! coefficients.rs   the published numbers
//! variation.rs      sums over latitude, day, hour, longitude, flux, magnetic activity
//! profile.rs        temperature over height, density by diffusion along it
//! thermosphere.rs   the gases above 72.5 km
//! lower.rs          all of them mixed below
//! ```

mod coefficients;
mod lower;
mod profile;
#[cfg(test)]
mod published;
mod thermosphere;
mod variation;

use crate::error::{WorldError, number};
use crate::planet::{Epoch, Geodetic};
use coefficients::Coefficients;
use std::f64::consts::FRAC_PI_2;
use variation::Moment;

/// Geomagnetic activity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Magnetic {
    /// The daily A_p.
    Daily(f64),
    /// Three-hourly a_p: now, 3, 6 and 9 hours before, mean of 12 to 33, mean of 36 to 57 hours before.
    History([f64; 6]),
}

/// Solar and geomagnetic inputs of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpaceWeather {
    /// Flux at 10.7 cm of the day before, 1e-22 W/(m² Hz).
    pub f107: f64,
    /// Mean of 81 days around the day.
    pub f107_mean: f64,
    /// Magnetic activity.
    pub magnetic: Magnetic,
}

/// Output of the model at a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MsisAir {
    /// ρ including anomalous oxygen, which matters for drag above 500 km; kg/m³.
    pub density: f64,
    /// Temperature, K.
    pub temperature: f64,
    /// Number densities of He, O, N₂, O₂, Ar, H, N, anomalous O, 1/m³.
    pub species: [f64; 8],
}

/// Masses of the species, with the model's values.
const MASS: [f64; 8] = [4.0, 16.0, 28.0, 32.0, 40.0, 1.0, 14.0, 16.0];
/// Atomic unit of mass of the model, kg.
const UNIT: f64 = 1.66e-27;

/// The model, ready for evaluation.
#[derive(Clone, Debug)]
pub struct Msis {
    coefficients: Box<Coefficients>,
}

impl Default for Msis {
    fn default() -> Self {
        Self::new()
    }
}

impl Msis {
    /// Reads the coefficients; takes 25 kB.
    #[must_use]
    pub fn new() -> Self {
        Self { coefficients: Box::new(Coefficients::new()) }
    }

    /// Returns the air at a geodetic position of WGS 84 and an epoch. Takes 3 to 6 µs and does not allocate. The local time follows from the
    /// longitude, as in the authors' code.
    ///
    /// # Errors
    /// The altitude is outside 0 to 2000 km, the flux is not above zero, a_p is negative, or a number is not finite.
    pub fn at(
        &self,
        epoch: &Epoch,
        place: &Geodetic,
        weather: &SpaceWeather,
    ) -> Result<MsisAir, WorldError> {
        number("altitude, m", place.altitude, |h| (0.0..=2e6).contains(&h), "0 to 2000 km")?;
        number("latitude, rad", place.latitude, |x| x.abs() <= FRAC_PI_2, "−π/2 to π/2")?;
        number("longitude, rad", place.longitude, |x| x.abs() < 10.0, "−π to 2π")?;
        for f in [weather.f107, weather.f107_mean] {
            number("f107, 1e-22 W/(m² Hz)", f, |x| x > 0.0, "a flux from 60 to 400")?;
        }
        let activity: &[f64] = match &weather.magnetic {
            Magnetic::Daily(ap) => std::slice::from_ref(ap),
            Magnetic::History(ap) => ap,
        };
        for ap in activity {
            number("ap", *ap, |x| x >= 0.0, "0 to 400")?;
        }
        let (day, seconds) = epoch.utc_day_and_second();
        let moment = Moment::new(
            f64::from(day),
            seconds,
            place.latitude.to_degrees(),
            place.longitude.to_degrees(),
            weather,
        );
        let altitude = place.altitude / 1000.0;
        let (temperature, per_cm3) = lower::air(&self.coefficients, &moment, altitude);
        let species = per_cm3.map(|n| n * 1e6);
        let density = species.iter().zip(MASS).map(|(n, m)| n * m).sum::<f64>() * UNIT;
        Ok(MsisAir { density, temperature, species })
    }
}
