//! GeoTIFF and BigTIFF with one band: strips or tiles, uncompressed, LZW, deflate or PackBits, with predictors; integers and floating-point numbers
//! of either byte order.
//! ```text
//! x = x_t + (column + c − i) s_x,  y = y_t − (row + c − j) s_y    (tie point i, j → x_t, y_t)
//! c = ½: pixels are areas (the standard's rule, unless it says points), 0: pixels are points
//! h = (sample · scale + offset) · unit
//! ```
//! `scale`, `offset` and `unit` come from GDAL's metadata; without a unit there, heights have the unit of the vertical reference system.
//!
//! Row 0 is the northern edge, or the southern edge if the transformation of the file mirrors the rows. Nodes without data are: samples equal to
//! GDAL's no-data text, pixels outside an internal mask, strips and tiles that are not stored (in a file with a no-data text; in others they are
//! zeros, like in GDAL), and the special pixels of ISIS. The no-data text is compared as a number in f64 and in f32, because files contain values
//! such as −3.4028234663852886e+38 that a strict conversion changes.

mod lzw;
mod mask;
mod place;

use super::{Heights, HeightsError, HeightsOptions, bounded, datum, marks, text, units};
use crate::xml::parse;
use std::io::{Read, Seek};
use tiff::ColorType;
use tiff::decoder::{ChunkType, Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

/// Maximum number of pixels per byte of a file: compression (deflate, LZW) stores a few thousand equal ones in one byte.
const PIXELS_OF_A_BYTE: u64 = 8192;

/// Maximum number of bytes of a decoded chunk (strip or tile).
const CHUNK_MAX: usize = 1 << 29;

/// GDAL's metadata, with scale and offset of a band.
const GDAL_METADATA: Tag = Tag::Unknown(42112);

/// An open GeoTIFF whose rows are read on demand.
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
    /// Height (m) to which all heights are relative.
    datum: f64,
    /// One bit per pixel, 1 inside an internal mask, the first row first.
    mask: Option<Vec<u8>>,
    /// Whether samples are floating-point numbers.
    real: bool,
    /// Whether strips or tiles are compressed by LZW.
    lzw: bool,
    chunk: [usize; 2],
    /// Stored bytes of each chunk.
    stored: Vec<u64>,
    /// Bytes of a sample in an uncompressed file.
    plain: Option<usize>,
    /// The rows of chunks that were read last: number, heights.
    bands: Vec<(usize, Vec<f32>)>,
}

impl<R: Read + Seek> std::fmt::Debug for GeoTiff<R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "GeoTiff({} by {})", self.nx, self.ny)
    }
}

