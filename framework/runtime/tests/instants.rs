//! Instants between and at rows: what is due at the start, after a change from outside, after a move to other plans, and when a run
//! continues from where it stopped.
use crate::common::*;
use linkwork_runtime::prelude::*;
use linkwork_runtime::*;
use std::sync::Arc;

/// When it fires.
#[derive(Params, Clone, Debug)]
pub struct LatchParams {
    /// Threshold of the input.
    #[param(default = 0.5)]
    at: f64,
}
/// What has come.
#[derive(State, Clone, Copy, Debug)]
pub struct Fires {
    /// Times that it has fired.
    #[port("1")]
    count: f64,
}
/// How far.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Over {
    /// Input over the threshold.
    #[port("1", rising)]
    over: f64,
}
/// A latch.
pub struct Latch {
    p: LatchParams,
}
/// Counts how often its input reaches a threshold from below.
#[model("t.latch")]
impl Model for Latch {
    type Params = LatchParams;
    type Inputs = U;
    type Outputs = One;
    type DiscreteState = Fires;
    type Guards = Over;
    fn outputs(&self, d: &Fires) -> One {
        One { y: d.count }
    }
    fn guards(&self, u: &U) -> Over {
        Over { over: u.u - self.p.at }
    }
    fn handle_event(&self, d: &Fires) -> ((), Fires) {
        ((), Fires { count: d.count + 1.0 })
    }
}
/// Another latch, with a guard of the same name.
pub struct Other {
    p: LatchParams,
}
/// As `t.latch`, with a continuous state beside it.
#[model("t.other")]
impl Model for Other {
    type Params = LatchParams;
    type Inputs = U;
    type Outputs = One;
    type State = X;
    type DiscreteState = Fires;
    type Guards = Over;
    fn outputs(&self, d: &Fires) -> One {
        One { y: d.count }
    }
    fn derivatives(&self) -> X {
        X { x: 1.0 }
    }
    fn guards(&self, u: &U) -> Over {
        Over { over: u.u - self.p.at }
    }
    fn handle_event(&self, x: &X, d: &Fires) -> (X, Fires) {
        (*x, Fires { count: d.count + 1.0 })
    }
}
/// The piece of a switch.
#[derive(State, Clone, Copy, Debug)]
pub struct Switched {
    /// It is on.
    #[port]
    on: bool,
    /// Times that its guard has fired.
    #[port("1")]
    count: f64,
}
/// A switch.
pub struct Switch {
    p: LatchParams,
}
/// On from a time on. Its guard rests as soon as it is on.
#[model("t.switch")]
impl Model for Switch {
    const MODES: bool = true;
    type Params = LatchParams;
    type FeedthroughOutputs = One;
    type DiscreteState = Switched;
    type Guards = Over;
    fn feedthrough(&self, clock: &Clock, d: &Switched) -> One {
        One { y: f64::from(u8::from(d.on)) + 0.0 * clock.t }
    }
    fn mode(&self, clock: &Clock, d: &Switched) -> Switched {
        Switched { on: clock.t >= self.p.at, ..*d }
    }
    fn guards(&self, clock: &Clock, d: &Switched) -> Over {
        Over { over: if d.on { -1.0 } else { clock.t - self.p.at } }
    }
    fn handle_event(&self, d: &Switched) -> ((), Switched) {
        ((), Switched { on: true, count: d.count + 1.0 })
    }
}

fn all() -> Catalogue {
    let mut all = catalogue();
    for entry in [Entry::model::<Latch>(), Entry::model::<Other>(), Entry::model::<Switch>()] {
        all.add(entry).unwrap();
    }
    all
}

fn compiled(parts: Vec<PartSpec>, wires: &[&str], integrator: Integrator, step: f64) -> Arc<Plan> {
    let adaptive = integrator.method().error_order() > 0;
    let accuracy = adaptive.then(Accuracy::default);
    let s = Spec { integrator, step: seconds(step), accuracy, ..spec(parts, wires) };
    Arc::new(compile(&s, &all(), &Files::default()).unwrap_or_else(|e| panic!("{e}")))
}

