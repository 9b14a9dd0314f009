//! `sensors.imu`: gyroscopes and accelerometers with bias, white noise, random walk, scale and misalignment.
//! ```text
//! m = (1 + s) (v + μ × v) + b + n        v: turn rate, or specific force f = Rᵀ(a − g), in the sensor's frame;
//!                                         g: of free fall where it is, as it moves; turn rate and a against inertial space
//! n ~ N/√Δt          white noise of density N  (Allan deviation N/√τ)
//! b' = b + K √Δt w   random walk of density K   (Allan deviation K √(τ/3))
//! ```
//! At rest the accelerometer reads +g upwards. The first bias is drawn from its spread by the run's seed.

use linkwork_runtime::prelude::*;

/// Grade of the instrument.
#[derive(Params, Clone, Copy, Debug, PartialEq)]
pub enum Grade {
    /// No errors.
    Ideal,
    /// LN-200S class (MER, MSL): 0.07 °/√h, 1 °/h, 35 µg/√Hz, 300 µg.
    Ln200s,
    /// ADIS16448-class MEMS: 0.66 °/√h, 14.5 °/h, 230 µg/√Hz, 3 mg.
    Mems,
}

/// Errors of one triad, SI units of its quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Density of the white noise, unit/√Hz.
    pub white: f64,
    /// Density of the bias's random walk, unit/√s.
    pub walk: f64,
    /// Spread of the first bias, unit.
    pub bias: f64,
    /// Scale error.
    pub scale: f64,
}

/// Standard gravity, m/s².
const G: f64 = 9.80665;

/// Errors of the gyroscopes (rad/s) and the accelerometers (m/s²) of a grade. Random walks and scale errors
/// are typical values for the class, not of a data sheet.
pub fn errors_of(grade: Grade) -> (Errors, Errors) {
    let per_root_hour = 1f64.to_radians() / 60.0;
    let per_hour = 1f64.to_radians() / 3600.0;
    match grade {
        Grade::Ideal => (Errors::default(), Errors::default()),
        Grade::Ln200s => (
            Errors { white: 0.07 * per_root_hour, walk: 1e-8, bias: per_hour, scale: 1e-4 },
            Errors { white: 35e-6 * G, walk: 1e-6, bias: 300e-6 * G, scale: 3e-4 },
        ),
        Grade::Mems => (
            Errors { white: 0.66 * per_root_hour, walk: 4e-6, bias: 14.5 * per_hour, scale: 3e-3 },
            Errors { white: 230e-6 * G, walk: 3e-5, bias: 3e-3 * G, scale: 3e-3 },
        ),
    }
}

/// Grade and misalignment; written densities replace the grade's.
#[derive(Params, Clone, Debug)]
pub struct ImuParams {
    /// Grade of the instrument.
    #[param(default = Grade::Ln200s)]
    pub grade: Grade,
    /// White noise of the gyroscopes, rad/s/√Hz.
    #[param(default = None)]
    pub gyro_white: Option<f64>,
    /// Random walk of the gyroscopes' bias, rad/s/√s.
    #[param(default = None)]
    pub gyro_walk: Option<f64>,
    /// White noise of the accelerometers, m/s²/√Hz.
    #[param(default = None)]
    pub accel_white: Option<f64>,
    /// Random walk of the accelerometers' bias, m/s²/√s.
    #[param(default = None)]
    pub accel_walk: Option<f64>,
    /// Misalignment of both triads as a small rotation in the sensor's frame.
    #[param(unit = "rad", default = Vec3::zeros())]
    pub misalignment: Vec3,
    /// Gravity.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// The mount.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ImuIn {
    /// Pose and velocity.
    #[port(bind = "mount")]
    pub mount: NodeState,
    /// Acceleration.
    #[port(bind = "mount")]
    pub motion: NodeAccel,
}

