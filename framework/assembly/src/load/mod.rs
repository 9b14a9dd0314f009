//! Loading: a file or text is converted to a flat `Spec` and the settings of the simulation.
mod format;
pub(crate) mod library;
mod place;
mod resolved;
mod unread;

pub use format::schema;
pub use place::{dotted, place_machines};
pub use resolved::Resolved;

use crate::body::shapes::BodyShape;
use crate::expand::assemblies::Assemblies;
use crate::expand::expander::{Expander, Unmatched};
use crate::expand::tree::{TreeNode, tree};
use crate::form::assembly::{self, AssemblyForm, PartForm, PartKind};
use crate::form::phases;
use crate::form::settings::{self, Settings, SettingsForm};
use crate::machine::import::Import;
use crate::mechanism;
use crate::schema::read::{fields, text_field};
use crate::schema::record::Record;
use crate::scope::parameters::substitute;
use crate::text::files::{Files, Home};
use crate::text::parse::parse;
use crate::text::parsed::Parsed;
use crate::text::patterns::misspelt;
use crate::text::report::{Cx, tidy};
use crate::text::show::Failure;
use crate::text::value::{Text, empty_map, is_unknown, set, sort};
use crate::wiring::parts::{binds, parts};
use crate::wiring::wires::Wiring;
use linkwork_collision::{Colliders, VisualShape};
use linkwork_formats::{mesh_corners, whole_text};
use linkwork_plant::{MechanismSpec, SpecExt};
use linkwork_runtime::{
    Catalogue, Fault, Faults, Integrator, Located, Origin, PhaseSpec, Program, Setting, Sources,
    Spec, Value, WatchSpec,
};
use linkwork_solvers::FixedValues;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Context of loading.
#[derive(Clone)]
pub struct Options<'a> {
    /// Models and services.
    pub catalogue: &'a Catalogue,
    /// Assemblies in the program: path → text.
    pub embedded: Arc<BTreeMap<String, String>>,
    /// Folders in which files are searched, after the folder of the file that uses them.
    pub search: Vec<PathBuf>,
    /// `PATH=VALUE`: overrides from outside; the last one wins.
    pub overrides: Vec<String>,
    /// Replaces the seed of the file.
    pub seed: Option<u64>,
    /// Cache of parsed texts that several loads share; it does not affect the result.
    pub parsed: Option<Arc<Parsed>>,
}

impl<'a> Options<'a> {
    /// Options with only a catalogue.
    pub fn new(catalogue: &'a Catalogue) -> Self {
        Options {
            catalogue,
            embedded: Arc::default(),
            search: Vec::new(),
            overrides: Vec::new(),
            seed: None,
            parsed: None,
        }
    }

    /// Adds an embedded assembly.
    #[must_use]
    pub fn embed(mut self, path: impl Into<String>, text: impl Into<String>) -> Self {
        Arc::make_mut(&mut self.embedded).insert(path.into(), text.into());
        self
    }

    /// Adds an override from outside: `Rover.Motor.resistance=0.7 ohm`.
    #[must_use]
    pub fn set(mut self, path_value: impl Into<String>) -> Self {
        self.overrides.push(path_value.into());
        self
    }
}

/// A loaded simulation, for `compile`.
#[derive(Clone)]
pub struct Loaded {
    /// Parts, wires, bindings and mechanism of the phase in which a run begins.
    pub spec: Spec,
    /// All phases, the start phase first; a simulation without phases has one.
    pub phases: Vec<PhaseSpec>,
    /// Everything else.
    pub simulation: Settings,
    /// Visual shapes of the bodies in the phase in which a run begins.
    pub shapes: Vec<BodyShape>,
    /// Colliding ground without a visual shape.
    pub grounds: Vec<BodyShape>,
    /// Visual shapes of each phase, in the order of `phases`.
    pub phase_shapes: Vec<Vec<BodyShape>>,
    /// Collision shapes, also for queries; contact also needs `contact`.
    pub colliders: Option<Arc<Colliders>>,
    /// Position of the first collision shape in the file.
    pub(crate) collides: Option<Origin>,
    /// Imported files, and what was omitted or ignored of them.
    pub imports: Vec<Import>,
    /// The assembly tree.
    pub tree: TreeNode,
    /// The texts to which origins refer.
    pub sources: Sources,
    /// One RON text with everything included, expanded and overridden: it loads to the same `spec` without other files.
    pub resolved: Resolved,
    /// Warnings about integrators that contact by impulses replaces.
    pub(crate) replaced: Vec<Fault>,
    /// Embedded texts for files in parameters that are not in any folder.
    pub(crate) embedded: Arc<BTreeMap<String, String>>,
}

