//! ∂ẋ/∂x of the whole system, operation by operation, in the order of their evaluation.
//!
//! ```text
//! operation     y = f(x_k, u)      x_k: the block's own state, u: signals
//! tangents      ∂y/∂x = ∂f/∂x_k ∂x_k/∂x + ∂f/∂u ∂u/∂x
//! solved loop   s(t, x) = t        ∂t/∂x = (1 − ∂s/∂t)⁻¹ ∂s/∂x, then the tangents of what depends on t
//! ```
//! ∂f is what the block says of itself (the mechanism's analytic derivatives), and else differences of that operation
//! alone: a motor is evaluated again for its current, not the machine. Signals that no state moves are left out.
use super::evaluate::{self, Running, Stopped};
use super::{RunError, Simulation, solve};
use crate::block::{Evaluation, Now};
use crate::plan::{Loop, Op, Plan};
use crate::slopes::{Operation, Slopes};
use linkwork_integrate::{At, System};
use linkwork_spatial::nalgebra::DMatrix;
use std::ops::Range;

/// Least size of a sought lane in differences, as in [`solve`].
const SOUGHT: f64 = 1e-3;

/// Least size of a state in differences, where nothing is known of it.
const LEAST: f64 = 1e-3;

/// Lanes of a block that are its own.
#[derive(Clone, Debug)]
struct Own {
    x: Range<usize>,
    ym: Range<usize>,
    yd: Range<usize>,
    reads_outputs: bool,
    after_moore: bool,
}

impl Own {
    fn writes(&self, operation: Operation) -> Range<usize> {
        match operation {
            Operation::Outputs => self.ym.clone(),
            Operation::Feedthrough => self.yd.clone(),
            Operation::Derivatives => self.x.clone(),
        }
    }
}

/// Storage for one plan, made once.
pub(crate) struct Linear {
    /// Columns of the tangents: states, then the sought lanes of the loop that is at work.
    width: usize,
    /// ∂sig/∂x: for each signal lane the columns that are not zero, in the first places of its `width`.
    tangents: Vec<(u32, f64)>,
    /// How many of them.
    count: Vec<u32>,
    slopes: Slopes,
    own: Vec<Own>,
    /// Signals that the operation at work reads, in the order of its columns.
    reads: Vec<usize>,
    x: Vec<f64>,
    xdot: Vec<f64>,
    /// What an operation wrote at the state itself.
    before: Vec<f64>,
    /// The tangent at work, and its columns that may not be zero.
    row: Vec<f64>,
    touched: Vec<u32>,
    marked: Vec<bool>,
    /// For loops: a matrix and a right side, and ∂t/∂x, a row for each sought lane.
    matrix: Vec<f64>,
    right: Vec<f64>,
    solution: Vec<f64>,
}

impl Linear {
    /// Tangents beyond which there are differences of the whole system instead: 16 bytes each.
    pub const SIZE_MAX: usize = 1 << 24;

    /// Places for tangents that a plan needs.
    pub fn size(plan: &Plan) -> usize {
        plan.sizes.sig.saturating_mul(plan.sizes.x + Self::sought_lanes(plan))
    }

    fn sought_lanes(plan: &Plan) -> usize {
        plan.loops.iter().map(|l| l.tears.len()).max().unwrap_or(0)
    }

