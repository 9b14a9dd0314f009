//! Light: visible fraction of the Sun past a planet, solar radiation pressure, and light reflected by the planet.

mod albedo;
mod pressure;
mod shadow;

pub use albedo::planet_light;
pub use pressure::{PRESSURE_AU, cannonball, plate, pressure};
pub use shadow::{Discs, visible_fraction};
