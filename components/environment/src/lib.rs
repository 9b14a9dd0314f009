//! Component library: environment. Terrain, gravity, air and sun as services: what other parts ask about the
//! place where they are.
//!
//! A program takes it by its catalogue, and a file names its models (`model: "environment.mars_air"`):
//! ```
//! let catalogue = linkwork_runtime::Catalogue::new([linkwork_environment::catalogue()]);
//! assert!(catalogue.get("environment.mars_air").is_some());
//! ```
#![allow(non_snake_case)]

pub mod air;
pub mod craters;
pub mod fields;
pub mod generated_terrain;
pub mod generator;
pub mod gravity;
pub mod height_field;
pub mod landforms;
pub mod mars_sun;
pub mod planet;
pub mod planet_air;
pub mod planet_sun;
pub mod polyhedral_gravity;
pub mod random;
pub mod soil;
pub mod soil_map;
pub mod terrain;
pub mod tiled_terrain;
pub mod tiles;

use linkwork_runtime::prelude::Entry;

/// The services of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::service::<terrain::FileTerrain>(),
        Entry::service::<terrain::GridTerrain>(),
        Entry::service::<terrain::Flat>(),
        Entry::service::<tiled_terrain::TiledTerrain>(),
        Entry::service::<fields::UniformGravity>(),
        Entry::service::<fields::PointMassGravity>(),
        Entry::service::<fields::ExponentialAtmosphere>(),
        Entry::service::<gravity::SphericalHarmonics>(),
        Entry::service::<gravity::ZonalGravity>(),
        Entry::service::<polyhedral_gravity::PolyhedralGravity>(),
        Entry::service::<planet_air::StandardAtmosphere>(),
        Entry::service::<planet_air::MsisAtmosphere>(),
        Entry::service::<planet_air::MarsAtmosphere>(),
        Entry::service::<planet_sun::EphemerisSun>(),
        Entry::service::<fields::MarsSun>(),
        Entry::service::<fields::FixedSun>(),
    ]
}

#[cfg(test)]
mod tests {
    use linkwork_runtime::Catalogue;

    #[test]
    fn names_are_unique_and_documented() {
        let all = Catalogue::new([super::catalogue()]);
        assert_eq!(all.iter().count(), 16);
        assert!(all.iter().all(|e| !e.description.doc.is_empty()));
    }
}
