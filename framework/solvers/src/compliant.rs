//! Compliant contact: penetration and bristle forces, for integrators that need smooth forces.
//!
//! [`contact_law`](crate::contact_law) has the equations. Each contact point has the depth δ and the normal n from a to b:
//! ```text
//! f = k δᵖ (1 + d δ̇), never pulling                                 N = Σ f,  c = Σ f p / N
//! ```
//! Each touching pair of colliders has one bristle (see `bristles`) with the deflection z (m, perpendicular to the mean normal) and one rotation θ (rad) about the normal. v is the slip velocity
//! at c, ω the spin, ρ the radius of gyration of the pressure:
//! ```text
//! |z|² and v·z of the law: |z|² + ρ² θ²  and  v·z + ρ² ω θ;  z_max = μ N / k_t
//! r = min(c, 1/τ),  ż = v − r z,  θ̇ = ω − r θ               τ: fast slip is followed no faster
//! F = −k_t z − d_t ż,  T = −ρ² (k_t θ + d_t θ̇),  scaled down to the cone √(|F|² + T²/ρ²) ≤ μ N
//! ```
//! Colliders with rolling or spinning resistance also have a moment −N (μ_r ω_t / √(ω_t² + ε²) + μ_s ω_n / √(ω_n² + ε²)), smooth at rest: below ε =
//! 0.05 rad/s, a rotation that should stop decays exponentially. The velocity of a surface that moves over its body is added to v.
//!
//! If the normal turns, the component of z along n relaxes. Bristles without contact relax too. Forces are continuous where depth and normals are.

use crate::bristles::{self, BRISTLE, Bristles, TooManyTouch};
use crate::contact_law::{RELAX, gives_way, normal_force};
use linkwork_collision::{
    ColliderId, Colliders, ContactPoint, Query, Resistance, Scratch, SurfaceVelocities,
};
use linkwork_dynamics::{Tree, Workspace};
use linkwork_multibody::BodyId;
use linkwork_spatial::{Force, Motion, Pose, Vec3};
use std::fmt;
use std::sync::Arc;
use thiserror::Error;

/// ε: scale of relative rotation at which rolling and spinning friction saturate, rad/s.
const RISES: f64 = 0.05;

/// Constants of compliant contact, except friction, which belongs to the colliders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompliantSettings {
    /// k: force of one contact point per metre of depth to the power p, N/mᵖ.
    pub stiffness: f64,
    /// p: 1.5 for balls, 1 for faces.
    pub exponent: f64,
    /// d: s/m. The coefficient of restitution is about 1 − ⅔ d v (times p/1.5) at impact speed v.
    pub damping: f64,
    /// k_t: bristle stiffness of a pair, N/m.
    pub bristle_stiffness: f64,
    /// d_t: bristle damping of a pair, N s/m.
    pub bristle_damping: f64,
    /// Shortest relaxation time of bristles under slip, s. Keep the step below twice this.
    pub relaxation: f64,
    /// Radius of a single-point contact, m, which gives its resistance to spin.
    pub radius: f64,
}

impl Default for CompliantSettings {
    fn default() -> Self {
        Self {
            stiffness: 1e5,
            exponent: 1.0,
            damping: 1.0,
            bristle_stiffness: 1e5,
            bristle_damping: 100.0,
            relaxation: 1e-3,
            radius: 1e-3,
        }
    }
}

/// An invalid constant.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("compliant contact: `{name}` is {value}\n  help: give a finite number, {wanted}")]
pub struct CompliantError {
    /// Name of the constant.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Requirement.
    pub wanted: &'static str,
}

