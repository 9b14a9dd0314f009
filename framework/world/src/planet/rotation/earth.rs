//! Rotation of the Earth by IAU 2006/2000A, based on the celestial intermediate origin. The only module that depends on sofars.
//!
//! ```text
//! R_PI = W(x_p, y_p, s') R₃(ERA) Q(X, Y, s)           GCRS to ITRS
//! ERA = 2π (0.7790572732640 + 1.00273781191135448 d_UT1)
//! ω = ERȦ p + p × ṗ,   p = (X, Y, √(1 − X² − Y²))
//! ```
//! Sources: IERS Conventions 2010, chapter 5, and SOFA's `xys06a`, `era00`, `sp00`, `c2ixys`, `pom00` in sofars' translation (its results rest on
//! software of the IAU's SOFA board). In the second term of ω, the origin is chosen so that precession and nutation do not rotate about the pole.
//!
//! X, Y and s take thousands of terms (40 µs) but change slowly. They are tabulated every six hours and interpolated with polynomials of degree 7,
//! accurate to 1e-13 in the matrix. Beyond the table an evaluation takes 0.4 ms.
//!
//! UT1, polar motion and offsets of X and Y must be observed. They are given as one set of numbers, or as a daily table:
//! ```text
//! ERA = ERA(0) + ERȦ t + 2π 1.0027… (ΔUT1(t) − ΔUT1(0)),   ΔUT1 = UT1 − TAI
//! ω += R_IT (−ẏ_p, −ẋ_p, 0)
//! ```

use super::earth_parameters::EarthParameters;
use super::orientation::{Daily, EarthOrientation};
use super::{Spin, about_x, about_y, about_z, phase};
use crate::error::{WorldError, number};
use crate::planet::Epoch;
use linkwork_spatial::{Mat3, Quat, Vec3};
use std::f64::consts::TAU;

/// X, Y, s.
type Xys = [f64; 3];

/// Time between entries of the table, s.
const STEP: f64 = 21600.0;
/// Number of points of an interpolation.
const POINTS: usize = 8;

/// Newton's divided differences of X, Y, s in steps; the interval is in the middle of its points.
#[derive(Clone, Copy, Debug)]
struct Piece([[f64; POINTS]; 3]);

/// Rotation of the Earth, starting at an epoch.
#[derive(Clone, Debug)]
pub struct Earth {
    /// TT at the epoch, Julian date in two parts.
    tt: (f64, f64),
    /// ERA at the epoch, rad, and its rate, rad/s.
    era: [f64; 2],
    observed: Observed,
    pieces: Vec<Piece>,
}

/// Observed parameters.
#[derive(Clone, Debug)]
enum Observed {
    /// Constant: offsets of X and Y, and `R_TP`, ITRS to terrestrial intermediate axes.
    Still([f64; 2], Quat),
    /// Daily table, and UT1 − TAI at the epoch.
    Daily(Daily, f64),
}

/// Revolutions of the Earth per second of UT1.
const TURNS: f64 = 1.002_737_811_911_354_48 / 86400.0;

impl Earth {
    /// Prepares the table for t from 0 to `duration` (s) after `epoch`. Takes 40 µs per six hours.
    ///
    /// # Errors
    /// Parameters that are not finite, ΔUT1 above 1 s, a pole beyond 5″, or a duration that is negative or above a hundred years.
    pub fn new(
        epoch: &Epoch,
        parameters: EarthParameters,
        duration: f64,
    ) -> Result<Self, WorldError> {
        let p = &parameters;
        number("dut1, s", p.dut1, |x| x.abs() <= 1.0, "UT1 − UTC is kept below 0.9 s")?;
        for x in p.pole.iter().chain(&p.celestial_pole_offsets) {
            let help = "radians: 0.3″ is 1.5e-6";
            number("a coordinate of the pole, rad", *x, |x| x.abs() < 2.5e-5, help)?;
        }
        let help = "some milliseconds";
        number("excess_of_day, s", p.excess_of_day, |x| x.abs() < 0.1, help)?;
        let help = "0 to 100 years";
        number("duration, s", duration, |x| (0.0..3.2e9).contains(&x), help)?;
        let observed = Observed::Still(p.celestial_pole_offsets, polar(epoch.tt(), p.pole));
        let rate = TAU * TURNS * (1.0 - p.excess_of_day / 86400.0);
        Ok(Self::made(epoch, p.dut1, rate, observed, duration))
    }

