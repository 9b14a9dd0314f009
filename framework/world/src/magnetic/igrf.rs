//! The International Geomagnetic Reference Field: coefficients every five years with linear interpolation.

use super::RADIUS;
use crate::error::{WorldError, number, plain};
use crate::gravity::{Coefficients, Harmonics};
use crate::planet::Epoch;
use linkwork_spatial::Vec3;

/// Coefficients over the years.
#[derive(Clone, Debug, PartialEq)]
pub struct Igrf {
    years: Vec<f64>,
    degree: usize,
    rows: Vec<Row>,
}

/// One coefficient: g or h, its values, and its rate after the last year; nT, nT/year.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    cosine: bool,
    n: usize,
    m: usize,
    values: Vec<f64>,
    rate: f64,
}

/// Number of years after the last one for which the rate is published.
const YEARS_AFTER: f64 = 5.0;

fn wrong(file: &str, line: usize, fact: String, help: &'static str) -> WorldError {
    WorldError::Line { file: file.to_string(), line, fact, help }
}

impl Igrf {
    /// Returns the fourteenth generation, 1900 to 2030, with the decimals that IAGA publishes (doi.org/10.5281/zenodo.14012302). [`Igrf::parse`]
    /// reads IAGA's own file.
    #[must_use]
    pub fn v14() -> Self {
        match Self::parse("igrf14.txt", include_str!("igrf14.txt")) {
            Ok(igrf) => igrf,
            Err(e) => unreachable!("the built-in table is read by a test: {e}"),
        }
    }

    /// Reads IAGA's table of coefficients: `g/h n m 1900.0 … SV`, then rows of values; `#` begins a comment. `file` is the name for messages.
    ///
    /// # Errors
    /// A missing heading, rows of another length or with invalid numbers, or a degree above 60.
    pub fn parse(file: &str, text: &str) -> Result<Self, WorldError> {
        let (mut years, mut rows, mut degree) = (Vec::new(), Vec::new(), 0);
        for (k, raw) in plain(text).lines().enumerate() {
            let line = k + 1;
            let words: Vec<&str> = raw.split_whitespace().collect();
            let float = |word: &str| {
                word.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| {
                    wrong(file, line, format!("`{word}` is not a number"), "nT as 123.4")
                })
            };
            match words[..] {
                [] => {}
                [first, ..] if first.starts_with('#') || first == "c/s" => {}
                ["g/h", "n", "m", ref heads @ .., _] => {
                    years = heads.iter().map(|w| float(w)).collect::<Result<_, _>>()?;
                }
                [kind @ ("g" | "h"), n, m, ref values @ .., rate] => {
                    if years.is_empty() || values.len() != years.len() {
                        let fact = format!("{} values for {} years", values.len(), years.len());
                        return Err(wrong(
                            file,
                            line,
                            fact,
                            "expected one for each year, and a rate",
                        ));
                    }
                    let (n, m) = (float(n)? as usize, float(m)? as usize);
                    if n == 0 || n > 60 || m > n {
                        let fact = format!("degree {n}, order {m}");
                        return Err(wrong(
                            file,
                            line,
                            fact,
                            "degrees from 1 to 60, orders up to it",
                        ));
                    }
                    degree = degree.max(n);
                    let values = values.iter().map(|w| float(w)).collect::<Result<_, _>>()?;
                    rows.push(Row { cosine: kind == "g", n, m, values, rate: float(rate)? });
                }
                _ => {
                    let fact = format!("`{}` is not a row", raw.trim());
                    return Err(wrong(file, line, fact, "`g n m` or `h n m`, values, rate"));
                }
            }
        }
        if years.len() < 2 || rows.is_empty() {
            let fact = format!("{} years and {} rows", years.len(), rows.len());
            return Err(wrong(file, 0, fact, "check that this is IAGA's igrf…coeffs.txt"));
        }
        Ok(Self { years, degree, rows })
    }

    /// Returns the first and last year for which the field is valid.
    #[must_use]
    pub fn range(&self) -> (f64, f64) {
        (self.years[0], self.years[self.years.len() - 1] + YEARS_AFTER)
    }

    /// Returns the highest degree.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Returns the field without terms above `degree`.
    ///
    /// # Errors
    /// The degree is 0 or exceeds that of the table.
    pub fn truncated(mut self, degree: usize) -> Result<Self, WorldError> {
        let own = self.degree;
        let help = "from 1 to the highest of the table, 13 of the built-in one";
        let fits = |n: f64| (1.0..=own as f64).contains(&n);
        number("degree of a magnetic field", degree as f64, fits, help)?;
        self.rows.retain(|row| row.n <= degree);
        self.degree = degree;
        Ok(self)
    }

    /// Returns the field at an epoch. It changes by some 100 nT per year, so it is constant for a flight of days.
    ///
    /// # Errors
    /// An epoch outside the range.
    pub fn at(&self, epoch: &Epoch) -> Result<MagneticField, WorldError> {
        let year = epoch.decimal_year();
        let (first, last) = self.range();
        let help = "the years of the table, and five after it";
        number("year of a magnetic field", year, |y| (first..=last).contains(&y), help)?;
        let end = self.years.len() - 1;
        let k = self.years.partition_point(|y| *y <= year).clamp(1, end) - 1;
        let s = (year - self.years[k]) / (self.years[k + 1] - self.years[k]);
        let mut field = Coefficients::new(RADIUS * RADIUS, RADIUS, self.degree, self.degree)?;
        field.set(0, 0, 0.0, 0.0)?;
        for row in &self.rows {
            let nano = if year > self.years[end] {
                row.values[end] + row.rate * (year - self.years[end])
            } else {
                row.values[k] + (row.values[k + 1] - row.values[k]) * s
            };
            let value = nano * 1e-9 / ((2 * row.n + 1) as f64).sqrt();
            let (c, s) = field.get(row.n, row.m);
            let (c, s) = if row.cosine { (value, s) } else { (c, value) };
            field.set(row.n, row.m, c, s)?;
        }
        Ok(MagneticField { harmonics: Harmonics::new(&field) })
    }
}

/// The field at one epoch.
#[derive(Clone, Debug)]
pub struct MagneticField {
    harmonics: Harmonics,
}

impl MagneticField {
    /// Returns B at `p` (m, the Earth's axes), T, in the same axes. Takes 0.3 µs.
    #[must_use]
    pub fn at(&self, p: &Vec3) -> Vec3 {
        // The gravity code computes +∇V, and the magnetic field is −∇V.
        -self.harmonics.acceleration(p)
    }
}
