//! Distribution of soils: a soil of the whole ground, covered by a raster of soil numbers, covered by polygons.

use crate::soil::SoilParams;
use linkwork_formats::heights::{HeightsOptions, read_heights};
use linkwork_surroundings::prelude::*;

/// A polygon of one soil.
#[derive(Params, Clone, Debug)]
pub struct SoilPatch {
    /// Corners x, y in order, m; at least three.
    #[param(unit = "m")]
    pub outline: Vec<[f64; 2]>,
    /// The soil within.
    pub soil: SoilParams,
}

/// Meaning of the numbers of a raster.
#[derive(Params, Clone, Debug)]
pub struct SoilNumber {
    /// The number; for a grey image of 8 bits the grey value.
    pub number: u32,
    /// The soil.
    pub soil: SoilParams,
}

/// A raster of soils.
#[derive(Params, Clone, Debug)]
pub struct SoilRaster {
    /// A file of any format for heights: grey PNG or BMP, GeoTIFF, ASCII grid. Its samples are integers; nodes without data have the soil of the
    /// remaining ground.
    pub file: String,
    /// x_min, y_min, x_max, y_max of the image's edges, m; default: the bounds of the terrain.
    #[param(default = None)]
    pub bounds: Option<[f64; 4]>,
    /// Soil of each number.
    pub soils: Vec<SoilNumber>,
}

/// Index of the soil of the remaining ground.
const EVERYWHERE: u16 = 0;

/// Cells of a raster; each cell has one soil.
struct Cells {
    /// x_min, y_min (m), and the inverse of a cell's edges (1/m).
    corner: [f64; 2],
    inverse: [f64; 2],
    nx: usize,
    ny: usize,
    /// Indices in the list of soils, the southern row first.
    soils: Vec<u16>,
}

/// A polygon with its bounding box.
struct Patch {
    within: [f64; 4],
    outline: Vec<[f64; 2]>,
    soil: u16,
}

impl Patch {
    /// Returns whether a point is inside, by the even-odd rule.
    fn holds(&self, x: f64, y: f64) -> bool {
        let [x0, y0, x1, y1] = self.within;
        if !(x >= x0 && x <= x1 && y >= y0 && y <= y1) {
            return false;
        }
        let mut inside = false;
        let mut before = self.outline[self.outline.len() - 1];
        for &corner in &self.outline {
            let ([xa, ya], [xb, yb]) = (before, corner);
            if (ya > y) != (yb > y) && x < xa + (y - ya) / (yb - ya) * (xb - xa) {
                inside = !inside;
            }
            before = corner;
        }
        inside
    }
}

/// The soils of a terrain.
pub struct SoilMap {
    /// The first one is the soil of the remaining ground.
    soils: Vec<Soil>,
    cells: Option<Cells>,
    patches: Vec<Patch>,
}

impl SoilMap {
    /// Creates a map with the same soil everywhere.
    pub fn uniform(soil: Soil) -> SoilMap {
        SoilMap { soils: vec![soil], cells: None, patches: Vec::new() }
    }

    /// Returns all soils: first the one that is everywhere, then the soils of the raster and of the polygons.
    pub fn all(&self) -> &[Soil] {
        &self.soils
    }

    /// Returns whether a soil is specified.
    pub fn known(&self) -> bool {
        !self.soils[0].n.is_nan()
    }

    /// Creates the map of a terrain with these bounds (m): Creates the map: the soil `everywhere`, covered by a raster, covered by polygons; a later
    /// polygon covers earlier ones.
    ///
    /// # Errors
    /// A soil is invalid, a polygon has no area, or a raster cannot be read or has a number without a soil; the error names the parameter `soil`,
    /// `soils` or `soil_map`.
    pub fn new(
        everywhere: Option<&SoilParams>,
        raster: Option<&SoilRaster>,
        patches: &[SoilPatch],
        bounds: [f64; 4],
        files: &Files,
    ) -> Result<SoilMap, BuildError> {
        if everywhere.is_none() && (raster.is_some() || !patches.is_empty()) {
            let fact = "`soils` or `soil_map` is written, but `soil`, the soil of the remaining ground, is missing";
            return Err(BuildError::new(fact).help("add `soil: (kind: ..)`").at("soil"));
        }
        let soil = everywhere.map_or(Ok(Soil::UNKNOWN), SoilParams::soil)?;
        let mut map = SoilMap::uniform(soil);
        if let Some(raster) = raster {
            let cells = cells(raster, bounds, files, &mut map.soils)?;
            map.cells = Some(cells);
        }
        for (k, patch) in patches.iter().enumerate() {
            let at = |e: BuildError| e.at(format!("soils[{k}]"));
            let finite = patch.outline.iter().flatten().all(|x| x.is_finite());
            if patch.outline.len() < 3 || !finite {
                let fact = format!(
                    "an outline with {} corners does not enclose an area",
                    patch.outline.len()
                );
                return Err(at(
                    BuildError::new(fact).help("write at least three corners, x and y in m")
                ));
            }
            let soil = map.add(patch.soil.soil().map_err(at)?).map_err(at)?;
            let mut within = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
            for [x, y] in &patch.outline {
                within =
                    [within[0].min(*x), within[1].min(*y), within[2].max(*x), within[3].max(*y)];
            }
            map.patches.push(Patch { within, outline: patch.outline.clone(), soil });
        }
        Ok(map)
    }

