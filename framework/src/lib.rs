//! Linkwork: simulate machines made of parts.
//!
//! Typed models (motors, wheels, sensors, gravity) declare ports; they are wired at run time into
//! nested assemblies; a schedule that follows from the wires steps them around one multibody solver.
//! This crate re-exports the floors of the framework in reading order; each imports only those
//! before it.
//!
//! | module | what it holds |
//! |---|---|
//! | [`spatial`] | motion, force, φ, pose, rigid inertia |
//! | [`multibody`] | bodies, hinges, nodes: the structure of a mechanism |
//! | [`dynamics`] | scatter and gather: kinematics, inverse and forward dynamics, matrices, derivatives; frames, operators, topology |
//! | [`formats`] | URDF, MJCF and SDF files; URDF export |
//! | [`world`] | planets: ellipsoids, rotation, epochs, gravity, atmospheres, ephemerides |
//! | [`integrate`] | integrators, dense output, location of events |
//! | [`solvers`] | constraints and contact |
//! | [`collision`] | shapes of bodies: contact points, distances, rays |
//! | [`embedded`] | the robot model that autonomy software embeds: parts, reach, hands, forces |
//! | [`runtime`] | models, ports, wires, plan, clock, state, checkpoints |
//! | [`render`] | cameras and lidar: rays, lenses, images, depth, stereo |
//! | [`assembly`] | RON and the builder: files → one flat specification, all faults at once |
//! | [`record`] | logs, reading them back, comparison, plots |
//! | [`runner`] | a run from file to end: load, recorders, the time loop, checkpoints, stopping |
//!
//! A model and a run, in one page: a pendulum as a model of its own (for mechanisms with bodies and
//! hinges see [`runtime::MechanismSpec`] and `assembly`).
//!
//! ```
//! use linkwork::prelude::*;
//! use linkwork::runtime::{Catalogue, PartSpec, Seconds, Simulation, Spec, Value, compile};
//!
//! /// Length and damping.
//! #[derive(Params)]
//! struct Rod {
//!     /// Length.
//!     #[param(unit = "m", range = 1e-3..)]
//!     length: f64,
//! }
//! /// The state, which is also the output.
//! #[derive(State, Clone, Copy)]
//! struct Swing {
//!     /// Angle from the vertical.
//!     #[port("rad")]
//!     angle: f64,
//!     /// Its rate.
//!     #[port("rad/s")]
//!     rate: f64,
//! }
//! struct Pendulum {
//!     p: Rod,
//! }
//! /// A point mass on a rod, released at 0.1 rad.
//! #[model("example.pendulum")]
//! impl Model for Pendulum {
//!     type Params = Rod;
//!     type Outputs = Swing;
//!     type State = Swing;
//!     fn init_x(&self) -> Swing {
//!         Swing { angle: 0.1, rate: 0.0 }
//!     }
//!     fn outputs(&self, x: &Swing) -> Swing {
//!         *x
//!     }
//!     fn derivatives(&self, x: &Swing) -> Swing {
//!         Swing { angle: x.rate, rate: -9.81 / self.p.length * x.angle.sin() }
//!     }
//! }
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let catalogue = Catalogue::new([vec![Entry::model::<Pendulum>()]]);
//! let rod = Value::Map(vec![("length".into(), Value::Text("1 m".into()).into())]);
//! let spec = Spec {
//!     parts: vec![PartSpec::new("pendulum", "example.pendulum", rod)],
//!     ..Spec::default() // RK4, steps of 1 ms
//! };
//! let mut sim = Simulation::new(compile(&spec, &catalogue, &Files::default())?.into());
//! sim.run_until(Seconds { num: 2, den: 1 })?;
//! let small_angles = 0.1 * (9.81f64.sqrt() * 2.0).cos();
//! assert!((sim.get("pendulum.angle")? - small_angles).abs() < 1e-3);
//! # Ok(())
//! # }
//! ```

pub use linkwork_assembly as assembly;
pub use linkwork_collision as collision;
pub use linkwork_dynamics as dynamics;
pub use linkwork_embedded as embedded;
pub use linkwork_formats as formats;
pub use linkwork_integrate as integrate;
pub use linkwork_multibody as multibody;
pub use linkwork_record as record;
pub use linkwork_render as render;
pub use linkwork_runner as runner;
pub use linkwork_runtime as runtime;
pub use linkwork_solvers as solvers;
pub use linkwork_spatial as spatial;
pub use linkwork_world as world;

/// What the author of models needs in scope: the traits, the derives, ports, services, vectors.
pub mod prelude {
    pub use linkwork_runtime::prelude::*;
}
