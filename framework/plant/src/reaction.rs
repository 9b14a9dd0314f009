//! Reported loads of hinges, and their lanes.
use linkwork_multibody::BodyId;
use std::ops::Range;

/// Signal lanes of force and moment.
pub(crate) const LANES: usize = 6;

/// The hinge of a body whose load is computed.
#[derive(Clone, Debug)]
pub(crate) struct Reaction {
    pub body: BodyId,
    /// Indices in β with an effort; empty if a locked hinge is represented by a coordinate that never moves.
    pub effort: Range<usize>,
}
