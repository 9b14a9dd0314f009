//! Growth of the cost with the length of a chain: forward dynamics by articulated bodies, by a dense mass matrix and its Cholesky factors, and by
//! operator expressions.
//!
//! `cargo bench --profile counts -p linkwork-dynamics --bench linear [-- --write]`. Prints times, instructions (if valgrind is installed) and link
//! visits, and the exponent of their growth between the two longest chains. With `--write` it also draws `framework/dynamics/benches/linear.svg`.
#![allow(non_snake_case)]

#[path = "../tests/support/mod.rs"]
mod support;

mod callgrind;
#[allow(dead_code)]
mod mechanisms;
mod picture;

use callgrind::{CALLS, CHILD};
use linkwork_dynamics::spatial::Vec3;
use linkwork_dynamics::spatial::nalgebra::{DMatrix, DVector};
use linkwork_dynamics::*;
use linkwork_operators::*;
use picture::{Curve, Panel};
use std::collections::BTreeMap;
use std::hint::black_box;

const LENGTHS: [usize; 10] = [1, 2, 4, 8, 16, 32, 64, 128, 256, 512];
/// Number of repetitions, of which the best is used, and the duration of one, s.
const REPEATS: usize = 7;
const SLICE: f64 = 0.004;

const FORWARD: &str = "articulated bodies";
const DENSE: &str = "dense M + Cholesky";
const MASS: &str = "(H φ M φ* H* + J) x";
const INVERSE: &str = "(I − H ψ K)* D⁻¹ (I − H ψ K) x";
const NAMES: [&str; 4] = [FORWARD, DENSE, MASS, INVERSE];

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    if words.first().is_some_and(|w| w == CHILD) {
        let n = words[1].parse().expect("a length");
        chain(n, |key, call| callgrind::run(&key.replace(' ', "_"), call));
        return;
    }
    let (times, counts, visits) = (measure(times), measure(counts), measure(visits));
    table("time, ns", &times);
    table("instructions", &counts);
    table("link visits", &visits);
    if words.iter().any(|w| w == "--write") {
        let micro = times.iter().map(|(k, c)| (*k, scaled(c, 1e-3))).collect();
        let panels = [
            panel("time of a call (µs)", &micro, 5e-3),
            panel("instructions of a call", &counts, 30.0),
            panel("link visits of a product", &visits, 1.5),
        ];
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/linear.svg");
        std::fs::write(path, picture::svg("links of the chain", &panels)).expect("written");
        println!("written: framework/dynamics/benches/linear.svg");
    }
}

/// Points of each curve.
type Curves = BTreeMap<&'static str, Vec<(f64, f64)>>;

fn measure(one: impl Fn(usize) -> BTreeMap<&'static str, f64>) -> Curves {
    let mut curves = Curves::new();
    for n in LENGTHS {
        for (name, y) in one(n) {
            curves.entry(name).or_default().push((n as f64, y));
        }
    }
    curves
}

fn scaled(points: &[(f64, f64)], s: f64) -> Vec<(f64, f64)> {
    points.iter().map(|(x, y)| (*x, s * y)).collect()
}

fn table(what: &str, curves: &Curves) {
    println!("\n{what}");
    print!("{:<32}", "links");
    LENGTHS.iter().for_each(|n| print!("{n:>12}"));
    println!("{:>9}", "exponent");
    for (name, points) in curves {
        print!("{name:<32}");
        points.iter().for_each(|(_, y)| print!("{y:>12.0}"));
        let [.., (_, a), (_, b)] = points[..] else { continue };
        println!("{:>9.2}", (b / a).log2());
    }
}

/// Returns one panel with all curves and reference lines for growth as n and as n³.
fn panel(title: &str, curves: &Curves, low: f64) -> Panel {
    let color = |name: &str| match name {
        FORWARD => "#0b6e4f",
        DENSE => "#c1292e",
        MASS => "#3066be",
        _ => "#e09f3e",
    };
    let curves = NAMES.iter().filter_map(|name| {
        let points = curves.get(name)?.clone();
        Some(Curve { name: (*name).into(), color: color(name).into(), points })
    });
    Panel { title: title.into(), curves: curves.collect(), low }
}

