//! NAIF's SPK kernels in DAF files: Chebyshev polynomials (types 2 and 3, such as DE440), states with Lagrange or Hermite interpolation (8, 9, 12,
//! 13: spacecraft), difference lines (1, 21: small bodies of Horizons), and orbits about one centre (5, 17).
//!
//! NAIF, *DAF Required Reading* and *SPK Required Reading*:
//! ```text
//! record 1 of 1024 bytes   "DAF/SPK", ND = 2, NI = 6, first record of summaries, "LTL-IEEE" or "BIG-IEEE"
//! summaries                next, previous, count; for each two times (TDB seconds past J2000) and
//!                          target, centre, frame, type, first and last address (of 8 bytes, from 1)
//! segment of type 2, 3     records of (middle, half length, coefficients of x, y, z[, ẋ, ẏ, ż]);
//!                          at the end: first time, length of a record's interval, record size, count
//! other types              `states`, `differences`, `conics`
//! ```
//! Files use kilometres, this crate metres. The whole file is read at once; queries do not allocate.

use super::conics::{Discrete, Equinoctial};
use super::differences::Differences;
use super::states::States;
use super::{Body, Ephemeris, date, seconds};
use crate::error::WorldError;
use crate::planet::PointMotion;
use linkwork_spatial::Vec3;

const RECORD: usize = 1024;

/// Motion of one body relative to another over an interval.
#[derive(Clone, Debug, PartialEq)]
pub struct SpkSegment {
    /// NAIF's number of the body.
    pub target: i32,
    /// NAIF's number of the centre.
    pub centre: i32,
    /// First and last TDB second past J2000.
    pub range: [f64; 2],
    records: Records,
}

/// Data of a segment, by its type.
#[derive(Clone, Debug, PartialEq)]
enum Records {
    /// Types 2 and 3.
    Chebyshev(Chebyshev),
    /// Types 8, 9, 12 and 13.
    States(States),
    /// Types 1 and 21.
    Differences(Differences),
    /// Type 5.
    Discrete(Discrete),
    /// Type 17.
    Equinoctial(Equinoctial),
}

/// Chebyshev polynomials over intervals of equal length (s).
#[derive(Clone, Debug, PartialEq)]
struct Chebyshev {
    velocities: bool,
    init: f64,
    length: f64,
    size: usize,
    data: Vec<f64>,
}

/// A kernel. Later segments have priority over earlier ones, as in NAIF's toolkit.
#[derive(Clone, Debug, PartialEq)]
pub struct Spk {
    segments: Vec<SpkSegment>,
    /// Body, axes and type of the segments that were skipped.
    unread: Vec<[i32; 3]>,
}

fn wrong(file: &str, fact: impl Into<String>, help: &'static str) -> WorldError {
    WorldError::Line { file: file.to_string(), line: 0, fact: fact.into(), help }
}

/// Reads numbers of a file in its byte order.
struct Bytes<'a> {
    file: &'a str,
    data: &'a [u8],
    little: bool,
}

impl Bytes<'_> {
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

    /// Reads a count or an address.
    fn index(&self, at: usize, what: &str) -> Result<usize, WorldError> {
        let x = self.int(at)?;
        let help = "the file is damaged";
        usize::try_from(x).map_err(|_| wrong(self.file, format!("{what} is {x}"), help))
    }
}

