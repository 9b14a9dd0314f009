//! `control.attitude_filter`: attitude and gyro bias from a gyro and a star tracker (multiplicative extended Kalman filter).
//! ```text
//! between stars   ω = ½ (ω_m + ω_m of the sample before) − b     q ← q exp(ω Δt)      P ← Φ P Φᵀ + Q
//!                 Φ = [exp(−ω Δt)  −1 Δt; 0  1]         Q = diag(N² Δt, K² Δt)
//! at a star fix   δ = 2 vec(q⁻¹ q_s)    S = P_θθ + R    K = P [1 0]ᵀ S⁻¹    P ← (1 − K H) P (1 − K H)ᵀ + K R Kᵀ
//!                 q ← q exp(K_θ δ)      b ← b + K_b δ
//! ```
//! q turns body to inertial axes: the axes of W, or those of the stars if W is a site; errors are small rotations in body axes. A fix that deviates
//! by more than `gate` standard deviations is rejected and counted. N: angular random walk (rad/√s), K: rate random walk (rad/s/√s).

use linkwork_runtime::prelude::*;
use linkwork_spatial::nalgebra::{SMatrix, SVector};

type M6 = SMatrix<f64, 6, 6>;
type M3 = SMatrix<f64, 3, 3>;

/// Noise and start.
#[derive(Params, Clone, Debug)]
pub struct FilterParams {
    /// Angular random walk N of the gyro, rad/√s.
    #[param(range = 0.0..)]
    pub random_walk: f64,
    /// Rate random walk K of its bias, rad/s/√s.
    #[param(default = 0.0, range = 0.0..)]
    pub bias_walk: f64,
    /// Standard deviation of the star tracker across its boresight (x, y) and about it (z), body axes.
    #[param(unit = "rad", default = Vec3::new(4e-5, 4e-5, 2e-4))]
    pub star: Vec3,
    /// Standard deviation of the attitude at the start.
    #[param(unit = "rad", default = 0.1, range = 1e-12..)]
    pub attitude_start: f64,
    /// Standard deviation of the bias at the start.
    #[param(unit = "rad/s", default = 1e-4, range = 0.0..)]
    pub bias_start: f64,
    /// Gate in standard deviations above which a fix is rejected; 0: no gate.
    #[param(default = 0.0, range = 0.0..)]
    pub gate: f64,
}

/// Measurements.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FilterIn {
    /// Rate measured by the gyro, body axes.
    #[port("rad/s")]
    pub gyro: Vec3,
    /// Attitude measured by the star tracker, body to inertial axes.
    #[port]
    pub star: Quat,
    /// The star tracker has a fix at this sample.
    #[port]
    pub fix: bool,
}

/// Estimate.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FilterOut {
    /// Estimated attitude, body to inertial axes.
    #[port]
    pub attitude: Quat,
    /// Estimated rate without the bias, body axes.
    #[port("rad/s")]
    pub rate: Vec3,
    /// Bias of the gyro.
    #[port("rad/s")]
    pub bias: Vec3,
    /// Standard deviation of the attitude about each body axis.
    #[port("rad")]
    pub deviation: Vec3,
    /// Number of rejected fixes.
    #[port("1")]
    pub rejected: f64,
}

/// State of the filter.
#[derive(State, Clone, Copy, Debug)]
pub struct Estimate {
    /// Attitude, body to inertial axes.
    #[port]
    pub attitude: Quat,
    /// Bias of the gyro.
    #[port("rad/s")]
    pub bias: Vec3,
    /// Covariance of attitude error and bias, by columns.
    #[port("1")]
    pub covariance: [f64; 36],
    /// Number of rejected fixes.
    #[port("1")]
    pub rejected: f64,
    /// Number of samples.
    #[port("1")]
    pub samples: f64,
    /// Gyro rate at the last sample, body axes.
    #[port("rad/s")]
    pub gyro: Vec3,
    /// Number of accepted fixes.
    #[port("1")]
    pub fixes: f64,
}

