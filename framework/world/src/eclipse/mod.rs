//! Light: how much of the Sun is seen past a planet, how it presses, and what the planet throws back.

mod albedo;
mod pressure;
mod shadow;

pub use albedo::planet_light;
pub use pressure::{PRESSURE_AU, cannonball, plate, pressure};
pub use shadow::{Discs, visible_fraction};
