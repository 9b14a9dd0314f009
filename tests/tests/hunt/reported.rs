//! Inputs that once gave wrong results without a message: guidance and lift over level ground far from the origin, a balloon in an inertial world,
//! surroundings of another planet, guidance that begins after its arrival, tools that begin in the material, an inertial unit on compliant contact.
use crate::common;
use common::{get, metrics_of, scene, seconds};

/// Returns the metrics of a simulation that must run.
fn metrics(text: &str) -> impl Fn(&str) -> f64 + use<> {
    let all = metrics_of(text).unwrap_or_else(|e| panic!("{e}"));
    move |name| all[name]
}

/// A lander 10 km away from the origin of W falls straight down over level ground. Its guidance once took the origin for the centre of the planet,
/// braked along the position vector and turned the lander by 88 degrees.
#[test]
fn a_gravity_turn_over_level_ground_comes_straight_down() {
    let get = metrics(
        r#"Simulation(
    bodies: { "craft": (parent: "world", hinge: Free, mass: 1000, inertia: [100, 100, 50], initial: (position: [10000, 0, 300], velocity: [0, 0, -20])) },
    parts: {
        "G": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -1.62] }),
        "M": (model: "basics.constant", params: { "value": 1000 }),
        "H": (model: "sensors.motion", bind: { "mount": "node:craft" }),
        "D": (model: "flight.gravity_turn_descent", params: { "thrust_max": 5000 }, bind: { "body": "node:craft" }, rate: "20 Hz"),
        "V": (model: "flight.vector_thrust", params: { "specific_impulse": 300 }, bind: { "body": "node:craft" }),
        "F": (model: "flight.ideal_feed"),
    },
    wires: ["M.y -> D.mass", "H.position.z -> D.height", "D.force -> V.command"], connect: [("V.propellant", "F.outlet")],
    step: "10 ms", until: "200 s", stop_when: "H.position.z <= 0.5 m",
    metrics: {
        "vx": (of: "H.velocity.x", take: "max_abs"), "vy": (of: "H.velocity.y", take: "max_abs"), "vz": (of: "H.velocity.z"),
        "x": (of: "H.position.x"), "z": (of: "H.position.z"),
    },
)"#,
    );
    assert!(get("vx") < 1e-9 && get("vy") < 1e-9 && (get("x") - 1e4).abs() < 1e-9, "{}", get("x"));
    // The final descent has the speed of 1 m/s.
    assert!((get("z") - 0.5).abs() < 1e-6 && (get("vz") + 1.0).abs() < 0.02, "{}", get("vz"));
}

/// A point at (100, 0, 10) km flies along y over level ground with bank 0: its lift is in the vertical plane. It once acted along the position vector.
#[test]
fn lift_over_level_ground_points_upwards() {
    let get = metrics(
        r#"Simulation(
    bodies: { "craft": (parent: "world", hinge: Free, mass: 1000, inertia: [100, 100, 50], initial: (position: [100000, 0, 10000], velocity: [0, 1000, 0])) },
    parts: {
        "G": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }),
        "Air": (model: "environment.exponential_atmosphere", params: { "density": 1.225, "scale_height": 8500, "temperature": 250, "gas_constant": 287, "heat_ratio": 1.4, "heating_constant": 0 }),
        "E": (model: "flight.entry_aerodynamics", params: { "area": 1, "drag": [(0, 1)], "lift_to_drag": [(0, 1)] }, bind: { "body": "node:craft" }),
        "H": (model: "sensors.motion", bind: { "mount": "node:craft" }),
    },
    step: "10 ms", integrator: "rk4", until: "1 s",
    metrics: { "vx": (of: "H.velocity.x", take: "max_abs"), "vy": (of: "H.velocity.y"), "vz": (of: "H.velocity.z") },
)"#,
    );
    // The same motion in the plane, integrated by the midpoint rule: F = q S (−e + n), where n is e turned upwards by 90 degrees.
    let rate = |[z, vy, vz]: [f64; 3]| {
        let speed = vy.hypot(vz);
        let force = 0.5 * 1.225 * (-z / 8500.0_f64).exp() * speed / 1000.0;
        [vz, force * (-vy - vz), force * (vy - vz) - 9.81]
    };
    let (mut s, h) = ([1e4, 1000.0, 0.0], 1e-5);
    for _ in 0..100_000 {
        let k = rate(s);
        let middle = rate([0, 1, 2].map(|i| s[i] + 0.5 * h * k[i]));
        s = [0, 1, 2].map(|i| s[i] + h * middle[i]);
    }
    assert!(get("vx") < 1e-9, "{}", get("vx"));
    assert!((get("vy") - s[1]).abs() < 1e-6 && (get("vz") - s[2]).abs() < 1e-6, "{s:?}");
    assert!(s[2] > 100.0, "{s:?}");
}

