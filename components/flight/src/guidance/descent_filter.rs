//! `flight.descent_filter`: position, velocity and attitude of an entry vehicle or lander from an inertial unit and a landing radar
//! (error-state Kalman filter). Without a wired radar it integrates the inertial unit alone.
//! ```text
//! from the inertial unit   ω = ω_m − b_ω − Rᵀ ω_W       R ← R exp(Δ (ω₀ + ω₁)/2)                 0, 1: the ends of an interval Δ
//!                          a = R (f_m − b_f) + g(r, v)   v ← v + Δ (a₀ + a₁)/2    r ← r + Δ v₀ + Δ² (2 a₀ + a₁)/6
//! errors x = (δr, δv, δθ, δb_ω, δb_f, δη), W axes, R = exp(δθ) R̂;  η: height of the ground over the sphere
//!     δr' = δv    δv' = −(R f) × δθ − R δb_f    δθ' = −R δb_ω        Φ = 1 + F Δ + (F Δ)²/2
//!     Q = diag(0, N_f² Δ, N_ω² Δ, K_ω² Δ, K_f² Δ, σ_g² (1 − e²))       η ← e η,  e = exp(−|v| Δ/L)
//! beam d = R b with an echo, n: up where it meets the ground at c + d ϱ
//!     range  ϱ      ∂ϱ/∂r = −n/(n·d)    ∂ϱ/∂θ = −ϱ (d × n)/(n·d)    ∂ϱ/∂η = 1/(n·d)    σ = σ_r + κ ϱ, and σ_g/|n·d|: each beam has its own ground
//!     speed  d·u    ∂/∂v = d            ∂/∂θ = d × u                  u = v − v_ground;  σ_v
//! each by itself:  S = H P Hᵀ + σ²    K = E P Hᵀ/S    x ← K ν    P ← P − K H P − P Hᵀ Kᵀ + K S Kᵀ
//!     E leaves of the position what is vertical, all of the rest: no beam sees where on the sphere it is (Schmidt: a state to consider)
//! ```
//! f_m and ω_m are specific force and angular rate of an inertial unit at the same node and in the same axes as the radar. g is the free-fall
//! acceleration in the moving frame W, ω_W the rotation rate of W if it is a site. The ground is a sphere of `ground_radius` about the planet's
//! centre, plus terrain with standard deviation σ_g and correlation length L. The radar observes the height above the sphere to about σ_g. It does
//! not observe the horizontal position, whose error therefore stays constant. Measurements whose residual exceeds `gate` standard deviations are
//! rejected and counted. The first sample initializes the estimate with the true motion plus errors drawn from the initial standard deviations. Scale
//! factor and misalignment of the inertial unit are not states; choose the spreads and random walks of the biases so that they cover them. The force
//! is interpolated linearly between samples; if it jumps, `accel_white` must cover half of the jump over one interval.

use super::planet::Frame;
use linkwork_spatial::Mat3;
use linkwork_spatial::nalgebra::{SMatrix, SVector};
use linkwork_surroundings::prelude::*;

/// Number of error states: position, velocity, attitude, two biases and height of the ground.
const N: usize = 16;
type Covariance = SMatrix<f64, N, N>;
type Row = SVector<f64, N>;