fn phase(name: &str, spec: Spec, to: &[(&str, &str)], watches: &[&str]) -> PhaseSpec {
    let transition = |(to, when): &(&str, &str)| TransitionSpec {
        to: (*to).into(),
        when: (*when).into(),
        origin: Origin::NONE,
    };
    let watch = |when: &&str| WatchSpec {
        of: "stop_when".into(),
        when: (*when).into(),
        origin: Origin::NONE,
    };
    PhaseSpec {
        name: name.into(),
        spec: Spec { step: seconds(0.1), integrator: Integrator::Rk4, ..spec },
        transitions: to.iter().map(transition).collect(),
        watches: watches.iter().map(watch).collect(),
        origin: Origin::NONE,
    }
}

fn program(phases: &[PhaseSpec]) -> Arc<Program> {
    let program = compile_program(phases, &all(), &Files::default());
    Arc::new(program.unwrap_or_else(|e| panic!("{e}")))
}

fn ramp(k: f64) -> PartSpec {
    part("ramp", "t.integrator", &[("k", k)], None)
}

/// A guard that has reached its threshold at the start has fired before the first row: a sampled reader takes the value after it.
#[test]
fn the_first_row_is_that_after_the_events_of_the_start() {
    let parts = vec![
        part("latch", "t.latch", &[], None),
        part("next", "t.latch", &[], None),
        part("below", "t.latch", &[("at", 1.5)], None),
        part("held", "t.hold", &[], Some("0.2 s")),
    ];
    let wires = ["latch.y -> next.u", "next.y -> held.u"];
    let plan = compiled(parts, &wires, Integrator::Rk4, 0.1);
    let mut sim = Simulation::new(plan.clone());
    let at = |sim: &Simulation| {
        ["latch.y", "next.y", "below.y", "held.state.held"].map(|p| sim.get(p).unwrap())
    };
    assert_eq!((at(&sim), sim.state().tick, sim.at_row()), ([1.0, 1.0, 0.0, 1.0], 0, true));
    sim.run_until(seconds(1.0)).unwrap();
    assert_eq!(at(&sim), [1.0, 1.0, 0.0, 1.0]);
    // A checkpoint of the start contains the complete state.
    let mut again = Simulation::new(plan.clone());
    again.restore(&Simulation::new(plan).checkpoint("").unwrap()).unwrap();
    again.run_until(seconds(1.0)).unwrap();
    assert_eq!(again.hash(), sim.hash());
}

/// A transition and a guard that follow from an input without a wire act where it is set or pinned, not a row later.
#[test]
fn what_is_set_or_pinned_acts_at_once() {
    type Change = fn(&mut Simulation) -> Result<(), VariableError>;
    let set: Change = |sim| sim.set("gain.u", 3.0);
    let pin: Change = |sim| sim.pin("gain.u", 3.0);
    for change in [set, pin] {
        let parts = || {
            vec![part("gain", "t.gain", &[], None), part("latch", "t.latch", &[("at", 2.0)], None)]
        };
        let of = || spec(parts(), &["gain.y -> latch.u"]);
        let phases = [phase("a", of(), &[("b", "gain.u > 2")], &[]), phase("b", of(), &[], &[])];
        let mut sim = Simulation::of(program(&phases));
        sim.run_until(seconds(0.3)).unwrap();
        change(&mut sim).unwrap();
        assert_eq!((sim.step_event().unwrap(), sim.get("latch.y").unwrap()), (Stop::Event, 1.0));
        assert_eq!((sim.step_event().unwrap(), sim.phase()), (Stop::Event, "b"));
        assert_eq!((sim.time(), sim.get("latch.y").unwrap()), (0.3, 1.0));
        assert!(sim.at_row());
    }
    // An input that is set back before the next step has no effect.
    let parts = vec![part("latch", "t.latch", &[("at", 2.0)], None)];
    let mut sim = Simulation::new(compiled(parts, &[], Integrator::Rk4, 0.1));
    sim.set("latch.u", 3.0).unwrap();
    sim.set("latch.u", 1.0).unwrap();
    sim.run_until(seconds(0.5)).unwrap();
    assert_eq!(sim.get("latch.y").unwrap(), 0.0);
}

