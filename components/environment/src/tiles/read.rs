//! Reader of tile files: returns heights and normals at any point, and reads tiles on demand.

use super::cache::Cache;
use super::head::{Head, Nodes, Piece, unpack};
use super::{HeightRows, TileError};
use crate::height_field::Window;
use linkwork_collision::relief::{Inside, Lattice};
use linkwork_spatial::Vec3;
use linkwork_surroundings::Surface;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

/// Open tile file. The results are bit-identical to a [`HeightField`](crate::height_field::HeightField) of the same heights, for any order of queries
/// and any size of the cache.
pub struct Tiles {
    head: Head,
    grid: Lattice,
    /// Offset subtracted from each height of the file, m, before multiplication by `factor`.
    zero: f64,
    factor: f64,
    inner: Mutex<Inner>,
    /// First read error since the file was opened.
    trouble: OnceLock<TileError>,
}

struct Inner {
    source: Source,
    cache: Cache,
}

/// The file, and buffers for compressed bytes and byte planes.
struct Source {
    file: File,
    length: u64,
    packed: Vec<u8>,
    planes: Vec<u8>,
}

impl std::fmt::Debug for Tiles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [nx, ny] = self.grid.size();
        write!(f, "Tiles({nx} by {ny})")
    }
}

impl Source {
    /// Reads the bytes of a piece into `packed` and verifies their checksum.
    fn piece(&mut self, piece: Piece) -> Result<(), TileError> {
        let length = u64::from(piece.length);
        if piece.start.checked_add(length).is_none_or(|end| end > self.length) {
            return Err(TileError::damaged("its bytes are beyond the end of the file"));
        }
        self.packed.clear();
        self.packed.resize(piece.length as usize, 0);
        self.file.seek(SeekFrom::Start(piece.start)).map_err(TileError::system("reading"))?;
        self.file.read_exact(&mut self.packed).map_err(TileError::system("reading"))?;
        match crc32fast::hash(&self.packed) == piece.crc {
            true => Ok(()),
            false => Err(TileError::damaged("its checksum is wrong")),
        }
    }

    /// Reads the heights of a piece with `nodes` nodes; NaN for an empty piece.
    fn heights(&mut self, piece: Piece, nodes: usize, to: &mut Vec<f32>) -> Result<(), TileError> {
        to.clear();
        to.resize(nodes, f32::NAN);
        if piece.length == 0 {
            return Ok(());
        }
        self.piece(piece)?;
        unpack(&self.packed, &mut self.planes, to)
    }
}

impl Tiles {
    /// Opens a file and reads its header and index; at most `most` tiles are kept in memory.
    ///
    /// # Errors
    /// The file cannot be read, is not a tile file, or its header or index is damaged.
    pub fn open(path: &Path, most: usize) -> Result<Tiles, TileError> {
        // Check before opening, because opening a named pipe would block until a writer appears.
        if !path.metadata().map_err(TileError::system("opening"))?.is_file() {
            return Err(TileError::System {
                what: "opening",
                why: "it is not a regular file".into(),
            });
        }
        let mut file = File::open(path).map_err(TileError::system("opening"))?;
        let length = file.metadata().map_err(TileError::system("opening"))?.len();
        let head = Head::read(&mut file, length)?;
        let cache = Cache::new(most, head.index.len());
        let source = Source { file, length, packed: Vec::new(), planes: Vec::new() };
        Ok(Tiles {
            grid: head.grid,
            head,
            zero: 0.0,
            factor: 1.0,
            inner: Mutex::new(Inner { source, cache }),
            trouble: OnceLock::new(),
        })
    }

    /// Returns the map shifted so that its centre is at x = y = 0.
    #[must_use]
    pub fn centred(mut self) -> Tiles {
        self.grid = self.grid.centred();
        self
    }

    /// Returns the map with `zero` (m) subtracted from each height, then multiplied by `factor`.
    #[must_use]
    pub fn scaled(mut self, zero: f64, factor: f64) -> Tiles {
        (self.zero, self.factor) = (zero, factor);
        self.inner().cache.clear();
        self
    }