/// Readings in the sensor's frame.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ImuOut {
    /// Turn rate.
    #[port("rad/s")]
    pub rate: Vec3,
    /// Specific force.
    #[port("m/s^2")]
    pub force: Vec3,
}

/// Biases.
#[derive(State, Clone, Copy, Debug)]
pub struct ImuState {
    /// Walk of the gyroscopes' bias.
    #[port("rad/s")]
    pub gyro: Vec3,
    /// Walk of the accelerometers' bias.
    #[port("m/s^2")]
    pub accel: Vec3,
    /// The first bias of both triads in units of its spread.
    #[port("1")]
    pub first: [f64; 6],
    /// The first bias has been drawn.
    #[port("1")]
    pub drawn: bool,
}

/// An inertial measurement unit.
pub struct Imu {
    p: ImuParams,
    gyro: Errors,
    accel: Errors,
}

fn normals(c: &Clock, lane: u32) -> Vec3 {
    Vec3::new(c.normal(lane), c.normal(lane + 1), c.normal(lane + 2))
}

impl Imu {
    fn read(&self, e: &Errors, c: &Clock, lane: u32, v: Vec3, bias: Vec3) -> Vec3 {
        let turned = v + self.p.misalignment.cross(&v);
        let noise = if e.white > 0.0 && c.dt > 0.0 {
            normals(c, lane) * (e.white / c.dt.sqrt())
        } else {
            Vec3::zeros()
        };
        turned * (1.0 + e.scale) + bias + noise
    }
}

