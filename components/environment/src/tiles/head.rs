//! Head and index of a file of tiles, as bytes, and which nodes a tile has.

use super::{INDEX_END, TileError};
use linkwork_collision::relief::Lattice;
use std::io::{Read, Write};

const MAGIC: &[u8; 8] = b"LWTILES2";

/// Bytes of the head.
pub(super) const HEAD: u64 = 112;

/// Bytes of an entry of the index.
pub(super) const ENTRY: u64 = 16;

/// Position of a compressed block in the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Piece {
    /// Its first byte.
    pub start: u64,
    /// Length of the tile; 0: the tile is empty.
    pub length: u32,
    /// CRC-32 of its bytes.
    pub crc: u32,
}

/// Contents of the header of a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Head {
    pub grid: Lattice,
    /// Cells of a tile's edge.
    pub tile: usize,
    /// Number of nodes from one node of the overview to the next.
    pub step: usize,
    pub overview: Piece,
    /// Height above which heights are given (m).
    pub datum: f64,
    /// Least and greatest height above the datum (m); NaN without data.
    pub range: [f32; 2],
    /// Nodes without data.
    pub missing: u64,
    pub index: Vec<Piece>,
}

/// Nodes of a block: first column and row, and number of columns and rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Nodes {
    pub i: usize,
    pub j: usize,
    pub nx: usize,
    pub ny: usize,
}

impl Head {
    /// Creates the head of a grid without tiles.
    pub fn new(grid: Lattice, tile: usize) -> Result<Head, TileError> {
        let size = |fact: String, help: &str| TileError::Size { fact, help: help.into() };
        if !(16..=1024).contains(&tile) {
            let fact = format!("tiles of {tile} cells are not supported");
            return Err(size(fact, "the edge of a tile must have 16 to 1024 cells"));
        }
        let [nx, ny] = grid.size();
        if nx.max(ny) > 1 << 31 {
            return Err(size(
                format!("{nx} by {ny} nodes are too many"),
                "an edge can have at most 2^31 nodes",
            ));
        }
        let tiles = tiles_of(nx, tile) as u64 * tiles_of(ny, tile) as u64;
        if HEAD + ENTRY * tiles > INDEX_END {
            let fact = format!("{tiles} tiles are too many for an index");
            return Err(size(fact, "make their edges longer"));
        }
        Ok(Head {
            grid,
            tile,
            step: (nx.max(ny) - 1).div_ceil(super::OVERVIEW - 1).max(1),
            overview: Piece::default(),
            datum: 0.0,
            range: [f32::NAN; 2],
            missing: 0,
            index: vec![Piece::default(); tiles as usize],
        })
    }

    /// Tiles along x and y.
    pub fn tiles(&self) -> [usize; 2] {
        self.grid.size().map(|n| tiles_of(n, self.tile))
    }

    /// Returns the numbers of nodes of the overview along x and y.
    pub fn overview_size(&self) -> [usize; 2] {
        self.grid.size().map(|n| (n - 1) / self.step + 1)
    }

    /// Returns the nodes of tile `k`.
    pub fn nodes(&self, k: usize) -> Nodes {
        let across = self.tiles()[0];
        let [nx, ny] = self.grid.size();
        let span = |t: usize, n: usize| {
            let first = (t * self.tile).saturating_sub(1);
            (first, (t * self.tile + self.tile + 2).min(n) - first)
        };
        let ((i, wide), (j, high)) = (span(k % across, nx), span(k / across, ny));
        Nodes { i, j, nx: wide, ny: high }
    }

    /// The tile of a cell.
    pub fn tile_of(&self, i: usize, j: usize) -> usize {
        j / self.tile * self.tiles()[0] + i / self.tile
    }

    /// Writes head and index.
    pub fn write(&self, out: &mut impl Write) -> std::io::Result<()> {
        let mut index = Vec::with_capacity(self.index.len() * ENTRY as usize);
        for piece in &self.index {
            index.extend(piece.start.to_le_bytes());
            index.extend(piece.length.to_le_bytes());
            index.extend(piece.crc.to_le_bytes());
        }
        let mut head = MAGIC.to_vec();
        for n in self.grid.size() {
            head.extend((n as u64).to_le_bytes());
        }
        head.extend((self.tile as u32).to_le_bytes());
        head.extend((self.step as u32).to_le_bytes());
        for x in self.grid.spacing().into_iter().chain(self.grid.origin()) {
            head.extend(x.to_le_bytes());
        }
        head.extend(self.overview.start.to_le_bytes());
        head.extend(self.overview.length.to_le_bytes());
        head.extend(self.overview.crc.to_le_bytes());
        for h in self.range {
            head.extend(h.to_le_bytes());
        }
        head.extend(self.missing.to_le_bytes());
        head.extend(self.datum.to_le_bytes());
        head.extend(crc32fast::hash(&index).to_le_bytes());
        head.extend(crc32fast::hash(&head).to_le_bytes());
        out.write_all(&head)?;
        out.write_all(&index)
    }

