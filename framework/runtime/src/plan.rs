//! The plan: everything about a simulation that does not change while it runs. Shared between runs.
use crate::block::{Prototype, Wiring};
use crate::mechanism::MechanismPlan;
use crate::ports::PortKind;
use crate::services::Services;
use crate::spec::Integrator;
use crate::time::Seconds;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A compiled simulation.
pub struct Plan {
    /// Models by path, in canonical order.
    pub parts: Vec<PartPlan>,
    /// The mechanism: the last block.
    pub mechanism: Option<Arc<MechanismPlan>>,
    /// Services by path.
    pub services: Services,
    /// Numbers of lanes: continuous, discrete, signals.
    pub sizes: Sizes,
    /// All operations, in order of evaluation.
    pub ops: Vec<Op>,
    /// What is evaluated again at every stage of the integrator (indices into `ops`).
    pub stage_ops: Vec<u32>,
    /// Blocks with derivatives.
    pub derivs: Vec<u32>,
    /// Distinct sets of work at a tick.
    pub works: Vec<TickWork>,
    /// The hyperperiod: (ticks to the next row, index into `works`).
    pub table: Vec<Row>,
    /// The common base of all periods and the step.
    pub base: Seconds,
    /// Integration step.
    pub step: Seconds,
    /// Integrator.
    pub integrator: Integrator,
    /// Seed of all noise.
    pub seed: u64,
    /// Every variable, by path.
    pub variables: BTreeMap<String, Variable>,
    /// Signal lanes with constant content, set before the first tick.
    pub constants: Vec<(u32, f64)>,
    /// Wires as resolved, for listings.
    pub wires: Vec<WirePlan>,
    /// Blocks with a store.
    pub stored: Vec<u32>,
    /// The mechanism advances by a method of its own.
    pub steps: bool,
    /// Source lanes of the reductions.
    pub sums: Vec<Sum>,
    /// Hash of structure and layout: equal plans can exchange states.
    pub hash: u64,
}

/// Numbers of lanes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sizes {
    /// Continuous states.
    pub x: usize,
    /// Discrete states.
    pub d: usize,
    /// Signals.
    pub sig: usize,
}

/// One model in the plan.
pub struct PartPlan {
    /// Dotted path.
    pub path: String,
    /// The built model.
    pub prototype: Box<dyn Prototype>,
    /// Where its lanes are.
    pub wiring: Wiring,
    /// Sample period, when sampled.
    pub rate: Option<Seconds>,
}

/// An operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    /// State outputs of a block.
    Moore(u32),
    /// Feedthrough outputs of a block.
    Direct(u32),
    /// A reduction (index into `sums`).
    Sum(u32),
}

/// A reduction: dst[k] = Σ sources[j·lanes + k].
#[derive(Clone, Debug)]
pub struct Sum {
    /// First destination lane.
    pub dst: u32,
    /// Lanes.
    pub lanes: u32,
    /// Source lanes, one after another, in path order.
    pub sources: Vec<u32>,
}

/// The work of one tick.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct TickWork {
    /// Operations due, in order (indices into `ops`).
    pub ops: Vec<u32>,
    /// Blocks whose `update` is due.
    pub updates: Vec<u32>,
    /// A continuous output depends on a discrete state updated here: evaluate the stage again.
    pub refresh: bool,
}

/// One row of the static rate table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Tick of this row within the hyperperiod.
    pub at: u64,
    /// Ticks to the next row.
    pub gap: u64,
    /// Index into `works`.
    pub work: u32,
}

/// Where a variable lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Continuous state lane.
    X(u32),
    /// Discrete state lane.
    D(u32),
    /// Signal lane.
    Signal(u32),
}

/// What a variable is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Output of a model.
    Output,
    /// Input that is driven by a wire.
    Input,
    /// Input without a wire: may be set.
    Free,
    /// State of a model or of the mechanism.
    State,
}

/// A variable: one lane with a path.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Where.
    pub place: Place,
    /// What.
    pub role: Role,
    /// Unit as written in the source.
    pub unit: String,
    /// Meaning.
    pub doc: String,
    /// Number or truth value.
    pub kind: PortKind,
    /// Path of the part that owns it.
    pub part: String,
}

/// A wire as resolved, for listings.
#[derive(Clone, Debug)]
pub struct WirePlan {
    /// Output, by path.
    pub from: String,
    /// Input, by path.
    pub to: String,
    /// How it came to be.
    pub via: Via,
    /// A sampled output held for a continuous reader.
    pub hold: bool,
}

/// How a connection came to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Via {
    /// A written wire.
    Wire,
    /// A binding to a node or hinge.
    Bind,
}

impl Plan {
    /// The sample period of a part, or `None` when it is continuous.
    pub fn rate_of(&self, path: &str) -> Option<Seconds> {
        self.parts.iter().find(|p| p.path == path).and_then(|p| p.rate)
    }

    /// Number of operations evaluated at every stage.
    pub fn stage_len(&self) -> usize {
        self.stage_ops.len()
    }
}

impl Plan {
    /// Path of a block with a store: a part's, or the mechanism's.
    pub(crate) fn block_path(&self, k: u32) -> &str {
        match (self.parts.get(k as usize), &self.mechanism) {
            (Some(part), _) => &part.path,
            (None, Some(m)) => &m.path,
            (None, None) => "",
        }
    }
}
