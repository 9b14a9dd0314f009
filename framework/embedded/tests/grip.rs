//! Two hands that hold only by friction: closed forms, optimality, infeasible loads, errors.

use crate::support::Rng;
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge};
use linkwork_embedded::spatial::{Force, MassProperties, Mat3, Pose, Quat, Vec3};
use linkwork_embedded::*;

/// Two palms on sliders and the box between them, 0.2 m wide; each tip is rotated by its own `turn`.
fn palms(turn: [Quat; 2]) -> (Robot, Object) {
    let mut b = Builder::new();
    for (name, x) in [("left", -0.1), ("right", 0.1)] {
        let at = Pose::translation(x, 0.0, 0.0);
        b.body(BodySpec::new(name, "world").hinge_in_parent(at).hinge(Hinge::slider(Vec3::x())));
    }
    for (i, name) in ["left", "right"].iter().enumerate() {
        let spec = BodySpec::new(format!("{name} palm"), *name);
        b.body(spec.hinge_in_parent(Pose::rotation(turn[i])));
    }
    let parts = ["left", "right"].map(|n| PartSpec::chain(n, "world", &format!("{n} palm")));
    let mass = MassProperties::new(2.0, Vec3::zeros(), Mat3::identity() * 0.01);
    let objects = vec![ObjectSpec { name: "box".into(), mass }];
    let spec = ModelSpec { mechanism: b, parts: parts.to_vec(), objects, ..ModelSpec::default() };
    let model = RobotModel::new(&spec).unwrap();
    let object = model.object("box").unwrap();
    let mut robot = Robot::new(&model);
    for (i, (name, x)) in [("left", 0.1), ("right", -0.1)].iter().enumerate() {
        let at = Pose::rotation(turn[i].inverse()) * Pose::translation(*x, 0.0, 0.0);
        robot.grasp(model.part(name).unwrap(), object, Grasp::At(at)).unwrap();
    }
    (robot, object)
}

fn straight() -> [Quat; 2] {
    [Quat::identity(); 2]
}

fn hold(normal: Vec3, coefficient: f64, radius: f64, most: f64) -> Friction {
    Friction { normal, coefficient, radius, most }
}

fn push(f: [f64; 3]) -> Force {
    Force::new(Vec3::zeros(), f.into())
}

/// The scaled wrench from its definition: normal part, and the norm of the rest.
fn scaled(f: &Force, grip: &Friction, turn: &Quat) -> [f64; 4] {
    let n = (turn * grip.normal).normalize();
    let across = |v: &Vec3| (v - n * n.dot(v)).norm();
    let (mu, r) = (grip.coefficient, grip.radius);
    [
        n.dot(&f.force),
        across(&f.force) / mu,
        n.dot(&f.moment) / (2.0 / 3.0 * mu * r),
        across(&f.moment) / r,
    ]
}

fn missing(f: &Force, grip: &Friction, turn: &Quat) -> f64 {
    let [p, a, b, c] = scaled(f, grip, turn);
    ((a * a + b * b + c * c).sqrt() - p).max(p - grip.most)
}

/// Squared distance of two wrenches, scaled by friction.
fn distance(a: &Force, b: &Force, grip: &Friction, turn: &Quat) -> f64 {
    let d = Force::new(a.moment - b.moment, a.force - b.force);
    scaled(&d, grip, turn).iter().map(|x| x * x).sum()
}

fn net(w: &[Force; 2]) -> Force {
    let sum = |i: usize, x: f64| w[i].shift_to_parent(&Vec3::new(x, 0.0, 0.0));
    let (a, b) = (sum(0, -0.1), sum(1, 0.1));
    Force::new(a.moment + b.moment, a.force + b.force)
}

#[test]
fn palms_press_a_box_as_hard_as_its_weight_asks() {
    let (mut robot, object) = palms(straight());
    let weight = 2.0 * 9.81;
    for mu in [0.2, 0.5, 1.0] {
        let grips = [1.0, -1.0].map(|s| hold(Vec3::x() * s, mu, 0.02, f64::INFINITY));
        let wanted = [push([0.0, 0.0, weight / 2.0]); 2];
        let told = robot.grip(object, &wanted, &grips).unwrap();
        let press = weight / (2.0 * mu);
        assert_eq!(told.shortfall, 0.0);
        for (w, sign) in told.wrenches.iter().zip([1.0, -1.0]) {
            assert!((w.force.x * sign - press).abs() < 2e-6 * press, "{mu}: {} {press}", w.force.x);
            assert!((w.force.z - weight / 2.0).abs() < 1e-5 && w.moment.norm() < 1e-6);
        }
        // If the hands press more than necessary, the wrenches are returned unchanged, bit for bit
        // identical.
        let firm = [1.0, -1.0].map(|s| push([s * 1.01 * press, 0.0, weight / 2.0]));
        assert_eq!(
            robot.grip(object, &firm, &grips).unwrap(),
            Gripped { wrenches: firm, shortfall: 0.0 }
        );
    }
}

