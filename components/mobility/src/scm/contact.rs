//! Forces of deformable ground on a body as sums over the nodes under it, and the change of these nodes.

use crate::grousers::Grousers;
use crate::multipass::{Rut, Unloading};
use crate::scm::shape::{Presser, Under};
use linkwork_spatial::Vec3;
use linkwork_surroundings::prelude::Soil;
use serde::{Deserialize, Serialize};

/// A node of the ground. The default is an undisturbed node.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f32; 11]", into = "[f32; 11]")]
pub struct Node {
    /// Height of the first surface (m) and its slopes; NaN before it is known.
    pub first: [f32; 3],
    /// Height of heaped soil on it, m; negative where soil slid away.
    pub heap: f32,
    /// Deepest sinkage (m), pressure there (Pa), depth of the rut after unloading (m), all along the normal.
    pub pressed: [f32; 3],
    /// Shear stress at the node, Pa, W.
    pub shear: [f32; 3],
    /// Greatest used fraction of its strength since it has been under load, 0 to 1.
    pub mobilised: f32,
}

impl Default for Node {
    fn default() -> Self {
        Node { first: [f32::NAN; 3], heap: 0.0, pressed: [0.0; 3], shear: [0.0; 3], mobilised: 0.0 }
    }
}

impl From<[f32; 11]> for Node {
    fn from(v: [f32; 11]) -> Self {
        let three = |k: usize| [v[k], v[k + 1], v[k + 2]];
        let (pressed, shear) = (three(4), three(7));
        Node { first: three(0), heap: v[3], pressed, shear, mobilised: v[10] }
    }
}

impl From<Node> for [f32; 11] {
    fn from(n: Node) -> Self {
        let ([a, b, c], [d, e, f], [g, h, i]) = (n.first, n.pressed, n.shear);
        [a, b, c, n.heap, d, e, f, g, h, i, n.mobilised]
    }
}

/// Plane of the first surface at a node: height including heaped soil (m), and unit normal.
#[derive(Clone, Copy, Debug)]
pub struct Base {
    /// Height, m.
    pub height: f64,
    /// Unit normal.
    pub normal: Vec3,
}

impl Node {
    /// Returns whether its first surface is known.
    pub fn known(&self) -> bool {
        !self.first[0].is_nan()
    }

    /// Returns the first surface including heaped soil.
    #[inline]
    pub fn base(&self) -> Base {
        let [h, sx, sy] = self.first.map(f64::from);
        let scale = 1.0 / (1.0 + sx * sx + sy * sy).sqrt();
        Base {
            height: h + f64::from(self.heap),
            normal: Vec3::new(-sx * scale, -sy * scale, scale),
        }
    }

    /// Returns the height of the surface without load, m.
    pub fn surface(&self) -> f64 {
        let base = self.base();
        base.height - f64::from(self.pressed[2]) / base.normal.z
    }

    /// Resets the shear of a node without load.
    pub fn release(&mut self) {
        (self.shear, self.mobilised) = ([0.0; 3], 0.0);
    }

    /// Returns the deepest loading, for soil with the pressure `k ζⁿ` under a face.
    fn rut(&self, law: &Law) -> Rut {
        let [sinkage, pressure, depth] = self.pressed.map(f64::from);
        let rebound = sinkage - depth;
        let stiffness = if rebound > 0.0 { pressure / rebound } else { 0.0 };
        Rut { sinkage, pressure: pressure.min(law.virgin(sinkage)), stiffness }
    }
}

/// The soil under a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Sinkage modulus k, N/m^(n+2).
    pub k: f64,
    /// Sinkage exponent n.
    pub n: f64,
    /// Cohesion, Pa.
    pub cohesion: f64,
    /// Tangent of the friction angle.
    pub tan_phi: f64,
    /// Shear modulus K, m.
    pub shear: f64,
    /// Grousers of the face.
    pub bars: Option<Bars>,
}

/// Grousers of a rim on nodes: the force of each grouser is distributed to the nodes within one cell of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bars {
    /// The grousers; `phase` has no effect.
    pub grousers: Grousers,
    /// Unit vector from the axle to one grouser, W.
    pub spoke: Vec3,
    /// Width and shear radius of the rim, m.
    pub face: [f64; 2],
    /// The soil.
    pub soil: Soil,
    /// Specific weight of the soil, N/m³.
    pub gamma: f64,
}

