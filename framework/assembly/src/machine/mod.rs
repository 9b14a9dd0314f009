//! Mechanisms from files of other programs as assemblies.
pub(crate) mod convert;
pub(crate) mod devices;
pub(crate) mod import;
pub(crate) mod sidecar;
