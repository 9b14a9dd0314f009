//! The plan: everything about a simulation that does not change while it runs. Shared between runs.
use crate::author::block::{Block, Prototype, Wiring};
use crate::author::model::{Turning, lanes};
use crate::author::ports::Direction;
use crate::author::services::{ServiceObject, Services};
use crate::author::setting::Setting;
use crate::author::time::Seconds;
use crate::author::value::{Fault, Origin};
use crate::author::variable::Variable;
use crate::plan::condition::Condition;
use linkwork_integrate::{Control, Method};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// A compiled simulation.
pub struct Plan {
    /// Models by path, in canonical order.
    pub parts: Vec<PartPlan>,
    /// Services by path.
    pub services: Services,
    /// Numbers of lanes: continuous, discrete, signals.
    pub sizes: Sizes,
    /// All operations, in order of evaluation.
    pub ops: Vec<Op>,
    /// Operations that are evaluated at every stage of the integrator (indices into `ops`).
    pub stage_ops: Vec<u32>,
    /// All operations except sampled ones: those whose results change immediately with the state (indices into `ops`).
    pub continuous_ops: Vec<u32>,
    /// Blocks with derivatives.
    pub derivs: Vec<u32>,
    /// Distinct sets of work at ticks.
    pub works: Vec<TickWork>,
    /// The hyperperiod: (ticks to the next row, index into `works`).
    pub table: Vec<Row>,
    /// The common base of all periods and the step.
    pub base: Seconds,
    /// Integration step.
    pub step: Seconds,
    /// Settings of the integration.
    pub integration: Integration,
    /// Seed of all noise.
    pub seed: u64,
    /// Every variable of the whole program, by path; handles of users refer to these. In a program with
    /// several phases the places are channels.
    pub variables: Arc<BTreeMap<String, Variable>>,
    /// The variables of this plan, in its own lanes.
    pub lanes: Arc<BTreeMap<String, Variable>>,
    /// Signal lanes with constant content, set before the first tick.
    pub constants: Vec<(u32, f64)>,
    /// Wires as resolved, for listings.
    pub wires: Vec<WirePlan>,
    /// Blocks with a store.
    pub stored: Vec<u32>,
    /// Fields and their readers.
    pub fields: Vec<FieldPlan>,
    /// Blocks with their own stepping method.
    pub steps: Vec<u32>,
    /// Blocks whose state lies on a manifold.
    pub manifold: Vec<u32>,
    /// Blocks that change states between steps.
    pub rearranged: Vec<u32>,
    /// Blocks whose positions semi-implicit Euler advances; blocks with their own stepping method are excluded.
    pub positioned: Vec<u32>,
    /// Lanes of x that semi-implicit Euler moves along their velocities.
    pub positions: Vec<Range<usize>>,
    /// Freely rotating bodies, by their slots in x.
    pub turning: Vec<Turning>,
    /// Lanes of x without a derivative.
    pub still: Vec<Range<usize>>,
    /// Slots of x that blocks advance with their own stepping method.
    pub stepped: Vec<Range<usize>>,
    /// Signal lanes that they write during this step.
    pub stepped_outputs: Vec<Range<usize>>,
    /// Guards of parts in path order, followed by conditions of transitions in the order of the file.
    pub guards: Vec<GuardPlan>,
    /// Blocks with guards, and the slots of their values.
    pub guarded: Vec<Guarded>,
    /// Conditions, and the slots of their values.
    pub conditions: Vec<Watched>,
    /// Operations that the guards need (indices into `ops`).
    pub guard_ops: Vec<u32>,
    /// Dependence of signals on operations.
    pub(crate) flow: Flow,
    /// True if a guard may reach zero between rows; otherwise guards are evaluated at rows and events only.
    pub located: bool,
    /// For each part: whether it has modes ([`crate::Model::MODES`]); empty if no part has.
    pub moded: Vec<bool>,
    /// True if a part outputs averages over a step of a fixed-step method ([`crate::Model::AVERAGES`]).
    pub averages: bool,
    /// Number of conditions that the run monitors.
    pub watches: u32,
    /// Source lanes of the reductions.
    pub sums: Vec<Sum>,
    /// Algebraic loops that are solved.
    pub loops: Vec<Loop>,
    /// Parts that query services at their nodes.
    pub asked: Vec<ServiceQuery>,
    /// The start of a machine that was placed at rest; without it, the parts define the start.
    pub rest: Option<SettledStart>,
    /// Settings that are allowed but probably not intended.
    pub warnings: Vec<Fault>,
    /// Written parameters that have an effect only with other parameters.
    pub(crate) settings: Vec<Setting>,
    /// Data of its hash.
    pub(crate) identity: Identity,
}

