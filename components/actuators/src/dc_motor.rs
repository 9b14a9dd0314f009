//! `actuators.dc_motor`: brushed DC motor with gearbox and brake, seen at the output shaft.
//! ```text
//! L di/dt = u − R i − k n ω          (L = 0: i = (u − k n ω)/R), |i| ≤ i_max
//! τ = η n k i − b ω + τ_friction(z, ω)        limit of the friction: coulomb + brake if it is on
//! ```
//! The back-EMF is a damping of (n k)² η/R at the shaft: with an explicit integrator keep this times the step
//! below the inertia of the shaft, and put the rotor's reflected inertia n² J into the driven body.

use crate::friction::ShaftFriction;
use linkwork_runtime::prelude::*;

/// Winding, gear, friction and brake.
#[derive(Params, Clone, Debug)]
pub struct DcMotorParams {
    /// Winding resistance.
    #[param(unit = "ohm", range = 1e-6..)]
    pub resistance: f64,
    /// Winding inductance; 0: the current follows at once.
    #[param(unit = "H", default = 0.0, range = 0.0..)]
    pub inductance: f64,
    /// Torque (and back-EMF) constant.
    #[param(unit = "N m/A", range = 0.0..)]
    pub torque_constant: f64,
    /// Gear ratio, motor turns per output turn.
    #[param(default = 1.0, range = 1e-3..)]
    pub gear: f64,
    /// Share of the motor's torque that passes the gear.
    #[param(default = 1.0, range = 0.0..=1.0)]
    pub efficiency: f64,
    /// Greatest current that the electronics pass.
    #[param(unit = "A", default = 1e9, range = 0.0..)]
    pub current_max: f64,
    /// Coulomb friction at the output shaft.
    #[param(unit = "N m", default = 0.0, range = 0.0..)]
    pub coulomb: f64,
    /// Viscous friction at the output shaft.
    #[param(unit = "N m s/rad", default = 0.0, range = 0.0..)]
    pub viscous: f64,
    /// Holding torque of the brake at the output shaft.
    #[param(unit = "N m", default = 0.0, range = 0.0..)]
    pub brake: f64,
    /// Stiffness with which friction and brake hold.
    #[param(unit = "N m/rad", default = 1e4, range = 1e-3..)]
    pub hold_stiffness: f64,
    /// Damping with which friction and brake hold.
    #[param(unit = "N m s/rad", default = 50.0, range = 0.0..)]
    pub hold_damping: f64,
}

/// Electrical and mechanical side.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DcMotorIn {
    /// Terminal voltage.
    #[port("V", default = 0.0)]
    pub volts: f64,
    /// Brake on.
    #[port("1", default = false)]
    pub brake: bool,
    /// The shaft.
    #[port(bind = "shaft")]
    pub shaft: HingeState,
}

/// Torque and current.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DcMotorOut {
    /// Torque on the shaft.
    #[port(bind = "shaft")]
    pub torque: HingeTorque,
    /// Torque on the shaft, for plots.
    #[port("N m")]
    pub shaft_torque: f64,
    /// Winding current.
    #[port("A")]
    pub current: f64,
    /// Electrical power taken.
    #[port("W")]
    pub power: f64,
}

/// Winding and friction.
#[derive(State, Clone, Copy, Debug)]
pub struct MotorState {
    /// Current (unused without inductance).
    #[port("A")]
    pub current: f64,
    /// Deflection of the friction's bristle.
    #[port("rad")]
    pub deflection: f64,
}

/// A DC motor.
pub struct DcMotor {
    p: DcMotorParams,
}

impl DcMotor {
    fn current(&self, x: &MotorState, u: &DcMotorIn) -> f64 {
        let p = &self.p;
        let i = if p.inductance > 0.0 {
            x.current
        } else {
            (u.volts - p.torque_constant * p.gear * u.shaft.rate) / p.resistance
        };
        i.clamp(-p.current_max, p.current_max)
    }

    fn friction(&self, u: &DcMotorIn) -> ShaftFriction {
        let p = &self.p;
        ShaftFriction {
            stiffness: p.hold_stiffness,
            damping: p.hold_damping,
            limit: p.coulomb + if u.brake { p.brake } else { 0.0 },
        }
    }
}

