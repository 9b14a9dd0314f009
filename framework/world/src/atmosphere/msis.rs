//! NRLMSISE-00, by the crate `tobari`: the thermosphere with the Sun's and the magnetosphere's moods.
//! Home of tobari.
//!
//! Picone et al., *J. Geophys. Res.* 107 (2002) 1468. The crate agrees with NRL's own code to 1e-3 of density
//! from 100 to 800 km, and is wrong by orders of magnitude below 72.5 km, where it lacks the lower part of
//! the model: altitudes below 80 km are refused.

use crate::error::{WorldError, number};
use crate::planet::{Epoch, Geodetic};
use tobari::nrlmsise00::{Nrlmsise00, Nrlmsise00Input};
use tobari::space_weather::ConstantWeather;

/// What the model wants to know of the Sun and the magnetic field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpaceWeather {
    /// Flux at 10.7 cm of the day before, 1e-22 W/(m² Hz).
    pub f107: f64,
    /// Mean of 81 days around the day.
    pub f107_mean: f64,
    /// Daily A_p, then three-hourly a_p: now, 3, 6, 9 hours before, means of 12–33 and 36–57 hours before.
    pub ap: [f64; 7],
}

impl SpaceWeather {
    /// The same a_p at all times.
    #[must_use]
    pub fn steady(f107: f64, f107_mean: f64, ap: f64) -> Self {
        Self { f107, f107_mean, ap: [ap; 7] }
    }
}

/// The model, for one space weather.
pub struct Msis {
    model: Nrlmsise00<ConstantWeather>,
    weather: SpaceWeather,
}

/// What the model says at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MsisAir {
    /// ρ, with anomalous oxygen, kg/m³.
    pub density: f64,
    /// Temperature, K.
    pub temperature: f64,
    /// Number densities of He, O, N₂, O₂, Ar, H, N, anomalous O, 1/m³.
    pub species: [f64; 8],
}

impl Msis {
    /// For a space weather.
    ///
    /// # Errors
    /// Flux or a_p below zero, numbers not finite.
    pub fn new(weather: SpaceWeather) -> Result<Self, WorldError> {
        for f in [weather.f107, weather.f107_mean] {
            number("f107", f, |x| x > 0.0, "a flux from 60 to 400")?;
        }
        for ap in weather.ap {
            number("ap", ap, |x| x >= 0.0, "0 to 400")?;
        }
        let constant = ConstantWeather::new(weather.f107, weather.ap[0]);
        Ok(Self { model: Nrlmsise00::new(constant), weather })
    }

    /// Air at a geodetic place of WGS 84 and an epoch; 80 to 1000 km. Some microseconds. Local time is that
    /// of the longitude, as the model's authors take it.
    ///
    /// # Errors
    /// Altitudes outside of 80 to 2000 km.
    pub fn at(&self, epoch: &Epoch, place: &Geodetic) -> Result<MsisAir, WorldError> {
        let help = "80 to 2000 km here; take Us76 below";
        number("altitude, m", place.altitude, |h| (8e4..=2e6).contains(&h), help)?;
        let (day_of_year, ut_seconds) = epoch.utc_day_and_second();
        let longitude_deg = place.longitude.to_degrees();
        let hours = ut_seconds / 3600.0 + longitude_deg / 15.0;
        let out = self.model.calculate(&Nrlmsise00Input {
            day_of_year,
            ut_seconds,
            altitude_km: place.altitude / 1000.0,
            latitude_deg: place.latitude.to_degrees(),
            longitude_deg,
            local_solar_time_hours: hours.rem_euclid(24.0),
            f107_daily: self.weather.f107,
            f107_avg: self.weather.f107_mean,
            ap_daily: self.weather.ap[0],
            ap_array: self.weather.ap,
        });
        let per_m3 = [
            out.density_he,
            out.density_o,
            out.density_n2,
            out.density_o2,
            out.density_ar,
            out.density_h,
            out.density_n,
            out.density_anomalous_o,
        ];
        Ok(MsisAir {
            density: out.total_mass_density,
            temperature: out.temp_alt,
            species: per_m3.map(|n| n * 1e6),
        })
    }
}
