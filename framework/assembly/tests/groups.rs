//! Groups of ports: structs of ports, whose number depends on a parameter, connected by one wire.
use linkwork_assembly::{Look, Options, load_text};
use linkwork_runtime::prelude::*;
use linkwork_runtime::{Catalogue, Files, Lanes, Seconds, Simulation};

/// The commands of a wheel.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// Rate.
    #[port("rad/s")]
    pub rate: f64,
    /// Push on the hub.
    #[port("N", frame = "W")]
    pub push: Vec3,
}

/// The number of wheels, and which of them steer.
#[derive(Params, Clone, Debug)]
pub struct FleetParams {
    /// For each wheel: whether it steers.
    pub steered: Vec<bool>,
}
/// Commands each wheel: wheel k at k + 1 rad/s, with a force of k + 2 N along z, steered to k + 3 rad.
pub struct Fleet {
    p: FleetParams,
}
/// Commands each wheel.
#[model("test.fleet")]
impl SizedModel for Fleet {
    type Params = FleetParams;
    fn ports(p: &FleetParams) -> SizedPorts {
        let mut outputs = Vec::new();
        for (k, steered) in p.steered.iter().enumerate() {
            let group = PortSpec::group::<Command>(format!("wheels[{k}].drive"), "Drive.");
            outputs.extend(group);
            if *steered {
                let port = PortSpec::named(format!("wheels[{k}].steer"), PortKind::Numbers, 1);
                outputs.push(port.unit_of("rad"));
            }
        }
        SizedPorts { outputs, ..SizedPorts::default() }
    }
    fn build(p: FleetParams) -> Result<Self, BuildError> {
        Ok(Fleet { p })
    }
    fn outputs(&self, mut y: &mut [f64]) {
        for (k, steered) in self.p.steered.iter().enumerate() {
            let k = k as f64;
            let (drive, rest) = y.split_at_mut(Command::N);
            Command { rate: k + 1.0, push: Vec3::new(0.0, 0.0, k + 2.0) }.put(drive);
            y = rest;
            if *steered {
                y[0] = k + 3.0;
                y = &mut y[1..];
            }
        }
    }
}

/// Receives the steering of the wheels that steer.
pub struct Taker;
/// Takes steering.
#[model("test.taker")]
impl SizedModel for Taker {
    type Params = FleetParams;
    fn ports(p: &FleetParams) -> SizedPorts {
        let steered = p.steered.iter().enumerate().filter(|(_, steered)| **steered);
        let port =
            |k| PortSpec::named(format!("wheels[{k}].steer"), PortKind::Numbers, 1).unit_of("rad");
        SizedPorts { inputs: steered.map(|(k, _)| port(k)).collect(), ..SizedPorts::default() }
    }
    fn build(_: FleetParams) -> Result<Self, BuildError> {
        Ok(Taker)
    }
}

/// Commands of two wheels, and one complete command.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct PairOut {
    /// The two wheels.
    #[port(group)]
    pub pair: [Command; 2],
    /// A third one.
    #[port(group)]
    pub spare: Command,
}
/// Commands two wheels and a spare one.
pub struct Pair;
/// Commands two wheels and a spare one.
#[model("test.pair")]
impl Model for Pair {
    type Outputs = PairOut;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(Pair)
    }
    fn outputs(&self) -> PairOut {
        let command = |rate: f64| Command { rate, push: Vec3::new(rate, 0.0, 0.0) };
        PairOut { pair: [command(5.0), command(6.0)], spare: command(7.0) }
    }
}

/// Inputs of a wheel.
#[derive(Ports, Clone, Copy, Debug)]
pub struct WheelIn {
    /// Its command.
    #[port(group)]
    pub command: Command,
    /// Steering.
    #[port("rad", default = 0.0)]
    pub steer: f64,
}
/// Outputs of a wheel.
#[derive(Ports, Clone, Copy, Debug)]
pub struct WheelOut {
    /// Commanded rate.
    #[port("rad/s")]
    pub rate: f64,
    /// Vertical component of its push.
    #[port("N")]
    pub push: f64,
    /// Commanded steering.
    #[port("rad")]
    pub steer: f64,
}
/// A wheel that reports its commands.
pub struct Wheel;
/// A wheel that reports its commands.
#[model("test.wheel")]
impl Model for Wheel {
    type FeedthroughInputs = WheelIn;
    type FeedthroughOutputs = WheelOut;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(Wheel)
    }
    fn feedthrough(&self, u: &WheelIn) -> WheelOut {
        WheelOut { rate: u.command.rate, push: u.command.push.z, steer: u.steer }
    }
}

fn catalogue() -> Catalogue {
    Catalogue::new([vec![
        Entry::sized::<Fleet>(),
        Entry::sized::<Taker>(),
        Entry::model::<Pair>(),
        Entry::model::<Wheel>(),
    ]])
}

