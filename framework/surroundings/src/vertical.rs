//! The direction of up at a point of W.
use crate::environment::Gravity;
use crate::site::Axes;
use crate::world::World;
use linkwork_runtime::{BuildError, Handle};
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::site::Site;
    use crate::world::PlainWorld;
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
}
