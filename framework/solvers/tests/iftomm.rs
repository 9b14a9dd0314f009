//! The IFToMM benchmark problems against closed forms, published values and independent equations; over
//! shorter times than the library's where those take long (the example `iftomm` runs the full ones).
#![allow(clippy::unwrap_used, non_snake_case)]

mod benchmark_problems;

use benchmark_problems::{
    ANDREWS, ANDREWS_END, Run, With, a01, a02, a02_angle, a03, a04, a05, a05_symmetric,
    pendulum_angle,
};

const ALL: [With; 3] = [With::Rows, With::Embedded, With::FullyAugmented];

/// 10 s against Jacobi's elliptic functions.
#[test]
fn a01_simple_pendulum() {
    // A period: 4 K(sin 45°) √(l/g), K = 1.854 074 677 301 372 (tables).
    let period = 4.0 * 1.854_074_677_301_372 / 9.81_f64.sqrt();
    let right = std::f64::consts::FRAC_PI_2;
    assert!((pendulum_angle(period) - right).abs() < 1e-7);
    assert!((pendulum_angle(0.5 * period) + right).abs() < 1e-7);
    for with in ALL {
        let mut run = Run::new(a01(), with);
        let before = run.energy();
        let mut worst: f64 = 0.0;
        for k in 1..=20 {
            run.to(0.5 * f64::from(k), 2e-3);
            let want = pendulum_angle(run.t) - right;
            worst = worst.max((run.q()[2] - want).abs());
        }
        let drift = (run.energy() - before).abs();
        println!("A01 {with:?}: angle {worst:e} rad, energy {drift:e} J");
        assert!(worst < 1e-8 && drift < 1e-9, "{with:?}: {worst:e} {drift:e}");
    }
}

/// Two windows for 10 s and forty for 1.5 s, through the singular positions, against one pendulum.
#[test]
fn a02_four_bars() {
    for (windows, end, with) in [
        (2, 10.0, With::Rows),
        (2, 10.0, With::Embedded),
        (2, 10.0, With::FullyAugmented),
        (40, 1.5, With::Rows),
    ] {
        let mut run = Run::new(a02(windows), with);
        let before = run.energy();
        run.to(end, 1e-3);
        let [angle, _] = a02_angle(windows, end);
        let (x, y) = (run.place("B0").x, run.place("B0").y);
        let error = (x - angle.cos()).abs().max((y - angle.sin()).abs());
        let drift = (run.energy() - before).abs();
        println!("A02 {windows} {with:?}: B0 {error:e} m, energy {drift:e} J");
        // The library's rule for high precision: 1e-3.
        assert!(error < 1e-5 && drift < 1e-4, "{windows} {with:?}: {error:e} {drift:e}");
    }
}

/// The published angles at 0.03 s.
#[test]
fn a03_andrews_squeezer() {
    for with in ALL {
        let mut run = Run::new(a03(), with);
        run.to(0.03, 1e-5);
        let mbs = run.tree.multibody().clone();
        let mut worst: f64 = 0.0;
        for (name, want) in ANDREWS.into_iter().zip(ANDREWS_END) {
            let got = run.q()[mbs.get(mbs.body(name).unwrap()).q().start];
            worst = worst.max((got - want).abs() / want.abs());
        }
        println!("A03 {with:?}: {worst:e}");
        assert!(worst < 1e-5, "{with:?}: {worst:e}");
    }
}

/// One of five rows repeats the others; 2 s: all treatments on one path, energy conserved.
#[test]
fn a04_bricard() {
    let mut ends = Vec::new();
    for with in ALL {
        let mut run = Run::new(a04(), with);
        let before = run.energy();
        let mut drift: f64 = 0.0;
        for k in 1..=20 {
            run.to(0.1 * f64::from(k), 1e-3);
            drift = drift.max((run.energy() - before).abs());
        }
        let P3 = run.place("P3");
        println!(
            "A04 {with:?}: P3 {P3:?}, energy {drift:e} J, {} {:e}",
            run.lost, run.contradiction
        );
        assert!(drift < 1e-6, "{with:?}: {drift:e}");
        assert!(run.contradiction < 1e-6, "{with:?}");
        if with != With::Embedded {
            assert_eq!(run.lost, 1, "{with:?}");
        }
        ends.push(P3);
    }
    assert!((ends[0] - ends[1]).norm() < 1e-6 && (ends[0] - ends[2]).norm() < 1e-6, "{ends:?}");
}

/// 1 s against Lagrange's equations of the symmetric motion.
#[test]
fn a05_flyball_governor() {
    let (end, h) = (1.0, 5e-5);
    let want = a05_symmetric(end, h);
    let fine = a05_symmetric(end, 0.5 * h);
    assert!(want.iter().zip(&fine).all(|(a, b)| (a - b).abs() < 1e-8), "{want:?} {fine:?}");
    for with in [With::Rows, With::FullyAugmented] {
        let mut run = Run::new(a05(), with);
        run.to(end, h);
        let mbs = run.tree.multibody().clone();
        let q = |name: &str| run.q()[mbs.get(mbs.body(name).unwrap()).q().start];
        let rate = run.v()[mbs.hinge("shaft").unwrap().start];
        let got = [q("rod east"), q("slider"), rate];
        println!("A05 {with:?}: {got:?} {want:?}");
        for (got, want) in got.iter().zip(&want) {
            assert!((got - want).abs() < 1e-8, "{with:?}: {got} {want}");
        }
        assert!((q("rod east") - q("rod west")).abs() < 1e-9);
        assert!((got[1] - 0.5).abs() > 1e-3, "the slider moved");
    }
}
