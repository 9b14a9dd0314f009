//! NAIF's binary kernels (DAF files): header, summaries of segments, and Chebyshev records, which SPK and PCK have in common.
//!
//! NAIF, *DAF Required Reading*:
//! ```text
//! record 1 of 1024 bytes   "DAF/SPK" or "DAF/PCK", ND = 2, NI, first record of summaries, "LTL-IEEE" or "BIG-IEEE"
//! summaries                next, previous, count; for each two times (TDB seconds past J2000) and NI integers,
//!                          the last two of which are the first and last address (of 8 bytes, from 1)
//! Chebyshev records        (middle, half length, coefficients of three functions[, of their derivatives]);
//!                          at the end: first time, length of a record's interval, record size, count
//! ```
use crate::error::WorldError;
use linkwork_spatial::Vec3;

const RECORD: usize = 1024;

/// Returns an error about a file.
pub(crate) fn wrong(file: &str, fact: impl Into<String>, help: &'static str) -> WorldError {
    WorldError::Line { file: file.to_string(), line: 0, fact: fact.into(), help }
}

/// A kind of kernel.
pub(crate) struct Kind {
    /// The first word of the file.
    pub word: &'static str,
    /// NI, the number of integers of a summary.
    pub integers: i32,
    /// Remedy for files of other kinds.
    pub help: &'static str,
}

/// An open file.
pub(crate) struct Daf<'a> {
    pub file: &'a str,
    data: &'a [u8],
    little: bool,
}

/// Summary of a segment.
pub(crate) struct Summary<const N: usize> {
    /// First and last TDB second past J2000.
    pub range: [f64; 2],
    /// The integers; the last two are addresses.
    pub integers: [i32; N],
}

impl<'a> Daf<'a> {
    /// Checks the header.
    ///
    /// # Errors
    /// A file of another kind or number format.
    pub fn open(file: &'a str, data: &'a [u8], kind: &Kind) -> Result<Self, WorldError> {
        if !data.starts_with(kind.word.as_bytes()) {
            return Err(wrong(file, format!("it does not begin with `{}`", kind.word), kind.help));
        }
        let little = match data.get(88..96) {
            Some(b"LTL-IEEE") => true,
            Some(b"BIG-IEEE") => false,
            _ => {
                let help = "only IEEE files are read; convert it with NAIF's `bingo`";
                return Err(wrong(
                    file,
                    "its number format is neither LTL-IEEE nor BIG-IEEE",
                    help,
                ));
            }
        };
        let daf = Daf { file, data, little };
        if (daf.int(8)?, daf.int(12)?) != (2, kind.integers) {
            return Err(wrong(file, format!("ND, NI are not 2, {}", kind.integers), kind.help));
        }
        Ok(daf)
    }

    fn take<const N: usize>(&self, at: usize) -> Result<[u8; N], WorldError> {
        let end = at.checked_add(N);
        end.and_then(|end| self.data.get(at..end)).and_then(|s| s.try_into().ok()).ok_or_else(
            || wrong(self.file, format!("it ends before byte {at}"), "the file was truncated"),
        )
    }

    fn int(&self, at: usize) -> Result<i32, WorldError> {
        let b = self.take::<4>(at)?;
        Ok(if self.little { i32::from_le_bytes(b) } else { i32::from_be_bytes(b) })
    }

    fn double(&self, at: usize) -> Result<f64, WorldError> {
        let b = self.take::<8>(at)?;
        Ok(if self.little { f64::from_le_bytes(b) } else { f64::from_be_bytes(b) })
    }

    /// Converts a count or an address.
    fn index(&self, x: i32, what: &str) -> Result<usize, WorldError> {
        let help = "the file is damaged";
        usize::try_from(x).map_err(|_| wrong(self.file, format!("{what} is {x}"), help))
    }

