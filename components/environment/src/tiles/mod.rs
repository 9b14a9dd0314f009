//! Heights in tiles (`.tiles`): a file for a terrain of any size, whose tiles are read when they are queried.
//! ```text
//! head      "LWTILES2", nodes, cells of a tile's edge, spacing, origin, overview, least and greatest height, datum, checksums
//! index     for each tile: byte, length, checksum (CRC-32) of what is there; length 0: no data in the whole tile
//! overview  every n-th node, for display
//! tiles     heights as f32, deflated
//! ```
//! A tile has the nodes of its cells and one more row of nodes around them, two in the north and east, so that the cubic
//! surface over each of its cells needs no other tile. All numbers are little-endian; in a block the first bytes of all heights come first, then the
//! second bytes and so on, which improves the compression. Head and index end within the first [`INDEX_END`] bytes, which the hash of the plan covers
//! completely; through their checksums it depends on every tile.
//!
//! ```
//! use linkwork_environment::height_field::HeightField;
//! use linkwork_environment::tiles::{Tiles, write_tiles};
//!
//! let heights = (0..300 * 200).map(|k| (k % 300) as f32 * 0.01).collect();
//! let field = HeightField::new([0.0; 2], [0.5; 2], 300, 200, heights)?;
//! let file = std::env::temp_dir().join(format!("a_doc_test_{}.tiles", std::process::id()));
//! write_tiles(&file, &mut &field, 64)?;
//! let tiles = Tiles::open(&file, 8)?;
//! assert_eq!(tiles.ground(70.3, 51.2), field.ground(70.3, 51.2));
//! # std::fs::remove_file(file)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cache;
mod head;
mod read;
mod write;

#[cfg(test)]
mod tests;

pub use read::Tiles;
pub use write::{HeightRows, write_tiles};

/// Bytes within which head and index of a file end.
pub const INDEX_END: u64 = 4 << 20;

/// Default number of cells along the edge of a tile; such a tile takes 268 kB of memory.
pub const TILE: usize = 256;

/// Maximum number of nodes along an edge of the overview.
const OVERVIEW: usize = 1024;

/// Reason for which a file of tiles cannot be read or written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TileError {
    /// The system says so.
    #[error("{what}: {why}")]
    System {
        /// The failed action.
        what: &'static str,
        /// The system's words.
        why: String,
    },
    /// The file is not a file of tiles, or is damaged.
    #[error("{fact}\n  help: write the file again with `linkwork terrain convert`")]
    Damaged {
        /// The fact.
        fact: String,
    },
    /// The map cannot be divided into tiles in this way.
    #[error("{fact}\n  help: {help}")]
    Size {
        /// The fact.
        fact: String,
        /// Remedy.
        help: String,
    },
    /// The heights to be written cannot be read.
    #[error("{0}")]
    Source(String),
}

impl TileError {
    fn system(what: &'static str) -> impl FnOnce(std::io::Error) -> TileError {
        move |e| TileError::System { what, why: e.to_string() }
    }

    fn damaged(fact: impl Into<String>) -> TileError {
        TileError::Damaged { fact: fact.into() }
    }
}
