//! The world of a simulation: its central body with its constants, the date, and the type of the frame W.
//!
//! A simulation has at most one world (`world: (..)` in a file). Gravity, air, the Sun, shadows, navigation and every model that needs
//! a gravity parameter, a radius, a pole or a rate of rotation take it from here, so that parts cannot contradict each other.
//! ```text
//! W inertial   the body's centre is the origin of W
//! W a site     W stands on the body and turns with it: x east, y north, z up (or turned by a heading)
//! W level      a site whose rotation is left out of the dynamics: level ground, with the Sun of that place
//! no world     level ground without a planet, or empty space
//! ```
use crate::contradictions;
use crate::site::{Axes, Site};
use crate::start::Start;
use linkwork_runtime::{BuildError, Contradiction, Handle, Provided, Services};
use linkwork_spatial::{Quat, Vec3};
use std::any::Any;
use std::sync::Arc;

/// A place on a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geographic {
    /// Geodetic latitude (rad), north positive.
    pub latitude: f64,
    /// East longitude (rad), −π to π.
    pub longitude: f64,
    /// Height above the ellipsoid (m).
    pub altitude: f64,
}

/// The world of a simulation.
pub trait World: Send + Sync {
    /// Name of the central body: `earth`, `mars`, `moon`, `other`.
    fn body(&self) -> &str;
    /// Gravity parameter of the central body (m³/s²), if it is known.
    fn mu(&self) -> Option<f64>;
    /// Equatorial radius of the central body (m).
    fn radius(&self) -> f64;
    /// Flattening of its ellipsoid (1).
    fn flattening(&self) -> f64;
    /// The date of t = 0 as written, if there is one.
    fn epoch(&self) -> Option<&str> {
        None
    }
    /// Returns the type of W.
    fn axes(&self) -> Axes;
    /// Returns `R_WP` at t (s): rotation from the axes of the body to W.
    fn planet_axes(&self, t: f64) -> Quat;
    /// Returns the angular velocity (rad/s, W) of the body relative to W at t (s); zero if W is a site on it.
    fn planet_rate(&self, t: f64) -> Vec3;
    /// Returns the geographic position of p (m, W) at t (s); `None` near the centre, where the vertical is undefined.
    fn geographic(&self, t: f64, p: Vec3) -> Option<Geographic>;
    /// Returns the vector from the body's centre to `p` (m), both in W.
    fn relative_to_centre(&self, p: &Vec3) -> Vec3 {
        self.axes().place().map_or(*p, |s| s.relative_to_centre(p))
    }
    /// Returns position (m) and velocity (m/s) in W at t = 0 of a body with this start.
    ///
    /// # Errors
    /// The part of the start that has no meaning in this world, with the remedy.
    fn start(&self, _: &Start) -> Result<(Vec3, Vec3), BuildError> {
        let fact = "this world supports neither orbits nor named axes";
        Err(BuildError::new(fact).help("write `position` and `velocity` in W"))
    }
    /// Returns the reason for which the world cannot answer at simulated time t (s): the span that its data cover, and the remedy.
    fn failure(&self, _t: f64) -> Option<BuildError> {
        None
    }
    /// Returns the underlying type, for the library that provides it.
    fn as_any(&self) -> &dyn Any;
}

impl Provided for dyn World {
    const WORD: &'static str = "world";
    const FIRST: bool = true;
    fn missing() -> (String, String) {
        (
            "needs the central body, but the simulation has no `world`".into(),
            "write `world: (body: \"mars\")` in the simulation: earth, mars, moon or other; with `site` if W is a place on its ground".into(),
        )
    }
    fn failure(&self, t: f64) -> Option<BuildError> {
        World::failure(self, t)
    }
    fn rotates(&self) -> bool {
        self.axes().site().is_some()
    }
    fn contradictions(&self, path: &str, services: &Services) -> Vec<Contradiction> {
        contradictions::of_world(path, self.axes(), services).into_iter().collect()
    }
}

/// A body that rotates at a constant rate about z of its own axes, without a date; for programs and tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlainWorld {
    /// Gravity parameter (m³/s²).
    pub mu: f64,
    /// Radius (m) of the body, which is a sphere.
    pub radius: f64,
    /// Rate about z (rad/s); 0 if W is a site, because the rate of the site is used.
    pub rate: f64,
    /// `R_WP` at t = 0 where W is inertial.
    pub start: Quat,
    /// Returns the type of W.
    pub axes: Axes,
}

impl PlainWorld {
    /// A body whose axes coincide with an inertial W at t = 0.
    #[must_use]
    pub fn inertial(mu: f64, radius: f64, rate: f64) -> Self {
        PlainWorld { mu, radius, rate, start: Quat::identity(), axes: Axes::Inertial }
    }

    /// A body on which W is a site.
    #[must_use]
    pub fn of_site(mu: f64, radius: f64, site: Site) -> Self {
        PlainWorld { mu, radius, rate: 0.0, start: Quat::identity(), axes: Axes::Site(site) }
    }

    /// Returns the world as a service.
    #[must_use]
    pub fn handle(self) -> Handle<dyn World> {
        Handle::new("world", Arc::new(self) as Arc<dyn World>)
    }
}

impl World for PlainWorld {
    fn body(&self) -> &str {
        "other"
    }
    fn mu(&self) -> Option<f64> {
        Some(self.mu)
    }
    fn radius(&self) -> f64 {
        self.radius
    }
    fn flattening(&self) -> f64 {
        0.0
    }
    fn axes(&self) -> Axes {
        self.axes
    }
    fn planet_axes(&self, t: f64) -> Quat {
        match self.axes.place() {
            Some(site) => site.pose.rotation.inverse(),
            None => self.start * Quat::from_scaled_axis(Vec3::z() * (self.rate * t)),
        }
    }
    fn planet_rate(&self, _: f64) -> Vec3 {
        match self.axes.place() {
            Some(_) => Vec3::zeros(),
            None => self.start * (Vec3::z() * self.rate),
        }
    }
    fn geographic(&self, t: f64, p: Vec3) -> Option<Geographic> {
        let r = self.planet_axes(t).inverse() * self.relative_to_centre(&p);
        let distance = r.norm();
        (distance > 1.0).then(|| Geographic {
            latitude: (r.z / distance).clamp(-1.0, 1.0).asin(),
            longitude: r.y.atan2(r.x),
            altitude: distance - self.radius,
        })
    }
    fn as_any(&self) -> &dyn Any {
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_those_of_a_body_that_rotates() {
        let world = PlainWorld {
            start: Quat::from_scaled_axis(Vec3::x() * 0.5),
            ..PlainWorld::inertial(1.0, 1e6, 1e-3)
        };
        for (t, latitude, longitude) in [(0.0, 0.4, 1.0), (700.0, -0.9, -2.0)] {
            let in_planet = Vec3::new(
                f64::cos(latitude) * f64::cos(longitude),
                f64::cos(latitude) * f64::sin(longitude),
                f64::sin(latitude),
            );
            let p = world.planet_axes(t) * (in_planet * 1.5e6);
            let got = world.geographic(t, p).unwrap();
            assert!((got.latitude - latitude).abs() < 1e-12 && (got.altitude - 5e5).abs() < 1e-6);
            assert!((got.longitude - longitude).abs() < 1e-12);
            // `planet_rate` must be the rate of rotation of `planet_axes`.
            let turned = world.planet_axes(t + 0.5) * world.planet_axes(t - 0.5).inverse();
            assert!((turned.scaled_axis() - world.planet_rate(t)).norm() < 1e-12);
        }
        assert!(world.geographic(0.0, Vec3::zeros()).is_none());
    }
}
