//! The terrain services: `environment.height_field`, `environment.generated_terrain`, `environment.flat`.

use crate::dem;
use crate::generator::{self, Recipe};
use crate::height_field::HeightField;
use crate::soil::SoilParams;
use linkwork_runtime::prelude::*;

fn surface(field: &HeightField) -> Surface {
    let [nx, ny] = field.size();
    Surface {
        origin: field.origin(),
        spacing: field.spacing(),
        nx,
        ny,
        heights: field.heights().to_vec(),
    }
}

/// A height map from a file.
#[derive(Params, Clone, Debug)]
pub struct HeightFieldParams {
    /// GeoTIFF (.tif, .tiff) or PNG (.png).
    pub file: String,
    /// Distance of nodes along x and y, m; needed for PNG and for GeoTIFF in degrees.
    #[param(default = None)]
    pub spacing: Option<[f64; 2]>,
    /// Heights of black and white of a PNG, m.
    #[param(default = [0.0, 1.0])]
    pub height_range: [f64; 2],
    /// Factor on the heights.
    #[param(default = 1.0)]
    pub exaggeration: f64,
    /// Moves the middle of the map to x = y = 0.
    #[param(default = true)]
    pub centred: bool,
    /// Moves the height at x = y = 0 (when there is data) to z = 0.
    #[param(default = true)]
    pub level: bool,
    /// The soil everywhere.
    #[param(default = SoilParams::default())]
    pub soil: SoilParams,
}

/// A grid of heights with one soil.
pub struct GridTerrain {
    field: HeightField,
    soil: Soil,
    rocks: Vec<Rock>,
}

impl Terrain for GridTerrain {
    #[inline]
    fn ground(&self, x: f64, y: f64) -> Option<Ground> {
        self.field.ground(x, y).map(|(height, normal)| Ground { height, normal })
    }
    fn bounds(&self) -> [f64; 4] {
        self.field.bounds()
    }
    fn soil(&self, _: f64, _: f64) -> &Soil {
        &self.soil
    }
    fn surface(&self) -> Surface {
        surface(&self.field)
    }
    fn rocks(&self) -> Vec<Rock> {
        self.rocks.clone()
    }
}

/// Ground from a digital elevation model: GeoTIFF, or grey PNG of 8 or 16 bits. Smooth between nodes.
#[service("environment.height_field", Terrain)]
impl Service for FileTerrain {
    type Params = HeightFieldParams;
    fn build(p: HeightFieldParams, files: &Files) -> Result<Self, BuildError> {
        let path = files.resolve(&p.file)?;
        let fault = |e: String| BuildError::new(e).at("file");
        let bytes =
            linkwork_formats::whole_file(&path).map_err(|e| fault(format!("`{}`: {e}", p.file)))?;
        let kind = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase();
        let field = match kind.as_str() {
            "tif" | "tiff" => dem::geotiff(&bytes, p.spacing),
            "png" => {
                let spacing = p.spacing.ok_or_else(|| {
                    BuildError::new("a PNG has no scale")
                        .at("spacing")
                        .help("write `spacing: (0.1, 0.1)`: the distance of nodes in metres")
                })?;
                dem::png_heights(&bytes, p.height_range, spacing)
            }
            _ => {
                return Err(fault(format!("`{}` is neither .tif, .tiff nor .png", p.file)));
            }
        };
        let mut field = field.map_err(|e| fault(format!("`{}`: {e}", p.file)))?;
        if p.centred {
            field = field.centred();
        }
        let zero = match field.ground(0.0, 0.0) {
            Some((h, _)) if p.level => h,
            _ => 0.0,
        };
        field.map(|_, _, h| (h - zero) * p.exaggeration);
        Ok(FileTerrain(GridTerrain { field, soil: p.soil.soil()?, rocks: vec![] }))
    }
}

/// A terrain read from a file.
pub struct FileTerrain(GridTerrain);

impl Terrain for FileTerrain {
    #[inline]
    fn ground(&self, x: f64, y: f64) -> Option<Ground> {
        self.0.ground(x, y)
    }
    fn bounds(&self) -> [f64; 4] {
        self.0.bounds()
    }
    fn soil(&self, x: f64, y: f64) -> &Soil {
        self.0.soil(x, y)
    }
    fn surface(&self) -> Surface {
        self.0.surface()
    }
}

