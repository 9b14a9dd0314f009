//! The RON assemblies of Linkwork, embedded in the crate (`rovers/…`, `arms/…`, `legs/…`, `parts/…`, `flight/…`, `worlds/…`),
//! and the catalogue of all models that they use.
//!
//! | rover | wheels | class |
//! |---|---|---|
//! | `rovers/rocker_bogie.ron` | 6, of which 4 steer, on rockers and bogies | Curiosity, with the default parameters |
//! | `rovers/mer.ron`, `rovers/sojourner.ron` | 6, of which 4 steer, on rockers and bogies | Spirit and Opportunity; Sojourner (`rovers/rocker_bogie.ron` with other parameters) |
//! | `rovers/four_wheeler.ron` | 4, which all steer, on suspension arms that servos move | VIPER |
//! | `rovers/eight_wheeler.ron` | 8, without steering, on sprung arms | Lunokhod |
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = r#"Simulation(
//!     parts: {
//!         "Source": (model: "basics.constant", params: { "value": 2 }),
//!         "Filter": (model: "basics.lag", params: { "time_constant": "1 s" }),
//!     },
//!     wires: ["Source.y -> Filter.u"],
//!     until: "1 s",
//! )"#;
//! let mut sim = linkwork_assemblies::library().text("filter.ron", text)?.simulation();
//! sim.run_until(1.0)?;
//! assert!((sim.get("Filter.y")? - 2.0 * (1.0 - (-1f64).exp())).abs() < 1e-9);
//! # Ok(())
//! # }
//! ```
use include_dir::{Dir, include_dir};
use linkwork_assembly::Library;
use linkwork_runtime::{Catalogue, Entry};
use std::collections::BTreeMap;
use std::sync::Arc;

static PARTS: Dir<'static> = include_dir!("$CARGO_MANIFEST_DIR/parts");
static ARMS: Dir<'static> = include_dir!("$CARGO_MANIFEST_DIR/arms");
static LEGS: Dir<'static> = include_dir!("$CARGO_MANIFEST_DIR/legs");
static ROVERS: Dir<'static> = include_dir!("$CARGO_MANIFEST_DIR/rovers");
static FLIGHT: Dir<'static> = include_dir!("$CARGO_MANIFEST_DIR/flight");
static BEHAVIOURS: Dir<'static> = include_dir!("$CARGO_MANIFEST_DIR/behaviours");
static WORLDS: Dir<'static> = include_dir!("$CARGO_MANIFEST_DIR/worlds");

/// All models and services of the component libraries, and all assemblies that ship with Linkwork.
#[must_use]
pub fn library() -> Library {
    Library { catalogue: Catalogue::new(libraries()), embedded: embedded() }
}

/// Every model and service of the component libraries, library by library.
#[must_use]
pub fn libraries() -> [Vec<Entry>; 10] {
    [
        linkwork_basics::catalogue(),
        linkwork_actuators::catalogue(),
        linkwork_sensors::catalogue(),
        linkwork_mobility::catalogue(),
        linkwork_environment::catalogue(),
        linkwork_flight::catalogue(),
        linkwork_control::catalogue(),
        linkwork_manipulation::catalogue(),
        linkwork_navigation::catalogue(),
        linkwork_power::catalogue(),
    ]
}

/// Path (`rovers/rocker_bogie.ron`) → text of every assembly; `behaviours/MODEL.ron` is a small simulation that
/// shows what a model does, for `linkwork describe` and the book.
pub fn embedded() -> Arc<BTreeMap<String, String>> {
    let mut all = BTreeMap::new();
    let folders = [
        ("parts", &PARTS),
        ("rovers", &ROVERS),
        ("arms", &ARMS),
        ("legs", &LEGS),
        ("flight", &FLIGHT),
        ("worlds", &WORLDS),
        ("behaviours", &BEHAVIOURS),
    ];
    for (folder, dir) in folders {
        for file in dir.files() {
            if let Some(text) = file.contents_utf8() {
                all.insert(format!("{folder}/{}", file.path().display()), text.to_string());
            }
        }
    }
    Arc::new(all)
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_folder_has_assemblies() {
        let all = super::embedded();
        for folder in ["parts/", "rovers/", "arms/", "legs/", "flight/", "worlds/", "behaviours/"] {
            assert!(all.keys().any(|k| k.starts_with(folder)), "{folder} is empty");
        }
    }
}
