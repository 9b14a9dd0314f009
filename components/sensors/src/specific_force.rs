//! `sensors.specific_force`: the exact specific force at a node, for controllers that are tested without an inertial measurement unit.
//! ```text
//! f = Rᵀ (a − g)      a: acceleration of the node, g: of free fall there; 0 without gravity
//! ```
//! At rest it is +g upwards. `sensors.imu` has the errors of an instrument.

use linkwork_surroundings::prelude::*;

/// Gravity.
#[derive(Params, Clone, Debug)]
pub struct SpecificForceParams {
    /// Gravity; without it the acceleration is the specific force.
    #[param(service)]
    pub gravity: Option<Handle<dyn Gravity>>,
}

/// The node.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SpecificForceIn {
    /// Pose and velocity.
    #[port(bind = "mount")]
    pub mount: NodeState,
    /// Acceleration.
    #[port(bind = "mount")]
    pub motion: NodeAccel,
}

/// The force.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SpecificForceOut {
    /// Specific force, axes of the node.
    #[port("m/s^2")]
    pub force: Vec3,
    /// Specific force, W.
    #[port("m/s^2")]
    pub world_force: Vec3,
    /// Angular acceleration, W.
    #[port("rad/s^2")]
    pub angular_acceleration: Vec3,
}

/// Exact specific force.
pub struct SpecificForce {
    p: SpecificForceParams,
}

/// Specific force at a node, exact and continuous.
#[model("sensors.specific_force")]
impl Model for SpecificForce {
    type Params = SpecificForceParams;
    type FeedthroughInputs = SpecificForceIn;
    type FeedthroughOutputs = SpecificForceOut;
    fn feedthrough(&self, clock: &Clock, u: &SpecificForceIn) -> SpecificForceOut {
        let NodeState { position, rotation, velocity, .. } = u.mount;
        let gravity = self.p.gravity.as_ref();
        let fall = gravity.map_or(Vec3::zeros(), |g| g.free_fall(clock.t, position, velocity));
        let world_force = u.motion.linear - fall;
        SpecificForceOut {
            force: rotation.inverse() * world_force,
            world_force,
            angular_acceleration: u.motion.angular,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::testing;

    #[test]
    fn a_node_at_rest_feels_its_weight_in_its_own_axes() {
        let mut mount = NodeState::identity();
        mount.rotation = Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::FRAC_PI_2);
        let motion = NodeAccel { angular: Vec3::zeros(), linear: Vec3::new(2.0, 0.0, 0.0) };
        let gravity = Some(testing::gravity(|_, _| Vec3::new(0.0, 0.0, -9.0)));
        let c = Clock::at(0.0, 0.1, 0);
        for (gravity, want) in
            [(gravity, Vec3::new(2.0, 9.0, 0.0)), (None, Vec3::new(2.0, 0.0, 0.0))]
        {
            let m = SpecificForce { p: SpecificForceParams { gravity } };
            let y = m.feedthrough(&c, &SpecificForceIn { mount, motion });
            assert!((y.force - want).norm() < 1e-14, "{}", y.force);
            assert!((y.world_force - mount.rotation * want).norm() < 1e-14, "{}", y.world_force);
        }
    }
}
