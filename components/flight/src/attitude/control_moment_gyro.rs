//! `flight.control_moment_gyro`: single-gimbal control moment gyro, a wheel of constant speed in a driven gimbal.
//! ```text
//! h = h₀ (cos δ s + sin δ t)      s, t = a × s, a: axes of the gimbal, fixed in the body
//! on the body: M = −δ̇ a × h − ω × h        δ̇ = the rate asked for, within its limit; ω: inertial rate of the body
//! P = δ̇ (ω × h) · a + P_idle, i = P/V of the supply;   without a supply (V = 0) δ̇ = 0, and the wheel keeps its speed
//! ```
//! The gimbal follows the rate command without lag and has no inertia. Its motor provides the gyroscopic torque that the rotation of the body
//! requires. Node z is the gimbal axis a, node x the wheel axis s at δ = 0. If W is a site, ω is the sum of the rate in W and the rate of the planet.

use super::turning;
use linkwork_surroundings::prelude::*;

/// Parameters of a control moment gyro.
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
    /// Power of the wheel motor, which compensates friction, and of the electronics.
    #[param(unit = "W", default = 0.0, range = 0.0..)]
    pub idle: f64,
    /// The world; needed if W is a rotating site, because the rotation adds gyroscopic torque.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// Body, supply and command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GyroIn {
    /// Node at the gimbal: z is the gimbal axis, x the wheel axis at angle 0.
    #[port(bind = "gimbal")]
    pub gimbal: NodeState,
    /// Supply of gimbal and wheel.
    #[port(connector)]
    pub supply: Voltage,
    /// Commanded rate of the gimbal.
    #[port("rad/s", default = 0.0)]
    pub rate: f64,
}

/// Torque, angle and power.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GyroOut {
    /// Torque on the body.
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
    /// Supply of gimbal and wheel.
    #[port(connector)]
    pub supply: Current,
    /// Electrical power taken from the supply; negative: fed back.
    #[port("W")]
    pub power: f64,
    /// Outlet of the heat of wheel and electronics, for the port of a thermal node. If it is not connected, the heat goes to the surroundings.
    #[port(connector)]
    pub case: HeatFlow,
}

/// State of the gimbal.
#[derive(State, Clone, Copy, Debug)]
pub struct Gimbal {
    /// Gimbal angle.
    #[port("rad")]
    pub angle: f64,
}

/// A single-gimbal control moment gyro.
pub struct ControlMomentGyro {
    p: GyroParams,
    /// Rotation rate of W in inertial space, rad/s, W.
    turning: Vec3,
}

impl ControlMomentGyro {
    /// Returns the rate of the gimbal, rad/s; 0 without supply voltage.
    fn rate(&self, u: &GyroIn) -> f64 {
        let most = u.supply.limit(self.p.rate_max);
        u.rate.clamp(-most, most)
    }
}

