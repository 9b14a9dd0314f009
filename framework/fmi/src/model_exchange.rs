//! A model-exchange unit as a continuous part: its states are part of the run's state, its derivatives enter the run's integrator, and its event
//! indicators are guards.
//!
//! ```text
//! any evaluation:  time, states and continuous inputs → the unit → outputs, derivatives, indicators
//! at an event:     event mode, all inputs, passes until none is needed → states → continuous time
//! ```
//! Between two events, a part is a function of time, states and inputs, so it can be evaluated in any order and any number of times. The state that
//! the unit keeps between events is the part's store.
//!
//! The unit is informed of a completed step at each tick of the run and at each event; with an adaptive method, not of each step between two ticks.
//! Time-based clocks tick at events, at the times of the unit's clocks. Discrete inputs reach the unit at events: a change at the end of a tick, or a difference from the unit's start values, causes an event.
use crate::clocks::earlier;
use crate::instance::{Instance, Result};
use crate::kind::Kind;
use crate::part::{Live, Part, Saved, describe, get_all, outputs};
use crate::slot::Slot;
use crate::start::UnitParams;
use linkwork_runtime::{
    Block, Description, EvalTime, Evaluation, Failure, Files, Fired, Foreign, Located, Outcome,
    Prototype, ReadCx, Value, Wiring,
};
use std::any::Any;
use std::cell::RefCell;
use std::sync::Arc;

const MODEL: (&str, &str) = (
    "fmi.model_exchange",
    "A unit of FMI 2.0 or 3.0 as equations, whose states the simulation integrates.",
);

/// `fmi.model_exchange`.
pub struct ModelExchange;

impl Foreign for ModelExchange {
    const NAME: &'static str = MODEL.0;
    const DOC: &'static str = MODEL.1;
    type Params = UnitParams;
    fn describe(p: &UnitParams, files: &Files) -> Option<Description> {
        describe(p, files, Kind::ModelExchange, MODEL).ok()
    }
    fn make(p: UnitParams, written: &Located, cx: &mut ReadCx<'_>) -> Option<Box<dyn Prototype>> {
        let part = Part::make(&p, written, cx, Kind::ModelExchange, MODEL)?;
        let mut start = vec![0.0; part.ports.states.len()];
        let begun = part.begin(0.0).and_then(|(mut unit, ..)| {
            unit.states(&mut start)?;
            to_si(&part.ports.states, &mut start);
            Ok(())
        });
        match begun {
            Ok(()) => Some(Box::new(Unit { part, start })),
            Err(failure) => {
                let Failure { message, help } = *failure;
                let message = format!("`{}`: {message}", cx.path);
                cx.fault(written.get("file").unwrap_or(written).origin, message, help);
                None
            }
        }
    }
}

fn to_si(scales: &[(f64, f64)], x: &mut [f64]) {
    for (x, (factor, offset)) in x.iter_mut().zip(scales) {
        *x = factor * *x + offset;
    }
}

struct Unit {
    part: Arc<Part>,
    /// States after initialization.
    start: Vec<f64>,
}

impl Prototype for Unit {
    fn description(&self) -> &Description {
        &self.part.description
    }
    fn params(&self) -> &Value {
        &self.part.params
    }
    fn initial(&self, x: &mut [f64], _: &mut [f64]) {
        x.copy_from_slice(&self.start);
    }
    fn stored(&self) -> bool {
        true
    }
    fn can_save(&self) -> std::result::Result<(), String> {
        self.part.can_save()
    }
    fn block(&self, w: Wiring) -> Box<dyn Block> {
        let work = Work {
            x: vec![0.0; self.part.ports.states.len()],
            u: vec![0.0; self.part.ports.input_lanes()],
        };
        Box::new(Continuous { live: RefCell::new(Live::new(self.part.clone())), w, work })
    }
}

struct Continuous {
    /// In a cell, because saving the state of a unit needs a mutable call.
    live: RefCell<Live>,
    w: Wiring,
    work: Work,
}

