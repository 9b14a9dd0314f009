//! Winds over altitude.

use crate::error::WorldError;
use linkwork_spatial::Vec3;

/// Air velocity over altitude, straight lines between entries, constant beyond the ends.
#[derive(Clone, Debug, PartialEq)]
pub struct WindProfile {
    entries: Vec<(f64, Vec3)>,
}

/// Velocity of the air, east-north-up, m/s, for a wind as weather reports give it: `speed` (m/s) and the
/// bearing it comes *from*, rad from north over east. A wind from the west blows to the east.
#[must_use]
pub fn wind_from(speed: f64, bearing: f64) -> Vec3 {
    // The minus turns "comes from" into "goes to".
    Vec3::new(-bearing.sin(), -bearing.cos(), 0.0) * speed
}

impl WindProfile {
    /// From (altitude (m), velocity of the air east-north-up (m/s)) in rising order.
    ///
    /// # Errors
    /// No entry, altitudes that do not rise, numbers that are not finite.
    pub fn new(entries: Vec<(f64, Vec3)>) -> Result<Self, WorldError> {
        let wrong = |line: usize, fact: String, help: &'static str| {
            Err(WorldError::Line { file: "wind profile".to_string(), line, fact, help })
        };
        if entries.is_empty() {
            return wrong(0, "has no entry".to_string(), "give one at least");
        }
        for (k, (h, v)) in entries.iter().enumerate() {
            if !(h.is_finite() && v.iter().all(|x| x.is_finite())) {
                return wrong(k + 1, "a NaN or an infinity".to_string(), "give finite numbers");
            }
            if k > 0 && !(entries[k - 1].0 < *h) {
                let fact = format!("altitude {h} m after {} m", entries[k - 1].0);
                return wrong(k + 1, fact, "altitudes rise");
            }
        }
        Ok(Self { entries })
    }

    /// Velocity of the air at altitude `h` (m), east-north-up relative to the ground, m/s. O(log n).
    #[must_use]
    pub fn at(&self, h: f64) -> Vec3 {
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
