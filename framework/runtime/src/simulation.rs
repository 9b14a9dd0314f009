//! A run: the state, and the step that advances it.
//!
//! ```text
//! at tick k:    operations due, in one topological order → updates due (all see the same signals)
//! to tick k+1:  integrate; each stage evaluates the continuous operations and the mechanism
//! ```
//! Between calls the state is always "after the work of a tick", so chunking leaves no trace.
use crate::block::{Block, Evaluation, Now};
use crate::plan::{Op, Place, Plan, Role, Variable};
use crate::spec::Integrator;
use crate::time::Seconds;
use crate::value::remedy;
use linkwork_solvers::{Rk4, add};
use std::sync::Arc;

/// A state that left the numbers a simulation may hold.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "t = {time} s: `{path}` became {value}{}{}",
    if *.others > 0 { format!(" ({others} more variables are bad)") } else { String::new() },
    .why.as_ref().map_or_else(String::new, |why| format!("\n  {why}"))
)]
pub struct RunError {
    /// Simulated time (s).
    pub time: f64,
    /// The first bad variable in path order among states, else among signals.
    pub path: String,
    /// Its value.
    pub value: f64,
    /// How many other variables are bad.
    pub others: usize,
    /// What the mechanism says of it.
    pub why: Option<String>,
}

/// A variable cannot be read or set.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{message}\n  help: {help}")]
pub struct VariableError {
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub help: String,
}

/// Beyond this magnitude a continuous state is a runaway.
const RUNAWAY: f64 = 1e15;

/// All that changes in a run, but for the models' stores.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Tick of the common base.
    pub tick: u64,
    /// Row of the table whose work was done last.
    pub row: u32,
    /// Continuous lanes.
    pub x: Vec<f64>,
    /// Discrete lanes.
    pub d: Vec<f64>,
    /// Signal lanes (sampled outputs are held here).
    pub sig: Vec<f64>,
}

/// A run of a plan.
pub struct Simulation {
    plan: Arc<Plan>,
    pub(crate) state: State,
    pub(crate) blocks: Vec<Box<dyn Block>>,
    xdot: Vec<f64>,
    rk4: Rk4,
}

impl Simulation {
    /// At time zero, with the work of tick 0 done.
    pub fn new(plan: Arc<Plan>) -> Self {
        let mut blocks: Vec<Box<dyn Block>> =
            plan.parts.iter().map(|p| p.prototype.block(p.wiring.clone())).collect();
        blocks.extend(plan.mechanism.as_ref().map(|m| m.block()));
        let n = plan.sizes.x;
        let mut state = State {
            tick: plan.table.first().map_or(0, |r| r.at),
            row: 0,
            x: vec![0.0; n],
            d: vec![0.0; plan.sizes.d],
            sig: vec![0.0; plan.sizes.sig],
        };
        for part in &plan.parts {
            let w = &part.wiring;
            part.prototype.initial(&mut state.x[w.x..], &mut state.d[w.d..]);
        }
        if let Some(m) = &plan.mechanism {
            let at = m.wiring.x;
            state.x[at..at + m.q.len()].copy_from_slice(&m.q);
            state.x[at + m.q.len()..at + m.q.len() + m.v.len()].copy_from_slice(&m.v);
            let motions = &mut state.x[at + m.q.len() + m.v.len()..];
            for (lanes, motion) in motions.chunks_exact_mut(2).zip(&m.loop_motions) {
                lanes.copy_from_slice(&[motion.position, motion.rate]);
            }
        }
        for &(lane, value) in &plan.constants {
            state.sig[lane as usize] = value;
        }
        let mut sim = Simulation { plan, state, blocks, xdot: vec![0.0; n], rk4: Rk4::new(n) };
        sim.first_tick();
        sim
    }

    /// Everything once, in order; then the updates that are due at tick 0.
    fn first_tick(&mut self) {
        let plan = self.plan.clone();
        let now = self.now();
        for op in &plan.ops {
            Self::run(
                &mut self.blocks,
                &plan,
                *op,
                &now,
                &self.state.x,
                &self.state.d,
                &mut self.state.sig,
            );
        }
        self.updates(&plan, &now);
    }

    fn now(&self) -> Now {
        let t = self.plan.base.times(self.state.tick);
        let (dt, tick) = (self.plan.step.seconds(), self.state.tick);
        Now { t, dt, tick, evaluation: Evaluation::Tick }
    }

    /// The plan.
    pub fn plan(&self) -> &Arc<Plan> {
        &self.plan
    }
    /// The state.
    pub fn state(&self) -> &State {
        &self.state
    }
    /// Simulated time (s).
    pub fn time(&self) -> f64 {
        self.plan.base.times(self.state.tick)
    }

