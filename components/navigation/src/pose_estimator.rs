//! `navigation.pose_estimator`: estimates the pose of a rover from wheel odometry, gyroscopes, accelerometers, the Sun and visual odometry.
//! ```text
//! a sample       the filter propagates from the last sample with the means of the rates of both samples   (`pose_filter`)
//! a new picture  propagate to its instant, update with the motion since the last picture, propagate to the sample   (`visual_odometry`)
//! each `period`  update with the mean specific force (level) and with the direction of the Sun, when it is visible
//! outputs        the estimate predicted to the next sample with the rates of this one
//! ```
//! It replaces `sensors.pose` and does not use the true pose: it starts at the parameter `start`, and heights are relative to the start. The change
//! of the wheel velocity is subtracted from the specific force. Pictures come from the field of `pictures` that it binds and need ranges, preferably
//! of a stereo pair (`sensors.camera` with a `baseline`). The camera's pose on the body is a parameter. Without pictures the other sensors are used.
//! `navigation.autonav` uses the output `eye` to place its pictures.

use crate::features::Features;
use crate::pose_filter::{Instruments, PoseFilter, Rates, Start};
use crate::visual_odometry::{Scenery, VisualOdometry};
use linkwork_render::Picture;
use linkwork_runtime::SharedField;
use linkwork_spatial::Pose;
use linkwork_surroundings::prelude::*;
use serde::{Deserialize, Serialize};

/// Parameters: initial pose and error models of the instruments.
#[derive(Params, Clone, Debug)]
pub struct PoseEstimatorParams {
    /// x, y (m, W) and heading (rad) at the start.
    #[param(default = [0.0, 0.0, 0.0])]
    pub start: [f64; 3],
    /// Standard deviation of the position at the start, each axis.
    #[param(unit = "m", default = 0.01, range = 1e-6..)]
    pub start_position: f64,
    /// Standard deviation of the heading at the start.
    #[param(unit = "rad", default = 0.005, range = 1e-6..)]
    pub start_heading: f64,
    /// Height of the pose's origin above the ground under the wheels.
    #[param(unit = "m", default = 0.0, range = 0.0..)]
    pub height: f64,
    /// Position of the camera on the body: ahead, to the left, up.
    #[param(unit = "m", default = [0.0, 0.0, 0.0])]
    pub eye: [f64; 3],
    /// Roll, pitch (down is positive) and yaw of the camera's mount on the body.
    #[param(unit = "rad", default = Vec3::zeros())]
    pub eye_rpy: Vec3,
    /// Baseline of the stereo pair. Default: the camera has true ranges.
    #[param(unit = "m", default = None, range = 1e-4..)]
    pub baseline: Option<f64>,
    /// Standard deviation of a match, pixels.
    #[param(default = 0.2, range = 1e-4..)]
    pub pixel_sigma: f64,
    /// Standard deviation of a disparity, pixels.
    #[param(default = 0.3, range = 1e-4..)]
    pub disparity_sigma: f64,
    /// Standard deviation of the scale error of visual odometry.
    #[param(default = 0.01, range = 0.0..)]
    pub scale_sigma: f64,
    /// Standard deviation of a reading of the gyroscopes: N √f of white noise N (rad/√s) at f readings a second.
    #[param(unit = "rad/s", default = 3e-4, range = 1e-9..)]
    pub gyro_sigma: f64,
    /// Standard deviation of the gyroscope bias at the start.
    #[param(unit = "rad/s", default = 5e-6, range = 1e-12..)]
    pub gyro_bias: f64,
    /// Random walk of the gyroscope bias, rad/s/√s.
    #[param(default = 1e-8, range = 0.0..)]
    pub gyro_walk: f64,
    /// Random walk of the wheel odometry: ahead, sideways and up, m/√m.
    #[param(default = Vec3::new(0.05, 0.05, 0.1))]
    pub wheel_walk: Vec3,
    /// Standard deviation of the wheels' slip.
    #[param(default = 0.05, range = 0.0..)]
    pub slip_sigma: f64,
    /// Time constant of slip.
    #[param(unit = "s", default = 20.0, range = 1e-3..)]
    pub slip_time: f64,
    /// Distance that a turn by one radian counts as in the random walk of the wheel odometry.
    #[param(unit = "m", default = 1.5, range = 0.0..)]
    pub reach: f64,
    /// Standard deviation of the direction of the mean specific force.
    #[param(unit = "rad", default = 0.02, range = 1e-9..)]
    pub level_sigma: f64,
    /// Standard deviation of the sun sensor, each of two axes.
    #[param(unit = "rad", default = 0.0175, range = 1e-9..)]
    pub sun_sigma: f64,
    /// Time between measurements of level and Sun.
    #[param(unit = "s", default = 1.0, range = 1e-3..)]
    pub period: f64,
    /// χ² (six degrees of freedom) above which a camera motion is rejected.
    #[param(default = 40.0, range = 1.0..)]
    pub gate: f64,
    /// The Sun; needed with a sun sensor.
    #[param(service)]
    pub sun: Option<Handle<dyn Sun>>,
    /// The world: gyroscopes on a planet also measure its rotation.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// Sensor readings.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PoseEstimatorIn {
    /// Turn rate of the gyroscopes, body.
    #[port("rad/s")]
    pub gyro: Vec3,
    /// Specific force of the accelerometers, body.
    #[port("m/s^2")]
    pub force: Vec3,
    /// Forward speed from the wheels.
    #[port("m/s")]
    pub speed: f64,
    /// Direction to the Sun, body.
    #[port("1", default = Vec3::zeros())]
    pub sun: Vec3,
    /// The Sun is visible.
    #[port("1", default = false)]
    pub sun_valid: bool,
}

