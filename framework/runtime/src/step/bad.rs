//! Variables that are not finite, and states that have diverged.
use super::simulation::{RunError, Simulation};
use super::state::State;
use crate::author::variable::{Place, Role, Variable};

/// A continuous state beyond this magnitude counts as diverged.
const RUNAWAY: f64 = 1e15;

/// Returns whether any of these is NaN or not below this magnitude. There are no branches, so that the compiler can vectorize the comparison.
fn beyond(values: &[f64], limit: f64) -> bool {
    values.iter().fold(false, |found, v| found | !(v.abs() < limit))
}

impl Simulation {
    pub(super) fn is_bad(&self) -> bool {
        let State { x, d, sig, .. } = &self.state;
        beyond(x, RUNAWAY) || beyond(sig, f64::INFINITY) || beyond(d, f64::INFINITY)
    }

    /// Returns the first variable that is not finite, or a state that has diverged, with its value.
    pub(crate) fn bad_variable(&self) -> Option<(String, f64)> {
        self.is_bad().then(|| {
            let path = self.first_bad().path;
            let value = self.plan.lanes.get(&path).map_or(f64::NAN, |v| self.value(v.place));
            (path, value)
        })
    }

    pub(super) fn first_bad(&self) -> RunError {
        let bad = |v: &Variable| {
            let value = self.value(v.place);
            let limit = if matches!(v.place, Place::X(_)) { RUNAWAY } else { f64::INFINITY };
            (!(value.abs() < limit)).then_some(value)
        };
        let mut found: Vec<(bool, &String, f64)> = self
            .plan
            .lanes
            .iter()
            .filter(|(_, v)| v.role != Role::Input)
            .filter_map(|(path, v)| Some((v.role != Role::State, path, bad(v)?)))
            .collect();
        found.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)));
        let (path, value) = found
            .first()
            .map_or(("a signal without a name".to_string(), f64::NAN), |f| (f.1.clone(), f.2));
        let others = match found.len() {
            0 | 1 => String::new(),
            n => format!(" ({} more variables are bad)", n - 1),
        };
        let message = format!("`{path}` became {value}{others}");
        RunError { time: self.time(), path, message, help: None }
    }
}
