//! One RON text that loads to the same `Spec` without other files, for logs and checkpoints.
use crate::body::{modes::modes, solid};
use crate::expand::instance::{Instance, ItemInst, ModelInst, Node};
use crate::form::settings::may_change;
use crate::form::wire::write_wire;
use crate::mechanism::References;
use crate::schema::kind::Kind;
use crate::text::files::{Files, Home};
use crate::text::print::document;
use crate::text::value::{entries, full_name, map, set};
use linkwork_collision::ColliderSpec;
use linkwork_runtime::{BindSpec, BindTarget, Located, Spec, TransitionSpec, Value};
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Deref;
use std::sync::OnceLock;

/// One RON text with everything included, expanded and overridden: it loads to the same specification without other files. It is printed on demand,
/// because most runs of a campaign never need it.
#[derive(Clone, Debug)]
pub struct Resolved {
    value: Value,
    text: OnceLock<String>,
}

impl Resolved {
    pub(crate) fn new(value: Value) -> Resolved {
        Resolved { value, text: OnceLock::new() }
    }
}

impl Deref for Resolved {
    type Target = str;
    fn deref(&self) -> &str {
        self.text.get_or_init(|| document(&self.value))
    }
}

impl fmt::Display for Resolved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self)
    }
}

impl PartialEq for Resolved {
    fn eq(&self, other: &Resolved) -> bool {
        **self == **other
    }
}

struct Printer<'a> {
    files: &'a Files<'a>,
    told: &'a References,
    /// Bindings by part.
    binds: BTreeMap<&'a str, Vec<&'a BindSpec>>,
}

fn text(t: impl Into<String>) -> Located {
    Value::Text(t.into()).into()
}

/// Returns everything expanded: without includes, parameters, mounts, arrays or overrides.
pub(crate) fn value(
    root: Instance,
    files: &Files<'_>,
    settings: &Located,
    spec: &Spec,
    told: &References,
) -> Value {
    let mut p = Printer { files, told, binds: BTreeMap::new() };
    for bind in &spec.binds {
        p.binds.entry(&bind.part).or_default().push(bind);
    }
    let mut out = vec![("resolved", Value::Bool(true).into())];
    let drop = [
        "assembly",
        "name",
        "params",
        "import",
        "bodies",
        "loops",
        "couplings",
        "colliders",
        "contact",
        "self_collision",
        "ignore",
        "parts",
        "wires",
        "connect",
        "exports",
        "overrides",
        "resolved",
        "world",
    ];
    for (key, v) in entries(settings) {
        if !drop.contains(&key.as_str()) {
            out.push((key, v.clone()));
        }
    }
    out.sort_by(|a, b| a.0.cmp(b.0));
    if let Value::Map(inner) = p.instance(root).value {
        let inner: Vec<(String, Located)> = inner.into_iter().filter(|(k, _)| k != "doc").collect();
        let mut all: Vec<(String, Located)> =
            out.into_iter().map(|(k, v)| (k.to_string(), v)).collect();
        all.extend(inner);
        all.extend(told.contact.clone().map(|c| ("contact".to_string(), c)));
        let wires = spec.wires.iter();
        let wires = wires.map(|w| write_wire(format!("{} -> {}", w.from, w.to), &w.timing).into());
        all.push(("wires".into(), Value::List(wires.collect()).into()));
        return Value::Variant("Simulation".into(), Box::new(Value::Map(all).into()));
    }
    Value::Null
}

/// Returns the first phase with all phases in it, each complete.
pub(crate) fn with_phases(phases: &[(&str, &Value, &Vec<TransitionSpec>)]) -> Value {
    let Some((first, value, _)) = phases.first() else { return Value::Null };
    let fields = |v: &Value| match v {
        Value::Variant(_, inner) => entries(inner).to_vec(),
        _ => Vec::new(),
    };
    let mut all = fields(value);
    all.push(("start".into(), text(*first)));
    let each = phases.iter().map(|(name, value, transitions)| {
        let mut own = fields(value);
        own.retain(|(key, _)| may_change(key));
        own.push(("whole".into(), Value::Bool(true).into()));
        let to = transitions.iter().map(|t| (t.to.clone(), text(&*t.when)));
        own.push(("to".into(), Value::Map(to.collect()).into()));
        ((*name).to_string(), Value::Map(own).into())
    });
    all.push(("phases".into(), Value::Map(each.collect()).into()));
    Value::Variant("Simulation".into(), Box::new(Value::Map(all).into()))
}

