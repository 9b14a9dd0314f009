//! `sensors.attitude`: attitude and turn rate of a node, true or with noise; a stand-in for an attitude estimator.
//! ```text
//! R' = R exp(n)      ω' = Rᵀ ω + n_ω          n, n_ω: white, drawn anew for each sample
//! ```

use linkwork_runtime::prelude::*;

/// Noise.
#[derive(Params, Clone, Debug)]
pub struct AttitudeParams {
    /// Standard deviation of the attitude about each axis.
    #[param(unit = "rad", default = 0.0, range = 0.0..)]
    pub rotation_sigma: f64,
    /// Standard deviation of the turn rate about each axis.
    #[param(unit = "rad/s", default = 0.0, range = 0.0..)]
    pub rate_sigma: f64,
}

/// The node.
#[derive(Ports, Clone, Copy, Debug)]
pub struct AttitudeIn {
    /// The node.
    #[port(bind = "mount")]
    pub mount: NodeState,
}

/// Attitude.
#[derive(Ports, Clone, Copy, Debug)]
pub struct AttitudeOut {
    /// Rotation from the axes of the node to W.
    #[port("1")]
    pub rotation: Quat,
    /// Turn rate, axes of the node.
    #[port("rad/s")]
    pub angular: Vec3,
}

/// An attitude sensor.
pub struct Attitude {
    p: AttitudeParams,
}

/// Attitude and turn rate of a node, true or with white noise; sampled.
#[model("sensors.attitude")]
impl Model for Attitude {
    type Params = AttitudeParams;
    type FeedthroughInputs = AttitudeIn;
    type FeedthroughOutputs = AttitudeOut;
    fn feedthrough(&self, clock: &Clock, u: &AttitudeIn) -> AttitudeOut {
        let noise = |first: u32, sigma: f64| match sigma > 0.0 {
            true => {
                Vec3::new(clock.normal(first), clock.normal(first + 1), clock.normal(first + 2))
                    * sigma
            }
            false => Vec3::zeros(),
        };
        let R = u.mount.rotation;
        AttitudeOut {
            rotation: R * Quat::from_scaled_axis(noise(0, self.p.rotation_sigma)),
            angular: R.inverse() * u.mount.angular + noise(3, self.p.rate_sigma),
        }
    }
    fn update(&self) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_tells_attitude_and_rate_with_the_noise_that_it_has() {
        let mount = NodeState {
            position: Vec3::new(1.0, 2.0, 3.0),
            rotation: Quat::from_euler_angles(0.3, -0.2, 1.0),
            angular: Vec3::new(0.1, 0.5, -0.2),
            velocity: Vec3::zeros(),
        };
        let look = |sigma: f64, n: u64| {
            let m =
                Attitude { p: AttitudeParams { rotation_sigma: sigma, rate_sigma: 2.0 * sigma } };
            m.feedthrough(&Clock::at(0.01 * n as f64, 0.01, n), &AttitudeIn { mount })
        };
        let y = look(0.0, 0);
        assert!(y.rotation.angle_to(&mount.rotation) < 1e-12);
        assert!((mount.rotation * y.angular - mount.angular).norm() < 1e-12);
        let (mut turn, mut rate) = (0.0, 0.0);
        for n in 0..2000 {
            let y = look(0.01, n);
            turn += (mount.rotation.inverse() * y.rotation).scaled_axis().norm_squared();
            rate += (y.angular - mount.rotation.inverse() * mount.angular).norm_squared();
        }
        let [turn, rate] = [turn, rate].map(|x: f64| (x / 6000.0).sqrt());
        assert!((turn - 0.01).abs() < 4e-4 && (rate - 0.02).abs() < 8e-4, "{turn} {rate}");
    }
}
