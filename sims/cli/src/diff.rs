//! `linkwork diff`: two logs or two checkpoints, with tolerances.
use crate::exit;
use linkwork_record::{Difference, End, Series, compare, read_log_contents};
use linkwork_runtime::Checkpoint;
use std::collections::BTreeMap;
use std::path::Path;

type Named = BTreeMap<String, Series>;

fn read(path: &Path) -> Result<Named, String> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("mcap") => read_whole_log(path),
        Some("lwck") => {
            let c = Checkpoint::read(path)
                .map_err(|e| format!("{e}\n  help: give a .lwck file that a run wrote, whole"))?;
            let values = c.lanes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b));
            let one = |y: f64| Series { t: vec![c.time], y: vec![y], unit: String::new() };
            let n = c.layout.len();
            let signals: Vec<String> = c
                .extra
                .get("signals")
                .and_then(|b| rmp_serde::from_slice(b).ok())
                .unwrap_or_default();
            Ok(values
                .enumerate()
                .map(|(k, y)| {
                    let name =
                        c.layout.get(k).or_else(|| signals.get(k - n).filter(|s| !s.is_empty()));
                    // A state and an output may share a name.
                    let taken = k >= n && name.is_some_and(|s| c.layout.contains(s));
                    let name = name.filter(|_| !taken).cloned();
                    (name.unwrap_or_else(|| format!("signal lane {}", k - n)), one(y))
                })
                .collect())
        }
        _ => Err(format!(
            "`{}` is neither a log (.mcap) nor a checkpoint (.lwck)\n  help: give two files of one kind",
            path.display()
        )),
    }
}

/// A log that was cut, or that holds nothing, equals no other.
fn read_whole_log(path: &Path) -> Result<Named, String> {
    let log = read_log_contents(path).map_err(|e| e.to_string())?;
    let name = path.display();
    if let End::Cut { at } = log.end {
        let last = log.series.values().filter_map(|s| s.t.last()).copied().fold(0.0, f64::max);
        return Err(format!(
            "log `{name}` has no end: it was cut after {at} bytes, at t = {last} s\n  help: the run was killed, or \
             the copy is cut; go on from the last checkpoint with `linkwork resume`, or compare checkpoints"
        ));
    }
    if log.series.is_empty() {
        return Err(format!(
            "log `{name}` holds no numbers\n  help: say in `log` of the simulation what to log"
        ));
    }
    Ok(log.series)
}

/// Prints what differs by more than `abs + rel · max(|a|, |b|)`.
pub fn diff(a: &Path, b: &Path, abs: f64, rel: f64) -> u8 {
    let (x, y) = match (read(a), read(b)) {
        (Ok(x), Ok(y)) => (x, y),
        (x, y) => {
            for e in [x.err(), y.err()].into_iter().flatten() {
                tell!("error: {e}");
            }
            return exit::INPUT;
        }
    };
    let differences: Vec<Difference> = compare(&x, &y, abs, rel);
    if differences.is_empty() {
        say!("equal: {} series within abs {abs:e}, rel {rel:e}", x.len());
        return exit::OK;
    }
    say!(
        "{} of {} series differ (abs {abs:e}, rel {rel:e}):",
        differences.len(),
        x.len().max(y.len())
    );
    for d in differences.iter().take(40) {
        say!("  {:12.3e}  {}: {}", d.largest, d.name, d.what);
    }
    if differences.len() > 40 {
        say!("  … and {} more", differences.len() - 40);
    }
    exit::FAILED
}
