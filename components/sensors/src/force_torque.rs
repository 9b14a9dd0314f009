//! `sensors.force_torque`: the wrench that a mount exerts on a rigid tool, wheel or foot that it carries, in the axes of the mount.
//! ```text
//! c = R com,  a_c = a + α × c + ω × (ω × c)              motion of what is carried, of mass m, with I about its centre
//! f = m (a_c − g) − F                                     F: load on it at the point p, with the moment M, by wires
//! n = I α + ω × I ω + c × m (a_c − g) − M − (p − o) × F      about the mount's origin o
//! reading = clamp((Rᵀf, Rᵀn) + offset + noise, ±range)
//! ```
//! The mechanism computes motions and not the forces in its hinges; those on one rigid body follow from its motion and its loads. So
//! what is carried has no joint of its own, its mass is written here once more, and what acts on it beside gravity is wired: the
//! `contact_force` and `contact_point` of a wheel, a foot or a body with a collider. A force that is not wired is missed.

use linkwork_runtime::prelude::*;
use linkwork_spatial::Mat3;

/// What is carried, and the errors.
#[derive(Params, Clone, Debug)]
pub struct ForceTorqueParams {
    /// Mass of what is carried.
    #[param(unit = "kg", range = 0.0..)]
    pub mass: f64,
    /// Its centre of mass in the mount's axes, m.
    #[param(default = [0.0, 0.0, 0.0])]
    pub com: [f64; 3],
    /// Its moments of inertia about its centre, along the mount's axes, kg m².
    #[param(default = [0.0, 0.0, 0.0])]
    pub inertia: [f64; 3],
    /// Greatest force that it shows on each axis.
    #[param(unit = "N", default = 1e9, range = 1e-9..)]
    pub force_range: f64,
    /// Greatest moment that it shows about each axis.
    #[param(unit = "N m", default = 1e9, range = 1e-9..)]
    pub moment_range: f64,
    /// Error of the force that stays, N.
    #[param(default = [0.0, 0.0, 0.0])]
    pub force_offset: [f64; 3],
    /// Error of the moment that stays, N m.
    #[param(default = [0.0, 0.0, 0.0])]
    pub moment_offset: [f64; 3],
    /// Standard deviation of the force on each axis, a sample.
    #[param(unit = "N", default = 0.0, range = 0.0..)]
    pub force_sigma: f64,
    /// Standard deviation of the moment about each axis, a sample.
    #[param(unit = "N m", default = 0.0, range = 0.0..)]
    pub moment_sigma: f64,
    /// Gravity.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// The mount, and what acts on what it carries.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ForceTorqueIn {
    /// Pose and velocity.
    #[port(bind = "mount")]
    pub mount: NodeState,
    /// Acceleration.
    #[port(bind = "mount")]
    pub motion: NodeAccel,
    /// Force on what is carried, beside gravity, W.
    #[port("N", default = Vec3::zeros())]
    pub load: Vec3,
    /// Where it acts, W.
    #[port("m", default = Vec3::zeros())]
    pub point: Vec3,
    /// Moment on what is carried beside that of the force, W.
    #[port("N m", default = Vec3::zeros())]
    pub moment: Vec3,
}

/// Readings.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ForceTorqueOut {
    /// Force of the mount on what it carries, in the mount's axes.
    #[port("N")]
    pub force: Vec3,
    /// Moment about the mount's origin, in its axes.
    #[port("N m")]
    pub torque: Vec3,
    /// Every axis is within its range.
    #[port]
    pub valid: bool,
}

/// A force–torque sensor.
pub struct ForceTorque {
    p: ForceTorqueParams,
}

