//! Wheel on soft soil in a simulation: the stress model with states that are regular at rest.
//! ```text
//! deflection  ξ̇ = w + (ρ − 1) min(w·ξ̂, 0) ξ̂ − ξ |u|/(L − T|u|)      (less what slides beyond 3 L)
//!             ρ = ρ₀ max(1, |ξ|/K),  w = (u − v_x, −v_y),  u = r ω,  L = r (θ_f − θ_r)/2
//! slip        s = (ξ_x + T (u − v_x))/L,   v_y/u = −(ξ_y − T v_y)/L
//! rolling     ṁ = (w − m |w|)/L,  w = (u + v_x)/2         |m|: share of the rolling shape, sign: front
//! direction   η̇ = w − |w| η/δ,  δ = L/ρ₀,  d = clamp(1.25 (η + T w)/δ, −1, 1)
//!             forces ½ (1 + d) F(forwards) + ½ (1 − d) F(backwards)
//! normal      N = F_z(z) − k_u (z_u − z)₊, times (1 + d ż)₊
//! press       ż_u = (z − z_u)₊/τ − 8 (z_u − z)₊ |w|/L
//! ```
//! In steady rolling ξ yields exactly the textbook slip, so the forces are those of the stress integrals. At rest ξ is a displacement: below the
//! Mohr-Coulomb limit the soil holds a parked wheel exactly; T damps it. When the shear reverses, the soil unloads ρ times as stiffly as it was
//! loaded, so it returns at most 1/ρ₀ of the work of shearing: over any closed path at rest, Σ F·dx is a loss. The footprint of a wheel set down is
//! symmetric (m = 0) and takes the rolling shape over half its length; no force depends on the sign of a small speed, because this would make a
//! parked wheel vibrate. The rolling resistance reverses within δ, over which the soil is elastic: it returns about 1/ρ₀ of the work that it takes
//! over the length L, and holds a free wheel on a slope. Otherwise a wheel without a drive would oscillate in its footprint instead of coming to
//! rest. `z` is the penetration into the undeformed surface along its normal, `z_u` the deepest loading under the wheel: unloading is stiff (Wong's
//! k_u), and `z_u` decays as the wheel rolls on to new ground.
//!
//! Previously loaded ground (`ruts`) is read one cell beyond the ends of the arc at the middles of the discs, in front with the weight (1 + m)/2 and
//! behind with (1 − m)/2. The sinkage of the wheel is measured from the mean of these states over its whole width: z counts from the bottom of the
//! rut, z_u and the print from the first surface. The soil that the wheel itself loads is under the arc, so a wheel does not climb out of its own
//! footprint.

use crate::grousers::Grousers;
use crate::multipass::Rut;
use crate::rigid_contact::Hub;
use crate::ruts::Past;
use crate::terramechanics::{Motion, Rim, Shear, Sinkage, WheelForces, WheelSoil};
use linkwork_collision::relief::{DISCS, Relief, Wheel};
use linkwork_spatial::Vec3;
use linkwork_surroundings::prelude::Soil;

/// Constants of a wheel on soil.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoilContact {
    /// Wheel; the radius is the shear radius (with grousers).
    pub wheel: Wheel,
    /// Sharing of shear stress.
    pub shear: Shear,
    /// Gravity for the weight of bulldozed soil, m/s².
    pub gravity: f64,
    /// Damping time of the shear deflection `T`, s.
    pub shear_damping: f64,
    /// Ratio ρ₀ ≥ 1 of the shear stiffness during unloading to the stiffness during loading; the rolling resistance reverses on a path that is
    /// shorter than half the footprint by this factor.
    pub shear_unloading: f64,
    /// Normal damping `d`, s/m.
    pub normal_damping: f64,
    /// Unloading stiffness `k_u`, N/m.
    pub unloading_stiffness: f64,
    /// Grousers, and the direction from the axle to one of them, unit, W.
    pub grousers: Option<(Grousers, Vec3)>,
}

/// State of the soil under one wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SoilState {
    /// Shear deflection along the heading, m.
    pub xi_x: f64,
    /// Shear deflection along the axle, m.
    pub xi_y: f64,
    /// Deepest loading under the wheel, m.
    pub pressed: f64,
    /// Shape of the footprint: 0 set down, 1 rolled forwards, −1 rolled backwards.
    pub rolled: f64,
    /// Deflection by which the soil resists rolling elastically, m.
    pub rolling: f64,
}

