//! Modes of a thin rectangular plate clamped along one edge (Kirchhoff), computed with the Ritz method.
//!
//! ```text
//! w(x, y) = Σ c_mn (x/a)² P_m(2x/a − 1) P_n(2y/b)          P: Legendre polynomials
//! U = ½ D ∫∫ w_xx² + w_yy² + 2 ν w_xx w_yy + 2 (1 − ν) w_xy²,   D = E h³ / 12 (1 − ν²)
//! T = ½ ρ h ∫∫ ẇ²
//! ```
//! Eight by eight terms. Rotary inertia, shear and shortening are not modelled: the plane of the plate keeps its length, so a fast spin does not
//! stiffen it.

use super::eigen::{gauss, lowest};
use super::validate::GeneratorFault;
use super::{Attachment, Modes, Station};
use linkwork_spatial::nalgebra::{DMatrix, DVector};
use linkwork_spatial::{MassProperties, Mat3, Pose, Vec3};
use serde::{Deserialize, Serialize};

/// Number of terms of the Ritz series in each direction.
const TERMS: usize = 8;

/// A thin rectangular plate in the body's x–y plane, clamped to the body frame along x = 0 and free at x = `length` and y = ±`width`/2.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plate {
    /// a, along x, m.
    pub length: f64,
    /// b, along y, m.
    pub width: f64,
    /// h, m.
    pub thickness: f64,
    /// Young's modulus E, Pa.
    pub young: f64,
    /// Poisson's ratio ν.
    pub poisson: f64,
    /// ρ, kg/m³.
    pub density: f64,
    /// Damping ratio ζ of each mode.
    #[serde(default)]
    pub damping_ratio: f64,
    /// Points [x, y] (m) for attached bodies or nodes: stations without mass. The four corners are always stations.
    #[serde(default)]
    pub attach: Vec<[f64; 2]>,
}

impl Plate {
    /// Computes the lowest modes, scaled to a largest deflection near 1, with point masses at Gauss points, and stations at the corners and at
    /// `attach`.
    ///
    /// # Errors
    /// [`GeneratorFault`] for each invalid parameter, and for more modes than the series resolves.
    pub fn modes(&self, count: usize) -> Result<Modes, Vec<GeneratorFault>> {
        self.check(count)?;
        let shapes = self.shapes(count).ok_or(vec![GeneratorFault::NoModes { what: "plate" }])?;
        let (a, b) = (self.length, self.width);
        let corners = [[0.0, -0.5 * b], [0.0, 0.5 * b], [a, -0.5 * b], [a, 0.5 * b]];
        let mut stations: Vec<Station> = corners
            .iter()
            .chain(&self.attach)
            .map(|[x, y]| self.station(*x, *y, 0.0, &shapes))
            .collect();
        // Modes are polynomials of degree TERMS + 1, so this quadrature integrates their products exactly.
        for (s, u) in gauss(TERMS + 2) {
            for (t, v) in gauss(TERMS) {
                stations.push(self.station(a * s, b * (t - 0.5), u * v, &shapes));
            }
        }
        let modes = Modes {
            stiffness: shapes.iter().map(|s| s.stiffness).collect(),
            damping: Vec::new(),
            stations,
            attachment: Attachment::Nearest { tolerance: 1e-6 * a.max(b) },
        };
        Ok(if self.damping_ratio > 0.0 {
            modes.with_damping_ratio(self.damping_ratio)
        } else {
            modes
        })
    }

