//! Writes heights for other programs: tiled GeoTIFF, ESRI ASCII grids, grey PNG. Rows are requested one by one.
//! ```text
//! GeoTIFF  f32, tiles of 256 by 256, deflated; pixels are points, metres; no data: NaN; BigTIFF when it would be longer than 4 GB
//! ASCII    every height with the digits that give it back; no data: the least number that f32 has
//! PNG      16 bits, h = low + grey/65535 (high − low); no data: transparent
//! ```

use std::io::{Seek, SeekFrom, Write};

/// A map for writing.
pub struct Map<'a> {
    /// Number of nodes along x and y.
    pub size: [usize; 2],
    /// Spacing (m).
    pub spacing: [f64; 2],
    /// x, y of the south-west node (m).
    pub origin: [f64; 2],
    /// Height to which all heights are relative (m); a GeoTIFF stores it as the offset of its band, an ASCII grid adds it to the heights.
    pub datum: f64,
    /// Returns the heights of a row above the datum (m), counted from the southern edge.
    pub row: &'a mut dyn FnMut(usize, &mut [f32]) -> std::io::Result<()>,
}

impl std::fmt::Debug for Map<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Map({} by {})", self.size[0], self.size[1])
    }
}

/// Edge of a tile of a GeoTIFF.
const TILE: usize = 256;

/// Writes a GeoTIFF.
///
/// # Errors
/// Rows that cannot be read, a file that cannot be written.
pub fn write_geotiff(out: &mut (impl Write + Seek), map: &mut Map<'_>) -> std::io::Result<()> {
    let [nx, ny] = map.size;
    let (across, down) = (nx.div_ceil(TILE), ny.div_ceil(TILE));
    // Incompressible data grow by less than this.
    let longest = (across * down) as u64 * (4 * TILE * TILE + 1024) as u64;
    let big = longest > u64::from(u32::MAX);
    out.write_all(&[0; 16][..if big { 16 } else { 8 }])?;
    let mut at = out.stream_position()?;
    let (mut offsets, mut counts) = (Vec::new(), Vec::new());
    let mut band = vec![f32::NAN; nx * TILE];
    for t in 0..down {
        band.fill(f32::NAN);
        for k in 0..TILE.min(ny - t * TILE) {
            (map.row)(ny - 1 - t * TILE - k, &mut band[k * nx..(k + 1) * nx])?;
        }
        for c in 0..across {
            let mut bytes = Vec::with_capacity(4 * TILE * TILE);
            for k in 0..TILE {
                for i in c * TILE..(c + 1) * TILE {
                    let h = if i < nx { band[k * nx + i] } else { f32::NAN };
                    bytes.extend(h.to_le_bytes());
                }
            }
            let mut pack = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
            pack.write_all(&bytes)?;
            let packed = pack.finish()?;
            out.write_all(&packed)?;
            offsets.push(at);
            counts.push(packed.len() as u64);
            at += packed.len() as u64;
        }
    }
    // Values that are stored outside of a directory must begin at even bytes.
    if at % 2 == 1 {
        out.write_all(&[0])?;
        at += 1;
    }
    let [x, y] = map.origin;
    let top = y + (ny as f64 - 1.0) * map.spacing[1];
    let mut directory = Directory { big, at, tags: Vec::new(), far: Vec::new() };
    directory.longs(256, &[nx as u64]);
    directory.longs(257, &[ny as u64]);
    directory.shorts(258, &[32]);
    directory.shorts(259, &[8]);
    directory.shorts(262, &[1]);
    directory.shorts(277, &[1]);
    directory.longs(322, &[TILE as u64]);
    directory.longs(323, &[TILE as u64]);
    directory.places(324, &offsets);
    directory.places(325, &counts);
    directory.shorts(339, &[3]);
    directory.doubles(33550, &[map.spacing[0], map.spacing[1], 0.0]);
    directory.doubles(33922, &[0.0, 0.0, 0.0, x, top, 0.0]);
    // GeoKey directory, version 1.1.0: a user-defined projection, pixels are points, lengths in
    // metres.
    directory.shorts(
        34735,
        &[1, 1, 0, 4, 1024, 0, 1, 1, 1025, 0, 1, 2, 3072, 0, 1, 32767, 3076, 0, 1, 9001],
    );
    if map.datum != 0.0 {
        let offset = format!(
            "<GDALMetadata><Item name=\"OFFSET\" sample=\"0\" role=\"offset\">{}</Item></GDALMetadata>\0",
            map.datum
        );
        directory.bytes(42112, offset.as_bytes());
    }
    directory.bytes(42113, b"nan\0");
    directory.write(out)
}

/// The directory of a TIFF, followed by its values.
struct Directory {
    big: bool,
    /// Start of the values.
    at: u64,
    /// Tag, type, count, value or its index in `far`.
    tags: Vec<(u16, u16, u64, Value)>,
    far: Vec<u8>,
}

enum Value {
    Near(Vec<u8>),
    Far(u64),
}

