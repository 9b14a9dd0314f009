//! Invalid input to solvers of constrained motion: a typed error or a reported behaviour, never a panic or a silent NaN.

use linkwork_dynamics::multibody::{
    BodySpec, Builder, Coordinate, Coupling, Hinge, HingeCoordinate, LoopClosure, LoopMotion,
    Multibody, SubhingeKind,
};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_dynamics::{DynamicsError, Tree, Workspace, kinematics};
use linkwork_solvers::{
    ConstrainedSolver, ConstraintMethod, FullyAugmentedError, FullyAugmentedSolver,
    ProjectionError, Projector, Redundant, Report, SolverError,
};

struct Input {
    q: Vec<f64>,
    v: Vec<f64>,
    tau: Vec<f64>,
    vdot: Vec<f64>,
    motions: Vec<LoopMotion>,
    contradiction_max: f64,
}

impl Input {
    fn at(q: &[f64], v: &[f64]) -> Self {
        let n = v.len();
        let contradiction_max = f64::INFINITY;
        let (q, v) = (q.to_vec(), v.to_vec());
        Self { q, v, tau: vec![0.2; n], vdot: vec![0.0; n], motions: Vec::new(), contradiction_max }
    }
}

#[derive(Debug)]
struct Answer {
    vdot: Vec<f64>,
    report: Report,
    redundant: Vec<(String, usize)>,
    /// The largest contradiction among them.
    worst: f64,
}

type Outcome = Result<Answer, SolverError>;

fn worst(redundant: &[Redundant]) -> f64 {
    redundant.iter().fold(0.0, |w, r| w.max(r.contradiction))
}

fn names(tree: &Tree, redundant: &[Redundant]) -> Vec<(String, usize)> {
    let name = |r: &Redundant| tree.multibody().constraint_name(r.constraint).to_owned();
    redundant.iter().map(|r| (name(r), r.rows)).collect()
}

/// Solves it with every method: as rows, embedded, fully augmented (if it has that form).
fn solve(mbs: &Multibody, input: &Input) -> Vec<(&'static str, Outcome)> {
    let tree = Tree::new(mbs);
    let mut out = Vec::new();
    let state = (&input.q[..], &input.v[..]);
    let g = Vec3::new(0.3, -9.8, 0.1);
    for (name, t) in [("rows", ConstraintMethod::Augment), ("embedded", ConstraintMethod::Embed)] {
        let mut ws = Workspace::new(&tree);
        let mut s = ConstrainedSolver::new(&tree, |_| t);
        s.contradiction_max = input.contradiction_max;
        let (mut tau, mut vdot) = (input.tau.clone(), input.vdot.clone());
        kinematics(&tree, &mut ws, state.0, state.1);
        ws.apply_uniform_gravity(g);
        let done =
            s.forward_given_kinematics(&tree, &mut ws, state, &input.motions, &mut tau, &mut vdot);
        let (redundant, worst) = (names(&tree, &s.redundant(&tree)), worst(&s.redundant(&tree)));
        out.push((name, done.map(|report| Answer { vdot, report, redundant, worst })));
    }
    if let Ok(mut s) = FullyAugmentedSolver::new(&tree) {
        s.contradiction_max = input.contradiction_max;
        let mut ws = Workspace::new(&tree);
        let (mut tau, mut vdot) = (input.tau.clone(), input.vdot.clone());
        kinematics(&tree, &mut ws, state.0, state.1);
        ws.apply_uniform_gravity(g);
        let done =
            s.forward_given_kinematics(&tree, &ws, state, &input.motions, &mut tau, &mut vdot);
        let (redundant, worst) = (names(&tree, &s.redundant(&tree)), worst(&s.redundant(&tree)));
        out.push(("fully augmented", done.map(|report| Answer { vdot, report, redundant, worst })));
    }
    for (name, o) in &out {
        if let Ok(a) = o {
            assert!(a.vdot.iter().all(|x| x.is_finite()), "{name}: {a:?}");
            assert!(!a.report.contradiction.is_nan(), "{name}: {a:?}");
            // The reports of the constraints agree with the report of the whole.
            assert_eq!(a.worst, a.report.contradiction, "{name}: {a:?}");
        }
    }
    out
}

fn solid() -> MassProperties {
    MassProperties::new(1.0, Vec3::new(0.5, 0.0, 0.0), Mat3::identity() * 0.1)
}

fn in_plane() -> Hinge {
    Hinge::chain([SubhingeKind::Slider { axis: Vec3::z() }, SubhingeKind::Ball])
}

