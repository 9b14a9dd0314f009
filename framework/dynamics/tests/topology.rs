//! Topology at run time: an edit does not move anything, momentum is balanced, errors change nothing.

use crate::support::{Rng, Shape, random_tree};
use linkwork_dynamics::multibody::{
    BodySpec, Builder, Coordinate, Hinge, Limits, Multibody, SubhingeKind,
};
use linkwork_dynamics::spatial::{Force, MassProperties, Mat3, Motion, Pose, Vec3};
use linkwork_dynamics::topology::Report;
use linkwork_dynamics::*;
use std::collections::BTreeMap;

fn tree(seed: u64, floating: bool) -> Multibody {
    random_tree(seed, Shape { bodies: 8, floating, prescribed: false, armature: false })
}

fn edit(mbs: &Multibody, seed: u64) -> Edit {
    Edit::new(mbs, &mbs.random_q(seed), &mbs.random_v(seed)).unwrap()
}

type Seen = BTreeMap<String, (Pose, Motion, Motion)>;

/// Pose, velocity and (force-free) acceleration of each body.
fn bodies(mbs: &Multibody, q: &[f64], v: &[f64]) -> Seen {
    let tree = Tree::new(mbs);
    let mut ws = Workspace::new(&tree);
    let (mut tau, mut vdot) = (vec![0.0; mbs.nv()], vec![0.0; mbs.nv()]);
    forward_dynamics(&tree, &mut ws, q, v, &mut tau, &mut vdot).unwrap();
    let see = |b| {
        let (X, V) = (ws.body_pose(&tree, b), ws.body_velocity(&tree, b));
        (mbs.get(b).name().to_owned(), (X, V, ws.body_acceleration(&tree, b)))
    };
    mbs.body_ids().map(see).collect()
}

fn seen(e: &Edit) -> Seen {
    bodies(e.multibody(), e.q(), e.v())
}

fn gap(a: &Motion, b: &Motion) -> f64 {
    (a.angular - b.angular).norm().max((a.linear - b.linear).norm())
}

/// Checks that poses and velocities of bodies of `a` equal those of `b`; fails for NaN.
#[track_caller]
fn kept(a: &Seen, b: &Seen, tol: f64, what: &str) {
    for (name, (X, V, _)) in a {
        let (Y, W, _) = &b[name];
        let R = X.rotation.to_rotation_matrix().matrix() - Y.rotation.to_rotation_matrix().matrix();
        let size = 1.0 + Y.position.norm();
        let error = R.abs().max().max((X.position - Y.position).norm() / size);
        assert!(error <= tol, "{what}: pose of {name} is off by {error:e}");
        let error = gap(V, W) / (1.0 + W.linear.norm() + W.angular.norm());
        assert!(error <= tol, "{what}: velocity of {name} is off by {error:e}");
    }
}

fn size(f: &Force) -> f64 {
    f.moment.norm().max(f.force.norm())
}

#[track_caller]
fn momentum_kept(r: &Report, tol: f64, what: &str) {
    let error = size(&(r.momentum_after - r.momentum_before)) / (1.0 + size(&r.momentum_before));
    assert!(error <= tol, "{what}: momentum changes by {error:e}");
}

#[track_caller]
fn energy_kept(r: &Report, tol: f64, what: &str) {
    let error = (r.energy_after - r.energy_before).abs() / (1.0 + r.energy_before);
    assert!(error <= tol, "{what}: energy changes by {error:e}");
}

#[test]
fn detaching_keeps_every_pose_velocity_momentum_and_energy() {
    for seed in 0..25 {
        let mbs = tree(seed, seed.is_multiple_of(2));
        for body in ["b00", "b03", "b07"] {
            let mut e = edit(&mbs, seed);
            let before = seen(&e);
            let what = format!("seed {seed}, {body}");
            let report = e.detach(body, "world").unwrap();
            kept(&seen(&e), &before, 1e-13, &what);
            momentum_kept(&report, 1e-12, &what);
            energy_kept(&report, 1e-12, &what);
            assert_eq!(size(&report.impulse), 0.0);
            assert_eq!(e.multibody().bodies().len(), 8);
            // Detach onto another body, so that the free hinge is between moving frames.
            let other = if body == "b00" { "world" } else { "b00" };
            let report = e.detach(body, other).unwrap();
            kept(&seen(&e), &before, 1e-13, &what);
            momentum_kept(&report, 1e-12, &what);
            energy_kept(&report, 1e-12, &what);
        }
    }
}

