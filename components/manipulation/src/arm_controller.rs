//! `manipulation.arm_controller`: carries out a programme of moves of an arm's tip, by an embedded model of the arm.
//! ```text
//! e = [log(R_r Rᵀ); p_r − p],  ė = V_r − J v                              base axes; r: the wanted pose (`moves`)
//! tracking     a = A_r + 2 ω ė + ω² e + Λ⁻¹ f
//! compliant    a = A_r + Λ⁻¹ (K e + D ė + f),    D_ii = 2 √(K_ii/(Λ⁻¹)_ii)
//! torque       τ = Jᵀ Λ (a − J̇ v) + C v + g       with what the hand holds; more than six joints: Nᵀ τ₀ beside it, τ₀ = −2 ω M_kk v_k
//! ```
//! Source: O. Khatib, IEEE J. Robotics and Automation 3 (1987) 43. ω is `bandwidth`, f the move's force and moment. Where the tip cannot
//! move independently in six directions (a singular pose), the arm holds itself against gravity, damped, and `singular` says so.
//!
//! A compliant tip that is fed has no spring along `feed`: e is taken across it. A move ends when its time is over and the tip has
//! arrived, or when it feels the touch or comes to the depth that it was to. When it does not arrive, feels nothing or does not come
//! to its depth within `patience`, `failed` is set and the arm stays there. After the last move it holds its pose, and `done` is set.
//! The work is looked at when a move begins: its moves go to where it is seen, with the noise `work_noise`.

use crate::arm::{Arm, Hand, InertiaCheck, Load, Memory, RobotFile};
use crate::moves::{Move, Path, Reference};
use crate::programme::{Follower, Met, Place, look};
use crate::tracking::{Now, norm};
use linkwork_runtime::prelude::*;
use linkwork_spatial::Pose;

/// The robot, its programme, and how it is controlled.
#[derive(Params, Clone, Debug)]
pub struct ArmParams {
    /// Description of the robot as the controller believes it to be; masses and limits of its joints come from there.
    pub robot: RobotFile,
    /// Moments of inertia in it that no body has: `Warn` reads them with a warning, `Physical` refuses them.
    #[param(default = InertiaCheck::Warn)]
    pub inertia_check: InertiaCheck,
    /// Link that carries the arm, or `world`: the base.
    #[param(default = "world".to_string())]
    pub base: String,
    /// Link whose frame is the tip.
    pub tip: String,
    /// The tip's origin in that frame: a tool's point. Its axes are those of the link.
    #[param(unit = "m", default = Vec3::zeros())]
    pub tool: Vec3,
    /// Inertia of each joint's rotor seen at the joint (gear² times its own), base to tip, which a URDF file cannot say; default: zeros.
    #[param(unit = "kg m^2", default = Vec::new())]
    pub armature: Vec<f64>,
    /// What is done, in turn.
    pub moves: Vec<Move>,
    /// What the hand may hold.
    #[param(default = Vec::new())]
    pub loads: Vec<Load>,
    /// Where the controller believes the work's origin to be, in the base.
    #[param(unit = "m", default = Vec3::zeros())]
    pub work_position: Vec3,
    /// Roll, pitch, yaw of the work in the base.
    #[param(unit = "rad", default = Vec3::zeros())]
    pub work_rpy: Vec3,
    /// Standard deviation, on each axis, of where the work is seen about `work_position`: it is looked at anew when a move begins.
    #[param(unit = "m", default = 0.0, range = 0.0..)]
    pub work_noise: f64,
    /// Acceleration of free fall that it believes, the base's axes. Default: from the simulation's gravity at the origin of W, for a base whose axes are those of W; without gravity, none.
    #[param(unit = "m/s^2")]
    pub gravity: Option<Vec3>,
    /// Gravity of the simulation.
    #[param(service)]
    pub field: Option<Handle<dyn Gravity>>,
    /// Natural frequency with which errors go away when it tracks.
    #[param(unit = "rad/s", default = 30.0, range = 1e-3..)]
    pub bandwidth: f64,
    /// It has arrived when the tip is this near.
    #[param(unit = "m", default = 1e-3, range = 1e-9..)]
    pub tolerance: f64,
    /// And turned no more than this.
    #[param(unit = "rad", default = 5e-3, range = 1e-9..)]
    pub tolerance_angle: f64,
    /// How long after the duration of a move the tip may take to arrive.
    #[param(unit = "s", default = 5.0, range = 0.0..)]
    pub patience: f64,
    /// Positions of the joints at the start, base to tip: with them every move is followed before the run, and one that ends out of
    /// reach, or on whose way a joint comes to its limits of position or rate, is refused. Default: nothing is looked at.
    #[param(unit = "rad", default = Vec::new())]
    pub ready: Vec<f64>,
}

