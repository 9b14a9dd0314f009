//! `power.solar_panel`: electrical power of a panel in sunlight, in space or under air with dust.
//! ```text
//! E               solar irradiance at the panel, ν the visible fraction of the Sun's disc (see [`Sun::light`])
//! beam     ν E e^(−τ/cos Z) max(0, cos i)                          Z: zenith angle, i: incidence
//! diffuse  ν E cos Z (T(τ, Z) − e^(−τ/cos Z)) (1 + n · up)/2         sky seen by the tilted panel
//! P = η A f_dust (s beam + diffuse)                                s: sunlit fraction of the panel
//! ```
//! T is the total fraction of the light that reaches the ground. `T = 1/(1 + 0.16 τ/cos Z)` is a two-stream form with an
//! asymmetry typical of Martian dust: an engineering fit, not a table. With τ = 0 (Moon, space) only the beam remains. Both are zero in the shadow of
//! a body of the world and below the horizon. Edges of penumbra and umbra, also those at the horizon, are events.

use linkwork_surroundings::prelude::*;

/// Panel and air.
#[derive(Params, Clone, Debug)]
pub struct SolarPanelParams {
    /// Area.
    #[param(unit = "m^2", range = 0.0..)]
    pub area: f64,
    /// Efficiency: fraction of the light that becomes electricity.
    #[param(default = 0.27, range = 0.0..=1.0)]
    pub efficiency: f64,
    /// Optical depth τ of the atmosphere: 0 in vacuum, 0.3 to 0.8 for dust on Mars in clear seasons. A value above 0 needs a vertical: a site, or
    /// gravity on level ground.
    #[param(default = 0.0, range = 0.0..)]
    pub optical_depth: f64,
    /// Transmission of permanent dust on the panel; `power.dust` models variable dust.
    #[param(default = 1.0, range = 0.0..=1.0)]
    pub dust: f64,
    /// The Sun.
    #[param(service)]
    pub sun: Handle<dyn Sun>,
    /// The world, for the vertical.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
    /// Gravity, for the vertical of level ground.
    #[param(service)]
    pub gravity: Option<Handle<dyn Gravity>>,
}

/// The panel.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SolarPanelIn {
    /// Panel: its z axis is the normal.
    #[port(bind = "panel")]
    pub panel: NodeState,
    /// Electrical output, for a battery's `charger`, which takes all of the power.
    #[port(connector)]
    pub output: OpenVoltage,
    /// Transmission of variable dust, from `power.dust`.
    #[port("1", default = 1.0)]
    pub passes: f64,
    /// Sunlit fraction of the area, from `power.sunlit`. It does not affect diffuse light.
    #[port("1", default = 1.0)]
    pub sunlit: f64,
}

/// Power.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SolarPanelOut {
    /// Electrical power.
    #[port("W")]
    pub power: f64,
    /// Electrical output, for a battery's `charger`, which takes all of the power.
    #[port(connector)]
    pub output: Current,
    /// Irradiance on the panel, above the dust.
    #[port("W/m^2")]
    pub irradiance: f64,
    /// Cosine of the angle of incidence.
    #[port("1")]
    pub cosine: f64,
}

/// Present part of the shadow, for the events at its edges. A panel with a rate has no events, because its outputs change at its samples only.
#[derive(State, Clone, Copy, Debug)]
pub struct Shade {
    /// 0 in the light, 1 in a penumbra, 2 in an umbra or antumbra.
    #[port("1")]
    pub shade: f64,
}

/// Indices of the guards in [`ShadowEdges`].
const PENUMBRA: usize = 0;
const UMBRA: usize = 1;

/// A solar panel.
pub struct SolarPanel {
    p: SolarPanelParams,
    vertical: Vertical,
}

/// Returns the irradiance (W/m²) on a panel with unit normal `n` and local vertical `up`, both in W; the direct beam is multiplied by `sunlit`.
pub fn irradiance(n: &Vec3, light: &Light, up: &Vec3, optical_depth: f64, sunlit: f64) -> f64 {
    let facing = n.dot(&light.direction).max(0.0) * light.visible * sunlit;
    if optical_depth == 0.0 {
        return light.irradiance * facing;
    }
    let cos_z = light.direction.dot(up);
    if cos_z <= 0.0 {
        return 0.0;
    }
    let slant = optical_depth / cos_z.max(1e-3);
    let direct = (-slant).exp();
    let total = 1.0 / (1.0 + 0.16 * slant);
    let diffuse = light.visible * cos_z * (total - direct).max(0.0) * 0.5 * (1.0 + n.dot(up));
    light.irradiance * (direct * facing + diffuse)
}

