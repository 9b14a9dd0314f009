//! Points in time and astronomical time scales. The only module that depends on hifitime.
//!
//! ```text
//! TAI  atoms                        UTC = TAI − leap seconds; from 1960 to 1972 with a drift: see `early`
//! TT = TAI + 32.184 s               Earth's precession and nutation
//! TDB = TT + up to 1.7 ms           ephemerides; pole and meridian of other planets
//! UT1 = UTC + ΔUT1                  turn of the Earth: see `rotation::Earth`
//! ```
//! A simulation counts seconds of TT from its epoch. These are small numbers, so the angle of a planet has a precision of 1e-15, instead of the 1e-11
//! of a rate multiplied by decades.

use crate::error::WorldError;
use hifitime::TimeScale;
use std::str::FromStr;

/// A point in time, to the nanosecond.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Epoch(hifitime::Epoch);

const DAY_NS: i128 = 86_400_000_000_000;
/// Julian date of J2000, days.
pub const JD_J2000: f64 = 2_451_545.0;

const NO_LEAP_SECOND: &str =
    "second 60 exists only in UTC, in minutes with a leap second, such as 2016-12-31 23:59:60";

const BEFORE_UTC: &str =
    "UTC begins in 1960; write the date in TT or TAI, such as 1957-10-04 19:29:00 TT";

/// Modified Julian date of 1900-01-01, from which hifitime counts, and of 1972-01-01.
const MJD_1900: f64 = 15_020.0;
const MJD_1972: f64 = 41_317.0;

/// TAI − UTC before 1972 (IERS, `UTC-TAI.history`): first modified Julian date, offset (s), reference date of the drift, drift (s/day).
const EARLY: [[f64; 4]; 14] = [
    [36_934.0, 1.417_818_0, 37_300.0, 0.001_296_0],
    [37_300.0, 1.422_818_0, 37_300.0, 0.001_296_0],
    [37_512.0, 1.372_818_0, 37_300.0, 0.001_296_0],
    [37_665.0, 1.845_858_0, 37_665.0, 0.001_123_2],
    [38_334.0, 1.945_858_0, 37_665.0, 0.001_123_2],
    [38_395.0, 3.240_130_0, 38_761.0, 0.001_296_0],
    [38_486.0, 3.340_130_0, 38_761.0, 0.001_296_0],
    [38_639.0, 3.440_130_0, 38_761.0, 0.001_296_0],
    [38_761.0, 3.540_130_0, 38_761.0, 0.001_296_0],
    [38_820.0, 3.640_130_0, 38_761.0, 0.001_296_0],
    [38_942.0, 3.740_130_0, 38_761.0, 0.001_296_0],
    [39_004.0, 3.840_130_0, 38_761.0, 0.001_296_0],
    [39_126.0, 4.313_170_0, 39_126.0, 0.002_592_0],
    [39_887.0, 4.213_170_0, 39_126.0, 0.002_592_0],
];

/// Returns TAI − UTC (s) at a modified Julian date (UTC) before 1972; `None` before 1960.
fn early(mjd: f64) -> Option<f64> {
    let row = EARLY.partition_point(|r| r[0] <= mjd).checked_sub(1)?;
    let [_, offset, reference, drift] = EARLY[row];
    Some(offset + (mjd - reference) * drift)
}

/// Returns a duration (s) that is rounded to nanoseconds. hifitime truncates, which would show 39.999999999 s for 40 s.
fn rounded(seconds: f64) -> hifitime::Duration {
    hifitime::Duration::from_total_nanoseconds((seconds * 1e9).round() as i128)
}

/// Returns the index of `:60` in a date if it is the second.
fn second_60(text: &str) -> Option<usize> {
    let at = text.match_indices(':').nth(1)?.0;
    let rest = text[at..].strip_prefix(":60")?;
    (!rest.starts_with(|c: char| c.is_ascii_digit())).then_some(at)
}

