//! The largest of several numbers, in which NaN is the largest.

/// Updates a maximum, and keeps NaN.
#[inline(always)]
pub(crate) fn larger(most: &mut f64, x: f64) {
    if !(x.abs() <= *most) && !most.is_nan() {
        *most = x.abs();
    }
}
