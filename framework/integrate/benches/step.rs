//! Cost of a fixed RK4 step in addition to its evaluations, compared with the hand-written loop that the simulator had before (`Peer`), for 1, 13 and
//! 100 lanes; and the overhead of the other methods. Run with `cargo bench -p linkwork-integrate --bench step`.
//!
//! Shortest time of a step with its four calls of ẋ = −x, ns, on a loaded 2-core Xeon with AVX2 (November 2026):
//!
//! ```text
//! lanes    peer   table
//!     1    26.8    25–28
//!    13    39–46   44–47
//!   100    121     115–119
//! ```
//! The table's step also stores the data for dense output and checks that all numbers are finite. It does not project here, like the peer; a
//! projection that may move x costs one more copy.
#![allow(missing_docs)]
use divan::{Bencher, black_box};
use linkwork_integrate::{Control, Integrator, Limits, Memory, Method, Norm, System, Tolerances};
use std::convert::Infallible;

/// The previous integrator: one loop for each axpy.
struct Peer {
    stage: Vec<f64>,
    k: Vec<f64>,
    sum: Vec<f64>,
}

impl Peer {
    fn new(n: usize) -> Self {
        Peer { stage: vec![0.0; n], k: vec![0.0; n], sum: vec![0.0; n] }
    }

    fn step(
        &mut self,
        t: f64,
        h: f64,
        x: &mut [f64],
        k1: &[f64],
        mut f: impl FnMut(f64, &[f64], &mut [f64]),
    ) {
        let half = 0.5 * h;
        self.sum.copy_from_slice(k1);
        axpy(&mut self.stage, x, half, k1);
        f(t + half, &self.stage, &mut self.k);
        add(&mut self.sum, 2.0, &self.k);
        axpy(&mut self.stage, x, half, &self.k);
        f(t + half, &self.stage, &mut self.k);
        add(&mut self.sum, 2.0, &self.k);
        axpy(&mut self.stage, x, h, &self.k);
        f(t + h, &self.stage, &mut self.k);
        add(&mut self.sum, 1.0, &self.k);
        add(x, h / 6.0, &self.sum);
    }
}

#[inline]
fn axpy(out: &mut [f64], x: &[f64], a: f64, k: &[f64]) {
    for ((o, x), k) in out.iter_mut().zip(x).zip(k) {
        *o = x + a * k;
    }
}

#[inline]
fn add(x: &mut [f64], a: f64, k: &[f64]) {
    for (x, k) in x.iter_mut().zip(k) {
        *x += a * k;
    }
}

/// ẋ = −x: almost free, so that the overhead is visible.
#[inline(never)]
fn decay(x: &[f64], xdot: &mut [f64]) {
    for (d, x) in xdot.iter_mut().zip(x) {
        *d = -x;
    }
}

struct Decay;

impl System for Decay {
    type Error = Infallible;
    fn derivatives(&mut self, _: f64, x: &[f64], xdot: &mut [f64]) -> Result<(), Infallible> {
        decay(x, xdot);
        Ok(())
    }
    fn projects(&self) -> bool {
        false
    }
}

const STEPS: usize = 1000;
const LANES: [usize; 3] = [1, 13, 100];

#[divan::bench(args = LANES)]
fn rk4_peer(bencher: Bencher, n: usize) {
    let (mut peer, mut k1) = (Peer::new(n), vec![0.0; n]);
    bencher.counter(STEPS).bench_local(|| {
        let mut x = vec![1.0; n];
        for k in 0..STEPS {
            decay(&x, &mut k1);
            peer.step(k as f64 * 1e-3, black_box(1e-3), &mut x, &k1, |_, x, d| decay(x, d));
        }
        x[0]
    });
}

fn fixed(bencher: Bencher, name: &str, n: usize) {
    let mut integrator = Integrator::new(Method::by_name(name).expect(name), n);
    let mut k1 = vec![0.0; n];
    bencher.counter(STEPS).bench_local(|| {
        let mut x = vec![1.0; n];
        for k in 0..STEPS {
            decay(&x, &mut k1);
            let t = k as f64 * 1e-3;
            integrator
                .step_fixed(&mut Decay, t, black_box(1e-3), &mut x, Some(&k1))
                .expect("a decay is finite");
        }
        x[0]
    });
}

#[divan::bench(args = LANES)]
fn rk4_table(bencher: Bencher, n: usize) {
    fixed(bencher, "rk4", n);
}

#[divan::bench(args = LANES)]
fn dormand_prince_fixed(bencher: Bencher, n: usize) {
    fixed(bencher, "dormand-prince-54", n);
}

#[divan::bench(args = LANES)]
fn verner_fixed(bencher: Bencher, n: usize) {
    fixed(bencher, "verner-87", n);
}

#[divan::bench(args = LANES)]
fn rodas_fixed(bencher: Bencher, n: usize) {
    fixed(bencher, "rodas-4p", n);
}

#[divan::bench(args = LANES)]
fn dormand_prince_adaptive(bencher: Bencher, n: usize) {
    let method = Method::by_name("dormand-prince-54").expect("registered");
    let tolerances = Tolerances::uniform(n, 1e-9, 1e-9).expect("positive");
    let limits = Limits { step_max: 1e-3, ..Limits::default() };
    let control = Control::new(method, tolerances, Norm::Rms, limits).expect("has an estimate");
    let mut integrator = Integrator::new(method, n);
    bencher.counter(STEPS).bench_local(|| {
        let (mut x, mut memory) = (vec![1.0; n], Memory { next: 1e-3, ..Memory::START });
        for k in 0..STEPS {
            let t = k as f64 * 1e-3;
            integrator
                .advance(&mut Decay, &control, t, black_box(1.0), &mut x, None, &mut memory)
                .expect("a decay is smooth");
        }
        x[0]
    });
}

fn main() {
    divan::main();
}
