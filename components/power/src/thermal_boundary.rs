//! `power.thermal_boundary`: a given temperature that does not depend on the heat flow, such as a test chamber, a cold plate or the ground.
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
    /// Connection for links and heaters.
    #[port(connector)]
    pub port: HeatFlows,
}

/// Temperature.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThermalBoundaryOut {
    /// Connection for links and heaters.
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

/// Thermal boundary: a given temperature, independent of the heat flow; integrates the heat.
#[model("power.thermal_boundary")]
impl Model for ThermalBoundary {
    // The temperature does not follow from the heat, which is an input without feedthrough.
    type Inputs = ThermalBoundaryHeat;
    type FeedthroughInputs = ThermalBoundaryIn;
    type FeedthroughOutputs = ThermalBoundaryOut;
    type State = Received;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(ThermalBoundary)
    }
    fn feedthrough(&self, ud: &ThermalBoundaryIn) -> ThermalBoundaryOut {
        ThermalBoundaryOut { port: Temperature { temperature: ud.temperature } }
    }
    fn derivatives(&self, u: &ThermalBoundaryHeat) -> Received {
        Received { energy: u.port.heat }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_keeps_its_temperature_and_counts_the_heat() {
        let u = ThermalBoundaryIn { temperature: 253.0 };
        let y = ThermalBoundary.feedthrough(&u);
        assert_eq!(y.port.temperature, 253.0);
        let heat = ThermalBoundaryHeat { port: HeatFlows { heat: -7.5 } };
        assert_eq!(ThermalBoundary.derivatives(&heat).energy, -7.5);
    }
}
