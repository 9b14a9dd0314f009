//! Ellipsoids of revolution: conversion of geodetic coordinates, the vertical, east-north-up.
//!
//! There are three different latitudes: *geodetic latitude*, the angle between the normal of the ellipsoid and the equator (maps, GPS); *geocentric
//! latitude*, the angle of the line to the centre; and *parametric latitude* β, on the auxiliary circle. On the Earth the first two differ by up to
//! 0.19°.
//! ```text
//! p = (N + h) cos φ …, N = a/√(1 − e² sin²φ),   z = (N(1 − e²) + h) sin φ
//! back: ρ̂ sin β − ẑ cos β − e² sin β cos β = 0,  ρ̂ = ρ/a, ẑ = (b/a) z/a;   tan φ = tan β /√(1 − e²)
//! ```
//! The equation in β is Bowring's (*Survey Review* 28 (1985)) in sines and cosines, so that poles are not a special case. It is solved with Newton's
//! method from Bowring's first estimate.

use crate::error::{WorldError, number};
use linkwork_spatial::{Quat, Vec3, nalgebra};

/// Position on or near an ellipsoid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Geodetic {
    /// Geodetic latitude φ, north positive, rad.
    pub latitude: f64,
    /// East longitude λ, rad.
    pub longitude: f64,
    /// Height above the ellipsoid along its normal, m.
    pub altitude: f64,
}

/// An oblate ellipsoid of revolution about z, or a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    a: f64,
    f: f64,
}

impl Ellipsoid {
    /// Creates an ellipsoid from the equatorial radius (m) and the flattening f = (a − b)/a.
    ///
    /// # Errors
    /// The radius is not above zero, or the flattening is outside 0 … 0.5.
    pub fn new(radius: f64, flattening: f64) -> Result<Self, WorldError> {
        number("equatorial radius, m", radius, |x| x > 0.0, "a radius above 0")?;
        let help = "(a − b)/a of an oblate body, 0 for a sphere; at most 0.5";
        number("flattening", flattening, |x| (0.0..=0.5).contains(&x), help)?;
        Ok(Self { a: radius, f: flattening })
    }

    /// Returns the Earth's ellipsoid: WGS 84, a 6378137 m, 1/f 298.257223563.
    #[must_use]
    pub fn wgs84() -> Self {
        Self { a: 6_378_137.0, f: 1.0 / 298.257_223_563 }
    }

    /// Returns the ellipsoid of Mars: radii 3396190 and 3376200 m (IAU Working Group on Cartographic Coordinates).
    #[must_use]
    pub fn mars() -> Self {
        Self { a: 3_396_190.0, f: (3_396_190.0 - 3_376_200.0) / 3_396_190.0 }
    }

    /// Returns the Moon as a sphere of 1737400 m (same source as Mars).
    #[must_use]
    pub fn moon() -> Self {
        Self { a: 1_737_400.0, f: 0.0 }
    }

    /// Returns a, m.
    #[must_use]
    pub fn equatorial_radius(&self) -> f64 {
        self.a
    }

    /// Returns b, m.
    #[must_use]
    pub fn polar_radius(&self) -> f64 {
        self.a * (1.0 - self.f)
    }

    /// Returns f = (a − b)/a.
    #[must_use]
    pub fn flattening(&self) -> f64 {
        self.f
    }

    /// Returns e² = f(2 − f).
    #[must_use]
    pub fn eccentricity_squared(&self) -> f64 {
        self.f * (2.0 - self.f)
    }

    /// Returns the position from the centre in the planet's axes, m.
    #[must_use]
    pub fn position(&self, place: &Geodetic) -> Vec3 {
        let e2 = self.eccentricity_squared();
        let (sin, cos) = place.latitude.sin_cos();
        let n = self.a / (1.0 - e2 * sin * sin).sqrt();
        let rho = (n + place.altitude) * cos;
        let (sl, cl) = place.longitude.sin_cos();
        Vec3::new(rho * cl, rho * sl, (n * (1.0 - e2) + place.altitude) * sin)
    }

