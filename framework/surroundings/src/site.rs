//! W as a site: a frame that is fixed to a planet and turns with it.
//! ```text
//! p_P = X_PW p                            P: axes fixed to the planet, origin at its centre
//! a   = R_WP g_P(p_P) − ω × (ω × (p − c)) − 2 ω × v       what a body in free fall does in W
//! ω   = R_WP ẑ rate                       of W in inertial space, constant in W;  c: the planet's centre in W
//! R_IW(t) = R_IP(0) R_z(rate t) R_PW      I: inertial axes at the planet's centre, those of stars and ephemerides
//! ```
//! Terrain, contact, hinges and velocities are relative to the site, so that objects at rest on the ground have coordinates of some metres and zero
//! velocity. The field of a gravity service for a site ([`Gravity::site`]) includes the centrifugal acceleration; the mechanism adds the terms that
//! depend on motion, for each body with its own velocity and spin, exactly.
//!
//! [`Gravity::site`]: crate::Gravity::site
use linkwork_runtime::NodeState;
use linkwork_spatial::{Pose, Quat, Vec3};

/// Position of W on its planet, and the planet's rotation rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// `X_PW`: Pose of W in axes that are fixed to the planet, relative to its centre (m).
    pub pose: Pose,
    /// Rate of the planet about z of those axes, rad/s, east positive.
    pub rate: f64,
    /// `R_IP` at t = 0: rotation from those axes to inertial axes.
    pub start: Quat,
}

impl Site {
    /// ω: angular velocity of W in inertial space, W, rad/s.
    #[must_use]
    pub fn omega(&self) -> Vec3 {
        self.pose.rotation.inverse() * (Vec3::z() * self.rate)
    }

    /// Returns `R_IW` at t (s): rotation from W to inertial axes.
    #[must_use]
    pub fn to_inertial(&self, t: f64) -> Quat {
        let turned = Quat::from_scaled_axis(Vec3::z() * (self.rate * t));
        self.start * turned * self.pose.rotation
    }

    /// Returns east at the origin of W as a horizontal unit vector in W; x if the origin is at a pole.
    #[must_use]
    pub fn east(&self) -> Vec3 {
        let across = self.from_planet_axes(&Vec3::z()).cross(&Vec3::z());
        if across.norm() > 1e-9 { across.normalize() } else { Vec3::x() }
    }

    /// Returns the vector from the planet's centre to `p`, both in W, m.
    #[must_use]
    pub fn relative_to_centre(&self, p: &Vec3) -> Vec3 {
        p + self.pose.rotation.inverse() * self.pose.position
    }

    /// Returns the position of a point in W relative to the centre of the planet, axes of the planet, m.
    #[must_use]
    pub fn to_planet(&self, p: &Vec3) -> Vec3 {
        self.pose.transform_point(p)
    }

    /// Transforms a vector from the planet's axes to W.
    #[must_use]
    pub fn from_planet_axes(&self, v: &Vec3) -> Vec3 {
        self.pose.rotation.inverse() * v
    }

    /// Returns the state of a node relative to the rotating planet and its centre, in the planet's axes.
    #[must_use]
    pub fn around_planet(&self, node: &NodeState) -> NodeState {
        let turn = self.pose.rotation;
        NodeState {
            position: self.to_planet(&node.position),
            rotation: turn * node.rotation,
            angular: turn * node.angular,
            velocity: turn * node.velocity,
        }
    }

    /// −ω × (ω × (p − c)) at p (m), W: the centrifugal acceleration, m/s².
    #[must_use]
    pub fn centrifugal(&self, p: &Vec3) -> Vec3 {
        let omega = self.omega();
        -omega.cross(&omega.cross(&self.relative_to_centre(p)))
    }
}

/// Type of W that a service requires.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Axes {
    /// Any type of W.
    Any,
    /// Inertial axes with a planet at the origin.
    Inertial,
    /// A site that rotates with its planet.
    Site(Site),
    /// A position on a planet whose rotation is omitted from the dynamics: level ground, z up.
    Level(Site),
}

impl Axes {
    /// Returns the axes of a site, or inertial axes without a site.
    #[must_use]
    pub fn of(site: Option<Site>) -> Axes {
        site.map_or(Axes::Inertial, Axes::Site)
    }

    /// Returns the site, if W rotates with the planet.
    #[must_use]
    pub fn site(self) -> Option<Site> {
        if let Axes::Site(s) = self { Some(s) } else { None }
    }

    /// Returns the position of W on a planet, whether or not the rotation acts in the dynamics.
    #[must_use]
    pub fn place(self) -> Option<Site> {
        if let Axes::Site(s) | Axes::Level(s) = self { Some(s) } else { None }
    }
}
