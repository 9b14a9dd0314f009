//! `actuators.rate_follower`, `actuators.angle_follower`: prescribed hinges that follow commands, for machines with prescribed kinematics.
//! ```text
//! rate     β̇ = (w − β)/T                                     w: the commanded rate, zero while the brake is on
//! angle    β̇ = (w − β)/T,   w = (δ_c − δ)/(4T) within ±rate_max        critically damped: (1 + t/2T) e^(−t/2T)
//! |β̇| ≤ acceleration_max
//! without a supply (V = 0) both stop: w = 0
//! power    P = P_idle + τ β/η  while motoring, P_idle + η τ β while back-driven
//! ```
//! The hinge motion does not depend on torques: the torque of the axle (τ) affects only the power. An angle follower has no torque input and draws no
//! power. For steps longer than T, the step replaces T.

use linkwork_runtime::prelude::*;

/// Parameters of a rate follower.
#[derive(Params, Clone, Debug)]
pub struct RateFollowerParams {
    /// Time constant T.
    #[param(unit = "s", default = 0.1, range = 1e-4..)]
    pub time_constant: f64,
    /// Maximum acceleration.
    #[param(unit = "rad/s^2", slider = "m/s^2", default = 10.0, range = 1e-6..)]
    pub acceleration_max: f64,
    /// Maximum rate; larger commands are limited, and the output `limited` is true.
    #[param(unit = "rad/s", slider = "m/s", default = 1.7, range = 1e-6..)]
    pub rate_max: f64,
    /// Efficiency η of motor and gear.
    #[param(default = 0.5, range = 1e-3..=1.0)]
    pub efficiency: f64,
    /// Power drawn while it is not braked.
    #[param(unit = "W", default = 0.0, range = 0.0..)]
    pub idle: f64,
}

/// Command and load of the axle.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RateFollowerIn {
    /// Supply of the drive.
    #[port(connector)]
    pub supply: Voltage,
    /// The hinge.
    #[port(bind = "shaft")]
    pub shaft: HingeState,
    /// Commanded rate.
    #[port("rad/s", slider = "m/s", default = 0.0)]
    pub target: f64,
    /// The brake is on.
    #[port("1", default = false)]
    pub brake: bool,
    /// Torque of the drive on the axle.
    #[port("N m", slider = "N", default = 0.0)]
    pub torque: f64,
}

/// Motion and power.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RateFollowerOut {
    /// Acceleration of the hinge.
    #[port(bind = "shaft")]
    pub motion: HingeAccel,
    /// Torque of the drive on the axle: the value of the input.
    #[port("N m", slider = "N")]
    pub shaft_torque: f64,
    /// Electrical power drawn; negative while energy is returned.
    #[port("W")]
    pub power: f64,
    /// The command exceeds `rate_max`.
    #[port("1")]
    pub limited: bool,
    /// Supply of the drive.
    #[port(connector)]
    pub supply: Current,
}

/// A hinge that follows a rate.
pub struct RateFollower {
    p: RateFollowerParams,
}

fn towards(c: &Clock, wanted: f64, rate: f64, time_constant: f64, most: f64) -> HingeAccel {
    HingeAccel(((wanted - rate) / time_constant.max(c.dt)).clamp(-most, most))
}

/// Prescribed hinge that follows a commanded rate with a time constant; its power follows from the torque input.
#[model("actuators.rate_follower")]
impl Model for RateFollower {
    type Params = RateFollowerParams;
    type FeedthroughInputs = RateFollowerIn;
    type FeedthroughOutputs = RateFollowerOut;
    fn feedthrough(&self, clock: &Clock, u: &RateFollowerIn) -> RateFollowerOut {
        let p = &self.p;
        let stands = u.brake || u.supply.voltage <= 0.0;
        let wanted = if stands { 0.0 } else { u.target.clamp(-p.rate_max, p.rate_max) };
        let work = u.torque * u.shaft.rate;
        let drawn = if work > 0.0 { work / p.efficiency } else { work * p.efficiency };
        let power =
            if u.supply.voltage > 0.0 { drawn + if u.brake { 0.0 } else { p.idle } } else { 0.0 };
        RateFollowerOut {
            motion: towards(clock, wanted, u.shaft.rate, p.time_constant, p.acceleration_max),
            shaft_torque: u.torque,
            power,
            limited: !u.brake && u.target.abs() > p.rate_max,
            supply: u.supply.current_of(power),
        }
    }
}

