//! The start of a run: the first state, the first evaluation, and the events and the work of tick 0.
use super::evaluate;
use super::reports::Notices;
use super::simulation::initial;
use super::simulation::{Simulation, Work};
use super::state::{GuardState, State};
use super::stopped::Stopped;
use crate::author::block::Evaluation;
use crate::plan::compiled::blocks_of;
use crate::plan::compiled::{Fires, Plan};
use crate::plan::program::Program;
use std::sync::Arc;

impl Simulation {
    /// Creates a run of one plan at time zero, after the work of tick 0. If this work fails, [`Simulation::check`] and the first step return the
    /// error.
    pub fn new(plan: Arc<Plan>) -> Self {
        Self::of(Arc::new(Program::single(plan)))
    }

    /// Creates a run of a program at time zero in its first phase. Guards of parts that are due at that time have fired.
    pub fn of(program: Arc<Program>) -> Self {
        let plan = program.phases[0].plan.clone();
        let (blocks, mut state, work) = (blocks_of(&plan), initial(&plan), Work::new(&plan));
        state.entered = vec![f64::INFINITY; program.phases.len()];
        state.entered[0] = 0.0;
        let (moved, broken) = (Vec::new(), None);
        let (profile, interrupt) = (None, None);
        let notices = Notices::default();
        let observed = None;
        #[rustfmt::skip]
        let mut sim = Simulation {
            program, plan, state, blocks, work, moved, notices, broken, profile, observed, interrupt,
        };
        match sim.first_row() {
            Ok(()) => sim.judge(),
            Err(stopped) => sim.broken = Some(Box::new(sim.stopped(stopped))),
        }
        sim
    }

    /// Fires the guards of parts that are due at the start, so that the first row includes their effects; returns whether
    /// there were any. Transitions and watched conditions stay due.
    fn first_events(&mut self) -> Result<bool, Stopped> {
        let plan = self.plan.clone();
        let mut any = false;
        while let Some(k) = self.state.guards.iter().position(GuardState::is_due)
            && matches!(plan.guards[k].fires, Fires::Part { .. })
        {
            self.fire()?;
            any = true;
        }
        Ok(any)
    }

    /// Evaluates all operations in order, handles the events that are due at the start, then does the updates that are due at tick 0 and evaluates
    /// the results again.
    fn first_row(&mut self) -> Result<(), Stopped> {
        let plan = self.plan.clone();
        self.replaced();
        let now = self.next(Evaluation::Tick);
        let State { x, d, sig, .. } = &mut self.state;
        let all: Vec<u32> = (0..plan.ops.len() as u32).collect();
        let unseen = (&[][..], &mut [][..]);
        evaluate::run_all_now(&mut self.blocks, &plan, &all, &now, (x, d, sig), None, unseen)?;
        self.rearrange(&plan, now)?;
        self.arm()?;
        let fired = self.first_events();
        if let Ok(true) = fired {
            let now = self.next(Evaluation::Tick);
            let State { x, d, sig, guards, .. } = &mut self.state;
            let lanes = (&x[..], &mut d[..], &mut sig[..]);
            let guards = (&guards[..], &mut self.work.middle[..]);
            evaluate::run_all_now(&mut self.blocks, &plan, &all, &now, lanes, None, guards)?;
        }
        let now = self.next(Evaluation::Tick);
        self.updates(&plan, &now)?;
        self.look(&plan)?;
        // An event that stops the run stays due. The state is complete, so that a caller can change
        // it and continue.
        fired.and_then(|_| self.first_events()).map(|_| ())
    }
}
