//! Damping, dry friction and stops of hinges: forces on coordinates that depend on the motion of the same coordinate.
//!
//! ```text
//! damping    τ = −d q̇
//! friction   τ = −F tanh(q̇ / w)                    only where it is integrated
//! spring     τ = −k (q − q₀), of a ball −k θ n      θ n: its whole rotation
//! stop       τ = ± max(0, k p (1 + min(1, c ṗ)))   only where it is integrated; p: how far past the limit
//!            k p ((1 + e²) + (1 − e²) tanh(ṗ / w)) / 2 with a restitution e: it returns e² of the energy
//!
//! usual stop     k = m (0.2 / h)²,  c = 1 s/rad or 10 s/m
//! ```
//! m is the effective inertia of the coordinate at the start, 1 / (M⁻¹)ᵢᵢ of the tree without loops; for a ball it is that along the direction d in
//! which the limit is exceeded, 1 / (d* M⁻¹ d). A coordinate that meets a default stop at the speed v, driven by an acceleration a, exceeds it by at
//! most 5 h v + 50 h² a if the inertia is m; if it is μ m, the first term is multiplied by √μ and the second by μ. With semi-implicit Euler it may be
//! more by the motion in one step, h v. It does not return faster than it entered the stop. With contact the step is explicit in damping, so
//! h d / m < 2 is required. These forces do not act on prescribed coordinates.
use crate::idle::limited;
use crate::spec::MechanismSpec;
use linkwork_dynamics::{Tree, Workspace, apply_inverse_mass, inverse_mass_diagonal, kinematics};
use linkwork_multibody::{
    BallLimits, Coordinate, Friction, Multibody, Spring, Stop, Subhinge, SubhingeKind,
    SubhingeRange,
};
use linkwork_runtime::Fault;
use linkwork_solvers::JointLimits;
use linkwork_spatial::{Mat3, Quat, Vec3, nalgebra};

/// Natural frequency of a default stop, in radians per step.
const SOFT: f64 = 0.2;
/// Ratio of step to decay time above which an explicit method amplifies decaying motions.
const STABLE: f64 = 2.0;

/// A stop of one coordinate.
#[derive(Clone, Copy, Debug)]
struct SoftStop {
    q: usize,
    v: usize,
    lower: f64,
    upper: f64,
    law: StopLaw,
}

/// Law of force of a stop.
#[derive(Clone, Copy, Debug)]
struct StopLaw {
    stiffness: f64,
    damping: f64,
    /// e², where a restitution is written.
    returns: Option<f64>,
}

/// Limits of a ball hinge with their stop.
#[derive(Clone, Copy, Debug)]
struct BallStop {
    q: usize,
    v: usize,
    limits: BallLimits,
    law: StopLaw,
    /// M⁻¹ of its three rates, if the law has the stiffness for a unit inertia.
    mobility: Option<Mat3>,
}

impl BallStop {
    /// The law along a direction.
    fn along(&self, d: &Vec3) -> StopLaw {
        let inertia = self.mobility.map_or(1.0, |m| 1.0 / d.dot(&(m * d)));
        StopLaw { stiffness: self.law.stiffness * inertia, ..self.law }
    }
}

/// Range of rates in which a stop with restitution changes from the compression force to the return force, rad/s or m/s.
const TURNS: f64 = 0.01;

/// Forces of hinges by index in β; empty if no hinge has any.
#[derive(Clone, Debug, Default)]
pub(crate) struct JointForces {
    damping: Vec<(usize, f64)>,
    /// Place, force, 1 / rate.
    friction: Vec<(usize, f64, f64)>,
    stops: Vec<SoftStop>,
    /// Index in q, index in β, stiffness, rest position.
    springs: Vec<(usize, usize, f64, f64)>,
    /// Springs of balls: index in q, index in β, stiffness.
    ball_springs: Vec<(usize, usize, f64)>,
    ball_stops: Vec<BallStop>,
}

impl JointForces {
    /// Adds the forces at (q, β) to `tau`.
    #[inline]
    pub fn add(&self, q: &[f64], v: &[f64], tau: &mut [f64]) {
        self.add_damping_friction_stops(q, v, tau);
        for &(at, i, stiffness, rest) in &self.springs {
            tau[i] += Spring { stiffness, rest }.force(q[at]);
        }
        if self.has_balls() {
            self.add_ball_springs(q, tau);
            self.add_ball_stops(q, v, tau);
        }
    }

