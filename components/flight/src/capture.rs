//! `flight.capture`: soft-capture docking mechanism: latches, then springs and dampers in six degrees of freedom.
//! ```text
//! p = R_aᵀ (p_b − p_a), R = R_aᵀ R_b, φ = log R: place and turn of b in the axes of a; v = ṗ, ω: their rates
//! catches     when |p| < `radius`, |φ| < `angle`, |v| < `speed_max`, |ω| < `rate_max`
//! from then   F = −k p − c v,  M = −J(φ)⁻ᵀ k_φ φ − c_φ ω        on b, in the axes of a, at b; the opposite on a, at the same point
//! J(φ)⁻¹      φ̇ = J(φ)⁻¹ ω, as in `actuators.bushing`: the springs have the potential ½ p·k p + ½ φ·k_φ φ
//! ```
//! Momentum and angular momentum of the pair are conserved. The springs have zero rest length, so at capture they are stretched by the distance of
//! the ports and draw the ports together, like an extended mechanism. `taken` is the energy that the dampers dissipate. Reaching the capture limits
//! is an event. When the motion is damped (`settled`), a phase can lock the two bodies together.

use linkwork_runtime::prelude::*;
use linkwork_spatial::moment_of_gradient;

/// Capture limits, springs and dampers.
#[derive(Params, Clone, Debug)]
pub struct CaptureParams {
    /// Greatest distance of the ports at capture.
    #[param(unit = "m", default = 0.05, range = 1e-6..)]
    pub radius: f64,
    /// Greatest angle between the ports at capture.
    #[param(unit = "rad", default = 0.087, range = 1e-6..=3.0)]
    pub angle: f64,
    /// Greatest relative speed at capture.
    #[param(unit = "m/s", default = 0.1, range = 0.0..)]
    pub speed_max: f64,
    /// Greatest relative angular rate at capture.
    #[param(unit = "rad/s", default = 0.02, range = 0.0..)]
    pub rate_max: f64,
    /// Stiffness along the axes of a.
    #[param(unit = "N/m", range = 0.0..)]
    pub stiffness: Vec3,
    /// Damping along the axes of a.
    #[param(unit = "N s/m", range = 0.0..)]
    pub damping: Vec3,
    /// Rotational stiffness about the axes of a, N m/rad.
    #[param(default = Vec3::zeros(), range = 0.0..)]
    pub turn_stiffness: Vec3,
    /// Rotational damping about the axes of a, N m s/rad.
    #[param(default = Vec3::zeros(), range = 0.0..)]
    pub turn_damping: Vec3,
    /// Relative speed below which the capture is settled, if distance and angle are also below `radius`/10 and `angle`/10.
    #[param(unit = "m/s", default = 1e-3, range = 0.0..)]
    pub settled_speed: f64,
}

/// Docking ports.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CaptureIn {
    /// Port with the latches.
    #[port(bind = "a")]
    pub a: NodeState,
    /// Port that is captured; coincides with a when docked.
    #[port(bind = "b")]
    pub b: NodeState,
}

/// Loads and relative state.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CaptureOut {
    /// Load on a.
    #[port(bind = "a")]
    pub on_a: Wrench,
    /// Load on b.
    #[port(bind = "b")]
    pub on_b: Wrench,
    /// Distance of the ports.
    #[port("m")]
    pub distance: f64,
    /// Angle between the ports.
    #[port("rad")]
    pub misaligned: f64,
    /// Relative speed.
    #[port("m/s")]
    pub speed: f64,
    /// Magnitude of the force.
    #[port("N")]
    pub force: f64,
    /// Magnitude of the moment.
    #[port("N m")]
    pub moment: f64,
    /// Captured, and at relative rest.
    #[port]
    pub settled: bool,
}

/// State of the capture.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CaptureState {
    /// The latches are closed.
    #[port]
    pub caught: bool,
    /// Energy dissipated by the dampers.
    #[port("J")]
    pub taken: f64,
}

/// Dissipated energy.
#[derive(State, Clone, Copy, Debug)]
pub struct DissipatedEnergy {
    /// Energy dissipated by the dampers.
    #[port("J")]
    pub energy: f64,
}

/// State of the latches.
#[derive(State, Clone, Copy, Debug)]
pub struct Latches {
    /// The latches are closed.
    #[port]
    pub caught: bool,
}

/// Guard of the capture: margins of the conditions, relative to their limits.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CaptureEdge {
    /// Least margin; capture occurs when it becomes positive.
    #[port("1", rising)]
    pub within: f64,
}

/// Docking mechanism.
pub struct Capture {
    p: CaptureParams,
}

/// Position and rotation vector of b in the axes of a, and their rates.
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

    /// Returns force (N) and moment (N m) on b, axes of a.
    fn load(&self, r: &Relative) -> (Vec3, Vec3) {
        let p = &self.p;
        let force = p.stiffness.component_mul(&r.place) + p.damping.component_mul(&r.speed);
        let spring = moment_of_gradient(&r.turn, &p.turn_stiffness.component_mul(&r.turn));
        (-force, -spring - p.turn_damping.component_mul(&r.rate))
    }
}

/// Soft-capture docking mechanism: captures a port within limits and brings it to relative rest by springs and dampers.
#[model("flight.capture")]
impl Model for Capture {
    type Params = CaptureParams;
    type FeedthroughInputs = CaptureIn;
    type Outputs = CaptureState;
    type FeedthroughOutputs = CaptureOut;
    type State = DissipatedEnergy;
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
                let fact =
                    format!("{name} has a negative component, which would drive the ports apart");
                return Err(BuildError::new(fact).help("write numbers of at least 0").at(name));
            }
        }
        Ok(Capture { p })
    }
    fn outputs(&self, x: &DissipatedEnergy, d: &Latches) -> CaptureState {
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
    fn derivatives(&self, d: &Latches, u: &CaptureIn) -> DissipatedEnergy {
        if !d.caught {
            return DissipatedEnergy { energy: 0.0 };
        }
        let (p, r) = (&self.p, relative(u));
        let linear = p.damping.component_mul(&r.speed).dot(&r.speed);
        DissipatedEnergy { energy: linear + p.turn_damping.component_mul(&r.rate).dot(&r.rate) }
    }
    fn guards(&self, d: &Latches, u: &CaptureIn) -> CaptureEdge {
        CaptureEdge { within: if d.caught { -1.0 } else { self.within(&relative(u)) } }
    }
    fn handle_event(&self, x: &DissipatedEnergy) -> (DissipatedEnergy, Latches) {
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
        // The power of all loads is −d/dt of the springs' energy minus the power of the dampers. The former is computed
        // by a difference along the motion.
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
        let (x, d) = (DissipatedEnergy::zero(), Latches { caught: false });
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
