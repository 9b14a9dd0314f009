//! Parts, bindings and wires of the flat `Spec`.
pub(crate) mod parts;
pub(crate) mod wires;
