//! Models whose ports follow from their parameters.
use crate::common::*;
use linkwork_runtime::prelude::*;
use linkwork_runtime::*;
use std::sync::Arc;

/// How many wheels.
#[derive(Params, Clone, Debug)]
pub struct FleetParams {
    /// Number of wheels.
    #[param(range = 1.0..=64.0)]
    wheels: f64,
    /// Lag.
    #[param(unit = "s", default = 0.5)]
    time: f64,
}
/// A rate command to each wheel, followed with a lag; counts how often any wheel passes 1 rad/s.
pub struct Fleet {
    p: FleetParams,
}
/// Follows a command for each wheel.
#[model("t.fleet")]
impl SizedModel for Fleet {
    type Params = FleetParams;
    type Store = Vec<u32>;
    fn ports(p: &FleetParams) -> SizedPorts {
        let n = p.wheels as usize;
        let rates = |name: &'static str| {
            PortSpec::named(name, PortKind::Numbers, n).unit_of("1").doc_of("Rates.")
        };
        SizedPorts {
            inputs: vec![rates("wanted").or(0.0)],
            outputs: vec![rates("rate"), PortSpec::named("fast", PortKind::Numbers, 1)],
            continuous: vec![rates("rate")],
            discrete: vec![PortSpec::named("fast", PortKind::Numbers, 1)],
            guards: vec![rates("over").when(Direction::Rising)],
            ..SizedPorts::default()
        }
    }
    fn build(p: FleetParams) -> Result<Self, BuildError> {
        if p.wheels.fract() != 0.0 {
            return Err(BuildError::new("half a wheel").help("write a whole number").at("wheels"));
        }
        Ok(Fleet { p })
    }
    fn outputs(&self, x: &[f64], d: &[f64], y: &mut [f64]) {
        y[..x.len()].copy_from_slice(x);
        y[x.len()] = d[0];
    }
    fn derivatives(&self, x: &[f64], u: &[f64], rates: &mut [f64]) {
        for ((rate, x), u) in rates.iter_mut().zip(x).zip(u) {
            *rate = (u - x) / self.p.time;
        }
    }
    fn guards(&self, x: &[f64], values: &mut [f64]) {
        values.iter_mut().zip(x).for_each(|(values, x)| *values = x - 1.0);
    }
    fn handle_event(&self, fired: Fired<'_>, d: &mut [f64], store: &mut Vec<u32>) {
        d[0] += 1.0;
        store.extend((0..d.len() as u32 + 9).filter(|k| fired.is_due(*k as usize)));
    }
}

fn compiled(wheels: f64, wires: &[&str]) -> Result<Arc<Plan>, String> {
    let library = Catalogue::new([vec![Entry::sized::<Fleet>(), Entry::model::<Integral>()]]);
    let parts = vec![
        part("fleet", "t.fleet", &[("wheels", wheels)], None),
        part("ramp", "t.integrator", &[("k", 2.0)], None),
    ];
    let mut s = spec(parts, &[]);
    s.wires = wires
        .iter()
        .map(|w| {
            let (from, to) = w.split_once(" -> ").unwrap();
            let end = |text: &str| {
                let (part, port) = text.split_once('.').unwrap();
                let (port, index) = match port.split_once('[') {
                    Some((port, k)) => (port, k.trim_end_matches(']').parse().ok()),
                    None => (port, None),
                };
                PortRef { part: part.into(), port: port.into(), index }
            };
            WireSpec {
                from: end(from),
                to: end(to),
                timing: Default::default(),
                text: (*w).into(),
                origin: Origin::NONE,
            }
        })
        .collect();
    s.step = seconds(0.1);
    compile(&s, &library, &Files::default()).map(Arc::new).map_err(|e| e.to_string())
}

#[test]
fn ports_are_as_many_as_the_parameter_says() {
    for n in [1, 4, 6] {
        let plan = compiled(f64::from(n), &[]).unwrap();
        let rates = plan.variables.keys().filter(|k| k.starts_with("fleet.rate")).count();
        assert_eq!(rates, n as usize);
        assert_eq!(plan.guards.len(), n as usize);
        assert_eq!(plan.parts[0].prototype.description().name, "t.fleet");
    }
    let beyond = compiled(4.0, &["fleet.rate[4] -> ramp.u"]).err().unwrap();
    assert!(beyond.contains("rate[4]") && beyond.contains("rate[3]"), "{beyond}");
    let half = compiled(2.5, &[]).err().unwrap();
    assert!(half.contains("half a wheel"), "{half}");
    let none = compiled(0.0, &[]).err().unwrap();
    assert!(none.contains("wheels"), "{none}");
}

#[test]
fn lanes_run_by_themselves_and_split_equals_straight() {
    let plan = compiled(3.0, &["ramp.y -> fleet.wanted[1]"]).unwrap();
    let mut sim = Simulation::new(plan.clone());
    sim.set("fleet.wanted[2]", 3.0).unwrap();
    let mut cut = sim.fork();
    sim.run_until(seconds(4.0)).unwrap();
    // x(t) = 3 (1 − e^(−2t)) passes 1 at ½ ln 1.5 s; the wheel that follows the ramp passes 1
    // later, and wheel 0 never.
    assert_eq!(sim.get("fleet.fast").unwrap(), 2.0);
    let expected = 3.0 * (1.0 - (-8.0_f64).exp());
    assert!((sim.get("fleet.rate[2]").unwrap() - expected).abs() < 1e-4);
    assert_eq!(sim.get("fleet.rate[0]").unwrap(), 0.0);
    while cut.before(seconds(4.0)) {
        cut.step_event().unwrap();
        let checkpoint = cut.checkpoint("").unwrap();
        cut = Simulation::new(plan.clone());
        cut.restore(&checkpoint).unwrap();
    }
    assert_eq!(cut.hash(), sim.hash());
    let mut again = Simulation::new(plan);
    again.run_until(seconds(1.0)).unwrap();
    let end = seconds(3.0);
    let info = allocation_counter::measure(|| again.run_until(end).unwrap());
    assert_eq!(info.count_total, 0);
}
