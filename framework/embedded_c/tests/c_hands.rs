//! Two hands on one object, masses and predictions through the C interface: results bit-identical with Rust, no allocation, errors as codes.

use crate::support::*;
use linkwork_embedded::spatial::{Force, Motion, Pose, Vec3};
use linkwork_embedded::*;
use linkwork_robot::*;
use std::ptr::{null, null_mut};

fn wrenches() -> [Force; 2] {
    let vec = |x: [f64; 3]| Vec3::from(x);
    [
        Force::new(vec([0.5, -0.2, 0.3]), vec([3.0, -40.0, 12.0])),
        Force::new(vec([-0.1, 0.4, 0.2]), vec([-2.0, 35.0, 6.0])),
    ]
}

#[test]
fn loads_shared_squeezed_and_gripped() {
    let mut two = Two::new();
    // SAFETY: valid handles of the library, arrays of the lengths given; the same applies in all tests below.
    unsafe {
        let r = two.r;
        let mut hold = std::mem::zeroed::<LwHold>();
        quiet(|| lw_robot_hold(r, BEAM, &mut hold));
        assert_eq!(hold.count, 0);
        let mut tau = [1.0; 13];
        let t = tau.as_mut_ptr();
        let mut shared = std::mem::zeroed::<LwShared>();
        let early = lw_robot_balance(r, BEAM, LW_BALANCE_EQUAL, t, 13, &mut shared);
        two.refused(early, LwStatus::NotHeld, "object 0");
        two.take_beam();
        quiet(|| lw_robot_hold(r, BEAM, &mut hold));
        let rust = two.robot.hold(two.beam).unwrap().unwrap();
        assert_eq!((hold.count, hold.hands), (2, [LEFT, RIGHT]));
        same_pose(&hold.at[0], &rust.hand.1);
        same_pose(&hold.at[1], &rust.second.unwrap().1);

        let mut wanted = [0.0; 13];
        for (code, balance) in
            [(LW_BALANCE_EQUAL, Balance::Equal), (LW_BALANCE_EFFORT, Balance::Effort)]
        {
            two.robot.feed_forward(&V, &VDOT, &[], &mut wanted).unwrap();
            tau = wanted;
            quiet(|| lw_robot_balance(r, BEAM, code, t, 13, &mut shared));
            let rust = two.robot.balance(two.beam, balance, &mut wanted).unwrap();
            same(&tau, &wanted);
            same_wrench(&shared.second, &rust.second);
            same(&[shared.cost, shared.largest_share], &[rust.cost, rust.largest_share]);
        }
        let mut pressed = [LwWrench { moment: [9.0; 3], force: [9.0; 3] }; 2];
        quiet(|| lw_robot_squeeze(r, BEAM, 25.0, t, 13, pressed.as_mut_ptr()));
        let rust = two.robot.squeeze(two.beam, 25.0, &mut wanted).unwrap();
        same(&tau, &wanted);
        same_wrenches(&pressed, &rust);
        let given = wrenches();
        let in_c = given.map(LwWrench::from);
        let w = in_c.as_ptr();
        quiet(|| lw_robot_add_hand_wrenches(r, BEAM, w, t, 13));
        two.robot.add_hand_wrenches(two.beam, &given, &mut wanted).unwrap();
        same(&tau, &wanted);
        let mut apart = std::mem::zeroed::<LwHandWrenches>();
        let weights = [1.0, 3.0, 50.0];
        quiet(|| lw_robot_split_hand_wrenches(r, BEAM, w, weights.as_ptr(), &mut apart));
        let own = HandWeights { hands: [1.0, 3.0], moment: 50.0 };
        let rust = two.robot.split_hand_wrenches(two.beam, &given, &own).unwrap();
        same_wrenches(&apart.moving, &rust.moving);
        same_wrenches(&apart.squeezing, &rust.squeezing);
        same_wrench(&apart.net, &rust.net);
        let friction = [[0.1, -1.0, 0.0], [0.0, 2.0, 0.3]].map(|normal| LwFriction {
            normal,
            coefficient: 0.6,
            radius: 0.03,
            most: f64::INFINITY,
        });
        let own = friction.map(|f| Friction {
            normal: f.normal.into(),
            coefficient: f.coefficient,
            radius: f.radius,
            most: f.most,
        });
        let mut gripped = std::mem::zeroed::<LwGripped>();
        let f = friction.as_ptr();
        quiet(|| lw_robot_grip(r, BEAM, w, f, &mut gripped));
        let rust = two.robot.grip(two.beam, &given, &own).unwrap();
        same_wrenches(&gripped.wrenches, &rust.wrenches);
        assert_eq!(gripped.shortfall.to_bits(), rust.shortfall.to_bits());
        assert_ne!(rust.wrenches, given, "these slip");

        let kept = tau;
        let (x, g) = (weights.as_ptr(), &raw mut gripped);
        let bad = lw_robot_balance(r, BEAM, 2, t, 13, &mut shared);
        two.refused(bad, LwStatus::OutOfRange, "LW_BALANCE_");
        let bad = lw_robot_balance(r, BEAM, 0, t, 12, &mut shared);
        two.refused(bad, LwStatus::Length, "`tau`");
        let out = pressed.as_mut_ptr();
        let squeeze = |force, t, n| lw_robot_squeeze(r, BEAM, force, t, n, out);
        two.refused(squeeze(f64::NAN, t, 13), LwStatus::NotFinite, "`force`");
        two.refused(squeeze(1.0, t, 14), LwStatus::Length, "`tau`");
        let odd = t.cast::<u8>().add(2).cast::<f64>();
        two.refused(squeeze(1.0, odd, 13), LwStatus::Misaligned, "`tau`");
        let lost = [LwWrench { moment: [f64::NAN; 3], ..in_c[0] }; 2];
        let bad = lw_robot_add_hand_wrenches(r, BEAM, lost.as_ptr(), t, 13);
        two.refused(bad, LwStatus::NotFinite, "`moment`");
        let zero = [1.0, 0.0, 1.0];
        let bad = lw_robot_split_hand_wrenches(r, BEAM, w, zero.as_ptr(), &mut apart);
        two.refused(bad, LwStatus::OutOfRange, "weight");
        let smooth = [LwFriction { coefficient: 0.0, ..friction[0] }; 2];
        let bad = lw_robot_grip(r, BEAM, w, smooth.as_ptr(), g);
        two.refused(bad, LwStatus::OutOfRange, "friction");
        two.refused(lw_robot_hold(r, 9, &mut hold), LwStatus::Foreign, "");
        all_null(&[
            lw_robot_hold(r, BEAM, null_mut()),
            lw_robot_hold(null_mut(), BEAM, &mut hold),
            lw_robot_balance(r, BEAM, 0, null_mut(), 13, &mut shared),
            lw_robot_balance(r, BEAM, 0, t, 13, null_mut()),
            lw_robot_balance(null_mut(), BEAM, 0, t, 13, &mut shared),
            lw_robot_squeeze(r, BEAM, 1.0, null_mut(), 13, out),
            lw_robot_squeeze(r, BEAM, 1.0, t, 13, null_mut()),
            lw_robot_add_hand_wrenches(r, BEAM, null(), t, 13),
            lw_robot_add_hand_wrenches(r, BEAM, w, null_mut(), 13),
            lw_robot_split_hand_wrenches(r, BEAM, null(), x, &mut apart),
            lw_robot_split_hand_wrenches(r, BEAM, w, null(), &mut apart),
            lw_robot_split_hand_wrenches(r, BEAM, w, x, null_mut()),
            lw_robot_grip(r, BEAM, null(), f, g),
            lw_robot_grip(r, BEAM, w, null(), g),
            lw_robot_grip(r, BEAM, w, f, null_mut()),
        ]);
        assert_eq!(tau, kept, "nothing was written");
        // A single hand cannot share a load.
        assert_eq!(lw_robot_release(r, RIGHT, BEAM), LwStatus::Ok);
        quiet(|| lw_robot_hold(r, BEAM, &mut hold));
        assert_eq!((hold.count, hold.hands), (1, [LEFT, 0]));
        two.refused(squeeze(1.0, t, 13), LwStatus::EmptyHand, "part 0");
    }
}

