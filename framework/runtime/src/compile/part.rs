//! A part while it is compiled.
use crate::author::block::{Prototype, Wiring};
use crate::plan::spec::PartSpec;

/// A part while compiling.
pub(crate) struct Part<'a> {
    pub spec: &'a PartSpec,
    pub prototype: Box<dyn Prototype>,
    pub wiring: Wiring,
    /// Paths of the services that it asks.
    pub asks: Vec<String>,
}
