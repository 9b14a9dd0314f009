//! Modes of a straight uniform beam: bending in two planes, twist, stretch.
//!
//! Finite elements with Hermite cubics N for each of the four uncoupled motions:
//! ```text
//!            K                      M                          moves
//! bending    ∫ E I N'' N'' dx       ∫ ρ A N N + ρ I N' N' dx   y (I = I_z) or z (I = I_y)
//! twist      ∫ G J N' N' dx         ∫ ρ (I_y + I_z) N N dx     about x
//! stretch    ∫ E A N' N' dx         ∫ ρ A N N dx               along x
//! K x = ω² M x;   G_ij(x) = ∫₀ˣ φ_i'·φ_j' dx                   shortening of bending modes
//! ```
//! Euler–Bernoulli theory with rotary inertia of the sections (Rayleigh) and without shear: for beams at least ten times as long as high. The mass is
//! divided into slices at Gauss points over the whole length.

use super::eigen::{gauss, lowest};
use super::place::Cubic;
use super::validate::GeneratorFault;
use super::{Attachment, Modes, Shortening, Station};
use linkwork_spatial::nalgebra::{DMatrix, DVector};
use linkwork_spatial::{InertiaCheck, MassProperties, Mat3, Pose, Vec3};
use serde::{Deserialize, Serialize};

/// Number of finite elements over the length: ten for each half wave of the eighth mode.
const ELEMENTS: usize = 40;

/// Boundary conditions of the mode shapes at the two ends, in the body frame, which is at x = 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ends {
    /// Clamped at x = 0, free at the other end: for beams supported at one end.
    #[default]
    ClampedFree,
    /// Clamped at both ends, also in twist and stretch.
    ClampedClamped,
    /// Clamped at x = 0; the other end may rotate, stretch and twist.
    ClampedPinned,
    /// Zero deflection at both ends, and the body frame follows the chord: for rods between pins. Stretch and twist are fixed at x = 0.
    PinnedPinned,
    /// Free at both ends, without rigid-body modes: for floating bodies on a free hinge.
    FreeFree,
}

/// Number of modes of each kind, lowest first; the modes are in this order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BeamModes {
    /// Deflection along y.
    pub bending_y: usize,
    /// Deflection along z.
    pub bending_z: usize,
    /// Rotation about x.
    pub twist: usize,
    /// Displacement along x.
    pub stretch: usize,
}

/// A straight uniform beam along the body's x axis, from its frame at x = 0 to x = `length`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Beam {
    /// Length, m.
    pub length: f64,
    /// Young's modulus E, Pa.
    pub young: f64,
    /// Shear modulus G, Pa.
    pub shear: f64,
    /// Density ρ, kg/m³.
    pub density: f64,
    /// Area of the cross-section A, m².
    pub area: f64,
    /// ∫ z² dA, m⁴: bending along z.
    pub I_y: f64,
    /// ∫ y² dA, m⁴: bending along y.
    pub I_z: f64,
    /// Torsion constant, m⁴: I_y + I_z for round sections only.
    pub J: f64,
    /// Boundary conditions.
    #[serde(default)]
    pub ends: Ends,
    /// Damping ratio ζ of each mode.
    #[serde(default)]
    pub damping_ratio: f64,
}

/// Coefficients of one of the four motions.
struct Motion {
    stiffness: f64,
    /// Order of the derivative that stores energy.
    order: usize,
    mass: f64,
    rotary: f64,
    /// Fixed unknowns at x = 0 and at the end: value, slope.
    held: [[bool; 2]; 2],
    rigid: usize,
}

/// A mode: ω², values and slopes at the nodes scaled to a largest value of 1, and the scale factor.
struct Shape {
    stiffness: f64,
    x: DVector<f64>,
}

impl Shape {
    /// Returns value and slope at a position between 0 and `length`.
    fn at(&self, place: f64, length: f64) -> (f64, f64) {
        let (e, s, h) = element(place, length);
        let [value, slope, _] = Cubic::new(s, h).weights();
        let sum = |w: [f64; 4]| (0..4).map(|i| w[i] * self.x[2 * e + i]).sum();
        (sum(value), sum(slope))
    }
}

/// Returns the element at a position, the coordinate in it (0 … 1), and its length.
fn element(place: f64, length: f64) -> (usize, f64, f64) {
    let t = place / length * ELEMENTS as f64;
    let e = (t.floor().max(0.0) as usize).min(ELEMENTS - 1);
    (e, t - e as f64, length / ELEMENTS as f64)
}

