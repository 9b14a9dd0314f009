//! Work space of machines that move by kinematics.
use crate::plan::MechanismPlan;
use linkwork_multibody::BodyId;
use linkwork_solvers::{Rolling, Traction};
use linkwork_surroundings::Terrain;
use std::sync::Arc;

/// The machines that roll, with work space.
pub(crate) struct Rolls {
    pub(crate) rolling: Rolling,
    pub(crate) terrain: Arc<dyn Terrain>,
    pub(crate) still: Vec<f64>,
    pub(crate) hold: Vec<f64>,
    pub(crate) before: Vec<f64>,
    /// For each wheel: index of its traction among those of the ports; empty if machines roll.
    pub(crate) wheels: Vec<usize>,
    pub(crate) tractions: Vec<Traction>,
}

impl Rolls {
    /// Returns the rolls of a plan, if it has any.
    pub fn of(plan: &MechanismPlan) -> Option<Self> {
        let (rolling, terrain) = plan.rolling.clone()?;
        let zeros = vec![0.0; plan.multibody.nv()];
        let (hold, before) = (zeros.clone(), zeros.clone());
        let given = &plan.ports.tractions;
        let place = |w: &(BodyId, f64)| given.iter().position(|b| *b == w.0);
        let wheels: Vec<usize> =
            rolling.vehicles().flat_map(|v| &v.wheels).filter_map(place).collect();
        let tractions = vec![Traction::default(); wheels.len()];
        Some(Rolls { rolling, terrain, still: zeros, hold, before, wheels, tractions })
    }
}
