//! Heights of ground from files of other programs: GeoTIFF, ESRI ASCII grids, lists of points, grey PNG and BMP,
//! images of the Planetary Data System (PDS3, PDS4).
//!
//! Every reader returns [`Heights`]: a regular grid in metres, x east, y north, the southern row first, NaN where data is missing. For a file in
//! degrees, the spacing is that in the middle of the map, if the file specifies its ellipsoid and one spacing is accurate enough for the height of
//! the map; other files in degrees are rejected. Distances of maps in Mercator and cylindrical projections are corrected in the same way (`projection.rs`).
//! Memory is allocated for the actual content of a file, not for the sizes in its header.
//! ```text
//! GeoTIFF  h = sample · scale + offset        x = x_t + (column − i) s_x,  y = y_t − (row − j) s_y
//! PNG, BMP h = h_black + grey (h_white − h_black),  grey from 0 to 1
//! PDS      h = sample · SCALING_FACTOR + OFFSET
//! ```
//!
//! ```
//! use linkwork_formats::heights::{HeightsOptions, read_heights};
//!
//! let grid = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 5\nNODATA_value -9999\n1 2 3\n4 -9999 6\n";
//! let none = &mut |_: &str| Err("no file beside it".to_string());
//! let read = read_heights("hill.asc", grid.as_bytes(), &HeightsOptions::default(), none)?;
//! assert_eq!((read.nx, read.ny, read.spacing, read.origin), (3, 2, [5.0, 5.0], [2.5, 2.5]));
//! assert!(read.heights[0] == 4.0 && read.heights[1].is_nan() && read.heights[5] == 3.0);
//! # Ok::<(), linkwork_formats::heights::HeightsError>(())
//! ```

mod ascii;
mod datum;
mod degrees;
mod epsg;
mod geotiff;
mod grey;
mod marks;
mod pds3;
mod pds4;
mod projection;
mod samples;
mod units;
mod write;
mod xyz;

pub use geotiff::GeoTiff;
pub use write::{Map, write_ascii, write_geotiff, write_png, write_shades};

use crate::read::{BYTE_ORDER_MARK, is_utf16};
use std::io::Cursor;

/// Heights on a regular grid; x east, y north, z up.
#[derive(Clone, Debug, PartialEq)]
pub struct Heights {
    /// Nodes along x.
    pub nx: usize,
    /// Nodes along y.
    pub ny: usize,
    /// Heights above the datum (m): x fastest, the southern row first; NaN marks nodes without data.
    pub heights: Vec<f32>,
    /// The datum (m), which keeps all digits far from zero: 0 for heights below 16 km, otherwise a whole number of metres near the first height.
    pub datum: f64,
    /// Spacing of nodes along x and y (m).
    pub spacing: [f64; 2],
    /// x, y of the south-west node (m); zero if the file does not specify it.
    pub origin: [f64; 2],
}

/// Settings that a file does not contain.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightsOptions {
    /// Spacing along x and y (m), instead of the value in the file; the south-west node is then at the origin.
    pub spacing: Option<[f64; 2]>,
    /// Heights (m) of black and white, for PNG and BMP.
    pub range: [f64; 2],
}

impl Default for HeightsOptions {
    fn default() -> Self {
        HeightsOptions { spacing: None, range: [0.0, 1.0] }
    }
}

/// The reason why a file is rejected.
#[derive(Debug, thiserror::Error)]
pub enum HeightsError {
    /// The TIFF cannot be decoded.
    #[error(
        "not a readable TIFF: {0}\n  help: write the file again with another compression: `gdal_translate -co COMPRESS=DEFLATE`"
    )]
    Tiff(#[from] tiff::TiffError),
    /// The PNG cannot be decoded.
    #[error("not a readable PNG: {0}")]
    Png(#[from] png::DecodingError),
    /// The label in XML cannot be read.
    #[error("not a readable label: {0}")]
    Xml(#[from] crate::FormatError),
    /// Pixels without heights.
    #[error(
        "heights require one grey value per pixel, but there are {what}\n  help: write one band of grey values to a separate file"
    )]
    Pixels {
        /// The pixels found.
        what: String,
    },
    /// A file without a scale.
    #[error(
        "{what} does not have a scale\n  help: write `spacing: (0.1, 0.1)`, the distance between nodes in metres"
    )]
    NoScale {
        /// The kind of file.
        what: &'static str,
    },
    /// A spacing in degrees.
    #[error(
        "its nodes are {x} by {y} degrees apart, but a degree is not a length\n  help: project it to metres (`gdalwarp -t_srs`), or write `spacing: (30, 30)`, the distance between nodes in metres"
    )]
    Degrees {
        /// Along x.
        x: f64,
        /// Along y.
        y: f64,
    },
    /// More nodes than the maximum for a map in memory.
    #[error(
        "{nx} by {ny} nodes are too many: the limit is 64 million\n  help: write it as GeoTIFF (`gdal_translate`) and convert it to tiles, which are read on demand: `linkwork terrain convert`"
    )]
    TooMany {
        /// Nodes along x.
        nx: u64,
        /// Nodes along y.
        ny: u64,
    },
    /// A file that is too short for its image.
    #[error("{bytes} bytes cannot contain {nx} by {ny} samples, the size in the file")]
    Short {
        /// Bytes of the file.
        bytes: u64,
        /// Nodes along x.
        nx: u64,
        /// Nodes along y.
        ny: u64,
    },
    /// Faulty content.
    #[error("{place}{fact}\n  help: {help}")]
    Content {
        /// Line or entry with a colon, or nothing.
        place: String,
        /// The fault.
        fact: String,
        /// The remedy.
        help: String,
    },
    /// A data file of a label that cannot be read.
    #[error("its data file `{name}`: {why}")]
    Companion {
        /// Its name.
        name: String,
        /// The reason for which it cannot be read.
        why: String,
    },
    /// An unknown file extension.
    #[error("`{name}` is not in a supported format of heights\n  help: {KINDS}")]
    Kind {
        /// Name of the file.
        name: String,
    },
}

