//! Orbit ephemeris messages (CCSDS 502.0-B, key-value notation): states of a spacecraft at epochs, and interpolation between them.
//! ```text
//! between rows   Hermite's polynomial of degree 2n − 1 through positions and velocities of the n nearest rows
//! ```
//! Rows outside `USEABLE_START_TIME` and `USEABLE_STOP_TIME` only support the interpolation. `INTERPOLATION` and its degree are recommendations and are
//! not used.

use crate::error::{WorldError, plain};
use crate::planet::{Epoch, PointMotion};
use linkwork_spatial::Vec3;

/// Number of rows of an interpolation; fewer if the segment is shorter.
const ROWS: usize = 4;

/// A segment of a message: one spacecraft, about one body, in one frame.
pub struct Segment {
    /// `OBJECT_NAME`.
    pub object: String,
    /// `CENTER_NAME`, in capitals.
    pub centre: String,
    /// `REF_FRAME`, in capitals.
    pub frame: String,
    /// `REF_FRAME_EPOCH`, if it is written: the frame is frozen at this epoch.
    pub frame_epoch: Option<String>,
    rows: Vec<(Epoch, PointMotion)>,
    /// `USEABLE_START_TIME` and `USEABLE_STOP_TIME`, as written, and their lines.
    useable_text: [Option<(usize, String)>; 2],
    /// The same as epochs.
    useable: [Option<Epoch>; 2],
    /// Line of `META_START`.
    line: usize,
}

/// Reads the segments of a message. `file` is its name in messages.
///
/// # Errors
/// The text is not such a message, a segment lacks a required field, or rows are not in order; the error names the line.
pub fn read_oem(file: &str, text: &str) -> Result<Vec<Segment>, WorldError> {
    Reader { file, all: Vec::new(), scale: String::new(), part: Part::Header }.read(text)
}

/// The part of a message to which a line belongs.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Header,
    Meta,
    Rows,
    Covariance,
}

struct Reader<'a> {
    file: &'a str,
    all: Vec<Segment>,
    /// `TIME_SYSTEM` of the segment.
    scale: String,
    part: Part,
}

