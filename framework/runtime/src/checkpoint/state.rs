//! Copies the state of a run to memory or to a checkpoint, and back.
use super::file::{Checkpoint, CheckpointError, Instant};
use crate::author::noise;
use crate::author::ports::Direction;
use crate::author::variable::Place;
use crate::plan::compiled::Plan;
use crate::step::simulation::Simulation;
use crate::step::state::{GuardState, State};
use linkwork_integrate::Memory;
use std::any::Any;
use std::collections::BTreeMap;

/// A state in memory, stores included. Create it once and fill it often: refilling allocates memory only for stores that have grown.
#[derive(Default)]
pub struct Snapshot {
    program: u64,
    state: State,
    stores: Vec<Option<Box<dyn Any + Send>>>,
}

impl Simulation {
    /// Fills a snapshot.
    pub fn save_into(&self, s: &mut Snapshot) {
        s.program = self.program().hash();
        s.state.copy_from(&self.state);
        s.stores.resize_with(self.plan().stored.len(), || None);
        for (&k, slot) in self.plan().stored.iter().zip(&mut s.stores) {
            self.blocks[k as usize].copy_store(slot);
        }
    }

    /// Checks that every part of the present phase can be saved and copied, so that checkpoints, forks and snapshots are complete.
    ///
    /// # Errors
    /// [`CheckpointError::Store`] with the first part that cannot be saved.
    pub fn can_save(&self) -> Result<(), CheckpointError> {
        savable(self.plan())
    }

    /// Takes a snapshot back.
    ///
    /// # Errors
    /// [`CheckpointError::Mismatch`] if it belongs to another program; [`CheckpointError::Store`] if it lacks the store of a part that cannot be
    /// saved.
    pub fn load_from(&mut self, s: &Snapshot) -> Result<(), CheckpointError> {
        if s.program != self.program().hash() {
            let why = "parameters, rates or wires differ".to_string();
            return Err(CheckpointError::Mismatch { why });
        }
        if let Some(phase) = self.program().phases.get(s.state.phase as usize) {
            savable(&phase.plan)?;
        }
        self.enter(s.state.phase);
        self.state.copy_from(&s.state);
        for (&k, store) in self.plan().clone().stored.iter().zip(&s.stores) {
            if let Some(store) = store {
                self.blocks[k as usize].take_store(&**store);
            }
        }
        self.replaced();
        self.judge();
        Ok(())
    }

    fn store(&self, k: u32) -> Result<Vec<u8>, CheckpointError> {
        self.blocks[k as usize].save_store().map_err(|why| CheckpointError::Store {
            part: self.plan().block_path(k).to_owned(),
            why,
        })
    }

    /// Returns the state as a checkpoint; `configuration` is the text from which the simulation can be rebuilt.
    ///
    /// # Errors
    /// [`CheckpointError::Store`] when a model's store cannot be written.
    pub fn checkpoint(&self, configuration: &str) -> Result<Checkpoint, CheckpointError> {
        let mut stores = BTreeMap::new();
        for &k in &self.plan().stored {
            stores.insert(self.plan().block_path(k).to_owned(), self.store(k)?);
        }
        Ok(Checkpoint {
            version: env!("CARGO_PKG_VERSION").to_string(),
            plan: self.program().hash(),
            tick: self.state.tick,
            row: self.state.row,
            instant: Instant {
                since: self.state.since,
                micro: self.state.micro,
                phase: self.state.phase,
                entered: self.state.entered.clone(),
                memory: (self.state.memory.next, self.state.memory.error),
            },
            guards: (self.state.guards.iter())
                .map(|g| (g.value, g.change, g.slack, g.side, g.due))
                .collect(),
            time: self.time(),
            seed: self.plan().seed,
            layout: layout(self.plan()),
            lanes: self.lane_bytes(),
            stores,
            pins: self.pins().map(|(path, value)| (path.to_string(), value)).collect(),
            configuration: configuration.to_string(),
            extra: BTreeMap::new(),
        })
    }

