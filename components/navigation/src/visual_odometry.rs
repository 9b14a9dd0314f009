//! Visual odometry: motion of a camera from one picture to the next.
//! ```text
//! landmark    a corner of the old picture at x/z, y/z with its inverse depth 1/z                        z = [x/z, y/z, 1/z]
//! match       the same patch in the new picture, and the inverse depth there
//! residual    r = z₁ − π(R_01ᵀ (p₀ − t_01)),     Σ = D₁ + J R_01ᵀ G D₀ Gᵀ R_01 Jᵀ     G = ∂p₀/∂z₀, J = ∂π/∂p
//! agreement     RANSAC: motions from three matches each (least squares of their points); the one with which most matches agree, rᵀ Σ⁻¹ r < 9 χ²
//! motion      Σ rᵀ Σ⁻¹ r → least by Gauss–Newton over those, then over those within χ²;   P = s (Σ Aᵀ Σ⁻¹ A)⁻¹,  A = ∂r/∂(t, φ),  s = max(1, Σ rᵀ Σ⁻¹ r/(3 n − 6))
//! ```
//! D₁ = diag(σ², σ², σ_ρ²) and D₀ = diag(0, 0, σ_ρ²): the position of a patch in the old picture is taken as exact, and its match carries the error
//! of both. σ_ρ = σ_d/(f B)
//! of a pair with baseline B. Matthies & Shafer, "Error modeling in stereo navigation", 1987; Maimone, Cheng, Matthies, "Two years of
//! visual odometry on the Mars Exploration Rovers", J. Field Robotics 24, 2007; Fischler & Bolles, 1981, for the agreement.
//! True motion and estimate: R = exp(φ) R̂, t = t̂ + τ, both in the axes of the old camera; P is of (τ, φ), m and rad.

use crate::features::Features;
use linkwork_render::Picture;
use linkwork_runtime::noise;
use linkwork_spatial::nalgebra::{Matrix3x6, Matrix6, Vector6};
use linkwork_spatial::{Mat3, Pose, Quat, Vec3, skew};
use serde::{Deserialize, Serialize};

/// Parameters of visual odometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisualOdometry {
    /// Corners and matches.
    pub features: Features,
    /// σ: standard deviation of a match across the image, as an angle, rad.
    pub pixel: f64,
    /// σ_ρ: standard deviation of an inverse depth, 1/m.
    pub inverse_depth: f64,
    /// Number of RANSAC trials, each from three matches.
    pub tries: u32,
    /// Minimum number of agreeing matches.
    pub fewest: usize,
}

/// A picture and its corners, which are matched in the next one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scenery {
    /// The picture.
    pub picture: Picture,
    /// Column and row of each corner.
    pub corners: Vec<[usize; 2]>,
}

/// Observation of a point: x/z and y/z of its ray, and its inverse depth 1/z, 1/m.
pub type Observation = [f64; 3];

/// A motion of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Pose of the new camera in the old one.
    pub X_01: Pose,
    /// Covariance of (τ, φ).
    pub covariance: Matrix6<f64>,
    /// Number of agreeing matches.
    pub agree: usize,
    /// Number of matches.
    pub matches: usize,
}

/// 99 % quantile of χ² with three degrees of freedom.
const BEYOND: f64 = 11.34;
/// Threshold for motions from only three matches, whose errors are about three times larger.
const LOOSE: f64 = 9.0 * BEYOND;
/// Number of Gauss–Newton steps.
const STEPS: usize = 8;
/// Maximum number of rounds in which the agreeing matches are selected again, because three distant matches give a poor first motion.
const ROUNDS: usize = 10;
/// Maximum tangent of a ray.
const WIDE: f64 = 3.0;

fn point([a, b, rho]: &Observation) -> Vec3 {
    Vec3::new(*a, *b, 1.0) / *rho
}

fn seen(p: &Vec3) -> Option<Observation> {
    (p.z > 1e-3).then(|| [p.x / p.z, p.y / p.z, 1.0 / p.z])
}

/// Returns x/z, y/z of the ray of a pixel.
fn tangents(picture: &Picture, pixel: [f64; 2]) -> Option<[f64; 2]> {
    let d = picture.lens.ray(pixel)?.direction;
    let t = [d.x / d.z, d.y / d.z];
    (d.z > 0.0 && t.iter().all(|t| t.abs() < WIDE)).then_some(t)
}

/// Returns the inverse depth at a pixel, 1/m.
fn inverse_depth(picture: &Picture, x: usize, y: usize) -> Option<f64> {
    let range = f64::from(*picture.range.get(y * picture.width + x)?);
    let d = picture.lens.ray([x as f64, y as f64])?.direction;
    (range > 0.0 && d.z > 0.0).then(|| 1.0 / (range * d.z))
}

