//! Phases of a simulation: each is the file with an overlay.
//!
//! ```ron
//! start: "stacked",
//! phases: {
//!     "stacked": (to: {"apart": "time > 1 s"}),
//!     "apart": (bodies: {"upper": (parent: "world", hinge: Free)}, remove: ["Spring"]),
//! }
//! ```
//! Bodies, parts and similar entries override those with the same name, field by field; wires are added; other fields are replaced. `like` builds on
//! another phase. Removing a part removes its wires.
use crate::form::assembly::AssemblyFields;
use crate::form::settings::{FIXED, MAPS, PhaseForm, may_change, phase_fields};
use crate::schema::read::{self, fields, list, name, table, text_field};
use crate::schema::record::Record;
use crate::text::report::Cx;
use crate::text::value::{Text, entries, set};
use linkwork_runtime::{Located, Origin, TransitionSpec, Value, remedy};
use std::collections::BTreeMap;

/// A phase: its name, and the whole file in this phase.
pub(crate) struct Phase {
    pub name: String,
    pub file: Located,
    pub transitions: Vec<TransitionSpec>,
    pub origin: Origin,
}

/// Splits a file into its phases, the start phase first. Without `phases`, the file is the only phase.
pub(crate) fn split(cx: &mut Cx, mut file: Located) -> Vec<Phase> {
    let what = "simulation";
    let start = text_field(cx, &file, "start", what);
    let written = file.get("phases").cloned();
    if let Value::Map(entries) = &mut file.value {
        entries.retain(|(k, _)| k != "phases" && k != "start");
    }
    let Some(written) = written else {
        if let Some(start) = start {
            let message = "simulation: `start` names a phase, but there are no `phases`";
            cx.fault(start.origin, message, "write `phases: {..}`, or remove `start`");
        }
        let origin = file.origin;
        return vec![Phase { name: String::new(), file, transitions: Vec::new(), origin }];
    };
    let overlays: BTreeMap<String, (Located, Origin)> = table(cx, &written, "`phases`")
        .iter()
        .map(|(k, v)| (k.clone(), (v.clone(), cx.key(v))))
        .collect();
    let names: Vec<&str> = overlays.keys().map(String::as_str).collect();
    if names.is_empty() {
        cx.fault(written.origin, "`phases` is empty", "write at least one, or remove it");
    }
    let first = match &start {
        Some(s) if overlays.contains_key(&s.text) => s.text.clone(),
        Some(s) => {
            let message = format!("simulation: there is no phase `{}` to start in", s.text);
            cx.fault(s.origin, message, remedy(&s.text, "phases", &names));
            names.first().map_or(String::new(), |n| (*n).to_string())
        }
        None => {
            let message = "simulation: `phases` requires `start`, the phase in which a run begins";
            cx.fault(written.origin, message, format!("write start: {:?}", names.first()));
            names.first().map_or(String::new(), |n| (*n).to_string())
        }
    };
    let mut order: Vec<&str> = vec![&first];
    order.extend(names.iter().filter(|n| **n != first));
    let mut out = Vec::new();
    for phase in order {
        let Some((overlay, origin)) = overlays.get(phase) else { continue };
        name(cx, phase, *origin, "phase");
        let merged = build(cx, &file, &overlays, phase, &mut Vec::new());
        let transitions = transitions(cx, overlay, phase);
        out.push(Phase { name: phase.to_string(), file: merged, transitions, origin: *origin });
    }
    out
}

fn transitions(cx: &mut Cx, overlay: &Located, phase: &str) -> Vec<TransitionSpec> {
    let Some(to) = overlay.get("to") else { return Vec::new() };
    let what = format!("phase `{phase}`: `to`");
    let mut out = Vec::new();
    for (target, when) in table(cx, to, &what) {
        if let Some(when) = read::text(cx, when, format!("{what}: `{target}`")) {
            let Text { text, origin } = when;
            out.push(TransitionSpec { to: target.clone(), when: text, origin });
        }
    }
    out
}

