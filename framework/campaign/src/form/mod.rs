//! The campaign file: RON text → what is drawn for each run. All mistakes are reported at once.
//!
//! ```ron
//! Campaign(
//!     simulation: "sim.ron",                      // file or folder, relative to this file
//!     runs: 1000,
//!     vary: {
//!         "Friction.damping": Uniform(from: 0.01, to: 0.2),
//!         "bob.mass": Normal(mean: "1 kg", deviation: "50 g"),
//!         "Capsule.velocity": [Normal(mean: -1764.7, deviation: 5), 7046.4, 0],
//!     },
//! )
//! ```
//! A distribution can be anywhere inside a value. Its name is its path: `Capsule.velocity[0]`.
mod describe;
mod require;
mod values;

pub use describe::schema;
pub use require::{Bound, Requirement};
pub(crate) use values::in_unit;

use crate::correlation::factor;
use crate::distribution::Distribution;
use crate::sampling::{SOBOL_RUNS, SOBOL_VALUES, Sampling};
use linkwork_assembly::schema::Field;
use linkwork_assembly::{Failure, Text, read_value, tidy};
use linkwork_runtime::{Fault, Located, Origin, Seconds, Sources, Value, remedy};
use std::path::{Path, PathBuf};

/// A drawn value and its distribution.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Path: `bob.mass`, `Capsule.velocity[0]`.
    pub name: String,
    /// The distribution.
    pub of: Distribution,
    /// Unit of its numbers; empty for none.
    pub unit: String,
    /// Position in the file.
    pub origin: Origin,
}

/// Structure of a value: constants, and drawn values by their index in [`Form::drawn`].
#[derive(Clone, Debug)]
pub(crate) enum Template {
    Constant(Value),
    Drawn(usize),
    List(Vec<Template>),
    Map(Vec<(String, Template)>),
}

/// Correlated values.
#[derive(Clone, Debug)]
pub(crate) struct Together {
    /// Indices in [`Form::drawn`].
    pub of: Vec<usize>,
    /// Lower Cholesky factor of the correlation matrix.
    pub factor: Vec<Vec<f64>>,
}

/// Seed of the noise of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Noise {
    /// Each run has its own seed.
    Own,
    /// All runs have the seed of the simulation's file.
    Same,
}

/// Time histories that are kept for every run.
#[derive(Clone, Debug)]
pub struct Retain {
    /// Patterns of variables.
    pub of: Vec<Text>,
    /// Sample period.
    pub every: Seconds,
    /// Position in the file.
    pub origin: Origin,
}

/// A parsed campaign file.
#[derive(Clone, Debug)]
pub struct Form {
    /// Name of the campaign: its file without folder and suffix.
    pub name: String,
    /// Description.
    pub doc: String,
    /// The simulation's file or folder.
    pub simulation: PathBuf,
    /// Number of runs.
    pub runs: u64,
    /// Seed of all draws.
    pub seed: u64,
    /// Sampling method.
    pub sampling: Sampling,
    /// Seed of the noise of a run.
    pub noise: Noise,
    /// Largest simulated time of a run.
    pub until: Option<Seconds>,
    /// Largest wall time of a run (s).
    pub wall: Option<f64>,
    /// Pairs of metrics or drawn numbers for scatter plots in the report.
    pub scatter: Vec<(String, String, Origin)>,
    /// Requirements on the metrics of a run.
    pub require: Vec<Requirement>,
    /// Variables whose time histories are kept for every run.
    pub retain: Option<Retain>,
    /// All drawn values, sorted by name.
    pub drawn: Vec<Drawn>,
    /// Path, value and position in the file of everything that is set; constants first.
    pub(crate) targets: Vec<(String, Template, Origin)>,
    pub(crate) together: Vec<Together>,
    /// The text.
    pub sources: Sources,
}

/// Largest number of runs, because some places use 32-bit run numbers, and results are in memory.
const MOST_RUNS: u64 = 10_000_000;
/// Integers up to this are exact in a double.
const MOST_SEED: u64 = 1 << 53;

struct Reader {
    faults: Vec<Fault>,
    drawn: Vec<Drawn>,
}

impl Form {
    /// Reads a file.
    ///
    /// # Errors
    /// All mistakes.
    pub fn read(path: &Path) -> Result<Form, Failure> {
        let name = path.display().to_string();
        let text = linkwork_formats::whole_text(path).map_err(|e| {
            let fault = Fault::new(Origin::NONE, format!("`{name}` cannot be read: {e}")).help(
                format!("give a campaign file, which begins with `Campaign(`{}", inside(path)),
            );
            Failure { faults: vec![fault], sources: Sources::default() }
        })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Form::text(&name, &text, folder)
    }

