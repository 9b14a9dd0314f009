//! Detector: converts radiance to digital numbers, with exposure, photon noise, read noise, gain and quantization.
//! ```text
//! N̄ = S L t + D t                expected electrons: sensitivity, radiance, exposure, dark current
//! N ~ Poisson(N̄), at most the well; N + σ_r n,  n ~ N(0, 1)
//! DN = clamp(round((N + noise)/g + offset), 0, 2^bits − 1)
//! ```
//! Poisson samples are exact below 30 electrons (inversion); above, they are rounded normal samples with the same mean and variance. Each sample is a
//! pure function of (key, frame, pixel, channel), so the result does not depend on threads or the order of pixels.

use crate::camera::Frame;
use crate::error::{RenderError, number};
use crate::light::luminance;
use linkwork_runtime::noise;
use serde::{Deserialize, Serialize};

/// Colour channels of the pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// One channel: the luminance of Rec. 709, 0.2126 R + 0.7152 G + 0.0722 B.
    Mono,
    /// Three channels in every pixel: red, green, blue.
    Rgb,
}

/// A detector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detector {
    /// One channel or three.
    pub channels: Channels,
    /// Bits of a digital number: 8 to 16.
    pub bits: u32,
    /// Exposure t, s.
    pub exposure: f64,
    /// Sensitivity S, electrons per second and W/(m² sr).
    pub sensitivity: f64,
    /// Gain g, electrons per digital number.
    pub gain: f64,
    /// Digital number of a dark pixel.
    pub offset: f64,
    /// Full well capacity of a pixel, electrons.
    pub well: f64,
    /// Standard deviation of the read noise σ_r, electrons.
    pub read_noise: f64,
    /// Dark current D, electrons per second.
    pub dark_current: f64,
    /// Whether noise is simulated.
    pub noise: Noise,
}

/// Noise of a detector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Noise {
    /// No noise: every number is the expected value.
    Off,
    /// Photon noise and read noise.
    On,
}

impl Default for Detector {
    /// 12 bits mono, with a full well of 50 000 electrons, which 130 W/(m² sr) fill in 10 ms. This is about the radiance of a white surface that
    /// faces the Sun of [`Light::default`](crate::Light).
    fn default() -> Self {
        Self {
            channels: Channels::Mono,
            bits: 12,
            exposure: 0.01,
            sensitivity: 50_000.0 / (130.0 * 0.01),
            gain: 50_000.0 / 4095.0,
            offset: 0.0,
            well: 50_000.0,
            read_noise: 12.0,
            dark_current: 20.0,
            noise: Noise::On,
        }
    }
}

/// Digital numbers of a detector, row by row from the top, with the channels of a pixel together.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Image {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Channels per pixel: 1 or 3.
    pub channels: usize,
    /// Bits of a digital number.
    pub bits: u32,
    /// The digital numbers.
    pub data: Vec<u16>,
}

impl Detector {
    /// Checks the parameters of the detector.
    ///
    /// # Errors
    /// A number of bits that is not supported, a negative or infinite number.
    pub fn check(&self) -> Result<(), RenderError> {
        let positive = "it must be positive";
        number(
            "bits of a number",
            f64::from(self.bits),
            |b| (8.0..=16.0).contains(&b),
            "write 8 to 16",
        )?;
        number("exposure (s)", self.exposure, |v| v > 0.0, positive)?;
        number("sensitivity", self.sensitivity, |v| v > 0.0, positive)?;
        number("gain (electrons per number)", self.gain, |v| v > 0.0, positive)?;
        number("well (electrons)", self.well, |v| v > 0.0, positive)?;
        for (what, v) in [
            ("offset", self.offset),
            ("read noise (electrons)", self.read_noise),
            ("dark current (electrons per second)", self.dark_current),
        ] {
            number(what, v, |v| v >= 0.0, "it must not be negative")?;
        }
        Ok(())
    }

    /// Computes the image of a frame with radiance. `key` and `count` (the index of the frame) select the noise.
    ///
    /// # Errors
    /// Invalid detector parameters, or a frame without radiance.
    pub fn read(&self, frame: &Frame, key: u64, count: u64) -> Result<Image, RenderError> {
        self.check()?;
        if frame.radiance.len() != frame.width * frame.height {
            let (what, help) =
                ("number of pixels with radiance", "render the frame with `Want::Radiance`");
            return Err(RenderError::Number { what, value: frame.radiance.len() as f64, help });
        }
        let channels = match self.channels {
            Channels::Mono => 1,
            Channels::Rgb => 3,
        };
        let mut data = Vec::with_capacity(frame.radiance.len() * channels);
        for rgb in &frame.radiance {
            let [r, g, b] = rgb.map(f64::from);
            match self.channels {
                Channels::Mono => {
                    let lane = data.len() as u32;
                    data.push(self.number(luminance([r, g, b]), key, count, lane));
                }
                Channels::Rgb => {
                    for v in [r, g, b] {
                        let lane = data.len() as u32;
                        data.push(self.number(v, key, count, lane));
                    }
                }
            }
        }
        let Frame { width, height, .. } = *frame;
        Ok(Image { width, height, channels, bits: self.bits, data })
    }

    fn number(&self, radiance: f64, key: u64, count: u64, lane: u32) -> u16 {
        let mean = (self.sensitivity * radiance + self.dark_current) * self.exposure;
        let electrons = match self.noise {
            Noise::Off => mean.min(self.well),
            Noise::On => {
                let caught = poisson(mean, key, count, lane).min(self.well);
                // Use a separate key, so that photon noise and read noise are independent.
                caught + self.read_noise * noise::normal(!key, count, lane)
            }
        };
        let top = f64::from((1u32 << self.bits) - 1);
        (electrons / self.gain + self.offset).round().clamp(0.0, top) as u16
    }
}

/// Returns a Poisson sample.
fn poisson(mean: f64, key: u64, count: u64, lane: u32) -> f64 {
    const FEW: f64 = 30.0;
    if mean >= FEW {
        return (mean + mean.sqrt() * noise::normal(key, count, lane)).round().max(0.0);
    }
    let u = noise::uniform(key, count, lane);
    let mut term = (-mean).exp();
    let (mut sum, mut k) = (term, 0.0);
    // The tail beyond 200 is below 1e-80.
    while u > sum && k < 200.0 {
        k += 1.0;
        term *= mean / k;
        sum += term;
    }
    k
}
