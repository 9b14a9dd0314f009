//! The results as columns and as files (CSV, Parquet).
//!
//! | file | one row per | columns |
//! |---|---|---|
//! | `results` | run | run, ended, why, missed (where something is required), time \[s\], seed, state, drawn values (`draw:NAME [UNIT]`), when each phase began last (`phase:NAME [s]`, NaN if it never did), metrics (`NAME [UNIT]`) |
//! | `statistics` | metric | metric, unit, n, mean, deviation, error, min, p1 … p99, max |
//! | `sensitivity` | metric and drawn number | metric, value, rank correlation |
//! | `ellipses` | scatter plot of two metrics of one unit | x, y, unit, n, centre, half axes of the ellipses of one deviation and of 99 %, angle, number of runs in the latter |
//! | `requirements` | requirement | cause, metric, unit, least, most, runs that missed, share of all, runs that missed it alone |
//! | `bands` | retained variable and instant | variable, unit, time \[s\], n, min, p5 … p95, max |
//!
//! Rows are in the order of the runs. They do not depend on when, or with how many threads, the runs were made.
use crate::campaign::{Aim, Campaign};
use crate::histories::{Band, bands, table};
use crate::journal::Journal;
use crate::outcome::{Cause, Outcome};
use crate::sampling::Sampling;
use crate::statistics::{Ellipse, Summary, rank_correlation, share};
use linkwork_record::{Cells, Durable, ParquetFile, replace, titled};
use linkwork_runtime::Value;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Lists the first `most` of some runs, in words.
pub fn few(runs: &[u64], most: usize) -> String {
    let first: Vec<String> = runs.iter().take(most).map(u64::to_string).collect();
    let more = if runs.len() > most { ", …" } else { "" };
    format!("{}{more}", first.join(", "))
}

/// The values of one column.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// Integers.
    Whole(Vec<u64>),
    /// Numbers; NaN for missing values.
    Number(Vec<f64>),
    /// Texts.
    Text(Vec<String>),
}

impl Column {
    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        match self {
            Column::Whole(v) => v.len(),
            Column::Number(v) => v.len(),
            Column::Text(v) => v.len(),
        }
    }

    /// Returns whether it is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn cells(&self) -> Cells<'_> {
        match self {
            Column::Whole(v) => Cells::Whole(v),
            Column::Number(v) => Cells::Number(v),
            Column::Text(v) => Cells::Text(v),
        }
    }
}

/// Columns by name, all of equal length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Name and values.
    pub columns: Vec<(String, Column)>,
}

/// The cause of a run in which a required metric does not have a value.
const NEVER: &str = "a required metric does not have a value: its variable never existed in this run or its condition never held";

/// A requirement, and the runs that violated it.
#[derive(Clone, Debug, PartialEq)]
pub struct Missed {
    /// Description of the failure.
    pub cause: String,
    /// The requirement; `None`: any required metric does not have a value.
    pub aim: Option<Aim>,
    /// Runs that violated it.
    pub runs: Vec<u64>,
    /// Number of runs that violated only this requirement.
    pub alone: usize,
}

/// The ellipse of two metrics.
#[derive(Clone, Debug, PartialEq)]
pub struct Footprint {
    /// Positions of the two metrics in [`Results::metrics`].
    pub of: [usize; 2],
    /// The ellipse of one deviation, in the units of the metrics.
    pub ellipse: Ellipse,
    /// Number of runs within the ellipse of [`PROBABILITY`], and number of runs with both metrics.
    pub within: (usize, usize),
}

impl Footprint {
    /// Returns the half axes of the ellipse of [`PROBABILITY`], the longer first, in the unit of the metrics.
    pub fn half_axes(&self) -> (f64, f64) {
        let k = Ellipse::deviations(PROBABILITY);
        (k * self.ellipse.axes.0, k * self.ellipse.axes.1)
    }
}

/// The probability of the ellipse whose half axes are reported.
pub const PROBABILITY: f64 = 0.99;

