//! `flight.orbit`: the osculating orbit of a spacecraft, that is, its two-body orbit about the planet as a point mass.
//! ```text
//! E = v²/2 − μ/r      h = r × v      p = h²/μ      e = |v × h/μ − r̂|      a = −μ/2E      i: h from z of the axes
//! pericentre p/(1 + e) − R      apocentre p/(1 − e) − R, 10³⁰ m on an orbit that is open: farther than any
//! ```
//! r and v are inertial. Inclination, ascending node and argument of the pericentre refer to the planet's equator and to its prime meridian at t = 0,
//! for any direction of the pole in W, or to the inertial axes of the world. Energy, eccentricity, angles, and heights except the height of the apocentre are
//! continuous at escape, so that conditions of phases can use them.

use crate::guidance::planet::inertial;
use linkwork_surroundings::prelude::*;
use linkwork_world::orbit::Elements;
use linkwork_world::planet::PointMotion;

/// Parameters of the orbit.
#[derive(Params, Clone, Debug)]
pub struct OrbitParams {
    /// Radius R above which heights are measured; default: the equatorial radius of the world's body.
    #[param(unit = "m", range = 0.0..)]
    pub radius: Option<f64>,
    /// Axes to which the angles refer: `equator` of the planet, with x through its prime meridian at t = 0, or `inertial` axes of the world (ICRF
    /// with `turns: iau`). The `elements` of a start have the same two values of `frame`.
    #[param(default = OrbitAxes::Equator)]
    pub axes: OrbitAxes,
    /// The world, whose body the orbit is about.
    #[param(service)]
    pub world: Handle<dyn World>,
}

/// Axes of the angles of an orbit.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum OrbitAxes {
    /// Axes of the planet at t = 0.
    Equator,
    /// Inertial axes of the world.
    Inertial,
}

