//! GeoTIFF and BigTIFF of one band: strips or tiles, uncompressed, LZW, deflate or PackBits, with predictors; integers
//! and floating-point numbers of either order of bytes.
//! ```text
//! x = x_t + (column + c − i) s_x,  y = y_t − (row + c − j) s_y    (tie point i, j → x_t, y_t)
//! c = ½: pixels are areas (the standard's rule, unless it says points), 0: pixels are points
//! h = (sample · scale + offset) · unit       scale, offset: of GDAL's metadata, unit: of the vertical axis
//! ```
//! Row 0 is the northern edge. Samples that equal GDAL's no-data text are missing; the text is compared as a number in f64
//! and in f32, since files hold values such as −3.4028234663852886e+38 that do not survive a strict conversion.

use super::{Heights, HeightsError, HeightsOptions, bounded, length, text, units};
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
    spacing: [f64; 2],
    origin: [f64; 2],
    missing: Option<f64>,
    /// h = scale · sample + offset (m).
    scale: f64,
    offset: f64,
    chunk: [usize; 2],
    /// Bytes of each chunk that is not compressed, and of a sample.
    plain: Option<(Vec<u64>, usize)>,
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
        one_band(&mut decoder)?;
        let frame = frame(&mut decoder, ny, options)?;
        let missing = decoder.find_tag(Tag::GdalNodata)?.and_then(|v| v.into_string().ok());
        let missing = missing.map(|text| text.trim_matches(['\0', ' ', '\n']).to_string());
        let missing = match missing.filter(|text| !text.is_empty()).map(|t| (t.parse::<f64>(), t)) {
            None => None,
            Some((Ok(value), _)) => Some(value),
            Some((Err(_), t)) => {
                let fact = format!("its no-data value `{t}` is no number");
                return Err(HeightsError::content(
                    fact,
                    "write it anew (`gdal_translate -a_nodata`)",
                ));
            }
        };
        let [scale, offset] = metadata(&mut decoder)?;
        let plain = plain(&mut decoder)?;
        let (cw, ch) = decoder.chunk_dimensions();
        if cw == 0 || ch == 0 {
            return Err(HeightsError::content("its strips or tiles are empty", "write it anew"));
        }
        Ok(GeoTiff {
            decoder,
            bytes,
            nx,
            ny,
            spacing: frame.spacing,
            origin: frame.origin,
            missing,
            scale: scale * frame.height_unit,
            offset: offset * frame.height_unit,
            chunk: [cw as usize, ch as usize],
            plain,
            bands: Vec::new(),
        })
    }

    /// Nodes along x and y.
    pub fn size(&self) -> [usize; 2] {
        [self.nx, self.ny]
    }

    /// Distance of nodes along x and y (m).
    pub fn spacing(&self) -> [f64; 2] {
        self.spacing
    }

    /// x, y of the south-west node (m).
    pub fn origin(&self) -> [f64; 2] {
        self.origin
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
        Ok(Heights { nx, ny, heights, spacing: self.spacing, origin: self.origin })
    }

    /// Heights of row `j`, counted from the southern edge, into `row` of as many nodes as there are along x. Rows that
    /// lie near each other cost one decoding of their strips or tiles.
    ///
    /// # Errors
    /// Strips or tiles that cannot be decoded; a row that is not there.
    pub fn row(&mut self, j: usize, row: &mut [f32]) -> Result<(), HeightsError> {
        let outside =
            || HeightsError::content(format!("there is no row {j}"), "count from the south");
        let line = self.ny.checked_sub(j + 1).ok_or_else(outside)?;
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

    /// The rows of a row of chunks, from the north.
    fn band(&mut self, band: usize, mut room: Vec<f32>) -> Result<Vec<f32>, HeightsError> {
        let [cw, ch] = self.chunk;
        let lines = ch.min(self.ny - band * ch);
        let across = self.nx.div_ceil(cw);
        room.clear();
        for c in 0..across {
            let index = u32::try_from(band * across + c).unwrap_or(u32::MAX);
            let chunks = match self.decoder.get_chunk_type() {
                ChunkType::Strip => self.decoder.strip_count()?,
                ChunkType::Tile => self.decoder.tile_count()?,
            };
            if index >= chunks {
                let fact = format!("it has {chunks} strips or tiles, too few for its size");
                return Err(HeightsError::content(fact, "take the whole file"));
            }
            if let Some((counts, size)) = &self.plain {
                let tile = self.decoder.get_chunk_type() == ChunkType::Tile;
                let wanted = cw as u64 * (if tile { ch } else { lines } * size) as u64;
                let bytes = counts.get(index as usize).copied().unwrap_or(0);
                if bytes < wanted {
                    let fact = format!("strip or tile {index} has {bytes} bytes of {wanted}");
                    return Err(HeightsError::content(fact, "take the whole file"));
                }
            }
            let samples = Numbers(self.decoder.read_chunk(index)?);
            let columns = cw.min(self.nx - c * cw);
            if samples.len() != columns * lines {
                let what = format!("{} samples in a tile of {}", samples.len(), columns * lines);
                return Err(HeightsError::Pixels { what });
            }
            if room.is_empty() {
                room.resize(self.nx * lines, 0.0);
            }
            for k in 0..lines {
                let to = &mut room[k * self.nx + c * cw..][..columns];
                for (out, value) in to.iter_mut().zip(samples.range(k * columns, columns)) {
                    let gone = self.missing.is_some_and(|m| value == m || value as f32 == m as f32);
                    let h = value * self.scale + self.offset;
                    *out = if gone || !value.is_finite() { f32::NAN } else { h as f32 };
                }
            }
        }
        Ok(room)
    }
}

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

    fn range(&self, from: usize, count: usize) -> impl Iterator<Item = f64> + '_ {
        (from..from + count).map(|k| self.at(k))
    }
}

