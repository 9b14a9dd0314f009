//! The scene that cameras, lidars and solar panels of a simulation see: the ground, and the bodies at their poses.
use crate::{HeightMap, Light, Look, RenderError, Scene, shape_of};
use linkwork_surroundings::prelude::*;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The ground and the shapes of bodies.
pub struct Surroundings {
    sees: Scenery,
    /// Work space: the shapes at their last poses.
    scene: Mutex<Scene>,
}

impl Surroundings {
    /// Creates a scene of the ground, if there is one, and the bodies, in their order.
    ///
    /// # Errors
    /// Objects that cannot be rendered, reported at the parameters `terrain`, `albedo` (of the ground) and `sees`.
    pub fn new(
        terrain: Option<&Handle<dyn Terrain>>,
        ground: Look,
        sees: Scenery,
    ) -> Result<Self, BuildError> {
        let at = |name: &'static str| move |e: RenderError| BuildError::of(&e).at(name);
        let mut scene = Scene::new(Light::default());
        if let Some(terrain) = terrain {
            let map = HeightMap::new(terrain.nodes().map_err(|e| e.at("terrain"))?)
                .map_err(at("terrain"))?;
            scene.set_ground(Arc::new(map), ground).map_err(at("albedo"))?;
        }
        for seen in sees.shapes() {
            let shape = shape_of(&seen.form).map_err(at("sees"))?;
            let name = format!("{}/{}", seen.body, seen.name);
            scene.add(&name, &shape, Look::plain(seen.color), seen.pose).map_err(at("sees"))?;
        }
        scene.settle();
        Ok(Self { sees, scene: Mutex::new(scene) })
    }

    /// Returns the ports that receive the poses of the bodies.
    #[must_use]
    pub fn ports(&self) -> Vec<PortSpec> {
        self.sees.ports()
    }

    /// Returns the scene with the bodies at the poses in `bodies`, the values of these ports; `None` for an invalid pose. The scene is locked while
    /// the result exists.
    pub fn now(&self, bodies: &[f64]) -> Option<MutexGuard<'_, Scene>> {
        let mut scene = self.scene.lock().unwrap_or_else(PoisonError::into_inner);
        scene.move_all(self.sees.poses(bodies)).ok()?;
        scene.settle();
        Some(scene)
    }
}
