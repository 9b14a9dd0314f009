//! Radiation pressure on spacecraft, as a sphere or as flat panels, with the shadows of bodies.
//!
//! Direction, distance and shadow come from [`Sun::light`] at the position, which solar panels and sun sensors use, too.

pub mod ball;
pub mod panels;

use linkwork_surroundings::prelude::*;

/// Edges at which the light begins to fade and at which it ends.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Edges {
    /// Angle to the outer edge of the penumbra, positive in the light.
    #[port("rad")]
    pub penumbra: f64,
    /// Angle to the umbra (or the antumbra), negative inside.
    #[port("rad")]
    pub umbra: f64,
}

impl Edges {
    fn of(light: &Light) -> Edges {
        Edges { penumbra: light.penumbra, umbra: light.umbra }
    }
}
