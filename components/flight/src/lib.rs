//! Component library: flight.

pub mod drag;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![Entry::model::<drag::Drag>()]
}
