//! Embedded model of one or two arms that controllers use: chains of a URDF file, and the loads that the hands may hold.

use linkwork_embedded::formats::{Description, ReadOptions, Root, Unphysical, read_text};
use linkwork_embedded::multibody::{BodySpec, Hinge, Limits};
use linkwork_embedded::{
    ModelSpec, Object, ObjectSpec, Part, PartSpec, Robot, RobotModel, TaskSpace,
};
use linkwork_runtime::prelude::*;
use linkwork_runtime::{Located, Param, ParamSpec, ReadCx, Value};
use linkwork_spatial::{MassProperties, Mat3, Pose};
use std::sync::{Arc, Mutex, PoisonError};

/// Handling of moments of inertia that are not physical, which occur in the files of many robots.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum InertiaCheck {
    /// Accepted, with a warning that names the link and the values.
    Warn,
    /// Rejected with an error.
    Physical,
}

/// Robot description (URDF) as a parameter: the name of a file, or `(name: "..", text: "..")` with the content of the file. Moments of
/// inertia that are not physical cause a warning.
#[derive(Clone, Debug)]
pub struct RobotFile {
    name: String,
    text: Arc<str>,
}

impl RobotFile {
    /// Creates a description from a text. The text is parsed when a controller is built from it.
    #[must_use]
    pub fn new(name: &str, text: &str) -> Self {
        Self { name: name.into(), text: text.into() }
    }

    /// Parses the description; `root` states how its roots are attached.
    ///
    /// # Errors
    /// Returns an error for an invalid description, and for moments of inertia that are not physical if `check` is `Physical`.
    pub fn read(&self, root: Root, check: InertiaCheck) -> Result<Description, BuildError> {
        let unphysical = match check {
            InertiaCheck::Warn => Unphysical::Read,
            InertiaCheck::Physical => Unphysical::Refused,
        };
        let options = ReadOptions { root, unphysical, ..ReadOptions::default() };
        let read = read_text(&self.text, &options.at(&self.name));
        read.map_err(|e| BuildError::new(e.to_string()).at("robot"))
    }

    /// Returns the description after it has reported a warning for mass properties that are not physical. Parse errors are reported when a controller
    /// is built from it.
    fn told(self, v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Self {
        if let Ok(d) = self.read(Root::AsWritten, InertiaCheck::Warn)
            && !d.doubtful.is_empty()
        {
            let lines: Vec<String> = d.doubtful.iter().map(ToString::to_string).collect();
            let (path, param, name, lines) =
                (&cx.path, &spec.name, &self.name, lines.join("\n    "));
            let fact = format!(
                "`{path}.{param}`: `{name}` has mass properties that are not physical:\n    {lines}"
            );
            let help = "correct the file; `inertia_check: Physical` makes this an error";
            cx.warn(v.origin, fact, Some(help.into()));
        }
        self
    }
}

impl Param for RobotFile {
    fn kind() -> String {
        r#"name of a URDF file, or (name: "..", text: "..") with its content"#.into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Self> {
        let word = |key: &str| match v.get(key).map(|l| &l.value) {
            Some(Value::Text(t)) => Some(t.clone()),
            _ => None,
        };
        let help = r#"write the name of a file, or (name: "..", text: "..")"#;
        match &v.value {
            Value::Text(name) => {
                let text = cx.text(name, v.origin)?;
                Some(Self::new(name, &text).told(v, spec, cx))
            }
            Value::Map(_) => {
                if let (Some(name), Some(text)) = (word("name"), word("text")) {
                    return Some(Self::new(&name, &text).told(v, spec, cx));
                }
                let fact = format!("`{}.{}`: `name` or `text` is missing", cx.path, spec.name);
                cx.fault(v.origin, fact, Some(help.into()));
                None
            }
            other => {
                let (path, name, what) = (&cx.path, &spec.name, other.what());
                let fact = format!("`{path}.{name}` must be the name of a file, not {what}");
                cx.fault(v.origin, fact, Some(help.into()));
                None
            }
        }
    }
    fn show(&self) -> Value {
        Value::Map(vec![
            ("name".into(), Value::Text(self.name.clone()).into()),
            ("text".into(), Value::Text(self.text.to_string()).into()),
        ])
    }
}

/// Load that a hand may hold, with the mass properties that the controller assumes.
#[derive(Params, Clone, Debug)]
pub struct Load {
    /// Name of the load, as in `holds: "name"` of a move.
    pub name: String,
    /// Mass.
    #[param(unit = "kg", range = 0.0..)]
    pub mass: f64,
    /// Centre of mass from the tip's origin, axes of the tip.
    #[param(unit = "m", default = Vec3::zeros())]
    pub com: Vec3,
    /// Moments of inertia about the centre of mass, along the tip's axes.
    #[param(unit = "kg m^2", default = Vec3::zeros())]
    pub inertia: Vec3,
}

impl Load {
    /// Returns the index of the load that a move names.
    ///
    /// # Errors
    /// Returns an error if no load has this name.
    pub fn find(
        loads: &[Load],
        name: Option<&str>,
        of_move: &str,
    ) -> Result<Option<usize>, BuildError> {
        let Some(name) = name else { return Ok(None) };
        let found = loads.iter().position(|l| l.name == name);
        found.map(Some).ok_or_else(|| {
            let known: Vec<&str> = loads.iter().map(|l| l.name.as_str()).collect();
            let fact = format!("move `{of_move}` holds `{name}`, which is not a load");
            BuildError::new(fact).help(format!("loads: {}", known.join(", "))).at("moves")
        })
    }
}

/// One hand: the tip of its chain and the parameter that names it.
#[derive(Clone, Copy, Debug)]
pub struct Hand<'a> {
    /// Name of the parameter with the tip's link, for messages.
    pub at: &'static str,
    /// Link whose frame is the tip.
    pub tip: &'a str,
    /// Origin of the tip in the frame of that link, m.
    pub tool: Vec3,
}

