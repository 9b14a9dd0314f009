//! `flight.line_twist`: suspension lines that twist when canopy and payload rotate relative to each other.
//! ```text
//! φ̇ = (ω_b − ω_a) · n                 n: from a to b; φ: the twist, whole turns included
//! h² = l² − r_a² − r_b² + 2 r_a r_b cos φ        axial distance of the two rings of attachment
//! τ  = T r_a r_b sin φ/h              along n on a, against n on b;  − c φ̇
//! ```
//! Lines of length l run between a ring of radius r_a on the payload and one of r_b on the canopy (a bifilar suspension of many
//! lines); T is the axial load, −T dh/dφ = τ: twisting the lines lifts the payload. Beyond half a turn the lines lie on each other (`wound`) and
//! transmit no torque except friction: τ is zero until the twist decreases below half a turn. This model gives the torque only; `flight.line` or
//! `flight.riser` gives the axial load and the change of length. Where φ begins is `twist`.

use linkwork_runtime::prelude::*;

/// Rings and lines.
#[derive(Params, Clone, Debug)]
pub struct LineTwistParams {
    /// Length of a line; greater than the sum of the two radii.
    #[param(unit = "m")]
    pub length: f64,
    /// Radius of the ring on the payload.
    #[param(unit = "m", range = 0.0..)]
    pub radius_a: f64,
    /// Radius of the ring on the canopy.
    #[param(unit = "m", range = 0.0..)]
    pub radius_b: f64,
    /// Damping of the twist.
    #[param(unit = "N m s/rad", default = 0.0, range = 0.0..)]
    pub damping: f64,
    /// Twist at the start.
    #[param(unit = "rad", default = 0.0)]
    pub twist: f64,
}

/// Ends and load.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LineTwistIn {
    /// The payload.
    #[port(bind = "a")]
    pub a: NodeState,
    /// The canopy.
    #[port(bind = "b")]
    pub b: NodeState,
    /// Axial load of the lines.
    #[port("N")]
    pub tension: f64,
}

/// Torques and twist.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LineTwistOut {
    /// Load on the payload.
    #[port(bind = "a")]
    pub on_a: Wrench,
    /// Load on the canopy.
    #[port(bind = "b")]
    pub on_b: Wrench,
    /// Torque along the lines, on the payload.
    #[port("N m")]
    pub torque: f64,
    /// Shortening of the lines along their axis, caused by the twist.
    #[port("m")]
    pub shortening: f64,
}

/// The twist as an output.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TwistOut {
    /// Angle between canopy and payload about the axis of the lines.
    #[port("rad")]
    pub angle: f64,
    /// The lines lie on each other.
    #[port]
    pub wound: bool,
}

/// The twist.
#[derive(State, Clone, Copy, Debug)]
pub struct Twist {
    /// Rotation of the canopy relative to the payload.
    #[port("rad")]
    pub angle: f64,
}

/// Contact of the lines with each other.
#[derive(State, Clone, Copy, Debug)]
pub struct Wound {
    /// The lines lie on each other.
    #[port]
    pub wound: bool,
}

/// Half a turn.
#[derive(Ports, Clone, Copy, Debug)]
pub struct HalfTurn {
    /// Twist beyond half a turn.
    #[port("rad")]
    pub beyond: f64,
}

/// Suspension lines that twist.
pub struct LineTwist {
    p: LineTwistParams,
}

impl LineTwist {
    /// Axial distance of the rings (m) at a twist.
    fn height(&self, angle: f64) -> f64 {
        let LineTwistParams { length: l, radius_a: a, radius_b: b, .. } = self.p;
        (l * l - a * a - b * b + 2.0 * a * b * angle.cos()).sqrt()
    }

    /// Unit vector from a to b, and φ̇.
    fn turning(u: &LineTwistIn) -> (Vec3, f64) {
        let d = u.b.position - u.a.position;
        let n = d.try_normalize(1e-12).unwrap_or_else(Vec3::zeros);
        (n, (u.b.angular - u.a.angular).dot(&n))
    }
}

