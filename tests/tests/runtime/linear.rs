//! ∂ẋ/∂x of complete mechanisms, operation by operation, compared with differences of the whole: every simulation of the repository, and scenes for
//! each of the mechanism's analytic derivatives.
use linkwork_runtime::{Place, Seconds, Simulation};

use crate::common;

/// Returns the largest difference of a row, relative to the largest number of this row, each number scaled by the size of its state; with the names
/// of the two signals.
fn worst(sim: &mut Simulation) -> (f64, String) {
    let plan = sim.plan().clone();
    let A = sim.state_matrix().unwrap().unwrap();
    let x: Vec<f64> = sim.state().x.clone();
    let n = x.len();
    let size: Vec<f64> = x.iter().map(|x| x.abs().max(1e-2)).collect();
    let mut B = vec![vec![0.0; n]; n];
    for j in 0..n {
        let mut central = |step: f64| -> Vec<f64> {
            let mut y = x.clone();
            y[j] = x[j] + step;
            let right = sim.rates(&y).unwrap();
            y[j] = x[j] - step;
            let left = sim.rates(&y).unwrap();
            right.iter().zip(left).map(|(r, l)| (r - l) / (2.0 * step)).collect()
        };
        let (coarse, fine) = (central(4e-5 * size[j]), central(2e-5 * size[j]));
        for i in 0..n {
            B[i][j] = (4.0 * fine[i] - coarse[i]) / 3.0;
        }
    }
    let name = |lane: usize| {
        let mut named = plan.lanes.iter();
        let found = named.find(|(_, v)| v.place == Place::X(lane as u32));
        found.map_or_else(|| lane.to_string(), |(path, _)| path.clone())
    };
    let mut worst = (0.0, String::new());
    for i in 0..n {
        let scale = (0..n).map(|j| (B[i][j] * size[j]).abs()).fold(1e-9, f64::max);
        // A supply integrates its energy. At rest its power is quadratic in the rates, so the row contains only the error of a one-sided difference.
        if scale < 1e-6 && name(i).ends_with("Supply.state.energy") {
            continue;
        }
        for j in 0..n {
            let miss = (A[(i, j)] - B[i][j]).abs() * size[j] / scale;
            assert!(miss.is_finite(), "∂({})'/∂({}): {} {}", name(i), name(j), A[(i, j)], B[i][j]);
            if miss > worst.0 {
                let what = format!("∂({})'/∂({}): {} {}", name(i), name(j), A[(i, j)], B[i][j]);
                worst = (miss, what);
            }
        }
    }
    worst
}

fn agrees(what: &str, sim: &mut Simulation, times: &[f64], bound: f64) {
    for t in times {
        sim.run_until(Seconds::from_decimal(*t).unwrap()).unwrap();
        let (miss, lanes) = worst(sim);
        println!("{what} at {t} s, {} states: {miss:.1e} {lanes}", sim.state().x.len());
        assert!(miss < bound, "{what} at {t} s: {miss:e} {lanes}");
    }
}

