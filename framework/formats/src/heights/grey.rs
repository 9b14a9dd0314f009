//! Grey images: PNG of 1 to 16 bits, BMP of 1 to 32 bits. Black is low, white is high, the upper edge is north.
//!
//! Colour images are accepted if each pixel is grey; a fully transparent pixel has no data.

use super::{Heights, HeightsError, HeightsOptions, bounded};
use std::io::Cursor;

/// Maximum number of pixels per byte of a PNG: deflate stores about a thousand bytes in one, each with eight pixels.
const PIXELS_OF_A_BYTE: u64 = 8192;

fn colour(column: usize, row: usize) -> HeightsError {
    HeightsError::Pixels { what: format!("colours (column {column}, row {row})") }
}

/// Reads the heights of a PNG.
pub(super) fn png_heights(bytes: &[u8], options: &HeightsOptions) -> Result<Heights, HeightsError> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let (width, height) = decoder.read_header_info()?.size();
    bounded(bytes.len() as u64, width.into(), height.into(), PIXELS_OF_A_BYTE)?;
    let spacing = options.spacing.ok_or(HeightsError::NoScale { what: "a PNG" })?;
    let mut reader = decoder.read_info()?;
    let too_large = || HeightsError::Pixels { what: "more bytes than the memory".into() };
    let size = reader.output_buffer_size().ok_or_else(too_large)?;
    let mut data = vec![0; size];
    let info = reader.next_frame(&mut data)?;
    let (nx, ny) = (info.width as usize, info.height as usize);
    let wide = info.bit_depth == png::BitDepth::Sixteen;
    let channels = info.color_type.samples();
    let width = if wide { 2 } else { 1 };
    let white = if wide { 65535.0 } else { 255.0 };
    let value = |at: usize, channel: usize| {
        let at = at + channel * width;
        let low = u16::from(data[at]);
        if wide { low << 8 | u16::from(data[at + 1]) } else { low }
    };
    let mut heights = vec![0.0_f32; nx * ny];
    for row in 0..ny {
        for column in 0..nx {
            let at = row * info.line_size + column * channels * width;
            let grey = value(at, 0);
            if channels >= 3 && (value(at, 1) != grey || value(at, 2) != grey) {
                return Err(colour(column, row));
            }
            let opaque = if channels % 2 == 0 { f64::from(value(at, channels - 1)) } else { white };
            if opaque != 0.0 && opaque != white {
                let what = format!("half-transparent pixels (column {column}, row {row})");
                return Err(HeightsError::Pixels { what });
            }
            let [black, top] = options.range;
            let h = black + f64::from(grey) / white * (top - black);
            heights[(ny - 1 - row) * nx + column] = if opaque == 0.0 { f32::NAN } else { h as f32 };
        }
    }
    Ok(Heights { nx, ny, heights, datum: 0.0, spacing, origin: [0.0, 0.0] })
}

/// Reads the heights of an uncompressed BMP.
pub(super) fn bmp(bytes: &[u8], options: &HeightsOptions) -> Result<Heights, HeightsError> {
    let cut = || HeightsError::content("the BMP is truncated", "use the complete file");
    let word = |at: usize| -> Result<u16, HeightsError> {
        let two = bytes.get(at..at + 2).ok_or_else(cut)?;
        Ok(u16::from_le_bytes([two[0], two[1]]))
    };
    let long =
        |at: usize| Ok::<u32, HeightsError>(u32::from(word(at)?) | u32::from(word(at + 2)?) << 16);
    if !bytes.starts_with(b"BM") {
        return Err(HeightsError::content(
            "not a readable BMP: it does not begin with `BM`",
            "export it as a Windows bitmap",
        ));
    }
    let (start, head) = (long(10)? as usize, long(14)? as usize);
    let old = head == 12;
    let (width, height, bits, compression) = match head {
        12 => (i64::from(word(18)?), i64::from(word(20)?), word(24)?, 0),
        40..=1024 => {
            let signed = |at| Ok::<i64, HeightsError>(i64::from(long(at)? as i32));
            (signed(18)?, signed(22)?, word(28)?, long(30)?)
        }
        _ => {
            return Err(HeightsError::content(
                format!("a BMP header of {head} bytes is not supported"),
                "export it as a Windows bitmap",
            ));
        }
    };
    if compression != 0 {
        return Err(HeightsError::content(
            "the BMP is compressed, or has bit masks",
            "export it without compression, with 8 bits per pixel",
        ));
    }
    if ![1, 4, 8, 24, 32].contains(&bits) {
        let what = format!("{bits} bits per pixel");
        return Err(HeightsError::Pixels { what });
    }
    let (nx, ny) = (width.max(0) as u64, height.unsigned_abs());
    let stride = nx.saturating_mul(bits.into()).div_ceil(32).saturating_mul(4);
    bounded(bytes.len() as u64, nx, ny, 8)?;
    if stride.saturating_mul(ny) > bytes.len().saturating_sub(start) as u64 {
        return Err(HeightsError::Short { bytes: bytes.len() as u64, nx, ny });
    }
    let spacing = options.spacing.ok_or(HeightsError::NoScale { what: "a BMP" })?;
    let (nx, ny, stride) = (nx as usize, ny as usize, stride as usize);
    let [black, white] = options.range;
    let mut heights = vec![0.0_f32; nx * ny];
    for line in 0..ny {
        let data = &bytes[start + line * stride..start + (line + 1) * stride];
        // The lower edge is first, unless the height is negative.
        let j = if height > 0 { line } else { ny - 1 - line };
        for column in 0..nx {
            let entry = |k: u8| {
                let size = if old { 3 } else { 4 };
                let at = 14 + head + usize::from(k) * size;
                bytes[..start].get(at..at + 3).ok_or_else(cut)
            };
            let pixel = match bits {
                1 => entry(data[column / 8] >> (7 - column % 8) & 1)?,
                4 => entry(data[column / 2] >> (4 * (1 - column % 2)) & 15)?,
                8 => entry(data[column])?,
                _ => {
                    let at = column * usize::from(bits / 8);
                    &data[at..at + 3]
                }
            };
            if pixel[1] != pixel[0] || pixel[2] != pixel[0] {
                return Err(colour(column, ny - 1 - j));
            }
            let grey = f64::from(pixel[0]) / 255.0;
            heights[j * nx + column] = (black + grey * (white - black)) as f32;
        }
    }
    Ok(Heights { nx, ny, heights, datum: 0.0, spacing, origin: [0.0, 0.0] })
}
