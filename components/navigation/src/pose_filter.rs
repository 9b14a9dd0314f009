//! Pose of a rover from wheels, gyroscopes, accelerometers, the Sun and visual odometry: an error-state extended Kalman filter.
//! ```text
//! state       p, q (body to W), gyro bias b, slip s, scale error k of visual odometry; p₀, q₀: the pose at the last picture
//! errors      p = p̂ + δp,  q = exp(θ) q̂, both in W; likewise p₀, q₀
//! between     ω = ω_m − b − Rᵀ Ω,  v = [(1 − s) u, 0, 0] + ω × [0, 0, h],  ṗ = R v,  q̇ = ½ q ω;   u: speed of the wheels, h above the ground
//!             δṗ = −[R v]× θ − R x u δs + R n_v,   θ̇ = −Ω × θ − R δb + R n_ω,   ḃ = n_b,   ṡ = −s/τ + n_s
//!             Ω: rotation of W in inertial space, which gyroscopes measure, too
//! camera      t_m = (1 + k) R_C0ᵀ (c − c₀),  R_m = R_C0ᵀ R_C,   c = p + R e,  R_C = R R_BC                      stochastic cloning
//! level       R̂ f − a, averaged, lies along z:   s ≈ z − θ × z         f: specific force, a: change of the wheels' velocity
//! Sun         R̂ s_m ≈ n + n × θ                                         n: direction to the Sun, W
//! ```
//! After Roumeliotis & Burdick, "Stochastic cloning", ICRA 2002, for relative motions between two times; Sola, "Quaternion kinematics for the
//! error-state Kalman filter", 2017, for errors in W. Measurements are whitened by their covariance and processed one scalar at a time. A camera
//! motion whose χ² exceeds the gate is rejected. The variance of the wheel odometry grows with the distance travelled. Rates are means of two
//! samples; their unknown change between samples, Δω Δt/√12, is treated as noise.

use crate::visual_odometry::Motion;
use linkwork_spatial::nalgebra::{Matrix6, Vector6};
use linkwork_spatial::{Mat3, Pose, Quat, Vec3, skew};
use serde::{Deserialize, Serialize};

/// Number of errors of the state.
pub const ERRORS: usize = 17;
/// Indices of δp, θ, δb, δs, δk, δp₀, θ₀.
const P: usize = 0;
const Q: usize = 3;
const B: usize = 6;
const S: usize = 9;
const K: usize = 10;
const P0: usize = 11;
const Q0: usize = 14;

type Matrix = [[f64; ERRORS]; ERRORS];
type Row = [f64; ERRORS];

/// Error models of the instruments that the filter assumes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instruments {
    /// Standard deviation of a reading of the gyroscopes, rad/s.
    pub gyro: f64,
    /// Random walk of their bias, rad/s/√s.
    pub gyro_walk: f64,
    /// Random walk of the wheel odometry: ahead, sideways, up, m/√m.
    pub wheels: Vec3,
    /// Standard deviation of slip, and its time constant (s).
    pub slip: [f64; 2],
    /// Standard deviation of the direction of averaged accelerometers, rad.
    pub level: f64,
    /// Standard deviation of a sun sensor's direction, each of two axes, rad.
    pub sun: f64,
    /// Distance that a turn by one radian counts as in the random walk of the wheel odometry, m.
    pub reach: f64,
    /// Height of the pose's origin above the ground under the wheels, m.
    pub height: f64,
    /// Pose of the camera on the body, X_BC.
    pub eye: Pose,
    /// χ² above which a camera motion is rejected.
    pub gate: f64,
    /// Ω: angular velocity of W in inertial space, W, rad/s.
    pub turning: Vec3,
}

/// Standard deviations at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Position, m.
    pub position: f64,
    /// Roll and pitch, rad.
    pub tilt: f64,
    /// Heading, rad.
    pub heading: f64,
    /// Bias of the gyroscopes, rad/s.
    pub bias: f64,
    /// Scale error of visual odometry.
    pub scale: f64,
}