/// Estimated pose.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PoseEstimatorOut {
    /// x in W.
    #[port("m")]
    pub x: f64,
    /// y in W.
    #[port("m")]
    pub y: f64,
    /// Height relative to the start.
    #[port("m")]
    pub z: f64,
    /// Heading from x towards y.
    #[port("rad")]
    pub heading: f64,
    /// Angle of the deck to the horizontal.
    #[port("rad")]
    pub tilt: f64,
    /// Attitude, body to W.
    #[port]
    pub attitude: Quat,
    /// Standard deviation of x, y and heading.
    #[port("1")]
    pub deviation: Vec3,
    /// Covariance of x and y, of x and heading, of y and heading.
    #[port("1")]
    pub covariance: Vec3,
    /// Estimated slip of the wheels; 0 … 1 when driving forward.
    #[port("1")]
    pub slip: f64,
    /// Estimated position of the camera, W.
    #[port("m")]
    pub eye: Vec3,
    /// Estimated attitude of the camera: lens (x right, y down, z ahead) to W.
    #[port]
    pub eye_attitude: Quat,
    /// An estimated camera pose is supplied; always true.
    #[port("1")]
    pub eye_given: bool,
    /// The camera pose is valid: from the second sample on, after the accelerometers have determined roll and pitch.
    #[port("1")]
    pub eye_known: bool,
    /// Number of pictures whose motion was used.
    #[port("1")]
    pub motions: f64,
    /// Number of pictures without a usable motion: too few matches, or rejected by the gate.
    #[port("1")]
    pub lost: f64,
    /// Number of matches that agreed in the last picture.
    #[port("1")]
    pub matches: f64,
}

/// State from sample to sample.
#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Belief {
    picture: View<Picture>,
    filter: Option<PoseFilter>,
    scenery: Option<Scenery>,
    /// Rates of the last sample, and its time (s).
    rates: Rates,
    time: f64,
    /// Estimate predicted to the next sample.
    ahead: Pose,
    /// Start time (s) of the sum of specific force; the sum R̂ f dt and the velocity at the start, W.
    since: f64,
    force: Vec3,
    velocity: Vec3,
    /// Direction of the Sun that was used last.
    sun: Vec3,
    motions: u64,
    lost: u64,
    matches: u64,
}

impl Store for Belief {
    const READS: Option<&'static str> = <View<Picture> as Store>::READS;
    fn see(&mut self, shown: Option<&SharedField>) {
        self.picture.see(shown);
    }
}

/// The filter and its camera.
pub struct PoseEstimator {
    p: PoseEstimatorParams,
    instruments: Instruments,
    start: Start,
}

/// Standard deviation of roll and pitch at the start, rad: of one reading of the accelerometers.
const TILT_START: f64 = 0.03;

