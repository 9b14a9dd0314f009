//! Profiles that are piecewise linear over altitude: winds, and density factors for the air of a given day.

use super::table::{columns, headings};
use crate::error::WorldError;
use linkwork_spatial::Vec3;
use std::ops::{Add, Mul, Sub};

/// Values over altitude, linear between entries, constant beyond the ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile<V> {
    entries: Vec<(f64, V)>,
}

/// Returns the velocity of the air, east-north-up, m/s, for a wind in the convention of weather reports: `speed` (m/s) and the bearing *from* which
/// it blows, rad from north over east. A wind from the west blows to the east.
#[must_use]
pub fn wind_from(speed: f64, bearing: f64) -> Vec3 {
    // The minus converts "blows from" into "blows to".
    Vec3::new(-bearing.sin(), -bearing.cos(), 0.0) * speed
}

impl Profile<Vec3> {
    /// Creates a wind profile: (altitude (m), velocity of the air east-north-up relative to the ground (m/s)) in increasing order.
    ///
    /// # Errors
    /// There are no entries, the altitudes do not increase, or a number is not finite.
    pub fn winds(entries: Vec<(f64, Vec3)>) -> Result<Self, WorldError> {
        Self::checked("wind profile", entries, not_finite)
    }

    /// Reads winds from a text with columns under headings, separated by commas or blanks: output of Mars-GRAM (`HgtMOLA` in km, `EWind`, `NWind`) or
    /// of Earth-GRAM (`Hgtkm`, `EWmean`, `NSmean`), or `altitude` in m, `east`, `north` and optionally `up`; m/s. Altitudes increase or decrease.
    /// `file` is the name for messages.
    ///
    /// # Errors
    /// The headings are different, rows are too short or are not numbers; also as in [`Profile::winds`].
    pub fn read_winds(file: &str, text: &str) -> Result<Self, WorldError> {
        const KNOWN: [([&str; 3], f64); 3] = [
            (["HgtMOLA", "EWind", "NWind"], 1000.0),
            (["Hgtkm", "EWmean", "NSmean"], 1000.0),
            (["altitude", "east", "north"], 1.0),
        ];
        let heads = headings(text);
        let found = KNOWN.into_iter().find(|(names, _)| names.iter().all(|n| heads.contains(n)));
        let Some((names, unit)) = found else {
            let fact =
                format!("there are no columns of winds; the columns are {}", heads.join(", "));
            let help = "give columns altitude (m), east and north (m/s), or output of Mars-GRAM or Earth-GRAM";
            return Err(WorldError::Line { file: file.to_string(), line: 1, fact, help });
        };
        let [h, east, north] = names;
        let mut rows = match names[0] == "altitude" && heads.contains(&"up") {
            true => columns(file, text, [h, east, north, "up"], 0)?,
            false => {
                let level = |(line, [h, e, n]): (usize, [f64; 3])| (line, [h, e, n, 0.0]);
                columns(file, text, names, 0)?.into_iter().map(level).collect()
            }
        };
        if let [(_, first), .., (_, last)] = rows[..]
            && first[0] > last[0]
        {
            rows.reverse();
        }
        for pair in rows.windows(2) {
            let [(_, a), (line, b)] = [pair[0], pair[1]];
            if !(a[0] < b[0]) {
                let fact = format!("altitude {} is next to {}", b[0], a[0]);
                let help = "altitudes must strictly increase or strictly decrease";
                return Err(WorldError::Line { file: file.to_string(), line, fact, help });
            }
        }
        let entry =
            |(_, [h, east, north, up]): (usize, [f64; 4])| (h * unit, Vec3::new(east, north, up));
        Self::checked(file, rows.into_iter().map(entry).collect(), not_finite)
    }
}

/// Returns the fault of a wind.
fn not_finite(v: &Vec3) -> Option<(&'static str, &'static str)> {
    let finite = v.iter().all(|x| x.is_finite());
    (!finite).then_some(("a NaN or an infinity", "give finite numbers"))
}

impl Profile<f64> {
    /// Creates a profile of factors on the density of a model: (altitude (m), factor) in increasing order.
    ///
    /// # Errors
    /// There are no entries, the altitudes do not increase, or a factor is not finite or negative.
    pub fn factors(entries: Vec<(f64, f64)>) -> Result<Self, WorldError> {
        Self::checked("density profile", entries, |x| {
            let wrong = !(x.is_finite() && *x >= 0.0);
            wrong.then_some(("an invalid factor", "factors must be finite and at least 0"))
        })
    }
}

impl<V: Copy + Add<Output = V> + Sub<Output = V> + Mul<f64, Output = V>> Profile<V> {
    fn checked(
        name: &str,
        entries: Vec<(f64, V)>,
        wrong: impl Fn(&V) -> Option<(&'static str, &'static str)>,
    ) -> Result<Self, WorldError> {
        let fail = |line: usize, fact: String, help: &'static str| {
            Err(WorldError::Line { file: name.to_string(), line, fact, help })
        };
        if entries.is_empty() {
            return fail(0, "has no entry".to_string(), "give at least one");
        }
        for (k, (h, v)) in entries.iter().enumerate() {
            if !h.is_finite() {
                return fail(k + 1, "a NaN or an infinity".to_string(), "give finite numbers");
            }
            if let Some((fact, help)) = wrong(v) {
                return fail(k + 1, fact.to_string(), help);
            }
            if k > 0 && !(entries[k - 1].0 < *h) {
                let fact = format!("altitude {h} m after {} m", entries[k - 1].0);
                return fail(k + 1, fact, "altitudes must increase");
            }
        }
        Ok(Self { entries })
    }

    /// Returns the value at altitude `h` (m). O(log n).
    #[must_use]
    pub fn at(&self, h: f64) -> V {
        let e = &self.entries;
        let k = e.partition_point(|(a, _)| *a <= h);
        if k == 0 {
            return e[0].1;
        }
        if k == e.len() {
            return e[k - 1].1;
        }
        let ((a, u), (b, v)) = (e[k - 1], e[k]);
        u + (v - u) * ((h - a) / (b - a))
    }
}