/// Links of 1 m from the world at the origin, closed to the world at (1, 0).
fn four_bar(closing: Hinge, masses: [MassProperties; 3]) -> Builder {
    let mut b = Builder::new();
    for (i, (parent, mass)) in ["world", "l0", "l1"].into_iter().zip(masses).enumerate() {
        let at = Pose::translation(if i == 0 { 0.0 } else { 1.0 }, 0.0, 0.0);
        let spec = BodySpec::new(format!("l{i}"), parent).hinge_in_parent(at);
        b.body(spec.hinge(Hinge::pin(Vec3::z())).mass(mass));
    }
    b.loop_closure(closure("close", "world", "l2", closing));
    b
}

fn closure(name: &str, a: &str, b: &str, hinge: Hinge) -> LoopClosure {
    let end = Pose::translation(1.0, 0.0, 0.0);
    LoopClosure {
        name: name.into(),
        body_a: a.into(),
        frame_a: end,
        body_b: b.into(),
        frame_b: end,
        hinge,
    }
}

const OPEN: [f64; 3] = [1.3, -1.3, -1.841_592_653_589_793];
const TURNING: [f64; 3] = [0.3, -0.3, 0.3];

#[test]
fn repeated_rows_are_counted_and_named() {
    let mbs = four_bar(Hinge::pin(Vec3::z()), [solid(); 3]).build().unwrap();
    for (name, o) in solve(&mbs, &Input::at(&OPEN, &TURNING)) {
        let a = o.unwrap();
        assert!(a.report.contradiction < 1e-12, "{name}: {a:?}");
        assert_eq!(a.redundant, [("close".to_owned(), 3)], "{name}");
    }
    let mbs = four_bar(in_plane(), [solid(); 3]).build().unwrap();
    for (name, o) in solve(&mbs, &Input::at(&OPEN, &TURNING)) {
        assert!(o.unwrap().redundant.is_empty(), "{name}");
    }
}

/// The same loop twice: the second is redundant as a whole.
#[test]
fn a_loop_given_twice_is_harmless() {
    let mut b = four_bar(in_plane(), [solid(); 3]);
    let once = solve(&b.build().unwrap(), &Input::at(&OPEN, &TURNING));
    b.loop_closure(closure("again", "world", "l2", in_plane()));
    let twice = solve(&b.build().unwrap(), &Input::at(&OPEN, &TURNING));
    for ((name, a), (_, b)) in once.into_iter().zip(twice) {
        let (a, b) = (a.unwrap(), b.unwrap());
        assert_eq!(b.redundant.iter().map(|r| r.1).sum::<usize>(), 2, "{name}: {b:?}");
        for (x, y) in a.vdot.iter().zip(&b.vdot) {
            assert!((x - y).abs() < 1e-10, "{name}");
        }
    }
}

/// Two prescribed cranks with one degree of freedom: reported, or rejected with name and size.
#[test]
fn prescribed_hinges_against_a_loop() {
    let mbs = four_bar(in_plane(), [solid(); 3]).build().unwrap();
    let hinge = |name: &str| mbs.body(name).unwrap();
    let all = ["l0", "l1", "l2"]
        .into_iter()
        .fold(mbs.clone(), |m, n| m.with_coordinate(hinge(n), Coordinate::Prescribed));
    let two = mbs
        .clone()
        .with_coordinate(hinge("l0"), Coordinate::Prescribed)
        .with_coordinate(hinge("l1"), Coordinate::Prescribed);
    for mbs in [all, two] {
        let mut input = Input::at(&OPEN, &TURNING);
        input.vdot = vec![1.0, 5.0, 2.0];
        for (name, o) in solve(&mbs, &input) {
            let a = o.unwrap();
            assert!(a.report.contradiction > 0.5, "{name}: {a:?}");
            assert_eq!(a.redundant[0].0, "close", "{name}");
        }
        input.contradiction_max = 1e-6;
        for (name, o) in solve(&mbs, &input) {
            let error = o.unwrap_err();
            let SolverError::Contradiction { constraints, contradiction } = &error else {
                panic!("{name}: {error}")
            };
            assert_eq!(constraints, &["loop `close`"], "{name}");
            assert!(*contradiction > 0.5, "{name}");
            let text = error.to_string();
            assert!(text.starts_with("loop `close`") && text.contains("\n  help: "), "{text}");
        }
        // The loop is consistent if the prescribed motion agrees with it.
        let mut input = Input::at(&OPEN, &[0.0; 3]);
        input.contradiction_max = 1e-9;
        for (name, o) in solve(&mbs, &input) {
            assert!(o.is_ok(), "{name}: {o:?}");
        }
    }
}

