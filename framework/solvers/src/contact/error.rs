//! Why a contact problem is refused, or could not be answered.

use thiserror::Error;

/// A mistake in the input, or numbers that overflow. Impulses are left as they were given.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ContactError {
    /// A slice of the wrong length.
    #[error(
        "contact problem: `{what}` has {found} numbers, where {expected} belong\n  help: one for each group of rows (`start`: one more; `dof` and `e`: one for each entry)"
    )]
    Length {
        /// Name of the argument.
        what: &'static str,
        /// Length wanted.
        expected: usize,
        /// Length given.
        found: usize,
    },
    /// `start` does not begin at 0, or falls.
    #[error(
        "contact problem, group {group}: `start` begins at 0 and never falls; here it does not\n  help: give the first entry of each group, and the number of entries at the end"
    )]
    Start {
        /// The group.
        group: usize,
    },
    /// A degree of freedom out of range or out of order.
    #[error(
        "contact problem, group {group}: degrees of freedom must ascend and be below {dofs}\n  help: sort the entries of a group, and add those that are equal"
    )]
    Dof {
        /// The group.
        group: usize,
        /// Number of degrees of freedom.
        dofs: usize,
    },
    /// A group without rows or with more than four.
    #[error(
        "contact problem, group {group}: {rows} rows\n  help: an equality has 1 to 4 rows; use several groups for more"
    )]
    Rows {
        /// The group.
        group: usize,
        /// Rows given.
        rows: usize,
    },
    /// Numbers in lanes of the factor which the group does not have.
    #[error(
        "contact problem, group {group}: the factor has numbers beyond row {rows}\n  help: leave lanes that the group lacks at 0"
    )]
    Lanes {
        /// The group.
        group: usize,
        /// Rows of the group.
        rows: usize,
    },
    /// A number that is not finite.
    #[error(
        "contact problem, group {group}, row {row}: {what} is {value}\n  help: look for a division by zero or an overflow where it is computed"
    )]
    NotFinite {
        /// The group.
        group: usize,
        /// Row within the group.
        row: usize,
        /// What the number is.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A number that is negative or not finite.
    #[error(
        "contact problem, group {group}: {what} is {value}\n  help: it must be finite and not negative"
    )]
    Negative {
        /// The group.
        group: usize,
        /// What the number is.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A setting that makes no sense.
    #[error("contact solver: `{what}` is {value}\n  help: {help}")]
    Setting {
        /// Name of the setting.
        what: &'static str,
        /// The number.
        value: f64,
        /// What may be given.
        help: &'static str,
    },
    /// The answer does not fit into double precision.
    #[error(
        "contact problem: the numbers overflow\n  help: masses, impulses or velocities are beyond 1e150; use other units"
    )]
    Overflow,
}
