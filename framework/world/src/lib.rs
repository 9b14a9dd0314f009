//! Planets and what surrounds them: shape, rotation, time, gravity, air, light, and where the others are.
//!
//! Pure functions and constant data. SI and radians; frames as in `framework/NOTATION.md`: `p_AB` from A to B
//! in A, `R_AB` takes coordinates in B to coordinates in A. Frames of this crate:
//! ```text
//! I    inertial, axes of the ICRF (GCRS about the Earth), origin at the planet's centre
//! P    fixed to the planet: z along its axis of rotation, x through its prime meridian
//! E    at a site on P: x east, y north, z up (along the normal of the ellipsoid)
//! ```
#![allow(non_snake_case)]

pub mod atmosphere;
pub mod eclipse;
pub mod ephemeris;
pub mod error;
pub mod gravity;
pub mod orbit;
pub mod planet;

pub use error::WorldError;
pub use linkwork_spatial as spatial;
