//! Algebraic loops that are solved: each becomes one operation with the wires that are solved for.
use super::connections::Connections;
use super::flat::{Flat, NONE, Variability};
use super::part::Part;
use crate::author::value::Fault;
use crate::plan::compiled::{Loop, Op, REPORT};
use petgraph::algo::tarjan_scc;
use petgraph::graph::{DiGraph, NodeIndex};
use std::collections::{BTreeMap, BTreeSet};

/// Combines the operations of each loop in `flat` into one operation; returns the order of the resulting operations (`sequence` is the order for
/// known values of the sought lanes), the loops, and the number of lanes that they need.
pub(super) fn close(
    flat: &mut Flat,
    sequence: &[u32],
    c: &Connections,
) -> Result<(Vec<u32>, Vec<Loop>, usize), Vec<Fault>> {
    let n = flat.ops.len();
    // Map from an unknown signal to the signal that it must equal.
    let sent: BTreeMap<u32, u32> =
        (c.tears.iter()).flat_map(|t| (t.sought..).zip(t.sources.iter().copied())).collect();
    let component = components(flat, &sent);
    let mut faults = Vec::new();
    // Group the wires to solve by the component that they close. It is an error if a wire closes no
    // loop.
    let mut groups: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (i, tear) in c.tears.iter().enumerate() {
        let sends = flat.producer[tear.sources[0] as usize];
        let lanes = tear.sought..tear.sought + tear.sources.len() as u32;
        let closes = |k: &usize| {
            sends != NONE
                && component[*k] == component[sends as usize]
                && flat.reads[*k].iter().any(|l| lanes.contains(l))
        };
        match (0..n).find(closes) {
            Some(k) => groups.entry(component[k]).or_default().push(i),
            None => faults.push(
                Fault::new(
                    tear.origin,
                    format!("wire `{}` has `solve`, but it does not close a loop", tear.text),
                )
                .help("remove `solve`"),
            ),
        }
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    let mut loops = Vec::new();
    let mut lane = c.signals as u32;
    // Map from an operation to itself, or to the loop that contains it.
    let mut belongs: Vec<u32> = (0..n as u32).collect();
    for (at, tears) in groups {
        let members: Vec<u32> =
            sequence.iter().copied().filter(|k| component[*k as usize] == at).collect();
        let op = flat.ops.len() as u32;
        flat.ops.push(Op::Loop(loops.len() as u32));
        members.iter().for_each(|k| belongs[*k as usize] = op);
        let tears: Vec<_> = tears.into_iter().map(|i| &c.tears[i]).collect();
        let sought: Vec<(u32, u32, f64)> = (tears.iter())
            .flat_map(|t| (t.sought..).zip(&t.sources).map(|(l, s)| (l, *s, t.tolerance)))
            .collect();
        let m = sought.len();
        let size = (REPORT + m * m + 3 * m) as u32;
        flat.producer.extend((0..size).map(|_| op));
        loops.push(Loop {
            ops: members.iter().map(|k| flat.ops[*k as usize]).collect(),
            tears: sought,
            work: lane,
            block: tears[0].reader as u32,
            wires: tears.iter().map(|t| t.text.clone()).collect(),
        });
        lane += size;
        for tear in &tears {
            for l in tear.sought..tear.sought + tear.sources.len() as u32 {
                flat.producer[l as usize] = op;
            }
        }
    }
    // Operations that follow a member follow its loop; operations that precede a member precede its loop.
    let mut depends = vec![BTreeSet::new(); flat.ops.len()];
    for k in 0..n {
        let of_tears = flat.reads[k].iter().filter(|l| sent.contains_key(l));
        let of_tears = of_tears.map(|l| flat.producer[*l as usize]);
        let all = flat.depends[k].iter().map(|d| belongs[*d as usize]).chain(of_tears);
        let me = belongs[k];
        let all: Vec<u32> = all.filter(|d| *d != me).collect();
        depends[me as usize].extend(all);
    }
    for p in &mut flat.producer {
        if let Some(at) = belongs.get(*p as usize) {
            *p = *at;
        }
    }
    let gone = |k: usize| belongs.get(k).is_some_and(|b| *b != k as u32);
    flat.depends = depends;
    let sequence = super::flat::sort(&flat.depends).unwrap_or_default();
    let sequence = sequence.into_iter().filter(|k| !gone(*k as usize)).collect();
    Ok((sequence, loops, (lane as usize) - c.signals))
}

/// Returns the strongly connected component of each operation; a reader of a sought lane depends on the writer of the lane that it must equal.
fn components(flat: &Flat, sent: &BTreeMap<u32, u32>) -> Vec<u32> {
    let mut graph = DiGraph::<(), ()>::new();
    for _ in &flat.ops {
        graph.add_node(());
    }
    let node = |k: u32| NodeIndex::new(k as usize);
    for (k, set) in flat.depends.iter().enumerate() {
        let tears = flat.reads[k].iter().filter_map(|l| sent.get(l));
        let tears = tears.map(|l| flat.producer[*l as usize]).filter(|p| *p != NONE);
        for d in set.iter().copied().chain(tears) {
            graph.add_edge(node(d), NodeIndex::new(k), ());
        }
    }
    let mut component = vec![0; flat.ops.len()];
    for (i, members) in tarjan_scc(&graph).into_iter().enumerate() {
        members.iter().for_each(|k| component[k.index()] = i as u32);
    }
    component
}

/// Returns the times at which the values of a loop may change; all its sampled parts must be due at the same ticks.
pub(super) fn vary(
    l: &Loop,
    depends: &[u32],
    known: &[Variability],
    parts: &[Part<'_>],
    c: &Connections,
) -> Result<Variability, Vec<Fault>> {
    let each = l.ops.iter().map(|op| super::flat::vary(*op, depends, known, parts));
    let all = each.fold(Variability::Constant, |v, w| v.join(&w));
    let sampled = l.ops.iter().find_map(|op| match op {
        Op::Outputs(k) | Op::Feedthrough(k) => {
            let part = &parts[*k as usize];
            (part.wiring.period > 0).then_some(part)
        }
        _ => None,
    });
    let one = matches!(&all, Variability::Sampled(set) if set.len() == 1);
    match sampled {
        Some(part) if !one => {
            let tear = c.tears.iter().find(|t| l.wires.contains(&t.text));
            let fact = format!(
                "the loop of wire `{}` goes through `{}`, whose output changes only at its samples",
                l.wires[0], part.spec.path
            );
            let origin = tear.map_or(part.spec.origin, |t| t.origin);
            Err(vec![Fault::new(origin, fact).help("write `delay: 1` in place of `solve`")])
        }
        _ => Ok(all),
    }
}
