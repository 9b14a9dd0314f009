//! GeoTIFF and BigTIFF of one band: strips or tiles, uncompressed, LZW, deflate or PackBits, with predictors; integers
//! and floating-point numbers of either order of bytes.
//! ```text
//! x = x_t + (column + c − i) s_x,  y = y_t − (row + c − j) s_y    (tie point i, j → x_t, y_t)
//! c = ½: pixels are areas (the standard's rule, unless it says points), 0: pixels are points
//! h = (sample · scale + offset) · unit
//! ```
//! `scale`, `offset` and `unit` are those of GDAL's metadata; without a unit there, the unit of heights is that of the vertical reference system.
//!
//! Row 0 is the northern edge, or the southern one in a file whose transformation says so. Without data are: samples that equal GDAL's no-data text,
//! pixels that an internal mask leaves out, strips and tiles that are not stored (of a file with a no-data text; of others they are zeros, as for
//! GDAL), and the special pixels of ISIS. The no-data text is compared as a number in f64 and in f32, since files hold values such as
//! −3.4028234663852886e+38 that do not survive a strict conversion.

mod mask;
mod place;

use super::{Heights, HeightsError, HeightsOptions, bounded, datum, text, units};
use crate::xml::{Declarations, parse_with};
use std::io::{Read, Seek};
use tiff::ColorType;
use tiff::decoder::{ChunkType, Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

/// Pixels that a byte of a file can hold: compression (deflate, LZW) makes a few thousand equal ones of one.
const PIXELS_OF_A_BYTE: u64 = 8192;

/// Most bytes of a chunk (strip or tile), decoded.
const CHUNK_MAX: usize = 1 << 29;

/// GDAL's metadata, which holds scale and offset of a band.
const GDAL_METADATA: Tag = Tag::Unknown(42112);

/// An open GeoTIFF, of which rows are read as they are needed.
pub struct GeoTiff<R: Read + Seek> {
    decoder: Decoder<R>,
    bytes: u64,
    nx: usize,
    ny: usize,
    frame: place::Frame,
    missing: Option<f64>,
    /// h = scale · sample + offset (m).
    scale: f64,
    offset: f64,
    /// Height above which heights are given (m).
    datum: f64,
    /// One bit for each pixel that an internal mask keeps, the first row first.
    mask: Option<Vec<u8>>,
    /// Samples are floating-point numbers.
    real: bool,
    chunk: [usize; 2],
    /// Stored bytes of each chunk.
    stored: Vec<u64>,
    /// Bytes of a sample of a file that is not compressed.
    plain: Option<usize>,
    /// Rows of chunks that were read last: number, heights.
    bands: Vec<(usize, Vec<f32>)>,
}

impl<R: Read + Seek> std::fmt::Debug for GeoTiff<R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "GeoTiff({} by {})", self.nx, self.ny)
    }
}

impl<R: Read + Seek> GeoTiff<R> {
    /// Reads what a file of `bytes` bytes says of itself, and no heights.
    ///
    /// # Errors
    /// What is wrong with it, and the remedy.
    pub fn open(reader: R, bytes: u64, options: &HeightsOptions) -> Result<Self, HeightsError> {
        let mut limits = Limits::default();
        // Tags are held by the file.
        limits.ifd_value_size = usize::try_from(bytes).unwrap_or(usize::MAX).max(1024);
        limits.decoding_buffer_size = CHUNK_MAX;
        limits.intermediate_buffer_size = CHUNK_MAX;
        let mut decoder = Decoder::new(reader)?.with_limits(limits);
        let (width, height) = decoder.dimensions()?;
        let (nx, ny) = (width as usize, height as usize);
        let nodes = u64::from(width) * u64::from(height);
        if nodes > PIXELS_OF_A_BYTE.saturating_mul(bytes) {
            return Err(HeightsError::Short { bytes, nx: width.into(), ny: height.into() });
        }
        if nx < 2 || ny < 2 {
            // Says so.
            bounded(bytes, width.into(), height.into(), PIXELS_OF_A_BYTE)?;
        }
        let real = one_band(&mut decoder)?;
        let frame = place::frame(&mut decoder, ny, options)?;
        let missing = missing(&mut decoder)?;
        let [scale, offset, unit] = metadata(&mut decoder)?;
        let unit = if unit.is_nan() { frame.height_unit } else { unit };
        let (stored, plain) = stored(&mut decoder)?;
        let mask = mask::read(&mut decoder, [nx, ny], bytes)?;
        let (cw, ch) = decoder.chunk_dimensions();
        if cw == 0 || ch == 0 {
            return Err(HeightsError::content("its strips or tiles are empty", "write it anew"));
        }
        let mut open = GeoTiff {
            decoder,
            bytes,
            nx,
            ny,
            frame,
            missing,
            scale: scale * unit,
            offset: offset * unit,
            datum: 0.0,
            mask,
            real,
            chunk: [cw as usize, ch as usize],
            stored,
            plain,
            bands: Vec::new(),
        };
        open.datum = open.find_datum()?;
        Ok(open)
    }

