//! Assemblies as cargo: only their bodies exist, as one rigid piece, until a phase releases them.
use crate::common::*;
use linkwork_assembly::*;
use linkwork_runtime::{Files, Seconds, Simulation};
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Quat, Vec3};

const CART: &str = r#"Assembly(
    params: { "wheels": (default: 2) },
    bodies: {
        "frame": (parent: "world", hinge: Free, mass: 20, inertia: [2, 3, 4], initial: (velocity: [1, 0, 0])),
        "left": (
            parent: "frame", at: (position: [0, 1, 0]), hinge: Pin(axis: [0, 1, 0], armature: 0.2), mass: 3, inertia: [1, 1, 1],
            damping: 0.1, initial: (angle: 0, rate: 0),
        ),
    },
    parts: {
        "Right": (
            bodies: { "wheel": (parent: "frame", at: (position: [0, -1, 0]), hinge: Pin([0, 1, 0]), mass: 3, inertia: [1, 1, 1]) },
            parts: { "Motor": (model: "test.motor", params: { "resistance": 1 }, bind: { "shaft": "hinge:wheel" }) },
            exports: { "volts": "Motor.volts" },
        ),
        "Drive": (model: "test.drive"),
    },
    couplings: { "axle": (mimic: "left", of: "Right/wheel") },
    colliders: { "ball": (on: "frame", shape: Sphere(0.1)) },
    wires: ["Drive.volts[0] -> Right.volts"],
    exports: { "volts": "Right.volts" },
)"#;

/// A lorry that turns, with a cart on it.
fn lorry(stowed: &str, more: &str) -> String {
    format!(
        r#"Simulation(
    bodies: {{ "lorry": (parent: "world", hinge: Free, mass: 400, inertia: [60, 220, 260], initial: (position: [5, 6, 7], velocity: [3, -1, 2], angular: [0.2, -0.1, 0.4])) }},
    parts: {{ "Cart": (assembly: "cart.ron", {stowed}) }},
    gravity: "none", step: "10 ms", until: "2 s",
    {more}
)"#
    )
}

const STOWED: &str =
    "stowed: (on: \"lorry\", at: (position: [1, 0.5, 2], rotation: (rpy: [0, 0, \"30 deg\"])))";

fn loaded(text: &str) -> Result<Loaded, Failure> {
    let catalogue = catalogue();
    load_text("sim.ron", text, &Options::new(&catalogue).embed("cart.ron", CART))
}

#[test]
fn cargo_is_its_bodies_in_one_piece() {
    let free = loaded(&lorry("", "")).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!((spec(&free).multibody.nv(), free.spec.parts.len()), (6 + 6 + 2, 2));
    let cargo = loaded(&lorry(STOWED, "")).unwrap_or_else(|f| panic!("{f}"));
    let m = &spec(&cargo).multibody;
    assert_eq!((m.nv(), m.bodies().len(), m.couplings().len()), (6, 4, 0));
    assert!(cargo.spec.parts.is_empty() && cargo.spec.wires.is_empty());
    assert!(cargo.colliders.is_none() && free.colliders.is_some());
    let mass =
        |l: &Loaded| spec(l).multibody.bodies().iter().map(|b| b.inertia().mass()).sum::<f64>();
    assert_eq!(mass(&free), mass(&cargo));
    resolves(&cargo);
}

#[test]
fn an_element_of_an_array_may_be_whole() {
    let two = format!("array: [(), (stowed: None)], {STOWED}");
    let two = loaded(&lorry(&two, "")).unwrap_or_else(|f| panic!("{f}"));
    // The simulation has a lorry with a cart on it, and a separate cart with two wheels.
    assert_eq!((spec(&two).multibody.nv(), two.spec.parts.len()), (6 + 6 + 2, 2));
    resolves(&two);
}

