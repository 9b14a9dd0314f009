//! Storage of the linearization of a plan.
use super::operation::eliminate;
use crate::author::jacobian::{Jacobian, Operation};
use crate::plan::compiled::{Loop, Plan};
use linkwork_integrate::At;
use std::ops::Range;

/// Minimum scale of a sought lane in differences, as in [`solve`].
pub(super) const SOUGHT: f64 = 1e-3;

/// Lanes that belong to a block.
#[derive(Clone, Debug)]
pub(super) struct BlockSlots {
    pub(super) x: Range<usize>,
    pub(super) ym: Range<usize>,
    pub(super) yd: Range<usize>,
    pub(super) reads_outputs: bool,
    pub(super) after_moore: bool,
}

impl BlockSlots {
    pub(super) fn writes(&self, operation: Operation) -> Range<usize> {
        match operation {
            Operation::Outputs => self.ym.clone(),
            Operation::Feedthrough => self.yd.clone(),
            Operation::Derivatives => self.x.clone(),
        }
    }
}

/// Storage for one plan, allocated once.
pub(crate) struct Linear {
    /// Columns of the tangents: states, then the sought lanes of the present loop.
    pub(super) width: usize,
    /// ∂sig/∂x: for each signal lane the nonzero columns, in the first of its `width` slots.
    pub(super) tangents: Vec<(u32, f64)>,
    /// Number of nonzero columns of each lane.
    pub(super) count: Vec<u32>,
    pub(super) slopes: Jacobian,
    pub(super) own: Vec<BlockSlots>,
    /// Signals that the present operation reads, in the order of its columns.
    pub(super) reads: Vec<usize>,
    pub(super) x: Vec<f64>,
    pub(super) xdot: Vec<f64>,
    /// Values that an operation wrote at the unperturbed state.
    pub(super) before: Vec<f64>,
    /// The present tangent, and its columns that may be nonzero.
    pub(super) row: Vec<f64>,
    pub(super) touched: Vec<u32>,
    pub(super) marked: Vec<bool>,
    /// For loops: a matrix and a right side, and ∂t/∂x, a row for each sought lane.
    pub(super) matrix: Vec<f64>,
    pub(super) right: Vec<f64>,
    pub(super) solution: Vec<f64>,
}

impl Linear {
    /// Number of tangents (16 bytes each) beyond which differences of the whole system are used instead.
    pub const SIZE_MAX: usize = 1 << 24;

    /// Returns the number of tangents for which a plan needs storage.
    pub fn size(plan: &Plan) -> usize {
        plan.sizes.sig.saturating_mul(plan.sizes.x + Self::sought_lanes(plan))
    }

    pub(super) fn sought_lanes(plan: &Plan) -> usize {
        plan.loops.iter().map(|l| l.tears.len()).max().unwrap_or(0)
    }

    pub fn new(plan: &Plan) -> Self {
        let n = plan.sizes.x;
        let own: Vec<BlockSlots> = (plan.parts.iter())
            .map(|p| {
                let (w, d) = (&p.wiring, p.prototype.description());
                let ym = crate::author::model::lanes(&d.outputs);
                let yd = crate::author::model::lanes(&d.feedthrough_outputs);
                BlockSlots {
                    x: w.x..w.x + p.lanes().x,
                    ym: w.ym..w.ym + ym,
                    yd: w.yd..w.yd + yd,
                    reads_outputs: d.functions.derivatives_read_outputs,
                    after_moore: d.functions.feedthrough_after_outputs,
                }
            })
            .collect();
        let most = |of: &dyn Fn(&BlockSlots) -> usize| own.iter().map(of).max().unwrap_or(0);
        let columns = (plan.parts.iter().zip(&own))
            .map(|(p, o)| o.x.len() + p.wiring.u.len() + p.wiring.ud.len() + o.yd.len())
            .max()
            .unwrap_or(0);
        let rows = most(&|o| o.x.len().max(o.ym.len()).max(o.yd.len()));
        let sought = Self::sought_lanes(plan);
        let width = n + sought;
        Linear {
            width,
            tangents: vec![(0, 0.0); plan.sizes.sig * width],
            count: vec![0; plan.sizes.sig],
            slopes: Jacobian::with_capacity(rows * columns, columns),
            reads: Vec::with_capacity(columns),
            x: vec![0.0; n],
            xdot: vec![0.0; n],
            before: vec![0.0; rows + most(&|o| o.ym.len())],
            row: vec![0.0; width],
            touched: Vec::with_capacity(width),
            marked: vec![false; width],
            matrix: vec![0.0; sought * sought],
            right: vec![0.0; sought],
            solution: vec![0.0; sought * n],
            own,
        }
    }

