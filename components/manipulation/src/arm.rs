//! The arm that a controller knows: a chain of a URDF file, and what its hand may hold.

use linkwork_embedded::formats::{ReadOptions, Root, read_text};
use linkwork_embedded::multibody::{BodySpec, Hinge, Limits};
use linkwork_embedded::{
    ModelSpec, Object, ObjectSpec, Part, PartSpec, Robot, RobotModel, TaskSpace,
};
use linkwork_runtime::prelude::*;
use linkwork_runtime::{Located, Param, ParamSpec, ReadCx, Value};
use linkwork_spatial::{MassProperties, Mat3, Pose};
use std::sync::{Arc, Mutex, PoisonError};

/// A robot description (URDF) as a parameter: the name of a file, or (name, text) with the text in place.
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
            Value::Text(name) => Some(Self::new(name, &cx.text(name, v.origin)?)),
            Value::Map(_) => {
                if let (Some(name), Some(text)) = (word("name"), word("text")) {
                    return Some(Self::new(&name, &text));
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

/// The arm: constant.
#[derive(Debug)]
pub struct Arm {
    /// The embedded model.
    pub model: Arc<RobotModel>,
    /// The chain that moves.
    pub chain: Part,
    /// What it may hold, in the order of the parameter.
    pub loads: Vec<Object>,
    /// Of each joint: least and greatest position (rad or m), greatest rate, greatest effort (N m or N).
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
    /// The operational space of its tip.
    pub task: TaskSpace,
    /// The load that it holds now.
    held: Option<usize>,
    /// Jacobian of the tip (6 × n).
    pub J: Vec<f64>,
    /// Positions, rates and forces (n).
    pub q: Vec<f64>,
    /// Rates.
    pub v: Vec<f64>,
    /// Forces.
    pub tau: Vec<f64>,
}

fn moves(hinge: &Hinge) -> bool {
    hinge.subhinges.iter().any(|s| s.kind.nv() > 0)
}

impl Arm {
    /// The chain from link `base` to link `tip` of a description, with the tip's origin at `tool` in that link's frame.
    ///
    /// # Errors
    /// What is wrong with the file or the names; joints that are not on the chain; a load that is not physical.
    pub fn new(
        file: &RobotFile,
        [base, tip]: [&str; 2],
        tool: Vec3,
        armature: &[f64],
        loads: &[Load],
        gravity: Vec3,
    ) -> Result<Self, BuildError> {
        let options = ReadOptions { root: Root::Fixed, ..ReadOptions::default() };
        let options = options.at(&file.name);
        let fault = |e: &dyn std::fmt::Display, at: &str| BuildError::new(e.to_string()).at(at);
        let d = read_text(&file.text, &options).map_err(|e| fault(&e, "robot"))?;
        let mut spec = ModelSpec::from_description(&d).map_err(|e| fault(&e, "robot"))?;
        let mut moving = Vec::new();
        let mut at = tip.to_owned();
        while let Some(k) = spec.mechanism.bodies().iter().position(|b| b.name == at && at != base)
        {
            let body = &spec.mechanism.bodies()[k];
            if moves(&body.hinge) {
                moving.push(k);
            }
            at.clone_from(&body.parent);
        }
        moving.reverse();
        let known = spec.mechanism.bodies().iter().any(|b| b.name == tip);
        if known && !armature.is_empty() && armature.len() != moving.len() {
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
        let point = BodySpec::new("point of the tool", tip)
            .hinge_in_parent(Pose::new(Quat::identity(), tool));
        spec.mechanism.body(point);
        // A tip that is not there is told by its own name.
        let last = if known { "point of the tool" } else { tip };
        spec.parts.push(PartSpec::chain("arm", base, last));
        for load in loads {
            let inertia_com = Mat3::from_diagonal(&load.inertia);
            let check = Default::default();
            let mass = MassProperties { mass: load.mass, com: load.com, inertia_com, check };
            spec.objects.push(ObjectSpec { name: load.name.clone(), mass });
        }
        let model = RobotModel::new(&spec).map_err(|e| fault(&e, "robot"))?;
        let no = || BuildError::new("the robot has no such chain").at("tip");
        let chain = model.part("arm").ok_or_else(no)?;
        let dofs = model.dofs(chain).map_err(|e| fault(&e, "tip"))?;
        if dofs.len() != model.nv() {
            let (on, all) = (dofs.len(), model.nv());
            let fact = format!(
                "{on} of the robot's {all} joints lie between `{base}` and `{tip}`: where the others are is not known"
            );
            let help = "name another base and tip, or fix the other joints in the file";
            return Err(BuildError::new(fact).help(help).at("tip"));
        }
        if dofs.len() < 6 || model.nq() != model.nv() {
            let fact = format!(
                "a chain of {} joints cannot bring its tip to any pose near it",
                dofs.len()
            );
            let help = "six joints with one coordinate each are the least";
            return Err(BuildError::new(fact).help(help).at("tip"));
        }
        let mut limits = vec![Limits::NONE; dofs.len()];
        for (_, s) in model.multibody().subhinges() {
            if s.v.len() == 1 {
                limits[s.v.start] = s.subhinge.limits;
            }
        }
        let loads = loads.iter().filter_map(|l| model.object(&l.name)).collect();
        let arm = Self { model, chain, loads, limits, gravity, idle: Mutex::default() };
        let memory = arm.memory().map_err(|e| fault(&e, "robot"))?;
        arm.give_back(memory);
        Ok(arm)
    }

    /// Number of joints.
    #[must_use]
    pub fn joints(&self) -> usize {
        self.limits.len()
    }

    fn memory(&self) -> Result<Memory, linkwork_embedded::RobotError> {
        let mut robot = Robot::new(&self.model);
        robot.set_gravity(self.gravity)?;
        let task = TaskSpace::new(&robot, &[self.chain])?;
        let n = self.joints();
        let zeros = || vec![0.0; n];
        let (q, v, tau) = (zeros(), zeros(), zeros());
        Ok(Memory { robot, task, held: None, J: vec![0.0; 6 * n], q, v, tau })
    }

    /// Memory of a call, with these joints and this load; `None` for joints that are not finite. Bits do not depend
    /// on who used it before.
    pub fn at(&self, joints: &[f64], load: Option<usize>) -> Option<Memory> {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut m = match idle {
            Some(m) => m,
            None => self.memory().ok()?,
        };
        for (k, pair) in joints.chunks_exact(2).enumerate() {
            (m.q[k], m.v[k]) = (pair[0], pair[1]);
        }
        let set = m.robot.set_q(&m.q).is_ok() && m.v.iter().all(|v| v.is_finite());
        if set && m.held != load {
            if let Some(object) = m.held.and_then(|k| self.loads.get(k)) {
                m.robot.ungrasp(*object).ok()?;
            }
            if let Some(object) = load.and_then(|k| self.loads.get(k)) {
                let here = linkwork_embedded::Grasp::At(Pose::identity());
                m.robot.grasp(self.chain, *object, here).ok()?;
            }
            m.held = load;
        }
        if set {
            return Some(m);
        }
        self.give_back(m);
        None
    }

    /// Memory that a call needs no more.
    pub fn give_back(&self, memory: Memory) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(memory);
    }
}
