//! `flight.control_moment_gyro`: a wheel of constant speed in a gimbal that turns it.
//! ```text
//! h = h₀ (cos δ s + sin δ t)      s, t = a × s, a: axes of the gimbal, fixed in the body
//! on the body: M = −δ̇ a × h − ω × h        δ̇ = the rate asked for, within its limit; ω: inertial rate of the body
//! ```
//! The gimbal follows its rate at once and has no inertia of its own; its motor holds what the body's
//! turning asks of it. Node z is the gimbal's axis a, x the wheel's axis s at δ = 0. Where W is a site, ω is the rate in W and that of the planet.

use super::turning;
use linkwork_runtime::prelude::*;

/// A gyro.
#[derive(Params, Clone, Debug)]
pub struct GyroParams {
    /// Momentum h₀ of the wheel.
    #[param(unit = "N m s")]
    pub momentum: f64,
    /// Gimbal angle at the start.
    #[param(unit = "rad", default = 0.0)]
    pub angle: f64,
    /// Greatest rate of the gimbal.
    #[param(unit = "rad/s", default = 1.0, range = 0.0..)]
    pub rate_max: f64,
    /// The world: the momentum of the wheel turns with a site that W may be.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// Body and command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GyroIn {
    /// Node at the gimbal: z its axis, x the wheel's axis at angle 0.
    #[port(bind = "gimbal")]
    pub gimbal: NodeState,
    /// Rate of the gimbal that is asked for.
    #[port("rad/s", default = 0.0)]
    pub rate: f64,
}

/// Load and angle.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GyroOut {
    /// On the body.
    #[port(bind = "gimbal")]
    pub load: Wrench,
    /// Gimbal angle.
    #[port("rad")]
    pub angle: f64,
    /// Momentum of the wheel, W.
    #[port("N m s")]
    pub momentum: Vec3,
    /// Torque of the gimbal's motor.
    #[port("N m")]
    pub motor: f64,
}

/// State of the gimbal.
#[derive(State, Clone, Copy, Debug)]
pub struct Gimbal {
    /// Its angle.
    #[port("rad")]
    pub angle: f64,
}

/// A single-gimbal control moment gyro.
pub struct ControlMomentGyro {
    p: GyroParams,
    /// Of W in inertial space, rad/s, W.
    turning: Vec3,
}

/// A single-gimbal control moment gyro with a wheel of constant speed.
#[model("flight.control_moment_gyro")]
impl Model for ControlMomentGyro {
    type Params = GyroParams;
    type Ud = GyroIn;
    type Yd = GyroOut;
    type X = Gimbal;
    fn build(p: GyroParams) -> Result<Self, BuildError> {
        let turning = turning(p.world.as_ref());
        Ok(ControlMomentGyro { p, turning })
    }
    fn init_x(&self) -> Gimbal {
        Gimbal { angle: self.p.angle }
    }
    fn direct(&self, _: &Clock, x: &Gimbal, _: &(), u: &GyroIn) -> GyroOut {
        let R = u.gimbal.rotation;
        let axis = R * Vec3::z();
        let rate = u.rate.clamp(-self.p.rate_max, self.p.rate_max);
        let h = R * Vec3::new(x.angle.cos(), x.angle.sin(), 0.0) * self.p.momentum;
        let carried = (u.gimbal.angular + self.turning).cross(&h);
        let moment = -axis.cross(&h) * rate - carried;
        GyroOut {
            load: Wrench { moment, force: Vec3::zeros() },
            angle: x.angle,
            momentum: h,
            motor: carried.dot(&axis),
        }
    }
    fn deriv(&self, _: &Clock, _: &Gimbal, _: &(), _: &(), u: &GyroIn) -> Gimbal {
        Gimbal { angle: u.rate.clamp(-self.p.rate_max, self.p.rate_max) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::tests::{fast_site, turning_node};

    fn gyro(world: Option<Handle<dyn World>>) -> ControlMomentGyro {
        let p = GyroParams { momentum: 30.0, angle: 0.4, rate_max: 1.0, world };
        ControlMomentGyro::build(p).unwrap()
    }

    #[test]
    fn the_load_is_what_the_momentum_loses() {
        // −d/dt of h in inertial axes, by differences, on a turning body.
        let m = gyro(None);
        let (omega, rate) = (Vec3::new(0.02, -0.05, 0.03), 0.6);
        let at = |t: f64| {
            let rotation = Quat::from_scaled_axis(omega * t);
            let gimbal = NodeState { rotation, angular: omega, ..NodeState::identity() };
            let x = Gimbal { angle: 0.4 + rate * t };
            m.direct(&Clock::at(t, 0.01, 0), &x, &(), &GyroIn { gimbal, rate }, &())
        };
        let h = 1e-5;
        let slope = (at(h).momentum - at(-h).momentum) / (2.0 * h);
        assert!((at(0.0).load.moment + slope).norm() < 1e-8, "{slope}");
        // Torque across the gimbal is amplified: much for little motor.
        assert!(at(0.0).load.moment.norm() > 15.0 && at(0.0).motor.abs() < 2.0);
        let u = GyroIn { gimbal: NodeState::identity(), rate: 7.0 };
        let x = m.deriv(&Clock::at(0.0, 0.01, 0), &m.init_x(), &(), &(), &u, &(), &GyroOut::zero());
        assert_eq!(x.angle, 1.0);
    }

    #[test]
    fn in_a_site_it_is_what_the_momentum_loses_in_inertial_axes() {
        let (site, world) = fast_site();
        let m = gyro(Some(world));
        let (omega, rate) = (Vec3::new(0.02, -0.05, 0.03), 0.6);
        let at = |t: f64| {
            let x = Gimbal { angle: 0.4 + rate * t };
            let u = GyroIn { gimbal: turning_node(&omega, t), rate };
            m.direct(&Clock::at(t, 0.01, 0), &x, &(), &u, &())
        };
        let momentum = |t: f64| site.to_inertial(t) * at(t).momentum;
        let (t, h) = (7.0, 1e-5);
        let slope = (momentum(t + h) - momentum(t - h)) / (2.0 * h);
        let load = site.to_inertial(t) * at(t).load.moment;
        assert!((load + slope).norm() < 1e-7, "{load} {slope}");
        // The planet's part is not small here.
        let own = gyro(None).direct(
            &Clock::at(t, 0.01, 0),
            &Gimbal { angle: 0.4 + rate * t },
            &(),
            &GyroIn { gimbal: turning_node(&omega, t), rate },
            &(),
        );
        assert!((own.load.moment - at(t).load.moment).norm() > 0.3);
    }
}