/// The spacecraft.
#[derive(Ports, Clone, Copy, Debug)]
pub struct OrbitIn {
    /// Node on the spacecraft.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// The osculating orbit.
#[derive(Ports, Clone, Copy, Debug)]
pub struct OrbitOut {
    /// Height above the sphere of radius R.
    #[port("m")]
    pub height: f64,
    /// Inertial speed.
    #[port("m/s")]
    pub speed: f64,
    /// Flight path angle: angle of the inertial velocity above the horizontal.
    #[port("rad")]
    pub path_angle: f64,
    /// Specific energy E; negative on an ellipse.
    #[port("m^2/s^2")]
    pub energy: f64,
    /// Eccentricity.
    #[port("1")]
    pub eccentricity: f64,
    /// Semi-major axis; negative on a hyperbola, ±1e30 m near a parabola.
    #[port("m")]
    pub semi_major_axis: f64,
    /// Inclination to the x–y plane of `axes`.
    #[port("rad")]
    pub inclination: f64,
    /// Longitude (right ascension) of the ascending node from x of `axes`, 0 to 2π; 0 on an equatorial orbit.
    #[port("rad")]
    pub ascending_node: f64,
    /// Argument of the pericentre, from the ascending node, 0 to 2π; 0 on a circular orbit.
    #[port("rad")]
    pub argument_of_pericentre: f64,
    /// True anomaly, from the pericentre, 0 to 2π; from the ascending node on a circular orbit.
    #[port("rad")]
    pub anomaly: f64,
    /// Height of the pericentre.
    #[port("m")]
    pub pericentre: f64,
    /// Height of the apocentre; 1e30 m on an open orbit, so that a condition such as `apocentre < 500 km` is false there.
    #[port("m")]
    pub apocentre: f64,
}

/// Height of the apocentre of an open orbit, and largest semi-major axis, m.
const OPEN: f64 = 1e30;
/// Least distance from the centre for the potential energy, m; avoids a division by zero.
const NEAREST: f64 = 1.0;

/// Returns the gravitational parameter (m³/s²) of the world's body.
///
/// # Errors
/// The gravitational parameter of the body is not known.
pub(crate) fn body_mu(world: &Handle<dyn World>) -> Result<f64, BuildError> {
    world.mu().ok_or_else(|| {
        let fact = "the gravity parameter of the world's body is not known";
        BuildError::new(fact).help("write `mu` in `world`")
    })
}

/// Returns the site if W is a site, for laws that need inertial motion about the centre of the world's body.
///
/// # Errors
/// W is level ground, which has no inertial axes.
pub(crate) fn orbital(world: &Handle<dyn World>) -> Result<Option<Site>, BuildError> {
    if let Axes::Level(_) = world.axes() {
        let fact = "an orbit is about the centre of a body, but `turning: false` of the world makes the ground level and W has no inertial axes";
        return Err(BuildError::new(fact).help("remove `turning: false`, or this part"));
    }
    Ok(world.axes().site())
}

/// Osculating orbit about the world's body.
pub struct Orbit {
    mu: f64,
    radius: f64,
    site: Option<Site>,
    /// Rotation to the axes of the angles from inertial axes W, or, if W is a site, from the axes of the planet at t = 0.
    to_axes: Quat,
}

/// Osculating orbit of a spacecraft: energy, elements, heights of pericentre and apocentre.
#[model("flight.orbit")]
impl Model for Orbit {
    type Params = OrbitParams;
    type FeedthroughInputs = OrbitIn;
    type FeedthroughOutputs = OrbitOut;
    fn build(p: OrbitParams) -> Result<Self, BuildError> {
        let (mu, site) = (body_mu(&p.world)?, orbital(&p.world)?);
        let to_axes = match (p.axes, site) {
            (OrbitAxes::Equator, None) => p.world.planet_axes(0.0).inverse(),
            (OrbitAxes::Inertial, Some(site)) => site.start,
            (OrbitAxes::Equator, Some(_)) | (OrbitAxes::Inertial, None) => Quat::identity(),
        };
        let radius = p.radius.unwrap_or_else(|| p.world.radius());
        Ok(Orbit { mu, radius, site, to_axes })
    }
    fn feedthrough(&self, clock: &Clock, u: &OrbitIn) -> OrbitOut {
        let (mu, radius) = (self.mu, self.radius);
        let (r, v) = inertial(self.site.as_ref(), &u.body);
        let turn = self.site.map_or(self.to_axes, |s| {
            let turned = Quat::from_scaled_axis(Vec3::z() * (s.rate * clock.t));
            self.to_axes * turned * s.pose.rotation
        });
        let state = PointMotion { position: turn * r, velocity: turn * v };
        // Vertical motion has no orbital plane: the orbit is a line through the centre.
        let line = Elements {
            semi_latus_rectum: 0.0,
            eccentricity: 1.0,
            inclination: 0.0,
            ascending_node: 0.0,
            pericentre: 0.0,
            anomaly: 0.0,
        };
        let e = Elements::of(mu, &state).unwrap_or(line);
        let (distance, speed) = (r.norm(), v.norm());
        let rise = if distance > 0.0 { r.dot(&v) / distance } else { 0.0 };
        let across = (speed * speed - rise * rise).max(0.0).sqrt();
        let energy = 0.5 * speed * speed - mu / distance.max(NEAREST);
        let apocentre = match e.eccentricity < 1.0 {
            true => e.semi_latus_rectum / (1.0 - e.eccentricity) - radius,
            // This is vertical motion below the escape speed.
            false if energy < 0.0 => -mu / energy - radius,
            false => OPEN,
        };
        OrbitOut {
            height: distance - radius,
            speed,
            path_angle: rise.atan2(across),
            energy,
            eccentricity: e.eccentricity,
            semi_major_axis: (-0.5 * mu / energy).clamp(-OPEN, OPEN),
            inclination: e.inclination,
            ascending_node: e.ascending_node,
            argument_of_pericentre: e.pericentre,
            anomaly: e.anomaly,
            pericentre: e.semi_latus_rectum / (1.0 + e.eccentricity) - radius,
            apocentre,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::PlainWorld;

    const MU: f64 = 3.986_004_418e14;
    const R: f64 = 6_378_137.0;

    fn orbit(site: Option<Site>) -> Orbit {
        let world = match site {
            Some(site) => PlainWorld::of_site(MU, R, site),
            None => PlainWorld::inertial(MU, R, 7.292_115e-5),
        };
        Orbit::build(OrbitParams { radius: None, axes: OrbitAxes::Equator, world: world.handle() })
            .unwrap()
    }

    /// Inclination and node refer to the planet's equator for any direction of its pole in W.
    #[test]
    fn the_equator_is_that_of_the_planet() {
        let lean = Quat::from_euler_angles(0.4, -0.3, 0.9);
        let world = PlainWorld { start: lean, ..PlainWorld::inertial(MU, R, 7e-5) };
        let m = Orbit::build(OrbitParams {
            radius: None,
            axes: OrbitAxes::Equator,
            world: world.handle(),
        })
        .unwrap();
        let s = Elements::with_axis(7e6, 0.1, 0.9, 2.1, 0.7, 0.3).unwrap().state(MU);
        let y = at(&m, 500.0, lean * s.position, lean * s.velocity);
        assert!((y.inclination - 0.9).abs() < 1e-12 && (y.ascending_node - 2.1).abs() < 1e-12);
    }

    /// With `axes: inertial`, the outputs are the elements of a start in inertial axes, both if W is inertial and if W is a site.
    #[test]
    fn inertial_axes_are_those_of_the_world() {
        let s = Elements::with_axis(7e6, 0.1, 0.9, 2.1, 0.7, 0.3).unwrap().state(MU);
        let lean = Quat::from_euler_angles(0.4, -0.3, 0.9);
        let of = |world: PlainWorld| {
            let world = world.handle();
            Orbit::build(OrbitParams { radius: None, axes: OrbitAxes::Inertial, world }).unwrap()
        };
        let free = of(PlainWorld { start: lean, ..PlainWorld::inertial(MU, R, 7e-5) });
        let pose = linkwork_spatial::Pose::new(Quat::from_euler_angles(0.3, -0.8, 1.1), Vec3::x());
        let site = Site { pose, rate: 7e-5, start: lean };
        let t = 500.0;
        let to_W = site.to_inertial(t).inverse();
        let r = to_W * s.position;
        let seen = r - site.relative_to_centre(&Vec3::zeros());
        let on_it = of(PlainWorld::of_site(MU, R, site));
        for y in [
            at(&free, t, s.position, s.velocity),
            at(&on_it, t, seen, to_W * s.velocity - site.omega().cross(&r)),
        ] {
            assert!((y.inclination - 0.9).abs() < 1e-9, "{}", y.inclination);
            assert!((y.ascending_node - 2.1).abs() < 1e-9, "{}", y.ascending_node);
            assert!((y.argument_of_pericentre - 0.7).abs() < 1e-8);
        }
    }

    fn at(m: &Orbit, t: f64, position: Vec3, velocity: Vec3) -> OrbitOut {
        let body = NodeState { position, velocity, ..NodeState::identity() };
        m.feedthrough(&Clock::at(t, 0.1, 0), &OrbitIn { body })
    }

    #[test]
    fn an_orbit_is_found_again_from_any_place_and_from_a_site() {
        let (low, high) = (R + 185e3, R + 820e3);
        let (a, e) = (0.5 * (low + high), (high - low) / (high + low));
        let rate = 7.292_115e-5;
        for anomaly in [0.3, 2.0, 4.4] {
            let of = Elements::with_axis(a, e, 0.9, 2.1, 0.7, anomaly).unwrap();
            let s = of.state(MU);
            let y = at(&orbit(None), 0.0, s.position, s.velocity);
            // This is the state relative to a site 700 s later, after the planet has rotated.
            let pose = linkwork_spatial::Pose::new(
                Quat::from_euler_angles(0.3, -0.8, 1.1),
                Vec3::new(3e6, -4e6, 3.9e6),
            );
            let (site, t) = (Site { pose, rate, start: Quat::identity() }, 700.0);
            let back = Quat::from_scaled_axis(Vec3::z() * (-rate * t));
            let over = s.velocity - (Vec3::z() * rate).cross(&s.position);
            let to_W = pose.rotation.inverse();
            let seen = to_W * (back * s.position - pose.position);
            let z = at(&orbit(Some(site)), t, seen, to_W * (back * over));
            for y in [y, z] {
                assert!((y.pericentre - 185e3).abs() < 1e-5 && (y.apocentre - 820e3).abs() < 1e-5);
                assert!((y.energy + 0.5 * MU / a).abs() < 1e-6, "{}", y.energy);
                assert!((y.eccentricity - e).abs() < 1e-12 && (y.inclination - 0.9).abs() < 1e-12);
                assert!((y.ascending_node - 2.1).abs() < 1e-12, "{}", y.ascending_node);
                assert!((y.semi_major_axis - a).abs() < 1e-6, "{}", y.semi_major_axis);
                let pericentre = y.argument_of_pericentre;
                assert!((pericentre - 0.7).abs() < 1e-10, "{pericentre}");
                assert!((y.anomaly - anomaly).abs() < 1e-10, "{}", y.anomaly);
                assert!((y.height - (s.position.norm() - R)).abs() < 1e-6);
                // The path angle follows from tan γ = e sin ν/(1 + e cos ν).
                let gamma = (e * anomaly.sin()).atan2(1.0 + e * anomaly.cos());
                assert!((y.path_angle - gamma).abs() < 1e-12, "{}", y.path_angle);
            }
        }
    }

    #[test]
    fn open_orbits_and_straight_lines_are_numbers() {
        let away = at(&orbit(None), 0.0, Vec3::x() * 7e6, Vec3::new(1.0, 12e3, 0.0));
        assert!(away.energy > 0.0 && away.eccentricity > 1.0 && away.apocentre == OPEN);
        let up = at(&orbit(None), 0.0, Vec3::z() * 7e6, Vec3::z() * 100.0);
        assert!((up.pericentre + R).abs() < 1e-6 && up.path_angle > 1.57, "{up:?}");
        // The energy gives v²/2 − μ/r = −μ/r_max.
        let highest = 1.0 / (1.0 / 7e6 - 100.0_f64.powi(2) / (2.0 * MU));
        assert!((up.apocentre - (highest - R)).abs() < 1e-6, "{up:?}");
        assert!(at(&orbit(None), 0.0, Vec3::zeros(), Vec3::zeros()).energy.is_finite());
    }
}
