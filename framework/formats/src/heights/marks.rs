//! Heights that are probably marks of missing data which the file does not declare.
//!
//! Many programs write −9999 or −32768 for missing data, and not every file declares this value. Read as heights they are holes of kilometres, in
//! which vehicles fall and shadows begin.

use super::HeightsError;

/// Usual marks (m) of missing data.
const USUAL: [f64; 4] = [-9999.0, -32_768.0, -32_767.0, -99_999.0];

/// Distance (m) between a mark and the lowest other height beyond which it is not a height. The relief of Mars and of the ocean is 30 and 20 km, but
/// neighbouring nodes are not that far apart.
const GAP: f64 = 4000.0;

/// Largest difference (m) between two heights of a map: no body has a relief of 100 km.
const RELIEF: f64 = 1e5;

/// Checks heights above `datum` (m).
///
/// # Errors
/// A usual mark far below all other heights, or heights that are more than 100 km apart.
pub(super) fn check(heights: &[f32], datum: f64) -> Result<(), HeightsError> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut counts = [0_usize; USUAL.len()];
    for height in heights.iter().filter(|h| !h.is_nan()) {
        let height = f64::from(*height) + datum;
        match USUAL.iter().position(|mark| *mark == height) {
            Some(k) => counts[k] += 1,
            None => (low, high) = (low.min(height), high.max(height)),
        }
    }
    let suspect = |(mark, count): (f64, usize)| count > 0 && low.is_finite() && mark + GAP < low;
    if let Some((mark, count)) = USUAL.into_iter().zip(counts).find(|pair| suspect(*pair)) {
        return Err(HeightsError::content(
            format!(
                "the height {mark} m, a usual mark of missing data, occurs {count} times, and the lowest other height is {low:.1} m"
            ),
            format!(
                "declare the mark in the file (`gdal_translate -a_nodata {mark}`, `nodata_value` of an ASCII grid), leave the points out of a list, or fill the nodes"
            ),
        ));
    }
    if high - low > RELIEF {
        return Err(HeightsError::content(
            format!("its heights are between {low:.6e} and {high:.6e} m, more than 100 km apart"),
            "declare the value of missing data in the file (`gdal_translate -a_nodata`), or the unit of its heights",
        ));
    }
    Ok(())
}