/// Gyroscopes and accelerometers with the errors of their grade; sampled.
#[model("sensors.imu")]
impl Model for Imu {
    type Params = ImuParams;
    type Ud = ImuIn;
    type Yd = ImuOut;
    type D = ImuState;
    fn build(p: ImuParams) -> Result<Self, BuildError> {
        let (mut gyro, mut accel) = errors_of(p.grade);
        gyro.white = p.gyro_white.unwrap_or(gyro.white);
        gyro.walk = p.gyro_walk.unwrap_or(gyro.walk);
        accel.white = p.accel_white.unwrap_or(accel.white);
        accel.walk = p.accel_walk.unwrap_or(accel.walk);
        Ok(Imu { p, gyro, accel })
    }
    fn direct(&self, c: &Clock, _: &(), d: &ImuState, u: &ImuIn) -> ImuOut {
        let to_sensor = u.mount.rotation.inverse();
        let gravity = self.p.gravity.free_fall(c.t, u.mount.position, u.mount.velocity);
        let turning = self.p.gravity.site().map_or(Vec3::zeros(), |s| s.omega());
        let first = |k: usize| Vec3::new(d.first[k], d.first[k + 1], d.first[k + 2]);
        let rate = to_sensor * (u.mount.angular + turning);
        let force = to_sensor * (u.motion.linear - gravity);
        ImuOut {
            rate: self.read(&self.gyro, c, 0, rate, d.gyro + first(0) * self.gyro.bias),
            force: self.read(&self.accel, c, 3, force, d.accel + first(3) * self.accel.bias),
        }
    }
    fn update(&self, c: &Clock, _: &(), d: &ImuState, _: &()) -> ImuState {
        let step = c.dt.max(0.0).sqrt();
        ImuState {
            gyro: d.gyro + normals(c, 6) * (self.gyro.walk * step),
            accel: d.accel + normals(c, 9) * (self.accel.walk * step),
            first: if d.drawn { d.first } else { std::array::from_fn(|k| c.normal(12 + k as u32)) },
            drawn: true,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::sync::Arc;

    struct Mars;
    impl Gravity for Mars {
        fn acceleration(&self, _: f64, _: Vec3) -> Vec3 {
            Vec3::new(0.0, 0.0, -3.72)
        }
    }

    fn imu(grade: Grade, white: Option<f64>, walk: Option<f64>) -> Imu {
        let p = ImuParams {
            grade,
            gyro_white: white,
            gyro_walk: walk,
            accel_white: white,
            accel_walk: walk,
            misalignment: Vec3::zeros(),
            gravity: Handle::new("gravity", Arc::new(Mars) as Arc<dyn Gravity>),
        };
        Imu::build(p).unwrap()
    }

    fn at_rest() -> ImuIn {
        let motion = NodeAccel { angular: Vec3::zeros(), linear: Vec3::zeros() };
        ImuIn { mount: NodeState::identity(), motion }
    }

    /// Stationary series of the gyro's x axis.
    fn series(imu: &Imu, n: u64, dt: f64) -> Vec<f64> {
        let mut d = ImuState::zero();
        (0..n)
            .map(|k| {
                let c = Clock::at(k as f64 * dt, dt, k);
                let y = imu.direct(&c, &(), &d, &at_rest(), &());
                d = imu.update(&c, &(), &d, &(), &at_rest(), &mut ());
                y.rate.x
            })
            .collect()
    }

    /// Overlapping Allan deviation over clusters of `m` samples.
    fn allan(y: &[f64], m: usize) -> f64 {
        let mut sums = vec![0.0];
        for v in y {
            sums.push(sums[sums.len() - 1] + v);
        }
        let terms = y.len() - 2 * m + 1;
        let square: f64 = (0..terms)
            .map(|k| ((sums[k + 2 * m] - 2.0 * sums[k + m] + sums[k]) / m as f64).powi(2))
            .sum();
        (square / (2.0 * terms as f64)).sqrt()
    }

    #[test]
    fn at_rest_it_feels_the_ground_push_up() {
        let y = imu(Grade::Ideal, None, None).direct(
            &Clock::at(0.0, 0.01, 0),
            &(),
            &ImuState::zero(),
            &at_rest(),
            &(),
        );
        assert_eq!((y.rate, y.force), (Vec3::zeros(), Vec3::new(0.0, 0.0, 3.72)));
    }

    #[test]
    fn readings_are_in_the_sensors_frame() {
        let mut u = at_rest();
        u.mount.rotation = Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::FRAC_PI_2);
        u.mount.angular = Vec3::new(0.0, 0.0, 0.5);
        let c = Clock::at(0.0, 0.01, 0);
        let y = imu(Grade::Ideal, None, None).direct(&c, &(), &ImuState::zero(), &u, &());
        assert!((y.force - Vec3::new(0.0, 3.72, 0.0)).norm() < 1e-12, "{}", y.force);
        assert!((y.rate - Vec3::new(0.0, 0.5, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn white_noise_has_its_allan_deviation_and_slope() {
        let white = 2e-4;
        let y = series(&imu(Grade::Ideal, Some(white), Some(0.0)), 200_000, 0.01);
        let (a1, a10) = (allan(&y, 100), allan(&y, 1000));
        println!("N = {white}: Allan deviation {a1} at 1 s, {a10} at 10 s");
        assert!((a1 / white - 1.0).abs() < 0.03, "{a1}");
        let slope = (allan(&y, 100) / allan(&y, 10)).log10();
        assert!((slope + 0.5).abs() < 0.05, "{slope}");
    }

    #[test]
    fn random_walk_has_its_allan_deviation() {
        let walk = 1e-3;
        let y = series(&imu(Grade::Ideal, Some(0.0), Some(walk)), 200_000, 0.01);
        for m in [100, 400] {
            let tau = 0.01 * m as f64;
            let want = walk * (tau / 3.0).sqrt();
            let got = allan(&y, m);
            assert!((got / want - 1.0).abs() < 0.1, "{tau}: {got} {want}");
        }
    }

    #[test]
    fn grades_carry_a_bias_of_their_size() {
        let i = imu(Grade::Ln200s, Some(0.0), Some(0.0));
        let y = series(&i, 10, 0.01);
        let one = 1f64.to_radians() / 3600.0;
        assert!(y[0] == 0.0 && y[5] != 0.0 && y[5].abs() < 5.0 * one && y[5] == y[9], "{y:?}");
    }
}
