//! `environment.ephemeris_sun`: direction and distance of the Sun from a planet's centre.
//! ```text
//! s = r_Sun − r_planet, ICRF, geometric: SOFA's epv00 (Earth, some km), Keplerian elements of JPL (Mars, 27″), or a kernel
//! ```
//! W is the planet's inertial frame with ICRF axes, or a site on a planet with `turns: iau`. At a site s is rotated by R_WI, so that the Sun rises
//! and sets. The direction is from the planet's centre; the parallax of a point on the ground (at most 9″ on the Earth) is neglected, as are light
//! time and aberration (20″).

use crate::ephemeris::Course;
use crate::world::PlanetWorld;
use linkwork_surroundings::prelude::*;
use linkwork_world::ephemeris::Body;
use linkwork_world::planet::AU;

/// Parameters of the ephemeris Sun.
#[derive(Params, Clone, Debug)]
pub struct EphemerisSunParams {
    /// The world, which defines body, epoch and axes.
    #[param(service)]
    pub world: Handle<dyn World>,
}

/// Position of the Sun relative to the body of the world.
pub struct EphemerisSun {
    course: Course,
    world: PlanetWorld,
}

impl EphemerisSun {
    /// Returns the vector from the centre of the body to the Sun at t (s), m, W.
    fn place(&self, t: f64) -> Vec3 {
        let s = self.course.at(t);
        self.world.planet.site.map_or(s, |site| site.to_inertial(t).inverse() * s)
    }
}

impl Sun for EphemerisSun {
    fn state(&self, t: f64) -> SunState {
        let s = self.place(t);
        let distance = s.norm();
        SunState { direction: s / distance, distance_au: distance / AU }
    }
    fn light(&self, t: f64, p: &Vec3) -> Light {
        self.world.light(t, p, &self.place(t))
    }
    fn failure(&self, t: f64) -> Option<BuildError> {
        self.course.failure(t)
    }
}

/// Position of the Sun from the built-in ephemeris, or from the `kernel` of the world. W has ICRF axes, or is a site on a planet with `turns: iau`. A
/// query costs 30 µs at times beyond the `span` of the world; the run stops at times that the ephemeris does not cover.
#[service("environment.ephemeris_sun", Sun)]
impl Service for EphemerisSun {
    type Params = EphemerisSunParams;
    fn build(p: EphemerisSunParams, _: &Files) -> Result<Self, BuildError> {
        let world = PlanetWorld::of(&p.world)?;
        if let Some(distance) = world.params.sun_distance {
            let fact = format!(
                "`sun_distance` of `world` is {distance} AU, but the ephemeris determines the distance of the Sun"
            );
            return Err(BuildError::new(fact)
                .help("remove `sun_distance`, or use `environment.fixed_sun`")
                .at("world"));
        }
        world.needs_light()?;
        let course = world.heavens("the position of the Sun")?.course(Body::Sun, "world")?;
        Ok(EphemerisSun { course, world })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{Centre, SiteParams, Turning, WorldParams, handle};

    fn sun(world: WorldParams) -> EphemerisSun {
        let p = EphemerisSunParams { world: handle(world) };
        EphemerisSun::build(p, &Files::default()).map_err(|e| e.message).unwrap()
    }

    fn at(body: Centre, date: &str) -> EphemerisSun {
        sun(WorldParams { epoch: Some(date.to_string()), ..WorldParams::of(body) })
    }

    const LANDING: &str = "2021-02-18 20:30:00 UTC";

    fn on_mars(latitude: f64, longitude: f64, epoch: &str) -> WorldParams {
        let site = SiteParams { latitude, longitude, height: -2e3, heading: 0.4, turning: true };
        WorldParams { epoch: Some(epoch.into()), site: Some(site), ..WorldParams::of(Centre::Mars) }
    }

    #[test]
    fn the_sun_is_where_the_calendar_says() {
        // The March equinox of 2020 is on 20 March at 03:50 UTC. The true equinox is 0.28° from the equinox of
        // J2000.
        let s = at(Centre::Earth, "2020-03-20 03:50:00 UTC").state(0.0);
        assert!((s.direction - Vec3::x()).norm() < 0.006 && (s.distance_au - 0.996).abs() < 1e-3);
        // A quarter of a year later, beyond the end of the table, the Sun is 23.4° north.
        let june = 93.0 * 86_400.0;
        let s = at(Centre::Earth, "2020-03-20 03:50:00 UTC").state(june);
        assert!((s.direction.z - 23.43f64.to_radians().sin()).abs() < 1e-3, "{:?}", s.direction);
        let mars = at(Centre::Mars, "2018-09-16 12:00:00 UTC").state(0.0);
        assert!((mars.distance_au - 1.3814).abs() < 1e-3, "perihelion: {}", mars.distance_au);
    }

    /// At a site, the direction agrees with the inertial one and with the independent Mars24 sundial algorithm.
    #[test]
    fn over_a_site_it_rises_and_sets() {
        let (latitude, longitude) = (0.32, 1.35);
        let planet = on_mars(latitude, longitude, LANDING);
        let (inertial, site) =
            (sun(WorldParams { site: None, ..planet.clone() }), sun(planet.clone()));
        let turns = site.world.planet.site.unwrap();
        let days = crate::mars_sun::days_since_j2000("2021-02-18T20:30:00Z").unwrap();
        let (mut highest, mut lowest) = (-1.0_f64, 1.0_f64);
        for k in 0..50 {
            let t = 1800.0 * f64::from(k);
            let s = site.state(t);
            let back = turns.to_inertial(t) * s.direction;
            assert!((back - inertial.state(t).direction).norm() < 1e-13, "{t} s");
            let dial = crate::mars_sun::MarsTime::at(days + t / 86_400.0);
            let dial = dial.sun_direction(latitude.to_degrees(), longitude.to_degrees());
            let dial = Quat::from_scaled_axis(Vec3::z() * -0.4) * dial;
            // The sundial algorithm has an error of 0.2 mrad in the hour angle (3 s). It also includes light time and
            // aberration, 0.1 mrad.
            assert!((s.direction - dial).norm() < 6e-4, "{t} s: {} {dial}", s.direction);
            (highest, lowest) = (highest.max(s.direction.z), lowest.min(s.direction.z));
            // Sunlight is zero below the horizon, hence also radiation pressure and panel power.
            let light = site.light(t, &Vec3::zeros());
            assert!((light.visible > 0.5) == (s.direction.z > 0.0), "{t} s: {light:?}");
        }
        assert!(highest > 0.8 && lowest < -0.8, "it rises and sets: {lowest} {highest}");
        let wrong = |world: WorldParams| {
            let p = EphemerisSunParams { world: handle(world) };
            EphemerisSun::build(p, &Files::default()).err().unwrap()
        };
        let fixed = WorldParams { turns: Some(Turning::Fixed), angle: Some(0.0), ..planet };
        assert!(wrong(fixed).help.unwrap().contains("turns: iau"));
        assert!(wrong(WorldParams::of(Centre::Earth)).message.contains("epoch"));
    }

    /// Near the northern summer solstice (L_s 90°) the Sun culminates 25.19° from the zenith of the equator of Mars, its obliquity.
    #[test]
    fn at_a_solstice_it_culminates_at_the_obliquity() {
        let site = sun(on_mars(0.0, 0.0, "2021-08-25 00:00:00 UTC"));
        let highest = (0..88_800 / 60).map(|k| site.state(60.0 * f64::from(k)).direction.z);
        let zenith = highest.fold(-1.0, f64::max).acos().to_degrees();
        assert!((zenith - 25.19).abs() < 0.01, "{zenith}");
    }
}
