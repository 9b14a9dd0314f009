//! `flight.rate_damping`: a moment against a body's turning, M = −c ω by axis, body axes.
//!
//! Of a body whose damping is known as numbers, such as a payload that hangs on a parachute.

use linkwork_runtime::prelude::*;

/// Damping.
#[derive(Params, Clone, Debug)]
pub struct RateDampingParams {
    /// Moment over rate about x, y, z of the node.
    #[param(unit = "N m s/rad")]
    pub damping: Vec3,
    /// Rate of the axes against which the body turns, W.
    #[param(unit = "rad/s", default = Vec3::zeros())]
    pub against: Vec3,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RateDampingIn {
    /// Node with the axes of the damping.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Rate of the air over `against`, W, as `rotation` of gusts.
    #[port("rad/s", default = Vec3::zeros())]
    pub gust_rate: Vec3,
}

/// The moment.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RateDampingOut {
    /// On the body.
    #[port(bind = "body")]
    pub load: Wrench,
}

/// Damping of a body's rates.
pub struct RateDamping {
    p: RateDampingParams,
}

/// A moment against a body's turning, proportional to its rate about each axis.
#[model("flight.rate_damping")]
impl Model for RateDamping {
    type Params = RateDampingParams;
    type Ud = RateDampingIn;
    type Yd = RateDampingOut;
    fn build(p: RateDampingParams) -> Result<Self, BuildError> {
        if p.damping.iter().any(|c| !(*c >= 0.0)) {
            return Err(BuildError::new("a negative damping feeds the motion")
                .help("write numbers from 0 up")
                .at("damping"));
        }
        Ok(RateDamping { p })
    }
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &RateDampingIn) -> RateDampingOut {
        let R = u.body.rotation;
        let rate = R.inverse() * (u.body.angular - self.p.against - u.gust_rate);
        let moment = R * -rate.component_mul(&self.p.damping);
        RateDampingOut { load: Wrench { moment, force: Vec3::zeros() } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_takes_energy_and_knows_the_body_s_axes() {
        let p = RateDampingParams { damping: Vec3::new(9.0, 15.0, 0.0), against: Vec3::z() };
        let m = RateDamping::build(p).unwrap();
        let rotation = Quat::from_scaled_axis(Vec3::new(0.3, -0.8, 0.5));
        let rate = Vec3::new(0.1, -0.2, 0.4);
        let angular = rotation * rate + Vec3::z();
        let body = NodeState { rotation, angular, ..NodeState::identity() };
        let at = |u: &RateDampingIn| m.direct(&Clock::at(0.0, 0.01, 0), &(), &(), u, &());
        let y = at(&RateDampingIn { body, gust_rate: Vec3::zeros() });
        let want = rotation * Vec3::new(-0.9, 3.0, 0.0);
        assert!((y.load.moment - want).norm() < 1e-14);
        assert!(y.load.moment.dot(&(rotation * rate)) < 0.0);
        // No moment acts on a body that rotates with the air.
        let with = at(&RateDampingIn { body, gust_rate: rotation * rate });
        assert!(with.load.moment.norm() < 1e-14);
        let p = RateDampingParams { damping: Vec3::new(1.0, -1.0, 0.0), against: Vec3::zeros() };
        assert!(RateDamping::build(p).is_err_and(|e| e.param.as_deref() == Some("damping")));
    }
}