/// A free hull with a ball on it, hinges with damping, friction and an active stop, motors with inductance, a line between two bodies, a prescribed
/// rotation, uniform gravity: all derivatives of the mechanism are analytic.
#[test]
fn of_a_mechanism_that_knows_its_own() {
    let text = r#"Simulation(
        bodies: {
            "hull": (parent: "world", hinge: Free, mass: 6, inertia: [0.4, 0.6, 0.7], com: [0.1, 0.02, -0.05],
                initial: (position: [1, 2, 3], rotation: (rpy: [0.3, -0.4, 1.1]), angular: [0.3, -0.8, 0.5], velocity: [0.4, 0.1, -0.2]),
                nodes: { "hook": (position: [0.3, -0.1, 0.2], rotation: (rpy: [0.5, 0.1, -0.2])) }),
            "pod": (parent: "hull", at: (position: [0.4, 0, 0.1], rotation: (rpy: [0.1, 0.2, 0.3])), hinge: Ball, mass: 1.5, inertia: [0.02, 0.03, 0.04], com: [0.1, 0.1, 0],
                initial: (rotation: (rpy: [-0.5, 0.3, 0.2]), angular: [1, 2, -1]), nodes: { "ring": (position: [0.2, 0.1, 0.1]) }),
            "arm": (parent: "hull", at: (position: [-0.4, 0.1, 0]), hinge: Pin([0, 1, 0]), mass: 1.2, com: [0.2, 0, 0], inertia: [0.01, 0.05, 0.05],
                damping: 0.4, friction: (force: 0.5, rate: 0.3), limits: (lower: -1, upper: 0.5), stop: (stiffness: 40, damping: 0.2), initial: (angle: 0.7, rate: 0.4)),
            "wheel": (parent: "arm", at: (position: [0.5, 0, 0]), hinge: Pin([0, 0, 1]), mass: 0.4, inertia: [0.002, 0.002, 0.004], damping: 0.01, initial: (rate: 3)),
            "table": (parent: "hull", at: (position: [0, 0.5, 0]), hinge: Pin(axis: [0, 0, 1], prescribed: true), mass: 0.7, inertia: [0.02, 0.02, 0.03], com: [0.1, 0, 0.05], initial: (rate: 0.5)),
        },
        parts: {
            "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0.3, -0.2, -3.71] }),
            "Volts": (model: "basics.constant", params: { "value": 12 }),
            "Supply": (model: "power.ideal_supply", params: { "voltage": 24 }),
            "Motor": (model: "actuators.dc_motor", params: { "resistance": 0.6, "inductance": "2 mH", "torque_constant": 0.05, "coulomb": 0.1 }, bind: { "shaft": "hinge:wheel" }),
            "Spring": (model: "actuators.spring_damper", params: { "stiffness": 20, "damping": 0.5 }, bind: { "shaft": "hinge:arm" }),
            "Line": (model: "flight.line", params: { "length": 0.01, "stiffness": 300, "damping": 4 }, bind: { "a": "node:hull/hook", "b": "node:pod/ring" }),
            "Damper": (model: "flight.rate_damping", params: { "damping": [0.5, 0.2, 0.3] }, bind: { "body": "node:pod" }),
            "Turn": (model: "basics.hinge_trajectory", params: { "profile": [["1 s", "40 deg"], ["3 s", "-20 deg"]] }, bind: { "hinge": "hinge:table" }),
        },
        wires: ["Volts.y -> Motor.volts"], connect: [("Motor.supply", "Supply.terminal")], integrator: "rodas4p", accuracy: "fixed", step: "5 ms", until: "1 s")"#;
    let mut sim = common::scene(text, &[]).unwrap_or_else(|e| panic!("{e}"));
    agrees("hull", &mut sim, &[0.0], 1e-6);
    // Later the friction of the motor is at the kink of its bristle, where differences are meaningless.
    let motor = text.lines().find(|l| l.contains("Motor")).unwrap();
    let text = text.replace(motor, "").replace("\"Volts.y -> Motor.volts\"", "");
    let text = text.replace("(\"Motor.supply\", \"Supply.terminal\")", "");
    let mut sim = common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
    // The line is differentiated by differences of its ends' positions: where the hull's z is near zero the increment is small, and the round-off of
    // the difference is 1.4e-5.
    agrees("hull without the motor", &mut sim, &[0.0, 0.2, 0.9], 3e-5);
}

/// Other cases: a flexible beam, position-dependent gravity, changing masses, loops and couplings.
#[test]
fn of_the_simulations() {
    for (path, times) in [
        ("pendulum/sim.ron", [0.0, 1.0]),
        ("attitude/sim.ron", [0.0, 2.0]),
        ("ballistic_entry/sim.ron", [0.0, 30.0]),
        ("earth_orbit/sim.ron", [0.0, 100.0]),
        ("slider_crank/sim.ron", [0.0, 0.5]),
        ("double_wishbone/sim.ron", [0.0, 0.5]),
        ("staging/sim.ron", [0.0, 1.0]),
        ("lunar_landing/sim.ron", [5.0, 10.0]),
    ] {
        let mut sim = common::repository(path, &[]).unwrap_or_else(|e| panic!("{path}: {e}"));
        // One-sided differences include half of the second derivative.
        agrees(path, &mut sim, &times, 1e-5);
    }
}

