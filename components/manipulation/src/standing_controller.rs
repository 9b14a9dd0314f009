//! `manipulation.standing_controller`: a legged machine stands up, keeps its balance and sways. Torques come from inverse dynamics with contact
//! forces within friction limits.
//! ```text
//! estimate     attitude and angular velocity from a sensor; the feet are assumed at rest: their mean position is the origin, their mean velocity is zero
//! command      c: centre of mass, minimum-jerk rise, then sway A sin(2π t/T);   R: level, with the heading of the start
//!              a_c = A_r + 2 ω ė + ω² e,   α = ω² log(R_r Rᵀ) − 2 ω w
//!              a_trunk ← a_trunk + a_c − a(a_trunk), four times from a_c − α × r − w × (w × r)      r: from the trunk's origin to c; a: of c, from all bodies
//! legs         J_leg q̈ = −2 ω ẋ − J̇ v − J_trunk v̇_trunk           the feet come to rest
//! forces       τ' = M v̇ + C + g;  the feet must supply its trunk rows: B s = τ'_trunk
//!              s = argmin |W (B s − τ'_trunk)|² + ε |s|²,  0 ≤ s ≤ s_max       s: four edges of the friction pyramid of each foot, W = diag(1/ℓ, 1)
//! torques      τ = τ'_joints − Jᵀ f
//! ```
//! The ground is assumed level. The friction cone is approximated by an inscribed pyramid. The bounded least-squares problem is solved by `bounded`
//! of `linkwork-embedded`.

use crate::arm_controller::{JointIn, JointOut};
use crate::moves::{Move, Path, Written, short};
use crate::standing_ports::{Stand, StandingOut, StandingParams, TrunkIn};
use crate::tracking::norm;
use linkwork_embedded::formats::Root;
use linkwork_embedded::multibody::Limits;
use linkwork_embedded::{
    ModelSpec, Part, PartSpec, Robot, RobotError, RobotModel, Sweeps, bounded,
};
use linkwork_runtime::prelude::*;
use linkwork_spatial::nalgebra::{Matrix3, Vector6};
use linkwork_spatial::{Motion, Pose};
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError};

/// Maximum number of feet, and number of edges of each friction pyramid.
const FEET_MAX: usize = 8;
const EDGES: usize = 4;
/// Number of fixed-point iterations for the acceleration of the trunk.
const PASSES: usize = 4;
/// Iteration limit and convergence tolerance (N) of the contact forces, ε relative to the mean diagonal, and ℓ (m).
const SWEEPS: Sweeps = Sweeps { most: 400, settled: 1e-7 };
const WEIGHT: f64 = 1e-4;
const LENGTH: f64 = 0.2;

/// A leg of the embedded model.
#[derive(Debug)]
struct Leg {
    chain: Part,
    /// Indices of its joints in β, trunk to foot.
    dofs: [usize; 3],
}

/// Controller of a legged machine; its data are constant during a run.
pub struct StandingController {
    p: StandingParams,
    model: Arc<RobotModel>,
    legs: Vec<Leg>,
    /// First indices of the trunk in q and β.
    trunk: (usize, usize),
    /// Index in q of each joint, by its index in β.
    places: Vec<usize>,
    limits: Vec<Limits>,
    rise: Path,
    /// Working memories that no call is using.
    idle: Mutex<Vec<Memory>>,
}

/// Working memory of a call.
struct Memory {
    robot: Robot,
    q: Vec<f64>,
    v: Vec<f64>,
    vdot: Vec<f64>,
    tau: Vec<f64>,
    M: Vec<f64>,
    /// Jacobian of each foot, 6 × nv.
    J: Vec<Vec<f64>>,
    bias: Vec<Motion>,
    normal: Vec<f64>,
    B: Vec<Vector6<f64>>,
}

/// Estimated pose of the machine relative to the mean position of its feet.
struct StanceEstimate {
    R: Quat,
    /// Angular velocity, W.
    w: Vec3,
    trunk: Vec3,
    mass: f64,
    com: Vec3,
    velocity: Vec3,
    feet: [Vec3; FEET_MAX],
}

