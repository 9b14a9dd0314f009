//! `control.phase_plane`: thrusters about one axis, switched by lines in the plane of angle and rate.
//! ```text
//! s = e + k ω        on towards zero when |s| > deadband, off when |s| < hysteresis · deadband
//! a jet that is on stays on for `minimum` s at least: the minimum impulse bit
//! limit cycle: one shortest pulse at each side, rate = M · minimum/(2 J)
//! ```
//! `control.pulse_width` computes the on-time of a thruster within a period: |M|/M_jet · Δt, or zero if this is below the minimum.

use linkwork_runtime::prelude::*;

/// Switching lines.
#[derive(Params, Clone, Debug)]
pub struct PhasePlaneParams {
    /// Half width of the deadband.
    #[param(unit = "rad", range = 0.0..)]
    pub deadband: f64,
    /// Weight k of the rate.
    #[param(unit = "s", default = 1.0, range = 0.0..)]
    pub rate_weight: f64,
    /// Fraction of the deadband below which a jet is switched off.
    #[param(default = 0.8, range = 0.0..=1.0)]
    pub hysteresis: f64,
    /// Minimum on-time.
    #[param(unit = "s", default = 0.0, range = 0.0..)]
    pub minimum: f64,
}

/// Errors of angle and rate.
#[derive(Ports, Clone, Copy, Debug)]
pub struct AxisIn {
    /// Angle error.
    #[port("rad")]
    pub angle: f64,
    /// Rate error.
    #[port("rad/s")]
    pub rate: f64,
}

/// Jets.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Jets {
    /// Jet with positive torque: 1 on, 0 off.
    #[port("1")]
    pub forward: f64,
    /// Jet with negative torque: 1 on, 0 off.
    #[port("1")]
    pub backward: f64,
    /// Number of pulses.
    #[port("1")]
    pub pulses: f64,
}

/// State of the jets.
#[derive(State, Clone, Copy, Debug)]
pub struct Firing {
    /// 1 forwards, −1 backwards, 0 off.
    #[port("1")]
    pub jet: f64,
    /// Time since which it is on.
    #[port("s")]
    pub since: f64,
    /// Number of pulses.
    #[port("1")]
    pub pulses: f64,
}

/// Phase-plane logic.
pub struct PhasePlane {
    p: PhasePlaneParams,
}

impl PhasePlane {
    fn decide(&self, c: &Clock, d: &Firing, u: &AxisIn) -> Firing {
        let p = &self.p;
        let s = u.angle + p.rate_weight * u.rate;
        let stays = d.jet != 0.0 && c.t < d.since + p.minimum - 1e-9;
        let wanted = if s.abs() > p.deadband {
            -s.signum()
        } else if d.jet * s < 0.0 && s.abs() >= p.hysteresis * p.deadband {
            d.jet
        } else {
            0.0
        };
        if stays || wanted == d.jet {
            return *d;
        }
        Firing { jet: wanted, since: c.t, pulses: d.pulses + f64::from(u8::from(wanted != 0.0)) }
    }
}

/// Phase-plane control of thrusters about one axis, with hysteresis and a minimum pulse; sampled.
#[model("control.phase_plane")]
impl Model for PhasePlane {
    type Params = PhasePlaneParams;
    type FeedthroughInputs = AxisIn;
    type FeedthroughOutputs = Jets;
    type DiscreteState = Firing;
    fn feedthrough(&self, clock: &Clock, d: &Firing, u: &AxisIn) -> Jets {
        let f = self.decide(clock, d, u);
        Jets { forward: f.jet.max(0.0), backward: (-f.jet).max(0.0), pulses: f.pulses }
    }
    fn update(&self, clock: &Clock, d: &Firing, u: &AxisIn) -> Firing {
        self.decide(clock, d, u)
    }
}

/// A jet and its period.
#[derive(Params, Clone, Debug)]
pub struct PulseWidthParams {
    /// Torque of the jet.
    #[param(unit = "N m", range = 1e-9..)]
    pub jet: f64,
    /// Minimum pulse; shorter pulses are not fired.
    #[param(unit = "s", default = 0.0, range = 0.0..)]
    pub minimum: f64,
}

/// Command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PulseIn {
    /// Commanded mean torque about the axis over the period.
    #[port("N m")]
    pub torque: f64,
}

/// Pulse widths.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PulseOut {
    /// On-time of the forward jet in this period.
    #[port("s")]
    pub forward: f64,
    /// On-time of the backward jet in this period.
    #[port("s")]
    pub backward: f64,
}

/// Impulse that was not fired.
#[derive(State, Clone, Copy, Debug)]
pub struct Rest {
    /// Impulse that was too small for a pulse and is carried to the next period.
    #[port("N m s")]
    pub impulse: f64,
}

/// Pulse-width logic.
pub struct PulseWidth {
    p: PulseWidthParams,
}

