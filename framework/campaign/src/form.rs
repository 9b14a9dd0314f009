//! The campaign file: RON text → what is drawn for each run, all mistakes at once.
//!
//! ```ron
//! Campaign(
//!     simulation: "sim.ron",                      // beside this file; a folder, too
//!     runs: 1000,
//!     vary: {
//!         "Friction.damping": Uniform(from: 0.01, to: 0.2),
//!         "bob.mass": Normal(mean: "1 kg", deviation: "50 g"),
//!         "Capsule.velocity": [Normal(mean: -1764.7, deviation: 5), 7046.4, 0],
//!     },
//! )
//! ```
//! A distribution may stand anywhere inside a value; each has a name, its path: `Capsule.velocity[0]`.
use crate::correlation::factor;
use crate::distribution::Distribution;
use crate::sampling::{SOBOL_RUNS, SOBOL_VALUES, Sampling};
use linkwork_assembly::{Failure, read_value, tidy};
use linkwork_runtime::{
    Fault, Located, Origin, Seconds, Sources, Unit, Value, remedy, split_quantity,
};
use std::path::{Path, PathBuf};

/// A distribution and what it is of.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Its path: `bob.mass`, `Capsule.velocity[0]`.
    pub name: String,
    /// What is drawn.
    pub of: Distribution,
    /// Unit of its numbers; empty for none.
    pub unit: String,
    /// Where it is written.
    pub origin: Origin,
}

/// What a value is made of: constants, and draws by their place in [`Form::drawn`].
#[derive(Clone, Debug)]
pub(crate) enum Template {
    Constant(Value),
    Drawn(usize),
    List(Vec<Template>),
    Map(Vec<(String, Template)>),
}

/// Values that are drawn together.
#[derive(Clone, Debug)]
pub(crate) struct Together {
    /// Places in [`Form::drawn`].
    pub of: Vec<usize>,
    /// Lower factor of the matrix of correlations.
    pub factor: Vec<Vec<f64>>,
}

/// Where the noise of a run comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Noise {
    /// Each run has a seed of its own.
    Own,
    /// Every run has the seed of the simulation's file.
    Same,
}

/// A campaign file as read.
#[derive(Clone, Debug)]
pub struct Form {
    /// What it is for.
    pub doc: String,
    /// The simulation's file or folder.
    pub simulation: PathBuf,
    /// Number of runs.
    pub runs: u64,
    /// Seed of all draws.
    pub seed: u64,
    /// How values are spread.
    pub sampling: Sampling,
    /// Where the noise of a run comes from.
    pub noise: Noise,
    /// The latest simulated end of a run.
    pub until: Option<Seconds>,
    /// The most wall time that a run may take (s).
    pub wall: Option<f64>,
    /// Pairs of figures that the report draws against each other.
    pub scatter: Vec<(String, String, Origin)>,
    /// Everything drawn, in the order of names.
    pub drawn: Vec<Drawn>,
    /// Path, what is written there, and where that is said; constants first.
    pub(crate) targets: Vec<(String, Template, Origin)>,
    pub(crate) together: Vec<Together>,
    /// The text.
    pub sources: Sources,
}

const FIELDS: [&str; 11] = [
    "doc",
    "simulation",
    "runs",
    "seed",
    "sampling",
    "noise",
    "set",
    "vary",
    "correlate",
    "limits",
    "scatter",
];

/// Runs of a campaign: a run's number is a 32-bit number in places, and results are held in memory.
const MOST_RUNS: u64 = 10_000_000;

struct Reader {
    faults: Vec<Fault>,
    drawn: Vec<Drawn>,
}

impl Form {
    /// Reads a file.
    ///
    /// # Errors
    /// Everything that is wrong, at once.
    pub fn read(path: &Path) -> Result<Form, Failure> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|e| {
            let fault = Fault::new(Origin::NONE, format!("`{name}` cannot be read: {e}"))
                .help("name a campaign file, which begins with `Campaign(`");
            Failure { faults: vec![fault], sources: Sources::default() }
        })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Form::text(&name, &text, folder)
    }

    /// Reads a text whose files lie in `folder`.
    ///
    /// # Errors
    /// Everything that is wrong, at once.
    pub fn text(name: &str, text: &str, folder: &Path) -> Result<Form, Failure> {
        let (value, sources) = read_value(name, text)?;
        let mut r = Reader { faults: Vec::new(), drawn: Vec::new() };
        let form = r.form(&value, folder);
        match form {
            Some(form) if r.faults.is_empty() => Ok(Form { sources, drawn: r.drawn, ..form }),
            _ => Err(Failure { faults: tidy(r.faults), sources }),
        }
    }
}

