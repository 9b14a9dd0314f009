//! Integrators over flat states: a method is a table, the drivers are written once over it.
//!
//! * [`Integrator::step_fixed`] takes a step of a given size;
//! * [`Integrator::advance`] takes one accepted step of a size that it chooses, cut so as to end
//!   where the caller asks; what it must remember is [`Memory`], plain data of the caller;
//! * [`Integrator::dense`] is the solution within the last accepted step;
//! * [`events::first_crossing`] finds where a guard changes its sign.
//!
//! The system is seen through [`System`]: slices of f64, time in seconds. Nothing is allocated
//! after [`Integrator::new`]; the same input gives the same bits.

pub mod adaptive;
mod coefficients;
mod combine;
pub mod dense;
pub mod errors;
pub mod events;
mod explicit;
pub mod integrator;
mod lu;
pub mod method;
mod rosenbrock;
pub mod system;
pub mod tolerances;
mod work;

pub use adaptive::{Accepted, Control, Limits, Memory};
pub use dense::Dense;
pub use errors::{Failure, Setup};
pub use integrator::Integrator;
pub use method::{Explicit, METHODS, Method, Rosenbrock};
pub use system::{At, Field, System};
pub use tolerances::{Norm, Tolerances};
