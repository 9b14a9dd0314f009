//! Time histories of selected variables: every run keeps its samples, and together they give percentile bands over time.
//!
//! ```text
//! retain: (of: ["Capsule.altitude"], every: "1 s")  →  histories/run_N.parquet  →  bands.csv, bands.parquet, report
//! ```
//! Samples are taken in the thread of the run, at the first tick at or after each multiple of the period. Sample k of every run is therefore at the
//! same instant; campaigns with different steps are rejected. The file of a run is complete before its outcome is reported, and the outcome contains
//! its checksum. A history that was lost in a power failure or changed is made again.
use crate::results::{Column, Table};
use crate::statistics::percentile;
use linkwork_record::{Cells, Durable, ParquetFile, parquet_columns, replace, titled};
use linkwork_runtime::{Place, Plan, Schedule, Seconds, Simulation};
use std::path::{Path, PathBuf};

/// Largest number of values that a run may retain: 160 MB.
pub(crate) const MOST: u64 = 20_000_000;

/// Largest number of instants of the bands, and largest number of values in memory.
const INSTANTS: usize = 500;
const HELD: usize = 1 << 24;

/// Title of the column of times.
const TIME: &str = "time [s]";

/// The retained variables of every run.
#[derive(Clone, Debug, PartialEq)]
pub struct Retained {
    /// Variables: path and unit, sorted by path.
    pub variables: Vec<(String, String)>,
    /// Sample period.
    pub every: Seconds,
}

/// The samples of an active run.
pub(crate) struct History {
    places: Vec<Place>,
    schedule: Schedule,
    times: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

impl History {
    /// Creates a history at the start of a run. The variables are those of the plan with which the campaign was read.
    pub(crate) fn new(
        retained: &Retained,
        plan: &Plan,
    ) -> Result<History, linkwork_runtime::VariableError> {
        let place = |(path, _): &(String, String)| plan.variable(path).map(|v| v.place);
        let places = retained.variables.iter().map(place).collect::<Result<Vec<_>, _>>()?;
        let columns = vec![Vec::new(); places.len()];
        let schedule = Schedule::from(0, plan.base, retained.every);
        Ok(History { places, schedule, times: Vec::new(), columns })
    }

    /// Takes the sample of this tick if it is due.
    pub(crate) fn sample(&mut self, sim: &Simulation) {
        if !self.schedule.is_due(sim.state().tick) {
            return;
        }
        self.times.push(sim.time());
        for (column, place) in self.columns.iter_mut().zip(&self.places) {
            column.push(sim.value(*place));
        }
    }

    /// Writes the file of a run and returns its checksum.
    pub(crate) fn write(
        &self,
        folder: &Path,
        run: u64,
        retained: &Retained,
    ) -> Result<u32, (PathBuf, String)> {
        let path = file(folder, run);
        let parquet = || {
            let titles: Vec<String> =
                retained.variables.iter().map(|(n, u)| titled(n, u)).collect();
            let numbers = || {
                let values = titles.iter().map(String::as_str).zip(&self.columns);
                std::iter::once((TIME, &self.times)).chain(values)
            };
            let like = numbers().map(|(title, v)| (title, Cells::Number(v)));
            let about = [("linkwork.run".to_string(), run.to_string())];
            let mut file = ParquetFile::new(Vec::new(), "history", like, about)?;
            file.rows(numbers().map(|(_, v)| Cells::Number(v)))?;
            file.finish()
        };
        let write = || -> Result<u32, String> {
            let bytes = parquet()?;
            std::fs::create_dir_all(self::folder(folder)).map_err(|e| e.to_string())?;
            // Not synchronized with the disk, because a thousand runs would wait for it a thousand times.
            replace(&path, &bytes, Durable::Later)?;
            Ok(crc32fast::hash(&bytes))
        };
        write().map_err(|why| (path.clone(), why))
    }
}

/// Returns the folder of the histories in a campaign's folder.
fn folder(campaign: &Path) -> PathBuf {
    campaign.join("histories")
}

/// Returns the path of the file of a run.
fn file(campaign: &Path, run: u64) -> PathBuf {
    folder(campaign).join(format!("run_{run}.parquet"))
}

/// Removes the file of a run.
pub(crate) fn remove(campaign: &Path, run: u64) {
    let _ = std::fs::remove_file(file(campaign, run));
}

/// Returns the content of the file of a run, if it is unchanged.
fn as_written(campaign: &Path, run: u64, checksum: u32) -> Option<Vec<u8>> {
    std::fs::read(file(campaign, run)).ok().filter(|bytes| crc32fast::hash(bytes) == checksum)
}

/// Returns whether the file of a run is unchanged. A run whose file is not is repeated.
pub(crate) fn is_whole(campaign: &Path, run: u64, checksum: u32) -> bool {
    as_written(campaign, run, checksum).is_some()
}

/// Distribution of one variable over the runs at each instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Path.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Instants (s).
    pub times: Vec<f64>,
    /// Number of runs with a value at each instant.
    pub n: Vec<u64>,
    /// The percentiles of [`BAND`] at each instant.
    pub levels: [Vec<f64>; 7],
}

