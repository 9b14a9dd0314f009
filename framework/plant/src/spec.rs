//! The mechanism of a specification: structure, start, and settings of solvers.
use crate::gaps::{Closing, Gaps};
use crate::touch::Pair;
use linkwork_collision::Colliders;
use linkwork_dynamics::{Tree, Workspace};
use linkwork_multibody::{LoopMotion, Multibody};
use linkwork_runtime::{Origin, Setting};
use linkwork_solvers::{
    CompliantLaws, ConstrainedSolver, ConstraintMethod, ContactSettings, FixedValues, Rolling,
    StartError, Vehicle, close_start,
};
use linkwork_surroundings::{BodyStart, Scenery, Terrain};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The mechanism and its start.
#[derive(Clone)]
pub struct MechanismSpec {
    /// Path of the mechanism as a part: its outputs are `<path>.<body>…`.
    pub path: String,
    /// Structure.
    pub multibody: Arc<Multibody>,
    /// Coordinates at the start.
    pub q: Vec<f64>,
    /// Velocities at the start.
    pub v: Vec<f64>,
    /// Coordinates and velocities that keep their values when loops and couplings are closed at the start; the others follow. Without any, q and v
    /// only select the nearest closed start.
    pub kept: FixedValues,
    /// Free bodies that start on an orbit, in named axes or over the ground: the world computes position and velocity, which replace the numbers in `q` and `v`.
    pub starts: Vec<BodyStart>,
    /// Path of the gravity service; `None`: the only one, or no gravity when there is none.
    pub gravity: Option<String>,
    /// Path of the terrain that contact uses; `None`: the only terrain, if there is one; `"none"`: no terrain.
    pub terrain: Option<String>,
    /// Friction of terrain that has no soil, when the file writes one for all contact.
    pub ground_friction: Option<f64>,
    /// Constraint method of each loop and coupling, by name; default: `Auto`.
    pub constraint_methods: BTreeMap<String, ConstraintMethod>,
    /// Prescribed subhinges of loops at the start. Gaps are found independently of these entries.
    pub motions: Vec<LoopMotion>,
    /// Treatment of loops with gaps, by name; default: the gaps are kept.
    pub closings: BTreeMap<String, Closing>,
    /// Contact by impulses; the mechanism then has its own stepping method.
    pub contact: Option<ContactSpec>,
    /// Compliant contact: smooth forces with bristles as states. Not together with `contact`.
    pub compliant: Option<(Arc<Colliders>, CompliantLaws)>,
    /// Machines that move by kinematics, if the whole mechanism does; contact and forces then have no effect.
    pub kinematic: Option<KinematicSpec>,
    /// Bodies whose hinge reports its load.
    pub reactions: Vec<String>,
    /// Bodies on a locked hinge that is represented by a prescribed pin which never moves, so that its load is known.
    pub held: Vec<String>,
    /// Pairs of bodies whose contact force is reported: the force on the first from the second, which may be `world`.
    pub pair_forces: Vec<[String; 2]>,
    /// Position in the file.
    pub origin: Origin,
    /// Positions of loops and couplings in the file, by name.
    pub origins: BTreeMap<String, Origin>,
    /// Positions of bodies in the file, by name.
    pub bodies: Arc<BTreeMap<String, Origin>>,
    /// Visible shapes, for cameras and lidars.
    pub scenery: Scenery,
    /// Other settings of the file that may have no effect.
    pub settings: Vec<Setting>,
    /// The step, s, which determines the stiffness of default stops; `None`: unknown, and default stops do not act.
    pub step: Option<f64>,
}

impl MechanismSpec {
    /// Creates a mechanism without settings of constraints, without contact and without its own gravity.
    #[must_use]
    pub fn new(
        path: impl Into<String>,
        multibody: Arc<Multibody>,
        q: Vec<f64>,
        v: Vec<f64>,
    ) -> Self {
        Self {
            path: path.into(),
            motions: vec![LoopMotion::default(); multibody.motions()],
            multibody,
            q,
            v,
            kept: FixedValues::default(),
            starts: Vec::new(),
            gravity: None,
            terrain: None,
            ground_friction: None,
            constraint_methods: BTreeMap::new(),
            closings: BTreeMap::new(),
            contact: None,
            compliant: None,
            kinematic: None,
            reactions: Vec::new(),
            held: Vec::new(),
            pair_forces: Vec::new(),
            origin: Origin::NONE,
            origins: BTreeMap::new(),
            bodies: Arc::default(),
            scenery: Scenery::default(),
            settings: Vec::new(),
            step: None,
        }
    }
}

impl MechanismSpec {
    /// Returns the coordinates and rates of the start with all loops and couplings closed: the start of a simulation.
    ///
    /// # Errors
    /// [`StartError`]: loops and couplings cannot be closed with the kept values.
    pub fn closed_start(&self) -> Result<(Vec<f64>, Vec<f64>), StartError> {
        let (tree, mut motions) = (Tree::new(&self.multibody), self.motions.clone());
        let mut ws = Workspace::new(&tree);
        let mut solver = ConstrainedSolver::new(&tree, |_| ConstraintMethod::Augment);
        for gaps in Gaps::all(&self.multibody, &self.closings) {
            gaps.find(&tree, &mut ws, &mut solver, (&self.q, &self.v), &mut motions);
        }
        let (mut q, mut v) = (self.q.clone(), self.v.clone());
        close_start(&tree, &motions, &self.kept, &mut q, &mut v)?;
        Ok((q, v))
    }
}

/// Colliders, and the solver of their contact. A mechanism with contact by impulses computes velocities and impulses together for each step, of first
/// order in the step; other continuous states are integrated as usual.
#[derive(Clone)]
pub struct ContactSpec {
    /// Collision shapes, and the rules for pairs that may touch.
    pub colliders: Arc<Colliders>,
    /// Settings of the contact solver.
    pub settings: ContactSettings,
}

/// Machines that move over the ground without inertia.
#[derive(Clone)]
pub struct KinematicSpec {
    /// The machines.
    pub vehicles: Vec<Vehicle>,
    /// True if forces balance at each instant by the traction of each wheel; otherwise wheels roll.
    pub quasi_static: bool,
    /// Path of the terrain on which they drive; `None`: the only one.
    pub terrain: Option<String>,
    /// Position in the file.
    pub origin: Origin,
}

/// Machines that move by kinematics, and the ground on which they drive.
pub(crate) type RollingOn = (Rolling, Arc<dyn Terrain>);

impl MechanismSpec {
    /// Returns the pairs of bodies whose force is reported, in the order of the file.
    pub(crate) fn pairs(&self) -> Vec<Pair> {
        let body = |name: &str| self.multibody.body(name);
        let pair = |[of, from]: &[String; 2]| Some(Pair { of: body(of)?, from: body(from) });
        self.pair_forces.iter().filter_map(pair).collect()
    }
}
