//! The planet as guidance sees it: at the origin, about z, turning at one rate or, from a site, not at all.
//! ```text
//! W inertial   the planet is at the origin of W and turns about z at `rate`
//! W a site     p_P = X_PW p,  v_P = R_PW v: the planet's own axes, in which it stands still
//! ```
//! Laws are written once, for a planet at the origin that turns at [`Seen::rate`].

use linkwork_runtime::prelude::*;

/// Mean sidereal rate of Mars, rad/s, where nothing else is said.
const MARS: f64 = 7.088_218_1e-5;

/// Position from the planet's centre (m) and inertial velocity (m/s) of a node, along the axes of W as they stand
/// at the moment, where W is inertial with the planet at its origin, or a site.
pub fn inertial(site: Option<&Site>, node: &NodeState) -> (Vec3, Vec3) {
    let Some(s) = site else { return (node.position, node.velocity) };
    let r = s.from_centre(&node.position);
    (r, node.velocity + s.omega().cross(&r))
}

/// Velocity (m/s) over the ground of a planet at the origin that turns at `rate` (rad/s) about z.
pub fn over_ground(node: &NodeState, rate: f64) -> Vec3 {
    node.velocity - (Vec3::z() * rate).cross(&node.position)
}

/// How states and forces go between W and the axes that guidance works in.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    site: Option<Site>,
    /// Rate of the planet about z of those axes, rad/s; 0 from a site.
    pub rate: f64,
}

impl Seen {
    /// From the field of gravity, which knows the site, and the rate that is written (rad/s; none: of Mars).
    ///
    /// # Errors
    /// A rate that is not the site's.
    pub fn new(gravity: &Handle<dyn Gravity>, rate: Option<f64>) -> Result<Seen, BuildError> {
        let Some(site) = gravity.site() else {
            return Ok(Seen { site: None, rate: rate.unwrap_or(MARS) });
        };
        match rate.filter(|r| *r != site.rate) {
            None => Ok(Seen { site: Some(site), rate: 0.0 }),
            Some(r) => {
                let fact = format!(
                    "planet_rate is {r} rad/s, but the site of `{}` turns at {} rad/s",
                    gravity.path(),
                    site.rate
                );
                Err(BuildError::new(fact).help("take `planet_rate` out").at("planet_rate"))
            }
        }
    }

    /// A node around the planet.
    pub fn node(&self, node: &NodeState) -> NodeState {
        self.site.as_ref().map_or(*node, |s| s.around_planet(node))
    }

    /// A vector of these axes in W.
    pub fn to_W(&self, v: &Vec3) -> Vec3 {
        self.site.as_ref().map_or(*v, |s| s.from_planet_axes(v))
    }

    /// Direction of the site's origin from the planet's centre, in these axes; none when W is inertial.
    pub fn site(&self) -> Option<Vec3> {
        self.site.as_ref().map(|s| s.pose.position.normalize())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::sync::Arc;

    /// A point of attraction around which W is a site, or at whose centre W is.
    pub struct Point {
        pub mu: f64,
        pub site: Option<Site>,
    }
    impl Gravity for Point {
        fn acceleration(&self, _: f64, p: Vec3) -> Vec3 {
            let pull = |r: Vec3| r * (-self.mu / r.norm().powi(3));
            self.site
                .as_ref()
                .map_or_else(|| pull(p), |s| pull(s.from_centre(&p)) + s.centrifugal(&p))
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
    fn a_rate_that_is_not_the_sites_is_refused() {
        let pose = linkwork_spatial::Pose::new(Quat::identity(), Vec3::z() * 3.4e6);
        let point =
            Point { mu: 4.3e13, site: Some(Site { pose, rate: 7e-5, start: Quat::identity() }) };
        let gravity = Handle::new("gravity", Arc::new(point) as Arc<dyn Gravity>);
        let e = Seen::new(&gravity, Some(7.1e-5)).err().unwrap();
        assert!(e.message.contains("7.1e-5") || e.message.contains("0.000071"), "{}", e.message);
        assert!(e.param.as_deref() == Some("planet_rate") && e.help.is_some());
        for rate in [None, Some(7e-5)] {
            assert_eq!(Seen::new(&gravity, rate).unwrap().rate, 0.0);
        }
    }
}
