//! Variables of a run over time, in memory: one column for each.
use crate::prepare::log_rules;
use linkwork_assembly::form::LogRule;
use linkwork_assembly::{Failure, Text};
use linkwork_runtime::{
    Fault, Group, IntoSeconds, Origin, Rows, RunError, Sample, Simulation, Sink, Sources,
};
use std::ops::Index;

/// The times and values that were recorded. Rows are sent to it by [`Rows::sample`].
#[derive(Debug, Default)]
pub struct Columns {
    /// Times of the rows (s).
    pub t: Vec<f64>,
    /// The values of each variable (SI), as many as there are times.
    pub values: Vec<Vec<f64>>,
    spare: Sample,
}

impl Columns {
    /// Makes columns for this number of variables.
    #[must_use]
    pub fn new(variables: usize) -> Columns {
        Columns { values: vec![Vec::new(); variables], ..Columns::default() }
    }
}

impl Sink for Columns {
    fn room(&mut self) -> Result<Option<Sample>, String> {
        Ok(Some(std::mem::take(&mut self.spare)))
    }
    fn send(&mut self, row: Sample) -> Result<(), String> {
        self.t.push(row.t);
        self.values.iter_mut().zip(&row.values).for_each(|(column, y)| column.push(*y));
        self.spare = row;
        Ok(())
    }
}

/// Variables of a run over time. It advances the run and takes a row at the first tick at or after each multiple of its period.
///
/// ```
/// use linkwork_assembly::{Assembly, Body};
/// use linkwork_multibody::Hinge;
/// use linkwork_runner::Recording;
/// use linkwork_spatial::Vec3;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut wheel = Assembly::new();
/// let body = Body::on("world").hinge(Hinge::pin(Vec3::y())).mass(1.0).inertia([0.1; 3]);
/// wheel.body("wheel", body.initial_rate(2.0));
/// let mut sim = wheel.simulation()?;
/// let mut log = Recording::new(&sim, ["wheel.*"], 0.5)?;
/// log.run_until(&mut sim, 1.0)?;
/// assert_eq!(log.t(), [0.0, 0.5, 1.0]);
/// assert_eq!(log["wheel.rate"], [2.0; 3]);
/// assert!((log["wheel.angle"][2] - 2.0).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
pub struct Recording {
    names: Vec<String>,
    units: Vec<String>,
    rows: Rows,
    columns: Columns,
}

impl Recording {
    /// Records variables from the present instant on. `channels` are paths or patterns of them (`"Rover.**.torque"`); `period` is
    /// the time between rows (s).
    ///
    /// # Errors
    /// Patterns that match nothing, and a period that is not a time above zero.
    #[track_caller]
    pub fn new<C: AsRef<str>>(
        sim: &Simulation,
        channels: impl IntoIterator<Item = C>,
        period: impl IntoSeconds,
    ) -> Result<Recording, Failure> {
        let origin = Origin::caller();
        let failure = |faults| Failure { faults, sources: Sources::default() };
        let help = "give the time between rows: seconds above zero, or a text such as \"50 Hz\"";
        let wrong = |message: String| failure(vec![Fault::new(origin, message).help(help)]);
        let rate = period.into_seconds().map_err(wrong)?;
        if rate.num == 0 {
            return Err(wrong("the period of a recording is zero".to_string()));
        }
        let text = |c: C| Text { text: c.as_ref().to_string(), origin };
        let channels = channels.into_iter().map(text).collect();
        let rule = LogRule { channels, rate: Some(rate), on_change: false, around: None, origin };
        let plan = sim.plan();
        let names: Vec<String> =
            log_rules(plan, &[rule]).map_err(failure)?.into_iter().flat_map(|r| r.paths).collect();
        let known = || names.iter().map(|name| &plan.variables[name]);
        let places = known().map(|v| v.place).collect();
        let units = known().map(|v| v.unit.to_string()).collect();
        let group = Group { period: rate, places, ..Group::default() };
        let rows = Rows::from_now(sim, 0, group).map_err(wrong)?;
        let columns = Columns::new(names.len());
        Ok(Recording { names, units, rows, columns })
    }

    /// Runs to the first row of the simulation at or after `t`, in seconds or as a text (`"2 min"`).
    ///
    /// # Errors
    /// The errors of [`Simulation::run_until`]. Rows that were recorded before remain.
    pub fn run_until(&mut self, sim: &mut Simulation, t: impl IntoSeconds) -> Result<(), RunError> {
        sim.run_with(t, |sim| {
            self.sample(sim);
            Ok(())
        })
    }

    /// Takes a row, when one is due at the present tick: for programs that advance the run themselves.
    pub fn sample(&mut self, sim: &Simulation) {
        // The columns grow, so this cannot fail.
        let _ = self.rows.sample(sim, &mut self.columns);
    }

    /// Returns the times of the rows (s).
    #[must_use]
    pub fn t(&self) -> &[f64] {
        &self.columns.t
    }

    /// Returns the paths of the recorded variables.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the values of a variable (SI); `None` when it is not recorded.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        Some(&self.columns.values[self.place(name)?])
    }

    /// Returns the unit of a variable; `None` when it is not recorded.
    #[must_use]
    pub fn unit(&self, name: &str) -> Option<&str> {
        Some(&self.units[self.place(name)?])
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }
}

/// The values of a variable (SI).
///
/// # Panics
/// When the variable is not recorded; [`Recording::get`] returns `None` then.
impl Index<&str> for Recording {
    type Output = [f64];
    fn index(&self, name: &str) -> &[f64] {
        self.get(name).unwrap_or_else(|| panic!("`{name}` is not recorded: {:?}", self.names))
    }
}