#[test]
fn momentum_and_composite_inertias() {
    let mut two = Two::new();
    two.take_beam();
    // SAFETY: as above.
    unsafe {
        let r = two.r;
        let mut told = std::mem::zeroed::<LwInertia>();
        let mut torso = 9;
        assert_eq!(lw_model_body(two.m, c"torso".as_ptr(), &mut torso), LwStatus::Ok);
        quiet(|| lw_robot_composite_inertia(r, torso, &mut told));
        let body = two.model.multibody().body("torso").unwrap();
        let rust = two.robot.composite_inertia(body);
        same(&[told.mass], &[rust.mass()]);
        same(&told.center, rust.com().as_slice());
        same(&told.inertia, rust.inertia().transpose().as_slice());
        let (mut p, mut A, mut theirs) = ([9.0; 6], [0.0; 78], [0.0; 78]);
        quiet(|| lw_robot_momentum(r, V.as_ptr(), 13, p.as_mut_ptr()));
        let rust = two.robot.momentum(&V).unwrap();
        same(&p, &[rust.moment.as_slice(), rust.force.as_slice()].concat());
        quiet(|| lw_robot_centroidal_matrix(r, A.as_mut_ptr(), 78));
        two.robot.centroidal_matrix(&mut theirs).unwrap();
        same(&A, &theirs);
        // The last rows divided by the mass are the Jacobian of the centre of mass; check them by finite
        // differences.
        let (mut mass, mut centers) = (0.0, [[0.0; 3]; 2]);
        let h = 1e-6;
        for (side, at) in [h, -h].into_iter().zip(&mut centers) {
            two.go(&std::array::from_fn::<_, 13, _>(|k| Q[k] + side * V[k]));
            let told = lw_robot_center_of_mass(r, &mut mass, at.as_mut_ptr());
            assert_eq!(told, LwStatus::Ok);
        }
        for k in 0..3 {
            let moved: f64 = (0..13).map(|j| A[13 * (3 + k) + j] * V[j]).sum::<f64>() / mass;
            assert!((moved - (centers[0][k] - centers[1][k]) / (2.0 * h)).abs() < 1e-9);
        }
        two.go(&Q);

        let (mut tau, mut wanted, mut tips) = ([0.0; 13], [0.0; 13], [0.0; 12]);
        let (t, x, both) = (tau.as_mut_ptr(), tips.as_mut_ptr(), [RIGHT, LEFT]);
        quiet(|| lw_robot_bias(r, V.as_ptr(), 13, both.as_ptr(), 2, t, x));
        let mut moved = [Motion::zero(); 2];
        two.robot.bias(&V, &[two.right, two.left], &mut wanted, &mut moved).unwrap();
        same(&tau, &wanted);
        let all = moved.map(|m| [m.angular.as_slice(), m.linear.as_slice()].concat()).concat();
        same(&tips, &all);
        quiet(|| lw_robot_bias(r, V.as_ptr(), 13, null(), 0, t, null_mut()));
        same(&tau, &wanted);

        let (v, m, o) = (V.as_ptr(), p.as_mut_ptr(), both.as_ptr());
        let kept = (tau, tips, p);
        two.refused(lw_robot_composite_inertia(r, 99, &mut told), LwStatus::Foreign, "");
        two.refused(lw_robot_momentum(r, v, 12, m), LwStatus::Length, "`v`");
        let nan = [f64::NAN; 13];
        two.refused(lw_robot_momentum(r, nan.as_ptr(), 13, m), LwStatus::NotFinite, "`v`");
        let a = A.as_mut_ptr();
        two.refused(lw_robot_centroidal_matrix(r, a, 77), LwStatus::Length, "`A`");
        two.refused(lw_robot_bias(r, v, 13, o, 3, t, x), LwStatus::NoRoom, "3 parts");
        two.refused(lw_robot_bias(r, v, 13, [9].as_ptr(), 1, t, x), LwStatus::Foreign, "");
        two.refused(
            lw_robot_bias(r, v, 13, o, 2, t, t.add(6)),
            LwStatus::Overlap,
            "`tau` and `tips`",
        );
        two.refused(lw_robot_bias(r, t, 13, o, 2, t, x), LwStatus::Overlap, "`v` and `tau`");
        all_null(&[
            lw_robot_composite_inertia(r, 0, null_mut()),
            lw_robot_composite_inertia(null_mut(), 0, &mut told),
            lw_robot_momentum(r, null(), 13, m),
            lw_robot_momentum(r, v, 13, null_mut()),
            lw_robot_centroidal_matrix(r, null_mut(), 78),
            lw_robot_centroidal_matrix(null_mut(), a, 78),
            lw_robot_bias(r, null(), 13, o, 2, t, x),
            lw_robot_bias(r, v, 13, null(), 2, t, x),
            lw_robot_bias(r, v, 13, o, 2, null_mut(), x),
            lw_robot_bias(r, v, 13, o, 2, t, null_mut()),
        ]);
        assert_eq!((tau, tips, p), kept, "nothing was written");
    }
}

