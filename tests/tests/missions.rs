//! Simulations whose machine changes on the way: what is kept, what is booked, and that no cut leaves a
//! trace.
#![allow(clippy::unwrap_used)]
use linkwork_assembly::{Options, load_text};
use linkwork_runtime::{Files, Seconds, Simulation, Stop};
use std::sync::Arc;

#[path = "../common/mod.rs"]
mod common;

fn seconds(x: f64) -> Seconds {
    Seconds::from_decimal(x).unwrap()
}

#[test]
fn the_bouncing_ball_does_what_its_readme_says() {
    let mut sim = common::repository("bouncing_ball/sim.ron", &[]).unwrap();
    sim.run_until(seconds(5.0)).unwrap();
    // Times of impact: t₀ (1 + 2 Σ eʲ) with t₀ = √(2h/g).
    let (t0, e) = ((2.0_f64 / 9.80665).sqrt(), 0.8_f64);
    let impact = |k: i32| t0 + 2.0 * t0 * (1..k).map(|j| e.powi(j)).sum::<f64>();
    let n = sim.get("Ball.impacts").unwrap();
    let last = sim.get("Ball.last_impact").unwrap();
    println!("{n} impacts, the last at {last} s");
    assert!((last - impact(n as i32)).abs() < 1e-9, "{last} {}", impact(n as i32));
    // e^k v₀ falls below 1 mm/s after the 38th impact.
    assert_eq!(n, 38.0);
    assert_eq!(sim.get("Ball.height").unwrap(), 0.0);
}

/// Momentum (kg m/s) and angular momentum about the world's origin (kg m²/s), kinetic energy (J).
fn books(sim: &Simulation) -> ([f64; 3], [f64; 3], f64) {
    let m = sim.plan().mechanism().unwrap();
    let (nq, nv) = (m.multibody.nq(), m.multibody.nv());
    let x = &sim.state().x[m.x..];
    let mut ws = linkwork_dynamics::Workspace::new(&m.tree);
    linkwork_dynamics::kinematics(&m.tree, &mut ws, &x[..nq], &x[nq..nq + nv]);
    let (mut p, mut l, mut e) = ([0.0; 3], [0.0; 3], 0.0);
    for id in m.multibody.body_ids() {
        let (pose, v) = (ws.body_pose(&m.tree, id), ws.body_velocity(&m.tree, id));
        let h = m.multibody.get(id).inertia().rotate_by(&ws.body_rotation(&m.tree, id)).apply(&v);
        let about = h.moment + pose.position.cross(&h.force);
        for k in 0..3 {
            p[k] += h.force[k];
            l[k] += about[k];
        }
        e += 0.5 * (h.moment.dot(&v.angular) + h.force.dot(&v.linear));
    }
    (p, l, e)
}

#[test]
fn a_stack_separates_twice_and_loses_nothing() {
    let mut sim = common::repository("staging/sim.ron", &[]).unwrap();
    let far = |a: [f64; 3], b: [f64; 3]| {
        let d = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
        d / a.iter().map(|v| v * v).sum::<f64>().sqrt()
    };
    let start = books(&sim);
    let mut phases = vec![sim.phase().to_string()];
    while sim.before(seconds(20.0)) {
        let before = books(&sim);
        let phase = sim.phase().to_string();
        sim.step_event().unwrap();
        if sim.phase() != phase {
            let after = books(&sim);
            // Less than one step of 10 ms lies between the two. Measured 1e-16 and 7e-15.
            assert!(far(before.0, after.0) < 1e-12, "{before:?} {after:?}");
            assert!(far(before.1, after.1) < 1e-12, "{before:?} {after:?}");
            let report = sim.take_moves();
            println!("{:.9} s: {}", sim.time(), report[0].1);
            report[0].2.notes.iter().for_each(|n| println!("  {n}"));
            assert!(report[0].2.notes.iter().any(|n| n.contains("momentum")));
            phases.push(sim.phase().to_string());
        }
    }
    assert_eq!(phases, ["stacked", "first_separation", "second_separation"]);
    let end = books(&sim);
    println!("p {:e}, L {:e}", far(start.0, end.0), far(start.1, end.1));
    // 20 s of tumbling and two springs at a tolerance of 1e-12; measured 1e-14 and 1.1e-11.
    assert!(far(start.0, end.0) < 1e-12 && far(start.1, end.1) < 5e-11, "{start:?} {end:?}");
    // Springs of ½ k s² = 40 J and 5 J, all of it in the motion of the bodies.
    let gained = end.2 - start.2;
    println!("energy {gained} J");
    assert!((gained - 45.0).abs() < 1e-6, "{gained}");
}

