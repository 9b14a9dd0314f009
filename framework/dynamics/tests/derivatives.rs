//! Derivatives of inverse and forward dynamics: compared with central differences on random trees with every kind of hinge, identities, far from the
//! origin. (`reference.rs` compares with external values.)

use crate::support::{Rng, Shape, close, random_tree};
use linkwork_dynamics::multibody::Multibody;
use linkwork_dynamics::spatial::nalgebra::DMatrix;
use linkwork_dynamics::spatial::{Force, Vec3};
use linkwork_dynamics::*;

struct Case {
    tree: Tree,
    q: Vec<f64>,
    v: Vec<f64>,
    /// Wrenches fixed in the bodies, at their origins, body axes.
    wrenches: Vec<Force>,
}

fn case(seed: u64, bodies: usize, prescribed: bool) -> Case {
    let shape = Shape {
        bodies,
        floating: seed.is_multiple_of(2),
        prescribed,
        armature: seed.is_multiple_of(3),
    };
    let mbs = random_tree(seed + 500, shape);
    let mut r = Rng(seed);
    let wrenches = mbs.bodies().iter().map(|_| Force::new(r.vec3(), r.vec3())).collect();
    Case { q: mbs.random_q(seed), v: mbs.random_v(seed), tree: Tree::new(&mbs), wrenches }
}

impl Case {
    fn mbs(&self) -> &Multibody {
        self.tree.multibody()
    }
    fn nv(&self) -> usize {
        self.tree.nv()
    }
    fn load(&self, ws: &mut Workspace, q: &[f64], v: &[f64]) {
        kinematics(&self.tree, ws, q, v);
        ws.clear_forces();
        ws.apply_uniform_gravity(Vec3::new(1.0, -2.0, -9.0));
        for (b, f) in self.mbs().body_ids().zip(&self.wrenches) {
            let R = ws.body_rotation(&self.tree, b);
            ws.add_wrench_at_body(&self.tree, b, Force::new(R * f.moment, R * f.force));
        }
    }
    fn inverse(&self, q: &[f64], v: &[f64], vdot: &[f64]) -> Vec<f64> {
        let mut ws = Workspace::new(&self.tree);
        self.load(&mut ws, q, v);
        let mut tau = vec![0.0; self.nv()];
        inverse_dynamics_given_kinematics(&self.tree, &mut ws, vdot, &mut tau);
        tau
    }
    fn forward(&self, q: &[f64], v: &[f64], tau: &[f64], given: &[f64]) -> Vec<f64> {
        let mut ws = Workspace::new(&self.tree);
        self.load(&mut ws, q, v);
        let (mut tau, mut vdot) = (tau.to_vec(), given.to_vec());
        forward_dynamics_given_kinematics(&self.tree, &mut ws, &mut tau, &mut vdot).unwrap();
        vdot
    }
    /// Central differences of `f` along each coordinate, as the columns of a matrix.
    fn along_q(&self, f: impl Fn(&[f64]) -> Vec<f64>) -> DMatrix<f64> {
        let h = 1e-6;
        self.columns(|i, s| {
            let mut dv = vec![0.0; self.nv()];
            dv[i] = s * h;
            let mut q = self.q.clone();
            self.mbs().integrate(&self.q, &dv, &mut q);
            f(&q)
        }) / (2.0 * h)
    }
    fn along_v(&self, f: impl Fn(&[f64]) -> Vec<f64>) -> DMatrix<f64> {
        let h = 1e-6;
        self.columns(|i, s| {
            let mut v = self.v.clone();
            v[i] += s * h;
            f(&v)
        }) / (2.0 * h)
    }
    fn columns(&self, f: impl Fn(usize, f64) -> Vec<f64>) -> DMatrix<f64> {
        let n = self.nv();
        let mut D = DMatrix::zeros(n, n);
        for i in 0..n {
            let (a, b) = (f(i, 1.0), f(i, -1.0));
            for j in 0..n {
                D[(j, i)] = a[j] - b[j];
            }
        }
        D
    }
}

/// Truncation and round-off of central differences at 1e-6; measured 2e-8.
const DIFFERENCE: f64 = 2e-7;

/// Differences relative to the largest entry, or to one where all are small.
#[track_caller]
fn near(a: &DMatrix<f64>, b: &DMatrix<f64>, tol: f64, what: &str) {
    let scale = b.amax().max(1.0);
    // This comparison also fails for NaN.
    let ok = (a - b).iter().all(|x| x.abs() <= tol * scale);
    assert!(ok, "{what}: {:e} of {scale:e}", (a - b).amax());
}

fn rows(n: usize, x: &[f64]) -> DMatrix<f64> {
    DMatrix::from_row_slice(n, n, x)
}

#[test]
fn inverse_dynamics_by_differences() {
    for seed in 0..60 {
        let c = case(seed, 1 + seed as usize % 9, false);
        let n = c.nv();
        let vdot = Rng(seed + 9).vec(n);
        let mut ws = Workspace::new(&c.tree);
        c.load(&mut ws, &c.q, &c.v);
        let (mut dq, mut dv) = (vec![f64::NAN; n * n], vec![f64::NAN; n * n]);
        let mut d = Derivatives::new(&c.tree);
        d.inverse_dynamics(&c.tree, &mut ws, &c.v, &vdot, &mut dq, &mut dv);
        let by_q = c.along_q(|q| c.inverse(q, &c.v, &vdot));
        let by_v = c.along_v(|v| c.inverse(&c.q, v, &vdot));
        near(&rows(n, &dq), &by_q, DIFFERENCE, &format!("seed {seed}, q"));
        near(&rows(n, &dv), &by_v, DIFFERENCE, &format!("seed {seed}, v"));
    }
}