impl Loaded {
    /// Compiles all phases.
    ///
    /// # Errors
    /// All faults of all phases.
    pub fn compile(
        &self,
        catalogue: &Catalogue,
        files: &linkwork_runtime::Files,
    ) -> Result<Program, Faults> {
        let files = files.clone().with(self.embedded.clone());
        linkwork_runtime::compile_program(&self.phases, catalogue, &files)
    }

    /// Returns a fault for each mesh file that viewers cannot show. Missing files are reported where they are used.
    fn unreadable_meshes(&self) -> Vec<Fault> {
        let mut seen = std::collections::BTreeSet::new();
        let files = self.shapes.iter().filter_map(|s| match &s.shape {
            VisualShape::File { file, .. } => Some((&s.body, file)),
            VisualShape::Shape(_) => None,
        });
        let unread = files.filter_map(|(body, file)| {
            let path = std::path::Path::new(file);
            let why = (seen.insert(file) && path.is_file()).then(|| mesh_corners(path).err());
            let fact = format!("the mesh `{file}` of `{body}` cannot be shown: {}", why??);
            let help =
                "supported meshes are STL, OBJ, COLLADA, glTF and MSH files; the simulation runs without it";
            Some(Fault::new(Origin::NONE, fact).help(help))
        });
        unread.collect()
    }

    /// Returns warnings about unsupported content of imported files, reported at their `import`; integrators that contact replaces; mesh files that
    /// cannot be shown; shapes that do not collide with the world because of a hinge; and collision shapes without `contact` in any phase.
    #[must_use]
    pub fn warnings(&self) -> Vec<Fault> {
        let mut all: Vec<Fault> = self.imports.iter().flat_map(Import::warnings).collect();
        all.extend(self.replaced.iter().cloned());
        all.extend(self.unreadable_meshes());
        // A shape that passes through the world in one phase but collides in another is intended.
        let machines = || self.phases.iter().filter_map(|p| p.spec.mechanism());
        let passing = machines().flat_map(MechanismSpec::passing);
        for found in passing.filter(|f| !machines().any(|m| m.meets(&f.colliders))) {
            if all.iter().all(|w: &Fault| w.message != found.warning.message) {
                all.push(found.warning);
            }
        }
        let touches = |p: &PhaseSpec| {
            p.spec.mechanism().is_some_and(|m| {
                m.contact.is_some() || m.compliant.is_some() || m.kinematic.is_some()
            })
        };
        if let (Some(colliders), Some(origin)) = (&self.colliders, self.collides)
            && !self.phases.iter().any(touches)
        {
            let n = colliders.len();
            let fact = format!(
                "{n} {}, but there is no `contact`, so nothing collides",
                match n {
                    1 => "shape collides",
                    _ => "shapes collide",
                }
            );
            let help = "write `contact: ()` in the simulation, or remove `collide` and `colliders`";
            all.push(Fault::new(origin, fact).help(help));
        }
        all
    }
}

/// Loads a simulation or an assembly from a file, or from the embedded texts.
///
/// # Errors
/// All mistakes.
pub fn load_file(path: impl AsRef<Path>, options: &Options<'_>) -> Result<Loaded, Failure> {
    let path = path.as_ref();
    let name = path.display().to_string();
    match whole_text(path) {
        Ok(text) => {
            let folder = path.parent().map_or_else(PathBuf::new, Path::to_path_buf);
            load(&name, text, Home::Folder(folder), options)
        }
        Err(error) => match options.embedded.get(&name) {
            Some(text) => {
                let folder = name.rsplit_once('/').map_or(String::new(), |(f, _)| format!("{f}/"));
                load(&name, text.clone(), Home::Embedded(folder), options)
            }
            None => {
                let known: Vec<&str> = options.embedded.keys().map(String::as_str).collect();
                let fault = Fault::new(Origin::NONE, format!("`{name}` cannot be read: {error}"))
                    .help(linkwork_runtime::remedy(&name, "embedded files", &known));
                Err(Failure { faults: vec![fault], sources: Sources::default() })
            }
        },
    }
}

