//! A co-simulation unit as a sampled part: its rate is the communication step.
//!
//! ```text
//! at tick k:   outputs = outputs at t_k (all from state: a unit's outputs never have feedthrough)
//!              inputs at t_k → the unit → doStep(t_k, h) → outputs at t_k+1
//! ```
//! Inputs are held over a step, and outputs are known at its end, so the coupling error is of first order in h. Units of 3.0 with event mode stop at
//! their own events inside the step and receive discrete inputs in event mode.
use crate::kind::Kind;
use crate::part::{Live, Part, Saved, describe, outputs};
use crate::start::UnitParams;
use linkwork_runtime::{
    Block, Description, EvalTime, Failure, Fault, Files, Foreign, Located, Origin, Outcome,
    Prototype, ReadCx, Value, Wiring,
};
use std::any::Any;
use std::cell::RefCell;
use std::sync::Arc;

const MODEL: (&str, &str) = (
    "fmi.co_simulation",
    "A unit of FMI 2.0 or 3.0 with its own solver; its rate is the communication step.",
);

/// `fmi.co_simulation`.
pub struct CoSimulation;

impl Foreign for CoSimulation {
    const NAME: &'static str = MODEL.0;
    const DOC: &'static str = MODEL.1;
    type Params = UnitParams;
    fn describe(p: &UnitParams, files: &Files) -> Option<Description> {
        describe(p, files, Kind::CoSimulation, MODEL).ok()
    }
    fn make(p: UnitParams, written: &Located, cx: &mut ReadCx<'_>) -> Option<Box<dyn Prototype>> {
        let part = Part::make(&p, written, cx, Kind::CoSimulation, MODEL)?;
        // A unit that cannot be initialized is reported here, not in the first step.
        match part.begin(0.0) {
            Ok(_) => Some(Box::new(Unit { part })),
            Err(failure) => {
                let Failure { message, help } = *failure;
                let message = format!("`{}`: {message}", cx.path);
                cx.fault(written.get("file").unwrap_or(written).origin, message, help);
                None
            }
        }
    }
}

struct Unit {
    part: Arc<Part>,
}

impl Prototype for Unit {
    fn description(&self) -> &Description {
        &self.part.description
    }
    fn params(&self) -> &Value {
        &self.part.params
    }
    fn initial(&self, _: &mut [f64], _: &mut [f64]) {}
    fn stored(&self) -> bool {
        true
    }
    fn can_save(&self) -> Result<(), String> {
        self.part.can_save()
    }
    fn settle(&mut self, w: &Wiring) -> Result<(), Fault> {
        let Some(h) = self.part.unit.interface.fixed_step else { return Ok(()) };
        let steps = w.period_s / h;
        if (steps - steps.round()).abs() <= 1e-9 * steps && steps.round() >= 1.0 {
            return Ok(());
        }
        let message = format!(
            "`{}`: its communication step {} s is not a multiple of the unit's own step {h} s",
            self.part.path, w.period_s
        );
        Err(Fault::new(Origin::NONE, message).help(format!("write a rate such as \"{h} s\"")))
    }
    fn block(&self, w: Wiring) -> Box<dyn Block> {
        let u = Vec::with_capacity(w.u.len());
        Box::new(Stepping { live: RefCell::new(Live::new(self.part.clone())), w, u })
    }
}

struct Stepping {
    /// In a cell, because saving the state of a unit needs a mutable call.
    live: RefCell<Live>,
    w: Wiring,
    u: Vec<f64>,
}

impl Block for Stepping {
    fn outputs(&mut self, now: &EvalTime, _: &[f64], _: &[f64], sig: &mut [f64]) -> Outcome {
        let ym = self.w.ym;
        self.live.get_mut().with(now.t, |_, saved, _| {
            sig[ym..ym + saved.outputs.len()].copy_from_slice(&saved.outputs);
            Ok(())
        })
    }
    fn feedthrough(&mut self, _: &EvalTime, _: &[f64], _: &[f64], _: &mut [f64]) -> Outcome {
        Ok(())
    }
    fn derivatives(
        &mut self,
        _: &EvalTime,
        _: &[f64],
        _: &[f64],
        _: &[f64],
        _: &mut [f64],
    ) -> Outcome {
        Ok(())
    }
    fn update(&mut self, now: &EvalTime, _: &[f64], _: &mut [f64], sig: &[f64]) -> Outcome {
        self.u.clear();
        self.u.extend(self.w.u.iter().map(|lane| sig[*lane as usize]));
        let (u, h) = (&self.u, self.w.period_s);
        self.live.get_mut().with(now.t, |instance, saved, part| {
            let mut u = &u[..];
            let inputs = &part.ports.inputs[0];
            let event = instance.steps_with_events() && inputs.iter().any(|slot| slot.discrete);
            if event {
                instance.enter_event()?;
            }
            for slot in inputs {
                let (own, rest) = u.split_at(slot.size);
                instance.set(slot, own)?;
                u = rest;
            }
            let began = saved.began.unwrap_or(now.t);
            let Saved { ticks, outputs: out, .. } = saved;
            if event {
                part.clocks.settle(instance, ticks, now.t)?;
                instance.enter_step()?;
            }
            part.clocks.step(instance, ticks, (now.t, h), began)?;
            outputs(instance, part, ticks, out)
        })
    }
    fn save_store(&self) -> Result<Vec<u8>, String> {
        self.live.borrow_mut().save()
    }
    fn load_store(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.live.get_mut().load(bytes)
    }
    fn copy_store(&self, into: &mut Option<Box<dyn Any + Send>>) {
        self.live.borrow_mut().copy(into);
    }
    fn take_store(&mut self, from: &dyn Any) {
        self.live.get_mut().take_copy(from);
    }
    fn fork(&self) -> Box<dyn Block> {
        Box::new(Stepping {
            live: RefCell::new(self.live.borrow_mut().fork()),
            w: self.w.clone(),
            u: self.u.clone(),
        })
    }
}
