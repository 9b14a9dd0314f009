//! `flight.entry_guidance`: Apollo-class entry guidance by bank angle, with phases, bank reversals and limits.
//! ```text
//! before D reaches `begin`          σ = `pre_bank` (sign towards the target)
//! range control, V > heading_speed  |σ| = arccos u of [`lift`](super::entry::lift), u in −1 … 1
//!     sign   keeps, and changes when |cross| > c₀ + c₁ V² on the side to which the lift pushes
//! heading alignment, V below it     σ = clamp(k · heading error, ±limit), lift up
//! u beyond −1 … 1: the target is out of reach; all of the lift is flown up or down, and `short` counts the time
//! commanded σ follows with `rate_max` and `acceleration_max`, as a held value between samples, and stops where it is wanted
//! heading error: angle from the ground track to the target, positive to the right; cross = angle · range to go
//! ```
//! The planet is at the origin of W and rotates about z, or W is a site on it; speeds are relative to its surface. The reference trajectory is
//! computed when the model is built, for a vehicle in an exponential atmosphere ([`Vehicle::reference`](super::entry::Vehicle::reference)).

use super::entry::{ReferenceRow, Vehicle, at_speed, lift};
use super::ground_motion::east_north_up;
use super::planet::{Frame, over_ground};
use crate::orbit::body_mu;
use linkwork_surroundings::prelude::*;

/// Target, reference and limits.
#[derive(Params, Clone, Debug)]
pub struct EntryGuidanceParams {
    /// Direction of the target from the planet's centre, in planet-fixed axes. Default: the site W.
    pub target: Option<Vec3>,
    /// Distance east and north by which the target is moved over the surface.
    #[param(default = [0.0, 0.0])]
    pub offset: [f64; 2],
    /// The world, whose atmosphere the vehicle enters.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Density at height 0 of the reference atmosphere.
    #[param(unit = "kg/m^3")]
    pub density: f64,
    /// Scale height of the reference atmosphere.
    #[param(unit = "m")]
    pub scale_height: f64,
    /// Ballistic coefficient m/(C_D S) of the reference.
    #[param(unit = "kg/m^2")]
    pub ballistic: f64,
    /// Lift-to-drag ratio L/D of the reference.
    pub lift_to_drag: f64,
    /// Vertical lift fraction cos σ of the reference.
    #[param(default = 0.5)]
    pub lift_ref: f64,
    /// Initial height of the reference.
    #[param(unit = "m")]
    pub start_height: f64,
    /// Initial speed of the reference.
    #[param(unit = "m/s")]
    pub start_speed: f64,
    /// Initial flight path angle of the reference, negative downwards.
    #[param(unit = "rad")]
    pub start_angle: f64,
    /// Final speed of the reference.
    #[param(unit = "m/s")]
    pub end_speed: f64,
    /// Overcontrol gain K of the range control.
    #[param(default = 5.0, range = 0.0..)]
    pub gain: f64,
    /// Drag deceleration at which range control begins.
    #[param(unit = "m/s^2", default = 1.96, range = 0.0..)]
    pub begin: f64,
    /// Bank angle before range control.
    #[param(unit = "rad", default = 1.0, range = 0.0..=3.15)]
    pub pre_bank: f64,
    /// Crossrange deadband c₀.
    #[param(unit = "m", default = 2000.0, range = 0.0..)]
    pub deadband: f64,
    /// Growth c₁ of the crossrange deadband with V².
    #[param(unit = "s^2/m", default = 2e-4, range = 0.0..)]
    pub deadband_growth: f64,
    /// Speed below which the heading is aligned with the target.
    #[param(unit = "m/s", default = 1100.0, range = 0.0..)]
    pub heading_speed: f64,
    /// Gain of bank angle over heading error during heading alignment.
    #[param(default = 4.0, range = 0.0..)]
    pub heading_gain: f64,
    /// Greatest bank angle during heading alignment.
    #[param(unit = "rad", default = 0.52, range = 0.0..=3.15)]
    pub heading_limit: f64,
    /// Greatest bank rate.
    #[param(unit = "rad/s", default = 0.35, range = 1e-6..)]
    pub rate_max: f64,
    /// Greatest bank acceleration; MSL used 5 deg/s².
    #[param(unit = "rad/s^2", default = f64::INFINITY, range = 1e-6..)]
    pub acceleration_max: f64,
}

