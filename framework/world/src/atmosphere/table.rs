//! Atmosphere from a table over altitude: ln ρ and T are linear between the entries.

use super::gas::{Air, Gas};
use super::us76::{geometric_altitude, geopotential_altitude};
use crate::error::WorldError;

/// Kind of altitude in the first column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AltitudeKind {
    /// Metres of length.
    Geometric,
    /// Geopotential metres of the US Standard Atmosphere (r₀ = 6356766 m): 86 km are 84.852 of these.
    Geopotential,
}

/// Values beyond the ends of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outside {
    /// The value of the nearest entry.
    Clamp,
    /// ρ continues with the slope of the outermost entries, T stays constant.
    Continue,
}

/// Columns of a text table.
#[derive(Clone, Copy, Debug)]
pub struct Layout<'a> {
    /// Heading of the column of altitude.
    pub altitude: &'a str,
    /// Metres per unit of altitude.
    pub altitude_unit: f64,
    /// Kind of altitude.
    pub kind: AltitudeKind,
    /// Heading of the column of density.
    pub density: &'a str,
    /// kg/m³ per unit of density.
    pub density_unit: f64,
    /// Heading of the column of temperature, K.
    pub temperature: &'a str,
    /// Number of lines between the headings and the numbers, for example units.
    pub skip: usize,
}

impl Layout<'static> {
    /// Output of Earth-GRAM: geometric km above the ellipsoid.
    pub const EARTH_GRAM: Self = Self {
        altitude: "Hgtkm",
        altitude_unit: 1000.0,
        kind: AltitudeKind::Geometric,
        density: "DensMean",
        density_unit: 1.0,
        temperature: "Tmean",
        skip: 0,
    };
    /// Output of Mars-GRAM: geometric km above the areoid (MOLA).
    pub const MARS_GRAM: Self = Self {
        altitude: "HgtMOLA",
        altitude_unit: 1000.0,
        kind: AltitudeKind::Geometric,
        density: "Denkgm3",
        density_unit: 1.0,
        temperature: "Temp",
        skip: 0,
    };
    /// Basilisk's `USStandardAtmosphere1976.csv`. Its altitude is *geopotential*, although its notes do not mention this.
    pub const BASILISK_US76: Self = Self {
        altitude: "Altitude",
        altitude_unit: 1.0,
        kind: AltitudeKind::Geopotential,
        density: "Density",
        density_unit: 1.0,
        temperature: "Temperature",
        skip: 1,
    };
}

/// Air over altitude.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    gas: Gas,
    kind: AltitudeKind,
    outside: Outside,
    altitude: Vec<f64>,
    log_density: Vec<f64>,
    temperature: Vec<f64>,
}

impl Table {
    /// Creates a table from rows (altitude (m), ρ (kg/m³), T (K)), with increasing or decreasing altitude.
    ///
    /// # Errors
    /// There are fewer than two rows, altitudes are not in order, ρ or T is not above zero, or a number is not finite. `line` in the message is the
    /// row, from 1.
    pub fn new(
        rows: &[[f64; 3]],
        kind: AltitudeKind,
        outside: Outside,
        gas: Gas,
    ) -> Result<Self, WorldError> {
        let numbered: Vec<(usize, [f64; 3])> =
            rows.iter().enumerate().map(|(k, r)| (k + 1, *r)).collect();
        Self::checked("table", numbered, kind, outside, gas)
    }

    /// Reads a table from text with columns under headings, separated by commas, semicolons or blanks. `file` is the name for messages.
    ///
    /// # Errors
    /// A heading is missing, rows are too short or are not numbers; also as in [`Table::new`].
    pub fn read(
        file: &str,
        text: &str,
        layout: &Layout,
        outside: Outside,
        gas: Gas,
    ) -> Result<Self, WorldError> {
        let names = [layout.altitude, layout.density, layout.temperature];
        let mut rows = columns(file, text, names, layout.skip)?;
        for (_, row) in &mut rows {
            row[0] *= layout.altitude_unit;
            row[1] *= layout.density_unit;
        }
        Self::checked(file, rows, layout.kind, outside, gas)
    }

    fn checked(
        file: &str,
        mut rows: Vec<(usize, [f64; 3])>,
        kind: AltitudeKind,
        outside: Outside,
        gas: Gas,
    ) -> Result<Self, WorldError> {
        if rows.len() < 2 {
            let fact = format!("{} rows", rows.len());
            return Err(wrong(file, 0, fact, "a table needs at least two"));
        }
        for (line, [h, rho, t]) in &rows {
            if !(h.is_finite() && rho.is_finite() && *rho > 0.0 && t.is_finite() && *t > 0.0) {
                let fact = format!("altitude {h} m, density {rho} kg/m³, temperature {t} K");
                return Err(wrong(file, *line, fact, "density and temperature must be above 0"));
            }
        }
        if rows[0].1[0] > rows[1].1[0] {
            rows.reverse();
        }
        for pair in rows.windows(2) {
            let ((_, a), (line, b)) = (&pair[0], &pair[1]);
            if !(a[0] < b[0]) {
                let fact = format!("altitude {} m is next to {} m", b[0], a[0]);
                return Err(wrong(
                    file,
                    *line,
                    fact,
                    "altitudes must strictly increase or strictly decrease",
                ));
            }
        }
        Ok(Self {
            gas,
            kind,
            outside,
            altitude: rows.iter().map(|(_, r)| r[0]).collect(),
            log_density: rows.iter().map(|(_, r)| r[1].ln()).collect(),
            temperature: rows.iter().map(|(_, r)| r[2]).collect(),
        })
    }

