//! Transitions between plans: state is carried over by path. Parts of both plans continue; parts of only the new plan start from their initial state;
//! the mechanism keeps poses and velocities.
use super::evaluate;
use super::pins;
use super::reports::MoveReport;
use super::simulation::{RunError, Simulation, Work, initial, show};
use super::state::{GuardState, State};
use super::stopped::Stopped;
use crate::author::block::{Carried, EvalTime, Evaluation, Failure, OldState};
use crate::plan::compiled::{Fires, GuardPlan, Op, Plan};
use crate::plan::program::Program;
use crate::plan::route::Route;
use std::sync::Arc;

/// Maximum number of kept transition reports.
const MOVES_KEPT: usize = 256;

impl Simulation {
    /// Moves the run to another plan, at this instant. The program is then that plan alone.
    ///
    /// # Errors
    /// Returns an error if the state of a part cannot be carried over; the run is then unchanged.
    pub fn move_to(&mut self, plan: Arc<Plan>) -> Result<MoveReport, RunError> {
        self.go_over_to(Arc::new(Program::single(plan)), 0)
    }

    /// Moves the run to the phase of the same name in another program, at this instant. If all parts are carried over and none is new, the state
    /// continues without a jump, and the integrator continues with its proposed step size.
    ///
    /// # Errors
    /// Returns an error if there is no phase of that name or the state of a part cannot be carried over; the run is then unchanged.
    pub fn move_to_program(&mut self, program: Arc<Program>) -> Result<MoveReport, RunError> {
        let name = self.phase();
        let Some(phase) = program.phases.iter().position(|p| p.name == name) else {
            let known: Vec<&str> = program.phases.iter().map(|p| p.name.as_str()).collect();
            return Err(RunError {
                time: self.time(),
                path: name.to_string(),
                message: format!(
                    "it is in phase `{name}`, which the other simulation does not have"
                ),
                help: Some(format!("the other has {}", known.join(", "))),
            });
        };
        let memory = self.state.memory;
        let report = self.go_over_to(program, phase as u32)?;
        if report.new.is_empty() && report.dropped.is_empty() {
            self.state.memory = memory;
        }
        Ok(report)
    }

    fn go_over_to(&mut self, program: Arc<Program>, phase: u32) -> Result<MoveReport, RunError> {
        let plan = program.phases[phase as usize].plan.clone();
        let route = Route::new(&self.plan, &plan);
        // Start times of phases are carried over by name, because indices may differ between programs.
        let begun = |name: &str| {
            let k = self.program.phases.iter().position(|old| old.name == name);
            k.and_then(|k| self.state.entered.get(k)).copied().unwrap_or(f64::INFINITY)
        };
        let mut entered: Vec<f64> = program.phases.iter().map(|p| begun(&p.name)).collect();
        if program.phases[phase as usize].name != self.phase() {
            entered[phase as usize] = self.time();
        }
        let report = self.go_over(&plan, (phase, entered), &route);
        let report = report.map_err(|stopped| self.stopped(stopped))?;
        self.program = program;
        Ok(report)
    }

    /// Moves the run to another phase of its program.
    pub(super) fn transition(&mut self, to: u32, why: &str) -> Result<(), Stopped> {
        let plan = self.program.phases[to as usize].plan.clone();
        let from = self.phase().to_string();
        let program = self.program.clone();
        let mut entered = self.state.entered.clone();
        entered[to as usize] = self.time();
        let into = (to, entered);
        let report = match program.routes.get(&(self.state.phase, to)) {
            Some(route) => self.go_over(&plan, into, route)?,
            None => self.go_over(&plan, into, &Route::new(&self.plan, &plan))?,
        };
        self.hear_new(&plan, &report.new);
        // Discard the oldest reports, because they may never be queried.
        if self.moved.len() >= MOVES_KEPT {
            self.moved.remove(0);
        }
        self.moved.push((self.time(), format!("`{from}` → `{}`: {why}", self.phase()), report));
        Ok(())
    }

