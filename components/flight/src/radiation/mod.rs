//! Radiation pressure on spacecraft, as a sphere or as flat panels, with the shadows of bodies.
//!
//! Direction, distance and shadow come from [`Sun::light`] at the position, which solar panels and sun sensors use, too.
//!
//! [`Sun::light`]: linkwork_surroundings::Sun::light

pub mod ball;
pub mod panels;
