//! `linkwork list`, `describe`, `tree`: models, variables and the structure of a simulation.
use crate::behaviour::behaviour;
use crate::program::program;
use crate::voice::say_text;
use crate::{exit, load};
use linkwork_assembly::patterns::path_matches;
use linkwork_assembly::tree::{TreeKind, TreeNode};
use linkwork_runtime::doc::{first_paragraph, first_sentence};
use linkwork_runtime::{Description, Entry, Origin, ParamSpec, PortSpec, Role};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// Lists the catalogue, or the variables of a simulation.
pub fn list(sim: Option<&Path>, pattern: Option<&str>) -> u8 {
    let Some(path) = sim else {
        models(load::catalogue().iter());
        return exit::OK;
    };
    // In `linkwork list 'actuators.*'` and `linkwork list parachute`, the argument is not a file but a pattern or a
    // search word for models.
    if !path.exists() && pattern.is_none() {
        let text = path.display().to_string();
        let catalogue = load::catalogue();
        let mut found: Vec<_> =
            catalogue.iter().filter(|e| path_matches(&text, &e.description.name)).collect();
        if found.is_empty() {
            found = catalogue.search(&text);
        }
        if found.is_empty() {
            tell!(
                "error: `{text}` is not a simulation and does not occur in the name or description of a model\n  help: `{} list` shows all models",
                program().name
            );
            return exit::INPUT;
        }
        models(found);
        return exit::OK;
    }
    let ready = match load::ready(path, &[], None) {
        Ok(r) => r,
        Err(code) => return code,
    };
    let mut n = 0;
    for (path, v) in &*ready.plan().variables {
        if pattern.is_none_or(|p| path_matches(p, path)) {
            let role = match v.role {
                Role::Output => "output",
                Role::Input => "input",
                Role::Free => "free input",
                Role::State => "state",
            };
            say!("{path:64} {:10} {role:10} {}", v.unit, first_sentence(&v.doc));
            n += 1;
        }
    }
    if n == 0 {
        tell!(
            "error: `{}` matches no variable\n  help: `*` is one part of a path, `**` any number",
            pattern.unwrap_or("")
        );
        return exit::INPUT;
    }
    exit::OK
}

/// Prints models, one per line.
fn models<'a>(all: impl IntoIterator<Item = &'a Entry>) {
    for e in all {
        say!("{:36} {}", e.description.name, first_sentence(&e.description.doc));
    }
}

fn ports(out: &mut String, title: &str, list: &[PortSpec]) {
    if list.is_empty() {
        return;
    }
    let _ = writeln!(out, "\n{title}");
    for p in list {
        let mut notes = Vec::new();
        if let Some(b) = &p.bind {
            notes.push(format!("bind \"{b}\""));
        }
        if p.sum {
            notes.push("sum of many wires".into());
        }
        if let Some(d) = &p.default {
            notes.push(format!("default {d:?}"));
        }
        let mut kind = if p.unit.is_empty() { format!("{:?}", p.kind) } else { p.unit.to_string() };
        if let Some(slider) = &p.slider {
            kind += &format!("; {slider} on a slider");
        }
        let lanes = if p.lanes > 1 && !p.unit.is_empty() {
            format!(" ×{}", p.lanes)
        } else {
            String::new()
        };
        let notes =
            if notes.is_empty() { String::new() } else { format!(" ({})", notes.join(", ")) };
        let _ = writeln!(
            out,
            "  {:24} {:12} {}{notes}",
            p.name,
            kind + &lanes,
            first_paragraph(&p.doc)
        );
    }
}

fn params(out: &mut String, list: &[ParamSpec], indent: usize) {
    for p in list {
        let mut unit = match p.unit {
            Some("*") => "any unit".to_string(),
            Some(unit) => unit.to_string(),
            None => p.kind.clone(),
        };
        if let Some(slider) = p.slider {
            unit += &format!("; {slider} on a slider");
        }
        let default = match (&p.default, p.service) {
            (_, true) if p.kind.starts_with("list of patterns") => "all".to_string(),
            (_, true) => "nearest".to_string(),
            (Some(d), _) => d.to_string(),
            (None, _) if p.kind.ends_with("nothing") => "none".to_string(),
            (None, _) => "required".to_string(),
        };
        let range = p.range.map_or(String::new(), |r| format!(", range {}", r.text()));
        let name = format!("{}{}", " ".repeat(indent), p.name);
        let _ =
            writeln!(out, "  {name:24} {unit:12} {} ({default}{range})", first_paragraph(p.doc));
        params(out, &p.fields, indent + 2);
    }
}

