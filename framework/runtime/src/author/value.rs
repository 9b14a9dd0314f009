//! Located values: the contents of a configuration file, with the place of each value.
use linkwork_names::did_you_mean;
use linkwork_spatial::Vec3;
use std::fmt;
use std::panic::Location;

/// The place where a value was written: a byte range of a file (an index into the [`Sources`]), or a call in a Rust program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Origin {
    /// Index into [`Sources`]; `u32::MAX` when built by a program.
    pub file: u32,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
    /// The call that built the value, if a program built it.
    pub call: Option<&'static Location<'static>>,
    /// The user did not write the value for this instance: it is the default of a parameter of an assembly, or is in a resolved text, which states all
    /// defaults.
    pub default: bool,
}

impl Origin {
    /// Neither from a file nor from a known call.
    pub const NONE: Origin =
        Origin { file: u32::MAX, start: 0, end: 0, call: None, default: false };

    /// The given bytes of a file.
    pub const fn in_file(file: u32, start: u32, end: u32) -> Origin {
        Origin { file, start, end, ..Origin::NONE }
    }

    /// The call of the function that calls this one; every function between it and the user's code carries `#[track_caller]`.
    #[track_caller]
    #[must_use]
    pub fn caller() -> Origin {
        Origin { call: Some(Location::caller()), ..Origin::NONE }
    }
}

/// The texts that origins point into.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    /// Name as shown (path as the user wrote it) and text.
    pub files: Vec<(String, String)>,
}

impl Sources {
    /// Adds a text and gives its index.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> u32 {
        self.files.push((name.into(), text.into()));
        (self.files.len() - 1) as u32
    }

    /// `file:line:column` of an origin (line and column from 1): of a value that a program built, the place of the call.
    /// `None` when neither a file nor a call is known.
    pub fn place(&self, o: Origin) -> Option<(String, usize, usize)> {
        if let Some(call) = o.call {
            return Some((call.file().to_string(), call.line() as usize, call.column() as usize));
        }
        let (name, text) = self.files.get(o.file as usize)?;
        let before = text.get(..o.start as usize)?;
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
        Some((name.clone(), line, column))
    }
}

/// A configuration value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// `None` or `()`.
    Null,
    /// `true`, `false`.
    Bool(bool),
    /// Any number.
    Number(f64),
    /// A string: text, a quantity such as `"12 deg"`, or a reference.
    Text(String),
    /// `[..]` or a tuple.
    List(Vec<Located>),
    /// `{..}` or a struct, in the order written.
    Map(Vec<(String, Located)>),
    /// `Name` or `Name(..)`.
    Variant(String, Box<Located>),
}

/// A value and where it was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Located {
    /// The value.
    pub value: Value,
    /// The place.
    pub origin: Origin,
}

impl From<Value> for Located {
    fn from(value: Value) -> Self {
        Located { value, origin: Origin::NONE }
    }
}

impl Located {
    /// The entry of a map.
    pub fn get(&self, key: &str) -> Option<&Located> {
        match &self.value {
            Value::Map(entries) => entries.iter().find(|(k, _)| k == key).map(|(_, v)| v),
            _ => None,
        }
    }

    /// Marks this value, and every value inside it, as a default that the user did not write ([`Origin::default`]).
    pub fn by_default(&mut self) {
        self.origin.default = true;
        match &mut self.value {
            Value::List(items) => items.iter_mut().for_each(Located::by_default),
            Value::Map(entries) => entries.iter_mut().for_each(|(_, v)| v.by_default()),
            Value::Variant(_, inner) => inner.by_default(),
            _ => {}
        }
    }

    /// Sets the place of this value, and of every value inside it, if it is not known.
    pub fn place(&mut self, origin: Origin) {
        if self.origin == Origin::NONE {
            self.origin = origin;
        }
        match &mut self.value {
            Value::List(items) => items.iter_mut().for_each(|item| item.place(origin)),
            Value::Map(entries) => entries.iter_mut().for_each(|(_, v)| v.place(origin)),
            Value::Variant(_, inner) => inner.place(origin),
            Value::Null | Value::Bool(_) | Value::Number(_) | Value::Text(_) => {}
        }
    }

    /// Returns the value of a key for a change.
    pub fn get_mut(&mut self, key: &str) -> Option<&mut Located> {
        match &mut self.value {
            Value::Map(entries) => entries.iter_mut().find(|(k, _)| k == key).map(|(_, v)| v),
            _ => None,
        }
    }
}

impl Value {
    /// Returns the kind of value, for messages.
    pub fn what(&self) -> &'static str {
        match self {
            Value::Null => "nothing",
            Value::Bool(_) => "a boolean",
            Value::Number(_) => "a number",
            Value::Text(_) => "a text",
            Value::List(_) => "a list",
            Value::Map(_) => "a map",
            Value::Variant(..) => "a variant",
        }
    }
}

/// Rust values that can be written into an assembly or into the parameters of a part.
pub trait IntoValue {
    /// Returns it as a value.
    fn into_value(self) -> Value;
}

impl IntoValue for Value {
    fn into_value(self) -> Value {
        self
    }
}
impl IntoValue for f64 {
    fn into_value(self) -> Value {
        Value::Number(self)
    }
}
impl IntoValue for i32 {
    fn into_value(self) -> Value {
        Value::Number(self.into())
    }
}
impl IntoValue for bool {
    fn into_value(self) -> Value {
        Value::Bool(self)
    }
}
impl IntoValue for String {
    fn into_value(self) -> Value {
        Value::Text(self)
    }
}
impl<T: IntoValue> IntoValue for Vec<T> {
    fn into_value(self) -> Value {
        Value::List(self.into_iter().map(|t| t.into_value().into()).collect())
    }
}
impl IntoValue for &str {
    fn into_value(self) -> Value {
        Value::Text(self.into())
    }
}

