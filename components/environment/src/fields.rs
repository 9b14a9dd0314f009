//! Services of gravity, air and sun: `environment.uniform_gravity`, `environment.point_mass_gravity`,
//! `environment.exponential_atmosphere`, `environment.mars_sun`, `environment.fixed_sun`.

use crate::air::{Exponential, point_mass};
use crate::gravity::{around, from_centre, gradient_around};
use crate::mars_sun::{MarsTime, days_since_j2000};
use crate::planet::{Planet, PlanetParams};
use crate::planet_air::SutherlandParams;
use linkwork_runtime::prelude::*;
use linkwork_spatial::Mat3;
use linkwork_world::atmosphere::Sutherland;
use linkwork_world::gravity::point_mass_gradient;

/// One acceleration everywhere.
#[derive(Params, Clone, Debug)]
pub struct UniformGravityParams {
    /// Acceleration in W; unwritten: Mars, 3.72076 m/s² down.
    #[param(unit = "m/s^2", default = Vec3::new(0.0, 0.0, -3.72076))]
    pub acceleration: Vec3,
}

/// Uniform gravity.
pub struct UniformGravity(Vec3);

impl Gravity for UniformGravity {
    fn acceleration(&self, _: f64, _: Vec3) -> Vec3 {
        self.0
    }
    fn uniform(&self) -> Option<Vec3> {
        Some(self.0)
    }
    fn gradient(&self, _: f64, _: Vec3) -> Option<Mat3> {
        Some(Mat3::zeros())
    }
}

/// The same gravity everywhere; right for a site of some kilometres.
#[service("environment.uniform_gravity", Gravity)]
impl Service for UniformGravity {
    type Params = UniformGravityParams;
    fn build(p: UniformGravityParams, _: &Files) -> Result<Self, BuildError> {
        Ok(UniformGravity(p.acceleration))
    }
}

/// A round planet at the origin of W.
#[derive(Params, Clone, Debug)]
pub struct PointMassGravityParams {
    /// Gravitational parameter; unwritten: Mars.
    #[param(unit = "m^3/s^2", default = 4.282_837_521_4e13, range = 0.0..)]
    pub mu: f64,
    /// The planet; unwritten, or without a site: it is at the origin of W. How it turns is told to what asks for its axes (a magnetic
    /// field).
    pub planet: Option<PlanetParams>,
}

/// Gravity of a point mass.
pub struct PointMassGravity {
    mu: f64,
    /// Where it is written.
    planet: Option<Planet>,
}

impl PointMassGravity {
    fn site_of(&self) -> Option<&Site> {
        self.planet.as_ref()?.site.as_ref()
    }
}

impl Gravity for PointMassGravity {
    fn acceleration(&self, _: f64, p: Vec3) -> Vec3 {
        around(self.site_of(), p, |p| point_mass(self.mu, *p))
    }
    fn gradient(&self, _: f64, p: Vec3) -> Option<Mat3> {
        let own = |p: &Vec3| point_mass_gradient(self.mu, p);
        Some(gradient_around(self.site_of(), p, own))
    }
    fn scale(&self, _: f64, p: Vec3) -> f64 {
        0.5 * from_centre(self.site_of(), p)
    }
    fn planet_axes(&self, t: f64) -> Option<Quat> {
        self.planet.as_ref().map(|planet| planet.axes_at(t))
    }
    fn epoch(&self) -> Option<&str> {
        self.planet.as_ref()?.epoch.as_deref()
    }
    fn axes(&self) -> Axes {
        Axes::of(self.site_of().copied())
    }
}

/// Inverse-square gravity of a planet at the origin of W, or around the site that W is.
#[service("environment.point_mass_gravity", Gravity)]
impl Service for PointMassGravity {
    type Params = PointMassGravityParams;
    fn build(p: PointMassGravityParams, files: &Files) -> Result<Self, BuildError> {
        let planet = p.planet.as_ref().map(|planet| planet.about_z(files)).transpose()?;
        Ok(PointMassGravity { mu: p.mu, planet })
    }
}

/// An isothermal atmosphere; unwritten values are those of Mars.
#[derive(Params, Clone, Debug)]
pub struct AtmosphereParams {
    /// Radius of the planet around the origin of W; 0: a flat site whose height is z.
    #[param(unit = "m", default = 3_396_190.0, range = 0.0..)]
    pub planet_radius: f64,
    /// Density at height 0.
    #[param(unit = "kg/m^3", default = 0.020, range = 0.0..)]
    pub density: f64,
    /// Scale height.
    #[param(unit = "m", default = 11_100.0, range = 1.0..)]
    pub scale_height: f64,
    /// Temperature.
    #[param(unit = "K", default = 210.0, range = 1.0..)]
    pub temperature: f64,
    /// Specific gas constant.
    #[param(unit = "J/(kg K)", default = 191.8, range = 1.0..)]
    pub gas_constant: f64,
    /// Ratio of specific heats.
    #[param(default = 1.33, range = 1.0..)]
    pub heat_ratio: f64,
    /// Viscosity of the gas, for Reynolds numbers; unwritten: not known.
    pub viscosity: Option<SutherlandParams>,
    /// Rotation of the planet, W: the air turns with it.
    #[param(unit = "rad/s", default = Vec3::zeros())]
    pub rotation: Vec3,
    /// Steady wind, W.
    #[param(unit = "m/s", default = Vec3::zeros())]
    pub wind: Vec3,
}

