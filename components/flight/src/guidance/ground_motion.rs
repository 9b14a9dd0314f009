//! `flight.ground_motion`: how a craft moves over the ground of a planet that turns, and where it is from a site.
//! ```text
//! v_g = v − ω ẑ × p         over the ground, W       up = p/|p|,  east = ẑ × up,  north = up × east
//! h   = |p| − R             over a sphere of radius R
//! offset = (R_site)ᵀ (p − p_site)                     east, north, up of the site, which turns with the planet
//! ```
//! The planet is at the origin of W and turns about z; its fixed axes are those of W at t = 0. Where W is a site
//! the same holds of the planet's own axes, in which it does not turn. At the poles east is x. This is the true motion: noise is the business of a sensor.

use super::planet::{Seen, over_ground};
use linkwork_runtime::prelude::*;

/// Planet and site.
#[derive(Params, Clone, Debug)]
pub struct GroundMotionParams {
    /// Direction of the site from the planet's centre, in axes that turn with it and are those of W at t = 0.
    /// Unwritten: the site that W is, or x.
    pub site: Option<Vec3>,
    /// Distance R of the ground from the planet's centre.
    #[param(unit = "m", default = 3_396_190.0, range = 1.0..)]
    pub ground_radius: f64,
    /// Rate of the planet about z of W; unwritten: of the site that W is, or of Mars.
    #[param(unit = "rad/s")]
    pub planet_rate: Option<f64>,
    /// Gravity, which knows the site.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// The craft.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GroundMotionIn {
    /// The craft.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// Its motion over the ground.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GroundMotionOut {
    /// Height over the sphere.
    #[port("m")]
    pub height: f64,
    /// Speed over the ground.
    #[port("m/s")]
    pub speed: f64,
    /// Rate of the height.
    #[port("m/s")]
    pub rise: f64,
    /// Angle of the path over the horizontal; down is negative.
    #[port("rad")]
    pub path_angle: f64,
    /// Velocity over the ground: east, north, up of where it is.
    #[port("m/s")]
    pub velocity: Vec3,
    /// Position from the site: east, north, up of the site.
    #[port("m")]
    pub offset: Vec3,
}

/// Where and how something moves, told by its planet.
pub struct Over {
    /// Velocity over the ground, W, m/s.
    pub velocity: Vec3,
    /// East, north, up at the place as columns, to W.
    pub R_WE: linkwork_spatial::Mat3,
}

/// East, north and up at `p` (m, the planet at the origin, its axis z) as columns.
pub fn east_north_up(p: &Vec3) -> linkwork_spatial::Mat3 {
    let up = p.normalize();
    let across = Vec3::z().cross(&up);
    let east = if across.norm() > 1e-12 { across.normalize() } else { Vec3::x() };
    linkwork_spatial::Mat3::from_columns(&[east, up.cross(&east), up])
}

/// Motion of a node over a planet that turns at `rate` (rad/s) about z of W.
pub fn over(node: &NodeState, rate: f64) -> Over {
    Over { velocity: over_ground(node, rate), R_WE: east_north_up(&node.position) }
}

/// Motion over the ground.
pub struct GroundMotion {
    p: GroundMotionParams,
    planet: Seen,
    /// East, north, up of the site, planet's axes.
    site: linkwork_spatial::Mat3,
}

