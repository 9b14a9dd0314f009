//! The models of `@name@`.

pub mod @model@;

use linkwork::prelude::Entry;
use linkwork::runner::Library;
use linkwork::runtime::Catalogue;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![Entry::model::<@model@::@Model@>()]
}

/// Everything that a simulation may name: Linkwork's models and assemblies, foreign units, and the models above.
pub fn library() -> Library {
    let libraries = linkwork_assemblies::libraries().into_iter();
    Library {
        catalogue: Catalogue::new(libraries.chain([linkwork_fmi::catalogue(), catalogue()])),
        embedded: linkwork_assemblies::embedded(),
    }
}
