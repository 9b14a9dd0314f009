//! Degrees of freedom that remain under the constraints of a mechanism, and constraints that contradict each other.
//!
//! ```text
//! mobility        free rates of the tree − rank of the rows of all loops and couplings, at the start
//! contradiction   what others make of d̈ + ḋ + d in a row that they imply: more than 1e-6 (1 + Σ |β̇|)
//! ```
//! For this analysis all constraints are rows, whatever their constraint method. The rank is computed at one configuration; at a singular one, such
//! as a stretched linkage, it is smaller than elsewhere.
use crate::plan::MechanismPlan;
use linkwork_dynamics::{Workspace, kinematics};
use linkwork_multibody::{ConstraintId, LoopMotion};
use linkwork_runtime::{Fault, Origin};
use linkwork_solvers::{ConstrainedSolver, ConstraintMethod, Report, SolverError, Stabilisation};

/// Effect of all constraints together at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct RankReport {
    /// Rates of the tree that are not prescribed.
    pub free: usize,
    /// Prescribed rates, of hinges and of loops.
    pub prescribed: usize,
    /// Rows of all loops and couplings.
    pub rows: usize,
    /// Independent ones among them.
    pub rank: usize,
    /// Constraints with redundant rows: name (``loop `NAME` ``), number of redundant rows, number of all its rows. If several constraints repeat each
    /// other, the choice of the named one is not unique.
    pub redundant: Vec<(String, usize, usize)>,
    /// Names of redundant constraints that are satisfied only if the prescribed motions are consistent.
    pub over_prescribed: Vec<String>,
}

impl RankReport {
    /// Degrees of freedom that remain free.
    #[must_use]
    pub fn mobility(&self) -> usize {
        self.free.saturating_sub(self.rank)
    }
}

/// Residual, relative to the accelerations, above which rows contradict each other.
const SOUND: f64 = 1e-6;

struct Rows {
    solver: ConstrainedSolver,
    ws: Workspace,
    /// Accelerations: inputs for prescribed rates, outputs for all.
    vdot: Vec<f64>,
}

impl Rows {
    fn of(plan: &MechanismPlan, stabilisation: Stabilisation) -> Rows {
        let mut solver = ConstrainedSolver::new(&plan.tree, |_| ConstraintMethod::Augment);
        solver.stabilisation = stabilisation;
        Rows { solver, ws: Workspace::new(&plan.tree), vdot: vec![0.0; plan.v.len()] }
    }

    fn solve(
        &mut self,
        plan: &MechanismPlan,
        v: &[f64],
        motions: &[LoopMotion],
    ) -> Result<Report, SolverError> {
        kinematics(&plan.tree, &mut self.ws, &plan.q, v);
        let (mut tau, state) = (vec![0.0; v.len()], (&plan.q[..], v));
        let Rows { solver, ws, vdot } = self;
        solver.forward_given_kinematics(&plan.tree, ws, state, motions, &mut tau, vdot)
    }

    /// Returns the names of constraints whose redundant rows contradict the rows that they repeat.
    fn contradicting(&self, plan: &MechanismPlan) -> Vec<ConstraintId> {
        let most = self.vdot.iter().fold(1.0, |m, a| m + a.abs());
        let bad = |by: f64| !(by <= SOUND * most);
        let all = self.solver.redundant(&plan.tree);
        all.iter().filter(|r| bad(r.contradiction)).map(|r| r.constraint).collect()
    }
}

/// ``loop `NAME` `` or ``coupling `NAME` ``.
fn named(plan: &MechanismPlan, c: ConstraintId) -> String {
    let kind = if matches!(c, ConstraintId::Loop(_)) { "loop" } else { "coupling" };
    format!("{kind} `{}`", plan.multibody.constraint_name(c))
}

impl MechanismPlan {
    /// Returns rank and mobility at the start; `None` without constraints or if the tree itself is singular.
    /// Cubic in the rows.
    #[must_use]
    pub fn rank(&self) -> Option<RankReport> {
        let m = &self.multibody;
        m.constraints().next()?;
        let mut rows = Rows::of(self, Stabilisation::None);
        let still = vec![0.0; self.v.len()];
        // Use unrelated prescribed motions, so that contradictions do not cancel by chance.
        let odd = |k: usize| 1.0 + (k as f64 * 0.618_033_988_749_895).fract();
        let given = m.prescribed();
        for (k, a) in rows.vdot.iter_mut().enumerate().filter(|(k, _)| given[*k]) {
            *a = odd(k);
        }
        // A gap at the start keeps its size: rows that repeat other rows have the same gap.
        let gap = |k: &usize| self.gaps.iter().any(|g| g.motions.contains(k));
        let motion = |(k, l): (usize, &LoopMotion)| LoopMotion {
            rate: 0.0,
            acceleration: if gap(&k) { 0.0 } else { odd(k + given.len()) },
            ..*l
        };
        let motions: Vec<LoopMotion> = self.loop_motions.iter().enumerate().map(motion).collect();
        let report = rows.solve(self, &still, &motions).ok()?;
        let redundant = rows.solver.redundant(&self.tree);
        let prescribed = given.iter().filter(|p| **p).count();
        Some(RankReport {
            free: given.len() - prescribed,
            prescribed: prescribed + (0..motions.len()).filter(|k| !gap(k)).count(),
            rows: report.rows,
            rank: report.rank,
            redundant: (redundant.iter())
                .map(|r| (named(self, r.constraint), r.rows, m.rows(r.constraint)))
                .collect(),
            over_prescribed: rows.contradicting(self).iter().map(|c| named(self, *c)).collect(),
        })
    }

    /// Returns a fault, at the first of them, for constraints that contradict each other at the start.
    pub(crate) fn contradiction(&self) -> Option<Fault> {
        self.multibody.constraints().next()?;
        let by_all = Stabilisation::Baumgarte { frequency: 1.0, damping: 0.5 };
        let mut rows = Rows::of(self, by_all);
        // Ignore gaps, because they have no meaning at the start of a later phase: the phase begins at another
        // configuration.
        let mut motions = self.loop_motions.clone();
        for k in self.gaps.iter().flat_map(|g| g.motions.clone()) {
            motions[k].acceleration = 0.0;
        }
        let guilty = match rows.solve(self, &self.v, &motions) {
            Err(SolverError::Dynamics(_)) => return None,
            _ => rows.contradicting(self),
        };
        let first = guilty.first()?;
        let names: Vec<String> = guilty.iter().map(|c| named(self, *c)).collect();
        let verb = if names.len() == 1 { "contradicts" } else { "contradict" };
        let help = match self.multibody.motions() > 0 || self.multibody.prescribed().contains(&true)
        {
            true => {
                "remove a constraint, free a prescribed hinge, or start prescribed hinges with compatible rates"
            }
            false => {
                "remove a constraint, or give the constraints compatible lengths and constants"
            }
        };
        let origin = self.origin_of(self.multibody.constraint_name(*first));
        let fact = format!("{}: {verb} the other constraints of the mechanism", names.join(", "));
        Some(Fault { origin, ..Fault::new(Origin::NONE, fact).help(help) })
    }
}
