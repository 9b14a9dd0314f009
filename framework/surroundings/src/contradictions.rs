//! Services that contradict each other: gravity and terrain that do not fit the frame W of the world.
use crate::environment::Gravity;
use crate::site::{Axes, Site};
use crate::world::World;
use linkwork_runtime::{Contradiction, ServiceObject, Services};

/// Remedy for a site without the forces of its rotation.
const ROTATION: &str = "use gravity of the world's body, such as `environment.point_mass_gravity`; for level ground whose rotation does not matter write `turning: false` in the `site` of `world`";

/// Returns the type of W that a service requires.
fn axes_of(object: &ServiceObject) -> Axes {
    let gravity = object.get::<dyn Gravity>().map(|g| g.axes());
    gravity.or_else(|| object.get::<dyn World>().map(|w| w.axes())).unwrap_or(Axes::Any)
}

/// Returns path and site of the first service according to which W rotates with a planet.
fn site(services: &Services) -> Option<(&str, Site)> {
    services.iter().find_map(|(path, object)| Some((path, axes_of(object).site()?)))
}

/// Returns the site according to the services of a simulation, if W rotates with a planet.
#[must_use]
pub fn site_of(services: &Services) -> Option<Site> {
    site(services).map(|(_, site)| site)
}

/// Returns whether a gravity with these axes lacks the forces of the rotation of W.
pub(crate) fn of_gravity(path: &str, axes: Axes, services: &Services) -> Option<Contradiction> {
    let (first, site) = site(services)?;
    let fact = format!(
        "has no centrifugal and Coriolis forces, but W is a site of a rotating planet according to `{first}`"
    );
    let missing = axes != Axes::Site(site);
    missing.then(|| Contradiction { path: path.into(), fact, help: ROTATION.into() })
}

/// Returns whether W is a site of a rotating planet, but no gravity includes the forces of its rotation.
pub(crate) fn of_world(path: &str, axes: Axes, services: &Services) -> Option<Contradiction> {
    axes.site()?;
    let fact =
        "W is a site of a rotating planet, but no gravity includes the forces of its rotation";
    let missing = services.first::<dyn Gravity>().is_none();
    missing.then(|| Contradiction { path: path.into(), fact: fact.into(), help: ROTATION.into() })
}

/// Returns whether W is inertial: then heights along z and upward normals have no meaning.
pub(crate) fn of_terrain(path: &str, services: &Services) -> Option<Contradiction> {
    let fact = "is ground with heights along z of W, but `world` makes W inertial, with its origin at the centre of the body";
    let help = "write `site` in `world`, so that z of W points up; or remove the terrain";
    let inertial = services.first::<dyn World>()?.axes() == Axes::Inertial;
    inertial.then(|| Contradiction { path: path.into(), fact: fact.into(), help: help.into() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::Terrain;
    use crate::testing::{Plane, uniform_gravity};
    use crate::world::PlainWorld;
    use linkwork_spatial::{Pose, Quat, Vec3};
    use std::sync::Arc;

    fn site() -> Site {
        let turn = Quat::from_euler_angles(0.3, -0.8, 1.1);
        let pose = Pose::new(turn, Vec3::new(2e6, -1e6, 2.4e6));
        Site { pose, rate: 7e-5, start: Quat::from_euler_angles(0.1, 0.2, 0.3) }
    }

    fn add_world(services: &mut Services, world: PlainWorld) {
        services.add("world", ServiceObject::new::<dyn World>(Arc::new(world)));
    }

    #[test]
    fn gravity_without_the_forces_of_a_turning_site_is_refused() {
        let mut services = Services::default();
        add_world(&mut services, PlainWorld::of_site(4.9e12, 1.7e6, site()));
        assert!(services.contradictions()[0].fact.contains("no gravity includes"));
        let gravity = uniform_gravity(9.81).object().clone();
        services.add("G", ServiceObject::new::<dyn Gravity>(gravity));
        let [one] = &services.contradictions()[..] else { panic!() };
        assert!(one.path == "G" && one.fact.contains("Coriolis"));
        assert!(one.help.contains("turning: false"));
        assert_eq!(services.rotating(), Some("world"));
        assert_eq!(site_of(&services), Some(site()));
    }

    #[test]
    fn terrain_in_inertial_axes_is_refused() {
        let mut services = Services::default();
        services.add("T", ServiceObject::new::<dyn Terrain>(Arc::new(Plane::default())));
        assert_eq!(services.contradictions(), []);
        add_world(&mut services, PlainWorld::inertial(4.9e12, 1.7e6, 0.0));
        let [one] = &services.contradictions()[..] else { panic!() };
        assert!(one.path == "T" && one.fact.contains("W inertial"));
        assert!(services.rotating().is_none());
    }
}
