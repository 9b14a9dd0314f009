//! Several contact points per pair: their number and positions, and that their features persist while a resting body trembles.

use crate::support::*;
use linkwork_collision::multibody::spatial::{Pose, Quat, Vec3};
use linkwork_collision::*;

fn up(z: f64) -> Pose {
    Pose::translation(0.0, 0.0, z)
}

fn upright(r: f64, h: f64) -> Shape {
    Shape::Cylinder { radius: r, half_length: h }
}

/// A height field of gentle waves, or flat.
fn terrain(wave: f64) -> Shape {
    let (x, y) = (21, 25);
    let heights = (0..x * y)
        .map(|i| wave * ((i % x) as f64 * 0.9).sin() * ((i / x) as f64 * 0.7).cos())
        .collect();
    Shape::HeightField { x, y, spacing: [0.2, 0.15], heights }
}

/// Lying or standing bodies, with the upper shape at the pose, and the expected number of points.
fn resting() -> Vec<(&'static str, Shape, Shape, Pose, usize)> {
    let lying = Quat::from_euler_angles(0.0, std::f64::consts::FRAC_PI_2, 0.0);
    let slab = Shape::Box { half: Vec3::new(1.0, 1.2, 0.1) };
    let half = Vec3::new(0.3, 0.2, 0.1);
    let hull = Shape::ConvexHull {
        points: (0..16)
            .map(|i| {
                Vec3::new(
                    0.3 * f64::from(i % 8 * 45).to_radians().cos(),
                    0.3 * f64::from(i % 8 * 45).to_radians().sin(),
                    if i < 8 { -0.2 } else { 0.2 },
                )
            })
            .collect(),
    };
    let boxed = Shape::Box { half };
    let mesh = box_mesh(Vec3::new(1.0, 1.2, 0.1));
    let mut all = Vec::new();
    for (ground, shape, top) in [
        ("half space", Shape::HalfSpace, 0.0),
        ("box", slab, 0.1),
        ("mesh", mesh, 0.1),
        ("terrain", terrain(0.0), 0.0),
    ] {
        let mut put = |what: &Shape, X: Pose, count| {
            all.push((ground, shape.clone(), what.clone(), X, count))
        };
        put(&boxed, up(top + 0.1), 4);
        put(
            &boxed,
            Pose::new(Quat::from_euler_angles(0.0, 0.0, 0.4), Vec3::new(0.21, 0.13, top + 0.1)),
            4,
        );
        put(&upright(0.25, 0.2), up(top + 0.2), 8);
        put(&upright(0.25, 0.2), Pose::new(lying, Vec3::new(0.03, 0.07, top + 0.25)), 2);
        put(
            &Shape::Capsule { radius: 0.1, half_length: 0.3 },
            Pose::new(lying, Vec3::new(0.03, 0.07, top + 0.1)),
            2,
        );
        put(&Shape::Sphere { radius: 0.2 }, Pose::translation(0.03, 0.07, top + 0.2), 1);
        put(&hull, up(top + 0.2), 8);
    }
    all.push(("equal box", boxed.clone(), boxed.clone(), up(0.2), 4));
    all.push(("shifted equal box", boxed.clone(), boxed, Pose::translation(0.1, 0.0, 0.2), 4));
    all.push(("equal cylinder", upright(0.25, 0.2), upright(0.25, 0.2), up(0.4), 8));
    let capsule = Shape::Capsule { radius: 0.1, half_length: 0.3 };
    all.push((
        "parallel capsule",
        capsule.clone(),
        capsule.clone(),
        Pose::translation(0.2, 0.0, 0.15),
        2,
    ));
    all.push((
        "crossed capsule",
        capsule.clone(),
        capsule,
        Pose::new(lying, Vec3::new(0.0, 0.2, 0.05)),
        1,
    ));
    all.push((
        "lying cylinder",
        upright(0.25, 0.2),
        upright(0.25, 0.2),
        Pose::translation(0.5, 0.0, 0.1),
        2,
    ));
    all
}

