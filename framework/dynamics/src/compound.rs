//! Compound bodies: all bodies that are locked onto one link, as one rigid body.
//!
//! The sweeps use links, not the bodies of which a link consists. Effects on single bodies, which are position-dependent gravity, Coriolis forces and
//! changes of inertia, act on a link through precomputed sums:
//! ```text
//! m, h, J     mass, first moment, inertia about the link's origin            (in `Link`)
//! K           Σ of the bodies' inertias, each about its own centre of mass
//! T           Σ m_b d_b d_bᵀ of the bodies as points, d_b from the common centre of mass c
//!
//! position-dependent gravity: four points of mass m/4 at c + L s_i,   T/m = L Lᵀ,   s_i = (1,1,1), (1,−1,−1), (−1,1,−1), (−1,−1,1)
//! ```
//! Because Σ s_i = 0 and Σ s_i s_iᵀ = 4·1, the four points have the mass, the centre and the second moments of the bodies as points. Consider a field
//! that changes by its own magnitude over a distance ℓ, and let d be the distance of the farthest body. The force on the four points equals the force
//! on the bodies up to terms of the order (d/ℓ)³. The moment about c, which results from the gradient of the field, is exact up to a relative error
//! of d/ℓ. The four points are used if d is below [`NEAR`] ℓ, with errors of 3e-14 of the force and 3e-5 of that moment; otherwise gravity is
//! evaluated at each body.

use crate::linear::{M3, S3, V3};
use crate::query::v3;
use crate::tree::{Kind, Link, OnLink, s3};
use linkwork_multibody::{BodyId, Coordinate, Multibody};
use linkwork_spatial::{Mat3, RigidInertia};
use std::ops::Range;

/// Largest distance of a body from the centre of mass, relative to the distance over which the field changes.
pub(crate) const NEAR: f64 = 3e-5;
/// Up to this number of bodies with mass, gravity is evaluated at each body, because four points would not cost less.
const FEW: u32 = 4;

/// Sums over bodies about a link's origin, link axes.
#[derive(Clone, Debug, Default)]
struct Sum {
    inertia: RigidInertia,
    K: Mat3,
    /// Σ m c cᵀ of the bodies as points.
    points: Mat3,
    /// Distance of the farthest centre of mass from the origin.
    reach: f64,
    /// Number of bodies with mass.
    bodies: u32,
}

impl Sum {
    fn add(&mut self, at: &OnLink, inertia: &RigidInertia) {
        let I = inertia.rotate_by(&at.R).shift_to_parent(&at.p);
        self.inertia += I;
        if I.mass() > 0.0 {
            let c = I.com();
            self.K += I.inertia_com();
            self.points += c * c.transpose() * I.mass();
            self.reach = self.reach.max(c.norm());
            self.bodies += 1;
        }
    }
}

/// The mass properties of a link as one body.
#[derive(Clone, Debug, Default)]
pub(crate) struct Compound {
    /// Its centre of mass, link axes.
    pub com: V3<f64>,
    /// J_c, about the centre of mass, link axes.
    pub J: S3<f64>,
    /// 1/m and J_c⁻¹; zero where they do not exist.
    pub m_inv: f64,
    pub J_inv: S3<f64>,
    /// True if only one of its bodies has mass.
    pub single: bool,
    /// Sum of the bodies' inertias about their own centres of mass.
    pub K: S3<f64>,
    /// The four points, link axes.
    pub points: [V3<f64>; 4],
    /// Largest distance of a body from the centre of mass; infinite if gravity is evaluated at each body.
    pub reach: f64,
}

impl Compound {
    fn new(sum: &Sum) -> Self {
        let m = sum.inertia.mass();
        if !(m > 0.0) {
            return Self { reach: f64::INFINITY, ..Self::default() };
        }
        let c = sum.inertia.com();
        let L = root(&s3(&(sum.points / m - c * c.transpose())));
        let com = v3(&c);
        let J = s3(&sum.inertia.inertia_com());
        let (J_inv, solid) = J.inverse();
        let signs = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        Self {
            com,
            J,
            m_inv: 1.0 / m,
            J_inv: if solid { J_inv } else { S3::default() },
            single: sum.bodies == 1,
            K: s3(&sum.K),
            points: signs.map(|[x, y, z]| com + L.mul(V3 { x, y, z })),
            reach: if sum.bodies > FEW { sum.reach + c.norm() } else { f64::INFINITY },
        }
    }
}

