//! Volume, centre of mass and inertia of the solid inside a triangle surface, or of the surface itself.
//!
//! ```text
//! Exact    Σ over tetrahedra (o, a, b, c):  V = a·(b×c)/6, signed        P = Σ V/20 (aaᵀ + bbᵀ + ccᵀ + ssᵀ), s = a + b + c
//! Legacy   the same with |V|
//! Shell    Σ over triangles of area A:      P = Σ A/12 (aaᵀ + bbᵀ + ccᵀ + ssᵀ)
//! J = tr(P) 1 − P
//! ```
//! The centre is computed with o at the centroid of the surface, then volume and P with o at the centre: MuJoCo does the same, and for a surface with
//! holes the result depends on o. `Legacy` is MuJoCo's default: it is exact where the surface is star-shaped seen from its centroid, and counts parts
//! twice elsewhere.

use linkwork_spatial::{Mat3, Vec3};

/// Interpretation of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Filling {
    /// The volume inside a closed surface.
    Exact,
    /// MuJoCo's usual volume.
    Legacy,
    /// The surface, of unit thickness.
    Shell,
}

/// Volume (m³; of a shell the area, m²), centre (m), and inertia about the centre for unit density.
pub(crate) struct Properties {
    pub volume: f64,
    pub centre: Vec3,
    pub inertia: Mat3,
}

/// Returns the properties of triangles, three corners for each; `None` without a positive volume or area.
pub(crate) fn properties(corners: &[Vec3], filling: Filling) -> Option<Properties> {
    let faces = || corners.chunks_exact(3).map(|f| (f[0], f[1], f[2]));
    let area = |a: Vec3, b: Vec3, c: Vec3| 0.5 * (b - a).cross(&(c - a)).norm();
    let (mut total, mut middle) = (0.0, Vec3::zeros());
    for (a, b, c) in faces() {
        let A = area(a, b, c);
        total += A;
        middle += (a + b + c) * (A / 3.0);
    }
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    middle /= total;
    let weight = |a: Vec3, b: Vec3, c: Vec3| {
        let V = a.dot(&b.cross(&c)) / 6.0;
        if filling == Filling::Legacy { V.abs() } else { V }
    };
    let (mut volume, mut centre) = (total, middle);
    if filling != Filling::Shell {
        (volume, centre) = (0.0, Vec3::zeros());
        for (a, b, c) in faces() {
            let (a, b, c) = (a - middle, b - middle, c - middle);
            let V = weight(a, b, c);
            volume += V;
            centre += (a + b + c) * (V / 4.0);
        }
        if !(volume > 0.0 && volume.is_finite()) {
            return None;
        }
        centre = centre / volume + middle;
    }
    let mut P = Mat3::zeros();
    if filling != Filling::Shell {
        volume = 0.0;
    }
    for (a, b, c) in faces() {
        let (a, b, c) = (a - centre, b - centre, c - centre);
        if filling != Filling::Shell {
            volume += weight(a, b, c);
        }
        let s = a + b + c;
        let w = match filling {
            Filling::Shell => area(a, b, c) / 12.0,
            _ => weight(a, b, c) / 20.0,
        };
        P += (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose()) * w;
    }
    let inertia = Mat3::identity() * P.trace() - P;
    if !(volume > 0.0) {
        return None;
    }
    inertia.iter().all(|x| x.is_finite()).then_some(Properties { volume, centre, inertia })
}
