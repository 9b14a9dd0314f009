//! `flight.capture`: a docking mechanism that catches a port softly: latches, then springs and dampers in six directions.
//! ```text
//! p = R_aᵀ (p_b − p_a), R = R_aᵀ R_b, φ = log R: place and turn of b in the axes of a; v = ṗ, ω: their rates
//! catches     when |p| < `radius`, |φ| < `angle`, |v| < `speed_max`, |ω| < `rate_max`
//! from then   F = −k p − c v,  M = −J(φ)⁻ᵀ k_φ φ − c_φ ω        on b, in the axes of a, at b; the opposite on a, at the same point
//! J(φ)⁻¹      φ̇ = J(φ)⁻¹ ω, as in `actuators.bushing`: the springs have the potential ½ p·k p + ½ φ·k_φ φ
//! ```
//! Momentum and angular momentum of the pair stay as they were. The springs are as long as the ports are apart when the latches catch, as those of a mechanism
//! that reaches out: they draw the ports together. What the dampers take is counted in `taken`. How near the ports come
//! is an event. Once the motion is damped a phase may lock the two together (`settled`).

use linkwork_runtime::prelude::*;
use linkwork_spatial::moment_of_gradient;

/// Catching, springs and dampers.
#[derive(Params, Clone, Debug)]
pub struct CaptureParams {
    /// Distance of the ports within which it catches.
    #[param(unit = "m", default = 0.05, range = 1e-6..)]
    pub radius: f64,
    /// Angle between them within which it catches.
    #[param(unit = "rad", default = 0.087, range = 1e-6..=3.0)]
    pub angle: f64,
    /// Speed up to which it catches.
    #[param(unit = "m/s", default = 0.1, range = 0.0..)]
    pub speed_max: f64,
    /// Turn rate up to which it catches.
    #[param(unit = "rad/s", default = 0.02, range = 0.0..)]
    pub rate_max: f64,
    /// Stiffness along the axes of a.
    #[param(unit = "N/m", range = 0.0..)]
    pub stiffness: Vec3,
    /// Damping along the axes of a.
    #[param(unit = "N s/m", range = 0.0..)]
    pub damping: Vec3,
    /// Stiffness against turning about the axes of a, N m/rad.
    #[param(default = Vec3::zeros(), range = 0.0..)]
    pub turn_stiffness: Vec3,
    /// Damping against turning about the axes of a, N m s/rad.
    #[param(default = Vec3::zeros(), range = 0.0..)]
    pub turn_damping: Vec3,
    /// Speed of the ports below which the capture is settled; with `radius`/10 and `angle`/10.
    #[param(unit = "m/s", default = 1e-3, range = 0.0..)]
    pub settled_speed: f64,
}

/// The ports.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CaptureIn {
    /// Port with the latches.
    #[port(bind = "a")]
    pub a: NodeState,
    /// Port that is caught; on a when docked, with the same axes.
    #[port(bind = "b")]
    pub b: NodeState,
}

/// Loads and how far it is.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CaptureOut {
    /// On a.
    #[port(bind = "a")]
    pub on_a: Wrench,
    /// On b.
    #[port(bind = "b")]
    pub on_b: Wrench,
    /// Distance of the ports.
    #[port("m")]
    pub distance: f64,
    /// Angle between them.
    #[port("rad")]
    pub misaligned: f64,
    /// Speed against each other.
    #[port("m/s")]
    pub speed: f64,
    /// Size of the force.
    #[port("N")]
    pub force: f64,
    /// Size of the moment.
    #[port("N m")]
    pub moment: f64,
    /// Caught, and at rest.
    #[port]
    pub settled: bool,
}

/// Whether it has caught.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CaptureState {
    /// The latches have caught.
    #[port]
    pub caught: bool,
    /// Energy that the dampers have taken.
    #[port("J")]
    pub taken: f64,
}

/// Energy that is taken.
#[derive(State, Clone, Copy, Debug)]
pub struct Taken {
    /// By the dampers.
    #[port("J")]
    pub energy: f64,
}

/// The latches.
#[derive(State, Clone, Copy, Debug)]
pub struct Latches {
    /// They have caught.
    #[port]
    pub caught: bool,
}

