//! Checkpoints: in memory for forks and rejected steps, in a file for a later process.
//!
//! Lanes are raw little-endian doubles (NaN, ±∞ and −0 survive); stores are MessagePack with names.
use crate::noise;
use crate::plan::Plan;
use crate::ports::Direction;
use crate::step::{GuardState, Simulation, State};
use crate::variable::Place;
use linkwork_integrate::Memory;
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"LWCKPT03";
/// The format before it knew of pins; the same without them.
const MAGIC_02: &[u8; 8] = b"LWCKPT02";

/// A state in memory, stores included. Create it once and fill it often: refilling allocates memory only for stores that have grown.
#[derive(Default)]
pub struct Snapshot {
    program: u64,
    state: State,
    stores: Vec<Option<Box<dyn Any + Send>>>,
}

/// A state in a file, with all that a fresh process needs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Version of the program that wrote it.
    pub version: String,
    /// Hash of the plan.
    pub plan: u64,
    /// Tick of the common base.
    pub tick: u64,
    /// Row of the table.
    pub row: u32,
    /// Time after the tick (s), events at this instant, phase, memory of the integrator.
    pub instant: Instant,
    /// Guards: value, change, slack, side, due.
    pub guards: Vec<(f64, f64, f64, i8, i8)>,
    /// Simulated time (s), for readers.
    pub time: f64,
    /// Seed of all noise.
    pub seed: u64,
    /// Names of the lanes, to say what differs when a plan does not fit.
    pub layout: Vec<String>,
    /// Continuous, discrete, signal lanes: raw little-endian doubles.
    #[serde(with = "serde_bytes_vec")]
    pub lanes: Vec<u8>,
    /// Stores by path of the part.
    pub stores: BTreeMap<String, Vec<u8>>,
    /// Pinned variables and their values (SI), by path.
    #[serde(default)]
    pub pins: BTreeMap<String, f64>,
    /// The full resolved configuration, so that the run can be rebuilt.
    pub configuration: String,
    /// Further data of the program that runs the simulation, by name.
    pub extra: BTreeMap<String, Vec<u8>>,
}

/// Where between two rows a state stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Instant {
    /// Time after the tick (s).
    pub since: f64,
    /// Events that have fired at this instant.
    pub micro: u32,
    /// Place of the phase in the program.
    pub phase: u32,
    /// Lists when each phase began last (s); infinite before it has begun.
    pub entered: Vec<f64>,
    /// The step that the integrator proposes (s), and the error of its last.
    pub memory: (f64, f64),
}

pub(crate) mod serde_bytes_vec {
    use serde::{Deserializer, Serializer, de::Visitor};
    pub fn serialize<S: Serializer>(v: &[u8], s: S) -> Result<S::Ok, S::Error> {
        s.serialize_bytes(v)
    }
    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<u8>, D::Error> {
        struct Bytes;
        impl Visitor<'_> for Bytes {
            type Value = Vec<u8>;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("bytes")
            }
            fn visit_bytes<E>(self, v: &[u8]) -> Result<Vec<u8>, E> {
                Ok(v.to_vec())
            }
            fn visit_byte_buf<E>(self, v: Vec<u8>) -> Result<Vec<u8>, E> {
                Ok(v)
            }
        }
        d.deserialize_byte_buf(Bytes)
    }
}

