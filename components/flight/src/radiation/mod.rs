//! Light that presses on spacecraft: on a ball, on flat panels; in the sunlight and in the shadow of a planet.

pub mod ball;
pub mod panels;

use linkwork_runtime::prelude::*;
use linkwork_world::eclipse::Discs;
use linkwork_world::planet::{AU, RADIUS_SUN};

/// Where the light begins to fade and where it ends.
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
    fn of(discs: &Discs) -> Edges {
        Edges { penumbra: discs.penumbra_edge(), umbra: discs.umbra_edge() }
    }
}

/// The Sun at the time `t` (s) from the origin of W (m), and its disc with that of a planet there in the sky over `r` (m, W).
fn look(sun: &dyn Sun, planet_radius: f64, t: f64, r: Vec3) -> (Vec3, Discs) {
    let sun = sun.state(t);
    let s = sun.direction * (sun.distance_au * AU);
    (s, Discs::seen(&r, &s, planet_radius, RADIUS_SUN))
}
