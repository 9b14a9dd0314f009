//! Earth orientation parameters published by the IERS, one row per day, and their interpolation.
//!
//! | file | from | known by |
//! |---|---|---|
//! | finals2000A (`.all`, `.data`, `.daily`) | IERS, USNO | its columns; bulletin B where it is filled, else A |
//! | EOP 20 C04 (`eopc04.1962-now`) | IERS | the line `# YR  MM  DD  HH  MJD  x(")  y(")  UT1-UTC(s)  dX(")  dY(") …` |
//! | `EOP-All.csv`, `EOP-Last5Years.csv` | CelesTrak | the line `DATE,MJD,X,Y,UT1-UTC,LOD,…` |
//!
//! Between midnights (UTC), each column is a cubic through both values, with slopes from their neighbours. UT1 is measured relative to TAI, which
//! does not have leap seconds. Tides with periods of a day and less (0.05 ms of UT1, 0.5 mas of the pole: a few centimetres on the ground) are
//! missing in all these files and are neglected.

use super::earth_parameters::EarthParameters;
use crate::error::{WorldError, plain};
use crate::planet::Epoch;
use std::f64::consts::TAU;

/// Columns: UT1 − TAI (s), x and y of the pole, dX and dY (rad).
pub(super) const COLUMNS: usize = 5;
/// The modified Julian date from which UTC has whole leap seconds: 1972-01-01.
const FIRST: i64 = 41_317;

const KINDS: &str =
    "give IERS's finals2000A or EOP 20 C04, or CelesTrak's EOP-All.csv, as it was downloaded";

/// Daily Earth orientation parameters.
#[derive(Clone, Debug)]
pub struct EarthOrientation {
    file: String,
    /// Midnights, one day apart.
    days: Vec<Epoch>,
    rows: Vec<[f64; COLUMNS]>,
}

/// A row as text: MJD, UT1 − UTC, x, y, dX, dY.
type Words<'a> = [&'a str; 6];

impl EarthOrientation {
    /// Reads one of the three formats; `file` is the name for messages. Rows before 1972, when UTC did not have leap seconds, are skipped.
    /// Predictions that lack dX and dY keep the last known values.
    ///
    /// # Errors
    /// Another format, an invalid number or one that is impossible for the Earth, or a missing day.
    pub fn read(file: &str, text: &str) -> Result<Self, WorldError> {
        let mut table = Self { file: file.into(), days: Vec::new(), rows: Vec::new() };
        let text = plain(text);
        let content = |l: &&str| !l.trim().is_empty() && !l.starts_with('#');
        let first = text.lines().find(content).unwrap_or_default();
        // The unit is for dX and dY, ″.
        let (unit, words): (f64, Box<dyn Fn(&str) -> Option<Words<'_>>>) =
            if first.starts_with("DATE,MJD,") {
                let titles: Vec<&str> = first.trim().split(',').collect();
                let names = ["MJD", "UT1-UTC", "X", "Y", "DX", "DY"];
                let places = names.map(|n| titles.iter().position(|t| *t == n));
                if let Some(k) = places.iter().position(Option::is_none) {
                    let fact = format!("there is no column `{}`", names[k]);
                    return Err(table.wrong(1, fact, KINDS));
                }
                let places = places.map(Option::unwrap_or_default);
                let row = |l: &str| !l.starts_with("DATE") && !l.starts_with('#');
                (1.0, Box::new(move |l| row(l).then(|| separated(l, ",", places))))
            } else if text.lines().any(|l| l.starts_with("# YR") && l.contains("UT1-UTC(s)")) {
                let places = [4, 7, 5, 6, 8, 9];
                (1.0, Box::new(move |l| (!l.starts_with('#')).then(|| separated(l, " ", places))))
            } else if finals(first).is_some() {
                (1e-3, Box::new(finals))
            } else {
                let fact = "not a supported format of Earth orientation tables".to_string();
                return Err(table.wrong(1, fact, KINDS));
            };
        for (k, line) in text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty()) {
            let Some(words) = words(line) else { continue };
            // The file does not have a prediction for these days yet.
            if words[1].is_empty() && !table.days.is_empty() {
                break;
            }
            table.take(k + 1, &words, unit)?;
        }
        match table.days.len() {
            0 | 1 => Err(table.wrong(
                0,
                "the table has fewer than two days since 1972".to_string(),
                KINDS,
            )),
            _ => Ok(table),
        }
    }

    fn wrong(&self, line: usize, fact: String, help: &'static str) -> WorldError {
        WorldError::Line { file: self.file.clone(), line, fact, help }
    }

    fn take(&mut self, line: usize, words: &Words<'_>, unit: f64) -> Result<(), WorldError> {
        let number = |what: &str, word: &str, most: f64| match word.parse::<f64>() {
            Ok(x) if x.abs() <= most => Ok(x),
            _ => {
                let fact = format!("{what} is `{word}`");
                Err(self.wrong(
                    line,
                    fact,
                    "a number of the Earth's; give the file as it was downloaded",
                ))
            }
        };
        let mjd = number("the modified Julian date", words[0], 1e6)?;
        if mjd.fract() != 0.0 {
            let fact = format!("the row is of MJD {mjd}, which is not midnight");
            return Err(self.wrong(line, fact, "give the file sampled at 0h UTC"));
        }
        if (mjd as i64) < FIRST {
            return Ok(());
        }
        let day = Epoch::of_mjd(mjd as i64);
        if let Some(last) = self.days.last().filter(|last| (day.since(last) - 86_400.0).abs() > 1.5)
        {
            let fact = format!("{day} comes after {last}");
            return Err(self.wrong(line, fact, "give one row for each day, without gaps"));
        }
        let arcsec = TAU / 1_296_000.0;
        let tai_minus_utc = day.tt_minus_utc() - 32.184;
        let mut row = [
            number("UT1 − UTC, s,", words[1], 1.0)? - tai_minus_utc,
            number("x of the pole, ″,", words[2], 5.0)? * arcsec,
            number("y of the pole, ″,", words[3], 5.0)? * arcsec,
            0.0,
            0.0,
        ];
        for (k, what) in [(4, "dX, ″,"), (5, "dY, ″,")] {
            row[k - 1] = match (words[k], self.rows.last()) {
                ("", Some(last)) => last[k - 1],
                (word, _) => number(what, word, 5.0 / unit)? * unit * arcsec,
            };
        }
        self.days.push(day);
        self.rows.push(row);
        Ok(())
    }

