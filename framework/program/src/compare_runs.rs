//! `linkwork diff` of two runs: the metrics of both next to each other, and the lines in which their configurations differ.
use crate::exit;
use linkwork_assembly::patterns::path_matches;
use linkwork_record::{Entry, LogError, Tolerances, walk_log};
use linkwork_runtime::doc::number;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Largest number of lines of the configurations that are shown.
const LINES: usize = 20;

/// Results of a run.
struct Run {
    /// Value and unit of each metric. NaN represents a metric without a value.
    metrics: BTreeMap<String, (f64, String)>,
    /// Simulated time at the end (s).
    time: f64,
    /// Configuration, if the folder contains a log with one.
    configuration: Option<String>,
}

/// Whether a path names a run: its folder or its `summary.json`.
pub fn is_run(path: &Path) -> bool {
    path.is_dir() || path.extension().is_some_and(|e| e == "json")
}

/// Reads the configuration at the beginning of a log.
fn configuration(log: &Path) -> Option<String> {
    enum Found {
        Text(String),
        Nothing,
    }
    impl From<LogError> for Found {
        fn from(_: LogError) -> Found {
            Found::Nothing
        }
    }
    let read = walk_log(log, |entry| match entry {
        Entry::Configuration(text) => Err(Found::Text(text)),
        Entry::Numbers { .. } => Err(Found::Nothing),
        _ => Ok(()),
    });
    match read {
        Err(Found::Text(text)) => Some(text),
        _ => None,
    }
}

fn read(path: &Path) -> Result<Run, String> {
    let file: PathBuf = if path.is_dir() { path.join("summary.json") } else { path.into() };
    let name = file.display();
    let help = "\n  help: give two folders of `linkwork run`, or their files summary.json";
    let text = std::fs::read_to_string(&file).map_err(|e| format!("`{name}`: {e}{help}"))?;
    let all: Value =
        serde_json::from_str(&text).map_err(|e| format!("`{name}` is not JSON: {e}{help}"))?;
    let (Some(metrics), Some(time)) = (all["metrics"].as_object(), all["time"].as_f64()) else {
        return Err(format!("`{name}` is not the summary of a run{help}"));
    };
    // JSON has no NaN, so a metric without a value is null.
    let one = |v: &Value| {
        (v[0].as_f64().unwrap_or(f64::NAN), v[1].as_str().unwrap_or_default().to_string())
    };
    Ok(Run {
        metrics: metrics.iter().map(|(name, v)| (name.clone(), one(v))).collect(),
        time,
        configuration: configuration(&file.with_file_name("run.mcap")),
    })
}

/// Returns the lines of a configuration with the names of the parts or bodies that contain them: `Rover.Wheel1`, `params: {"radius": 0.2},`. Lines
/// that only open or close brackets are omitted.
fn lines(text: &str) -> Vec<(String, &str)> {
    let mut inside: Vec<(usize, &str)> = Vec::new();
    let mut out = Vec::new();
    for line in text.lines() {
        let own = line.trim_start();
        let indent = line.len() - own.len();
        inside.retain(|(other, _)| *other < indent);
        let path: Vec<&str> = inside.iter().map(|(_, name)| *name).collect();
        if !own.ends_with(['(', '{', '[']) && own.contains(char::is_alphanumeric) {
            out.push((path.join("."), own));
        }
        // `"Friction": (` opens a part; its lines are indented further.
        let name = own.strip_prefix('"').and_then(|rest| rest.split_once("\": "));
        if let Some((name, "(" | "{" | "[")) = name {
            inside.push((indent, name));
        }
    }
    out
}

/// Prints the lines that only one of two configurations has, part by part; returns whether the configurations differ.
fn changes(a: &str, b: &str) -> bool {
    let (x, y) = (lines(a), lines(b));
    let [first, second] = [&x, &y].map(|all| all.iter().collect::<BTreeSet<_>>());
    let mut of_parts: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for (mark, own, other) in [('-', &x, &second), ('+', &y, &first)] {
        for line in own.iter().filter(|line| !other.contains(line)) {
            let (path, text) = line;
            let path_shown = if path.is_empty() { String::new() } else { format!("{path}: ") };
            of_parts.entry(path).or_default().push(format!("  {mark} {path_shown}{text}"));
        }
    }
    let all: Vec<String> = of_parts.into_values().flatten().collect();
    if !all.is_empty() {
        say!("configuration (-: only in the first, +: only in the second):");
    } else if a != b {
        say!("configuration: the same lines in another order");
    }
    for line in all.iter().take(LINES) {
        say!("{line}");
    }
    if all.len() > LINES {
        say!("  … and {} more lines", all.len() - LINES);
    }
    a != b
}

