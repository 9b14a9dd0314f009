//! Edits and motion of mechanisms with loops and couplings: constraints are never dropped silently.

use linkwork_dynamics::multibody::{
    BodySpec, Builder, Coupling, Hinge, HingeCoordinate, LoopClosure, Multibody,
};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_dynamics::topology::{Placement, TopologyError, carry};
use linkwork_dynamics::*;
use std::collections::BTreeMap;

fn mass(m: f64) -> MassProperties {
    let inertia = Mat3::from_diagonal(&Vec3::new(0.3, 0.4, 0.5));
    MassProperties::new(m, Vec3::new(0.1, -0.02, 0.05), inertia)
}

fn pin(axis: Vec3) -> Hinge {
    Hinge::pin(axis)
}

fn body(name: &str, parent: &str, hinge: Hinge, at: Vec3) -> BodySpec {
    let pose = Pose { position: at, ..Pose::identity() };
    BodySpec::new(name, parent).hinge_in_parent(pose).hinge(hinge).mass(mass(2.0))
}

fn coordinate(body: &str) -> HingeCoordinate {
    HingeCoordinate { body: body.into(), subhinge: 0 }
}

/// A floating base with two coupled arms, a tool on one and a strut that closes a loop.
fn machine(tool: Hinge, tool_on: &str, tool_at: Vec3) -> Multibody {
    let mut b = Builder::new();
    b.body(body("base", "world", Hinge::free(), Vec3::zeros()));
    b.body(body("left", "base", pin(Vec3::y()), Vec3::new(0.5, 0.4, 0.0)));
    b.body(body("right", "base", pin(Vec3::y()), Vec3::new(0.5, -0.4, 0.0)));
    b.body(body("tool", tool_on, tool, tool_at));
    b.body(body("strut", "base", pin(Vec3::y()), Vec3::new(0.0, 0.4, 0.0)));
    b.coupling(Coupling::differential("sum", coordinate("left"), coordinate("right")));
    let x = |v: f64| Pose { position: Vec3::new(v, 0.0, 0.0), ..Pose::identity() };
    b.loop_closure(LoopClosure {
        name: "rod".into(),
        body_a: "left".into(),
        frame_a: x(0.25),
        body_b: "strut".into(),
        frame_b: x(0.75),
        hinge: pin(Vec3::y()),
    });
    b.build().unwrap()
}

fn welded() -> Multibody {
    machine(Hinge::locked(), "left", Vec3::new(0.6, 0.0, 0.0))
}

fn names(mbs: &Multibody) -> Vec<String> {
    mbs.constraints().map(|c| mbs.constraint_name(c).to_owned()).collect()
}

#[test]
fn loops_and_couplings_stay_where_their_bodies_do_and_others_are_told() {
    let mbs = welded();
    let open = || Edit::new(&mbs, &mbs.random_q(3), &mbs.random_v(3)).unwrap();
    let mut e = open();
    e.detach("tool", "world").unwrap();
    let done = e.finish();
    assert_eq!((names(&done.multibody), done.dropped), (names(&mbs), Vec::<String>::new()));
    let mut e = open();
    e.delete("strut").unwrap();
    let done = e.finish();
    assert_eq!(names(&done.multibody), ["sum"]);
    assert_eq!(done.dropped, ["rod"]);
    let mut e = open();
    e.detach("right", "world").unwrap();
    let done = e.finish();
    assert_eq!(names(&done.multibody), ["rod"]);
    assert_eq!(done.dropped, ["sum"]);
    // A second machine brings its own constraints with their own names.
    let mut e = open();
    let (q, v) = (mbs.neutral_q(), vec![0.0; mbs.nv()]);
    e.add_mechanism("b/", &mbs, (&q, &v), "world", Pose::identity()).unwrap();
    assert_eq!(names(&e.finish().multibody), ["b/rod", "rod", "b/sum", "sum"]);
}