/// If the limit is below the required pressure, both wrenches are off by half of the difference.
#[test]
fn what_cannot_be_held_is_told_with_what_is_missing() {
    let (mut robot, object) = palms(straight());
    let (weight, mu) = (2.0 * 9.81, 0.4);
    let press = weight / (2.0 * mu);
    let grips = [1.0, -1.0].map(|s| hold(Vec3::x() * s, mu, 0.02, 0.5 * press));
    let wanted = [push([0.0, 0.0, weight / 2.0]); 2];
    let told = robot.grip(object, &wanted, &grips).unwrap();
    assert!((told.shortfall - 0.25 * press).abs() < 1e-6 * press, "{} {press}", told.shortfall);
    assert!((told.wrenches[0].force.x - 0.75 * press).abs() < 1e-5 * press);
    // Two palms that press upward cannot hold a box sideways.
    let up = [hold(Vec3::z(), mu, 0.02, f64::INFINITY); 2];
    let told = robot.grip(object, &[push([0.0, 0.0, -weight / 2.0]); 2], &up).unwrap();
    assert!(told.shortfall > 0.0, "{told:?}");
}

/// For any press and load: no slip, the same net wrench, and no feasible wrenches are nearer.
#[test]
fn wrenches_hold_keep_the_net_wrench_and_none_is_nearer() {
    let mut rng = Rng(11);
    let mut found = 0;
    for _ in 0..40 {
        let angle = |rng: &mut Rng| rng.within(-0.5, 0.5);
        let turn = [(); 2]
            .map(|()| Quat::from_euler_angles(angle(&mut rng), angle(&mut rng), angle(&mut rng)));
        let (mut robot, object) = palms(turn);
        let mu = rng.within(0.2, 1.0);
        let most = if rng.unit() < 0.5 { f64::INFINITY } else { rng.within(30.0, 300.0) };
        let grips = [
            hold(Vec3::new(2.0, 0.3, -0.2), mu, 0.03, most),
            hold(Vec3::new(-1.0, 0.2, 0.1), 0.6, 0.05, f64::INFINITY),
        ];
        let wanted = [(); 2].map(|()| {
            let mut v = |s: f64| Vec3::from_fn(|_, _| rng.within(-s, s));
            Force::new(v(0.5), v(20.0))
        });
        let told = robot.grip(object, &wanted, &grips).unwrap();
        let (before, after) = (net(&wanted), net(&told.wrenches));
        let size = 1.0 + told.wrenches[0].force.norm() + told.wrenches[1].force.norm();
        assert!((before.force - after.force).norm() < 1e-12 * size);
        assert!((before.moment - after.moment).norm() < 1e-12 * size);
        if told.shortfall > 0.0 {
            continue;
        }
        found += 1;
        let holds =
            |w: &[Force; 2]| (0..2).all(|i| missing(&w[i], &grips[i], &turn[i]) <= 1e-12 * size);
        let far = |w: &[Force; 2]| -> f64 {
            (0..2).map(|i| distance(&w[i], &wanted[i], &grips[i], &turn[i])).sum()
        };
        assert!(holds(&told.wrenches), "{told:?}");
        let best = far(&told.wrenches);
        for k in 0..20_000 {
            let scale = size * 10f64.powi(-(k % 6));
            let mut v = |s: f64| Vec3::from_fn(|_, _| rng.within(-s, s));
            let about_o = Force::new(v(0.05 * scale), v(scale));
            let mut other = told.wrenches;
            for (i, (x, sign)) in [(-0.1, -1.0), (0.1, 1.0)].into_iter().enumerate() {
                let own = about_o.shift_to_parent(&Vec3::new(-x, 0.0, 0.0));
                other[i].moment += own.moment * sign;
                other[i].force += own.force * sign;
            }
            if holds(&other) {
                let gain = best - far(&other);
                assert!(gain < 1e-9 * size * size, "{gain} of {best}, scale {scale}");
            }
        }
    }
    assert!(found > 20, "{found} of 40 could be held");
}

#[test]
fn friction_that_is_none_and_hands_that_hold_nothing_are_refused() {
    let (mut robot, object) = palms(straight());
    let good = hold(Vec3::x(), 0.5, 0.02, f64::INFINITY);
    let wanted = [push([0.0, 0.0, 1.0]); 2];
    for bad in [
        Friction { normal: Vec3::zeros(), ..good },
        Friction { coefficient: 0.0, ..good },
        Friction { radius: -1.0, ..good },
        Friction { most: 0.0, ..good },
        Friction { most: f64::NAN, ..good },
    ] {
        let e = robot.grip(object, &wanted, &[good, bad]).unwrap_err();
        assert!(matches!(e, RobotError::OutOfRange { .. }), "{bad:?} {e}");
    }
    let nan = Friction { normal: Vec3::repeat(f64::NAN), ..good };
    assert!(matches!(robot.grip(object, &wanted, &[nan, good]), Err(RobotError::NotFinite { .. })));
    let none = [push([f64::NAN, 0.0, 0.0]); 2];
    assert!(matches!(robot.grip(object, &none, &[good; 2]), Err(RobotError::NotFinite { .. })));
    robot.ungrasp(object).unwrap();
    assert!(matches!(robot.grip(object, &wanted, &[good; 2]), Err(RobotError::NotHeld { .. })));
}
