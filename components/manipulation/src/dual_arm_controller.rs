//! `manipulation.dual_arm_controller`: controls two arms of one robot. Each arm follows its own moves, or both move an object that they hold between
//! them.
//! ```text
//! O                                     frame halfway between the tips; its pose in each hand, X_LO and X_RO, is computed from the joints at the moment of grasping
//! apart               a as in `manipulation.arm_controller`, for the tips of both hands at once
//! together            e, ė of O, from the mean of its poses in both hands; a_O = A_r + 2 ω ė + ω² e + Λ_O⁻¹ f, or compliant
//!                     Λ_O = Gᵀ Λ G,  a_i = [α; a + α × r_i + ω × (ω × r_i)],  G_i = [1, 0; −r_i×, 1]       r_i: O to tip i
//! torque              τ₀ = Jᵀ Λ (a − J̇ v) + C v + g                             with the held loads; a shared load is attached to the left hand
//! shared              τ = τ₀ − Cᵀ λ,  min Σ (τ/limit)²                          λ: wrench of the right hand on the object
//! squeeze             s = max(wanted, margin |t_i|/µ − n_i)                     n_i, t_i: force of hand i along and across the line through the tips
//! ```
//! Sources: O. Khatib, IEEE J. Robotics and Automation 3 (1987) 43; load sharing and squeeze are computed by `linkwork-embedded`.
//! The grip model is two flat palms that press towards each other; contact moments are neglected. The forces of the hands on the object are computed
//! from the loads and the joint torques, not measured.
//!
//! Moves end and fail as in `manipulation.arm_controller`, and the work is observed in the same way. In a singular pose both arms compensate gravity
//! and damp their joints.

use crate::Believed;
use crate::arm::{Arm, HANDS_MAX, Hand, Memory};
use crate::arm_controller::{JointIn, JointOut, damping};
use crate::dual_moves::{Track, Tracks};
use crate::dual_ports::{DualArmOut, DualArmParams, DualProgress};
use crate::moves::{Reference, short};
use crate::programme::{Follower, MoveProgress, Place, look};
use crate::tracking::{TrackingSample, norm};
use linkwork_embedded::Balance;
use linkwork_runtime::prelude::*;
use linkwork_spatial::Pose;
use linkwork_spatial::nalgebra::{Matrix3, Matrix6, Vector6};

struct Step {
    tracks: Tracks,
    duration: f64,
    squeeze: f64,
    arrive: bool,
}

impl Step {
    /// Returns the contact forces (N) that the move waits for: one of each hand, or one of the object in both hands.
    fn touches(&self) -> [Option<f64>; 2] {
        match &self.tracks {
            Tracks::Apart(t) => [t[0].touch, t[1].touch],
            Tracks::Together(t, _) => [t.touch, None],
        }
    }
}

/// Controller of two arms.
pub struct DualArmController {
    p: DualArmParams,
    arm: Arm,
    gravity: Believed,
    steps: Vec<Step>,
}

type Tip = (Pose, [f64; 6]);

/// Tracking errors at one sample. The variants are not boxed, because a box would allocate memory at each sample.
#[allow(clippy::large_enum_variant)]
enum Moving {
    Apart([TrackingSample; 2]),
    Together(TrackingSample),
}

impl Moving {
    /// Returns the largest position error (m) and the largest angle error (rad).
    fn errors(&self) -> [f64; 2] {
        let of = |now: &TrackingSample| [norm(&now.e[3..]), norm(&now.e[..3])];
        match self {
            Moving::Together(now) => of(now),
            Moving::Apart([l, r]) => {
                let (l, r) = (of(l), of(r));
                [l[0].max(r[0]), l[1].max(r[1])]
            }
        }
    }
}

/// State of the grip of both hands on an object.
#[derive(Clone, Copy, Default)]
struct Grip {
    squeeze: f64,
    friction: f64,
    slipping: bool,
}

/// Returns the frame halfway between two tips with the given axes, and its pose in each tip.
fn found(tips: [Pose; 2], axes: Quat) -> (Pose, [Pose; 2]) {
    let O = Pose::new(axes, 0.5 * (tips[0].position + tips[1].position));
    (O, tips.map(|X| X.inverse() * O))
}