impl<R: Read + Seek> GeoTiff<R> {
    /// Reads the metadata of a file of `bytes` bytes, without heights.
    ///
    /// # Errors
    /// The fault, with a remedy.
    pub fn open(reader: R, bytes: u64, options: &HeightsOptions) -> Result<Self, HeightsError> {
        let mut limits = Limits::default();
        // Values of tags cannot be larger than the file.
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
            // This returns an error about the size.
            bounded(bytes, width.into(), height.into(), PIXELS_OF_A_BYTE)?;
        }
        let real = one_band(&mut decoder)?;
        let frame = place::frame(&mut decoder, ny, options)?;
        let missing = missing(&mut decoder)?;
        let [scale, offset, unit] = metadata(&mut decoder)?;
        let unit = if unit.is_nan() { frame.height_unit } else { unit };
        let (stored, plain) = stored(&mut decoder)?;
        let mask = mask::read(&mut decoder, [nx, ny], bytes)?;
        let lzw = decoder.find_tag_unsigned(Tag::Compression)? == Some(lzw::LZW);
        let (cw, ch) = decoder.chunk_dimensions();
        if cw == 0 || ch == 0 {
            return Err(HeightsError::content(
                "its strips or tiles are empty",
                "write the file again",
            ));
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
            lzw,
            chunk: [cw as usize, ch as usize],
            stored,
            plain,
            bands: Vec::new(),
        };
        open.datum = open.find_datum()?;
        Ok(open)
    }

    /// Returns the datum of the heights, from the first height in the file.
    fn find_datum(&mut self) -> Result<f64, HeightsError> {
        // Samples of up to 16 bits and unscaled heights of type f32 do not need a datum, because
        // they lose no digits in an f32.
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

    /// Returns the number of nodes along x and y.
    pub fn size(&self) -> [usize; 2] {
        [self.nx, self.ny]
    }

    /// Returns the spacing along x and y (m).
    pub fn spacing(&self) -> [f64; 2] {
        self.frame.spacing
    }

    /// Returns x, y of the south-west node (m); zero for a file in degrees.
    pub fn origin(&self) -> [f64; 2] {
        self.frame.origin
    }

    /// Returns the height to which all heights are relative (m): [`Heights::datum`].
    pub fn datum(&self) -> f64 {
        self.datum
    }

    /// Reads all heights.
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

    /// Reads the heights above the datum (m) of row `j`, counted from the southern edge, into `row`, whose length is the number of nodes along x.
    /// Neighbouring rows share one decoding of their strips or tiles.
    ///
    /// # Errors
    /// Strips or tiles that cannot be decoded; a row that does not exist.
    pub fn row(&mut self, j: usize, row: &mut [f32]) -> Result<(), HeightsError> {
        let outside = || {
            HeightsError::content(
                format!("there is no row {j}"),
                "rows are numbered from the south",
            )
        };
        let north = self.ny.checked_sub(j + 1).ok_or_else(outside)?;
        let line = if self.frame.from_south { j } else { north };
        let (band, within) = (line / self.chunk[1], line % self.chunk[1]);
        if !self.bands.iter().any(|(b, _)| *b == band) {
            let room = if self.bands.len() > 1 { self.bands.remove(0).1 } else { Vec::new() };
            let read = self.band(band, room)?;
            marks::check(&read, self.datum)?;
            self.bands.push((band, read));
        }
        let heights = self.bands.iter().find(|(b, _)| *b == band).map(|(_, h)| h);
        let from = heights.and_then(|h| h.get(within * self.nx..(within + 1) * self.nx));
        row.copy_from_slice(from.filter(|f| f.len() == row.len()).ok_or_else(outside)?);
        Ok(())
    }

    /// Returns the heights above the datum (m) of a row of chunks, the file's first row first.
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
                return Err(HeightsError::content(fact, "use the complete file"));
            };
            let columns = cw.min(self.nx - c * cw);
            // A chunk with zero bytes is not stored.
            let size = [columns, lines];
            let samples = if bytes == 0 { None } else { Some(self.chunk(index, bytes, size)?) };
            if room.is_empty() {
                room.resize(self.nx * lines, 0.0);
            }
            for k in 0..lines {
                let first = (band * ch + k) * self.nx + c * cw;
                let to = &mut room[k * self.nx + c * cw..][..columns];
                for (i, out) in to.iter_mut().enumerate() {
                    let value = match &samples {
                        Some(samples) => samples.at(k, i),
                        None => self.missing.unwrap_or(0.0),
                    };
                    *out = self.height(value, first + i);
                }
            }
        }
        Ok(room)
    }

    /// Returns the samples of a chunk with the given number of stored bytes, of which `columns` by `lines` are inside the map.
    fn chunk(
        &mut self,
        index: usize,
        bytes: u64,
        [columns, lines]: [usize; 2],
    ) -> Result<Numbers, HeightsError> {
        if let Some(size) = self.plain {
            let tile = self.decoder.get_chunk_type() == ChunkType::Tile;
            let [cw, ch] = self.chunk;
            let wanted = cw as u64 * (if tile { ch } else { lines } * size) as u64;
            if bytes < wanted {
                let fact = format!("strip or tile {index} has {bytes} of {wanted} bytes");
                return Err(HeightsError::content(fact, "use the complete file"));
            }
        }
        let read = match self.decoder.read_chunk(u32::try_from(index).unwrap_or(u32::MAX)) {
            Ok(samples) => Numbers { samples, columns },
            Err(_) if self.lzw => {
                let (samples, columns) = lzw::samples(&mut self.decoder, index, bytes, lines)?;
                Numbers { samples, columns }
            }
            Err(e) => return Err(e.into()),
        };
        // A tile at an edge may have more samples than the map.
        if read.len() < read.columns * lines || read.columns < columns {
            let what = format!("{} samples in a tile of {}", read.len(), columns * lines);
            return Err(HeightsError::Pixels { what });
        }
        Ok(read)
    }

    /// Returns the height of a sample above the datum (m), NaN without data.
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

/// Smallest magnitude of floating-point special pixels of ISIS (null, low and high saturation): valid samples are smaller.
const SPECIAL_REAL: f64 = 3.402_822_6e38;

/// Largest special pixel of ISIS in 16-bit integers whose null is −32768.
const SPECIAL_INTEGER: f64 = -32753.0;

/// Decoded samples, row after row.
struct Numbers {
    samples: DecodingResult,
    /// Number of samples of a row.
    columns: usize,
}

impl Numbers {
    fn len(&self) -> usize {
        match &self.samples {
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

    fn at(&self, line: usize, column: usize) -> f64 {
        let k = line * self.columns + column;
        match &self.samples {
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

/// Checks that there is one band of grey values with a supported compression; returns whether samples are floating-point numbers.
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
            format!("its compression {name} is not supported"),
            "use another one: `gdal_translate -co COMPRESS=DEFLATE`",
        ));
    }
    match decoder.colortype()? {
        ColorType::Gray(8 | 16 | 32 | 64) => {}
        other => {
            return Err(HeightsError::Pixels { what: format!("pixels of the type {other:?}") });
        }
    }
    Ok(decoder.find_tag_unsigned::<u16>(Tag::SampleFormat)? == Some(3))
}

/// Supported compressions: none, LZW, deflate (two codes), PackBits, Zstandard.
const READ: [u16; 6] = [1, 5, 8, 32946, 32773, 50000];

/// Names of unsupported compressions.
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
        HeightsError::content(fact, "write the file again (`gdal_translate -a_nodata`)")
    })
}

/// Returns the stored bytes of each chunk; for an uncompressed file, the bytes of a sample, because the decoder would read missing samples from the
/// following bytes.
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

/// Returns scale, offset and the length of the unit of the first band in metres; the unit is NaN if it is missing.
fn metadata<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<[f64; 3], HeightsError> {
    let mut out = [1.0, 0.0, f64::NAN];
    let Some(value) = decoder.find_tag(GDAL_METADATA)? else { return Ok(out) };
    let words = value.into_string()?;
    let root = parse(&text(words.as_bytes()).replace('\0', ""), "GDAL_METADATA")?;
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
