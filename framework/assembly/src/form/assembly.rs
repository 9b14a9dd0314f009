//! The intermediate form: an assembly as written in a file, before parameters are replaced.
//!
//! Both RON files and the Rust builder produce this form. Values that may contain `$name` stay unparsed, with their positions.
use crate::body::BodyFields;
use crate::body::collider::{Standing, Surface};
use crate::body::constraint::{CouplingForm, LoopForm};
use crate::body::contact::ContactForm;
use crate::form::import::ImportForm;
use crate::form::stowed::StowedForm;
use crate::form::wire::{WireText, connect_schema, read_connection, read_wire, wire_schema};
use crate::schema::describe::Schema;
use crate::schema::kind::{Kind, list_of, period, raw, table_of, text};
use crate::schema::read::{self, fields, list, name, table, text_field};
use crate::schema::record::{Presence, Record, of, record};
use crate::scope::parameters::{ParamDecl, ParamForm, read_param};
use crate::text::report::Cx;
use crate::text::value::{Text, empty_map, is_unknown};
use linkwork_runtime::{Located, Origin, Value};
use std::collections::{BTreeMap, BTreeSet};

/// A mount: a body or node that the parent must provide.
#[derive(Clone, Debug, PartialEq)]
pub struct MountDecl {
    /// Meaning.
    pub doc: String,
    /// Position in the file.
    pub origin: Origin,
}

/// Kind of a part.
#[derive(Clone, Debug, PartialEq)]
pub enum PartKind {
    /// A model or service of the catalogue.
    Model {
        /// Its name there.
        model: Text,
        /// Sample period.
        rate: Option<Located>,
        /// First sample.
        offset: Option<Located>,
        /// Nodes and hinges: binding → target.
        bind: Located,
        /// Folder in which its files are searched first.
        folder: Option<Text>,
    },
    /// An assembly in a separate file.
    File {
        /// The file.
        assembly: Text,
        /// Mount → body or node.
        mounts: Located,
        /// Deep parameters.
        overrides: Located,
        /// For stowed cargo: the body that carries it, and the pose.
        stowed: Option<Located>,
    },
    /// An assembly written in place, in the scope of the surrounding parameters.
    Inline(Box<AssemblyForm>),
}

/// A part as written in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct PartForm {
    /// Its kind.
    pub kind: PartKind,
    /// Parameters (a map).
    pub params: Located,
    /// Elements of an array.
    pub array: Option<Vec<Located>>,
    /// Documentation.
    pub doc: String,
    /// Position of its name in the file.
    pub origin: Origin,
}

/// A body, loop, coupling or collider as written in a file, before its parameters are replaced.
#[derive(Clone, Debug, PartialEq)]
pub struct ItemForm {
    /// The fields.
    pub fields: Located,
    /// Position of its name in the file.
    pub origin: Origin,
}

/// An assembly as written in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AssemblyForm {
    /// Name, if it is used alone.
    pub name: Option<String>,
    /// Documentation.
    pub doc: String,
    /// Parameters.
    pub params: BTreeMap<String, ParamDecl>,
    /// Attachment points.
    pub mounts: BTreeMap<String, MountDecl>,
    /// Files whose bodies are added: none, one, or a list.
    pub imports: Option<Located>,
    /// Bodies.
    pub bodies: BTreeMap<String, ItemForm>,
    /// Hinges that close loops.
    pub loops: BTreeMap<String, ItemForm>,
    /// Linear relations between hinge coordinates.
    pub couplings: BTreeMap<String, ItemForm>,
    /// Collision shapes on bodies and on the world, in addition to those of `shapes`.
    pub colliders: BTreeMap<String, ItemForm>,
    /// Non-smooth contact: settings of the solver, and collision rules.
    pub contact: Option<Located>,
    /// Whether its bodies, including those of its parts, collide with each other.
    pub self_collision: Option<Located>,
    /// Pairs of its bodies or colliders that do not collide, independent of where `contact` is written.
    pub ignore: Option<Located>,
    /// Parts.
    pub parts: BTreeMap<String, PartForm>,
    /// Wires.
    pub wires: Vec<WireText>,
    /// Connected connectors: each entry lists two or more.
    pub connect: Vec<Vec<Text>>,
    /// Exported ports.
    pub exports: BTreeMap<String, Text>,
    /// Deep parameters: path → value.
    pub overrides: Vec<(Text, Located)>,
    /// Parts that could not be read; references to them do not cause further faults.
    pub(crate) broken: BTreeSet<String>,
}

