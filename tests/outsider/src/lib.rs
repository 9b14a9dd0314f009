//! A library of models as a user writes it: the macros work with the façade as the only dependency.
use linkwork::model::prelude::*;

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
    type Inputs = FanIn;
    type Outputs = FanOut;
    type State = FanState;
    fn outputs(&self, x: &FanState) -> FanOut {
        let drive = match self.p.law {
            Law::Linear => x.volts,
            Law::Square => x.volts * x.volts.abs(),
        };
        FanOut { torque: self.p.gain * drive }
    }
    fn derivatives(&self, x: &FanState, u: &FanIn) -> FanState {
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

/// Tanks in a row.
#[derive(Params, Clone, Debug)]
pub struct TanksParams {
    /// How many tanks.
    #[param(range = 1.0..=100.0)]
    pub tanks: f64,
    /// Content of each at the start.
    #[param(unit = "kg", range = 0.0..)]
    pub filled: f64,
}
/// Tanks that empty, each by its own drain. A tank that runs dry closes.
pub struct Tanks {
    p: TanksParams,
}
/// Tanks that empty, each by its own drain; one that runs dry closes.
#[model("outsider.tanks")]
impl SizedModel for Tanks {
    type Params = TanksParams;
    fn ports(p: &TanksParams) -> SizedPorts {
        let each = |name: &'static str, unit: &'static str, doc: &'static str| {
            PortSpec::named(name, PortKind::Numbers, p.tanks as usize).unit_of(unit).doc_of(doc)
        };
        let dry = PortSpec::named("dry", PortKind::Numbers, 1).unit_of("1").doc_of("Dry tanks.");
        SizedPorts {
            inputs: vec![each("drain", "kg/s", "Mass flow out of each tank.").or(0.0)],
            outputs: vec![each("mass", "kg", "Content of each tank."), dry.clone()],
            continuous: vec![each("mass", "kg", "Content of each tank.")],
            discrete: vec![each("closed", "1", "Whether a tank is closed."), dry],
            guards: vec![each("left", "kg", "Content that is left.").when(Direction::Falling)],
            ..SizedPorts::default()
        }
    }
    fn build(p: TanksParams) -> Result<Self, BuildError> {
        match p.tanks.fract() == 0.0 {
            true => Ok(Tanks { p }),
            false => Err(BuildError::new("tanks are whole").help("write e.g. 3").at("tanks")),
        }
    }
    fn initial(&self, x: &mut [f64], _: &mut [f64]) {
        x.fill(self.p.filled);
    }
    fn outputs(&self, x: &[f64], d: &[f64], y: &mut [f64]) {
        y[..x.len()].copy_from_slice(x);
        y[x.len()] = d[x.len()];
    }
    fn derivatives(&self, x: &[f64], d: &[f64], u: &[f64], rates: &mut [f64]) {
        for k in 0..x.len() {
            rates[k] = if d[k] > 0.5 { 0.0 } else { -u[k] };
        }
    }
    fn guards(&self, x: &[f64], values: &mut [f64]) {
        values.copy_from_slice(x);
    }
    fn handle_event(&self, fired: Fired<'_>, x: &mut [f64], d: &mut [f64]) {
        for i in (0..x.len()).filter(|i| fired.is_due(*i)) {
            (x[i], d[i]) = (0.0, 1.0);
            d[x.len()] += 1.0;
        }
    }
}

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![Entry::model::<Fan>(), Entry::sized::<Tanks>(), Entry::service::<Weightless>()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork::prelude::*;

    #[test]
    fn a_fan_runs_up() {
        let mut assembly = Assembly::new();
        assembly.part::<Fan>("fan", |p| p.law(Law::Square));
        assembly.part::<Weightless>("space", |p| p);
        let mut sim = assembly.simulation().unwrap();
        sim.run_until(1.0).unwrap();
        let volts = 2.0 * (1.0 - (-1f64).exp());
        assert!((sim.get("fan.torque").unwrap() - 0.1 * volts * volts).abs() < 1e-9);
    }

    /// A state machine over a part with as many ports as a parameter says, and guards.
    #[test]
    fn tanks_run_dry_one_after_another_and_the_mission_goes_on() {
        let mut mission = Assembly::new();
        mission.with_library(&Library::default().with(catalogue()));
        mission.part::<Tanks>("Tanks", |p| p.tanks(3.0).set("filled", "2 kg"));
        mission.step("100 ms").integrator(Integrator::DormandPrince);
        mission.set("start", "draining").set(
            "phases",
            fields! {
                draining: fields! { to: fields! { coasting: "Tanks.dry > 1.5" } },
                coasting: fields! { parts: fields! { Fan: fields! { model: "outsider.fan" } } },
            },
        );
        let mut sim = mission.simulation().unwrap();
        for (k, drain) in [1.0, 0.5, 0.0].into_iter().enumerate() {
            sim.set(&format!("Tanks.drain[{k}]"), drain).unwrap();
        }
        sim.run_until(3.0).unwrap();
        assert_eq!((sim.get("Tanks.dry").unwrap(), sim.phase()), (1.0, "draining"));
        sim.run_until(5.0).unwrap();
        // The tanks are empty at 2 s and 4 s; the fan speeds up from then on.
        assert_eq!((sim.get("Tanks.dry").unwrap(), sim.phase()), (2.0, "coasting"));
        assert_eq!(sim.get("Tanks.mass[2]").unwrap(), 2.0);
        let volts = 2.0 * (1.0 - (-1f64).exp());
        assert!((sim.get("Fan.torque").unwrap() - 0.1 * volts).abs() < 1e-8);
    }
}