/// Returns the inverse depth interpolated between pixels, 1/m; `None` if one of the four neighbours has no depth or at a depth edge.
fn inverse_depth_at(picture: &Picture, [x, y]: [f64; 2]) -> Option<f64> {
    if !(x >= 0.0 && y >= 0.0) {
        return None;
    }
    let (x0, y0) = (x.floor() as usize, y.floor() as usize);
    let (fx, fy) = (x - x0 as f64, y - y0 as f64);
    if x0 + 1 >= picture.width || y0 + 1 >= picture.height {
        return None;
    }
    let at = |dx: usize, dy: usize| inverse_depth(picture, x0 + dx, y0 + dy);
    let [a, b, c, d] = [at(0, 0)?, at(1, 0)?, at(0, 1)?, at(1, 1)?];
    let (low, high) = (a.min(b).min(c).min(d), a.max(b).max(c).max(d));
    if high > 1.15 * low {
        return None;
    }
    Some((a * (1.0 - fx) + b * fx) * (1.0 - fy) + (c * (1.0 - fx) + d * fx) * fy)
}

impl VisualOdometry {
    /// Detects the corners of a grey picture.
    #[must_use]
    pub fn scenery(&self, picture: &Picture) -> Scenery {
        let width = picture.width.max(1);
        let usable = |k: usize| inverse_depth(picture, k % width, k / width).is_some();
        let corners = match picture.image.channels {
            1 => self.features.corners(&picture.image, usable),
            _ => vec![],
        };
        Scenery { picture: picture.clone(), corners }
    }

    /// Returns pairs of observations of the same points in the old and the new picture. `guess`: predicted pose of the new camera in the old one.
    #[must_use]
    pub fn matches(&self, old: &Scenery, new: &Picture, guess: &Pose) -> Vec<[Observation; 2]> {
        let to_new = guess.inverse();
        let follow = |corner: &[usize; 2]| {
            let from = corner.map(|c| c as f64);
            let [a, b] = tangents(&old.picture, from)?;
            let before = [a, b, inverse_depth(&old.picture, corner[0], corner[1])?];
            let expected = new.lens.project(&to_new.transform_point(&point(&before)))?;
            let found = self.features.follow(&old.picture.image, *corner, &new.image, expected)?;
            let [a, b] = tangents(new, found)?;
            Some([before, [a, b, inverse_depth_at(new, found)?]])
        };
        if new.image.channels != 1 || old.picture.image.channels != 1 {
            return vec![];
        }
        old.corners.iter().filter_map(follow).collect()
    }

