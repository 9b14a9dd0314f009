//! Assemblies that a program builds: the same specification as from a file, the same checks, each mistake at its call.
use crate::common::*;
use linkwork_assembly::form::AssemblyForm;
use linkwork_assembly::*;
use linkwork_collision::Shape;
use linkwork_multibody::{Coordinate, Friction, Hinge, Limits, Spring, Stop, Subhinge};
use linkwork_runtime::prelude::{Model, Ports, Vec3, model};
use linkwork_runtime::{Integrator, ParamsBuilder, Value};
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Mat3, Pose, Quat};

/// The same as `built`, written by hand.
const FILE: &str = r#"Simulation(
    params: { "half": (unit: "m", default: 0.6, doc: "Half of the track.") },
    bodies: {
        "chassis": (
            parent: "world", hinge: Free, mass: 20, com: [0.1, 0, -0.2], inertia: [1, 2, 2.5],
            initial: (position: [0, 0, 3], velocity: [0, 0, 1e3], angular: [0.1, 0.2, 0.3],
                rotation: (quat: [0, 0, 1, 0])),
            nodes: { "mast": (position: [0, 0, 1]), "camera": (position: [1, 2, 3], rotation: (quat: [1, 0, 0, 0])) },
        ),
    },
    parts: {
        "Axle": (
            bodies: {
                "wheel": (
                    parent: "chassis", hinge: Pin([0, 1, 0]), at: (position: ["$half", 0, -0.1]), mass: 3.5,
                    inertia: Cylinder(radius: 0.2, length: 0.1), initial: (angle: 0.5, rate: -2), damping: 0.3,
                    shapes: [(shape: Sphere(0.2))],
                ),
            },
            parts: {
                "Motor": (model: "test.motor", params: { "resistance": "0.6 ohm", "gear": 20 }, bind: { "shaft": "hinge:wheel" }),
                "Drive": (model: "test.drive", rate: "50 Hz"),
            },
            exports: { "volts": "Motor.volts" },
        ),
        "Battery": (model: "test.battery"),
        "Pad": (model: "test.pad", bind: { "hub": "node:chassis/mast" }),
    },
    wires: [
        (wire: "Axle.Drive.volts[1] -> Axle.volts", delay: 2, initial: [0.5]),
        "Axle.Motor.current -> Battery.load",
    ],
    overrides: { "Axle.Motor.gear": 30 },
    step: "2 ms", integrator: "dormand_prince_54", accuracy: (relative: 1e-8, absolute: 1e-10), seed: 7,
)"#;

fn built() -> Assembly {
    let mut axle = Assembly::new();
    axle.body(
        "wheel",
        Body::on("chassis")
            .hinge(Hinge::pin(Vec3::y()))
            .set("at", fields! { position: fields_of_position() })
            .mass(3.5)
            .inertia(Shape::Cylinder { radius: 0.2, half_length: 0.05 })
            .initial_angle(0.5)
            .initial_rate(-2.0)
            .set("damping", 0.3)
            .shape(&Shape::Sphere { radius: 0.2 }),
    );
    axle.part::<Motor>("Motor", |p| p.resistance(0.6).gear(20)).bind("shaft", "hinge:wheel");
    axle.part::<Drive>("Drive", |p| p).rate("50 Hz");
    axle.export("volts", "Motor.volts");

    let mut rover = Assembly::new();
    rover.param("half", fields! { unit: "m", default: 0.6, doc: "Half of the track." });
    let turn = Quat::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0));
    rover.body(
        "chassis",
        Body::on("world")
            .hinge(Hinge::free())
            .mass(20.0)
            .com([0.1, 0.0, -0.2])
            .inertia([1.0, 2.0, 2.5])
            .initial_position([0.0, 0.0, 3.0])
            .initial_velocity([0.0, 0.0, 1e3])
            .initial_angular_velocity([0.1, 0.2, 0.3])
            .initial("rotation", fields! { quat: [0.0, 0.0, 1.0, 0.0] })
            .node("mast", [0.0, 0.0, 1.0])
            .node("camera", Pose::new(turn, Vec3::new(1.0, 2.0, 3.0))),
    );
    rover.nest("Axle", axle);
    rover.part::<Battery>("Battery", |p| p);
    rover.model("Pad", "test.pad", fields! {}).bind("hub", "node:chassis/mast");
    rover.part::<Pad>("Other", |p| p).bind("hub", "node:chassis");
    rover.wire("Axle.Drive.volts[1]", "Axle.volts").delay(2).initial(0.5);
    rover.wire("Axle.Motor.current", "Battery.load");
    rover.override_param("Axle.Motor.gear", 30);
    rover.step(2e-3).integrator(Integrator::DormandPrince).accuracy(1e-8, 1e-10).set("seed", 7);
    rover
}