    /// Reads a text. Paths in it are relative to `folder`.
    ///
    /// # Errors
    /// All mistakes.
    pub fn text(name: &str, text: &str, folder: &Path) -> Result<Form, Failure> {
        let (value, sources) = read_value(name, text)?;
        let mut r = Reader { faults: Vec::new(), drawn: Vec::new() };
        let form = r.form(&value, folder);
        match form {
            Some(form) if r.faults.is_empty() => {
                let stem = Path::new(name).file_stem();
                let name = stem.map_or("campaign".into(), |s| s.to_string_lossy().into_owned());
                Ok(Form { name, sources, drawn: r.drawn, ..form })
            }
            _ => Err(Failure { faults: tidy(r.faults), sources }),
        }
    }
}

/// Returns a hint with the campaign files in a folder, for a path that is a folder.
fn inside(folder: &Path) -> String {
    let Ok(entries) = std::fs::read_dir(folder) else { return String::new() };
    let campaign = |path: &PathBuf| {
        path.extension().is_some_and(|e| e == "ron")
            && linkwork_formats::whole_text(path).is_ok_and(|text| text.contains("Campaign("))
    };
    let mut found: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(campaign).collect();
    found.sort();
    match found.iter().map(|p| format!("`{}`", p.display())).collect::<Vec<_>>().join(", ") {
        names if names.is_empty() => String::new(),
        names => format!(", here {names}"),
    }
}

impl Reader {
    fn fault(&mut self, origin: Origin, message: String, help: impl Into<String>) {
        self.faults.push(Fault::new(origin, message).help(help));
    }

    fn form(&mut self, v: &Located, folder: &Path) -> Option<Form> {
        let (_, inner) = self.variant(v, "the file", &["Campaign"])?;
        self.fields(inner, "the campaign", &describe::campaign());
        let simulation = match inner.get("simulation") {
            Some(v) => self.text(v, "simulation").map(|t| folder.join(t)),
            None => {
                let help = "write simulation: \"sim.ron\", a file or folder relative to this file";
                self.fault(v.origin, "the campaign lacks `simulation`".into(), help);
                None
            }
        };
        let runs = match inner.get("runs") {
            Some(v) => self.whole(v, "runs", 1, MOST_RUNS),
            None => {
                self.fault(v.origin, "the campaign lacks `runs`".into(), "write runs: 1000");
                None
            }
        };
        let doc = inner.get("doc").and_then(|v| self.text(v, "doc")).unwrap_or_default();
        let seed = inner.get("seed").map_or(Some(1), |v| self.whole(v, "seed", 0, MOST_SEED));
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
        let require = inner.get("require").map_or(Vec::new(), |v| self.require(v));
        let retain = inner.get("retain").and_then(|v| self.retain(v));
        if let (Some(runs), Sampling::Sobol) = (runs, sampling) {
            self.sobol(inner, runs);
        }
        if self.drawn.is_empty() && self.faults.is_empty() && noise == Noise::Same {
            let help = "write `vary: { \"PATH\": Normal(..) }`, or remove `noise: Same`";
            self.fault(v.origin, "all runs would be identical".into(), help);
        }
        Some(Form {
            name: String::new(),
            doc,
            simulation: simulation?,
            runs: runs?,
            seed: seed?,
            sampling,
            noise,
            until,
            wall,
            scatter,
            require,
            retain,
            drawn: Vec::new(),
            targets,
            together,
            sources: Sources::default(),
        })
    }

    fn sobol(&mut self, campaign: &Located, runs: u64) {
        let origin = campaign.get("sampling").map_or(Origin::NONE, |v| v.origin);
        if runs > SOBOL_RUNS {
            let message =
                format!("the Sobol sequence supports {SOBOL_RUNS} runs, but `runs` is {runs}");
            self.fault(origin, message, "choose fewer runs, or sampling: LatinHypercube");
        }
        let values = self.drawn.len();
        if values > SOBOL_VALUES {
            let message = format!(
                "the Sobol sequence supports {SOBOL_VALUES} values, but the campaign draws {values}"
            );
            self.fault(origin, message, "choose sampling: LatinHypercube");
        }
    }

    fn fields(&mut self, v: &Located, what: &str, known: &[Field]) {
        let known = &describe::names(known)[..];
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
        let message = format!("`{what}` must be a text, but it is {}", v.value.what());
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
        self.fault(v.origin, message, format!("write an integer from {least} to {most}"));
        None
    }

