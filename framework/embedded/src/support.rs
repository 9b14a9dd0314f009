//! The support polygon: the region above which the centre of mass must be for a robot to stand on level ground.
//!
//! ```text
//! hull of the contact points in the plane, counter-clockwise (Andrew's monotone chain, 1979)
//! margin = min over edges of the distance to the inside, negative outside
//! ```

/// Writes the corners (x, y, m) of the convex hull of `points` into `hull`, counter-clockwise, and returns their number: two for points on a line,
/// one for coincident points, zero for none. `hull` needs room for one more than the number of points. Points with NaN or infinity are ignored.
///
/// # Panics
/// If `hull` is too short.
pub fn support_polygon(points: &mut [[f64; 2]], hull: &mut [[f64; 2]]) -> usize {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let good = || points.iter().filter(|p| p[0].is_finite() && p[1].is_finite());
    let mut n = 0;
    let turn = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    for p in good() {
        while n >= 2 && turn(hull[n - 2], hull[n - 1], *p) <= 0.0 {
            n -= 1;
        }
        if n == 0 || hull[n - 1] != *p {
            hull[n] = *p;
            n += 1;
        }
    }
    // Continue along the upper side, from right to left.
    let low = n;
    for p in good().rev().skip(1) {
        while n > low && turn(hull[n - 2], hull[n - 1], *p) <= 0.0 {
            n -= 1;
        }
        if n > 0 && hull[n - 1] != *p {
            hull[n] = *p;
            n += 1;
        }
    }
    // The last corner equals the first.
    if n > 1 && hull[0] == hull[n - 1] { n - 1 } else { n }
}

/// Returns the distance of a point (x, y, m) from the nearest edge of a polygon with counter-clockwise corners, m; negative outside. For a line or a
/// point the result is the negative distance; for an empty polygon it is minus infinity.
#[must_use]
pub fn support_margin(hull: &[[f64; 2]], p: [f64; 2]) -> f64 {
    let mut inside = hull.len() >= 3;
    let mut nearest = f64::INFINITY;
    for (i, a) in hull.iter().enumerate() {
        let b = hull[(i + 1) % hull.len()];
        let (d, r) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
        let square = d[0] * d[0] + d[1] * d[1];
        let s =
            if square > 0.0 { ((r[0] * d[0] + r[1] * d[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
        nearest = nearest.min((r[0] - s * d[0]).hypot(r[1] - s * d[1]));
        inside &= d[0] * r[1] - d[1] * r[0] >= 0.0;
    }
    if inside { nearest } else { -nearest }
}
