//! The order of evaluation: from the wires alone. Loops of direct outputs are reported wire by wire.
use super::Part;
use super::connect::Connections;
use super::solved;
use crate::model::{Description, lanes};
use crate::plan::{Flow, Loop, Op};
use crate::value::Fault;
use petgraph::algo::tarjan_scc;
use petgraph::graph::{DiGraph, NodeIndex};
use std::collections::BTreeSet;

/// When an operation's outputs may change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Variability {
    /// Never after the first tick.
    Constant,
    /// At the ticks of these (period, offset) pairs.
    Sampled(BTreeSet<(u64, u64)>),
    /// At any time.
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

/// The ordered operations.
pub(crate) struct Order {
    pub ops: Vec<Op>,
    pub variability: Vec<Variability>,
    /// In the stages of the integrator.
    pub staged: Vec<bool>,
    /// Blocks with derivatives.
    pub derivs: Vec<u32>,
    /// Blocks whose continuous outputs depend on a discrete state.
    pub hybrid: BTreeSet<u32>,
    /// Algebraic loops.
    pub loops: Vec<Loop>,
    /// Signal lanes that they need beside those of the connections.
    pub work: usize,
    pub flow: Flow,
}

pub(super) const NONE: u32 = u32::MAX;

impl Order {
    pub(crate) fn stage_ops(&self) -> Vec<u32> {
        (0..self.ops.len() as u32).filter(|&k| self.staged[k as usize]).collect()
    }

    /// All but the sampled: what follows at once from a state or input that is set, or from an event.
    pub(crate) fn unsampled(&self) -> Vec<u32> {
        let sampled = |k: u32| matches!(self.variability[k as usize], Variability::Sampled(_));
        (0..self.ops.len() as u32).filter(|&k| !sampled(k)).collect()
    }

    /// Continuous operations that these lanes follow from, in order.
    pub(crate) fn upstream(&self, lanes: impl Iterator<Item = u32>) -> Vec<u32> {
        self.flow.upstream(lanes)
    }

    /// True when the lane never changes after the first tick.
    pub(crate) fn constant_lane(&self, lane: u32) -> bool {
        match self.flow.producer.get(lane as usize) {
            Some(&op) if op != NONE => self.variability[op as usize] == Variability::Constant,
            _ => true,
        }
    }

    /// True when the lane changes between ticks.
    pub(crate) fn continuous_lane(&self, lane: u32) -> bool {
        match self.flow.producer.get(lane as usize) {
            Some(&op) if op != NONE => self.variability[op as usize] == Variability::Continuous,
            _ => false,
        }
    }

    /// True when the lane changes at ticks only.
    pub(crate) fn sampled_lane(&self, lane: u32) -> bool {
        match self.flow.producer.get(lane as usize) {
            Some(&op) if op != NONE => {
                matches!(self.variability[op as usize], Variability::Sampled(_))
            }
            _ => false,
        }
    }
}

/// Operations without an order, with what they follow from.
pub(super) struct Flat {
    pub ops: Vec<Op>,
    pub reads: Vec<Vec<u32>>,
    /// Operation that writes a lane.
    pub producer: Vec<u32>,
    pub depends: Vec<BTreeSet<u32>>,
}

