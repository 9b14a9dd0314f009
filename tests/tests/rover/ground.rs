//! Bodies on terrain: with impulses, with smooth forces, at its edge, and a rover that rolls over.
use linkwork_environment::map_file::{open_map, write_map};
use linkwork_runtime::{Seconds, Simulation};

use crate::common;

/// A crate of 20 kg, 0.4 m high, that falls from 0.1 m onto a slope of 5 degrees.
fn dropped(contact: &str, more: &str) -> Result<Simulation, String> {
    dropped_with(contact, more, "")
}

/// The crate with more fields of the simulation, each after a comma.
fn dropped_with(contact: &str, more: &str, fields: &str) -> Result<Simulation, String> {
    let text = format!(
        r#"Simulation(
            bodies: {{ "crate": (parent: "world", hinge: Free, mass: 20, inertia: Box([1, 0.8, 0.4]), initial: (position: [3, -2, 0.57], rotation: (rpy: [0, "-5 deg", 0])),
                shapes: [(shape: Box([1, 0.8, 0.4]), collide: true, name: "hull")]) }},
            parts: {{
                "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}),
                "Ground": (model: "environment.flat", params: {{ "slope": "5 deg", "size": "20 m", "soil": {{ "kind": "lunar" }} }}), {more}
            }},
            contact: ({contact}), step: "1 ms", until: "10 s"{fields})"#
    );
    common::scene(&text, &[])
}

fn until(sim: &mut Simulation, t: f64) {
    sim.run_until(Seconds::from_decimal(t).unwrap()).unwrap();
}

fn height(sim: &Simulation) -> f64 {
    let at = |a: &str| sim.get(&format!("crate.position.{a}")).unwrap();
    // The height is above the plane, along its normal.
    let (sin, cos) = 5f64.to_radians().sin_cos();
    at("z") * cos - at("x") * sin
}

#[test]
fn a_crate_lies_on_a_slope_by_impulses_and_by_smooth_forces() {
    for (contact, sinks) in
        [("", 2e-4), ("compliant: (stiffness: 1e5, bristle_stiffness: 1e5)", 1e-3)]
    {
        let mut sim = dropped(contact, "").unwrap();
        until(&mut sim, 3.0);
        let (h, x) = (height(&sim), sim.get("crate.position.x").unwrap());
        until(&mut sim, 4.0);
        println!(
            "{contact}: {h} m above the plane, moved {:e} m",
            sim.get("crate.position.x").unwrap() - x
        );
        assert!((h - 0.2).abs() < sinks, "{contact}: {h}");
        assert!((sim.get("crate.position.x").unwrap() - x).abs() < 1e-5, "{contact}");
    }
    // Four corners carry the weight, k δ each.
    let mut sim = dropped("compliant: (stiffness: 1e5, bristle_stiffness: 1e5)", "").unwrap();
    until(&mut sim, 4.0);
    let want = 20.0 * 9.81 * 5f64.to_radians().cos() / 4.0 / 1e5;
    assert!((0.2 - height(&sim) - want).abs() < 0.02 * want, "{} {want}", 0.2 - height(&sim));
}

#[test]
fn contact_says_which_terrain_is_met() {
    let mut sim = dropped("terrain: \"none\"", "").unwrap();
    until(&mut sim, 2.0);
    assert!(height(&sim) < -10.0);
    let second = r#""Other": (model: "environment.flat", params: { "slope": "20 deg", "soil": { "kind": "lunar" } }),"#;
    let told = dropped("", second).err().unwrap();
    for part in ["`contact`", "terrain service", "Ground, Other", "none"] {
        assert!(told.contains(part), "{part}: {told}");
    }
    let told = dropped("terrain: \"Grond\"", second).err().unwrap();
    assert!(told.contains("`Grond`") && told.contains("Ground"), "{told}");
    let mut sim = dropped("terrain: \"Ground\"", second).unwrap();
    until(&mut sim, 3.0);
    assert!((height(&sim) - 0.2).abs() < 1e-3);
    let names = r#"terrain: "Ground""#;
    let text = dropped(names, "").unwrap();
    assert_eq!(text.plan().warnings.len(), 0, "{:?}", text.plan().warnings);
}