impl ForceTorque {
    /// The wrench without errors: force (N) and moment (N m) in the mount's axes.
    fn wrench(&self, t: f64, u: &ForceTorqueIn) -> [Vec3; 2] {
        let (p, n) = (&self.p, &u.mount);
        let c = n.rotation * Vec3::from(p.com);
        let centre = n.position + c;
        let velocity = n.velocity + n.angular.cross(&c);
        let turned = u.motion.angular.cross(&c) + n.angular.cross(&n.angular.cross(&c));
        let felt = u.motion.linear + turned - p.gravity.free_fall(t, centre, velocity);
        let own = n.rotation.inverse();
        let [omega, alpha] = [own * n.angular, own * u.motion.angular];
        let inertia = Mat3::from_diagonal(&Vec3::from(p.inertia));
        let spin = inertia * alpha + omega.cross(&(inertia * omega));
        let force = felt * p.mass - u.load;
        let moment = c.cross(&felt) * p.mass - u.moment - (u.point - n.position).cross(&u.load);
        [own * force, own * moment + spin]
    }
}

/// Force and moment that a mount exerts on a rigid body that it carries, with noise, offset and range; sampled.
#[model("sensors.force_torque")]
impl Model for ForceTorque {
    type Params = ForceTorqueParams;
    type Ud = ForceTorqueIn;
    type Yd = ForceTorqueOut;
    fn build(p: ForceTorqueParams) -> Result<Self, BuildError> {
        let [a, b, c] = p.inertia;
        let possible = a >= 0.0 && b >= 0.0 && c >= 0.0;
        let possible = possible && a <= b + c && b <= c + a && c <= a + b;
        if !possible {
            let fact = format!("no body has the moments of inertia {:?} kg m²", p.inertia);
            let help = "none is negative, and none is larger than the other two together";
            return Err(BuildError::new(fact).help(help).at("inertia"));
        }
        Ok(ForceTorque { p })
    }
    fn direct(&self, c: &Clock, _: &(), _: &(), u: &ForceTorqueIn) -> ForceTorqueOut {
        let p = &self.p;
        let [force, torque] = self.wrench(c.t, u);
        let mut valid = true;
        let mut read = |x: Vec3, offset: [f64; 3], sigma: f64, range: f64, lane: u32| {
            valid &= x.iter().all(|v| v.abs() <= range);
            let noise = |k: u32| if sigma > 0.0 { sigma * c.normal(lane + k) } else { 0.0 };
            let noise = Vec3::new(noise(0), noise(1), noise(2));
            (x + Vec3::from(offset) + noise).map(|v| v.clamp(-range, range))
        };
        ForceTorqueOut {
            force: read(force, p.force_offset, p.force_sigma, p.force_range, 0),
            torque: read(torque, p.moment_offset, p.moment_sigma, p.moment_range, 3),
            valid,
        }
    }
    fn update(&self, _: &Clock, _: &(), _: &(), _: &()) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    struct Down;

    impl Gravity for Down {
        fn acceleration(&self, _: f64, _: Vec3) -> Vec3 {
            Vec3::new(0.0, 0.0, -9.81)
        }
    }

    fn params() -> ForceTorqueParams {
        ForceTorqueParams {
            mass: 2.0,
            com: [0.1, 0.02, -0.3],
            inertia: [0.02, 0.03, 0.025],
            force_range: 1e9,
            moment_range: 1e9,
            force_offset: [0.0; 3],
            moment_offset: [0.0; 3],
            force_sigma: 0.0,
            moment_sigma: 0.0,
            gravity: Handle::new("gravity", Arc::new(Down) as Arc<dyn Gravity>),
        }
    }

    fn still(rotation: Quat) -> ForceTorqueIn {
        let motion = NodeAccel { angular: Vec3::zeros(), linear: Vec3::zeros() };
        let mount = NodeState { rotation, ..NodeState::identity() };
        let none = Vec3::zeros();
        ForceTorqueIn { mount, motion, load: none, point: none, moment: none }
    }

    fn read(p: ForceTorqueParams, u: &ForceTorqueIn, row: u64) -> ForceTorqueOut {
        ForceTorque::build(p).unwrap().direct(&Clock::at(0.0, 0.1, row), &(), &(), u, &())
    }