/// What to generate.
#[derive(Params, Clone, Debug)]
pub struct GeneratedParams {
    /// Seed: same seed, same world.
    #[param(default = 1)]
    pub seed: u64,
    /// Extent along x and y, centred on the origin, m.
    #[param(default = [100.0, 100.0])]
    pub size: [f64; 2],
    /// Distance of nodes.
    #[param(unit = "m", default = 0.1, range = 1e-3..)]
    pub spacing: f64,
    /// Slope of the mean plane along x and y, rise over run.
    #[param(default = [0.0, 0.0])]
    pub slope: [f64; 2],
    /// RMS of the fractal relief.
    #[param(unit = "m", default = 0.3, range = 0.0..)]
    pub relief: f64,
    /// Hurst exponent of the relief: 0 rough, 1 smooth.
    #[param(default = 0.85, range = 0.0..=1.0)]
    pub hurst: f64,
    /// Longest wavelength of the relief.
    #[param(unit = "m", default = 40.0, range = 1e-3..)]
    pub wavelength: f64,
    /// Number of craters.
    #[param(default = 0)]
    pub craters: u32,
    /// Smallest and largest crater diameter, m.
    #[param(default = [1.0, 10.0])]
    pub crater_diameters: [f64; 2],
    /// Fraction of the ground covered by rocks (Golombek's k).
    #[param(default = 0.0, range = 0.0..=0.5)]
    pub rock_cover: f64,
    /// Smallest and largest rock diameter, m.
    #[param(default = [0.1, 0.8])]
    pub rock_diameters: [f64; 2],
    /// Discs kept clear of rocks and craters: x, y and radius, m.
    #[param(default = vec![])]
    pub clear: Vec<[f64; 3]>,
    /// Moves the height at x = y = 0 to z = 0.
    #[param(default = true)]
    pub level: bool,
    /// The soil everywhere.
    #[param(default = SoilParams::default())]
    pub soil: SoilParams,
}

/// Most nodes of a generated map.
const NODES_MAX: f64 = 64e6;

/// Most craters of a generated map.
const CRATERS_MAX: u32 = 1_000_000;

/// Most rocks of a generated map.
const ROCKS_MAX: f64 = 5e6;

/// Ground made from a seed: fractal relief, craters with raised rims, rocks of Golombek's distribution.
#[service("environment.generated_terrain", Terrain)]
impl Service for GridTerrain {
    type Params = GeneratedParams;
    fn build(p: GeneratedParams, _: &Files) -> Result<Self, BuildError> {
        let nodes = p.size[0] / p.spacing * (p.size[1] / p.spacing);
        if nodes.is_nan() || nodes > NODES_MAX {
            return Err(BuildError::new(format!("{:.0} million nodes are too many", nodes / 1e6))
                .at("spacing")
                .help("make `spacing` larger or `size` smaller: 64 million nodes at most"));
        }
        if p.craters > CRATERS_MAX {
            return Err(BuildError::new(format!("{} craters are too many", p.craters))
                .at("craters")
                .help("a million at most"));
        }
        for (name, [low, high]) in
            [("crater_diameters", p.crater_diameters), ("rock_diameters", p.rock_diameters)]
        {
            if !(low > 0.0 && high > low) {
                return Err(
                    BuildError::new("the smaller diameter comes first, both positive").at(name)
                );
            }
        }
        let rocks = generator::rocks_wanted(p.rock_cover, p.rock_diameters, p.size);
        if !(rocks <= ROCKS_MAX) {
            return Err(BuildError::new(format!("{:.0} million rocks are too many", rocks / 1e6))
                .at("rock_diameters")
                .help("make the smallest diameter larger: 5 million rocks at most"));
        }
        let recipe = Recipe {
            seed: p.seed,
            size: p.size,
            spacing: p.spacing,
            slope: p.slope,
            relief: p.relief,
            hurst: p.hurst,
            wavelength: p.wavelength,
            craters: p.craters,
            crater_diameters: p.crater_diameters,
            rock_cover: p.rock_cover,
            rock_diameters: p.rock_diameters,
            clear: p.clear,
        };
        let (mut field, rocks) =
            generator::make(&recipe).map_err(|e| BuildError::new(e.to_string()).at("size"))?;
        if p.level
            && let Some((zero, _)) = field.ground(0.0, 0.0)
        {
            field.map(|_, _, h| h - zero);
        }
        let rocks = rocks
            .iter()
            .map(|r| Rock { x: r.x, y: r.y, diameter: r.diameter, height: r.height })
            .collect();
        Ok(GridTerrain { field, soil: p.soil.soil()?, rocks })
    }
}

/// A plane.
#[derive(Params, Clone, Debug)]
pub struct FlatParams {
    /// Slope.
    #[param(unit = "rad", default = 0.0, range = 0.0..1.5)]
    pub slope: f64,
    /// Direction that rises, from x towards y.
    #[param(unit = "rad", default = 0.0)]
    pub uphill: f64,
    /// Side of the square map, centred on the origin.
    #[param(unit = "m", default = 1000.0, range = 1e-3..)]
    pub size: f64,
    /// The soil everywhere.
    #[param(default = SoilParams::default())]
    pub soil: SoilParams,
}

/// A plane through the origin.
pub struct Flat {
    gradient: [f64; 2],
    normal: Vec3,
    half: f64,
    soil: Soil,
}