    /// Returns the residual of a match, its covariance and its derivatives with respect to (τ, φ); `None` behind the camera.
    fn residual(
        &self,
        [z0, z1]: &[Observation; 2],
        X_01: &Pose,
    ) -> Option<(Vec3, Mat3, Matrix3x6<f64>)> {
        let (p0, R_10) = (point(z0), X_01.rotation.inverse());
        let from = p0 - X_01.position;
        let p1 = R_10 * from;
        let want = seen(&p1)?;
        let r = Vec3::new(z1[0] - want[0], z1[1] - want[1], z1[2] - want[2]);
        let rho = 1.0 / p1.z;
        let [x, y] = [p1.x * rho, p1.y * rho];
        let J = Mat3::new(rho, 0.0, -x * rho, 0.0, rho, -y * rho, 0.0, 0.0, -rho * rho);
        let JR = J * R_10.to_rotation_matrix().matrix();
        // The derivative is ∂p₀/∂ρ₀ = −p₀/ρ₀.
        let g = JR * (-p0 / z0[2]) * self.inverse_depth;
        let own = Vec3::new(self.pixel, self.pixel, self.inverse_depth);
        let sigma = Mat3::from_diagonal(&own.component_mul(&own)) + g * g.transpose();
        // From p₁ = R̂ᵀ exp(−φ)(p₀ − t̂ − τ) follow ∂p₁/∂τ = −R̂ᵀ and ∂p₁/∂φ = R̂ᵀ [p₀ − t̂]×; the residual has
        // the opposite sign.
        let mut A = Matrix3x6::zeros();
        A.fixed_view_mut::<3, 3>(0, 0).copy_from(&JR);
        A.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-(JR * skew(&from))));
        Some((r, sigma, A))
    }

    /// Returns the squared Mahalanobis distance rᵀ Σ⁻¹ r; ∞ behind the camera.
    fn distance(&self, pair: &[Observation; 2], X_01: &Pose) -> f64 {
        let Some((r, sigma, _)) = self.residual(pair, X_01) else { return f64::INFINITY };
        sigma.cholesky().map_or(f64::INFINITY, |c| r.dot(&c.solve(&r)))
    }

    fn agreeing(&self, pairs: &[[Observation; 2]], X_01: &Pose, beyond: f64) -> Vec<usize> {
        (0..pairs.len()).filter(|k| self.distance(&pairs[*k], X_01) < beyond).collect()
    }

    /// Returns the motion with which most matches agree, starting from a guess. `key` seeds the choice of the triples. Returns `None` if too few
    /// matches agree.
    #[must_use]
    pub fn motion(&self, pairs: &[[Observation; 2]], guess: &Pose, key: u64) -> Option<Motion> {
        let n = pairs.len();
        if n < self.fewest.max(3) {
            return None;
        }
        let mut best = (self.agreeing(pairs, guess, LOOSE), *guess);
        for attempt in 0..self.tries {
            let pick = |lane: u32| {
                let u = noise::uniform(key, u64::from(attempt), lane);
                ((u * n as f64) as usize).min(n - 1)
            };
            let three = [pick(0), pick(1), pick(2)];
            if three[0] == three[1] || three[1] == three[2] || three[0] == three[2] {
                continue;
            }
            let Some(X_01) = rigid(three.map(|k| pairs[k])) else { continue };
            let agree = self.agreeing(pairs, &X_01, LOOSE);
            if agree.len() > best.0.len() {
                best = (agree, X_01);
            }
        }
        let (mut agree, mut X_01) = best;
        let mut covariance = Matrix6::identity();
        for _ in 0..ROUNDS {
            if agree.len() < self.fewest {
                return None;
            }
            let mut total = 0.0;
            for _ in 0..STEPS {
                let (mut square, mut side) = (Matrix6::zeros(), Vector6::zeros());
                total = 0.0;
                for k in &agree {
                    let (r, sigma, A) = self.residual(&pairs[*k], &X_01)?;
                    let c = sigma.cholesky()?;
                    square += A.transpose() * c.solve(&A);
                    // The linearised residual is r(τ, φ) = r + A (τ, φ).
                    side -= A.transpose() * c.solve(&r);
                    total += r.dot(&c.solve(&r));
                }
                let c = square.cholesky()?;
                let step = c.solve(&side);
                let turn = Quat::from_scaled_axis(Vec3::new(step[3], step[4], step[5]));
                X_01 = Pose::new(
                    turn * X_01.rotation,
                    X_01.position + Vec3::new(step[0], step[1], step[2]),
                );
                covariance = c.inverse();
                if step.norm() < 1e-9 {
                    break;
                }
            }
            let free = (3 * agree.len()).saturating_sub(6).max(1) as f64;
            covariance *= (total / free).max(1.0);
            let now = self.agreeing(pairs, &X_01, BEYOND);
            if now == agree {
                break;
            }
            agree = now;
        }
        let finite = X_01.is_finite() && covariance.iter().all(|v| v.is_finite());
        let enough = agree.len() >= self.fewest && 2 * agree.len() >= n;
        (finite && enough).then_some(Motion { X_01, covariance, agree: agree.len(), matches: n })
    }
}

/// Returns the rigid motion that minimizes Σ |p₀ − R p₁ − t|² over three points; `None` if they are collinear.
fn rigid(pairs: [[Observation; 2]; 3]) -> Option<Pose> {
    let (a, b) = (pairs.map(|p| point(&p[0])), pairs.map(|p| point(&p[1])));
    let mean = |p: &[Vec3; 3]| (p[0] + p[1] + p[2]) / 3.0;
    let (ma, mb) = (mean(&a), mean(&b));
    let area = |p: &[Vec3; 3]| (p[1] - p[0]).cross(&(p[2] - p[0]));
    let (na, nb) = (area(&a), area(&b));
    let small = |p: &[Vec3; 3], n: &Vec3| {
        n.norm() < 1e-2 * ((p[1] - p[0]).norm_squared() + (p[2] - p[0]).norm_squared())
    };
    if small(&a, &na) || small(&b, &nb) {
        return None;
    }
    // The axes of a plane are the direction of its first side, and its normal.
    let axes = |p: &[Vec3; 3], n: &Vec3| {
        let (x, z) = ((p[1] - p[0]).normalize(), n.normalize());
        [x, z.cross(&x), z]
    };
    let (A, B) = (axes(&a, &na), axes(&b, &nb));
    let start = Quat::from_basis_unchecked(&A) * Quat::from_basis_unchecked(&B).inverse();
    // The rotation within the plane, about its normal, is a least-squares fit.
    let (mut sin, mut cos) = (0.0, 0.0);
    for k in 0..3 {
        let (from, to) = (start * (b[k] - mb), a[k] - ma);
        sin += A[2].dot(&from.cross(&to));
        cos += from.dot(&to);
    }
    let R = Quat::from_scaled_axis(A[2] * sin.atan2(cos)) * start;
    let X = Pose::new(R, ma - R * mb);
    X.is_finite().then_some(X)
}

#[cfg(test)]
mod tests;