/// A hinge to the world does not disable contact with the ground: a crate on a vertical slider lands, too. Named pairs are ignored.
#[test]
fn what_a_hinge_joins_to_the_world_meets_the_ground() {
    let at_rest = |contact: &str| {
        let text = format!(
            r#"Simulation(
                bodies: {{ "crate": (parent: "world", hinge: Slider([0, 0, 1]), mass: 20, inertia: Box([1, 0.8, 0.4]), initial: (position: 0.5),
                    shapes: [(shape: Box([1, 0.8, 0.4]), collide: true, name: "hull")]) }},
                parts: {{
                    "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}),
                    "Ground": (model: "environment.flat", params: {{ "soil": {{ "kind": "lunar" }} }}),
                }},
                contact: ({contact}), step: "1 ms", until: "10 s")"#
        );
        let mut sim = common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
        until(&mut sim, 2.0);
        sim.get("crate.displacement").unwrap()
    };
    assert!((at_rest("") - 0.2).abs() < 1e-3);
    assert!((at_rest("compliant: true") - 0.2).abs() < 2e-3);
    assert!(at_rest(r#"ignore: [["crate", "terrain"]]"#) < -10.0);
    let text = "Simulation(bodies: { \"ball\": (parent: \"world\", hinge: Free, mass: 1, inertia: [1, 1, 1]) }, \
         contact: (ignore: [[\"ball\", \"terrain\"]]), until: \"1 s\", gravity: \"none\")";
    let sim = common::scene(text, &[]).unwrap_or_else(|e| panic!("{e}"));
    let told: Vec<&str> = sim.plan().warnings.iter().map(|w| w.message.as_str()).collect();
    assert!(told.iter().any(|t| t.contains("names `terrain`")), "{told:?}");
    let named = r#"Simulation(
        bodies: { "ball": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], shapes: [(shape: Sphere(1), collide: true)]) },
        colliders: { "terrain": (on: "world", shape: Box([1, 1, 1])) }, contact: (), until: "1 s", gravity: "none")"#;
    let told = common::scene(named, &[]).err().unwrap();
    assert!(told.contains("collider `terrain`") && told.contains("another name"), "{told}");
}

/// The rover is turned over by hand and lies on its body and mast.
#[test]
fn a_rover_that_rolls_over_lies_on_the_ground() {
    let text = r#"Simulation(
        parts: { "Rover": (assembly: "rovers/rocker_bogie.ron", params: { "world": "worlds/slope.ron", "waypoints": [[0, 0]] }) },
        step: "1 ms", integrator: "semi_implicit_euler", until: "100 s", seed: 1,
        place: (
            body: "Rover.Hardware.Chassis/chassis", at: [0, 0], heading: "0 rad",
            wheels: ["Rover.Hardware.Wheels.*/wheel"], radius: "0.25 m",
            joints: ["Rover.Hardware.Chassis/rocker_*", "Rover.Hardware.Chassis/bogie_*"],
        ),
    )"#;
    let mut sim = common::scene(text, &[]).unwrap_or_else(|e| panic!("{e}"));
    sim.set("Rover.Hardware.Chassis/chassis.angular.x", 9.0).unwrap();
    until(&mut sim, 20.0);
    let get = |sim: &Simulation, name: &str| sim.get(&format!("Rover.Hardware.{name}")).unwrap();
    let (z, tilt) = (get(&sim, "Chassis/chassis.position.z"), get(&sim, "Sensors.Pose.tilt"));
    println!("chassis at {z} m, tilt {} deg", tilt.to_degrees());
    assert!(tilt > 1.2, "{tilt}");
    assert!(z > 0.1 && z < 1.0, "{z}");
    until(&mut sim, 21.0);
    assert!((get(&sim, "Chassis/chassis.position.z") - z).abs() < 1e-3);
}