impl Flat {
    fn new(parts: &[Part<'_>], c: &Connections) -> Flat {
        let mut ops = Vec::new();
        // The operation `outputs` of each block.
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

pub(crate) fn order(parts: &[Part<'_>], c: &Connections) -> Result<Order, Vec<Fault>> {
    let mut flat = Flat::new(parts, c);
    let sequence = sort(&flat.depends)
        .ok_or_else(|| loops(&flat.ops, &flat.depends, parts, c, &flat.producer))?;
    let (sequence, loops, work) = match c.tears.is_empty() {
        true => (sequence, Vec::new(), 0),
        false => solved::close(&mut flat, &sequence, c)?,
    };
    let Flat { ops, mut producer, depends, .. } = flat;

    // Renumber in order of evaluation; what is inside a loop has the place of the loop.
    let mut place = vec![NONE; ops.len()];
    for (new, &old) in sequence.iter().enumerate() {
        place[old as usize] = new as u32;
    }
    let inside: Vec<(Op, usize)> = (loops.iter().enumerate())
        .flat_map(|(g, l)| l.ops.iter().map(move |op| (*op, g)))
        .collect();
    let mut directs = vec![NONE; parts.len()];
    for (k, op) in ops.iter().enumerate() {
        if let Op::Feedthrough(block) = op {
            directs[*block as usize] = place[k];
        }
    }
    for (op, g) in inside {
        if let (Op::Feedthrough(block), Some(at)) =
            (op, ops.iter().position(|o| *o == Op::Loop(g as u32)))
        {
            directs[block as usize] = place[at];
        }
    }
    let ops: Vec<Op> = sequence.iter().map(|&k| ops[k as usize]).collect();
    let depends: Vec<Vec<u32>> = sequence
        .iter()
        .map(|&k| depends[k as usize].iter().map(|&d| place[d as usize]).collect())
        .collect();
    for p in &mut producer {
        if *p != NONE {
            *p = place[*p as usize];
        }
    }
    let mut variability: Vec<Variability> = Vec::with_capacity(ops.len());
    for (op, depends) in ops.iter().zip(&depends) {
        let v = match op {
            Op::Loop(g) => solved::vary(&loops[*g as usize], depends, &variability, parts, c)?,
            _ => vary(*op, depends, &variability, parts),
        };
        variability.push(v);
    }
    let (derivs, staged) = stage(&directs, &depends, &variability, &producer, parts, c);
    let hybrid = parts
        .iter()
        .enumerate()
        .filter(|(_, p)| {
            let d = p.prototype.description();
            d.functions.update && !d.continuous.is_empty()
        })
        .map(|(k, _)| k as u32)
        .collect();
    let continuous = variability.iter().map(|v| *v == Variability::Continuous).collect();
    let flow = Flow { producer, depends, continuous };
    Ok(Order { ops, variability, staged, derivs, hybrid, loops, work, flow })
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

/// Kahn's algorithm; among the ready the lowest number first, so the order is canonical.
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
            // The pieces of a part with modes follow from its inputs and the clock.
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

/// Blocks with derivatives, and the continuous operations that an integrator needs again at a stage:
/// those upstream of derivatives and of blocks that advance by themselves.
fn stage(
    directs: &[u32],
    depends: &[Vec<u32>],
    variability: &[Variability],
    producer: &[u32],
    parts: &[Part<'_>],
    c: &Connections,
) -> (Vec<u32>, Vec<bool>) {
    let with = |test: &dyn Fn(&Description) -> bool| -> Vec<u32> {
        let all = 0..parts.len() as u32;
        all.filter(|&k| test(parts[k as usize].prototype.description())).collect()
    };
    let derivs = with(&|d| d.functions.derivatives && !d.continuous.is_empty());
    let staged =
        with(&|d| (d.functions.derivatives && !d.continuous.is_empty()) || d.functions.steps);
    let mut needed = vec![false; depends.len()];
    let mut stack: Vec<u32> = Vec::new();
    for &k in &staged {
        let (u, ud) = &c.inputs[k as usize];
        stack.extend(u.iter().chain(ud).map(|&l| producer[l as usize]).filter(|&p| p != NONE));
        if parts[k as usize].prototype.description().functions.derivatives_read_outputs {
            stack.extend(Some(directs[k as usize]).filter(|&p| p != NONE));
        }
    }
    while let Some(k) = stack.pop() {
        if !needed[k as usize] {
            needed[k as usize] = true;
            stack.extend(&depends[k as usize]);
        }
    }
    for (n, v) in needed.iter_mut().zip(variability) {
        *n &= *v == Variability::Continuous;
    }
    (derivs, needed)
}

/// One fault per loop, naming each wire of a shortest one.
fn loops(
    ops: &[Op],
    depends: &[BTreeSet<u32>],
    parts: &[Part<'_>],
    c: &Connections,
    producer: &[u32],
) -> Vec<Fault> {
    let mut graph = DiGraph::<(), ()>::new();
    for _ in ops {
        graph.add_node(());
    }
    for (k, set) in depends.iter().enumerate() {
        for &d in set {
            graph.add_edge(NodeIndex::new(d as usize), NodeIndex::new(k), ());
        }
    }
    let name = |k: usize| match ops[k] {
        Op::Outputs(b) | Op::Feedthrough(b) => parts[b as usize].spec.path.as_str(),
        Op::Sum(_) | Op::Loop(_) => "a sum",
    };
    let mut faults = Vec::new();
    for component in tarjan_scc(&graph) {
        let set: BTreeSet<usize> = component.iter().map(|n| n.index()).collect();
        let single = set.len() == 1 && set.iter().all(|k| !depends[*k].contains(&(*k as u32)));
        if single {
            continue;
        }
        let reader_op = |reader: usize| {
            ops.iter().position(|o| match o {
                Op::Feedthrough(b) => *b as usize == reader,
                _ => false,
            })
        };
        let links: Vec<_> = c
            .links
            .iter()
            .filter(|l| {
                let p = producer.get(l.source as usize).copied().unwrap_or(NONE);
                p != NONE
                    && set.contains(&(p as usize))
                    && reader_op(l.reader).is_some_and(|r| set.contains(&r))
            })
            .collect();
        let wires: Vec<String> =
            links.iter().map(|l| format!("`{} -> {}`", l.from, l.to)).collect();
        let members: Vec<&str> = set.iter().map(|&k| name(k)).filter(|n| *n != "a sum").collect();
        let origin = links.first().map_or(crate::Origin::NONE, |l| l.origin);
        faults.push(
            Fault::new(
                origin,
                format!(
                    "loop of direct outputs through {}: {}",
                    members.join(", "),
                    wires.join(", ")
                ),
            )
            .help("write `delay: 1` at one of these wires, or `solve: 1e-10` to find the values that agree, or put a model with state (a lag, an integrator) on it"),
        );
    }
    faults
}
