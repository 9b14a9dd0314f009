//! The rover's wheels meet bodies: parked on a slab it holds, it rolls on it as on rigid ground, and no edge is a jolt.
#![allow(clippy::unwrap_used)]
use linkwork_runtime::Simulation;

#[path = "../common/mod.rs"]
mod common;

/// The rover on a slab whose top rises by `slope` (deg) along x and is `height` (m) above the ground at x = 0; `bodies` beside it.
fn on_slab(slope: f64, waypoint: f64, tyres: &str, bodies: &str) -> Simulation {
    let (sin, cos) = slope.to_radians().sin_cos();
    // The chassis is 0.751 m above what its wheels stand on, the slab's middle 0.1 m below its top.
    let (top, up) = (1.5, 0.7505);
    let text = format!(
        r#"Simulation(
    parts: {{ "Rover": (assembly: "rovers/rocker_bogie.ron", params: {{
        "world": "worlds/slope.ron", "waypoints": [[{waypoint:?}, 0]], {tyres}
    }}) }},
    bodies: {{
        "slab": (parent: "world", at: (position: [{:?}, 0, {:?}], rotation: (rpy: [0, "{:?} deg", 0])),
            shapes: [(shape: Box([16, 4, 0.2]), collide: (friction: 0.7), name: "top")]),
        {bodies}
    }},
    overrides: {{ "Rover.Hardware.Chassis/chassis.initial": (position: [{:?}, 0, {:?}], rotation: (rpy: [0, "{:?} deg", 0])) }},
    step: "1 ms", integrator: "semi_implicit_euler", until: "100 s", seed: 1,
)"#,
        0.1 * sin,
        top - 0.1 * cos,
        -slope,
        -up * sin,
        top + up * cos,
        -slope,
    );
    common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn until(sim: &mut Simulation, t: f64) {
    sim.run_until(common::seconds(t)).unwrap();
}

fn chassis(sim: &Simulation) -> [f64; 3] {
    ["x", "y", "z"]
        .map(|a| sim.get(&format!("Rover.Hardware.Chassis/chassis.position.{a}")).unwrap())
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// Of a wheel: a number of its contact with bodies.
fn wheel(sim: &Simulation, k: usize, port: &str) -> f64 {
    sim.get(&format!("Rover.Hardware.Wheels.Wheel{k}/wheel.{port}")).unwrap()
}

#[test]
fn parked_on_a_body_it_does_not_creep() {
    for slope in [0.0, 10.0, 20.0, 25.0] {
        let mut sim = on_slab(slope, 0.0, "", "");
        until(&mut sim, 8.0);
        let a = chassis(&sim);
        until(&mut sim, 12.0);
        let speed = apart(a, chassis(&sim)) / 4.0;
        let (sin, cos) = slope.to_radians().sin_cos();
        let loads = [1, 2, 3, 4, 5, 6].map(|k| {
            wheel(&sim, k, "contact_force.z") * cos - wheel(&sim, k, "contact_force.x") * sin
        });
        println!("{slope}°: {speed:.2e} m/s; loads {loads:.0?} N");
        assert!(speed < 1e-6, "{slope}: {speed} m/s");
        // The slab carries it alone, and says so.
        let mass = sim.plan().clone().mechanism().unwrap().multibody.total_mass();
        let weight = mass * 3.72076 * cos;
        let sum: f64 = loads.iter().sum();
        assert!((sum / weight - 1.0).abs() < 1e-3, "{slope}: {sum} of {weight} N");
        for k in 1..=6 {
            let model =
                sim.get(&format!("Rover.Hardware.Wheels.Wheel{k}.SurfaceContact.normal_force"));
            assert_eq!(model.unwrap(), 0.0);
            // On the slab's top under the wheel.
            let height =
                wheel(&sim, k, "contact_point.z") * cos - wheel(&sim, k, "contact_point.x") * sin;
            assert!((height - 1.5 * cos).abs() < 2e-3, "{slope}: {height}");
        }
    }
}

/// How smoothly it drives between two times (s): the range of the chassis' height (m), and the greatest change of a wheel's load in one step (N).
fn smoothness(sim: &mut Simulation, from: f64, to: f64, load: &str) -> (f64, f64) {
    until(sim, from);
    let height = sim.variable("Rover.Hardware.Chassis/chassis.position.z").unwrap().place;
    let loads = [1, 2, 3, 4, 5, 6].map(|k| {
        let path = format!("Rover.Hardware.Wheels.Wheel{k}{load}");
        sim.variable(&path).unwrap().place
    });
    let (mut low, mut high, mut jolt) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
    let mut last = loads.map(|p| sim.value(p));
    while sim.time() < to {
        sim.step().unwrap();
        let z = sim.value(height);
        (low, high) = (low.min(z), high.max(z));
        let now = loads.map(|p| sim.value(p));
        for (a, b) in now.iter().zip(last) {
            let change = (a - b).abs();
            jolt = if change <= jolt { jolt } else { change };
        }
        last = now;
    }
    (high - low, jolt)
}

#[test]
fn it_rolls_on_a_body_as_on_rigid_ground() {
    let mut body = on_slab(0.0, 6.0, "", "");
    let on_body = smoothness(&mut body, 8.0, 16.0, "/wheel.contact_force.z");
    let x = chassis(&body)[0];
    let ground = r#"Simulation(
    parts: { "Rover": (assembly: "rovers/rocker_bogie.ron", params: { "world": "worlds/slope.ron", "waypoints": [[6, 0]] }) },
    step: "1 ms", integrator: "semi_implicit_euler", until: "100 s", seed: 1,
    overrides: { "Rover.Hardware.Chassis/chassis.initial": (position: [0, 0, 0.7505]) },
)"#;
    let mut ground = common::scene(ground, &[]).unwrap();
    let on_ground = smoothness(&mut ground, 8.0, 16.0, ".SurfaceContact.normal_force");
    println!(
        "height by {:.2e} m, load by {:.2e} N a step; on ground {on_ground:?}; at {x} m",
        on_body.0, on_body.1
    );
    assert!((x - chassis(&ground)[0]).abs() < 0.05, "{x} {}", chassis(&ground)[0]);
    assert!(on_body.0 < 2.0 * on_ground.0 + 1e-5, "{on_body:?} {on_ground:?}");
    assert!(on_body.1 < 2.0 * on_ground.1 + 1.0, "{on_body:?} {on_ground:?}");
}

