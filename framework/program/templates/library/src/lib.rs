//! The models of `@name@`.

pub mod @model@;

use linkwork::model::prelude::Entry;
use linkwork::prelude::Library;

/// Returns the models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![Entry::model::<@model@::@Model@>()]
}

/// Returns everything that a simulation can name: Linkwork's models and assemblies, FMI units, and the models above.
pub fn library() -> Library {
    linkwork::components::library().with(linkwork_fmi::catalogue()).with(catalogue())
}
