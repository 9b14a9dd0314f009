//! Aerodynamics: forces and moments of the air on a body, by tables, files, closed forms and panels; heating.
//!
//! Body axes are x forward, y to the right, z down; a node with these axes is bound. Angles are those of
//! the velocity through the air: α = atan2(w, u), β = asin(v/V), α_t = acos(u/V).

pub mod air_data;
pub mod axisymmetric;
pub mod dave;
pub mod dave_model;
pub mod entry;
pub mod gusts;
pub mod panels;
pub mod rarefied;
pub mod rate_damping;
pub mod sphere_cone;
pub mod sphere_cone_shell;

pub use air_data::{AirData, gusty};
