//! Variation of a coefficient: a sum over latitude, season, hour, longitude, flux and magnetic activity.
//!
//! Hedin 1987, appendix A: Legendre functions of the latitude times harmonics of day, hour and longitude.
//! Indices of coefficients start at 0.

use super::{Magnetic, SpaceWeather};

const DAY: f64 = 1.72142e-2;
const HOUR: f64 = 0.2618;
const SECOND: f64 = 7.2722e-5;
const DEGREE: f64 = 1.74533e-2;

/// Time, position and solar activity.
pub(super) struct Moment {
    pub(super) day: f64,
    seconds: f64,
    pub(super) latitude: f64,
    longitude: f64,
    hour: f64,
    /// f107 − mean, mean − 150.
    df: f64,
    pub(super) dfa: f64,
    magnetic: Magnetic,
    /// P_n^m(sin latitude), `plg[m][n]`, without Condon and Shortley's sign.
    plg: [[f64; 8]; 4],
    /// (cos, sin) of the hour, of twice and three times the hour.
    local: [(f64, f64); 3],
}

impl Moment {
    pub(super) fn new(
        day: f64,
        seconds: f64,
        latitude: f64,
        longitude: f64,
        weather: &SpaceWeather,
    ) -> Self {
        let mut moment = Self {
            day,
            seconds,
            latitude,
            longitude,
            hour: 0.0,
            df: weather.f107 - weather.f107_mean,
            dfa: weather.f107_mean - 150.0,
            magnetic: weather.magnetic,
            plg: legendre((latitude * DEGREE).sin(), (latitude * DEGREE).cos()),
            local: [(1.0, 0.0); 3],
        };
        moment.set_hour(seconds / 3600.0 + longitude / 15.0);
        moment
    }

    /// Sets the local apparent solar time, hours.
    pub(super) fn set_hour(&mut self, hour: f64) {
        self.hour = hour;
        self.local = [1.0, 2.0, 3.0].map(|k| ((k * HOUR * hour).cos(), (k * HOUR * hour).sin()));
    }

    /// Returns the cosine of the day of the year from `phase`, `k` times a year.
    fn season(&self, k: f64, phase: f64) -> f64 {
        (k * DAY * (self.day - phase)).cos()
    }

    /// Returns the variable part of the height of the turbopause, with the phase of the exosphere's season.
    pub(super) fn turbopause(&self, phase: f64) -> f64 {
        (self.latitude * DEGREE).sin() * self.season(1.0, phase)
    }

    /// Returns the gravity at the ground, cm/s², and the effective radius of the Earth, km.
    pub(super) fn gravity(&self) -> (f64, f64) {
        let c = (2.0 * DEGREE * self.latitude).cos();
        let g = 980.616 * (1.0 - 0.0026373 * c);
        (g, 2.0 * g / (3.085462e-6 + 2.27e-9 * c) * 1e-5)
    }

    /// Returns Σ pᵢ Pₙ¹ over (i, n).
    fn first(&self, p: &[f64], terms: &[(usize, usize)]) -> f64 {
        terms.iter().map(|(i, n)| p[*i] * self.plg[1][*n]).sum()
    }

    /// Returns Σ pᵢ Pₙ⁰.
    fn zonal(&self, p: &[f64], terms: &[(usize, usize)]) -> f64 {
        terms.iter().map(|(i, n)| p[*i] * self.plg[0][*n]).sum()
    }

    /// Returns the cosine of the longitude from `phase`, degrees.
    fn meridian(&self, phase: f64) -> f64 {
        (DEGREE * (self.longitude - phase)).cos()
    }

    /// Returns the magnetic activity, weighted with the coefficients `p`.
    pub(super) fn activity(&self, p: &[f64; 150]) -> f64 {
        match &self.magnetic {
            Magnetic::Daily(ap) => {
                let k = if p[43] < 0.0 { 1e-5 } else { p[43] };
                saturated(ap - 4.0, k, p[44])
            }
            Magnetic::History(_) if p[51] == 0.0 => 0.0,
            Magnetic::History(ap) => {
                let span = 1.0 + p[138] * (45.0 - self.latitude.abs());
                let e = (-10_800.0 * p[51].abs() / span).exp().min(0.99999);
                let k = p[24].abs().max(1e-4);
                let g = ap.map(|a| saturated(a - 4.0, k, p[25]));
                let late = (g[4] * e.powi(4) + g[5] * e.powi(12)) * (1.0 - e.powi(8)) / (1.0 - e);
                let sum = g[0] + g[1] * e + g[2] * e * e + g[3] * e.powi(3) + late;
                sum / (1.0 + (1.0 - e.powi(19)) / (1.0 - e) * e.sqrt())
            }
        }
    }