impl Reader {
    fn fault(&mut self, origin: Origin, message: String, help: impl Into<String>) {
        self.faults.push(Fault::new(origin, message).help(help));
    }

    fn form(&mut self, v: &Located, folder: &Path) -> Option<Form> {
        let Some(inner) = self.variant(v, "the file", &["Campaign"]).map(|(_, inner)| inner) else {
            return None;
        };
        self.fields(inner, "the campaign", &FIELDS);
        let simulation = match inner.get("simulation") {
            Some(v) => self.text(v, "simulation").map(|t| folder.join(t)),
            None => {
                let help = "write simulation: \"sim.ron\", a file or folder beside this one";
                self.fault(v.origin, "the campaign has no `simulation`".into(), help);
                None
            }
        };
        let runs = match inner.get("runs") {
            Some(v) => self.whole(v, "runs", 1, MOST_RUNS),
            None => {
                self.fault(v.origin, "the campaign has no `runs`".into(), "write runs: 1000");
                None
            }
        };
        let doc = inner.get("doc").and_then(|v| self.text(v, "doc")).unwrap_or_default();
        let seed = inner.get("seed").map_or(Some(1), |v| self.whole(v, "seed", 0, 1 << 53));
        let words = [
            ("Random", Sampling::Random),
            ("LatinHypercube", Sampling::LatinHypercube),
            ("Sobol", Sampling::Sobol),
        ];
        let sampling = self.word(inner, "sampling", &words);
        let noise = self.word(inner, "noise", &[("Own", Noise::Own), ("Same", Noise::Same)]);
        let targets = self.targets(inner);
        let together = inner.get("correlate").map_or(Vec::new(), |v| self.together(v));
        let (until, wall) = inner.get("limits").map_or((None, None), |v| self.limits(v));
        let scatter = inner.get("scatter").map_or(Vec::new(), |v| self.scatter(v));
        if let (Some(runs), Sampling::Sobol) = (runs, sampling) {
            self.sobol(inner, runs);
        }
        if self.drawn.is_empty() && self.faults.is_empty() && noise == Noise::Same {
            let help = "write `vary: { \"PATH\": Normal(..) }`, or take `noise: Same` out";
            self.fault(v.origin, "all runs would be the same".into(), help);
        }
        Some(Form {
            doc,
            simulation: simulation?,
            runs: runs?,
            seed: seed?,
            sampling,
            noise,
            until,
            wall,
            scatter,
            drawn: Vec::new(),
            targets,
            together,
            sources: Sources::default(),
        })
    }

    fn sobol(&mut self, campaign: &Located, runs: u64) {
        let origin = campaign.get("sampling").map_or(Origin::NONE, |v| v.origin);
        if runs > SOBOL_RUNS {
            let message = format!("the Sobol sequence has {SOBOL_RUNS} runs, this asks for {runs}");
            self.fault(origin, message, "choose fewer runs, or sampling: LatinHypercube");
        }
        let values = self.drawn.len();
        if values > SOBOL_VALUES {
            let message =
                format!("the Sobol sequence has {SOBOL_VALUES} values, this draws {values}");
            self.fault(origin, message, "choose sampling: LatinHypercube");
        }
    }

    fn fields(&mut self, v: &Located, what: &str, known: &[&str]) {
        let entries = match &v.value {
            Value::Map(entries) => entries.as_slice(),
            Value::Null => return,
            other => {
                let message = format!("{what} holds {}", other.what());
                self.fault(v.origin, message, format!("write fields: {}", known.join(", ")));
                return;
            }
        };
        for (name, field) in entries.iter().filter(|(n, _)| !known.contains(&n.as_str())) {
            let message = format!("{what} has no field `{name}`");
            self.fault(field.origin, message, remedy(name, "fields", known));
        }
    }

