//! The tree of instances: assemblies and models with their paths, and with parameters replaced.
use crate::form::wire::WireText;
use crate::text::files::Home;
use crate::text::patterns::segment_matches;
use crate::text::value::Text;
use linkwork_runtime::{Located, Origin};
use std::collections::{BTreeMap, BTreeSet};

/// An instance of a model or service.
#[derive(Clone, Debug)]
pub(crate) struct ModelInst {
    pub path: String,
    pub doc: String,
    pub model: Text,
    pub params: Located,
    pub rate: Option<Located>,
    pub offset: Option<Located>,
    pub bind: Located,
    pub folder: Option<std::path::PathBuf>,
    pub origin: Origin,
}

/// An instance of a body, loop, coupling or collider, with parameters replaced.
#[derive(Clone, Debug)]
pub(crate) struct ItemInst {
    pub fields: Located,
    pub origin: Origin,
    pub home: Home,
}

/// An instance of a part.
#[derive(Clone, Debug)]
pub(crate) enum Node {
    Model(ModelInst),
    Assembly(Instance),
}

/// An instance of an assembly.
#[derive(Clone, Debug)]
pub(crate) struct Instance {
    pub path: String,
    /// File, or `inline`.
    pub kind: String,
    pub doc: String,
    pub parts: BTreeMap<String, Node>,
    pub arrays: BTreeMap<String, Vec<String>>,
    pub bodies: BTreeMap<String, ItemInst>,
    pub loops: BTreeMap<String, ItemInst>,
    pub couplings: BTreeMap<String, ItemInst>,
    pub colliders: BTreeMap<String, ItemInst>,
    pub contact: Option<Located>,
    pub self_collision: Option<Located>,
    pub ignore: Option<Located>,
    pub mounts: BTreeMap<String, Text>,
    pub exports: BTreeMap<String, Text>,
    pub wires: Vec<WireText>,
    pub connect: Vec<Vec<Text>>,
    /// Names of the parameters, for messages.
    pub params: Vec<String>,
    /// Parts that could not be read or found; references to them do not cause further faults.
    pub broken: BTreeSet<String>,
}

impl Instance {
    /// Returns the instance at a path below this one (`""`: itself).
    pub fn at(&self, path: &str) -> Option<&Instance> {
        let mut here = self;
        for segment in path.split('.').filter(|s| !s.is_empty()) {
            match here.parts.get(segment)? {
                Node::Assembly(next) => here = next,
                Node::Model(_) => return None,
            }
        }
        Some(here)
    }

    /// Returns true if a path leads into a part that could not be read.
    pub fn is_broken(&self, path: &str) -> bool {
        let mut here = self;
        for segment in path.split('.') {
            if here.broken.iter().any(|b| segment_matches(segment, b)) {
                return true;
            }
            match here.parts.get(segment) {
                Some(Node::Assembly(next)) => here = next,
                _ => return false,
            }
        }
        false
    }

    /// Collects all instances, this one first, in path order.
    pub fn walk<'i>(&'i self, out: &mut Vec<&'i Instance>) {
        out.push(self);
        for node in self.parts.values() {
            if let Node::Assembly(inner) = node {
                inner.walk(out);
            }
        }
    }
}