record! {
    /// The fields of an assembly.
    pub(crate) struct AssemblyFields: "assembly" {
        /// Documentation.
        doc: Option<Text> = text().maybe(),
        /// Name, if it is used alone.
        name: Option<Text> = text().maybe(),
        /// Parameters by name.
        params: Option<Located> = raw(|| table_of(of::<ParamForm>()).describe()).maybe(),
        /// Bodies or nodes that the parent must provide, each with its description.
        mounts: Option<Located> = raw(|| table_of(text()).describe()).maybe(),
        /// URDF, MJCF or SDF files whose bodies are added: one, or a list.
        import: Option<Located> = raw(import_schema).maybe(),
        /// Bodies by name.
        bodies: Option<Located> = raw(|| table_of(of::<BodyFields>()).describe()).maybe(),
        /// Hinges that close loops, by name.
        loops: Option<Located> = raw(|| table_of(of::<LoopForm>()).describe()).maybe(),
        /// Linear relations between hinge coordinates, by name.
        couplings: Option<Located> = raw(|| table_of(of::<CouplingForm>()).describe()).maybe(),
        /// Collision shapes on bodies and on the world, by name.
        colliders: Option<Located> = raw(|| table_of(of::<(Standing, Surface)>()).describe()).maybe(),
        /// Settings of contact, and collision rules.
        contact: Option<Located> = raw(|| Schema::Any(vec![Schema::Flag, ContactForm::describe()])).maybe(),
        /// `false`: bodies of this assembly and of its parts do not collide with each other.
        self_collision: Option<Located> = raw(|| Schema::Flag).maybe(),
        /// Pairs of bodies or colliders of this assembly that do not collide: `[["arm", "base"]]`.
        ignore: Option<Located> = raw(|| list_of(list_of(text())).describe()).maybe(),
        /// The world: planet, date, rotation and site of the whole simulation; see `linkwork describe environment.world`.
        world: Option<Located> = raw(anything).maybe(),
        /// Parts by name.
        parts: Option<Located> = raw(|| Schema::Table(Box::new(part_schema()))).maybe(),
        /// Wires: `"Part.output -> Part.input"`.
        wires: Option<Located> = raw(|| Schema::List(Box::new(wire_schema()), None)).maybe(),
        /// Connected connectors, two or more per entry: `("Motor.supply", "Battery.terminal")`.
        connect: Option<Located> = raw(connect_schema).maybe(),
        /// Exported ports, by name.
        exports: Option<Located> = raw(|| table_of(text()).describe()).maybe(),
        /// Deep parameters by path.
        overrides: Option<Located> = raw(|| Schema::Table(Box::new(Schema::Any(Vec::new())))).maybe(),
    }
}

record! {
    /// A part that is a model or service of the catalogue.
    pub(crate) struct ModelForm: "model" {
        /// Its name there.
        model: Option<Text> = text().maybe(),
        /// Its parameters; see `linkwork describe`.
        params: Option<Located> = raw(anything).maybe(),
        /// Sample period, of sampled models.
        rate: Option<Located> = raw(|| period().describe()).maybe(),
        /// Time of the first sample.
        offset: Option<Located> = raw(|| period().describe()).maybe(),
        /// Binding → node, `hinge:BODY` or `loop:LOOP`.
        bind: Option<Located> = raw(anything).maybe(),
        /// Elements of an array, each with its differences.
        array: Option<Located> = raw(|| Schema::List(Box::new(anything()), None)).maybe(),
        /// Documentation.
        doc: Option<Text> = text().maybe(),
        /// Folder in which its files are searched first.
        folder: Option<Text> = text().maybe(),
    }
}
record! {
    /// A part that is an assembly in a separate file.
    struct FileForm: "assembly file" {
        /// The file: relative to this one, then in the search folders, then embedded.
        assembly: Option<Text> = text().maybe(),
        /// Values of its parameters.
        params: Option<Located> = raw(anything).maybe(),
        /// Mount → body or node.
        mounts: Option<Located> = raw(anything).maybe(),
        /// Deep parameters by path.
        overrides: Option<Located> = raw(anything).maybe(),
        /// If set, only the bodies of the part exist, as one rigid piece attached to another body.
        stowed: Option<Located> = raw(StowedForm::describe).maybe(),
        /// Elements of an array, each with its differences.
        array: Option<Located> = raw(|| Schema::List(Box::new(anything()), None)).maybe(),
        /// Documentation.
        doc: Option<Text> = text().maybe(),
    }
}

