//! The mechanism as one part with two operations: kinematics (from state) and dynamics (from forces).
//!
//! ```text
//! outputs:  q, v → poses and velocities of the bound nodes, hinge states
//! direct: Σ wrenches, Σ torques, gravity, damping and stops of hinges → accelerations, forces of constraints
//! deriv:  q̇ = N(q) v,  v̇ from direct
//! ```
//! After a step q and v are put back onto the constraints. With contact, the part advances a step at a
//! time (`advance`); nothing but the impulses of the last contacts passes from step to step, and they
//! are its store. Where machines move by kinematics it advances likewise (`rolling`), and nothing passes on.
mod accounts;
mod axle;
mod block;
mod branch;
mod carry;
mod closing;
mod forward_jacobian;
mod frame;
mod gaps;
mod host;
mod idle;
mod jacobian;
mod joints;
mod loads;
mod masses;
mod names;
mod part;
mod passing;
mod placement;
mod plan;
mod ports;
mod rank;
mod reaction;
mod rolling;
mod rolls;
mod spec;
mod start;
mod touch;
mod vehicles;

pub use frame::Frame;
pub use gaps::Closing;
pub use part::MechanismPart;
pub use passing::Passing;
pub use placement::{PlaceError, Placed, Placement, place_on_terrain, settle_placed};
pub use plan::MechanismPlan;
pub use ports::MechanismPorts;
pub use rank::RankReport;
pub use spec::{ContactSpec, KinematicSpec, MechanismSpec};

use crate::plan::Plan;
use crate::program::Program;
use crate::spec::Spec;
use std::any::Any;
use std::sync::Arc;

impl Spec {
    /// The mechanism, when parts bind to one.
    pub fn mechanism(&self) -> Option<&MechanismSpec> {
        let host: &dyn Any = &**self.host.as_ref()?;
        host.downcast_ref()
    }
    /// Returns the specification for a change.
    pub fn mechanism_mut(&mut self) -> Option<&mut MechanismSpec> {
        let host: &mut dyn Any = &mut **self.host.as_mut()?;
        host.downcast_mut()
    }
    /// Gives the parts a mechanism to bind to.
    pub fn set_mechanism(&mut self, mechanism: MechanismSpec) {
        self.host = Some(Box::new(mechanism));
    }
}

impl Program {
    /// For each phase the lanes of its mechanism's q and v in x, one after the other; empty without one.
    pub fn coordinates(&self) -> Vec<std::ops::Range<usize>> {
        let lanes = |m: &Arc<MechanismPlan>| m.x..m.x + m.multibody.nq() + m.multibody.nv();
        self.phases.iter().map(|p| p.plan.mechanism().map_or(0..0, lanes)).collect()
    }
}

impl Plan {
    /// The mechanism of a plan. O(parts).
    pub fn mechanism(&self) -> Option<&Arc<MechanismPlan>> {
        self.parts.iter().find_map(|p| {
            let prototype: &dyn Any = &*p.prototype;
            prototype.downcast_ref::<MechanismPart>().map(|m| &m.plan)
        })
    }
    /// Returns the plan of the mechanism for a change of its start, while no run uses the plan.
    pub fn mechanism_mut(&mut self) -> Option<&mut MechanismPlan> {
        self.parts.iter_mut().find_map(|p| {
            let prototype: &mut dyn Any = &mut *p.prototype;
            Arc::get_mut(&mut prototype.downcast_mut::<MechanismPart>()?.plan)
        })
    }
}
