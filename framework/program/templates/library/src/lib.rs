//! The models of `@name@`.

pub mod @model@;

use linkwork::prelude::Entry;
use linkwork::runner::Library;
use linkwork::runtime::Catalogue;

/// Returns the models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![Entry::model::<@model@::@Model@>()]
}

/// Returns everything that a simulation can name: Linkwork's models and assemblies, FMI units, and the models above.
pub fn library() -> Library {
    let libraries = linkwork_assemblies::libraries().into_iter();
    Library {
        catalogue: Catalogue::new(libraries.chain([linkwork_fmi::catalogue(), catalogue()])),
        embedded: linkwork_assemblies::embedded(),
    }
}
