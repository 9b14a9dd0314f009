//! Rigid wheel on rigid ground: the compliant contact law (`linkwork_solvers::contact_law`) at each disc of a wheel.
//! ```text
//! normal     N_j = w_j k δ_j^p (1 + 1.5 e δ̇_j)₊  of each patch
//! bristle    ξ of each disc, by the law;  ξ_max = μ N/k_t
//! friction   F = −k_t ξ − d v,  cut to |F| ≤ μ N
//! ```
//! ξ is the tangential deflection of the contact in W. v is the velocity of the material point in the tangent plane, including the spin of the wheel.
//! Each of the discs across the width is a separate contact with its fraction of the stiffness, so the wheel resists rotation about the normal and
//! tilting.
//!
//! A disc that touches both floor and step has several patches but one bristle, with components along the rim and across. v is the mean of the
//! patches' velocities weighted by N_j, and N is the sum of N_j. F is distributed to the patches in proportion to N_j, each in its own rim direction,
//! which conserves power: Σ F_j·v_j = F·v.

use linkwork_collision::relief::{DISCS, DiscContact, PATCHES, Patch, Relief, Wheel};
use linkwork_solvers::contact_law::{RELAX, elastic, gives_way};
use linkwork_spatial::Vec3;

/// Contact parameters of a whole wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidContact {
    /// Geometry of the wheel.
    pub wheel: Wheel,
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

/// Pose and velocity of the hub in W; the attitude is given by the direction of the axle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hub {
    /// Centre, m.
    pub position: Vec3,
    /// Unit vector along the axle (to the left).
    pub axle: Vec3,
    /// Velocity of the centre, m/s.
    pub velocity: Vec3,
    /// Angular velocity of the rim, including the spin, rad/s.
    pub angular: Vec3,
}

/// Deflections of the bristles, m, W.
pub type Bristles = [Vec3; DISCS];

/// Force and moment of the ground on the wheel, and quantities for plots; frame W.
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
    /// Centre of pressure (weighted by normal force), m; the hub without contact.
    pub point: Vec3,
    /// Ground normal at the centre of pressure.
    pub normal: Vec3,
    /// Ratio of friction to its limit, 0 to 1.
    pub friction_used: f64,
    /// Power dissipated in the contact, W.
    pub dissipation: f64,
}

/// Contact state of a disc: its patches, their normal forces, and their mean.
struct DiscState<'a> {
    contact: &'a DiscContact,
    /// Unit vectors along the rim and across it at each patch.
    axes: [[Vec3; 2]; PATCHES],
    /// Normal forces, N.
    normal: [f64; PATCHES],
    /// Power dissipated by normal damping, W.
    damped: f64,
    /// Sum of the normal forces, N.
    total: f64,
    /// Mean unit normal, and the vectors along the rim and across it there.
    mean: Vec3,
    mean_axes: [Vec3; 2],
    /// Mean slip velocity along the rim and across it, m/s.
    slide: [f64; 2],
}

/// Returns unit vectors along the rim (the heading of the wheel) and across, at a contact with the normal `n`.
fn rim_axes(axle: &Vec3, n: &Vec3) -> [Vec3; 2] {
    let along = axle.cross(n);
    let length = along.norm();
    if length < 1e-9 {
        // The contact is with a wall at the side of the wheel, so choose any tangent direction.
        let along = n.cross(&Vec3::z()).try_normalize(1e-9).unwrap_or_else(Vec3::x);
        return [along, n.cross(&along)];
    }
    let along = along / length;
    [along, n.cross(&along)]
}

