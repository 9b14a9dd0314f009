//! What a simulation file says besides its parts: steps, stopping, logs, figures, plots.
use crate::form::assembly;
use crate::schema::read::{fields, list, period, table, text, text_field};
use crate::text::print::inline;
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_runtime::{Accuracy, Integrator, Located, Origin, Seconds, Unit, Value, remedy};

/// One rule of what to log.
#[derive(Clone, Debug, PartialEq)]
pub struct LogRule {
    /// Patterns over variable paths; see [`match_patterns`](crate::match_patterns).
    pub channels: Vec<Text>,
    /// Sample period; `None`: every step.
    pub rate: Option<Seconds>,
    /// Where it is written.
    pub origin: Origin,
}

/// Which number of a variable's history a figure is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Take {
    /// At the end.
    Last,
    /// Smallest.
    Min,
    /// Largest.
    Max,
    /// Mean over time.
    Mean,
    /// Root of the mean square.
    Rms,
}

/// A number that sums up a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Name as shown.
    pub name: String,
    /// Variable.
    pub of: Text,
    /// Which number.
    pub take: Take,
    /// Unit as shown; `None`: that of the variable.
    pub unit: Option<Text>,
    /// Where it is written.
    pub origin: Origin,
}

/// A plot over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Title.
    pub title: String,
    /// Patterns over variable paths.
    pub of: Vec<Text>,
    /// Unit as shown; `None`: that of the variables.
    pub unit: Option<Text>,
    /// Where it is written.
    pub origin: Origin,
}

/// Settings of a simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Documentation.
    pub doc: String,
    /// Integration step.
    pub step: Seconds,
    /// Integrator.
    pub integrator: Integrator,
    /// Adaptive steps between rows; `None`: steps of the size of `step`.
    pub accuracy: Option<Accuracy>,
    /// Seed of all noise.
    pub seed: u64,
    /// Path of the gravity service.
    pub gravity: Option<Text>,
    /// Path of the mechanism as a part.
    pub mechanism: String,
    /// When to stop.
    pub until: Option<Seconds>,
    /// Variable that stops the run when it becomes true.
    pub stop_when: Option<Text>,
    /// Putting the mechanism on the ground: for the caller to read.
    pub place: Option<Located>,
    /// For the viewer to read.
    pub view: Option<Located>,
    /// What to log.
    pub log: Vec<LogRule>,
    /// Numbers that sum up a run, by name.
    pub figures: Vec<Figure>,
    /// Plots.
    pub plots: Vec<Plot>,
}

/// The fields of a simulation that an assembly has not.
pub(crate) const FIELDS: [&str; 17] = [
    "assembly",
    "step",
    "integrator",
    "accuracy",
    "until",
    "stop_when",
    "seed",
    "gravity",
    "mechanism",
    "place",
    "log",
    "view",
    "figures",
    "plots",
    "resolved",
    "phases",
    "start",
];

/// All fields.
pub(crate) fn all_fields() -> Vec<&'static str> {
    assembly::FIELDS.into_iter().filter(|f| *f != "mounts").chain(FIELDS).collect()
}