impl PulseWidth {
    fn width(&self, c: &Clock, d: &Rest, u: &PulseIn) -> (f64, f64) {
        let wanted = u.torque * c.dt + d.impulse;
        let width = (wanted.abs() / self.p.jet).min(c.dt);
        let width = if width < self.p.minimum { 0.0 } else { width };
        let signed = width * wanted.signum();
        let left = wanted - signed * self.p.jet;
        // Discard impulse beyond a full period, so that it does not accumulate.
        if width >= c.dt {
            return (signed, 0.0);
        }
        (signed, left.clamp(-self.p.jet * self.p.minimum, self.p.jet * self.p.minimum))
    }
}

/// Pulse-width modulation: on-times of two jets in each period for a mean torque; impulse that is too small for a pulse is carried over; sampled.
#[model("control.pulse_width")]
impl Model for PulseWidth {
    type Params = PulseWidthParams;
    type FeedthroughInputs = PulseIn;
    type FeedthroughOutputs = PulseOut;
    type DiscreteState = Rest;
    fn feedthrough(&self, clock: &Clock, d: &Rest, u: &PulseIn) -> PulseOut {
        let (w, _) = self.width(clock, d, u);
        PulseOut { forward: w.max(0.0), backward: (-w).max(0.0) }
    }
    fn update(&self, clock: &Clock, d: &Rest, u: &PulseIn) -> Rest {
        Rest { impulse: self.width(clock, d, u).1 }
    }
    fn startup_warnings(&self, clock: &Clock) -> Vec<BuildError> {
        let fact = "the minimum pulse is longer than the sample period: no jet ever fires";
        let never = self.p.minimum > clock.dt;
        let told =
            never.then(|| BuildError::new(fact).help("decrease the sample rate").at("minimum"));
        told.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One axis, double integrator: the limit cycle has the rate that half a minimum pulse gives.
    #[test]
    fn the_limit_cycle_has_half_the_rate_of_a_pulse() {
        let (inertia, torque, minimum) = (200.0, 4.0, 0.02);
        let p = PhasePlaneParams { deadband: 0.01, rate_weight: 2.0, hysteresis: 1.0, minimum };
        let m = PhasePlane { p };
        let bit = torque * minimum / inertia;
        // The rate is half of the change by one pulse, and the attitude is inside the deadband, so
        // each pulse reverses the rate.
        let (mut e, mut w, mut d) = (0.0, 0.5 * bit, Firing { jet: 0.0, since: 0.0, pulses: 0.0 });
        let h = 0.001;
        let mut fastest = 0.0_f64;
        for k in 0..600_000 {
            let c = Clock::at(f64::from(k) * h, h, 0);
            d = m.update(&c, &d, &AxisIn { angle: e, rate: w });
            let a = d.jet * torque / inertia;
            e += w * h + 0.5 * a * h * h;
            w += a * h;
            fastest = fastest.max(w.abs());
            assert!(e.abs() < 0.011, "{e}");
        }
        assert!((fastest / (torque * minimum / (2.0 * inertia)) - 1.0).abs() < 0.05, "{fastest}");
        // Between two pulses, the attitude crosses the deadband: 2 · 0.02 rad at 2e-4 rad/s, back
        // and forth.
        assert!((4.0..9.0).contains(&d.pulses), "{}", d.pulses);
    }

    #[test]
    fn a_large_error_is_taken_away_with_hysteresis() {
        let p =
            PhasePlaneParams { deadband: 0.01, rate_weight: 2.0, hysteresis: 0.5, minimum: 0.0 };
        let m = PhasePlane { p };
        let off = Firing { jet: 0.0, since: 0.0, pulses: 0.0 };
        let c = Clock::at(1.0, 0.01, 0);
        let jet = |d: &Firing, angle: f64| m.decide(&c, d, &AxisIn { angle, rate: 0.0 }).jet;
        assert_eq!((jet(&off, 0.02), jet(&off, -0.02), jet(&off, 0.009)), (-1.0, 1.0, 0.0));
        let on = Firing { jet: -1.0, ..off };
        assert_eq!((jet(&on, 0.006), jet(&on, 0.004), jet(&on, -0.02)), (-1.0, 0.0, 1.0));
    }

    #[test]
    fn pulses_have_the_mean_torque_though_each_has_a_minimum() {
        let m = PulseWidth { p: PulseWidthParams { jet: 5.0, minimum: 0.02 } };
        let c = Clock::at(0.0, 0.1, 0);
        let run = |torque: f64| {
            let (mut d, mut sum) = (Rest { impulse: 0.0 }, 0.0);
            for _ in 0..1000 {
                let u = PulseIn { torque };
                let y = m.feedthrough(&c, &d, &u);
                assert!(y.forward == 0.0 || y.forward >= 0.02);
                sum += (y.forward - y.backward) * 5.0;
                d = m.update(&c, &d, &u);
            }
            sum / 100.0
        };
        for torque in [0.3, -0.3, 2.0, -4.9] {
            assert!((run(torque) / torque - 1.0).abs() < 0.01, "{torque}: {}", run(torque));
        }
        assert!((run(9.0) - 5.0).abs() < 1e-9, "a jet gives no more than it has");
    }
}