impl Compound {
    /// Returns true if it has mass, and inertia about every axis.
    pub fn solid(&self) -> bool {
        self.J_inv.xx > 0.0
    }
}

/// Returns the lower triangular L with L Lᵀ = `T`, which may be singular for bodies in a plane, on a line or at a point.
fn root(T: &S3<f64>) -> M3<f64> {
    // Pivots below this are round-off.
    let least = 1e-14 * (T.xx + T.yy + T.zz);
    let pivot = |d: f64| if d > least { d.sqrt() } else { 0.0 };
    let over = |x: f64, p: f64| if p > 0.0 { x / p } else { 0.0 };
    let a = pivot(T.xx);
    let (b, c) = (over(T.xy, a), over(T.xz, a));
    let d = pivot(T.yy - b * b);
    let e = over(T.yz - b * c, d);
    let f = pivot(T.zz - c * c - e * e);
    M3 { x: V3 { x: a, y: b, z: c }, y: V3 { x: 0.0, y: d, z: e }, z: V3 { x: 0.0, y: 0.0, z: f } }
}

/// The bodies of each link, and their sums.
#[derive(Clone, Debug)]
pub(crate) struct Compounds {
    /// Bodies by slot; within a slot, those with variable inertia come last, both in canonical order.
    order: Vec<BodyId>,
    from: Vec<u32>,
    /// Index in `order` of the first body with variable inertia of each slot.
    varying: Vec<u32>,
    /// Sum over the bodies of each link with constant inertia.
    fixed: Vec<Sum>,
    of_link: Vec<Compound>,
}

impl Compounds {
    /// Creates the sums; all inertias are constant. Slots above `links` do not belong to links.
    pub fn new(links: usize, bodies: &[OnLink], mbs: &Multibody) -> Self {
        let mut order: Vec<BodyId> = mbs.body_ids().collect();
        order.sort_by_key(|b| bodies[b.index()].slot);
        let begin = |slot: usize| order.partition_point(|b| bodies[b.index()].slot < slot as u32);
        let from: Vec<u32> = (0..links + 2).map(|slot| begin(slot) as u32).collect();
        let varying = from[1..].to_vec();
        let (fixed, of_link) = (vec![Sum::default(); links], vec![Compound::default(); links]);
        let mut out = Self { order, from, varying, fixed, of_link };
        for slot in 1..=links {
            out.add_up(slot, bodies, mbs);
        }
        out
    }

    /// Returns a link as one body.
    pub fn get(&self, slot: usize) -> &Compound {
        &self.of_link[slot - 1]
    }

    /// Returns all links as one body each.
    pub fn all(&self) -> &[Compound] {
        &self.of_link
    }

