//! Fully augmented dynamics: every body is free, and every hinge is a constraint.
//!
//! ```text
//! A = [ω̇; c̈] of each body, θ̈_a of each rotor                  unknowns
//! M A + b = f_ext + G* λ + torques,   G A = γ                    hinges, loops, couplings
//! G M⁻¹ G* λ = γ − G M⁻¹ (f_ext + torques − b)                   sparse L D Lᵀ
//! hinge      rows N* (A_k − φ* A_p − H_a θ̈_a) = N* (H_p θ̈_p + b)
//! loop       rows of its hinge between the two bodies
//! coupling   Σ c θ̈ = 0 with θ̈ = H⁺ (A_k − φ* A_p − b)
//! torque τ   the wrench w with H* w = τ on the body, −φ w on its parent
//! rotor      I_a θ̈_a = τ_a − H_a* (w + N λ)                     a coordinate of its own
//! ```
//! Hinges are eliminated from tips to base, which does not create fill in a tree. Loops and couplings come last, so that a row left out as dependent
//! belongs to one of them. This solver shares no code with the tree recursions, so it serves for comparison, as a check, and as a fallback. Every
//! group of welded bodies needs mass and inertia about all axes, because otherwise G M⁻¹ G* does not exist. Bodies must be rigid.

mod bodies;
mod closing;
mod joint;
mod rows;
mod sparse;

use crate::constrained::{Redundant, Report, SolverError, Stabilisation, contradicted, greater};
use bodies::{Group, State};
use joint::{Joint, Role};
use linkwork_dynamics::{DynamicsError, Tree, Workspace, kinematics};
use linkwork_multibody::{BodyId, ConstraintId, LoopMotion, Multibody};
use linkwork_spatial::Motion;
use linkwork_spatial::nalgebra::{Matrix6, Vector6};
use sparse::Sparse;
use thiserror::Error;

type V6 = Vector6<f64>;

/// Reason why a mechanism does not have a fully augmented form.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FullyAugmentedError {
    /// A moving body lacks mass, or inertia about some axis.
    #[error(
        "body `{body}` with the bodies welded to it lacks mass, or inertia about some axis: the fully \
         augmented form divides by it\n  help: give it mass properties of a solid, or use ConstrainedSolver"
    )]
    Inertia {
        /// The body.
        body: String,
    },
    /// A flexible body.
    #[error(
        "body `{body}` is flexible; the fully augmented form is for rigid bodies\n  help: use \
         ConstrainedSolver"
    )]
    Flexible {
        /// The body.
        body: String,
    },
}

