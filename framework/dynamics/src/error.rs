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
}