#[test]
fn it_drives_over_planks_without_a_jolt_and_through_them_when_told() {
    // Square, across, and along under a wheel.
    let planks = r#"
        "square": (parent: "world", at: (position: [2.2, 0, 1.515]), shapes: [(shape: Box([0.4, 4, 0.03]), collide: (friction: 0.7), name: "plank")]),
        "across": (parent: "world", at: (position: [3.4, 0, 1.515], rotation: (rpy: [0, 0, "25 deg"])), shapes: [(shape: Box([0.3, 5, 0.03]), collide: (friction: 0.7), name: "plank")]),
        "along": (parent: "world", at: (position: [5, 1.3, 1.515]), shapes: [(shape: Box([1.5, 0.3, 0.03]), collide: (friction: 0.7), name: "plank")]),"#;
    let mut sim = on_slab(0.0, 7.0, "", planks);
    let (lifted, jolt) = smoothness(&mut sim, 3.0, 26.0, "/wheel.contact_force.z");
    println!("lifted by {lifted:.4} m, load by {jolt:.0} N a step, at {} m", chassis(&sim)[0]);
    // A wheel that comes to an edge of 3 cm at 0.25 m/s is hit by it; what a step of 1 ms changes stays a part of its load of 600 N.
    assert!(chassis(&sim)[0] > 4.5, "{:?}", chassis(&sim));
    assert!(lifted > 0.015 && jolt < 600.0, "{lifted} {jolt}");
    // Wheels that are told to pass bodies fall through the slab, and its chassis lies on it.
    let mut sim = on_slab(0.0, 0.0, r#""tyres": false"#, "");
    until(&mut sim, 3.0);
    assert!(chassis(&sim)[2] < 1.6, "{:?}", chassis(&sim));
}

#[test]
fn a_wheel_that_its_model_and_its_shape_carry_is_told() {
    let told = |tyres: &str| {
        let sim = on_slab(0.0, 0.0, tyres, "");
        let all = sim.plan().warnings.iter().filter(|w| w.message.contains("carries it twice"));
        all.map(|w| format!("{} / {}", w.message, w.help.clone().unwrap())).collect::<Vec<_>>()
    };
    assert!(told("").is_empty());
    let twice = told(r#""tyres": { "friction": 0.7 }"#);
    assert_eq!(twice.len(), 6, "{twice:?}");
    assert!(
        twice[0].contains("the shape `Rover.Hardware.Wheels.Wheel1/wheel/tyre` of its wheel meets the terrain, too")
            && twice[0].contains("`collide: (terrain: false)`"),
        "{twice:?}"
    );
}
