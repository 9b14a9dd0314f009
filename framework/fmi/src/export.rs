//! Export of a simulation as a unit of FMI 3.0: description, configuration and shared library in one archive.
//!
//! Inputs of the unit are unconnected inputs of the simulation; outputs are selected by patterns. Names are the paths of the simulation; numbers are
//! in SI.
use crate::archive::{platform, write_archive};
use crate::provide::{Contents, UnitVariable};
use linkwork_assembly::patterns::match_patterns;
use linkwork_assembly::{Failure, Text};
use linkwork_formats::escaped;
use linkwork_formats::fmi::FmiVersion;
use linkwork_runner::Ready;
use linkwork_runtime::{Fault, Origin, PortKind, Role, Simulation, Unit as Measure, Variable};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Options of an export.
#[derive(Clone, Debug)]
pub struct Export {
    /// Name of the unit. It is converted to a C identifier.
    pub name: String,
    /// Patterns of inputs; empty: all unconnected inputs.
    pub inputs: Vec<String>,
    /// Patterns of outputs; empty: the variables that the simulation logs, or all outputs if it does not log any.
    pub outputs: Vec<String>,
    /// The shared library; see [`find_library`].
    pub library: PathBuf,
}

/// Result of an export.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// Paths of the inputs.
    pub inputs: Vec<String>,
    /// Paths of the outputs.
    pub outputs: Vec<String>,
    /// Notes for importers, for example that the state cannot be saved.
    pub notes: Vec<String>,
}

/// Returns the file name of the shared library of units with the models of a program.
pub fn library_name(package: &str) -> String {
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    format!("{prefix}{}{suffix}", package.replace('-', "_"))
}

/// Returns the shared library of a package: next to the running program, or where Cargo builds it.
///
/// # Errors
/// A fault with the paths that were tried, and the command that builds it.
pub fn find_library(package: &str) -> Result<PathBuf, Fault> {
    let name = library_name(package);
    let program = std::env::current_exe().ok();
    let folder = program.as_deref().and_then(Path::parent).unwrap_or(Path::new("."));
    let places = [folder.join(&name), folder.join("deps").join(&name)];
    if let Some(found) = places.iter().find(|p| p.is_file()) {
        return Ok(found.clone());
    }
    let tried: Vec<String> = places.iter().map(|p| format!("`{}`", p.display())).collect();
    let message =
        format!("the shared library of the unit does not exist; tried {}", tried.join(", "));
    let help =
        format!("build it with `cargo build --release -p {package}`, or select it with --library");
    Err(Fault::new(Origin::NONE, message).help(help))
}

