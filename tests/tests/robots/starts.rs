//! Initial states of mechanisms with loops and couplings: written values stay, the others follow, for every `solve`.
use crate::common;
use linkwork_assembly::{Look, Options, load_text, show_faults};
use linkwork_runtime::{Files, Simulation};
use std::f64::consts::PI;
use std::sync::Arc;

fn started(text: &str) -> Result<Simulation, String> {
    let catalogue = common::catalogue();
    let loaded =
        load_text("sim.ron", text, &Options::new(&catalogue)).map_err(|f| f.render(false))?;
    let program = loaded.compile(&catalogue, &Files::default());
    let program = program.map_err(|f| show_faults(&f.0, &loaded.sources, Look::Plain))?;
    let sim = Simulation::of(Arc::new(program));
    sim.check().map_err(|e| e.to_string())?;
    Ok(sim)
}

fn values<const N: usize>(sim: &Simulation, names: [&str; N]) -> [f64; N] {
    names.map(|name| sim.get(name).unwrap())
}

const SOLVES: [&str; 3] = ["Auto", "Embed", "Augment"];

/// A gear pair b = 2 a with the values written for each.
fn gears(a: &str, b: &str, solve: &str) -> Result<Simulation, String> {
    started(&format!(
        r#"Simulation(gravity: "none",
            bodies: {{
                "a": (parent: "world", hinge: Pin([0, 1, 0]), {a} mass: 1, inertia: [1e-3, 1e-3, 1e-3]),
                "b": (parent: "world", at: (position: [1, 0, 0]), hinge: Pin([0, 1, 0]), {b} mass: 1, inertia: [1e-3, 1e-3, 1e-3]),
            }},
            couplings: {{ "g": (mimic: "b", of: "a", ratio: 2, solve: {solve}) }}, until: "1 s")"#
    ))
}

/// Simbody #221, dairlib PR 134: a gear pair with a written rate, or angle, of one member. The other must follow; both used to be zero, or smaller,
/// depending on the method that solves the coupling.
#[test]
fn what_is_written_for_one_gear_stays_and_the_other_follows() {
    for solve in SOLVES {
        for (written, other) in [("a", "b"), ("b", "a")] {
            let ratio = if written == "a" { 2.0 } else { 0.5 };
            let initial = r#"initial: (angle: "30 deg", rate: 3),"#;
            let of = |name: &str| if name == written { initial } else { "" };
            let sim = gears(of("a"), of("b"), solve).unwrap();
            let (angle, rate) = (PI / 6.0, 3.0);
            let own = [format!("{written}.angle"), format!("{written}.rate")];
            assert_eq!(values(&sim, [&*own[0], &*own[1]]), [angle, rate], "{solve}");
            let its = [format!("{other}.angle"), format!("{other}.rate")];
            let [q, v] = values(&sim, [&*its[0], &*its[1]]);
            let off = (q - ratio * angle).abs() + (v - ratio * rate).abs();
            assert!(off < 1e-12, "{solve}: {q} {v}");
        }
        // The file gives the angle of one gear and the rate of the other.
        let sim = gears("initial: (angle: 0.2),", "initial: (rate: -5),", solve).unwrap();
        let all = values(&sim, ["a.angle", "a.rate", "b.angle", "b.rate"]);
        let off = all.iter().zip([0.2, -2.5, 0.4, -5.0]).map(|(x, y)| (x - y).abs()).sum::<f64>();
        assert!(off < 1e-12, "{solve}: {all:?}");
    }
}

