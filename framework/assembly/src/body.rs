//! A body with numbers: from fields whose parameters have been replaced.
use crate::context::{Cx, Text};
use crate::files::{Files, Home};
use crate::initial;
use crate::pose::{direction, pose, vector};
use crate::read::{fields, flag, name, number, numbers, table, text_field};
use crate::shape::{BodyShape, inertia, shape, shapes};
use linkwork_multibody::{Coordinate, Hinge, Subhinge, SubhingeKind};
use linkwork_runtime::{Located, Origin, Value, remedy};
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
    pub nodes: Vec<(String, Pose, Origin)>,
    pub origin: Origin,
    /// Where mass and inertia are written, for faults about them.
    pub inertia_origin: Origin,
}

const FIELDS: [&str; 14] = [
    "parent",
    "at",
    "hinge",
    "hinge_frame",
    "prescribed",
    "armature",
    "mass",
    "com",
    "inertia",
    "inertia_check",
    "initial",
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
        Some(h) => read_hinge(cx, h, &what).unwrap_or_default(),
        None => Hinge::locked(),
    };
    if v.get("prescribed").and_then(|p| flag(cx, p, &format!("{what}: `prescribed`"))) == Some(true)
    {
        hinge = hinge.prescribed();
    }
    if let Some(a) = v.get("armature") {
        for s in &mut hinge.subhinges {
            s.armature = armature(cx, a, &what, &s.kind).unwrap_or(0.0);
        }
    }
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
    let shapes = v.get("shapes").map(|s| shapes(cx, s, full, files)).unwrap_or_default();
    Body {
        name: full.into(),
        parent: parent.unwrap_or_else(|| Text::new("world")),
        at: pose(cx, v.get("at"), &format!("{what}: `at`")),
        hinge_frame: pose(cx, v.get("hinge_frame"), &format!("{what}: `hinge_frame`")),
        hinge,
        mass,
        q,
        v: rates,
        shapes,
        nodes,
        origin,
        inertia_origin: v.get("inertia").or(v.get("mass")).map_or(origin, |i| i.origin),
    }
}

fn read_mass(cx: &mut Cx, v: &Located, what: &str, origin: Origin) -> MassProperties {
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
        Value::List(items) if items.len() == 3 => {
            let d = numbers::<3>(cx, v, &what, unit)?;
            Some(Mat3::from_diagonal(&Vec3::from(d)))
        }
        Value::Variant(..) => {
            let (solid, turn) = shape(cx, v, &what, None)?;
            inertia(mass, &solid, &turn)
        }
        other => {
            let help = "write [ixx, iyy, izz], [ixx, iyy, izz, ixy, ixz, iyz] or a solid \
                        such as Cylinder(radius: .., length: ..)";
            let found = match other {
                Value::List(items) => format!("a list of {}", items.len()),
                other => other.what().into(),
            };
            cx.fault(v.origin, format!("{what} cannot be {found}"), help);
            None
        }
    }
}

const HINGES: [&str; 11] = [
    "Pin",
    "Slider",
    "Screw",
    "Ball",
    "Free",
    "Locked",
    "Universal",
    "Cylindrical",
    "Gimbal",
    "Planar",
    "Chain",
];

fn read_hinge(cx: &mut Cx, v: &Located, what: &str) -> Option<Hinge> {
    let Value::Variant(kind, inner) = &v.value else {
        let message = format!("{what}: `hinge` is a hinge, this is {}", v.value.what());
        cx.fault(v.origin, message, format!("one of: {}", HINGES.join(", ")));
        return None;
    };
    let at = format!("{what}: `{kind}`");
    if kind == "Chain" {
        let mut chain = Vec::new();
        // A chain of one arrives as the one itself.
        let one = std::slice::from_ref(&**inner);
        let items = if let Value::List(items) = &inner.value { items.as_slice() } else { one };
        for item in items {
            chain.extend(read_hinge(cx, item, what)?.subhinges);
        }
        return Some(Hinge { subhinges: chain });
    }
    let options = matches!(inner.value, Value::Map(_));
    if options {
        fields(cx, inner, &at, &["axis", "axes", "pitch", "prescribed", "armature"]);
    }
    let axis = |cx: &mut Cx| {
        let given = if options { inner.get("axis") } else { Some(&**inner) };
        match given.filter(|a| a.value != Value::Null) {
            Some(a) => direction(cx, a, &format!("{at}: the axis")),
            None => {
                cx.fault(v.origin, format!("{at} has no axis"), format!("write {kind}([0, 0, 1])"));
                None
            }
        }
    };
    let mut hinge = match kind.as_str() {
        "Pin" => Hinge::pin(axis(cx)?),
        "Slider" => Hinge::slider(axis(cx)?),
        "Screw" => {
            let axis = axis(cx)?;
            match inner.get("pitch") {
                Some(p) => Hinge::screw(axis, number(cx, p, &format!("{at}: `pitch`"), "m/rad")?),
                None => {
                    let help = "write Screw(axis: [0, 0, 1], pitch: \"1 mm/rev\")";
                    cx.fault(v.origin, format!("{at} has no `pitch`"), help);
                    return None;
                }
            }
        }
        "Cylindrical" => Hinge::cylindrical(axis(cx)?),
        "Universal" => {
            let axes = inner.get("axes").unwrap_or(inner);
            let Value::List(pair) = &axes.value else {
                let help = "write Universal([1, 0, 0], [0, 1, 0])";
                cx.fault(v.origin, format!("{at} has two axes"), help);
                return None;
            };
            if pair.len() != 2 {
                let help = "write Universal([1, 0, 0], [0, 1, 0])";
                cx.fault(axes.origin, format!("{at} has two axes"), help);
                return None;
            }
            let first = direction(cx, &pair[0], &format!("{at}: the first axis"));
            let second = direction(cx, &pair[1], &format!("{at}: the second axis"));
            Hinge::universal(first?, second?)
        }
        "Ball" => Hinge::ball(),
        "Free" => Hinge::free(),
        "Locked" => Hinge::locked(),
        "Gimbal" => Hinge::gimbal(),
        "Planar" => Hinge::planar(),
        other => {
            let origin = Origin { end: v.origin.start + other.len() as u32, ..v.origin };
            let message = format!("{what}: there is no hinge `{other}`");
            cx.fault(origin, message, remedy(other, "hinges", &HINGES));
            return None;
        }
    };
    hinge_options(cx, inner, &at, &mut hinge.subhinges);
    Some(hinge)
}

fn hinge_options(cx: &mut Cx, v: &Located, what: &str, chain: &mut [Subhinge]) {
    if let Some(p) = v.get("prescribed")
        && flag(cx, p, &format!("{what}: `prescribed`")) == Some(true)
    {
        for s in chain.iter_mut() {
            s.coordinate = Coordinate::Prescribed;
        }
    }
    if let Some(a) = v.get("armature") {
        for s in chain {
            s.armature = armature(cx, a, what, &s.kind).unwrap_or(0.0);
        }
    }
}

fn armature(cx: &mut Cx, v: &Located, what: &str, kind: &SubhingeKind) -> Option<f64> {
    let unit = if matches!(kind, SubhingeKind::Slider { .. }) { "kg" } else { "kg m^2" };
    number(cx, v, &format!("{what}: `armature`"), unit)
}

/// True for a field that a body has.
pub(crate) fn known(field: &str) -> bool {
    FIELDS.contains(&field)
}

/// The fields of a body, for messages.
pub(crate) fn known_list() -> String {
    FIELDS.join(", ")
}
