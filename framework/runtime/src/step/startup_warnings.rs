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
        // The events of the start have already been handled. The discrete states before them show what a part waits for: a spring that is released
        // at once has a warning, and so has a motor that is lit at once.
        let mut before = d.clone();
        for part in &plan.parts {
            let (w, n) = (&part.wiring, part.lanes());
            part.prototype.initial(&mut vec![0.0; n.x], &mut before[w.d..w.d + n.d]);
        }
        let d = &before;
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