/// The results of a campaign.
pub struct Results {
    /// A row per run that has ended.
    pub runs: Table,
    /// Names of the drawn numbers, and their values in the orderly runs.
    pub drawn: Vec<(String, Vec<f64>)>,
    /// Names, units and values of the metrics in the orderly runs.
    pub metrics: Vec<(String, String, Vec<f64>)>,
    /// Summaries, in the order of the metrics.
    pub summaries: Vec<Summary>,
    /// Rank correlations of each metric with each drawn number.
    pub sensitivity: Vec<Vec<f64>>,
    /// The scatter plots of the campaign: names of two metrics or sampled parameters.
    pub scatter: Vec<[String; 2]>,
    /// Ellipses of the scatter plots of two metrics of one unit.
    pub ellipses: Vec<Footprint>,
    /// Distributions of the retained variables over the orderly runs.
    pub bands: Vec<Band>,
    /// Number of runs in the bands, and number of orderly runs.
    pub bands_of: (usize, usize),
    /// The requirements, and the orderly runs that violated them, in the order of the campaign's file.
    pub missed: Vec<Missed>,
    /// Number of orderly runs that satisfied all requirements; all orderly runs without requirements.
    pub kept: usize,
    /// Causes of failures: kind, runs.
    pub failures: Vec<(String, Vec<u64>)>,
    /// Number of runs by the way in which they ended.
    pub causes: Vec<(Cause, usize)>,
    /// The sampling method.
    pub sampling: Sampling,
}

impl Results {
    /// Computes the results of all runs that have ended.
    pub fn new(campaign: &Campaign, journal: &Journal) -> Results {
        let outcomes: Vec<&Outcome> = journal.outcomes.values().collect();
        let draws: Vec<Vec<Value>> = outcomes.iter().map(|o| campaign.draws(o.run)).collect();
        let orderly: Vec<usize> =
            (0..outcomes.len()).filter(|k| outcomes[*k].ended.is_orderly()).collect();
        let number = |v: &Value| if let Value::Number(x) = v { *x } else { f64::NAN };
        let mut columns = vec![
            ("run".to_string(), Column::Whole(outcomes.iter().map(|o| o.run).collect())),
            (
                "ended".to_string(),
                Column::Text(outcomes.iter().map(|o| o.ended.name().into()).collect()),
            ),
            ("why".to_string(), Column::Text(outcomes.iter().map(|o| o.why.clone()).collect())),
            ("time [s]".to_string(), Column::Number(outcomes.iter().map(|o| o.time).collect())),
            // Integers are written as texts, because readers round integers above 2⁵³.
            (
                "seed".to_string(),
                Column::Text(outcomes.iter().map(|o| o.seed.to_string()).collect()),
            ),
            (
                "state".to_string(),
                Column::Text(outcomes.iter().map(|o| format!("{:016x}", o.hash)).collect()),
            ),
        ];
        let mut drawn: Vec<(String, Vec<f64>)> = Vec::new();
        for (k, d) in campaign.form().drawn.iter().enumerate() {
            let title = titled(&format!("draw:{}", d.name), &d.unit);
            let numeric = draws.iter().all(|row| matches!(row[k], Value::Number(_)));
            if numeric {
                drawn.push((
                    titled(&d.name, &d.unit),
                    orderly.iter().map(|r| number(&draws[*r][k])).collect(),
                ));
                columns.push((
                    title,
                    Column::Number(draws.iter().map(|row| number(&row[k])).collect()),
                ));
            } else {
                let text = |v: &Value| match v {
                    Value::Text(t) => t.clone(),
                    other => other.to_string(),
                };
                columns
                    .push((title, Column::Text(draws.iter().map(|row| text(&row[k])).collect())));
            }
        }
        for (k, name) in campaign.phases().iter().enumerate() {
            let began = outcomes.iter().map(|o| o.phases.get(k).copied().unwrap_or(f64::NAN));
            columns.push((format!("phase:{name} [s]"), Column::Number(began.collect())));
        }
        let mut metrics: Vec<(String, String, Vec<f64>)> = Vec::new();
        for (k, (name, unit)) in campaign.metrics().iter().enumerate() {
            let one = |o: &Outcome| o.metrics.get(k).copied().unwrap_or(f64::NAN);
            metrics.push((
                name.clone(),
                unit.clone(),
                orderly.iter().map(|r| one(outcomes[*r])).collect(),
            ));
            columns.push((
                titled(name, unit),
                Column::Number(outcomes.iter().map(|o| one(o)).collect()),
            ));
        }
        let how = campaign.form().sampling;
        let summaries = metrics
            .iter()
            .map(|(_, _, y): &(String, String, Vec<f64>)| Summary::of(y, how))
            .collect();
        let sensitivity = metrics
            .iter()
            .map(|(_, _, y)| drawn.iter().map(|(_, x)| rank_correlation(x, y)).collect())
            .collect();
        let mut scatter: Vec<[String; 2]> =
            campaign.form().scatter.iter().map(|(a, b, _)| [a.clone(), b.clone()]).collect();
        if let ([], [a, b, ..]) = (&scatter[..], &metrics[..]) {
            scatter.push([a.0.clone(), b.0.clone()]);
        }
        let ellipses = scatter.iter().filter_map(|names| footprint(&metrics, names)).collect();
        let (failures, causes) = counted(&outcomes);
        let (missed, of_runs) = judged(campaign.aims(), &outcomes);
        let kept = orderly.iter().filter(|k| of_runs[**k].is_empty()).count();
        if !missed.is_empty() {
            let words = of_runs.iter().map(|aims| {
                let causes: Vec<&str> = aims.iter().map(|a| missed[*a].cause.as_str()).collect();
                causes.join("; ")
            });
            columns.insert(3, ("missed".to_string(), Column::Text(words.collect())));
        }
        Results {
            runs: Table { columns },
            drawn,
            metrics,
            summaries,
            sensitivity,
            scatter,
            ellipses,
            bands: Vec::new(),
            bands_of: (0, 0),
            missed,
            kept,
            failures,
            causes,
            sampling: how,
        }
    }

