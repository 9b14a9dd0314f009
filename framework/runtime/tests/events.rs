//! Events: located where the guard is zero, one after another at one instant, without a trace of how the
//! run was cut.
use crate::common::*;
use linkwork_runtime::*;
use linkwork_surroundings::prelude::*;
use std::sync::Arc;

/// Drop.
#[derive(Params, Clone, Debug)]
pub struct BallParams {
    /// Height at the start.
    #[param(unit = "m", default = 1.0)]
    height: f64,
    /// Speed after an impact over that before.
    #[param(default = 0.8)]
    restitution: f64,
}
/// Height and speed.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Fall {
    /// Height.
    #[port("m")]
    height: f64,
    /// Speed upwards.
    #[port("m/s")]
    speed: f64,
}
/// Impacts so far.
#[derive(State, Clone, Copy, Debug)]
pub struct Impacts {
    /// How many.
    #[port("1")]
    count: f64,
    /// Time of the last.
    #[port("s")]
    last: f64,
}
/// The ground.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Ground {
    /// Distance from it.
    #[port("m", falling)]
    gap: f64,
}
/// A ball.
pub struct Ball {
    p: BallParams,
}
const G: f64 = 9.81;
/// A ball over a floor.
#[model("t.ball")]
impl Model for Ball {
    type Params = BallParams;
    type Outputs = Fall;
    type State = Fall;
    type DiscreteState = Impacts;
    type Guards = Ground;
    fn init_x(&self) -> Fall {
        Fall { height: self.p.height, speed: 0.0 }
    }
    fn outputs(&self, x: &Fall) -> Fall {
        *x
    }
    fn derivatives(&self, x: &Fall) -> Fall {
        Fall { height: x.speed, speed: -G }
    }
    fn guards(&self, x: &Fall) -> Ground {
        Ground { gap: x.height }
    }
    fn handle_event(&self, clock: &Clock, x: &Fall, d: &Impacts) -> (Fall, Impacts) {
        let speed = -self.p.restitution * x.speed;
        (Fall { height: 0.0, speed }, Impacts { count: d.count + 1.0, last: clock.t })
    }
}
/// How far a chain of counters goes.
#[derive(Params, Clone, Debug)]
pub struct ChainParams {
    /// Fires when the input passes this.
    at: f64,
}
/// A count.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Count {
    /// Count.
    #[port("1")]
    n: f64,
}
/// Passed.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Passed {
    /// Input minus threshold.
    #[port("1", rising)]
    over: f64,
}
/// A counter.
pub struct Link {
    p: ChainParams,
}
/// Counts how often its input passes a threshold.
#[model("t.link")]
impl Model for Link {
    type Params = ChainParams;
    type Inputs = Required;
    type Outputs = Count;
    type DiscreteState = Count;
    type Guards = Passed;
    fn outputs(&self, d: &Count) -> Count {
        *d
    }
    fn guards(&self, u: &Required) -> Passed {
        Passed { over: u.u - self.p.at }
    }
    fn handle_event(&self, d: &Count) -> ((), Count) {
        ((), Count { n: d.n + 1.0 })
    }
}
/// Two thresholds on time, wired to each other's count: fires itself without end.
pub struct Flip {
    p: ChainParams,
}
/// Changes its sign whenever it fires, so that it fires again.
#[model("t.flip")]
impl Model for Flip {
    type Params = ChainParams;
    type Outputs = Count;
    type DiscreteState = Count;
    type Guards = Passed2;
    fn outputs(&self, d: &Count) -> Count {
        *d
    }
    fn guards(&self, clock: &Clock, d: &Count) -> Passed2 {
        let side = if (d.n as u64).is_multiple_of(2) { 1.0 } else { -1.0 };
        Passed2 { a: side * (clock.t - self.p.at), b: side }
    }
    fn handle_event(&self, d: &Count) -> ((), Count) {
        ((), Count { n: d.n + 1.0 })
    }
}
/// Two guards.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Passed2 {
    /// Passes once.
    #[port("1")]
    a: f64,
    /// Jumps whenever it fires.
    #[port("1")]
    b: f64,
}
/// A wave.
#[derive(Params, Clone, Debug)]
pub struct WaveParams {
    /// Amplitude.
    size: f64,
}
/// A bump.
pub struct Wave {
    p: WaveParams,
}
/// y = size − (t − 0.5)²: positive for a moment around t = 0.5 s.
#[model("t.bump")]
impl Model for Wave {
    type Params = WaveParams;
    type Outputs = One;
    type State = X;
    fn outputs(&self, x: &X) -> One {
        One { y: x.x }
    }
    fn init_x(&self) -> X {
        X { x: self.p.size - 0.25 }
    }
    fn derivatives(&self, clock: &Clock) -> X {
        X { x: -2.0 * (clock.t - 0.5) }
    }
}

