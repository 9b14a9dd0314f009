//! Prints values as readable RON: on one line if it fits, otherwise indented. The result reads back as the same value.
use linkwork_runtime::{Located, Value};

/// Fields whose keys are names chosen by the author.
const TABLES: [&str; 14] = [
    "params",
    "mounts",
    "bodies",
    "loops",
    "couplings",
    "colliders",
    "terms",
    "dry",
    "parts",
    "exports",
    "overrides",
    "bind",
    "nodes",
    "metrics",
];
const WIDTH: usize = 100;

/// Returns the whole text, with a line end.
pub(crate) fn document(v: &Value) -> String {
    write(v, 0, false) + "\n"
}

/// Returns a value on one line.
pub(crate) fn inline(v: &Value) -> String {
    one_line(v, false)
}

fn is_field(key: &str) -> bool {
    let mut chars = key.chars();
    chars.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
        && chars.all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !["true", "false", "None", "Some", "inf", "NaN", "r", "b", "br"].contains(&key)
}

fn number(x: f64) -> String {
    let whole = x.fract() == 0.0 && x.abs() < 1e15 && !(x == 0.0 && x.is_sign_negative());
    if whole { format!("{x:.0}") } else { Value::Number(x).to_string() }
}

fn write(v: &Value, indent: usize, table: bool) -> String {
    let line = one_line(v, table);
    let fits = indent + line.len() <= WIDTH;
    let pad = " ".repeat(indent + 4);
    let close = " ".repeat(indent);
    match v {
        _ if fits => line,
        Value::List(items) if !items.is_empty() => {
            let items: Vec<String> = items
                .iter()
                .map(|i| format!("{pad}{},\n", write(&i.value, indent + 4, false)))
                .collect();
            format!("[\n{}{close}]", items.concat())
        }
        Value::Map(entries) if !entries.is_empty() => {
            let (open, end, quoted) = braces(entries, table);
            let items: Vec<String> = entries
                .iter()
                .map(|(k, i)| {
                    let value = write(&i.value, indent + 4, is_table(k, quoted));
                    format!("{pad}{}: {value},\n", key(k, quoted))
                })
                .collect();
            format!("{open}\n{}{close}{end}", items.concat())
        }
        Value::Variant(name, inner) => match &inner.value {
            Value::Map(entries) if !entries.is_empty() && !braces(entries, false).2 => {
                format!("{name}{}", write(&inner.value, indent, false))
            }
            other => format!("{name}({})", write(other, indent, false)),
        },
        _ => line,
    }
}

fn is_table(key: &str, quoted: bool) -> bool {
    !quoted && TABLES.contains(&key)
}

fn key(k: &str, quoted: bool) -> String {
    if quoted { format!("{k:?}") } else { k.to_string() }
}

fn braces(entries: &[(String, Located)], table: bool) -> (char, char, bool) {
    let quoted = table || entries.is_empty() || !entries.iter().all(|(k, _)| is_field(k));
    if quoted { ('{', '}', true) } else { ('(', ')', false) }
}

fn one_line(v: &Value, table: bool) -> String {
    match v {
        Value::Number(x) => number(*x),
        Value::List(items) => {
            let items: Vec<String> = items.iter().map(|i| one_line(&i.value, false)).collect();
            format!("[{}]", items.join(", "))
        }
        Value::Map(entries) => {
            let (open, end, quoted) = braces(entries, table);
            let items: Vec<String> = entries
                .iter()
                .map(|(k, i)| {
                    format!("{}: {}", key(k, quoted), one_line(&i.value, is_table(k, quoted)))
                })
                .collect();
            format!("{open}{}{end}", items.join(", "))
        }
        Value::Variant(name, inner) => match &inner.value {
            Value::Null => name.clone(),
            Value::Map(entries) if !braces(entries, false).2 => {
                format!("{name}{}", one_line(&inner.value, false))
            }
            other => format!("{name}({})", one_line(other, false)),
        },
        other => other.to_string(),
    }
}
