//! Frames: compared with the kernels, time differences and closed forms; also which quantities are computed and when.

use crate::support::{Rng, Shape, random_tree};
use linkwork_dynamics::frames::MechanismId;
use linkwork_dynamics::multibody::Multibody;
use linkwork_dynamics::spatial::{Motion, Pose, Quat, Vec3};
use linkwork_dynamics::*;

fn tree(seed: u64) -> Multibody {
    let floating = seed.is_multiple_of(2);
    random_tree(seed, Shape { bodies: 9, floating, prescribed: false, armature: false })
}

/// Panics unless `a` is within `tol` of `b`, relative to 1 plus the size of `b`.
#[track_caller]
fn near(a: &Vec3, b: &Vec3, tol: f64, what: &str) {
    let error = (a - b).norm() / (1.0 + b.norm());
    assert!(error <= tol, "{what}: off by {error:e}\n  got  {a:?}\n  want {b:?}");
}

#[track_caller]
fn near_motion(a: &Motion, b: &Motion, tol: f64, what: &str) {
    near(&a.angular, &b.angular, tol, &format!("{what}, angular"));
    near(&a.linear, &b.linear, tol, &format!("{what}, linear"));
}

#[track_caller]
fn near_pose(a: &Pose, b: &Pose, tol: f64, what: &str) {
    near(&a.position, &b.position, tol, &format!("{what}, position"));
    let angle = a.rotation.angle_to(&b.rotation);
    assert!(angle <= tol.max(1e-7) && angle.is_finite(), "{what}: turned by {angle:e}");
    let (a, b) = (a.rotation.to_rotation_matrix(), b.rotation.to_rotation_matrix());
    let error = (a.matrix() - b.matrix()).abs().max();
    assert!(error <= tol, "{what}: rotation off by {error:e}");
}

fn motion(r: &mut Rng) -> Motion {
    Motion::new(r.vec3(), r.vec3())
}

#[test]
fn seen_from_the_world_nodes_are_where_the_kernels_say() {
    for seed in 0..40 {
        let mbs = tree(seed);
        let kernel = Tree::new(&mbs);
        let mut ws = Workspace::new(&kernel);
        let (q, v, vdot) = (mbs.random_q(seed), mbs.random_v(seed), mbs.random_v(seed + 1));
        let mut r = Rng(seed);
        // Test on a moving base, too.
        let (X, V, A) = (r.pose(), motion(&mut r), motion(&mut r));
        ws.set_base(&X, &V, &A);
        inverse_dynamics(&kernel, &mut ws, &q, &v, &vdot, &mut vec![0.0; mbs.nv()]);
        let mut frames = Frames::new();
        let world = frames.world();
        let base = frames.add_moving("base", world, Pose::identity()).unwrap();
        frames.set_moving(base, X, V, A).unwrap();
        let m = frames.add_mechanism("m", &mbs, base).unwrap();
        frames.set_q(m, &q).unwrap();
        frames.set_v(m, &v).unwrap();
        frames.set_vdot(m, &vdot).unwrap();
        for node in mbs.node_ids() {
            let what = format!("seed {seed}, node {}", node.index());
            let id = frames.node(m, node).unwrap();
            let pair = frames.pair(world, id).unwrap();
            near_pose(&frames.pose(pair), &ws.node_pose(&kernel, node), 1e-13, &what);
            near_motion(&frames.velocity(pair), &ws.node_velocity(&kernel, node), 1e-13, &what);
            let a = frames.acceleration(pair);
            near_motion(&a, &ws.node_acceleration(&kernel, node), 1e-12, &what);
        }
    }
}

