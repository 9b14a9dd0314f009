//! Reading of typed values: units, ranges and lists; each mistake with its position.
use crate::schema::describe::Field;
use crate::text::report::Cx;
use crate::text::value::{Text, is_unknown};
use linkwork_runtime::{Located, Origin, Seconds, Unit, Value, remedy, split_quantity};
use std::fmt::Display;

/// Fields that had another name, and their present name.
const RENAMED: [(&str, &str); 3] =
    [("figures", "metrics"), ("figure", "metric"), ("sidecar", "companion")];

/// Adds faults for values that are not maps and for unknown fields. `what` names the owner: "body `wheel`".
pub(crate) fn fields(cx: &mut Cx, v: &Located, what: impl Display, known: &[&str]) -> bool {
    record_fields(cx, v, what, known, Vec::new)
}

/// Checks the fields like [`fields`]. For an unknown field that one of the record's fields contains, the remedy names that field.
pub(crate) fn record_fields(
    cx: &mut Cx,
    v: &Located,
    what: impl Display,
    known: &[&str],
    all: impl Fn() -> Vec<Field>,
) -> bool {
    let entries = match &v.value {
        Value::Map(entries) => entries,
        Value::Null => return true,
        other => {
            let help = format!("fields: {}", known.join(", "));
            cx.fault(
                v.origin,
                format!("{what} must be `(field: ..)`, but it is {}", other.what()),
                help,
            );
            return false;
        }
    };
    for (key, value) in entries {
        if !known.contains(&key.as_str()) {
            let message = format!("{what} has no field `{key}`");
            let renamed = RENAMED.iter().find(|(old, new)| old == key && known.contains(new));
            let within = || all().into_iter().find(|f| f.schema.has_field(key));
            let help = match renamed {
                Some((old, new)) => format!("`{old}` was renamed: write `{new}`"),
                None => match within() {
                    Some(field) => format!("write `{}: ({key}: ..)`", field.name),
                    None => remedy(key, "fields", known),
                },
            };
            cx.fault(cx.key(value), message, help);
        }
    }
    true
}

/// A text.
pub(crate) fn text(cx: &mut Cx, v: &Located, what: impl Display) -> Option<Text> {
    match &v.value {
        Value::Text(t) => Some(Text { text: t.clone(), origin: v.origin }),
        other => {
            let message = format!("{what} must be a text, but it is {}", other.what());
            cx.fault(v.origin, message, "write it in double quotes");
            None
        }
    }
}

/// The text of an optional field.
pub(crate) fn text_field(
    cx: &mut Cx,
    map: &Located,
    field: &str,
    what: impl Display,
) -> Option<Text> {
    let v = map.get(field)?;
    text(cx, v, format_args!("{what}: `{field}`"))
}

/// A map, entry by entry.
pub(crate) fn table<'v>(
    cx: &mut Cx,
    v: &'v Located,
    what: impl Display,
) -> &'v [(String, Located)] {
    match &v.value {
        Value::Map(entries) => entries,
        Value::Null => &[],
        other => {
            let message = format!("{what} must be a map, but it is {}", other.what());
            cx.fault(v.origin, message, "write { \"name\": .. }");
            &[]
        }
    }
}

/// A list, item by item.
pub(crate) fn list<'v>(cx: &mut Cx, v: &'v Located, what: impl Display) -> &'v [Located] {
    match &v.value {
        Value::List(items) => items,
        Value::Null => &[],
        other => {
            let message = format!("{what} must be a list, but it is {}", other.what());
            cx.fault(v.origin, message, "write [ .., .. ]");
            &[]
        }
    }
}

/// True or false.
pub(crate) fn flag(cx: &mut Cx, v: &Located, what: impl Display) -> Option<bool> {
    match v.value {
        Value::Bool(b) => Some(b),
        _ => {
            let message = format!("{what} must be true or false, but it is {}", v.value.what());
            cx.fault(v.origin, message, "write true or false");
            None
        }
    }
}

fn wants(unit: &str) -> String {
    match unit {
        "" => "write a number without a unit".into(),
        u => format!("write a number in {u}, or a text with a unit such as \"1 {u}\""),
    }
}

