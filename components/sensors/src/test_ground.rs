//! A soil and a slope for the tests of this crate.
use linkwork_surroundings::prelude::*;
use linkwork_surroundings::testing::Plane;

/// Firm soil of no particular kind, because sensors do not use it.
pub(crate) fn firm() -> Soil {
    Soil {
        n: 1.0,
        n1: 0.0,
        k_c: 0.0,
        k_phi: 1e6,
        cohesion: 0.0,
        friction_angle: 0.5,
        shear_modulus: 0.02,
        a0: 0.4,
        a1: 0.1,
        lambda: 0.5,
        density: 1500.0,
        friction: 0.7,
    }
}

/// Ground that rises towards +x by a quarter, as far as `half` (m) from the origin.
pub(crate) fn slope(half: f64) -> Handle<dyn Terrain> {
    Plane { slope: 0.25, half, soil: firm(), ..Plane::default() }.handle()
}

/// The slope with rocks that it lists.
pub(crate) fn strewn(rocks: Vec<Rock>) -> Handle<dyn Terrain> {
    Plane { slope: 0.25, soil: firm(), rocks, ..Plane::default() }.handle()
}