/// A super-pressure balloon floats where ρ V equals its mass, in an inertial world as well as at a site. In an inertial world its buoyancy once
/// included the rotation of the air with the planet, and it floated 32 m too high.
#[test]
fn a_balloon_floats_at_the_same_height_in_both_worlds() {
    let balloon = |world: &str, start: &str| {
        metrics(&format!(
            r#"Simulation(
    world: (body: "earth", flattening: 0, {world}),
    bodies: {{ "b": (parent: "world", hinge: Free, mass: 100, inertia: [100, 100, 100], initial: ({start})) }},
    parts: {{
        "G": (model: "environment.point_mass_gravity"), "Air": (model: "environment.us76"),
        "B": (model: "flight.balloon", params: {{ "gas": 20, "volume": 1400 }}, bind: {{ "envelope": "node:b" }}),
        "H": (model: "flight.ground_motion", bind: {{ "body": "node:b" }}),
    }},
    step: "10 s", integrator: "dormand_prince_54", accuracy: (relative: 1e-9, absolute: 1e-6), until: "20000 s",
    metrics: {{ "height": (of: "H.height"), "rise": (of: "H.rise", take: "max_abs") }},
)"#
        ))
    };
    let inertial = balloon("", "position: [6398137, 0, 0], velocity: [0, 466.5595, 0]");
    let site = balloon("site: (latitude: 0, longitude: 0, height: 20000)", "position: [0, 0, 0]");
    // US Standard Atmosphere 1976: geopotential height H, T = 216.65 K up to 20 km, then 1 K/km; ρ at 20 km from its table.
    let rho = |z: f64| {
        let geopotential = 6_356_766.0 * z / (6_356_766.0 + z);
        let warm = 1.0 + (geopotential - 20_000.0) * 1e-3 / 216.65;
        0.088_035 * warm.powf(-1.0 - 34.163_195)
    };
    let (mut low, mut high) = (20_000.0, 22_000.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if rho(middle) * 1400.0 > 120.0 { low = middle } else { high = middle }
    }
    // At a site, heights count from its own height.
    let [a, b] = [inertial("height"), 20_000.0 + site("height")];
    println!("{a} m in an inertial world, {b} m at a site, {low} m by hand");
    assert!((a - b).abs() < 0.05, "{a} {b}");
    assert!((a - low).abs() < 0.5, "{a} {low}");
}

/// The field and the air of one planet in the world of another do not load; the message names both.
#[test]
fn surroundings_of_another_planet_are_refused() {
    let at = |body: &str, field: &str, air: &str| {
        let text = format!(
            r#"Simulation(
    world: (body: "{body}", epoch: "2025-01-01 00:00:00 UTC"),
    bodies: {{ "b": (parent: "world", hinge: Free, mass: 100, inertia: [1, 1, 1], initial: (position: [3406190, 0, 0], velocity: [0, 500, 0])) }},
    parts: {{ "G": (model: "environment.point_mass_gravity"), {field} {air} }},
    step: "10 ms", until: "10 ms",
)"#
        );
        metrics_of(&text).err().unwrap_or_else(|| panic!("it runs: {body} {field} {air}"))
    };
    let field = |params: &str| {
        format!(
            r#""B": (model: "flight.magnetic_field", params: {{ {params} }}, bind: {{ "body": "node:b" }}),"#
        )
    };
    let air = |model: &str| format!(r#""Air": (model: "environment.{model}"),"#);
    for (body, field, air, facts) in [
        ("mars", field("\"degree\": 13"), String::new(), ["IGRF-14", "mars"]),
        ("moon", field(""), String::new(), ["dipole", "moon"]),
        ("mars", String::new(), air("us76"), ["earth", "mars"]),
        ("mars", String::new(), air("msis"), ["earth", "mars"]),
        ("moon", String::new(), air("mars_air"), ["mars", "moon"]),
        ("earth", String::new(), air("mars_air"), ["mars", "earth"]),
    ] {
        let told = at(body, &field, &air).to_lowercase();
        for fact in facts {
            assert!(told.contains(&fact.to_lowercase()), "{body}: {fact} is not named: {told}");
        }
        assert!(told.contains("help: "), "{told}");
    }
}

