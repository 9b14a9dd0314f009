//! From a flat specification to a plan. Every mistake is gathered; none hides another.
//!
//! ```text
//! services → models (parameters) → lanes → wires and bindings → one driver per input →
//! reductions → variability → order (or the loop, wire by wire) → tick base and table → plan
//! ```
//! Nothing depends on the order of the specification: parts are taken by path (law 6).

mod connect;
mod order;
mod table;
mod variables;

use crate::block::{Prototype, Wiring};
use crate::catalogue::{Catalogue, Entry};
use crate::mechanism::{MechanismPlan, MechanismWiring};
use crate::noise;
use crate::params::ReadCx;
use crate::plan::{PartPlan, Plan, Sizes};
use crate::services::{Files, Gravity, Services};
use crate::spec::{MechanismSpec, PartSpec, Spec};
use crate::value::{Fault, Faults, Origin};
use linkwork_dynamics::Tree;
use linkwork_solvers::Treatment;
use std::sync::Arc;

/// A part while compiling.
pub(crate) struct Part<'a> {
    pub spec: &'a PartSpec,
    pub prototype: Box<dyn Prototype>,
    pub wiring: Wiring,
}

/// Compiles a specification. O(n log n) in the number of parts and wires.
///
/// # Errors
/// Every fault of the specification, in the order of the files.
pub fn compile(spec: &Spec, catalogue: &Catalogue, files: &Files) -> Result<Plan, Faults> {
    let mut faults = Vec::new();
    if spec.step.num == 0 {
        faults.push(
            Fault::new(Origin::NONE, "the integration step is zero")
                .help("write e.g. step: \"1 ms\""),
        );
        return Err(Faults(faults));
    }
    let entries = find_entries(spec, catalogue, &mut faults);
    let services = build_services(&entries, files, &mut faults);
    let mut parts = build_models(&entries, &services, &mut faults);
    let sizes = layout(&mut parts, spec.mechanism.as_ref(), spec.seed);
    let absent = spec
        .parts
        .iter()
        .filter(|p| !parts.iter().any(|built| built.spec.path == p.path))
        .map(|p| (p.path.as_str(), services.iter().any(|(path, _)| path == p.path)))
        .collect();
    let connections = connect::connect(spec, &parts, absent, sizes, &mut faults);
    let gravity = spec.mechanism.as_ref().and_then(|m| find_gravity(m, &services, &mut faults));
    table::rates(spec, &mut parts, &mut faults);
    if !faults.is_empty() {
        return Err(Faults(in_file_order(faults)));
    }

    let mut wiring = connections.mechanism.clone();
    let mechanism = spec.mechanism.as_ref().map(|m| {
        wiring.x = mechanism_x(&parts);
        let tree = Arc::new(Tree::new(&m.multibody));
        let treatments: Vec<Treatment> = (m.multibody.constraints())
            .map(|c| m.treatments.get(m.multibody.constraint_name(c)))
            .map(|t| t.copied().unwrap_or(Treatment::Auto))
            .collect();
        let mut plan = MechanismPlan {
            path: m.path.clone(),
            multibody: m.multibody.clone(),
            uniform: gravity.as_ref().and_then(|g| g.uniform()),
            gravity,
            q: m.q.clone(),
            v: m.v.clone(),
            loop_motions: m.motions.clone(),
            solver: MechanismPlan::solver(&tree, &treatments),
            contact: m.contact.clone(),
            compliant: m.compliant.clone(),
            treatments,
            tree,
            wiring,
        };
        let place = |f: Fault| if f.origin == Origin::NONE { m.origin } else { f.origin };
        plan.start(&m.origins)
            .map(|()| Arc::new(plan))
            .map_err(|f| Fault { origin: place(f.clone()), ..f })
    });
    let mechanism = mechanism.transpose().map_err(|f| Faults(vec![f]))?;
    for (part, (u, ud)) in parts.iter_mut().zip(&connections.inputs) {
        part.wiring.u = u.iter().copied().collect();
        part.wiring.ud = ud.iter().copied().collect();
    }
    let order = order::order(&parts, mechanism.as_deref(), &connections)
        .map_err(|f| Faults(in_file_order(f)))?;
    let timing = table::table(spec, &parts, &order).map_err(|f| Faults(in_file_order(f)))?;
    let variables = variables::variables(&parts, mechanism.as_deref(), &connections);
    let sizes = Sizes { sig: connections.signals, ..connections.sizes };
    let wires = connections.listing(&parts, &order);
    let hash = plan_hash(spec, &parts, sizes, &variables, &timing);
    let mut stored: Vec<u32> =
        (0..parts.len() as u32).filter(|&k| parts[k as usize].prototype.stored()).collect();
    let steps = mechanism.as_ref().is_some_and(|m| m.contact.is_some());
    if steps {
        stored.push(parts.len() as u32);
    }
    Ok(Plan {
        stored,
        steps,
        parts: parts
            .into_iter()
            .map(|p| PartPlan {
                path: p.spec.path.clone(),
                prototype: p.prototype,
                rate: (p.wiring.period > 0).then_some(p.spec.rate).flatten(),
                wiring: p.wiring,
            })
            .collect(),
        mechanism,
        services,
        sizes,
        stage_ops: order.stage_ops(),
        derivs: order.derivs.clone(),
        ops: order.ops,
        works: timing.works,
        table: timing.rows,
        base: timing.base,
        step: spec.step,
        integrator: spec.integrator,
        seed: spec.seed,
        variables,
        constants: connections.constants,
        wires,
        sums: connections.sums,
        hash,
    })
}

