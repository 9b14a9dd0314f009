//! Point mass, zonal harmonics in closed form, and gravity-gradient torque.

use linkwork_spatial::{Mat3, Vec3};

/// Returns −μ p/|p|³, m/s²: the acceleration at `p` (m) due to a point mass μ (m³/s²) at the origin, any axes. NaN at the origin.
#[must_use]
pub fn point_mass(mu: f64, p: &Vec3) -> Vec3 {
    let r2 = p.norm_squared();
    p * (-mu / (r2 * r2.sqrt()))
}

/// Returns ∂a/∂p = μ/r³ (3 r̂ r̂ᵀ − 1) of a point mass, 1/s².
#[must_use]
pub fn point_mass_gradient(mu: f64, p: &Vec3) -> Mat3 {
    let r2 = p.norm_squared();
    (p * p.transpose() * (3.0 / r2) - Mat3::identity()) * (mu / (r2 * r2.sqrt()))
}

/// Returns the acceleration of a point mass with zonal harmonics J₂, J₃, …, not normalised (`j[0]` is J₂), m/s²; z is the axis of the body. It is
/// faster than [`super::Harmonics`] for a few degrees.
///
/// ```text
/// V = μ/r (1 − Σ_n J_n (R/r)ⁿ P_n(u)),  u = z/r
/// a = −μ/r² r̂ + μ/r² Σ_n J_n (R/r)ⁿ [((n+1) P_n + u P'_n) r̂ − P'_n ẑ]
/// n P_n = (2n−1) u P_n-1 − (n−1) P_n-2,   P'_n = P'_n-2 + (2n−1) P_n-1
/// ```
/// This is the gradient of V; the factor of r̂ is P'_n+1.
#[must_use]
pub fn zonal(mu: f64, radius: f64, j: &[f64], p: &Vec3) -> Vec3 {
    let r = p.norm();
    let n = p / r;
    let u = n.z;
    // The recursion starts with P_0, P_1 and their derivatives.
    let (mut before, mut last) = ([1.0, 0.0], [u, 1.0]);
    let rho = radius / r;
    let mut power = rho;
    let (mut along, mut axial) = (-1.0, 0.0);
    for (k, j) in j.iter().enumerate() {
        let n = (k + 2) as f64;
        let value = ((2.0 * n - 1.0) * u * last[0] - (n - 1.0) * before[0]) / n;
        let slope = before[1] + (2.0 * n - 1.0) * last[0];
        power *= rho;
        along += j * power * ((n + 1.0) * value + u * slope);
        axial -= j * power * slope;
        (before, last) = (last, [value, slope]);
    }
    (n * along + Vec3::z() * axial) * (mu / (r * r))
}

/// Returns ∂a/∂p of [`zonal`], 1/s²; symmetric, with zero trace.
/// ```text
/// a = f r̂ + g ẑ,   f = μ/r² (−1 + Σ J_n (R/r)ⁿ P'_n+1),   g = −μ/r² Σ J_n (R/r)ⁿ P'_n
/// ∂a/∂p = r̂ (∇f)ᵀ + f/r (1 − r̂ r̂ᵀ) + ẑ (∇g)ᵀ,   ∇f = ∂f/∂r r̂ + ∂f/∂u (ẑ − u r̂)/r
/// P''_n = P''_n-2 + (2n−1) P'_n-1,   P'_n+1 = (n+1) P_n + u P'_n,   P''_n+1 = (n+2) P'_n + u P''_n
/// ```
#[must_use]
pub fn zonal_gradient(mu: f64, radius: f64, j: &[f64], p: &Vec3) -> Mat3 {
    let r = p.norm();
    let n = p / r;
    let u = n.z;
    // The recursion starts with P, P', P'' of degrees 0 and 1.
    let (mut before, mut last) = ([1.0, 0.0, 0.0], [u, 1.0, 0.0]);
    let rho = radius / r;
    let mut power = rho;
    // The sums are f and g divided by μ/r², their derivatives with respect to u, and the derivatives
    // with respect to r times r.
    let (mut f, mut f_u, mut f_r) = (-1.0, 0.0, 2.0);
    let (mut g, mut g_u, mut g_r) = (0.0, 0.0, 0.0);
    for (k, j) in j.iter().enumerate() {
        let n = (k + 2) as f64;
        let value = ((2.0 * n - 1.0) * u * last[0] - (n - 1.0) * before[0]) / n;
        let slope = before[1] + (2.0 * n - 1.0) * last[0];
        let bend = before[2] + (2.0 * n - 1.0) * last[1];
        power *= rho;
        let along = j * power * ((n + 1.0) * value + u * slope);
        let axial = -j * power * slope;
        (f, g) = (f + along, g + axial);
        f_u += j * power * ((n + 2.0) * slope + u * bend);
        g_u -= j * power * bend;
        (f_r, g_r) = (f_r - (n + 2.0) * along, g_r - (n + 2.0) * axial);
        (before, last) = (last, [value, slope, bend]);
    }
    let across = Vec3::z() - n * u;
    let (df, dg) = (n * f_r + across * f_u, n * g_r + across * g_u);
    let sum = n * df.transpose()
        + (Mat3::identity() - n * n.transpose()) * f
        + Vec3::z() * dg.transpose();
    sum * (mu / (r * r * r))
}

/// Returns the gravity-gradient torque about the centre of mass of a body, N m, body axes.
///
/// `inertia` is about the centre of mass, kg m², and `p_body` points from the attracting centre to it, m; both in body axes. The attracting body is a
/// point mass:
/// ```text
/// τ = 3 μ/r³ r̂ × (I r̂)
/// ```
/// Only the first-order term in the ratio of body size to distance is included.
#[must_use]
pub fn torque(mu: f64, inertia: &Mat3, p_body: &Vec3) -> Vec3 {
    let r2 = p_body.norm_squared();
    let n = p_body / r2.sqrt();
    n.cross(&(inertia * n)) * (3.0 * mu / (r2 * r2.sqrt()))
}
