//! Which entries of E two groups of rows share, found once and kept while the pattern stays.

use linkwork_dynamics::units::{RowSet, Run};

/// What pairs of groups that meet share: the same from state to state, unless embedded loops change
/// their mobility.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shared {
    /// Rates by which it was found.
    start: Vec<u32>,
    dof: Vec<u32>,
    runs: Vec<Run>,
    /// Where the runs of each pair start; one more number than pairs.
    ends: Vec<usize>,
}

impl Shared {
    /// For the rows as they are now; `meets` are always the same pairs.
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

    /// Of each pair, in their order.
    pub fn pairs(&self) -> impl Iterator<Item = &[Run]> {
        self.ends.windows(2).map(|end| &self.runs[end[0]..end[1]])
    }
}