/// Writes a simulation as a unit.
///
/// # Errors
/// Patterns without a match or for variables that cannot be inputs, data files that the unit cannot contain, a file that cannot be written.
pub fn export(ready: Ready, what: &Export, out: &Path) -> Result<Exported, Failure> {
    let sources = ready.loaded.sources.clone();
    let fail = |faults: Vec<Fault>| Failure { faults, sources: sources.clone() };
    let plain =
        |message: String, help: &str| fail(vec![Fault::new(Origin::NONE, message).help(help)]);
    let files = ready.files.names();
    if !files.is_empty() {
        let message = format!(
            "the simulation reads {}, which a unit cannot contain",
            files.iter().map(|f| format!("`{f}`")).collect::<Vec<_>>().join(", ")
        );
        return Err(plain(message, "export a simulation that does not read data files"));
    }
    let (inputs, outputs) = choose(&ready, what).map_err(&fail)?;
    let library = std::fs::read(&what.library).map_err(|e| {
        let message = format!("`{}` cannot be read: {e}", what.library.display());
        plain(message, "select the shared library of units with --library")
    })?;
    let hash = ready.program.hash();
    let until = ready.loaded.simulation.until.map(|u| u.seconds());
    let resolved = ready.loaded.resolved.to_string();
    let (title, doc) = (what.name.clone(), ready.loaded.simulation.doc.clone());
    let sim = Simulation::of(Arc::new(ready.program));
    sim.check().map_err(|e| {
        plain(format!("the simulation cannot start: {}", e.message), "correct it, then export")
    })?;
    let unsaved: Vec<String> = (sim.program().phases.iter().flat_map(|p| &p.plan.parts))
        .filter_map(|p| Some(format!("`{}`: {}", p.path, p.prototype.can_save().err()?)))
        .collect();
    let variables: Vec<(&String, &Variable, bool)> = inputs
        .iter()
        .map(|p| (p, true))
        .chain(outputs.iter().map(|p| (p, false)))
        .filter_map(|(p, input)| Some((p, sim.variable(p).ok()?, input)))
        .collect();
    let shown: Vec<UnitVariable> = variables
        .iter()
        .map(|(path, v, input)| UnitVariable {
            path: (*path).clone(),
            input: *input,
            boolean: v.kind == PortKind::Bool,
        })
        .collect();
    let listing: String = shown.iter().map(|s| format!("{s:?}\n")).collect();
    let print = linkwork_runtime::noise::hash(listing.bytes());
    let version = env!("CARGO_PKG_VERSION");
    let token = format!("{{linkwork-{version}-{hash:016x}-{print:016x}}}");
    let identifier = identifier(&what.name);
    let head = Head {
        title: &title,
        doc: &doc,
        identifier: &identifier,
        token: &token,
        saves: unsaved.is_empty(),
        step: sim.plan().step.seconds(),
        until,
    };
    let description = description(&head, &variables, &sim);
    let contents = Contents { token: token.clone(), hash, variables: shown }.to_text();
    let suffix = std::env::consts::DLL_SUFFIX;
    let binary = format!("binaries/{}/{identifier}{suffix}", platform(FmiVersion::V3));
    let entries: [(&str, &[u8]); 4] = [
        ("modelDescription.xml", description.as_bytes()),
        ("resources/simulation.ron", resolved.as_bytes()),
        ("resources/unit.txt", contents.as_bytes()),
        (&binary, &library),
    ];
    // Write to a temporary file and rename it, so that an interrupted export keeps the old unit.
    let part = out.with_extension("fmu.part");
    let written =
        write_archive(&part, &entries).and_then(|()| std::fs::rename(&part, out)).map_err(|e| {
            let _ = std::fs::remove_file(&part);
            plain(format!("`{}` cannot be written: {e}", out.display()), "choose another path")
        });
    written?;
    let notes = unsaved
        .into_iter()
        .map(|why| format!("the unit cannot save its state, because of {why}"))
        .collect();
    Ok(Exported { inputs, outputs, notes })
}

/// Returns the paths of the inputs and outputs.
fn choose(ready: &Ready, what: &Export) -> Result<(Vec<String>, Vec<String>), Vec<Fault>> {
    let plan = ready.plan();
    let of = |roles: &[Role]| -> Vec<&String> {
        plan.variables.iter().filter(|(_, v)| roles.contains(&v.role)).map(|(p, _)| p).collect()
    };
    let written = |patterns: &[String]| -> Vec<Text> {
        patterns.iter().map(|p| Text { text: p.clone(), origin: Origin::NONE }).collect()
    };
    let pick = |patterns: &[Text], names: &[&String]| -> Result<Vec<String>, Vec<Fault>> {
        let found = match_patterns(patterns, names)?;
        Ok(found.into_iter().map(|k| names[k].clone()).collect())
    };
    let free = of(&[Role::Free]);
    let mut faults = Vec::new();
    let inputs = match what.inputs.is_empty() {
        true => free.iter().map(|p| (*p).clone()).collect(),
        false => pick(&written(&what.inputs), &free).unwrap_or_else(|found| {
            faults.extend(found.into_iter().map(|f| {
                let message = format!("{}: inputs of a unit must be unconnected inputs", f.message);
                Fault { message, ..f }
            }));
            Vec::new()
        }),
    };
    let seen = of(&[Role::Output, Role::State]);
    let logged: Vec<Text> =
        ready.loaded.simulation.log.iter().flat_map(|rule| rule.channels.clone()).collect();
    let patterns = match (what.outputs.is_empty(), logged.is_empty()) {
        (false, _) => written(&what.outputs),
        (true, false) => logged,
        (true, true) => Vec::new(),
    };
    let outputs = match patterns.is_empty() {
        true => of(&[Role::Output]).into_iter().cloned().collect(),
        // Logged variables that are inputs are not outputs.
        false if what.outputs.is_empty() => {
            let all: Vec<&String> = plan.variables.keys().collect();
            pick(&patterns, &all)
                .map(|mut found| {
                    found.retain(|p| seen.contains(&p));
                    found
                })
                .unwrap_or_else(|found| {
                    faults.extend(found);
                    Vec::new()
                })
        }
        false => pick(&patterns, &seen).unwrap_or_else(|found| {
            faults.extend(found);
            Vec::new()
        }),
    };
    if faults.is_empty() { Ok((inputs, outputs)) } else { Err(faults) }
}

