//! The IFToMM benchmark problems over their full durations. Prints a table of energy drift, wall time and error, with the reference of each error.
//!
//! Run with `cargo run --release -p linkwork-solvers --example iftomm`. Words after `--` select problems whose names contain one of them.
#![allow(clippy::unwrap_used, clippy::disallowed_methods, non_snake_case)]

#[path = "../tests/benchmark_problems/mod.rs"]
mod benchmark_problems;

use benchmark_problems::references::{
    BRICARD, FOUR_BARS, FOUR_BARS_PUBLISHED, GOVERNOR, apart, limit,
};
use benchmark_problems::{
    ANDREWS, ANDREWS_END, Run, With, a01, a02, a02_angle, a03, a04, a05, a05_symmetric,
    pendulum_angle,
};
use std::f64::consts::FRAC_PI_2;
use std::time::Instant;

/// Reference of an error, and the error.
type Error<'a> = (&'a str, &'a dyn Fn(&mut Run) -> f64);

/// Prints rows of the table, one for each reference. Energy drift is the largest over a hundred samples.
fn row(name: &str, with: With, (end, h): (f64, f64), mut run: Run, errors: &[Error]) {
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
    let (with, lost) = (format!("{with:?}"), run.lost);
    for (k, (reference, error)) in errors.iter().enumerate() {
        let error = error(&mut run);
        if k == 0 {
            print!("{name:<18} {with:<15} {end:>5} {h:>6.0e} {drift:>9.1e} {lost:>4} {wall:>7.2}");
        } else {
            print!("{:<69}", "");
        }
        println!(" {error:>9.1e}  {reference}");
    }
}

const ALL: [With; 3] = [With::Rows, With::Embedded, With::FullyAugmented];

fn main() {
    println!(
        "{:<18} {:<15} {:>5} {:>6} {:>9} {:>4} {:>7} {:>9}  of what, against which reference",
        "problem", "constraint_method", "s", "step", "energy/J", "left", "wall/s", "error"
    );
    a01_rows();
    a02_rows();
    a03_rows();
    a04_rows();
    a05_rows();
}

fn a01_rows() {
    for with in ALL {
        let angle = |r: &mut Run| (r.q()[2] - (pendulum_angle(r.t) - FRAC_PI_2)).abs();
        let errors: [Error; 1] = [("angle, Jacobi's elliptic functions", &angle)];
        row("A01 pendulum", with, (10.0, 1e-3), Run::new(a01(), with), &errors);
    }
}

fn a02_rows() {
    let pendulum = |windows: usize| {
        move |r: &mut Run| {
            let [angle, rate] = a02_angle(windows, r.t);
            let (s, c) = angle.sin_cos();
            apart(&r.tip(), &[c, s, -s * rate, c * rate])
        }
    };
    for (windows, end, want, _) in FOUR_BARS {
        for with in ALL {
            // The single aggregate of all uprights and couplers is dense, so its cost is cubic in its size.
            if with == With::Embedded && windows > 10 {
                continue;
            }
            let name = format!("A02 {windows} four-bars");
            let own = pendulum(windows);
            let foreign = |r: &mut Run| apart(&r.tip(), &want);
            let mut errors: Vec<Error> = vec![
                ("B0's place and velocity, one pendulum", &own),
                ("the same, Exudyn 1.13 extrapolated", &foreign),
            ];
            let published = |r: &mut Run| {
                let tip = r.tip();
                let lane = |k: usize| limit(FOUR_BARS_PUBLISHED[2][k], FOUR_BARS_PUBLISHED[3][k]);
                apart(&tip, &[0, 1, 2, 3].map(lane))
            };
            if windows == 2 {
                errors.push(("the same, Exudyn's published series extrapolated", &published));
            }
            row(&name, with, (end, 1e-3), Run::new(a02(windows), with), &errors);
            row(&name, with, (20.0, 1e-3), Run::new(a02(windows), with), &errors[..1]);
        }
    }
}

fn a03_rows() {
    for with in ALL {
        let angles = |r: &mut Run| {
            let mbs = r.tree.multibody();
            let at = |name: &str| r.q()[mbs.get(mbs.body(name).unwrap()).q().start];
            apart(&ANDREWS.map(at), &ANDREWS_END)
        };
        // A torque and a spring do work here, so the energy column shows their work.
        let errors: [Error; 1] = [("angles, published by Hairer and Wanner", &angles)];
        row("A03 Andrews", with, (0.03, 1e-5), Run::new(a03(), with), &errors);
    }
}

fn a04_rows() {
    for with in ALL {
        let P3 = |r: &mut Run| apart(r.place("P3").as_slice(), &BRICARD[r.t.round() as usize - 1]);
        let errors: [Error; 1] = [("P3, Exudyn 1.13 extrapolated", &P3)];
        for end in [1.0, 10.0] {
            row("A04 Bricard", with, (end, 1e-3), Run::new(a04(), with), &errors);
        }
    }
}

fn a05_rows() {
    for with in [With::Rows, With::FullyAugmented] {
        let own = |r: &mut Run| apart(&r.governor(), &a05_symmetric(10.0, 2e-5));
        let foreign = |r: &mut Run| apart(&r.governor(), &GOVERNOR[GOVERNOR.len() - 1].1);
        let errors: [Error; 2] = [
            ("s, angle and rate, Lagrange's equations", &own),
            ("the same, Exudyn 1.13 (kinematic tree, RK44)", &foreign),
        ];
        // Dampers remove energy, so the energy column shows their work.
        row("A05 governor", with, (10.0, 1e-4), Run::new(a05(), with), &errors);
    }
}
