//! Compilation of a flat specification into a plan. All faults are collected, so that one fault does not hide another.
//!
//! ```text
//! services → models (parameters) → lanes → wires and bindings → one driver per input →
//! reductions → variability → order (or the loop, wire by wire) → tick base and table → plan
//! ```
//! Nothing depends on the order of the specification: parts are taken by path (rule 6 of ARCHITECTURE.md).

mod arrivals;
mod bindings;
mod connect;
mod connections;
mod connectors;
mod delays;
mod fields;
mod find;
mod flat;
mod guards;
mod made;
mod order;
mod part;
pub(crate) mod program;
mod settings;
mod solved;
mod table;
mod variables;

use crate::author::binding::BindSpec;
use crate::author::block::Wiring;
use crate::author::catalogue::{Catalogue, Entry};
use crate::author::files::Files;
use crate::author::host::{HostWire, Lowering};
use crate::author::model::lanes;
use crate::author::noise;
use crate::author::params::ReadCx;
use crate::author::services::{Contradiction, ServiceKind, Services};
use crate::author::setting::{Setting, without_effect};
use crate::author::time::Seconds;
use crate::author::value::{Fault, Faults, Origin};
use crate::plan::compiled::{FieldPlan, Identity, PartPlan, Plan, Sizes};
use crate::plan::spec::{Accuracy, PartSpec, Spec};
use guards::{WatchedSpec, WhenSpec};
use part::Part;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
pub use variables::known_variables;

/// Compiles a specification. O(n log n) in the number of parts and wires.
///
/// # Errors
/// Every fault of the specification, in the order of the files.
pub fn compile(spec: &Spec, catalogue: &Catalogue, files: &Files) -> Result<Plan, Faults> {
    let mut plan = compile_phase(spec, &Within::default(), catalogue, files)?;
    let settings = settings_of(spec, &plan);
    warn_without_effect(&[settings], &mut plan);
    Ok(plan)
}

/// Returns the settings of the mechanism and the parts of a phase that may have no effect.
pub(crate) fn settings_of(spec: &Spec, plan: &Plan) -> Vec<Setting> {
    let of_host = spec.host.as_ref().map(|h| h.settings()).unwrap_or_default();
    of_host.into_iter().chain(plan.settings.iter().cloned()).collect()
}

/// Adds warnings of settings that have no effect in any phase to the plan of the first one.
pub(crate) fn warn_without_effect(phases: &[Vec<Setting>], first: &mut Plan) {
    first.warnings.extend(without_effect(phases));
    first.warnings = in_file_order(std::mem::take(&mut first.warnings));
}

/// Data of the program that a phase uses.
#[derive(Default)]
pub(crate) struct Within<'a> {
    /// The conditions at which the phase ends.
    pub whens: Vec<WhenSpec<'a>>,
    /// The conditions that the run monitors.
    pub watches: Vec<WatchedSpec<'a>>,
    /// A tick of which all phases' ticks are multiples, so that one count of ticks serves the whole run.
    pub tick: Option<Seconds>,
}