/// A transfer whose arrival is over when it begins commands no force and warns; one that arrives later does not warn.
#[test]
fn a_transfer_that_begins_after_its_arrival_is_reported() {
    let run = |arrival: &str| {
        let mut sim = scene(
            &format!(
                r#"Simulation(
    world: (body: "earth"),
    bodies: {{ "a": (parent: "world", hinge: Free, mass: 100, inertia: [1, 1, 1], initial: (position: [6778137, 0, 0], velocity: [0, 7668.56, 0])), "b": (parent: "world", hinge: Free, mass: 100, inertia: [1, 1, 1], initial: (position: [6778137, -1000, 0], velocity: [0, 7668.56, 0])) }},
    parts: {{
        "G": (model: "environment.point_mass_gravity"), "F": (model: "flight.ideal_feed"),
        "T": (model: "flight.transfer", params: {{ "arrival": "{arrival}", "mass": 100, "force_max": 10 }}, bind: {{ "chief": "node:a", "deputy": "node:b" }}, rate: "1 Hz"),
        "V": (model: "flight.vector_thrust", params: {{ "specific_impulse": 220 }}, bind: {{ "body": "node:b" }}),
    }},
    wires: ["T.force -> V.command"], connect: [("V.propellant", "F.outlet")], step: "1 s", integrator: "dormand_prince_54", until: "100 s",
)"#
            ),
            &[],
        )
        .unwrap();
        let told: Vec<String> = sim.startup_warnings().into_iter().map(|f| f.message).collect();
        sim.run_until(seconds(100.0)).unwrap();
        (told, sim.get("T.dv").unwrap())
    };
    let (told, dv) = run("30 s");
    assert!(told.len() == 1 && told[0].contains("`arrival` is 30 s"), "{told:?}");
    assert_eq!(dv, 0.0);
    let (told, dv) = run("2000 s");
    assert!(told.is_empty() && dv > 0.1, "{told:?} {dv}");
}

/// A bit that begins 1 mm deep in a plate is guided by the hole that it drills: against 2 N across, it moves by F/k, and the hole approaches the tip as
/// δ (1 − e^(−t/T)) with T = π K D/(k Ω). The bit once was not in the plate, because it never crossed the surface.
#[test]
fn a_drill_that_begins_in_the_plate_is_guided() {
    let mut sim = scene(
        r#"Simulation(
    bodies: { "plate": (parent: "world", mass: 1, inertia: [1, 1, 1]), "bit": (parent: "world", at: (position: [0, 0, -0.001]), hinge: Slider([1, 0, 0]), mass: 0.1, inertia: [1e-4, 1e-4, 1e-4]) },
    gravity: "none",
    parts: {
        "Push": (model: "flight.body_load", params: { "rows": [(time: 0, force: [2, 0, 0])] }, bind: { "body": "node:bit" }),
        "Spindle": (model: "basics.constant", params: { "value": 100 }),
        "Cut": (model: "manipulation.cutting", params: { "diameter": 6e-3, "cutting_force": 2e9, "thickness": 4e-3 }, bind: { "bit": "node:bit", "work": "node:plate" }),
    },
    wires: ["Spindle.y -> Cut.spindle"], step: "0.1 ms", integrator: "rk4", until: "0.3 s",
)"#,
        &[],
    )
    .unwrap();
    sim.run_until(seconds(0.3)).unwrap();
    let number = |name: &str| sim.get(name).unwrap();
    assert!(
        (number("bit.displacement") - 2.0 / 2e4).abs() < 1e-8,
        "{}",
        number("bit.displacement")
    );
    assert!((number("Cut.side") - 2.0).abs() < 1e-3);
    let time = std::f64::consts::PI * 2e9 * 6e-3 / (2e5 * 100.0);
    let hole = 1e-3 * -f64::exp_m1(-0.3 / time);
    assert!((number("Cut.state.hole") / hole - 1.0).abs() < 1e-6, "{}", number("Cut.state.hole"));
}

