//! Separate colliders, in `colliders`.
use crate::body::collider::{self, Collider, Surface};
use crate::body::shapes::BodyShape;
use crate::body::solid::{colliding, only_collides, seen};
use crate::expand::instance::{Instance, ItemInst};
use crate::mechanism::anchor::{Bodies, anchor};
use crate::schema::kind::{At, Kind};
use crate::schema::record::Record;
use crate::text::files::Files;
use crate::text::report::Cx;
use crate::text::value::full_name;
use linkwork_runtime::Value;
use linkwork_spatial::Pose;
use std::collections::BTreeMap;

/// Result of `colliders`.
#[derive(Default)]
pub(crate) struct Standing {
    pub colliders: Vec<Collider>,
    pub shapes: Vec<BodyShape>,
    /// Full name → reference of its body from the top level.
    pub references: BTreeMap<String, String>,
}

/// Returns all entries of all `colliders`.
pub(crate) fn standing(
    cx: &mut Cx,
    root: &Instance,
    instances: &[&Instance],
    files: &Files<'_>,
    bodies: &Bodies,
) -> Standing {
    let mut out = Standing::default();
    for here in instances {
        for (name, item) in &here.colliders {
            let full = full_name(&here.path, name);
            one(cx, root, (here, &full, item), files, bodies, &mut out);
        }
    }
    out
}

fn one(
    cx: &mut Cx,
    root: &Instance,
    (here, full, item): (&Instance, &str, &ItemInst),
    files: &Files<'_>,
    bodies: &Bodies,
    out: &mut Standing,
) {
    let at = At::new(format!("collider `{full}`")).origin(item.origin).among((files, &item.home));
    let read = <(collider::Standing, Surface)>::read(cx, &item.fields, &at);
    let Some((form, surface)) = read else { return };
    let on = form.on.as_ref();
    let found = on.and_then(|on| anchor(cx, root, bodies, (&here.path, on), &at.field("on").what));
    // Mesh files are only shown on bodies, because the resolved text contains the triangles instead of the file.
    let mesh = matches!(&form.shape.value, Value::Variant(kind, _) if kind == "Mesh");
    let shown = form.visible && !mesh && !only_collides(&form.shape);
    let shown = match shown.then(|| seen().read(cx, &form.shape, &at)) {
        None => None,
        Some(None) => return,
        Some(shown) => shown,
    };
    let geometry = colliding().read(cx, &form.shape, &at);
    let (Some(found), Some((geometry, turn))) = (found, geometry) else { return };
    let frame = found.node.map_or(form.at, |node| node * form.at);
    out.references.insert(full.into(), found.reference);
    if let Some((shape, turn)) = shown {
        let pose = frame * Pose::rotation(turn);
        // Names of shapes are unique on their body; names of colliders must be unique everywhere.
        let (body, color, name) = (found.body.clone(), form.color, full.into());
        out.shapes.push(BodyShape { body, pose, shape, color, name });
    }
    let X = frame * Pose::rotation(turn);
    out.colliders.push(Collider::new(full, &found.body, X, geometry, surface, item.origin));
}
