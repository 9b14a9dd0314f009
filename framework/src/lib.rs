//! Linkwork simulates machines made of parts: rovers, landers, spacecraft, robot arms.
//!
//! An [`Assembly`](assembly::Assembly) holds bodies and hinges, parts (models of motors, wheels, sensors, gravity), and the wires
//! between them. Linkwork derives the order of evaluation from the wires and integrates parts and bodies together.
//!
//! A pendulum, released at 0.1 rad:
//! ```
//! use linkwork::components::environment::fields::UniformGravity;
//! use linkwork::prelude::*;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut pendulum = Assembly::new();
//! let bob = Body::on("world").hinge(Hinge::pin(Vec3::y())).mass(1.0).com([0.0, 0.0, -1.0]);
//! pendulum.body("bob", bob.inertia([1e-9; 3]).initial_angle(0.1));
//! pendulum.part::<UniformGravity>("Gravity", |p| p.acceleration([0.0, 0.0, -9.81]));
//! let mut sim = pendulum.simulation()?;
//! sim.run_until(2.0)?;
//! let small_angles = 0.1 * (9.81f64.sqrt() * 2.0).cos();
//! assert!((sim.get("bob.angle")? - small_angles).abs() < 1e-3);
//! # Ok(())
//! # }
//! ```
//! Programs in the folder `examples` of this crate, each at most 60 lines (`cargo run --release -p linkwork --example pendulum`):
//!
//! | example | shows |
//! |---|---|
//! | `pendulum` | a body on a hinge; variables over time; the period against its closed form |
//! | `motor_on_a_hinge` | parts, wires, connectors and bindings; the speed against its closed form |
//! | `wheel_on_ground` | terrain and contact; the speed against the balance of angular momentum |
//! | `orbit` | a world, an integrator with step size control; the period against Kepler |
//! | `arm_inverse_kinematics` | the robot model that autonomy software embeds; angles against their closed form |
//! | `own_model` | a user-defined model; compares the period with its closed form |
//!
//! # Where to look
//! [`prelude`] has what most programs need: build or load a simulation, run it, record variables. [`model::prelude`] has what
//! the author of a model needs. The rest is in the modules, each of which imports only those before it:
//!
//! | module | content |
//! |---|---|
//! | [`spatial`] | vectors, rotations, poses, spatial velocities and forces, inertia |
//! | [`multibody`] | bodies, hinges, nodes: the structure of a mechanism |
//! | [`dynamics`] | kinematics, inverse and forward dynamics, mass matrices, derivatives |
//! | [`operators`] | spatial operators as values: φ, ψ, H, M, K, D |
//! | [`formats`] | URDF, MJCF and SDF files; URDF export |
//! | [`world`] | planets: ellipsoids, rotation, epochs, gravity, atmospheres, ephemerides |
//! | [`integrate`] | integrators, dense output, location of events |
//! | [`solvers`] | constraints and contact |
//! | [`collision`] | shapes of bodies: contact points, distances, rays |
//! | [`embedded`] | the robot model that autonomy software embeds: inverse kinematics, motion planning, control |
//! | [`runtime`] | models, ports, wires, plans, simulations, checkpoints |
//! | [`surroundings`] | terrain, soil, gravity, atmosphere, Sun, world: the services that models query |
//! | [`plant`] | the mechanism as a part of a simulation: bindings, contact, placement on the ground |
//! | [`render`] | cameras and lidar |
//! | [`assembly`] | the RON format and the builder: one flat specification, all mistakes at once |
//! | [`record`] | logs, tables, comparison, plots |
//! | [`runner`] | runs with logs, checkpoints, pace and stop conditions |
//! | `components` | the component libraries and the assemblies that ship with Linkwork (feature `components`, on by default) |
//! | `viz` | recordings and streams for Rerun (feature `viewer`) |

pub use linkwork_assembly as assembly;
pub use linkwork_collision as collision;
pub use linkwork_dynamics as dynamics;
pub use linkwork_embedded as embedded;
pub use linkwork_formats as formats;
pub use linkwork_integrate as integrate;
pub use linkwork_multibody as multibody;
pub use linkwork_operators as operators;
pub use linkwork_plant as plant;
pub use linkwork_record as record;
pub use linkwork_render as render;
pub use linkwork_runner as runner;
pub use linkwork_runtime as runtime;
pub use linkwork_solvers as solvers;
pub use linkwork_spatial as spatial;
pub use linkwork_surroundings as surroundings;
#[cfg(feature = "viewer")]
pub use linkwork_viz as viz;
pub use linkwork_world as world;

/// The names that programs need to build or load simulations and to run them.
///
/// ```no_run
/// use linkwork::components;
/// use linkwork::prelude::*;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let ready = components::library().file("sims/rover_traverse".as_ref(), &[], None)?;
/// let mut sim = ready.simulation();
/// let mut log = Recording::new(&sim, ["Rover/chassis.position.*"], 0.1)?;
/// log.run_until(&mut sim, "1 min")?;
/// # Ok(())
/// # }
/// ```
pub mod prelude {
    pub use linkwork_assembly::{Assembly, Body, Failure, Library, Ready, Value, fields, variant};
    pub use linkwork_collision::Shape;
    pub use linkwork_multibody::Hinge;
    pub use linkwork_runner::Recording;
    pub use linkwork_runtime::{
        Catalogue, Integrator, ParamsBuilder, RunError, Seconds, Simulation, VariableError,
    };
    pub use linkwork_spatial::{Mat3, Pose, Quat, Vec3};
}

/// Models of your own.
pub mod model {
    pub use linkwork_surroundings::testing;

    /// The names that authors of models need: traits, derive macros, types of ports, services, vectors.
    pub mod prelude {
        pub use linkwork_surroundings::prelude::*;
    }
}

/// The component libraries, one module for each, and all of them as one library.
#[cfg(feature = "components")]
pub mod components {
    pub use linkwork_actuators as actuators;
    pub use linkwork_assemblies::library;
    pub use linkwork_basics as basics;
    pub use linkwork_control as control;
    pub use linkwork_environment as environment;
    pub use linkwork_flight as flight;
    pub use linkwork_manipulation as manipulation;
    pub use linkwork_mobility as mobility;
    pub use linkwork_navigation as navigation;
    pub use linkwork_power as power;
    pub use linkwork_sensors as sensors;
}