/// A block of rows: of a hinge or of a constraint.
#[derive(Clone, Debug)]
struct Block {
    rows: usize,
    of: Owner,
    /// Groups on which it acts, and G for each: a row's wrench about the centre of mass.
    ends: Vec<(usize, [V6; 6])>,
    /// γ.
    rhs: V6,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Owner {
    Joint(usize),
    Constraint(ConstraintId),
}

/// The fully augmented solver of one mechanism. Solving does not allocate.
#[derive(Clone, Debug)]
pub struct FullyAugmentedSolver {
    groups: Vec<Group>,
    of: Vec<Option<usize>>,
    joints: Vec<Joint>,
    /// Terms of couplings: index of the joint, index within it.
    couplings: Vec<Vec<(usize, usize)>>,
    blocks: Vec<Block>,
    /// Pairs of blocks that share groups, with their ends there.
    meets: Vec<(usize, usize, usize, usize)>,
    S: Sparse,
    states: Vec<State>,
    world: State,
    /// Accelerations of groups, and accelerations due to applied forces alone.
    A: Vec<V6>,
    /// λ, and its change in a pass.
    total: Vec<V6>,
    lambda: Vec<V6>,
    /// λ by constraint, and its first index.
    forces: Vec<f64>,
    place: Vec<usize>,
    /// Residual of rows left out, by constraint.
    contradictions: Vec<f64>,
    dropped: Vec<usize>,
    /// Baumgarte's constants.
    pub stabilisation: Stabilisation,
    /// Contradictions above this are errors, rad/s² or m/s².
    pub contradiction_max: f64,
}

impl FullyAugmentedSolver {
    /// Creates a solver for a tree: structure, elimination order and workspace.
    ///
    /// # Errors
    /// [`FullyAugmentedError`] for unsupported bodies.
    pub fn new(tree: &Tree) -> Result<Self, FullyAugmentedError> {
        let mbs = tree.multibody();
        let (groups, of) = bodies::groups(mbs)?;
        let mut joints: Vec<Joint> = (groups.iter().enumerate())
            .map(|(child, g)| {
                let body = mbs.get(g.lead);
                let parent = body.parent().and_then(|p| of[p.index()]);
                Joint::new(body, g.lead.index(), child, parent)
            })
            .collect();
        // Groups are in the order of bodies, and each has one joint.
        let term = |(_, v, _): &(usize, usize, f64)| {
            let k = joints.partition_point(|j| j.v + j.roles.len() <= *v);
            (k, *v - joints[k].v)
        };
        let couplings: Vec<Vec<(usize, usize)>> =
            mbs.couplings().iter().map(|c| c.terms.iter().map(term).collect()).collect();
        for (k, ..) in couplings.iter().flatten() {
            joints[*k].coupled = true;
        }
        let blocks = blocks(mbs, &of, &joints, &couplings);
        let mut meets = Vec::new();
        for i in 0..blocks.len() {
            for j in 0..=i {
                for (a, (g, _)) in blocks[i].ends.iter().enumerate() {
                    let b = blocks[j].ends.iter().position(|(h, _)| h == g);
                    meets.extend(b.map(|b| (i, j, a, b)));
                }
            }
        }
        let pairs: Vec<(usize, usize)> =
            meets.iter().filter(|m| m.0 != m.1).map(|m| (m.0, m.1)).collect();
        let (mut place, mut rows) = (Vec::new(), 0);
        for c in mbs.constraints() {
            place.push(rows);
            rows += mbs.rows(c);
        }
        Ok(Self {
            S: Sparse::new(blocks.iter().map(|b| b.rows).collect(), &pairs),
            states: vec![State::default(); groups.len()],
            world: State::default(),
            A: vec![V6::zeros(); groups.len()],
            total: vec![V6::zeros(); blocks.len()],
            lambda: vec![V6::zeros(); blocks.len()],
            forces: vec![0.0; rows],
            contradictions: vec![0.0; place.len()],
            dropped: vec![0; place.len()],
            place,
            groups,
            of,
            joints,
            couplings,
            blocks,
            meets,
            stabilisation: Stabilisation::None,
            contradiction_max: f64::INFINITY,
        })
    }

    /// Calls [`kinematics`], then [`FullyAugmentedSolver::forward_given_kinematics`].
    ///
    /// # Errors
    /// [`SolverError`].
    pub fn forward(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        (q, v): (&[f64], &[f64]),
        motions: &[LoopMotion],
        tau: &mut [f64],
        vdot: &mut [f64],
    ) -> Result<Report, SolverError> {
        kinematics(tree, ws, q, v);
        self.forward_given_kinematics(tree, ws, (q, v), motions, tau, vdot)
    }