#[test]
fn rates_are_differences_in_time_for_any_pair_in_any_axes() {
    let mut worst = (0.0_f64, 0.0_f64);
    for seed in 0..25 {
        let mbs = tree(seed);
        let (q, v, vdot) = (mbs.random_q(seed), mbs.random_v(seed), mbs.random_v(seed + 1));
        let mut frames = Frames::new();
        let world = frames.world();
        let m = frames.add_mechanism("m", &mbs, world).unwrap();
        let mut r = Rng(seed);
        let (n1, n7) = (frames.node_named(m, "n01").unwrap(), frames.node_named(m, "n07").unwrap());
        let camera = frames.add_fixed("camera", n7, r.pose()).unwrap();
        let table = frames.add_moving("table", n1, Pose::identity()).unwrap();
        let (X0, w, u) = (r.pose(), r.vec3(), r.vec3());
        let tool = frames.add_fixed("tool", table, r.pose()).unwrap();
        let pair = frames.pair(tool, camera).unwrap();
        let other = frames.pair_in(tool, camera, world).unwrap();
        let turn = frames.pair(world, tool).unwrap();
        // Set the state at time t to second order in t. The table rotates uniformly about its own
        // axes.
        let set = |frames: &mut Frames, t: f64| {
            let (mut qt, nv) = (q.clone(), mbs.nv());
            let dq: Vec<f64> = (0..nv).map(|i| v[i] * t + 0.5 * vdot[i] * t * t).collect();
            mbs.integrate(&q, &dq, &mut qt);
            let vt: Vec<f64> = (0..nv).map(|i| v[i] + vdot[i] * t).collect();
            frames.set_q(m, &qt).unwrap();
            frames.set_v(m, &vt).unwrap();
            frames.set_vdot(m, &vdot).unwrap();
            let R = X0.rotation * Quat::from_scaled_axis(w * t);
            let X = Pose::new(R, X0.position + u * t);
            frames.set_moving(table, X, Motion::new(R * w, u), Motion::zero()).unwrap();
        };
        // q(t) above is accurate only to first order for free subhinges, because β is constant in rotating axes.
        // Therefore velocity is compared with differences of poses as t → 0, and acceleration with differences of
        // velocities.
        let h = 1e-5;
        set(&mut frames, h);
        let (X1, V1) = (frames.pose(pair), frames.velocity(pair));
        set(&mut frames, -h);
        let (X2, V2) = (frames.pose(pair), frames.velocity(pair));
        set(&mut frames, 0.0);
        let (V, A, X) = (frames.velocity(pair), frames.acceleration(pair), frames.pose(pair));
        let p_dot = (X1.position - X2.position) / (2.0 * h);
        let turned = (X1.rotation * X2.rotation.inverse()).scaled_axis() / (2.0 * h);
        let what = format!("seed {seed}");
        near_motion(&V, &Motion::new(turned, p_dot), 1e-8, &what);
        let a = (V1 - V2) * (0.5 / h);
        near_motion(&A, &a, 1e-8, &what);
        worst.0 = worst.0.max((V.linear - p_dot).norm());
        worst.1 = worst.1.max((A.linear - a.linear).norm());
        // In the world's axes, all quantities are the same but rotated.
        let R = frames.pose(turn).rotation;
        near(&frames.position(other), &(R * X.position), 1e-14, &what);
        near_motion(&frames.velocity(other), &V.rotate(&R), 1e-14, &what);
        near_motion(&frames.acceleration(other), &A.rotate(&R), 1e-14, &what);
    }
    println!("differences: velocity within {:e}, acceleration within {:e}", worst.0, worst.1);
}

