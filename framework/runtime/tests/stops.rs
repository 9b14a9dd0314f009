//! A model stops a run with words: at its guard, at the start, in a phase that brings it; and what it only tells.
use crate::common::*;
use linkwork_runtime::prelude::*;
use linkwork_runtime::*;
use std::sync::Arc;

/// An edge.
#[derive(Params, Clone, Debug)]
pub struct EdgeParams {
    /// Where the table ends.
    #[param(default = 1.0)]
    end: f64,
    /// State at the start.
    #[param(default = 0.0)]
    start: f64,
    /// 1: beyond the end the run stops.
    #[param(default = 1.0)]
    stop: f64,
}
/// Distance.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Inside {
    /// Distance from the end.
    #[port("1", falling)]
    inside: f64,
}
/// How often it left.
#[derive(State, Clone, Copy, Debug)]
pub struct LeftAt {
    /// How often.
    #[port("1")]
    count: f64,
}
/// A table that ends.
pub struct Table {
    p: EdgeParams,
}
impl Table {
    fn says(&self, x: f64) -> BuildError {
        let fact = format!("{x:.6} is beyond {}", self.p.end);
        BuildError::new(fact).help("extend the table").at("end").stopping(self.p.stop > 0.5)
    }
}
/// ẋ = 1 + min(x, end).
#[model("t.table")]
impl Model for Table {
    type Params = EdgeParams;
    type Outputs = One;
    type State = X;
    type DiscreteState = LeftAt;
    type Guards = Inside;
    fn init_x(&self) -> X {
        X { x: self.p.start }
    }
    fn outputs(&self, x: &X) -> One {
        One { y: x.x }
    }
    fn derivatives(&self, x: &X) -> X {
        X { x: 1.0 + x.x.min(self.p.end) }
    }
    fn guards(&self, x: &X) -> Inside {
        Inside { inside: self.p.end - x.x }
    }
    fn handle_event(&self, x: &X, d: &LeftAt) -> (X, LeftAt) {
        (*x, LeftAt { count: d.count + 1.0 })
    }
    fn runtime_warning(&self, x: &X) -> Option<BuildError> {
        Some(self.says(x.x))
    }
    fn startup_warnings(&self, x: &X) -> Vec<BuildError> {
        (x.x > self.p.end).then(|| self.says(x.x)).into_iter().collect()
    }
}

fn all() -> Catalogue {
    Catalogue::new([vec![
        Entry::model::<Table>(),
        Entry::model::<Integral>(),
        Entry::model::<Gain>(),
    ]])
}

const METHODS: [Integrator; 6] = [
    Integrator::SemiImplicitEuler,
    Integrator::Rk4,
    Integrator::BogackiShampine,
    Integrator::DormandPrince,
    Integrator::Verner,
    Integrator::Rodas,
];

fn table(params: &[(&str, f64)]) -> Spec {
    let parts = vec![
        part("cell.table", "t.table", params, None),
        part("other", "t.integrator", &[("k", 3.0)], None),
    ];
    spec(parts, &[])
}

fn compiled(mut s: Spec, integrator: Integrator) -> Arc<Plan> {
    (s.integrator, s.step) = (integrator, seconds(0.1));
    s.accuracy = (integrator.method().error_order() > 0).then(Accuracy::default);
    Arc::new(compile(&s, &all(), &Files::default()).unwrap_or_else(|e| panic!("{e}")))
}

fn phase(name: &str, spec: Spec, to: &[(&str, &str)]) -> PhaseSpec {
    let transition = |(to, when): &(&str, &str)| TransitionSpec {
        to: (*to).into(),
        when: (*when).into(),
        origin: Origin::NONE,
    };
    let transitions = to.iter().map(transition).collect();
    PhaseSpec { name: name.into(), spec, transitions, watches: Vec::new(), origin: Origin::NONE }
}

const WORDS: [&str; 2] = ["`cell.table`: 1.000000 is beyond 1", "help: extend the table"];

