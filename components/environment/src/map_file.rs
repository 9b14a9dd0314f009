//! Height maps in files: reads maps of all formats row by row, and writes them.
//!
//! Tiles and GeoTIFF are read row by row, so that a map may be larger than memory; other formats are read into memory as a whole.

use crate::height_field::HeightField;
use crate::terrain::heights_of;
use crate::tiles::{HeightRows, TileError, Tiles, write_tiles};
use linkwork_collision::relief::Lattice;
use linkwork_formats::heights::{
    GeoTiff, HeightsOptions, Map, write_ascii, write_geotiff, write_png,
};
use linkwork_surroundings::prelude::*;
use std::fs::File;
use std::io::{BufReader, BufWriter, Seek, Write};
use std::path::Path;

/// Open map.
#[derive(Debug)]
pub enum OpenMap {
    /// All heights in memory.
    Whole(HeightField),
    /// Tile file, read on demand.
    Tiles(Box<Tiles>),
    /// GeoTIFF, read row by row on demand.
    Rows {
        /// The open file.
        open: Box<GeoTiff<BufReader<File>>>,
        /// Its nodes.
        grid: Lattice,
        /// Its name, for messages.
        name: String,
    },
}

fn ending(path: &Path) -> String {
    path.extension().map_or(String::new(), |e| e.to_string_lossy().to_lowercase())
}

/// Opens a map; the extension of the file selects the format: `.tiles`, or any format of `environment.height_field`.
///
/// # Errors
/// The file cannot be read or is not valid; the message contains the remedy.
pub fn open_map(path: &Path, options: &HeightsOptions) -> Result<OpenMap, BuildError> {
    let name = path.display().to_string();
    let fault = |e: &dyn std::fmt::Display| BuildError::of(&format!("`{name}`: {e}"));
    // Check before opening, because opening a named pipe would block until a writer appears.
    let there = path.metadata().map_err(|e| {
        fault(&e).help("name an existing map: .tif, .asc, .xyz, .png, .bmp, .lbl, .img, .xml, or a folder .tiles")
    })?;
    match ending(path).as_str() {
        "tiles" => {
            let tiles = Tiles::open(path, 1).map_err(|e| fault(&e))?;
            // A row crosses all tiles of a band, so two bands are kept in memory.
            let across = tiles.grid().size()[0].div_ceil(tiles.tile());
            Tiles::open(path, 2 * across + 2)
                .map(|t| OpenMap::Tiles(Box::new(t)))
                .map_err(|e| fault(&e))
        }
        "tif" | "tiff" => {
            if !there.is_file() {
                return Err(fault(&"it is not a regular file").help("name a file"));
            }
            let file = BufReader::new(File::open(path).map_err(|e| fault(&e))?);
            let open = GeoTiff::open(file, there.len(), options).map_err(|e| fault(&e))?;
            let [nx, ny] = open.size();
            let grid =
                Lattice::new(open.origin(), open.spacing(), nx, ny).map_err(|e| fault(&e))?;
            Ok(OpenMap::Rows { open: Box::new(open), grid, name })
        }
        _ => {
            let files = Files::of(vec![path.parent().unwrap_or(Path::new("")).into()]);
            let file = path.file_name().map_or(name.clone(), |n| n.to_string_lossy().into_owned());
            let read = heights_of(&file, options, &files)?;
            HeightField::of_file(read).map(OpenMap::Whole).map_err(|e| fault(&e))
        }
    }
}

impl HeightRows for OpenMap {
    fn grid(&self) -> Lattice {
        match self {
            OpenMap::Whole(field) => *field.grid(),
            OpenMap::Tiles(tiles) => *tiles.grid(),
            OpenMap::Rows { grid, .. } => *grid,
        }
    }

    fn datum(&self) -> f64 {
        match self {
            OpenMap::Whole(field) => field.datum(),
            OpenMap::Tiles(tiles) => tiles.datum(),
            OpenMap::Rows { open, .. } => open.datum(),
        }
    }

    fn row(&mut self, j: usize, row: &mut [f32]) -> Result<(), TileError> {
        match self {
            OpenMap::Whole(field) => (&*field).row(j, row),
            OpenMap::Tiles(tiles) => (&**tiles).row(j, row),
            OpenMap::Rows { open, name, .. } => {
                open.row(j, row).map_err(|e| TileError::Source(format!("`{name}`: {e}")))
            }
        }
    }
}

