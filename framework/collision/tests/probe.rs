//! The boolean query agrees with the distance within 1e-9 of a size, so contacts are never missed. Normals prove the distances.

use crate::support;

use linkwork_collision::multibody::spatial::{Pose, Quat, Vec3};
use linkwork_collision::multibody::{BodySpec, Builder, Hinge};
use linkwork_collision::*;
use support::Random;

#[test]
fn the_least_thickness_that_closes_a_gap_is_a_hit() {
    let mut rng = Random(3);
    let hull = (0..16).map(|_| rng.unit() * 0.2).collect();
    let shapes = [
        Shape::Sphere { radius: 0.1 },
        Shape::Box { half: Vec3::new(0.2, 0.1, 0.05) },
        Shape::Capsule { radius: 0.06, half_length: 0.2 },
        Shape::Cylinder { radius: 0.1, half_length: 0.15 },
        Shape::Cylinder { radius: 0.02, half_length: 0.4 },
        Shape::Ellipsoid { half: Vec3::new(0.2, 0.12, 0.06) },
        Shape::ConvexHull { points: hull },
    ];
    let mut builder = Builder::new();
    for name in ["a", "b"] {
        builder.body(BodySpec::new(name, "world").hinge(Hinge::free()));
    }
    let multibody = builder.build().unwrap();
    let body = multibody.body("a");
    for (i, a) in shapes.iter().enumerate() {
        for (j, b) in shapes.iter().enumerate().skip(i) {
            let specs = vec![
                ColliderSpec::new("a", "a", a.clone()),
                ColliderSpec::new("b", "b", b.clone()),
            ];
            let colliders = Colliders::new(specs, Rules::default(), &multibody).unwrap();
            let [a, b] = ["a", "b"].map(|n| colliders.find(n).unwrap());
            let mut probe = Probe::new(&colliders);
            let mut asked = 0;
            for _ in 0..300 {
                let poses = [rng.pose(0.5), rng.pose(0.5)];
                probe.place(&colliders, |of| if of == body { poses[0] } else { poses[1] });
                let d = probe.distance(&colliders, a, b, f64::INFINITY).unwrap().distance;
                if d < 1e-3 {
                    assert_eq!(probe.first_hit(&colliders).is_some(), d <= 0.0);
                    continue;
                }
                asked += 1;
                for (off, hit) in [(1e-9, true), (-1e-9, false)] {
                    probe.set_padding(a, 0.7 * (d + off));
                    probe.set_padding(b, 0.3 * (d + off));
                    let found = probe.first_hit(&colliders).is_some();
                    assert_eq!(found, hit, "{i} {j}: {d} and {off}");
                }
                probe.set_padding(a, 0.0);
                probe.set_padding(b, 0.0);
            }
            assert!(asked > 20, "{i} {j}: {asked}");
        }
    }
}

/// Support function of a shape in its own axes, by its definition.
fn support(shape: &Shape, d: &Vec3) -> f64 {
    match shape {
        Shape::Sphere { radius } => radius * d.norm(),
        Shape::Box { half } => half.dot(&d.abs()),
        Shape::Capsule { radius, half_length } => radius * d.norm() + half_length * d.z.abs(),
        Shape::Cylinder { radius, half_length } => {
            radius * d.x.hypot(d.y) + half_length * d.z.abs()
        }
        Shape::ConvexHull { points } => points.iter().map(|p| p.dot(d)).fold(f64::MIN, f64::max),
        Shape::Ellipsoid { half } => half.component_mul(d).norm(),
        other => panic!("{other:?}"),
    }
}

/// Returns a lower bound of the distance of a point from a shape; for a hull with many directions.
fn outside(shape: &Shape, x: &Vec3, rng: &mut Random) -> f64 {
    match shape {
        Shape::Sphere { radius } => x.norm() - radius,
        Shape::Box { half } => (x.abs() - half).max(),
        Shape::Capsule { radius, half_length } => {
            (x - Vec3::z() * x.z.clamp(-half_length, *half_length)).norm() - radius
        }
        Shape::Cylinder { radius, half_length } => {
            (x.x.hypot(x.y) - radius).max(x.z.abs() - half_length)
        }
        hull => (0..50)
            .map(|_| rng.unit())
            .map(|n| n.dot(x) - support(hull, &n))
            .fold(f64::MIN, f64::max),
    }
}

