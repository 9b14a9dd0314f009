//! `sensors.solar_clock`: elevation and azimuth of the Sun at a site, and local true solar time.
//! ```text
//! sin e = s_z                          A = atan2(s_x, s_y), from north over east           s: direction to the Sun, W
//! H = atan2(−s_x, cos φ s_z − sin φ s_y)             hour angle at the latitude φ: 0 at noon, rising
//! local time = 12 h + H · 24 h/2π
//! ```
//! s has the axes x east, y north, z up of the site, independent of the heading of W. An hour of local time is a twenty-fourth of a solar day: 3699 s
//! on Mars. The output is a true value without noise, for plans and plots. At a pole, or with a fixed Sun, local time has no meaning; the formula is
//! still evaluated.

use linkwork_surroundings::prelude::*;
use std::f64::consts::{PI, TAU};

/// Site and Sun.
#[derive(Params, Clone, Debug)]
pub struct SolarClockParams {
    /// The sun.
    #[param(service)]
    pub sun: Handle<dyn Sun>,
    /// The world, whose site it is.
    #[param(service)]
    pub world: Handle<dyn World>,
}

/// Position of the Sun at the site.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SolarClockOut {
    /// Elevation of the Sun above the horizontal.
    #[port("rad")]
    pub elevation: f64,
    /// Azimuth of the Sun, from north towards east, −π to π.
    #[port("rad")]
    pub azimuth: f64,
    /// Local true solar time since midnight, 0 to 86400 s: each hour, a twenty-fourth of a solar day, counts as 3600 s.
    #[port("s")]
    pub local_time: f64,
    /// The Sun is above the horizontal.
    #[port("1")]
    pub day: bool,
}

/// A solar clock.
pub struct SolarClock {
    sun: Handle<dyn Sun>,
    latitude: f64,
    /// East and north, W.
    east: Vec3,
    north: Vec3,
}

