//! Ports of a unit from its description.
//!
//! A variable `spring.x[2]` is the port `spring_x_2`: characters other than letters, digits and `_` become `_`. Numbers are converted to SI; a
//! variable without a unit is compatible with any unit (`*`). Inputs and outputs that are texts, binaries or clocks have no port, which is a warning.
use crate::Refusal;
use crate::clocks::{is_served, possible};
use crate::kind::Kind;
use crate::slot::Slot;
use crate::start::Start;
use linkwork_formats::fmi::{
    Causality, FmiVariable, ModelDescription, VALUES_MAX, Variability, VariableKind,
};
use linkwork_runtime::{Description, Direction, Functions, PortKind, PortSpec, Unit as Measure};
use std::collections::{BTreeMap, BTreeSet};

/// Ports and their slots, in the same order.
pub(crate) struct Ports {
    /// Inputs without feedthrough, and inputs with feedthrough to an output.
    pub inputs: [Vec<Slot>; 2],
    /// Inputs that may change only at events (model exchange), by their index among all inputs.
    pub discrete: Vec<bool>,
    /// Outputs from state, and those with feedthrough.
    pub outputs: [Vec<Slot>; 2],
    /// Factor and offset to SI of each continuous state.
    pub states: Vec<(f64, f64)>,
    /// Number of event indicators.
    pub indicators: usize,
}

impl Ports {
    /// Returns the number of values of all inputs.
    pub fn input_lanes(&self) -> usize {
        self.inputs.iter().flatten().map(|s| s.size).sum()
    }
}

/// Returns the port name of a variable.
pub(crate) fn port_name(name: &str) -> String {
    let plain: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect();
    // The names change as `a[1]` → `a_1`, `der(x)` → `der_x`.
    let plain = plain.trim_end_matches('_').to_string();
    match plain.chars().next() {
        None => "v".into(),
        Some(c) if c.is_ascii_digit() => format!("v{plain}"),
        Some(_) => plain,
    }
}

/// Returns the unit of a port; `*` if the file does not define it.
fn unit_of(v: &FmiVariable) -> String {
    if !v.kind.is_float() {
        return "1".into();
    }
    match &v.unit {
        // Only units with a definition are used, because the same name can mean different units in different files.
        Some(unit) => match unit.base {
            Some((exponents, ..)) => Measure { exponents, scale: 1.0, offset: 0.0 }.to_string(),
            None => "*".into(),
        },
        None => "*".into(),
    }
}

fn port(v: &FmiVariable) -> PortSpec {
    let kind = match v.kind {
        VariableKind::Boolean if v.size == 1 && !v.is_array => PortKind::Bool,
        _ => PortKind::Numbers,
    };
    let unit = if kind == PortKind::Bool { String::new() } else { unit_of(v) };
    let doc = match (v.doc.as_str(), v.name.as_str()) {
        ("", name) => format!("`{name}` of the unit."),
        (doc, name) if port_name(name) == name => doc.to_string(),
        (doc, name) => format!("`{name}`: {doc}"),
    };
    PortSpec::named(port_name(&v.name), kind, v.size).unit_of(unit).doc_of(doc)
}

/// Returns the number of ticks of an output clock as an output.
fn count(v: &FmiVariable) -> PortSpec {
    let doc = format!("Number of ticks of the clock `{}` since the start. {}", v.name, v.doc);
    PortSpec::named(port_name(&v.name), PortKind::Numbers, 1)
        .unit_of("1")
        .doc_of(doc.trim_end().to_owned())
}

/// Returns an input. Its default is the start value that the part sets, otherwise the unit's own.
fn input(v: &FmiVariable, starts: &[Start]) -> PortSpec {
    let set = starts.iter().find_map(|start| match start {
        Start::Numbers(slot, values) if slot.name == v.name => Some(values.clone()),
        _ => None,
    });
    if set.is_some() {
        return PortSpec { default: set, ..port(v) };
    }
    let slot = Slot::of(v);
    let value = |text: Option<&String>| -> f64 {
        let number = match text.map(String::as_str) {
            Some("true") => 1.0,
            Some("false") | None => 0.0,
            Some(text) => text.parse().unwrap_or(0.0),
        };
        slot.factor * number + slot.offset
    };
    // One start value may apply to all elements of an array.
    let all = (0..v.size).map(|k| value(v.start.get(k).or(v.start.first()))).collect();
    PortSpec { default: Some(all), ..port(v) }
}

