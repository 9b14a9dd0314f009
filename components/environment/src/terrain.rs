//! Terrain services with their heights in memory: `environment.height_field`, `environment.flat`.

use crate::height_field::HeightField;
use crate::soil::SoilParams;
use crate::soil_map::{SoilMap, SoilPatch, SoilRaster};
use linkwork_formats::heights::{Heights, HeightsError, HeightsOptions, read_heights};
use linkwork_surroundings::prelude::*;
use std::path::Path;

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
    /// GeoTIFF (.tif, .tiff), ESRI ASCII grid (.asc), points on a grid (.xyz), grey PNG or BMP (.png, .bmp), PDS3 (.lbl, .img),
    /// PDS4 (.xml).
    pub file: String,
    /// Spacing of nodes along x and y, m, instead of the value in the file; required for PNG and BMP, and for maps in degrees whose file does not
    /// define an ellipsoid.
    #[param(default = None)]
    pub spacing: Option<[f64; 2]>,
    /// Heights of black and white of a PNG or BMP, m.
    #[param(default = [0.0, 1.0])]
    pub height_range: [f64; 2],
    /// Factor on the heights.
    #[param(default = 1.0)]
    pub exaggeration: f64,
    /// Moves the middle of the map to x = y = 0.
    #[param(default = true)]
    pub centred: bool,
    /// Moves the height at x = y = 0 (if there is data) to z = 0.
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

/// A grid of heights with its soils.
pub struct GridTerrain {
    pub(crate) field: HeightField,
    pub(crate) soils: SoilMap,
    pub(crate) rocks: Vec<Rock>,
}

impl GridTerrain {
    /// Returns its heights.
    pub fn field(&self) -> &HeightField {
        &self.field
    }
}

impl Terrain for GridTerrain {
    #[inline]
    fn ground(&self, x: f64, y: f64) -> Option<Ground> {
        self.field.ground(x, y).map(|(height, normal)| Ground { height, normal })
    }
    fn relief(&self, at: &[[f64; 2]], out: &mut [[f64; 3]]) {
        self.field.relief(at, out);
    }
    fn bounds(&self) -> [f64; 4] {
        self.field.bounds()
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
        surface(&self.field)
    }
    fn rocks(&self) -> Vec<Rock> {
        self.rocks.clone()
    }
}

/// Returns an error if a map whose heights are far from `datum` (m) is not levelled, because z would not have enough digits.
///
/// # Errors
/// It is not.
pub(crate) fn levelled(level: bool, datum: f64) -> Result<(), BuildError> {
    if level || datum == 0.0 {
        return Ok(());
    }
    let fact = format!(
        "the heights of the map are near {datum} m, where the resolution of 32-bit numbers is only {:.3} m",
        datum.abs() * f64::from(f32::EPSILON)
    );
    Err(BuildError::new(fact)
        .at("level")
        .help("remove `level: false`, so that z = 0 is the height of the map at x = y = 0"))
}

/// Reads the heights of a file, and of the file that it names; both become part of the plan's hash.
///
/// # Errors
/// The file does not exist or is rejected; the error names the parameter and the remedy.
pub fn heights_of(
    name: &str,
    options: &HeightsOptions,
    files: &Files,
) -> Result<Heights, BuildError> {
    let path = files.resolve(name)?;
    let fault = |e: &dyn std::fmt::Display| BuildError::of(&format!("`{name}`: {e}"));
    if name.to_lowercase().ends_with(".tiles") {
        let help = "write `model: \"environment.tiled_terrain\"`";
        return Err(fault(
            &"tiles are not loaded into memory as a whole, which this model requires",
        )
        .at("file")
        .help(help));
    }
    let bytes = linkwork_formats::whole_file(&path).map_err(|e| fault(&e).at("file"))?;
    let folder = Path::new(name).parent().unwrap_or(Path::new(""));
    let mut beside = |other: &str| {
        // A label may name a file in its own folder only, and no other path.
        if other.contains(['/', '\\']) || other == ".." {
            return Err("a label must name a file in its own folder".to_string());
        }
        let other = folder.join(other).display().to_string();
        files
            .find(&other)
            .and_then(|_| files.resolve(&other))
            .map_err(|e| e.message)
            .and_then(|path| linkwork_formats::whole_file(&path))
    };
    let file = path.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
    read_heights(&file, &bytes, options, &mut beside).map_err(|e| {
        let spacing = matches!(e, HeightsError::NoScale { .. } | HeightsError::Degrees { .. });
        fault(&e).at(if spacing { "spacing" } else { "file" })
    })
}