const CORNER: &str = r#"Assembly(
    parts: { "Wheel": (model: "test.wheel") },
    exports: { "drive": "Wheel.command", "steer": "Wheel.steer" },
)"#;

fn options(catalogue: &Catalogue) -> Options<'_> {
    Options::new(catalogue).embed("corner.ron", CORNER)
}

/// Loads, compiles and starts a simulation.
#[track_caller]
fn started(text: &str) -> Simulation {
    let catalogue = catalogue();
    let loaded = load_text("sim.ron", text, &options(&catalogue))
        .unwrap_or_else(|f| panic!("{}", f.show(Look::Plain)));
    // The resolved text gives the same simulation.
    let again = load_text("again.ron", &loaded.resolved, &options(&catalogue)).unwrap();
    let wires = |l: &linkwork_assembly::Loaded| -> Vec<String> {
        l.spec.wires.iter().map(|w| format!("{} -> {}", w.from, w.to)).collect()
    };
    assert_eq!(wires(&loaded), wires(&again));
    let program = loaded.compile(&catalogue, &Files::default()).unwrap_or_else(|f| panic!("{f}"));
    let mut sim = Simulation::of(program.into());
    sim.run_until(Seconds { num: 1, den: 100 }).unwrap();
    sim
}

#[track_caller]
fn refused(text: &str) -> String {
    match load_text("sim.ron", text, &options(&catalogue())) {
        Ok(_) => panic!("loaded, but should have been refused:\n{text}"),
        Err(f) => f.show(Look::Plain),
    }
}

fn values<const N: usize>(sim: &Simulation, paths: [&str; N]) -> [f64; N] {
    paths.map(|p| sim.get(p).unwrap_or_else(|e| panic!("{p}: {e}")))
}

/// A cart whose wheels are exported: some as a group, some by names with a dot.
fn cart(steered: &str, wires: &str) -> String {
    format!(
        r#"Simulation(step: "10 ms", parts: {{
            "Fleet": (model: "test.fleet", params: {{ "steered": {steered} }}),
            "Pair": (model: "test.pair"),
            "Corner": (assembly: "corner.ron", array: [(), (), ()]),
            "Split": (
                parts: {{ "A": (model: "test.wheel"), "B": (model: "test.wheel") }},
                exports: {{ "drive.rate": "A.command.rate", "drive.push": "B.command.push" }},
            ),
        }}, wires: [{wires}])"#
    )
}

#[test]
fn one_wire_joins_all_wheels_and_another_those_that_steer() {
    let sim = started(&cart(
        "[true, false, true]",
        r#""Fleet.wheels[*].drive -> Corner[*].drive",
           "Fleet.wheels[0].steer -> Corner1.steer", "Fleet.wheels[2].steer -> Corner3.steer",
           "Pair.spare.rate -> Split.A.command.rate", "Pair.spare.push -> Split.A.command.push",
           "Pair.pair[1] -> Split.B.command""#,
    ));
    let got = values(&sim, ["Corner1.Wheel.rate", "Corner2.Wheel.rate", "Corner3.Wheel.rate"]);
    assert_eq!(got, [1.0, 2.0, 3.0]);
    let got = values(&sim, ["Corner1.Wheel.push", "Corner2.Wheel.push", "Corner3.Wheel.push"]);
    assert_eq!(got, [2.0, 3.0, 4.0]);
    let got = values(&sim, ["Corner1.Wheel.steer", "Corner2.Wheel.steer", "Corner3.Wheel.steer"]);
    assert_eq!(got, [3.0, 0.0, 5.0]);
    assert_eq!(values(&sim, ["Split.A.rate", "Split.B.rate"]), [7.0, 6.0]);
    assert_eq!(values(&sim, ["Pair.pair[1].rate", "Pair.spare.push.x"]), [6.0, 7.0]);

    // `[*]` selects the wheels that have the port: the first and the third.
    let sim = started(&cart(
        "[true, false, true, true]",
        r#""Fleet.wheels[*].steer -> Corner[*].steer", "Pair.spare -> Corner[*].drive",
           "Pair.spare -> Split.A.command", "Pair.spare -> Split.B.command""#,
    ));
    let got = values(&sim, ["Corner1.Wheel.steer", "Corner2.Wheel.steer", "Corner3.Wheel.steer"]);
    assert_eq!(got, [3.0, 5.0, 6.0]);
    assert_eq!(values(&sim, ["Corner2.Wheel.rate"]), [7.0]);
}

