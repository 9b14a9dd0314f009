//! Light: how much of the Sun is seen past a planet, and how it presses.

mod pressure;
mod shadow;

pub use pressure::{PRESSURE_AU, cannonball, plate, pressure};
pub use shadow::{Discs, visible_fraction};