/// The corner.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Corner {
    /// Time since the corner.
    #[port("m", rising)]
    side: f64,
}
/// Growth whose rate has a corner after a second.
pub struct Growth;
/// ẏ = y g(s), ṡ = 1; g = 1, and 1 + 5 (s − 1) behind s = 1.
#[model("t.growth")]
impl Model for Growth {
    type Params = ();
    type Outputs = Fall;
    type State = Fall;
    type Guards = Corner;
    fn build((): ()) -> Result<Self, BuildError> {
        Ok(Growth)
    }
    fn init_x(&self) -> Fall {
        Fall { height: 0.0, speed: 1.0 }
    }
    fn outputs(&self, x: &Fall) -> Fall {
        *x
    }
    fn derivatives(&self, x: &Fall) -> Fall {
        Fall { height: 1.0, speed: x.speed * (1.0 + 5.0 * (x.height - 1.0).max(0.0)) }
    }
    fn guards(&self, x: &Fall) -> Corner {
        Corner { side: x.height - 1.0 }
    }
    fn handle_event(&self, x: &Fall) -> (Fall, ()) {
        (*x, ())
    }
}

fn all() -> Catalogue {
    Catalogue::new([vec![
        Entry::model::<Ball>(),
        Entry::model::<Link>(),
        Entry::model::<Flip>(),
        Entry::model::<Wave>(),
        Entry::model::<Growth>(),
        Entry::model::<Integral>(),
        Entry::model::<Hold>(),
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

fn compiled(mut s: Spec, integrator: Integrator, step: f64) -> Arc<Plan> {
    s.integrator = integrator;
    s.step = seconds(step);
    let adaptive = integrator.method().error_order() > 0;
    s.accuracy = adaptive.then(Accuracy::default);
    Arc::new(compile(&s, &all(), &Files::default()).unwrap_or_else(|e| panic!("{e}")))
}

fn ball() -> Spec {
    spec(vec![part("ball", "t.ball", &[], None)], &[])
}

/// Time of impact k (from 1) and the rest between, in closed form.
fn impact(k: i32) -> f64 {
    let (t0, e) = ((2.0 / G).sqrt(), 0.8_f64);
    t0 + 2.0 * t0 * (1..k).map(|j| e.powi(j)).sum::<f64>()
}

#[test]
fn a_ball_bounces_at_the_times_of_the_closed_form() {
    for integrator in &METHODS[1..] {
        let mut sim = Simulation::new(compiled(ball(), *integrator, 0.05));
        let mut k = 0;
        while k < 20 {
            if sim.step_event().unwrap() == Stop::Event {
                k += 1;
                let (t, count) = (sim.time(), sim.get("ball.state.count").unwrap());
                assert_eq!(count, f64::from(k));
                // Measured: 3e-12 at the most.
                assert!((t - impact(k)).abs() < 1e-9, "{integrator:?}, {k}: {t} {}", impact(k));
                assert_eq!(sim.get("ball.state.last").unwrap(), t);
            }
        }
    }
}

/// A step ends at the corner and the next begins behind it: the stages of a step across it would spoil the state there.
#[test]
fn every_method_has_its_order_across_a_corner_that_is_an_event() {
    let steps = [
        (Integrator::Rk4, 0.075, 4.0),
        (Integrator::BogackiShampine, 0.0375, 3.0),
        (Integrator::DormandPrince, 0.075, 5.0),
        (Integrator::Verner, 0.3, 8.0),
        (Integrator::Rodas, 0.0375, 4.0),
    ];
    for (integrator, step, order) in steps {
        let error = |h: f64| {
            let mut s = spec(vec![part("growth", "t.growth", &[], None)], &[]);
            (s.integrator, s.step) = (integrator, seconds(h));
            let plan = compile(&s, &all(), &Files::default()).unwrap_or_else(|e| panic!("{e}"));
            let mut sim = Simulation::new(Arc::new(plan));
            sim.run_until(seconds(1.8)).unwrap();
            let t = sim.time();
            (sim.get("growth.speed").unwrap() / (t + 2.5 * (t - 1.0).powi(2)).exp() - 1.0).abs()
        };
        let (coarse, fine) = (error(step), error(step / 2.0));
        let seen = (coarse / fine).log2();
        println!("{integrator:?} at {step} s: {coarse:.2e}, {fine:.2e}, order {seen:.2}");
        assert!(seen > order - 0.6 && seen < order + 2.5, "{integrator:?}: {seen}");
    }
}

#[test]
fn a_guard_that_touches_and_does_not_cross_is_no_event() {
    // At t = 0.5 s the bump is below zero by 1e-14 or 1e-9, or it is above zero for 2 ms, 20 ms or 200
    // ms.
    for (size, expected) in [(-1e-14, 0.0), (-1e-9, 0.0), (1e-6, 1.0), (1e-4, 1.0), (0.01, 1.0)] {
        for step in [0.01, 0.07, 0.3] {
            let parts = vec![
                part("bump", "t.bump", &[("size", size)], None),
                part("count", "t.link", &[("at", 0.0)], None),
            ];
            let s = spec(parts, &["bump.y -> count.u"]);
            let mut sim = Simulation::new(compiled(s, Integrator::Rk4, step));
            sim.run_until(seconds(1.2)).unwrap();
            let n = sim.get("count.n").unwrap();
            assert_eq!(n, expected, "size {size}, step {step}");
        }
    }
}

#[test]
fn two_guards_within_a_step_fire_in_the_order_of_time() {
    // With ẋ = 1, x passes 0.31 and 0.33 in one step of 0.1 s. The order of the names is opposite
    // to the order of time.
    let parts = vec![
        part("ramp", "t.integrator", &[("k", 1.0)], None),
        part("z_first", "t.link", &[("at", 0.31)], None),
        part("a_second", "t.link", &[("at", 0.33)], None),
        part("b_same", "t.link", &[("at", 0.33)], None),
    ];
    let s = spec(parts, &["ramp.y -> z_first.u", "ramp.y -> a_second.u", "ramp.y -> b_same.u"]);
    let mut sim = Simulation::new(compiled(s, Integrator::Rk4, 0.1));
    let mut seen = Vec::new();
    while sim.time() < 1.0 {
        if sim.step_event().unwrap() == Stop::Event {
            let n = ["z_first.n", "a_second.n", "b_same.n"].map(|p| sim.get(p).unwrap());
            seen.push((sim.time(), sim.state().micro, n));
        }
    }
    let [a, b, c] = seen[..] else { panic!("{seen:?}") };
    assert!((a.0 - 0.31).abs() < 1e-9 && a.2 == [1.0, 0.0, 0.0], "{a:?}");
    assert!((b.0 - 0.33).abs() < 1e-9 && b.2 == [1.0, 1.0, 0.0] && b.1 == 1, "{b:?}");
    assert!(c.0 == b.0 && c.2 == [1.0, 1.0, 1.0] && c.1 == 2, "{c:?}");
}

#[test]
fn a_cascade_runs_through_links_at_one_instant_and_can_be_cut_anywhere() {
    let parts = vec![
        part("ramp", "t.integrator", &[("k", 1.0)], None),
        part("c1", "t.link", &[("at", 0.31)], None),
        part("c2", "t.link", &[("at", 0.5)], None),
        part("c3", "t.link", &[("at", 0.5)], None),
        part("held", "t.hold", &[], Some("0.2 s")),
    ];
    let wires = ["ramp.y -> c1.u", "c1.n -> c2.u", "c2.n -> c3.u", "c3.n -> held.u"];
    let plan = compiled(spec(parts, &wires), Integrator::DormandPrince, 0.1);
    let mut straight = Simulation::new(plan.clone());
    straight.run_until(seconds(1.0)).unwrap();
    assert_eq!(straight.get("c3.n").unwrap(), 1.0);
    // Continue from a checkpoint and from a snapshot after every stop, including the stops within
    // the cascade.
    let (mut sim, mut snapshot, mut events) =
        (Simulation::new(plan.clone()), Snapshot::default(), 0);
    while sim.before(seconds(1.0)) || sim.state().guards.iter().any(|g| g.is_due()) {
        events += u32::from(sim.step_event().unwrap() == Stop::Event);
        let checkpoint = sim.checkpoint("").unwrap();
        let mut fresh = Simulation::new(plan.clone());
        fresh.restore(&checkpoint).unwrap();
        assert_eq!(fresh.state(), sim.state());
        fresh.save_into(&mut snapshot);
        sim = Simulation::new(plan.clone());
        sim.load_from(&snapshot).unwrap();
    }
    assert_eq!(events, 3);
    assert_eq!((sim.state(), sim.hash()), (straight.state(), straight.hash()));
}

/// A held output that jumps at a row makes an event there: a step ends at that row all the same, and so does a run.
#[test]
fn events_at_a_row_do_not_take_the_run_beyond_it() {
    let parts = vec![
        part("ramp", "t.integrator", &[("k", 1.0)], None),
        part("held", "t.hold", &[], Some("0.2 s")),
        part("c1", "t.link", &[("at", 0.31)], None),
        part("c2", "t.link", &[("at", 0.5)], None),
    ];
    let plan = compiled(
        spec(parts, &["ramp.y -> held.u", "held.y -> c1.u", "c1.n -> c2.u"]),
        Integrator::DormandPrince,
        0.1,
    );
    let mut sim = Simulation::new(plan.clone());
    for k in 1..=10 {
        sim.step().unwrap();
        assert_eq!(sim.time(), f64::from(k) / 10.0);
        assert_eq!(sim.get("c2.n").unwrap(), f64::from(u8::from(k >= 6)), "at row {k}");
    }
    for end in [0.4, 0.6, 0.7] {
        let mut sim = Simulation::new(plan.clone());
        sim.run_until(seconds(end)).unwrap();
        assert_eq!(sim.time(), end);
        // This run stops before the events of that row and then continues.
        let mut cut = Simulation::new(plan.clone());
        while cut.before(seconds(end)) {
            cut.step_event().unwrap();
        }
        cut.run_until(seconds(end)).unwrap();
        assert_eq!((cut.time(), cut.hash()), (end, sim.hash()));
    }
}

#[test]
fn a_cascade_without_end_is_stopped_by_name() {
    let s = spec(vec![part("flip", "t.flip", &[("at", 0.25)], None)], &[]);
    let mut sim = Simulation::new(compiled(s, Integrator::Rk4, 0.1));
    let error = sim.run_until(seconds(1.0)).unwrap_err();
    assert!((error.time - 0.25).abs() < 1e-9, "{error}");
    for part in ["1000 events", "flip.b", "help"] {
        assert!(error.to_string().contains(part), "{error}");
    }
}

/// The ball with everything that changes at events, by each method, cut at random instants.
#[test]
fn split_equals_straight_between_and_at_events_for_every_method() {
    for integrator in METHODS {
        let parts = vec![
            part("ball", "t.ball", &[], None),
            part("slow", "t.integrator", &[("k", -0.7)], None),
            part("held", "t.hold", &[], Some("0.15 s")),
            part("low", "t.link", &[("at", -0.3)], None),
        ];
        let wires = ["slow.y -> slow.u", "ball.speed -> held.u", "slow.y -> low.u"];
        let mut s = spec(parts, &wires[..1]);
        s.wires.push(wire(wires[2]));
        let plan = compiled(s, integrator, 0.05);
        let mut straight = Simulation::new(plan.clone());
        straight.set("slow.state.x", -2.0).unwrap();
        straight.run_until(seconds(2.0)).unwrap();
        let mut random = 11_u64;
        let mut next = |n: u64| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (random >> 33) % n
        };
        let mut sim = Simulation::new(plan.clone());
        sim.set("slow.state.x", -2.0).unwrap();
        while sim.before(seconds(2.0)) {
            let t = sim.time() + 0.001 * next(200) as f64;
            match next(3) {
                0 => {
                    sim.step_event().unwrap();
                }
                _ => sim.run_until(seconds(t.min(2.0))).unwrap(),
            }
            if next(2) == 0 {
                let checkpoint = sim.checkpoint("").unwrap();
                sim = Simulation::new(plan.clone());
                sim.restore(&checkpoint).unwrap();
            } else {
                sim = sim.fork();
            }
        }
        sim.run_until(seconds(2.0)).unwrap();
        assert_eq!(sim.state(), straight.state(), "{integrator:?}");
        let n = straight.get("ball.state.count").unwrap();
        // The third impact is the last one before 2 s. Euler has first order and computes it later
        // than 2 s.
        let expected = if integrator == Integrator::SemiImplicitEuler { 2.0 } else { 3.0 };
        assert_eq!(n, expected, "{integrator:?}");
    }
}

#[test]
fn stepping_through_events_allocates_nothing() {
    for integrator in METHODS {
        let mut sim = Simulation::new(compiled(ball(), integrator, 0.01));
        sim.run_until(seconds(0.3)).unwrap();
        let end = seconds(2.5);
        let info = allocation_counter::measure(|| sim.run_until(end).unwrap());
        assert_eq!(info.count_total, 0, "{integrator:?}");
        assert!(sim.get("ball.state.count").unwrap() > 3.0);
    }
}

#[test]
fn guards_that_are_not_declared_right_do_not_compile_a_plan() {
    let when = |text: &str| {
        let phase = |name: &str, to: &str, when: &str| PhaseSpec {
            name: name.into(),
            spec: ball(),
            transitions: vec![TransitionSpec {
                to: to.into(),
                when: when.into(),
                origin: Origin::NONE,
            }],
            watches: Vec::new(),
            origin: Origin::NONE,
        };
        let phases = [phase("a", "b", text), phase("b", "a", "time > 1 s")];
        match compile_program(&phases, &all(), &Files::default()) {
            Ok(_) => String::new(),
            Err(faults) => faults.to_string(),
        }
    };
    assert_eq!(when("ball.height < 1 cm and ball.speed < 0 m/s"), "");
    assert!(when("ball.height < 1 kg").contains("different quantities"));
    assert!(when("ball.heigth < 1 m").contains("did you mean `ball.height`"));
    assert!(when("1 < 2").contains("its value never changes"));
}

#[test]
fn the_graph_of_phases_is_checked_at_load() {
    let phase = |name: &str, to: &[(&str, &str)]| PhaseSpec {
        name: name.into(),
        spec: ball(),
        transitions: (to.iter())
            .map(|(to, when)| TransitionSpec {
                to: (*to).into(),
                when: (*when).into(),
                origin: Origin::NONE,
            })
            .collect(),
        watches: Vec::new(),
        origin: Origin::NONE,
    };
    let told = |phases: &[PhaseSpec]| match compile_program(phases, &all(), &Files::default()) {
        Ok(_) => String::new(),
        Err(faults) => faults.to_string(),
    };
    let a = phase("a", &[("b", "time > 1 s")]);
    assert_eq!(told(&[a.clone(), phase("b", &[])]), "");
    let lost = told(&[a.clone(), phase("b", &[]), phase("c", &[("a", "time > 2 s")])]);
    assert!(lost.contains("phase `c` is never reached"), "{lost}");
    let nowhere = told(&[phase("a", &[("d", "time > 1 s")])]);
    assert!(nowhere.contains("no phase `d`"), "{nowhere}");
    let both = told(&[
        phase("a", &[("b", "time > 1 s"), ("c", "time > 1 s")]),
        phase("b", &[]),
        phase("c", &[]),
    ]);
    assert!(both.contains("leads to `b` and to `c`"), "{both}");
    let own = told(&[phase("a", &[("a", "time > 1 s")])]);
    assert!(own.contains("to itself"), "{own}");
}
