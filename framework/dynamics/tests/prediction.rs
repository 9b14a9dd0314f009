//! Steps with covariance: compared with differences of the step, closed forms, a set of sample states, and the motion itself.

use crate::support::{Rng, Shape, random_tree};
use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge, Multibody};
use linkwork_dynamics::spatial::nalgebra::DMatrix;
use linkwork_dynamics::spatial::{MassProperties, Mat3, Vec3};
use linkwork_dynamics::*;

const GRAVITY: Vec3 = Vec3::new(1.0, -2.0, -9.0);

struct Case {
    tree: Tree,
    ws: Workspace,
    prediction: Prediction,
    tau: Vec<f64>,
    vdot: Vec<f64>,
    density: Vec<f64>,
}

impl Case {
    fn new(mbs: &Multibody) -> Case {
        let tree = Tree::new(mbs);
        let vdot: Vec<f64> = mbs.random_v(5).iter().map(|x| 0.3 * x).collect();
        let (ws, prediction) = (Workspace::new(&tree), Prediction::new(&tree));
        Case { tau: mbs.random_v(4), density: vec![0.0; mbs.nv()], vdot, tree, ws, prediction }
    }
    fn nv(&self) -> usize {
        self.tree.nv()
    }
    fn step(&mut self, q: &mut [f64], v: &mut [f64], P: &mut [f64], step: f64) {
        let drive = Drive {
            tau: &self.tau,
            vdot: &self.vdot,
            density: &self.density,
            gravity: GRAVITY,
            step,
        };
        let state = StateEstimate { q, v, covariance: P };
        self.prediction.step(&self.tree, &mut self.ws, state, drive).unwrap();
    }
    /// Returns the state after a step.
    fn goes(&mut self, q: &[f64], v: &[f64], step: f64) -> (Vec<f64>, Vec<f64>) {
        let (mut q, mut v, mut P) = (q.to_vec(), v.to_vec(), vec![0.0; 4 * self.nv() * self.nv()]);
        self.step(&mut q, &mut v, &mut P, step);
        (q, v)
    }
}

fn shape(bodies: usize, floating: bool) -> Shape {
    Shape { bodies, floating, prescribed: false, armature: false }
}

fn trees() -> impl Iterator<Item = Multibody> {
    (0..6).map(|seed| {
        let shape = Shape {
            bodies: 2 + seed as usize,
            floating: seed % 2 == 0,
            prescribed: seed % 3 == 1,
            armature: seed % 2 == 1,
        };
        random_tree(seed + 900, shape)
    })
}

#[test]
fn the_transition_is_the_derivative_of_the_step() {
    let mut most = 0.0_f64;
    for mbs in trees() {
        let mut c = Case::new(&mbs);
        let (n, h, e) = (c.nv(), 0.05, 1e-6);
        let (q, v) = (mbs.random_q(1), mbs.random_v(2));
        let (q_end, _) = c.goes(&q, &v, h);
        let F = c.prediction.transition().to_vec();
        let scale = F.iter().fold(1.0_f64, |a, x| a.max(x.abs()));
        for k in 0..2 * n {
            let ends = [e, -e].map(|e| {
                let (mut from, mut rate, mut dv) = (q.clone(), v.clone(), vec![0.0; n]);
                if k < n {
                    dv[k] = e;
                    mbs.integrate(&q, &dv, &mut from);
                } else {
                    rate[k - n] += e;
                }
                let (to, rate) = c.goes(&from, &rate, h);
                let mut at = vec![0.0; n];
                mbs.difference(&q_end, &to, &mut at);
                [at, rate].concat()
            });
            for i in 0..2 * n {
                let slope = (ends[0][i] - ends[1][i]) / (2.0 * e);
                let off = (slope - F[i * 2 * n + k]).abs() / scale;
                most = most.max(off);
                assert!(off < 2e-8, "{i} {k}: {slope} {}", F[i * 2 * n + k]);
            }
        }
    }
    println!("off by {most:e} of the largest");
}