/// Torque of the twisted suspension lines of a parachute, between a payload and its canopy.
#[model("flight.line_twist")]
impl Model for LineTwist {
    type Params = LineTwistParams;
    type FeedthroughInputs = LineTwistIn;
    type Outputs = TwistOut;
    type FeedthroughOutputs = LineTwistOut;
    type State = Twist;
    type DiscreteState = Wound;
    type Guards = HalfTurn;
    fn build(p: LineTwistParams) -> Result<Self, BuildError> {
        if !(p.length > p.radius_a + p.radius_b) {
            let fact = format!(
                "lines of {} m end on rings of {} and {} m: twisted by half a turn they would not reach",
                p.length, p.radius_a, p.radius_b
            );
            let help = "write a `length` above `radius_a` and `radius_b` together";
            return Err(BuildError::new(fact).help(help).at("length"));
        }
        Ok(LineTwist { p })
    }
    fn init_x(&self) -> Twist {
        Twist { angle: self.p.twist }
    }
    fn init_d(&self) -> Wound {
        Wound { wound: self.p.twist.abs() > std::f64::consts::PI }
    }
    fn outputs(&self, x: &Twist, d: &Wound) -> TwistOut {
        TwistOut { angle: x.angle, wound: d.wound }
    }
    fn feedthrough(&self, x: &Twist, d: &Wound, u: &LineTwistIn) -> LineTwistOut {
        let (n, rate) = Self::turning(u);
        let h = self.height(x.angle);
        let spring = u.tension.max(0.0) * self.p.radius_a * self.p.radius_b * x.angle.sin() / h;
        let torque = if d.wound { 0.0 } else { spring } + self.p.damping * rate;
        let moment = n * torque;
        LineTwistOut {
            on_a: Wrench { moment, force: Vec3::zeros() },
            on_b: Wrench { moment: -moment, force: Vec3::zeros() },
            torque,
            shortening: self.height(0.0) - h,
        }
    }
    fn derivatives(&self, u: &LineTwistIn) -> Twist {
        Twist { angle: Self::turning(u).1 }
    }
    fn guards(&self, x: &Twist) -> HalfTurn {
        HalfTurn { beyond: x.angle.abs() - std::f64::consts::PI }
    }
    fn handle_event(&self, fired: Fired<'_>, x: &Twist) -> (Twist, Wound) {
        (*x, Wound { wound: fired.rose(0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(damping: f64) -> LineTwist {
        LineTwist::build(LineTwistParams {
            length: 20.0,
            radius_a: 0.8,
            radius_b: 6.0,
            damping,
            twist: 0.0,
        })
        .unwrap()
    }

    fn ends(rate: f64) -> LineTwistIn {
        let a = NodeState { position: Vec3::new(1.0, 2.0, 3.0), ..NodeState::identity() };
        let n = Vec3::new(2.0, -1.0, 2.0) / 3.0;
        let b = NodeState { position: a.position + n * 19.0, angular: n * rate, ..a };
        LineTwistIn { a, b, tension: 9000.0 }
    }

    fn at(m: &LineTwist, angle: f64, rate: f64) -> LineTwistOut {
        let (x, d) = (Twist { angle }, Wound { wound: false });
        m.feedthrough(&x, &d, &ends(rate))
    }

    #[test]
    fn the_torque_is_the_slope_of_the_lifted_load() {
        let m = lines(0.0);
        for angle in [-2.9, -1.0, 0.3, 1.7, 3.0] {
            let h = 1e-5;
            let slope = 9000.0 * (m.height(angle - h) - m.height(angle + h)) / (2.0 * h);
            let y = at(&m, angle, 0.5);
            assert!((y.torque - slope).abs() < 1e-4 * slope.abs(), "{angle}: {} {slope}", y.torque);
            assert_eq!(y.on_a.moment + y.on_b.moment, Vec3::zeros());
            // The canopy is rotated ahead of the payload, so the torque rotates the payload in the
            // same direction.
            assert!(y.torque * angle > 0.0);
            assert!((y.on_a.moment - Vec3::new(2.0, -1.0, 2.0) / 3.0 * y.torque).norm() < 1e-9);
        }
        assert_eq!(at(&m, 0.0, 0.5).torque, 0.0);
    }

    #[test]
    fn damping_takes_energy_and_small_twists_swing_at_their_frequency() {
        // The power is zero on a, which is at rest, and the torque times the rate on b.
        let y = at(&lines(30.0), 0.0, 0.4);
        assert!((y.on_b.moment.dot(&ends(0.4).b.angular) + 30.0 * 0.16).abs() < 1e-12);
        // The stiffness is k = T r_a r_b/h: if the canopy does not rotate, a payload of inertia I
        // oscillates with √(k/I).
        let m = lines(0.0);
        let k = at(&m, 1e-6, 0.0).torque / 1e-6;
        let wanted = 9000.0 * 0.8 * 6.0 / f64::sqrt(400.0 - 5.2 * 5.2);
        assert!((k / wanted - 1.0).abs() < 1e-9, "{k} {wanted}");
    }

    #[test]
    fn beyond_half_a_turn_there_is_no_torque_and_short_lines_are_refused() {
        let m = lines(0.0);
        let (x, u) = (Twist { angle: 3.5 }, ends(0.0));
        let y = m.feedthrough(&x, &Wound { wound: true }, &u);
        assert_eq!(y.torque, 0.0);
        assert!(m.guards(&x).beyond > 0.0);
        let p =
            LineTwistParams { length: 2.0, radius_a: 1.0, radius_b: 1.5, damping: 0.0, twist: 0.0 };
        let e = LineTwist::build(p).err().unwrap().to_string();
        assert!(e.contains("would not reach"), "{e}");
    }
}
