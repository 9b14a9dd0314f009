//! Errors of a contact problem and its solution.

use thiserror::Error;

/// Invalid input, or numbers that overflow. Impulses keep their initial values.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ContactError {
    /// A slice has the wrong length.
    #[error(
        "contact problem: `{what}` has {found} numbers, expected {expected}\n  help: give one for each group of rows (`start`: one more; `dof` and `e`: one for each entry)"
    )]
    Length {
        /// Name of the argument.
        what: &'static str,
        /// Expected length.
        expected: usize,
        /// Actual length.
        found: usize,
    },
    /// `start` does not begin at 0, or decreases.
    #[error(
        "contact problem, group {group}: `start` must begin at 0 and never decrease\n  help: give the first entry of each group, and the number of entries at the end"
    )]
    Start {
        /// The group.
        group: usize,
    },
    /// A degree of freedom is out of range or out of order.
    #[error(
        "contact problem, group {group}: degrees of freedom must ascend and be below {dofs}\n  help: sort the entries of a group, and add those that are equal"
    )]
    Dof {
        /// The group.
        group: usize,
        /// Number of degrees of freedom.
        dofs: usize,
    },
    /// A group has zero rows, or more than four.
    #[error(
        "contact problem, group {group}: {rows} rows\n  help: an equality has 1 to 4 rows; use several groups for more"
    )]
    Rows {
        /// The group.
        group: usize,
        /// Rows given.
        rows: usize,
    },
    /// The factor has numbers in lanes that the group does not use.
    #[error(
        "contact problem, group {group}: the factor has numbers beyond row {rows}\n  help: set lanes that the group does not use to 0"
    )]
    Lanes {
        /// The group.
        group: usize,
        /// Rows of the group.
        rows: usize,
    },
    /// A number is not finite.
    #[error(
        "contact problem, group {group}, row {row}: {what} is {value}\n  help: look for a division by zero or an overflow where it is computed"
    )]
    NotFinite {
        /// The group.
        group: usize,
        /// Row within the group.
        row: usize,
        /// Name of the number.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A number is negative or not finite.
    #[error(
        "contact problem, group {group}: {what} is {value}\n  help: it must be finite and not negative"
    )]
    Negative {
        /// The group.
        group: usize,
        /// Name of the number.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// An invalid setting.
    #[error("contact solver: `{what}` is {value}\n  help: {help}")]
    Setting {
        /// Name of the setting.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Remedy.
        help: &'static str,
    },
    /// The solution overflows double precision.
    #[error(
        "contact problem: the numbers overflow\n  help: masses, impulses or velocities are beyond 1e150; use other units"
    )]
    Overflow,
}