/// Duality proves a distance from both sides: the ends are in the shapes, and the normal between them leaves the same separation.
#[test]
fn distances_are_proven_from_both_sides() {
    let mut rng = Random(29);
    let hull = |rng: &mut Random, n: usize, s: f64| Shape::ConvexHull {
        points: (0..n).map(|_| rng.unit() * s).collect(),
    };
    let shapes = [
        Shape::Sphere { radius: 0.1 },
        Shape::Box { half: Vec3::new(0.2, 0.1, 0.05) },
        Shape::Box { half: Vec3::new(2.0, 2.0, 0.05) },
        Shape::Box { half: Vec3::new(0.01, 0.005, 0.03) },
        Shape::Capsule { radius: 0.06, half_length: 0.2 },
        Shape::Capsule { radius: 0.001, half_length: 0.6 },
        Shape::Cylinder { radius: 0.1, half_length: 0.15 },
        Shape::Cylinder { radius: 0.02, half_length: 0.4 },
        Shape::Cylinder { radius: 0.5, half_length: 0.001 },
        hull(&mut rng, 16, 0.2),
        hull(&mut rng, 5, 0.4),
    ];
    let mut builder = Builder::new();
    for name in ["a", "b"] {
        builder.body(BodySpec::new(name, "world").hinge(Hinge::free()));
    }
    let multibody = builder.build().unwrap();
    let body = multibody.body("a");
    // Largest errors of distances and of their end points: first for iterative pairs (a cylinder with a shape with
    // edges or with another cylinder), then for all others.
    let mut worst = [[0.0_f64; 2]; 2];
    let limits = [[5e-10, 2e-9], [2e-12, 2e-12]];
    let mut least = usize::MAX;
    for (i, a) in shapes.iter().enumerate() {
        for (j, b) in shapes.iter().enumerate() {
            let spec = |n: &str, s: &Shape| ColliderSpec::new(n, n, s.clone());
            let specs = vec![spec("a", a), spec("b", b)];
            let colliders = Colliders::new(specs, Rules::default(), &multibody).unwrap();
            let [ia, ib] = ["a", "b"].map(|n| colliders.find(n).unwrap());
            let mut probe = Probe::new(&colliders);
            let cylinder = |s: &Shape| matches!(s, Shape::Cylinder { .. });
            let line = |s: &Shape| matches!(s, Shape::Sphere { .. } | Shape::Capsule { .. });
            let closed = line(a) || line(b) || !(cylinder(a) || cylinder(b));
            let (worst, limits) = (&mut worst[usize::from(closed)], limits[usize::from(closed)]);
            let mut apart = 0;
            for k in 0..200 {
                // One third of the cases is random, one third has almost or exactly parallel axes,
                // and one third nearly touches.
                let (far, X) = (rng.vec() * 3.0, rng.pose(0.7));
                let small = 10f64.powi(-(k % 20));
                let turn = match k % 3 {
                    0 => rng.rotation(),
                    _ => {
                        let axis = [Vec3::x(), Vec3::y(), Vec3::z()][k as usize % 5 % 3];
                        let quarter = std::f64::consts::FRAC_PI_2 * f64::from(k % 4);
                        Quat::from_scaled_axis(rng.vec() * small)
                            * Quat::from_scaled_axis(axis * quarter)
                    }
                };
                let mut Y = Pose::new(X.rotation * turn, X.position + rng.vec());
                if k % 3 == 2 {
                    // The shapes move along the line of centres until they are about 1e-4 apart.
                    let n = (Y.position - X.position).normalize();
                    let back = |X: &Pose, n: Vec3| X.rotation.inverse() * n;
                    let reach = support(a, &back(&X, n)) + support(b, &back(&Y, -n));
                    Y.position = X.position + n * (reach + 1e-4);
                }
                let poses = [
                    Pose::new(X.rotation, X.position + far),
                    Pose::new(Y.rotation, Y.position + far),
                ];
                probe.place(&colliders, |of| if of == body { poses[0] } else { poses[1] });
                let d = probe.distance(&colliders, ia, ib, f64::INFINITY).unwrap();
                if d.distance < 1e-5 {
                    continue;
                }
                apart += 1;
                let way = d.point_b - d.point_a;
                let n = way / d.distance;
                let into = |X: &Pose, n: Vec3| X.rotation.inverse() * n;
                let room = (poses[1].position - poses[0].position).dot(&n)
                    - support(a, &into(&poses[0], n))
                    - support(b, &into(&poses[1], -n));
                worst[0] = worst[0].max((way.norm() - d.distance).abs()).max(d.distance - room);
                assert!(worst[0] < limits[0], "{i} {j} {k}: {} and {room}", d.distance);
                for (shape, X, p) in [(a, &poses[0], d.point_a), (b, &poses[1], d.point_b)] {
                    let x = X.rotation.inverse() * (p - X.position);
                    worst[1] = worst[1].max(outside(shape, &x, &mut rng));
                    assert!(worst[1] < limits[1], "{i} {j} {k}: {worst:?} {x:?} {d:?}");
                }
                // Padding is subtracted, and the pair is symmetric.
                probe.set_padding(ia, 0.3);
                let padded = probe.distance(&colliders, ia, ib, f64::INFINITY).unwrap();
                probe.set_padding(ia, 0.0);
                assert!(
                    (padded.distance + 0.3 - d.distance).abs() < 2e-12,
                    "{i} {j} {k} {} {}",
                    padded.distance,
                    d.distance
                );
                let other = probe.distance(&colliders, ib, ia, f64::INFINITY).unwrap();
                assert!(
                    (other.distance - d.distance).abs() < limits[0],
                    "{i} {j} {k} {other:?} {d:?}"
                );
            }
            least = least.min(apart);
        }
    }
    println!("distances and ends, m: cylinders {:?}, others {:?}; {least}", worst[0], worst[1]);
    assert!(least > 20, "{least}");
}

