//! Component library: environment. Terrain, gravity, air and sun as services: what other parts ask about the
//! place where they are.
//!
//! A program takes it by its catalogue, and a file names its models (`model: "environment.mars_air"`):
//! ```
//! let catalogue = linkwork_runtime::Catalogue::new([linkwork_environment::catalogue()]);
//! assert!(catalogue.get("environment.mars_air").is_some());
//! ```
//!
//! ## Ground from files
//! `environment.height_field` holds a map in memory, of at most 64 million nodes: GeoTIFF, ESRI ASCII grids, points on a
//! grid, grey PNG and BMP, images of PDS3 and PDS4. `environment.tiled_terrain` reads a map of any size from a file of tiles while
//! it is driven on. `linkwork terrain` looks at such files and makes them:
//! ```text
//! linkwork terrain show crater.tif --picture crater.png       size, heights, histogram, picture
//! linkwork terrain convert crater.tif crater.tiles            .tif and .tiles may be larger than memory
//! linkwork terrain resample crater.tif fine.tiles --to-spacing 0.1
//! linkwork terrain crop crater.tif rim.tif --within 120,80,220,180
//! linkwork terrain merge west.tif east.tif --out both.tif
//! linkwork terrain make yard.tif --set size=[50,50] --set rock_cover=0.1 --set crater_age_gyr=3
//! ```
//! * If a map is in degrees, its node spacing in metres is computed from the ellipsoid that the file states, at the latitude of the middle of the map. A map is rejected if that spacing is wrong by more than 1 % at its northern or southern edge. Rotated maps and files with several bands or colours are rejected as well.
//! * Made ground has its rocks in its heights; a file of it has no list of them. `make` holds the whole map in memory; a larger one is
//!   made of it by `resample`.
//! * A terrain in tiles keeps 256 of them (`kept`), some 70 MB; which are kept changes no number. What needs all heights at once (bodies
//!   with colliders, cameras, lidars) is given the `region` that is written, and is refused without one. A tile that is damaged
//!   or cannot be read stops the run with its place.
//! * Where a map has no data, and beyond its edge, there is no ground: wheels and bodies fall, `place` refuses.
#![allow(non_snake_case)]

pub mod air;
pub mod body_field;
pub mod craters;
mod ephemeris;
pub mod fields;
pub mod generated_terrain;
pub mod generator;
pub mod gravity;
pub mod height_field;
pub mod landforms;
mod light;
pub mod map_file;
pub mod map_parts;
pub mod mars_sun;
mod noise;
pub mod planet_air;
pub mod planet_sun;
pub mod polyhedral_gravity;
pub mod random;
pub mod soil;
pub mod soil_map;
pub mod terrain;
pub mod third;
pub mod third_bodies;
pub mod tiled_terrain;
pub mod tiles;
pub mod world;

use linkwork_runtime::prelude::Entry;

/// The services of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::service::<terrain::FileTerrain>(),
        Entry::service::<terrain::GridTerrain>(),
        Entry::service::<terrain::Flat>(),
        Entry::service::<tiled_terrain::TiledTerrain>(),
        Entry::service::<world::PlanetWorld>(),
        Entry::service::<fields::UniformGravity>(),
        Entry::service::<fields::PointMassGravity>(),
        Entry::service::<fields::ExponentialAtmosphere>(),
        Entry::service::<gravity::SphericalHarmonics>(),
        Entry::service::<gravity::ZonalGravity>(),
        Entry::service::<polyhedral_gravity::PolyhedralGravity>(),
        Entry::service::<planet_air::StandardAtmosphere>(),
        Entry::service::<planet_air::MsisAtmosphere>(),
        Entry::service::<planet_air::MarsAtmosphere>(),
        Entry::service::<planet_air::TableAtmosphere>(),
        Entry::service::<planet_sun::EphemerisSun>(),
        Entry::service::<fields::FixedSun>(),
    ]
}

#[cfg(test)]
mod tests {
    use linkwork_runtime::Catalogue;

    #[test]
    fn names_are_unique_and_documented() {
        let all = Catalogue::new([super::catalogue()]);
        assert_eq!(all.iter().count(), 17);
        assert!(all.iter().all(|e| !e.description.doc.is_empty()));
    }
}