#[test]
fn points_are_as_many_as_they_should_be_and_keep_their_names() {
    let mut r = Random(3);
    for (ground, a, b, X, count) in resting() {
        let mut s = scene(&[a.clone(), b.clone()]);
        let place = |r: &mut Random, size: f64, X: &Pose| {
            let (v, w) = (r.vec() * size, r.vec() * size);
            Pose::new(Quat::from_scaled_axis(w) * X.rotation, X.position + v)
        };
        let names = |s: &mut Scene, X: [Pose; 2]| -> Vec<u64> {
            s.contacts(0.005, &X).iter().map(|c| c.feature).collect()
        };
        let still = names(&mut s, [Pose::identity(), X]);
        assert_eq!(still.len(), count, "{b:?} on {ground}");
        for k in 0..200 {
            let Y = [place(&mut r, 1e-6, &Pose::identity()), place(&mut r, 1e-6, &X)];
            assert_eq!(names(&mut s, Y), still, "{b:?} on {ground}, jiggle {k}");
        }
    }
}

/// Points around a resting box enclose its centre, lie on it, and point up.
#[test]
fn points_on_surfaces_are_spread_and_point_up() {
    let half = Vec3::new(0.5, 0.4, 0.2);
    for shape in [terrain(0.0), box_mesh(Vec3::new(2.0, 3.0, 0.4))] {
        let top = if matches!(shape, Shape::Mesh { .. }) { 0.4 } else { 0.0 };
        let mut s = scene(&[shape, Shape::Box { half }]);
        let mut r = Random(8);
        for _ in 0..100 {
            let turn = Quat::from_euler_angles(0.0, 0.0, 3.0 * r.signed());
            let depth = r.between(-0.004, 0.02);
            let X =
                Pose::new(turn, Vec3::new(0.3 * r.signed(), 0.3 * r.signed(), top + 0.2 - depth));
            let points = s.contacts(0.005, &[Pose::identity(), X]);
            assert!((4..=8).contains(&points.len()), "{}", points.len());
            let mut local: Vec<Vec3> =
                points.iter().map(|c| X.inverse().transform_point(&c.point)).collect();
            local.sort_by(|p, q| p.y.atan2(p.x).total_cmp(&q.y.atan2(q.x)));
            let next = local.iter().cycle().skip(1);
            let area = local.iter().zip(next).map(|(p, q)| p.cross(q).z).sum::<f64>() / 2.0;
            assert!(area > 0.99 * 0.8, "{area}");
            for c in &points {
                assert!(
                    (c.normal - Vec3::z()).norm() < 1e-12,
                    "an internal edge turned a normal: {c:?}"
                );
                assert!((c.gap + depth).abs() < 1e-12, "{c:?}");
            }
        }
    }
}

/// A sphere that rolls over flat and concave edges contacts the surface and not the edges.
#[test]
fn internal_edges_are_not_felt() {
    let mut s = scene(&[terrain(0.0), Shape::Sphere { radius: 0.3 }]);
    let mut r = Random(4);
    for _ in 0..300 {
        let X = Pose::translation(r.signed(), r.signed(), r.between(0.1, 0.302));
        let points = s.contacts(0.005, &[Pose::identity(), X]);
        assert_eq!(points.len(), 1);
        assert!(
            (points[0].normal - Vec3::z()).norm() < 1e-12
                && (points[0].gap - (X.position.z - 0.3)).abs() < 1e-12
        );
    }
}

/// On waves: the gap of a sphere is the distance to the nearest triangle, by brute force over a fine set of points.
#[test]
fn balls_on_waves_are_as_far_as_the_nearest_point() {
    let shape = terrain(0.08);
    let Shape::HeightField { x, y, spacing, heights } = &shape else { panic!() };
    let point = |i: usize, j: usize| {
        Vec3::new(
            (i as f64 - 10.0) * spacing[0],
            (j as f64 - 12.0) * spacing[1],
            heights[j * x + i],
        )
    };
    let mut s = scene(&[shape.clone(), Shape::Sphere { radius: 0.1 }]);
    let mut r = Random(9);
    let n = 40;
    for _ in 0..60 {
        let centre = Vec3::new(r.signed(), r.signed(), r.between(0.09, 0.3));
        let mut best = f64::INFINITY;
        for j in 0..y - 1 {
            for i in 0..x - 1 {
                for t in [
                    [point(i, j), point(i + 1, j), point(i + 1, j + 1)],
                    [point(i, j), point(i + 1, j + 1), point(i, j + 1)],
                ] {
                    for u in 0..=n {
                        for v in 0..=n - u {
                            let p = t[0]
                                + (t[1] - t[0]) * (u as f64 / n as f64)
                                + (t[2] - t[0]) * (v as f64 / n as f64);
                            best = best.min((p - centre).norm());
                        }
                    }
                }
            }
        }
        let d =
            s.distance(&[Pose::identity(), Pose::new(Quat::identity(), centre)]).unwrap().distance;
        assert!(d <= best - 0.1 + 1e-12 && d > best - 0.1 - 4e-4, "{d} {}", best - 0.1);
    }
}

