//! What a `Mechanism` and its states share: the structure, the kernels' tree, spare workspaces.
//!
//! The tree has one node more for each body, at the body's origin, so that whatever a node can be
//! asked a body can be asked too.
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

/// Free fall (m/s²) unless the user says otherwise.
pub const GRAVITY: Vec3 = Vec3::new(0.0, 0.0, -9.81);

/// A call that takes longer than some microseconds lets other Python threads run meanwhile.
const LONG_CALL: usize = 50;

/// A mechanism, ready for the kernels.
pub struct Core {
    /// As the user described it.
    pub mbs: Multibody,
    /// With a node at the origin of each body.
    pub tree: Arc<Tree>,
    /// The configuration that the file shows; else the neutral one.
    pub initial: Vec<f64>,
    /// What a file says besides.
    pub description: Option<Description>,
    /// What a file in RON says of contact.
    pub contact: Option<FileContact>,
    /// What a file in RON says is to be seen.
    pub shapes: Vec<BodyShape>,
    gravity: Mutex<Vec3>,
    /// In boxes: a workspace is some dozens of lists, and a call would move all of them to and fro.
    #[allow(clippy::vec_box)]
    spare: Mutex<Vec<Box<Workspace>>>,
    derivatives: Mutex<Vec<Derivatives>>,
    /// By number of threads.
    ensembles: Mutex<Vec<Threaded>>,
    /// For loops and couplings.
    pub constrained: Mutex<Vec<crate::constraints::Constrained>>,
    /// For inverse kinematics.
    pub ik: Mutex<Option<InverseKinematics>>,
}

/// A lock that a panic elsewhere does not take away: what it holds is always whole.
pub fn lock<T>(m: &Mutex<T>) -> MutexGuard<'_, T> {
    m.lock().unwrap_or_else(PoisonError::into_inner)
}

fn origin_of(body: &str) -> String {
    format!("origin of {body}")
}

/// An ensemble, for how many threads, and the process that they are in.
struct Threaded {
    threads: usize,
    process: u32,
    ensemble: Ensemble,
}

impl Core {
    /// Lays a mechanism out.
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

    /// Free fall, m/s², world axes.
    pub fn gravity(&self) -> Vec3 {
        *lock(&self.gravity)
    }

    /// Sets it for all later calls.
    pub fn set_gravity(&self, g: Vec3) {
        *lock(&self.gravity) = g;
    }

    /// Degrees of freedom.
    pub fn nv(&self) -> usize {
        self.mbs.nv()
    }

    /// Numbers in q.
    pub fn nq(&self) -> usize {
        self.mbs.nq()
    }

    /// Reads a configuration: nq finite numbers, of which quaternions have a direction.
    pub fn configuration<'py>(
        &self,
        given: &Bound<'py, PyAny>,
        what: &str,
    ) -> PyResult<Input<'py>> {
        let q = vector(given, self.nq(), what)?;
        self.attitudes(q.slice())?;
        Ok(q)
    }

    /// Refuses configurations, row after row, with a quaternion without a direction: such as zeros for a free body.
    pub fn attitudes(&self, rows: &[f64]) -> PyResult<()> {
        let row = |q: &[f64]| checked::configuration(&self.tree, q).map_err(refuse);
        rows.chunks_exact(self.nq().max(1)).try_for_each(row)
    }

    /// A workspace with this mechanism's gravity and no other force.
    pub fn workspace(&self) -> Box<Workspace> {
        let spare = lock(&self.spare).pop();
        let mut ws = spare.unwrap_or_else(|| Box::new(Workspace::new(&self.tree)));
        ws.clear_forces();
        ws.apply_uniform_gravity(self.gravity());
        ws
    }

    /// Takes a workspace back.
    pub fn give_back(&self, ws: Box<Workspace>) {
        lock(&self.spare).push(ws);
    }

    /// Runs `f` on memory for derivatives.
    pub fn with_derivatives<R>(&self, f: impl FnOnce(&mut Derivatives) -> R) -> R {
        let spare = lock(&self.derivatives).pop();
        let mut memory = spare.unwrap_or_else(|| Derivatives::new(&self.tree));
        let result = f(&mut memory);
        lock(&self.derivatives).push(memory);
        result
    }

    /// Runs `f` on an ensemble of so many threads.
    pub fn with_ensemble<R>(&self, threads: usize, f: impl FnOnce(&mut Ensemble) -> R) -> R {
        let own = std::process::id();
        let spare = {
            let mut all = lock(&self.ensembles);
            // After a fork the threads of the parent's ensembles are not here: waiting for them would not end, nor may they be told to.
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

    /// Runs `f` on a workspace; without the interpreter's lock when the mechanism is large.
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

    /// A node, or the origin of a body; a node goes first where both have the name.
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

    /// A body.
    pub fn body(&self, name: &str) -> PyResult<linkwork_multibody::BodyId> {
        self.mbs.body(name).ok_or_else(|| {
            let known: Vec<&str> = self.mbs.bodies().iter().map(|b| b.name()).collect();
            refuse_with(format!("there is no body `{name}`"), remedy(name, "bodies", &known))
        })
    }

    /// Wrenches by node or body.
    pub fn wrenches(&self, given: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(NodeId, Force)>> {
        let Some(given) = given else { return Ok(Vec::new()) };
        let read = |(name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
            let name: String = name.extract()?;
            Ok((self.frame(&name)?, wrench(&value, &format!("wrenches[\"{name}\"]"))?))
        };
        pairs(given).into_iter().map(read).collect()
    }

    /// Kinematics, then these wrenches and no other.
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
