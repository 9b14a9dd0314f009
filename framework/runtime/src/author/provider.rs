//! Providers of services: parts that make a shared object.
use crate::author::files::Files;
use crate::author::params::Params;
use crate::author::services::{Provided, ServiceObject};

/// A provider of a service (complete it with `#[service(..)]`).
pub trait Service: Sized + Send + Sync + 'static {
    /// Name in the catalogue.
    const NAME: &'static str;
    /// Documentation.
    const DOC: &'static str;
    /// The trait that it provides: `dyn Terrain`.
    type Provides: ?Sized + Provided;
    /// Parameters.
    type Params: Params;
    /// Makes it; files are found relative to the assembly that names them.
    fn build(p: Self::Params, files: &Files) -> Result<Self, crate::BuildError>;
    /// Returns the provider as a shared object.
    fn object(self) -> ServiceObject;
}