/// Dependence of signals on operations, by indices into `ops`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Flow {
    /// The operation that writes each signal lane; `u32::MAX`: none does.
    pub producer: Vec<u32>,
    /// The operations whose outputs each operation reads.
    pub depends: Vec<Vec<u32>>,
    /// The operations whose outputs may change at any time.
    pub continuous: Vec<bool>,
}

impl Flow {
    /// Returns whether a signal may change at any time and not only at ticks.
    pub fn is_continuous(&self, lane: u32) -> bool {
        let op = self.producer.get(lane as usize);
        op.and_then(|op| self.continuous.get(*op as usize)).copied().unwrap_or(false)
    }

    /// Continuous operations that these lanes follow from, in order.
    pub fn upstream(&self, lanes: impl Iterator<Item = u32>) -> Vec<u32> {
        let producer = |lane: u32| self.producer.get(lane as usize).copied();
        let mut stack: Vec<u32> = lanes.filter_map(producer).collect();
        let mut needed = vec![false; self.depends.len()];
        while let Some(k) = stack.pop() {
            if let Some(needed) = needed.get_mut(k as usize).filter(|needed| !**needed) {
                *needed = true;
                stack.extend(&self.depends[k as usize]);
            }
        }
        let continuous = |k: usize| needed[k] && self.continuous[k];
        (0..needed.len()).filter(|&k| continuous(k)).map(|k| k as u32).collect()
    }
}

/// A part that queries a service at the position of a node to which it is bound.
#[derive(Clone)]
pub struct ServiceQuery {
    /// Its block.
    pub part: u32,
    /// Path of the service.
    pub service: String,
    /// The service.
    pub object: ServiceObject,
    /// Signal lanes of the node's position, W.
    pub position: [u32; 3],
}

/// A start at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct SettledStart {
    /// Continuous lanes.
    pub x: Vec<f64>,
    /// Parts with states that have come to rest.
    pub parts: Vec<u32>,
}

/// A field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldPlan {
    /// Its block.
    pub block: u32,
    /// Blocks that read it.
    pub readers: Vec<u32>,
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

/// Settings of the integration of continuous states.
#[derive(Clone, Debug)]
pub struct Integration {
    /// The method.
    pub method: Method,
    /// Tolerances and bounds of adaptive steps; without them every step has the size of the row.
    pub control: Option<Control>,
}

/// A guard.
#[derive(Clone, Debug, PartialEq)]
pub struct GuardPlan {
    /// `<part>.<guard>`, or the condition as written.
    pub name: String,
    /// The side from which it must reach its threshold at zero.
    pub direction: Direction,
    /// Action of the guard.
    pub fires: Fires,
}

impl GuardPlan {
    /// Conditions act as soon as they hold, not only when they begin to.
    pub(crate) fn level(&self) -> bool {
        matches!(self.fires, Fires::Transition { .. })
    }
}

/// Action of a guard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fires {
    /// `handle_event` of a part.
    Part {
        /// The block.
        block: u32,
        /// Place among its guards.
        which: u32,
    },
    /// A transition to another phase.
    Transition {
        /// Its index in the program.
        to: u32,
    },
    /// A condition that the run monitors: its instant is recorded, and [`crate::Simulation::step_watched`] stops there.
    Watch {
        /// Its place among [`crate::PhaseSpec::watches`].
        which: u32,
    },
}

/// A block with guards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Guarded {
    /// The block.
    pub block: u32,
    /// First of its guards.
    pub first: u32,
    /// Number of guards.
    pub count: u32,
}

/// A condition that is watched.
#[derive(Clone, Debug, PartialEq)]
pub struct Watched {
    /// Its guard.
    pub guard: u32,
    /// The condition.
    pub condition: Condition,
}