/// The estimate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseFilter {
    /// Pose of the body in W.
    pub pose: Pose,
    /// Pose of the body in W at the last picture.
    pub before: Pose,
    /// Bias of the gyroscopes, body, rad/s.
    pub bias: Vec3,
    /// Slip of the wheels.
    pub slip: f64,
    /// Scale error of visual odometry.
    pub scale: f64,
    /// Covariance of the errors.
    pub covariance: Matrix,
}

/// Measured rates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rates {
    /// Angular velocity from the gyroscopes, body axes, rad/s.
    pub gyro: Vec3,
    /// Forward speed of the wheels, m/s.
    pub speed: f64,
    /// Change of the angular velocity within the averaging interval, body axes, rad/s.
    pub change: Vec3,
}

impl Rates {
    /// Returns the means of these rates and those of the next sample.
    #[must_use]
    pub fn until(&self, next: &Rates) -> Rates {
        let gyro = (self.gyro + next.gyro) * 0.5;
        Rates { gyro, speed: 0.5 * (self.speed + next.speed), change: next.gyro - self.gyro }
    }
}

impl PoseFilter {
    /// Creates a filter at a pose, with the standard deviations `start` and an initial slip.
    #[must_use]
    pub fn new(pose: Pose, start: &Start, slip: f64) -> Self {
        let mut covariance = [[0.0; ERRORS]; ERRORS];
        let (p, t) = (start.position, start.tilt);
        let all = [p, p, p, t, t, start.heading, start.bias, start.bias, start.bias, slip];
        for (k, sigma) in all.into_iter().chain([start.scale]).enumerate() {
            covariance[k][k] = sigma * sigma;
        }
        let (bias, slip, scale) = (Vec3::zeros(), 0.0, 0.0);
        let mut out = PoseFilter { pose, before: pose, bias, slip, scale, covariance };
        out.remember();
        out
    }

    /// Stores the current pose as the pose of the last picture (stochastic cloning).
    pub fn remember(&mut self) {
        self.before = self.pose;
        for k in 0..6 {
            for j in 0..P0 {
                self.covariance[P0 + k][j] = self.covariance[k][j];
                self.covariance[j][P0 + k] = self.covariance[k][j];
            }
        }
        for k in 0..6 {
            for j in 0..6 {
                self.covariance[P0 + k][P0 + j] = self.covariance[k][j];
            }
        }
    }

    /// Returns the angular velocity relative to W, body axes, rad/s.
    fn over_w(&self, i: &Instruments, rates: &Rates) -> Vec3 {
        rates.gyro - self.bias - self.pose.rotation.inverse() * i.turning
    }

    /// Returns the velocity at these rates, W, m/s.
    #[must_use]
    pub fn velocity(&self, i: &Instruments, rates: &Rates) -> Vec3 {
        let w = self.over_w(i, rates);
        let along = Vec3::new((1.0 - self.slip) * rates.speed, 0.0, 0.0);
        self.pose.rotation * (along + w.cross(&Vec3::new(0.0, 0.0, i.height)))
    }

    /// Predicts the pose after a time (s), without the covariance.
    #[must_use]
    pub fn ahead(&self, i: &Instruments, rates: &Rates, dt: f64) -> Pose {
        let w = self.over_w(i, rates);
        // The step moves along the heading at its middle.
        let half = self.pose.rotation * Quat::from_scaled_axis(w * (0.5 * dt));
        let body = self.pose.rotation.inverse() * self.velocity(i, rates);
        let mut rotation = self.pose.rotation * Quat::from_scaled_axis(w * dt);
        rotation.renormalize();
        Pose::new(rotation, self.pose.position + half * body * dt)
    }

