//! `sensors.star_tracker`: attitude of its body against the stars, with noise, while it turns slowly.
//! ```text
//! q_s = q exp(n)      n ~ N(0, σ²) about each axis of the node: x, y across the boresight z, and z about it
//! fix                 |ω| ≤ rate_max: faster, stars are streaks
//! ```
//! W has the axes of the catalogue of stars. Planets, Moon and Sun in the field of view are not looked for.

use linkwork_runtime::prelude::*;

/// Noise and rate.
#[derive(Params, Clone, Debug)]
pub struct StarTrackerParams {
    /// Standard deviation about x, y and z of the node.
    #[param(unit = "rad", default = Vec3::new(4e-5, 4e-5, 2e-4))]
    pub sigma: Vec3,
    /// Greatest rate at which it has a fix.
    #[param(unit = "rad/s", default = 0.0262, range = 0.0..)]
    pub rate_max: f64,
}

/// The mount.
#[derive(Ports, Clone, Copy, Debug)]
pub struct StarTrackerIn {
    /// Node with the axes of the body whose attitude is wanted; z is the boresight.
    #[port(bind = "mount")]
    pub mount: NodeState,
}

/// Reading.
#[derive(Ports, Clone, Copy, Debug)]
pub struct StarTrackerOut {
    /// Attitude, node to W; without a fix the identity.
    #[port]
    pub attitude: Quat,
    /// The attitude is a measurement.
    #[port]
    pub fix: bool,
}

/// A star tracker.
pub struct StarTracker {
    p: StarTrackerParams,
}

/// Attitude against the stars with white noise, without a fix above a rate; sampled.
#[model("sensors.star_tracker")]
impl Model for StarTracker {
    const INERTIAL: bool = true;
    type Params = StarTrackerParams;
    type Ud = StarTrackerIn;
    type Yd = StarTrackerOut;
    fn build(p: StarTrackerParams) -> Result<Self, BuildError> {
        if p.sigma.iter().any(|s| !(*s >= 0.0)) {
            return Err(BuildError::new("a standard deviation is below 0")
                .help("write three numbers from 0 up")
                .at("sigma"));
        }
        Ok(StarTracker { p })
    }
    fn direct(&self, c: &Clock, _: &(), _: &(), u: &StarTrackerIn) -> StarTrackerOut {
        let fix = u.mount.angular.norm() <= self.p.rate_max;
        if !fix {
            return StarTrackerOut { attitude: Quat::identity(), fix };
        }
        let noise = Vec3::new(c.normal(0), c.normal(1), c.normal(2)).component_mul(&self.p.sigma);
        StarTrackerOut { attitude: u.mount.rotation * Quat::from_scaled_axis(noise), fix }
    }
    fn update(&self, _: &Clock, _: &(), _: &(), _: &()) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(p: &StarTrackerParams, row: u64, angular: Vec3, q: Quat) -> StarTrackerOut {
        let m = StarTracker::build(p.clone()).unwrap();
        let mount = NodeState { rotation: q, angular, ..NodeState::identity() };
        m.direct(&Clock::at(0.1 * row as f64, 0.1, row), &(), &(), &StarTrackerIn { mount }, &())
    }

    #[test]
    fn its_errors_have_the_deviations_of_its_axes() {
        let sigma = Vec3::new(3e-5, 5e-5, 3e-4);
        let p = StarTrackerParams { sigma, rate_max: 0.02 };
        let q = Quat::from_scaled_axis(Vec3::new(1.1, -0.4, 2.0));
        let (mut mean, mut square) = (Vec3::zeros(), Vec3::zeros());
        let count = 4000;
        for row in 0..count {
            let y = read(&p, row, Vec3::zeros(), q);
            assert!(y.fix);
            let e = (q.inverse() * y.attitude).scaled_axis();
            mean += e / count as f64;
            square += e.component_mul(&e) / count as f64;
        }
        for k in 0..3 {
            // Four standard errors of a mean and of a variance.
            assert!(mean[k].abs() < 4.0 * sigma[k] / (count as f64).sqrt(), "{mean}");
            let ratio = square[k] / (sigma[k] * sigma[k]);
            assert!((ratio - 1.0).abs() < 4.0 * (2.0 / count as f64).sqrt(), "{k}: {ratio}");
        }
    }

    #[test]
    fn above_its_rate_it_has_no_fix_and_nonsense_is_refused() {
        let p = StarTrackerParams { sigma: Vec3::zeros(), rate_max: 0.02 };
        let q = Quat::from_scaled_axis(Vec3::new(0.3, 0.2, -0.1));
        let slow = read(&p, 1, Vec3::new(0.0, 0.019, 0.0), q);
        assert!(slow.fix && slow.attitude == q);
        let fast = read(&p, 1, Vec3::new(0.0, 0.021, 0.0), q);
        assert!(!fast.fix && fast.attitude == Quat::identity());
        let sigma = Vec3::new(1e-5, -1e-5, 1e-4);
        let e = StarTracker::build(StarTrackerParams { sigma, rate_max: 0.1 }).err().unwrap();
        assert!(e.param.as_deref() == Some("sigma") && e.help.is_some());
    }
}