/// A line of the table.
struct Row {
    name: String,
    a: f64,
    b: f64,
    unit: String,
}

impl Row {
    /// Whether the values differ by more than the tolerance. Two missing values are equal.
    fn differs(&self, tolerances: &Tolerances) -> bool {
        let (abs, rel) = tolerances.at(&self.name, path_matches);
        let least = abs + rel * self.a.abs().max(self.b.abs());
        let equal = self.a == self.b || (self.a.is_nan() && self.b.is_nan());
        !equal && !((self.a - self.b).abs() <= least)
    }

    fn cells(&self) -> [String; 5] {
        let show = |x: f64| if x.is_nan() { "n/a".to_string() } else { number(x) };
        let change = self.b - self.a;
        let share = match 100.0 * change / self.a.abs() {
            s if s.is_finite() && change != 0.0 => format!("{s:+.2} %"),
            _ => String::new(),
        };
        let sign = if change > 0.0 { "+" } else { "" };
        let change =
            if change.is_nan() { "n/a".into() } else { format!("{sign}{}", number(change)) };
        [self.name.clone(), show(self.a), show(self.b), format!("{change} {}", self.unit), share]
    }
}

/// Prints cells in aligned columns: the first one to the left, the others to the right.
fn print(rows: &[[String; 5]]) {
    let width = |k: usize| rows.iter().map(|r| r[k].chars().count()).max().unwrap_or(0);
    let [n, a, b, d, s] = [0, 1, 2, 3, 4].map(width);
    for [name, x, y, change, share] in rows {
        let line = format!("  {name:n$}  {x:>a$}  {y:>b$}  {change:<d$}  {share:>s$}");
        say!("{}", line.trim_end());
    }
}

/// Returns both inputs, or prints the errors of those that cannot be read.
pub fn both<T>(x: Result<T, String>, y: Result<T, String>) -> Option<(T, T)> {
    match (x, y) {
        (Ok(x), Ok(y)) => Some((x, y)),
        (x, y) => {
            for e in [x.err(), y.err()].into_iter().flatten() {
                tell!("error: {e}");
            }
            None
        }
    }
}

/// Compares two runs. The exit code is 1 if a metric, or without tolerances the configuration, differs.
pub fn compare(a: &Path, b: &Path, tolerances: &Tolerances) -> u8 {
    let Some((x, y)) = both(read(a), read(b)) else { return exit::INPUT };
    let names: BTreeSet<&String> = x.metrics.keys().chain(y.metrics.keys()).collect();
    let mut rows =
        vec![Row { name: "simulated time".into(), a: x.time, b: y.time, unit: "s".into() }];
    let mut other_units = Vec::new();
    for name in names {
        match (x.metrics.get(name), y.metrics.get(name)) {
            (Some((_, p)), Some((_, q))) if p != q => {
                other_units.push(format!("`{name}` [{p}] and [{q}]"))
            }
            (p, q) => {
                let unit = p.or(q).map_or_else(String::new, |v| v.1.clone());
                let unit = if unit == "1" { String::new() } else { unit };
                let [a, b] = [p, q].map(|v| v.map_or(f64::NAN, |v| v.0));
                rows.push(Row { name: name.clone(), a, b, unit });
            }
        }
    }
    if !other_units.is_empty() {
        tell!(
            "error: metrics have different units in the two runs: {}\n  help: run both with the same `unit`",
            other_units.join(", ")
        );
        return exit::INPUT;
    }
    let unused = tolerances
        .of
        .iter()
        .find(|(pattern, ..)| !rows.iter().any(|r| path_matches(pattern, &r.name)));
    if let Some((pattern, ..)) = unused {
        tell!(
            "error: --tol `{pattern}` matches no metric\n  help: the comparison without --tol lists the metrics"
        );
        return exit::INPUT;
    }
    let changed = match (&x.configuration, &y.configuration) {
        (Some(p), Some(q)) => changes(p, q),
        _ => {
            say!("configuration: not compared, because a folder has no run.mcap");
            false
        }
    };
    let exact =
        tolerances.absolute == 0.0 && tolerances.relative == 0.0 && tolerances.of.is_empty();
    let differ = rows.iter().filter(|r| r.differs(tolerances)).count();
    say!("metrics: {differ} of {} differ", rows.len());
    let [first, second] = [a, b].map(|p| p.display().to_string());
    let heads = [String::new(), first, second, "difference".into(), String::new()];
    let cells: Vec<[String; 5]> = [heads].into_iter().chain(rows.iter().map(Row::cells)).collect();
    print(&cells);
    if differ > 0 || (exact && changed) { exit::FAILED } else { exit::OK }
}
