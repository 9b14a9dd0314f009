//! `control.pointing`: torque that rotates a body to an attitude about one axis, within a rate limit.
//! ```text
//! e = 2 vec(q_T⁻¹ q), shorter way         e is cut off where ω² |e| = 2 ζ ω_n · rate_max: then it coasts at rate_max
//! M = J (−ω_n² e − 2 ζ ω_n (ω − ω_T)) + ω × J ω          body axes, cut off at torque_max by axis
//! ```
//! Small errors decay as e^(−ζ ω_n t); large ones are reduced by a rotation about the axis of e at `rate_max`.

use linkwork_runtime::prelude::*;

/// Body and law.
#[derive(Params, Clone, Debug)]
pub struct PointingParams {
    /// Principal inertia J, body axes.
    #[param(unit = "kg m^2")]
    pub inertia: Vec3,
    /// Frequency ω_n.
    #[param(unit = "rad/s", default = 0.1, range = 1e-9..)]
    pub frequency: f64,
    /// Damping ratio ζ.
    #[param(default = 1.0, range = 1e-3..)]
    pub damping: f64,
    /// Rate of a slew.
    #[param(unit = "rad/s", default = f64::INFINITY, range = 0.0..)]
    pub rate_max: f64,
    /// Greatest torque about each axis.
    #[param(unit = "N m", default = f64::INFINITY, range = 0.0..)]
    pub torque_max: f64,
}

/// Present and commanded attitude.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PointingIn {
    /// Attitude, body to the axes relative to which `rate` is measured; these are inertial axes for a gyro.
    #[port]
    pub attitude: Quat,
    /// Rate, body axes.
    #[port("rad/s")]
    pub rate: Vec3,
    /// Commanded attitude, body to the same axes.
    #[port]
    pub target: Quat,
    /// Commanded rate, body axes.
    #[port("rad/s", default = Vec3::zeros())]
    pub target_rate: Vec3,
}

/// Commanded torque and error.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PointingOut {
    /// Commanded torque, body axes.
    #[port("N m")]
    pub torque: Vec3,
    /// Angle between the present and the commanded attitude.
    #[port("rad")]
    pub error: f64,
}

/// A pointing law.
pub struct Pointing {
    p: PointingParams,
}