/// Exponential atmosphere.
pub struct ExponentialAtmosphere {
    air: Exponential,
    viscosity: Option<Sutherland>,
}

impl Atmosphere for ExponentialAtmosphere {
    fn air(&self, _: f64, p: Vec3) -> Air {
        let a = self.air.at(p);
        Air {
            density: a.density,
            pressure: a.pressure,
            temperature: a.temperature,
            speed_of_sound: a.speed_of_sound,
            wind: a.wind,
        }
    }
    fn viscosity(&self, temperature: f64) -> Option<f64> {
        self.viscosity.map(|law| law.at(temperature))
    }
    fn altitude(&self, _: f64, p: Vec3) -> Option<f64> {
        Some(self.air.height(p))
    }
    fn axes(&self) -> Axes {
        if self.air.planet_radius > 0.0 { Axes::Inertial } else { Axes::Any }
    }
}

/// Density that falls exponentially with height, one temperature, air that turns with the planet.
#[service("environment.exponential_atmosphere", Atmosphere)]
impl Service for ExponentialAtmosphere {
    type Params = AtmosphereParams;
    fn build(p: AtmosphereParams, _: &Files) -> Result<Self, BuildError> {
        let viscosity = p.viscosity.as_ref().map(SutherlandParams::law);
        let air = Exponential {
            planet_radius: p.planet_radius,
            density: p.density,
            scale_height: p.scale_height,
            temperature: p.temperature,
            gas_constant: p.gas_constant,
            heat_ratio: p.heat_ratio,
            rotation: p.rotation,
            wind: p.wind,
        };
        Ok(ExponentialAtmosphere { air, viscosity })
    }
}

/// A site on Mars and the time at which the simulation starts.
#[derive(Params, Clone, Debug)]
pub struct MarsSunParams {
    /// UTC at simulated time 0, such as 2012-08-06T05:17:57Z.
    pub epoch: String,
    /// Planetocentric latitude of the site.
    #[param(unit = "rad", default = 0.0, range = -1.571..=1.571)]
    pub latitude: f64,
    /// East longitude of the site.
    #[param(unit = "rad", default = 0.0)]
    pub longitude: f64,
    /// Angle of x of W from east towards north, as of a site: y is north for 0.
    #[param(unit = "rad", default = 0.0)]
    pub heading: f64,
}

/// The sun over a site on Mars.
pub struct MarsSun {
    start_days: f64,
    latitude_deg: f64,
    longitude_deg: f64,
    /// East, north, up to W.
    turn: Option<Quat>,
}

impl Sun for MarsSun {
    fn state(&self, t: f64) -> SunState {
        let mars = MarsTime::at(self.start_days + t / 86_400.0);
        let seen = mars.sun_direction(self.latitude_deg, self.longitude_deg);
        let direction = self.turn.map_or(seen, |turn| turn * seen);
        SunState { direction, distance_au: mars.distance_au }
    }
}

/// The sun over a site on Mars by the Mars24 algorithm; W is the site's frame: x east, y north, z up, or turned by `heading`.
#[service("environment.mars_sun", Sun)]
impl Service for MarsSun {
    type Params = MarsSunParams;
    fn build(p: MarsSunParams, _: &Files) -> Result<Self, BuildError> {
        let start_days =
            days_since_j2000(&p.epoch).map_err(|e| BuildError::new(e.to_string()).at("epoch"))?;
        Ok(MarsSun {
            start_days,
            latitude_deg: p.latitude.to_degrees(),
            longitude_deg: p.longitude.to_degrees(),
            turn: (p.heading != 0.0).then(|| Quat::from_scaled_axis(Vec3::z() * -p.heading)),
        })
    }
}

/// A sun that stands still in W, or among the stars.
#[derive(Params, Clone, Debug)]
pub struct FixedSunParams {
    /// Azimuth from north (y) towards east (x).
    #[param(unit = "rad", default = 0.0)]
    pub azimuth: f64,
    /// Elevation above the horizon.
    #[param(unit = "rad", default = 0.8, range = -1.571..=1.571)]
    pub elevation: f64,
    /// Distance, AU.
    #[param(default = 1.524, range = 0.01..)]
    pub distance_au: f64,
    /// The planet, where W is a site on it: the sun stands still among the stars, and azimuth and elevation are those
    /// at t = 0. Unwritten, or without a site: it stands still in W.
    pub planet: Option<PlanetParams>,
}