#[test]
fn a_phase_lets_it_go_as_it_moves() {
    let phases = r#"start: "on", phases: {
        "on": (to: { "off": "time > 1 s" }),
        "off": (parts: { "Cart": (stowed: None) }),
    }"#;
    let two = loaded(&lorry(STOWED, phases)).unwrap_or_else(|f| panic!("{f}"));
    let program = two.compile(&catalogue(), &Files::default()).unwrap_or_else(|f| panic!("{f}"));
    let mut sim = Simulation::of(std::sync::Arc::new(program));
    while sim.phase() == "on" {
        sim.step_event().unwrap_or_else(|e| panic!("{e}"));
    }
    assert!((sim.time() - 1.0).abs() < 0.011, "{}", sim.time());
    let report = sim.take_moves().remove(0).2;
    let changed = "on another hinge: Cart/frame, Cart.Right/wheel, Cart/left";
    assert!(report.notes.iter().any(|n| n == changed), "{:?}", report.notes);
    assert!(report.new.contains(&"Cart.Right.Motor".to_string()), "{:?}", report.new);
    // It is at the same position, and has the velocity of that point of the lorry.
    let number = |name: String| sim.get(&name).unwrap();
    let get = |name: &str| Vec3::from(["x", "y", "z"].map(|c| number(format!("{name}.{c}"))));
    let turn = |body: &str| {
        let [w, x, y, z] = ["w", "x", "y", "z"].map(|c| number(format!("{body}.rotation.{c}")));
        Quat::from_quaternion(Quaternion::new(w, x, y, z))
    };
    let way = turn("lorry") * Vec3::new(1.0, 0.5, 2.0);
    let place = get("lorry.position") + way;
    assert!((get("Cart/frame.position") - place).norm() < 1e-12, "{place}");
    let velocity = turn("lorry")
        * (get("lorry.velocity") + get("lorry.angular").cross(&Vec3::new(1.0, 0.5, 2.0)));
    assert!((turn("Cart/frame") * get("Cart/frame.velocity") - velocity).norm() < 1e-12);
    assert!(velocity.norm() > 1.0 && sim.get("Cart/left.rate").unwrap().abs() < 1e-12);
    sim.run_until(Seconds { num: 2, den: 1 }).unwrap_or_else(|e| panic!("{e}"));
    assert!(sim.get("Cart/left.rate").unwrap().abs() > 1e-3, "its motor turns its wheels");
}

/// A cart that rolls, is held at its position, and continues from there.
const HELD: &str = r#"start: "rolls", phases: {
    "rolls": (parts: { "Cart": (stowed: None) }, to: { "held": "time > 0.5 s" }),
    "held": (to: { "on": "time > 1 s" }),
    "on": (parts: { "Cart": (stowed: None) }),
}"#;

#[test]
fn what_is_held_stands_where_it_is_without_its_models_and_goes_on_from_there() {
    let held = loaded(&lorry("stowed: (held: true)", "")).unwrap_or_else(|f| panic!("{f}"));
    // All coordinates exist. The coordinates of the cart are prescribed and at rest, and the cart has no other variables.
    assert_eq!((spec(&held).multibody.nv(), held.spec.parts.len()), (6 + 6 + 2, 0));
    assert!(held.spec.wires.is_empty() && held.colliders.is_none());
    resolves(&held);
    let text = lorry("stowed: (held: true)", HELD);
    let all = loaded(&text).unwrap_or_else(|f| panic!("{f}"));
    let program = all.compile(&catalogue(), &Files::default()).unwrap_or_else(|f| panic!("{f}"));
    let mut sim = Simulation::of(std::sync::Arc::new(program));
    let lanes = [
        "Cart/frame.position.x",
        "Cart/frame.rotation.w",
        "Cart/left.angle",
        "Cart.Right/wheel.angle",
    ];
    let places = |sim: &Simulation| lanes.map(|lane| sim.get(lane).unwrap());
    let mut before = places(&sim);
    while sim.phase() == "rolls" {
        sim.step_event().unwrap_or_else(|e| panic!("{e}"));
        if sim.phase() == "rolls" {
            before = places(&sim);
        }
    }
    // The cart is held at its last position. A row of 10 ms may lie between the two readings.
    let taken = places(&sim);
    assert!(sim.get("Cart/frame.velocity.x").unwrap() == 0.0 && taken[2].abs() > 1e-4, "{taken:?}");
    for (a, b) in taken.iter().zip(before) {
        assert!((a - b).abs() < 0.02, "{taken:?} {before:?}");
    }
    while sim.phase() == "held" {
        for (a, b) in places(&sim).iter().zip(taken) {
            assert!((a - b).abs() < 1e-12, "at {} s: {a} {b}", sim.time());
        }
        sim.step_event().unwrap_or_else(|e| panic!("{e}"));
    }
    assert!((sim.time() - 1.0).abs() < 0.011);
    sim.run_until(Seconds { num: 2, den: 1 }).unwrap_or_else(|e| panic!("{e}"));
    assert!((sim.get("Cart/left.angle").unwrap() - taken[2]).abs() > 1e-3, "its motor turns again");
}