/// The condition that stopped a run holds where it stopped, between two rows: also for who continues from a checkpoint.
#[test]
fn a_condition_that_stopped_a_run_holds_there() {
    for when in ["ramp.y >= 0.25", "ramp.y > 0.25", "time >= 0.25 s"] {
        let program = program(&[phase("a", spec(vec![ramp(1.0)], &[]), &[], &[when])]);
        let mut sim = Simulation::of(program.clone());
        let mut stop = Stop::Row;
        while stop == Stop::Row {
            assert!(!sim.watched(0), "{when} at {}", sim.time());
            stop = sim.step_watched().unwrap();
        }
        assert!(stop == Stop::Watched(0) && (sim.time() - 0.25).abs() < 1e-11, "{when}");
        assert!(sim.watched(0), "{when}");
        let mut again = Simulation::of(program);
        again.restore(&sim.checkpoint("").unwrap()).unwrap();
        assert!(again.watched(0), "{when}");
        assert_eq!((again.step_watched().unwrap(), again.time()), (Stop::Row, 0.3));
    }
}

/// A row in which a transition and then a watched condition come: the rest of it is that of the new phase.
#[test]
fn a_step_goes_on_in_the_plan_of_its_phase() {
    let more = || {
        let parts = (0..6).map(|k| part(&format!("a{k}"), "t.integrator", &[("k", 3.0)], None));
        spec(parts.chain([ramp(2.0)]).collect(), &[])
    };
    let phases = [
        phase("a", spec(vec![ramp(1.0)], &[]), &[("b", "time > 0.23 s")], &["time > 0.26 s"]),
        phase("b", more(), &[], &["time > 0.26 s"]),
    ];
    let mut sim = Simulation::of(program(&phases));
    for k in 1..=4 {
        sim.step().unwrap();
        assert_eq!(sim.time(), f64::from(k) / 10.0);
    }
    let [y, a] = ["ramp.y", "a3.y"].map(|p| sim.get(p).unwrap());
    assert!((y - 0.57).abs() < 1e-11 && (a - 0.51).abs() < 1e-11, "{y} {a}");
}

/// In another program phases have other places, and conditions to watch are others: what has begun keeps its time.
#[test]
fn times_of_phases_go_over_to_another_program_by_name() {
    let of = || spec(vec![ramp(1.0)], &[]);
    let one = [
        phase("first", of(), &[("second", "time > 0.35 s")], &[]),
        phase("second", of(), &[("third", "time > 10 s")], &[]),
        phase("third", of(), &[], &[]),
    ];
    let watches = &["ramp.y > 100", "phase_time >= 0.5 s"];
    let other = [
        phase("zero", of(), &[("second", "time > 5 s")], watches),
        phase("second", of(), &[("first", "phase_time > 1.25 s")], watches),
        phase("first", of(), &[], watches),
    ];
    let mut sim = Simulation::of(program(&one));
    sim.run_until(seconds(0.6)).unwrap();
    let second = sim.get("Phases.second").unwrap();
    assert!((second - 0.35).abs() < 1e-11);
    sim.move_to_program(program(&other)).unwrap();
    assert_eq!(sim.get("Phases.second").unwrap(), second);
    assert_eq!(sim.get("Phases.first").unwrap(), 0.0);
    assert!(sim.get("Phases.zero").unwrap().is_nan());
    let mut watched = Vec::new();
    while sim.time() < 2.2 {
        if let Stop::Watched(which) = sim.step_watched().unwrap() {
            watched.push((which, sim.time()));
        }
    }
    let [(1, at), (1, again)] = watched[..] else { panic!("{watched:?}") };
    assert!((at - 0.85).abs() < 1e-11 && (again - 2.1).abs() < 1e-11, "{watched:?}");
    let first = sim.get("Phases.first").unwrap();
    assert!(sim.phase() == "first" && (first - 1.6).abs() < 1e-11, "{first}");
}

/// The guard of a part that starts anew is not that of another model at the same path.
#[test]
fn a_part_that_starts_anew_has_guards_of_its_own() {
    let of = |model: &str| spec(vec![part("p", model, &[], None)], &[]);
    let phases = [
        phase("a", of("t.latch"), &[("b", "time > 0.25 s")], &[]),
        phase("b", of("t.other"), &[], &[]),
    ];
    let mut sim = Simulation::of(program(&phases));
    assert_eq!(sim.get("p.y").unwrap(), 1.0);
    sim.run_until(seconds(0.2)).unwrap();
    sim.set("p.u", 0.0).unwrap();
    sim.set("p.u", 1.0).unwrap();
    sim.run_until(seconds(0.3)).unwrap();
    // The new part begins above its threshold, so its guard fires there. It does not have the count
    // of the other part.
    assert_eq!((sim.phase(), sim.get("p.y").unwrap()), ("b", 1.0));
}

