//! Service `world`: body, epoch, rotation and light of a simulation.

use super::body::Centre;
use super::params::{Planet, WorldParams};
use crate::ephemeris::{Course, Heavens};
use crate::light::SunView;
use linkwork_surroundings::Start;
use linkwork_surroundings::prelude::*;
use linkwork_world::planet::Geodetic;
use std::sync::{Arc, OnceLock};

/// The world of a simulation; copies share it.
#[derive(Clone)]
pub struct PlanetWorld(Arc<Inner>);

/// Data of a world.
pub struct Inner {
    /// The parameters in the file.
    pub params: WorldParams,
    /// Shape, rotation, site.
    pub planet: Planet,
    /// Gravity parameter, m³/s².
    mu: Option<f64>,
    /// Positions of the other bodies, if there is an epoch.
    heavens: Option<Heavens>,
    /// Search folders for files that initial states name.
    pub(super) files: Files,
    /// Bodies that cast shadows, with their radii (m); computed at the first query of a Sun.
    shadows: OnceLock<Vec<(Course, f64)>>,
}

impl std::ops::Deref for PlanetWorld {
    type Target = Inner;
    fn deref(&self) -> &Inner {
        &self.0
    }
}

impl PlanetWorld {
    /// Returns the world of this library that a handle refers to.
    ///
    /// # Errors
    /// The world belongs to another library.
    pub fn of(handle: &Handle<dyn World>) -> Result<PlanetWorld, BuildError> {
        handle.as_any().downcast_ref::<PlanetWorld>().cloned().ok_or_else(|| {
            let fact = format!("`{}` is a world of another library", handle.path());
            BuildError::new(fact).help("write `world: (body: ..)` in the simulation")
        })
    }

    /// Returns the world as a service handle for parameters, for programs and tests.
    ///
    /// # Errors
    /// A parameter is invalid; the error contains the remedy.
    pub fn handle(p: WorldParams, files: &Files) -> Result<Handle<dyn World>, BuildError> {
        let world = PlanetWorld::build(p, files)?;
        Ok(Handle::new("world", Arc::new(world) as Arc<dyn World>))
    }
}

/// Distance from the origin of a site, relative to the radius of the planet, within which the horizon of the site's ground plane is used.
const NEAR: f64 = 0.01;

impl Inner {
    /// Returns the ephemeris of the other bodies, which `what` needs.
    pub(crate) fn heavens(&self, what: &str) -> Result<&Heavens, BuildError> {
        self.params.among_the_stars(what)?;
        self.params.epoch(what)?;
        self.heavens.as_ref().ok_or_else(|| {
            let fact = format!(
                "{what} needs the position of the body in the solar system, which is not known"
            );
            BuildError::new(fact).help("write `body: earth`, mars or moon in `world`")
        })
    }

    /// Gravity parameter (m³/s²).
    ///
    /// # Errors
    /// The gravity parameter of the body is unknown.
    pub fn needs_mu(&self) -> Result<f64, BuildError> {
        self.mu.ok_or_else(|| {
            let fact = "the gravity parameter of the body is not known";
            BuildError::new(fact).help("write `mu` in `world`")
        })
    }

    /// Rejects a body for which a model is not valid.
    pub fn only(&self, body: Centre, what: &str) -> Result<(), BuildError> {
        if self.params.body == body {
            return Ok(());
        }
        let fact = format!(
            "{what} of `{}`, and `body` of `world` is `{}`",
            body.word(),
            self.params.body.word()
        );
        Err(BuildError::new(fact).help("use a model of that body, or change `body` in `world`"))
    }

    /// Returns the distance of the Sun in AU for a Sun without an ephemeris.
    pub fn sun_distance(&self) -> Option<f64> {
        self.params.sun_distance.or_else(|| self.params.body.sun_distance())
    }

    /// Makes ready what light needs: the courses of the bodies that cast shadows. A Sun calls this when it is built, so that a world without a Sun
    /// does not need an ephemeris of these bodies.
    ///
    /// # Errors
    /// The position of one of these bodies is unknown, or it cannot cast a shadow.
    pub fn needs_light(&self) -> Result<(), BuildError> {
        if self.shadows.get().is_none() {
            let _ = self.shadows.set(self.made_shadows()?);
        }
        Ok(())
    }