    /// Returns G(L) of the thermosphere, from 150 coefficients.
    pub(super) fn upper(&self, p: &[f64; 150]) -> f64 {
        let (df, dfa, plg) = (self.df, self.dfa, &self.plg);
        let flux = p[19] * df + p[20] * df * df;
        let (f1, f2) = (1.0 + p[47] * dfa + flux, 1.0 + p[49] * dfa + flux);
        let spring = self.season(1.0, p[13]);
        let sun = flux + p[19] * df * p[59] * dfa + p[21] * dfa + p[29] * dfa * dfa;
        let latitude = self.zonal(p, &[(1, 2), (2, 4), (22, 6), (26, 1)]) + p[14] * plg[0][2] * dfa;
        let seasons = p[18] * self.season(1.0, p[31])
            + (p[15] + p[16] * plg[0][2]) * self.season(2.0, p[17])
            + f1 * self.zonal(p, &[(9, 1), (10, 3)]) * spring
            + p[37] * plg[0][1] * self.season(2.0, p[38]);
        let third = p[39] * plg[3][3] + (p[93] * plg[3][4] + p[46] * plg[3][6]) * spring;
        let third_sin = p[40] * plg[3][3] + (p[94] * plg[3][4] + p[48] * plg[3][6]) * spring;
        let tides = self.tides(p, spring, [self.first(p, &[(27, 5)]), self.first(p, &[(28, 5)])])
            + third * self.local[2].1
            + third_sin * self.local[2].0;
        let activity = self.activity(p);
        p[30]
            + sun
            + latitude
            + seasons
            + f2 * tides
            + self.magnetic_upper(p, spring, activity)
            + self.longitude_upper(p, spring)
            + self.universal_time(p, spring)
    }

    /// Returns diurnal and semidiurnal tides; `more` are terms that only the upper atmosphere has.
    fn tides(&self, p: &[f64], spring: f64, more: [f64; 2]) -> f64 {
        let [(c1, s1), (c2, s2), _] = self.local;
        let plg = &self.plg;
        let once = |a: usize, b: usize, season: usize, more: f64| {
            p[a] * plg[1][1] + p[b] * plg[1][3] + more + p[season] * plg[1][2] * spring
        };
        let twice = |a: usize, b: usize, c: usize, d: usize| {
            p[a] * plg[2][2] + p[b] * plg[2][4] + (p[c] * plg[2][3] + p[d] * plg[2][5]) * spring
        };
        once(3, 4, 11, more[0]) * c1
            + once(6, 7, 12, more[1]) * s1
            + twice(5, 41, 23, 35) * c2
            + twice(8, 42, 33, 36) * s2
    }

    /// Returns terms of magnetic activity, alone and with longitude and universal time.
    fn magnetic_upper(&self, p: &[f64; 150], spring: f64, activity: f64) -> f64 {
        // Indices of coefficients: zonal (3), with the season (3), with the hour (3) and its phase,
        // then mixed terms.
        let (zonal, season, hour, phase) = match self.magnetic {
            Magnetic::Daily(_) => ([32, 45, 34], [100, 101, 102], [121, 122, 123], 124),
            Magnetic::History(_) => ([50, 96, 54], [125, 126, 127], [128, 129, 130], 131),
        };
        let alone = p[zonal[0]]
            + self.zonal(p, &[(zonal[1], 2), (zonal[2], 4)])
            + self.zonal(p, &[(season[0], 1), (season[1], 3), (season[2], 5)]) * spring
            + self.first(p, &[(hour[0], 1), (hour[1], 3), (hour[2], 5)])
                * (HOUR * (self.hour - p[phase])).cos();
        let (asym, place, at, year, year_at, time, time_at) = match self.magnetic {
            Magnetic::Daily(_) => (120, [60, 61, 62], 63, [115, 116, 117], 118, [83, 84, 85], 75),
            Magnetic::History(_) => (132, [52, 98, 67], 97, [133, 134, 135], 136, [55, 56, 57], 58),
        };
        let mixed = (1.0 + p[asym] * self.plg[0][1])
            * self.first(p, &[(place[0], 2), (place[1], 4), (place[2], 6)])
            * self.meridian(p[at])
            + self.first(p, &[(year[0], 1), (year[1], 3), (year[2], 5)])
                * spring
                * self.meridian(p[year_at])
            + self.zonal(p, &[(time[0], 1), (time[1], 3), (time[2], 5)])
                * (SECOND * (self.seconds - p[time_at])).cos();
        activity * (alone + mixed)
    }