impl CompliantSettings {
    /// # Errors
    /// The first invalid constant.
    pub fn check(&self) -> Result<(), CompliantError> {
        let all = [
            ("stiffness", self.stiffness, self.stiffness > 0.0, "above 0"),
            ("exponent", self.exponent, self.exponent >= 1.0, "1 or more"),
            ("damping", self.damping, self.damping >= 0.0, "0 or more"),
            ("bristle_stiffness", self.bristle_stiffness, self.bristle_stiffness > 0.0, "above 0"),
            ("bristle_damping", self.bristle_damping, self.bristle_damping >= 0.0, "0 or more"),
            ("relaxation", self.relaxation, self.relaxation > 0.0, "above 0"),
            ("radius", self.radius, self.radius >= 0.0, "0 or more"),
        ];
        match all.into_iter().find(|(_, x, fine, _)| !(*fine && x.is_finite())) {
            Some((name, value, _, wanted)) => Err(CompliantError { name, value, wanted }),
            None => Ok(()),
        }
    }
}

/// Constants of all pairs, and of the pairs with their own contact law.
#[derive(Clone, Default, PartialEq)]
pub struct CompliantLaws {
    /// Constants of pairs without a law.
    pub usual: CompliantSettings,
    /// Constants of each of [`Rules::laws`](linkwork_collision::Rules::laws); missing ones use the default.
    pub of_laws: Vec<CompliantSettings>,
    /// Greatest number of pairs that touch at the same time; `None`: six for each collider, and at least 256. Where fewer pairs may meet, each has
    /// its own bristle, and this has no effect.
    pub touching_max: Option<u32>,
}

/// Omits a usual limit, because the text is part of the hash of a plan.
impl fmt::Debug for CompliantLaws {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { usual, of_laws, touching_max } = self;
        let mut out = f.debug_struct("CompliantLaws");
        out.field("usual", usual).field("of_laws", of_laws);
        if let Some(limit) = touching_max {
            out.field("touching_max", limit);
        }
        out.finish()
    }
}

impl From<CompliantSettings> for CompliantLaws {
    fn from(usual: CompliantSettings) -> Self {
        Self { usual, of_laws: Vec::new(), touching_max: None }
    }
}

impl CompliantLaws {
    /// Returns the constants of a pair.
    pub(crate) fn of(
        &self,
        colliders: &Colliders,
        (a, b): (ColliderId, ColliderId),
    ) -> CompliantSettings {
        let own = colliders.law(a, b).and_then(|k| self.of_laws.get(k));
        *own.unwrap_or(&self.usual)
    }

    fn of_pair(&self, colliders: &Colliders, (a, b): (u32, u32)) -> CompliantSettings {
        let id = |k: u32| colliders.ids().nth(k as usize);
        id(a).zip(id(b)).map_or(self.usual, |ids| self.of(colliders, ids))
    }

    /// # Errors
    /// The first invalid constant.
    pub fn check(&self) -> Result<(), CompliantError> {
        self.of_laws.iter().chain([&self.usual]).try_for_each(CompliantSettings::check)
    }
}

/// Load between two colliders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairLoad {
    /// Body of the first collider; `None` is the world.
    pub body_a: Option<BodyId>,
    /// Body of the second collider, on which the force acts.
    pub body_b: Option<BodyId>,
    /// Force on b, normal and friction, world, N.
    pub force: Vec3,
    /// Point where the force acts, world, m.
    pub point: Vec3,
    /// Sum of the normal forces, N.
    pub pressure: f64,
    /// Power that surfaces moving over their bodies give to both bodies and to heat, W. Only compliant contact computes it; otherwise 0.
    pub surface_power: f64,
}

/// Normal force at one contact point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalLoad {
    /// Body of the first collider; `None` is the world.
    pub body_a: Option<BodyId>,
    /// Body of the second collider, which the force pushes along `normal`.
    pub body_b: Option<BodyId>,
    /// The point, world, m.
    pub point: Vec3,
    /// Unit normal from a to b, world.
    pub normal: Vec3,
    /// The force, N; not negative.
    pub force: f64,
}

/// Forces of compliant contact for one mechanism. It has workspace but no state: the caller keeps the bristles, and where pairs share them, the table
/// of pairs.
pub struct CompliantContact {
    /// Velocities of surfaces relative to their bodies. You may change them between calls.
    pub surfaces: SurfaceVelocities,
    colliders: Arc<Colliders>,
    laws: CompliantLaws,
    bristles: Bristles,
    scratch: Scratch,
    points: Vec<ContactPoint>,
    loads: Vec<PairLoad>,
    normals: Vec<NormalLoad>,
    /// Memory for the pairs that touch.
    touching: Vec<(u32, u32)>,
}

