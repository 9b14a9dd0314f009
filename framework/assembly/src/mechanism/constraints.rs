//! Loops and couplings as written, with their ends found: what `Builder` and the solvers are told.
//!
//! ```text
//! loop       frame of B in frame of A moves as its hinge permits;   frame = node · at
//! coupling   Σ factor · coordinate = constant;                      mimic: a − ratio · of = offset
//! ```
use crate::body::{COUPLING_FIELDS, LOOP_FIELDS, hinge, initial};
use crate::expand::instance::{Instance, ItemInst};
use crate::mechanism::anchor::{Bodies, anchor, coordinate};
use crate::schema::pose::pose;
use crate::schema::read::{choice, fields, list, number, table, text_field};
use crate::text::report::Cx;
use crate::text::value::{Text, entries, full_name, map, set};
use linkwork_multibody::{
    Builder, Coordinate, Coupling, Hinge, HingeCoordinate, LoopClosure, LoopMotion, Subhinge,
    SubhingeKind, Term,
};
use linkwork_runtime::{Located, Origin, Value};
use linkwork_solvers::Treatment;
use std::collections::BTreeMap;

/// What loops and couplings say beside the mechanism's structure, by full name.
#[derive(Default)]
pub(crate) struct Constraints {
    pub treatments: BTreeMap<String, Treatment>,
    /// The prescribed subhinges of each loop at the start.
    pub motions: BTreeMap<String, Vec<LoopMotion>>,
    /// Where each is written.
    pub origins: BTreeMap<String, Origin>,
    /// Pairs of bodies that a loop joins.
    pub joined: Vec<[String; 2]>,
    /// The fields of each with references from the top.
    pub resolved: BTreeMap<String, Located>,
}

/// Reads every loop and coupling of the tree into the builder.
pub(crate) fn read(
    cx: &mut Cx,
    root: &Instance,
    instances: &[&Instance],
    bodies: &Bodies,
    builder: &mut Builder,
) -> Constraints {
    let mut out = Constraints::default();
    for here in instances {
        for (name, item) in &here.loops {
            let full = full_name(&here.path, name);
            out.origins.insert(full.clone(), item.origin);
            if let Some(closure) = closure(cx, root, here, bodies, (&full, item), &mut out) {
                out.joined.push([closure.body_a.clone(), closure.body_b.clone()]);
                builder.loop_closure(closure);
            }
        }
        for (name, item) in &here.couplings {
            let full = full_name(&here.path, name);
            if here.loops.contains_key(name) {
                let message = format!("`{full}` is both a loop and a coupling");
                cx.fault(item.origin, message, "give one of them another name");
                continue;
            }
            out.origins.insert(full.clone(), item.origin);
            if let Some(coupling) = coupling(cx, root, here, bodies, (&full, item), &mut out) {
                builder.coupling(coupling);
            }
        }
    }
    out
}

/// `solve: Embed`.
fn treatment(cx: &mut Cx, v: &Located, what: &str) -> Treatment {
    let words =
        [("Auto", Treatment::Auto), ("Embed", Treatment::Embed), ("Augment", Treatment::Augment)];
    choice(cx, v, what, "solve", &words).unwrap_or(Treatment::Auto)
}

/// A field that must be there and be a text.
fn needed(
    cx: &mut Cx,
    v: &Located,
    origin: Origin,
    (field, what): (&str, &str),
    help: &str,
) -> Option<Text> {
    if v.get(field).is_none() {
        cx.fault(origin, format!("{what} has no `{field}`"), help);
        return None;
    }
    text_field(cx, v, field, what)
}

/// The loop, when both ends and the hinge could be read.
fn closure(
    cx: &mut Cx,
    root: &Instance,
    here: &Instance,
    bodies: &Bodies,
    (full, item): (&str, &ItemInst),
    out: &mut Constraints,
) -> Option<LoopClosure> {
    let (what, v) = (format!("loop `{full}`"), &item.fields);
    fields(cx, v, &what, &LOOP_FIELDS);
    let mut end = |field: &str| {
        let help = format!("write `{field}: \"a body or node\"`, or \"world\"");
        let written = needed(cx, v, item.origin, (field, &what), &help);
        let at = format!("at_{field}");
        let X = pose(cx, v.get(&at), &format!("{what}: `{at}`"));
        let place = format!("{what}: `{field}`");
        let found = anchor(cx, root, bodies, (&here.path, &written?), &place)?;
        let frame = found.node.map_or(X, |node| node * X);
        Some((found.body, frame, found.reference))
    };
    let (a, b) = (end("a"), end("b"));
    let hinge = match v.get("hinge") {
        Some(h) => hinge::read(cx, h, &what),
        None => Some(Hinge::locked()),
    };
    let treatment = treatment(cx, v, &what);
    let mut hinge = hinge?;
    if let Some(p) = v.get("prescribed") {
        let all = map(vec![("prescribed", p.clone())]);
        hinge::options(cx, &all, &what, &mut hinge.subhinges);
    }
    let motions = motions(cx, v.get("initial"), &hinge, &what);
    let (a, b) = (a?, b?);
    let mut all = v.clone();
    set(&mut all, &["a".into()], &Value::Text(a.2).into());
    set(&mut all, &["b".into()], &Value::Text(b.2).into());
    out.resolved.insert(full.into(), all);
    out.treatments.insert(full.into(), treatment);
    out.motions.insert(full.into(), motions);
    let (name, [body_a, body_b], [frame_a, frame_b]) = (full.into(), [a.0, b.0], [a.1, b.1]);
    Some(LoopClosure { name, body_a, frame_a, body_b, frame_b, hinge })
}