impl PoseEstimator {
    /// Visual odometry for a camera's pictures.
    fn odometry(&self, picture: &Picture) -> Option<VisualOdometry> {
        let (x, y) = (0.5 * picture.width as f64, 0.5 * picture.height as f64);
        let [a, b] = [[x - 0.5, y], [x + 0.5, y]].map(|p| picture.lens.ray(p));
        let angle = a?.direction.angle(&b?.direction);
        // Without a baseline the camera returns true ranges, which have only round-off errors.
        let depth = self.p.baseline.map_or(1e-4, |b| self.p.disparity_sigma * angle / b);
        let features =
            Features { spacing: 16, strength: 3.0, half_patch: 5, search: 5, least: 0.8 };
        let pixel = self.p.pixel_sigma * angle;
        Some(VisualOdometry { features, pixel, inverse_depth: depth, tries: 60, fewest: 12 })
    }

    /// Updates the filter with the motion of the camera since the last picture, at the instant of the new picture.
    fn look(&self, c: &Clock, belief: &mut Belief, filter: &mut PoseFilter, new: &Picture) {
        let Some(odometry) = self.odometry(new) else { return };
        if let Some(old) = &belief.scenery {
            let guess = filter.expected(&self.instruments);
            let pairs = odometry.matches(old, new, &guess);
            let motion = odometry.motion(&pairs, &guess, c.key ^ new.number);
            belief.matches = motion.map_or(0, |m| m.agree as u64);
            let taken = motion.is_some_and(|m| filter.see(&self.instruments, &m));
            belief.motions += u64::from(taken);
            belief.lost += u64::from(!taken);
        }
        belief.scenery = Some(odometry.scenery(new));
        filter.remember();
    }

    /// Updates the filter with the mean specific force and the direction of the Sun.
    fn level_and_sun(
        &self,
        t: f64,
        belief: &mut Belief,
        filter: &mut PoseFilter,
        u: &PoseEstimatorIn,
    ) {
        let i = &self.instruments;
        if t - belief.since >= self.p.period * (1.0 - 1e-9) {
            let over = t - belief.since;
            let velocity = filter.velocity(i, &belief.rates);
            let up = (belief.force - (velocity - belief.velocity)) / over;
            filter.level(i, &up);
            belief.since = t;
            belief.force = Vec3::zeros();
            belief.velocity = filter.velocity(i, &belief.rates);
            if let Some(sun) = self.p.sun.as_ref().filter(|_| u.sun_valid && u.sun != belief.sun) {
                filter.sun(i, &u.sun, &sun.state(t).direction);
                belief.sun = u.sun;
            }
        }
    }

    /// Creates the filter at the first sample: roll and pitch from the accelerometers, position and heading from `start`.
    fn begin(&self, u: &PoseEstimatorIn) -> PoseFilter {
        let [x, y, heading] = self.p.start;
        let up = u.force.try_normalize(1e-6).unwrap_or(Vec3::z());
        let level = Quat::rotation_between(&up, &Vec3::z()).unwrap_or_default();
        let forward = level * Vec3::x();
        let turn = Quat::from_scaled_axis(Vec3::z() * (heading - forward.y.atan2(forward.x)));
        let pose = Pose::new(turn * level, Vec3::new(x, y, 0.0));
        PoseFilter::new(pose, &self.start, self.p.slip_sigma)
    }
}