    /// Returns the bodies that move with a slot.
    pub fn bodies(&self, slot: usize) -> impl Iterator<Item = BodyId> + '_ {
        self.of(self.from[slot]..self.from[slot + 1])
    }

    fn of(&self, places: Range<u32>) -> impl Iterator<Item = BodyId> + '_ {
        self.order[places.start as usize..places.end as usize].iter().copied()
    }

    /// Selects the bodies whose inertias change repeatedly; the other bodies of their links are summed once.
    pub fn vary(&mut self, which: &[BodyId], bodies: &[OnLink], mbs: &Multibody) {
        let varies = |b: &BodyId| which.contains(b);
        for slot in 0..self.from.len() - 1 {
            let (from, to) = (self.from[slot], self.from[slot + 1]);
            let own = &mut self.order[from as usize..to as usize];
            own.sort_by_key(|b| (varies(b), *b));
            self.varying[slot] = from + own.iter().filter(|b| !varies(b)).count() as u32;
        }
        for slot in 1..=self.of_link.len() {
            self.add_up(slot, bodies, mbs);
        }
    }

    /// Sums a link from all its bodies.
    fn add_up(&mut self, slot: usize, bodies: &[OnLink], mbs: &Multibody) -> RigidInertia {
        let mut sum = Sum::default();
        for b in self.of(self.from[slot]..self.varying[slot]) {
            sum.add(&bodies[b.index()], mbs.get(b).inertia());
        }
        self.fixed[slot - 1] = sum;
        self.whole(slot, bodies, mbs)
    }

    /// Sums a link from the constant sum and the variable bodies.
    fn whole(&mut self, slot: usize, bodies: &[OnLink], mbs: &Multibody) -> RigidInertia {
        let mut sum = self.fixed[slot - 1].clone();
        for b in self.of(self.varying[slot]..self.from[slot + 1]) {
            sum.add(&bodies[b.index()], mbs.get(b).inertia());
        }
        self.of_link[slot - 1] = Compound::new(&sum);
        sum.inertia
    }

    /// Updates the sums after a change of a body's inertia. Returns the inertia of everything that moves with it, about the link's origin, link axes.
    pub fn changed(
        &mut self,
        body: BodyId,
        slot: usize,
        bodies: &[OnLink],
        mbs: &Multibody,
    ) -> RigidInertia {
        let varies = self.of(self.varying[slot]..self.from[slot + 1]).any(|b| b == body);
        match varies {
            true => self.whole(slot, bodies, mbs),
            false => self.add_up(slot, bodies, mbs),
        }
    }
}

impl Link {
    /// Sets the inertia of everything that moves with this link.
    pub fn put(&mut self, sum: &RigidInertia, whole: &Compound) {
        (self.m, self.h) = (sum.mass(), v3(&sum.h()));
        self.J = s3(&sum.inertia());
        self.alone(whole);
    }

    /// Determines whether the link is an isolated free body.
    pub fn alone(&mut self, whole: &Compound) {
        let free = self.kind == Kind::Free && self.coordinate == Coordinate::Free;
        self.lone = free && self.parent == 0 && self.leaf && whole.solid();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_spatial::Vec3;

    fn bodies(seed: u64, n: u32, flat: usize) -> Sum {
        let mut x = seed;
        let mut number = || {
            x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (x >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut sum = Sum::default();
        for _ in 0..n {
            let mut p = Vec3::new(number(), number(), number()) * 4.0;
            (flat..3).for_each(|k| p[k] = 0.25);
            let I = Mat3::from_diagonal(&Vec3::new(1.1, 1.2, 1.3));
            let body = RigidInertia::from_moments(1.0 + number(), Vec3::zeros(), I).unwrap();
            sum.add(&OnLink { slot: 1, R: Mat3::identity(), p }, &body);
        }
        sum
    }

    /// Mass, centre and second moments of the four points equal those of the bodies, for bodies in space, in a plane, on a line and at a point.
    #[test]
    fn four_points_have_the_moments_of_the_bodies() {
        for (seed, flat) in [(1, 3), (2, 2), (3, 1), (4, 0)] {
            let sum = bodies(seed, 9, flat);
            let c = Compound::new(&sum);
            let m = sum.inertia.mass() / 4.0;
            let point = |p: &V3<f64>| Vec3::new(p.x, p.y, p.z);
            let first: Vec3 = c.points.iter().map(|p| point(p) * m).sum();
            let second: Mat3 = c.points.iter().map(|p| point(p) * point(p).transpose() * m).sum();
            assert!((first - sum.inertia.h()).norm() < 1e-13, "{flat}: {first}");
            // Pivots at round-off level count as zero.
            assert!((second - sum.points).norm() < 1e-6 * sum.points.norm().max(1.0), "{flat}");
            if flat == 3 {
                assert!((second - sum.points).norm() < 1e-13 * sum.points.norm());
            }
            assert!(c.reach.is_finite() && c.reach >= sum.reach);
        }
        assert_eq!(Compound::new(&bodies(5, 4, 3)).reach, f64::INFINITY, "few are asked for");
        assert_eq!(Compound::new(&Sum::default()).reach, f64::INFINITY);
    }
}
