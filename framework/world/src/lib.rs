//! Planetary environment: shape, rotation, time, gravity, atmosphere, light, and ephemerides.
//!
//! This crate contains pure functions and constant data. Units are SI and radians. Frames are as in `framework/NOTATION.md`: `p_AB` points from A to B in
//! A, and `R_AB` takes coordinates in B to coordinates in A. Frames of this crate:
//! ```text
//! I    inertial, axes of the ICRF (GCRS about the Earth), origin at the planet's centre
//! P    fixed to the planet: z along its axis of rotation, x through its prime meridian
//! E    at a site on P: x east, y north, z up (along the normal of the ellipsoid)
//! ```
//! Example: a lander next to a rock on Mars, and the forces on it:
//! ```
//! use linkwork_world::atmosphere::mars_simple;
//! use linkwork_world::gravity::{Coefficients, Harmonics};
//! use linkwork_world::planet::{Ellipsoid, Epoch, Geodetic, PointMotion, Rotation, Site};
//! use linkwork_world::spatial::Vec3;
//!
//! # fn main() -> Result<(), linkwork_world::WorldError> {
//! let epoch = Epoch::parse("2012-08-06 05:17:57 UTC")?;
//! let rotation = Rotation::mars(&epoch);
//! let site = Site::new(&Ellipsoid::mars(), Geodetic::from_degrees(-4.5895, 137.4417, -4501.0), 0.0);
//! let field = Harmonics::new(&Coefficients::zonal(4.2828375e13, 3.39619e6, &[1.9566e-3])?);
//!
//! // The lander, two metres up, falls at 0.75 m/s; t in seconds from the epoch.
//! let falls = PointMotion { position: Vec3::new(5.0, 0.0, 2.0), velocity: Vec3::new(0.0, 0.0, -0.75) };
//! let spin = rotation.at(12.5);
//! let inertial = site.motion(&spin).to_outer(&falls);
//! let gravity = spin.R_IP * field.acceleration(&(spin.R_IP.inverse() * inertial.position));
//! assert!((gravity.norm() - 3.73).abs() < 0.01);
//! assert!((mars_simple(site.place.altitude).density - 0.0221).abs() < 0.0001);
//! // And back: nothing is lost on the way over 3400 km.
//! let again = site.motion(&spin).to_inner(&inertial);
//! assert!((again.position - falls.position).norm() < 2e-9);
//! # Ok(())
//! # }
//! ```
#![allow(non_snake_case)]

pub mod atmosphere;
mod daf;
pub mod eclipse;
pub mod ephemeris;
pub mod error;
pub mod gravity;
pub mod magnetic;
pub mod orbit;
pub mod planet;

pub use error::WorldError;
pub use linkwork_spatial as spatial;