    /// Computes accelerations and forces as [`ConstrainedSolver::forward_given_kinematics`](crate::ConstrainedSolver::forward_given_kinematics) does.
    /// Rows and rank of the report include hinges. The workspace is only read; [`FullyAugmentedSolver::acceleration`] returns the accelerations of
    /// bodies.
    ///
    /// # Errors
    /// [`SolverError`].
    pub fn forward_given_kinematics(
        &mut self,
        tree: &Tree,
        ws: &Workspace,
        (q, v): (&[f64], &[f64]),
        motions: &[LoopMotion],
        tau: &mut [f64],
        vdot: &mut [f64],
    ) -> Result<Report, SolverError> {
        let mbs = tree.multibody();
        for (state, g) in self.states.iter_mut().zip(&self.groups) {
            *state = g.state(tree, ws);
        }
        self.place_joints(tree, ws, (q, v), tau)?;
        let mut report = Report::default();
        for b in 0..self.blocks.len() {
            match self.blocks[b].of {
                Owner::Joint(k) => self.joint_rows(b, k, (&*tau, &*vdot)),
                Owner::Constraint(ConstraintId::Loop(i)) => {
                    self.loop_rows(tree, ws, b, i as usize, motions, &mut report);
                }
                Owner::Constraint(ConstraintId::Coupling(i)) => {
                    self.coupling_row(mbs, b, i as usize, (q, v), &mut report);
                }
            }
        }
        self.solve(mbs, &mut report);
        self.answer(tau, vdot);
        if !vdot.iter().chain(&*tau).all(|x| x.is_finite()) {
            return Err(SolverError::NotFinite);
        }
        if !(report.contradiction <= self.contradiction_max) {
            let by = (report.contradiction, self.contradiction_max);
            return Err(contradicted(tree, &self.redundant(tree), by));
        }
        Ok(report)
    }

    /// Returns the forces of a constraint at the last solution, as [`ConstrainedSolver::forces`](crate::ConstrainedSolver::forces) does.
    #[must_use]
    pub fn forces(&self, tree: &Tree, constraint: ConstraintId) -> &[f64] {
        let mbs = tree.multibody();
        let at = self.place[index(constraint, mbs)];
        &self.forces[at..at + mbs.rows(constraint)]
    }

    /// Returns the acceleration of a body at the last solution: angular (rad/s²), and of the centre of mass of the body or of its group of welded
    /// bodies (m/s²); world axes. Zero for bodies welded to the world.
    #[must_use]
    pub fn acceleration(&self, body: BodyId) -> Motion {
        let A = self.of[body.index()].map_or_else(V6::zeros, |g| self.A[g]);
        let (n, f) = bodies::halves(&A);
        Motion::new(n, f)
    }

    /// Returns the constraints with rows left out at the last solution, as [`ConstrainedSolver::redundant`](crate::ConstrainedSolver::redundant)
    /// does. Allocates.
    #[must_use]
    pub fn redundant(&self, tree: &Tree) -> Vec<Redundant> {
        let each =
            tree.multibody().constraints().zip(self.dropped.iter().zip(&self.contradictions));
        each.filter(|(_, (rows, _))| **rows > 0)
            .map(|(constraint, (rows, by))| Redundant {
                constraint,
                rows: *rows,
                contradiction: *by,
            })
            .collect()
    }

    /// Returns the number of nonzero blocks of S = G M⁻¹ G* below its diagonal, and of its factor. They are equal for trees.
    #[must_use]
    pub fn fill(&self) -> (usize, usize) {
        let mut pairs: Vec<_> = self.meets.iter().map(|m| (m.0, m.1)).collect();
        pairs.retain(|(i, j)| i != j);
        pairs.dedup();
        (pairs.len(), self.S.blocks())
    }

