//! Height maps from files: GeoTIFF, and grey PNG of 8 or 16 bits.
//! ```text
//! GeoTIFF  x = x_t + (column − i) s_x,  y = y_t − (row − j) s_y      (tie point i, j → x_t, y_t)
//! PNG      h = h_min + grey/grey_max (h_max − h_min)                 black low, white high
//! ```
//! Row 0 of both is the northern edge. GeoTIFF cells that equal GDAL's no-data text are missing; the text
//! is compared as a number in f64 and in f32, since files hold values such as −3.4028234663852886e+38
//! that do not survive a strict conversion.

use crate::height_field::HeightField;
use linkwork_runtime::SurfaceFault;
use std::io::Cursor;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

/// Why a file is refused.
#[derive(Debug, thiserror::Error)]
pub enum DemError {
    /// The TIFF cannot be decoded.
    #[error("not a readable TIFF: {0}")]
    Tiff(#[from] tiff::TiffError),
    /// The PNG cannot be decoded.
    #[error("not a readable PNG: {0}")]
    Png(#[from] png::DecodingError),
    /// Pixels of a kind that holds no heights.
    #[error("heights are read from one channel of grey values, not from {0}")]
    Pixels(String),
    /// No scale in the file.
    #[error("the TIFF has no ModelPixelScale: give the distance of nodes in metres")]
    NoScale,
    /// More nodes than a height map may have.
    #[error("{nx} by {ny} nodes are too many: 64 million at most")]
    TooMany {
        /// Nodes along x.
        nx: u32,
        /// Nodes along y.
        ny: u32,
    },
    /// The file is far too short for its picture.
    #[error("{bytes} bytes cannot hold the {nx} by {ny} pixels that the file says it has")]
    Short {
        /// Bytes of the file.
        bytes: usize,
        /// Nodes along x.
        nx: u32,
        /// Nodes along y.
        ny: u32,
    },
    /// The grid is refused.
    #[error(transparent)]
    Grid(#[from] SurfaceFault),
}

/// Most nodes of a map.
const NODES_MAX: u64 = 64_000_000;

/// Pixels that a byte of a file can hold: compression (deflate, LZW) makes a few thousand equal ones of one.
const PIXELS_OF_A_BYTE: u64 = 8192;

/// That a picture may be decoded: memory is taken for what a file holds, not for what it says.
fn bounded(bytes: usize, nx: u32, ny: u32) -> Result<(), DemError> {
    let nodes = u64::from(nx) * u64::from(ny);
    if nodes > NODES_MAX {
        return Err(DemError::TooMany { nx, ny });
    }
    if nodes > PIXELS_OF_A_BYTE * bytes as u64 {
        return Err(DemError::Short { bytes, nx, ny });
    }
    Ok(())
}

/// Reads a GeoTIFF from `bytes`. `spacing` (m) replaces the file's pixel scale, for files whose scale is
/// in degrees or missing. The tie point, when there is one and `spacing` is `None`, gives the origin.
pub fn geotiff(bytes: &[u8], spacing: Option<[f64; 2]>) -> Result<HeightField, DemError> {
    let mut decoder = Decoder::new(Cursor::new(bytes))?;
    let (width, height) = decoder.dimensions()?;
    bounded(bytes.len(), width, height)?;
    // Tags are held by the file; pixels have eight bytes at most.
    let mut limits = Limits::default();
    limits.decoding_buffer_size = 8 * width as usize * height as usize + 1024;
    limits.intermediate_buffer_size = limits.decoding_buffer_size;
    limits.ifd_value_size = bytes.len().max(1024);
    decoder = decoder.with_limits(limits);
    let (nx, ny) = (width as usize, height as usize);
    let scale = decoder.find_tag(Tag::ModelPixelScaleTag)?.map(|v| v.into_f64_vec()).transpose()?;
    let tie = decoder.find_tag(Tag::ModelTiepointTag)?.map(|v| v.into_f64_vec()).transpose()?;
    let missing = decoder.find_tag(Tag::GdalNodata)?.and_then(|v| v.into_string().ok());
    let missing = missing.and_then(|text| text.trim_matches(['\0', ' ', '\n']).parse::<f64>().ok());
    let pixels = pixels(decoder.read_image()?)?;
    if pixels.len() != nx * ny {
        return Err(DemError::Pixels(format!("{} channels", pixels.len() / (nx * ny).max(1))));
    }
    let mut heights = vec![0.0_f32; nx * ny];
    for row in 0..ny {
        for i in 0..nx {
            let value = pixels[row * nx + i];
            let gone = missing.is_some_and(|m| value == m || value as f32 == m as f32);
            let out = &mut heights[(ny - 1 - row) * nx + i];
            *out = if gone || !value.is_finite() { f32::NAN } else { value as f32 };
        }
    }
    let (spacing, origin) = match (spacing, scale.as_deref(), tie.as_deref()) {
        (Some(s), ..) => (s, [0.0, 0.0]),
        (None, Some([sx, sy, ..]), Some([i, j, _, x, y, ..])) => {
            ([*sx, *sy], [x - i * sx, y + j * sy - (ny as f64 - 1.0) * sy])
        }
        (None, Some([sx, sy, ..]), _) => ([*sx, *sy], [0.0, 0.0]),
        _ => return Err(DemError::NoScale),
    };
    Ok(HeightField::new(origin, spacing, nx, ny, heights)?)
}

fn pixels(image: DecodingResult) -> Result<Vec<f64>, DemError> {
    fn wide<T: Copy + Into<f64>>(v: &[T]) -> Vec<f64> {
        v.iter().map(|&x| x.into()).collect()
    }
    Ok(match image {
        DecodingResult::U8(v) => wide(&v),
        DecodingResult::U16(v) => wide(&v),
        DecodingResult::U32(v) => wide(&v),
        DecodingResult::I8(v) => wide(&v),
        DecodingResult::I16(v) => wide(&v),
        DecodingResult::I32(v) => wide(&v),
        DecodingResult::F32(v) => wide(&v),
        DecodingResult::F64(v) => v,
        other => return Err(DemError::Pixels(format!("{other:?}").chars().take(12).collect())),
    })
}

/// Reads a PNG from `bytes`: the first channel, black at `range[0]` and white at `range[1]` (m), nodes
/// `spacing` apart (m), the south-west node at the origin.
pub fn png_heights(
    bytes: &[u8],
    range: [f64; 2],
    spacing: [f64; 2],
) -> Result<HeightField, DemError> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let (width, height) = decoder.read_header_info()?.size();
    bounded(bytes.len(), width, height)?;
    let mut reader = decoder.read_info()?;
    let size =
        reader.output_buffer_size().ok_or_else(|| DemError::Pixels("a huge image".into()))?;
    let mut data = vec![0; size];
    let info = reader.next_frame(&mut data)?;
    let (nx, ny) = (info.width as usize, info.height as usize);
    let wide = info.bit_depth == png::BitDepth::Sixteen;
    let channels = info.color_type.samples();
    let pixel = channels * if wide { 2 } else { 1 };
    let mut heights = vec![0.0_f32; nx * ny];
    for row in 0..ny {
        for i in 0..nx {
            let at = row * info.line_size + i * pixel;
            let grey = if wide {
                f64::from(u16::from_be_bytes([data[at], data[at + 1]])) / 65535.0
            } else {
                f64::from(data[at]) / 255.0
            };
            heights[(ny - 1 - row) * nx + i] = (range[0] + grey * (range[1] - range[0])) as f32;
        }
    }
    Ok(HeightField::new([0.0, 0.0], spacing, nx, ny, heights)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference(name: &str) -> Option<Vec<u8>> {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference/terrain/");
        let bytes = std::fs::read(format!("{folder}{name}")).ok();
        if bytes.is_none() {
            println!("skipped: {name} is absent");
        }
        bytes
    }

    fn range(f: &HeightField) -> (f32, f32) {
        f.heights().iter().fold((f32::MAX, f32::MIN), |(a, b), &h| (a.min(h), b.max(h)))
    }

    /// A PNG that is a header: 8-bit grey, of this size.
    fn png_of(width: u32, height: u32) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Grayscale);
        let writer = encoder.write_header().unwrap();
        drop(writer);
        bytes
    }

    /// A TIFF whose directory says its size, with one strip of nothing.
    fn tiff_of(width: u32, height: u32) -> Vec<u8> {
        let tags: [(u16, u32); 9] = [
            (256, width),
            (257, height),
            (258, 8),
            (259, 1),
            (262, 1),
            (273, 8),
            (277, 1),
            (278, height),
            (279, 0),
        ];
        let mut bytes = b"II*\0\x08\0\0\0".to_vec();
        bytes.extend((tags.len() as u16).to_le_bytes());
        for (tag, value) in tags {
            bytes.extend(tag.to_le_bytes());
            bytes.extend(4u16.to_le_bytes());
            bytes.extend(1u32.to_le_bytes());
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend([0; 4]);
        bytes
    }

    #[test]
    fn a_file_that_says_more_than_it_holds_takes_no_memory() {
        let (range, spacing) = ([0.0, 1.0], [1.0, 1.0]);
        for (nx, ny) in [(60_000, 60_000), (0x7fff_ffff, 0x7fff_ffff), (8001, 8000)] {
            let png = png_heights(&png_of(nx, ny), range, spacing).unwrap_err();
            assert!(matches!(png, DemError::TooMany { .. }), "{png}");
            let tiff = geotiff(&tiff_of(nx, ny), Some(spacing)).unwrap_err();
            assert!(matches!(tiff, DemError::TooMany { .. }), "{tiff}");
        }
        let png = png_heights(&png_of(5000, 5000), range, spacing).unwrap_err();
        assert!(matches!(png, DemError::Short { .. }), "{png}");
        let tiff = geotiff(&tiff_of(5000, 5000), Some(spacing)).unwrap_err();
        assert!(matches!(tiff, DemError::Short { .. }), "{tiff}");
        // Small ones are refused by the decoders themselves.
        assert!(png_heights(&png_of(50, 50), range, spacing).is_err());
        assert!(geotiff(&tiff_of(50, 50), Some(spacing)).is_err());
    }

    #[test]
    fn lunar_geotiff_has_its_published_size_scale_and_range() {
        let Some(bytes) = reference("gzcommon_dem_moon.tif") else { return };
        let f = geotiff(&bytes, None).unwrap();
        assert_eq!(f.size(), [33, 33]);
        assert!((f.spacing()[0] - 2.4266).abs() < 1e-3 && (f.spacing()[1] - 2.4266).abs() < 1e-3);
        let (low, high) = range(&f);
        assert!((low + 212.296).abs() < 1e-3 && (high + 205.440).abs() < 1e-3, "{low} {high}");
    }

    #[test]
    fn pixels_that_are_not_square_keep_their_two_spacings() {
        let Some(bytes) = reference("gzcommon_dem_landscape.tif") else { return };
        let f = geotiff(&bytes, None).unwrap();
        let [nx, ny] = f.size();
        assert!(nx * ny == 125 * 200 && nx > ny, "{nx} {ny}");
        let s = f.spacing();
        assert!((s[0] - s[1]).abs() > 0.002, "{s:?}");
        let metres = geotiff(&bytes, Some([30.0, 20.0])).unwrap();
        assert_eq!(metres.spacing(), [30.0, 20.0]);
        assert_eq!(metres.heights().len(), f.heights().len());
    }

    #[test]
    fn sixteen_bit_png_uses_all_its_bits() {
        let Some(bytes) = reference("gzcommon_grayscale_16bit.png") else { return };
        let f = png_heights(&bytes, [0.0, 65535.0], [1.0, 1.0]).unwrap();
        assert_eq!(f.size(), [4, 4]);
        // A grey value that is not a multiple of 257 cannot come from 8 bits.
        assert!(f.heights().iter().any(|h| (h / 257.0).fract() != 0.0), "{:?}", f.heights());
    }

    /// A little-endian GeoTIFF of f32 with a no-data text, written here.
    fn tiny_tiff(nodata: &str, cells: &[f32; 6]) -> Vec<u8> {
        let mut bytes = vec![];
        let mut encoder = tiff::encoder::TiffEncoder::new(Cursor::new(&mut bytes)).unwrap();
        let mut image = encoder.new_image::<tiff::encoder::colortype::Gray32Float>(3, 2).unwrap();
        let dir = image.encoder();
        dir.write_tag(Tag::ModelPixelScaleTag, &[2.0, 5.0, 0.0][..]).unwrap();
        dir.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 100.0, 50.0, 0.0][..]).unwrap();
        dir.write_tag(Tag::GdalNodata, nodata).unwrap();
        image.write_data(cells).unwrap();
        bytes
    }

