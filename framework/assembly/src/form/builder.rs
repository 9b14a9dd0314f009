//! Builder of assemblies in Rust: it produces the same form as RON files, and can print that RON.
//!
//! ```
//! use linkwork_assembly::{Assembly, fields, variant};
//! let wheel = Assembly::new("Wheel")
//!     .doc("A wheel on an axle.")
//!     .param("mass", fields! { unit: "kg", default: 10.0, doc: "Mass of the wheel." })
//!     .body("wheel", fields! {
//!         parent: "world", hinge: variant("Pin", [0.0, 1.0, 0.0]),
//!         mass: "$mass", inertia: variant("Sphere", 0.2),
//!     })
//!     .part("Motor", "actuators.dc_motor", fields! { resistance: "0.6 ohm" })
//!     .bind("Motor", "shaft", "hinge:wheel")
//!     .export("volts", "Motor.volts");
//! assert!(wheel.to_ron().starts_with("Assembly("));
//! ```
use crate::form::assembly::{
    self, Assembly, AssemblyForm, PartForm, PartKind, read_assembly, read_part,
};
use crate::form::wire::{WireText, write_wire};
use crate::schema::read::fields as known_fields;
use crate::schema::record::Record;
use crate::scope::parameters::read_param;
use crate::text::parse::parse;
use crate::text::print::document;
use crate::text::report::{Cx, tidy};
use crate::text::show::Failure;
use crate::text::value::{IntoValue, Text, empty_map, entries, set};
use linkwork_runtime::{Located, Origin, Value, WireTiming};

/// A map: `fields! { resistance: "0.6 ohm", "gear": 20.0 }`.
#[macro_export]
macro_rules! fields {
    (@key $key:ident) => { ::std::string::String::from(stringify!($key)) };
    (@key $key:literal) => { ::std::string::String::from($key) };
    ($($key:tt : $value:expr),* $(,)?) => {
        $crate::Value::Map(vec![
            $(($crate::fields!(@key $key), $crate::IntoValue::into_value($value).into())),*
        ])
    };
}

fn text(t: &str) -> Located {
    Value::Text(t.into()).into()
}

impl Assembly {
    /// An empty one.
    #[must_use]
    pub fn new(name: &str) -> Assembly {
        Assembly { name: Some(name.into()), ..Assembly::default() }
    }

    /// Documentation.
    #[must_use]
    pub fn doc(mut self, doc: &str) -> Self {
        self.doc = doc.into();
        self
    }

    /// A parameter: `fields! { unit: "m", default: 0.25, range: [1e-3, 5.0], doc: ".." }`.
    ///
    /// # Panics
    /// If these are not the fields of a parameter, which is a bug in the calling program.
    #[must_use]
    pub fn param(mut self, name: &str, fields: Value) -> Self {
        let mut cx = Cx::default();
        let decl = read_param(&mut cx, name, &fields.into());
        assert!(cx.faults.is_empty(), "{}", linkwork_runtime::Faults(cx.faults));
        self.params.insert(name.into(), decl);
        self
    }

    /// Adds a mount and its description.
    #[must_use]
    pub fn mount(mut self, name: &str, doc: &str) -> Self {
        let decl = assembly::MountDecl { doc: doc.into(), origin: Origin::NONE };
        self.mounts.insert(name.into(), decl);
        self
    }

    /// Adds a body, with the fields of a body in RON.
    #[must_use]
    pub fn body(mut self, name: &str, fields: Value) -> Self {
        self.bodies.insert(name.into(), item(fields));
        self
    }

    /// Adds a loop, with the fields of a loop in RON: `fields! { a: "crank/pin", b: "rod", hinge: .. }`.
    #[must_use]
    pub fn loop_closure(mut self, name: &str, fields: Value) -> Self {
        self.loops.insert(name.into(), item(fields));
        self
    }

    /// Adds a coupling: `fields! { terms: fields! { left: 1.0, right: 1.0 } }`.
    #[must_use]
    pub fn coupling(mut self, name: &str, fields: Value) -> Self {
        self.couplings.insert(name.into(), item(fields));
        self
    }

    /// Adds a collision shape: `fields! { on: "world", shape: variant("HalfSpace", Value::Null) }`.
    #[must_use]
    pub fn collider(mut self, name: &str, fields: Value) -> Self {
        self.colliders.insert(name.into(), item(fields));
        self
    }

    /// Adds non-smooth contact: `fields! { margin: "1 cm", friction: 0.6 }`.
    #[must_use]
    pub fn contact(mut self, fields: Value) -> Self {
        self.contact = Some(fields.into());
        self
    }

    /// Disables collisions between bodies of this assembly and of its parts, except the pairs in `collide` of `contact`.
    #[must_use]
    pub fn without_self_collision(mut self) -> Self {
        self.self_collision = Some(Value::Bool(false).into());
        self
    }