/// Parameters of an angle follower.
#[derive(Params, Clone, Debug)]
pub struct AngleFollowerParams {
    /// Time constant T.
    #[param(unit = "s", default = 0.05, range = 1e-4..)]
    pub time_constant: f64,
    /// Maximum rate.
    #[param(unit = "rad/s", slider = "m/s", default = 1.0, range = 1e-6..)]
    pub rate_max: f64,
    /// Maximum acceleration.
    #[param(unit = "rad/s^2", slider = "m/s^2", default = 10.0, range = 1e-6..)]
    pub acceleration_max: f64,
}

/// Command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct AngleFollowerIn {
    /// Supply of the drive.
    #[port(connector)]
    pub supply: Voltage,
    /// The hinge.
    #[port(bind = "shaft")]
    pub shaft: HingeState,
    /// Commanded angle.
    #[port("rad", slider = "m", default = 0.0)]
    pub angle: f64,
}

/// Motion.
#[derive(Ports, Clone, Copy, Debug)]
pub struct AngleFollowerOut {
    /// Acceleration of the hinge.
    #[port(bind = "shaft")]
    pub motion: HingeAccel,
    /// Error: command minus angle of the hinge.
    #[port("rad", slider = "m")]
    pub error: f64,
    /// Supply of the drive: no current, because its torque is unknown.
    #[port(connector)]
    pub supply: Current,
}

/// A hinge that follows an angle.
pub struct AngleFollower {
    p: AngleFollowerParams,
}