/// One model in the plan.
pub struct PartPlan {
    /// Dotted path.
    pub path: String,
    /// Name of its model.
    pub model: String,
    /// Position in the file.
    pub origin: Origin,
    /// The built model.
    pub prototype: Box<dyn Prototype>,
    /// Positions of its lanes.
    pub wiring: Wiring,
    /// Sample period, when sampled.
    pub rate: Option<Seconds>,
}

/// An operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    /// State outputs of a block.
    Outputs(u32),
    /// Feedthrough outputs of a block.
    Feedthrough(u32),
    /// A reduction (index into `sums`).
    Sum(u32),
    /// An algebraic loop (index into `loops`).
    Loop(u32),
}

/// An algebraic loop: operations that depend on each other, and the lanes whose values are solved for.
#[derive(Clone, Debug)]
pub struct Loop {
    /// The operations in the order for known values of the sought lanes.
    pub ops: Vec<Op>,
    /// Sought lane, the lane that it must equal, and the tolerated difference.
    pub tears: Vec<(u32, u32, f64)>,
    /// Signal lanes of its report (iterations, residual), then work space: a matrix and three vectors.
    pub work: u32,
    /// A block whose input is unknown, which the error names if there is no solution.
    pub block: u32,
    /// The wires that are solved for, as written.
    pub wires: Vec<String>,
}

/// Lanes of a report: iterations, residual.
pub(crate) const REPORT: usize = 2;

/// A reduction: `dst[k] = Σ sources[j·lanes + k]`, summed over j.
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
    /// Blocks whose `update` is due, without fields.
    pub updates: Vec<u32>,
    /// Fields whose `update` is due, after the others (indices into `fields`).
    pub fields: Vec<u32>,
    /// True if continuous outputs depend on these updates and must be evaluated again.
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

/// A wire as resolved, for listings.
#[derive(Clone, Debug)]
pub struct WirePlan {
    /// Output, by path.
    pub from: String,
    /// Input, by path.
    pub to: String,
    /// Origin of the wire.
    pub via: Via,
    /// A sampled output held for a continuous reader.
    pub hold: bool,
}

/// Origin of a connection.
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

    /// Returns the paths of the fields with data of a kind ([`Shows::KIND`](crate::Shows::KIND)).
    pub fn fields_of(&self, kind: &str) -> impl Iterator<Item = &str> {
        let parts = self.fields.iter().map(|f| &self.parts[f.block as usize]);
        let of = move |p: &&PartPlan| p.prototype.description().shows.as_deref() == Some(kind);
        parts.filter(of).map(|p| p.path.as_str())
    }

    /// Returns the paths of the parts with a ground overlay.
    pub fn overlays(&self) -> impl Iterator<Item = &str> {
        let shows = |p: &&PartPlan| p.prototype.description().functions.overlay;
        self.parts.iter().filter(shows).map(|p| p.path.as_str())
    }

    /// Number of operations evaluated at every stage.
    pub fn stage_len(&self) -> usize {
        self.stage_ops.len()
    }
}

impl PartPlan {
    /// Returns the numbers of its own lanes; for signals the number of its outputs.
    pub fn lanes(&self) -> Sizes {
        let d = self.prototype.description();
        Sizes {
            x: lanes(&d.continuous),
            d: lanes(&d.discrete),
            sig: lanes(&d.outputs) + lanes(&d.feedthrough_outputs),
        }
    }
}

impl Plan {
    /// Path of a block.
    pub(crate) fn block_path(&self, k: u32) -> &str {
        &self.parts[k as usize].path
    }
}

/// Content of the hash that the plan does not contain otherwise, and the hash after it was requested.
#[derive(Debug, Default)]
pub(crate) struct Identity {
    /// Sizes, settings and timing.
    pub before: String,
    /// Services, files, fields, and the conditions at which the phase ends.
    pub after: String,
    pub hash: OnceLock<u64>,
}

impl Identity {
    pub fn new(before: String, after: String) -> Identity {
        Identity { before, after, hash: OnceLock::new() }
    }

    /// Returns the identity of a plan that shares its hash with others.
    pub fn shared(hash: u64) -> Identity {
        Identity { hash: OnceLock::from(hash), ..Identity::default() }
    }
}

/// Makes the blocks of a plan.
pub(crate) fn blocks_of(plan: &Plan) -> Vec<Box<dyn Block>> {
    plan.parts.iter().map(|p| p.prototype.block(p.wiring.clone())).collect()
}