/// True height and velocity over a planet that turns, and the position from a site on it.
#[model("flight.ground_motion")]
impl Model for GroundMotion {
    type Params = GroundMotionParams;
    type Ud = GroundMotionIn;
    type Yd = GroundMotionOut;
    fn build(p: GroundMotionParams) -> Result<Self, BuildError> {
        let planet = Seen::new(&p.gravity, p.planet_rate)?;
        let site = p.site.or(planet.site()).unwrap_or_else(Vec3::x);
        if !(site.norm() > 1e-9) {
            return Err(BuildError::new("the site has no direction")
                .help("write a vector from the planet's centre, e.g. site: [1, 0, 0]")
                .at("site"));
        }
        let site = east_north_up(&site);
        Ok(GroundMotion { p, planet, site })
    }
    fn direct(&self, c: &Clock, _: &(), _: &(), u: &GroundMotionIn) -> GroundMotionOut {
        let (p, rate) = (&self.p, self.planet.rate);
        let body = self.planet.node(&u.body);
        let o = over(&body, rate);
        let velocity = o.R_WE.transpose() * o.velocity;
        let turned = Quat::from_scaled_axis(Vec3::z() * (rate * c.t)).inverse();
        let from_site = turned * body.position - self.site.column(2) * p.ground_radius;
        GroundMotionOut {
            height: body.position.norm() - p.ground_radius,
            speed: velocity.norm(),
            rise: velocity.z,
            path_angle: velocity.z.atan2(velocity.x.hypot(velocity.y)),
            velocity,
            offset: self.site.transpose() * from_site,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::planet::tests::Point;
    use super::*;

    #[test]
    fn what_stands_on_the_ground_stands_and_what_climbs_north_is_seen_so() {
        let (rate, radius, t) = (7.1e-5, 3.39e6, 4321.0);
        let site = Vec3::new(-0.4, 0.7, 0.3);
        let gravity = |site| {
            let point = Point { mu: 4.3e13, site };
            Handle::new("gravity", std::sync::Arc::new(point) as std::sync::Arc<dyn Gravity>)
        };
        let m = GroundMotion::build(GroundMotionParams {
            site: Some(site),
            ground_radius: radius,
            planet_rate: Some(rate),
            gravity: gravity(None),
        });
        let m = m.unwrap();
        let turn = Quat::from_scaled_axis(Vec3::z() * (rate * t));
        let position = turn * site.normalize() * radius;
        let with_ground = (Vec3::z() * rate).cross(&position);
        let at = |height: f64, local: Vec3| {
            let place = position + position.normalize() * height;
            let velocity = (Vec3::z() * rate).cross(&place) + east_north_up(&place) * local;
            let body = NodeState { position: place, velocity, ..NodeState::identity() };
            m.direct(&Clock::at(t, 0.1, 0), &(), &(), &GroundMotionIn { body }, &())
        };
        assert!(with_ground.norm() > 100.0);
        let y = at(0.0, Vec3::zeros());
        assert!(y.speed < 1e-12 && y.height.abs() < 1e-8 && y.offset.norm() < 1e-8, "{y:?}");
        let y = at(2000.0, Vec3::new(0.0, 30.0, 40.0));
        assert!((y.height - 2000.0).abs() < 1e-8 && (y.offset - Vec3::z() * 2000.0).norm() < 1e-8);
        assert!((y.velocity - Vec3::new(0.0, 30.0, 40.0)).norm() < 1e-11);
        assert!((y.speed - 50.0).abs() < 1e-11 && (y.rise - 40.0).abs() < 1e-11);
        assert!((y.path_angle.tan() - 4.0 / 3.0).abs() < 1e-12);
        // To the east is where the planet turns to.
        assert!((east_north_up(&position).transpose() * with_ground).x > 100.0);
        // The same from a site that turns with the planet, whose axes it does not need to know.
        let R = Quat::from_euler_angles(0.3, -0.8, 1.1);
        let pose = linkwork_spatial::Pose::new(R, site.normalize() * radius);
        let standing = GroundMotion::build(GroundMotionParams {
            site: None,
            ground_radius: radius,
            planet_rate: None,
            gravity: gravity(Some(Site { pose, rate, start: Quat::identity() })),
        });
        let local = east_north_up(&pose.position);
        let moving = local * Vec3::new(0.0, 30.0, 40.0);
        let body = NodeState {
            position: R.inverse() * (local * Vec3::z() * 2000.0),
            velocity: R.inverse() * moving,
            ..NodeState::identity()
        };
        let c = Clock::at(t, 0.1, 0);
        let z = standing.unwrap().direct(&c, &(), &(), &GroundMotionIn { body }, &());
        assert!((z.height - y.height).abs() < 1e-8 && (z.offset - y.offset).norm() < 1e-8, "{z:?}");
        assert!((z.velocity - y.velocity).norm() < 1e-11);
        let pole = east_north_up(&Vec3::z());
        assert!((pole.transpose() * pole - linkwork_spatial::Mat3::identity()).norm() < 1e-15);
    }
}
