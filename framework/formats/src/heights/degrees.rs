//! Spacings that a file specifies in degrees.
//! ```text
//! Δx = N cos φ Δλ,  Δy = M Δφ       N = a/√(1 − e² sin² φ),  M = a (1 − e²)/(1 − e² sin² φ)^{3/2}       φ: the middle of the map
//! ```
//! The real distance between nodes is smaller at the edge nearer to the pole: a map with a difference of more than 1 % is rejected.

use super::HeightsError;

/// An ellipsoid of revolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ellipsoid {
    /// Semi-major axis a (m).
    pub major: f64,
    /// f = (a − b)/a
    pub flattening: f64,
}

impl Ellipsoid {
    /// Returns the ellipsoid with an EPSG code.
    pub(super) fn epsg(code: u16) -> Option<Ellipsoid> {
        let (major, inverse) = match code {
            7030 => (6_378_137.0, 298.257_223_563),
            7019 => (6_378_137.0, 298.257_222_101),
            7043 => (6_378_135.0, 298.26),
            7008 => (6_378_206.4, 294.978_698_213_898),
            7022 => (6_378_388.0, 297.0),
            7004 => (6_377_397.155, 299.152_812_8),
            _ => return None,
        };
        Some(Ellipsoid { major, flattening: 1.0 / inverse })
    }

    /// Returns the ellipsoid of a geographic system with an EPSG code: WGS 84, ETRS89, NAD83, WGS 72, NAD27, ED50.
    pub(super) fn of_system(code: u16) -> Option<Ellipsoid> {
        Ellipsoid::epsg(match code {
            4326 | 4979 => 7030,
            4258 | 4269 | 6318 => 7019,
            4322 => 7043,
            4267 => 7008,
            4230 => 7022,
            _ => return None,
        })
    }

    /// Returns the first eccentricity e.
    pub(super) fn eccentricity(self) -> f64 {
        (self.flattening * (2.0 - self.flattening)).sqrt()
    }

    /// Returns the length of a degree of longitude and of latitude at a latitude (degrees), in metres.
    pub(super) fn of_a_degree(self, latitude: f64) -> [f64; 2] {
        let (sin, cos) = latitude.to_radians().sin_cos();
        let e2 = self.flattening * (2.0 - self.flattening);
        let root = (1.0 - e2 * sin * sin).sqrt();
        let across = self.major / root;
        let along = self.major * (1.0 - e2) / (root * root * root);
        [across * cos, along].map(|r| r * 1.0_f64.to_radians())
    }
}

/// Maximum relative difference between distances at the edges of a map and in its middle.
pub(super) const DISTORTION: f64 = 0.01;

/// Returns the spacing (m) of nodes that are `spacing` degrees apart; `south`: latitude of the southern row, of `ny` rows.
pub(super) fn degrees_apart(
    ellipsoid: Option<Ellipsoid>,
    spacing: [f64; 2],
    south: f64,
    ny: usize,
) -> Result<[f64; 2], HeightsError> {
    let [x, y] = spacing;
    let north = south + (ny as f64 - 1.0) * y;
    let Some(ellipsoid) = ellipsoid.filter(|_| south >= -90.0 && north <= 90.0) else {
        return Err(HeightsError::Degrees { x, y });
    };
    let middle = ellipsoid.of_a_degree(0.5 * (south + north));
    let differs = |at: f64| (ellipsoid.of_a_degree(at)[0] / middle[0] - 1.0).abs();
    let most = differs(south).max(differs(north));
    if !(most <= DISTORTION) {
        return Err(HeightsError::content(
            format!(
                "its nodes are degrees apart, from {south:.4} to {north:.4} degrees of latitude, and their distance along x changes by {:.1} % from the middle to an edge",
                100.0 * most
            ),
            "cut out a smaller map (`gdal_translate -projwin`), or project it to metres (`gdalwarp -t_srs`)",
        ));
    }
    Ok([x * middle[0], y * middle[1]])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lengths of a degree on WGS 84, as published (NIMA TR8350.2 and its tables): 111 319.491 m of longitude and 110 574.276 m of latitude
    /// at the equator; 78 846.8 and 111 131.7 m at 45 degrees.
    #[test]
    fn a_degree_has_the_published_length() {
        let earth = Ellipsoid::epsg(7030).unwrap();
        let [x, y] = earth.of_a_degree(0.0);
        assert!((x - 111_319.491).abs() < 1e-3 && (y - 110_574.276).abs() < 1e-3, "{x} {y}");
        let [x, y] = earth.of_a_degree(45.0);
        assert!((x - 78_846.8).abs() < 0.1 && (y - 111_131.7).abs() < 0.1, "{x} {y}");
    }

    #[test]
    fn a_map_too_tall_for_one_distance_is_refused() {
        let earth = Ellipsoid::epsg(7030);
        assert!(degrees_apart(earth, [0.01, 0.01], 45.0, 101).is_ok());
        let refused = degrees_apart(earth, [0.01, 0.01], 45.0, 301).unwrap_err().to_string();
        assert!(refused.contains("from 45.0000 to 48.0000 degrees"), "{refused}");
        assert!(matches!(
            degrees_apart(None, [0.01, 0.01], 45.0, 101),
            Err(HeightsError::Degrees { .. })
        ));
        assert!(degrees_apart(earth, [0.01, 0.01], 4500.0, 101).is_err());
    }
}
