//! The models of `@name@`.

pub mod @model@;

use linkwork::model::prelude::Entry;
use linkwork::prelude::Library;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![Entry::model::<@model@::@Model@>()]
}

/// Everything that a simulation may name: Linkwork's models and assemblies, foreign units, and the models above.
pub fn library() -> Library {
    linkwork::components::library().with(linkwork_fmi::catalogue()).with(catalogue())
}