/// Compiles one phase of a program.
pub(crate) fn compile_phase(
    spec: &Spec,
    within: &Within<'_>,
    catalogue: &Catalogue,
    files: &Files,
) -> Result<Plan, Faults> {
    let mut faults = Vec::new();
    if spec.step.num == 0 {
        faults.push(
            Fault::new(Origin::NONE, "the integration step is zero")
                .help("write e.g. step: \"1 ms\""),
        );
        return Err(Faults(faults));
    }
    let entries = find_entries(spec, catalogue, &mut faults);
    let mut part_settings = Vec::new();
    let services = build_services(spec, &entries, files, (&mut faults, &mut part_settings));
    let mut warnings = Vec::new();
    let told = (&mut faults, &mut warnings, &mut part_settings);
    let mut parts = build_models(spec, &entries, &services, files, told);
    let own = bindings::own(&parts);
    let with_own;
    let spec = if own.is_empty() {
        spec
    } else {
        with_own = Spec { binds: [spec.binds.clone(), own].concat(), ..spec.clone() };
        &with_own
    };
    let built: BTreeSet<&str> = parts.iter().map(|p| p.spec.path.as_str()).collect();
    let serving: BTreeSet<&str> = services.iter().map(|(path, _)| path).collect();
    let absent: BTreeMap<&str, bool> = (spec.parts.iter().map(|p| p.path.as_str()))
        .filter(|path| !built.contains(path))
        .map(|path| (path, serving.contains(path)))
        .collect();
    let host_spec = bindings::host_spec(spec);
    let delays = delays::split(spec);
    let mut lowering = Lowering { wires: Vec::new(), faults: &mut faults, warnings: &mut warnings };
    let host = bindings::bind(spec, &parts, &absent, &services, &mut lowering);
    let bound = lowering.wires;
    if let (Some(prototype), Some(spec)) = (host, &host_spec) {
        bindings::add_host(&mut parts, spec, prototype);
    }
    delays.add(&mut parts, &mut faults);
    let fields = fields::join(spec, &mut parts, &absent, &mut faults);
    let sizes = layout(&mut parts, spec.seed);
    let hosted = spec.host.iter().flat_map(|h| bound.iter().map(|wire| (h.path(), wire)));
    let hosted: Vec<(&str, &HostWire)> =
        hosted.chain(fields.wires.iter().map(|(field, wire)| (field.as_str(), wire))).collect();
    let mut connections =
        connect::connect((spec, &delays.wires), &parts, absent, &hosted, sizes, &mut faults);
    part_settings.append(&mut connections.settings);
    bindings::uncommanded(&parts, &connections, &mut warnings);
    bindings::untaken(&parts, &connections, &mut warnings);
    table::rates(spec, &mut parts, within.tick, &mut faults);
    if !faults.is_empty() {
        return Err(Faults(in_file_order(faults)));
    }
    for (part, (u, ud)) in parts.iter_mut().zip(&connections.inputs) {
        part.wiring.u = u.iter().copied().collect();
        part.wiring.ud = ud.iter().copied().collect();
        if let Err(fault) = part.prototype.settle(&part.wiring) {
            return Err(Faults(vec![fault]));
        }
    }
    let order = order::order(&parts, &connections).map_err(|f| Faults(in_file_order(f)))?;
    let fields = fields.plans(&parts);
    let timing = table::table(spec, &parts, within.tick, &order, &fields)
        .map_err(|f| Faults(in_file_order(f)))?;
    let variables = Arc::new(variables::variables(&parts, &connections, &order.loops));
    let sizes = Sizes { sig: connections.signals + order.work, ..connections.sizes };
    guards::hold(&mut parts, &connections, &order);
    let watched = (&within.whens[..], &within.watches[..]);
    let watch = guards::guards(watched, &parts, &connections, &order, &variables)
        .map_err(|f| Faults(in_file_order(f)))?;
    let links = std::mem::take(&mut connections.links);
    let wires = connect::listing(links, &parts, &order);
    let integration = settings::integration(spec, &parts, &variables, sizes.x)
        .map_err(|f| Faults(in_file_order(f)))?;
    let world = (&services, files, &fields[..]);
    let identity = identity(spec, &parts, sizes, &timing, world, &within.whens);
    let with = |test: &dyn Fn(&Part<'_>) -> bool| -> Vec<u32> {
        (0..parts.len() as u32).filter(|&k| test(&parts[k as usize])).collect()
    };
    let averages = parts.iter().any(|p| p.prototype.description().functions.averages);
    let stored = with(&|p| p.prototype.stored());
    let steps = with(&|p| p.prototype.description().functions.steps);
    let rearranged = with(&|p| p.prototype.rearranges());
    let positioned = with(&|p| !p.prototype.description().positions.is_empty());
    let moved = with(&|p| {
        let d = p.prototype.description();
        !d.positions.is_empty() || d.functions.steps
    });
    Ok(Plan {
        rest: None,
        warnings: in_file_order(warnings),
        settings: part_settings,
        stored,
        fields,
        positions: settings::lanes_of(&parts, |d, x| x + d.positions.start..x + d.positions.end),
        turning: settings::turning(&parts),
        still: settings::lanes_of(&parts, |d, x| match d.functions.derivatives {
            true => 0..0,
            false => x..x + lanes(&d.continuous),
        }),
        stepped: settings::lanes_of(&parts, |d, x| match d.functions.steps {
            true => x..x + lanes(&d.continuous),
            false => 0..0,
        }),
        stepped_outputs: settings::stepped_outputs(&parts),
        steps,
        manifold: moved,
        rearranged,
        positioned,
        guards: watch.guards,
        guarded: watch.guarded,
        conditions: watch.conditions,
        guard_ops: watch.ops,
        located: watch.located,
        moded: watch.moded,
        averages: integration.control.is_none() && averages,
        watches: within.watches.len() as u32,
        asked: settings::asked(&parts, &services),
        parts: parts
            .into_iter()
            .map(|p| PartPlan {
                path: p.spec.path.clone(),
                model: p.spec.model.clone(),
                origin: p.spec.origin,
                prototype: p.prototype,
                rate: (p.wiring.period > 0).then_some(p.spec.rate).flatten(),
                wiring: p.wiring,
            })
            .collect(),
        services,
        sizes,
        stage_ops: order.stage_ops(),
        continuous_ops: order.unsampled(),
        derivs: order.derivs.clone(),
        flow: order.flow,
        ops: order.ops,
        works: timing.works,
        table: timing.rows,
        base: timing.base,
        step: spec.step,
        integration,
        seed: spec.seed,
        lanes: variables.clone(),
        variables,
        constants: connections.constants,
        wires,
        sums: connections.sums,
        loops: order.loops,
        identity,
    })
}