/// Sums over the points of a pair.
#[derive(Default)]
struct Patch {
    normal: Vec3,
    center: Vec3,
    pressure: f64,
    friction: f64,
    spread: f64,
}

impl CompliantContact {
    /// Creates the workspace for colliders.
    ///
    /// # Errors
    /// [`CompliantError`].
    pub fn new(
        colliders: Arc<Colliders>,
        laws: impl Into<CompliantLaws>,
    ) -> Result<Self, CompliantError> {
        let laws = laws.into();
        laws.check()?;
        Ok(Self {
            bristles: Bristles::new(&colliders, &laws),
            scratch: Scratch::new(&colliders),
            surfaces: colliders.surface_velocities(),
            points: Vec::new(),
            loads: Vec::new(),
            normals: Vec::new(),
            touching: Vec::new(),
            colliders,
            laws,
        })
    }

    /// Returns the number of states that the colliders need, [`BRISTLE`] for each bristle, and the length of the table of pairs: 0 where each pair has
    /// its own bristle, otherwise one entry for each bristle.
    #[must_use]
    pub fn states(colliders: &Colliders, laws: &CompliantLaws) -> (usize, usize) {
        let (count, shared) = bristles::count(colliders, laws);
        (BRISTLE * count, if shared { count } else { 0 })
    }

    /// Returns the contact points of the last call.
    #[must_use]
    pub fn points(&self) -> &[ContactPoint] {
        &self.points
    }

    /// Returns the loads of the last call, one for each pair in contact.
    #[must_use]
    pub fn loads(&self) -> &[PairLoad] {
        &self.loads
    }

    /// Returns the normal forces of the last call, one for each contact point with a force.
    #[must_use]
    pub fn normals(&self) -> &[NormalLoad] {
        &self.normals
    }

    /// Adds the forces at the state of the last [`kinematics`](linkwork_dynamics::kinematics()) to the workspace. `bristles` is the state (m, m, m,
    /// rad per bristle; world axes), `table` the table of pairs, both with the lengths of [`CompliantContact::states`]. Writes the derivative of
    /// `bristles` to `rates`.
    pub fn apply(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        (bristles, table): (&[f64], &[f64]),
        rates: &mut [f64],
    ) {
        self.find(tree, ws);
        self.loads.clear();
        self.normals.clear();
        let Self { surfaces, colliders, laws, points, loads, normals, .. } = self;
        let surfaces = Some(&*surfaces).filter(|s| s.any());
        let of = |pair| laws.of_pair(colliders, pair);
        self.bristles.begin(table, of);
        // Bristles of pairs that are apart relax; the rates of pairs that touch are set below.
        for (rate, z) in rates.iter_mut().zip(bristles) {
            *rate = -z / RELAX;
        }
        for touching in points.chunk_by(|p, q| (p.a, p.b) == (q.a, q.b)) {
            let (settings, bristle) = self.bristles.of(key(&touching[0]), of);
            let own = bristle.map(|k| BRISTLE * k..BRISTLE * (k + 1));
            let state = own.clone().map_or(&[0.0; BRISTLE][..], |own| &bristles[own]);
            let z = Vec3::new(state[0], state[1], state[2]);
            let extra = Surfaces::of(colliders, surfaces, tree, ws, touching);
            let ((z_dot, spin), load) =
                press(&settings, &extra, tree, ws, (touching, &mut *normals), z, state[3]);
            loads.extend(load);
            if let Some(own) = own {
                let rate = &mut rates[own];
                rate[..3].copy_from_slice(z_dot.as_slice());
                rate[3] = spin;
            }
        }
    }

