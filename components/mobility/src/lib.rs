//! Component library for mobility: wheels and feet on rigid ground and on soil.
//!
//! * `wheel_rigid` and `wheel_soil` are models of wheels on rigid ground and on soil (terramechanics).
//! * `wheel_scm` and `foot` are models on ground that deforms node by node (`scm`).
//! * `wheel_rolling` is for machines that move by kinematics, `quasi_static` for machines whose forces are in equilibrium at each instant.
//!
//! Stresses, contacts and geometry are plain functions of plain data.
//!
//! A program adds the library with its catalogue; a file then uses a model by its name (`model: "mobility.wheel_soil"`):
//! ```
//! let catalogue = linkwork_runtime::Catalogue::new([linkwork_mobility::catalogue()]);
//! assert!(catalogue.get("mobility.wheel_soil").is_some());
//! ```

mod changed;
pub mod foot;
pub mod grousers;
pub mod multipass;
pub mod quadrature;
pub mod quasi_static;
pub mod rigid_contact;
pub mod ruts;
pub mod scm;
pub mod soil_contact;
pub mod terramechanics;
pub mod tiles;
pub mod wheel_rigid;
pub mod wheel_rolling;
pub mod wheel_scm;
pub mod wheel_soil;
pub mod wheel_test;

#[cfg(test)]
mod test_soils;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::model::<foot::Foot>(),
        Entry::model::<quasi_static::WheelRigidQuasiStatic>(),
        Entry::model::<quasi_static::WheelSoilQuasiStatic>(),
        Entry::model::<wheel_rigid::WheelRigid>(),
        Entry::model::<wheel_rolling::WheelRolling>(),
        Entry::model::<wheel_scm::WheelScm>(),
        Entry::model::<wheel_soil::WheelSoilModel>(),
        Entry::field::<ruts::Ruts>(),
        Entry::field::<scm::ground::ScmGround>(),
    ]
}