    /// Returns the summaries of all segments, in the order of the file.
    ///
    /// # Errors
    /// A truncated or damaged file.
    pub fn summaries<const N: usize>(&self) -> Result<Vec<Summary<N>>, WorldError> {
        let mut out = Vec::new();
        let mut record = self.index(self.int(76)?, "the first record of summaries")?;
        let size = 8 * (2 + N.div_ceil(2));
        // Visit each record at most once, so that a cycle in a damaged file cannot cause an
        // infinite loop.
        for _ in 0..self.data.len() / RECORD + 1 {
            if record == 0 {
                break;
            }
            let at = (record - 1).saturating_mul(RECORD);
            let count = self.double(at.saturating_add(16))? as usize;
            for k in 0..count.min((RECORD - 24) / size) {
                let at = at + 24 + size * k;
                let range = [self.double(at)?, self.double(at + 8)?];
                let mut integers = [0; N];
                for (k, x) in integers.iter_mut().enumerate() {
                    *x = self.int(at + 16 + 4 * k)?;
                }
                out.push(Summary { range, integers });
            }
            record = self.double(at)? as usize;
        }
        Ok(out)
    }

    /// Returns the numbers of a segment.
    ///
    /// # Errors
    /// Addresses outside the file, or fewer than five numbers.
    pub fn words<const N: usize>(
        &self,
        name: &str,
        summary: &Summary<N>,
    ) -> Result<Vec<f64>, WorldError> {
        let [.., first, last] = summary.integers.as_slice() else { return Ok(Vec::new()) };
        let first = self.index(*first, "an address")?;
        let last = self.index(*last, "an address")?;
        if first == 0 || last < first + 4 {
            let fact = format!("{name}: addresses {first} to {last}");
            return Err(wrong(self.file, fact, "it is damaged"));
        }
        (first..=last).map(|k| self.double((k - 1) * 8)).collect()
    }
}

/// Whether records have coefficients for the derivatives, or the polynomials of the functions are differentiated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rates {
    Stored,
    Derived,
}

/// Chebyshev polynomials of three functions over intervals of equal length (s).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Chebyshev {
    rates: Rates,
    init: f64,
    length: f64,
    size: usize,
    data: Vec<f64>,
}

impl Chebyshev {
    /// Reads the words of a segment, of which there are at least five. The error is the fact.
    pub fn read(mut words: Vec<f64>, rates: Rates) -> Result<Chebyshev, String> {
        let n = words.len();
        let (init, length) = (words[n - 4], words[n - 3]);
        let (size, count) = (words[n - 2] as usize, words[n - 1] as usize);
        let parts = if rates == Rates::Stored { 6 } else { 3 };
        let fits = count > 0
            && size > 2 + parts
            && (size - 2).is_multiple_of(parts)
            && size.checked_mul(count) == Some(n - 4);
        if !fits || !(length > 0.0) {
            return Err(format!("{count} records of {size} numbers do not match its length"));
        }
        words.truncate(n - 4);
        Ok(Chebyshev { rates, init, length, size, data: words })
    }

    /// Returns the values and their derivatives by time at `et`.
    pub fn at(&self, et: f64) -> [Vec3; 2] {
        let count = self.data.len() / self.size;
        let k = (((et - self.init) / self.length).max(0.0) as usize).min(count - 1);
        let record = &self.data[k * self.size..][..self.size];
        let (middle, half) = (record[0], record[1]);
        let x = (et - middle) / half;
        let stored = self.rates == Rates::Stored;
        let n = (self.size - 2) / if stored { 6 } else { 3 };
        let (mut p, mut v) = (Vec3::zeros(), Vec3::zeros());
        for axis in 0..3 {
            let (value, slope) = chebyshev(&record[2 + axis * n..][..n], x);
            p[axis] = value;
            v[axis] = if stored {
                chebyshev(&record[2 + (axis + 3) * n..][..n], x).0
            } else {
                slope / half
            };
        }
        [p, v]
    }
}

/// Returns Σ c_k T_k(x) and its derivative, by Clenshaw's recurrence.
pub(crate) fn chebyshev(c: &[f64], x: f64) -> (f64, f64) {
    let (mut b1, mut b2, mut d1, mut d2) = (0.0, 0.0, 0.0, 0.0);
    for ck in c.iter().skip(1).rev() {
        let d = 2.0 * b1 + 2.0 * x * d1 - d2;
        let b = ck + 2.0 * x * b1 - b2;
        (b2, b1, d2, d1) = (b1, b, d1, d);
    }
    (c[0] + x * b1 - b2, b1 + x * d1 - d2)
}