fn fields_of_position() -> Vec<Value> {
    vec!["$half".into_value(), 0.0.into_value(), (-0.1).into_value()]
}

#[test]
fn it_gives_the_specification_of_the_file_that_says_the_same() {
    let file = FILE.replace(
        "\"Pad\":",
        "\"Other\": (model: \"test.pad\", bind: { \"hub\": \"node:chassis\" }), \"Pad\":",
    );
    let (file, built) = (good(&file.replace("\"0.6 ohm\"", "0.6")), built());
    let loaded = built.load().unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(digest(&loaded.spec), digest(&file.spec));
    assert_eq!(loaded.shapes, file.shapes);
    assert_eq!(loaded.spec.accuracy, file.spec.accuracy);
    // The resolved text of the builder gives the same specification, too.
    assert_eq!(digest(&good(&loaded.resolved).spec), digest(&file.spec));
    // So does the printed text.
    let printed = good(&built.to_ron());
    assert_eq!(digest(&printed.spec), digest(&file.spec));
}

/// Line of a call below `line`.
fn at(line: u32) -> String {
    format!("--> {}:{line}:", file!())
}

/// Checks that each message is reported with the place of its line, and no others are.
#[track_caller]
fn reported(failure: Option<Failure>, expected: &[(&str, u32)]) {
    let shown = failure.expect("it has mistakes").to_string();
    for (message, line) in expected {
        let found = shown.split("error: ").any(|f| f.contains(message) && f.contains(&at(*line)));
        assert!(found, "`{message}` at line {line} is not in\n{shown}");
    }
    assert_eq!(shown.matches("error: ").count(), expected.len(), "{shown}");
    assert_eq!(shown.matches("help: ").count(), expected.len(), "{shown}");
}

#[test]
fn every_mistake_is_reported_at_its_call_and_all_at_once() {
    let mut rover = Assembly::new();
    let first = line!();
    rover.part::<Motor>("Motor", |p| p.resistance(-1.0).set("gears", 3).set("gear", "2 V"));
    rover.part::<Battery>("Battery", |p| p.set("level", 1.0));
    rover.model("Fan", "test.fan", fields! {});
    rover.body("bob", Body::on("wold").mass(f64::NAN));
    rover.part::<Drive>("Drive", |p| p);
    rover.part::<Drive>("Drive", |p| p);
    rover.step("1 kg").set("gravitty", "none");
    let expected = [
        ("`Motor.resistance` = -1 ohm is out of range", first + 1),
        ("`Motor` has no parameter `gears`", first + 1),
        ("`Motor.gear`: `2 V` is in V, but a plain number is expected", first + 1),
        ("`Battery` has no parameter `level`", first + 2),
        ("there is no model `test.fan`", first + 3),
        ("there is no body `wold`", first + 4),
        ("`mass` is NaN", first + 4),
        ("there are two entries `Drive` in `parts`", first + 6),
        ("`step`: `1 kg` is not a time", first + 7),
        ("simulation has no field `gravitty`", first + 7),
    ];
    reported(rover.load().err(), &expected);
}

#[test]
fn what_the_compiler_of_plans_finds_has_the_place_of_its_call() {
    let mut rover = Assembly::new();
    let first = line!();
    rover.part::<Motor>("Motor", |p| p);
    reported(rover.ready().err(), &[("required parameter `resistance` is missing", first + 1)]);
    let mut wired = Assembly::new();
    let first = line!();
    wired.part::<Drive>("Drive", |p| p.level(2.0)).rate("50 Hz");
    wired.part::<Battery>("Battery", |p| p);
    wired.wire("Drive.volt[0]", "Battery.load");
    reported(wired.ready().err(), &[("volt", first + 3)]);
}

#[derive(Ports, Clone, Copy)]
struct ImpostorOut {
    /// Nothing.
    #[port("1")]
    zero: f64,
}
struct Impostor {}
/// It takes the name of another model.
#[model("test.motor")]
impl Model for Impostor {
    type Outputs = ImpostorOut;
    fn outputs(&self) -> ImpostorOut {
        ImpostorOut { zero: 0.0 }
    }
}

#[test]
fn two_types_of_one_name_are_refused_and_one_type_may_come_twice() {
    let mut rover = Assembly::new();
    rover.with_library(&Library { catalogue: catalogue(), ..Library::default() });
    rover.with_library(&Library { catalogue: catalogue(), ..Library::default() });
    rover.part::<Drive>("Drive", |p| p);
    assert!(rover.load().is_ok());
    let line = line!() + 1;
    rover.part::<Impostor>("Motor", |p| p);
    let shown = rover.load().err().unwrap().to_string();
    assert!(shown.contains("two types of parts have the name `test.motor`"), "{shown}");
    assert!(shown.contains(&at(line)), "{shown}");
}

