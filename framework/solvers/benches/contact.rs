//! Time of contact problems: `cargo bench -p linkwork-solvers --bench contact`.
//!
//! Warm: the solver starts from the solution of a similar problem, in which the free velocity of each degree of freedom differs at random by up to
//! 0.1 % of the change that the impulses caused. Cold: the solver starts from zero.
#![allow(clippy::unwrap_used)]

#[path = "../tests/support/mod.rs"]
mod support;

use divan::Bencher;
use linkwork_solvers::contact::{Contact, Method, Settings};
use support::{Case, Random, humanoid, pile};

fn main() {
    divan::main();
}

/// Returns a problem similar to `case`, and the impulses of `case`.
fn moved(case: Case) -> (Case, Vec<[f64; 4]>) {
    let (lambda, report) = case.solve(Method::Auto, 1e-11);
    assert!(report.converged);
    let mut rng = Random(5);
    let shift: Vec<f64> = case.pulled(&lambda).iter().map(|y| 1e-3 * y * rng.number()).collect();
    let mut next = case.clone();
    for g in 0..case.cones.len() {
        for i in case.start[g] as usize..case.start[g + 1] as usize {
            for k in 0..4 {
                next.b[g][k] += case.e[i][k] * shift[case.dof[i] as usize];
            }
        }
    }
    (next, lambda)
}

fn run(bencher: Bencher, case: &Case, start: &[[f64; 4]], method: Method) {
    let mut contact = Contact::new(Settings { method, sweeps: 20_000, ..Settings::default() });
    if method == Method::Auto {
        contact.settings = Settings::default();
    }
    let mut lambda = start.to_vec();
    bencher.bench_local(|| {
        lambda.copy_from_slice(start);
        let report = contact.solve(&case.problem(), &mut lambda).unwrap();
        assert!(report.converged, "{report:?}");
        report
    });
}

const METHODS: [Method; 3] = [Method::Auto, Method::GaussSeidel, Method::Newton];

/// 11 contacts on 27 degrees of freedom, all touching; the arguments seed the rows.
#[divan::bench(args = [1, 2, 3])]
fn humanoid_warm(bencher: Bencher, seed: u64) {
    let (case, start) = moved(humanoid(seed));
    run(bencher, &case, &start, Method::Auto);
}

/// 60 contacts on 120 degrees of freedom.
#[divan::bench(args = METHODS)]
fn pile_at_rest_warm(bencher: Bencher, method: Method) {
    let (case, start) = moved(pile(0.0));
    run(bencher, &case, &start, method);
}

/// The same pile, pushed so that some contacts slide and some open.
#[divan::bench(args = METHODS)]
fn pile_pushed_warm(bencher: Bencher, method: Method) {
    let (case, start) = moved(pile(0.02));
    run(bencher, &case, &start, method);
}

/// Cold start.
#[divan::bench(args = METHODS)]
fn pile_pushed_cold(bencher: Bencher, method: Method) {
    let case = pile(0.02);
    run(bencher, &case, &[[0.0; 4]; 60], method);
}

/// One sweep with its preparation and residual: the minimum cost of a warm start.
#[divan::bench]
fn pile_one_sweep(bencher: Bencher) {
    let case = pile(0.02);
    let mut contact =
        Contact::new(Settings { method: Method::GaussSeidel, sweeps: 1, ..Settings::default() });
    let mut lambda = vec![[0.0; 4]; 60];
    bencher.bench_local(|| {
        lambda.fill([0.0; 4]);
        contact.solve(&case.problem(), &mut lambda).unwrap()
    });
}