impl Spk {
    /// Reads a kernel from its bytes; `file` is the name for messages.
    ///
    /// # Errors
    /// A file that is not an SPK kernel, is truncated, or lacks segments of a supported type in J2000 axes. Other segments are skipped; an error about
    /// a missing body names them.
    pub fn parse(file: &str, data: &[u8]) -> Result<Self, WorldError> {
        if !data.starts_with(b"DAF/SPK ") {
            return Err(wrong(
                file,
                "it does not begin with `DAF/SPK`",
                "give an SPK kernel (.bsp)",
            ));
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
        let b = Bytes { file, data, little };
        if (b.int(8)?, b.int(12)?) != (2, 6) {
            return Err(wrong(file, "ND, NI are not 2, 6", "give an SPK kernel (.bsp)"));
        }
        let (mut segments, mut unread) = (Vec::new(), Vec::new());
        let mut record = b.index(76, "the first record of summaries")?;
        // Visit each record at most once, so that a cycle in a damaged file also ends.
        for _ in 0..data.len() / RECORD + 1 {
            if record == 0 {
                break;
            }
            let at = (record - 1).saturating_mul(RECORD);
            let count = b.double(at.saturating_add(16))? as usize;
            for k in 0..count.min(25) {
                match segment(&b, at + 24 + 40 * k)? {
                    Ok(segment) => segments.push(segment),
                    Err(left_out) => unread.push(left_out),
                }
            }
            record = b.double(at)? as usize;
        }
        if segments.is_empty() {
            let help = "types 1, 2, 3, 5, 8, 9, 12, 13, 17 and 21 in J2000 axes are supported; NAIF's `spkmerge` or Horizons write them";
            let fact = format!("no segment of a type that is read; it has {}", told(&unread));
            return Err(wrong(file, fact, help));
        }
        segments.reverse();
        Ok(Self { segments, unread })
    }

    /// Returns the segments.
    #[must_use]
    pub fn segments(&self) -> &[SpkSegment] {
        &self.segments
    }

    /// Returns position (m) and velocity (m/s) of NAIF body `target` relative to `origin` at `et`, TDB seconds past J2000, ICRF axes. Follows the
    /// centres of both up to the first common body.
    ///
    /// # Errors
    /// A body or a time that the kernel does not cover.
    pub fn between(&self, target: i32, origin: i32, et: f64) -> Result<PointMotion, WorldError> {
        self.way(target, origin, et).ok_or_else(|| self.uncovered(target, origin, et))
    }

    fn way(&self, target: i32, origin: i32, et: f64) -> Option<PointMotion> {
        let (mut p, mut v) = (Vec3::zeros(), Vec3::zeros());
        let mut from = target;
        // A path has at most as many pieces as there are segments, so that a cycle in a damaged file also ends.
        for _ in 0..=self.segments.len() {
            // Go up from the origin until `from` is found.
            let (mut q, mut w) = (Vec3::zeros(), Vec3::zeros());
            let mut up = origin;
            for _ in 0..=self.segments.len() {
                if up == from {
                    return Some(PointMotion { position: p - q, velocity: v - w });
                }
                let Some(s) = self.find(up, et) else { break };
                let m = s.at(et);
                (q, w, up) = (q + m.position, w + m.velocity, s.centre);
            }
            let s = self.find(from, et)?;
            let m = s.at(et);
            (p, v, from) = (p + m.position, v + m.velocity, s.centre);
        }
        None
    }

    /// Returns the first and last TDB second past J2000 of the interval around `et` in which [`Spk::between`] covers these two bodies without a gap.
    /// O(segments²).
    ///
    /// # Errors
    /// As [`Spk::between`].
    pub fn span(&self, target: i32, origin: i32, et: f64) -> Result<[f64; 2], WorldError> {
        self.between(target, origin, et)?;
        let mut ends: Vec<f64> = self.segments.iter().flat_map(|s| s.range).collect();
        ends.sort_by(f64::total_cmp);
        ends.dedup();
        let good = |a: f64, b: f64| self.way(target, origin, 0.5 * (a + b)).is_some();
        let (mut first, mut last) = (et, et);
        for end in ends.iter().rev().filter(|end| **end < et) {
            if !good(*end, first) {
                break;
            }
            first = *end;
        }
        for end in ends.iter().filter(|end| **end > et) {
            if !good(last, *end) {
                break;
            }
            last = *end;
        }
        Ok([first, last])
    }

    /// Returns NAIF's numbers of all bodies and centres, each once.
    #[must_use]
    pub fn bodies(&self) -> Vec<i32> {
        let all = self.segments.iter().flat_map(|s| [s.target, s.centre]);
        all.collect::<std::collections::BTreeSet<i32>>().into_iter().collect()
    }

    /// Returns the reason why two bodies are not connected at a time: a body is missing, or the times at which they are connected.
    #[cold]
    fn uncovered(&self, target: i32, origin: i32, et: f64) -> WorldError {
        let bodies = self.bodies();
        if let Some(body) = [target, origin].into_iter().find(|body| !bodies.contains(body)) {
            let list: Vec<String> = bodies.iter().map(i32::to_string).collect();
            let mut fact = format!("the kernel has no body {body}; it has {}", list.join(", "));
            if self.unread.iter().any(|u| u[0] == body) {
                fact += &format!("; not read: {}", told(&self.unread));
            }
            let help = "use a kernel with this body, by NAIF's number: planets are in de440.bsp";
            return WorldError::Uncovered { fact, help };
        }
        let middles = self.segments.iter().map(|s| 0.5 * (s.range[0] + s.range[1]));
        let mut spans: Vec<[f64; 2]> = Vec::new();
        for middle in middles.filter(|&et| self.way(target, origin, et).is_some()) {
            if let Ok(span) = self.span(target, origin, middle)
                && !spans.contains(&span)
            {
                spans.push(span);
            }
        }
        spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let spans: Vec<String> =
            spans.iter().map(|[a, b]| format!("from {} to {}", date(*a), date(*b))).collect();
        let there = match spans.is_empty() {
            true => "no connection between the two at any time".to_string(),
            false => spans.join(", "),
        };
        let fact = format!(
            "the kernel does not connect bodies {target} and {origin} at {}; it has {there}",
            date(et)
        );
        WorldError::Uncovered { fact, help: "use a kernel that covers this time" }
    }

    fn find(&self, target: i32, et: f64) -> Option<&SpkSegment> {
        self.segments.iter().find(|s| s.target == target && s.range[0] <= et && et <= s.range[1])
    }
}

impl Ephemeris for Spk {
    fn state(
        &self,
        target: Body,
        origin: Body,
        tdb: (f64, f64),
    ) -> Result<PointMotion, WorldError> {
        self.between(target.naif(), origin.naif(), seconds(tdb))
    }

