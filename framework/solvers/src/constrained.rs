//! Forward dynamics with closed loops and couplings: tree-augmented, embedded, or both.
//!
//! ```text
//! gather                                   units of the tree, embedded loops among them
//! W = E E*,  J β̇_f = E e_f + …              rows of the other constraints
//! W λ = −(J β̇_f + J̇ β + 2 ζ ω ḋ + ω² d)     Baumgarte's terms, where asked for
//! y = E* λ, scatter                        accelerations of the whole
//! ```
//! Redundant rows carry zero force. A contradiction between rows is an error.

use crate::shared::Shared;
use crate::skyline::Skyline;
use linkwork_dynamics::units::{ConstraintMethod, Level, RowSet, Units, UnitsWork, WIDTH};
use linkwork_dynamics::{DynamicsError, Tree, Workspace, kinematics};
use linkwork_multibody::{ConstraintId, LoopMotion};
use thiserror::Error;

/// If the [independence](ConstrainedSolver::independence) is below this, branches of motion may cross near a configuration.
pub const NEAR: f64 = 0.1;

/// Method against drift of the rows during integration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Stabilisation {
    /// None: project after each step.
    #[default]
    None,
    /// d̈ + 2 ζ ω ḋ + ω² d = 0 instead of d̈ = 0. Applies to rows, not to embedded loops.
    Baumgarte {
        /// ω, rad/s.
        frequency: f64,
        /// ζ.
        damping: f64,
    },
}

/// Properties of a solution.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Number of rows of augmented constraints.
    pub rows: usize,
    /// Number of independent rows among them.
    pub rank: usize,
    /// Largest |d| over augmented rows, rad or m.
    pub error: f64,
    /// Largest |ḋ| over augmented rows, per second.
    pub rate: f64,
    /// Contradiction between redundant rows and the others, rad/s² or m/s²; round-off if they are consistent.
    pub contradiction: f64,
}

/// Reason why no solution exists.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SolverError {
    /// Error of the tree dynamics.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// Constraints contradict each other at this state.
    #[error(
        "{}: contradict the other constraints of the mechanism by {contradiction:.3e} (rad/s² or \
         m/s²)\n  help: remove a constraint, free a prescribed hinge, or start from a configuration \
         that closes all loops",
        .constraints.join(", ")
    )]
    Contradiction {
        /// The constraints whose rows contradict the others, as ``loop `NAME` ``.
        constraints: Vec<String>,
        /// Size of the contradiction.
        contradiction: f64,
    },
    /// Accelerations are not finite.
    #[error(
        "the accelerations are not finite\n  help: check the state, forces and loop motions given"
    )]
    NotFinite,
}

/// A constraint that is redundant at a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Redundant {
    /// The constraint.
    pub constraint: ConstraintId,
    /// Number of its rows that the others imply.
    pub rows: usize,
    /// Contradiction with the others, as in [`Report::contradiction`].
    pub contradiction: f64,
}

impl Redundant {
    /// Adds one more row that was left out.
    pub(crate) fn add(list: &mut Vec<Self>, constraint: ConstraintId, by: f64) {
        match list.iter_mut().find(|r| r.constraint == constraint) {
            Some(r) => {
                r.rows += 1;
                r.contradiction = greater(r.contradiction, by);
            }
            None => list.push(Self { constraint, rows: 1, contradiction: by }),
        }
    }
}

/// Returns the error if constraints contradict each other by more than the limit.
pub(crate) fn contradicted(
    tree: &Tree,
    redundant: &[Redundant],
    (contradiction, most): (f64, f64),
) -> SolverError {
    if contradiction.is_nan() {
        return SolverError::NotFinite;
    }
    let guilty = redundant.iter().filter(|r| !(r.contradiction <= most));
    let constraints = guilty.map(|r| named(tree, r.constraint)).collect();
    SolverError::Contradiction { constraints, contradiction }
}

/// Returns ``loop `NAME` `` or ``coupling `NAME` ``.
pub(crate) fn named(tree: &Tree, c: ConstraintId) -> String {
    let kind = if matches!(c, ConstraintId::Loop(_)) { "loop" } else { "coupling" };
    format!("{kind} `{}`", tree.multibody().constraint_name(c))
}