#[test]
fn a_group_of_exports_and_single_ports_and_lanes_of_a_group() {
    let sim = started(&cart(
        "[false]",
        r#""Pair.spare -> Corner[*].drive", "Fleet.wheels[0].drive -> Split.drive",
           "Pair.pair[0].push -> Split.A.command.push", "Pair.pair[0].rate -> Split.B.command.rate""#,
    ));
    assert_eq!(values(&sim, ["Split.A.rate", "Split.B.rate", "Split.B.push"]), [1.0, 5.0, 2.0]);
    assert_eq!(values(&sim, ["Split.A.push"]), [0.0]);

    // The wires use a member of an exported group, and a component of one of its members.
    let sim = started(&cart(
        "[true, true, true]",
        r#""Fleet.wheels[*].drive.rate -> Corner[*].drive.rate", "Pair.pair[1].push -> Corner[*].drive.push",
           "Fleet.wheels[1].drive -> Split.A.command", "Fleet.wheels[2].drive.rate -> Split.B.command.rate",
           "Fleet.wheels[2].drive.push.z -> Split.B.command.push.x",
           "Fleet.wheels[1].drive.push.z -> Split.B.command.push.y",
           "Fleet.wheels[0].drive.push.z -> Split.B.command.push.z""#,
    ));
    assert_eq!(values(&sim, ["Corner3.Wheel.rate", "Split.B.push"]), [3.0, 2.0]);
}

#[test]
fn groups_that_do_not_match_are_refused() {
    let rest = r#""Pair.spare -> Corner[*].drive", "Pair.spare -> Split.A.command", "Pair.spare -> Split.B.command""#;
    started(&cart("[true]", rest));
    for (wire, why) in [
        (
            "Fleet.wheels[0] -> Corner1.drive",
            "has `drive.rate`, but `Corner1.drive` has only rate, push",
        ),
        (
            "Fleet.wheels[0].drive -> Corner1.steer",
            "is a group of ports (rate, push), but `Corner1.steer` is one",
        ),
        ("Fleet.wheels[0].steer -> Corner1.drive", "`Corner1.drive` is a group of ports"),
        ("Fleet.wheels[1].steer -> Corner1.steer", "has no output `wheels[1].steer`"),
        ("Fleet.wheels[*].spin -> Corner1.steer", "has no port `wheels[0].spin`"),
        ("Fleet.wheels[*].drive -> Corner[*].wheels[*].drive", "has no part `wheels`"),
        ("Fleet.wheels[*].drive[*] -> Corner1.drive", "has more than one `[*]`"),
        ("Pair.pair[*] -> Corner[*].drive", "`[*]` is 2 on the left but 3 on the right"),
        ("Pair.pair[2] -> Corner1.drive", "`Pair` has no"),
        ("Pair.spare.rat -> Corner1.drive.rate", "has no output `spare.rat`"),
        ("Pair.spare -> Split.drive.rat", "does not export"),
        ("Pair.spare -> Split.drive[3]", "`drive` is a group of exports, not an array"),
        ("Pair.spare.rate -> Split.drive[7].rate", "`drive` is a group of exports, not an array"),
    ] {
        let mut text = refused_or_compiled(&cart("[true]", &format!("\"{wire}\"")));
        text.retain(|c| c != '\n');
        assert!(text.contains(why), "{wire}: {text}");
    }
    // Elements are connected by their numbers, not by their positions.
    let text = refused(
        r#"Simulation(parts: { "Fleet": (model: "test.fleet", params: { "steered": [true, false, true] }),
            "Taker": (model: "test.taker", params: { "steered": [true, true, false] }) },
            wires: ["Fleet.wheels[*].steer -> Taker.wheels[*].steer"])"#,
    );
    let told =
        "`Fleet.wheels[*].steer` has the elements [0, 2], but `Taker.wheels[*].steer` has [0, 1]";
    assert!(text.contains(told), "{text}");
    // Each name in a group of exports has one port.
    let text = refused(
        r#"Simulation(parts: { "In": (
            parts: { "W": (model: "test.wheel", array: [(), ()]) }, exports: { "drive.rate": "W[*].command.rate" },
        ), "Pair": (model: "test.pair") }, wires: ["Pair.spare -> In.drive"])"#,
    );
    assert!(text.contains("export `drive.rate` of the group `drive` has several ports"), "{text}");
    // These exports have names that are already used.
    for (exports, why) in [
        (r#""W.rate": "W.command.rate""#, "there is also a part `W`"),
        (r#""a": "W.command", "a.b": "W.steer""#, "there is also an export `a`"),
        (r#""a..b": "W.steer""#, "`` cannot be the name of an export"),
    ] {
        let text = refused(&format!(
            r#"Simulation(parts: {{ "In": (parts: {{ "W": (model: "test.wheel") }}, exports: {{ {exports} }}) }})"#
        ));
        assert!(text.contains(why), "{exports}: {text}");
    }
}

/// Returns the faults of loading or compiling.
fn refused_or_compiled(text: &str) -> String {
    let catalogue = catalogue();
    match load_text("sim.ron", text, &options(&catalogue)) {
        Err(f) => f.show(Look::Plain),
        Ok(loaded) => match loaded.compile(&catalogue, &Files::default()) {
            Ok(_) => panic!("accepted:\n{text}"),
            Err(f) => f.to_string(),
        },
    }
}
