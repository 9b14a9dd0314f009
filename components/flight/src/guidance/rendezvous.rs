//! `flight.station_keeping`: holds a deputy at a position relative to a chief, in the chief's rotating (RTN) axes.
//! ```text
//! x radial, y along the motion, z normal to the orbit (RTN), n = |r × v|/r² of the chief
//! a = −a_CW(x, ẋ) − 2 ζ ω ẋ − ω² (x − x_T)         a_CW: what Clohessy and Wiltshire's equations do without thrust
//! F = m a, cut off at F_max, in W
//! ```
//! The law first cancels the relative orbital acceleration, so that the error decays as e^(−ζωt) on a circular orbit. r and v are inertial; if W is a
//! site, the rotation of its planet is added. Transfers and approaches are in `approach`.

use super::planet::inertial;
use crate::orbit::orbital;
use linkwork_surroundings::prelude::*;

/// Position and gains of the law.
#[derive(Params, Clone, Debug)]
pub struct StationParams {
    /// Commanded position x_T in the chief's axes: radial, along the motion, normal.
    #[param(unit = "m", default = Vec3::zeros())]
    pub place: Vec3,
    /// Natural frequency ω of the law.
    #[param(unit = "rad/s", default = 0.01, range = 0.0..)]
    pub frequency: f64,
    /// Damping ratio ζ.
    #[param(default = 1.0, range = 0.0..)]
    pub damping: f64,
    /// Mass of the deputy.
    #[param(unit = "kg", range = 1e-6..)]
    pub mass: f64,
    /// Greatest force F_max.
    #[param(unit = "N", default = f64::INFINITY, range = 0.0..)]
    pub force_max: f64,
    /// The world, whose body chief and deputy orbit.
    #[param(service)]
    pub world: Handle<dyn World>,
}

/// The two spacecraft.
#[derive(Ports, Clone, Copy, Debug)]
pub struct StationIn {
    /// The chief; the planet is at the origin of W, or W is a site on it.
    #[port(bind = "chief")]
    pub chief: NodeState,
    /// The deputy.
    #[port(bind = "deputy")]
    pub deputy: NodeState,
}

/// Force command and relative state.
#[derive(Ports, Clone, Copy, Debug)]
pub struct StationOut {
    /// Commanded force, W.
    #[port("N")]
    pub force: Vec3,
    /// Position of the deputy in the chief's axes.
    #[port("m")]
    pub position: Vec3,
    /// Velocity of the deputy in the chief's rotating axes.
    #[port("m/s")]
    pub velocity: Vec3,
}

/// Station keeping.
pub struct StationKeeping {
    p: StationParams,
    site: Option<Site>,
}

/// Returns position (m) and velocity (m/s) of the deputy in the chief's rotating axes, the rotation from these axes to W, and the orbital rate n
/// (rad/s). Returns `None` if the chief has no orbital motion, because the axes are then undefined. W is inertial with the planet at its origin, or a
/// site.
pub fn relative(
    site: Option<&Site>,
    chief: &NodeState,
    deputy: &NodeState,
) -> Option<(Vec3, Vec3, Quat, f64)> {
    let (r, v) = inertial(site, chief);
    let h = r.cross(&v);
    if !(h.norm() > 0.0) {
        return None;
    }
    let (x, z) = (r.normalize(), h.normalize());
    let y = z.cross(&x);
    let axes = linkwork_spatial::Mat3::from_columns(&[x, y, z]);
    let R = linkwork_spatial::quat(&axes);
    let n = h.norm() / r.norm_squared();
    let (_, other) = inertial(site, deputy);
    let r = R.inverse() * (deputy.position - chief.position);
    let v = R.inverse() * (other - v) - Vec3::z().cross(&r) * n;
    Some((r, v, R, n))
}

/// Returns a force limited to the magnitude `most`, N.
pub(super) fn at_most(force: Vec3, most: f64) -> Vec3 {
    let size = force.norm();
    if size > most { force * (most / size) } else { force }
}

