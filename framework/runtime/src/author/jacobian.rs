//! Derivatives of a single operation of a block: of the lanes that it writes with respect to the lanes that it reads.

/// An operation that is computed from state and signals and changes neither.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// [`Block::outputs`](crate::author::block::Block::outputs): writes the outputs, reads the continuous state.
    Outputs,
    /// [`Block::feedthrough`](crate::author::block::Block::feedthrough): writes the feedthrough outputs, reads the continuous state and the
    /// feedthrough inputs.
    Feedthrough,
    /// [`Block::derivatives`](crate::author::block::Block::derivatives): writes the rates of the continuous state, reads that state, all inputs
    /// and, when the model names `y`, its own feedthrough outputs.
    Derivatives,
}

/// The Jacobian of one operation, written column by column. Rows are the lanes that the operation writes, in their
/// order; columns are the block's own lanes of X, then the signals that it reads in the order that [`Operation`] gives.
///
/// A block fills the columns that it knows; the others are computed by differences. If two inputs of a block may be wired to one signal, the block
/// must fill the columns of both or of neither, each with the derivative with respect to that input alone.
#[derive(Clone, Debug, Default)]
pub struct Jacobian {
    rows: usize,
    values: Vec<f64>,
    known: Vec<bool>,
    wanted: Vec<bool>,
}

impl Jacobian {
    /// Creates the Jacobian with memory for `entries` numbers and `columns` columns.
    pub(crate) fn with_capacity(entries: usize, columns: usize) -> Self {
        Jacobian {
            rows: 0,
            values: Vec::with_capacity(entries),
            known: Vec::with_capacity(columns),
            wanted: Vec::with_capacity(columns),
        }
    }

    /// Clears the Jacobian for an operation that writes `rows` lanes; `wanted`: for each column, whether it is needed.
    pub(crate) fn begin(&mut self, rows: usize, wanted: impl Iterator<Item = bool>) {
        self.rows = rows;
        self.wanted.clear();
        self.wanted.extend(wanted);
        self.known.clear();
        self.known.resize(self.wanted.len(), false);
        self.values.clear();
        self.values.resize(rows * self.wanted.len(), 0.0);
    }

    /// Returns true if a column is requested: the other columns do not depend on any state.
    #[must_use]
    pub fn wanted(&self, column: usize) -> bool {
        self.wanted[column]
    }

    /// Returns a column to be filled; it is zero and counts as known from now on.
    pub fn column(&mut self, column: usize) -> &mut [f64] {
        self.known[column] = true;
        &mut self.values[column * self.rows..(column + 1) * self.rows]
    }

    /// Returns whether a column was filled.
    pub(crate) fn known(&self, column: usize) -> bool {
        self.known[column]
    }

    /// A column as it stands.
    pub(crate) fn read(&self, column: usize) -> &[f64] {
        &self.values[column * self.rows..(column + 1) * self.rows]
    }
}