    /// Computes the bands from the histories of the orderly runs in the campaign's folder, with several threads.
    ///
    /// # Errors
    /// A message with the file that cannot be read.
    pub fn bands(
        &mut self,
        campaign: &Campaign,
        journal: &Journal,
        folder: &Path,
        threads: usize,
    ) -> Result<(), String> {
        let Some(retained) = campaign.retained() else { return Ok(()) };
        let orderly = || journal.outcomes.values().filter(|o| o.ended.is_orderly());
        let kept: Vec<_> = orderly().filter_map(|o| Some((o.run, o.history?))).collect();
        self.bands_of = (0, orderly().count());
        (self.bands, self.bands_of.0) = bands(folder, retained, &kept, threads)?;
        Ok(())
    }

    /// Returns a table with a row per metric.
    pub fn statistics(&self) -> Table {
        let mut columns = vec![
            (
                "metric".to_string(),
                Column::Text(self.metrics.iter().map(|f| f.0.clone()).collect()),
            ),
            ("unit".to_string(), Column::Text(self.metrics.iter().map(|f| f.1.clone()).collect())),
            ("n".to_string(), Column::Whole(self.summaries.iter().map(|s| s.n as u64).collect())),
        ];
        let mut number = |name: &str, of: &dyn Fn(&Summary) -> f64| {
            columns.push((name.into(), Column::Number(self.summaries.iter().map(of).collect())));
        };
        number("mean", &|s| s.mean);
        number("deviation", &|s| s.deviation);
        number("error", &|s| s.error);
        for (k, name) in NAMES.iter().enumerate() {
            number(name, &|s| s.percentiles[k]);
        }
        Table { columns }
    }

    /// Returns a table with a row per metric and drawn number.
    pub fn sensitivities(&self) -> Table {
        let (mut metric, mut value, mut rank) = (Vec::new(), Vec::new(), Vec::new());
        for ((name, ..), row) in self.metrics.iter().zip(&self.sensitivity) {
            for ((drawn, _), r) in self.drawn.iter().zip(row) {
                metric.push(name.clone());
                value.push(drawn.clone());
                rank.push(*r);
            }
        }
        let columns = vec![
            ("metric".to_string(), Column::Text(metric)),
            ("value".to_string(), Column::Text(value)),
            ("rank correlation".to_string(), Column::Number(rank)),
        ];
        Table { columns }
    }

