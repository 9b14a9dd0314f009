//! Images as PNG files. 8-bit numbers are written unchanged; numbers with more bits are written with 16 bits and scaled so that full scale is white.

use crate::detector::Image;
use crate::error::RenderError;
use std::io::Write;
use std::path::Path;

impl Image {
    /// Writes the image as PNG, grey or RGB.
    ///
    /// # Errors
    /// The error of the encoder or the writer, as text.
    pub fn png(&self, to: impl Write) -> Result<(), String> {
        if !(8..=16).contains(&self.bits) {
            return Err(format!("numbers of {} bits are not supported: use 8 to 16", self.bits));
        }
        let size = |n: usize| u32::try_from(n).map_err(|e| e.to_string());
        let mut encoder = png::Encoder::new(to, size(self.width)?, size(self.height)?);
        encoder.set_color(if self.channels == 3 {
            png::ColorType::Rgb
        } else {
            png::ColorType::Grayscale
        });
        let eight = self.bits == 8;
        encoder.set_depth(if eight { png::BitDepth::Eight } else { png::BitDepth::Sixteen });
        let bytes: Vec<u8> = match eight {
            true => self.data.iter().map(|v| *v as u8).collect(),
            false => self.data.iter().flat_map(|v| self.wide(*v).to_be_bytes()).collect(),
        };
        let mut writer = encoder.write_header().map_err(|e| e.to_string())?;
        writer.write_image_data(&bytes).map_err(|e| e.to_string())?;
        writer.finish().map_err(|e| e.to_string())
    }

    /// Expands a number of `bits` bits to 16: shifted, with the upper bits repeated below.
    fn wide(&self, v: u16) -> u16 {
        let shift = 16 - self.bits;
        v << shift | v.checked_shr(self.bits - shift).unwrap_or(0)
    }

    /// Writes the image to a PNG file.
    ///
    /// # Errors
    /// [`RenderError::File`].
    pub fn write_png(&self, path: &Path) -> Result<(), RenderError> {
        let fault = |fact: String| RenderError::File { file: path.display().to_string(), fact };
        let file = std::fs::File::create(path).map_err(|e| fault(e.to_string()))?;
        let mut file = std::io::BufWriter::new(file);
        self.png(&mut file).map_err(fault)?;
        file.flush().map_err(|e| fault(e.to_string()))
    }
}