/// Reads the settings; parameters have been replaced.
pub(crate) fn read(cx: &mut Cx, v: &Located) -> Settings {
    let what = "simulation";
    let time = |cx: &mut Cx, field: &str| {
        v.get(field).and_then(|x| period(cx, x, &format!("{what}: `{field}`")))
    };
    let step = time(cx, "step").unwrap_or(Seconds { num: 1, den: 1000 });
    if let Some(at) = v.get("step").filter(|_| step.num == 0) {
        cx.fault(at.origin, "the integration step is zero", "write for example step: \"1 ms\"");
    }
    let until = time(cx, "until");
    let integrator = v.get("integrator").map_or(Integrator::Rk4, |i| integrator(cx, i));
    let adaptive = integrator.method().error_order() > 0;
    let accuracy = match v.get("accuracy") {
        Some(a) => accuracy(cx, a, integrator),
        None => adaptive.then(Accuracy::default),
    };
    Settings {
        doc: text_field(cx, v, "doc", what).map(|t| t.text).unwrap_or_default(),
        step,
        integrator,
        accuracy,
        seed: v.get("seed").and_then(|s| seed(cx, s)).unwrap_or(0),
        gravity: text_field(cx, v, "gravity", what),
        mechanism: text_field(cx, v, "mechanism", what)
            .map_or_else(|| "Mechanism".into(), |t| t.text),
        until,
        stop_when: text_field(cx, v, "stop_when", what),
        place: v.get("place").cloned(),
        view: v.get("view").cloned(),
        log: v.get("log").map(|l| log(cx, l)).unwrap_or_default(),
        figures: v.get("figures").map(|f| figures(cx, f)).unwrap_or_default(),
        plots: v.get("plots").map(|p| plots(cx, p)).unwrap_or_default(),
    }
}

fn word(v: &Located) -> Option<&str> {
    match &v.value {
        Value::Text(t) => Some(t),
        Value::Variant(name, inner) if inner.value == Value::Null => Some(name),
        _ => None,
    }
}

fn integrator(cx: &mut Cx, v: &Located) -> Integrator {
    let known = Integrator::ALL.iter().find(|(name, _)| word(v) == Some(name));
    match (known, word(v)) {
        (Some((_, integrator)), _) => *integrator,
        (None, other) => {
            let shown = other.map_or_else(|| v.value.what().to_string(), |w| format!("`{w}`"));
            let help = remedy(other.unwrap_or(""), "integrators", &Integrator::ALL.map(|i| i.0));
            cx.fault(v.origin, format!("simulation: there is no integrator {shown}"), help);
            Integrator::Rk4
        }
    }
}

/// `(relative: 1e-9, absolute: 1e-9, step_max: "10 s", of: {"Body.position.*": 1e-3})`, or `fixed`.
fn accuracy(cx: &mut Cx, v: &Located, integrator: Integrator) -> Option<Accuracy> {
    let what = "simulation: `accuracy`";
    if word(v) == Some("fixed") {
        return None;
    }
    if integrator.method().error_order() == 0 {
        let adaptive = Integrator::ALL.iter().filter(|i| i.1.method().error_order() > 0);
        let names: Vec<&str> = adaptive.map(|i| i.0).collect();
        cx.fault(
            v.origin,
            format!("{what}: this integrator has no error estimate"),
            format!("choose one that has: {}", names.join(", ")),
        );
        return None;
    }
    if !fields(cx, v, what, &["relative", "absolute", "step_max", "of"]) {
        return None;
    }
    let mut out = Accuracy::default();
    let number = |cx: &mut Cx, field: &str, into: &mut f64| {
        if let Some(at) = v.get(field) {
            match at.value {
                Value::Number(x) if x >= 0.0 && x.is_finite() => *into = x,
                _ => {
                    let shown = inline(&at.value);
                    cx.fault(
                        at.origin,
                        format!("{what}: `{field}` cannot be {shown}"),
                        "write a number such as 1e-9",
                    );
                }
            }
        }
    };
    number(cx, "relative", &mut out.relative);
    number(cx, "absolute", &mut out.absolute);
    if let Some(t) = v.get("step_max").and_then(|x| period(cx, x, what)) {
        out.step_max = t.seconds();
    }
    if let Some(of) = v.get("of") {
        for (pattern, item) in table(cx, of, what) {
            match item.value {
                Value::Number(x) => out.of.push((pattern.clone(), x, cx.key(item))),
                _ => cx.fault(
                    item.origin,
                    format!("{what}: `{pattern}` wants a number"),
                    "in the unit of the state, e.g. 1e-6",
                ),
            }
        }
    }
    Some(out)
}

