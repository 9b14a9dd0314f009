//! `sensors.current`: current of a motor or load, measured by a shunt and a converter.
//! ```text
//! x = (1 + gain_error) i + offset + n           n ~ N(0, σ²)
//! without `bits`:  reading = clamp(x, ±range)
//! with `bits`:     reading = code q,   q = 2 range/2^bits,   code = round(x/q), −2^(bits−1) … 2^(bits−1) − 1
//! ```
//! The codes are two's complement: zero is one of them, and the greatest reading is one step below the range.

use linkwork_runtime::prelude::*;

/// Errors, range and converter.
#[derive(Params, Clone, Debug)]
pub struct CurrentParams {
    /// Greatest current in both directions that it measures; default: no limit. A converter needs it.
    #[param(unit = "A", range = 1e-9..)]
    pub range: Option<f64>,
    /// Error that stays.
    #[param(unit = "A", default = 0.0)]
    pub offset: f64,
    /// Error proportional to the current.
    #[param(default = 0.0, range = -0.5..=0.5)]
    pub gain_error: f64,
    /// Standard deviation, a sample.
    #[param(unit = "A", default = 0.0, range = 0.0..)]
    pub sigma: f64,
    /// Bits of the converter over the whole range; default: no quantization.
    #[param(default = None)]
    pub bits: Option<u32>,
}

/// The measured current.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CurrentIn {
    /// The current.
    #[port("A")]
    pub current: f64,
}

/// Readings.
#[derive(Ports, Clone, Copy, Debug)]
pub struct CurrentOut {
    /// The current, with its errors.
    #[port("A")]
    pub reading: f64,
    /// The current is within the range.
    #[port]
    pub valid: bool,
}

/// A current sensor.
pub struct Current {
    p: CurrentParams,
    /// One step of the converter (A), and number of codes below zero.
    converter: Option<(f64, f64)>,
}

/// Current with offset, gain error, noise, range and quantization; sampled.
#[model("sensors.current")]
impl Model for Current {
    type Params = CurrentParams;
    type FeedthroughInputs = CurrentIn;
    type FeedthroughOutputs = CurrentOut;
    fn build(p: CurrentParams) -> Result<Self, BuildError> {
        if let Some(bits) = p.bits.filter(|b| !(1..=32).contains(b)) {
            let fact = format!("a converter with {bits} bits is not supported");
            return Err(BuildError::new(fact).help("write 1 to 32, or remove `bits`").at("bits"));
        }
        let half = p.bits.map(|bits| 2f64.powi(bits.cast_signed() - 1));
        let converter = match (half, p.range) {
            (None, _) => None,
            (Some(half), Some(range)) => Some((range / half, half)),
            (Some(_), None) => {
                let fact = "`bits` is written, but `range` is not written, which determines the resolution of the converter";
                let help = "write the greatest current, such as range: \"20 A\", or remove `bits`";
                return Err(BuildError::new(fact).help(help).at("bits"));
            }
        };
        Ok(Current { p, converter })
    }
    fn feedthrough(&self, clock: &Clock, u: &CurrentIn) -> CurrentOut {
        let p = &self.p;
        let noise = if p.sigma > 0.0 { p.sigma * clock.normal(0) } else { 0.0 };
        let x = (1.0 + p.gain_error) * u.current + p.offset + noise;
        let most = p.range.unwrap_or(f64::INFINITY);
        let reading = match self.converter {
            Some((step, half)) => (x / step).round().clamp(-half, half - 1.0) * step,
            None => x.clamp(-most, most),
        };
        CurrentOut { reading, valid: u.current.abs() <= most }
    }
    fn update(&self) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params() -> CurrentParams {
        CurrentParams { range: Some(10.0), offset: 0.0, gain_error: 0.0, sigma: 0.0, bits: None }
    }

    fn read(p: CurrentParams, current: f64, row: u64) -> CurrentOut {
        let m = Current::build(p).unwrap();
        m.feedthrough(&Clock::at(0.0, 0.1, row), &CurrentIn { current })
    }

    #[test]
    fn errors_are_those_that_were_written() {
        assert_eq!(read(params(), -3.7, 0).reading, -3.7);
        let p = CurrentParams { offset: 0.2, gain_error: -0.05, ..params() };
        assert!((read(p, 4.0, 0).reading - 4.0).abs() < 1e-12);
        // The mean of many samples is the current, their spread is sigma.
        let (n, mut sum, mut squares) = (4000, 0.0, 0.0);
        for row in 0..n {
            let x = read(CurrentParams { sigma: 0.3, ..params() }, 2.0, row).reading - 2.0;
            sum += x;
            squares += x * x;
        }
        let (mean, spread) = (sum / n as f64, (squares / n as f64).sqrt());
        assert!(mean.abs() < 0.02 && (spread - 0.3).abs() < 0.015, "{mean} {spread}");
    }

    #[test]
    fn beyond_the_range_it_stays_at_its_end_and_says_so() {
        for (current, reading, valid) in
            [(12.0, 10.0, false), (-10.5, -10.0, false), (10.0, 10.0, true)]
        {
            let y = read(params(), current, 0);
            assert_eq!((y.reading, y.valid), (reading, valid), "{current}");
        }
    }

    #[test]
    fn codes_are_whole_and_errors_half_a_step() {
        let step = 20.0 / 256.0;
        let coarse =
            |current| read(CurrentParams { bits: Some(8), ..params() }, current, 0).reading;
        for k in 0..400 {
            let current = -9.9 + 0.0495 * f64::from(k);
            let code = coarse(current) / step;
            assert!((code - code.round()).abs() < 1e-9, "{code}");
            assert!((coarse(current) - current).abs() <= 0.5 * step + 1e-12, "{code} {current}");
        }
        // A current of zero reads zero, and the largest readings are the limits of two's
        // complement.
        assert_eq!((coarse(0.0), coarse(-12.0), coarse(12.0)), (0.0, -10.0, 10.0 - step));
        for bits in [1, 2, 12, 32] {
            let p = CurrentParams { bits: Some(bits), ..params() };
            assert_eq!(read(p, 0.0, 0).reading, 0.0, "{bits} bits");
        }
        let free = CurrentParams { range: None, ..params() };
        assert_eq!(read(free.clone(), 1e7, 0).reading, 1e7);
        let e = Current::build(CurrentParams { bits: Some(12), ..free }).err().unwrap();
        assert!(e.param.as_deref() == Some("bits") && e.help.unwrap().contains("range"));
        for bits in [0, 33] {
            let e = Current::build(CurrentParams { bits: Some(bits), ..params() }).err().unwrap();
            assert!(e.param.as_deref() == Some("bits") && e.help.is_some());
        }
    }
}
