//! `flight.kickoff_spring`: a spring between two points that pushes them apart once, along the line through both.
//! ```text
//! d = p_b − p_a    F = k (L₀ − |d|) while |d| < L₀, and zero for ever after |d| has reached L₀
//! on a: −F d/|d|      on b: F d/|d|
//! ```
//! Unlike `flight.separation_spring` its axis is not fixed in a body: it is a rod between two sockets. Both forces act along one line, so momentum
//! and angular momentum of the pair are conserved. The release is an event.

use linkwork_runtime::prelude::*;

/// A spring.
#[derive(Params, Clone, Debug)]
pub struct KickoffParams {
    /// Stiffness k.
    #[param(unit = "N/m", range = 0.0..)]
    pub stiffness: f64,
    /// Length L₀ without force.
    #[param(unit = "m", range = 1e-6..)]
    pub length: f64,
}

/// Its ends.
#[derive(Ports, Clone, Copy, Debug)]
pub struct KickoffIn {
    /// One end.
    #[port(bind = "a")]
    pub a: NodeState,
    /// The other.
    #[port(bind = "b")]
    pub b: NodeState,
}

/// Forces.
#[derive(Ports, Clone, Copy, Debug)]
pub struct KickoffOut {
    /// Load on a.
    #[port(bind = "a")]
    pub on_a: Wrench,
    /// Load on b.
    #[port(bind = "b")]
    pub on_b: Wrench,
    /// Force along the line.
    #[port("N")]
    pub force: f64,
}

/// State of the release.
#[derive(State, Clone, Copy, Debug)]
pub struct LetGo {
    /// The spring has reached its length and is released.
    #[port]
    pub over: bool,
}

/// The release as an output.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Over {
    /// The spring has been released.
    #[port]
    pub over: bool,
}

/// Guard of the end of the stroke.
#[derive(Ports, Clone, Copy, Debug)]
pub struct End {
    /// Length that is left.
    #[port("m", falling)]
    pub left: f64,
}

/// A kick-off spring.
pub struct KickoffSpring {
    p: KickoffParams,
}

/// A spring that pushes two points apart once, along the line through both, until it reaches its length.
#[model("flight.kickoff_spring")]
impl Model for KickoffSpring {
    type Params = KickoffParams;
    type FeedthroughInputs = KickoffIn;
    type Outputs = Over;
    type FeedthroughOutputs = KickoffOut;
    type DiscreteState = LetGo;
    type Guards = End;
    fn outputs(&self, d: &LetGo) -> Over {
        Over { over: d.over }
    }
    fn feedthrough(&self, d: &LetGo, u: &KickoffIn) -> KickoffOut {
        let line = u.b.position - u.a.position;
        let length = line.norm();
        let pushes = !d.over && length > 0.0;
        let force =
            if pushes { (self.p.stiffness * (self.p.length - length)).max(0.0) } else { 0.0 };
        let push = if length > 0.0 { line * (force / length) } else { Vec3::zeros() };
        KickoffOut {
            on_a: Wrench { moment: Vec3::zeros(), force: -push },
            on_b: Wrench { moment: Vec3::zeros(), force: push },
            force,
        }
    }
    fn guards(&self, u: &KickoffIn) -> End {
        End { left: self.p.length - (u.b.position - u.a.position).norm() }
    }
    fn startup_warnings(&self, d: &LetGo, u: &KickoffIn) -> Vec<BuildError> {
        let left = self.guards(u).left;
        if !d.over && left >= self.p.length {
            let fact = "its ends coincide, so the direction in which it pushes is not defined";
            let help = "start with the ends apart, because a compressed spring still has a length";
            return vec![BuildError::new(fact).help(help).at("length").stopping(true)];
        }
        let gone = (!d.over && left <= 0.0).then(|| {
            let fact = format!(
                "its ends start {:.6} m apart, but its free length is {} m: it is already released",
                self.p.length - left,
                self.p.length
            );
            let help = "the spring never pushes; start with the spring compressed, or remove it";
            BuildError::new(fact).help(help).at("length")
        });
        gone.into_iter().collect()
    }
    fn handle_event(&self) -> ((), LetGo) {
        ((), LetGo { over: true })
    }
}

/// Speed apart (m/s), speeds of the two (m/s) and time until release (s) of `count` springs between two masses
/// that start at rest, pressed in by `stroke`.
pub fn spring_pair(
    stiffness: f64,
    count: f64,
    stroke: f64,
    (m1, m2): (f64, f64),
) -> (f64, [f64; 2], f64) {
    let reduced = m1 * m2 / (m1 + m2);
    let omega = (count * stiffness / reduced).sqrt();
    let apart = omega * stroke;
    let total = m1 + m2;
    (apart, [-apart * m2 / total, apart * m1 / total], 0.5 * std::f64::consts::PI / omega)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_of_masses_parts_with_the_golden_speeds() {
        let (apart, [a, b], t) = spring_pair(1800.0, 4.0, 0.15, (1200.0, 385.0));
        for (found, want) in [
            (apart, 0.745506016594917),
            (a, -0.18108505765870225),
            (b, 0.5644209589362148),
            (t, 0.31605304823081287),
        ] {
            assert!((found - want).abs() < 1e-14, "{found} {want}");
        }
    }

    #[test]
    fn it_pushes_along_its_line_and_only_once() {
        let m = KickoffSpring { p: KickoffParams { stiffness: 2000.0, length: 0.2 } };
        let n = Vec3::new(2.0, -1.0, 2.0) / 3.0;
        let a = NodeState { position: Vec3::new(1.0, 2.0, 3.0), ..NodeState::identity() };
        let at = |length: f64, over: bool| {
            let b = NodeState { position: a.position + n * length, ..a };
            m.feedthrough(&LetGo { over }, &KickoffIn { a, b })
        };
        let y = at(0.15, false);
        assert!((y.on_b.force - n * 100.0).norm() < 1e-9 && y.on_a.force == -y.on_b.force);
        assert_eq!(
            (at(0.21, false).force, at(0.15, true).force, at(0.0, false).force),
            (0.0, 0.0, 0.0)
        );
    }
}