/// One or two arms on one base; the data are constant during a run.
#[derive(Debug)]
pub struct Arm {
    /// The embedded model.
    pub model: Arc<RobotModel>,
    /// Kinematic chain of each hand; chains do not share joints.
    pub chains: Vec<Part>,
    /// Indices of all joints in the model's β: hand by hand, base to tip.
    pub dofs: Vec<usize>,
    /// Loads that hands may hold, in the order of the parameter.
    pub loads: Vec<Object>,
    /// Limits by index in β: minimum and maximum position (rad or m), maximum rate, maximum effort (N m or N).
    pub limits: Vec<Limits>,
    gravity: Vec3,
    /// Working memories that no call is using. Several simulations may share the arm; each call uses a working memory of its own.
    idle: Mutex<Vec<Memory>>,
}

/// Working memory of a call.
#[derive(Debug)]
pub struct Memory {
    /// Instance of the robot. Every call sets the held loads.
    pub robot: Robot,
    /// Operational space of the tips.
    pub task: TaskSpace,
    /// Current load of each hand, with its pose in the hand.
    held: [Option<(usize, Pose)>; HANDS_MAX],
    /// Jacobians of the tips, each 6 × number of joints of its chain.
    pub J: [Vec<f64>; HANDS_MAX],
    /// Joint positions (n).
    pub q: Vec<f64>,
    /// Joint rates (n).
    pub v: Vec<f64>,
    /// Joint forces (n).
    pub tau: Vec<f64>,
    /// Mass matrix (n × n).
    pub M: Vec<f64>,
}

/// Maximum number of hands of an [`Arm`].
pub const HANDS_MAX: usize = 2;
/// Maximum number of joints of a chain.
pub const JOINTS_MAX: usize = 8;

fn moves(hinge: &Hinge) -> bool {
    hinge.subhinges.iter().any(|s| s.kind.nv() > 0)
}

/// Returns the indices of the moving bodies between the base and a tip, base first; `None` if the tip does not exist.
pub(crate) fn chain(spec: &ModelSpec, base: &str, tip: &str) -> Option<Vec<usize>> {
    let bodies = spec.mechanism.bodies();
    let mut moving = Vec::new();
    let mut at = tip.to_owned();
    while let Some(k) = bodies.iter().position(|b| b.name == at && at != base) {
        if moves(&bodies[k].hinge) {
            moving.push(k);
        }
        at.clone_from(&bodies[k].parent);
    }
    moving.reverse();
    bodies.iter().any(|b| b.name == tip).then_some(moving)
}

