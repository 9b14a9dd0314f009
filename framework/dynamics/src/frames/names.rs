//! Look-up of frames by body, node or name, and their names in error messages.

use super::{FrameId, Frames, FramesError, Mechanism, MechanismId};
use linkwork_multibody::{BodyId, NodeId};

/// Name of a frame.
#[derive(Clone, Debug)]
pub(super) enum Name {
    World,
    Body(u32, BodyId),
    Node(u32, NodeId),
    /// Between two subhinges of a body.
    Inside(u32, BodyId),
    Own(String),
}

impl Frames {
    /// Returns the frame of a body.
    ///
    /// # Errors
    /// [`FramesError::Unknown`].
    pub fn body(&self, mechanism: MechanismId, body: BodyId) -> Result<FrameId, FramesError> {
        let m = self.mechanism(mechanism)?;
        m.bodies.get(body.index()).copied().ok_or_else(|| unknown("body", body.index(), m))
    }

    /// Returns the frame of a node.
    ///
    /// # Errors
    /// [`FramesError::Unknown`].
    pub fn node(&self, mechanism: MechanismId, node: NodeId) -> Result<FrameId, FramesError> {
        let m = self.mechanism(mechanism)?;
        m.nodes.get(node.index()).copied().ok_or_else(|| unknown("node", node.index(), m))
    }

    /// Returns the frame of the body with the given name. O(log n).
    ///
    /// # Errors
    /// [`FramesError::Unknown`].
    pub fn body_named(&self, mechanism: MechanismId, name: &str) -> Result<FrameId, FramesError> {
        let m = self.mechanism(mechanism)?;
        m.multibody.body(name).map(|b| m.bodies[b.index()]).ok_or_else(|| unknown("body", name, m))
    }

    /// Returns the frame of the node with the given name. O(log n).
    ///
    /// # Errors
    /// [`FramesError::Unknown`].
    pub fn node_named(&self, mechanism: MechanismId, name: &str) -> Result<FrameId, FramesError> {
        let m = self.mechanism(mechanism)?;
        m.multibody.node(name).map(|n| m.nodes[n.index()]).ok_or_else(|| unknown("node", name, m))
    }

    /// Returns the frame that was added with the given name. O(log n).
    ///
    /// # Errors
    /// [`FramesError::Unknown`].
    pub fn named(&self, name: &str) -> Result<FrameId, FramesError> {
        self.own.get(name).copied().ok_or_else(|| FramesError::Unknown {
            what: "frame",
            name: name.to_owned(),
            help: format!("there are {:?}", self.own.keys().take(20).collect::<Vec<_>>()),
        })
    }

    pub(super) fn check(&self, frame: FrameId) -> Result<(), FramesError> {
        if frame.index() < self.edges.len() {
            return Ok(());
        }
        Err(FramesError::Unknown {
            what: "frame",
            name: format!("number {}", frame.0),
            help: format!("there are {} frames; use an id from these `Frames`", self.edges.len()),
        })
    }

    pub(super) fn mechanism(&self, id: MechanismId) -> Result<&Mechanism, FramesError> {
        self.mechanisms.get(id.0 as usize).ok_or_else(|| FramesError::Unknown {
            what: "mechanism",
            name: format!("number {}", id.0),
            help: format!(
                "there are {} mechanisms; use an id from these `Frames`",
                self.mechanisms.len()
            ),
        })
    }

    pub(super) fn name(&self, frame: FrameId) -> String {
        let mechanism = |m: &u32| &self.mechanisms[*m as usize];
        match &self.names[frame.index()] {
            Name::World => "world".to_owned(),
            Name::Body(m, b) | Name::Inside(m, b) => {
                mechanism(m).multibody.get(*b).name().to_owned()
            }
            Name::Node(m, n) => mechanism(m).multibody.get_node(*n).name().to_owned(),
            Name::Own(name) => name.clone(),
        }
    }

    pub(super) fn label(&self, frame: FrameId) -> String {
        let what = match &self.names[frame.index()] {
            Name::World => return "the world".to_owned(),
            Name::Body(..) | Name::Inside(..) => "body",
            Name::Node(..) => "node",
            Name::Own(_) => "frame",
        };
        format!("{what} `{}`", self.name(frame))
    }
}

fn unknown(what: &'static str, name: impl std::fmt::Display, m: &Mechanism) -> FramesError {
    let counts = (m.bodies.len(), m.nodes.len());
    let help = format!("mechanism `{}` has {} bodies and {} nodes", m.name, counts.0, counts.1);
    FramesError::Unknown { what, name: name.to_string(), help }
}