/// Returns the pose and velocity of O as the mean of both hands.
fn mean(tips: &[Tip; 2], in_hands: &[Pose; 2]) -> Tip {
    let O = [0, 1].map(|k| tips[k].0 * in_hands[k]);
    let p = 0.5 * (O[0].position + O[1].position);
    let half = 0.5 * short(O[1].rotation * O[0].rotation.inverse());
    let X = Pose::new(Quat::from_scaled_axis(half) * O[0].rotation, p);
    let mut V = [0.0; 6];
    for (tip, V_T) in tips {
        let w = Vec3::new(V_T[0], V_T[1], V_T[2]);
        let v = Vec3::new(V_T[3], V_T[4], V_T[5]) + w.cross(&(p - tip.position));
        let both = [w.x, w.y, w.z, v.x, v.y, v.z];
        V.iter_mut().zip(both).for_each(|(V, x)| *V += 0.5 * x);
    }
    (X, V)
}

/// Returns the matrix that maps the velocity of O to the velocity of a tip at `r` from O.
fn at(r: &Vec3) -> Matrix6<f64> {
    let mut G = Matrix6::identity();
    let cross = Matrix3::new(0.0, r.z, -r.y, -r.z, 0.0, r.x, r.y, -r.x, 0.0);
    G.fixed_view_mut::<3, 3>(3, 0).copy_from(&cross);
    G
}

impl DualArmController {
    fn arm(p: &DualArmParams) -> Result<Arm, BuildError> {
        let hands = [
            Hand { at: "left_tip", tip: &p.left_tip, tool: p.left_tool },
            Hand { at: "right_tip", tip: &p.right_tip, tool: p.right_tool },
        ];
        Arm::new(
            (&p.robot, p.inertia_check),
            &p.base,
            &hands,
            &p.armature,
            &p.loads,
            crate::believed(p.gravity, p.field.as_ref()),
        )
    }

    fn step(&self, d: &DualProgress) -> &Step {
        &self.steps[(d.index as usize).min(self.steps.len() - 1)]
    }

    fn tips(&self, m: &mut Memory) -> Option<[Tip; 2]> {
        Some([self.arm.tip(m, 0)?, self.arm.tip(m, 1)?])
    }

    /// Returns the working memory for a joint state with the held loads, and the pose of O in both hands.
    fn memory(&self, u: &[f64], d: &DualProgress) -> Option<(Memory, [Pose; 2])> {
        let joints = &u[..2 * self.arm.joints()];
        let mut in_hands = d.in_hands();
        let held: [Option<(usize, Pose)>; HANDS_MAX] = match &self.step(d).tracks {
            Tracks::Apart(tracks) => {
                [0, 1].map(|k| tracks[k].load.map(|load| (load, Pose::identity())))
            }
            Tracks::Together(track, axes) => {
                if !d.begun {
                    let mut m = self.arm.at(joints, [None; HANDS_MAX])?;
                    let tips = self.tips(&mut m);
                    self.arm.give_back(m);
                    in_hands = found(tips?.map(|t| t.0), *axes).1;
                }
                [0, 1].map(|k| track.load.map(|load| (load, in_hands[k])))
            }
        };
        let mut m = self.arm.at(joints, held)?;
        m.robot.set_gravity(self.gravity(u)).ok()?;
        Some((m, in_hands))
    }

    /// Returns gravity in the axes of the base, m/s².
    fn gravity(&self, u: &[f64]) -> Vec3 {
        self.gravity.in_base(&u[2 * self.arm.joints()..])
    }

