//! `sensors.inclinometer`: roll and pitch of its mount relative to the measured vertical.
//! ```text
//! f = Rᵀ(a − g)                       specific force in the node's axes
//! roll = atan2(f_y, f_z)              turn about x; with y up positive
//! pitch = atan2(−f_x, √(f_y² + f_z²)) turn about y; with x down positive
//! reading = clamp(angle + offset + n, ±range)      n ~ N(0, σ²)
//! ```
//! At rest these are the angles of R = R_z R_y(pitch) R_x(roll). While the mount accelerates, the measured vertical differs from the direction of
//! gravity: 1 m/s² is 5.8° on Earth, 15° on Mars. Roll is undefined if x is vertical.

use linkwork_surroundings::prelude::*;
use std::f64::consts::PI;

/// Errors and range.
#[derive(Params, Clone, Debug)]
pub struct InclinometerParams {
    /// Standard deviation of each angle per sample.
    #[param(unit = "rad", default = 0.0, range = 0.0..)]
    pub sigma: f64,
    /// Constant error of roll and pitch.
    #[param(unit = "rad", default = [0.0, 0.0])]
    pub offset: [f64; 2],
    /// Greatest angle in both directions that it measures.
    #[param(unit = "rad", default = PI, range = 1e-6..=PI)]
    pub range: f64,
    /// Gravity.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// The mount.
#[derive(Ports, Clone, Copy, Debug)]
pub struct InclinometerIn {
    /// Pose and velocity.
    #[port(bind = "mount")]
    pub mount: NodeState,
    /// Acceleration.
    #[port(bind = "mount")]
    pub motion: NodeAccel,
}

/// Readings.
#[derive(Ports, Clone, Copy, Debug)]
pub struct InclinometerOut {
    /// Turn about x.
    #[port("rad")]
    pub roll: f64,
    /// Turn about y.
    #[port("rad")]
    pub pitch: f64,
    /// Both angles are within its range.
    #[port]
    pub valid: bool,
}

/// An inclinometer.
pub struct Inclinometer {
    p: InclinometerParams,
}

/// Roll and pitch relative to the measured vertical, with noise, offset and range; sampled.
#[model("sensors.inclinometer")]
impl Model for Inclinometer {
    type Params = InclinometerParams;
    type FeedthroughInputs = InclinometerIn;
    type FeedthroughOutputs = InclinometerOut;
    fn feedthrough(&self, clock: &Clock, u: &InclinometerIn) -> InclinometerOut {
        let p = &self.p;
        let gravity = p.gravity.free_fall(clock.t, u.mount.position, u.mount.velocity);
        let f = u.mount.rotation.inverse() * (u.motion.linear - gravity);
        let noise = |lane: u32| if p.sigma > 0.0 { p.sigma * clock.normal(lane) } else { 0.0 };
        let roll = f.y.atan2(f.z) + p.offset[0] + noise(0);
        let pitch = (-f.x).atan2(f.y.hypot(f.z)) + p.offset[1] + noise(1);
        InclinometerOut {
            roll: roll.clamp(-p.range, p.range),
            pitch: pitch.clamp(-p.range, p.range),
            valid: roll.abs() <= p.range && pitch.abs() <= p.range,
        }
    }
    fn update(&self) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::testing;

    fn read(sigma: f64, offset: [f64; 2], range: f64, q: Quat, a: Vec3, row: u64) -> [f64; 3] {
        let gravity = testing::gravity(|_, _| Vec3::new(0.0, 0.0, -3.72));
        let p = InclinometerParams { sigma, offset, range, gravity };
        let mount = NodeState { rotation: q, ..NodeState::identity() };
        let motion = NodeAccel { angular: Vec3::zeros(), linear: a };
        let c = Clock::at(0.1 * row as f64, 0.1, row);
        let u = InclinometerIn { mount, motion };
        let y = Inclinometer { p }.feedthrough(&c, &u);
        [y.roll, y.pitch, f64::from(u8::from(y.valid))]
    }

    fn turned(heading: f64, pitch: f64, roll: f64) -> Quat {
        let about = |axis: Vec3, angle: f64| Quat::from_scaled_axis(axis * angle);
        about(Vec3::z(), heading) * about(Vec3::y(), pitch) * about(Vec3::x(), roll)
    }

    #[test]
    fn at_rest_it_shows_roll_and_pitch_whatever_the_heading() {
        for heading in [-2.0, 0.3, 3.0] {
            for (pitch, roll) in [(0.0, 0.0), (0.4, -0.7), (-1.2, 2.5), (0.02, 0.01)] {
                let q = turned(heading, pitch, roll);
                let [r, p, ok] = read(0.0, [0.0; 2], PI, q, Vec3::zeros(), 0);
                assert!((r - roll).abs() < 1e-12 && (p - pitch).abs() < 1e-12 && ok == 1.0);
            }
        }
    }

    #[test]
    fn it_feels_the_acceleration_of_its_mount() {
        // A cart that accelerates along x seems to have its nose up: the pitch about y is negative.
        let [roll, pitch, _] = read(0.0, [0.0; 2], PI, Quat::identity(), Vec3::x(), 0);
        assert!((pitch + (1.0f64 / 3.72).atan()).abs() < 1e-12 && roll == 0.0, "{pitch}");
        let [roll, pitch, _] = read(0.0, [0.0; 2], PI, Quat::identity(), Vec3::y(), 0);
        assert!((roll - (1.0f64 / 3.72).atan()).abs() < 1e-12 && pitch.abs() < 1e-15, "{roll}");
    }

    #[test]
    fn noise_offset_and_range_are_as_written() {
        let (sigma, offset, n) = (2e-3, [0.01, -0.02], 4000_u64);
        let q = turned(0.5, 0.1, -0.2);
        let (mut mean, mut square) = ([0.0; 2], [0.0; 2]);
        for row in 0..n {
            let y = read(sigma, offset, PI, q, Vec3::zeros(), row);
            for (k, truth) in [-0.2, 0.1].into_iter().enumerate() {
                let e = y[k] - truth - offset[k];
                mean[k] += e / n as f64;
                square[k] += e * e / n as f64;
            }
        }
        for k in 0..2 {
            // The bounds are four standard errors of a mean and of a variance.
            assert!(mean[k].abs() < 4.0 * sigma / (n as f64).sqrt(), "{mean:?}");
            let ratio = square[k] / (sigma * sigma);
            assert!((ratio - 1.0).abs() < 4.0 * (2.0 / n as f64).sqrt(), "{ratio}");
        }
        let [roll, pitch, ok] = read(0.0, [0.0; 2], 0.3, turned(0.0, 0.1, -0.5), Vec3::zeros(), 0);
        assert_eq!((roll, ok), (-0.3, 0.0));
        assert!((pitch - 0.1).abs() < 1e-12);
    }
}
