//! A Python class with its parameters, as a part of a simulation.
use super::Class;
use super::continuous::Continuous;
use super::sampled::Sampled;
use linkwork_runtime::{Block, Description, Prototype, Value, Wiring};
use pyo3::prelude::*;

/// How the state of a sampled part is saved.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Saves {
    /// The part has its own `save` and `load`.
    Own,
    /// `stateless = True`, or a continuous part: the object does not have state.
    Nothing,
    /// The class does not define how its state is saved.
    Not,
}

pub(super) struct Part {
    pub class: Class,
    pub params: Value,
    pub description: Description,
    /// The continuous states at the start.
    pub start: Vec<f64>,
    pub saves: Saves,
}

impl Prototype for Part {
    fn description(&self) -> &Description {
        &self.description
    }
    fn params(&self) -> &Value {
        &self.params
    }
    fn initial(&self, x: &mut [f64], _: &mut [f64]) {
        x.copy_from_slice(&self.start);
    }
    fn stored(&self) -> bool {
        self.saves != Saves::Nothing
    }
    fn can_save(&self) -> Result<(), String> {
        match self.saves {
            Saves::Own | Saves::Nothing => Ok(()),
            Saves::Not => Err(unsaved(&self.class.name)),
        }
    }
    fn block(&self, w: Wiring) -> Box<dyn Block> {
        let (class, params) = (Python::attach(|py| self.class.copy(py)), self.params.clone());
        let d = &self.description;
        match class.sampled {
            true => Box::new(Sampled::new(class, params, d, self.saves, w)),
            false => Box::new(Continuous::new(class, params, d, w)),
        }
    }
}

pub(super) fn unsaved(name: &str) -> String {
    format!(
        "the Python class of `{name}` does not define how its state is saved\n  help: give it `save(self)` and \
         `load(self, saved)`, or set `stateless = True` in it"
    )
}
