//! Failures of evaluations.
use crate::author::block::Failure;

/// Cause of a failed evaluation: the block and its message.
#[derive(Clone, Debug)]
pub(super) struct Stopped {
    pub block: u32,
    pub failure: Box<Failure>,
}

/// Adds the block to a failure.
pub(super) fn of(block: u32) -> impl Fn(Box<Failure>) -> Stopped {
    move |failure| Stopped { block, failure }
}