/// What is left of each condition, as a share of its limit.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CaptureEdge {
    /// The least; above zero it catches.
    #[port("1", rising)]
    pub within: f64,
}

/// A docking mechanism.
pub struct Capture {
    p: CaptureParams,
}

/// Place and turn of b in the axes of a, and their rates.
struct Relative {
    place: Vec3,
    turn: Vec3,
    speed: Vec3,
    rate: Vec3,
}

fn relative(u: &CaptureIn) -> Relative {
    let back = u.a.rotation.inverse();
    let place = back * (u.b.position - u.a.position);
    let speed = back * (u.b.velocity - u.a.velocity) - (back * u.a.angular).cross(&place);
    let turn = (back * u.b.rotation).scaled_axis();
    let rate = back * (u.b.angular - u.a.angular);
    Relative { place, turn, speed, rate }
}

impl Capture {
    fn within(&self, r: &Relative) -> f64 {
        let p = &self.p;
        let left = |x: f64, most: f64| if most > 0.0 { 1.0 - x / most } else { -1.0 };
        left(r.place.norm(), p.radius)
            .min(left(r.turn.norm(), p.angle))
            .min(left(r.speed.norm(), p.speed_max))
            .min(left(r.rate.norm(), p.rate_max))
    }

    /// Force and moment on b, axes of a.
    fn load(&self, r: &Relative) -> (Vec3, Vec3) {
        let p = &self.p;
        let force = p.stiffness.component_mul(&r.place) + p.damping.component_mul(&r.speed);
        let spring = moment_of_gradient(&r.turn, &p.turn_stiffness.component_mul(&r.turn));
        (-force, -spring - p.turn_damping.component_mul(&r.rate))
    }
}

