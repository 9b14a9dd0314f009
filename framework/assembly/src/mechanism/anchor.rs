//! References of loops, colliders and bindings: bodies, nodes and coordinates.
use crate::body::Body;
use crate::expand::instance::Instance;
use crate::expand::reference::{Target, resolve};
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_spatial::Pose;
use std::collections::BTreeMap;
use std::fmt::Display;

/// Fact and remedy.
pub(crate) type Problem = (String, String);

/// Splits `name[k]` into the name and k (default: 0).
pub(crate) fn indexed(text: &str) -> Result<(&str, usize), Problem> {
    match text.trim().strip_suffix(']').and_then(|h| h.rsplit_once('[')) {
        Some((name, digits)) => match digits.parse() {
            Ok(index) => Ok((name, index)),
            Err(_) => {
                let fact = format!("`{digits}` is not the number of a coordinate");
                Err((fact, "write hinge:body[0]".to_string()))
            }
        },
        None => Ok((text.trim(), 0)),
    }
}

pub(crate) fn no_world() -> Problem {
    ("the world has neither nodes nor hinges".to_string(), "bind to a body".to_string())
}

/// Resolves `body` or `body[k]`: the body's full name and the index among its one-dof coordinates; `None` if it could not be read.
pub(crate) fn coordinate(
    root: &Instance,
    scope: &str,
    text: &str,
) -> Result<Option<(String, usize)>, Problem> {
    let (name, index) = indexed(text)?;
    match resolve(root, scope, name)? {
        Target::Unknown => Ok(None),
        Target::Body(body) => Ok(Some((body, index))),
        Target::Node(body, node) => Err((
            format!("`{name}` is the node `{node}` of `{body}`; a hinge is named by its body"),
            format!("write \"hinge:{}\"", name.rsplit_once('/').map_or(name, |(b, _)| b)),
        )),
        Target::World => Err(no_world()),
    }
}

/// A body, a node on a body, or the world.
pub(crate) struct Anchor {
    /// Full name, or `world`.
    pub body: String,
    /// The node's pose, if it is a node.
    pub node: Option<Pose>,
    /// Its reference from the top level.
    pub reference: String,
}

/// Resolves a body or node; `None` if it does not exist (a fault is added) or could not be read.
pub(crate) fn anchor(
    cx: &mut Cx,
    root: &Instance,
    bodies: &Bodies,
    (scope, text): (&str, &Text),
    what: impl Display,
) -> Option<Anchor> {
    match resolve(root, scope, &text.text) {
        Ok(Target::World) => {
            Some(Anchor { body: "world".into(), node: None, reference: "world".into() })
        }
        Ok(Target::Unknown) => None,
        Ok(Target::Body(p)) => {
            Some(Anchor { body: p.clone(), node: None, reference: format!("/{p}") })
        }
        Ok(Target::Node(p, node)) => {
            let pose = bodies.get(&p).and_then(|(b, _)| b.nodes.iter().find(|n| n.0 == node));
            let reference = format!("/{p}/{node}");
            Some(Anchor { body: p, node: pose.map(|n| n.1), reference })
        }
        Err((fact, help)) => {
            cx.fault(text.origin, format!("{what}: {fact}"), help);
            None
        }
    }
}

/// Bodies by full name, each with the path of its assembly.
pub(crate) type Bodies = BTreeMap<String, (Body, String)>;

/// Resolves a one-dof coordinate: body, index among its one-dof coordinates, and index of the subhinge.
pub(crate) fn one_dof(
    cx: &mut Cx,
    root: &Instance,
    scope: &str,
    bodies: &Bodies,
    (written, what): (&Text, &dyn Display),
) -> Option<(String, usize, usize)> {
    let name = written.text.strip_prefix("hinge:").unwrap_or(&written.text);
    let (body, index) = match coordinate(root, scope, name) {
        Ok(found) => found?,
        Err((fact, help)) => {
            cx.fault(written.origin, format!("{what}: {fact}"), help);
            return None;
        }
    };
    let chain = &bodies.get(&body)?.0.hinge.subhinges;
    let all: Vec<usize> =
        chain.iter().enumerate().filter(|(_, s)| s.kind.nv() == 1).map(|(k, _)| k).collect();
    let Some(subhinge) = all.get(index) else {
        let message = format!(
            "{what}: the hinge of `{body}` has {} one-dof coordinates, not {}",
            all.len(),
            index + 1
        );
        cx.fault(written.origin, message, "use a pin, slider or screw");
        return None;
    };
    Some((body, index, *subhinge))
}
