//! `power.thermal_node`: a body with one temperature that stores heat, radiates to the sky and exchanges heat with the air.
//! ```text
//! C Ṫ = Q + α A G − ε A σ (T⁴ − T_sky⁴) − h A (T − T_air)
//! ```
//! Q is the heat flow from the parts connected to its port: links (`power.thermal_link`), heaters, motors and sources; G is the light on the outer
//! surface A. One node is sufficient if the temperature inside its body is uniform, that is, for a Biot number h L/k well below one.

use linkwork_runtime::prelude::*;

/// Stefan–Boltzmann constant, W/(m² K⁴): exact, from the defining constants of the SI.
pub const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;

/// Heat capacity and outer surface.
#[derive(Params, Clone, Debug)]
pub struct ThermalNodeParams {
    /// Heat capacity.
    #[param(unit = "J/K", range = 1e-9..)]
    pub capacity: f64,
    /// Temperature at the start.
    #[param(unit = "K", range = 1.0..)]
    pub temperature: f64,
    /// Area of the outer surface, which radiates, absorbs light and exchanges heat with the air; 0: heat flows through links only.
    #[param(unit = "m^2", default = 0.0, range = 0.0.., needs = "emissivity or absorptivity or convection")]
    pub area: f64,
    /// Emissivity of the surface in the infrared.
    #[param(default = 0.0, range = 0.0..=1.0)]
    pub emissivity: f64,
    /// Fraction of the light that the surface absorbs.
    #[param(default = 0.0, range = 0.0..=1.0)]
    pub absorptivity: f64,
    /// Coefficient of convection to the air.
    #[param(unit = "W/(m^2 K)", default = 0.0, range = 0.0..)]
    pub convection: f64,
}

/// Heat.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThermalNodeIn {
    /// Connection for links, heaters, and the cases of motors and loads.
    #[port(connector)]
    pub port: HeatFlows,
}

/// Surroundings of the node.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThermalNodeAround {
    /// Temperature of the sky as a black body. It must be wired if `emissivity` is written.
    #[port("K", default = 0.0)]
    pub sky: f64,
    /// Temperature of the air. It must be wired if `convection` is written.
    #[port("K", default = 0.0)]
    pub air: f64,
    /// Light on the surface, such as `irradiance` of a solar panel. It must be wired if `absorptivity` is written.
    #[port("W/m^2", default = 0.0)]
    pub light: f64,
}

/// Temperature.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThermalNodeOut {
    /// Connection for links, heaters, and the cases of motors and loads.
    #[port(connector)]
    pub port: Temperature,
    /// Temperature.
    #[port("K")]
    pub temperature: f64,
    /// Stored heat, counted from 0 K.
    #[port("J", stored)]
    pub energy: f64,
}

/// Heat flows of the node.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThermalNodeFlows {
    /// Net heat flow radiated to the sky.
    #[port("W", lost)]
    pub radiated: f64,
    /// Heat flow to the air.
    #[port("W", lost)]
    pub convected: f64,
    /// Light taken up.
    #[port("W", gained)]
    pub absorbed: f64,
}

/// Temperature.
#[derive(State, Clone, Copy, Debug)]
pub struct Warmth {
    /// Temperature.
    #[port("K")]
    pub temperature: f64,
}

/// A lump of one temperature.
pub struct ThermalNode {
    p: ThermalNodeParams,
}

