//! `actuators.dc_motor`: brushed DC motor with gearbox and brake, seen at the output shaft.
//! ```text
//! u = commanded voltage within ±V, V: voltage of the supply
//! L di/dt = u − R i − k n ω          (L = 0: i = (u − k n ω)/R), |i| ≤ i_max
//! P = u_w i,   i_supply = P/V        u_w: voltage at the winding, u, or R i + k n ω where the current is at its limit
//! τ = n k i − b ω + τ_friction(z, ω)      limits of the friction, with brake 0 when it is off:
//!     coulomb + brake + (1 − η) |n k i|       against motion that the motor drives: steady, τ = η n k i
//!     coulomb + brake + (1/η − 1) |n k i|     against motion that drives the motor: steady, τ = n k i/η
//! ```
//! A gear loses power in both directions of power flow: the loss is dry friction that grows with the torque in the mesh, so the torque is continuous
//! through standstill, and a loaded gear holds within its friction. The losses are never negative:
//! P − τ ω − d/dt(½ L i² + ½ k_hold z²) ≥ 0 holds for all voltages, rates and states.
//!
//! The electronics are a bridge without losses that chops the supply: it cannot supply more than the voltage of the supply, reduces the voltage when
//! the current is at `current_max`, and feeds power back when the shaft drives the motor. At V = 0 the bridge shorts the winding: the motor brakes,
//! and the generated power heats the winding.
//!
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
    /// Winding inductance; 0: the current follows immediately.
    #[param(unit = "H", default = 0.0, range = 0.0..)]
    pub inductance: f64,
    /// Torque (and back-EMF) constant.
    #[param(unit = "N m/A", range = 0.0..)]
    pub torque_constant: f64,
    /// Gear ratio, motor turns per output turn; on a slider the angle of the motor per length.
    #[param(slider = "rad/m", default = 1.0, range = 1e-3..)]
    pub gear: f64,
    /// Efficiency of the gear, from the motor to the shaft and back.
    #[param(default = 1.0, range = 0.01..=1.0)]
    pub efficiency: f64,
    /// Current limit of the electronics.
    #[param(unit = "A", default = 1e9, range = 0.0..)]
    pub current_max: f64,
    /// Coulomb friction at the output shaft.
    #[param(unit = "N m", slider = "N", default = 0.0, range = 0.0..)]
    pub coulomb: f64,
    /// Viscous friction at the output shaft.
    #[param(unit = "N m s/rad", slider = "N s/m", default = 0.0, range = 0.0..)]
    pub viscous: f64,
    /// Holding torque of the brake at the output shaft.
    #[param(unit = "N m", slider = "N", default = 0.0, range = 0.0..)]
    pub brake: f64,
    /// Stiffness with which friction and brake hold.
    #[param(unit = "N m/rad", slider = "N/m", default = 1e4, range = 1e-3.., needs = "coulomb or brake or efficiency != 1")]
    pub hold_stiffness: f64,
    /// Damping with which friction and brake hold.
    #[param(unit = "N m s/rad", slider = "N s/m", default = 50.0, range = 0.0.., needs = "coulomb or brake or efficiency != 1")]
    pub hold_damping: f64,
}

/// Electrical and mechanical side.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DcMotorIn {
    /// Supply of the electronics.
    #[port(connector)]
    pub supply: Voltage,
    /// Commanded voltage of the winding; the voltage of the supply limits it.
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
    #[port("N m", slider = "N")]
    pub shaft_torque: f64,
    /// Winding current.
    #[port("A")]
    pub current: f64,
    /// Electrical power taken from the supply; negative: fed back.
    #[port("W")]
    pub power: f64,
    /// Outlet of the heat of the winding and of a shorted bridge, for the port of a thermal node. If it is not connected, the heat goes to the surroundings.
    #[port(connector)]
    pub case: HeatFlow,
    /// Power dissipated by friction of the shaft and losses of the gear.
    #[port("W", lost)]
    pub friction: f64,
    /// Energy in the inductance of the winding and in the elastic deflection of friction and brake.
    #[port("J", stored)]
    pub energy: f64,
    /// Supply of the electronics.
    #[port(connector)]
    pub supply: Current,
}

