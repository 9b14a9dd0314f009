//! `flight.separation_spring`: a spring that pushes two bodies apart until its stroke is used up.
//! ```text
//! s = (p_b − p_a) · n                    n: the axis, fixed in a
//! F = k (stroke − s) − c ṡ  while s < stroke and F > 0, else 0
//! on b: F n at b          on a: −F n at b as well
//! ```
//! Both forces act along one line, so momentum and angular momentum of the pair are conserved. The
//! energy ½ k stroke² goes into the two bodies when the spring starts fully compressed and c = 0. The instant of the release is an event, so that no
//! integration step crosses the kink of the force. A start with s < 0 is an error, because the spring would be compressed beyond its stroke and store
//! more energy than ½ k stroke².

use linkwork_runtime::prelude::*;

/// A spring.
#[derive(Params, Clone, Debug)]
pub struct SpringParams {
    /// Stiffness.
    #[param(unit = "N/m", range = 0.0..)]
    pub stiffness: f64,
    /// Distance over which the spring pushes.
    #[param(unit = "m", range = 1e-6..)]
    pub stroke: f64,
    /// Damping along the axis.
    #[param(unit = "N s/m", default = 0.0, range = 0.0..)]
    pub damping: f64,
    /// Direction from a to b, in the axes of node a.
    #[param(default = Vec3::x())]
    pub axis: Vec3,
}

/// The two nodes; they coincide when the spring is fully compressed.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SpringIn {
    /// The node that stays behind.
    #[port(bind = "a")]
    pub a: NodeState,
    /// The node that is pushed.
    #[port(bind = "b")]
    pub b: NodeState,
}

/// Forces, and the extension.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SpringOut {
    /// Load on a.
    #[port(bind = "a")]
    pub on_a: Wrench,
    /// Load on b.
    #[port(bind = "b")]
    pub on_b: Wrench,
    /// Force along the axis.
    #[port("N")]
    pub force: f64,
    /// Way pushed so far.
    #[port("m")]
    pub extension: f64,
    /// Rate of separation along the axis.
    #[port("m/s")]
    pub speed: f64,
}

/// Guard at the kink of the force.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SpringEnd {
    /// Way that is left.
    #[port("m", falling)]
    pub left: f64,
}

/// State of the release.
#[derive(State, Clone, Copy, Debug)]
pub struct Released {
    /// The stroke has been used up.
    #[port]
    pub released: bool,
}

/// A separation spring.
pub struct SeparationSpring {
    p: SpringParams,
}

/// A spring that pushes two bodies apart once.
#[model("flight.separation_spring")]
impl Model for SeparationSpring {
    type Params = SpringParams;
    type FeedthroughInputs = SpringIn;
    type FeedthroughOutputs = SpringOut;
    type DiscreteState = Released;
    type Guards = SpringEnd;
    fn build(mut p: SpringParams) -> Result<Self, BuildError> {
        p.axis = crate::axis::unit(p.axis, "[1, 0, 0]")?;
        Ok(SeparationSpring { p })
    }
    fn feedthrough(&self, d: &Released, u: &SpringIn) -> SpringOut {
        let n = u.a.rotation * self.p.axis;
        let p_ab = u.b.position - u.a.position;
        let extension = p_ab.dot(&n);
        // n rotates with body a, so ṡ = (v_b − v_a) · n + p_ab · (ω_a × n).
        let speed = (u.b.velocity - u.a.velocity).dot(&n) + p_ab.dot(&u.a.angular.cross(&n));
        let pushes = !d.released && extension < self.p.stroke;
        let force = self.p.stiffness * (self.p.stroke - extension) - self.p.damping * speed;
        let force = if pushes { force.max(0.0) } else { 0.0 };
        let push = n * force;
        SpringOut {
            on_a: Wrench { moment: -p_ab.cross(&push), force: -push },
            on_b: Wrench { moment: Vec3::zeros(), force: push },
            force,
            extension,
            speed,
        }
    }
    fn guards(&self, u: &SpringIn) -> SpringEnd {
        let n = u.a.rotation * self.p.axis;
        SpringEnd { left: self.p.stroke - (u.b.position - u.a.position).dot(&n) }
    }
    fn startup_warnings(&self, d: &Released, u: &SpringIn) -> Vec<BuildError> {
        let left = self.guards(u).left;
        if !d.released && left > self.p.stroke * (1.0 + 1e-9) {
            let fact = format!(
                "b is {:.6} m behind a along its axis: the spring is compressed beyond its stroke of {} m",
                left - self.p.stroke,
                self.p.stroke
            );
            let help = "start with the nodes at the same position, where the spring is fully compressed, or reverse `axis`";
            return vec![BuildError::new(fact).help(help).at("stroke").stopping(true)];
        }
        let gone = (!d.released && left <= 0.0).then(|| {
            let fact = format!(
                "its nodes start {:.6} m apart along its axis, but its stroke is {} m: it is already released",
                self.p.stroke - left,
                self.p.stroke
            );
            let help = "the spring never pushes; start with the nodes at the same position, or remove it";
            BuildError::new(fact).help(help).at("stroke")
        });
        gone.into_iter().collect()
    }
    fn handle_event(&self) -> ((), Released) {
        ((), Released { released: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spring() -> SeparationSpring {
        let axis = Vec3::new(0.0, 0.0, 2.0);
        let p = SpringParams { stiffness: 1000.0, stroke: 0.1, damping: 0.0, axis };
        SeparationSpring::build(p).unwrap()
    }

    fn at(height: f64) -> SpringIn {
        let a = NodeState { position: Vec3::new(1.0, 2.0, 3.0), ..NodeState::identity() };
        let b = NodeState { position: a.position + Vec3::new(0.02, 0.0, height), ..a };
        SpringIn { a, b }
    }

    fn push(height: f64, released: bool) -> SpringOut {
        spring().feedthrough(&Released { released }, &at(height))
    }

    #[test]
    fn forces_balance_about_any_point() {
        let (u, y) = (at(0.04), push(0.04, false));
        assert!((y.force - 60.0).abs() < 1e-12, "{}", y.force);
        assert_eq!(y.on_a.force + y.on_b.force, Vec3::zeros());
        let about = |s: &NodeState, w: &Wrench| w.moment + s.position.cross(&w.force);
        let total = about(&u.a, &y.on_a) + about(&u.b, &y.on_b);
        // The sum consists of terms of 180 N m.
        assert!(total.norm() < 1e-12, "{total}");
    }

    #[test]
    fn it_does_not_pull_and_does_not_push_again() {
        assert_eq!(push(0.11, false).force, 0.0);
        assert_eq!(push(0.04, true).force, 0.0);
        assert!(
            SeparationSpring::build(SpringParams {
                stiffness: 1.0,
                stroke: 1.0,
                damping: 0.0,
                axis: Vec3::zeros()
            })
            .is_err_and(|e| e.param.as_deref() == Some("axis"))
        );
    }
}