impl Bars {
    /// Returns the factor by which the grousers increase the shear stress along the heading at `d` (m, from the axle) at a depth (m) under the
    /// pressure `p` (Pa), for nodes `cell` (m) apart.
    fn factor(&self, d: &Vec3, axle: &Vec3, depth: f64, p: f64, cell: f64) -> f64 {
        let [b, r] = self.face;
        let apart = std::f64::consts::TAU / f64::from(self.grousers.count);
        let angle = axle.dot(&self.spoke.cross(d)).atan2(self.spoke.dot(d));
        let off = (angle - (angle / apart).round() * apart).abs();
        // Use a ramp over one cell on both sides of the bar, so that the shares of the adjacent nodes add up to
        // one.
        let reach = cell / r;
        let share =
            if 2.0 * reach >= apart { 1.0 } else { (1.0 - off / reach).max(0.0) * apart / reach };
        if share <= 0.0 {
            return 0.0;
        }
        let strength = b * apart * r * (self.soil.cohesion + p * self.soil.friction_angle.tan());
        let limit = self.grousers.limit(&self.soil, self.gamma, self.face, [depth, p]);
        if strength > 0.0 { share * limit / strength } else { 0.0 }
    }
}

/// Constants of the contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Damping {
    /// Damping time of the shear, s; the damping is limited to a fiftieth of the remaining strength.
    pub shear: f64,
    /// Fraction by which the pressure increases per m/s of approach, s/m.
    pub normal: f64,
}

/// Limit of the shear damping, as a fraction of the remaining strength.
const DAMPING_MAX: f64 = 0.02;

impl Law {
    /// Returns the law of a soil under a face with the shorter side `b` (m) and the slip `slip`, −1 to 1.
    pub fn of(soil: &Soil, b: f64, slip: f64) -> Law {
        Law {
            k: soil.k_c / b + soil.k_phi,
            n: soil.n + soil.n1 * slip.abs().min(1.0),
            cohesion: soil.cohesion,
            tan_phi: soil.friction_angle.tan(),
            shear: soil.shear_modulus,
            bars: None,
        }
    }

    /// Returns the pressure (Pa) at sinkage `z` (m) on virgin soil, which no wheel has compacted.
    #[inline]
    pub fn virgin(&self, z: f64) -> f64 {
        if self.n == 1.0 { self.k * z.max(0.0) } else { self.k * z.max(0.0).powf(self.n) }
    }

    /// Returns the pressure (Pa) on a node at a sinkage (m).
    #[inline]
    pub fn pressure(&self, node: &Node, sinkage: f64) -> f64 {
        if sinkage <= 0.0 {
            return 0.0;
        }
        let [deepest, there, rut] = node.pressed.map(f64::from);
        if deepest == 0.0 {
            return self.virgin(sinkage);
        }
        if sinkage <= rut {
            return 0.0;
        }
        let curve = self.virgin(deepest);
        let most = there.min(curve);
        if sinkage > deepest {
            return most + self.virgin(sinkage) - curve;
        }
        (most - there / (deepest - rut) * (deepest - sinkage)).max(0.0)
    }

    /// Returns the node after loading to the sinkage, and the growth of its rut (m, along the normal).
    pub fn press(&self, node: &mut Node, sinkage: f64, unloading: &Unloading) -> f64 {
        let before = node.pressed;
        if sinkage as f32 > before[0] {
            let rut = node.rut(self).pressed(sinkage, self.k, self.n, unloading);
            node.pressed = [rut.sinkage as f32, rut.pressure as f32, rut.depth() as f32];
        } else if sinkage > f64::from(before[2]) && before[1] > 0.0 {
            let rut = node.rut(self);
            if (rut.pressure as f32) < before[1] {
                node.pressed = [before[0], rut.pressure as f32, rut.depth() as f32];
            }
        }
        if node.pressed.iter().all(|v| v.is_finite()) {
            f64::from(node.pressed[2]) - f64::from(before[2])
        } else {
            node.pressed = before;
            0.0
        }
    }

    /// Returns the strength (Pa) under the pressure `p` (Pa).
    #[inline]
    pub fn strength(&self, p: f64) -> f64 {
        self.cohesion + p * self.tan_phi
    }

    /// Returns the elastic shear stiffness of a node, Pa/m, under the pressure `p` (Pa); `unloading`: ratio of the stiffness during unloading to that
    /// during loading.
    #[inline]
    fn stiffness(&self, node: &Node, p: f64, unloading: f64) -> f64 {
        unloading * self.strength(p.max(f64::from(node.pressed[1]))) / self.shear
    }

    /// Returns the shear stress (Pa) of a node and its mobilised share of strength, after the body moved by `step` (m) along a face of the normal `n`
    /// under the pressure `p` (Pa).
    #[inline]
    pub fn sheared(
        &self,
        node: &Node,
        step: Vec3,
        n: &Vec3,
        p: f64,
        unloading: f64,
    ) -> (Vec3, f64) {
        let (strength, stiffness) = (self.strength(p), self.stiffness(node, p, unloading));
        let tau = Vec3::from(node.shear.map(f64::from));
        let tau = tau - n * n.dot(&tau) + step * stiffness;
        let (size, called) = (tau.norm(), f64::from(node.mobilised));
        let over = size - called * strength;
        if over <= 0.0 {
            return (tau, called);
        }
        // Compute the plastic part. Elastic and plastic part together have the modulus K at the start of
        // shearing.
        let slid = over / stiffness;
        let modulus = self.shear * (1.0 - 1.0 / unloading.max(1.0 + 1e-3));
        let called = called + (called - 1.0) * (-slid / modulus).exp_m1();
        (tau * ((called * strength).min(size) / size), called)
    }
}

