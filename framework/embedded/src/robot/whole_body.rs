//! Whole-body control: forces of all joints for tasks in order of priority, within effort limits, with contacts that press and do not slip.
//!
//! ```text
//! M v̇ + h = τ + Σ J_cᵀ f_c                    h = C + g, including held objects;  f_c: on the robot
//! f_c = Σ s_e e,  s_e ≥ 0                      e: four edges of the pyramid within the cone of friction about the normal n
//! x = (v̇, s, m):
//! level 1   rows of M v̇ + h − Σ J_cᵀ f_c without an actuator are zero
//! level 2   J_c v̇ = −J̇_c v                     contact points do not accelerate
//! level 3   m = 0                               |τ| ≤ (1 + m) effort,  n·f_c ≤ (1 + m) most
//! then      the tasks: J_k v̇ = a_k − J̇_k v
//! last      min Σ (τ/effort)²
//! ```
//! A level never degrades the levels before it ([`Priorities`]). If the problem is infeasible, the result contains the best motion and forces
//! together with the residuals of levels 1 to 3.

use super::objective::{Objective, Terms};
use super::{Robot, numbers};
use crate::error::RobotError;
use crate::part::Part;
use crate::priorities::Priorities;
use linkwork_dynamics::{mass_matrix, node_jacobian};
use linkwork_spatial::Vec3;

/// A contact point of a tip that presses on a surface and does not slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// The chain whose tip is in contact.
    pub part: Part,
    /// Position of the contact point in the tip's frame, m.
    pub at: Vec3,
    /// Normal of the surface, towards the robot, world axes.
    pub normal: Vec3,
    /// Friction coefficient.
    pub friction: f64,
    /// Largest normal force, N.
    pub most: f64,
}

/// Residuals of a whole-body solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balanced {
    /// Forces that the contacts cannot provide: Euclidean norm of the residual forces at degrees of freedom without an actuator, N m and N. Zero
    /// means balanced.
    pub unbalanced: f64,
    /// Residual acceleration of contact points, m/s². It is not zero if contacts contradict each other.
    pub slipping: f64,
    /// Fraction by which all effort and normal force limits would have to be larger. Zero means that they are sufficient.
    pub shortfall: f64,
}

/// Number of edges of a friction pyramid.
const EDGES: usize = 4;

/// Whole-body controller for one model, with its memory.
#[derive(Clone, Debug)]
pub struct WholeBody {
    nv: usize,
    touches: usize,
    objectives: usize,
    problem: Priorities,
    A: Vec<f64>,
    b: Vec<f64>,
    M: Vec<f64>,
    h: Vec<f64>,
    /// For each contact point: its Jacobian (3 × nv), J̇ v, and its edges.
    J: Vec<f64>,
    bias: Vec<Vec3>,
    edges: Vec<[Vec3; EDGES]>,
    row: Vec<f64>,
}

impl WholeBody {
    /// Creates a controller for up to `touches` contact points and `objectives` tasks. Allocates memory; later calls do not.
    #[must_use]
    pub fn new(robot: &Robot, touches: usize, objectives: usize) -> Self {
        let nv = robot.tree.nv();
        let n = nv + EDGES * touches + 1;
        let rows = (objectives * nv.max(6)).max(nv).max(3 * touches).max(1);
        let bounds = 2 * nv + (EDGES + 1) * touches;
        Self {
            nv,
            touches,
            objectives,
            problem: Priorities::new(n, rows, bounds),
            A: vec![0.0; rows * n],
            b: vec![0.0; rows],
            M: vec![0.0; nv * nv],
            h: vec![0.0; nv],
            J: vec![0.0; 3 * nv * touches],
            bias: vec![Vec3::zeros(); touches],
            edges: vec![[Vec3::zeros(); EDGES]; touches],
            row: vec![0.0; n],
        }
    }

