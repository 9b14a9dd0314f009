//! Static shots: what the file itself says must come out.

use super::{DaveModel, Role};

/// A value of a shot.
#[derive(Clone, Debug, PartialEq)]
pub struct ShotValue {
    /// Which variable.
    pub variable: usize,
    /// Its value, in the variable's units.
    pub value: f64,
    /// How far the model may be from it.
    pub tolerance: f64,
}

/// Inputs, and what must come out.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// Name of the shot.
    pub name: String,
    /// Line in the file.
    pub line: u32,
    /// Inputs; others keep their initial values.
    pub inputs: Vec<ShotValue>,
    /// Values inside the model and outputs.
    pub wanted: Vec<ShotValue>,
}

/// A value that is not what the shot says.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}: static shot `{shot}`: `{variable}` is {found}, not {wanted} ± {tolerance}")]
pub struct ShotFailure {
    /// Name of the shot.
    pub shot: String,
    /// Line of the shot.
    pub line: u32,
    /// `varID`.
    pub variable: String,
    /// What the model gives.
    pub found: f64,
    /// What the file says.
    pub wanted: f64,
    /// How far apart they may be.
    pub tolerance: f64,
}

impl DaveModel {
    /// Every value of every shot that the model does not give; empty: the model is what its maker meant.
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

    /// Inputs that a shot may set.
    pub(super) fn settable(role: Role) -> bool {
        role != Role::Result
    }
}