    /// Returns the grid of the nodes.
    pub fn grid(&self) -> &Lattice {
        &self.grid
    }

    /// Returns the number of cells along the edge of a tile.
    pub fn tile(&self) -> usize {
        self.head.tile
    }

    /// Returns the datum (m) that the heights of the file are relative to.
    pub fn datum(&self) -> f64 {
        self.head.datum
    }

    /// Returns the least and the greatest height in the file, above its datum (m); NaN without data.
    pub fn range(&self) -> [f32; 2] {
        self.head.range
    }

    /// Returns the number of nodes without data.
    pub fn missing(&self) -> u64 {
        self.head.missing
    }

    /// Returns the number of tiles in memory.
    pub fn kept(&self) -> usize {
        self.inner().cache.len()
    }

    /// Returns the first error since the file was opened: a tile is damaged or cannot be read.
    pub fn failure(&self) -> Option<&TileError> {
        self.trouble.get()
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Applies offset and factor to a height of the file.
    fn told(&self, h: f32) -> f32 {
        ((f64::from(h) - self.zero) * self.factor) as f32
    }

    /// Calls `then` with the heights of a tile, which is read if it is not in the cache.
    fn with<T>(&self, tile: usize, then: impl FnOnce(Nodes, &[f32]) -> T) -> Result<T, TileError> {
        let nodes = self.head.nodes(tile);
        let mut inner = self.inner();
        let Inner { source, cache } = &mut *inner;
        let heights = cache.tile(tile, |to| {
            source.heights(self.head.index[tile], nodes.nx * nodes.ny, to)?;
            if self.zero != 0.0 || self.factor != 1.0 {
                to.iter_mut().for_each(|h| *h = self.told(*h));
            }
            Ok(())
        });
        heights.map(|heights| then(nodes, heights)).map_err(|e| self.at(tile, e))
    }

    /// Adds the position of the tile to an error.
    fn at(&self, tile: usize, e: TileError) -> TileError {
        let across = self.head.tiles()[0];
        let place = format!("tile {}, {} (from the south-west)", tile % across, tile / across);
        match e {
            TileError::Damaged { fact } => TileError::damaged(format!("{place}: {fact}")),
            TileError::System { what, why } => {
                TileError::System { what, why: format!("{place}: {why}") }
            }
            other => other,
        }
    }

    /// Returns height (m) and unit normal at x, y (m); `None` off the map, without data, and if the tile cannot be read, which [`Tiles::failure`]
    /// then reports. A tile that is not in memory is read, which may allocate.
    #[inline]
    pub fn ground(&self, x: f64, y: f64) -> Option<(f64, Vec3)> {
        self.look(x, y, None, |cell, nodes| {
            self.grid.surface(cell, |i, j| nodes.four(i, j), |i, j| nodes.one(i, j))
        })
    }

    /// Returns height (m), ∂h/∂x and ∂h/∂y at x, y (m); NaN where [`Tiles::ground`] returns `None`.
    #[inline]
    pub fn relief(&self, x: f64, y: f64) -> [f64; 3] {
        self.look(x, y, [f64::NAN; 3], |cell, nodes| {
            self.grid.relief(cell, |i, j| nodes.four(i, j), |i, j| nodes.one(i, j))
        })
    }

    /// Calls `then` with the cell at x, y (m) and its tile; returns `none` off the map and if the tile cannot be read.
    #[inline]
    fn look<R>(&self, x: f64, y: f64, none: R, then: impl FnOnce(Inside, Window<'_>) -> R) -> R {
        let Some(cell) = self.grid.cell(x, y) else { return none };
        let tile = self.head.tile_of(cell.i, cell.j);
        let answer = self.with(tile, |nodes, heights| {
            then(cell, Window { i: nodes.i, j: nodes.j, nx: nodes.nx, heights })
        });
        answer.unwrap_or_else(|e| {
            let _ = self.trouble.set(e);
            none
        })
    }

    /// Returns a coarse copy of the whole map for display, and its step: every step-th node is included.
    ///
    /// # Errors
    /// The overview is damaged.
    pub fn overview(&self) -> Result<(usize, Surface), TileError> {
        let [nx, ny] = self.head.overview_size();
        let mut heights = Vec::new();
        let read = self.inner().source.heights(self.head.overview, nx * ny, &mut heights);
        read.map_err(|e| match e {
            TileError::Damaged { fact } => TileError::damaged(format!("the overview: {fact}")),
            other => other,
        })?;
        heights.iter_mut().for_each(|h| *h = self.told(*h));
        let step = self.head.step;
        let spacing = self.grid.spacing().map(|s| s * step as f64);
        Ok((step, Surface { origin: self.grid.origin(), spacing, nx, ny, heights }))
    }

    /// Returns all nodes within x_min, y_min, x_max, y_max (m).
    ///
    /// # Errors
    /// The region is not on the map or has fewer than 2 by 2 or more than `most` nodes; a tile cannot be read.
    pub fn region(&self, [x0, y0, x1, y1]: [f64; 4], most: usize) -> Result<Surface, TileError> {
        let (origin, spacing, size) = (self.grid.origin(), self.grid.spacing(), self.grid.size());
        let size_fault = |fact: String, help: &str| TileError::Size { fact, help: help.into() };
        let span = |low: f64, high: f64, k: usize| {
            // The tolerance includes a node whose position is given as a bound, despite round-off.
            let at = |p: f64| (p - origin[k]) / spacing[k];
            let (a, b) = ((at(low) - 1e-6).ceil(), (at(high) + 1e-6).floor());
            (a >= 0.0 && b <= (size[k] - 1) as f64 && b >= a + 1.0)
                .then_some((a as usize, b as usize + 1))
        };
        let (Some((i0, i1)), Some((j0, j1))) = (span(x0, x1, 0), span(y0, y1, 1)) else {
            let fact = format!("the region {:?} is not on the map", [x0, y0, x1, y1]);
            let bounds = self.grid.bounds();
            let help = format!(
                "the map extends over {bounds:?} (x_min, y_min, x_max, y_max); the region must be at least two nodes wide"
            );
            return Err(size_fault(fact, &help));
        };
        let (nx, ny) = (i1 - i0, j1 - j0);
        if nx.saturating_mul(ny) > most {
            let fact = format!("the region has {nx} by {ny} nodes");
            return Err(size_fault(
                fact,
                &format!("at most {most} nodes are possible: make the region smaller"),
            ));
        }
        let mut heights = vec![0.0; nx * ny];
        for j in (j0 / self.head.tile)..=((j1 - 1) / self.head.tile) {
            for i in (i0 / self.head.tile)..=((i1 - 1) / self.head.tile) {
                let tiles = self.head.tiles();
                let tile = j.min(tiles[1] - 1) * tiles[0] + i.min(tiles[0] - 1);
                self.with(tile, |nodes, from| {
                    for row in nodes.j.max(j0)..(nodes.j + nodes.ny).min(j1) {
                        let (a, b) = (nodes.i.max(i0), (nodes.i + nodes.nx).min(i1));
                        let at = (row - nodes.j) * nodes.nx + a - nodes.i;
                        heights[(row - j0) * nx + a - i0..][..b - a]
                            .copy_from_slice(&from[at..at + b - a]);
                    }
                })?;
            }
        }
        let place = |k: usize, n: usize| origin[k] + n as f64 * spacing[k];
        Ok(Surface { origin: [place(0, i0), place(1, j0)], spacing, nx, ny, heights })
    }
}

impl HeightRows for &Tiles {
    fn grid(&self) -> Lattice {
        self.grid
    }

    fn datum(&self) -> f64 {
        self.head.datum
    }

    fn row(&mut self, j: usize, row: &mut [f32]) -> Result<(), TileError> {
        let tiles = self.head.tiles();
        let down = (j / self.head.tile).min(tiles[1] - 1);
        for across in 0..tiles[0] {
            self.with(down * tiles[0] + across, |nodes, from| {
                let at = (j - nodes.j) * nodes.nx;
                row[nodes.i..nodes.i + nodes.nx].copy_from_slice(&from[at..at + nodes.nx]);
            })?;
        }
        Ok(())
    }
}
