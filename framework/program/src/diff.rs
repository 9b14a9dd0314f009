//! `linkwork diff`: two runs, two logs, two checkpoints or two recordings, with tolerances.
use crate::{compare_runs, exit};
use clap::Args;
use linkwork_assembly::patterns::path_matches;
use linkwork_record::{Difference, End, Rows, Series, Tolerances, compare, read_log_with_poses};
use linkwork_runtime::Checkpoint;
use std::collections::BTreeMap;
use std::path::Path;

/// Content of a file.
struct Contents {
    series: BTreeMap<String, Series>,
    /// The configuration of the run, if the file contains one.
    configuration: String,
    /// Stores of parts, by name.
    stores: BTreeMap<String, Vec<u8>>,
}

impl From<BTreeMap<String, Series>> for Contents {
    fn from(series: BTreeMap<String, Series>) -> Contents {
        Contents { series, configuration: String::new(), stores: BTreeMap::new() }
    }
}

fn read(path: &Path) -> Result<Contents, String> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("mcap") => read_whole_log(path),
        Some("lwck") => {
            let c = Checkpoint::read(path)
                .map_err(|e| format!("{e}\n  help: give a complete .lwck file that a run wrote"))?;
            let values = c.lanes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b));
            let one = |y: f64| Series { t: vec![c.time], y: vec![y], unit: String::new() };
            let n = c.layout.len();
            let signals: Vec<String> = c
                .extra
                .get("signals")
                .and_then(|b| rmp_serde::from_slice(b).ok())
                .unwrap_or_default();
            let pins = c.pins.iter().map(|(path, y)| (format!("pin of {path}"), one(*y)));
            let phase = ("phase (its index in the file)".to_string(), one(c.instant.phase.into()));
            let series = values
                .enumerate()
                .map(|(k, y)| {
                    let name =
                        c.layout.get(k).or_else(|| signals.get(k - n).filter(|s| !s.is_empty()));
                    // A state and an output can have the same name; then show the number of the signal.
                    let taken = k >= n && name.is_some_and(|s| c.layout.contains(s));
                    let name = name.filter(|_| !taken).cloned();
                    (name.unwrap_or_else(|| format!("signal slot {}", k - n)), one(y))
                })
                .chain(pins)
                .chain([phase])
                .collect();
            let stores =
                c.stores.iter().map(|(part, bytes)| (format!("store of {part}"), bytes.clone()));
            Ok(Contents { series, stores: stores.collect(), configuration: c.configuration })
        }
        Some("rrd") => Ok(read_recording(path)?.into()),
        _ => Err(format!(
            "`{}` is neither a log (.mcap), a checkpoint (.lwck), a recording (.rrd) nor a run (a folder, or summary.json)\n  help: give two files of one kind, or two folders of runs",
            path.display()
        )),
    }
}

/// Reads the content of a recording.
#[cfg(feature = "viewer")]
fn read_recording(path: &Path) -> Result<BTreeMap<String, Series>, String> {
    let shown = linkwork_viz::read_recording(path).map_err(|e| {
        format!("{e}\n  help: give a complete .rrd file that a run or `linkwork view` wrote")
    })?;
    let series = |(t, y)| Series { t, y, unit: String::new() };
    Ok(shown.into_iter().map(|(name, shown)| (name, series(shown))).collect())
}

/// Without the feature, recordings cannot be read.
#[cfg(not(feature = "viewer"))]
fn read_recording(path: &Path) -> Result<BTreeMap<String, Series>, String> {
    Err(format!(
        "`{}`: this program was built without the viewer\n  help: build it with the feature `viewer`, or compare logs",
        path.display()
    ))
}

/// Reads a complete log. A truncated or empty log cannot be compared.
fn read_whole_log(path: &Path) -> Result<Contents, String> {
    let log = read_log_with_poses(path).map_err(|e| e.to_string())?;
    let name = path.display();
    if let End::Cut { at } = log.end {
        let last = log.series.values().filter_map(|s| s.t.last()).copied().fold(0.0, f64::max);
        return Err(format!(
            "log `{name}` is truncated after {at} bytes, at t = {last} s\n  help: the run was killed, or \
             the copy is incomplete; continue from the last checkpoint with `linkwork resume`, or compare checkpoints"
        ));
    }
    if log.series.is_empty() {
        return Err(format!(
            "log `{name}` does not contain numbers\n  help: select variables in `log` of the simulation"
        ));
    }
    Ok(Contents { series: log.series, configuration: log.configuration, stores: BTreeMap::new() })
}

/// Returns the first line in which two configurations differ.
fn first_line(a: &str, b: &str) -> Option<String> {
    let (mut x, mut y) = (a.lines(), b.lines());
    (1..).find_map(|n| match (x.next(), y.next()) {
        (None, None) => Some(None),
        (p, q) if p == q => None,
        (p, q) => {
            let shown =
                |line: Option<&str>| line.map_or("no line".into(), |l| format!("`{}`", l.trim()));
            Some(Some(format!("line {n}: {} against {}", shown(p), shown(q))))
        }
    })?
}

