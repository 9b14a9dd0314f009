//! Variables of a run by name: reading, setting and pinning.
use super::simulation::Simulation;
use crate::author::value::remedy;
use crate::author::variable::{Place, Role, Variable};
use crate::plan::compiled::Plan;
use crate::step::simulation::VariableError;

/// Change of a variable from outside the simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The variable is set once.
    Set,
    /// The variable is pinned: it keeps the value.
    Pin,
    /// The variable is unpinned.
    Unpin,
}

impl Simulation {
    /// Returns the value at a place from [`Simulation::variable`]; NaN in a phase that has no such variable.
    #[inline]
    pub fn value(&self, place: Place) -> f64 {
        match place {
            Place::X(k) => self.state.x[k as usize],
            Place::D(k) => self.state.d[k as usize],
            Place::Signal(k) => self.state.sig[k as usize],
            Place::Channel(k) => {
                let place = self.program.channels[self.state.phase as usize][k as usize];
                place.map_or(f64::NAN, |place| self.value(place))
            }
            Place::Phase(k) => match self.state.entered.get(k as usize) {
                Some(t) if t.is_finite() => *t,
                _ => f64::NAN,
            },
        }
    }

    /// Finds a variable by path.
    ///
    /// # Errors
    /// No such variable; the message guesses which was meant.
    pub fn variable(&self, path: &str) -> Result<&Variable, VariableError> {
        self.plan.variable(path)
    }

    /// Reads a variable by path.
    ///
    /// # Errors
    /// As [`Simulation::variable`].
    pub fn get(&self, path: &str) -> Result<f64, VariableError> {
        let known = self.variable(path)?;
        let value = self.value(known.place);
        let of_phases = |k: u32| {
            let place = self.program.channels[self.state.phase as usize][k as usize];
            matches!(place, Some(Place::Phase(_)))
        };
        if matches!(known.place, Place::Channel(k) if of_phases(k)) {
            return Ok(value);
        }
        Ok(self.value(self.here(path)?.place))
    }

    /// A variable of the present phase.
    pub(super) fn here(&self, path: &str) -> Result<&Variable, VariableError> {
        let known = self.variable(path)?;
        self.plan.lanes.get(path).ok_or_else(|| VariableError {
            message: format!(
                "`{path}` of `{}` does not exist in phase `{}`",
                known.part,
                self.phase()
            ),
            help: "read or set it in a phase that has it".into(),
        })
    }

    /// Sets a state or an input without a wire, by path, with effect from the current instant on.
    ///
    /// # Errors
    /// Returns an error for an unknown variable, a value that is not finite, a variable that is driven by something else, and a pinned variable.
    /// Nothing is changed then.
    pub fn set(&mut self, path: &str, value: f64) -> Result<(), VariableError> {
        let v = self.here(path)?.clone();
        let refuse =
            |message: String, help: &str| Err(VariableError { message, help: help.to_string() });
        if !value.is_finite() {
            return refuse(format!("`{path}` cannot be set to {value}"), "give a finite number");
        }
        if let Some(pinned) = self.pinned(path) {
            return refuse(
                format!("`{path}` is pinned to {pinned}"),
                "unpin it first, or pin it to another value",
            );
        }
        let before = self.value(v.place);
        match (v.role, v.place) {
            (Role::State, Place::X(k)) => self.state.x[k as usize] = value,
            (Role::State, Place::D(k)) => self.state.d[k as usize] = value,
            (Role::Free, Place::Signal(k)) => self.state.sig[k as usize] = value,
            (Role::Output, _) => {
                return refuse(
                    format!("`{path}` is an output: it follows from the model"),
                    "pin it, or set a state or an input without a wire",
                );
            }
            _ => {
                return refuse(
                    format!("`{path}` is driven by a wire"),
                    "set the source of the wire, or remove the wire",
                );
            }
        }
        let plan = self.plan.clone();
        self.refresh().and_then(|()| self.look(&plan)).map_err(|stopped| {
            let e = self.stopped(stopped);
            // Restore the earlier state, which could be evaluated.
            match v.place {
                Place::X(k) => self.state.x[k as usize] = before,
                Place::D(k) => self.state.d[k as usize] = before,
                Place::Signal(k) => self.state.sig[k as usize] = before,
                Place::Channel(_) | Place::Phase(_) => {}
            }
            let _ = self.refresh();
            VariableError { message: e.message, help: e.help.unwrap_or_default() }
        })?;
        if v.role == Role::State {
            self.tell_observer_of_change();
        }
        Ok(())
    }

    /// Sets, pins or unpins a variable ([`Simulation::set`], [`Simulation::pin`], [`Simulation::unpin`]): for replaying the changes in a log. `value`
    /// is ignored when unpinning.
    ///
    /// # Errors
    /// As these.
    pub fn change(&mut self, path: &str, change: Change, value: f64) -> Result<(), VariableError> {
        match change {
            Change::Set => self.set(path, value),
            Change::Pin => self.pin(path, value),
            Change::Unpin => self.unpin(path),
        }
    }

    /// Changes several variables in this order: all of them or none. Pins are applied once for all changes.
    ///
    /// # Errors
    /// Returns the first error.
    pub fn change_all(
        &mut self,
        change: Change,
        all: &[(String, f64)],
    ) -> Result<(), VariableError> {
        match (change, all) {
            (Change::Set, [(path, value)]) => return self.set(path, *value),
            (Change::Set, _) => {}
            (Change::Pin, _) => return self.pin_all(all),
            (Change::Unpin, _) => {
                return self.unpin_all(&all.iter().map(|(path, _)| &**path).collect::<Vec<_>>());
            }
        }
        let (before, broken) = (self.state.clone(), self.broken.clone());
        let done = all.iter().try_for_each(|(path, value)| self.set(path, *value));
        done.inspect_err(|_| {
            (self.state, self.broken) = (before, broken);
            self.replaced();
        })
    }
}

impl Plan {
    /// Finds a variable by path.
    ///
    /// # Errors
    /// No such variable; the message guesses which was meant.
    pub fn variable(&self, path: &str) -> Result<&Variable, VariableError> {
        self.variables.get(path).ok_or_else(|| {
            let known: Vec<&str> = self.variables.keys().map(String::as_str).collect();
            let message = format!("there is no variable `{path}`");
            // Hinge loads are computed only if a body requests them.
            let load = path.contains(".reaction_") || path.ends_with(".effort");
            let body = path.rsplit_once(".reaction_").or(path.rsplit_once('.')).map_or("", |p| p.0);
            if load && !known.iter().any(|k| k.starts_with(&format!("{body}.reaction_"))) {
                let help = format!(
                    "write `reaction: true` in the body `{body}` for the load of its hinge"
                );
                return VariableError { message, help };
            }
            VariableError { message, help: remedy(path, "variables", &known) }
        })
    }
}
