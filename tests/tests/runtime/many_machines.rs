//! Many machines with compliant contact: pairs of colliders share bristles. Forces are those of pairs with their own bristles, the number of variables is
//! proportional to the number of machines, and no division of a run, order of the file or thread changes a bit.
use super::splits::{Ended, cut, integrate, methods, straight};
use crate::common;
use linkwork_runtime::{Program, Seconds, Simulation};
use std::fmt::Write;
use std::sync::Arc;

/// Gravity, with a horizontal part that friction carries (m/s²).
const PULL: f64 = 1.0;

fn until(sim: &mut Simulation, t: f64) {
    sim.run_until(Seconds::from_decimal(t).unwrap()).unwrap();
}

/// Blocks of 5 kg that lie on slabs of other machines. Slabs do not move along x, where gravity pulls the blocks.
fn couples(count: usize, contact: &str, fields: &str) -> String {
    let sunk = 5.0 * 9.81 / 4e5;
    let mut bodies = String::new();
    for k in 0..count {
        let y = 0.5 * k as f64;
        write!(
            bodies,
            r#""slab{k}": (parent: "world", at: (position: [0, {y}, 0]), hinge: Slider([0, 1, 0]), mass: 10, inertia: [1, 1, 1],
                shapes: [(shape: Box([0.4, 0.4, 0.1]), collide: (friction: 0.5))]),
            "block{k}": (parent: "world", at: (position: [0, {y}, {z}]), hinge: Chain(Slider([1, 0, 0]), Slider([0, 0, 1])), mass: 5, inertia: [1, 1, 1],
                shapes: [(shape: Box([0.2, 0.2, 0.1]), collide: (friction: 0.5))]),"#,
            z = 0.1 - sunk
        )
        .unwrap();
    }
    format!(
        r#"Simulation(
            bodies: {{ {bodies} }},
            parts: {{ "G": (model: "environment.uniform_gravity", params: {{ "acceleration": [{PULL}, 0, -9.81] }}) }},
            contact: (compliant: (stiffness: 1e5, bristle_stiffness: 1e5, bristle_damping: 50), pair_forces: [["block0", "slab0"]], {contact}),
            step: "0.2 ms", until: "10 s", {fields})"#
    )
}

/// Balls and boxes that fall onto each other and the ground with spin, and jump apart; all can touch each other.
fn pile(contact: &str, fields: &str, order: &[usize]) -> String {
    let mut bodies = String::new();
    for k in order {
        let (x, y, z) = (0.11 * (k % 3) as f64, 0.07 * (k % 2) as f64, 0.2 + 0.17 * *k as f64);
        let shape = match k % 2 {
            0 => format!("Sphere({})", 0.08 + 0.01 * *k as f64),
            _ => format!("Box([0.2, {}, 0.12])", 0.16 + 0.01 * *k as f64),
        };
        write!(
            bodies,
            r#""body{k}": (parent: "world", hinge: Free, mass: {mass}, inertia: [0.01, 0.012, 0.009],
                initial: (position: [{x}, {y}, {z}], angular: [{k}, -2, 1], velocity: [0.3, {side}, -1]),
                shapes: [(shape: {shape}, collide: (friction: 0.6))]),"#,
            mass = 1 + k,
            side = 0.2 - 0.1 * *k as f64,
        )
        .unwrap();
    }
    format!(
        r#"Simulation(
            bodies: {{ {bodies} }},
            parts: {{ "G": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}) }},
            colliders: {{ "ground": (on: "world", shape: HalfSpace, friction: 0.6) }},
            contact: (compliant: (stiffness: 2e4, damping: 0.5, bristle_stiffness: 2e4, bristle_damping: 60), {contact}),
            step: "0.5 ms", until: "10 s", {fields})"#
    )
}

const IN_ORDER: [usize; 6] = [0, 1, 2, 3, 4, 5];

/// Entries of the table of pairs, which are the only discrete states of these simulations.
fn entries(sim: &Simulation) -> Vec<f64> {
    sim.state().d.clone()
}

/// Coordinates and velocities: all states except bristles.
fn motion(sim: &Simulation) -> Vec<u64> {
    let plan = sim.plan();
    let names = plan
        .variables
        .iter()
        .filter(|(name, v)| v.role == linkwork_runtime::Role::State && !name.contains("bristle"));
    names.map(|(name, _)| sim.get(name).unwrap().to_bits()).collect()
}

