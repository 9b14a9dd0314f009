//! Invalid input of flights: a tank with negative content, guidance without a solution, an epoch beyond its tables. The error is reported, and the
//! flight continues with its fallback or ends in order.
use linkwork_spatial::Vec3;

use crate::common::{get, scene, seconds, velocity};

#[test]
fn a_tank_with_negative_propellant_is_refused() {
    let text = r#"Simulation(
    bodies: { "stage": (parent: "world", hinge: Free, mass: 100, inertia: [10, 10, 10]) },
    parts: {
        "Tank": (model: "flight.propellant_tank", params: { "propellant": "-1 kg", "radius": "0.5 m" }, bind: { "bottom": "node:stage" }),
    },
    gravity: "none", step: "10 ms", until: "1 s",
)"#;
    let told = scene(text, &[]).err().unwrap();
    let place = format!("start: {}", text.find("\"-1 kg\"").unwrap());
    for part in ["`Tank.propellant` = -1 kg is out of range 0 ..", &place] {
        assert!(told.contains(part), "{part}: {told}");
    }
    assert!(scene(&text.replace("-1 kg", "1 kg"), &[]).is_ok());
}

/// An engine without a tank used to have unlimited propellant. It does not load; nor does one whose tank gives it propellant without losing any.
#[test]
fn an_engine_without_a_tank_does_not_load() {
    let text = r#"Simulation(
    bodies: { "stage": (parent: "world", hinge: Free, mass: 100, inertia: [10, 10, 10]) },
    parts: {
        "Full": (model: "basics.constant", params: { "value": 1 }),
        "Tank": (model: "flight.propellant_tank", params: { "propellant": "10 kg", "radius": "0.5 m" }, bind: { "bottom": "node:stage" }),
        "Engine": (model: "flight.engine", params: { "thrust": "400 N", "specific_impulse": "300 s" }, bind: { "nozzle": "node:stage" }),
    },
    wires: ["Full.y -> Engine.throttle"], CONNECT
    gravity: "none", step: "10 ms", until: "1 s",
)"#;
    let with = |connect: &str| scene(&text.replace("CONNECT", connect), &[]);
    let told = with("").err().unwrap();
    assert!(told.contains("connector `Engine.propellant` is not connected"), "{told}");
    assert!(told.contains("help: "), "{told}");
    let one_way = text.replace(
        "\"Full.y -> Engine.throttle\"",
        "\"Full.y -> Engine.throttle\", \"Tank.outlet.available -> Engine.propellant.available\"",
    );
    let told = scene(&one_way.replace("CONNECT", ""), &[]).err().unwrap();
    assert!(
        told.contains("`Engine.propellant.flow` is not connected back to it")
            || told.contains("its `propellant.flow` is not connected back to it"),
        "{told}"
    );
    let mut sim = with(r#"connect: [("Engine.propellant", "Tank.outlet")],"#).unwrap();
    sim.run_until(seconds(1.0)).unwrap();
    let used = 10.0 - sim.get("Tank.propellant").unwrap();
    assert!((used * 300.0 * 9.80665 / 400.0 - 1.0).abs() < 1e-9, "{used}");
}

/// Invalid gravity is the only error: the spacecraft, and the radar next to it, do not additionally report it as missing.
#[test]
fn what_is_refused_is_not_said_to_be_missing_too() {
    let text = r#"Simulation(
    bodies: { "craft": (parent: "world", hinge: Free, mass: 100, inertia: [10, 10, 10]) },
    world: (body: "earth"),
    parts: {
        "Gravity": (model: "environment.zonal_gravity", params: { "j2": 1e-3, "radius": -6378137 }),
        "Air": (model: "environment.us76"),
    },
    gravity: "Gravity", step: "10 ms", until: "1 s",
)"#;
    let told = scene(text, &[]).err().unwrap();
    assert!(told.contains("`Gravity.radius` = "), "{told}");
    assert!(!told.contains("gravity service"), "{told}");
    // A service that is really missing is reported.
    let whole = text.replace("-6378137", "6378137");
    assert!(scene(&whole, &[]).is_ok());
    for text in [text, &whole] {
        let other = text.replace(r#"gravity: "Gravity""#, r#"gravity: "Gravty""#);
        let told = scene(&other, &[]).err().unwrap();
        assert!(told.contains("there is no gravity service `Gravty`"), "{told}");
    }
}

