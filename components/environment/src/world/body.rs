//! Central bodies of a world, with their constants.

use crate::third::Third;
use linkwork_runtime::prelude::*;
use linkwork_world::ephemeris::Body;
use linkwork_world::planet::{Ellipsoid, MU_MOON};

/// Central bodies of a simulation.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Centre {
    /// The Earth.
    Earth,
    /// Mars.
    Mars,
    /// The Moon.
    Moon,
    /// Another body, whose constants are all written in the file.
    Other,
}

impl Centre {
    /// Returns the name in files.
    pub fn word(self) -> &'static str {
        match self {
            Centre::Earth => "earth",
            Centre::Mars => "mars",
            Centre::Moon => "moon",
            Centre::Other => "other",
        }
    }

    /// Returns the body of the ephemerides; `None` for another body.
    pub fn body(self) -> Option<Body> {
        match self {
            Centre::Earth => Some(Body::Earth),
            Centre::Mars => Some(Body::Mars),
            Centre::Moon => Some(Body::Moon),
            Centre::Other => None,
        }
    }

    /// Mean sidereal rate, rad/s: IERS; IAU 2009 (350.89198226 and 13.17635815 deg/day).
    pub fn rate(self) -> Option<f64> {
        match self {
            Centre::Earth => Some(7.292_115e-5),
            Centre::Mars => Some(350.891_982_26_f64.to_radians() / 86_400.0),
            Centre::Moon => Some(13.176_358_15_f64.to_radians() / 86_400.0),
            Centre::Other => None,
        }
    }

    /// Gravity parameter, m³/s².
    pub fn mu(self) -> Option<f64> {
        match self {
            Centre::Earth => Some(3.986_004_418e14),
            Centre::Mars => Some(4.282_837_521_4e13),
            Centre::Moon => Some(MU_MOON),
            Centre::Other => None,
        }
    }

    /// Ellipsoid for heights.
    pub fn ellipsoid(self) -> Option<Ellipsoid> {
        match self {
            Centre::Earth => Some(Ellipsoid::wgs84()),
            Centre::Mars => Some(Ellipsoid::mars()),
            Centre::Moon => Some(Ellipsoid::moon()),
            Centre::Other => None,
        }
    }

    /// Returns the semi-major axis of its orbit about the Sun, AU (Standish's elements at J2000).
    pub fn sun_distance(self) -> Option<f64> {
        match self {
            Centre::Earth | Centre::Moon => Some(1.000_002_61),
            Centre::Mars => Some(1.523_710_34),
            Centre::Other => None,
        }
    }

    /// Returns the bodies that cast shadows near this body by default.
    pub(super) fn neighbours(self) -> &'static [Third] {
        match self {
            Centre::Earth => &[Third::Moon],
            Centre::Moon => &[Third::Earth],
            Centre::Mars | Centre::Other => &[],
        }
    }
}