    /// Returns a table with a row per ellipse.
    pub fn footprints(&self) -> Table {
        let text = |of: &dyn Fn(&Footprint) -> String| {
            Column::Text(self.ellipses.iter().map(of).collect())
        };
        let number =
            |of: &dyn Fn(&Footprint) -> f64| Column::Number(self.ellipses.iter().map(of).collect());
        let columns = vec![
            ("x".to_string(), text(&|f| self.metrics[f.of[0]].0.clone())),
            ("y".to_string(), text(&|f| self.metrics[f.of[1]].0.clone())),
            ("unit".to_string(), text(&|f| self.metrics[f.of[0]].1.clone())),
            (
                "n".to_string(),
                Column::Whole(self.ellipses.iter().map(|f| f.within.1 as u64).collect()),
            ),
            ("centre x".to_string(), number(&|f| f.ellipse.centre.0)),
            ("centre y".to_string(), number(&|f| f.ellipse.centre.1)),
            ("long half axis (1 sigma)".to_string(), number(&|f| f.ellipse.axes.0)),
            ("short half axis (1 sigma)".to_string(), number(&|f| f.ellipse.axes.1)),
            ("long half axis (99 %)".to_string(), number(&|f| f.half_axes().0)),
            ("short half axis (99 %)".to_string(), number(&|f| f.half_axes().1)),
            (
                "angle of the long axis from x to y [deg]".to_string(),
                number(&|f| f.ellipse.angle.to_degrees()),
            ),
            (
                "runs within 99 %".to_string(),
                Column::Whole(self.ellipses.iter().map(|f| f.within.0 as u64).collect()),
            ),
        ];
        Table { columns }
    }

    /// Returns the fraction of all runs so far that ended normally and satisfied all requirements, and its 95 % confidence interval (Wilson) if the
    /// runs are independent.
    pub fn success(&self) -> (f64, Option<[f64; 2]>) {
        let (share, interval) = share(self.kept, self.done());
        (share, (self.sampling == Sampling::Random).then_some(interval))
    }

    /// Returns the number of runs that have ended.
    pub fn done(&self) -> usize {
        self.runs.columns.first().map_or(0, |c| c.1.len())
    }

    /// Returns the fraction of all runs that violated a requirement; NaN without runs.
    pub fn share(&self, m: &Missed) -> f64 {
        share(m.runs.len(), self.done()).0
    }

    /// Describes a requirement in words: the metric and its bounds.
    pub fn required(&self, m: &Missed) -> String {
        let Some(Aim { metric, least, most, .. }) = &m.aim else { return String::new() };
        let (name, unit, _) = &self.metrics[*metric];
        let bounds = match (least.is_finite(), most.is_finite()) {
            (true, true) => format!("{least} to {most}"),
            (true, false) => format!("at least {least}"),
            _ => format!("at most {most}"),
        };
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        format!("{name} {bounds}{unit}")
    }

    /// Returns a table with a row per requirement.
    pub fn requirements(&self) -> Table {
        let text =
            |of: &dyn Fn(&Missed) -> String| Column::Text(self.missed.iter().map(of).collect());
        let number =
            |of: &dyn Fn(&Missed) -> f64| Column::Number(self.missed.iter().map(of).collect());
        let whole = |of: &dyn Fn(&Missed) -> usize| {
            Column::Whole(self.missed.iter().map(|m| of(m) as u64).collect())
        };
        let metric = |m: &Missed| m.aim.as_ref().map(|aim| &self.metrics[aim.metric]);
        let columns = vec![
            ("cause".to_string(), text(&|m| m.cause.clone())),
            ("metric".to_string(), text(&|m| metric(m).map_or_else(String::new, |f| f.0.clone()))),
            ("unit".to_string(), text(&|m| metric(m).map_or_else(String::new, |f| f.1.clone()))),
            ("least".to_string(), number(&|m| m.aim.as_ref().map_or(f64::NAN, |a| a.least))),
            ("most".to_string(), number(&|m| m.aim.as_ref().map_or(f64::NAN, |a| a.most))),
            ("runs".to_string(), whole(&|m| m.runs.len())),
            ("share".to_string(), number(&|m| self.share(m))),
            ("alone".to_string(), whole(&|m| m.alone)),
        ];
        Table { columns }
    }

