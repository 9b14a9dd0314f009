//! The fields of a campaign file, declared once: the reader takes their names from here, and the JSON Schema is made of
//! them.
use super::{MOST_RUNS, MOST_SEED};
use linkwork_assembly::schema::{Field, Parameters, Schema, document};
use linkwork_runtime::Value;

/// What has numbers drawn from it, and the fields of each.
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
        or("doc", "What it is for.", Schema::Text, word("")),
        need("simulation", "The simulation's file or folder, beside this file.", Schema::Text),
        need(
            "runs",
            "Number of runs; they are numbered from 0.",
            Schema::Whole { low: 1.0, high: MOST_RUNS as f64 },
        ),
        or(
            "seed",
            "Seed of all draws.",
            Schema::Whole { low: 0.0, high: MOST_SEED as f64 },
            Value::Number(1.0),
        ),
        or(
            "sampling",
            "How the values of all runs spread.",
            Schema::Words(vec!["Random", "LatinHypercube", "Sobol"]),
            word("Random"),
        ),
        or(
            "noise",
            "Whether each run has a seed of noise of its own, or all that of the simulation's file.",
            Schema::Words(vec!["Own", "Same"]),
            word("Own"),
        ),
        field("set", "Path → value, the same in all runs.", anything()),
        field(
            "vary",
            "Path → a distribution, or a list or map with distributions in it.",
            Schema::Table(Box::new(drawn())),
        ),
        field(
            "correlate",
            "What is drawn together.",
            list(Schema::Record("correlation", correlation)),
        ),
        field("limits", "Where a run is ended.", Schema::Record("limits", limits)),
        field(
            "scatter",
            "Pairs of figures or drawn numbers that the report draws against each other; the first two figures unless written.",
            list(pair(Schema::Text)),
        ),
        field(
            "require",
            "Cause in words → bounds of a figure: a run beyond them has missed, and is counted by that cause.",
            Schema::Table(Box::new(Schema::Record("requirement", requirement))),
        ),
        field(
            "retain",
            "Variables whose time histories every run keeps.",
            Schema::Record("retain", retain),
        ),
    ]
}

pub(super) fn correlation() -> Vec<Field> {
    vec![
        need("of", "Names of drawn values: `bob.mass`, `Capsule.velocity[0]`.", list(Schema::Text)),
        need("matrix", "Their correlations.", list(list(number()))),
    ]
}

pub(super) fn limits() -> Vec<Field> {
    vec![
        field("time", "Latest simulated end of a run.", time()),
        field("wall", "Most wall time for a run.", time()),
    ]
}

pub(super) fn requirement() -> Vec<Field> {
    vec![
        need("figure", "Name of a figure of the simulation.", Schema::Text),
        field("least", "Least value that is good, in the figure's unit or with one.", number()),
        field("most", "Greatest value that is good.", number()),
    ]
}

pub(super) fn retain() -> Vec<Field> {
    vec![
        need("of", "Patterns over the paths of variables.", list(Schema::Text)),
        need("every", "Time between the rows.", time()),
    ]
}

/// The fields of a distribution.
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
                field("weights", "How often each is taken; alike unless written.", list(number())),
            ]
        },
        _ => || {
            vec![
                need("mean", "Mean of the normal distribution.", number()),
                need("deviation", "Its standard deviation.", number()),
                field("from", "Least; open unless written.", number()),
                field("to", "Greatest; open unless written.", number()),
            ]
        },
    }
}

/// A value with distributions in it.
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

/// The JSON Schema (draft 2020-12) of campaign files, as serde would write their RON in JSON.
#[must_use]
pub fn schema() -> serde_json::Value {
    let campaign = Schema::Variant("Campaign", Box::new(Schema::Record("campaign", campaign)));
    document("Linkwork campaign", &campaign, Parameters::None)
}