fn legs_of(p: &StandingParams) -> Result<(Arc<RobotModel>, Vec<Leg>), BuildError> {
    let fault = |e: &dyn std::fmt::Display, at: &str| BuildError::new(e.to_string()).at(at);
    let d = p.robot.read(Root::Free, p.inertia_check)?;
    let mut spec = ModelSpec::from_description(&d).map_err(|e| fault(&e, "robot"))?;
    if !(3..=FEET_MAX).contains(&p.feet.len()) {
        let fact =
            format!("{} feet are not supported: a machine stands on 3 to {FEET_MAX}", p.feet.len());
        return Err(BuildError::new(fact).help("write the links of its feet").at("feet"));
    }
    let joints = 3 * p.feet.len();
    if !p.armature.is_empty() && p.armature.len() != joints {
        let fact = format!("`armature` has {} numbers for {joints} joints", p.armature.len());
        let help = "write one value for each joint, leg by leg, from trunk to foot";
        return Err(BuildError::new(fact).help(help).at("armature"));
    }
    if let Some(bad) = p.armature.iter().find(|a| !(a.is_finite() && **a >= 0.0)) {
        let fact = format!("`armature` contains {bad} kg m²");
        return Err(BuildError::new(fact).help("write values of 0 or more").at("armature"));
    }
    if let Some(mass) = p.trunk_mass {
        let trunk = spec.mechanism.bodies_mut().iter_mut().find(|b| b.name == p.trunk);
        let Some(trunk) = trunk.filter(|b| b.mass.mass > 0.0) else {
            let fact = format!("`{}` is not a link with a mass", p.trunk);
            return Err(BuildError::new(fact).help("name the trunk's link").at("trunk"));
        };
        trunk.mass.inertia_com *= mass / trunk.mass.mass;
        trunk.mass.mass = mass;
    }
    for (k, foot) in p.feet.iter().enumerate() {
        spec.parts.push(PartSpec::chain(&format!("leg {k}"), &p.trunk, foot));
        if p.armature.is_empty() {
            continue;
        }
        let Some(moving) = crate::arm::chain(&spec, &p.trunk, foot) else { continue };
        for (at, armature) in moving.iter().zip(&p.armature[3 * k..]) {
            let hinge = &mut spec.mechanism.bodies_mut()[*at].hinge;
            *hinge = hinge.clone().armature(*armature);
        }
    }
    let model = RobotModel::new(&spec).map_err(|e| fault(&e, "robot"))?;
    let mut legs = Vec::new();
    for k in 0..p.feet.len() {
        let no = || BuildError::new("the robot has no such leg").at("feet");
        let chain = model.part(&format!("leg {k}")).ok_or_else(no)?;
        let own = model.dofs(chain).map_err(|e| fault(&e, "feet"))?;
        let dofs = <[usize; 3]>::try_from(own).map_err(|_| {
            let fact = format!("the leg to `{}` has {} joints", p.feet[k], own.len());
            BuildError::new(fact)
                .help("each leg needs three joints, and legs cannot share joints")
                .at("feet")
        })?;
        legs.push(Leg { chain, dofs });
    }
    let mut all: Vec<usize> = legs.iter().flat_map(|l| l.dofs).collect();
    all.sort_unstable();
    all.dedup();
    if all.len() != joints || model.nv() != joints + 6 {
        let fact = format!(
            "the machine has {} degrees of freedom; a trunk and {} legs of three joints have {}",
            model.nv(),
            legs.len(),
            joints + 6
        );
        let help = "name the feet of all legs, and fix other joints in the file";
        return Err(BuildError::new(fact).help(help).at("feet"));
    }
    Ok((model, legs))
}

impl StandingController {
    fn memory(&self) -> Result<Memory, RobotError> {
        let mut robot = Robot::new(&self.model);
        robot.set_gravity(self.p.gravity.unwrap_or_default())?;
        let (nq, nv, feet) = (self.model.nq(), self.model.nv(), self.legs.len());
        let edges = EDGES * feet;
        Ok(Memory {
            robot,
            q: vec![0.0; nq],
            v: vec![0.0; nv],
            vdot: vec![0.0; nv],
            tau: vec![0.0; nv],
            M: vec![0.0; nv * nv],
            J: vec![vec![0.0; 6 * nv]; feet],
            bias: vec![Motion::zero(); feet],
            normal: vec![0.0; edges * edges],
            B: vec![Vector6::zeros(); edges],
        })
    }

