//! Gravity: spherical harmonics, polyhedra, third bodies, tides, gravity-gradient torque.
//!
//! Positions are from the centre of the body and in its own axes unless the documentation says otherwise; accelerations are in the same axes.
//! Centrifugal terms of rotating axes are not included.

mod coefficients;
mod harmonics;
mod point;
pub mod polyhedron;
mod read;
mod third_body;
mod tide;

pub use coefficients::{Coefficients, DEGREE_MAX, TideSystem, normalisation};
pub use harmonics::{Gravity, Harmonics};
pub use point::{point_mass, point_mass_gradient, torque, zonal, zonal_gradient};
pub use read::{Format, Keep, read};
pub use third_body::{indirect, third_body, third_body_gradient};
pub use tide::{TideRaiser, solid_tide, solid_tide_coefficients, solid_tide_gradient};
