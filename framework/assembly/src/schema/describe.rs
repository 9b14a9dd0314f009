//! Description of a file format as data, from which the JSON Schema is made.
//!
//! RON corresponds to JSON as in serde: `(a: 1)` and `{ "a": 1 }` are objects, tuples are lists, `Name` is `"Name"`, and `Name(x)` is `{ "Name": x
//! }`.
use linkwork_runtime::Value;
use serde_json::{Map, Value as Json, json};

/// The permitted values at a position of a file.
#[derive(Clone)]
pub enum Schema {
    /// A value that fits one of these; empty: any value.
    Any(Vec<Schema>),
    /// A number, or a text with a unit; the range is in SI.
    Number {
        /// Unit of a number without a unit; empty for dimensionless numbers.
        unit: String,
        /// Lower bound, SI; `f64::MIN_POSITIVE`: positive.
        low: f64,
        /// Greatest, SI.
        high: f64,
    },
    /// A whole number.
    Whole {
        /// Least.
        low: f64,
        /// Greatest.
        high: f64,
    },
    /// True or false.
    Flag,
    /// A text.
    Text,
    /// One of these words.
    Words(Vec<&'static str>),
    /// A list, optionally with a fixed number of items.
    List(Box<Schema>, Option<usize>),
    /// Names, each with a value.
    Table(Box<Schema>),
    /// A table without these names.
    TableBut(&'static [&'static str], Box<Schema>),
    /// A record of fields, with a title.
    Record(&'static str, fn() -> Vec<Field>),
    /// `Name(value)`.
    Variant(&'static str, Box<Schema>),
    /// A schema with a title, which may contain itself.
    Named(&'static str, fn() -> Schema),
}

impl Schema {
    /// Returns whether values of this schema are records with a field of this name.
    pub(crate) fn has_field(&self, name: &str) -> bool {
        match self {
            Schema::Any(all) => all.iter().any(|schema| schema.has_field(name)),
            Schema::Record(_, fields) => fields().iter().any(|field| field.name == name),
            _ => false,
        }
    }
}

/// A field of a record.
#[derive(Clone)]
pub struct Field {
    /// Its name.
    pub name: &'static str,
    /// Its description.
    pub doc: &'static str,
    /// Its values.
    pub schema: Schema,
    /// Whether it is required.
    pub required: bool,
    /// Its default.
    pub default: Option<Value>,
}

/// Whether a parameter `$name` or an expression may replace a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameters {
    /// Parameters may replace any value.
    Allowed,
    /// Parameters must not replace values.
    None,
}

/// Definitions under way.
struct Defs {
    made: Map<String, Json>,
    parameters: Parameters,
}

/// Returns the JSON Schema (draft 2020-12) of a document.
pub fn document(title: &str, root: &Schema, parameters: Parameters) -> Json {
    let mut defs = Defs { made: Map::new(), parameters };
    let root = json(root, &mut defs);
    let defs = defs.made;
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        "oneOf": [root],
        "$defs": defs,
    })
}

/// Adds the alternative of a parameter `$name` or an expression, if parameters are allowed.
fn or_parameter(schema: Json, defs: &Defs) -> Json {
    if defs.parameters == Parameters::None {
        return schema;
    }
    let texts = schema["anyOf"].as_array().into_iter().flatten();
    if texts.into_iter().any(|s| s["type"] == "string" && s["pattern"].is_null()) {
        return schema;
    }
    if schema == json!({}) || schema["type"] == "string" || schema["type"] == "object" {
        return schema;
    }
    json!({ "anyOf": [schema, { "type": "string", "pattern": "\\$" }] })
}

