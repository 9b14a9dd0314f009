//! Surroundings of machines: terrain, gravity, atmosphere, Sun and the world of a simulation.
//!
//! Each kind of service is a trait: [`Terrain`], [`Gravity`], [`Atmosphere`], [`Sun`], [`World`]. A part provides a service, and models query it at
//! points. The crate `linkwork-environment` has the implementations. [`Scenery`] holds the visible shapes of bodies, for cameras and lidars.
// This crate uses the mathematical functions of `linkwork-maths`, bit-identical on every machine.
extern crate linkwork_maths as _;

mod contradictions;
mod environment;
mod scenery;
mod site;
mod start;
pub mod testing;
mod vertical;
mod world;

pub use contradictions::site_of;
pub use environment::{
    Air, Atmosphere, Gravity, Ground, Light, Rock, SOLAR_CONSTANT, SPEED_OF_LIGHT, ShadowEdges,
    Soil, Sun, SunState, Surface, Terrain,
};
pub use scenery::{PLAIN, Scenery, Sight};
pub use site::{Axes, Site};
pub use start::{Anomaly, BodyStart, Start, StartFrame, TwoLineSource};
pub use vertical::{Vertical, needs_level_ground};
pub use world::{Geographic, PlainWorld, World};

/// Names that authors of models import: the prelude of the runtime, and the services of this crate.
pub mod prelude {
    pub use crate::{
        Air, Atmosphere, Axes, Geographic, Gravity, Ground, Light, Rock, Scenery, ShadowEdges,
        Site, Soil, Sun, SunState, Surface, Terrain, Vertical, World,
    };
    pub use linkwork_runtime::prelude::*;
}
