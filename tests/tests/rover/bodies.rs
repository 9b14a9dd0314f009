//! The rover's wheels on bodies: it stays parked on a slab, rolls on it as on rigid ground, and edges do not cause jolts.
use linkwork_plant::PlanExt;
use linkwork_runtime::Simulation;

use crate::common;

/// The rover on a slab whose top rises by `slope` (deg) along x and is `height` (m) above the ground at x = 0; with additional `bodies`.
fn on_slab(slope: f64, waypoint: f64, tyres: &str, bodies: &str) -> Simulation {
    let (sin, cos) = slope.to_radians().sin_cos();
    // The chassis is 0.751 m above the surface under its wheels, the slab's middle 0.1 m below its top.
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

/// Returns a number of a wheel's contact with bodies.
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
        // Only the slab supports the rover, as the outputs state.
        let mass = sim.plan().clone().mechanism().unwrap().multibody.total_mass();
        let weight = mass * 3.72076 * cos;
        let sum: f64 = loads.iter().sum();
        assert!((sum / weight - 1.0).abs() < 1e-3, "{slope}: {sum} of {weight} N");
        for k in 1..=6 {
            let model =
                sim.get(&format!("Rover.Hardware.Wheels.Wheel{k}.SurfaceContact.normal_force"));
            assert_eq!(model.unwrap(), 0.0);
            // The contact point is on the top of the slab, under the wheel.
            let height =
                wheel(&sim, k, "contact_point.z") * cos - wheel(&sim, k, "contact_point.x") * sin;
            assert!((height - 1.5 * cos).abs() < 2e-3, "{slope}: {height}");
        }
    }
}

/// Returns the smoothness of driving between two times (s): the range of the chassis' height (m), and the largest change of a wheel's load in one
/// step (N).
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
    // The planks are square to the motion, oblique, and along it under one wheel.
    let planks = r#"
        "square": (parent: "world", at: (position: [2.2, 0, 1.515]), shapes: [(shape: Box([0.4, 4, 0.03]), collide: (friction: 0.7), name: "plank")]),
        "across": (parent: "world", at: (position: [3.4, 0, 1.515], rotation: (rpy: [0, 0, "25 deg"])), shapes: [(shape: Box([0.3, 5, 0.03]), collide: (friction: 0.7), name: "plank")]),
        "along": (parent: "world", at: (position: [5, 1.3, 1.515]), shapes: [(shape: Box([1.5, 0.3, 0.03]), collide: (friction: 0.7), name: "plank")]),"#;
    let mut sim = on_slab(0.0, 7.0, "", planks);
    let (lifted, jolt) = smoothness(&mut sim, 3.0, 26.0, "/wheel.contact_force.z");
    println!("lifted by {lifted:.4} m, load by {jolt:.0} N a step, at {} m", chassis(&sim)[0]);
    // A wheel that meets an edge of 3 cm at 0.25 m/s gets an impact; the change in a step of 1 ms stays a fraction of its load of 600 N.
    assert!(chassis(&sim)[0] > 4.5, "{:?}", chassis(&sim));
    assert!(lifted > 0.015 && jolt < 600.0, "{lifted} {jolt}");
    // Wheels that ignore bodies fall through the slab, and the chassis lies on it.
    let mut sim = on_slab(0.0, 0.0, r#""tyres": false"#, "");
    until(&mut sim, 3.0);
    assert!(chassis(&sim)[2] < 1.6, "{:?}", chassis(&sim));
}