    fn add(&mut self, soil: Soil) -> Result<u16, BuildError> {
        add(&mut self.soils, soil)
    }

    /// The soil at x, y (m). The cost is proportional to the number of polygons around the point.
    pub fn at(&self, x: f64, y: f64) -> &Soil {
        let patch = self.patches.iter().rev().find(|p| p.holds(x, y));
        let soil = match (patch, &self.cells) {
            (Some(patch), _) => patch.soil,
            (None, Some(cells)) => cells.at(x, y),
            (None, None) => EVERYWHERE,
        };
        &self.soils[usize::from(soil)]
    }
}

fn add(soils: &mut Vec<Soil>, soil: Soil) -> Result<u16, BuildError> {
    soils.push(soil);
    u16::try_from(soils.len() - 1).map_err(|_| {
        BuildError::new("a terrain can have at most 65 535 soils")
            .help("combine patches of the same soil into one outline")
    })
}

impl Cells {
    fn at(&self, x: f64, y: f64) -> u16 {
        let (u, v) =
            ((x - self.corner[0]) * self.inverse[0], (y - self.corner[1]) * self.inverse[1]);
        // Points on the northern and eastern edges are inside; NaN is outside.
        if !(u >= 0.0 && v >= 0.0 && u <= self.nx as f64 && v <= self.ny as f64) {
            return EVERYWHERE;
        }
        let (i, j) = ((u as usize).min(self.nx - 1), (v as usize).min(self.ny - 1));
        self.soils[j * self.nx + i]
    }
}

