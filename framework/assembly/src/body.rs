//! A body with numbers: from fields whose parameters have been replaced.
use crate::collider::Collider;
use crate::context::{Cx, Text};
use crate::files::{Files, Home};
use crate::pose::{pose, vector};
use crate::read::{fields, name, number, numbers, table, text_field};
use crate::shape::{BodyShape, Shapes, inertia, shape, shapes};
use crate::{hinge, initial, modes};
use linkwork_multibody::{Hinge, Modes};
use linkwork_runtime::{Located, Origin, Value};
use linkwork_spatial::{InertiaCheck, MassProperties, Mat3, Pose, Vec3};

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

/// Reads a body; what cannot be read is recorded and left at its neutral value.
pub(crate) fn read(
    cx: &mut Cx,
    full: &str,
    v: &Located,
    origin: Origin,
    files: (&Files<'_>, &Home),
) -> Body {
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

/// `mass`, `com`, `inertia`, `inertia_check`.
pub(crate) fn read_mass(cx: &mut Cx, v: &Located, what: &str, origin: Origin) -> MassProperties {
    let mass = v.get("mass").map(|m| number(cx, m, &format!("{what}: `mass`"), "kg"));
    let com = v.get("com").and_then(|c| vector(cx, c, &format!("{what}: `com`"), "m"));
    let matrix = match (v.get("inertia"), mass) {
        (Some(i), mass) => read_inertia(cx, i, what, mass.flatten().unwrap_or(0.0)),
        (None, Some(Some(m))) if m != 0.0 => {
            let help = "write `inertia: [ixx, iyy, izz]` about the centre of mass, \
                        or a solid such as `inertia: Sphere(0.1)`";
            cx.fault(origin, format!("{what} has mass but no `inertia`"), help);
            None
        }
        _ => Some(Mat3::zeros()),
    };
    // After a mistake the rest of the body is still checked, with a mass that can exist.
    let (Some(Some(mass)), Some(matrix)) = (mass.or(Some(Some(0.0))), matrix) else {
        return MassProperties::massless();
    };
    let check = match v.get("inertia_check").map(|c| &c.value) {
        None => InertiaCheck::Physical,
        Some(Value::Variant(w, _) | Value::Text(w)) if w == "Physical" => InertiaCheck::Physical,
        Some(Value::Variant(w, _) | Value::Text(w)) if w == "PositiveMoments" => {
            InertiaCheck::PositiveMoments
        }
        Some(_) => {
            let place = v.get("inertia_check").map_or(origin, |c| c.origin);
            let help = "one of: Physical, PositiveMoments";
            cx.fault(place, format!("{what}: `inertia_check` is one of two words"), help);
            InertiaCheck::Physical
        }
    };
    MassProperties::new(mass, com.unwrap_or_else(Vec3::zeros), matrix).with_check(check)
}

fn read_inertia(cx: &mut Cx, v: &Located, what: &str, mass: f64) -> Option<Mat3> {
    let what = format!("{what}: `inertia`");
    let unit = "kg m^2";
    match &v.value {
        Value::List(items) if items.len() == 6 => {
            let [xx, yy, zz, xy, xz, yz] = numbers::<6>(cx, v, &what, unit)?;
            Some(Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
        }
        Value::List(items) if items.len() == 9 => {
            let rows = numbers::<9>(cx, v, &what, unit)?;
            Some(Mat3::from_row_slice(&rows))
        }
        Value::List(items) if items.len() == 3 => {
            let d = numbers::<3>(cx, v, &what, unit)?;
            Some(Mat3::from_diagonal(&Vec3::from(d)))
        }
        Value::Variant(..) => {
            let (solid, turn) = shape(cx, v, &what, None)?;
            inertia(mass, &solid, &turn)
        }
        other => {
            let help = "write [ixx, iyy, izz], [ixx, iyy, izz, ixy, ixz, iyz], nine numbers by \
                        rows, or a solid such as Cylinder(radius: .., length: ..)";
            let found = match other {
                Value::List(items) => format!("a list of {}", items.len()),
                other => other.what().into(),
            };
            cx.fault(v.origin, format!("{what} cannot be {found}"), help);
            None
        }
    }
}