#[test]
fn predictions_with_covariance() {
    let mut two = Two::new();
    two.robot.grasp(two.left, two.beam, Grasp::At(Pose::translation(0.1, 0.0, 0.0))).unwrap();
    let in_hand = LwPose { position: [0.1, 0.0, 0.0], quaternion: [0.0, 0.0, 0.0, 1.0] };
    let mut memory = Predictor::new(&two.robot);
    let (tau, density) = ([0.5; 13], [0.01; 13]);
    // SAFETY: as above.
    unsafe {
        let r = two.r;
        assert_eq!(lw_robot_grasp(r, LEFT, BEAM, &in_hand), LwStatus::Ok);
        let (mut p, mut none) = (null_mut(), null_mut());
        assert_eq!(lw_predictor_new(r, &mut p), LwStatus::Ok);
        let mut P: Vec<f64> = vec![0.0; 676];
        (0..26).for_each(|k| P[27 * k] = 1e-4 * (1.0 + k as f64));
        let (mut q, mut v) = (Q, V);
        let (mut theirs, mut rates, mut spread) = (Q, V, P.clone());
        let (a, b, c) = (q.as_mut_ptr(), v.as_mut_ptr(), P.as_mut_ptr());
        let (t, d) = (tau.as_ptr(), density.as_ptr());
        for _ in 0..3 {
            quiet(|| lw_predictor_step(r, p, a, 13, b, 13, c, t, d, 0.01));
            let state = StateEstimate { q: &mut theirs, v: &mut rates, covariance: &mut spread };
            two.robot.predict(&mut memory, state, &tau, &density, 0.01).unwrap();
        }
        same(&q, &theirs);
        same(&v, &rates);
        same(&P, &spread);
        let mut F = vec![0.0; 676];
        let f = F.as_mut_ptr();
        quiet(|| lw_predictor_transition(r, p, f, 676));
        same(&F, memory.transition());
        let kept = (q, v, P.clone());
        let ask = |nq, nv, t, d: &[f64], step| {
            lw_predictor_step(r, p, a, nq, b, nv, c, t, d.as_ptr(), step)
        };
        two.refused(ask(12, 13, t, &density, 0.01), LwStatus::Length, "`q`");
        two.refused(ask(13, 12, t, &density, 0.01), LwStatus::Length, "`v`");
        two.refused(ask(13, usize::MAX, t, &density, 0.01), LwStatus::Overlap, "");
        two.refused(ask(13, 13, t, &[-1.0; 13], 0.01), LwStatus::OutOfRange, "density");
        two.refused(ask(13, 13, t, &[f64::NAN; 13], 0.01), LwStatus::NotFinite, "density");
        two.refused(ask(13, 13, t, &density, -0.01), LwStatus::OutOfRange, "step");
        two.refused(ask(13, 13, b, &density, 0.01), LwStatus::Overlap, "`tau` and `v`");
        let over = lw_predictor_step(r, p, a, 13, a, 13, c, t, d, 0.01);
        two.refused(over, LwStatus::Overlap, "`q` and `v`");
        two.refused(lw_predictor_transition(r, p, f, 675), LwStatus::Length, "`F`");
        let n = null_mut();
        all_null(&[
            lw_predictor_new(r, null_mut()),
            lw_predictor_new(null_mut(), &mut none),
            lw_predictor_step(r, null_mut(), a, 13, b, 13, c, t, d, 0.01),
            lw_predictor_step(r, p, n, 13, b, 13, c, t, d, 0.01),
            lw_predictor_step(r, p, a, 13, n, 13, c, t, d, 0.01),
            lw_predictor_step(r, p, a, 13, b, 13, n, t, d, 0.01),
            lw_predictor_step(r, p, a, 13, b, 13, c, null(), d, 0.01),
            lw_predictor_step(r, p, a, 13, b, 13, c, t, null(), 0.01),
            lw_predictor_transition(r, null_mut(), f, 676),
            lw_predictor_transition(r, p, n, 676),
        ]);
        assert_eq!((q, v, P), kept, "nothing was written");
        lw_predictor_free(p);
        lw_predictor_free(null_mut());
    }
}