/// Reads a finite number in SI; a number without a unit is in `unit` (empty: dimensionless).
pub(crate) fn number(cx: &mut Cx, v: &Located, what: impl Display, unit: &str) -> Option<f64> {
    number_in(cx, v, &what, (unit, &known(unit)))
}

/// Returns the expected unit.
fn known(unit: &str) -> Unit {
    if unit.is_empty() { Unit::ONE } else { Unit::parse(unit).unwrap_or(Unit::ONE) }
}

fn number_in(
    cx: &mut Cx,
    v: &Located,
    what: &impl Display,
    (unit, wanted): (&str, &Unit),
) -> Option<f64> {
    if is_unknown(v) {
        return None;
    }
    let x = match &v.value {
        Value::Number(x) => wanted.to_si(*x),
        Value::Text(text) => match quantity(text, wanted, unit) {
            Ok(x) => x,
            Err(fact) => {
                cx.fault(v.origin, format!("{what}: {fact}"), wants(unit));
                return None;
            }
        },
        other => {
            let message = format!("{what} must be a number, but it is {}", other.what());
            cx.fault(v.origin, message, wants(unit));
            return None;
        }
    };
    if !x.is_finite() {
        cx.fault(v.origin, format!("{what} is {x}"), "write a finite number");
        return None;
    }
    Some(x)
}

fn quantity(text: &str, wanted: &Unit, unit: &str) -> Result<f64, String> {
    let (number, unit_text) =
        split_quantity(text).ok_or_else(|| format!("`{text}` is not a quantity"))?;
    if unit_text.is_empty() {
        return Ok(wanted.to_si(number));
    }
    let given = Unit::parse(unit_text).map_err(|e| e.to_string())?;
    if !given.same_quantity(wanted) {
        let wanted = if unit.is_empty() { "a plain number" } else { unit };
        return Err(format!("`{text}` is in {unit_text}, but {wanted} is expected"));
    }
    Ok(given.to_si(number))
}

/// Reads exactly `N` numbers in one unit.
pub(crate) fn numbers<const N: usize>(
    cx: &mut Cx,
    v: &Located,
    what: impl Display,
    unit: &str,
) -> Option<[f64; N]> {
    if is_unknown(v) {
        return None;
    }
    let Value::List(items) = &v.value else {
        let message = format!("{what} must be a list of {N} numbers, but it is {}", v.value.what());
        cx.fault(v.origin, message, wants(unit));
        return None;
    };
    if items.len() != N {
        let message = format!("{what} must have {N} numbers, but it has {}", items.len());
        cx.fault(v.origin, message, wants(unit));
        return None;
    }
    let wanted = known(unit);
    let mut whole = true;
    let mut read = [0.0; N];
    for (x, item) in read.iter_mut().zip(items) {
        match number_in(cx, item, &what, (unit, &wanted)) {
            Some(number) => *x = number,
            None => whole = false,
        }
    }
    whole.then_some(read)
}

/// Checks the name of a part, body, node, mount or port: without dots, slashes, brackets, stars or spaces.
pub(crate) fn name(cx: &mut Cx, name: &str, origin: Origin, kind: &str) {
    let bad = |c: char| c.is_whitespace() || "./[]*$\"'->:".contains(c);
    if name.is_empty() || name.contains(bad) {
        let article = if kind.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
        let message = format!("`{name}` cannot be the name of {article} {kind}");
        cx.fault(origin, message, "use letters, digits and `_`");
    }
    if kind == "body" && name == "world" {
        cx.fault(origin, "a body cannot be named `world`", "this name is reserved");
    }
}

/// A period or time: `"50 Hz"`, `"20 ms"`, seconds.
pub(crate) fn period(cx: &mut Cx, v: &Located, what: impl Display) -> Option<Seconds> {
    match Seconds::period(&v.value) {
        Ok(s) => Some(s),
        Err(fact) => {
            // Remove the remedy from the message, because the help contains it.
            let fact = fact.split(": write").next().unwrap_or(&fact).replace('"', "");
            let fact = fact.replace("a period", "a time");
            let help = "write \"50 Hz\", \"20 ms\", \"2 min\" or a number of seconds";
            cx.fault(v.origin, format!("{what}: {fact}"), help);
            None
        }
    }
}
