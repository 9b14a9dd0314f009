//! Rigid wheel on rigid ground: Hunt-Crossley normal force and elasto-plastic bristle friction.
//! ```text
//! normal     N = k δ^p (1 + 1.5 e δ̇)₊                                (Hunt, Crossley 1975)
//! bristle    ξ̇ = v − α(|ξ|) (v·ξ̂)₊ ξ/ξ_max − (|ξ| − ξ_max)₊ ξ̂/T,   ξ_max = μ N/k_t
//!            α = 0 below ξ_ba = 0.9 ξ_max, 1 at ξ_max, a cubic between (Dupont et al. 2002)
//! friction   F = −k_t ξ − d v,  cut to |F| ≤ μ N
//! ```
//! ξ is the tangential deflection of the contact in W and v the material point's velocity in
//! the tangent plane, spin of the wheel included. Below ξ_ba the bristle is a spring and a damper:
//! a parked wheel holds exactly. Each of the discs across the width is a contact of its own with a
//! third of the stiffness, so the wheel resists turning about the normal and tilting.

use crate::wheel_geometry::{Cylinder, DISCS, DiscContact};
use linkwork_spatial::Vec3;

/// Constants of the contact of a whole wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidContact {
    /// Wheel.
    pub wheel: Cylinder,
    /// Normal stiffness `k`, N/m^p.
    pub stiffness: f64,
    /// Exponent `p`: 1 for a flat contact, 1.5 for a sphere.
    pub exponent: f64,
    /// Dissipation `e` of Hunt and Crossley, s/m.
    pub dissipation: f64,
    /// Tangential stiffness `k_t`, N/m.
    pub tangential_stiffness: f64,
    /// Tangential damping `d`, N s/m.
    pub tangential_damping: f64,
    /// Coulomb coefficient μ.
    pub friction: f64,
}

/// Pose and velocity of the hub in W; only the axle's direction of the attitude matters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hub {
    /// Centre, m.
    pub position: Vec3,
    /// Unit vector along the axle (to the left).
    pub axle: Vec3,
    /// Velocity of the centre, m/s.
    pub velocity: Vec3,
    /// Angular velocity of the rim (spin included), rad/s.
    pub angular: Vec3,
}

/// Deflections of the bristles, m, W.
pub type Bristles = [Vec3; DISCS];

/// Force and moment of the ground on the wheel with what one wants to plot; W frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactLoad {
    /// Force, N.
    pub force: Vec3,
    /// Moment about the hub's centre, N m.
    pub moment: Vec3,
    /// Sum of the discs' normal forces, N.
    pub normal_force: f64,
    /// Greatest penetration (sinkage), m.
    pub depth: f64,
    /// Point where the force acts (weighted by normal force), m; the hub when there is no contact.
    pub point: Vec3,
    /// Ground normal there.
    pub normal: Vec3,
    /// Friction over its limit, 0 to 1.
    pub friction_used: f64,
    /// Power lost in the contact, W.
    pub dissipation: f64,
}

/// Time in which a bristle beyond its limit relaxes, s.
const RELAX: f64 = 0.01;
/// Start of sliding as a fraction of the greatest deflection.
const BREAKAWAY: f64 = 0.9;

struct DiscState {
    contact: DiscContact,
    normal_force: f64,
    /// Tangential velocity of the material point.
    slide: Vec3,
    approach: f64,
}