#[test]
fn bodies_of_objects_and_their_mass_matrix() {
    let mut two = Two::new();
    two.robot.grasp(two.right, two.pliers, Grasp::At(Pose::translation(0.0, 0.1, 0.0))).unwrap();
    two.robot.set_object_q(two.pliers, &[0.4]).unwrap();
    let in_hand = LwPose { position: [0.0, 0.1, 0.0], quaternion: [0.0, 0.0, 0.0, 1.0] };
    let jaw = two.model.object_body(two.pliers, "jaw").unwrap();
    // SAFETY: as above.
    unsafe {
        let (r, m) = (two.r, two.m);
        let (mut nq, mut nv, mut body, mut at) = (9, 9, 9, in_hand);
        assert_eq!(lw_model_object_sizes(m, PLIERS, &mut nq, &mut nv), LwStatus::Ok);
        assert_eq!((nq, nv), (1, 1));
        assert_eq!(lw_model_object_sizes(m, BEAM, &mut nq, &mut nv), LwStatus::Ok);
        assert_eq!((nq, nv), (0, 0));
        let mut M = vec![0.0; 196];
        let p = M.as_mut_ptr();
        two.refused(
            lw_robot_mass_matrix_with_object(r, PLIERS, p, 196),
            LwStatus::NotHeld,
            "object 1",
        );
        assert_eq!(lw_robot_grasp(r, RIGHT, PLIERS, &in_hand), LwStatus::Ok);
        assert_eq!(lw_robot_set_object_q(r, PLIERS, &0.4, 1), LwStatus::Ok);
        assert_eq!(lw_model_object_body(m, PLIERS, c"jaw".as_ptr(), &mut body), LwStatus::Ok);
        quiet(|| lw_robot_object_body_pose(r, PLIERS, body, &mut at));
        same_pose(&at, &two.robot.object_body_pose(two.pliers, jaw).unwrap());
        let (mut J, mut rust) = ([0.0; 6], [0.0; 6]);
        let j = J.as_mut_ptr();
        quiet(|| lw_robot_object_jacobian(r, PLIERS, body, j, 6));
        two.robot.object_jacobian(two.pliers, jaw, &mut rust).unwrap();
        same(&J, &rust);
        let mut left = LwClosure { rows: 0, rank: 0, mobility: 0 };
        let jaw_in_c = body;
        let onto = |hand, free: &[u8], out| {
            lw_robot_closure_onto(r, hand, PLIERS, jaw_in_c, free.as_ptr(), free.len(), out)
        };
        let hand = two.model.part("left").unwrap();
        for free in [0, 1] {
            quiet(|| onto(LEFT, &[free], &raw mut left));
            let (object, free) = (two.pliers, [free > 0]);
            let asked = Closing::Onto { hand, object, body: jaw, free: &free };
            assert_eq!(left, two.robot.closure(asked).unwrap().into());
        }
        assert!(left.rank > 0 && left.rows == 6);
        two.refused(onto(RIGHT, &[1], &mut left), LwStatus::Held, "object 1");
        two.refused(onto(LEFT, &[], &mut left), LwStatus::Length, "`free`");
        two.refused(onto(9, &[1], &mut left), LwStatus::Foreign, "");
        two.refused(lw_robot_closure(r, BEAM, &mut left), LwStatus::NotHeld, "object 0");
        two.refused(lw_robot_closure(r, PLIERS, &mut left), LwStatus::EmptyHand, "part");
        two.refused(lw_robot_object_jacobian(r, PLIERS, body, j, 5), LwStatus::Length, "`J`");
        two.refused(lw_robot_object_jacobian(r, BEAM, body, j, 6), LwStatus::Foreign, "");
        quiet(|| lw_robot_mass_matrix_with_object(r, PLIERS, p, 196));
        let mut theirs = vec![0.0; 196];
        two.robot.mass_matrix_with_object(two.pliers, &mut theirs).unwrap();
        same(&M, &theirs);
        assert!(M[195] > 0.0 && M[13] != 0.0, "the jaw counts");
        two.refused(lw_robot_mass_matrix_with_object(r, PLIERS, p, 169), LwStatus::Length, "`M`");
        two.refused(
            lw_robot_mass_matrix_with_object(r, BEAM, p, 169),
            LwStatus::Foreign,
            "no joints",
        );
        two.refused(lw_robot_object_body_pose(r, PLIERS, 2, &mut at), LwStatus::Foreign, "");
        two.refused(lw_robot_object_body_pose(r, BEAM, 0, &mut at), LwStatus::Foreign, "");
        let name = |o, n: &std::ffi::CStr, body| lw_model_object_body(m, o, n.as_ptr(), body);
        let b = &raw mut body;
        assert_eq!(name(PLIERS, c"jaws", b), LwStatus::Unknown);
        assert_eq!(name(BEAM, c"jaw", b), LwStatus::Unknown);
        assert_eq!(name(7, c"jaw", b), LwStatus::Foreign);
        assert_eq!(lw_model_object_sizes(m, 7, &mut nq, &mut nv), LwStatus::Foreign);
        all_null(&[
            lw_model_object_sizes(m, PLIERS, null_mut(), &mut nv),
            lw_model_object_sizes(m, PLIERS, &mut nq, null_mut()),
            lw_model_object_sizes(null(), PLIERS, &mut nq, &mut nv),
            lw_model_object_body(m, PLIERS, null(), b),
            name(PLIERS, c"jaw", null_mut()),
            lw_robot_object_body_pose(r, PLIERS, body, null_mut()),
            lw_robot_object_body_pose(null_mut(), PLIERS, body, &mut at),
            lw_robot_object_jacobian(r, PLIERS, body, null_mut(), 6),
            lw_robot_object_jacobian(null_mut(), PLIERS, body, j, 6),
            lw_robot_closure(r, PLIERS, null_mut()),
            lw_robot_closure(null_mut(), PLIERS, &mut left),
            onto(LEFT, &[1], null_mut()),
            lw_robot_closure_onto(r, LEFT, PLIERS, body, null(), 1, &mut left),
            lw_robot_closure_onto(null_mut(), LEFT, PLIERS, body, null(), 0, &mut left),
            lw_robot_mass_matrix_with_object(r, PLIERS, null_mut(), 196),
            lw_robot_mass_matrix_with_object(null_mut(), PLIERS, p, 196),
        ]);
    }
}
