//! The world among the services: the direction of up, and services that are consistent with each other.
use crate::author::environment::{Gravity, Terrain};
use crate::author::error::BuildError;
use crate::author::services::{Handle, ServiceObject, Services};
use crate::author::site::Axes;
use crate::author::world::{PlainWorld, World};
use linkwork_spatial::Vec3;

/// Direction of up at a point of W.
///
/// Up points away from the centre of the body of the simulation; on level ground, and without a body, it is opposite to gravity.
#[derive(Clone, Debug)]
pub enum Vertical {
    /// Away from a body's centre, given in W (m).
    Centre(Vec3),
    /// Against gravity.
    Gravity(Handle<dyn Gravity>),
    /// z of level ground.
    Level,
}

impl Vertical {
    /// Creates the surroundings from the world and gravity of a simulation.
    ///
    /// # Errors
    /// There is neither a body nor gravity, so up is undefined.
    pub fn new(
        world: Option<&Handle<dyn World>>,
        gravity: Option<&Handle<dyn Gravity>>,
    ) -> Result<Vertical, BuildError> {
        let axes = world.map(|w| w.axes()).or(gravity.map(|g| g.axes())).unwrap_or(Axes::Any);
        let of_gravity = |g: &Handle<dyn Gravity>| match g.uniform() {
            Some(a) if a == Vec3::zeros() => None,
            _ => Some(Vertical::Gravity(g.clone())),
        };
        match axes {
            Axes::Inertial => Ok(Vertical::Centre(Vec3::zeros())),
            Axes::Site(site) => Ok(Vertical::Centre(-site.relative_to_centre(&Vec3::zeros()))),
            Axes::Level(_) => Ok(gravity.and_then(of_gravity).unwrap_or(Vertical::Level)),
            Axes::Any => gravity.and_then(of_gravity).ok_or_else(|| {
                let fact = "needs the direction of the vertical, but the simulation has neither a world nor gravity";
                let help = "write `world: (body: \"..\")` in the simulation, or add a gravity part such as `environment.uniform_gravity`";
                BuildError::new(fact).help(help)
            }),
        }
    }

    /// Returns the upward unit vector at p (m, W) and t (s); x where it is undefined.
    #[must_use]
    pub fn up(&self, t: f64, p: &Vec3) -> Vec3 {
        let along = match self {
            Vertical::Centre(c) => p - c,
            Vertical::Gravity(g) => -g.acceleration(t, *p),
            Vertical::Level => Vec3::z(),
        };
        along.try_normalize(1e-300).unwrap_or_else(Vec3::x)
    }
}

impl Services {
    /// The world of the simulation with the path of its part.
    pub fn world(&self) -> Option<Handle<dyn World>> {
        self.first()
    }

    /// Path of the world, or of a gravity without a world, because of which W rotates with a planet.
    pub fn in_a_site(&self) -> Option<String> {
        let mut found = self.iter().filter(|(_, o)| o.axes().site().is_some());
        found.next().map(|(path, _)| path.to_string())
    }

    /// If W rotates with a planet: returns path, fact and remedy for each gravity that lacks the forces of this rotation, and for a world without
    /// gravity.
    pub(crate) fn at_odds(&self) -> Vec<(String, String, String)> {
        let mut all = self.terrains_in_space();
        let Some((first, site)) = self.iter().find_map(|(p, o)| Some((p, o.axes().site()?))) else {
            return all;
        };
        let help = "use gravity of the world's body, such as `environment.point_mass_gravity`; for level ground whose rotation does not matter write `turning: false` in the `site` of `world`";
        let of_gravity = |(_, o): &(&str, &ServiceObject)| o.get::<dyn Gravity>().is_some();
        all.extend(self.iter().filter(of_gravity).filter(|(_, o)| o.axes() != Axes::Site(site)).map(
            |(path, _)| {
                let fact = format!(
                    "has no centrifugal and Coriolis forces, but W is a site of a rotating planet according to `{first}`"
                );
                (path.to_string(), fact, help.to_string())
            },
        ));
        if !self.iter().any(|one| of_gravity(&one)) {
            let fact = "W is a site of a rotating planet, but no gravity includes the forces of its rotation";
            all.push((first.to_string(), fact.to_string(), help.to_string()));
        }
        all
    }

    /// Checks that there is no terrain if W is inertial, because heights along z and upward normals have no meaning there.
    fn terrains_in_space(&self) -> Vec<(String, String, String)> {
        let Some(world) = self.world() else { return Vec::new() };
        if world.axes() != Axes::Inertial {
            return Vec::new();
        }
        let terrains = self.iter().filter(|(_, o)| o.get::<dyn Terrain>().is_some());
        let fact = "is ground with heights along z of W, but `world` makes W inertial, with its origin at the centre of the body";
        let help = "write `site` in `world`, so that z of W points up; or remove the terrain";
        terrains.map(|(path, _)| (path.to_string(), fact.to_string(), help.to_string())).collect()
    }
}

/// Checks that z of W is up, for a model whose ground is a plane of W.
///
/// # Errors
/// W is inertial; returns the fact and the remedy.
pub fn needs_level_ground(world: Option<&Handle<dyn World>>) -> Result<(), BuildError> {
    if world.is_none_or(|w| w.axes() != Axes::Inertial) {
        return Ok(());
    }
    let fact = "its ground is a plane with a height along z of W, but `world` makes W inertial, with its origin at the centre of the body";
    let help = "write `site` in `world`, so that z of W points up";
    Err(BuildError::new(fact).help(help))
}

