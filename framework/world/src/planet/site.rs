//! A site: a frame on an ellipsoid that rotates with its planet.

use super::{Ellipsoid, FrameMotion, Geodetic, PointMotion, Spin, apparent_acceleration};
use linkwork_spatial::{Pose, Quat, Vec3, nalgebra};

/// A frame E fixed to a planet: x east, y north, z up, or rotated about the vertical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Geodetic position.
    pub place: Geodetic,
    /// `X_PE`: the site in the planet's axes.
    pub pose: Pose,
}

impl Site {
    /// Creates a site at a position of an ellipsoid; `heading` rotates x from east towards north, rad.
    #[must_use]
    pub fn new(ellipsoid: &Ellipsoid, place: Geodetic, heading: f64) -> Self {
        let turn = Quat::from_axis_angle(&nalgebra::Vector3::z_axis(), heading);
        let pose = Pose::new(place.east_north_up() * turn, ellipsoid.position(&place));
        Self { place, pose }
    }

    /// Returns the motion of the site in inertial axes about the planet's centre, given the planet's present rotation.
    #[must_use]
    pub fn motion(&self, spin: &Spin) -> FrameMotion {
        spin.motion().then(&FrameMotion::fixed(self.pose))
    }

    /// Returns the apparent acceleration in the site, m/s², axes of the site: Coriolis and centrifugal terms of the planet's rotation at ω_P (rad/s,
    /// the planet's axes, constant). Add it to the true acceleration. `point` is in the site. A plumb line shows the sum of this and gravity.
    #[must_use]
    pub fn apparent_acceleration(&self, omega_P: &Vec3, point: &PointMotion) -> Vec3 {
        let R = self.pose.rotation;
        let planet = PointMotion {
            position: self.pose.transform_point(&point.position),
            velocity: R * point.velocity,
        };
        R.inverse() * apparent_acceleration(omega_P, &planet)
    }

    /// Returns `X_EF`: the pose of another site of the same planet in this one, which is constant.
    #[must_use]
    pub fn other(&self, site: &Self) -> Pose {
        let R = self.pose.rotation.inverse();
        Pose::new(R * site.pose.rotation, R * (site.pose.position - self.pose.position))
    }

    /// Returns the position in the planet's axes of a point given in the site, m.
    #[must_use]
    pub fn to_planet(&self, p_EQ: &Vec3) -> Vec3 {
        self.pose.transform_point(p_EQ)
    }

    /// Returns the position in the site of a point given in the planet's axes, m.
    #[must_use]
    pub fn from_planet(&self, p_PQ: &Vec3) -> Vec3 {
        self.pose.rotation.inverse() * (p_PQ - self.pose.position)
    }
}
