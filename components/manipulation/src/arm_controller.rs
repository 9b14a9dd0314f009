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
//! arrived, or when it feels the touch or comes to the depth that it was to. When it does not arrive within
//! `patience`, `failed` is set and the arm stays there. After the last move it holds its pose, and `done` is set.

use crate::arm::{Arm, Load, Memory, RobotFile};
use crate::moves::{Move, Path, Reference, short};
use linkwork_embedded::{Effort, Goal, Outcome};
use linkwork_runtime::prelude::*;
use linkwork_spatial::{Motion, Pose};

/// The robot, its programme, and how it is controlled.
#[derive(Params, Clone, Debug)]
pub struct ArmParams {
    /// Description of the robot as the controller believes it to be; masses and limits of its joints come from there.
    pub robot: RobotFile,
    /// Link that carries the arm, or `world`: the base.
    #[param(default = "world".to_string())]
    pub base: String,
    /// Link whose frame is the tip.
    pub tip: String,
    /// The tip's origin in that frame: a tool's point. Its axes are those of the link.
    #[param(unit = "m", default = Vec3::zeros())]
    pub tool: Vec3,
    /// Inertia of each joint's rotor seen at the joint (gear² times its own), base to tip, which a URDF file cannot say; unwritten: zeros.
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
    /// Free fall in the base's axes.
    #[param(unit = "m/s^2", default = Vec3::new(0.0, 0.0, -9.80665))]
    pub gravity: Vec3,
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
    /// reach, or on whose way a joint comes to its limits of position or rate, is refused. Unwritten: nothing is looked at.
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
    /// A move did not arrive; the arm stays where it was to be.
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

/// Places of a move's way that are looked at before the run.
const WAY: u32 = 50;

/// Wanted and measured, at one sample.
struct Now {
    wanted: Reference,
    e: [f64; 6],
    de: [f64; 6],
}

fn six(m: &Motion) -> [f64; 6] {
    let (w, v) = (m.angular, m.linear);
    [w.x, w.y, w.z, v.x, v.y, v.z]
}

impl ArmController {
    fn arm(p: &ArmParams) -> Result<Arm, BuildError> {
        Arm::new(&p.robot, [&p.base, &p.tip], p.tool, &p.armature, &p.loads, p.gravity)
    }

    fn step(&self, d: &Progress) -> &Step {
        &self.steps[(d.index as usize).min(self.steps.len() - 1)]
    }

    /// The wanted pose, and how far the tip is from it; `None` for joints that are no numbers.
    fn now(&self, d: &Progress, m: &mut Memory) -> Option<Now> {
        let X = m.robot.tip_pose(self.arm.chain).ok()?;
        m.robot.jacobian(self.arm.chain, &mut m.J).ok()?;
        let still = |X| Reference { X, V: Motion::zero(), A: Motion::zero() };
        let from = Pose::new(d.rotation, d.position);
        let wanted = match (d.begun, d.done || d.failed) {
            (false, _) => still(X),
            (true, true) => still(from),
            (true, false) => self.step(d).path.at(&from, d.elapsed),
        };
        let turn = short(wanted.X.rotation * X.rotation.inverse());
        let e = six(&Motion::new(turn, wanted.X.position - X.position));
        let mut de = six(&wanted.V);
        for (row, de) in m.J.chunks_exact(m.v.len()).zip(&mut de) {
            *de -= row.iter().zip(&m.v).map(|(j, v)| j * v).sum::<f64>();
        }
        Some(Now { wanted, e, de })
    }

    /// Spring, damper and the move's own push: [moment; force] on the tip's surroundings, base axes.
    fn push(step: &Step, now: &Now, compliance: &[f64]) -> [f64; 6] {
        let [moment, force] = step.path.push;
        let mut f = six(&Motion::new(moment, force));
        if let Some([line, turn]) = step.stiffness {
            let mut e = now.e;
            if let Some(n) = step.path.feed {
                let along = n.dot(&Vec3::new(e[3], e[4], e[5]));
                (0..3).for_each(|k| e[3 + k] -= along * n[k]);
            }
            for (k, f) in f.iter_mut().enumerate() {
                let stiffness = if k < 3 { turn } else { line };
                let damping = 2.0 * (stiffness / compliance[7 * k]).sqrt();
                *f += stiffness * e[k] + damping * now.de[k];
            }
        }
        f
    }

    /// Torques into `m.tau`; returns the force that a compliant tip pushes with (N), or `None` in a singular pose.
    fn torques(&self, d: &Progress, m: &mut Memory, now: &Now) -> Option<f64> {
        let step = self.step(d);
        let Memory { robot, task, v, tau, q, .. } = m;
        let compliance = task.compliance(robot).ok()?;
        let f = Self::push(step, now, compliance);
        let mut a = six(&now.wanted.A);
        let w = self.p.bandwidth;
        for (k, a) in a.iter_mut().enumerate() {
            *a += (0..6).map(|j| compliance[6 * k + j] * f[j]).sum::<f64>();
            if step.stiffness.is_none() {
                *a += 2.0 * w * now.de[k] + w * w * now.e[k];
            }
        }
        let redundant = v.len() > 6;
        if redundant {
            // The room of q is free: the robot has its own copy.
            damping(robot, w, v, q)?;
        }
        task.forces(robot, v, &a, redundant.then_some(&q[..]), tau).ok()?;
        let force = (f[3] * f[3] + f[4] * f[4] + f[5] * f[5]).sqrt();
        Some(if step.stiffness.is_some() { force } else { 0.0 })
    }