/// Below its glide slope `flight.convex_descent` does not find a plan: this is an output, recorded in the log, and reported at the start. The
/// quadratic law lands the vehicle at the end of `times`.
#[test]
fn a_convex_descent_without_a_plan_says_so_and_comes_down() {
    let text = |start: &str| {
        format!(
            r#"Simulation(
    bodies: {{ "lander": (parent: "world", hinge: Free, mass: 1505, inertia: [1500, 1500, 1800], initial: ({start})) }},
    parts: {{
        "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -3.7114] }}),
        "Tank": (model: "flight.propellant_tank", params: {{ "propellant": 400, "radius": "10 um", "density": 1e20 }}, bind: {{ "bottom": "node:lander" }}),
        "Mass": (model: "basics.gain", params: {{ "k": 1, "offset": 1505 }}),
        "Guidance": (
            model: "flight.convex_descent", rate: "10 Hz", bind: {{ "body": "node:lander" }},
            params: {{ "dry": 1505, "specific_impulse": 225, "thrust": 18600, "throttle": [0.2, 0.9], "glide": "15 deg", "velocity": [0, 0, -0.5], "times": [30, 70], "nodes": 30 }},
        ),
        "Engine": (model: "flight.vector_thrust", params: {{ "specific_impulse": 225, "lag": "50 ms" }}, bind: {{ "body": "node:lander" }}),
    }},
    wires: [
        "Tank.propellant -> Mass.u", "Mass.y -> Guidance.mass", "Guidance.force -> Engine.command",
    ],
    connect: [("Engine.propellant", "Tank.outlet")],
    step: "20 ms", until: "80 s", integrator: "rk4",
)"#
        )
    };
    let planned = text("position: [2000, 450, 1500], velocity: [-40, 12, -65]");
    let mut sim = scene(&planned, &[]).unwrap();
    assert!(sim.startup_warnings().is_empty());
    sim.run_until(seconds(0.2)).unwrap();
    assert_eq!(sim.get("Guidance.planned").unwrap(), 1.0);
    let mut sim = scene(&text("position: [1500, 0, 150], velocity: [-20, 0, 2]"), &[]).unwrap();
    let told = sim.startup_warnings();
    assert!(told.len() == 1 && told[0].message.contains("`Guidance`: no plan within 30 to 70 s"));
    for k in 1..=700 {
        sim.run_until(seconds(f64::from(k) * 0.1)).unwrap();
        assert_eq!(sim.get("Guidance.planned").unwrap(), 0.0);
    }
    let (place, speed) = (get(&sim, "lander.position"), velocity(&sim, "lander"));
    println!("{place} {speed}");
    assert!(place.norm() < 1.0 && (speed + Vec3::z() * 0.5).norm() < 1.0, "{place} {speed}");
}

