//! Reports of parts and services during a run. A setting that is allowed but probably not intended is reported once, and the run continues. A fault
//! that stops the run becomes its error, with the same message: at a guard before `handle_event`, at the start of a run or phase before a step.
use super::reports::Notice;
use super::simulation::{RunError, Simulation};
use super::stopped::Stopped;
use crate::author::block::{Evaluation, Failure};
use crate::author::error::BuildError;
use crate::author::model::Fired;
use crate::author::value::Fault;
use crate::plan::compiled::Plan;
use linkwork_spatial::Vec3;

impl Simulation {
    /// Returns the reports since the last call: a parachute that is commanded twice, air that is evaluated beyond its table.
    /// At most 256 are kept. A fork, and a run that is restored from a checkpoint, may repeat reports that were already made.
    pub fn take_notices(&mut self) -> Vec<Notice> {
        std::mem::take(&mut self.notices.kept)
    }

    /// Collects the warning of a part about the guard that is due, before it fires.
    ///
    /// # Errors
    /// The warning stops the run.
    pub(super) fn hear(
        &mut self,
        plan: &Plan,
        name: &str,
        block: u32,
        which: Fired<'_>,
    ) -> Result<(), Stopped> {
        let now = self.next(Evaluation::Tick);
        let (x, d, sig) = (&self.state.x, &self.state.d, &self.state.sig);
        if let Some(told) = self.blocks[block as usize].runtime_warning(&now, which, x, d, sig) {
            if told.stops {
                return Err(stop(block, told));
            }
            if self.notices.told.contains(name) {
                return Ok(());
            }
            let part = &plan.parts[block as usize];
            let message = format!("`{}`: {}", part.path, told.message);
            let fault = Fault { message, origin: part.origin, help: told.help };
            self.notices.add(name, now.t, fault);
        }
        Ok(())
    }

    /// Collects the warnings of the blocks that have their own step method.
    #[inline]
    pub(super) fn hear_steps(&mut self, plan: &Plan) {
        for &k in &plan.steps {
            if let Some(told) = self.blocks[k as usize].warns() {
                self.keep_warning(plan, k, told);
            }
        }
    }

    #[cold]
    fn keep_warning(&mut self, plan: &Plan, block: u32, told: BuildError) {
        let (t, part) = (self.time(), &plan.parts[block as usize]);
        let message = format!("`{}`: {}", part.path, told.message);
        let fault = Fault { message, origin: part.origin, help: told.help };
        self.notices.add(&part.path, t, fault);
    }

    /// Asks all parts whether a run can begin at this state or continue from it; if not, every step returns the error until the state is replaced.
    /// Parts that existed before are asked, too, so that a checkpoint of this state gives the same result.
    pub(crate) fn judge(&mut self) {
        self.broken = None;
        let (plan, now) = (self.plan.clone(), self.next(Evaluation::Tick));
        let (x, d, sig) = (&self.state.x, &self.state.d, &self.state.sig);
        let rests = |k: u32| plan.rest.as_ref().is_some_and(|rest| rest.parts.contains(&k));
        for (k, block) in (0u32..).zip(&mut self.blocks).filter(|(k, _)| !rests(*k)) {
            let mut remarks = block.startup_warnings(&now, x, d, sig).into_iter();
            if let Some(told) = remarks.find(|remark| remark.stops) {
                self.broken = Some(Box::new(self.stopped(stop(k, told))));
                return;
            }
        }
    }

    /// Collects the warnings of parts that a phase has added about their start.
    pub(super) fn hear_new(&mut self, plan: &Plan, new: &[String]) {
        let now = self.next(Evaluation::Tick);
        let (x, d, sig) = (&self.state.x, &self.state.d, &self.state.sig);
        for (part, block) in plan.parts.iter().zip(&mut self.blocks) {
            if !new.contains(&part.path) {
                continue;
            }
            for remark in block.startup_warnings(&now, x, d, sig).into_iter().filter(|r| !r.stops) {
                let message = format!("`{}`: {}", part.path, remark.message);
                let fault = Fault { message, origin: part.origin, help: remark.help };
                let name = format!("{}: {}", part.path, remark.param.unwrap_or_default());
                self.notices.add(&name, now.t, fault);
            }
        }
    }

    /// Checks at a row whether the data of services cover the positions of the parts that query them.
    ///
    /// # Errors
    /// A service stops the run because its data do not cover the position.
    pub(super) fn places(&mut self, plan: &Plan) -> Result<(), RunError> {
        for k in 0..plan.asked.len() {
            if self.work.silent[k] {
                continue;
            }
            let asked = &plan.asked[k];
            let place = Vec3::from(asked.position.map(|lane| self.state.sig[lane as usize]));
            let t = self.time();
            let Some(beyond) = asked.object.out_of_range(t, place) else { continue };
            let part = &plan.parts[asked.part as usize];
            let message =
                format!("`{}`: {}; requested by `{}`", asked.service, beyond.message, part.path);
            if beyond.stops {
                let (path, help) = (asked.service.clone(), beyond.help);
                return Err(RunError { time: t, path, message, help });
            }
            let fault = Fault { message, origin: part.origin, help: beyond.help };
            for (silent, other) in self.work.silent.iter_mut().zip(&plan.asked) {
                *silent |= other.service == asked.service;
            }
            self.notices.add(&asked.service, t, fault);
        }
        Ok(())
    }
}

/// Converts a fault of a part that stops the run.
#[cold]
fn stop(block: u32, told: BuildError) -> Stopped {
    Stopped { block, failure: Box::new(Failure { message: told.message, help: told.help }) }
}
