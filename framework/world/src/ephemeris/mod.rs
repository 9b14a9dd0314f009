//! Positions of Sun, Moon and planets.
//!
//! | function | method | error against DE440 |
//! |---|---|---|
//! | [`sun`], [`earth`] | SOFA `epv00`, VSOP2000 shortened, 1900–2100 | 2–8 km |
//! | [`moon`] | SOFA `moon98`, ELP of Meeus | 2–7 km |
//! | [`planet`] | Keplerian elements of JPL, 1800–2050 | Mars 2–27″ |
//! | [`sun_low`] | Keplerian Sun | 9–20″ |
//! | [`moon_low`] | 14 terms in longitude | 15–75″, 130 km |
//!
//! Axes are those of the ICRF (mean equator of J2000 for the low-precision ones, 0.02″ off). `tdb` is in days past J2000 in two parts, as from
//! [`crate::planet::Epoch::tdb_days`]. [`Ephemeris`] is the interface for kernels ([`Spk`]); [`Sampled`] makes any source fast for one simulation.

mod conics;
mod differences;
mod kepler;
mod low;
mod sampled;
mod series;
mod spk;
mod states;

pub use kepler::{OBLIQUITY_J2000, planet};
pub use low::{moon_low, sun_low};
pub use sampled::Sampled;
pub use series::{earth, moon, sun};
pub use spk::{Spk, SpkSegment};

use crate::error::WorldError;
use crate::planet::{Epoch, PointMotion};

/// Bodies of an ephemeris.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Body {
    /// The Sun.
    Sun,
    /// Mercury.
    Mercury,
    /// Venus.
    Venus,
    /// The Earth itself.
    Earth,
    /// The Earth's Moon.
    Moon,
    /// Mars, or the barycentre of its system, 0.2 m away.
    Mars,
    /// The barycentre of Jupiter's system.
    Jupiter,
    /// The barycentre of Saturn's system.
    Saturn,
    /// The barycentre of Uranus' system.
    Uranus,
    /// The barycentre of Neptune's system.
    Neptune,
}

impl Body {
    /// Returns NAIF's number: barycentres for Mercury, Venus and the outer planets.
    #[must_use]
    pub fn naif(self) -> i32 {
        match self {
            Self::Sun => 10,
            Self::Mercury => 1,
            Self::Venus => 2,
            Self::Earth => 399,
            Self::Moon => 301,
            Self::Mars => 4,
            Self::Jupiter => 5,
            Self::Saturn => 6,
            Self::Uranus => 7,
            Self::Neptune => 8,
        }
    }
}

/// A source of positions.
pub trait Ephemeris {
    /// Returns position (m) and velocity (m/s) of `target` from `origin`, ICRF axes, geometric (no light time), at `tdb` days past J2000.
    ///
    /// # Errors
    /// The source does not cover the body or the time.
    fn state(&self, target: Body, origin: Body, tdb: (f64, f64))
    -> Result<PointMotion, WorldError>;

    /// Returns the first and last TDB second past J2000 of the interval around `tdb` (days) in which [`Ephemeris::state`] covers these two bodies
    /// without a gap.
    ///
    /// # Errors
    /// As [`Ephemeris::state`].
    fn span(&self, target: Body, origin: Body, tdb: (f64, f64)) -> Result<[f64; 2], WorldError>;
}

/// Returns TDB seconds past J2000 from days in two parts.
pub(crate) fn seconds(tdb: (f64, f64)) -> f64 {
    tdb.0 * 86_400.0 + tdb.1 * 86_400.0
}

/// Returns the date of a TDB second past J2000, UTC, to a hundredth of a second, for messages.
#[must_use]
pub fn date(et: f64) -> String {
    // A calendar date does not exist for NaN, or beyond thirty thousand years.
    if !(et.abs() < 1e12) {
        return format!("{et} s past J2000");
    }
    // TDB differs from TT by up to 2 ms. Subtract 0.184 s before rounding, because UTC differs from
    // TT by whole seconds and 0.184 s.
    let hundredths = ((et - 0.184) * 100.0).round();
    let whole = (hundredths / 100.0).floor();
    let rest = (hundredths - 100.0 * whole) / 100.0 + 0.184;
    // Separate days from seconds, because nanoseconds within a century are not exact in a double.
    let days = (whole / 86_400.0).floor() * 86_400.0;
    Epoch::j2000().plus(days).plus(whole - days).plus(rest).to_string()
}

/// Sun, Earth and Moon from SOFA, the other planets from Keplerian elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Analytic;

impl Analytic {
    /// Returns the motion relative to the Sun.
    fn heliocentric(body: Body, tdb: (f64, f64)) -> Result<PointMotion, WorldError> {
        let zero = linkwork_spatial::Vec3::zeros();
        match body {
            Body::Sun => Ok(PointMotion { position: zero, velocity: zero }),
            Body::Earth => earth(tdb),
            Body::Moon => {
                let (e, m) = (earth(tdb)?, moon(tdb));
                Ok(PointMotion {
                    position: e.position + m.position,
                    velocity: e.velocity + m.velocity,
                })
            }
            other => planet(other, tdb),
        }
    }

    /// Returns the first and last TDB day past J2000 of the series for a body.
    fn days(body: Body) -> [f64; 2] {
        match body {
            Body::Sun => [f64::NEG_INFINITY, f64::INFINITY],
            Body::Earth | Body::Moon => series::DAYS,
            _ => kepler::DAYS,
        }
    }
}

impl Ephemeris for Analytic {
    fn state(
        &self,
        target: Body,
        origin: Body,
        tdb: (f64, f64),
    ) -> Result<PointMotion, WorldError> {
        // Compute the Moon from the Earth directly, because a difference of two positions relative
        // to the Sun has fewer accurate digits.
        match (target, origin) {
            (Body::Moon, Body::Earth) => return Ok(moon(tdb)),
            (Body::Earth, Body::Moon) => {
                let m = moon(tdb);
                return Ok(PointMotion { position: -m.position, velocity: -m.velocity });
            }
            _ => {}
        }
        let (a, b) = (Self::heliocentric(target, tdb)?, Self::heliocentric(origin, tdb)?);
        Ok(PointMotion { position: a.position - b.position, velocity: a.velocity - b.velocity })
    }
    fn span(&self, target: Body, origin: Body, tdb: (f64, f64)) -> Result<[f64; 2], WorldError> {
        self.state(target, origin, tdb)?;
        let ([a, b], [c, d]) = (Self::days(target), Self::days(origin));
        Ok([a.max(c) * 86_400.0, b.min(d) * 86_400.0])
    }
}