/// Load of the soil on the wheel; vectors in W.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoilLoad {
    /// Force, N.
    pub force: Vec3,
    /// Moment about the hub, N m.
    pub moment: Vec3,
    /// Forces in the contact frame.
    pub local: WheelForces,
    /// Sinkage below the first surface, m (0 without contact).
    pub sinkage: f64,
    /// Depth of the rut in which the wheel runs, m.
    pub rut: f64,
    /// Ground normal, unit.
    pub normal: Vec3,
    /// Heading of the wheel in the ground, unit.
    pub heading: Vec3,
    /// Modulus (N/m^(n+2)) and exponent of the pressure under the wheel.
    pub press: (f64, f64),
    /// Slip in the stress model, −1 to 1.
    pub slip: f64,
    /// Slip angle, rad.
    pub slip_angle: f64,
    /// Contact point, m.
    pub point: Vec3,
    /// Power that the wheel transfers to the soil, W.
    pub power: f64,
}

/// Time constant with which the deepest loading follows a growing sinkage, and with which the soil recovers in the air, s.
const FOLLOW: f64 = 0.005;
/// Inverse of the travel, in half footprints, over which the deepest loading decays.
const FORGET: f64 = 8.0;
/// Deflections over L at which sliding starts and is complete.
const SLIDE: [f64; 2] = [1.5, 3.0];
/// Inverse ratio of the deflection at which rolling resistance is complete to the deflection that it approaches; the resistance is complete only
/// after rolling in one direction.
const TURNS: f64 = 1.25;
/// Least contact half length as a fraction of the radius.
const LENGTH_MIN: f64 = 0.05;

/// Position and motion of the wheel in the soil.
struct Footprint {
    /// Sinkage below the ground in front of the wheel, m.
    z: f64,
    /// Below the first surface, m.
    first: f64,
    /// State of that ground.
    rut: Rut,
    normal: Vec3,
    point: Vec3,
    ex: Vec3,
    ey: Vec3,
    /// Speed at which the hub approaches the ground, m/s.
    approach: f64,
    /// Rim speed, m/s.
    u: f64,
    /// Mean of rim speed and hub speed, m/s.
    travel: f64,
    /// Slip velocity along x and y, m/s.
    slide: [f64; 2],
    /// Half length of the contact, m.
    length: f64,
    /// Damping time at the present speed, s.
    damping: f64,
}

impl SoilContact {
    /// Returns the load and the rate of the state. `ground` gives height (m) and unit normal of the first surface at x, y;
    /// `past` the state of previously loaded ground.
    pub fn evaluate(
        &self,
        soil: &Soil,
        hub: &Hub,
        state: &SoilState,
        ground: &(impl Relief + ?Sized),
        past: Option<Past<'_>>,
    ) -> (SoilLoad, SoilState) {
        match self.footprint(soil, hub, state, ground, past) {
            Some(f) => (self.load_of(&f, soil, hub, state), self.rates_of(&f, soil, state)),
            None => (SoilLoad::none(hub), spring_back(state)),
        }
    }

    fn footprint(
        &self,
        soil: &Soil,
        hub: &Hub,
        state: &SoilState,
        ground: &(impl Relief + ?Sized),
        past: Option<Past<'_>>,
    ) -> Option<Footprint> {
        let discs = self.wheel.discs(hub.position, hub.axle, ground);
        let (mut weight, mut press, mut point) = (0.0, Vec3::zeros(), Vec3::zeros());
        for patch in discs.iter().flat_map(|d| d.patches()) {
            let w = patch.depth * patch.share;
            weight += w;
            press += patch.normal * w;
            point += patch.point * w;
        }
        let size = press.norm();
        if size <= 0.0 {
            return None;
        }
        point /= weight;
        let normal = press / size;
        let first = size / DISCS as f64;
        let ex = hub.axle.cross(&normal).normalize();
        let ey = normal.cross(&ex);
        let r = self.wheel.radius;
        let rut = past.map_or(Rut::default(), |past| {
            self.met(&past, first, &point, [ex, ey], state.rolled.clamp(-1.0, 1.0))
        });
        let z = first - rut.depth();
        if z <= 0.0 {
            return None;
        }
        let (vx, vy) = (hub.velocity.dot(&ex), hub.velocity.dot(&ey));
        let u = r * hub.angular.dot(&hub.axle);
        let m = state.rolled.abs().min(1.0);
        let front = (1.0 - (z / r).min(1.5)).acos();
        let lambda = m * soil.lambda + 1.0 - m;
        let rear = (1.0 - (lambda * z / r).clamp(0.0, 1.5)).acos();
        let length = r * (0.5 * (front + rear)).max(LENGTH_MIN);
        Some(Footprint {
            z,
            first,
            rut,
            normal,
            point,
            ex,
            ey,
            approach: -hub.velocity.dot(&normal),
            u,
            travel: 0.5 * (u + vx),
            slide: [u - vx, -vy],
            length,
            damping: self.shear_damping.min(0.5 * length / u.abs().max(1e-9)),
        })
    }

