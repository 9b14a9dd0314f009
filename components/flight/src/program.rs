//! `flight.sequence`, `flight.body_load`: numbers and loads that change at given times and are held in between.
//! ```text
//! value_k from t_k to t_k+1; the first row holds before its time as well
//! ```
//! Every row is an event, so that no step of an integrator crosses a jump.

use linkwork_runtime::prelude::*;

/// State of a table over time.
#[derive(State, Clone, Copy, Debug)]
pub struct Passed {
    /// Number of rows that have been passed, without the first one.
    #[port("1")]
    pub rows: f64,
}

/// The next row.
#[derive(Ports, Clone, Copy, Debug)]
pub struct NextRow {
    /// Time since the next row.
    #[port("s", rising)]
    pub since: f64,
}

/// Times of rows, at which values change.
#[derive(Clone, Debug)]
pub struct Times(Vec<f64>);

impl Times {
    /// Checks that the times are strictly ascending and not empty.
    ///
    /// # Errors
    /// There is no time, or a time is not later than the one before; `param` names the rows.
    pub fn new(times: Vec<f64>, param: &str) -> Result<Times, BuildError> {
        if times.is_empty() {
            return Err(BuildError::new("there is no row")
                .help("write at least one row")
                .at(param));
        }
        match times.windows(2).position(|w| !(w[1] - w[0] >= 1e-6)) {
            None => Ok(Times(times)),
            Some(k) => {
                let fact = format!("{} s does not come after {} s", times[k + 1], times[k]);
                Err(BuildError::new(fact).help("sort the rows by time, 1 µs apart").at(param))
            }
        }
    }

    /// Returns the present row. A part that a later phase adds begins at the row of the present time.
    pub(crate) fn row(&self, c: &Clock, d: &Passed) -> usize {
        let k = (d.rows as usize).min(self.0.len() - 1);
        let begun = k == 0 || c.t >= self.0[k] - 1e-9;
        let over = self.0.get(k + 1).is_some_and(|next| c.t > next + 1e-9 + c.dt);
        if begun && !over { k } else { self.0.partition_point(|t| *t <= c.t).max(1) - 1 }
    }

    pub(crate) fn since(&self, c: &Clock, d: &Passed) -> NextRow {
        NextRow { since: self.0.get(self.row(c, d) + 1).map_or(-1.0, |next| c.t - next) }
    }

    pub(crate) fn pass(&self, c: &Clock, d: &Passed) -> Passed {
        Passed { rows: (self.row(c, d) + 1).min(self.0.len() - 1) as f64 }
    }
}

/// Rows of a number.
#[derive(Params, Clone, Debug)]
pub struct SequenceParams {
    /// Rows (time in s, value), in ascending order of time.
    #[param(unit = "s, 1")]
    pub rows: Vec<[f64; 2]>,
}

/// A number.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Value {
    /// Value of the row, in the SI unit of the input that it is wired to.
    #[port("*")]
    pub y: f64,
}

/// A number that changes at given times.
pub struct Sequence {
    p: SequenceParams,
    times: Times,
}

/// A number that changes at given times and is held between; every change is an event.
#[model("flight.sequence")]
impl Model for Sequence {
    type Params = SequenceParams;
    type FeedthroughOutputs = Value;
    type DiscreteState = Passed;
    type Guards = NextRow;
    fn build(p: SequenceParams) -> Result<Self, BuildError> {
        let times = Times::new(p.rows.iter().map(|r| r[0]).collect(), "rows")?;
        Ok(Sequence { p, times })
    }
    fn feedthrough(&self, clock: &Clock, d: &Passed) -> Value {
        Value { y: self.p.rows[self.times.row(clock, d)][1] }
    }
    fn guards(&self, clock: &Clock, d: &Passed) -> NextRow {
        self.times.since(clock, d)
    }
    fn handle_event(&self, clock: &Clock, d: &Passed) -> ((), Passed) {
        ((), self.times.pass(clock, d))
    }
}

/// A load from a time on.
#[derive(Params, Clone, Debug)]
pub struct LoadRow {
    /// Time at which the row begins.
    #[param(unit = "s")]
    pub time: f64,
    /// Force, axes of the node.
    #[param(unit = "N", default = Vec3::zeros())]
    pub force: Vec3,
    /// Moment, axes of the node.
    #[param(unit = "N m", default = Vec3::zeros())]
    pub moment: Vec3,
}