/// Beams, noise and initial errors; the default noise of the inertial unit is of the LN-200S class.
#[derive(Params, Clone, Debug)]
pub struct DescentFilterParams {
    /// Directions of the radar beams, axes of the mount, as in `sensors.radar`.
    pub beams: Vec<Vec3>,
    /// Standard deviation σ_r of a range.
    #[param(unit = "m", default = 0.0, range = 0.0..)]
    pub range_sigma: f64,
    /// Standard deviation of a range relative to the range, κ.
    #[param(default = 0.01, range = 0.0..=1.0)]
    pub range_share: f64,
    /// Standard deviation σ_v of a speed.
    #[param(unit = "m/s", default = 0.1, range = 1e-9..)]
    pub speed_sigma: f64,
    /// Standard deviation σ_g of the terrain height above the sphere.
    #[param(unit = "m", default = 1.0, range = 1e-9..)]
    pub ground_sigma: f64,
    /// Correlation length L of the terrain height.
    #[param(unit = "m", default = 20.0, range = 1e-3..)]
    pub ground_length: f64,
    /// White noise N_ω of the gyroscopes, rad/s/√Hz.
    #[param(default = 2e-5, range = 0.0..)]
    pub gyro_white: f64,
    /// Random walk K_ω of their bias, rad/s/√s.
    #[param(default = 1e-8, range = 0.0..)]
    pub gyro_walk: f64,
    /// White noise N_f of the accelerometers, m/s²/√Hz.
    #[param(default = 3.5e-4, range = 0.0..)]
    pub accel_white: f64,
    /// Random walk K_f of their bias, m/s²/√s.
    #[param(default = 1e-4, range = 0.0..)]
    pub accel_walk: f64,
    /// Standard deviation of the initial position, along the axes of W.
    #[param(unit = "m", default = Vec3::new(100.0, 100.0, 100.0))]
    pub position_start: Vec3,
    /// Standard deviation of the initial velocity, along the axes of W.
    #[param(unit = "m/s", default = Vec3::new(1.0, 1.0, 1.0))]
    pub velocity_start: Vec3,
    /// Standard deviation of the initial attitude, about each axis.
    #[param(unit = "rad", default = 1e-3, range = 0.0..)]
    pub attitude_start: f64,
    /// Standard deviation of the initial gyroscope bias.
    #[param(unit = "rad/s", default = 5e-6, range = 0.0..)]
    pub gyro_bias: f64,
    /// Standard deviation of the initial accelerometer bias.
    #[param(unit = "m/s^2", default = 5e-3, range = 0.0..)]
    pub accel_bias: f64,
    /// Number of filter samples per radar sample, both counted from time 0; the other samples use the inertial unit alone.
    #[param(default = 1, range = 1.0..)]
    pub radar_every: u32,
    /// Number of standard deviations beyond which a measurement is rejected; 0: no rejection.
    #[param(default = 0.0, range = 0.0..)]
    pub gate: f64,
    /// Distance of the ground from the planet's centre; default: the distance of the origin of the site W, or the equatorial radius.
    #[param(unit = "m", range = 1.0..)]
    pub ground_radius: Option<f64>,
    /// The world, on whose body the vehicle lands.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Gravity.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// Mount and inertial unit; ranges, speeds and echoes of the beams follow as further inputs.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DescentFilterIn {
    /// True motion of the mount; read at the first sample only.
    #[port(bind = "mount")]
    pub mount: NodeState,
    /// Angular rate measured by the inertial unit, its axes.
    #[port("rad/s")]
    pub rate: Vec3,
    /// Specific force measured by the inertial unit, its axes.
    #[port("m/s^2")]
    pub force: Vec3,
}

/// The estimate.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DescentFilterOut {
    /// Estimated motion of the mount, W. Wire it to the port of a guidance part instead of binding that port to a body.
    #[port]
    pub estimate: NodeState,
    /// Height above the sphere.
    #[port("m")]
    pub height: f64,
    /// Ground-relative speed.
    #[port("m/s")]
    pub speed: f64,
    /// Specific force opposite to the ground-relative velocity: the drag deceleration if there is no thrust.
    #[port("m/s^2")]
    pub braking: f64,
    /// Standard deviation of the position along the axes of W.
    #[port("m")]
    pub position_deviation: Vec3,
    /// Standard deviation of the velocity along the axes of W.
    #[port("m/s")]
    pub velocity_deviation: Vec3,
    /// Standard deviation of the attitude about the axes of W.
    #[port("rad")]
    pub attitude_deviation: Vec3,
    /// Number of rejected measurements.
    #[port("1")]
    pub rejected: f64,
}

/// State of the filter.
#[derive(State, Clone, Copy, Debug)]
pub struct Navigated {
    /// Time of the last sample, because a phase may change the rate.
    #[port("s")]
    pub time: f64,
    /// Position, W.
    #[port("m")]
    pub position: Vec3,
    /// Velocity, W.
    #[port("m/s")]
    pub velocity: Vec3,
    /// Attitude, mount to W.
    #[port]
    pub attitude: Quat,
    /// Bias of the gyroscopes.
    #[port("rad/s")]
    pub gyro: Vec3,
    /// Bias of the accelerometers.
    #[port("m/s^2")]
    pub accel: Vec3,
    /// Height η of the ground above the sphere.
    #[port("m")]
    pub ground: f64,
    /// Angular rate relative to W at the last sample, without bias, axes of the mount.
    #[port("rad/s")]
    pub rate: Vec3,
    /// Specific force at the last sample, without bias, W.
    #[port("m/s^2")]
    pub force: Vec3,
    /// Covariance of the errors, by columns.
    #[port("1")]
    pub covariance: [f64; N * N],
    /// Number of rejected measurements.
    #[port("1")]
    pub rejected: f64,
    /// The filter has been initialized.
    #[port]
    pub begun: bool,
}