    fn made_shadows(&self) -> Result<Vec<(Course, f64)>, BuildError> {
        let p = &self.params;
        let wrong = |fact: &str, help: &str| Err(BuildError::new(fact).help(help).at("shadows"));
        let Some(heavens) = self.heavens.as_ref().filter(|_| p.body.body().is_some()) else {
            if p.shadows.as_ref().is_some_and(|s| !s.is_empty()) {
                return wrong(
                    "the positions of these bodies are not known",
                    "write `epoch` and `turns: iau`, for the Earth, Mars or the Moon",
                );
            }
            return Ok(Vec::new());
        };
        let own = p.body.body();
        let mut shadows = Vec::new();
        for third in p.shadows.as_deref().unwrap_or_else(|| p.body.neighbours()) {
            let Some(radius) = third.radius() else {
                return wrong("the Sun casts no shadow", "name planets or the Moon");
            };
            if Some(third.body().0) == own {
                let fact = "the central body casts its shadow in any case";
                return wrong(fact, "remove it from `shadows`");
            }
            let course =
                heavens.course(third.body().0, "shadows").map_err(|e| match &p.shadows {
                    Some(_) => e,
                    None => {
                        let body = third.body().0;
                        let fact = format!(
                            "the {body:?} may shadow the Sun, but its position is not known: {}",
                            e.message
                        );
                        let more = "write `shadows: []` in `world` if its shadow does not matter";
                        let help = e.help.map_or(more.to_string(), |h| format!("{h}; or {more}"));
                        BuildError::new(fact).help(help)
                    }
                })?;
            shadows.push((course, radius));
        }
        Ok(shadows)
    }

    /// Returns the bodies that cast shadows; none before [`Inner::needs_light`].
    fn shadows(&self) -> &[(Course, f64)] {
        self.shadows.get().map_or(&[], |all| all)
    }

    /// Returns the sunlight at p (m, W) at t (s), for the position `sun` of the Sun relative to the centre of the body (m, W).
    pub fn light(&self, t: f64, p: &Vec3, sun: &Vec3) -> Light {
        let planet = &self.planet;
        let r = planet.site.map_or(*p, |s| s.relative_to_centre(p));
        let mut seen = SunView::new(&(sun - r), self.params.solar_constant);
        match &planet.site {
            Some(_) if !planet.turning => seen.horizon(),
            // Near the origin of W, the local ground is the horizon, so use a sphere that
            // touches it.
            Some(s) if p.norm() < NEAR * s.pose.position.norm() => {
                let radius = s.pose.position.norm();
                seen.behind(&-(p + Vec3::z() * radius), radius);
            }
            _ => seen.behind(&-r, planet.ellipsoid.equatorial_radius()),
        }
        let shadows = self.shadows();
        if !shadows.is_empty() {
            let turn = planet.site.map(|s| s.to_inertial(t).inverse());
            for (course, radius) in shadows {
                let s = course.at(t);
                seen.behind(&(turn.map_or(s, |turn| turn * s) - r), *radius);
            }
        }
        seen.light()
    }
}

impl World for PlanetWorld {
    fn body(&self) -> &str {
        self.params.body.word()
    }
    fn mu(&self) -> Option<f64> {
        self.mu
    }
    fn radius(&self) -> f64 {
        self.planet.ellipsoid.equatorial_radius()
    }
    fn flattening(&self) -> f64 {
        self.planet.ellipsoid.flattening()
    }
    fn epoch(&self) -> Option<&str> {
        self.planet.epoch.as_deref()
    }
    fn axes(&self) -> Axes {
        self.planet.axes()
    }
    fn planet_axes(&self, t: f64) -> Quat {
        self.planet.axes_at(t)
    }
    fn planet_rate(&self, t: f64) -> Vec3 {
        match self.planet.site {
            Some(_) => Vec3::zeros(),
            None => self.planet.rotation.at(t).omega_I,
        }
    }
    fn geographic(&self, t: f64, p: Vec3) -> Option<Geographic> {
        let place = self.planet.place(t, p).1?;
        let Geodetic { latitude, longitude, altitude } = place;
        Some(Geographic { latitude, longitude, altitude })
    }
    fn start(&self, start: &Start) -> Result<(Vec3, Vec3), BuildError> {
        self.started(start)
    }
    fn failure(&self, t: f64) -> Option<BuildError> {
        let shadows = || self.shadows().iter().find_map(|(course, _)| course.failure(t));
        self.planet.failure(t).or_else(shadows)
    }
    fn as_any(&self) -> &dyn std::any::Any {
        self
    }
}

/// The central body of a simulation with its constants and rotation, the date, and the type of the frame W. Written as `world: (body: ..)` next to
/// `parts`.
#[service("environment.world", World)]
impl Service for PlanetWorld {
    type Params = WorldParams;
    fn build(p: WorldParams, files: &Files) -> Result<Self, BuildError> {
        let planet = p.planet(files)?;
        let seen = p.epoch.is_some() && p.among_the_stars("the Sun").is_ok();
        let heavens = if seen { Some(Heavens::around(&p, files)?) } else { None };
        if p.kernel.is_some() && heavens.is_none() {
            let fact = "`kernel` is written, but it has no effect without an `epoch` and the IAU pole of the body";
            return Err(BuildError::new(fact)
                .help("write `epoch`, or remove `kernel`")
                .at("kernel"));
        }
        let mu = p.mu.or_else(|| p.body.mu());
        let written = p.shadows.as_ref().is_some_and(|s| !s.is_empty());
        let shadows = OnceLock::new();
        let world = PlanetWorld(Arc::new(Inner {
            params: p,
            planet,
            mu,
            heavens,
            files: files.clone(),
            shadows,
        }));
        // Bodies that the file lists are checked here. The default matters only if there is a Sun.
        if written {
            world.needs_light()?;
        }
        Ok(world)
    }
}