#[test]
fn forward_dynamics_by_differences() {
    for seed in 0..60 {
        let c = case(seed, 1 + seed as usize % 9, seed % 4 == 1);
        let n = c.nv();
        let (tau, given) = (Rng(seed + 9).vec(n), Rng(seed + 10).vec(n));
        let mut ws = Workspace::new(&c.tree);
        c.load(&mut ws, &c.q, &c.v);
        let (mut dq, mut dv, mut dt) = (vec![0.0; n * n], vec![0.0; n * n], vec![0.0; n * n]);
        let (mut found, mut vdot) = (tau.clone(), given.clone());
        let out = ForwardDerivatives { dvdot_dq: &mut dq, dvdot_dv: &mut dv, dvdot_dtau: &mut dt };
        Derivatives::new(&c.tree)
            .forward_dynamics(&c.tree, &mut ws, &c.v, &mut found, &mut vdot, out)
            .unwrap();
        close(&vdot, &c.forward(&c.q, &c.v, &tau, &given), 1e-11, "the acceleration itself");
        // At prescribed coordinates the force is computed, at free ones it is constant.
        let forces = c.inverse(&c.q, &c.v, &vdot);
        close(&found, &forces, 1e-10, &format!("seed {seed}, forces"));
        for (i, _) in c.mbs().prescribed().iter().enumerate().filter(|(_, fixed)| !**fixed) {
            assert_eq!(found[i], tau[i], "seed {seed}");
        }
        let by_q = c.along_q(|q| c.forward(q, &c.v, &tau, &given));
        let by_v = c.along_v(|v| c.forward(&c.q, v, &tau, &given));
        let mut X = vec![0.0; n * n];
        inverse_mass_matrix(&c.tree, &mut ws, &mut X).unwrap();
        let scale = 20.0 * DIFFERENCE; // Light links make large accelerations.
        near(&rows(n, &dq), &by_q, scale, &format!("seed {seed}, q"));
        near(&rows(n, &dv), &by_v, scale, &format!("seed {seed}, v"));
        assert_eq!(dt, X, "seed {seed}: by forces it is the inverse mass matrix");
        let (mut diagonal, own) = (vec![0.0; n], (0..n).map(|i| X[i * n + i]).collect::<Vec<_>>());
        inverse_mass_diagonal(&c.tree, &mut ws, &mut diagonal).unwrap();
        close(&diagonal, &own, 1e-11, &format!("seed {seed}, the diagonal"));
    }
}

#[test]
fn sweeps_and_dense_products_agree() {
    // The mechanisms have more coordinates than the dense product supports.
    for seed in 0..6 {
        let c = case(seed, 25, seed % 3 == 2);
        let n = c.nv();
        assert!(n > 30, "{n} is too few");
        let mut ws = Workspace::new(&c.tree);
        c.load(&mut ws, &c.q, &c.v);
        let (mut dq, mut dv, mut dt) = (vec![0.0; n * n], vec![0.0; n * n], vec![0.0; n * n]);
        let mut d = Derivatives::new(&c.tree);
        let (mut tau, mut vdot) = (Rng(seed).vec(n), Rng(seed + 1).vec(n));
        let out = ForwardDerivatives { dvdot_dq: &mut dq, dvdot_dv: &mut dv, dvdot_dtau: &mut dt };
        d.forward_dynamics(&c.tree, &mut ws, &c.v, &mut tau, &mut vdot, out).unwrap();
        let (mut tq, mut tv) = (vec![0.0; n * n], vec![0.0; n * n]);
        d.inverse_dynamics(&c.tree, &mut ws, &c.v, &vdot, &mut tq, &mut tv);
        let X = rows(n, &dt);
        let (want_q, want_v) = (-&X * rows(n, &tq), -&X * rows(n, &tv));
        // Measured: 1e-13.
        close(rows(n, &dq).as_slice(), want_q.as_slice(), 1e-11, &format!("seed {seed}, q"));
        close(rows(n, &dv).as_slice(), want_v.as_slice(), 1e-11, &format!("seed {seed}, v"));
    }
}

#[test]
fn a_moving_machine_may_be_far_away() {
    let mut c = case(2, 6, false);
    let n = c.nv();
    let vdot = Rng(3).vec(n);
    let mut answers = Vec::new();
    for distance in [0.0, 1.5e11] {
        c.q[0] = distance;
        let mut ws = Workspace::new(&c.tree);
        c.load(&mut ws, &c.q, &c.v);
        let (mut dq, mut dv) = (vec![0.0; n * n], vec![0.0; n * n]);
        let mut d = Derivatives::new(&c.tree);
        d.inverse_dynamics(&c.tree, &mut ws, &c.v, &vdot, &mut dq, &mut dv);
        answers.push((dq, dv));
    }
    assert_eq!(answers[0], answers[1], "bits depend on the distance");
}
