//! Services for gravity, atmosphere and Sun: `environment.uniform_gravity`, `environment.point_mass_gravity`, `environment.exponential_atmosphere`,
//! `environment.fixed_sun`.

use crate::air::{Exponential, point_mass};
use crate::gravity::relative_to_centre;
use crate::light::SunView;
use crate::planet_air::SutherlandParams;
use crate::world::PlanetWorld;
use crate::world::{around, gradient_around};
use linkwork_spatial::Mat3;
use linkwork_surroundings::SOLAR_CONSTANT;
use linkwork_surroundings::prelude::*;
use linkwork_world::atmosphere::Sutherland;
use linkwork_world::gravity::point_mass_gradient;
use linkwork_world::planet::AU;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Parameters of uniform gravity.
#[derive(Params, Clone, Debug)]
pub struct UniformGravityParams {
    /// Acceleration in W. Default on level ground of a world (`turning: false`): computed from mass and rotation of the body at the origin, along −z.
    /// There, a written value that differs from it by more than 1.5 % is an error.
    #[param(unit = "m/s^2")]
    pub acceleration: Option<Vec3>,
    /// The world, if the simulation has one.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
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

/// Greatest relative difference between a written acceleration and the acceleration of the world's body.
const SAME_BODY: f64 = 0.015;

/// Returns the magnitude (m/s²) of gravity at the origin of level ground, including the centrifugal part.
fn at_the_origin(world: &PlanetWorld) -> Result<f64, BuildError> {
    let mu = world.needs_mu()?;
    let at = world.planet.site.map_or(Vec3::zeros(), |site| {
        let r = site.relative_to_centre(&Vec3::zeros());
        r * (-mu / r.norm().powi(3)) + site.centrifugal(&Vec3::zeros())
    });
    Ok(at.norm())
}

/// Uniform gravity, for level ground of some kilometres.
#[service("environment.uniform_gravity", Gravity)]
impl Service for UniformGravity {
    type Params = UniformGravityParams;
    fn build(p: UniformGravityParams, _: &Files) -> Result<Self, BuildError> {
        let world = p.world.as_ref().map(PlanetWorld::of).transpose()?;
        match (world, p.acceleration) {
            (Some(world), _) if world.planet.site.is_none() => {
                let fact = "uniform gravity is for level ground, but `world` places the origin of W at the centre of a body";
                let help = "use `environment.point_mass_gravity`, or write `site: (.., turning: false)` in `world`";
                Err(BuildError::new(fact).help(help))
            }
            (Some(world), Some(acceleration)) if world.mu().is_some() => {
                // The tolerance covers J₂, which a point mass neglects: 0.3 % at the poles of the
                // Earth and of Mars.
                let g = at_the_origin(&world)?;
                if (acceleration.norm() / g - 1.0).abs() <= SAME_BODY {
                    return Ok(UniformGravity(acceleration));
                }
                let fact = format!(
                    "`acceleration` is {} m/s², but at the site of `world` (`body: {}`) gravity is {g:.4} m/s²",
                    acceleration.norm(),
                    world.params.body.word()
                );
                let help = "remove `acceleration`, or write the `body` or `mu` that it belongs to";
                Err(BuildError::new(fact).help(help).at("acceleration"))
            }
            (_, Some(acceleration)) => Ok(UniformGravity(acceleration)),
            (Some(world), None) => Ok(UniformGravity(-Vec3::z() * at_the_origin(&world)?)),
            (None, None) => {
                let fact = "the acceleration of gravity is not written";
                let help = "write acceleration: [0, 0, -9.80665], or state the place: world: (body: \"mars\", site: (latitude: .., longitude: .., turning: false))";
                Err(BuildError::new(fact).help(help).at("acceleration"))
            }
        }
    }
}

/// Parameters of point-mass gravity.
#[derive(Params, Clone, Debug)]
pub struct PointMassGravityParams {
    /// The world, whose body attracts.
    #[param(service)]
    pub world: Handle<dyn World>,
}

/// Gravity of a point mass.
pub struct PointMassGravity {
    mu: f64,
    world: PlanetWorld,
}

impl Gravity for PointMassGravity {
    fn acceleration(&self, _: f64, p: Vec3) -> Vec3 {
        around(&self.world.planet, p, |p| point_mass(self.mu, *p))
    }
    fn gradient(&self, _: f64, p: Vec3) -> Option<Mat3> {
        let own = |p: &Vec3| point_mass_gradient(self.mu, p);
        Some(gradient_around(&self.world.planet, p, own))
    }
    fn scale(&self, _: f64, p: Vec3) -> f64 {
        0.5 * relative_to_centre(self.world.planet.site.as_ref(), p)
    }
    fn axes(&self) -> Axes {
        self.world.planet.axes()
    }
}

/// Inverse-square gravity of the world's body.
#[service("environment.point_mass_gravity", Gravity)]
impl Service for PointMassGravity {
    type Params = PointMassGravityParams;
    fn build(p: PointMassGravityParams, _: &Files) -> Result<Self, BuildError> {
        let world = PlanetWorld::of(&p.world)?;
        Ok(PointMassGravity { mu: world.needs_mu()?, world })
    }
}

/// An isothermal atmosphere around the world's body, or over level ground.
#[derive(Params, Clone, Debug)]
pub struct AtmosphereParams {
    /// Density at the reference height.
    #[param(unit = "kg/m^3", range = 0.0..)]
    pub density: f64,
    /// Scale height of the density.
    #[param(unit = "m", range = 1.0..)]
    pub scale_height: f64,
    /// Constant temperature.
    #[param(unit = "K", range = 1.0..)]
    pub temperature: f64,
    /// Specific gas constant.
    #[param(unit = "J/(kg K)", range = 1.0..)]
    pub gas_constant: f64,
    /// Ratio of specific heats.
    #[param(range = 1.0..)]
    pub heat_ratio: f64,
    /// Height above the ellipsoid of the world's body at which the density is `density`; without a world, z of W.
    #[param(unit = "m", default = 0.0)]
    pub reference_height: f64,
    /// Viscosity of the gas, for Reynolds numbers; default: none.
    pub viscosity: Option<SutherlandParams>,
    /// Sutton-Graves constant k (kg^½/m), q = k √(ρ/r_n) V³: air 1.7415e-4, carbon dioxide 1.9027e-4; default: none.
    #[param(range = 0.0..)]
    pub heating_constant: Option<f64>,
    /// Steady wind in addition to the rotation of the body, W.
    #[param(unit = "m/s", default = Vec3::zeros())]
    pub wind: Vec3,
    /// The world; without a world W is level ground with z up.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// Exponential atmosphere.
pub struct ExponentialAtmosphere {
    air: Exponential,
    viscosity: Option<Sutherland>,
    heating: Option<f64>,
    world: Option<PlanetWorld>,
}

impl ExponentialAtmosphere {
    /// Returns the height above the ellipsoid (without a world above z = 0), m, and the velocity of the ground under p, m/s.
    fn height(&self, t: f64, p: Vec3) -> (f64, Vec3) {
        let Some(world) = &self.world else { return (p.z, Vec3::zeros()) };
        // Level ground has no curvature, and z is measured from the height of the origin.
        if let (Axes::Level(_), Some(site)) = (world.planet.axes(), &world.params.site) {
            return (site.height + p.z, Vec3::zeros());
        }
        let (spin, place) = world.planet.place(t, p);
        (place.map_or(f64::NAN, |place| place.altitude), spin.omega_I.cross(&p))
    }
}

impl Atmosphere for ExponentialAtmosphere {
    fn air(&self, t: f64, p: Vec3) -> Air {
        let (height, ground) = self.height(t, p);
        let a = self.air.at(height);
        Air {
            density: a.density,
            pressure: a.pressure,
            temperature: a.temperature,
            speed_of_sound: a.speed_of_sound,
            wind: ground + self.air.wind,
        }
    }
    fn viscosity(&self, temperature: f64) -> Option<f64> {
        self.viscosity.map(|law| law.at(temperature))
    }
    fn altitude(&self, t: f64, p: Vec3) -> Option<f64> {
        Some(self.height(t, p).0)
    }
    fn heating_constant(&self) -> Option<f64> {
        self.heating
    }
}

/// Isothermal atmosphere with exponential density, rotating with the world's body.
#[service("environment.exponential_atmosphere", Atmosphere)]
impl Service for ExponentialAtmosphere {
    type Params = AtmosphereParams;
    fn build(p: AtmosphereParams, _: &Files) -> Result<Self, BuildError> {
        let viscosity = p.viscosity.as_ref().map(SutherlandParams::law);
        let air = Exponential {
            reference_height: p.reference_height,
            density: p.density,
            scale_height: p.scale_height,
            temperature: p.temperature,
            gas_constant: p.gas_constant,
            heat_ratio: p.heat_ratio,
            wind: p.wind,
        };
        let world = p.world.as_ref().map(PlanetWorld::of).transpose()?;
        Ok(ExponentialAtmosphere { air, viscosity, heating: p.heating_constant, world })
    }
}

/// Parameters of a Sun in a fixed direction.
#[derive(Params, Clone, Debug)]
pub struct FixedSunParams {
    /// On level ground or a site: azimuth from north towards east. Without a world north is y of W and east is x; otherwise the `heading` of the
    /// world's `site` defines them.
    #[param(unit = "rad", range = -TAU..=TAU)]
    pub azimuth: Option<f64>,
    /// On level ground or a site: elevation above the horizon.
    #[param(unit = "rad", range = -FRAC_PI_2..=FRAC_PI_2)]
    pub elevation: Option<f64>,
    /// If W is inertial: direction to the Sun, W.
    pub direction: Option<Vec3>,
    /// Distance in AU; default: the mean distance of the world's body.
    #[param(range = 0.01..)]
    pub distance_au: Option<f64>,
    /// The world, if the simulation has one.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// Sun in a fixed direction.
pub struct FixedSun {
    /// State at t = 0.
    start: SunState,
    world: Option<PlanetWorld>,
    /// The direction is relative to level ground, so the horizon can hide the Sun.
    level: bool,
}

impl Sun for FixedSun {
    fn state(&self, t: f64) -> SunState {
        // At a rotating site, the direction of the Sun is fixed in inertial axes.
        let turning = |w: &PlanetWorld| w.planet.site.filter(|_| w.planet.turning);
        let Some(site) = self.world.as_ref().and_then(turning) else { return self.start };
        let turned = site.to_inertial(t).inverse() * site.to_inertial(0.0);
        SunState { direction: turned * self.start.direction, ..self.start }
    }
    fn light(&self, t: f64, p: &Vec3) -> Light {
        let SunState { direction, distance_au } = self.state(t);
        let sun = direction * (distance_au * AU);
        if let Some(world) = &self.world {
            return world.light(t, p, &sun);
        }
        let mut seen = SunView::new(&(sun - p), SOLAR_CONSTANT);
        if self.level {
            seen.horizon();
        }
        seen.light()
    }
}

/// Sun in a fixed direction: azimuth and elevation over level ground or a site, or a vector in inertial axes. At a rotating site the direction is
/// fixed in inertial axes, so that the Sun rises and sets.
#[service("environment.fixed_sun", Sun)]
impl Service for FixedSun {
    type Params = FixedSunParams;
    fn build(p: FixedSunParams, _: &Files) -> Result<Self, BuildError> {
        let wrong =
            |fact: &str, help: &str, param: &str| Err(BuildError::new(fact).help(help).at(param));
        let world = p.world.as_ref().map(PlanetWorld::of).transpose()?;
        if let Some(epoch) = world.as_ref().and_then(|w| w.planet.epoch.as_deref()) {
            let fact =
                format!("`world` has the epoch {epoch}, which determines the direction of the Sun");
            let help = "use `environment.ephemeris_sun`, or remove `epoch` from `world`";
            return Err(BuildError::new(fact).help(help));
        }
        if let Some(world) = &world {
            world.needs_light()?;
        }
        let inertial = world.as_ref().is_some_and(|w| w.planet.site.is_none());
        let (direction, level) = match (p.azimuth, p.elevation, p.direction) {
            (Some(azimuth), Some(elevation), None) if !inertial => {
                let (sin_a, cos_a) = azimuth.sin_cos();
                let (sin_e, cos_e) = elevation.sin_cos();
                let site = world.as_ref().and_then(|w| w.planet.site);
                let east = site.map_or(Vec3::x(), |site| site.east());
                let north = Vec3::z().cross(&east);
                (east * (sin_a * cos_e) + north * (cos_a * cos_e) + Vec3::z() * sin_e, true)
            }
            (None, None, Some(direction)) if world.is_none() || inertial => {
                let Some(direction) = direction.try_normalize(1e-12) else {
                    return wrong(
                        "`direction` is the zero vector",
                        "write a vector to the Sun",
                        "direction",
                    );
                };
                (direction, false)
            }
            _ if inertial => {
                return wrong(
                    "W is inertial, with the centre of a body at its origin: there is no horizon",
                    "write the `direction` to the Sun in W, and remove `azimuth` and `elevation`",
                    "direction",
                );
            }
            _ if world.is_some() => {
                return wrong(
                    "W is a site on a planet",
                    "write `azimuth` and `elevation` relative to its horizon, and remove `direction`",
                    "azimuth",
                );
            }
            _ => {
                return wrong(
                    "the direction of the Sun is not written, or written twice",
                    "write `azimuth` and `elevation` on level ground, or `direction` in space",
                    "azimuth",
                );
            }
        };
        let stated = world.as_ref().and_then(|w| w.params.sun_distance);
        if let (Some(here), Some(there)) = (p.distance_au, stated)
            && here != there
        {
            let fact = format!("`distance_au` is {here}, but `sun_distance` of `world` is {there}");
            return Err(BuildError::new(fact).help("write only one of them").at("distance_au"));
        }
        let of_world = || world.as_ref().and_then(|w| w.sun_distance());
        let Some(distance_au) = p.distance_au.or_else(of_world) else {
            return wrong(
                "the distance of the Sun is not known",
                "write it in AU, or state the body: world: (body: \"mars\", ..)",
                "distance_au",
            );
        };
        Ok(FixedSun { start: SunState { direction, distance_au }, world, level })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{Centre, SiteParams, WorldParams, handle};
    use std::f64::consts::FRAC_PI_2;

    fn sun(p: FixedSunParams) -> Result<FixedSun, BuildError> {
        FixedSun::build(p, &Files::default())
    }

    fn level(azimuth: f64, elevation: f64, world: Option<WorldParams>) -> FixedSunParams {
        FixedSunParams {
            azimuth: Some(azimuth),
            elevation: Some(elevation),
            direction: None,
            distance_au: Some(1.0),
            world: world.map(handle),
        }
    }

    fn here(turning: bool) -> SiteParams {
        SiteParams { latitude: 0.0, longitude: 0.3, height: 0.0, heading: 0.0, turning }
    }

    #[test]
    fn a_fixed_sun_in_the_east_is_along_x_and_sets() {
        let s = sun(level(FRAC_PI_2, 0.0, None)).unwrap();
        assert!((s.state(9.0).direction - Vec3::x()).norm() < 1e-12);
        assert!((s.light(0.0, &Vec3::zeros()).visible - 0.5).abs() < 1e-3);
        let night = sun(level(FRAC_PI_2, -0.17, None)).unwrap().light(0.0, &Vec3::zeros());
        assert_eq!(night.visible, 0.0);
        let day = sun(level(FRAC_PI_2, 0.17, None)).unwrap().light(0.0, &Vec3::zeros());
        assert!(day.visible == 1.0 && (day.irradiance - 1361.0).abs() < 1e-9);
    }

    /// The azimuth is relative to north for any heading of the site.
    #[test]
    fn an_azimuth_knows_the_heading_of_its_site() {
        for turning in [true, false] {
            // The x axis of W points 30° from east towards north.
            let site = SiteParams { heading: 0.5 * FRAC_PI_2 / 1.5, ..here(turning) };
            let world = WorldParams { site: Some(site), ..WorldParams::of(Centre::Mars) };
            let at = |azimuth: f64| sun(level(azimuth, 0.0, Some(world.clone()))).unwrap().start;
            let ahead = at(FRAC_PI_2 * 2.0 / 3.0).direction;
            assert!((ahead - Vec3::x()).norm() < 1e-9, "{ahead}");
            let east = at(FRAC_PI_2).direction;
            assert!((east - Vec3::new(0.75f64.sqrt(), -0.5, 0.0)).norm() < 1e-9, "{east}");
        }
    }

    #[test]
    fn a_sun_among_the_stars_goes_over_a_site_that_turns() {
        let planet = WorldParams {
            rate: Some(1e-3),
            site: Some(here(true)),
            ..WorldParams::of(Centre::Moon)
        };
        let at = |world: Option<WorldParams>, t: f64| {
            sun(level(FRAC_PI_2, 0.2, world)).unwrap().state(t).direction
        };
        // At the equator the Sun moves by a radian in 1000 s: it rises in the east, passes the zenith
        // and sets.
        for t in [0.0, 1000.0, 2500.0] {
            let height: f64 = 0.2 + 1e-3 * t;
            let want = Vec3::new(height.cos(), 0.0, height.sin());
            assert!((at(Some(planet.clone()), t) - want).norm() < 1e-12, "{t} s");
        }
        assert_eq!(at(None, 2500.0), at(None, 0.0));
        let level = WorldParams { site: Some(here(false)), ..planet };
        assert_eq!(at(Some(level), 2500.0), at(None, 0.0));
    }

    #[test]
    fn a_sun_is_stated_in_the_axes_that_there_are() {
        let told = |p: FixedSunParams, word: &str| {
            let e = sun(p).err().unwrap_or_else(|| panic!("{word}"));
            assert!(e.message.contains(word) && e.help.is_some(), "{}", e.message);
        };
        let mars = WorldParams::of(Centre::Mars);
        told(level(0.0, 1.0, Some(mars.clone())), "there is no horizon");
        let by_vector = |world: Option<WorldParams>| FixedSunParams {
            azimuth: None,
            elevation: None,
            direction: Some(Vec3::x() * 3.0),
            distance_au: None,
            world: world.map(handle),
        };
        let site = Some(here(true));
        told(by_vector(Some(WorldParams { site, ..mars.clone() })), "a site on a planet");
        told(by_vector(None), "distance of the Sun");
        told(FixedSunParams { direction: None, ..by_vector(None) }, "is not written");
        let dated = WorldParams { epoch: Some("2021-02-18 00:00:00 UTC".into()), ..mars.clone() };
        told(by_vector(Some(dated)), "which determines the direction of the Sun");
        let twice = WorldParams { sun_distance: Some(1.4), ..mars.clone() };
        let two = FixedSunParams { distance_au: Some(1.5), ..by_vector(Some(twice.clone())) };
        told(two.clone(), "but `sun_distance` of `world` is");
        assert!(sun(FixedSunParams { distance_au: Some(1.4), ..two }).is_ok());
        let state = sun(by_vector(Some(mars))).unwrap().state(0.0);
        assert!((state.distance_au - 1.5237).abs() < 1e-4 && state.direction == Vec3::x());
    }

    #[test]
    fn uniform_gravity_is_for_level_ground() {
        let of = |acceleration, world: Option<WorldParams>| {
            let p = UniformGravityParams { acceleration, world: world.map(handle) };
            UniformGravity::build(p, &Files::default())
        };
        let written = Vec3::new(0.0, 0.0, -1.62);
        assert_eq!(of(Some(written), None).unwrap().uniform(), Some(written));
        let mars = WorldParams::of(Centre::Mars);
        let e = of(Some(written), Some(mars.clone())).err().unwrap();
        assert!(e.message.contains("level ground") && e.help.unwrap().contains("turning: false"));
        assert!(of(None, None).err().unwrap().param.as_deref() == Some("acceleration"));
        // At the equator of Mars, gravity is μ/R² − ω² R. An explicit acceleration must agree with
        // it.
        let site = Some(here(false));
        let level = WorldParams { site, ..mars.clone() };
        let e = of(Some(written), Some(level.clone())).err().unwrap();
        assert!(e.message.contains("1.62") && e.message.contains("3.69") && e.help.is_some());
        let near = Vec3::new(0.0, 0.0, -3.72076);
        assert_eq!(of(Some(near), Some(level.clone())).unwrap().uniform(), Some(near));
        let moon = WorldParams { mu: Some(1.62 * 3_396_190.0_f64.powi(2)), ..level };
        assert!(of(Some(written), Some(moon)).is_ok());
        let g = of(None, Some(WorldParams { site, ..mars.clone() })).unwrap().uniform().unwrap();
        let radius = 3_396_190.0_f64;
        let want = 4.282_837_521_4e13 / radius.powi(2) - 7.088_218e-5_f64.powi(2) * radius;
        assert!((g.z + want).abs() < 1e-6 && g.x == 0.0, "{g}");
        let point = PointMassGravityParams { world: handle(mars) };
        assert!(PointMassGravity::build(point, &Files::default()).unwrap().uniform().is_none());
    }

    fn air(world: Option<WorldParams>) -> ExponentialAtmosphere {
        let p = AtmosphereParams {
            density: 0.02,
            scale_height: 11_100.0,
            temperature: 210.0,
            gas_constant: 191.8,
            heat_ratio: 1.33,
            reference_height: 0.0,
            viscosity: None,
            heating_constant: None,
            wind: Vec3::new(3.0, 0.0, 0.0),
            world: world.map(handle),
        };
        ExponentialAtmosphere::build(p, &Files::default()).unwrap()
    }

    /// Over level ground the height is z everywhere; around a planet it is the height above the ellipsoid, and the air rotates with the planet.
    #[test]
    fn air_is_over_the_ground_that_there_is() {
        let flat = air(None);
        let a = flat.air(0.0, Vec3::new(1e5, -2e5, 11_100.0));
        assert!((a.density - 0.02 / 1f64.exp()).abs() < 1e-12 && a.wind == Vec3::x() * 3.0);
        let mars = air(Some(WorldParams::of(Centre::Mars)));
        let a = mars.air(0.0, Vec3::y() * (3_396_190.0 + 11_100.0));
        assert!((a.density - 0.02 / 1f64.exp()).abs() < 1e-9, "{}", a.density);
        let ground = -7.088_218e-5 * 3_407_290.0;
        assert!((a.wind - Vec3::x() * (ground + 3.0)).norm() < 1e-3, "{}", a.wind);
        assert_eq!(mars.altitude(0.0, Vec3::y() * 3_396_190.0).map(f64::round), Some(0.0));
        // The air above level ground at a height of 2 km is the air at an altitude of 2 km.
        for turning in [true, false] {
            let high = Some(SiteParams { height: 2000.0, ..here(turning) });
            let high = air(Some(WorldParams { site: high, ..WorldParams::of(Centre::Mars) }));
            let a = high.air(0.0, Vec3::z() * 9100.0);
            assert!((a.density - 0.02 / 1f64.exp()).abs() < 1e-9, "{turning}: {}", a.density);
        }
        let site = WorldParams { site: Some(here(true)), ..WorldParams::of(Centre::Mars) };
        let a = air(Some(site)).air(0.0, Vec3::z() * 11_100.0);
        assert!((a.density - 0.02 / 1f64.exp()).abs() < 1e-9 && a.wind == Vec3::x() * 3.0);
    }
}
