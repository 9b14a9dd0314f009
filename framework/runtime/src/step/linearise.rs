//! ∂ẋ/∂x of the whole system, operation by operation, in the order of their evaluation.
//!
//! ```text
//! operation     y = f(x_k, u)      x_k: the block's own state, u: signals
//! tangents      ∂y/∂x = ∂f/∂x_k ∂x_k/∂x + ∂f/∂u ∂u/∂x
//! solved loop   s(t, x) = t        ∂t/∂x = (1 − ∂s/∂t)⁻¹ ∂s/∂x, then the tangents of what depends on t
//! ```
//! ∂f comes from the block if it has analytic derivatives (the mechanism), otherwise from finite differences of that operation alone: for a motor's
//! current only the motor is evaluated again, not the machine. Signals that do not depend on a state are omitted.
use super::evaluate::{self, Running};
use super::linear::Linear;
use super::simulation::{RunError, Simulation};
use super::stopped::Stopped;
use crate::author::block::{EvalTime, Evaluation};
use crate::author::jacobian::Operation;
use crate::plan::compiled::{Loop, Op};
use linkwork_integrate::{At, System};
use linkwork_spatial::nalgebra::DMatrix;

/// Minimum scale of a state in finite differences, used if its magnitude is unknown.
const LEAST: f64 = 1e-3;

impl Running<'_> {
    /// Computes ∂ẋ/∂x at (t, x), row by row. Returns false if an algebraic loop has no unique solution near this one.
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

    /// Computes the tangents of the signals that one operation writes.
    fn propagate(
        &mut self,
        linear: &mut Linear,
        op: Op,
        now: &EvalTime,
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

    /// Computes the tangents of a solved loop, first with the unknown signals as additional directions.
    fn close(
        &mut self,
        linear: &mut Linear,
        l: &Loop,
        now: &EvalTime,
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
                // A loop does not contain other loops.
                Op::Loop(_) => continue,
            };
            lanes.for_each(|lane| linear.substitute(lane, n));
        }
        Ok(true)
    }

    /// Computes the Jacobian of one operation of block `k`: analytic columns from the block, finite differences for the others.
    fn slopes_of(
        &mut self,
        linear: &mut Linear,
        k: u32,
        operation: Operation,
        now: &EvalTime,
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
        block.jacobian(operation, now, state, &mut linear.slopes).map_err(stopped)?;
        self.differences(linear, k, operation, now, at)
    }

    /// Computes the remaining columns by finite differences of this operation alone.
    fn differences(
        &mut self,
        linear: &mut Linear,
        k: u32,
        operation: Operation,
        now: &EvalTime,
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
            // Index of the signal to perturb; `None` if the column is a state.
            let signal = column.checked_sub(nx).map(|c| linear.reads[c]);
            if let Some(lane) = signal {
                // A signal that feeds two inputs perturbs both, so its first column contains the whole change. A non-finite signal has no derivative.
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
        // Restore the state, including the cache of the block for this evaluation.
        self.once(linear, k, operation, now)?;
        self.sig[own.ym].copy_from_slice(&linear.before[..kept]);
        Ok(())
    }

    /// Runs one operation at the state in `linear`, as a separate evaluation.
    fn once(
        &mut self,
        linear: &mut Linear,
        k: u32,
        operation: Operation,
        now: &EvalTime,
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

impl Simulation {
    /// Returns ẋ at a continuous state `x` ([`Sizes::x`](crate::Sizes) values) at the current instant, with the current discrete states. Entries are
    /// 0 for parts with their own stepping method (a mechanism with contact by impulses). The run is not changed.
    ///
    /// # Errors
    /// Returns the error of a part at that state.
    ///
    /// # Panics
    /// Panics if `x` has the wrong length.
    pub fn rates(&mut self, x: &[f64]) -> Result<Vec<f64>, RunError> {
        assert_eq!(x.len(), self.plan.sizes.x, "lanes of the continuous state");
        let mut rates = vec![0.0; x.len()];
        self.beside(|system, t| system.derivatives(t, x, &mut rates))?;
        Ok(rates)
    }

    /// Returns A = ∂ẋ/∂x at the current state, n × n, in the order of x; variables at [`Place::X`](crate::Place) name the entries. Sampled parts are
    /// held constant. Derivatives are analytic where blocks supply them, and finite differences of single operations elsewhere. Returns `None` if an
    /// algebraic loop has no unique solution here, or if a part has its own stepping method (contact by impulses) and therefore no ẋ.
    ///
    /// # Errors
    /// Returns the error of a part.
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

    /// Calls a function with the integrator's interface of the run, without pins, and restores the run afterwards.
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