    fn go_over(
        &mut self,
        plan: &Arc<Plan>,
        (phase, entered): (u32, Vec<f64>),
        route: &Route,
    ) -> Result<MoveReport, Stopped> {
        let mut report = MoveReport::default();
        let mut state = State { phase, entered, micro: self.state.micro, ..initial(plan) };
        place_in_time(&self.state, &self.plan, &mut state, plan);
        let mut blocks = self.new_blocks(plan);
        let mut whole = vec![false; plan.parts.len()];
        for (k, part) in plan.parts.iter().enumerate() {
            let Some(j) = route.parts[k].map(|j| j as usize) else {
                report.new.push(part.path.clone());
                continue;
            };
            match self.carry(plan, k, j, &mut state)? {
                Carried::New => report.new.push(part.path.clone()),
                Carried::Whole => {
                    if let (true, Err(why)) = (part.prototype.stored(), part.prototype.can_save()) {
                        let help =
                            "keep it in one phase only, or use a unit that can save its state";
                        let message =
                            format!("its state cannot be transferred to another plan: {why}");
                        let failure = Box::new(Failure { message, help: Some(help.into()) });
                        return Err(Stopped { block: j as u32, failure });
                    }
                    let mut slot = None;
                    self.blocks[j].copy_store(&mut slot);
                    if let Some(store) = slot {
                        blocks[k].take_store(&*store);
                    }
                    whole[k] = true;
                    report.kept.push(part.path.clone());
                }
                Carried::State(notes) => {
                    whole[k] = true;
                    report.kept.push(part.path.clone());
                    report.notes.extend(notes);
                }
            }
        }
        let gone = route.gone.iter().map(|j| self.plan.parts[*j as usize].path.clone());
        report.dropped = gone.collect();
        for (k, j) in &route.signals {
            state.sig[*k as usize] = self.state.sig[*j as usize];
        }
        if let Some(old) = &self.state.pins {
            (state.pins, report.unpinned) = pins::find(plan, old.values());
        }
        self.begin(plan, state, blocks, (&whole, route))?;
        self.judge();
        Ok(report)
    }

    /// Carries over the state of one part.
    fn carry(
        &self,
        plan: &Plan,
        k: usize,
        j: usize,
        state: &mut State,
    ) -> Result<Carried, Stopped> {
        let (new, old) = (&plan.parts[k], &self.plan.parts[j]);
        let (w, n, v, m) = (&new.wiring, new.lanes(), &old.wiring, old.lanes());
        let State { x, d, sig, .. } = &self.state;
        let from = OldState { x: &x[v.x..v.x + m.x], d: &d[v.d..v.d + m.d], sig };
        let to = (&mut state.x[w.x..w.x + n.x], &mut state.d[w.d..w.d + n.d]);
        new.prototype
            .carry(&*old.prototype, from, to)
            .map_err(|failure| Stopped { block: j as u32, failure })
    }

