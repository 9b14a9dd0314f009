//! Parts, bindings and wires of the flat `Spec`.
mod connect;
pub(crate) mod parts;
pub(crate) mod wires;