impl RigidContact {
    /// Returns the load on the wheel and the rates of its bristles (m/s).
    pub fn evaluate(
        &self,
        hub: &Hub,
        bristles: &Bristles,
        ground: &(impl Relief + ?Sized),
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
            let Some(d) = self.disc(hub, &discs[i]) else {
                rates[i] = -bristles[i] / RELAX;
                continue;
            };
            let (friction, rate) = self.friction(&d, &bristles[i]);
            rates[i] = rate;
            for (k, patch) in d.contact.patches().iter().enumerate() {
                let (normal, [along, across]) = (d.normal[k], d.axes[k]);
                let part = normal / d.total.max(1e-300);
                let force =
                    patch.normal * normal + (along * friction[0] + across * friction[1]) * part;
                load.force += force;
                load.moment += (patch.point - hub.position).cross(&force);
                load.point += patch.point * normal;
                load.normal += patch.normal * normal;
            }
            load.depth = load.depth.max(d.contact.depth());
            load.normal_force += d.total;
            used += length(friction);
            // Elastic power is stored in the bristle; the rest of the friction power is dissipated.
            let stored = -self.tangential_stiffness / DISCS as f64 * bristles[i].dot(&rate);
            let rubbed = friction[0] * d.slide[0] + friction[1] * d.slide[1];
            load.dissipation += stored - rubbed + d.damped;
        }
        if load.normal_force > 0.0 {
            load.point /= load.normal_force;
            load.normal = load.normal.try_normalize(1e-300).unwrap_or_else(Vec3::z);
            load.friction_used = used / (self.friction * load.normal_force).max(1e-300);
        } else {
            load.point = hub.position;
            load.normal = Vec3::z();
        }
        (load, rates)
    }

    /// Returns the rates of the bristles alone, m/s.
    pub fn rates(
        &self,
        hub: &Hub,
        bristles: &Bristles,
        ground: &(impl Relief + ?Sized),
    ) -> Bristles {
        let discs = self.wheel.discs(hub.position, hub.axle, ground);
        std::array::from_fn(|i| match self.disc(hub, &discs[i]) {
            Some(d) => self.friction(&d, &bristles[i]).1,
            None => -bristles[i] / RELAX,
        })
    }

    fn static_normal(&self, patch: &Patch) -> f64 {
        elastic(self.stiffness / DISCS as f64 * patch.share, self.exponent, patch.depth)
    }

    fn disc<'a>(&self, hub: &Hub, contact: &'a DiscContact) -> Option<DiscState<'a>> {
        if contact.patches().is_empty() {
            return None;
        }
        let mut out = DiscState {
            contact,
            axes: [[Vec3::zeros(); 2]; PATCHES],
            normal: [0.0; PATCHES],
            damped: 0.0,
            total: 0.0,
            mean: Vec3::zeros(),
            mean_axes: [Vec3::zeros(); 2],
            slide: [0.0; 2],
        };
        for (k, patch) in contact.patches().iter().enumerate() {
            let v = hub.velocity + hub.angular.cross(&(patch.point - hub.position));
            let approach = -v.dot(&patch.normal);
            let still = self.static_normal(patch);
            let normal = still * (1.0 + 1.5 * self.dissipation * approach).max(0.0);
            out.normal[k] = normal;
            out.axes[k] = rim_axes(&hub.axle, &patch.normal);
            out.damped += (normal - still) * approach;
            out.total += normal;
            out.mean += patch.normal * normal;
            out.slide[0] += v.dot(&out.axes[k][0]) * normal;
            out.slide[1] += v.dot(&out.axes[k][1]) * normal;
        }
        // A contact that separates so fast that its normal force is zero has no friction. Its bristle follows the first
        // patch.
        if out.total > 0.0 {
            out.slide = out.slide.map(|v| v / out.total);
        }
        (out.mean, out.mean_axes) = match (contact.patches(), out.mean.try_normalize(1e-300)) {
            ([_, _, ..], Some(mean)) => (mean, rim_axes(&hub.axle, &mean)),
            (patches, _) => (patches[0].normal, out.axes[0]),
        };
        Some(out)
    }

    /// Returns friction along the rim and across (N), and the rate of the bristle (m/s, W).
    fn friction(&self, d: &DiscState<'_>, bristle: &Vec3) -> ([f64; 2], Vec3) {
        let share = DISCS as f64;
        let kt = self.tangential_stiffness / share;
        let dt = self.tangential_damping / share;
        let limit = self.friction * d.total;
        let longest = limit / kt;
        let [along, across] = d.mean_axes;
        // The tangent plane changes as the wheel rolls; the normal component of the deflection decays.
        let off = d.mean * d.mean.dot(bristle);
        let xi = [bristle.dot(&along), bristle.dot(&across)];
        let size = length(xi);
        let mut rate = d.slide;
        if size > 0.0 {
            let toward = (d.slide[0] * xi[0] + d.slide[1] * xi[1]) / size;
            let cut = gives_way(size, toward, longest);
            rate = [rate[0] - cut * xi[0], rate[1] - cut * xi[1]];
        }
        let mut force: [f64; 2] = std::array::from_fn(|k| -xi[k] * kt - d.slide[k] * dt);
        let size = length(force);
        if size > limit {
            force = force.map(|f| f * (limit / size));
        }
        (force, along * rate[0] + across * rate[1] - off / RELAX)
    }
}

fn length([a, b]: [f64; 2]) -> f64 {
    (a * a + b * b).sqrt()
}

#[cfg(test)]
#[path = "rigid_contact_tests.rs"]
mod tests;
