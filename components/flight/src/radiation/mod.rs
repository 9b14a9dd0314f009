//! Light that presses on spacecraft: on a ball, on flat panels; in the sunlight and in the shadow of a planet.
//!
//! The planet is at the origin of W, or its centre is where the site that W is says. The Sun is asked for in W, so that it turns there as
//! its service says: `environment.ephemeris_sun` and `environment.fixed_sun` with a `planet` let it stand among the stars.

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

/// What a body sees: all from the planet's centre, axes of W, m.
struct Sky {
    /// The body.
    body: Vec3,
    /// The Sun.
    sun: Vec3,
    /// Its disc and the planet's in the sky over the body.
    discs: Discs,
}

/// The sky at the time `t` (s) over `p` (m, W).
fn look(sun: &dyn Sun, site: Option<&Site>, planet_radius: f64, t: f64, p: &Vec3) -> Sky {
    let body = site.map_or(*p, |s| s.from_centre(p));
    let seen = sun.state(t);
    let sun = seen.direction * (seen.distance_au * AU);
    Sky { body, sun, discs: Discs::seen(&body, &sun, planet_radius, RADIUS_SUN) }
}
