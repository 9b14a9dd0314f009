//! What parts find allowed and probably not meant, once a run stands at its start.
use super::{Simulation, State};
use crate::block::Evaluation;
use crate::value::Fault;

impl Simulation {
    /// Remarks of all parts on the present instant, in path order: a wheel that starts in the ground, a
    /// hinge beside the motion that is prescribed for it. Asked before the first step of a run. What stops it there is told by
    /// [`Simulation::check`].
    pub fn remarks(&mut self) -> Vec<Fault> {
        let plan = self.plan.clone();
        let now = self.next(Evaluation::Tick);
        let State { x, d, sig, .. } = &self.state;
        let mut all = Vec::new();
        // What has come to rest with its machine starts as it is meant.
        let rests = |k: u32| plan.rest.as_ref().is_some_and(|rest| rest.parts.contains(&k));
        for ((k, part), block) in (0..).zip(&plan.parts).zip(&mut self.blocks) {
            if rests(k) {
                continue;
            }
            for remark in block.remarks(&now, x, d, sig).into_iter().filter(|r| !r.stops) {
                let message = format!("`{}`: {}", part.path, remark.message);
                all.push(Fault { message, origin: part.origin, help: remark.help });
            }
        }
        all
    }
}