#[test]
fn a_detached_body_is_reattached_by_its_own_hinge_without_a_jolt() {
    for seed in 0..25 {
        let mbs = tree(seed, seed.is_multiple_of(2));
        for body in ["b01", "b04", "b06"] {
            let spec = mbs.spec(mbs.body(body).unwrap());
            let mut e = edit(&mbs, seed);
            let before = seen(&e);
            e.detach(body, "world").unwrap();
            let frames = Placement::Frames {
                hinge_in_parent: spec.hinge_in_parent,
                hinge_in_body: spec.hinge_in_body,
            };
            let report = e.attach(body, &spec.parent, spec.hinge.clone(), &frames).unwrap();
            let what = format!("seed {seed}, {body}: {:?}", spec.hinge.subhinges);
            // Accelerations are equal too, because the mechanism is the same again.
            let after = seen(&e);
            kept(&after, &before, 1e-11, &what);
            momentum_kept(&report, 1e-12, &what);
            energy_kept(&report, 1e-12, &what);
            assert!(size(&report.impulse) <= 1e-11 * (1.0 + report.energy_before), "{what}");
            for (name, (_, _, A)) in &after {
                let want = &before[name].2;
                let error = gap(A, want) / (1.0 + want.linear.norm() + want.angular.norm());
                assert!(error <= 1e-8, "{what}: acceleration of {name} is off by {error:e}");
            }
        }
    }
}

/// A floating tree with chains on every hinge.
fn floating(seed: u64) -> Multibody {
    let mut b = Builder::from(&tree(seed, true));
    let mut r = Rng(seed);
    let chain = Hinge::chain([
        SubhingeKind::Pin { axis: r.vec3() },
        SubhingeKind::Slider { axis: r.vec3() },
        SubhingeKind::Ball,
    ]);
    b.bodies_mut().iter_mut().find(|b| b.name == "b02").unwrap().hinge = chain;
    // All subtrees are connected to the floating base.
    for body in b.bodies_mut().iter_mut().skip(1) {
        if body.hinge == Hinge::free() {
            body.hinge = Hinge::screw(r.vec3(), 0.3);
        }
    }
    b.build().unwrap()
}

#[test]
fn a_free_tree_turned_round_is_the_same_mechanism() {
    for seed in 0..25 {
        let mbs = floating(seed);
        for body in ["b00", "b02", "b05", "b07"] {
            let mut e = edit(&mbs, seed);
            let before = seen(&e);
            let what = format!("seed {seed}, {body}");
            let report = e.reroot(body).unwrap();
            let id = e.multibody().body(body).unwrap();
            assert_eq!(e.multibody().get(id).parent(), None);
            assert_eq!(e.multibody().nv(), mbs.nv());
            let after = seen(&e);
            kept(&after, &before, 1e-12, &what);
            momentum_kept(&report, 1e-12, &what);
            energy_kept(&report, 1e-12, &what);
            for (name, (_, _, A)) in &after {
                let want = &before[name].2;
                let error = gap(A, want) / (1.0 + want.linear.norm() + want.angular.norm());
                assert!(error <= 1e-9, "{what}: acceleration of {name} is off by {error:e}");
            }
            // Reversing back restores the hinges.
            e.reroot("b00").unwrap();
            for name in ["b01", "b04", "b06"] {
                let (a, b) = (mbs.body(name).unwrap(), e.multibody().body(name).unwrap());
                assert_eq!(mbs.spec(a), e.multibody().spec(b), "{what}: {name}");
                let (a, b) = (mbs.get(a).v(), e.multibody().get(b).v());
                let (old, now) = (&mbs.random_v(seed)[a], &e.v()[b]);
                assert!(old.iter().zip(now).all(|(a, b)| (a - b).abs() < 1e-13), "{what}: {name}");
            }
        }
    }
}