/// `flight.linear_tangent` for a stage at orbital speed, or brought there by an unknown push: `Guidance.lost`, an output recorded in the log. Without
/// a solution from the start it does not thrust; otherwise it continues with the last steering, sin θ = A + B t.
#[test]
fn an_ascent_without_a_solution_says_so_and_holds_its_steering() {
    let text = |speed: f64, push: f64| {
        format!(
            r#"Simulation(
    bodies: {{ "stage": (parent: "world", hinge: Free, mass: "20 t", inertia: [1e5, 1e5, 1e4], initial: (position: [6.55e6, 0, 0], velocity: [200, {speed}, 0])) }},
    world: (body: "earth"),
    parts: {{
        "Gravity": (model: "environment.point_mass_gravity"),
        "Push": (model: "flight.body_load", params: {{ "rows": [(time: 0, force: [0, 0, 0]), (time: 20.1, force: [0, {push}, 0]), (time: 20.4, force: [0, 0, 0])] }}, bind: {{ "body": "node:stage" }}),
        "Mass": (model: "basics.constant", params: {{ "value": 20000 }}),
        "Guidance": (
            model: "flight.linear_tangent", rate: "2 Hz", bind: {{ "body": "node:stage" }},
            params: {{ "radius": 6578137, "along": 7784.3, "thrust": 1e5, "specific_impulse": 348 }},
        ),
        "Engine": (model: "flight.vector_thrust", params: {{ "specific_impulse": 348, "lag": 0 }}, bind: {{ "body": "node:stage" }}),
        "Feed": (model: "flight.ideal_feed"),
    }},
    wires: ["Mass.y -> Guidance.mass", "Guidance.force -> Engine.command"], connect: [("Engine.propellant", "Feed.outlet")],
    step: "100 ms", integrator: "rk4", until: "60 s",
)"#
        )
    };
    let mut sim = scene(&text(8000.0, 0.0), &[]).unwrap();
    for k in 1..=40 {
        sim.run_until(seconds(f64::from(k))).unwrap();
        let force = get(&sim, "Guidance.force").norm();
        assert_eq!((sim.get("Guidance.lost").unwrap(), force), (1.0, 0.0));
    }
    let mut sim = scene(&text(7000.0, 8e7), &[]).unwrap();
    sim.run_until(seconds(19.5)).unwrap();
    assert_eq!(sim.get("Guidance.lost").unwrap(), 0.0);
    let mut sines = Vec::new();
    for k in 22..=40 {
        sim.run_until(seconds(f64::from(k))).unwrap();
        assert_eq!(sim.get("Guidance.lost").unwrap(), 1.0, "{k} s");
        assert!((get(&sim, "Guidance.force").norm() / 1e5 - 1.0).abs() < 1e-12);
        sines.push(sim.get("Guidance.pitch").unwrap().sin());
    }
    let slopes: Vec<f64> = sines.windows(2).map(|w| w[1] - w[0]).collect();
    println!("{sines:?}");
    assert!(slopes[0].abs() > 1e-6, "{slopes:?}");
    assert!(slopes.iter().all(|b| (b - slopes[0]).abs() < 1e-12), "{slopes:?}");
}

/// SOFA's series of the Earth ends in 2100, J2000 + 36525 days. A run that continues beyond stops at the last sample before, with valid numbers; the
/// message names service, interval, epoch and remedy. A run that must last until then is rejected at its start, one that may end earlier is not.
#[test]
fn a_run_beyond_the_years_of_the_ephemeris_stops_and_says_so() {
    use linkwork_runner::{Ended, Goal, Pause, Runner, Watch};
    struct Nobody;
    impl Watch for Nobody {
        fn tick(&mut self, _: &linkwork_runtime::Simulation) {}
    }
    let file = linkwork_tests::root().join("sims/earth_orbit/ggm03s_20.txt").display().to_string();
    let text = |epoch: &str| {
        format!(
            r#"Simulation(
    bodies: {{ "craft": (parent: "world", hinge: Free, mass: 100, inertia: [10, 10, 10], initial: (position: [4.2e7, 0, 0], velocity: [0, 3080, 0])) }},
    parts: {{
        "Gravity": (model: "environment.spherical_harmonics", params: {{ "file": {file:?}, "format": basilisk, "degree": 2,
            "third_bodies": ["sun", "moon"] }}),
    }},
    world: (body: "earth", turns: "still", epoch: "{epoch}", span: "1 h"),
    step: "100 s", integrator: "rk4", until: "1000000 s",
)"#
        )
    };
    let mut sim = scene(&text("2089-12-25 00:00:00 UTC"), &[]).unwrap();
    sim.run_until(seconds(1e6)).unwrap();
    let late = || scene(&text("2099-12-25 00:00:00 UTC"), &[]).unwrap();
    let mut sim = late();
    let told = sim.run_until(seconds(1e6)).unwrap_err().to_string();
    // The data end at noon of 1 January 2100 TDB, which is 7.5 days after the start, less 69 s of
    // TT − UTC.
    let end = 7.5 * 86_400.0 - 69.184;
    assert!(sim.time() <= end && sim.time() > end - 100.0, "{told}");
    assert!(get(&sim, "craft.position").norm() < 5e7 && sim.check().is_ok());
    for part in [
        &format!(
            "t = {} s: `Gravity`: the built-in ephemeris covers the Sun relative to the Earth",
            sim.time()
        ),
        "from 1899-12-31T11:59:",
        " to 2100-01-01T11:58:",
        "after the epoch 2099-12-25T00:00:00",
        "help: end the run before t = 647930 s",
        "`kernel`",
    ] {
        assert!(told.contains(part), "{part}: {told}");
    }
    let goal = |until: f64| Goal { until: Some(seconds(until)), ..Goal::default() };
    let first = |mut goal: Goal| Runner::new(late(), Nobody).go(&mut goal, 1);
    assert_eq!(first(goal(6e5)), Pause::Chunk);
    assert_eq!(first(Goal { steps: Some(3), ..goal(1e6) }), Pause::Chunk);
    let Pause::Ended(Ended::Bad(e)) = first(goal(1e6)) else { panic!("not refused") };
    let told = e.to_string();
    assert!(told.contains("t = 0 s: the run cannot reach its end: `Gravity`: "), "{told}");
    let told = scene(&text("2100-06-25 00:00:00 UTC"), &[]).err().unwrap();
    for part in [
        "`Gravity.third_bodies`",
        "at the epoch 2100-06-25T00:00:00",
        "are valid from 1900 to 2100, not at 2100-06-25",
        "kernel",
    ] {
        assert!(told.contains(part), "{part}: {told}");
    }
}

