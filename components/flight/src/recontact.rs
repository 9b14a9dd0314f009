//! `flight.recontact`: clearance of two bodies after separation: present, least so far, and predicted.
//! ```text
//! d = p_b − p_a       clearance = |d| − r_a − r_b       rate = d · v/|d|,  v = v_b − v_a
//! predicted: both go straight on, t* = max(0, −d·v/v²), at most `horizon`:  |d + v t*| − r_a − r_b
//! parted:    the least counts from where the clearance has first been so large: what was one body is together at the start
//! ```
//! Each body is represented by a bounding sphere about its node. The model is sampled. The least clearance includes the motion between samples, which
//! is extrapolated with constant relative velocity; the error is at most a Δt²/8 for the relative acceleration a. W may rotate, because distances do
//! not depend on the axes; the prediction is then valid for times that are short compared with a rotation of W.

use linkwork_runtime::prelude::*;

/// Bounding spheres and limits.
#[derive(Params, Clone, Debug)]
pub struct RecontactParams {
    /// Radius of the bounding sphere of a.
    #[param(unit = "m", range = 0.0..)]
    pub radius_a: f64,
    /// Radius of the bounding sphere of b.
    #[param(unit = "m", range = 0.0..)]
    pub radius_b: f64,
    /// Clearance at which the bodies count as separated; the least clearance is recorded from then on. Default: recorded from the start.
    #[param(unit = "m", range = 0.0..)]
    pub parted: Option<f64>,
    /// Prediction horizon.
    #[param(unit = "s", default = 60.0, range = 0.0..)]
    pub horizon: f64,
}

/// The two bodies.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RecontactIn {
    /// Node on body a.
    #[port(bind = "a")]
    pub a: NodeState,
    /// Node on body b.
    #[port(bind = "b")]
    pub b: NodeState,
}

/// Clearances.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RecontactOut {
    /// Clearance of the spheres; negative if they overlap.
    #[port("m")]
    pub clearance: f64,
    /// Rate of the clearance.
    #[port("m/s")]
    pub rate: f64,
    /// Least clearance so far; before separation the present clearance.
    #[port("m")]
    pub least: f64,
    /// Least clearance within the horizon for constant relative velocity.
    #[port("m")]
    pub predicted: f64,
    /// Time until the predicted least clearance.
    #[port("s")]
    pub time: f64,
}

/// Least clearance so far.
#[derive(State, Clone, Copy, Debug)]
pub struct Least {
    /// Recording has begun.
    #[port]
    pub taken: bool,
    /// Least clearance at the samples so far and between them.
    #[port("m")]
    pub clearance: f64,
}

/// Returns clearance (m) and its rate (m/s) of two spheres.
fn clearance(p: &RecontactParams, u: &RecontactIn) -> (f64, f64) {
    let (d, v) = (u.b.position - u.a.position, u.b.velocity - u.a.velocity);
    let distance = d.norm();
    let rate = if distance > 0.0 { d.dot(&v) / distance } else { v.norm() };
    (distance - p.radius_a - p.radius_b, rate)
}

/// Returns the least clearance (m) within the horizon for constant relative velocity, and the time until then (s).
fn ahead(p: &RecontactParams, horizon: f64, u: &RecontactIn) -> (f64, f64) {
    let (d, v) = (u.b.position - u.a.position, u.b.velocity - u.a.velocity);
    let square = v.norm_squared();
    let t = if square > 0.0 { (-d.dot(&v) / square).clamp(0.0, horizon) } else { 0.0 };
    ((d + v * t).norm() - p.radius_a - p.radius_b, t)
}

/// Monitor of the clearance of two bodies.
pub struct Recontact {
    p: RecontactParams,
}

impl Recontact {
    fn least(&self, d: &Least, now: f64) -> f64 {
        if d.taken { d.clearance.min(now) } else { now }
    }
}

