//! Expansion of assemblies to a tree of instances, and resolution of names in it.
pub(crate) mod assemblies;
pub(crate) mod expander;
pub(crate) mod instance;
pub(crate) mod reference;
pub(crate) mod stowed;
pub(crate) mod tree;
pub(crate) mod variant;
