//! NAIF's binary kernels of planetary orientation (binary PCK): Euler angles by Chebyshev polynomials, for example of the Moon's principal axes.
//!
//! ```text
//! summary   two times (TDB seconds past J2000), and body, axes (1: J2000, 17: ecliptic of J2000), type, addresses
//! type 2    records of the angles φ, δ, w, rad: `daf`
//! R_PI = R₃(w) R₁(δ) R₃(φ)                         (turns of axes; R_IP is its transpose)
//! ω = φ̇ ẑ_I + δ̇ n̂ + ẇ ẑ_P,   n̂ = (cos φ, sin φ, 0)
//! ```
//! NAIF, *PCK Required Reading*. The body is a class number of axes: 31008 for the principal axes of the Moon in DE440.
use super::{Spin, about_x, about_z};
use crate::daf::{Chebyshev, Daf, Kind, Rates, Summary, wrong};
use crate::ephemeris::date;
use crate::error::WorldError;
use linkwork_spatial::{Quat, Vec3, nalgebra};
use std::sync::Arc;

const KIND: Kind = Kind { word: "DAF/PCK", integers: 5, help: "give a binary PCK kernel (.bpc)" };
const DAY: f64 = 86400.0;
/// Obliquity of the ecliptic of J2000 in SPICE, rad.
const OBLIQUITY: f64 = 84_381.448 / 3600.0 * std::f64::consts::PI / 180.0;

/// Orientation of one body over an interval.
#[derive(Clone, Debug, PartialEq)]
struct Segment {
    body: i32,
    /// First and last TDB second past J2000.
    range: [f64; 2],
    /// The angles are relative to the ecliptic of J2000, not to J2000.
    ecliptic: bool,
    angles: Chebyshev,
}

/// A binary kernel. Later segments have priority over earlier ones, as in NAIF's toolkit.
#[derive(Clone, Debug, PartialEq)]
pub struct PckKernel {
    file: String,
    segments: Vec<Segment>,
    /// Body, axes and type of the segments that were skipped.
    unread: Vec<[i32; 3]>,
}

impl PckKernel {
    /// Whether these are the bytes of a binary kernel.
    #[must_use]
    pub fn is_binary(data: &[u8]) -> bool {
        data.starts_with(b"DAF/")
    }

    /// Reads a kernel from its bytes; `file` is the name for messages.
    ///
    /// # Errors
    /// A file that is not a binary PCK, is truncated, or lacks segments of type 2 in axes of J2000 or its ecliptic. Other segments are skipped; an
    /// error about a missing body names them.
    pub fn parse(file: &str, data: &[u8]) -> Result<Self, WorldError> {
        let daf = Daf::open(file, data, &KIND)?;
        let (mut segments, mut unread) = (Vec::new(), Vec::new());
        for summary in daf.summaries::<5>()? {
            match segment(&daf, &summary)? {
                Ok(segment) => segments.push(segment),
                Err(skipped) => unread.push(skipped),
            }
        }
        segments.reverse();
        let out = Self { file: file.into(), segments, unread };
        if out.segments.is_empty() {
            let fact = format!("no segment of a supported type; it has {}", out.skipped());
            let help = "type 2 in axes of J2000 or of the ecliptic of J2000 is supported";
            return Err(wrong(file, fact, help));
        }
        Ok(out)
    }

    /// Returns the rotation of a body; `tdb_days` past J2000 (whole, fraction) is the epoch of t = 0.
    ///
    /// # Errors
    /// A body or an epoch that the kernel does not cover.
    pub fn rotation(&self, body: i32, tdb_days: (f64, f64)) -> Result<KernelRotation, WorldError> {
        let own: Vec<Segment> = self.segments.iter().filter(|s| s.body == body).cloned().collect();
        let start = tdb_days.0 * DAY + tdb_days.1 * DAY;
        let covers = |s: &&Segment| s.range[0] <= start && start <= s.range[1];
        let Some(first) = own.iter().find(covers) else {
            return Err(self.uncovered(body, start));
        };
        let mut range = first.range;
        // Extend the interval by all segments that touch or overlap it.
        for _ in 0..own.len() {
            for s in &own {
                if s.range[0] <= range[1] && s.range[1] >= range[0] {
                    range = [range[0].min(s.range[0]), range[1].max(s.range[1])];
                }
            }
        }
        let range = range.map(|end| end - start);
        Ok(KernelRotation { segments: own.into(), start, range, file: self.file.as_str().into() })
    }

