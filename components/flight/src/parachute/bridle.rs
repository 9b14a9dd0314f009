//! `flight.bridle`: line on a drum with a brake that pays it out while it is taut, as in a sky crane.
//! ```text
//! d = p_b − p_a      δ = |d| − L      T = k δ + c (δ̇_geometric − L̇) while taut, else 0
//! L̇ = v_p            while taut and L < L_full: the brake lets the line out at one speed, and stops at its end
//! ```
//! The line becomes slack when k δ + c δ̇_geometric falls to zero. During payout the tension reaches zero already at an extension of c v_p/k (it is
//! never negative), and the drum continues to rotate over this short distance. A slack line is taut again as soon as both δ and k δ + c δ̇_geometric
//! are positive, also if it has stayed longer than L. k is the stiffness of the line at any length. Transitions between taut and slack and the end of
//! the payout are events, as in `flight.line`.

use super::line::{LineIn, LineOut};
use linkwork_runtime::prelude::*;

/// A line on a drum with a brake.
#[derive(Params, Clone, Debug)]
pub struct BridleParams {
    /// Initial unstretched length.
    #[param(unit = "m", range = 1e-6..)]
    pub length: f64,
    /// Length of line that the brake pays out.
    #[param(unit = "m", range = 0.0..)]
    pub let_out: f64,
    /// Payout speed v_p of the brake.
    #[param(unit = "m/s", range = 1e-9..)]
    pub payout: f64,
    /// Stiffness k.
    #[param(unit = "N/m", range = 1e-9..)]
    pub stiffness: f64,
    /// Damping c along the line.
    #[param(unit = "N s/m", default = 0.0, range = 0.0..)]
    pub damping: f64,
}

/// State of the payout.
#[derive(State, Clone, Copy, Debug)]
pub struct Paid {
    /// Unstretched length.
    #[port("m")]
    pub length: f64,
}

/// Discrete state of the line.
#[derive(State, Clone, Copy, Debug)]
pub struct Pulling {
    /// The line is taut.
    #[port]
    pub taut: bool,
    /// The line is fully paid out.
    #[port]
    pub out: bool,
}

/// State of the line as outputs.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BridleState {
    /// Unstretched length.
    #[port("m")]
    pub length: f64,
    /// The line is taut.
    #[port]
    pub taut: bool,
    /// The line is fully paid out.
    #[port]
    pub out: bool,
}

/// Guards of the line.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BridleChange {
    /// Minimum of the extension and of `pull`: a slack line becomes taut where it rises to zero.
    #[port("m", rising)]
    pub within: f64,
    /// Tension of a taut line without payout, over its stiffness, plus a nanometre.
    #[port("m", falling)]
    pub pull: f64,
    /// Unstretched length minus its final value.
    #[port("m", rising)]
    pub end: f64,
}

/// Distance (m) by which `pull` must be below zero before the line becomes slack. A line that begins at its unstretched length and at rest is therefore
/// taut, because both thresholds do not coincide.
const SLACK: f64 = 1e-9;

/// A line on a drum with a brake.
pub struct Bridle {
    p: BridleParams,
}

impl Bridle {
    /// Returns the final length, m.
    fn full(&self) -> f64 {
        self.p.length + self.p.let_out
    }

    /// Returns the payout speed, m/s.
    fn paying(&self, d: &Pulling) -> f64 {
        if d.taut && !d.out { self.p.payout } else { 0.0 }
    }

    /// Returns the unit vector from a to b, the extension (m) and its rate (m/s), including the payout.
    fn stretch(&self, x: &Paid, d: &Pulling, u: &LineIn) -> (Vec3, f64, f64) {
        let (n, extension, rate) = super::line::stretch(u, x.length);
        (n, extension, rate - self.paying(d))
    }
}