/// Winding and friction.
#[derive(State, Clone, Copy, Debug)]
pub struct MotorState {
    /// Current (unused without inductance).
    #[port("A")]
    pub current: f64,
    /// Deflection of the friction's bristle.
    #[port("rad", slider = "m")]
    pub deflection: f64,
}

/// A DC motor.
pub struct DcMotor {
    p: DcMotorParams,
}

impl DcMotor {
    /// Output voltage of the electronics, V.
    fn voltage(&self, u: &DcMotorIn) -> f64 {
        let most = u.supply.voltage.max(0.0);
        u.volts.clamp(-most, most)
    }

    /// Voltage at the winding, V: the voltage of the electronics, or less when they limit the current.
    fn winding(&self, u: &DcMotorIn, current: f64) -> f64 {
        let p = &self.p;
        if current.abs() < p.current_max {
            return self.voltage(u);
        }
        let held = p.resistance * current + p.torque_constant * p.gear * u.shaft.rate;
        // If the commanded voltage would bring the current back below its limit, it applies; otherwise the electronics hold the current at the limit.
        if current > 0.0 { self.voltage(u).min(held) } else { self.voltage(u).max(held) }
    }

    fn current(&self, x: &MotorState, u: &DcMotorIn) -> f64 {
        let p = &self.p;
        let i = if p.inductance > 0.0 {
            x.current
        } else {
            (self.voltage(u) - p.torque_constant * p.gear * u.shaft.rate) / p.resistance
        };
        i.clamp(-p.current_max, p.current_max)
    }

    /// Torque of the winding at the output shaft, before the gear's losses, N m.
    fn drive(&self, current: f64) -> f64 {
        self.p.gear * self.p.torque_constant * current
    }

    fn friction(&self, u: &DcMotorIn, current: f64) -> ShaftFriction {
        let p = &self.p;
        let dry = p.coulomb + if u.brake { p.brake } else { 0.0 };
        let drive = self.drive(current);
        let driven = dry + (1.0 - p.efficiency) * drive.abs();
        let driving = dry + (1.0 / p.efficiency - 1.0) * drive.abs();
        ShaftFriction {
            stiffness: p.hold_stiffness,
            damping: p.hold_damping,
            limits: if drive >= 0.0 { [driven, driving] } else { [driving, driven] },
        }
    }
}

