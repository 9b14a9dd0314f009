//! Parameters in a scope: `$name`, `-$name`, arithmetic and `${name}` inside texts.
use crate::schema::describe::Schema;
use crate::schema::kind::{raw, text};
use crate::schema::read::{fields, number, text_field};
use crate::schema::record::{Presence, Record, record};
use crate::scope::expression::{Quantity, evaluate};
use crate::text::print::inline;
use crate::text::report::Cx;
use crate::text::value::{Text, entries, is_unknown};
use linkwork_runtime::{Located, Origin, Unit, Value, nearest, remedy, split_quantity};
use std::collections::BTreeMap;

/// The parameters of a scope, by name.
pub(crate) type Env = BTreeMap<String, Located>;

/// Replaces every parameter in a value, deep.
pub(crate) fn substitute(cx: &mut Cx, env: &Env, v: &Located) -> Located {
    let value = match &v.value {
        Value::Text(text) if text.contains('$') => return replace(cx, env, text, v.origin),
        Value::List(items) => {
            Value::List(items.iter().map(|item| substitute(cx, env, item)).collect())
        }
        Value::Map(entries) => {
            let each = entries.iter().map(|(k, item)| (k.clone(), substitute(cx, env, item)));
            Value::Map(each.collect())
        }
        Value::Variant(name, inner) => {
            Value::Variant(name.clone(), Box::new(substitute(cx, env, inner)))
        }
        other => other.clone(),
    };
    Located { value, origin: v.origin }
}

/// Replaces `${name}` and `$name` in a text that stays a text (model names, files, references).
pub(crate) fn substitute_text(cx: &mut Cx, env: &Env, t: &Text) -> Text {
    if !t.text.contains('$') {
        return t.clone();
    }
    match replace(cx, env, &t.text, t.origin).value {
        Value::Text(text) => Text { text, origin: t.origin },
        _ => t.clone(),
    }
}

fn unknown(env: &Env, name: &str) -> (String, String) {
    let known: Vec<&str> = env.keys().map(String::as_str).collect();
    (format!("there is no parameter `{name}`"), remedy(name, "parameters", &known))
}

fn replace(cx: &mut Cx, env: &Env, text: &str, origin: Origin) -> Located {
    let as_written = Located { value: Value::Text(text.into()), origin };
    let is_name = |s: &str| !s.is_empty() && s.chars().all(|c| c.is_alphanumeric() || c == '_');
    if let Some(name) = text.strip_prefix('$').filter(|n| is_name(n)) {
        return env.get(name).cloned().unwrap_or_else(|| {
            let (message, help) = unknown(env, name);
            cx.fault(origin, format!("`{text}`: {message}"), help);
            as_written
        });
    }
    if text.contains("${") {
        return Located { value: Value::Text(interpolate(cx, env, text, origin)), origin };
    }
    let lookup = |name: &str, element: Option<usize>| match env.get(name) {
        Some(v) if is_unknown(v) => Err(String::new()),
        Some(v) => quantity_of(name, v, element),
        None => {
            let (message, help) = unknown(env, name);
            Err(format!("{message}\n{help}"))
        }
    };
    match evaluate(text, &lookup) {
        Ok(q) => Located { value: show(&q, None), origin },
        Err(why) if why.is_empty() => as_written,
        Err(why) => {
            let (message, help) = why.split_once('\n').unwrap_or((
                &why,
                "write $name, -$name, or + - * / ( ) with numbers; ${name} inside a text",
            ));
            cx.fault(origin, format!("`{text}`: {message}"), help);
            as_written
        }
    }
}

fn interpolate(cx: &mut Cx, env: &Env, text: &str, origin: Origin) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("${") {
        out.push_str(before);
        let (name, tail) = after.split_once('}').unwrap_or((after, ""));
        match env.get(name).map(|v| &v.value) {
            Some(Value::Text(t)) => out.push_str(t),
            Some(Value::Variant(word, _)) => out.push_str(word),
            Some(other) => out.push_str(&other.to_string()),
            None => {
                let (message, help) = unknown(env, name);
                cx.fault(origin, format!("`{text}`: {message}"), help);
            }
        }
        rest = tail;
    }
    out + rest
}

