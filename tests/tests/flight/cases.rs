//! Inputs that once gave wrong results, with the right ones: conserved momentum, empty tanks, ends of springs and airbags, first samples, initial
//! states.
use crate::common;
use common::{get, metrics_of, rotation, scene, seconds, velocity};
use linkwork_runtime::Simulation;
use linkwork_spatial::Vec3;

/// Returns the metrics of a simulation that must run.
fn metrics(text: &str) -> impl Fn(&str) -> f64 + use<> {
    let all = metrics_of(text).unwrap_or_else(|e| panic!("{e}"));
    move |name| all[name]
}

/// Checks the message of a simulation that cannot be loaded or ends with an error.
fn refused(text: &str, parts: &[&str]) {
    let told = metrics_of(text).err().unwrap_or_else(|| panic!("it runs: {parts:?}"));
    for part in parts {
        assert!(told.contains(part), "{part}: {told}");
    }
}

/// A spacecraft of 100 kg with a tank of 110 kg on its axis and one of `second` kg at a distance of 2 m, and a line between them whose valve closes
/// at 35 s.
fn line(second: f64, turning: f64) -> String {
    format!(
        r#"Simulation(
    bodies: {{ "craft": (parent: "world", hinge: Free, mass: 100, inertia: [50, 50, 50], initial: (angular: [0, 0, {turning:?}]), nodes: {{ "a": (position: [0, 0, 0]), "b": (position: [2, 0, 0]) }}) }},
    parts: {{
        "A": (model: "flight.propellant_tank", params: {{ "propellant": 110, "radius": 0.5 }}, bind: {{ "bottom": "node:craft/a" }}),
        "B": (model: "flight.propellant_tank", params: {{ "propellant": {second:?}, "radius": 0.5 }}, bind: {{ "bottom": "node:craft/b" }}),
        "L": (model: "flight.feed_line", params: {{ "area": "1e-4 m^2" }}, bind: {{ "a": "node:craft/a", "b": "node:craft/b" }}),
        "P": (model: "basics.constant", params: {{ "value": 200000 }}),
        "Valve": (model: "basics.step", params: {{ "time": 35, "before": 1, "after": 0 }}),
    }},
    wires: ["A.level -> L.level_a", "B.level -> L.level_b", "P.y -> L.pressure_a", "Valve.y -> L.open"],
    connect: [("L.tank_a", "A.outlet"), ("L.tank_b", "B.outlet")],
    gravity: "none", step: "10 ms", integrator: "dormand_prince_54", accuracy: (relative: 1e-10, absolute: 1e-10), until: "40 s",
)"#
    )
}

/// Returns momentum (N s), angular momentum about the origin of W (N m s) and the common centre of mass (m) of the spacecraft with its tanks, without
/// flow.
fn balance(sim: &Simulation) -> (Vec3, Vec3, Vec3) {
    let (r, v, R) = (get(sim, "craft.position"), velocity(sim, "craft"), rotation(sim, "craft"));
    let omega = R * get(sim, "craft.angular");
    let number = |name: &str| sim.get(name).unwrap();
    let cylinder = |m: f64, h: f64| {
        let across = m * (3.0 * 0.25 + h * h) / 12.0;
        Vec3::new(across, across, m * 0.125)
    };
    let tank = |name: &str, x: f64| {
        let (m, h) = (number(&format!("{name}.propellant")), number(&format!("{name}.level")));
        (m, Vec3::new(x, 0.0, 0.5 * h), cylinder(m, h))
    };
    let all = [(100.0, Vec3::zeros(), Vec3::repeat(50.0)), tank("A", 0.0), tank("B", 2.0)];
    let (mut p, mut h, mut centre, mut mass) = (Vec3::zeros(), Vec3::zeros(), Vec3::zeros(), 0.0);
    for (m, at, inertia) in all {
        let arm = R * at;
        let speed = v + omega.cross(&arm);
        p += speed * m;
        h += (r + arm).cross(&speed) * m + R * inertia.component_mul(&(R.inverse() * omega));
        centre += (r + arm) * m;
        mass += m;
    }
    (p, h, centre / mass)
}