#[test]
fn a_driven_free_subhinge_inside_a_chain_turns_round_too() {
    for seed in 0..10 {
        let mut b = Builder::from(&floating(seed));
        let mut r = Rng(seed + 2);
        // The hinge is prescribed, because next to a free subhinge nothing would constrain the pins.
        let pin = SubhingeKind::Pin { axis: r.vec3() };
        let hinge = Hinge::chain([pin, SubhingeKind::Free, pin]);
        for body in b.bodies_mut().iter_mut().filter(|b| b.parent == "b00") {
            body.hinge = hinge.clone().prescribed();
        }
        let mbs = b.build().unwrap();
        let child = mbs.spec(mbs.body_ids().nth(1).unwrap()).name;
        let mut e = edit(&mbs, seed);
        let before = seen(&e);
        let report = e.reroot(&child).unwrap();
        kept(&seen(&e), &before, 1e-13, &format!("seed {seed}"));
        momentum_kept(&report, 1e-12, &format!("seed {seed}"));
        assert_ne!(e.multibody(), &mbs);
    }
}

/// ½ Σ (V − W)* M (V − W).
fn distance(mbs: &Multibody, a: &Seen, b: &Seen) -> f64 {
    let one = |body: &multibody::Body| {
        let ((X, V, _), (_, W, _)) = (&a[body.name()], &b[body.name()]);
        let d = *V - *W;
        0.5 * d.dot(&body.inertia().rotate(&X.rotation).apply(&d))
    };
    mbs.bodies().iter().map(one).sum()
}

fn hinges() -> Vec<Hinge> {
    let mut r = Rng(8);
    vec![
        Hinge::locked(),
        Hinge::pin(r.vec3()),
        Hinge::slider(r.vec3()),
        Hinge::screw(r.vec3(), 0.4),
        Hinge::ball(),
        Hinge::universal(r.vec3(), r.vec3()),
        Hinge::planar(),
        Hinge::chain([SubhingeKind::Slider { axis: r.vec3() }, SubhingeKind::Ball]),
        Hinge::free(),
    ]
}

#[test]
fn a_catch_in_flight_keeps_momentum_and_loses_least() {
    for (i, hinge) in hinges().into_iter().enumerate() {
        for seed in [1, 2, 3] {
            // The scene has two floating trees. A body in the middle of one catches the other.
            let (a, b) = (floating(seed), floating(seed + 50));
            let mut e = edit(&a, seed);
            let (q, v) = (b.random_q(seed + 9), b.random_v(seed + 9));
            e.add_mechanism("other/", &b, (&q, &v), "world", Rng(seed).pose()).unwrap();
            let before = seen(&e);
            let mut r = Rng(seed + i as u64);
            let here = Placement::Here { hinge_in_body: r.pose(), q: None };
            let report = e.attach_tree("other/b05", "b04", hinge.clone(), &here).unwrap();
            let (after, what) = (seen(&e), format!("seed {seed}, {hinge:?}"));
            assert_eq!(e.multibody().nv(), a.nv() + b.nv() - 6 + hinge.nv());
            momentum_kept(&report, 1e-12, &what);
            for (name, (X, ..)) in &after {
                let error = (X.position - before[name].0.position).norm();
                assert!(error <= 1e-12, "{what}: {name} moved by {error:e}");
            }
            // The energy lost equals the energy of the change of velocity: the hinge does no work, and the loss is the smallest possible.
            let lost = report.energy_before - report.energy_after;
            let change = distance(e.multibody(), &after, &before);
            let error = (lost - change).abs() / report.energy_before;
            assert!(error <= 1e-12, "{what}: lost {lost}, changed by {change}");
            assert!(hinge == Hinge::free() || lost > 1e-3, "{what}: there was an impact");
            for j in 0..6 {
                let dv = Rng(j).vec(e.multibody().nv());
                let v: Vec<f64> = e.v().iter().zip(&dv).map(|(v, d)| v + 1e-3 * d).collect();
                let other = distance(e.multibody(), &bodies(e.multibody(), e.q(), &v), &before);
                assert!(other > change, "{what}: other rates would have changed less");
            }
            // The momentum given by the hinge equals the gain of the caught tree.
            let part = |s: &Seen| {
                let mut sum = Force::zero();
                for (name, (X, V, _)) in s.iter().filter(|(n, _)| n.starts_with("other/")) {
                    let body = e.multibody().get(e.multibody().body(name).unwrap());
                    let p = body.inertia().rotate(&X.rotation).apply(V);
                    sum += p.shift_to_parent(&(X.position - report.point));
                }
                sum
            };
            let error = size(&(part(&after) - part(&before) - report.impulse));
            assert!(error <= 1e-11, "{what}: impulse is off by {error:e}");
        }
    }
}

