//! `flight.ground_motion`: velocity of a vehicle relative to the ground, its geodetic position, and its position relative to a site.
//! ```text
//! v_g = v − ω × p           over the ground, W       up = p/|p|,  east = pole × up,  north = up × east
//! h   = |p| − R             over a sphere of radius R
//! latitude, longitude, altitude                       geodetic, over the ellipsoid of the world's body
//! offset = (R_site)ᵀ (p − p_site)                     east, north, up of the site, which turns with the planet
//! ```
//! Pole, rotation rate and radius come from the world. On level ground up is opposite to gravity, east and north are x and y of W, and h = p · up. At
//! the poles east is x. The outputs are true values; use a sensor model for noise.

use super::planet::{Frame, over_ground};
use linkwork_surroundings::prelude::*;

/// Planet and reference site.
#[derive(Params, Clone, Debug)]
pub struct GroundMotionParams {
    /// Direction of the site from the planet's centre, in planet-fixed axes. Default: the site W, or x.
    pub site: Option<Vec3>,
    /// Distance R of the ground from the planet's centre; default: the distance of the origin of the site W, or the equatorial radius.
    #[param(unit = "m", range = 1.0..)]
    pub ground_radius: Option<f64>,
    /// The world; without a world the ground is level.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
    /// Gravity, for the vertical of level ground.
    #[param(service)]
    pub gravity: Option<Handle<dyn Gravity>>,
}

/// The vehicle.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GroundMotionIn {
    /// Node on the vehicle.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// Motion relative to the ground.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GroundMotionOut {
    /// Height above the sphere of radius R.
    #[port("m")]
    pub height: f64,
    /// Ground-relative speed.
    #[port("m/s")]
    pub speed: f64,
    /// Vertical speed, positive upwards.
    #[port("m/s")]
    pub rise: f64,
    /// Flight path angle above the horizontal; negative during descent.
    #[port("rad")]
    pub path_angle: f64,
    /// Velocity relative to the ground: east, north, up at the vehicle.
    #[port("m/s")]
    pub velocity: Vec3,
    /// Position relative to the site: east, north, up of the site; on level ground relative to the origin of W.
    #[port("m")]
    pub offset: Vec3,
    /// Geodetic latitude, north positive; 0 on level ground without a world.
    #[port("rad")]
    pub latitude: f64,
    /// East longitude, −π to π; 0 on level ground without a world.
    #[port("rad")]
    pub longitude: f64,
    /// Height above the ellipsoid; on level ground without a world equal to `height`.
    #[port("m")]
    pub altitude: f64,
}

/// Ground-relative velocity of a node and the local axes.
pub struct Over {
    /// Velocity relative to the ground, W, m/s.
    pub velocity: Vec3,
    /// East, north and up at the node as columns: rotation from these axes to W.
    pub R_WE: linkwork_spatial::Mat3,
}

/// Returns east, north and up at `p` as columns (m; the planet is at the origin, its axis is z).
pub fn east_north_up(p: &Vec3) -> linkwork_spatial::Mat3 {
    let up = p.normalize();
    let across = Vec3::z().cross(&up);
    let east = if across.norm() > 1e-12 { across.normalize() } else { Vec3::x() };
    linkwork_spatial::Mat3::from_columns(&[east, up.cross(&east), up])
}

/// Computes the motion of a node relative to a planet that rotates at `rate` (rad/s) about z of W.
pub fn over(node: &NodeState, rate: f64) -> Over {
    Over { velocity: over_ground(node, rate), R_WE: east_north_up(&node.position) }
}

/// Motion relative to the ground.
pub struct GroundMotion {
    frame: Frame,
    world: Option<Handle<dyn World>>,
    radius: f64,
    /// East, north and up of the site as columns, planet-fixed axes.
    site: linkwork_spatial::Mat3,
}