#[test]
fn couplings_of_prescribed_coordinates() {
    let at = |body: &str| HingeCoordinate { body: body.into(), subhinge: 0 };
    let mut b = Builder::new();
    for name in ["a", "b"] {
        b.body(
            BodySpec::new(name, "world").hinge(Hinge::pin(Vec3::z()).prescribed()).mass(solid()),
        );
    }
    b.coupling(Coupling::mimic("gear", at("a"), at("b"), 2.0, 0.0));
    let mbs = b.build().unwrap();
    let mut input = Input::at(&[0.2, 0.1], &[0.4, 0.2]);
    for (vdot, lack) in [([2.0, 1.0], 0.0), ([2.0, 4.0], 6.0)] {
        input.vdot = vdot.to_vec();
        for (name, o) in solve(&mbs, &input) {
            let a = o.unwrap();
            assert_eq!(a.redundant, [("gear".to_owned(), 1)], "{name}");
            // Embedded rows are scaled by their largest coefficient, here 2.
            let scale = if name == "embedded" { 0.5 } else { 1.0 };
            let by = a.report.contradiction;
            assert!((by - lack).abs() < 1e-12 || (by - scale * lack).abs() < 1e-12, "{name}: {by}");
            assert!(by > 2.0 || lack == 0.0, "{name}: {by}");
            assert_eq!(a.vdot, vdot, "{name}");
        }
    }
}

/// Both ends on one link, on the world, or where nothing can move.
#[test]
fn loops_that_hold_nothing() {
    let mut b = Builder::new();
    let unit = Pose::translation(1.0, 0.0, 0.0);
    b.body(BodySpec::new("arm", "world").hinge(Hinge::pin(Vec3::z())).mass(solid()));
    b.body(BodySpec::new("plate", "arm").mass(solid()));
    b.body(BodySpec::new("post", "world").mass(solid()));
    b.loop_closure(closure("same link", "arm", "plate", Hinge::locked()));
    b.loop_closure(closure("ground", "world", "post", Hinge::ball()));
    for (name, o) in solve(&b.build().unwrap(), &Input::at(&[0.4], &[0.7])) {
        let a = o.unwrap();
        let want = [("ground".to_owned(), 3), ("same link".to_owned(), 6)];
        assert_eq!(a.redundant, want, "{name}");
        assert!(a.report.contradiction < 1e-12, "{name}: {a:?}");
    }
    // The loops cannot close with an offset. Dynamics has no row to detect this, but positions report it.
    b.loops_mut()[1].frame_b = unit * unit;
    let mbs = b.build().unwrap();
    let tree = Tree::new(&mbs);
    for t in [ConstraintMethod::Augment, ConstraintMethod::Embed] {
        let mut solver = ConstrainedSolver::new(&tree, |_| t);
        let (mut ws, mut q) = (Workspace::new(&tree), vec![0.4]);
        let closed =
            Projector::new(&tree).positions(&tree, &mut ws, &mut solver, &[], &mut q).unwrap_err();
        let ProjectionError::Open { constraint, closing } = &closed else { panic!("{closed}") };
        assert_eq!(constraint, "loop `ground`");
        assert!((closing.error - 1.0).abs() < 1e-9);
    }
    // The post is welded to the world, so nothing can move.
    let mut b = Builder::new();
    b.body(BodySpec::new("post", "world").mass(solid()));
    b.loop_closure(closure("ground", "world", "post", Hinge::ball()));
    for (name, o) in solve(&b.build().unwrap(), &Input::at(&[], &[])) {
        assert_eq!(o.unwrap().redundant, [("ground".to_owned(), 3)], "{name}");
    }
    for (_, o) in solve(&Builder::new().build().unwrap(), &Input::at(&[], &[])) {
        assert!(o.unwrap().redundant.is_empty());
    }
}

#[test]
fn loops_of_a_body_with_itself_are_refused() {
    for body in ["world", "arm"] {
        let mut b = Builder::new();
        b.body(BodySpec::new("arm", "world").hinge(Hinge::pin(Vec3::z())).mass(solid()));
        b.loop_closure(closure("ring", body, body, Hinge::ball()));
        let text = b.build().unwrap_err().to_string();
        assert!(text.contains("loop `ring`") && text.contains(body), "{text}");
        assert!(text.contains("help:"), "{text}");
    }
}

