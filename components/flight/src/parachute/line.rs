//! `flight.line`: tension-only line, such as a riser, a bridle leg or a tether.
//! ```text
//! d = p_b − p_a      δ = |d| − L      δ̇ = (v_b − v_a) · d/|d|
//! T = k δ + c δ̇  while taut, else 0        on a: T d/|d|,  on b: −T d/|d|
//! taut while both δ and k δ + c δ̇ are positive
//! ```
//! Changes between slack and taut are events, so that no integration step crosses the kink of the force. A line that goes slack while it is still
//! longer than L (its ends approach faster than the damper lets it contract) is taut again as soon as k δ + c δ̇ is positive.

use linkwork_runtime::prelude::*;

/// Parameters of a line.
#[derive(Params, Clone, Debug)]
pub struct LineParams {
    /// Unstretched length L.
    #[param(unit = "m", range = 1e-6..)]
    pub length: f64,
    /// Stiffness k of the whole line.
    #[param(unit = "N/m", range = 1e-9..)]
    pub stiffness: f64,
    /// Damping c along the line.
    #[param(unit = "N s/m", default = 0.0, range = 0.0..)]
    pub damping: f64,
    /// The line is meant to be taut at the start. Otherwise a line that is longer than L at the start causes a warning.
    #[param(default = false)]
    pub taut: bool,
}

/// Ends of the line.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LineIn {
    /// Node at end a.
    #[port(bind = "a")]
    pub a: NodeState,
    /// Node at end b.
    #[port(bind = "b")]
    pub b: NodeState,
}

/// Forces and length.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LineOut {
    /// Load on a.
    #[port(bind = "a")]
    pub on_a: Wrench,
    /// Load on b.
    #[port(bind = "b")]
    pub on_b: Wrench,
    /// Tension.
    #[port("N")]
    pub tension: f64,
    /// Extension over the unstretched length; negative when slack.
    #[port("m")]
    pub extension: f64,
    /// Rate of the extension.
    #[port("m/s")]
    pub rate: f64,
}

impl LineOut {
    /// Computes the loads of a line from the direction from a to b, the extension (m) and its rate (m/s), the stiffness (N/m) and the damping (N
    /// s/m). The tension is never negative.
    pub(super) fn of(
        (n, extension, rate): (Vec3, f64, f64),
        (k, c): (f64, f64),
        taut: bool,
    ) -> Self {
        let tension = if taut { (k * extension + c * rate).max(0.0) } else { 0.0 };
        let force = n * tension;
        LineOut {
            on_a: Wrench { moment: Vec3::zeros(), force },
            on_b: Wrench { moment: Vec3::zeros(), force: -force },
            tension,
            extension,
            rate,
        }
    }
}

/// State of a line.
#[derive(State, Clone, Copy, Debug)]
pub struct Taut {
    /// The line is taut.
    #[port]
    pub taut: bool,
    /// Number of transitions between slack and taut.
    #[port("1")]
    pub changes: f64,
}

impl Taut {
    /// Returns the state after a transition to taut or slack.
    pub(super) fn after(self, taut: bool) -> Taut {
        let changes = self.changes + f64::from(u8::from(taut != self.taut));
        Taut { taut, changes }
    }
}

/// State of a line as outputs.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TautOut {
    /// The line is taut.
    #[port]
    pub taut: bool,
    /// Number of transitions between slack and taut.
    #[port("1")]
    pub changes: f64,
}

/// Guard of the transitions between slack and taut.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Change {
    /// Minimum of the extension and of the tension of a taut line over its stiffness; the line is taut while it is positive. It is continuous at a
    /// transition.
    #[port("m")]
    pub within: f64,
}

impl Change {
    /// Returns the guard of a line with an extension (m) and its rate (m/s), a stiffness (N/m) and a damping (N s/m).
    pub(super) fn of(extension: f64, rate: f64, (k, c): (f64, f64)) -> Change {
        let pull = extension + c / k * rate;
        Change { within: if pull < extension { pull } else { extension } }
    }
}

/// A line.
pub struct Line {
    p: LineParams,
}

/// Returns the unit vector from a to b, the extension (m) and its rate (m/s).
pub(super) fn stretch(u: &LineIn, length: f64) -> (Vec3, f64, f64) {
    let d = u.b.position - u.a.position;
    let now = d.norm();
    let n = if now > 0.0 { d / now } else { Vec3::zeros() };
    (n, now - length, (u.b.velocity - u.a.velocity).dot(&n))
}

/// Returns the warning about a line or riser that starts longer than its unstretched length, by its extension (m) and its elastic force (N).
pub(super) fn stretched(name: &str, extension: f64, pull: f64) -> String {
    format!(
        "the {name} starts {extension:.6} m longer than its unstretched length, so it pulls with {pull:.3} N at once"
    )
}