    /// Returns the first and the last day.
    #[must_use]
    pub fn span(&self) -> [Epoch; 2] {
        [self.days[0], self.days[self.days.len() - 1]]
    }

    /// Returns the parameters at an epoch; beyond the table those of the first or last day.
    #[must_use]
    pub fn at(&self, epoch: &Epoch) -> EarthParameters {
        let ([ut1_minus_tai, x, y, dx, dy], rate) = Daily::of(self, epoch).at(0.0);
        EarthParameters {
            dut1: ut1_minus_tai + epoch.tt_minus_utc() - 32.184,
            pole: [x, y],
            celestial_pole_offsets: [dx, dy],
            excess_of_day: -rate[0] * 86_400.0,
        }
    }
}

/// Splits a line by `by`, and returns the words at these indices.
fn separated<'a>(line: &'a str, by: &str, places: [usize; 6]) -> Words<'a> {
    let words: Vec<&str> = line.split(by).map(str::trim).collect();
    let words: Vec<&str> = match by {
        " " => words.into_iter().filter(|w| !w.is_empty()).collect(),
        _ => words,
    };
    places.map(|k| words.get(k).copied().unwrap_or_default())
}

/// Splits a line of finals2000A, whose columns the IERS documents in `readme.finals2000A`; `None` for another line.
fn finals(line: &str) -> Option<Words<'_>> {
    let field =
        |from: usize, to: usize| line.get(from - 1..to.min(line.len())).unwrap_or("").trim();
    let mjd = field(8, 15);
    let flags = field(17, 17);
    (mjd.ends_with(".00") && matches!(flags, "" | "I" | "P")).then_some(())?;
    let better = |b: (usize, usize), a: (usize, usize)| match field(b.0, b.1) {
        "" => field(a.0, a.1),
        filled => filled,
    };
    Some([
        mjd,
        better((155, 165), (59, 68)),
        better((135, 144), (19, 27)),
        better((145, 154), (38, 46)),
        better((166, 175), (98, 106)),
        better((176, 185), (117, 125)),
    ])
}

/// The rows around and after an epoch, in seconds from it.
#[derive(Clone, Debug)]
pub(super) struct Daily {
    /// Midnights, s after the epoch.
    times: Vec<f64>,
    rows: Vec<[f64; COLUMNS]>,
    /// Rate of change of each row, per second, from the previous row to the next row.
    slopes: Vec<[f64; COLUMNS]>,
}

impl Daily {
    /// Copies the rows from two days before the epoch on.
    pub fn of(table: &EarthOrientation, epoch: &Epoch) -> Self {
        let before = table.days.partition_point(|d| d <= epoch);
        let from = before.saturating_sub(3).min(table.days.len() - 2);
        let times: Vec<f64> = table.days[from..].iter().map(|d| d.since(epoch)).collect();
        let rows = table.rows[from..].to_vec();
        let slope = |k: usize| {
            let (i, j) = (k.saturating_sub(1), (k + 1).min(times.len() - 1));
            std::array::from_fn(|c| (rows[j][c] - rows[i][c]) / (times[j] - times[i]))
        };
        let slopes = (0..times.len()).map(slope).collect();
        Self { times, rows, slopes }
    }

    /// Returns values and their rates (1/s) `t` seconds after the epoch. Beyond the table, the first or last row is used.
    pub fn at(&self, t: f64) -> ([f64; COLUMNS], [f64; COLUMNS]) {
        let last = self.times.len() - 1;
        let k = self.times.partition_point(|x| *x <= t);
        if k == 0 || t >= self.times[last] {
            return (self.rows[if k == 0 { 0 } else { last }], [0.0; COLUMNS]);
        }
        let (a, b) = (k - 1, k);
        let h = self.times[b] - self.times[a];
        let s = (t - self.times[a]) / h;
        let (mut value, mut rate) = ([0.0; COLUMNS], [0.0; COLUMNS]);
        for c in 0..COLUMNS {
            let (y0, y1) = (self.rows[a][c], self.rows[b][c]);
            let (m0, m1) = (h * self.slopes[a][c], h * self.slopes[b][c]);
            // Hermite's cubic is y0 + m0 s + (3d − 2m0 − m1) s² + (m0 + m1 − 2d) s³.
            let d = y1 - y0;
            let (p, q) = (3.0 * d - 2.0 * m0 - m1, m0 + m1 - 2.0 * d);
            value[c] = y0 + s * (m0 + s * (p + s * q));
            rate[c] = (m0 + s * (2.0 * p + s * 3.0 * q)) / h;
        }
        (value, rate)
    }
}