    fn with_part(mut self, name: &str, fields: Value) -> Self {
        if let Some(part) = read_part(&mut Cx::default(), name, &fields.into()) {
            self.parts.insert(name.into(), part);
        }
        self
    }

    /// Adds a model or service with its parameters.
    #[must_use]
    pub fn part(self, name: &str, model: &str, params: Value) -> Self {
        self.with_part(name, fields! { model: model, params: params })
    }

    /// Adds an assembly in a separate file, with parameters and mounts.
    #[must_use]
    pub fn include(self, name: &str, file: &str, params: Value, mounts: Value) -> Self {
        self.with_part(name, fields! { assembly: file, params: params, mounts: mounts })
    }

    /// Adds another assembly in place, in the scope of the surrounding parameters and bodies.
    #[must_use]
    pub fn nest(mut self, name: &str, inner: Assembly) -> Self {
        let doc = inner.doc.clone();
        let inner = Assembly { name: None, ..inner };
        let kind = PartKind::Inline(Box::new(inner));
        let part = PartForm { kind, params: empty_map(), array: None, doc, origin: Origin::NONE };
        self.parts.insert(name.into(), part);
        self
    }

    /// Sets the sample period of a model: `"50 Hz"`.
    ///
    /// # Panics
    /// If the model does not exist, which is a bug in the calling program.
    #[must_use]
    pub fn rate(mut self, part: &str, period: &str) -> Self {
        match self.parts.get_mut(part).map(|p| &mut p.kind) {
            Some(PartKind::Model { rate, .. }) => *rate = Some(text(period)),
            _ => panic!("there is no model `{part}` to set a rate on"),
        }
        self
    }

    /// Binds a model to a node or hinge: `.bind("Motor", "shaft", "hinge:wheel")`.
    ///
    /// # Panics
    /// If the model does not exist, which is a bug in the calling program.
    #[must_use]
    pub fn bind(mut self, part: &str, binding: &str, target: &str) -> Self {
        match self.parts.get_mut(part).map(|p| &mut p.kind) {
            Some(PartKind::Model { bind, .. }) => set(bind, &[binding.to_string()], &text(target)),
            _ => panic!("there is no model `{part}` to bind"),
        }
        self
    }

    /// Adds a wire: `"Drive.volts[*] -> Wheel[*].volts"`.
    #[must_use]
    pub fn wire(mut self, wire: &str) -> Self {
        self.wires.push(WireText { text: Text::new(wire), timing: WireTiming::AtOnce });
        self
    }

    /// Connects two or more connectors: `["Motor.supply", "Battery.terminal"]`.
    #[must_use]
    pub fn connect<const N: usize>(mut self, connectors: [&str; N]) -> Self {
        self.connect.push(connectors.iter().map(|c| Text::new(*c)).collect());
        self
    }

    /// Exports a port of a part as a port of this assembly.
    #[must_use]
    pub fn export(mut self, name: &str, port: &str) -> Self {
        self.exports.insert(name.into(), Text::new(port));
        self
    }

    /// Sets a parameter deep below.
    #[must_use]
    pub fn set(mut self, path: &str, value: impl IntoValue) -> Self {
        self.overrides.push((Text::new(path), value.into_value().into()));
        self
    }

    /// Reads an `Assembly(..)` text into this form, without expanding it.
    ///
    /// # Errors
    /// All mistakes in its structure.
    pub fn from_ron(name: &str, ron: &str) -> Result<Assembly, Failure> {
        let mut cx = Cx::default();
        let file = cx.sources.add(name, ron);
        let read = parse(&mut cx, file).and_then(|v| match v.value {
            Value::Variant(kind, mut inner) if kind == "Assembly" => {
                let what = format!("assembly `{name}`");
                known_fields(&mut cx, &inner, &what, &AssemblyForm::names());
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

    /// Returns RON text that reads back as the same form.
    #[must_use]
    pub fn to_ron(&self) -> String {
        document(&Value::Variant("Assembly".into(), Box::new(self.to_map().into())))
    }

    /// Returns the RON text of a simulation with this assembly, with settings such as `fields! { step: "1 ms", until: "10 s" }`.
    #[must_use]
    pub fn to_simulation(&self, settings: Value) -> String {
        let mut map: Located = settings.into();
        let name = self.name.clone().unwrap_or_else(|| "Assembly".into());
        let inner = Assembly { name: None, ..self.clone() };
        set(&mut map, &["parts".into(), name], &inner.to_map().into());
        document(&Value::Variant("Simulation".into(), Box::new(map)))
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

fn item(fields: Value) -> assembly::ItemForm {
    assembly::ItemForm { fields: fields.into(), origin: Origin::NONE }
}

/// `contact: ()` enables contact, so it must be written although it is empty.
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
