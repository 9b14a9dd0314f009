//! `sensors.imu`: gyroscopes and accelerometers with bias, white noise, random walk, scale and misalignment.
//! ```text
//! m_i = (1 + s_i) (v + μ × v)_i + b_i + n_i    i: axis; v: turn rate, or specific force f = Rᵀ(a − g), in the sensor's frame;
//!                                         g: of free fall where it is, as it moves; turn rate and a against inertial space
//! n ~ N/√Δt          white noise of density N  (Allan deviation N/√τ)
//! b' = b + K √Δt w   random walk of density K   (Allan deviation K √(τ/3))
//! b  + B √(ln 10/π) Σ x_k,  x_k' = e^(−Δt/T_k) x_k + √(1 − e^(−2Δt/T_k)) w,  T_k = 1, 10 … 10⁴ s:
//!                    instability B, noise 1/f within 2 % from 3 to 3000 s (Allan deviation √(2 ln 2/π) B, flat)
//! ```
//! y_k = y_(k−1) + (1 − e^(−2π B Δt)) (m_k − y_(k−1)),  y_0 = m_0      with a `bandwidth` B: a digital low-pass of first order
//! reading = clamp(y, ±range), to the next multiple of the resolution
//! At rest the accelerometer reads +g upwards. Turn-on bias and scale error of each axis are drawn from their standard deviations with the run's
//! seed, and affect all samples from the first one on.

use linkwork_surroundings::prelude::*;

/// Grade of the instrument.
#[derive(Params, Clone, Copy, Debug, PartialEq)]
pub enum Grade {
    /// No errors.
    Ideal,
    /// LN-200S class (MER, MSL): 0.07 °/√h, turn-on bias 1 °/h; 35 µg/√Hz, turn-on bias 300 µg.
    Ln200s,
    /// Navigation grade, MIMU class: 0.005 °/√h, turn-on bias 0.005 °/h; turn-on bias 100 µg.
    Mimu,
    /// MEMS, ADIS16448 class: 0.66 °/√h, turn-on bias 0.5 °/s, 14.5 °/h in a run; 230 µg/√Hz, turn-on bias 20 mg, 0.25 mg in a run.
    Mems,
}

/// Errors of one triad, SI units of its quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Density of the white noise, unit/√Hz.
    pub white: f64,
    /// Density of the bias's random walk, unit/√s.
    pub walk: f64,
    /// Instability of the bias, unit.
    pub instability: f64,
    /// Standard deviation of the turn-on bias, unit.
    pub bias: f64,
    /// Standard deviation of the scale error.
    pub scale: f64,
}

/// Standard gravity, m/s².
const G: f64 = 9.80665;

/// Ratio of the lowest point of the Allan deviation to the instability, √(2 ln 2/π).
const FLAT: f64 = 0.664_282_470_3;

/// Errors of the gyroscopes (rad/s) and the accelerometers (m/s²) of a grade. They are typical values for the class, not values of a
/// data sheet. The bias that is drawn when the unit is turned on differs from the stability in a run, which is the lowest point of the Allan
/// deviation; for MEMS the first is a hundred times the second. The grades `ln200s` and `mimu` have no instability.
pub fn errors_of(grade: Grade) -> (Errors, Errors) {
    let none = Errors::default();
    let per_root_hour = 1f64.to_radians() / 60.0;
    let per_hour = 1f64.to_radians() / 3600.0;
    match grade {
        Grade::Ideal => (Errors::default(), Errors::default()),
        Grade::Ln200s => (
            Errors { white: 0.07 * per_root_hour, walk: 1e-8, bias: per_hour, scale: 1e-4, ..none },
            Errors { white: 35e-6 * G, walk: 1e-6, bias: 300e-6 * G, scale: 3e-4, ..none },
        ),
        Grade::Mimu => (
            Errors {
                white: 0.005 * per_root_hour,
                walk: 1e-10,
                bias: 0.005 * per_hour,
                scale: 1e-6,
                ..none
            },
            Errors { white: 5e-6 * G, walk: 1e-8, bias: 100e-6 * G, scale: 1e-4, ..none },
        ),
        Grade::Mems => (
            Errors {
                white: 0.66 * per_root_hour,
                walk: 4e-6,
                instability: 14.5 * per_hour / FLAT,
                bias: 0.5f64.to_radians(),
                scale: 3e-3,
            },
            Errors {
                white: 230e-6 * G,
                walk: 3e-5,
                instability: 0.25e-3 * G / FLAT,
                bias: 20e-3 * G,
                scale: 3e-3,
            },
        ),
    }
}