impl Beam {
    /// Returns a round solid or hollow section with the given outer and inner diameters (m) and steel-like material constants.
    #[must_use]
    pub fn tube(
        length: f64,
        outer: f64,
        inner: f64,
        young: f64,
        poisson: f64,
        density: f64,
    ) -> Self {
        let pi = std::f64::consts::PI;
        let I = pi / 64.0 * (outer.powi(4) - inner.powi(4));
        Self {
            length,
            young,
            shear: young / (2.0 * (1.0 + poisson)),
            density,
            area: pi / 4.0 * (outer.powi(2) - inner.powi(2)),
            I_y: I,
            I_z: I,
            J: 2.0 * I,
            ends: Ends::default(),
            damping_ratio: 0.0,
        }
    }

    /// Computes the modes, with slices of the whole mass and the nodes of the finite elements as stations.
    ///
    /// # Errors
    /// [`GeneratorFault`] for each invalid parameter, and for more modes than the elements resolve.
    pub fn modes(&self, count: BeamModes) -> Result<Modes, Vec<GeneratorFault>> {
        self.check(count)?;
        let wanted = [count.bending_y, count.bending_z, count.twist, count.stretch];
        let mut shapes: Vec<(usize, Shape)> = Vec::new();
        for (kind, n) in wanted.into_iter().enumerate() {
            let found =
                self.shapes(kind, n).ok_or(vec![GeneratorFault::NoModes { what: "beam" }])?;
            shapes.extend(found.into_iter().map(|s| (kind, s)));
        }
        let highest = wanted.into_iter().max().unwrap_or(0);
        let shortening = Shortenings::new(&shapes, self.length);
        let mut stations = Vec::new();
        for i in 0..=ELEMENTS {
            let x = self.length * i as f64 / ELEMENTS as f64;
            stations.push(self.station(x, 0.0, &shapes, &shortening));
        }
        // A product of two modes has twice their number of waves. The number of points is even, so that none coincides with a node.
        for (s, w) in gauss(2 * ((1.6 * highest as f64).ceil() as usize + 4)) {
            stations.push(self.station(self.length * s, w, &shapes, &shortening));
        }
        stations.sort_by(|a, b| a.pose.position.x.total_cmp(&b.pose.position.x));
        let modes = Modes {
            stiffness: shapes.iter().map(|(_, s)| s.stiffness).collect(),
            damping: Vec::new(),
            stations,
            attachment: Attachment::Beam,
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
        self.density * self.area * self.length
    }

    fn check(&self, count: BeamModes) -> Result<(), Vec<GeneratorFault>> {
        let numbers = [
            ("length", self.length),
            ("young", self.young),
            ("shear", self.shear),
            ("density", self.density),
            ("area", self.area),
            ("I_y", self.I_y),
            ("I_z", self.I_z),
            ("J", self.J),
        ];
        let mut faults = GeneratorFault::positive("beam", &numbers);
        let ratio = self.damping_ratio;
        if !(ratio.is_finite() && ratio >= 0.0) {
            faults.push(GeneratorFault::Damping { what: "beam", ratio });
        }
        let wanted = [count.bending_y, count.bending_z, count.twist, count.stretch];
        if let Some(n) = wanted.into_iter().find(|n| *n > ELEMENTS / 4) {
            faults.push(GeneratorFault::TooMany { what: "beam", wanted: n, most: ELEMENTS / 4 });
        }
        if faults.is_empty() { Ok(()) } else { Err(faults) }
    }

    fn motion(&self, kind: usize) -> Motion {
        let (clamp, pin, free) = ([true, true], [true, false], [false, false]);
        let (A, rho, bending) = (self.area, self.density, kind < 2);
        let held = match (self.ends, bending) {
            (Ends::ClampedFree, true) => [clamp, free],
            (Ends::ClampedClamped, true) => [clamp, clamp],
            (Ends::ClampedPinned, true) => [clamp, pin],
            (Ends::PinnedPinned, true) => [pin, pin],
            (Ends::FreeFree, _) => [free, free],
            (Ends::ClampedClamped, false) => [pin, pin],
            (_, false) => [pin, free],
        };
        let rigid = match (self.ends, bending) {
            (Ends::FreeFree, true) => 2,
            (Ends::FreeFree, false) => 1,
            _ => 0,
        };
        let (stiffness, order, mass, rotary) = match kind {
            0 => (self.young * self.I_z, 2, rho * A, rho * self.I_z),
            1 => (self.young * self.I_y, 2, rho * A, rho * self.I_y),
            2 => (self.shear * self.J, 1, rho * (self.I_y + self.I_z), 0.0),
            _ => (self.young * A, 1, rho * A, 0.0),
        };
        Motion { stiffness, order, mass, rotary, held, rigid }
    }

    /// Computes the lowest modes of one motion.
    fn shapes(&self, kind: usize, count: usize) -> Option<Vec<Shape>> {
        let motion = self.motion(kind);
        let (h, n) = (self.length / ELEMENTS as f64, 2 * (ELEMENTS + 1));
        let (mut K, mut M) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        for (s, w) in gauss(4) {
            let N = Cubic::new(s, h).weights();
            for e in 0..ELEMENTS {
                for i in 0..4 {
                    for j in 0..4 {
                        let at = (2 * e + i, 2 * e + j);
                        let of = |d: usize| w * h * N[d][i] * N[d][j];
                        K[at] += motion.stiffness * of(motion.order);
                        M[at] += motion.mass * of(0) + motion.rotary * of(1);
                    }
                }
            }
        }
        let held = |i: usize| match i {
            0 | 1 => motion.held[0][i],
            _ if i >= n - 2 => motion.held[1][i + 2 - n],
            _ => false,
        };
        let free: Vec<usize> = (0..n).filter(|i| !held(*i)).collect();
        let pick = |A: &DMatrix<f64>| {
            DMatrix::from_fn(free.len(), free.len(), |i, j| A[(free[i], free[j])])
        };
        let length = self.length.powi(2 * motion.order as i32);
        let sigma = motion.stiffness / (motion.mass * length);
        let found = lowest(&pick(&K), &pick(&M), sigma, count + motion.rigid)?;
        let shape = |(omega2, x): (f64, DVector<f64>)| {
            let mut all = DVector::zeros(n);
            for (i, x) in free.iter().zip(x.iter()) {
                all[*i] = *x;
            }
            let values = || (0..n).step_by(2).map(|i| all[i]);
            let largest = values().fold(0.0, |a: f64, b| a.max(b.abs()));
            let toward_end: f64 = values().enumerate().map(|(i, x)| (i + 1) as f64 * x).sum();
            let scale = (1.0 / largest).copysign(toward_end);
            Shape { stiffness: omega2 * scale * scale, x: all * scale }
        };
        Some(found.into_iter().skip(motion.rigid).map(shape).collect())
    }

    /// Returns the station at x that carries the fraction `share` of the mass.
    fn station(
        &self,
        x: f64,
        share: f64,
        shapes: &[(usize, Shape)],
        shortening: &Shortenings,
    ) -> Station {
        let (mut translation, mut rotation) = (Vec::new(), Vec::new());
        for (kind, shape) in shapes {
            let (value, slope) = shape.at(x, self.length);
            let (t, r) = match kind {
                0 => (Vec3::y() * value, Vec3::z() * slope),
                1 => (Vec3::z() * value, Vec3::y() * -slope),
                2 => (Vec3::zeros(), Vec3::x() * value),
                _ => (Vec3::x() * value, Vec3::zeros()),
            };
            translation.push(t);
            rotation.push(r);
        }
        let m = share * self.mass();
        let J = Vec3::new(self.I_y + self.I_z, self.I_y, self.I_z) * (m / self.area);
        Station {
            pose: Pose::translation(x, 0.0, 0.0),
            // A flat slice has a largest moment equal to the sum of the other two up to rounding, so the triangle check could fail.
            mass: MassProperties::new(m, Vec3::zeros(), Mat3::from_diagonal(&J))
                .with_check(InertiaCheck::PositiveMoments),
            translation,
            rotation,
            shortening: shortening.at(x),
        }
    }
}

/// Computes ∫ φ_i'·φ_j' dx up to each node, and continues from there to points between nodes.
struct Shortenings<'a> {
    shapes: &'a [(usize, Shape)],
    length: f64,
    nodes: Vec<Vec<f64>>,
}