/// A body with one temperature: heat capacity, heat from parts and links, radiation, convection, light.
#[model("power.thermal_node")]
impl Model for ThermalNode {
    type Params = ThermalNodeParams;
    type Inputs = ThermalNodeIn;
    type FeedthroughInputs = ThermalNodeAround;
    type Outputs = ThermalNodeOut;
    type FeedthroughOutputs = ThermalNodeFlows;
    type State = Warmth;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let p = &self.p;
        let surface = [
            ("sky", "emissivity", p.emissivity),
            ("air", "convection", p.convection),
            ("light", "absorptivity", p.absorptivity),
        ];
        let judge = |(input, name, value): (&'static str, &str, f64)| {
            let idle = value == 0.0 && wired(input);
            let why = || BuildError::new(format!("`{name}` is 0"));
            let help = || format!("write `{name}` and `area`, or remove the wire");
            (Judge::Input(input), idle.then(|| why().help(help())))
        };
        surface.into_iter().map(judge).collect()
    }
    fn must_be_wired(&self) -> Vec<(&'static str, BuildError)> {
        let p = &self.p;
        let why = |param: &str, help: &str| {
            BuildError::new(format!("`area` and `{param}` require it")).help(help)
        };
        let all = [
            (
                p.emissivity,
                "sky",
                why(
                    "emissivity",
                    "wire the temperature of the sky, such as `basics.constant` of 2.7 K in space",
                ),
            ),
            (
                p.convection,
                "air",
                why("convection", "wire the temperature of the air, or remove `convection`"),
            ),
            (
                p.absorptivity,
                "light",
                why(
                    "absorptivity",
                    "wire the light on the surface, such as `irradiance` of a solar panel, or remove `absorptivity`",
                ),
            ),
        ];
        let needed = all.into_iter().filter(|(share, ..)| p.area > 0.0 && *share > 0.0);
        needed.map(|(_, input, why)| (input, why)).collect()
    }
    fn init_x(&self) -> Warmth {
        Warmth { temperature: self.p.temperature }
    }
    fn outputs(&self, x: &Warmth) -> ThermalNodeOut {
        let temperature = x.temperature;
        let energy = self.p.capacity * temperature;
        ThermalNodeOut { port: Temperature { temperature }, temperature, energy }
    }
    fn feedthrough(&self, x: &Warmth, ud: &ThermalNodeAround) -> ThermalNodeFlows {
        let p = &self.p;
        let t = x.temperature;
        ThermalNodeFlows {
            radiated: p.emissivity * p.area * radiation(t, ud.sky),
            convected: p.convection * p.area * (t - ud.air),
            absorbed: p.absorptivity * p.area * ud.light,
        }
    }
    fn derivatives(&self, u: &ThermalNodeIn, y: &ThermalNodeFlows) -> Warmth {
        let heat = u.port.heat + y.absorbed - y.radiated - y.convected;
        Warmth { temperature: heat / self.p.capacity }
    }
    fn startup_warnings(&self) -> Vec<BuildError> {
        let p = &self.p;
        let acts = p.emissivity > 0.0 || p.absorptivity > 0.0 || p.convection > 0.0;
        let (fact, help) = match p.area > 0.0 {
            false if acts => (
                "a node without outer surface neither radiates nor meets light or air",
                "write `area`, or remove `emissivity`, `absorptivity` and `convection`",
            ),
            true if !acts => (
                "a surface that neither radiates nor meets light or air has no effect",
                "write `emissivity`, `absorptivity` or `convection`, or remove `area`",
            ),
            _ => return Vec::new(),
        };
        vec![BuildError::new(fact).help(help).at("area")]
    }
}

/// Net heat flow (W) that 1 m² of a black body at `t` radiates to another at `other` (K).
pub(crate) fn radiation(t: f64, other: f64) -> f64 {
    // The difference T⁴ − S⁴ is factored: no digits cancel where the two are nearly equal.
    STEFAN_BOLTZMANN * (t - other) * (t + other) * (t * t + other * other)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params() -> ThermalNodeParams {
        ThermalNodeParams {
            capacity: 2e4,
            temperature: 290.0,
            area: 0.7,
            emissivity: 0.8,
            absorptivity: 0.4,
            convection: 1.3,
        }
    }

    fn rate(p: &ThermalNodeParams, t: f64, heat: f64, around: ThermalNodeAround) -> f64 {
        let node = ThermalNode { p: p.clone() };
        let x = Warmth { temperature: t };
        let y = node.feedthrough(&x, &around);
        node.derivatives(&ThermalNodeIn { port: HeatFlows { heat } }, &y).temperature
    }

    #[test]
    fn it_rests_at_the_temperature_whose_radiation_carries_its_heat_away() {
        let p = ThermalNodeParams { convection: 0.0, ..params() };
        let u = ThermalNodeAround { sky: 160.0, air: 0.0, light: 300.0 };
        let taken = 150.0 + 0.4 * 0.7 * 300.0;
        let rest = (taken / (0.8 * 0.7 * STEFAN_BOLTZMANN) + 160f64.powi(4)).powf(0.25);
        assert!(rate(&p, rest, 150.0, u).abs() < 1e-12, "{rest} K");
        // The temperature returns to equilibrium with the time constant C/(4 ε A σ T³).
        let lag = 2e4 / (4.0 * 0.8 * 0.7 * STEFAN_BOLTZMANN * rest.powi(3));
        let slope = (rate(&p, rest + 1e-3, 150.0, u) - rate(&p, rest - 1e-3, 150.0, u)) / 2e-3;
        assert!((slope * lag + 1.0).abs() < 1e-7, "{}", slope * lag);
    }

    #[test]
    fn air_alone_pulls_it_over_with_one_time_constant() {
        let p = ThermalNodeParams { emissivity: 0.0, absorptivity: 0.0, ..params() };
        let u = ThermalNodeAround { sky: 2.7, air: 220.0, light: 500.0 };
        // The rate is C Ṫ = −h A (T − T_air).
        assert!((rate(&p, 290.0, 0.0, u) + 1.3 * 0.7 * 70.0 / 2e4).abs() < 1e-15);
        assert_eq!(rate(&p, 220.0, 0.0, u), 0.0);
    }

    #[test]
    fn a_surface_without_a_use_and_a_use_without_a_surface_are_told() {
        let told = |p: ThermalNodeParams| {
            let node = ThermalNode { p };
            node.startup_warnings()
        };
        assert!(told(params()).is_empty());
        let bare =
            ThermalNodeParams { emissivity: 0.0, absorptivity: 0.0, convection: 0.0, ..params() };
        assert!(told(ThermalNodeParams { area: 0.0, ..bare.clone() }).is_empty());
        for p in [ThermalNodeParams { area: 0.0, ..params() }, bare] {
            let all = told(p);
            assert!(all.len() == 1 && all[0].param.as_deref() == Some("area"), "{all:?}");
        }
    }
}
