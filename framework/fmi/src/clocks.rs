//! Clocks of a unit of FMI 3.0: time-based input clocks are activated at their ticks, ticks of triggered output clocks are counted.
//!
//! ```text
//! periodic    ticks at t_start + shift + k interval
//! countdown   ticks when the time that the unit states in an event has passed
//! event       clocks that are due → SetClock;  until no pass is needed: GetClock of the output clocks, UpdateDiscreteStates;  GetIntervalDecimal
//! ```
//! A tick is a time event: it ends a step of the integrator, or of the unit's own solver, which needs event mode.
use crate::instance::{Instance, Result};
use crate::kind::Kind;
use linkwork_formats::fmi::{Causality, FmiClock, FmiVariable, ModelDescription};
use linkwork_runtime::Failure;
use serde::{Deserialize, Serialize};

/// Largest number of passes of one event.
const PASSES_MAX: usize = 1000;

/// Ticks that are nearer to an instant than this (s) belong to it: events are located to within 1 ps.
const NEAR: f64 = 1e-9;

/// The clocks that are driven and counted.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clocks {
    /// Reference, interval and shift of periodic input clocks.
    periodic: Vec<(u32, f64, f64)>,
    /// References of countdown input clocks.
    countdown: Vec<u32>,
    /// References of triggered output clocks.
    triggered: Vec<u32>,
}

/// The state of the clocks.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Ticks {
    /// Number of ticks of each periodic clock.
    made: Vec<u64>,
    /// Time of the next tick of each countdown clock, s.
    due: Vec<Option<f64>>,
    /// Number of ticks of each output clock.
    pub counts: Vec<f64>,
}

/// Returns whether the clocks of a unit can tick: model exchange, and co-simulation with event mode.
pub(crate) fn possible(d: &ModelDescription, kind: Kind) -> bool {
    kind == Kind::ModelExchange || d.co_simulation.as_ref().is_some_and(|i| i.event_mode)
}

/// Returns whether a variable is a clock that is driven, or counted at a port.
pub(crate) fn is_served(v: &FmiVariable) -> bool {
    matches!(
        (v.causality, v.clock),
        (Causality::Input, Some(FmiClock::Periodic { .. } | FmiClock::Countdown))
            | (Causality::Output, Some(FmiClock::Triggered))
    )
}

impl Clocks {
    pub fn of(d: &ModelDescription, kind: Kind) -> Clocks {
        let mut out = Clocks::default();
        if !possible(d, kind) {
            return out;
        }
        for v in d.variables.iter().filter(|v| is_served(v)) {
            match v.clock {
                Some(FmiClock::Periodic { interval, shift }) => {
                    out.periodic.push((v.reference, interval, shift));
                }
                Some(FmiClock::Countdown) => out.countdown.push(v.reference),
                _ => out.triggered.push(v.reference),
            }
        }
        out
    }

    /// Returns the number of output clocks, which have a port each.
    pub fn outputs(&self) -> usize {
        self.triggered.len()
    }

    /// Returns the state at the start of an instance.
    pub fn start(&self) -> Ticks {
        Ticks {
            made: vec![0; self.periodic.len()],
            due: vec![None; self.countdown.len()],
            counts: vec![0.0; self.triggered.len()],
        }
    }

    /// Returns the time of the next tick (s) of an instance that began at `began`.
    pub fn next(&self, ticks: &Ticks, began: f64) -> Option<f64> {
        let of = |((_, interval, shift), made): (&(u32, f64, f64), &u64)| {
            began + shift + *made as f64 * interval
        };
        let periodic = self.periodic.iter().zip(&ticks.made).map(of);
        periodic.chain(ticks.due.iter().flatten().copied()).min_by(f64::total_cmp)
    }

    /// Activates the clocks that are due at `t`, in event mode.
    pub fn activate(
        &self,
        instance: &mut Instance,
        ticks: &mut Ticks,
        (t, began): (f64, f64),
    ) -> Result<()> {
        for ((clock, interval, shift), made) in self.periodic.iter().zip(&mut ticks.made) {
            if began + shift + *made as f64 * interval <= t + NEAR {
                instance.activate(*clock)?;
                *made += 1;
            }
        }
        for (clock, due) in self.countdown.iter().zip(&mut ticks.due) {
            if due.is_some_and(|due| due <= t + NEAR) {
                *due = None;
                instance.activate(*clock)?;
            }
        }
        Ok(())
    }

    /// Makes the passes of an event at `t`; returns the time of the next time event of the unit.
    pub fn settle(
        &self,
        instance: &mut Instance,
        ticks: &mut Ticks,
        t: f64,
    ) -> Result<Option<f64>> {
        for _ in 0..PASSES_MAX {
            for (clock, count) in self.triggered.iter().zip(&mut ticks.counts) {
                *count += f64::from(u8::from(instance.ticks(*clock)?));
            }
            let pass = instance.discrete_states()?;
            if pass.needed {
                continue;
            }
            for (clock, due) in self.countdown.iter().zip(&mut ticks.due) {
                if let Some(interval) = instance.countdown(*clock)? {
                    *due = Some(t + interval);
                }
            }
            return Ok(pass.next);
        }
        Err(Box::new(Failure {
            message: format!("an event of the unit has not ended after {PASSES_MAX} passes"),
            help: Some("the unit requests another pass each time: contact its vendor".into()),
        }))
    }
}

/// Returns the earlier of two times.
pub(crate) fn earlier(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.into_iter().chain(b).min_by(f64::total_cmp)
}

impl Clocks {
    /// Advances a co-simulation unit with event mode from `t` by `h` (s), with events at the ticks of its clocks. Ticks at the end of the step belong
    /// to this step.
    pub fn step(
        &self,
        instance: &mut Instance,
        ticks: &mut Ticks,
        (t, h): (f64, f64),
        began: f64,
    ) -> Result<()> {
        let (end, mut now) = (t + h, t);
        loop {
            let tick = self.next(ticks, began).filter(|next| *next <= end + NEAR);
            let to = tick.map_or(end, |next| next.clamp(now, end));
            // A tick at the end of the step must not leave a rest of round-off.
            let to = if end - to <= NEAR { end } else { to };
            if to > now {
                let step = if now == t && to == end { h } else { to - now };
                instance.step(now, step, |i, at| self.settle(i, ticks, at).map(drop))?;
            }
            now = to;
            if tick.is_some() {
                instance.enter_event()?;
                self.activate(instance, ticks, (now, began))?;
                self.settle(instance, ticks, now)?;
                instance.enter_step()?;
            } else if now >= end {
                return Ok(());
            }
        }
    }
}