    /// Holds the arm against gravity, damped.
    fn hold(&self, m: &mut Memory) -> Option<()> {
        let Memory { robot, v, tau, q, .. } = m;
        damping(robot, self.p.bandwidth, v, q)?;
        robot.gravity_forces(tau).ok()?;
        tau.iter_mut().zip(&*q).for_each(|(t, x)| *t += x);
        Some(())
    }
}

/// −2 ω M_kk v_k into `out`.
fn damping(robot: &mut linkwork_embedded::Robot, w: f64, v: &[f64], out: &mut [f64]) -> Option<()> {
    let n = v.len();
    let mut M = [0.0; 64];
    let M = M.get_mut(..n * n)?;
    robot.mass_matrix(M).ok()?;
    for k in 0..n {
        out[k] = -2.0 * w * M[k * n + k] * v[k];
    }
    Some(())
}

impl SizedModel for ArmController {
    const NAME: &'static str = "manipulation.arm_controller";
    const DOC: &'static str = "Carries out moves of an arm's tip by an embedded model of the arm: tracking or compliant, with what the hand holds.";
    type Params = ArmParams;
    type Store = ();

    fn ports(p: &ArmParams) -> SizedPorts {
        // A description that makes no arm is refused when the part is built.
        let joints = Self::arm(p).map_or(0, |arm| arm.joints());
        let group = |k: usize| format!("joints[{k}]");
        let inputs = (0..joints).flat_map(|k| PortSpec::group::<JointIn>(group(k), "Encoder"));
        let torques = (0..joints).flat_map(|k| PortSpec::group::<JointOut>(group(k), "Drive"));
        SizedPorts {
            direct_inputs: inputs.collect(),
            direct_outputs: torques.chain(ArmOut::specs()).collect(),
            discrete: Progress::specs(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(p: ArmParams) -> Result<Self, BuildError> {
        let arm = Self::arm(&p)?;
        if arm.joints() > 8 {
            let fact = format!("{} joints are too many for one chain", arm.joints());
            return Err(BuildError::new(fact).help("eight at most").at("tip"));
        }
        if p.moves.is_empty() {
            let help = "write one at least, such as (name: \"stay\", duration: \"1 s\")";
            return Err(BuildError::new("there is no move").help(help).at("moves"));
        }
        let a = p.work_rpy;
        let work = Pose::new(Quat::from_euler_angles(a.x, a.y, a.z), p.work_position);
        let mut steps = Vec::with_capacity(p.moves.len());
        for m in &p.moves {
            let load = match &m.holds {
                None => None,
                Some(name) => match p.loads.iter().position(|l| l.name == *name) {
                    Some(k) => Some(k),
                    None => {
                        let known: Vec<&str> = p.loads.iter().map(|l| l.name.as_str()).collect();
                        let fact = format!("move `{}` holds `{name}`, which is no load", m.name);
                        let help = format!("loads: {}", known.join(", "));
                        return Err(BuildError::new(fact).help(help).at("moves"));
                    }
                },
            };
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
        }
        .put(d);
    }

    fn direct(&self, _: &Clock, _: &[f64], d: &[f64], u: &[f64], _: &(), y: &mut [f64]) {
        let d = Progress::get(d);
        let step = self.step(&d);
        let n = self.arm.joints();
        // Joints that are no numbers give torques that are none, at which the run stops.
        y.fill(f64::NAN);
        let Some(mut m) = self.arm.at(u, step.load) else { return };
        if let Some(now) = self.now(&d, &mut m) {
            let push = self.torques(&d, &mut m, &now);
            if push.is_none() && self.hold(&mut m).is_none() {
                return self.arm.give_back(m);
            }
            let mut limited = false;
            for (k, tau) in m.tau.iter().enumerate() {
                let most = self.arm.limits[k].effort;
                limited |= tau.abs() > most;
                y[k] = tau.clamp(-most, most);
            }
            let norm = |e: &[f64]| e.iter().map(|x| x * x).sum::<f64>().sqrt();
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
                tip: wanted - Vec3::new(now.e[3], now.e[4], now.e[5]),
                wanted,
            }
            .put(&mut y[n..]);
        }
        self.arm.give_back(m);
    }

    fn update(&self, c: &Clock, _: &[f64], d: &mut [f64], u: &[f64], _: &mut ()) {
        let mut p = Progress::get(d);
        let step = self.step(&p);
        let Some(mut m) = self.arm.at(u, step.load) else { return };
        if let Some(now) = self.now(&p, &mut m) {
            let mut X = now.wanted.X;
            // What is fed stands where it got to.
            let way = Vec3::new(now.e[3], now.e[4], now.e[5]);
            let gone = step.path.feed.map(|n| -n.dot(&way));
            if let (Some(n), Some(gone)) = (step.path.feed, gone) {
                X.position += n * gone;
            }
            let stand = |p: &mut Progress| (p.position, p.rotation) = (X.position, X.rotation);
            let norm = |e: &[f64]| e.iter().map(|x| x * x).sum::<f64>().sqrt();
            let near = norm(&now.e[3..]) <= self.p.tolerance
                && norm(&now.e[..3]) <= self.p.tolerance_angle;
            // A rounding of sums of the sample is no time.
            let over = p.elapsed - step.path.duration() + 1e-9 * c.dt;
            let felt = step.touch.is_some_and(|most| {
                let compliance = m.task.compliance(&mut m.robot);
                compliance.is_ok_and(|A| norm(&Self::push(step, &now, A)[3..]) > most)
            });
            let deep = gone.zip(step.depth).is_some_and(|(gone, depth)| gone >= depth);
            if !p.begun {
                (p.begun, p.elapsed) = (true, c.dt);
                stand(&mut p);
            } else if p.done || p.failed {
            } else if felt || deep || (over >= 0.0 && (near || !step.arrive)) {
                stand(&mut p);
                if (p.index as usize) + 1 < self.steps.len() {
                    (p.index, p.elapsed) = (p.index + 1.0, c.dt);
                } else {
                    p.done = true;
                }
            } else if over > self.p.patience {
                stand(&mut p);
                p.failed = true;
            } else {
                p.elapsed += c.dt;
            }
            p.put(d);
        }
        self.arm.give_back(m);
    }
}

impl ArmController {
    /// That every move can be followed within the limits of the joints, beginning at `ready`.
    fn reachable(&self) -> Result<(), BuildError> {
        let (ready, n) = (&self.p.ready, self.arm.joints());
        if ready.is_empty() {
            return Ok(());
        }
        if ready.len() != n {
            let fact = format!("{} positions for {n} joints", ready.len());
            return Err(BuildError::new(fact).help("write one for each, base to tip").at("ready"));
        }
        let fault = |e: linkwork_embedded::RobotError| BuildError::new(e.to_string()).at("ready");
        let mut robot = linkwork_embedded::Robot::new(&self.arm.model);
        let mut q = ready.clone();
        robot.set_q(&q).map_err(fault)?;
        let mut from = robot.tip_pose(self.arm.chain).map_err(fault)?;
        let refused = |fact: String, help: &str| Err(BuildError::new(fact).help(help).at("moves"));
        let mut to = q.clone();
        for (m, step) in self.p.moves.iter().zip(&self.steps) {
            let end = step.path.at(&from, step.path.duration()).X;
            let answer = self.near(&mut robot, &end, &mut to, 64).map_err(fault)?;
            if answer.outcome != Outcome::Met {
                let (p, name) = (end.position, &m.name);
                let (far, turned) =
                    (1e3 * answer.residual.position, answer.residual.orientation.to_degrees());
                let fact = format!(
                    "move `{name}` ends at [{:.4}, {:.4}, {:.4}] m in the base, out of reach: the nearest pose within the limits of the joints is {far:.1} mm and {turned:.2}° away",
                    p.x, p.y, p.z
                );
                return refused(fact, "move the work, the arm's base, or the end of the move");
            }
            // On the way, from where the joints are.
            let dt = step.path.duration() / f64::from(WAY);
            for k in 1..=WAY {
                let X = step.path.at(&from, f64::from(k) * dt).X;
                to.copy_from_slice(&q);
                let met =
                    self.near(&mut robot, &X, &mut to, 0).map_err(fault)?.outcome == Outcome::Met;
                let fast = (0..n).find(|k| (to[*k] - q[*k]).abs() > self.arm.limits[*k].rate * dt);
                if !met || fast.is_some() {
                    let (t, name) = (f64::from(k) * dt, &m.name);
                    let why = fast.filter(|_| met).map_or_else(
                        || "a joint comes to its limit".into(),
                        |j| {
                            let rate = (to[j] - q[j]).abs() / dt;
                            let most = self.arm.limits[j].rate;
                            format!("joint {j} would have to turn at {rate:.1} rad/s, its limit is {most:.2}")
                        },
                    );
                    let fact =
                        format!("move `{name}` cannot be followed {t:.2} s after its start: {why}");
                    let help = "the way leads near a singular pose or a limit: begin with other joints (`ready`), go round by a move in between, or take longer";
                    return refused(fact, help);
                }
                q.copy_from_slice(&to);
            }
            from = end;
        }
        Ok(())
    }

    /// Joints for a pose of the tip, from those in `q`.
    fn near(
        &self,
        robot: &mut linkwork_embedded::Robot,
        X: &Pose,
        q: &mut [f64],
        restarts: usize,
    ) -> Result<linkwork_embedded::Answer, linkwork_embedded::RobotError> {
        let effort = Effort { tolerances: [1e-6; 2], restarts, ..Effort::default() };
        robot.reach(self.arm.chain, &Goal::pose(*X), &effort, q)
    }
}

#[cfg(test)]
#[path = "arm_controller_tests.rs"]
mod tests;
