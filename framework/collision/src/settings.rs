//! Settings of queries: hidden colliders, and velocities of surfaces.
use crate::item::ColliderId;
use crate::shape::Visibility;
use linkwork_multibody::spatial::Vec3;

/// Visibility of the colliders: the part of a run's state that belongs to collision.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hiding {
    pub(crate) hidden: Vec<bool>,
}

impl Hiding {
    /// Hides or shows a collider.
    #[track_caller]
    pub fn set(&mut self, id: ColliderId, visibility: Visibility) {
        self.hidden[id.index()] = visibility == Visibility::Hidden;
    }

    /// Returns true if a collider is hidden.
    #[must_use]
    #[track_caller]
    pub fn of(&self, id: ColliderId) -> Visibility {
        if self.hidden[id.index()] { Visibility::Hidden } else { Visibility::Shown }
    }
}

/// Surface velocities relative to the bodies: the part of a run's state for belts and tracks.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceVelocities {
    pub(crate) of: Vec<Vec3>,
}

impl SurfaceVelocities {
    /// Sets the surface velocity of a collider, m/s, axes of its body.
    #[track_caller]
    pub fn set(&mut self, id: ColliderId, velocity: Vec3) {
        self.of[id.index()] = velocity;
    }

    /// Returns the surface velocity of a collider, m/s, axes of its body.
    #[must_use]
    #[track_caller]
    pub fn of(&self, id: ColliderId) -> Vec3 {
        self.of[id.index()]
    }

    /// Returns true if the surface of any collider moves relative to its body. O(colliders).
    #[must_use]
    pub fn any(&self) -> bool {
        self.of.iter().any(|v| *v != Vec3::zeros())
    }
}