/// A body deep under terrain is pushed up.
#[test]
fn what_is_under_terrain_is_pushed_up() {
    for shape in convex_shapes() {
        let mut s = scene(&[terrain(0.08), shape.clone()]);
        let points = s.contacts(0.01, &[Pose::identity(), Pose::translation(0.33, -0.21, -5.0)]);
        let c = deepest(&points).unwrap();
        assert!(c.gap < -3.0 && c.normal.z > 0.5, "{shape:?}: {c:?}");
    }
}

/// A tilted wheel touches with its rim at the exact lowest point, and has points on both sides of it.
#[test]
fn a_tilted_cylinder_touches_at_its_lowest_point() {
    let mut s = scene(&[Shape::HalfSpace, upright(0.3, 0.1)]);
    for tilt in [1e-3, 0.01, 0.1, 0.7, 1.5] {
        let q = Quat::from_euler_angles(tilt, 0.0, 0.3);
        let low = 0.3 * tilt.sin() + 0.1 * tilt.cos();
        let points =
            s.contacts(0.02, &[Pose::identity(), Pose::new(q, Vec3::new(0.0, 0.0, low - 1e-3))]);
        assert!((deepest(&points).unwrap().gap + 1e-3).abs() < 1e-12, "{tilt}: {points:?}");
    }
}

/// Boxes at random poses on each other, on a mesh and on terrain: features persist while they tremble.
#[test]
fn names_stay_at_random_places() {
    let mut r = Random(41);
    let half = Vec3::new(0.3, 0.2, 0.1);
    let grounds = [Shape::Box { half }, box_mesh(half), terrain(0.0)];
    for (k, ground) in grounds.iter().cycle().take(150).enumerate() {
        let top = if k % 3 == 2 { 0.0 } else { 0.1 };
        let mut s = scene(&[ground.clone(), Shape::Box { half }]);
        let tremble = |r: &mut Random, X: &Pose| {
            Pose::new(
                Quat::from_scaled_axis(r.vec() * 1e-6) * X.rotation,
                X.position + r.vec() * 1e-6,
            )
        };
        let turn = Quat::from_euler_angles(0.0, 0.0, 3.0 * r.signed());
        let X = Pose::new(turn, Vec3::new(0.3 * r.signed(), 0.2 * r.signed(), top + 0.1));
        let still: Vec<u64> =
            s.contacts(0.005, &[Pose::identity(), X]).iter().map(|c| c.feature).collect();
        assert!((2..=8).contains(&still.len()), "{k}: {}", still.len());
        for _ in 0..20 {
            let Y = [tremble(&mut r, &Pose::identity()), tremble(&mut r, &X)];
            let now: Vec<u64> = s.contacts(0.005, &Y).iter().map(|c| c.feature).collect();
            assert_eq!(now, still, "{k}: {X:?}");
        }
    }
}

/// Three by three heights, all zero except the middle row or the middle one.
fn roof(top: f64, peak: bool) -> Shape {
    let heights = (0..9).map(|k| if k == 4 || (!peak && k % 3 == 1) { top } else { 0.0 }).collect();
    Shape::HeightField { x: 3, y: 3, spacing: [1.0, 1.0], heights }
}

