//! Colliders that stand on their own: those of `colliders`.
use crate::body::collider::{self, Collider};
use crate::body::shapes::BodyShape;
use crate::body::{geometry, solid};
use crate::expand::instance::{Instance, ItemInst};
use crate::mechanism::anchor::{Bodies, anchor};
use crate::schema::pose::pose;
use crate::schema::read::{fields, flag, text};
use crate::text::files::Files;
use crate::text::report::Cx;
use crate::text::value::full_name;
use linkwork_runtime::Value;
use linkwork_spatial::Pose;
use std::collections::BTreeMap;

/// What `colliders` give.
#[derive(Default)]
pub(crate) struct Standing {
    pub colliders: Vec<Collider>,
    pub shapes: Vec<BodyShape>,
    /// Full name → reference of its body from the top.
    pub references: BTreeMap<String, String>,
}

/// Every entry of every `colliders`.
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
    let (what, v) = (format!("collider `{full}`"), &item.fields);
    let place = (files, &item.home);
    fields(cx, v, &what, &collider::FIELDS);
    let on = match v.get("on") {
        Some(t) => text(cx, t, &format!("{what}: `on`")),
        None => {
            cx.fault(
                item.origin,
                format!("{what} has no `on`"),
                "write `on: \"world\"`, or a body",
            );
            None
        }
    };
    let found =
        on.and_then(|t| anchor(cx, root, bodies, (&here.path, &t), &format!("{what}: `on`")));
    let X = pose(cx, v.get("at"), &format!("{what}: `at`"));
    let color = v.get("color").and_then(|c| solid::rgba(cx, c, &what));
    let visible = v.get("visible").and_then(|s| flag(cx, s, &format!("{what}: `visible`")));
    let Some(solid) = v.get("shape") else {
        cx.fault(item.origin, format!("{what} has no `shape`"), "write `shape: HalfSpace`");
        return;
    };
    // A mesh is seen on a body alone: the resolved text holds its triangles and no file.
    let mesh = matches!(&solid.value, Value::Variant(kind, _) if kind == "Mesh");
    let seen = visible != Some(false) && !mesh && !geometry::only_collides(solid);
    let shown = if seen { solid::shape(cx, solid, &what, Some(place)) } else { None };
    let geometry = match (&shown, seen) {
        (None, true) => None,
        _ => geometry::read(cx, solid, &what, Some(place)),
    };
    let options = collider::options(cx, v, &what, place);
    let (Some(found), Some((geometry, turn))) = (found, geometry) else { return };
    let frame = found.node.map_or(X, |node| node * X);
    out.references.insert(full.into(), found.reference);
    if let Some((shape, turn)) = shown {
        let pose = frame * Pose::rotation(turn);
        // Names of shapes are unique on their body; those of colliders are everywhere.
        out.shapes.push(BodyShape {
            body: found.body.clone(),
            pose,
            shape,
            color,
            name: full.into(),
        });
    }
    let X = frame * Pose::rotation(turn);
    out.colliders.push(Collider::new(full.into(), &found.body, X, geometry, options, item.origin));
}
