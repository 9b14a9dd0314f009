//! `flight.reaction_wheel`: reaction wheel with friction, limits and imbalance.
//! ```text
//! h = J (Ω + g · ω)          g: spin axis, ω: inertial rate of the body, Ω: speed against it
//! ḣ = u − τ_f(Ω)             Ω = h/J − g · ω
//! on the body: M = −(u − τ_f) g − ω × h g + imbalance
//! τ_f = (T_c + (T_s − T_c) e^(−(Ω/Ω_s)²)) tanh(Ω/ε) + b Ω       Coulomb, Stribeck, viscous
//! |Ω| ≥ Ω_max: the motor gives no more than friction takes, until |Ω| < 0.999 Ω_max or the command brakes
//! P = u Ω + c u² + P_idle, i = P/V of the supply;   without a supply (V = 0) u = 0: friction brakes the wheel
//! static imbalance   F = U_s Ω² a(θ)       dynamic   T = U_d Ω² a(θ)       θ̇ = Ω,  a ⊥ g turns with the wheel
//! ```
//! The inertia of the body in the file must include the mass of the wheel and its inertia perpendicular to g, but not J about g. The inertial axial
//! momentum h is a state of this model, so that the model does not need the acceleration of the body. Node z is g. If W is a site, ω is the sum of
//! the rate in W and the rate of the planet, because the momentum of the wheel rotates with the planet, too.

use super::turning;
use linkwork_surroundings::prelude::*;

/// Parameters of a reaction wheel.
#[derive(Params, Clone, Debug)]
pub struct WheelParams {
    /// Inertia J about the spin axis.
    #[param(unit = "kg m^2", range = 1e-9..)]
    pub inertia: f64,
    /// Initial speed relative to the body, for a body that does not rotate in inertial axes.
    #[param(unit = "rad/s", default = 0.0)]
    pub speed: f64,
    /// Greatest torque of the motor.
    #[param(unit = "N m", default = f64::INFINITY, range = 0.0..)]
    pub torque_max: f64,
    /// Winding loss coefficient c = R/k²: resistance over the square of the torque constant.
    #[param(unit = "W/(N^2 m^2)", default = 0.0, range = 0.0..)]
    pub winding_loss: f64,
    /// Power of the electronics.
    #[param(unit = "W", default = 0.0, range = 0.0..)]
    pub idle: f64,
    /// Greatest speed. At this speed the motor only compensates friction or brakes; it accelerates the wheel again below 0.999 of it.
    #[param(unit = "rad/s", default = f64::INFINITY, range = 0.0..)]
    pub speed_max: f64,
    /// Coulomb friction T_c.
    #[param(unit = "N m", default = 0.0, range = 0.0..)]
    pub coulomb: f64,
    /// Breakaway friction T_s, at least T_c. Default: T_c.
    #[param(unit = "N m", default = 0.0, range = 0.0..)]
    pub breakaway: f64,
    /// Stribeck speed Ω_s, over which friction decreases from T_s to T_c.
    #[param(unit = "rad/s", default = 1.0, range = 1e-6.., needs = "breakaway")]
    pub stribeck: f64,
    /// Speed ε below which Coulomb friction is smoothed.
    #[param(unit = "rad/s", default = 0.01, range = 1e-9.., needs = "coulomb or breakaway")]
    pub smoothing: f64,
    /// Viscous friction coefficient b.
    #[param(unit = "N m s/rad", default = 0.0, range = 0.0..)]
    pub viscous: f64,
    /// Static imbalance U_s.
    #[param(unit = "kg m", default = 0.0, range = 0.0..)]
    pub static_imbalance: f64,
    /// Dynamic imbalance U_d.
    #[param(unit = "kg m^2", default = 0.0, range = 0.0..)]
    pub dynamic_imbalance: f64,
    /// The world; needed if W is a rotating site, because the rotation adds gyroscopic torque.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// Body, supply and command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct WheelIn {
    /// Node at the wheel; z is its spin axis.
    #[port(bind = "wheel")]
    pub wheel: NodeState,
    /// Supply of motor and electronics.
    #[port(connector)]
    pub supply: Voltage,
    /// Commanded torque on the wheel, limited to the torque of the motor.
    #[port("N m", default = 0.0)]
    pub torque: f64,
}