    /// Writes `results`, `statistics`, `sensitivity` and, if there are any, `ellipses`, `requirements` and `bands` as CSV and Parquet into a folder; returns the
    /// files.
    ///
    /// # Errors
    /// A message with the file.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, String> {
        let mut tables = vec![
            ("results", Cow::Borrowed(&self.runs)),
            ("statistics", Cow::Owned(self.statistics())),
            ("sensitivity", Cow::Owned(self.sensitivities())),
        ];
        if !self.ellipses.is_empty() {
            tables.push(("ellipses", Cow::Owned(self.footprints())));
        }
        if !self.missed.is_empty() {
            tables.push(("requirements", Cow::Owned(self.requirements())));
        }
        if !self.bands.is_empty() {
            tables.push(("bands", Cow::Owned(table(&self.bands))));
        }
        // Remove tables of earlier results that do not exist any more.
        for name in ["ellipses", "requirements", "bands"]
            .into_iter()
            .filter(|n| tables.iter().all(|t| t.0 != *n))
        {
            for end in ["csv", "parquet"] {
                let path = folder.join(format!("{name}.{end}"));
                match std::fs::remove_file(&path) {
                    Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                        return Err(format!("{}: {e}", path.display()));
                    }
                    _ => {}
                }
            }
        }
        let mut files = Vec::new();
        for (name, table) in tables {
            for (end, bytes) in [("csv", table.csv()), ("parquet", table.parquet()?)] {
                let path = folder.join(format!("{name}.{end}"));
                replace(&path, &bytes, Durable::Now)?;
                files.push(path);
            }
        }
        Ok(files)
    }
}

/// Returns the ellipse of two metrics; `None` if a name is not a metric, there are fewer than three runs, or the metrics have different units, because
/// the axes of an ellipse then depend on the choice of units.
fn footprint(metrics: &[(String, String, Vec<f64>)], names: &[String; 2]) -> Option<Footprint> {
    let at = |name: &String| metrics.iter().position(|m| m.0 == *name);
    let of = [at(&names[0])?, at(&names[1])?];
    let [(_, u, x), (_, v, y)] = of.map(|k| &metrics[k]);
    if u != v {
        return None;
    }
    let ellipse = Ellipse::of(x, y)?;
    Some(Footprint { of, ellipse, within: ellipse.within(Ellipse::deviations(PROBABILITY), x, y) })
}

/// Titles of the percentiles in [`crate::statistics::PERCENTILES`].
pub(crate) const NAMES: [&str; 9] =
    ["min", "p1", "p5", "p25", "median", "p75", "p95", "p99", "max"];

/// Returns the requirements with the runs that violated them, and for each outcome the requirements that it violated. Only orderly runs are judged,
/// because the others are already counted as failures.
fn judged(aims: &[Aim], outcomes: &[&Outcome]) -> (Vec<Missed>, Vec<Vec<usize>>) {
    let never = aims.len();
    let of_run = |o: &&Outcome| -> Vec<usize> {
        let judged = if o.ended.is_orderly() { aims } else { &[] };
        let kept: Vec<Option<bool>> = judged.iter().map(|aim| aim.is_kept(&o.metrics)).collect();
        let beyond = (0..kept.len()).filter(|k| kept[*k] == Some(false));
        beyond.chain(kept.contains(&None).then_some(never)).collect()
    };
    let of_runs: Vec<Vec<usize>> = outcomes.iter().map(of_run).collect();
    let missed = |(k, aim): (usize, Option<&Aim>)| {
        let by = || outcomes.iter().zip(&of_runs).filter(move |(_, of)| of.contains(&k));
        Missed {
            cause: aim.map_or(NEVER, |aim| aim.cause.as_str()).into(),
            aim: aim.cloned(),
            runs: by().map(|(o, _)| o.run).collect(),
            alone: by().filter(|(_, of)| of.len() == 1).count(),
        }
    };
    let any = of_runs.iter().any(|of| of.contains(&never));
    let all = aims.iter().map(Some).chain(any.then_some(None)).enumerate();
    (all.map(missed).collect(), of_runs)
}

