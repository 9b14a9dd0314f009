//! `flight.station_keeping`: a deputy held at a place beside a chief, in the chief's turning axes.
//! ```text
//! x radial, y along the motion, z normal to the orbit (RTN), n = |r × v|/r² of the chief
//! a = −a_CW(x, ẋ) − 2 ζ ω ẋ − ω² (x − x_T)         a_CW: what Clohessy and Wiltshire's equations do without thrust
//! F = m a, cut off at F_max, in W
//! ```
//! What the orbit does is taken away first, so that the error decays as e^(−ζωt) on a circular orbit.
//! Transfers by two impulses are `linkwork_world::orbit::ClohessyWiltshire::velocity_to_reach`.

use linkwork_runtime::prelude::*;

/// Place and law.
#[derive(Params, Clone, Debug)]
pub struct StationParams {
    /// Place x_T in the chief's axes: radial, along the motion, normal.
    #[param(unit = "m", default = Vec3::zeros())]
    pub place: Vec3,
    /// Frequency ω of the law.
    #[param(unit = "rad/s", default = 0.01, range = 0.0..)]
    pub frequency: f64,
    /// Share of the critical damping ζ.
    #[param(default = 1.0, range = 0.0..)]
    pub damping: f64,
    /// Mass of the deputy.
    #[param(unit = "kg", range = 1e-6..)]
    pub mass: f64,
    /// Greatest force F_max.
    #[param(unit = "N", default = f64::INFINITY, range = 0.0..)]
    pub force_max: f64,
}

/// The two craft.
#[derive(Ports, Clone, Copy, Debug)]
pub struct StationIn {
    /// The chief; the planet is at the origin of W.
    #[port(bind = "chief")]
    pub chief: NodeState,
    /// The deputy.
    #[port(bind = "deputy")]
    pub deputy: NodeState,
}

/// Force and error.
#[derive(Ports, Clone, Copy, Debug)]
pub struct StationOut {
    /// Force that is wanted, W.
    #[port("N")]
    pub force: Vec3,
    /// Position in the chief's axes.
    #[port("m")]
    pub position: Vec3,
    /// Velocity in the chief's turning axes.
    #[port("m/s")]
    pub velocity: Vec3,
}

/// Station keeping.
pub struct StationKeeping {
    p: StationParams,
}

/// Position and velocity of the deputy in the chief's turning axes, the rotation from these to W, and n.
pub fn relative(chief: &NodeState, deputy: &NodeState) -> (Vec3, Vec3, Quat, f64) {
    let h = chief.position.cross(&chief.velocity);
    let (x, z) = (chief.position.normalize(), h.normalize());
    let y = z.cross(&x);
    let axes = linkwork_spatial::nalgebra::Matrix3::from_columns(&[x, y, z]);
    let R = Quat::from_matrix(&axes);
    let n = h.norm() / chief.position.norm_squared();
    let r = R.inverse() * (deputy.position - chief.position);
    let v = R.inverse() * (deputy.velocity - chief.velocity) - Vec3::z().cross(&r) * n;
    (r, v, R, n)
}

/// Holds a deputy at a place in the turning axes of a chief.
#[model("flight.station_keeping")]
impl Model for StationKeeping {
    const INERTIAL: bool = true;
    type Params = StationParams;
    type Ud = StationIn;
    type Yd = StationOut;
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &StationIn) -> StationOut {
        let p = &self.p;
        // Without an orbit there are no axes.
        if !(u.chief.position.cross(&u.chief.velocity).norm() > 0.0) {
            let zero = Vec3::zeros();
            return StationOut { force: zero, position: zero, velocity: zero };
        }
        let (r, v, R, n) = relative(&u.chief, &u.deputy);
        let free = Vec3::new(3.0 * n * n * r.x + 2.0 * n * v.y, -2.0 * n * v.x, -n * n * r.z);
        let w = p.frequency;
        let a = -free - v * (2.0 * p.damping * w) - (r - p.place) * (w * w);
        let wanted = R * a * p.mass;
        let size = wanted.norm();
        let force = if size > p.force_max { wanted * (p.force_max / size) } else { wanted };
        StationOut { force, position: r, velocity: v }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_world::orbit::{ClohessyWiltshire, Relative};

    const MU: f64 = 3.986_004_418e14;

    /// Two craft in true two-body motion; the deputy pushed by the law.
    fn fly(place: Vec3, start: [f64; 6], until: f64, force_max: f64) -> (Vec3, Vec3) {
        let a = 6_778_137.0;
        let p = StationParams { place, frequency: 0.01, damping: 1.0, mass: 100.0, force_max };
        let m = StationKeeping { p };
        let node = |y: &[f64]| NodeState {
            position: Vec3::new(y[0], y[1], y[2]),
            velocity: Vec3::new(y[3], y[4], y[5]),
            ..NodeState::identity()
        };
        let n = (MU / (a * a * a)).sqrt();
        let r0 = Vec3::new(start[0], start[1], start[2]);
        let v0 = Vec3::new(start[3], start[4], start[5]) + Vec3::z().cross(&r0) * n;
        let mut y = [a, 0.0, 0.0, 0.0, a * n, 0.0, a + r0.x, r0.y, r0.z, v0.x, a * n + v0.y, v0.z];
        let slope = |y: &[f64; 12]| {
            let (chief, deputy) = (node(&y[..6]), node(&y[6..]));
            let u = StationIn { chief, deputy };
            let push = m.direct(&Clock::at(0.0, 0.1, 0), &(), &(), &u, &()).force / 100.0;
            let pull = |r: &Vec3| r * (-MU / r.norm().powi(3));
            let (ac, ad) = (pull(&chief.position), pull(&deputy.position) + push);
            let (vc, vd) = (chief.velocity, deputy.velocity);
            [vc.x, vc.y, vc.z, ac.x, ac.y, ac.z, vd.x, vd.y, vd.z, ad.x, ad.y, ad.z]
        };
        let h = 0.5;
        for _ in 0..(until / h) as usize {
            let at = |k: &[f64; 12], c: f64| -> [f64; 12] {
                std::array::from_fn(|i| y[i] + c * h * k[i])
            };
            let a = slope(&y);
            let b = slope(&at(&a, 0.5));
            let c = slope(&at(&b, 0.5));
            let d = slope(&at(&c, 1.0));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        }
        let (r, v, _, _) = relative(&node(&y[..6]), &node(&y[6..]));
        (r, v)
    }

    #[test]
    fn without_force_it_drifts_as_clohessy_and_wiltshire_say() {
        let start = [20.0, -150.0, 8.0, 0.015, -0.05, -0.01];
        let (r, v) = fly(Vec3::zeros(), start, 1388.0, 0.0);
        let cw = ClohessyWiltshire::new(MU, 6_778_137.0).unwrap();
        let state = Relative {
            position: Vec3::new(20.0, -150.0, 8.0),
            velocity: Vec3::new(0.015, -0.05, -0.01),
        };
        let want = cw.after(&state, 1388.0);
        // What is left is of second order in 150 m over the radius.
        assert!((r - want.position).norm() < 0.02, "{r} {}", want.position);
        assert!((v - want.velocity).norm() < 2e-5);
    }

    #[test]
    fn with_force_it_comes_to_its_place_and_stays() {
        let place = Vec3::new(10.0, -30.0, 5.0);
        let (r, v) = fly(place, [20.0, -150.0, 8.0, 0.015, -0.05, -0.01], 2500.0, 10.0);
        // The law knows the linear field: the second order leaves millimetres.
        assert!((r - place).norm() < 1e-2 && v.norm() < 1e-5, "{r} {v}");
    }
}