/// Options of the comparison.
#[derive(Args, Clone, Debug, Default)]
pub struct DiffOptions {
    /// Absolute tolerance.
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pub abs: f64,
    /// Relative tolerance.
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pub rel: f64,
    /// Tolerances of the names that match a pattern (repeatable; the last match counts): 'Rover.**.torque=1e-6' is absolute, '**.angle=1e-9,1e-6'
    /// absolute and relative.
    #[arg(long = "tol", value_name = "PATTERN=ABS[,REL]")]
    pub tolerances: Vec<String>,
    /// Compare only common samples: for logs with different rates or different start or end times.
    #[arg(long)]
    pub common: bool,
}

/// Parses the tolerances, or returns an error message.
fn tolerances(options: &DiffOptions) -> Result<Tolerances, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| *x >= 0.0);
    let mut of = Vec::new();
    for text in &options.tolerances {
        let read = text.rsplit_once('=').and_then(|(pattern, numbers)| {
            let (a, r) = numbers.split_once(',').unwrap_or((numbers, "0"));
            Some((pattern.trim().to_string(), number(a)?, number(r)?))
        });
        of.push(read.ok_or_else(|| {
            format!("--tol `{text}` is not a tolerance\n  help: write 'PATTERN=1e-6' or 'PATTERN=1e-9,1e-6'")
        })?);
    }
    let general = [("--abs", options.abs), ("--rel", options.rel)];
    if let Some((name, x)) = general.into_iter().find(|(_, x)| !(*x >= 0.0)) {
        return Err(format!("{name} is {x}\n  help: write a number that is not negative"));
    }
    Ok(Tolerances { absolute: options.abs, relative: options.rel, of })
}

/// Prints the series that differ by more than `abs + rel · max(|a|, |b|)`.
pub fn diff(a: &Path, b: &Path, options: &DiffOptions) -> u8 {
    let tolerances = match tolerances(options) {
        Ok(tolerances) => tolerances,
        Err(e) => {
            tell!("error: {e}");
            return exit::INPUT;
        }
    };
    if compare_runs::is_run(a) && compare_runs::is_run(b) {
        if options.common {
            tell!(
                "error: --common has no effect on metrics\n  help: leave it out, or compare the logs run.mcap"
            );
            return exit::INPUT;
        }
        return compare_runs::compare(a, b, &tolerances);
    }
    let Some((x, y)) = compare_runs::both(read(a), read(b)) else { return exit::INPUT };
    let unused = tolerances.of.iter().find(|(pattern, ..)| {
        !x.series.keys().chain(y.series.keys()).any(|name| path_matches(pattern, name))
    });
    if let Some((pattern, ..)) = unused {
        tell!(
            "error: --tol `{pattern}` matches nothing\n  help: names are `Part.output`; `*` is one part of a path, `**` any number"
        );
        return exit::INPUT;
    }
    let rows = if options.common { Rows::Common } else { Rows::All };
    let (abs, rel) = (options.abs, options.rel);
    let own = |name: &str| tolerances.at(name, path_matches);
    let mut differences: Vec<Difference> = compare(&x.series, &y.series, rows, own);
    let names: std::collections::BTreeSet<&String> =
        x.stores.keys().chain(y.stores.keys()).collect();
    for name in names.into_iter().filter(|name| x.stores.get(*name) != y.stores.get(*name)) {
        let (a, b) =
            (x.stores.get(name).map_or(0, Vec::len), y.stores.get(name).map_or(0, Vec::len));
        let what = format!("{a} bytes against {b}, or different bytes");
        differences.push(Difference { name: name.clone(), what, largest: f64::INFINITY });
    }
    let exact = !options.common && abs == 0.0 && rel == 0.0 && tolerances.of.is_empty();
    let other = first_line(&x.configuration, &y.configuration);
    let series = x.series.len().max(y.series.len());
    // Different configurations are not an error with tolerances or `--common`, because users then compare runs with different settings.
    let failed = !differences.is_empty() || (exact && other.is_some());
    if let Some(line) = &other {
        match exact {
            // The settings explain the differences, so they come first.
            true => say!("the configuration differs in {line}"),
            false => tell!("note: the configurations differ in {line}"),
        }
    }
    if !failed {
        let by = match tolerances.of.len() {
            0 => String::new(),
            n => format!(", and by {n} patterns"),
        };
        let at = if options.common { ", at common samples" } else { "" };
        say!("equal: {series} series within abs {abs:e}, rel {rel:e}{by}{at}");
        return exit::OK;
    }
    // Stores of parts are compared as well.
    let names = [x.series.keys(), y.series.keys()].into_iter().flatten();
    let names: std::collections::BTreeSet<&String> =
        names.chain(x.stores.keys()).chain(y.stores.keys()).collect();
    say!("{} of {} series differ (abs {abs:e}, rel {rel:e}):", differences.len(), names.len());
    for d in differences.iter().take(40) {
        say!("  {:12.3e}  {}: {}", d.largest, d.name, d.what);
    }
    if differences.len() > 40 {
        say!("  … and {} more", differences.len() - 40);
    }
    exit::FAILED
}
