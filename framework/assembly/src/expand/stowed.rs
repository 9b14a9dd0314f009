//! An assembly that is cargo: `stowed: (on: "stage", at: (position: ..))` leaves its bodies, in one rigid piece.
//!
//! Hinges are locked at zero, and the body that hangs on the world hangs on `on` instead, at `at`. Models, services,
//! wires, exports, loops, couplings and colliders are not there. A phase that says `stowed: None` has them all.
use crate::expand::instance::{Instance, Node};
use crate::form::stowed::StowedForm;
use crate::schema::kind::At;
use crate::schema::record::Record;
use crate::text::report::Cx;
use crate::text::value::{map, set};
use linkwork_runtime::{Located, Value};

/// Fields of a body that belong to its hinge's motion.
const MOTION: [&str; 9] =
    ["hinge", "initial", "prescribed", "armature", "gear", "limits", "stop", "damping", "friction"];

/// Leaves the bodies of an instance, locked, on what `written` names.
pub(crate) fn stow(cx: &mut Cx, here: &mut Instance, written: &Located) {
    let what = format!("`{}`: `stowed`", here.path);
    let at = At::new(what.clone()).origin(written.origin);
    let Some(form) = StowedForm::read(cx, written, &at) else { return };
    let on = Located { value: Value::Text(form.on.text), origin: form.on.origin };
    let at = written.get("at").cloned().unwrap_or_else(|| map(Vec::new()));
    let roots = lock(here, &on, &at);
    if roots.len() != 1 {
        let fact = match roots.len() {
            0 => "none of its bodies hangs on the world".to_string(),
            n => format!("{n} of its bodies hang on the world: {}", roots.join(", ")),
        };
        let help = "only an assembly with one such body can be stowed";
        cx.fault(written.origin, format!("{what}: {fact}"), help);
    }
}

/// Locks all bodies; names of those that hung on the world.
fn lock(here: &mut Instance, on: &Located, at: &Located) -> Vec<String> {
    here.parts.retain(|_, node| matches!(node, Node::Assembly(_)));
    here.wires.clear();
    here.exports.clear();
    here.loops.clear();
    here.couplings.clear();
    here.colliders.clear();
    here.contact = None;
    here.self_collision = None;
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