/// Grade and misalignment; written densities and instabilities replace the grade's.
#[derive(Params, Clone, Debug)]
pub struct ImuParams {
    /// Grade of the instrument.
    #[param(default = Grade::Ln200s)]
    pub grade: Grade,
    /// White noise of the gyroscopes, rad/s/√Hz.
    #[param(default = None, range = 0.0..)]
    pub gyro_white: Option<f64>,
    /// Random walk of the gyroscopes' bias, rad/s/√s.
    #[param(default = None, range = 0.0..)]
    pub gyro_walk: Option<f64>,
    /// Instability of the gyroscopes' bias; the flat part of its Allan deviation is 0.664 times this value.
    #[param(unit = "rad/s", default = None, range = 0.0..)]
    pub gyro_instability: Option<f64>,
    /// White noise of the accelerometers, m/s²/√Hz.
    #[param(default = None, range = 0.0..)]
    pub accel_white: Option<f64>,
    /// Random walk of the accelerometers' bias, m/s²/√s.
    #[param(default = None, range = 0.0..)]
    pub accel_walk: Option<f64>,
    /// Instability of the accelerometers' bias.
    #[param(unit = "m/s^2", default = None, range = 0.0..)]
    pub accel_instability: Option<f64>,
    /// Greatest turn rate that an axis measures; default: no limit.
    #[param(unit = "rad/s", range = 1e-9..)]
    pub gyro_range: Option<f64>,
    /// Greatest specific force that an axis measures; default: no limit.
    #[param(unit = "m/s^2", range = 1e-9..)]
    pub accel_range: Option<f64>,
    /// Resolution of the turn rates, or of the angles of `imu_increments`; 0: no quantization.
    #[param(default = 0.0, range = 0.0..)]
    pub gyro_resolution: f64,
    /// Resolution of the specific forces (m/s²), or of the velocities of `imu_increments` (m/s); 0: no quantization.
    #[param(default = 0.0, range = 0.0..)]
    pub accel_resolution: f64,
    /// Frequency at which the low-pass filter of the samples attenuates by 3 dB; default: no filter. `imu_increments` has no such filter.
    #[param(unit = "1/s")]
    pub bandwidth: Option<f64>,
    /// Misalignment of both triads as a small rotation in the sensor's frame.
    #[param(unit = "rad", default = Vec3::zeros())]
    pub misalignment: Vec3,
    /// Gravity.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
    /// The world; if W is a rotating site, gyroscopes measure its rotation, too.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
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
    /// An axis is beyond its range.
    #[port]
    pub saturated: bool,
}

/// Biases and filters.
#[derive(State, Clone, Copy, Debug)]
pub struct ImuState {
    /// Random walk of the gyroscopes' bias.
    #[port("rad/s")]
    pub gyro: Vec3,
    /// Random walk of the accelerometers' bias.
    #[port("m/s^2")]
    pub accel: Vec3,
    /// Parts of the instability of both triads, by time constant, in units of its spread.
    #[port("1")]
    pub unstable: [f64; 6 * SCALES],
    /// The turn-on bias of both triads in units of its spread.
    #[port("1")]
    pub first: [f64; 6],
    /// The scale error of both triads in units of its spread.
    #[port("1")]
    pub scale: [f64; 6],
    /// These have been drawn.
    #[port("1")]
    pub drawn: bool,
    /// Turn rate after the low-pass filter.
    #[port("rad/s")]
    pub smooth_rate: Vec3,
    /// Specific force after the low-pass filter.
    #[port("m/s^2")]
    pub smooth_force: Vec3,
}

