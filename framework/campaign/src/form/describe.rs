//! The fields of a campaign file, declared once for the reader and for the JSON Schema.
use super::{MOST_RUNS, MOST_SEED};
use linkwork_assembly::schema::{Field, Parameters, Schema, document};
use linkwork_runtime::Value;

/// The distributions.
pub(super) const KINDS: [&str; 5] = ["Uniform", "Normal", "TruncatedNormal", "LogNormal", "Choice"];

fn field(name: &'static str, doc: &'static str, schema: Schema) -> Field {
    Field { name, doc, schema, required: false, default: None }
}

fn need(name: &'static str, doc: &'static str, schema: Schema) -> Field {
    Field { required: true, ..field(name, doc, schema) }
}

fn or(name: &'static str, doc: &'static str, schema: Schema, default: Value) -> Field {
    Field { default: Some(default), ..field(name, doc, schema) }
}

fn list(of: Schema) -> Schema {
    Schema::List(Box::new(of), None)
}

fn pair(of: Schema) -> Schema {
    Schema::List(Box::new(of), Some(2))
}

/// A number with any unit.
fn number() -> Schema {
    Schema::Number { unit: String::new(), low: f64::NEG_INFINITY, high: f64::INFINITY }
}

fn time() -> Schema {
    Schema::Number { unit: "s".into(), low: f64::MIN_POSITIVE, high: f64::INFINITY }
}

pub(super) fn names(fields: &[Field]) -> Vec<&'static str> {
    fields.iter().map(|f| f.name).collect()
}

pub(super) fn campaign() -> Vec<Field> {
    let anything = || Schema::Table(Box::new(Schema::Any(Vec::new())));
    let word = |w: &str| Value::Text(w.into());
    vec![
        or("doc", "Description of the campaign.", Schema::Text, word("")),
        need("simulation", "The simulation's file or folder, relative to this file.", Schema::Text),
        need(
            "runs",
            "Number of runs; they are numbered from 0.",
            Schema::Whole { low: 1.0, high: MOST_RUNS as f64 },
        ),
        or(
            "seed",
            "Seed of all sampled values.",
            Schema::Whole { low: 0.0, high: MOST_SEED as f64 },
            Value::Number(1.0),
        ),
        or(
            "sampling",
            "Sampling method.",
            Schema::Words(vec!["Random", "LatinHypercube", "Sobol"]),
            word("Random"),
        ),
        or(
            "noise",
            "Own: each run has its own noise seed. Same: all runs have the seed of the simulation's file.",
            Schema::Words(vec!["Own", "Same"]),
            word("Own"),
        ),
        field("set", "Path → constant value for all runs.", anything()),
        field(
            "vary",
            "Path → a distribution, or a list or map that contains distributions.",
            Schema::Table(Box::new(drawn())),
        ),
        field("correlate", "Correlated values.", list(Schema::Record("correlation", correlation))),
        field("limits", "Limits of a run.", Schema::Record("limits", limits)),
        field(
            "scatter",
            "Pairs of metrics or sampled parameters for scatter plots in the report (default: the first two metrics).",
            list(pair(Schema::Text)),
        ),
        field(
            "require",
            "Cause in words → bounds of a metric. Runs outside the bounds are counted under this cause.",
            Schema::Table(Box::new(Schema::Record("requirement", requirement))),
        ),
        field(
            "retain",
            "Variables whose time histories are kept for every run.",
            Schema::Record("retain", retain),
        ),
    ]
}

pub(super) fn correlation() -> Vec<Field> {
    vec![
        need(
            "of",
            "Names of sampled values: `bob.mass`, `Capsule.velocity[0]`.",
            list(Schema::Text),
        ),
        need("matrix", "Their correlations.", list(list(number()))),
    ]
}

pub(super) fn limits() -> Vec<Field> {
    vec![
        field("time", "Largest simulated time of a run.", time()),
        field("wall", "Largest wall time of a run.", time()),
    ]
}

pub(super) fn requirement() -> Vec<Field> {
    vec![
        need("metric", "Name of a metric of the simulation.", Schema::Text),
        field("least", "Smallest acceptable value, in the metric's unit or with a unit.", number()),
        field("most", "Largest acceptable value.", number()),
    ]
}

pub(super) fn retain() -> Vec<Field> {
    vec![
        need("of", "Patterns for the paths of variables.", list(Schema::Text)),
        need("every", "Sample period.", time()),
    ]
}

/// Returns the fields of a distribution.
pub(super) fn distribution(kind: &str) -> fn() -> Vec<Field> {
    match kind {
        "Uniform" => || vec![need("from", "Least.", number()), need("to", "Greatest.", number())],
        "Normal" => || {
            vec![
                need("mean", "Mean.", number()),
                need("deviation", "Standard deviation.", number()),
            ]
        },
        "LogNormal" => || {
            vec![
                need("median", "Median.", number()),
                need("sigma", "Standard deviation of the logarithm.", number()),
            ]
        },
        "Choice" => || {
            vec![
                need("of", "Numbers, texts or files.", list(Schema::Any(Vec::new()))),
                field("weights", "Relative weights (default: equal).", list(number())),
            ]
        },
        _ => || {
            vec![
                need("mean", "Mean of the normal distribution.", number()),
                need("deviation", "Its standard deviation.", number()),
                field("from", "Lower bound (default: none).", number()),
                field("to", "Upper bound (default: none).", number()),
            ]
        },
    }
}

/// Returns the schema of a value that may contain distributions.
fn drawn() -> Schema {
    fn title(kind: &str) -> &'static str {
        match kind {
            "Uniform" => "uniform",
            "Normal" => "normal",
            "LogNormal" => "log-normal",
            "Choice" => "choice",
            _ => "truncated normal",
        }
    }
    Schema::Named("varied value", || {
        let mut forms: Vec<Schema> = Vec::new();
        for kind in KINDS {
            let record = Schema::Record(title(kind), distribution(kind));
            forms.push(Schema::Variant(kind, Box::new(record)));
        }
        forms.push(Schema::Variant("Choice", Box::new(list(Schema::Any(Vec::new())))));
        forms.push(list(drawn()));
        forms.push(Schema::TableBut(&KINDS, Box::new(drawn())));
        forms.extend([number(), Schema::Flag, Schema::Text]);
        Schema::Any(forms)
    })
}

/// Returns the JSON Schema (draft 2020-12) of campaign files, for JSON as serde would write their RON.
#[must_use]
pub fn schema() -> serde_json::Value {
    let campaign = Schema::Variant("Campaign", Box::new(Schema::Record("campaign", campaign)));
    document("Linkwork campaign", &campaign, Parameters::None)
}