/// Force and moment of the ground on a body; W.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundLoad {
    /// Force, N.
    pub force: Vec3,
    /// Moment about the body's middle, N m.
    pub moment: Vec3,
    /// Greatest sinkage below the first surface including heaped soil, m.
    pub sinkage: f64,
    /// Point at which the pressure acts, m; the middle of the body without contact.
    pub point: Vec3,
    /// Mean normal of the ground, unit.
    pub normal: Vec3,
    /// Force along it, N.
    pub normal_force: f64,
    /// Power that the body transfers to the ground, W.
    pub power: f64,
    /// Area that is pressed, m².
    pub area: f64,
}

impl GroundLoad {
    /// Returns the load without contact for a body at a position (m).
    pub fn none(middle: Vec3) -> GroundLoad {
        GroundLoad {
            force: Vec3::zeros(),
            moment: Vec3::zeros(),
            sinkage: 0.0,
            point: middle,
            normal: Vec3::z(),
            normal_force: 0.0,
            power: 0.0,
            area: 0.0,
        }
    }
}

/// Computes the sums over nodes; `unloading` is that of the ground.
#[derive(Clone, Copy, Debug)]
pub struct Sum<'a> {
    presser: &'a Presser,
    law: &'a Law,
    damping: &'a Damping,
    unloading: f64,
    /// Time since the last update of the nodes, s.
    age: f64,
    cell: f64,
    load: GroundLoad,
    weight: f64,
}

impl<'a> Sum<'a> {
    /// Creates empty sums.
    pub fn new(
        presser: &'a Presser,
        law: &'a Law,
        damping: &'a Damping,
        unloading: f64,
        age: f64,
        cell: f64,
    ) -> Self {
        let load = GroundLoad { normal: Vec3::zeros(), ..GroundLoad::none(Vec3::zeros()) };
        Sum { presser, law, damping, unloading, age, cell, load, weight: 0.0 }
    }

    /// Computes a node at x, y under the lower side.
    #[inline]
    pub fn add(&mut self, node: &Node, x: f64, y: f64, under: &Under) {
        let base = node.base();
        let sinkage = (base.height - under.z) * base.normal.z;
        let still = self.law.pressure(node, sinkage);
        if still <= 0.0 {
            return;
        }
        let (hub, n) = (&self.presser.hub, under.normal);
        let d = Vec3::new(x, y, under.z) - hub.position;
        let v = hub.velocity + hub.angular.cross(&d);
        let leaving = v.dot(&n);
        let along = v - n * leaving;
        let p = still * (1.0 - self.damping.normal * leaving).max(0.0);
        let (tau, _) = self.law.sheared(node, along * self.age, &n, p, self.unloading);
        let damped = along * (self.damping.shear * self.law.stiffness(node, p, self.unloading));
        let left = DAMPING_MAX * (self.law.strength(p) - tau.norm()).max(0.0);
        let tau = tau + damped * (left / (left + damped.norm()).max(1e-300));
        let area = under.share * self.cell * self.cell
            / (base.normal.z * n.dot(&base.normal).max(FACE_MIN));
        let tau = match &self.law.bars {
            None => tau,
            Some(bars) => {
                let axle = &hub.axle;
                let ahead = axle.cross(&n).try_normalize(1e-9).unwrap_or_else(Vec3::zeros);
                let more = bars.factor(&d, axle, sinkage, p, self.cell);
                tau + ahead * (ahead.dot(&tau) * more)
            }
        };
        let force = (n * p - tau) * area;
        let load = &mut self.load;
        load.force += force;
        load.moment += d.cross(&force);
        load.power -= force.dot(&v);
        load.sinkage = load.sinkage.max(sinkage);
        load.area += area;
        load.normal += base.normal * (still * area);
        load.point += Vec3::new(x, y, under.z) * (still * area);
        self.weight += still * area;
    }

    /// The load.
    pub fn load(self) -> GroundLoad {
        if self.weight <= 0.0 {
            return GroundLoad::none(self.presser.hub.position);
        }
        let mut load = self.load;
        load.point /= self.weight;
        load.normal = load.normal.try_normalize(1e-300).unwrap_or_else(Vec3::z);
        load.normal_force = load.force.dot(&load.normal);
        load
    }
}

/// Least cosine of the angle between a face and the ground; steeper faces have the area for this value.
const FACE_MIN: f64 = 0.2;

#[cfg(test)]
#[path = "contact_tests.rs"]
mod tests;