/// A fixed sun.
pub struct FixedSun {
    /// At t = 0.
    start: SunState,
    site: Option<Site>,
}

impl Sun for FixedSun {
    fn state(&self, t: f64) -> SunState {
        let Some(site) = &self.site else { return self.start };
        let turned = site.to_inertial(t).inverse() * site.to_inertial(0.0);
        SunState { direction: turned * self.start.direction, ..self.start }
    }
    fn axes(&self) -> Axes {
        self.site.map_or(Axes::Any, Axes::Site)
    }
}

/// A sun at a fixed azimuth and elevation, or from a site that turns at a fixed place among the stars.
#[service("environment.fixed_sun", Sun)]
impl Service for FixedSun {
    type Params = FixedSunParams;
    fn build(p: FixedSunParams, files: &Files) -> Result<Self, BuildError> {
        let (sin_a, cos_a) = p.azimuth.sin_cos();
        let (sin_e, cos_e) = p.elevation.sin_cos();
        let direction = Vec3::new(sin_a * cos_e, cos_a * cos_e, sin_e);
        let site = p.planet.map_or(Ok(None), |planet| planet.planet(files).map(|p| p.site))?;
        Ok(FixedSun { start: SunState { direction, distance_au: p.distance_au }, site })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_of_a_sol_moves_a_turn_in_88775_seconds() {
        let p = MarsSunParams {
            epoch: "2012-08-06T05:17:57Z".into(),
            latitude: -4.59f64.to_radians(),
            longitude: 137.44f64.to_radians(),
            heading: 0.0,
        };
        let sun = MarsSun::build(p.clone(), &Files::default()).unwrap();
        let (a, b) = (sun.state(0.0), sun.state(88_775.244));
        assert!((a.direction - b.direction).norm() < 0.02);
        assert!((a.direction + sun.state(44_387.6).direction).norm() < 1.0);
        let e = MarsSun::build(MarsSunParams { epoch: "noon".into(), ..p }, &Files::default());
        assert_eq!(e.err().unwrap().param.as_deref(), Some("epoch"));
    }

    #[test]
    fn a_fixed_sun_in_the_east_is_along_x() {
        let p = FixedSunParams {
            azimuth: std::f64::consts::FRAC_PI_2,
            elevation: 0.0,
            distance_au: 1.0,
            planet: None,
        };
        let s = FixedSun::build(p, &Files::default()).unwrap().state(9.0);
        assert!((s.direction - Vec3::x()).norm() < 1e-12);
    }

    #[test]
    fn a_sun_among_the_stars_goes_over_a_site_that_turns() {
        let here =
            crate::planet::SiteParams { latitude: 0.0, longitude: 0.3, height: 0.0, heading: 0.0 };
        let planet = PlanetParams {
            rate: Some(1e-3),
            site: Some(here),
            ..PlanetParams::of(crate::planet::Centre::Moon)
        };
        let at = |planet: Option<PlanetParams>, t: f64| {
            let p = FixedSunParams {
                azimuth: std::f64::consts::FRAC_PI_2,
                elevation: 0.2,
                distance_au: 1.0,
                planet,
            };
            FixedSun::build(p, &Files::default()).unwrap().state(t).direction
        };
        // On the equator: up in the east by a radian in 1000 s, over the zenith and down.
        for t in [0.0, 1000.0, 2500.0] {
            let height: f64 = 0.2 + 1e-3 * t;
            let want = Vec3::new(height.cos(), 0.0, height.sin());
            assert!((at(Some(planet.clone()), t) - want).norm() < 1e-12, "{t} s");
        }
        assert_eq!(at(None, 2500.0), at(None, 0.0));
        let inertial = PlanetParams { site: None, ..planet };
        assert_eq!(at(Some(inertial), 2500.0), at(None, 0.0));
    }

    #[test]
    fn mars_has_its_sun_by_the_heading_of_w() {
        let at = |heading: f64| {
            let epoch = "2012-08-06T05:17:57Z".into();
            let p = MarsSunParams { epoch, latitude: -0.08, longitude: 2.4, heading };
            MarsSun::build(p, &Files::default()).unwrap().state(700.0).direction
        };
        let (plain, turned) = (at(0.0), at(0.4));
        // x of W lies between east and north.
        let x = plain.x * 0.4f64.cos() + plain.y * 0.4f64.sin();
        assert!((turned.x - x).abs() < 1e-15 && (turned.z - plain.z).abs() < 1e-15);
    }

    #[test]
    fn only_uniform_gravity_says_that_it_is_uniform() {
        let p = UniformGravityParams { acceleration: Vec3::new(0.0, 0.0, -1.62) };
        let g = UniformGravity::build(p, &Files::default()).unwrap();
        assert_eq!(g.uniform(), Some(Vec3::new(0.0, 0.0, -1.62)));
        assert!(PointMassGravity { mu: 1.0, planet: None }.uniform().is_none());
    }
}