/// Navigation state.
#[derive(Ports, Clone, Copy, Debug)]
pub struct EntryGuidanceIn {
    /// Estimated state of the vehicle from navigation.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Measured drag deceleration.
    #[port("m/s^2")]
    pub drag: f64,
}

/// Bank command and status.
#[derive(Ports, Clone, Copy, Debug)]
pub struct EntryGuidanceOut {
    /// Commanded bank angle; positive turns the trajectory to the right.
    #[port("rad")]
    pub bank: f64,
    /// Range to go along the surface.
    #[port("m")]
    pub range: f64,
    /// Heading error; positive: the target is to the right.
    #[port("rad")]
    pub heading_error: f64,
    /// Phase: 0 before range control, 1 range control, 2 heading alignment.
    #[port("1")]
    pub phase: f64,
    /// Number of bank reversals.
    #[port("1")]
    pub reversals: f64,
    /// Vertical lift fraction cos σ that range control requires. Values outside −1 … 1 cannot be reached; full lift up or down is then commanded.
    #[port("1")]
    pub lift: f64,
    /// Accumulated time in which the required lift exceeded the available lift, so that the target was out of reach.
    #[port("s")]
    pub short: f64,
}

/// State of the guidance.
#[derive(State, Clone, Copy, Debug)]
pub struct Banking {
    /// Commanded bank angle.
    #[port("rad")]
    pub bank: f64,
    /// Rate of the commanded bank angle.
    #[port("rad/s")]
    pub rate: f64,
    /// Side of the lift: 1 right, −1 left, 0 not chosen yet.
    #[port("1")]
    pub side: f64,
    /// Phase of the guidance.
    #[port("1")]
    pub phase: f64,
    /// Number of bank reversals.
    #[port("1")]
    pub reversals: f64,
    /// Vertical lift fraction that range control required last.
    #[port("1")]
    pub lift: f64,
    /// Accumulated time in which the required lift exceeded the available lift.
    #[port("s")]
    pub short: f64,
}

/// Apollo-class entry guidance.
pub struct EntryGuidance {
    p: EntryGuidanceParams,
    frame: Frame,
    radius: f64,
    /// Unit vector to the target, planet-fixed axes.
    target: Vec3,
    rows: Vec<ReferenceRow>,
}

/// Returns range to go (m), heading error (rad), ground-relative speed (m/s) and vertical speed (m/s).
pub fn to_target(
    body: &NodeState,
    target: &Vec3,
    (rate, radius, t): (f64, f64, f64),
) -> (f64, f64, f64, f64) {
    let up = body.position.normalize();
    let v = over_ground(body, rate);
    let goal = Quat::from_scaled_axis(Vec3::z() * (rate * t)) * target;
    let range = radius * up.cross(&goal).norm().atan2(up.dot(&goal));
    let rise = v.dot(&up);
    let (track, way) = (v - up * rise, goal - up * goal.dot(&up));
    // The direction to the right is −up × track.
    let error = (-track.cross(&way).dot(&up)).atan2(track.dot(&way));
    (range, error, v.norm(), rise)
}

/// Returns the step in the next `dt` (s) of a quantity with the remaining `error` and the present `rate`. The step respects both limits, and the
/// quantity can stop at the target without overshoot. With n + 1 samples left, in each of which the rate r decreases by a Δ, the distance is Δ ((n +
/// 1) r − a Δ n (n + 1)/2).
fn follow(error: f64, rate: f64, (rate_max, acceleration_max): (f64, f64), dt: f64) -> f64 {
    let (most, change) = (rate_max * dt, acceleration_max * dt * dt);
    let stopping = if change.is_finite() && change > 0.0 {
        let n = (0.5 * ((1.0 + 8.0 * error.abs() / change).sqrt() - 3.0)).ceil().max(0.0);
        error.abs() / (n + 1.0) + 0.5 * change * n
    } else {
        error.abs()
    };
    let wanted = error.signum() * stopping.min(most);
    let now = rate * dt;
    let within = if change.is_finite() { wanted.clamp(now - change, now + change) } else { wanted };
    within.clamp(-most, most)
}