/// Time constants T_k of the parts of an instability: a decade from one to the next, s.
const TIMES: [f64; SCALES] = [1.0, 10.0, 100.0, 1e3, 1e4];
const SCALES: usize = 5;

/// Lanes of noise: white of both triads, walks, turn-on biases, the parts of the instability, their beginning, scale errors.
const TURN_ON: u32 = 12;
const UNSTABLE: u32 = 18;
const BEGINNING: u32 = UNSTABLE + 6 * SCALES as u32;
const SCALE: u32 = BEGINNING + 6 * SCALES as u32;

fn normals(c: &Clock, lane: u32) -> Vec3 {
    Vec3::new(c.normal(lane), c.normal(lane + 1), c.normal(lane + 2))
}

/// Gyroscopes and accelerometers with their errors.
pub(crate) struct Triads {
    p: ImuParams,
    /// Angular velocity of W in inertial space, rad/s, W.
    turning: Vec3,
    gyro: Errors,
    accel: Errors,
}

impl Triads {
    pub(crate) fn new(p: ImuParams) -> Triads {
        let (mut gyro, mut accel) = errors_of(p.grade);
        gyro.white = p.gyro_white.unwrap_or(gyro.white);
        gyro.walk = p.gyro_walk.unwrap_or(gyro.walk);
        gyro.instability = p.gyro_instability.unwrap_or(gyro.instability);
        accel.white = p.accel_white.unwrap_or(accel.white);
        accel.walk = p.accel_walk.unwrap_or(accel.walk);
        accel.instability = p.accel_instability.unwrap_or(accel.instability);
        let site = p.world.as_ref().and_then(|w| w.axes().site());
        Triads { turning: site.map_or(Vec3::zeros(), |s| s.omega()), p, gyro, accel }
    }

    /// Returns turn rate relative to inertial space (rad/s) and specific force (m/s²), sensor's frame.
    fn truth(&self, t: f64, u: &ImuIn) -> (Vec3, Vec3) {
        let to_sensor = u.mount.rotation.inverse();
        let gravity = self.p.gravity.free_fall(t, u.mount.position, u.mount.velocity);
        (to_sensor * (u.mount.angular + self.turning), to_sensor * (u.motion.linear - gravity))
    }

    /// Returns the state at a sample; at the first sample the constant errors are drawn.
    pub(crate) fn drawn(&self, c: &Clock, d: &ImuState) -> ImuState {
        if d.drawn {
            return *d;
        }
        let unstable = |k: usize| {
            let e = if k < 3 * SCALES { &self.gyro } else { &self.accel };
            if e.instability > 0.0 { c.normal(BEGINNING + k as u32) } else { 0.0 }
        };
        ImuState {
            unstable: std::array::from_fn(unstable),
            first: std::array::from_fn(|k| c.normal(TURN_ON + k as u32)),
            scale: std::array::from_fn(|k| c.normal(SCALE + k as u32)),
            drawn: true,
            ..*d
        }
    }

    /// Returns the outputs of both triads without white noise, rad/s and m/s².
    pub(crate) fn felt(&self, t: f64, d: &ImuState, u: &ImuIn) -> (Vec3, Vec3) {
        let (rate, force) = self.truth(t, u);
        let bias = |e: &Errors, walk: Vec3, triad: usize| {
            let first = Vec3::from_column_slice(&d.first[3 * triad..3 * triad + 3]);
            let parts = d.unstable[3 * SCALES * triad..3 * SCALES * (triad + 1)].chunks_exact(3);
            let unstable: Vec3 = parts.map(Vec3::from_column_slice).sum();
            let spread = e.instability * (10f64.ln() / std::f64::consts::PI).sqrt();
            walk + first * e.bias + unstable * spread
        };
        let bent = |e: &Errors, v: Vec3, triad: usize| {
            let scale = Vec3::from_column_slice(&d.scale[3 * triad..3 * triad + 3]) * e.scale;
            let v = v + self.p.misalignment.cross(&v);
            v + v.component_mul(&scale)
        };
        (
            bent(&self.gyro, rate, 0) + bias(&self.gyro, d.gyro, 0),
            bent(&self.accel, force, 1) + bias(&self.accel, d.accel, 1),
        )
    }

