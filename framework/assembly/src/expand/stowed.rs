//! An assembly as cargo: `stowed: (on: "stage", at: (position: ..))` keeps only its bodies, as one rigid piece.
//!
//! Hinges are locked at zero, and the body on the world is moved to `on`, at `at`. Models, services, wires, exports, loops, couplings and colliders
//! are removed. A phase with `stowed: None` has all of them. `stowed: (held: true)` keeps its bodies at their poses: every hinge is prescribed and at
//! rest.
use crate::expand::instance::{Instance, Node};
use crate::form::stowed::StowedForm;
use crate::schema::kind::At;
use crate::schema::record::Record;
use crate::text::report::Cx;
use crate::text::value::{map, set};
use linkwork_runtime::{Located, Value};

/// Fields of a body about its hinge's motion.
const MOTION: [&str; 9] =
    ["hinge", "initial", "prescribed", "armature", "gear", "limits", "stop", "damping", "friction"];

/// Fields of a body that act on a free coordinate.
const DRIVE: [&str; 7] =
    ["prescribed", "armature", "gear", "limits", "stop", "damping", "friction"];
/// Fields of `initial` that are rates.
const RATES: [&str; 4] = ["rate", "rates", "velocity", "angular"];

/// Reduces an instance to its locked bodies, carried as `written` specifies.
pub(crate) fn stow(cx: &mut Cx, here: &mut Instance, written: &Located) {
    let what = format!("`{}`: `stowed`", here.path);
    let at = At::new(what.clone()).origin(written.origin);
    let Some(form) = StowedForm::read(cx, written, &at) else { return };
    let (on, at) = (form.on, written.get("at").cloned());
    if form.held {
        if on.is_some() || at.is_some() {
            let fact = format!("{what}: `held` cannot be combined with `on` and `at`");
            cx.fault(written.origin, fact, "write `held: true` alone, or `on` and `at` without it");
        }
        return hold(here);
    }
    let Some(on) = on else {
        let fact = format!("{what}: the body that carries it is missing");
        let help =
            "write stowed: (on: \"the body that carries it\"), stowed: (held: true), or `None`";
        return cx.fault(written.origin, fact, help);
    };
    let on = Located { value: Value::Text(on.text), origin: on.origin };
    let at = at.unwrap_or_else(|| map(Vec::new()));
    let roots = lock(here, &on, &at);
    if roots.len() != 1 {
        let fact = match roots.len() {
            0 => "none of its bodies is connected to the world".to_string(),
            n => format!("{n} of its bodies are connected to the world: {}", roots.join(", ")),
        };
        let help = "only an assembly with one such body can be stowed";
        cx.fault(written.origin, format!("{what}: {fact}"), help);
    }
}

/// Removes everything from an instance except its bodies and nested assemblies.
fn strip(here: &mut Instance) {
    here.parts.retain(|_, node| matches!(node, Node::Assembly(_)));
    here.wires.clear();
    here.connect.clear();
    here.exports.clear();
    here.loops.clear();
    here.couplings.clear();
    here.colliders.clear();
    here.contact = None;
    here.self_collision = None;
    here.ignore = None;
}

/// Prescribes the hinges of all bodies, at rest. Their positions are those of `initial`, or, in a later phase, the present ones.
fn hold(here: &mut Instance) {
    strip(here);
    for body in here.bodies.values_mut() {
        let locked = |h: &Located| matches!(&h.value, Value::Variant(kind, _) if kind == "Locked");
        if body.fields.get("hinge").is_none_or(locked) {
            continue;
        }
        if let Value::Map(entries) = &mut body.fields.value {
            entries.retain(|(field, _)| !DRIVE.contains(&field.as_str()));
            for (_, initial) in entries.iter_mut().filter(|(field, _)| field == "initial") {
                if let Value::Map(words) = &mut initial.value {
                    words.retain(|(word, _)| !RATES.contains(&word.as_str()));
                }
            }
        }
        set(&mut body.fields, &["prescribed".to_string()], &Value::Bool(true).into());
    }
    for node in here.parts.values_mut() {
        if let Node::Assembly(inner) = node {
            hold(inner);
        }
    }
}

/// Locks all bodies; returns the names of those on the world.
fn lock(here: &mut Instance, on: &Located, at: &Located) -> Vec<String> {
    strip(here);
    let mut roots = Vec::new();
    for (name, body) in &mut here.bodies {
        if let Value::Map(entries) = &mut body.fields.value {
            entries.retain(|(field, _)| !MOTION.contains(&field.as_str()));
        }
        let parent = body.fields.get("parent").map(|p| &p.value);
        if matches!(parent, Some(Value::Text(t)) if t == "world") {
            roots.push(format!("`{name}`"));
            set(&mut body.fields, &["parent".to_string()], on);
            set(&mut body.fields, &["at".to_string()], at);
        }
    }
    for node in here.parts.values_mut() {
        if let Node::Assembly(inner) = node {
            roots.extend(lock(inner, on, at));
        }
    }
    roots
}