#[test]
fn a_wheel_that_its_model_and_its_shape_carry_is_told() {
    let told = |tyres: &str| {
        let sim = on_slab(0.0, 0.0, tyres, "");
        let all = sim
            .plan()
            .warnings
            .iter()
            .filter(|w| w.message.contains("would support the wheel twice"));
        all.map(|w| format!("{} / {}", w.message, w.help.clone().unwrap())).collect::<Vec<_>>()
    };
    assert!(told("").is_empty());
    let twice = told(r#""tyres": { "friction": 0.7 }"#);
    assert_eq!(twice.len(), 6, "{twice:?}");
    assert!(
        twice[0].contains("the shape `Rover.Hardware.Wheels.Wheel1/wheel/tyre` of its wheel also collides with the terrain")
            && twice[0].contains("`collide: (terrain: false)`"),
        "{twice:?}"
    );
}

/// A loaded wheel is led along x over rocks at 0.2 m/s, free to rise and fall: returns its hub's height at each millimetre, and its load.
fn led(length: f64, wheel: &str, part: &str) -> Vec<[f64; 2]> {
    let text = format!(
        r#"Simulation(
    bodies: {{
        "carriage": (parent: "world", at: (position: [-4, 0.3, 1]), hinge: Slider(axis: [1, 0, 0], prescribed: true), mass: 1, inertia: Sphere(0.1), initial: (position: 0, rate: 0.2)),
        "fork": (parent: "carriage", hinge: Slider(axis: [0, 0, 1], damping: 400), mass: 60, inertia: Sphere(0.1), initial: (position: -0.2)),
        "wheel": (parent: "fork", hinge: Pin([0, 1, 0]), mass: 12, inertia: Cylinder(radius: 0.25, length: 0.4, axis: [0, 1, 0]), initial: (rate: 0.8),
            shapes: [(shape: Cylinder(radius: 0.25, length: {length:?}, axis: [0, 1, 0]), name: "tyre", collide: {wheel})]),
    }},
    parts: {{
        "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -3.72] }}),
        "Terrain": (model: "environment.generated_terrain", params: {{ "seed": 5, "size": [14, 6], "spacing": 0.05, "relief": 0.1, "rock_cover": 0.06, "rock_diameters": [0.1, 0.35], "soil": {{ "kind": "lunar" }} }}),
        "Way": (model: "basics.slider_trajectory", params: {{ "profile": [["0 s", "0.2 m/s"], ["100 s", "0.2 m/s"]], "gives": rate, "between": straight }}, bind: {{ "hinge": "hinge:carriage" }}),
        {part}
    }},
    contact: (compliant: (stiffness: 1.3333e5, damping: 4.5, bristle_stiffness: 2e5, bristle_damping: 1500)),
    step: "1 ms", integrator: "semi_implicit_euler", until: "40 s",
)"#
    );
    let mut sim = common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
    let height = sim.variable("fork.displacement").unwrap().place;
    let load = sim.variable("wheel.contact_force.z").map(|v| v.place).ok();
    let mut out = Vec::new();
    until(&mut sim, 3.0);
    while sim.time() < 38.0 {
        sim.step().unwrap();
        out.push([sim.value(height), load.map_or(f64::NAN, |p| sim.value(p))]);
    }
    out
}

#[test]
fn by_its_shape_alone_a_wheel_meets_the_ground_as_by_its_model() {
    // The model's three discs are the middles of strips of its width; the discs of a shape span its whole width.
    let (width, strip) = (0.4, 0.4 / 3.0);
    let shape = led(2.0 * strip, "(discs: 3, friction: 0.7)", "");
    let model = led(
        width,
        "(discs: 3, terrain: false)",
        r#""Contact": (model: "mobility.wheel_rigid", params: { "radius": 0.25, "width": 0.4 }, bind: { "hub": "node:wheel" }),"#,
    );
    let (mut apart, mut jolt, mut rise) = (0.0_f64, 0.0_f64, [f64::INFINITY, f64::NEG_INFINITY]);
    for (a, b) in shape.iter().zip(&model) {
        apart = apart.max((a[0] - b[0]).abs());
        rise = [rise[0].min(b[0]), rise[1].max(b[0])];
    }
    for w in shape.windows(2) {
        jolt = jolt.max((w[1][1] - w[0][1]).abs());
    }
    println!(
        "apart by {apart:.2e} m on ground that rises by {:.3} m; load by {jolt:.0} N a step",
        rise[1] - rise[0]
    );
    assert!(rise[1] - rise[0] > 0.1 && apart < 2e-3, "{apart} {rise:?}");
    assert!(jolt < 150.0, "{jolt}");
}
