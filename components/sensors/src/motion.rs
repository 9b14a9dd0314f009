//! `sensors.motion`: the exact motion of a node, for controllers that are tested without an estimator.
//! ```text
//! rate, body velocity in the node's axes:  Rᵀ ω_W,  Rᵀ v_W        axes of the node in W: columns of R
//! ```

use linkwork_runtime::prelude::*;

/// The node.
#[derive(Ports, Clone, Copy, Debug)]
pub struct MotionIn {
    /// The node.
    #[port(bind = "mount")]
    pub mount: NodeState,
}

/// Its motion.
#[derive(Ports, Clone, Copy, Debug)]
pub struct MotionOut {
    /// Position, W.
    #[port("m")]
    pub position: Vec3,
    /// Velocity, W.
    #[port("m/s")]
    pub velocity: Vec3,
    /// Attitude, node to W.
    #[port]
    pub attitude: Quat,
    /// Angular rate, node's axes.
    #[port("rad/s")]
    pub rate: Vec3,
    /// Velocity, node's axes.
    #[port("m/s")]
    pub body_velocity: Vec3,
    /// Angular rate, W.
    #[port("rad/s")]
    pub angular_velocity: Vec3,
    /// Direction of the node's x axis, W.
    #[port("1")]
    pub x_axis: Vec3,
    /// Direction of the node's y axis, W.
    #[port("1")]
    pub y_axis: Vec3,
    /// Direction of the node's z axis, W.
    #[port("1")]
    pub z_axis: Vec3,
}

/// Exact motion.
pub struct Motion {}

/// Position, attitude and velocities of a node, exact and continuous.
#[model("sensors.motion")]
impl Model for Motion {
    type FeedthroughInputs = MotionIn;
    type FeedthroughOutputs = MotionOut;
    fn feedthrough(&self, u: &MotionIn) -> MotionOut {
        let NodeState { position, rotation, angular, velocity } = u.mount;
        let back = rotation.inverse();
        MotionOut {
            position,
            velocity,
            attitude: rotation,
            rate: back * angular,
            body_velocity: back * velocity,
            angular_velocity: angular,
            x_axis: rotation * Vec3::x(),
            y_axis: rotation * Vec3::y(),
            z_axis: rotation * Vec3::z(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_have_the_axes_of_the_node() {
        let mut mount = NodeState::identity();
        mount.rotation = Quat::from_axis_angle(&Vec3::z_axis(), std::f64::consts::FRAC_PI_2);
        mount.angular = Vec3::new(0.0, 2.0, 0.5);
        mount.velocity = Vec3::new(-3.0, 0.0, 1.0);
        let y = Motion {}.feedthrough(&MotionIn { mount });
        assert!((y.rate - Vec3::new(2.0, 0.0, 0.5)).norm() < 1e-15);
        assert!((y.body_velocity - Vec3::new(0.0, 3.0, 1.0)).norm() < 1e-15);
        assert_eq!((y.attitude, y.velocity), (mount.rotation, mount.velocity));
        assert_eq!((y.angular_velocity, y.z_axis), (mount.angular, Vec3::z()));
        assert!((y.x_axis - Vec3::y()).norm() < 1e-15 && (y.y_axis + Vec3::x()).norm() < 1e-15);
    }
}
