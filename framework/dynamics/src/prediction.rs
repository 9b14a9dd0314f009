//! One step of motion with the covariance of its errors, for estimators.
//!
//! ```text
//! midpoint   q½ = q ⊕ ½h β,  β½ = β + ½h a(q, β, τ);   q⁺ = q ⊕ h β½,  β⁺ = β + h a(q½, β½, τ)
//! errors     x = [δq; δβ], δq along β:  x⁺ = F x + noise,   P⁺ = F P Fᵀ + Q
//! noise      τ + w, w white with the densities s:  S = M⁻¹ diag(s) M⁻¹,   Q = [h³/3 S, h²/2 S; h²/2 S, h S]
//! ```
//! F is the exact derivative of the midpoint step, from the analytic derivatives of forward dynamics and of ⊕. The step is of second order in h. Each
//! block of Q is accurate to its lowest order in h, and exact where M is constant. Rows and columns of prescribed coordinates have no noise.

use crate::derivatives::Derivatives;
use crate::error::DynamicsError;
use crate::forward_derivatives::ForwardDerivatives;
use crate::kinematics::{check, kinematics};
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_spatial::Vec3;

/// A state and the covariance of its errors.
#[derive(Debug)]
pub struct StateEstimate<'a> {
    /// Coordinates (nq).
    pub q: &'a mut [f64],
    /// Rates (nv).
    pub v: &'a mut [f64],
    /// Covariance of the errors [δq; δβ], δq along β (2 nv × 2 nv, row after row).
    pub covariance: &'a mut [f64],
}

/// Forces and parameters of a step.
#[derive(Clone, Copy, Debug)]
pub struct Drive<'a> {
    /// Forces at the coordinates (nv), constant over the step.
    pub tau: &'a [f64],
    /// Accelerations of prescribed coordinates (nv); the others are not read.
    pub vdot: &'a [f64],
    /// Spectral densities of white force noise (nv), (N m)² s and N² s; not negative.
    pub density: &'a [f64],
    /// Uniform gravity, m/s².
    pub gravity: Vec3,
    /// Length of the step, s.
    pub step: f64,
}

/// ∂a/∂q, ∂a/∂β and M⁻¹ at one state.
#[derive(Clone, Debug)]
struct Slopes {
    by_q: Vec<f64>,
    by_v: Vec<f64>,
    inverse: Vec<f64>,
}

/// Memory for steps of one tree.
#[derive(Clone, Debug)]
pub struct Prediction {
    derivatives: Derivatives,
    slopes: [Slopes; 2],
    tau: Vec<f64>,
    vdot: Vec<f64>,
    q: Vec<f64>,
    v: Vec<f64>,
    moved: Vec<f64>,
    /// Derivatives of ⊕ at both displacements, with respect to q and to the displacement.
    plus: [[Vec<f64>; 2]; 2],
    /// Blocks of the half step's F without its first column, which consists of the derivative of ⊕ and ½h ∂a/∂q; and blocks of F.
    half: [Vec<f64>; 2],
    F: Vec<f64>,
    FP: Vec<f64>,
    G: Vec<f64>,
}

impl Prediction {
    /// Creates the memory for `tree`; O(nv²) numbers.
    #[must_use]
    pub fn new(tree: &Tree) -> Self {
        let (n, m) = (tree.nv(), tree.nv() * tree.nv());
        let square = || vec![0.0; m];
        let slopes = || Slopes { by_q: square(), by_v: square(), inverse: square() };
        Self {
            derivatives: Derivatives::new(tree),
            slopes: [slopes(), slopes()],
            tau: vec![0.0; n],
            vdot: vec![0.0; n],
            q: vec![0.0; tree.nq()],
            v: vec![0.0; n],
            moved: vec![0.0; n],
            plus: [[square(), square()], [square(), square()]],
            half: [square(), square()],
            F: vec![0.0; 4 * m],
            FP: vec![0.0; 4 * m],
            G: square(),
        }
    }

    /// Advances a state and its covariance by one step. O(nv³). After an error nothing has changed.
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if a free subhinge moves no inertia; [`DynamicsError::Flexible`].
    ///
    /// # Panics
    /// If a length is wrong.
    pub fn step(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        state: StateEstimate<'_>,
        drive: Drive<'_>,
    ) -> Result<(), DynamicsError> {
        let (n, h) = (tree.nv(), drive.step);
        check(state.q.len(), tree.nq(), "q");
        check(state.v.len(), n, "v");
        check(state.covariance.len(), 4 * n * n, "covariance");
        check(drive.tau.len(), n, "tau");
        check(drive.vdot.len(), n, "vdot");
        check(drive.density.len(), n, "density");
        self.q.copy_from_slice(state.q);
        self.v.copy_from_slice(state.v);
        self.accelerate(tree, ws, &drive, 0)?;
        self.displace(tree, state.q, 0.5 * h, 0);
        for ((v, a), start) in self.v.iter_mut().zip(&self.vdot).zip(&*state.v) {
            *v = start + 0.5 * h * a;
        }
        self.accelerate(tree, ws, &drive, 1)?;
        self.displace(tree, state.q, h, 1);
        for (v, a) in state.v.iter_mut().zip(&self.vdot) {
            *v += h * a;
        }
        state.q.copy_from_slice(&self.q);
        self.chain(n, h);
        self.spread(n, h, drive.density, state.covariance);
        Ok(())
    }

