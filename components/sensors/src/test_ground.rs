//! A soil and a slope for the tests of this crate.
use linkwork_runtime::prelude::*;
use std::sync::Arc;

/// Firm, and of no soil in particular: sensors do not ask.
pub(crate) fn firm() -> Soil {
    Soil {
        n: 1.0,
        n1: 0.0,
        k_c: 0.0,
        k_phi: 1e6,
        cohesion: 0.0,
        friction_angle: 0.5,
        shear_modulus: 0.02,
        a0: 0.4,
        a1: 0.1,
        lambda: 0.5,
        density: 1500.0,
        friction: 0.7,
    }
}

/// Ground that rises towards +x by a quarter, as far as `half` (m) from the origin.
pub(crate) struct Slope {
    soil: Soil,
    half: f64,
    rocks: Vec<Rock>,
}

/// The slope as a service.
pub(crate) fn slope(half: f64) -> Handle<dyn Terrain> {
    Handle::new("ground", Arc::new(Slope { soil: firm(), half, rocks: vec![] }) as Arc<dyn Terrain>)
}

/// The slope with rocks that it lists.
pub(crate) fn strewn(rocks: Vec<Rock>) -> Handle<dyn Terrain> {
    Handle::new("ground", Arc::new(Slope { soil: firm(), half: 100.0, rocks }) as Arc<dyn Terrain>)
}

impl Terrain for Slope {
    fn ground(&self, x: f64, _: f64) -> Option<Ground> {
        Some(Ground { height: 0.25 * x, normal: Vec3::new(-0.25, 0.0, 1.0).normalize() })
    }
    fn bounds(&self) -> [f64; 4] {
        [-self.half, -self.half, self.half, self.half]
    }
    fn soil(&self, _: f64, _: f64) -> &Soil {
        &self.soil
    }
    fn surface(&self) -> Surface {
        let rise = (0.25 * self.half) as f32;
        let (origin, spacing) = ([-self.half; 2], [2.0 * self.half; 2]);
        Surface { origin, spacing, nx: 2, ny: 2, heights: vec![-rise, rise, -rise, rise] }
    }
    fn rocks(&self) -> Vec<Rock> {
        self.rocks.clone()
    }
}