/// ros/robot_model PR 177: a gripper whose driver is opened to 0.5 rad. left = 0.1 − 1.5 drive, right = 0.02 + 0.04 left.
#[test]
fn a_gripper_opens_with_its_driver() {
    for solve in SOLVES {
        let sim = started(&format!(
            r#"Simulation(gravity: "none",
                bodies: {{
                    "drive": (parent: "world", hinge: Pin([0, 1, 0]), initial: (angle: 0.5, rate: 1), mass: 0.2, com: [0.1, 0, 0], inertia: [1e-3, 2e-3, 2e-3]),
                    "left": (parent: "world", hinge: Pin([1, 0, 0]), mass: 0.3, com: [0, 0.05, 0], inertia: [1e-3, 1e-3, 1e-3]),
                    "right": (parent: "world", hinge: Slider([0, 1, 0]), mass: 0.3, com: [0, 0.05, 0], inertia: [1e-3, 1e-3, 1e-3]),
                }},
                couplings: {{
                    "l": (mimic: "left", of: "drive", ratio: -1.5, offset: 0.1, solve: {solve}),
                    "r": (mimic: "right", of: "left", ratio: 0.04, offset: 0.02, solve: {solve}),
                }}, until: "1 s")"#
        ));
        let sim = sim.unwrap();
        assert_eq!(values(&sim, ["drive.angle", "drive.rate"]), [0.5, 1.0]);
        let follow = ["left.angle", "right.displacement", "left.rate", "right.speed"];
        let all = values(&sim, follow);
        let want = [-0.65, -0.006, -1.5, -0.06];
        assert!(all.iter().zip(want).all(|(x, y)| (x - y).abs() < 1e-12), "{solve}: {all:?}");
    }
}

/// A slider-crank with r = 0.1 m and l = 0.4 m, and the values written for crank, rod and piston.
fn slider_crank(initial: [&str; 3], solve: &str) -> Result<Simulation, String> {
    let [crank, rod, piston] = initial;
    started(&format!(
        r#"Simulation(gravity: "none",
            bodies: {{
                "crank": (parent: "world", hinge: Pin([0, 1, 0]), {crank} mass: 1, com: [0.05, 0, 0], inertia: [1e-3, 1e-3, 1e-3]),
                "rod": (parent: "crank", at: (position: [0.1, 0, 0]), hinge: Pin([0, 1, 0]), {rod} mass: 0.5, com: [0.2, 0, 0], inertia: [1e-4, 7e-3, 7e-3]),
                "piston": (parent: "world", hinge: Slider([1, 0, 0]), {piston} mass: 0.8, inertia: [1e-3, 1e-3, 1e-3]),
            }},
            loops: {{ "wrist": (a: "rod", at_a: (position: [0.4, 0, 0]), b: "piston", hinge: Pin([0, 1, 0]), solve: {solve}) }},
            until: "1 s")"#
    ))
}

