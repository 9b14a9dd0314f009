//! A body with numbers: from fields whose parameters have been replaced.
pub(crate) mod collider;
pub(crate) mod geometry;
pub(crate) mod hinge;
pub(crate) mod initial;
pub(crate) mod mass;
pub(crate) mod modes;
pub(crate) mod shapes;
pub(crate) mod solid;
mod stl;

use crate::body::collider::Collider;
use crate::body::mass::read_mass;
use crate::body::shapes::{BodyShape, Shapes, shapes};
use crate::schema::pose::pose;
use crate::schema::read::{fields, name, table, text_field};
use crate::text::files::Near;
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_multibody::{Hinge, Modes};
use linkwork_runtime::{Located, Origin};
use linkwork_spatial::{MassProperties, Pose};

/// A body, ready but for its parent's name.
pub(crate) struct Body {
    pub name: String,
    pub parent: Text,
    pub at: Pose,
    pub hinge_frame: Pose,
    pub hinge: Hinge,
    pub mass: MassProperties,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub shapes: Vec<BodyShape>,
    /// Place in `shapes`, collider.
    pub colliders: Vec<(usize, Collider)>,
    pub nodes: Vec<(String, Pose, Origin)>,
    pub origin: Origin,
    /// Where mass and inertia are written, for faults about them.
    pub inertia_origin: Origin,
    /// How it bends.
    pub modes: Option<Modes>,
    pub modes_origin: Origin,
}

/// The fields of a body.
pub(crate) const FIELDS: [&str; 20] = [
    "parent",
    "at",
    "hinge",
    "hinge_frame",
    "prescribed",
    "armature",
    "gear",
    "limits",
    "stop",
    "damping",
    "friction",
    "mass",
    "com",
    "inertia",
    "inertia_check",
    "initial",
    "modes",
    "shapes",
    "nodes",
    "doc",
];

/// The fields of a loop.
pub(crate) const LOOP_FIELDS: [&str; 9] =
    ["a", "b", "at_a", "at_b", "hinge", "prescribed", "solve", "initial", "doc"];

/// The fields of a coupling.
pub(crate) const COUPLING_FIELDS: [&str; 8] =
    ["terms", "constant", "mimic", "of", "ratio", "offset", "solve", "doc"];

/// Reads a body; what cannot be read is recorded and left at its neutral value.
pub(crate) fn read(cx: &mut Cx, full: &str, v: &Located, origin: Origin, files: Near<'_>) -> Body {
    let what = format!("body `{full}`");
    fields(cx, v, &what, &FIELDS);
    let parent = match v.get("parent") {
        Some(_) => text_field(cx, v, "parent", &what),
        None => {
            let help = "write `parent: \"world\"`, another body, or a mount";
            cx.fault(origin, format!("{what} has no `parent`"), help);
            None
        }
    };
    let mut hinge = match v.get("hinge") {
        Some(h) => hinge::read(cx, h, &what).unwrap_or_default(),
        None => Hinge::locked(),
    };
    hinge::options(cx, v, &what, &mut hinge.subhinges);
    let (q, rates) = initial::read(cx, v.get("initial"), &hinge, &what);
    let mass = read_mass(cx, v, &what, origin);
    let mut nodes = Vec::new();
    if let Some(written) = v.get("nodes") {
        for (key, node) in table(cx, written, &format!("{what}: `nodes`")) {
            name(cx, key, node, "node");
            let p = pose(cx, Some(node), &format!("node `{full}/{key}`"));
            nodes.push((key.clone(), p, cx.key(node)));
        }
    }
    let Shapes { shown, colliders } =
        v.get("shapes").map(|s| shapes(cx, s, full, files)).unwrap_or_default();
    let modes = v.get("modes").and_then(|m| modes::read(cx, m, &what, files));
    Body {
        name: full.into(),
        parent: parent.unwrap_or_else(|| Text::new("world")),
        at: pose(cx, v.get("at"), &format!("{what}: `at`")),
        hinge_frame: pose(cx, v.get("hinge_frame"), &format!("{what}: `hinge_frame`")),
        hinge,
        mass,
        q,
        v: rates,
        shapes: shown,
        colliders,
        nodes,
        origin,
        inertia_origin: v.get("inertia").or(v.get("mass")).map_or(origin, |i| i.origin),
        modes,
        modes_origin: v.get("modes").map_or(origin, |m| m.origin),
    }
}
