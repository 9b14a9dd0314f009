//! Settings of the integration, and the states that follow special rules.
use super::part::Part;
use crate::author::model::{Description, Turning, lanes};
use crate::author::pattern;
use crate::author::ports::PortKind;
use crate::author::services::Services;
use crate::author::value::{Fault, Origin};
use crate::author::variable::{Place, Variable};
use crate::plan::compiled::{Integration, ServiceQuery};
use crate::plan::spec::Spec;
use linkwork_integrate::{Control, Limits, Norm, Tolerances};
use std::collections::BTreeMap;
use std::ops::Range;

/// Ranges of lanes of all parts, without empty ones.
pub(super) fn lanes_of(
    parts: &[Part<'_>],
    range: impl Fn(&Description, usize) -> Range<usize>,
) -> Vec<Range<usize>> {
    let all = parts.iter().map(|p| range(p.prototype.description(), p.wiring.x));
    all.filter(|r| !r.is_empty()).collect()
}

/// Returns freely rotating bodies, by their slots in the whole state.
pub(super) fn turning(parts: &[Part<'_>]) -> Vec<Turning> {
    let all = parts.iter().flat_map(|p| {
        let x = p.wiring.x;
        let own = p.prototype.description().turning.iter();
        own.map(move |t| Turning { attitude: x + t.attitude, velocity: x + t.velocity })
    });
    all.collect()
}

/// Returns the signal slots that blocks write in their own stepping method.
pub(super) fn stepped_outputs(parts: &[Part<'_>]) -> Vec<Range<usize>> {
    let steps = parts.iter().filter(|p| p.prototype.description().functions.steps);
    let all = steps.map(|p| {
        let n = lanes(&p.prototype.description().feedthrough_outputs);
        p.wiring.yd..p.wiring.yd + n
    });
    all.filter(|r| !r.is_empty()).collect()
}

/// Returns the parts that query a service (air, ground) at the positions of the nodes to which they are bound.
pub(super) fn asked(parts: &[Part<'_>], services: &Services) -> Vec<ServiceQuery> {
    let mut all = Vec::new();
    for (k, part) in parts.iter().enumerate() {
        let objects = services.iter().filter(|(path, _)| part.asks.iter().any(|p| p == path));
        let d = part.prototype.description();
        for (service, object) in objects.filter(|(_, object)| object.kind().is_local()) {
            for (ports, wired) in
                [(&d.inputs, &part.wiring.u), (&d.feedthrough_inputs, &part.wiring.ud)]
            {
                let mut lane = 0;
                for port in ports {
                    if port.kind == PortKind::NodeState {
                        all.push(ServiceQuery {
                            part: k as u32,
                            service: service.to_string(),
                            object: object.clone(),
                            position: [wired[lane], wired[lane + 1], wired[lane + 2]],
                        });
                    }
                    lane += port.lanes;
                }
            }
        }
    }
    all
}

pub(super) fn integration(
    spec: &Spec,
    parts: &[Part<'_>],
    variables: &BTreeMap<String, Variable>,
    n: usize,
) -> Result<Integration, Vec<Fault>> {
    let method = spec.integrator.method();
    let Some(accuracy) = &spec.accuracy else { return Ok(Integration { method, control: None }) };
    let mut faults = Vec::new();
    let mut refuse = |origin, fact: String, help: &str| {
        faults.push(Fault::new(origin, fact).help(help));
    };
    let positive = |v: f64| v > 0.0 && v.is_finite();
    if !(positive(accuracy.absolute) && accuracy.relative >= 0.0 && accuracy.relative < 1.0) {
        let fact = format!(
            "accuracy: the tolerances are {} (absolute) and {} (relative)",
            accuracy.absolute, accuracy.relative
        );
        refuse(
            Origin::NONE,
            fact,
            "the absolute tolerance must be above 0, the relative one at least 0 and below 1, e.g. 1e-9",
        );
    }
    if !(accuracy.step_max > 0.0) {
        let fact = format!("accuracy: the longest step is {} s", accuracy.step_max);
        refuse(Origin::NONE, fact, "write a time above zero");
    }
    let mut absolute = vec![accuracy.absolute; n];
    for (wanted, value, origin) in &accuracy.of {
        let mut any = false;
        for (path, v) in variables {
            if let Place::X(k) = v.place
                && pattern::path_matches(wanted, path)
            {
                absolute[k as usize] = *value;
                any = true;
            }
        }
        if !any {
            let fact = format!("accuracy of `{wanted}`: it matches no continuous state");
            refuse(
                *origin,
                fact,
                "states are listed by `linkwork list`; `*` stands for a part of a name, `**` for anything",
            );
        } else if !positive(*value) {
            refuse(
                *origin,
                format!("accuracy of `{wanted}`: {value}"),
                "write a number above zero",
            );
        }
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    for still in lanes_of(parts, |d, x| match d.functions.derivatives {
        true => 0..0,
        false => x..x + lanes(&d.continuous),
    }) {
        absolute[still].fill(f64::INFINITY);
    }
    let limits = Limits { step_max: accuracy.step_max, ..Limits::default() };
    let control = Tolerances::new(absolute, vec![accuracy.relative; n])
        .and_then(|t| Control::new(method, t, Norm::Max, limits));
    match control {
        Ok(control) => Ok(Integration { method, control: Some(control) }),
        Err(e) => Err(vec![
            Fault::new(Origin::NONE, format!("accuracy: {e}"))
                .help("choose a method with an error estimate, or remove `accuracy`"),
        ]),
    }
}