/// A docking mechanism that catches a port within limits and brings it to rest by springs and dampers.
#[model("flight.capture")]
impl Model for Capture {
    type Params = CaptureParams;
    type FeedthroughInputs = CaptureIn;
    type Outputs = CaptureState;
    type FeedthroughOutputs = CaptureOut;
    type State = Taken;
    type DiscreteState = Latches;
    type Guards = CaptureEdge;
    fn build(p: CaptureParams) -> Result<Self, BuildError> {
        for (name, v) in [
            ("stiffness", p.stiffness),
            ("damping", p.damping),
            ("turn_stiffness", p.turn_stiffness),
            ("turn_damping", p.turn_damping),
        ] {
            if v.iter().any(|x| !(*x >= 0.0)) {
                let fact = format!("{name} is below 0: it would drive the ports apart");
                return Err(BuildError::new(fact).help("write numbers of at least 0").at(name));
            }
        }
        Ok(Capture { p })
    }
    fn outputs(&self, x: &Taken, d: &Latches) -> CaptureState {
        CaptureState { caught: d.caught, taken: x.energy }
    }
    fn feedthrough(&self, d: &Latches, u: &CaptureIn) -> CaptureOut {
        let p = &self.p;
        let r = relative(u);
        let (force, moment) = if d.caught { self.load(&r) } else { (Vec3::zeros(), Vec3::zeros()) };
        let (f, m) = (u.a.rotation * force, u.a.rotation * moment);
        let arm = u.b.position - u.a.position;
        let settled = d.caught
            && r.speed.norm() < p.settled_speed
            && r.place.norm() < 0.1 * p.radius
            && r.turn.norm() < 0.1 * p.angle;
        CaptureOut {
            on_a: Wrench { moment: -m - arm.cross(&f), force: -f },
            on_b: Wrench { moment: m, force: f },
            distance: r.place.norm(),
            misaligned: r.turn.norm(),
            speed: r.speed.norm(),
            force: force.norm(),
            moment: moment.norm(),
            settled,
        }
    }
    fn derivatives(&self, d: &Latches, u: &CaptureIn) -> Taken {
        if !d.caught {
            return Taken { energy: 0.0 };
        }
        let (p, r) = (&self.p, relative(u));
        let linear = p.damping.component_mul(&r.speed).dot(&r.speed);
        Taken { energy: linear + p.turn_damping.component_mul(&r.rate).dot(&r.rate) }
    }
    fn guards(&self, d: &Latches, u: &CaptureIn) -> CaptureEdge {
        CaptureEdge { within: if d.caught { -1.0 } else { self.within(&relative(u)) } }
    }
    fn handle_event(&self, x: &Taken) -> (Taken, Latches) {
        (*x, Latches { caught: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params() -> CaptureParams {
        CaptureParams {
            radius: 0.05,
            angle: 0.1,
            speed_max: 0.1,
            rate_max: 0.02,
            stiffness: Vec3::new(2000.0, 300.0, 400.0),
            damping: Vec3::new(500.0, 90.0, 80.0),
            turn_stiffness: Vec3::new(50.0, 60.0, 70.0),
            turn_damping: Vec3::new(5.0, 6.0, 7.0),
            settled_speed: 1e-3,
        }
    }

    fn ports() -> CaptureIn {
        let turn = Quat::from_euler_angles(0.3, -0.8, 1.1);
        let a = NodeState {
            position: Vec3::new(3.0, -1.0, 2.0),
            rotation: turn,
            velocity: Vec3::new(0.2, 0.1, -0.3),
            angular: Vec3::new(0.01, -0.02, 0.015),
        };
        let b = NodeState {
            position: a.position + turn * Vec3::new(0.02, -0.01, 0.005),
            rotation: turn * Quat::from_scaled_axis(Vec3::new(0.02, -0.03, 0.01)),
            velocity: a.velocity + Vec3::new(0.01, 0.02, -0.01),
            angular: a.angular + Vec3::new(0.003, 0.001, -0.002),
        };
        CaptureIn { a, b }
    }

    #[test]
    fn loads_balance_and_take_what_the_motion_loses() {
        let m = Capture::build(params()).unwrap();
        let u = ports();
        let y = m.feedthrough(&Latches { caught: true }, &u);
        assert!((y.on_a.force + y.on_b.force).norm() < 1e-12 && y.force > 10.0);
        let about = |s: &NodeState, w: &Wrench| w.moment + s.position.cross(&w.force);
        let total = about(&u.a, &y.on_a) + about(&u.b, &y.on_b);
        assert!(total.norm() < 1e-12, "{total}");
        // Power of all loads = −d/dt of the springs' energy − power of the dampers; the first by difference over the motion.
        let power = |s: &NodeState, w: &Wrench| w.force.dot(&s.velocity) + w.moment.dot(&s.angular);
        let stored = |h: f64| {
            let moved = |s: &NodeState| NodeState {
                position: s.position + s.velocity * h,
                rotation: Quat::from_scaled_axis(s.angular * h) * s.rotation,
                ..*s
            };
            let r = relative(&CaptureIn { a: moved(&u.a), b: moved(&u.b) });
            let p = params();
            let turn = p.turn_stiffness.component_mul(&r.turn).dot(&r.turn);
            0.5 * (p.stiffness.component_mul(&r.place).dot(&r.place) + turn)
        };
        let lost = m.derivatives(&Latches { caught: true }, &u).energy;
        let spring = (stored(1e-5) - stored(-1e-5)) / 2e-5;
        let done = power(&u.a, &y.on_a) + power(&u.b, &y.on_b);
        assert!((done + lost + spring).abs() < 1e-7 && lost > 0.0, "{done} {lost} {spring}");
    }

    #[test]
    fn it_catches_within_all_limits_only() {
        let m = Capture::build(params()).unwrap();
        let (x, d) = (Taken::zero(), Latches { caught: false });
        let within = |u: &CaptureIn| m.guards(&d, u).within;
        assert!(within(&ports()) > 0.0);
        assert_eq!(m.feedthrough(&d, &ports()).force, 0.0);
        let mut far = ports();
        far.b.position.z += 0.1;
        let mut fast = ports();
        fast.b.velocity.z += 0.2;
        let mut turned = ports();
        turned.b.rotation *= Quat::from_scaled_axis(Vec3::x() * 0.2);
        let mut spun = ports();
        spun.b.angular.x += 0.1;
        for u in [far, fast, turned, spun] {
            assert!(within(&u) < 0.0);
        }
        assert!(m.handle_event(&x).1.caught);
        let p = CaptureParams { damping: Vec3::new(1.0, -1.0, 0.0), ..params() };
        assert_eq!(Capture::build(p).err().unwrap().param.as_deref(), Some("damping"));
    }
}
