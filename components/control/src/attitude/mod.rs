//! Attitude of a spacecraft: pointing and slews, jets by pulses, engines by throttles, wheels that are full, estimation.

pub mod estimator;
pub mod jets;
pub mod momentum;
pub mod phase_plane;
pub mod pointing;
pub mod throttles;
