//! Hinges as written: chains of subhinges with their drives and limits.
use crate::schema::pose::direction;
use crate::schema::read::{fields, flag, number};
use crate::text::report::Cx;
use crate::text::value::{self, push, variant};
use linkwork_multibody::{Coordinate, Friction, Hinge, Limits, Stop, Subhinge, SubhingeKind};
use linkwork_runtime::{Located, Origin, Value, remedy};

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

/// What a subhinge has beside its kind.
pub(crate) const OPTIONS: [&str; 7] =
    ["prescribed", "armature", "gear", "limits", "stop", "damping", "friction"];

/// Reads a hinge as written: `Pin([0, 1, 0])`, `Chain(Slider(..), Pin(..))`.
pub(crate) fn read(cx: &mut Cx, v: &Located, what: &str) -> Option<Hinge> {
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
            chain.extend(link(cx, item, what)?);
        }
        return Some(Hinge { subhinges: chain });
    }
    let named = matches!(inner.value, Value::Map(_));
    if named {
        let own = ["axis", "axes", "pitch"];
        fields(cx, inner, &at, &[&own[..], &OPTIONS].concat());
    }
    let axis = |cx: &mut Cx| {
        let given = if named { inner.get("axis") } else { Some(&**inner) };
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
    options(cx, inner, &at, &mut hinge.subhinges);
    Some(hinge)
}

/// The subhinges of one item of a chain; `Locked` is a subhinge there.
fn link(cx: &mut Cx, item: &Located, what: &str) -> Option<Vec<Subhinge>> {
    let Value::Variant(kind, inner) = &item.value else {
        return Some(read(cx, item, what)?.subhinges);
    };
    if kind != "Locked" {
        return Some(read(cx, item, what)?.subhinges);
    }
    let (mut locked, at) = ([SubhingeKind::Locked.into()], format!("{what}: `Locked`"));
    fields(cx, inner, &at, &OPTIONS);
    options(cx, inner, &at, &mut locked);
    Some(locked.into())
}

/// [`OPTIONS`] of a body for its whole hinge or of one hinge of a chain.
pub(crate) fn options(cx: &mut Cx, v: &Located, what: &str, chain: &mut [Subhinge]) {
    if let Some(p) = v.get("prescribed")
        && flag(cx, p, &format!("{what}: `prescribed`")) == Some(true)
    {
        for s in chain.iter_mut() {
            s.coordinate = Coordinate::Prescribed;
        }
    }
    for s in chain {
        if let Some(a) = v.get("armature") {
            s.armature = armature(cx, a, what, &s.kind).unwrap_or(0.0);
        }
        if let Some(g) = v.get("gear") {
            s.gear = number(cx, g, &format!("{what}: `gear`"), "").unwrap_or(1.0);
        }
        if let Some(l) = v.get("limits") {
            s.limits = limits(cx, l, what, &s.kind);
        }
        let slides = matches!(s.kind, SubhingeKind::Slider { .. });
        if let Some(d) = v.get("damping") {
            let unit = if slides { "N s/m" } else { "N m s/rad" };
            s.damping = number(cx, d, &format!("{what}: `damping`"), unit).unwrap_or(0.0);
        }
        if let Some(f) = v.get("friction") {
            s.friction = friction(cx, f, what, slides);
        }
        if let Some(x) = v.get("stop") {
            s.stop = stop(cx, x, what, slides);
        }
    }
}

/// `"0.2 N m"`, or `(force: "0.2 N m", rate: "0.01 rad/s")` with the smooth form.
fn friction(cx: &mut Cx, v: &Located, what: &str, slides: bool) -> Friction {
    let what = format!("{what}: `friction`");
    let units = if slides { ["N", "m/s"] } else { ["N m", "rad/s"] };
    if !matches!(v.value, Value::Map(_)) {
        let force = number(cx, v, &what, units[0]).unwrap_or(0.0);
        return Friction { force, rate: 0.0 };
    }
    fields(cx, v, &what, &["force", "rate"]);
    let mut of = |field: &str, unit: &str| match v.get(field) {
        Some(x) => number(cx, x, &format!("{what}: `{field}`"), unit).unwrap_or(0.0),
        None => 0.0,
    };
    Friction { force: of("force", units[0]), rate: of("rate", units[1]) }
}

/// `false`, `true`, or `(stiffness: "500 N m/rad", damping: "1 s/rad")`.
fn stop(cx: &mut Cx, v: &Located, what: &str, slides: bool) -> Stop {
    let what = format!("{what}: `stop`");
    match v.value {
        Value::Bool(true) => return Stop::Usual,
        Value::Bool(false) => return Stop::Off,
        _ => {}
    }
    if !fields(cx, v, &what, &["stiffness", "damping"]) {
        return Stop::Usual;
    }
    let units = if slides { ["N/m", "s/m"] } else { ["N m/rad", "s/rad"] };
    let mut of = |field: &str, unit: &str, none: f64| match v.get(field) {
        Some(x) => number(cx, x, &format!("{what}: `{field}`"), unit).unwrap_or(none),
        None => none,
    };
    // What could not be read is told already.
    let (stiffness, damping) = (of("stiffness", units[0], 1.0), of("damping", units[1], 0.0));
    if v.get("stiffness").is_none() {
        let help =
            "write `stop: (stiffness: ..)`, or `false` if the coordinate may pass its limits";
        cx.fault(v.origin, format!("{what} has no `stiffness`"), help);
        return Stop::Usual;
    }
    Stop::Soft { stiffness, damping }
}

