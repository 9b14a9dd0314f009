//! Detection of parts that have no effect and that nobody reads, such as a forgotten sensor.
use crate::form::settings::MetricOf;
use crate::load::Loaded;
use crate::text::patterns::matches;
use linkwork_runtime::{Fault, PartSpec, Plan, PortSpec, Program};
use linkwork_surroundings::Terrain;
use std::collections::BTreeSet;

/// Returns a warning for each part of the first phase whose outputs are not wired, bound, logged, shown, watched or plotted in any phase.
pub(crate) fn unread(loaded: &Loaded, program: &Program) -> Vec<Fault> {
    let file = &loaded.simulation;
    let plan = &program.phases[0].plan;
    let mut patterns = file.patterns();
    patterns.extend(file.view.iter().flat_map(|view| view.markers.clone()));
    let names: Vec<&String> = plan.variables.keys().collect();
    let mut seen: BTreeSet<&str> = BTreeSet::new();
    for pattern in patterns {
        // A pattern without a match is not reported here, because the check of the pattern reports
        // it.
        for k in matches(&pattern.text, &names) {
            seen.insert(&plan.variables[names[k]].part);
        }
    }
    let windows = file.log.iter().filter_map(|rule| rule.around.as_ref()).map(|a| &a.when);
    let metrics = file.metrics.iter().filter_map(|f| match &f.of {
        MetricOf::Condition(when) => Some(when),
        MetricOf::Variable(_) => None,
    });
    let firsts = file.metrics.iter().filter_map(|f| f.at.as_ref());
    for when in windows.chain(metrics).chain(firsts).chain(&file.stop_when) {
        let named = |p: &&linkwork_runtime::PartPlan| when.text.contains(&p.path);
        seen.extend(plan.parts.iter().filter(named).map(|p| p.path.as_str()));
    }
    for phase in &loaded.phases {
        for transition in &phase.transitions {
            let named = |p: &&PartSpec| transition.when.contains(&p.path);
            seen.extend(phase.spec.parts.iter().filter(named).map(|p| p.path.as_str()));
        }
    }
    for phase in &program.phases {
        let read = read(&phase.plan);
        seen.extend(read.iter().map(|k| phase.plan.parts[*k].path.as_str()));
    }
    let idle = plan.parts.iter().filter(|p| {
        let d = p.prototype.description();
        let mut outputs = d.all_outputs().peekable();
        outputs.peek().is_some() && !seen.contains(p.path.as_str()) && p.path != file.mechanism
    });
    idle.map(|p| {
        let fact = format!("no output of `{}` is read", p.path);
        Fault::new(p.origin, fact).help("wire, log or plot one of its outputs, or remove the part")
    })
    .collect()
}

/// Returns a warning for each colour of the view whose object is not drawn.
pub(crate) fn unseen(loaded: &Loaded, program: &Program) -> Vec<Fault> {
    let Some(view) = &loaded.simulation.view else { return Vec::new() };
    let mut services = program.phases.iter().flat_map(|phase| phase.plan.services.iter());
    let terrain = services.any(|(_, o)| o.get::<dyn Terrain>().is_some());
    let services = &program.phases[0].plan.services;
    let on_planet = services.rotating().is_some();
    let idle = |written: bool, fact: &str, help: &str| {
        written.then(|| Fault::new(view.origin, format!("`view`: {fact}")).help(help))
    };
    let planet = view.planet.is_some() && view.planet_radius.is_none() && !on_planet;
    [
        idle(
            view.ground.is_some() && !terrain,
            "`ground` has no effect: the simulation has no terrain",
            "remove `ground`; `color` of a shape or collider is its colour",
        ),
        idle(
            planet,
            "`planet` has no effect: W is not a site on a planet, and `planet_radius` is not written",
            "write `planet_radius`, or remove `planet`",
        ),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Returns the parts with an output that another part reads.
fn read(plan: &Plan) -> Vec<usize> {
    let mut lanes: BTreeSet<usize> = BTreeSet::new();
    let mut own = Vec::new();
    for (k, part) in plan.parts.iter().enumerate() {
        let d = part.prototype.description();
        let count = |ports: &[PortSpec]| ports.iter().map(|p| p.lanes).sum::<usize>();
        let w = &part.wiring;
        let (m, n) = (count(&d.outputs), count(&d.feedthrough_outputs));
        own.push((k, w.ym..w.ym + m, w.yd..w.yd + n));
    }
    for (k, part) in plan.parts.iter().enumerate() {
        let (_, from_state, through) = &own[k];
        let all = part.wiring.u.iter().chain(&part.wiring.ud).map(|lane| *lane as usize);
        lanes.extend(all.filter(|lane| !from_state.contains(lane) && !through.contains(lane)));
    }
    lanes.extend(plan.sums.iter().flat_map(|s| &s.sources).map(|lane| *lane as usize));
    let reads = |(k, a, b): (usize, std::ops::Range<usize>, std::ops::Range<usize>)| {
        a.chain(b).any(|lane| lanes.contains(&lane)).then_some(k)
    };
    own.into_iter().filter_map(reads).collect()
}
