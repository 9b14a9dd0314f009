//! Light that presses on spacecraft: on a ball, on flat panels; in the sunlight and in the shadow of bodies.
//!
//! Direction, distance and shadow are those of the light at the place ([`Sun::light`]), which solar panels and sun sensors have, too.

pub mod ball;
pub mod panels;

use linkwork_runtime::prelude::*;

/// Edges at which the light begins to fade and at which it ends.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Edges {
    /// Angle to the outer edge of the penumbra, above zero in the light.
    #[port("rad")]
    pub penumbra: f64,
    /// Angle to the umbra (or the ring), below zero inside.
    #[port("rad")]
    pub umbra: f64,
}

impl Edges {
    fn of(light: &Light) -> Edges {
        Edges { penumbra: light.penumbra, umbra: light.umbra }
    }
}
