//! The arm that a controller knows, or two: chains of a URDF file, and what their hands may hold.

use linkwork_embedded::formats::{Description, ReadOptions, Root, Unphysical, read_text};
use linkwork_embedded::multibody::{BodySpec, Hinge, Limits};
use linkwork_embedded::{
    ModelSpec, Object, ObjectSpec, Part, PartSpec, Robot, RobotModel, TaskSpace,
};
use linkwork_runtime::prelude::*;
use linkwork_runtime::{Located, Param, ParamSpec, ReadCx, Value};
use linkwork_spatial::{MassProperties, Mat3, Pose};
use std::sync::{Arc, Mutex, PoisonError};

/// What becomes of moments of inertia that no body has: files of many robots have some.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum InertiaCheck {
    /// They are read, with a warning that names link and numbers.
    Warn,
    /// They are refused.
    Physical,
}

/// A robot description (URDF) as a parameter: the name of a file, or (name, text) with the text in place. Moments of inertia in it that no body has are a warning.
#[derive(Clone, Debug)]
pub struct RobotFile {
    name: String,
    text: Arc<str>,
}

impl RobotFile {
    /// From a text; it is read when a controller is made of it.
    #[must_use]
    pub fn new(name: &str, text: &str) -> Self {
        Self { name: name.into(), text: text.into() }
    }

    /// The description that it is, with its roots held so.
    ///
    /// # Errors
    /// What is wrong with it; moments that no body has where they are to be refused.
    pub fn read(&self, root: Root, check: InertiaCheck) -> Result<Description, BuildError> {
        let unphysical = match check {
            InertiaCheck::Warn => Unphysical::Read,
            InertiaCheck::Physical => Unphysical::Refused,
        };
        let options = ReadOptions { root, unphysical, ..ReadOptions::default() };
        let read = read_text(&self.text, &options.at(&self.name));
        read.map_err(|e| BuildError::new(e.to_string()).at("robot"))
    }