/// Ground from a digital elevation model or a grey image. Smooth between nodes.
#[service("environment.height_field", Terrain)]
impl Service for FileTerrain {
    type Params = HeightFieldParams;
    fn build(p: HeightFieldParams, files: &Files) -> Result<Self, BuildError> {
        let image = [".png", ".bmp"].iter().any(|end| p.file.to_lowercase().ends_with(end));
        if !image && p.height_range != HeightsOptions::default().range {
            let fact =
                format!("`{}` contains heights, but `height_range` is for PNG and BMP", p.file);
            let help = "remove `height_range`; `exaggeration` scales the heights";
            return Err(BuildError::new(fact).help(help).at("height_range"));
        }
        let options = HeightsOptions { spacing: p.spacing, range: p.height_range };
        let mut field = HeightField::of_file(heights_of(&p.file, &options, files)?)
            .map_err(|e| BuildError::of(&format!("`{}`: {e}", p.file)).at("file"))?;
        if p.centred {
            field = field.centred();
        }
        levelled(p.level, field.datum())?;
        let zero = match field.ground(0.0, 0.0) {
            Some((h, _)) if p.level => h,
            _ => 0.0,
        };
        field.map(|_, _, h| (h - zero) * p.exaggeration);
        let soils =
            SoilMap::new(p.soil.as_ref(), p.soil_map.as_ref(), &p.soils, field.bounds(), files)?;
        Ok(FileTerrain(GridTerrain { field, soils, rocks: vec![] }))
    }
}

/// A terrain read from a file.
pub struct FileTerrain(GridTerrain);

impl Terrain for FileTerrain {
    #[inline]
    fn ground(&self, x: f64, y: f64) -> Option<Ground> {
        self.0.ground(x, y)
    }
    fn relief(&self, at: &[[f64; 2]], out: &mut [[f64; 3]]) {
        self.0.relief(at, out);
    }
    fn bounds(&self) -> [f64; 4] {
        self.0.bounds()
    }
    fn soil(&self, x: f64, y: f64) -> &Soil {
        self.0.soil(x, y)
    }
    fn soils(&self) -> Vec<Soil> {
        self.0.soils()
    }
    fn has_soil(&self) -> bool {
        self.0.has_soil()
    }
    fn surface(&self) -> Surface {
        self.0.surface()
    }
}