    fn take(&self) -> Option<Memory> {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        idle.map_or_else(|| self.memory().ok(), Some)
    }

    fn give_back(&self, memory: Memory) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(memory);
    }

    /// Sets the embedded model to the measured state, with the mean position of the feet at the origin and at rest. Returns `None` for non-finite
    /// measurements.
    fn see(&self, m: &mut Memory, u: &[f64]) -> Option<StanceEstimate> {
        let joints = 6 * self.legs.len();
        let trunk = TrunkIn::get(&u[joints..]);
        let (iq, iv) = self.trunk;
        let R = Quat::new_normalize(trunk.rotation.into_inner());
        m.q[iq..iq + 7].copy_from_slice(&[0.0, 0.0, 0.0, R.i, R.j, R.k, R.w]);
        let w = trunk.angular;
        m.v[iv..iv + 6].copy_from_slice(&[w.x, w.y, w.z, 0.0, 0.0, 0.0]);
        let dofs = self.legs.iter().flat_map(|l| l.dofs);
        for (pair, k) in u[..joints].chunks_exact(2).zip(dofs) {
            (m.q[self.places[k]], m.v[k]) = (pair[0], pair[1]);
        }
        if !m.v.iter().all(|v| v.is_finite()) {
            return None;
        }
        m.robot.set_q(&m.q).ok()?;
        let (mut middle, mut drift) = (Vec3::zeros(), Vec3::zeros());
        let share = 1.0 / self.legs.len() as f64;
        for (leg, J) in self.legs.iter().zip(&mut m.J) {
            middle += m.robot.tip_pose(leg.chain).ok()?.position * share;
            m.robot.whole_jacobian(leg.chain, J).ok()?;
            drift += linear(J, &m.v) * share;
        }
        let p = -middle;
        m.q[iq..iq + 3].copy_from_slice(p.as_slice());
        m.v[iv + 3..iv + 6].copy_from_slice((R.inverse() * -drift).as_slice());
        m.robot.set_q(&m.q).ok()?;
        let mut feet = [Vec3::zeros(); FEET_MAX];
        for ((leg, J), foot) in self.legs.iter().zip(&mut m.J).zip(&mut feet) {
            *foot = m.robot.tip_pose(leg.chain).ok()?.position;
            m.robot.whole_jacobian(leg.chain, J).ok()?;
        }
        m.robot.mass_matrix(&mut m.M).ok()?;
        let (mass, com) = m.robot.center_of_mass();
        // The trunk rows of the mass matrix give the total momentum in the axes of the trunk.
        let n = m.v.len();
        let row = |k: usize| (0..n).map(|j| m.M[(iv + 3 + k) * n + j] * m.v[j]).sum::<f64>();
        let velocity = R * Vec3::new(row(0), row(1), row(2)) / mass;
        Some(StanceEstimate { R, w: R * w, trunk: p, mass, com, velocity, feet })
    }

    /// Returns the commanded position, velocity and acceleration of the centre of mass.
    fn wanted(&self, d: &Stand) -> [Vec3; 3] {
        let r = self.rise.at(&Pose::new(Quat::identity(), d.start), d.elapsed);
        let (mut c, mut v, mut a) = (r.X.position, r.V.linear, r.A.linear);
        let t = d.elapsed - self.p.sway_from;
        if t > 0.0 {
            let axes = Quat::from_axis_angle(&Vec3::z_axis(), d.heading);
            let (w, u) = (TAU / self.p.sway_period, (t / self.p.sway_period).min(1.0));
            // The amplitude grows as u² (3 − 2 u).
            let T = self.p.sway_period;
            let [b, db, ddb] = match u < 1.0 {
                true => [
                    u * u * (3.0 - 2.0 * u),
                    6.0 * u * (1.0 - u) / T,
                    6.0 * (1.0 - 2.0 * u) / (T * T),
                ],
                false => [1.0, 0.0, 0.0],
            };
            let (sin, cos) = (w * t).sin_cos();
            let way = axes * self.p.sway;
            c += way * (b * sin);
            v += way * (db * sin + b * w * cos);
            a += way * (ddb * sin + 2.0 * db * w * cos - b * w * w * sin);
        }
        [c, v, a]
    }

    /// Writes torques to `m.tau` and returns the outputs, or `None` if a leg is fully extended (singular).
    fn torques(&self, d: &Stand, m: &mut Memory, seen: &StanceEstimate) -> Option<StandingOut> {
        let [c, v, a] = self.wanted(d);
        let w = self.p.bandwidth;
        let (e, de) = (c - seen.com, v - seen.velocity);
        let a_com = a + 2.0 * w * de + w * w * e;
        let level = Quat::from_axis_angle(&Vec3::z_axis(), d.heading);
        let turn = short(level * seen.R.inverse());
        let alpha = w * w * turn - 2.0 * w * seen.w;
        let r = seen.com - seen.trunk;
        let mut a_trunk = a_com - alpha.cross(&r) - seen.w.cross(&seen.w.cross(&r));
        let chains: [Part; FEET_MAX] =
            std::array::from_fn(|k| self.legs[k.min(self.legs.len() - 1)].chain);
        m.robot.bias(&m.v, &chains[..self.legs.len()], &mut m.tau, &mut m.bias).ok()?;
        let iv = self.trunk.1;
        for _ in 0..PASSES {
            self.accelerate(m, seen, (alpha, a_trunk))?;
            // The trunk rows are the rate of the total momentum minus the weight, in the axes of the trunk.
            let row = Vec3::new(m.tau[iv + 3], m.tau[iv + 4], m.tau[iv + 5]);
            a_trunk += a_com - (seen.R * row / seen.mass + self.p.gravity.unwrap_or_default());
        }
        let forces = self.forces(m);
        let inside = inside(&seen.feet[..self.legs.len()], &seen.com);
        let n = m.v.len();
        let mut lack = Vec3::new(m.tau[iv + 3], m.tau[iv + 4], m.tau[iv + 5]);
        let (mut friction, mut press) = (0.0_f64, f64::INFINITY);
        for ((leg, J), f) in self.legs.iter().zip(&m.J).zip(&forces) {
            for d in leg.dofs {
                m.tau[d] -= (0..3).map(|i| J[(3 + i) * n + d] * f[i]).sum::<f64>();
            }
            lack -= seen.R.inverse() * f;
            press = press.min(f.z);
            friction = friction.max(if f.z > 1e-9 { f.xy().norm() / f.z } else { 0.0 });
        }
        Some(StandingOut {
            stands: d.elapsed >= self.p.rise
                && inside > 0.0
                && seen.com.z > 0.5 * self.p.height
                && turn.norm() < 0.5,
            singular: false,
            limited: false,
            com: seen.com,
            error: e.norm(),
            error_angle: turn.norm(),
            inside,
            friction,
            press,
            lack: lack.norm(),
            share: 0.0,
        })
    }

    /// Computes all accelerations (`m.vdot`) from the trunk acceleration (angular, linear, W) for feet that come to rest, and the generalized forces
    /// (`m.tau`). Returns `None` if a leg is fully extended.
    fn accelerate(
        &self,
        m: &mut Memory,
        seen: &StanceEstimate,
        (alpha, a): (Vec3, Vec3),
    ) -> Option<()> {
        // These are the derivatives of the trunk velocity in the axes of the trunk.
        let (iv, back) = (self.trunk.1, seen.R.inverse());
        let own = Vec3::new(m.v[iv + 3], m.v[iv + 4], m.v[iv + 5]);
        let (turning, moving) = (back * alpha, back * a - (back * seen.w).cross(&own));
        m.vdot[iv..iv + 3].copy_from_slice(turning.as_slice());
        m.vdot[iv + 3..iv + 6].copy_from_slice(moving.as_slice());
        let n = m.v.len();
        for (k, leg) in self.legs.iter().enumerate() {
            let J = &m.J[k];
            let by_trunk = columns(J, &m.vdot, iv..iv + 6);
            let rest = -2.0 * self.p.bandwidth * linear(J, &m.v);
            let wanted = rest - m.bias[k].linear - by_trunk;
            let own = Matrix3::from_fn(|i, j| J[(3 + i) * n + leg.dofs[j]]);
            // The leg is fully extended if the determinant is small compared with the product of the column norms.
            let size: f64 = own.column_iter().map(|c| c.norm()).product();
            if !(own.determinant().abs() > 1e-3 * size) {
                return None;
            }
            let rates = own.lu().solve(&wanted)?;
            leg.dofs.iter().zip(rates.iter()).for_each(|(d, x)| m.vdot[*d] = *x);
        }
        m.robot.feed_forward(&m.v, &m.vdot, &[], &mut m.tau).ok()
    }

    /// Returns the contact forces on the feet (N, W) that supply the trunk rows of `m.tau`.
    fn forces(&self, m: &mut Memory) -> [Vec3; FEET_MAX] {
        let (iv, n) = (self.trunk.1, m.v.len());
        let edges = EDGES * self.legs.len();
        let side = self.p.friction / std::f64::consts::SQRT_2;
        let weigh =
            |x: Vector6<f64>| Vector6::from_fn(|k, _| if k < 3 { x[k] / LENGTH } else { x[k] });
        let ray = |k: usize| {
            let [x, y] = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]][k % EDGES];
            Vec3::new(side * x, side * y, 1.0)
        };
        for k in 0..edges {
            let (J, r) = (&m.J[k / EDGES], ray(k));
            let give = |j: usize| (0..3).map(|i| J[(3 + i) * n + iv + j] * r[i]).sum::<f64>();
            m.B[k] = weigh(Vector6::from_fn(|j, _| give(j)));
        }
        let wanted = weigh(Vector6::from_fn(|k, _| m.tau[iv + k]));
        let mut trace = 0.0;
        for i in 0..edges {
            for j in 0..edges {
                m.normal[i * edges + j] = m.B[i].dot(&m.B[j]);
            }
            trace += m.normal[i * edges + i];
        }
        (0..edges).for_each(|i| m.normal[i * edges + i] += WEIGHT * trace / edges as f64);
        let (mut right, mut s) = ([0.0; EDGES * FEET_MAX], [0.0; EDGES * FEET_MAX]);
        // Start the iteration with the weight shared equally by all edges.
        let start = wanted.fixed_rows::<3>(3).norm() / edges as f64;
        for k in 0..edges {
            (right[k], s[k]) = (m.B[k].dot(&wanted), start.min(self.p.force_max));
        }
        let ends = [0.0, self.p.force_max];
        bounded(&m.normal, &right[..edges], ends, &SWEEPS, &mut s[..edges]);
        let mut forces = [Vec3::zeros(); FEET_MAX];
        (0..edges).for_each(|k| forces[k / EDGES] += ray(k) * s[k]);
        forces
    }
}

