//! Height files that tests write, and functions to read them.
#![allow(dead_code)] // Each test uses only some of these functions.
use linkwork_formats::heights::{Heights, HeightsError, HeightsOptions, read_heights};

/// Reads a file without a companion file.
pub fn alone(name: &str, bytes: &[u8]) -> Result<Heights, HeightsError> {
    read_heights(name, bytes, &HeightsOptions::default(), &mut |_| Err("there is none".into()))
}

/// Reads a file whose companion file (world file or label, of any name) has the contents `beside`.
pub fn read(name: &str, bytes: &[u8], beside: &[u8]) -> Result<Heights, HeightsError> {
    read_heights(name, bytes, &HeightsOptions::default(), &mut |_| Ok(beside.to_vec()))
}

/// Returns the height of column `i` and row `j` from the south.
pub fn value(h: &Heights, i: usize, j: usize) -> f32 {
    h.heights[j * h.nx + i]
}

/// A little-endian TIFF of f32 in one strip, with some tags.
pub struct Tiff {
    pub width: u32,
    pub height: u32,
    pub scale: Option<[f64; 3]>,
    pub tie: Option<[f64; 6]>,
    pub matrix: Option<[f64; 8]>,
    pub missing: Option<String>,
    pub bits: u16,
}

impl Tiff {
    /// Creates a file of a size, with nodes 2 m and 5 m apart, without a tie point.
    pub fn of(width: u32, height: u32) -> Tiff {
        let scale = Some([2.0, 5.0, 0.0]);
        Tiff { width, height, scale, tie: None, matrix: None, missing: None, bits: 32 }
    }

    /// Returns the bytes of the file. With a matrix, it does not have a scale.
    pub fn bytes(&self, samples: &[f32]) -> Vec<u8> {
        let data: Vec<u8> = samples.iter().flat_map(|s| s.to_le_bytes()).collect();
        let long = |v: u32| v.to_le_bytes().to_vec();
        let doubles = |v: &[f64]| v.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        // Each tag has a number, a type, a count and a value.
        let mut tags: Vec<(u16, u16, u32, Vec<u8>)> = vec![
            (256, 4, 1, long(self.width)),
            (257, 4, 1, long(self.height)),
            (258, 3, 1, long(self.bits.into())),
            (259, 3, 1, long(1)),
            (262, 3, 1, long(1)),
            (273, 4, 1, long(8)),
            (277, 3, 1, long(1)),
            (278, 4, 1, long(self.height)),
            (279, 4, 1, long(data.len() as u32)),
            (339, 3, 1, long(3)),
        ];
        match (self.scale, self.matrix) {
            (_, Some(m)) => {
                let m = [&m[..], &[0.0; 8]].concat();
                tags.push((34264, 12, 16, doubles(&m)));
            }
            (Some(s), None) => tags.push((33550, 12, 3, doubles(&s))),
            (None, None) => {}
        }
        if let Some(tie) = self.tie {
            tags.push((33922, 12, 6, doubles(&tie)));
        }
        if let Some(text) = &self.missing {
            let text = format!("{text}\0");
            tags.push((42113, 2, text.len() as u32, text.into_bytes()));
        }
        tags.sort_by_key(|t| t.0);
        let directory = 8 + data.len() as u32;
        let mut far = directory + 2 + 12 * tags.len() as u32 + 4;
        let mut bytes = [b"II*\0".as_slice(), &directory.to_le_bytes(), &data].concat();
        let mut values = Vec::new();
        bytes.extend((tags.len() as u16).to_le_bytes());
        for (tag, kind, count, mut value) in tags {
            bytes.extend(tag.to_le_bytes());
            bytes.extend(kind.to_le_bytes());
            bytes.extend(count.to_le_bytes());
            if value.len() <= 4 {
                value.resize(4, 0);
                bytes.extend(value);
            } else {
                bytes.extend(far.to_le_bytes());
                far += value.len() as u32;
                values.extend(value);
            }
        }
        bytes.extend([0; 4]);
        bytes.extend(values);
        bytes
    }
}

/// Returns a PNG that is only a header: 8-bit grey, of this size.
pub fn png_of(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    drop(encoder.write_header().expect("a header"));
    bytes
}

/// Returns a PNG of these pixels.
pub fn png(width: u32, height: u32, kind: png::ColorType, pixels: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(kind);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(pixels).expect("pixels");
    writer.finish().expect("an end");
    bytes
}

/// Returns a BMP of `bits` per pixel with a palette; lines in the order of the file, each padded to four bytes.
pub fn bmp(width: i32, height: i32, bits: u16, palette: &[[u8; 4]], lines: &[u8]) -> Vec<u8> {
    let start = 54 + 4 * palette.len() as u32;
    let mut bytes = b"BM".to_vec();
    bytes.extend((start + lines.len() as u32).to_le_bytes());
    bytes.extend([0; 4]);
    bytes.extend(start.to_le_bytes());
    bytes.extend(40u32.to_le_bytes());
    bytes.extend(width.to_le_bytes());
    bytes.extend(height.to_le_bytes());
    bytes.extend(1u16.to_le_bytes());
    bytes.extend(bits.to_le_bytes());
    bytes.extend([0; 4]);
    bytes.extend((lines.len() as u32).to_le_bytes());
    bytes.extend([0; 16]);
    bytes.extend(palette.iter().flatten());
    bytes.extend(lines);
    bytes
}
