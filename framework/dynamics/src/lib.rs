//! Recursive dynamics by scatter and gather sweeps: kinematics, inverse and forward dynamics, matrices and derivatives. Frames, topology, inverse
//! kinematics and ensembles are based on them.
//!
//! A [`Tree`] is a mechanism prepared for the kernels; a [`Workspace`] is their memory. The sequence of calls for one integrator stage is:
//! ```text
//! kinematics(&tree, &mut ws, q, v);              poses and velocities
//! ws.clear_forces();                             then read nodes, compute wrenches
//! ws.apply_uniform_gravity(g);                   and add them
//! ws.add_wrench_at_node(&tree, node, wrench);
//! forward_dynamics_given_kinematics(&tree, &mut ws, tau, vdot)?;
//! ws.node_acceleration(&tree, node);             accelerometers
//! ```
//! Frames are in world axes at each link's own origin, so the dynamics does not lose accuracy far from the world's origin. After set-up no function
//! allocates (except to name a body in an error) or looks up names, and results do not depend on the order in which bodies were added.
//! ```
//! use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge};
//! use linkwork_dynamics::spatial::{MassProperties, Mat3, Vec3};
//! use linkwork_dynamics::{Tree, Workspace, forward_dynamics_given_kinematics, kinematics};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let rod = MassProperties { mass: 2.0, com: Vec3::new(0.0, 0.0, -0.5), inertia_com: Mat3::from_diagonal_element(0.1), ..MassProperties::default() };
//! let mut builder = Builder::new();
//! builder.body(BodySpec::new("rod", "world").hinge(Hinge::pin(Vec3::y())).mass(rod));
//! let tree = Tree::new(&builder.build()?);
//! let mut ws = Workspace::new(&tree);
//! let (mut tau, mut vdot) = ([0.0], [0.0]);
//! kinematics(&tree, &mut ws, &[0.3], &[0.0]);
//! ws.clear_forces();
//! ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
//! forward_dynamics_given_kinematics(&tree, &mut ws, &mut tau, &mut vdot)?;
//! // A pendulum: −m g c sin q / (I + m c²)
//! assert!((vdot[0] + 2.0 * 9.81 * 0.5 * 0.3f64.sin() / (0.1 + 2.0 * 0.25)).abs() < 1e-12);
//! # Ok(())
//! # }
//! ```
#![allow(non_snake_case)]

mod articulated;
mod batch;
pub mod calibration;
mod centroidal;
pub mod checked;
mod columns;
mod compliance;
mod composite;
mod compound;
mod derivatives;
mod dofs;
#[cfg(feature = "threads")]
mod ensemble;
mod error;
mod flexible;
mod forces;
mod forward;
mod forward_derivatives;
pub mod frames;
mod gyroscopic;
mod hinge_loads;
mod inverse;
pub mod inverse_kinematics;
mod inverse_mass;
mod jacobian;
mod kinematics;
mod lane;
mod linear;
mod link_view;
mod momentum;
mod prediction;
mod query;
mod regressor;
pub mod topology;
mod tree;
pub mod units;
mod work;

pub use batch::Batch;
pub use centroidal::{centroidal_bias, centroidal_matrix, com_jacobian};
pub use compliance::Compliance;
pub use composite::mass_matrix;
pub use derivatives::Derivatives;
#[cfg(feature = "threads")]
pub use ensemble::Ensemble;
pub use error::{DynamicsError, InputError};
pub use flexible::elastic_energy;
pub use forward::{forward_dynamics, forward_dynamics_given_kinematics};
pub use forward_derivatives::ForwardDerivatives;
pub use frames::{FrameId, Frames, FramesError};
pub use hinge_loads::HingeLoads;
pub use inverse::{inverse_dynamics, inverse_dynamics_given_kinematics};
pub use inverse_kinematics::{Goal, InverseKinematics, InverseKinematicsError, RateTarget, Target};
pub use inverse_mass::{apply_inverse_mass, inverse_mass_diagonal, inverse_mass_matrix};
pub use jacobian::{
    body_jacobian, node_jacobian, node_jacobian_at, node_jacobian_product, node_jacobian_rate,
    node_jacobian_transpose_product,
};
pub use kinematics::{kinematics, poses};
pub use lane::Lane;
pub use link_view::{LinkView, link_views, node_offset};
pub use linkwork_multibody as multibody;
pub use linkwork_multibody::spatial;
pub use momentum::{
    center_of_mass, com_acceleration, com_velocity, kinetic_energy, momentum, potential_energy,
    subtree_inertia,
};
pub use prediction::{Drive, Prediction, StateEstimate};
pub use regressor::{PARAMETERS, inertial_parameters, regressor};
pub use topology::{Edit, Edited, Placement, TopologyError};
pub use tree::Tree;
pub use wide::{f64x4, f64x8};
pub use work::Workspace;
