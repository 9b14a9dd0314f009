//! Six wheels, each with rate controller, DC motor, wheel load and sampled encoder, and one command: 25 models.
use crate::{end, part};
use linkwork_runtime::prelude::*;
use linkwork_runtime::*;

#[derive(Ports, Clone, Copy)]
pub struct Rate {
    /// Rate.
    #[port("rad/s")]
    pub rate: f64,
}
#[derive(Ports, Clone, Copy)]
pub struct Loop {
    /// Commanded rate.
    #[port("rad/s")]
    pub wanted: f64,
    /// Measured rate.
    #[port("rad/s")]
    pub rate: f64,
}
#[derive(Ports, Clone, Copy)]
pub struct Volts {
    /// Terminal voltage.
    #[port("V")]
    pub volts: f64,
}
#[derive(Ports, Clone, Copy)]
pub struct Terminals {
    /// Terminal voltage.
    #[port("V")]
    pub volts: f64,
    /// Shaft rate.
    #[port("rad/s")]
    pub rate: f64,
}
#[derive(Ports, Clone, Copy)]
pub struct Shaft {
    /// Torque.
    #[port("N m")]
    pub torque: f64,
}
#[derive(State, Clone, Copy)]
pub struct Angle {
    /// Integral of the rate error.
    #[port("rad")]
    pub x: f64,
}
#[derive(State, Clone, Copy)]
pub struct Current {
    /// Winding current.
    #[port("A")]
    pub x: f64,
}
#[derive(State, Clone, Copy)]
pub struct Spin {
    /// Rate.
    #[port("rad/s")]
    pub x: f64,
}

pub struct Command {}
/// A constant rate.
#[model("drive.command")]
impl Model for Command {
    type FeedthroughOutputs = Rate;
    fn feedthrough(&self) -> Rate {
        Rate { rate: 2.0 }
    }
}
pub struct Controller {}
/// ż = e, u = 4 e + 20 z.
#[model("drive.controller")]
impl Model for Controller {
    type FeedthroughInputs = Loop;
    type FeedthroughOutputs = Volts;
    type State = Angle;
    fn feedthrough(&self, x: &Angle, u: &Loop) -> Volts {
        Volts { volts: 4.0 * (u.wanted - u.rate) + 20.0 * x.x }
    }
    fn derivatives(&self, u: &Loop) -> Angle {
        Angle { x: u.wanted - u.rate }
    }
}
pub struct Motor {}
/// L di/dt = u − R i − k ω, τ = k i.
#[model("drive.motor")]
impl Model for Motor {
    type Inputs = Terminals;
    type Outputs = Shaft;
    type State = Current;
    fn outputs(&self, x: &Current) -> Shaft {
        Shaft { torque: 0.1 * x.x }
    }
    fn derivatives(&self, x: &Current, u: &Terminals) -> Current {
        Current { x: 200.0 * (u.volts - 2.0 * x.x - 0.1 * u.rate) }
    }
}
pub struct Wheel {}
/// J ω̇ = τ − b ω.
#[model("drive.wheel")]
impl Model for Wheel {
    type Inputs = Shaft;
    type Outputs = Rate;
    type State = Spin;
    fn outputs(&self, x: &Spin) -> Rate {
        Rate { rate: x.x }
    }
    fn derivatives(&self, x: &Spin, u: &Shaft) -> Spin {
        Spin { x: 20.0 * u.torque - x.x }
    }
}
pub struct Encoder {}
/// The rate of the previous sample.
#[model("drive.encoder")]
impl Model for Encoder {
    type Inputs = Rate;
    type Outputs = Rate2;
    type DiscreteState = Spin;
    fn outputs(&self, d: &Spin) -> Rate2 {
        Rate2 { measured: d.x }
    }
    fn update(&self, u: &Rate) -> Spin {
        Spin { x: u.rate }
    }
}
#[derive(Ports, Clone, Copy)]
pub struct Rate2 {
    /// Measured rate.
    #[port("rad/s")]
    pub measured: f64,
}

pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::model::<Command>(),
        Entry::model::<Controller>(),
        Entry::model::<Motor>(),
        Entry::model::<Wheel>(),
        Entry::model::<Encoder>(),
    ]
}

pub fn six_wheels() -> Spec {
    let mut spec = Spec::default(); // The default is RK4 with 1 ms.
    spec.parts.push(part("command", "drive.command", None));
    for w in 1..=6 {
        for kind in ["controller", "motor", "wheel", "encoder"] {
            let rate = (kind == "encoder").then_some(Seconds { num: 1, den: 1000 });
            spec.parts.push(part(&format!("w{w}.{kind}"), &format!("drive.{kind}"), rate));
        }
        for (from, to) in [
            ("command.rate".to_string(), "controller.wanted"),
            (format!("w{w}.encoder.measured"), "controller.rate"),
            (format!("w{w}.controller.volts"), "motor.volts"),
            (format!("w{w}.wheel.rate"), "motor.rate"),
            (format!("w{w}.motor.torque"), "wheel.torque"),
            (format!("w{w}.wheel.rate"), "encoder.rate"),
        ] {
            let (part, port) = from.rsplit_once('.').unwrap();
            let (to_part, to_port) = to.split_once('.').unwrap();
            spec.wires.push(WireSpec {
                timing: Default::default(),
                from: end(part.into(), port),
                to: end(format!("w{w}.{to_part}"), to_port),
                text: String::new(),
                origin: Origin::NONE,
            });
        }
    }
    spec
}
