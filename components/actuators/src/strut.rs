//! `actuators.strut`: a spring and a damper between two points of two bodies; it pulls and pushes.
//! ```text
//! d = p_b − p_a      L = |d|      L̇ = (v_b − v_a) · d/L
//! F = k (L − L₀) + c L̇            on a: F d/L,  on b: −F d/L
//! ```
//! What only pulls is `flight.line`. If both ends coincide, the direction is undefined and the force is zero; a strut of rest length 0 is smooth
//! there except for its damping.

use linkwork_runtime::prelude::*;

/// A strut.
#[derive(Params, Clone, Debug)]
pub struct StrutParams {
    /// Stiffness k.
    #[param(unit = "N/m", default = 0.0, range = 0.0..)]
    pub stiffness: f64,
    /// Damping c along it.
    #[param(unit = "N s/m", default = 0.0, range = 0.0..)]
    pub damping: f64,
    /// Length without force L₀.
    #[param(unit = "m", default = 0.0, range = 0.0.., needs = "stiffness")]
    pub rest: f64,
}

/// Its ends.
#[derive(Ports, Clone, Copy, Debug)]
pub struct StrutIn {
    /// One end.
    #[port(bind = "a")]
    pub a: NodeState,
    /// The other.
    #[port(bind = "b")]
    pub b: NodeState,
}

/// Forces and length.
#[derive(Ports, Clone, Copy, Debug)]
pub struct StrutOut {
    /// Load on a.
    #[port(bind = "a")]
    pub on_a: Wrench,
    /// Load on b.
    #[port(bind = "b")]
    pub on_b: Wrench,
    /// Force; positive pulls the ends together, negative pushes them apart.
    #[port("N")]
    pub force: f64,
    /// Length.
    #[port("m")]
    pub length: f64,
    /// Its rate.
    #[port("m/s")]
    pub rate: f64,
}

/// A strut.
pub struct Strut {
    p: StrutParams,
}

/// Linear spring and damper between two points of two bodies, in both directions.
#[model("actuators.strut")]
impl Model for Strut {
    type Params = StrutParams;
    type FeedthroughInputs = StrutIn;
    type FeedthroughOutputs = StrutOut;
    fn feedthrough(&self, u: &StrutIn) -> StrutOut {
        let d = u.b.position - u.a.position;
        let length = d.norm();
        let n = if length > 0.0 { d / length } else { Vec3::zeros() };
        let rate = (u.b.velocity - u.a.velocity).dot(&n);
        let force = self.p.stiffness * (length - self.p.rest) + self.p.damping * rate;
        let pull = Wrench { moment: Vec3::zeros(), force: n * force };
        let back = Wrench { moment: Vec3::zeros(), force: -pull.force };
        StrutOut { on_a: pull, on_b: back, force, length, rate }
    }
    fn startup_warnings(&self, u: &StrutIn) -> Vec<BuildError> {
        let length = (u.b.position - u.a.position).norm();
        let pointless = self.p.rest > 0.0 && length < 1e-9 * self.p.rest;
        let fact =
            "both ends are at the same position, so the strut has no direction and exerts no force";
        let help = "move one of its nodes, or write `rest: 0`";
        pointless.then(|| BuildError::new(fact).help(help).at("rest")).into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strut(rest: f64) -> Strut {
        Strut { p: StrutParams { stiffness: 1000.0, damping: 50.0, rest } }
    }

    fn at(rest: f64, apart: f64, rate: f64) -> StrutOut {
        let a = NodeState { position: Vec3::new(1.0, -2.0, 0.5), ..NodeState::identity() };
        let n = Vec3::new(2.0, -1.0, 2.0) / 3.0;
        let across = Vec3::new(1.0, 2.0, 0.0);
        let b = NodeState { position: a.position + n * apart, velocity: n * rate + across, ..a };
        strut(rest).feedthrough(&StrutIn { a, b })
    }

    #[test]
    fn it_pulls_when_long_and_pushes_when_short_along_itself_alone() {
        let n = Vec3::new(2.0, -1.0, 2.0) / 3.0;
        for (apart, rate, force) in [(5.2, 1.0, 250.0), (4.9, 0.0, -100.0), (5.0, -2.0, -100.0)] {
            let y = at(5.0, apart, rate);
            assert!((y.force - force).abs() < 1e-9, "{}", y.force);
            assert!((y.on_a.force - n * force).norm() < 1e-9);
            assert_eq!(y.on_a.force + y.on_b.force, Vec3::zeros());
            assert!((y.length - apart).abs() < 1e-12 && (y.rate - rate).abs() < 1e-12);
        }
        assert_eq!(at(5.0, 0.0, 0.0).on_a.force, Vec3::zeros());
        // For rest length 0, the force points to the other end and is proportional to the distance.
        assert!((at(0.0, 1e-3, 0.0).on_a.force - n).norm() < 1e-9);
    }

    #[test]
    fn ends_at_one_place_are_remarked() {
        let told = |rest: f64, x: f64| {
            let a = NodeState::identity();
            let b = NodeState { position: Vec3::new(x, 0.0, 0.0), ..a };
            strut(rest).startup_warnings(&StrutIn { a, b }).len()
        };
        assert_eq!((told(1.0, 0.0), told(1.0, 0.5), told(0.0, 0.0)), (1, 0, 0));
    }
}