/// Loads a simulation or an assembly from a text; other files are the embedded ones.
///
/// # Errors
/// All mistakes.
pub fn load_text(name: &str, text: &str, options: &Options<'_>) -> Result<Loaded, Failure> {
    load(name, text.to_string(), Home::Embedded(String::new()), options)
}

/// Reads any text in RON, for file formats of other programs. The positions in the value refer to the returned sources.
///
/// # Errors
/// Syntax errors, and duplicate keys.
pub fn read_value(name: &str, text: &str) -> Result<(Located, Sources), Failure> {
    let mut cx = Cx::default();
    let file = cx.sources.add(name, text);
    match parse(&mut cx, file) {
        Some(value) if cx.faults.is_empty() => Ok((value, cx.sources)),
        _ => Err(Failure { faults: tidy(cx.faults), sources: cx.sources }),
    }
}

fn load(name: &str, text: String, home: Home, options: &Options<'_>) -> Result<Loaded, Failure> {
    let mut cx = Cx { parsed: options.parsed.clone(), ..Cx::default() };
    let file = cx.sources.add(name, text);
    let loaded = parse(&mut cx, file).and_then(|v| whole(&mut cx, name, v, home, options));
    loaded_or_faults(cx, loaded)
}

/// Loads a value that a program has built, as if it had been parsed, and reports `faults` with the faults of the value. Files that
/// the value names are found among the embedded texts and in the folders of `options`.
pub(crate) fn load_value(
    name: &str,
    value: Located,
    faults: Vec<Fault>,
    options: &Options<'_>,
) -> Result<Loaded, Failure> {
    let mut cx = Cx { faults, ..Cx::default() };
    let loaded = whole(&mut cx, name, value, Home::Embedded(String::new()), options);
    loaded_or_faults(cx, loaded)
}

/// Returns the loaded simulation, or all faults when there is one.
fn loaded_or_faults(mut cx: Cx, loaded: Option<Loaded>) -> Result<Loaded, Failure> {
    match loaded {
        Some(mut loaded) if cx.faults.is_empty() => {
            loaded.sources = cx.sources;
            Ok(loaded)
        }
        _ => {
            // Phases share most of a file, so equal mistakes in several phases are reported once.
            let mut told = std::collections::BTreeSet::new();
            let faults = std::mem::take(&mut cx.faults);
            let faults = faults.into_iter();
            let faults = faults.filter(|f| told.insert((cx.place(f.origin), f.message.clone())));
            let faults = faults.collect();
            Err(Failure { faults: tidy(faults), sources: cx.sources })
        }
    }
}

/// Converts `rovers/rocker_bogie.ron` to `RockerBogie`.
fn camel(name: &str) -> String {
    let stem = name.rsplit('/').next().unwrap_or(name);
    let stem = stem.strip_suffix(".ron").unwrap_or(stem);
    let pieces = stem.split(|c: char| !c.is_alphanumeric()).filter(|p| !p.is_empty());
    let upper = |p: &str| {
        let mut chars = p.chars();
        let first = chars.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
        first + chars.as_str()
    };
    let joined: String = pieces.map(upper).collect();
    if joined.is_empty() { "Assembly".into() } else { joined }
}

/// A part that is an assembly file.
fn file_part(assembly: Text, mounts: Located, origin: Origin) -> PartForm {
    let kind = PartKind::File { assembly, mounts, overrides: empty_map(), stowed: None };
    PartForm { kind, params: empty_map(), array: None, doc: String::new(), origin }
}