    /// Adopts the new plan and evaluates new and continuous parts at this instant.
    fn begin(
        &mut self,
        plan: &Arc<Plan>,
        mut state: State,
        mut blocks: Vec<Box<dyn crate::author::block::Block>>,
        (whole, route): (&[bool], &Route),
    ) -> Result<(), Stopped> {
        let mut work = Work::new(plan);
        work.number = self.work.number + 1;
        let now = EvalTime {
            t: plan.base.times(state.tick) + state.since,
            dt: plan.step.seconds(),
            tick: state.tick,
            evaluation: Evaluation::Tick,
            span: None,
            number: work.number,
        };
        plan.fields.iter().for_each(|field| show(&mut blocks, field));
        let mut due = vec![false; plan.ops.len()];
        plan.continuous_ops.iter().for_each(|&k| due[k as usize] = true);
        let (at_tick, tick) = (state.since == 0.0, state.tick);
        let State { x, d, sig, pins, .. } = &mut state;
        let pins = pins.as_deref();
        if let Some(pins) = pins {
            pins.hold(x, d, sig);
        }
        let (x, d, sig) = (&x[..], &mut d[..], &mut sig[..]);
        let unseen = || (&[][..], &mut [][..]);
        for (k, (op, due)) in (0..).zip(plan.ops.iter().zip(due)) {
            let fresh = match op {
                Op::Outputs(k) | Op::Feedthrough(k) => !whole[*k as usize],
                Op::Sum(_) | Op::Loop(_) => true,
            };
            if due || fresh {
                let lanes = (x, &mut *d, &mut *sig);
                evaluate::run_all_now(&mut blocks, plan, &[k], &now, lanes, pins, unseen())?;
            }
        }
        // Update new sampled parts that are due at this tick.
        for (k, part) in plan.parts.iter().enumerate() {
            let w = &part.wiring;
            let due = w.period > 0 && at_tick && tick % w.period == w.offset;
            let field = plan.fields.iter().any(|f| f.block as usize == k);
            if due && !field && !whole[k] && part.prototype.description().functions.update {
                let outcome = blocks[k].update(&now, x, d, sig);
                outcome.map_err(|failure| Stopped { block: k as u32, failure })?;
            }
        }
        // Update new fields after the parts, as at a row.
        let mut changed = false;
        for field in &plan.fields {
            let (k, w) = (field.block as usize, &plan.parts[field.block as usize].wiring);
            if at_tick && !whole[k] && w.period > 0 && tick % w.period == w.offset {
                field.readers.iter().for_each(|&r| blocks[r as usize].see(None));
                let outcome = blocks[k].update(&now, x, d, sig);
                show(&mut blocks, field);
                outcome.map_err(|failure| Stopped { block: field.block, failure })?;
                changed = true;
            }
        }
        if let Some(pins) = pins {
            pins.discrete(d);
        }
        if changed {
            let ops = &plan.continuous_ops;
            evaluate::run_all_now(&mut blocks, plan, ops, &now, (x, d, sig), pins, unseen())?;
        }
        // A newly started part has new guards, even if another part had its path before.
        let goes_on = |guard: &GuardPlan| match guard.fires {
            Fires::Part { block, .. } => whole[block as usize],
            Fires::Transition { .. } | Fires::Watch { .. } => true,
        };
        let old: Vec<Option<GuardState>> = (route.guards.iter().zip(&plan.guards))
            .map(|(old, guard)| old.filter(|_| goes_on(guard)))
            .map(|old| old.map(|j| self.state.guards[j as usize]))
            .collect();
        (self.plan, self.state, self.blocks, self.work) = (plan.clone(), state, blocks, work);
        self.arm()?;
        for ((new, old), guard) in self.state.guards.iter_mut().zip(old).zip(&plan.guards) {
            // Guards of a continuing part: due events stay due, unless the threshold differs in the new plan; a guard that is already beyond its
            // threshold in the new plan is due.
            if let Some(old) = old {
                (new.side, new.due, new.slack) = (old.side, old.due, old.slack);
                new.see_now(new.value, guard);
            }
        }
        Ok(())
    }
}

/// Converts the current instant to ticks of another plan: its last row and the time since.
fn place_in_time(old: &State, from: &Plan, new: &mut State, to: &Plan) {
    // Use integers, so that t = tick · base is exact.
    let (a, b) = (from.base, to.base);
    let num = u128::from(old.tick) * u128::from(a.num) * u128::from(b.den);
    let den = u128::from(a.den) * u128::from(b.num);
    let ticks = (num / den) as u64;
    let rest = (num % den) as f64 / den as f64 * b.seconds() + old.since;
    let hyper: u64 = to.table.iter().map(|r| r.gap).sum();
    let first = to.table.first().map_or(0, |r| r.at);
    let in_table = |tick: u64| tick.saturating_sub(first) % hyper.max(1) + first;
    let at = in_table(ticks);
    let row = to.table.partition_point(|r| r.at <= at).saturating_sub(1);
    new.row = row as u32;
    new.tick = ticks - (at - to.table[row].at);
    new.since = rest + b.times(ticks - new.tick);
    // Skip rows of the new plan between the tick and the current time.
    while new.since > 0.0 && new.since >= to.base.times(to.table[new.row as usize].gap) {
        let gap = to.table[new.row as usize].gap;
        new.since -= to.base.times(gap);
        new.tick += gap;
        new.row = (new.row + 1) % to.table.len() as u32;
    }
}
