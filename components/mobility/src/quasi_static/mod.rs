//! Wheels of quasi-static machines: the ground reaction at the load that a wheel carries and the velocity at which it slides.
//! ```text
//! u    = (v_x − r ω, v_y)             velocity of the rim over the ground, ahead and to the side
//! f(u) = c − R u                      as a secant: c is the mean of the forces at −|u_x| and |u_x|, R their difference over 2 |u_x|
//! V    = max(|r ω|, |v_x|, 10 nm/s)    speed that slip is a part of
//! ```
//! The mechanism moves so that these forces balance all others, and returns the load and velocity of the next instant. In a steady state c − R u
//! equals the traction law itself. A secant is used instead of a tangent, because beyond the greatest traction of the ground a tangent would have the
//! wrong sign and make the velocity unbounded.
mod rigid;
mod soil;

pub use rigid::WheelRigidQuasiStatic;
pub use soil::WheelSoilQuasiStatic;

use crate::rigid_contact::Hub;
use crate::wheel_rigid::hub_of;
use linkwork_surroundings::prelude::*;

/// Reference speed for the slip of a parked wheel, m/s.
const PARKED: f64 = 1e-8;
/// Speed above which a wheel counts as rolling and its slip angle is defined, m/s.
const ROLLING: f64 = 1e-4;

/// Reports parameters that have no effect without inertia: a wheel then has no `lacks`, and `dynamic` is the model that has it.
fn idle<const N: usize>(names: [&'static str; N], lacks: &str, dynamic: &str) -> Judged {
    let reason = || {
        let why = format!(
            "a wheel of a quasi-static machine is always in balance: it has neither {lacks}"
        );
        let help = format!("remove it, or use `{dynamic}` in a machine with dynamics");
        Some(BuildError::new(why).help(help))
    };
    names.map(|name| (Judge::Param(name), reason())).into()
}

/// Hub and ground load.
#[derive(Ports, Clone, Copy, Debug)]
pub struct QuasiStaticIn {
    /// Hub of the wheel: its y axis is the axle.
    #[port(bind = "hub", axle = "y")]
    pub hub: NodeState,
    /// Load that the ground carries.
    #[port(bind = "hub")]
    pub load: ContactLoad,
}

/// Contact of a wheel with the ground, and its sliding velocity.
struct Sliding {
    hub: Hub,
    /// Contact point, ground normal there, and tangent axes forward and sideways, W.
    point: Vec3,
    normal: Vec3,
    axes: [Vec3; 2],
    /// Normal force, N; not negative.
    carries: f64,
    /// Distance from the hub to the sliding rim, m.
    radius: f64,
    /// Forward speed of the hub, and speed of the rim rω, m/s.
    speed: f64,
    rim: f64,
    /// Velocity of the rim relative to the ground, m/s.
    slides: [f64; 2],
    /// Reference speed of the slip, m/s.
    scale: f64,
}

impl Sliding {
    /// Computes the contact; `radius` (m) is the radius of the rim, used while the wheel carries no load.
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

    /// Returns the direction of travel: 1 forwards, −1 backwards.
    fn direction(&self) -> f64 {
        let faster = if self.rim.abs() >= self.speed.abs() { self.rim } else { self.speed };
        if faster < 0.0 { -1.0 } else { 1.0 }
    }

    /// Returns the slip, −1 to 1, positive while driving forwards.
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
