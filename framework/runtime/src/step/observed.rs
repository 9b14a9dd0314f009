//! Variables whose values over time are observed.
use crate::author::variable::Place;
use crate::plan::compiled::{Op, Plan};

/// The method whose last stage is at the end of the step.
const RK4: &str = "rk4";

/// The variables that an observer takes; the values that it gets are in this order.
#[derive(Clone, Debug, Default)]
pub struct ObserverRequest {
    /// Evaluated at the ends of every step, and inside.
    pub places: Vec<Place>,
    /// Evaluated at rows and events; with adaptive steps also at the ends of other steps, and inside.
    pub sparing: Vec<Place>,
    /// Parts whose accounts ([`crate::Block::accounts`]) are observed at rows, with the number of accounts.
    pub accounts: Vec<(String, usize)>,
}

impl ObserverRequest {
    /// Returns the number of values.
    pub fn width(&self) -> usize {
        let accounts: usize = self.accounts.iter().map(|(_, n)| n).sum();
        self.places.len() + self.sparing.len() + accounts
    }
}

/// Variation of an observed variable between two instants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lane {
    /// The phase does not have the variable.
    Absent,
    /// The variable keeps its value.
    Held(Place),
    /// A continuous state.
    State(u32),
    /// A signal that continuous operations compute.
    Signal(u32),
}

impl Lane {
    #[inline]
    pub(super) fn value(self, entered: &[f64], x: &[f64], d: &[f64], sig: &[f64]) -> f64 {
        match self {
            Lane::Absent | Lane::Held(Place::Channel(_)) => f64::NAN,
            Lane::Held(Place::Phase(k)) => match entered.get(k as usize) {
                Some(t) if t.is_finite() => *t,
                _ => f64::NAN,
            },
            Lane::Held(Place::X(k)) | Lane::State(k) => x[k as usize],
            Lane::Held(Place::D(k)) => d[k as usize],
            Lane::Held(Place::Signal(k)) | Lane::Signal(k) => sig[k as usize],
        }
    }
}

/// The observed variables in one phase.
pub(super) struct Columns {
    pub(super) lanes: Vec<Lane>,
    /// The continuous operations upstream of the variables that are evaluated at every end, and of all variables.
    pub(super) ops: Vec<u32>,
    pub(super) all_ops: Vec<u32>,
    /// Blocks with accounts: the index of the first value of each, and their number.
    pub(super) accounts: Vec<(u32, usize, usize)>,
    /// Number of variables that are evaluated at every end.
    pub(super) often: usize,
    /// Variables that are averages over a fixed step ([`crate::Model::AVERAGES`]), or that follow from such variables.
    pub(super) averaged: Vec<bool>,
    /// Variables whose value at the end of a fixed step is known after the last stage, which is at the end of the step.
    pub(super) staged: Vec<bool>,
}

impl Columns {
    pub(super) fn of(plan: &Plan, wanted: &ObserverRequest, channels: &[Option<Place>]) -> Columns {
        let own = |place: &Place| match *place {
            Place::Channel(k) => channels[k as usize],
            place => Some(place),
        };
        let places: Vec<_> = wanted.places.iter().chain(&wanted.sparing).map(own).collect();
        let lane = |place: &Option<Place>| match *place {
            None | Some(Place::Channel(_)) => Lane::Absent,
            Some(Place::X(k)) => Lane::State(k),
            Some(Place::Signal(k)) if plan.flow.is_continuous(k) => Lane::Signal(k),
            Some(place) => Lane::Held(place),
        };
        let mut lanes: Vec<Lane> = places.iter().map(lane).collect();
        let upstream = |lanes: &[Lane]| {
            plan.flow.upstream(lanes.iter().filter_map(|lane| match lane {
                Lane::Signal(k) => Some(*k),
                _ => None,
            }))
        };
        let ops = upstream(&lanes[..wanted.places.len()]);
        let all_ops = upstream(&lanes);
        let mut accounts = Vec::new();
        for (part, n) in &wanted.accounts {
            let block = plan.parts.iter().position(|p| p.path == *part);
            let has = |k: &usize| plan.parts[*k].prototype.accounts().known.len() == *n;
            if let Some(k) = block.filter(has) {
                accounts.push((k as u32, lanes.len(), *n));
            }
            lanes.resize(lanes.len() + n, Lane::Absent);
        }
        let is_average = |op: u32| match plan.ops[op as usize] {
            Op::Feedthrough(k) => plan.parts[k as usize].prototype.description().functions.averages,
            _ => false,
        };
        let follows = |lane: &Lane| match lane {
            Lane::Signal(k) => plan.flow.upstream(std::iter::once(*k)).into_iter().any(is_average),
            _ => false,
        };
        let integrates = !plan.derivs.is_empty();
        let averaged = match plan.averages && (integrates || !plan.steps.is_empty()) {
            true => lanes.iter().map(follows).collect(),
            false => vec![false; lanes.len()],
        };
        let ends_with_a_stage = integrates
            && plan.integration.control.is_none()
            && plan.steps.is_empty()
            && plan.integration.method.name() == RK4;
        let is_staged = |lane: &Lane| match lane {
            Lane::Signal(k) => {
                plan.flow.producer.get(*k as usize).is_some_and(|op| plan.stage_ops.contains(op))
            }
            Lane::State(_) | Lane::Held(_) => true,
            Lane::Absent => false,
        };
        let staged = lanes.iter().map(|lane| ends_with_a_stage && is_staged(lane)).collect();
        let often = wanted.places.len();
        Columns { lanes, ops, all_ops, accounts, often, averaged, staged }
    }

    pub(super) fn read(
        &self,
        entered: &[f64],
        x: &[f64],
        d: &[f64],
        sig: &[f64],
        values: &mut [f64],
    ) {
        for (value, lane) in values.iter_mut().zip(&self.lanes) {
            *value = lane.value(entered, x, d, sig);
        }
    }
}