/// Returns a marker for an invalid value; expressions that use it report no further faults. See [`is_unknown`].
fn refused(key: &str, origin: Origin) -> Located {
    Located { value: Value::Text(format!("${key}")), origin }
}

/// Returns the number of a parameter, or of an element of it.
fn quantity_of(name: &str, v: &Located, element: Option<usize>) -> Result<Quantity, String> {
    let (v, name) = match (&v.value, element) {
        (_, None) => (v, name.to_string()),
        (Value::List(items), Some(k)) => match items.get(k) {
            Some(item) => (item, format!("{name}[{k}]")),
            None => {
                return Err(format!(
                    "`${name}` has {} elements, so [{k}] does not exist",
                    items.len()
                ));
            }
        },
        (other, Some(k)) => {
            return Err(format!("`${name}` is {}, so [{k}] does not exist", other.what()));
        }
    };
    if is_unknown(v) {
        return Err(String::new());
    }
    as_quantity(v).ok_or_else(|| format!("`${name}` is {}", v.value.what()))
}

fn as_quantity(v: &Located) -> Option<Quantity> {
    match &v.value {
        Value::Number(x) => Some(Quantity::bare(*x)),
        Value::Text(t) => {
            let (x, unit) = split_quantity(t)?;
            let unit = if unit.is_empty() { return Some(Quantity::bare(x)) } else { unit };
            let unit = Unit::parse(unit).ok()?;
            Some(Quantity { value: unit.to_si(x), exponents: unit.exponents, bare: false })
        }
        _ => None,
    }
}

/// Returns a quantity as a value with its unit, such as `"0.25 m"`, or as a number without one.
fn show(q: &Quantity, written: Option<&str>) -> Value {
    if q.exponents == [0; 8] {
        return Value::Number(q.value);
    }
    // Show the unit as it is written if it is an SI unit, otherwise show base units.
    let coherent =
        written.filter(|u| Unit::parse(u).is_ok_and(|u| u.scale == 1.0 && u.offset == 0.0));
    match coherent {
        Some(unit) => Value::Text(format!("{:?} {unit}", q.value)),
        None => Value::Text(format!("{:?} {}", q.value, q.unit())),
    }
}

/// Returns the parameters of an instance from the given values, the overrides and the defaults.
pub(crate) fn bind(
    cx: &mut Cx,
    at: &str,
    origin: Origin,
    decls: &BTreeMap<String, ParamDecl>,
    given: &Located,
    around: &Env,
) -> Env {
    let known: Vec<&str> = decls.keys().map(String::as_str).collect();
    let mut meant = Vec::new();
    for (key, v) in entries(given) {
        if !decls.contains_key(key) {
            meant.extend(nearest(key, known.iter().copied()));
            let message = format!("`{at}` has no parameter `{key}`");
            cx.fault(cx.key(v), message, remedy(key, "parameters", &known));
        }
    }
    let mut env = around.clone();
    let mut waiting: Vec<(&String, &ParamDecl)> = Vec::new();
    for (key, decl) in decls {
        match given.get(key) {
            Some(v) => {
                let v = check(cx, at, key, decl, v);
                env.insert(key.clone(), bounded(cx, at, key, v));
            }
            None => {
                env.remove(key);
                waiting.push((key, decl));
            }
        }
    }
    // Defaults may depend on other parameters, so repeatedly evaluate those defaults whose parameters
    // are all known.
    while !waiting.is_empty() {
        let before = waiting.len();
        let names: Vec<String> = waiting.iter().map(|(k, _)| (*k).clone()).collect();
        let (ready, rest): (Vec<_>, Vec<_>) = waiting.into_iter().partition(|(_, d)| {
            d.default.as_ref().is_none_or(|v| !names.iter().any(|n| mentions(v, n)))
        });
        waiting = rest;
        for (key, decl) in ready {
            // A parameter whose name was misspelt in the list of values is not reported as missing.
            if decl.default.is_none() && meant.contains(&key.as_str()) {
                env.insert(key.clone(), refused(key, origin));
                continue;
            }
            let v = default(cx, at, origin, key, decl, &env);
            let mut v = v.map(|v| bounded(cx, at, key, v));
            // The defaults of the simulation itself are written by its user.
            if let Some(v) = v.as_mut().filter(|_| origin != Origin::NONE) {
                v.by_default();
            }
            env.insert(key.clone(), v.unwrap_or_else(|| refused(key, origin)));
        }
        if waiting.len() == before {
            for (key, decl) in waiting.drain(..) {
                let message = format!("the default of `{at}.{key}` depends on itself");
                cx.fault(decl.origin, message, "set one of the parameters to a number");
                env.insert(key.clone(), refused(key, origin));
            }
        }
    }
    env
}