#[test]
fn a_turn_may_be_of_any_size() {
    // Test ⊕ alone, with balls and free hinges and rotations of up to a full revolution.
    for (seed, size) in [(0, 0.1), (2, 1.0), (4, 6.0)] {
        let mbs = random_tree(seed + 900, shape(5, true));
        let (n, e) = (mbs.nv(), 1e-6);
        let (q, d): (_, Vec<f64>) =
            (mbs.random_q(3), mbs.random_v(7).iter().map(|x| size * x).collect());
        let [mut by_q, mut by_d] = [(); 2].map(|()| vec![0.0; n * n]);
        mbs.integrate_derivatives(&d, &mut by_q, &mut by_d);
        let plus = |q: &[f64], d: &[f64]| {
            let mut out = q.to_vec();
            mbs.integrate(q, d, &mut out);
            out
        };
        let end = plus(&q, &d);
        for k in 0..n {
            let unit = |e: f64| (0..n).map(|i| if i == k { e } else { 0.0 }).collect::<Vec<_>>();
            let moved = |e: f64| plus(&plus(&q, &unit(e)), &d);
            let farther =
                |e: f64| plus(&q, &d.iter().zip(unit(e)).map(|(a, b)| a + b).collect::<Vec<_>>());
            for (by, ends) in [(&by_q, [moved(e), moved(-e)]), (&by_d, [farther(e), farther(-e)])] {
                let at = ends.map(|to| {
                    let mut at = vec![0.0; n];
                    mbs.difference(&end, &to, &mut at);
                    at
                });
                for i in 0..n {
                    let slope = (at[0][i] - at[1][i]) / (2.0 * e);
                    assert!(
                        (slope - by[i * n + k]).abs() < 1e-7 * (1.0 + size),
                        "{size} {i} {k}: {slope} {}",
                        by[i * n + k]
                    );
                }
            }
        }
    }
}

/// A mass on a rail.
fn cart() -> Multibody {
    let mut b = Builder::new();
    let body = MassProperties::new(2.5, Vec3::zeros(), Mat3::identity() * 0.1);
    b.body(BodySpec::new("cart", "world").hinge(Hinge::slider(Vec3::x())).mass(body));
    b.build().unwrap()
}

#[test]
fn a_mass_that_noise_pushes_wanders_as_its_closed_form() {
    let (mbs, m, s, T) = (cart(), 2.5, 0.4, 3.0);
    for steps in [1, 7, 300] {
        let mut c = Case::new(&mbs);
        (c.tau[0], c.density[0]) = (0.7, s);
        let start = [0.02, -0.004, -0.004, 0.05];
        let (mut q, mut v, mut P) = (vec![0.3], vec![-0.2], start.to_vec());
        for _ in 0..steps {
            c.step(&mut q, &mut v, &mut P, T / f64::from(steps));
        }
        let a = 0.7 / m + GRAVITY.x;
        assert!((q[0] - (0.3 - 0.2 * T + 0.5 * a * T * T)).abs() < 1e-12 * 100.0);
        assert!((v[0] - (-0.2 + a * T)).abs() < 1e-12 * 100.0);
        let S = s / (m * m);
        let want = [
            start[0] + 2.0 * T * start[1] + T * T * start[3] + S * T.powi(3) / 3.0,
            start[1] + T * start[3] + S * T * T / 2.0,
            start[3] + S * T,
        ];
        for (got, want) in [P[0], P[1], P[3]].iter().zip(want) {
            assert!((got / want - 1.0).abs() < 1e-12, "{steps}: {got} {want}");
        }
        assert_eq!(P[1], P[2]);
    }
}

#[test]
fn the_mean_is_of_second_order() {
    for mbs in trees() {
        let mut c = Case::new(&mbs);
        let (q, v) = (mbs.random_q(1), mbs.random_v(2));
        let mut run = |steps: u32| {
            let (mut q, mut v, mut P) = (q.clone(), v.clone(), vec![0.0; 4 * v.len() * v.len()]);
            for _ in 0..steps {
                c.step(&mut q, &mut v, &mut P, 0.1 / f64::from(steps));
            }
            (q, v)
        };
        let ends = [8, 16, 512].map(&mut run);
        let off = |k: usize| {
            let mut d = vec![0.0; v.len()];
            mbs.difference(&ends[2].0, &ends[k].0, &mut d);
            let rates = ends[k].1.iter().zip(&ends[2].1).map(|(a, b)| a - b);
            d.iter().copied().chain(rates).map(|x| x * x).sum::<f64>().sqrt()
        };
        let ratio = off(0) / off(1);
        assert!((3.3..4.7).contains(&ratio), "{ratio}");
    }
}