/// A massless coupler moves with the rest of its aggregate; as rows it has no inertia.
#[test]
fn massless_members() {
    let none = MassProperties::massless();
    for masses in [[solid(), none, solid()], [solid(), solid(), none]] {
        let mbs = four_bar(in_plane(), masses).build().unwrap();
        let whole = solve(&mbs, &Input::at(&OPEN, &TURNING));
        for (name, o) in whole {
            match (name, o) {
                ("embedded", o) => {
                    let a = o.unwrap();
                    assert!(a.vdot.iter().any(|x| x.abs() > 0.1), "{a:?}");
                }
                // A massless link inboard of a solid one is allowed in recursions over a tree.
                ("rows", Ok(a)) => assert!(masses[2].mass > 0.0, "{a:?}"),
                ("rows", Err(e)) => {
                    let SolverError::Dynamics(DynamicsError::Singular { body, .. }) = &e else {
                        panic!("{e}")
                    };
                    assert_eq!(body, "l2");
                }
                (name, o) => panic!("{name}: {o:?}"),
            }
        }
        let error = FullyAugmentedSolver::new(&Tree::new(&mbs)).unwrap_err();
        assert!(matches!(error, FullyAugmentedError::Inertia { .. }), "{error}");
    }
    // All links are massless.
    let mbs = four_bar(in_plane(), [none; 3]).build().unwrap();
    for (name, o) in solve(&mbs, &Input::at(&OPEN, &TURNING)) {
        let e = o.unwrap_err();
        assert!(matches!(e, SolverError::Dynamics(DynamicsError::Singular { .. })), "{name}: {e}");
    }
}

/// A massless strut in a loop with more dofs than `Auto` embeds by default: it is embedded, since rows cannot solve it; with mass the rows agree.
#[test]
fn auto_embeds_a_massless_strut_in_a_large_loop() {
    let chain = |strut: MassProperties| {
        let mut b = Builder::new();
        for i in 0..8 {
            let parent = if i == 0 { "world".to_owned() } else { format!("l{}", i - 1) };
            let at = Pose::translation(if i == 0 { 0.0 } else { 0.4 }, 0.0, 0.0);
            let mass = if i == 7 { strut } else { solid() };
            let spec = BodySpec::new(format!("l{i}"), parent).hinge_in_parent(at).mass(mass);
            b.body(spec.hinge(Hinge::pin(Vec3::z())));
        }
        b.loop_closure(closure("close", "world", "l7", in_plane()));
        b.build().unwrap()
    };
    let none = chain(MassProperties::massless());
    let q: Vec<f64> = (0..8).map(|i| 0.3 + 0.17 * f64::from(i)).collect();
    let answer = |mbs: &Multibody, t: ConstraintMethod| {
        let tree = Tree::new(mbs);
        let mut solver = ConstrainedSolver::new(&tree, |_| t);
        let mut ws = Workspace::new(&tree);
        kinematics(&tree, &mut ws, &q, &[0.1; 8]);
        ws.apply_uniform_gravity(Vec3::new(0.3, -9.8, 0.1));
        let mut vdot = vec![0.0; 8];
        let state = (&q[..], &[0.1; 8][..]);
        let told =
            solver.forward_given_kinematics(&tree, &mut ws, state, &[], &mut [0.2; 8], &mut vdot);
        told.map(|_| vdot)
    };
    assert!(answer(&none, ConstraintMethod::Augment).is_err());
    let auto = answer(&none, ConstraintMethod::Auto).unwrap();
    assert_eq!(auto, answer(&none, ConstraintMethod::Embed).unwrap());
    // A strut with almost no mass, solved as rows, agrees with the massless strut within the effect
    // of its mass.
    let light = MassProperties::new(1e-7, Vec3::new(0.2, 0.0, 0.0), Mat3::identity() * 1e-8);
    let rows = answer(&chain(light), ConstraintMethod::Augment).unwrap();
    let by_rule = answer(&chain(light), ConstraintMethod::Auto).unwrap();
    assert_eq!(rows, by_rule, "eight dofs with mass are rows by rule");
    for (a, b) in auto.iter().zip(&rows) {
        assert!((a - b).abs() < 1e-4 * (1.0 + a.abs()), "{auto:?} {rows:?}");
    }
}