#[test]
fn frames_seen_both_ways_and_through_a_third_agree() {
    for seed in 0..25 {
        let mbs = tree(seed);
        let mut frames = Frames::new();
        let world = frames.world();
        let m = frames.add_mechanism("m", &mbs, world).unwrap();
        frames.set_q(m, &mbs.random_q(seed)).unwrap();
        frames.set_v(m, &mbs.random_v(seed)).unwrap();
        frames.set_vdot(m, &mbs.random_v(seed + 3)).unwrap();
        let ids = ["n00", "n04", "n08"].map(|n| frames.node_named(m, n).unwrap());
        let mut see = |i: usize, j: usize| {
            let pair = frames.pair(ids[i], ids[j]).unwrap();
            (frames.pose(pair), frames.velocity(pair), frames.acceleration(pair))
        };
        let ((X, V, A), (Y, W, B), (Z, U, C)) = (see(0, 1), see(1, 2), see(0, 2));
        near_pose(&Z, &(X * Y), 1e-12, "X_AC = X_AB X_BC");
        let R = &X.rotation;
        let (r, w) = (R * Y.position, V.angular);
        let chained = Motion::new(w + R * W.angular, V.linear + w.cross(&r) + R * W.linear);
        near_motion(&U, &chained, 1e-12, "velocities add");
        let chained = Motion::new(
            A.angular + R * B.angular + w.cross(&(R * W.angular)),
            A.linear
                + A.angular.cross(&r)
                + w.cross(&w.cross(&r))
                + w.cross(&(R * W.linear)) * 2.0
                + R * B.linear,
        );
        near_motion(&C, &chained, 1e-11, "accelerations add");
        let (X, V, _) = see(0, 1);
        let (back, V_back, _) = see(1, 0);
        near_pose(&(X * back), &Pose::identity(), 1e-12, "back and forth");
        let there = V.angular + X.rotation * V_back.angular;
        near(&there, &Vec3::zeros(), 1e-13, "ω back and forth");
        let same = see(2, 2);
        assert_eq!((same.0, same.1, same.2), (Pose::identity(), Motion::zero(), Motion::zero()));
    }
}

#[test]
fn a_point_at_rest_circles_for_an_observer_on_a_turntable() {
    // In a table rotating at w about z: v = −w z × p, a = w² (−p). The Coriolis term −2 w z × v outweighs the centrifugal one.
    let mut frames = Frames::new();
    let world = frames.world();
    let table = frames.add_moving("table", world, Pose::identity()).unwrap();
    let post = frames.add_fixed("post", world, Pose::translation(2.0, 0.0, 0.5)).unwrap();
    let pair = frames.pair(table, post).unwrap();
    let (w, angle) = (0.7, 0.3_f64);
    let turn = Quat::from_scaled_axis(Vec3::z() * angle);
    let spin = Motion::new(Vec3::z() * w, Vec3::zeros());
    frames.set_moving(table, Pose::rotation(turn), spin, Motion::zero()).unwrap();
    let p = Vec3::new(2.0 * angle.cos(), -2.0 * angle.sin(), 0.5);
    near(&frames.pose(pair).position, &p, 1e-15, "p");
    let V = frames.velocity(pair);
    near(&V.linear, &(-Vec3::z().cross(&p) * w), 1e-15, "v");
    near(&V.angular, &(-Vec3::z() * w), 1e-15, "ω");
    let inward = Vec3::new(-p.x, -p.y, 0.0) * (w * w);
    near(&frames.acceleration(pair).linear, &inward, 1e-15, "a");
    // A puck that slides outward along the table's x at speed s has, in the world, the acceleration 2 w s sideways and w² r inward.
    let (s, r) = (0.4, 1.3);
    let puck = frames.add_moving("puck", table, Pose::identity()).unwrap();
    let slide = Motion::new(Vec3::zeros(), Vec3::x() * s);
    frames.set_moving(puck, Pose::translation(r, 0.0, 0.0), slide, Motion::zero()).unwrap();
    let seen = frames.pair_in(world, puck, table).unwrap();
    let want = Vec3::new(-w * w * r, 2.0 * w * s, 0.0);
    near(&frames.acceleration(seen).linear, &want, 1e-15, "Coriolis and centripetal");
    near(&frames.velocity(seen).linear, &Vec3::new(s, w * r, 0.0), 1e-15, "velocity, table's axes");
}

