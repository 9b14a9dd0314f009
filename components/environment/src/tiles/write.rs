//! Writes a file of tiles, a band of them at a time, so that memory is taken for a band and not for the map.

use super::head::{Head, Piece, pack};
use super::{OVERVIEW, TileError};
use crate::height_field::HeightField;
use linkwork_collision::relief::Lattice;
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

/// A map whose rows are read one by one, the southern row first.
pub trait HeightRows {
    /// Returns the grid of its nodes.
    fn grid(&self) -> Lattice;
    /// Height above which heights are given (m).
    fn datum(&self) -> f64 {
        0.0
    }
    /// Writes the heights above the datum (m) of row `j` to `row`, which has the length of one row; NaN: no data.
    ///
    /// # Errors
    /// The reason for which the row cannot be read.
    fn row(&mut self, j: usize, row: &mut [f32]) -> Result<(), TileError>;
}

impl HeightRows for &HeightField {
    fn grid(&self) -> Lattice {
        *HeightField::grid(self)
    }

    fn datum(&self) -> f64 {
        HeightField::datum(self)
    }

    fn row(&mut self, j: usize, row: &mut [f32]) -> Result<(), TileError> {
        let nx = self.size()[0];
        row.copy_from_slice(&self.heights()[j * nx..(j + 1) * nx]);
        Ok(())
    }
}

/// Writes a map as tiles with edges of `tile` cells; the file appears when it is whole.
///
/// # Errors
/// A row cannot be read, a height is infinite, the file cannot be written, or there are more tiles than an index can hold.
pub fn write_tiles(path: &Path, rows: &mut dyn HeightRows, tile: usize) -> Result<(), TileError> {
    let mut name = path.as_os_str().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = Path::new(&name);
    let written = write_to(part, rows, tile)
        .and_then(|()| std::fs::rename(part, path).map_err(TileError::system("writing")));
    if written.is_err() {
        // The incomplete file is useless. If it cannot be removed, report the first error only.
        let _ = std::fs::remove_file(part);
    }
    written
}

/// Output file of the writer, with the current position.
struct Out {
    file: BufWriter<File>,
    at: u64,
}

impl Out {
    fn put(&mut self, heights: &[f32]) -> Result<Piece, TileError> {
        let packed = pack(heights).map_err(TileError::system("packing"))?;
        self.file.write_all(&packed).map_err(TileError::system("writing"))?;
        let start = self.at;
        self.at += packed.len() as u64;
        Ok(Piece { start, length: packed.len() as u32, crc: crc32fast::hash(&packed) })
    }
}

fn write_to(path: &Path, rows: &mut dyn HeightRows, tile: usize) -> Result<(), TileError> {
    let mut head = Head { datum: rows.datum(), ..Head::new(rows.grid(), tile)? };
    let [nx, ny] = head.grid.size();
    let [across, up] = head.tiles();
    let file = File::create(path).map_err(TileError::system("writing"))?;
    let mut out = Out { file: BufWriter::new(file), at: 0 };
    let mut space = Vec::new();
    head.write(&mut space).map_err(TileError::system("writing"))?;
    out.file.write_all(&space).map_err(TileError::system("writing"))?;
    out.at = space.len() as u64;
    let overview_size = head.overview_size();
    debug_assert!(overview_size.iter().all(|n| *n <= OVERVIEW));
    let mut overview = Vec::with_capacity(overview_size[0] * overview_size[1]);
    // Rows of one band of tiles, and the number of the first of these rows.
    let (mut band, mut first): (Vec<f32>, usize) = (Vec::new(), 0);
    for down in 0..up {
        let wanted = head.nodes(down * across);
        // Keep the rows that this band shares with the previous one.
        let kept = (first + band.len() / nx).saturating_sub(wanted.j);
        band.drain(..band.len() - kept * nx);
        first = wanted.j;
        for j in wanted.j + kept..wanted.j + wanted.ny {
            let at = band.len();
            band.resize(at + nx, 0.0);
            rows.row(j, &mut band[at..])?;
            look(&mut head, j, &band[at..], &mut overview)?;
        }
        let mut heights = Vec::new();
        for k in down * across..(down + 1) * across {
            let nodes = head.nodes(k);
            heights.clear();
            for row in 0..nodes.ny {
                heights.extend_from_slice(&band[row * nx + nodes.i..][..nodes.nx]);
            }
            if heights.iter().any(|h| !h.is_nan()) {
                head.index[k] = out.put(&heights)?;
            }
        }
    }
    debug_assert_eq!(first + band.len() / nx, ny);
    head.overview = out.put(&overview)?;
    out.file.seek(SeekFrom::Start(0)).map_err(TileError::system("writing"))?;
    head.write(&mut out.file).map_err(TileError::system("writing"))?;
    let file = out.file.into_inner().map_err(|e| TileError::system("writing")(e.into_error()))?;
    file.sync_all().map_err(TileError::system("writing"))
}

/// Counts the heights of a row, and copies its nodes of the overview.
fn look(head: &mut Head, j: usize, row: &[f32], overview: &mut Vec<f32>) -> Result<(), TileError> {
    for (i, h) in row.iter().enumerate() {
        if h.is_infinite() {
            return Err(TileError::Size {
                fact: format!(
                    "the height in column {i}, row {j} (from the south-west) is infinite"
                ),
                help: "mark what has no data as NaN".into(),
            });
        }
        if h.is_nan() {
            head.missing += 1;
        } else {
            // `min` and `max` ignore the initial NaN.
            head.range = [head.range[0].min(*h), head.range[1].max(*h)];
        }
    }
    if j.is_multiple_of(head.step) {
        overview.extend(row.iter().step_by(head.step));
    }
    Ok(())
}