fn anything() -> Schema {
    Schema::Any(Vec::new())
}

fn import_schema() -> Schema {
    let one = ImportForm::describe();
    Schema::Any(vec![one.clone(), Schema::List(Box::new(one), None)])
}

/// The field that defines the world, and the part that it creates.
const WORLD: &str = "world";
/// The model of that part.
const WORLD_MODEL: &str = "environment.world";

/// Fields that an assembly written in place does not have.
const STANDING_ALONE: [&str; 2] = ["name", "mounts"];

/// Returns the schema of a part: a model, an assembly file, or an assembly written in place.
fn part_schema() -> Schema {
    Schema::Named("part", || {
        let inline = Schema::Record("assembly in place", || {
            let mut fields = AssemblyFields::fields();
            fields.retain(|f| !STANDING_ALONE.contains(&f.name));
            fields
        });
        Schema::Any(vec![ModelForm::describe(), FileForm::describe(), inline])
    })
}

/// Reads the fields of an assembly (the caller has checked for unknown ones). Bodies, loops, couplings and colliders are moved out of the value.
pub(crate) fn read_assembly(cx: &mut Cx, v: &mut Located, what: &str) -> AssemblyForm {
    let mut a = AssemblyForm {
        doc: doc(cx, v, what),
        name: text_field(cx, v, "name", what).map(|t| t.text),
        imports: v.get("import").filter(|i| i.value != Value::Null).cloned(),
        ..AssemblyForm::default()
    };
    let field_of = |field: &str| format!("{what}: `{field}`");
    if let Some(params) = v.get("params") {
        for (key, value) in table(cx, params, field_of("params")) {
            name_at(cx, key, value, "parameter");
            a.params.insert(key.clone(), read_param(cx, key, value));
        }
    }
    if let Some(mounts) = v.get("mounts") {
        for (key, value) in table(cx, mounts, field_of("mounts")) {
            name_at(cx, key, value, "mount");
            let doc = read::text(cx, value, format!("mount `{key}`"));
            let doc = doc.map(|t| t.text).unwrap_or_default();
            a.mounts.insert(key.clone(), MountDecl { doc, origin: cx.key(value) });
        }
    }
    a.bodies = items(cx, v, ("bodies", "body"), what);
    a.loops = items(cx, v, ("loops", "loop"), what);
    a.couplings = items(cx, v, ("couplings", "coupling"), what);
    a.colliders = items(cx, v, ("colliders", "collider"), what);
    a.contact = v.get("contact").cloned();
    a.self_collision = v.get("self_collision").filter(|s| s.value != Value::Null).cloned();
    a.ignore = v.get("ignore").filter(|s| s.value != Value::Null).cloned();
    if let Some(parts) = v.get("parts") {
        for (key, value) in table(cx, parts, field_of("parts")) {
            name_at(cx, key, value, "part");
            if let Some(part) = read_part(cx, key, value) {
                a.parts.insert(key.clone(), part);
            } else {
                a.broken.insert(key.clone());
            }
        }
    }
    if let Some(world) = v.get("world").filter(|w| w.value != Value::Null) {
        let origin = cx.key(world);
        let params = map_field(cx, v, WORLD, what);
        let none = || empty_map();
        let model = Text { text: WORLD_MODEL.into(), origin };
        let kind = PartKind::Model { model, rate: None, offset: None, bind: none(), folder: None };
        let part = PartForm { kind, params, array: None, doc: String::new(), origin };
        if a.parts.insert(WORLD.into(), part).is_some() {
            let message = format!("{what}: there is both a part and a field `{WORLD}`");
            cx.fault(origin, message, "rename the part");
        }
    }
    if let Some(wires) = v.get("wires") {
        for wire in list(cx, wires, field_of("wires")) {
            a.wires.extend(read_wire(cx, wire));
        }
    }
    if let Some(connect) = v.get("connect") {
        for entry in list(cx, connect, field_of("connect")) {
            a.connect.extend(read_connection(cx, entry));
        }
    }
    if let Some(exports) = v.get("exports") {
        for (key, value) in table(cx, exports, field_of("exports")) {
            // `drive.rate` and `drive.brake` are a group: one wire to `drive` connects both.
            key.split('.').for_each(|piece| name_at(cx, piece, value, "export"));
            if let Some(t) = read::text(cx, value, format!("export `{key}`")) {
                a.exports.insert(key.clone(), t);
            }
        }
    }
    if let Some(overrides) = v.get("overrides") {
        a.overrides = read_overrides(cx, overrides, &field_of("overrides"));
    }
    a
}