/// With impulse-based contact, a mechanism moves once, by its own step, independent of the integrator of other states.
#[test]
fn the_integrator_of_other_states_does_not_move_what_has_contact() {
    let fallen = |integrator: &str| {
        let lag = r#""Wave": (model: "basics.sine", params: { "amplitude": 1, "frequency": 0.5 }),
                    "Lag": (model: "basics.lag", params: { "time_constant": 0.2 }),"#;
        let fields = format!(", wires: [\"Wave.y -> Lag.u\"], integrator: \"{integrator}\"");
        let mut sim = dropped_with("terrain: \"none\"", lag, &fields).unwrap();
        until(&mut sim, 1.0);
        (sim.get("crate.position.z").unwrap(), sim.get("Lag.y").unwrap())
    };
    for integrator in ["rk4", "semi_implicit_euler", "bogacki_shampine_32"] {
        let (z, lag) = fallen(integrator);
        // The error is of first order in the step: h g t / 2 from the closed form.
        assert!((z - (0.57 - 0.5 * 9.81)).abs() < 6e-3, "{integrator}: {z}");
        assert!(lag.abs() > 1e-3);
    }
}

#[test]
fn a_crate_holds_or_slides_by_the_friction_of_the_soil_under_it() {
    // A slope of 5 degrees requires a friction of 0.087; a pair uses the geometric mean of the crate's
    // 0.5 and the soil's value.
    for (soil, holds) in [(0.004, false), (0.03, true)] {
        for contact in ["", "compliant: (stiffness: 1e5, bristle_stiffness: 1e5)"] {
            let text = format!(
                r#"Simulation(
            bodies: {{ "crate": (parent: "world", hinge: Free, mass: 20, inertia: Box([1, 0.8, 0.4]), initial: (position: [3, -2, 0.47], rotation: (rpy: [0, "-5 deg", 0])),
                shapes: [(shape: Box([1, 0.8, 0.4]), collide: true, name: "hull")]) }},
            parts: {{
                "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}),
                "Ground": (model: "environment.flat", params: {{ "slope": "5 deg", "size": "20 m", "soil": {{ "kind": "lunar", "friction": {soil} }} }}),
            }},
            contact: ({contact}), step: "1 ms", until: "10 s")"#
            );
            let mut sim = common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
            until(&mut sim, 1.0);
            let x = sim.get("crate.position.x").unwrap();
            until(&mut sim, 2.0);
            let went = (sim.get("crate.position.x").unwrap() - x).abs();
            println!("soil {soil}, `{contact}`: {went:.2e} m");
            assert!(if holds { went < 1e-4 } else { went > 0.2 }, "{soil}, {contact}: {went}");
        }
    }
}

#[test]
fn two_materials_do_to_each_other_what_their_pair_says() {
    // Two crates, which differ only in their material, are on a slope of 20 degrees, which requires
    // a friction of 0.36.
    for contact in ["", "compliant: (stiffness: 1e5, bristle_stiffness: 1e5)"] {
        let crates = ["wood", "ice"].map(|of| {
            let y = if of == "wood" { 2.0 } else { -2.0 };
            format!(
                r#""{of}": (parent: "world", hinge: Free, mass: 20, inertia: Box([1, 0.8, 0.4]), initial: (position: [0, {y}, 0.213], rotation: (rpy: [0, "-20 deg", 0])),
                    shapes: [(shape: Box([1, 0.8, 0.4]), collide: (material: "{of}"), name: "hull")]),"#
            )
        });
        let text = format!(
            r#"Simulation(
            bodies: {{ {} }},
            parts: {{
                "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}),
                "Ground": (model: "environment.flat", params: {{ "slope": "20 deg", "size": "40 m", "soil": {{ "kind": "lunar", "friction": 0.5 }} }}),
            }},
            contact: (friction: 0.5, pairs: [(a: "ice", b: "terrain", friction: 0.02)], {contact}), step: "1 ms", until: "10 s")"#,
            crates.concat()
        );
        let mut sim = common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
        until(&mut sim, 0.5);
        let x = |sim: &Simulation, of: &str| sim.get(&format!("{of}.position.x")).unwrap();
        let before = ["wood", "ice"].map(|of| x(&sim, of));
        until(&mut sim, 1.5);
        let went = ["wood", "ice"]
            .map(|of| x(&sim, of))
            .iter()
            .zip(before)
            .map(|(a, b)| (a - b).abs())
            .collect::<Vec<_>>();
        println!("`{contact}`: wood {:.2e} m, ice {:.3} m", went[0], went[1]);
        assert!(went[0] < 1e-4 && went[1] > 2.0, "{contact}: {went:?}");
    }
}

