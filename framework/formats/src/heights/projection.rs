//! Maps in metres whose projection stretches distances: Mercator and equidistant cylindrical projections.
//! ```text
//! Mercator       x = A λ,  y = A (artanh(sin φ) − e artanh(e sin φ)),  A = N(φ₁) cos φ₁        Web Mercator: e = 0 with latitudes of WGS 84
//! cylindrical    x = R cos φ₁ λ,  y = R (φ − φ₀)
//! distances      N cos φ Δλ along x,  M Δφ along y        φ: the middle of the map
//! ```
//! A map whose scale changes by more than 1 % from its middle to an edge is rejected. The projections of surveys (transverse Mercator, Lambert,
//! polar stereographic) are used near their lines of true scale, and their distances are not changed.

use super::HeightsError;
use super::degrees::{DISTORTION, Ellipsoid};
use std::f64::consts::FRAC_PI_2;

/// A projection with a scale that depends on the latitude; angles in rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Projection {
    /// Mercator.
    Mercator {
        /// The body.
        body: Ellipsoid,
        /// The ellipsoid of the equations: a sphere for Web Mercator.
        drawn: Ellipsoid,
        /// Latitude of true scale φ₁.
        parallel: f64,
    },
    /// Equidistant cylindrical: equirectangular, simple cylindrical, plate carrée.
    Cylindrical {
        /// Radius R (m).
        radius: f64,
        /// Latitude of true scale φ₁.
        parallel: f64,
        /// Latitude of y = 0, φ₀.
        origin: f64,
    },
}

/// Relative difference of scales below which a map is used as it is.
const SAME: f64 = 1e-4;

impl Projection {
    /// Returns Web Mercator, EPSG 3857.
    pub(super) fn web() -> Option<Projection> {
        let body = Ellipsoid::epsg(7030)?;
        let drawn = Ellipsoid { flattening: 0.0, ..body };
        Some(Projection::Mercator { body, drawn, parallel: 0.0 })
    }

    /// Returns the projection of a projected system with an EPSG code, if it is one of these.
    pub(super) fn epsg(code: u16) -> Option<Projection> {
        let earth = Ellipsoid::epsg(7030)?;
        match code {
            3857 | 3785 => Projection::web(),
            3395 => Some(Projection::Mercator { body: earth, drawn: earth, parallel: 0.0 }),
            4087 | 4088 | 32662 => {
                Some(Projection::Cylindrical { radius: earth.major, parallel: 0.0, origin: 0.0 })
            }
            _ => None,
        }
    }

    /// Returns the latitude (rad) of a coordinate y (m).
    fn latitude(&self, y: f64) -> f64 {
        match *self {
            Projection::Cylindrical { radius, origin, .. } => origin + y / radius,
            Projection::Mercator { drawn, parallel, .. } => {
                let e = drawn.eccentricity();
                let psi = y / across(drawn, parallel);
                // The iteration contracts by a factor of e² in each pass.
                (0..12).fold(psi.tanh().asin(), |phi, _| {
                    (psi + e * (e * phi.sin()).atanh()).tanh().asin()
                })
            }
        }
    }

    /// Returns true distances per distance on the map, along x and y.
    fn scale(&self, latitude: f64) -> [f64; 2] {
        match *self {
            Projection::Cylindrical { parallel, .. } => [latitude.cos() / parallel.cos(), 1.0],
            Projection::Mercator { body, drawn, parallel } => {
                let size = across(drawn, parallel);
                let e2 = drawn.eccentricity().powi(2);
                let up = (1.0 - e2) / (1.0 - e2 * latitude.sin().powi(2)) / latitude.cos();
                [across(body, latitude) / size, along(body, latitude) / (size * up)]
            }
        }
    }

