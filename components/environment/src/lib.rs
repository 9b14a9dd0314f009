//! Component library: environment. Terrain, gravity, air and sun as services.

pub mod air;
pub mod dem;
pub mod fields;
pub mod generator;
pub mod height_field;
pub mod mars_sun;
pub mod random;
pub mod soil;
pub mod terrain;

use linkwork_runtime::prelude::Entry;

/// The services of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::service::<terrain::FileTerrain>(),
        Entry::service::<terrain::GridTerrain>(),
        Entry::service::<terrain::Flat>(),
        Entry::service::<fields::UniformGravity>(),
        Entry::service::<fields::PointMassGravity>(),
        Entry::service::<fields::ExponentialAtmosphere>(),
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
        assert_eq!(all.iter().count(), 8);
        assert!(all.iter().all(|e| !e.description.doc.is_empty()));
    }
}
