//! `sensors.gnss`: satellite navigation receiver: position, velocity and clock from ranges to the visible satellites.
//! ```text
//! satellites  planes × per_plane on circles of radius a, n = √(μ/a³); plane i: node Ω + 2π i/planes; satellite j of it at the argument of latitude
//!             2π j/per_plane + 2π phasing i/(planes per_plane) + n t      (Walker constellation, inertial axes)
//! visible     elevation above the horizon ≥ `mask`, not occulted by the planet, within `cone` of z of the mount
//! range       ρ = |s − p| + b + e + σ_ρ n₁       e' = φ e + σ_e √(1 − φ²) n₂, φ = e^(−Δt/τ): orbits, ionosphere, multipath
//! rate        ρ̇ = u·(v_s − v) + d + σ_v n₃       u: unit vector to the satellite
//! clock       b' = b + d Δt + σ_b √Δt n₄ + σ_d √Δt³ (n₅/2 + n₆/√12),  d' = d + σ_d √Δt n₅       in m and m/s; outputs divided by c
//! fix         (p, b) = argmin Σ (ρ − |s − p| − b)²,  (v, d) by the same matrix;  PDOP = √tr of the part of (HᵀH)⁻¹ for p
//! ```
//! A fix needs at least four satellites and a PDOP of at most `pdop_max`; otherwise all outputs are zero. Ranges are of one instant: light time,
//! relativity, elevation-dependent atmospheric delay and satellite clock errors are not modelled. The inertial axes are the axes of an inertial W,
//! rotated by the smallest rotation that makes z the planet's pole at t = 0; if W is a site, they are the axes of the planet at t = 0. Position and
//! velocity are in W.

use linkwork_spatial::nalgebra::{Matrix4, Vector4};
use linkwork_surroundings::SPEED_OF_LIGHT as LIGHT;
use linkwork_surroundings::prelude::*;

/// Maximum number of planes and of satellites in a plane; maximum number of satellites.
const SIDE_MAX: u32 = 16;
const SATELLITES_MAX: u32 = SIDE_MAX * SIDE_MAX;
/// Number of noise channels before those of the satellites, and number for each satellite.
const OWN: u32 = 8;
const EACH: u32 = 3;

/// Constellation, receiver and errors. Defaults: GPS with 24 satellites and a single-frequency receiver.
#[derive(Params, Clone, Debug)]
pub struct GnssParams {
    /// Orbital planes.
    #[param(default = 6, range = 1.0..=16.0)]
    pub planes: u32,
    /// Satellites in a plane.
    #[param(default = 4, range = 1.0..=16.0)]
    pub per_plane: u32,
    /// Walker phasing: offset of a plane to the previous one in units of 2π/satellites.
    #[param(default = 1, range = 0.0..=256.0)]
    pub phasing: u32,
    /// Inclination.
    #[param(unit = "rad", default = 0.959_931_088_596_881_2, range = 0.0..=3.15)]
    pub inclination: f64,
    /// Radius a of the orbits. Default at the Earth: 26 560 km.
    #[param(unit = "m", range = 1.0..)]
    pub orbit_radius: Option<f64>,
    /// Right ascension Ω of the node of the first plane.
    #[param(unit = "rad", default = 0.0)]
    pub node: f64,
    /// Elevation mask: minimum elevation above the horizontal; negative for high-flying vehicles.
    #[param(unit = "rad", default = 0.0873, range = -1.58..=1.58)]
    pub mask: f64,
    /// Maximum angle from z of the mount at which the antenna receives.
    #[param(unit = "rad", default = std::f64::consts::PI, range = 0.0..=3.15)]
    pub cone: f64,
    /// Standard deviation σ_ρ of the white noise of a range.
    #[param(unit = "m", default = 0.5, range = 0.0..)]
    pub range_sigma: f64,
    /// Standard deviation σ_e of the time-correlated range error of each satellite.
    #[param(unit = "m", default = 1.5, range = 0.0..)]
    pub wander_sigma: f64,
    /// Time constant τ of the time-correlated range error.
    #[param(unit = "s", default = 600.0, range = 1e-3.., needs = "wander_sigma")]
    pub wander_time: f64,
    /// Standard deviation σ_v of a range rate.
    #[param(unit = "m/s", default = 0.05, range = 0.0..)]
    pub rate_sigma: f64,
    /// Standard deviation of the clock's error at the start.
    #[param(unit = "s", default = 1e-6, range = 0.0..)]
    pub clock_start: f64,
    /// Standard deviation of the clock's drift at the start, s/s.
    #[param(default = 1e-8, range = 0.0..)]
    pub drift_start: f64,
    /// White noise σ_b of the clock's frequency, s/√s.
    #[param(default = 3e-10, range = 0.0..)]
    pub clock_white: f64,
    /// Random walk σ_d of the clock's frequency, s/s/√s.
    #[param(default = 1e-11, range = 0.0..)]
    pub clock_walk: f64,
    /// Maximum PDOP for a fix.
    #[param(default = 20.0, range = 1.0..)]
    pub pdop_max: f64,
    /// The world; the satellites orbit its body.
    #[param(service)]
    pub world: Handle<dyn World>,
}