fn one_band<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<(), HeightsError> {
    let bands: u32 = decoder.find_tag_unsigned(Tag::SamplesPerPixel)?.unwrap_or(1);
    if bands != 1 {
        return Err(HeightsError::Pixels { what: format!("{bands} bands") });
    }
    match decoder.colortype()? {
        ColorType::Gray(8 | 16 | 32 | 64) => Ok(()),
        other => Err(HeightsError::Pixels { what: format!("pixels of the kind {other:?}") }),
    }
}

/// Bytes of the chunks of a file that is not compressed, and of its samples: what is too short would be read from what follows.
fn plain<R: Read + Seek>(
    decoder: &mut Decoder<R>,
) -> Result<Option<(Vec<u64>, usize)>, HeightsError> {
    if decoder.find_tag_unsigned(Tag::Compression)?.unwrap_or(1_u16) != 1 {
        return Ok(None);
    }
    let tag = match decoder.get_chunk_type() {
        ChunkType::Strip => Tag::StripByteCounts,
        ChunkType::Tile => Tag::TileByteCounts,
    };
    let counts = decoder.find_tag_unsigned_vec(tag)?.unwrap_or_default();
    let bits = match decoder.colortype()? {
        ColorType::Gray(bits) => usize::from(bits),
        _ => 8,
    };
    Ok(Some((counts, bits / 8)))
}

/// Scale and offset of the first band.
fn metadata<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<[f64; 2], HeightsError> {
    let Some(value) = decoder.find_tag(GDAL_METADATA)? else { return Ok([1.0, 0.0]) };
    let words = value.into_string()?;
    let root = parse_with(
        &text(words.as_bytes()).replace('\0', ""),
        "GDAL_METADATA",
        Declarations::Refused,
    )?;
    let mut out = [1.0, 0.0];
    for item in &root.children {
        let of =
            |name: &str| item.attributes.iter().find(|a| a.name == name).map(|a| a.value.as_str());
        let Some(k) = ["scale", "offset"].iter().position(|r| of("role") == Some(r)) else {
            continue;
        };
        if of("sample").is_none_or(|s| s == "0") {
            let number = item.text.trim().parse::<f64>().ok().filter(|n| n.is_finite());
            out[k] = number.ok_or_else(|| {
                let fact = format!(
                    "GDAL's metadata has `{}` for {}",
                    item.text,
                    of("role").unwrap_or_default()
                );
                HeightsError::content(fact, "write a number")
            })?;
        }
    }
    Ok(out)
}

/// Where the nodes are.
struct Frame {
    spacing: [f64; 2],
    origin: [f64; 2],
    /// Metres of the unit of heights.
    height_unit: f64,
}

/// What the keys of a GeoTIFF say.
#[derive(Default)]
struct Keys {
    keys: Vec<[u16; 4]>,
    doubles: Vec<f64>,
}

/// GTModelType, GTRasterType, and units of the projection and of heights.
const MODEL: u16 = 1024;
const RASTER: u16 = 1025;
const LINEAR: u16 = 3076;
const LINEAR_SIZE: u16 = 3077;
const VERTICAL: u16 = 4099;
/// The standard's `user-defined`.
const OWN: u16 = 32767;