impl Printer<'_> {
    fn instance(&self, here: Instance) -> Located {
        let mut out = Vec::new();
        if !here.doc.is_empty() {
            out.push(("doc", text(&*here.doc)));
        }
        let bodies: Vec<(String, Located)> = here
            .bodies
            .into_iter()
            .map(|(name, b)| {
                let mut fields = b.fields;
                let full = full_name(&here.path, &name);
                if let Some(parent) = self.told.parents.get(&full) {
                    set(&mut fields, &["parent".into()], &text(parent));
                }
                let from_file = fields
                    .get("modes")
                    .is_some_and(|m| matches!(&m.value, Value::Variant(kind, _) if kind == "File"));
                if let Some(m) = self.told.modes.get(&full).filter(|_| from_file) {
                    set(&mut fields, &["modes".into()], &modes().write(m).into());
                }
                if let Some(v) = fields.get("shapes").cloned() {
                    let shapes = self.shapes(&full, &v, &b.home);
                    set(&mut fields, &["shapes".into()], &shapes);
                }
                (name, fields)
            })
            .collect();
        let parts = here.parts.into_iter().map(|(name, node)| {
            let value = match node {
                Node::Model(m) => self.model(&m),
                Node::Assembly(inner) => self.instance(inner),
            };
            (name, value)
        });
        let parts: Vec<(String, Located)> = parts.collect();
        if !bodies.is_empty() {
            out.push(("bodies", Value::Map(bodies).into()));
        }
        for (field, items) in [("loops", &here.loops), ("couplings", &here.couplings)] {
            let told = items.iter().map(|(name, item)| {
                let told = self.told.constraints.get(&full_name(&here.path, name));
                (name.clone(), told.unwrap_or(&item.fields).clone())
            });
            let told: Vec<(String, Located)> = told.collect();
            if !told.is_empty() {
                out.push((field, Value::Map(told).into()));
            }
        }
        let colliders = here
            .colliders
            .iter()
            .map(|(name, item)| (name.clone(), self.collider(&full_name(&here.path, name), item)));
        let colliders: Vec<(String, Located)> = colliders.collect();
        if !colliders.is_empty() {
            out.push(("colliders", Value::Map(colliders).into()));
        }
        out.extend(here.self_collision.map(|s| ("self_collision", s)));
        out.extend(here.ignore.map(|s| ("ignore", s)));
        out.push(("parts", Value::Map(parts).into()));
        map(out)
    }

    fn model(&self, m: &ModelInst) -> Located {
        let mut out = vec![("model", text(&*m.model.text))];
        if !m.doc.is_empty() {
            out.push(("doc", text(&*m.doc)));
        }
        if !entries(&m.params).is_empty() {
            out.push(("params", m.params.clone()));
        }
        out.extend(m.rate.clone().map(|r| ("rate", r)));
        out.extend(m.offset.clone().map(|o| ("offset", o)));
        let bind = self.binds.get(&*m.path).into_iter().flatten().map(|b| {
            let target = match &b.target {
                BindTarget::Node(node) => format!("node:/{node}"),
                BindTarget::Hinge { body, index } => format!("hinge:/{body}[{index}]"),
                BindTarget::Loop { name, index } => format!("loop:/{name}[{index}]"),
                BindTarget::Field(path) => format!("field:{path}"),
            };
            (b.bind.clone(), text(target))
        });
        let bind: Vec<(String, Located)> = bind.collect();
        if !bind.is_empty() {
            out.push(("bind", Value::Map(bind).into()));
        }
        if let Some(folder) = &m.folder {
            out.push(("folder", text(folder.display().to_string())));
        }
        map(out)
    }

    /// Returns shapes with meshes by their resolved paths, and collision shapes without files.
    fn shapes(&self, body: &str, v: &Located, home: &Home) -> Located {
        let mut out = self.meshes(v, home);
        let Value::List(items) = &mut out.value else { return out };
        for (k, spec) in self.told.colliders.get(body).into_iter().flatten() {
            let Some(item) = items.get_mut(*k) else { continue };
            let Some(mut collide) = item.get("collide").cloned() else { continue };
            let own = collide.get("shape").or(item.get("shape"));
            let fine = own.is_some_and(from_file);
            let coarse = collide.get("coarse").is_some_and(from_file);
            if fine || coarse {
                geometry(&mut collide, spec, [fine, coarse]);
                set(item, &["collide".into()], &collide);
            }
        }
        out
    }

    /// Returns a separate collider without files.
    fn collider(&self, full: &str, item: &ItemInst) -> Located {
        let mut out = item.fields.clone();
        if let Some(on) = self.told.on.get(full) {
            set(&mut out, &["on".into()], &text(on));
        }
        let files = ["shape", "coarse"].map(|f| out.get(f).is_some_and(from_file));
        if let Some(spec) = self.told.standing.get(full).filter(|_| files.contains(&true)) {
            geometry(&mut out, spec, files);
        }
        out
    }

    /// Replaces mesh files by their resolved paths.
    fn meshes(&self, v: &Located, home: &Home) -> Located {
        let value = match &v.value {
            Value::List(items) => Value::List(items.iter().map(|i| self.meshes(i, home)).collect()),
            Value::Map(entries) => {
                Value::Map(entries.iter().map(|(k, i)| (k.clone(), self.meshes(i, home))).collect())
            }
            Value::Variant(name, inner) => {
                let mut inner = self.meshes(inner, home);
                if name == "Mesh"
                    && let Some(Value::Text(file)) = inner.get("file").map(|f| &f.value)
                    && let Some(found) = self.files.data(file, home)
                {
                    set(&mut inner, &["file".into()], &text(found));
                }
                Value::Variant(name.clone(), Box::new(inner))
            }
            other => other.clone(),
        };
        value.into()
    }
}

/// Returns true for a hull or mesh from a file.
fn from_file(v: &Located) -> bool {
    matches!(&v.value, Value::Variant(_, inner) if inner.get("file").is_some())
}

/// Inserts the fine or coarse geometry, if it comes from a file.
fn geometry(fields: &mut Located, spec: &ColliderSpec, [fine, coarse]: [bool; 2]) {
    if fine {
        set(fields, &["shape".into()], &solid::value(&spec.fine).into());
    }
    if let Some(shape) = spec.coarse.as_ref().filter(|_| coarse) {
        set(fields, &["coarse".into()], &solid::value(shape).into());
    }
}