/// The antenna.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GnssIn {
    /// Antenna mount; z is the axis of the antenna.
    #[port(bind = "mount")]
    pub mount: NodeState,
}

/// Outputs of the receiver.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GnssOut {
    /// Position, W; 0 without a fix.
    #[port("m")]
    pub position: Vec3,
    /// Velocity, W; 0 without a fix.
    #[port("m/s")]
    pub velocity: Vec3,
    /// Estimated error of the receiver clock.
    #[port("s")]
    pub clock: f64,
    /// Estimated drift of the receiver clock, s/s.
    #[port("1")]
    pub drift: f64,
    /// There is a fix: the outputs are valid.
    #[port]
    pub fix: bool,
    /// Number of received satellites.
    #[port("1")]
    pub satellites: f64,
    /// Position dilution of precision: standard deviation of the position divided by that of a range; 0 without a fix.
    #[port("1")]
    pub pdop: f64,
}

/// The clock.
#[derive(State, Clone, Copy, Debug)]
pub struct GnssClock {
    /// Clock error b, times the speed of light.
    #[port("m")]
    pub bias: f64,
    /// Clock drift d, times the speed of light.
    #[port("m/s")]
    pub rate: f64,
    /// The first errors have been drawn.
    #[port]
    pub drawn: bool,
}

/// Position (m) and velocity (m/s) relative to the planet's centre, inertial axes.
#[derive(Clone, Copy, Debug)]
struct Moving {
    p: Vec3,
    v: Vec3,
}

/// A received satellite: its motion, measured range (m) and measured range rate (m/s).
#[derive(Clone, Copy, Debug)]
struct Signal {
    satellite: Moving,
    range: f64,
    rate: f64,
}

/// Radius of the orbits of GPS, m.
const GPS: f64 = 2.656e7;

/// A receiver.
pub struct Gnss {
    p: GnssParams,
    mu: f64,
    /// Radius of the orbits, m.
    a: f64,
    /// Radius of the occulting body, m.
    radius: f64,
    site: Option<Site>,
    /// Rotation from the axes of the orbits to inertial axes.
    pole: Quat,
}

impl Gnss {
    fn count(&self) -> u32 {
        self.p.planes * self.p.per_plane
    }

    /// Returns the motion of satellite `k` at time `t` (s).
    fn satellite(&self, k: u32, t: f64) -> Moving {
        let p = &self.p;
        let turn = std::f64::consts::TAU;
        let (plane, place) = (f64::from(k / p.per_plane), f64::from(k % p.per_plane));
        let rate = (self.mu / self.a.powi(3)).sqrt();
        let ahead = f64::from(p.phasing) * plane / f64::from(self.count());
        let (sin, cos) = (turn * (place / f64::from(p.per_plane) + ahead) + rate * t).sin_cos();
        let orbit = self.pole
            * Quat::from_axis_angle(&Vec3::z_axis(), p.node + turn * plane / f64::from(p.planes))
            * Quat::from_axis_angle(&Vec3::x_axis(), p.inclination);
        let a = self.a;
        Moving {
            p: orbit * Vec3::new(a * cos, a * sin, 0.0),
            v: orbit * Vec3::new(-a * rate * sin, a * rate * cos, 0.0),
        }
    }

    /// Returns the rotation from the axes of the planet to inertial axes.
    fn turned(&self, site: &Site, t: f64) -> Quat {
        Quat::from_axis_angle(&Vec3::z_axis(), site.rate * t)
    }

    /// Converts the motion of a node to inertial axes.
    fn inertial(&self, t: f64, node: &NodeState) -> Moving {
        let Some(site) = &self.site else { return Moving { p: node.position, v: node.velocity } };
        let turn = self.turned(site, t);
        let p = site.to_planet(&node.position);
        let v = site.pose.rotation * node.velocity + (Vec3::z() * site.rate).cross(&p);
        Moving { p: turn * p, v: turn * v }
    }

    /// Converts a motion in inertial axes to position and velocity in W.
    fn in_W(&self, t: f64, m: &Moving) -> (Vec3, Vec3) {
        let Some(site) = &self.site else { return (m.p, m.v) };
        let back = self.turned(site, t).inverse();
        let p = back * m.p;
        let v = back * m.v - (Vec3::z() * site.rate).cross(&p);
        (site.pose.inverse().transform_point(&p), site.from_planet_axes(&v))
    }

