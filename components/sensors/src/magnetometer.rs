//! `sensors.magnetometer`: the magnetic field in the axes of its mount, with the errors of a triad.
//! ```text
//! h = Rᵀ B + (`disturbance`: field of the vehicle's own currents)
//! m = (1 + s) (h + μ × h) + b₀ + b + n       s: scale by axis, μ: misalignment, b₀: known bias (hard iron)
//! b: drawn once from its spread by the run's seed            n ~ N(0, σ²), anew for each axis and sample
//! reading: limited to ± `limit`, rounded to a multiple of the resolution
//! ```

use linkwork_runtime::prelude::*;

/// Errors.
#[derive(Params, Clone, Debug)]
pub struct MagnetometerParams {
    /// Standard deviation of the noise of a sample.
    #[param(unit = "T", default = 1e-8, range = 0.0..)]
    pub sigma: f64,
    /// Known bias b₀, axes of the mount.
    #[param(unit = "T", default = Vec3::zeros())]
    pub bias: Vec3,
    /// Standard deviation of the unknown bias b.
    #[param(unit = "T", default = 1e-7, range = 0.0..)]
    pub bias_spread: f64,
    /// Scale error of each axis.
    #[param(default = Vec3::zeros())]
    pub scale: Vec3,
    /// Misalignment as a small rotation, axes of the mount.
    #[param(unit = "rad", default = Vec3::zeros())]
    pub misalignment: Vec3,
    /// Maximum reading.
    #[param(unit = "T", default = 1e-4, range = 1e-12..)]
    pub limit: f64,
    /// Resolution of the reading; 0: no quantization.
    #[param(unit = "T", default = 0.0, range = 0.0..)]
    pub resolution: f64,
}

/// Mount and field.
#[derive(Ports, Clone, Copy, Debug)]
pub struct MagnetometerIn {
    /// The instrument.
    #[port(bind = "mount")]
    pub mount: NodeState,
    /// Flux density, W.
    #[port("T")]
    pub field: Vec3,
    /// Field of the vehicle itself, axes of the mount.
    #[port("T", default = Vec3::zeros())]
    pub disturbance: Vec3,
}

/// Reading.
#[derive(Ports, Clone, Copy, Debug)]
pub struct MagnetometerOut {
    /// Flux density, axes of the mount.
    #[port("T")]
    pub measured: Vec3,
    /// An axis is at its limit.
    #[port]
    pub saturated: bool,
}

/// Bias.
#[derive(State, Clone, Copy, Debug)]
pub struct Biased {
    /// Unknown bias, in units of its standard deviation.
    #[port("1")]
    pub first: Vec3,
    /// The bias has been drawn.
    #[port]
    pub drawn: bool,
}

/// A magnetometer.
pub struct Magnetometer {
    p: MagnetometerParams,
}

impl Magnetometer {
    /// Returns the bias of this run, drawn at its first sample.
    fn drawn(c: &Clock, d: &Biased) -> Vec3 {
        if d.drawn { d.first } else { Vec3::new(c.normal(3), c.normal(4), c.normal(5)) }
    }
}