impl OpenMap {
    /// Returns a map with random access to heights. A GeoTIFF is read into memory for this, other maps are returned unchanged.
    ///
    /// # Errors
    /// A GeoTIFF has more than 64 million nodes.
    pub fn anywhere(self) -> Result<OpenMap, BuildError> {
        let OpenMap::Rows { open, name, .. } = self else { return Ok(self) };
        let told = |e: &dyn std::fmt::Display| BuildError::of(&format!("`{name}`: {e}"));
        let read = open.heights().map_err(|e| told(&e))?;
        HeightField::of_file(read).map(OpenMap::Whole).map_err(|e| told(&e))
    }

    fn height(&self, x: f64, y: f64) -> Result<Option<f64>, TileError> {
        match self {
            OpenMap::Whole(field) => Ok(field.ground(x, y).map(|g| g.0)),
            OpenMap::Tiles(tiles) => {
                let h = tiles.ground(x, y).map(|g| g.0);
                tiles.failure().map_or(Ok(h), |e| Err(e.clone()))
            }
            OpenMap::Rows { .. } => Err(TileError::Source("rows have an order".into())),
        }
    }
}

/// Map resampled to other nodes: interpolated, or averaged around each node where the new spacing is coarser.
pub struct Resampled {
    map: OpenMap,
    grid: Lattice,
    /// Number of samples along x and y for each node, and their distance (m).
    samples: [usize; 2],
    apart: [f64; 2],
}

/// Greatest number of samples per axis for one node.
const SAMPLES_MAX: usize = 64;

impl Resampled {
    /// Creates a map with the node distance `spacing` (m), which begins at the south-west node.
    ///
    /// # Errors
    /// The map has no random access ([`OpenMap::anywhere`]), or the spacing leaves no cell.
    pub fn new(map: OpenMap, spacing: [f64; 2]) -> Result<Resampled, BuildError> {
        let map = map.anywhere()?;
        let old = map.grid();
        // Check the spacing before it is used as a divisor.
        Lattice::new(old.origin(), spacing, 2, 2).map_err(|e| BuildError::of(&e))?;
        let [x0, y0, x1, y1] = old.bounds();
        // The tolerance keeps a last node that round-off would move outside.
        let count = |k: usize, length: f64| (length / spacing[k] * (1.0 + 1e-12)).floor() + 1.0;
        let (nx, ny) = (count(0, x1 - x0), count(1, y1 - y0));
        if !(nx.max(ny) <= f64::from(1_u32 << 31)) {
            let fact = format!("{nx:.0} by {ny:.0} nodes are too many");
            return Err(BuildError::new(fact)
                .help("increase the spacing: at most 2^31 nodes along an edge are possible"));
        }
        let (nx, ny) = (nx as usize, ny as usize);
        let grid = Lattice::new(old.origin(), spacing, nx, ny).map_err(|e| BuildError::of(&e))?;
        let ratio = |k: usize| (spacing[k] / old.spacing()[k] - 1e-9).ceil().max(1.0) as usize;
        let samples = [ratio(0).min(SAMPLES_MAX), ratio(1).min(SAMPLES_MAX)];
        let apart = [0, 1].map(|k| spacing[k] / samples[k] as f64);
        Ok(Resampled { map, grid, samples, apart })
    }

    fn node(&self, x: f64, y: f64) -> Result<f32, TileError> {
        let [x0, y0, x1, y1] = self.map.grid().bounds();
        let (mut sum, mut count) = (0.0, 0.0);
        let [mx, my] = self.samples;
        for b in 0..my {
            for a in 0..mx {
                let aside = |k: usize, n: usize, of: usize| {
                    (n as f64 - 0.5 * (of as f64 - 1.0)) * self.apart[k]
                };
                // Near an edge, average samples inside the map only.
                let (px, py) = (x + aside(0, a, mx), y + aside(1, b, my));
                let (px, py) = if mx == 1 && my == 1 { (px.min(x1), py.min(y1)) } else { (px, py) };
                if px < x0 || py < y0 || px > x1 || py > y1 {
                    continue;
                }
                match self.map.height(px, py)? {
                    Some(h) => (sum, count) = (sum + h, count + 1.0),
                    None => return Ok(f32::NAN),
                }
            }
        }
        Ok((sum / count) as f32)
    }
}

