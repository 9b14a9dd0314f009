//! Errors in expressions of operators.

use thiserror::Error;

/// An operand as text, with descriptions of its rows and columns.
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

/// Reason why an expression has no value.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum OperatorError {
    /// The columns of the left operand do not match the rows of the right one.
    #[error(
        "cannot multiply {left} by {right}: {} does not match {}\n  help: check the order of the factors, \
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
    /// The operands belong to two systems, or to one system at two configurations.
    #[error(
        "`{left}` and `{right}` belong to different systems or different configurations\n  help: make all \
         operators of an expression from one `Operators`"
    )]
    Systems {
        /// The left operand.
        left: String,
        /// The right operand.
        right: String,
    },
    /// A vector of the wrong length.
    #[error("`{operator}`: {what} has {got} numbers, expected {want}\n  help: {help}")]
    Length {
        /// The operator.
        operator: String,
        /// Name of the vector.
        what: &'static str,
        /// Its length.
        got: usize,
        /// Required length.
        want: usize,
        /// Meaning of the numbers.
        help: &'static str,
    },
    /// A vector or factor with NaN or infinity.
    #[error("`{operator}`: {place} is {value}\n  help: give finite numbers")]
    NotFinite {
        /// The operator.
        operator: String,
        /// Location of the number.
        place: String,
        /// The value.
        value: f64,
    },
    /// An expression that consists only of `I` has no size and therefore no matrix.
    #[error(
        "the size of `{operator}` is not defined\n  help: multiply it by, or add it to, an operator with a size"
    )]
    NoSize {
        /// The expression.
        operator: String,
    },
    /// An inverse for which no recursion is known.
    #[error("no inverse of low order is known for `{operator}`: {reason}\n  help: {help}")]
    NoInverse {
        /// The expression.
        operator: String,
        /// The reason.
        reason: String,
        /// The remedy.
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
        /// The body of the link.
        body: String,
    },
}
