//! Projection of the state of a mechanism onto its constraints, and its effect on small changes of the state.
use crate::block::{MechanismBlock, NEVER};
use crate::branch;
use linkwork_runtime::{Failure, Outcome};
use linkwork_solvers::{ConstrainedSolver, NEAR};

impl MechanismBlock {
    /// Projects positions and rates onto the constraints.
    pub(crate) fn close(&mut self, x: &mut [f64]) -> Outcome {
        self.read_motions(x);
        self.at = NEVER;
        let Some(solver) = &mut self.solver else { return Ok(()) };
        let plan = &*self.plan;
        let (nq, nv) = (plan.multibody.nq(), plan.multibody.nv());
        let (q, rest) = x[self.w.x..].split_at_mut(nq);
        let (tree, motions) = (&self.tree, &self.motions[..]);
        self.dv.copy_from_slice(&rest[..nv]);
        self.projector
            .positions(tree, &mut self.ws, solver, motions, q)
            .and_then(|_| {
                self.projector.rates(tree, &mut self.ws, solver, motions, q, &mut rest[..nv])
            })
            .map_err(|e| Failure::of(&e))?;
        // Contact impulses let the rates jump, so a jump does not indicate a change of branch.
        if self.stepper.is_some() {
            return Ok(());
        }
        branch::check(plan, solver.independence(), &self.dv, &rest[..nv])
    }

    /// Removes from a small change of the state the part that [`MechanismBlock::close`] would remove. Only near a loss of rank this part is large enough to matter.
    pub(crate) fn close_change(&mut self, x: &[f64], change: &mut [f64]) -> Outcome {
        let steps = self.stepper.is_some() || self.rolls.is_some();
        // The solver contains the data of the last stage. Every attempt of a step evaluates its stages again, so this
        // does not affect a resumed run.
        let near = |s: &ConstrainedSolver| s.independence() < NEAR;
        if steps || !self.solver.as_ref().is_some_and(near) {
            return Ok(());
        }
        self.read_motions(x);
        self.at = NEVER;
        let Some(solver) = &mut self.solver else { return Ok(()) };
        let (m, at) = (&self.plan.multibody, self.w.x);
        let (nq, nv) = (m.nq(), m.nv());
        let q = &x[at..at + nq];
        let (of_q, rest) = change[at..].split_at_mut(nq);
        let moved = q.iter().zip(&*of_q).map(|(q, d)| q + d);
        self.q.iter_mut().zip(moved).for_each(|(to, q)| *to = q);
        m.difference(q, &self.q, &mut self.dv);
        let (tree, motions) = (&self.tree, &self.motions[..]);
        let mut take =
            |dv: &mut [f64]| self.projector.change(tree, &mut self.ws, solver, motions, q, dv);
        take(&mut self.dv).and_then(|()| take(&mut rest[..nv])).map_err(|e| Failure::of(&e))?;
        m.qdot(q, &self.dv, of_q);
        Ok(())
    }
}
