//! The internal mask of a GeoTIFF: an image with one bit per pixel, which GDAL writes after the heights.

use super::super::{HeightsError, bounded};
use super::PIXELS_OF_A_BYTE;
use std::io::{Read, Seek, SeekFrom};
use tiff::decoder::{ChunkType, Decoder};
use tiff::tags::Tag;

/// Returns whether a mask keeps a pixel.
pub(super) fn keeps(mask: &[u8], pixel: usize) -> bool {
    mask[pixel / 8] >> (pixel % 8) & 1 != 0
}

/// Reads the mask, one bit per pixel, the file's first row first; afterwards, the decoder is at the heights again.
pub(super) fn read<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    [nx, ny]: [usize; 2],
    bytes: u64,
) -> Result<Option<Vec<u8>>, HeightsError> {
    let mut found = None;
    while found.is_none() && decoder.more_images() {
        decoder.next_image()?;
        let kind: u32 = decoder.find_tag_unsigned(Tag::NewSubfileType)?.unwrap_or(0);
        let (width, height) = decoder.dimensions()?;
        // Bit 2 of the kind marks a mask. Overviews have their own masks, which are smaller.
        if kind & 4 != 0 && (width as usize, height as usize) == (nx, ny) {
            bounded(bytes, nx as u64, ny as u64, 8 * PIXELS_OF_A_BYTE)?;
            found = Some(bits(decoder, [nx, ny])?);
        }
    }
    decoder.seek_to_image(0)?;
    Ok(found)
}

/// Returns the bits of the decoder's present image.
fn bits<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    [nx, ny]: [usize; 2],
) -> Result<Vec<u8>, HeightsError> {
    let compression: u16 = decoder.find_tag_unsigned(Tag::Compression)?.unwrap_or(1);
    let depth: u16 = decoder.find_tag_unsigned(Tag::BitsPerSample)?.unwrap_or(1);
    if depth != 1 || ![1, 8, 32946].contains(&compression) {
        return Err(HeightsError::content(
            format!(
                "its internal mask has {depth} bits per pixel and the compression number {compression}, which are not supported"
            ),
            "mark missing data by a value: `gdalwarp -dstnodata -9999`",
        ));
    }
    let (offsets, counts) = match decoder.get_chunk_type() {
        ChunkType::Strip => (Tag::StripOffsets, Tag::StripByteCounts),
        ChunkType::Tile => (Tag::TileOffsets, Tag::TileByteCounts),
    };
    let offsets: Vec<u64> = decoder.find_tag_unsigned_vec(offsets)?.unwrap_or_default();
    let counts: Vec<u64> = decoder.find_tag_unsigned_vec(counts)?.unwrap_or_default();
    let (cw, ch) = decoder.chunk_dimensions();
    let (cw, ch) = (cw.max(1) as usize, ch.max(1) as usize);
    let (across, line) = (nx.div_ceil(cw), cw.div_ceil(8));
    let mut mask = vec![0_u8; (nx * ny).div_ceil(8)];
    for (k, (at, count)) in offsets.iter().zip(&counts).enumerate() {
        let (i0, j0) = (k % across * cw, k / across * ch);
        // A chunk that is not stored masks all its pixels.
        if *count == 0 || j0 >= ny {
            continue;
        }
        let file = decoder.inner();
        file.seek(SeekFrom::Start(*at)).map_err(tiff::TiffError::from)?;
        let stored = file.take(*count);
        let mut room = Vec::new();
        let most = (line * ch) as u64;
        match compression {
            1 => stored.take(most).read_to_end(&mut room),
            _ => flate2::read::ZlibDecoder::new(stored).take(most).read_to_end(&mut room),
        }
        .map_err(tiff::TiffError::from)?;
        for (j, row) in room.chunks_exact(line).enumerate().take(ny - j0) {
            for i in 0..cw.min(nx - i0) {
                let pixel = (j0 + j) * nx + i0 + i;
                mask[pixel / 8] |= (row[i / 8] >> (7 - i % 8) & 1) << (pixel % 8);
            }
        }
    }
    Ok(mask)
}
