//! `world` of a simulation: the central body with its constants and rotation, the date, and the type of the frame W.
//! ```text
//! W = I     inertial axes, origin at the body's centre; t = 0 is the epoch, t counts seconds of TT
//! p_P = R_IPᵀ p_I                       fixed: R_IP = R_z(angle + rate t)
//!                                       iau:   Earth IAU 2006/2000A (W = GCRS), Mars and Moon IAU 2009 (W = ICRF)
//! v_air = ω_I × p_I + R_IP R_PE w       w: wind over the ground, east-north-up
//! ```
//! With a site, W is not inertial: it is fixed to the planet and rotates with it (x east, y north, z up at a position on the ellipsoid). Field and
//! air are then those of the planet's own axes, gravity has its centrifugal part, and air at rest has no velocity in W:
//! ```text
//! p_P = X_PW p      a = R_WP g(p_P) − ω × (ω × (p − c))      v_air = R_WP R_PE w
//! R_IW = R_IP(0) R_z(rate t) R_PW       directions of stars, the Sun and third bodies
//! ```
//! A site rotates about one axis at a constant rate. With `turns: iau` these are the pole and the rate at t = 0; the true ones deviate from them by
//! 3e-8 rad (Mars), 7e-7 rad (the Earth) and 2e-4 rad (the Moon, because of its libration) within a day.
//! With `turning: false` the site is level ground: centrifugal and Coriolis accelerations are left out, and only the directions of the Sun
//! and the stars rotate.
//!
//! Gravity parameters: the Earth with its air from the IERS Conventions (2010), Mars and the Moon from JPL.

mod body;
mod ephemerides;
mod params;
mod service;
mod start;

pub use body::Centre;
pub use params::{DensityLayer, Planet, SiteParams, Turning, WindLayer, WorldParams};
pub(crate) use params::{around, fault, gradient_around};
pub use service::{Inner, PlanetWorld};

/// A world for tests.
#[cfg(test)]
pub(crate) fn handle(p: WorldParams) -> linkwork_runtime::Handle<dyn linkwork_surroundings::World> {
    PlanetWorld::handle(p, &linkwork_runtime::Files::default()).map_err(|e| e.message).unwrap()
}

#[cfg(test)]
mod tests;