/// File extensions and their formats.
pub const KINDS: &str = "GeoTIFF (.tif, .tiff), ESRI ASCII grid (.asc), points (.xyz), PNG (.png), BMP (.bmp), PDS3 (.lbl, .img), PDS4 (.xml)";

/// Maximum number of nodes of a map in memory.
pub const NODES_MAX: u64 = 64_000_000;

impl HeightsError {
    pub(crate) fn at(
        place: impl std::fmt::Display,
        fact: impl Into<String>,
        help: impl Into<String>,
    ) -> HeightsError {
        let place = format!("{place}: ");
        HeightsError::Content { place, fact: fact.into(), help: help.into() }
    }

    pub(crate) fn content(fact: impl Into<String>, help: impl Into<String>) -> HeightsError {
        HeightsError::Content { place: String::new(), fact: fact.into(), help: help.into() }
    }
}

/// Checks that a grid can be in memory, for a file of `bytes` bytes with at most `of_a_byte` nodes per byte.
fn bounded(bytes: u64, nx: u64, ny: u64, of_a_byte: u64) -> Result<(), HeightsError> {
    let nodes = nx.saturating_mul(ny);
    if nodes > NODES_MAX {
        return Err(HeightsError::TooMany { nx, ny });
    }
    if nodes > of_a_byte.saturating_mul(bytes) {
        return Err(HeightsError::Short { bytes, nx, ny });
    }
    if nx < 2 || ny < 2 {
        return Err(HeightsError::content(
            format!("a grid of {nx} by {ny} nodes does not have cells"),
            "at least 2 by 2 are required",
        ));
    }
    Ok(())
}

/// Checks that a length is positive and finite.
fn length(place: &str, value: f64) -> Result<f64, HeightsError> {
    match value > 0.0 && value.is_finite() {
        true => Ok(value),
        false => Err(HeightsError::at(
            place,
            format!("the distance between nodes is {value}"),
            "write a positive, finite number",
        )),
    }
}

/// Reads heights from the bytes of a file; the extension of `name` selects the format ([`KINDS`]). Other files in the folder (the data of a label,
/// the `.prj` of an ASCII grid) are requested by name from `beside`, which otherwise returns the reason in words.
///
/// # Errors
/// The fault of the file, with a remedy.
pub fn read_heights(
    name: &str,
    bytes: &[u8],
    options: &HeightsOptions,
    beside: &mut dyn FnMut(&str) -> Result<Vec<u8>, String>,
) -> Result<Heights, HeightsError> {
    let (stem, ending) = name.rsplit_once('.').unwrap_or((name, ""));
    let ending = ending.to_lowercase();
    if is_utf16(bytes) && matches!(ending.as_str(), "asc" | "xyz" | "lbl" | "xml") {
        return Err(HeightsError::content("it is a text in UTF-16", "save it as UTF-8"));
    }
    let read = match ending.as_str() {
        "tif" | "tiff" => GeoTiff::open(Cursor::new(bytes), bytes.len() as u64, options)?.heights(),
        "png" => grey::png_heights(bytes, options),
        "bmp" => grey::bmp(bytes, options),
        "asc" => ascii::grid(bytes, beside(&format!("{stem}.prj")).ok().as_deref(), options),
        "xyz" => xyz::points(bytes, options),
        "lbl" => pds3::labelled(bytes, options, beside),
        "img" => pds3::image(stem, bytes, options, beside),
        "xml" => pds4::labelled(name, bytes, options, beside),
        _ => Err(HeightsError::Kind { name: name.to_string() }),
    }?;
    if let Some(index) = read.heights.iter().position(|h| h.is_infinite()) {
        let (column, row) = (index % read.nx, read.ny - 1 - index / read.nx);
        return Err(HeightsError::content(
            format!("the height in column {column}, row {row} is infinite as a 32-bit number"),
            "mark missing data with the no-data value of the file, or scale the heights",
        ));
    }
    marks::check(&read.heights, read.datum)?;
    Ok(read)
}

/// Converts bytes of ASCII or UTF-8 without a byte order mark; invalid bytes are replaced.
fn text(bytes: &[u8]) -> std::borrow::Cow<'_, str> {
    String::from_utf8_lossy(bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes))
}
