//! Component library of basic models: signal sources, arithmetic, filters, profiles, holds and delays, integrators of energy and
//! path length.
//!
//! A program adds the library with its catalogue; a file then uses a model by its name (`model: "basics.lag"`):
//! ```
//! let catalogue = linkwork_runtime::Catalogue::new([linkwork_basics::catalogue()]);
//! assert!(catalogue.get("basics.lag").is_some());
//! ```

pub mod arithmetic;
pub mod continuous;
pub mod drop_out;
pub mod events;
pub mod ports;
pub mod profile;
pub mod rows;
pub mod sampled;
pub mod sources;
pub mod trajectory;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::model::<arithmetic::Gain>(),
        Entry::model::<arithmetic::Sum>(),
        Entry::model::<arithmetic::Product>(),
        Entry::model::<arithmetic::Quotient>(),
        Entry::model::<arithmetic::Saturation>(),
        Entry::model::<arithmetic::Lookup>(),
        Entry::model::<arithmetic::Comparator>(),
        Entry::model::<sources::Constant>(),
        Entry::model::<sources::Sine>(),
        Entry::model::<sources::Step>(),
        Entry::model::<sources::Ramp>(),
        Entry::model::<continuous::Integrator>(),
        Entry::model::<continuous::Lag>(),
        Entry::model::<continuous::EnergyMeter>(),
        Entry::model::<continuous::PathMeter>(),
        Entry::model::<events::BouncingBall>(),
        Entry::model::<events::Relay>(),
        Entry::model::<sampled::Hold>(),
        Entry::model::<sampled::Delay>(),
        Entry::sized::<drop_out::DropOut>(),
        Entry::model::<sampled::Differentiator>(),
        Entry::model::<sampled::Statistics>(),
        Entry::model::<trajectory::HingeTrajectory>(),
        Entry::model::<trajectory::SliderTrajectory>(),
    ]
}
