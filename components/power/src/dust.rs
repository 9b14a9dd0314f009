//! `power.dust`: dust that settles on a surface and is blown off by gusts.
//! ```text
//! ḟ = −k f                                     f: share of the light that passes
//! where the wind rises through `wind`: f⁺ = f + cleaned (1 − f)
//! ```
//! Each layer absorbs the same fraction of the light that passes the layers above it. A gust cleans once, at its beginning, which is an event. On
//! Mars 0.2 % to 0.3 % of the light are lost per sol between gusts.

use linkwork_runtime::prelude::*;

/// Deposition and removal of dust.
#[derive(Params, Clone, Debug)]
pub struct DustParams {
    /// Fraction of the light that passes at the start.
    #[param(default = 1.0, range = 0.0..=1.0)]
    pub passes: f64,
    /// Rate k at which that fraction decreases, such as "0.28 %/sol" on Mars.
    #[param(unit = "1/s", range = 0.0..)]
    pub settling: f64,
    /// Wind speed at and above which a gust cleans the surface.
    #[param(unit = "m/s", default = 20.0, range = 0.0..)]
    pub wind: f64,
    /// Fraction of the lost light that a gust restores.
    #[param(default = 0.7, range = 0.0..=1.0)]
    pub cleaned: f64,
}

/// The wind.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DustIn {
    /// Speed of the wind over the surface.
    #[port("m/s", default = 0.0)]
    pub wind: f64,
}

/// Fraction of the light that passes.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DustOut {
    /// Fraction of the light that passes, for the input `passes` of a solar panel.
    #[port("1")]
    pub passes: f64,
}

/// Fraction of the light that passes.
#[derive(State, Clone, Copy, Debug)]
pub struct Layer {
    /// Fraction of the light that passes.
    #[port("1")]
    pub passes: f64,
}

/// Gusts so far.
#[derive(State, Clone, Copy, Debug, PartialEq)]
pub struct Gusts {
    /// Gusts that have cleaned.
    #[port("1")]
    pub gusts: f64,
}

/// The gust.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DustGuards {
    /// Wind speed minus the speed that cleans.
    #[port("m/s", rising)]
    pub above_wind: f64,
}

/// Dust on a surface.
pub struct Dust {
    p: DustParams,
}

/// Dust that settles on a solar panel and is blown off by gusts, which are events.
#[model("power.dust")]
impl Model for Dust {
    type Params = DustParams;
    type Inputs = DustIn;
    type Outputs = DustOut;
    type State = Layer;
    type DiscreteState = Gusts;
    type Guards = DustGuards;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let calm = "no gust cleans the surface";
        ["wind", "cleaned"].map(|name| (Judge::Param(name), unwired(wired, "wind", calm))).into()
    }
    fn init_x(&self) -> Layer {
        Layer { passes: self.p.passes }
    }
    fn outputs(&self, x: &Layer) -> DustOut {
        DustOut { passes: x.passes }
    }
    fn derivatives(&self, x: &Layer) -> Layer {
        Layer { passes: -self.p.settling * x.passes }
    }
    fn guards(&self, u: &DustIn) -> DustGuards {
        DustGuards { above_wind: u.wind - self.p.wind }
    }
    fn handle_event(&self, x: &Layer, d: &Gusts) -> (Layer, Gusts) {
        let passes = x.passes + self.p.cleaned * (1.0 - x.passes);
        (Layer { passes }, Gusts { gusts: d.gusts + 1.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gust_gives_back_its_share_and_settling_takes_its_own() {
        let p = DustParams { passes: 0.8, settling: 3e-8, wind: 12.0, cleaned: 0.75 };
        let dust = Dust { p };
        let (x, d) = (dust.init_x(), Gusts { gusts: 2.0 });
        let u = DustIn { wind: 11.0 };
        assert_eq!(dust.derivatives(&x).passes, -3e-8 * 0.8);
        assert_eq!(dust.guards(&u).above_wind, -1.0);
        let (x, d) = dust.handle_event(&x, &d);
        assert!((x.passes - 0.95).abs() < 1e-15 && d.gusts == 3.0, "{x:?}");
        assert_eq!(dust.outputs(&x).passes, x.passes);
    }
}
