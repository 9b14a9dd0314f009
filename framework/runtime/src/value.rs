//! Located values: what a configuration file holds, each piece with the place it was written.
use linkwork_multibody::names::did_you_mean;
use std::fmt;

/// A place in a source: file index (of the [`Sources`]) and byte range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Origin {
    /// Index into [`Sources`]; `u32::MAX` when built by a program.
    pub file: u32,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Origin {
    /// Not from a file.
    pub const NONE: Origin = Origin { file: u32::MAX, start: 0, end: 0 };
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

    /// `file:line:column` of an origin (line and column from 1), or `None` for a built one.
    pub fn place(&self, o: Origin) -> Option<(String, usize, usize)> {
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

    /// The same, to be changed.
    pub fn get_mut(&mut self, key: &str) -> Option<&mut Located> {
        match &mut self.value {
            Value::Map(entries) => entries.iter_mut().find(|(k, _)| k == key).map(|(_, v)| v),
            _ => None,
        }
    }
}

impl Value {
    /// What kind of value this is, for messages.
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

/// One mistake: where, what, and the remedy.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// Place, fact: one sentence that names both ends.
    pub message: String,
    /// Where it was written.
    pub origin: Origin,
    /// What to do about it.
    pub help: Option<String>,
}

impl Fault {
    /// A fault at a place.
    pub fn new(origin: Origin, message: impl Into<String>) -> Self {
        Fault { message: message.into(), origin, help: None }
    }

    /// What an error of another crate says.
    pub fn of(origin: Origin, error: &dyn fmt::Display) -> Self {
        let (message, help) = told(error);
        Fault { message, origin, help }
    }

    /// With a remedy.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// The fact and the remedy of an error of a lower floor. Those have no places, so that they are plain error
/// types; all of them print the fact, then `\n  help: ` and the remedy.
pub fn told(error: &dyn fmt::Display) -> (String, Option<String>) {
    let text = error.to_string();
    match text.split_once("\n  help: ") {
        Some((fact, remedy)) => (fact.to_string(), Some(remedy.to_string())),
        None => (text, None),
    }
}

/// All mistakes of a load, together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults(pub Vec<Fault>);

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, fault) in self.0.iter().enumerate() {
            if k > 0 {
                writeln!(f)?;
            }
            write!(f, "error: {}", fault.message)?;
            if let Some(help) = &fault.help {
                write!(f, "\n  help: {help}")?;
            }
        }
        Ok(())
    }
}

impl std::error::Error for Faults {}

/// `did you mean …`, and the list of what there is.
pub fn remedy(name: &str, kind: &str, known: &[&str]) -> String {
    let list = if known.is_empty() {
        format!("there are no {kind}")
    } else if known.len() > 40 {
        format!("there are {} {kind}", known.len())
    } else {
        format!("{kind}: {}", known.join(", "))
    };
    match did_you_mean(name, known.iter().copied()) {
        Some(guess) => format!("{guess} {list}"),
        None => list,
    }
}
