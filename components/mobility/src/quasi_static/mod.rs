//! Wheels of machines that are quasi-static: what the ground does to them at the load that they carry and the speed at which they slide.
//! ```text
//! u    = (v_x − r ω, v_y)             velocity of the rim over the ground, ahead and to the side
//! f(u) = c − R u                      as a secant: c is the mean of the forces at −|u_x| and |u_x|, R their difference over 2 |u_x|
//! V    = max(|r ω|, |v_x|, 10 nm/s)    speed that slip is a part of
//! ```
//! The mechanism moves so that these forces balance all others, and comes back with the load and the speed of the next instant. Where
//! nothing changes c − R u is the law itself. A secant, not a tangent: beyond the ground's greatest pull a tangent would throw the machine.
mod rigid;
mod soil;

pub use rigid::WheelRigidQuasiStatic;
pub use soil::WheelSoilQuasiStatic;

use crate::rigid_contact::Hub;
use crate::wheel_rigid::hub_of;
use linkwork_runtime::prelude::*;

/// Speed that slip of a parked wheel is a part of, m/s.
const PARKED: f64 = 1e-8;
/// Speed from which a wheel rolls as any faster one does, and its slip angle means something, m/s.
const ROLLING: f64 = 1e-4;

/// Hub and load.
#[derive(Ports, Clone, Copy, Debug)]
pub struct QuasiStaticIn {
    /// Hub of the wheel: its y axis is the axle.
    #[port(bind = "hub", axle = "y")]
    pub hub: NodeState,
    /// What the ground carries.
    #[port(bind = "hub")]
    pub load: ContactLoad,
}

/// A wheel on the ground and how it slides there.
struct Sliding {
    hub: Hub,
    /// Where the ground carries it, its normal there, ahead and side along it, W.
    point: Vec3,
    normal: Vec3,
    axes: [Vec3; 2],
    /// Normal force, N; not negative.
    carries: f64,
    /// From the hub to the rim that slides, m.
    radius: f64,
    /// Speed of the hub ahead, and of the rim, rω, m/s.
    speed: f64,
    rim: f64,
    /// Velocity of the rim over the ground, m/s.
    slides: [f64; 2],
    /// What slip is a part of, m/s.
    scale: f64,
}

impl Sliding {
    /// `radius` (m): of the rim, until the wheel carries something.
    fn of(u: &QuasiStaticIn, radius: f64, terrain: &dyn Terrain) -> Sliding {
        let hub = hub_of(&u.hub);
        let ContactLoad { force, point } = u.load;
        let normal = terrain.ground(point.x, point.y).map_or_else(Vec3::z, |g| g.normal);
        let ahead = hub.axle.cross(&normal).try_normalize(0.0).unwrap_or_else(Vec3::zeros);
        let side = normal.cross(&ahead);
        let carries = force.dot(&normal).max(0.0);
        let radius = if carries > 0.0 { (point - hub.position).norm() } else { radius };
        let (speed, across) = (hub.velocity.dot(&ahead), hub.velocity.dot(&side));
        let rim = radius * hub.angular.dot(&hub.axle);
        Sliding {
            point,
            normal,
            axes: [ahead, side],
            carries,
            radius,
            speed,
            rim,
            slides: [speed - rim, across],
            scale: speed.abs().max(rim.abs()).max(PARKED),
            hub,
        }
    }

    /// 1 forwards, −1 backwards.
    fn direction(&self) -> f64 {
        let faster = if self.rim.abs() >= self.speed.abs() { self.rim } else { self.speed };
        if faster < 0.0 { -1.0 } else { 1.0 }
    }

    /// Slip −1 to 1, signed as the wheel's rate is.
    fn slip(&self) -> f64 {
        (-self.slides[0] / self.scale).clamp(-1.0, 1.0)
    }

    fn slip_angle(&self) -> f64 {
        match self.speed.hypot(self.slides[1]) > ROLLING {
            true => self.slides[1].atan2(self.speed.abs()),
            false => 0.0,
        }
    }
}