/// Torque, speed and power.
#[derive(Ports, Clone, Copy, Debug)]
pub struct WheelOut {
    /// Force and torque on the body.
    #[port(bind = "wheel")]
    pub load: Wrench,
    /// Speed Ω relative to the body.
    #[port("rad/s")]
    pub speed: f64,
    /// Motor torque minus friction, on the wheel.
    #[port("N m")]
    pub net_torque: f64,
    /// Momentum h about the spin axis, inertial.
    #[port("N m s")]
    pub momentum: f64,
    /// Supply of motor and electronics.
    #[port(connector)]
    pub supply: Current,
    /// Electrical power taken from the supply; negative: fed back while the motor brakes the wheel.
    #[port("W")]
    pub power: f64,
    /// Outlet of the heat of winding, electronics and friction, for the port of a thermal node. If it is not connected, the heat goes to the surroundings.
    #[port(connector)]
    pub case: HeatFlow,
    /// Kinetic energy of the wheel's inertial rotation about its axis.
    #[port("J", stored)]
    pub energy: f64,
}

/// State of a wheel.
#[derive(State, Clone, Copy, Debug)]
pub struct Spin {
    /// Inertial momentum about the spin axis.
    #[port("N m s")]
    pub momentum: f64,
    /// Angle of the imbalance.
    #[port("rad")]
    pub angle: f64,
}

/// State of the speed limit.
#[derive(State, Clone, Copy, Debug)]
pub struct AtLimit {
    /// 1 at the greatest speed, −1 at the greatest speed backwards, 0 below.
    #[port("1")]
    pub limit: f64,
}

/// Guards of the speed limit.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SpeedLimit {
    /// Speed minus the greatest speed.
    #[port("rad/s", rising)]
    pub above: f64,
    /// Speed at which the motor accelerates again, minus the speed.
    #[port("rad/s", rising)]
    pub below: f64,
}

/// Fraction of the greatest speed below which the motor accelerates the wheel again.
const AGAIN: f64 = 0.999;

/// Reaction wheel.
pub struct ReactionWheel {
    p: WheelParams,
    /// Rotation rate of W in inertial space, rad/s, W.
    turning: Vec3,
}

impl ReactionWheel {
    /// Returns the speed relative to the body, rad/s.
    fn speed(&self, x: &Spin, u: &WheelIn) -> f64 {
        let axis = u.wheel.rotation * Vec3::z();
        x.momentum / self.p.inertia - axis.dot(&(u.wheel.angular + self.turning))
    }

    /// Returns the state of the speed limit, with hysteresis.
    fn limit(&self, speed: f64, d: &AtLimit) -> AtLimit {
        let high = speed.abs() >= self.p.speed_max;
        let was = d.limit != 0.0 && speed.abs() > AGAIN * self.p.speed_max;
        AtLimit { limit: if high || was { 1.0_f64.copysign(speed) } else { 0.0 } }
    }

    /// Returns the friction torque (N m) at a speed (rad/s), with the sign of the speed; it opposes the motion.
    pub fn friction(&self, speed: f64) -> f64 {
        let p = &self.p;
        if p.coulomb == 0.0 && p.breakaway == 0.0 {
            return p.viscous * speed;
        }
        let dry =
            p.coulomb + (p.breakaway - p.coulomb).max(0.0) * (-(speed / p.stribeck).powi(2)).exp();
        dry * (speed / p.smoothing).tanh() + p.viscous * speed
    }
}