    /// Returns the white noise of both triads as a mean over a sample, rad/s and m/s².
    pub(crate) fn noise(&self, c: &Clock) -> (Vec3, Vec3) {
        let of = |e: &Errors, lane: u32| match e.white > 0.0 && c.dt > 0.0 {
            true => normals(c, lane) * (e.white / c.dt.sqrt()),
            false => Vec3::zeros(),
        };
        (of(&self.gyro, 0), of(&self.accel, 3))
    }

    /// Returns turn rate (rad/s) and specific force (m/s²) of a sample after the low-pass filter, before range and resolution.
    fn smooth(&self, c: &Clock, d: &ImuState, u: &ImuIn) -> (Vec3, Vec3) {
        let now = self.drawn(c, d);
        let ((rate, force), (a, b)) = (self.felt(c.t, &now, u), self.noise(c));
        let (rate, force) = (rate + a, force + b);
        // The filter does not have a state before the first sample.
        let Some(B) = self.p.bandwidth.filter(|_| d.drawn) else { return (rate, force) };
        let share = -f64::exp_m1(-std::f64::consts::TAU * B * c.dt.max(0.0));
        let through = |before: Vec3, x: Vec3| before + (x - before) * share;
        (through(d.smooth_rate, rate), through(d.smooth_force, force))
    }

    /// Limits the readings to their ranges; returns also whether both were within.
    pub(crate) fn limited(&self, rate: Vec3, force: Vec3) -> (Vec3, Vec3, bool) {
        let cut = |v: Vec3, most: Option<f64>| most.map_or(v, |m| v.map(|x| x.clamp(-m, m)));
        let (a, b) = (cut(rate, self.p.gyro_range), cut(force, self.p.accel_range));
        (a, b, a != rate || b != force)
    }

    /// Rounds the readings to multiples of the resolutions.
    pub(crate) fn stepped(&self, rate: Vec3, force: Vec3) -> (Vec3, Vec3) {
        let step = |v: Vec3, q: f64| if q > 0.0 { v.map(|x| (x / q).round() * q) } else { v };
        (step(rate, self.p.gyro_resolution), step(force, self.p.accel_resolution))
    }

    /// The biases a sample later.
    pub(crate) fn later(&self, c: &Clock, d: &ImuState) -> ImuState {
        let step = c.dt.max(0.0).sqrt();
        let d = self.drawn(c, d);
        let unstable = |k: usize| {
            let e = if k < 3 * SCALES { &self.gyro } else { &self.accel };
            if !(e.instability > 0.0) {
                return 0.0;
            }
            let now = d.unstable[k];
            let x = c.dt / TIMES[k % (3 * SCALES) / 3];
            (-x).exp() * now + (-f64::exp_m1(-2.0 * x)).sqrt() * c.normal(UNSTABLE + k as u32)
        };
        ImuState {
            gyro: d.gyro + normals(c, 6) * (self.gyro.walk * step),
            accel: d.accel + normals(c, 9) * (self.accel.walk * step),
            unstable: std::array::from_fn(unstable),
            ..d
        }
    }
}

/// An inertial measurement unit.
pub struct Imu {
    triads: Triads,
}