/// Largest size of a value: bytes of text and number of elements.
const LARGEST: usize = 1 << 20;

/// Returns the value unless it is too large, because parameters that repeat each other can grow exponentially.
fn bounded(cx: &mut Cx, at: &str, key: &str, v: Located) -> Located {
    if size(&v) <= LARGEST {
        return v;
    }
    let message = format!("the value of `{at}.{key}` is larger than {} MiB", LARGEST >> 20);
    let help = "parameters that repeat others grow with each one: put large data into a file";
    cx.fault(v.origin, message, help);
    refused(key, v.origin)
}

fn size(v: &Located) -> usize {
    match &v.value {
        Value::Text(t) => 1 + t.len(),
        Value::List(items) => 1 + items.iter().map(size).sum::<usize>(),
        Value::Map(entries) => 1 + entries.iter().map(|(k, v)| k.len() + size(v)).sum::<usize>(),
        Value::Variant(_, inner) => 1 + size(inner),
        _ => 1,
    }
}

fn mentions(v: &Located, name: &str) -> bool {
    match &v.value {
        Value::Text(t) => t.split('$').skip(1).any(|piece| {
            let piece = piece.trim_start_matches('{');
            let end = piece.find(|c: char| !(c.is_alphanumeric() || c == '_'));
            &piece[..end.unwrap_or(piece.len())] == name
        }),
        Value::List(items) => items.iter().any(|i| mentions(i, name)),
        Value::Map(entries) => entries.iter().any(|(_, i)| mentions(i, name)),
        Value::Variant(_, inner) => mentions(inner, name),
        _ => false,
    }
}

fn default(
    cx: &mut Cx,
    at: &str,
    origin: Origin,
    key: &str,
    decl: &ParamDecl,
    env: &Env,
) -> Option<Located> {
    match &decl.default {
        Some(v) => {
            let v = substitute(cx, env, v);
            Some(check(cx, at, key, decl, &v))
        }
        None => {
            let unit = decl.unit.as_ref().map(|u| format!(", in {}", u.text)).unwrap_or_default();
            let doc = decl.doc.trim_end_matches('.');
            let message = format!("`{at}`: required parameter `{key}` is missing ({doc}{unit})");
            let help = if cx.alone == Some(origin) {
                format!(
                    "this file is an assembly: use `--set '{at}.{key}=..'`, or use it as a part of a simulation and \
                     write `params: {{ \"{key}\": .. }}` there"
                )
            } else {
                format!("write `params: {{ \"{key}\": .. }}`")
            };
            cx.fault(origin, message, help);
            None
        }
    }
}