    /// Returns true spacings (m), and the position of the south-west node, of a map with these spacings, this node and the false northing (m). A map
    /// whose distances change is no longer in its coordinates: its south-west node is the origin.
    pub(super) fn apart(
        &self,
        spacing: [f64; 2],
        origin: [f64; 2],
        northing: f64,
        ny: usize,
    ) -> Result<([f64; 2], [f64; 2]), HeightsError> {
        let height = (ny as f64 - 1.0) * spacing[1];
        let [south, middle, north] =
            [0.0, 0.5, 1.0].map(|part| self.latitude(origin[1] - northing + part * height));
        if !(south >= -FRAC_PI_2 && north <= FRAC_PI_2) {
            let fact = format!(
                "its projection has no latitude for y from {:.0} to {:.0} m",
                origin[1],
                origin[1] + height
            );
            return Err(HeightsError::content(fact, "correct its coordinates, or write `spacing`"));
        }
        let scale = self.scale(middle);
        let change =
            |a: [f64; 2], b: [f64; 2]| (a[0] / b[0] - 1.0).abs().max((a[1] / b[1] - 1.0).abs());
        let edges = [self.scale(south), self.scale(north)];
        if edges.iter().chain([&scale]).all(|k| change(*k, [1.0; 2]) <= SAME) {
            return Ok((spacing, origin));
        }
        let most = edges.iter().map(|k| change(*k, scale)).fold(0.0, f64::max);
        if !(most <= DISTORTION) {
            return Err(HeightsError::content(
                format!(
                    "its projection stretches distances, from {:.4} to {:.4} degrees of latitude, by {:.1} % more at an edge than in the middle",
                    south.to_degrees(),
                    north.to_degrees(),
                    100.0 * most
                ),
                "cut out a smaller map (`gdal_translate -projwin`), or project it to a local system (`gdalwarp -t_srs`), for example UTM",
            ));
        }
        Ok(([spacing[0] * scale[0], spacing[1] * scale[1]], [0.0, 0.0]))
    }
}

/// Returns N cos φ (m).
fn across(body: Ellipsoid, latitude: f64) -> f64 {
    body.of_a_degree(latitude.to_degrees())[0].to_degrees()
}

/// Returns M (m).
fn along(body: Ellipsoid, latitude: f64) -> f64 {
    body.of_a_degree(latitude.to_degrees())[1].to_degrees()
}