/// Solver for one mechanism: structure and workspace. Solving does not allocate.
#[derive(Clone, Debug)]
pub struct ConstrainedSolver {
    units: Units,
    uw: UnitsWork,
    rows: RowSet,
    /// Augmented constraints in elimination order.
    order: Vec<ConstraintId>,
    /// Pairs of groups that share unknowns.
    meets: Vec<(u32, u32)>,
    shared: Shared,
    W: Skyline,
    /// Constraint forces by group.
    lambda: Vec<[f64; WIDTH]>,
    y: Vec<f64>,
    /// λ by constraint in the order of [`Multibody::constraints`](linkwork_multibody::Multibody::constraints).
    forces: Vec<f64>,
    /// Whether the forces of embedded constraints are still to be computed from the accelerations in `v`.
    pending: bool,
    /// Whether members of embedded loops are prescribed, so that their forces are needed immediately.
    prescribed: bool,
    place: Vec<usize>,
    v: Vec<f64>,
    /// Solver with all constraints as rows, for projections where the rank drops. Only if some constraints are embedded.
    near: Option<Box<ConstrainedSolver>>,
    still: Vec<f64>,
    quiet: Vec<LoopMotion>,
    /// Baumgarte's constants.
    pub stabilisation: Stabilisation,
    /// Contradictions above this are errors, rad/s² or m/s².
    pub contradiction_max: f64,
}

impl ConstrainedSolver {
    /// Creates a solver for a tree, with the constraint method `constraint_method` for each constraint.
    #[must_use]
    pub fn new(tree: &Tree, constraint_method: impl Fn(ConstraintId) -> ConstraintMethod) -> Self {
        Self::of(tree, Units::new(tree, constraint_method))
    }

    fn of(tree: &Tree, units: Units) -> Self {
        let mbs = tree.multibody();
        let order = elimination_order(tree, &units);
        let groups = |c: &ConstraintId| match mbs.rows(*c) {
            n if n > WIDTH => vec![3, n - 3],
            n => vec![n],
        };
        let (mut sizes, mut owner) = (Vec::new(), Vec::new());
        for (at, c) in order.iter().enumerate() {
            for n in groups(c) {
                sizes.push(n);
                owner.push(at);
            }
        }
        let meet: Vec<Vec<bool>> = (order.iter())
            .map(|a| order.iter().map(|b| units.meet(tree, *a, *b)).collect())
            .collect();
        let (mut meets, mut envelope) = (Vec::new(), Vec::new());
        for g in 0..owner.len() {
            let mut least = g;
            for h in (0..=g).filter(|h| meet[owner[g]][owner[*h]] || *h == g) {
                meets.push((g as u32, h as u32));
                least = least.min(h);
            }
            envelope.push(least);
        }
        let (mut place, mut rows) = (Vec::new(), 0);
        for c in mbs.constraints() {
            place.push(rows);
            rows += mbs.rows(c);
        }
        let n = envelope.len();
        let near = (!units.embedded().is_empty())
            .then(|| Box::new(Self::of(tree, Units::new(tree, |_| ConstraintMethod::Augment))));
        Self {
            near,
            uw: UnitsWork::new(tree, &units),
            rows: RowSet::default(),
            order,
            shared: Shared::default(),
            meets,
            W: Skyline::new(sizes, envelope),
            lambda: vec![[0.0; WIDTH]; n],
            y: vec![0.0; if n == 0 { 0 } else { units.independent() }],
            forces: vec![0.0; rows],
            place,
            pending: false,
            prescribed: mbs.prescribed().contains(&true),
            v: vec![0.0; tree.nv()],
            still: vec![0.0; tree.nv()],
            quiet: Vec::with_capacity(tree.multibody().motions()),
            units,
            stabilisation: Stabilisation::None,
            contradiction_max: f64::INFINITY,
        }
    }

    /// Returns which constraints are embedded and which are rows.
    #[must_use]
    pub fn units(&self) -> &Units {
        &self.units
    }

    /// Calls [`kinematics`], then [`ConstrainedSolver::forward_given_kinematics`].
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

