//! Accounts of the mechanism in the balance of energy.
//!
//! ```text
//! d/dt (T + V + E) = Σ work of parts + P_hinges + P_field + P_surface + P_given
//! T          ½ βᵀ M β                V    −m g · c in uniform gravity
//! E          springs of hinges: ½ k (q − q₀)², of balls ½ k θ²
//! P_hinges   damping, friction and stops of hinges: τ β
//! P_field    gravity that depends on place and smooth contact: f · v of all external forces, less the wrenches of parts and P_surface
//! P_surface  surfaces that move over their bodies, smooth contact: friction times their velocity
//! P_given    prescribed hinges: the torque that their motion takes, times their rate
//! ```
//! The energies of contact impulses, variable masses, prescribed gaps of loops and machines that move by kinematics are not included; they appear in
//! the residual.
use crate::block::{MechanismBlock, NEVER};
use crate::frame::Frame;
use crate::plan::MechanismPlan;
use linkwork_dynamics::{center_of_mass, kinetic_energy};
use linkwork_runtime::EvalTime;
use linkwork_runtime::balance::{Account, OwnAccount, OwnAccounts, Quantity};
use linkwork_spatial::Vec3;

/// Names of the accounts, in the order of their numbers.
pub(crate) fn of(plan: &MechanismPlan) -> OwnAccounts {
    let account = |name, account| OwnAccount { name, account, quantity: Quantity::Energy };
    let known = vec![
        account("kinetic energy", Account::Stored),
        account("potential energy", Account::Stored),
        account("springs of hinges", Account::Stored),
        account("friction and stops of hinges", Account::Gained),
        account("non-uniform gravity and compliant contact", Account::Gained),
        account("prescribed motions", Account::Gained),
        account("moving surfaces of bodies", Account::Gained),
    ];
    let unknown = [
        (plan.contact.is_some(), "contact by impulses"),
        (plan.rolling.is_some(), "wheels of machines without inertia"),
        (!plan.varies.is_empty(), "mass that changes"),
        (!plan.loop_motions.is_empty(), "prescribed motions of loops"),
        (plan.tree.is_flexible(), "flexible bodies"),
    ];
    let unknown = unknown.iter().filter(|(is, _)| *is).map(|(_, what)| (*what).to_string());
    OwnAccounts { known, unknown: unknown.collect(), receives_work: true }
}

impl MechanismBlock {
    /// Returns the values of [`of`] at the state of the last evaluation.
    pub(crate) fn count(&mut self, now: &EvalTime, x: &[f64], sig: &[f64], out: &mut [f64]) {
        let evaluated = self.at != NEVER;
        let plan = self.plan.clone();
        let steps = plan.contact.is_some() || plan.rolling.is_some();
        // At a row, the last evaluation was at this state unless the part advances by its own method.
        if steps || !evaluated {
            self.at = NEVER;
            self.kinematics(now, x);
        }
        let (nq, nv) = (plan.multibody.nq(), plan.multibody.nv());
        let (q, v) = x[self.w.x..self.w.x + nq + nv].split_at(nq);
        let kinetic = kinetic_energy(&self.tree, &self.ws, v);
        let height = |g: Vec3| g.dot(&center_of_mass(&self.tree, &self.ws));
        let potential = plan.uniform.map_or(0.0, |g| -self.tree.total_mass() * height(g));
        self.dv.fill(0.0);
        plan.joints.add_losses(q, v, &mut self.dv);
        let hinges: f64 = self.dv.iter().zip(v).map(|(t, v)| t * v).sum();
        let (mut field, mut given) = (f64::NAN, f64::NAN);
        let loads = self.compliant.iter().flat_map(|c| c.loads());
        let surfaces: f64 = loads.map(|load| load.surface_power).sum();
        if evaluated && !steps {
            field = self.ws.external_power() - self.work_of_parts(sig) - surfaces;
            let each = plan.prescribed.iter().zip(&self.tau).zip(v).filter(|((is, _), _)| **is);
            given = each.map(|((_, t), v)| t * v).sum();
        } else if steps {
            (field, given) = (0.0, 0.0);
        }
        let springs = plan.joints.spring_energy(q);
        out.copy_from_slice(&[kinetic, potential, springs, hinges, field, given, surfaces]);
    }

    /// Returns the power of the wrenches that parts exert (W).
    fn work_of_parts(&self, sig: &[f64]) -> f64 {
        let plan = &*self.plan;
        let Some(ud) = self.w.ud.get(10 * plan.ports.masses.len()..) else { return 0.0 };
        let wrenches = plan.ports.wrenches.iter().zip(ud.as_chunks::<6>().0);
        let power = |(frame, lanes): (&Frame, &[u32; 6])| {
            let (_, velocity) = match frame {
                Frame::Node(n) => self.ws.node_state(&self.tree, *n),
                Frame::Body(b) => self.ws.body_state(&self.tree, *b),
            };
            let (w, v) = (velocity.angular, velocity.linear);
            let motion = [w.x, w.y, w.z, v.x, v.y, v.z];
            lanes.iter().zip(motion).map(|(lane, v)| sig[*lane as usize] * v).sum::<f64>()
        };
        wrenches.map(power).sum()
    }
}
