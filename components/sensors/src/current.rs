//! `sensors.current`: current of a motor or of a load by a shunt and a converter.
//! ```text
//! x = (1 + gain_error) i + offset + n           n ~ N(0, σ²)
//! reading = clamp(x, ±range), in steps of 2 range/(2^bits − 1) where `bits` are written
//! ```

use linkwork_runtime::prelude::*;

/// Errors, range and converter.
#[derive(Params, Clone, Debug)]
pub struct CurrentParams {
    /// Greatest current that it shows, both ways.
    #[param(unit = "A", default = 1e9, range = 1e-9..)]
    pub range: f64,
    /// Error that stays.
    #[param(unit = "A", default = 0.0)]
    pub offset: f64,
    /// Error in proportion to the current.
    #[param(default = 0.0, range = -0.5..=0.5)]
    pub gain_error: f64,
    /// Standard deviation, a sample.
    #[param(unit = "A", default = 0.0, range = 0.0..)]
    pub sigma: f64,
    /// Bits of the converter over the whole range; as fine as numbers are where it is not written.
    #[param(default = None)]
    pub bits: Option<u32>,
}

/// What it measures.
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
    /// One step of the converter, A.
    step: Option<f64>,
}

/// Current with offset, error of gain, noise, range and the steps of a converter; sampled.
#[model("sensors.current")]
impl Model for Current {
    type Params = CurrentParams;
    type Ud = CurrentIn;
    type Yd = CurrentOut;
    fn build(p: CurrentParams) -> Result<Self, BuildError> {
        if let Some(bits) = p.bits.filter(|b| !(1..=32).contains(b)) {
            let fact = format!("a converter of {bits} bits");
            return Err(BuildError::new(fact).help("write 1 to 32, or leave it out").at("bits"));
        }
        let step = p.bits.map(|bits| 2.0 * p.range / (2f64.powi(bits.cast_signed()) - 1.0));
        Ok(Current { p, step })
    }
    fn direct(&self, c: &Clock, _: &(), _: &(), u: &CurrentIn) -> CurrentOut {
        let p = &self.p;
        let noise = if p.sigma > 0.0 { p.sigma * c.normal(0) } else { 0.0 };
        let x = (1.0 + p.gain_error) * u.current + p.offset + noise;
        let within = x.clamp(-p.range, p.range);
        // Codes count from the lower end.
        let code = |step: f64| ((within + p.range) / step).round() * step - p.range;
        CurrentOut { reading: self.step.map_or(within, code), valid: u.current.abs() <= p.range }
    }
    fn update(&self, _: &Clock, _: &(), _: &(), _: &()) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params() -> CurrentParams {
        CurrentParams { range: 10.0, offset: 0.0, gain_error: 0.0, sigma: 0.0, bits: None }
    }

    fn read(p: CurrentParams, current: f64, row: u64) -> CurrentOut {
        let m = Current::build(p).unwrap();
        m.direct(&Clock::at(0.0, 0.1, row), &(), &(), &CurrentIn { current }, &())
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
        let step = 20.0 / 255.0;
        for k in 0..400 {
            let current = -9.9 + 0.0497 * f64::from(k);
            let reading = read(CurrentParams { bits: Some(8), ..params() }, current, 0).reading;
            let code = (reading + 10.0) / step;
            assert!((code - code.round()).abs() < 1e-9, "{reading}");
            assert!((reading - current).abs() <= 0.5 * step + 1e-12, "{reading} {current}");
        }
        for bits in [0, 33] {
            let e = Current::build(CurrentParams { bits: Some(bits), ..params() }).err().unwrap();
            assert!(e.param.as_deref() == Some("bits") && e.help.is_some());
        }
    }
}