/// The filter.
pub struct AttitudeFilter {
    p: FilterParams,
}

impl AttitudeFilter {
    /// Returns the estimate at this sample: propagated from the last one and corrected by a fix.
    fn step(&self, c: &Clock, d: &Estimate, u: &FilterIn) -> Estimate {
        let p = &self.p;
        let mut out = *d;
        let mut cov = M6::from_column_slice(&d.covariance);
        // The first sample does not have a previous one to propagate from.
        if d.samples > 0.5 {
            // The gyro measures instantaneous rates; the mean of both ends approximates the rate in between.
            let w = (d.gyro + u.gyro) * 0.5 - d.bias;
            out.attitude = d.attitude * Quat::from_scaled_axis(w * c.dt);
            let mut phi = M6::identity();
            let turn = Quat::from_scaled_axis(-w * c.dt).to_rotation_matrix();
            phi.fixed_view_mut::<3, 3>(0, 0).copy_from(turn.matrix());
            phi.fixed_view_mut::<3, 3>(0, 3).copy_from(&(M3::identity() * -c.dt));
            let (n, k) = (p.random_walk.powi(2) * c.dt, p.bias_walk.powi(2) * c.dt);
            let noise = SVector::<f64, 6>::new(n, n, n, k, k, k);
            cov = phi * cov * phi.transpose() + M6::from_diagonal(&noise);
        }
        if u.fix && d.fixes < 0.5 {
            // The first fix sets the attitude, however far it is from the initial value.
            out.attitude = u.star;
            cov.fixed_view_mut::<3, 6>(0, 0).fill(0.0);
            cov.fixed_view_mut::<6, 3>(0, 0).fill(0.0);
            (0..3).for_each(|k| cov[(k, k)] = p.star[k] * p.star[k]);
            out.fixes = 1.0;
        } else if u.fix {
            let q = out.attitude.inverse() * u.star;
            let delta = q.imag() * if q.w < 0.0 { -2.0 } else { 2.0 };
            let r = M3::from_diagonal(&p.star.component_mul(&p.star));
            let s = cov.fixed_view::<3, 3>(0, 0) + r;
            if let Some(inverse) = s.try_inverse() {
                let far = delta.dot(&(inverse * delta)).sqrt();
                if p.gate > 0.0 && far > p.gate {
                    out.rejected += 1.0;
                } else {
                    out.fixes += 1.0;
                    let gain = cov.fixed_view::<6, 3>(0, 0) * inverse;
                    let mend = gain * delta;
                    let turn = Vec3::new(mend[0], mend[1], mend[2]);
                    out.attitude *= Quat::from_scaled_axis(turn);
                    out.bias += Vec3::new(mend[3], mend[4], mend[5]);
                    let mut keep = M6::identity();
                    let less = keep.fixed_view::<6, 3>(0, 0) - gain;
                    keep.fixed_view_mut::<6, 3>(0, 0).copy_from(&less);
                    cov = keep * cov * keep.transpose() + gain * r * gain.transpose();
                }
            }
        }
        cov = (cov + cov.transpose()) * 0.5;
        out.covariance.copy_from_slice(cov.as_slice());
        out.samples += 1.0;
        out.gyro = u.gyro;
        out
    }
}