    fn place_joints(
        &mut self,
        tree: &Tree,
        ws: &Workspace,
        state: (&[f64], &[f64]),
        tau: &[f64],
    ) -> Result<(), SolverError> {
        let mbs = tree.multibody();
        for (A, s) in self.A.iter_mut().zip(&self.states) {
            *A = s.free;
        }
        for j in &mut self.joints {
            let body = &mbs.bodies()[j.body];
            let to = &self.states[j.child];
            let from = j.parent.map_or(&self.world, |p| &self.states[p]);
            let parent = body.parent().map_or_else(Default::default, |p| ws.body_pose(tree, p));
            if !j.place(body, &parent, (from, to), state) {
                let body = body.name().to_owned();
                return Err(DynamicsError::Singular { body, v: j.v }.into());
            }
            let mut given = [0.0; 6];
            let plain = j.roles.iter().zip(&tau[j.v..]).filter(|(r, _)| **r == Role::Plain);
            given.iter_mut().zip(plain).for_each(|(g, (_, tau))| *g = *tau);
            j.torque = j.plain.wrench(&given);
            self.A[j.child] += to.accelerate(&j.torque);
            if let Some(p) = j.parent {
                self.A[p] -= from.accelerate(&from.gathered(&j.torque, &to.c));
            }
        }
        Ok(())
    }

    /// Solves for λ, then computes A from it.
    fn solve(&mut self, mbs: &Multibody, report: &mut Report) {
        self.S.clear();
        for (i, j, a, b) in &self.meets {
            let (g, Gi) = &self.blocks[*i].ends[*a];
            let (_, Gj) = &self.blocks[*j].ends[*b];
            let state = &self.states[*g];
            let to = self.S.block(*i, *j);
            for c in 0..self.blocks[*j].rows {
                let MG = state.accelerate(&Gj[c]);
                for r in 0..self.blocks[*i].rows {
                    to[(r, c)] += Gi[r].dot(&MG);
                }
            }
        }
        for (b, block) in self.blocks.iter().enumerate() {
            report.rows += block.rows;
            self.total[b] = V6::zeros();
            if let Owner::Joint(k) = block.of {
                add_rotors(&self.joints[k], self.S.block(b, b));
            }
        }
        self.S.factor();
        report.rank = self.S.rank;
        // The second pass removes the round-off of the first.
        for _ in 0..2 {
            self.pass(mbs, report);
        }
        for (block, lambda) in self.blocks.iter().zip(&self.total) {
            if let Owner::Constraint(c) = block.of {
                let at = self.place[index(c, mbs)];
                self.forces[at..at + block.rows].copy_from_slice(&lambda.as_slice()[..block.rows]);
            }
        }
    }

    /// Computes λ += S⁻¹ (γ − G A), A += M⁻¹ G* Δλ.
    fn pass(&mut self, mbs: &Multibody, report: &mut Report) {
        for (b, block) in self.blocks.iter().enumerate() {
            let mut left = block.rhs;
            for (g, G) in &block.ends {
                for r in 0..block.rows {
                    left[r] -= G[r].dot(&self.A[*g]);
                }
            }
            if let Owner::Joint(k) = block.of {
                left -= rotors_moved(&self.joints[k], &self.total[b]);
            }
            self.lambda[b] = left;
        }
        self.contradictions.fill(0.0);
        self.dropped.fill(0);
        report.contradiction = 0.0;
        let (blocks, by, count) = (&self.blocks, &mut self.contradictions, &mut self.dropped);
        self.S.solve(&mut self.lambda, |b, lack| {
            report.contradiction = greater(report.contradiction, lack);
            if let Owner::Constraint(c) = blocks[b].of {
                by[index(c, mbs)] = greater(by[index(c, mbs)], lack);
                count[index(c, mbs)] += 1;
            }
        });
        for ((block, lambda), total) in self.blocks.iter().zip(&self.lambda).zip(&mut self.total) {
            *total += lambda;
            for (g, G) in &block.ends {
                let w = (0..block.rows).fold(V6::zeros(), |w, r| w + G[r] * lambda[r]);
                self.A[*g] += self.states[*g].accelerate(&w);
            }
        }
    }

