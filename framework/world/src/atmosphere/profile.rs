//! What changes with altitude in straight lines: winds, and how the air of a day differs from its model's.

use crate::error::WorldError;
use linkwork_spatial::Vec3;
use std::ops::{Add, Mul, Sub};

/// Values over altitude, straight lines between entries, constant beyond the ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile<V> {
    entries: Vec<(f64, V)>,
}

/// Velocity of the air, east-north-up, m/s, for a wind as weather reports give it: `speed` (m/s) and the
/// bearing it comes *from*, rad from north over east. A wind from the west blows to the east.
#[must_use]
pub fn wind_from(speed: f64, bearing: f64) -> Vec3 {
    // The minus turns "comes from" into "goes to".
    Vec3::new(-bearing.sin(), -bearing.cos(), 0.0) * speed
}

impl Profile<Vec3> {
    /// Winds: (altitude (m), velocity of the air east-north-up relative to the ground (m/s)) in rising order.
    ///
    /// # Errors
    /// No entry, altitudes that do not rise, numbers that are not finite.
    pub fn winds(entries: Vec<(f64, Vec3)>) -> Result<Self, WorldError> {
        Self::checked("wind profile", entries, |v| {
            let finite = v.iter().all(|x| x.is_finite());
            (!finite).then_some(("a NaN or an infinity", "give finite numbers"))
        })
    }
}

impl Profile<f64> {
    /// Factors on the density of a model: (altitude (m), factor) in rising order.
    ///
    /// # Errors
    /// No entry, altitudes that do not rise, factors that are not finite or below zero.
    pub fn factors(entries: Vec<(f64, f64)>) -> Result<Self, WorldError> {
        Self::checked("density profile", entries, |x| {
            let wrong = !(x.is_finite() && *x >= 0.0);
            wrong.then_some(("a factor that is none", "give finite factors from 0 on"))
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
            return fail(0, "has no entry".to_string(), "give one at least");
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
                return fail(k + 1, fact, "altitudes rise");
            }
        }
        Ok(Self { entries })
    }

    /// The value at altitude `h` (m). O(log n).
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