fn whole(cx: &mut Cx, name: &str, v: Located, home: Home, options: &Options<'_>) -> Option<Loaded> {
    let (kind, mut inner) = match v.value {
        Value::Variant(kind, inner) if kind == "Simulation" || kind == "Assembly" => (kind, *inner),
        ref other => {
            let found = match other {
                Value::Variant(kind, _) => format!("`{kind}(..)`"),
                other => other.what().to_string(),
            };
            let help = match other {
                Value::Variant(kind, _) if kind == "Campaign" => {
                    "run a campaign with the command `campaign` instead of `run`"
                }
                _ => "begin the file with `Simulation(` or `Assembly(`",
            };
            cx.fault(
                v.origin,
                format!("`{name}` contains {found}, which is not a simulation"),
                help,
            );
            return None;
        }
    };
    // A resolved text does not have parameters of assemblies, so add a remark to the error.
    let remark = is_resolved(&inner).then_some(RESOLVED);
    if remark.is_some() {
        // The first run has reported settings without an effect.
        inner.by_default();
    }
    if kind == "Assembly" {
        let mut unmatched = Vec::new();
        let file = (&*kind, inner, v.origin);
        let single = single(cx, name, file, home, options, &mut unmatched);
        tell_unmatched(cx, unmatched, 1, remark);
        let (mut loaded, resolved) = single?;
        let (spec, origin) = (loaded.spec.clone(), Origin::NONE);
        let only = PhaseSpec {
            name: String::new(),
            spec,
            transitions: Vec::new(),
            watches: Vec::new(),
            origin,
        };
        loaded.phases = vec![only];
        loaded.phase_shapes = vec![loaded.shapes.clone()];
        loaded.resolved = Resolved::new(resolved);
        return Some(loaded);
    }
    let all = phases::split(cx, inner);
    let (mut compiled, mut unmatched, phases) = (Vec::new(), Vec::new(), all.len());
    for phase in all {
        let phases::Phase { name: phase, file, transitions, origin } = phase;
        let file = (&*kind, file, v.origin);
        let one = single(cx, name, file, home.clone(), options, &mut unmatched);
        compiled.extend(one.map(|(loaded, text)| (phase, loaded, text, transitions, origin)));
    }
    tell_unmatched(cx, unmatched, phases, remark);
    if !cx.faults.is_empty() {
        return None;
    }
    let resolved = match &mut compiled[..] {
        [(name, _, value, ..)] if name.is_empty() => std::mem::replace(value, Value::Null),
        all => {
            let all: Vec<_> = all.iter().map(|(n, _, v, t, _)| (n.as_str(), v, t)).collect();
            resolved::with_phases(&all)
        }
    };
    let specs = compiled.iter().enumerate().map(|(k, (name, loaded, _, transitions, origin))| {
        let mut spec = loaded.spec.clone();
        // When a later phase begins, the bodies keep their positions.
        if let (Some(mechanism), true) = (spec.mechanism_mut(), k > 0) {
            mechanism.kept = FixedValues::default();
        }
        PhaseSpec {
            name: name.clone(),
            spec,
            transitions: transitions.clone(),
            watches: watches(&loaded.simulation),
            origin: *origin,
        }
    });
    let phases = specs.collect();
    let mut replaced: Vec<Fault> =
        compiled.iter().flat_map(|(_, loaded, ..)| loaded.replaced.iter().cloned()).collect();
    // Phases share data that none of them changes.
    replaced.dedup();
    let phase_shapes = compiled.iter().map(|(_, loaded, ..)| loaded.shapes.clone()).collect();
    let (_, loaded, ..) = compiled.into_iter().next()?;
    Some(Loaded { phases, phase_shapes, replaced, resolved: Resolved::new(resolved), ..loaded })
}

/// The conditions that every phase checks during a run: `stop_when`.
fn watches(file: &Settings) -> Vec<WatchSpec> {
    let stop = file.stop_when.iter().map(|when| WatchSpec {
        of: "stop_when".to_string(),
        when: when.text.clone(),
        origin: when.origin,
    });
    stop.collect()
}