    /// Computes accelerations from forces at the state (q, β) of the last [`kinematics`], with the external forces and gravity of the workspace.
    /// `tau` and `vdot` are as in [`forward_dynamics_given_kinematics`](linkwork_dynamics::forward_dynamics_given_kinematics()); `motions` are the
    /// motions of prescribed subhinges of loops. The cost is linear in the links, and cubic in the rows that share unknowns.
    ///
    /// # Errors
    /// [`SolverError`].
    pub fn forward_given_kinematics(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        (q, v): (&[f64], &[f64]),
        motions: &[LoopMotion],
        tau: &mut [f64],
        vdot: &mut [f64],
    ) -> Result<Report, SolverError> {
        self.units.gather(tree, ws, &mut self.uw, tau, vdot, motions)?;
        if let Some(mut near) = self.take_embedded_near() {
            let solved = near.forward_given_kinematics(tree, ws, (q, v), motions, tau, vdot);
            self.forces.copy_from_slice(&near.forces);
            self.pending = false;
            self.put_near(near);
            return solved;
        }
        let mut report = Report { contradiction: self.uw.inconsistency(), ..Report::default() };
        if !self.order.is_empty() {
            self.solve_rows(tree, ws, (q, v), motions, &mut report);
        }
        if !(report.contradiction <= self.contradiction_max) {
            let by = (report.contradiction, self.contradiction_max);
            return Err(contradicted(tree, &self.redundant(tree), by));
        }
        self.units.scatter(tree, ws, &mut self.uw, &self.y, tau, vdot);
        let lambda = &self.lambda;
        self.rows.relieve(&self.units, &mut self.uw, |g| lambda[g], tau);
        if !self.units.embedded().is_empty() {
            self.v.copy_from_slice(vdot);
            self.pending = true;
            if self.prescribed {
                self.settle(tree, tau);
            }
        }
        if vdot.iter().all(|x| x.is_finite()) { Ok(report) } else { Err(SolverError::NotFinite) }
    }

    /// Computes the forces of embedded constraints at the last solution, if that was deferred.
    fn settle(&mut self, tree: &Tree, tau: &mut [f64]) {
        if std::mem::take(&mut self.pending) {
            let (place, forces, loops) =
                (&self.place, &mut self.forces, tree.multibody().loops().len());
            self.units.constraint_forces(tree, &mut self.uw, &self.v, tau, |c, lambda| {
                let at = place[index(c, loops)];
                forces[at..at + lambda.len()].copy_from_slice(lambda);
            });
        }
    }

    fn solve_rows(
        &mut self,
        tree: &Tree,
        ws: &Workspace,
        state: (&[f64], &[f64]),
        motions: &[LoopMotion],
        report: &mut Report,
    ) {
        self.rows.clear();
        for c in &self.order {
            self.rows.add_constraint(tree, &self.units, ws, &self.uw, *c, motions, state);
        }
        let (damping, stiffness) = match self.stabilisation {
            Stabilisation::None => (0.0, 0.0),
            Stabilisation::Baumgarte { frequency, damping } => {
                (2.0 * damping * frequency, frequency * frequency)
            }
        };
        for (lambda, row) in self.lambda.iter_mut().zip(self.rows.groups()) {
            *lambda = [0.0; WIDTH];
            for i in 0..row.n {
                let held = damping * row.rate[i] + stiffness * row.error[i];
                lambda[i] = -(row.free[i] + row.bias[i] + held);
                report.error = greater(report.error, row.error[i].abs());
                report.rate = greater(report.rate, row.rate[i].abs());
            }
        }
        report.rows = self.rows.rows();
        self.factor();
        report.contradiction = greater(report.contradiction, self.W.solve(&mut self.lambda));
        report.rank = self.W.rank;
        self.pull();
        let loops = tree.multibody().loops().len();
        let mut groups = self.rows.groups().iter().zip(&self.lambda);
        for c in &self.order {
            let (mut at, n) = (self.place[index(*c, loops)], tree.multibody().rows(*c));
            let end = at + n;
            while at < end {
                let Some((row, lambda)) = groups.next() else { break };
                self.forces[at..at + row.n].copy_from_slice(&lambda[..row.n]);
                at += row.n;
            }
        }
    }