/// Every query is the first of a separate probe: memory is complete at set-up, whatever the shapes. Surfaces of many triangles, a face of many
/// corners, deep overlaps.
#[test]
fn no_question_allocates() {
    let mut rng = Random(17);
    let heights = |n: i32| (0..n * n).map(|i| 0.05 * (f64::from(i) * 0.7).sin()).collect();
    let field = |n: i32| Shape::HeightField {
        x: n as usize,
        y: n as usize,
        spacing: [2.0 / f64::from(n - 1); 2],
        heights: heights(n),
    };
    let n = 300;
    let rim = (0..n).map(|k| f64::from(k) * std::f64::consts::TAU / f64::from(n));
    let disc = rim.flat_map(|t| [0.0, 0.3].map(|z| Vec3::new(0.6 * t.cos(), 0.6 * t.sin(), z)));
    // The surface is a pleated sheet: most of its triangles pass through any shape that lies on it.
    let w = 14;
    let at = |i: u32| {
        let x = |k: u32| f64::from(k) / 6.5 - 1.0;
        Vec3::new(x(i % w), x(i / w), 0.2 * f64::from(i % w % 2))
    };
    let sheet = Shape::Mesh {
        vertices: (0..w * w).map(at).collect(),
        triangles: (0..(w - 1) * (w - 1))
            .map(|c| c / (w - 1) * w + c % (w - 1))
            .flat_map(|i| [[i, i + 1, i + w], [i + 1, i + w + 1, i + w]])
            .collect(),
    };
    let mut shapes = support::convex_shapes();
    shapes.extend([
        Shape::ConvexHull { points: disc.collect() },
        Shape::HalfSpace,
        support::box_mesh(Vec3::new(0.4, 0.5, 0.3)),
        sheet,
        field(14),
        Shape::PointCloud { points: vec![[0.0, 0.0, 0.0, 0.05], [0.3, 0.1, 0.2, 0.0]], room: 8 },
        Shape::VoxelMap { cells: [8; 3], edge: 0.1, occupied: vec![[1, 2, 3], [4, 4, 4]] },
    ]);
    let bodies = support::free_bodies(2);
    let [first, second] = ["a00", "a01"].map(|b| bodies.body(b));
    let (mut out, mut all) = (Vec::with_capacity(4), Vec::with_capacity(4));
    let mut hits = 0;
    for (i, a) in shapes.iter().enumerate() {
        for (j, b) in shapes.iter().enumerate().skip(i) {
            let specs = vec![
                ColliderSpec::new("a", "a00", a.clone()),
                ColliderSpec::new("b", "a01", b.clone()),
            ];
            let colliders = Colliders::new(specs, Rules::default(), &bodies).unwrap();
            let [ia, ib] = ["a", "b"].map(|n| colliders.find(n).unwrap());
            let surface = |s: &Shape| matches!(s, Shape::Mesh { .. } | Shape::HeightField { .. });
            // Test fewer poses of two surfaces, because comparing every triangle with every other
            // is slow.
            let both = surface(a) && surface(b);
            for k in 0..if both { 2 } else { 8 } {
                let poses = match k {
                    0 => [Pose::identity(), Pose::translation(1e-3, 2e-3, 0.1)],
                    _ => [rng.pose(0.3), rng.pose(0.3)],
                };
                let place = |probe: &mut Probe| {
                    probe.place(&colliders, |of| {
                        let which = [first, second].iter().position(|b| *b == of);
                        which.map_or(Pose::identity(), |w| poses[w])
                    });
                };
                let ask = |what: &str, question: &mut dyn FnMut(&mut Probe)| {
                    let mut probe = Probe::new(&colliders);
                    place(&mut probe);
                    let counted = allocation_counter::measure(|| question(&mut probe));
                    let message = format!("{what} of {i} and {j}, {k}: {counted:?}");
                    assert_eq!(counted.count_total, 0, "{message}");
                };
                ask("yes or no", &mut |p| {
                    hits += usize::from(p.first_hit(&colliders).is_some());
                });
                ask("hits", &mut |p| p.hits(&colliders, &mut out));
                let limit = if both { 0.01 } else { f64::INFINITY };
                ask("nearest", &mut |p| {
                    p.closest(&colliders, limit);
                });
                ask("distances", &mut |p| p.distances(&colliders, limit, &mut all));
                ask("distance", &mut |p| {
                    p.distance(&colliders, ia, ib, limit);
                });
            }
        }
    }
    assert!(hits > 300, "{hits}");
}