/// Within nine tenths of the limit a bristle is a spring k_t with a damper d_t. The block is a damped oscillator about x = m g_x / k_t:
/// x = x∞ (1 − e^(−σ t) (cos ω t + σ/ω sin ω t)), σ = d_t / 2 m, ω² = k_t / m − σ².
#[test]
fn a_block_that_sticks_to_another_machine_follows_the_law_of_its_bristle() {
    let (m, k, d) = (5.0, 1e5, 50.0);
    let (rest, decay) = (m * PULL / k, d / (2.0 * m));
    let omega = f64::sqrt(k / m - decay * decay);
    let closed = |t: f64| {
        let (sin, cos) = (omega * t).sin_cos();
        rest * (1.0 - (-decay * t).exp() * (cos + decay / omega * sin))
    };
    for (method, tolerance) in [
        ("accuracy: \"fixed\", integrator: \"rk4\"", 1e-5),
        ("integrator: \"dormand_prince_54\"", 1e-5),
    ] {
        for (limit, shared) in [("touching_max: 4", true), ("", false)] {
            let mut sim = common::scene(&couples(3, limit, method), &[]).unwrap();
            assert_eq!(!entries(&sim).is_empty(), shared, "{limit}");
            for t in [0.002, 0.01, 0.0314, 0.1] {
                until(&mut sim, t);
                for k in 0..3 {
                    let x = sim.get(&format!("block{k}[0].displacement")).unwrap();
                    let error = (x - closed(t)).abs() / rest;
                    assert!(error < tolerance, "{method} {limit} block{k} {t} s: {error:e}");
                }
            }
            until(&mut sim, 4.0);
            let force = sim.get("block0.contact_with.slab0.force.x").unwrap();
            assert!((force + m * PULL).abs() < 1e-6 * m * PULL, "{method} {limit}: {force} N");
            if shared {
                let named = |k: usize| sim.get(&format!("Mechanism.contact.bristle_pair[{k}]"));
                assert_eq!((0..4).map(|k| named(k).unwrap()).collect::<Vec<_>>(), entries(&sim));
                assert_eq!(entries(&sim).iter().filter(|e| **e != 0.0).count(), 3);
            }
        }
    }
}

/// A pair that touches, separates, and touches again has the forces of a pair with its own bristle, bit by bit, although its bristle is another one.
#[test]
fn shared_bristles_do_what_own_ones_do() {
    let fields = "integrator: \"semi_implicit_euler\"";
    let mut own = common::scene(&pile("", fields, &IN_ORDER), &[]).unwrap();
    let mut shared = common::scene(&pile("touching_max: 16", fields, &IN_ORDER), &[]).unwrap();
    assert_eq!((entries(&own).len(), entries(&shared).len()), (0, 16));
    let (mut seen, mut again) = (std::collections::BTreeMap::new(), 0);
    let mut before = entries(&shared);
    for row in 1..=6000 {
        let t = f64::from(row) * 5e-4;
        if row % 2000 == 0 {
            // The bodies are lifted by 2 m, and their bristles relax while they fall.
            for sim in [&mut own, &mut shared] {
                for k in IN_ORDER {
                    let height = format!("body{k}.position.z");
                    sim.set(&height, sim.get(&height).unwrap() + 2.0).unwrap();
                }
            }
        }
        until(&mut own, t);
        until(&mut shared, t);
        assert_eq!(motion(&own), motion(&shared), "{t} s");
        let now = entries(&shared);
        for (bristle, (entry, old)) in now.iter().zip(&before).enumerate() {
            if entry != old && *entry != 0.0 {
                let last = seen.insert(entry.to_bits(), bristle);
                again += usize::from(last.is_some());
            }
        }
        before = now;
    }
    println!(
        "{} pairs touched, {again} of them again after their bristle was released",
        seen.len()
    );
    assert!(seen.len() >= 10 && again >= 2, "{seen:?}, {again}");
}

