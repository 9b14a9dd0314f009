//! Shared data of a `Mechanism` and its states: the structure, the tree of the algorithms, spare workspaces.
//!
//! The tree has one additional node per body, at the body's origin, so every query of a node also works for a body.
use crate::array::{Input, vector, wrench};
use crate::error::{refuse, refuse_with};
use crate::files::FileContact;
use crate::values::pairs;
use linkwork_assembly::BodyShape;
use linkwork_dynamics::{
    Derivatives, Ensemble, InverseKinematics, Tree, Workspace, checked, kinematics,
};
use linkwork_formats::Description;
use linkwork_multibody::{Builder, Multibody, NodeId};
use linkwork_runtime::remedy;
use linkwork_spatial::{Force, Pose, Vec3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Default gravitational acceleration, m/s².
pub const GRAVITY: Vec3 = Vec3::new(0.0, 0.0, -9.81);

/// Mechanisms with more degrees of freedom release the interpreter's lock, because a call takes more than a few microseconds.
const LONG_CALL: usize = 50;

/// A mechanism with the data that the algorithms need.
pub struct Core {
    /// The mechanism as the user described it.
    pub mbs: Multibody,
    /// The tree, with a node at the origin of each body.
    pub tree: Arc<Tree>,
    /// The initial configuration of the file; the neutral configuration if there is none.
    pub initial: Vec<f64>,
    /// Further content of a URDF, MJCF or SDF file.
    pub description: Option<Description>,
    /// The `contact` of a RON file.
    pub contact: Option<FileContact>,
    /// The visual shapes of a RON file.
    pub shapes: Vec<BodyShape>,
    gravity: Mutex<Vec3>,
    /// Boxed, because a workspace consists of dozens of vectors, which would otherwise be moved in every call.
    #[allow(clippy::vec_box)]
    spare: Mutex<Vec<Box<Workspace>>>,
    derivatives: Mutex<Vec<Derivatives>>,
    /// Ensembles by number of threads.
    ensembles: Mutex<Vec<Threaded>>,
    /// Memory for loops and couplings.
    pub constrained: Mutex<Vec<crate::constraints::Constrained>>,
    /// Memory for inverse kinematics.
    pub ik: Mutex<Option<InverseKinematics>>,
}

/// Locks a mutex, also after a panic in another thread: the data are always consistent.
pub fn lock<T>(m: &Mutex<T>) -> MutexGuard<'_, T> {
    m.lock().unwrap_or_else(PoisonError::into_inner)
}

fn origin_of(body: &str) -> String {
    format!("origin of {body}")
}

/// An ensemble, its number of threads, and the process that created them.
struct Threaded {
    threads: usize,
    process: u32,
    ensemble: Ensemble,
}

impl Core {
    /// Creates the shared data of a mechanism.
    pub fn new(mbs: Multibody, gravity: Vec3) -> PyResult<Self> {
        let mut with_origins = Builder::from(&mbs);
        for b in mbs.bodies() {
            with_origins.node(origin_of(b.name()), b.name(), Pose::identity());
        }
        let with_origins = with_origins.build().map_err(crate::error::refuse)?;
        let (tree, gravity) = (Arc::new(Tree::new(&with_origins)), Mutex::new(gravity));
        Ok(Self {
            initial: mbs.neutral_q(),
            description: None,
            contact: None,
            shapes: Vec::new(),
            mbs,
            tree,
            gravity,
            spare: Mutex::default(),
            derivatives: Mutex::default(),
            ensembles: Mutex::default(),
            constrained: Mutex::default(),
            ik: Mutex::default(),
        })
    }

    /// Returns the gravitational acceleration, m/s², world axes.
    pub fn gravity(&self) -> Vec3 {
        *lock(&self.gravity)
    }

    /// Sets the gravitational acceleration for all later calls.
    pub fn set_gravity(&self, g: Vec3) {
        *lock(&self.gravity) = g;
    }

    /// Returns the number of degrees of freedom.
    pub fn nv(&self) -> usize {
        self.mbs.nv()
    }

    /// Returns the number of coordinates.
    pub fn nq(&self) -> usize {
        self.mbs.nq()
    }

