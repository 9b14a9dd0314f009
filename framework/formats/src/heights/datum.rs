//! The datum above which the heights of a file are given.
//!
//! Heights are stored in 32 bits: at the radius of the Moon their resolution would be 12.5 cm. Therefore large heights are relative to a datum, a
//! whole number of metres.

/// Heights (m) below which the datum is zero; the resolution of 32 bits is 2 mm there.
pub(super) const LEAST: f64 = 16_384.0;

/// Returns the datum (m) of a map whose first height is `first` (m).
pub(super) fn of(first: f64) -> f64 {
    if first.abs() < LEAST || !first.is_finite() { 0.0 } else { first.round() }
}
