//! The IFToMM benchmark problems over their full times: a table of error, energy drift and wall time.
//!
//! Run with `cargo run --release -p linkwork-solvers --example iftomm`;
//! words behind `--` choose problems whose names hold one of them.
#![allow(clippy::unwrap_used, clippy::disallowed_methods, non_snake_case)]

#[path = "../tests/benchmark_problems/mod.rs"]
mod benchmark_problems;

use benchmark_problems::{
    ANDREWS, ANDREWS_END, Run, With, a01, a02, a02_angle, a03, a04, a05, a05_symmetric,
    pendulum_angle,
};
use std::time::Instant;

/// One row of the table. Energy drift is the greatest over a hundred samples.
fn row(
    name: &str,
    with: With,
    (end, h): (f64, f64),
    mut run: Run,
    error: impl Fn(&mut Run) -> f64,
) {
    let mut words = std::env::args().skip(1).peekable();
    if words.peek().is_some() && !words.any(|w| name.contains(&w)) {
        return;
    }
    let before = run.energy();
    let (mut drift, start) = (0.0_f64, Instant::now());
    for k in 1..=100 {
        run.to(end * f64::from(k) / 100.0, h);
        drift = drift.max((run.energy() - before).abs());
    }
    let wall = start.elapsed().as_secs_f64();
    let (error, with) = (error(&mut run), format!("{with:?}"));
    let lost = run.lost;
    println!(
        "{name:<22} {with:<15} {end:>6} {h:>8.0e} {error:>10.1e} {drift:>10.1e} {lost:>5} {wall:>8.2}"
    );
}

fn main() {
    println!(
        "{:<22} {:<15} {:>6} {:>8} {:>10} {:>10} {:>5} {:>8}",
        "problem", "treatment", "s", "step", "error", "energy/J", "left", "wall/s"
    );
    let right = std::f64::consts::FRAC_PI_2;
    let all = [With::Rows, With::Embedded, With::FullyAugmented];
    for with in all {
        row("A01 pendulum", with, (10.0, 1e-3), Run::new(a01(), with), |r| {
            (r.q()[2] - (pendulum_angle(r.t) - right)).abs()
        });
    }
    for windows in [2, 10, 40] {
        for with in all {
            // One aggregate of all uprights and couplers is dense: cubic in its size.
            if with == With::Embedded && windows > 10 {
                continue;
            }
            let name = format!("A02 {windows} four-bars");
            row(&name, with, (20.0, 1e-3), Run::new(a02(windows), with), |r| {
                let [angle, _] = a02_angle(windows, r.t);
                let B0 = r.place("B0");
                (B0.x - angle.cos()).abs().max((B0.y - angle.sin()).abs())
            });
        }
    }
    for with in all {
        // A torque and a spring do work here: the energy column is theirs.
        row("A03 Andrews", with, (0.03, 1e-5), Run::new(a03(), with), |r| {
            let mbs = r.tree.multibody();
            let at = |name: &str| r.q()[mbs.get(mbs.body(name).unwrap()).q().start];
            let pairs = ANDREWS.into_iter().zip(ANDREWS_END);
            pairs.map(|(n, want)| (at(n) - want).abs()).fold(0.0, f64::max)
        });
    }
    // No closed form: the same at half the step.
    let fine = Run::new(a04(), With::Rows).to(10.0, 5e-4).place("P3");
    for with in all {
        row("A04 Bricard", with, (10.0, 1e-3), Run::new(a04(), with), |r| {
            (r.place("P3") - fine).norm()
        });
    }
    println!("A04 P3 at 10 s: {:.9} {:.9} {:.9} m", fine.x, fine.y, fine.z);
    for with in [With::Rows, With::FullyAugmented] {
        // Dampers take energy out: the energy column is theirs.
        row("A05 governor", with, (10.0, 1e-4), Run::new(a05(), with), |r| {
            let mbs = r.tree.multibody();
            let s = r.q()[mbs.get(mbs.body("slider").unwrap()).q().start];
            (s - a05_symmetric(r.t, 2e-5)[1]).abs()
        });
    }
}
