//! A small catalogue of toy models, and helpers of the tests.
#![allow(dead_code)]
use linkwork_assembly::{Failure, Loaded, Look, Options, load_text};
use linkwork_collision::Colliders;
use linkwork_plant::{MechanismSpec, SpecExt};
use linkwork_runtime::prelude::*;
use linkwork_runtime::{Catalogue, Files, Seconds, Simulation, Spec, compile};

/// Winding.
#[derive(Params, Clone, Debug)]
pub struct MotorParams {
    /// Winding resistance.
    #[param(unit = "ohm", range = 1e-3..)]
    resistance: f64,
    /// Gear ratio.
    #[param(default = 1.0)]
    gear: f64,
}
#[derive(Ports, Clone, Copy, Debug)]
pub struct MotorIn {
    /// Terminal voltage.
    #[port("V", default = 0.0)]
    volts: f64,
    /// The shaft.
    #[port(bind = "shaft")]
    shaft: HingeState,
}
#[derive(Ports, Clone, Copy, Debug)]
pub struct MotorOut {
    /// Torque on the shaft.
    #[port(bind = "shaft")]
    torque: HingeTorque,
    /// Winding current.
    #[port("A")]
    current: f64,
}
#[derive(State, Clone, Copy, Debug)]
pub struct Winding {
    /// Current.
    #[port("A")]
    current: f64,
}
pub struct Motor {
    p: MotorParams,
}
/// A motor.
#[model("test.motor")]
impl Model for Motor {
    type Params = MotorParams;
    type Inputs = MotorIn;
    type Outputs = MotorOut;
    type State = Winding;
    fn outputs(&self, x: &Winding) -> MotorOut {
        MotorOut { torque: HingeTorque(self.p.gear * x.current), current: x.current }
    }
    fn derivatives(&self, x: &Winding, u: &MotorIn) -> Winding {
        Winding { current: u.volts / self.p.resistance - x.current - u.shaft.rate }
    }
}

/// A single parameter, the level.
#[derive(Params, Clone, Debug)]
pub struct DriveParams {
    /// Level.
    #[param(unit = "V", default = 1.0)]
    level: f64,
}
#[derive(Ports, Clone, Copy, Debug)]
pub struct DriveOut {
    /// Voltage of each wheel.
    #[port("V")]
    volts: [f64; 2],
}
pub struct Drive {
    p: DriveParams,
}
/// Gives two voltages.
#[model("test.drive")]
impl Model for Drive {
    type Params = DriveParams;
    type Outputs = DriveOut;
    fn outputs(&self) -> DriveOut {
        DriveOut { volts: [self.p.level; 2] }
    }
}

#[derive(Ports, Clone, Copy, Debug)]
pub struct BatteryIn {
    /// All loads.
    #[port("A", sum)]
    load: f64,
}
#[derive(State, Clone, Copy, Debug)]
pub struct Charge {
    /// Charge drawn.
    #[port("C")]
    drawn: f64,
}
pub struct Battery;
/// A battery.
#[model("test.battery")]
impl Model for Battery {
    type Params = ();
    type Inputs = BatteryIn;
    type State = Charge;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(Battery)
    }
    fn derivatives(&self, u: &BatteryIn) -> Charge {
        Charge { drawn: u.load }
    }
}

/// Nothing to set.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PadIn {
    /// The node.
    #[port(bind = "hub")]
    hub: NodeState,
}
#[derive(Ports, Clone, Copy, Debug)]
pub struct PadOut {
    /// Push.
    #[port(bind = "hub")]
    push: Wrench,
}
pub struct Pad;
/// Pushes a node.
#[model("test.pad")]
impl Model for Pad {
    type Params = ();
    type FeedthroughInputs = PadIn;
    type FeedthroughOutputs = PadOut;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(Pad)
    }
    fn feedthrough(&self, u: &PadIn) -> PadOut {
        PadOut { push: Wrench { moment: Vec3::zeros(), force: -u.hub.position } }
    }
}

#[derive(Params, Clone, Debug)]
pub struct PushParams {
    /// Acceleration.
    #[param(unit = "m/s^2", default = 0.0)]
    acceleration: f64,
}
#[derive(Ports, Clone, Copy, Debug)]
pub struct PushOut {
    /// Acceleration of the prescribed coordinate.
    #[port(bind = "motion")]
    accel: HingeAccel,
}
pub struct Push {
    p: PushParams,
}
/// A constant acceleration of a prescribed coordinate.
#[model("test.push")]
impl Model for Push {
    type Params = PushParams;
    type Outputs = PushOut;
    fn outputs(&self) -> PushOut {
        PushOut { accel: HingeAccel(self.p.acceleration) }
    }
}