/// `(lower: "-90 deg", upper: "90 deg", rate: "2 rad/s", effort: "5 N m")`; what is not written has no limit.
pub(crate) fn limits(cx: &mut Cx, v: &Located, what: &str, kind: &SubhingeKind) -> Limits {
    let what = format!("{what}: `limits`");
    fields(cx, v, &what, &["lower", "upper", "rate", "effort"]);
    let slides = matches!(kind, SubhingeKind::Slider { .. });
    let units = if slides { ["m", "m/s", "N"] } else { ["rad", "rad/s", "N m"] };
    let mut of = |field: &str, unit: &str, none: f64| match v.get(field) {
        Some(x) => number(cx, x, &format!("{what}: `{field}`"), unit).unwrap_or(none),
        None => none,
    };
    Limits {
        lower: of("lower", units[0], f64::NEG_INFINITY),
        upper: of("upper", units[0], f64::INFINITY),
        rate: of("rate", units[1], f64::INFINITY),
        effort: of("effort", units[2], f64::INFINITY),
    }
}

/// A rotor inertia in the unit of its subhinge.
pub(crate) fn armature(cx: &mut Cx, v: &Located, what: &str, kind: &SubhingeKind) -> Option<f64> {
    let unit = if matches!(kind, SubhingeKind::Slider { .. }) { "kg" } else { "kg m^2" };
    number(cx, v, &format!("{what}: `armature`"), unit)
}

/// A hinge with all its numbers; `Null` for a locked one.
pub(crate) fn value(h: &Hinge) -> Value {
    match &h.subhinges[..] {
        [] => Value::Null,
        [one] if one.kind != SubhingeKind::Locked => subhinge(one),
        many => {
            let links = many.iter().map(|s| subhinge(s).into()).collect();
            Value::Variant("Chain".into(), Box::new(Value::List(links).into()))
        }
    }
}

fn subhinge(s: &Subhinge) -> Value {
    let mut out = Vec::new();
    let name = match &s.kind {
        SubhingeKind::Pin { axis } => ("Pin", Some(axis)),
        SubhingeKind::Slider { axis } => ("Slider", Some(axis)),
        SubhingeKind::Screw { axis, .. } => ("Screw", Some(axis)),
        SubhingeKind::Ball => ("Ball", None),
        SubhingeKind::Free => ("Free", None),
        SubhingeKind::Locked => ("Locked", None),
    };
    if let Some(axis) = name.1 {
        push(&mut out, "axis", value::vector(axis));
    }
    if let SubhingeKind::Screw { pitch, .. } = s.kind {
        push(&mut out, "pitch", Value::Number(pitch));
    }
    if s.coordinate == Coordinate::Prescribed {
        push(&mut out, "prescribed", Value::Bool(true));
    }
    if s.armature != 0.0 {
        push(&mut out, "armature", Value::Number(s.armature));
    }
    if s.gear != 1.0 {
        push(&mut out, "gear", Value::Number(s.gear));
    }
    push(&mut out, "limits", limits_value(&s.limits));
    resistances(s, &mut out);
    if out.is_empty() { variant(name.0, Value::Null) } else { variant(name.0, Value::Map(out)) }
}

/// Stop, damping and friction.
fn resistances(s: &Subhinge, out: &mut Vec<(String, Located)>) {
    let pair = |a: &str, x: f64, b: &str, y: f64| {
        let number = |x| Located::from(Value::Number(x));
        Value::Map(vec![(a.to_owned(), number(x)), (b.to_owned(), number(y))])
    };
    match s.stop {
        Stop::Usual => {}
        Stop::Off => push(out, "stop", Value::Bool(false)),
        Stop::Soft { stiffness, damping } => {
            push(out, "stop", pair("stiffness", stiffness, "damping", damping));
        }
    }
    if s.damping != 0.0 {
        push(out, "damping", Value::Number(s.damping));
    }
    let Friction { force, rate } = s.friction;
    if s.friction != Friction::NONE {
        push(out, "friction", pair("force", force, "rate", rate));
    }
}

fn limits_value(l: &Limits) -> Value {
    let mut out = Vec::new();
    for (key, x) in [("lower", l.lower), ("upper", l.upper), ("rate", l.rate), ("effort", l.effort)]
    {
        if x.is_finite() {
            push(&mut out, key, Value::Number(x));
        }
    }
    Value::Map(out)
}
