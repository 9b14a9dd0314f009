//! The constant part of a mechanism.
use crate::gaps::Gaps;
use crate::joints::JointForces;
use crate::masses::Varying;
use crate::ports::MechanismPorts;
use crate::reaction::{LANES, Reaction};
use crate::spec::ContactSpec;
use crate::spec::RollingOn;
use crate::touch::Pair;
use linkwork_collision::{ColliderId, Colliders};
use linkwork_dynamics::Tree;
use linkwork_multibody::{BodyId, LoopMotion, Multibody};
use linkwork_runtime::Origin;
use linkwork_solvers::{CompliantLaws, ConstrainedSolver, ConstraintMethod, FixedValues};
use linkwork_spatial::Vec3;
use linkwork_surroundings::Gravity;
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// The constant part.
pub struct MechanismPlan {
    /// Path as a part.
    pub path: String,
    /// Structure.
    pub multibody: Arc<Multibody>,
    /// Kernels' constants.
    pub tree: Arc<Tree>,
    /// Gravity field.
    pub gravity: Option<Arc<dyn Gravity>>,
    /// The field, if it is uniform.
    pub uniform: Option<Vec3>,
    /// Angular velocity of W in inertial space (rad/s, W) if W is a site of a rotating planet.
    pub omega: Option<Vec3>,
    /// Coordinates at the start.
    pub q: Vec<f64>,
    /// Velocities at the start.
    pub v: Vec<f64>,
    /// Coordinates and velocities that keep their values when loops and couplings are closed.
    pub(crate) kept: FixedValues,
    /// Prescribed subhinges and gaps of loops at the start.
    pub loop_motions: Vec<LoopMotion>,
    /// Loops that do not close at once.
    pub(crate) gaps: Vec<Gaps>,
    /// Solver of constrained motion, if there are constraints.
    pub solver: Option<ConstrainedSolver>,
    /// Contact by impulses, if the mechanism has its own stepping method.
    pub contact: Option<ContactSpec>,
    /// Compliant contact.
    pub compliant: Option<(Arc<Colliders>, CompliantLaws)>,
    /// Machines that move by kinematics.
    pub(crate) rolling: Option<RollingOn>,
    /// Lanes of the bristles of compliant contact, and of the table of pairs that share them.
    pub(crate) bristles: (usize, usize),
    /// Bodies with a collider, and bodies that roll.
    pub(crate) touched: Vec<BodyId>,
    /// Colliders of each body whose surface velocity comes from a part, in the order of the ports.
    pub(crate) belts: Vec<Vec<ColliderId>>,
    /// Pairs of bodies whose contact force is reported; the second may be the world.
    pub(crate) pairs: Vec<Pair>,
    /// Hinges whose load is computed.
    pub(crate) loads: Vec<Reaction>,
    /// Bodies of the vehicles whose mass is read.
    pub(crate) vehicles: Vec<Vec<BodyId>>,
    /// Names of bodies on locked hinges that are represented by coordinates.
    pub(crate) held: Vec<String>,
    /// Constraint method of each constraint.
    pub constraint_methods: Vec<ConstraintMethod>,
    /// Damping, friction and stops of hinges.
    pub(crate) joints: JointForces,
    /// Quantities that are read and written through wires.
    pub ports: MechanismPorts,
    /// Bodies with added mass.
    pub(crate) varies: Vec<Varying>,
    /// For each index in v: whether its motion is prescribed.
    pub(crate) prescribed: Vec<bool>,
    /// Signal lanes of added masses, ten for each frame.
    pub(crate) masses: Vec<u32>,
    /// Its fingerprint, after the first query.
    pub(crate) print: OnceLock<String>,
    /// First lane of q in x; v follows, then u and u̇ of each loop motion, then bristles.
    pub x: usize,
    /// Position in the file.
    pub(crate) origin: Origin,
    /// Positions of loops and couplings in the file, by name.
    pub(crate) origins: BTreeMap<String, Origin>,
    /// Positions of bodies in the file, by name.
    pub(crate) bodies: Arc<BTreeMap<String, Origin>>,
}

impl MechanismPlan {
    /// Number of lanes of the loads of all hinges.
    pub(crate) fn load_lanes(&self) -> usize {
        self.loads.iter().map(|r| LANES + r.effort.len()).sum()
    }
}