#[test]
fn cargo_that_cannot_be_is_refused() {
    let told = |stowed: &str| loaded(&lorry(stowed, "")).err().unwrap().render(false);
    let e = told("stowed: (at: (position: [1, 0, 0]))");
    assert!(e.contains("stowed: (on: ") && e.contains("sim.ron:3"), "{e}");
    let e = told("stowed: (held: true, on: \"lorry\")");
    assert!(
        e.contains("`held` cannot be combined with `on` and `at`") && e.contains("sim.ron:3"),
        "{e}"
    );
    let e = told("stowed: (on: \"lory\")");
    assert!(e.contains("lory") && e.contains("lorry"), "{e}");
    let e = told("stowed: (on: \"lorry\", where: 3)");
    assert!(e.contains("where"), "{e}");
    let e = told("stowed: (on: \"lorry\", at: (position: [1, 0]))");
    assert!(e.contains("position"), "{e}");
    // The cargo has bodies with two parents or with none.
    let with = |from: &str, to: &str| {
        let catalogue = catalogue();
        let cart = CART.replacen(from, to, 1);
        assert_ne!(cart, CART);
        let options = Options::new(&catalogue).embed("cart.ron", cart);
        load_text("sim.ron", &lorry(STOWED, ""), &options).err().unwrap().render(false)
    };
    let e = with(
        "\"left\": (\n            parent: \"frame\"",
        "\"left\": (\n            parent: \"world\"",
    );
    assert!(e.contains("2 of its bodies are connected to the world: `frame`, `left`"), "{e}");
    let e = with("\"frame\": (parent: \"world\"", "\"frame\": (parent: \"/lorry\"");
    assert!(e.contains("none of its bodies is connected to the world"), "{e}");
    // A wire to cargo has no target.
    let e = loaded(&lorry(STOWED, "wires: [\"Cart.volts -> Cart.volts\"],"))
        .err()
        .unwrap()
        .render(false);
    assert!(e.contains("Cart"), "{e}");
}

#[test]
fn a_mistake_of_the_command_line_is_told_once_for_all_phases() {
    let phases = r#"start: "on", phases: { "on": (to: { "off": "time > 1 s" }), "off": () }"#;
    let catalogue = catalogue();
    for wrong in ["Cart.Right.Motor.resistance=0", "Cart.Right.Motor.resistense=1"] {
        let options = Options::new(&catalogue).embed("cart.ron", CART).set(wrong);
        let faults = match load_text("sim.ron", &lorry("", phases), &options) {
            Err(failure) => failure.faults,
            Ok(two) => two.compile(&catalogue, &Files::default()).err().unwrap().0,
        };
        assert_eq!(faults.len(), 1, "{faults:?}");
        assert!(faults[0].message.contains("resist"), "{faults:?}");
    }
}
