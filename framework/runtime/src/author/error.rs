//! Errors and warnings of models and services.

/// A model cannot be built from these parameters; or what a part or a service says of a run, when it begins or in the middle of it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct BuildError {
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// The parameter at fault, when it is one.
    pub param: Option<String>,
    /// Said of a run: it stops there. True if the fault stops a run; otherwise it is reported once, and the run continues.
    pub stops: bool,
}

impl BuildError {
    /// With a message.
    pub fn new(message: impl Into<String>) -> Self {
        BuildError { message: message.into(), help: None, param: None, stops: false }
    }
    /// Converts an error of another crate.
    pub fn of(error: &dyn std::fmt::Display) -> Self {
        let (message, help) = crate::author::value::told(error);
        BuildError { message, help, param: None, stops: false }
    }
    /// With a remedy.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
    /// At a parameter.
    pub fn at(mut self, param: impl Into<String>) -> Self {
        self.param = Some(param.into());
        self
    }
    /// Said of a run: whether it stops there.
    pub fn stopping(mut self, stops: bool) -> Self {
        self.stops = stops;
        self
    }
}
