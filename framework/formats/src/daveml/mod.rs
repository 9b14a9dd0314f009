//! DAVE-ML 2.0 (ANSI/AIAA S-119-2011): a static model as variables, tables and formulas.
//! ```text
//! variable   constant (initialValue), input, or result of a formula (MathML) or of a table function
//! order      every variable after those it is made of; a circle is refused
//! function   table over breakpoints, the last independent variable fastest; clamped at its ends
//!            unless `extrapolate` says otherwise; linear unless `interpolate` says otherwise;
//!            or points without a grid, linear in the triangles between them
//! checkData  static shots: inputs, and what must come out
//! ```
//! Completely read: variableDef, breakpointDef, griddedTableDef, ungriddedTableDef of one and of two variables, function, calculation, checkData.
//! Rejected with position and remedy: ungridded tables of more variables, splines, scripts. Elements without an effect (authors, provenance,
//! uncertainty) are listed as not used. Values are in the units of the file.

mod axis;
mod check;
mod mathml;
mod read;
mod scattered;
mod table;
mod units;

pub use check::{Shot, ShotFailure, ShotValue};
pub use read::read_dave;
pub use units::unit_text;

use crate::Ignored;
use mathml::Expression;
use table::Function;

/// The role of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// An input: `isInput`, or a variable without a value or a formula.
    Input,
    /// Keeps its `initialValue`.
    Constant,
    /// The result of a formula or a function.
    Result,
}

/// A variable of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct DaveVariable {
    /// `varID`.
    pub id: String,
    /// `name`; for a standard variable the name of AIAA S-119.
    pub name: String,
    /// `units` as written.
    pub units: String,
    /// `sign`, the positive direction, such as `ANU`; empty if it is missing.
    pub sign: String,
    /// First lines of its description.
    pub doc: String,
    /// Its role.
    pub role: Role,
    /// `isOutput`.
    pub output: bool,
    /// `isStdAIAA`: its name has the meaning of AIAA S-119.
    pub standard: bool,
    /// `initialValue`.
    pub initial: Option<f64>,
    /// `minValue`, `maxValue`: the value is clamped to these limits.
    pub limits: [f64; 2],
}

/// The computation of a result.
#[derive(Clone, Debug)]
enum Making {
    Formula(Expression),
    Table(Function),
}

/// A complete model. It is evaluated in place on one slice of values and has no state.
#[derive(Clone, Debug)]
pub struct DaveModel {
    /// Name in the header.
    pub name: String,
    /// Variables in the order of the file.
    pub variables: Vec<DaveVariable>,
    /// Static shots of the file.
    pub shots: Vec<Shot>,
    /// Unused elements.
    pub ignored: Vec<Ignored>,
    /// Results, each after the variables that it needs.
    order: Vec<(usize, Making)>,
}

impl DaveModel {
    /// Returns the index of a variable by its `varID`.
    pub fn find(&self, id: &str) -> Option<usize> {
        self.variables.iter().position(|v| v.id == id)
    }

    /// Returns the index of a variable by its `name`.
    pub fn named(&self, name: &str) -> Option<usize> {
        self.variables.iter().position(|v| v.name == name)
    }

    /// Whether any function has a table, so that inputs can be outside.
    pub fn has_tables(&self) -> bool {
        self.order.iter().any(|(_, m)| matches!(m, Making::Table(_)))
    }

    /// Writes the initial values; 0 where there is none. `values`: one for each variable.
    pub fn start(&self, values: &mut [f64]) {
        for (value, variable) in values.iter_mut().zip(&self.variables) {
            *value = variable.initial.unwrap_or(0.0);
        }
    }

    /// Clamps inputs to their limits and computes every result, in one pass over formulas and tables without allocation.
    ///
    /// Returns the distance to the breakpoints of all tables as a share of their width: 0 on an edge, negative outside a clamped table, 1 without
    /// tables. It is continuous in the inputs.
    pub fn evaluate(&self, values: &mut [f64]) -> f64 {
        for (value, variable) in values.iter_mut().zip(&self.variables) {
            if variable.role == Role::Input {
                *value = value.clamp(variable.limits[0], variable.limits[1]);
            }
        }
        let mut inside = 1.0_f64;
        for (place, making) in &self.order {
            let raw = match making {
                Making::Formula(e) => e.value(values),
                Making::Table(f) => {
                    let (y, margin) = f.value(values);
                    // The negated comparison also treats NaN as outside.
                    if !(margin >= inside) {
                        inside = margin;
                    }
                    y
                }
            };
            let [low, high] = self.variables[*place].limits;
            // `clamp` returns NaN for NaN.
            values[*place] = raw.clamp(low, high);
        }
        inside
    }
}
