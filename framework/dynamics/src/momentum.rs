//! Momentum, kinetic and potential energy, centre of mass, subtree inertia.
//!
//! The sums over links are relative to the first link, so the distance from the world's origin cancels.

use crate::composite::world_inertia;
use crate::kinematics::check;
use crate::lane::Lane;
use crate::linear::V3;
use crate::query::{mat3, v3, vec3};
use crate::tree::{Kind, Tree};
use crate::work::{Work, Workspace};
use linkwork_multibody::BodyId;
use linkwork_spatial::{Force, RigidInertia, Vec3};

/// Returns the momentum about the centre of mass of all moving bodies: angular (kg m²/s) in `moment`, linear (kg m/s) in `force`; world axes. Call
/// [`kinematics`](crate::kinematics()) first. The spin of rotors relative to their bodies (armature) is not included.
#[must_use]
pub fn momentum(tree: &Tree, ws: &Workspace) -> Force {
    let Some(first) = ws.work.kin.get(1) else { return Force::zero() };
    if let Some(flex) = tree.flexible.as_deref() {
        let c = vec3(&center_from_root(tree, &ws.work));
        return crate::flexible::momentum(tree, flex, &ws.work).shift_to_parent(&-c);
    }
    // Compute relative to the first link, so that the distance from the world's origin cancels.
    let origin = vec3(&first.p);
    let mut total = Force::zero();
    let mut moment = Vec3::zeros();
    for (link, kin) in tree.links.iter().zip(&ws.work.kin[1..]) {
        let (J, h) = world_inertia(link, kin);
        let (w, v) = (kin.V.n, kin.V.f);
        let f = w.cross_add(h, v.scale(link.m));
        let n = h.cross_add(v, J.mul(w));
        let r = vec3(&kin.p) - origin;
        total += Force::new(vec3(&n), vec3(&f)).shift_to_parent(&r);
        moment += r * link.m + vec3(&h);
    }
    let mass = tree.total_mass();
    let c = if mass > 0.0 { moment / mass } else { Vec3::zeros() };
    total.shift_to_parent(&-c)
}

/// Returns the kinetic energy ½ βᵀ M β, J, including rotors (½ armature β²). `v` must be the rates given to [`kinematics`](crate::kinematics()).
#[must_use]
pub fn kinetic_energy(tree: &Tree, ws: &Workspace, v: &[f64]) -> f64 {
    check(v.len(), tree.nv(), "v");
    let mut twice = 0.0;
    if let Some(flex) = tree.flexible.as_deref() {
        return crate::flexible::kinetic_energy(tree, flex, &ws.work, v);
    }
    for (link, kin) in tree.links.iter().zip(&ws.work.kin[1..]) {
        let (J, h) = world_inertia(link, kin);
        let (w, u) = (kin.V.n, kin.V.f);
        twice += w.dot(J.mul(w)) + link.m * u.dot(u) + 2.0 * u.dot(w.cross(h));
        if link.armature > 0.0 {
            let i = link.v as usize;
            let n = if link.kind == Kind::Ball { 3 } else { 1 };
            twice += v[i..i + n].iter().map(|b| link.armature * b * b).sum::<f64>();
        }
    }
    0.5 * twice
}

/// Returns the centre of mass of all moving bodies in the world, m.
#[must_use]
pub fn center_of_mass(tree: &Tree, ws: &Workspace) -> Vec3 {
    ws.work
        .kin
        .get(1)
        .map_or_else(Vec3::zeros, |first| vec3(&first.p) + vec3(&center_from_root(tree, &ws.work)))
}

/// Returns the centre of mass relative to the first root's origin.
pub(crate) fn center_from_root<L: Lane>(tree: &Tree, w: &Work<L>) -> V3<L> {
    let mut moment = V3::default();
    if let Some(flex) = tree.flexible.as_deref() {
        let (m, h) = crate::flexible::mass_moments(tree, flex, w);
        return if m > 0.0 { h.scale(L::splat(1.0 / m)) } else { h };
    }
    for (link, kin) in tree.links.iter().zip(&w.kin[1..]) {
        let h = kin.R.mul(V3::splat(&link.h));
        moment = (kin.p - w.kin[1].p).scale_add(L::splat(link.m), moment + h);
    }
    let m = tree.total_mass();
    if m > 0.0 { moment.scale(L::splat(1.0 / m)) } else { V3::default() }
}

/// Returns the velocity of the centre of mass of all moving bodies, m/s, world axes.
#[must_use]
pub fn com_velocity(tree: &Tree, ws: &Workspace) -> Vec3 {
    let mass = tree.total_mass();
    if mass > 0.0 { momentum(tree, ws).force / mass } else { Vec3::zeros() }
}

/// Returns the acceleration of the centre of mass of all moving bodies, m/s², world axes. Call forward or inverse dynamics first.
#[must_use]
pub fn com_acceleration(tree: &Tree, ws: &Workspace) -> Vec3 {
    if let Some(flex) = tree.flexible.as_deref() {
        let sum = crate::flexible::com_acceleration(tree, flex, &ws.work);
        return if tree.total_mass() > 0.0 { sum / tree.total_mass() } else { sum };
    }
    let mut sum = Vec3::zeros();
    for (link, (kin, acc)) in tree.links.iter().zip(ws.work.kin.iter().zip(&ws.work.acc).skip(1)) {
        let (A, w, h) = (kin.A + *acc, kin.V.n, kin.R.mul(link.h));
        sum += vec3(&w.cross_add(w.cross(h), A.n.cross_add(h, A.f.scale(link.m))));
    }
    if tree.total_mass() > 0.0 { sum / tree.total_mass() } else { sum }
}

/// Returns the inertia of a body and everything outboard of it at the present configuration, as one rigid body: about the body's origin, world axes.
/// O(bodies outboard).
#[must_use]
pub fn subtree_inertia(tree: &Tree, ws: &Workspace, body: BodyId) -> RigidInertia {
    let position = |b: BodyId| {
        let at = tree.body(b);
        let kin = &ws.work.kin[at.slot as usize];
        (vec3(&kin.p), vec3(&kin.R.mul(v3(&at.p))), mat3(&kin.R) * at.R)
    };
    let (p0, r0, _) = position(body);
    let mut sum = RigidInertia::zero();
    for b in tree.multibody().subtree(body) {
        let (p, r, R) = position(b);
        let I = tree.multibody().get(b).inertia().rotate_by(&R);
        sum += I.shift_to_parent(&((p - p0) + (r - r0)));
        if let Some(flex) = tree.flexible.as_deref() {
            sum += crate::flexible::subtree_inertia(flex, &ws.work, b, &(p0 + r0));
        }
    }
    sum
}

/// Returns the potential energy of all moving bodies in the uniform gravity of the workspace, J: zero at the world's origin. Call
/// [`kinematics`](crate::kinematics()) or [`poses`](crate::poses) first.
#[must_use]
pub fn potential_energy(tree: &Tree, ws: &Workspace) -> f64 {
    -tree.total_mass() * vec3(&ws.work.gravity).dot(&center_of_mass(tree, ws))
}
