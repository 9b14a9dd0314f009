//! `flight.gusts`: turbulence along the flight of a vehicle, with the Dryden spectra of MIL-F-8785C.
//! ```text
//! v = velocity − wind          e_u = v/|v|      e_v = up × e_u (to the left in level flight)      e_w = e_u × e_v
//! gust = u e_u + v e_v + w e_w, W              u, v, w: white noise through the filters at the airspeed |v|
//! ```
//! Length scales and intensities are parameters, or follow the height above the ground by MIL-F-8785C. The discretization of the filters is exact;
//! the gust is constant between samples. Wire `velocity` to the input `gust` of aerodynamics, drag, canopy or balloon. The first sample is drawn from
//! the stationary distribution.
//!
//! MIL-F-8785C gives intensities up to 80 000 ft (24 384 m); above that height the gusts are zero. With `length` and `sigma` there are gusts at all
//! heights. The parameter `span` adds the rotation of the air over the width of the vehicle, by the spectra of p, q and r of MIL-F-8785C
//! (`framework/world/src/atmosphere/dryden_rates.rs`): wire `rotation` to the input `gust_rate` of the models with rate damping.

use linkwork_surroundings::prelude::*;
use linkwork_world::atmosphere::{Dryden, DrydenRates, DrydenState, Turbulence};

/// Intensity of the turbulence.
#[derive(Params, Clone, Debug)]
pub struct GustParams {
    /// Wind at 20 ft (6.1 m), which determines the intensity below 1000 ft (305 m): light 7.7, moderate 15.4, severe 23.2 m/s.
    #[param(unit = "m/s", default = 15.4, range = 0.0.., needs = "sigma = none")]
    pub wind_20ft: f64,
    /// Intensity σ above 2000 ft (610 m).
    #[param(unit = "m/s", default = 1.5, range = 0.0.., needs = "sigma = none")]
    pub sigma_high: f64,
    /// Length scales L_u, L_v, L_w at all heights, instead of MIL-F-8785C; requires `sigma`.
    #[param(unit = "m")]
    pub length: Option<Vec3>,
    /// Intensities σ_u, σ_v, σ_w at all heights, instead of MIL-F-8785C; requires `length`.
    #[param(unit = "m/s")]
    pub sigma: Option<Vec3>,
    /// Span b of the vehicle, for the rotation of the air. Default: no rotation.
    #[param(unit = "m", range = 1e-3..)]
    pub span: Option<f64>,
    /// Atmosphere, for wind and airspeed.
    #[param(service)]
    pub atmosphere: Handle<dyn Atmosphere>,
    /// Gravity, for the vertical.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// Vehicle and height.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GustIn {
    /// Node at which the gust is computed.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Height above the ground, for MIL-F-8785C.
    #[port("m")]
    pub height: f64,
}

/// The gust.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GustOut {
    /// Velocity of the gust relative to the mean wind, W.
    #[port("m/s")]
    pub velocity: Vec3,
    /// Angular velocity of the air over the span of the vehicle, W; zero without `span`.
    #[port("rad/s")]
    pub rotation: Vec3,
}

/// States of the filters.
#[derive(State, Clone, Copy, Debug)]
pub struct GustState {
    /// State of the longitudinal filter.
    #[port("1")]
    pub u: f64,
    /// States of the lateral filter.
    #[port("1")]
    pub v: [f64; 2],
    /// States of the vertical filter.
    #[port("1")]
    pub w: [f64; 2],
    /// States of the low-pass filters for the rotation of the air: roll, vertical gust, lateral gust.
    #[port("1")]
    pub rates: [f64; 3],
    /// The filters have been initialized.
    #[port]
    pub begun: bool,
}

/// Height (m) above which MIL-F-8785C gives no intensity: 80 000 ft.
const TOP: f64 = 24_384.0;

/// Turbulence with Dryden spectra.
pub struct Gusts {
    p: GustParams,
    fixed: Option<Turbulence>,
}

/// Returns right-handed axes: along the airspeed, to its left, and perpendicular to both. In vertical flight the direction of the lateral axes is
/// arbitrary.
fn axes(through: &Vec3, up: &Vec3) -> [Vec3; 3] {
    let speed = through.norm();
    let u = if speed > 0.0 { through / speed } else { Vec3::x() };
    let level = up.cross(&u);
    let v = if level.norm() > 1e-9 * up.norm() {
        level.normalize()
    } else {
        // Choose the coordinate axis with the largest angle to the airspeed.
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

    /// Returns the filter states of the last step, or at the first sample a draw from their stationary distribution.
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

    /// Returns the velocity relative to the mean wind, m/s, W.
    fn through(&self, t: f64, body: &NodeState) -> Vec3 {
        body.velocity - self.p.atmosphere.air(t, body.position).wind
    }
}

/// Dryden turbulence of MIL-F-8785C along the flight of a vehicle; sampled.
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
                    return Err(BuildError::new(
                        "the components of `length` must be greater than 0",
                    )
                    .at("length"));
                }
                if !(sigma.min() >= 0.0) {
                    return Err(BuildError::new("the components of `sigma` must not be negative")
                        .at("sigma"));
                }
                Some(Turbulence { length, sigma })
            }
            (None, None) => None,
            (length, _) => {
                let at = if length.is_some() { "sigma" } else { "length" };
                return Err(BuildError::new("`length` and `sigma` must be given together")
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
            "the run begins {:.0} m above the ground, but MIL-F-8785C gives gusts only up to {TOP} m",
            u.height
        );
        let help = "write `length` and `sigma` for gusts at all heights, or remove this part";
        vec![BuildError::new(fact).help(help)]
    }
}

/// First noise channels: for the initial gust, for a step of the rotation of the air, and for its initial state.
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
    use linkwork_surroundings::testing;

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

    /// Flight in wind with an airspeed of 150 m/s along (0, 1, 0).
    fn flying(height: f64) -> GustIn {
        let velocity = Vec3::new(0.0, 170.0, 0.0);
        GustIn { body: NodeState { velocity, ..NodeState::identity() }, height }
    }

    /// Samples of gusts along, left of and perpendicular to the flight.
    fn series(m: &Gusts, n: u64, dt: f64, u: &GustIn) -> Vec<[f64; 3]> {
        let mut d = GustState::zero();
        (0..n)
            .map(|k| {
                let c = Clock::at(k as f64 * dt, dt, k);
                let y = m.feedthrough(&c, &d, u).velocity;
                d = m.update(&c, &d, u);
                // The airspeed is along y. Left of it is −x with z up, and the third axis is +z.
                [y.y, -y.x, y.z]
            })
            .collect()
    }

    #[test]
    fn correlations_are_those_of_the_spectra() {
        // The reference is 0.86883 and 0.80775, for L 533.4 m, V 150 m/s and 0.5 s.
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
        // The statistics are over many seeds, from the noise of many first samples.
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

    /// For a span of 20 m the roll rate of the air has σ_p² = 0.8 (π L/4b)^⅓ π²/(8 b L) σ_w²; the gust velocities do not depend on `span`.
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
            // The airspeed is along y.
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
        // The deviation is σ_w = 0.1 W₂₀ below 1000 ft, and σ above 2000 ft.
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
