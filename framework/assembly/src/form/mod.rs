//! Assemblies and simulations as written, before parameters are known.
pub(crate) mod assembly;
pub(crate) mod builder;
pub(crate) mod import;
mod part;
pub(crate) mod phases;
pub(crate) mod settings;
pub(crate) mod stowed;
pub(crate) mod wire;