/// Checks that a key is a valid name.
fn name_at(cx: &mut Cx, key: &str, v: &Located, kind: &str) {
    let origin = cx.key(v);
    name(cx, key, origin, kind);
}

/// Returns name → fields for a field such as `bodies`, whose entries are each a `body`.
fn items(
    cx: &mut Cx,
    v: &mut Located,
    (field, kind): (&str, &str),
    what: &str,
) -> BTreeMap<String, ItemForm> {
    let Some(written) = v.get_mut(field) else { return BTreeMap::new() };
    table(cx, written, format_args!("{what}: `{field}`"));
    let Value::Map(entries) = &mut written.value else { return BTreeMap::new() };
    let mut item = |(key, fields): (String, Located)| {
        let origin = cx.key(&fields);
        name(cx, &key, origin, kind);
        (key, ItemForm { fields, origin })
    };
    std::mem::take(entries).into_iter().map(&mut item).collect()
}

/// Path → value.
pub(crate) fn read_overrides(cx: &mut Cx, v: &Located, what: &str) -> Vec<(Text, Located)> {
    table(cx, v, what)
        .iter()
        .map(|(key, value)| (Text { text: key.clone(), origin: cx.key(value) }, value.clone()))
        .collect()
}

/// Returns a field that is a map; empty if it is missing or not a map (a fault is added).
pub(crate) fn map_field(cx: &mut Cx, v: &Located, field: &str, what: &str) -> Located {
    let Some(written) = v.get(field) else { return empty_map() };
    if is_unknown(written) {
        // With `params: "$world"`, the map is known only after substitution of the parameter.
        return written.clone();
    }
    table(cx, written, format!("{what}: `{field}`"));
    if matches!(written.value, Value::Map(_)) { written.clone() } else { empty_map() }
}

fn doc(cx: &mut Cx, v: &Located, what: &str) -> String {
    text_field(cx, v, "doc", what).map(|t| t.text).unwrap_or_default()
}

/// Returns the fields that only an assembly written in place has.
fn inline_marks() -> Vec<&'static str> {
    let not = [&STANDING_ALONE[..], &FileForm::names()].concat();
    AssemblyFields::names().into_iter().filter(|f| !not.contains(f)).collect()
}

/// Reads a part; `None` if its kind is not determined or it is not a map (a fault is added).
pub(crate) fn read_part(cx: &mut Cx, key: &str, v: &Located) -> Option<PartForm> {
    let what = format!("part `{key}`");
    let origin = cx.key(v);
    let Value::Map(written) = &v.value else {
        let message = format!("{what} must be `(field: ..)`, but it is {}", v.value.what());
        cx.fault(v.origin, message, "write (model: \"..\", params: {..}) or (assembly: \"..\")");
        return None;
    };
    let has = |field: &str| written.iter().any(|(k, _)| k == field);
    let or_empty = |cx: &mut Cx, field: &str| map_field(cx, v, field, &what);
    let (kind, params) = if has("model") {
        fields(cx, v, &what, &ModelForm::names());
        let kind = PartKind::Model {
            model: text_field(cx, v, "model", &what)?,
            rate: v.get("rate").cloned(),
            offset: v.get("offset").cloned(),
            bind: or_empty(cx, "bind"),
            folder: text_field(cx, v, "folder", &what),
        };
        (kind, or_empty(cx, "params"))
    } else if has("assembly") {
        fields(cx, v, &what, &FileForm::names());
        let kind = PartKind::File {
            assembly: text_field(cx, v, "assembly", &what)?,
            mounts: or_empty(cx, "mounts"),
            overrides: or_empty(cx, "overrides"),
            stowed: v.get("stowed").filter(|s| s.value != Value::Null).cloned(),
        };
        (kind, or_empty(cx, "params"))
    } else if inline_marks().iter().any(|f| has(f)) {
        let mut known = AssemblyFields::names();
        known.retain(|f| !STANDING_ALONE.contains(f));
        fields(cx, v, &what, &known);
        (PartKind::Inline(Box::new(read_assembly(cx, &mut v.clone(), &what))), empty_map())
    } else {
        let help = "write `model: \"..\"`, `assembly: \"file.ron\"` or `parts: {..}`";
        cx.fault(origin, format!("{what} is neither a model nor an assembly"), help);
        return None;
    };
    let array = v.get("array").map(|a| list(cx, a, format!("{what}: `array`")).to_vec());
    Some(PartForm { kind, params, array, doc: doc(cx, v, &what), origin })
}
