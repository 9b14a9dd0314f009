//! Frames of a mechanism that parts bind to.
use linkwork_multibody::{BodyId, Multibody, NodeId};

/// A frame that carries ports: a node, or a body's own origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Frame {
    /// A named node.
    Node(NodeId),
    /// A body's origin.
    Body(BodyId),
}

impl Frame {
    /// The body that carries it.
    pub(crate) fn body(self, mb: &Multibody) -> BodyId {
        match self {
            Frame::Node(n) => mb.nodes()[n.index()].body(),
            Frame::Body(b) => b,
        }
    }
}
