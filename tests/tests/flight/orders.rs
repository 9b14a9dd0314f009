//! Every integrator has its order on complete mechanisms: a free top, a double pendulum, an entry, a rover's suspension. The stiff one integrates a
//! motor whose current settles within a fraction of the step.
use linkwork_runtime::{Integrator, Role, Seconds, Simulation};

use crate::common;

/// Returns the final state, with one step per sample.
fn end(text: &str, method: &str, step: f64, until: f64) -> Vec<f64> {
    let settings = format!(
        "{text} gravity: \"{}\", integrator: \"{method}\", accuracy: \"fixed\", step: {step}, until: {until})",
        if text.contains("\"Gravity\"") || text.contains("capsule.ron") { "" } else { "none" }
    );
    let settings = settings.replace("gravity: \"\", ", "");
    let mut sim = common::scene(&settings, &[]).unwrap_or_else(|e| panic!("{e}"));
    sim.run_until(Seconds::from_decimal(until).unwrap()).unwrap();
    states(&sim)
}

fn states(sim: &Simulation) -> Vec<f64> {
    let all = &sim.plan().variables;
    let of_state = all.iter().filter(|(_, v)| v.role == Role::State);
    of_state.map(|(path, _)| sim.get(path).unwrap()).collect()
}

/// Compares the measured orders between two steps with the nominal ones, for each method.
fn orders(what: &str, text: &str, until: f64, steps: &[(&str, f64, f64)]) {
    let reference = end(text, "verner_87", steps[0].1 / 64.0, until);
    for &(method, step, order) in steps {
        let error = |h: f64| {
            let got = end(text, method, h, until);
            let miss = got.iter().zip(&reference).map(|(a, b)| (a - b).powi(2));
            miss.sum::<f64>().sqrt()
        };
        let (coarse, fine) = (error(step), error(step / 2.0));
        let seen = (coarse / fine).log2();
        println!("{what}: {method} at {step} s: {coarse:.2e}, {fine:.2e}, order {seen:.2}");
        assert!(fine < coarse && seen > order - 0.4, "{what}: {method}: {seen}, {coarse} {fine}");
        // An order far above the nominal one would mean that the test does not measure the error.
        assert!(seen < order + 2.5, "{what}: {method}: {seen}, {coarse} {fine}");
    }
}

#[test]
fn on_a_free_top() {
    let text = r#"Simulation(bodies: { "top": (parent: "world", hinge: Free, mass: 2, inertia: [0.1, 0.2, 0.28], com: [0.1, 0, 0],
        initial: (angular: [0.3, 2.0, 0.1], velocity: [0.2, 0, 0.1])) },"#;
    let steps = [
        ("semi_implicit_euler", 0.0025, 1.0),
        ("rk4", 0.1, 4.0),
        ("bogacki_shampine_32", 0.1, 3.0),
        ("dormand_prince_54", 0.2, 5.0),
        ("verner_87", 0.5, 8.0),
        ("rodas4p", 0.05, 4.0),
    ];
    orders("free top", text, 10.0, &steps);
}

#[test]
fn on_a_double_pendulum() {
    let text = r#"Simulation(bodies: {
        "upper": (parent: "world", hinge: Pin([0, 1, 0]), mass: 1, com: [0.5, 0, 0], inertia: [0.01, 0.08, 0.08], initial: (angle: "70 deg", rate: 1)),
        "lower": (parent: "upper", at: (position: [1, 0, 0]), hinge: Pin([0, 1, 0]), mass: 1, com: [0.5, 0, 0], inertia: [0.01, 0.08, 0.08], initial: (angle: "40 deg", rate: -2)),
    }, parts: { "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }) },"#;
    let steps = [
        ("semi_implicit_euler", 0.0005, 1.0),
        ("rk4", 0.003125, 4.0),
        ("bogacki_shampine_32", 0.003125, 3.0),
        ("dormand_prince_54", 0.00625, 5.0),
        ("verner_87", 0.025, 8.0),
        ("rodas4p", 0.003125, 4.0),
    ];
    orders("double pendulum", text, 1.0, &steps);
}