/// The magnetic field by three axes with bias, scale, misalignment, noise and limits; sampled.
#[model("sensors.magnetometer")]
impl Model for Magnetometer {
    type Params = MagnetometerParams;
    type FeedthroughInputs = MagnetometerIn;
    type FeedthroughOutputs = MagnetometerOut;
    type DiscreteState = Biased;
    fn build(p: MagnetometerParams) -> Result<Self, BuildError> {
        if p.scale.iter().any(|s| !(s.abs() < 1.0)) {
            return Err(BuildError::new("a scale error is not within ± 1")
                .help("scale errors are relative: 0.01 means 1 %")
                .at("scale"));
        }
        Ok(Magnetometer { p })
    }
    fn feedthrough(&self, clock: &Clock, d: &Biased, u: &MagnetometerIn) -> MagnetometerOut {
        let p = &self.p;
        let h = u.mount.rotation.inverse() * u.field + u.disturbance;
        let turned = h + p.misalignment.cross(&h);
        let noise = match p.sigma > 0.0 {
            true => Vec3::new(clock.normal(0), clock.normal(1), clock.normal(2)) * p.sigma,
            false => Vec3::zeros(),
        };
        let bias = p.bias + Self::drawn(clock, d) * p.bias_spread;
        let whole = turned + turned.component_mul(&p.scale) + bias + noise;
        let cut = whole.map(|x| x.clamp(-p.limit, p.limit));
        let step = p.resolution;
        let measured = if step > 0.0 { cut.map(|x| (x / step).round() * step) } else { cut };
        MagnetometerOut { measured, saturated: cut != whole }
    }
    fn update(&self, clock: &Clock, d: &Biased) -> Biased {
        Biased { first: Self::drawn(clock, d), drawn: true }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params() -> MagnetometerParams {
        MagnetometerParams {
            sigma: 0.0,
            bias: Vec3::zeros(),
            bias_spread: 0.0,
            scale: Vec3::zeros(),
            misalignment: Vec3::zeros(),
            limit: 1e-4,
            resolution: 0.0,
        }
    }

    const FIELD: [f64; 3] = [2.1e-5, -0.7e-5, 3.3e-5];

    fn turned() -> Quat {
        Quat::from_scaled_axis(Vec3::new(0.7, -0.3, 1.2))
    }

    /// Samples of a run, one after another.
    fn series(p: MagnetometerParams, disturbance: Vec3, count: u64) -> Vec<MagnetometerOut> {
        let m = Magnetometer::build(p).unwrap();
        let mount = NodeState { rotation: turned(), ..NodeState::identity() };
        let u = MagnetometerIn { mount, field: Vec3::from(FIELD), disturbance };
        let mut d = Biased::zero();
        let one = |n| {
            let c = Clock::at(0.1 * n as f64, 0.1, n);
            let y = m.feedthrough(&c, &d, &u);
            d = m.update(&c, &d);
            y
        };
        (0..count).map(one).collect()
    }

    #[test]
    fn it_shows_the_field_in_its_axes_with_scale_misalignment_and_bias() {
        let none = Vec3::zeros();
        let h = turned().inverse() * Vec3::from(FIELD);
        assert!((series(params(), none, 1)[0].measured - h).norm() < 1e-20);
        let (scale, bias) = (Vec3::new(0.01, -0.02, 0.005), Vec3::new(3e-7, 0.0, -2e-7));
        let (misalignment, own) = (Vec3::new(1e-3, 2e-3, -3e-3), Vec3::new(0.0, 4e-7, 1e-7));
        let p = MagnetometerParams { scale, bias, misalignment, ..params() };
        let y = series(p, own, 1)[0].measured;
        let (x, h) = (misalignment, h + own);
        let skewed = Vec3::new(
            h.x + x.y * h.z - x.z * h.y,
            h.y + x.z * h.x - x.x * h.z,
            h.z + x.x * h.y - x.y * h.x,
        );
        for k in 0..3 {
            let want = (1.0 + scale[k]) * skewed[k] + bias[k];
            assert!((y[k] - want).abs() < 1e-19, "{k}: {} {want}", y[k]);
        }
    }

    #[test]
    fn its_noise_has_its_deviation_and_its_bias_is_one_for_a_run() {
        let p = MagnetometerParams { sigma: 2e-8, bias_spread: 1e-6, ..params() };
        let all = series(p, Vec3::zeros(), 8000);
        let h = turned().inverse() * Vec3::from(FIELD);
        let n = all.len() as f64;
        let mean = all.iter().fold(Vec3::zeros(), |sum, y| sum + (y.measured - h) / n);
        for k in 0..3 {
            let square = all.iter().map(|y| (y.measured[k] - h[k] - mean[k]).powi(2)).sum::<f64>();
            let ratio = square / n / (2e-8 * 2e-8);
            // The bound is four standard errors of a variance.
            assert!((ratio - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{k}: {ratio}");
        }
        // The bias does not average out, and equals the bias of the first sample.
        assert!(mean.norm() > 1e-7 && mean.amax() < 5e-6, "{mean}");
        let first = series(MagnetometerParams { bias_spread: 1e-6, ..params() }, Vec3::zeros(), 9);
        assert!(first.iter().all(|y| y.measured == first[0].measured));
        assert!((first[0].measured - h - mean).norm() < 2e-9);
    }

    #[test]
    fn it_ends_at_its_limit_and_counts_in_steps() {
        let p = MagnetometerParams { limit: 2e-5, resolution: 5e-8, ..params() };
        let y = series(p, Vec3::zeros(), 1)[0];
        let h = turned().inverse() * Vec3::from(FIELD);
        assert!(y.saturated && h.amax() > 2e-5, "{h}");
        for k in 0..3 {
            let want = h[k].clamp(-2e-5, 2e-5);
            assert!((y.measured[k] - want).abs() <= 2.5e-8 + 1e-18, "{k}");
            let steps = y.measured[k] / 5e-8;
            assert!((steps - steps.round()).abs() < 1e-9);
        }
        assert!(!series(params(), Vec3::zeros(), 1)[0].saturated);
        let scale = Vec3::new(0.0, -1.5, 0.0);
        let e = Magnetometer::build(MagnetometerParams { scale, ..params() }).err().unwrap();
        assert!(e.param.as_deref() == Some("scale") && e.help.is_some());
    }
}
