//! Integrators for flat states. Each method is a table of coefficients, shared by common drivers.
//!
//! * [`Integrator::step_fixed`] makes a step of a given size.
//! * [`Integrator::advance`] makes one accepted step of a size that it chooses, cut to end where the caller requests. Its state between steps is
//!   [`Memory`], plain data of the caller.
//! * [`Integrator::dense`] returns the solution within the last accepted step, and [`Integrator::again`] repeats this step with another length.
//! * [`events::first_crossing`] locates the time at which a guard reaches its threshold, zero.
//!
//! The system implements [`System`]: slices of f64, time in seconds. A *lane* is one number of the state. [`Integrator::new`] makes all allocations.
//! The same input gives bit-identical results.
//! ```
//! use linkwork_integrate::{Failure, Integrator, Method, System};
//!
//! /// ẍ = −x.
//! struct Spring;
//! impl System for Spring {
//!     type Error = std::convert::Infallible;
//!     fn derivatives(&mut self, _: f64, x: &[f64], xdot: &mut [f64]) -> Result<(), Self::Error> {
//!         (xdot[0], xdot[1]) = (x[1], -x[0]);
//!         Ok(())
//!     }
//! }
//!
//! # fn main() -> Result<(), Failure<std::convert::Infallible>> {
//! let mut rk4 = Integrator::new(Method::by_name("rk4").expect("a method"), 2);
//! let (mut x, h) = ([1.0, 0.0], 0.01);
//! for k in 0..100 {
//!     rk4.step_fixed(&mut Spring, k as f64 * h, h, &mut x, None)?;
//! }
//! assert!((x[0] - 1f64.cos()).abs() < 1e-10);
//! # Ok(())
//! # }
//! ```

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
mod tableau;
pub mod tolerances;
mod work;

pub use adaptive::{Accepted, Control, Limits, Memory};
pub use dense::Dense;
pub use errors::{Failure, Setup};
pub use integrator::Integrator;
pub use method::{METHODS, Method};
pub use system::{At, Field, System};
pub use tableau::{Explicit, Rosenbrock};
pub use tolerances::{Norm, Tolerances};
