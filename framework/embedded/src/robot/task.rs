//! Operational space control: forces that give tips the desired accelerations, and null-space forces.
//!
//! ```text
//! Λ = (J M⁻¹ Jᵀ)⁻¹                                        rows of all tips, each [angular; linear], world axes
//! τ = Jᵀ Λ (a − J̇ β) + C + g + Nᵀ τ₀,     Nᵀ = 1 − Jᵀ Λ J M⁻¹
//! impedance: a = a_d + Λ⁻¹ (K e + D (ẋ_d − ẋ)),          e = (log(R_d Rᵀ), p_d − p)
//! ```
//! M, C and g include held objects. Where tips cannot move independently, Λ does not exist and the functions return an error.

use super::{Robot, numbers};
use crate::error::RobotError;
use crate::part::Part;
use linkwork_dynamics::{
    Compliance, apply_inverse_mass, kinematics, node_jacobian_product,
    node_jacobian_transpose_product,
};
use linkwork_multibody::NodeId;
use linkwork_spatial::{Force, Motion, Pose, Vec3};

/// Impedance of a tip: a spring and a damper between the tip and its desired motion. An external force on the tip acts against them and against the
/// tip's own inertia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impedance {
    /// Desired pose of the tip in the world.
    pub pose: Pose,
    /// Desired twist of the tip, world axes, at its origin.
    pub twist: Motion,
    /// Desired acceleration of the tip.
    pub acceleration: Motion,
    /// K along world axes: rotational about x, y, z, N m/rad, then translational along x, y, z, N/m.
    pub stiffness: [f64; 6],
    /// D in the same order, N m s/rad and N s/m.
    pub damping: [f64; 6],
}

impl Impedance {
    /// Creates an impedance at rest at a pose, with one rotational and one translational stiffness, and critical damping D = 2 √(K inertia) for a tip
    /// with the given `inertia` (kg m², kg).
    #[must_use]
    pub fn at(pose: Pose, stiffness: [f64; 2], inertia: [f64; 2]) -> Self {
        let [turn, shift] = [0, 1].map(|k: usize| 2.0 * (stiffness[k] * inertia[k]).sqrt());
        let [a, b] = stiffness;
        Self {
            pose,
            twist: Motion::zero(),
            acceleration: Motion::zero(),
            stiffness: [a, a, a, b, b, b],
            damping: [turn, turn, turn, shift, shift, shift],
        }
    }
}

/// Operational space of some tips of one model, with its memory.
#[derive(Clone, Debug)]
pub struct TaskSpace {
    tips: Vec<NodeId>,
    /// Number of degrees of freedom of the model for which it was created.
    nv: usize,
    compliance: Compliance,
    /// Λ⁻¹, and its Cholesky factor.
    A: Vec<f64>,
    L: Vec<f64>,
    x: Vec<f64>,
    y: Vec<f64>,
    /// Accelerations that the impedances require.
    wanted: Vec<f64>,
}

impl TaskSpace {
    /// Creates the operational space of the tips of chains, in the given order. Allocates memory; later calls do not.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::NotAChain`]; [`RobotError::Length`] for an empty list; [`RobotError::OpensClosure`].
    pub fn new(robot: &Robot, parts: &[Part]) -> Result<Self, RobotError> {
        if parts.is_empty() {
            return Err(RobotError::Length { what: "parts", got: 0, wanted: 1 });
        }
        robot.model.open_tree("operational space")?;
        let mut tips = Vec::with_capacity(parts.len());
        for p in parts {
            tips.push(robot.model.tip(*p)?);
        }
        let compliance = Compliance::new(&robot.tree, &tips);
        let (n, nv) = (compliance.size(), robot.tree.nv());
        let (A, L, x, y) = (vec![0.0; n * n], vec![0.0; n * n], vec![0.0; n], vec![0.0; nv]);
        Ok(Self { tips, nv, compliance, A, L, x, y, wanted: vec![0.0; n] })
    }

