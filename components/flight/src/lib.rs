//! Component library: flight.

pub mod drag;
pub mod radiation_pressure;
pub mod separation_spring;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::model::<drag::Drag>(),
        Entry::model::<radiation_pressure::RadiationPressure>(),
        Entry::model::<separation_spring::SeparationSpring>(),
    ]
}