    /// The datum of its heights, from the first height in the file.
    fn find_datum(&mut self) -> Result<f64, HeightsError> {
        // Samples of up to 16 bits, and heights of f32 as they are, have no digits that could be lost.
        let exact = self.real
            && self.offset == 0.0
            && matches!(self.decoder.colortype()?, ColorType::Gray(32));
        if exact || self.decoder.colortype()?.bit_depth() < 32 && self.offset.abs() < datum::LEAST {
            return Ok(0.0);
        }
        let bands = self.ny.div_ceil(self.chunk[1]);
        for band in 0..bands {
            let read = self.band(band, Vec::new())?;
            if let Some(first) = read.iter().find(|h| !h.is_nan()) {
                return Ok(datum::of(f64::from(*first)));
            }
        }
        Ok(0.0)
    }

    /// Nodes along x and y.
    pub fn size(&self) -> [usize; 2] {
        [self.nx, self.ny]
    }

    /// Distance of nodes along x and y (m).
    pub fn spacing(&self) -> [f64; 2] {
        self.frame.spacing
    }

    /// x, y of the south-west node (m); zero of a file in degrees.
    pub fn origin(&self) -> [f64; 2] {
        self.frame.origin
    }

    /// Height above which heights are given (m): [`Heights::datum`].
    pub fn datum(&self) -> f64 {
        self.datum
    }

    /// All heights, in memory.
    ///
    /// # Errors
    /// More than 64 million nodes; strips or tiles that cannot be decoded.
    pub fn heights(mut self) -> Result<Heights, HeightsError> {
        let (nx, ny) = (self.nx, self.ny);
        bounded(self.bytes, nx as u64, ny as u64, PIXELS_OF_A_BYTE)?;
        let mut heights = vec![0.0; nx * ny];
        for j in (0..ny).rev() {
            self.row(j, &mut heights[j * nx..(j + 1) * nx])?;
        }
        let (spacing, origin, datum) = (self.frame.spacing, self.frame.origin, self.datum);
        Ok(Heights { nx, ny, heights, datum, spacing, origin })
    }

    /// Heights above the datum (m) of row `j`, counted from the southern edge, into `row` of as many nodes as there are along x. Rows that
    /// lie near each other cost one decoding of their strips or tiles.
    ///
    /// # Errors
    /// Strips or tiles that cannot be decoded; a row that is not there.
    pub fn row(&mut self, j: usize, row: &mut [f32]) -> Result<(), HeightsError> {
        let outside =
            || HeightsError::content(format!("there is no row {j}"), "count from the south");
        let north = self.ny.checked_sub(j + 1).ok_or_else(outside)?;
        let line = if self.frame.from_south { j } else { north };
        let (band, within) = (line / self.chunk[1], line % self.chunk[1]);
        if !self.bands.iter().any(|(b, _)| *b == band) {
            let room = if self.bands.len() > 1 { self.bands.remove(0).1 } else { Vec::new() };
            let read = self.band(band, room)?;
            self.bands.push((band, read));
        }
        let heights = self.bands.iter().find(|(b, _)| *b == band).map(|(_, h)| h);
        let from = heights.and_then(|h| h.get(within * self.nx..(within + 1) * self.nx));
        row.copy_from_slice(from.filter(|f| f.len() == row.len()).ok_or_else(outside)?);
        Ok(())
    }

