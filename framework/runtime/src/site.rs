//! W as a site: a frame that is fixed to a planet and turns with it.
//! ```text
//! p_P = X_PW p                            P: axes fixed to the planet, origin at its centre
//! a   = R_WP g_P(p_P) − ω × (ω × (p − c)) − 2 ω × v       what a body in free fall does in W
//! ω   = R_WP ẑ rate                       of W in inertial space, constant in W;  c: the planet's centre in W
//! R_IW(t) = R_IP(0) R_z(rate t) R_PW      I: inertial axes at the planet's centre, those of stars and ephemerides
//! ```
//! Terrain, contact, hinges and velocities are those of the site, so that what stands on the ground has
//! coordinates of metres and velocities of zero. A gravity service that lives in a site ([`Gravity::site`])
//! gives the centrifugal part with its field; the mechanism adds what depends on motion, for each body with its
//! own velocity and spin, exactly.
//!
//! [`Gravity::site`]: crate::Gravity::site
use crate::ports::NodeState;
use crate::services::{ServiceObject, Services};
use linkwork_spatial::{Pose, Quat, Vec3};

/// Where W is on its planet, and how fast that turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// `X_PW`: W in axes that are fixed to the planet, from its centre (m).
    pub pose: Pose,
    /// Rate of the planet about z of those axes, rad/s, east positive.
    pub rate: f64,
    /// `R_IP` at t = 0: those axes in inertial ones.
    pub start: Quat,
}

impl Site {
    /// ω: angular velocity of W in inertial space, W, rad/s.
    #[must_use]
    pub fn omega(&self) -> Vec3 {
        self.pose.rotation.inverse() * (Vec3::z() * self.rate)
    }

    /// `R_IW` at t (s): a vector in W, in inertial axes.
    #[must_use]
    pub fn to_inertial(&self, t: f64) -> Quat {
        let turned = Quat::from_scaled_axis(Vec3::z() * (self.rate * t));
        self.start * turned * self.pose.rotation
    }

    /// From the planet's centre to `p`, both in W, m.
    #[must_use]
    pub fn from_centre(&self, p: &Vec3) -> Vec3 {
        p + self.pose.rotation.inverse() * self.pose.position
    }

    /// Position in the planet's axes, from its centre, of a point in W, m.
    #[must_use]
    pub fn to_planet(&self, p: &Vec3) -> Vec3 {
        self.pose.transform_point(p)
    }

    /// A vector in the planet's axes, in W.
    #[must_use]
    pub fn from_planet_axes(&self, v: &Vec3) -> Vec3 {
        self.pose.rotation.inverse() * v
    }

    /// A node as an observer who turns with the planet sees it from its centre: everything in the planet's axes.
    #[must_use]
    pub fn around_planet(&self, node: &NodeState) -> NodeState {
        let turn = self.pose.rotation;
        NodeState {
            position: self.to_planet(&node.position),
            rotation: turn * node.rotation,
            angular: turn * node.angular,
            velocity: turn * node.velocity,
        }
    }

    /// −ω × (ω × (p − c)) at p (m), W: the centrifugal acceleration, m/s².
    #[must_use]
    pub fn centrifugal(&self, p: &Vec3) -> Vec3 {
        let omega = self.omega();
        -omega.cross(&omega.cross(&self.from_centre(p)))
    }
}

/// What a service takes W for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Axes {
    /// It does not matter.
    Any,
    /// Inertial axes with a planet at the origin.
    Inertial,
    /// A site that turns with its planet.
    Site(Site),
}

impl Axes {
    /// A site, or inertial axes without one.
    #[must_use]
    pub fn of(site: Option<Site>) -> Axes {
        site.map_or(Axes::Inertial, Axes::Site)
    }

    /// The site.
    #[must_use]
    pub fn site(self) -> Option<Site> {
        if let Axes::Site(s) = self { Some(s) } else { None }
    }
}

impl ServiceObject {
    /// What it takes W for.
    pub fn axes(&self) -> Axes {
        match self {
            ServiceObject::Gravity(g) => g.axes(),
            ServiceObject::Atmosphere(a) => a.axes(),
            ServiceObject::Sun(s) => s.axes(),
            ServiceObject::Terrain(_) => Axes::Any,
        }
    }
}

impl Services {
    /// Path of a service that takes W for a site.
    pub(crate) fn in_a_site(&self) -> Option<String> {
        let mut found = self.iter().filter(|(_, o)| o.axes().site().is_some());
        found.next().map(|(path, _)| path.to_string())
    }

    /// Where one takes W for a site: path, fact and remedy for each that takes it for something else, and for
    /// gravity and air that do not care: they bring none of the forces of axes that turn, and know no centre.
    pub(crate) fn at_odds(&self) -> Vec<(String, String, String)> {
        let Some((first, site)) = self.iter().find_map(|(p, o)| Some((p, o.axes().site()?))) else {
            return Vec::new();
        };
        let help = "give all services the same `planet`, by one parameter of the file";
        let wrong = |path: &str, o: &ServiceObject| {
            let takes = match (o.axes(), o) {
                (Axes::Site(s), _) if s != site => "another site",
                (Axes::Inertial, _) => "inertial axes at the planet's centre",
                (Axes::Any, ServiceObject::Gravity(_)) => "axes that do not turn",
                (Axes::Any, ServiceObject::Atmosphere(_)) => "level ground without a planet",
                _ => return None,
            };
            let fact =
                format!("takes W for {takes}, and `{first}` for a site of a planet that turns");
            Some((path.to_string(), fact, help.to_string()))
        };
        let mut all: Vec<_> = self.iter().filter_map(|(path, o)| wrong(path, o)).collect();
        // What turns acts through gravity.
        if !self.iter().any(|(_, o)| matches!(o, ServiceObject::Gravity(_))) {
            let fact = "takes W for a site of a planet that turns, and there is no gravity with the forces of it";
            let help = "add a service of gravity with the same `planet`";
            all.push((first.to_string(), fact.to_string(), help.to_string()));
        }
        all
    }
}
