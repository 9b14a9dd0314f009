//! Memory for calls that a robot does not have from the beginning: created at set-up with the requested capacity, and used by one call at a time.

use crate::robot::Instance;
use crate::status::Fault;
use linkwork_embedded::{RobotError, RobotModel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

/// Memory for the robots of one model.
pub(crate) struct Tool<T> {
    inner: Mutex<T>,
    model: Arc<RobotModel>,
}

impl<T> Tool<T> {
    pub fn new(r: &Instance, inner: T) -> Self {
        let inner = Mutex::new(inner);
        // On some systems a lock allocates at its first use, so use it once here.
        drop(inner.lock().unwrap_or_else(PoisonError::into_inner));
        Self { inner, model: r.robot.model().clone() }
    }
}

/// Returns the memory behind a handle to a call with a robot of the same model. After a panic the memory is not used again.
///
/// # Safety
/// The conditions in the crate documentation apply.
pub(crate) unsafe fn lend<'a, H: 'a, T>(
    what: &'static str,
    handle: *const H,
    tool: impl Fn(&'a H) -> &'a Tool<T>,
    r: &Instance,
) -> Result<MutexGuard<'a, T>, Fault> {
    // SAFETY: a handle of this library that is not freed, or NULL.
    let tool = tool(unsafe { handle.as_ref() }.ok_or(Fault::Null(what))?);
    if !Arc::ptr_eq(&tool.model, r.robot.model()) {
        return Err(RobotError::ForeignHandle.into());
    }
    match tool.inner.try_lock() {
        Ok(inner) => Ok(inner),
        Err(TryLockError::WouldBlock) => Err(Fault::Busy),
        Err(TryLockError::Poisoned(_)) => Err(Fault::Panicked),
    }
}

/// Maximum number of tasks, guards and contact points.
pub(crate) const FEW: usize = 1 << 10;
/// Maximum number of configurations and sections.
pub(crate) const MANY: usize = 1 << 20;

/// Rejects capacities that no program requests intentionally, because a failed allocation would abort the program.
pub(crate) fn room(what: &'static str, asked: usize, most: usize) -> Result<usize, Fault> {
    if asked <= most {
        return Ok(asked);
    }
    let help = if most == FEW { "reserve at most 1024" } else { "reserve at most 1048576" };
    Err(RobotError::OutOfRange { what, value: asked as f64, help }.into())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use linkwork_embedded::multibody::Builder;
    use linkwork_embedded::{ModelSpec, Robot};

    fn instance() -> Instance {
        let spec = ModelSpec { mechanism: Builder::new(), ..ModelSpec::default() };
        Instance::new(Robot::new(&RobotModel::new(&spec).unwrap()))
    }

    #[test]
    fn memory_is_lent_to_one_call_at_a_time_and_not_after_a_panic() {
        let (own, other) = (instance(), instance());
        let tool = Tool::new(&own, 7);
        let ask = |r: &Instance| {
            // SAFETY: the tool lives longer than the borrowed memory.
            let mut lent = unsafe { lend("tool", &tool, |t| t, r) }?;
            *lent += 1;
            Ok::<i32, Fault>(*lent)
        };
        assert_eq!(ask(&own).unwrap(), 8);
        assert!(matches!(ask(&other), Err(Fault::Robot(RobotError::ForeignHandle))));
        // SAFETY: as above.
        let held = unsafe { lend("tool", &tool, |t| t, &own) }.unwrap();
        assert!(matches!(ask(&own), Err(Fault::Busy)));
        drop(held);
        assert_eq!(ask(&own).unwrap(), 9);
        let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            // SAFETY: as above.
            let _held = unsafe { lend("tool", &tool, |t| t, &own) }.unwrap();
            panic!("on purpose");
        }));
        assert!(done.is_err());
        assert!(matches!(ask(&own), Err(Fault::Panicked)));
        for most in [FEW, MANY] {
            assert!(room("places", most, most).is_ok() && room("places", most + 1, most).is_err());
        }
    }
}
