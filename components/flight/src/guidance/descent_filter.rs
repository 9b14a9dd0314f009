//! `flight.descent_filter`: position, velocity and attitude of an entry vehicle or lander from an inertial unit and a landing radar
//! (error-state Kalman filter). Where no radar is wired it goes by the inertial unit alone.
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
//! f_m, ω_m: specific force and turn rate of an inertial unit at the same node and in the same axes as the radar; g: of free fall as W moves; ω_W: turn rate of a W that is a site.
//! The ground is a sphere of `ground_radius` about the planet's centre, and what stands out of it has the deviation σ_g and is alike over a way L: the height over the sphere is
//! observed to about σ_g, the place on it is not: it keeps the error that it has, and does not wander while a lander comes down on it. A measurement
//! further off than `gate` deviations is left out and counted. The first row takes the true motion with errors drawn from the start's deviations: what navigation
//! knew before the radar. Scale and misalignment of the inertial unit are no states: give the biases a spread and walks that cover them.
//! Between two rows the force goes along a straight line: for one that jumps, `accel_white` is to cover half a jump over an interval.

use super::planet::Frame;
use linkwork_runtime::prelude::*;
use linkwork_spatial::Mat3;
use linkwork_spatial::nalgebra::{SMatrix, SVector};

/// Errors of position, velocity, attitude, the two biases and the ground's height.
const N: usize = 16;
type Covariance = SMatrix<f64, N, N>;
type Row = SVector<f64, N>;

/// Beams, noise and start; defaults of an inertial unit are those of the LN-200S class.
#[derive(Params, Clone, Debug)]
pub struct DescentFilterParams {
    /// Directions of the radar's beams, axes of the mount, as `sensors.radar` has them.
    pub beams: Vec<Vec3>,
    /// Standard deviation σ_r of a range.
    #[param(unit = "m", default = 0.0, range = 0.0..)]
    pub range_sigma: f64,
    /// Standard deviation of a range over the range, κ.
    #[param(default = 0.01, range = 0.0..=1.0)]
    pub range_share: f64,
    /// Standard deviation σ_v of a speed.
    #[param(unit = "m/s", default = 0.1, range = 1e-9..)]
    pub speed_sigma: f64,
    /// Standard deviation σ_g of the ground's height over the sphere.
    #[param(unit = "m", default = 1.0, range = 1e-9..)]
    pub ground_sigma: f64,
    /// Way L over which the ground's height is alike.
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
    /// Standard deviation of the position at the start, along the axes of W.
    #[param(unit = "m", default = Vec3::new(100.0, 100.0, 100.0))]
    pub position_start: Vec3,
    /// Standard deviation of the velocity at the start, along the axes of W.
    #[param(unit = "m/s", default = Vec3::new(1.0, 1.0, 1.0))]
    pub velocity_start: Vec3,
    /// Standard deviation of the attitude at the start, about each axis.
    #[param(unit = "rad", default = 1e-3, range = 0.0..)]
    pub attitude_start: f64,
    /// Spread of the gyroscopes' bias.
    #[param(unit = "rad/s", default = 5e-6, range = 0.0..)]
    pub gyro_bias: f64,
    /// Spread of the accelerometers' bias.
    #[param(unit = "m/s^2", default = 5e-3, range = 0.0..)]
    pub accel_bias: f64,
    /// Rows from one sample of the radar to the next, where it is slower than the filter and both count from time 0: the others go by
    /// the inertial unit alone.
    #[param(default = 1, range = 1.0..)]
    pub radar_every: u32,
    /// Standard deviations beyond which a measurement is left out; 0: none is.
    #[param(default = 0.0, range = 0.0..)]
    pub gate: f64,
    /// Distance of the ground from the planet's centre; default: of the origin of the site that W is, or the equatorial radius.
    #[param(unit = "m", range = 1.0..)]
    pub ground_radius: Option<f64>,
    /// The world, over whose body it comes down.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Gravity.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// The mount and the inertial unit; ranges, speeds and echoes of the beams follow.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DescentFilterIn {
    /// True motion, of which the first row alone is read.
    #[port(bind = "mount")]
    pub mount: NodeState,
    /// Turn rate that the inertial unit tells, its axes.
    #[port("rad/s")]
    pub rate: Vec3,
    /// Specific force that it tells, its axes.
    #[port("m/s^2")]
    pub force: Vec3,
}