/// Expected measurement of a beam and its derivatives.
struct Expected {
    range: f64,
    /// ∂ range / ∂ errors.
    by_range: Row,
    /// Cosine of the beam's angle to the vertical where it meets the ground.
    facing: f64,
    speed: f64,
    by_speed: Row,
}

/// Error-state Kalman filter of a descent.
pub struct DescentFilter {
    p: DescentFilterParams,
    beams: Vec<Vec3>,
    site: Option<Site>,
    /// Angular velocity of the planet in W (rad/s), used if W is inertial.
    rate: Vec3,
    /// Distance of the ground from the planet's centre, m.
    radius: f64,
}

fn skew(v: &Vec3) -> Mat3 {
    v.cross_matrix()
}

impl DescentFilter {
    /// Returns the velocity of the ground (m/s, W) at a position from the planet's centre; zero at a site.
    fn ground(&self, from: &Vec3) -> Vec3 {
        if self.site.is_some() {
            return Vec3::zeros();
        }
        self.rate.cross(from)
    }

    fn begin(&self, c: &Clock, mount: &NodeState) -> Navigated {
        let p = &self.p;
        let drawn = |lane: u32| Vec3::new(c.normal(lane), c.normal(lane + 1), c.normal(lane + 2));
        let spreads = [
            p.position_start,
            p.velocity_start,
            Vec3::repeat(p.attitude_start),
            Vec3::repeat(p.gyro_bias),
            Vec3::repeat(p.accel_bias),
            Vec3::repeat(p.ground_sigma),
        ];
        let mut covariance = [0.0; N * N];
        for k in 0..N {
            covariance[k * (N + 1)] = spreads[k / 3][k % 3].powi(2);
        }
        Navigated {
            time: c.t,
            position: mount.position + drawn(0).component_mul(&p.position_start),
            velocity: mount.velocity + drawn(3).component_mul(&p.velocity_start),
            attitude: Quat::from_scaled_axis(drawn(6) * p.attitude_start) * mount.rotation,
            gyro: Vec3::zeros(),
            accel: Vec3::zeros(),
            ground: 0.0,
            rate: Vec3::zeros(),
            force: Vec3::zeros(),
            covariance,
            rejected: 0.0,
            begun: true,
        }
    }

    /// Returns the angular rate relative to W, axes of the mount.
    fn over_w(&self, d: &Navigated, u: &DescentFilterIn) -> Vec3 {
        let turning = self.site.as_ref().map_or(Vec3::zeros(), Site::omega);
        u.rate - d.gyro - d.attitude.inverse() * turning
    }

    /// Propagates state and covariance with the inertial unit over an interval.
    fn carry(&self, c: &Clock, d: &mut Navigated, u: &DescentFilterIn) {
        let (p, h) = (&self.p, c.t - d.time);
        d.time = c.t;
        let rate = self.over_w(d, u);
        d.attitude *= Quat::from_scaled_axis((d.rate + rate) * (0.5 * h));
        d.rate = rate;
        let force = d.attitude * (u.force - d.accel);
        let falls = |t: f64, r: Vec3, v: Vec3| p.gravity.free_fall(t, r, v);
        let a0 = d.force + falls(c.t - h, d.position, d.velocity);
        let (r1, v1) = (d.position + d.velocity * h + a0 * (0.5 * h * h), d.velocity + a0 * h);
        let a1 = force + falls(c.t, r1, v1);
        d.position += d.velocity * h + (a0 * 2.0 + a1) * (h * h / 6.0);
        d.velocity += (a0 + a1) * (0.5 * h);
        let rotation = *d.attitude.to_rotation_matrix().matrix();
        let mut f = Covariance::zeros();
        f.fixed_view_mut::<3, 3>(0, 3).copy_from(&(Mat3::identity() * h));
        f.fixed_view_mut::<3, 3>(3, 6).copy_from(&(skew(&((d.force + force) * 0.5)) * -h));
        f.fixed_view_mut::<3, 3>(3, 12).copy_from(&(rotation * -h));
        f.fixed_view_mut::<3, 3>(6, 9).copy_from(&(rotation * -h));
        let mut phi = Covariance::identity() + f + f * f * 0.5;
        let alike = (-d.velocity.norm() * h / p.ground_length).exp();
        phi[(N - 1, N - 1)] = alike;
        d.ground *= alike;
        let mut cov = phi * Covariance::from_column_slice(&d.covariance) * phi.transpose();
        for (k, density) in
            [(3, p.accel_white), (6, p.gyro_white), (9, p.gyro_walk), (12, p.accel_walk)]
        {
            (k..k + 3).for_each(|i| cov[(i, i)] += density * density * h);
        }
        cov[(N - 1, N - 1)] += p.ground_sigma.powi(2) * (1.0 - alike * alike);
        d.force = force;
        d.covariance.copy_from_slice(((cov + cov.transpose()) * 0.5).as_slice());
    }

