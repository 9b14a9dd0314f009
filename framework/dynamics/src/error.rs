//! Errors of the algorithms.

use thiserror::Error;

/// Reason why an algorithm has no result.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DynamicsError {
    /// A free subhinge moves no inertia (or the state is not finite).
    #[error(
        "body `{body}`, coordinate {v}: the hinge moves no inertia, or the state is not finite\n  \
         help: add mass to the body or to a body outboard of it, add an armature to the subhinge, or prescribe its motion"
    )]
    Singular {
        /// The body of the hinge.
        body: String,
        /// First index in β of the subhinge.
        v: usize,
    },
    /// An algorithm that supports only rigid bodies.
    #[error(
        "{what} supports only rigid mechanisms, but body `{body}` is flexible\n  help: remove its modes, or use the dynamics, Jacobians and matrices that support flexible bodies"
    )]
    Flexible {
        /// The first flexible body.
        body: String,
        /// The algorithm.
        what: &'static str,
    },
}

/// A fault of given numbers.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum InputError {
    /// Too few or too many numbers.
    #[error("`{what}` has {got} numbers, the mechanism has {want}\n  help: give {want} numbers")]
    Length {
        /// The input.
        what: String,
        /// Length of the input.
        got: usize,
        /// Required length.
        want: usize,
    },
    /// A number that is NaN or infinite.
    #[error("`{what}`: number {place} is {value}\n  help: give finite numbers")]
    NotFinite {
        /// The input.
        what: String,
        /// Index of the number, from 0.
        place: usize,
        /// The number.
        value: f64,
    },
    /// A quaternion of length zero.
    #[error(
        "`q`: the quaternion at index {place} has length zero\n  help: give x y z w, with w = 1 for no rotation"
    )]
    ZeroQuaternion {
        /// Index in q of its first number.
        place: usize,
    },
    /// The numbers are valid, but the mechanism has no solution.
    #[error(transparent)]
    Dynamics(DynamicsError),
}