    /// Computes the acceleration and its derivatives at the current state, as those of the first or second evaluation.
    fn accelerate(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        drive: &Drive<'_>,
        which: usize,
    ) -> Result<(), DynamicsError> {
        kinematics(tree, ws, &self.q, &self.v);
        ws.clear_forces();
        ws.apply_uniform_gravity(drive.gravity);
        self.tau.copy_from_slice(drive.tau);
        self.vdot.copy_from_slice(drive.vdot);
        let Slopes { by_q, by_v, inverse } = &mut self.slopes[which];
        let out = ForwardDerivatives { dvdot_dq: by_q, dvdot_dv: by_v, dvdot_dtau: inverse };
        let Self { derivatives, v, tau, vdot, .. } = self;
        derivatives.forward_dynamics(tree, ws, v, tau, vdot, out)
    }

    /// Computes the current q = `from` ⊕ h β with the current β, and the derivatives of ⊕.
    fn displace(&mut self, tree: &Tree, from: &[f64], h: f64, which: usize) {
        for (d, v) in self.moved.iter_mut().zip(&self.v) {
            *d = h * v;
        }
        let mechanism = tree.multibody();
        mechanism.integrate(from, &self.moved, &mut self.q);
        let [by_q, by_dv] = &mut self.plus[which];
        mechanism.integrate_derivatives(&self.moved, by_q, by_dv);
    }

    /// Computes F from the derivatives of both evaluations.
    fn chain(&mut self, n: usize, h: f64) {
        let [first, second] = &self.slopes;
        let [[at_q, at_d], [to_q, to_d]] = &self.plus;
        // δq½ = at_q δq + ½h at_d δβ,   δβ½ = ½h A_q δq + (1 + ½h A_v) δβ
        let [half_q, half_v] = &mut self.half;
        for (out, x) in half_q.iter_mut().zip(&first.by_q) {
            *out = 0.5 * h * x;
        }
        for (out, x) in half_v.iter_mut().zip(&first.by_v) {
            *out = 0.5 * h * x;
        }
        (0..n).for_each(|i| half_v[i * n + i] += 1.0);
        self.F.fill(0.0);
        let mut block = |i: usize, j: usize, factor: f64, a: &[f64], b: &[f64]| {
            add_product(n, factor, a, b, &mut self.F[i * 2 * n * n + j * n..]);
        };
        block(0, 0, h, to_d, half_q);
        block(0, 1, h, to_d, half_v);
        block(1, 0, h, &second.by_q, at_q);
        block(1, 0, h, &second.by_v, half_q);
        block(1, 1, 0.5 * h * h, &second.by_q, at_d);
        block(1, 1, h, &second.by_v, half_v);
        for i in 0..n {
            for (out, x) in self.F[2 * i * n..][..n].iter_mut().zip(&to_q[i * n..]) {
                *out += x;
            }
            self.F[2 * n * (n + i) + n + i] += 1.0;
        }
    }

    /// Computes P ← F P Fᵀ + Q, exactly symmetric.
    fn spread(&mut self, n: usize, h: f64, density: &[f64], P: &mut [f64]) {
        let w = 2 * n;
        self.FP.fill(0.0);
        for (out, row) in self.FP.chunks_exact_mut(w).zip(self.F.chunks_exact(w)) {
            for (f, p) in row.iter().zip(P.chunks_exact(w)) {
                for (out, p) in out.iter_mut().zip(p) {
                    *out += f * p;
                }
            }
        }
        for i in 0..w {
            for j in 0..=i {
                let x = dot(&self.FP[i * w..][..w], &self.F[j * w..][..w]);
                (P[i * w + j], P[j * w + i]) = (x, x);
            }
        }
        let inverse = &self.slopes[1].inverse;
        for (out, row) in self.G.chunks_exact_mut(n).zip(inverse.chunks_exact(n)) {
            for ((out, m), s) in out.iter_mut().zip(row).zip(density) {
                *out = m * s.sqrt();
            }
        }
        for i in 0..n {
            for j in 0..n {
                let s = dot(&self.G[i * n..][..n], &self.G[j * n..][..n]);
                P[i * w + j] += h * h * h / 3.0 * s;
                P[i * w + n + j] += h * h / 2.0 * s;
                P[(n + i) * w + j] += h * h / 2.0 * s;
                P[(n + i) * w + n + j] += h * s;
            }
        }
    }

    /// Returns F of the last step (2 nv × 2 nv, row after row), which maps errors before the step to errors after it.
    #[must_use]
    pub fn transition(&self) -> &[f64] {
        &self.F
    }
}

/// Adds factor · a b to a block in rows of 2n numbers, with a and b n × n.
fn add_product(n: usize, factor: f64, a: &[f64], b: &[f64], out: &mut [f64]) {
    for i in 0..n {
        let row = &mut out[2 * n * i..][..n];
        for (x, b) in a[n * i..][..n].iter().zip(b.chunks_exact(n)) {
            let x = factor * x;
            for (out, b) in row.iter_mut().zip(b) {
                *out += x * b;
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