impl Reader<'_> {
    fn wrong(&self, line: usize, fact: impl Into<String>, help: &'static str) -> WorldError {
        WorldError::Line { file: self.file.to_string(), line, fact: fact.into(), help }
    }

    fn read(mut self, text: &str) -> Result<Vec<Segment>, WorldError> {
        let mut versioned = false;
        for (k, line) in plain(text).lines().enumerate() {
            let (n, line) = (k + 1, line.trim());
            if line.is_empty() || line.starts_with("COMMENT") {
                continue;
            }
            if !versioned {
                if !line.starts_with("CCSDS_OEM_VERS") {
                    return Err(self.wrong(
                        n,
                        "it does not begin with `CCSDS_OEM_VERS`",
                        "give an orbit ephemeris message in key-value notation (XML is not read)",
                    ));
                }
                versioned = true;
                continue;
            }
            self.line(n, line)?;
        }
        for s in &self.all {
            if s.rows.is_empty() {
                return Err(self.wrong(
                    s.line,
                    "this segment has no states",
                    "add rows of epoch, position and velocity",
                ));
            }
        }
        if self.all.is_empty() {
            return Err(self.wrong(0, "there is no segment", "a segment begins with META_START"));
        }
        Ok(self.all)
    }

    fn line(&mut self, n: usize, line: &str) -> Result<(), WorldError> {
        match (self.part, line) {
            (Part::Header | Part::Rows, "META_START") => {
                self.part = Part::Meta;
                self.scale.clear();
                let [object, centre, frame] = std::array::from_fn(|_| String::new());
                let (frame_epoch, useable_text, useable) = (None, [None, None], [None, None]);
                let (rows, line) = (Vec::new(), n);
                self.all.push(Segment {
                    object,
                    centre,
                    frame,
                    frame_epoch,
                    rows,
                    useable_text,
                    useable,
                    line,
                });
            }
            (Part::Meta, "META_STOP") => self.described(n)?,
            (Part::Rows, "COVARIANCE_START") => self.part = Part::Covariance,
            (Part::Covariance, "COVARIANCE_STOP") => self.part = Part::Rows,
            (Part::Header | Part::Covariance, _) => {}
            (Part::Meta, _) => self.field(n, line)?,
            (Part::Rows, _) => self.row(n, line)?,
        }
        Ok(())
    }

    fn field(&mut self, n: usize, line: &str) -> Result<(), WorldError> {
        let Some((key, value)) = line.split_once('=') else {
            return Err(self.wrong(
                n,
                format!("`{line}` is not `KEYWORD = value`"),
                "end the description of a segment with META_STOP",
            ));
        };
        let value = value.trim();
        let Some(segment) = self.all.last_mut() else { return Ok(()) };
        match key.trim() {
            "OBJECT_NAME" => segment.object = value.to_string(),
            "CENTER_NAME" => segment.centre = value.to_uppercase(),
            "REF_FRAME" => segment.frame = value.to_uppercase(),
            "REF_FRAME_EPOCH" => segment.frame_epoch = Some(value.to_string()),
            "USEABLE_START_TIME" => segment.useable_text[0] = Some((n, value.to_string())),
            "USEABLE_STOP_TIME" => segment.useable_text[1] = Some((n, value.to_string())),
            "TIME_SYSTEM" => self.scale = value.to_uppercase(),
            _ => {}
        }
        Ok(())
    }

    /// Checks the completed description of a segment.
    fn described(&mut self, n: usize) -> Result<(), WorldError> {
        self.part = Part::Rows;
        let Some(s) = self.all.last() else { return Ok(()) };
        let fields = [
            ("OBJECT_NAME", &s.object),
            ("CENTER_NAME", &s.centre),
            ("REF_FRAME", &s.frame),
            ("TIME_SYSTEM", &self.scale),
        ];
        if let Some((missing, _)) = fields.iter().find(|(_, value)| value.is_empty()) {
            return Err(self.wrong(
                n,
                format!("this segment has no `{missing}`"),
                "the format requires it",
            ));
        }
        if !["UTC", "TAI", "TT", "TDB", "GPS"].contains(&self.scale.as_str()) {
            let fact = format!("`TIME_SYSTEM = {}` is not supported", self.scale);
            return Err(self.wrong(n, fact, "write the epochs in UTC, TAI, TT, TDB or GPS"));
        }
        // The time system may follow the epochs in the file, so read the epochs afterwards.
        let texts = s.useable_text.clone();
        for (k, text) in texts.into_iter().enumerate() {
            let Some((line, text)) = text else { continue };
            let at = self.epoch(line, &text, "write an epoch such as 2026-01-31T12:00:00")?;
            if let Some(s) = self.all.last_mut() {
                s.useable[k] = Some(at);
            }
        }
        Ok(())
    }

    /// Converts a time of the segment.
    fn epoch(&self, n: usize, text: &str, help: &'static str) -> Result<Epoch, WorldError> {
        let scale = if self.scale == "GPS" { "GPST" } else { &self.scale };
        Epoch::parse(&format!("{} {scale}", calendar(text)))
            .map_err(|e| self.wrong(n, e.to_string(), help))
    }

    fn row(&mut self, n: usize, line: &str) -> Result<(), WorldError> {
        const HELP: &str = "write the epoch, three positions in km and three velocities in km/s";
        let mut words = line.split_whitespace();
        let at = words.next().unwrap_or_default();
        let numbers: Vec<f64> = words
            .map(|w| w.parse::<f64>().ok().filter(|x| x.is_finite()))
            .collect::<Option<_>>()
            .ok_or_else(|| self.wrong(n, "a number cannot be read", HELP))?;
        // A row may have accelerations after its position and velocity.
        if numbers.len() != 6 && numbers.len() != 9 {
            let fact = format!("this row has {} numbers after its epoch", numbers.len());
            return Err(self.wrong(n, fact, HELP));
        }
        let at = self.epoch(n, at, HELP)?;
        let state = PointMotion {
            position: Vec3::new(numbers[0], numbers[1], numbers[2]) * 1e3,
            velocity: Vec3::new(numbers[3], numbers[4], numbers[5]) * 1e3,
        };
        if self.all.last().and_then(|s| s.rows.last()).is_some_and(|(last, _)| *last >= at) {
            return Err(self.wrong(
                n,
                "this epoch is not after the epoch of the row before",
                "sort the rows by time",
            ));
        }
        if let Some(s) = self.all.last_mut() {
            s.rows.push((at, state));
        }
        Ok(())
    }
}

