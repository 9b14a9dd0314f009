//! `manipulation.cutting`: forces on a drill bit and a plate during drilling.
//! ```text
//! δ = −n·(p − p_w)                    depth of the bit's tip below the surface; n: z of the work's node
//! F = k (δ − h)₊                      thrust between the bit's tip and the bottom of the hole, while h < thickness
//! f = 2 (F − F_c)₊ / (K D)            feed per revolution (thrust of two lips, F = K D f/2, above the chisel edge's F_c)
//! ḣ = f Ω/2π                          the hole grows
//! M = K D² f/8                        torque of the lips
//! side F_s = −k_s s − c_s ṡ           s: lateral displacement of the bit from the point of entry
//! ```
//! Source of thrust and torque: M. C. Shaw, *Metal Cutting Principles*, 2nd ed., chapter on drilling, with the specific cutting force K.
//! When the bit breaks through the far side, thrust and torque vanish at once; the hole continues to guide the bit.

use linkwork_runtime::prelude::*;
use std::f64::consts::TAU;

/// Bit and plate.
#[derive(Params, Clone, Debug)]
pub struct CuttingParams {
    /// Diameter of the bit.
    #[param(unit = "m", range = 1e-5..)]
    pub diameter: f64,
    /// Specific cutting force of the plate.
    #[param(unit = "Pa", range = 1.0..)]
    pub cutting_force: f64,
    /// Thrust F_c of the chisel edge before the bit cuts.
    #[param(unit = "N", default = 0.0, range = 0.0..)]
    pub chisel: f64,
    /// Thickness of the plate.
    #[param(unit = "m", range = 1e-6..)]
    pub thickness: f64,
    /// Stiffness of bit and plate along the bit.
    #[param(unit = "N/m", default = 2e5, range = 1.0..)]
    pub stiffness: f64,
    /// Stiffness of the hole across the bit.
    #[param(unit = "N/m", default = 2e4, range = 0.0..)]
    pub side_stiffness: f64,
    /// Damping of the hole across the bit.
    #[param(unit = "N s/m", default = 50.0, range = 0.0..)]
    pub side_damping: f64,
}

/// Bit, plate, spindle.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CuttingIn {
    /// Tip of the bit.
    #[port(bind = "bit")]
    pub bit: NodeState,
    /// The plate: origin on its surface, z outwards.
    #[port(bind = "work")]
    pub work: NodeState,
    /// Rate of the spindle.
    #[port("rad/s", default = 0.0)]
    pub spindle: f64,
}

/// Loads and the hole.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CuttingOut {
    /// Wrench on the bit.
    #[port(bind = "bit")]
    pub on_bit: Wrench,
    /// Wrench on the plate.
    #[port(bind = "work")]
    pub on_work: Wrench,
    /// Thrust along the bit.
    #[port("N")]
    pub thrust: f64,
    /// Torque of the lips.
    #[port("N m")]
    pub torque: f64,
    /// Lateral force on the bit.
    #[port("N")]
    pub side: f64,
    /// Depth of the bit's tip below the surface; negative above.
    #[port("m")]
    pub depth: f64,
    /// Rate at which the hole deepens.
    #[port("m/s")]
    pub feed: f64,
}

/// The hole.
#[derive(State, Clone, Copy, Debug)]
pub struct Hole {
    /// Depth of the hole.
    #[port("m")]
    pub hole: f64,
}

/// Position of the bit.
#[derive(State, Clone, Copy, Debug)]
pub struct Place {
    /// The bit is below the surface.
    #[port("1")]
    pub inside: bool,
    /// Point of entry, work axes.
    #[port("m")]
    pub entry: Vec3,
}

/// Surface crossed.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Crossed {
    /// Depth of the bit's tip, for the event at which it enters.
    #[port("m", rising)]
    pub enters: f64,
    /// Depth of the bit's tip, for the event at which it leaves.
    #[port("m", falling)]
    pub leaves: f64,
}

/// Index in [`Crossed`] of the guard at which the bit enters.
const ENTERS: usize = 0;

/// A bit that drills into a plate.
pub struct Cutting {
    p: CuttingParams,
}

/// Returns position and velocity of the bit relative to the work's node, work axes.
fn seen(u: &CuttingIn) -> (Vec3, Vec3) {
    let R = u.work.rotation.inverse();
    let r = u.bit.position - u.work.position;
    let v = u.bit.velocity - u.work.velocity - u.work.angular.cross(&r);
    (R * r, R * v)
}

impl Cutting {
    /// Returns thrust (N) and feed per revolution (m).
    fn lips(&self, depth: f64, hole: f64) -> (f64, f64) {
        let p = &self.p;
        if hole >= p.thickness {
            return (0.0, 0.0);
        }
        let thrust = p.stiffness * (depth - hole).max(0.0);
        (thrust, 2.0 * (thrust - p.chisel).max(0.0) / (p.cutting_force * p.diameter))
    }
}