/// Every mistake of the last phase is found when the file is loaded.
#[test]
fn a_mistake_in_the_last_phase_is_found_at_load() {
    let file = linkwork_tests::root().join("sims/staging/sim.ron");
    let text = std::fs::read_to_string(file).unwrap();
    let told = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        let catalogue = common::catalogue();
        let text = text.replacen(from, to, 1);
        match load_text("sim.ron", &text, &Options::new(&catalogue)) {
            Err(failure) => failure.render(false),
            Ok(loaded) => match loaded.compile(&catalogue, &Files::default()) {
                Err(faults) => {
                    let place = |f: &linkwork_runtime::Fault| {
                        let at = loaded.sources.place(f.origin);
                        format!("{at:?} {} {:?}", f.message, f.help)
                    };
                    faults.0.iter().map(place).collect::<Vec<_>>().join("\n")
                }
                Ok(_) => panic!("`{to}` was accepted"),
            },
        }
    };
    for (from, to, parts) in [
        ("\"1 kN/m\"", "\"1 kN\"", ["sim.ron", "stiffness"]),
        (
            "node:payload/bottom",
            "node:payload/buttom",
            ["no node `buttom`", "did you mean `bottom`"],
        ),
        ("Spring1.force < 1 N", "Spring1.force < 1 s", ["different quantities", "sim.ron"]),
        ("Spring1.force < 1 N", "Spring2.force < 1 N", ["Spring2.force", "sim.ron"]),
        (
            "to: { \"second_separation\"",
            "to: { \"second\"",
            ["no phase `second`", "second_separation"],
        ),
        ("like: \"first_separation\"", "like: \"first\"", ["no phase `first`", "first_separation"]),
        ("start: \"stacked\"", "start: \"staked\"", ["staked", "stacked"]),
        (
            "doc: \"The payload leaves",
            "remove: [\"Sprin1\"], doc: \"The payload leaves",
            ["Sprin1", "Spring1"],
        ),
        (
            "doc: \"The payload leaves",
            "until: \"3 s\", doc: \"The payload leaves",
            ["until", "cannot change"],
        ),
        ("doc: \"The payload leaves", "steps: 3, doc: \"The payload leaves", ["steps", "step"]),
    ] {
        let report = told(from, to);
        for part in parts {
            assert!(report.contains(part), "{to}: {part} is missing in\n{report}");
        }
        // Each mistake once, though it is in two phases.
        assert_eq!(report.matches("error:").count().max(1), 1, "{report}");
    }
}

#[test]
fn split_equals_straight_across_phases_and_in_a_fresh_process() {
    let path = "staging/sim.ron";
    let mut straight = common::repository(path, &[]).unwrap();
    straight.run_until(seconds(20.0)).unwrap();
    let fresh = || common::repository(path, &[]).unwrap();
    let (mut sim, mut random) = (fresh(), 5_u64);
    let mut events = 0;
    while sim.before(seconds(20.0)) {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        match random >> 62 {
            0 => sim
                .run_until(seconds(((sim.time() * 100.0).round() / 100.0 + 0.7).min(20.0)))
                .unwrap(),
            _ => events += u32::from(sim.step_event().unwrap() == Stop::Event),
        }
        if (random >> 40) % 16 == 0 {
            let checkpoint = sim.checkpoint("").unwrap();
            // What a fresh process has: the file, and the bytes.
            let (mut next, bytes) = (fresh(), checkpoint);
            next.restore(&bytes).unwrap();
            sim = next;
        }
    }
    assert!(events <= 4);
    assert_eq!(sim.state(), straight.state());
    assert_eq!(sim.hash(), straight.hash());
}

/// The resolved text, which logs and checkpoints carry, is the same simulation.
#[test]
fn a_simulation_with_phases_comes_back_from_its_resolved_text() {
    let catalogue = common::catalogue();
    let file = linkwork_tests::root().join("sims/staging/sim.ron");
    let text = std::fs::read_to_string(file).unwrap();
    let run = |text: &str| {
        let loaded = load_text("sim.ron", text, &Options::new(&catalogue));
        let loaded = loaded.unwrap_or_else(|f| panic!("{}\n{text}", f.render(false)));
        let program = loaded.compile(&catalogue, &Files::default()).unwrap();
        let mut sim = Simulation::of(Arc::new(program));
        sim.run_until(seconds(12.0)).unwrap();
        (sim.program().hash, sim.hash(), loaded.resolved)
    };
    let (plan, bits, resolved) = run(&text);
    let (plan2, bits2, again) = run(&resolved);
    assert_eq!((plan, bits), (plan2, bits2));
    assert_eq!(resolved, again);
}
