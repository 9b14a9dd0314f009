//! A library of models as a user writes it: the macros work with the façade as the only dependency.
use linkwork::prelude::*;

/// Strength and law.
#[derive(Params, Clone, Debug)]
pub struct FanParams {
    /// Torque at one volt.
    #[param(unit = "N m/V", default = 0.1, range = 0.0..)]
    pub gain: f64,
    /// Law of the blades.
    #[param(default = Law::Linear)]
    pub law: Law,
}
/// Laws.
#[derive(Params, Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// Torque follows the voltage.
    Linear,
    /// Torque follows the square of the voltage.
    Square,
}
/// Supply.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FanIn {
    /// Terminal voltage.
    #[port("V", default = 2.0)]
    pub volts: f64,
}
/// Torque.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FanOut {
    /// Torque of the blades.
    #[port("N m")]
    pub torque: f64,
}
/// Speed.
#[derive(State, Clone, Copy, Debug)]
pub struct FanState {
    /// Lagged voltage.
    #[port("V")]
    pub volts: f64,
}
/// A fan.
pub struct Fan {
    p: FanParams,
}

/// A fan that follows its voltage with a lag of one second.
#[model("outsider.fan")]
impl Model for Fan {
    type Params = FanParams;
    type U = FanIn;
    type Ym = FanOut;
    type X = FanState;
    fn moore(&self, _: &Clock, x: &FanState) -> FanOut {
        let drive = match self.p.law {
            Law::Linear => x.volts,
            Law::Square => x.volts * x.volts.abs(),
        };
        FanOut { torque: self.p.gain * drive }
    }
    fn deriv(&self, _: &Clock, x: &FanState, _: &(), u: &FanIn) -> FanState {
        FanState { volts: u.volts - x.volts }
    }
}

/// Nothing pulls.
pub struct Weightless;
impl Gravity for Weightless {
    fn acceleration(&self, _: f64, _: Vec3) -> Vec3 {
        Vec3::zeros()
    }
}
/// No gravity at all.
#[service("outsider.weightless", Gravity)]
impl Service for Weightless {
    type Params = ();
    fn build(_: (), _: &Files) -> Result<Self, BuildError> {
        Ok(Weightless)
    }
}

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![Entry::model::<Fan>(), Entry::service::<Weightless>()]
}

#[cfg(test)]
mod tests {
    use linkwork::runtime::{
        Catalogue, Files, PartSpec, Seconds, Simulation, Spec, Value, compile,
    };

    #[test]
    fn a_fan_runs_up() {
        let law = Value::Map(vec![("law".into(), Value::Text("square".into()).into())]);
        let nothing = Value::Map(Vec::new());
        let spec = Spec {
            parts: vec![
                PartSpec::new("fan", "outsider.fan", law),
                PartSpec::new("space", "outsider.weightless", nothing),
            ],
            ..Spec::default()
        };
        let catalogue = Catalogue::new([super::catalogue()]);
        let plan = compile(&spec, &catalogue, &Files::default()).unwrap();
        let mut sim = Simulation::new(plan.into());
        sim.run_until(Seconds { num: 1, den: 1 }).unwrap();
        let volts = 2.0 * (1.0 - (-1f64).exp());
        assert!((sim.get("fan.torque").unwrap() - 0.1 * volts * volts).abs() < 1e-9);
    }
}