impl EntryGuidance {
    fn decide(&self, c: &Clock, d: &Banking, u: &EntryGuidanceIn) -> Banking {
        let p = &self.p;
        let place = (self.frame.rate, self.radius, c.t);
        let body = self.frame.node(&u.body);
        let (range, error, speed, rise) = to_target(&body, &self.target, place);
        let mut out = *d;
        if out.side == 0.0 {
            out.side = if error < 0.0 { -1.0 } else { 1.0 };
        }
        out.phase = if speed < p.heading_speed && d.phase > 0.5 {
            2.0
        } else if u.drag >= p.begin {
            d.phase.max(1.0)
        } else {
            d.phase
        };
        let wanted = if out.phase > 1.5 {
            (p.heading_gain * error).clamp(-p.heading_limit, p.heading_limit)
        } else {
            let size = if out.phase > 0.5 {
                let row = at_speed(&self.rows, speed);
                out.lift = lift(&row, p.lift_ref, p.gain, (range, u.drag, rise));
                if out.lift.abs() > 1.0 {
                    out.short += c.dt;
                }
                out.lift.clamp(-1.0, 1.0).acos()
            } else {
                p.pre_bank
            };
            let cross = range * error.sin();
            // The lift points away from the target, and the crossrange exceeds the deadband.
            let limit = p.deadband + p.deadband_growth * speed * speed;
            if out.phase > 0.5 && -cross * out.side > limit {
                out.side = -out.side;
                out.reversals += 1.0;
            }
            size * out.side
        };
        let step = follow(wanted - d.bank, d.rate, (p.rate_max, p.acceleration_max), c.dt);
        out.bank = d.bank + step;
        out.rate = if c.dt > 0.0 { step / c.dt } else { 0.0 };
        out
    }
}