fn ball_of(mass: f64, inertia: f64, com: Vec3) -> MassProperties {
    MassProperties::new(mass, com, Mat3::identity() * inertia)
}

#[test]
fn impacts_have_their_closed_forms() {
    // Two bodies collide and stick together: v = (m1 v1 + m2 v2) / (m1 + m2).
    let mut b = Builder::new();
    b.body(BodySpec::new("a", "world").hinge(Hinge::free()).mass(ball_of(2.0, 0.1, Vec3::zeros())));
    b.body(BodySpec::new("b", "world").hinge(Hinge::free()).mass(ball_of(3.0, 0.2, Vec3::zeros())));
    let mbs = b.build().unwrap();
    let mut q = mbs.neutral_q();
    q[7] = 1.0;
    let v = [0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0];
    let mut e = Edit::new(&mbs, &q, &v).unwrap();
    let report = e.attach("b", "a", Hinge::locked(), &Placement::here()).unwrap();
    let common = (2.0 * 4.0 - 3.0) / 5.0;
    let after = seen(&e);
    assert!((after["b"].1.linear - Vec3::x() * common).norm() <= 1e-15);
    assert!((report.impulse.force - Vec3::x() * (3.0 * (common + 1.0))).norm() <= 1e-14);
    // The energy lost follows from the reduced mass: ½ m1 m2 / (m1 + m2) (v1 − v2)².
    let lost = report.energy_before - report.energy_after;
    assert!((lost - 0.5 * 6.0 / 5.0 * 25.0).abs() <= 1e-13);

    // A rod in flight is caught at one end by a pin on the world: ω = L_end / I_end.
    let (m, half, spin, speed) = (1.5, 0.8, 0.9, 2.0);
    let I = m * half * half / 3.0;
    let rod = MassProperties::new(m, Vec3::zeros(), Mat3::from_diagonal(&Vec3::new(1e-3, I, I)));
    let rod = rod.with_check(spatial::InertiaCheck::PositiveMoments);
    let mut b = Builder::new();
    b.body(BodySpec::new("rod", "world").hinge(Hinge::free()).mass(rod));
    let mbs = b.build().unwrap();
    let v = [0.0, 0.0, spin, 0.0, speed, 0.0];
    let mut e = Edit::new(&mbs, &mbs.neutral_q(), &v).unwrap();
    let end = Placement::Here { hinge_in_body: Pose::translation(-half, 0.0, 0.0), q: None };
    let report = e.attach("rod", "world", Hinge::pin(Vec3::z()), &end).unwrap();
    let omega = (I * spin + m * speed * half) / (I + m * half * half);
    assert!((e.v()[0] - omega).abs() <= 1e-14, "{} {omega}", e.v()[0]);
    // The world receives the difference; the moment about the pin is conserved.
    let difference = report.momentum_after.force - report.momentum_before.force;
    assert!((difference - report.impulse.force).norm() <= 1e-14);
    assert!((difference - Vec3::y() * (m * (omega * half - speed))).norm() <= 1e-14);
    let arm = Vec3::new(half, 0.0, 0.0);
    let moment = report.impulse.moment + arm.cross(&report.impulse.force);
    assert!(moment.norm() <= 1e-14, "a pin gives no moment about its axis: {moment:?}");
}