/// Drilling: thrust, torque and guidance of a bit in a plate; the hole deepens with the feed.
#[model("manipulation.cutting")]
impl Model for Cutting {
    type Params = CuttingParams;
    type FeedthroughInputs = CuttingIn;
    type FeedthroughOutputs = CuttingOut;
    type State = Hole;
    type DiscreteState = Place;
    type Guards = Crossed;
    fn feedthrough(&self, x: &Hole, d: &Place, u: &CuttingIn) -> CuttingOut {
        let p = &self.p;
        let (at, v) = seen(u);
        let depth = -at.z;
        let (thrust, f) = self.lips(depth, x.hole);
        let turning = u.spindle != 0.0;
        let torque =
            if turning { p.cutting_force * p.diameter * p.diameter * f / 8.0 } else { 0.0 };
        let mut force = Vec3::new(0.0, 0.0, thrust);
        if d.inside && x.hole > 0.0 {
            let s = at - d.entry;
            force.x = -p.side_stiffness * s.x - p.side_damping * v.x;
            force.y = -p.side_stiffness * s.y - p.side_damping * v.y;
        }
        let R = u.work.rotation;
        // The plate resists the rotation of the bit about its axis.
        let moment = R * Vec3::new(0.0, 0.0, -torque * u.spindle.signum());
        let side = force.x.hypot(force.y);
        let force = R * force;
        let r = u.bit.position - u.work.position;
        CuttingOut {
            on_bit: Wrench { moment, force },
            on_work: Wrench { moment: -moment - r.cross(&force), force: -force },
            thrust,
            torque,
            side,
            depth,
            feed: f * u.spindle.abs() / TAU,
        }
    }
    fn derivatives(&self, y: &CuttingOut) -> Hole {
        Hole { hole: y.feed }
    }
    fn guards(&self, u: &CuttingIn) -> Crossed {
        let depth = -seen(u).0.z;
        Crossed { enters: depth, leaves: depth }
    }
    fn handle_event(&self, fired: Fired<'_>, x: &Hole, d: &Place, u: &CuttingIn) -> (Hole, Place) {
        let at = seen(u).0;
        // A bit that enters an existing hole keeps the entry point of that hole.
        let entry = if x.hole > 0.0 { d.entry } else { at };
        (*x, Place { inside: fired.rose(ENTERS), entry })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steel() -> Cutting {
        Cutting {
            p: CuttingParams {
                diameter: 6e-3,
                cutting_force: 2e9,
                chisel: 20.0,
                thickness: 4e-3,
                stiffness: 2e5,
                side_stiffness: 2e4,
                side_damping: 50.0,
            },
        }
    }

    fn node(position: Vec3, velocity: Vec3) -> NodeState {
        let (rotation, angular) = (Quat::from_euler_angles(0.0, 0.3, 0.0), Vec3::zeros());
        NodeState { position, rotation, angular, velocity }
    }

    fn at(depth: f64) -> CuttingIn {
        let work = node(Vec3::new(0.4, 0.1, 0.2), Vec3::zeros());
        let bit = node(work.position - work.rotation * Vec3::z() * depth, Vec3::zeros());
        CuttingIn { bit, work, spindle: 100.0 }
    }

    /// With a thrust of 60 N the bit feeds 2 (60 − 20)/(K D) a turn, and all power of the spindle beyond the thrust's is the cut's.
    #[test]
    fn thrust_gives_feed_and_torque() {
        let m = steel();
        let inside = Place { inside: true, entry: Vec3::zeros() };
        let (hole, u) = (Hole { hole: 1e-3 }, at(1e-3 + 60.0 / 2e5));
        let y = m.feedthrough(&hole, &inside, &u);
        let f = 2.0 * 40.0 / (2e9 * 6e-3);
        assert!((y.thrust - 60.0).abs() < 1e-9 && (y.feed - f * 100.0 / TAU).abs() < 1e-15);
        assert!((y.torque - 2e9 * 36e-6 * f / 8.0).abs() < 1e-12);
        let grown = m.derivatives(&y).hole;
        assert_eq!(grown, y.feed);
        // The loads on bit and work are equal and opposite about any point.
        assert!((y.on_bit.force + y.on_work.force).norm() < 1e-12);
        let r = u.bit.position - u.work.position;
        let about = y.on_bit.moment + r.cross(&y.on_bit.force) + y.on_work.moment;
        assert!(about.norm() < 1e-12);
        // The spindle rotates about the outer normal of the plate, and the moment on the bit
        // opposes it.
        assert!(y.on_bit.moment.dot(&(u.work.rotation * Vec3::z())) < 0.0);
    }

    #[test]
    fn too_little_thrust_cuts_nothing_and_a_hole_through_the_plate_pushes_no_more() {
        let m = steel();
        let inside = Place { inside: true, entry: Vec3::zeros() };
        let y = m.feedthrough(&Hole { hole: 0.0 }, &inside, &at(15.0 / 2e5));
        assert!((y.thrust - 15.0).abs() < 1e-9 && y.feed == 0.0 && y.torque == 0.0);
        let y = m.feedthrough(&Hole { hole: 4e-3 }, &inside, &at(5e-3));
        assert!(y.thrust == 0.0 && y.feed == 0.0);
        let still = CuttingIn { spindle: 0.0, ..at(1e-3) };
        let y = m.feedthrough(&Hole { hole: 0.0 }, &inside, &still);
        assert!(y.torque == 0.0 && y.feed == 0.0 && y.thrust > 0.0);
    }

    #[test]
    fn a_hole_stays_where_the_bit_entered_first() {
        let m = steel();
        let out = Place { inside: false, entry: Vec3::zeros() };
        let aside = |depth: f64, x: f64| {
            let mut u = at(depth);
            u.bit.position += u.work.rotation * Vec3::x() * x;
            u
        };
        let (_, first) =
            m.handle_event(Fired::rising(ENTERS), &Hole { hole: 0.0 }, &out, &aside(1e-9, 2e-3));
        assert!(first.inside && (first.entry.x - 2e-3).abs() < 1e-12);
        let (_, again) =
            m.handle_event(Fired::rising(ENTERS), &Hole { hole: 1e-3 }, &first, &aside(1e-9, 3e-3));
        assert!((again.entry.x - 2e-3).abs() < 1e-12);
        let y = m.feedthrough(&Hole { hole: 1e-3 }, &again, &aside(5e-4, 3e-3));
        assert!((y.side - 20.0).abs() < 1e-6, "{}", y.side);
    }
}
