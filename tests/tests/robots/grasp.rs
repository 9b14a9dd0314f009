//! Bodies that are grasped and released during the run: with active loops, couplings and contact, and with a flexible body.
use linkwork_dynamics::{Workspace, kinematics, kinetic_energy, momentum};
use linkwork_plant::PlanExt;
use linkwork_runtime::{Role, Seconds, Simulation};

use crate::common;

fn seconds(x: f64) -> Seconds {
    Seconds::from_decimal(x).unwrap()
}

/// A hand on a rail with two coupled fingers and a four-bar linkage on its back, lifted by a jet; a box that stands on the floor.
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
        "Feed": (model: "flight.ideal_feed"),
    },
    wires: ["Full.y -> Jet.throttle"], connect: [("Jet.propellant", "Feed.outlet")],
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
            // Vertical momentum, and angular momentum about the rail, which the rail does not absorb. The difference is at most one step of 1 ms of
            // weight and thrust.
            for k in [2, 5] {
                let change = (after.0[k] - before.0[k]).abs();
                assert!(change < 0.2, "{} {k}: {change}", sim.phase());
            }
            if sim.phase() == "held" {
                // The box moved with the hand, and energy was lost.
                assert!(after.1 < before.1);
                assert_eq!(sim.get("box.velocity.z").unwrap(), 0.0);
                held = Some(poses(&sim, "box"));
            }
        }
        if sim.phase() == "held" {
            // The box keeps its pose in the hand, up to round-off.
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
    // The box fell, never passed through the floor, and stands again.
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

/// Two free bodies, one of them flexible, separate while they tumble and vibrate.
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
    // The boom vibrates from the start in its first bending mode.
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
            // The tolerance is for the motion in the step to the event.
            assert!(moved.fold(0.0, f64::max) < 5e-2, "{shape:?} {kept:?}");
        }
    }
    assert!(parted);
    let end = books(&sim);
    println!("momentum {:e}", far(start.0, end.0));
    assert!(far(start.0, end.0) < 1e-8, "{start:?} {end:?}");
    // The boom still vibrates, now with a free root.
    assert!(modes.iter().any(|m| sim.get(m).unwrap().abs() > 1e-4));
}

/// Two bodies that tumble towards each other are joined by a loop, with a gap of centimetres and degrees between them.
fn meeting(closing: &str) -> String {
    let text = r#"Simulation(
        bodies: {
            "tug": (parent: "world", hinge: Free, mass: 4, inertia: [0.3, 0.4, 0.5], initial: (angular: [0.2, -0.1, 0.3], velocity: [0.1, 0.02, 0]), nodes: { "port": (position: [0.5, 0.1, 0], rotation: (rpy: [0.1, 0, 0.2])) }),
            "box": (parent: "world", hinge: Free, mass: 2, inertia: [0.1, 0.2, 0.15], initial: (position: [0.93, 0.14, 0.06], rotation: (rpy: [0.2, 0.1, 0.15]), angular: [-0.1, 0.2, 0.1], velocity: [-0.05, 0, 0.04]),
                nodes: { "grip": (position: [-0.4, 0, 0.05]) }),
        },
        gravity: "none", step: "1 ms", integrator: "rk4", until: "3 s",
        start: "apart",
        phases: {
            "apart": (to: { "joined": "time > 0.2 s" }),
            "joined": (loops: { "weld": (a: "tug/port", b: "box/grip", CLOSING) }, to: { "later": "time > 1.7 s" }),
            // The loop continues, and so does its gap.
            "later": (like: "joined", step: "2 ms"),
        },
    )"#;
    text.replace("CLOSING", closing)
}

fn lanes(sim: &Simulation, name: &str) -> Vec<f64> {
    (0..6).map(|k| sim.get(&format!("Mechanism.weld.{name}[{k}]")).unwrap()).collect()
}

/// Returns frame B in frame A: position, and columns of the rotation.
fn between(sim: &Simulation) -> (linkwork_spatial::Vec3, linkwork_spatial::Quat) {
    let m = sim.plan().mechanism().unwrap();
    let (nq, nv) = (m.multibody.nq(), m.multibody.nv());
    let x = &sim.state().x[m.x..];
    let mut ws = Workspace::new(&m.tree);
    kinematics(&m.tree, &mut ws, &x[..nq], &x[nq..nq + nv]);
    let at = |name: &str| ws.node_pose(&m.tree, m.multibody.node(name).unwrap());
    let X = at("tug/port").inverse() * at("box/grip");
    (X.position, X.rotation)
}