/// Converts a name to a C identifier.
fn identifier(name: &str) -> String {
    let plain: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if plain.starts_with(|c: char| c.is_ascii_alphabetic()) {
        plain
    } else {
        format!("unit_{plain}")
    }
}

struct Head<'a> {
    title: &'a str,
    doc: &'a str,
    identifier: &'a str,
    token: &'a str,
    saves: bool,
    step: f64,
    until: Option<f64>,
}

/// `modelDescription.xml`.
fn description(
    head: &Head<'_>,
    variables: &[(&String, &Variable, bool)],
    sim: &Simulation,
) -> String {
    let mut units: BTreeMap<String, [i8; 8]> = BTreeMap::new();
    let unit_of = |v: &Variable| -> Option<(String, [i8; 8])> {
        let unit = Measure::parse(&v.unit).ok().filter(|u| *u != Measure::ANY)?;
        let si = Measure { exponents: unit.exponents, scale: 1.0, offset: 0.0 };
        (unit.exponents != [0; 8]).then(|| (si.to_string(), unit.exponents))
    };
    units.extend(variables.iter().filter_map(|(_, v, _)| unit_of(v)));
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let saves = head.saves;
    // Writing to a String cannot fail.
    let mut line = |text: std::fmt::Arguments<'_>| {
        let _ = xml.write_fmt(text);
        xml.push('\n');
    };
    line(format_args!(
        "<fmiModelDescription fmiVersion=\"3.0\" modelName=\"{}\" instantiationToken=\"{}\" \
         description=\"{}\" generationTool=\"Linkwork {}\" variableNamingConvention=\"flat\">",
        escaped(head.title),
        escaped(head.token),
        escaped(head.doc),
        env!("CARGO_PKG_VERSION")
    ));
    line(format_args!(
        "  <CoSimulation modelIdentifier=\"{}\" canHandleVariableCommunicationStepSize=\"true\" \
         fixedInternalStepSize=\"{}\" canGetAndSetFMUState=\"{saves}\" canSerializeFMUState=\"{saves}\"/>",
        head.identifier, head.step
    ));
    if !units.is_empty() {
        line(format_args!("  <UnitDefinitions>"));
        for (name, exponents) in &units {
            let base: String = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"]
                .iter()
                .zip(exponents)
                .filter(|(_, e)| **e != 0)
                .map(|(symbol, e)| format!(" {symbol}=\"{e}\""))
                .collect();
            line(format_args!("    <Unit name=\"{name}\"><BaseUnit{base}/></Unit>"));
        }
        line(format_args!("  </UnitDefinitions>"));
    }
    let stop = head.until.map(|t| format!(" stopTime=\"{t}\"")).unwrap_or_default();
    line(format_args!("  <DefaultExperiment startTime=\"0\"{stop} stepSize=\"{}\"/>", head.step));
    line(format_args!("  <ModelVariables>"));
    line(format_args!(
        "    <Float64 name=\"time\" valueReference=\"0\" causality=\"independent\" variability=\"continuous\"/>"
    ));
    for (k, (path, v, input)) in variables.iter().enumerate() {
        let boolean = v.kind == PortKind::Bool;
        let kind = if boolean { "Boolean" } else { "Float64" };
        let causality = if *input { "input" } else { "output" };
        let variability = if boolean { "discrete" } else { "continuous" };
        let unit = unit_of(v).filter(|_| !boolean);
        let unit = unit.map(|(name, _)| format!(" unit=\"{name}\"")).unwrap_or_default();
        let start = match (*input, boolean) {
            (false, _) => String::new(),
            (true, true) => format!(" start=\"{}\"", sim.value(v.place) > 0.5),
            (true, false) => format!(" start=\"{}\"", sim.value(v.place)),
        };
        line(format_args!(
            "    <{kind} name=\"{}\" valueReference=\"{}\" causality=\"{causality}\" \
             variability=\"{variability}\"{unit}{start} description=\"{}\"/>",
            escaped(path),
            k + 1,
            escaped(&v.doc)
        ));
    }
    line(format_args!("  </ModelVariables>"));
    line(format_args!("  <ModelStructure>"));
    for tag in ["Output", "InitialUnknown"] {
        for (k, _) in variables.iter().enumerate().filter(|(_, (_, _, input))| !input) {
            line(format_args!("    <{tag} valueReference=\"{}\"/>", k + 1));
        }
    }
    line(format_args!("  </ModelStructure>"));
    line(format_args!("</fmiModelDescription>"));
    xml
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_made_safe() {
        assert_eq!(identifier("bouncing ball"), "bouncing_ball");
        assert_eq!(identifier("../2"), "unit____2");
    }
}
