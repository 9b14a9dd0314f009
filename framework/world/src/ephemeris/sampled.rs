//! An ephemeris for one pair of bodies and one simulation: Chebyshev polynomials fitted to another ephemeris, 0.05 µs per query.
//!
//! An integrator queries Sun and Moon at every stage. Series of thousands of terms take 26 µs, these polynomials 0.05 µs. Each interval has the nodes
//! x_k = cos(π (k + ½)/n):
//! ```text
//! c_j = (2 − δ_j0)/n Σ_k f(x_k) cos(j π (k + ½)/n)
//! ```

use super::{Body, Ephemeris};
use crate::daf::chebyshev;
use crate::error::{WorldError, number};
use crate::planet::{Epoch, PointMotion};
use linkwork_spatial::Vec3;
use std::f64::consts::PI;

/// Number of coefficients per interval and axis.
const TERMS: usize = 14;

/// Position and velocity of one body relative to another, starting at an epoch.
#[derive(Clone, Debug)]
pub struct Sampled {
    /// Length of an interval, s.
    length: f64,
    duration: f64,
    /// Coefficients in m, x, y, z for each interval.
    pieces: Vec<[[f64; TERMS]; 3]>,
}

impl Sampled {
    /// Samples `source` for t from 0 to `duration` (s) after `epoch`, and nowhere else, in intervals of equal length: fourteen samples per day with
    /// the Moon, or per four days without. The error is a millimetre for the Moon and centimetres for planets. The velocity is the derivative of the
    /// position, which need not hold for the source's own velocity.
    ///
    /// # Errors
    /// An error of the source, or a duration that is not above zero or exceeds a hundred years.
    pub fn new(
        source: &impl Ephemeris,
        target: Body,
        origin: Body,
        epoch: &Epoch,
        duration: f64,
    ) -> Result<Self, WorldError> {
        number("duration, s", duration, |x| x > 0.0 && x < 3.2e9, "0 to 100 years")?;
        let fast = [target, origin].contains(&Body::Moon);
        let count = (duration / if fast { 86_400.0 } else { 345_600.0 }).ceil().max(1.0);
        let length = duration / count;
        let tdb = epoch.tdb_days();
        let angle = |k: usize| PI * (k as f64 + 0.5) / TERMS as f64;
        let mut pieces = Vec::new();
        for i in 0..count as usize {
            let mut values = [Vec3::zeros(); TERMS];
            for (k, value) in values.iter_mut().enumerate() {
                let t = (i as f64 + 0.5 + 0.5 * angle(k).cos()) * length;
                *value = source.state(target, origin, (tdb.0, tdb.1 + t / 86_400.0))?.position;
            }
            let term = |axis: usize, j: usize| {
                let sum: f64 =
                    (0..TERMS).map(|k| values[k][axis] * (j as f64 * angle(k)).cos()).sum();
                sum * if j == 0 { 1.0 } else { 2.0 } / TERMS as f64
            };
            pieces.push(std::array::from_fn(|axis| std::array::from_fn(|j| term(axis, j))));
        }
        Ok(Self { length, duration, pieces })
    }

    /// Returns position (m) and velocity (m/s) `t` seconds after the epoch.
    ///
    /// # Errors
    /// A time outside the sampled interval (with a tolerance of one second at both ends).
    pub fn at(&self, t: f64) -> Result<PointMotion, WorldError> {
        let help = "sample the ephemeris over the whole simulation";
        let inside = |t: f64| (-1.0..=self.duration + 1.0).contains(&t);
        number("t, s after the epoch of a sampled ephemeris", t, inside, help)?;
        let k = ((t / self.length).max(0.0) as usize).min(self.pieces.len() - 1);
        let x = 2.0 * (t / self.length - k as f64) - 1.0;
        let (mut position, mut velocity) = (Vec3::zeros(), Vec3::zeros());
        for (axis, c) in self.pieces[k].iter().enumerate() {
            let (value, slope) = chebyshev(c, x);
            position[axis] = value;
            velocity[axis] = slope * 2.0 / self.length;
        }
        Ok(PointMotion { position, velocity })
    }
}
