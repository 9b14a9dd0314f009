//! The mechanism of a specification, a plan and a program. The runtime stores it as one part among others and does not name its type.
use crate::part::MechanismPart;
use crate::plan::MechanismPlan;
use crate::spec::MechanismSpec;
use linkwork_runtime::{Plan, Program, Spec};
use std::any::Any;
use std::ops::Range;
use std::sync::Arc;

/// The mechanism of a [`Spec`].
pub trait SpecExt {
    /// Returns the mechanism, if parts bind to one.
    fn mechanism(&self) -> Option<&MechanismSpec>;
    /// Returns the mechanism for a change.
    fn mechanism_mut(&mut self) -> Option<&mut MechanismSpec>;
    /// Sets the mechanism that parts bind to.
    fn set_mechanism(&mut self, mechanism: MechanismSpec);
}

impl SpecExt for Spec {
    fn mechanism(&self) -> Option<&MechanismSpec> {
        let host: &dyn Any = &**self.host.as_ref()?;
        host.downcast_ref()
    }
    fn mechanism_mut(&mut self) -> Option<&mut MechanismSpec> {
        let host: &mut dyn Any = &mut **self.host.as_mut()?;
        host.downcast_mut()
    }
    fn set_mechanism(&mut self, mechanism: MechanismSpec) {
        self.host = Some(Box::new(mechanism));
    }
}

/// The mechanism of a [`Plan`].
pub trait PlanExt {
    /// Returns the mechanism. O(parts).
    fn mechanism(&self) -> Option<&Arc<MechanismPlan>>;
    /// Returns the mechanism for a change of its start; `None` also if a run uses it. O(parts).
    fn mechanism_mut(&mut self) -> Option<&mut MechanismPlan>;
}

impl PlanExt for Plan {
    fn mechanism(&self) -> Option<&Arc<MechanismPlan>> {
        self.parts.iter().find_map(|p| {
            let prototype: &dyn Any = &*p.prototype;
            prototype.downcast_ref::<MechanismPart>().map(|m| &m.plan)
        })
    }
    fn mechanism_mut(&mut self) -> Option<&mut MechanismPlan> {
        self.parts.iter_mut().find_map(|p| {
            let prototype: &mut dyn Any = &mut *p.prototype;
            Arc::get_mut(&mut prototype.downcast_mut::<MechanismPart>()?.plan)
        })
    }
}

/// The mechanisms of a [`Program`].
pub trait ProgramExt {
    /// Returns for each phase the slots of q and v of its mechanism in the continuous state, one after the other; an empty range if the
    /// phase has no mechanism.
    fn coordinates(&self) -> Vec<Range<usize>>;
}

impl ProgramExt for Program {
    fn coordinates(&self) -> Vec<Range<usize>> {
        let lanes = |m: &Arc<MechanismPlan>| m.x..m.x + m.multibody.nq() + m.multibody.nv();
        self.phases.iter().map(|p| p.plan.mechanism().map_or(0..0, lanes)).collect()
    }
}