/// Shears that begin closed on a wire press it with k (2 R − g), where g = 2 s tan(φ/2) is the distance of the edges at the wire. They once passed
/// through the wire, because edge b never reached it from outside.
#[test]
fn shears_that_begin_in_the_wire_hold_it() {
    let (radius, x, z, opening) = (1e-3, 0.9e-3, 0.02, 0.09_f64);
    let mut sim = scene(
        &format!(
            r#"Simulation(
    bodies: {{
        "a": (parent: "world", mass: 1, inertia: Sphere(0.1)),
        "b": (parent: "world", at: (rotation: (rpy: [0, {opening:?}, 0])), mass: 1, inertia: Sphere(0.1)),
        "wire": (parent: "world", at: (position: [{x:?}, 0, {z:?}]), mass: 1, inertia: Sphere(0.1)),
    }},
    gravity: "none",
    parts: {{ "Shears": (model: "manipulation.shearing", params: {{ "radius": {radius:?}, "strength": 2e8, "blades": 0.03 }}, bind: {{ "a": "node:a", "b": "node:b", "wire": "node:wire" }}) }},
    step: "1 ms", until: "0.1 s",
)"#
        ),
        &[],
    )
    .unwrap();
    sim.run_until(seconds(0.1)).unwrap();
    let lever = x * (0.5 * opening).sin() + z * (0.5 * opening).cos();
    let want = 2e6 * (2.0 * radius - 2.0 * lever * (0.5 * opening).tan());
    let found = sim.get("Shears.force").unwrap();
    assert!(want > 300.0 && (found / want - 1.0).abs() < 1e-9, "{found} {want}");
}

/// A box falls 0.2 m on compliant contact and rests: at rest the specific force and the contact force per mass are g, and the increments of velocity sum
/// up to g t, which includes the impact.
#[test]
fn an_inertial_unit_on_compliant_contact_measures_the_weight() {
    let mut fine = scene(
        r#"Simulation(
    bodies: { "box": (parent: "world", hinge: Free, mass: 1, inertia: [0.01, 0.01, 0.01], initial: (position: [0, 0, 0.3]), nodes: { "n": (position: [0, 0, 0]) }) },
    colliders: { "floor": (on: "world", shape: HalfSpace), "ball": (on: "box", shape: Sphere(0.1)) },
    contact: (compliant: (stiffness: 1e5, damping: 1, bristle_stiffness: 1e4, bristle_damping: 20)),
    parts: {
        "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }),
        "Imu": (model: "sensors.imu", rate: "100 Hz", params: { "grade": ideal }, bind: { "mount": "node:box/n" }),
        "Inc": (model: "sensors.imu_increments", rate: "100 Hz", params: { "grade": ideal }, bind: { "mount": "node:box/n" }),
    },
    step: "1 ms", integrator: "rk4", until: "2 s",
)"#,
        &[],
    )
    .unwrap();
    fine.run_until(seconds(2.0)).unwrap();
    // It still oscillates by 5e-3 m/s².
    assert!((get(&fine, "Imu.force").z - 9.81).abs() < 0.02, "{}", get(&fine, "Imu.force"));
    let force = get(&fine, "box.contact_force").z;
    assert!((force - 9.81).abs() < 0.02, "{force}");
    let sum = fine.get("Inc.state.velocity.z").unwrap();
    assert!((sum - 9.81 * 2.0).abs() < 0.02, "{sum}");
}