fn json(schema: &Schema, defs: &mut Defs) -> Json {
    let range = |mut out: Json, low: f64, high: f64| {
        if low.is_finite() && low != f64::MIN_POSITIVE {
            out["minimum"] = json!(low);
        } else if low == f64::MIN_POSITIVE {
            out["exclusiveMinimum"] = json!(0);
        }
        if high.is_finite() {
            out["maximum"] = json!(high);
        }
        out
    };
    match schema {
        Schema::Any(all) if all.is_empty() => json!({}),
        Schema::Any(all) => {
            let all: Vec<Json> = all.iter().map(|s| json(s, defs)).collect();
            json!({ "anyOf": all })
        }
        Schema::Number { unit, low, high } => {
            let mut number = range(json!({ "type": "number" }), *low, *high);
            if !unit.is_empty() {
                number["description"] = json!(format!("in {unit}"));
            }
            let text = match defs.parameters {
                Parameters::Allowed => "a number with a unit, or an expression of parameters",
                Parameters::None => "a number with a unit",
            };
            json!({ "anyOf": [number, { "type": "string", "description": text }] })
        }
        Schema::Whole { low, high } => range(json!({ "type": "integer" }), *low, *high),
        Schema::Flag => json!({ "type": "boolean" }),
        Schema::Text => json!({ "type": "string" }),
        Schema::Words(words) => json!({ "enum": words }),
        Schema::List(of, count) => {
            let mut out = json!({ "type": "array", "items": Json::Null });
            let items = json(of, defs);
            out["items"] = or_parameter(items, defs);
            if let Some(n) = count {
                out["minItems"] = json!(n);
                out["maxItems"] = json!(n);
            }
            out
        }
        Schema::Table(of) => json!({ "type": "object", "additionalProperties": json(of, defs) }),
        Schema::TableBut(names, of) => json!({
            "type": "object", "propertyNames": { "not": { "enum": names } },
            "additionalProperties": json(of, defs),
        }),
        Schema::Variant(name, of) => {
            let of = json(of, defs);
            json!({
                "type": "object", "properties": { *name: or_parameter(of, defs) },
                "required": [name], "additionalProperties": false,
            })
        }
        Schema::Record(title, fields) => named(title, defs, |defs| record(&fields(), defs)),
        Schema::Named(title, of) => named(title, defs, |defs| json(&of(), defs)),
    }
}

/// Returns a reference to a definition, which is created once.
fn named(title: &str, defs: &mut Defs, make: impl FnOnce(&mut Defs) -> Json) -> Json {
    if !defs.made.contains_key(title) {
        defs.made.insert(title.into(), Json::Null);
        let made = make(defs);
        defs.made.insert(title.into(), made);
    }
    json!({ "$ref": format!("#/$defs/{title}") })
}

fn record(fields: &[Field], defs: &mut Defs) -> Json {
    let mut properties = Map::new();
    for f in fields {
        let one = json(&f.schema, defs);
        let mut one = or_parameter(one, defs);
        if let Some(one) = one.as_object_mut() {
            one.insert("description".into(), json!(f.doc.trim()));
            if let Some(default) = &f.default {
                one.insert("default".into(), plain(default));
            }
        }
        properties.insert(f.name.into(), one);
    }
    let required: Vec<&str> = fields.iter().filter(|f| f.required).map(|f| f.name).collect();
    // `()` is a record without fields.
    let kind = if required.is_empty() { json!(["object", "null"]) } else { json!("object") };
    let mut out = json!({ "type": kind, "properties": properties, "additionalProperties": false });
    if !required.is_empty() {
        out["required"] = json!(required);
    }
    out
}

/// Converts a value of a file to JSON: `Name` is `"Name"`, `Name(x)` is `{ "Name": x }`.
pub fn plain(v: &Value) -> Json {
    match v {
        Value::Null => Json::Null,
        Value::Bool(b) => json!(b),
        Value::Number(x) => json!(x),
        Value::Text(t) => json!(t),
        Value::List(items) => Json::Array(items.iter().map(|i| plain(&i.value)).collect()),
        Value::Map(entries) => {
            Json::Object(entries.iter().map(|(k, v)| (k.clone(), plain(&v.value))).collect())
        }
        Value::Variant(name, inner) => match &inner.value {
            Value::Null => json!(name),
            inner => json!({ name: plain(inner) }),
        },
    }
}