/// Propellant that flows through a line from one tank to another changes neither momentum nor angular momentum of the vehicle by more than 1e-3 N m s
/// at rest and 0.01 N m s in rotation (68 without the line's force), and its centre of mass moves on a straight line.
#[test]
fn what_flows_between_tanks_keeps_momentum_and_centre_of_mass() {
    for turning in [0.0, 1.0] {
        let mut sim = scene(&line(1.0, turning), &[]).unwrap();
        let (p0, h0, c0) = balance(&sim);
        sim.run_until(seconds(40.0)).unwrap();
        let (p, h, c) = balance(&sim);
        let moved = sim.get("B.propellant").unwrap() - 1.0;
        println!(
            "{turning} rad/s: {moved} kg, {:e} N s, {:e} N m s",
            (p - p0).norm(),
            (h - h0).norm()
        );
        assert!((moved - 70.0).abs() < 0.5, "{moved} kg");
        assert!(
            (p - p0).norm() < 1e-6 && (h - h0).norm() < if turning == 0.0 { 1e-3 } else { 0.01 }
        );
        let drift = c - (c0 + p0 / 211.0 * 40.0);
        assert!(drift.norm() < 1e-3, "{drift}");
        if turning == 0.0 {
            // The vehicle moves opposite to the propellant, and rotates by 4.1 degrees, because the surfaces of the liquid are above the common centre
            // of mass: this moves its origin by 3.2 mm.
            let back = -2.0 * moved / 211.0;
            let at = get(&sim, "craft.position").x;
            assert!((at - back - 3.17e-3).abs() < 2e-4, "{at} {back}");
        } else {
            // The rotation is slower, because the moment of inertia about the common centre increases: the angular
            // momentum is 68 N m s and the spin of the parts.
            let spin = get(&sim, "craft.angular").z;
            assert!(spin < 0.5, "{spin}");
        }
    }
}

/// An empty tank can be filled without loss of propellant.
#[test]
fn an_empty_tank_is_filled() {
    let mut sim = scene(&line(0.0, 0.0), &[]).unwrap();
    assert_eq!(sim.get("B.outlet.available").ok(), Some(0.0));
    sim.run_until(seconds(40.0)).unwrap();
    let [a, b] = ["A.propellant", "B.propellant"].map(|n| sim.get(n).unwrap());
    assert!((a + b - 110.0).abs() < 1e-9 && b > 60.0, "{a} {b}");
    assert_eq!(sim.get("B.outlet.available").ok(), Some(1.0));
}

/// A tank that becomes empty while filling another one gives exactly its content.
#[test]
fn a_tank_that_runs_dry_in_a_line_gives_what_it_had() {
    let text = line(1.0, 1.0).replace("\"propellant\": 110", "\"propellant\": 30");
    let mut sim = scene(&text, &[]).unwrap();
    let (p0, h0, _) = balance(&sim);
    sim.run_until(seconds(34.0)).unwrap();
    let left = ["A.propellant", "A.outlet.available"].map(|n| sim.get(n).unwrap());
    assert_eq!(left, [0.0, 0.0]);
    assert!((sim.get("B.propellant").unwrap() - 31.0).abs() < 1e-9);
    let (p, h, _) = balance(&sim);
    // The flow stops at once, and its momentum returns within some tenths of a second.
    assert!((p - p0).norm() < 1e-6 && (h - h0).norm() < 1e-2 * h0.norm(), "{p} {p0} {h} {h0}");
}

