//! `power.heat_source`: supplies a commanded heat flow to a thermal node, for example that of radioisotope heater units, or of friction in a part
//! without a heat outlet.
use linkwork_runtime::prelude::*;

/// Command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct HeatSourceIn {
    /// Heat flow to the node; negative: heat is removed.
    #[port("W")]
    pub power: f64,
}

/// Heat.
#[derive(Ports, Clone, Copy, Debug)]
pub struct HeatSourceOut {
    /// The thermal node that takes the heat.
    #[port(connector)]
    pub node: HeatFlow,
}

/// A source of heat.
pub struct HeatSource;

/// Heat source: supplies a commanded heat flow to a thermal node.
#[model("power.heat_source")]
impl Model for HeatSource {
    type FeedthroughInputs = HeatSourceIn;
    type FeedthroughOutputs = HeatSourceOut;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(HeatSource)
    }
    fn feedthrough(&self, u: &HeatSourceIn) -> HeatSourceOut {
        HeatSourceOut { node: HeatFlow { heat: u.power } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_gives_what_is_commanded() {
        for power in [12.5, -3.0] {
            let u = HeatSourceIn { power };
            let y = HeatSource.feedthrough(&u);
            assert_eq!(y.node.heat, power);
        }
    }
}
