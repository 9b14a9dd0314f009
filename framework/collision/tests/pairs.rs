//! Pairs of shapes: closed forms, both orders, rigid motions, gradients, deep overlap, far away.

use crate::support::*;
use linkwork_collision::multibody::spatial::{Motion, Pose, Quat, Vec3};
use linkwork_collision::*;

/// Calls `f` for all ordered pairs of shapes, at random poses near contact.
fn each_pair(
    shapes: &[Shape],
    per_pair: usize,
    mut visit: impl FnMut(&Shape, &Shape, [Pose; 2], &mut Random),
) {
    let mut r = Random(1234);
    for a in shapes {
        for b in shapes {
            for _ in 0..per_pair {
                let reach = r.between(0.5, 1.2);
                let p = r.unit() * reach;
                let place = r.vec();
                let X = [Pose::new(r.rotation(), place), Pose::new(r.rotation(), place + p)];
                visit(a, b, X, &mut r);
            }
        }
    }
}

fn with_surfaces() -> Vec<Shape> {
    let mut all = convex_shapes();
    all.push(Shape::HalfSpace);
    all.push(box_mesh(Vec3::new(0.45, 0.55, 0.35)));
    all
}

#[test]
fn distances_are_those_of_closed_forms() {
    let mut r = Random(5);
    let (ball, R) = (Shape::Sphere { radius: 0.4 }, 0.4);
    let half = Vec3::new(0.5, 0.3, 0.4);
    for k in 0..300 {
        let X = r.pose(2.0);
        let q = r.vec() * 1.1;
        let Y = Pose::new(r.rotation(), X.transform_point(&q));
        let outside = |v: Vec3| Vec3::new(v.x.max(0.0), v.y.max(0.0), v.z.max(0.0)).norm();
        let d_box = q.abs() - half;
        let s = q.x.hypot(q.y);
        let d_cyl = Vec3::new(s - 0.3, q.z.abs() - 0.45, f64::NEG_INFINITY);
        let cases = [
            (ball.clone(), q.norm() - 0.4),
            (Shape::Box { half }, outside(d_box) + d_box.max().min(0.0)),
            (
                Shape::Capsule { radius: 0.2, half_length: 0.35 },
                (q - Vec3::z() * q.z.clamp(-0.35, 0.35)).norm() - 0.2,
            ),
            (
                Shape::Cylinder { radius: 0.3, half_length: 0.45 },
                outside(d_cyl) + d_cyl.max().min(0.0),
            ),
            (Shape::HalfSpace, q.z),
        ];
        for (shape, expected) in cases {
            let d = scene(&[shape.clone(), ball.clone()]).distance(&[X, Y]).unwrap();
            assert!(
                (d.distance - (expected - R)).abs() < 1e-12,
                "{k} {shape:?}: {} {}",
                d.distance,
                expected - R
            );
            assert!(((d.point_a - d.point_b).norm() - d.distance.abs()).abs() < 1e-12);
        }
    }
}

#[test]
fn half_spaces_know_the_lowest_point_of_everything() {
    let mut r = Random(6);
    for shape in convex_shapes() {
        for _ in 0..100 {
            let Y = r.pose(0.6);
            let low = -r_support(&shape, &(Y.rotation.inverse() * -Vec3::z())) + Y.position.z;
            let X = r.pose(1.0);
            let d = scene(&[Shape::HalfSpace, shape.clone()]).distance(&[X, X * Y]).unwrap();
            assert!((d.distance - low).abs() < 1e-12, "{shape:?}: {} {low}", d.distance);
        }
    }
}

/// Support function, by the definition of each shape.
fn r_support(shape: &Shape, d: &Vec3) -> f64 {
    match shape {
        Shape::Sphere { radius } => radius * d.norm(),
        Shape::Box { half } => half.dot(&d.abs()),
        Shape::Capsule { radius, half_length } => radius * d.norm() + half_length * d.z.abs(),
        Shape::Cylinder { radius, half_length } => {
            radius * d.x.hypot(d.y) + half_length * d.z.abs()
        }
        Shape::ConvexHull { points } => points.iter().map(|p| p.dot(d)).fold(f64::MIN, f64::max),
        Shape::Ellipsoid { half } => half.component_mul(d).norm(),
        _ => f64::INFINITY,
    }
}