/// An airbag that cannot stop its lander reports this, because without a hull the lander would pass through the ground.
#[test]
fn an_airbag_that_is_pressed_flat_is_reported() {
    let run = |speed: f64| {
        let text = format!(
            r#"Simulation(
    bodies: {{ "m": (parent: "world", hinge: Free, mass: 1000, inertia: [100, 100, 100], initial: (position: [0, 0, 1.5], velocity: [0, 0, -{speed:?}])) }},
    parts: {{
        "G": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -3.71] }}),
        "B": (model: "flight.airbag", params: {{ "radius": 1, "pressure": "10 kPa" }}, bind: {{ "centre": "node:m" }}),
    }},
    step: "1 ms", integrator: "dormand_prince_54", until: "2 s",
)"#
        );
        let mut sim = scene(&text, &[]).unwrap();
        let mut lowest = f64::INFINITY;
        for k in 1..=20 {
            sim.run_until(seconds(0.1 * f64::from(k))).unwrap();
            lowest = get(&sim, "m.position").z.min(lowest);
        }
        let told: Vec<String> = sim.take_notices().into_iter().map(|(_, f)| f.message).collect();
        (lowest, told)
    };
    let (_, told) = run(60.0);
    assert!(told.iter().any(|m| m.contains("pressed flat, to a tenth of its height")), "{told:?}");
    let (lowest, told) = run(2.0);
    assert!(lowest > 0.0 && told.is_empty(), "{lowest} {told:?}");
}

/// A solid motor whose grain is a tank: 3000 N for 2.4 s need 2.94 kg at 250 s. The motor goes out when a smaller grain is used up, and the
/// speed is that of the rocket equation. A motor without a grain does not load.
#[test]
fn a_motor_burns_the_grain_that_it_has() {
    let motor = |grain: f64, connect: &str, method: &str, step: &str| {
        format!(
            r#"Simulation(
    bodies: {{ "c": (parent: "world", hinge: Free, mass: 100, inertia: [10, 10, 10]) }}, gravity: "none",
    parts: {{
        "T": (model: "flight.propellant_tank", params: {{ "propellant": {grain:?}, "radius": 0.1 }}, bind: {{ "bottom": "node:c" }}),
        "M": (model: "flight.solid_motor", params: {{ "curve": [[0, 0], [0.1, 3000], [2.4, 3000], [2.5, 0]], "specific_impulse": 250, "start": 0.1 }}, bind: {{ "nozzle": "node:c" }}),
    }},
    connect: [{connect}],
    step: "{step}", integrator: "{method}", until: "5 s",
)"#
        )
    };
    let connected = r#"("M.propellant", "T.outlet")"#;
    let exhaust = 250.0 * 9.80665;
    for (method, step, within) in [
        ("dormand_prince_54", "10 ms", 5e-6),
        ("dormand_prince_54", "5 s", 5e-6),
        ("rk4", "70 ms", 5e-6),
        ("semi_implicit_euler", "1 ms", 1e-4),
    ] {
        // The last grain has the mass of the curve, rounded.
        for (grain, burnt, told) in [
            (3.0, 7200.0 / exhaust, None),
            (1.0, 1.0, Some("the grain is used up 0.867 s after ignition")),
            (2.93678, 7200.0 / exhaust, None),
        ] {
            let mut sim = scene(&motor(grain, connected, method, step), &[]).unwrap();
            sim.run_until(seconds(5.0)).unwrap();
            let left = sim.get("T.propellant").unwrap();
            assert!((left - (grain - burnt)).abs() < 4e-6, "{method} {step}: {left} of {grain}");
            let speed = sim.get("c.velocity.z").unwrap();
            let want = exhaust * ((100.0 + grain) / (100.0 + grain - burnt)).ln();
            assert!((speed / want - 1.0).abs() < within, "{method} {step}: {speed} {want}");
            let notices: Vec<_> = sim.take_notices().into_iter().map(|n| n.1.message).collect();
            match told {
                Some(fact) => {
                    assert!(notices.len() == 1 && notices[0].contains(fact), "{notices:?}")
                }
                None => assert!(notices.is_empty(), "{notices:?}"),
            }
        }
    }
    refused(&motor(3.0, "", "rk4", "10 ms"), &["M.propellant", "not connected"]);
}