/// What a joint's encoder shows.
#[derive(Ports, Clone, Copy, Debug)]
pub struct JointIn {
    /// Angle.
    #[port("rad")]
    pub angle: f64,
    /// Rate.
    #[port("rad/s")]
    pub rate: f64,
}

/// What a joint's drive is told.
#[derive(Ports, Clone, Copy, Debug)]
pub struct JointOut {
    /// Torque.
    #[port("N m")]
    pub torque: f64,
}

/// How it goes.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ArmOut {
    /// Which move is under way, from 0.
    #[port("1")]
    pub index: f64,
    /// The gripper is to be closed.
    #[port("1")]
    pub grip: bool,
    /// All moves are done.
    #[port("1")]
    pub done: bool,
    /// A move did not arrive, or not feel what it was to; the arm stays where it was to be.
    #[port("1")]
    pub failed: bool,
    /// The tip cannot move independently in six directions here.
    #[port("1")]
    pub singular: bool,
    /// A torque was cut to what its joint can do.
    #[port("1")]
    pub limited: bool,
    /// Distance of the tip from where it is to be.
    #[port("m")]
    pub error: f64,
    /// Angle between the tip and what it is to be.
    #[port("rad")]
    pub error_angle: f64,
    /// Force with which a compliant tip pushes: spring, damper and the move's own force; zero while it tracks.
    #[port("N")]
    pub push: f64,
    /// The tip, by the embedded model, base axes.
    #[port("m")]
    pub tip: Vec3,
    /// Where it is to be.
    #[port("m")]
    pub wanted: Vec3,
}

/// Discrete state.
#[derive(State, Clone, Copy, Debug)]
pub struct Progress {
    /// A first sample has been taken.
    #[port("1")]
    pub begun: bool,
    /// The move under way.
    #[port("1")]
    pub index: f64,
    /// Time since it began.
    #[port("s")]
    pub elapsed: f64,
    /// Where it began: position.
    #[port("m")]
    pub position: Vec3,
    /// Where it began: attitude.
    #[port]
    pub rotation: Quat,
    /// All moves are done.
    #[port("1")]
    pub done: bool,
    /// A move did not arrive.
    #[port("1")]
    pub failed: bool,
    /// How far beside `work_position` the work was seen when the move began, base axes.
    #[port("m")]
    pub seen: Vec3,
}

struct Step {
    path: Path,
    stiffness: Option<[f64; 2]>,
    touch: Option<f64>,
    depth: Option<f64>,
    load: Option<usize>,
    grip: bool,
    arrive: bool,
}

/// An arm that carries out moves.
pub struct ArmController {
    p: ArmParams,
    arm: Arm,
    steps: Vec<Step>,
}

impl ArmController {
    fn arm(p: &ArmParams) -> Result<Arm, BuildError> {
        let hand = Hand { at: "tip", tip: &p.tip, tool: p.tool };
        Arm::new(
            (&p.robot, p.inertia_check),
            &p.base,
            &[hand],
            &p.armature,
            &p.loads,
            crate::believed(p.gravity, p.field.as_ref()),
        )
    }

    fn step(&self, d: &Progress) -> &Step {
        &self.steps[(d.index as usize).min(self.steps.len() - 1)]
    }

    /// Memory for joints, with what the hand holds.
    fn memory(&self, joints: &[f64], step: &Step) -> Option<Memory> {
        self.arm.at(joints, [step.load.map(|k| (k, Pose::identity())), None])
    }