/// Brushed DC motor with gearbox, dry and viscous friction and a brake that holds, at the output shaft.
#[model("actuators.dc_motor")]
impl Model for DcMotor {
    type Params = DcMotorParams;
    type Ud = DcMotorIn;
    type Yd = DcMotorOut;
    type X = MotorState;
    fn direct(&self, _: &Clock, x: &MotorState, _: &(), u: &DcMotorIn) -> DcMotorOut {
        let p = &self.p;
        let current = self.current(x, u);
        let torque = p.efficiency * p.gear * p.torque_constant * current - p.viscous * u.shaft.rate
            + self.friction(u).torque(x.deflection, u.shaft.rate);
        DcMotorOut {
            torque: HingeTorque(torque),
            shaft_torque: torque,
            current,
            power: u.volts * current,
        }
    }
    fn deriv(&self, _: &Clock, x: &MotorState, _: &(), _: &(), u: &DcMotorIn) -> MotorState {
        let p = &self.p;
        let emf = p.torque_constant * p.gear * u.shaft.rate;
        let current = if p.inductance > 0.0 {
            (u.volts - p.resistance * x.current - emf) / p.inductance
        } else {
            0.0
        };
        MotorState {
            current,
            deflection: self.friction(u).deflection_rate(x.deflection, u.shaft.rate),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motor() -> DcMotor {
        DcMotor {
            p: DcMotorParams {
                resistance: 2.0,
                inductance: 0.0,
                torque_constant: 0.05,
                gear: 100.0,
                efficiency: 0.8,
                current_max: 10.0,
                coulomb: 0.0,
                viscous: 0.0,
                brake: 50.0,
                hold_stiffness: 1e4,
                hold_damping: 50.0,
            },
        }
    }

    fn at(volts: f64, rate: f64) -> DcMotorOut {
        let u = DcMotorIn { volts, brake: false, shaft: HingeState { angle: 0.0, rate } };
        motor().direct(&Clock::at(0.0, 1e-3, 0), &MotorState::zero(), &(), &u, &())
    }

    #[test]
    fn stall_no_load_and_saturation() {
        // Stall: i = 12/2 = 6 A, τ = 0.8 · 100 · 0.05 · 6 = 24 N m. No load: ω = 12/5 = 2.4 rad/s.
        assert!((at(12.0, 0.0).shaft_torque - 24.0).abs() < 1e-12);
        assert!(at(12.0, 2.4).shaft_torque.abs() < 1e-12);
        assert!((at(12.0, 0.0).power - 72.0).abs() < 1e-12);
        assert_eq!(at(1000.0, 0.0).current, 10.0);
    }

    #[test]
    fn power_in_covers_power_out() {
        for volts in [-20.0, -3.0, 5.0, 12.0] {
            for rate in [-3.0, -0.5, 0.7, 2.0] {
                let y = at(volts, rate);
                // With an ideal gear the difference is the heat of the winding.
                let mechanical = y.shaft_torque / 0.8 * rate;
                let heat = 2.0 * y.current * y.current;
                if y.current.abs() < 10.0 {
                    assert!((y.power - mechanical - heat).abs() < 1e-9, "{volts} {rate}");
                }
            }
        }
    }

    #[test]
    fn brake_holds_below_its_torque() {
        let m = motor();
        let (mut angle, mut rate, mut x) = (0.0, 0.0, MotorState::zero());
        let (mut early, dt) = (0.0, 1e-3);
        for k in 0..20_000 {
            let u = DcMotorIn { volts: 0.0, brake: true, shaft: HingeState { angle, rate } };
            let y = m.direct(&Clock::at(0.0, dt, 0), &x, &(), &u, &());
            let d = m.deriv(&Clock::at(0.0, dt, 0), &x, &(), &(), &u, &(), &y);
            x.deflection += dt * d.deflection;
            rate += dt * (y.torque.0 + 40.0) / 2.0;
            angle += dt * rate;
            if k == 10_000 {
                early = angle;
            }
        }
        assert!((angle - early).abs() < 1e-12 && angle > 0.0 && angle < 0.01, "{angle} {early}");
    }

    #[test]
    fn winding_follows_its_time_constant() {
        let m = DcMotor { p: DcMotorParams { inductance: 0.02, ..motor().p } };
        let mut x = MotorState::zero();
        let u = DcMotorIn { volts: 4.0, brake: false, shaft: HingeState { angle: 0.0, rate: 0.0 } };
        for _ in 0..1000 {
            let y = m.direct(&Clock::at(0.0, 1e-5, 0), &x, &(), &u, &());
            let d = m.deriv(&Clock::at(0.0, 1e-5, 0), &x, &(), &(), &u, &(), &y);
            x.current += 1e-5 * d.current;
        }
        // One time constant L/R = 10 ms.
        assert!((x.current - 2.0 * (1.0 - (-1f64).exp())).abs() < 1e-3, "{}", x.current);
    }
}