#[test]
fn prescribed_and_geared_hinges_take_part_as_they_can() {
    let base = tree(2, true);
    let mut b = Builder::from(&base);
    for body in b.bodies_mut().iter_mut().skip(1) {
        for (i, s) in body.hinge.subhinges.iter_mut().enumerate() {
            match s.kind {
                SubhingeKind::Free | SubhingeKind::Locked => {}
                _ if i == 0 && body.name.as_str() < "b04" => s.coordinate = Coordinate::Prescribed,
                _ => s.armature = 0.2,
            }
        }
    }
    let mbs = b.build().unwrap();
    let mut e = edit(&mbs, 3);
    let rock = ball_of(4.0, 0.3, Vec3::new(0.1, 0.0, 0.0));
    let spec = BodySpec::new("rock", "world").hinge(Hinge::free()).mass(rock);
    e.add(spec, &[0.3, 0.2, 0.1, 0.0, 0.0, 0.0, 1.0], &[0.1, 0.2, 0.3, -1.0, 0.5, 2.0]).unwrap();
    let places = |e: &Edit| e.multibody().prescribed();
    let given = |e: &Edit| -> Vec<f64> {
        e.v().iter().zip(places(e)).filter(|(_, p)| *p).map(|(v, _)| *v).collect()
    };
    let before = given(&e);
    let report = e.attach("rock", "b06", Hinge::ball(), &Placement::here()).unwrap();
    assert!(!before.is_empty());
    assert_eq!(given(&e), before, "prescribed rates stay");
    momentum_kept(&report, 1e-12, "motors are inside");
    assert!(report.energy_after < report.energy_before);
    // A removed hinge takes the energy of its rotor with it.
    let geared = mbs.subhinges().find(|(_, s)| s.subhinge.armature > 0.0 && s.v.len() == 1);
    let (body, s) = geared.unwrap();
    let mut e = edit(&mbs, 3);
    let chain = mbs.get(body).subhinges().iter().flat_map(|s| {
        let inertia = s.subhinge.reflected_inertia();
        e.v()[s.v.clone()].iter().map(move |b| 0.5 * inertia * b * b).collect::<Vec<_>>()
    });
    let (rotors, name) = (chain.sum::<f64>(), mbs.get(body).name());
    assert!(rotors > 1e-4, "{s:?}");
    let report = e.detach(name, "world").unwrap();
    assert!((report.energy_before - report.energy_after - rotors).abs() < 1e-12);
    // A prescribed new hinge gets the nearest rate and keeps it.
    let mut e = edit(&mbs, 3);
    e.detach("b06", "world").unwrap();
    let motor = Hinge::pin(Vec3::x()).prescribed();
    let report = e.attach("b06", "b01", motor, &Placement::here()).unwrap();
    momentum_kept(&report, 1e-12, "prescribed hinge");
}

