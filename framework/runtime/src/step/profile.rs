//! Where the time of a run goes. In a profiled run each block is wrapped by a block that reads the clock before and after each call and changes
//! nothing else; other runs have no wrappers.
use crate::author::block::{Block, EvalTime, Failure, Outcome};
use crate::author::error::BuildError;
use crate::author::jacobian::{Jacobian, Operation};
use crate::author::model::Fired;
use crate::author::overlay::SharedOverlay;
use crate::author::shown::SharedField;
use crate::plan::compiled::Plan;
use crate::plan::compiled::blocks_of;
use std::any::Any;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Time that a part spent in one of its operations.
#[derive(Clone, Debug, PartialEq)]
pub struct Spent {
    /// Path of the part.
    pub part: String,
    /// Name of the operation, as in [`Block`].
    pub operation: &'static str,
    /// Number of calls.
    pub calls: u64,
    /// Wall time (s) in all calls.
    pub seconds: f64,
}

/// The operations of a block that take time in a step.
const OPERATIONS: [&str; 11] = [
    "outputs",
    "feedthrough",
    "derivatives",
    "update",
    "guards",
    "handle_event",
    "project",
    "retract",
    "advance",
    "jacobian",
    "mode",
];

/// Calls and nanoseconds of each operation.
#[derive(Default)]
struct Counts([[AtomicU64; 2]; OPERATIONS.len()]);

/// Computing time of a run by part and operation, over all phases.
#[derive(Clone, Default)]
pub struct Profile(Arc<Mutex<BTreeMap<String, Arc<Counts>>>>);

/// The wall clock is used for display only, never in the simulation.
#[allow(clippy::disallowed_methods)]
fn now() -> Instant {
    Instant::now()
}

impl Profile {
    fn of(&self, part: &str) -> Arc<Counts> {
        let mut parts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        parts.entry(part.to_string()).or_default().clone()
    }

    /// Returns the operations, the most expensive first. The times of parts include those of the algebraic loops that are solved for them.
    pub fn spent(&self) -> Vec<Spent> {
        let parts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut all = Vec::new();
        for (part, counts) in &*parts {
            for (operation, [calls, ns]) in OPERATIONS.iter().zip(&counts.0) {
                let (calls, ns) = (calls.load(Ordering::Relaxed), ns.load(Ordering::Relaxed));
                if calls > 0 {
                    let seconds = ns as f64 * 1e-9;
                    all.push(Spent { part: part.clone(), operation, calls, seconds });
                }
            }
        }
        all.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
        all
    }

    /// Measures the time (s) that reading the clock adds to one call: the minimum of some tries.
    pub fn clock() -> f64 {
        const PAIRS: u32 = 1000;
        let pairs = || {
            let begin = now();
            for _ in 0..PAIRS {
                std::hint::black_box(now().elapsed());
            }
            begin.elapsed().as_secs_f64() / f64::from(PAIRS)
        };
        (0..20).map(|_| pairs()).fold(f64::INFINITY, f64::min)
    }

    /// Returns the blocks of a plan, each with a clock.
    pub(super) fn blocks(&self, plan: &Plan) -> Vec<Box<dyn Block>> {
        self.around(plan, blocks_of(plan))
    }

    pub(super) fn around(&self, plan: &Plan, blocks: Vec<Box<dyn Block>>) -> Vec<Box<dyn Block>> {
        let one = |(inner, part): (Box<dyn Block>, &crate::plan::compiled::PartPlan)| {
            Box::new(Timed { inner, counts: self.of(&part.path) }) as Box<dyn Block>
        };
        blocks.into_iter().zip(&plan.parts).map(one).collect()
    }
}

struct Timed {
    inner: Box<dyn Block>,
    counts: Arc<Counts>,
}

impl Timed {
    fn clock<R>(&mut self, operation: usize, call: impl FnOnce(&mut dyn Block) -> R) -> R {
        let begin = now();
        let result = call(&mut *self.inner);
        let took = begin.elapsed().as_nanos() as u64;
        let [calls, ns] = &self.counts.0[operation];
        calls.fetch_add(1, Ordering::Relaxed);
        ns.fetch_add(took, Ordering::Relaxed);
        result
    }
}

