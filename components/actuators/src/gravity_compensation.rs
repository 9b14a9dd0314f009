//! `actuators.gravity_compensation`: an ideal balancer that carries a fraction of the weight of a body at any pose.
//! ```text
//! F = −s m g(c)        at the centre of mass c;   s: share
//! ```
//! A fraction of 1 removes the weight of the body, like `<gravity>false</gravity>` of an SDF link; `gravcomp` of MJCF is this fraction. The weight of
//! mass that wires add is not carried.

use linkwork_surroundings::prelude::*;

/// Share of the weight.
#[derive(Params, Clone, Debug)]
pub struct GravityCompensationParams {
    /// Fraction of the weight that is carried; above 1 the body rises.
    #[param(default = 1.0)]
    pub share: f64,
    /// Gravity; without it bodies have no weight.
    #[param(service)]
    pub gravity: Option<Handle<dyn Gravity>>,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GravityCompensationIn {
    /// The body.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Its mass.
    #[port(bind = "body")]
    pub own: BodyMass,
}

/// Load.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GravityCompensationOut {
    /// Load on the body.
    #[port(bind = "body")]
    pub load: Wrench,
}

/// A balancer.
pub struct GravityCompensation {
    p: GravityCompensationParams,
}

/// Carries a fraction of the weight of a body at its centre of mass.
#[model("actuators.gravity_compensation")]
impl Model for GravityCompensation {
    type Params = GravityCompensationParams;
    type FeedthroughInputs = GravityCompensationIn;
    type FeedthroughOutputs = GravityCompensationOut;
    fn feedthrough(&self, clock: &Clock, u: &GravityCompensationIn) -> GravityCompensationOut {
        let Some(gravity) = &self.p.gravity else {
            return GravityCompensationOut { load: Wrench::zero() };
        };
        let arm = u.body.rotation * u.own.com;
        let pull = gravity.acceleration(clock.t, u.body.position + arm);
        let force = pull * (-self.p.share * u.own.mass);
        GravityCompensationOut { load: Wrench { moment: arm.cross(&force), force } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::testing;

    #[test]
    fn the_share_of_the_weight_acts_at_the_centre_of_mass() {
        let gravity = Some(testing::gravity(|_, p| Vec3::new(0.0, 0.0, -9.0 - p.x)));
        let m = GravityCompensation { p: GravityCompensationParams { share: 0.5, gravity } };
        let mut body = NodeState::identity();
        body.rotation = Quat::from_axis_angle(&Vec3::z_axis(), std::f64::consts::FRAC_PI_2);
        body.position = Vec3::new(1.0, 0.0, 0.0);
        let own = BodyMass { mass: 2.0, com: Vec3::new(0.0, -0.5, 0.3), inertia: [0.0; 6] };
        let y = m.feedthrough(&Clock::at(0.0, 1e-3, 0), &GravityCompensationIn { body, own });
        // The force is half of 2 kg · 10.5 m/s². It acts at the centre of mass at x = 1.5, with the
        // arm (0.5, 0, 0.3).
        assert!((y.load.force - Vec3::new(0.0, 0.0, 10.5)).norm() < 1e-14);
        assert!((y.load.moment - Vec3::new(0.0, -5.25, 0.0)).norm() < 1e-14, "{}", y.load.moment);
    }
}
