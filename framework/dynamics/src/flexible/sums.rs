//! Sums over the masses of a tree with flexible bodies, for links and stations alike. The functions correspond to those in `momentum.rs`, in addition
//! to the elastic energy of the modes.

use super::inverse::armature;
use super::{Flexible, StationAt};
use crate::forces::coriolis;
use crate::lane::Lane;
use crate::linear::{V3, V6};
use crate::query::{mat3, v3, vec3};
use crate::tree::Tree;
use crate::work::{Work, Workspace};
use linkwork_multibody::BodyId;
use linkwork_spatial::{Force, Motion, RigidInertia, Vec3};

/// Returns ½ ηᵀ K η of all flexible bodies, J. Call [`kinematics`](crate::kinematics()) or [`poses`](crate::poses) first. Zero for a rigid mechanism.
#[must_use]
pub fn elastic_energy(_: &Tree, ws: &Workspace) -> f64 {
    ws.work.bend.energy
}

/// Returns mass, and first moment relative to the origin of slot 1.
pub(crate) fn mass_moments<L: Lane>(tree: &Tree, flex: &Flexible, w: &Work<L>) -> (f64, V3<L>) {
    let mut sum = (0.0, V3::default());
    for slot in 1..tree.slots() {
        let (m, h, _) = tree.mass_at(flex, slot);
        let kin = &w.kin[slot];
        let h = kin.R.mul(V3::splat(&h));
        sum = (sum.0 + m, (kin.p - w.kin[1].p).scale_add(L::splat(m), sum.1 + h));
    }
    sum
}

/// Returns the momentum about the origin of slot 1.
pub(crate) fn momentum(tree: &Tree, flex: &Flexible, w: &Work<f64>) -> Force {
    let mut total = V6::default();
    for slot in 1..tree.slots() {
        let (m, h, J) = tree.world_mass(flex, &w.kin, slot);
        let kin = &w.kin[slot];
        let (u, v) = (kin.V.n, kin.V.f);
        let p = V6 { n: h.cross_add(v, J.mul(u)), f: u.cross_add(h, v.scale(m)) };
        total = total + p.to_parent(kin.p - w.kin[1].p);
    }
    Force::new(vec3(&total.n), vec3(&total.f))
}

/// Returns the kinetic energy, including rotors, J.
pub(crate) fn kinetic_energy(tree: &Tree, flex: &Flexible, w: &Work<f64>, v: &[f64]) -> f64 {
    let of = |slot: usize| {
        let (m, h, J) = tree.world_mass(flex, &w.kin, slot);
        let (u, v) = (w.kin[slot].V.n, w.kin[slot].V.f);
        u.dot(J.mul(u)) + m * v.dot(v) + 2.0 * v.dot(u.cross(h))
    };
    let mut twice = (1..tree.slots()).map(of).sum::<f64>();
    armature(tree, |i, a| twice += a * v[i] * v[i]);
    0.5 * twice
}

/// Returns Σ of mass times acceleration, N.
pub(crate) fn com_acceleration(tree: &Tree, flex: &Flexible, w: &Work<f64>) -> Vec3 {
    let mut sum = V3::default();
    for slot in 1..tree.slots() {
        let (m, h, _) = tree.mass_at(flex, slot);
        let (kin, A) = (&w.kin[slot], w.kin[slot].A + w.acc[slot]);
        let (u, h) = (kin.V.n, kin.R.mul(h));
        sum = sum + u.cross_add(u.cross(h), A.n.cross_add(h, A.f.scale(m)));
    }
    vec3(&sum)
}

/// Returns Ȧ β about a point relative to the origin of slot 1.
pub(crate) fn bias(tree: &Tree, flex: &Flexible, w: &Work<f64>, center: V3<f64>) -> Force {
    let mut total = V6::default();
    for slot in 1..tree.slots() {
        let (m, h, J) = tree.world_mass(flex, &w.kin, slot);
        let (kin, u, A) = (&w.kin[slot], w.kin[slot].V.n, w.kin[slot].A);
        let n = u.cross_add(J.mul(u), h.cross_add(A.f, J.mul(A.n)));
        let f = u.cross_add(u.cross(h), A.n.cross_add(h, A.f.scale(m)));
        total = total + V6 { n, f }.to_parent((kin.p - w.kin[1].p) - center);
    }
    Force::new(vec3(&total.n), vec3(&total.f))
}