    /// Returns the stress model of the wheel on a soil.
    pub(crate) fn stresses(&self, soil: &Soil) -> WheelSoil {
        WheelSoil {
            rim: Rim { radius: self.wheel.radius, width: self.wheel.width },
            soil: *soil,
            shear: self.shear,
            sinkage: Sinkage::Bekker,
            gravity: self.gravity,
            approach: None,
            grousers: None,
        }
    }

    /// Returns the stress model with the grousers at their present angles: `ahead` is the rolling direction of the wheel, `normal` the normal of the
    /// ground.
    pub(crate) fn stresses_at(&self, soil: &Soil, ahead: &Vec3, normal: &Vec3) -> WheelSoil {
        let grousers = self.grousers.map(|(grousers, spoke)| Grousers {
            phase: spoke.dot(ahead).atan2(-spoke.dot(normal)),
            ..grousers
        });
        WheelSoil { grousers, ..self.stresses(soil) }
    }

    /// Returns the state of the ground that a wheel with the footprint shape `m` reaches.
    pub(crate) fn met(
        &self,
        past: &Past<'_>,
        first: f64,
        point: &Vec3,
        [ex, ey]: [Vec3; 2],
        m: f64,
    ) -> Rut {
        let (r, strip) = (self.wheel.radius, self.wheel.width / DISCS as f64);
        let fall = (r - first).max(0.0);
        let end = (r * r - fall * fall).sqrt() + past.grid.cell;
        let ends = [(end, 0.5 * (1.0 + m)), (-end, 0.5 * (1.0 - m))];
        let points = ends.into_iter().filter(|(_, w)| *w > 0.0).flat_map(|(s, w)| {
            (0..DISCS).map(move |i| {
                let t = (i as f64 - 0.5 * (DISCS - 1) as f64) * strip;
                let p = point + ex * s + ey * t;
                ([p.x, p.y], w / DISCS as f64)
            })
        });
        past.grid.mean_at(past.tracks, points)
    }

    /// Returns the deflection at which rolling resistance is complete, m.
    fn elastic(&self, f: &Footprint) -> f64 {
        f.length / self.shear_unloading
    }

    /// Returns the motion for the stress model of a wheel that rolls in one direction: 1 forwards, −1 backwards.
    fn motion(f: &Footprint, state: &SoilState, side: f64) -> Motion {
        let s = side * (state.xi_x + f.damping * f.slide[0]) / f.length;
        let lateral = -(state.xi_y + f.damping * f.slide[1]) / f.length;
        let beta = lateral.atan2((1.0 - s).abs().max(1e-6));
        Motion { slip: s, lateral, rolling: state.rolled.abs().min(1.0), beta }
    }

    /// Returns the forces in the contact frame of a wheel that rolls in one direction.
    fn forces(
        &self,
        (f, soil): (&Footprint, &Soil),
        state: &SoilState,
        side: f64,
    ) -> (WheelForces, Motion) {
        let motion = Self::motion(f, state, side);
        let model = self.stresses_at(soil, &(f.ex * side), &f.normal);
        let there = model.forces_in(f.z, &motion, &f.rut);
        let turned = WheelForces {
            fx: side * there.fx,
            torque: side * there.torque,
            mz: side * there.mz,
            ..there
        };
        (turned, motion)
    }

