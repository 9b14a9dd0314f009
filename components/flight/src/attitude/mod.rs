//! Torques on a spacecraft: reaction wheels, control moment gyros, magnetic torquers, gimballed engines, gravity gradient.

pub mod bank_control;
pub mod control_moment_gyro;
pub mod gravity_gradient;
pub mod magnetic;
pub mod reaction_wheel;
pub mod thrust_vector;

use linkwork_surroundings::prelude::*;

/// Angular velocity (rad/s, W) of W in inertial space: of the site that W is, or none.
fn turning(world: Option<&Handle<dyn World>>) -> Vec3 {
    world.and_then(|w| w.axes().site()).map_or_else(Vec3::zeros, |s| s.omega())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use linkwork_surroundings::PlainWorld;

    /// A site on a planet that rotates fast, and its world.
    pub fn fast_site() -> (Site, Handle<dyn World>) {
        let pose = linkwork_spatial::Pose::new(
            Quat::from_euler_angles(0.3, -0.8, 1.1),
            Vec3::new(2e6, -1e6, 2.4e6),
        );
        let start = Quat::from_euler_angles(-0.4, 0.2, 0.9);
        let site = Site { pose, rate: 0.05, start };
        (site, PlainWorld::of_site(4.3e13, 3.3e6, site).handle())
    }

    /// Returns a node that rotates in W at `omega` (rad/s, W), at time t.
    pub fn turning_node(omega: &Vec3, t: f64) -> NodeState {
        let rotation = Quat::from_scaled_axis(omega * t) * Quat::from_euler_angles(0.2, 0.5, -1.0);
        NodeState { rotation, angular: *omega, ..NodeState::identity() }
    }

    #[test]
    fn the_turning_is_that_of_inertial_axes() {
        let (site, world) = fast_site();
        let h = 1e-4;
        // Compute the rotation rate of the axes of W relative to inertial axes by differences.
        let turned = site.to_inertial(-h).inverse() * site.to_inertial(h);
        let rate = turned.scaled_axis() / (2.0 * h);
        assert!((rate - turning(Some(&world))).norm() < 1e-9, "{rate}");
        assert_eq!(turning(None), Vec3::zeros());
    }
}
