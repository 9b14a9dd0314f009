//! The datum above which the heights of a file are given.
//!
//! Heights are kept in 32 bits: at the radius of the Moon they would be 12.5 cm apart. Heights far from zero are therefore given above a whole
//! number of metres.

/// Heights (m) below which the datum is zero; 32 bits have steps of 2 mm there.
pub(super) const LEAST: f64 = 16_384.0;

/// The datum (m) of a map that has a height of `first` (m).
pub(super) fn of(first: f64) -> f64 {
    if first.abs() < LEAST || !first.is_finite() { 0.0 } else { first.round() }
}