#[test]
fn hinges_poses_and_inertias_come_back_with_all_their_digits() {
    let limits = Limits { lower: -0.1, upper: 0.7, rate: 3.0, ..Limits::default() };
    let hinge = Hinge {
        subhinges: vec![
            Subhinge {
                limits,
                stop: Stop::Soft { stiffness: 1e4, damping: 0.02 },
                spring: Spring { stiffness: 20.0, rest: 0.1 },
                damping: 0.3,
                friction: Friction { force: 0.5, rate: 0.01 },
                armature: 0.02,
                gear: 50.0,
                ..Hinge::pin(Vec3::new(1.0, 2.0, 2.0) / 3.0).subhinges.remove(0)
            },
            Subhinge {
                coordinate: Coordinate::Prescribed,
                ..Hinge::slider(Vec3::x()).subhinges.remove(0)
            },
        ],
    };
    let pose = Pose::new(Quat::from_euler_angles(0.1, 0.2, 0.3), Vec3::new(1.0, -2.0, 1.0 / 3.0));
    let J = Mat3::new(2.0, 0.1, 0.2, 0.1, 3.0, 0.3, 0.2, 0.3, 4.0);
    let mut arm = Assembly::new();
    arm.body(
        "link",
        Body::on("world")
            .at(pose)
            .hinge(hinge.clone())
            .hinge_frame([0.0, 0.0, 0.5])
            .mass(2.0)
            .inertia(J),
    );
    let loaded = arm.load().unwrap_or_else(|f| panic!("{f}"));
    let m = &spec(&loaded).multibody;
    let link = m.get(m.body("link").unwrap());
    let read: Vec<Subhinge> = link.subhinges().iter().map(|s| s.subhinge).collect();
    assert_eq!(read, hinge.subhinges);
    assert_eq!(link.hinge_in_parent(), pose);
    assert_eq!(link.mass_properties().inertia_com, J);
}

#[test]
fn a_value_that_is_no_number_is_refused_wherever_it_is_given() {
    let nan = f64::NAN;
    let free = || Body::on("world").hinge(Hinge::free()).mass(1.0).inertia([1.0; 3]);
    let mut limited = Hinge::pin(Vec3::y());
    limited.subhinges[0].limits.upper = nan;
    let pin = |hinge: Hinge| Body::on("world").hinge(hinge).mass(1.0).inertia([1.0; 3]);
    for (what, body) in [
        ("mass", free().mass(nan)),
        ("com", free().com([nan, 0.0, 0.0])),
        ("inertia", free().inertia([1.0, nan, 1.0])),
        ("at", free().at([0.0, nan, 0.0])),
        ("initial", free().initial_velocity([0.0, nan, 0.0])),
        ("upper", pin(limited)),
        ("axis", pin(Hinge::pin(Vec3::new(nan, 0.0, 0.0)))),
        ("shapes", free().shape(&Shape::Sphere { radius: nan })),
    ] {
        let mut assembly = Assembly::new();
        assembly.body("b", body);
        let shown = assembly.load().err().map(|f| f.to_string()).unwrap_or_default();
        assert!(shown.contains("NaN"), "{what}: {shown}");
    }
}

#[test]
fn forms_of_files_print_what_reads_back_as_the_same_form() {
    for text in [WHEEL, ROVER] {
        let read = AssemblyForm::from_ron("file", text).unwrap();
        let printed = read.to_ron();
        let again =
            AssemblyForm::from_ron("file", &printed).unwrap_or_else(|f| panic!("{f}\n{printed}"));
        assert_eq!(again.to_ron(), printed);
        assert_eq!(again.bodies.len(), read.bodies.len());
        assert_eq!(again.overrides.len(), read.overrides.len());
    }
    let catalogue = catalogue();
    let first = load_text("sim.ron", SIM, &options(&catalogue)).unwrap();
    let wheel = AssemblyForm::from_ron("wheel", WHEEL).unwrap().to_ron();
    let printed = options(&catalogue).embed("parts/wheel.ron", wheel);
    let second = load_text("sim.ron", SIM, &printed).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(digest(&first.spec), digest(&second.spec));
}

#[test]
fn included_files_are_found_in_the_library() {
    let mut library = Library { catalogue: catalogue(), ..Library::default() };
    let files = [("parts/wheel.ron", WHEEL), ("rover.ron", ROVER)];
    library.embedded =
        std::sync::Arc::new(files.map(|(name, text)| (name.to_string(), text.to_string())).into());
    let mut sim = Assembly::new();
    sim.with_library(&library).include("Rover", "rover.ron");
    let written = good("Simulation(parts: { \"Rover\": (assembly: \"rover.ron\") })");
    let loaded = sim.load().unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(digest(&loaded.spec), digest(&written.spec));
    let line = line!() + 1;
    sim.include("Second", "rovr.ron");
    let shown = sim.load().err().unwrap().to_string();
    assert!(shown.contains("rovr.ron") && shown.contains(&at(line)), "{shown}");
}