impl Terrain for Flat {
    #[inline]
    fn ground(&self, x: f64, y: f64) -> Option<Ground> {
        let inside = x.abs() <= self.half && y.abs() <= self.half;
        let height = self.gradient[0] * x + self.gradient[1] * y;
        inside.then_some(Ground { height, normal: self.normal })
    }
    fn bounds(&self) -> [f64; 4] {
        [-self.half, -self.half, self.half, self.half]
    }
    fn soil(&self, _: f64, _: f64) -> &Soil {
        &self.soil
    }
    fn surface(&self) -> Surface {
        let h = self.half;
        let height = |x: f64, y: f64| (self.gradient[0] * x + self.gradient[1] * y) as f32;
        Surface {
            origin: [-h, -h],
            spacing: [2.0 * h, 2.0 * h],
            nx: 2,
            ny: 2,
            heights: vec![height(-h, -h), height(h, -h), height(-h, h), height(h, h)],
        }
    }
}

/// A plane through the origin, level or sloped.
#[service("environment.flat", Terrain)]
impl Service for Flat {
    type Params = FlatParams;
    fn build(p: FlatParams, _: &Files) -> Result<Self, BuildError> {
        let (sin, cos) = p.uphill.sin_cos();
        let gradient = [p.slope.tan() * cos, p.slope.tan() * sin];
        let normal = Vec3::new(-gradient[0], -gradient[1], 1.0).normalize();
        Ok(Flat { gradient, normal, half: 0.5 * p.size, soil: p.soil.soil()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn generated() -> GeneratedParams {
        GeneratedParams {
            seed: 3,
            size: [20.0, 20.0],
            spacing: 0.1,
            slope: [0.0; 2],
            relief: 0.2,
            hurst: 0.8,
            wavelength: 10.0,
            craters: 2,
            crater_diameters: [1.0, 3.0],
            rock_cover: 0.05,
            rock_diameters: [0.2, 0.8],
            clear: vec![[0.0, 0.0, 3.0]],
            level: true,
            soil: SoilParams::default(),
        }
    }

    #[test]
    fn generated_ground_is_level_at_the_origin_and_shows_its_rocks() {
        let t = GridTerrain::build(generated(), &Files::default()).unwrap();
        assert!(t.ground(0.0, 0.0).unwrap().height.abs() < 1e-6);
        assert!(!t.rocks().is_empty());
        assert!(t.ground(11.0, 0.0).is_none());
        let s = t.surface();
        assert_eq!((s.nx, s.ny, s.heights.len()), (201, 201, 201 * 201));
        let big = GeneratedParams { spacing: 1e-3, size: [1000.0, 1000.0], ..generated() };
        let e = GridTerrain::build(big, &Files::default()).err().unwrap();
        assert_eq!(e.param.as_deref(), Some("spacing"));
    }

    #[test]
    fn a_slope_rises_where_it_says() {
        let p = FlatParams {
            slope: 0.3,
            uphill: std::f64::consts::FRAC_PI_2,
            size: 100.0,
            soil: SoilParams::default(),
        };
        let t = Flat::build(p, &Files::default()).unwrap();
        let g = t.ground(3.0, 2.0).unwrap();
        assert!((g.height - 2.0 * 0.3f64.tan()).abs() < 1e-12);
        assert!((g.normal - Vec3::new(0.0, -0.3f64.sin(), 0.3f64.cos())).norm() < 1e-12);
        assert!(t.ground(51.0, 0.0).is_none());
    }

    #[test]
    fn a_missing_or_strange_file_is_refused_with_a_remedy() {
        let p = HeightFieldParams {
            file: "nowhere.tif".into(),
            spacing: None,
            height_range: [0.0, 1.0],
            exaggeration: 1.0,
            centred: true,
            level: true,
            soil: SoilParams::default(),
        };
        let e = FileTerrain::build(p, &Files::default()).err().unwrap();
        assert!(e.message.contains("nowhere.tif"));
    }

    #[test]
    fn a_file_becomes_a_level_centred_terrain() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference/terrain");
        let files = Files::of(vec![folder.into()]);
        if files.resolve("gzcommon_dem_moon.tif").is_err() {
            println!("skipped: reference data absent");
            return;
        }
        let p = HeightFieldParams {
            file: "gzcommon_dem_moon.tif".into(),
            spacing: None,
            height_range: [0.0, 1.0],
            exaggeration: 1.0,
            centred: true,
            level: true,
            soil: SoilParams::default(),
        };
        let t = FileTerrain::build(p.clone(), &files).unwrap();
        assert!(t.ground(0.0, 0.0).unwrap().height.abs() < 1e-5);
        assert!((t.bounds()[2] - 16.0 * 2.4266).abs() < 0.01);
        let png = HeightFieldParams { file: "gzcommon_grayscale_16bit.png".into(), ..p };
        let e = FileTerrain::build(png, &files).err().unwrap();
        assert!(e.help.unwrap().contains("spacing"));
    }
}
