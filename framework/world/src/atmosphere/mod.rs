//! Atmosphere: density, temperature, pressure, speed of sound and viscosity over altitude, winds and gusts.
//!
//! Altitudes are *geometric*, in metres, above the ellipsoid or mean sea level depending on the model. Where a source has geopotential altitude it is
//! converted, and the documentation says so.

mod climate;
mod dryden;
mod dryden_rates;
mod exponential;
mod gas;
mod mars;
mod msis;
mod profile;
mod table;
mod us76;
mod viscosity;

pub use climate::{Climate, ClimateEntry};
pub use dryden::{Dryden, DrydenState, Turbulence};
pub use dryden_rates::DrydenRates;
pub use exponential::Exponential;
pub use gas::{Air, Gas, dynamic_pressure, mach};
pub use mars::mars_simple;
pub use msis::{Magnetic, Msis, MsisAir, SpaceWeather};
pub use profile::{Profile, wind_from};
pub use table::{AltitudeKind, Layout, Outside, Table};
pub use us76::{Us76, geometric_altitude, geopotential_altitude};
pub use viscosity::Sutherland;
