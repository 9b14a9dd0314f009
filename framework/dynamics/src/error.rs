//! What can go wrong in an algorithm.

use thiserror::Error;

/// Why an algorithm has no answer.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DynamicsError {
    /// A free subhinge moves nothing that has inertia (or the state is not finite).
    #[error(
        "body `{body}`, coordinate {v}: no inertia to move, or a state that is not finite\n  \
         help: give it or a body outboard of it mass, or the subhinge an armature, or prescribe it"
    )]
    Singular {
        /// The body whose hinge it is.
        body: String,
        /// First place in β of the subhinge.
        v: usize,
    },
    /// An algorithm that is only for rigid bodies.
    #[error(
        "{what}: body `{body}` is flexible, and this is only for rigid mechanisms\n  help: leave its modes \
         out, or use the dynamics, Jacobians and matrices that take flexible bodies"
    )]
    Flexible {
        /// The first flexible body.
        body: String,
        /// The algorithm.
        what: &'static str,
    },
}

/// What is wrong with numbers that were given.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum InputError {
    /// Too few or too many numbers.
    #[error("`{what}` has {got} numbers, the mechanism has {want}\n  help: give {want} numbers")]
    Length {
        /// The input.
        what: String,
        /// Numbers given.
        got: usize,
        /// Numbers wanted.
        want: usize,
    },
    /// A number that is NaN or infinite.
    #[error("`{what}`: number {place} is {value}\n  help: give finite numbers")]
    NotFinite {
        /// The input.
        what: String,
        /// Which of its numbers, from 0.
        place: usize,
        /// The number.
        value: f64,
    },
    /// A quaternion without a direction.
    #[error(
        "`q`: the quaternion at index {place} has length zero\n  help: give x y z w, with w = 1 for no rotation"
    )]
    ZeroQuaternion {
        /// Place in q of its first number.
        place: usize,
    },
    /// The numbers are sound, the mechanism is not.
    #[error(transparent)]
    Dynamics(DynamicsError),
}
