//! Finds the entries of E that two groups of rows share, and caches them while the pattern stays the same.

use linkwork_dynamics::units::{RowSet, Run};

/// Shared entries of pairs of groups: the same at every state, unless embedded loops change their mobility.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shared {
    /// Pattern from which it was computed.
    start: Vec<u32>,
    dof: Vec<u32>,
    runs: Vec<Run>,
    /// First run of each pair; one more number than pairs.
    ends: Vec<usize>,
}

impl Shared {
    /// Updates the entries for the present rows; `meets` are always the same pairs.
    pub fn update(&mut self, rows: &RowSet, meets: &[(u32, u32)]) {
        if self.start == rows.start() && self.dof == rows.dof() {
            return;
        }
        self.start.clear();
        self.start.extend_from_slice(rows.start());
        self.dof.clear();
        self.dof.extend_from_slice(rows.dof());
        self.runs.clear();
        self.ends.clear();
        self.ends.push(0);
        for (g, h) in meets {
            rows.shared(*h as usize, *g as usize, &mut self.runs);
            self.ends.push(self.runs.len());
        }
    }

    /// Returns the shared runs of each pair, in order.
    pub fn pairs(&self) -> impl Iterator<Item = &[Run]> {
        self.ends.windows(2).map(|end| &self.runs[end[0]..end[1]])
    }
}
