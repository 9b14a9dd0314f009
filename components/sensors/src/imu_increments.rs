//! `sensors.imu_increments`: an integrating inertial unit: increments of angle and velocity from sample to sample, for strapdown navigation.
//! ```text
//! Δθ = ∫ m_g dt,  Δv = ∫ m_a dt        over the sample that ends now; m_g, m_a: what the triads feel, sensor's frame, with all errors of `sensors.imu`
//! n ~ N √Δt                            white noise of density N: random walk of the angle and of the velocity
//! ```
//! The integrals are states of the run's integrator, so that they include the motion within a sample. The components of an increment are not a
//! rotation vector. Navigation software must correct coning (∫ ω × ∫ω) and sculling (a force that rotates with the unit), as with a real unit:
//! ```text
//! two samples 1, 2:   θ = Δθ₁ + Δθ₂, v = Δv₁ + Δv₂
//!                     turn θ + ⅔ Δθ₁ × Δθ₂
//!                     gain v + ½ θ × v + ⅙ θ × (θ × v) + ⅔ (Δθ₁ × Δv₂ + Δv₁ × Δθ₂)      in axes of the beginning
//! ```
//! Between samples the outputs grow from the noise to the next increment; a part that reads them at ticks of the same rate receives complete
//! increments.

use crate::imu::{ImuIn, ImuParams, ImuState, Triads};
use linkwork_runtime::prelude::*;

/// Increments in the sensor's frame.
#[derive(Ports, Clone, Copy, Debug)]
pub struct IncrementsOut {
    /// Angles Δθ gained since the last sample.
    #[port("rad")]
    pub angle: Vec3,
    /// Velocity Δv gained since the last sample, without gravity.
    #[port("m/s")]
    pub velocity: Vec3,
}

/// The integrals since the start.
#[derive(State, Clone, Copy, Debug)]
pub struct Integrals {
    /// Integral of the turn rate.
    #[port("rad")]
    pub angle: Vec3,
    /// Integral of the specific force.
    #[port("m/s")]
    pub velocity: Vec3,
}

/// Errors, and the sums of all increments up to the last sample.
#[derive(State, Clone, Copy, Debug)]
pub struct Sampled {
    /// Biases.
    #[port(group)]
    pub errors: ImuState,
    /// Sum of the angles up to the last sample.
    #[port("rad")]
    pub angle_before: Vec3,
    /// Sum of the velocities up to the last sample.
    #[port("m/s")]
    pub velocity_before: Vec3,
    /// Sum of the noise of the angles, this sample's included.
    #[port("rad")]
    pub angle_noise: Vec3,
    /// Sum of the noise of the velocities, this sample's included.
    #[port("m/s")]
    pub velocity_noise: Vec3,
}

/// An integrating inertial unit.
pub struct ImuIncrements {
    triads: Triads,
}

impl ImuIncrements {
    /// Returns the integrals with their noise, rounded to steps; the remainder is included in a later increment.
    fn counts(&self, x: &Integrals, d: &Sampled) -> (Vec3, Vec3) {
        self.triads.stepped(x.angle + d.angle_noise, x.velocity + d.velocity_noise)
    }
}

/// Gyroscopes and accelerometers that output increments of angle and velocity from sample to sample.
#[model("sensors.imu_increments")]
impl Model for ImuIncrements {
    type Params = ImuParams;
    type FeedthroughInputs = ImuIn;
    type Outputs = IncrementsOut;
    type State = Integrals;
    type DiscreteState = Sampled;
    fn build(p: ImuParams) -> Result<Self, BuildError> {
        if p.bandwidth.is_some() {
            let fact = "`bandwidth` is written, but an integrating unit has no low-pass filter for its samples";
            let help = "remove `bandwidth`, or use `sensors.imu`";
            return Err(BuildError::new(fact).help(help).at("bandwidth"));
        }
        Ok(ImuIncrements { triads: Triads::new(p) })
    }
    fn outputs(&self, x: &Integrals, d: &Sampled) -> IncrementsOut {
        let (angle, velocity) = self.counts(x, d);
        IncrementsOut { angle: angle - d.angle_before, velocity: velocity - d.velocity_before }
    }
    fn derivatives(&self, clock: &Clock, d: &Sampled, u: &ImuIn) -> Integrals {
        // Nothing is integrated before the first sample, at which the errors are drawn.
        let (angle, velocity) = self.triads.felt(clock.t, &d.errors, u);
        let (angle, velocity, _) = self.triads.limited(angle, velocity);
        Integrals { angle, velocity }
    }
    fn update(&self, clock: &Clock, x: &Integrals, d: &Sampled) -> Sampled {
        let (rate, force) = self.triads.noise(clock);
        let (angle_before, velocity_before) = self.counts(x, d);
        Sampled {
            errors: self.triads.later(clock, &d.errors),
            angle_before,
            velocity_before,
            angle_noise: d.angle_noise + rate * clock.dt,
            velocity_noise: d.velocity_noise + force * clock.dt,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imu::Grade;
    use linkwork_surroundings::testing;

    #[test]
    fn white_noise_walks_with_the_root_of_time() {
        let (white, dt, n) = (3e-4, 0.02, 500);
        let m = ImuIncrements::build(ImuParams {
            grade: Grade::Ideal,
            gyro_white: Some(white),
            gyro_walk: None,
            gyro_instability: None,
            accel_white: Some(10.0 * white),
            accel_walk: None,
            accel_instability: None,
            gyro_range: None,
            accel_range: None,
            gyro_resolution: 0.0,
            accel_resolution: 0.0,
            bandwidth: None,
            misalignment: Vec3::zeros(),
            gravity: testing::gravity(|_, _| Vec3::new(0.0, 0.0, -9.81)),
            world: None,
        })
        .unwrap();
        let motion = NodeAccel { angular: Vec3::zeros(), linear: Vec3::new(0.0, 0.0, 0.0) };
        let u = ImuIn { mount: NodeState::identity(), motion };
        let (mut angle, mut velocity) = (0.0, 0.0);
        for key in 0..400 {
            let (mut x, mut d) = (Integrals::zero(), Sampled::zero());
            let (mut sum, mut push) = (0.0, 0.0);
            for k in 0..=n {
                let c = Clock { t: k as f64 * dt, dt, n: k, key, sampled: false, span: None };
                let y = m.outputs(&x, &d);
                // The interval of the first sample has a length of zero.
                if k > 0 {
                    sum += y.angle.x;
                    push += y.velocity.z - 9.81 * dt;
                } else {
                    assert_eq!((y.angle, y.velocity), (Vec3::zeros(), Vec3::zeros()));
                }
                d = m.update(&c, &x, &d);
                let rate = m.derivatives(&c, &d, &u);
                x.angle += rate.angle * dt;
                x.velocity += rate.velocity * dt;
            }
            angle += sum * sum;
            velocity += push * push;
        }
        let want = white * (n as f64 * dt).sqrt();
        let (angle, velocity) = ((angle / 400.0).sqrt(), (velocity / 400.0).sqrt());
        assert!((angle / want - 1.0).abs() < 0.12, "{angle} {want}");
        assert!((velocity / (10.0 * want) - 1.0).abs() < 0.12, "{velocity}");
    }
}
