//! One RON text that loads to the same `Spec` without any other file, for logs and checkpoints.
use crate::context::entries;
use crate::expand::{Instance, ModelInst, Node};
use crate::files::{Files, Home};
use crate::print::document;
use crate::reference::full_name;
use linkwork_runtime::{BindSpec, BindTarget, Located, Spec, Value};
use std::collections::BTreeMap;

struct Printer<'a> {
    files: &'a Files<'a>,
    parents: &'a BTreeMap<String, String>,
    binds: &'a [BindSpec],
}

fn text(t: impl Into<String>) -> Located {
    Value::Text(t.into()).into()
}

fn map(entries: Vec<(&str, Located)>) -> Located {
    Value::Map(entries.into_iter().map(|(k, v)| (k.to_string(), v)).collect()).into()
}

/// Everything expanded: no includes, parameters, mounts, arrays or overrides are left.
fn value(
    root: &Instance,
    files: &Files<'_>,
    settings: &Located,
    spec: &Spec,
    parents: &BTreeMap<String, String>,
) -> Value {
    let p = Printer { files, parents, binds: &spec.binds };
    let mut out = vec![("resolved", Value::Bool(true).into())];
    let drop = [
        "assembly",
        "name",
        "params",
        "import",
        "bodies",
        "parts",
        "wires",
        "exports",
        "overrides",
        "resolved",
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
        let wires = spec.wires.iter().map(|w| text(format!("{} -> {}", w.from, w.to)));
        all.push(("wires".into(), Value::List(wires.collect()).into()));
        return Value::Variant("Simulation".into(), Box::new(Value::Map(all).into()));
    }
    Value::Null
}

/// The text of everything.
pub(crate) fn text_all(
    root: &Instance,
    files: &Files<'_>,
    settings: &Located,
    spec: &Spec,
    parents: &BTreeMap<String, String>,
) -> String {
    document(&value(root, files, settings, spec, parents))
}

impl Printer<'_> {
    fn instance(&self, here: &Instance) -> Located {
        let mut out = Vec::new();
        if !here.doc.is_empty() {
            out.push(("doc", text(&*here.doc)));
        }
        let bodies: Vec<(String, Located)> = here
            .bodies
            .iter()
            .map(|(name, b)| {
                let mut fields = b.fields.clone();
                let full = full_name(&here.path, name);
                if let Some(parent) = self.parents.get(&full) {
                    crate::context::set(&mut fields, &["parent".into()], &text(parent));
                }
                if let Some(v) = fields.get("shapes").cloned() {
                    let shapes = self.meshes(&v, &b.home);
                    crate::context::set(&mut fields, &["shapes".into()], &shapes);
                }
                (name.clone(), fields)
            })
            .collect();
        let parts = here.parts.iter().map(|(name, node)| {
            let value = match node {
                Node::Model(m) => self.model(m),
                Node::Assembly(inner) => self.instance(inner),
            };
            (name.clone(), value)
        });
        let parts: Vec<(String, Located)> = parts.collect();
        if !bodies.is_empty() {
            out.push(("bodies", Value::Map(bodies).into()));
        }
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
        let bind = self.binds.iter().filter(|b| b.part == m.path).map(|b| {
            let target = match &b.target {
                BindTarget::Node(node) => format!("node:/{node}"),
                BindTarget::Hinge { body, index } => format!("hinge:/{body}[{index}]"),
                BindTarget::Loop { name, index } => format!("loop:/{name}[{index}]"),
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

    /// Mesh files by the path at which they were found.
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
                    crate::context::set(&mut inner, &["file".into()], &text(found));
                }
                Value::Variant(name.clone(), Box::new(inner))
            }
            other => other.clone(),
        };
        value.into()
    }
}