/// Gyroscopes and accelerometers with the errors of their grade; sampled.
#[model("sensors.imu")]
impl Model for Imu {
    type Params = ImuParams;
    type FeedthroughInputs = ImuIn;
    type FeedthroughOutputs = ImuOut;
    type DiscreteState = ImuState;
    fn build(p: ImuParams) -> Result<Self, BuildError> {
        if p.bandwidth.is_some_and(|b| !(b > 0.0)) {
            let help = "write a frequency above 0, such as \"100 Hz\", or remove `bandwidth`";
            return Err(BuildError::new("the bandwidth is not above 0").help(help).at("bandwidth"));
        }
        Ok(Imu { triads: Triads::new(p) })
    }
    fn feedthrough(&self, clock: &Clock, d: &ImuState, u: &ImuIn) -> ImuOut {
        let (rate, force) = self.triads.smooth(clock, d, u);
        let (rate, force, saturated) = self.triads.limited(rate, force);
        let (rate, force) = self.triads.stepped(rate, force);
        ImuOut { rate, force, saturated }
    }
    fn update(&self, clock: &Clock, d: &ImuState, u: &ImuIn) -> ImuState {
        let (smooth_rate, smooth_force) = match self.triads.p.bandwidth {
            Some(_) => self.triads.smooth(clock, d, u),
            None => (Vec3::zeros(), Vec3::zeros()),
        };
        ImuState { smooth_rate, smooth_force, ..self.triads.later(clock, d) }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use linkwork_surroundings::testing;

    fn imu(grade: Grade, white: Option<f64>, walk: Option<f64>) -> Imu {
        let p = ImuParams {
            grade,
            gyro_white: white,
            gyro_walk: walk,
            gyro_instability: Some(0.0),
            accel_white: white,
            accel_walk: walk,
            accel_instability: Some(0.0),
            gyro_range: None,
            accel_range: None,
            gyro_resolution: 0.0,
            accel_resolution: 0.0,
            bandwidth: None,
            misalignment: Vec3::zeros(),
            gravity: testing::gravity(|_, _| Vec3::new(0.0, 0.0, -3.72)),
            world: None,
        };
        Imu::build(p).unwrap()
    }

    fn at_rest() -> ImuIn {
        let motion = NodeAccel { angular: Vec3::zeros(), linear: Vec3::zeros() };
        ImuIn { mount: NodeState::identity(), motion }
    }

    /// Returns a stationary series of the gyro's x axis.
    fn series(imu: &Imu, n: u64, dt: f64) -> Vec<f64> {
        let mut d = ImuState::zero();
        (0..n)
            .map(|k| {
                let c = Clock::at(k as f64 * dt, dt, k);
                let y = imu.feedthrough(&c, &d, &at_rest());
                d = imu.update(&c, &d, &at_rest());
                y.rate.x
            })
            .collect()
    }

    /// Returns the overlapping Allan deviation over clusters of `m` samples.
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
        let y = imu(Grade::Ideal, None, None).feedthrough(
            &Clock::at(0.0, 0.01, 0),
            &ImuState::zero(),
            &at_rest(),
        );
        assert_eq!((y.rate, y.force), (Vec3::zeros(), Vec3::new(0.0, 0.0, 3.72)));
    }

    #[test]
    fn readings_are_in_the_sensors_frame() {
        let mut u = at_rest();
        u.mount.rotation = Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::FRAC_PI_2);
        u.mount.angular = Vec3::new(0.0, 0.0, 0.5);
        let c = Clock::at(0.0, 0.01, 0);
        let y = imu(Grade::Ideal, None, None).feedthrough(&c, &ImuState::zero(), &u);
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

    /// Reference: σ² = (2 ln 2/π) B² for every cluster time.
    #[test]
    fn instability_has_a_flat_allan_deviation() {
        let b = 3e-5;
        let mut m = imu(Grade::Ideal, Some(0.0), Some(0.0));
        m.triads.gyro.instability = b;
        let y = series(&m, 400_000, 1.0);
        let flat = (2.0 * 2f64.ln() / std::f64::consts::PI).sqrt() * b;
        for cluster in [10, 30, 100, 300] {
            let got = allan(&y, cluster);
            assert!((got / flat - 1.0).abs() < 0.08, "{cluster} s: {got} {flat}");
        }
        // The spread over many seeds is as wide at the first sample as at later ones.
        let c =
            |key: u64, n: u64| Clock { t: n as f64, dt: 1.0, n, key, sampled: false, span: None };
        let spread = |samples: u64| {
            let all = (0..2000).map(|key| {
                let mut d = ImuState::zero();
                for n in 0..samples {
                    d = m.update(&c(key, n), &d, &at_rest());
                }
                m.triads.felt(0.0, &d, &at_rest()).0.x.powi(2)
            });
            (all.sum::<f64>() / 2000.0).sqrt()
        };
        let width = b * (5.0 * 10f64.ln() / std::f64::consts::PI).sqrt();
        assert!((spread(1) / width - 1.0).abs() < 0.06, "{} {width}", spread(1));
        assert!((spread(40) / width - 1.0).abs() < 0.06, "{} {width}", spread(40));
    }

