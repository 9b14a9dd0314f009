//! `sensors.relative_motion`: the exact motion of a node relative to another node, for controllers that are tested without an instrument.
//! ```text
//! p = R_Rᵀ (p_M − p_R)        R = R_Rᵀ R_M        v = R_Rᵀ (v_M − v_R − ω_R × (p_M − p_R))        ω = R_Rᵀ (ω_M − ω_R)
//! rate = Rᵀ ω                 M: mount, R: reference; v = dp/dt
//! ```
//! `sensors.motion` reads the motion of one node relative to W.

use linkwork_runtime::prelude::*;

/// The nodes.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RelativeMotionIn {
    /// The node that is observed.
    #[port(bind = "mount")]
    pub mount: NodeState,
    /// The node relative to which it is observed.
    #[port(bind = "reference")]
    pub reference: NodeState,
}

/// Motion of the mount relative to the reference.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RelativeMotionOut {
    /// Position relative to the reference, axes of the reference.
    #[port("m")]
    pub position: Vec3,
    /// Rate of change of `position`.
    #[port("m/s")]
    pub velocity: Vec3,
    /// Attitude, mount to reference.
    #[port]
    pub attitude: Quat,
    /// Angular velocity relative to the reference, axes of the reference.
    #[port("rad/s")]
    pub angular_velocity: Vec3,
    /// Angular velocity relative to the reference, axes of the mount.
    #[port("rad/s")]
    pub rate: Vec3,
    /// Direction of the mount's x axis, axes of the reference.
    #[port("1")]
    pub x_axis: Vec3,
    /// Direction of the mount's y axis, axes of the reference.
    #[port("1")]
    pub y_axis: Vec3,
    /// Direction of the mount's z axis, axes of the reference.
    #[port("1")]
    pub z_axis: Vec3,
}

/// Exact relative motion.
pub struct RelativeMotion {}

/// Position, attitude and velocities of a node relative to another node, exact and continuous.
#[model("sensors.relative_motion")]
impl Model for RelativeMotion {
    type FeedthroughInputs = RelativeMotionIn;
    type FeedthroughOutputs = RelativeMotionOut;
    fn feedthrough(&self, u: &RelativeMotionIn) -> RelativeMotionOut {
        let (mount, reference) = (&u.mount, &u.reference);
        let back = reference.rotation.inverse();
        let arm = mount.position - reference.position;
        let drift = mount.velocity - reference.velocity - reference.angular.cross(&arm);
        let attitude = back * mount.rotation;
        let angular_velocity = back * (mount.angular - reference.angular);
        RelativeMotionOut {
            position: back * arm,
            velocity: back * drift,
            attitude,
            angular_velocity,
            rate: attitude.inverse() * angular_velocity,
            x_axis: attitude * Vec3::x(),
            y_axis: attitude * Vec3::y(),
            z_axis: attitude * Vec3::z(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(at: [f64; 3], turn: [f64; 3]) -> NodeState {
        NodeState {
            position: Vec3::from(at),
            rotation: Quat::from_scaled_axis(Vec3::from(turn)),
            angular: Vec3::new(0.3, -1.1, 0.7) * at[0],
            velocity: Vec3::new(-0.2, 0.9, 1.3) * at[1],
        }
    }

    /// The state after `t` s at constant velocities.
    fn later(n: &NodeState, t: f64) -> NodeState {
        let rotation = Quat::from_scaled_axis(n.angular * t) * n.rotation;
        NodeState { position: n.position + n.velocity * t, rotation, ..*n }
    }

    #[test]
    fn velocities_are_the_derivatives_of_position_and_attitude() {
        let (mount, reference) =
            (node([1.2, -0.7, 0.4], [0.3, 0.8, -0.5]), node([-0.6, 0.5, 2.0], [-0.9, 0.2, 0.4]));
        let read = |t: f64| {
            let (mount, reference) = (later(&mount, t), later(&reference, t));
            RelativeMotion {}.feedthrough(&RelativeMotionIn { mount, reference })
        };
        let (y, h) = (read(0.0), 1e-5);
        let (before, after) = (read(-h), read(h));
        // The differences agree to 1e-10.
        let slope = (after.position - before.position) / (2.0 * h);
        assert!((y.velocity - slope).norm() < 1e-8, "{} {slope}", y.velocity);
        let turn = (after.attitude * before.attitude.inverse()).scaled_axis() / (2.0 * h);
        assert!((y.angular_velocity - turn).norm() < 1e-8, "{} {turn}", y.angular_velocity);
        assert!((y.attitude * y.rate - turn).norm() < 1e-8);
        let axes = [y.x_axis, y.y_axis, y.z_axis];
        for (k, axis) in axes.iter().enumerate() {
            let matrix = y.attitude.to_rotation_matrix();
            assert!((axis - matrix.matrix().column(k)).norm() < 1e-15);
        }
    }

    #[test]
    fn a_node_rests_relative_to_a_node_of_the_same_body() {
        let reference = node([0.8, -0.3, 0.1], [0.1, -0.4, 0.9]);
        let arm = Vec3::new(0.2, 0.5, -0.7);
        let velocity = reference.velocity + reference.angular.cross(&(reference.rotation * arm));
        let position = reference.position + reference.rotation * arm;
        let mount = NodeState { position, velocity, ..reference };
        let y = RelativeMotion {}.feedthrough(&RelativeMotionIn { mount, reference });
        assert!((y.position - arm).norm() < 1e-15 && y.velocity.norm() < 1e-15);
        assert!(y.rate.norm() < 1e-15 && y.attitude.angle() < 1e-7);
    }
}