/// A whole number; as a text when it has more digits than a double holds.
fn seed(cx: &mut Cx, v: &Located) -> Option<u64> {
    let seed = match &v.value {
        Value::Number(x) if x.fract() == 0.0 && (0.0..=9e15).contains(x) => Some(*x as u64),
        Value::Text(t) => t.parse().ok(),
        _ => None,
    };
    if seed.is_none() {
        let help = "write a whole number; above 9e15 in quotes: \"18446744073709551615\"";
        cx.fault(v.origin, format!("simulation: `{}` is not a seed", inline(&v.value)), help);
    }
    seed
}

fn texts(cx: &mut Cx, v: &Located, what: &str) -> Vec<Text> {
    if let Value::Text(t) = &v.value {
        return vec![Text { text: t.clone(), origin: v.origin }];
    }
    list(cx, v, what).iter().filter_map(|item| text(cx, item, what)).collect()
}

fn log(cx: &mut Cx, v: &Located) -> Vec<LogRule> {
    let mut out = Vec::new();
    for item in list(cx, v, "simulation: `log`") {
        let what = "a log rule";
        if !fields(cx, item, what, &["channels", "rate"]) {
            continue;
        }
        let channels = match item.get("channels") {
            Some(c) => texts(cx, c, "log: `channels`"),
            None => {
                cx.fault(
                    item.origin,
                    "a log rule has no `channels`",
                    "write channels: [\"Rover.**\"]",
                );
                continue;
            }
        };
        let rate = item.get("rate").and_then(|r| period(cx, r, "log: `rate`"));
        out.push(LogRule { channels, rate, origin: item.origin });
    }
    out
}

fn unit(cx: &mut Cx, v: &Located, what: &str) -> Option<Text> {
    let t = text_field(cx, v, "unit", what)?;
    if let Err(e) = Unit::parse(&t.text) {
        cx.fault(t.origin, format!("{what}: {e}"), "write for example \"N m\" or \"deg/s\"");
        return None;
    }
    Some(t)
}

fn figures(cx: &mut Cx, v: &Located) -> Vec<Figure> {
    const WORDS: [&str; 5] = ["last", "min", "max", "mean", "rms"];
    let mut out = Vec::new();
    for (name, item) in table(cx, v, "simulation: `figures`") {
        let what = format!("figure `{name}`");
        if !fields(cx, item, &what, &["of", "take", "unit"]) {
            continue;
        }
        let take = match item.get("take").map(|t| (t, word(t))) {
            None | Some((_, Some("last"))) => Take::Last,
            Some((_, Some("min"))) => Take::Min,
            Some((_, Some("max"))) => Take::Max,
            Some((_, Some("mean"))) => Take::Mean,
            Some((_, Some("rms"))) => Take::Rms,
            Some((t, other)) => {
                let help = remedy(other.unwrap_or(""), "words", &WORDS);
                cx.fault(t.origin, format!("{what}: `take` cannot be {}", t.value), help);
                Take::Last
            }
        };
        let unit = unit(cx, item, &what);
        let Some(of) = text_field(cx, item, "of", &what) else {
            if item.get("of").is_none() {
                cx.fault(cx.key(item), format!("{what} has no `of`"), "write of: \"Part.output\"");
            }
            continue;
        };
        out.push(Figure { name: name.clone(), of, take, unit, origin: cx.key(item) });
    }
    out.sort_by(|a, b| a.name.cmp(&b.name));
    out
}

fn plots(cx: &mut Cx, v: &Located) -> Vec<Plot> {
    let mut out = Vec::new();
    for item in list(cx, v, "simulation: `plots`") {
        let what = "a plot";
        if !fields(cx, item, what, &["title", "of", "unit"]) {
            continue;
        }
        let Some(of) = item.get("of") else {
            cx.fault(item.origin, "a plot has no `of`", "write of: [\"Part.output\"]");
            continue;
        };
        out.push(Plot {
            title: text_field(cx, item, "title", what).map(|t| t.text).unwrap_or_default(),
            of: texts(cx, of, "plot: `of`"),
            unit: unit(cx, item, what),
            origin: item.origin,
        });
    }
    out
}
