//! References to bodies and nodes, resolved from the inside outward.
//!
//! `wheel`, `wheel/hub`, a mount, `Arm/link1`, `Arm.Gripper/finger/tip`; a leading `/` starts at
//! the top: `/Rover/chassis`.
use crate::expand::instance::{Instance, Node};
use crate::text::value::{entries, full_name, join, outer};
use linkwork_runtime::remedy;

/// Target of a reference.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Target {
    World,
    /// An element that could not be read, which is reported elsewhere.
    Unknown,
    /// A body, by full name.
    Body(String),
    /// A node, by the full name of its body and its own.
    Node(String, String),
}

/// Resolves a reference in the scope of the instance at a path; the error contains fact and remedy.
pub(crate) fn resolve(
    root: &Instance,
    scope: &str,
    text: &str,
) -> Result<Target, (String, String)> {
    if text == "world" {
        return Ok(Target::World);
    }
    if text.contains('$') {
        return Ok(Target::Unknown);
    }
    let absolute = text.strip_prefix('/');
    let pieces: Vec<&str> = absolute.unwrap_or(text).split('/').collect();
    let mut here = if absolute.is_some() { "" } else { scope };
    loop {
        if let Some(instance) = root.at(here)
            && let Some(found) = inside(root, instance, &pieces)
        {
            return found;
        }
        if here.is_empty() {
            break;
        }
        here = outer(here);
    }
    let known = visible(root, scope);
    let known: Vec<&str> = known.iter().map(String::as_str).chain(["world"]).collect();
    Err((format!("there is no body `{text}`"), remedy(text, "bodies", &known)))
}

/// Resolves a reference inside an instance. `None`: it does not contain the name, so the search continues outward.
fn inside(
    root: &Instance,
    here: &Instance,
    pieces: &[&str],
) -> Option<Result<Target, (String, String)>> {
    let first = pieces[0];
    if here.bodies.contains_key(first) {
        return Some(on_body(root, &full_name(&here.path, first), &pieces[1..]));
    }
    if let Some(bound) = here.mounts.get(first) {
        // The text of a mount is a reference in the scope of the parent.
        let around = outer(&here.path);
        return Some(match (resolve(root, around, &bound.text), &pieces[1..]) {
            (Ok(Target::Body(body)), rest) => on_body(root, &body, rest),
            (Ok(target), []) => Ok(target),
            (Ok(Target::Unknown), _) => Ok(Target::Unknown),
            (Ok(_), _) => Err((
                format!("mount `{first}` is bound to `{}`, which does not have nodes", bound.text),
                "bind the mount to a body".into(),
            )),
            // The binding in the parent reports this error, so do not report it again.
            (Err(_), _) => Ok(Target::Unknown),
        });
    }
    if here.is_broken(first) {
        return Some(Ok(Target::Unknown));
    }
    let below = here.at(first)?;
    match pieces.get(1) {
        Some(body) if below.bodies.contains_key(*body) => {
            Some(on_body(root, &full_name(&below.path, body), &pieces[2..]))
        }
        Some(body) => {
            let known: Vec<&str> = below.bodies.keys().map(String::as_str).collect();
            let fact = format!("`{}` has no body `{body}`", below.path);
            Some(Err((fact, remedy(body, "bodies", &known))))
        }
        None => {
            let known: Vec<String> = below.bodies.keys().map(|b| format!("{first}/{b}")).collect();
            let fact = format!("`{first}` is an assembly, not a body");
            Some(Err((fact, format!("use one of its bodies: {}", known.join(", ")))))
        }
    }
}

/// Returns the full name of the loop in a reference: `coupler`, `Arm/coupler`, `/Arm/coupler`; `None` if it could not be read.
pub(crate) fn resolve_loop(
    root: &Instance,
    scope: &str,
    text: &str,
) -> Result<Option<String>, (String, String)> {
    if text.contains('$') {
        return Ok(None);
    }
    let absolute = text.strip_prefix('/');
    let (below, name) =
        absolute.unwrap_or(text).rsplit_once('/').unwrap_or(("", absolute.unwrap_or(text)));
    let mut here = if absolute.is_some() { "" } else { scope };
    let mut known = Vec::new();
    loop {
        if let Some(instance) = root.at(here) {
            if !below.is_empty() && instance.is_broken(below) {
                return Ok(None);
            }
            if let Some(found) = instance.at(below).filter(|i| i.loops.contains_key(name)) {
                return Ok(Some(full_name(&found.path, name)));
            }
            let mut inner = Vec::new();
            instance.walk(&mut inner);
            for i in inner {
                let path = i.path.strip_prefix(here).unwrap_or(&i.path).trim_start_matches('.');
                known.extend(i.loops.keys().map(|l| full_name(path, l)));
            }
        }
        if here.is_empty() {
            break;
        }
        here = outer(here);
    }
    known.dedup();
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    Err((format!("there is no loop `{text}`"), remedy(text, "loops", &known)))
}

fn on_body(root: &Instance, full: &str, rest: &[&str]) -> Result<Target, (String, String)> {
    match rest {
        [] => Ok(Target::Body(full.to_string())),
        [node] => {
            let nodes = nodes(root, full);
            if nodes.iter().any(|n| n == node) {
                return Ok(Target::Node(full.to_string(), (*node).to_string()));
            }
            let known: Vec<&str> = nodes.iter().map(String::as_str).collect();
            Err((format!("body `{full}` has no node `{node}`"), remedy(node, "nodes", &known)))
        }
        _ => Err((
            format!("`{full}/{}` has too many slashes", rest.join("/")),
            "write assembly/body/node".into(),
        )),
    }
}

fn nodes(root: &Instance, full: &str) -> Vec<String> {
    let (path, body) = full.rsplit_once('/').unwrap_or(("", full));
    let fields = root.at(path).and_then(|i| i.bodies.get(body)).map(|b| &b.fields);
    let nodes = fields.and_then(|f| f.get("nodes"));
    nodes.map(entries).unwrap_or_default().iter().map(|(k, _)| k.clone()).collect()
}

/// Returns the bodies that are visible in a scope, each by its shortest name.
pub(crate) fn visible(root: &Instance, scope: &str) -> Vec<String> {
    let mut out: Vec<(String, String)> = Vec::new();
    let mut here = scope;
    loop {
        if let Some(i) = root.at(here) {
            out.extend(i.bodies.keys().map(|b| (b.clone(), full_name(&i.path, b))));
            out.extend(i.mounts.keys().map(|m| (m.clone(), join(&i.path, m))));
            below(i, "", &mut out);
        }
        if here.is_empty() {
            break;
        }
        here = outer(here);
    }
    let mut seen = std::collections::BTreeSet::new();
    out.retain(|(_, full)| seen.insert(full.clone()));
    out.into_iter().map(|(name, _)| name).collect()
}

fn below(here: &Instance, prefix: &str, out: &mut Vec<(String, String)>) {
    for (name, node) in &here.parts {
        if let Node::Assembly(inner) = node {
            let prefix = join(prefix, name);
            let named = |b: &String| (format!("{prefix}/{b}"), full_name(&inner.path, b));
            out.extend(inner.bodies.keys().map(named));
            below(inner, &prefix, out);
        }
    }
}
