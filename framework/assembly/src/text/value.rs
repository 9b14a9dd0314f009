//! Functions on values with positions: access, change, creation.
use linkwork_runtime::{IntoValue, Located, Origin, Value};
use linkwork_spatial::Vec3;

/// A text and its position.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    /// The text.
    pub text: String,
    /// The place.
    pub origin: Origin,
}

impl Text {
    /// Creates a text without a position.
    pub fn new(text: impl Into<String>) -> Text {
        Text { text: text.into(), origin: Origin::NONE }
    }
}

/// Returns the entries of a map; `Null` is an empty map.
pub(crate) fn entries(v: &Located) -> &[(String, Located)] {
    match &v.value {
        Value::Map(entries) => entries,
        _ => &[],
    }
}

/// Creates a map of fields.
pub(crate) fn map(entries: Vec<(&str, Located)>) -> Located {
    Value::Map(entries.into_iter().map(|(k, v)| (k.to_string(), v)).collect()).into()
}

/// An empty map.
pub(crate) fn empty_map() -> Located {
    Value::Map(Vec::new()).into()
}

/// Sets a field, deep: `["gains", "kp"]`.
pub(crate) fn set(map: &mut Located, path: &[String], value: &Located) {
    let Some((first, rest)) = path.split_first() else {
        *map = value.clone();
        return;
    };
    if !matches!(map.value, Value::Map(_)) {
        map.value = Value::Map(Vec::new());
    }
    let Value::Map(entries) = &mut map.value else { return };
    let at = match entries.iter().position(|(k, _)| k == first) {
        Some(at) => at,
        None => {
            entries.push((first.clone(), empty_map()));
            entries.len() - 1
        }
    };
    set(&mut entries[at].1, rest, value);
}

/// Sorts the keys of every map, recursively, so that the order in a file does not affect the result.
pub(crate) fn sort(v: &mut Located) {
    match &mut v.value {
        Value::Map(entries) => {
            entries.sort_by(|a, b| a.0.cmp(&b.0));
            entries.iter_mut().for_each(|(_, v)| sort(v));
        }
        Value::List(items) => items.iter_mut().for_each(sort),
        Value::Variant(_, inner) => sort(inner),
        _ => {}
    }
}

/// Returns true for a text with a parameter that could not be replaced, which has been reported.
pub(crate) fn is_unknown(v: &Located) -> bool {
    matches!(&v.value, Value::Text(t) if t.contains('$'))
}

/// Creates `Name` or `Name(..)`: `variant("Pin", [0.0, 1.0, 0.0])`, `variant("Free", Value::Null)`.
pub fn variant(name: &str, inner: impl IntoValue) -> Value {
    Value::Variant(name.into(), Box::new(inner.into_value().into()))
}

/// Adds a field that is not empty.
pub(crate) fn push(out: &mut Vec<(String, Located)>, key: &str, v: Value) {
    let empty = match &v {
        Value::Null => true,
        Value::List(l) => l.is_empty(),
        Value::Map(m) => m.is_empty(),
        _ => false,
    };
    if !empty {
        out.push((key.into(), v.into()));
    }
}

/// Returns an unused name without special characters of references.
pub(crate) fn plain(name: &str, taken: impl Fn(&str) -> bool) -> String {
    let bad = |c: char| c.is_whitespace() || c.is_control() || "./[]*$\"'->:".contains(c);
    let mut out: String = name.chars().map(|c| if bad(c) { '_' } else { c }).collect();
    if out.is_empty() || out == "world" {
        out.push('_');
    }
    while taken(&out) {
        out.push('_');
    }
    out
}

/// Numbers as a list.
pub(crate) fn list(x: impl IntoIterator<Item = f64>) -> Value {
    Value::List(x.into_iter().map(|x| Value::Number(x).into()).collect())
}

/// Three numbers.
pub(crate) fn vector(v: &Vec3) -> Value {
    list(v.iter().copied())
}

/// Returns `Rover.Arm/link1`; only the name for a body at the top level.
pub(crate) fn full_name(path: &str, body: &str) -> String {
    if path.is_empty() { body.to_string() } else { format!("{path}/{body}") }
}

/// Returns `path.name`, or only the name at the root.
pub(crate) fn join(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_string() } else { format!("{path}.{name}") }
}

/// Returns the path around a path: `Rover.Arm` → `Rover`; empty at the top level.
pub(crate) fn outer(path: &str) -> &str {
    path.rsplit_once('.').map_or("", |(head, _)| head)
}