/// Runs each algorithm on a chain, by name.
fn chain(n: usize, mut run: impl FnMut(&'static str, &mut dyn FnMut(usize))) {
    let mbs = mechanisms::chain(n);
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
    let (q, v, mut tau) = (mbs.random_q(1), mbs.random_v(1), mbs.random_v(2));
    let (mut vdot, mut bias, mut M) = (vec![0.0; n], vec![0.0; n], vec![0.0; n * n]);
    let zero = vec![0.0; n];
    let mut out = DVector::zeros(n);
    run(DENSE, &mut |_| {
        inverse_dynamics(&tree, &mut ws, &q, &v, &zero, &mut bias);
        mass_matrix(&tree, &mut ws, &mut M);
        let factors = DMatrix::from_row_slice(n, n, &M).cholesky().expect("positive definite");
        out.iter_mut().zip(tau.iter().zip(&bias)).for_each(|(x, (t, b))| *x = t - b);
        factors.solve_mut(&mut out);
        black_box(&out);
    });
    run(FORWARD, &mut |_| {
        forward_dynamics(&tree, &mut ws, &q, &v, &mut tau, &mut vdot).expect("regular");
        black_box(&vdot);
    });
    // The dense solution loses accuracy for longer chains.
    let size = out.amax();
    let off = out.iter().zip(&vdot).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(
        n > 32 || off <= 1e-7 * size,
        "{n} links: the two methods differ by {off:e} of {size:e}"
    );
    for (name, operator) in expressions(&tree, &ws) {
        let mut scratch = operator.scratch().expect("sound");
        run(name, &mut |_| {
            operator.apply_into(&tau, &mut vdot, &mut scratch).expect("sound");
            black_box(&vdot);
        });
    }
}

fn expressions(tree: &Tree, ws: &Workspace) -> [(&'static str, Operator); 2] {
    let operators = Operators::new(tree, ws).expect("regular");
    [(MASS, operators.mass()), (INVERSE, operators.mass_inverse())]
}

#[allow(clippy::disallowed_methods)] // A benchmark reads the clock.
fn times(n: usize) -> BTreeMap<&'static str, f64> {
    let mut found = BTreeMap::new();
    chain(n, |key, call| {
        let mut pass = |loops: usize| {
            let start = std::time::Instant::now();
            (0..loops).for_each(&mut *call);
            start.elapsed().as_secs_f64() / loops as f64
        };
        let loops = (SLICE / pass(2)).max(1.0) as usize;
        let best = (0..REPEATS).map(|_| pass(loops)).fold(f64::INFINITY, f64::min);
        found.insert(key, 1e9 * best);
    });
    found
}

fn counts(n: usize) -> BTreeMap<&'static str, f64> {
    let mut found = BTreeMap::new();
    if n == LENGTHS[0] && !callgrind::is_here() {
        return found;
    }
    let own = std::env::current_exe().expect("this program");
    match callgrind::callgrind(&own, &[CHILD, &n.to_string()]) {
        Ok(counts) => {
            for name in NAMES {
                found.insert(name, counts[&name.replace(' ', "_")]);
            }
        }
        Err(why) => println!("{n} links, {CALLS} calls: {why}"),
    }
    found
}

fn visits(n: usize) -> BTreeMap<&'static str, f64> {
    let mbs = mechanisms::chain(n);
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    poses(&tree, &mut ws, &mbs.random_q(1));
    let (x, mut y) = (mbs.random_v(1), vec![0.0; n]);
    let visits = expressions(&tree, &ws).map(|(name, operator)| {
        let mut scratch = Scratch::default();
        operator.apply_into(&x, &mut y, &mut scratch).expect("sound");
        (name, scratch.link_visits() as f64)
    });
    visits.into_iter().collect()
}