/// At and after its arrival time a descent commands zero force; if the arrival is already over at the start, it warns.
#[test]
fn a_descent_ends_at_its_arrival() {
    let text = |arrival: f64| {
        format!(
            r#"Simulation(
    bodies: {{ "c": (parent: "world", hinge: Free, mass: 1000, inertia: [100, 100, 100], initial: (position: [100, 0, 500], velocity: [-5, 0, -30])) }},
    parts: {{
        "G": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -1.62] }}),
        "M": (model: "basics.constant", params: {{ "value": 1000 }}),
        "D": (model: "flight.powered_descent", params: {{ "thrust_max": 20000, "arrival": {arrival:?}, "position": [0, 0, 1], "law": "linear" }}, bind: {{ "body": "node:c" }}, rate: "10 Hz"),
        "V": (model: "flight.vector_thrust", params: {{ "specific_impulse": 300 }}, bind: {{ "body": "node:c" }}),
        "F": (model: "flight.ideal_feed"),
    }},
    wires: ["M.y -> D.mass", "D.force -> V.command"], connect: [("V.propellant", "F.outlet")],
    step: "10 ms", until: "30 s",
)"#
        )
    };
    let mut sim = scene(&text(20.0), &[]).unwrap();
    sim.run_until(seconds(19.95)).unwrap();
    assert!(sim.get("V.thrust").unwrap() > 100.0);
    // The body falls from the arrival on if there are no further samples.
    sim.run_until(seconds(20.0)).unwrap();
    let v0 = velocity(&sim, "c");
    sim.run_until(seconds(20.05)).unwrap();
    let v1 = velocity(&sim, "c");
    assert!((v1 - v0 - Vec3::z() * (-1.62 * 0.05)).norm() < 1e-9, "{}", v1 - v0);
    let mut late = scene(&text(0.0), &[]).unwrap();
    let told: Vec<String> = late.startup_warnings().into_iter().map(|f| f.message).collect();
    assert!(told.iter().any(|m| m.contains("`arrival` is 0 s")), "{told:?}");
}

/// Springs that cannot push with their parameters are rejected.
#[test]
fn springs_begin_within_their_stroke() {
    let text = |model: &str, length: &str, x: f64| {
        format!(
            r#"Simulation(
    bodies: {{ "a": (parent: "world", hinge: Locked, mass: 10, inertia: [1, 1, 1]), "b": (parent: "world", hinge: Free, mass: 10, inertia: [1, 1, 1], initial: (position: [{x:?}, 0, 0])) }},
    parts: {{ "S": (model: "flight.{model}", params: {{ "stiffness": 1000, "{length}": 0.1 }}, bind: {{ "a": "node:a", "b": "node:b" }}) }},
    gravity: "none", step: "1 ms", integrator: "dormand_prince_54", until: "1 s",
    metrics: {{ "speed": (of: "b.velocity.x", take: "last") }},
)"#
        )
    };
    refused(&text("separation_spring", "stroke", -0.1), &["0.100000 m behind", "stroke of 0.1 m"]);
    refused(
        &text("kickoff_spring", "length", 0.0),
        &["ends coincide", "direction in which it pushes is not defined"],
    );
    // The energy ½ k s² is transferred to the body, which gives the speed √(k/m) s.
    assert!((metrics(&text("separation_spring", "stroke", 0.0))("speed") - 1.0).abs() < 1e-6);
    assert!((metrics(&text("kickoff_spring", "length", 0.01))("speed") - 0.9).abs() < 1e-6);
}

/// A rover that rolls without slip on a circle of half a metre: its drive monitor reports zero slip.
#[test]
fn a_curve_without_slip_is_no_slip() {
    let get = metrics(
        r#"Simulation(
    parts: {
        "V": (model: "basics.constant", params: { "value": 0.05 }),
        "X": (model: "basics.sine", params: { "amplitude": 0.5, "frequency": "0.015915494309189534 Hz" }),
        "Y": (model: "basics.sine", params: { "amplitude": -0.5, "frequency": "0.015915494309189534 Hz", "phase": "90 deg", "offset": 0.5 }),
        "H": (model: "basics.ramp", params: { "slope": 0.1 }),
        "D": (model: "control.drive_monitor", params: { "wheels": [(position: [0, 0])], "slip_max": 0.1 }, rate: "10 Hz"),
    },
    wires: ["V.y -> D.wheel_speed", "X.y -> D.x", "Y.y -> D.y", "H.y -> D.heading"],
    gravity: "none", step: "0.1 s", until: "60 s",
    metrics: { "slip": (of: "D.slip", take: "max_abs"), "slipping": (of: "D.slipping", take: "max") },
)"#,
    );
    assert!(get("slip") < 1e-4 && get("slipping") == 0.0, "{}", get("slip"));
}