    fn lane_bytes(&self) -> Vec<u8> {
        let s = &self.state;
        s.x.iter().chain(&s.d).chain(&s.sig).flat_map(|v| v.to_le_bytes()).collect()
    }

    /// Restores a checkpoint of the same plan.
    ///
    /// # Errors
    /// [`CheckpointError::Mismatch`] naming the lanes that differ; [`CheckpointError::Store`].
    pub fn restore(&mut self, c: &Checkpoint) -> Result<(), CheckpointError> {
        let mismatch = |why: String| Err(CheckpointError::Mismatch { why });
        let Some(phase) = self.program().phases.get(c.instant.phase as usize) else {
            return mismatch(format!(
                "it is in phase {}, which this simulation does not have",
                c.instant.phase
            ));
        };
        let plan = phase.plan.clone();
        let layout = layout(&plan);
        if layout != c.layout {
            let missing: Vec<&String> =
                c.layout.iter().filter(|n| !layout.contains(n)).take(3).collect();
            let extra: Vec<&String> =
                layout.iter().filter(|n| !c.layout.contains(n)).take(3).collect();
            return mismatch(format!("only in the checkpoint: {missing:?}; only here: {extra:?}"));
        }
        let lanes = plan.sizes.x + plan.sizes.d + plan.sizes.sig;
        if self.program().hash() != c.plan
            || c.lanes.len() != 8 * lanes
            || c.guards.len() != plan.guards.len()
            || c.instant.entered.len() != self.state.entered.len()
        {
            return mismatch("parameters, files, rates or wires differ".to_string());
        }
        let hyper: u64 = plan.table.iter().map(|r| r.gap).sum();
        let fits = plan.table.get(c.row as usize).is_some_and(|r| {
            c.tick >= r.at && (c.tick - r.at).is_multiple_of(hyper.max(1)) && c.instant.since >= 0.0
        });
        if !fits {
            return mismatch(format!("tick {} is not at row {} of the table", c.tick, c.row));
        }
        if let Some(why) = impossible(c, &plan) {
            return Err(CheckpointError::Impossible { why });
        }
        self.enter(c.instant.phase);
        self.state.tick = c.tick;
        self.state.row = c.row;
        (self.state.since, self.state.micro) = (c.instant.since, c.instant.micro);
        self.state.entered.clone_from(&c.instant.entered);
        self.state.memory = Memory { next: c.instant.memory.0, error: c.instant.memory.1 };
        self.state.guards = (c.guards.iter())
            .map(|&(value, change, slack, side, due)| GuardState {
                value,
                change,
                slack,
                side,
                due,
            })
            .collect();
        let mut values = c.lanes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b));
        let s = &mut self.state;
        for lane in s.x.iter_mut().chain(&mut s.d).chain(&mut s.sig) {
            *lane = values.next().unwrap_or(f64::NAN);
        }
        for (part, bytes) in &c.stores {
            let plan = self.plan();
            let Some(k) = plan.stored.iter().copied().find(|k| plan.block_path(*k) == part) else {
                return Err(CheckpointError::Mismatch {
                    why: format!("there is no part `{part}`"),
                });
            };
            self.blocks[k as usize]
                .load_store(bytes)
                .map_err(|why| CheckpointError::Store { part: part.clone(), why })?;
        }
        self.replaced();
        self.take_pins(&c.pins).map_err(|why| CheckpointError::Mismatch { why })?;
        if let Some((path, value)) = self.bad_variable() {
            return Err(CheckpointError::Impossible { why: format!("`{path}` is {value}") });
        }
        // Messages about the start of this run do not apply to the restored state.
        self.judge();
        Ok(())
    }

    /// Returns a hash of tick, lanes, stores and pins; equal hashes mean bit-identical states.
    pub fn hash(&self) -> u64 {
        let s = &self.state;
        let mut bytes = s.tick.to_le_bytes().to_vec();
        bytes.extend(s.since.to_le_bytes());
        bytes.extend([s.micro, s.phase].into_iter().flat_map(u32::to_le_bytes));
        bytes.extend(self.lane_bytes());
        for &k in &self.plan().stored {
            bytes.extend(self.blocks[k as usize].save_store().unwrap_or_default());
        }
        for (path, value) in self.pins() {
            bytes.extend(path.bytes());
            bytes.extend(value.to_le_bytes());
        }
        noise::hash(bytes)
    }
}