/// Returns the faults of models and services in their names and parameters, for the report on a specification that has other faults and cannot be
/// compiled.
pub fn check_parts(spec: &Spec, catalogue: &Catalogue, files: &Files) -> Vec<Fault> {
    let mut faults = Vec::new();
    let entries = find_entries(spec, catalogue, &mut faults);
    let services = build_services(spec, &entries, files, (&mut faults, &mut Vec::new()));
    let told = (&mut faults, &mut Vec::new(), &mut Vec::new());
    build_models(spec, &entries, &services, files, told);
    faults
}

/// Returns the parts by path with their entries in the catalogue.
fn find_entries<'a>(
    spec: &'a Spec,
    catalogue: &'a Catalogue,
    faults: &mut Vec<Fault>,
) -> Vec<(&'a PartSpec, &'a Entry)> {
    let mut specs: Vec<&PartSpec> = spec.parts.iter().collect();
    specs.sort_by(|a, b| a.path.cmp(&b.path));
    for pair in specs.windows(2) {
        if pair[0].path == pair[1].path {
            faults.push(
                Fault::new(pair[1].origin, format!("there are two parts `{}`", pair[1].path))
                    .help("rename one of them"),
            );
        }
    }
    specs
        .into_iter()
        .filter_map(|p| match catalogue.find(&p.model, p.model_origin, &p.path) {
            Ok(entry) => Some((p, entry)),
            Err(fault) => {
                faults.push(fault);
                None
            }
        })
        .collect()
}

/// Sorts faults by file and place; faults without a place come last.
fn in_file_order(mut faults: Vec<Fault>) -> Vec<Fault> {
    faults.sort_by_key(|f| f.origin);
    faults.dedup();
    faults
}

fn build_services(
    spec: &Spec,
    entries: &[(&PartSpec, &Entry)],
    files: &Files,
    (faults, settings): (&mut Vec<Fault>, &mut Vec<Setting>),
) -> Services {
    let mut services = Services::with_host(spec.host.as_ref().and_then(|h| h.service()));
    // A service of such a kind (the world) is built before the others, which may read it.
    let is_world = |e: &Entry| e.service_kind().is_some_and(ServiceKind::is_first);
    let worlds: Vec<_> = entries.iter().filter(|(_, e)| is_world(e)).collect();
    let stated = |part: &PartSpec| format!("{} {}", part.model, part.params.value);
    for (other, _) in worlds.iter().skip(1).filter(|(p, _)| stated(p) != stated(worlds[0].0)) {
        let (one, two) = (&worlds[0].0.path, &other.path);
        for (part, at) in [(worlds[0].0, two), (*other, one)] {
            let fact = format!("`{}` and `{at}` describe two different worlds", part.path);
            let help = "a simulation has one world: write it once, or twice with the same values";
            faults.push(Fault::new(part.origin, fact).help(help));
        }
    }
    let rest = entries.iter().filter(|(_, e)| e.service_kind().is_some() && !is_world(e));
    let mut world_text = String::new();
    for (part, entry) in worlds.first().into_iter().copied().chain(rest) {
        let files = files.first(part.folder.as_deref());
        let mut cx = ReadCx::new(&part.path, &services);
        let object = made::service(part, entry, (&world_text, &files), &mut cx);
        let found = std::mem::take(&mut cx.faults);
        settings.append(&mut placed(std::mem::take(&mut cx.settings), part));
        if let Some(object) = object {
            services.add(&part.path, object);
        } else if let Some(kind) = entry.service_kind() {
            services.failed.push((part.path.clone(), kind));
        }
        if is_world(entry) {
            world_text = format!("{} {:?}", stated(part), made::read_by(part, &files));
        }
        faults.append(&mut located(found, part));
    }
    for Contradiction { path, fact, help } in services.contradictions() {
        let origin = entries.iter().find(|(p, _)| p.path == path).map(|(p, _)| p.origin);
        let fault = Fault::new(origin.unwrap_or(Origin::NONE), format!("`{path}`: {fact}"));
        faults.push(fault.help(help));
    }
    services
}