/// A free wheel decelerates by c g/(1 + J/(m r²)), stays at rest on a slope below tan⁻¹ c, and rolls on a steeper one.
#[test]
fn a_wheel_with_rolling_resistance_coasts_to_a_stop_and_stands_on_a_slope() {
    let run = |slope: f64, speed: f64| {
        let text = format!(
            r#"Simulation(
                bodies: {{ "wheel": (parent: "world", hinge: Free, mass: 10, inertia: [0.2, 0.3, 0.2],
                    initial: (position: [0, 0, 0.24975], velocity: [{speed:?}, 0, 0], angular: [0, {:?}, 0])) }},
                parts: {{
                    "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}),
                    "Ground": (model: "environment.flat", params: {{ "slope": {slope:?} }}),
                    "Contact": (model: "mobility.wheel_rigid", params: {{ "radius": 0.25, "width": 0.2, "friction": 0.8, "rolling_resistance": 0.02 }}, bind: {{ "hub": "node:wheel" }}),
                }},
                step: "0.2 ms", integrator: "rk4", until: "2 s")"#,
            speed / 0.25
        );
        let mut sim = common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
        sim.run_until(Seconds::from_decimal(2.0).unwrap()).unwrap();
        0.25 * sim.get("wheel.angular.y").unwrap()
    };
    let slows = 0.02 * 9.81 / (1.0 + 0.3 / (10.0 * 0.0625));
    let coasts = run(0.0, 1.0);
    assert!((coasts - (1.0 - 2.0 * slows)).abs() < 2e-3, "{coasts} {}", 1.0 - 2.0 * slows);
    let stands = run(0.015, 0.0);
    assert!(stands.abs() < 1e-5, "{stands}");
    let rolls = run(0.04, 0.0);
    let (sin, cos) = 0.04_f64.sin_cos();
    let want = -2.0 * cos * 9.81 * (sin - 0.02 * cos) / (1.0 + 0.3 / (10.0 * 0.0625));
    assert!((rolls / want - 1.0).abs() < 0.02, "{rolls} {want}");
}