    #[test]
    fn grades_carry_a_bias_of_their_size() {
        let i = imu(Grade::Ln200s, Some(0.0), Some(0.0));
        let y = series(&i, 10, 0.01);
        let one = 1f64.to_radians() / 3600.0;
        assert!(y[0] != 0.0 && y[0].abs() < 5.0 * one && y[0] == y[5] && y[5] == y[9], "{y:?}");
    }

    /// A sine passes with 1/√2 of its amplitude at the bandwidth; white noise of the two-sided density N has the standard deviation N √(π B) after
    /// the filter.
    #[test]
    fn a_bandwidth_takes_what_is_fast() {
        let (dt, B, white) = (1e-4, 20.0, 1e-3);
        let mut m = imu(Grade::Ideal, Some(0.0), Some(0.0));
        m.triads.p.bandwidth = Some(B);
        let mut d = ImuState::zero();
        let mut most = 0f64;
        for k in 0..20_000_u64 {
            let c = Clock::at(k as f64 * dt, dt, k);
            let mut u = at_rest();
            u.mount.angular.x = (std::f64::consts::TAU * B * c.t).sin();
            let y = m.feedthrough(&c, &d, &u);
            d = m.update(&c, &d, &u);
            most = if k > 10_000 { most.max(y.rate.x) } else { most };
        }
        assert!((most / 0.5f64.sqrt() - 1.0).abs() < 0.01, "{most}");
        m.triads.gyro.white = white;
        let y = series(&m, 400_000, dt);
        let spread = (y.iter().map(|x| x * x).sum::<f64>() / y.len() as f64).sqrt();
        let want = white * (std::f64::consts::PI * B).sqrt();
        assert!((spread / want - 1.0).abs() < 0.03, "{spread} {want}");
    }

    #[test]
    fn readings_stay_in_the_range_and_have_steps() {
        let mut m = imu(Grade::Ideal, Some(0.0), Some(0.0));
        let mut u = at_rest();
        u.mount.angular = Vec3::new(0.26, -7.0, 0.0);
        let read = |m: &Imu| m.feedthrough(&Clock::at(0.0, 0.01, 0), &ImuState::zero(), &u);
        assert!(!read(&m).saturated);
        (m.triads.p.gyro_range, m.triads.p.gyro_resolution) = (Some(5.0), 0.1);
        let y = read(&m);
        assert!((y.rate - Vec3::new(0.3, -5.0, 0.0)).norm() < 1e-12 && y.saturated, "{}", y.rate);
        (m.triads.p.gyro_range, m.triads.p.accel_range) = (None, Some(3.0));
        let y = read(&m);
        assert!(y.force == Vec3::new(0.0, 0.0, 3.0) && y.saturated, "{}", y.force);
    }

    /// Over many seeds the scale errors of the axes have their spread about zero, and are independent.
    #[test]
    fn scale_errors_are_of_each_axis_and_seed() {
        let m = imu(Grade::Mems, Some(0.0), Some(0.0));
        let mut u = at_rest();
        u.mount.angular = Vec3::repeat(1.0);
        let n = 4000_u32;
        let (mut mean, mut square, mut product) = (Vec3::zeros(), Vec3::zeros(), 0.0);
        for key in 0..u64::from(n) {
            let c = Clock { t: 0.0, dt: 0.1, n: 0, key, sampled: true, span: None };
            let still = m.feedthrough(&c, &ImuState::zero(), &at_rest()).rate;
            let s = m.feedthrough(&c, &ImuState::zero(), &u).rate - still - Vec3::repeat(1.0);
            mean += s / f64::from(n);
            square += s.component_mul(&s) / f64::from(n);
            product += s.x * s.y / f64::from(n);
        }
        let spread = 3e-3;
        assert!(mean.amax() < 4.0 * spread / f64::from(n).sqrt(), "{mean}");
        for k in 0..3 {
            assert!((square[k].sqrt() / spread - 1.0).abs() < 0.05, "{square}");
        }
        assert!((product / (spread * spread)).abs() < 0.07, "{product}");
    }
}