/// Sun, planet (rotating and moving), site, and a mechanism on the site.
fn planet(seed: u64, mbs: &Multibody, distance: f64) -> (Frames, MechanismId) {
    let mut frames = Frames::new();
    let mut r = Rng(seed);
    let world = frames.world();
    let planet = frames.add_moving("planet", world, Pose::identity()).unwrap();
    let X = Pose::new(r.quat(), r.vec3().normalize() * distance);
    let V = Motion::new(r.vec3() * 7e-5, r.vec3() * (distance * 2e-7));
    frames.set_moving(planet, X, V, Motion::new(r.vec3() * 1e-9, r.vec3() * 6e-3)).unwrap();
    let site = frames.add_fixed("site", planet, Pose::new(r.quat(), r.vec3() * 3.4e6)).unwrap();
    let m = frames.add_mechanism("rover", mbs, site).unwrap();
    frames.set_q(m, &mbs.random_q(seed)).unwrap();
    frames.set_v(m, &mbs.random_v(seed)).unwrap();
    frames.set_vdot(m, &mbs.random_v(seed + 1)).unwrap();
    (frames, m)
}

#[test]
fn frames_of_one_rover_keep_their_digits_at_any_distance() {
    for seed in [2, 4, 6, 8] {
        let mbs = tree(seed);
        let answer = |distance: f64| {
            let (mut frames, m) = planet(seed, &mbs, distance);
            let camera = frames.node_named(m, "n03").unwrap();
            let wheel = frames.node_named(m, "n08").unwrap();
            let lens = frames.add_fixed("lens", camera, Rng(5).pose()).unwrap();
            let pair = frames.pair_in(lens, wheel, camera).unwrap();
            let p = frames.position(pair);
            (p, frames.velocity(pair), frames.acceleration(pair))
        };
        // Bit-identical, not only approximately equal.
        assert_eq!(answer(0.0), answer(1.5e11), "seed {seed}");
        // The result is also bit-identical in the frame of the site.
        let (mut frames, m) = planet(seed, &mbs, 1.5e11);
        let (site, wheel) = (frames.named("site").unwrap(), frames.node_named(m, "n08").unwrap());
        let kernel = Tree::new(&mbs);
        let mut ws = Workspace::new(&kernel);
        kinematics(&kernel, &mut ws, &mbs.random_q(seed), &mbs.random_v(seed));
        let pair = frames.pair(site, wheel).unwrap();
        let node = mbs.node("n08").unwrap();
        near_pose(&frames.pose(pair), &ws.node_pose(&kernel, node), 1e-13, "site");
        near_motion(&frames.velocity(pair), &ws.node_velocity(&kernel, node), 1e-13, "site");
    }
}