    /// The same with a warning for what is read though no body has it. What cannot be read is told when a controller is made of it.
    fn told(self, v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Self {
        if let Ok(d) = self.read(Root::AsWritten, InertiaCheck::Warn)
            && !d.doubtful.is_empty()
        {
            let lines: Vec<String> = d.doubtful.iter().map(ToString::to_string).collect();
            let (path, param, name, lines) =
                (&cx.path, &spec.name, &self.name, lines.join("\n    "));
            let fact = format!(
                "`{path}.{param}`: `{name}` has mass properties that no body has:\n    {lines}"
            );
            let help = "correct the file; `inertia_check: Physical` refuses it";
            cx.warn(v.origin, fact, Some(help.into()));
        }
        self
    }
}

impl Param for RobotFile {
    fn kind() -> String {
        "name of a URDF file, or (name, text)".into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Self> {
        let word = |key: &str| match v.get(key).map(|l| &l.value) {
            Some(Value::Text(t)) => Some(t.clone()),
            _ => None,
        };
        let help = "write the name of a file, or (name: \"…\", text: \"…\")";
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
                let fact = format!("`{path}.{name}` is the name of a file, this is {what}");
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

/// Something that the hand may hold, as the controller believes it to be.
#[derive(Params, Clone, Debug)]
pub struct Load {
    /// Its name; moves say `holds: "name"`.
    pub name: String,
    /// Mass.
    #[param(unit = "kg", range = 0.0..)]
    pub mass: f64,
    /// Centre of mass, tip's axes from the tip's origin.
    #[param(unit = "m", default = Vec3::zeros())]
    pub com: Vec3,
    /// Moments of inertia about the centre of mass, along the tip's axes.
    #[param(unit = "kg m^2", default = Vec3::zeros())]
    pub inertia: Vec3,
}

impl Load {
    /// The place of the load that a move names.
    ///
    /// # Errors
    /// A name that no load has.
    pub fn find(
        loads: &[Load],
        name: Option<&str>,
        of_move: &str,
    ) -> Result<Option<usize>, BuildError> {
        let Some(name) = name else { return Ok(None) };
        let found = loads.iter().position(|l| l.name == name);
        found.map(Some).ok_or_else(|| {
            let known: Vec<&str> = loads.iter().map(|l| l.name.as_str()).collect();
            let fact = format!("move `{of_move}` holds `{name}`, which is no load");
            BuildError::new(fact).help(format!("loads: {}", known.join(", "))).at("moves")
        })
    }
}

/// One hand: where its chain ends, and the parameter that says so.
#[derive(Clone, Copy, Debug)]
pub struct Hand<'a> {
    /// Name of the parameter with the tip's link, for messages.
    pub at: &'static str,
    /// Link whose frame is the tip.
    pub tip: &'a str,
    /// The tip's origin in that link's frame, m.
    pub tool: Vec3,
}

/// An arm, or several on one base: constant.
#[derive(Debug)]
pub struct Arm {
    /// The embedded model.
    pub model: Arc<RobotModel>,
    /// The chains that move, hand by hand; no joint is in two of them.
    pub chains: Vec<Part>,
    /// Places in the model's β of all joints: hand by hand, base to tip.
    pub dofs: Vec<usize>,
    /// What hands may hold, in the order of the parameter.
    pub loads: Vec<Object>,
    /// By place in β: least and greatest position (rad or m), greatest rate, greatest effort (N m or N).
    pub limits: Vec<Limits>,
    gravity: Vec3,
    /// Memory that no call is using: any number of simulations share the arm, each call takes one.
    idle: Mutex<Vec<Memory>>,
}

/// What a call computes in.
#[derive(Debug)]
pub struct Memory {
    /// An instance of the robot. What it holds is set by every call anew.
    pub robot: Robot,
    /// The operational space of its tips.
    pub task: TaskSpace,
    /// The load of each hand now, with its pose there.
    held: [Option<(usize, Pose)>; HANDS_MAX],
    /// Jacobians of the tips, each 6 × the joints of its chain.
    pub J: [Vec<f64>; HANDS_MAX],
    /// Positions, rates and forces (n).
    pub q: Vec<f64>,
    /// Rates.
    pub v: Vec<f64>,
    /// Forces.
    pub tau: Vec<f64>,
    /// Mass matrix (n × n).
    pub M: Vec<f64>,
}

/// Hands of an [`Arm`] at most.
pub const HANDS_MAX: usize = 2;
/// Joints of a chain at most.
pub const JOINTS_MAX: usize = 8;

fn moves(hinge: &Hinge) -> bool {
    hinge.subhinges.iter().any(|s| s.kind.nv() > 0)
}

/// The moving bodies from a tip inboard to the base, base first; `None` for a tip that is not there.
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
    /// The chains from link `base` to the tips of `hands` in a description.
    ///
    /// # Errors
    /// What is wrong with the file or the names; joints that are on no chain or on two; a load that is not physical.
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
            // A tip that is not there is told by its own name.
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
                let help = "fix it in the file: each hand moves by joints of its own";
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
                "{on} of the robot's {all} joints lie between `{base}` and {tips}: where the others are is not known"
            );
            let help = "name another base and tip, or fix the other joints in the file";
            return Err(BuildError::new(fact).help(help).at(hands[0].at));
        }
        for (part, hand) in chains.iter().zip(hands) {
            let joints = model.dofs(*part).map_err(|e| fault(&e, hand.at))?.len();
            if joints < 6 || model.nq() != model.nv() {
                let fact =
                    format!("a chain of {joints} joints cannot bring its tip to any pose near it");
                let help = "six joints with one coordinate each are the least";
                return Err(BuildError::new(fact).help(help).at(hand.at));
            }
            if joints > JOINTS_MAX {
                let fact = format!("{joints} joints are too many for one chain");
                return Err(BuildError::new(fact).help("eight at most").at(hand.at));
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

    /// Number of joints of all hands.
    #[must_use]
    pub fn joints(&self) -> usize {
        self.dofs.len()
    }

    /// Number of joints of each hand.
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

    /// Memory of a call, with these joints (angle and rate of each, hand by hand, base to tip), and what each hand holds, with its
    /// pose there; both hands hold a load that both name. `None` for joints that are not finite. Bits do not depend on who used it before.
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
        // The second hand's grasp of an object follows its joints, so that it is taken anew.
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

    /// Pose of a hand's tip, and its velocity [ω; v] at its origin, base axes; `None` for rates that are no numbers.
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

    /// Memory that a call needs no more.
    pub fn give_back(&self, memory: Memory) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(memory);
    }
}

/// Inertias of rotors onto the joints.
fn rotors(spec: &mut ModelSpec, moving: &[usize], armature: &[f64]) -> Result<(), BuildError> {
    if !armature.is_empty() && armature.len() != moving.len() {
        let fact = format!("{} numbers for {} joints", armature.len(), moving.len());
        let help = "write one for each, base to tip";
        return Err(BuildError::new(fact).help(help).at("armature"));
    }
    if let Some(bad) = armature.iter().find(|a| !(a.is_finite() && **a >= 0.0)) {
        let fact = format!("an inertia of {bad} kg m²");
        return Err(BuildError::new(fact).help("0 or more").at("armature"));
    }
    for (k, a) in moving.iter().zip(armature) {
        let hinge = &mut spec.mechanism.bodies_mut()[*k].hinge;
        *hinge = hinge.clone().armature(*a);
    }
    Ok(())
}