/// Entry guidance with a reference trajectory: range control by bank angle, bank reversals, heading alignment; sampled.
#[model("flight.entry_guidance")]
impl Model for EntryGuidance {
    type Params = EntryGuidanceParams;
    type FeedthroughInputs = EntryGuidanceIn;
    type FeedthroughOutputs = EntryGuidanceOut;
    type DiscreteState = Banking;
    fn build(p: EntryGuidanceParams) -> Result<Self, BuildError> {
        let frame = Frame::new(Some(&p.world), None)?;
        if frame.is_level() {
            let fact =
                "ranges are measured over the sphere of a planet, but the ground is level here";
            return Err(
                BuildError::new(fact).help("remove `turning: false` from the `site` of `world`")
            );
        }
        let radius = p.world.radius();
        let gravity = body_mu(&p.world)? / (radius * radius);
        let target = p.target.or(frame.site()).unwrap_or_else(Vec3::zeros);
        if !(target.norm() > 1e-9) {
            let help = "write a vector from the planet's centre, e.g. target: [1, 0, 0], or write a `site` in `world`";
            return Err(BuildError::new("the target direction is missing or zero")
                .help(help)
                .at("target"));
        }
        let [east, north] = p.offset.map(|d| d / radius);
        let target = target.normalize() + east_north_up(&target) * Vec3::new(east, north, 0.0);
        for (name, value) in [
            ("density", p.density),
            ("scale_height", p.scale_height),
            ("ballistic", p.ballistic),
            ("lift_to_drag", p.lift_to_drag),
            ("start_speed", p.start_speed),
            ("end_speed", p.end_speed),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                let fact = format!("{name} is {value}, so no reference trajectory exists");
                return Err(BuildError::new(fact).help("write a number greater than 0").at(name));
            }
        }
        if !(p.lift_ref.abs() <= 1.0) {
            let fact = format!("`lift_ref` is {}, which is not a cosine", p.lift_ref);
            return Err(BuildError::new(fact).help("write a number from -1 to 1").at("lift_ref"));
        }
        let vehicle = Vehicle {
            radius,
            gravity,
            density: p.density,
            scale_height: p.scale_height,
            ballistic: p.ballistic,
            lift_to_drag: p.lift_to_drag,
        };
        let start = [0.0, p.start_speed, p.start_angle, p.start_height];
        match vehicle.reference(start, p.lift_ref, p.end_speed, 0.25) {
            Some(rows) if rows.len() > 2 => {
                Ok(EntryGuidance { p, frame, radius, target: target.normalize(), rows })
            }
            _ => Err(BuildError::new(format!(
                "the reference trajectory does not slow down to {} m/s above the ground",
                p.end_speed
            ))
            .help("change `lift_ref`, `start_angle`, `ballistic` or `end_speed`")
            .at("end_speed")),
        }
    }
    fn feedthrough(&self, clock: &Clock, d: &Banking, u: &EntryGuidanceIn) -> EntryGuidanceOut {
        let place = (self.frame.rate, self.radius, clock.t);
        let body = self.frame.node(&u.body);
        let (range, heading_error, _, _) = to_target(&body, &self.target, place);
        let now = self.decide(clock, d, u);
        let Banking { bank, phase, reversals, lift, short, .. } = now;
        EntryGuidanceOut { bank, range, heading_error, phase, reversals, lift, short }
    }
    fn update(&self, clock: &Clock, d: &Banking, u: &EntryGuidanceIn) -> Banking {
        self.decide(clock, d, u)
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::aerodynamics::entry::force;
    use super::*;
    use linkwork_surroundings::PlainWorld;

    /// 3.71 m/s² at the surface.
    const MU: f64 = 3.71 * 3_396_190.0 * 3_396_190.0;

    fn params(target: Vec3) -> EntryGuidanceParams {
        EntryGuidanceParams {
            target: Some(target),
            offset: [0.0, 0.0],
            world: PlainWorld::inertial(MU, 3_396_190.0, 7.088_218_1e-5).handle(),
            density: 0.0158,
            scale_height: 9354.0,
            ballistic: 137.0,
            lift_to_drag: 0.24,
            lift_ref: 0.5,
            start_height: 80_000.0,
            start_speed: 5845.0,
            start_angle: -0.26,
            end_speed: 450.0,
            gain: 5.0,
            begin: 1.96,
            pre_bank: 1.0,
            deadband: 2000.0,
            deadband_growth: 2e-4,
            heading_speed: 1100.0,
            heading_gain: 4.0,
            heading_limit: 0.52,
            rate_max: 0.35,
            acceleration_max: f64::INFINITY,
        }
    }

    #[test]
    fn range_and_heading_are_those_of_a_globe() {
        let body = NodeState {
            position: Vec3::x() * 3.45e6,
            velocity: Vec3::new(-500.0, 4000.0 + 7e-5 * 3.45e6, 0.0),
            ..NodeState::identity()
        };
        // The target is 0.1 rad ahead and slightly south, that is, to the right of an eastward track.
        let target = Vec3::new(0.1f64.cos(), 0.1f64.sin(), -0.002).normalize();
        let (range, error, speed, rise) = to_target(&body, &target, (7e-5, 3.4e6, 0.0));
        assert!(
            (range - 3.4e6 * target.x.acos()).abs() < 1e-3 && (error - 0.02).abs() < 1e-3,
            "{range} {error}"
        );
        assert!((rise + 500.0).abs() < 1e-9 && (speed - 4031.1).abs() < 0.1);
        // The target rotates with the planet.
        let later = to_target(&body, &target, (7e-5, 3.4e6, 100.0));
        assert!(later.0 > range + 2e4);
    }

    /// A complete guided entry in three dimensions, with a density error of 10 %, reaches range and heading of the target.
    fn miss(thicker: f64, (far, aside): (f64, f64), guided: bool) -> (f64, f64, Banking) {
        let (rate, radius) = (7.088_218_1e-5, 3_396_190.0);
        let omega = Vec3::z() * rate;
        let vehicle = Vehicle {
            radius,
            gravity: 3.71,
            density: 0.0158,
            scale_height: 9354.0,
            ballistic: 137.0,
            lift_to_drag: 0.24,
        };
        let rows = vehicle.reference([0.0, 5845.0, -0.26, 80_000.0], 0.5, 450.0, 0.25).unwrap();
        // The target is at the range of the reference plus `far`, with a crossrange offset.
        let mut x = [0.0, 5845.0, -0.26, 80_000.0];
        while x[1] < rows[0].speed - 1e-9 {
            x = vehicle.step(&x, 0.5, 0.25);
        }
        let angle = (x[0] + rows[0].range + far) / radius;
        let start = Vec3::x();
        let target = Vec3::new(angle.cos(), angle.sin(), aside / radius);
        let m = EntryGuidance::build(params(target)).unwrap();
        let mut r = start * (radius + 80_000.0);
        let mut v =
            (Vec3::y() * 0.26f64.cos() - Vec3::x() * 0.26f64.sin()) * 5845.0 + omega.cross(&r);
        let mut d = Banking::zero();
        let (mut t, h) = (0.0, 0.05);
        loop {
            let through = v - omega.cross(&r);
            let height = r.norm() - radius;
            let drag = thicker * vehicle.drag(height, through.norm());
            let body = NodeState { position: r, velocity: v, ..NodeState::identity() };
            let u = EntryGuidanceIn { body, drag };
            if (t * 4.0) as i64 != ((t - h) * 4.0) as i64 {
                d = m.update(&Clock::at(t, 0.25, 0), &d, &u);
            }
            let (range, error, speed, _) = to_target(&body, &m.target, (rate, radius, t));
            if speed < 450.0 || height < 0.0 {
                return (range * error.cos(), range * error.sin(), d);
            }
            let bank = if guided { d.bank } else { 0.5f64.acos() };
            let lift = 0.24 * drag;
            let f = force(&through, &r, bank, lift, drag);
            let a = f - r * (3.71 * radius * radius / r.norm().powi(3));
            v += a * h;
            r += v * h;
            t += h;
        }
    }

    #[test]
    fn a_guided_entry_arrives_where_an_unguided_one_does_not() {
        let mut shortest = 0.0_f64;
        for (thicker, aside) in [(1.0, 0.0), (1.1, 4000.0), (0.9, -4000.0)] {
            let (along, across, Banking { reversals, short, .. }) =
                miss(thicker, (0.0, aside), true);
            let (free_along, free_across, _) = miss(thicker, (0.0, aside), false);
            println!(
                "air × {thicker}, {aside} m aside: {along:.0}, {across:.0} m after {reversals} reversals; without {free_along:.0}, {free_across:.0} m"
            );
            assert!(along.hypot(across) < 0.4 * free_along.hypot(free_across));
            assert!(along.abs() < 6000.0 && across.abs() < 2500.0 && reversals >= 1.0);
            shortest = shortest.max(short);
        }
        // If the target is too far or too near to be reached, the command is full lift up or down, and `short` reports
        // it.
        for (far, down) in [(200e3, 1.0), (-200e3, -1.0)] {
            let (along, _, d) = miss(1.0, (far, 0.0), true);
            println!(
                "{far} m farther: {along:.0} m left, short for {} s; else {shortest} s",
                d.short
            );
            assert!(along * down > 10e3 && d.short > 3.0 * shortest && d.short > 30.0);
        }
    }

    /// A step of the bank angle respects both limits, does not overshoot, and takes nearly the least time.
    #[test]
    fn the_bank_comes_to_rest_where_it_is_wanted() {
        let (rate_max, most, dt) = (0.35, 0.0873, 0.25);
        for wanted in [-2.0, -0.3, 0.004, 0.05, 0.7, 2.4] {
            let (mut bank, mut rate, mut arrived) = (0.0_f64, 0.0_f64, None);
            for k in 0..200 {
                let next = follow(wanted - bank, rate, (rate_max, most), dt) / dt;
                assert!(next.abs() <= rate_max * (1.0 + 1e-12));
                assert!((next - rate).abs() <= most * dt * (1.0 + 1e-9), "{next} after {rate}");
                bank += next * dt;
                rate = next;
                assert!(bank.abs() <= wanted.abs() * (1.0 + 1e-12), "{bank} of {wanted}");
                if arrived.is_none() && (bank - wanted).abs() < 1e-9 {
                    arrived = Some(f64::from(k + 1) * dt);
                }
            }
            assert!((bank - wanted).abs() < 1e-12 && rate.abs() < 1e-12, "{bank} of {wanted}");
            // Compare with the least time that continuous control would take.
            let size = wanted.abs();
            let least = if size < rate_max * rate_max / most {
                2.0 * (size / most).sqrt()
            } else {
                size / rate_max + rate_max / most
            };
            let took = arrived.unwrap();
            assert!(took < least + 3.0 * dt, "{took} s, {least} at least");
        }
        // Only the rate is limited if the acceleration has no limit.
        assert_eq!(follow(0.01, 0.0, (0.35, f64::INFINITY), 0.25), 0.01);
        assert_eq!(follow(-9.0, 0.35, (0.35, f64::INFINITY), 0.25), -0.35 * 0.25);
    }

    #[test]
    fn an_offset_moves_the_target_over_the_ground() {
        let target = Vec3::new(0.3, -0.8, 0.4);
        let m = EntryGuidance::build(EntryGuidanceParams {
            offset: [3000.0, -4000.0],
            ..params(target)
        });
        let m = m.unwrap();
        let body = NodeState {
            position: target.normalize() * 3.5e6,
            velocity: east_north_up(&target) * Vec3::new(0.0, 100.0, 0.0),
            ..NodeState::identity()
        };
        let (range, error, _, _) = to_target(&body, &m.target, (0.0, 3_396_190.0, 0.0));
        assert!((range - 5000.0).abs() < 0.01, "{range}");
        // The heading is north, and the target with its offset is in the south-east.
        assert!((error - (std::f64::consts::FRAC_PI_2 + (4.0f64 / 3.0).atan())).abs() < 1e-6);
    }

    #[test]
    fn a_target_without_a_direction_is_refused() {
        assert!(
            EntryGuidance::build(params(Vec3::zeros()))
                .is_err_and(|e| e.param.as_deref() == Some("target"))
        );
        let p = EntryGuidanceParams { start_angle: -1.2, ..params(Vec3::x()) };
        assert!(EntryGuidance::build(p).is_err_and(|e| e.help.is_some()));
    }

    /// A reference that begins so high that its speed first increases has two rows with the same speed; only rows after the greatest speed are used.
    #[test]
    fn a_reference_that_speeds_up_at_first_asks_for_its_own_lift() {
        let p = EntryGuidanceParams {
            target: Some(Vec3::new(0.994_165_314_562_150_4, 0.107_867_174_439_403_15, 0.0)),
            world: PlainWorld::inertial(MU, 3_396_190.0, 0.0).handle(),
            ballistic: 140.0,
            start_height: 125e3,
            start_angle: -0.2705,
            ..params(Vec3::x())
        };
        let m = EntryGuidance::build(p).unwrap();
        assert!(m.rows.windows(2).all(|w| w[0].speed > w[1].speed), "speeds do not fall");
        // Use a state of the reference itself, at 5868 m/s.
        let row = m.rows[40];
        let u = lift(&at_speed(&m.rows, row.speed), 0.5, 5.0, (row.range, row.drag, row.rise));
        assert!((u - 0.5).abs() < 1e-9, "{u}");
    }
}