    /// Adds the forces that lose energy, all except springs, at (q, β) to `tau`.
    pub fn add_losses(&self, q: &[f64], v: &[f64], tau: &mut [f64]) {
        self.add_damping_friction_stops(q, v, tau);
        self.add_ball_stops(q, v, tau);
    }

    /// Returns the elastic energy of the springs at q, J.
    pub fn spring_energy(&self, q: &[f64]) -> f64 {
        let one = self.springs.iter();
        let one = one.map(|&(at, _, stiffness, rest)| Spring { stiffness, rest }.energy(q[at]));
        let balls = self.ball_springs.iter().map(|&(at, _, stiffness)| {
            Spring { stiffness, rest: 0.0 }.energy_of_ball(&rotation(q, at))
        });
        one.chain(balls).sum()
    }

    #[inline]
    fn add_damping_friction_stops(&self, q: &[f64], v: &[f64], tau: &mut [f64]) {
        for &(i, d) in &self.damping {
            tau[i] -= d * v[i];
        }
        for &(i, force, inverse) in &self.friction {
            tau[i] -= force * (v[i] * inverse).tanh();
        }
        for s in &self.stops {
            let (q, v) = (q[s.q], v[s.v]);
            if q < s.lower {
                tau[s.v] += s.law.force(s.lower - q, -v);
            } else if q > s.upper {
                tau[s.v] -= s.law.force(q - s.upper, v);
            }
        }
    }

    /// Returns whether forces of balls act, whose derivatives are not available here.
    pub fn has_balls(&self) -> bool {
        !(self.ball_springs.is_empty() && self.ball_stops.is_empty())
    }

    fn add_ball_springs(&self, q: &[f64], tau: &mut [f64]) {
        for &(at, i, stiffness) in &self.ball_springs {
            let pull = Spring { stiffness, rest: 0.0 }.torque(&rotation(q, at));
            (0..3).for_each(|k| tau[i + k] += pull[k]);
        }
    }

    fn add_ball_stops(&self, q: &[f64], v: &[f64], tau: &mut [f64]) {
        for s in &self.ball_stops {
            let w = Vec3::new(v[s.v], v[s.v + 1], v[s.v + 2]);
            let past = s.limits.left(&q[s.q..s.q + 4]).into_iter().flatten();
            for (left, d) in past.filter(|(left, _)| *left < 0.0) {
                let push = d * s.along(&d).force(-left, -d.dot(&w));
                (0..3).for_each(|k| tau[s.v + k] += push[k]);
            }
        }
    }

    /// Derivatives of what [`JointForces::add`] adds: Calls `each` once for each force, with an index in β, ∂τ/∂q and ∂τ/∂β of that coordinate.
    pub fn jacobian(&self, q: &[f64], v: &[f64], mut each: impl FnMut(usize, f64, f64)) {
        for &(i, d) in &self.damping {
            each(i, 0.0, -d);
        }
        for &(i, force, inverse) in &self.friction {
            let part = (v[i] * inverse).tanh();
            each(i, 0.0, -force * inverse * (1.0 - part * part));
        }
        for &(_, i, stiffness, _) in &self.springs {
            each(i, -stiffness, 0.0);
        }
        for s in &self.stops {
            let (q, v) = (q[s.q], v[s.v]);
            let slopes = if q < s.lower {
                s.law.jacobian(s.lower - q, -v)
            } else if q > s.upper {
                s.law.jacobian(q - s.upper, v)
            } else {
                continue;
            };
            each(s.v, -slopes.0, -slopes.1);
        }
    }
}

/// Returns the rotation of the ball whose quaternion begins at `at`.
fn rotation(q: &[f64], at: usize) -> Quat {
    let r = &q[at..at + 4];
    Quat::new_unchecked(nalgebra::Quaternion::new(r[3], r[0], r[1], r[2]))
}

impl StopLaw {
    /// Returns the force towards the range at the depth `p` that grows with `rate`.
    fn force(&self, p: f64, rate: f64) -> f64 {
        if let Some(e2) = self.returns {
            return self.stiffness * p * 0.5 * ((1.0 + e2) + (1.0 - e2) * (rate / TURNS).tanh());
        }
        self.stiffness * p * (1.0 + (self.damping * rate).min(1.0)).max(0.0)
    }