    pub fn new(plan: &Plan) -> Self {
        let n = plan.sizes.x;
        let own: Vec<Own> = (plan.parts.iter())
            .map(|p| {
                let (w, d) = (&p.wiring, p.prototype.description());
                let ym = crate::model::lanes(&d.outputs);
                let yd = crate::model::lanes(&d.feedthrough_outputs);
                Own {
                    x: w.x..w.x + p.lanes().x,
                    ym: w.ym..w.ym + ym,
                    yd: w.yd..w.yd + yd,
                    reads_outputs: d.functions.derivatives_read_outputs,
                    after_moore: d.functions.feedthrough_after_outputs,
                }
            })
            .collect();
        let most = |of: &dyn Fn(&Own) -> usize| own.iter().map(of).max().unwrap_or(0);
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
            slopes: Slopes::with_capacity(rows * columns, columns),
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

    fn tangent(&self, lane: usize) -> &[(u32, f64)] {
        &self.tangents[lane * self.width..][..self.count[lane] as usize]
    }

    /// A new row.
    fn begin(&mut self) {
        for column in self.touched.drain(..) {
            self.row[column as usize] = 0.0;
            self.marked[column as usize] = false;
        }
    }

    /// Adds to the row at work.
    fn touch(&mut self, column: u32, by: f64) {
        if !std::mem::replace(&mut self.marked[column as usize], true) {
            self.touched.push(column);
        }
        self.row[column as usize] += by;
    }

    /// Adds a multiple of a signal's tangent to the row at work.
    fn add(&mut self, lane: usize, by: f64) {
        for k in 0..self.count[lane] as usize {
            let (column, slope) = self.tangents[lane * self.width + k];
            self.touch(column, by * slope);
        }
    }

    /// The row at work becomes the tangent of a lane.
    fn put(&mut self, lane: usize) {
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

    /// The increment of a signal in a difference: √ε of the larger of its value and what the increments of the states
    /// make of it; towards where it is going.
    fn increment(&self, lane: usize, value: f64, at: &At<'_>) -> f64 {
        let root = f64::EPSILON.sqrt();
        let (mut size, mut rate) = (root * value.abs(), 0.0);
        for (column, slope) in self.tangent(lane) {
            let state = *column as usize;
            match at.steps.get(state) {
                Some(step) => {
                    size = size.max((slope * step).abs());
                    rate += slope * at.f[state];
                }
                // How a sought lane moves is not yet known.
                None => size = size.max(root * SOUGHT * slope.abs()),
            }
        }
        let step = size.max(f64::MIN_POSITIVE.sqrt()).copysign(rate);
        (value + step) - value
    }
}

impl Running<'_> {
    /// ∂ẋ/∂x at (t, x), row by row. False when a loop has no unique solution near this one.
    pub(super) fn linearise(
        &mut self,
        linear: &mut Linear,
        t: f64,
        at: &At<'_>,
        out: &mut [f64],
    ) -> Result<bool, Stopped> {
        let now = self.next(t);
        let plan = self.plan;
        let lanes = (at.x, self.d, &mut *self.sig);
        evaluate::run_all(self.blocks, plan, &plan.stage_ops, &now, lanes, self.pins)?;
        linear.x.copy_from_slice(at.x);
        linear.count.fill(0);
        for &k in &plan.stage_ops {
            if !self.propagate(linear, plan.ops[k as usize], &now, at)? {
                return Ok(false);
            }
        }
        let n = at.x.len();
        out.fill(0.0);
        for &k in &plan.derivs {
            self.slopes_of(linear, k, Operation::Derivatives, &now, at)?;
            for (row, i) in linear.own[k as usize].x.clone().enumerate() {
                linear.chain(k, row);
                out[i * n..(i + 1) * n].copy_from_slice(&linear.row[..n]);
                linear.begin();
            }
        }
        Ok(true)
    }

    /// Tangents of what one operation writes.
    fn propagate(
        &mut self,
        linear: &mut Linear,
        op: Op,
        now: &Now,
        at: &At<'_>,
    ) -> Result<bool, Stopped> {
        let (k, operation) = match op {
            Op::Outputs(k) => (k, Operation::Outputs),
            Op::Feedthrough(k) => (k, Operation::Feedthrough),
            Op::Sum(j) => {
                let sum = &self.plan.sums[j as usize];
                let (dst, n) = (sum.dst as usize, sum.lanes as usize);
                for k in 0..n {
                    for source in sum.sources[k..].iter().step_by(n) {
                        linear.add(*source as usize, 1.0);
                    }
                    linear.put(dst + k);
                }
                return Ok(true);
            }
            Op::Loop(j) => {
                let plan = self.plan;
                return self.close(linear, &plan.loops[j as usize], now, at);
            }
        };
        self.slopes_of(linear, k, operation, now, at)?;
        for (row, lane) in linear.own[k as usize].writes(operation).enumerate() {
            linear.chain(k, row);
            linear.put(lane);
        }
        Ok(true)
    }

    /// Tangents of a solved loop: first with the sought lanes as directions of their own.
    fn close(
        &mut self,
        linear: &mut Linear,
        l: &Loop,
        now: &Now,
        at: &At<'_>,
    ) -> Result<bool, Stopped> {
        let n = at.x.len();
        for (j, (sought, ..)) in l.tears.iter().enumerate() {
            linear.touch((n + j) as u32, 1.0);
            linear.put(*sought as usize);
        }
        for op in &l.ops {
            if !self.propagate(linear, *op, now, at)? {
                return Ok(false);
            }
        }
        if !linear.sought(l, n) {
            return Ok(false);
        }
        for (sought, ..) in &l.tears {
            linear.substitute(*sought as usize, n);
        }
        for op in &l.ops {
            let lanes = match *op {
                Op::Outputs(k) => linear.own[k as usize].ym.clone(),
                Op::Feedthrough(k) => linear.own[k as usize].yd.clone(),
                Op::Sum(j) => {
                    let sum = &self.plan.sums[j as usize];
                    sum.dst as usize..(sum.dst + sum.lanes) as usize
                }
                // Loops do not nest.
                Op::Loop(_) => continue,
            };
            lanes.for_each(|lane| linear.substitute(lane, n));
        }
        Ok(true)
    }

    /// The Jacobian of one operation of block `k`: what the block knows, and differences for the rest.
    fn slopes_of(
        &mut self,
        linear: &mut Linear,
        k: u32,
        operation: Operation,
        now: &Now,
        at: &At<'_>,
    ) -> Result<(), Stopped> {
        let plan = self.plan;
        let own = linear.own[k as usize].clone();
        let wiring = &plan.parts[k as usize].wiring;
        linear.reads.clear();
        if operation == Operation::Derivatives {
            linear.reads.extend(wiring.u.iter().map(|l| *l as usize));
        }
        if operation != Operation::Outputs {
            linear.reads.extend(wiring.ud.iter().map(|l| *l as usize));
        }
        if operation == Operation::Derivatives && own.reads_outputs {
            linear.reads.extend(own.yd.clone());
        }
        let writes = own.writes(operation);
        let states = own.x.clone().map(|_| true);
        let count = &linear.count;
        let moves = linear.reads.iter().map(|l| count[*l] > 0);
        linear.slopes.begin(writes.len(), states.chain(moves));
        let stopped = |failure| Stopped { block: k, failure };
        let state = (at.x, self.d, &*self.sig);
        let block = &mut self.blocks[k as usize];
        block.slopes(operation, now, state, &mut linear.slopes).map_err(stopped)?;
        self.differences(linear, k, operation, now, at)
    }

    /// Columns that the block left, by differences of the operation alone.
    fn differences(
        &mut self,
        linear: &mut Linear,
        k: u32,
        operation: Operation,
        now: &Now,
        at: &At<'_>,
    ) -> Result<(), Stopped> {
        let own = linear.own[k as usize].clone();
        let (writes, nx) = (own.writes(operation), own.x.len());
        let left = |l: &Linear, c: usize| l.slopes.wanted(c) && !l.slopes.known(c);
        if !(0..nx + linear.reads.len()).any(|c| left(linear, c)) {
            return Ok(());
        }
        let kept = own.ym.len();
        linear.before[..kept].copy_from_slice(&self.sig[own.ym.clone()]);
        self.once(linear, k, operation, now)?;
        for (to, row) in writes.clone().enumerate() {
            linear.before[kept + to] = self.written(linear, operation, row);
        }
        for column in 0..nx + linear.reads.len() {
            if !left(linear, column) {
                continue;
            }
            // The signal, or the state, that is moved.
            let signal = column.checked_sub(nx).map(|c| linear.reads[c]);
            if let Some(lane) = signal {
                // A signal that feeds two inputs moves both: its first column has the whole change. One that is not
                // finite has no slope.
                let again = linear.reads[..column - nx].contains(&lane);
                if again || !self.sig[lane].is_finite() {
                    linear.slopes.column(column);
                    continue;
                }
            }
            let (old, step) = match signal {
                None => (at.x[own.x.start + column], at.steps[own.x.start + column]),
                Some(lane) => (self.sig[lane], linear.increment(lane, self.sig[lane], at)),
            };
            match signal {
                None => linear.x[own.x.start + column] = old + step,
                Some(lane) => self.sig[lane] = old + step,
            }
            self.once(linear, k, operation, now)?;
            for (to, row) in writes.clone().enumerate() {
                let change = self.written(linear, operation, row) - linear.before[kept + to];
                linear.slopes.column(column)[to] = change / step;
            }
            match signal {
                None => linear.x[own.x.start + column] = old,
                Some(lane) => self.sig[lane] = old,
            }
        }
        // As it was, what the block keeps for this evaluation included.
        self.once(linear, k, operation, now)?;
        self.sig[own.ym].copy_from_slice(&linear.before[..kept]);
        Ok(())
    }

    /// One operation at the state in `linear`, as an evaluation of its own.
    fn once(
        &mut self,
        linear: &mut Linear,
        k: u32,
        operation: Operation,
        now: &Now,
    ) -> Result<(), Stopped> {
        let now = &self.next(now.t);
        let (block, d) = (&mut self.blocks[k as usize], self.d);
        let (x, sig) = (&linear.x[..], &mut *self.sig);
        let outcome = match operation {
            Operation::Outputs => block.outputs(now, x, d, sig),
            Operation::Feedthrough if linear.own[k as usize].after_moore => {
                block.outputs(now, x, d, sig).and_then(|()| block.feedthrough(now, x, d, sig))
            }
            Operation::Feedthrough => block.feedthrough(now, x, d, sig),
            Operation::Derivatives => block.derivatives(now, x, d, sig, &mut linear.xdot),
        };
        outcome.map_err(|failure| Stopped { block: k, failure })
    }

    fn written(&self, linear: &Linear, operation: Operation, lane: usize) -> f64 {
        if operation == Operation::Derivatives { linear.xdot[lane] } else { self.sig[lane] }
    }
}

impl Linear {
    /// ∂t/∂x of a loop's sought lanes, into `solution`, from the tangents of the lanes that they are to equal. False when
    /// the matrix is singular.
    fn sought(&mut self, l: &Loop, n: usize) -> bool {
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
            if !solve::eliminate(&mut self.matrix[..m * m], &mut self.right[..m], m) {
                return false;
            }
            (0..m).for_each(|i| self.solution[i * n + state] = self.right[i]);
        }
        true
    }