    fn variant<'v>(
        &mut self,
        v: &'v Located,
        what: &str,
        known: &[&str],
    ) -> Option<(&'v str, &'v Located)> {
        match &v.value {
            Value::Variant(name, inner) if known.contains(&name.as_str()) => Some((name, inner)),
            Value::Variant(name, _) => {
                let message = format!("{what} begins with `{name}`");
                self.fault(v.origin, message, remedy(name, "names", known));
                None
            }
            other => {
                let message = format!("{what} holds {}", other.what());
                self.fault(v.origin, message, format!("write {}(..)", known.join("(..) or ")));
                None
            }
        }
    }

    fn text(&mut self, v: &Located, what: &str) -> Option<String> {
        if let Value::Text(t) = &v.value {
            return Some(t.clone());
        }
        let message = format!("`{what}` is a text, this is {}", v.value.what());
        self.fault(v.origin, message, "write it in quotes");
        None
    }

    fn whole(&mut self, v: &Located, what: &str, least: u64, most: u64) -> Option<u64> {
        if let Value::Number(x) = v.value
            && x.fract() == 0.0
            && x >= least as f64
            && x <= most as f64
        {
            return Some(x as u64);
        }
        let message = format!("`{what}` is {}", v.value);
        self.fault(v.origin, message, format!("write a whole number from {least} to {most}"));
        None
    }

    /// The first word is the default.
    fn word<T: Copy>(&mut self, campaign: &Located, field: &str, words: &[(&str, T)]) -> T {
        let names: Vec<&str> = words.iter().map(|w| w.0).collect();
        let found = campaign.get(field).and_then(|v| match &v.value {
            Value::Variant(name, inner) if inner.value == Value::Null => {
                let found = words.iter().find(|w| w.0 == name);
                if found.is_none() {
                    let message = format!("there is no {field} `{name}`");
                    self.fault(v.origin, message, remedy(name, "words", &names));
                }
                found
            }
            other => {
                let message = format!("`{field}` is {other}");
                self.fault(v.origin, message, format!("one of: {}", names.join(", ")));
                None
            }
        });
        found.unwrap_or(&words[0]).1
    }

    /// A number, and its unit.
    fn number(&mut self, v: &Located, what: &str) -> Option<(f64, String)> {
        let read = match &v.value {
            Value::Number(x) => Some((*x, String::new())),
            Value::Text(t) => split_quantity(t).map(|(x, u)| (x, u.to_string())),
            _ => None,
        };
        let Some((x, unit)) = read.filter(|(x, _)| !x.is_nan()) else {
            let message = format!("{what} is {}", v.value);
            self.fault(v.origin, message, "write a number, or a quantity in quotes: \"50 g\"");
            return None;
        };
        if let Err(e) = (!unit.is_empty()).then(|| Unit::parse(&unit)).transpose() {
            self.fault(v.origin, format!("{what}: {e}"), "write a unit such as kg, m/s or deg");
            return None;
        }
        Some((x, unit))
    }

    fn targets(&mut self, campaign: &Located) -> Vec<(String, Template, Origin)> {
        let mut out: Vec<(String, Template, Origin)> = Vec::new();
        for field in ["set", "vary"] {
            let Some(v) = campaign.get(field) else { continue };
            let Value::Map(entries) = &v.value else {
                let message = format!("`{field}` holds {}", v.value.what());
                self.fault(v.origin, message, "write { \"PATH\": value, .. }");
                continue;
            };
            // The draws have the order of their names, whatever the order of the file.
            let mut entries: Vec<&(String, Located)> = entries.iter().collect();
            entries.sort_by(|a, b| a.0.cmp(&b.0));
            for (path, v) in entries {
                if path == "seed" {
                    let help =
                        "noise: Own gives each run a seed of its own, noise: Same the file's";
                    self.fault(v.origin, "the seed of the noise is no value to set".into(), help);
                    continue;
                }
                if out.iter().any(|(p, ..)| p == path) {
                    let message = format!("`{path}` is in `set` and in `vary`");
                    self.fault(v.origin, message, "keep one of the two");
                }
                let before = self.drawn.len();
                let faults = self.faults.len();
                let template = match field {
                    "vary" => self.template(v, path),
                    _ => Template::Constant(v.value.clone()),
                };
                if field == "vary" && self.drawn.len() == before && self.faults.len() == faults {
                    let message = format!("`{path}` has no distribution in it");
                    self.fault(
                        v.origin,
                        message,
                        "what is the same in all runs belongs into `set`",
                    );
                }
                out.push((path.clone(), template, v.origin));
            }
        }
        out
    }

    fn template(&mut self, v: &Located, name: &str) -> Template {
        match &v.value {
            Value::Variant(kind, inner) if KINDS.contains(&kind.as_str()) => {
                match self.distribution(kind, inner, v.origin, name) {
                    Some((of, unit)) => {
                        self.drawn.push(Drawn { name: name.into(), of, unit, origin: v.origin });
                        Template::Drawn(self.drawn.len() - 1)
                    }
                    None => Template::Constant(Value::Null),
                }
            }
            Value::List(items) => {
                let one = |(k, item)| self.template(item, &format!("{name}[{k}]"));
                Template::List(items.iter().enumerate().map(one).collect())
            }
            Value::Map(entries) => {
                let mut entries: Vec<&(String, Located)> = entries.iter().collect();
                entries.sort_by(|a, b| a.0.cmp(&b.0));
                let one = |(k, v): &(String, Located)| {
                    (k.clone(), self.template(v, &format!("{name}.{k}")))
                };
                Template::Map(entries.into_iter().map(one).collect())
            }
            // `Pin(..)`, `Free`: a variant of the simulation's format. A misspelt distribution is refused here, not
            // by a run.
            Value::Variant(kind, _) if likely(kind) => {
                let message = format!("there is no distribution `{kind}`");
                self.fault(v.origin, message, remedy(kind, "distributions", &KINDS));
                Template::Constant(Value::Null)
            }
            other => Template::Constant(other.clone()),
        }
    }

    fn distribution(
        &mut self,
        kind: &str,
        inner: &Located,
        origin: Origin,
        name: &str,
    ) -> Option<(Distribution, String)> {
        if kind == "Choice" {
            return self.choice(inner, origin, name).map(|d| (d, String::new()));
        }
        let wanted: &[&str] = match kind {
            "Uniform" => &["from", "to"],
            "Normal" => &["mean", "deviation"],
            "LogNormal" => &["median", "sigma"],
            _ => &["mean", "deviation", "from", "to"],
        };
        let what = format!("`{name}`: {kind}");
        self.fields(inner, &what, wanted);
        let mut read: Vec<Option<(f64, String)>> = Vec::new();
        for field in wanted {
            let open = kind == "TruncatedNormal" && ["from", "to"].contains(field);
            read.push(match inner.get(field) {
                Some(v) => self.number(v, &format!("{what}: `{field}`")),
                None if open => Some((
                    if *field == "from" { f64::NEG_INFINITY } else { f64::INFINITY },
                    String::new(),
                )),
                None => {
                    self.fault(
                        origin,
                        format!("{what} has no `{field}`"),
                        format!("write {field}: .."),
                    );
                    None
                }
            });
        }
        let read: Vec<(f64, String)> = read.into_iter().collect::<Option<_>>()?;
        let unit = read[0].1.clone();
        let mut x = Vec::new();
        for (field, (number, own)) in wanted.iter().zip(&read) {
            // A deviation is a difference: 5 K about 20 degC. Its zero does not count.
            let difference = *field == "deviation";
            match in_unit(*number, own, &unit, difference) {
                _ if *field == "sigma" && own.is_empty() => x.push(*number),
                Some(y) => x.push(y),
                // An open end has no unit.
                None if number.is_infinite() => x.push(*number),
                None => {
                    let (a, b) = (shown(own), shown(&unit));
                    let message = format!("{what}: `{field}` is in {a}, `{}` in {b}", wanted[0]);
                    let help = match *field {
                        "sigma" => "sigma is the deviation of the logarithm, a number".into(),
                        _ => format!("write both in units of one quantity, for example {b}"),
                    };
                    self.fault(origin, message, help);
                    return None;
                }
            }
        }
        let d = match kind {
            "Uniform" => Distribution::Uniform { from: x[0], to: x[1] },
            "Normal" => Distribution::Normal { mean: x[0], deviation: x[1] },
            "LogNormal" => Distribution::LogNormal { median: x[0], sigma: x[1] },
            _ => {
                Distribution::TruncatedNormal { mean: x[0], deviation: x[1], from: x[2], to: x[3] }
            }
        };
        if let Some((fact, help)) = unsupported(&d) {
            self.fault(origin, format!("{what} {fact}"), help);
            return None;
        }
        Some((d, unit))
    }

    fn choice(&mut self, inner: &Located, origin: Origin, name: &str) -> Option<Distribution> {
        let what = format!("`{name}`: Choice");
        // `Choice(["a", "b"])` in short.
        let of = match &inner.value {
            Value::List(_) => Some(inner),
            _ => {
                self.fields(inner, &what, &["of", "weights"]);
                inner.get("of")
            }
        };
        let Some(Value::List(items)) = of.map(|v| &v.value) else {
            self.fault(
                origin,
                format!("{what} has no list `of`"),
                "write Choice(of: [\"a\", \"b\"])",
            );
            return None;
        };
        if items.is_empty() {
            self.fault(
                origin,
                format!("{what} has nothing to choose from"),
                "write one value or more",
            );
            return None;
        }
        let weights = match inner.get("weights").map(|v| &v.value) {
            None => vec![1.0; items.len()],
            Some(Value::List(list)) => {
                let numbers = list.iter().filter_map(|v| match v.value {
                    Value::Number(x) if x >= 0.0 && x.is_finite() => Some(x),
                    _ => None,
                });
                numbers.collect()
            }
            Some(_) => Vec::new(),
        };
        let sum: f64 = weights.iter().sum();
        if weights.len() != items.len() || !(sum > 0.0) || !sum.is_finite() {
            let message = format!("{what}: `weights` are not {} numbers above zero", items.len());
            self.fault(
                origin,
                message,
                "write one weight for each value, none below zero, not all zero",
            );
            return None;
        }
        let of = items.iter().map(|i| i.value.clone()).collect();
        Some(Distribution::Choice { of, weights: weights.iter().map(|w| w / sum).collect() })
    }

    fn together(&mut self, v: &Located) -> Vec<Together> {
        let Value::List(items) = &v.value else {
            let message = format!("`correlate` holds {}", v.value.what());
            self.fault(
                v.origin,
                message,
                "write [(of: [\"a\", \"b\"], matrix: [[1, 0.5], [0.5, 1]])]",
            );
            return Vec::new();
        };
        let mut out: Vec<Together> = Vec::new();
        for item in items {
            self.fields(item, "`correlate`", &["of", "matrix"]);
            let Some(of) = self.names(item) else { continue };
            let rows = item.get("matrix").and_then(|m| numbers(m));
            let Some(rows) = rows else {
                let help = "write matrix: [[1, 0.5], [0.5, 1]]";
                self.fault(item.origin, "`correlate` has no `matrix` of numbers".into(), help);
                continue;
            };
            if let Some(k) = of.iter().find(|k| out.iter().any(|t| t.of.contains(k))) {
                let message = format!("`{}` is correlated twice", self.drawn[*k].name);
                self.fault(item.origin, message, "put all that hangs together into one matrix");
                continue;
            }
            match factor(&rows, of.len()) {
                Ok(factor) => out.push(Together { of, factor }),
                Err(e) => {
                    let place = item.get("matrix").map_or(item.origin, |m| m.origin);
                    let mut fault = Fault::of(place, &e);
                    fault.message = format!("`correlate`: {}", fault.message);
                    self.faults.push(fault);
                }
            }
        }
        out
    }

    /// The values that `of` of a correlation names, by place.
    fn names(&mut self, item: &Located) -> Option<Vec<usize>> {
        let Some(Value::List(list)) = item.get("of").map(|v| &v.value) else {
            let help = "write of: [\"bob.mass\", \"Capsule.velocity[0]\"]";
            self.fault(item.origin, "`correlate` has no list `of`".into(), help);
            return None;
        };
        let mut of = Vec::new();
        let mut whole = true;
        for v in list {
            let name = self.text(v, "of");
            let known: Vec<String> = self.drawn.iter().map(|d| d.name.clone()).collect();
            let found = name.as_ref().and_then(|n| known.iter().position(|k| k == n));
            let fact = match (&name, found) {
                (None, _) => None,
                (Some(n), None) => {
                    let known: Vec<&str> = known.iter().map(String::as_str).collect();
                    Some((format!("`{n}` is not drawn"), remedy(n, "drawn values", &known)))
                }
                (Some(n), Some(k)) if !self.drawn[k].of.is_continuous() => {
                    let help = "only numbers are correlated: take it out".to_string();
                    Some((format!("`{n}` is a Choice"), help))
                }
                (Some(n), Some(k)) if of.contains(&k) => {
                    Some((format!("`{n}` is named twice"), "name each value once".into()))
                }
                (Some(_), Some(k)) => {
                    of.push(k);
                    continue;
                }
            };
            whole = false;
            if let Some((fact, help)) = fact {
                self.fault(v.origin, format!("`correlate`: {fact}"), help);
            }
        }
        whole.then_some(of)
    }

    fn limits(&mut self, v: &Located) -> (Option<Seconds>, Option<f64>) {
        self.fields(v, "`limits`", &["time", "wall"]);
        let mut read = |field: &str| {
            let v = v.get(field)?;
            match Seconds::period(&v.value) {
                Ok(s) if s.num > 0 && !v.value.to_string().contains("Hz") => Some(s),
                _ => {
                    let message = format!("`limits`: `{field}` is {}", v.value);
                    self.fault(
                        v.origin,
                        message,
                        "write a time above zero: 20, \"20 s\", \"2 min\"",
                    );
                    None
                }
            }
        };
        (read("time"), read("wall").map(Seconds::seconds))
    }

    fn scatter(&mut self, v: &Located) -> Vec<(String, String, Origin)> {
        let help = "write scatter: [(\"first figure\", \"second figure\")]";
        let Value::List(items) = &v.value else {
            self.fault(v.origin, format!("`scatter` holds {}", v.value.what()), help);
            return Vec::new();
        };
        let mut out = Vec::new();
        for item in items {
            match &item.value {
                Value::List(pair) => match pair.iter().map(|p| &p.value).collect::<Vec<_>>()[..] {
                    [Value::Text(a), Value::Text(b)] => {
                        out.push((a.clone(), b.clone(), item.origin))
                    }
                    _ => {
                        self.fault(item.origin, "`scatter`: this is no pair of names".into(), help)
                    }
                },
                _ => self.fault(item.origin, "`scatter`: this is no pair of names".into(), help),
            }
        }
        out
    }
}

