//! A soil for tests of parts that observe the ground but do not touch it.

use linkwork_surroundings::prelude::Soil;

/// Firm soil for tests whose result does not depend on the soil.
pub fn firm() -> Soil {
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