/// x = eᵗ − 1 passes 1 at ln 2: every method stops there, by the part's path and words, with numbers that hold; and again when it is
/// told to go on, from a checkpoint of that instant or of an earlier one.
#[test]
fn a_guard_that_stops_the_run_ends_it_at_its_instant_with_the_words_of_the_part() {
    for integrator in METHODS {
        let plan = compiled(table(&[]), integrator);
        let mut sim = Simulation::new(plan.clone());
        let error = sim.run_until(seconds(2.0)).unwrap_err();
        for words in WORDS {
            assert!(error.to_string().contains(words), "{integrator:?}: {error}");
        }
        let (at, order) = (2f64.ln(), if integrator == METHODS[0] { 0.04 } else { 1e-4 });
        assert!((error.time - at).abs() < order && error.path == "cell.table", "{error}");
        assert_eq!(sim.time(), error.time);
        assert!((sim.get("cell.table.y").unwrap() - 1.0).abs() < 1e-9, "{integrator:?}");
        assert!((sim.get("other.y").unwrap() - 3.0 * error.time).abs() < 1e-9);
        assert_eq!(sim.get("cell.table.state.count").unwrap(), 0.0, "it has not fired");
        assert!(sim.take_notices().is_empty(), "what stops a run is its error");
        // Further calls return the same error and do not advance the run.
        assert_eq!(sim.step().unwrap_err(), error);
        assert_eq!(sim.step_event().unwrap_err(), error);
        let mut again = Simulation::new(plan.clone());
        again.restore(&sim.checkpoint("").unwrap()).unwrap();
        assert_eq!(again.run_until(seconds(2.0)).unwrap_err(), error);
        assert_eq!((again.state(), again.hash()), (sim.state(), sim.hash()));
        // Split runs stop bit-identically.
        let mut cut = Simulation::new(plan.clone());
        cut.run_until(seconds(0.3)).unwrap();
        let mut rest = Simulation::new(plan.clone());
        rest.restore(&cut.checkpoint("").unwrap()).unwrap();
        assert_eq!(rest.run_until(seconds(2.0)).unwrap_err(), error, "{integrator:?}");
        assert_eq!((rest.state(), rest.hash()), (sim.state(), sim.hash()), "{integrator:?}");
    }
}

#[test]
fn what_only_tells_tells_once_and_goes_on_also_under_a_profile() {
    let plan = compiled(table(&[("stop", 0.0)]), Integrator::Rk4);
    for profiled in [false, true] {
        let mut sim = Simulation::new(plan.clone());
        let profile = profiled.then(|| sim.profile());
        sim.run_until(seconds(2.0)).unwrap();
        let told = sim.take_notices();
        assert_eq!((told.len(), profile.is_some()), (1, profiled), "{told:?}");
        assert!((told[0].0 - 2f64.ln()).abs() < 1e-4 && WORDS[0] == told[0].1.message);
        assert_eq!(sim.get("cell.table.state.count").unwrap(), 1.0);
    }
}

/// A start beyond the end is refused before the first step, until the state is another. One that is only told is a remark.
#[test]
fn a_start_that_a_part_refuses_is_no_start() {
    let plan = compiled(table(&[("start", 1.5)]), Integrator::DormandPrince);
    let mut sim = Simulation::new(plan.clone());
    assert!(sim.startup_warnings().is_empty(), "it is an error, no warning");
    let error = sim.check().unwrap_err();
    assert!(error.to_string().contains("`cell.table`: 1.500000 is beyond 1"), "{error}");
    assert_eq!((error.time, error.help.as_deref()), (0.0, Some("extend the table")));
    assert_eq!(sim.step().unwrap_err(), error);
    assert_eq!(sim.fork().run_until(seconds(1.0)).unwrap_err(), error);
    // The check uses the present state: a state that was set can cause or remove the error.
    sim.set("cell.table.state.x", 1.2).unwrap();
    let still = sim.check().unwrap_err();
    assert!(still.message.contains("1.200000"), "{still}");
    sim.set("cell.table.state.x", 0.5).unwrap();
    sim.check().unwrap();
    let (mut snapshot, inside) = (Snapshot::default(), sim.checkpoint("").unwrap());
    sim.save_into(&mut snapshot);
    let stops = sim.run_until(seconds(1.0)).unwrap_err();
    // ẋ = 1 + x from x = ½ reaches 1 when 2 = 1.5 eᵗ.
    assert!((stops.time - (4f64 / 3.0).ln()).abs() < 1e-6, "{stops}");
    // A state that was restored from another run is checked like a state of this run.
    let mut other = Simulation::new(plan.clone());
    other.restore(&inside).unwrap();
    assert_eq!(other.run_until(seconds(1.0)).unwrap_err(), stops);
    let mut other = Simulation::new(plan.clone());
    other.load_from(&snapshot).unwrap();
    assert_eq!(other.run_until(seconds(1.0)).unwrap_err(), stops);
    let beyond = Simulation::new(plan).checkpoint("").unwrap();
    other.restore(&beyond).unwrap();
    assert_eq!(other.step().unwrap_err(), error);
    // With `stop: 0`, the part only warns.
    let told = compiled(table(&[("start", 1.5), ("stop", 0.0)]), Integrator::Rk4);
    let mut sim = Simulation::new(told);
    assert!(sim.startup_warnings()[0].message.contains("1.500000 is beyond 1"));
    sim.check().and_then(|()| sim.step()).unwrap();
}