impl<'a> Shortenings<'a> {
    fn new(shapes: &'a [(usize, Shape)], length: f64) -> Self {
        let mut all = Self { shapes, length, nodes: vec![vec![0.0; shapes.len().pow(2)]] };
        for e in 0..ELEMENTS {
            let mut sum = all.nodes[e].clone();
            all.add(e, length / ELEMENTS as f64, &mut sum);
            all.nodes.push(sum);
        }
        all
    }

    /// Adds the integral over the first length `h` of element `e`.
    fn add(&self, e: usize, h: f64, sum: &mut [f64]) {
        let (n, start) = (self.shapes.len(), self.length * e as f64 / ELEMENTS as f64);
        for (s, w) in gauss(3) {
            let slope = |k: usize| self.shapes[k].1.at(start + s * h, self.length).1;
            for i in 0..n {
                for j in 0..n {
                    let (a, b) = (self.shapes[i].0, self.shapes[j].0);
                    // Slopes along y and z are perpendicular, and twist and stretch do not deflect.
                    if a == b && a < 2 {
                        sum[i * n + j] += w * h * slope(i) * slope(j);
                    }
                }
            }
        }
    }

    fn at(&self, x: f64) -> Option<Shortening> {
        if self.shapes.iter().all(|(kind, _)| *kind >= 2) {
            return None;
        }
        let (e, s, h) = element(x, self.length);
        let mut matrix = self.nodes[e].clone();
        self.add(e, s * h, &mut matrix);
        Some(Shortening { axis: Vec3::x(), matrix })
    }
}