/// The crank keeps its written position and rate; rod and piston follow on the branch nearest to the file.
#[test]
fn a_slider_crank_starts_at_its_crank_on_the_branch_that_is_near() {
    let (crank, rate) = ((-40.0_f64).to_radians(), 3.0);
    let written = r#"initial: (angle: "-40 deg", rate: 3),"#;
    for solve in SOLVES {
        for (rod, piston, side) in [
            ("", "", 1.0),
            (r#"initial: (angle: "50 deg", approximate: true),"#, "", 1.0),
            (
                r#"initial: (angle: "210 deg", approximate: true),"#,
                r#"initial: (position: "-30 cm", approximate: true),"#,
                -1.0,
            ),
        ] {
            let sim = slider_crank([written, rod, piston], solve).unwrap();
            assert_eq!(values(&sim, ["crank.angle", "crank.rate"]), [crank, rate]);
            // The position is x = r cos θ ± √(l² − (r sin θ)²).
            let (r, l) = (0.1, 0.4);
            let root = (l * l - (r * crank.sin()).powi(2)).sqrt();
            let x = r * crank.cos() + side * root;
            let v = -r * crank.sin() * rate * (1.0 + side * r * crank.cos() / root);
            let [at, speed, angle] =
                values(&sim, ["piston.displacement", "piston.speed", "rod.angle"]);
            assert!(
                (at - x).abs() < 1e-11 && (speed - v).abs() < 1e-11,
                "{solve} {side}: {at} {x}, {speed} {v}"
            );
            let level = (r * crank.sin() + l * (crank + angle).sin()).abs();
            assert!(level < 1e-11, "{solve}: {level}");
        }
    }
}

/// Contradictory values are an error with the numbers and their locations; a rounded value is adjusted.
#[test]
fn values_that_do_not_fit_together_are_refused_with_those_that_do() {
    let error = |a: &str, b: &str| gears(a, b, "Auto").err().unwrap();
    let e = error(r#"initial: (angle: "30 deg"),"#, r#"initial: (angle: "50 deg"),"#);
    for part in [
        "the initial coordinates are not compatible with coupling `g`",
        "`a` 0.523599, `b` 0.872665",
        "the nearest compatible ones are `a` 0.453786, `b` 0.907571",
        "approximate: true",
        "sim.ron:3",
    ] {
        assert!(e.contains(part), "{part}: {e}");
    }
    let e = error("initial: (rate: 3),", "initial: (rate: 5),");
    assert!(e.contains("the initial rates") && e.contains("`a` 3.000000, `b` 5.000000"), "{e}");
    // The value that is only approximate is adjusted.
    let near = r#"initial: (angle: "50 deg", approximate: true),"#;
    let sim = gears(r#"initial: (angle: "30 deg"),"#, near, "Auto").unwrap();
    let [a, b] = values(&sim, ["a.angle", "b.angle"]);
    assert!(a == PI / 6.0 && (b - PI / 3.0).abs() < 1e-12, "{a} {b}");
    let sim = gears("initial: (angle: 0.33333),", "initial: (angle: 0.66667),", "Auto").unwrap();
    let [a, b] = values(&sim, ["a.angle", "b.angle"]);
    assert!((b - 2.0 * a).abs() < 1e-12 && (a - 0.33333).abs() < 1e-5, "{a} {b}");
    // The position is infeasible: the piston is farther away than crank and rod are long.
    let e = slider_crank(["", "", r#"initial: (position: "60 cm"),"#], "Auto").err().unwrap();
    assert!(
        e.contains("are not compatible with loop `wrist`") && e.contains("`piston` 0.600000"),
        "{e}"
    );
}

/// A later phase starts where its bodies are, independent of their `initial`, and the impact that couples them distributes their momentum by their
/// inertias, for every `solve`.
#[test]
fn a_later_phase_begins_where_its_bodies_are() {
    for solve in SOLVES {
        let text = format!(
            r#"Simulation(gravity: "none",
                bodies: {{
                    "a": (parent: "world", hinge: Pin([0, 1, 0]), initial: (angle: 0.5, rate: 1), mass: 1, inertia: [1e-3, 1e-3, 1e-3]),
                    "b": (parent: "world", at: (position: [1, 0, 0]), hinge: Pin([0, 1, 0]), initial: (angle: 0.5), mass: 1, inertia: [3e-3, 3e-3, 3e-3]),
                }},
                start: "free", phases: {{
                    "free": (to: {{ "geared": "a.angle >= 1 rad" }}),
                    "geared": (couplings: {{ "g": (terms: {{ "b": 1, "a": -1 }}, constant: -0.5, solve: {solve}) }}),
                }},
                step: "10 ms", until: "2 s")"#
        );
        let mut sim = started(&text).unwrap();
        sim.run_until(common::seconds(1.0)).unwrap();
        let [a, b, va, vb] = values(&sim, ["a.angle", "b.angle", "a.rate", "b.rate"]);
        // One part of the inertia couples to three parts at rest; angles continue from 1 and 0.5.
        assert!((va - 0.25).abs() < 1e-9 && (vb - 0.25).abs() < 1e-9, "{solve}: {va} {vb}");
        assert!((a - 1.125).abs() < 1e-9 && (b - 0.625).abs() < 1e-9, "{solve}: {a} {b}");
    }
}