/// What stopped a run is due no more where the state, or the part, was changed so that it is inside again: the run goes on, and stops where it leaves again.
#[test]
fn a_run_that_was_put_back_inside_goes_on() {
    for integrator in METHODS {
        let plan = compiled(table(&[]), integrator);
        let mut sim = Simulation::new(plan.clone());
        let first = sim.run_until(seconds(3.0)).unwrap_err();
        // Setting another variable does not remove the error.
        sim.set("other.state.x", 0.3).unwrap();
        assert_eq!(sim.step().unwrap_err().message, first.message, "{integrator:?}");
        sim.set("cell.table.state.x", 0.5).unwrap();
        let again = sim.run_until(seconds(3.0)).unwrap_err();
        let after = again.time - first.time;
        // Euler is of first order.
        let order = if integrator == METHODS[0] { 0.08 } else { 1e-4 };
        assert!((after - (4f64 / 3.0).ln()).abs() < order, "{integrator:?}: {after}");
        assert!(again.message.contains("1.000000 is beyond 1"), "{again}");
        // Continue with a longer table.
        let mut sim = Simulation::new(plan);
        sim.run_until(seconds(3.0)).unwrap_err();
        sim.move_to(compiled(table(&[("end", 2.0)]), integrator)).unwrap();
        let later = sim.run_until(seconds(3.0)).unwrap_err();
        assert!((later.time - 3f64.ln()).abs() < order, "{integrator:?}: {later}");
        assert!(later.message.contains("2.000000 is beyond 2"), "{later}");
    }
}

/// A part that goes over from being told to being stopped, and is outside, is judged at the transition; so is a checkpoint of it.
#[test]
fn a_part_that_is_to_stop_from_a_phase_on_stops_there() {
    let phases = [
        phase("told", table(&[("stop", 0.0)]), &[("stopped", "time > 0.95 s")]),
        phase("stopped", table(&[]), &[]),
    ];
    let program = compile_program(&phases, &all(), &Files::default());
    let program = Arc::new(program.unwrap_or_else(|e| panic!("{e}")));
    let mut sim = Simulation::of(program.clone());
    sim.run_until(seconds(0.9)).unwrap();
    assert_eq!(sim.take_notices().len(), 1);
    let error = sim.run_until(seconds(2.0)).unwrap_err();
    assert!((error.time - 0.95).abs() < 1e-9 && error.message.contains("is beyond 1"), "{error}");
    assert_eq!(sim.phase(), "stopped");
    assert_eq!(sim.step().unwrap_err(), error);
    let mut cut = Simulation::of(program);
    cut.restore(&sim.checkpoint("").unwrap()).unwrap();
    assert_eq!(cut.step().unwrap_err(), error);
    assert_eq!((cut.state(), cut.hash()), (sim.state(), sim.hash()));
}

/// A phase that brings a part which cannot begin there ends the run at the transition; so does an edit.
#[test]
fn a_phase_whose_part_refuses_its_start_ends_the_run_there() {
    let alone = || spec(vec![part("other", "t.integrator", &[("k", 3.0)], None)], &[]);
    let phases =
        [phase("a", alone(), &[("b", "time > 0.25 s")]), phase("b", table(&[("start", 1.5)]), &[])];
    let program = compile_program(&phases, &all(), &Files::default());
    let program = Arc::new(program.unwrap_or_else(|e| panic!("{e}")));
    let mut sim = Simulation::of(program);
    let error = sim.run_until(seconds(1.0)).unwrap_err();
    assert!((error.time - 0.25).abs() < 1e-9, "{error}");
    assert!(error.message.contains("`cell.table`: 1.500000 is beyond 1"), "{error}");
    assert_eq!(sim.step().unwrap_err(), error);
    assert_eq!(sim.phase(), "b");
    let mut sim = Simulation::new(compiled(alone(), Integrator::Rk4));
    sim.run_until(seconds(0.5)).unwrap();
    let refused = compiled(table(&[("start", 1.5)]), Integrator::Rk4);
    sim.move_to(refused).unwrap();
    assert!(sim.check().unwrap_err().message.contains("1.500000 is beyond 1"));
    sim.move_to(compiled(table(&[("end", 1.2), ("start", 1.5)]), Integrator::Rk4)).unwrap();
    assert!(sim.step().unwrap_err().message.contains("1.500000 is beyond 1.2"));
    sim.move_to(compiled(table(&[("end", 2.0), ("start", 1.5)]), Integrator::Rk4)).unwrap();
    sim.check().and_then(|()| sim.step()).unwrap();
}