/// Over a closing time nothing jumps, the gap follows its closed form and equals that of the bodies, and momentum is conserved.
#[test]
fn a_loop_closes_over_a_time_without_a_jump() {
    let mut ends = Vec::new();
    for solve in ["Augment", "Embed"] {
        let closing = format!("solve: {solve}, closing: Over(\"0.5 s\")");
        let mut sim = common::scene(&meeting(&closing), &[]).unwrap_or_else(|e| panic!("{e}"));
        let start = books(&sim).0;
        let mut found = None;
        let mut lost = 0.0_f64;
        while sim.before(seconds(3.0)) {
            let phase = sim.phase().to_string();
            let before = (poses(&sim, "box"), common::get(&sim, "box.velocity"));
            sim.step_event().unwrap();
            if phase == "apart" && sim.phase() == "joined" {
                // The event is between two samples, so the tolerance is the motion in 1 ms at these
                // velocities.
                let after = (poses(&sim, "box"), common::get(&sim, "box.velocity"));
                let jump = before.0.iter().zip(after.0).map(|(a, b)| (a - b).abs());
                assert!(jump.fold(0.0, f64::max) < 1e-3 && (before.1 - after.1).norm() < 1e-3);
                found = Some((sim.time(), lanes(&sim, "gap"), lanes(&sim, "gap_rate")));
            }
            let after = books(&sim).0;
            let scale = start.iter().map(|x| x * x).sum::<f64>().sqrt();
            lost = (0..6).fold(lost, |l, k| l.max((after[k] - start[k]).abs() / scale));
            let Some((t0, g, rate)) = &found else { continue };
            // The gap is critically damped: g = e^−ωt (g₀ + (ġ₀ + ω g₀) t).
            let (t, w) = (sim.time() - t0, 6.638_352_067_993_813 / 0.5);
            let now = lanes(&sim, "gap");
            for k in 0..6 {
                let form = (-w * t).exp() * (g[k] + (rate[k] + w * g[k]) * t);
                assert!((now[k] - form).abs() < 1e-7, "{solve} {t} {k}: {} {form}", now[k]);
            }
            let (p, R) = between(&sim);
            let [x, y, z] = [0, 1, 2].map(|k| linkwork_spatial::Vec3::ith(k, 1.0));
            let real = [p.x, p.y, p.z, x.dot(&(R * y)), y.dot(&(R * z)), z.dot(&(R * x))];
            for k in 0..6 {
                assert!((now[k] - real[k]).abs() < 1e-11, "{solve} {t} {k}: {} {real:?}", now[k]);
            }
        }
        let (_, g, rate) = found.unwrap();
        let size = |v: &[f64]| v.iter().map(|x| x.abs()).fold(0.0, f64::max);
        println!("{solve}: gap {g:.4?}, rate {rate:.4?}, momentum lost {lost:e}");
        assert!(size(&g) > 0.02 && size(&rate) > 0.05, "there was something to close");
        assert!(size(&lanes(&sim, "gap")) < 1e-9 && lost < 1e-9, "{lost}");
        assert_eq!(sim.phase(), "later");
        ends.push(poses(&sim, "box"));
    }
    let apart = ends[0].iter().zip(ends[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-9, "constraint_methods agree: {apart}");
}

/// With `AsFound` the bodies keep their relative pose, in an inelastic impact; with `AtOnce` they jump together.
#[test]
fn a_loop_holds_its_ends_as_they_are_found() {
    let mut sim =
        common::scene(&meeting("closing: AsFound"), &[]).unwrap_or_else(|e| panic!("{e}"));
    let start = books(&sim);
    while sim.phase() != "joined" {
        sim.step_event().unwrap();
    }
    let (p, R) = between(&sim);
    let after = books(&sim);
    for k in 0..6 {
        assert!((start.0[k] - after.0[k]).abs() < 1e-12, "{start:?} {after:?}");
    }
    assert!(after.1 < start.1 - 1e-3, "the impact takes energy");
    assert!(p.norm() > 0.02, "{p}");
    sim.run_until(seconds(3.0)).unwrap();
    let (p1, R1) = between(&sim);
    assert!((p1 - p).norm() < 1e-11 && R1.angle_to(&R) < 1e-7, "{p} {p1}");
    let mut sim = common::scene(&meeting("closing: AtOnce"), &[]).unwrap();
    while sim.phase() != "joined" {
        sim.step_event().unwrap();
    }
    assert!(between(&sim).0.norm() < 1e-11);
    assert!(sim.get("Mechanism.weld.gap[0]").is_err(), "it has none");
}

#[test]
fn closing_leaves_no_trace_of_cuts_and_refuses_what_it_is_not() {
    let text = meeting("closing: Over(\"0.5 s\")");
    let mut straight = common::scene(&text, &[]).unwrap();
    straight.run_until(seconds(2.0)).unwrap();
    let mut sim = common::scene(&text, &[]).unwrap();
    while sim.before(seconds(2.0)) {
        let bytes = sim.checkpoint("").unwrap();
        let mut next = Simulation::of(sim.program().clone());
        next.restore(&bytes).unwrap();
        sim = next.fork();
        for _ in 0..50 {
            if sim.before(seconds(2.0)) {
                sim.step_event().unwrap();
            }
        }
    }
    assert!(sim.time() >= 2.0 && sim.state().x.len() == straight.state().x.len());
    straight.run_until(seconds(sim.time())).unwrap();
    assert_eq!(sim.state(), straight.state());
    for (wrong, words) in [
        ("closing: Over(\"0 s\")", "`closing` is 0 s"),
        ("closing: Over", "`Over` lacks a time"),
        ("closing: Over(\"3 m\")", "closing"),
        ("closing: AsFound(3)", "does not have arguments"),
        ("closing: Slowly", "Slowly"),
    ] {
        let e = common::scene(&meeting(wrong), &[]).err().unwrap_or_else(|| panic!("{wrong}"));
        assert!(e.contains(words), "{wrong}: {e}");
    }
}
