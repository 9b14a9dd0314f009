//! `sensors.force_torque`: force and moment through a hinge, as measured by a sensor between a wrist and a tool or between a leg and a foot.
//! ```text
//! reading = clamp((f, n) + offset + noise, ±range)      f, n: force and moment on the body through its hinge, about the origin and in the
//!                                                       axes of the hinge's frame on the body
//! ```
//! Bind `tool` to the body that the sensor carries. Its hinge may be of any kind; a locked one needs `reaction: true`, so that the tool stays a separate body.
//! The reading includes all loads outboard of the hinge: weight, inertia, contacts, loops, other parts.

use linkwork_runtime::prelude::*;

/// Errors of the sensor.
#[derive(Params, Clone, Debug)]
pub struct ForceTorqueParams {
    /// Greatest force on each axis that it measures; default: no limit.
    #[param(unit = "N", range = 1e-9..)]
    pub force_range: Option<f64>,
    /// Greatest moment about each axis that it measures; default: no limit.
    #[param(unit = "N m", range = 1e-9..)]
    pub moment_range: Option<f64>,
    /// Constant error of the force, N.
    #[param(default = [0.0, 0.0, 0.0])]
    pub force_offset: [f64; 3],
    /// Constant error of the moment, N m.
    #[param(default = [0.0, 0.0, 0.0])]
    pub moment_offset: [f64; 3],
    /// Standard deviation of the force on each axis per sample.
    #[param(unit = "N", default = 0.0, range = 0.0..)]
    pub force_sigma: f64,
    /// Standard deviation of the moment about each axis per sample.
    #[param(unit = "N m", default = 0.0, range = 0.0..)]
    pub moment_sigma: f64,
}

/// Load of the hinge.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ForceTorqueIn {
    /// Load of the hinge of the body that the sensor carries.
    #[port(bind = "tool")]
    pub load: HingeLoad,
}

/// Readings.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ForceTorqueOut {
    /// Force on the tool, axes of the hinge's frame on it.
    #[port("N")]
    pub force: Vec3,
    /// Moment on the tool about the origin of that frame.
    #[port("N m")]
    pub torque: Vec3,
    /// All axes are within their ranges.
    #[port]
    pub valid: bool,
}

/// A force-torque sensor.
pub struct ForceTorque {
    p: ForceTorqueParams,
}

/// Force and moment through a hinge, with noise, offset and range; sampled.
#[model("sensors.force_torque")]
impl Model for ForceTorque {
    type Params = ForceTorqueParams;
    type FeedthroughInputs = ForceTorqueIn;
    type FeedthroughOutputs = ForceTorqueOut;
    fn feedthrough(&self, clock: &Clock, u: &ForceTorqueIn) -> ForceTorqueOut {
        let p = &self.p;
        let mut valid = true;
        let mut read = |x: Vec3, offset: [f64; 3], sigma: f64, range: Option<f64>, lane: u32| {
            let range = range.unwrap_or(f64::INFINITY);
            valid &= x.iter().all(|v| v.abs() <= range);
            let noise = |k: u32| if sigma > 0.0 { sigma * clock.normal(lane + k) } else { 0.0 };
            let noise = Vec3::new(noise(0), noise(1), noise(2));
            (x + Vec3::from(offset) + noise).map(|v| v.clamp(-range, range))
        };
        ForceTorqueOut {
            force: read(u.load.force, p.force_offset, p.force_sigma, p.force_range, 0),
            torque: read(u.load.moment, p.moment_offset, p.moment_sigma, p.moment_range, 3),
            valid,
        }
    }
    fn update(&self) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_and_ranges() {
        let p = ForceTorqueParams {
            force_range: Some(15.0),
            moment_range: None,
            force_offset: [0.5, 0.0, -1.0],
            moment_offset: [0.0, 0.1, 0.0],
            force_sigma: 0.2,
            moment_sigma: 0.0,
        };
        let m = ForceTorque { p };
        let load =
            HingeLoad { force: Vec3::new(1.0, -20.0, 3.0), moment: Vec3::new(0.0, 2.0, -1.0) };
        let n = 4000_u32;
        let (mut mean, mut square) = (0.0, 0.0);
        for k in 0..n {
            let c = Clock::at(0.0, 0.1, u64::from(k));
            let y = m.feedthrough(&c, &ForceTorqueIn { load });
            assert_eq!((y.torque, y.valid), (Vec3::new(0.0, 2.1, -1.0), false));
            assert_eq!(y.force.y, -15.0);
            mean += (y.force.x - 1.5) / f64::from(n);
            square += (y.force.x - 1.5).powi(2) / f64::from(n);
        }
        assert!(mean.abs() < 0.2 * 4.0 / f64::from(n).sqrt(), "{mean}");
        assert!((square.sqrt() / 0.2 - 1.0).abs() < 0.05, "{square}");
    }
}
