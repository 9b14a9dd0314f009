//! The ground for guidance laws: a planet at the origin that rotates about z, a site on a planet, or level ground.
//! ```text
//! W inertial   Q: axes of the planet at t = 0, origin at its centre; it turns about z of Q at `rate`
//! W a site     p_P = X_PW p,  v_P = R_PW v: the planet's own axes, in which it stands still
//! level        no planet, or one whose rotation is left out: up is against gravity, the ground stands still
//! ```
//! Guidance laws are implemented once, for a planet at the origin that rotates at the rate of the world. This module converts states and forces
//! between W and these axes.

use linkwork_spatial::Mat3;
use linkwork_surroundings::prelude::*;

/// Returns the position from the planet's centre (m) and the inertial velocity (m/s) of a node, in the instantaneous axes of W. W is inertial with
/// the planet at its origin, or a site.
pub fn inertial(site: Option<&Site>, node: &NodeState) -> (Vec3, Vec3) {
    let Some(s) = site else { return (node.position, node.velocity) };
    let r = s.relative_to_centre(&node.position);
    (r, node.velocity + s.omega().cross(&r))
}

/// Returns the velocity (m/s) relative to the ground of a planet at the origin that rotates at `rate` (rad/s) about z.
pub fn over_ground(node: &NodeState, rate: f64) -> Vec3 {
    node.velocity - (Vec3::z() * rate).cross(&node.position)
}

/// Kind of the frame W.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Inertial; holds `R_WQ`, or `None` for the identity.
    Inertial(Option<Quat>),
    /// Site that rotates with its planet.
    Site(Site),
    /// Level ground.
    Level,
}

/// Conversion of states and forces between W and the axes of the guidance laws.
#[derive(Clone, Debug)]
pub struct Frame {
    kind: Kind,
    vertical: Vertical,
    /// Rotation rate of the planet about z of the guidance axes, rad/s; 0 at a site and on level ground.
    pub rate: f64,
    /// Equatorial radius of the planet, m; `None` without a world.
    radius: Option<f64>,
}

impl Frame {
    /// Creates the conversion from the world, or from gravity if there is no world.
    ///
    /// # Errors
    /// There is neither a world nor gravity, so the vertical is undefined; or gravity is that of a body and there is no world.
    pub fn new(
        world: Option<&Handle<dyn World>>,
        gravity: Option<&Handle<dyn Gravity>>,
    ) -> Result<Frame, BuildError> {
        let vertical = Vertical::new(world, gravity)?;
        let Some(world) = world else {
            let axes = gravity.map_or(Axes::Any, |g| g.axes());
            let kind = match axes {
                Axes::Site(site) => Kind::Site(site),
                // Gravity of a body without a world comes from another library; the rotation of the body is not known.
                Axes::Inertial => {
                    let fact = "the gravity belongs to a body at the origin of W, but the simulation has no `world` that defines the rotation of the body";
                    let help = "write `world: (body: ..)` in the simulation";
                    return Err(BuildError::new(fact).help(help));
                }
                Axes::Any | Axes::Level(_) => Kind::Level,
            };
            return Ok(Frame { kind, vertical, rate: 0.0, radius: None });
        };
        let (kind, rate) = match world.axes() {
            Axes::Site(site) => (Kind::Site(site), 0.0),
            Axes::Level(_) => (Kind::Level, 0.0),
            Axes::Inertial | Axes::Any => {
                let turn = world.planet_axes(0.0);
                let rate = (turn.inverse() * world.planet_rate(0.0)).z;
                let turn = (turn != Quat::identity()).then_some(turn);
                (Kind::Inertial(turn), rate)
            }
        };
        Ok(Frame { kind, vertical, rate, radius: Some(world.radius()) })
    }

    /// Returns true without a planet, or if the world neglects its rotation and curvature.
    pub fn is_level(&self) -> bool {
        matches!(self.kind, Kind::Level)
    }

    /// Returns the state of a node in the guidance axes; on level ground the state in W.
    pub fn node(&self, node: &NodeState) -> NodeState {
        match &self.kind {
            Kind::Site(s) => s.around_planet(node),
            Kind::Inertial(Some(turn)) => {
                let back = turn.inverse();
                NodeState {
                    position: back * node.position,
                    rotation: back * node.rotation,
                    angular: back * node.angular,
                    velocity: back * node.velocity,
                }
            }
            Kind::Inertial(None) | Kind::Level => *node,
        }
    }

    /// Converts a vector from the guidance axes to W.
    pub fn to_W(&self, v: &Vec3) -> Vec3 {
        match &self.kind {
            Kind::Site(s) => s.from_planet_axes(v),
            Kind::Inertial(Some(turn)) => turn * v,
            Kind::Inertial(None) | Kind::Level => *v,
        }
    }

    /// Returns the unit vector from the planet's centre to the origin of the site, guidance axes; `None` if W is not a site.
    pub fn site(&self) -> Option<Vec3> {
        if let Kind::Site(s) = &self.kind { Some(s.pose.position.normalize()) } else { None }
    }

    /// Returns the default distance (m) of the ground from the planet's centre: the distance of the site's origin, or the equatorial radius. 0 on
    /// level ground.
    pub fn ground_radius(&self) -> f64 {
        match &self.kind {
            Kind::Site(s) => s.pose.position.norm(),
            Kind::Inertial(_) => self.radius.unwrap_or(0.0),
            Kind::Level => 0.0,
        }
    }

    /// Returns the unit vector upwards at p (m, W), in W.
    pub fn up(&self, t: f64, p: &Vec3) -> Vec3 {
        self.vertical.up(t, p)
    }

