//! Component library: power. Batteries with a curve of open-circuit voltage, solar panels that see the sun.
//!
//! A program takes it by its catalogue, and a file names its models (`model: "power.battery"`):
//! ```
//! let catalogue = linkwork_runtime::Catalogue::new([linkwork_power::catalogue()]);
//! assert!(catalogue.get("power.battery").is_some());
//! ```

pub mod battery;
pub mod solar_panel;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![Entry::model::<battery::Battery>(), Entry::model::<solar_panel::SolarPanel>()]
}
