//! Sun and Moon by short series: Montenbruck & Gill, *Satellite Orbits*, section 3.3.2.

use linkwork_spatial::Vec3;
use std::f64::consts::TAU;

/// Obliquity of the ecliptic of J2000.
const OBLIQUITY_DEG: f64 = 23.43929111;
const ARCSEC: f64 = TAU / 1_296_000.0;

/// Converts ecliptic longitude and latitude (rad) and distance (m) to the equator of J2000.
fn equatorial(longitude: f64, latitude: f64, distance: f64) -> Vec3 {
    let ((sb, cb), (sl, cl)) = (latitude.sin_cos(), longitude.sin_cos());
    let (se, ce) = OBLIQUITY_DEG.to_radians().sin_cos();
    let (x, y, z) = (cb * cl, cb * sl, sb);
    Vec3::new(x, ce * y - se * z, se * y + ce * z) * distance
}

/// Returns the position of the Sun from the Earth, m. The error is 9–20″ from 2000 to 2025, and 2e-5 of the distance. In addition to the book's
/// 282.94°, the formula includes the motion of the perihelion, 0.3225° per century, without which the error is 130–310″.
/// ```text
/// M = 357.5256° + 35999.049° T
/// λ = 282.94° + 0.3225° T + M + 6892″ sin M + 72″ sin 2M
/// r = (149.619 − 2.499 cos M − 0.021 cos 2M) 10⁹ m
/// ```
#[must_use]
pub fn sun_low(tdb: (f64, f64)) -> Vec3 {
    let T = (tdb.0 + tdb.1) / 36525.0;
    let M = ((357.5256 + 35999.049 * T) % 360.0).to_radians();
    let perihelion = (282.94 + 0.3225 * T).to_radians();
    let longitude = perihelion + M + ARCSEC * (6892.0 * M.sin() + 72.0 * (2.0 * M).sin());
    let r = (149.619 - 2.499 * M.cos() - 0.021 * (2.0 * M).cos()) * 1e9;
    equatorial(longitude, 0.0, r)
}

/// Multipliers of l, l', F, D and amplitude, ″: longitude.
const LONGITUDE: [([i8; 4], f64); 14] = [
    ([1, 0, 0, 0], 22640.0),
    ([2, 0, 0, 0], 769.0),
    ([1, 0, 0, -2], -4586.0),
    ([0, 0, 0, 2], 2370.0),
    ([0, 1, 0, 0], -668.0),
    ([0, 0, 2, 0], -412.0),
    ([2, 0, 0, -2], -212.0),
    ([1, 1, 0, -2], -206.0),
    ([1, 0, 0, 2], 192.0),
    ([0, 1, 0, -2], -165.0),
    ([0, 0, 0, 1], -125.0),
    ([1, 1, 0, 0], -110.0),
    ([1, -1, 0, 0], 148.0),
    ([0, 0, 2, -2], -55.0),
];

/// Latitude, without its first term.
const LATITUDE: [([i8; 4], f64); 7] = [
    ([0, 0, 1, -2], -526.0),
    ([1, 0, 1, -2], 44.0),
    ([-1, 0, 1, -2], -31.0),
    ([-2, 0, 1, 0], -25.0),
    ([0, 1, 1, -2], -23.0),
    ([-1, 0, 1, 0], 21.0),
    ([0, -1, 1, -2], 11.0),
];

/// Distance, km, cosine terms.
const DISTANCE: [([i8; 4], f64); 9] = [
    ([0, 0, 0, 0], 385_000.0),
    ([1, 0, 0, 0], -20_905.0),
    ([-1, 0, 0, 2], -3_699.0),
    ([0, 0, 0, 2], -2_956.0),
    ([2, 0, 0, 0], -570.0),
    ([2, 0, 0, -2], 246.0),
    ([0, 1, 0, -2], -205.0),
    ([1, 0, 0, 2], -171.0),
    ([1, 1, 0, -2], -152.0),
];

/// Returns the position of the Moon from the Earth, m; the error is 15–75″ and 130 km.
#[must_use]
pub fn moon_low(tdb: (f64, f64)) -> Vec3 {
    let T = (tdb.0 + tdb.1) / 36525.0;
    let angle = |a: f64, rate: f64| ((a + rate * T) % 360.0).to_radians();
    // Subtract the general precession, 1.3972° per century, to refer to the equinox of J2000.
    let L0 = angle(218.31617, 481267.88088 - 1.3972);
    let l = angle(134.96292, 477198.86753);
    let lp = angle(357.52543, 35999.04944);
    let F = angle(93.27283, 483202.01873);
    let D = angle(297.85027, 445267.11135);
    let arg = |k: &[i8; 4]| {
        f64::from(k[0]) * l + f64::from(k[1]) * lp + f64::from(k[2]) * F + f64::from(k[3]) * D
    };
    let sines = |table: &[([i8; 4], f64)]| -> f64 {
        table.iter().map(|(k, a)| a * arg(k).sin()).sum::<f64>() * ARCSEC
    };
    let dlongitude = sines(&LONGITUDE);
    let first = F + dlongitude + ARCSEC * (412.0 * (2.0 * F).sin() + 541.0 * lp.sin());
    let latitude = ARCSEC * 18_520.0 * first.sin() + sines(&LATITUDE);
    let km: f64 = DISTANCE.iter().map(|(k, a)| a * arg(k).cos()).sum();
    equatorial(L0 + dlongitude, latitude, km * 1000.0)
}
