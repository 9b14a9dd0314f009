//! Bodies that are taken and let go while the run goes on: with loops, couplings and contact in play, and
//! with a body that bends.
#![allow(clippy::unwrap_used)]
use linkwork_dynamics::{Workspace, kinematics, kinetic_energy, momentum};
use linkwork_runtime::{Role, Seconds, Simulation};

#[path = "../common/mod.rs"]
mod common;

fn seconds(x: f64) -> Seconds {
    Seconds::from_decimal(x).unwrap()
}

/// A hand on a rail with two coupled fingers and a four-bar linkage on its back, lifted by a jet; a box
/// that stands on the floor.
const GRIPPER: &str = r#"Simulation(
    bodies: {
        "hand": (parent: "world", at: (position: [0, 0, 1]), hinge: Chain(Slider([0, 0, 1]), Pin([0, 0, 1])), mass: 10, inertia: [0.2, 0.2, 0.1], initial: (coordinates: [0, 0], rates: [0.1, 0.4]),
            nodes: { "jet": () }),
        "left": (parent: "hand", at: (position: [0.1, 0, -0.1]), hinge: Pin([0, 1, 0]), mass: 0.4, com: [0, 0, -0.2], inertia: [2e-3, 2e-3, 1e-4], initial: (angle: 0.1), stop: false),
        "right": (parent: "hand", at: (position: [-0.1, 0, -0.1]), hinge: Pin([0, -1, 0]), mass: 0.4, com: [0, 0, -0.2], inertia: [2e-3, 2e-3, 1e-4], initial: (angle: 0.1)),
        "crank": (parent: "hand", at: (position: [0, 0.2, 0.1]), hinge: Pin([0, 1, 0]), mass: 0.3, com: [0, 0, 0.1], inertia: [1e-3, 1e-3, 1e-4], initial: (angle: 0.3, rate: 0.5)),
        "rod": (parent: "crank", at: (position: [0, 0, 0.2]), hinge: Pin([0, 1, 0]), mass: 0.2, com: [0.15, 0, 0], inertia: [1e-4, 1e-3, 1e-3], initial: (angle: -0.3)),
        "rocker": (parent: "hand", at: (position: [0.3, 0.2, 0.1]), hinge: Pin([0, 1, 0]), mass: 0.3, com: [0, 0, 0.1], inertia: [1e-3, 1e-3, 1e-4], initial: (angle: 0.3)),
        "box": (parent: "world", hinge: Free, mass: 2, inertia: Box([0.2, 0.2, 0.2]), initial: (position: [0.05, 0, 0.1]),
            shapes: [(shape: Box([0.2, 0.2, 0.2]), collide: true, name: "skin")]),
    },
    couplings: { "fingers": (terms: { "left": 1, "right": -1 }) },
    loops: { "bar": (a: "rod", at_a: (position: [0.3, 0, 0]), b: "rocker", at_b: (position: [0, 0, 0.2]), hinge: Pin([0, 1, 0])) },
    colliders: { "floor": (on: "world", shape: HalfSpace) },
    contact: (friction: 0.5, tolerance: 1e-10),
    parts: {
        "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }),
        "Full": (model: "basics.constant", params: { "value": 1.0 }),
        "Jet": (model: "flight.engine", params: { "thrust": 150, "specific_impulse": 300 }, bind: { "nozzle": "node:hand/jet" }),
    },
    wires: ["Full.y -> Jet.throttle"],
    step: "1 ms", integrator: "rk4", until: "3 s",
    start: "reach",
    phases: {
        "reach": (to: { "held": "time > 0.2 s" }),
        "held": (bodies: { "box": (parent: "hand", hinge: Free, prescribed: true) }, to: { "released": "time > 0.8 s" }),
        "released": (bodies: { "box": (parent: "world", hinge: Free) }),
    },
)"#;

/// Momentum (about the world's origin), kinetic energy.
fn books(sim: &Simulation) -> ([f64; 6], f64) {
    let m = sim.plan().mechanism().unwrap();
    let (nq, nv) = (m.multibody.nq(), m.multibody.nv());
    let x = &sim.state().x[m.x..];
    let mut ws = Workspace::new(&m.tree);
    kinematics(&m.tree, &mut ws, &x[..nq], &x[nq..nq + nv]);
    let p = momentum(&m.tree, &ws);
    let energy = kinetic_energy(&m.tree, &ws, &x[nq..nq + nv]);
    ([p.moment.x, p.moment.y, p.moment.z, p.force.x, p.force.y, p.force.z], energy)
}

fn poses(sim: &Simulation, body: &str) -> [f64; 7] {
    [
        "position.x",
        "position.y",
        "position.z",
        "rotation.x",
        "rotation.y",
        "rotation.z",
        "rotation.w",
    ]
    .map(|lane| sim.get(&format!("{body}.{lane}")).unwrap())
}

