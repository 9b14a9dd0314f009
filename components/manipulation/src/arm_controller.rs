//! `manipulation.arm_controller`: executes a sequence of moves of an arm's tip with an embedded model of the arm.
//! ```text
//! e = [log(R_r Rᵀ); p_r − p],  ė = V_r − J v                              base axes; r: the commanded pose (`moves`)
//! tracking     a = A_r + 2 ω ė + ω² e + Λ⁻¹ f
//! compliant    a = A_r + Λ⁻¹ (K e + D ė + f),    D_ii = 2 √(K_ii/(Λ⁻¹)_ii)
//! torque       τ = Jᵀ Λ (a − J̇ v) + C v + g       with the held load; for more than six joints plus Nᵀ τ₀, τ₀ = −2 ω M_kk v_k
//! ```
//! Source: O. Khatib, IEEE J. Robotics and Automation 3 (1987) 43. ω is `bandwidth`, f the move's force and moment. Where the tip cannot
//! move independently in six directions (a singular pose), the arm compensates gravity and damps its joints, and the output `singular` is true.
//!
//! A compliant tip with `feed` has no spring along that direction: the component of e along `feed` is removed. A move ends when its duration is over
//! and the tip has arrived, or when it reaches its `touch` force or its `depth`. If this does not happen within `patience` after the duration,
//! `failed` is set and the arm holds its commanded pose. After the last move the arm holds its pose and `done` is set. The position of the work is
//! observed, with the noise `work_noise`, when a move begins; moves in the frame of the work are shifted accordingly.

use crate::Believed;
use crate::arm::{Arm, Hand, InertiaCheck, Load, Memory, RobotFile};
use crate::moves::{Move, Path, Reference};
use crate::programme::{Follower, MoveProgress, Place, look};
use crate::tracking::{TrackingSample, norm};
use linkwork_spatial::Pose;
use linkwork_surroundings::prelude::*;

/// Parameters: the robot, its moves and the gains of the controller.
#[derive(Params, Clone, Debug)]
pub struct ArmParams {
    /// Robot description that the controller uses. It supplies masses and joint limits and may differ from the simulated robot.
    pub robot: RobotFile,
    /// Handling of moments of inertia that are not physical: `Warn` accepts them with a warning, `Physical` rejects them with an error.
    #[param(default = InertiaCheck::Warn)]
    pub inertia_check: InertiaCheck,
    /// Link that carries the arm, or `world`: the base.
    #[param(default = "world".to_string())]
    pub base: String,
    /// Link whose frame is the tip.
    pub tip: String,
    /// Origin of the tip (tool centre point) in the frame of that link. The tip has the axes of the link.
    #[param(unit = "m", default = Vec3::zeros())]
    pub tool: Vec3,
    /// Rotor inertia of each joint, reflected to the joint (gear² times rotor inertia), base to tip. URDF has no element for it. Default: zeros.
    #[param(unit = "kg m^2", default = Vec::new())]
    pub armature: Vec<f64>,
    /// Moves, in order.
    pub moves: Vec<Move>,
    /// Loads that the hand may hold.
    #[param(default = Vec::new())]
    pub loads: Vec<Load>,
    /// Assumed position of the work's origin in the base.
    #[param(unit = "m", default = Vec3::zeros())]
    pub work_position: Vec3,
    /// Roll, pitch, yaw of the work in the base.
    #[param(unit = "rad", default = Vec3::zeros())]
    pub work_rpy: Vec3,
    /// Standard deviation on each axis of the observed position of the work. A new observation is drawn when a move begins.
    #[param(unit = "m", default = 0.0, range = 0.0..)]
    pub work_noise: f64,
    /// Gravitational acceleration that the controller assumes, base axes. Default: the simulation's gravity at the origin of W, in the present axes of
    /// the node that is bound to `base`; zero without gravity.
    #[param(unit = "m/s^2")]
    pub gravity: Option<Vec3>,
    /// Gravity of the simulation.
    #[param(service)]
    pub field: Option<Handle<dyn Gravity>>,
    /// Natural frequency of the error dynamics while tracking.
    #[param(unit = "rad/s", default = 30.0, range = 1e-3..)]
    pub bandwidth: f64,
    /// Position tolerance for arrival.
    #[param(unit = "m", default = 1e-3, range = 1e-9..)]
    pub tolerance: f64,
    /// Angle tolerance for arrival.
    #[param(unit = "rad", default = 5e-3, range = 1e-9..)]
    pub tolerance_angle: f64,
    /// Time after the duration of a move within which the tip must arrive.
    #[param(unit = "s", default = 5.0, range = 0.0..)]
    pub patience: f64,
    /// Joint positions at the start, base to tip. If given, every move is checked before the run: a move that ends out of reach or exceeds a position
    /// or rate limit of a joint is an error. Default: no check.
    #[param(unit = "rad", default = Vec::new())]
    pub ready: Vec<f64>,
}

/// Measurements of a joint encoder.
#[derive(Ports, Clone, Copy, Debug)]
pub struct JointIn {
    /// Angle.
    #[port("rad")]
    pub angle: f64,
    /// Rate.
    #[port("rad/s")]
    pub rate: f64,
}

/// Command to the drive of a joint.
#[derive(Ports, Clone, Copy, Debug)]
pub struct JointOut {
    /// Torque.
    #[port("N m")]
    pub torque: f64,
}