/// A plane.
#[derive(Params, Clone, Debug)]
pub struct FlatParams {
    /// Slope.
    #[param(unit = "rad", default = 0.0, range = 0.0..1.5)]
    pub slope: f64,
    /// Uphill direction, from x towards y.
    #[param(unit = "rad", default = 0.0, needs = "slope")]
    pub uphill: f64,
    /// Side of the square map, centred on the origin.
    #[param(unit = "m", default = 1000.0, range = 1e-3..)]
    pub size: f64,
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

/// A plane through the origin.
pub struct Flat {
    gradient: [f64; 2],
    normal: Vec3,
    half: f64,
    soils: SoilMap,
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
    fn build(p: FlatParams, files: &Files) -> Result<Self, BuildError> {
        let (sin, cos) = p.uphill.sin_cos();
        let gradient = [p.slope.tan() * cos, p.slope.tan() * sin];
        let normal = Vec3::new(-gradient[0], -gradient[1], 1.0).normalize();
        let half = 0.5 * p.size;
        let bounds = [-half, -half, half, half];
        let soils = SoilMap::new(p.soil.as_ref(), p.soil_map.as_ref(), &p.soils, bounds, files)?;
        Ok(Flat { gradient, normal, half, soils })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slope_rises_where_it_says() {
        let p = FlatParams {
            slope: 0.3,
            uphill: std::f64::consts::FRAC_PI_2,
            size: 100.0,
            soil: None,
            soils: vec![],
            soil_map: None,
        };
        let t = Flat::build(p, &Files::default()).unwrap();
        let g = t.ground(3.0, 2.0).unwrap();
        assert!((g.height - 2.0 * 0.3f64.tan()).abs() < 1e-12);
        assert!((g.normal - Vec3::new(0.0, -0.3f64.sin(), 0.3f64.cos())).norm() < 1e-12);
        assert!(t.ground(51.0, 0.0).is_none());
    }

    fn params(file: &str) -> HeightFieldParams {
        HeightFieldParams {
            file: file.into(),
            spacing: None,
            height_range: [0.0, 1.0],
            exaggeration: 1.0,
            centred: true,
            level: true,
            soil: None,
            soils: vec![],
            soil_map: None,
        }
    }

    #[test]
    fn a_missing_or_strange_file_is_refused_with_a_remedy() {
        let e = FileTerrain::build(params("nowhere.tif"), &Files::default()).err().unwrap();
        assert!(e.message.contains("nowhere.tif"));
        let folder = tempfile::tempdir().unwrap();
        let files = Files::of(vec![folder.path().into()]);
        let refused = |name: &str, text: &str| {
            std::fs::write(folder.path().join(name), text).unwrap();
            FileTerrain::build(params(name), &files).err().unwrap()
        };
        let e = refused("a.tiles", "");
        assert!(e.help.unwrap().contains("environment.tiled_terrain"));
        let e = refused("a.ply", "");
        assert!(e.message.contains("`a.ply`") && e.help.unwrap().contains(".asc"));
        let e = refused("a.asc", "ncols 2\nnrows 2\n1 2\n3 4\n");
        assert!(e.param.as_deref() == Some("spacing"), "{e:?}");
        let label = "^IMAGE = \"../../etc/passwd\"\nOBJECT = IMAGE\nEND_OBJECT\nEND\n";
        let e = refused("a.lbl", label);
        assert!(e.message.contains("in its own folder"), "{e:?}");
    }

    /// The data of a label are part of the plan's hash, and so is the `.prj` of a grid.
    #[test]
    fn files_beside_a_file_are_known_by_their_content() {
        let folder = tempfile::tempdir().unwrap();
        let maps = folder.path().join("maps");
        std::fs::create_dir(&maps).unwrap();
        let label = "^IMAGE = \"A.DAT\"\nOBJECT = IMAGE\nLINES = 2\nLINE_SAMPLES = 3\nSAMPLE_TYPE = \
                     UNSIGNED_INTEGER\nSAMPLE_BITS = 8\nEND_OBJECT\nMAP_SCALE = 2 <M/PIXEL>\nEND\n";
        std::fs::write(maps.join("a.lbl"), label).unwrap();
        std::fs::write(maps.join("a.dat"), [1, 2, 3, 4, 5, 6]).unwrap();
        let build = || {
            let files = Files::of(vec![folder.path().into()]);
            let p = HeightFieldParams { level: false, ..params("maps/a.lbl") };
            let t = FileTerrain::build(p, &files).unwrap();
            (t.ground(0.0, 0.0).unwrap().height, files.prints())
        };
        let (h, before) = build();
        assert_eq!(h, 3.5);
        let names: Vec<_> = before.keys().cloned().collect();
        assert_eq!(names, ["maps/a.dat", "maps/a.lbl"]);
        std::fs::write(maps.join("a.dat"), [1, 2, 3, 4, 5, 7]).unwrap();
        let (_, after) = build();
        assert_ne!(before["maps/a.dat"], after["maps/a.dat"]);
        assert_eq!(before["maps/a.lbl"], after["maps/a.lbl"]);
    }

    #[test]
    fn a_file_becomes_a_level_centred_terrain() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference/terrain");
        let files = Files::of(vec![folder.into()]);
        if files.find("gzcommon_dem_moon.tif").is_err() {
            assert!(std::env::var_os("CI").is_none(), "reference data are missing");
            println!("SKIPPED: no reference file gzcommon_dem_moon.tif");
            return;
        }
        let t = FileTerrain::build(params("gzcommon_dem_moon.tif"), &files).unwrap();
        assert!(t.ground(0.0, 0.0).unwrap().height.abs() < 1e-5);
        assert!((t.bounds()[2] - 16.0 * 2.4266).abs() < 0.01);
        let e = FileTerrain::build(params("gzcommon_grayscale_16bit.png"), &files).err().unwrap();
        assert!(e.help.unwrap().contains("spacing"));
    }
}