    #[test]
    fn at_rest_it_carries_the_weight_in_any_attitude() {
        let turn = Quat::from_euler_angles(0.4, -0.9, 2.0);
        let y = read(params(), &still(turn), 0);
        let up = turn.inverse() * Vec3::new(0.0, 0.0, 2.0 * 9.81);
        assert!((y.force - up).norm() < 1e-12 && y.valid);
        assert!((y.torque - Vec3::new(0.1, 0.02, -0.3).cross(&up)).norm() < 1e-12);
        // On the ground that carries it whole, under its centre, it feels nothing.
        let mut u = still(turn);
        u.load = Vec3::new(0.0, 0.0, 2.0 * 9.81);
        u.point = turn * Vec3::new(0.1, 0.02, -0.3) - Vec3::z();
        let y = read(params(), &u, 0);
        assert!(y.force.norm() < 1e-12 && y.torque.norm() < 1e-12, "{y:?}");
        u.moment = turn * Vec3::new(0.0, 3.0, 0.0);
        assert!((read(params(), &u, 0).torque + Vec3::new(0.0, 3.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn a_mount_that_turns_feels_the_pull_outwards_and_the_turning_of_what_it_carries() {
        // About z at 3 rad/s, growing by 2 rad/s²: in the mount's axes, centre at (0.1, 0.02).
        let mut u = still(Quat::from_euler_angles(0.0, 0.0, 0.7));
        u.mount.angular = Vec3::new(0.0, 0.0, 3.0);
        u.motion.angular = Vec3::new(0.0, 0.0, 2.0);
        let y = read(params(), &u, 0);
        let (x0, y0) = (0.1, 0.02);
        let want =
            Vec3::new(2.0 * (-9.0 * x0 - 2.0 * y0), 2.0 * (-9.0 * y0 + 2.0 * x0), 2.0 * 9.81);
        assert!((y.force - want).norm() < 1e-12, "{y:?} {want}");
        let moment = 0.025 * 2.0 + x0 * want.y - y0 * want.x;
        assert!((y.torque.z - moment).abs() < 1e-12, "{y:?} {moment}");
        // In free fall it carries nothing.
        let mut u = still(Quat::identity());
        u.motion.linear = Vec3::new(0.0, 0.0, -9.81);
        let y = read(params(), &u, 0);
        assert!(y.force.norm() + y.torque.norm() < 1e-12);
        // Turning about an axis that is none of its own, it is held by I ω in motion.
        let free = ForceTorqueParams { mass: 0.0, com: [0.0; 3], ..params() };
        u.mount.angular = Vec3::new(1.0, 2.0, 3.0);
        let y = read(free, &u, 0).torque;
        let h = Vec3::new(0.02, 0.06, 0.075);
        assert!((y - Vec3::new(1.0, 2.0, 3.0).cross(&h)).norm() < 1e-12, "{y}");
    }

    #[test]
    fn errors_range_and_refusals() {
        let p = ForceTorqueParams {
            force_offset: [0.5, 0.0, -1.0],
            moment_offset: [0.0, 0.1, 0.0],
            force_range: 15.0,
            ..params()
        };
        let (plain, y) =
            (read(params(), &still(Quat::identity()), 0), read(p, &still(Quat::identity()), 0));
        assert!(!y.valid && y.force == Vec3::new(0.5, 0.0, 15.0), "{y:?}");
        assert!((y.torque - plain.torque - Vec3::new(0.0, 0.1, 0.0)).norm() < 1e-12);
        let noisy = || ForceTorqueParams { force_sigma: 0.2, moment_sigma: 0.05, ..params() };
        let (n, mut f, mut m) = (3000, 0.0, 0.0);
        for row in 0..n {
            let y = read(noisy(), &still(Quat::identity()), row);
            f += (y.force - plain.force).norm_squared() / (3 * n) as f64;
            m += (y.torque - plain.torque).norm_squared() / (3 * n) as f64;
        }
        assert!((f.sqrt() - 0.2).abs() < 0.01 && (m.sqrt() - 0.05).abs() < 0.003, "{f} {m}");
        for bad in [[-0.1, 0.1, 0.1], [0.1, 0.1, 0.3], [f64::NAN, 0.1, 0.1]] {
            let e = ForceTorque::build(ForceTorqueParams { inertia: bad, ..params() });
            let e = e.err().unwrap();
            assert!(e.param.as_deref() == Some("inertia") && e.help.is_some(), "{bad:?}");
        }
    }
}