    /// Reads one of several words; the first is the default.
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

    fn targets(&mut self, campaign: &Located) -> Vec<(String, Template, Origin)> {
        let mut out: Vec<(String, Template, Origin)> = Vec::new();
        for field in ["set", "vary"] {
            let Some(v) = campaign.get(field) else { continue };
            let Value::Map(entries) = &v.value else {
                let message = format!("`{field}` holds {}", v.value.what());
                self.fault(v.origin, message, "write { \"PATH\": value, .. }");
                continue;
            };
            // Draws are in the order of their names, independent of the order in the file.
            let mut entries: Vec<&(String, Located)> = entries.iter().collect();
            entries.sort_by(|a, b| a.0.cmp(&b.0));
            for (path, v) in entries {
                if path == "seed" {
                    let help = "noise: Own gives each run its own seed, noise: Same uses the seed of the file";
                    self.fault(v.origin, "the seed of the noise cannot be set".into(), help);
                    continue;
                }
                if out.iter().any(|(p, ..)| p == path) {
                    let message = format!("`{path}` is both in `set` and in `vary`");
                    self.fault(v.origin, message, "remove one of the two");
                }
                let before = self.drawn.len();
                let faults = self.faults.len();
                let template = match field {
                    "vary" => self.template(v, path),
                    _ => Template::Constant(v.value.clone()),
                };
                if field == "vary" && self.drawn.len() == before && self.faults.len() == faults {
                    let message = format!("`{path}` does not contain a distribution");
                    self.fault(v.origin, message, "write constant values in `set`");
                }
                out.push((path.clone(), template, v.origin));
            }
        }
        out
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
            self.fields(item, "`correlate`", &describe::correlation());
            let Some(of) = self.names(item) else { continue };
            let rows = item.get("matrix").and_then(numbers);
            let Some(rows) = rows else {
                let help = "write matrix: [[1, 0.5], [0.5, 1]]";
                self.fault(item.origin, "`correlate` lacks a `matrix` of numbers".into(), help);
                continue;
            };
            if let Some(k) = of.iter().find(|k| out.iter().any(|t| t.of.contains(k))) {
                let message = format!("`{}` is correlated twice", self.drawn[*k].name);
                self.fault(item.origin, message, "put all correlated values into one matrix");
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

    /// Returns the indices of the values in `of` of a correlation.
    fn names(&mut self, item: &Located) -> Option<Vec<usize>> {
        let Some(Value::List(list)) = item.get("of").map(|v| &v.value) else {
            let help = "write of: [\"bob.mass\", \"Capsule.velocity[0]\"]";
            self.fault(item.origin, "`correlate` lacks a list `of`".into(), help);
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
                    Some((
                        format!("`{n}` is not a sampled value"),
                        remedy(n, "drawn values", &known),
                    ))
                }
                (Some(n), Some(k)) if !self.drawn[k].of.is_continuous() => {
                    let help = "only numbers can be correlated: remove it".to_string();
                    Some((format!("`{n}` is a Choice"), help))
                }
                (Some(n), Some(k)) if of.contains(&k) => {
                    Some((format!("`{n}` is listed twice"), "list each value once".into()))
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
        self.fields(v, "`limits`", &describe::limits());
        let mut read = |field: &str| self.time(v.get(field)?, "limits", field);
        (read("time"), read("wall").map(Seconds::seconds))
    }

    fn time(&mut self, v: &Located, of: &str, field: &str) -> Option<Seconds> {
        match Seconds::period(&v.value) {
            Ok(s) if s.num > 0 && !v.value.to_string().contains("Hz") => Some(s),
            _ => {
                let message = format!("`{of}`: `{field}` is {}", v.value);
                let help = "write a positive time: 20, \"20 s\", \"2 min\"";
                self.fault(v.origin, message, help);
                None
            }
        }
    }

    fn retain(&mut self, v: &Located) -> Option<Retain> {
        self.fields(v, "`retain`", &describe::retain());
        let help = "write retain: (of: [\"Capsule.altitude\"], every: \"1 s\")";
        let every = v.get("every").map(|e| self.time(e, "retain", "every"));
        let of = v.get("of").map(|of| match &of.value {
            Value::List(items) if !items.is_empty() => {
                let one = |(reader, i): (&mut Self, &Located)| {
                    let text = reader.text(i, "of")?;
                    Some(Text { text, origin: i.origin })
                };
                items.iter().map(|i| one((self, i))).collect::<Option<Vec<_>>>()
            }
            other => {
                self.fault(of.origin, format!("`retain`: `of` is {other}"), help);
                None
            }
        });
        if (of.is_none() || every.is_none()) && matches!(v.value, Value::Map(_) | Value::Null) {
            let missing = if of.is_none() { "of" } else { "every" };
            self.fault(v.origin, format!("`retain` lacks `{missing}`"), help);
        }
        Some(Retain { of: of??, every: every??, origin: v.origin })
    }

    fn scatter(&mut self, v: &Located) -> Vec<(String, String, Origin)> {
        let help = "write scatter: [(\"first\", \"second\")] with names of metrics or paths of sampled parameters";
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
                    _ => self.fault(
                        item.origin,
                        "`scatter`: this is not a pair of names".into(),
                        help,
                    ),
                },
                _ => self.fault(item.origin, "`scatter`: this is not a pair of names".into(), help),
            }
        }
        out
    }
}

