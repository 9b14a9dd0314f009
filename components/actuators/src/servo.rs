//! Ideal servos on a hinge: a torque towards a commanded rate or angle, or a commanded torque, with a limit.
//! ```text
//! torque     τ = sat(τ*)
//! rate       τ = sat(k_r (ω* − ω))
//! position   τ = sat(k (q* − q) − d q̇)
//! P = τ q̇,   i = P/V of the supply;   without a supply (V = 0) τ = 0: the joint is free
//! ```
//! For assemblies that do not simulate motors: they have no losses, and feed power back when the hinge drives them. k_r times the step must stay
//! below the hinge's inertia.

use linkwork_runtime::prelude::*;

/// A torque drive.
#[derive(Params, Clone, Debug)]
pub struct TorqueDriveParams {
    /// Greatest torque.
    #[param(unit = "N m", slider = "N", default = 1e9, range = 0.0..)]
    pub torque_max: f64,
}

/// Command and hinge.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TorqueDriveIn {
    /// Supply of the drive.
    #[port(connector)]
    pub supply: Voltage,
    /// Wanted torque.
    #[port("N m", slider = "N", default = 0.0)]
    pub torque: f64,
    /// The hinge.
    #[port(bind = "shaft")]
    pub shaft: HingeState,
}

/// Torque and power.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TorqueDriveOut {
    /// Torque on the hinge.
    #[port(bind = "shaft")]
    pub load: HingeTorque,
    /// Power taken from the supply and given to the hinge; negative: fed back.
    #[port("W")]
    pub power: f64,
    /// Supply of the drive.
    #[port(connector)]
    pub supply: Current,
}

/// A torque drive.
pub struct TorqueDrive {
    p: TorqueDriveParams,
}

/// Ideal torque drive: the commanded torque, limited, like a joint with an internal torque controller.
#[model("actuators.torque_drive")]
impl Model for TorqueDrive {
    type Params = TorqueDriveParams;
    type FeedthroughInputs = TorqueDriveIn;
    type FeedthroughOutputs = TorqueDriveOut;
    fn feedthrough(&self, u: &TorqueDriveIn) -> TorqueDriveOut {
        let limit = u.supply.limit(self.p.torque_max);
        let torque = u.torque.clamp(-limit, limit);
        let power = torque * u.shaft.rate;
        TorqueDriveOut { load: HingeTorque(torque), power, supply: u.supply.current_of(power) }
    }
}

/// A rate servo.
#[derive(Params, Clone, Debug)]
pub struct RateServoParams {
    /// Torque for each rad/s of error.
    #[param(unit = "N m s/rad", slider = "N s/m", range = 0.0..)]
    pub gain: f64,
    /// Greatest torque.
    #[param(unit = "N m", slider = "N", default = 1e9, range = 0.0..)]
    pub torque_max: f64,
}

/// Command and hinge.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RateServoIn {
    /// Supply of the servo.
    #[port(connector)]
    pub supply: Voltage,
    /// Wanted rate.
    #[port("rad/s", slider = "m/s", default = 0.0)]
    pub rate: f64,
    /// The hinge.
    #[port(bind = "shaft")]
    pub shaft: HingeState,
}

/// Torque and power.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ServoOut {
    /// Torque on the hinge.
    #[port(bind = "shaft")]
    pub torque: HingeTorque,
    /// Power taken from the supply and given to the hinge; negative: fed back.
    #[port("W")]
    pub power: f64,
    /// Supply of the servo.
    #[port(connector)]
    pub supply: Current,
}

fn servo(wanted: f64, torque_max: f64, supply: &Voltage, rate: f64) -> ServoOut {
    let limit = supply.limit(torque_max);
    let torque = wanted.clamp(-limit, limit);
    let power = torque * rate;
    ServoOut { torque: HingeTorque(torque), power, supply: supply.current_of(power) }
}

