//! `sensors.star_tracker`: attitude of its body relative to the stars, with noise, while the body rotates slowly.
//! ```text
//! q_s = R_IW q exp(n)      n ~ N(0, σ²) about each axis of the node: x, y across the boresight z, and z about it
//! fix                      |ω| ≤ rate_max: faster, stars are streaks; ω: inertial rate
//! ```
//! I has the axes of the catalogue of stars. W is I, or a site on a planet that rotates in I: with `turns: fixed` about its z from `angle` on, with
//! `turns: iau` as in the ICRF. Planets, Moon and Sun in the field of view have no effect.

use linkwork_surroundings::prelude::*;

/// Noise and rate.
#[derive(Params, Clone, Debug)]
pub struct StarTrackerParams {
    /// Standard deviation about x, y and z of the node.
    #[param(unit = "rad", default = Vec3::new(4e-5, 4e-5, 2e-4))]
    pub sigma: Vec3,
    /// Greatest rate at which it has a fix.
    #[param(unit = "rad/s", default = 0.0262, range = 0.0..)]
    pub rate_max: f64,
    /// The world, in which W may be a site.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// The mount.
#[derive(Ports, Clone, Copy, Debug)]
pub struct StarTrackerIn {
    /// Node whose attitude is measured; its z axis is the boresight.
    #[port(bind = "mount")]
    pub mount: NodeState,
}

/// Reading.
#[derive(Ports, Clone, Copy, Debug)]
pub struct StarTrackerOut {
    /// Attitude relative to the stars, node to I; without a fix the identity.
    #[port]
    pub attitude: Quat,
    /// Attitude from node axes to W, for software that knows its site and the time; equal to the other attitude if W is inertial.
    #[port]
    pub in_world: Quat,
    /// The attitude is a measurement.
    #[port]
    pub fix: bool,
}

/// A star tracker.
pub struct StarTracker {
    p: StarTrackerParams,
    site: Option<Site>,
}

/// Attitude relative to the stars with white noise, without a fix above a rate; sampled.
#[model("sensors.star_tracker")]
impl Model for StarTracker {
    type Params = StarTrackerParams;
    type FeedthroughInputs = StarTrackerIn;
    type FeedthroughOutputs = StarTrackerOut;
    fn build(p: StarTrackerParams) -> Result<Self, BuildError> {
        if p.sigma.iter().any(|s| !(*s >= 0.0)) {
            return Err(BuildError::new("a standard deviation is below 0")
                .help("write three values of 0 or more")
                .at("sigma"));
        }
        let site = p.world.as_ref().and_then(|w| w.axes().site());
        Ok(StarTracker { p, site })
    }
    fn feedthrough(&self, clock: &Clock, u: &StarTrackerIn) -> StarTrackerOut {
        let turning = self.site.map_or_else(Vec3::zeros, |s| s.omega());
        let fix = (u.mount.angular + turning).norm() <= self.p.rate_max;
        if !fix {
            let none = Quat::identity();
            return StarTrackerOut { attitude: none, in_world: none, fix };
        }
        let noise = Vec3::new(clock.normal(0), clock.normal(1), clock.normal(2))
            .component_mul(&self.p.sigma);
        let in_world = u.mount.rotation * Quat::from_scaled_axis(noise);
        let attitude = self.site.map_or(in_world, |s| s.to_inertial(clock.t) * in_world);
        StarTrackerOut { attitude, in_world, fix }
    }
    fn update(&self) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(p: &StarTrackerParams, row: u64, angular: Vec3, q: Quat) -> StarTrackerOut {
        let m = StarTracker::build(p.clone()).unwrap();
        let mount = NodeState { rotation: q, angular, ..NodeState::identity() };
        m.feedthrough(&Clock::at(0.1 * row as f64, 0.1, row), &StarTrackerIn { mount })
    }

    #[test]
    fn its_errors_have_the_deviations_of_its_axes() {
        let sigma = Vec3::new(3e-5, 5e-5, 3e-4);
        let p = StarTrackerParams { sigma, rate_max: 0.02, world: None };
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
            // The bounds are four standard errors of a mean and of a variance.
            assert!(mean[k].abs() < 4.0 * sigma[k] / (count as f64).sqrt(), "{mean}");
            let ratio = square[k] / (sigma[k] * sigma[k]);
            assert!((ratio - 1.0).abs() < 4.0 * (2.0 / count as f64).sqrt(), "{k}: {ratio}");
        }
    }

    #[test]
    fn from_a_site_the_stars_turn() {
        let pose =
            linkwork_spatial::Pose::new(Quat::from_euler_angles(0.3, -0.8, 1.1), Vec3::zeros());
        let start = Quat::from_euler_angles(-0.4, 0.2, 0.9);
        let site = Site { pose, rate: 0.015, start };
        let world = Some(linkwork_surroundings::PlainWorld::of_site(4e13, 3e6, site).handle());
        let p = StarTrackerParams { sigma: Vec3::zeros(), rate_max: 0.02, world };
        let q = Quat::from_scaled_axis(Vec3::new(0.3, 0.2, -0.1));
        // The mount is at rest in W for 30 s: relative to the stars the planet has rotated by 0.45 rad
        // about its pole.
        let (a, b) = (read(&p, 0, Vec3::zeros(), q), read(&p, 300, Vec3::zeros(), q));
        let pole = start * Vec3::z();
        let turned = (b.attitude * a.attitude.inverse()).scaled_axis();
        assert!(a.fix && b.fix && (turned - pole * 0.45).norm() < 1e-12, "{turned}");
        assert!(a.attitude.angle_to(&(start * pose.rotation * q)) < 1e-12);
        assert!(a.in_world == q && b.in_world == q);
        // The inertial rate counts: a body at rest relative to the stars has a fix, a body that rotates with the planet or faster has none.
        let omega = site.omega();
        assert!(read(&p, 0, omega * -2.0, q).fix && !read(&p, 0, omega * 0.5, q).fix);
    }

    #[test]
    fn above_its_rate_it_has_no_fix_and_nonsense_is_refused() {
        let p = StarTrackerParams { sigma: Vec3::zeros(), rate_max: 0.02, world: None };
        let q = Quat::from_scaled_axis(Vec3::new(0.3, 0.2, -0.1));
        let slow = read(&p, 1, Vec3::new(0.0, 0.019, 0.0), q);
        assert!(slow.fix && slow.attitude == q);
        let fast = read(&p, 1, Vec3::new(0.0, 0.021, 0.0), q);
        assert!(!fast.fix && fast.attitude == Quat::identity());
        let sigma = Vec3::new(1e-5, -1e-5, 1e-4);
        let p = StarTrackerParams { sigma, rate_max: 0.1, world: None };
        let e = StarTracker::build(p).err().unwrap();
        assert!(e.param.as_deref() == Some("sigma") && e.help.is_some());
    }
}