/// Returns the velocity of a foot's origin, m/s.
fn linear(J: &[f64], v: &[f64]) -> Vec3 {
    columns(J, v, 0..v.len())
}

/// Returns the contribution of a range of rates to that velocity.
fn columns(J: &[f64], v: &[f64], which: std::ops::Range<usize>) -> Vec3 {
    let n = v.len();
    Vec3::from_fn(|i, _| which.clone().map(|k| J[(3 + i) * n + k] * v[k]).sum::<f64>())
}

/// Returns the horizontal distance of a point from the nearest edge of a polygon, negative outside. The corners are in order around the polygon.
fn inside(corners: &[Vec3], p: &Vec3) -> f64 {
    let n = corners.len();
    let next = |k: usize| corners[(k + 1) % n];
    let cross = |a: Vec3, b: Vec3| a.x * b.y - a.y * b.x;
    let area: f64 = (0..n).map(|k| cross(corners[k], next(k))).sum();
    let edges = (0..n).map(|k| {
        let way = next(k) - corners[k];
        area.signum() * cross(way, p - corners[k]) / way.xy().norm()
    });
    edges.fold(f64::INFINITY, f64::min)
}

/// Makes a legged machine stand up, hold its centre of mass and sway, by inverse dynamics of an embedded model with contact forces within friction
/// limits.
#[model("manipulation.standing_controller")]
impl SizedModel for StandingController {
    type Params = StandingParams;