/// The prescribed subhinges at the start, in the words of a body's `initial`.
fn motions(cx: &mut Cx, v: Option<&Located>, hinge: &Hinge, what: &str) -> Vec<LoopMotion> {
    let given =
        |s: &&Subhinge| s.coordinate == Coordinate::Prescribed && s.kind != SubhingeKind::Locked;
    let given = Hinge { subhinges: hinge.subhinges.iter().filter(given).copied().collect() };
    if given.subhinges.is_empty() {
        if let Some(v) = v {
            let message = format!("{what}: `initial` is for prescribed subhinges, and it has none");
            let help = "write `prescribed: true` in a slider or pin of its hinge; what is free \
                        follows from the bodies' own `initial`";
            cx.fault(v.origin, message, help);
        }
        return Vec::new();
    }
    if given.subhinges.iter().any(|s| s.kind.nv() != 1) {
        // The builder says what can be prescribed.
        return Vec::new();
    }
    let (q, rates) = initial::read(cx, v, &given, what);
    let motion = |(&position, &rate)| LoopMotion { position, rate, acceleration: 0.0 };
    q.iter().zip(&rates).map(motion).collect()
}

/// A coordinate with the subhinge that it is, and how it is named from the top.
struct Found {
    at: HingeCoordinate,
    kind: SubhingeKind,
    reference: String,
}

/// The coordinate that a text names: `arm`, `arm[1]`, `Arm/link1`.
fn find(
    cx: &mut Cx,
    root: &Instance,
    scope: &str,
    bodies: &Bodies,
    (written, what): (&Text, &str),
) -> Option<Found> {
    let name = written.text.strip_prefix("hinge:").unwrap_or(&written.text);
    let (body, index) = match coordinate(root, scope, name) {
        Ok(found) => found?,
        Err((fact, help)) => {
            cx.fault(written.origin, format!("{what}: {fact}"), help);
            return None;
        }
    };
    let chain = &bodies.get(&body)?.0.hinge.subhinges;
    let one_dof = || chain.iter().enumerate().filter(|(_, s)| s.kind.nv() == 1);
    let Some((subhinge, s)) = one_dof().nth(index) else {
        let count = one_dof().count();
        let message = format!(
            "{what}: the hinge of `{body}` has {count} one-dof coordinates, not {}",
            index + 1
        );
        cx.fault(written.origin, message, "name a pin, slider or screw");
        return None;
    };
    let reference = format!("/{body}[{index}]");
    Some(Found { at: HingeCoordinate { body, subhinge }, kind: s.kind, reference })
}

fn slides(kind: &SubhingeKind) -> bool {
    matches!(kind, SubhingeKind::Slider { .. })
}

/// The coupling, when all its coordinates could be found.
fn coupling(
    cx: &mut Cx,
    root: &Instance,
    here: &Instance,
    bodies: &Bodies,
    (full, item): (&str, &ItemInst),
    out: &mut Constraints,
) -> Option<Coupling> {
    let (what, v) = (format!("coupling `{full}`"), &item.fields);
    fields(cx, v, &what, &COUPLING_FIELDS);
    let treatment = treatment(cx, v, &what);
    let mut at = |cx: &mut Cx, t: &Text| find(cx, root, &here.path, bodies, (t, &what));
    let short = ["mimic", "of", "ratio", "offset"];
    let (terms, constant) = if let Some(odd) = short.iter().find(|f| v.get(f).is_some()) {
        if v.get("terms").or(v.get("constant")).is_some() {
            let message = format!("{what} has both `terms` and `{odd}`");
            cx.fault(
                item.origin,
                message,
                "write (terms: {..}, constant: ..) or (mimic: .., of: ..)",
            );
            return None;
        }
        mimic(cx, v, item.origin, &what, &mut at)?
    } else {
        sum(cx, v, item.origin, &what, &mut at)?
    };
    let written = terms.iter().map(|(f, factor)| {
        map(vec![
            ("of", Value::Text(f.reference.clone()).into()),
            ("factor", Value::Number(*factor).into()),
        ])
    });
    let mut all = vec![
        ("terms", Value::List(written.collect()).into()),
        ("constant", Value::Number(constant).into()),
    ];
    all.extend(["doc", "solve"].into_iter().filter_map(|k| Some((k, v.get(k)?.clone()))));
    out.resolved.insert(full.into(), map(all));
    out.treatments.insert(full.into(), treatment);
    let terms = terms.into_iter().map(|(f, factor)| Term { coordinate: f.at, factor }).collect();
    Some(Coupling { name: full.into(), terms, constant })
}