#[test]
fn books_are_kept_through_a_detach_a_flight_and_a_catch() {
    let mbs = floating(4);
    let (mut q, mut v) = (mbs.random_q(4), mbs.random_v(4));
    let mut now = mbs.clone();
    let total = |mbs: &Multibody, q: &[f64], v: &[f64]| {
        let mut e = Edit::new(mbs, q, v).unwrap();
        // An edit without effect reports the momentum about the first body; shift it to the origin.
        let r = e.reroot("b00").unwrap();
        r.momentum_before.shift_to_parent(&r.point)
    };
    let fly = |mbs: &Multibody, q: &mut Vec<f64>, v: &mut Vec<f64>| {
        let tree = Tree::new(mbs);
        let mut ws = Workspace::new(&tree);
        let n = v.len();
        let mut rate = |q: &[f64], v: &[f64]| {
            let (mut tau, mut a, mut qd) = (vec![0.0; n], vec![0.0; n], vec![0.0; q.len()]);
            forward_dynamics(&tree, &mut ws, q, v, &mut tau, &mut a).unwrap();
            mbs.qdot(q, v, &mut qd);
            (qd, a)
        };
        let go = |x: &[f64], d: &[f64], h: f64| -> Vec<f64> {
            x.iter().zip(d).map(|(x, d)| x + h * d).collect()
        };
        let h = 2e-4;
        for _ in 0..250 {
            let (q1, v1) = rate(q, v);
            let (q2, v2) = rate(&go(q, &q1, h / 2.0), &go(v, &v1, h / 2.0));
            let (q3, v3) = rate(&go(q, &q2, h / 2.0), &go(v, &v2, h / 2.0));
            let (q4, v4) = rate(&go(q, &q3, h), &go(v, &v3, h));
            for (x, k) in [(&mut *q, [q1, q2, q3, q4]), (&mut *v, [v1, v2, v3, v4])] {
                for i in 0..x.len() {
                    x[i] += h / 6.0 * (k[0][i] + 2.0 * (k[1][i] + k[2][i]) + k[3][i]);
                }
            }
            mbs.normalize(q);
        }
    };
    let first = total(&now, &q, &v);
    let steps: [fn(&mut Edit) -> Result<Report, TopologyError>; 4] = [
        |e| e.detach("b03", "world"),
        |e| e.detach("b06", "b03"),
        |e| e.attach_tree("b06", "b01", Hinge::ball(), &Placement::here()),
        |e| e.reroot("b00"),
    ];
    for (i, step) in steps.iter().enumerate() {
        fly(&now, &mut q, &mut v);
        let mut e = Edit::new(&now, &q, &v).unwrap();
        let before = seen(&e);
        let report = step(&mut e).unwrap();
        momentum_kept(&report, 1e-12, &format!("step {i}"));
        assert!(report.energy_after <= report.energy_before * (1.0 + 1e-12), "step {i}");
        if i != 2 {
            kept(&seen(&e), &before, 1e-12, &format!("step {i}"));
        }
        let done = e.finish();
        (now, q, v) = (done.multibody, done.q, done.v);
    }
    fly(&now, &mut q, &mut v);
    // Measured: 2e-15.
    let error = size(&(total(&now, &q, &v) - first)) / size(&first);
    println!("momentum drifts by {error:e}");
    assert!(error <= 1e-12, "momentum drifts by {error:e}");
}

#[test]
fn any_sequence_of_edits_keeps_the_books() {
    let (mut done, mut refused, mut moved) = (0, 0, 0);
    for seed in 0..30 {
        let mut e = edit(&floating(seed), seed);
        let mut r = Rng(seed + 100);
        let names: Vec<String> = e.multibody().bodies().iter().map(|b| b.name().into()).collect();
        for step in 0..12 {
            let pick = |r: &mut Rng| names[r.below(names.len())].clone();
            let (body, onto) = (pick(&mut r), pick(&mut r));
            let hinge = hinges()[r.below(9)].clone();
            let here = Placement::Here { hinge_in_body: r.pose(), q: None };
            let before = (seen(&e), e.clone());
            let (gentle, result) = match r.below(5) {
                0 => (true, e.detach(&body, "world")),
                1 => (true, e.detach(&body, &onto)),
                2 => (true, e.reroot(&body)),
                3 => (false, e.attach(&body, &onto, hinge, &here)),
                _ => (false, e.attach_tree(&body, &onto, hinge, &here)),
            };
            let what = format!("seed {seed}, step {step}");
            let Ok(report) = result else {
                refused += 1;
                assert_eq!(e.multibody(), before.1.multibody(), "{what}");
                assert_eq!((e.q(), e.v()), (before.1.q(), before.1.v()), "{what}");
                continue;
            };
            done += 1;
            momentum_kept(&report, 1e-11, &what);
            let after = seen(&e);
            if gentle {
                kept(&after, &before.0, 1e-11, &what);
                energy_kept(&report, 1e-11, &what);
            } else {
                moved += 1;
                assert!(report.energy_after <= report.energy_before * (1.0 + 1e-12), "{what}");
                for (name, (X, ..)) in &after {
                    let error = (X.position - before.0[name].0.position).norm();
                    assert!(error <= 1e-11, "{what}: {name} jumps by {error:e}");
                }
            }
        }
    }
    println!("{done} edits, {moved} of them impacts, {refused} refusals");
    assert!(done > 150 && moved > 40 && refused > 40);
}

