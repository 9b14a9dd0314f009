//! Small services for models that need them: level soil, uniform gravity, thin air, a fixed sun, a position on a small Earth.
use linkwork_environment::world::{Centre, PlanetWorld, SiteParams, WorldParams};
use linkwork_runtime::{ServiceObject, Services};
use linkwork_surroundings::prelude::*;
use linkwork_surroundings::testing::{Plane, sun, uniform_gravity};
use std::sync::Arc;

struct Thin;
impl Atmosphere for Thin {
    fn air(&self, _: f64, p: Vec3) -> Air {
        let density = 0.02 * (-p.z / 11_100.0).exp();
        let temperature = 210.0;
        Air {
            density,
            pressure: density * 191.8 * temperature,
            temperature,
            speed_of_sound: (1.33f64 * 191.8 * temperature).sqrt(),
            wind: Vec3::new(3.0, -1.0, 0.2),
        }
    }
    fn heating_constant(&self) -> Option<f64> {
        Some(1.9e-4)
    }
}

/// Returns one service of each kind.
pub fn services() -> Services {
    let soil = Soil {
        n: 1.1,
        n1: 0.3,
        k_c: 10e3,
        k_phi: 850e3,
        cohesion: 600.0,
        friction_angle: 0.6,
        shear_modulus: 0.02,
        a0: 0.4,
        a1: 0.15,
        lambda: 0.3,
        density: 1500.0,
        friction: 0.6,
    };
    // The body has the size and the mass of Mars.
    let here =
        SiteParams { latitude: 0.3, longitude: -0.8, height: 0.0, heading: 0.2, turning: true };
    let world = WorldParams {
        mu: Some(4.2828e13),
        radius: Some(3_396_190.0),
        epoch: Some("2025-01-01 00:00:00 UTC".into()),
        site: Some(here),
        ..WorldParams::of(Centre::Earth)
    };
    let world = PlanetWorld::handle(world, &Files::default()).map_err(|e| e.message).unwrap();
    let mut all = Services::default();
    all.add("world", ServiceObject::new::<dyn World>(world.object().clone()));
    all.add(
        "world.ground",
        ServiceObject::new::<dyn Terrain>(Arc::new(Plane { half: 1e3, soil, ..Plane::default() })),
    );
    all.add(
        "world.gravity",
        ServiceObject::new::<dyn Gravity>(uniform_gravity(3.71).object().clone()),
    );
    all.add("world.air", ServiceObject::new::<dyn Atmosphere>(Arc::new(Thin)));
    let sun = sun(Vec3::new(0.3, 0.2, 0.9), 1.5);
    all.add("world.sun", ServiceObject::new::<dyn Sun>(sun.object().clone()));
    all
}