/// Returns whether all coordinates to which a part binds are lengths.
fn slides(spec: &Spec, part: &PartSpec) -> bool {
    let own = spec.binds.iter().filter(|b| b.part == part.path);
    let of = |b: &BindSpec| spec.host.as_ref().and_then(|host| host.slides(&b.target));
    let kinds: Vec<bool> = own.filter_map(of).collect();
    !kinds.is_empty() && kinds.into_iter().all(|slides| slides)
}

fn build_models<'a>(
    spec: &Spec,
    entries: &[(&'a PartSpec, &Entry)],
    services: &Services,
    files: &Files,
    (faults, warnings, settings): (&mut Vec<Fault>, &mut Vec<Fault>, &mut Vec<Setting>),
) -> Vec<Part<'a>> {
    let mut parts = Vec::new();
    let site = services.rotating();
    for (part, entry) in entries.iter().filter(|(_, e)| e.service_kind().is_none()) {
        let mut cx = ReadCx::new(&part.path, services);
        cx.files = files.first(part.folder.as_deref());
        cx.slides = slides(spec, part);
        if let Some(prototype) = entry.make_model(&part.params, &mut cx) {
            if let (true, Some(site)) = (prototype.description().inertial, site) {
                let fact = format!(
                    "`{}` ({}) assumes that W is inertial, but according to `{site}` it is a site on a planet",
                    part.path, part.model
                );
                let help = "remove the part, or remove `site` from `world`";
                faults.push(Fault::new(part.origin, fact).help(help));
            }
            let asks = std::mem::take(&mut cx.asked);
            parts.push(Part { spec: part, prototype, wiring: Wiring::default(), asks });
        }
        faults.append(&mut located(cx.faults, part));
        warnings.append(&mut located(cx.warnings, part));
        settings.append(&mut placed(cx.settings, part));
    }
    parts
}

/// Settings without a source position receive the position of the part.
fn placed(mut settings: Vec<Setting>, part: &PartSpec) -> Vec<Setting> {
    for setting in settings.iter_mut().filter(|s| s.origin == Origin::NONE) {
        setting.origin = part.origin;
    }
    settings
}

/// Faults without a source position receive the position of the part.
fn located(mut faults: Vec<Fault>, part: &PartSpec) -> Vec<Fault> {
    for fault in &mut faults {
        if fault.origin == Origin::NONE {
            fault.origin = part.origin;
        }
    }
    faults
}

/// Gives every part its lanes, in path order.
fn layout(parts: &mut [Part<'_>], seed: u64) -> Sizes {
    let mut sizes = Sizes::default();
    for part in parts.iter_mut() {
        let d = part.prototype.description();
        let w = &mut part.wiring;
        (w.x, w.d, w.ym) = (sizes.x, sizes.d, sizes.sig);
        w.yd = w.ym + lanes(&d.outputs);
        w.key = noise::key(seed, &part.spec.path);
        sizes.x += lanes(&d.continuous);
        sizes.d += lanes(&d.discrete);
        sizes.sig = w.yd + lanes(&d.feedthrough_outputs);
    }
    sizes
}

fn identity(
    spec: &Spec,
    parts: &[Part<'_>],
    sizes: Sizes,
    timing: &table::Timing,
    (services, files, fields): (&Services, &Files, &[FieldPlan]),
    whens: &[WhenSpec<'_>],
) -> Identity {
    // The identity must not depend on the place where a tolerance is written, because the resolved
    // text has it at another place.
    let accuracy = spec.accuracy.clone().map(|a| {
        let of = a.of.into_iter().map(|(pattern, value, _)| (pattern, value, Origin::NONE));
        Accuracy { of: of.collect(), ..a }
    });
    let before = format!(
        "{sizes:?} {} {:?} {:?} {} {}\n",
        spec.step,
        spec.integrator,
        accuracy,
        timing.base,
        timing.rows.len()
    );
    let mut after = String::new();
    // The parameters of services, and the content of the files that were read, belong to the
    // identity.
    let serving: BTreeSet<&str> = services.iter().map(|(path, _)| path).collect();
    for part in spec.parts.iter().filter(|p| serving.contains(p.path.as_str())) {
        after += &format!("{} {} {}\n", part.path, part.model, part.params.value);
    }
    if let Ok(found) = files.found.lock() {
        after += &format!("{found:?}\n");
    }
    for field in fields {
        after += &format!("{field:?}\n");
    }
    let is_read = |kind: ServiceKind| {
        let params = parts.iter().flat_map(|p| &p.prototype.description().params);
        params.into_iter().any(|spec| spec.kind == kind.text())
    };
    after += &services.fingerprint_of_host(is_read);
    for when in whens {
        after += &format!("{} {}\n", when.to, when.when);
    }
    Identity::new(before, after)
}