/// Duality: the distance is the largest separation over all normals, so every normal shows at most this, and the reported one shows it. An
/// independent check of every convex pair, separate or overlapping.
#[test]
fn no_normal_separates_convex_pairs_more_than_their_distance() {
    let shapes = convex_shapes();
    let (mut apart, mut over, mut worst) = (0, 0, 0f64);
    each_pair(&shapes, 40, |a, b, X, r| {
        let mut s = scene(&[a.clone(), b.clone()]);
        let d = s.distance(&X).unwrap();
        let sep = |n: &Vec3| {
            let p = X[1].position - X[0].position;
            let along = |X: &Pose, n: &Vec3| X.rotation.inverse() * n;
            p.dot(n) - r_support(a, &along(&X[0], n)) - r_support(b, &along(&X[1], &-n))
        };
        let points = s.contacts(10.0, &X);
        let c = deepest(&points).unwrap();
        let middle = (d.point_a + d.point_b) / 2.0;
        let alone = c.gap <= d.distance + 1e-12
            && points.iter().filter(|p| p.gap < c.gap + 1e-5).count() == 1;
        assert!(!alone || (c.point - middle).norm() < 1e-9, "midway between the surfaces");
        let ahead = d.point_a + c.normal * d.distance;
        assert!(
            (ahead - d.point_b).norm() < 1e-9,
            "{c:?} {d:?} {} {}",
            points.len(),
            sep(&c.normal)
        );
        let error = (sep(&c.normal) - d.distance).abs();
        // Thinning keeps one of several points that are equally deep within 1e-5 of the size.
        assert!((-1e-12..6e-6).contains(&(c.gap - d.distance)), "{c:?} {d:?} {points:#?} {X:?}");
        worst = worst.max(error);
        assert!(error < 1e-12, "{} {c:?} {d:?}", sep(&c.normal));
        // In overlap, a face has priority over an edge that is less deep by 1e-5 of the size.
        let room = if d.distance > 0.0 { 1e-9 } else { 1e-5 };
        for scale in [1.0, 1e-1, 1e-2, 1e-3, 1e-5] {
            for _ in 0..50 {
                let n = (c.normal + r.vec() * scale).normalize();
                assert!(sep(&n) <= d.distance + room, "{a:?} {b:?}: {} {}", sep(&n), d.distance);
            }
        }
        if d.distance > 0.0 { apart += 1 } else { over += 1 }
    });
    println!("apart {apart}, overlapping {over}, worst {worst:.1e}");
    assert!(apart > 200 && over > 200);
}

#[test]
fn swapping_flips_the_normal_and_keeps_the_rest() {
    each_pair(&with_surfaces(), 12, |a, b, X, _| {
        if matches!((a, b), (Shape::Mesh { .. }, Shape::Mesh { .. })) {
            // The first mesh acts as a surface and the second as triangles, so deep in each other
            // the two orders differ.
            return;
        }
        let there = scene(&[a.clone(), b.clone()]).contacts(0.05, &X);
        let back = scene(&[b.clone(), a.clone()]).contacts(0.05, &[X[1], X[0]]);
        let (Some(p), Some(q)) = (deepest(&there), deepest(&back)) else {
            assert!(there.is_empty() && back.is_empty(), "{a:?} {b:?}");
            return;
        };
        assert!((p.gap - q.gap).abs() < 1e-9, "{a:?} {b:?}: {p:?} {q:?}");
        if (p.point - q.point).norm() < 1e-6 {
            assert!((p.normal + q.normal).norm() < 1e-5, "{a:?} {b:?}: {p:?} {q:?}");
        }
    });
}

#[test]
fn rigid_motions_of_all_change_nothing() {
    each_pair(&with_surfaces(), 12, |a, b, X, r| {
        if matches!((a, b), (Shape::Mesh { .. }, Shape::Mesh { .. })) {
            // Triangles have no inside: deep inside, round-off decides which of two normals is
            // used.
            return;
        }
        let T = r.pose(3.0);
        let mut s = scene(&[a.clone(), b.clone()]);
        let before = s.contacts(0.05, &X);
        let after = s.contacts(0.05, &[T * X[0], T * X[1]]);
        assert_eq!(before.len(), after.len(), "{a:?} {b:?}");
        for (p, q) in before.iter().zip(&after) {
            let curved = |s: &Shape| matches!(s, Shape::Cylinder { .. } | Shape::Ellipsoid { .. });
            let round = curved(a) || curved(b);
            let tol = if round { 1e-6 } else { 1e-12 };
            assert_eq!(p.feature, q.feature, "{a:?} {b:?}");
            assert!((p.gap - q.gap).abs() < tol, "{a:?} {b:?}: {p:?} {q:?}");
            assert!(
                (T.transform_vector(&p.normal) - q.normal).norm() < 10.0 * tol,
                "{a:?} {b:?} {p:?} {q:?}"
            );
            assert!((T.transform_point(&p.point) - q.point).norm() < 10.0 * tol, "{a:?} {b:?}");
        }
    });
}