/// A map of radii of the Moon (DOI-USGS/ISIS3 issue 5786): in 32 bits its heights would have steps of 12.5 cm, on which a ball stayed at rest. A ball
/// that rolls down x = x₀ − 5/14 g sin α cos α t² is at 3.3010 m after 2 s. As tiles and as text the map has the same digits.
#[test]
fn a_ball_rolls_down_a_map_of_radii_as_down_a_plane() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let mut text = String::from("ncols 32\nnrows 32\ncellsize 0.5\n");
    for _ in 0..32 {
        let row: Vec<String> =
            (0..32).map(|i| format!("{:.3}", 1_737_400.0 + 0.025 * f64::from(i))).collect();
        text += &(row.join(" ") + "\n");
    }
    std::fs::write(path("radius.asc"), text).unwrap();
    let open = || open_map(path("radius.asc").as_ref(), &Default::default()).unwrap();
    for name in ["radius.tif", "radius.tiles", "again.asc"] {
        write_map(path(name).as_ref(), &mut open(), 16).unwrap();
    }
    let scene = |model: &str, name: &str, more: &str| {
        let text = format!(
            r#"Simulation(
                bodies: {{ "ball": (parent: "world", hinge: Free, mass: 1, inertia: [0.004, 0.004, 0.004], initial: (position: [4, 0, 0.3]),
                    shapes: [(shape: Sphere(0.1), name: "skin", collide: (friction: 0.8))]) }},
                parts: {{
                    "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}),
                    "Ground": (model: "environment.{model}", params: {{ "file": "{}", {more} }}),
                }},
                contact: (friction: 0.8, margin: "1 cm"), step: "1 ms", until: "2 s")"#,
            path(name)
        );
        common::scene(&text, &[])
    };
    let slope = 0.05_f64.atan();
    let wanted = 4.0 - 5.0 / 14.0 * 9.81 * slope.sin() * slope.cos() * 4.0;
    for (model, name, more) in [
        ("height_field", "radius.asc", ""),
        ("height_field", "radius.tif", ""),
        ("height_field", "again.asc", ""),
        ("tiled_terrain", "radius.tiles", "\"region\": [-7, -7, 7, 7]"),
    ] {
        let mut sim = scene(model, name, more).unwrap();
        until(&mut sim, 2.0);
        let x = sim.get("ball.position.x").unwrap();
        println!("{name}: {x}, {wanted}");
        assert!((x - wanted).abs() < 2e-3, "{name}: {x}, and not {wanted}");
        let told = scene(
            model,
            name,
            &format!("{more}{} \"level\": false", if more.is_empty() { "" } else { "," }),
        )
        .err()
        .unwrap();
        assert!(
            told.contains("1737400 m, where the resolution of 32-bit numbers is only")
                && told.contains("remove `level: false`"),
            "{told}"
        );
    }
}

/// A soil with zero bearing capacity under a narrow face is rejected wherever it is on the map, by all models that press on it. Wheels used to check
/// only the soil in the middle of the map, and wheels on nodes and feet none: they sank silently.
#[test]
fn a_soil_that_carries_nothing_is_refused_wherever_it_is() {
    let wheel = r#"params: { "radius": 0.2, "width": 0.1 }"#;
    let parts = [
        ("mobility.wheel_soil", wheel),
        ("mobility.wheel_scm", wheel),
        ("mobility.foot", r#"params: { "length": 0.2, "outline": "rectangular", "width": 0.1 }"#),
    ];
    for (model, params) in parts {
        let text = |k_c: f64| {
            format!(
                r#"Simulation(
                    bodies: {{ "hub": (parent: "world", hinge: Free, mass: 20, inertia: [1, 1, 1], initial: (position: [0, 0, 0.5])) }},
                    parts: {{
                        "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}),
                        "Ground": (model: "environment.flat", params: {{ "size": 40, "soil": {{ "kind": "dry_sand" }}, "soils": [(outline: [[5, 5], [8, 5], [8, 8]], soil: {{ "kind": "dry_sand", "k_c": {k_c:?} }})] }}),
                        "Soft": (model: "mobility.scm_ground", rate: "100 Hz"),
                        "Contact": (model: "{model}", {params}, bind: {{ "hub": "node:hub" }}),
                    }},
                    step: "1 ms", until: "1 s")"#
            )
        };
        // The modulus k_phi is 1.528e6 N/m^(n+2): for widths below 0.1 m the total is negative from
        // k_c = −1.528e5 on.
        assert!(
            common::scene(&text(-1.5e5), &[]).is_ok(),
            "{model}: {:?}",
            common::scene(&text(-1.5e5), &[]).err()
        );
        let told = common::scene(&text(-1.6e5), &[]).err().unwrap_or_default();
        for part in ["`Contact", "sinkage modulus", "0.1047 m"] {
            assert!(told.contains(part), "{model}: {part}: {told}");
        }
    }
}
