//! Loads of hinges that are reported, and their lanes.
use linkwork_multibody::BodyId;
use std::ops::Range;

/// Signal lanes of force and moment.
pub(crate) const LANES: usize = 6;

/// The hinge of a body whose load is computed.
#[derive(Clone, Debug)]
pub(crate) struct Reaction {
    pub body: BodyId,
    /// Places in β with an effort; none where a locked hinge stands as a coordinate that never moves.
    pub effort: Range<usize>,
}
