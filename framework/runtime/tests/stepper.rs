//! A part with a method of its own, written by a user: an oscillator that takes ten leapfrog steps from row to
//! row, and counts them. `saves: 0` makes it one that cannot be saved.
use crate::common;
use common::*;
use linkwork_runtime::prelude::*;
use linkwork_runtime::*;
use std::any::Any;
use std::sync::Arc;

const PIECES: u32 = 10;
const OMEGA: f64 = 3.0;

/// Makes oscillators.
struct Oscillators;

impl Making for Oscillators {
    fn describe(&self, _: &Located) -> Option<Description> {
        Some(description())
    }
    fn make(&self, params: &Located, _: &mut ReadCx<'_>) -> Option<Box<dyn Prototype>> {
        let saves = !matches!(params.get("saves").map(|v| &v.value), Some(Value::Number(0.0)));
        let params = params.value.clone();
        Some(Box::new(Oscillator { description: description(), params, saves }))
    }
}

fn description() -> Description {
    let port = |name: &'static str| PortSpec::named(name, PortKind::Numbers, 1);
    Description {
        name: "user.oscillator".into(),
        doc: "A mass on a spring, by leapfrog steps of its own.".into(),
        functions: Functions { outputs: true, steps: true, ..Functions::default() },
        inputs: vec![port("push").or(0.0)],
        outputs: vec![port("at")],
        continuous: vec![port("at"), port("speed")],
        ..Description::default()
    }
}

struct Oscillator {
    description: Description,
    params: Value,
    saves: bool,
}

impl Prototype for Oscillator {
    fn description(&self) -> &Description {
        &self.description
    }
    fn params(&self) -> &Value {
        &self.params
    }
    fn initial(&self, x: &mut [f64], _: &mut [f64]) {
        x.copy_from_slice(&[1.0, 0.0]);
    }
    fn stored(&self) -> bool {
        true
    }
    fn can_save(&self) -> Result<(), String> {
        if self.saves { Ok(()) } else { Err("its solver keeps its state to itself".into()) }
    }
    fn block(&self, wiring: Wiring) -> Box<dyn Block> {
        Box::new(Stepping { w: wiring, pieces: 0, saves: self.saves })
    }
}

struct Stepping {
    w: Wiring,
    /// Its store.
    pieces: u32,
    saves: bool,
}

impl Block for Stepping {
    fn outputs(&mut self, _: &EvalTime, x: &[f64], _: &[f64], sig: &mut [f64]) -> Outcome {
        sig[self.w.ym] = x[self.w.x];
        Ok(())
    }
    fn feedthrough(&mut self, _: &EvalTime, _: &[f64], _: &[f64], _: &mut [f64]) -> Outcome {
        Ok(())
    }
    fn derivatives(
        &mut self,
        _: &EvalTime,
        _: &[f64],
        _: &[f64],
        _: &[f64],
        _: &mut [f64],
    ) -> Outcome {
        Ok(())
    }
    fn update(&mut self, _: &EvalTime, _: &[f64], _: &mut [f64], _: &[f64]) -> Outcome {
        Ok(())
    }
    fn advance(&mut self, _: &EvalTime, h: f64, x: &mut [f64], sig: &mut [f64]) -> Outcome {
        let (push, h) = (sig[self.w.u[0] as usize], h / f64::from(PIECES));
        if push > 100.0 {
            let help = Some("push less".to_string());
            return Err(Box::new(Failure { message: "the spring broke".into(), help }));
        }
        let [at, speed] = &mut x[self.w.x..self.w.x + 2] else { return Ok(()) };
        for _ in 0..PIECES {
            *speed += 0.5 * h * (push - OMEGA * OMEGA * *at);
            *at += h * *speed;
            *speed += 0.5 * h * (push - OMEGA * OMEGA * *at);
            self.pieces += 1;
        }
        Ok(())
    }
    fn save_store(&self) -> Result<Vec<u8>, String> {
        match self.saves {
            true => Ok(self.pieces.to_le_bytes().to_vec()),
            false => Err("its solver keeps its state to itself".into()),
        }
    }
    fn load_store(&mut self, bytes: &[u8]) -> Result<(), String> {
        let bytes = bytes.try_into().map_err(|_| "four bytes are wanted".to_string())?;
        self.pieces = u32::from_le_bytes(bytes);
        Ok(())
    }
    fn copy_store(&self, into: &mut Option<Box<dyn Any + Send>>) {
        *into = Some(Box::new(self.pieces));
    }
    fn take_store(&mut self, from: &dyn Any) {
        self.pieces = from.downcast_ref().copied().unwrap_or(self.pieces);
    }
    fn fork(&self) -> Box<dyn Block> {
        Box::new(Stepping { w: self.w.clone(), pieces: self.pieces, saves: self.saves })
    }
}