    /// Returns the expected measurement of beam `k`; `None` if it misses the ground.
    fn expected(&self, d: &Navigated, k: usize) -> Option<Expected> {
        let beam = d.attitude * self.beams[k];
        let from = self.site.as_ref().map_or(d.position, |s| s.relative_to_centre(&d.position));
        let radius = self.radius + d.ground;
        let (along, over) = (from.dot(&beam), (from.norm() - radius) * (from.norm() + radius));
        let root = along * along - over;
        if !(over >= 0.0 && along < 0.0 && root > 0.0) {
            return None;
        }
        let range = over / (root.sqrt() - along);
        let met = from + beam * range;
        let n = met / radius;
        let (u, facing) = (d.velocity - self.ground(&met), n.dot(&beam));
        let (mut by_range, mut by_speed) = (Row::zeros(), Row::zeros());
        by_range.fixed_rows_mut::<3>(0).copy_from(&(n / -facing));
        by_range.fixed_rows_mut::<3>(6).copy_from(&(beam.cross(&n) * (-range / facing)));
        by_range[N - 1] = 1.0 / facing;
        by_speed.fixed_rows_mut::<3>(3).copy_from(&beam);
        by_speed.fixed_rows_mut::<3>(6).copy_from(&beam.cross(&u));
        Some(Expected { range, by_range, facing: facing.abs(), speed: beam.dot(&u), by_speed })
    }

    /// Updates the estimate with one measurement, whose residual is `off`.
    fn mend(&self, d: &mut Navigated, h: &Row, off: f64, sigma: f64) {
        let mut cov = Covariance::from_column_slice(&d.covariance);
        let to = cov * h;
        let spread = h.dot(&to) + sigma * sigma;
        if self.p.gate > 0.0 && off * off > self.p.gate.powi(2) * spread {
            d.rejected += 1.0;
            return;
        }
        let mut gain = to / spread;
        let up = self
            .site
            .as_ref()
            .map_or(d.position, |s| s.relative_to_centre(&d.position))
            .normalize();
        let raised = up * up.dot(&gain.fixed_rows::<3>(0));
        gain.fixed_rows_mut::<3>(0).copy_from(&raised);
        let x = gain * off;
        let part = |k: usize| Vec3::new(x[k], x[k + 1], x[k + 2]);
        d.position += part(0);
        d.velocity += part(3);
        d.attitude = Quat::from_scaled_axis(part(6)) * d.attitude;
        d.gyro += part(9);
        d.accel += part(12);
        d.ground += x[N - 1];
        cov += gain * (gain * spread - to).transpose() - to * gain.transpose();
        d.covariance.copy_from_slice(((cov + cov.transpose()) * 0.5).as_slice());
    }

    /// Returns the estimate at this sample. `radar` contains ranges, speeds, and 1 or 0 for an echo, of all beams.
    fn step(&self, c: &Clock, d: &Navigated, u: &DescentFilterIn, radar: &[f64]) -> Navigated {
        let (mut d, n, p) = (*d, self.beams.len(), &self.p);
        if d.begun {
            self.carry(c, &mut d, u);
        } else {
            d = self.begin(c, &u.mount);
            (d.rate, d.force) = (self.over_w(&d, u), d.attitude * u.force);
        }
        let fresh = c.n.is_multiple_of(u64::from(p.radar_every));
        for k in (0..n).filter(|k| fresh && radar[2 * n + k] > 0.5) {
            let Some(e) = self.expected(&d, k) else { continue };
            let own = p.range_sigma + p.range_share * e.range;
            let sigma = own.hypot(p.ground_sigma / e.facing.max(1e-3));
            self.mend(&mut d, &e.by_range, radar[k] - e.range, sigma);
            let Some(e) = self.expected(&d, k) else { continue };
            self.mend(&mut d, &e.by_speed, radar[n + k] - e.speed, p.speed_sigma);
        }
        d
    }
}