/// Reports overrides from outside that match nothing in any phase, and parameters that the model of a phase does not have. Each message is that of
/// the phase that has most of the path.
fn tell_unmatched(
    cx: &mut Cx,
    unmatched: Vec<Unmatched>,
    phases: usize,
    remark: Option<&'static str>,
) {
    let mut by_path: BTreeMap<String, Vec<Unmatched>> = BTreeMap::new();
    for one in unmatched {
        by_path.entry(one.path.clone()).or_default().push(one);
    }
    let wrong = |all: &Vec<Unmatched>| all.len() == phases || all.iter().any(|u| u.has_model);
    for all in by_path.into_values().filter(wrong) {
        // Report the fault whose path matched the most levels; if several did, the first one.
        let deepest = all.into_iter().rev().max_by_key(|one| one.depth);
        cx.faults.extend(deepest.map(|mut one| {
            if let (Some(remark), false, Some(help)) = (remark, one.has_model, &mut one.fault.help)
            {
                *help = format!("{remark}. {help}");
            }
            one.fault
        }));
    }
}

/// The reason why overrides do not reach parameters of a resolved text.
const RESOLVED: &str = "this text is resolved: it holds the results, not the parameters of assemblies and of the simulation. \
                        To change parameters, load the original file: `linkwork fork CHECKPOINT --sim SIM --set PATH=VALUE`";

/// Whether the fields of a simulation are those of a resolved text.
fn is_resolved(fields: &Located) -> bool {
    fields.get("resolved").is_some_and(|r| r.value == Value::Bool(true))
}

/// One complete phase, before it is added to `phases`.
fn single(
    cx: &mut Cx,
    name: &str,
    (kind, mut inner, origin): (&str, Located, Origin),
    home: Home,
    options: &Options<'_>,
    unmatched: &mut Vec<Unmatched>,
) -> Option<(Loaded, Value)> {
    let near = Files { search: &options.search, embedded: &options.embedded, lenient: false };
    let mut files = Assemblies::new(near);
    let mut holder;
    if kind == "Assembly" {
        let (home, own) = files.of_fields(cx, &mut inner, name, &home)?;
        let part_name = own.name.clone().unwrap_or_else(|| camel(name));
        // An assembly without a simulation is attached to the world.
        let mounts = own.mounts.keys().map(|m| (m.clone(), Value::Text("world".into()).into()));
        let mounts: Located = Value::Map(mounts.collect()).into();
        files.own = Some((name.to_string(), home, own));
        holder = AssemblyForm::default();
        let origin = Origin { start: origin.start, end: origin.start + 8, ..origin };
        cx.alone = Some(origin);
        holder
            .parts
            .insert(part_name, file_part(Text { text: name.into(), origin }, mounts, origin));
        inner = empty_map();
    } else {
        fields(cx, &inner, "simulation", &settings::all_fields());
        holder = assembly::read_assembly(cx, &mut inner, "simulation");
        if let Some(assembly) = text_field(cx, &inner, "assembly", "simulation") {
            let part_name = holder.name.clone().unwrap_or_else(|| camel(&assembly.text));
            let origin = assembly.origin;
            if holder.parts.contains_key(&part_name) {
                let message =
                    format!("`{part_name}` is also the name of the simulation's assembly");
                cx.fault(origin, message, "set `name: \"..\"` for it");
            }
            holder.parts.insert(part_name, file_part(assembly, empty_map(), origin));
        }
    }
    files.files.lenient = is_resolved(&inner);
    let outer = outside(cx, &mut inner, &options.overrides, &holder);
    assemble(cx, &holder, inner, (home, files), (&outer, unmatched), options)
}

