//! NAIF's SPK kernels in DAF files: Chebyshev polynomials (types 2 and 3, such as DE440), states with Lagrange or Hermite interpolation (8, 9, 12,
//! 13: spacecraft), difference lines (1, 21: small bodies of Horizons), and orbits about one centre (5, 17).
//!
//! NAIF, *DAF Required Reading* and *SPK Required Reading*:
//! ```text
//! summaries                two times (TDB seconds past J2000), and target, centre, frame, type, addresses
//! segment of type 2, 3     Chebyshev records of x, y, z[, ẋ, ẏ, ż]: `daf`
//! other types              `states`, `differences`, `conics`
//! ```
//! Files use kilometres, this crate metres. The whole file is read at once; queries do not allocate.

use super::conics::{Discrete, Equinoctial};
use super::differences::Differences;
use super::states::States;
use super::{Body, Ephemeris, date, seconds};
use crate::daf::{Chebyshev, Daf, Kind, Rates, Summary, wrong};
use crate::error::WorldError;
use crate::planet::PointMotion;
use linkwork_spatial::Vec3;

const KIND: Kind = Kind { word: "DAF/SPK", integers: 6, help: "give an SPK kernel (.bsp)" };

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

/// A kernel. Later segments have priority over earlier ones, as in NAIF's toolkit.
#[derive(Clone, Debug, PartialEq)]
pub struct Spk {
    segments: Vec<SpkSegment>,
    /// Body, axes and type of the segments that were skipped.
    unread: Vec<[i32; 3]>,
}

impl Spk {
    /// Reads a kernel from its bytes; `file` is the name for messages.
    ///
    /// # Errors
    /// A file that is not an SPK kernel, is truncated, or lacks segments of a supported type in J2000 axes. Other segments are skipped; an error about
    /// a missing body names them.
    pub fn parse(file: &str, data: &[u8]) -> Result<Self, WorldError> {
        let daf = Daf::open(file, data, &KIND)?;
        let (mut segments, mut unread) = (Vec::new(), Vec::new());
        for summary in daf.summaries::<6>()? {
            match segment(&daf, &summary)? {
                Ok(segment) => segments.push(segment),
                Err(left_out) => unread.push(left_out),
            }
        }
        if segments.is_empty() {
            let help = "types 1, 2, 3, 5, 8, 9, 12, 13, 17 and 21 in J2000 axes are supported; NAIF's `spkmerge` or Horizons write them";
            let fact = format!("no segment of a supported type; it has {}", told(&unread));
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
        // Limit the length of the path to the number of segments, so that a cycle in a damaged file cannot
        // cause an infinite loop.
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
        .map(|[body, axes, kind]| format!("body {body} with type {kind} in axes {axes}"))
        .collect();
    all.dedup();
    if all.is_empty() { "none".into() } else { all.join(", ") }
}

/// Reads one segment from its summary. Returns body, axes and type if it is not supported.
fn segment(
    daf: &Daf<'_>,
    summary: &Summary<6>,
) -> Result<Result<SpkSegment, [i32; 3]>, WorldError> {
    let range = summary.range;
    let [target, centre, axes, kind, ..] = summary.integers;
    // Only J2000 axes are supported; others would need a rotation.
    if axes != 1 || !matches!(kind, 1 | 2 | 3 | 5 | 8 | 9 | 12 | 13 | 17 | 21) {
        return Ok(Err([target, axes, kind]));
    }
    let name = format!("segment of {target} about {centre}");
    let words = daf.words(&name, summary)?;
    let records = match kind {
        2 => Chebyshev::read(words, Rates::Derived).map(Records::Chebyshev),
        3 => Chebyshev::read(words, Rates::Stored).map(Records::Chebyshev),
        8 | 9 | 12 | 13 => States::read(words, kind).map(Records::States),
        5 => Discrete::read(&words).map(Records::Discrete),
        17 => Equinoctial::read(&words).map(Records::Equinoctial),
        _ => Differences::read(words, kind).map(Records::Differences),
    };
    match records {
        Ok(records) => Ok(Ok(SpkSegment { target, centre, range, records })),
        Err(fact) => Err(wrong(daf.file, format!("{name}: {fact}"), "it is damaged")),
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