/// Runs in any division, with any integrator: stopped at rows and events, copied, saved, resumed, and set back.
#[test]
fn no_division_of_a_run_changes_what_shares_bristles() {
    let text = pile("touching_max: 16", "", &IN_ORDER);
    let mut program = load(&text);
    for method in methods() {
        integrate(&mut program, method);
        // The first contacts begin at 10 ms.
        let end = Seconds::new(200, 1000).unwrap();
        let expected = straight(&program, end);
        assert!(expected.is_ok(), "{method:?}: {expected:?}");
        assert_eq!(cut(&program, end, 5), expected, "{method:?}");
    }
}

fn load(text: &str) -> Arc<Program> {
    let ready = linkwork_assemblies::library().text("sim.ron", text);
    Arc::new(ready.map_err(|f| f.render(false)).unwrap().program)
}

#[test]
fn neither_the_order_of_machines_nor_threads_change_what_shares_bristles() {
    let fields = "integrator: \"rk4\"";
    let mut program = load(&pile("touching_max: 16", fields, &IN_ORDER));
    let end = Seconds::new(700, 1000).unwrap();
    let expected = straight(&program, end);
    assert!(expected.is_ok(), "{expected:?}");
    for order in [[5, 4, 3, 2, 1, 0], [3, 0, 5, 1, 4, 2]] {
        assert_eq!(straight(&load(&pile("touching_max: 16", fields, &order)), end), expected);
    }
    let program = &mut program;
    for threads in 1..=2 {
        let ended: Vec<Ended> = std::thread::scope(|scope| {
            let program = &*program;
            let runs: Vec<_> =
                (0..threads).map(|k| scope.spawn(move || cut(program, end, k))).collect();
            runs.into_iter().map(|run| run.join().unwrap()).collect()
        });
        assert!(ended.iter().all(|e| *e == expected), "{threads}: {ended:?}");
    }
}

#[test]
fn more_touching_pairs_than_bristles_are_an_error_with_a_remedy() {
    // The error is detected at the start.
    let sim = common::scene(&couples(3, "touching_max: 2", ""), &[]).unwrap();
    let told = sim.check().unwrap_err().to_string();
    for part in ["3 pairs of colliders touch", "bristles for 2", "touching_max: 4", "Mechanism"] {
        assert!(told.contains(part), "{part}: {told}");
    }
    // The error is detected during a run.
    let mut sim = common::scene(&pile("touching_max: 3", "", &IN_ORDER), &[]).unwrap();
    let told = sim.run_until(3.0).unwrap_err();
    assert!(told.time > 0.01 && told.to_string().contains("touching_max"), "{told}");
    // The remedy of the message works.
    let mut sim = common::scene(&couples(3, "touching_max: 4", ""), &[]).unwrap();
    until(&mut sim, 0.1);
    // The field does not have a meaning for contact by impulses.
    let text = "Simulation(bodies: {}, contact: (touching_max: 5), step: \"1 ms\", until: \"1 s\")";
    let told = common::scene(text, &[]).err().unwrap();
    assert!(told.contains("touching_max") && told.contains("compliant: true"), "{told}");
}

/// Pairs with bristles that have relaxed, and, if these are not enough, other pairs that are apart, give theirs to pairs that touch.
#[test]
fn pairs_that_are_apart_give_their_bristles_to_pairs_that_touch() {
    let fields = "integrator: \"semi_implicit_euler\"";
    let mut sim = common::scene(&pile("touching_max: 7", fields, &IN_ORDER), &[]).unwrap();
    let mut full = 0;
    for row in 1..=4000 {
        until(&mut sim, f64::from(row) * 5e-4);
        full += usize::from(entries(&sim).iter().all(|e| *e != 0.0));
    }
    println!("{full} rows without a free bristle");
    assert!(full > 0);
}

/// Bristles and table together: five numbers for each of six touching pairs of a collider, and at least 256 pairs.
#[test]
fn the_number_of_states_is_proportional_to_the_number_of_machines() {
    let states = |couples_: usize| {
        let program = load(&couples(couples_, "", ""));
        let sizes = program.phases[0].plan.sizes;
        // A slab and a block have three coordinates and three velocities.
        sizes.x + sizes.d - 6 * couples_
    };
    let pairs = |n: usize| n * (n - 1) / 2;
    assert_eq!(states(10), 4 * pairs(20));
    for n in [30, 60, 120] {
        assert_eq!(states(n), 5 * 6 * 2 * n, "{n}");
    }
}