/// Overrides from the command line: settings are inserted into the map of the file, the others are returned.
fn outside(
    cx: &mut Cx,
    settings: &mut Located,
    overrides: &[String],
    holder: &AssemblyForm,
) -> Vec<(Text, Located)> {
    let mut out = Vec::new();
    for written in overrides {
        // All phases share one text, so that a mistake in it is reported once.
        let known = cx.sources.files.iter().position(|(n, text)| n == "--set" && text == written);
        let file = known.map_or_else(|| cx.sources.add("--set", written.clone()), |k| k as u32);
        let Some((path, value)) = written.split_once('=') else {
            let origin = Origin::in_file(file, 0, written.len() as u32);
            let message = format!("`--set {written}` has no `=`");
            cx.fault(
                origin,
                message,
                "write PATH=VALUE, for example Rover.Motor.resistance=\"0.7 ohm\"",
            );
            continue;
        };
        let start = path.len() as u32 + 1;
        let origin = Origin::in_file(file, start, written.len() as u32);
        let value = plain_value(value, origin);
        let path = path.trim();
        let segments: Vec<String> = path.split('.').map(str::to_string).collect();
        let first = segments[0].as_str();
        let taken = holder.parts.contains_key(first) || holder.params.contains_key(first);
        if !taken && SettingsForm::names().contains(&first) && first != "assembly" {
            if settings.value == Value::Null {
                *settings = empty_map();
            }
            set(settings, &segments, &value);
        } else {
            let origin = Origin::in_file(file, 0, path.len() as u32);
            out.push((Text { text: path.into(), origin }, value));
        }
    }
    out
}

/// Positions of the values of rejected parameters.
fn unknown(v: &Located, places: &mut Vec<Origin>) {
    match &v.value {
        Value::List(items) => items.iter().for_each(|i| unknown(i, places)),
        Value::Map(entries) => entries.iter().for_each(|(_, i)| unknown(i, places)),
        Value::Variant(_, inner) => unknown(inner, places),
        _ if is_unknown(v) => places.push(v.origin),
        _ => {}
    }
}

/// Returns a warning when contact by impulses advances the mechanism instead of the chosen integrator.
fn replaced(simulation: &Settings, origin: Origin) -> Option<Fault> {
    let names = Integrator::ALL;
    let (name, _) = names.iter().find(|(_, i)| *i == simulation.integrator)?;
    if simulation.integrator == Integrator::SemiImplicitEuler {
        return None;
    }
    let fact = format!(
        "`integrator: {name}` does not move the bodies: with `contact` they advance by semi-implicit Euler, once per step; the other states are integrated by {name}"
    );
    let help = "write `compliant: true` in `contact`, which the integrator handles, or `integrator: semi_implicit_euler`";
    Some(Fault::new(origin, fact).help(help))
}

/// Returns the setting `contact` of a simulation whose machines move by kinematics, which does not act.
fn rolled(origin: Origin) -> Setting {
    let reason = "`place` moves the machines without inertia: only their wheels meet the ground";
    let remedy = "remove `contact`, or write `motion: \"dynamics\"` in `place`";
    Setting {
        owner: "simulation".into(),
        name: "contact",
        origin,
        idle: Some((reason.into(), remedy.into())),
    }
}

/// A value from the command line: RON, or otherwise the text itself (`0.7 ohm`, `rk4`).
fn plain_value(text: &str, origin: Origin) -> Located {
    fn at(v: Located, origin: Origin) -> Located {
        let value = match v.value {
            Value::List(items) => Value::List(items.into_iter().map(|i| at(i, origin)).collect()),
            Value::Map(entries) => {
                Value::Map(entries.into_iter().map(|(k, i)| (k, at(i, origin))).collect())
            }
            Value::Variant(name, inner) => Value::Variant(name, Box::new(at(*inner, origin))),
            other => other,
        };
        Located { value, origin }
    }
    let mut scratch = Cx::default();
    let file = scratch.sources.add("", text);
    let value = match parse(&mut scratch, file) {
        Some(v) if scratch.faults.is_empty() => match v.value {
            Value::Variant(_, ref inner) if inner.value == Value::Null => {
                Value::Text(text.trim().into()).into()
            }
            _ => v,
        },
        _ => Value::Text(text.trim().into()).into(),
    };
    at(value, origin)
}

