//! Third-body gravity, and the heliocentric orbit of a small body that is not in the ephemerides.
//! ```text
//! third body:  a = −μ₃/|r − s|³ (r + f s)                  Battin: acceleration of the spacecraft minus acceleration of the planet
//!              + R₃ (∇V₃(R₃ᵀ d) + μ₃ d/|d|³),  d = r − s   with its own field, whose axes R₃ rotate according to the IAU model
//! s            relative to the planet, from an ephemeris, rotated by R_WI in a site;
//!              relative to a small body on an `orbit` about the Sun: its position relative to the Sun minus the position of the small body
//! ```

use crate::body_field::BodyField;
use crate::ephemeris::Course;
use crate::third::Third;
use crate::world::{Inner, fault};
use linkwork_spatial::Mat3;
use linkwork_surroundings::prelude::*;
use linkwork_world::ephemeris::{Body, OBLIQUITY_J2000};
use linkwork_world::gravity::{point_mass, point_mass_gradient, third_body, third_body_gradient};
use linkwork_world::orbit::{Elements, propagate};
use linkwork_world::planet::{Epoch, MU_SUN, PointMotion, Rotation};

/// Osculating elliptic orbit of a small body about the Sun, in the mean ecliptic and equinox of J2000, as in JPL's Small-Body Database.
#[derive(Params, Clone, Debug)]
pub struct SolarOrbit {
    /// Semi-major axis, such as 1.126 AU.
    #[param(unit = "m", range = 1e9..)]
    pub semi_major_axis: f64,
    /// Eccentricity.
    #[param(range = 0.0..=0.99)]
    pub eccentricity: f64,
    /// Inclination.
    #[param(unit = "rad")]
    pub inclination: f64,
    /// Longitude of the ascending node.
    #[param(unit = "rad")]
    pub ascending_node: f64,
    /// Argument of the perihelion.
    #[param(unit = "rad")]
    pub perihelion: f64,
    /// Mean anomaly at `epoch`.
    #[param(unit = "rad")]
    pub mean_anomaly: f64,
    /// Date of the elements, such as 2025-11-21 00:00:00 TDB; default: the epoch of the run.
    #[param(default = None)]
    pub epoch: Option<String>,
}

/// Solar orbit, prepared for evaluation.
#[derive(Clone, Debug)]
struct Orbit {
    /// State at the perihelion relative to the Sun, ICRF.
    perihelion: PointMotion,
    /// Time from the perihelion passage to t = 0, s.
    since: f64,
}

impl SolarOrbit {
    /// Prepares the orbit for a run that begins at `start`.
    fn orbit(&self, start: &Epoch) -> Result<Orbit, BuildError> {
        let told = |e| fault(&e, "orbit");
        let a = self.semi_major_axis;
        let angles = (self.inclination, self.ascending_node, self.perihelion);
        let elements = Elements::with_axis(a, self.eccentricity, angles.0, angles.1, angles.2, 0.0)
            .map_err(told)?;
        let there = elements.state(MU_SUN);
        let tilt = Quat::from_scaled_axis(Vec3::x() * OBLIQUITY_J2000);
        let perihelion =
            PointMotion { position: tilt * there.position, velocity: tilt * there.velocity };
        let mut since = self.mean_anomaly / (MU_SUN / (a * a * a)).sqrt();
        if let Some(text) = &self.epoch {
            let (now, then) = (start.tdb_days(), Epoch::parse(text).map_err(told)?.tdb_days());
            since += ((now.0 - then.0) + (now.1 - then.1)) * 86_400.0;
        }
        Ok(Orbit { perihelion, since })
    }
}

impl Orbit {
    /// Returns the position relative to the Sun at t (s), m, ICRF.
    fn at(&self, t: f64) -> Vec3 {
        let now = propagate(MU_SUN, &self.perihelion, self.since + t);
        now.map_or(Vec3::repeat(f64::NAN), |s| s.position)
    }
}

/// Position of a third body relative to the centre of the simulation.
enum Ephemeris {
    /// The centre is a planet.
    Course(Course),
    /// The centre is a small body: trajectory of the third body relative to the Sun (`None` for the Sun itself), and the orbit of the small body.
    Around(Option<Course>, Orbit),
}

/// A third body.
pub(crate) struct Puller {
    /// Gravitational parameter, m³/s².
    pub mu: f64,
    way: Ephemeris,
    /// Gravity field and rotation, if the body is not treated as a point mass.
    pub field: Option<(BodyField, Rotation)>,
}

/// Returns the third bodies as point masses, in the order of the file, relative to a planet or to a small body on its `orbit`.
pub(crate) fn pullers(
    world: &Inner,
    third_bodies: &[Third],
    orbit: Option<&SolarOrbit>,
) -> Result<Vec<Puller>, BuildError> {
    if third_bodies.is_empty() {
        return Ok(Vec::new());
    }
    let heavens = world.heavens("a third body")?;
    let (heavens, own, centre) = match orbit {
        None => (heavens.clone(), None, world.params.body.body()),
        Some(orbit) => {
            let own = orbit.orbit(&heavens.epoch())?;
            (heavens.from(Body::Sun), Some(own), Some(Body::Sun))
        }
    };
    let mut all = Vec::new();
    for (k, third) in third_bodies.iter().enumerate() {
        let (body, mu) = third.body();
        let wrong = if Some(body) == centre && own.is_none() {
            Some("is the planet itself")
        } else if third_bodies[..k].contains(third) {
            Some("is named twice")
        } else {
            None
        };
        if let Some(fact) = wrong {
            return Err(BuildError::new(format!("the third body {body:?} {fact}"))
                .help("name each other body once")
                .at("third_bodies"));
        }
        let course = || heavens.course(body, "third_bodies");
        let way = match &own {
            None => Ephemeris::Course(course()?),
            Some(own) if body == Body::Sun => Ephemeris::Around(None, own.clone()),
            Some(own) => Ephemeris::Around(Some(course()?), own.clone()),
        };
        all.push(Puller { mu, way, field: None });
    }
    Ok(all)
}