/// Brushed DC motor with gearbox, dry and viscous friction and a brake that holds, at the output shaft.
#[model("actuators.dc_motor")]
impl Model for DcMotor {
    type Params = DcMotorParams;
    type FeedthroughInputs = DcMotorIn;
    type FeedthroughOutputs = DcMotorOut;
    type State = MotorState;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        vec![(Judge::Param("brake"), unwired(wired, "brake", "the brake never holds"))]
    }
    fn feedthrough(&self, x: &MotorState, u: &DcMotorIn) -> DcMotorOut {
        let p = &self.p;
        let current = self.current(x, u);
        let (friction, rate) = (self.friction(u, current), u.shaft.rate);
        let dry = friction.torque(x.deflection, rate);
        let torque = self.drive(current) - p.viscous * rate + dry;
        let bent = p.hold_stiffness * x.deflection;
        let bending = bent * friction.deflection_rate(x.deflection, rate);
        let winding = self.winding(u, current) * current;
        // If the supply has no voltage, the shorted bridge takes no power from it. At the current limit, the bridge
        // turns the rest of the generated power into heat.
        let power = if u.supply.voltage > 0.0 { winding } else { 0.0 };
        DcMotorOut {
            torque: HingeTorque(torque),
            shaft_torque: torque,
            current,
            power,
            case: HeatFlow { heat: p.resistance * current * current + (power - winding) },
            friction: p.viscous * rate * rate - dry * rate - bending,
            energy: 0.5 * (p.inductance * current * current + bent * x.deflection),
            supply: u.supply.current_of(power),
        }
    }
    fn derivatives(&self, x: &MotorState, u: &DcMotorIn) -> MotorState {
        let p = &self.p;
        let emf = p.torque_constant * p.gear * u.shaft.rate;
        let mut rise = 0.0;
        if p.inductance > 0.0 {
            rise = (self.voltage(u) - p.resistance * x.current - emf) / p.inductance;
            // The electronics hold the current at its limit.
            if x.current.abs() >= p.current_max && rise * x.current > 0.0 {
                rise = 0.0;
            }
        }
        let friction = self.friction(u, self.current(x, u));
        MotorState {
            current: rise,
            deflection: friction.deflection_rate(x.deflection, u.shaft.rate),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// More than any test asks for.
    const SUPPLY: Voltage = Voltage { voltage: 1000.0 };

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

    /// Returns the motor after its gear has turned at this rate long enough to slide.
    fn at(volts: f64, rate: f64) -> DcMotorOut {
        let (m, mut x) = (motor(), MotorState::zero());
        let u = DcMotorIn {
            supply: SUPPLY,
            volts,
            brake: false,
            shaft: HingeState { angle: 0.0, rate },
        };
        for _ in 0..20_000 {
            x.deflection += 1e-4 * m.derivatives(&x, &u).deflection;
        }
        m.feedthrough(&x, &u)
    }

    #[test]
    fn stall_no_load_and_saturation() {
        // Nearly at rest, i = 12/2 = 6 A and τ = 0.8 · 100 · 0.05 · 6 = 24 N m. The speed without load is ω
        // = 12/5 = 2.4 rad/s.
        assert!((at(12.0, 1e-3).shaft_torque - 24.0).abs() < 0.021);
        assert!(at(12.0, 2.4).shaft_torque.abs() < 1e-12);
        assert!((at(12.0, 0.0).power - 72.0).abs() < 1e-12);
        assert_eq!(at(1000.0, 0.0).current, 10.0);
        // The bristle of the gear is not deflected before the motor moves.
        assert!((at(12.0, 0.0).shaft_torque - 30.0).abs() < 1e-12);
    }

    #[test]
    fn the_gear_takes_its_share_in_every_quadrant() {
        for volts in [-20.0, -3.0, 0.0, 5.0, 12.0] {
            for rate in [-6.0, -3.0, -0.5, 0.7, 2.0, 5.0] {
                let y = at(volts, rate);
                let drive = 5.0 * y.current;
                let passed = if drive * rate > 0.0 { 0.8 } else { 1.0 / 0.8 };
                assert!((y.shaft_torque - passed * drive).abs() < 1e-9, "{volts} {rate}: {y:?}");
                // Electrical power is the sum of mechanical power, heat of the winding, and loss of
                // the gear.
                let lost = y.power - y.shaft_torque * rate;
                let heat = 2.0 * y.current * y.current;
                let gear = (drive - y.shaft_torque) * rate;
                assert!(gear >= 0.0 && lost >= heat - 1e-9, "{volts} {rate}: {lost} {heat} {gear}");
                // The balance also holds at the current limit, where the electronics reduce the voltage.
                assert!((lost - heat - gear).abs() < 1e-9, "{volts} {rate}");
                assert!((y.supply.current * 1000.0 - y.power).abs() < 1e-9 && y.case.heat == heat);
            }
        }
    }

    #[test]
    fn a_generator_gives_less_than_it_takes() {
        // With shorted terminals, the shaft rotates at 2 rad/s: the current is 5 A, and the heat is 50 W.
        // With η = 0.8 the shaft takes 62.5 W.
        let y = at(0.0, 2.0);
        assert!((y.current + 5.0).abs() < 1e-12 && y.power == 0.0);
        assert!((-y.shaft_torque * 2.0 - 62.5).abs() < 1e-9, "{y:?}");
    }

    #[test]
    fn no_state_and_no_motion_make_energy() {
        // Test random voltages, rates, states and brakes with a fixed seed, with and without
        // inductance.
        let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
        let mut random = move || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
        };
        for k in 0..200_000 {
            let inductance = if k % 2 == 0 { 0.02 } else { 0.0 };
            let p = DcMotorParams { inductance, coulomb: 1.5, viscous: 0.3, ..motor().p };
            let m = DcMotor { p };
            let x = MotorState { current: 10.0 * random(), deflection: 8e-3 * random() };
            let shaft = HingeState { angle: 0.0, rate: 8.0 * random().powi(3) };
            let u = DcMotorIn {
                supply: Voltage { voltage: (40.0 * random()).max(0.0) },
                volts: 40.0 * random(),
                brake: random() > 0.0,
                shaft,
            };
            let y = m.feedthrough(&x, &u);
            let d = m.derivatives(&x, &u);
            let stored = inductance * x.current * d.current + 1e4 * x.deflection * d.deflection;
            let lost = y.power - y.shaft_torque * shaft.rate - stored;
            assert!(lost > -1e-9, "{lost} W made at {u:?} {x:?}");
            let counted = y.case.heat + y.friction;
            assert!((lost - counted).abs() < 1e-9 * (1.0 + lost), "{lost} {counted}: {u:?} {x:?}");
        }
    }

    /// At standstill 10 A through 2 ohm draw 200 W for every command. A motor of 1 ohm at its limit of 5 A draws 25 W at a command of 24 V; an
    /// earlier version drew 120 W.
    #[test]
    fn at_the_limit_of_the_current_only_the_winding_takes_power() {
        let y = at(1000.0, 0.0);
        assert_eq!((y.current, y.power, y.case.heat), (10.0, 200.0, 200.0));
        let p = DcMotorParams { resistance: 1.0, current_max: 5.0, ..motor().p };
        let shaft = HingeState { angle: 0.0, rate: 0.0 };
        let u = DcMotorIn { supply: Voltage { voltage: 28.0 }, volts: 24.0, brake: false, shaft };
        let y = DcMotor { p }.feedthrough(&MotorState::zero(), &u);
        assert_eq!((y.current, y.power), (5.0, 25.0));
        assert!((y.supply.current - 25.0 / 28.0).abs() < 1e-15);
    }

    /// A lower supply voltage gives less torque and speed; without a supply the motor brakes.
    #[test]
    fn it_gives_no_more_than_its_supply() {
        let with = |voltage: f64, volts: f64, rate: f64| {
            let u = DcMotorIn {
                supply: Voltage { voltage },
                volts,
                brake: false,
                shaft: HingeState { angle: 0.0, rate },
            };
            motor().feedthrough(&MotorState::zero(), &u)
        };
        assert_eq!(with(6.0, 12.0, 0.0).current, 3.0);
        assert_eq!(with(6.0, -12.0, 0.0).current, -3.0);
        // At this speed the induced voltage equals the voltage of the supply, and no current flows.
        assert!(with(6.0, 12.0, 1.2).current.abs() < 1e-15);
        let none = with(0.0, 12.0, 0.0);
        assert_eq!((none.current, none.power, none.supply.current), (0.0, 0.0, 0.0));
        let driven = with(0.0, 12.0, 1.0);
        assert_eq!((driven.current, driven.power, driven.case.heat), (-2.5, 0.0, 12.5));
    }

    #[test]
    fn brake_holds_below_its_torque() {
        let m = motor();
        let (mut angle, mut rate, mut x) = (0.0, 0.0, MotorState::zero());
        let (mut early, dt) = (0.0, 1e-3);
        for k in 0..20_000 {
            let u = DcMotorIn {
                supply: SUPPLY,
                volts: 0.0,
                brake: true,
                shaft: HingeState { angle, rate },
            };
            let y = m.feedthrough(&x, &u);
            let d = m.derivatives(&x, &u);
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
        let u = DcMotorIn {
            supply: SUPPLY,
            volts: 4.0,
            brake: false,
            shaft: HingeState { angle: 0.0, rate: 0.0 },
        };
        for _ in 0..1000 {
            let d = m.derivatives(&x, &u);
            x.current += 1e-5 * d.current;
        }
        // The time is one time constant, L/R = 10 ms.
        assert!((x.current - 2.0 * (1.0 - (-1f64).exp())).abs() < 1e-3, "{}", x.current);
    }
}
