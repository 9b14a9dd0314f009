//! What can be wrong with what is given to this crate: place, fact, remedy.

use thiserror::Error;

/// Anything that is refused. The message says the fact, and after `help:` the remedy.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum WorldError {
    /// A number outside the range in which it means something.
    #[error("`{what}` is {value}\n  help: {help}")]
    Number {
        /// Which number, with its unit.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        help: &'static str,
    },
    /// A line of a file that cannot be read.
    #[error("{file}:{line}: {fact}\n  help: {help}")]
    Line {
        /// Name of the file, as the caller gave it.
        file: String,
        /// Line, from 1; 0 where the file as a whole is meant.
        line: usize,
        /// What is there.
        fact: String,
        /// What should be there.
        help: &'static str,
    },
    /// An epoch that is not one.
    #[error(
        "`{text}` is no epoch: {fact}\n  help: write `2012-08-06 05:17:57 UTC` (or TAI, TT, TDB, GPST)"
    )]
    Epoch {
        /// The text.
        text: String,
        /// What is wrong.
        fact: String,
    },
    /// A position so near to the centre of an ellipsoid that its latitude means nothing.
    #[error(
        "a point {radius:.3} m from the centre of the ellipsoid has no geodetic latitude\n  help: stay at \
         least {limit:.3} m away, where normals of the ellipsoid do not cross"
    )]
    NearCentre {
        /// Distance from the centre, m.
        radius: f64,
        /// Least distance, m.
        limit: f64,
    },
    /// Position and velocity that span no orbital plane.
    #[error(
        "position {position:?} m and velocity {velocity:?} m/s are parallel or zero: there is no \
         orbital plane\n  help: an orbital frame needs both, and an angle between them"
    )]
    NoPlane {
        /// Position from the centre, m.
        position: [f64; 3],
        /// Velocity, m/s.
        velocity: [f64; 3],
    },
    /// A degree or order that a set of coefficients has not.
    #[error("{what} {asked} is more than {max}\n  help: {help}")]
    Degree {
        /// Degree or order.
        what: &'static str,
        /// What was asked for.
        asked: usize,
        /// What there is.
        max: usize,
        /// What to do.
        help: &'static str,
    },
    /// A body or a time that an ephemeris does not cover.
    #[error("{fact}\n  help: {help}")]
    Uncovered {
        /// Which body, which time, and what there is.
        fact: String,
        /// What to do.
        help: &'static str,
    },
    /// Tables of a climate that do not make one.
    #[error("{fact}\n  help: {help}")]
    Climate {
        /// What is wrong.
        fact: String,
        /// What to do.
        help: &'static str,
    },
    /// A mesh that is no closed surface.
    #[error("{place}: {fact}\n  help: {help}")]
    Mesh {
        /// Vertex, face, edge, or line of the file.
        place: String,
        /// What is wrong.
        fact: String,
        /// What to do.
        help: &'static str,
    },
}

/// Refuses NaN, infinity, and what `good` refuses.
pub(crate) fn number(
    what: &'static str,
    value: f64,
    good: impl Fn(f64) -> bool,
    help: &'static str,
) -> Result<f64, WorldError> {
    if value.is_finite() && good(value) {
        Ok(value)
    } else {
        Err(WorldError::Number { what, value, help })
    }
}
