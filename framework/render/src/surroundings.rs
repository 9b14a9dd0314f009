//! What cameras, lidars and solar panels of a simulation see: the ground, and the bodies where they are.
use crate::{HeightMap, Light, Look, RenderError, Scene, shape_of};
use linkwork_runtime::prelude::*;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The ground and the shapes of bodies.
pub struct Surroundings {
    sees: Scenery,
    /// Work space: the shapes where they were last.
    scene: Mutex<Scene>,
}

impl Surroundings {
    /// Of the ground, if there is one, and the bodies, in their order.
    ///
    /// # Errors
    /// What cannot be seen, at the parameters `terrain`, `albedo` (of the ground) and `sees`.
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

    /// The ports that bring where the bodies are.
    #[must_use]
    pub fn ports(&self) -> Vec<PortSpec> {
        self.sees.ports()
    }

    /// The scene with the bodies where the lanes of those ports say; `None` for what is no pose. It is locked while it is looked at.
    pub fn now(&self, bodies: &[f64]) -> Option<MutexGuard<'_, Scene>> {
        let mut scene = self.scene.lock().unwrap_or_else(PoisonError::into_inner);
        scene.move_all(self.sees.poses(bodies)).ok()?;
        scene.settle();
        Some(scene)
    }
}