#[test]
fn on_an_entry() {
    // The capsule is from sims/ballistic_entry, with a slow tumble; the time includes its peak
    // drag at 85 s.
    let text = r#"Simulation(parts: { "Capsule": (assembly: "flight/capsule.ron",
        params: { "position": [3521190, 0, 0], "velocity": [-1764.732, 7046.389, 0] }) },"#;
    let steps = [
        ("semi_implicit_euler", 0.125, 1.0),
        ("rk4", 2.0, 4.0),
        ("bogacki_shampine_32", 1.0, 3.0),
        ("dormand_prince_54", 2.0, 5.0),
        ("verner_87", 12.5, 8.0),
        ("rodas4p", 4.0, 4.0),
    ];
    orders("entry", text, 100.0, &steps);
}

/// Sun and Moon attract, drag decelerates, and sunlight is interrupted in every revolution: shadow edges are events, and a step ends at each. After
/// an edge the covered fraction of the Sun grows with the distance to the power 3/2, which steps of a minute follow to 0.2 mm in six hours.
#[test]
fn on_an_orbit_with_eclipses_and_third_bodies() {
    let end = |method: &str, step: f64| {
        let (method, step) = (format!("integrator={method}"), format!("step={step} s"));
        let set = ["accuracy=fixed", &method, &step];
        let mut sim = common::repository("earth_orbit/full_force.ron", &set).unwrap();
        sim.run_until(Seconds::from_decimal(21_600.0).unwrap()).unwrap();
        common::get(&sim, "craft.position")
    };
    let reference = end("verner_87", 5.0);
    let error = |method: &str, step: f64| (end(method, step) - reference).norm();
    for (method, step, order) in
        [("rk4", 60.0, 4.0), ("dormand_prince_54", 60.0, 5.0), ("verner_87", 480.0, 8.0)]
    {
        let (coarse, fine) = (error(method, step), error(method, step / 2.0));
        let seen = (coarse / fine).log2();
        println!("eclipses: {method} at {step} s: {coarse:.2e} m, {fine:.2e} m, order {seen:.2}");
        assert!(seen > order - 0.5 && seen < order + 2.5, "{method}: {seen}, {coarse} {fine}");
    }
    for step in [120.0, 60.0, 30.0] {
        let off = error("verner_87", step);
        println!("eclipses: verner_87 at {step} s: {off:.2e} m");
        assert!(off < 5e-4, "{off}");
    }
}

#[test]
fn on_the_suspension_of_a_rover() {
    // The chassis is on springs, the differential couples the rockers, and the bogies have friction; the
    // parameters are the rover's.
    let text = r#"Simulation(bodies: {
        "chassis": (parent: "world", hinge: Chain(Slider([0, 0, 1]), Pin([1, 0, 0]), Pin([0, 1, 0])), mass: 708, inertia: Box([1.9, 1.5, 0.6]), initial: (coordinates: [0.1, 0.1, -0.15], rates: [0, 0.2, 0.3])),
        "rocker_left": (parent: "chassis", at: (position: [0.214, 0.604, 0.1254]), hinge: Pin([0, 1, 0]), mass: 25, com: [0.06, 0.25, -0.1], inertia: Box([1.6, 0.1, 0.3]), initial: (angle: 0.15)),
        "rocker_right": (parent: "chassis", at: (position: [0.214, -0.604, 0.1254]), hinge: Pin([0, 1, 0]), mass: 25, com: [0.06, -0.25, -0.1], inertia: Box([1.6, 0.1, 0.3]), initial: (angle: -0.15)),
        "bogie_left": (parent: "rocker_left", at: (position: [-0.754, 0.241, -0.2321]), hinge: Pin([0, 1, 0]), mass: 39, com: [-0.08, 0.2, -0.1], inertia: Box([1.1, 0.1, 0.2]), initial: (angle: 0.3)),
        "bogie_right": (parent: "rocker_right", at: (position: [-0.754, -0.241, -0.2321]), hinge: Pin([0, 1, 0]), mass: 39, com: [-0.08, -0.2, -0.1], inertia: Box([1.1, 0.1, 0.2]), initial: (angle: -0.2)),
    },
    couplings: { "differential": (terms: { "rocker_left": 1, "rocker_right": 1 }) },
    parts: {
        "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -3.71] }),
        "Heave": (model: "actuators.spring_damper", params: { "stiffness": 2e4, "damping": 900 }, bind: { "shaft": "hinge:chassis[0]" }),
        "Roll": (model: "actuators.spring_damper", params: { "stiffness": 9e3, "damping": 500 }, bind: { "shaft": "hinge:chassis[1]" }),
        "Pitch": (model: "actuators.spring_damper", params: { "stiffness": 9e3, "damping": 500 }, bind: { "shaft": "hinge:chassis[2]" }),
        "Left": (model: "actuators.spring_damper", params: { "stiffness": 300, "damping": 60 }, bind: { "shaft": "hinge:bogie_left" }),
        "Right": (model: "actuators.spring_damper", params: { "stiffness": 300, "damping": 60 }, bind: { "shaft": "hinge:bogie_right" }),
    },"#;
    let steps = [
        ("semi_implicit_euler", 0.0005, 1.0),
        ("rk4", 0.02, 4.0),
        ("bogacki_shampine_32", 0.02, 3.0),
        ("dormand_prince_54", 0.04, 5.0),
        ("verner_87", 0.08, 8.0),
        ("rodas4p", 0.01, 4.0),
    ];
    orders("suspension", text, 1.6, &steps);
}