impl Arm {
    /// Builds the chains from link `base` to the tips of `hands` in a description.
    ///
    /// # Errors
    /// Returns an error for an invalid file or unknown names, for joints that lie on no chain or on two chains, and for a load that is not physical.
    pub fn new(
        (file, check): (&RobotFile, InertiaCheck),
        base: &str,
        hands: &[Hand<'_>],
        armature: &[f64],
        loads: &[Load],
        gravity: Vec3,
    ) -> Result<Self, BuildError> {
        let fault = |e: &dyn std::fmt::Display, at: &str| BuildError::new(e.to_string()).at(at);
        let d = file.read(Root::Fixed, check)?;
        let mut spec = ModelSpec::from_description(&d).map_err(|e| fault(&e, "robot"))?;
        let found: Vec<Option<Vec<usize>>> =
            hands.iter().map(|h| chain(&spec, base, h.tip)).collect();
        let known: Option<Vec<Vec<usize>>> = found.iter().cloned().collect();
        if let Some(moving) = known.map(|k| k.concat()) {
            rotors(&mut spec, &moving, armature)?;
        }
        for (k, (hand, found)) in hands.iter().zip(&found).enumerate() {
            let point = format!("point of tool {k}");
            spec.mechanism.body(
                BodySpec::new(&*point, hand.tip)
                    .hinge_in_parent(Pose::new(Quat::identity(), hand.tool)),
            );
            // The error for an unknown tip should name the link of the parameter, not the internal tool body.
            let last = if found.is_some() { &point } else { hand.tip };
            spec.parts.push(PartSpec::chain(&format!("hand {k}"), base, last));
        }
        for load in loads {
            let inertia_com = Mat3::from_diagonal(&load.inertia);
            let check = Default::default();
            let mass = MassProperties { mass: load.mass, com: load.com, inertia_com, check };
            spec.objects.push(ObjectSpec { name: load.name.clone(), mass });
        }
        let model = RobotModel::new(&spec).map_err(|e| fault(&e, "robot"))?;
        let (mut chains, mut dofs) = (Vec::new(), Vec::<usize>::new());
        for (k, hand) in hands.iter().enumerate() {
            let no = || BuildError::new("the robot has no such chain").at(hand.at);
            let part = model.part(&format!("hand {k}")).ok_or_else(no)?;
            let own = model.dofs(part).map_err(|e| fault(&e, hand.at))?;
            if let Some(v) = own.iter().find(|v| dofs.contains(v)) {
                let fact = format!("joint {v} of the robot carries both hands");
                let help = "make this joint fixed in the file: the hands cannot share joints";
                return Err(BuildError::new(fact).help(help).at(hand.at));
            }
            dofs.extend(own);
            chains.push(part);
        }
        if dofs.len() != model.nv() {
            let (on, all) = (dofs.len(), model.nv());
            let tips: Vec<String> = hands.iter().map(|h| format!("`{}`", h.tip)).collect();
            let tips = tips.join(" or ");
            let fact = format!(
                "{on} of the robot's {all} joints lie between `{base}` and {tips}; the positions of the other joints are unknown"
            );
            let help = "name another base and tip, or fix the other joints in the file";
            return Err(BuildError::new(fact).help(help).at(hands[0].at));
        }
        for (part, hand) in chains.iter().zip(hands) {
            let joints = model.dofs(*part).map_err(|e| fault(&e, hand.at))?.len();
            if joints < 6 || model.nq() != model.nv() {
                let fact = format!(
                    "a chain of {joints} joints cannot control position and attitude of its tip"
                );
                let help = "a chain needs at least six joints with one coordinate each";
                return Err(BuildError::new(fact).help(help).at(hand.at));
            }
            if joints > JOINTS_MAX {
                let fact = format!("a chain of {joints} joints is not supported");
                return Err(BuildError::new(fact).help("at most eight joints").at(hand.at));
            }
        }
        let mut limits = vec![Limits::NONE; dofs.len()];
        for (_, s) in model.multibody().subhinges() {
            if s.v.len() == 1 {
                limits[s.v.start] = s.subhinge.limits;
            }
        }
        let loads = loads.iter().filter_map(|l| model.object(&l.name)).collect();
        let arm = Self { model, chains, dofs, loads, limits, gravity, idle: Mutex::default() };
        let memory = arm.memory().map_err(|e| fault(&e, "robot"))?;
        arm.give_back(memory);
        Ok(arm)
    }

    /// Returns the number of joints of all hands.
    #[must_use]
    pub fn joints(&self) -> usize {
        self.dofs.len()
    }

    /// Returns the number of joints of a hand.
    pub fn joints_of(&self, hand: usize) -> usize {
        self.model.dofs(self.chains[hand]).map_or(0, <[usize]>::len)
    }

    fn memory(&self) -> Result<Memory, linkwork_embedded::RobotError> {
        let mut robot = Robot::new(&self.model);
        robot.set_gravity(self.gravity)?;
        let task = TaskSpace::new(&robot, &self.chains)?;
        let n = self.joints();
        let zeros = || vec![0.0; n];
        let (q, v, tau) = (zeros(), zeros(), zeros());
        let rows = |k: usize| if k < self.chains.len() { 6 * self.joints_of(k) } else { 0 };
        let J = std::array::from_fn(|k| vec![0.0; rows(k)]);
        Ok(Memory { robot, task, held: [None; HANDS_MAX], J, q, v, tau, M: vec![0.0; n * n] })
    }

    /// Returns working memory with the given joint state (angle and rate of each joint, hand by hand, base to tip) and the load of each hand with its
    /// pose there. If both hands name one load, they hold it together. Returns `None` for non-finite joint values. Results do not depend on earlier
    /// uses of the memory.
    pub fn at(&self, joints: &[f64], held: [Option<(usize, Pose)>; HANDS_MAX]) -> Option<Memory> {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut m = match idle {
            Some(m) => m,
            None => self.memory().ok()?,
        };
        for (pair, k) in joints.chunks_exact(2).zip(&self.dofs) {
            (m.q[*k], m.v[*k]) = (pair[0], pair[1]);
        }
        let set = m.robot.set_q(&m.q).is_ok() && m.v.iter().all(|v| v.is_finite());
        // The grasp of the second hand depends on the joint positions, so an object in both hands must be attached again at each call.
        let twice = |held: &[Option<(usize, Pose)>; HANDS_MAX]| match held {
            [Some(a), Some(b)] => a.0 == b.0,
            _ => false,
        };
        if set && (m.held != held || twice(&held)) {
            for k in 0..m.held.len() {
                let object = m.held[k].take().and_then(|(k, _)| self.loads.get(k));
                if let Some(object) = object
                    && m.robot.hold(*object).ok()?.is_some()
                {
                    m.robot.ungrasp(*object).ok()?;
                }
            }
            for (k, hold) in held.iter().enumerate() {
                let Some((load, X)) = hold else { continue };
                let Some(object) = self.loads.get(*load) else { continue };
                let grasp = match k > 0 && twice(&held) {
                    true => linkwork_embedded::Grasp::Here,
                    false => linkwork_embedded::Grasp::At(*X),
                };
                m.robot.grasp(self.chains[k], *object, grasp).ok()?;
            }
            m.held = held;
        }
        if set {
            return Some(m);
        }
        self.give_back(m);
        None
    }

    /// Returns the pose of a hand's tip and its velocity [ω; v] at its origin, base axes; `None` for non-finite rates.
    pub fn tip(&self, m: &mut Memory, hand: usize) -> Option<(Pose, [f64; 6])> {
        let part = self.chains[hand];
        let X = m.robot.tip_pose(part).ok()?;
        m.robot.jacobian(part, &mut m.J[hand]).ok()?;
        let own = self.model.dofs(part).ok()?;
        let mut V = [0.0; 6];
        for (V, row) in V.iter_mut().zip(m.J[hand].chunks_exact(own.len())) {
            *V = row.iter().zip(own).map(|(j, k)| j * m.v[*k]).sum();
        }
        Some((X, V))
    }

    /// Returns working memory to the pool after a call.
    pub fn give_back(&self, memory: Memory) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(memory);
    }
}

/// Adds the rotor inertias to the joints.
fn rotors(spec: &mut ModelSpec, moving: &[usize], armature: &[f64]) -> Result<(), BuildError> {
    if !armature.is_empty() && armature.len() != moving.len() {
        let fact = format!("`armature` has {} numbers for {} joints", armature.len(), moving.len());
        let help = "write one value for each joint, from base to tip";
        return Err(BuildError::new(fact).help(help).at("armature"));
    }
    if let Some(bad) = armature.iter().find(|a| !(a.is_finite() && **a >= 0.0)) {
        let fact = format!("`armature` contains {bad} kg m²");
        return Err(BuildError::new(fact).help("write values of 0 or more").at("armature"));
    }
    for (k, a) in moving.iter().zip(armature) {
        let hinge = &mut spec.mechanism.bodies_mut()[*k].hinge;
        *hinge = hinge.clone().armature(*a);
    }
    Ok(())
}