#[test]
fn covariance_is_that_of_a_cloud_of_states_and_of_the_product_written_out() {
    let mbs = random_tree(903, shape(3, false));
    let mut c = Case::new(&mbs);
    let (n, h, steps) = (mbs.nv(), 0.01, 12);
    let (q, v) = (mbs.random_q(1), mbs.random_v(2));
    let mut r = Rng(3);
    let L = DMatrix::from_fn(2 * n, 2 * n, |i, j| if j <= i { 2e-4 * r.signed() } else { 0.0 });
    let start = &L * L.transpose();
    let (mut at, mut rate) = (q.clone(), v.clone());
    let mut P: Vec<f64> = start.transpose().as_slice().to_vec();
    let mut product = start.clone();
    for _ in 0..steps {
        c.step(&mut at, &mut rate, &mut P, h);
        let F = DMatrix::from_row_slice(2 * n, 2 * n, c.prediction.transition());
        product = &F * product * F.transpose();
    }
    let P = DMatrix::from_row_slice(2 * n, 2 * n, &P);
    assert!((&P - &product).amax() < 1e-12 * P.amax());
    assert_eq!(P, P.transpose());
    // A state at each end of each axis of the initial ellipsoid: their squared deviations add up to the covariance.
    let mut cloud = DMatrix::zeros(2 * n, 2 * n);
    for k in 0..2 * n {
        for sign in [1.0, -1.0] {
            let x: Vec<f64> = L.column(k).iter().map(|x| sign * x).collect();
            let mut from = q.clone();
            mbs.integrate(&q, &x[..n], &mut from);
            let mut to = v.iter().zip(&x[n..]).map(|(a, b)| a + b).collect::<Vec<_>>();
            for _ in 0..steps {
                (from, to) = c.goes(&from, &to, h);
            }
            let mut d = vec![0.0; n];
            mbs.difference(&at, &from, &mut d);
            d.extend(to.iter().zip(&rate).map(|(a, b)| a - b));
            let d = DMatrix::from_column_slice(2 * n, 1, &d);
            cloud += &d * d.transpose() * 0.5;
        }
    }
    let off = (&cloud - &P).amax() / P.amax();
    println!("the cloud is off by {off:e}");
    assert!(off < 1e-4, "{off}");
}

#[test]
fn what_is_known_exactly_stays_so_and_a_refusal_changes_nothing() {
    let mbs = random_tree(902, shape(4, true));
    let mut c = Case::new(&mbs);
    let (mut q, mut v) = (mbs.random_q(1), mbs.random_v(2));
    let mut P = vec![0.0; 4 * mbs.nv() * mbs.nv()];
    c.step(&mut q, &mut v, &mut P, 0.01);
    assert!(P.iter().all(|x| *x == 0.0));
    // A hinge that moves no mass is rejected.
    let mut b = Builder::new();
    b.body(BodySpec::new("ghost", "world").hinge(Hinge::pin(Vec3::x())));
    let mbs = b.build().unwrap();
    let tree = Tree::new(&mbs);
    let (mut q, mut v, mut P) = (vec![0.5], vec![0.25], vec![1.0, 0.0, 0.0, 1.0]);
    let state = StateEstimate { q: &mut q, v: &mut v, covariance: &mut P };
    let drive = Drive { tau: &[0.0], vdot: &[0.0], density: &[1.0], gravity: GRAVITY, step: 0.1 };
    let told = Prediction::new(&tree).step(&tree, &mut Workspace::new(&tree), state, drive);
    assert!(matches!(told, Err(DynamicsError::Singular { .. })), "{told:?}");
    assert_eq!((q, v, P), (vec![0.5], vec![0.25], vec![1.0, 0.0, 0.0, 1.0]));
}