impl HeightRows for Resampled {
    fn grid(&self) -> Lattice {
        self.grid
    }

    fn datum(&self) -> f64 {
        self.map.datum()
    }

    fn row(&mut self, j: usize, row: &mut [f32]) -> Result<(), TileError> {
        let ([x0, y0], [sx, sy]) = (self.grid.origin(), self.grid.spacing());
        for (i, h) in row.iter_mut().enumerate() {
            *h = self.node(x0 + i as f64 * sx, y0 + j as f64 * sy)?;
        }
        Ok(())
    }
}

/// Formats that can be written, for messages.
pub const WRITTEN: &str = "GeoTIFF (.tif), ESRI ASCII grid (.asc), PNG (.png), tiles (.tiles)";

/// Writes a map in the format of the file's extension. The file appears only when it is complete. For a PNG, returns the heights of black and white
/// (m).
///
/// # Errors
/// The format is not supported, a row cannot be read, or the file cannot be written.
pub fn write_map(
    path: &Path,
    rows: &mut dyn HeightRows,
    tile: usize,
) -> Result<Option<[f32; 2]>, BuildError> {
    let name = path.display().to_string();
    let fault = |e: &dyn std::fmt::Display| BuildError::of(&format!("`{name}`: {e}"));
    // A fault of the map that is read names its own file.
    let tiles_fault = |e: TileError| match e {
        TileError::Source(_) => BuildError::of(&e),
        _ => fault(&e),
    };
    let write_fault = |e: std::io::Error| match e.downcast::<TileError>() {
        Ok(e) => tiles_fault(e),
        Err(e) => fault(&e),
    };
    match ending(path).as_str() {
        "tiles" => write_tiles(path, rows, tile).map(|()| None).map_err(tiles_fault),
        "tif" | "tiff" => whole(path, rows, write_geotiff).map(|()| None).map_err(write_fault),
        "asc" => whole(path, rows, write_ascii).map(|()| None).map_err(write_fault),
        "png" => {
            let [nx, ny] = rows.grid().size();
            if nx as u64 * ny as u64 > linkwork_formats::heights::NODES_MAX {
                let fact = format!("{nx} by {ny} nodes are too many for an image");
                return Err(fault(&fact).help("write a GeoTIFF or tiles, or resample it first"));
            }
            let survey = survey(rows, 2).map_err(tiles_fault)?;
            let range = survey.range;
            whole(path, rows, |out, map| write_png(out, map, range)).map_err(write_fault)?;
            Ok(Some(range))
        }
        _ => Err(fault(&"maps are not written in this format").help(format!("endings: {WRITTEN}"))),
    }
}

