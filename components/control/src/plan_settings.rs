//! Settings of a plan step: commands by name, each with a truth value or a quantity.

use linkwork_runtime::prelude::*;
use linkwork_runtime::{Located, Param, ParamSpec, ReadCx, Unit, Value, split_quantity};

/// A command.
#[derive(Params, Clone, Debug)]
pub struct Command {
    /// Name of the output.
    pub name: String,
    /// Unit of the number. Default: a truth value.
    pub unit: Option<String>,
    /// Value before a step sets it, and after the plan was aborted, in SI; a truth value is 0 or 1.
    #[param(default = 0.0)]
    pub start: f64,
}

/// Values of commands by their names, as they were written: `{ "radio": true, "level": "50 %" }`.
#[derive(Clone, Debug, Default)]
pub struct Settings(pub Vec<(String, Value)>);

impl Param for Settings {
    fn kind() -> String {
        "map of commands".into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Self> {
        match &v.value {
            Value::Null => Some(Settings::default()),
            Value::Map(entries) => {
                Some(Settings(entries.iter().map(|(k, v)| (k.clone(), v.value.clone())).collect()))
            }
            other => {
                let at = format!("`{}.{}`", cx.path, spec.name);
                let message = format!("{at} must be a map of commands, but it is {}", other.what());
                let help = "write e.g. `{ \"radio\": true }`".to_string();
                cx.fault(v.origin, message, Some(help));
                None
            }
        }
    }
    fn show(&self) -> Value {
        Value::Map(self.0.iter().map(|(k, v)| (k.clone(), v.clone().into())).collect())
    }
}

impl Settings {
    /// Index of each command, and its value in SI.
    ///
    /// # Errors
    /// A command does not exist, is set twice, or cannot have the value.
    pub fn places(&self, commands: &[Command]) -> Result<Vec<(usize, f64)>, BuildError> {
        let mut all: Vec<(usize, f64)> = Vec::new();
        for (name, value) in &self.0 {
            let Some(place) = commands.iter().position(|c| c.name == *name) else {
                let names: Vec<&str> = commands.iter().map(|c| c.name.as_str()).collect();
                let help = format!("commands: {}", names.join(", "));
                return Err(BuildError::new(format!("there is no command `{name}`")).help(help));
            };
            if all.iter().any(|(other, _)| *other == place) {
                let fact = format!("`{name}` is set twice");
                return Err(BuildError::new(fact).help("keep one of the two"));
            }
            all.push((place, number(&commands[place], value)?));
        }
        Ok(all)
    }
}

/// Returns the value of a command as a number in SI.
fn number(command: &Command, value: &Value) -> Result<f64, BuildError> {
    let name = &command.name;
    let refuse =
        |help: String| Err(BuildError::new(format!("`{name}` cannot be {value}")).help(help));
    let Some(unit) = &command.unit else {
        return match value {
            Value::Bool(b) => Ok(f64::from(u8::from(*b))),
            _ => refuse("it is a truth value: write true or false".into()),
        };
    };
    let wanted = format!("write a number in {unit}, or a text with a unit such as \"1 {unit}\"");
    match value {
        Value::Number(x) if x.is_finite() => Ok(*x),
        Value::Text(text) => match split_quantity(text) {
            Some((x, "")) => Ok(x),
            Some((x, written)) => match (Unit::parse(written), Unit::parse(unit)) {
                (Ok(given), Ok(own)) if given.same_quantity(&own) => Ok(given.to_si(x)),
                _ => refuse(wanted),
            },
            None => refuse(wanted),
        },
        _ => refuse(wanted),
    }
}