    /// Reads a configuration: nq finite numbers without zero quaternions.
    pub fn configuration<'py>(
        &self,
        given: &Bound<'py, PyAny>,
        what: &str,
    ) -> PyResult<Input<'py>> {
        let q = vector(given, self.nq(), what)?;
        self.attitudes(q.slice())?;
        Ok(q)
    }

    /// Returns an error for configurations (in row-major order) with a zero quaternion, for example all zeros for a free body.
    pub fn attitudes(&self, rows: &[f64]) -> PyResult<()> {
        let row = |q: &[f64]| checked::configuration(&self.tree, q).map_err(refuse);
        rows.chunks_exact(self.nq().max(1)).try_for_each(row)
    }

    /// Returns a workspace with this mechanism's gravity and no other forces.
    pub fn workspace(&self) -> Box<Workspace> {
        let spare = lock(&self.spare).pop();
        let mut ws = spare.unwrap_or_else(|| Box::new(Workspace::new(&self.tree)));
        ws.clear_forces();
        ws.apply_uniform_gravity(self.gravity());
        ws
    }

    /// Returns a workspace for reuse.
    pub fn give_back(&self, ws: Box<Workspace>) {
        lock(&self.spare).push(ws);
    }

    /// Runs `f` with memory for derivatives.
    pub fn with_derivatives<R>(&self, f: impl FnOnce(&mut Derivatives) -> R) -> R {
        let spare = lock(&self.derivatives).pop();
        let mut memory = spare.unwrap_or_else(|| Derivatives::new(&self.tree));
        let result = f(&mut memory);
        lock(&self.derivatives).push(memory);
        result
    }

    /// Runs `f` with an ensemble of `threads` threads.
    pub fn with_ensemble<R>(&self, threads: usize, f: impl FnOnce(&mut Ensemble) -> R) -> R {
        let own = std::process::id();
        let spare = {
            let mut all = lock(&self.ensembles);
            // After a fork, the threads of the parent's ensembles do not exist in this process. Dropping such an ensemble would wait for them
            // forever, so it is leaked.
            let (here, gone) =
                std::mem::take(&mut *all).into_iter().partition(|e| e.process == own);
            *all = here;
            let gone: Vec<Threaded> = gone;
            gone.into_iter().for_each(std::mem::forget);
            all.iter().position(|e| e.threads == threads).map(|k| all.swap_remove(k).ensemble)
        };
        let mut ensemble = spare.unwrap_or_else(|| Ensemble::new(self.tree.clone(), threads));
        ensemble.set_uniform_gravity(self.gravity());
        let result = f(&mut ensemble);
        lock(&self.ensembles).push(Threaded { threads, process: own, ensemble });
        result
    }

    /// Runs `f` with a workspace. The interpreter's lock is released if the mechanism is large.
    pub fn run<R: Send>(
        &self,
        py: Python<'_>,
        f: impl FnOnce(&Tree, &mut Workspace) -> R + Send,
    ) -> R {
        let work = || {
            let mut ws = self.workspace();
            let result = f(&self.tree, &mut ws);
            self.give_back(ws);
            result
        };
        if self.nv() > LONG_CALL { py.detach(work) } else { work() }
    }

    /// Returns the node with a name, or else the origin of the body with this name.
    pub fn frame(&self, name: &str) -> PyResult<NodeId> {
        let mbs = self.tree.multibody();
        let found = mbs.node(name).or_else(|| mbs.node(&origin_of(name)));
        found.ok_or_else(|| {
            let nodes = self.mbs.nodes().iter().map(|n| n.name());
            let known: Vec<&str> =
                nodes.chain(self.mbs.bodies().iter().map(|b| b.name())).collect();
            let help = remedy(name, "nodes and bodies", &known);
            refuse_with(format!("there is no node and no body `{name}`"), help)
        })
    }

    /// Returns the body with a name.
    pub fn body(&self, name: &str) -> PyResult<linkwork_multibody::BodyId> {
        self.mbs.body(name).ok_or_else(|| {
            let known: Vec<&str> = self.mbs.bodies().iter().map(|b| b.name()).collect();
            refuse_with(format!("there is no body `{name}`"), remedy(name, "bodies", &known))
        })
    }

    /// Reads wrenches by node or body.
    pub fn wrenches(&self, given: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(NodeId, Force)>> {
        let Some(given) = given else { return Ok(Vec::new()) };
        let read = |(name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
            let name: String = name.extract()?;
            Ok((self.frame(&name)?, wrench(&value, &format!("wrenches[\"{name}\"]"))?))
        };
        pairs(given).into_iter().map(read).collect()
    }

    /// Computes the kinematics, then sets gravity and these wrenches as the only forces.
    pub fn load(&self, ws: &mut Workspace, q: &[f64], v: &[f64], wrenches: &[(NodeId, Force)]) {
        kinematics(&self.tree, ws, q, v);
        if wrenches.is_empty() {
            return;
        }
        ws.clear_forces();
        ws.apply_uniform_gravity(self.gravity());
        for (node, f) in wrenches {
            ws.add_wrench_at_node(&self.tree, *node, *f);
        }
    }
}
