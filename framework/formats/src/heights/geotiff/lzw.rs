//! LZW strips and tiles whose end the decoder of the crate `tiff` does not find.
//!
//! Where the width of the codes changes at the end of a strip or tile, libtiff writes the end code with another width than the decoder expects. The
//! decoder then rejects data that are complete. They are decompressed here, and given to the decoder as a file without compression.

use super::{CHUNK_MAX, HeightsError};
use std::io::{Cursor, Read, Seek, SeekFrom};
use tiff::decoder::{ChunkType, Decoder, DecodingResult, Limits};
use tiff::tags::{ByteOrder, Tag};

/// Code of the compression.
pub(super) const LZW: u16 = 5;

/// Returns all samples of the strip or tile `index`, whose stored size is `stored` bytes, and the number of samples of a row; `lines` are the rows of
/// a strip.
///
/// # Errors
/// The data end before the last sample.
pub(super) fn samples<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    index: usize,
    stored: u64,
    lines: usize,
) -> Result<(DecodingResult, usize), HeightsError> {
    let tile = decoder.get_chunk_type() == ChunkType::Tile;
    let (columns, rows) = decoder.chunk_dimensions();
    let rows = if tile { rows as usize } else { lines };
    let bits = decoder.colortype()?.bit_depth();
    let size = columns as usize * rows * usize::from(bits / 8);
    if size > CHUNK_MAX {
        let fact = format!("strip or tile {index} has {size} bytes");
        return Err(HeightsError::content(fact, "write the file again with smaller tiles"));
    }
    let offsets = if tile { Tag::TileOffsets } else { Tag::StripOffsets };
    let offsets: Vec<u64> = decoder.find_tag_unsigned_vec(offsets)?.unwrap_or_default();
    let offset = offsets.get(index).copied().unwrap_or(u64::MAX);
    let mut packed = Vec::new();
    let read = decoder.inner();
    read.seek(SeekFrom::Start(offset)).map_err(tiff::TiffError::from)?;
    read.take(stored).read_to_end(&mut packed).map_err(tiff::TiffError::from)?;
    let data = unpacked(&packed, size);
    if data.len() < size {
        let fact = format!("strip or tile {index} has {} of {size} bytes", data.len());
        return Err(HeightsError::content(fact, "use the complete file"));
    }
    let predictor: u16 = decoder.find_tag_unsigned(Tag::Predictor)?.unwrap_or(1);
    let format: u16 = decoder.find_tag_unsigned(Tag::SampleFormat)?.unwrap_or(1);
    let big = decoder.byte_order() == ByteOrder::BigEndian;
    let file = plain(&data, [columns, rows as u32], [bits.into(), predictor, format], big);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = CHUNK_MAX;
    limits.intermediate_buffer_size = CHUNK_MAX;
    let read = Decoder::new(Cursor::new(file))?.with_limits(limits).read_chunk(0)?;
    Ok((read, columns as usize))
}

/// Returns the first `size` decompressed bytes, or fewer where the data end or are damaged.
fn unpacked(mut packed: &[u8], size: usize) -> Vec<u8> {
    let order = weezl::BitOrder::Msb;
    let mut decoder = weezl::decode::Configuration::with_tiff_size_switch(order, 8)
        .with_yield_on_full_buffer(true)
        .build();
    let (mut out, mut at) = (vec![0; size], 0);
    while at < size {
        let step = decoder.decode_bytes(packed, &mut out[at..]);
        packed = packed.get(step.consumed_in..).unwrap_or_default();
        at += step.consumed_out;
        let stuck = step.consumed_in == 0 && step.consumed_out == 0;
        if step.status.is_err() || stuck {
            break;
        }
    }
    out.truncate(at);
    out
}

/// Returns a TIFF file of one uncompressed strip with `data`.
fn plain(data: &[u8], size: [u32; 2], [bits, predictor, format]: [u16; 3], big: bool) -> Vec<u8> {
    const SHORT: u16 = 3;
    const LONG: u16 = 4;
    const START: u32 = 8 + 2 + 12 * 11 + 4;
    let short = |x: u16| if big { x.to_be_bytes() } else { x.to_le_bytes() };
    let long = |x: u32| if big { x.to_be_bytes() } else { x.to_le_bytes() };
    let entries: [(u16, u16, u32); 11] = [
        (256, LONG, size[0]),
        (257, LONG, size[1]),
        (258, SHORT, bits.into()),
        (259, SHORT, 1),
        (262, SHORT, 1),
        (273, LONG, START),
        (277, SHORT, 1),
        (278, LONG, size[1]),
        (279, LONG, data.len() as u32),
        (317, SHORT, predictor.into()),
        (339, SHORT, format.into()),
    ];
    let mut file = if big { b"MM".to_vec() } else { b"II".to_vec() };
    file.extend(short(42));
    file.extend(long(8));
    file.extend(short(entries.len() as u16));
    for (tag, kind, value) in entries {
        file.extend(short(tag));
        file.extend(short(kind));
        file.extend(long(1));
        match kind {
            SHORT => file.extend([short(value as u16), [0; 2]].concat()),
            _ => file.extend(long(value)),
        }
    }
    file.extend(long(0));
    file.extend(data);
    file
}