/// The gas over the propellant starts with the tank's content, which is written only once.
#[test]
fn a_tank_that_blows_down_begins_with_what_it_has() {
    let text = |more: &str| {
        format!(
            r#"Simulation(
    bodies: {{ "c": (parent: "world", hinge: Free, mass: 300, inertia: [100, 100, 100]) }},
    parts: {{
        "T": (model: "flight.propellant_tank", params: {{ "propellant": 100, "radius": 0.5 }}, bind: {{ "bottom": "node:c" }}),
        "B": (model: "flight.blow_down", params: {{ "pressure": "20 bar", "ullage": 0.05 {more} }}),
        "E": (model: "flight.engine", params: {{ "thrust": 1000, "specific_impulse": 220 }}, bind: {{ "nozzle": "node:c" }}),
    }},
    wires: ["T.volume -> B.volume", "B.throttle -> E.throttle"], connect: [("E.propellant", "T.outlet")],
    gravity: "none", step: "0.1 s", until: "90 s",
    metrics: {{ "throttle": (of: "B.throttle", take: "last"), "left": (of: "T.propellant", take: "last") }},
)"#
        )
    };
    let get = metrics(&text(""));
    // From ẋ (V₀ + x/ρ) = c V₀ follows t = (x + x²/(2 ρ V₀))/c.
    let (c, gone) = (1000.0 / (220.0 * 9.80665), 100.0 - get("left"));
    let t = (gone + gone * gone / (2.0 * 1000.0 * 0.05)) / c;
    assert!((t / 90.0 - 1.0).abs() < 1e-6, "{gone} kg in {t} s");
    assert!((get("throttle") - 0.05 / (0.05 + gone / 1000.0)).abs() < 1e-9);
    refused(&text(", \"propellant\": 50"), &["`B` has no parameter `propellant`"]);
}

/// Above 80 000 ft MIL-F-8785C does not define gusts, so they are zero, also for a spacecraft in orbit.
#[test]
fn gusts_end_with_their_specification() {
    let text = |height: f64, more: &str| {
        format!(
            r#"Simulation(
    world: (body: "earth"),
    bodies: {{ "b": (parent: "world", hinge: Free, mass: 100, inertia: [1, 1, 1], initial: (position: [{:?}, 0, 0], velocity: [0, 500, 0])) }},
    parts: {{
        "G": (model: "environment.point_mass_gravity"),
        "Air": (model: "environment.us76"),
        "H": (model: "flight.ground_motion", bind: {{ "body": "node:b" }}),
        "Gust": (model: "flight.gusts", params: {{ {more} }}, bind: {{ "body": "node:b" }}, rate: "10 Hz"),
    }},
    wires: ["H.height -> Gust.height"], step: "0.1 s", until: "20 s",
    metrics: {{ "u": (of: "Gust.velocity.y", take: "max_abs") }},
)"#,
            6_378_137.0 + height
        )
    };
    assert_eq!(metrics(&text(3e5, ""))("u"), 0.0);
    assert!(metrics(&text(1.5e4, ""))("u") > 0.1);
    assert!(metrics(&text(3e5, "\"length\": [500, 500, 500], \"sigma\": [1, 1, 1]"))("u") > 0.1);
    let mut sim = scene(&text(3e5, ""), &[]).unwrap();
    let told: Vec<String> = sim.startup_warnings().into_iter().map(|f| f.message).collect();
    assert!(
        told.iter().any(|m| m.contains("MIL-F-8785C gives gusts only up to 24384 m")),
        "{told:?}"
    );
}