/// Returns the rotation from inertial axes to W.
fn to_W(site: Option<&Site>, t: f64) -> Quat {
    site.map_or_else(Quat::identity, |site| site.to_inertial(t).inverse())
}

impl Puller {
    /// Returns the vector from the planet's centre to the body at t (s), m, W; NaN outside the span of the ephemeris.
    pub fn towards(&self, site: Option<&Site>, t: f64) -> Vec3 {
        let s = match &self.way {
            Ephemeris::Course(course) => course.at(t),
            Ephemeris::Around(course, own) => {
                course.as_ref().map_or(Vec3::zeros(), |c| c.at(t)) - own.at(t)
            }
        };
        site.map_or(s, |_| to_W(site, t) * s)
    }

    /// Returns the third-body acceleration (m/s², W) relative to the planet's centre, at `r` (m, W) from it.
    pub fn pull(&self, site: Option<&Site>, t: f64, r: &Vec3) -> Vec3 {
        let s = self.towards(site, t);
        let point = third_body(self.mu, r, &s);
        let Some((field, rotation)) = &self.field else { return point };
        let (d, R) = (r - s, to_W(site, t) * rotation.at(t).R_IP);
        // The planet is far from this body, so its own acceleration is computed with a point mass.
        point + R * field.acceleration(&(R.inverse() * d)) - point_mass(self.mu, &d)
    }

    /// Returns the gradient ∂a/∂p (1/s²) of the third-body acceleration.
    pub fn gradient(&self, site: Option<&Site>, t: f64, r: &Vec3) -> Mat3 {
        let s = self.towards(site, t);
        let point = third_body_gradient(self.mu, r, &s);
        let Some((field, rotation)) = &self.field else { return point };
        let (d, R) = (r - s, to_W(site, t) * rotation.at(t).R_IP);
        let own = field.gradient(&(R.inverse() * d));
        let R = R.to_rotation_matrix().into_inner();
        point + R * own * R.transpose() - point_mass_gradient(self.mu, &d)
    }

    /// Returns the length scale (m) of the body's field at `r` (m, W) from the planet's centre: the distance over which it changes by its own
    /// magnitude.
    pub fn scale(&self, site: Option<&Site>, t: f64, r: &Vec3) -> f64 {
        let degree = self.field.as_ref().map_or(0, |(field, _)| field.degree());
        (self.towards(site, t) - r).norm() / (degree + 2) as f64
    }

    /// Returns an error if the ephemeris does not cover t (s).
    pub fn failure(&self, t: f64) -> Option<BuildError> {
        match &self.way {
            Ephemeris::Course(course) | Ephemeris::Around(Some(course), _) => course.failure(t),
            Ephemeris::Around(None, _) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_world::ephemeris::planet;

    /// An orbit with Standish's elements of Mars at J2000 agrees with the ephemeris of Mars, at J2000 and one and a half years later.
    #[test]
    fn an_orbit_by_its_elements_is_where_the_planet_is() {
        let mars = SolarOrbit {
            semi_major_axis: 1.523_710_34 * linkwork_world::planet::AU,
            eccentricity: 0.093_394_10,
            inclination: 1.849_691_42_f64.to_radians(),
            ascending_node: 49.559_538_91_f64.to_radians(),
            perihelion: (-23.943_629_59_f64 - 49.559_538_91).to_radians(),
            mean_anomaly: (-4.553_432_05_f64 + 23.943_629_59).to_radians(),
            epoch: Some("2000-01-01 12:00:00 TDB".into()),
        };
        let j2000 = Epoch::parse("2000-01-01 12:00:00 TDB").unwrap();
        let wanted = planet(Body::Mars, (0.0, 0.0)).unwrap();
        let orbit = mars.orbit(&j2000).unwrap();
        let off = |p: Vec3| (p - wanted.position).norm() / wanted.position.norm();
        assert!(off(orbit.at(0.0)) < 1e-12, "{}", off(orbit.at(0.0)));
        let speed = (orbit.at(50.0) - orbit.at(-50.0)) / 100.0;
        assert!((speed - wanted.velocity).norm() < 1e-3, "{speed} {}", wanted.velocity);
        let turn = std::f64::consts::TAU * (mars.semi_major_axis.powi(3) / MU_SUN).sqrt();
        assert!(off(orbit.at(turn)) < 1e-9);
        // The elements keep their own epoch: a run that begins 100 days later has the position of day 100.
        let later = mars.orbit(&Epoch::parse("2000-04-10 12:00:00 TDB").unwrap()).unwrap();
        let there = orbit.at(100.0 * 86_400.0);
        assert!((later.at(0.0) - there).norm() < 1.0, "{}", (later.at(0.0) - there).norm());
        let e = SolarOrbit { epoch: Some("soon".into()), ..mars }.orbit(&j2000).err().unwrap();
        assert!(
            e.message.contains("`soon` is not an epoch") && e.param.as_deref() == Some("orbit")
        );
    }
}
