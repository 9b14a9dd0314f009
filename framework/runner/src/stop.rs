//! A request to stop a run.
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Requests that a run stops at its next tick. It may be set from a signal handler or another thread.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Requests the stop. Returns true if it was already requested.
    pub fn set(&self) -> bool {
        self.0.swap(true, Ordering::SeqCst)
    }
    /// Returns the flag, for a simulation that checks it between two ticks.
    pub(crate) fn flag(&self) -> Arc<AtomicBool> {
        self.0.clone()
    }
    /// Returns whether the stop was requested.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