#[test]
fn mechanisms_come_and_go_and_places_are_told() {
    let (a, b) = (tree(3, false), tree(5, true));
    let mut e = edit(&a, 1);
    let before = seen(&e);
    let (q, v) = (b.random_q(2), b.random_v(2));
    let X = Rng(3).pose();
    let report = e.add_mechanism("arm/", &b, (&q, &v), "b02", X).unwrap();
    assert!(size(&(report.momentum_after - report.momentum_before)) > 1e-3, "it brought momentum");
    let after = seen(&e);
    kept(&before, &after, 1e-14, "what was there");
    // Its parent is b02, and it moves with it.
    let tree_b = Tree::new(&b);
    let mut ws = Workspace::new(&tree_b);
    let (on, V, _) = &after["b02"];
    let p = on.rotation * X.position;
    let base = Motion::new(V.angular, V.linear + V.angular.cross(&p));
    ws.set_base(&(*on * X), &base, &Motion::zero());
    kinematics(&tree_b, &mut ws, &q, &v);
    for id in b.body_ids() {
        let (X, V, _) = &after[&format!("arm/{}", b.get(id).name())];
        assert!((X.position - ws.body_pose(&tree_b, id).position).norm() < 1e-13);
        assert!(gap(V, &ws.body_velocity(&tree_b, id)) < 1e-12);
    }
    assert!(e.multibody().node("arm/n03").is_some());
    // Delete a part of the added mechanism, detach another body, and check the new indices of the
    // coordinates of the first mechanism.
    e.delete("arm/b00").unwrap();
    assert!(e.multibody().bodies().iter().all(|b| !b.name().starts_with("arm/")));
    e.detach("b05", "world").unwrap();
    e.delete("b07").unwrap();
    let done = e.finish();
    let (old_q, old_v) = (a.random_q(1), a.random_v(1));
    let mut moved = 0;
    for body in a.bodies() {
        let id = a.body(body.name()).unwrap();
        let now = done.places.bodies[id.index()];
        assert_eq!(now, done.multibody.body(body.name()));
        for i in body.v() {
            match done.places.v[i] {
                Some(j) => assert_eq!(done.v[j], old_v[i]),
                None => moved += 1,
            }
        }
        for i in body.q() {
            let lost = now.is_none() || body.name() == "b05";
            assert_eq!(done.places.q[i].is_none(), lost, "{}", body.name());
            assert!(done.places.q[i].is_none_or(|j| done.q[j] == old_q[i]));
        }
    }
    assert!(moved > 0);
}

#[test]
fn far_away_neighbours_keep_their_digits() {
    let mut r = Rng(4);
    let mut b = Builder::new();
    let far = Pose::new(r.quat(), Vec3::new(1.5e11, -0.4e11, 0.2e11));
    b.body(BodySpec::new("ship", "world").hinge_in_parent(far).hinge(Hinge::free()).mass(r.mass()));
    let (X, axis) = (r.pose(), r.vec3());
    b.body(
        BodySpec::new("probe", "ship").hinge_in_parent(X).hinge(Hinge::pin(axis)).mass(r.mass()),
    );
    let mbs = b.build().unwrap();
    let mut e = edit(&mbs, 1);
    let angle = mbs.random_q(1)[7];
    let rate = mbs.random_v(1)[6];
    e.detach("probe", "ship").unwrap();
    let frames = Placement::Frames { hinge_in_parent: X, hinge_in_body: Pose::identity() };
    e.attach("probe", "ship", Hinge::pin(axis), &frames).unwrap();
    assert!((e.q()[7] - angle).abs() < 1e-14 && (e.v()[6] - rate).abs() < 1e-13);
}