    /// Finds the contact points at the state of the last [`kinematics`](linkwork_dynamics::kinematics()), as [`CompliantContact::apply`] does.
    pub fn find(&mut self, tree: &Tree, ws: &Workspace) {
        let poses = |b: Option<BodyId>| b.map_or_else(Pose::identity, |b| ws.body_pose(tree, b));
        self.colliders.contacts(&mut self.scratch, &Query::margin(0.0), poses, &mut self.points);
    }

    /// Brings the table of pairs up to date, at the boundary of a step and the state of the last [`CompliantContact::apply`] or
    /// [`CompliantContact::find`]: enters the pairs that touch, removes those whose bristle has relaxed, and sets the deflections of free bristles to
    /// zero. Returns whether a deflection changed, so that rates and forces have to be computed again.
    ///
    /// # Errors
    /// [`TooManyTouch`].
    pub fn assign(
        &mut self,
        bristles: &mut [f64],
        table: &mut [f64],
    ) -> Result<bool, TooManyTouch> {
        self.touching.clear();
        self.touching.extend(self.points.chunk_by(|p, q| key(p) == key(q)).map(|p| key(&p[0])));
        let (laws, colliders) = (&self.laws, &self.colliders);
        self.bristles.begin(table, |pair| laws.of_pair(colliders, pair));
        self.bristles.assign(&self.touching, bristles, table)
    }
}

/// Returns the indices of the two colliders of a contact point, the key of their pair.
fn key(p: &ContactPoint) -> (u32, u32) {
    (p.a.index() as u32, p.b.index() as u32)
}

/// Rolling and spinning resistance of a pair of surfaces, and their own motion.
#[derive(Default)]
struct Surfaces {
    resistance: Resistance,
    /// Surface velocity of b minus surface velocity of a, W.
    belt: Vec3,
}

impl Surfaces {
    fn of(
        colliders: &Colliders,
        surfaces: Option<&SurfaceVelocities>,
        tree: &Tree,
        ws: &Workspace,
        points: &[ContactPoint],
    ) -> Self {
        let Some(p) = points.first() else { return Self::default() };
        let mut out = Self::default();
        if colliders.resists() {
            out.resistance = colliders.resistance(p.a, p.b);
        }
        if let Some(surfaces) = surfaces {
            let moves = |id, body: Option<BodyId>| {
                let s = surfaces.of(id);
                body.map_or(s, |b| ws.body_rotation(tree, b) * s)
            };
            out.belt = moves(p.b, p.body_b) - moves(p.a, p.body_a);
        }
        out
    }

    /// Returns the moment on b against the relative rotation `w` under the normal force N n.
    fn moment(&self, w: &Vec3, n: &Vec3, N: f64) -> Vec3 {
        let Resistance { rolling, spinning } = self.resistance;
        let about = n.dot(w);
        let across = w - n * about;
        let part = |x2: f64| 1.0 / (x2 + RISES * RISES).sqrt();
        -N * (across * (rolling * part(across.norm_squared()))
            + n * (spinning * about * part(about * about)))
    }
}

fn velocity(tree: &Tree, ws: &Workspace, body: Option<BodyId>, at: &Vec3) -> Motion {
    body.map_or_else(
        || Motion::new(Vec3::zeros(), Vec3::zeros()),
        |b| {
            let (V, p) = (ws.body_velocity(tree, b), ws.body_pose(tree, b).position);
            Motion::new(V.angular, V.linear + V.angular.cross(&(at - p)))
        },
    )
}

/// Applies a moment and a force to body b at a point, and the opposite to body a.
fn apply(tree: &Tree, ws: &mut Workspace, p: &ContactPoint, at: &Vec3, w: Force) {
    for (body, sign) in [(p.body_a, -1.0), (p.body_b, 1.0)] {
        let Some(body) = body else { continue };
        let arm = at - ws.body_pose(tree, body).position;
        let moment = w.moment + arm.cross(&w.force);
        ws.add_wrench_at_body(tree, body, Force::new(moment * sign, w.force * sign));
    }
}

