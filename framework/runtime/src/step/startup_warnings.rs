//! Warnings of parts about the start of a run.
use super::simulation::Simulation;
use super::state::State;
use crate::author::block::Evaluation;
use crate::author::value::Fault;

impl Simulation {
    /// Returns the warnings of all parts about the start, in path order: for example of a wheel that begins inside the ground, or of
    /// a hinge that does not begin at its prescribed motion. Call it before the first step. [`Simulation::check`] returns errors
    /// that reject the start.
    pub fn startup_warnings(&mut self) -> Vec<Fault> {
        let plan = self.plan.clone();
        let now = self.next(Evaluation::Tick);
        let State { x, d, sig, .. } = &self.state;
        let mut all = Vec::new();
        // Parts of a machine that was brought to rest before the start give no warnings.
        let rests = |k: u32| plan.rest.as_ref().is_some_and(|rest| rest.parts.contains(&k));
        for ((k, part), block) in (0..).zip(&plan.parts).zip(&mut self.blocks) {
            if rests(k) {
                continue;
            }
            for remark in block.startup_warnings(&now, x, d, sig).into_iter().filter(|r| !r.stops) {
                let message = format!("`{}`: {}", part.path, remark.message);
                all.push(Fault { message, origin: part.origin, help: remark.help });
            }
        }
        all
    }
}