/// A reaction wheel with friction, limits and imbalance.
#[model("flight.reaction_wheel")]
impl Model for ReactionWheel {
    const MODES: bool = true;
    type Params = WheelParams;
    type DiscreteState = AtLimit;
    type Guards = SpeedLimit;
    type FeedthroughInputs = WheelIn;
    type FeedthroughOutputs = WheelOut;
    type State = Spin;
    fn build(p: WheelParams) -> Result<Self, BuildError> {
        if p.breakaway != 0.0 && p.breakaway < p.coulomb {
            let fact = format!(
                "`breakaway` is {} N m, less than the Coulomb friction of {} N m",
                p.breakaway, p.coulomb
            );
            let help = "write at least `coulomb`, or remove `breakaway`";
            return Err(BuildError::new(fact).help(help).at("breakaway"));
        }
        let turning = turning(p.world.as_ref());
        Ok(ReactionWheel { p, turning })
    }
    fn init_x(&self) -> Spin {
        Spin { momentum: self.p.inertia * self.p.speed, angle: 0.0 }
    }
    fn feedthrough(&self, x: &Spin, d: &AtLimit, u: &WheelIn) -> WheelOut {
        let p = &self.p;
        let R = u.wheel.rotation;
        let axis = R * Vec3::z();
        let rate = u.wheel.angular + self.turning;
        let speed = self.speed(x, u);
        let friction = self.friction(speed);
        let torque_max = u.supply.limit(p.torque_max);
        let mut torque = u.torque.clamp(-torque_max, torque_max);
        if d.limit != 0.0 {
            torque = d.limit * (d.limit * torque).min((d.limit * friction).max(0.0));
        }
        let net_torque = torque - friction;
        let moment = -axis * net_torque - rate.cross(&axis) * x.momentum;
        let mut load = Wrench { moment, force: Vec3::zeros() };
        if p.static_imbalance != 0.0 || p.dynamic_imbalance != 0.0 {
            let (sin, cos) = x.angle.sin_cos();
            let out = R * Vec3::new(cos, sin, 0.0) * (speed * speed);
            load.moment += out * p.dynamic_imbalance;
            load.force = out * p.static_imbalance;
        }
        let lost = p.winding_loss * torque * torque + u.supply.limit(p.idle);
        let power = torque * speed + lost;
        WheelOut {
            load,
            speed,
            net_torque,
            momentum: x.momentum,
            supply: u.supply.current_of(power),
            power,
            case: HeatFlow { heat: lost + friction * speed },
            energy: 0.5 * x.momentum * x.momentum / p.inertia,
        }
    }
    fn mode(&self, x: &Spin, d: &AtLimit, u: &WheelIn) -> AtLimit {
        self.limit(self.speed(x, u), d)
    }
    fn guards(&self, x: &Spin, u: &WheelIn) -> SpeedLimit {
        let (speed, most) = (self.speed(x, u).abs(), self.p.speed_max);
        if most.is_infinite() {
            return SpeedLimit { above: -1.0, below: -1.0 };
        }
        SpeedLimit { above: speed - most, below: AGAIN * most - speed }
    }
    fn handle_event(
        &self,
        fired: Fired<'_>,
        x: &Spin,
        d: &AtLimit,
        u: &WheelIn,
    ) -> (Spin, AtLimit) {
        let speed = self.speed(x, u);
        let limit = match () {
            () if fired.rose(0) => 1.0_f64.copysign(speed),
            () if fired.rose(1) => 0.0,
            () => self.limit(speed, d).limit,
        };
        (*x, AtLimit { limit })
    }
    fn derivatives(&self, y: &WheelOut) -> Spin {
        Spin { momentum: y.net_torque, angle: y.speed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::tests::{fast_site, turning_node};

    const SUPPLY: Voltage = Voltage { voltage: 28.0 };

    fn params() -> WheelParams {
        WheelParams {
            inertia: 0.0796,
            speed: 600.0,
            torque_max: 0.2,
            winding_loss: 40.0,
            idle: 3.0,
            speed_max: 628.0,
            coulomb: 0.002,
            breakaway: 0.003,
            stribeck: 2.0,
            smoothing: 0.01,
            viscous: 1e-5,
            static_imbalance: 2.8e-6,
            dynamic_imbalance: 7.7e-7,
            world: None,
        }
    }

    fn at(m: &ReactionWheel, x: &Spin, torque: f64, angular: Vec3) -> WheelOut {
        let wheel = NodeState { angular, ..NodeState::identity() };
        let u = WheelIn { wheel, supply: SUPPLY, torque };
        let d = m.mode(x, &AtLimit { limit: 0.0 }, &u);
        m.feedthrough(x, &d, &u)
    }

    #[test]
    fn imbalance_grows_with_the_square_of_the_speed() {
        // The imbalances are 2.8e-6 kg m and 7.7e-7 kg m², and the speed is 600 rad/s.
        let m = ReactionWheel::build(params()).unwrap();
        let y = at(&m, &Spin { angle: 0.7, ..m.init_x() }, 0.0, Vec3::zeros());
        assert!((y.load.force.norm() - 1.008).abs() < 1e-12);
        let across = Vec3::new(y.load.moment.x, y.load.moment.y, 0.0);
        assert!((across.norm() - 0.2772).abs() < 1e-12 && y.load.force.z == 0.0);
    }

    #[test]
    fn friction_is_against_the_motion_and_falls_after_breakaway() {
        let m = ReactionWheel::build(params()).unwrap();
        assert!((m.friction(0.05) - 0.003).abs() < 1e-5 && m.friction(0.0) == 0.0);
        assert!((m.friction(100.0) - 0.003).abs() < 1e-12, "0.002 + 1e-5 · 100");
        assert_eq!(m.friction(-30.0), -m.friction(30.0));
        let e = ReactionWheel::build(WheelParams { breakaway: 0.001, ..params() }).err().unwrap();
        assert!(e.param.as_deref() == Some("breakaway") && e.help.is_some(), "{e:?}");
    }

    #[test]
    fn the_motor_has_its_limits() {
        let m = ReactionWheel::build(params()).unwrap();
        let net = |torque: f64| at(&m, &m.init_x(), torque, Vec3::zeros()).net_torque;
        let friction = m.friction(600.0);
        assert!((net(1.0) - (0.2 - friction)).abs() < 1e-15);
        let fast = Spin { momentum: 0.0796 * 630.0, angle: 0.0 };
        assert_eq!(at(&m, &fast, 0.1, Vec3::zeros()).net_torque, 0.0, "it holds its speed");
        assert!(at(&m, &fast, 0.001, Vec3::zeros()).net_torque < 0.0, "friction brakes it");
        // The limit has a hysteresis between the two speeds.
        let u = |w: f64| {
            let x = Spin { momentum: 0.0796 * w, angle: 0.0 };
            (x, WheelIn { wheel: NodeState::identity(), supply: SUPPLY, torque: 0.1 })
        };
        let mode = |w: f64, limit: f64| {
            let (x, u) = u(w);
            m.mode(&x, &AtLimit { limit }, &u).limit
        };
        assert_eq!([mode(627.9, 0.0), mode(627.9, 1.0), mode(627.0, 1.0)], [0.0, 1.0, 0.0]);
        assert_eq!([mode(628.0, 0.0), mode(-629.0, 0.0)], [1.0, -1.0]);
        assert!(at(&m, &fast, -0.1, Vec3::zeros()).net_torque < -0.1);
        // A rotation of the body about the axis changes the relative speed.
        let y = at(&m, &m.init_x(), 0.0, Vec3::z() * 5.0);
        assert!((y.speed - 595.0).abs() < 1e-10);
    }

    #[test]
    fn power_is_work_heat_and_what_the_wheel_takes_up() {
        let p = WheelParams { static_imbalance: 0.0, dynamic_imbalance: 0.0, ..params() };
        let m = ReactionWheel::build(p).unwrap();
        let angular = Vec3::new(0.3, -0.2, 0.5);
        for (speed, torque) in [(600.0, 0.1), (600.0, -0.1), (-400.0, 0.15), (0.5, 0.02)] {
            let x = Spin { momentum: 0.0796 * speed, angle: 0.0 };
            let y = at(&m, &x, torque, angular);
            let (work, taken) = (y.load.moment.dot(&angular), x.momentum / 0.0796 * y.net_torque);
            let left = y.power - work - y.case.heat - taken;
            assert!(
                left.abs() < 1e-12 && (y.supply.current * 28.0 - y.power).abs() < 1e-12,
                "{y:?}"
            );
        }
        // The motor takes u Ω + c u², and feeds power back while braking.
        let y = at(&m, &m.init_x(), 0.1, Vec3::zeros());
        assert!((y.power - (60.0 + 0.4 + 3.0)).abs() < 1e-12, "{y:?}");
        assert!(at(&m, &m.init_x(), -0.1, Vec3::zeros()).power < -50.0);
        // Without a supply, friction alone brakes the wheel.
        let supply = Voltage { voltage: 0.0 };
        let u = WheelIn { wheel: NodeState::identity(), supply, torque: 0.1 };
        let y = m.feedthrough(&m.init_x(), &AtLimit { limit: 0.0 }, &u);
        assert_eq!((y.supply.current, y.power), (0.0, 0.0));
        assert_eq!(y.net_torque, -m.friction(y.speed));
    }

    #[test]
    fn in_a_site_the_load_is_what_its_momentum_loses_in_inertial_axes() {
        let (site, world) = fast_site();
        let mut p = params();
        (p.static_imbalance, p.dynamic_imbalance) = (0.0, 0.0);
        p.world = Some(world);
        let m = ReactionWheel::build(p).unwrap();
        let omega = Vec3::new(0.02, -0.05, 0.03);
        let (t, h) = (7.0, 1e-5);
        let y = |t: f64, momentum: f64| {
            let u = WheelIn { wheel: turning_node(&omega, t), supply: SUPPLY, torque: 0.1 };
            m.feedthrough(&Spin { momentum, angle: 0.0 }, &AtLimit { limit: 0.0 }, &u)
        };
        let axis = |t: f64| site.to_inertial(t) * (turning_node(&omega, t).rotation * Vec3::z());
        let now = y(t, 30.0);
        let vector = |by: f64| axis(t + by) * (30.0 + now.net_torque * by);
        let slope = (vector(h) - vector(-h)) / (2.0 * h);
        let load = site.to_inertial(t) * now.load.moment;
        assert!((load + slope).norm() < 1e-7, "{load} {slope}");
        // The speed is relative to the body, whose inertial rate includes the rotation of W.
        let node = turning_node(&omega, t);
        let about = (node.rotation * Vec3::z()).dot(&(omega + site.omega()));
        assert!((0.0796 * (now.speed + about) - 30.0).abs() < 1e-12, "{}", now.speed);
    }

    /// A free body with a wheel conserves total angular momentum in inertial axes for any motor torque.
    #[test]
    fn momentum_goes_from_the_body_to_the_wheel_and_none_is_lost() {
        let mut p = params();
        (p.static_imbalance, p.dynamic_imbalance) = (0.0, 0.0);
        let m = ReactionWheel::build(p).unwrap();
        let inertia = Vec3::new(60.0, 50.0, 40.0);
        let mut y = [0.0, 0.0, 0.0, 1.0, 0.03, -0.02, 0.05, 0.0796 * 100.0];
        let node = |y: &[f64; 8]| {
            let q = linkwork_spatial::nalgebra::Quaternion::new(y[3], y[0], y[1], y[2]);
            let rotation = Quat::from_quaternion(q);
            let angular = rotation * Vec3::new(y[4], y[5], y[6]);
            NodeState { rotation, angular, ..NodeState::identity() }
        };
        let slope = |y: &[f64; 8]| {
            let n = node(y);
            let u = WheelIn { wheel: n, supply: SUPPLY, torque: 0.1 };
            let o =
                m.feedthrough(&Spin { momentum: y[7], angle: 0.0 }, &AtLimit { limit: 0.0 }, &u);
            let w = Vec3::new(y[4], y[5], y[6]);
            let torque = n.rotation.inverse() * o.load.moment - w.cross(&inertia.component_mul(&w));
            let a = torque.component_div(&inertia);
            let q = linkwork_spatial::nalgebra::Quaternion::new(y[3], y[0], y[1], y[2]);
            let dq = q * linkwork_spatial::nalgebra::Quaternion::from_imag(w) * 0.5;
            [dq.i, dq.j, dq.k, dq.w, a.x, a.y, a.z, o.net_torque]
        };
        let total = |y: &[f64; 8]| {
            let w = Vec3::new(y[4], y[5], y[6]);
            node(y).rotation * (inertia.component_mul(&w) + Vec3::z() * y[7])
        };
        let before = total(&y);
        for _ in 0..4000 {
            let h = 0.01;
            let add =
                |k: &[f64; 8], c: f64| -> [f64; 8] { std::array::from_fn(|i| y[i] + c * k[i]) };
            let a = slope(&y);
            let b = slope(&add(&a, 0.5 * h));
            let c = slope(&add(&b, 0.5 * h));
            let d = slope(&add(&c, h));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        }
        assert!((total(&y) - before).norm() < 1e-9, "{} {before}", total(&y));
        assert!((y[7] - 7.96).abs() > 3.0, "the wheel has taken up momentum");
    }
}
