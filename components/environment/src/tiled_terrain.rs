//! `environment.tiled_terrain`: ground of any size from a file of tiles, which are read when they are needed.

use crate::soil::SoilParams;
use crate::soil_map::{SoilMap, SoilPatch, SoilRaster};
use crate::terrain::levelled;
use crate::tiles::{TileError, Tiles};
use linkwork_surroundings::prelude::*;

/// A map in tiles.
#[derive(Params, Clone, Debug)]
pub struct TiledParams {
    /// File of tiles (.tiles), as `linkwork terrain convert` makes it.
    pub file: String,
    /// Number of tiles that are kept in memory; a tile of the default size takes 268 kB. More tiles make a run faster and do not change its results.
    #[param(default = 256, range = 1.0..=65536.0)]
    pub kept: u32,
    /// x_min, y_min, x_max, y_max, m, of the region for bodies with colliders, cameras and lidars; it is kept in memory completely. Wheels and radars
    /// do not need it.
    #[param(default = None)]
    pub region: Option<[f64; 4]>,
    /// Factor on the heights.
    #[param(default = 1.0)]
    pub exaggeration: f64,
    /// Moves the middle of the map to x = y = 0.
    #[param(default = true)]
    pub centred: bool,
    /// Moves the height at x = y = 0 (when there is data) to z = 0.
    #[param(default = true)]
    pub level: bool,
    /// The soil everywhere; what computes with the soil or its friction needs it.
    #[param(default = None)]
    pub soil: Option<SoilParams>,
    /// Polygons of other soils, each over those before it.
    #[param(default = vec![])]
    pub soils: Vec<SoilPatch>,
    /// A raster of other soils, under the polygons.
    #[param(default = None)]
    pub soil_map: Option<SoilRaster>,
}

/// Most nodes of a region.
const REGION_MAX: usize = 16_000_000;

/// A map whose tiles are read when they are queried.
pub struct TiledTerrain {
    tiles: Tiles,
    overview: Surface,
    region: Option<Surface>,
    soils: SoilMap,
    file: String,
}

fn told(file: &str, e: &TileError) -> BuildError {
    BuildError::of(&format!("`{file}`: {e}"))
}

/// Ground of any size from a file of tiles: tiles are read when they are needed, and a limited number of them is kept.
/// Smooth between nodes. Reading allocates memory within a step; the choice of kept tiles does not change results. A tile that is damaged or cannot
/// be read stops the run; the error names its position.
#[service("environment.tiled_terrain", Terrain)]
impl Service for TiledTerrain {
    type Params = TiledParams;
    fn build(p: TiledParams, files: &Files) -> Result<Self, BuildError> {
        let path = files.resolve(&p.file)?;
        let fault = |e: TileError| told(&p.file, &e).at("file");
        if !p.exaggeration.is_finite() {
            return Err(
                BuildError::new("the factor on the heights is not finite").at("exaggeration")
            );
        }
        let mut tiles = Tiles::open(&path, p.kept as usize).map_err(fault)?;
        levelled(p.level, tiles.datum())?;
        if p.centred {
            tiles = tiles.centred();
        }
        let zero = if p.level { tiles.ground(0.0, 0.0).map_or(0.0, |g| g.0) } else { 0.0 };
        if let Some(e) = tiles.failure() {
            return Err(fault(e.clone()));
        }
        let tiles = tiles.scaled(zero, p.exaggeration);
        let (_, overview) = tiles.overview().map_err(fault)?;
        let region = p.region.map(|region| tiles.region(region, REGION_MAX)).transpose();
        let region = region.map_err(|e| told(&p.file, &e).at("region"))?;
        let bounds = tiles.grid().bounds();
        let soils = SoilMap::new(p.soil.as_ref(), p.soil_map.as_ref(), &p.soils, bounds, files)?;
        Ok(TiledTerrain { tiles, overview, region, soils, file: p.file })
    }
}

impl Terrain for TiledTerrain {
    #[inline]
    fn ground(&self, x: f64, y: f64) -> Option<Ground> {
        self.tiles.ground(x, y).map(|(height, normal)| Ground { height, normal })
    }
    fn relief(&self, at: &[[f64; 2]], out: &mut [[f64; 3]]) {
        for ([x, y], out) in at.iter().zip(out) {
            *out = self.tiles.relief(*x, *y);
        }
    }
    fn bounds(&self) -> [f64; 4] {
        self.tiles.grid().bounds()
    }
    fn soil(&self, x: f64, y: f64) -> &Soil {
        self.soils.at(x, y)
    }
    fn soils(&self) -> Vec<Soil> {
        self.soils.all().to_vec()
    }
    fn has_soil(&self) -> bool {
        self.soils.known()
    }
    fn surface(&self) -> Surface {
        self.overview.clone()
    }
    fn nodes(&self) -> Result<Surface, BuildError> {
        let [nx, ny] = self.tiles.grid().size();
        self.region.clone().ok_or_else(|| {
            BuildError::new(format!("the map of {nx} by {ny} nodes is not loaded as a whole, and `region` is not written"))
                .help("write `region: (x_min, y_min, x_max, y_max)` in the terrain: the part that colliders, cameras and lidars use")
        })
    }
    fn failure(&self, _: f64) -> Option<BuildError> {
        self.tiles.failure().map(|e| told(&self.file, e))
    }
}