    /// Computes the changes of coordinates or rates that satisfy all constraints to first order, and the largest error before. `step` contains β at
    /// the start, or zeros.
    pub(crate) fn correct(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        motions: &[LoopMotion],
        level: Level,
        q: &[f64],
        step: &mut [f64],
    ) -> Result<f64, SolverError> {
        // The following code overwrites the data from which the forces are computed, so compute them first. No member is prescribed here.
        self.settle(tree, &mut []);
        self.v.copy_from_slice(step);
        step.fill(0.0);
        self.still.fill(0.0);
        let mut worst = 0.0;
        if !self.units.embedded().is_empty() {
            let state = (q, &self.v[..]);
            worst = self.units.close(tree, ws, &mut self.uw, motions, state, level, step);
        }
        if self.order.is_empty() {
            return Ok(worst);
        }
        self.quiet.clear();
        self.quiet.extend_from_slice(motions);
        if level == Level::Position {
            self.quiet.iter_mut().for_each(|m| m.rate = 0.0);
        }
        if worst > 0.0 {
            // Closing the aggregates changes the rates of the other rows, so compute these at the
            // new velocity.
            self.v.iter_mut().zip(&*step).for_each(|(v, d)| *v += d);
            kinematics(tree, ws, q, &self.v);
        }
        let (state, motions) = ((q, &self.v[..]), &self.quiet[..]);
        self.units.gather(tree, ws, &mut self.uw, &self.still, &self.still, motions)?;
        self.rows.clear();
        for c in &self.order {
            self.rows.add_constraint(tree, &self.units, ws, &self.uw, *c, motions, state);
        }
        for (lambda, row) in self.lambda.iter_mut().zip(self.rows.groups()) {
            *lambda = [0.0; WIDTH];
            for (i, to) in lambda.iter_mut().take(row.n).enumerate() {
                let error = if level == Level::Rate { 0.0 } else { row.error[i] };
                *to = -(error + row.rate[i]);
                let before = if level == Level::Rate { row.rate[i] } else { error };
                worst = greater(worst, before.abs());
            }
        }
        self.factor();
        self.W.solve(&mut self.lambda);
        self.pull();
        self.units.impulse(tree, &mut self.uw, &self.y, &mut self.v);
        step.iter_mut().zip(&self.v).for_each(|(s, d)| *s += d);
        Ok(worst)
    }

    /// Computes W from the rows, and its factor.
    fn factor(&mut self) {
        self.shared.update(&self.rows, &self.meets);
        for ((g, h), runs) in self.meets.iter().zip(self.shared.pairs()) {
            self.W.set(*g as usize, *h as usize, self.rows.product(runs));
        }
        let rows = self.rows.groups();
        self.W.factor(|g| rows[g].gross);
    }

    /// Computes y = E* λ.
    fn pull(&mut self) {
        self.y.fill(0.0);
        for (g, lambda) in self.lambda.iter().enumerate() {
            self.rows.pull(g, lambda, &mut self.y);
        }
    }

    /// Returns the forces of a constraint at the last solution, one per row (N or N m). Each acts along its row's wrench on body B and in the
    /// opposite direction on body A; a coupling's force acts on its coordinates with its factors. Redundant rows have zero force; see
    /// [`Report::rank`]. Forces of embedded loops are computed on the first query after a solution.
    #[must_use]
    pub fn forces(&mut self, tree: &Tree, constraint: ConstraintId) -> &[f64] {
        self.settle(tree, &mut []);
        let mbs = tree.multibody();
        let at = self.place[index(constraint, mbs.loops().len())];
        &self.forces[at..at + mbs.rows(constraint)]
    }
}

impl ConstrainedSolver {
    /// Returns the independence of the constraint rows at the last solution or projection: at most 1, and 0 where their rank drops, as in a
    /// parallelogram whose links are in line. Near such a configuration it is about the remaining angle to it (rad).
    #[must_use]
    pub fn independence(&self) -> f64 {
        let rows = if self.order.is_empty() { 1.0 } else { self.W.weakest.sqrt() };
        self.uw.weakest().min(rows)
    }

    /// Takes out the solver that has all constraints as rows, if it exists and the rank nearly drops.
    pub(crate) fn take_near(&mut self) -> Option<Box<Self>> {
        if self.independence() < NEAR { self.near.take() } else { None }
    }

    /// Takes out that solver if the rank of the embedded constraints nearly dropped at the last gather. Dependent coordinates are chosen anew at
    /// every state, which makes the finite differences of stiff methods inexact there. A solution by rows does not have this choice.
    fn take_embedded_near(&mut self) -> Option<Box<Self>> {
        if self.uw.weakest() < NEAR { self.near.take() } else { None }
    }