pub fn catalogue() -> Catalogue {
    Catalogue::new([vec![
        Entry::model::<Motor>(),
        Entry::model::<Drive>(),
        Entry::model::<Battery>(),
        Entry::model::<Pad>(),
        Entry::model::<Push>(),
    ]])
}

pub const WHEEL: &str = include_str!("wheel.ron");
pub const ROVER: &str = include_str!("rover.ron");
pub const SIM: &str = include_str!("sim.ron");

pub fn options(catalogue: &Catalogue) -> Options<'_> {
    Options::new(catalogue).embed("parts/wheel.ron", WHEEL).embed("rover.ron", ROVER)
}

pub fn load(text: &str) -> Result<Loaded, Failure> {
    load_text("sim.ron", text, &options(&catalogue()))
}

#[track_caller]
pub fn good(text: &str) -> Loaded {
    load(text).unwrap_or_else(|f| panic!("{}", f.show(Look::Plain)))
}

/// Returns the faults as text.
#[track_caller]
pub fn bad(text: &str) -> String {
    match load(text) {
        Ok(_) => panic!("loaded, but should have been refused:\n{text}"),
        Err(f) => {
            for fault in &f.faults {
                assert!(fault.help.is_some(), "no remedy: {}", fault.message);
            }
            f.show(Look::Plain)
        }
    }
}

/// Returns the colliders as text, with the pairs that collide.
pub fn shown(colliders: &Colliders) -> String {
    let mut out = String::new();
    for a in colliders.ids() {
        let meets: Vec<usize> =
            colliders.ids().filter(|b| colliders.meet(a, *b)).map(|b| b.index()).collect();
        out.push_str(&format!("{:?} meets {meets:?}\n", colliders.spec(a)));
    }
    out
}

/// Runs for some seconds; NaN is a fault of the run.
#[track_caller]
pub fn run(spec: &Spec, seconds: f64) -> Simulation {
    let plan = compile(spec, &catalogue(), &Files::default()).unwrap_or_else(|f| panic!("{f}"));
    let mut sim = Simulation::new(std::sync::Arc::new(plan));
    let end = Seconds { num: (seconds * 1000.0).round() as u64, den: 1000 };
    sim.run_until(end).unwrap_or_else(|e| panic!("{e}"));
    sim
}

/// Returns everything in a specification that affects a run, as text (without positions).
pub fn digest(spec: &Spec) -> String {
    use std::fmt::Write;
    let mut out = String::new();
    for p in &spec.parts {
        let _ = writeln!(
            out,
            "{} = {} {} rate {:?} offset {:?} folder {:?}",
            p.path, p.model, p.params.value, p.rate, p.offset, p.folder
        );
    }
    for w in &spec.wires {
        let _ = writeln!(out, "{} -> {}", w.from, w.to);
    }
    for b in &spec.binds {
        let _ = writeln!(out, "{} {} {:?}", b.part, b.bind, b.target);
    }
    if let Some(m) = spec.mechanism() {
        let _ = writeln!(out, "{} {:?}\n{:?}\n{:?} {:?}", m.path, m.gravity, m.multibody, m.q, m.v);
        let _ = writeln!(out, "{:?} {:?}", m.constraint_methods, m.motions);
        if let Some(c) = &m.contact {
            let _ = writeln!(out, "{:?}\n{}", c.settings, shown(&c.colliders));
        }
    }
    let _ = writeln!(out, "{:?} {:?} {}", spec.step, spec.integrator, spec.seed);
    out
}

/// Returns the mechanism of a text.
pub fn spec(loaded: &Loaded) -> &MechanismSpec {
    loaded.spec.mechanism().unwrap_or_else(|| panic!("there is no mechanism"))
}

/// Expects exactly these faults, in this order; a text with `+` is part of the fault before.
#[track_caller]
pub fn faults(text: &str, expected: &[&str]) {
    let shown = bad(text);
    let count = shown.matches("error: ").count();
    for part in expected {
        let part = part.trim_start_matches('+');
        assert!(shown.contains(part), "\n{part}\nis not in\n{shown}\nof\n{text}");
    }
    assert_eq!(count, expected.iter().filter(|e| !e.starts_with('+')).count(), "{shown}");
}

/// Expects the same from the resolved text, and from the text resolved once more.
#[track_caller]
pub fn resolves(loaded: &Loaded) {
    let catalogue = catalogue();
    let again = load_text("r.ron", &loaded.resolved, &Options::new(&catalogue));
    let again = again.unwrap_or_else(|f| panic!("{f}\n{}", loaded.resolved));
    assert_eq!(digest(&again.spec), digest(&loaded.spec));
    assert_eq!(again.shapes, loaded.shapes);
    let once = load_text("r.ron", &again.resolved, &Options::new(&catalogue));
    assert_eq!(once.unwrap_or_else(|f| panic!("{f}")).resolved, again.resolved);
}