/// Station keeping: holds a deputy at a position in the rotating axes of a chief.
#[model("flight.station_keeping")]
impl Model for StationKeeping {
    type Params = StationParams;
    type FeedthroughInputs = StationIn;
    type FeedthroughOutputs = StationOut;
    fn build(p: StationParams) -> Result<Self, BuildError> {
        let site = orbital(&p.world)?;
        Ok(StationKeeping { p, site })
    }
    fn feedthrough(&self, u: &StationIn) -> StationOut {
        let p = &self.p;
        let Some((r, v, R, n)) = relative(self.site.as_ref(), &u.chief, &u.deputy) else {
            let zero = Vec3::zeros();
            return StationOut { force: zero, position: zero, velocity: zero };
        };
        let free = Vec3::new(3.0 * n * n * r.x + 2.0 * n * v.y, -2.0 * n * v.x, -n * n * r.z);
        let w = p.frequency;
        let a = -free - v * (2.0 * p.damping * w) - (r - p.place) * (w * w);
        let wanted = R * a * p.mass;
        StationOut { force: at_most(wanted, p.force_max), position: r, velocity: v }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use linkwork_world::orbit::{ClohessyWiltshire, Relative};

    pub const MU: f64 = 3.986_004_418e14;

    pub const RADIUS: f64 = 6_778_137.0;

    /// World whose body they orbit.
    pub fn world() -> Handle<dyn World> {
        linkwork_surroundings::PlainWorld::inertial(MU, 6_378_137.0, 0.0).handle()
    }

    /// Integrates two spacecraft in two-body motion: the chief on a circular orbit, the deputy with an acceleration `push` (time, chief, deputy) in
    /// W. Returns position and velocity of the deputy at the end, in the chief's axes.
    pub fn fly(
        (r0, v0): (Vec3, Vec3),
        until: f64,
        step: f64,
        push: &mut dyn FnMut(f64, &NodeState, &NodeState) -> Vec3,
    ) -> (Vec3, Vec3) {
        let a = RADIUS;
        let node = |y: &[f64]| NodeState {
            position: Vec3::new(y[0], y[1], y[2]),
            velocity: Vec3::new(y[3], y[4], y[5]),
            ..NodeState::identity()
        };
        let n = (MU / (a * a * a)).sqrt();
        let v0 = v0 + Vec3::z().cross(&r0) * n;
        let mut y = [a, 0.0, 0.0, 0.0, a * n, 0.0, a + r0.x, r0.y, r0.z, v0.x, a * n + v0.y, v0.z];
        let mut slope = |t: f64, y: &[f64; 12]| {
            let (chief, deputy) = (node(&y[..6]), node(&y[6..]));
            let pull = |r: &Vec3| r * (-MU / r.norm().powi(3));
            let ac = pull(&chief.position);
            let ad = pull(&deputy.position) + push(t, &chief, &deputy);
            let (vc, vd) = (chief.velocity, deputy.velocity);
            [vc.x, vc.y, vc.z, ac.x, ac.y, ac.z, vd.x, vd.y, vd.z, ad.x, ad.y, ad.z]
        };
        let count = (until / step).ceil() as usize;
        let h = until / count as f64;
        for k in 0..count {
            let t = k as f64 * h;
            let at = |k: &[f64; 12], c: f64| -> [f64; 12] {
                std::array::from_fn(|i| y[i] + c * h * k[i])
            };
            let a = slope(t, &y);
            let b = slope(t + 0.5 * h, &at(&a, 0.5));
            let c = slope(t + 0.5 * h, &at(&b, 0.5));
            let d = slope(t + h, &at(&c, 1.0));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        }
        let (r, v, _, _) = relative(None, &node(&y[..6]), &node(&y[6..])).unwrap();
        (r, v)
    }

    /// Deputy of 100 kg under the law, from one initial position.
    fn kept(place: Vec3, until: f64, force_max: f64) -> (Vec3, Vec3) {
        let (frequency, damping, mass) = (0.01, 1.0, 100.0);
        let p = StationParams { place, frequency, damping, mass, force_max, world: world() };
        let m = StationKeeping::build(p).unwrap();
        let start = (Vec3::new(20.0, -150.0, 8.0), Vec3::new(0.015, -0.05, -0.01));
        fly(start, until, 0.5, &mut |_, chief, deputy| {
            let u = StationIn { chief: *chief, deputy: *deputy };
            m.feedthrough(&u).force / 100.0
        })
    }

    /// Level ground is rejected, because the motion of the chief about a centre is not known there.
    #[test]
    fn level_ground_is_refused() {
        let (place, frequency, damping, mass) = (Vec3::zeros(), 0.01, 1.0, 100.0);
        let site = Site {
            pose: linkwork_spatial::Pose::new(Quat::identity(), Vec3::z() * 6.4e6),
            rate: 7e-5,
            start: Quat::identity(),
        };
        let of = |axes: Axes| {
            let body = linkwork_surroundings::PlainWorld::inertial(MU, 6_378_137.0, 0.0);
            let world = linkwork_surroundings::PlainWorld { axes, ..body }.handle();
            let p = StationParams { place, frequency, damping, mass, force_max: 1.0, world };
            StationKeeping::build(p)
        };
        let e = of(Axes::Level(site)).err().unwrap();
        assert!(e.message.contains("makes the ground level") && e.help.is_some());
        assert!(of(Axes::Site(site)).is_ok() && of(Axes::Inertial).is_ok());
    }

    #[test]
    fn without_force_it_drifts_as_clohessy_and_wiltshire_say() {
        let (r, v) = kept(Vec3::zeros(), 1388.0, 0.0);
        let cw = ClohessyWiltshire::new(MU, RADIUS).unwrap();
        let state = Relative {
            position: Vec3::new(20.0, -150.0, 8.0),
            velocity: Vec3::new(0.015, -0.05, -0.01),
        };
        let want = cw.after(&state, 1388.0);
        // The residual is of second order in 150 m over the radius.
        assert!((r - want.position).norm() < 0.02, "{r} {}", want.position);
        assert!((v - want.velocity).norm() < 2e-5);
    }

    #[test]
    fn with_force_it_comes_to_its_place_and_stays() {
        let place = Vec3::new(10.0, -30.0, 5.0);
        let (r, v) = kept(place, 2500.0, 10.0);
        // The law uses the linear field, so there is a second-order error of some millimetres.
        assert!((r - place).norm() < 1e-2 && v.norm() < 1e-5, "{r} {v}");
    }
}
