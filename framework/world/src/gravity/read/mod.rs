//! Coefficient files: four formats with common checks.
//!
//! Checks in each format: every line is valid, each coefficient appears once and within the degree and order of the header, the last degree is
//! complete (a truncated file is rejected), and the numbers have the normalisation that the header states.

mod gmat;
mod icgem;
mod list;

use super::coefficients::{Coefficients, DEGREE_MAX, TideSystem, normalisation};
use crate::error::{WorldError, plain};

/// File format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `.cof` of GMAT: `POTFIELD` and `RECOEF` in fixed columns, metres.
    Gmat,
    /// Basilisk's text: a header of eight numbers, `n, m, C, S, σ_C, σ_S`, metres.
    Basilisk,
    /// `.gfc` of the ICGEM service: keywords, `gfc n m C S`, metres.
    Icgem,
    /// SHADR of the Planetary Data System: Basilisk's layout in kilometres.
    Shadr,
}

/// Part of a file to keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// All of it, up to degree 360.
    All,
    /// Up to this degree, which the file must have.
    Degree(usize),
}

/// Reads coefficients. `file` is the name for messages, `text` the content.
///
/// # Errors
/// A violation of any check of the module, with the line.
pub fn read(
    format: Format,
    file: &str,
    text: &str,
    keep: Keep,
) -> Result<Coefficients, WorldError> {
    let text = plain(text);
    match format {
        Format::Gmat => gmat::read(file, text, keep),
        Format::Basilisk => list::read(file, text, keep, list::Length::Metres),
        Format::Icgem => icgem::read(file, text, keep),
        Format::Shadr => list::read(file, text, keep, list::Length::Kilometres),
    }
}

/// Content of a header.
#[derive(Clone, Copy, Debug)]
struct Header {
    mu: f64,
    radius: f64,
    degree: usize,
    order: usize,
    norm: Norm,
    tide: TideSystem,
    /// Whether the format specifies the order; otherwise it is the highest of the lines.
    order_is_written: bool,
}

/// Normalisation stated by a header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Norm {
    Full,
    None,
}

/// A set of coefficients while its file is read.
struct Reading<'a> {
    file: &'a str,
    header: Header,
    /// Line of the header.
    at: usize,
    field: Coefficients,
    /// Line of (n, m); 0 if it has not appeared.
    lines: Vec<usize>,
    /// Number of orders read for the header's highest degree.
    last_degree: usize,
    /// Highest order read.
    highest: usize,
}

fn wrong(file: &str, line: usize, fact: String, help: &'static str) -> WorldError {
    WorldError::Line { file: file.to_string(), line, fact, help }
}

/// Reads a number, also in Fortran notation: `1.5D-03`.
fn float(file: &str, line: usize, what: &str, text: &str) -> Result<f64, WorldError> {
    let plain = text.trim().replace(['D', 'd'], "E");
    match plain.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => {
            let fact = format!("{what} is `{}`, which is not a finite number", text.trim());
            Err(wrong(file, line, fact, "write it like -4.84165e-04"))
        }
    }
}

fn whole(file: &str, line: usize, what: &str, text: &str) -> Result<usize, WorldError> {
    text.trim().parse().map_err(|_| {
        let fact = format!("{what} is `{}`, which is not an integer", text.trim());
        wrong(file, line, fact, "check that the file has the expected format")
    })
}

impl<'a> Reading<'a> {
    fn new(file: &'a str, at: usize, header: Header, keep: Keep) -> Result<Self, WorldError> {
        if header.degree.max(header.order) > 100_000 {
            let fact = format!("degree {}, order {}", header.degree, header.order);
            return Err(wrong(
                file,
                at,
                fact,
                "fields of this size do not exist; correct the header",
            ));
        }
        let degree = match keep {
            Keep::All if header.degree > DEGREE_MAX => {
                let fact = format!("the field has degree {}", header.degree);
                return Err(wrong(file, at, fact, "keep at most 360: `Keep::Degree(360)`"));
            }
            Keep::All => header.degree,
            Keep::Degree(n) if n > header.degree => {
                let fact = format!("the field has degree {}, not {n}", header.degree);
                return Err(wrong(file, at, fact, "use a lower degree, or read a larger field"));
            }
            Keep::Degree(n) => n,
        };
        let order = header.order.min(degree);
        let mut field =
            Coefficients::new(header.mu, header.radius, degree, order).map_err(|e| {
                let fact = e.to_string().lines().next().unwrap_or_default().to_string();
                wrong(file, at, fact, "check the header and its units")
            })?;
        field.tide = header.tide;
        let lines = vec![0; (degree + 1) * (degree + 2) / 2];
        Ok(Self { file, header, at, field, lines, last_degree: 0, highest: 0 })
    }

    /// Adds one pair of coefficients, in the file's normalisation.
    fn take(&mut self, line: usize, n: usize, m: usize, c: f64, s: f64) -> Result<(), WorldError> {
        let file = self.file;
        if n > self.header.degree || m > n.min(self.header.order) {
            let (N, M) = (self.header.degree, self.header.order);
            let fact = format!("degree {n}, order {m} in a field of degree {N}, order {M}");
            return Err(wrong(file, line, fact, "correct the header, or remove the line"));
        }
        if n == self.header.degree {
            self.last_degree += 1;
        }
        self.highest = self.highest.max(m);
        if n > self.field.degree() {
            return Ok(());
        }
        let seen = &mut self.lines[n * (n + 1) / 2 + m];
        if *seen > 0 {
            let fact = format!("degree {n}, order {m} is already on line {seen}");
            return Err(wrong(file, line, fact, "keep one of them"));
        }
        *seen = line;
        if n == 0 && (c - 1.0).abs() > 1e-3 {
            let fact = format!("C of degree 0 is {c}, not 1");
            return Err(wrong(file, line, fact, "coefficients are relative to mu"));
        }
        let k = match self.header.norm {
            Norm::Full => 1.0,
            Norm::None => normalisation(n, m),
        };
        if k == 0.0 {
            let fact = format!("degree {n}, order {m} without normalisation is beyond f64");
            return Err(wrong(file, line, fact, "use a normalised file"));
        }
        self.field.set(n, m, c / k, s / k)
    }

    /// Finishes reading: checks that the field is complete and normalised as the header states.
    fn done(self) -> Result<Coefficients, WorldError> {
        let (file, h) = (self.file, self.header);
        // A file may leave out zeros, such as all terms that are not zonal.
        let order = if h.order_is_written { h.order } else { self.highest };
        let expected = h.degree.min(order) + 1;
        if self.last_degree < expected {
            let fact = format!(
                "degree {}, the last, has {} of its {expected} orders",
                h.degree, self.last_degree
            );
            return Err(wrong(file, 0, fact, "the file was truncated, or its header is wrong"));
        }
        // Already at degree 8, normalised and unnormalised coefficients differ by factors above
        // 1e4.
        let help = "correct the header's normalisation";
        match (h.norm, self.field.high_over_low()) {
            (Norm::Full, Some(ratio)) if ratio < 1e-3 => {
                let fact = format!(
                    "the header states normalisation, but high orders are {ratio:.1e} of the low ones"
                );
                Err(wrong(file, self.at, fact, help))
            }
            (Norm::None, Some(ratio)) if ratio > 1e3 => {
                let fact = format!(
                    "the header states no normalisation, but normalising makes high orders {ratio:.1e} of the low ones"
                );
                Err(wrong(file, self.at, fact, help))
            }
            _ if order < self.field.order() => self.field.truncated(self.field.degree(), order),
            _ => Ok(self.field),
        }
    }
}