/// Returns the projection of well-known text in capitals, if it is one of these, with its false northing in the unit of the text.
pub(super) fn of_text(projected: &str, ellipsoid: Option<Ellipsoid>) -> Option<(Projection, f64)> {
    let named = |names: &[&str]| {
        names.iter().any(|n| {
            ["PROJECTION", "METHOD"]
                .iter()
                .any(|node| projected.contains(&format!("{node}[\"{n}\"")))
        })
    };
    let parameter = |name: &str| -> f64 {
        let after = projected.split_once(&format!("PARAMETER[\"{name}\","));
        let number = after.and_then(|(_, rest)| rest.split([',', ']']).next());
        number.and_then(|n| n.trim().parse::<f64>().ok()).unwrap_or(0.0)
    };
    let degrees = |name: &str| parameter(name).to_radians();
    let northing = parameter("FALSE_NORTHING") + parameter("FALSE NORTHING");
    if named(&["MERCATOR_AUXILIARY_SPHERE", "POPULAR VISUALISATION PSEUDO MERCATOR"]) {
        return Projection::web().map(|p| (p, northing));
    }
    let body = ellipsoid?;
    if named(&[
        "EQUIRECTANGULAR",
        "EQUIDISTANT_CYLINDRICAL",
        "PLATE_CARREE",
        "EQUIDISTANT CYLINDRICAL",
        "SIMPLECYLINDRICAL",
    ]) {
        let parallel =
            degrees("STANDARD_PARALLEL_1") + degrees("LATITUDE OF 1ST STANDARD PARALLEL");
        let origin = degrees("LATITUDE_OF_ORIGIN");
        return Some((Projection::Cylindrical { radius: body.major, parallel, origin }, northing));
    }
    let parallel = degrees("STANDARD_PARALLEL_1");
    let mercator = Projection::Mercator { body, drawn: body, parallel };
    named(&["MERCATOR_2SP", "MERCATOR"]).then_some((mercator, northing))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// True distances of points that are 20 m apart on the map, from positions of GDAL 3.11 (PROJ) on WGS 84.
    #[test]
    fn mercator_maps_have_the_distances_of_the_ellipsoid() {
        let far = |code: u16, y: f64| {
            let map = Projection::epsg(code).unwrap();
            map.apart([20.0, 20.0], [0.0, y], 0.0, 11).unwrap().0
        };
        for (code, y, want) in REFERENCE {
            let found = far(code, y);
            for k in 0..2 {
                assert!((found[k] / want[k] - 1.0).abs() < 1e-6, "{code} {y}: {found:?} {want:?}");
            }
        }
    }

    const REFERENCE: [(u16, f64, [f64; 2]); 3] = [
        (3857, 6e6, [13.573_858_327_1, 13.532_002_111_5]),
        (3857, -100.0, [19.999_999_918_1, 19.866_112_239_1]),
        (3395, 6e6, [13.524_648_581_8, 13.524_648_616_6]),
    ];

    #[test]
    fn cylindrical_maps_of_the_moon_have_narrower_columns_away_from_their_parallel() {
        let moon = |parallel: f64, origin: f64| Projection::Cylindrical {
            radius: 1_737_400.0,
            parallel: parallel.to_radians(),
            origin: origin.to_radians(),
        };
        let at = |latitude: f64| 1_737_400.0 * f64::to_radians(latitude) - 500.0;
        let (spacing, origin) =
            moon(0.0, 0.0).apart([100.0, 100.0], [7e5, at(60.0)], 0.0, 11).unwrap();
        assert!((spacing[0] - 50.0).abs() < 1e-9 && spacing[1] == 100.0, "{spacing:?}");
        assert_eq!(origin, [0.0; 2]);
        let (spacing, _) =
            moon(60.0, 45.0).apart([100.0, 100.0], [7e5, at(-15.0)], 0.0, 11).unwrap();
        assert!((spacing[0] - 200.0 * 30.0_f64.to_radians().cos()).abs() < 1e-9, "{spacing:?}");
        // At its parallel a map stays in its coordinates.
        let same = moon(0.0, 0.0).apart([100.0, 100.0], [7e5, -500.0], 0.0, 11).unwrap();
        assert_eq!(same, ([100.0, 100.0], [7e5, -500.0]));
        let tall = moon(0.0, 0.0).apart([100.0, 100.0], [0.0, at(60.0)], 0.0, 500).unwrap_err();
        assert!(tall.to_string().contains("degrees of latitude"), "{tall}");
        assert!(moon(0.0, 0.0).apart([100.0, 100.0], [0.0, 3e6], 0.0, 11).is_err());
    }

    #[test]
    fn well_known_text_names_the_projection() {
        let earth = Ellipsoid::epsg(7030);
        let web = r#""WGS_1984_WEB_MERCATOR",GEOGCS["G"],PROJECTION["MERCATOR_AUXILIARY_SPHERE"],UNIT["METER",1.0]"#;
        assert_eq!(of_text(web, None).unwrap().0, Projection::web().unwrap());
        let moon = Ellipsoid { major: 1_737_400.0, flattening: 0.0 };
        let text = r#"PROJECTION["EQUIRECTANGULAR"],PARAMETER["FALSE_NORTHING",5e3],PARAMETER["STANDARD_PARALLEL_1",60]"#;
        let want = Projection::Cylindrical {
            radius: 1_737_400.0,
            parallel: 60.0_f64.to_radians(),
            origin: 0.0,
        };
        assert_eq!(of_text(text, Some(moon)), Some((want, 5e3)));
        assert_eq!(of_text(r#"PROJECTION["TRANSVERSE_MERCATOR"]"#, earth), None);
    }
}