    /// Returns the entries by increasing altitude: altitude (m, of the table's kind), ρ (kg/m³), T (K).
    pub fn entries(&self) -> impl Iterator<Item = [f64; 3]> {
        let rows = self.altitude.iter().zip(&self.log_density).zip(&self.temperature);
        rows.map(|((h, log), t)| [*h, log.exp(), *t])
    }

    /// Returns the lowest and highest altitude, m, of the table's kind.
    #[must_use]
    pub fn range(&self) -> (f64, f64) {
        (self.altitude[0], self.altitude[self.altitude.len() - 1])
    }

    /// Returns the lowest and highest entry as geometric altitudes, m.
    #[must_use]
    pub fn heights(&self) -> (f64, f64) {
        let (low, high) = self.range();
        match self.kind {
            AltitudeKind::Geometric => (low, high),
            AltitudeKind::Geopotential => (geometric_altitude(low), geometric_altitude(high)),
        }
    }

    /// Returns the air at the geometric altitude `h` (m). O(log n).
    #[must_use]
    pub fn at(&self, h: f64) -> Air {
        let h = match self.kind {
            AltitudeKind::Geometric => h,
            AltitudeKind::Geopotential => geopotential_altitude(h),
        };
        let x = &self.altitude;
        let k = x.partition_point(|a| *a <= h).clamp(1, x.len() - 1) - 1;
        let s = (h - x[k]) / (x[k + 1] - x[k]);
        let clamped = s.clamp(0.0, 1.0);
        let along = match self.outside {
            Outside::Clamp => clamped,
            Outside::Continue => s,
        };
        let line = |y: &[f64], s: f64| y[k] + (y[k + 1] - y[k]) * s;
        self.gas.air(line(&self.log_density, along).exp(), line(&self.temperature, clamped))
    }
}

/// Returns the numbers under headings, separated by commas or blanks, with the line number of each row. `skip` lines are between the headings and the
/// numbers.
pub(super) fn columns<const N: usize>(
    file: &str,
    text: &str,
    names: [&str; N],
    skip: usize,
) -> Result<Vec<(usize, [f64; N])>, WorldError> {
    // Spreadsheet programs write separators in rows without content.
    let content = |l: &str| !l.trim_matches([',', ';', ' ', '\t']).is_empty();
    let mut lines = text.lines().enumerate().filter(|(_, l)| content(l));
    let heads = lines.next().map(|(_, l)| words(l)).unwrap_or_default();
    let mut places = [0; N];
    for (place, name) in places.iter_mut().zip(names) {
        *place = heads.iter().position(|h| *h == name).ok_or_else(|| {
            let fact = format!("column `{name}` is missing; found {}", heads.join(", "));
            wrong(file, 1, fact, "give the headings of this file in the layout")
        })?;
    }
    let mut rows = Vec::new();
    for (k, line) in lines.skip(skip) {
        let words = words(line);
        let mut row = [0.0; N];
        for (value, c) in row.iter_mut().zip(places) {
            let word = words.get(c).copied().unwrap_or("");
            // Between semicolons, spreadsheet programs of many countries write a decimal comma.
            let decimal_comma = line.contains(';') && word.contains(',');
            let number =
                if decimal_comma { word.replacen(',', ".", 1).parse() } else { word.parse() };
            *value = number.map_err(|_| {
                let fact = format!("`{word}` in column `{}` is not a number", heads[c]);
                wrong(file, k + 1, fact, "each row needs a number under each heading")
            })?;
        }
        rows.push((k + 1, row));
    }
    Ok(rows)
}

/// Returns the headings of a text.
pub(super) fn headings(text: &str) -> Vec<&str> {
    text.lines().find(|l| !l.trim().is_empty()).map(words).unwrap_or_default()
}

fn words(line: &str) -> Vec<&str> {
    // Spreadsheet programs write a byte order mark at the start of a file.
    let line = line.trim_start_matches('\u{feff}');
    if line.contains(';') {
        line.split(';').map(str::trim).collect()
    } else if line.contains(',') {
        line.split(',').map(str::trim).collect()
    } else {
        line.split_whitespace().collect()
    }
}

fn wrong(file: &str, line: usize, fact: String, help: &'static str) -> WorldError {
    WorldError::Line { file: file.to_string(), line, fact, help }
}
