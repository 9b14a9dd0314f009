//! Component library for power and heat: batteries with a curve of open-circuit voltage, solar panels with dust and shadow,
//! radioisotope generators, loads that switch off at low voltage; networks of thermal nodes and links, heaters with thermostats.
//!
//! A program adds the library with its catalogue; a file then uses a model by its name (`model: "power.battery"`):
//! ```
//! let catalogue = linkwork_runtime::Catalogue::new([linkwork_power::catalogue()]);
//! assert!(catalogue.get("power.battery").is_some());
//! ```

pub mod battery;
pub mod converter;
pub mod dust;
pub mod heat_source;
pub mod heater;
pub mod load;
pub mod rtg;
pub mod solar_panel;
pub mod sunlit;
pub mod supply;
pub mod thermal_boundary;
pub mod thermal_link;
pub mod thermal_node;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::model::<battery::Battery>(),
        Entry::model::<converter::Converter>(),
        Entry::model::<dust::Dust>(),
        Entry::model::<heat_source::HeatSource>(),
        Entry::model::<heater::Heater>(),
        Entry::model::<load::Load>(),
        Entry::model::<rtg::Rtg>(),
        Entry::model::<solar_panel::SolarPanel>(),
        Entry::sized::<sunlit::Sunlit>(),
        Entry::model::<supply::IdealSupply>(),
        Entry::model::<supply::ProgrammableSupply>(),
        Entry::model::<supply::Source>(),
        Entry::model::<thermal_boundary::ThermalBoundary>(),
        Entry::model::<thermal_link::ThermalLink>(),
        Entry::model::<thermal_node::ThermalNode>(),
    ]
}
