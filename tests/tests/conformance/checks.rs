//! Rules that every model must keep. Each check returns its findings, so that a test can show that it fails.
use super::rig::Rig;
use super::sample::{self, PATH, build, filled, params, params_for, with};
use allocation_counter::measure;
use linkwork_runtime::{Entry, Files, ParamSpec, PortKind, PortSpec, Services, Unit, Value};

/// Checks the documentation of the model, its ports, states and parameters.
pub fn documented(entry: &Entry) -> Vec<String> {
    let d = &entry.description;
    let mut found = Vec::new();
    let mut ask = |what: String, doc: &str| {
        if doc.trim().len() < 3 {
            found.push(format!("`{}`: {what} has no documentation", d.name));
        }
    };
    ask("the model".into(), &d.doc);
    for s in all_ports(entry) {
        ask(format!("port `{}`", s.name), &s.doc);
    }
    for (path, s) in all_params(&d.params, &[]) {
        ask(format!("parameter `{}`", path.join(".")), s.doc);
    }
    found
}

/// Checks that units are valid, and that every number has one.
pub fn units(entry: &Entry) -> Vec<String> {
    let name = &entry.description.name;
    let mut found = Vec::new();
    for s in all_ports(entry) {
        let plain = matches!(s.kind, PortKind::Numbers | PortKind::Vector);
        if plain && s.unit.is_empty() {
            found.push(format!("`{name}`: port `{}` has no unit: write \"1\" for none", s.name));
        }
        // Composite kinds have the units of their elements.
        if !s.unit.is_empty()
            && let Err(e) = Unit::parse(&s.unit)
        {
            found.push(format!("`{name}`: port `{}`: {e}", s.name));
        }
    }
    for (path, s) in all_params(&entry.description.params, &[]) {
        // Rows of different quantities have a list of units.
        let units =
            s.unit.into_iter().flat_map(|all| all.split(',')).map(|u| Unit::parse(u.trim()));
        if let Some(Err(e)) = units.into_iter().find(Result::is_err) {
            found.push(format!("`{name}`: parameter `{}`: {e}", path.join(".")));
        }
    }
    found
}

/// Checks that variables are unique: inputs and outputs share the paths `<part>.<port>`, and `<part>.state.<name>` is a state, which a port `state`
/// of several numbers would hide.
pub fn names(entry: &Entry) -> Vec<String> {
    let described = entry.describe(&params(entry).into(), &Files::default());
    let d = described.as_ref().unwrap_or(&entry.description);
    let lanes = |before: &str, p: &PortSpec| -> Vec<String> {
        p.lane_names().into_iter().map(|(n, _)| format!("{before}{}{n}", p.name)).collect()
    };
    let ports = d.all_inputs().chain(d.all_outputs()).flat_map(|p| lanes("", p));
    let states = d.continuous.iter().chain(&d.discrete).flat_map(|p| lanes("state.", p));
    let mut all: Vec<String> = ports.chain(states).collect();
    all.sort_unstable();
    all.windows(2)
        .filter(|w| w[0] == w[1])
        .map(|w| format!("`{}`: two variables are called `{}`", d.name, w[0]))
        .collect()
}

/// Checks that the model builds from defaults and made-up values.
pub fn builds(entry: &Entry, services: &Services) -> Vec<String> {
    match build(entry, &params(entry), services) {
        Ok(_) => Vec::new(),
        Err(faults) => faults
            .iter()
            .map(|f| format!("`{}` with {}: {}", entry.description.name, params(entry), f.message))
            .collect(),
    }
}

/// Models that render an image at a sample: they use several threads, each of which allocates.
const PICTURES: [&str; 1] = ["sensors.camera"];