impl<T: IntoValue, const N: usize> IntoValue for [T; N] {
    fn into_value(self) -> Value {
        Value::List(self.into_iter().map(|t| t.into_value().into()).collect())
    }
}

impl IntoValue for Vec3 {
    fn into_value(self) -> Value {
        [self.x, self.y, self.z].into_value()
    }
}
impl IntoValue for Located {
    fn into_value(self) -> Value {
        self.value
    }
}

/// Prints as RON that reads back as the same value (numbers with all their digits).
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Null => f.write_str("None"),
            Value::Bool(b) => write!(f, "{b}"),
            Value::Number(x) if x.is_nan() => f.write_str("NaN"),
            Value::Number(x) if x.is_infinite() => {
                f.write_str(if *x > 0.0 { "inf" } else { "-inf" })
            }
            Value::Number(x) => write!(f, "{x:?}"),
            Value::Text(s) => write!(f, "{s:?}"),
            Value::List(items) => {
                f.write_str("[")?;
                for (k, item) in items.iter().enumerate() {
                    if k > 0 {
                        f.write_str(", ")?;
                    }
                    write!(f, "{}", item.value)?;
                }
                f.write_str("]")
            }
            Value::Map(entries) => {
                f.write_str("{")?;
                for (k, (key, v)) in entries.iter().enumerate() {
                    if k > 0 {
                        f.write_str(", ")?;
                    }
                    write!(f, "{key:?}: {}", v.value)?;
                }
                f.write_str("}")
            }
            Value::Variant(name, inner) => match &inner.value {
                Value::Null => f.write_str(name),
                v => write!(f, "{name}({v})"),
            },
        }
    }
}

/// One fault: place, fact and remedy.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// The fact: one sentence that names both ends.
    pub message: String,
    /// Place of the fault.
    pub origin: Origin,
    /// The remedy.
    pub help: Option<String>,
}

impl Fault {
    /// A fault at a place.
    pub fn new(origin: Origin, message: impl Into<String>) -> Self {
        Fault { message: message.into(), origin, help: None }
    }

    /// Creates the fault for an error of another crate.
    pub fn of(origin: Origin, error: &dyn fmt::Display) -> Self {
        let (message, help) = told(error);
        Fault { message, origin, help }
    }

    /// Adds a remedy.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// Returns the fact and the remedy of an error of a lower layer. Those have no places, so that they are plain error
/// types; all of them print the fact, then `\n  help: ` and the remedy.
pub fn told(error: &dyn fmt::Display) -> (String, Option<String>) {
    let text = error.to_string();
    match text.split_once("\n  help: ") {
        Some((fact, remedy)) => (fact.to_string(), Some(remedy.to_string())),
        None => (text, None),
    }
}

/// All faults of a loaded configuration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults(pub Vec<Fault>);

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, fault) in self.0.iter().enumerate() {
            if k > 0 {
                writeln!(f)?;
            }
            write!(f, "error: {}", fault.message)?;
            if let Some(call) = fault.origin.call {
                write!(f, "\n  --> {call}")?;
            }
            if let Some(help) = &fault.help {
                write!(f, "\n  help: {help}")?;
            }
        }
        Ok(())
    }
}

impl std::error::Error for Faults {}

/// Maximum number of names in a message.
const NAMES_MAX: usize = 40;

/// Returns `did you mean …` and the list of existing names. If there are too many names, only the names with the same path before the last dot are
/// listed.
pub fn remedy(name: &str, kind: &str, known: &[&str]) -> String {
    let owner = name.rsplit_once('.').map_or("", |(owner, _)| owner);
    let inside = |k: &&&str| k.strip_prefix(owner).is_some_and(|rest| rest.starts_with('.'));
    let near: Vec<&str> = known.iter().filter(inside).copied().collect();
    let list = if known.is_empty() {
        format!("there are no {kind}")
    } else if known.len() <= NAMES_MAX {
        format!("{kind}: {}", known.join(", "))
    } else if !owner.is_empty() && (1..=NAMES_MAX).contains(&near.len()) {
        format!("{kind} of `{owner}`: {}", near.join(", "))
    } else {
        format!("there are {} {kind}", known.len())
    };
    match did_you_mean(name, known.iter().copied()) {
        Some(guess) => format!("{guess} {list}"),
        None => list,
    }
}

#[cfg(test)]
mod tests {
    use super::remedy;

    /// Of many variables, a message lists the ones of the part that was named.
    #[test]
    fn a_remedy_lists_the_names_beside_the_wrong_one() {
        let many: Vec<String> = (0..50).map(|k| format!("part{k}.x")).collect();
        let mut known: Vec<&str> = many.iter().map(String::as_str).collect();
        known.extend(["cart.displacement", "cart.speed"]);
        let said = remedy("cart.position", "variables", &known);
        assert!(said.contains("variables of `cart`: cart.displacement, cart.speed"), "{said}");
        let said = remedy("train.position", "variables", &known);
        assert!(said.contains("there are 52 variables"), "{said}");
        assert!(remedy("a", "parts", &["b", "c"]).contains("parts: b, c"));
    }
}