/// What models and services say of their names and parameters: for a report on a specification
/// that has other faults already and cannot be compiled.
pub fn check_parts(spec: &Spec, catalogue: &Catalogue, files: &Files) -> Vec<Fault> {
    let mut faults = Vec::new();
    let entries = find_entries(spec, catalogue, &mut faults);
    let services = build_services(&entries, files, &mut faults);
    build_models(&entries, &services, &mut faults);
    faults
}

/// Parts by path with their entries in the catalogue.
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

/// Faults as a reader meets them: by file and place; those without a place last.
fn in_file_order(mut faults: Vec<Fault>) -> Vec<Fault> {
    faults.sort_by_key(|f| f.origin);
    faults.dedup();
    faults
}

fn build_services(
    entries: &[(&PartSpec, &Entry)],
    files: &Files,
    faults: &mut Vec<Fault>,
) -> Services {
    let mut services = Services::default();
    for (part, entry) in entries.iter().filter(|(_, e)| e.service_kind().is_some()) {
        let none = Services::default();
        let mut cx = ReadCx::new(&part.path, &none);
        let mut files = files.clone();
        if let Some(folder) = &part.folder {
            files.folders.insert(0, folder.clone());
        }
        if let Some(object) = entry.make_service(&part.params, &files, &mut cx) {
            services.add(&part.path, object);
        } else if let Some(kind) = entry.service_kind() {
            services.failed.push(kind);
        }
        faults.append(&mut located(cx.faults, part));
    }
    services
}

fn build_models<'a>(
    entries: &[(&'a PartSpec, &Entry)],
    services: &Services,
    faults: &mut Vec<Fault>,
) -> Vec<Part<'a>> {
    let mut parts = Vec::new();
    for (part, entry) in entries.iter().filter(|(_, e)| e.service_kind().is_none()) {
        let mut cx = ReadCx::new(&part.path, services);
        if let Some(prototype) = entry.make_model(&part.params, &mut cx) {
            parts.push(Part { spec: part, prototype, wiring: Wiring::default() });
        }
        faults.append(&mut located(cx.faults, part));
    }
    parts
}

/// Faults without a place get that of the part.
fn located(mut faults: Vec<Fault>, part: &PartSpec) -> Vec<Fault> {
    for fault in &mut faults {
        if fault.origin == Origin::NONE {
            fault.origin = part.origin;
        }
    }
    faults
}

/// Gives every part its lanes, in path order; the mechanism's states come last.
fn layout(parts: &mut [Part<'_>], mechanism: Option<&MechanismSpec>, seed: u64) -> Sizes {
    let mut sizes = Sizes::default();
    let lanes = |specs: &[crate::PortSpec]| specs.iter().map(|s| s.lanes).sum::<usize>();
    for part in parts.iter_mut() {
        let d = part.prototype.description();
        let w = &mut part.wiring;
        (w.x, w.d, w.ym) = (sizes.x, sizes.d, sizes.sig);
        w.yd = w.ym + lanes(&d.moore_outputs);
        w.key = noise::key(seed, &part.spec.path);
        sizes.x += lanes(&d.continuous);
        sizes.d += lanes(&d.discrete);
        sizes.sig = w.yd + lanes(&d.direct_outputs);
    }
    if let Some(m) = mechanism {
        sizes.x += MechanismPlan::lanes(m);
    }
    sizes
}

fn mechanism_x(parts: &[Part<'_>]) -> usize {
    parts
        .iter()
        .map(|p| p.prototype.description().continuous.iter().map(|s| s.lanes).sum::<usize>())
        .sum()
}

fn find_gravity(
    m: &MechanismSpec,
    services: &Services,
    faults: &mut Vec<Fault>,
) -> Option<Arc<dyn Gravity>> {
    let any = services.iter().any(|(_, o)| o.kind() == crate::ServiceKind::Gravity);
    if m.gravity.is_none() && !any {
        return None;
    }
    match services.find::<dyn Gravity>(m.gravity.as_deref(), &m.path) {
        Ok(handle) => Some(handle.object().clone()),
        Err((message, help)) => {
            faults.push(Fault::new(m.origin, format!("the mechanism: {message}")).help(help));
            None
        }
    }
}

fn plan_hash(
    spec: &Spec,
    parts: &[Part<'_>],
    sizes: Sizes,
    variables: &std::collections::BTreeMap<String, crate::plan::Variable>,
    timing: &table::Timing,
) -> u64 {
    let mut text = format!(
        "{sizes:?} {} {:?} {} {}\n",
        spec.step,
        spec.integrator,
        timing.base,
        timing.rows.len()
    );
    for part in parts {
        text += &format!("{} {} {}\n", part.spec.path, part.spec.model, part.prototype.params());
    }
    for (path, v) in variables {
        text += &format!("{path} {:?}\n", v.place);
    }
    noise::hash(text.bytes())
}

impl MechanismWiring {
    /// All signal lanes that the dynamics reads.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = u32> + '_ {
        self.wrenches
            .iter()
            .flat_map(|(_, s)| s.iter().copied())
            .chain(self.torques.iter().map(|t| t.1))
            .chain(self.motions.iter().map(|t| t.1))
            .chain(self.loop_motions.iter().map(|t| t.1))
    }
}