    /// Heights above the datum (m) of a row of chunks, the file's first row first.
    fn band(&mut self, band: usize, mut room: Vec<f32>) -> Result<Vec<f32>, HeightsError> {
        let [cw, ch] = self.chunk;
        let lines = ch.min(self.ny - band * ch);
        let across = self.nx.div_ceil(cw);
        room.clear();
        for c in 0..across {
            let index = band * across + c;
            let Some(bytes) = self.stored.get(index).copied() else {
                let fact =
                    format!("it has {} strips or tiles, too few for its size", self.stored.len());
                return Err(HeightsError::content(fact, "take the whole file"));
            };
            let columns = cw.min(self.nx - c * cw);
            // A chunk of no bytes is not stored.
            let samples = if bytes == 0 { None } else { Some(self.chunk(index, bytes, lines)?) };
            if let Some(found) =
                samples.as_ref().map(Numbers::len).filter(|n| *n != columns * lines)
            {
                let what = format!("{found} samples in a tile of {}", columns * lines);
                return Err(HeightsError::Pixels { what });
            }
            if room.is_empty() {
                room.resize(self.nx * lines, 0.0);
            }
            for k in 0..lines {
                let first = (band * ch + k) * self.nx + c * cw;
                let to = &mut room[k * self.nx + c * cw..][..columns];
                for (i, out) in to.iter_mut().enumerate() {
                    let value = match &samples {
                        Some(samples) => samples.at(k * columns + i),
                        None => self.missing.unwrap_or(0.0),
                    };
                    *out = self.height(value, first + i);
                }
            }
        }
        Ok(room)
    }

    /// Samples of a chunk of which so many bytes are stored.
    fn chunk(&mut self, index: usize, bytes: u64, lines: usize) -> Result<Numbers, HeightsError> {
        if let Some(size) = self.plain {
            let tile = self.decoder.get_chunk_type() == ChunkType::Tile;
            let [cw, ch] = self.chunk;
            let wanted = cw as u64 * (if tile { ch } else { lines } * size) as u64;
            if bytes < wanted {
                let fact = format!("strip or tile {index} has {bytes} bytes of {wanted}");
                return Err(HeightsError::content(fact, "take the whole file"));
            }
        }
        Ok(Numbers(self.decoder.read_chunk(u32::try_from(index).unwrap_or(u32::MAX))?))
    }

    /// Height above the datum (m) of a sample; NaN without data.
    fn height(&self, value: f64, pixel: usize) -> f32 {
        let special = match self.real {
            true => value.abs() >= SPECIAL_REAL,
            false => self.missing == Some(-32768.0) && value <= SPECIAL_INTEGER,
        };
        let gone = self.missing.is_some_and(|m| value == m || value as f32 == m as f32);
        let masked = self.mask.as_ref().is_some_and(|m| !mask::keeps(m, pixel));
        if gone || special || masked || !value.is_finite() {
            return f32::NAN;
        }
        (value * self.scale + self.offset - self.datum) as f32
    }
}

/// Magnitude from which real samples are special pixels of ISIS (null, low and high saturation): valid ones are smaller.
const SPECIAL_REAL: f64 = 3.402_822_6e38;

/// Greatest special pixel of ISIS among integers of 16 bits whose null is −32768.
const SPECIAL_INTEGER: f64 = -32753.0;

/// Samples as they were decoded.
struct Numbers(DecodingResult);

impl Numbers {
    fn len(&self) -> usize {
        match &self.0 {
            DecodingResult::U8(v) => v.len(),
            DecodingResult::U16(v) => v.len(),
            DecodingResult::U32(v) => v.len(),
            DecodingResult::U64(v) => v.len(),
            DecodingResult::I8(v) => v.len(),
            DecodingResult::I16(v) => v.len(),
            DecodingResult::I32(v) => v.len(),
            DecodingResult::I64(v) => v.len(),
            DecodingResult::F16(v) => v.len(),
            DecodingResult::F32(v) => v.len(),
            DecodingResult::F64(v) => v.len(),
        }
    }

    fn at(&self, k: usize) -> f64 {
        match &self.0 {
            DecodingResult::U8(v) => v[k].into(),
            DecodingResult::U16(v) => v[k].into(),
            DecodingResult::U32(v) => v[k].into(),
            DecodingResult::U64(v) => v[k] as f64,
            DecodingResult::I8(v) => v[k].into(),
            DecodingResult::I16(v) => v[k].into(),
            DecodingResult::I32(v) => v[k].into(),
            DecodingResult::I64(v) => v[k] as f64,
            DecodingResult::F16(v) => v[k].to_f64(),
            DecodingResult::F32(v) => v[k].into(),
            DecodingResult::F64(v) => v[k],
        }
    }
}