    /// Returns the velocity (m/s, W) of a node relative to the ground.
    pub fn over_ground(&self, node: &NodeState) -> Vec3 {
        match &self.kind {
            Kind::Inertial(turn) => {
                let pole = turn.map_or(Vec3::z(), |turn| turn * Vec3::z());
                node.velocity - (pole * self.rate).cross(&node.position)
            }
            Kind::Site(_) | Kind::Level => node.velocity,
        }
    }

    /// Returns east, north and up of level ground as columns: x and y of W, rotated so that up is opposite to gravity.
    pub fn level_axes(&self, t: f64, p: &Vec3) -> Mat3 {
        let up = self.up(t, p);
        let across = Vec3::x() - up * up.x;
        let east = if across.norm() > 1e-9 { across.normalize() } else { Vec3::y() };
        Mat3::from_columns(&[east, up.cross(&east), up])
    }

    /// Returns an error if a parameter is written that has a meaning only on a planet.
    pub fn of_a_planet<T>(&self, written: Option<T>, param: &str) -> Result<(), BuildError> {
        if written.is_none() || !self.is_level() {
            return Ok(());
        }
        let fact = "this parameter is a distance from the centre of a planet, but the ground of this simulation is level";
        let help = format!("remove `{param}`, or write `world: (body: ..)` in the simulation");
        Err(BuildError::new(fact).help(help).at(param))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use linkwork_surroundings::PlainWorld;
    use std::sync::Arc;

    /// Gravity of a point mass; W is a site around it, or has its origin at its centre.
    pub struct Point {
        pub mu: f64,
        pub site: Option<Site>,
    }
    impl Gravity for Point {
        fn acceleration(&self, _: f64, p: Vec3) -> Vec3 {
            let pull = |r: Vec3| r * (-self.mu / r.norm().powi(3));
            self.site
                .as_ref()
                .map_or_else(|| pull(p), |s| pull(s.relative_to_centre(&p)) + s.centrifugal(&p))
        }
        fn axes(&self) -> Axes {
            Axes::of(self.site)
        }
    }

    #[test]
    fn what_stands_on_the_ground_moves_with_the_planet() {
        let turn = Quat::from_euler_angles(0.3, -0.8, 1.1);
        let pose = linkwork_spatial::Pose::new(turn, Vec3::new(2e6, -1e6, 2.4e6));
        let site = Site { pose, rate: 7e-5, start: Quat::identity() };
        let node = NodeState { position: Vec3::new(3.0, -4.0, 12.0), ..NodeState::identity() };
        let (r, v) = inertial(Some(&site), &node);
        let p = site.to_planet(&node.position);
        assert!((turn * r - p).norm() < 1e-8);
        assert!((turn * v - (Vec3::z() * 7e-5).cross(&p)).norm() < 1e-12);
        assert_eq!(inertial(None, &node), (node.position, node.velocity));
    }

    #[test]
    fn a_leaning_planet_turns_about_its_own_pole() {
        let lean = Quat::from_euler_angles(0.4, -0.3, 0.9);
        let world = PlainWorld { start: lean, ..PlainWorld::inertial(4.3e13, 3.4e6, 7e-5) };
        let frame = Frame::new(Some(&world.handle()), None).unwrap();
        // A point at rest on the ground has zero velocity relative to the ground, and its latitude in the guidance axes is the latitude on the
        // planet.
        let in_planet = Vec3::new(1e6, 2e6, 2.5e6);
        let p = lean * in_planet;
        let v = world.planet_rate(0.0).cross(&p);
        let node = NodeState { position: p, velocity: v, ..NodeState::identity() };
        assert!(frame.over_ground(&node).norm() < 1e-9);
        let seen = frame.node(&node);
        assert!((seen.position - in_planet).norm() < 1e-8 && frame.rate == 7e-5);
        assert!(over_ground(&seen, frame.rate).norm() < 1e-9);
        assert!((frame.to_W(&seen.position) - p).norm() < 1e-8);
        assert_eq!(frame.ground_radius(), 3.4e6);
    }

    #[test]
    fn level_ground_has_gravity_for_its_vertical_and_no_planet() {
        struct Down;
        impl Gravity for Down {
            fn acceleration(&self, _: f64, _: Vec3) -> Vec3 {
                Vec3::new(0.5, 0.0, -1.62)
            }
            fn uniform(&self) -> Option<Vec3> {
                Some(Vec3::new(0.5, 0.0, -1.62))
            }
        }
        let down = Handle::new("g", Arc::new(Down) as Arc<dyn Gravity>);
        let frame = Frame::new(None, Some(&down)).unwrap();
        let node = NodeState { position: Vec3::new(1e5, 0.0, 50.0), ..NodeState::identity() };
        assert_eq!((frame.node(&node), frame.rate), (node, 0.0));
        let axes = frame.level_axes(0.0, &node.position);
        let up = Vec3::new(-0.5, 0.0, 1.62).normalize();
        assert!((axes.column(2) - up).norm() < 1e-15 && (axes.determinant() - 1.0).abs() < 1e-12);
        let e = frame.of_a_planet(Some(1.0), "ground_radius").err().unwrap();
        assert!(e.param.as_deref() == Some("ground_radius") && e.help.is_some());
        assert!(
            Frame::new(None, None).err().unwrap().message.contains("direction of the vertical")
        );
        let point = Handle::new("g", Arc::new(Point { mu: 1.0, site: None }) as Arc<dyn Gravity>);
        assert!(Frame::new(None, Some(&point)).err().unwrap().help.unwrap().contains("world"));
    }
}