    /// Returns the derivatives of [`StopLaw::force`] with respect to depth and rate.
    fn jacobian(&self, p: f64, rate: f64) -> (f64, f64) {
        if let Some(e2) = self.returns {
            let part = (rate / TURNS).tanh();
            let bend = 0.5 * (1.0 - e2) * (1.0 - part * part) / TURNS;
            let factor = 0.5 * ((1.0 + e2) + (1.0 - e2) * part);
            return (self.stiffness * factor, self.stiffness * p * bend);
        }
        let factor = 1.0 + (self.damping * rate).min(1.0);
        let varies = factor > 0.0 && self.damping * rate < 1.0;
        let by_rate = if varies { self.stiffness * p * self.damping } else { 0.0 };
        (self.stiffness * factor.max(0.0), by_rate)
    }
}

/// Returns the dry friction of hinges for the contact stepper: index in β, and force; entries of `given` are kept.
pub(crate) fn dry(m: &Multibody, given: &mut Vec<(usize, f64)>) {
    for (_, s) in m.subhinges().filter(|(_, s)| moves(s)) {
        let force = s.subhinge.friction.force;
        if force > 0.0 && !given.iter().any(|g| g.0 == s.v.start) {
            given.push((s.v.start, force));
        }
    }
}

fn moves(s: &SubhingeRange) -> bool {
    s.subhinge.coordinate == Coordinate::Free && !s.v.is_empty()
}

/// One hinge with settings.
struct At<'a> {
    spec: &'a MechanismSpec,
    body: &'a str,
    range: &'a SubhingeRange,
    /// Least 1 / (M⁻¹)ᵢᵢ of its coordinates; `None`: unknown.
    inertia: Option<f64>,
    /// M⁻¹ of the three rates of a ball.
    mobility: Option<Mat3>,
}

/// Returns M⁻¹ of three rates at the kinematics of `ws`; `None` if it is singular.
fn mobility(tree: &Tree, ws: &mut Workspace, first: usize) -> Option<Mat3> {
    let mut out = Mat3::zeros();
    let mut column = vec![0.0; tree.nv()];
    for k in 0..3 {
        column.fill(0.0);
        column[first + k] = 1.0;
        apply_inverse_mass(tree, ws, &mut column).ok()?;
        out.set_column(k, &Vec3::from_column_slice(&column[first..first + 3]));
    }
    Some(out).filter(|m| m.iter().all(|x| x.is_finite()))
}

/// Compiles the hinge forces of a mechanism; settings without effect are reported as warnings.
pub(crate) fn lower(spec: &MechanismSpec, tree: &Tree, warnings: &mut Vec<Fault>) -> JointForces {
    let (m, mut out) = (&*spec.multibody, JointForces::default());
    let smooth = spec.contact.is_none();
    let all: Vec<_> = m.subhinges().filter(|(_, s)| moves(s) && acts(&s.subhinge)).collect();
    if all.is_empty() {
        return out;
    }
    let mut ws = Workspace::new(tree);
    kinematics(tree, &mut ws, &spec.q, &spec.v);
    let mut lightness = vec![0.0; m.nv()];
    let known = inverse_mass_diagonal(tree, &mut ws, &mut lightness).is_ok();
    let inertia = |i: usize| {
        (known && lightness[i].is_finite() && lightness[i] > 0.0).then(|| 1.0 / lightness[i])
    };
    for (id, range) in all {
        let least = range.v.clone().map(inertia).reduce(|a, b| Some(a?.min(b?)));
        let s = &range.subhinge;
        let ball = smooth && s.kind == SubhingeKind::Ball && limited(s) && known;
        let mobility = if ball { mobility(tree, &mut ws, range.v.start) } else { None };
        let at = At { spec, body: m.get(id).name(), range, inertia: least.flatten(), mobility };
        if s.damping != 0.0 {
            out.damping.extend(range.v.clone().map(|i| (i, s.damping)));
        }
        if s.spring.stiffness != 0.0 {
            let (q, v) = (range.q.start, range.v.start);
            match s.kind {
                SubhingeKind::Ball => out.ball_springs.push((q, v, s.spring.stiffness)),
                _ => out.springs.push((q, v, s.spring.stiffness, s.spring.rest)),
            }
        }
        if smooth {
            at.friction(&mut out);
            at.stop(&mut out, warnings);
        } else if spec.contact.as_ref().is_some_and(|c| c.settings.limits == JointLimits::Stop) {
            at.outside(warnings);
        }
        at.stiff(smooth, warnings);
    }
    out
}

fn acts(s: &Subhinge) -> bool {
    s.damping != 0.0 || s.spring != Spring::NONE || s.friction != Friction::NONE || limited(s)
}