    /// Returns the elevation (rad) of a satellite above the horizontal at `p`.
    fn elevation(p: &Vec3, s: &Vec3) -> f64 {
        let (up, to) = (p.normalize(), (s - p).normalize());
        up.dot(&to).atan2(up.cross(&to).norm())
    }

    /// Returns whether a satellite is received: above the mask, not behind the planet, and within the cone about `axis`.
    fn seen(&self, own: &Vec3, axis: &Vec3, s: &Vec3) -> bool {
        let (p, to) = (&self.p, s - own);
        let along = -own.dot(&to) / to.norm_squared();
        let nearest = (own + to * along.clamp(0.0, 1.0)).norm();
        // On the ground the line of sight begins at the planet's surface.
        let clear = along <= 0.0 || nearest >= self.radius;
        clear
            && Self::elevation(own, s) >= p.mask
            && axis.cross(&to).norm().atan2(axis.dot(&to)) <= p.cone
    }

    /// Returns ranges and range rates of the received satellites, with errors.
    fn signals(
        &self,
        c: &Clock,
        own: &Moving,
        axis: &Vec3,
        (clock, errors): (&GnssClock, &[f64]),
        mut f: impl FnMut(Signal),
    ) {
        for k in 0..self.count() {
            let satellite = self.satellite(k, c.t);
            if !self.seen(&own.p, axis, &satellite.p) {
                continue;
            }
            let to = satellite.p - own.p;
            let lane = OWN + EACH * k;
            let noise =
                |sigma: f64, n: u32| if sigma > 0.0 { sigma * c.normal(lane + n) } else { 0.0 };
            let error = errors[k as usize] + noise(self.p.range_sigma, 0);
            let closing = to.normalize().dot(&(satellite.v - own.v));
            f(Signal {
                satellite,
                range: to.norm() + clock.bias + error,
                rate: closing + clock.rate + noise(self.p.rate_sigma, 1),
            });
        }
    }

    /// Returns clock and range errors at this sample: from the state, or newly drawn at the first sample.
    fn state(&self, c: &Clock, d: &[f64]) -> (GnssClock, [f64; SATELLITES_MAX as usize]) {
        let (own, each) = d.split_at(GnssClock::N);
        let mut clock = GnssClock::get(own);
        let mut errors = [0.0; SATELLITES_MAX as usize];
        errors[..each.len()].copy_from_slice(each);
        if !clock.drawn {
            let bias = LIGHT * self.p.clock_start * c.normal(0);
            let rate = LIGHT * self.p.drift_start * c.normal(1);
            clock = GnssClock { bias, rate, drawn: true };
            for (k, e) in errors[..each.len()].iter_mut().enumerate() {
                *e = self.p.wander_sigma * c.normal(OWN + EACH * k as u32 + 2);
            }
        }
        (clock, errors)
    }

    /// Returns the number of received satellites and the least-squares solution. The iteration starts at the true antenna position; it converges to
    /// the same solution from any nearby point.
    fn fix(&self, c: &Clock, mount: &NodeState, d: &[f64]) -> (u32, Option<Solution>) {
        let own = self.inertial(c.t, mount);
        let axis =
            self.inertial(
                c.t,
                &NodeState { position: mount.position + mount.rotation * Vec3::z(), ..*mount },
            )
            .p - own.p;
        let (clock, errors) = self.state(c, d);
        let mut found = Solution { at: own, bias: clock.bias, rate: 0.0, pdop: 0.0 };
        let mut count = 0;
        for step in 0..STEPS {
            let (mut normal, mut right, mut rates) =
                (Matrix4::zeros(), Vector4::zeros(), Vector4::zeros());
            count = 0;
            self.signals(c, &own, &axis, (&clock, &errors[..self.count() as usize]), |s| {
                let to = s.satellite.p - found.at.p;
                let u = to.normalize();
                let row = Vector4::new(-u.x, -u.y, -u.z, 1.0);
                normal += row * row.transpose();
                right += row * (s.range - to.norm() - found.bias);
                rates += row * (s.rate - u.dot(&s.satellite.v));
                count += 1;
            });
            if count < 4 {
                return (count, None);
            }
            let Some(inverse) = normal.cholesky().map(|l| l.inverse()) else {
                return (count, None);
            };
            let (by, v) = (inverse * right, inverse * rates);
            found.at.p += by.xyz();
            found.bias += by.w;
            if step + 1 == STEPS {
                found.at.v = v.xyz();
                found.rate = v.w;
                found.pdop = (inverse[(0, 0)] + inverse[(1, 1)] + inverse[(2, 2)]).sqrt();
            }
        }
        (count, (found.pdop <= self.p.pdop_max).then_some(found))
    }
}

/// Number of Gauss–Newton steps: from an error of 100 m, 0.2 mm remain after the first step and only round-off after the second.
const STEPS: u32 = 3;