/// A wheel over the ridge of a roof, with its axis parallel or rotated: the gap is the distance of ridge and axis minus the radius; then over the
/// slope.
#[test]
fn a_wheel_on_a_ridge_is_as_far_as_the_ridge() {
    let (r, top) = (0.2, 0.08);
    let mut s = scene(&[roof(top, false), upright(r, 0.1)]);
    let lying = Quat::from_euler_angles(std::f64::consts::FRAC_PI_2, 0.0, 0.0);
    let mut random = Random(12);
    let slope = f64::atan(top);
    for k in 0..200 {
        // The direction from the ridge to the axis is between the normals of both sides or outside
        // of them.
        let lean = slope * 1.5 * random.signed();
        let gap = random.between(-1e-3, 4e-3);
        let (turn, y) = (3.0 * f64::from(k % 2) * random.signed(), 0.3 * random.signed());
        let n = Vec3::new(lean.sin(), 0.0, lean.cos());
        let on_ridge = Vec3::new(0.0, y, top);
        let turned = Quat::from_scaled_axis(n * turn) * Quat::from_euler_angles(0.0, lean, 0.0);
        let place = on_ridge + n * (r + gap);
        let X = Pose::new(turned * lying, place);
        let axis = X.transform_vector(&Vec3::z());
        // Outside of these normals, the side of the ridge is nearest: its plane, at the lowest
        // point of the wheel.
        let side = lean.abs() > slope;
        let expected = if side {
            let m = Vec3::new(slope.sin().copysign(lean), 0.0, slope.cos());
            let along = m.dot(&axis);
            (place - Vec3::z() * top).dot(&m) - r * (m - axis * along).norm() - 0.1 * along.abs()
        } else {
            gap
        };
        let points = s.contacts(0.005, &[Pose::identity(), X]);
        let Some(c) = deepest(&points) else {
            assert!(expected > 0.005, "{k}: {expected}");
            continue;
        };
        assert!((c.gap - expected).abs() < 1e-12, "{k}: {} {expected} {lean}", c.gap);
        let m = if side { Vec3::new(slope.sin().copysign(lean), 0.0, slope.cos()) } else { n };
        assert!((c.normal - m).norm() < 1e-9, "{k}: {c:?} {m:?}");
    }
}

/// A peak under the end of an upright cylinder, also between the rim and the eight points that represent it; and under a wheel.
#[test]
fn a_peak_is_found_wherever_it_is_under_a_cylinder() {
    let (r, h, top) = (0.3, 0.1, 0.25);
    let mut s = scene(&[roof(top, true), upright(r, h)]);
    let mut random = Random(13);
    let lying = Quat::from_euler_angles(std::f64::consts::FRAC_PI_2, 0.0, 0.0);
    for _ in 0..200 {
        let (turn, gap) = (3.0 * random.signed(), random.between(-1e-3, 4e-3));
        let (angle, out) = (3.2 * random.signed(), 0.99 * r * random.between(0.0, 1.0).sqrt());
        let place = Vec3::new(out * angle.cos(), out * angle.sin(), top + gap + h);
        let X = Pose::new(Quat::from_euler_angles(0.0, 0.0, turn), place);
        let points = s.contacts(0.005, &[Pose::identity(), X]);
        let c = deepest(&points).unwrap();
        assert!((c.gap - gap).abs() < 1e-12 && (c.normal - Vec3::z()).norm() < 1e-9, "{c:?}");
        let X = Pose::new(
            Quat::from_euler_angles(0.0, 0.0, turn) * lying,
            Vec3::new(0.0, 0.0, top + gap + r),
        );
        let points = s.contacts(0.005, &[Pose::identity(), X]);
        let c = deepest(&points).unwrap();
        assert!((c.gap - gap).abs() < 1e-12 && (c.normal - Vec3::z()).norm() < 1e-9, "{c:?}");
    }
}

/// Wheels that lie, stand or lean on waves: features persist while they tremble, except where a point passes the margin or a corner.
#[test]
fn names_stay_on_waves() {
    let mut r = Random(43);
    let mut s = scene(&[terrain(0.08), upright(0.2, 0.12)]);
    let (mut same, mut changed) = (0, 0);
    for k in 0..120 {
        let tilt = [1.57, 0.0, 0.7][k % 3] + 0.1 * r.signed();
        let turn = Quat::from_euler_angles(0.0, 0.0, 3.0 * r.signed())
            * Quat::from_euler_angles(tilt, 0.0, 0.0);
        let mut X = Pose::new(turn, Vec3::new(r.signed(), r.signed(), 0.5));
        for _ in 0..3 {
            let points = s.contacts(1.0, &[Pose::identity(), X]);
            let c = deepest(&points).unwrap();
            X.position -= c.normal * (c.gap + 5e-5);
        }
        let mut names = |X: Pose| -> Vec<u64> {
            let points = s.contacts(0.005, &[Pose::identity(), X]);
            points.iter().map(|c| c.feature).collect()
        };
        let still = names(X);
        for _ in 0..20 {
            let q = Quat::from_scaled_axis(r.vec() * 1e-7) * X.rotation;
            let now = names(Pose::new(q, X.position + r.vec() * 1e-7));
            if now == still { same += 1 } else { changed += 1 }
        }
    }
    println!("{same} the same, {changed} changed");
    assert!(same > 2000 && 20 * changed < same, "{same} {changed}");
}
