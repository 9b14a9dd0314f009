//! `environment.ephemeris_sun`: the Sun as seen from a planet's centre.
//! ```text
//! s = r_Sun − r_planet, ICRF, geometric: SOFA's epv00 (Earth, some km), Keplerian elements of JPL (Mars, 27″), or a kernel
//! ```
//! W is the planet's inertial frame with axes of the ICRF, or a site of a planet that turns by the IAU: then s is turned by R_WI, so that
//! the Sun rises and sets. It is where it is from the planet's centre (from the ground 9″ aside at the most, by the Earth). Light time and aberration (20″) are left out.

use crate::ephemeris::{Course, Heavens};
use crate::planet::PlanetParams;
use linkwork_runtime::prelude::*;
use linkwork_world::ephemeris::Body;
use linkwork_world::planet::AU;

/// The planet and the date.
#[derive(Params, Clone, Debug)]
pub struct EphemerisSunParams {
    /// The planet at the origin of W or under the site that W is, and the epoch.
    pub planet: PlanetParams,
}

/// The Sun from a planet.
pub struct EphemerisSun {
    course: Course,
    site: Option<Site>,
}

impl Sun for EphemerisSun {
    fn state(&self, t: f64) -> SunState {
        let s = self.course.at(t);
        let s = self.site.map_or(s, |site| site.to_inertial(t).inverse() * s);
        SunState { direction: s.normalize(), distance_au: s.norm() / AU }
    }
    fn trouble(&self, t: f64) -> Option<BuildError> {
        self.course.trouble(t)
    }
    fn axes(&self) -> Axes {
        Axes::of(self.site)
    }
}

/// The Sun from the centre of a planet by ephemeris, or by the `kernel` of the planet; W has the axes of the ICRF, or is a site of a planet that turns by the IAU. Times beyond the planet's `span` cost 30 µs; beyond the ephemeris the run stops.
#[service("environment.ephemeris_sun", Sun)]
impl Service for EphemerisSun {
    type Params = EphemerisSunParams;
    fn build(p: EphemerisSunParams, files: &Files) -> Result<Self, BuildError> {
        let heavens = Heavens::around(&p.planet, files, "the Sun's place")?;
        let course = heavens.course(Body::Sun, "planet")?;
        Ok(EphemerisSun { course, site: p.planet.planet(files)?.site })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planet::Centre;

    #[test]
    fn the_sun_is_where_the_calendar_says() {
        let at = |body, date: &str| {
            let epoch = Some(date.to_string());
            let planet = PlanetParams { epoch, ..PlanetParams::of(body) };
            EphemerisSun::build(EphemerisSunParams { planet }, &Files::default()).unwrap()
        };
        // The March equinox of 2020: 20 March, 03:50 UTC; the true equinox is 0.28° from that of J2000.
        let s = at(Centre::Earth, "2020-03-20 03:50:00 UTC").state(0.0);
        assert!((s.direction - Vec3::x()).norm() < 0.006 && (s.distance_au - 0.996).abs() < 1e-3);
        // A quarter of a year later it stands 23.4° north, beyond the table as within it.
        let june = 93.0 * 86_400.0;
        let s = at(Centre::Earth, "2020-03-20 03:50:00 UTC").state(june);
        assert!((s.direction.z - 23.43f64.to_radians().sin()).abs() < 1e-3, "{:?}", s.direction);
        let mars = at(Centre::Mars, "2018-09-16 12:00:00 UTC").state(0.0);
        assert!((mars.distance_au - 1.3814).abs() < 1e-3, "perihelion: {}", mars.distance_au);
        // Over sites: as in inertial axes, and as by the algorithm for Mars's sundials, which is another one.
        let (latitude, longitude) = (0.32, 1.35);
        let here = crate::planet::SiteParams { latitude, longitude, height: -2e3, heading: 0.4 };
        let start = "2021-02-18 20:30:00 UTC";
        let planet = PlanetParams {
            turns: crate::planet::Turning::Iau,
            epoch: Some(start.into()),
            flattening: Some(0.0),
            site: Some(here),
            ..PlanetParams::of(Centre::Mars)
        };
        let sun = |planet: PlanetParams| {
            EphemerisSun::build(EphemerisSunParams { planet }, &Files::default()).unwrap()
        };
        let (inertial, site) =
            (sun(PlanetParams { site: None, ..planet.clone() }), sun(planet.clone()));
        let Axes::Site(turns) = site.axes() else { panic!("no site") };
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
            // It has 0.2 mrad of the hour angle (3 s) and light time and aberration, 0.1 mrad.
            assert!((s.direction - dial).norm() < 6e-4, "{t} s: {} {dial}", s.direction);
            (highest, lowest) = (highest.max(s.direction.z), lowest.min(s.direction.z));
        }
        assert!(highest > 0.8 && lowest < -0.8, "it rises and sets: {lowest} {highest}");
        let fixed = PlanetParams { turns: crate::planet::Turning::Fixed, ..planet };
        let e = EphemerisSun::build(EphemerisSunParams { planet: fixed }, &Files::default());
        assert!(e.err().unwrap().help.unwrap().contains("turns: iau"));
        let none = EphemerisSunParams { planet: PlanetParams::of(Centre::Earth) };
        assert!(
            EphemerisSun::build(none, &Files::default()).err().unwrap().message.contains("epoch")
        );
    }
}