/// The estimate.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DescentFilterOut {
    /// Motion of the mount, W; guidance takes it in place of a body's: wire it to the port that it would bind.
    #[port]
    pub estimate: NodeState,
    /// Height over the sphere.
    #[port("m")]
    pub height: f64,
    /// Speed over the ground.
    #[port("m/s")]
    pub speed: f64,
    /// Specific force against the velocity over the ground: the deceleration by drag, where there is no thrust.
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
    /// Measurements that were left out.
    #[port("1")]
    pub rejected: f64,
}

/// State of the filter.
#[derive(State, Clone, Copy, Debug)]
pub struct Navigated {
    /// Time of the last row: a phase may change the rate.
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
    /// Height η of the ground over the sphere.
    #[port("m")]
    pub ground: f64,
    /// Turn rate of the last row against W, without its bias, axes of the mount.
    #[port("rad/s")]
    pub rate: Vec3,
    /// Specific force of the last row without its bias, W.
    #[port("m/s^2")]
    pub force: Vec3,
    /// Covariance of the errors, by columns.
    #[port("1")]
    pub covariance: [f64; N * N],
    /// Measurements that were left out.
    #[port("1")]
    pub rejected: f64,
    /// There is an estimate.
    #[port]
    pub begun: bool,
}

/// What a beam is expected to tell.
struct Expected {
    range: f64,
    /// ∂ range / ∂ errors.
    by_range: Row,
    /// Cosine of the beam's angle to the vertical where it meets the ground.
    facing: f64,
    speed: f64,
    by_speed: Row,
}

/// The filter.
pub struct DescentFilter {
    p: DescentFilterParams,
    beams: Vec<Vec3>,
    site: Option<Site>,
    /// Angular velocity of the planet in W (rad/s), where W is inertial.
    rate: Vec3,
    /// Distance of the ground from the planet's centre, m.
    radius: f64,
}

fn skew(v: &Vec3) -> Mat3 {
    v.cross_matrix()
}

impl DescentFilter {
    /// Velocity of the ground (m/s) at a place from the planet's centre, in W: none where W turns with it.
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

    /// Turn rate against W, axes of the mount.
    fn over_w(&self, d: &Navigated, u: &DescentFilterIn) -> Vec3 {
        let turning = self.site.as_ref().map_or(Vec3::zeros(), Site::omega);
        u.rate - d.gyro - d.attitude.inverse() * turning
    }

    /// Carried on by the inertial unit over an interval.
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

    /// What beam `k` tells if the estimate is right; none where it misses the ground.
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

    /// Mended by one number; its difference from what was expected is `off`.
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

    /// The estimate at this row; `radar`: ranges, speeds, and 1 or 0 for an echo, of all beams.
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

/// Position, velocity and attitude of a lander from an inertial unit and a landing radar, by an error-state Kalman filter; sampled.
#[model("flight.descent_filter")]
impl SizedModel for DescentFilter {
    type Params = DescentFilterParams;

    fn ports(p: &DescentFilterParams) -> SizedPorts {
        let count = p.beams.len();
        // Unwired: there is no radar, and no echo.
        let each = |name: &'static str, unit: &'static str, doc: &'static str| {
            let beams = PortSpec::named(name, PortKind::Numbers, count);
            beams.unit_of(unit).doc_of(doc).or(0.0)
        };
        let beams = [
            each("range", "m", "Slant range of each beam."),
            each("speed", "m/s", "Speed towards what each beam meets."),
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
            let help = "write those of the radar, e.g. [[0, 0, -1], [0.4, 0, -1]]";
            return wrong("beams", "there are no beams".into(), help);
        }
        if let Some(k) = p.beams.iter().position(|d| !(d.norm() > 1e-9)) {
            let fact = format!("beam {k} has no direction");
            return wrong("beams", fact, "write one of any length, e.g. [0.3, 0, -1]");
        }
        for (at, sigma) in
            [("position_start", p.position_start), ("velocity_start", p.velocity_start)]
        {
            if sigma.iter().any(|s| !(*s >= 0.0)) {
                let fact = "a standard deviation is below 0".to_string();
                return wrong(at, fact, "write three numbers that are 0 or more");
            }
        }
        let frame = Frame::new(Some(&p.world), Some(&p.gravity))?;
        if frame.is_level() {
            let fact =
                "its ground is a sphere about the centre of a planet, and the ground is level here"
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