impl Keys {
    fn read<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Keys, HeightsError> {
        let Some(directory) = decoder.find_tag(Tag::GeoKeyDirectoryTag)? else {
            return Ok(Keys::default());
        };
        let words = directory.into_u16_vec()?;
        let doubles = decoder.find_tag(Tag::GeoDoubleParamsTag)?.map(|v| v.into_f64_vec());
        let keys = words.get(4..).unwrap_or_default().chunks_exact(4);
        let keys = keys.map(|k| [k[0], k[1], k[2], k[3]]).collect();
        Ok(Keys { keys, doubles: doubles.transpose()?.unwrap_or_default() })
    }

    fn short(&self, key: u16) -> Option<u16> {
        self.keys.iter().find(|k| k[0] == key && k[1] == 0).map(|k| k[3])
    }

    /// Metres of the unit that a key says.
    fn unit(&self, key: u16, what: &str) -> Result<f64, HeightsError> {
        let Some(code) = self.short(key).filter(|c| *c != 0) else { return Ok(1.0) };
        let own = self.keys.iter().find(|k| k[0] == LINEAR_SIZE).map(|k| usize::from(k[3]));
        let size = match (code, own) {
            (OWN, Some(at)) if key == LINEAR => self.doubles.get(at).copied(),
            (code, _) => units::epsg(code),
        };
        size.filter(|s| *s > 0.0 && s.is_finite()).ok_or_else(|| {
            let fact = format!("the unit {code} (EPSG) of {what} is not known here");
            HeightsError::content(fact, "project it to metres (`gdalwarp -t_srs`)")
        })
    }
}

fn frame<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    ny: usize,
    options: &HeightsOptions,
) -> Result<Frame, HeightsError> {
    let keys = Keys::read(decoder)?;
    let height_unit = keys.unit(VERTICAL, "heights")?;
    if let Some(spacing) = options.spacing {
        return Ok(Frame { spacing, origin: [0.0, 0.0], height_unit });
    }
    let (spacing, [x, y]) = placed(decoder, &keys)?;
    match keys.short(MODEL) {
        Some(2) => return Err(HeightsError::Degrees { x: spacing[0], y: spacing[1] }),
        Some(3) => {
            return Err(HeightsError::content(
                "its coordinates are geocentric",
                "project it to metres (`gdalwarp -t_srs`)",
            ));
        }
        _ => {}
    }
    let unit = keys.unit(LINEAR, "coordinates")?;
    // The centre of the pixel in column 0 of the last row.
    let south = y - (ny as f64 - 1.0) * spacing[1];
    Ok(Frame { spacing: spacing.map(|s| s * unit), origin: [x * unit, south * unit], height_unit })
}

/// Spacing, and where the north-west node is, in the file's unit.
fn placed<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    keys: &Keys,
) -> Result<([f64; 2], [f64; 2]), HeightsError> {
    let mut list = |tag| decoder.find_tag(tag)?.map(|v| v.into_f64_vec()).transpose();
    let (scale, tie) = (list(Tag::ModelPixelScaleTag)?, list(Tag::ModelTiepointTag)?);
    let matrix = list(Tag::ModelTransformationTag)?;
    let centre = if keys.short(RASTER) == Some(2) { 0.0 } else { 0.5 };
    let (sx, sy, x, y) = match (scale.as_deref(), tie.as_deref(), matrix.as_deref()) {
        (Some([sx, sy, ..]), Some([i, j, _, x, y, ..]), _) => {
            (*sx, *sy, x + (centre - i) * sx, y - (centre - j) * sy)
        }
        (Some([sx, sy, ..]), _, _) => (*sx, *sy, 0.0, 0.0),
        (None, _, Some([a, b, _, x, c, d, _, y, ..])) => {
            if *b != 0.0 || *c != 0.0 {
                return Err(HeightsError::content(
                    "its rows are turned against its coordinates",
                    "warp it so that north is up (`gdalwarp`)",
                ));
            }
            (*a, -*d, x + centre * a, y + centre * d)
        }
        _ => return Err(HeightsError::NoScale { what: "the TIFF" }),
    };
    if !(x.is_finite() && y.is_finite()) {
        return Err(HeightsError::content("its tie point is no place", "write it anew"));
    }
    Ok(([length("pixel scale", sx)?, length("pixel scale", sy)?], [x, y]))
}
