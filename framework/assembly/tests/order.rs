//! Results do not depend on the order of a file.
use crate::common::*;
use linkwork_assembly::*;
use linkwork_runtime::{Files, compile};

const SHUFFLED: &str = r#"
Assembly(
    wires: ["Drive.volts[*] -> Hardware.Wheel[*].volts"],
    overrides: { "Hardware.Wheel2.Motor.gear": 20 },
    parts: {
        "Drive": (offset: "5 ms", model: "test.drive", rate: "50 Hz"),
        "Hardware": (
            wires: ["Wheel2.current -> Battery.load", "Wheel1.current -> Battery.load"],
            parts: {
                "Battery": (model: "test.battery"),
                "Wheel2": (mounts: { "strut": "chassis" }, assembly: "parts/wheel.ron", params: { "mass": "$mass / 10" }),
                "Wheel1": (mounts: { "strut": "chassis/left" }, params: { "x": "50 cm", "mass": "$mass / 10" }, assembly: "parts/wheel.ron"),
                "Spares": (model: "test.battery", array: []),
            },
        ),
    },
    bodies: {
        "chassis": (
            nodes: { "right": (position: [0, -0.5, 0]), "left": (position: [0, 0.5, 0]) },
            initial: (rotation: (rpy: [0, 0, "90 deg"]), velocity: [1, 0, 0], position: [0, 0, 1]),
            inertia: Box([2, 1, 0.5]), mass: "$mass", hinge: Free, parent: "world",
        ),
    },
    doc: "A chassis with two wheels.",
    params: { "mass": (doc: "Mass of the chassis.", default: 100, unit: "kg") },
)
"#;

#[test]
fn the_order_of_the_text_leaves_no_trace() {
    let catalogue = catalogue();
    let first = load_text("sim.ron", SIM, &options(&catalogue)).unwrap();
    // The second file has two single wheels instead of an array, with separate wires.
    let shuffled = SHUFFLED.replace(
        "\"Drive.volts[*] -> Hardware.Wheel[*].volts\"",
        "\"Drive.volts[1] -> Hardware.Wheel2.volts\", \"Drive.volts[0] -> Hardware.Wheel1.volts\"",
    );
    let second = load_text("sim.ron", SIM, &options(&catalogue).embed("rover.ron", shuffled))
        .unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(digest(&first.spec), digest(&second.spec));
    assert_eq!(first.resolved, second.resolved);
    assert_eq!(first.shapes, second.shapes);
}

#[test]
fn what_loads_compiles_and_so_does_its_resolved_text() {
    let catalogue = catalogue();
    let loaded = load_text("sim.ron", SIM, &options(&catalogue)).unwrap();
    let files = Files::default();
    if let Err(faults) = compile(&loaded.spec, &catalogue, &files) {
        panic!("{}", show_faults(&faults.0, &loaded.sources, Look::Plain));
    }
    let again = load_text("r.ron", &loaded.resolved, &Options::new(&catalogue)).unwrap();
    assert!(compile(&again.spec, &catalogue, &files).is_ok());
}

#[test]
fn faults_of_compile_are_shown_at_their_place() {
    let catalogue = catalogue();
    let wheel = WHEEL.replace("\"resistance\": \"600 mohm\"", "\"resistence\": \"600 mohm\"");
    let options = options(&catalogue).embed("parts/wheel.ron", wheel).set("Rover.Drive.level=3 A");
    let loaded = load_text("sim.ron", SIM, &options).unwrap();
    let faults = compile(&loaded.spec, &catalogue, &Files::default()).err().unwrap();
    let shown = show_faults(&faults.0, &loaded.sources, Look::Plain);
    assert!(shown.contains("parts/wheel.ron:27:"), "{shown}");
    assert!(shown.contains("did you mean `resistance`?"), "{shown}");
    assert!(shown.contains("but V is expected\n  --> --set:1:19\n"), "{shown}");
}