/// Working memory.
#[derive(Clone)]
struct Work {
    /// States in the order of the unit.
    x: Vec<f64>,
    /// Inputs: those without feedthrough, then the others.
    u: Vec<f64>,
}

impl Work {
    /// Passes time and states to the unit.
    fn place(&mut self, unit: &mut Instance, part: &Part, t: f64, x: &[f64]) -> Result<()> {
        for ((own, x), (factor, offset)) in self.x.iter_mut().zip(x).zip(&part.ports.states) {
            *own = (x - offset) / factor;
        }
        unit.set_time(t)?;
        unit.set_states(&self.x)
    }

    fn gather(&mut self, w: &Wiring, sig: &[f64]) {
        for (u, lane) in self.u.iter_mut().zip(w.u.iter().chain(&w.ud)) {
            *u = sig[*lane as usize];
        }
    }
}

/// Passes inputs to the unit: the continuous ones, or all.
fn drive(unit: &mut Instance, part: &Part, mut u: &[f64], which: Which) -> Result<()> {
    let slots: [&[Slot]; 2] = [&part.ports.inputs[0], &part.ports.inputs[1]];
    for (slot, at_events) in slots.into_iter().flatten().zip(&part.ports.discrete) {
        let (own, rest) = u.split_at(slot.size);
        if which == Which::All || !at_events {
            unit.set(slot, own)?;
        }
        u = rest;
    }
    Ok(())
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Which {
    Continuous,
    All,
}

/// Returns whether a discrete input differs from the value that the unit has.
fn changed(part: &Part, u: &[f64], held: &[f64]) -> bool {
    let mut at = 0;
    let mut any = false;
    for (slot, at_events) in part.ports.inputs.iter().flatten().zip(&part.ports.discrete) {
        any |= *at_events && u[at..at + slot.size] != held[at..at + slot.size];
        at += slot.size;
    }
    any
}

impl Continuous {
    /// Passes time, states and continuous inputs to the unit, then calls `f`.
    fn at<T>(
        &mut self,
        now: &EvalTime,
        x: &[f64],
        sig: &[f64],
        f: impl FnOnce(&mut Instance, &mut Saved, &Part, &[f64]) -> Result<T>,
    ) -> Result<T> {
        let Continuous { live, w, work } = self;
        work.gather(w, sig);
        let x = if work.x.is_empty() { &[][..] } else { &x[w.x..w.x + work.x.len()] };
        live.get_mut().with(now.t, |unit, saved, part| {
            work.place(unit, part, now.t, x)?;
            drive(unit, part, &work.u, Which::Continuous)?;
            f(unit, saved, part, &work.u)
        })
    }
}

impl Block for Continuous {
    fn outputs(&mut self, now: &EvalTime, x: &[f64], _: &[f64], sig: &mut [f64]) -> Outcome {
        let Continuous { live, w, work } = self;
        let x = if work.x.is_empty() { &[][..] } else { &x[w.x..w.x + work.x.len()] };
        live.get_mut().with(now.t, |unit, saved, part| {
            // The inputs are not known yet, but these outputs do not depend on them.
            work.place(unit, part, now.t, x)?;
            outputs(unit, part, &saved.ticks, &mut sig[w.ym..w.ym + part.output_lanes()])
        })
    }
    fn feedthrough(&mut self, now: &EvalTime, x: &[f64], _: &[f64], sig: &mut [f64]) -> Outcome {
        let yd = self.w.yd;
        // Read the inputs first, because the outputs are slots of the same signal array.
        let Continuous { live, w, work } = self;
        work.gather(w, sig);
        let x = if work.x.is_empty() { &[][..] } else { &x[w.x..w.x + work.x.len()] };
        live.get_mut().with(now.t, |unit, _, part| {
            work.place(unit, part, now.t, x)?;
            let first: usize = part.ports.inputs[0].iter().map(|s| s.size).sum();
            let mut u = &work.u[first..];
            let flags = &part.ports.discrete[part.ports.inputs[0].len()..];
            for (slot, at_events) in part.ports.inputs[1].iter().zip(flags) {
                let (own, rest) = u.split_at(slot.size);
                if !at_events {
                    unit.set(slot, own)?;
                }
                u = rest;
            }
            let slots = &part.ports.outputs[1];
            let lanes: usize = slots.iter().map(|s| s.size).sum();
            get_all(unit, slots, &mut sig[yd..yd + lanes])
        })
    }
    fn derivatives(
        &mut self,
        now: &EvalTime,
        x: &[f64],
        _: &[f64],
        sig: &[f64],
        xdot: &mut [f64],
    ) -> Outcome {
        let (first, n) = (self.w.x, self.work.x.len());
        self.at(now, x, sig, |unit, _, part, _| {
            let rates = &mut xdot[first..first + n];
            unit.derivatives(rates)?;
            for (rate, (factor, _)) in rates.iter_mut().zip(&part.ports.states) {
                *rate *= factor;
            }
            Ok(())
        })
    }
    fn update(&mut self, _: &EvalTime, _: &[f64], _: &mut [f64], _: &[f64]) -> Outcome {
        Ok(())
    }
    fn guards(
        &mut self,
        now: &EvalTime,
        x: &[f64],
        _: &[f64],
        sig: &[f64],
        values: &mut [f64],
    ) -> Outcome {
        self.at(now, x, sig, |unit, saved, part, u| {
            let n = part.ports.indicators;
            unit.indicators(&mut values[..n])?;
            // A tick or event follows a complete step, so report the completed step to the unit.
            if now.evaluation == Evaluation::Tick && !saved.asks {
                let told = saved.completed.is_some_and(|t| t >= now.t);
                if part.unit.interface.completed_step && !told {
                    saved.asks |= unit.completed_step()?;
                    saved.completed = Some(now.t);
                }
                saved.asks |= changed(part, u, &saved.held);
            }
            values[n] = saved.next_event.map_or(-1.0, |next| now.t - next);
            values[n + 1] = if saved.asks { 1.0 } else { -1.0 };
            Ok(())
        })
    }
    fn handle_event(
        &mut self,
        now: &EvalTime,
        _: Fired<'_>,
        x: &mut [f64],
        _: &mut [f64],
        sig: &[f64],
    ) -> Outcome {
        let (first, n) = (self.w.x, self.work.x.len());
        let mut next = vec![0.0; n];
        self.at(now, x, sig, |unit, saved, part, u| {
            unit.enter_event()?;
            let began = saved.began.unwrap_or(now.t);
            part.clocks.activate(unit, &mut saved.ticks, (now.t, began))?;
            drive(unit, part, u, Which::All)?;
            saved.held.copy_from_slice(u);
            let own = part.clocks.settle(unit, &mut saved.ticks, now.t)?;
            saved.next_event = earlier(own, part.clocks.next(&saved.ticks, began));
            unit.enter_continuous()?;
            (saved.asks, saved.completed) = (false, Some(now.t));
            unit.states(&mut next)?;
            to_si(&part.ports.states, &mut next);
            Ok(())
        })?;
        if n > 0 {
            x[first..first + n].copy_from_slice(&next);
        }
        Ok(())
    }
    fn save_store(&self) -> std::result::Result<Vec<u8>, String> {
        self.live.borrow_mut().save()
    }
    fn load_store(&mut self, bytes: &[u8]) -> std::result::Result<(), String> {
        self.live.get_mut().load(bytes)
    }
    fn copy_store(&self, into: &mut Option<Box<dyn Any + Send>>) {
        self.live.borrow_mut().copy(into);
    }
    fn take_store(&mut self, from: &dyn Any) {
        self.live.get_mut().take_copy(from);
    }
    fn fork(&self) -> Box<dyn Block> {
        let live = RefCell::new(self.live.borrow_mut().fork());
        Box::new(Continuous { live, w: self.w.clone(), work: self.work.clone() })
    }
}
