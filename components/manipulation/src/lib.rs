//! Component library for manipulation: controllers of one or two robot arms, a controller of a standing legged machine, and cutting tools.
//!
//! A controller embeds a model of its robot. This model is read from the URDF file of the simulated machine, but it is a separate instance: its
//! masses and the assumed pose of the workpiece may differ from the simulation.
//!
//! A program adds the library with its catalogue; a file then uses a model by its name (`model: "manipulation.arm_controller"`):
//! ```
//! let catalogue = linkwork_runtime::Catalogue::new([linkwork_manipulation::catalogue()]);
//! assert!(catalogue.get("manipulation.arm_controller").is_some());
//! ```

#![allow(non_snake_case)]

pub mod arm;
pub mod arm_controller;
pub mod cutting;
pub mod dual_arm_controller;
pub mod dual_moves;
pub mod dual_ports;
pub mod finger;
pub mod moves;
pub mod programme;
pub mod shearing;
pub mod standing_controller;
pub mod standing_ports;
pub mod tracking;

use linkwork_runtime::Lane;
use linkwork_surroundings::prelude::{
    Axes, Entry, Gravity, Handle, NodeState, PortKind, PortSpec, Vec3,
};

/// Acceleration of free fall (m/s²) that a controller believes: as written, or else the gravity of the simulation at the origin of W. If W is
/// inertial with its origin at the centre of a body, it is zero, as on a spacecraft in free fall; for an arm on the ground of that body, write
/// `gravity`.
pub(crate) fn believed(written: Option<Vec3>, field: Option<&Handle<dyn Gravity>>) -> Vec3 {
    let of_field = |g: &Handle<dyn Gravity>| match g.axes() {
        Axes::Inertial => Vec3::zeros(),
        Axes::Any | Axes::Site(_) | Axes::Level(_) => g.acceleration(0.0, Vec3::zeros()),
    };
    written.or_else(|| field.map(of_field)).unwrap_or_else(Vec3::zeros)
}

/// Returns the port for the node that carries the arms. The binding is optional if `gravity` is written, or without a gravity service.
pub(crate) fn base_port(written: Option<Vec3>, field: Option<&Handle<dyn Gravity>>) -> PortSpec {
    let port = PortSpec::named("base", PortKind::NodeState, NodeState::N)
        .doc_of("Node with the axes of the robot's base, for the direction of gravity; not used with `gravity`.");
    let mut still = vec![0.0; NodeState::N];
    NodeState::identity().put(&mut still);
    let optional = written.is_some() || field.is_none();
    PortSpec { bind: Some("base".into()), default: optional.then_some(still), ..port }
}

/// Gravity that a controller believes.
pub(crate) enum Believed {
    /// Written in the axes of the base, m/s².
    Written(Vec3),
    /// Gravity of the simulation at the origin of W, W, m/s².
    OfWorld(Vec3),
}

impl Believed {
    /// Returns gravity (m/s²) in the axes of the base. `base`: the lanes of [`base_port`].
    pub fn in_base(&self, base: &[f64]) -> Vec3 {
        match self {
            Self::Written(g) => *g,
            Self::OfWorld(g) => NodeState::get(base).rotation.inverse() * g,
        }
    }
}

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::sized::<arm_controller::ArmController>(),
        Entry::model::<cutting::Cutting>(),
        Entry::sized::<dual_arm_controller::DualArmController>(),
        Entry::model::<finger::Finger>(),
        Entry::model::<shearing::Shearing>(),
        Entry::sized::<standing_controller::StandingController>(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    /// A point mass at the origin, or the ground.
    struct Field(Axes);
    impl Gravity for Field {
        fn acceleration(&self, _: f64, p: Vec3) -> Vec3 {
            match self.0 {
                Axes::Inertial => p * (-4e14 / p.norm().powi(3)),
                _ => Vec3::new(0.0, 0.0, -3.7),
            }
        }
        fn axes(&self) -> Axes {
            self.0
        }
    }

    #[test]
    fn gravity_is_believed_where_there_is_ground() {
        let field = |axes| Handle::new("g", Arc::new(Field(axes)) as Arc<dyn Gravity>);
        let (orbit, ground) = (field(Axes::Inertial), field(Axes::Any));
        assert_eq!(believed(None, Some(&orbit)), Vec3::zeros());
        assert_eq!(believed(None, Some(&ground)), Vec3::new(0.0, 0.0, -3.7));
        assert_eq!(believed(Some(Vec3::x()), Some(&orbit)), Vec3::x());
        assert_eq!(believed(None, None), Vec3::zeros());
    }
}
