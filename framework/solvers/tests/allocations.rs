//! Stepping does not allocate: constrained accelerations, projections, and contact after the first steps.

use crate::scene::{Scene, solid_box, turned};
use allocation_counter::{AllocationInfo, measure};
use linkwork_collision::{Material, Shape};
use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge, LoopClosure, Multibody};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_dynamics::{Tree, Workspace, kinematics};
use linkwork_solvers::{ConstrainedSolver, ConstraintMethod, Projector};

fn none(what: &str, info: &AllocationInfo) {
    assert_eq!(info.count_total, 0, "{what}: {info:?}");
}

/// The allocation counter works.
#[test]
#[should_panic(expected = "what allocates")]
fn an_allocation_is_seen() {
    none("what allocates", &measure(|| drop(std::hint::black_box(vec![1.0; 3]))));
}

/// Two four-bars in series on a free base, and a closed configuration.
fn mechanism() -> (Multibody, Vec<f64>) {
    let mut b = Builder::new();
    let J = Mat3::from_diagonal(&Vec3::new(0.02, 0.03, 0.04));
    let mass = || MassProperties::new(1.3, Vec3::new(0.2, 0.03, -0.01), J);
    b.body(BodySpec::new("base", "world").hinge(Hinge::free()).mass(mass()));
    let mut ground = "base".to_owned();
    for k in 0..2 {
        let n = |x: &str| format!("{x}{k}");
        for (name, parent, x) in
            [("crank", ground.clone(), 0.0), ("coupler", n("crank"), 0.5), ("rocker", ground, 1.0)]
        {
            b.body(
                BodySpec::new(n(name), parent)
                    .hinge_in_parent(Pose::translation(x, 0.0, 0.0))
                    .hinge(Hinge::pin(Vec3::y()))
                    .mass(mass()),
            );
        }
        b.loop_closure(LoopClosure {
            name: n("loop"),
            body_a: n("coupler"),
            frame_a: Pose::translation(1.0, 0.0, 0.0),
            body_b: n("rocker"),
            frame_b: Pose::translation(0.5, 0.0, 0.0),
            hinge: Hinge::ball(),
        });
        ground = n("coupler");
    }
    let mbs = b.build().unwrap();
    let mut q = mbs.random_q(3);
    for body in mbs.bodies().iter().filter(|b| b.q().len() == 1) {
        q[body.q().start] = if body.name().starts_with("coupler") { 1.1 } else { -1.1 };
    }
    (mbs, q)
}

#[test]
fn constrained_accelerations_and_projections() {
    let (mbs, start) = mechanism();
    let tree = Tree::new(&mbs);
    for constraint_method in [ConstraintMethod::Augment, ConstraintMethod::Embed] {
        let mut ws = Workspace::new(&tree);
        let mut solver = ConstrainedSolver::new(&tree, |_| constraint_method);
        let mut close = Projector::new(&tree);
        let (mut q, mut v) = (start.clone(), mbs.random_v(4));
        let (mut tau, mut vdot) = (mbs.random_v(5), vec![0.0; mbs.nv()]);
        let mut step = || {
            // Move away from the closed configuration, a little farther each time.
            q[8] += 1e-3;
            let moved = close.positions(&tree, &mut ws, &mut solver, &[], &mut q).unwrap();
            assert!(moved.steps > 0);
            close.rates(&tree, &mut ws, &mut solver, &[], &q, &mut v).unwrap();
            kinematics(&tree, &mut ws, &q, &v);
            let state = (&q[..], &v[..]);
            solver
                .forward_given_kinematics(&tree, &mut ws, state, &[], &mut tau, &mut vdot)
                .unwrap();
            for c in mbs.constraints() {
                assert!(solver.forces(&tree, c).iter().any(|x| *x != 0.0));
            }
        };
        step();
        none(
            &format!("{constraint_method:?}"),
            &measure(|| {
                for _ in 0..20 {
                    step();
                }
            }),
        );
    }
}

/// Boxes that slide, tumble and come to rest on each other; counted after a step with as many contacts.
#[test]
fn contact_steps() {
    let half = Vec3::new(0.1, 0.12, 0.08);
    let rough = Material { friction: 0.6, restitution: 0.1 };
    let mut s = Scene::default();
    s.ground(rough);
    for i in 0..6 {
        let f = f64::from(i);
        let at = Pose::new(
            turned(Vec3::new(0.2, 0.1 * f, 1.0), 0.3 * f),
            Vec3::new(0.02 * f, 0.01, 0.2 + 0.25 * f),
        );
        let shape = Shape::Box { half };
        s.body(&format!("box{i}"), solid_box(1.5, half), shape, rough, at, [0.0; 6]);
    }
    let mut run = s.run();
    let mut most = 0;
    for _ in 0..900 {
        most = most.max(run.step(2e-3).contacts);
    }
    let mut seen = 0;
    none(
        "contact",
        &measure(|| {
            for _ in 0..200 {
                seen = seen.max(run.step(2e-3).contacts);
            }
        }),
    );
    assert!(seen >= 8 && seen <= most, "{seen} contacts of at most {most}");
}
