//! `flight.gusts`: gusts that a craft flies through, with the Dryden spectra of MIL-F-8785C.
//! ```text
//! v = velocity − wind          e_u = v/|v|      e_v = up × e_u (to the left in level flight)      e_w = e_u × e_v
//! gust = u e_u + v e_v + w e_w, W              u, v, w: white noise through the filters at the airspeed |v|
//! ```
//! Lengths and intensities are written, or follow the height above the ground by MIL-F-8785C. From sample to sample the filters
//! are exact; between samples the gust stays. Wire `velocity` to the `gust` of the craft's aerodynamics, drag, canopy or balloon.
//! The first sample is of air that has been gusty for ever.
//!
//! MIL-F-8785C gives intensities up to 80 000 ft (24 384 m): above that height the gusts are zero. With `length` and `sigma` gusts blow at every height.
//! The parameter `span` adds the rotation of the air over the width of the vehicle, by the spectra of p, q and r of MIL-F-8785C
//! (`framework/world/src/atmosphere/dryden_rates.rs`): wire `rotation` to `gust_rate` of the models that damp its rates.

use linkwork_runtime::prelude::*;
use linkwork_world::atmosphere::{Dryden, DrydenRates, DrydenState, Turbulence};

/// Intensity of the gusts, and the air.
#[derive(Params, Clone, Debug)]
pub struct GustParams {
    /// Wind at 20 ft (6.1 m), which sets the gusts below 1000 ft (305 m): light 7.7, moderate 15.4, severe 23.2 m/s.
    #[param(unit = "m/s", default = 15.4, range = 0.0..)]
    pub wind_20ft: f64,
    /// Intensity σ above 2000 ft (610 m).
    #[param(unit = "m/s", default = 1.5, range = 0.0..)]
    pub sigma_high: f64,
    /// L_u, L_v, L_w at every height, instead of those of MIL-F-8785C; with `sigma`.
    #[param(unit = "m")]
    pub length: Option<Vec3>,
    /// σ_u, σ_v, σ_w at every height, instead of those of MIL-F-8785C; with `length`.
    #[param(unit = "m/s")]
    pub sigma: Option<Vec3>,
    /// Span b of the vehicle, for the rotation of the air. Default: the air does not rotate.
    #[param(unit = "m", range = 1e-3..)]
    pub span: Option<f64>,
    /// The air.
    #[param(service)]
    pub atmosphere: Handle<dyn Atmosphere>,
    /// Gravity, for what is up.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// The craft.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GustIn {
    /// Where the gusts are.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Height above the ground, for MIL-F-8785C.
    #[port("m")]
    pub height: f64,
}

/// The gust.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GustOut {
    /// Velocity of the gust over the wind, W.
    #[port("m/s")]
    pub velocity: Vec3,
    /// Angular velocity of the air over the span of the vehicle, W; zero without `span`.
    #[port("rad/s")]
    pub rotation: Vec3,
}

/// States of the filters, and the gust that they gave.
#[derive(State, Clone, Copy, Debug)]
pub struct GustState {
    /// Of the longitudinal filter.
    #[port("1")]
    pub u: f64,
    /// Of the sideways filter.
    #[port("1")]
    pub v: [f64; 2],
    /// Of the vertical filter.
    #[port("1")]
    pub w: [f64; 2],
    /// States of the low-pass filters for the rotation of the air: roll, vertical gust, sideways gust.
    #[port("1")]
    pub rates: [f64; 3],
    /// The filters have begun.
    #[port]
    pub begun: bool,
}

/// Height (m) above which MIL-F-8785C gives no intensity: 80 000 ft.
const TOP: f64 = 24_384.0;

/// Gusts by Dryden's spectra.
pub struct Gusts {
    p: GustParams,
    fixed: Option<Turbulence>,
}