impl ServiceObject {
    /// Returns the type of W that the service requires.
    pub fn axes(&self) -> Axes {
        let gravity = self.get::<dyn Gravity>().map(|g| g.axes());
        gravity.or_else(|| self.get::<dyn World>().map(|w| w.axes())).unwrap_or(Axes::Any)
    }
}

impl PlainWorld {
    /// Returns the world as a service.
    #[must_use]
    pub fn handle(self) -> Handle<dyn World> {
        Handle::new("world", std::sync::Arc::new(self) as std::sync::Arc<dyn World>)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::author::site::Site;
    use linkwork_spatial::Pose;
    use linkwork_spatial::Quat;
    use std::sync::Arc;

    struct Uniform(Vec3);
    impl Gravity for Uniform {
        fn acceleration(&self, _: f64, _: Vec3) -> Vec3 {
            self.0
        }
        fn uniform(&self) -> Option<Vec3> {
            Some(self.0)
        }
    }

    fn uniform(g: Vec3) -> Handle<dyn Gravity> {
        Handle::new("gravity", Arc::new(Uniform(g)) as Arc<dyn Gravity>)
    }

    fn site() -> Site {
        let turn = Quat::from_euler_angles(0.3, -0.8, 1.1);
        let pose = Pose::new(turn, Vec3::new(2e6, -1e6, 2.4e6));
        Site { pose, rate: 7e-5, start: Quat::from_euler_angles(0.1, 0.2, 0.3) }
    }

    #[test]
    fn up_is_against_gravity_or_away_from_the_centre() {
        let p = Vec3::new(1e5, 2e4, 50.0);
        let flat = uniform(Vec3::new(0.3, 0.0, -1.62));
        let up = Vertical::new(None, Some(&flat)).unwrap().up(0.0, &p);
        assert!((up - Vec3::new(-0.3, 0.0, 1.62).normalize()).norm() < 1e-15);
        let world = PlainWorld::inertial(4.9e12, 1.7e6, 0.0).handle();
        let up = Vertical::new(Some(&world), Some(&flat)).unwrap().up(0.0, &p);
        assert!((up - p.normalize()).norm() < 1e-15);
        let world = PlainWorld::of_site(4.9e12, 1.7e6, site()).handle();
        let up = Vertical::new(Some(&world), None).unwrap().up(0.0, &p);
        let want = site().pose.rotation.inverse() * site().to_planet(&p).normalize();
        assert!((up - want).norm() < 1e-12);
        let level = PlainWorld { axes: Axes::Level(site()), ..PlainWorld::inertial(1.0, 1.0, 0.0) };
        assert_eq!(Vertical::new(Some(&level.handle()), None).unwrap().up(0.0, &p), Vec3::z());
        for gravity in [None, Some(uniform(Vec3::zeros()))] {
            let e = Vertical::new(None, gravity.as_ref()).err().unwrap();
            assert!(e.message.contains("direction of the vertical") && e.help.is_some());
        }
    }

    #[test]
    fn places_are_those_of_a_body_that_rotates() {
        let world = PlainWorld {
            start: Quat::from_scaled_axis(Vec3::x() * 0.5),
            ..PlainWorld::inertial(1.0, 1e6, 1e-3)
        };
        for (t, latitude, longitude) in [(0.0, 0.4, 1.0), (700.0, -0.9, -2.0)] {
            let in_planet = Vec3::new(
                f64::cos(latitude) * f64::cos(longitude),
                f64::cos(latitude) * f64::sin(longitude),
                f64::sin(latitude),
            );
            let p = world.planet_axes(t) * (in_planet * 1.5e6);
            let got = world.geographic(t, p).unwrap();
            assert!((got.latitude - latitude).abs() < 1e-12 && (got.altitude - 5e5).abs() < 1e-6);
            assert!((got.longitude - longitude).abs() < 1e-12);
            // `planet_rate` must be the rate of rotation of `planet_axes`.
            let turned = world.planet_axes(t + 0.5) * world.planet_axes(t - 0.5).inverse();
            assert!((turned.scaled_axis() - world.planet_rate(t)).norm() < 1e-12);
        }
        assert!(world.geographic(0.0, Vec3::zeros()).is_none());
    }

    #[test]
    fn gravity_without_the_forces_of_a_turning_site_is_refused() {
        let mut services = Services::default();
        let world = Arc::new(PlainWorld::of_site(4.9e12, 1.7e6, site()));
        services.add("world", ServiceObject::new::<dyn World>(world));
        assert!(services.at_odds()[0].1.contains("no gravity includes"));
        services.add("G", ServiceObject::new::<dyn Gravity>(Arc::new(Uniform(Vec3::z()))));
        let [(path, fact, help)] = &services.at_odds()[..] else { panic!() };
        assert!(path == "G" && fact.contains("Coriolis") && help.contains("turning: false"));
        assert_eq!(services.in_a_site().as_deref(), Some("world"));
        assert_eq!(services.world().unwrap().path(), "world");
    }
}
