//! The order of evaluation, which follows from the wires alone. Loops of direct outputs are reported wire by wire.
use super::connections::Connections;
use super::flat::{Flat, NONE, Variability, sort, vary};
use super::part::Part;
use super::solved;
use crate::author::model::Description;
use crate::author::value::Fault;
use crate::plan::compiled::{Flow, Loop, Op};
use petgraph::algo::tarjan_scc;
use petgraph::graph::{DiGraph, NodeIndex};
use std::collections::BTreeSet;

/// The ordered operations.
pub(crate) struct Order {
    pub ops: Vec<Op>,
    pub variability: Vec<Variability>,
    /// Operations in the stages of the integrator.
    pub staged: Vec<bool>,
    /// Blocks with derivatives.
    pub derivs: Vec<u32>,
    /// Blocks whose continuous outputs depend on a discrete state.
    pub hybrid: BTreeSet<u32>,
    /// Algebraic loops.
    pub loops: Vec<Loop>,
    /// Signal slots that they need in addition to those of the connections.
    pub work: usize,
    pub flow: Flow,
}

impl Order {
    pub(crate) fn stage_ops(&self) -> Vec<u32> {
        (0..self.ops.len() as u32).filter(|&k| self.staged[k as usize]).collect()
    }

    /// All operations except sampled ones: those whose results change immediately with a state, an input or an event.
    pub(crate) fn unsampled(&self) -> Vec<u32> {
        let sampled = |k: u32| matches!(self.variability[k as usize], Variability::Sampled(_));
        (0..self.ops.len() as u32).filter(|&k| !sampled(k)).collect()
    }

    /// Returns the continuous operations on which these lanes depend, in order.
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

pub(crate) fn order(parts: &[Part<'_>], c: &Connections) -> Result<Order, Vec<Fault>> {
    let mut flat = Flat::new(parts, c);
    let sequence = sort(&flat.depends)
        .ok_or_else(|| loops(&flat.ops, &flat.depends, parts, c, &flat.producer))?;
    let (sequence, loops, work) = match c.tears.is_empty() {
        true => (sequence, Vec::new(), 0),
        false => solved::close(&mut flat, &sequence, c)?,
    };
    let Flat { ops, mut producer, depends, .. } = flat;

    // The operations are numbered in order of evaluation; operations inside a loop have the place of the loop.
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

/// Returns the blocks with derivatives, and the continuous operations that every integrator stage must evaluate: those upstream of derivatives and of
/// blocks with their own stepping method.
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

/// Returns one fault per loop, which names each wire of a shortest cycle.
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
                    "algebraic loop of feedthrough outputs through {}: {}",
                    members.join(", "),
                    wires.join(", ")
                ),
            )
            .help("write `delay: 1` at one of these wires, or `solve: 1e-10` to solve the loop to this tolerance, or insert a model with state (a lag, an integrator)"),
        );
    }
    faults
}