    fn span(&self, target: Body, origin: Body, tdb: (f64, f64)) -> Result<[f64; 2], WorldError> {
        Spk::span(self, target.naif(), origin.naif(), seconds(tdb))
    }
}

/// Returns the names of skipped segments, for messages.
fn told(unread: &[[i32; 3]]) -> String {
    let mut all: Vec<String> = unread
        .iter()
        .map(|[body, axes, kind]| format!("body {body} by type {kind} in axes {axes}"))
        .collect();
    all.dedup();
    if all.is_empty() { "none".into() } else { all.join(", ") }
}

/// Reads one segment from its summary. Returns body, axes and type if it is not supported.
fn segment(b: &Bytes, at: usize) -> Result<Result<SpkSegment, [i32; 3]>, WorldError> {
    let range = [b.double(at)?, b.double(at + 8)?];
    let (target, centre) = (b.int(at + 16)?, b.int(at + 20)?);
    let (axes, kind) = (b.int(at + 24)?, b.int(at + 28)?);
    // Only J2000 axes are supported; others would need a rotation.
    if axes != 1 || !matches!(kind, 1 | 2 | 3 | 5 | 8 | 9 | 12 | 13 | 17 | 21) {
        return Ok(Err([target, axes, kind]));
    }
    let (first, last) = (b.index(at + 32, "an address")?, b.index(at + 36, "an address")?);
    let name = format!("segment of {target} about {centre}");
    if first == 0 || last < first + 4 {
        return Err(wrong(b.file, format!("{name}: addresses {first} to {last}"), "it is damaged"));
    }
    let words =
        (first..=last).map(|k| b.double((k - 1) * 8)).collect::<Result<Vec<f64>, WorldError>>()?;
    let records = match kind {
        2 | 3 => Chebyshev::read(words, kind).map(Records::Chebyshev),
        8 | 9 | 12 | 13 => States::read(words, kind).map(Records::States),
        5 => Discrete::read(&words).map(Records::Discrete),
        17 => Equinoctial::read(&words).map(Records::Equinoctial),
        _ => Differences::read(words, kind).map(Records::Differences),
    };
    match records {
        Ok(records) => Ok(Ok(SpkSegment { target, centre, range, records })),
        Err(fact) => Err(wrong(b.file, format!("{name}: {fact}"), "it is damaged")),
    }
}

impl SpkSegment {
    /// Returns position and velocity at `et`, which must be in the range.
    fn at(&self, et: f64) -> PointMotion {
        let [position, velocity] = match &self.records {
            Records::Chebyshev(records) => records.at(et),
            Records::States(records) => records.at(et),
            Records::Differences(records) => records.at(et),
            Records::Discrete(records) => records.at(et),
            Records::Equinoctial(records) => records.at(et),
        };
        PointMotion { position: position * 1000.0, velocity: velocity * 1000.0 }
    }
}

impl Chebyshev {
    /// Reads the words of a segment. The error is the fact.
    fn read(mut words: Vec<f64>, kind: i32) -> Result<Chebyshev, String> {
        let n = words.len();
        let (init, length) = (words[n - 4], words[n - 3]);
        let (size, count) = (words[n - 2] as usize, words[n - 1] as usize);
        let parts = if kind == 3 { 6 } else { 3 };
        let fits = count > 0
            && size > 2 + parts
            && (size - 2).is_multiple_of(parts)
            && size.checked_mul(count) == Some(n - 4);
        if !fits || !(length > 0.0) {
            return Err(format!("{count} records of {size} numbers do not match its length"));
        }
        words.truncate(n - 4);
        Ok(Chebyshev { velocities: kind == 3, init, length, size, data: words })
    }

    /// Returns position (km) and velocity (km/s).
    fn at(&self, et: f64) -> [Vec3; 2] {
        let count = self.data.len() / self.size;
        let k = (((et - self.init) / self.length).max(0.0) as usize).min(count - 1);
        let record = &self.data[k * self.size..][..self.size];
        let (middle, half) = (record[0], record[1]);
        let x = (et - middle) / half;
        let n = (self.size - 2) / if self.velocities { 6 } else { 3 };
        let (mut p, mut v) = (Vec3::zeros(), Vec3::zeros());
        for axis in 0..3 {
            let (value, slope) = chebyshev(&record[2 + axis * n..][..n], x);
            p[axis] = value;
            v[axis] = if self.velocities {
                chebyshev(&record[2 + (axis + 3) * n..][..n], x).0
            } else {
                slope / half
            };
        }
        [p, v]
    }
}

/// Returns Σ c_k T_k(x) and its derivative, by Clenshaw's recurrence.
pub(super) fn chebyshev(c: &[f64], x: f64) -> (f64, f64) {
    let (mut b1, mut b2, mut d1, mut d2) = (0.0, 0.0, 0.0, 0.0);
    for ck in c.iter().skip(1).rev() {
        let d = 2.0 * b1 + 2.0 * x * d1 - d2;
        let b = ck + 2.0 * x * b1 - b2;
        (b2, b1, d2, d1) = (b1, b, d1, d);
    }
    (c[0] + x * b1 - b2, b1 + x * d1 - d2)
}