    /// Prepares the table with daily observed parameters.
    ///
    /// # Errors
    /// The daily table does not cover the interval from the epoch to `duration` (s) after it, or the duration is negative or above a hundred years.
    pub fn by_day(
        epoch: &Epoch,
        table: &EarthOrientation,
        duration: f64,
    ) -> Result<Self, WorldError> {
        let help = "0 to 100 years";
        number("duration, s", duration, |x| (0.0..3.2e9).contains(&x), help)?;
        let [first, last] = table.span();
        if *epoch < first || epoch.plus(duration) > last {
            let fact = format!(
                "the table of the Earth's orientation covers {first} to {last}, but {epoch} to {} is needed",
                epoch.plus(duration)
            );
            let help = "give a file that covers this interval, start at another epoch, or use a shorter `span`";
            return Err(WorldError::Uncovered { fact, help });
        }
        let daily = Daily::of(table, epoch);
        let start = daily.at(0.0).0[0];
        let dut1 = start + epoch.tt_minus_utc() - 32.184;
        Ok(Self::made(epoch, dut1, TAU * TURNS, Observed::Daily(daily, start), duration))
    }

    fn made(epoch: &Epoch, dut1: f64, rate: f64, observed: Observed, duration: f64) -> Self {
        let tt = epoch.tt();
        let (ut_day, ut_fraction) = epoch.ut1(dut1);
        let era = [earth_rotation_angle(ut_day, ut_fraction), rate];
        let last = (duration / STEP).floor() as i64;
        let samples: Vec<Xys> =
            (0..=last + POINTS as i64).map(|k| sample(tt, k - offset())).collect();
        let pieces = samples.windows(POINTS).map(piece).collect();
        Self { tt, era, observed, pieces }
    }

    /// Returns the spin `t` seconds after the epoch.
    #[must_use]
    pub fn at(&self, t: f64) -> Spin {
        let k = (t / STEP).floor();
        let (mut xys, mut rate) =
            match usize::try_from(k as i64).ok().and_then(|i| self.pieces.get(i)) {
                Some(piece) => piece.at(t / STEP - k),
                None => {
                    let from = k as i64 - offset();
                    let points: [Xys; POINTS] =
                        std::array::from_fn(|j| sample(self.tt, from + j as i64));
                    piece(&points).at(t / STEP - k)
                }
            };
        let mut era = self.era[0] + phase(self.era[1] / TAU, t);
        let mut turning = self.era[1];
        // The result is ω of the planet's axes in T, rad/s.
        let mut wobble = Vec3::zeros();
        let R_TP = match &self.observed {
            Observed::Still(offsets, R_TP) => {
                (0..2).for_each(|k| xys[k] += offsets[k]);
                *R_TP
            }
            Observed::Daily(daily, start) => {
                let (value, slope) = daily.at(t);
                era += TAU * TURNS * (value[0] - start);
                turning += TAU * TURNS * slope[0];
                for k in 0..2 {
                    xys[k] += value[3 + k];
                    rate[k] += slope[3 + k];
                }
                wobble = Vec3::new(-slope[2], -slope[1], 0.0);
                polar(self.tt, [value[1], value[2]])
            }
        };
        let R_IT = intermediate(&xys) * about_z(era);
        let R_IP = R_IT * R_TP;
        let [x, y, _] = xys;
        let z = (1.0 - x * x - y * y).sqrt();
        let p = Vec3::new(x, y, z);
        let [dx, dy, _] = rate;
        let dp = Vec3::new(dx, dy, -(x * dx + y * dy) / z);
        Spin { R_IP, omega_I: p * turning + p.cross(&dp) + R_IT * wobble }
    }
}

/// Returns the number of steps from the first point of a piece to its interval.
fn offset() -> i64 {
    POINTS as i64 / 2 - 1
}

/// Returns X, Y, s at step `k` from the epoch.
fn sample(tt: (f64, f64), k: i64) -> Xys {
    let (x, y, s) = sofars::pnp::xys06a(tt.0, tt.1 + k as f64 * (STEP / 86400.0));
    [x, y, s]
}