    pub(super) fn tangent(&self, lane: usize) -> &[(u32, f64)] {
        &self.tangents[lane * self.width..][..self.count[lane] as usize]
    }

    /// A new row.
    pub(super) fn begin(&mut self) {
        for column in self.touched.drain(..) {
            self.row[column as usize] = 0.0;
            self.marked[column as usize] = false;
        }
    }

    /// Adds to the row at work.
    pub(super) fn touch(&mut self, column: u32, by: f64) {
        if !std::mem::replace(&mut self.marked[column as usize], true) {
            self.touched.push(column);
        }
        self.row[column as usize] += by;
    }

    /// Adds a multiple of a signal's tangent to the row at work.
    pub(super) fn add(&mut self, lane: usize, by: f64) {
        for k in 0..self.count[lane] as usize {
            let (column, slope) = self.tangents[lane * self.width + k];
            self.touch(column, by * slope);
        }
    }

    /// Stores the present row as the tangent of a lane.
    pub(super) fn put(&mut self, lane: usize) {
        let mut count = 0;
        for column in self.touched.drain(..) {
            let slope = std::mem::take(&mut self.row[column as usize]);
            self.marked[column as usize] = false;
            if slope != 0.0 {
                self.tangents[lane * self.width + count] = (column, slope);
                count += 1;
            }
        }
        self.count[lane] = count as u32;
    }

    /// Returns the increment of a signal in a difference: the larger of √ε times its value and its change by the increments of the states, in the
    /// direction in which it changes.
    pub(super) fn increment(&self, lane: usize, value: f64, at: &At<'_>) -> f64 {
        let root = f64::EPSILON.sqrt();
        let (mut size, mut rate) = (root * value.abs(), 0.0);
        for (column, slope) in self.tangent(lane) {
            let state = *column as usize;
            match at.steps.get(state) {
                Some(step) => {
                    size = size.max((slope * step).abs());
                    rate += slope * at.f[state];
                }
                // The change of a sought signal within the step is not known yet.
                None => size = size.max(root * SOUGHT * slope.abs()),
            }
        }
        let step = size.max(f64::MIN_POSITIVE.sqrt()).copysign(rate);
        (value + step) - value
    }
}

impl Linear {
    /// Computes ∂t/∂x of the sought lanes of a loop into `solution`, from the tangents of the lanes that they must equal. Returns false if the matrix
    /// is singular.
    pub(super) fn sought(&mut self, l: &Loop, n: usize) -> bool {
        let m = l.tears.len();
        self.solution[..m * n].fill(0.0);
        for (i, (_, sent, _)) in l.tears.iter().enumerate() {
            for k in 0..self.count[*sent as usize] as usize {
                let (column, slope) = self.tangents[*sent as usize * self.width + k];
                if (column as usize) < n {
                    self.solution[i * n + column as usize] = slope;
                }
            }
        }
        for state in 0..n {
            (0..m).for_each(|i| self.right[i] = self.solution[i * n + state]);
            self.matrix[..m * m].fill(0.0);
            for (i, (_, sent, _)) in l.tears.iter().enumerate() {
                self.matrix[i * m + i] = 1.0;
                for k in 0..self.count[*sent as usize] as usize {
                    let (column, slope) = self.tangents[*sent as usize * self.width + k];
                    if let Some(j) = (column as usize).checked_sub(n) {
                        self.matrix[i * m + j] -= slope;
                    }
                }
            }
            if !eliminate(&mut self.matrix[..m * m], &mut self.right[..m], m) {
                return false;
            }
            (0..m).for_each(|i| self.solution[i * n + state] = self.right[i]);
        }
        true
    }

    /// Replaces the derivatives of a lane with respect to sought lanes by derivatives with respect to states.
    pub(super) fn substitute(&mut self, lane: usize, n: usize) {
        for k in 0..self.count[lane] as usize {
            let (column, slope) = self.tangents[lane * self.width + k];
            match (column as usize).checked_sub(n) {
                None => self.touch(column, slope),
                Some(j) => {
                    for state in 0..n {
                        let by = slope * self.solution[j * n + state];
                        if by != 0.0 {
                            self.touch(state as u32, by);
                        }
                    }
                }
            }
        }
        self.put(lane);
    }

    /// Computes the present row: the tangent of the lane that block `k` writes as its `row`.
    pub(super) fn chain(&mut self, k: u32, row: usize) {
        self.begin();
        let own = self.own[k as usize].x.clone();
        let nx = own.len();
        for (column, state) in own.enumerate() {
            let by = self.slopes.read(column)[row];
            if by != 0.0 {
                self.touch(state as u32, by);
            }
        }
        for c in 0..self.reads.len() {
            let by = self.slopes.read(nx + c)[row];
            if by != 0.0 {
                self.add(self.reads[c], by);
            }
        }
    }
}