/// `slosh: apart` of a tank excludes the sloshing mass: if no other part includes it, it is lost, which the check of the file reports with location
/// and remedy. If it is connected, or settled, nothing is reported.
#[test]
fn a_tank_whose_swinging_mass_nobody_takes_is_told() {
    let text = |slosh: &str, swing: &str, wires: &str| {
        format!(
            r#"Simulation(
    bodies: {{
        "craft": (parent: "world", hinge: Free, mass: 300, inertia: [90, 120, 70], initial: {{}}),
        "swing": (parent: "craft", hinge: Chain([Slider([1, 0, 0]), Slider([0, 1, 0])]), mass: 0.1, inertia: [0, 0, 0]),
    }},
    parts: {{
        "Press": (model: "basics.constant", params: {{ "value": 3 }}),
        "Tank": (model: "flight.propellant_tank", params: {{ "propellant": 60, "radius": 0.4, "slosh": {slosh} }}, bind: {{ "bottom": "node:craft" }}),
        {swing}
    }},
    wires: [{wires}],
    gravity: "none", step: "10 ms", integrator: "rk4", until: "1 s",
)"#
        )
    };
    let told = |text: &str| scene(text, &[]).unwrap().plan().warnings.clone();
    let alone = told(&text("apart", "", ""));
    assert_eq!(alone.len(), 1, "{alone:?}");
    let message = &alone[0].message;
    assert!(message.contains("`Tank.swinging`: the mass of the first slosh mode"), "{message}");
    assert!(alone[0].help.as_ref().unwrap().contains("`slosh: settled`"));
    assert_ne!(alone[0].origin, linkwork_runtime::Origin::NONE);
    assert!(told(&text("settled", "", "")).is_empty());
    let swing = r#""Slosh": (model: "flight.slosh", bind: { "swing": "node:swing", "x": "hinge:swing[0]", "y": "hinge:swing[1]" }),"#;
    let wires = r#""Press.y -> Slosh.acceleration", "Tank.swinging -> Slosh.swinging", "Tank.swing_height -> Slosh.swing_height", "Tank.swing_stiffness -> Slosh.swing_stiffness""#;
    assert!(told(&text("apart", swing, wires)).is_empty());
    // A delayed wire counts as well.
    let wires = wires.replacen(
        r#""Tank.swinging -> Slosh.swinging""#,
        r#"(wire: "Tank.swinging -> Slosh.swinging", delay: 1)"#,
        1,
    );
    assert!(told(&text("apart", swing, &wires)).is_empty());
}