impl At<'_> {
    fn warn(&self, warnings: &mut Vec<Fault>, fact: &str, help: &str) {
        let origin = self.spec.bodies.get(self.body).copied().unwrap_or(self.spec.origin);
        let fact = format!("body `{}`: {fact}", self.body);
        warnings.push(Fault::new(origin, fact).help(help));
    }

    fn friction(&self, out: &mut JointForces) {
        let Friction { force, rate } = self.range.subhinge.friction;
        if force > 0.0 && rate > 0.0 {
            out.friction.push((self.range.v.start, force, 1.0 / rate));
        }
    }

    fn stop(&self, out: &mut JointForces, warnings: &mut Vec<Fault>) {
        let s = &self.range.subhinge;
        if !limited(s) || s.stop == Stop::Off {
            return;
        }
        let slides = matches!(s.kind, SubhingeKind::Slider { .. });
        let (stiffness, damping) = match (s.stop, self.spec.step, self.inertia) {
            (Stop::Soft { stiffness, damping }, ..) => (stiffness, damping),
            (_, Some(h), Some(m)) if h > 0.0 => {
                (m * (SOFT / h) * (SOFT / h), if slides { 10.0 } else { 1.0 })
            }
            _ => {
                self.warn(
                    warnings,
                    "its limits have no effect, because their stiffness cannot be computed: the step or the moved inertia is not known",
                    "write `stop: (stiffness: ..)`, or `stop: false` if it may pass them",
                );
                return;
            }
        };
        self.outside(warnings);
        let returns = s.restitution.map(|e| e * e);
        let (q, v) = (self.range.q.start, self.range.v.start);
        if s.kind == SubhingeKind::Ball {
            let usual = !matches!(s.stop, Stop::Soft { .. });
            let mobility = self.mobility.filter(|_| usual);
            let unit = if mobility.is_some() { self.inertia.unwrap_or(1.0) } else { 1.0 };
            let law = StopLaw { stiffness: stiffness / unit, damping, returns };
            out.ball_stops.push(BallStop { q, v, limits: s.ball, law, mobility });
            return;
        }
        let law = StopLaw { stiffness, damping, returns };
        let (lower, upper) = (s.limits.lower, s.limits.upper);
        out.stops.push(SoftStop { q, v, lower, upper, law });
    }

    /// Warns of a start outside the limits, from which a stop or contact pushes the coordinate back.
    fn outside(&self, warnings: &mut Vec<Fault>) {
        let s = &self.range.subhinge;
        if !limited(s) {
            return;
        }
        let help = match self.spec.contact {
            Some(_) => {
                "start within the limits, or write `limits: false` in `contact` if it may pass them"
            }
            None => "start within the limits, or write `stop: false` if it may pass them",
        };
        let q = self.range.q.start;
        if s.kind == SubhingeKind::Ball {
            let begins = self.spec.q.get(q..q + 4).map(|q| s.ball.left(q));
            let past = begins.into_iter().flatten().flatten().find(|(left, _)| *left < 0.0);
            if let Some((left, _)) = past {
                let fact = format!("it starts {:.3} rad past a limit of its ball", -left);
                self.warn(warnings, &fact, help);
            }
            return;
        }
        let (lower, upper) = (s.limits.lower, s.limits.upper);
        let start = self.spec.q.get(q).copied().unwrap_or_default();
        if start < lower || start > upper {
            let fact = format!("it starts at {start}, outside its limits {lower} … {upper}");
            self.warn(warnings, &fact, help);
        }
    }

    /// Warns of damping whose decay is faster than the step can resolve.
    fn stiff(&self, smooth: bool, warnings: &mut Vec<Fault>) {
        let s = &self.range.subhinge;
        let rubs = smooth && s.friction.force > 0.0 && s.friction.rate > 0.0;
        let slope = if rubs { s.friction.force / s.friction.rate } else { 0.0 };
        let d = s.damping + slope;
        let (Some(h), Some(m)) = (self.spec.step, self.inertia) else { return };
        if h * d > STABLE * m {
            let fact = format!(
                "the time constant of its damping and friction is {:.2e} s, but the step is {h:.2e} s: explicit \
                 methods are unstable",
                m / d
            );
            let help = format!(
                "use a step below {:.1e} s, less damping, more armature, or `rodas4p`",
                STABLE * m / d
            );
            self.warn(warnings, &fact, &help);
        }
    }
}