/// True height, velocity and geodetic position over a rotating planet, and the position relative to a site on it.
#[model("flight.ground_motion")]
impl Model for GroundMotion {
    type Params = GroundMotionParams;
    type FeedthroughInputs = GroundMotionIn;
    type FeedthroughOutputs = GroundMotionOut;
    fn build(p: GroundMotionParams) -> Result<Self, BuildError> {
        let frame = Frame::new(p.world.as_ref(), p.gravity.as_ref())?;
        frame.of_a_planet(p.ground_radius, "ground_radius")?;
        frame.of_a_planet(p.site, "site")?;
        let radius = p.ground_radius.unwrap_or_else(|| frame.ground_radius());
        let site = p.site.or(frame.site()).unwrap_or_else(Vec3::x);
        if !(site.norm() > 1e-9) {
            return Err(BuildError::new("`site` is the zero vector")
                .help("write a vector from the planet's centre, e.g. site: [1, 0, 0]")
                .at("site"));
        }
        let site = east_north_up(&site);
        Ok(GroundMotion { frame, world: p.world, radius, site })
    }
    fn feedthrough(&self, clock: &Clock, u: &GroundMotionIn) -> GroundMotionOut {
        let (rate, frame) = (self.frame.rate, &self.frame);
        let place = self.world.as_ref().and_then(|w| w.geographic(clock.t, u.body.position));
        let (velocity, height, offset) = if frame.is_level() {
            let axes = frame.level_axes(clock.t, &u.body.position).transpose();
            let offset = axes * u.body.position;
            (axes * u.body.velocity, offset.z, offset)
        } else {
            let body = frame.node(&u.body);
            let o = over(&body, rate);
            let turned = Quat::from_scaled_axis(Vec3::z() * (rate * clock.t)).inverse();
            let from_site = turned * body.position - self.site.column(2) * self.radius;
            let height = body.position.norm() - self.radius;
            (o.R_WE.transpose() * o.velocity, height, self.site.transpose() * from_site)
        };
        GroundMotionOut {
            height,
            speed: velocity.norm(),
            rise: velocity.z,
            path_angle: velocity.z.atan2(velocity.x.hypot(velocity.y)),
            velocity,
            offset,
            latitude: place.map_or(0.0, |g| g.latitude),
            longitude: place.map_or(0.0, |g| g.longitude),
            altitude: place.map_or(height, |g| g.altitude),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::PlainWorld;
    use linkwork_surroundings::testing;

    #[test]
    fn what_stands_on_the_ground_stands_and_what_climbs_north_is_seen_so() {
        let (rate, radius, t) = (7.1e-5, 3.39e6, 4321.0);
        let site = Vec3::new(-0.4, 0.7, 0.3);
        let m = GroundMotion::build(GroundMotionParams {
            site: Some(site),
            ground_radius: None,
            world: Some(PlainWorld::inertial(4.3e13, radius, rate).handle()),
            gravity: None,
        });
        let m = m.unwrap();
        let turn = Quat::from_scaled_axis(Vec3::z() * (rate * t));
        let position = turn * site.normalize() * radius;
        let with_ground = (Vec3::z() * rate).cross(&position);
        let at = |height: f64, local: Vec3| {
            let place = position + position.normalize() * height;
            let velocity = (Vec3::z() * rate).cross(&place) + east_north_up(&place) * local;
            let body = NodeState { position: place, velocity, ..NodeState::identity() };
            m.feedthrough(&Clock::at(t, 0.1, 0), &GroundMotionIn { body })
        };
        assert!(with_ground.norm() > 100.0);
        let y = at(0.0, Vec3::zeros());
        assert!(y.speed < 1e-12 && y.height.abs() < 1e-8 && y.offset.norm() < 1e-8, "{y:?}");
        let y = at(2000.0, Vec3::new(0.0, 30.0, 40.0));
        assert!((y.height - 2000.0).abs() < 1e-8 && (y.offset - Vec3::z() * 2000.0).norm() < 1e-8);
        assert!((y.velocity - Vec3::new(0.0, 30.0, 40.0)).norm() < 1e-11);
        assert!((y.speed - 50.0).abs() < 1e-11 && (y.rise - 40.0).abs() < 1e-11);
        assert!((y.path_angle.tan() - 4.0 / 3.0).abs() < 1e-12);
        // The planet's rotation moves the ground to the east.
        assert!((east_north_up(&position).transpose() * with_ground).x > 100.0);
        // With W as a site that rotates with the planet, the outputs are the same.
        let R = Quat::from_euler_angles(0.3, -0.8, 1.1);
        let pose = linkwork_spatial::Pose::new(R, site.normalize() * radius);
        let here = Site { pose, rate, start: Quat::identity() };
        let standing = GroundMotion::build(GroundMotionParams {
            site: None,
            ground_radius: None,
            world: Some(PlainWorld::of_site(4.3e13, radius, here).handle()),
            gravity: None,
        });
        let local = east_north_up(&pose.position);
        let moving = local * Vec3::new(0.0, 30.0, 40.0);
        let body = NodeState {
            position: R.inverse() * (local * Vec3::z() * 2000.0),
            velocity: R.inverse() * moving,
            ..NodeState::identity()
        };
        let c = Clock::at(t, 0.1, 0);
        let z = standing.unwrap().feedthrough(&c, &GroundMotionIn { body });
        assert!((z.height - y.height).abs() < 1e-8 && (z.offset - y.offset).norm() < 1e-8, "{z:?}");
        assert!((z.velocity - y.velocity).norm() < 1e-11);
        let pole = east_north_up(&Vec3::z());
        assert!((pole.transpose() * pole - linkwork_spatial::Mat3::identity()).norm() < 1e-15);
    }

    /// On level ground the local axes do not depend on the distance from the origin of W.
    #[test]
    fn on_level_ground_up_is_against_gravity() {
        let gravity = Some(testing::gravity(|_, _| Vec3::z() * -1.62));
        let level = GroundMotionParams { site: None, ground_radius: None, world: None, gravity };
        let m = GroundMotion::build(level.clone()).unwrap();
        let velocity = Vec3::new(3.0, 4.0, -12.0);
        let body =
            NodeState { position: Vec3::new(1e5, 0.0, 50.0), velocity, ..NodeState::identity() };
        let y = m.feedthrough(&Clock::at(9.0, 0.1, 0), &GroundMotionIn { body });
        assert_eq!((y.height, y.altitude, y.velocity), (50.0, 50.0, velocity));
        assert!((y.path_angle + f64::atan2(12.0, 5.0)).abs() < 1e-12 && y.rise == -12.0);
        let wrong = GroundMotionParams { ground_radius: Some(3e6), ..level };
        let e = GroundMotion::build(wrong).err().unwrap();
        assert_eq!(e.param.as_deref(), Some("ground_radius"));
    }
}