    fn ports(p: &StandingParams) -> SizedPorts {
        // `build` reports an error for a description without these legs.
        let joints = legs_of(p).map_or(0, |(_, legs)| 3 * legs.len());
        let group = |k: usize| format!("joints[{k}]");
        let inputs = (0..joints).flat_map(|k| PortSpec::group::<JointIn>(group(k), "Encoder"));
        let torques = (0..joints).flat_map(|k| PortSpec::group::<JointOut>(group(k), "Drive"));
        SizedPorts {
            feedthrough_inputs: inputs.chain(TrunkIn::specs()).collect(),
            feedthrough_outputs: torques.chain(StandingOut::specs()).collect(),
            discrete: Stand::specs(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(mut p: StandingParams) -> Result<Self, BuildError> {
        p.gravity = Some(crate::believed(p.gravity, p.field.as_ref()));
        let (model, legs) = legs_of(&p)?;
        let free = || {
            let fact = format!("`{}` is not the floating base", p.trunk);
            BuildError::new(fact).help("name the root link of the file").at("trunk")
        };
        let body = model.multibody().body(&p.trunk).ok_or_else(free)?;
        let found = model.multibody().subhinges().find(|(b, s)| *b == body && s.v.len() == 6);
        let trunk = found.map(|(_, s)| (s.q.start, s.v.start)).ok_or_else(free)?;
        let mut limits = vec![Limits::NONE; model.nv()];
        let mut places = vec![0; model.nv()];
        for (_, s) in model.multibody().subhinges().filter(|(_, s)| s.v.len() == 1) {
            (limits[s.v.start], places[s.v.start]) = (s.subhinge.limits, s.q.start);
        }
        let up = Some(Vec3::new(0.0, 0.0, p.height));
        let rise = Move { position: up, frame: Written::Base, ..Move::stay("rise", p.rise) };
        let rise = Path::new(&rise, &Pose::identity())?;
        let idle = Mutex::default();
        let new = Self { p, model, legs, trunk, places, limits, rise, idle };
        let memory = new.memory().map_err(|e| BuildError::new(e.to_string()).at("robot"))?;
        new.give_back(memory);
        Ok(new)
    }

    fn initial(&self, _: &mut [f64], d: &mut [f64]) {
        Stand { begun: false, elapsed: 0.0, heading: 0.0, start: Vec3::zeros() }.put(d);
    }

    fn feedthrough(&self, d: &[f64], u: &[f64], y: &mut [f64]) {
        let mut d = Stand::get(d);
        // Non-finite inputs give NaN torques, which stop the run with an error.
        y.fill(f64::NAN);
        let Some(mut m) = self.take() else { return };
        if let Some(seen) = self.see(&mut m, u) {
            if !d.begun {
                d = begin(&seen);
            }
            let out = self.torques(&d, &mut m, &seen);
            let (mut limited, mut share) = (false, 0.0_f64);
            let n = m.v.len();
            for (y, k) in y.iter_mut().zip(self.legs.iter().flat_map(|l| l.dofs)) {
                let damped = -2.0 * self.p.bandwidth * m.M[k * n + k] * m.v[k];
                let (tau, most) =
                    (if out.is_some() { m.tau[k] } else { damped }, self.limits[k].effort);
                limited |= tau.abs() > most;
                share = share.max(if most.is_finite() { tau.abs() / most } else { 0.0 });
                *y = tau.clamp(-most, most);
            }
            let fallen = StandingOut {
                stands: false,
                singular: true,
                limited,
                com: seen.com,
                error: norm((self.wanted(&d)[0] - seen.com).as_slice()),
                error_angle: 0.0,
                inside: inside(&seen.feet[..self.legs.len()], &seen.com),
                friction: 0.0,
                press: 0.0,
                lack: 0.0,
                share,
            };
            let out = out.map_or(fallen, |o| StandingOut { limited, share, ..o });
            out.put(&mut y[3 * self.legs.len()..]);
        }
        self.give_back(m);
    }

    fn update(&self, clock: &Clock, d: &mut [f64], u: &[f64]) {
        let mut p = Stand::get(d);
        if !p.begun {
            let Some(mut m) = self.take() else { return };
            if let Some(seen) = self.see(&mut m, u) {
                p = begin(&seen);
            }
            self.give_back(m);
        }
        p.elapsed += clock.dt;
        p.put(d);
    }
}

fn begin(seen: &StanceEstimate) -> Stand {
    let forward = seen.R * Vec3::x();
    let heading = forward.y.atan2(forward.x);
    Stand { begun: true, elapsed: 0.0, heading, start: seen.com }
}

#[cfg(test)]
#[path = "standing_controller_tests.rs"]
mod tests;