impl Directory {
    fn put(&mut self, tag: u16, kind: u16, count: usize, bytes: Vec<u8>) {
        let room = if self.big { 8 } else { 4 };
        let value = match bytes.len() <= room {
            true => Value::Near(bytes),
            false => {
                let place = self.at + self.far.len() as u64;
                self.far.extend(bytes);
                if self.far.len() % 2 == 1 {
                    self.far.push(0);
                }
                Value::Far(place)
            }
        };
        self.tags.push((tag, kind, count as u64, value));
    }
    fn bytes(&mut self, tag: u16, text: &[u8]) {
        self.put(tag, 2, text.len(), text.to_vec());
    }
    fn shorts(&mut self, tag: u16, v: &[u16]) {
        self.put(tag, 3, v.len(), v.iter().flat_map(|x| x.to_le_bytes()).collect());
    }
    fn longs(&mut self, tag: u16, v: &[u64]) {
        self.put(tag, 4, v.len(), v.iter().flat_map(|x| (*x as u32).to_le_bytes()).collect());
    }
    fn doubles(&mut self, tag: u16, v: &[f64]) {
        self.put(tag, 12, v.len(), v.iter().flat_map(|x| x.to_le_bytes()).collect());
    }
    /// Adds offsets and lengths.
    fn places(&mut self, tag: u16, v: &[u64]) {
        match self.big {
            true => self.put(tag, 16, v.len(), v.iter().flat_map(|x| x.to_le_bytes()).collect()),
            false => self.longs(tag, v),
        }
    }

    fn write(self, out: &mut (impl Write + Seek)) -> std::io::Result<()> {
        let place = |n: u64| match self.big {
            true => n.to_le_bytes().to_vec(),
            false => (n as u32).to_le_bytes().to_vec(),
        };
        out.write_all(&self.far)?;
        let first = self.at + self.far.len() as u64;
        let count = self.tags.len();
        let mut bytes = match self.big {
            true => (count as u64).to_le_bytes().to_vec(),
            false => (count as u16).to_le_bytes().to_vec(),
        };
        for (tag, kind, count, value) in &self.tags {
            bytes.extend(tag.to_le_bytes());
            bytes.extend(kind.to_le_bytes());
            bytes.extend(place(*count));
            match value {
                Value::Near(near) => {
                    bytes.extend(near);
                    bytes.extend(vec![0; place(0).len() - near.len()]);
                }
                Value::Far(at) => bytes.extend(place(*at)),
            }
        }
        bytes.extend(place(0));
        out.write_all(&bytes)?;
        out.seek(SeekFrom::Start(0))?;
        let head = match self.big {
            true => [b"II\x2b\0\x08\0\0\0".to_vec(), place(first)].concat(),
            false => [b"II\x2a\0".to_vec(), place(first)].concat(),
        };
        out.write_all(&head)?;
        out.flush()
    }
}

/// Writes an ESRI ASCII grid.
///
/// # Errors
/// Rows that cannot be read, a file that cannot be written.
pub fn write_ascii(out: &mut impl Write, map: &mut Map<'_>) -> std::io::Result<()> {
    let ([nx, ny], [x, y], [sx, sy]) = (map.size, map.origin, map.spacing);
    writeln!(out, "ncols {nx}\nnrows {ny}\nxllcenter {x}\nyllcenter {y}")?;
    match sx == sy {
        true => writeln!(out, "cellsize {sx}")?,
        false => writeln!(out, "dx {sx}\ndy {sy}")?,
    }
    writeln!(out, "NODATA_value {:e}", f32::MIN)?;
    let mut row = vec![0.0; nx];
    for j in (0..ny).rev() {
        (map.row)(j, &mut row)?;
        let words: Vec<String> = row
            .iter()
            .map(|h| match h.is_nan() {
                true => format!("{:e}", f32::MIN),
                false if map.datum == 0.0 => h.to_string(),
                false => (f64::from(*h) + map.datum).to_string(),
            })
            .collect();
        writeln!(out, "{}", words.join(" "))?;
    }
    out.flush()
}

/// Writes a grey PNG of 16 bits, black at `range[0]` and white at `range[1]` (m).
///
/// # Errors
/// Rows that cannot be read, a file that cannot be written.
pub fn write_png(out: &mut impl Write, map: &mut Map<'_>, range: [f32; 2]) -> std::io::Result<()> {
    let [nx, ny] = map.size;
    let [low, high] = range.map(f64::from);
    let mut row = vec![0.0; nx];
    let mut pixels = Vec::with_capacity(4 * nx * ny);
    let mut whole = true;
    for j in (0..ny).rev() {
        (map.row)(j, &mut row)?;
        for h in &row {
            let grey = if high > low { (f64::from(*h) - low) / (high - low) } else { 0.0 };
            let grey = (grey.clamp(0.0, 1.0) * 65535.0).round() as u16;
            pixels.extend(grey.to_be_bytes());
            pixels.extend(if h.is_nan() { [0; 2] } else { [255; 2] });
            whole &= !h.is_nan();
        }
    }
    let kind = if whole { png::ColorType::Grayscale } else { png::ColorType::GrayscaleAlpha };
    if whole {
        let grey = pixels.chunks_exact(4).flat_map(|p| [p[0], p[1]]).collect();
        pixels = grey;
    }
    picture(out, [nx, ny], kind, png::BitDepth::Sixteen, &pixels)
}

/// Writes a grey PNG of 8 bits for viewing, the northern row first.
///
/// # Errors
/// A file that cannot be written; a number of pixels that does not match the size.
pub fn write_shades(out: &mut impl Write, size: [usize; 2], pixels: &[u8]) -> std::io::Result<()> {
    picture(out, size, png::ColorType::Grayscale, png::BitDepth::Eight, pixels)
}

fn picture(
    out: &mut impl Write,
    [nx, ny]: [usize; 2],
    kind: png::ColorType,
    depth: png::BitDepth,
    pixels: &[u8],
) -> std::io::Result<()> {
    let mut encoder = png::Encoder::new(&mut *out, nx as u32, ny as u32);
    encoder.set_color(kind);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().map_err(std::io::Error::other)?;
    writer.write_image_data(pixels).map_err(std::io::Error::other)?;
    writer.finish().map_err(std::io::Error::other)?;
    out.flush()
}
