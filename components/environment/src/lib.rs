//! Component library of environments: terrain, gravity, atmosphere and Sun, as services that other parts query.
//!
//! A program adds the library with its catalogue; a file then uses a model by its name (`model: "environment.mars_air"`):
//! ```
//! let catalogue = linkwork_runtime::Catalogue::new([linkwork_environment::catalogue()]);
//! assert!(catalogue.get("environment.mars_air").is_some());
//! ```
//!
//! ## Ground from files
//! `environment.height_field` holds a map in memory, of at most 64 million nodes: GeoTIFF, ESRI ASCII grids, points on a
//! grid, grey PNG and BMP, images of PDS3 and PDS4. `environment.tiled_terrain` reads a map of any size from a tile file during the run.
//! `linkwork terrain` shows and generates such files:
//! ```text
//! linkwork terrain show crater.tif --picture crater.png       size, heights, histogram, picture
//! linkwork terrain convert crater.tif crater.tiles            .tif and .tiles may be larger than memory
//! linkwork terrain resample crater.tif fine.tiles --to-spacing 0.1
//! linkwork terrain crop crater.tif rim.tif --within 120,80,220,180
//! linkwork terrain merge west.tif east.tif --out both.tif
//! linkwork terrain make yard.tif --set size=[50,50] --set rock_cover=0.1 --set crater_age_gyr=3
//! ```
//! * If a map is in degrees, its node spacing in metres is computed from the ellipsoid that the file states, at the latitude of the middle of the map. A map is rejected if that spacing is wrong by more than 1 % at its northern or southern edge. Linkwork treats maps in metres like this if their projection stretches distances: Web Mercator, Mercator, and simple cylindrical maps of planets (GeoTIFF, PDS labels, `.prj` files). Rotated maps and files with several bands or colours are rejected as well.
//! * Generated terrain contains its rocks in the heights; a file of it has no list of rocks. `make` holds the whole map in memory; use `resample` for
//!   a larger map.
//! * A tiled terrain keeps 256 tiles in memory (`kept`), about 70 MB; the number does not affect results. Bodies with colliders, cameras and lidars
//!   need all heights at once: they use the `region` of the terrain, and return an error without it. A tile that is damaged or cannot be read stops
//!   the run with a message that contains its position.
//! * The ground ends where a map has no data, and at its edge: wheels and bodies fall there, and `place` returns an error.
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
