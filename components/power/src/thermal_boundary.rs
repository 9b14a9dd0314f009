//! `power.thermal_boundary`: a temperature that is given, whatever heat comes: a test chamber, a cold plate, the ground.
use linkwork_runtime::prelude::*;

/// Temperature.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThermalBoundaryIn {
    /// Its temperature.
    #[port("K")]
    pub temperature: f64,
}

/// Heat.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThermalBoundaryHeat {
    /// Where links and heaters are connected.
    #[port(connector)]
    pub port: HeatFlows,
}

/// Temperature.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThermalBoundaryOut {
    /// Where links and heaters are connected.
    #[port(connector)]
    pub port: Temperature,
}

/// Heat that has come.
#[derive(State, Clone, Copy, Debug)]
pub struct Received {
    /// Heat received since the start.
    #[port("J")]
    pub energy: f64,
}

/// A given temperature.
pub struct ThermalBoundary;

/// Thermal boundary: a given temperature, whatever heat comes to it; counts the heat.
#[model("power.thermal_boundary")]
impl Model for ThermalBoundary {
    // The temperature does not follow from the heat, which is an input without feedthrough.
    type U = ThermalBoundaryHeat;
    type Ud = ThermalBoundaryIn;
    type Yd = ThermalBoundaryOut;
    type X = Received;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(ThermalBoundary)
    }
    fn direct(&self, _: &Clock, _: &Received, _: &(), u: &ThermalBoundaryIn) -> ThermalBoundaryOut {
        ThermalBoundaryOut { port: Temperature { temperature: u.temperature } }
    }
    fn deriv(&self, _: &Clock, _: &Received, _: &(), u: &ThermalBoundaryHeat) -> Received {
        Received { energy: u.port.heat }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_keeps_its_temperature_and_counts_the_heat() {
        let (c, x) = (Clock::at(0.0, 0.1, 0), Received { energy: 4.0 });
        let u = ThermalBoundaryIn { temperature: 253.0 };
        let y = ThermalBoundary.direct(&c, &x, &(), &u, &());
        assert_eq!(y.port.temperature, 253.0);
        let heat = ThermalBoundaryHeat { port: HeatFlows { heat: -7.5 } };
        assert_eq!(ThermalBoundary.deriv(&c, &x, &(), &heat, &u, &(), &y).energy, -7.5);
    }
}