/// Right-handed axes along the flight, to its left, and across both; any across where it is vertical.
fn axes(through: &Vec3, up: &Vec3) -> [Vec3; 3] {
    let speed = through.norm();
    let u = if speed > 0.0 { through / speed } else { Vec3::x() };
    let level = up.cross(&u);
    let v = if level.norm() > 1e-9 * up.norm() {
        level.normalize()
    } else {
        // The axis that the flight is least along.
        let k = u.iamin();
        let mut e = Vec3::zeros();
        e[k] = 1.0;
        u.cross(&e).normalize()
    };
    [u, v, u.cross(&v)]
}

impl Gusts {
    fn turbulence(&self, height: f64) -> Option<Turbulence> {
        let p = &self.p;
        if self.fixed.is_none() && height > TOP {
            let length = Vec3::from_element(1.0);
            return Some(Turbulence { length, sigma: Vec3::zeros() });
        }
        self.fixed.or_else(|| Turbulence::mil_f_8785c(height, p.wind_20ft, p.sigma_high).ok())
    }

    /// Returns the filters as the last step left them; at the first sample, a draw from air that has been gusty for ever.
    fn present(&self, c: &Clock, d: &GustState, t: &Turbulence) -> (DrydenState, DrydenRates) {
        if d.begun {
            let [p, w, v] = d.rates;
            return (filters(d), DrydenRates { p, w, v });
        }
        let noise = normals(c, FIRST);
        let rates = self
            .p
            .span
            .map(|span| DrydenRates::stationary(t, span, &noise, &normals(c, FIRST_RATES)));
        (Dryden::stationary(&noise), rates.unwrap_or_default())
    }

    /// Velocity through the air without the gust, m/s, W.
    fn through(&self, t: f64, body: &NodeState) -> Vec3 {
        body.velocity - self.p.atmosphere.air(t, body.position).wind
    }
}

/// Gusts along the flight of a craft with the Dryden spectra of MIL-F-8785C; sampled.
#[model("flight.gusts")]
impl Model for Gusts {
    type Params = GustParams;
    type FeedthroughInputs = GustIn;
    type FeedthroughOutputs = GustOut;
    type DiscreteState = GustState;
    fn build(p: GustParams) -> Result<Self, BuildError> {
        let fixed = match (p.length, p.sigma) {
            (Some(length), Some(sigma)) => {
                if !(length.min() > 0.0) {
                    return Err(BuildError::new("a length is not above 0").at("length"));
                }
                if !(sigma.min() >= 0.0) {
                    return Err(BuildError::new("an intensity is below 0").at("sigma"));
                }
                Some(Turbulence { length, sigma })
            }
            (None, None) => None,
            (length, _) => {
                let at = if length.is_some() { "sigma" } else { "length" };
                return Err(BuildError::new("`length` and `sigma` go together")
                    .help("write both, or neither for MIL-F-8785C")
                    .at(at));
            }
        };
        Ok(Gusts { p, fixed })
    }
    fn feedthrough(&self, clock: &Clock, d: &GustState, u: &GustIn) -> GustOut {
        let through = self.through(clock.t, &u.body);
        let up = -self.p.gravity.acceleration(clock.t, u.body.position);
        let Some(turbulence) = self.turbulence(u.height) else {
            let none = Vec3::repeat(f64::NAN);
            return GustOut { velocity: none, rotation: none };
        };
        let (state, rates) = self.present(clock, d, &turbulence);
        let [e, left, across] = axes(&through, &up);
        let turned = |x: Vec3| e * x.x + left * x.y + across * x.z;
        let rotation = match self.p.span {
            Some(span) => turned(rates.rotation(&state, &turbulence, span)),
            None => Vec3::zeros(),
        };
        GustOut { velocity: turned(Dryden::gust(&state, &turbulence)), rotation }
    }
    fn update(&self, clock: &Clock, d: &GustState, u: &GustIn) -> GustState {
        let speed = self.through(clock.t, &u.body).norm();
        let Some(t) = self.turbulence(u.height) else {
            let now = if d.begun { filters(d) } else { Dryden::stationary(&normals(clock, FIRST)) };
            return GustState { u: now.u, v: now.v, w: now.w, rates: d.rates, begun: true };
        };
        let ((now, rates), noise) = (self.present(clock, d, &t), normals(clock, 0));
        let next = Dryden::step(&now, &t, speed, clock.dt, &noise);
        let rates = match self.p.span {
            Some(span) => {
                rates.step(&now, (&t, span), (speed, clock.dt), &noise, &normals(clock, RATES))
            }
            None => rates,
        };
        let rates = [rates.p, rates.w, rates.v];
        GustState { u: next.u, v: next.v, w: next.w, rates, begun: true }
    }
    fn startup_warnings(&self, u: &GustIn) -> Vec<BuildError> {
        if self.fixed.is_some() || u.height <= TOP {
            return Vec::new();
        }
        let fact = format!(
            "it begins {:.0} m above the ground, and gusts of MIL-F-8785C end at {TOP} m: there are none above",
            u.height
        );
        let help = "write `length` and `sigma` for gusts at every height, or leave it out";
        vec![BuildError::new(fact).help(help)]
    }
}

