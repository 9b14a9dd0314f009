//! The mechanism of a specification: structure, how it starts, how it is solved.
use crate::gaps::{Closing, Gaps};
use crate::touch::Pair;
use linkwork_collision::Colliders;
use linkwork_dynamics::{Tree, Workspace};
use linkwork_multibody::{LoopMotion, Multibody};
use linkwork_runtime::{BodyStart, Origin, Scenery, Setting, Terrain};
use linkwork_solvers::{
    CompliantLaws, ConstrainedSolver, ConstraintMethod, ContactSettings, FixedValues, Rolling,
    StartError, Vehicle, close_start,
};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The mechanism and how it starts.
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
    /// Coordinates and velocities that keep their values where loops and couplings are closed at the start; the others follow. None as it
    /// stands: q and v then only select the closed start that is near.
    pub kept: FixedValues,
    /// Free bodies that start on an orbit, in named axes or over the ground: the world computes position and velocity, which replace the numbers in `q` and `v`.
    pub starts: Vec<BodyStart>,
    /// Path of the gravity service; `None`: the only one, or no gravity when there is none.
    pub gravity: Option<String>,
    /// Path of the terrain that contact meets; `None`: the only one, if there is one; `"none"`: contact meets no terrain.
    pub terrain: Option<String>,
    /// Friction of terrain that has no soil, when the file writes one for all contact.
    pub ground_friction: Option<f64>,
    /// How each loop and coupling is treated, by name; `Auto` where nothing is said.
    pub constraint_methods: BTreeMap<String, ConstraintMethod>,
    /// Prescribed subhinges of loops at the start. Gaps are found independently of these entries.
    pub motions: Vec<LoopMotion>,
    /// How loops with gaps close, by name; as found where nothing is said.
    pub closings: BTreeMap<String, Closing>,
    /// Non-smooth contact, when the mechanism is stepped with it.
    pub contact: Option<ContactSpec>,
    /// Compliant contact: smooth forces with bristles as states. Not together with `contact`.
    pub compliant: Option<(Arc<Colliders>, CompliantLaws)>,
    /// Machines that move by kinematics alone, when all of the mechanism does: contact and forces do nothing then.
    pub kinematic: Option<KinematicSpec>,
    /// Bodies whose hinge reports its load.
    pub reactions: Vec<String>,
    /// Bodies on a locked hinge that stands as a prescribed pin which never moves, so that its load is known.
    pub held: Vec<String>,
    /// Pairs of bodies whose contact force is reported: the force on the first from the second, which may be `world`.
    pub pair_forces: Vec<[String; 2]>,
    /// Where it is written.
    pub origin: Origin,
    /// Where loops and couplings are written, by name.
    pub origins: BTreeMap<String, Origin>,
    /// Where bodies are written, by name.
    pub bodies: Arc<BTreeMap<String, Origin>>,
    /// Visible shapes, for cameras and lidars.
    pub scenery: Scenery,
    /// Other settings of the file that may be without effect.
    pub settings: Vec<Setting>,
    /// The step, s, from which the stiffness of usual stops follows; `None`: not known, and they do not act.
    pub step: Option<f64>,
}

impl MechanismSpec {
    /// A mechanism without constraints' settings, contact or a gravity of its own.
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
    /// [`StartError`]: they cannot be closed with what is kept.
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

/// Shapes that meet, and how their contact is solved. A mechanism with it advances a step at a time:
/// velocities and impulses together, first order in the step; other continuous states are
/// integrated as ever.
#[derive(Clone)]
pub struct ContactSpec {
    /// Shapes with the rules of who meets whom.
    pub colliders: Arc<Colliders>,
    /// How contact is solved.
    pub settings: ContactSettings,
}

/// Machines that move over the ground without inertia.
#[derive(Clone)]
pub struct KinematicSpec {
    /// The machines.
    pub vehicles: Vec<Vehicle>,
    /// Whether forces balance at each instant, by the traction of each wheel; else wheels roll.
    pub quasi_static: bool,
    /// Path of the terrain that they drive on; `None`: the only one.
    pub terrain: Option<String>,
    /// Where it is written.
    pub origin: Origin,
}

/// Machines that move by kinematics, and the ground that they drive on.
pub(crate) type RollingOn = (Rolling, Arc<dyn Terrain>);

impl MechanismSpec {
    /// The pairs of bodies whose force is reported, in the order of the file.
    pub(crate) fn pairs(&self) -> Vec<Pair> {
        let body = |name: &str| self.multibody.body(name);
        let pair = |[of, from]: &[String; 2]| Some(Pair { of: body(of)?, from: body(from) });
        self.pair_forces.iter().filter_map(pair).collect()
    }
}