/// A single-gimbal control moment gyro with a wheel of constant speed.
#[model("flight.control_moment_gyro")]
impl Model for ControlMomentGyro {
    type Params = GyroParams;
    type FeedthroughInputs = GyroIn;
    type FeedthroughOutputs = GyroOut;
    type State = Gimbal;
    fn build(p: GyroParams) -> Result<Self, BuildError> {
        let turning = turning(p.world.as_ref());
        Ok(ControlMomentGyro { p, turning })
    }
    fn init_x(&self) -> Gimbal {
        Gimbal { angle: self.p.angle }
    }
    fn feedthrough(&self, x: &Gimbal, u: &GyroIn) -> GyroOut {
        let R = u.gimbal.rotation;
        let axis = R * Vec3::z();
        let rate = self.rate(u);
        let h = R * Vec3::new(x.angle.cos(), x.angle.sin(), 0.0) * self.p.momentum;
        let carried = (u.gimbal.angular + self.turning).cross(&h);
        let moment = -axis.cross(&h) * rate - carried;
        let motor = carried.dot(&axis);
        let heat = u.supply.limit(self.p.idle);
        let power = motor * rate + heat;
        let supply = u.supply.current_of(power);
        let load = Wrench { moment, force: Vec3::zeros() };
        GyroOut { load, angle: x.angle, momentum: h, motor, supply, power, case: HeatFlow { heat } }
    }
    fn derivatives(&self, u: &GyroIn) -> Gimbal {
        Gimbal { angle: self.rate(u) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::tests::{fast_site, turning_node};

    const SUPPLY: Voltage = Voltage { voltage: 28.0 };

    fn gyro(world: Option<Handle<dyn World>>) -> ControlMomentGyro {
        let p = GyroParams { momentum: 30.0, angle: 0.4, rate_max: 1.0, idle: 20.0, world };
        ControlMomentGyro::build(p).unwrap()
    }

    #[test]
    fn the_load_is_what_the_momentum_loses() {
        // Compare the torque with −dh/dt in inertial axes, by finite differences on a rotating
        // body.
        let m = gyro(None);
        let (omega, rate) = (Vec3::new(0.02, -0.05, 0.03), 0.6);
        let at = |t: f64| {
            let rotation = Quat::from_scaled_axis(omega * t);
            let gimbal = NodeState { rotation, angular: omega, ..NodeState::identity() };
            let x = Gimbal { angle: 0.4 + rate * t };
            m.feedthrough(&x, &GyroIn { gimbal, supply: SUPPLY, rate })
        };
        let h = 1e-5;
        let slope = (at(h).momentum - at(-h).momentum) / (2.0 * h);
        assert!((at(0.0).load.moment + slope).norm() < 1e-8, "{slope}");
        // The device amplifies torque: its output torque is large for a small torque of the gimbal
        // motor.
        assert!(at(0.0).load.moment.norm() > 15.0 && at(0.0).motor.abs() < 2.0);
        let u = GyroIn { gimbal: NodeState::identity(), supply: SUPPLY, rate: 7.0 };
        let x = m.derivatives(&u);
        assert_eq!(x.angle, 1.0);
        // Without a supply the gimbal does not move.
        let u = GyroIn { supply: Voltage { voltage: 0.0 }, ..u };
        let x = m.derivatives(&u);
        assert_eq!(x.angle, 0.0);
        // The gimbal's motor does the work that the body receives; the rest is heat.
        let angular = Vec3::new(0.3, -0.2, 0.5);
        let gimbal = NodeState { angular, ..NodeState::identity() };
        let u = GyroIn { gimbal, supply: SUPPLY, rate: 0.6 };
        let y = m.feedthrough(&m.init_x(), &u);
        let work = y.load.moment.dot(&angular);
        assert!((y.power - 20.0 - work).abs() < 1e-12 && work.abs() > 1.0 && y.case.heat == 20.0);
        assert!((y.supply.current * 28.0 - y.power).abs() < 1e-12);
    }

    #[test]
    fn in_a_site_it_is_what_the_momentum_loses_in_inertial_axes() {
        let (site, world) = fast_site();
        let m = gyro(Some(world));
        let (omega, rate) = (Vec3::new(0.02, -0.05, 0.03), 0.6);
        let at = |t: f64| {
            let x = Gimbal { angle: 0.4 + rate * t };
            let u = GyroIn { gimbal: turning_node(&omega, t), supply: SUPPLY, rate };
            m.feedthrough(&x, &u)
        };
        let momentum = |t: f64| site.to_inertial(t) * at(t).momentum;
        let (t, h) = (7.0, 1e-5);
        let slope = (momentum(t + h) - momentum(t - h)) / (2.0 * h);
        let load = site.to_inertial(t) * at(t).load.moment;
        assert!((load + slope).norm() < 1e-7, "{load} {slope}");
        // The contribution of the planet's rotation is not small here.
        let own = gyro(None).feedthrough(
            &Gimbal { angle: 0.4 + rate * t },
            &GyroIn { gimbal: turning_node(&omega, t), supply: SUPPLY, rate },
        );
        assert!((own.load.moment - at(t).load.moment).norm() > 0.3);
    }
}
