//! The assembly tree for `linkwork tree`: names, kinds, documentation.
use crate::expand::instance::{Instance, Node};
use crate::text::value::full_name;
use linkwork_runtime::Catalogue;

/// A part or assembly with its content.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeNode {
    /// Last segment of the path.
    pub name: String,
    /// Whole path.
    pub path: String,
    /// Its kind.
    pub kind: TreeKind,
    /// Documentation of the part, or of its model or assembly.
    pub doc: String,
    /// Full names of its own bodies.
    pub bodies: Vec<String>,
    /// Parts, by name.
    pub children: Vec<TreeNode>,
}

/// Kind of a node of the tree.
#[derive(Clone, Debug, PartialEq)]
pub enum TreeKind {
    /// A model or service, by its name in the catalogue.
    Model(String),
    /// An assembly, by its file (or `inline`).
    Assembly(String),
}

/// Returns the tree of an instance.
pub(crate) fn tree(here: &Instance, catalogue: &Catalogue) -> TreeNode {
    let name = here.path.rsplit('.').next().unwrap_or("").to_string();
    let children = here.parts.iter().map(|(name, node)| match node {
        Node::Assembly(inner) => tree(inner, catalogue),
        Node::Model(m) => {
            let known = catalogue.get(&m.model.text);
            let doc =
                if m.doc.is_empty() { known.map_or("", |e| &*e.description.doc) } else { &m.doc };
            TreeNode {
                name: name.clone(),
                path: m.path.clone(),
                kind: TreeKind::Model(m.model.text.clone()),
                doc: doc.to_string(),
                bodies: Vec::new(),
                children: Vec::new(),
            }
        }
    });
    TreeNode {
        name,
        path: here.path.clone(),
        kind: TreeKind::Assembly(here.kind.clone()),
        doc: here.doc.clone(),
        bodies: here.bodies.keys().map(|b| full_name(&here.path, b)).collect(),
        children: children.collect(),
    }
}