    /// Replaces what a lane's tangent has in sought lanes by what these have in states.
    fn substitute(&mut self, lane: usize, n: usize) {
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

    /// The row at work: the tangent of what block `k` writes as its `row`.
    fn chain(&mut self, k: u32, row: usize) {
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

impl Simulation {
    /// ẋ at a continuous state `x` ([`Sizes::x`](crate::Sizes) lanes) of the present instant, with the discrete states
    /// as they are; 0 for what advances by a method of its own (a mechanism with contact by impulses). The run itself
    /// stays as it is.
    ///
    /// # Errors
    /// What a part refuses there.
    ///
    /// # Panics
    /// When `x` has another number of lanes.
    pub fn rates(&mut self, x: &[f64]) -> Result<Vec<f64>, RunError> {
        assert_eq!(x.len(), self.plan.sizes.x, "lanes of the continuous state");
        let mut rates = vec![0.0; x.len()];
        self.beside(|system, t| system.derivatives(t, x, &mut rates))?;
        Ok(rates)
    }

    /// A = ∂ẋ/∂x at the present state, n × n: the linear system near it, row and column by lane of x; names of the
    /// lanes are those of the variables at [`Place::X`](crate::Place). Sampled parts hold still. Analytic where blocks
    /// know their derivatives, by differences of single operations elsewhere. `None`: a loop that is solved has no
    /// unique solution here, or a part advances by a method of its own (contact by impulses) and has no ẋ.
    ///
    /// # Errors
    /// What a part refuses.
    pub fn state_matrix(&mut self) -> Result<Option<DMatrix<f64>>, RunError> {
        if !self.plan.steps.is_empty() {
            return Ok(None);
        }
        let x = self.state.x.clone();
        let f = self.rates(&x)?;
        let (root, h) = (f64::EPSILON.sqrt(), self.plan.step.seconds());
        let step = |(x, f): (&f64, &f64)| (root * x.abs().max(h * f.abs()).max(LEAST)).copysign(*f);
        let steps: Vec<f64> = x.iter().zip(&f).map(step).collect();
        let mut linear = Linear::new(&self.plan);
        let (n, mut regular) = (x.len(), false);
        let mut out = vec![0.0; n * n];
        self.beside(|system, t| {
            let at = At { x: &x, f: &f, steps: &steps };
            regular = system.linearise(&mut linear, t, &at, &mut out)?;
            Ok(())
        })?;
        Ok(regular.then(|| DMatrix::from_row_slice(n, n, &out)))
    }

    /// Does something with the run as an integrator sees it, without pins, and leaves no trace.
    pub(super) fn beside(
        &mut self,
        work: impl FnOnce(&mut Running<'_>, f64) -> Result<(), Stopped>,
    ) -> Result<(), RunError> {
        let plan = self.plan.clone();
        let now = self.next(Evaluation::Stage);
        let mut sig = self.state.sig.clone();
        let Simulation { state, blocks, work: storage, .. } = self;
        let (d, number) = (&state.d[..], &mut storage.number);
        let mut system = Running {
            plan: &plan,
            blocks,
            d,
            sig: &mut sig,
            now,
            began: state.began(),
            pins: None,
            number,
            linear: None,
            stage: None,
        };
        work(&mut system, now.t).map_err(|stopped| self.stopped(stopped))
    }
}