/// Rotates a body to an attitude about one axis, with limits of rate and torque.
#[model("control.pointing")]
impl Model for Pointing {
    type Params = PointingParams;
    type FeedthroughInputs = PointingIn;
    type FeedthroughOutputs = PointingOut;
    fn build(p: PointingParams) -> Result<Self, BuildError> {
        if p.inertia.iter().any(|j| !(*j > 0.0)) {
            return Err(BuildError::new("an inertia is not above 0")
                .help("write the three principal moments of inertia, e.g. inertia: [60, 50, 40]")
                .at("inertia"));
        }
        Ok(Pointing { p })
    }
    fn feedthrough(&self, u: &PointingIn) -> PointingOut {
        let p = &self.p;
        let q = u.target.inverse() * u.attitude;
        let sign = if q.w < 0.0 { -2.0 } else { 2.0 };
        let mut e = q.imag() * sign;
        let error = 2.0 * (0.5 * e.norm()).min(1.0).asin();
        let most = 2.0 * p.damping * p.rate_max / p.frequency;
        if e.norm() > most {
            e *= most / e.norm();
        }
        let (w, j) = (u.rate, p.inertia);
        let wanted = -e * (p.frequency * p.frequency)
            - (w - u.target_rate) * (2.0 * p.damping * p.frequency);
        let torque = j.component_mul(&wanted) + w.cross(&j.component_mul(&w));
        let limit = p.torque_max;
        PointingOut { torque: torque.map(|m| m.clamp(-limit, limit)), error }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use linkwork_spatial::nalgebra::Quaternion;

    /// Integrates a rigid body under `torque(q, ω, t)` by RK4; returns attitude and rate after `until` s.
    pub fn turn(
        j: Vec3,
        (q, w): (Quat, Vec3),
        (h, until): (f64, f64),
        torque: impl Fn(&Quat, &Vec3, f64) -> Vec3,
    ) -> (Quat, Vec3) {
        let mut y = [q.i, q.j, q.k, q.w, w.x, w.y, w.z];
        let quat = |y: &[f64; 7]| Quat::from_quaternion(Quaternion::new(y[3], y[0], y[1], y[2]));
        for k in 0..(until / h).round() as usize {
            let t = k as f64 * h;
            let slope = |y: &[f64; 7]| {
                let w = Vec3::new(y[4], y[5], y[6]);
                let q = quat(y);
                let a = (torque(&q, &w, t) - w.cross(&j.component_mul(&w))).component_div(&j);
                let d = q.quaternion() * Quaternion::from_imag(w) * 0.5;
                [d.i, d.j, d.k, d.w, a.x, a.y, a.z]
            };
            let at =
                |k: &[f64; 7], c: f64| -> [f64; 7] { std::array::from_fn(|i| y[i] + c * h * k[i]) };
            let a = slope(&y);
            let b = slope(&at(&a, 0.5));
            let c = slope(&at(&b, 0.5));
            let d = slope(&at(&c, 1.0));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        }
        (quat(&y), Vec3::new(y[4], y[5], y[6]))
    }

    fn law(rate_max: f64) -> Pointing {
        Pointing::build(PointingParams {
            inertia: Vec3::new(60.0, 50.0, 40.0),
            frequency: 0.2,
            damping: 1.0,
            rate_max,
            torque_max: f64::INFINITY,
        })
        .unwrap()
    }

    fn at(m: &Pointing, q: &Quat, w: &Vec3, target: &Quat) -> PointingOut {
        let u = PointingIn { attitude: *q, rate: *w, target: *target, target_rate: Vec3::zeros() };
        m.feedthrough(&u)
    }

    #[test]
    fn a_small_error_decays_as_its_closed_form() {
        let (m, target) = (law(f64::INFINITY), Quat::from_scaled_axis(Vec3::new(0.4, 1.0, -0.7)));
        let j = m.p.inertia;
        let start = (target * Quat::from_scaled_axis(Vec3::x() * 1e-4), Vec3::zeros());
        let (q, _) = turn(j, start, (0.01, 10.0), |q, w, _| at(&m, q, w, &target).torque);
        // The response is critically damped: (1 + ω t) e^(−ω t).
        let want = 1e-4 * (1.0 + 2.0) * (-2.0f64).exp();
        assert!((q.angle_to(&target) / want - 1.0).abs() < 1e-5, "{}", q.angle_to(&target));
    }

    #[test]
    fn a_slew_goes_the_short_way_at_its_rate_and_ends_at_rest() {
        let (m, target) = (law(0.02), Quat::identity());
        let j = m.p.inertia;
        // A rotation by 250° is the same as one by 110° in the other direction.
        let start = (Quat::from_scaled_axis(Vec3::new(1.0, 2.0, 2.0) / 3.0 * 4.363), Vec3::zeros());
        let torque = |q: &Quat, w: &Vec3, _: f64| at(&m, q, w, &target).torque;
        let (q, w) = turn(j, start, (0.05, 60.0), torque);
        assert!((w.norm() - 0.02).abs() < 1e-4, "{}", w.norm());
        assert!(q.angle_to(&target) < 4.363 && at(&m, &q, &w, &target).error < 1.2);
        let (q, w) = turn(j, start, (0.05, 250.0), torque);
        assert!(q.angle_to(&target) < 1e-6 && w.norm() < 1e-6);
        let wrong = PointingParams { inertia: Vec3::zeros(), ..m.p.clone() };
        assert!(Pointing::build(wrong).is_err_and(|e| e.param.as_deref() == Some("inertia")));
    }
}