    /// Returns the number of rows: six for each tip.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.x.len()
    }

    /// Returns Λ⁻¹ (rows × rows, row after row) at the robot's q: accelerations of the tips for unit wrenches on them.
    ///
    /// # Errors
    /// [`RobotError::Singular`] when a coordinate moves no mass; [`RobotError::ForeignHandle`] for a robot of another size.
    pub fn compliance(&mut self, robot: &mut Robot) -> Result<&[f64], RobotError> {
        if robot.tree.nv() != self.nv {
            return Err(RobotError::ForeignHandle);
        }
        robot.move_all();
        let done = self.compliance.compute(&robot.tree, &mut robot.ws, &mut self.A);
        done.map_err(|_| massless())?;
        Ok(&self.A)
    }

    /// Writes Λ (rows × rows) at the robot's q into `out`.
    ///
    /// # Errors
    /// [`RobotError::Singular`], [`RobotError::Length`], [`RobotError::ForeignHandle`].
    pub fn inertia(&mut self, robot: &mut Robot, out: &mut [f64]) -> Result<(), RobotError> {
        let n = self.rows();
        if out.len() != n * n {
            return Err(RobotError::Length { what: "out", got: out.len(), wanted: n * n });
        }
        self.factor(robot)?;
        for j in 0..n {
            self.x.fill(0.0);
            self.x[j] = 1.0;
            solve(&self.L, &mut self.x);
            for i in 0..n {
                out[i * n + j] = self.x[i];
            }
        }
        Ok(())
    }

    /// Computes forces `tau` (nv) at the robot's q and rates `v` (nv) that give the tips the accelerations `a` (rows; [angular; linear] of each tip's
    /// origin, world axes). The forces `rest` (nv) are added in the null space, where they do not accelerate any tip.
    ///
    /// # Errors
    /// [`RobotError::Singular`] where the tips cannot move independently, [`RobotError::Length`], [`RobotError::NotFinite`],
    /// [`RobotError::ForeignHandle`].
    pub fn forces(
        &mut self,
        robot: &mut Robot,
        v: &[f64],
        a: &[f64],
        rest: Option<&[f64]>,
        tau: &mut [f64],
    ) -> Result<(), RobotError> {
        let nv = self.nv;
        numbers("v", v, nv)?;
        numbers("a", a, self.rows())?;
        if let Some(rest) = rest {
            numbers("rest", rest, nv)?;
        }
        self.factor(robot)?;
        // Compute C + g. The acceleration of a tip at β̇ = 0 is J̇ β.
        robot.forces(Some(v), None, &[], tau)?;
        for (i, tip) in self.tips.iter().enumerate() {
            let bias = six(&robot.ws.node_acceleration(&robot.tree, *tip));
            for k in 0..6 {
                self.x[6 * i + k] = a[6 * i + k] - bias[k];
            }
        }
        if let Some(rest) = rest {
            self.y.copy_from_slice(rest);
            let (tree, ws) = (&robot.tree, &mut robot.ws);
            apply_inverse_mass(tree, ws, &mut self.y).map_err(|_| massless())?;
            for (i, tip) in self.tips.iter().enumerate() {
                let moved = six(&node_jacobian_product(tree, ws, *tip, &self.y));
                for k in 0..6 {
                    self.x[6 * i + k] -= moved[k];
                }
            }
            tau.iter_mut().zip(rest).for_each(|(t, r)| *t += r);
        }
        solve(&self.L, &mut self.x);
        for (i, tip) in self.tips.iter().enumerate() {
            let f = &self.x[6 * i..6 * i + 6];
            let f = Force::new(Vec3::new(f[0], f[1], f[2]), Vec3::new(f[3], f[4], f[5]));
            node_jacobian_transpose_product(&robot.tree, &robot.ws, *tip, &f, &mut robot.room);
            tau.iter_mut().zip(&robot.room).for_each(|(t, x)| *t += x);
        }
        Ok(())
    }

    /// Computes forces `tau` (nv) at the robot's q and rates `v` (nv) that give each tip an impedance (`springs`, one for each tip in the order of
    /// the parts). The forces `rest` (nv) are added in the null space. At rest an external wrench f displaces a tip by K⁻¹ f. Because no force is
    /// measured, the apparent inertia is Λ.
    ///
    /// # Errors
    /// Like [`forces`](Self::forces); [`RobotError::OutOfRange`] for negative stiffness or damping.
    pub fn impedance(
        &mut self,
        robot: &mut Robot,
        v: &[f64],
        springs: &[Impedance],
        rest: Option<&[f64]>,
        tau: &mut [f64],
    ) -> Result<(), RobotError> {
        numbers("v", v, self.nv)?;
        if springs.len() != self.tips.len() {
            let (got, wanted) = (springs.len(), self.tips.len());
            return Err(RobotError::Length { what: "springs", got, wanted });
        }
        for s in springs {
            numbers("position of a spring", s.pose.position.as_slice(), 3)?;
            numbers("attitude of a spring", s.pose.rotation.coords.as_slice(), 4)?;
            for (what, m) in [("twist of a spring", s.twist), ("its acceleration", s.acceleration)]
            {
                numbers(what, m.angular.as_slice(), 3)?;
                numbers(what, m.linear.as_slice(), 3)?;
            }
            for (what, all) in [("stiffness", s.stiffness), ("damping", s.damping)] {
                numbers(what, &all, 6)?;
                if let Some(value) = all.into_iter().find(|x| *x < 0.0) {
                    let help = "zero or above";
                    return Err(RobotError::OutOfRange { what, value, help });
                }
            }
        }
        let n = self.rows();
        self.compliance(robot)?;
        kinematics(&robot.tree, &mut robot.ws, &robot.q, v);
        for (i, (s, tip)) in springs.iter().zip(&self.tips).enumerate() {
            let X = robot.ws.node_pose(&robot.tree, *tip);
            let turn = (s.pose.rotation * X.rotation.inverse()).scaled_axis();
            let e = six(&Motion::new(turn, s.pose.position - X.position));
            let rate = six(&(s.twist - robot.ws.node_velocity(&robot.tree, *tip)));
            let wanted = six(&s.acceleration);
            for k in 0..6 {
                self.x[6 * i + k] = s.stiffness[k] * e[k] + s.damping[k] * rate[k];
                self.wanted[6 * i + k] = wanted[k];
            }
        }
        for i in 0..n {
            let more: f64 = (0..n).map(|j| self.A[i * n + j] * self.x[j]).sum();
            self.wanted[i] += more;
        }
        let wanted = std::mem::take(&mut self.wanted);
        let done = self.forces(robot, v, &wanted, rest, tau);
        self.wanted = wanted;
        done
    }

    fn factor(&mut self, robot: &mut Robot) -> Result<(), RobotError> {
        self.compliance(robot)?;
        let n = self.rows();
        self.L.copy_from_slice(&self.A);
        let help = "the tips cannot move independently in this configuration: leave it, or control fewer tips";
        if cholesky(&mut self.L, n) {
            Ok(())
        } else {
            Err(RobotError::Singular { what: "the inertia of the tips", help })
        }
    }
}