/// Honeycomb of 8 and 20 kN absorbs 4500 J, except the energy that the strut returns: F²/2k of the last stage.
#[test]
fn honeycomb_takes_the_energy_of_the_landing() {
    let text = |first: u32, second: u32| {
        format!(
            r#"Simulation(
    bodies: {{ "b": (parent: "world", hinge: Slider([0, 0, 1]), mass: 1000, inertia: [1, 1, 1], initial: (position: 0.001, rate: -3)) }},
    parts: {{ "L": (model: "flight.crushable_leg", params: {{ "stages": [(stroke: 0.3, force: {first}), (stroke: 0.3, force: {second})] }}, bind: {{ "foot": "node:b" }}) }},
    gravity: "none", step: "1 ms", integrator: "dormand_prince_54", until: "2 s",
    metrics: {{ "taken": (of: "L.taken", take: "last"), "speed": (of: "b.speed", take: "last"), "most": (of: "L.force", take: "max") }},
)"#
        )
    };
    let get = metrics(&text(8000, 20_000));
    let back = 0.5 * 1000.0 * get("speed").powi(2);
    assert!((get("taken") - 4300.0).abs() < 10.0 && get("most") < 21_000.0, "{}", get("taken"));
    assert!((back - 0.5 * 20_000.0 * 20_000.0 / 1e6).abs() < 10.0, "{back}");
    refused(&text(20_000, 8000), &["the softer one crushes first"]);
}

/// An inertial unit has its bias and scale error in the first sample as in all others; each axis has separate values.
#[test]
fn an_inertial_unit_begins_as_it_continues() {
    let get = metrics(
        r#"Simulation(
    bodies: {
        "deck": (parent: "world", mass: 1, inertia: Sphere(0.1), nodes: { "n": (position: [0, 0, 0]) }),
        "t": (parent: "world", hinge: Pin([0.577350269, 0.577350269, 0.577350269]), mass: 1, inertia: Sphere(0.1), initial: (rate: 1), nodes: { "n": (position: [0, 0, 0]) }),
    },
    parts: {
        "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.80665] }),
        "Imu": (model: "sensors.imu", rate: "10 Hz", params: { "grade": mems, "gyro_white": 0, "gyro_walk": 0, "gyro_instability": 0, "accel_white": 0, "accel_walk": 0, "accel_instability": 0 }, bind: { "mount": "node:deck/n" }),
        "Table": (model: "sensors.imu", rate: "10 Hz", params: { "grade": ln200s, "gyro_white": 0, "gyro_walk": 0 }, bind: { "mount": "node:t/n" }),
    },
    step: "100 ms", until: "1 s", seed: 3,
    metrics: {
        "rate, first": (of: "Imu.rate.x", at: "time < 1 ms"), "rate, last": (of: "Imu.rate.x", take: "last"),
        "force, first": (of: "Imu.force.x", at: "time < 1 ms"), "force, last": (of: "Imu.force.x", take: "last"),
        "x": (of: "Table.rate.x", take: "last"), "y": (of: "Table.rate.y", take: "last"), "z": (of: "Table.rate.z", take: "last"),
    },
)"#,
    );
    assert!(get("rate, first") == get("rate, last") && get("rate, first") != 0.0);
    assert!(get("force, first") == get("force, last") && get("force, first") != 0.0);
    // The deviations are 1e-4 and 1 °/h.
    let off = ["x", "y", "z"].map(|axis| get(axis) / 0.577_350_269 - 1.0);
    assert!(off.iter().all(|e| e.abs() < 5e-4 && *e != 0.0), "{off:?}");
    assert!(off[0] != off[1] && off[1] != off[2], "{off:?}");
}