#[test]
fn mistakes_are_refused_and_change_nothing() {
    let mbs = tree(3, false);
    let mut e = edit(&mbs, 1);
    let untouched = (mbs.clone(), e.q().to_vec(), e.v().to_vec());
    let here = Placement::here();
    let pin = || Hinge::pin(Vec3::z());
    let child = mbs.body("b00").map(|b| mbs.subtree(b).nth(1).unwrap()).unwrap();
    let child = mbs.get(child).name().to_owned();

    let text = e.delete("b99").unwrap_err().to_string();
    assert!(text.starts_with("delete: no body `b99`"), "{text}");
    assert!(
        e.detach("world", "b00").unwrap_err().to_string().contains("the world cannot be edited")
    );
    assert!(matches!(e.detach("b00", "nowhere"), Err(TopologyError::Unknown { .. })));
    assert!(matches!(e.attach("b00", "x", pin(), &here), Err(TopologyError::Unknown { .. })));
    assert!(matches!(e.reroot("x"), Err(TopologyError::Unknown { .. })));
    for (body, onto) in [("b00", child.as_str()), ("b00", "b00")] {
        let error = e.attach(body, onto, pin(), &here).unwrap_err();
        let want = TopologyError::OwnSubtree { body: body.into(), onto: onto.into() };
        assert_eq!(error, want);
        assert!(matches!(e.detach(body, onto), Err(TopologyError::OwnSubtree { .. })));
    }
    let again = BodySpec::new("b04", "world");
    assert!(matches!(e.add(again, &[], &[]), Err(TopologyError::NameClash { .. })));
    let error = e.add_mechanism("", &mbs, (&untouched.1, &untouched.2), "world", Pose::identity());
    assert!(matches!(error, Err(TopologyError::NameClash { names, .. }) if names.len() == 16));
    let spec = || BodySpec::new("new", "b00").hinge(pin());
    assert!(matches!(e.add(spec(), &[], &[0.0]), Err(TopologyError::Length { what: "q", .. })));
    assert!(matches!(e.add(spec(), &[0.0], &[f64::NAN]), Err(TopologyError::NotFinite { .. })));
    assert!(matches!(
        e.add(BodySpec::new("new", "nobody"), &[], &[]),
        Err(TopologyError::Build(_))
    ));
    let wrong = Placement::Here { hinge_in_body: Pose::identity(), q: Some(vec![0.0; 3]) };
    assert!(matches!(e.attach("b05", "b00", pin(), &wrong), Err(TopologyError::Length { .. })));
    let nan = Pose::translation(f64::NAN, 0.0, 0.0);
    let broken = Placement::Here { hinge_in_body: nan, q: None };
    assert!(matches!(e.attach("b05", "b00", pin(), &broken), Err(TopologyError::Build(_))));
    let limits = Hinge::ball().limits(Limits::position(0.0, 1.0));
    assert!(matches!(e.attach("b05", "b00", limits, &here), Err(TopologyError::Build(_))));

    // A pin that would have to jump is an error with the distance; so is a tree that is fixed to
    // the world.
    let onto_parent = |X| Placement::Frames { hinge_in_parent: X, hinge_in_body: Pose::identity() };
    let away = onto_parent(Pose::translation(50.0, 0.0, 0.0));
    let error = e.attach("b05", "b00", pin(), &away).unwrap_err();
    assert!(matches!(error, TopologyError::Unreachable { distance, .. } if distance > 10.0));
    assert!(error.to_string().contains(" m and "), "{error}");
    let bolted = tree(7, false);
    let mut f = edit(&bolted, 1);
    let root = bolted.bodies()[0].name();
    let mut fixed = Builder::from(&bolted);
    fixed.bodies_mut().iter_mut().for_each(|b| {
        if b.hinge == Hinge::free() {
            b.hinge = pin();
        }
    });
    let fixed = fixed.build().unwrap();
    let mut f2 = edit(&fixed, 1);
    let error = f2.reroot(fixed.bodies()[2].name()).unwrap_err();
    assert!(matches!(&error, TopologyError::NotFree { .. }), "{error}");
    f.detach(root, "world").unwrap();
    f.reroot(root).unwrap();

    // No body can move, so the impact cannot be solved.
    let dust = BodySpec::new("dust", "world")
        .hinge(Hinge::pin(Vec3::x()))
        .mass(MassProperties::massless());
    let mut g = Edit::new(&mbs, &untouched.1, &untouched.2).unwrap();
    g.add(dust, &[0.0], &[1.0]).unwrap();
    let error = g.attach("dust", "b00", Hinge::slider(Vec3::z()), &here).unwrap_err();
    assert!(matches!(error, TopologyError::Dynamics(_)), "{error}");

    assert_eq!((e.multibody().clone(), e.q().to_vec(), e.v().to_vec()), untouched);
    let bad = vec![f64::NAN; mbs.nq()];
    assert!(matches!(Edit::new(&mbs, &bad, e.v()), Err(TopologyError::NotFinite { .. })));
}