/// L = 0.1 mH, R = 0.6 Ω: the current settles in 0.17 ms. At a step of 1 ms the stiff method is accurate within the error of its order, and all
/// explicit ones are unstable.
#[test]
fn a_motor_with_a_tenth_of_a_millihenry_runs_at_a_millisecond() {
    let text = r#"Simulation(
        bodies: { "wheel": (parent: "world", hinge: Pin([0, 1, 0]), mass: 1, inertia: [0.01, 0.02, 0.01]) },
        parts: {
            "Volts": (model: "basics.constant", params: { "value": 12 }),
            "Supply": (model: "power.ideal_supply", params: { "voltage": 12 }),
            "Motor": (model: "actuators.dc_motor", params: { "resistance": 0.6, "inductance": "0.1 mH", "torque_constant": 0.05 }, bind: { "shaft": "hinge:wheel" }),
        },
        wires: ["Volts.y -> Motor.volts"], connect: [("Motor.supply", "Supply.terminal")], gravity: "none", accuracy: ACCURACY, integrator: "METHOD", step: "1 ms", until: "1 s")"#;
    let run = |method: &str, accuracy: &str| {
        let text = text.replace("METHOD", method).replace("ACCURACY", accuracy);
        let mut sim = common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
        sim.run_until(Seconds::from_decimal(1.0).unwrap())
            .map(|()| (sim.get("wheel.rate").unwrap(), sim.get("Motor.current").unwrap()))
            .map_err(|e| e.to_string())
    };
    // The reference solves the two linear equations L i̇ = U − R i − k ω, J ω̇ = k i.
    let (l, r, k, j, u, t) = (1e-4_f64, 0.6_f64, 0.05_f64, 0.02_f64, 12.0_f64, 1.0_f64);
    let root = (r * r / (l * l) - 4.0 * k * k / (l * j)).sqrt();
    let (a, b) = (0.5 * (-r / l + root), 0.5 * (-r / l - root));
    // The solution is ω = U/k + c₁ e^{at} + c₂ e^{bt}, with ω(0) = 0, ω̇(0) = 0.
    let c2 = (u / k) * a / (b - a);
    let c1 = -u / k - c2;
    let omega = u / k + c1 * (a * t).exp() + c2 * (b * t).exp();
    let current = j / k * (c1 * a * (a * t).exp() + c2 * b * (b * t).exp());
    let (w, i) = run("rodas4p", "\"fixed\"").unwrap();
    println!("fixed: rate {w} {omega}, current {i} {current}");
    assert!(
        (w / omega - 1.0).abs() < 1e-4 && (i / current - 1.0).abs() < 1e-4,
        "{w} {omega} {i} {current}"
    );
    let (w, i) = run("rodas4p", "(relative: 1e-8, absolute: 1e-8)").unwrap();
    println!("adaptive: rate {w} {omega}, current {i} {current}");
    assert!(
        (w / omega - 1.0).abs() < 1e-6 && (i / current - 1.0).abs() < 1e-6,
        "{w} {omega} {i} {current}"
    );
    // 1 ms · R/L = 6 is outside every explicit method's stability region.
    for method in ["rk4", "bogacki_shampine_32"] {
        let error = run(method, "\"fixed\"").unwrap_err();
        assert!(error.contains("Motor") || error.contains("wheel"), "{error}");
    }
    assert!(Integrator::ALL.iter().any(|(name, _)| *name == "rodas4p"));
}