/// Attitude and gyro bias from a gyro and a star tracker, by a multiplicative extended Kalman filter; sampled.
#[model("control.attitude_filter")]
impl Model for AttitudeFilter {
    type Params = FilterParams;
    type FeedthroughInputs = FilterIn;
    type FeedthroughOutputs = FilterOut;
    type DiscreteState = Estimate;
    fn build(p: FilterParams) -> Result<Self, BuildError> {
        if p.star.iter().any(|s| !(*s > 0.0)) {
            return Err(BuildError::new(
                "the star tracker needs noise: a standard deviation is not positive",
            )
            .help("write three standard deviations above 0")
            .at("star"));
        }
        Ok(AttitudeFilter { p })
    }
    fn init_d(&self) -> Estimate {
        let (a, b) = (self.p.attitude_start.powi(2), self.p.bias_start.powi(2));
        let mut covariance = [0.0; 36];
        for k in 0..6 {
            covariance[7 * k] = if k < 3 { a } else { b };
        }
        let attitude = Quat::identity();
        let (rejected, samples, fixes) = (0.0, 0.0, 0.0);
        let (bias, gyro) = (Vec3::zeros(), Vec3::zeros());
        Estimate { attitude, bias, covariance, rejected, samples, gyro, fixes }
    }
    fn feedthrough(&self, clock: &Clock, d: &Estimate, u: &FilterIn) -> FilterOut {
        let e = self.step(clock, d, u);
        let variance = [0, 7, 14].map(|k| e.covariance[k].max(0.0).sqrt());
        FilterOut {
            attitude: e.attitude,
            rate: u.gyro - e.bias,
            bias: e.bias,
            deviation: Vec3::from(variance),
            rejected: e.rejected,
        }
    }
    fn update(&self, clock: &Clock, d: &Estimate, u: &FilterIn) -> Estimate {
        self.step(clock, d, u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_runtime::noise;

    fn filter(gate: f64) -> AttitudeFilter {
        AttitudeFilter::build(FilterParams {
            random_walk: 1e-5,
            bias_walk: 1e-8,
            star: Vec3::new(5e-5, 5e-5, 2e-4),
            attitude_start: 0.05,
            bias_start: 1e-3,
            gate,
        })
        .unwrap()
    }

    /// Three numbers of a normal distribution.
    fn normal(n: u64, stream: u64) -> Vec3 {
        let key = noise::key(7, "filter");
        Vec3::from_fn(|k, _| {
            let uniform = |lane: u64| {
                let bits = noise::hash(
                    [key, n, stream, k as u64, lane]
                        .iter()
                        .flat_map(|x| x.to_le_bytes())
                        .collect::<Vec<u8>>(),
                );
                (bits >> 11) as f64 / (1u64 << 53) as f64
            };
            let (a, b) = (uniform(0).max(1e-300), uniform(1));
            (-2.0 * a.ln()).sqrt() * (2.0 * std::f64::consts::PI * b).cos()
        })
    }

    /// Rotation about one axis with 0.02 rad/s² from rest, sampled at 2 Hz by a gyro that measures the instantaneous rate: after 10 s the angle is 1
    /// rad. With the rate at the ends of the intervals alone it would be 1.05 rad.
    #[test]
    fn a_body_that_turns_up_has_turned_by_the_mean_rate() {
        let (m, dt) = (filter(0.0), 0.5);
        let mut d = m.init_d();
        for n in 0..=20u64 {
            let (t, star) = (n as f64 * dt, Quat::identity());
            let u = FilterIn { gyro: Vec3::z() * (0.02 * t), star, fix: n == 0 };
            d = m.update(&Clock::at(t, dt, n), &d, &u);
        }
        let angle = d.attitude.scaled_axis();
        assert!((angle - Vec3::z()).norm() < 1e-12, "{angle}");
    }

    /// A rotating body that is measured by a noisy gyro with a bias and a noisy star tracker at 2 Hz.
    fn run(gate: f64, wild: bool) -> (Vec<f64>, Vec<f64>, f64, f64) {
        let (m, dt) = (filter(gate), 0.1);
        let bias = Vec3::new(3e-4, -5e-4, 2e-4);
        let mut truth = Quat::from_scaled_axis(Vec3::new(0.03, -0.02, 0.04));
        let mut d = m.init_d();
        let (mut errors, mut claims) = (Vec::new(), Vec::new());
        let mut bias_error = 0.0;
        for n in 0..6000u64 {
            let t = n as f64 * dt;
            let rate =
                |t: f64| Vec3::new(0.01 * (0.02 * t).sin(), 0.008, -0.006 * (0.03 * t).cos());
            let w = rate(t);
            if n > 0 {
                truth *= Quat::from_scaled_axis(rate(t - 0.5 * dt) * dt);
            }
            let gyro = w + bias + normal(n, 1) * (1e-5 / dt.sqrt());
            let mut noise = normal(n, 2).component_mul(&m.p.star);
            if wild && n % 97 == 50 {
                noise += Vec3::x() * 0.01;
            }
            let u = FilterIn { gyro, star: truth * Quat::from_scaled_axis(noise), fix: n % 5 == 0 };
            let c = Clock::at(t, dt, n);
            d = m.update(&c, &d, &u);
            let e = (d.attitude.inverse() * truth).scaled_axis();
            if n > 3000 {
                errors.push(e.x * e.x + e.y * e.y);
                claims.push(d.covariance[0] + d.covariance[7]);
            }
            bias_error = (d.bias - bias).norm();
        }
        (errors, claims, bias_error, d.rejected)
    }

    fn mean(x: &[f64]) -> f64 {
        x.iter().sum::<f64>() / x.len() as f64
    }

    #[test]
    fn it_finds_attitude_and_bias_and_knows_how_well() {
        let (errors, claims, bias, _) = run(0.0, false);
        // The error must be smaller than the error of one fix, and agree with the estimated
        // covariance.
        assert!(mean(&errors).sqrt() < 0.6 * 5e-5 * 2f64.sqrt(), "{:e}", mean(&errors).sqrt());
        let ratio = mean(&errors) / mean(&claims);
        assert!((0.5..2.0).contains(&ratio), "{ratio}");
        assert!(bias < 1e-5, "{bias:e}");
    }

    #[test]
    fn a_gate_keeps_wild_fixes_out() {
        let (open, _, _, none) = run(0.0, true);
        let (gated, _, _, some) = run(6.0, true);
        assert!(none == 0.0 && some > 10.0, "{some}");
        assert!(mean(&gated) < 0.2 * mean(&open), "{:e} {:e}", mean(&gated), mean(&open));
    }

    #[test]
    fn a_covariance_stays_one_and_noise_free_stars_are_refused() {
        let m = filter(0.0);
        let mut d = m.init_d();
        for n in 0..2000 {
            let u = FilterIn { gyro: Vec3::new(0.3, -0.2, 0.5), star: d.attitude, fix: n % 3 == 0 };
            d = m.update(&Clock::at(n as f64 * 0.1, 0.1, n), &d, &u);
            let p = M6::from_column_slice(&d.covariance);
            assert!(p.cholesky().is_some() && p == p.transpose(), "sample {n}");
        }
        let p = FilterParams { star: Vec3::new(1e-5, 0.0, 1e-5), ..m.p.clone() };
        assert!(AttitudeFilter::build(p).is_err_and(|e| e.param.as_deref() == Some("star")));
    }

    #[test]
    fn the_first_fix_is_taken_from_anywhere_and_the_gate_holds_from_then_on() {
        let f = filter(6.0);
        let c = |n: u64| Clock::at(n as f64 * 0.1, 0.1, n);
        let away = Quat::from_axis_angle(&Vec3::x_axis(), 2.0);
        let with = |star: Quat| FilterIn { gyro: Vec3::zeros(), fix: true, star };
        let d = f.update(&c(0), &f.init_d(), &with(away));
        assert!(d.attitude.angle_to(&away) < 1e-12 && d.rejected == 0.0);
        let far = away * Quat::from_axis_angle(&Vec3::z_axis(), 0.1);
        let d = f.update(&c(1), &d, &with(far));
        assert!(d.attitude.angle_to(&away) < 1e-12 && d.rejected == 1.0);
    }
}
