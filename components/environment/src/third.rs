//! Third bodies: Sun, Moon and planets as third bodies whose gravity acts and that cast shadows.
use linkwork_surroundings::prelude::*;
use linkwork_world::ephemeris::Body;
use linkwork_world::planet::{MU_EARTH, MU_JUPITER, MU_MARS, MU_MOON, MU_SUN, MU_VENUS};

/// Third bodies.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Third {
    /// The Sun.
    Sun,
    /// The Moon.
    Moon,
    /// The Earth.
    Earth,
    /// Venus.
    Venus,
    /// Mars.
    Mars,
    /// Jupiter and its moons.
    Jupiter,
}

impl Third {
    /// Returns the equatorial radius (m, IAU); `None` for the Sun, which casts no shadow.
    pub(crate) fn radius(self) -> Option<f64> {
        match self {
            Third::Sun => None,
            Third::Moon => Some(1.7374e6),
            Third::Earth => Some(6.378_136_6e6),
            Third::Venus => Some(6.0518e6),
            Third::Mars => Some(3.396_19e6),
            Third::Jupiter => Some(7.1492e7),
        }
    }

    /// Returns the body of the ephemerides, and its μ, m³/s².
    pub(crate) fn body(self) -> (Body, f64) {
        match self {
            Third::Sun => (Body::Sun, MU_SUN),
            Third::Moon => (Body::Moon, MU_MOON),
            Third::Earth => (Body::Earth, MU_EARTH),
            Third::Venus => (Body::Venus, MU_VENUS),
            Third::Mars => (Body::Mars, MU_MARS),
            Third::Jupiter => (Body::Jupiter, MU_JUPITER),
        }
    }
}