    /// Propagates estimate and covariance by a time (s).
    pub fn go(&mut self, i: &Instruments, rates: &Rates, dt: f64) {
        if !(dt > 0.0) {
            return;
        }
        let R = *self.pose.rotation.to_rotation_matrix().matrix();
        let moved = self.velocity(i, rates) * dt;
        let next = self.ahead(i, rates, dt);
        let keep = (-dt / i.slip[1]).exp();
        // Φ is the identity except for these blocks.
        let to_q = -skew(&moved);
        let to_b = R * -dt;
        let turned = skew(&i.turning) * -dt;
        let to_s = R * Vec3::new(-rates.speed * dt, 0.0, 0.0);
        let rows = |m: &Matrix| {
            let mut out = *m;
            for j in 0..ERRORS {
                for k in 0..3 {
                    let along = |block: &Mat3, at: usize| -> f64 {
                        (0..3).map(|l| block[(k, l)] * m[at + l][j]).sum()
                    };
                    out[P + k][j] += along(&to_q, Q) + to_s[k] * m[S][j];
                    out[Q + k][j] += along(&to_b, B) + along(&turned, Q);
                }
                out[S][j] = keep * m[S][j];
            }
            out
        };
        // Φ P Φᵀ = (Φ (Φ P)ᵀ)ᵀ, and P is symmetric.
        let once = rows(&self.covariance);
        self.covariance = rows(&transposed(&once));
        let way = (rates.speed.abs() + i.reach * self.over_w(i, rates).norm()) * dt;
        let D = Mat3::from_diagonal(&(i.wheels.component_mul(&i.wheels) * way));
        let noise = R * D * R.transpose();
        // A rate that jumps at an unknown instant between two samples has the variance Δω²/12.
        let jump = rates.change.component_mul(&rates.change) / 12.0;
        let D = Mat3::from_diagonal(&(jump.add_scalar(i.gyro * i.gyro) * (dt * dt)));
        let turns = R * D * R.transpose();
        let walk = i.gyro_walk.powi(2) * dt;
        for k in 0..3 {
            for l in 0..3 {
                self.covariance[P + k][P + l] += noise[(k, l)];
                self.covariance[Q + k][Q + l] += turns[(k, l)];
            }
            self.covariance[B + k][B + k] += walk;
        }
        self.covariance[S][S] += i.slip[0].powi(2) * (1.0 - keep * keep);
        self.pose = next;
    }

    /// Returns the estimated pose of the camera in its pose at the last picture.
    #[must_use]
    pub fn expected(&self, i: &Instruments) -> Pose {
        (self.before * i.eye).inverse() * (self.pose * i.eye)
    }

    /// Updates the filter with a camera motion since the last picture. Returns false if the gate rejected it.
    pub fn see(&mut self, i: &Instruments, motion: &Motion) -> bool {
        let (c0, c1) = (self.before * i.eye, self.pose * i.eye);
        let R0 = *c0.rotation.to_rotation_matrix().matrix();
        let D = c1.position - c0.position;
        let [arm0, arm1] = [&self.before, &self.pose].map(|x| x.transform_vector(&i.eye.position));
        let grown = 1.0 + self.scale;
        let t = R0 * motion.X_01.position - D * grown;
        let turn = c0.rotation * motion.X_01.rotation * c1.rotation.inverse();
        let r = turn.scaled_axis();
        let residual = Vector6::new(t.x, t.y, t.z, r.x, r.y, r.z);
        let mut H = [[0.0; ERRORS]; 6];
        let (to_q, to_q0) = (-skew(&arm1), skew(&arm0) + skew(&D));
        for k in 0..3 {
            H[k][P + k] = grown;
            H[k][P0 + k] = -grown;
            H[k][K] = D[k];
            for l in 0..3 {
                H[k][Q + l] = grown * to_q[(k, l)];
                H[k][Q0 + l] = grown * to_q0[(k, l)];
            }
            H[3 + k][Q + k] = 1.0;
            H[3 + k][Q0 + k] = -1.0;
        }
        // The covariance is rotated to W.
        let mut turned = Matrix6::zeros();
        turned.fixed_view_mut::<3, 3>(0, 0).copy_from(&R0);
        turned.fixed_view_mut::<3, 3>(3, 3).copy_from(&R0);
        let noise = turned * motion.covariance * turned.transpose();
        let Some(L) = ((noise + noise.transpose()) * 0.5).cholesky().map(|c| c.l()) else {
            return false;
        };
        let spread = Matrix6::from_fn(|a, b| dot(&H[a], &times(&self.covariance, &H[b]))) + noise;
        let Some(spread) = ((spread + spread.transpose()) * 0.5).cholesky() else { return false };
        if !(residual.dot(&spread.solve(&residual)) <= i.gate) {
            return false;
        }
        // L⁻¹ H and L⁻¹ r are uncorrelated scalar measurements of variance 1.
        let (mut H, mut r) = (H, residual);
        for a in 0..6 {
            for b in 0..a {
                let (done, l) = (H[b], L[(a, b)]);
                (0..ERRORS).for_each(|k| H[a][k] -= l * done[k]);
                r[a] -= l * r[b];
            }
            H[a].iter_mut().for_each(|h| *h /= L[(a, a)]);
            r[a] /= L[(a, a)];
        }
        let all: [(Row, f64); 6] = std::array::from_fn(|a| (H[a], r[a]));
        self.take(&all, 1.0);
        true
    }

