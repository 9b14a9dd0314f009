//! Atmosphere that depends on season and dust: tables over altitude at several seasons and dust loads.
//! ```text
//! ln ρ, T    straight lines in season (around the year) and in dust, at each altitude of any of the tables
//! ```
//! The season is the Sun's areocentric longitude L_s (0 at the northern spring equinox). The dust load is an optical depth in visible light. Tables
//! can come from Mars-GRAM or the Mars Climate Database.

use super::gas::Gas;
use super::table::{AltitudeKind, Outside, Table};
use crate::error::WorldError;
use std::f64::consts::TAU;

/// One table of a climate.
#[derive(Clone, Debug)]
pub struct ClimateEntry {
    /// The Sun's longitude L_s, rad.
    pub season: f64,
    /// Optical depth of the dust.
    pub dust: f64,
    /// The air over altitude in these conditions.
    pub air: Table,
}

/// Tables at all pairs of some seasons and some dust loads.
#[derive(Clone, Debug)]
pub struct Climate {
    /// Increasing, in [0, 2π).
    seasons: Vec<f64>,
    /// Increasing.
    dusts: Vec<f64>,
    /// One table per pair: all dust loads of the first season, then of the next.
    tables: Vec<Table>,
}

/// Seasons closer than this (rad) count as equal, and so do dust loads closer than this.
const SAME: f64 = 1e-9;

impl Climate {
    /// Creates the model from tables in any order.
    ///
    /// # Errors
    /// There are no tables, a season or dust load is not finite, a dust load is negative, or a pair of season and dust load has either none or two
    /// tables.
    pub fn new(entries: Vec<ClimateEntry>) -> Result<Self, WorldError> {
        let bad = |fact: String, help| Err(WorldError::Climate { fact, help });
        if entries.is_empty() {
            return bad("there is no table".into(), "give at least one table");
        }
        for e in &entries {
            if !(e.season.is_finite() && e.dust.is_finite() && e.dust >= 0.0) {
                let fact =
                    format!("a table at the season {} rad and the dust {}", e.season, e.dust);
                return bad(fact, "the season must be a finite angle, and the dust load 0 or more");
            }
        }
        let axis = |of: &dyn Fn(&ClimateEntry) -> f64| {
            let mut all: Vec<f64> = entries.iter().map(of).collect();
            all.sort_by(f64::total_cmp);
            all.dedup_by(|a, b| (*a - *b).abs() < SAME);
            all
        };
        let seasons = axis(&|e| turned(e.season));
        let dusts = axis(&|e| e.dust);
        let mut tables = Vec::new();
        for s in &seasons {
            for d in &dusts {
                let here = |e: &&ClimateEntry| {
                    (turned(e.season) - s).abs() < SAME && (e.dust - d).abs() < SAME
                };
                let found: Vec<&ClimateEntry> = entries.iter().filter(here).collect();
                let [one] = found[..] else {
                    let fact = format!(
                        "{} tables at the season {:.1}° and the dust {d}",
                        found.len(),
                        s.to_degrees()
                    );
                    return bad(fact, "give one table for each pair of a season and a dust load");
                };
                tables.push(one.air.clone());
            }
        }
        Ok(Self { seasons, dusts, tables })
    }

    /// Returns the smallest and largest dust load.
    #[must_use]
    pub fn dust_range(&self) -> (f64, f64) {
        (self.dusts[0], self.dusts[self.dusts.len() - 1])
    }

    /// Returns the air at a season (rad) and a dust load, as one table over all altitudes of the interpolated tables. Beyond its ends, `outside`
    /// applies.
    ///
    /// # Errors
    /// The season is not finite, or the dust load is outside the tables.
    pub fn table(
        &self,
        season: f64,
        dust: f64,
        outside: Outside,
        gas: Gas,
    ) -> Result<Table, WorldError> {
        let (least, most) = self.dust_range();
        if !(season.is_finite() && dust >= least - SAME && dust <= most + SAME) {
            let fact = format!(
                "season {season} rad, dust {dust}; the tables have dust from {least} to {most}"
            );
            let help = "use a dust load within the range of the tables, or add a table";
            return Err(WorldError::Climate { fact, help });
        }
        let parts = self.parts(turned(season), dust);
        let mut heights: Vec<f64> =
            parts.iter().flat_map(|(k, _)| self.tables[*k].entries().map(|e| e[0])).collect();
        heights.sort_by(f64::total_cmp);
        heights.dedup();
        let row = |h: f64| {
            let sum = parts.iter().fold((0.0, 0.0), |(rho, t), (k, weight)| {
                let air = self.tables[*k].at(h);
                (rho + weight * air.density.ln(), t + weight * air.temperature)
            });
            [h, sum.0.exp(), sum.1]
        };
        let rows: Vec<[f64; 3]> = heights.into_iter().map(row).collect();
        Table::new(&rows, AltitudeKind::Geometric, outside, gas)
    }

    /// Returns tables and their weights, which sum to 1.
    fn parts(&self, season: f64, dust: f64) -> Vec<(usize, f64)> {
        let n = self.seasons.len();
        let after = self.seasons.partition_point(|s| *s <= season);
        let (from, to) = ((after + n - 1) % n, after % n);
        let span = turned(self.seasons[to] - self.seasons[from]);
        let past = turned(season - self.seasons[from]);
        // A single season applies to the whole year.
        let late = if n > 1 { past / span } else { 0.0 };
        let upper =
            self.dusts.partition_point(|d| *d <= dust).clamp(1, self.dusts.len().max(2) - 1);
        let (low, high) = (upper - 1, upper.min(self.dusts.len() - 1));
        let width = self.dusts[high] - self.dusts[low];
        let thick =
            if width > 0.0 { ((dust - self.dusts[low]) / width).clamp(0.0, 1.0) } else { 0.0 };
        let mut out = Vec::new();
        for (s, of_season) in [(from, 1.0 - late), (to, late)] {
            for (d, of_dust) in [(low, 1.0 - thick), (high, thick)] {
                if of_season * of_dust > 0.0 {
                    out.push((s * self.dusts.len() + d, of_season * of_dust));
                }
            }
        }
        out
    }
}

/// Returns the angle in [0, 2π).
fn turned(angle: f64) -> f64 {
    let x = angle.rem_euclid(TAU);
    // An angle slightly below zero would round to 2π.
    if x < TAU { x } else { 0.0 }
}