fn cells(
    raster: &SoilRaster,
    bounds: [f64; 4],
    files: &Files,
    soils: &mut Vec<Soil>,
) -> Result<Cells, BuildError> {
    let at = |e: BuildError| e.at("soil_map");
    let [x0, y0, x1, y1] = raster.bounds.unwrap_or(bounds);
    if !(x1 > x0 && y1 > y0 && [x0, y0, x1, y1].iter().all(|x| x.is_finite())) {
        let fact = format!("the bounds {:?} do not enclose an area", [x0, y0, x1, y1]);
        return Err(at(BuildError::new(fact).help("write x_min, y_min, x_max, y_max in m")));
    }
    let path = files.resolve(&raster.file).map_err(at)?;
    let fault = |e: String| at(BuildError::of(&format!("`{}`: {e}", raster.file)));
    let bytes = linkwork_formats::whole_file(&path).map_err(fault)?;
    // The bounds define the position, so use a spacing of 1. Grey values are soil numbers.
    let options = HeightsOptions { spacing: Some([1.0; 2]), range: [0.0, 255.0] };
    let none = &mut |_: &str| {
        Err("a soil raster must be one file, but this one refers to another".to_string())
    };
    let read =
        read_heights(&raster.file, &bytes, &options, none).map_err(|e| fault(e.to_string()))?;
    let mut places = std::collections::BTreeMap::new();
    for (k, one) in raster.soils.iter().enumerate() {
        let soil = one.soil.soil().map_err(|e| e.at(format!("soil_map.soils[{k}]")))?;
        let place = add(soils, soil).map_err(at)?;
        if places.insert(one.number, place).is_some() {
            let fact = format!("soil number {} is defined twice", one.number);
            return Err(at(BuildError::new(fact).help("define one soil for each number")));
        }
    }
    let mut of_cells = Vec::with_capacity(read.heights.len());
    for (k, value) in read.heights.iter().enumerate() {
        if value.is_nan() {
            of_cells.push(EVERYWHERE);
            continue;
        }
        let number = value.round();
        let known = places.get(&(number as u32)).filter(|_| (value - number).abs() < 1e-3);
        of_cells.push(*known.ok_or_else(|| {
            let (i, row) = (k % read.nx, read.ny - 1 - k / read.nx);
            let fact = format!(
                "`{}` has {value} in column {i}, row {row}, but no soil is defined for this number",
                raster.file
            );
            let known: Vec<String> = places.keys().map(u32::to_string).collect();
            at(BuildError::new(fact).help(format!("numbers with a soil: {}", known.join(", "))))
        })?);
    }
    let (nx, ny) = (read.nx, read.ny);
    let inverse = [nx as f64 / (x1 - x0), ny as f64 / (y1 - y0)];
    Ok(Cells { corner: [x0, y0], inverse, nx, ny, soils: of_cells })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::soil::{SoilKind, published};

    fn of(kind: SoilKind) -> SoilParams {
        SoilParams::of(kind)
    }

    fn files() -> (tempfile::TempDir, Files) {
        let folder = tempfile::tempdir().unwrap();
        // The raster has three columns and two rows, with the northern row first and no data in the
        // south-east.
        let grid = "ncols 3\nnrows 2\nNODATA_value -1\n1 2 2\n7 7 -1\n";
        std::fs::write(folder.path().join("soils.asc"), grid).unwrap();
        let files = Files::of(vec![folder.path().into()]);
        (folder, files)
    }

    fn raster() -> SoilRaster {
        let number = |number, kind| SoilNumber { number, soil: of(kind) };
        SoilRaster {
            file: "soils.asc".into(),
            bounds: None,
            soils: vec![
                number(1, SoilKind::DrySand),
                number(2, SoilKind::Snow),
                number(7, SoilKind::ClayeySoil),
            ],
        }
    }

    #[test]
    fn polygons_lie_on_the_raster_and_that_on_what_is_everywhere() {
        let (_folder, files) = files();
        let patches = [
            SoilPatch {
                outline: vec![[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]],
                soil: of(SoilKind::LeteSand),
            },
            // This polygon is not convex: it has a notch from the east.
            SoilPatch {
                outline: vec![[4.0, 1.0], [8.0, 1.0], [5.0, 2.0], [8.0, 3.0], [4.0, 3.0]],
                soil: of(SoilKind::MarsDrift),
            },
        ];
        let bounds = [-15.0, -10.0, 15.0, 10.0];
        let map =
            SoilMap::new(Some(&of(SoilKind::Lunar)), Some(&raster()), &patches, bounds, &files)
                .unwrap();
        for (x, y, kind) in [
            (-12.0, 5.0, SoilKind::DrySand),
            (0.0, 9.0, SoilKind::Snow),
            (15.0, 10.0, SoilKind::Snow),
            (-4.0, -3.0, SoilKind::ClayeySoil),
            (12.0, -3.0, SoilKind::Lunar),
            (16.0, 0.0, SoilKind::Lunar),
            (f64::NAN, 0.0, SoilKind::Lunar),
            (9.0, 1.0, SoilKind::LeteSand),
            (1.0, 9.0, SoilKind::Snow),
            (4.5, 2.0, SoilKind::MarsDrift),
            (7.0, 2.0, SoilKind::LeteSand),
        ] {
            assert_eq!(*map.at(x, y), published(kind), "{x} {y} {kind:?}");
        }
        assert_eq!(files.names(), ["soils.asc"], "it is part of the plan's hash");
    }

    /// The fraction of points inside agrees with the area by the shoelace formula.
    #[test]
    fn a_polygon_has_its_area() {
        let outline = vec![[0.5, 0.2], [9.1, 1.3], [5.0, 4.0], [9.7, 9.4], [3.3, 8.8], [1.0, 5.0]];
        let around = outline.iter().skip(1).chain(&outline[..1]);
        let area: f64 =
            outline.iter().zip(around).map(|(a, b)| 0.5 * (a[0] * b[1] - b[0] * a[1])).sum();
        let patch = SoilPatch { outline, soil: of(SoilKind::Snow) };
        let map =
            SoilMap::new(Some(&of(SoilKind::Lunar)), None, &[patch], [0.0; 4], &Files::default())
                .unwrap();
        let n = 400;
        let inside = (0..n * n).filter(|k| {
            let (x, y) = ((f64::from(k % n) + 0.5) / 40.0, (f64::from(k / n) + 0.5) / 40.0);
            *map.at(x, y) == published(SoilKind::Snow)
        });
        let got = inside.count() as f64 / 1600.0;
        assert!((got - area).abs() < 0.003 * area, "{got} {area}");
    }

    #[test]
    fn what_is_no_map_is_refused_with_its_place() {
        let (_folder, files) = files();
        let new = |raster: Option<SoilRaster>, patches: &[SoilPatch]| {
            SoilMap::new(
                Some(&of(SoilKind::Lunar)),
                raster.as_ref(),
                patches,
                [0.0, 0.0, 1.0, 1.0],
                &files,
            )
        };
        let refused = |r: Result<SoilMap, BuildError>| r.err().unwrap();
        let line = SoilPatch { outline: vec![[0.0, 0.0], [1.0, 0.0]], soil: of(SoilKind::Snow) };
        let e = refused(new(None, &[line]));
        assert!(e.message.contains("2 corners") && e.param.as_deref() == Some("soils[0]"), "{e:?}");
        let bad = SoilParams { k_phi: Some(-1.0), ..SoilParams::of(SoilKind::Lunar) };
        let patch = SoilPatch { outline: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], soil: bad };
        let e = refused(new(None, &[patch]));
        assert!(e.message.contains("k_phi = -1 is not possible for a soil"), "{e:?}");
        let mut less = raster();
        less.soils.truncate(2);
        let e = refused(new(Some(less), &[]));
        assert!(e.message.contains("has 7 in column 0, row 1"), "{e:?}");
        assert!(e.help.unwrap().contains("1, 2"));
        let mut twice = raster();
        twice.soils[1].number = 1;
        assert!(refused(new(Some(twice), &[])).message.contains("is defined twice"));
        let lost = SoilRaster { file: "none.png".into(), ..raster() };
        assert!(refused(new(Some(lost), &[])).message.contains("none.png"));
        let flat = SoilRaster { bounds: Some([0.0, 0.0, 0.0, 1.0]), ..raster() };
        assert!(refused(new(Some(flat), &[])).message.contains("do not enclose an area"));
    }
}
