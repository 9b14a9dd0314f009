//! Loops and couplings with resolved ends, for `Builder` and the solvers.
//!
//! ```text
//! loop       frame of B in frame of A moves as its hinge permits;   frame = node · at
//! coupling   Σ factor · coordinate = constant;                      mimic: a − ratio · of = offset
//! ```
use crate::body::constraint::{CouplingForm, LoopForm, Terms};
use crate::body::hinge::slides;
use crate::body::initial;
use crate::expand::instance::{Instance, ItemInst};
use crate::mechanism::anchor::{Bodies, anchor, one_dof};
use crate::schema::kind::At;
use crate::schema::record::Record;
use crate::text::report::Cx;
use crate::text::value::{Text, full_name, set};
use linkwork_multibody::{
    Builder, Coordinate, Coupling, Hinge, HingeCoordinate, LoopClosure, LoopMotion, Powers,
    Subhinge, SubhingeKind, Term,
};
use linkwork_plant::Closing;
use linkwork_runtime::{Located, Origin, Value};
use linkwork_solvers::ConstraintMethod;
use linkwork_spatial::Pose;
use std::collections::BTreeMap;
use std::fmt::Display;

/// Data of loops and couplings in addition to the mechanism's structure, by full name.
#[derive(Default)]
pub(crate) struct Constraints {
    pub constraint_methods: BTreeMap<String, ConstraintMethod>,
    /// Loops that do not close at once.
    pub closings: BTreeMap<String, Closing>,
    /// The prescribed subhinges of each loop at the start.
    pub motions: BTreeMap<String, Vec<LoopMotion>>,
    /// Positions in the file.
    pub origins: BTreeMap<String, Origin>,
    /// Pairs of bodies that a loop connects.
    pub joined: Vec<[String; 2]>,
    /// The fields of each, with references from the top level.
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
                if out.closings.contains_key(&full) {
                    builder.gaps(full);
                }
            }
        }
        for (name, item) in &here.couplings {
            let full = full_name(&here.path, name);
            if here.loops.contains_key(name) {
                let message = format!("`{full}` is both a loop and a coupling");
                cx.fault(item.origin, message, "rename one of them");
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

/// Returns the loop, if both ends and the hinge could be read.
fn closure(
    cx: &mut Cx,
    root: &Instance,
    here: &Instance,
    bodies: &Bodies,
    (full, item): (&str, &ItemInst),
    out: &mut Constraints,
) -> Option<LoopClosure> {
    let at = At::new(format!("loop `{full}`")).origin(item.origin);
    let form = LoopForm::read(cx, &item.fields, &at)?;
    let mut end = |text: Option<&Text>, X: Pose, field: &str| {
        let what = at.field(field).what;
        let found = anchor(cx, root, bodies, (&here.path, text?), &what)?;
        let frame = found.node.map_or(X, |node| node * X);
        Some((found.body, frame, found.reference))
    };
    let (a, b) = (end(form.a.as_ref(), form.at_a, "a"), end(form.b.as_ref(), form.at_b, "b"));
    let mut hinge = form.hinge;
    if form.prescribed {
        hinge.subhinges.iter_mut().for_each(|s| s.coordinate = Coordinate::Prescribed);
    }
    let motions = motions(cx, form.initial.as_ref(), &hinge, &at);
    let ((body_a, frame_a, of_a), (body_b, frame_b, of_b)) = (a?, b?);
    let mut all = item.fields.clone();
    set(&mut all, &["a".into()], &Value::Text(of_a).into());
    set(&mut all, &["b".into()], &Value::Text(of_b).into());
    out.resolved.insert(full.into(), all);
    out.constraint_methods.insert(full.into(), form.solve);
    out.closings.extend(form.closing.map(|c| (full.into(), c)));
    out.motions.insert(full.into(), motions);
    Some(LoopClosure { name: full.into(), body_a, frame_a, body_b, frame_b, hinge })
}

/// Reads the start of the prescribed subhinges, in the form of a body's `initial`.
fn motions(cx: &mut Cx, v: Option<&Located>, hinge: &Hinge, at: &At<'_>) -> Vec<LoopMotion> {
    let given =
        |s: &&Subhinge| s.coordinate == Coordinate::Prescribed && s.kind != SubhingeKind::Locked;
    let given = Hinge { subhinges: hinge.subhinges.iter().filter(given).copied().collect() };
    if given.subhinges.is_empty() {
        if let Some(v) = v {
            let message =
                format!("{}: `initial` is for prescribed subhinges, but there are none", at.what);
            let help = "write `prescribed: true` in a slider or pin of its hinge; free coordinates \
                        follow from the `initial` of the bodies";
            cx.fault(v.origin, message, help);
        }
        return Vec::new();
    }
    if given.subhinges.iter().any(|s| s.kind.nv() != 1) {
        // The builder reports subhinges that cannot be prescribed.
        return Vec::new();
    }
    let (q, rates, _) = initial::read(cx, v, &given, &at.field("initial"));
    let motion = |(&position, &rate)| LoopMotion { position, rate, acceleration: 0.0 };
    q.iter().zip(&rates).map(motion).collect()
}

/// A coordinate with its subhinge, and its reference from the top level.
struct ResolvedCoordinate {
    at: HingeCoordinate,
    kind: SubhingeKind,
    reference: String,
}

/// Resolves a coordinate: `arm`, `arm[1]`, `Arm/link1`.
fn find(
    cx: &mut Cx,
    root: &Instance,
    scope: &str,
    bodies: &Bodies,
    (written, what): (&Text, &dyn Display),
) -> Option<ResolvedCoordinate> {
    let (body, index, subhinge) = one_dof(cx, root, scope, bodies, (written, what))?;
    let kind = bodies.get(&body)?.0.hinge.subhinges[subhinge].kind;
    let reference = format!("/{body}[{index}]");
    Some(ResolvedCoordinate { at: HingeCoordinate { body, subhinge }, kind, reference })
}

/// Returns the coupling, if all its coordinates could be resolved.
fn coupling(
    cx: &mut Cx,
    root: &Instance,
    here: &Instance,
    bodies: &Bodies,
    (full, item): (&str, &ItemInst),
    out: &mut Constraints,
) -> Option<Coupling> {
    let at = At::new(format!("coupling `{full}`")).origin(item.origin);
    let form = CouplingForm::read(cx, &item.fields, &at)?;
    let (written, keeps_order) = form.terms(cx, &item.fields, &at)?;
    let count = written.len();
    let mut terms: Vec<(ResolvedCoordinate, f64)> = Vec::new();
    for (of, factor) in written {
        let found = find(cx, root, &here.path, bodies, (&of, &at.what));
        terms.extend(found.map(|f| (f, factor)));
    }
    if terms.len() < count {
        return None;
    }
    if !keeps_order {
        // Sort the terms, because the order of a map must not affect the result.
        terms.sort_by_key(|t| (t.0.at.body.clone(), t.0.at.subhinge));
    }
    let powers = powers(cx, (root, here, bodies), (&form, item), (&terms, &at))?;
    let sliders = terms.iter().map(|t| slides(&t.0.kind)).collect::<Vec<_>>();
    let constant = form.constant(cx, &sliders, &at)?;
    let resolved = CouplingForm {
        terms: Some(Terms::List(
            terms.iter().map(|(f, factor)| (Text::new(&*f.reference), *factor)).collect(),
        )),
        constant: Some(Value::Number(constant).into()),
        powers: powers.iter().map(|(f, p)| (Text::new(&*f.reference), *p)).collect(),
        solve: form.solve,
        mimic: None,
        of: None,
        ratio: None,
        offset: None,
        doc: form.doc,
    };
    out.resolved.insert(full.into(), resolved.write().into());
    out.constraint_methods.insert(full.into(), form.solve);
    let terms = terms.into_iter().map(|(f, factor)| Term { coordinate: f.at, factor }).collect();
    let powers =
        powers.into_iter().map(|(f, factors)| Powers { coordinate: f.at, factors }).collect();
    Some(Coupling { name: full.into(), terms, constant, powers })
}

/// Returns the higher powers of a coupling, each of a coordinate of its terms.
fn powers(
    cx: &mut Cx,
    (root, here, bodies): (&Instance, &Instance, &Bodies),
    (form, item): (&CouplingForm, &ItemInst),
    (terms, at): (&[(ResolvedCoordinate, f64)], &At<'_>),
) -> Option<Vec<(ResolvedCoordinate, [f64; 3])>> {
    let mut out: Vec<(ResolvedCoordinate, [f64; 3])> = Vec::new();
    for (of, factors) in &form.powers {
        let found = find(cx, root, &here.path, bodies, (of, &at.what))?;
        if !terms.iter().any(|(t, _)| t.at == found.at) {
            let message = format!("{}: `powers` has `{}`, which has no term", at.what, of.text);
            cx.fault(of.origin, message, "add it to `terms`; its factor may be 0");
            return None;
        }
        if out.iter().any(|(o, _)| o.at == found.at) {
            let message = format!("{}: `powers` has `{}` twice", at.what, of.text);
            cx.fault(of.origin, message, "write each coordinate once");
            return None;
        }
        out.push((found, *factors));
    }
    if !out.is_empty() && form.solve == ConstraintMethod::Embed {
        let place = item.fields.get("solve").map_or(item.origin, |v| v.origin);
        let message = format!("{}: a coupling with `powers` cannot be embedded", at.what);
        cx.fault(place, message, "leave out `solve`, or write `solve: Augment`");
        return None;
    }
    // Sort the terms, because the order of a map must not affect the result.
    out.sort_by_key(|(f, _)| (f.at.body.clone(), f.at.subhinge));
    Some(out)
}