    #[cold]
    fn uncovered(&self, body: i32, et: f64) -> WorldError {
        let spans: Vec<String> = (self.segments.iter().rev().filter(|s| s.body == body))
            .map(|s| format!("from {} to {}", date(s.range[0]), date(s.range[1])))
            .collect();
        if !spans.is_empty() {
            let fact = format!(
                "the kernel `{}` has the rotation of body {body} {}, but not at {}",
                self.file,
                spans.join(", "),
                date(et)
            );
            return WorldError::Uncovered { fact, help: "use a kernel that covers this time" };
        }
        let mut bodies: Vec<i32> = self.segments.iter().map(|s| s.body).collect();
        bodies.sort_unstable();
        bodies.dedup();
        let bodies: Vec<String> = bodies.iter().map(i32::to_string).collect();
        let mut fact = format!(
            "the kernel `{}` has no rotation of body {body}; it has {}",
            self.file,
            bodies.join(", ")
        );
        if !self.unread.is_empty() {
            fact += &format!("; not read: {}", self.skipped());
        }
        let help = "write a number of the kernel; the Moon's principal axes have 31006 to 31008";
        WorldError::Uncovered { fact, help }
    }

    /// Returns the names of skipped segments, for messages.
    fn skipped(&self) -> String {
        let mut all: Vec<String> = (self.unread.iter())
            .map(|[body, axes, kind]| format!("body {body} with type {kind} in axes {axes}"))
            .collect();
        all.dedup();
        if all.is_empty() { "none".into() } else { all.join(", ") }
    }
}

/// Reads one segment from its summary. Returns body, axes and type if it is not supported.
fn segment(daf: &Daf<'_>, summary: &Summary<5>) -> Result<Result<Segment, [i32; 3]>, WorldError> {
    let range = summary.range;
    let [body, axes, kind, ..] = summary.integers;
    if !matches!(axes, 1 | 17) || kind != 2 {
        return Ok(Err([body, axes, kind]));
    }
    let name = format!("segment of {body}");
    let words = daf.words(&name, summary)?;
    match Chebyshev::read(words, Rates::Derived) {
        Ok(angles) => Ok(Ok(Segment { body, range, ecliptic: axes == 17, angles })),
        Err(fact) => Err(wrong(daf.file, format!("{name}: {fact}"), "it is damaged")),
    }
}

/// Rotation by a binary kernel, starting at an epoch.
#[derive(Clone, Debug)]
pub struct KernelRotation {
    segments: Arc<[Segment]>,
    /// TDB seconds past J2000 at the epoch.
    start: f64,
    range: [f64; 2],
    file: Arc<str>,
}

impl KernelRotation {
    /// Returns the first and last time at which the rotation is known, s from the epoch.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Returns the name of the kernel.
    #[must_use]
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Returns the spin `t` seconds after the epoch; NaN outside of [`KernelRotation::range`]. TT and TDB are assumed to have the same rate (3e-10).
    #[must_use]
    pub fn at(&self, t: f64) -> Spin {
        let et = self.start + t;
        let covers = |s: &&Segment| s.range[0] <= et && et <= s.range[1];
        let Some(s) = self.segments.iter().find(covers) else {
            let nan = f64::NAN;
            let R_IP = Quat::new_unchecked(nalgebra::Quaternion::new(nan, nan, nan, nan));
            return Spin { R_IP, omega_I: Vec3::repeat(nan) };
        };
        let [angles, rates] = s.angles.at(et);
        let (sin, cos) = angles.x.sin_cos();
        let R_IP = about_z(angles.x) * about_x(angles.y) * about_z(angles.z);
        let pole: Vec3 = R_IP * Vec3::z();
        let omega_I = Vec3::z() * rates.x + Vec3::new(cos, sin, 0.0) * rates.y + pole * rates.z;
        if !s.ecliptic {
            return Spin { R_IP, omega_I };
        }
        let R = about_x(OBLIQUITY);
        Spin { R_IP: R * R_IP, omega_I: R * omega_I }
    }
}