#[test]
fn an_impact_through_constraints_is_refused_and_changes_nothing() {
    let mbs = machine(Hinge::free(), "world", Vec3::zeros());
    let mut e = Edit::new(&mbs, &mbs.random_q(5), &mbs.random_v(5)).unwrap();
    let before = (e.q().to_vec(), e.v().to_vec(), names(e.multibody()));
    let held = e.attach("tool", "left", Hinge::locked(), &Placement::here());
    assert!(matches!(held, Err(TopologyError::Constrained { .. })), "{held:?}");
    assert!(held.unwrap_err().to_string().contains("help"));
    assert_eq!((e.q().to_vec(), e.v().to_vec(), names(e.multibody())), before);
    let turned = e.reroot("right");
    assert!(turned.unwrap_err().to_string().contains("coupling `sum`"));
}

/// Returns momentum about the origin, angular and linear, of all bodies.
fn momentum(mbs: &Multibody, q: &[f64], v: &[f64]) -> [Vec3; 2] {
    let tree = Tree::new(mbs);
    let mut ws = Workspace::new(&tree);
    kinematics(&tree, &mut ws, q, v);
    let mut sum = [Vec3::zeros(), Vec3::zeros()];
    for id in mbs.body_ids() {
        let V = ws.body_velocity(&tree, id);
        let h = mbs.get(id).inertia().rotate_by(&ws.body_rotation(&tree, id)).apply(&V);
        let p = ws.body_pose(&tree, id).position;
        sum[0] += h.moment + p.cross(&h.force);
        sum[1] += h.force;
    }
    sum
}

type Poses = BTreeMap<String, Pose>;

#[test]
fn a_state_goes_over_with_poses_motion_and_momentum() {
    let old = welded();
    let free = machine(Hinge::free(), "world", Vec3::zeros());
    let (q, v) = (old.random_q(7), old.random_v(7));
    let start = (free.neutral_q(), vec![0.0; free.nv()]);
    let away = carry(&old, (&q, &v), &free, (&start.0, &start.1)).unwrap();
    assert_eq!(away.changed, ["tool"]);
    let poses = |m: &Multibody, q: &[f64]| -> Poses {
        let all = m.body_poses(q);
        m.body_ids().map(|b| (m.get(b).name().to_owned(), all[b.index()])).collect()
    };
    let (before, after): (Poses, Poses) = (poses(&old, &q), poses(&free, &away.q));
    assert_eq!(before.len(), after.len());
    for (name, a) in &before {
        let b = &after[name];
        assert!((a.position - b.position).norm() < 1e-14, "{name}");
        assert!(a.rotation.angle_to(&b.rotation) < 1e-7, "{name}");
    }
    let (h0, h1) = (momentum(&old, &q, &v), momentum(&free, &away.q, &away.v));
    for k in 0..2 {
        assert!((h0[k] - h1[k]).norm() <= 1e-13 * h0[k].norm(), "{k}: {} {}", h0[k], h1[k]);
    }
    // Unchanged parts are bit-identical.
    let left = (old.get(old.body("left").unwrap()), free.get(free.body("left").unwrap()));
    assert_eq!(q[left.0.q()], away.q[left.1.q()]);
    // Attach the tool again: the weld is closed exactly at the former pose, with an impact that
    // conserves momentum.
    let mut spun = away.v.clone();
    let tool = free.get(free.body("tool").unwrap());
    spun[tool.v()].iter_mut().for_each(|v| *v += 0.3);
    let h2 = momentum(&free, &away.q, &spun);
    let back = carry(&free, (&away.q, &spun), &old, (&old.neutral_q(), &vec![0.0; old.nv()]));
    let back = back.unwrap();
    let h3 = momentum(&old, &back.q, &back.v);
    for k in 0..2 {
        assert!((h2[k] - h3[k]).norm() <= 1e-12 * h2[k].norm(), "{k}: {} {}", h2[k], h3[k]);
    }
    let report = back.report.unwrap();
    assert!(report.energy_after < report.energy_before);
    // The weld cannot be closed from another configuration; the error states the distance.
    let mut moved = away.q.clone();
    moved[tool.q().start] += 0.5;
    let far = carry(&free, (&moved, &away.v), &old, (&old.neutral_q(), &vec![0.0; old.nv()]));
    assert!(matches!(far, Err(TopologyError::Unreachable { .. })), "{far:?}");
}
