//! `linkwork graph`: parts and wires as text for Graphviz and Mermaid, or as an interactive page.
mod page;

use crate::voice::say_text;
use crate::{exit, load};
use clap::ValueEnum;
use linkwork_runtime::{Plan, Via};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

/// Language of a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum GraphFormat {
    /// Graphviz; only the first phase.
    Dot,
    /// Mermaid, as in Markdown; only the first phase.
    Mermaid,
    /// A page for a browser: all phases, with folding and search.
    Html,
}

/// Prints the graph.
pub fn graph(sim: &Path, format: GraphFormat) -> u8 {
    let ready = match load::ready(sim, &[], None) {
        Ok(r) => r,
        Err(code) => return code,
    };
    let out = match format {
        GraphFormat::Dot => dot(ready.plan()),
        GraphFormat::Mermaid => mermaid(ready.plan()),
        GraphFormat::Html => page::page(&sim.display().to_string(), &ready),
    };
    say_text(format_args!("{out}"));
    exit::OK
}

/// A wire between two parts, or between a part and an element of the mechanism.
struct Edge {
    from: End,
    to: End,
    hold: bool,
    via: Via,
}

/// An end: the part and its port.
struct End {
    part: String,
    port: String,
    /// False for a node, body or hinge.
    known: bool,
}

fn edges(plan: &Plan) -> Vec<Edge> {
    let parts: BTreeSet<&str> = plan.parts.iter().map(|p| p.path.as_str()).collect();
    let end = |path: &str| {
        let mut part = path;
        loop {
            if parts.contains(part) {
                let port = path[part.len()..].trim_start_matches('.').to_string();
                return End { part: part.to_string(), port, known: true };
            }
            match part.rsplit_once('.') {
                Some((head, _)) => part = head,
                None => return End { part: path.to_string(), port: String::new(), known: false },
            }
        }
    };
    let edge = |w: &linkwork_runtime::WirePlan| Edge {
        from: end(&w.from),
        to: end(&w.to),
        hold: w.hold,
        via: w.via,
    };
    plan.wires.iter().map(edge).collect()
}

/// Returns numbers for the parts in the order in which wires mention them.
fn numbers(edges: &[Edge]) -> BTreeMap<&str, usize> {
    let mut ids = BTreeMap::new();
    for end in edges.iter().flat_map(|e| [&e.from, &e.to]) {
        let next = ids.len();
        ids.entry(end.part.as_str()).or_insert(next);
    }
    ids
}

fn label(edge: &Edge) -> &str {
    if edge.via == Via::Bind { "" } else { &edge.from.port }
}

fn dot(plan: &Plan) -> String {
    let edges = edges(plan);
    let ids = numbers(&edges);
    let mut out = String::from("digraph linkwork {\n  rankdir=LR; node [shape=box];\n");
    for (name, id) in &ids {
        let _ = writeln!(out, "  n{id} [label={name:?}];");
    }
    for e in &edges {
        let style = match (e.hold, e.via) {
            (true, _) => ", style=dashed",
            (_, Via::Bind) => ", color=gray",
            _ => "",
        };
        let (a, b) = (ids[e.from.part.as_str()], ids[e.to.part.as_str()]);
        let _ = writeln!(out, "  n{a} -> n{b} [label={:?}{style}];", label(e));
    }
    out.push_str("}\n");
    out
}

fn mermaid(plan: &Plan) -> String {
    let edges = edges(plan);
    let ids = numbers(&edges);
    let mut out = String::from("flowchart LR\n");
    for (name, id) in &ids {
        let _ = writeln!(out, "  n{id}[\"{name}\"]");
    }
    for e in &edges {
        let arrow = if e.hold { "-.->" } else { "-->" };
        let label = match label(e) {
            "" => String::new(),
            label => format!("|{label}|"),
        };
        let (a, b) = (ids[e.from.part.as_str()], ids[e.to.part.as_str()]);
        let _ = writeln!(out, "  n{a} {arrow}{label} n{b}");
    }
    out
}