/// Estimates the pose by an extended Kalman filter from wheels, inertial unit, Sun and visual odometry.
#[model("navigation.pose_estimator")]
impl Model for PoseEstimator {
    type Params = PoseEstimatorParams;
    type FeedthroughInputs = PoseEstimatorIn;
    type Outputs = PoseEstimatorOut;
    type Store = Belief;

    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let blind = (!wired("sun_valid")).then(|| {
            BuildError::new("`sun_valid` has no wire, so the Sun counts as not visible")
                .help("wire `valid` of the sun sensor to `sun_valid`")
        });
        vec![
            (Judge::Input("sun"), blind.clone().filter(|_| wired("sun"))),
            (
                Judge::Input("sun_valid"),
                (wired("sun_valid") && !wired("sun")).then(|| {
                    BuildError::new("`sun` has no wire")
                        .help("wire `direction` of the sun sensor to `sun`")
                }),
            ),
            (Judge::Param("sun_sigma"), blind),
        ]
    }
    fn build(p: PoseEstimatorParams) -> Result<Self, BuildError> {
        let mount = Quat::from_euler_angles(p.eye_rpy.x, p.eye_rpy.y, p.eye_rpy.z);
        let lens = Quat::from_basis_unchecked(&[-Vec3::y(), -Vec3::z(), Vec3::x()]);
        let eye = Pose::new(mount * lens, Vec3::from(p.eye));
        if !eye.is_finite() || !p.start.iter().all(|v| v.is_finite()) {
            let fact = "`start` or `eye` is not finite";
            return Err(BuildError::new(fact).at("start").help("in metres and radians"));
        }
        if !p.wheel_walk.iter().all(|w| *w > 0.0 && w.is_finite()) {
            let fact = format!("`wheel_walk` is {:?}", p.wheel_walk.as_slice());
            return Err(BuildError::new(fact)
                .at("wheel_walk")
                .help("write three positive numbers, in m/√m"));
        }
        let instruments = Instruments {
            gyro: p.gyro_sigma,
            gyro_walk: p.gyro_walk,
            wheels: p.wheel_walk,
            slip: [p.slip_sigma, p.slip_time],
            level: p.level_sigma,
            sun: p.sun_sigma,
            reach: p.reach,
            height: p.height,
            eye,
            gate: p.gate,
            turning: p
                .world
                .as_ref()
                .and_then(|w| w.axes().site())
                .map_or_else(Vec3::zeros, |s| s.omega()),
        };
        let start = Start {
            position: p.start_position,
            tilt: TILT_START,
            heading: p.start_heading,
            bias: p.gyro_bias,
            scale: p.scale_sigma,
        };
        Ok(PoseEstimator { p, instruments, start })
    }

    fn outputs(&self, store: &Belief) -> PoseEstimatorOut {
        let [x, y, heading] = self.p.start;
        let start = Pose::new(Quat::from_scaled_axis(Vec3::z() * heading), Vec3::new(x, y, 0.0));
        let filter = store.filter.unwrap_or_else(|| PoseFilter::new(start, &self.start, 0.0));
        let pose = if store.filter.is_some() { store.ahead } else { start };
        let forward = pose.rotation * Vec3::x();
        let up = pose.rotation * Vec3::z();
        let P = filter.planar();
        let eye = pose * self.instruments.eye;
        PoseEstimatorOut {
            x: pose.position.x,
            y: pose.position.y,
            z: pose.position.z,
            heading: forward.y.atan2(forward.x),
            tilt: up.z.clamp(-1.0, 1.0).acos(),
            attitude: pose.rotation,
            deviation: Vec3::new(P[(0, 0)].sqrt(), P[(1, 1)].sqrt(), P[(2, 2)].sqrt()),
            covariance: Vec3::new(P[(0, 1)], P[(0, 2)], P[(1, 2)]),
            slip: filter.slip,
            eye: eye.position,
            eye_attitude: eye.rotation,
            eye_given: true,
            eye_known: store.filter.is_some(),
            motions: store.motions as f64,
            lost: store.lost as f64,
            matches: store.matches as f64,
        }
    }

    fn update(&self, clock: &Clock, u: &PoseEstimatorIn, store: &mut Belief) {
        let i = &self.instruments;
        let now = Rates { gyro: u.gyro, speed: u.speed, change: Vec3::zeros() };
        let mut filter = match store.filter {
            Some(filter) => filter,
            None => {
                (store.time, store.since, store.rates) = (clock.t, clock.t, now);
                self.begin(u)
            }
        };
        let rates = store.rates.until(&now);
        let last = store.scenery.as_ref().map_or(0, |s| s.picture.number);
        if let Some(new) = store.picture.get().filter(|p| p.number > 0 && p.number != last).cloned()
        {
            // The picture was taken at the last sample or since then.
            let at = new.time.clamp(store.time, clock.t);
            filter.go(i, &rates, at - store.time);
            self.look(clock, store, &mut filter, &new);
            store.time = at;
        }
        filter.go(i, &rates, clock.t - store.time);
        store.force += filter.pose.rotation * u.force * clock.dt;
        store.rates = now;
        self.level_and_sun(clock.t, store, &mut filter, u);
        store.time = clock.t;
        store.ahead = filter.ahead(i, &store.rates, clock.dt);
        store.filter = Some(filter);
    }
}