    /// Computes the accelerations of coordinates, and the forces of prescribed ones.
    fn answer(&mut self, tau: &mut [f64], vdot: &mut [f64]) {
        for (b, lambda) in self.blocks.iter().zip(&self.total) {
            if let Owner::Joint(k) = b.of {
                let j = &mut self.joints[k];
                let w = j.N().iter().zip(lambda.iter()).fold(V6::zeros(), |w, (n, l)| w + n * *l);
                j.torque += w;
            }
        }
        for j in &self.joints {
            let c = self.states[j.child].c;
            let from = j.parent.map_or_else(V6::zeros, |p| self.states[p].carried(&self.A[p], &c));
            let mut rest = self.A[j.child] - from - j.b;
            for ((role, h), i) in j.roles.iter().zip(&j.H).zip(j.v..) {
                match role {
                    Role::Plain => continue,
                    Role::Rotor(inertia) => vdot[i] = (tau[i] - h.dot(&j.torque)) / inertia,
                    Role::Prescribed(inertia) => tau[i] = h.dot(&j.torque) + inertia * vdot[i],
                }
                rest -= h * vdot[i];
            }
            let x = j.plain.coordinates(&rest);
            let plain = j.roles.iter().zip(j.v..).filter(|(r, _)| **r == Role::Plain);
            plain.zip(x).for_each(|((_, i), x)| vdot[i] = x);
        }
    }
}

/// Computes N* H_a I_a⁻¹ H_a* N λ.
fn rotors_moved(j: &Joint, lambda: &V6) -> V6 {
    let w = j.N().iter().zip(lambda.iter()).fold(V6::zeros(), |w, (n, l)| w + n * *l);
    let mut out = V6::zeros();
    for (role, h) in j.roles.iter().zip(&j.H) {
        let Role::Rotor(inertia) = role else { continue };
        for (out, n) in out.iter_mut().zip(j.N()) {
            *out += n.dot(h) * h.dot(&w) / inertia;
        }
    }
    out
}

/// Adds N* H_a I_a⁻¹ H_a* N.
fn add_rotors(j: &Joint, S: &mut Matrix6<f64>) {
    for (role, h) in j.roles.iter().zip(&j.H) {
        let Role::Rotor(inertia) = role else { continue };
        for (r, a) in j.N().iter().enumerate() {
            for (c, b) in j.N().iter().enumerate() {
                S[(r, c)] += a.dot(h) * b.dot(h) / inertia;
            }
        }
    }
}

/// Returns the blocks: hinges from tips to base, then loops, then couplings.
fn blocks(
    mbs: &Multibody,
    of: &[Option<usize>],
    joints: &[Joint],
    couplings: &[Vec<(usize, usize)>],
) -> Vec<Block> {
    let block = |rows: usize, of: Owner, groups: Vec<usize>| {
        let mut ends: Vec<(usize, [V6; 6])> = Vec::new();
        for g in groups {
            if ends.iter().all(|e| e.0 != g) {
                ends.push((g, [V6::zeros(); 6]));
            }
        }
        Block { rows, of, ends, rhs: V6::zeros() }
    };
    let mut out = Vec::new();
    for (k, j) in joints.iter().enumerate().rev().filter(|(_, j)| j.rows() > 0) {
        let groups = [j.child].into_iter().chain(j.parent).collect();
        out.push(block(j.rows(), Owner::Joint(k), groups));
    }
    for c in mbs.constraints() {
        let groups = match c {
            ConstraintId::Loop(i) => {
                let l = &mbs.loops()[i as usize];
                [&l.a, &l.b].into_iter().filter_map(|a| of[a.body?.index()]).collect()
            }
            ConstraintId::Coupling(i) => {
                let joints = couplings[i as usize].iter().map(|t| &joints[t.0]);
                joints.flat_map(|j| [j.child].into_iter().chain(j.parent)).collect()
            }
        };
        out.push(block(mbs.rows(c), Owner::Constraint(c), groups));
    }
    out
}

/// Returns the index among all constraints.
fn index(c: ConstraintId, mbs: &Multibody) -> usize {
    match c {
        ConstraintId::Loop(i) => i as usize,
        ConstraintId::Coupling(i) => mbs.loops().len() + i as usize,
    }
}