/// Elevation and azimuth of the Sun at a site, and local true solar time.
#[model("sensors.solar_clock")]
impl Model for SolarClock {
    type Params = SolarClockParams;
    type Outputs = SolarClockOut;
    fn build(p: SolarClockParams) -> Result<Self, BuildError> {
        let help = "write a `site` in `world`, or remove this part";
        let Some(site) = p.world.axes().place() else {
            let fact = "W is inertial: there is no horizon and no local time";
            return Err(BuildError::new(fact).help(help));
        };
        let Some(here) = p.world.geographic(0.0, Vec3::zeros()) else {
            return Err(BuildError::new("the site is at the centre of the body").help(help));
        };
        let latitude = here.latitude;
        let east = site.east();
        let north = Vec3::z().cross(&east);
        Ok(SolarClock { sun: p.sun, latitude, east, north })
    }
    fn outputs(&self, clock: &Clock) -> SolarClockOut {
        let s = self.sun.state(clock.t).direction;
        let s = Vec3::new(s.dot(&self.east), s.dot(&self.north), s.z);
        let (sin, cos) = self.latitude.sin_cos();
        let hour = (-s.x).atan2(cos * s.z - sin * s.y);
        SolarClockOut {
            elevation: s.z.clamp(-1.0, 1.0).asin(),
            azimuth: s.x.atan2(s.y),
            local_time: (hour + PI).rem_euclid(TAU) / TAU * 86_400.0,
            day: s.z > 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    /// A Sun at a declination and hour angle (rad), seen from a latitude.
    struct At(f64, f64, f64);
    impl Sun for At {
        fn state(&self, _: f64) -> SunState {
            let At(dec, hour, lat) = *self;
            // The direction is rotated to the meridian by Rz, then tilted by the latitude.
            let (sd, cd) = dec.sin_cos();
            let (sh, ch) = hour.sin_cos();
            let (sl, cl) = lat.sin_cos();
            let direction = Vec3::new(-cd * sh, sd * cl - cd * ch * sl, sd * sl + cd * ch * cl);
            SunState { direction, distance_au: 1.5 }
        }
    }

    /// A world with W at a latitude, x turned by `heading` from east towards north.
    fn at(lat: f64, heading: f64) -> Handle<dyn World> {
        let (east, up) = (Vec3::y(), Vec3::new(lat.cos(), 0.0, lat.sin()));
        let north = up.cross(&east);
        let x = east * heading.cos() + north * heading.sin();
        let axes = linkwork_spatial::Mat3::from_columns(&[x, up.cross(&x), up]);
        let pose = linkwork_spatial::Pose::new(linkwork_spatial::quat(&axes), up * 6.4e6);
        let site = Site { pose, rate: 7e-5, start: Quat::identity() };
        linkwork_surroundings::PlainWorld::of_site(4e14, 6.4e6, site).handle()
    }

    fn clock(sun: impl Sun + 'static, latitude: f64) -> Result<SolarClock, BuildError> {
        let sun = Handle::new("sun", Arc::new(sun) as Arc<dyn Sun>);
        SolarClock::build(SolarClockParams { sun, world: at(latitude, 0.0) })
    }

    fn read(dec: f64, hours: f64, lat: f64) -> SolarClockOut {
        let hour = (hours - 12.0) / 24.0 * TAU;
        clock(At(dec, hour, lat), lat).unwrap().outputs(&Clock::at(0.0, 1.0, 0))
    }

    #[test]
    fn it_gives_back_the_hour_at_any_latitude_and_season() {
        for lat in [-1.2, -0.3, 0.0, 0.08, 0.9] {
            for dec in [-0.43, -0.1, 0.2, 0.44] {
                for hours in [0.5, 3.0, 6.0, 9.7, 12.0, 17.3, 23.9] {
                    let y = read(dec, hours, lat);
                    assert!(
                        (y.local_time / 3600.0 - hours).abs() < 1e-9,
                        "{lat} {dec} {hours}: {y:?}"
                    );
                    assert_eq!(y.day, y.elevation > 0.0);
                }
            }
        }
    }

    #[test]
    fn noon_is_due_north_or_south_at_the_elevation_of_the_textbook() {
        let y = read(0.3, 12.0, -0.2);
        assert!(y.azimuth.abs() < 1e-12 && (y.elevation - (PI / 2.0 - 0.5)).abs() < 1e-9, "{y:?}");
        let y = read(-0.1, 12.0, 0.6);
        assert!(
            (y.azimuth.abs() - PI).abs() < 1e-12 && (y.elevation - (PI / 2.0 - 0.7)).abs() < 1e-9
        );
        // The Sun is in the east in the morning, and at an equinox it rises at six.
        let y = read(0.0, 6.0, 0.7);
        assert!(y.elevation.abs() < 1e-12 && (y.azimuth - PI / 2.0).abs() < 1e-12, "{y:?}");
    }

    #[test]
    fn the_site_of_the_world_counts_and_inertial_axes_are_refused() {
        use linkwork_surroundings::PlainWorld;
        let sun = || Handle::new("sun", Arc::new(At(0.2, 0.5, 0.4)) as Arc<dyn Sun>);
        let (lat, heading) = (0.4_f64, 0.7_f64);
        let p = SolarClockParams { sun: sun(), world: at(lat, heading) };
        let m = SolarClock::build(p.clone()).map_err(|e| e.message).unwrap();
        assert!((m.latitude - lat).abs() < 1e-12);
        let turn = Quat::from_scaled_axis(Vec3::z() * -heading);
        assert!((turn * Vec3::x() - m.east).norm() < 1e-12, "{}", m.east);
        let world = PlainWorld::inertial(4e14, 6.4e6, 7e-5).handle();
        let e = SolarClock::build(SolarClockParams { world, ..p }).err().unwrap();
        assert!(e.message.contains("inertial") && e.help.is_some());
    }
}
