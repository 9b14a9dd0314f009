//! A part during compilation.
use crate::author::block::{Prototype, Wiring};
use crate::plan::spec::PartSpec;

/// A part while compiling.
pub(crate) struct Part<'a> {
    pub spec: &'a PartSpec,
    pub prototype: Box<dyn Prototype>,
    pub wiring: Wiring,
    /// Paths of the services that it uses.
    pub asks: Vec<String>,
}
