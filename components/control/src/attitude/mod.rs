//! Attitude of a spacecraft: pointing and slews, jets with pulses, throttled engines, desaturation of wheels, estimation.

pub mod estimator;
pub mod jets;
pub mod momentum;
pub mod phase_plane;
pub mod pointing;
pub mod throttles;