    /// The wanted pose, and how far the tip is from it; `None` for joints that are no numbers.
    fn now(&self, d: &Progress, m: &mut Memory) -> Option<Now> {
        let (X, V) = self.arm.tip(m, 0)?;
        let from = Pose::new(d.rotation, d.position);
        let wanted = match (d.begun, d.done || d.failed) {
            (false, _) => Reference::still(X),
            (true, true) => Reference::still(from),
            (true, false) => self.step(d).path.seen(&d.seen).at(&from, d.elapsed),
        };
        Some(Now::new(wanted, &X, &V))
    }

    /// Torques into `m.tau`; returns the force that a compliant tip pushes with (N), or `None` in a singular pose.
    fn torques(&self, d: &Progress, m: &mut Memory, now: &Now) -> Option<f64> {
        let step = self.step(d);
        let Memory { robot, task, v, tau, q, M, .. } = m;
        let compliance = task.compliance(robot).ok()?;
        let f = now.push(&step.path, step.stiffness, |k| compliance[7 * k]);
        let w = self.p.bandwidth;
        let mut a = now.acceleration(step.stiffness.is_none().then_some(w));
        for (k, a) in a.iter_mut().enumerate() {
            *a += (0..6).map(|j| compliance[6 * k + j] * f[j]).sum::<f64>();
        }
        let redundant = v.len() > 6;
        if redundant {
            // The room of q is free: the robot has its own copy.
            damping(robot, w, v, M, q)?;
        }
        task.forces(robot, v, &a, redundant.then_some(&q[..]), tau).ok()?;
        Some(if step.stiffness.is_some() { norm(&f[3..]) } else { 0.0 })
    }

    /// Holds the arm against gravity, damped.
    fn hold(&self, m: &mut Memory) -> Option<()> {
        let Memory { robot, v, tau, q, M, .. } = m;
        damping(robot, self.p.bandwidth, v, M, q)?;
        robot.gravity_forces(tau).ok()?;
        tau.iter_mut().zip(&*q).for_each(|(t, x)| *t += x);
        Some(())
    }
}

/// −2 ω M_kk v_k into `out`; M (n × n) is room.
pub(crate) fn damping(
    robot: &mut linkwork_embedded::Robot,
    w: f64,
    v: &[f64],
    M: &mut [f64],
    out: &mut [f64],
) -> Option<()> {
    let n = v.len();
    robot.mass_matrix(M).ok()?;
    for k in 0..n {
        out[k] = -2.0 * w * M[k * n + k] * v[k];
    }
    Some(())
}

/// Carries out moves of an arm's tip by an embedded model of the arm: tracking or compliant, with what the hand holds.
#[model("manipulation.arm_controller")]
impl SizedModel for ArmController {
    type Params = ArmParams;