type Terms = (Vec<(Found, f64)>, f64);

/// `(mimic: "a", of: "b", ratio: 2, offset: 0)`.
fn mimic(
    cx: &mut Cx,
    v: &Located,
    origin: Origin,
    what: &str,
    at: &mut impl FnMut(&mut Cx, &Text) -> Option<Found>,
) -> Option<Terms> {
    let help = "write (mimic: \"a\", of: \"b\", ratio: 1, offset: 0): a = ratio · b + offset";
    let a = needed(cx, v, origin, ("mimic", what), help).and_then(|t| at(cx, &t));
    let b = needed(cx, v, origin, ("of", what), help).and_then(|t| at(cx, &t));
    let ratio = match v.get("ratio") {
        Some(r) => number(cx, r, &format!("{what}: `ratio`"), ""),
        None => Some(1.0),
    };
    let unit = if a.as_ref().is_some_and(|a| slides(&a.kind)) { "m" } else { "rad" };
    let offset = match v.get("offset") {
        Some(o) => number(cx, o, &format!("{what}: `offset`"), unit),
        None => Some(0.0),
    };
    Some((vec![(a?, 1.0), (b?, -ratio?)], offset?))
}

/// `(terms: { "left": 1, "right": 1 }, constant: 0)`; a list of `(of: .., factor: ..)` keeps its order.
fn sum(
    cx: &mut Cx,
    v: &Located,
    origin: Origin,
    what: &str,
    at: &mut impl FnMut(&mut Cx, &Text) -> Option<Found>,
) -> Option<Terms> {
    let what_terms = format!("{what}: `terms`");
    let mut written: Vec<(Text, Option<f64>)> = Vec::new();
    let mut unread = 0;
    let listed = matches!(v.get("terms").map(|t| &t.value), Some(Value::List(_)));
    match v.get("terms") {
        Some(terms) if listed => {
            for item in list(cx, terms, &what_terms) {
                let what = format!("{what}: a term");
                fields(cx, item, &what, &["of", "factor"]);
                let help = "write (of: \"a body\", factor: 1)";
                let Some(of) = needed(cx, item, item.origin, ("of", &what), help) else {
                    unread += 1;
                    continue;
                };
                let factor = match item.get("factor") {
                    Some(f) => number(cx, f, &format!("{what}: `factor`"), ""),
                    None => Some(1.0),
                };
                written.push((of, factor));
            }
        }
        Some(terms) => {
            for (key, factor) in table(cx, terms, &what_terms) {
                let of = Text { text: key.clone(), origin: cx.key(factor) };
                written.push((of, number(cx, factor, &format!("{what}: `{key}`"), "")));
            }
        }
        None => {}
    }
    if v.get("terms").is_none_or(|t| entries(t).is_empty() && !listed) {
        let help = "write `terms: { \"left\": 1, \"right\": 1 }`: Σ factor · coordinate = constant";
        cx.fault(origin, format!("{what} has no `terms`"), help);
        return None;
    }
    let count = written.len() + unread;
    let mut terms: Vec<(Found, f64)> = Vec::new();
    for (of, factor) in written {
        let found = at(cx, &of);
        terms.extend(found.zip(factor));
    }
    if !listed {
        // The order in which a map is written leaves no trace.
        let place = |t: &(Found, f64)| (t.0.at.body.clone(), t.0.at.subhinge);
        terms.sort_by_key(place);
    }
    // The unit of the sum, when all terms have one.
    let sliders = terms.iter().filter(|t| slides(&t.0.kind)).count();
    let unit = match sliders {
        0 => "rad",
        n if n == terms.len() => "m",
        _ => "",
    };
    let constant = match v.get("constant") {
        Some(c) if terms.len() == count => number(cx, c, &format!("{what}: `constant`"), unit)?,
        Some(_) => 0.0,
        None => 0.0,
    };
    (terms.len() == count).then_some((terms, constant))
}