fn numbers(v: &Located) -> Option<Vec<Vec<f64>>> {
    let Value::List(rows) = &v.value else { return None };
    let row = |r: &Located| match &r.value {
        Value::List(items) => items
            .iter()
            .map(|i| if let Value::Number(x) = i.value { Some(x) } else { None })
            .collect(),
        // A list of one number, such as `[1]`, counts as a number, too.
        Value::Number(x) => Some(vec![*x]),
        _ => None,
    };
    rows.iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_runtime::noise;

    const FILE: &str = r#"Campaign(
    doc: "all fields", simulation: "sim.ron", runs: 64, seed: 5, sampling: Sobol, noise: Own,
    set: { "until": "0.2 s", "Gravity.acceleration": [0, 0, -9.8] },
    vary: {
        "a": Uniform(from: 0.01, to: 0.2),
        "b": Normal(mean: "1 kg", deviation: "50 g"),
        "c": [0, 0, TruncatedNormal(mean: -1, deviation: 0.1, from: -1.3, to: -0.7)],
        "d": Choice(of: [1, 2, 5], weights: [1, 1, 2]),
        "e": LogNormal(median: "0.02 kg/m^3", sigma: 0.1),
    },
    correlate: [(of: ["b", "c[2]"], matrix: [[1, -0.8], [-0.8, 1]])],
    limits: (time: "2 min", wall: "60 s"),
    scatter: [("x", "y")], require: { "too fast": (metric: "x", least: -2, most: "3 m/s") }, retain: (of: ["a.**"], every: "20 ms"),
)
"#;

    fn read(text: &str) -> Result<Form, Failure> {
        Form::text("c.ron", text, Path::new(""))
    }

    /// Files with pieces removed, doubled, moved and overwritten, always the same ones: each is read or rejected with a message, without a panic and
    /// without a long time.
    #[test]
    fn damaged_files_are_read_or_refused() {
        assert!(read(FILE).is_ok());
        let mut drawn = 0;
        let mut random = |below: usize| {
            drawn += 1;
            (noise::key(drawn, "damaged campaign files") % below.max(1) as u64) as usize
        };
        let pieces = [
            "1e400",
            "-0",
            "NaN",
            "\"",
            "[",
            ")",
            "{}",
            "()",
            "18446744073709551616",
            "é",
            ",",
            ": ",
        ];
        let (mut fine, mut refused) = (0, 0);
        for _ in 0..4000 {
            let mut text: Vec<char> = FILE.chars().collect();
            for _ in 0..=random(3) {
                let (a, b) = (random(text.len()), random(text.len()));
                let (from, to) = (a.min(b), a.max(b).min(a.min(b) + 24));
                let piece: Vec<char> = match random(4) {
                    0 => Vec::new(),
                    1 => pieces[random(pieces.len())].chars().collect(),
                    2 => text[from..to].repeat(2),
                    _ => {
                        let at = random(text.len());
                        text[at..text.len().min(at + 24)].to_vec()
                    }
                };
                text.splice(from..to, piece);
            }
            match read(&text.iter().collect::<String>()) {
                Ok(form) => {
                    fine += 1;
                    assert!(form.runs > 0 && form.targets.len() >= form.together.len());
                }
                Err(failure) => {
                    refused += 1;
                    assert!(!failure.to_string().is_empty() && !failure.faults.is_empty());
                }
            }
        }
        // The damage is neither always harmless nor always fatal.
        assert!(fine > 20 && refused > 1000, "{fine} read, {refused} refused");
    }
}
