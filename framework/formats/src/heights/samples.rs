//! Binary arrays of samples: integers and floating-point numbers of either byte order.

use super::{HeightsError, bounded, datum};

/// Type of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sample {
    Unsigned(usize),
    Signed(usize),
    Real(usize),
}

impl Sample {
    pub fn bytes(self) -> usize {
        match self {
            Sample::Unsigned(n) | Sample::Signed(n) | Sample::Real(n) => n,
        }
    }
}

/// Order of bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Order {
    Big,
    Little,
}

/// The side of the first line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum First {
    North,
    South,
}

/// Layout of the samples in a file.
#[derive(Clone, Debug)]
pub(super) struct Array {
    pub sample: Sample,
    pub order: Order,
    /// Offset of the first line.
    pub start: u64,
    pub lines: u64,
    pub columns: u64,
    /// Bytes before and after the samples of a line.
    pub around: [u64; 2],
    pub first: First,
    /// Values that mean missing data.
    pub missing: Vec<Missing>,
    /// h = scale · sample + offset (m).
    pub scale: f64,
    pub offset: f64,
}

/// A value that means missing data, as in labels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Missing {
    /// Samples equal to a value.
    Value(f64),
    /// The bits, as an integer.
    Bits(u64),
}

impl Missing {
    /// Reads `-32768`, `-3.4028227e+38`, `16#FF7FFFFB#` or `0xFF7FFFFB`.
    pub fn parse(text: &str) -> Option<Missing> {
        let text = text.trim().trim_matches('"');
        let bits = |digits: &str| u64::from_str_radix(digits, 16).ok().map(Missing::Bits);
        if let Some(digits) = text.strip_prefix("16#") {
            return bits(digits.trim_end_matches('#'));
        }
        if let Some(digits) = text.strip_prefix("0x").or(text.strip_prefix("0X")) {
            return bits(digits);
        }
        text.parse().ok().map(Missing::Value)
    }

    fn is(self, value: f64, bits: u64) -> bool {
        match self {
            // A 32-bit number that is written as text often has too many or too few digits.
            Missing::Value(m) => value == m || value as f32 == m as f32,
            Missing::Bits(b) => bits == b,
        }
    }
}

/// Returns the value and the bits of the sample in `raw`.
fn one(raw: &[u8], sample: Sample, order: Order) -> (f64, u64) {
    let mut bits = 0_u64;
    for k in 0..raw.len() {
        let byte = match order {
            Order::Big => raw[k],
            Order::Little => raw[raw.len() - 1 - k],
        };
        bits = bits << 8 | u64::from(byte);
    }
    let value = match sample {
        Sample::Unsigned(_) => bits as f64,
        Sample::Signed(n) => {
            let up = 64 - 8 * n as u32;
            (((bits << up) as i64) >> up) as f64
        }
        Sample::Real(4) => f64::from(f32::from_bits(bits as u32)),
        Sample::Real(_) => f64::from_bits(bits),
    };
    (value, bits)
}

/// Returns the heights of an array above a datum (m), the southern row first, and the datum.
pub(super) fn heights(bytes: &[u8], array: &Array) -> Result<(Vec<f32>, f64), HeightsError> {
    let (nx, ny) = (array.columns, array.lines);
    bounded(bytes.len() as u64, nx, ny, 1)?;
    let size = array.sample.bytes();
    let [before, behind] = array.around;
    let line = before.saturating_add(behind).saturating_add(nx * size as u64);
    let end = line.saturating_mul(ny).saturating_add(array.start);
    if end > bytes.len() as u64 {
        return Err(HeightsError::Short { bytes: bytes.len() as u64, nx, ny });
    }
    let (nx, ny) = (nx as usize, ny as usize);
    let (mut heights, mut datum) = (vec![0.0; nx * ny], None);
    for k in 0..ny {
        let at = (array.start + k as u64 * line + before) as usize;
        let j = if array.first == First::North { ny - 1 - k } else { k };
        for i in 0..nx {
            let raw = &bytes[at + i * size..at + (i + 1) * size];
            let (value, bits) = one(raw, array.sample, array.order);
            let gone = !value.is_finite() || array.missing.iter().any(|m| m.is(value, bits));
            let h = value * array.scale + array.offset;
            heights[j * nx + i] = match gone {
                true => f32::NAN,
                false => (h - *datum.get_or_insert_with(|| datum::of(h))) as f32,
            };
        }
    }
    Ok((heights, datum.unwrap_or(0.0)))
}