/// On which side of zero.
#[derive(State, Clone, Copy, Debug)]
pub struct Above {
    /// Above zero.
    #[port]
    above: bool,
}
/// Its edge.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Zero {
    /// The input.
    #[port("1")]
    over: f64,
}
/// Whether its input is above zero.
pub struct Sign {}
/// 1 where the input is above zero, else 0.
#[model("t.sign")]
impl Model for Sign {
    const MODES: bool = true;
    type Params = ();
    type FeedthroughInputs = Required;
    type FeedthroughOutputs = One;
    type DiscreteState = Above;
    type Guards = Zero;
    fn build((): ()) -> Result<Self, BuildError> {
        Ok(Sign {})
    }
    fn feedthrough(&self, d: &Above) -> One {
        One { y: f64::from(u8::from(d.above)) }
    }
    fn mode(&self, u: &Required) -> Above {
        Above { above: u.u > 0.0 }
    }
    fn guards(&self, u: &Required) -> Zero {
        Zero { over: u.u }
    }
    fn handle_event(&self, fired: Fired<'_>) -> ((), Above) {
        ((), Above { above: fired.rose(0) })
    }
}

fn catalogue() -> Catalogue {
    let mut all = common::catalogue();
    all.add(Entry::given(description(), Arc::new(Oscillators))).unwrap();
    all.add(Entry::model::<Sign>()).unwrap();
    all
}

fn compiled(params: &[(&str, f64)], integrator: Integrator) -> Arc<Plan> {
    let parts = vec![
        part("mass", "user.oscillator", params, None),
        part("follower", "t.integrator", &[("k", 2.0)], None),
        part("held", "t.hold", &[], Some("0.15 s")),
    ];
    let mut s = spec(parts, &["mass.at -> follower.u"]);
    s.wires.push(wire("mass.at -> held.u"));
    let s = Spec { integrator, step: Seconds::new(5, 100).unwrap(), ..s };
    Arc::new(compile(&s, &catalogue(), &Files::default()).unwrap())
}

fn seconds(t: f64) -> Seconds {
    Seconds::new((t * 1000.0).round() as u128, 1000).unwrap()
}

#[test]
fn it_advances_by_its_own_method_and_split_equals_straight() {
    for integrator in Integrator::ALL.map(|(_, i)| i) {
        let plan = compiled(&[], integrator);
        let mut straight = Simulation::new(plan.clone());
        straight.run_until(seconds(2.0)).unwrap();
        // The phase of leapfrog with steps h = 5 ms is too large by a fraction (ωh)²/24.
        let phase = OMEGA * 2.0 * (1.0 + (OMEGA * 0.005_f64).powi(2) / 24.0);
        assert!((straight.get("mass.at").unwrap() - phase.cos()).abs() < 1e-6, "{integrator:?}");
        let mut cut = Simulation::new(plan.clone());
        while cut.before(seconds(2.0)) {
            cut.step().unwrap();
            let checkpoint = cut.checkpoint("").unwrap();
            cut = Simulation::new(plan.clone());
            cut.restore(&checkpoint).unwrap();
            cut = cut.fork();
        }
        // The hash includes the store of the part, which counts the pieces.
        assert_eq!(cut.hash(), straight.hash(), "{integrator:?}");
    }
}