/// Tension-only line between two bodies; transitions between slack and taut are events.
#[model("flight.line")]
impl Model for Line {
    const MODES: bool = true;
    type Params = LineParams;
    type FeedthroughInputs = LineIn;
    type Outputs = TautOut;
    type FeedthroughOutputs = LineOut;
    type DiscreteState = Taut;
    type Guards = Change;
    fn init_d(&self) -> Taut {
        Taut { taut: self.p.taut, changes: 0.0 }
    }
    fn outputs(&self, d: &Taut) -> TautOut {
        TautOut { taut: d.taut, changes: d.changes }
    }
    fn feedthrough(&self, d: &Taut, u: &LineIn) -> LineOut {
        let law = (self.p.stiffness, self.p.damping);
        LineOut::of(stretch(u, self.p.length), law, d.taut)
    }
    fn guards(&self, u: &LineIn) -> Change {
        let (_, extension, rate) = stretch(u, self.p.length);
        Change::of(extension, rate, (self.p.stiffness, self.p.damping))
    }
    fn mode(&self, d: &Taut, u: &LineIn) -> Taut {
        let (_, extension, rate) = stretch(u, self.p.length);
        d.after(Change::of(extension, rate, (self.p.stiffness, self.p.damping)).within > 0.0)
    }
    fn handle_event(&self, fired: Fired<'_>, d: &Taut) -> ((), Taut) {
        ((), d.after(fired.rose(0)))
    }
    fn startup_warnings(&self, u: &LineIn) -> Vec<BuildError> {
        // The state is that after the events of the start, so it does not show what was intended.
        let (_, extension, _) = stretch(u, self.p.length);
        let unexpected = !self.p.taut && extension > 1e-6 * self.p.length;
        let fact = stretched("line", extension, self.p.stiffness * extension);
        let help = "write `taut: true`, or increase `length`";
        unexpected.then(|| BuildError::new(fact).help(help).at("taut")).into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(length: f64) -> Line {
        Line { p: LineParams { length, stiffness: 1000.0, damping: 50.0, taut: false } }
    }

    fn ends(apart: f64, rate: f64) -> LineIn {
        let a = NodeState { position: Vec3::new(1.0, -2.0, 0.5), ..NodeState::identity() };
        let n = Vec3::new(2.0, -1.0, 2.0) / 3.0;
        let b = NodeState { position: a.position + n * apart, velocity: n * rate, ..a };
        LineIn { a, b }
    }

    fn at(taut: bool, apart: f64, rate: f64) -> (LineOut, Change) {
        let (m, d, u) = (line(5.0), Taut { taut, changes: 0.0 }, ends(apart, rate));
        (m.feedthrough(&d, &u), m.guards(&u))
    }

    #[test]
    fn it_pulls_both_ends_together_along_itself_and_never_pushes() {
        let (y, _) = at(true, 5.2, 1.0);
        assert!((y.tension - 250.0).abs() < 1e-9 && (y.extension - 0.2).abs() < 1e-12);
        assert_eq!(y.on_a.force + y.on_b.force, Vec3::zeros());
        assert!((y.on_a.force - Vec3::new(2.0, -1.0, 2.0) / 3.0 * 250.0).norm() < 1e-9);
        assert_eq!(at(true, 5.01, -1.0).0.tension, 0.0);
        assert_eq!(at(false, 5.2, 1.0).0.tension, 0.0);
        assert_eq!(at(true, 0.0, 0.0).0.on_a.force, Vec3::zeros());
    }

    #[test]
    fn it_is_taut_when_long_and_slack_when_it_would_push() {
        assert!(at(false, 4.99, 1.0).1.within < 0.0 && at(false, 5.01, 1.0).1.within > 0.0);
        // The line is longer than L but slack, because the damper would push.
        assert!(at(true, 5.06, -1.0).1.within > 0.0 && at(true, 5.04, -1.0).1.within < 0.0);
        // A line that became slack in this way is taut again as soon as the tension would be positive.
        assert!(at(false, 5.04, -1.0).1.within < 0.0 && at(false, 5.04, -0.7).1.within > 0.0);
        let fire = |which: usize, taut: bool| {
            let d = Taut { taut, changes: 2.0 };
            let which = if which == 0 { Fired::rising(0) } else { Fired::falling(0) };
            let (_, d) = line(5.0).handle_event(which, &d);
            (d.taut, d.changes)
        };
        assert_eq!((fire(0, false), fire(0, true)), ((true, 3.0), (true, 2.0)));
        assert_eq!((fire(1, true), fire(1, false)), ((false, 3.0), (false, 2.0)));
    }

    #[test]
    fn a_start_that_is_probably_not_meant_is_remarked() {
        let told = |length: f64| line(length).startup_warnings(&ends(5.2, 0.0)).len();
        assert_eq!((told(5.0), told(5.3)), (1, 0));
        let mut meant = line(5.0);
        meant.p.taut = true;
        assert!(meant.startup_warnings(&ends(5.2, 0.0)).is_empty());
    }
}