    fn load_of(&self, f: &Footprint, soil: &Soil, hub: &Hub, state: &SoilState) -> SoilLoad {
        let turned = TURNS * (state.rolling + self.shear_damping * f.travel) / self.elastic(f);
        let direction = turned.clamp(-1.0, 1.0);
        let side = if direction < 0.0 { -1.0 } else { 1.0 };
        let (mut loaded, motion) = self.forces((f, soil), state, side);
        if direction.abs() < 1.0 {
            let (other, _) = self.forces((f, soil), state, -side);
            loaded = loaded.mixed(&other, 0.5 * (1.0 + direction.abs()));
        }
        let model = self.stresses(soil);
        let unloaded = self.unloading_stiffness * (state.pressed - f.first).max(0.0);
        let damped = (1.0 + self.normal_damping * f.approach).max(0.0);
        let carried = (loaded.fz - unloaded).max(0.0) * damped;
        let share = if loaded.fz > 0.0 { carried / loaded.fz } else { 0.0 };
        let local = WheelForces {
            fx: share * loaded.fx,
            fy: share * loaded.fy,
            fz: carried,
            torque: share * loaded.torque,
            mx: share * loaded.mx + (f.point - hub.position).dot(&f.ey) * carried,
            mz: share * loaded.mz,
        };
        let force = f.ex * local.fx + f.ey * local.fy + f.normal * local.fz;
        let moment = f.ex * local.mx - hub.axle * local.torque + f.normal * local.mz;
        SoilLoad {
            force,
            moment,
            local,
            sinkage: f.first,
            rut: f.rut.depth(),
            normal: f.normal,
            heading: f.ex,
            press: model.press(&motion),
            slip: side * motion.slip_scale(),
            slip_angle: motion.beta,
            point: f.point,
            power: -force.dot(&hub.velocity) - moment.dot(&hub.angular),
        }
    }

    fn rates_of(&self, f: &Footprint, soil: &Soil, state: &SoilState) -> SoilState {
        let m = state.rolled.clamp(-1.0, 1.0);
        let forget = f.u.abs() / (f.length - f.damping * f.u.abs());
        let mut shear = f.slide;
        let size = state.xi_x.hypot(state.xi_y);
        if size > 0.0 {
            let (hx, hy) = (state.xi_x / size, state.xi_y / size);
            let stiffer = self.shear_unloading * (size / soil.shear_modulus).max(1.0);
            let back = (stiffer - 1.0) * (shear[0] * hx + shear[1] * hy).min(0.0);
            shear = [shear[0] + back * hx, shear[1] + back * hy];
        }
        let mut rate = SoilState {
            xi_x: shear[0] - forget * state.xi_x,
            xi_y: shear[1] - forget * state.xi_y,
            pressed: (f.first - state.pressed).max(0.0) / FOLLOW
                - (state.pressed - f.first).max(0.0) * FORGET * f.travel.abs() / f.length,
            rolled: (f.travel - m * f.travel.abs()) / f.length,
            rolling: {
                let turn = f.travel.abs() / self.elastic(f);
                // Limit the rate, so that an explicit method is stable however fast the wheel
                // rolls.
                (f.travel - turn * state.rolling) / (1.0 + turn * FOLLOW)
            },
        };
        slide_beyond(state, &mut rate, f.length);
        rate
    }
}

/// Returns the rate of the state of a wheel in the air.
fn spring_back(state: &SoilState) -> SoilState {
    SoilState {
        xi_x: -state.xi_x / FOLLOW,
        xi_y: -state.xi_y / FOLLOW,
        pressed: -state.pressed / FOLLOW,
        rolled: -state.rolled / FOLLOW,
        rolling: -state.rolling / FOLLOW,
    }
}

impl SoilLoad {
    fn none(hub: &Hub) -> SoilLoad {
        SoilLoad {
            force: Vec3::zeros(),
            moment: Vec3::zeros(),
            local: WheelForces::default(),
            sinkage: 0.0,
            rut: 0.0,
            normal: Vec3::z(),
            heading: hub.axle.cross(&Vec3::z()),
            press: (0.0, 0.0),
            slip: 0.0,
            slip_angle: 0.0,
            point: hub.position,
            power: 0.0,
        }
    }
}

/// Limits the rate so that the deflection does not exceed its maximum.
fn slide_beyond(state: &SoilState, rate: &mut SoilState, length: f64) {
    let size = state.xi_x.hypot(state.xi_y);
    let over = (size / length - SLIDE[0]) / (SLIDE[1] - SLIDE[0]);
    if over <= 0.0 {
        return;
    }
    let (hx, hy) = (state.xi_x / size, state.xi_y / size);
    let outward = (rate.xi_x * hx + rate.xi_y * hy).max(0.0);
    let t = over.min(1.0);
    let excess = (size - SLIDE[1] * length).max(0.0) / FOLLOW;
    let cut = t * t * (3.0 - 2.0 * t) * outward + excess;
    rate.xi_x -= cut * hx;
    rate.xi_y -= cut * hy;
}

#[cfg(test)]
#[path = "soil_contact_tests.rs"]
mod tests;