/// That there is one band of grey values, of a compression that is read here; whether they are floating-point numbers.
fn one_band<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<bool, HeightsError> {
    let bands: u32 = decoder.find_tag_unsigned(Tag::SamplesPerPixel)?.unwrap_or(1);
    if bands != 1 {
        return Err(HeightsError::Pixels { what: format!("{bands} bands") });
    }
    let compression: u16 = decoder.find_tag_unsigned(Tag::Compression)?.unwrap_or(1);
    if !READ.contains(&compression) {
        let name = COMPRESSIONS.iter().find(|(code, _)| *code == compression);
        let name = name.map_or(format!("number {compression}"), |(_, name)| (*name).to_string());
        return Err(HeightsError::content(
            format!("its compression {name} is not read here"),
            "write it with another one: `gdal_translate -co COMPRESS=DEFLATE`",
        ));
    }
    match decoder.colortype()? {
        ColorType::Gray(8 | 16 | 32 | 64) => {}
        other => {
            return Err(HeightsError::Pixels { what: format!("pixels of the kind {other:?}") });
        }
    }
    Ok(decoder.find_tag_unsigned::<u16>(Tag::SampleFormat)? == Some(3))
}

/// Compressions that are read: none, LZW, deflate (two codes), PackBits, Zstandard.
const READ: [u16; 6] = [1, 5, 8, 32946, 32773, 50000];

/// Names of compressions that are not read.
const COMPRESSIONS: [(u16, &str); 7] = [
    (7, "JPEG"),
    (34712, "JPEG 2000"),
    (34887, "LERC"),
    (34925, "LZMA"),
    (50001, "WebP"),
    (50002, "JPEG XL"),
    (52546, "JPEG XL"),
];

/// The no-data value.
fn missing<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Option<f64>, HeightsError> {
    let missing = decoder.find_tag(Tag::GdalNodata)?.and_then(|v| v.into_string().ok());
    let missing = missing.map(|text| text.trim_matches(['\0', ' ', '\n']).to_string());
    let Some(text) = missing.filter(|text| !text.is_empty()) else { return Ok(None) };
    text.parse().map(Some).map_err(|_| {
        let fact = format!("its no-data value `{text}` is not a number");
        HeightsError::content(fact, "write it anew (`gdal_translate -a_nodata`)")
    })
}

/// Stored bytes of each chunk; of a file that is not compressed, bytes of a sample: what is too short would be read from what follows.
fn stored<R: Read + Seek>(
    decoder: &mut Decoder<R>,
) -> Result<(Vec<u64>, Option<usize>), HeightsError> {
    let (tag, chunks) = match decoder.get_chunk_type() {
        ChunkType::Strip => (Tag::StripByteCounts, decoder.strip_count()?),
        ChunkType::Tile => (Tag::TileByteCounts, decoder.tile_count()?),
    };
    let mut counts: Vec<u64> = decoder.find_tag_unsigned_vec(tag)?.unwrap_or_default();
    counts.truncate(chunks as usize);
    let plain = decoder.find_tag_unsigned(Tag::Compression)?.unwrap_or(1_u16) == 1;
    let size = usize::from(decoder.colortype()?.bit_depth()) / 8;
    Ok((counts, plain.then_some(size)))
}

/// Scale, offset and metres of the unit of the first band; a unit of NaN is not said.
fn metadata<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<[f64; 3], HeightsError> {
    let mut out = [1.0, 0.0, f64::NAN];
    let Some(value) = decoder.find_tag(GDAL_METADATA)? else { return Ok(out) };
    let words = value.into_string()?;
    let root = parse_with(
        &text(words.as_bytes()).replace('\0', ""),
        "GDAL_METADATA",
        Declarations::Refused,
    )?;
    for item in &root.children {
        let of =
            |name: &str| item.attributes.iter().find(|a| a.name == name).map(|a| a.value.as_str());
        let roles = ["scale", "offset", "unittype"];
        let Some(k) = roles.iter().position(|r| of("role") == Some(r)) else { continue };
        if of("sample").is_some_and(|s| s != "0") {
            continue;
        }
        if roles[k] == "unittype" {
            out[k] = units::metres("the unit of its band", item.text.trim())?;
            continue;
        }
        let number = item.text.trim().parse::<f64>().ok().filter(|n| n.is_finite());
        out[k] = number.ok_or_else(|| {
            let fact = format!("GDAL's metadata has `{}` for {}", item.text, roles[k]);
            HeightsError::content(fact, "write a number")
        })?;
    }
    Ok(out)
}
