//! Assemblies and simulations as written, before parameters are known.
pub(crate) mod assembly;
pub(crate) mod builder;
mod part;
pub(crate) mod phases;
pub(crate) mod settings;