impl Block for Timed {
    fn outputs(&mut self, now: &EvalTime, x: &[f64], d: &[f64], sig: &mut [f64]) -> Outcome {
        self.clock(0, |b| b.outputs(now, x, d, sig))
    }
    fn feedthrough(&mut self, now: &EvalTime, x: &[f64], d: &[f64], sig: &mut [f64]) -> Outcome {
        self.clock(1, |b| b.feedthrough(now, x, d, sig))
    }
    fn derivatives(
        &mut self,
        now: &EvalTime,
        x: &[f64],
        d: &[f64],
        sig: &[f64],
        xdot: &mut [f64],
    ) -> Outcome {
        self.clock(2, |b| b.derivatives(now, x, d, sig, xdot))
    }
    fn update(&mut self, now: &EvalTime, x: &[f64], d: &mut [f64], sig: &[f64]) -> Outcome {
        self.clock(3, |b| b.update(now, x, d, sig))
    }
    fn guards(
        &mut self,
        now: &EvalTime,
        x: &[f64],
        d: &[f64],
        sig: &[f64],
        values: &mut [f64],
    ) -> Outcome {
        self.clock(4, |b| b.guards(now, x, d, sig, values))
    }
    fn handle_event(
        &mut self,
        now: &EvalTime,
        which: Fired<'_>,
        x: &mut [f64],
        d: &mut [f64],
        sig: &[f64],
    ) -> Outcome {
        self.clock(5, |b| b.handle_event(now, which, x, d, sig))
    }
    fn mode(&mut self, now: &EvalTime, x: &[f64], d: &mut [f64], sig: &[f64]) -> Outcome {
        self.clock(10, |b| b.mode(now, x, d, sig))
    }
    fn project(&mut self, x: &mut [f64]) -> Outcome {
        self.clock(6, |b| b.project(x))
    }
    fn project_change(&mut self, x: &[f64], change: &mut [f64]) -> Outcome {
        self.clock(6, |b| b.project_change(x, change))
    }
    fn rearrange(
        &mut self,
        now: &EvalTime,
        x: &mut [f64],
        d: &mut [f64],
    ) -> Result<bool, Box<Failure>> {
        self.clock(6, |b| b.rearrange(now, x, d))
    }
    fn retract(&mut self, x: &mut [f64], h: f64) -> Outcome {
        self.clock(7, |b| b.retract(x, h))
    }
    fn advance(&mut self, now: &EvalTime, h: f64, x: &mut [f64], sig: &mut [f64]) -> Outcome {
        self.clock(8, |b| b.advance(now, h, x, sig))
    }
    fn jacobian(
        &mut self,
        operation: Operation,
        now: &EvalTime,
        at: (&[f64], &[f64], &[f64]),
        out: &mut Jacobian,
    ) -> Outcome {
        self.clock(9, |b| b.jacobian(operation, now, at, out))
    }
    fn startup_warnings(
        &mut self,
        now: &EvalTime,
        x: &[f64],
        d: &[f64],
        sig: &[f64],
    ) -> Vec<BuildError> {
        self.inner.startup_warnings(now, x, d, sig)
    }
    fn runtime_warning(
        &mut self,
        now: &EvalTime,
        which: Fired<'_>,
        x: &[f64],
        d: &[f64],
        sig: &[f64],
    ) -> Option<BuildError> {
        self.inner.runtime_warning(now, which, x, d, sig)
    }
    fn warns(&mut self) -> Option<BuildError> {
        self.inner.warns()
    }
    fn shown(&self) -> Option<SharedField> {
        self.inner.shown()
    }
    fn overlay(&self) -> Option<SharedOverlay> {
        self.inner.overlay()
    }
    fn see(&mut self, shown: Option<&SharedField>) {
        self.inner.see(shown);
    }
    fn save_store(&self) -> Result<Vec<u8>, String> {
        self.inner.save_store()
    }
    fn load_store(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.inner.load_store(bytes)
    }
    fn copy_store(&self, into: &mut Option<Box<dyn Any + Send>>) {
        self.inner.copy_store(into);
    }
    fn take_store(&mut self, from: &dyn Any) {
        self.inner.take_store(from);
    }
    fn fork(&self) -> Box<dyn Block> {
        self.inner.fork()
    }
}