#[test]
fn a_box_is_grasped_lifted_and_dropped_with_a_loop_a_coupling_and_contact_in_play() {
    let mut sim = common::scene(GRIPPER, &[]).unwrap_or_else(|e| panic!("{e}"));
    let mut held = None;
    let mut least = f64::INFINITY;
    while sim.before(seconds(3.0)) {
        let (before, phase) = (books(&sim), sim.phase().to_string());
        sim.step_event().unwrap();
        let closed = sim.get("Mechanism.bar.error").unwrap().abs()
            + sim.get("Mechanism.fingers.error").unwrap().abs();
        assert!(closed < 1e-9, "{} s: {closed}", sim.time());
        if sim.phase() != phase {
            let after = books(&sim);
            let moves = sim.take_moves();
            println!("{} {moves:?}", sim.phase());
            // Vertical momentum and angular momentum about the rail, which the rail does not take.
            // A step of 1 ms of weight and thrust lies between at most.
            for k in [2, 5] {
                let change = (after.0[k] - before.0[k]).abs();
                assert!(change < 0.2, "{} {k}: {change}", sim.phase());
            }
            if sim.phase() == "held" {
                // The box took part in the motion of the hand, and energy was lost.
                assert!(after.1 < before.1);
                assert_eq!(sim.get("box.velocity.z").unwrap(), 0.0);
                held = Some(poses(&sim, "box"));
            }
        }
        if sim.phase() == "held" {
            // Held where it was, to rounding.
            for (a, b) in poses(&sim, "box").iter().zip(held.unwrap()) {
                assert!((a - b).abs() < 1e-12);
            }
            if sim.time() > 0.3 {
                assert_eq!(sim.get("Mechanism.contact.points").unwrap(), 0.0);
            }
        }
        if sim.phase() == "released" {
            least = least.min(sim.get("box.position.z").unwrap());
        }
    }
    assert_eq!(sim.phase(), "released");
    // It fell, never through the floor, and stands again.
    let [x, y, z, ..] = poses(&sim, "box");
    println!("{x} {y} {z}, at least {least}");
    assert!((z - 0.1).abs() < 1e-3 && least > 0.098, "{z} {least}");
    assert!(sim.get("Mechanism.contact.points").unwrap() >= 4.0);
    assert!(sim.get("hand[0].displacement").unwrap() > 0.5);
}

#[test]
fn cuts_leave_no_trace_while_things_are_grasped() {
    let mut straight = common::scene(GRIPPER, &[]).unwrap();
    straight.run_until(seconds(1.2)).unwrap();
    let program = straight.program().clone();
    let mut sim = Simulation::of(program.clone());
    let (mut random, mut n) = (11_u64, 0);
    while sim.before(seconds(1.2)) {
        sim.step_event().unwrap();
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        n += 1;
        let near = [0.2, 0.8].iter().any(|t| (sim.time() - t).abs() < 2e-3);
        if random >> 58 == 0 || near {
            let bytes = sim.checkpoint("").unwrap();
            sim = Simulation::of(program.clone());
            sim.restore(&bytes).unwrap();
        } else if random >> 57 == 3 {
            sim = sim.fork();
        }
    }
    assert!(n >= 1200);
    assert_eq!(sim.state(), straight.state());
}

/// Two free bodies of which one bends part while they tumble and vibrate.
#[test]
fn a_flexible_boom_separates_and_loses_nothing() {
    let text = r#"Simulation(
        bodies: {
            "bus": (parent: "world", hinge: Free, mass: 40, inertia: [4, 5, 6], initial: (angular: [0.3, -0.2, 0.5], velocity: [0.1, 0, 0])),
            "boom": (parent: "bus", at: (position: [0.5, 0.1, 0]), hinge: Locked,
                modes: Beam(length: 2, diameter: "3 cm", inner: "2.6 cm", young: "70 GPa", poisson: 0.33, density: 2700, damping_ratio: 0, count: 2),
                nodes: { "tip": (position: [2, 0, 0]) }),
            "load": (parent: "boom/tip", mass: 0.5, inertia: Sphere(0.05)),
        },
        gravity: "none", step: "1 ms", integrator: "dormand_prince_54", accuracy: (relative: 1e-11, absolute: 1e-13), until: "4 s",
        start: "together",
        phases: {
            "together": (to: { "apart": "time > 1 s" }),
            "apart": (bodies: { "boom": (parent: "world", at: (position: [0, 0, 0]), hinge: Free) }),
        },
    )"#;
    let mut sim = common::scene(text, &[]).unwrap_or_else(|e| panic!("{e}"));
    let modes: Vec<String> = (sim.plan().variables.iter())
        .filter(|(p, v)| v.role == Role::State && p.starts_with("boom.mode"))
        .map(|(p, _)| p.clone())
        .collect();
    assert!(modes.len() >= 8, "{modes:?}");
    // It vibrates from the start: the first bending mode.
    sim.set("boom.mode[0]", 0.02).unwrap();
    let far = |a: [f64; 6], b: [f64; 6]| {
        let norm = |v: &dyn Fn(usize) -> f64, r: std::ops::Range<usize>| {
            r.map(|k| v(k).powi(2)).sum::<f64>().sqrt()
        };
        let part =
            |r: std::ops::Range<usize>| norm(&|k| a[k] - b[k], r.clone()) / norm(&|k| a[k], r);
        part(0..3).max(part(3..6))
    };
    let start = books(&sim);
    let mut parted = false;
    while sim.before(seconds(4.0)) {
        let before = (books(&sim), sim.phase().to_string());
        let shape: Vec<f64> = modes.iter().map(|m| sim.get(m).unwrap()).collect();
        sim.step_event().unwrap();
        if sim.phase() != before.1 {
            parted = true;
            let after = books(&sim);
            assert!(far(before.0.0, after.0) < 1e-11, "{:?} {after:?}", before.0);
            let kept: Vec<f64> = modes.iter().map(|m| sim.get(m).unwrap()).collect();
            let moved = shape.iter().zip(&kept).map(|(a, b)| (a - b).abs());
            // The step to the event lies between.
            assert!(moved.fold(0.0, f64::max) < 5e-2, "{shape:?} {kept:?}");
        }
    }
    assert!(parted);
    let end = books(&sim);
    println!("momentum {:e}", far(start.0, end.0));
    assert!(far(start.0, end.0) < 1e-8, "{start:?} {end:?}");
    // It still vibrates, now free at its root.
    assert!(modes.iter().any(|m| sim.get(m).unwrap().abs() > 1e-4));
}