/// A converter reads zero at zero current, and needs its range.
#[test]
fn a_converter_of_current_knows_zero_and_its_range() {
    let text = |value: u32, params: &str| {
        format!(
            r#"Simulation(
    parts: {{
        "I": (model: "basics.constant", params: {{ "value": {value} }}),
        "A": (model: "sensors.current", rate: "10 Hz", params: {{ {params} }}),
    }},
    wires: ["I.y -> A.current"], step: "100 ms", until: "1 s",
    metrics: {{ "reading": (of: "A.reading", take: "last") }},
)"#
        )
    };
    let read = |value, params| metrics(&text(value, params))("reading");
    assert_eq!(read(0, r#""bits": 12, "range": "20 A""#), 0.0);
    assert_eq!(read(0, r#""bits": 1, "range": "20 A""#), 0.0);
    let step = 20.0 / 2048.0;
    assert!((read(1, r#""bits": 12, "range": "20 A""#) - 1.0).abs() <= 0.5 * step);
    assert_eq!(read(1, ""), 1.0);
    refused(&text(1, r#""bits": 12"#), &["`A.bits`", "`range` is not written", "20 A"]);
}

/// Physically impossible parameters of wheels and instruments are errors at load, each with its location.
#[test]
fn negative_friction_and_noise_are_refused() {
    refused(
        r#"Simulation(
    bodies: { "wheel": (parent: "world", hinge: Free, mass: "10 kg", inertia: [0.2, 0.3, 0.2], initial: (position: [0, 0, 0.25])) },
    parts: {
        "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }),
        "Ground": (model: "environment.flat", params: { "soil": { "kind": "lunar" } }),
        "Contact": (model: "mobility.wheel_rigid", params: { "radius": 0.25, "width": 0.2, "friction": -0.5 }, bind: { "hub": "node:wheel" }),
        "Imu": (model: "sensors.imu", rate: "10 Hz", params: { "gyro_white": -1e-3, "accel_white": -1e-3, "gyro_walk": -1 }, bind: { "mount": "node:wheel" }),
    },
    step: "1 ms", until: "1 s",
)"#,
        &[
            "`Contact.friction` = -0.5 is out of range",
            "`Imu.gyro_white` = -0.001 is out of range",
            "`Imu.accel_white`",
            "`Imu.gyro_walk` = -1",
        ],
    );
}

/// Initial state from orbital elements: after one revolution the spacecraft is back, and `flight.orbit` outputs the given elements.
#[test]
fn a_craft_starts_by_its_elements() {
    // The period follows from Kepler's third law.
    let period = std::f64::consts::TAU * (7e6f64.powi(3) / 3.986_004_418e14).sqrt();
    let text = |world: &str, initial: &str| {
        format!(
            r#"Simulation(
    {world}
    bodies: {{ "craft": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), initial: ({initial})) }},
    parts: {{ "G": (model: "environment.point_mass_gravity"), "O": (model: "flight.orbit", bind: {{ "body": "node:craft" }}) }},
    step: "{:.9} s", integrator: "dormand_prince_54", accuracy: (relative: 1e-12, absolute: 1e-9), until: "6000 s",
)"#,
            period / 500.0
        )
    };
    let earth = "world: (body: \"earth\"),";
    let orbit = "elements: (semi_major_axis: \"7000 km\", eccentricity: 0.01, inclination: \"98 deg\", ascending_node: \"10 deg\", pericentre: \"90 deg\", anomaly: 0)";
    let mut sim = scene(&text(earth, orbit), &[]).unwrap();
    let near = |name: &str, want: f64, within: f64| {
        let x = sim.get(name).unwrap();
        assert!((x - want).abs() < within, "{name}: {x} {want}");
    };
    near("O.inclination", 98f64.to_radians(), 1e-9);
    near("O.eccentricity", 0.01, 1e-9);
    near("O.pericentre", 6.93e6 - 6_378_137.0, 1e-3);
    near("O.ascending_node", 10f64.to_radians(), 1e-9);
    let start = get(&sim, "craft.position");
    assert!((start.norm() - 6.93e6).abs() < 1e-3, "{start}");
    let v = velocity(&sim, "craft");
    sim.run_until(seconds(period)).unwrap();
    assert!((get(&sim, "craft.position") - start).norm() < 1e-5 * v.norm());
    // A body at rest on the ground has the velocity of the ground.
    let dated = "world: (body: \"earth\", epoch: \"2024-06-21 00:00:00 UTC\"),";
    let place = "geodetic: (latitude: \"45 deg\", longitude: \"10 deg\", height: \"500 km\")";
    let sim = scene(&text(dated, place), &[]).unwrap();
    let (r, v) = (get(&sim, "craft.position"), velocity(&sim, "craft"));
    assert!((v.norm() - 7.292_115e-5 * r.xy().norm()).abs() < 0.2, "{v}");
    // Errors have a location and a remedy.
    for (world, initial, part) in [
        (
            earth,
            "elements: (semi_major_axis: 7e6), position: [7e6, 0, 0]".to_string(),
            "specified twice",
        ),
        (earth, "state: (frame: itrf, position: [7e6, 0, 0])".to_string(), "`turns: iau`"),
        (earth, "elements: (semi_major_axis: 7e6, eccentricity: 1.5)".to_string(), "eccentricity"),
        (earth, "elements: (eccentricity: 0.5)".to_string(), "semi_major_axis"),
        ("", orbit.to_string(), "has no `world`"),
    ] {
        let told = scene(&text(world, &initial), &[]).err().unwrap_or_else(|| panic!("{initial}"));
        assert!(told.contains(part), "{part}: {told}");
    }
}

/// Terrain, legs and airbags use z of W as up. With W inertial at the centre of the Earth they were accepted and touched a plane through its centre.
#[test]
fn ground_along_z_of_an_inertial_world_is_refused() {
    let space = |part: &str| {
        format!(
            r#"Simulation(world: (body: "earth"), bodies: {{ "b": (parent: "world", hinge: Free, mass: 10, inertia: [1, 1, 1], initial: (position: [7000000, 0, 0], velocity: [0, 7500, 0])) }},
            parts: {{ "Gravity": (model: "environment.point_mass_gravity"), "P": ({part}) }}, until: "1 s")"#
        )
    };
    let terrain = r#"model: "environment.generated_terrain", params: { "size": [35, 35], "spacing": 0.5, "soil": { "kind": "dry_sand_rover" } }"#;
    let leg = r#"model: "flight.crushable_leg", params: { "stages": [(stroke: 0.3, force: 400)] }, bind: { "foot": "node:b" }"#;
    let bag = r#"model: "flight.airbag", params: { "radius": 1, "pressure": "10 kPa" }, bind: { "centre": "node:b" }"#;
    for part in [terrain, leg, bag] {
        refused(&space(part), &["`P`", "makes W inertial", "write `site` in `world`"]);
    }
}

/// `semi_major_axis: 7000` was silently taken as 7 km. An orbit through the Earth is a warning too; one around it and an ascent are not.
#[test]
fn an_orbit_through_the_central_body_is_a_warning() {
    let told = |initial: &str| {
        let text = format!(
            r#"Simulation(world: (body: "earth"), bodies: {{ "b": (parent: "world", hinge: Free, mass: 10, inertia: [1, 1, 1], initial: ({initial})) }},
            parts: {{ "Gravity": (model: "environment.point_mass_gravity") }}, until: "1 s")"#
        );
        let sim = scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
        let all: Vec<String> = sim.plan().warnings.iter().map(|w| w.message.clone()).collect();
        all.join("\n")
    };
    let orbit = |axis: &str, e: f64, anomaly: &str| {
        told(&format!(
            r#"elements: (semi_major_axis: {axis}, eccentricity: {e}, inclination: "51 deg", anomaly: "{anomaly}")"#
        ))
    };
    assert!(
        orbit("7000", 0.001, "0 deg").contains("starts 6.99"),
        "{}",
        orbit("7000", 0.001, "0 deg")
    );
    // The pericentre a (1 − e) = 6300 km is 57 km below the pole.
    let through = orbit("\"9000 km\"", 0.3, "180 deg");
    assert!(through.contains("pericentre is 6300 km"), "{through}");
    for fine in [orbit("\"9000 km\"", 0.29, "180 deg"), orbit("\"-9000 km\"", 1.8, "0 deg")] {
        assert!(!fine.contains("pericentre"), "{fine}");
    }
    let ascent = told(
        r#"geodetic: (latitude: "28 deg", longitude: "-80 deg", height: "50 km", velocity: [1500, 0, 300])"#,
    );
    assert!(!ascent.contains("central body"), "{ascent}");
}