fn counted(outcomes: &[&Outcome]) -> (Vec<(String, Vec<u64>)>, Vec<(Cause, usize)>) {
    let mut failures = std::collections::BTreeMap::<String, Vec<u64>>::new();
    let mut causes = std::collections::BTreeMap::<Cause, usize>::new();
    for o in outcomes {
        *causes.entry(o.ended).or_default() += 1;
        if !o.ended.is_orderly() {
            failures.entry(o.kind()).or_default().push(o.run);
        }
    }
    let mut failures: Vec<_> = failures.into_iter().collect();
    failures.sort_by(|a, b| b.1.len().cmp(&a.1.len()).then(a.0.cmp(&b.0)));
    (failures, causes.into_iter().collect())
}

impl Table {
    /// Returns the table as CSV (RFC 4180 with `\n`), with numbers in full precision. A text that a spreadsheet would interpret as a formula is
    /// prefixed by an apostrophe.
    pub fn csv(&self) -> Vec<u8> {
        let mut out = String::new();
        let quoted = |t: &str| {
            let formula = t.starts_with(['=', '+', '-', '@', '\t', '\r']);
            let t = if formula { format!("'{t}") } else { t.to_string() };
            match t.contains([',', '"', '\n', '\r']) {
                true => format!("\"{}\"", t.replace('"', "\"\"")),
                false => t,
            }
        };
        let heads: Vec<String> = self.columns.iter().map(|c| quoted(&c.0)).collect();
        out.push_str(&heads.join(","));
        out.push('\n');
        let rows = self.columns.iter().map(|c| c.1.len()).min().unwrap_or(0);
        for k in 0..rows {
            let row: Vec<String> = self
                .columns
                .iter()
                .map(|(_, c)| match c {
                    Column::Whole(v) => v[k].to_string(),
                    Column::Number(v) => format!("{:?}", v[k]),
                    Column::Text(v) => quoted(&v[k]),
                })
                .collect();
            out.push_str(&row.join(","));
            out.push('\n');
        }
        out.into_bytes()
    }

    /// Returns the table as Parquet, with one row group.
    ///
    /// # Errors
    /// Errors of the format.
    pub fn parquet(&self) -> Result<Vec<u8>, String> {
        let like = self.columns.iter().map(|(name, column)| (name.as_str(), column.cells()));
        let mut file = ParquetFile::new(Vec::new(), "campaign", like, None)?;
        file.rows(self.columns.iter().map(|c| c.1.cells()))?;
        file.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        Table {
            columns: vec![
                ("run".into(), Column::Whole(vec![0, 1, 1 << 40])),
                ("y [m]".into(), Column::Number(vec![1.0 / 3.0, f64::NAN, -0.0])),
                ("why".into(), Column::Text(vec!["a, \"b\"".into(), String::new(), "é\nf".into()])),
            ],
        }
    }

    #[test]
    fn csv_quotes_what_must_be_quoted_and_keeps_all_digits() {
        let text = String::from_utf8(table().csv()).unwrap();
        let wanted = "run,y [m],why\n0,0.3333333333333333,\"a, \"\"b\"\"\"\n1,NaN,\n1099511627776,-0.0,\"é\nf\"\n";
        assert_eq!(text, wanted);
    }

    /// The inputs of OWASP's page on CSV injection.
    #[test]
    fn texts_are_no_formulas_and_numbers_stay_numbers() {
        let texts = ["=1+1", "+1", "-2+3", "@SUM(A1)", "\t=1", "\r=1", "a=b"].map(String::from);
        let numbers = vec![-1.5; texts.len()];
        let columns = vec![
            ("=x".to_string(), Column::Text(texts.to_vec())),
            ("y".to_string(), Column::Number(numbers)),
        ];
        let text = String::from_utf8(Table { columns }.csv()).unwrap();
        let wanted = "'=x,y\n'=1+1,-1.5\n'+1,-1.5\n'-2+3,-1.5\n'@SUM(A1),-1.5\n'\t=1,-1.5\n\"'\r=1\",-1.5\na=b,-1.5\n";
        assert_eq!(text, wanted);
    }

    #[test]
    fn an_empty_table_is_a_file_too() {
        let empty = Table { columns: vec![("y".into(), Column::Number(Vec::new()))] };
        assert_eq!(empty.csv(), b"y\n");
        assert!(empty.parquet().unwrap().starts_with(b"PAR1"));
    }
}