    #[inline(always)]
    fn run(
        blocks: &mut [Box<dyn Block>],
        plan: &Plan,
        op: Op,
        now: &Now,
        x: &[f64],
        d: &[f64],
        sig: &mut [f64],
    ) {
        match op {
            Op::Moore(k) => blocks[k as usize].moore(now, x, d, sig),
            Op::Direct(k) => blocks[k as usize].direct(now, x, d, sig),
            Op::Sum(j) => {
                let sum = &plan.sums[j as usize];
                let (dst, n) = (sum.dst as usize, sum.lanes as usize);
                for k in 0..n {
                    let mut total = 0.0;
                    for source in sum.sources[k..].iter().step_by(n) {
                        total += sig[*source as usize];
                    }
                    sig[dst + k] = total;
                }
            }
        }
    }

    fn updates(&mut self, plan: &Plan, now: &Now) {
        let work = &plan.works[plan.table[self.state.row as usize].work as usize];
        let State { x, d, sig, .. } = &mut self.state;
        for &k in &work.updates {
            self.blocks[k as usize].update(now, x, d, sig);
        }
        if work.refresh {
            for &k in &plan.stage_ops {
                Self::run(&mut self.blocks, plan, plan.ops[k as usize], now, x, d, sig);
            }
        }
    }

    /// Advances to the next row of the table.
    ///
    /// # Errors
    /// The first bad variable, when a state is no number or ran away.
    pub fn step(&mut self) -> Result<(), RunError> {
        let plan = self.plan.clone();
        self.step_with(&plan)
    }

    #[inline]
    fn step_with(&mut self, plan: &Plan) -> Result<(), RunError> {
        let row = &plan.table[self.state.row as usize];
        let now = self.now();
        let h = plan.base.times(row.gap);
        if plan.steps
            && let Some(last) = self.blocks.last_mut()
        {
            last.advance(&mut self.state.x, &mut self.state.sig, h);
        }
        if !plan.derivs.is_empty() {
            match plan.integrator {
                Integrator::SemiImplicitEuler => self.semi_implicit_euler(plan, &now, h),
                Integrator::Rk4 => self.rk4(plan, &now, h),
            }
        }
        self.state.tick += row.gap;
        self.state.row += 1;
        if self.state.row as usize == plan.table.len() {
            self.state.row = 0;
        }
        let now = self.now();
        let work = &plan.works[plan.table[self.state.row as usize].work as usize];
        let State { x, d, sig, .. } = &mut self.state;
        for &k in &work.ops {
            Self::run(&mut self.blocks, plan, plan.ops[k as usize], &now, x, d, sig);
        }
        self.updates(plan, &now);
        self.check()
    }

    /// Whether all values are numbers and no state ran away. Every step ends with this; before the
    /// first step it finds what is bad from the start.
    ///
    /// # Errors
    /// The first bad variable.
    pub fn check(&self) -> Result<(), RunError> {
        if self.is_bad() { Err(self.first_bad()) } else { Ok(()) }
    }

    fn derivatives(&mut self, plan: &Plan, now: &Now) {
        let State { x, d, sig, .. } = &mut self.state;
        for &k in &plan.derivs {
            self.blocks[k as usize].deriv(now, x, d, sig, &mut self.xdot);
        }
    }

    fn semi_implicit_euler(&mut self, plan: &Plan, now: &Now, h: f64) {
        self.derivatives(plan, now);
        match plan.mechanism {
            None => add(&mut self.state.x, h, &self.xdot),
            Some(_) => {
                let k = self.blocks.len() - 1;
                let q = self.blocks[k].position_lanes();
                add(&mut self.state.x[..q.start], h, &self.xdot[..q.start]);
                add(&mut self.state.x[q.end..], h, &self.xdot[q.end..]);
                self.blocks[k].advance_positions(&mut self.state.x, h);
            }
        }
    }

    fn rk4(&mut self, plan: &Plan, now: &Now, h: f64) {
        self.derivatives(plan, now);
        let Simulation { state, blocks, xdot, rk4, .. } = self;
        let State { x, d, sig, .. } = state;
        rk4.step(now.t, h, x, xdot, |t, x, xdot| {
            let now = Now { t, evaluation: Evaluation::Stage, ..*now };
            for &k in &plan.stage_ops {
                Self::run(blocks, plan, plan.ops[k as usize], &now, x, d, sig);
            }
            for &k in &plan.derivs {
                blocks[k as usize].deriv(&now, x, d, sig, xdot);
            }
        });
        if plan.mechanism.is_some()
            && let Some(last) = self.blocks.last_mut()
        {
            last.normalize(&mut self.state.x);
        }
    }

    /// Runs to the first row at or after `t`; equal states whatever the chunks.
    ///
    /// # Errors
    /// As [`Simulation::step`]. The state is then that of the bad tick.
    pub fn run_until(&mut self, t: Seconds) -> Result<(), RunError> {
        let plan = self.plan.clone();
        while self.before(t) {
            self.step_with(&plan)?;
        }
        Ok(())
    }

    /// True while the present tick is before `t`, exactly.
    pub fn before(&self, t: Seconds) -> bool {
        let base = self.plan.base;
        u128::from(self.state.tick) * u128::from(base.num) * u128::from(t.den)
            < u128::from(t.num) * u128::from(base.den)
    }