    /// Puts the solver back.
    pub(crate) fn put_near(&mut self, near: Box<Self>) {
        self.near = Some(near);
    }

    /// Adds the forces of all loops at the last solution to the external forces of the workspace, which must be at the state of that solution. Forces
    /// of couplings are not included, because they act within hinges.
    pub fn add_loop_forces(&mut self, tree: &Tree, ws: &mut Workspace, motions: &[LoopMotion]) {
        self.settle(tree, &mut []);
        let mbs = tree.multibody();
        for i in 0..mbs.loops().len() {
            let (at, n) = (self.place[i], mbs.rows(ConstraintId::Loop(i as u32)));
            let forces = &self.forces[at..at + n];
            self.units.add_loop_forces(ws, &self.uw, i, forces, motions);
        }
    }

    /// Returns the constraints with redundant rows at the last solution, by constraint. Which row of a dependent group counts as redundant is not
    /// unique: for augmented constraints it is the last one in elimination order, for embedded loops one that was not chosen as a pivot. Allocates.
    #[must_use]
    pub fn redundant(&self, tree: &Tree) -> Vec<Redundant> {
        let mut out = Vec::new();
        let mut group = 0;
        for c in &self.order {
            let mut rows = tree.multibody().rows(*c);
            while rows > 0 {
                self.W.left_out(group).for_each(|by| Redundant::add(&mut out, *c, by));
                rows -= self.W.rows(group).max(1);
                group += 1;
            }
        }
        self.units.implied(tree, &self.uw, |c, by| Redundant::add(&mut out, c, by));
        out.sort_by_key(|r| r.constraint);
        out
    }

    /// Calls `f` with d (rad or m) and ḋ of each row of a loop, at the last kinematics. `which` is the index of the loop in
    /// [`Multibody::loops`](linkwork_multibody::Multibody::loops).
    pub fn loop_errors(
        &mut self,
        tree: &Tree,
        ws: &Workspace,
        which: usize,
        motions: &[LoopMotion],
        f: impl FnMut(f64, f64),
    ) {
        self.settle(tree, &mut []);
        self.units.loop_errors(tree, ws, &mut self.uw, which, motions, f);
    }

    /// Returns the largest |d| of a constraint's rows, rad or m, at the last kinematics; `q` belongs to that state.
    #[must_use]
    pub fn error(
        &self,
        tree: &Tree,
        ws: &Workspace,
        constraint: ConstraintId,
        motions: &[LoopMotion],
        q: &[f64],
    ) -> f64 {
        self.units.error(tree, ws, &self.uw, constraint, motions, q)
    }
}

/// Returns the index among all constraints.
pub(crate) fn index(c: ConstraintId, loops: usize) -> usize {
    match c {
        ConstraintId::Loop(i) => i as usize,
        ConstraintId::Coupling(i) => loops + i as usize,
    }
}

/// Returns the larger value; NaN has priority.
pub(crate) fn greater(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

/// Returns an order that keeps neighbours together: breadth first from constraints with few neighbours, then reversed (Cuthill–McKee).
fn elimination_order(tree: &Tree, units: &Units) -> Vec<ConstraintId> {
    let all = units.augmented();
    let n = all.len();
    let meets = |a: usize| (0..n).filter(move |b| *b != a && units.meet(tree, all[a], all[*b]));
    let neighbours: Vec<Vec<usize>> = (0..n).map(|a| meets(a).collect()).collect();
    let (mut seen, mut order) = (vec![false; n], Vec::new());
    while order.len() < n {
        let start = (0..n).filter(|a| !seen[*a]).min_by_key(|a| neighbours[*a].len());
        let Some(start) = start else { break };
        seen[start] = true;
        let mut at = order.len();
        order.push(start);
        while at < order.len() {
            let mut next: Vec<usize> =
                neighbours[order[at]].iter().copied().filter(|b| !seen[*b]).collect();
            next.sort_by_key(|b| (neighbours[*b].len(), *b));
            for b in next {
                seen[b] = true;
                order.push(b);
            }
            at += 1;
        }
    }
    order.into_iter().rev().map(|i| all[i]).collect()
}
