//! The Rust builder prints RON that reads back as the same form, and loads.
use crate::common::*;
use linkwork_assembly::*;

fn rover() -> Assembly {
    let axle = Assembly::new("Axle")
        .doc("A wheel and its motor.")
        .body(
            "wheel",
            fields! {
                parent: "chassis",
                hinge: variant("Pin", [0, 1, 0]),
                at: fields! { position: ["$half", "0", "-0.1 m"] },
                mass: 3.5,
                inertia: variant("Cylinder", fields! { radius: 0.2, length: 0.1, axis: [0, 1, 0] }),
                nodes: fields! { "hub": fields! { position: [0.0, 0.1, 1e-7] } },
            },
        )
        .part("Motor", "test.motor", fields! { resistance: "0.6 ohm", gear: 20 })
        .bind("Motor", "shaft", "hinge:wheel")
        .part("Drive", "test.drive", fields! {})
        .rate("Drive", "50 Hz")
        .export("volts", "Motor.volts");
    Assembly::new("Rover")
        .doc("Says \"hello\" and \\ goodbye.")
        .param("track", fields! { unit: "m", default: 1.2, range: [0.1, 5.0], doc: "Track." })
        .param("half", fields! { unit: "m", default: "$track / 2", doc: "Half of it." })
        .body("chassis", fields! { parent: "world", hinge: variant("Free", Value::Null),
            mass: "20 kg", inertia: [1.0, 2.0, 2.5], initial: fields! { velocity: [0.0, -0.0, 1e300] } })
        .nest("Axle", axle)
        .wire("Axle.Drive.volts[1] -> Axle.volts")
        .set("Axle.Motor.gear", 30)
}

#[test]
fn to_ron_reads_back_as_the_same_form() {
    let ron = rover().to_ron();
    let again = Assembly::from_ron("rover.ron", &ron).unwrap_or_else(|f| panic!("{f}\n{ron}"));
    assert_eq!(again.to_ron(), ron);
    for text in [WHEEL, ROVER] {
        let read = Assembly::from_ron("file", text).unwrap();
        let printed = read.to_ron();
        let again =
            Assembly::from_ron("file", &printed).unwrap_or_else(|f| panic!("{f}\n{printed}"));
        assert_eq!(again.to_ron(), printed);
        assert_eq!(again.bodies.len(), read.bodies.len());
        assert_eq!(again.overrides.len(), read.overrides.len());
    }
}

#[test]
fn a_built_assembly_loads_alone_and_in_a_simulation() {
    let catalogue = catalogue();
    let options = Options::new(&catalogue);
    let alone = load_text("rover.ron", &rover().to_ron(), &options);
    let alone = alone.unwrap_or_else(|f| panic!("{f}"));
    let ron = rover().to_simulation(fields! { step: "1 ms", until: 10 });
    let inside = load_text("sim.ron", &ron, &options).unwrap_or_else(|f| panic!("{f}\n{ron}"));
    assert_eq!(digest(&alone.spec), digest(&inside.spec));
    assert_eq!(inside.spec.parts[1].path, "Rover.Axle.Motor");
    assert_eq!(
        inside.spec.parts[1].params.value.to_string(),
        r#"{"gear": 30.0, "resistance": "0.6 ohm"}"#
    );
    assert_eq!(inside.spec.wires[0].from.to_string(), "Rover.Axle.Drive.volts[1]");
    let m = inside.spec.mechanism().cloned().unwrap();
    let wheel = m.multibody.get(m.multibody.body("Rover.Axle/wheel").unwrap());
    assert_eq!(wheel.hinge_in_parent().position.x, 0.6);
}

#[test]
fn embedded_wheel_file_equals_the_file_printed_by_the_builder() {
    let catalogue = catalogue();
    let first = load_text("sim.ron", SIM, &options(&catalogue)).unwrap();
    let wheel = Assembly::from_ron("wheel", WHEEL).unwrap().to_ron();
    let printed = options(&catalogue).embed("parts/wheel.ron", wheel);
    let second = load_text("sim.ron", SIM, &printed).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(digest(&first.spec), digest(&second.spec));
}
