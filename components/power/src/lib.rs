//! Component library: power.

pub mod battery;
pub mod solar_panel;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![Entry::model::<battery::Battery>(), Entry::model::<solar_panel::SolarPanel>()]
}
