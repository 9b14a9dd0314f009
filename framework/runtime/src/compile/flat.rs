//! Operations before they are ordered: their inputs, outputs, and the times at which their results change.
use super::connections::Connections;
use super::part::Part;
use crate::author::model::lanes;
use crate::plan::compiled::Op;
use std::collections::BTreeSet;

/// Times at which the outputs of an operation may change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Variability {
    /// Never after the first tick.
    Constant,
    /// At the ticks of these (period, offset) pairs.
    Sampled(BTreeSet<(u64, u64)>),
    /// The outputs may change at any time.
    Continuous,
}

impl Variability {
    pub(super) fn join(self, other: &Variability) -> Variability {
        match (self, other) {
            (Variability::Continuous, _) | (_, Variability::Continuous) => Variability::Continuous,
            (Variability::Constant, o) => o.clone(),
            (s, Variability::Constant) => s,
            (Variability::Sampled(mut a), Variability::Sampled(b)) => {
                a.extend(b);
                Variability::Sampled(a)
            }
        }
    }
}

pub(super) const NONE: u32 = u32::MAX;

/// Operations without an order, with the operations on which they depend.
pub(super) struct Flat {
    pub ops: Vec<Op>,
    pub reads: Vec<Vec<u32>>,
    /// Operation that writes a lane.
    pub producer: Vec<u32>,
    pub depends: Vec<BTreeSet<u32>>,
}

impl Flat {
    pub(super) fn new(parts: &[Part<'_>], c: &Connections) -> Flat {
        let mut ops = Vec::new();
        // Each entry is the operation `outputs` of a block.
        let mut state_outputs = vec![NONE; parts.len()];
        for (k, part) in parts.iter().enumerate() {
            let f = part.prototype.description().functions;
            if f.outputs {
                state_outputs[k] = ops.len() as u32;
                ops.push(Op::Outputs(k as u32));
            }
            if f.feedthrough {
                ops.push(Op::Feedthrough(k as u32));
            }
        }
        ops.extend((0..c.sums.len() as u32).map(Op::Sum));
        let mut reads = Vec::with_capacity(ops.len());
        let mut producer = vec![NONE; c.signals];
        for (k, op) in ops.iter().enumerate() {
            let (read, written) = reads_and_writes(*op, parts, c);
            for lane in written {
                producer[lane as usize] = k as u32;
            }
            reads.push(read);
        }
        let depends = (ops.iter().zip(&reads))
            .map(|(op, reads)| {
                let mut set: BTreeSet<u32> =
                    reads.iter().map(|&l| producer[l as usize]).filter(|&p| p != NONE).collect();
                if let Op::Feedthrough(k) = *op
                    && parts[k as usize].prototype.description().functions.feedthrough_after_outputs
                    && state_outputs[k as usize] != NONE
                {
                    set.insert(state_outputs[k as usize]);
                }
                set
            })
            .collect();
        Flat { ops, reads, producer, depends }
    }
}

/// Sorts operations by Kahn's algorithm; among operations that are ready the one with the lowest number is first, so the order is canonical.
pub(super) fn sort(depends: &[BTreeSet<u32>]) -> Option<Vec<u32>> {
    let mut waiting: Vec<usize> = depends.iter().map(BTreeSet::len).collect();
    let mut readers = vec![Vec::new(); depends.len()];
    for (k, set) in depends.iter().enumerate() {
        for &d in set {
            readers[d as usize].push(k as u32);
        }
    }
    let mut ready: BTreeSet<u32> =
        (0..depends.len() as u32).filter(|&k| waiting[k as usize] == 0).collect();
    let mut sequence = Vec::with_capacity(depends.len());
    while let Some(k) = ready.pop_first() {
        sequence.push(k);
        for &r in &readers[k as usize] {
            waiting[r as usize] -= 1;
            if waiting[r as usize] == 0 {
                ready.insert(r);
            }
        }
    }
    (sequence.len() == depends.len()).then_some(sequence)
}

pub(super) fn vary(
    op: Op,
    depends: &[u32],
    known: &[Variability],
    parts: &[Part<'_>],
) -> Variability {
    let inputs = || depends.iter().fold(Variability::Constant, |v, &d| v.join(&known[d as usize]));
    match op {
        Op::Sum(_) | Op::Loop(_) => inputs(),
        Op::Outputs(k) | Op::Feedthrough(k) => {
            let part = &parts[k as usize];
            let d = part.prototype.description();
            let timed = match op {
                Op::Outputs(_) => d.functions.outputs_timed,
                _ => d.functions.feedthrough_timed,
            };
            // Guards of a part with modes do not make it continuous, because its modes depend only
            // on its inputs and the clock.
            let events = d.functions.guards && !d.functions.modes;
            if !d.continuous.is_empty() || events {
                Variability::Continuous
            } else if part.wiring.period > 0 {
                Variability::Sampled([(part.wiring.period, part.wiring.offset)].into())
            } else if timed || d.reads.is_some() {
                Variability::Continuous
            } else {
                inputs()
            }
        }
    }
}

fn reads_and_writes(op: Op, parts: &[Part<'_>], c: &Connections) -> (Vec<u32>, Vec<u32>) {
    match op {
        Op::Outputs(k) => {
            let w = &parts[k as usize].wiring;
            (Vec::new(), (w.ym as u32..w.yd as u32).collect())
        }
        Op::Feedthrough(k) => {
            let part = &parts[k as usize];
            let n = lanes(&part.prototype.description().feedthrough_outputs);
            let yd = part.wiring.yd as u32;
            (c.inputs[k as usize].1.clone(), (yd..yd + n as u32).collect())
        }
        Op::Sum(j) => {
            let s = &c.sums[j as usize];
            (s.sources.clone(), (s.dst..s.dst + s.lanes).collect())
        }
        Op::Loop(_) => (Vec::new(), Vec::new()),
    }
}