fn assemble(
    cx: &mut Cx,
    holder: &AssemblyForm,
    mut settings: Located,
    (home, files): (Home, Assemblies<'_>),
    (outer, unmatched): (&[(Text, Located)], &mut Vec<Unmatched>),
    options: &Options<'_>,
) -> Option<(Loaded, Value)> {
    let mut expander = Expander::new(cx, files, options.catalogue);
    let (root, env) = expander.root(holder, &home, outer);
    unmatched.append(&mut expander.unmatched);
    let (files, imports) = (expander.files.files, expander.imports);
    if let Value::Map(entries) = &mut settings.value {
        let known = SettingsForm::names();
        for (key, v) in entries.iter_mut().filter(|(k, _)| known.contains(&k.as_str())) {
            if key != "assembly" {
                *v = substitute(cx, &env, v);
            }
        }
    }
    if let Some(seed) = options.seed {
        let text = Value::Text(seed.to_string());
        if settings.value == Value::Null {
            settings = empty_map();
        }
        set(&mut settings, &["seed".to_string()], &text.into());
    }
    sort(&mut settings);
    let simulation = settings::read(cx, &settings);
    let integrator = settings.get("integrator").map(|i| i.origin);
    let parts = parts(cx, &root);
    let binds = binds(cx, &root);
    let gravity = simulation.gravity.as_ref().map(|g| g.text.clone());
    let place = simulation.gravity.as_ref().map_or(settings.origin, |g| g.origin);
    let mechanism = mechanism::mechanism(cx, &root, &files, &simulation.mechanism, gravity, place);
    let embedded = options.embedded.clone();
    let files_of_parts = linkwork_runtime::Files::of(options.search.clone()).with(embedded.clone());
    let wiring = Wiring {
        root: &root,
        catalogue: options.catalogue,
        files: files_of_parts.clone(),
        mechanism: &simulation.mechanism,
        found: Default::default(),
    };
    let wires = wiring.wires(cx);
    if !cx.faults.is_empty() {
        // Report errors of models about their parameters together with the errors of the file.
        let files = files_of_parts;
        let spec = Spec { parts, ..Spec::default() };
        let mut more = linkwork_runtime::check_parts(&spec, options.catalogue, &files);
        more.extend(misspelt(&simulation.patterns(), &spec, options.catalogue, &files));
        // Leave out consequences of a fault at the same position.
        let touches = |a: Origin, b: Origin| match a.call.or(b.call) {
            Some(_) => a.call == b.call,
            None => a.file == b.file && a.start < b.end && b.start < a.end,
        };
        let mut told: Vec<Origin> = cx.faults.iter().map(|f| f.origin).collect();
        spec.parts.iter().for_each(|p| unknown(&p.params, &mut told));
        cx.faults.extend(more.into_iter().filter(|f| !told.iter().any(|t| touches(*t, f.origin))));
        return None;
    }
    let kinematic = match &mechanism.spec {
        None => None,
        Some(m) => match place::kinematic(&simulation.place, &m.multibody) {
            Ok(kinematic) => kinematic,
            Err(fault) => {
                cx.faults.push(fault);
                return None;
            }
        },
    };
    let spec = Spec {
        parts,
        wires,
        binds,
        host: mechanism.spec.map(|mut m| {
            if kinematic.is_some() {
                // Machines without contact follow their rolling wheels.
                let any = m.contact.take().is_some() | m.compliant.take().is_some();
                // A rover from a library may have contact settings for simulations with forces.
                let written = root.contact.as_ref().filter(|_| any);
                m.settings = written.map(|contact| rolled(contact.origin)).into_iter().collect();
            }
            m.kinematic = kinematic;
            m.step = Some(simulation.step.seconds());
            Box::new(m) as Box<dyn linkwork_runtime::Host>
        }),
        step: simulation.step,
        integrator: simulation.integrator,
        accuracy: simulation.accuracy.clone(),
        seed: simulation.seed,
    };
    let impulses = spec.mechanism().is_some_and(|m| m.contact.is_some());
    let replaced = match integrator.filter(|_| impulses) {
        Some(origin) => replaced(&simulation, origin).into_iter().collect(),
        None => Vec::new(),
    };
    let tree = tree(&root, options.catalogue);
    let resolved = resolved::value(root, &files, &settings, &spec, &mechanism.told);
    let loaded = Loaded {
        embedded,
        tree,
        spec,
        phases: Vec::new(),
        simulation,
        phase_shapes: Vec::new(),
        shapes: mechanism.shapes,
        grounds: mechanism.grounds,
        colliders: mechanism.colliders,
        collides: mechanism.collides,
        imports,
        replaced,
        sources: Sources::default(),
        resolved: Resolved::new(Value::Null),
    };
    Some((loaded, resolved))
}
