//! Surroundings for tests of models: gravity, air, Sun and ground that are defined by a few numbers, and a random generator with a seed.
//!
//! ```
//! use linkwork_surroundings::prelude::*;
//! use linkwork_surroundings::testing::{Plane, Random, air, gravity, still_air, sun, uniform_gravity};
//!
//! assert_eq!(uniform_gravity(3.71).acceleration(0.0, Vec3::x()), Vec3::z() * -3.71);
//! assert_eq!(gravity(|_, p| -p).acceleration(0.0, Vec3::x()), -Vec3::x());
//! assert_eq!(still_air(0.02).air(0.0, Vec3::zeros()).density, 0.02);
//! let wind = air(|_, p| Air { wind: p, ..linkwork_surroundings::testing::AIR });
//! assert_eq!(wind.air(0.0, Vec3::y()).wind, Vec3::y());
//! assert_eq!(sun(Vec3::z() * 2.0, 1.5).state(0.0).direction, Vec3::z());
//! let ground = Plane { slope: 0.25, ..Plane::default() }.handle();
//! assert_eq!(ground.ground(8.0, 0.0).unwrap().height, 2.0);
//! let mut random = Random::new(7);
//! assert!((-1.0..1.0).contains(&random.next()));
//! ```
use crate::environment::{
    Air, Atmosphere, Gravity, Ground, Rock, Soil, Sun, SunState, Surface, Terrain,
};
use linkwork_runtime::Handle;
pub use linkwork_runtime::testing::Random;
use linkwork_spatial::Vec3;
use std::sync::Arc;

/// A service that a function computes.
struct Of<F>(F);

impl<F: Fn(f64, Vec3) -> Vec3 + Send + Sync> Gravity for Of<F> {
    fn acceleration(&self, t: f64, p: Vec3) -> Vec3 {
        (self.0)(t, p)
    }
}

impl<F: Fn(f64, Vec3) -> Air + Send + Sync> Atmosphere for Of<F> {
    fn air(&self, t: f64, p: Vec3) -> Air {
        (self.0)(t, p)
    }
}

/// Gravity that a function of time (s) and place (m, W) computes (m/s²).
pub fn gravity(
    acceleration: impl Fn(f64, Vec3) -> Vec3 + Send + Sync + 'static,
) -> Handle<dyn Gravity> {
    Handle::new("gravity", Arc::new(Of(acceleration)) as Arc<dyn Gravity>)
}

/// Returns uniform gravity along −z (m/s²). It reports that it is uniform.
pub fn uniform_gravity(g: f64) -> Handle<dyn Gravity> {
    struct Down(f64);
    impl Gravity for Down {
        fn acceleration(&self, _: f64, _: Vec3) -> Vec3 {
            Vec3::z() * -self.0
        }
        fn uniform(&self) -> Option<Vec3> {
            Some(Vec3::z() * -self.0)
        }
    }
    Handle::new("gravity", Arc::new(Down(g)) as Arc<dyn Gravity>)
}

/// Still air of 1.2 kg/m³, 1 bar and 280 K with a speed of sound of 340 m/s. These numbers do not belong to a real gas; a test should set those on
/// which its result depends.
pub const AIR: Air = Air {
    density: 1.2,
    pressure: 1e5,
    temperature: 280.0,
    speed_of_sound: 340.0,
    wind: Vec3::new(0.0, 0.0, 0.0),
};

/// Air that a function of time (s) and place (m, W) computes.
pub fn air(air: impl Fn(f64, Vec3) -> Air + Send + Sync + 'static) -> Handle<dyn Atmosphere> {
    Handle::new("air", Arc::new(Of(air)) as Arc<dyn Atmosphere>)
}

/// Creates [`AIR`] with another density (kg/m³), the same everywhere.
pub fn still_air(density: f64) -> Handle<dyn Atmosphere> {
    air(move |_, _| Air { density, ..AIR })
}

/// Returns a Sun that does not move: a vector towards it, of any length, and its distance (AU). Nothing hides its light.
pub fn sun(towards: Vec3, distance_au: f64) -> Handle<dyn Sun> {
    struct Still(SunState);
    impl Sun for Still {
        fn state(&self, _: f64) -> SunState {
            self.0
        }
    }
    let state = SunState { direction: towards.normalize(), distance_au };
    Handle::new("sun", Arc::new(Still(state)) as Arc<dyn Sun>)
}

/// A plane as the ground: z = height + slope · x, for |x| and |y| up to `half`.
#[derive(Clone, Debug)]
pub struct Plane {
    /// Height at the origin (m).
    pub height: f64,
    /// Rise along x (1).
    pub slope: f64,
    /// Half of the side of the map (m).
    pub half: f64,
    /// The soil; [`Soil::UNKNOWN`]: no soil is written.
    pub soil: Soil,
    /// Rocks that it lists.
    pub rocks: Vec<Rock>,
}

impl Default for Plane {
    /// Level ground of 200 m at z = 0, without soil and rocks.
    fn default() -> Self {
        let (height, slope, half) = (0.0, 0.0, 100.0);
        Plane { height, slope, half, soil: Soil::UNKNOWN, rocks: Vec::new() }
    }
}

impl Plane {
    /// Returns it as a service.
    pub fn handle(self) -> Handle<dyn Terrain> {
        Handle::new("ground", Arc::new(self) as Arc<dyn Terrain>)
    }
}

impl Terrain for Plane {
    fn ground(&self, x: f64, y: f64) -> Option<Ground> {
        let normal = Vec3::new(-self.slope, 0.0, 1.0).normalize();
        let inside = x.abs() <= self.half && y.abs() <= self.half;
        inside.then_some(Ground { height: self.height + self.slope * x, normal })
    }
    fn bounds(&self) -> [f64; 4] {
        [-self.half, -self.half, self.half, self.half]
    }
    fn soil(&self, _: f64, _: f64) -> &Soil {
        &self.soil
    }
    fn has_soil(&self) -> bool {
        !self.soil.density.is_nan()
    }
    fn surface(&self) -> Surface {
        let (low, high) =
            (self.height - self.slope * self.half, self.height + self.slope * self.half);
        let heights = [low, high, low, high].map(|h| h as f32).to_vec();
        Surface { origin: [-self.half; 2], spacing: [2.0 * self.half; 2], nx: 2, ny: 2, heights }
    }
    fn rocks(&self) -> Vec<Rock> {
        self.rocks.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_is_its_surface_and_ends() {
        let plane = Plane { height: 3.0, slope: 0.5, half: 10.0, ..Plane::default() };
        let surface = plane.surface();
        surface.check().unwrap();
        for (k, h) in surface.heights.iter().enumerate() {
            let [x, y] = [k % 2, k / 2].map(|n| -10.0 + 20.0 * n as f64);
            assert_eq!(plane.ground(x, y).unwrap().height, f64::from(*h));
        }
        assert!(plane.ground(10.1, 0.0).is_none() && plane.ground(0.0, -10.1).is_none());
        assert!(!plane.has_soil() && plane.needs_soil().is_err());
    }
}