/// Computes the forces of one pair and adds the normal force of each point to `normals`. Returns the rates of its bristle, and its load if it is in
/// contact.
fn press(
    k: &CompliantSettings,
    extra: &Surfaces,
    tree: &Tree,
    ws: &mut Workspace,
    (points, normals): (&[ContactPoint], &mut Vec<NormalLoad>),
    z: Vec3,
    theta: f64,
) -> ((Vec3, f64), Option<PairLoad>) {
    let mut patch = Patch::default();
    for p in points.iter().filter(|p| p.gap < 0.0) {
        let (a, b) =
            (velocity(tree, ws, p.body_a, &p.point), velocity(tree, ws, p.body_b, &p.point));
        let closing = -(b.linear - a.linear).dot(&p.normal);
        let f = normal_force(k.stiffness, k.exponent, k.damping, -p.gap, closing);
        apply(tree, ws, p, &p.point, Force::new(Vec3::zeros(), p.normal * f));
        let ContactPoint { body_a, body_b, point, normal, .. } = *p;
        normals.extend((f > 0.0).then_some(NormalLoad { body_a, body_b, point, normal, force: f }));
        patch.pressure += f;
        patch.normal += p.normal * f;
        patch.center += (p.point - points[0].point) * f;
        patch.spread += (p.point - points[0].point).norm_squared() * f;
        patch.friction = p.friction;
    }
    let N = patch.pressure;
    if !(N > 0.0) {
        return ((-z / RELAX, -theta / RELAX), None);
    }
    let limit = patch.friction * N;
    let n = patch.normal.normalize();
    // Friction opposes the relative velocity v_b + s_b − v_a − s_a, where s is the velocity of the surface on its
    // body. The power of friction on s_b − s_a does not come from the motion of the bodies.
    let load = |friction: Vec3| {
        let (body_a, body_b) = (points[0].body_a, points[0].body_b);
        let point = points[0].point + patch.center / N;
        let (force, surface_power) = (patch.normal + friction, -friction.dot(&extra.belt));
        Some(PairLoad { body_a, body_b, force, point, pressure: N, surface_power })
    };
    if extra.resistance != Resistance::default() {
        let p = &points[0];
        let (a, b) =
            (velocity(tree, ws, p.body_a, &p.point), velocity(tree, ws, p.body_b, &p.point));
        let moment = extra.moment(&(b.angular - a.angular), &n, N);
        apply(tree, ws, p, &p.point, Force::new(moment, Vec3::zeros()));
    }
    if !(limit > 0.0) {
        return ((-z / RELAX, -theta / RELAX), load(Vec3::zeros()));
    }
    let offset = patch.center / N;
    let c = points[0].point + offset;
    let rho2 = (patch.spread / N - offset.norm_squared()).max(0.0) + k.radius * k.radius;
    let p = &points[0];
    let (a, b) = (velocity(tree, ws, p.body_a, &c), velocity(tree, ws, p.body_b, &c));
    let across = |x: Vec3| x - n * n.dot(&x);
    let (v, w) = (across(b.linear - a.linear + extra.belt), (b.angular - a.angular).dot(&n));
    let off = n * n.dot(&z);
    let z = z - off;
    let bent = (z.norm_squared() + rho2 * theta * theta).sqrt();
    let toward = if bent > 0.0 { (v.dot(&z) + rho2 * w * theta) / bent } else { 0.0 };
    let pull = gives_way(bent, toward, limit / k.bristle_stiffness).min(1.0 / k.relaxation);
    let (z_dot, theta_dot) = (v - z * pull, w - theta * pull);
    // The deflection stays perpendicular to the normal when that rotates (over an edge).
    let follows = z_dot - off / RELAX;
    let mut F = -(z * k.bristle_stiffness + z_dot * k.bristle_damping);
    let mut T = -rho2 * (k.bristle_stiffness * theta + k.bristle_damping * theta_dot);
    let size = (F.norm_squared() + if rho2 > 0.0 { T * T / rho2 } else { 0.0 }).sqrt();
    if size > limit {
        (F, T) = (F * (limit / size), T * (limit / size));
    }
    apply(tree, ws, p, &c, Force::new(n * T, F));
    ((follows, theta_dot), load(F))
}