impl Epoch {
    /// Reads `2012-08-06 05:17:57 UTC`. The time scale at the end may also be TAI, TT, TDB or GPST; the default is UTC. A leap second is second 60.
    ///
    /// # Errors
    /// The text is not a date, is in UTC before 1960, or has second 60 in a minute without a leap second. The error includes the text.
    pub fn parse(text: &str) -> Result<Self, WorldError> {
        let wrong = |fact: String| WorldError::Epoch { text: text.to_string(), fact };
        let read = |text: &str| -> Result<(Self, bool), WorldError> {
            let date = hifitime::Epoch::from_str(text).map_err(|e| wrong(e.to_string()))?;
            let utc = date.time_scale == TimeScale::UTC;
            let epoch = if utc { Self::from_utc(date) } else { Some(Self(date)) };
            Ok((epoch.ok_or_else(|| wrong(BEFORE_UTC.to_string()))?, utc))
        };
        let text = text.trim();
        // hifitime treats second 60 of any minute as second 59.
        let Some(at) = second_60(text) else { return read(text).map(|(epoch, _)| epoch) };
        let (before, utc) = read(&format!("{}:59{}", &text[..at], &text[at + 3..]))?;
        let leap = utc.then(|| before.leap_second());
        leap.flatten().ok_or_else(|| wrong(NO_LEAP_SECOND.to_string()))
    }

    /// Converts a date in UTC; `None` before 1960. hifitime assumes TAI − UTC = 0 before 1972.
    fn from_utc(date: hifitime::Epoch) -> Option<Self> {
        let tai = date.to_tai_duration();
        let mjd = MJD_1900 + tai.to_seconds() / 86400.0;
        if mjd >= MJD_1972 {
            return Some(Self(date));
        }
        let tai = tai + rounded(early(mjd)?);
        Some(Self(hifitime::Epoch::from_tai_duration(tai)))
    }

    /// Returns TAI − UTC (s) before 1972, 0 before 1960; `None` from 1972 on.
    fn early_offset(&self) -> Option<f64> {
        let mjd = MJD_1900 + self.0.to_tai_duration().to_seconds() / 86400.0;
        let utc = mjd - early(mjd - 10.0 / 86400.0).unwrap_or(0.0) / 86400.0;
        (utc < MJD_1972).then(|| early(utc).unwrap_or(0.0))
    }

    /// Returns the instant whose date of hifitime is the date in UTC.
    fn date(&self) -> hifitime::Epoch {
        match self.early_offset() {
            None => self.0,
            Some(offset) => {
                hifitime::Epoch::from_tai_duration(self.0.to_tai_duration() - rounded(offset))
            }
        }
    }

    /// Returns the epoch one second later if it is within a leap second.
    fn leap_second(self) -> Option<Self> {
        let (ahead, behind) = (self.tt_minus_utc(), self.plus(2.0).tt_minus_utc());
        (behind - ahead > 0.5).then(|| self.plus(1.0))
    }

    /// Creates an epoch from a UTC date; `second` may have a fraction, down to nanoseconds.
    ///
    /// # Errors
    /// A date that does not exist, or is before 1960.
    pub fn utc(
        year: i32,
        month: u8,
        day: u8,
        hour: u8,
        minute: u8,
        second: f64,
    ) -> Result<Self, WorldError> {
        let text = format!("{year}-{month:02}-{day:02} {hour:02}:{minute:02}:{second} UTC");
        let wrong = |fact: String| WorldError::Epoch { text: text.clone(), fact };
        if !(0.0..61.0).contains(&second) {
            return Err(wrong(format!("{second} is not a second of a minute")));
        }
        let ns = ((second - second.floor()) * 1e9).round().min(999_999_999.0) as u32;
        let scale = TimeScale::UTC;
        let leap = second >= 60.0;
        let whole = second.floor().min(59.0) as u8;
        let read =
            hifitime::Epoch::maybe_from_gregorian(year, month, day, hour, minute, whole, ns, scale)
                .map_err(|e| wrong(e.to_string()))?;
        let read = Self::from_utc(read).ok_or_else(|| wrong(BEFORE_UTC.to_string()))?;
        match leap {
            true => read.leap_second().ok_or_else(|| wrong(NO_LEAP_SECOND.to_string())),
            false => Ok(read),
        }
    }

    /// Returns midnight (UTC) of a modified Julian date, whole days.
    #[must_use]
    pub fn of_mjd(days: i64) -> Self {
        let date = hifitime::Epoch::from_mjd_utc(days as f64);
        Self::from_utc(date).unwrap_or(Self(date))
    }

    /// Returns J2000: 2000-01-01 12:00 TT.
    #[must_use]
    pub fn j2000() -> Self {
        Self(hifitime::Epoch::from_gregorian(2000, 1, 1, 12, 0, 0, 0, TimeScale::TT))
    }

