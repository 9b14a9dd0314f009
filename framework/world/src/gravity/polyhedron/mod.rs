//! Gravity of a homogeneous polyhedron in closed form, for asteroids.
//!
//! The equations are from Werner & Scheeres, *Exterior gravitation of a polyhedron*, Celestial Mechanics 65 (1997). r_e, r_f point from the field
//! point to any point of an edge or face, G is the gravitational constant, ρ the density:
//! ```text
//! V = ½Gρ (Σ_e r_e·E_e r_e L_e − Σ_f r_f·F_f r_f ω_f)
//! a = Gρ (−Σ_e E_e r_e L_e + Σ_f F_f r_f ω_f)
//! ∂a/∂x = Gρ (Σ_e E_e L_e − Σ_f F_f ω_f),   trace = −Gρ Σ_f ω_f: 0 outside, −4πGρ inside
//! E_e = n_A n_eAᵀ + n_B n_eBᵀ,   F_f = n_f n_fᵀ
//! L_e = ln((a + b + e)/(a + b − e)),   ω_f = 2 atan2(r₁·r₂×r₃, abc + a r₂·r₃ + b r₁·r₃ + c r₁·r₂)
//! ```
//! n_f points out of the body; n_eA lies in face A and points out of it across the edge. The equations are exact everywhere, also inside. On an edge
//! the gradient is infinite, and the result there excludes this edge. Far away the terms cancel: a fraction of about 1e-16 (distance/size)³ of the
//! acceleration is lost. From 150 times the distance of the farthest vertex on, moments of the mass of degree 2 and 3 are used instead (`far`). Both
//! have an error of about 3e-10 there, and the series becomes more accurate with distance.

mod facets;
mod far;
mod mesh;
mod obj;

pub use facets::{Facet, Surface, facets_from_obj};
pub use obj::from_obj;

use super::Gravity;
use crate::error::{WorldError, number};
use linkwork_spatial::{Mat3, Vec3};
use std::f64::consts::PI;

/// A closed surface of triangles, ready for evaluation. Axes and origin are those of its vertices.
#[derive(Clone, Debug)]
pub struct Polyhedron {
    /// Gρ, 1/s².
    g_rho: f64,
    vertices: Vec<Vec3>,
    faces: Vec<Face>,
    edges: Vec<Edge>,
    volume: f64,
    centroid: Vec3,
    moments: far::Moments,
}

/// A triangle: corners counter-clockwise from outside, and the outward normal.
#[derive(Clone, Copy, Debug)]
struct Face {
    corners: [u32; 3],
    normal: Vec3,
}

/// An edge between two faces.
#[derive(Clone, Copy, Debug)]
struct Edge {
    ends: [u32; 2],
    length: f64,
    E: Mat3,
}

impl Polyhedron {
    /// Creates a polyhedron from vertices (m) and triangles, counter-clockwise seen from outside, indices from 0. `g_rho` is G times the density,
    /// 1/s². O(n log n).
    ///
    /// # Errors
    /// An index out of range, a triangle with zero area, an edge that does not belong to exactly two triangles of opposite direction, a volume that
    /// is not above zero (inside out), or numbers that are not finite.
    pub fn new(
        vertices: Vec<Vec3>,
        triangles: &[[u32; 3]],
        g_rho: f64,
    ) -> Result<Self, WorldError> {
        number("g_rho, 1/s²", g_rho, |x| x > 0.0, "G times a density above 0")?;
        let faces = mesh::faces(&vertices, triangles, |k| format!("triangle {k}"))?;
        let edges = mesh::edges(&vertices, &faces)?;
        let (volume, centroid) = mesh::volume(&vertices, &faces)?;
        let moments = far::Moments::new(&vertices, &faces, volume, centroid);
        Ok(Self { g_rho, vertices, faces, edges, volume, centroid, moments })
    }

    /// Returns the volume, m³.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Returns the centre of mass, m.
    #[must_use]
    pub fn centroid(&self) -> Vec3 {
        self.centroid
    }

    /// Returns the gravitational parameter: Gρ times the volume, m³/s².
    #[must_use]
    pub fn mu(&self) -> f64 {
        self.g_rho * self.volume
    }

    /// Returns the corners of the triangles, m.
    #[must_use]
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Returns potential (m²/s²), acceleration (m/s²) and gradient (1/s²) at `p` (m), axes of the vertices. Closer than 150 times the distance of the
    /// farthest vertex, it needs one logarithm per edge and one arctangent per triangle. Does not allocate.
    #[must_use]
    pub fn gravity(&self, p: &Vec3) -> Gravity {
        match self.moments.gravity(&(p - self.centroid)) {
            Some(far) => Gravity {
                potential: self.g_rho * far.potential,
                acceleration: far.acceleration * self.g_rho,
                gradient: far.gradient * self.g_rho,
            },
            None => self.near(p),
        }
    }

    /// Evaluates the closed form.
    fn near(&self, p: &Vec3) -> Gravity {
        let (mut V, mut a, mut H) = (0.0, Vec3::zeros(), Mat3::zeros());
        for e in &self.edges {
            let r = self.vertices[e.ends[0] as usize] - p;
            let sum = r.norm() + (self.vertices[e.ends[1] as usize] - p).norm();
            let short = sum - e.length;
            if short <= 1e-15 * e.length {
                continue;
            }
            let L = ((sum + e.length) / short).ln();
            let Er = e.E * r;
            V += r.dot(&Er) * L;
            a -= Er * L;
            H += e.E * L;
        }
        for f in &self.faces {
            let (omega, r) = self.solid_angle(f, p);
            let h = f.normal.dot(&r);
            V -= h * h * omega;
            a += f.normal * (h * omega);
            H -= f.normal * f.normal.transpose() * omega;
        }
        Gravity {
            potential: 0.5 * self.g_rho * V,
            acceleration: a * self.g_rho,
            gradient: H * self.g_rho,
        }
    }

    /// Returns Σω/4π at `p` (m): 1 inside, 0 outside, ½ on a face.
    #[must_use]
    pub fn winding(&self, p: &Vec3) -> f64 {
        self.faces.iter().map(|f| self.solid_angle(f, p).0).sum::<f64>() / (4.0 * PI)
    }

    /// Returns whether `p` (m) is inside.
    #[must_use]
    pub fn contains(&self, p: &Vec3) -> bool {
        self.winding(p) > 0.5
    }

    /// Returns the signed solid angle of a face from `p`, and the vector to its first corner.
    fn solid_angle(&self, f: &Face, p: &Vec3) -> (f64, Vec3) {
        let [r1, r2, r3] = f.corners.map(|k| self.vertices[k as usize] - p);
        let (a, b, c) = (r1.norm(), r2.norm(), r3.norm());
        let y = r1.dot(&r2.cross(&r3));
        let x = a * b * c + a * r2.dot(&r3) + b * r1.dot(&r3) + c * r1.dot(&r2);
        (2.0 * y.atan2(x), r1)
    }
}
