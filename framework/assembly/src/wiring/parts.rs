//! Parts and bindings of the flat `Spec`.
use crate::expand::instance::{Instance, ModelInst, Node};
use crate::expand::reference::{Target, resolve, resolve_loop};
use crate::mechanism::anchor::{Problem, coordinate, indexed, no_world};
use crate::schema::read::{period, text};
use crate::text::report::Cx;
use crate::text::value::{entries, outer};
use linkwork_runtime::{BindSpec, BindTarget, Located, Origin, PartSpec, Seconds};

/// Returns all models of the tree, in path order.
pub(crate) fn models(root: &Instance) -> Vec<&ModelInst> {
    fn walk<'i>(here: &'i Instance, out: &mut Vec<&'i ModelInst>) {
        for node in here.parts.values() {
            match node {
                Node::Model(m) => out.push(m),
                Node::Assembly(inner) => walk(inner, out),
            }
        }
    }
    let mut out = Vec::new();
    walk(root, &mut out);
    out.sort_by(|a, b| a.path.cmp(&b.path));
    out
}

/// Parts by path.
pub(crate) fn parts(cx: &mut Cx, root: &Instance) -> Vec<PartSpec> {
    models(root)
        .into_iter()
        .map(|m| {
            let rate = m.rate.as_ref().and_then(|v| period(cx, v, format!("`{}`: `rate`", m.path)));
            let offset =
                m.offset.as_ref().and_then(|v| period(cx, v, format!("`{}`: `offset`", m.path)));
            PartSpec {
                path: m.path.clone(),
                model: m.model.text.clone(),
                model_origin: m.model.origin,
                params: Located {
                    value: m.params.value.clone(),
                    // Faults about missing parameters refer to the part.
                    origin: match m.params.origin {
                        Origin::NONE => m.origin,
                        origin => origin,
                    },
                },
                rate,
                rate_origin: m.rate.as_ref().map_or(m.origin, |r| r.origin),
                offset: offset.unwrap_or(Seconds::ZERO),
                origin: m.origin,
                folder: m.folder.clone(),
            }
        })
        .collect()
}

/// Returns bindings by part and name.
pub(crate) fn binds(cx: &mut Cx, root: &Instance) -> Vec<BindSpec> {
    let mut out = Vec::new();
    for m in models(root) {
        let scope = outer(&m.path);
        for (bind, v) in entries(&m.bind) {
            let what = format!("`{}`: binding `{bind}`", m.path);
            let Some(t) = text(cx, v, &what) else { continue };
            match bind_target(root, scope, &t.text) {
                Ok(None) => {}
                Ok(Some(target)) => out.push(BindSpec {
                    part: m.path.clone(),
                    bind: bind.clone(),
                    target,
                    origin: t.origin,
                }),
                Err((fact, help)) => cx.fault(t.origin, format!("{what}: {fact}"), help),
            }
        }
    }
    out.sort_by(|a, b| (&a.part, &a.bind).cmp(&(&b.part, &b.bind)));
    out
}

fn bind_target(root: &Instance, scope: &str, text: &str) -> Result<Option<BindTarget>, Problem> {
    if let Some(hinge) = text.strip_prefix("hinge:") {
        let found = coordinate(root, scope, hinge)?;
        return Ok(found.map(|(body, index)| BindTarget::Hinge { body, index }));
    }
    if let Some(closure) = text.strip_prefix("loop:") {
        let (name, index) = indexed(closure)?;
        let found = resolve_loop(root, scope, name)?;
        return Ok(found.map(|name| BindTarget::Loop { name, index }));
    }
    if let Some(field) = text.strip_prefix("field:") {
        return Ok(Some(BindTarget::Field(field.trim().to_string())));
    }
    let name = text.strip_prefix("node:").unwrap_or(text).trim();
    match resolve(root, scope, name)? {
        Target::Unknown => Ok(None),
        Target::Body(body) => Ok(Some(BindTarget::Node(body))),
        Target::Node(body, node) => Ok(Some(BindTarget::Node(format!("{body}/{node}")))),
        Target::World => Err(no_world()),
    }
}