    /// Computes forces `tau` (nv), accelerations `vdot` (nv) and contact forces on the robot (`forces`, world axes, N) at the robot's q and rates `v`
    /// (nv). `effort` (nv) contains limits of forces, N m and N; zero marks a degree of freedom without an actuator. Tasks of the same level are
    /// weighted in a least-squares sense. Each level is a problem in nv + 4 · touches + 1 unknowns.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::NotAChain`]; [`RobotError::Length`]; [`RobotError::NotFinite`]; [`RobotError::NoRoom`];
    /// [`RobotError::OpensClosure`]; [`RobotError::OutOfRange`] for weights, friction and largest forces that are not positive, negative efforts, and
    /// a normal that is not of length 1.
    #[allow(clippy::too_many_arguments)]
    pub fn solve(
        &mut self,
        robot: &mut Robot,
        v: &[f64],
        touches: &[Touch],
        objectives: &[Objective<'_>],
        effort: &[f64],
        (tau, vdot, forces): (&mut [f64], &mut [f64], &mut [Vec3]),
    ) -> Result<Balanced, RobotError> {
        robot.model.open_tree("whole-body control")?;
        self.check(robot, v, touches, objectives, effort)?;
        for (what, got, wanted) in [
            ("tau", tau.len(), self.nv),
            ("vdot", vdot.len(), self.nv),
            ("forces", forces.len(), touches.len()),
        ] {
            if got != wanted {
                return Err(RobotError::Length { what, got, wanted });
            }
        }
        let (nv, n) = (self.nv, self.row.len());
        // Compute C + g. This also computes the accelerations at v̇ = 0, which the tasks need.
        let mut h = std::mem::take(&mut self.h);
        let done = robot.forces(Some(v), None, &[], &mut h);
        self.h = h;
        done?;
        for (k, touch) in touches.iter().enumerate() {
            self.touch(robot, k, touch)?;
        }
        // The mass matrix is computed afterwards because it needs only the poses.
        mass_matrix(&robot.tree, &mut robot.ws, &mut self.M);
        self.problem.begin();
        self.bounds(touches, effort);
        let help = "give finite limits, and contacts at different points";
        let failed = RobotError::Singular { what: "the problem of whole-body forces", help };
        // Level 1 sets the forces of degrees of freedom without an actuator to zero.
        let mut rows = 0;
        for j in (0..nv).filter(|j| effort[*j] == 0.0) {
            self.force_row(j, touches.len());
            self.A[n * rows..n * (rows + 1)].copy_from_slice(&self.row);
            self.b[rows] = -self.h[j];
            rows += 1;
        }
        let met = self.problem.level(&self.A[..n * rows], &self.b[..rows]);
        let unbalanced = met.map_err(|_| failed)?.residual;
        // Level 2 prevents that contact points accelerate.
        self.A[..3 * n * touches.len()].fill(0.0);
        for k in 0..touches.len() {
            for i in 0..3 {
                let row = 3 * k + i;
                self.A[n * row..n * row + nv].copy_from_slice(&self.J[nv * row..nv * (row + 1)]);
                self.b[row] = -self.bias[k][i];
            }
        }
        let rows = 3 * touches.len();
        let met = self.problem.level(&self.A[..n * rows], &self.b[..rows]);
        let slipping = met.map_err(|_| failed)?.residual;
        // Level 3 contains the limits of efforts and normal forces.
        self.row.fill(0.0);
        self.row[n - 1] = 1.0;
        self.problem.level(&self.row, &[0.0]).map_err(|_| failed)?;
        let shortfall = self.problem.x()[n - 1].max(0.0);
        let mut level = Robot::next_level(objectives, None);
        while let Some(at) = level {
            let room = (&mut self.A[..], &mut self.b[..]);
            let rows = robot.level_rows(objectives, at, Terms::Accelerations, n, room)?;
            self.problem.level(&self.A[..n * rows], &self.b[..rows]).map_err(|_| failed)?;
            level = Robot::next_level(objectives, Some(at));
        }
        // The last level minimizes the effort.
        let mut rows = 0;
        for j in (0..nv).filter(|j| effort[*j] > 0.0) {
            self.force_row(j, touches.len());
            let scale = if effort[j].is_finite() { 1.0 / effort[j] } else { 1.0 };
            for (to, x) in self.A[n * rows..].iter_mut().zip(&self.row) {
                *to = scale * x;
            }
            self.b[rows] = -scale * self.h[j];
            rows += 1;
        }
        self.problem.level(&self.A[..n * rows], &self.b[..rows]).map_err(|_| failed)?;
        self.take(touches.len(), effort, (tau, vdot, forces));
        Ok(Balanced { unbalanced, slipping, shortfall })
    }

    fn check(
        &self,
        robot: &Robot,
        v: &[f64],
        touches: &[Touch],
        objectives: &[Objective<'_>],
        effort: &[f64],
    ) -> Result<(), RobotError> {
        if robot.tree.nv() != self.nv {
            return Err(RobotError::ForeignHandle);
        }
        numbers("v", v, self.nv)?;
        robot.check_objectives(objectives, self.objectives)?;
        if touches.len() > self.touches {
            let (wanted, room) = (touches.len(), self.touches);
            return Err(RobotError::NoRoom { what: "touching points", wanted, room });
        }
        if effort.len() != self.nv {
            return Err(RobotError::Length { what: "effort", got: effort.len(), wanted: self.nv });
        }
        // The negated comparison also rejects NaN.
        if let Some(value) = effort.iter().copied().find(|x| !(*x >= 0.0)) {
            let help =
                "limits must not be negative; use zero for no actuator, infinity for no limit";
            return Err(RobotError::OutOfRange { what: "effort", value, help });
        }
        for t in touches {
            robot.model.tip(t.part)?;
            numbers("position of a contact", t.at.as_slice(), 3)?;
            numbers("normal of a contact", t.normal.as_slice(), 3)?;
            let help = "give a unit vector";
            let value = t.normal.norm();
            if !((value - 1.0).abs() < 1e-6) {
                return Err(RobotError::OutOfRange {
                    what: "length of a contact normal",
                    value,
                    help,
                });
            }
            let help = "give a number above zero";
            if !(t.friction > 0.0 && t.friction.is_finite()) {
                let value = t.friction;
                return Err(RobotError::OutOfRange { what: "friction of a contact", value, help });
            }
            if !(t.most > 0.0) {
                let value = t.most;
                return Err(RobotError::OutOfRange {
                    what: "largest force of a contact",
                    value,
                    help,
                });
            }
        }
        Ok(())
    }

    /// Computes the Jacobian of a contact point, its acceleration at v̇ = 0, and its edges.
    fn touch(&mut self, robot: &mut Robot, k: usize, touch: &Touch) -> Result<(), RobotError> {
        let nv = self.nv;
        let tip = robot.model.tip(touch.part)?;
        let arm = robot.ws.node_rotation(&robot.tree, tip) * touch.at;
        node_jacobian(&robot.tree, &robot.ws, tip, &mut robot.jacobian);
        for j in 0..nv {
            let x = |i: usize| robot.jacobian[nv * i + j];
            let moved = Vec3::new(x(3), x(4), x(5)) + Vec3::new(x(0), x(1), x(2)).cross(&arm);
            for i in 0..3 {
                self.J[nv * (3 * k + i) + j] = moved[i];
            }
        }
        let a = robot.ws.node_acceleration(&robot.tree, tip);
        let w = robot.ws.node_velocity(&robot.tree, tip).angular;
        self.bias[k] = a.linear + a.angular.cross(&arm) + w.cross(&w.cross(&arm));
        let n = touch.normal;
        // Any two directions perpendicular to the normal work, because the pyramid lies within the cone.
        let least = n.iamin();
        let mut axis = Vec3::zeros();
        axis[least] = 1.0;
        let x = n.cross(&axis).normalize();
        let y = n.cross(&x);
        self.edges[k] = [x, y, -x, -y].map(|side| n + touch.friction * side);
        Ok(())
    }

    /// Fills a row of M v̇ − Σ J_cᵀ f_c.
    fn force_row(&mut self, j: usize, touches: usize) {
        let nv = self.nv;
        self.row.fill(0.0);
        self.row[..nv].copy_from_slice(&self.M[nv * j..nv * (j + 1)]);
        for k in 0..touches {
            let J = Vec3::from_fn(|i, _| self.J[nv * (3 * k + i) + j]);
            for (e, edge) in self.edges[k].iter().enumerate() {
                self.row[nv + EDGES * k + e] = -J.dot(edge);
            }
        }
    }

    fn bounds(&mut self, touches: &[Touch], effort: &[f64]) {
        let (nv, n) = (self.nv, self.row.len());
        for k in 0..self.touches {
            for e in 0..EDGES {
                self.row.fill(0.0);
                self.row[nv + EDGES * k + e] = -1.0;
                self.problem.bound(&self.row, 0.0);
            }
        }
        for (k, touch) in touches.iter().enumerate() {
            self.row.fill(0.0);
            // Each edge vector has a normal component of 1.
            self.row[nv + EDGES * k..nv + EDGES * (k + 1)].fill(1.0);
            if touch.most.is_finite() {
                self.row[n - 1] = -touch.most;
            }
            self.problem.bound(&self.row, touch.most);
        }
        for j in (0..nv).filter(|j| effort[*j] > 0.0 && effort[*j].is_finite()) {
            for side in [1.0, -1.0] {
                self.force_row(j, touches.len());
                self.row.iter_mut().for_each(|x| *x *= side);
                self.row[n - 1] = -effort[j];
                self.problem.bound(&self.row, effort[j] - side * self.h[j]);
            }
        }
    }

    /// Extracts the result from x.
    fn take(
        &mut self,
        touches: usize,
        effort: &[f64],
        (tau, vdot, forces): (&mut [f64], &mut [f64], &mut [Vec3]),
    ) {
        let nv = self.nv;
        for j in 0..nv {
            self.force_row(j, touches);
            let x = self.problem.x();
            let moved: f64 = self.row.iter().zip(x).map(|(a, b)| a * b).sum();
            tau[j] = if effort[j] == 0.0 { 0.0 } else { moved + self.h[j] };
        }
        let x = self.problem.x();
        vdot.copy_from_slice(&x[..nv]);
        for (k, f) in forces.iter_mut().enumerate() {
            let s = &x[nv + EDGES * k..nv + EDGES * (k + 1)];
            *f = s.iter().zip(&self.edges[k]).map(|(s, e)| e * *s).sum();
        }
    }
}