    /// Returns the mass, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.density * self.length * self.width * self.thickness
    }

    fn check(&self, count: usize) -> Result<(), Vec<GeneratorFault>> {
        let numbers = [
            ("length", self.length),
            ("width", self.width),
            ("thickness", self.thickness),
            ("young", self.young),
            ("density", self.density),
        ];
        let mut faults = GeneratorFault::positive("plate", &numbers);
        if !(self.poisson > -1.0 && self.poisson < 0.5) {
            faults.push(GeneratorFault::Poisson { value: self.poisson });
        }
        let ratio = self.damping_ratio;
        if !(ratio.is_finite() && ratio >= 0.0) {
            faults.push(GeneratorFault::Damping { what: "plate", ratio });
        }
        if count > TERMS * TERMS / 4 {
            let most = TERMS * TERMS / 4;
            faults.push(GeneratorFault::TooMany { what: "plate", wanted: count, most });
        }
        let on = |[x, y]: &[f64; 2]| (0.0..=self.length).contains(x) && 2.0 * y.abs() <= self.width;
        for at in self.attach.iter().filter(|at| !on(at)) {
            faults.push(GeneratorFault::OffPlate { at: *at });
        }
        if faults.is_empty() { Ok(()) } else { Err(faults) }
    }

    fn shapes(&self, count: usize) -> Option<Vec<Shape>> {
        let n = TERMS * TERMS;
        let nu = self.poisson;
        let D = self.young * self.thickness.powi(3) / (12.0 * (1.0 - nu * nu));
        let surface = self.density * self.thickness;
        let (mut K, mut M) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        for (s, u) in gauss(TERMS + 2) {
            for (t, v) in gauss(TERMS + 2) {
                let (x, y) = (self.length * s, self.width * (t - 0.5));
                let dA = u * v * self.length * self.width;
                let terms: Vec<[f64; 6]> = (0..n).map(|k| self.term(k, x, y)).collect();
                for (i, p) in terms.iter().enumerate() {
                    for (j, q) in terms.iter().enumerate() {
                        let [w, _, _, xx, yy, xy] = *p;
                        let bend = xx * q[3] + yy * q[4] + nu * (xx * q[4] + yy * q[3]);
                        K[(i, j)] += dA * D * (bend + 2.0 * (1.0 - nu) * xy * q[5]);
                        M[(i, j)] += dA * surface * w * q[0];
                    }
                }
            }
        }
        let found = lowest(&K, &M, D / (surface * self.length.powi(4)), count)?;
        let (a, b) = (self.length, self.width);
        let scaled = |(omega2, c): (f64, DVector<f64>)| {
            let shape = Shape { stiffness: omega2, c };
            // Find the largest deflection on a grid that includes the corners.
            let grid = (0..=8).flat_map(|i| (0..=8).map(move |j| (i, j)));
            let place = |(i, j)| (a * f64::from(i) / 8.0, b * (f64::from(j) / 8.0 - 0.5));
            let values = grid.map(place).map(|(x, y)| shape.sum(self, x, y, 0));
            let largest = values.fold(0.0, |m: f64, w| if w.abs() > m.abs() { w } else { m });
            Shape { stiffness: omega2 / (largest * largest), c: shape.c / largest }
        };
        Some(found.into_iter().map(scaled).collect())
    }

    /// Returns one term of the series at a point: w, w_x, w_y, w_xx, w_yy, w_xy.
    fn term(&self, k: usize, x: f64, y: f64) -> [f64; 6] {
        let (m, n) = (k / TERMS, k % TERMS);
        let s = x / self.length;
        let (p, q) = (legendre(m, 2.0 * s - 1.0), legendre(n, 2.0 * y / self.width));
        let (a, b) = (self.length, 0.5 * self.width);
        // The functions are s² P(2s − 1) and its derivatives with respect to s.
        let X = [
            s * s * p[0],
            2.0 * s * p[0] + 2.0 * s * s * p[1],
            2.0 * p[0] + 8.0 * s * p[1] + 4.0 * s * s * p[2],
        ];
        [
            X[0] * q[0],
            X[1] / a * q[0],
            X[0] * q[1] / b,
            X[2] / (a * a) * q[0],
            X[0] * q[2] / (b * b),
            X[1] / a * q[1] / b,
        ]
    }

    fn station(&self, x: f64, y: f64, share: f64, shapes: &[Shape]) -> Station {
        let translation = shapes.iter().map(|s| Vec3::z() * s.sum(self, x, y, 0)).collect();
        let rotation = shapes
            .iter()
            .map(|s| Vec3::new(s.sum(self, x, y, 2), -s.sum(self, x, y, 1), 0.0))
            .collect();
        Station {
            pose: Pose::translation(x, y, 0.0),
            mass: MassProperties::new(share * self.mass(), Vec3::zeros(), Mat3::zeros()),
            translation,
            rotation,
            shortening: None,
        }
    }
}

/// A mode: its stiffness and its coefficients in the series.
struct Shape {
    stiffness: f64,
    c: DVector<f64>,
}

impl Shape {
    /// Returns the sum over the series of entry `what` of the terms.
    fn sum(&self, plate: &Plate, x: f64, y: f64, what: usize) -> f64 {
        self.c.iter().enumerate().map(|(k, c)| c * plate.term(k, x, y)[what]).sum()
    }
}

/// Returns P_n and its first two derivatives from the recurrence
/// P_{k+1} = ((2k+1) x P_k − k P_{k−1})/(k+1),  P'_{k+1} = P'_{k−1} + (2k+1) P_k, and the same for P''.
fn legendre(n: usize, x: f64) -> [f64; 3] {
    let (mut below, mut p) = ([0.0; 3], [1.0, 0.0, 0.0]);
    for k in 0..n {
        let c = 2.0 * k as f64 + 1.0;
        let value = (c * x * p[0] - k as f64 * below[0]) / (k as f64 + 1.0);
        let next = [value, below[1] + c * p[0], below[2] + c * p[1]];
        (below, p) = (p, next);
    }
    p
}