#[test]
fn the_rate_of_the_gap_is_the_normal_times_the_relative_velocity() {
    let (mut checked, mut worst) = (0, 0f64);
    each_pair(&with_surfaces(), 12, |a, b, X, r| {
        let mut s = scene(&[a.clone(), b.clone()]);
        let V = [0, 1].map(|_| Motion::new(r.vec(), r.vec()));
        let t = 1e-6;
        let Some(c) =
            s.distance(&X).map(|_| s.contacts(0.3, &X)).as_deref().and_then(deepest).copied()
        else {
            return;
        };
        let mut gap = |t: f64| s.contacts(0.4, &[moved(&X[0], &V[0], t), moved(&X[1], &V[1], t)]);
        let (before, after) = (gap(-t), gap(t));
        let same = |list: &[ContactPoint]| {
            list.iter().find(|p| p.feature == c.feature).map(|p| (p.gap, p.normal))
        };
        let (Some(before), Some(after)) = (same(&before), same(&after)) else { return };
        // A triangle is independent of the solid behind it: deep in a mesh, its normals point outwards, but not to the
        // nearest point.
        let mesh = matches!(a, Shape::Mesh { .. }) || matches!(b, Shape::Mesh { .. });
        if mesh && c.gap < -0.01 {
            return;
        }
        if (before.1 - after.1).norm() > 1e-4 {
            return;
        }
        let rate = (after.0 - before.0) / (2.0 * t);
        let at = |i: usize| V[i].linear + V[i].angular.cross(&(c.point - X[i].position));
        let expected = c.normal.dot(&(at(1) - at(0)));
        checked += 1;
        worst = worst.max((rate - expected).abs());
        assert!((rate - expected).abs() < 1e-3, "{rate} {expected} {c:?} {b:?} {a:?}");
    });
    println!("checked {checked}, worst {worst:.1e}");
    assert!(checked > 300, "{checked}");
}

#[test]
fn deep_and_coincident_starts_have_a_defined_answer() {
    let shapes = with_surfaces();
    for a in &shapes {
        for b in &shapes {
            if matches!((a, b), (Shape::HalfSpace, Shape::HalfSpace)) {
                continue;
            }
            let both_meshes = matches!((a, b), (Shape::Mesh { .. }, _) | (_, Shape::Mesh { .. }));
            for p in [Vec3::zeros(), Vec3::new(1e-14, 0.0, 0.0), Vec3::new(0.01, -0.02, 0.03)] {
                let X = Pose::new(Quat::identity(), p);
                let mut s = scene(&[a.clone(), b.clone()]);
                let points = s.contacts(0.01, &[Pose::identity(), X]);
                // A mesh is a surface, so a body inside that does not touch it may be free.
                assert!(both_meshes || !points.is_empty(), "{a:?} {b:?} {p:?}");
                assert!(both_meshes || deepest(&points).unwrap().gap < 0.0, "{a:?} {b:?}");
            }
        }
    }
}

#[test]
fn far_away_only_the_digits_of_the_positions_are_lost() {
    let far = Vec3::new(1e5, -2e5, 3e4);
    each_pair(&convex_shapes(), 6, |a, b, X, _| {
        let mut s = scene(&[a.clone(), b.clone()]);
        let near = s.distance(&X).unwrap();
        let away = X.map(|X| Pose::new(X.rotation, X.position + far));
        let there = s.distance(&away).unwrap();
        // One unit in the last place of 2e5 is 3e-11.
        assert!((near.distance - there.distance).abs() < 2e-10, "{a:?} {b:?}: {near:?} {there:?}");
    });
}

#[test]
fn padding_is_taken_off_the_gap() {
    each_pair(&convex_shapes(), 4, |a, b, X, _| {
        let bodies = free_bodies(2);
        let mut specs = vec![
            ColliderSpec::new("a", "a00", a.clone()),
            ColliderSpec::new("b", "a01", b.clone()),
        ];
        let plain = scene_of(specs.clone(), bodies.clone()).distance(&X).unwrap().distance;
        (specs[0].padding, specs[1].padding) = (0.03, 0.02);
        let thick = scene_of(specs, bodies).distance(&X).unwrap().distance;
        assert!((plain - thick - 0.05).abs() < 1e-9);
    });
}
