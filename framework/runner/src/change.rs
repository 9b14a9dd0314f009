//! Changes of variables from outside during a run: set, pin and unpin, by path or pattern, in any unit.
//!
//! A change acts from the present tick on, before its samples are taken, and logs contain it.
use crate::run::{Runner, Watch};
use linkwork_assembly::Text;
use linkwork_assembly::patterns::match_patterns;
use linkwork_runtime::{
    Change, Origin, Role, Simulation, Unit, Value, VariableError, split_quantity,
};

fn no<T>(message: String, help: impl Into<String>) -> Result<T, VariableError> {
    Err(VariableError { message, help: help.into() })
}

/// Parses `PATH=VALUE`, or `PATH` alone: the path or pattern, and a number or a quantity.
pub fn assignment(written: &str) -> (String, Option<Value>) {
    match written.split_once('=') {
        None => (written.trim().to_string(), None),
        Some((path, value)) => {
            let number = value.trim().parse().map(Value::Number);
            let value = number.unwrap_or_else(|_| Value::Text(value.trim().to_string()));
            (path.trim().to_string(), Some(value))
        }
    }
}

/// Returns the variables of the present phase that a pattern matches. For a pattern with a star, these are only variables that support the change
/// (states and unconnected inputs can be set; outputs can also be pinned); otherwise the variable with this path.
fn meant(sim: &Simulation, pattern: &str, change: Change) -> Result<Vec<String>, VariableError> {
    if !pattern.contains('*') {
        return Ok(vec![pattern.to_string()]);
    }
    let fits = |path: &&String| match (sim.plan().lanes[*path].role, change) {
        (Role::State | Role::Free, _) | (Role::Output, Change::Pin) => true,
        (Role::Output | Role::Input, _) => false,
    };
    let names: Vec<&str> = match change {
        Change::Unpin => sim.pins().map(|(path, _)| path).collect(),
        Change::Set | Change::Pin => {
            sim.plan().lanes.keys().filter(fits).map(String::as_str).collect()
        }
    };
    let text = Text { text: pattern.to_string(), origin: Origin::NONE };
    match match_patterns(&[text], &names) {
        Ok(found) => Ok(found.into_iter().map(|k| names[k].to_string()).collect()),
        Err(_) => match change {
            Change::Set => no(
                format!("`{pattern}` matches no variable that can be set"),
                "states and unconnected inputs can be set; `linkwork list` shows all variables",
            ),
            Change::Pin => no(
                format!("`{pattern}` matches no variable that can be pinned"),
                "`*` stands for one part of a path, `**` for any number; `linkwork list` shows all variables",
            ),
            Change::Unpin => {
                let known = if names.is_empty() {
                    "nothing is".to_string()
                } else {
                    format!("pinned are: {}", names.join(", "))
                };
                no(format!("`{pattern}` does not match a pinned variable"), known)
            }
        },
    }
}

/// Converts a value to SI: numbers are in SI, texts contain a unit of the variable's quantity.
fn in_si(sim: &Simulation, path: &str, value: &Value) -> Result<f64, VariableError> {
    let variable = sim.variable(path)?;
    let text = match value {
        Value::Number(x) => return Ok(*x),
        Value::Text(text) => text,
        other => {
            return no(format!("`{other}` is not a quantity"), "write a number, or `\"12 deg\"`");
        }
    };
    let Some((number, unit)) = split_quantity(text) else {
        return no(format!("`{text}` is not a quantity"), "write a number, or `\"12 deg\"`");
    };
    let own = Unit::parse(&variable.unit).unwrap_or(Unit::ONE);
    match Unit::parse(unit) {
        Ok(u) if u.same_quantity(&own) => Ok(u.to_si(number)),
        Ok(_) => no(
            format!("`{path}` is in {}, which is a different quantity than {unit}", variable.unit),
            "give a unit of the same quantity, or a number in SI",
        ),
        Err(e) => no(e.to_string(), "give a number in SI"),
    }
}

/// Sets, pins or unpins all variables that a path or pattern matches, or none of them, in a simulation without recorders. Returns the variables and
/// their values (SI).
///
/// # Errors
/// Like [`Runner::change`].
pub fn changed(
    sim: &mut Simulation,
    pattern: &str,
    change: Change,
    value: Option<&Value>,
) -> Result<Vec<(String, f64)>, VariableError> {
    let mut all = Vec::new();
    for path in meant(sim, pattern, change)? {
        let value = match (value, change) {
            (Some(value), Change::Set | Change::Pin) => in_si(sim, &path, value)?,
            (None, Change::Set) => {
                return no(format!("`{pattern}`: the value is missing"), "write PATH=VALUE");
            }
            (None, Change::Pin) | (_, Change::Unpin) => sim.get(&path)?,
        };
        all.push((path, value));
    }
    sim.change_all(change, &all)?;
    Ok(all)
}

impl<W: Watch> Runner<W> {
    /// Sets, pins or unpins all variables that a path or pattern matches, or none of them, and informs the recorders, so that logs contain the
    /// change. A pin without a value keeps the present one. Returns the variables and their values (SI).
    ///
    /// # Errors
    /// Errors of [`Simulation::set`], [`Simulation::pin`], [`Simulation::unpin`]; a pattern without a match; a unit of another quantity; a missing
    /// value.
    pub fn change(
        &mut self,
        pattern: &str,
        change: Change,
        value: Option<&Value>,
    ) -> Result<Vec<(String, f64)>, VariableError> {
        let all = changed(self.sim_mut(), pattern, change, value)?;
        self.tell(change, &all);
        Ok(all)
    }

    /// Like [`Runner::change`], for variables by path, with values in SI, in this order.
    ///
    /// # Errors
    /// The first error; no variable is changed then.
    pub fn change_all(
        &mut self,
        change: Change,
        all: &[(String, f64)],
    ) -> Result<(), VariableError> {
        self.sim_mut().change_all(change, all)?;
        self.tell(change, all);
        Ok(())
    }

    /// Informs the recorders of the changes at the present tick ([`changed`]), before its samples are taken.
    pub fn tell(&mut self, change: Change, all: &[(String, f64)]) {
        for (path, value) in all {
            self.tell_taps(path, change, *value);
        }
    }
}