/// Clearance of two bodies after separation: present, least so far, and predicted; sampled.
#[model("flight.recontact")]
impl Model for Recontact {
    type Params = RecontactParams;
    type FeedthroughInputs = RecontactIn;
    type FeedthroughOutputs = RecontactOut;
    type DiscreteState = Least;
    fn init_d(&self) -> Least {
        Least { taken: false, clearance: 0.0 }
    }
    fn feedthrough(&self, d: &Least, u: &RecontactIn) -> RecontactOut {
        let (clearance, rate) = clearance(&self.p, u);
        let (predicted, time) = ahead(&self.p, self.p.horizon, u);
        RecontactOut { clearance, rate, least: self.least(d, clearance), predicted, time }
    }
    fn update(&self, clock: &Clock, d: &Least, u: &RecontactIn) -> Least {
        if !d.taken && self.p.parted.is_some_and(|parted| !(clearance(&self.p, u).0 >= parted)) {
            return *d;
        }
        // Also cover the time until the next sample.
        let (until_next, _) = ahead(&self.p, clock.dt, u);
        Least { taken: true, clearance: self.least(d, until_next) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn watch() -> Recontact {
        Recontact {
            p: RecontactParams { radius_a: 1.0, radius_b: 0.5, parted: None, horizon: 100.0 },
        }
    }

    fn pair(d: Vec3, v: Vec3) -> RecontactIn {
        let a = NodeState {
            position: Vec3::new(7e6, 3.0, -2.0),
            velocity: Vec3::new(10.0, 7e3, 1.0),
            ..NodeState::identity()
        };
        let b = NodeState { position: a.position + d, velocity: a.velocity + v, ..a };
        RecontactIn { a, b }
    }

    /// Returns the least clearance after samples of a relative motion, and the true one from fine steps.
    fn flown(of: impl Fn(f64) -> (Vec3, Vec3), period: f64, rows: u64) -> (f64, f64) {
        flown_by(&watch(), of, period, rows)
    }

    fn flown_by(
        m: &Recontact,
        of: impl Fn(f64) -> (Vec3, Vec3),
        period: f64,
        rows: u64,
    ) -> (f64, f64) {
        let mut d = m.init_d();
        let mut truth = f64::INFINITY;
        for n in 0..rows {
            let t = n as f64 * period;
            let (p, v) = of(t);
            let u = pair(p, v);
            d = m.update(&Clock::at(t, period, n), &d, &u);
            truth = (0..1000)
                .map(|k| of(t + 1e-3 * f64::from(k) * period).0.norm() - 1.5)
                .fold(truth, f64::min);
        }
        (d.clearance, truth)
    }

    #[test]
    fn the_least_is_that_of_a_pass_between_samples() {
        // The result is exact for straight motion, although the closest approach is between two samples.
        let straight = |t: f64| (Vec3::new(-10.05 + 2.0 * t, 3.0, 4.0), Vec3::new(2.0, 0.0, 0.0));
        let (least, truth) = flown(straight, 0.1, 200);
        assert!((least - 3.5).abs() < 1e-9 && (truth - 3.5).abs() < 1e-6, "{least} {truth}");
        // The error is at most a Δt²/8 for a body that drag brings back.
        let back =
            |t: f64| (Vec3::new(4.0 * t - 0.5 * t * t, 2.0, 0.0), Vec3::new(4.0 - t, 0.0, 0.0));
        let (least, truth) = flown(|t| back(t + 0.5), 0.1, 120);
        assert!((least - truth).abs() < 1.3e-3 && least < 0.51, "{least} {truth}");
        // A body that only moves away is nearest at the start.
        let away = |t: f64| (Vec3::new(2.0 + t, 0.0, 0.0), Vec3::x());
        assert!((flown(away, 0.1, 50).0 - 0.5).abs() < 1e-9);
    }

    /// The least clearance of bodies that overlap at the start is the value at separation, or a later smaller one.
    #[test]
    fn what_was_one_body_counts_from_where_it_has_parted() {
        let m = Recontact { p: RecontactParams { parted: Some(1.0), ..watch().p } };
        let away = |t: f64| (Vec3::x() * t, Vec3::x());
        let (least, truth) = flown_by(&m, away, 0.1, 100);
        assert!((1.0..1.1 + 1e-9).contains(&least) && truth < -1.4, "{least} {truth}");
        // The distance 3.5 t − t²/2 reaches 1 m at 0.81 s, increases, and decreases to 1.5 m at 6.5
        // s.
        let back = |t: f64| (Vec3::x() * (3.5 * t - 0.5 * t * t), Vec3::x() * (3.5 - t));
        let (least, _) = flown_by(&m, back, 0.1, 66);
        let end = 3.5 * 6.6 - 0.5 * 6.6 * 6.6 - 1.5;
        assert!((least - end).abs() < 0.01 && least < 0.0, "{least} {end}");
        // Before separation nothing is recorded.
        let mut d = m.init_d();
        d = m.update(&Clock::at(0.0, 0.1, 0), &d, &pair(Vec3::x(), Vec3::x()));
        assert!(!d.taken);
    }

    #[test]
    fn it_looks_ahead_as_far_as_its_horizon() {
        let m = watch();
        let at = |u: RecontactIn| m.feedthrough(&m.init_d(), &u);
        let y = at(pair(Vec3::new(-30.0, 4.0, 3.0), Vec3::new(2.0, 0.0, 0.0)));
        assert!((y.predicted - 3.5).abs() < 1e-9 && (y.time - 15.0).abs() < 1e-9);
        assert!((y.clearance - (925f64.sqrt() - 1.5)).abs() < 1e-9 && y.rate < 0.0);
        let y = at(pair(Vec3::new(-500.0, 0.0, 0.0), Vec3::new(2.0, 0.0, 0.0)));
        assert!((y.time - 100.0).abs() < 1e-12 && (y.predicted - 298.5).abs() < 1e-6);
        // Test separate bodies, bodies at rest, and overlapping bodies.
        let y = at(pair(Vec3::new(30.0, 0.0, 0.0), Vec3::x()));
        assert_eq!((y.time, y.predicted), (0.0, y.clearance));
        assert_eq!(at(pair(Vec3::new(30.0, 0.0, 0.0), Vec3::zeros())).time, 0.0);
        let y = at(pair(Vec3::zeros(), Vec3::zeros()));
        assert_eq!((y.clearance, y.rate), (-1.5, 0.0));
    }
}
