//! The simulations of closed loops and of contact agree with their READMEs.
use linkwork_runtime::{Seconds, Simulation};

use crate::common;

fn sim(path: &str) -> Simulation {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../sims/");
    let text = std::fs::read_to_string(format!("{root}{path}")).unwrap();
    common::scene(&text, &[]).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Returns the largest value of each variable over a run, sampled every `ms` milliseconds.
fn greatest(sim: &mut Simulation, seconds: u64, ms: u64, of: &[&str]) -> Vec<f64> {
    let mut worst = vec![f64::NEG_INFINITY; of.len()];
    for k in 1..=seconds * 1000 / ms {
        sim.run_until(Seconds { num: k * ms, den: 1000 }).unwrap();
        for (w, name) in worst.iter_mut().zip(of) {
            *w = w.max(sim.get(name).unwrap());
        }
    }
    worst
}

#[test]
fn the_slider_crank_runs_rigid_and_flexible() {
    let rigid = &mut sim("slider_crank/sim.ron");
    let of = ["piston.displacement", "Mechanism.wrist.error", "crank.rate"];
    let got = greatest(rigid, 2, 2, &of);
    println!("rigid {got:?}");
    // The crank is 0.1 m long, the rod 0.4 m, and the piston's zero is at 0.3 m, so the largest
    // displacement is 0.2 m.
    assert!((got[0] - 0.2).abs() < 1e-3, "{got:?}");
    assert!(got[1] < 1e-11, "{got:?}");
    let flexible = &mut sim("slider_crank/flexible.ron");
    let of = [
        "piston.displacement",
        "Mechanism.wrist.error",
        "rod.mode[0]",
        "rod.mode[1]",
        "rod.mode[2]",
    ];
    let got = greatest(flexible, 1, 1, &of);
    println!("flexible {got:?}");
    assert!((got[0] - 0.2).abs() < 5e-3 && got[1] < 1e-10, "{got:?}");
}

#[test]
fn the_double_wishbone_runs_rigid_and_flexible() {
    let of = [
        "chassis.displacement",
        "post.displacement",
        "Mechanism.upper_ball.error",
        "Mechanism.tie_ball.error",
        "Mechanism.patch.error",
    ];
    for file in ["double_wishbone/sim.ron", "double_wishbone/flexible.ron"] {
        let got = greatest(&mut sim(file), 1, 5, &of);
        println!("{file} {got:?}");
        assert!((got[1] - 0.03).abs() < 2e-3, "{file}: {got:?}");
        assert!(got[0] > 0.01 && got[0] < 0.12, "{file}: {got:?}");
        assert!(got[2..].iter().all(|e| *e < 1e-10), "{file}: {got:?}");
    }
}

#[test]
fn the_peg_goes_in() {
    let mut s = sim("peg_insertion/sim.ron");
    let of =
        ["Mechanism.contact.penetration", "Mechanism.contact.residual", "Mechanism.contact.points"];
    let got = greatest(&mut s, 5, 1, &of);
    let depth = s.get("gantry.displacement").unwrap();
    println!(
        "peg {got:?} {depth} {} {}",
        s.get("peg[0].displacement").unwrap(),
        s.get("peg[1].displacement").unwrap()
    );
    assert!(got[2] >= 1.0 && got[0] < 1e-3 && got[1] < 1e-5, "{got:?}");
    assert!(depth < -0.15, "stuck at {depth}");
}

/// Closing loops, flexible bodies and contact do not allocate once memory has its size.
#[test]
fn stepping_allocates_nothing() {
    for (path, seconds) in [
        ("slider_crank/sim.ron", 1),
        ("slider_crank/flexible.ron", 1),
        ("double_wishbone/sim.ron", 1),
        ("peg_insertion/sim.ron", 4),
    ] {
        let mut sim = sim(path);
        sim.run_until(Seconds { num: seconds, den: 1 }).unwrap();
        let counts = allocation_counter::measure(|| (0..200).for_each(|_| sim.step().unwrap()));
        assert_eq!(counts.count_total, 0, "{path}: {counts:?}");
    }
}