/// Writes to a temporary file in the same folder, then renames it.
fn whole(
    path: &Path,
    rows: &mut dyn HeightRows,
    write: impl FnOnce(&mut BufWriter<File>, &mut Map<'_>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let mut name = path.as_os_str().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = Path::new(&name);
    let (grid, datum) = (rows.grid(), rows.datum());
    let mut row = |j: usize, to: &mut [f32]| rows.row(j, to).map_err(std::io::Error::other);
    let (size, spacing, origin) = (grid.size(), grid.spacing(), grid.origin());
    let mut map = Map { size, spacing, origin, datum, row: &mut row };
    let written = File::create(part).and_then(|file| {
        let mut out = BufWriter::new(file);
        write(&mut out, &mut map)?;
        out.seek(std::io::SeekFrom::End(0))?;
        out.flush()?;
        out.get_ref().sync_all()?;
        std::fs::rename(part, path)
    });
    if written.is_err() {
        // Remove the incomplete file; the first error is returned, even if the removal fails, too.
        let _ = std::fs::remove_file(part);
    }
    written
}

/// Summary of a map.
#[derive(Clone, Debug)]
pub struct Survey {
    /// Datum of the heights (m).
    pub datum: f64,
    /// Least and greatest height above the datum (m); NaN without data.
    pub range: [f32; 2],
    /// Number of nodes without data.
    pub missing: u64,
    /// Coarse copy of the map for display.
    pub overview: Surface,
}

/// Reads all rows and returns a summary; `most` is the greatest number of nodes along an edge of the overview.
///
/// # Errors
/// A row cannot be read.
pub fn survey(rows: &mut dyn HeightRows, most: usize) -> Result<Survey, TileError> {
    let grid = rows.grid();
    let [nx, ny] = grid.size();
    let step = (nx.max(ny) - 1).div_ceil(most.max(2) - 1).max(1);
    let (mut range, mut missing, mut heights) = ([f32::NAN; 2], 0, Vec::new());
    let mut row = vec![0.0; nx];
    for j in 0..ny {
        rows.row(j, &mut row)?;
        for h in &row {
            missing += u64::from(h.is_nan());
            range = [range[0].min(*h), range[1].max(*h)];
        }
        if j.is_multiple_of(step) {
            heights.extend(row.iter().step_by(step));
        }
    }
    let (nx, ny) = ((nx - 1) / step + 1, (ny - 1) / step + 1);
    let spacing = grid.spacing().map(|s| s * step as f64);
    Ok(Survey {
        datum: rows.datum(),
        range,
        missing,
        overview: Surface { origin: grid.origin(), spacing, nx, ny, heights },
    })
}

impl OpenMap {
    /// Returns a summary of the map. A tile file contains it; for other formats all rows are read.
    ///
    /// # Errors
    /// A row cannot be read.
    pub fn survey(&mut self, most: usize) -> Result<Survey, TileError> {
        let OpenMap::Tiles(tiles) = self else { return survey(self, most) };
        let (_, overview) = tiles.overview()?;
        Ok(Survey {
            datum: tiles.datum(),
            range: tiles.range(),
            missing: tiles.missing(),
            overview,
        })
    }
}

/// Returns a hillshade with light from the north-west at 45° elevation: brightness 0 to 1 of each node, northern row first; NaN without data. Slopes
/// are exaggerated by the factor `steeper`.
pub fn hillshade(surface: &Surface, steeper: f64) -> Vec<f32> {
    let (nx, ny) = (surface.nx, surface.ny);
    let at = |i: usize, j: usize| f64::from(surface.heights[j * nx + i]);
    let light = [-0.5, 0.5, std::f64::consts::FRAC_1_SQRT_2];
    let mut out = Vec::with_capacity(nx * ny);
    for j in (0..ny).rev() {
        for i in 0..nx {
            let (west, east) = (i.saturating_sub(1), (i + 1).min(nx - 1));
            let (south, north) = (j.saturating_sub(1), (j + 1).min(ny - 1));
            let [sx, sy] = surface.spacing;
            let dx = steeper * (at(east, j) - at(west, j)) / ((east - west).max(1) as f64 * sx);
            let dy = steeper * (at(i, north) - at(i, south)) / ((north - south).max(1) as f64 * sy);
            let shade =
                (-dx * light[0] - dy * light[1] + light[2]) / (1.0 + dx * dx + dy * dy).sqrt();
            out.push(if at(i, j).is_nan() { f32::NAN } else { shade.max(0.0) as f32 });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field() -> HeightField {
        let (nx, ny) = (61, 41);
        let h = |k: usize| {
            let (i, j) = ((k % nx) as f32, (k / nx) as f32);
            if k == 700 { f32::NAN } else { 0.1 * i - 0.05 * j + (0.3 * i).sin() * (0.2 * j).cos() }
        };
        HeightField::new([2.0, -3.0], [0.5, 0.5], nx, ny, (0..nx * ny).map(h).collect()).unwrap()
    }

    #[test]
    fn a_map_goes_through_every_format_and_back() {
        let folder = tempfile::tempdir().unwrap();
        let field = field();
        let none = HeightsOptions::default();
        let mut before: OpenMap = OpenMap::Whole(field.clone());
        for name in ["a.tif", "b.tiles", "c.asc", "d.tiles"] {
            let path = folder.path().join(name);
            write_map(&path, &mut before, 16).unwrap();
            before = open_map(&path, &none).unwrap();
            assert_eq!(before.grid(), *field.grid(), "{name}");
        }
        let mut row = vec![0.0; 61];
        for j in 0..41 {
            before.row(j, &mut row).unwrap();
            let want = &field.heights()[j * 61..(j + 1) * 61];
            assert!(
                row.iter().zip(want).all(|(a, b)| a == b || (a.is_nan() && b.is_nan())),
                "row {j}"
            );
        }
        let path = folder.path().join("e.png");
        let range = write_map(&path, &mut before, 16).unwrap().unwrap();
        let grey = HeightsOptions { spacing: Some([0.5; 2]), range: range.map(f64::from) };
        let read = survey(&mut open_map(&path, &grey).unwrap(), 100).unwrap();
        assert_eq!((read.missing, read.range), (1, range));
        let e = write_map(&folder.path().join("f.bmp"), &mut before, 16).unwrap_err();
        assert!(e.help.unwrap().contains(".tiles"));
        let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
        assert_eq!(left.len(), 5, "nothing is left of what was not written");
    }

    #[test]
    fn finer_nodes_lie_on_the_smooth_surface_and_coarser_ones_are_means() {
        let field = field();
        let finer = Resampled::new(OpenMap::Whole(field.clone()), [0.2, 0.2]).unwrap();
        assert_eq!(finer.grid.size(), [151, 101]);
        let got = finer.node(2.0 + 0.2 * 33.0, -3.0 + 0.2 * 71.0).unwrap();
        let want = field.ground(2.0 + 0.2 * 33.0, -3.0 + 0.2 * 71.0).unwrap().0;
        assert_eq!(got, want as f32);
        // A wave whose length is the new spacing averages to zero.
        let nx = 241;
        let wave: Vec<f32> = (0..nx * nx)
            .map(|k| 3.0 + (std::f32::consts::TAU * (k % nx) as f32 / 8.0).sin())
            .collect();
        let wave = HeightField::new([0.0; 2], [0.25; 2], nx, nx, wave).unwrap();
        let coarser = Resampled::new(OpenMap::Whole(wave), [2.0, 2.0]).unwrap();
        assert_eq!(coarser.grid.size(), [31, 31]);
        for k in 1..30 {
            let h = coarser.node(2.0 * f64::from(k), 10.0).unwrap();
            assert!((h - 3.0).abs() < 1e-5, "{h}");
        }
        for spacing in [[0.0, 1.0], [f64::NAN, 1.0], [1.0, -1.0], [1e-9, 1.0], [100.0, 1.0]] {
            assert!(Resampled::new(OpenMap::Whole(field.clone()), spacing).is_err(), "{spacing:?}");
        }
    }

    #[test]
    fn a_slope_towards_the_light_is_brighter() {
        let surface = |dx: f32, dy: f32| Surface {
            origin: [0.0; 2],
            spacing: [1.0; 2],
            nx: 3,
            ny: 3,
            heights: (0..9).map(|k| dx * (k % 3) as f32 + dy * (k / 3) as f32).collect(),
        };
        let of = |dx: f32, dy: f32| hillshade(&surface(dx, dy), 1.0)[4];
        assert!((of(0.0, 0.0) - 0.5f32.sqrt()).abs() < 1e-6);
        // A slope perpendicular to the light has the greatest brightness.
        let square = 0.5f32.sqrt();
        assert!((of(square, -square) - 1.0).abs() < 1e-6);
        assert!(of(-square, square) < 1e-6 && of(0.2, 0.0) > of(-0.2, 0.0));
    }

    /// A map that cannot be read is named, and not the file to which it would be written.
    #[test]
    fn a_message_names_the_file_that_has_the_fault() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let heights: Vec<f32> = (0..64 * 64).map(|k| (k as f32 * 0.7).sin()).collect();
        let field = HeightField::new([0.0; 2], [1.0; 2], 64, 64, heights).unwrap();
        // GDAL writes the strips after the tags, and the southern strip last.
        let whole = "../../framework/formats/tests/data/heights/f32_strips_big_endian.tif";
        let bytes = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join(whole)).unwrap();
        std::fs::write(path("cut.tif"), &bytes[..bytes.len() - 100]).unwrap();
        for target in ["out.asc", "out.tif", "out.png", "out.tiles"] {
            let mut map = open_map(&path("cut.tif"), &HeightsOptions::default()).unwrap();
            let e = write_map(&path(target), &mut map, 16).unwrap_err();
            assert!(e.message.contains("cut.tif"), "{target}: {}", e.message);
            assert!(!e.message.contains(target), "{target}: {}", e.message);
        }
        let e = write_map(&path("none/out.tif"), &mut &field, 16).unwrap_err();
        assert!(e.message.contains("out.tif"), "{}", e.message);
    }
}
