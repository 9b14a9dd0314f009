//! `flight.rate_damping`: a moment that opposes the rotation of a body: M = −c ω about each of the body axes.
//!
//! Use it for a body whose damping coefficients are known, such as a payload on a parachute.

use linkwork_surroundings::prelude::*;

/// Damping.
#[derive(Params, Clone, Debug)]
pub struct RateDampingParams {
    /// Ratio of moment to angular rate about x, y, z of the node.
    #[param(unit = "N m s/rad")]
    pub damping: Vec3,
    /// Angular velocity of the axes to which the body's rate refers, W: the rate of the air of the `world`, or zero.
    #[param(unit = "rad/s", default = Vec3::zeros())]
    pub against: Vec3,
    /// The world, with whose body the air turns.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RateDampingIn {
    /// Node with the axes of the damping.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Angular velocity of the air in addition to `against`, W, for example `rotation` of `flight.gusts`.
    #[port("rad/s", default = Vec3::zeros())]
    pub gust_rate: Vec3,
}

/// The moment.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RateDampingOut {
    /// Load on the body.
    #[port(bind = "body")]
    pub load: Wrench,
}

/// Damping of a body's rates.
pub struct RateDamping {
    p: RateDampingParams,
}

/// A moment that opposes the rotation of a body, proportional to its rate about each axis.
#[model("flight.rate_damping")]
impl Model for RateDamping {
    type Params = RateDampingParams;
    type FeedthroughInputs = RateDampingIn;
    type FeedthroughOutputs = RateDampingOut;
    fn build(p: RateDampingParams) -> Result<Self, BuildError> {
        if p.damping.iter().any(|c| !(*c >= 0.0)) {
            return Err(BuildError::new("a negative damping would add energy to the motion")
                .help("write values of 0 or more")
                .at("damping"));
        }
        super::air_data::check_air_rate(&p.against, p.world.as_ref(), "against")?;
        Ok(RateDamping { p })
    }
    fn feedthrough(&self, u: &RateDampingIn) -> RateDampingOut {
        let R = u.body.rotation;
        let rate = R.inverse() * (u.body.angular - self.p.against - u.gust_rate);
        let moment = R * -rate.component_mul(&self.p.damping);
        RateDampingOut { load: Wrench { moment, force: Vec3::zeros() } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::PlainWorld;

    fn params(damping: Vec3, against: Vec3, world: Option<PlainWorld>) -> RateDampingParams {
        RateDampingParams { damping, against, world: world.map(PlainWorld::handle) }
    }

    /// It is an error if the rate of the air contradicts the rotation of the world.
    #[test]
    fn air_that_turns_otherwise_than_the_world_is_refused() {
        let turns = 7.292_115e-5;
        let earth = || Some(PlainWorld::inertial(3.986e14, 6.378e6, turns));
        let of = |against: Vec3, world| RateDamping::build(params(Vec3::x(), against, world));
        // Rates of two sources may differ in the seventh digit.
        for against in [Vec3::zeros(), Vec3::z() * turns, Vec3::z() * 7.292_113e-5] {
            assert!(of(against, earth()).is_ok(), "{against}");
        }
        let of_mars = of(Vec3::z() * 7.088e-5, earth()).err().unwrap();
        assert_eq!(of_mars.param.as_deref(), Some("against"));
        assert!(of_mars.message.contains("7.292115e-5") && of_mars.help.is_some(), "{of_mars:?}");
        let pose = linkwork_spatial::Pose::identity();
        let site = Site { pose, rate: turns, start: Quat::identity() };
        // In the axes of a site the air must be at rest.
        let here = Some(PlainWorld::of_site(3.986e14, 6.378e6, site));
        assert!(of(Vec3::z() * turns, here).is_err());
    }

    #[test]
    fn it_takes_energy_and_knows_the_body_s_axes() {
        let p = params(Vec3::new(9.0, 15.0, 0.0), Vec3::z(), None);
        let m = RateDamping::build(p).unwrap();
        let rotation = Quat::from_scaled_axis(Vec3::new(0.3, -0.8, 0.5));
        let rate = Vec3::new(0.1, -0.2, 0.4);
        let angular = rotation * rate + Vec3::z();
        let body = NodeState { rotation, angular, ..NodeState::identity() };
        let at = |u: &RateDampingIn| m.feedthrough(u);
        let y = at(&RateDampingIn { body, gust_rate: Vec3::zeros() });
        let want = rotation * Vec3::new(-0.9, 3.0, 0.0);
        assert!((y.load.moment - want).norm() < 1e-14);
        assert!(y.load.moment.dot(&(rotation * rate)) < 0.0);
        // No moment acts on a body that rotates with the air.
        let with = at(&RateDampingIn { body, gust_rate: rotation * rate });
        assert!(with.load.moment.norm() < 1e-14);
        let p = params(Vec3::new(1.0, -1.0, 0.0), Vec3::zeros(), None);
        assert!(RateDamping::build(p).is_err_and(|e| e.param.as_deref() == Some("damping")));
    }
}