/// Error-state Kalman filter for position, velocity and attitude of a lander from an inertial unit and a landing radar; sampled.
#[model("flight.descent_filter")]
impl SizedModel for DescentFilter {
    type Params = DescentFilterParams;

    fn ports(p: &DescentFilterParams) -> SizedPorts {
        let count = p.beams.len();
        // Without a wire, the default is a vehicle without a radar, and hence without echoes.
        let each = |name: &'static str, unit: &'static str, doc: &'static str| {
            let beams = PortSpec::named(name, PortKind::Numbers, count);
            beams.unit_of(unit).doc_of(doc).or(0.0)
        };
        let beams = [
            each("range", "m", "Slant range of each beam."),
            each("speed", "m/s", "Speed along each beam relative to the ground."),
            each("found", "1", "1 for a beam with an echo, else 0."),
        ];
        SizedPorts {
            feedthrough_inputs: DescentFilterIn::specs().into_iter().chain(beams).collect(),
            feedthrough_outputs: DescentFilterOut::specs(),
            discrete: Navigated::specs(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(p: DescentFilterParams) -> Result<Self, BuildError> {
        let wrong =
            |at: &str, fact: String, help: &str| Err(BuildError::new(fact).help(help).at(at));
        if p.beams.is_empty() {
            let help = "write the beams of the radar, e.g. [[0, 0, -1], [0.4, 0, -1]]";
            return wrong("beams", "`beams` is empty".into(), help);
        }
        if let Some(k) = p.beams.iter().position(|d| !(d.norm() > 1e-9)) {
            let fact = format!("beam {k} is the zero vector");
            return wrong("beams", fact, "write a direction of any length, e.g. [0.3, 0, -1]");
        }
        for (at, sigma) in
            [("position_start", p.position_start), ("velocity_start", p.velocity_start)]
        {
            if sigma.iter().any(|s| !(*s >= 0.0)) {
                let fact = "a standard deviation is negative".to_string();
                return wrong(at, fact, "write three numbers that are 0 or more");
            }
        }
        let frame = Frame::new(Some(&p.world), Some(&p.gravity))?;
        if frame.is_level() {
            let fact =
                "this filter needs spherical ground about the centre of a planet, but the ground is level here"
                    .into();
            return wrong(
                "ground_radius",
                fact,
                "remove `turning: false` from the `site` of `world`",
            );
        }
        let radius = p.ground_radius.unwrap_or_else(|| frame.ground_radius());
        let (site, rate) = (p.world.axes().site(), p.world.planet_rate(0.0));
        let beams = p.beams.iter().map(|d| d.normalize()).collect();
        Ok(DescentFilter { beams, site, rate, radius, p })
    }

    fn initial(&self, _: &mut [f64], d: &mut [f64]) {
        let mut none = Navigated::zero();
        none.attitude = Quat::identity();
        none.put(d);
    }

    fn feedthrough(&self, clock: &Clock, d: &[f64], u: &[f64], y: &mut [f64]) {
        let (input, radar) = u.split_at(DescentFilterIn::N);
        let input = DescentFilterIn::get(input);
        let e = self.step(clock, &Navigated::get(d), &input, radar);
        let deviation =
            |from: usize| Vec3::from_fn(|k, _| e.covariance[(from + k) * (N + 1)].max(0.0).sqrt());
        let estimate = NodeState {
            position: e.position,
            rotation: e.attitude,
            angular: e.attitude * e.rate,
            velocity: e.velocity,
        };
        let from = self.site.as_ref().map_or(e.position, |s| s.relative_to_centre(&e.position));
        let over = e.velocity - self.ground(&from);
        let speed = over.norm();
        DescentFilterOut {
            estimate,
            height: from.norm() - self.radius,
            speed,
            braking: if speed > 0.0 { -e.force.dot(&over) / speed } else { 0.0 },
            position_deviation: deviation(0),
            velocity_deviation: deviation(3),
            attitude_deviation: deviation(6),
            rejected: e.rejected,
        }
        .put(y);
    }

    fn update(&self, clock: &Clock, d: &mut [f64], u: &[f64]) {
        let (input, radar) = u.split_at(DescentFilterIn::N);
        self.step(clock, &Navigated::get(d), &DescentFilterIn::get(input), radar).put(d);
    }
}

#[cfg(test)]
#[path = "descent_filter_tests.rs"]
mod tests;