#[test]
fn only_what_is_asked_and_out_of_date_is_computed() {
    let mbs = tree(6);
    let mut frames = Frames::new();
    let world = frames.world();
    let m = frames.add_mechanism("m", &mbs, world).unwrap();
    let ids = |frames: &Frames, n: &str| frames.node_named(m, n).unwrap();
    let (a, b) = (ids(&frames, "n05"), ids(&frames, "n08"));
    // Count the subhinges on the path between the two bodies from the mechanism itself.
    let (body_a, body_b) = (mbs.body("b05").unwrap(), mbs.body("b08").unwrap());
    let on_path = |b: multibody::BodyId| mbs.on_path(b, body_a) != mbs.on_path(b, body_b);
    let moving = |b: multibody::BodyId| mbs.get(b).subhinges().iter().filter(|s| !s.v.is_empty());
    let path = mbs.body_ids().filter(|b| on_path(*b)).map(|b| moving(b).count()).sum::<usize>();
    let all = mbs.body_ids().map(|b| moving(b).count()).sum::<usize>();
    assert!(0 < path && path < all, "the path is a part: {path} of {all}");
    let path = path as u64;

    let pair = frames.pair(a, b).unwrap();
    let counted = |frames: &Frames| (frames.counts().edges, frames.counts().pairs);
    frames.set_q(m, &mbs.random_q(1)).unwrap();
    frames.set_v(m, &mbs.random_v(1)).unwrap();
    frames.set_vdot(m, &mbs.random_v(2)).unwrap();
    assert_eq!(counted(&frames), ([0; 3], [0; 3]), "setting only marks");
    // A query computes only the path between the frames, and the derivatives that it needs.
    frames.pose(pair);
    assert_eq!(counted(&frames), ([path, 0, 0], [1, 0, 0]));
    frames.velocity(pair);
    assert_eq!(counted(&frames), ([path, path, 0], [1, 1, 0]));
    frames.acceleration(pair);
    assert_eq!(counted(&frames), ([path; 3], [1; 3]));
    // Repeating it in any order, or setting the same numbers, computes nothing.
    frames.set_q(m, &mbs.random_q(1)).unwrap();
    frames.set_v(m, &mbs.random_v(1)).unwrap();
    for _ in 0..3 {
        frames.acceleration(pair);
        frames.pose(pair);
        frames.velocity(pair);
    }
    assert_eq!(counted(&frames), ([path; 3], [1; 3]), "a repeated question");
    // Configuration terms are not recomputed for other rates.
    frames.set_v(m, &mbs.random_v(5)).unwrap();
    frames.velocity(pair);
    assert_eq!(counted(&frames), ([path, 2 * path, path], [1, 2, 1]));
    frames.set_vdot(m, &mbs.random_v(6)).unwrap();
    frames.acceleration(pair);
    assert_eq!(counted(&frames), ([path, 2 * path, 2 * path], [1, 2, 2]));
    // A change outside the path computes nothing for this pair.
    let mut q = mbs.random_q(1);
    let mut nudge = |wanted: bool| {
        let found = mbs.subhinges().find(|(b, s)| on_path(*b) == wanted && !s.v.is_empty());
        let (s, mut dv) = (found.unwrap().1, vec![0.0; mbs.nv()]);
        dv[s.v.start] = 0.1;
        let mut moved = q.clone();
        mbs.integrate(&q, &dv, &mut moved);
        q[s.q.clone()].copy_from_slice(&moved[s.q.clone()]);
        q.clone()
    };
    frames.set_q(m, &nudge(false)).unwrap();
    frames.acceleration(pair);
    assert_eq!(counted(&frames), ([path, 2 * path, 2 * path], [1, 2, 2]));
    // A change of one hinge on the path computes that hinge, and the product along the path.
    frames.set_q(m, &nudge(true)).unwrap();
    frames.pose(pair);
    assert_eq!(counted(&frames), ([path + 1, 2 * path, 2 * path], [2, 2, 2]));
    // A second pair over hinges that are up to date does not compute any hinge.
    let before = frames.counts().edges;
    let (c, d) = (ids(&frames, "n05"), frames.body(m, body_b).unwrap());
    let second = frames.pair(c, d).unwrap();
    frames.pose(second);
    assert_eq!(frames.counts().edges, before);
}