    fn longitude_upper(&self, p: &[f64; 150], spring: f64) -> f64 {
        let (sin, cos) = (DEGREE * self.longitude).sin_cos();
        let wave = |k: usize, fixed: usize, year: usize| {
            self.first(p, &[(k, 2), (k + 1, 4), (k + 2, 6)])
                + self.first(p, &[(fixed, 1), (fixed + 1, 3), (fixed + 2, 5)])
                + self.first(p, &[(year, 1), (year + 1, 3), (year + 2, 5)]) * spring
        };
        (1.0 + p[80] * self.dfa) * (wave(64, 103, 109) * cos + wave(90, 106, 112) * sin)
    }

    fn universal_time(&self, p: &[f64; 150], spring: f64) -> f64 {
        let plg = &self.plg;
        let zonal = (1.0 + p[95] * plg[0][1])
            * (1.0 + p[81] * self.dfa)
            * (1.0 + p[119] * plg[0][1] * spring)
            * self.zonal(p, &[(68, 1), (69, 3), (70, 5)])
            * (SECOND * (self.seconds - p[71])).cos();
        let angle = SECOND * (self.seconds - p[79]) + 2.0 * DEGREE * self.longitude;
        let second = p[76] * plg[2][3] + p[77] * plg[2][5] + p[78] * plg[2][7];
        zonal + second * angle.cos() * (1.0 + p[137] * self.dfa)
    }

    /// Returns G(L) of the lower atmosphere, from 100 coefficients; `activity` is weighted by the last array above.
    pub(super) fn lower(&self, p: &[f64; 100], activity: f64) -> f64 {
        let plg = &self.plg;
        let spring = self.season(1.0, p[13]);
        let latitude = self.zonal(p, &[(1, 2), (2, 4), (22, 6), (26, 1), (14, 3), (59, 5)]);
        let seasons = (p[18] + self.zonal(p, &[(47, 2), (29, 4)])) * self.season(1.0, p[31])
            + (p[15] + self.zonal(p, &[(16, 2), (30, 4)])) * self.season(2.0, p[17])
            + self.zonal(p, &[(9, 1), (10, 3), (20, 5)]) * spring
            + p[37] * plg[0][1] * self.season(2.0, p[38]);
        let (c3, s3) = self.local[2];
        let tides = self.tides(p, spring, [0.0; 2]) + plg[3][3] * (p[39] * s3 + p[40] * c3);
        let magnetic = match self.magnetic {
            Magnetic::Daily(_) => activity * (p[32] + p[45] * plg[0][2]),
            Magnetic::History(_) => activity * (p[50] + p[96] * plg[0][2]),
        };
        let (sin, cos) = (DEGREE * self.longitude).sin_cos();
        let wave = |k: usize, fixed: usize| {
            self.first(p, &[(k, 2), (k + 1, 4), (k + 2, 6)])
                + self.first(p, &[(fixed, 1), (fixed + 1, 3), (fixed + 2, 5)])
        };
        let through_the_year = 1.0
            + plg[0][1] * (p[80] * self.season(1.0, p[81]) + p[85] * self.season(2.0, p[86]))
            + p[83] * self.season(1.0, p[84])
            + p[87] * self.season(2.0, p[88]);
        let longitude = through_the_year * (wave(64, 74) * cos + wave(90, 77) * sin);
        p[21] * self.dfa + latitude + seasons + tides + magnetic + longitude
    }
}

/// Returns the activity above 4, with saturation for storms.
fn saturated(a: f64, k: f64, bend: f64) -> f64 {
    a + (bend - 1.0) * (a + ((-k * a).exp() - 1.0) / k)
}

/// Returns P_n^m up to degree 7 and order 3.
fn legendre(x: f64, c: f64) -> [[f64; 8]; 4] {
    let mut plg = [[0.0; 8]; 4];
    let mut sectoral = 1.0;
    for (m, row) in plg.iter_mut().enumerate() {
        if m > 0 {
            sectoral *= (2 * m - 1) as f64 * c;
        }
        row[m] = sectoral;
        row[m + 1] = (2 * m + 1) as f64 * x * sectoral;
        for n in m + 2..8 {
            let (n_, m_) = (n as f64, m as f64);
            row[n] = ((2.0 * n_ - 1.0) * x * row[n - 1] - (n_ + m_ - 1.0) * row[n - 2]) / (n_ - m_);
        }
    }
    plg
}