/// Line between two bodies that a brake pays out at constant speed while it is taut, up to its final length.
#[model("flight.bridle")]
impl Model for Bridle {
    type Params = BridleParams;
    type FeedthroughInputs = LineIn;
    type Outputs = BridleState;
    type FeedthroughOutputs = LineOut;
    type State = Paid;
    type DiscreteState = Pulling;
    type Guards = BridleChange;
    fn init_x(&self) -> Paid {
        Paid { length: self.p.length }
    }
    fn init_d(&self) -> Pulling {
        Pulling { taut: false, out: self.p.let_out <= 0.0 }
    }
    fn outputs(&self, x: &Paid, d: &Pulling) -> BridleState {
        BridleState { length: x.length, taut: d.taut, out: d.out }
    }
    fn feedthrough(&self, x: &Paid, d: &Pulling, u: &LineIn) -> LineOut {
        LineOut::of(self.stretch(x, d, u), (self.p.stiffness, self.p.damping), d.taut)
    }
    fn derivatives(&self, d: &Pulling) -> Paid {
        Paid { length: self.paying(d) }
    }
    fn guards(&self, x: &Paid, d: &Pulling, u: &LineIn) -> BridleChange {
        // The rate without payout is continuous at transitions of the brake.
        let (_, extension, rate) = super::line::stretch(u, x.length);
        let end = if d.out { -1.0 } else { x.length - self.full() };
        let pull = extension + self.p.damping / self.p.stiffness * rate;
        let within = if pull < extension { pull } else { extension };
        BridleChange { within, pull: pull + SLACK, end }
    }
    fn handle_event(&self, fired: Fired<'_>, x: &Paid, d: &Pulling) -> (Paid, Pulling) {
        let taut = (d.taut || fired.rose(0)) && !fired.fell(1);
        match fired.rose(2) {
            true => (Paid { length: self.full() }, Pulling { taut, out: true }),
            false => (*x, Pulling { taut, ..*d }),
        }
    }
    fn startup_warnings(&self, x: &Paid, u: &LineIn) -> Vec<BuildError> {
        let (_, extension, _) = super::line::stretch(u, x.length);
        let pull = self.p.stiffness * extension;
        let fact = super::line::stretched("line", extension, pull);
        let told = (extension > 1e-6 * x.length)
            .then(|| BuildError::new(fact).help("increase `length`").at("length"));
        told.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bridle(let_out: f64) -> Bridle {
        let p = BridleParams { length: 0.5, let_out, payout: 1.2, stiffness: 4e4, damping: 300.0 };
        Bridle { p }
    }

    fn ends(distance: f64, speed: f64) -> LineIn {
        let b = NodeState {
            position: Vec3::z() * -distance,
            velocity: Vec3::z() * -speed,
            ..NodeState::identity()
        };
        LineIn { a: NodeState::identity(), b }
    }

    #[test]
    fn it_pulls_both_ends_alike_and_never_pushes() {
        let m = bridle(7.0);
        let (x, taut) = (Paid { length: 3.0 }, Pulling { taut: true, out: false });
        let y = m.feedthrough(&x, &taut, &ends(3.02, 1.5));
        // The brake pays out at 1.2 m/s of the 1.5 m/s.
        assert!((y.tension - (4e4 * 0.02 + 300.0 * 0.3)).abs() < 1e-9, "{}", y.tension);
        assert_eq!(y.on_a.force, -y.on_b.force);
        assert!(y.on_a.force.z < 0.0 && y.on_b.force.z > 0.0);
        assert_eq!(m.feedthrough(&x, &taut, &ends(2.9, -1.0)).tension, 0.0);
        let slack = Pulling { taut: false, out: false };
        assert_eq!(m.feedthrough(&x, &slack, &ends(3.02, 1.5)).tension, 0.0);
    }

    #[test]
    fn it_is_paid_out_while_it_pulls_and_stops_at_its_end() {
        let (m, u) = (bridle(7.0), ends(3.01, 1.2));
        let rate = |taut: bool, out: bool| {
            let d = Pulling { taut, out };
            m.derivatives(&d).length
        };
        assert_eq!([rate(true, false), rate(false, false), rate(true, true)], [1.2, 0.0, 0.0]);
        let (x, d) = m.handle_event(Fired::rising(2), &Paid { length: 7.5 + 1e-13 }, &m.init_d());
        assert!(x.length == 7.5 && d.out);
        assert!(m.guards(&x, &d, &u).end < 0.0, "an end that has come does not come again");
        assert!(bridle(0.0).init_d().out, "a brake that lets nothing out is at its end");
    }
}
