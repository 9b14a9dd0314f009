//! `environment.ephemeris_sun`: the Sun as seen from a planet's centre.
//! ```text
//! s = r_Sun − r_planet, ICRF, geometric: SOFA's epv00 (Earth, some km), Keplerian elements of JPL (Mars, 27″)
//! ```
//! W is the planet's inertial frame with axes of the ICRF. Light time and aberration (20″) are left out.

use crate::planet::{PlanetParams, fault};
use linkwork_runtime::prelude::*;
use linkwork_world::ephemeris::{Analytic, Body, Ephemeris, Sampled};
use linkwork_world::planet::AU;

/// The planet and the date.
#[derive(Params, Clone, Debug)]
pub struct EphemerisSunParams {
    /// The planet at the origin of W, and the epoch.
    pub planet: PlanetParams,
}

/// The Sun from a planet.
pub struct EphemerisSun {
    centre: Body,
    start: (f64, f64),
    table: Sampled,
}

impl Sun for EphemerisSun {
    fn state(&self, t: f64) -> SunState {
        let now = (self.start.0, self.start.1 + t / 86_400.0);
        let state = self.table.at(t).or_else(|_| Analytic.state(Body::Sun, self.centre, now));
        let s = state.map_or(Vec3::repeat(f64::NAN), |s| s.position);
        SunState { direction: s.normalize(), distance_au: s.norm() / AU }
    }
    fn axes(&self) -> Axes {
        Axes::Inertial
    }
}

/// The Sun from the centre of a planet by ephemeris; W has the axes of the ICRF. Times beyond the planet's `span` cost 30 µs.
#[service("environment.ephemeris_sun", Sun)]
impl Service for EphemerisSun {
    type Params = EphemerisSunParams;
    fn build(p: EphemerisSunParams, _: &Files) -> Result<Self, BuildError> {
        p.planet.among_the_stars("the Sun's place")?;
        let epoch = p.planet.epoch("the Sun's place")?;
        let centre = p.planet.body.body();
        let table = Sampled::new(&Analytic, Body::Sun, centre, &epoch, p.planet.span)
            .map_err(|e| fault(&e, "planet"))?;
        p.planet.planet()?;
        Ok(EphemerisSun { centre, start: epoch.tdb_days(), table })
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
        let none = EphemerisSunParams { planet: PlanetParams::of(Centre::Earth) };
        assert!(
            EphemerisSun::build(none, &Files::default()).err().unwrap().message.contains("epoch")
        );
    }
}