/// It goes from row to row: an interrupt between two steps of the integrator waits for the row, and the run is that without one.
#[test]
fn an_interrupt_within_a_row_advances_nothing_twice() {
    let parts = || {
        vec![
            part("mass", "user.oscillator", &[], None),
            part("follower", "t.integrator", &[("k", 2.0)], None),
        ]
    };
    let accuracy = Some(Accuracy { step_max: 0.01, ..Accuracy::default() });
    let (integrator, step) = (Integrator::DormandPrince, Seconds::new(5, 100).unwrap());
    let s = Spec { integrator, step, accuracy, ..spec(parts(), &["mass.at -> follower.u"]) };
    let plan = Arc::new(compile(&s, &catalogue(), &Files::default()).unwrap());
    let mut straight = Simulation::new(plan.clone());
    straight.run_until(seconds(1.0)).unwrap();
    let mut sim = Simulation::new(plan);
    sim.interrupt_by(Arc::new(std::sync::atomic::AtomicBool::new(true)));
    while sim.before(seconds(1.0)) {
        assert_eq!(sim.step_watched().unwrap(), Stop::Row);
    }
    assert_eq!((sim.state(), sim.hash()), (straight.state(), straight.hash()));
}

/// An event is located on the interpolated motion, and the step that ends there comes to a place a little before or behind it: the
/// piece is that behind the event in both cases.
#[test]
fn a_piece_at_zero_is_that_behind_its_event() {
    let parts = vec![
        part("mass", "user.oscillator", &[], None),
        part("sign", "t.sign", &[], None),
        part("lit", "t.integrator", &[], None),
    ];
    let step = Seconds::new(5, 100).unwrap();
    let s = Spec { step, ..spec(parts, &["mass.at -> sign.u", "sign.y -> lit.u"]) };
    let mut sim = Simulation::new(Arc::new(compile(&s, &catalogue(), &Files::default()).unwrap()));
    let state =
        |sim: &Simulation| (sim.get("mass.at").unwrap() > 0.0, sim.get("sign.y").unwrap() > 0.5);
    // The value `row` states whether the position was above zero at the last row. It passes zero at most once
    // between two rows.
    let (mut row, mut early, mut late) = (true, 0, 0);
    while sim.time() < 12.0 {
        let stop = sim.step_event().unwrap();
        let (above, shown) = state(&sim);
        match stop {
            // `sign.y` must have the new sign even if the step to the event ends a little before
            // zero.
            Stop::Event if sim.state().micro > 0 => {
                assert_eq!(shown, !row, "at {} s", sim.time());
                if above == row { early += 1 } else { late += 1 }
            }
            Stop::Row => {
                assert_eq!(shown, above, "at {} s", sim.time());
                row = above;
            }
            _ => {}
        }
    }
    assert!(early > 1 && late > 1, "{early} {late}");
}

#[test]
fn one_that_cannot_be_saved_refuses_with_its_path_and_runs() {
    let mut sim = Simulation::new(compiled(&[("saves", 0.0)], Integrator::Rk4));
    sim.run_until(seconds(1.0)).unwrap();
    let refused = sim.checkpoint("").err().unwrap().to_string();
    assert!(refused.contains("`mass`") && refused.contains("keeps its state"), "{refused}");
    assert!(sim.can_save().is_err());
}

#[test]
fn what_it_refuses_stops_the_run_with_its_path_and_remedy() {
    let mut sim = Simulation::new(compiled(&[], Integrator::Rk4));
    sim.run_until(seconds(0.5)).unwrap();
    sim.set("mass.push", 200.0).unwrap();
    let error = sim.run_until(seconds(1.0)).err().unwrap();
    assert_eq!((error.path.as_str(), error.time), ("mass", 0.5));
    assert!(error.message.contains("the spring broke"), "{error}");
    assert_eq!(error.help.as_deref(), Some("push less"));
}
