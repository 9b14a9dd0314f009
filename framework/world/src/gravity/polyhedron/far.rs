//! Far field of a homogeneous polyhedron: the series of its moments about the centroid, degrees 0, 2 and 3.
//!
//! ```text
//! V/Gρ = V₀/r + (3 q − T r²)/(2 r⁵) + (5 c − 3 s r²)/(2 r⁷)
//! q = rᵀ M r,  T = tr M,  c = Σ K_ijk r_i r_j r_k,  s = u·r,  u_i = Σ_j K_ijj
//! M = ∫ x xᵀ dV,   K_ijk = ∫ x_i x_j x_k dV
//! ```
//! A tetrahedron has one corner at the origin and the other corners v; S = Σ v, Q = Σ v vᵀ, and its volume is V₀:
//! ```text
//! ∫ x xᵀ dV = V₀/20 (Q + S Sᵀ)
//! ∫ x_i x_j x_k dV = V₀/120 (S_i S_j S_k + S_i Q_jk + S_j Q_ik + S_k Q_ij + 2 Σ v_i v_j v_k)
//! ```

use super::super::Gravity;
use super::Face;
use linkwork_spatial::{Mat3, Vec3};

/// Ratio of the distance from the centroid to that of the farthest vertex, above which the series is more accurate.
const FAR: f64 = 150.0;

/// Moments about the centroid.
#[derive(Clone, Debug)]
pub(super) struct Moments {
    /// Minimum distance at which the series is used, m.
    from: f64,
    volume: f64,
    /// ∫ x xᵀ dV, m⁵.
    M: Mat3,
    /// ∫ x_i x xᵀ dV for each i, m⁶.
    K: [Mat3; 3],
    /// u, m⁶.
    u: Vec3,
}

impl Moments {
    pub(super) fn new(vertices: &[Vec3], faces: &[Face], volume: f64, centroid: Vec3) -> Self {
        let (mut M, mut K, mut size) = (Mat3::zeros(), [Mat3::zeros(); 3], 0.0_f64);
        for f in faces {
            let corners = f.corners.map(|k| vertices[k as usize] - centroid);
            let [a, b, c] = corners;
            let v = a.dot(&b.cross(&c)) / 6.0;
            let S = a + b + c;
            let Q: Mat3 = corners.iter().map(|x| x * x.transpose()).sum();
            M += (Q + S * S.transpose()) * (v / 20.0);
            for (i, K) in K.iter_mut().enumerate() {
                let e = Q.column(i);
                let cubes: Mat3 = corners.iter().map(|x| x * x.transpose() * x[i]).sum();
                let mixed = S * e.transpose() + e * S.transpose();
                *K += (S * S.transpose() * S[i] + Q * S[i] + mixed + cubes * 2.0) * (v / 120.0);
            }
            size = corners.iter().fold(size, |size, x| size.max(x.norm()));
        }
        let u = Vec3::new(K[0].trace(), K[1].trace(), K[2].trace());
        Self { from: FAR * size, volume, M, K, u }
    }

    /// Returns the gravity at `r` (m) from the centroid, for Gρ = 1; `None` at distances where the closed form is more accurate.
    pub(super) fn gravity(&self, r: &Vec3) -> Option<Gravity> {
        let d = r.norm();
        if d < self.from {
            return None;
        }
        // Each degree has one power of 1/d with n = r/d, so that overflow is impossible.
        let n = r / d;
        let (i, one, nn) = (1.0 / d, Mat3::identity(), n * n.transpose());
        let (i3, i4) = (i * i * i, i * i * i * i);
        let Mn = self.M * n;
        let (q, T) = (n.dot(&Mn), self.M.trace());
        let N = Mat3::from_rows(&self.K.map(|K| (K * n).transpose()));
        let v = N * n;
        let (c, s) = (n.dot(&v), self.u.dot(&n));
        let sym = |a: &Vec3| a * n.transpose() + n * a.transpose();
        let potential = self.volume * i + 0.5 * (3.0 * q - T) * i3 + 0.5 * (5.0 * c - 3.0 * s) * i4;
        let a2 = Mn * 6.0 + n * (3.0 * T - 15.0 * q);
        let a3 = v * 15.0 - self.u * 3.0 + n * (15.0 * s - 35.0 * c);
        let acceleration = -n * (self.volume * i * i) + a2 * (0.5 * i4) + a3 * (0.5 * i4 * i);
        let h2 = self.M * 6.0 - sym(&Mn) * 30.0
            + one * (3.0 * T - 15.0 * q)
            + nn * (105.0 * q - 15.0 * T);
        let h3 = N * 30.0 - sym(&v) * 105.0
            + sym(&self.u) * 15.0
            + one * (15.0 * s - 35.0 * c)
            + nn * (315.0 * c - 105.0 * s);
        let gradient =
            (nn * 3.0 - one) * (self.volume * i3) + h2 * (0.5 * i4 * i) + h3 * (0.5 * i3 * i3);
        Some(Gravity { potential, acceleration, gradient })
    }
}