/// Prints the connectors of a model, each with its quantities.
fn connectors(out: &mut String, d: &Description) {
    let mut found: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for (direction, port) in
        d.all_inputs().map(|p| ("in", p)).chain(d.all_outputs().map(|p| ("out", p)))
    {
        let Some(connector) = port.connector.as_deref() else { continue };
        let quantity =
            port.name.strip_prefix(connector).unwrap_or(&port.name).trim_start_matches('.');
        found.entry(connector).or_default().push(format!("{quantity} {direction}"));
    }
    if !found.is_empty() {
        out.push_str("\nconnectors, joined by `connect`\n");
    }
    for (name, quantities) in found {
        let _ = writeln!(out, "  {name:24} {}", quantities.join(", "));
    }
}

/// Describes a model.
pub fn describe(model: &str) -> u8 {
    let catalogue = load::catalogue();
    let entry = match catalogue.find(model, Origin::NONE, "describe") {
        Ok(e) => e,
        Err(fault) => {
            tell!("error: there is no model `{model}`\n  help: {}", fault.help.unwrap_or_default());
            return exit::INPUT;
        }
    };
    let d = &entry.description;
    let mut out = format!("{}\n{}\n", d.name, d.doc);
    if let Some(kind) = entry.service_kind() {
        let _ = writeln!(out, "\nA service: provides {} to the models that use it.", kind.text());
    }
    if !d.params.is_empty() {
        out.push_str("\nparameters\n");
        params(&mut out, &d.params, 0);
    }
    ports(&mut out, "inputs (no feedthrough)", &d.inputs);
    ports(&mut out, "inputs (with feedthrough)", &d.feedthrough_inputs);
    ports(&mut out, "outputs (from state)", &d.outputs);
    ports(&mut out, "outputs (with feedthrough)", &d.feedthrough_outputs);
    connectors(&mut out, d);
    ports(&mut out, "continuous state", &d.continuous);
    ports(&mut out, "discrete state", &d.discrete);
    ports(&mut out, "a field: outputs of the parts that write to it", &d.imprint);
    let known = d.all_inputs().chain(d.all_outputs()).next().is_some() || !d.imprint.is_empty();
    if !known && entry.service_kind().is_none() {
        let name = program().name;
        let _ = writeln!(
            out,
            "\nIts ports depend on its parameters: `{name} list SIM 'PART.**'` shows those of a part."
        );
    }
    if let Some(kind) = &d.shows {
        let _ = writeln!(out, "\nA field: provides {kind} to the parts that read it.");
    }
    if let Some(field) = &d.reads {
        let _ = writeln!(out, "\nReads a field of {field}: the nearest one, if there is any.");
    }
    if d.functions.update && d.continuous.is_empty() {
        out.push_str("\nSampled: give the part a `rate`.\n");
    }
    if d.inertial {
        out.push_str("\nAssumes that W is inertial: an error if W is a site on a planet.\n");
    }
    match behaviour(model) {
        Ok(text) => out += &text,
        Err(code) => return code,
    }
    say_text(format_args!("{out}"));
    exit::OK
}

/// Kinds of files that have a schema.
#[derive(Clone, Copy, Debug, Default, clap::ValueEnum)]
pub enum Kind {
    /// Simulations, assemblies and companion files.
    #[default]
    Simulation,
    /// Campaigns.
    Campaign,
}

/// Prints the JSON Schema of a file format.
pub fn schema(kind: Kind) -> u8 {
    let schema = match kind {
        Kind::Simulation => linkwork_assembly::schema(),
        Kind::Campaign => linkwork_campaign::schema(),
    };
    say_text(format_args!("{schema:#}\n"));
    exit::OK
}

/// Prints the assembly tree.
pub fn tree(sim: &Path) -> u8 {
    let loaded = match load::loaded(sim) {
        Ok(loaded) => loaded,
        Err(code) => return code,
    };
    let mut out = String::new();
    draw(&loaded.tree, "", "", &mut out);
    say_text(format_args!("{out}"));
    exit::OK
}

fn draw(node: &TreeNode, lead: &str, next: &str, out: &mut String) {
    let what = match &node.kind {
        TreeKind::Model(m) => m.clone(),
        TreeKind::Assembly(a) => a.clone(),
    };
    let name = if node.name.is_empty() { "(simulation)" } else { &node.name };
    let bodies: Vec<&str> = node.bodies.iter().map(|b| b.rsplit('/').next().unwrap_or(b)).collect();
    let bodies =
        if bodies.is_empty() { String::new() } else { format!("  bodies: {}", bodies.join(", ")) };
    let _ = writeln!(out, "{lead}{name:<24} {what}{bodies}");
    for (k, child) in node.children.iter().enumerate() {
        let last = k + 1 == node.children.len();
        let (a, b) = if last { ("└── ", "    ") } else { ("├── ", "│   ") };
        draw(child, &format!("{next}{a}"), &format!("{next}{b}"), out);
    }
}
