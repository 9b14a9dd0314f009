//! The page of a model: what `linkwork describe` says, whole, with the header of its source file and its behaviour.
use crate::headers::Header;
use linkwork::runtime::{Entry, ParamSpec, PortSpec};
use std::fmt::Write;

/// A small simulation of a model, and the plots of its run.
#[derive(Clone, Debug)]
pub struct Behaviour {
    /// The text of the simulation.
    pub ron: String,
    /// File name of the plots, beside the page.
    pub plots: String,
}

/// The page of a model.
#[must_use]
pub fn page(entry: &Entry, header: Option<&Header>, behaviour: Option<&Behaviour>) -> String {
    let d = &entry.description;
    let mut out = format!("# {}\n\n{}\n\n", d.name, d.doc);
    if let Some(kind) = entry.service_kind() {
        let _ = writeln!(out, "A service: provides {} to the models that use it.\n", kind.text());
    }
    if d.functions.update && d.continuous.is_empty() {
        out.push_str("Sampled: give the part a `rate`.\n\n");
    }
    if let Some(field) = &d.reads {
        let _ = writeln!(out, "Reads a field of {field}: the nearest one, if there is any.\n");
    }
    if d.inertial {
        out.push_str("Assumes that W is inertial: an error if W is a site on a planet.\n\n");
    }
    if !d.params.is_empty() {
        out.push_str("## Parameters\n\n| name | unit or kind | default | range | meaning |\n|---|---|---|---|---|\n");
        params(&mut out, "", &d.params);
        out.push('\n');
    }
    let lists: [(&str, &[PortSpec]); 8] = [
        ("Inputs", &d.inputs),
        ("Inputs with feedthrough", &d.feedthrough_inputs),
        ("Outputs from state", &d.outputs),
        ("Outputs with feedthrough", &d.feedthrough_outputs),
        ("Continuous state", &d.continuous),
        ("Discrete state", &d.discrete),
        ("Guards", &d.guards),
        ("What one part writes to the field", &d.imprint),
    ];
    for (title, list) in lists {
        ports(&mut out, title, list);
    }
    let known = d.all_inputs().chain(d.all_outputs()).next().is_some() || !d.imprint.is_empty();
    if !known && entry.service_kind().is_none() {
        out.push_str("Its ports depend on its parameters: `linkwork list SIM 'PART.**'` shows those of a part.\n\n");
    }
    if let Some(Behaviour { ron, plots }) = behaviour {
        let _ = writeln!(
            out,
            "## Behaviour\n\n![Plots of the simulation below]({plots})\n\n```ron\n{}\n```\n",
            ron.trim_end()
        );
    }
    if let Some(Header { file, text }) = header {
        let _ = writeln!(out, "## From its source\n\n{text}\n\nSource: `{file}`");
    }
    out
}

/// A text in a cell of a table.
fn cell(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|").replace('<', "&lt;")
}

fn params(out: &mut String, lead: &str, list: &[ParamSpec]) {
    for p in list {
        let default = match (&p.default, p.service) {
            (_, true) => "the nearest".to_string(),
            (Some(d), _) => format!("`{}`", cell(&d.to_string())),
            (None, _) if p.kind.ends_with("nothing") => "none".to_string(),
            (None, _) => "required".to_string(),
        };
        let _ = writeln!(
            out,
            "| `{lead}{}` | {} | {default} | {} | {} |",
            p.name,
            cell(p.unit.unwrap_or(&p.kind)),
            p.range.map_or(String::new(), |r| cell(&r.text())),
            cell(p.doc)
        );
        params(out, &format!("{lead}{}.", p.name), &p.fields);
    }
}

fn ports(out: &mut String, title: &str, list: &[PortSpec]) {
    if list.is_empty() {
        return;
    }
    let _ = writeln!(
        out,
        "## {title}\n\n| name | unit or kind | numbers | notes | meaning |\n|---|---|---|---|---|"
    );
    for p in list {
        let unit = if p.unit.is_empty() { format!("{:?}", p.kind) } else { p.unit.to_string() };
        let mut notes = Vec::new();
        if let Some(b) = &p.bind {
            notes.push(format!("bind `{b}`"));
        }
        if p.sum {
            notes.push("sum of many wires".into());
        }
        if let Some(d) = &p.default {
            let numbers: Vec<String> = d.iter().map(f64::to_string).collect();
            notes.push(format!("default {}", numbers.join(", ")));
        }
        let (notes, doc) = (notes.join(", "), cell(&p.doc));
        let _ = writeln!(out, "| `{}` | {} | {} | {notes} | {doc} |", p.name, cell(&unit), p.lanes);
    }
    out.push('\n');
}
