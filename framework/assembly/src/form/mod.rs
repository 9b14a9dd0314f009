//! Assemblies and simulations as written in files, before parameters are replaced.
pub(crate) mod assembly;
pub(crate) mod builder;
pub(crate) mod import;
mod part;
pub(crate) mod phases;
pub(crate) mod settings;
pub(crate) mod stowed;
pub(crate) mod wire;
