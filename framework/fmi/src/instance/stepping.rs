//! Steps of co-simulation units, and the events inside them.
//!
//! ```text
//! without event mode    doStep(t, h)
//! with event mode (3.0) doStep(t, rest) → returns early at an event → EnterEventMode → UpdateDiscreteStates until it is done → EnterStepMode → ..
//! ```
//! A unit with event mode stops at its own events; the rest of the communication step continues from there.

use super::{Instance, Kind, Result, ended, failure, there};
use crate::unit::Functions;
use crate::unit::has_events;

/// Largest number of events in one communication step.
const MOST: usize = 10_000;

impl Instance {
    /// Returns whether it is run with event mode. Discrete inputs are then set between [`Instance::enter_event`] and the passes of
    /// the event.
    pub fn steps_with_events(&self) -> bool {
        self.kind == Kind::CoSimulation && has_events(&self.unit)
    }

    /// Advances a co-simulation unit from `t` by `h` (s). `passes` makes the passes of an event, in event mode.
    pub fn step(
        &mut self,
        t: f64,
        h: f64,
        mut passes: impl FnMut(&mut Instance, f64) -> Result<()>,
    ) -> Result<()> {
        let unit = self.unit.clone();
        if let Functions::V2(f) = &unit.functions {
            let step = there(f.do_step, "fmi2DoStep")?;
            // SAFETY: a living co-simulation instance; arguments are numbers.
            let status = unsafe { step(self.raw, t, h, 0) };
            return self.check(status, "DoStep");
        }
        let (end, mut now) = (t + h, t);
        for _ in 0..MOST {
            let step = if now == t { h } else { end - now };
            let (event, reached) = self.step_once(now, step)?;
            if event {
                self.enter_event()?;
                passes(self, reached.unwrap_or(end))?;
                self.enter_step()?;
            }
            match reached {
                None => return Ok(()),
                Some(time) if time >= end => return Ok(()),
                Some(time) if time < now || !time.is_finite() => {
                    let fact = format!("the unit stopped at {time} s in a step from {now} s");
                    return Err(failure(fact, "contact the vendor of the unit"));
                }
                Some(time) => now = time,
            }
        }
        let fact = format!("the unit stopped {MOST} times in the step from {t} s, last at {now} s");
        Err(failure(fact, "use a shorter step, or a unit without chattering events"))
    }

    /// Calls `fmi3DoStep` once. Returns whether there is an event, and where the unit stopped if it stopped early.
    fn step_once(&mut self, t: f64, h: f64) -> Result<(bool, Option<f64>)> {
        let unit = self.unit.clone();
        let Functions::V3(f) = &unit.functions else { return Ok((false, None)) };
        let step = there(f.do_step, "fmi3DoStep")?;
        let (mut event, mut end, mut early, mut reached) = (0, 0, 0, t + h);
        // SAFETY: a living co-simulation instance, with room for four answers.
        let status =
            unsafe { step(self.raw, t, h, false, &mut event, &mut end, &mut early, &mut reached) };
        self.check(status, "DoStep")?;
        if end != 0 {
            return Err(ended(&self.log));
        }
        if early != 0 && !has_events(&unit) {
            return Err(failure(
                format!("the unit stopped inside its step, at {reached} s"),
                "early return was not allowed: contact the vendor of the unit, or use a shorter step",
            ));
        }
        Ok((event != 0 && has_events(&unit), (early != 0).then_some(reached)))
    }

    /// Returns from event mode to step mode.
    pub fn enter_step(&mut self) -> Result<()> {
        let unit = self.unit.clone();
        let Functions::V3(f) = &unit.functions else { return Ok(()) };
        let enter = there(f.enter_step, "fmi3EnterStepMode")?;
        // SAFETY: a living instance in event mode.
        let status = unsafe { enter(self.raw) };
        self.check(status, "EnterStepMode")
    }
}
