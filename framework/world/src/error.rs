//! Errors of this crate: location, fact, remedy.

use thiserror::Error;

/// An error of this crate. The message has the fact, and the remedy after `help:`.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum WorldError {
    /// A number is outside its valid range.
    #[error("`{what}` is {value}\n  help: {help}")]
    Number {
        /// The number, with its unit.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Requirement.
        help: &'static str,
    },
    /// A line of a file cannot be read.
    #[error("{file}:{line}: {fact}\n  help: {help}")]
    Line {
        /// Name of the file, as the caller gave it.
        file: String,
        /// Line, from 1; 0 for the whole file.
        line: usize,
        /// Actual content.
        fact: String,
        /// Expected content.
        help: &'static str,
    },
    /// A text is not a valid epoch.
    #[error(
        "`{text}` is not an epoch: {fact}\n  help: write `2012-08-06 05:17:57 UTC` (or TAI, TT, TDB, GPST)"
    )]
    Epoch {
        /// The text.
        text: String,
        /// Fault.
        fact: String,
    },
    /// A position is so close to the centre of an ellipsoid that its latitude is undefined.
    #[error(
        "a point {radius:.3} m from the centre of the ellipsoid has no geodetic latitude\n  help: stay at \
         least {limit:.3} m away, where normals of the ellipsoid do not cross"
    )]
    NearCentre {
        /// Distance from the centre, m.
        radius: f64,
        /// Minimum distance, m.
        limit: f64,
    },
    /// Position and velocity do not span an orbital plane.
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
    /// A degree or order exceeds those of a set of coefficients.
    #[error("{what} {asked} is more than {max}\n  help: {help}")]
    Degree {
        /// Degree or order.
        what: &'static str,
        /// Requested value.
        asked: usize,
        /// Available value.
        max: usize,
        /// Remedy.
        help: &'static str,
    },
    /// An ephemeris does not cover a body or a time.
    #[error("{fact}\n  help: {help}")]
    Uncovered {
        /// The body, the time, and what is available.
        fact: String,
        /// Remedy.
        help: &'static str,
    },
    /// Invalid tables of a climate.
    #[error("{fact}\n  help: {help}")]
    Climate {
        /// Fault.
        fact: String,
        /// Remedy.
        help: &'static str,
    },
    /// A mesh is not a closed surface.
    #[error("{place}: {fact}\n  help: {help}")]
    Mesh {
        /// Vertex, face, edge, or line of the file.
        place: String,
        /// Fault.
        fact: String,
        /// Remedy.
        help: &'static str,
    },
}

/// Returns an error for NaN, infinity, and values for which `good` is false.
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

/// Returns a text without the byte order mark that some editors and spreadsheet programs write.
pub(crate) fn plain(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}