    /// Reads head and index of a file of `length` bytes.
    pub fn read(file: &mut impl Read, length: u64) -> Result<Head, TileError> {
        let mut head = [0; HEAD as usize];
        let short = |_| TileError::damaged("it ends within its head");
        file.read_exact(&mut head).map_err(short)?;
        if &head[..8] == b"LWTILES1" {
            return Err(TileError::damaged(
                "it was written by an earlier version of Linkwork; write it again with `linkwork terrain convert`",
            ));
        }
        if &head[..8] != MAGIC {
            return Err(TileError::damaged("it does not begin with the signature of a tiles file"));
        }
        let last = HEAD as usize - 4;
        if crc32fast::hash(&head[..last]) != u32_at(&head, last) {
            return Err(TileError::damaged("the checksum of its head is wrong"));
        }
        let count = |at: usize| usize::try_from(u64_at(&head, at)).unwrap_or(usize::MAX);
        let number = |at: usize| f64::from_bits(u64_at(&head, at));
        let (spacing, origin) = ([number(32), number(40)], [number(48), number(56)]);
        let grid = Lattice::new(origin, spacing, count(8), count(16))
            .map_err(|e| TileError::damaged(e.to_string()))?;
        let mut read = Head::new(grid, u32_at(&head, 24) as usize)
            .map_err(|e| TileError::damaged(e.to_string()))?;
        if u32_at(&head, 28) as usize != read.step {
            return Err(TileError::damaged(
                "the step of its overview does not match the size of its grid",
            ));
        }
        let piece = |bytes: &[u8], at: usize| Piece {
            start: u64_at(bytes, at),
            length: u32_at(bytes, at + 8),
            crc: u32_at(bytes, at + 12),
        };
        read.overview = piece(&head, 64);
        read.range = [80, 84].map(|at| f32::from_bits(u32_at(&head, at)));
        read.missing = u64_at(&head, 88);
        read.datum = number(96);
        if !read.datum.is_finite() {
            return Err(TileError::damaged("its reference height is not finite"));
        }
        let bytes = ENTRY * read.index.len() as u64;
        if length < HEAD + bytes {
            return Err(TileError::damaged("it ends within its index"));
        }
        let mut index = vec![0; bytes as usize];
        file.read_exact(&mut index).map_err(|_| TileError::damaged("it ends within its index"))?;
        if crc32fast::hash(&index) != u32_at(&head, 104) {
            return Err(TileError::damaged("the checksum of its index is wrong"));
        }
        for (k, to) in read.index.iter_mut().enumerate() {
            *to = piece(&index, k * ENTRY as usize);
        }
        Ok(read)
    }
}

fn tiles_of(nodes: usize, tile: usize) -> usize {
    (nodes - 1).div_ceil(tile)
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    bytes[at..at + 4].try_into().map(u32::from_le_bytes).unwrap_or_default()
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    bytes[at..at + 8].try_into().map(u64::from_le_bytes).unwrap_or_default()
}

/// Heights as packed bytes.
pub(super) fn pack(heights: &[f32]) -> std::io::Result<Vec<u8>> {
    let mut planes = vec![0; 4 * heights.len()];
    for (k, h) in heights.iter().enumerate() {
        for (plane, byte) in h.to_le_bytes().into_iter().enumerate() {
            planes[plane * heights.len() + k] = byte;
        }
    }
    let mut out = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    out.write_all(&planes)?;
    out.finish()
}

/// Decompresses a block into exactly as many heights as `heights` has; `planes` is a buffer for their bytes.
pub(super) fn unpack(
    packed: &[u8],
    planes: &mut Vec<u8>,
    heights: &mut [f32],
) -> Result<(), TileError> {
    let n = heights.len();
    planes.clear();
    planes.resize(4 * n, 0);
    let mut from = flate2::read::ZlibDecoder::new(packed);
    let wrong = |_| TileError::damaged("its compressed data are invalid");
    from.read_exact(planes).map_err(wrong)?;
    if from.read(&mut [0]).map_err(wrong)? != 0 {
        return Err(TileError::damaged("its compressed data are longer than its nodes require"));
    }
    for (k, h) in heights.iter_mut().enumerate() {
        *h = f32::from_le_bytes([planes[k], planes[n + k], planes[2 * n + k], planes[3 * n + k]]);
        if h.is_infinite() {
            return Err(TileError::damaged("a height there is infinite"));
        }
    }
    Ok(())
}