/// Rows of loads.
#[derive(Params, Clone, Debug)]
pub struct BodyLoadParams {
    /// Loads by time, rising.
    pub rows: Vec<LoadRow>,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BodyLoadIn {
    /// Node at which the force acts, with its axes.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// The load.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BodyLoadOut {
    /// Load on the body.
    #[port(bind = "body")]
    pub load: Wrench,
}

/// A load that changes at given times.
pub struct BodyLoad {
    p: BodyLoadParams,
    times: Times,
}

/// Force and moment in body axes that change at given times and are held between; every change is an event.
#[model("flight.body_load")]
impl Model for BodyLoad {
    type Params = BodyLoadParams;
    type FeedthroughInputs = BodyLoadIn;
    type FeedthroughOutputs = BodyLoadOut;
    type DiscreteState = Passed;
    type Guards = NextRow;
    fn build(p: BodyLoadParams) -> Result<Self, BuildError> {
        let times = Times::new(p.rows.iter().map(|r| r.time).collect(), "rows")?;
        Ok(BodyLoad { p, times })
    }
    fn feedthrough(&self, clock: &Clock, d: &Passed, u: &BodyLoadIn) -> BodyLoadOut {
        let row = &self.p.rows[self.times.row(clock, d)];
        let R = u.body.rotation;
        BodyLoadOut { load: Wrench { moment: R * row.moment, force: R * row.force } }
    }
    fn guards(&self, clock: &Clock, d: &Passed) -> NextRow {
        self.times.since(clock, d)
    }
    fn handle_event(&self, clock: &Clock, d: &Passed) -> ((), Passed) {
        ((), self.times.pass(clock, d))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sequence() -> Sequence {
        let rows = vec![[0.0, 1.0], [2.0, -3.0], [2.5, 7.0]];
        Sequence::build(SequenceParams { rows }).unwrap()
    }

    #[test]
    fn a_row_holds_until_the_event_of_the_next() {
        let m = sequence();
        let mut d = Passed { rows: 0.0 };
        let at = |t: f64| Clock::at(t, 0.1, 0);
        let y = |t: f64, d: &Passed| m.feedthrough(&at(t), d).y;
        assert_eq!((y(-1.0, &d), y(1.9, &d)), (1.0, 1.0));
        assert!((m.guards(&at(1.5), &d).since + 0.5).abs() < 1e-15);
        // The event is located within 1 ps of the row, before or after it.
        d = m.handle_event(&at(2.0 - 1e-12), &d).1;
        assert_eq!((d.rows, y(2.0 - 1e-12, &d), y(2.2, &d)), (1.0, -3.0, -3.0));
        d = m.handle_event(&at(2.5), &d).1;
        assert_eq!(y(9.0, &d), 7.0);
        assert_eq!(m.guards(&at(9.0), &d).since, -1.0);
        // A part that starts in a later phase begins in the middle of the program.
        assert_eq!(y(2.2, &Passed { rows: 0.0 }), -3.0);
    }

    #[test]
    fn rows_that_do_not_rise_are_refused() {
        for rows in [vec![], vec![[1.0, 0.0], [1.0, 2.0]]] {
            let e = Sequence::build(SequenceParams { rows }).err().unwrap();
            assert!(e.param.as_deref() == Some("rows") && e.help.is_some());
        }
    }

    #[test]
    fn a_load_turns_with_its_body() {
        let row = |time: f64, x: f64| LoadRow { time, force: Vec3::x() * x, moment: Vec3::z() * x };
        let m =
            BodyLoad::build(BodyLoadParams { rows: vec![row(0.0, 0.0), row(1.0, 5.0)] }).unwrap();
        let rotation = Quat::from_scaled_axis(Vec3::new(0.3, 0.2, -0.9));
        let u = BodyLoadIn { body: NodeState { rotation, ..NodeState::identity() } };
        let y = m.feedthrough(&Clock::at(1.5, 0.1, 0), &Passed { rows: 1.0 }, &u);
        assert!((y.load.force - rotation * Vec3::x() * 5.0).norm() < 1e-14);
        assert!((y.load.moment - rotation * Vec3::z() * 5.0).norm() < 1e-14);
    }
}
