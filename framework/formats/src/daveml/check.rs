//! Static shots: inputs of the file with expected results.

use super::{DaveModel, Role};

/// A value of a shot.
#[derive(Clone, Debug, PartialEq)]
pub struct ShotValue {
    /// Index of the variable.
    pub variable: usize,
    /// Its value, in the variable's units.
    pub value: f64,
    /// Permitted difference of the model.
    pub tolerance: f64,
}

/// Inputs and expected values.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// Name of the shot.
    pub name: String,
    /// Line in the file.
    pub line: u32,
    /// Inputs; others keep their initial values.
    pub inputs: Vec<ShotValue>,
    /// Expected values, inside the model and of outputs.
    pub wanted: Vec<ShotValue>,
}

/// A value that differs from the shot.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}: static shot `{shot}`: `{variable}` is {found}, not {wanted} ± {tolerance}")]
pub struct ShotFailure {
    /// Name of the shot.
    pub shot: String,
    /// Line of the shot.
    pub line: u32,
    /// `varID`.
    pub variable: String,
    /// The value of the model.
    pub found: f64,
    /// The value in the file.
    pub wanted: f64,
    /// Permitted difference.
    pub tolerance: f64,
}

impl DaveModel {
    /// Returns the differences between the model and its shots. Without any, the model works as its author intended.
    pub fn check(&self) -> Vec<ShotFailure> {
        let mut values = vec![0.0; self.variables.len()];
        let mut out = Vec::new();
        for shot in &self.shots {
            self.start(&mut values);
            for v in &shot.inputs {
                values[v.variable] = v.value;
            }
            self.evaluate(&mut values);
            for v in &shot.wanted {
                let found = values[v.variable];
                let close = (found - v.value).abs() <= v.tolerance;
                if !close {
                    out.push(ShotFailure {
                        shot: shot.name.clone(),
                        line: shot.line,
                        variable: self.variables[v.variable].id.clone(),
                        found,
                        wanted: v.value,
                        tolerance: v.tolerance,
                    });
                }
            }
        }
        out
    }

    /// Whether a shot may set variables of this role.
    pub(super) fn settable(role: Role) -> bool {
        role != Role::Result
    }
}
