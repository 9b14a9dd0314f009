//! Assemblies and simulations as written in files, before parameters are replaced.
pub(crate) mod assembly;
pub(crate) mod import;
mod part;
pub(crate) mod phases;
mod print;
pub(crate) mod settings;
pub(crate) mod stowed;
pub(crate) mod wire;

pub use crate::scope::parameters::ParamDecl;
pub use assembly::{AssemblyForm, ItemForm, MountDecl, PartForm, PartKind};
pub use settings::{
    AroundForm, ArrowForm, LineForm, LogRule, Metric, MetricOf, PlacementForm, Plot, PlumeForm,
    Settings, Take, ViewForm,
};
