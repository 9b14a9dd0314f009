//! `power.thermal_link`: heat between two nodes, by conduction and by radiation from surface to surface.
//! ```text
//! Q = G (T_a − T_b) + E σ (T_a⁴ − T_b⁴)           from a to b
//! ```
//! The heat that leaves one node equals the heat that enters the other, so a network of links conserves heat.

use crate::thermal_node::radiation;
use linkwork_runtime::prelude::*;

/// Conductance and radiative exchange of the link.
#[derive(Params, Clone, Debug)]
pub struct ThermalLinkParams {
    /// Conductance: k A/L for a bar, 1/(1/G₁ + 1/G₂) for parts in series.
    #[param(unit = "W/K", default = 0.0, range = 0.0..)]
    pub conductance: f64,
    /// Area of radiative exchange: area × view factor × effective emissivity.
    #[param(unit = "m^2", default = 0.0, range = 0.0..)]
    pub exchange_area: f64,
}

/// The two temperatures.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThermalLinkIn {
    /// End a.
    #[port(connector)]
    pub a: Temperature,
    /// End b.
    #[port(connector)]
    pub b: Temperature,
}

/// Heat at both ends.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThermalLinkOut {
    /// End a.
    #[port(connector)]
    pub a: HeatFlow,
    /// End b: it receives the heat that a loses.
    #[port(connector)]
    pub b: HeatFlow,
}

/// A thermal link.
pub struct ThermalLink {
    p: ThermalLinkParams,
}

/// Heat flow between two nodes by conductance and by radiation from surface to surface.
#[model("power.thermal_link")]
impl Model for ThermalLink {
    type Params = ThermalLinkParams;
    type FeedthroughInputs = ThermalLinkIn;
    type FeedthroughOutputs = ThermalLinkOut;
    fn feedthrough(&self, u: &ThermalLinkIn) -> ThermalLinkOut {
        let p = &self.p;
        let (a, b) = (u.a.temperature, u.b.temperature);
        let heat = p.conductance * (a - b) + p.exchange_area * radiation(a, b);
        ThermalLinkOut { a: HeatFlow { heat: -heat }, b: HeatFlow { heat } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal_node::STEFAN_BOLTZMANN;

    fn link(conductance: f64, exchange_area: f64) -> ThermalLink {
        ThermalLink { p: ThermalLinkParams { conductance, exchange_area } }
    }

    fn heat(l: &ThermalLink, a: f64, b: f64) -> ThermalLinkOut {
        let [a, b] = [a, b].map(|temperature| Temperature { temperature });
        l.feedthrough(&ThermalLinkIn { a, b })
    }

    #[test]
    fn heat_goes_from_warm_to_cold_and_none_is_lost_on_the_way() {
        let l = link(0.7, 0.3);
        let y = heat(&l, 310.0, 250.0);
        let wanted = 0.7 * 60.0 + 0.3 * STEFAN_BOLTZMANN * (310f64.powi(4) - 250f64.powi(4));
        assert!((y.b.heat - wanted).abs() < 1e-12 * wanted, "{y:?}");
        assert_eq!(y.a.heat + y.b.heat, 0.0);
        let back = heat(&l, 250.0, 310.0);
        assert_eq!((back.a.heat, back.b.heat), (y.b.heat, y.a.heat));
        assert_eq!(heat(&l, 288.0, 288.0).b.heat, 0.0);
    }

    #[test]
    fn radiation_between_nearly_equal_temperatures_is_four_sigma_t_cubed() {
        // The difference of the fourth powers has lost half of its digits here: it is 4 σ T³ ΔT to
        // nine digits.
        let dt = 1e-7;
        let y = heat(&link(0.0, 1.0), 300.0 + dt, 300.0);
        let wanted = 4.0 * STEFAN_BOLTZMANN * 300f64.powi(3) * ((300.0 + dt) - 300.0);
        assert!((y.b.heat / wanted - 1.0).abs() < 1e-9, "{} {wanted}", y.b.heat);
    }
}