impl RigidContact {
    /// The load on the wheel and the rate of its bristles (m/s).
    pub fn evaluate(
        &self,
        hub: &Hub,
        bristles: &Bristles,
        ground: &impl Fn(f64, f64) -> Option<(f64, Vec3)>,
    ) -> (ContactLoad, Bristles) {
        let discs = self.wheel.discs(hub.position, hub.axle, ground);
        let mut load = ContactLoad {
            force: Vec3::zeros(),
            moment: Vec3::zeros(),
            normal_force: 0.0,
            depth: 0.0,
            point: Vec3::zeros(),
            normal: Vec3::zeros(),
            friction_used: 0.0,
            dissipation: 0.0,
        };
        let mut rates = [Vec3::zeros(); DISCS];
        let mut used = 0.0;
        for i in 0..DISCS {
            let Some(d) = self.disc(hub, discs[i]) else {
                rates[i] = -bristles[i] / RELAX;
                continue;
            };
            let (friction, rate) = self.friction(&d, &bristles[i]);
            rates[i] = rate;
            let n = d.contact.normal;
            let force = n * d.normal_force + friction;
            load.force += force;
            load.moment += (d.contact.point - hub.position).cross(&force);
            load.normal_force += d.normal_force;
            load.depth = load.depth.max(d.contact.depth);
            load.point += d.contact.point * d.normal_force;
            load.normal += n * d.normal_force;
            used += friction.norm();
            // Elastic power is returned; what the bristle does not store is lost.
            let stored = -self.tangential_stiffness / DISCS as f64 * bristles[i].dot(&rate);
            let static_normal = self.static_normal(d.contact.depth);
            load.dissipation +=
                -friction.dot(&d.slide) + stored + (d.normal_force - static_normal) * d.approach;
        }
        if load.normal_force > 0.0 {
            load.point /= load.normal_force;
            load.normal = load.normal.normalize();
            load.friction_used = used / (self.friction * load.normal_force).max(1e-300);
        } else {
            load.point = hub.position;
            load.normal = Vec3::z();
        }
        (load, rates)
    }

    /// The rates of the bristles alone, m/s.
    pub fn rates(
        &self,
        hub: &Hub,
        bristles: &Bristles,
        ground: &impl Fn(f64, f64) -> Option<(f64, Vec3)>,
    ) -> Bristles {
        let discs = self.wheel.discs(hub.position, hub.axle, ground);
        std::array::from_fn(|i| match self.disc(hub, discs[i]) {
            Some(d) => self.friction(&d, &bristles[i]).1,
            None => -bristles[i] / RELAX,
        })
    }

    fn static_normal(&self, depth: f64) -> f64 {
        if depth <= 0.0 {
            return 0.0;
        }
        let power = match self.exponent {
            1.0 => depth,
            1.5 => depth * depth.sqrt(),
            p => depth.powf(p),
        };
        self.stiffness / DISCS as f64 * power
    }

    fn disc(&self, hub: &Hub, contact: Option<DiscContact>) -> Option<DiscState> {
        let contact = contact.filter(|c| c.depth > 0.0)?;
        let v = hub.velocity + hub.angular.cross(&(contact.point - hub.position));
        let approach = -v.dot(&contact.normal);
        let damping = (1.0 + 1.5 * self.dissipation * approach).max(0.0);
        let normal_force = self.static_normal(contact.depth) * damping;
        Some(DiscState { contact, normal_force, slide: v + contact.normal * approach, approach })
    }

    fn friction(&self, d: &DiscState, bristle: &Vec3) -> (Vec3, Vec3) {
        let n = &d.contact.normal;
        let share = DISCS as f64;
        let kt = self.tangential_stiffness / share;
        let dt = self.tangential_damping / share;
        let limit = self.friction * d.normal_force;
        let longest = limit / kt;
        // As the wheel moves on, the deflection is kept in the tangent plane.
        let off = n * n.dot(bristle);
        let xi = bristle - off;
        let length = xi.norm();
        let mut rate = d.slide - off / RELAX;
        if length > 0.0 {
            let along = d.slide.dot(&xi) / length;
            if along > 0.0 {
                let alpha = plastic_share(length, longest);
                rate -= xi * (alpha * along / length.max(longest).max(1e-300));
            }
            if length > longest {
                rate -= xi * ((length - longest) / (length * RELAX));
            }
        }
        let mut force = -xi * kt - d.slide * dt;
        let size = force.norm();
        if size > limit {
            force *= limit / size;
        }
        (force, rate)
    }
}

/// Share of the motion that is sliding (Dupont): 0 while the bristle is elastic, 1 at the limit.
fn plastic_share(length: f64, longest: f64) -> f64 {
    let start = BREAKAWAY * longest;
    if length <= start {
        return 0.0;
    }
    if length >= longest {
        return 1.0;
    }
    let t = (length - start) / (longest - start);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
#[path = "rigid_contact_tests.rs"]
mod tests;