    /// Returns the epoch this many seconds of TT later; leap seconds count.
    #[must_use]
    pub fn plus(&self, seconds: f64) -> Self {
        // hifitime adds seconds of UTC to an epoch in UTC, which would skip leap seconds.
        Self(self.0.to_time_scale(TimeScale::TT) + hifitime::Duration::from_seconds(seconds))
    }

    /// Returns the seconds of TT since another epoch.
    #[must_use]
    pub fn since(&self, other: &Self) -> f64 {
        (self.0.to_tt_duration() - other.0.to_tt_duration()).to_seconds()
    }

    /// Returns TT as a Julian date in two parts: whole days (ending in .5, at midnight) and a fraction 0 … 1.
    #[must_use]
    pub fn tt(&self) -> (f64, f64) {
        // hifitime counts from 1900-01-01 00:00, JD 2415020.5.
        let ns = self.0.to_tt_duration().total_nanoseconds();
        let day = ns.div_euclid(DAY_NS);
        (2_415_020.5 + day as f64, ns.rem_euclid(DAY_NS) as f64 / DAY_NS as f64)
    }

    /// Returns UT1 as a Julian date in two parts, given ΔUT1 = UT1 − UTC (s), as published by the IERS.
    #[must_use]
    pub fn ut1(&self, dut1: f64) -> (f64, f64) {
        let (day, fraction) = self.tt();
        (day, fraction + (dut1 - self.tt_minus_utc()) / 86400.0)
    }

    /// Returns TT − UTC, s: leap seconds plus 32.184, and from 1960 to 1972 the offset of that time. Before 1960 UTC is assumed to be TAI.
    #[must_use]
    pub fn tt_minus_utc(&self) -> f64 {
        if let Some(offset) = self.early_offset() {
            return offset + 32.184;
        }
        // hifitime compares its TAI count with UTC dates and is half a minute early, so pass UTC.
        let leap = |count: hifitime::Duration| {
            hifitime::Epoch::from_tai_duration(count).leap_seconds(true).unwrap_or(10.0)
        };
        let tai = self.0.to_tai_duration();
        let utc = tai - hifitime::Duration::from_seconds(leap(tai));
        leap(utc) + 32.184
    }

    /// Returns TDB in days past J2000 as whole days and a fraction.
    #[must_use]
    pub fn tdb_days(&self) -> (f64, f64) {
        let (day, fraction) = self.tt();
        let days = day - JD_J2000;
        (days, fraction + tdb_minus_tt((days + fraction) / 36525.0) / 86400.0)
    }

    /// Returns the year with its fraction, UTC: 2020.5 is 2020-07-02 00:00.
    #[must_use]
    pub fn decimal_year(&self) -> f64 {
        let (year, ..) = self.date().to_gregorian(TimeScale::UTC);
        let (day, second) = self.utc_day_and_second();
        let leap = (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
        let days = if leap { 366.0 } else { 365.0 };
        f64::from(year) + (f64::from(day) - 1.0 + second / 86400.0) / days
    }

    /// Returns the day of the year (1 …) and the second of the day, UTC.
    #[must_use]
    pub fn utc_day_and_second(&self) -> (u32, f64) {
        let (year, month, day, h, m, s, ns) = self.date().to_gregorian(TimeScale::UTC);
        let leap = (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
        let before = [0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334];
        let month = usize::from(month);
        let extra = u32::from(leap && month > 2);
        let second = f64::from(h) * 3600.0 + f64::from(m) * 60.0 + f64::from(s);
        (before[month - 1] + u32::from(day) + extra, second + f64::from(ns) * 1e-9)
    }
}

impl std::fmt::Display for Epoch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.date().to_gregorian_str(TimeScale::UTC))
    }
}

/// Returns TDB − TT, s, at the centre of the Earth; `T` is centuries of TT past J2000. Accurate to 10 µs from 1600 to 2200: Kaplan, *The IAU
/// Resolutions …*, USNO Circular 179 (2005), eq. 2.6.
#[must_use]
pub fn tdb_minus_tt(T: f64) -> f64 {
    const TERMS: [[f64; 3]; 6] = [
        [0.001657, 628.3076, 6.2401],
        [0.000022, 575.3385, 4.2970],
        [0.000014, 1256.6152, 6.1969],
        [0.000005, 606.9777, 4.0212],
        [0.000005, 52.9691, 0.4444],
        [0.000002, 21.3299, 5.5431],
    ];
    let sum: f64 = TERMS.iter().map(|[a, w, p]| a * (w * T + p).sin()).sum();
    sum + 0.000010 * T * (628.3076 * T + 4.2490).sin()
}