    fn ports(p: &ArmParams) -> SizedPorts {
        // A description that makes no arm is refused when the part is built.
        let joints = Self::arm(p).map_or(0, |arm| arm.joints());
        let group = |k: usize| format!("joints[{k}]");
        let inputs = (0..joints).flat_map(|k| PortSpec::group::<JointIn>(group(k), "Encoder"));
        let torques = (0..joints).flat_map(|k| PortSpec::group::<JointOut>(group(k), "Drive"));
        SizedPorts {
            feedthrough_inputs: inputs.collect(),
            feedthrough_outputs: torques.chain(ArmOut::specs()).collect(),
            discrete: Progress::specs(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(mut p: ArmParams) -> Result<Self, BuildError> {
        p.gravity = Some(crate::believed(p.gravity, p.field.as_ref()));
        let arm = Self::arm(&p)?;
        if p.moves.is_empty() {
            let help = "write one at least, such as (name: \"stay\", duration: \"1 s\")";
            return Err(BuildError::new("there is no move").help(help).at("moves"));
        }
        let a = p.work_rpy;
        let work = Pose::new(Quat::from_euler_angles(a.x, a.y, a.z), p.work_position);
        let mut steps = Vec::with_capacity(p.moves.len());
        for m in &p.moves {
            let load = Load::find(&p.loads, m.holds.as_deref(), &m.name)?;
            let path = Path::new(m, &work)?;
            let (stiffness, touch, depth, grip) = (m.stiffness, m.touch, m.depth, m.grip);
            steps.push(Step { path, stiffness, touch, depth, load, grip, arrive: m.arrive });
        }
        let controller = ArmController { p, arm, steps };
        controller.reachable()?;
        Ok(controller)
    }

    fn initial(&self, _: &mut [f64], d: &mut [f64]) {
        Progress {
            begun: false,
            index: 0.0,
            elapsed: 0.0,
            position: Vec3::zeros(),
            rotation: Quat::identity(),
            done: false,
            failed: false,
            seen: Vec3::zeros(),
        }
        .put(d);
    }

    fn feedthrough(&self, d: &[f64], u: &[f64], y: &mut [f64]) {
        let d = Progress::get(d);
        let step = self.step(&d);
        let n = self.arm.joints();
        // Joints that are no numbers give torques that are none, at which the run stops.
        y.fill(f64::NAN);
        let Some(mut m) = self.memory(u, step) else { return };
        if let Some(now) = self.now(&d, &mut m) {
            let push = self.torques(&d, &mut m, &now);
            if push.is_none() && self.hold(&mut m).is_none() {
                return self.arm.give_back(m);
            }
            let mut limited = false;
            for (y, k) in y.iter_mut().zip(&self.arm.dofs) {
                let (tau, most) = (m.tau[*k], self.arm.limits[*k].effort);
                limited |= tau.abs() > most;
                *y = tau.clamp(-most, most);
            }
            let wanted = now.wanted.X.position;
            ArmOut {
                index: d.index,
                grip: step.grip,
                done: d.done,
                failed: d.failed,
                singular: push.is_none(),
                limited,
                error: norm(&now.e[3..]),
                error_angle: norm(&now.e[..3]),
                push: push.unwrap_or(0.0),
                tip: wanted - now.way(),
                wanted,
            }
            .put(&mut y[n..]);
        }
        self.arm.give_back(m);
    }

    fn update(&self, clock: &Clock, d: &mut [f64], u: &[f64]) {
        let mut p = Progress::get(d);
        let step = self.step(&p);
        let Some(mut m) = self.memory(u, step) else { return };
        if let Some(now) = self.now(&p, &mut m) {
            let mut X = now.wanted.X;
            // What is fed stands where it got to.
            let gone = step.path.feed.map(|n| -n.dot(&now.way()));
            if let (Some(n), Some(gone)) = (step.path.feed, gone) {
                X.position += n * gone;
            }
            let felt = step.touch.is_some_and(|most| {
                let compliance = m.task.compliance(&mut m.robot);
                compliance.is_ok_and(|A| {
                    norm(&now.push(&step.path, step.stiffness, |k| A[7 * k])[3..]) > most
                })
            });
            let deep = gone.zip(step.depth).is_some_and(|(gone, depth)| gone >= depth);
            let met = Met {
                duration: step.path.duration(),
                near: norm(&now.e[3..]) <= self.p.tolerance
                    && norm(&now.e[..3]) <= self.p.tolerance_angle,
                arrive: step.arrive,
                waits: step.touch.is_some() || step.depth.is_some(),
                ended: felt || deep,
            };
            let Progress { begun, index, elapsed, done, failed, .. } = p;
            let mut place = Place { begun, index, elapsed, done, failed };
            if place.sample(&met, self.steps.len(), self.p.patience, clock.dt) {
                (p.position, p.rotation) = (X.position, X.rotation);
                p.seen = look(clock, self.p.work_noise);
            }
            (p.begun, p.index, p.elapsed) = (place.begun, place.index, place.elapsed);
            (p.done, p.failed) = (place.done, place.failed);
            p.put(d);
        }
        self.arm.give_back(m);
    }
}

impl ArmController {
    /// That every move can be followed within the limits of the joints, beginning at `ready`.
    fn reachable(&self) -> Result<(), BuildError> {
        if self.p.ready.is_empty() {
            return Ok(());
        }
        let mut follower = Follower::new(&self.arm, &self.p.ready)?;
        let mut from = follower.tip(0)?;
        for (m, step) in self.p.moves.iter().zip(&self.steps) {
            let path = &step.path;
            follower.follow(&m.name, path.duration(), |_, t| Some(path.at(&from, t).X))?;
            from = path.at(&from, path.duration()).X;
        }
        Ok(())
    }
}

#[cfg(test)]
#[path = "arm_controller_tests.rs"]
mod tests;