    /// Returns the tracking errors of all that moves.
    fn moving(&self, d: &DualProgress, tips: &[Tip; 2], in_hands: &[Pose; 2]) -> Moving {
        let wanted = |track: &Track, from: Pose, X: Pose| match (d.begun, d.done || d.failed) {
            (false, _) => Reference::still(X),
            (true, true) => Reference::still(from),
            (true, false) => track.seen(&d.seen).at(&from, d.elapsed),
        };
        match &self.step(d).tracks {
            Tracks::Apart(tracks) => Moving::Apart([0, 1].map(|k| {
                let (X, V) = &tips[k];
                TrackingSample::new(wanted(&tracks[k], d.tips()[k], *X), X, V)
            })),
            Tracks::Together(track, _) => {
                let (X, V) = mean(tips, in_hands);
                Moving::Together(TrackingSample::new(wanted(track, d.object(), X), &X, &V))
            }
        }
    }

    /// Writes the accelerations of both tips to `a`. Returns the wrenches of compliant motions: one for each hand, or the wrench at O as the first.
    /// Returns `None` where the tips cannot move independently.
    fn accelerations(
        &self,
        step: &Step,
        m: &mut Memory,
        (tips, moving): (&[Tip; 2], &Moving),
        a: &mut [f64; 12],
    ) -> Option<[[f64; 6]; 2]> {
        let tracked = |track: &Track| track.stiffness.is_none().then_some(self.p.bandwidth);
        match (&step.tracks, moving) {
            (Tracks::Apart(tracks), Moving::Apart(now)) => {
                let compliance = m.task.compliance(&mut m.robot).ok()?;
                let pushes = [0, 1].map(|i| {
                    let mobility = |k: usize| compliance[13 * (6 * i + k)];
                    now[i].push(&tracks[i].path, tracks[i].stiffness, mobility)
                });
                for i in 0..2 {
                    let own = now[i].acceleration(tracked(&tracks[i]));
                    a[6 * i..6 * i + 6].copy_from_slice(&own);
                }
                for (row, a) in compliance.chunks_exact(12).zip(a) {
                    *a += row.iter().zip(pushes.as_flattened()).map(|(A, f)| A * f).sum::<f64>();
                }
                Some(pushes)
            }
            (Tracks::Together(track, _), Moving::Together(now)) => {
                let mut inertia = [0.0; 144];
                m.task.inertia(&mut m.robot, &mut inertia).ok()?;
                let O = now.wanted.X.position - now.way();
                let r = [0, 1].map(|i| tips[i].0.position - O);
                let G = r.map(|r| at(&r));
                let mut inertia_O = Matrix6::zeros();
                for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let block =
                        Matrix6::from_fn(|row, col| inertia[12 * (6 * i + row) + 6 * j + col]);
                    inertia_O += G[i].transpose() * block * G[j];
                }
                let mobility = inertia_O.cholesky()?.inverse();
                let push = now.push(&track.path, track.stiffness, |k| mobility[(k, k)]);
                let given = mobility * Vector6::from(push);
                let mut a_O = now.acceleration(tracked(track));
                a_O.iter_mut().zip(given.iter()).for_each(|(a, x)| *a += x);
                let w = now.wanted.V.angular - Vec3::new(now.de[0], now.de[1], now.de[2]);
                for i in 0..2 {
                    let turning = w.cross(&w.cross(&r[i]));
                    let tip = G[i] * Vector6::from(a_O);
                    for k in 0..6 {
                        a[6 * i + k] = tip[k] + if k < 3 { 0.0 } else { turning[k - 3] };
                    }
                }
                Some([push, [0.0; 6]])
            }
            _ => None,
        }
    }

    /// Shares the load of the object between both hands and squeezes it: changes `m.tau`.
    fn grip(
        &self,
        step: &Step,
        m: &mut Memory,
        (now, push, gravity): (&TrackingSample, &[f64; 6], Vec3),
    ) -> Option<Grip> {
        let Tracks::Together(track, _) = &step.tracks else { return Some(Grip::default()) };
        let load = track.load?;
        let object = *self.arm.loads.get(load)?;
        let shared = m.robot.balance(object, Balance::Effort, &mut m.tau).ok()?;
        let (X, A) = (now.wanted.X, now.wanted.A);
        let com = X.rotation * self.p.loads[load].com;
        let a = A.linear + A.angular.cross(&com) - gravity;
        // Assume conservatively that the whole compliance force passes through the palms.
        let net = a * self.p.loads[load].mass + Vec3::new(push[3], push[4], push[5]);
        let forces = [net - shared.second.force, shared.second.force];
        let [l, r] = [0, 1].map(|k| m.robot.tip_pose(self.arm.chains[k]).map(|X| X.position));
        let line = r.ok()? - l.ok()?;
        if !(line.norm() > 1e-9) {
            return None;
        }
        let n = line.normalize();
        let parts = [0, 1].map(|k| {
            let along = forces[k].dot(&n);
            let across = (forces[k] - along * n).norm();
            (if k == 0 { along } else { -along }, across)
        });
        let p = &self.p;
        let least = parts.iter().map(|(n, t)| p.margin * t / p.friction - n);
        let wanted = least.fold(step.squeeze, |a, b| if a >= b { a } else { b });
        let squeeze = wanted.min(p.squeeze_max);
        m.robot.squeeze(object, squeeze, &mut m.tau).ok()?;
        let friction = parts.map(|(n, t)| {
            let press = n + squeeze;
            if press > 0.0 { t / press } else { f64::INFINITY }
        });
        // `slipping` reports a palm that does not press. Limit the ratio so that it stays finite.
        let friction = friction[0].max(friction[1]).min(1e3);
        Some(Grip { squeeze, friction, slipping: friction > p.friction })
    }

    /// Writes torques to `m.tau`. Returns the largest compliance force (N) and the grip, or `None` in a singular pose.
    fn torques(
        &self,
        step: &Step,
        m: &mut Memory,
        (tips, moving, gravity): (&[Tip; 2], &Moving, Vec3),
    ) -> Option<(f64, Grip)> {
        let mut a = [0.0; 12];
        let pushes = self.accelerations(step, m, (tips, moving), &mut a)?;
        let Memory { robot, task, v, tau, q, M, .. } = m;
        let redundant = v.len() > 12;
        if redundant {
            // q serves as scratch memory here, because the robot has its own copy of the positions.
            damping(robot, self.p.bandwidth, v, M, q)?;
        }
        task.forces(robot, v, &a, redundant.then_some(&q[..]), tau).ok()?;
        let grip = match moving {
            Moving::Together(now) => self.grip(step, m, (now, &pushes[0], gravity))?,
            Moving::Apart(_) => Grip::default(),
        };
        let push = |track: &Track, f: &[f64; 6]| {
            if track.stiffness.is_some() { norm(&f[3..]) } else { 0.0 }
        };
        let push = match &step.tracks {
            Tracks::Apart(t) => push(&t[0], &pushes[0]).max(push(&t[1], &pushes[1])),
            Tracks::Together(t, _) => push(t, &pushes[0]),
        };
        Some((push, grip))
    }

    /// Compensates gravity and damps the joints of both arms.
    fn hold(&self, step: &Step, m: &mut Memory) -> Option<()> {
        let Memory { robot, v, tau, q, M, .. } = m;
        damping(robot, self.p.bandwidth, v, M, q)?;
        robot.gravity_forces(tau).ok()?;
        tau.iter_mut().zip(&*q).for_each(|(t, x)| *t += x);
        if let Tracks::Together(track, _) = &step.tracks
            && let Some(object) = track.load.and_then(|k| self.arm.loads.get(k))
        {
            robot.balance(*object, Balance::Effort, tau).ok()?;
            robot.squeeze(*object, step.squeeze, tau).ok()?;
        }
        Some(())
    }
}