    #[test]
    fn missing_cells_are_found_even_when_their_text_is_not_an_f32() {
        for nodata in ["-3.4028234663852886e+38", "-3.40282346600000016e+38", "-9999"] {
            let hole = if nodata == "-9999" { -9999.0 } else { f32::MIN };
            let bytes = tiny_tiff(nodata, &[1.0, 2.0, 3.0, 4.0, hole, 6.0]);
            let f = geotiff(&bytes, None).unwrap();
            assert_eq!(f.heights().iter().filter(|h| h.is_nan()).count(), 1, "{nodata}");
            assert!(f.heights()[1].is_nan(), "the southern row comes first");
            assert_eq!((f.heights()[0], f.heights()[3]), (4.0, 1.0));
            assert_eq!(f.bounds(), [100.0, 45.0, 104.0, 50.0]);
            assert!(f.ground(101.0, 47.0).is_none());
        }
    }

    #[test]
    fn eight_bit_png_is_black_low_white_high_north_up() {
        let mut bytes = vec![];
        let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[0, 255, 51, 102]).unwrap();
        writer.finish().unwrap();
        let f = png_heights(&bytes, [-1.0, 4.0], [1.0, 1.0]).unwrap();
        assert_eq!(f.heights(), [0.0, 1.0, -1.0, 4.0]);
    }

    #[test]
    fn refusals_name_the_fault() {
        assert!(geotiff(b"hello", None).unwrap_err().to_string().contains("not a readable TIFF"));
        let e = png_heights(b"hello", [0.0, 1.0], [1.0, 1.0]).unwrap_err();
        assert!(e.to_string().contains("not a readable PNG"));
    }
}