    /// Updates the filter with the mean of R̂ f − a over a time, W, m/s².
    pub fn level(&mut self, i: &Instruments, up: &Vec3) {
        let Some(s) = up.try_normalize(1e-6) else { return };
        let (mut x, mut y) = ([0.0; ERRORS], [0.0; ERRORS]);
        (x[Q + 1], y[Q]) = (-1.0, 1.0);
        self.take(&[(x, s.x), (y, s.y)], i.level * i.level);
    }

    /// Updates the filter with the measured direction of the Sun (`seen`, body axes) and its ephemeris direction (`n`, W).
    pub fn sun(&mut self, i: &Instruments, seen: &Vec3, n: &Vec3) {
        let s = self.pose.rotation * seen;
        let other = if n.z.abs() < 0.9 { Vec3::z() } else { Vec3::x() };
        let e1 = n.cross(&other).normalize();
        let e2 = n.cross(&e1);
        let rows = [e1, e2].map(|e| {
            let (mut row, along) = ([0.0; ERRORS], e.cross(n));
            (0..3).for_each(|k| row[Q + k] = along[k]);
            (row, e.dot(&s))
        });
        self.take(&rows, i.sun * i.sun);
    }

    /// Processes scalar measurements r = h δ + noise of equal variance one after another, then corrects the pose.
    fn take(&mut self, numbers: &[(Row, f64)], variance: f64) {
        let mut delta = [0.0; ERRORS];
        for (h, r) in numbers {
            let ph = times(&self.covariance, h);
            let s = dot(h, &ph) + variance;
            let innovation = r - dot(h, &delta);
            for k in 0..ERRORS {
                delta[k] += ph[k] / s * innovation;
            }
            // The update is P − P h hᵀ P/s, which stays symmetric.
            for (k, row) in self.covariance.iter_mut().enumerate() {
                for (j, p) in row.iter_mut().enumerate() {
                    *p -= ph[k] * ph[j] / s;
                }
            }
        }
        let part = |at: usize| Vec3::new(delta[at], delta[at + 1], delta[at + 2]);
        let mend = |pose: &mut Pose, p: usize, q: usize| {
            pose.position += part(p);
            pose.rotation = Quat::from_scaled_axis(part(q)) * pose.rotation;
            pose.rotation.renormalize();
        };
        mend(&mut self.pose, P, Q);
        mend(&mut self.before, P0, Q0);
        self.bias += part(B);
        self.slip += delta[S];
        self.scale += delta[K];
    }

    /// Returns the covariance of x, y (m) and heading (rad).
    #[must_use]
    pub fn planar(&self) -> Mat3 {
        let at = [P, P + 1, Q + 2];
        Mat3::from_fn(|a, b| self.covariance[at[a]][at[b]])
    }
}

fn transposed(m: &Matrix) -> Matrix {
    std::array::from_fn(|k| std::array::from_fn(|j| m[j][k]))
}

fn dot(a: &Row, b: &Row) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn times(m: &Matrix, h: &Row) -> Row {
    std::array::from_fn(|k| dot(&m[k], h))
}

#[cfg(test)]
mod tests;