    /// Returns the geodetic coordinates of a position (m, planet's axes). Accurate to a few nanometres up to thousands of radii away. On the axis the
    /// longitude is 0.
    ///
    /// # Errors
    /// The position is closer to the centre than (a² − b²)/b, where normals of the ellipsoid cross (42.8 km on the Earth), or contains NaN or
    /// infinity.
    pub fn geodetic(&self, p: &Vec3) -> Result<Geodetic, WorldError> {
        for x in p.iter() {
            number("a coordinate, m", *x, |_| true, "positions are finite")?;
        }
        let (a, b, e2) = (self.a, self.polar_radius(), self.eccentricity_squared());
        let rho = p.x.hypot(p.y);
        let radius = rho.hypot(p.z);
        let limit = (a * a - b * b) / b + 1e-9 * a;
        if radius < limit {
            return Err(WorldError::NearCentre { radius, limit });
        }
        let k = 1.0 - self.f;
        let (u, w) = (rho / a, k * p.z / a);
        // The start is Bowring's first estimate; on the surface its error is 1e-9 rad.
        let mut beta = (p.z * (b + e2 * a * a / radius)).atan2(rho * a);
        for _ in 0..8 {
            let (s, c) = beta.sin_cos();
            let step = (u * s - w * c - e2 * s * c) / (u * c + w * s - e2 * (c * c - s * s));
            beta -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        let (s, c) = beta.sin_cos();
        let latitude = s.atan2(k * c);
        let (sin, cos) = latitude.sin_cos();
        let altitude = (rho - a * c) * cos + (p.z - b * s) * sin;
        Ok(Geodetic { latitude, longitude: p.y.atan2(p.x), altitude })
    }

    /// Returns the radii of curvature at a geodetic latitude, m: M of the meridian, and N of the prime vertical.
    #[must_use]
    pub fn curvature_radii(&self, latitude: f64) -> (f64, f64) {
        let e2 = self.eccentricity_squared();
        let k = 1.0 - e2 * latitude.sin().powi(2);
        let n = self.a / k.sqrt();
        (n * (1.0 - e2) / k, n)
    }

    /// Returns the geocentric latitude of the surface point with this geodetic latitude, rad.
    #[must_use]
    pub fn geocentric_from_geodetic(&self, latitude: f64) -> f64 {
        let (sin, cos) = latitude.sin_cos();
        ((1.0 - self.eccentricity_squared()) * sin).atan2(cos)
    }

    /// Returns the geodetic latitude of the surface point with this geocentric latitude, rad.
    #[must_use]
    pub fn geodetic_from_geocentric(&self, latitude: f64) -> f64 {
        let (sin, cos) = latitude.sin_cos();
        sin.atan2((1.0 - self.eccentricity_squared()) * cos)
    }
}

impl Geodetic {
    /// Creates coordinates from degrees and metres.
    #[must_use]
    pub fn from_degrees(latitude_deg: f64, longitude_deg: f64, altitude: f64) -> Self {
        let (latitude, longitude) = (latitude_deg.to_radians(), longitude_deg.to_radians());
        Self { latitude, longitude, altitude }
    }

    /// Returns the local vertical: outward normal of the ellipsoid, planet's axes.
    #[must_use]
    pub fn up(&self) -> Vec3 {
        let ((s, c), (sl, cl)) = (self.latitude.sin_cos(), self.longitude.sin_cos());
        Vec3::new(c * cl, c * sl, s)
    }

    /// Returns `R_PE`, from x east, y north, z up to the planet's axes. At a pole the longitude determines it.
    #[must_use]
    pub fn east_north_up(&self) -> Quat {
        // Rotate about z by λ + 90°, then about x by 90° − φ.
        let quarter = std::f64::consts::FRAC_PI_2;
        let z = Quat::from_axis_angle(&nalgebra::Vector3::z_axis(), self.longitude + quarter);
        z * Quat::from_axis_angle(&nalgebra::Vector3::x_axis(), quarter - self.latitude)
    }
}

/// Returns the geocentric latitude of a position: the angle between the line to the centre and the equator, rad.
#[must_use]
pub fn geocentric_latitude(p: &Vec3) -> f64 {
    p.z.atan2(p.x.hypot(p.y))
}