/// Status of the controller.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ArmOut {
    /// Index of the current move, from 0.
    #[port("1")]
    pub index: f64,
    /// Gripper command: closed.
    #[port("1")]
    pub grip: bool,
    /// All moves are done.
    #[port("1")]
    pub done: bool,
    /// A move did not arrive, or did not reach its `touch` force or `depth`. The arm holds the commanded pose.
    #[port("1")]
    pub failed: bool,
    /// The tip cannot move independently in six directions here.
    #[port("1")]
    pub singular: bool,
    /// A torque was limited to the effort limit of its joint.
    #[port("1")]
    pub limited: bool,
    /// Position error of the tip.
    #[port("m")]
    pub error: f64,
    /// Angle error of the tip.
    #[port("rad")]
    pub error_angle: f64,
    /// Force with which a compliant tip pushes: spring, damper and the move's own force; zero while it tracks.
    #[port("N")]
    pub push: f64,
    /// Position of the tip from the embedded model, base axes.
    #[port("m")]
    pub tip: Vec3,
    /// Commanded position of the tip, base axes.
    #[port("m")]
    pub wanted: Vec3,
}

/// Discrete state.
#[derive(State, Clone, Copy, Debug)]
pub struct Progress {
    /// A first sample has been taken.
    #[port("1")]
    pub begun: bool,
    /// Index of the current move.
    #[port("1")]
    pub index: f64,
    /// Time since the current move began.
    #[port("s")]
    pub elapsed: f64,
    /// Commanded position of the tip at the start of the move.
    #[port("m")]
    pub position: Vec3,
    /// Commanded attitude of the tip at the start of the move.
    #[port]
    pub rotation: Quat,
    /// All moves are done.
    #[port("1")]
    pub done: bool,
    /// A move did not arrive.
    #[port("1")]
    pub failed: bool,
    /// Observed offset of the work from `work_position` at the start of the move, base axes.
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

/// Controller of one arm.
pub struct ArmController {
    p: ArmParams,
    arm: Arm,
    gravity: Believed,
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

    /// Returns the working memory for a joint state with the held load.
    fn memory(&self, u: &[f64], step: &Step) -> Option<Memory> {
        let (joints, base) = u.split_at(2 * self.arm.joints());
        let mut m = self.arm.at(joints, [step.load.map(|k| (k, Pose::identity())), None])?;
        m.robot.set_gravity(self.gravity.in_base(base)).ok()?;
        Some(m)
    }

    /// Returns the commanded pose and the tracking error of the tip, or `None` for non-finite joint values.
    fn now(&self, d: &Progress, m: &mut Memory) -> Option<TrackingSample> {
        let (X, V) = self.arm.tip(m, 0)?;
        let from = Pose::new(d.rotation, d.position);
        let wanted = match (d.begun, d.done || d.failed) {
            (false, _) => Reference::still(X),
            (true, true) => Reference::still(from),
            (true, false) => self.step(d).path.seen(&d.seen).at(&from, d.elapsed),
        };
        Some(TrackingSample::new(wanted, &X, &V))
    }

    /// Writes torques to `m.tau`. Returns the force of a compliant tip (N), or `None` in a singular pose.
    fn torques(&self, d: &Progress, m: &mut Memory, now: &TrackingSample) -> Option<f64> {
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
            // q serves as scratch memory here, because the robot has its own copy of the positions.
            damping(robot, w, v, M, q)?;
        }
        task.forces(robot, v, &a, redundant.then_some(&q[..]), tau).ok()?;
        Some(if step.stiffness.is_some() { norm(&f[3..]) } else { 0.0 })
    }

    /// Compensates gravity and damps the joints.
    fn hold(&self, m: &mut Memory) -> Option<()> {
        let Memory { robot, v, tau, q, M, .. } = m;
        damping(robot, self.p.bandwidth, v, M, q)?;
        robot.gravity_forces(tau).ok()?;
        tau.iter_mut().zip(&*q).for_each(|(t, x)| *t += x);
        Some(())
    }
}

/// Writes the damping torques −2 ω M_kk v_k to `out`; `M` (n × n) is scratch memory.
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

/// Executes moves of an arm's tip with an embedded model of the arm. The tip tracks its path or is compliant; the held load is included.
#[model("manipulation.arm_controller")]
impl SizedModel for ArmController {
    type Params = ArmParams;

    fn ports(p: &ArmParams) -> SizedPorts {
        // `build` reports an error for a description without this arm.
        let joints = Self::arm(p).map_or(0, |arm| arm.joints());
        let group = |k: usize| format!("joints[{k}]");
        let inputs = (0..joints).flat_map(|k| PortSpec::group::<JointIn>(group(k), "Encoder"));
        let torques = (0..joints).flat_map(|k| PortSpec::group::<JointOut>(group(k), "Drive"));
        SizedPorts {
            feedthrough_inputs: inputs
                .chain([crate::base_port(p.gravity, p.field.as_ref())])
                .collect(),
            feedthrough_outputs: torques.chain(ArmOut::specs()).collect(),
            discrete: Progress::specs(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(p: ArmParams) -> Result<Self, BuildError> {
        let field = crate::believed(p.gravity, p.field.as_ref());
        let gravity = p.gravity.map_or(Believed::OfWorld(field), Believed::Written);
        let arm = Self::arm(&p)?;
        if p.moves.is_empty() {
            let help = "write at least one, such as (name: \"stay\", duration: \"1 s\")";
            return Err(BuildError::new("`moves` is empty").help(help).at("moves"));
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
        let controller = ArmController { p, arm, gravity, steps };
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
        // Non-finite joint values give NaN torques, which stop the run with an error.
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
            // The next move begins where a fed tip actually stopped, not at its commanded position.
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
            let met = MoveProgress {
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
    /// Checks that every move can be followed within the joint limits, beginning at `ready`.
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