const KINDS: [&str; 5] = ["Uniform", "Normal", "TruncatedNormal", "LogNormal", "Choice"];

/// A word that is meant to be a distribution: it is like one.
fn likely(kind: &str) -> bool {
    linkwork_runtime::nearest(kind, KINDS).is_some()
}

fn shown(unit: &str) -> &str {
    if unit.is_empty() { "no unit" } else { unit }
}

/// The number of `x own` in `unit`; `None` when they are of different quantities.
fn in_unit(x: f64, own: &str, unit: &str, difference: bool) -> Option<f64> {
    if own == unit {
        return Some(x);
    }
    let parse = |u: &str| if u.is_empty() { Some(Unit::ONE) } else { Unit::parse(u).ok() };
    let (a, b) = (parse(own)?, parse(unit)?);
    if !a.same_quantity(&b) {
        return None;
    }
    Some(match difference {
        true => x * a.scale / b.scale,
        false => (a.to_si(x) - b.offset) / b.scale,
    })
}

fn numbers(v: &Located) -> Option<Vec<Vec<f64>>> {
    let Value::List(rows) = &v.value else { return None };
    let row = |r: &Located| match &r.value {
        Value::List(items) => items
            .iter()
            .map(|i| if let Value::Number(x) = i.value { Some(x) } else { None })
            .collect(),
        // `[1]` in brackets of one: a number.
        Value::Number(x) => Some(vec![*x]),
        _ => None,
    };
    rows.iter().map(row).collect()
}