fn massless() -> RobotError {
    let help = "a coordinate moves no mass: give its bodies mass";
    RobotError::Singular { what: "forward dynamics of the mechanism", help }
}

fn six(m: &Motion) -> [f64; 6] {
    let (w, v) = (m.angular, m.linear);
    [w.x, w.y, w.z, v.x, v.y, v.z]
}

/// Computes the Cholesky factor of a symmetric matrix in place; returns false when a pivot is below 1e-12 of its diagonal entry.
fn cholesky(A: &mut [f64], n: usize) -> bool {
    for j in 0..n {
        for i in j..n {
            let dot: f64 = (0..j).map(|k| A[i * n + k] * A[j * n + k]).sum();
            let x = A[i * n + j] - dot;
            if i > j {
                A[i * n + j] = x / A[j * n + j];
            } else if x > 1e-12 * A[j * n + j] {
                A[j * n + j] = x.sqrt();
            } else {
                return false;
            }
        }
    }
    true
}

/// Solves L Lᵀ x = b in place.
fn solve(L: &[f64], b: &mut [f64]) {
    let n = b.len();
    for i in 0..n {
        let dot: f64 = (0..i).map(|k| L[i * n + k] * b[k]).sum();
        b[i] = (b[i] - dot) / L[i * n + i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|k| L[k * n + i] * b[k]).sum();
        b[i] = (b[i] - dot) / L[i * n + i];
    }
}
