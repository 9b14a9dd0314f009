//! Assemblies as text: RON to the form, and the form to RON that reads back as the same form.
use crate::form::assembly::{AssemblyFields, AssemblyForm, PartForm, PartKind, read_assembly};
use crate::form::wire::write_wire;
use crate::schema::read::fields as known_fields;
use crate::schema::record::Record;
use crate::text::parse::parse;
use crate::text::print::document;
use crate::text::report::{Cx, tidy};
use crate::text::show::Failure;
use crate::text::value::{Text, entries};
use linkwork_runtime::{Located, Value};

fn text(t: &str) -> Located {
    Value::Text(t.into()).into()
}

impl AssemblyForm {
    /// Reads an `Assembly(..)` text into this form, without expanding it.
    ///
    /// # Errors
    /// Everything that is wrong with its structure, at once.
    pub fn from_ron(name: &str, ron: &str) -> Result<AssemblyForm, Failure> {
        let mut cx = Cx::default();
        let file = cx.sources.add(name, ron);
        let read = parse(&mut cx, file).and_then(|v| match v.value {
            Value::Variant(kind, mut inner) if kind == "Assembly" => {
                let what = format!("assembly `{name}`");
                known_fields(&mut cx, &inner, &what, &AssemblyFields::names());
                Some(read_assembly(&mut cx, &mut inner, &what))
            }
            _ => {
                cx.fault(
                    v.origin,
                    format!("`{name}` is not an assembly"),
                    "begin with `Assembly(`",
                );
                None
            }
        });
        match read {
            Some(assembly) if cx.faults.is_empty() => Ok(assembly),
            _ => Err(Failure { faults: tidy(cx.faults), sources: cx.sources }),
        }
    }

    /// Returns RON that reads back as the same form.
    #[must_use]
    pub fn to_ron(&self) -> String {
        document(&Value::Variant("Assembly".into(), Box::new(self.to_map().into())))
    }

    fn to_map(&self) -> Value {
        let mut out: Vec<(String, Located)> = Vec::new();
        let mut put = |key: &str, v: Value| match &v {
            Value::Map(entries) if entries.is_empty() => {}
            Value::List(items) if items.is_empty() => {}
            Value::Text(t) if t.is_empty() => {}
            Value::Null => {}
            _ => out.push((key.into(), v.into())),
        };
        put("doc", Value::Text(self.doc.clone()));
        put("name", Value::Text(self.name.clone().unwrap_or_default()));
        put(
            "params",
            table(self.params.iter(), |p| {
                let mut out = Vec::new();
                let unit = p.unit.as_ref().map(|u| text(&u.text));
                out.extend(unit.map(|u| ("unit".to_string(), u)));
                out.extend(p.default.clone().map(|d| ("default".to_string(), d)));
                out.extend(p.range_written.clone().map(|r| ("range".to_string(), r)));
                out.push(("doc".into(), text(&p.doc)));
                Value::Map(out)
            }),
        );
        put("mounts", table(self.mounts.iter(), |m| Value::Text(m.doc.clone())));
        put("import", self.imports.as_ref().map_or(Value::Null, |i| i.value.clone()));
        put("bodies", table(self.bodies.iter(), |b| b.fields.value.clone()));
        put("loops", table(self.loops.iter(), |l| l.fields.value.clone()));
        put("couplings", table(self.couplings.iter(), |c| c.fields.value.clone()));
        put("colliders", table(self.colliders.iter(), |c| c.fields.value.clone()));
        put("contact", self.contact.as_ref().map_or(Value::Null, contact));
        let own = self.self_collision.as_ref();
        put("self_collision", own.map_or(Value::Null, |s| s.value.clone()));
        put("ignore", self.ignore.as_ref().map_or(Value::Null, |s| s.value.clone()));
        put("parts", table(self.parts.iter(), part));
        let wires = self.wires.iter();
        let wires = wires.map(|w| write_wire(w.text.text.clone(), &w.timing).into()).collect();
        put("wires", Value::List(wires));
        let entry =
            |ends: &Vec<Text>| Value::List(ends.iter().map(|t| text(&t.text)).collect()).into();
        put("connect", Value::List(self.connect.iter().map(entry).collect()));
        put("exports", table(self.exports.iter(), |t| Value::Text(t.text.clone())));
        let overrides = self.overrides.iter().map(|(path, v)| (path.text.clone(), v.clone()));
        put("overrides", Value::Map(overrides.collect()));
        Value::Map(out)
    }
}

/// `contact: ()` switches contact on, and must not get lost.
fn contact(written: &Located) -> Value {
    match &written.value {
        Value::Map(fields) if !fields.is_empty() => written.value.clone(),
        Value::Map(_) | Value::Null => Value::Bool(true),
        other => other.clone(),
    }
}

fn table<'t, T: 't>(
    entries: impl Iterator<Item = (&'t String, &'t T)>,
    value: impl Fn(&T) -> Value,
) -> Value {
    Value::Map(entries.map(|(k, t)| (k.clone(), value(t).into())).collect())
}

fn part(p: &PartForm) -> Value {
    let mut out: Vec<(String, Located)> = Vec::new();
    let mut put = |key: &str, v: Option<Located>| {
        out.extend(
            v.filter(|v| !matches!(&v.value, Value::Map(m) if m.is_empty()))
                .map(|v| (key.to_string(), v)),
        );
    };
    let doc = (!p.doc.is_empty()).then(|| text(&p.doc));
    match &p.kind {
        PartKind::Model { model, rate, offset, bind, folder } => {
            put("model", Some(text(&model.text)));
            put("doc", doc);
            put("params", Some(p.params.clone()));
            put("rate", rate.clone());
            put("offset", offset.clone());
            put("bind", Some(bind.clone()));
            put("folder", folder.as_ref().map(|f| text(&f.text)));
        }
        PartKind::File { assembly, mounts, overrides, stowed } => {
            put("assembly", Some(text(&assembly.text)));
            put("doc", doc);
            put("params", Some(p.params.clone()));
            put("mounts", Some(mounts.clone()));
            put("overrides", Some(overrides.clone()));
            put("stowed", stowed.clone());
        }
        PartKind::Inline(inner) => {
            for (key, v) in entries(&inner.to_map().into()) {
                put(key, Some(v.clone()));
            }
        }
    }
    put("array", p.array.clone().map(|a| Value::List(a).into()));
    Value::Map(out)
}