/// Checks unit and range of a given value; lists are checked number by number. The result keeps the value's position.
fn check(cx: &mut Cx, at: &str, key: &str, decl: &ParamDecl, v: &Located) -> Located {
    let what = format!("`{at}.{key}`");
    let value = match &v.value {
        Value::List(items) => {
            Value::List(items.iter().map(|i| check(cx, at, key, decl, i)).collect())
        }
        Value::Number(x) if x.is_nan() => {
            cx.fault(v.origin, format!("{what} is not a number"), "write a number");
            return refused(key, v.origin);
        }
        Value::Number(_) | Value::Text(_) => match &decl.unit {
            None => match (&v.value, decl.range) {
                (Value::Number(x), Some(range)) => {
                    outside(cx, &what, decl, v, *x, range);
                    v.value.clone()
                }
                _ => v.value.clone(),
            },
            Some(unit) => {
                let Some(x) = number(cx, v, &what, &unit.text) else {
                    return refused(key, v.origin);
                };
                if let Some(range) = decl.range {
                    outside(cx, &what, decl, v, x, range);
                }
                let exponents = Unit::parse(&unit.text).unwrap_or(Unit::ONE).exponents;
                show(&Quantity { value: x, exponents, bare: false }, Some(&unit.text))
            }
        },
        other => other.clone(),
    };
    Located { value, origin: v.origin }
}

fn outside(cx: &mut Cx, what: &str, decl: &ParamDecl, v: &Located, x: f64, range: (f64, f64)) {
    if x >= range.0 && x <= range.1 {
        return;
    }
    let unit = decl.unit.as_ref().map(|u| format!(" {}", u.text)).unwrap_or_default();
    let written = match decl.range_written.as_ref().map(|r| &r.value) {
        Some(Value::List(ends)) if ends.len() == 2 => {
            format!("{} .. {}", inline(&ends[0].value), inline(&ends[1].value))
        }
        _ => format!("{} .. {}", range.0, range.1),
    };
    let value = match &v.value {
        Value::Text(t) => t.clone(),
        other => format!("{}{unit}", inline(other)),
    };
    cx.fault(
        v.origin,
        format!("{what} = {value} is out of range {written}{unit}"),
        decl.doc.clone(),
    );
}

/// A parameter of an assembly.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamDecl {
    /// Unit, also of numbers without a unit.
    pub unit: Option<Text>,
    /// Default; `None`: the parameter is required.
    pub default: Option<Located>,
    /// Range, SI.
    pub range: Option<(f64, f64)>,
    /// The range as written, in the declared unit.
    pub range_written: Option<Located>,
    /// Meaning.
    pub doc: String,
    /// Position in the file.
    pub origin: Origin,
}

record! {
    /// A parameter as written in a file.
    pub(crate) struct ParamForm: "parameter" {
        /// Unit, also of numbers without a unit.
        unit: Option<Text> = text().maybe(),
        /// Default value.
        default: Option<Located> = raw(|| Schema::Any(Vec::new())).maybe(),
        /// Smallest and largest value.
        range: Option<Located> = raw(|| Schema::List(Box::new(Schema::Any(Vec::new())), Some(2))).maybe(),
        /// Meaning.
        doc: Option<Text> = text().maybe(),
    }
}

pub(crate) fn read_param(cx: &mut Cx, key: &str, v: &Located) -> ParamDecl {
    let what = format!("parameter `{key}`");
    fields(cx, v, &what, &ParamForm::names());
    let unit = text_field(cx, v, "unit", &what);
    if let Some(u) = &unit
        && let Err(e) = Unit::parse(&u.text)
    {
        cx.fault(u.origin, format!("{what}: {e}"), "write for example \"kg m^2\" or \"deg\"");
    }
    let unit_text = unit.as_ref().map_or("", |u| u.text.as_str());
    let range_written = v.get("range").cloned();
    let range = range_written.as_ref().and_then(|r| match &r.value {
        Value::List(ends) if ends.len() == 2 => {
            let mut end = |e: &Located| match e.value {
                Value::Number(x) if x.is_infinite() => Some(x),
                _ => number(cx, e, format!("{what}: `range`"), unit_text),
            };
            Some((end(&ends[0])?, end(&ends[1])?))
        }
        _ => {
            let help = "write (lowest, highest), for example (0, 1) or (0, inf)";
            cx.fault(r.origin, format!("{what}: `range` must have two numbers"), help);
            None
        }
    });
    ParamDecl {
        unit,
        default: v.get("default").filter(|d| d.value != Value::Null).cloned(),
        range,
        range_written,
        doc: text_field(cx, v, "doc", &what).map(|t| t.text).unwrap_or_default(),
        origin: cx.key(v),
    }
}