/// An event of a part with modes is not taken back by the piece that its levels give at the instant itself.
#[test]
fn a_piece_that_ends_fires_its_guard() {
    for integrator in [Integrator::Rk4, Integrator::DormandPrince, Integrator::Rodas] {
        for at in [0.31, 0.5, 0.725] {
            let parts = vec![part("switch", "t.switch", &[("at", at)], None), ramp(1.0)];
            let plan = compiled(parts, &["switch.y -> ramp.u"], integrator, 0.1);
            let mut sim = Simulation::new(plan);
            while sim.step_event().unwrap() != Stop::Event {}
            assert!((sim.time() - at).abs() < 2e-12 && sim.state().micro == 1, "{integrator:?}");
            sim.run_until(seconds(1.0)).unwrap();
            assert_eq!(sim.get("switch.state.count").unwrap(), 1.0, "{integrator:?} {at}");
            assert!((sim.get("ramp.y").unwrap() - (1.0 - at)).abs() < 1e-11, "{integrator:?}");
        }
    }
}

/// Events half a nanosecond apart are two events, each at its own time; events at one instant are handled one after the other there,
/// with one evaluation of the guards after each.
#[test]
fn events_are_as_far_apart_as_they_are() {
    let parts = vec![
        ramp(1.0),
        part("a", "t.latch", &[("at", 0.25)], None),
        part("b", "t.latch", &[("at", 0.25 + 5e-10)], None),
        part("c", "t.latch", &[("at", 0.25)], None),
    ];
    let wires = ["ramp.y -> a.u", "ramp.y -> b.u", "ramp.y -> c.u"];
    let mut sim = Simulation::new(compiled(parts, &wires, Integrator::Rk4, 0.1));
    let profile = sim.profile();
    let guards = || -> u64 {
        let of = |s: &Spent| s.part == "c" && s.operation == "guards";
        profile.spent().iter().filter(|s| of(s)).map(|s| s.calls).sum()
    };
    let (mut seen, mut calls) = (Vec::new(), Vec::new());
    while sim.time() < 0.4 {
        let before = guards();
        if sim.step_event().unwrap() == Stop::Event {
            calls.push(guards() - before);
            seen.push((sim.time(), ["a.y", "b.y", "c.y"].map(|p| sim.get(p).unwrap())));
        }
    }
    let [(ta, a), (tc, c), (tb, b)] = seen[..] else { panic!("{seen:?}") };
    assert_eq!([a, c, b], [[1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0]]);
    assert!(ta == tc && (tb - ta - 5e-10).abs() < 3e-12, "{ta} {tb}");
    assert_eq!(calls[1], 1, "{calls:?}");
}

/// Instants of phases and directions of events that no run writes are refused.
#[test]
fn a_checkpoint_with_impossible_instants_is_refused() {
    let of = || {
        spec(
            vec![ramp(1.0), part("latch", "t.latch", &[("at", 7.0)], None)],
            &["ramp.y -> latch.u"],
        )
    };
    let phases = [
        phase("a", of(), &[("b", "time > 0.25 s")], &[]),
        phase("b", of(), &[("c", "time > 9 s")], &[]),
        phase("c", of(), &[], &[]),
    ];
    let program = program(&phases);
    let mut sim = Simulation::of(program.clone());
    sim.run_until(seconds(0.5)).unwrap();
    let whole = sim.checkpoint("").unwrap();
    let refused = |change: &dyn Fn(&mut Checkpoint)| {
        let mut c = whole.clone();
        change(&mut c);
        match Simulation::of(program.clone()).restore(&c) {
            Err(CheckpointError::Impossible { why }) => why,
            other => panic!("{other:?}"),
        }
    };
    Simulation::of(program.clone()).restore(&whole).unwrap();
    for (k, t) in
        [(0, f64::NAN), (0, -1.0), (0, 0.6), (1, f64::INFINITY), (2, 1e308), (2, f64::NEG_INFINITY)]
    {
        let why = refused(&|c| c.instant.entered[k] = t);
        assert!(why.contains("a phase began at"), "{why}");
    }
    let rising = sim.plan().guards.iter().position(|g| g.name == "latch.over").unwrap();
    for due in [-1, 2] {
        let why = refused(&|c| c.guards[rising].4 = due);
        assert!(why.contains("`latch.over` has an impossible state"), "{why}");
    }
}