/// Returns the description for the catalogue, and the slots of its ports; `starts` are the start values that the part sets.
pub(crate) fn ports(
    d: &ModelDescription,
    starts: &[Start],
    kind: Kind,
    (model, doc): (&'static str, &'static str),
) -> Result<(Description, Ports), Refusal> {
    let numeric = |v: &&FmiVariable| v.kind.is_numeric();
    let is_input = |v: &FmiVariable| v.causality == Causality::Input;
    let inputs: Vec<&FmiVariable> =
        d.variables.iter().filter(|v| is_input(v)).filter(numeric).collect();
    let outputs: Vec<(usize, &FmiVariable)> = (d.variables.iter().enumerate())
        .filter(|(_, v)| v.causality == Causality::Output && v.kind.is_numeric())
        .collect();
    let at_events = |v: &FmiVariable| {
        kind == Kind::ModelExchange
            && !(v.kind.is_float() && v.variability == Variability::Continuous)
    };
    // Names of the inputs with feedthrough to an output. Only inputs that may change between events
    // count.
    let mut direct: BTreeSet<&str> = BTreeSet::new();
    let mut sees = |k: usize| -> bool {
        if kind == Kind::CoSimulation {
            return false;
        }
        let structure = d.outputs.iter().find(|o| o.variable == k);
        let seen: Vec<&str> = match structure.and_then(|o| o.dependencies.as_ref()) {
            Some(list) => list
                .iter()
                .map(|k| &d.variables[*k])
                .filter(|v| is_input(v) && v.kind.is_numeric() && !at_events(v))
                .map(|v| &*v.name)
                .collect(),
            None => inputs.iter().filter(|v| !at_events(v)).map(|v| &*v.name).collect(),
        };
        direct.extend(&seen);
        !seen.is_empty()
    };
    let (through, from_state): (Vec<_>, Vec<_>) = outputs.into_iter().partition(|(k, _)| sees(*k));
    let (ud, u): (Vec<&FmiVariable>, Vec<&FmiVariable>) =
        inputs.iter().copied().partition(|v| direct.contains(&*v.name));
    let (from_state, through): (Vec<&FmiVariable>, Vec<&FmiVariable>) =
        (from_state.into_iter().map(|o| o.1).collect(), through.into_iter().map(|o| o.1).collect());
    let counted: Vec<&FmiVariable> = match possible(d, kind) {
        true => d
            .variables
            .iter()
            .filter(|v| v.causality == Causality::Output && is_served(v))
            .collect(),
        false => Vec::new(),
    };
    distinct(u.iter().chain(&ud).chain(&from_state).chain(&through).chain(&counted))?;
    let lanes: usize = u.iter().chain(&ud).chain(&from_state).chain(&through).map(|v| v.size).sum();
    if lanes > VALUES_MAX {
        return Err(Refusal::new(format!(
            "the unit has {lanes} values at its ports, but the limit is {VALUES_MAX}"
        ))
        .help("export it with fewer inputs and outputs"));
    }
    let me = kind == Kind::ModelExchange;
    let states: Vec<&FmiVariable> =
        if me { d.states.iter().map(|(s, _)| &d.variables[*s]).collect() } else { Vec::new() };
    let scale = |v: &&FmiVariable| vec![(Slot::of(v).factor, Slot::of(v).offset); v.size];
    let scales: Vec<(f64, f64)> = states.iter().flat_map(scale).collect();
    let nz = if me { d.event_indicators } else { 0 };
    let specs = |list: &[&FmiVariable]| -> Vec<PortSpec> { list.iter().map(|v| port(v)).collect() };
    let entries = |list: &[&FmiVariable]| -> Vec<PortSpec> {
        list.iter().map(|v| input(v, starts)).collect()
    };
    let guard = |name: &'static str, lanes, direction, doc: &'static str| {
        PortSpec::named(name, PortKind::Numbers, lanes).unit_of("*").doc_of(doc).when(direction)
    };
    let mut guards = Vec::new();
    if me {
        if nz > 0 {
            guards.push(guard("indicator", nz, Direction::Either, "Event indicators of the unit."));
        }
        guards.push(guard("time_event", 1, Direction::Rising, "Time since the next time event."));
        guards.push(guard(
            "asks",
            1,
            Direction::Rising,
            "1 if the unit requests an event, otherwise −1.",
        ));
    }
    let description = Description {
        name: model.into(),
        doc: match d.doc.as_str() {
            "" => format!("{doc} This one: {}.", d.name).into(),
            own => format!("{doc} This one: {}, {own}", d.name).into(),
        },
        functions: Functions {
            outputs: !from_state.is_empty() || !counted.is_empty(),
            feedthrough: !through.is_empty(),
            derivatives: !scales.is_empty(),
            update: !me,
            guards: me,
            outputs_timed: true,
            feedthrough_timed: true,
            ..Functions::default()
        },
        params: <crate::UnitParams as linkwork_runtime::Params>::specs(),
        inputs: entries(&u),
        feedthrough_inputs: entries(&ud),
        outputs: specs(&from_state).into_iter().chain(counted.iter().map(|v| count(v))).collect(),
        feedthrough_outputs: specs(&through),
        continuous: specs(&states),
        guards,
        ..Description::default()
    };
    let slots = |list: &[&FmiVariable]| list.iter().map(|v| Slot::of(v)).collect();
    let ports = Ports {
        discrete: u.iter().chain(&ud).map(|v| at_events(v)).collect(),
        inputs: [slots(&u), slots(&ud)],
        outputs: [slots(&from_state), slots(&through)],
        states: scales,
        indicators: nz,
    };
    Ok((description, ports))
}

/// Returns the inputs and outputs that have no port, because a lane holds a number.
pub(crate) fn without_port(d: &ModelDescription) -> impl Iterator<Item = &FmiVariable> {
    let outside = |v: &&FmiVariable| matches!(v.causality, Causality::Input | Causality::Output);
    d.variables.iter().filter(outside).filter(|v| !v.kind.is_numeric())
}

/// Returns an error if two variables would become the same port.
fn distinct<'v>(variables: impl Iterator<Item = &'v &'v FmiVariable>) -> Result<(), Refusal> {
    let mut seen: BTreeMap<String, &str> = BTreeMap::new();
    for v in variables {
        let name = port_name(&v.name);
        if let Some(other) = seen.insert(name.clone(), &v.name) {
            return Err(Refusal::new(format!(
                "variables `{other}` and `{}` of the unit would both be the port `{name}`",
                v.name
            ))
            .help("rename one of them in the source of the unit"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_words() {
        for (name, word) in [
            ("x", "x"),
            ("spring.x", "spring_x"),
            ("a[1]", "a_1"),
            ("der(x)", "der_x"),
            ("2nd", "v2nd"),
            ("'ü'", "v"),
        ] {
            assert_eq!(port_name(name), word, "{name}");
        }
    }
}
