//! Errors and warnings of models and services.

/// Error of a model that cannot be built from its parameters, or error or warning of a part or service at the start of a run or during it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct BuildError {
    /// The fact.
    pub message: String,
    /// The remedy.
    pub help: Option<String>,
    /// The faulty parameter, if a parameter is the cause.
    pub param: Option<String>,
    /// Marks the fault as one that stops a run. True if the fault stops a run; otherwise it is reported once, and the run continues.
    pub stops: bool,
}

impl BuildError {
    /// Creates an error with a message.
    pub fn new(message: impl Into<String>) -> Self {
        BuildError { message: message.into(), help: None, param: None, stops: false }
    }
    /// Converts an error of another crate.
    pub fn of(error: &dyn std::fmt::Display) -> Self {
        let (message, help) = crate::author::value::told(error);
        BuildError { message, help, param: None, stops: false }
    }
    /// Adds a remedy.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
    /// Sets the faulty parameter.
    pub fn at(mut self, param: impl Into<String>) -> Self {
        self.param = Some(param.into());
        self
    }
    /// Returns whether the fault stops a run.
    pub fn stopping(mut self, stops: bool) -> Self {
        self.stops = stops;
        self
    }
}