/// Returns the file with the overlays of a phase and of the phases in its `like`.
fn build(
    cx: &mut Cx,
    file: &Located,
    overlays: &BTreeMap<String, (Located, Origin)>,
    phase: &str,
    above: &mut Vec<String>,
) -> Located {
    let Some((overlay, _)) = overlays.get(phase) else { return file.clone() };
    let what = format!("phase `{phase}`");
    if above.is_empty() {
        for (key, value) in entries(overlay) {
            if FIXED.contains(&key.as_str()) {
                let message = format!("{what}: `{key}` cannot change during a run");
                cx.fault(cx.key(value), message, "write it once, outside the phases");
            }
        }
    }
    let known: Vec<&str> = phase_fields().into_iter().chain(FIXED).collect();
    fields(cx, overlay, &what, &known);
    above.push(phase.to_string());
    let mut base = file.clone();
    if let Some(like) = text_field(cx, overlay, "like", &what) {
        let names: Vec<&str> = overlays.keys().map(String::as_str).collect();
        if above.contains(&like.text) {
            let ring = format!("{} -> {}", above.join(" -> "), like.text);
            cx.fault(
                like.origin,
                format!("{what}: `like` is circular: {ring}"),
                "remove one of them",
            );
        } else if overlays.contains_key(&like.text) {
            base = build(cx, file, overlays, &like.text, above);
        } else {
            let message = format!("{what}: there is no phase `{}` for `like`", like.text);
            cx.fault(like.origin, message, remedy(&like.text, "phases", &names));
        }
    }
    above.pop();
    if matches!(overlay.get("whole").map(|w| &w.value), Some(Value::Bool(true)))
        && let Value::Map(entries) = &mut base.value
    {
        entries.retain(|(k, _)| {
            !AssemblyFields::names().contains(&k.as_str()) || k == "doc" || k == "name"
        });
    }
    if let Some(gone) = overlay.get("remove") {
        let gone = list(cx, gone, format!("{what}: `remove`")).to_vec();
        for item in gone {
            if let Some(t) = read::text(cx, &item, format!("{what}: `remove`")) {
                remove(cx, &mut base, &t, &what);
            }
        }
    }
    for (key, value) in entries(overlay) {
        let own = PhaseForm::names().contains(&key.as_str()) || key == "doc";
        // Fields that a phase cannot change have already been rejected.
        if own || !may_change(key) {
            continue;
        }
        lay(&mut base, key, value);
    }
    base
}

/// Applies one field of an overlay to the file.
fn lay(base: &mut Located, key: &str, value: &Located) {
    let path = |names: &[&str]| names.iter().map(|n| (*n).to_string()).collect::<Vec<_>>();
    if ["wires", "connect", "import"].contains(&key) {
        let mut all = match base.get(key).map(|v| &v.value) {
            Some(Value::List(items)) => items.clone(),
            _ => Vec::new(),
        };
        match &value.value {
            Value::List(items) => all.extend(items.iter().cloned()),
            _ => all.push(value.clone()),
        }
        let list = Located { value: Value::List(all), origin: value.origin };
        set(base, &path(&[key]), &list);
    } else if MAPS.contains(&key) || key == "overrides" {
        for (name, item) in entries(value) {
            let there = base.get(key).and_then(|m| m.get(name)).is_some();
            if !there || key == "overrides" {
                set(base, &path(&[key, name]), item);
                continue;
            }
            for (field, v) in entries(item) {
                if field == "params" {
                    for (p, v) in entries(v) {
                        set(base, &path(&[key, name, field, p]), v);
                    }
                } else {
                    set(base, &path(&[key, name, field]), v);
                }
            }
        }
    } else {
        set(base, &path(&[key]), value);
    }
}

/// Removes a named entry from the file, with the wires of a part.
fn remove(cx: &mut Cx, base: &mut Located, gone: &Text, what: &str) {
    let Value::Map(file) = &mut base.value else { return };
    let mut found = false;
    let mut known: Vec<String> = Vec::new();
    for (key, map) in file.iter_mut().filter(|(k, _)| MAPS.contains(&k.as_str())) {
        if let Value::Map(items) = &mut map.value {
            let before = items.len();
            items.retain(|(name, _)| *name != gone.text);
            found |= items.len() < before;
            if key != "params" && key != "exports" {
                known.extend(items.iter().map(|(name, _)| name.clone()));
            }
        }
    }
    if !found {
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        let mut help = remedy(&gone.text, "names", &known);
        if gone.text.contains(['.', '/']) {
            help = "only entries of the simulation itself can be removed; parts of an assembly are removed with it".into();
        }
        let message = format!("{what}: there is no `{}` to remove", gone.text);
        cx.fault(gone.origin, message, help);
        return;
    }
    let of = |end: &str| end.trim().split(['.', '[']).next().unwrap_or("").trim() == gone.text;
    for (key, wires) in file.iter_mut() {
        let Value::List(items) = &mut wires.value else { continue };
        match key.as_str() {
            "wires" => items.retain(|w| {
                let wire = w.get("wire").unwrap_or(w);
                !matches!(&wire.value, Value::Text(t) if t.split("->").any(of))
            }),
            // The other connectors of an entry stay connected.
            "connect" => items.retain_mut(|entry| {
                let Value::List(ends) = &mut entry.value else { return true };
                ends.retain(|end| !matches!(&end.value, Value::Text(t) if of(t)));
                ends.len() > 1
            }),
            _ => {}
        }
    }
}