/// Position and velocity in inertial axes, clock (m, m/s), PDOP.
#[derive(Clone, Copy, Debug)]
struct Solution {
    at: Moving,
    bias: f64,
    rate: f64,
    pdop: f64,
}

/// Satellite navigation receiver: position, velocity and clock from ranges to visible navigation satellites, with errors; sampled.
#[model("sensors.gnss")]
impl SizedModel for Gnss {
    type Params = GnssParams;

    fn ports(p: &GnssParams) -> SizedPorts {
        let count = (p.planes.min(SIDE_MAX) * p.per_plane.min(SIDE_MAX)) as usize;
        let errors = PortSpec::named("error", PortKind::Numbers, count)
            .unit_of("m")
            .doc_of("Time-correlated range error of each satellite, plane by plane.");
        SizedPorts {
            feedthrough_inputs: GnssIn::specs(),
            feedthrough_outputs: GnssOut::specs(),
            discrete: GnssClock::specs().into_iter().chain([errors]).collect(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(p: GnssParams) -> Result<Self, BuildError> {
        let body = p.world.body();
        let wrong =
            |fact: String, help: &str, param: &str| Err(BuildError::new(fact).help(help).at(param));
        let Some(a) = p.orbit_radius.or((body == "earth").then_some(GPS)) else {
            let fact =
                format!("there are no navigation satellites around `{body}`, the body of `world`");
            let help = "remove the receiver, or write `orbit_radius` with `planes`, `per_plane` and `inclination` of a custom constellation";
            return wrong(fact, help, "orbit_radius");
        };
        if let Axes::Level(_) = p.world.axes() {
            let fact = "its satellites orbit, but with `turning: false` of the world W does not rotate under them";
            return Err(
                BuildError::new(fact).help("remove `turning: false` from the `site` of `world`")
            );
        }
        let Some(mu) = p.world.mu() else {
            let fact = "the gravitational parameter of the world's body is unknown";
            return Err(BuildError::new(fact).help("write `mu` in `world`"));
        };
        let (site, radius) = (p.world.axes().site(), p.world.radius());
        let up = match site {
            Some(_) => Vec3::z(),
            None => p.world.planet_axes(0.0) * Vec3::z(),
        };
        // The smallest rotation is not unique for a pole along −z, so it is a half turn about x.
        let half = Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI);
        let pole = Quat::rotation_between(&Vec3::z(), &up).unwrap_or(half);
        Ok(Gnss { p, mu, a, radius, site, pole })
    }

    fn feedthrough(&self, clock: &Clock, d: &[f64], u: &[f64], y: &mut [f64]) {
        let mount = GnssIn::get(u).mount;
        if !mount.position.iter().chain(mount.velocity.iter()).all(|x| x.is_finite()) {
            // A non-finite pose gives NaN outputs, which stop the run with an error.
            y.fill(f64::NAN);
            return;
        }
        let (count, found) = self.fix(clock, &mount, d);
        let satellites = f64::from(count);
        let zero = Vec3::zeros();
        let none = GnssOut {
            position: zero,
            velocity: zero,
            clock: 0.0,
            drift: 0.0,
            fix: false,
            satellites,
            pdop: 0.0,
        };
        let told = found.map_or(none, |s| {
            let (position, velocity) = self.in_W(clock.t, &s.at);
            let (clock, drift) = (s.bias / LIGHT, s.rate / LIGHT);
            GnssOut { position, velocity, clock, drift, fix: true, satellites, pdop: s.pdop }
        });
        told.put(y);
    }

    fn update(&self, clock: &Clock, d: &mut [f64]) {
        let p = &self.p;
        let (own, errors) = self.state(clock, d);
        let (root, dt) = (clock.dt.max(0.0).sqrt(), clock.dt.max(0.0));
        let (white, walk) = (LIGHT * p.clock_white * root, LIGHT * p.clock_walk * root);
        let n = [3, 4, 5].map(|lane| clock.normal(lane));
        let next = GnssClock {
            bias: own.bias
                + own.rate * dt
                + white * n[0]
                + walk * dt * (0.5 * n[1] + n[2] / 12f64.sqrt()),
            rate: own.rate + walk * n[1],
            drawn: true,
        };
        let phi = (-dt / p.wander_time).exp();
        let fresh = p.wander_sigma * (1.0 - phi * phi).sqrt();
        let (first, each) = d.split_at_mut(GnssClock::N);
        next.put(first);
        for (k, (e, old)) in each.iter_mut().zip(errors).enumerate() {
            // These noise channels differ from the channels of the initial errors.
            *e = phi * old + fresh * clock.normal(NEXT + k as u32);
        }
    }
}

/// First noise channel of the updates of the range errors.
const NEXT: u32 = OWN + EACH * SATELLITES_MAX;

#[cfg(test)]
#[path = "gnss_tests.rs"]
mod tests;