/// A crate on terrain with compliant contact: derivatives of its contact, by differences of the mechanism alone. Impulse-based contact does not have
/// rates, so the matrix does not exist.
#[test]
fn of_contact() {
    let text = |contact: &str| {
        format!(
            r#"Simulation(
                bodies: {{ "crate": (parent: "world", hinge: Free, mass: 20, inertia: Box([1, 0.8, 0.4]), initial: (position: [0, 0, 0.20027], rotation: (rpy: [0, "-5 deg", 0])),
                    shapes: [(shape: Box([1, 0.8, 0.4]), collide: true, name: "hull")]) }},
                parts: {{
                    "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}),
                    "Ground": (model: "environment.flat", params: {{ "slope": "5 deg", "soil": {{ "kind": "lunar" }} }}),
                }},
                contact: ({contact}), step: "1 ms", until: "10 s")"#
        )
    };
    let mut sim = common::scene(&text("compliant: true"), &[]).unwrap_or_else(|e| panic!("{e}"));
    sim.run_until(Seconds::from_decimal(1.0).unwrap()).unwrap();
    let A = sim.state_matrix().unwrap().unwrap();
    let n = A.nrows();
    assert_eq!(n, 17);
    // Bristles deflect as the surface slips: ż as a function of the crate's velocity is a rotated unit
    // matrix.
    let slip = A.view((13, 10), (4, 3));
    assert!((slip.norm() - 2f64.sqrt()).abs() < 1e-3, "{slip}");
    // This is the stiffness of the ground: the supporting force increases at four corners by k/m
    // each.
    let push: f64 = (10..13).map(|i| A[(i, 2)]).map(|v| v * v).sum::<f64>().sqrt();
    assert!((push / (4.0 * 1e5 / 20.0) - 1.0).abs() < 0.1, "{push}");
    let mut sim = common::scene(&text(""), &[]).unwrap_or_else(|e| panic!("{e}"));
    assert!(sim.state_matrix().unwrap().is_none());
}

/// Sum = Lag + ½ Sum, so Sum = 2 Lag: the derivative of a solved loop follows from the loop's own.
#[test]
fn of_a_solved_loop() {
    let text = r#"Simulation(parts: {
        "Lag": (model: "basics.lag", params: { "time_constant": 4, "start": 0.7 }),
        "Sum": (model: "basics.sum"),
        "Half": (model: "basics.gain", params: { "k": 0.5 }),
        "Total": (model: "basics.integrator", params: { "start": 0.3 }),
    }, wires: ["Lag.y -> Sum.u", (wire: "Half.y -> Sum.u", solve: 1e-12), "Sum.y -> Half.u", "Sum.y -> Total.u", "Total.y -> Lag.u"],
    integrator: "rodas4p", accuracy: "fixed", step: "10 ms", gravity: "none", until: "1 s")"#;
    let mut sim = common::scene(text, &[]).unwrap_or_else(|e| panic!("{e}"));
    sim.run_until(Seconds::from_decimal(0.1).unwrap()).unwrap();
    let A = sim.state_matrix().unwrap().unwrap();
    // The equations are Lag' = (Total − Lag) / 4, Total' = 2 Lag; the lanes are in the order of
    // paths.
    let want = [[-0.25, 0.25], [2.0, 0.0]];
    for i in 0..2 {
        for j in 0..2 {
            assert!((A[(i, j)] - want[i][j]).abs() < 1e-7, "{A}");
        }
    }
    agrees("loop", &mut sim, &[0.2], 1e-7);
}