/// Prescribed hinge that follows a commanded angle, critically damped, at a limited rate.
#[model("actuators.angle_follower")]
impl Model for AngleFollower {
    type Params = AngleFollowerParams;
    type FeedthroughInputs = AngleFollowerIn;
    type FeedthroughOutputs = AngleFollowerOut;
    fn feedthrough(&self, clock: &Clock, u: &AngleFollowerIn) -> AngleFollowerOut {
        let p = &self.p;
        let (error, constant) = (u.angle - u.shaft.angle, p.time_constant.max(clock.dt));
        let rate_max = u.supply.limit(p.rate_max);
        let wanted = (error / (4.0 * constant)).clamp(-rate_max, rate_max);
        let motion = towards(clock, wanted, u.shaft.rate, p.time_constant, p.acceleration_max);
        AngleFollowerOut { motion, error, supply: Current { current: 0.0 } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rate() -> RateFollower {
        let p = RateFollowerParams {
            time_constant: 0.1,
            acceleration_max: 5.0,
            rate_max: 2.0,
            efficiency: 0.5,
            idle: 3.0,
        };
        RateFollower { p }
    }

    const SUPPLY: Voltage = Voltage { voltage: 28.0 };

    fn told(target: f64, brake: bool, rate: f64, torque: f64) -> RateFollowerIn {
        let shaft = HingeState { angle: 0.7, rate };
        RateFollowerIn { supply: SUPPLY, shaft, target, brake, torque }
    }

    #[test]
    fn a_rate_is_reached_as_a_lag_of_first_order() {
        let (model, dt) = (rate(), 1e-3);
        let (mut v, mut t) = (0.0, 0.0);
        while t < 0.3 {
            let c = Clock::at(t, dt, 0);
            v += dt * model.feedthrough(&c, &told(0.4, false, v, 0.0)).motion.0;
            t += dt;
        }
        // Euler's method has an error of first order in dt.
        assert!((v - 0.4 * (1.0 - (-t / 0.1_f64).exp())).abs() < 1e-3, "{v}");
        let y = model.feedthrough(&Clock::at(0.0, dt, 0), &told(9.0, false, 0.0, 0.0));
        assert!(y.limited && y.motion.0 == 5.0);
        // A step that is longer than the time constant ends at the command and does not overshoot.
        let y = model.feedthrough(&Clock::at(0.0, 0.5, 0), &told(0.4, false, 0.1, 0.0));
        assert!((0.1 + 0.5 * y.motion.0 - 0.4).abs() < 1e-15);
    }

    #[test]
    fn the_brake_stops_it_and_power_flows_both_ways() {
        let (model, c) = (rate(), Clock::at(0.0, 1e-3, 0));
        let braked = model.feedthrough(&c, &told(1.0, true, 0.2, 0.0));
        assert!(braked.motion.0 == -2.0 && braked.power == 0.0 && !braked.limited);
        let drives = model.feedthrough(&c, &told(1.0, false, 1.0, 8.0));
        assert_eq!(drives.power, 3.0 + 16.0);
        let driven = model.feedthrough(&c, &told(1.0, false, 1.0, -8.0));
        assert_eq!(driven.power, 3.0 - 4.0);
        assert!((driven.supply.current * 28.0 + 1.0).abs() < 1e-15);
        // Without a supply, motion and power are zero for every command.
        let supply = Voltage { voltage: 0.0 };
        let u = RateFollowerIn { supply, ..told(1.0, false, 0.2, 8.0) };
        let dark = model.feedthrough(&c, &u);
        assert_eq!((dark.motion.0, dark.power, dark.supply.current), (-2.0, 0.0, 0.0));
        let p = AngleFollowerParams { time_constant: 0.05, rate_max: 0.5, acceleration_max: 50.0 };
        let u = AngleFollowerIn { supply, shaft: HingeState { angle: 0.0, rate: 0.1 }, angle: 0.6 };
        assert_eq!(AngleFollower { p }.feedthrough(&c, &u).motion.0, -2.0);
    }

    #[test]
    fn an_angle_is_reached_without_overshoot_at_a_limited_rate() {
        let p = AngleFollowerParams { time_constant: 0.05, rate_max: 0.5, acceleration_max: 50.0 };
        let (model, dt) = (AngleFollower { p }, 1e-3);
        let (mut q, mut v, mut fastest) = (0.0, 0.0, 0.0_f64);
        for k in 0..3000 {
            let c = Clock::at(dt * f64::from(k), dt, 0);
            let shaft = HingeState { angle: q, rate: v };
            let a = model
                .feedthrough(&c, &AngleFollowerIn { supply: SUPPLY, shaft, angle: 0.6 })
                .motion
                .0;
            q += dt * (v + 0.5 * dt * a);
            v += dt * a;
            fastest = fastest.max(v.abs());
            assert!(q <= 0.6 + 1e-9, "{q}");
        }
        assert!((q - 0.6).abs() < 1e-8 && fastest <= 0.5 + 1e-9, "{q} {fastest}");
        // For small steps the response is critically damped: (1 + t/2T) e^(−t/2T).
        let (mut q, mut v) = (0.0, 0.0);
        for k in 0..2000 {
            let c = Clock::at(1e-4 * f64::from(k), 1e-4, 0);
            let shaft = HingeState { angle: q, rate: v };
            let a = model
                .feedthrough(&c, &AngleFollowerIn { supply: SUPPLY, shaft, angle: 0.01 })
                .motion
                .0;
            q += 1e-4 * (v + 0.5e-4 * a);
            v += 1e-4 * a;
        }
        let closed = 0.01 * (1.0 - 3.0 * (-2.0_f64).exp());
        assert!((q - closed).abs() < 2e-5, "{q} {closed}");
    }
}