/// Why a checkpoint cannot be written, read or taken.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file cannot be written or read.
    #[error("checkpoint `{path}`: {source}")]
    Io {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// The file is not a checkpoint, or is cut short.
    #[error("`{path}` is not a readable checkpoint: {why}")]
    Format {
        /// The file.
        path: String,
        /// Why.
        why: String,
    },
    /// The checkpoint belongs to another simulation.
    #[error(
        "the checkpoint does not fit this simulation: {why}\n  help: resume it with the configuration inside it"
    )]
    Mismatch {
        /// What differs.
        why: String,
    },
    /// It holds what no run can have written.
    #[error(
        "the checkpoint holds what no run writes: {why}\n  help: it was changed or damaged; take a copy that is whole, or \
         an earlier checkpoint"
    )]
    Impossible {
        /// What.
        why: String,
    },
    /// A model's store cannot be saved or restored.
    #[error("the store of `{part}`: {why}")]
    Store {
        /// The part.
        part: String,
        /// Why.
        why: String,
    },
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

    /// Whether every part of the present phase can be saved and copied: whether checkpoints, forks and
    /// snapshots are whole.
    ///
    /// # Errors
    /// [`CheckpointError::Store`] with the first part that cannot.
    pub fn can_save(&self) -> Result<(), CheckpointError> {
        savable(self.plan())
    }

    /// Takes a snapshot back.
    ///
    /// # Errors
    /// [`CheckpointError::Mismatch`] when it is of another program; [`CheckpointError::Store`] when it
    /// lacks the store of a part that cannot be saved.
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

    /// The state as a checkpoint; `configuration` rebuilds the simulation.
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

    /// Takes a checkpoint of the same plan.
    ///
    /// # Errors
    /// [`CheckpointError::Mismatch`] naming the lanes that differ; [`CheckpointError::Store`].
    pub fn restore(&mut self, c: &Checkpoint) -> Result<(), CheckpointError> {
        let mismatch = |why: String| Err(CheckpointError::Mismatch { why });
        let Some(phase) = self.program().phases.get(c.instant.phase as usize) else {
            return mismatch(format!("it is in phase {}, which is not here", c.instant.phase));
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

    /// Hash of tick, lanes, stores and pins: equal hashes, equal bits.
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

/// What in a checkpoint of this plan no run can have written: numbers that are none, instants that are not between two rows.
fn impossible(c: &Checkpoint, plan: &Plan) -> Option<String> {
    let Instant { since, micro, memory, entered, phase } = &c.instant;
    let gap = plan.base.times(plan.table[c.row as usize].gap);
    if !(*since >= 0.0 && *since <= gap) {
        return Some(format!("an instant {since} s after a row, and rows are {gap} s apart"));
    }
    let time = plan.base.times(c.tick) + since;
    if c.time.to_bits() != time.to_bits() {
        return Some(format!("tick {} is {time} s, and it says {} s", c.tick, c.time));
    }
    // A double holds no finer time.
    if c.tick as f64 * plan.base.seconds() > TIME_MAX || time + gap == time {
        return Some(format!("tick {} at {time} s, where a row has no length any more", c.tick));
    }
    if *micro > EVENTS_MAX {
        return Some(format!("{micro} events at one instant"));
    }
    let (next, error) = *memory;
    if !(next >= 0.0 && error >= 0.0) {
        return Some(format!("a step of {next} s with an error of {error}"));
    }
    // Two sums of the same steps differ by round-off.
    let begins = |t: f64| (0.0..=time + 1e-9 * (1.0 + time)).contains(&t);
    let other = entered.iter().find(|t| !(begins(**t) || **t == f64::INFINITY));
    let own = entered.get(*phase as usize).filter(|t| !begins(**t));
    if let Some(t) = other.or(own) {
        return Some(format!("a phase that began at {t} s, and it is {time} s"));
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
        return Some(format!("guard `{}` stands nowhere", guard.name));
    }
    c.pins
        .iter()
        .find(|(_, y)| !y.is_finite())
        .map(|(path, y)| format!("`{path}` is pinned to {y}"))
}

/// Longest simulated time (s) and events at one instant that are believed.
const TIME_MAX: f64 = 1e15;
const EVENTS_MAX: u32 = 1001;

/// That every store of a plan can be saved.
fn savable(plan: &Plan) -> Result<(), CheckpointError> {
    for part in plan.stored.iter().map(|&k| &plan.parts[k as usize]) {
        let can = part.prototype.can_save();
        can.map_err(|why| CheckpointError::Store { part: part.path.clone(), why })?;
    }
    Ok(())
}

/// Names of the states, in the order of their lanes.
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

/// Resolves the file of a path: a checkpoint replaces only a regular file, never a link, folder, device or pipe.
fn target(path: &Path) -> Result<PathBuf, &'static str> {
    match std::fs::canonicalize(path) {
        Ok(there) if there.is_file() => Ok(there),
        Ok(_) => Err("it is no file"),
        Err(_) if path.is_symlink() => Err("it is a link that leads nowhere"),
        // The file or its folder does not exist; writing reports an error if necessary.
        Err(_) => Ok(path.to_owned()),
    }
}

impl Checkpoint {
    /// Writes a temporary file next to the target and renames it, so that a full disk does not destroy the old checkpoint. Behind a symbolic link the
    /// target is the file that the link names; the
    /// link stays.
    ///
    /// # Errors
    /// [`CheckpointError::Io`], also if the target exists and is not a regular file (a folder, a device, a pipe) or is a dangling link.
    pub fn write(&self, path: &Path) -> Result<(), CheckpointError> {
        let io = |source| CheckpointError::Io { path: path.display().to_string(), source };
        let own = target(path).map_err(|why| io(std::io::Error::other(why)))?;
        let path = own.as_path();
        let bytes = self.to_bytes().map_err(|why| {
            let path = path.display().to_string();
            CheckpointError::Format { path, why }
        })?;
        let temporary = path.with_extension("part");
        let write = || -> std::io::Result<()> {
            let mut file = std::fs::File::create(&temporary)?;
            file.write_all(&bytes)?;
            file.sync_all()?;
            std::fs::rename(&temporary, path)?;
            // The name lasts only when its folder is on disk.
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
            std::fs::File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
        };
        write().map_err(|e| {
            let _ = std::fs::remove_file(&temporary);
            io(e)
        })
    }

    /// Returns the contents of a checkpoint file: a magic number, a checksum, the data.
    ///
    /// # Errors
    /// Why it cannot be written down.
    pub fn to_bytes(&self) -> Result<Vec<u8>, String> {
        let body = rmp_serde::to_vec_named(self).map_err(|e| e.to_string())?;
        let sum = noise::hash(body.iter().copied()).to_le_bytes();
        Ok([&MAGIC[..], &sum, &body].concat())
    }

    /// Reads one from [`Checkpoint::to_bytes`].
    ///
    /// # Errors
    /// Why it is none.
    pub fn from_bytes(bytes: &[u8]) -> Result<Checkpoint, String> {
        if bytes.len() < 16 || (&bytes[..8] != MAGIC && &bytes[..8] != MAGIC_02) {
            return Err("it does not begin as one".into());
        }
        if noise::hash(bytes[16..].iter().copied()).to_le_bytes() != bytes[8..16] {
            return Err("its contents are damaged or cut short".into());
        }
        rmp_serde::from_slice(&bytes[16..]).map_err(|e| e.to_string())
    }

    /// Reads one.
    ///
    /// # Errors
    /// [`CheckpointError::Io`]; [`CheckpointError::Format`] when it is not one or is damaged.
    pub fn read(path: &Path) -> Result<Checkpoint, CheckpointError> {
        let name = path.display().to_string();
        let io = |source| CheckpointError::Io { path: name.clone(), source };
        // A device or a pipe may never end.
        if !path.metadata().map_err(io)?.is_file() {
            return Err(io(std::io::Error::other("it is no file")));
        }
        let bytes = std::fs::read(path).map_err(io)?;
        let format = |why| CheckpointError::Format { path: name.clone(), why };
        Checkpoint::from_bytes(&bytes).map_err(format)
    }
}
