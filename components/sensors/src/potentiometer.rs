//! `sensors.potentiometer`: absolute angle of a joint, measured by a resistive track and a converter.
//! ```text
//! x = (q + n − lower)/(upper − lower)          n ~ N(0, σ²);  x within 0 … 1: beyond the ends of the track the wiper stays at them
//! code = round(x · 2^bits), 2^bits − 1 at most    without `bits` every x
//! angle = lower + (upper − lower) · code/2^bits
//! ```
//! One code is at the middle of the track, so that the middle of a symmetric track reads zero; the greatest angle is one step below the upper end.

use linkwork_runtime::prelude::*;

/// Track, converter and noise.
#[derive(Params, Clone, Debug)]
pub struct PotentiometerParams {
    /// Angle at the lower end of the track.
    #[param(unit = "rad", slider = "m", default = -2.967)]
    pub lower: f64,
    /// Angle at the upper end of the track.
    #[param(unit = "rad", slider = "m", default = 2.967)]
    pub upper: f64,
    /// Bits of the converter; default: no quantization.
    #[param(default = None)]
    pub bits: Option<u32>,
    /// Standard deviation of the wiper's noise per sample.
    #[param(unit = "rad", slider = "m", default = 0.0, range = 0.0..)]
    pub sigma: f64,
}

/// The joint.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PotentiometerIn {
    /// The joint.
    #[port(bind = "shaft")]
    pub shaft: HingeState,
}

/// Readings.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PotentiometerOut {
    /// Angle of the code.
    #[port("rad", slider = "m")]
    pub angle: f64,
    /// Converted position of the wiper on the track, 0 to 1.
    #[port("1")]
    pub ratio: f64,
    /// The joint is on the track.
    #[port]
    pub valid: bool,
}

/// A potentiometer.
pub struct Potentiometer {
    p: PotentiometerParams,
    /// Number of steps of the converter over the track.
    steps: Option<f64>,
}

/// Absolute angle of a joint within the ends of a track, with noise and quantization; sampled.
#[model("sensors.potentiometer")]
impl Model for Potentiometer {
    type Params = PotentiometerParams;
    type FeedthroughInputs = PotentiometerIn;
    type FeedthroughOutputs = PotentiometerOut;
    fn build(p: PotentiometerParams) -> Result<Self, BuildError> {
        if !(p.upper > p.lower) || !(p.upper - p.lower).is_finite() {
            let fact = format!(
                "`upper` is {} rad, but it must be above `lower` = {} rad",
                p.upper, p.lower
            );
            return Err(BuildError::new(fact)
                .help("write finite angles, with `lower` below `upper`")
                .at("upper"));
        }
        if let Some(bits) = p.bits.filter(|b| !(1..=32).contains(b)) {
            let fact = format!("a converter with {bits} bits is not supported");
            return Err(BuildError::new(fact).help("write 1 to 32, or remove `bits`").at("bits"));
        }
        let steps = p.bits.map(|bits| 2f64.powi(bits.cast_signed()));
        Ok(Potentiometer { p, steps })
    }
    fn feedthrough(&self, clock: &Clock, u: &PotentiometerIn) -> PotentiometerOut {
        let p = &self.p;
        let noise = if p.sigma > 0.0 { p.sigma * clock.normal(0) } else { 0.0 };
        let place = (u.shaft.angle + noise - p.lower) / (p.upper - p.lower);
        let place = place.clamp(0.0, 1.0);
        let ratio = self
            .steps
            .map_or(place, |steps| (place * steps).round().clamp(0.0, steps - 1.0) / steps);
        let valid = (p.lower..=p.upper).contains(&u.shaft.angle);
        PotentiometerOut { angle: p.lower + (p.upper - p.lower) * ratio, ratio, valid }
    }
    fn update(&self) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params(bits: Option<u32>, sigma: f64) -> PotentiometerParams {
        PotentiometerParams { lower: -1.0, upper: 2.0, bits, sigma }
    }

    fn read(m: &Potentiometer, angle: f64, row: u64) -> PotentiometerOut {
        let shaft = HingeState { angle, rate: 0.3 };
        m.feedthrough(&Clock::at(0.0, 0.1, row), &PotentiometerIn { shaft })
    }

    #[test]
    fn codes_are_whole_and_errors_half_a_step() {
        let m = Potentiometer::build(params(Some(10), 0.0)).unwrap();
        let step = 3.0 / 1024.0;
        let mut worst = 0.0_f64;
        for k in 0..2998 {
            let angle = -1.0 + f64::from(k) * 1e-3;
            let y = read(&m, angle, 0);
            let code = y.ratio * 1024.0;
            assert!((code - code.round()).abs() < 1e-9 && y.valid, "{code}");
            let error = (y.angle - angle).abs();
            assert!(error <= 0.5 * step + 1e-12, "{error}");
            worst = worst.max(error);
        }
        assert!(worst > 0.45 * step, "{worst}");
        assert_eq!(read(&m, 0.5, 0).angle, 0.5);
        assert!((read(&m, 2.0, 0).angle - (2.0 - step)).abs() < 1e-12);
        let exact = Potentiometer::build(params(None, 0.0)).unwrap();
        assert!((read(&exact, 0.123_456, 0).angle - 0.123_456).abs() < 1e-15);
    }

    #[test]
    fn beyond_its_ends_it_stays_there_and_says_so() {
        let m = Potentiometer::build(params(Some(12), 0.0)).unwrap();
        for (angle, shown) in [(2.5, 2.0 - 3.0 / 4096.0), (-1.001, -1.0)] {
            let y = read(&m, angle, 0);
            assert!((y.angle - shown).abs() < 1e-12 && !y.valid, "{}", y.angle);
        }
    }

    #[test]
    fn its_noise_has_its_deviation_and_nonsense_is_refused() {
        let m = Potentiometer::build(params(None, 0.01)).unwrap();
        let n = 4000_u64;
        let mean_square: f64 =
            (0..n).map(|row| (read(&m, 0.5, row).angle - 0.5).powi(2)).sum::<f64>() / n as f64;
        let ratio = mean_square / 1e-4;
        assert!((ratio - 1.0).abs() < 4.0 * (2.0 / n as f64).sqrt(), "{ratio}");
        let turned = PotentiometerParams { lower: 1.0, ..params(None, 0.0) };
        let turned = PotentiometerParams { upper: 1.0, ..turned };
        let e = Potentiometer::build(turned).err().unwrap();
        assert!(e.param.as_deref() == Some("upper") && e.help.is_some());
        for bits in [0, 33] {
            let e = Potentiometer::build(params(Some(bits), 0.0)).err().unwrap();
            assert!(e.param.as_deref() == Some("bits") && e.help.is_some());
        }
    }
}