/// Checks that results are bit-identical when run twice, evaluated twice, and resumed in a new instance; also finite values, and no allocation.
pub fn runs(entry: &Entry, services: &Services) -> Vec<String> {
    const TICKS: usize = 200;
    const HALF: usize = 97;
    let name = &entry.description.name;
    let mut found = Vec::new();
    let rig = || match build(entry, &params(entry), services) {
        Ok(prototype) => Some(Rig::new(&*prototype)),
        Err(_) => None,
    };
    let (Some(mut first), Some(mut again), Some(mut resumed)) = (rig(), rig(), rig()) else {
        return found; // `builds` has reported it.
    };
    let trace = first.trace(TICKS);
    if let Some(bad) = first.bad() {
        found.push(format!("`{name}`: {bad} from finite inputs"));
    }
    again.repeats = 2;
    let head = again.trace(HALF);
    let saved = again.save();
    let tail = again.trace(TICKS - HALF);
    if let Some(k) = head.iter().chain(&tail).zip(&trace).position(|(a, b)| a != b) {
        found.push(format!("`{name}`: evaluated twice, tick {k} has other bits: it is not pure"));
    } else {
        resumed.load(&saved);
        if resumed.trace(TICKS - HALF) != trace[HALF..] {
            found.push(format!("`{name}`: resumed, it has other bits: its store forgets a field"));
        }
    }
    let counts = measure(|| (0..TICKS).for_each(|_| first.step()));
    if counts.count_total > 0 && !PICTURES.contains(&&**name) {
        found.push(format!(
            "`{name}`: {} allocations in {TICKS} ticks after {TICKS} others",
            counts.count_total
        ));
    }
    found
}

/// Checks that models accept the ends of ranges, and that the next number outside is rejected by name.
pub fn ranges(entry: &Entry, services: &Services) -> Vec<String> {
    let name = &entry.description.name;
    let mut found = Vec::new();
    for (path, spec) in all_params(&entry.description.params, &[]) {
        let Some(range) = spec.range else { continue };
        let base = params_for(entry, path[0]);
        let whole = spec.kind == "integer";
        let down = |x: f64| if whole { x - 1.0 } else { x.next_down() };
        let up = |x: f64| if whole { x + 1.0 } else { x.next_up() };
        let mut ends = Vec::new();
        if range.low.is_finite() {
            ends.push((range.low, down(range.low)));
        }
        if range.high.is_finite() {
            let (inside, outside) = if range.open {
                (down(range.high), range.high)
            } else {
                (range.high, up(range.high))
            };
            ends.push((inside, outside));
        }
        let value = |x: f64| Some(with(&base, &path, filled(&spec.kind, &spec.fields, x)?));
        for (inside, outside) in ends {
            let (Some(good), Some(bad)) = (value(inside), value(outside)) else { continue };
            let at = format!("`{name}`, {} = ", path.join("."));
            if entry.service_kind().is_none()
                && let Err(faults) = build(entry, &good, services)
            {
                let why = faults.first().map_or(String::new(), |f| f.message.clone());
                found.push(format!("{at}{inside}: in the range, and refused: {why}"));
            }
            let wanted = format!("`{PATH}.{}`", spec.name);
            match refusal(entry, &bad, services) {
                None => found.push(format!("{at}{outside}: out of the range, and taken")),
                Some(text) if text.contains(&wanted) && text.contains("out of range") => {}
                Some(text) => {
                    found.push(format!("{at}{outside}: the message lacks {wanted}: {text}"))
                }
            }
        }
    }
    found
}

fn refusal(entry: &Entry, params: &Value, services: &Services) -> Option<String> {
    let mut cx = linkwork_runtime::ReadCx::new(PATH, services);
    let params = params.clone().into();
    let built = match entry.service_kind() {
        None => entry.make_model(&params, &mut cx).is_some(),
        Some(_) => entry.make_service(&params, &Default::default(), &mut cx).is_some(),
    };
    (!built).then(|| cx.faults.iter().map(|f| f.message.as_str()).collect::<Vec<_>>().join("; "))
}

fn all_ports(entry: &Entry) -> Vec<&PortSpec> {
    let d = &entry.description;
    let states = d.continuous.iter().chain(&d.discrete).chain(&d.guards);
    d.all_inputs().chain(d.all_outputs()).chain(states).collect()
}

/// Returns parameters and those inside them, by path.
fn all_params<'s>(specs: &'s [ParamSpec], above: &[&'s str]) -> Vec<(Vec<&'s str>, &'s ParamSpec)> {
    let mut all = Vec::new();
    for s in specs {
        let mut path = above.to_vec();
        path.push(s.name);
        if s.kind == "struct" {
            all.extend(all_params(&s.fields, &path));
        }
        all.push((path, s));
    }
    all
}

/// Runs all checks of a model; for a service, those that do not need a file.
pub fn all(entry: &Entry, services: &Services) -> Vec<String> {
    let mut found = [documented(entry), units(entry), names(entry)].concat();
    if entry.service_kind().is_none() {
        found.extend(builds(entry, services));
        found.extend(runs(entry, services));
    }
    if found.is_empty() || sample::params(entry) != Value::Null {
        found.extend(ranges(entry, services));
    }
    found
}