/// Computes divided differences of eight points at integers.
fn piece(points: &[Xys]) -> Piece {
    let column = |c: usize| {
        let mut d: [f64; POINTS] = std::array::from_fn(|k| points[k][c]);
        for order in 1..POINTS {
            for k in (order..POINTS).rev() {
                d[k] = (d[k] - d[k - 1]) / order as f64;
            }
        }
        d
    };
    Piece([column(0), column(1), column(2)])
}

impl Piece {
    /// Returns values and rates (1/s) at `x`, 0 … 1 in the interval, with Horner's scheme on Newton's form.
    fn at(&self, x: f64) -> (Xys, Xys) {
        let x = x + offset() as f64;
        let (mut value, mut slope) = ([0.0; 3], [0.0; 3]);
        for (c, d) in self.0.iter().enumerate() {
            let (mut p, mut dp) = (d[POINTS - 1], 0.0);
            for k in (0..POINTS - 1).rev() {
                let h = x - k as f64;
                dp = dp * h + p;
                p = p * h + d[k];
            }
            (value[c], slope[c]) = (p, dp / STEP);
        }
        (value, slope)
    }
}

/// Returns the Earth rotation angle, rad, 0 … 2π, for a UT1 Julian date in two parts (Capitaine et al. 2000; SOFA `era00`).
#[must_use]
pub fn earth_rotation_angle(ut1_day: f64, ut1_fraction: f64) -> f64 {
    sofars::erst::era00(ut1_day, ut1_fraction)
}

/// Returns R_IC: celestial intermediate axes to GCRS.
fn intermediate(xys: &Xys) -> Quat {
    let [x, y, s] = *xys;
    let r2 = x * x + y * y;
    let e = y.atan2(x);
    let d = (r2 / (1.0 - r2)).sqrt().atan();
    about_z(e) * about_y(d) * about_z(-(e + s))
}

/// Returns R_TP from the coordinates of the pole and s', which changes by 47 µas per century; the value at the epoch is used.
fn polar(tt: (f64, f64), pole: [f64; 2]) -> Quat {
    let sp = sofars::pnp::sp00(tt.0, tt.1);
    about_z(sp) * about_y(-pole[0]) * about_x(-pole[1])
}

/// Returns the rotation from the true equator and mean equinox of date (TEME), in which two-line elements of Earth satellites are given, to the GCRS.
/// Both have the same intermediate pole, and their x axes differ by ERA − GMST (of 1982, as two-line elements use).
#[must_use]
pub fn teme_to_gcrs(epoch: &Epoch) -> Quat {
    let (tt, ut) = (epoch.tt(), epoch.ut1(0.0));
    let (x, y, s) = sofars::pnp::xys06a(tt.0, tt.1);
    let turn = sofars::erst::era00(ut.0, ut.1) - sofars::erst::gmst82(ut.0, ut.1);
    intermediate(&[x, y, s]) * about_z(turn)
}

/// Returns the rotation from the mean equator and equinox of J2000 (EME2000) to the GCRS: the frame bias of the IAU 2000 model, 23 mas.
#[must_use]
pub fn eme2000_to_gcrs() -> Quat {
    let epoch = Epoch::j2000().tt();
    let (bias, _, _) = sofars::pnp::bp00(epoch.0, epoch.1);
    // These are the rows of the matrix from GCRS to J2000.
    let R = Mat3::from_fn(|row, column| bias[row][column]).transpose();
    linkwork_spatial::quat(&R)
}

/// Computes the matrix GCRS to ITRS at an epoch step by step with SOFA's functions. [`Earth`] interpolates it. Takes 40 µs.
#[must_use]
pub fn gcrs_to_itrs(epoch: &Epoch, p: &EarthParameters) -> Mat3 {
    let (tt, ut) = (epoch.tt(), epoch.ut1(p.dut1));
    let (x, y, s) = sofars::pnp::xys06a(tt.0, tt.1);
    let [dx, dy] = p.celestial_pole_offsets;
    let q = sofars::pnp::c2ixys(x + dx, y + dy, s);
    let w = sofars::pnp::pom00(p.pole[0], p.pole[1], sofars::pnp::sp00(tt.0, tt.1));
    let r = sofars::pnp::c2tcio(&q, sofars::erst::era00(ut.0, ut.1), &w);
    Mat3::from_fn(|i, j| r[i][j])
}
