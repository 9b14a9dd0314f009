//! Coordinates and rates of a hinge for a given pose and velocity of its body.
//!
//! Coordinates are computed by Levenberg–Marquardt on the manifold of the hinge, first from the neutral configuration and then from others, for the
//! error of the body's pose in the parent (rotation vector, rad; position, m). Rates are computed by least squares in the same units. They are an
//! initial guess: the impact treats motion that they do not permit.

use super::TopologyError;
use crate::kinematics::kinematics;
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_multibody::{BodyId, BodySpec, Builder, SubhingeKind};
use linkwork_spatial::nalgebra::{DMatrix, DVector, Vector6};
use linkwork_spatial::{MassProperties, Motion, Pose};
use std::f64::consts::PI;

/// Residual at which a hinge counts as reaching a pose: rad and m.
const REACH: f64 = 1e-9;
const STARTS: u64 = 12;
const ITERATIONS: usize = 60;

/// One isolated hinge; its world is the parent body.
pub(super) struct Joint {
    tree: Tree,
    ws: Workspace,
    body: BodyId,
}

impl Joint {
    pub fn new(spec: &BodySpec) -> Result<Self, TopologyError> {
        let mut alone = spec.clone();
        "world".clone_into(&mut alone.parent);
        alone.mass = MassProperties::massless();
        let mut builder = Builder::new();
        builder.body(alone);
        let mbs = builder.build()?;
        let Some(body) = mbs.body(&spec.name) else { unreachable!("just added") };
        let tree = Tree::new(&mbs);
        let ws = Workspace::new(&tree);
        Ok(Self { tree, ws, body })
    }

    pub fn neutral(&self) -> Vec<f64> {
        self.tree.multibody().neutral_q()
    }

    pub fn pose(&self, q: &[f64]) -> Pose {
        self.tree.multibody().body_poses(q)[self.body.index()]
    }

    /// Returns the effect of a unit of each rate on the body: 6 × nv, parent's axes.
    fn jacobian(&mut self, q: &[f64]) -> DMatrix<f64> {
        let nv = self.tree.nv();
        let mut J = DMatrix::zeros(6, nv);
        for j in 0..nv {
            let mut v = vec![0.0; nv];
            v[j] = 1.0;
            kinematics(&self.tree, &mut self.ws, q, &v);
            let V = self.ws.body_velocity(&self.tree, self.body);
            J.column_mut(j).copy_from(&pair(&V));
        }
        J
    }

    fn error(&mut self, q: &[f64], target: &Pose) -> Vector6<f64> {
        let X = self.pose(q);
        let turn = (target.rotation * X.rotation.inverse()).scaled_axis();
        pair(&Motion::new(turn, target.position - X.position))
    }

    /// Computes coordinates for a pose of the body in its parent.
    ///
    /// # Errors
    /// [`TopologyError::Unreachable`] with the smallest error found.
    pub fn solve(&mut self, target: &Pose, name: &str) -> Result<Vec<f64>, TopologyError> {
        let mbs = self.tree.multibody().clone();
        let mut best = (f64::INFINITY, Vector6::zeros());
        for start in 0..=STARTS {
            let mut q = if start == 0 { mbs.neutral_q() } else { mbs.random_q(start) };
            let mut e = self.error(&q, target);
            let mut damping = 1e-6;
            for _ in 0..ITERATIONS {
                if mbs.nv() == 0 || !(e.norm() > 1e-16) {
                    break;
                }
                let J = self.jacobian(&q);
                let mut A = J.transpose() * &J;
                A += DMatrix::identity(mbs.nv(), mbs.nv()) * damping;
                let Some(step) = A.cholesky().map(|c| c.solve(&(J.transpose() * e))) else { break };
                let mut next = q.clone();
                mbs.integrate(&q, step.as_slice(), &mut next);
                let tried = self.error(&next, target);
                if tried.norm() < e.norm() {
                    (q, e) = (next, tried);
                    damping = f64::max(damping * 0.01, 1e-30);
                } else if damping > 1e6 {
                    break;
                } else {
                    damping = f64::max(damping * 10.0, 1e-12);
                }
            }
            if e.norm() <= REACH * (1.0 + target.position.norm()) {
                self.shorten(&mut q);
                return Ok(q);
            }
            if e.norm() < best.0 {
                best = (e.norm(), e);
            }
        }
        let (angle, distance) =
            (best.1.fixed_rows::<3>(0).norm(), best.1.fixed_rows::<3>(3).norm());
        Err(TopologyError::Unreachable { body: name.to_owned(), distance, angle })
    }

    /// Moves angles of pins to within half a revolution.
    fn shorten(&self, q: &mut [f64]) {
        for (_, s) in self.tree.multibody().subhinges() {
            if matches!(s.subhinge.kind, SubhingeKind::Pin { .. }) && q[s.q.start].abs() > PI {
                q[s.q.start] -= 2.0 * PI * (q[s.q.start] / (2.0 * PI)).round();
            }
        }
    }

    /// Computes the rates nearest to a velocity of the body relative to its parent, parent's axes.
    pub fn rates(&mut self, q: &[f64], V: &Motion) -> Vec<f64> {
        if self.tree.nv() == 0 {
            return Vec::new();
        }
        let J = self.jacobian(q);
        let V = DVector::from_column_slice(pair(V).as_slice());
        let found = J.svd(true, true).solve(&V, 1e-12);
        found.map_or_else(|_| vec![0.0; self.tree.nv()], |x| x.as_slice().to_vec())
    }
}

fn pair(V: &Motion) -> Vector6<f64> {
    let (w, v) = (&V.angular, &V.linear);
    Vector6::new(w.x, w.y, w.z, v.x, v.y, v.z)
}
