//! Indices of bodies and nodes. Only a mechanism creates them, for its own bodies and nodes.

use serde::Serialize;

/// A body of one [`Multibody`](crate::Multibody): its index in canonical order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct BodyId(pub(crate) u32);

/// A node of one [`Multibody`](crate::Multibody).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct NodeId(pub(crate) u32);

impl BodyId {
    /// Returns the index in the canonical order of bodies.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl NodeId {
    /// Returns the index in the canonical order of nodes.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}