/// Executes moves of two arms with an embedded model of the robot. Each arm moves separately, or both carry an object: they share its load by joint
/// effort and squeeze it as much as friction requires.
#[model("manipulation.dual_arm_controller")]
impl SizedModel for DualArmController {
    type Params = DualArmParams;

    fn ports(p: &DualArmParams) -> SizedPorts {
        // `build` reports an error for a description without these arms.
        let joints = Self::arm(p).map_or([0; 2], |arm| [0, 1].map(|k| arm.joints_of(k)));
        let names = || {
            let of = |(side, n): (&'static str, usize)| (0..n).map(move |k| format!("{side}[{k}]"));
            ["left", "right"].into_iter().zip(joints).flat_map(of)
        };
        let inputs = names().flat_map(|name| PortSpec::group::<JointIn>(name, "Encoder"));
        let torques = names().flat_map(|name| PortSpec::group::<JointOut>(name, "Drive"));
        SizedPorts {
            feedthrough_inputs: inputs
                .chain([crate::base_port(p.gravity, p.field.as_ref())])
                .collect(),
            feedthrough_outputs: torques.chain(DualArmOut::specs()).collect(),
            discrete: DualProgress::specs(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(p: DualArmParams) -> Result<Self, BuildError> {
        let field = crate::believed(p.gravity, p.field.as_ref());
        let gravity = p.gravity.map_or(Believed::OfWorld(field), Believed::Written);
        let arm = Self::arm(&p)?;
        if let Some(k) = arm.limits.iter().position(|l| !(l.effort.is_finite() && l.effort > 0.0)) {
            let fact = format!("joint {k} of the robot has no effort limit");
            let help = "write `effort` in its `limit`: loads are shared in proportion to the effort limits";
            return Err(BuildError::new(fact).help(help).at("robot"));
        }
        if p.moves.is_empty() {
            let help = "write at least one, such as (name: \"stay\", duration: \"1 s\")";
            return Err(BuildError::new("`moves` is empty").help(help).at("moves"));
        }
        let a = p.work_rpy;
        let work = Pose::new(Quat::from_euler_angles(a.x, a.y, a.z), p.work_position);
        let steps = p.moves.iter().map(|m| {
            let tracks = Tracks::new(m, &work, &p.loads)?;
            let (duration, squeeze, arrive) = (m.duration, m.squeeze, m.arrive);
            Ok(Step { tracks, duration, squeeze, arrive })
        });
        let steps = steps.collect::<Result<Vec<Step>, BuildError>>()?;
        let controller = DualArmController { p, arm, gravity, steps };
        controller.reachable()?;
        Ok(controller)
    }

    fn initial(&self, _: &mut [f64], d: &mut [f64]) {
        let (p, R) = (Vec3::zeros(), Quat::identity());
        DualProgress {
            begun: false,
            index: 0.0,
            elapsed: 0.0,
            done: false,
            failed: false,
            left: p,
            left_rotation: R,
            right: p,
            right_rotation: R,
            both: p,
            both_rotation: R,
            in_left: p,
            in_left_rotation: R,
            in_right: p,
            in_right_rotation: R,
            seen: p,
        }
        .put(d);
    }

    fn feedthrough(&self, d: &[f64], u: &[f64], y: &mut [f64]) {
        let d = DualProgress::get(d);
        let step = self.step(&d);
        // Non-finite joint values give NaN torques, which stop the run with an error.
        y.fill(f64::NAN);
        let Some((mut m, in_hands)) = self.memory(u, &d) else { return };
        let Some(tips) = self.tips(&mut m) else { return self.arm.give_back(m) };
        let moving = self.moving(&d, &tips, &in_hands);
        let done = self.torques(step, &mut m, (&tips, &moving, self.gravity(u)));
        if done.is_none() && self.hold(step, &mut m).is_none() {
            return self.arm.give_back(m);
        }
        let (push, grip) = done.unwrap_or_default();
        let (mut limited, mut share) = (false, 0.0_f64);
        for (y, k) in y.iter_mut().zip(&self.arm.dofs) {
            let (tau, most) = (m.tau[*k], self.arm.limits[*k].effort);
            limited |= tau.abs() > most;
            share = share.max(tau.abs() / most);
            *y = tau.clamp(-most, most);
        }
        let [error, error_angle] = moving.errors();
        let (grip_left, grip_right) = match &step.tracks {
            Tracks::Apart(t) => (t[0].grip, t[1].grip),
            Tracks::Together(..) => (true, true),
        };
        DualArmOut {
            index: d.index,
            grip_left,
            grip_right,
            done: d.done,
            failed: d.failed,
            singular: done.is_none(),
            limited,
            slipping: grip.slipping,
            error,
            error_angle,
            push,
            squeeze: grip.squeeze,
            friction: grip.friction,
            share,
            tip_left: tips[0].0.position,
            tip_right: tips[1].0.position,
        }
        .put(&mut y[self.arm.joints()..]);
        self.arm.give_back(m);
    }

    fn update(&self, clock: &Clock, d: &mut [f64], u: &[f64]) {
        let mut p = DualProgress::get(d);
        let step = self.step(&p);
        let Some((mut m, in_hands)) = self.memory(u, &p) else { return };
        if let Some(tips) = self.tips(&mut m) {
            let moving = self.moving(&p, &tips, &in_hands);
            let felt = self.felt(step, &mut m, (&tips, &moving));
            let [error, error_angle] = moving.errors();
            let met = MoveProgress {
                duration: step.duration,
                near: error <= self.p.tolerance && error_angle <= self.p.tolerance_angle,
                arrive: step.arrive,
                waits: step.touches() != [None; 2],
                ended: felt,
            };
            let DualProgress { begun, index, elapsed, done, failed, .. } = p;
            let mut place = Place { begun, index, elapsed, done, failed };
            if place.sample(&met, self.steps.len(), self.p.patience, clock.dt) {
                p.seen = look(clock, self.p.work_noise);
                match &moving {
                    Moving::Apart(now) => p.set_tips([0, 1].map(|k| now[k].wanted.X)),
                    Moving::Together(now) => {
                        p.set_object(now.wanted.X);
                        p.set_tips(in_hands.map(|X| now.wanted.X * X.inverse()));
                    }
                }
                let next = &self.steps[place.index as usize];
                let before = matches!(moving, Moving::Together(_)) && p.begun;
                if let Tracks::Together(_, axes) = &next.tracks
                    && !before
                {
                    let (O, in_hands) = found(tips.map(|t| t.0), *axes);
                    p.set_object(O);
                    p.set_in_hands(in_hands);
                }
            }
            (p.begun, p.index, p.elapsed) = (place.begun, place.index, place.elapsed);
            (p.done, p.failed) = (place.done, place.failed);
            p.put(d);
        }
        self.arm.give_back(m);
    }
}

impl DualArmController {
    /// Returns whether a compliant motion pushes with more than the contact force that the move waits for.
    fn felt(&self, step: &Step, m: &mut Memory, (tips, moving): (&[Tip; 2], &Moving)) -> bool {
        let waits = step.touches();
        if waits == [None; 2] {
            return false;
        }
        let mut a = [0.0; 12];
        let pushes = self.accelerations(step, m, (tips, moving), &mut a);
        pushes.is_some_and(|f| (0..2).any(|k| waits[k].is_some_and(|most| norm(&f[k][3..]) > most)))
    }

    /// Checks that every move can be followed within the joint limits, beginning at `ready`.
    fn reachable(&self) -> Result<(), BuildError> {
        if self.p.ready.is_empty() {
            return Ok(());
        }
        let mut follower = Follower::new(&self.arm, &self.p.ready)?;
        let mut from = [follower.tip(0)?, follower.tip(1)?];
        let mut object: Option<(Pose, [Pose; 2])> = None;
        for (m, step) in self.p.moves.iter().zip(&self.steps) {
            let T = step.duration;
            match &step.tracks {
                Tracks::Apart(tracks) => {
                    object = None;
                    let way = |k: usize, t: f64| Some(tracks[k].path.at(&from[k], t).X);
                    follower.follow(&m.name, T, way)?;
                    from = [0, 1].map(|k| tracks[k].path.at(&from[k], T).X);
                }
                Tracks::Together(track, axes) => {
                    let (O, in_hands) = object.unwrap_or_else(|| found(from, *axes));
                    let tip = |k: usize, t: f64| track.path.at(&O, t).X * in_hands[k].inverse();
                    follower.follow(&m.name, T, |k, t| Some(tip(k, t)))?;
                    from = [0, 1].map(|k| tip(k, T));
                    object = Some((track.path.at(&O, T).X, in_hands));
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
#[path = "dual_arm_controller_tests.rs"]
mod tests;