/// Links that are too short: the error names the loop and states the residual, and q stays finite.
#[test]
fn a_loop_that_cannot_close() {
    let mut b = four_bar(in_plane(), [solid(); 3]);
    b.loops_mut()[0].frame_a = Pose::translation(9.0, 0.0, 0.0);
    let tree = Tree::new(&b.build().unwrap());
    for t in [ConstraintMethod::Augment, ConstraintMethod::Embed] {
        let mut ws = Workspace::new(&tree);
        let mut solver = ConstrainedSolver::new(&tree, |_| t);
        let mut q = OPEN.to_vec();
        let e =
            Projector::new(&tree).positions(&tree, &mut ws, &mut solver, &[], &mut q).unwrap_err();
        let ProjectionError::Open { constraint, closing } = &e else { panic!("{t:?}: {e}") };
        assert_eq!(constraint, "loop `close`");
        // The ends are nine metres apart, and the links are three metres long in total.
        assert!(closing.error > 5.9 && closing.error < 9.0, "{t:?}: {closing:?}");
        assert!(q.iter().all(|x| x.is_finite()), "{t:?}: {q:?}");
        let text = e.to_string();
        assert!(text.contains("does not close") && text.contains("\n  help: "), "{text}");
    }
}

/// From any start: full Newton steps overshoot, halved ones converge.
#[test]
fn far_starts_close_by_shorter_steps() {
    let tree = Tree::new(&four_bar(in_plane(), [solid(); 3]).build().unwrap());
    for t in [ConstraintMethod::Augment, ConstraintMethod::Embed] {
        let (mut closed, mut ws) = (0, Workspace::new(&tree));
        let mut solver = ConstrainedSolver::new(&tree, |_| t);
        for seed in 0..100 {
            let mut q: Vec<f64> = tree.multibody().random_q(seed).iter().map(|x| 3.0 * x).collect();
            let done = Projector::new(&tree).positions(&tree, &mut ws, &mut solver, &[], &mut q);
            closed += usize::from(done.is_ok());
        }
        // Measured: 100.
        assert!(closed >= 98, "{t:?}: {closed} of 100 closed");
    }
}

/// NaN or infinity anywhere is an error in every solver.
#[test]
fn numbers_that_are_none() {
    let mut drive = Hinge::planar();
    drive.subhinges[0].coordinate = Coordinate::Prescribed;
    let mut b = four_bar(drive, [solid(); 3]);
    let at = |body: &str| HingeCoordinate { body: body.into(), subhinge: 0 };
    b.body(BodySpec::new("c", "l0").hinge(Hinge::pin(Vec3::z())).mass(solid()));
    b.body(BodySpec::new("d", "l0").hinge(Hinge::pin(Vec3::z()).prescribed()).mass(solid()));
    b.coupling(Coupling::mimic("gear", at("c"), at("d"), 2.0, 0.0));
    let mbs = b.build().unwrap();
    let sound = || {
        let mut input = Input::at(&[1.1, 0.2, 0.1, -1.0, -1.2], &[0.1; 5]);
        input.motions = vec![LoopMotion { position: 0.1, rate: 0.2, acceleration: 0.3 }];
        input
    };
    assert!(solve(&mbs, &sound()).iter().all(|(_, o)| o.is_ok()));
    let d = mbs.hinge("d").unwrap().start;
    for bad in [f64::NAN, f64::INFINITY] {
        for place in 0..8 {
            let mut input = sound();
            match place {
                0..3 => input.q[place] = bad,
                3 => input.v[1] = bad,
                4 => input.tau[(d + 1) % 5] = bad,
                5 => input.vdot[d] = bad,
                6 => input.motions[0].acceleration = bad,
                _ => input.motions[0].rate = bad,
            }
            for (name, o) in solve(&mbs, &input) {
                // The rate of a loop motion only affects reports and stabilisation.
                if place == 7 {
                    continue;
                }
                let e = o.unwrap_err();
                let text = e.to_string();
                assert!(text.contains("finite"), "{name}, {place}, {bad}: {text}");
            }
        }
    }
    let tree = Tree::new(&mbs);
    for t in [ConstraintMethod::Augment, ConstraintMethod::Embed] {
        let (mut ws, mut solver) = (Workspace::new(&tree), ConstrainedSolver::new(&tree, |_| t));
        let mut q = sound().q;
        q[1] = f64::NAN;
        let motions = sound().motions;
        let done = Projector::new(&tree).positions(&tree, &mut ws, &mut solver, &motions, &mut q);
        let text = done.unwrap_err().to_string();
        assert!(text.contains("finite"), "{t:?}: {text}");
    }
}

/// In line, where a parallelogram can change its branch: results are finite, and the lost row is reported.
#[test]
fn singular_positions_have_an_answer() {
    let mbs = four_bar(in_plane(), [solid(); 3]).build().unwrap();
    let flat = [0.0, 0.0, std::f64::consts::PI];
    for (name, o) in solve(&mbs, &Input::at(&flat, &[0.0; 3])) {
        let a = o.unwrap();
        assert_eq!(a.redundant.len(), 1, "{name}: {a:?}");
    }
}