/// Converts `2004-097T..` to `2004-04-06T..`; the day of the year starts at 1.
/// A `Z` at the end stands for UTC, which `TIME_SYSTEM` states.
fn calendar(text: &str) -> String {
    let text = text.strip_suffix('Z').unwrap_or(text);
    let Some((date, time)) = text.split_once('T') else { return text.to_string() };
    let Some((year, day)) = date.split_once('-') else { return text.to_string() };
    let (Ok(y), Ok(mut day), 3) = (year.parse::<u32>(), day.parse::<u32>(), day.len()) else {
        return text.to_string();
    };
    let leap = (y % 4 == 0 && y % 100 != 0) || y % 400 == 0;
    let months = [31, if leap { 29 } else { 28 }, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    for (month, days) in (1..).zip(months) {
        if day <= days {
            return format!("{year}-{month:02}-{day:02}T{time}");
        }
        day -= days;
    }
    text.to_string()
}

impl Segment {
    /// Returns the first and last epoch at which the states may be used; `None` if they are in the wrong order.
    #[must_use]
    pub fn covers(&self) -> Option<(Epoch, Epoch)> {
        let (first, last) = (self.rows.first()?.0, self.rows.last()?.0);
        let first = self.useable[0].filter(|at| *at > first).unwrap_or(first);
        let last = self.useable[1].filter(|at| *at < last).unwrap_or(last);
        (first <= last).then_some((first, last))
    }

    /// Returns position (m) and velocity (m/s) at an epoch in the segment's frame; `None` outside of [`Segment::covers`].
    #[must_use]
    pub fn state(&self, at: &Epoch) -> Option<PointMotion> {
        let (first, last) = self.covers()?;
        if *at < first || *at > last {
            return None;
        }
        let after = self.rows.partition_point(|(t, _)| t < at);
        if let Some((_, state)) = self.rows.get(after).filter(|(t, _)| t == at) {
            return Some(*state);
        }
        let count = ROWS.min(self.rows.len());
        let from = after.saturating_sub(count / 2).min(self.rows.len() - count);
        Some(hermite(&self.rows[from..from + count], at))
    }
}

/// Evaluates Hermite's polynomial through positions and velocities, by divided differences over doubled nodes.
fn hermite(rows: &[(Epoch, PointMotion)], at: &Epoch) -> PointMotion {
    let start = rows[0].0;
    // The times are relative to the length of the interval.
    let length = rows[rows.len() - 1].0.since(&start);
    let nodes: Vec<f64> = rows.iter().flat_map(|(t, _)| [t.since(&start) / length; 2]).collect();
    let mut table: Vec<Vec3> = rows.iter().flat_map(|(_, s)| [s.position; 2]).collect();
    let mut coefficients = vec![table[0]];
    for order in 1..nodes.len() {
        table = (0..nodes.len() - order)
            .map(|k| {
                let span = nodes[k + order] - nodes[k];
                match span == 0.0 {
                    true => rows[k / 2].1.velocity * length,
                    false => (table[k + 1] - table[k]) / span,
                }
            })
            .collect();
        coefficients.push(table[0]);
    }
    let s = at.since(&start) / length;
    // Horner's scheme evaluates the polynomial and its derivative.
    let (mut position, mut rate) = (Vec3::zeros(), Vec3::zeros());
    for (k, c) in coefficients.iter().enumerate().rev() {
        rate = rate * (s - nodes[k]) + position;
        position = position * (s - nodes[k]) + c;
    }
    PointMotion { position, velocity: rate / length }
}