/// Returns mass and first moment of the stations of one body about the body's origin, world axes.
fn stations_of(tree: &Tree, flex: &Flexible, w: &Work<f64>, body: BodyId) -> (f64, V3<f64>) {
    let at = tree.body(body);
    let kin = &w.kin[at.slot as usize];
    let origin = kin.p + kin.R.mul(v3(&at.p));
    let mut sum = (0.0, V3::default());
    for set in flex.sets.iter().filter(|s| s.body as usize == body.index()) {
        for s in set.first..set.end {
            let (at, kin) = (&flex.stations[s], &w.kin[flex.slot(s)]);
            let (m, h) = (at.own.mass(), v3(&at.own.h()));
            sum = (sum.0 + m, (kin.p - origin).scale_add(m, sum.1 + kin.R.mul(h)));
        }
    }
    sum
}

/// Returns the centre of mass of one body relative to its origin, world axes; zero if it has no mass.
pub(crate) fn body_com(tree: &Tree, flex: &Flexible, ws: &Workspace, body: BodyId) -> Vec3 {
    let rigid = tree.multibody().get(body).inertia();
    let (m, h) = stations_of(tree, flex, &ws.work, body);
    let total = m + rigid.mass();
    let h = vec3(&h) + ws.body_rotation(tree, body) * rigid.h();
    if total > 0.0 { h / total } else { Vec3::zeros() }
}

/// Returns the stations with their own mass, and their indices.
fn with_mass(flex: &Flexible) -> impl Iterator<Item = (usize, &StationAt)> {
    flex.stations.iter().enumerate().filter(|(_, s)| s.own.mass() > 0.0)
}

/// Applies gravity at the position of each station; bodies that are welded to a station are treated separately.
pub(crate) fn apply_gravity(
    flex: &Flexible,
    w: &mut Work<f64>,
    field: &mut impl FnMut(&Vec3) -> Vec3,
) {
    for (s, at) in with_mass(flex) {
        let (slot, m) = (flex.slot(s), at.own.mass());
        let c = w.kin[slot].R.mul(v3(&at.own.h())).scale(1.0 / m);
        let g = field(&vec3(&(w.kin[slot].p + c))) * m;
        let f = V6 { n: V3::default(), f: v3(&g) };
        w.f_ext[slot] = w.f_ext[slot] + f.to_parent(c);
    }
}

/// Applies Coriolis forces on each station; bodies that are welded to a station are treated separately.
pub(crate) fn apply_coriolis(flex: &Flexible, w: &mut Work<f64>, omega: &Vec3) {
    for (s, at) in with_mass(flex) {
        let slot = flex.slot(s);
        let kin = &w.kin[slot];
        let I = at.own.rotate_by(&mat3(&kin.R));
        let wrench = coriolis(&I, &Motion::new(vec3(&kin.V.n), vec3(&kin.V.f)), omega);
        let f = V6 { n: v3(&wrench.moment), f: v3(&wrench.force) };
        w.f_ext[slot] = w.f_ext[slot] + f.to_parent(v3(&I.com()));
    }
}

/// Returns the inertia of the stations of one body about the world point `about`, world axes.
pub(crate) fn subtree_inertia(
    flex: &Flexible,
    w: &Work<f64>,
    body: BodyId,
    about: &Vec3,
) -> RigidInertia {
    let mut sum = RigidInertia::zero();
    let own = |s: &StationAt| flex.sets[s.set as usize].body as usize == body.index();
    for (s, at) in with_mass(flex).filter(|(_, s)| own(s)) {
        let kin = &w.kin[flex.slot(s)];
        sum += at.own.rotate_by(&mat3(&kin.R)).shift_to_parent(&(vec3(&kin.p) - about));
    }
    sum
}