/// Power of a solar panel: beam and diffuse light through dusty air, dust on the panel, shadows of the bodies of the world.
#[model("power.solar_panel")]
impl Model for SolarPanel {
    const MODES: bool = true;
    type Params = SolarPanelParams;
    type FeedthroughInputs = SolarPanelIn;
    type FeedthroughOutputs = SolarPanelOut;
    type DiscreteState = Shade;
    type Guards = ShadowEdges;
    fn build(p: SolarPanelParams) -> Result<Self, BuildError> {
        if p.optical_depth > 0.0 && p.world.as_ref().is_some_and(|w| w.axes() == Axes::Inertial) {
            let fact = format!(
                "`optical_depth` is {}, but W is inertial, so there is no ground and no vertical",
                p.optical_depth
            );
            let help = "remove `optical_depth` in space, or write a `site` in `world`";
            return Err(BuildError::new(fact).help(help).at("optical_depth"));
        }
        // In vacuum the vertical is not used.
        let vertical = match Vertical::new(p.world.as_ref(), p.gravity.as_ref()) {
            Ok(vertical) => vertical,
            Err(e) if p.optical_depth > 0.0 => return Err(e.at("optical_depth")),
            Err(_) => Vertical::Level,
        };
        Ok(SolarPanel { p, vertical })
    }
    fn feedthrough(&self, clock: &Clock, u: &SolarPanelIn) -> SolarPanelOut {
        let (p, place) = (&self.p, &u.panel.position);
        let sun = p.sun.light(clock.t, place);
        let n = u.panel.rotation * Vec3::z();
        let up = self.vertical.up(clock.t, place);
        let light = irradiance(&n, &sun, &up, p.optical_depth, u.sunlit);
        let power = p.efficiency * p.area * p.dust * u.passes * light;
        SolarPanelOut {
            power,
            output: u.output.current_of(-power),
            irradiance: light,
            cosine: n.dot(&sun.direction),
        }
    }
    fn mode(&self, clock: &Clock, u: &SolarPanelIn) -> Shade {
        let edges = self.guards(clock, u);
        let shade = match () {
            () if edges.penumbra > 0.0 => 0.0,
            () if edges.umbra > 0.0 => 1.0,
            () => 2.0,
        };
        Shade { shade }
    }
    fn guards(&self, clock: &Clock, u: &SolarPanelIn) -> ShadowEdges {
        ShadowEdges::of(&self.p.sun.light(clock.t, &u.panel.position))
    }
    fn handle_event(&self, fired: Fired<'_>, d: &Shade) -> ((), Shade) {
        let shade = match () {
            () if fired.rose(PENUMBRA) => 0.0,
            () if fired.fell(UMBRA) => 2.0,
            () if fired.fell(PENUMBRA) || fired.rose(UMBRA) => 1.0,
            () => d.shade,
        };
        ((), Shade { shade })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_runtime::AU;
    use linkwork_surroundings::SOLAR_CONSTANT;
    use linkwork_surroundings::testing;

    fn light(direction: Vec3, au: f64) -> Light {
        let irradiance = SOLAR_CONSTANT / (au * au);
        let distance = au * AU;
        Light { direction, distance, irradiance, visible: 1.0, penumbra: 1.0, umbra: 1.0 }
    }

    /// Over level ground.
    fn irradiance(n: Vec3, sun: Vec3, au: f64, optical_depth: f64, sunlit: f64) -> f64 {
        super::irradiance(&n, &light(sun, au), &Vec3::z(), optical_depth, sunlit)
    }

    #[test]
    fn without_air_it_is_the_cosine_law() {
        let sun = Vec3::new(3f64.sqrt() / 2.0, 0.0, 0.5);
        assert!((irradiance(Vec3::z(), sun, 1.0, 0.0, 1.0) - 680.5).abs() < 1e-9);
        assert!((irradiance(sun, sun, 2.0, 0.0, 1.0) - 340.25).abs() < 1e-9);
        assert_eq!(irradiance(-sun, sun, 1.0, 0.0, 1.0), 0.0);
    }

    #[test]
    fn dust_turns_beam_into_diffuse_light_and_takes_some() {
        let up = Vec3::z();
        let mut last = irradiance(up, up, 1.52, 1e-9, 1.0);
        assert!((last - SOLAR_CONSTANT / 1.52f64.powi(2)).abs() < 1e-3);
        for tau in [0.2, 0.5, 1.0, 2.0, 5.0] {
            let now = irradiance(up, up, 1.52, tau, 1.0);
            let beam = SOLAR_CONSTANT / 1.52f64.powi(2) * f64::exp(-tau);
            assert!(now < last && now > beam, "{tau}: {now} {last} {beam}");
            last = now;
        }
        // A vertical panel under a high sun sees half the sky.
        assert!(irradiance(Vec3::x(), up, 1.52, 1.0, 1.0) > 0.0);
        assert_eq!(irradiance(up, Vec3::new(0.0, 1.0, -0.01).normalize(), 1.52, 0.5, 1.0), 0.0);
    }

    #[test]
    fn shadow_takes_the_beam_and_leaves_the_sky() {
        let (n, sun) = (Vec3::z(), Vec3::new(0.6, 0.0, 0.8));
        let of = |tau: f64, sunlit: f64| irradiance(n, sun, 1.5, tau, sunlit);
        assert_eq!((of(0.0, 0.0), of(0.0, 0.25)), (0.0, 0.25 * of(0.0, 1.0)));
        let beam = SOLAR_CONSTANT / 2.25 * 0.8 * f64::exp(-0.7 / 0.8);
        assert!((of(0.7, 1.0) - of(0.7, 0.0) - beam).abs() < 1e-10 && of(0.7, 0.0) > 20.0);
    }

    fn params() -> SolarPanelParams {
        SolarPanelParams {
            area: 2.0,
            efficiency: 0.25,
            optical_depth: 0.0,
            dust: 0.9,
            sun: testing::sun(Vec3::z(), 1.0),
            world: None,
            gravity: None,
        }
    }

    /// An eclipse dims beam and sky equally, because the sky is lit by the same Sun.
    #[test]
    fn an_eclipse_dims_beam_and_sky() {
        let part = |visible: f64, tau: f64| {
            let light = Light { visible, ..light(Vec3::z(), 1.0) };
            super::irradiance(&Vec3::z(), &light, &Vec3::z(), tau, 1.0)
        };
        assert_eq!((part(0.0, 0.0), part(0.25, 0.0)), (0.0, 0.25 * 1361.0));
        let clear = part(1.0, 0.5);
        assert!(clear > 1361.0 * f64::exp(-0.5), "with light of the sky");
        assert!(part(0.0, 0.5) == 0.0 && (part(0.25, 0.5) - 0.25 * clear).abs() < 1e-9);
    }

    #[test]
    fn air_needs_ground() {
        use linkwork_surroundings::PlainWorld;
        let dusty = SolarPanelParams { optical_depth: 0.5, ..params() };
        let e = SolarPanel::build(dusty.clone()).err().unwrap();
        assert!(
            e.param.as_deref() == Some("optical_depth")
                && e.message.contains("direction of the vertical")
        );
        let world = Some(PlainWorld::inertial(4e14, 6.4e6, 7e-5).handle());
        let e = SolarPanel::build(SolarPanelParams { world, ..dusty }).err().unwrap();
        assert!(e.message.contains("no ground") && e.help.is_some());
    }

    #[test]
    fn dust_that_stays_and_dust_that_settles_both_take_their_share() {
        let panel = SolarPanel::build(params()).unwrap();
        let u = SolarPanelIn {
            panel: NodeState::identity(),
            output: OpenVoltage { voltage: 28.0 },
            passes: 0.8,
            sunlit: 0.5,
        };
        let y = panel.feedthrough(&Clock::at(0.0, 1.0, 0), &u);
        assert!((y.power - 0.5 * 0.9 * 0.8 * 0.5 * 1361.0).abs() < 1e-9, "{y:?}");
        assert_eq!((y.output.current * 28.0, y.irradiance), (-y.power, 0.5 * 1361.0));
    }
}