/// A rate servo.
pub struct RateServo {
    p: RateServoParams,
}

/// Ideal rate servo: torque proportional to the rate error, limited.
#[model("actuators.rate_servo")]
impl Model for RateServo {
    type Params = RateServoParams;
    type FeedthroughInputs = RateServoIn;
    type FeedthroughOutputs = ServoOut;
    fn feedthrough(&self, u: &RateServoIn) -> ServoOut {
        servo(self.p.gain * (u.rate - u.shaft.rate), self.p.torque_max, &u.supply, u.shaft.rate)
    }
}

/// A position servo.
#[derive(Params, Clone, Debug)]
pub struct PositionServoParams {
    /// Stiffness.
    #[param(unit = "N m/rad", slider = "N/m", range = 0.0..)]
    pub stiffness: f64,
    /// Damping.
    #[param(unit = "N m s/rad", slider = "N s/m", range = 0.0..)]
    pub damping: f64,
    /// Greatest torque.
    #[param(unit = "N m", slider = "N", default = 1e9, range = 0.0..)]
    pub torque_max: f64,
}

/// Command and hinge.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PositionServoIn {
    /// Supply of the servo.
    #[port(connector)]
    pub supply: Voltage,
    /// Wanted angle.
    #[port("rad", slider = "m", default = 0.0)]
    pub angle: f64,
    /// The hinge.
    #[port(bind = "shaft")]
    pub shaft: HingeState,
}

/// A position servo.
pub struct PositionServo {
    p: PositionServoParams,
}

/// Ideal position servo: spring and damper towards the commanded angle, limited.
#[model("actuators.position_servo")]
impl Model for PositionServo {
    type Params = PositionServoParams;
    type FeedthroughInputs = PositionServoIn;
    type FeedthroughOutputs = ServoOut;
    fn feedthrough(&self, u: &PositionServoIn) -> ServoOut {
        let p = &self.p;
        let wanted = p.stiffness * (u.angle - u.shaft.angle) - p.damping * u.shaft.rate;
        servo(wanted, p.torque_max, &u.supply, u.shaft.rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn servos_push_towards_the_command_up_to_their_limit() {
        let shaft = HingeState { angle: 0.2, rate: 1.0 };
        let s = RateServo { p: RateServoParams { gain: 5.0, torque_max: 8.0 } };
        let supply = Voltage { voltage: 28.0 };
        let torque = |rate| s.feedthrough(&RateServoIn { supply, rate, shaft }).torque.0;
        assert_eq!((torque(2.0), torque(9.0), torque(-9.0)), (5.0, 8.0, -8.0));
        let drive = TorqueDrive { p: TorqueDriveParams { torque_max: 4.0 } };
        let load = |torque| drive.feedthrough(&TorqueDriveIn { supply, torque, shaft });
        assert_eq!((load(3.0).load.0, load(-7.0).load.0, load(3.0).power), (3.0, -4.0, 3.0));
        let p = PositionServoParams { stiffness: 10.0, damping: 1.0, torque_max: 3.5 };
        let s = PositionServo { p };
        let torque = |angle| s.feedthrough(&PositionServoIn { supply, angle, shaft }).torque.0;
        assert!((torque(0.5) - 2.0).abs() < 1e-12 && torque(5.0) == 3.5);
        // A hinge that is driven by its load feeds power back. Torque and current are zero without
        // a supply.
        assert_eq!(load(-2.8).supply.current, -2.8 / 28.0);
        let supply = Voltage { voltage: 0.0 };
        let u = TorqueDriveIn { supply, torque: 3.0, shaft };
        let y = drive.feedthrough(&u);
        assert_eq!((y.load.0, y.power, y.supply.current), (0.0, 0.0, 0.0));
        let y = s.feedthrough(&PositionServoIn { supply, angle: 5.0, shaft });
        assert_eq!((y.torque.0, y.supply.current), (0.0, 0.0));
    }
}