/// Lanes of noise: of the start of the gusts, of a step of the rotation of the air, and of its start.
const FIRST: u32 = 5;
const RATES: u32 = 10;
const FIRST_RATES: u32 = 13;

fn normals<const N: usize>(c: &Clock, lane: u32) -> [f64; N] {
    std::array::from_fn(|k| c.normal(lane + k as u32))
}

fn filters(d: &GustState) -> DrydenState {
    DrydenState { u: d.u, v: d.v, w: d.w }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_runtime::testing;

    fn gusts(fixed: Option<(Vec3, Vec3)>) -> Gusts {
        Gusts::build(GustParams {
            wind_20ft: 15.4,
            sigma_high: 1.5,
            length: fixed.map(|f| f.0),
            sigma: fixed.map(|f| f.1),
            span: None,
            atmosphere: testing::air(|_, _| {
                let wind = Vec3::new(0.0, 20.0, 0.0);
                Air { density: 1.0, pressure: 1.0, temperature: 280.0, speed_of_sound: 330.0, wind }
            }),
            gravity: testing::gravity(|_, _| Vec3::z() * -9.81),
        })
        .unwrap()
    }

    /// To the east through air that goes north: 150 m/s through it, along (0, 1, 0).
    fn flying(height: f64) -> GustIn {
        let velocity = Vec3::new(0.0, 170.0, 0.0);
        GustIn { body: NodeState { velocity, ..NodeState::identity() }, height }
    }

    /// Rows of gusts along, left of and across the flight.
    fn series(m: &Gusts, n: u64, dt: f64, u: &GustIn) -> Vec<[f64; 3]> {
        let mut d = GustState::zero();
        (0..n)
            .map(|k| {
                let c = Clock::at(k as f64 * dt, dt, k);
                let y = m.feedthrough(&c, &d, u).velocity;
                d = m.update(&c, &d, u);
                // Along y; left of it is −x with z up; across both is +z.
                [y.y, -y.x, y.z]
            })
            .collect()
    }

    #[test]
    fn correlations_are_those_of_the_spectra() {
        // EDL.md: L 533.4 m, V 150 m/s, 0.5 s: 0.86883 and 0.80775.
        let m = gusts(Some((Vec3::repeat(533.4), Vec3::new(1.0, 2.0, 3.0))));
        let (dt, lag) = (0.1, 5);
        let rows = series(&m, 400_000, dt, &flying(f64::NAN));
        for (k, sigma, want) in [(0, 1.0, 0.86883), (1, 2.0, 0.80775), (2, 3.0, 0.80775)] {
            let product = |lag: usize| {
                let pairs = rows.iter().zip(&rows[lag..]).map(|(a, b)| a[k] * b[k]);
                pairs.sum::<f64>() / (rows.len() - lag) as f64
            };
            let square = product(0);
            assert!((square.sqrt() / sigma - 1.0).abs() < 0.03, "{k}: {square}");
            assert!((product(lag) / square - want).abs() < 0.012, "{k}: {}", product(lag) / square);
        }
    }

    #[test]
    fn the_first_sample_is_as_gusty_as_any() {
        // Over many seeds, by the noise of many first samples.
        let m = gusts(Some((Vec3::repeat(533.4), Vec3::new(1.0, 2.0, 3.0))));
        let (n, u) = (20_000, flying(f64::NAN));
        let mut sums = Vec3::zeros();
        for k in 0..n {
            let y = m.feedthrough(&Clock::at(0.0, 0.1, k), &GustState::zero(), &u).velocity;
            sums += Vec3::new(y.y, -y.x, y.z).map(|x| x * x);
        }
        let sigma = (sums / n as f64).map(f64::sqrt);
        assert!((sigma - Vec3::new(1.0, 2.0, 3.0)).abs().max() < 0.06, "{sigma}");
    }

    /// The air of a wing of 20 m rotates with σ_p² = 0.8 (π L/4b)^⅓ π²/(8 b L) σ_w² about the flight; the gusts are those without a span.
    #[test]
    fn the_air_rotates_about_the_axes_of_the_flight() {
        let fixed = Some((Vec3::repeat(300.0), Vec3::new(1.0, 2.0, 3.0)));
        let (plain, u, dt, pi) = (gusts(fixed), flying(f64::NAN), 0.1, std::f64::consts::PI);
        let wide = Gusts::build(GustParams { span: Some(20.0), ..plain.p.clone() }).unwrap();
        let (mut a, mut b, mut squares, n) = (GustState::zero(), GustState::zero(), 0.0, 100_000);
        for k in 0..n {
            let c = Clock::at(k as f64 * dt, dt, k);
            let y = wide.feedthrough(&c, &a, &u);
            let without = plain.feedthrough(&c, &b, &u);
            assert_eq!((y.velocity, Vec3::zeros()), (without.velocity, without.rotation));
            // The flight is along y.
            squares += y.rotation.y * y.rotation.y;
            a = wide.update(&c, &a, &u);
            b = plain.update(&c, &b, &u);
        }
        let want: f64 = 9.0 * 0.8 * (pi * 300.0 / 80.0).cbrt() * pi * pi / (8.0 * 20.0 * 300.0);
        assert!((squares / n as f64 / want - 1.0).abs() < 0.03, "{} {want}", squares / n as f64);
    }

    #[test]
    fn it_follows_the_height() {
        let m = gusts(None);
        let deviation = |height: f64| {
            let rows = series(&m, 100_000, 0.2, &flying(height));
            (rows.iter().map(|r| r[2] * r[2]).sum::<f64>() / rows.len() as f64).sqrt()
        };
        // σ_w = 0.1 W₂₀ below 1000 ft, σ above 2000 ft.
        assert!((deviation(100.0) / 1.54 - 1.0).abs() < 0.04, "{}", deviation(100.0));
        assert!((deviation(700.0) / 1.5 - 1.0).abs() < 0.04, "{}", deviation(700.0));
        let (c, d, u) = (Clock::at(0.0, 0.1, 0), GustState::zero(), flying(f64::NAN));
        assert!(m.feedthrough(&c, &d, &u).velocity.x.is_nan(), "a height that is no number");
    }

    #[test]
    fn half_of_a_spectrum_is_refused() {
        let handle = gusts(None).p;
        let p = GustParams { length: Some(Vec3::repeat(500.0)), ..handle };
        let told = Gusts::build(p).err().unwrap();
        assert_eq!(told.param.as_deref(), Some("sigma"));
    }
}