/// The percentiles of a band, and their titles.
pub const BAND: [(f64, &str); 7] = [
    (0.0, "min"),
    (0.05, "p5"),
    (0.25, "p25"),
    (0.5, "median"),
    (0.75, "p75"),
    (0.95, "p95"),
    (1.0, "max"),
];

/// Returns the unchanged history of a run, as columns with these titles; `None` if it is missing or has changed.
fn read(
    campaign: &Path,
    (run, checksum): (u64, u32),
    titles: &[&str],
) -> Result<Option<Vec<Vec<f64>>>, String> {
    let Some(bytes) = as_written(campaign, run, checksum) else { return Ok(None) };
    parquet_columns(bytes, titles).map(Some).map_err(|e| {
        let path = file(campaign, run);
        format!("`{}` cannot be read: {e}; if you remove it, its run is repeated", path.display())
    })
}

/// Calls `f` for each of `all` with several threads; returns the results in order.
fn each<T: Sync, R: Send>(threads: usize, all: &[T], f: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let part = all.len().div_ceil(threads.max(1)).max(1);
    std::thread::scope(|scope| {
        let parts: Vec<_> = all.chunks(part).collect();
        let under: Vec<_> = (parts.into_iter())
            .map(|part| scope.spawn(|| part.iter().map(&f).collect::<Vec<R>>()))
            .collect();
        let joined = under.into_iter().flat_map(|thread| match thread.join() {
            Ok(made) => made,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        joined.collect()
    })
}

/// Returns the bands of the given runs whose histories are unchanged, and the number of these runs. If there are very many samples, [`INSTANTS`]
/// evenly spaced instants are used. The variables are processed in groups that fit into [`HELD`] values. `kept`: runs with the checksums of their
/// histories. Cost: each history is read once for its length, and once per group of variables; each thread holds one history in memory.
///
/// # Errors
/// A message with the file that cannot be read.
pub(crate) fn bands(
    campaign: &Path,
    retained: &Retained,
    kept: &[(u64, u32)],
    threads: usize,
) -> Result<(Vec<Band>, usize), String> {
    let rows = each(threads, kept, |one| {
        Ok(read(campaign, *one, &[TIME])?.map(|columns| (*one, columns[0].len())))
    });
    let whole = rows.into_iter().filter_map(Result::transpose);
    let whole: Vec<((u64, u32), usize)> = whole.collect::<Result<_, String>>()?;
    // The first of the longest histories has all instants.
    let longest = whole.iter().rev().max_by_key(|(_, rows)| *rows).map(|(one, _)| *one);
    let again = |one: (u64, u32), titles: &[&str]| {
        let changed =
            || format!("`{}` has changed during the evaluation", file(campaign, one.0).display());
        read(campaign, one, titles)?.ok_or_else(changed)
    };
    let all = longest.map_or(Ok(Vec::new()), |one| again(one, &[TIME]).map(|mut c| c.remove(0)))?;
    let most = INSTANTS.min(HELD / whole.len().max(1)).max(2);
    let every = all.len().div_ceil(most).max(1);
    let times: Vec<f64> = all.iter().copied().step_by(every).collect();
    let room = (HELD / (whole.len() * times.len()).max(1)).max(1);
    let mut bands = Vec::new();
    for variables in retained.variables.chunks(room) {
        let titles: Vec<String> = variables.iter().map(|(n, u)| titled(n, u)).collect();
        let titles: Vec<&str> =
            std::iter::once(TIME).chain(titles.iter().map(String::as_str)).collect();
        let thin = |values: Vec<f64>| values.into_iter().step_by(every).collect();
        let of_runs = each(threads, &whole, |(one, _)| {
            let mut columns = again(*one, &titles)?;
            if columns.remove(0).iter().zip(&all).any(|(a, b)| a != b) {
                return Err(format!(
                    "`{}`: its sample times differ from the sample times of other runs",
                    file(campaign, one.0).display()
                ));
            }
            Ok(columns.into_iter().map(thin).collect())
        });
        let of_runs = of_runs.into_iter().collect::<Result<Vec<Vec<Vec<f64>>>, String>>()?;
        let numbered: Vec<(usize, &(String, String))> = variables.iter().enumerate().collect();
        bands.extend(each(threads, &numbered, |(k, variable)| {
            let values = of_runs.iter().map(|columns| &columns[*k][..]);
            band(variable, &times, values)
        }));
    }
    Ok((bands, whole.len()))
}

/// Computes the band of one variable from its values in each run.
fn band<'a>(
    (name, unit): &(String, String),
    times: &[f64],
    runs: impl Iterator<Item = &'a [f64]>,
) -> Band {
    let mut at: Vec<Vec<f64>> = vec![Vec::new(); times.len()];
    for values in runs {
        for (at, y) in at.iter_mut().zip(values) {
            at.extend((!y.is_nan()).then_some(*y));
        }
    }
    at.iter_mut().for_each(|y| y.sort_unstable_by(f64::total_cmp));
    let levels = BAND.map(|(p, _)| at.iter().map(|y| percentile(y, p)).collect());
    let n = at.iter().map(|y| y.len() as u64).collect();
    Band { name: name.clone(), unit: unit.clone(), times: times.to_vec(), n, levels }
}

/// Returns a table with a row per variable and instant.
pub(crate) fn table(bands: &[Band]) -> Table {
    let text = |of: &dyn Fn(&Band) -> &String| {
        let all = bands.iter().flat_map(|b| std::iter::repeat_n(of(b).clone(), b.times.len()));
        Column::Text(all.collect())
    };
    let number = |of: &dyn Fn(&Band) -> &[f64]| {
        Column::Number(bands.iter().flat_map(|b| of(b).iter().copied()).collect())
    };
    let mut columns = vec![
        ("variable".to_string(), text(&|b| &b.name)),
        ("unit".to_string(), text(&|b| &b.unit)),
        (TIME.to_string(), number(&|b| &b.times)),
        ("n".to_string(), Column::Whole(bands.iter().flat_map(|b| b.n.iter().copied()).collect())),
    ];
    for (k, (_, title)) in BAND.iter().enumerate() {
        columns.push(((*title).to_string(), number(&|b| &b.levels[k])));
    }
    Table { columns }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn retained() -> Retained {
        Retained { variables: vec![("a.x".into(), "m".into())], every: Seconds::new(1, 2).unwrap() }
    }

    fn keep(folder: &Path, run: u64, times: &[f64], values: &[f64]) -> u32 {
        let history = History {
            places: Vec::new(),
            schedule: Schedule::from(0, Seconds::new(1, 1).unwrap(), Seconds::new(1, 1).unwrap()),
            times: times.to_vec(),
            columns: vec![values.to_vec()],
        };
        history.write(folder, run, &retained()).unwrap()
    }

    #[test]
    fn bands_by_hand_with_runs_that_end_sooner_and_values_that_are_not_there() {
        let folder = tempfile::tempdir().unwrap();
        let first = keep(folder.path(), 0, &[0.0, 0.5, 1.0], &[1.0, 2.0, 3.0]);
        let other = keep(folder.path(), 4, &[0.0, 0.5], &[3.0, f64::NAN]);
        // The history of run 2 is missing, and the history of run 3 has changed.
        keep(folder.path(), 3, &[0.0], &[9.0]);
        let kept = [(0, first), (2, first), (3, first), (4, other)];
        let (bands, whole) = bands(folder.path(), &retained(), &kept, 2).unwrap();
        assert_eq!(whole, 2);
        let [band] = &bands[..] else { panic!("{bands:?}") };
        assert_eq!((&band.times[..], &band.n[..]), (&[0.0, 0.5, 1.0][..], &[2, 1, 1][..]));
        let [min, _, p25, median, _, _, max] = &band.levels;
        assert_eq!((&min[..], &max[..]), (&[1.0, 2.0, 3.0][..], &[3.0, 2.0, 3.0][..]));
        assert_eq!((&p25[..], &median[..]), (&[1.5, 2.0, 3.0][..], &[2.0, 2.0, 3.0][..]));
        let table = table(&bands);
        assert!(table.columns.iter().all(|c| c.1.len() == 3), "{table:?}");
    }

    #[test]
    fn rows_at_other_times_are_no_band() {
        let folder = tempfile::tempdir().unwrap();
        let first = keep(folder.path(), 0, &[0.0, 0.5], &[1.0, 2.0]);
        let other = keep(folder.path(), 1, &[0.0, 0.4], &[1.0, 2.0]);
        let e = bands(folder.path(), &retained(), &[(0, first), (1, other)], 1).unwrap_err();
        assert!(e.contains("run_1.parquet") && e.contains("sample times differ"), "{e}");
    }

    #[test]
    fn long_histories_are_thinned_evenly() {
        let folder = tempfile::tempdir().unwrap();
        let times: Vec<f64> = (0..2001).map(|k| f64::from(k) / 2.0).collect();
        let sum = keep(folder.path(), 0, &times, &times);
        let (bands, _) = bands(folder.path(), &retained(), &[(0, sum)], 3).unwrap();
        assert!(bands[0].times.len() <= INSTANTS && bands[0].times.len() > INSTANTS / 2);
        assert_eq!((bands[0].times[1], bands[0].levels[3][1]), (2.5, 2.5));
    }

    #[test]
    fn a_file_with_any_other_byte_is_none() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!is_whole(folder.path(), 0, 0));
        let sum = keep(folder.path(), 0, &[0.0], &[1.0]);
        assert!(is_whole(folder.path(), 0, sum) && !is_whole(folder.path(), 1, sum));
        let path = file(folder.path(), 0);
        let bytes = std::fs::read(&path).unwrap();
        for at in 0..bytes.len() {
            let mut wrong = bytes.clone();
            wrong[at] ^= 1 << (at % 8);
            std::fs::write(&path, wrong).unwrap();
            assert!(!is_whole(folder.path(), 0, sum), "byte {at}");
        }
        for cut in [0, 4, bytes.len() - 1] {
            std::fs::write(&path, &bytes[..cut]).unwrap();
            assert!(!is_whole(folder.path(), 0, sum), "cut at {cut}");
        }
    }
}