/// Why nothing can be drawn from a distribution.
fn unsupported(d: &Distribution) -> Option<(String, String)> {
    let told = |fact: String, help: &str| Some((fact, help.to_string()));
    match *d {
        Distribution::Uniform { from, to } if !(from < to && (to - from).is_finite()) => {
            told(format!("runs from {from} to {to}"), "write finite bounds, `from` below `to`")
        }
        Distribution::Normal { mean, deviation }
        | Distribution::TruncatedNormal { mean, deviation, .. }
            if !(deviation > 0.0 && deviation.is_finite() && mean.is_finite()) =>
        {
            told(
                format!("has the mean {mean} and the deviation {deviation}"),
                "write finite numbers, the deviation above zero; what is the same in all runs belongs into `set`",
            )
        }
        Distribution::TruncatedNormal { mean, deviation, from, to } => {
            if !(from < to) {
                return told(format!("runs from {from} to {to}"), "write `from` below `to`");
            }
            let (alpha, beta) = ((from - mean) / deviation, (to - mean) / deviation);
            let p = Distribution::between(alpha, beta);
            (!(p >= Distribution::LEAST_SUPPORT)).then(|| {
                (
                    format!("has no support: the normal distribution leaves {p:.1e} between {from} and {to}"),
                    "bring the bounds nearer to the mean, or take Uniform".to_string(),
                )
            })
        }
        Distribution::LogNormal { median, sigma }
            if !(median > 0.0 && median.is_finite() && sigma > 0.0 && sigma.is_finite()) =>
        {
            told(format!("has the median {median} and sigma {sigma}"), "write both above zero")
        }
        _ => None,
    }
}