/// Returns the first value in a checkpoint of this plan that no run can have written, such as NaN or an instant that is not between two rows.
fn impossible(c: &Checkpoint, plan: &Plan) -> Option<String> {
    let Instant { since, micro, memory, entered, phase } = &c.instant;
    let gap = plan.base.times(plan.table[c.row as usize].gap);
    if !(*since >= 0.0 && *since <= gap) {
        return Some(format!("its time is {since} s after a row, but rows are {gap} s apart"));
    }
    let time = plan.base.times(c.tick) + since;
    if c.time.to_bits() != time.to_bits() {
        return Some(format!(
            "tick {} is at {time} s, but the checkpoint states {} s",
            c.tick, c.time
        ));
    }
    // A double cannot represent a shorter time step at this time.
    if c.tick as f64 * plan.base.seconds() > TIME_MAX || time + gap == time {
        return Some(format!(
            "tick {} is at {time} s, where the distance between rows is lost in round-off",
            c.tick
        ));
    }
    if *micro > EVENTS_MAX {
        return Some(format!("it has {micro} events at one instant"));
    }
    let (next, error) = *memory;
    if !(next >= 0.0 && error >= 0.0) {
        return Some(format!("its next step is {next} s and the error estimate {error}"));
    }
    // Allow round-off, because the same steps may be summed in two ways.
    let begins = |t: f64| (0.0..=time + 1e-9 * (1.0 + time)).contains(&t);
    let other = entered.iter().find(|t| !(begins(**t) || **t == f64::INFINITY));
    let own = entered.get(*phase as usize).filter(|t| !begins(**t));
    if let Some(t) = other.or(own) {
        return Some(format!("a phase began at {t} s, but the checkpoint is at {time} s"));
    }
    let mut guards = c.guards.iter().zip(&plan.guards);
    let bad = guards.find(|((value, change, slack, side, due), guard)| {
        let sides = |side: &i8| (-1..=1).contains(side);
        let ways = match guard.direction {
            Direction::Rising => 0..=1,
            Direction::Falling => -1..=0,
            Direction::Either => -1..=1,
        };
        let known = !value.is_nan() && !change.is_nan() && *slack >= 0.0;
        !(known && sides(side) && ways.contains(due))
    });
    if let Some((_, guard)) = bad {
        return Some(format!("guard `{}` has an impossible state", guard.name));
    }
    c.pins
        .iter()
        .find(|(_, y)| !y.is_finite())
        .map(|(path, y)| format!("`{path}` is pinned to {y}"))
}

/// Largest plausible simulated time (s) and number of events at one instant.
const TIME_MAX: f64 = 1e15;
const EVENTS_MAX: u32 = 1001;

/// Checks that every store of a plan can be saved.
fn savable(plan: &Plan) -> Result<(), CheckpointError> {
    for part in plan.stored.iter().map(|&k| &plan.parts[k as usize]) {
        let can = part.prototype.can_save();
        can.map_err(|why| CheckpointError::Store { part: part.path.clone(), why })?;
    }
    Ok(())
}

/// Returns the names of the states in the order of their lanes.
fn layout(plan: &Plan) -> Vec<String> {
    let mut names = vec![String::new(); plan.sizes.x + plan.sizes.d];
    for (path, v) in &*plan.lanes {
        match v.place {
            Place::X(k) => names[k as usize].clone_from(path),
            Place::D(k) => names[plan.sizes.x + k as usize].clone_from(path),
            Place::Signal(_) | Place::Channel(_) | Place::Phase(_) => {}
        }
    }
    names
}
