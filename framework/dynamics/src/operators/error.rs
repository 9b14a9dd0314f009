//! What can be wrong with an expression of operators.

use thiserror::Error;

/// An operand as it was written, and its rows and columns in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Operand {
    /// The expression.
    pub text: String,
    /// Its rows, such as `nv = 7`.
    pub rows: String,
    /// Its columns.
    pub columns: String,
}

impl std::fmt::Display for Operand {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "`{}` ({} × {})", self.text, self.rows, self.columns)
    }
}

/// Why an expression has no value.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum OperatorError {
    /// The columns of the left operand are not the rows of the right one.
    #[error(
        "cannot multiply {left} by {right}: {} meets {}\n  help: check the order of the factors, \
         and which are transposed", left.columns, right.rows
    )]
    Multiply {
        /// The left operand.
        left: Box<Operand>,
        /// The right operand.
        right: Box<Operand>,
    },
    /// Two operands of a sum have different sizes.
    #[error(
        "cannot add {left} and {right}\n  help: terms need the same rows and columns; `I` needs a \
         square partner"
    )]
    Add {
        /// The left operand.
        left: Box<Operand>,
        /// The right operand.
        right: Box<Operand>,
    },
    /// The operands belong to two systems, or to one at two configurations.
    #[error(
        "`{left}` and `{right}` are of different systems or different moments\n  help: make all \
         operators of an expression from one `Operators`"
    )]
    Systems {
        /// The left operand.
        left: String,
        /// The right operand.
        right: String,
    },
    /// A vector of the wrong length.
    #[error("`{operator}`: {what} has {got} numbers, not {want}\n  help: {help}")]
    Length {
        /// The operator.
        operator: String,
        /// Which vector.
        what: &'static str,
        /// Its length.
        got: usize,
        /// The length it should have.
        want: usize,
        /// What the numbers are.
        help: &'static str,
    },
    /// A vector or factor with a NaN or infinity.
    #[error("`{operator}`: {place} is {value}\n  help: give finite numbers")]
    NotFinite {
        /// The operator.
        operator: String,
        /// Which number.
        place: String,
        /// What it is.
        value: f64,
    },
    /// A matrix is asked of an expression of nothing but `I`.
    #[error(
        "`{operator}` has no size of its own\n  help: multiply it by, or add it to, an operator that has one"
    )]
    NoSize {
        /// The expression.
        operator: String,
    },
    /// An inverse that no recursion gives.
    #[error("no inverse of low order is known for `{operator}`: {reason}\n  help: {help}")]
    NoInverse {
        /// The expression.
        operator: String,
        /// Why.
        reason: String,
        /// What can be done instead.
        help: &'static str,
    },
    /// A block that has no inverse.
    #[error(
        "`{operator}` has no inverse: the link of body `{body}` has no mass or no inertia\n  help: \
         hinges of several subhinges have massless links inside; `D`, `φ` and `H φ M φ* H* + J` \
         can be inverted all the same"
    )]
    Singular {
        /// The operator.
        operator: String,
        /// The body whose link it is.
        body: String,
    },
}
