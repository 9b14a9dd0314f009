//! Computes G and γ of each block of rows from the states of the bodies.

use super::closing::{self, End};
use super::joint::Role;
use super::{FullyAugmentedSolver, V6};
use crate::constrained::{Report, Stabilisation, greater};
use linkwork_dynamics::{Tree, Workspace};
use linkwork_multibody::{Anchor, LoopMotion, Multibody};
use linkwork_spatial::Vec3;

impl FullyAugmentedSolver {
    /// Computes the rows of a hinge, and their right side.
    pub(super) fn joint_rows(&mut self, b: usize, k: usize, (tau, vdot): (&[f64], &[f64])) {
        let (j, block) = (&self.joints[k], &mut self.blocks[b]);
        let from = j.parent.map_or(&self.world, |p| &self.states[p]);
        let c = self.states[j.child].c;
        // This is the known part of A_k − φ* A_p; rotors move by applied forces alone.
        let mut known = j.b;
        for ((role, h), i) in j.roles.iter().zip(&j.H).zip(j.v..) {
            match role {
                Role::Plain => {}
                Role::Rotor(inertia) => known += h * ((tau[i] - h.dot(&j.torque)) / inertia),
                Role::Prescribed(_) => known += h * vdot[i],
            }
        }
        for (i, n) in j.N().iter().enumerate() {
            block.ends[0].1[i] = *n;
            if block.ends.len() > 1 {
                block.ends[1].1[i] = -from.gathered(n, &c);
            }
            block.rhs[i] = n.dot(&known);
        }
    }

    /// Computes the rows of a loop.
    pub(super) fn loop_rows(
        &mut self,
        tree: &Tree,
        ws: &Workspace,
        b: usize,
        i: usize,
        motions: &[LoopMotion],
        report: &mut Report,
    ) {
        let l = &tree.multibody().loops()[i];
        let end = |a: &Anchor| {
            let Some(body) = a.body else {
                let (R, zero) = (a.pose.rotation.to_rotation_matrix().into_inner(), Vec3::zeros());
                return End { R, p: a.pose.position, w: zero, v: zero, a: zero };
            };
            let (X, V) = (ws.body_pose(tree, body), ws.body_velocity(tree, body));
            let R = X.rotation.to_rotation_matrix().into_inner();
            let arm = R * a.pose.position;
            let (w, p) = (V.angular, X.position + arm);
            let c = self.of[body.index()].map_or(p, |g| self.states[g].c);
            End {
                R: R * a.pose.rotation.to_rotation_matrix().into_inner(),
                p,
                w,
                v: V.linear + w.cross(&arm),
                a: w.cross(&w.cross(&(p - c))),
            }
        };
        let (A, B) = (end(&l.a), end(&l.b));
        let sides = [(&l.a, -1.0), (&l.b, 1.0)];
        let block = &mut self.blocks[b];
        block.ends.iter_mut().for_each(|e| e.1 = [V6::zeros(); 6]);
        let (damping, stiffness) = constants(self.stabilisation);
        for (k, row) in l.rows.iter().enumerate() {
            let mut row = closing::row(row, &A, &B, motions);
            if let Some(gap) = l.gaps.clone().nth(k).map(|at| &motions[at]) {
                row.error -= gap.position;
                row.rate -= gap.rate;
                row.bias -= gap.acceleration;
            }
            let w = super::bodies::join(&row.n, &row.f);
            for (anchor, sign) in sides {
                let Some(g) = anchor.body.and_then(|b| self.of[b.index()]) else { continue };
                let w = self.states[g].gathered(&w, &B.p) * sign;
                let end = block.ends.iter_mut().find(|e| e.0 == g);
                end.into_iter().for_each(|e| e.1[k] += w);
            }
            block.rhs[k] = -(row.bias + damping * row.rate + stiffness * row.error);
            report.error = greater(report.error, row.error.abs());
            report.rate = greater(report.rate, row.rate.abs());
        }
    }

    /// Computes the row of a coupling.
    pub(super) fn coupling_row(
        &mut self,
        mbs: &Multibody,
        b: usize,
        i: usize,
        (q, v): (&[f64], &[f64]),
        report: &mut Report,
    ) {
        let block = &mut self.blocks[b];
        block.ends.iter_mut().for_each(|e| e.1 = [V6::zeros(); 6]);
        let mut rhs = 0.0;
        let coupling = &mbs.couplings()[i];
        for (term, (k, at)) in self.couplings[i].iter().enumerate() {
            let j = &self.joints[*k];
            let mut unit = [0.0; 6];
            unit[*at] = coupling.factor(term, q);
            // The vector H⁺* e is a wrench that does work only on this coordinate.
            let w = j.all.wrench(&unit);
            rhs += w.dot(&j.b);
            let sides = [
                Some((j.child, w)),
                j.parent.map(|p| (p, -self.states[p].gathered(&w, &self.states[j.child].c))),
            ];
            for (g, w) in sides.into_iter().flatten() {
                let end = block.ends.iter_mut().find(|e| e.0 == g);
                end.into_iter().for_each(|e| e.1[0] += w);
            }
        }
        let (error, rate) = (coupling.error(q), coupling.rate(q, v));
        rhs -= coupling.bias(q, v);
        let (damping, stiffness) = constants(self.stabilisation);
        block.rhs[0] = rhs - damping * rate - stiffness * error;
        report.error = greater(report.error, error.abs());
        report.rate = greater(report.rate, rate.abs());
    }
}

/// Returns 2 ζ ω and ω².
fn constants(s: Stabilisation) -> (f64, f64) {
    match s {
        Stabilisation::None => (0.0, 0.0),
        Stabilisation::Baumgarte { frequency, damping } => {
            (2.0 * damping * frequency, frequency * frequency)
        }
    }
}