#[test]
fn nothing_is_allocated_after_set_up() {
    let mbs = tree(4);
    let (mut frames, m) = planet(4, &mbs, 1.5e11);
    let camera = frames.node_named(m, "n03").unwrap();
    let (world, planet) = (frames.world(), frames.named("planet").unwrap());
    let pairs = [frames.pair(world, camera), frames.pair_in(camera, planet, world)];
    let states: Vec<_> = (0..4).map(|i| (mbs.random_q(i), mbs.random_v(i))).collect();
    let counted = allocation_counter::measure(|| {
        for (q, v) in &states {
            frames.set_q(m, q).unwrap();
            frames.set_v(m, v).unwrap();
            frames.set_vdot(m, v).unwrap();
            let V = Motion::new(Vec3::x() * v[0], Vec3::y());
            frames.set_moving(planet, Pose::identity(), V, V).unwrap();
            for pair in pairs.iter().flatten() {
                std::hint::black_box((frames.position(*pair), frames.acceleration(*pair)));
            }
        }
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn frames_can_be_fixed_elsewhere_but_not_on_themselves() {
    let mbs = tree(3);
    let mut r = Rng(1);
    let mut frames = Frames::new();
    let world = frames.world();
    let m = frames.add_mechanism("m", &mbs, world).unwrap();
    frames.set_q(m, &mbs.random_q(1)).unwrap();
    let hand = frames.node_named(m, "n06").unwrap();
    let mast = frames.add_fixed("mast", hand, r.pose()).unwrap();
    let head = frames.add_fixed("head", mast, r.pose()).unwrap();
    let pair = frames.pair(hand, head).unwrap();
    let (on_hand, X) = (frames.pose(pair), r.pose());
    frames.fix(mast, world, X).unwrap();
    let to_hand = frames.pair(world, hand).unwrap();
    let head_in_mast = frames.pair(mast, head).unwrap();
    let want = frames.pose(to_hand).inverse() * X * frames.pose(head_in_mast);
    let now = frames.pose(pair);
    near_pose(&now, &want, 1e-14, "after fixing elsewhere");
    assert!((now.position - on_hand.position).norm() > 1e-3, "it did move");

    let error = frames.fix(mast, head, X).unwrap_err();
    assert_eq!(error, FramesError::Cycle { frame: "mast".into(), on: "frame `head`".into() });
    assert!(matches!(frames.fix(mast, mast, X), Err(FramesError::Cycle { .. })));
    assert!(matches!(frames.fix(hand, world, X), Err(FramesError::Kind { .. })));
    near_pose(&frames.pose(pair), &want, 1e-14, "refused edits change nothing");
}

#[test]
fn mistakes_are_refused_and_change_nothing() {
    let mbs = tree(3);
    let mut frames = Frames::new();
    let world = frames.world();
    let m = frames.add_mechanism("m", &mbs, world).unwrap();
    let mast = frames.add_fixed("mast", world, Pose::identity()).unwrap();
    let table = frames.add_moving("table", mast, Pose::identity()).unwrap();
    let pair = frames.pair(world, table).unwrap();
    let text = |e: FramesError| e.to_string();

    let error = text(frames.named("mats").unwrap_err());
    assert!(error.starts_with("no frame `mats`") && error.contains("mast"), "{error}");
    assert!(text(frames.node_named(m, "x").unwrap_err()).contains("no node `x`"));
    assert!(text(frames.body_named(m, "x").unwrap_err()).contains("no body `x`"));
    let mut bigger = Frames::new();
    let mut last = bigger.add_fixed("a", world, Pose::identity()).unwrap();
    let m2 = {
        for i in 0..100 {
            last = bigger.add_fixed(&format!("f{i}"), last, Pose::identity()).unwrap();
        }
        bigger.add_mechanism("one", &mbs, last).unwrap();
        bigger.add_mechanism("two", &mbs, last).unwrap()
    };
    assert!(matches!(frames.pair(world, last), Err(FramesError::Unknown { .. })));
    assert!(matches!(frames.set_q(m2, &[]), Err(FramesError::Unknown { .. })));
    assert!(matches!(
        frames.add_fixed("mast", world, Pose::identity()),
        Err(FramesError::Duplicate { .. })
    ));
    assert!(matches!(frames.add_mechanism("m", &mbs, world), Err(FramesError::Duplicate { .. })));

    let nan = Pose::translation(f64::NAN, 0.0, 0.0);
    let zero = Motion::zero();
    assert!(matches!(frames.add_fixed("b", world, nan), Err(FramesError::NotFinite { .. })));
    assert!(matches!(frames.fix(mast, world, nan), Err(FramesError::NotFinite { .. })));
    let error = frames.set_moving(table, nan, zero, zero).unwrap_err();
    assert!(text(error).starts_with("frame `table`: a number is NaN"));
    let bad = Motion::new(Vec3::zeros(), Vec3::new(0.0, f64::INFINITY, 0.0));
    let identity = Pose::identity();
    assert!(matches!(
        frames.set_moving(table, identity, bad, zero),
        Err(FramesError::NotFinite { .. })
    ));
    assert!(matches!(frames.set_moving(mast, identity, zero, zero), Err(FramesError::Kind { .. })));
    let mut q = mbs.random_q(1);
    q[2] = f64::NAN;
    assert!(text(frames.set_q(m, &q).unwrap_err()).contains("mechanism `m`, q[2]"));
    let short = frames.set_v(m, &[1.0]).unwrap_err();
    assert!(matches!(short, FramesError::Length { what: "v", got: 1, .. }));
    assert_eq!(frames.pose(pair), Pose::identity());
    assert_eq!(frames.counts().edges, [0; 3]);
}