    fn is_bad(&self) -> bool {
        // NaN and ∞ times zero are NaN; one pass without branches.
        let runaway =
            self.state.x.iter().fold(0.0f64, |m, v| m + f64::from(u8::from(!(v.abs() < RUNAWAY))));
        let signals = self.state.sig.iter().fold(0.0f64, |m, v| m + v * 0.0);
        let discrete = self.state.d.iter().fold(0.0f64, |m, v| m + v * 0.0);
        runaway > 0.0 || signals + discrete != 0.0
    }

    fn first_bad(&self) -> RunError {
        let bad = |v: &Variable| {
            let value = self.at(v.place);
            let limit = if matches!(v.place, Place::X(_)) { RUNAWAY } else { f64::INFINITY };
            (!(value.abs() < limit)).then_some(value)
        };
        let mut found: Vec<(bool, &String, f64)> = self
            .plan
            .variables
            .iter()
            .filter_map(|(path, v)| Some((v.role != Role::State, path, bad(v)?)))
            .filter(|(_, path, _)| self.plan.variables[*path].role != Role::Input)
            .collect();
        found.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)));
        let (path, value) = found
            .first()
            .map_or(("a signal without a name".to_string(), f64::NAN), |f| (f.1.clone(), f.2));
        let why = self.blocks.last().and_then(|b| b.fault()).map(str::to_owned);
        RunError { time: self.time(), path, value, others: found.len().saturating_sub(1), why }
    }

    fn at(&self, place: Place) -> f64 {
        match place {
            Place::X(k) => self.state.x[k as usize],
            Place::D(k) => self.state.d[k as usize],
            Place::Signal(k) => self.state.sig[k as usize],
        }
    }

    /// The value at a place found before ([`Simulation::variable`]).
    #[inline]
    pub fn value(&self, place: Place) -> f64 {
        self.at(place)
    }

    /// Finds a variable by path.
    ///
    /// # Errors
    /// No such variable; the message guesses which was meant.
    pub fn variable(&self, path: &str) -> Result<&Variable, VariableError> {
        self.plan.variable(path)
    }

    /// Reads a variable by path.
    ///
    /// # Errors
    /// As [`Simulation::variable`].
    pub fn get(&self, path: &str) -> Result<f64, VariableError> {
        Ok(self.at(self.variable(path)?.place))
    }

    /// Sets a state or an input without a wire, by path. It acts from the present tick on.
    ///
    /// # Errors
    /// No such variable, a value that is not finite, or a variable that something else drives.
    pub fn set(&mut self, path: &str, value: f64) -> Result<(), VariableError> {
        let v = self.variable(path)?.clone();
        let refuse =
            |message: String, help: &str| Err(VariableError { message, help: help.to_string() });
        if !value.is_finite() {
            return refuse(format!("`{path}` cannot be set to {value}"), "give a finite number");
        }
        match (v.role, v.place) {
            (Role::State, Place::X(k)) => self.state.x[k as usize] = value,
            (Role::State, Place::D(k)) => self.state.d[k as usize] = value,
            (Role::Free, Place::Signal(k)) => self.state.sig[k as usize] = value,
            (Role::Output, _) => {
                return refuse(
                    format!("`{path}` is an output: it follows from the model"),
                    "set a state, a parameter or an input without a wire",
                );
            }
            _ => {
                return refuse(
                    format!("`{path}` is driven by a wire"),
                    "set what drives it, or remove the wire",
                );
            }
        }
        self.refresh();
        Ok(())
    }

    /// Evaluates the continuous operations at the present tick, after a state was edited.
    fn refresh(&mut self) {
        let plan = self.plan.clone();
        let now = self.now();
        let State { x, d, sig, .. } = &mut self.state;
        for &k in &plan.stage_ops {
            Self::run(&mut self.blocks, &plan, plan.ops[k as usize], &now, x, d, sig);
        }
    }

    /// Brings the mechanism's workspace in line with a restored state: the next step begins with
    /// derivatives that use it. Signals already hold these values.
    pub(crate) fn rework(&mut self) {
        let plan = self.plan.clone();
        if plan.mechanism.is_none() {
            return;
        }
        let now = self.now();
        let k = self.blocks.len() - 1;
        let State { x, d, sig, .. } = &mut self.state;
        self.blocks[k].moore(&now, x, d, sig);
        self.blocks[k].direct(&now, x, d, sig);
    }

    /// A copy that runs on by itself; the plan is shared.
    pub fn fork(&self) -> Simulation {
        let mut copy = Simulation {
            plan: self.plan.clone(),
            state: self.state.clone(),
            blocks: self.blocks.iter().map(|b| b.fork()).collect(),
            xdot: self.xdot.clone(),
            rk4: self.rk4.clone(),
        };
        copy.rework();
        copy
    }
}

impl Plan {
    /// Finds a variable by path.
    ///
    /// # Errors
    /// No such variable; the message guesses which was meant.
    pub fn variable(&self, path: &str) -> Result<&Variable, VariableError> {
        self.variables.get(path).ok_or_else(|| {
            let known: Vec<&str> = self.variables.keys().map(String::as_str).collect();
            VariableError {
                message: format!("there is no variable `{path}`"),
                help: remedy(path, "variables", &known),
            }
        })
    }
}
