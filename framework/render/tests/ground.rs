//! Height maps compared with all their triangles and with the collision layer (parry), and with paths that are difficult for grids.

use linkwork_render::collision::{Shape, Target};
use linkwork_render::spatial::{Pose, Quat, Vec3};
use linkwork_render::*;
use std::sync::Arc;

/// Numbers from 0 to 1 with a fixed seed.
struct Random(u64);
impl Random {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.next()
    }
    fn vector(&mut self, s: f64) -> Vec3 {
        Vec3::new(self.between(-s, s), self.between(-s, s), self.between(-s, s))
    }
}

const N: [usize; 2] = [37, 29];
const SPACING: [f64; 2] = [0.3, 0.45];

fn heights(random: &mut Random) -> Vec<f32> {
    (0..N[0] * N[1]).map(|_| random.between(-0.6, 0.6) as f32).collect()
}

fn scene(heights: Vec<f32>) -> Scene {
    let origin = [0, 1].map(|k| -0.5 * (N[k] - 1) as f64 * SPACING[k]);
    let mut scene = Scene::new(Light::default());
    let map =
        HeightMap::new(Surface { origin, spacing: SPACING, nx: N[0], ny: N[1], heights }).unwrap();
    scene.set_ground(Arc::new(map), Look::plain([0.5; 3])).unwrap();
    scene
}

/// Returns the nearest hit of all triangles (Möller–Trumbore), and whether it is within 1e-7 of an edge in any of them.
fn brute(heights: &[f32], o: &Vec3, d: &Vec3) -> Option<f64> {
    let at = |i: usize, j: usize| {
        let xy = [i, j];
        let p = [0, 1].map(|k| (xy[k] as f64 - 0.5 * (N[k] - 1) as f64) * SPACING[k]);
        Vec3::new(p[0], p[1], f64::from(heights[j * N[0] + i]))
    };
    let mut best: Option<f64> = None;
    for j in 0..N[1] - 1 {
        for i in 0..N[0] - 1 {
            let [a, b, c, e] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            for t in [[a, b, c], [a, c, e]] {
                if [a, b, c, e].iter().any(|p| p.z.is_nan()) {
                    continue;
                }
                let (e1, e2) = (t[1] - t[0], t[2] - t[0]);
                let h = d.cross(&e2);
                let s = o - t[0];
                let q = s.cross(&e1);
                let det = e1.dot(&h);
                let (u, v, s) = (s.dot(&h) / det, d.dot(&q) / det, e2.dot(&q) / det);
                let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && s >= 0.0;
                if inside && best.is_none_or(|b| s < b) {
                    best = Some(s);
                }
            }
        }
    }
    best
}

fn rays(random: &mut Random, count: usize) -> Vec<(Vec3, Vec3)> {
    (0..count)
        .map(|_| {
            let o = Vec3::new(
                random.between(-9.0, 9.0),
                random.between(-9.0, 9.0),
                random.between(-2.0, 3.0),
            );
            let at = Vec3::new(
                random.between(-6.0, 6.0),
                random.between(-7.0, 7.0),
                random.between(-0.6, 0.6),
            );
            (o, (at - o).normalize())
        })
        .collect()
}

#[test]
fn every_ray_meets_the_first_of_all_triangles() {
    let mut random = Random(5);
    for holes in [false, true] {
        let mut heights = heights(&mut random);
        if holes {
            (0..60).for_each(|k| heights[k * 17 % (N[0] * N[1])] = f32::NAN);
        }
        let scene = scene(heights.clone());
        let mut hits = 0;
        for (o, d) in rays(&mut random, 4000) {
            let (got, want) = (scene.cast(&o, &d, FAR), brute(&heights, &o, &d));
            match (got, want) {
                (Some(got), Some(want)) => {
                    assert!((got.distance - want).abs() < 1e-6, "{o} {d}: {} {want}", got.distance);
                    assert!(got.normal.dot(&d) <= 0.0 && (got.normal.norm() - 1.0).abs() < 1e-12);
                    hits += 1;
                }
                (None, None) => {}
                _ => panic!("{o} {d}: {got:?} {want:?}"),
            }
        }
        assert!(hits > 1500, "{hits}");
    }
}

#[test]
fn rays_along_the_lines_of_the_grid_and_straight_down_find_no_crack() {
    let mut random = Random(11);
    let scene = scene(heights(&mut random));
    let half = [0, 1].map(|k| 0.5 * (N[k] - 1) as f64 * SPACING[k]);
    // Cast rays straight down onto nodes, edges and diagonals, over the whole map without holes.
    for j in 0..=4 * (N[1] - 1) {
        for i in 0..=4 * (N[0] - 1) {
            let p = [i as f64 / 4.0 * SPACING[0] - half[0], j as f64 / 4.0 * SPACING[1] - half[1]];
            let p = [0, 1].map(|k| p[k].clamp(-half[k], half[k]));
            let hit = scene.cast(&Vec3::new(p[0], p[1], 5.0), &-Vec3::z(), FAR);
            assert!(hit.is_some(), "{p:?}");
        }
    }
    // Rays in the vertical plane of a grid line, from above the terrain to below it, must always hit.
    for k in 0..2000 {
        let line = (k % (N[0] - 2) + 1) as f64 * SPACING[0] - half[0];
        let (a, b) = (random.between(-5.5, 5.5), random.between(-5.5, 5.5));
        let (o, to) = (Vec3::new(line, a, 1.5), Vec3::new(line, b, -1.5));
        let d = (to - o).normalize();
        let hit = scene.cast(&o, &d, FAR).unwrap();
        assert!(hit.distance < (to - o).norm());
    }
}

#[test]
fn the_collision_floor_meets_the_same_ground() {
    let mut random = Random(23);
    let heights = heights(&mut random);
    let scene = scene(heights.clone());
    let same = Target::new(&Shape::HeightField {
        x: N[0],
        y: N[1],
        spacing: SPACING,
        heights: heights.iter().map(|h| f64::from(*h)).collect(),
    })
    .unwrap();
    for (o, d) in rays(&mut random, 4000) {
        let (got, want) = (scene.cast(&o, &d, FAR), same.cast(&o, &d, FAR));
        assert_eq!(got.is_some(), want.is_some(), "{o} {d}");
        if let (Some(got), Some((t, _))) = (got, want) {
            assert!((got.distance - t).abs() < 1e-6, "{o} {d}: {} {t}", got.distance);
        }
    }
}

/// Compares the tree over objects with each object alone, including meshes with parry.
#[test]
fn the_tree_of_objects_gives_the_nearest_of_them() {
    let mut random = Random(31);
    let mut scene = Scene::new(Light::default());
    let corners: Vec<Vec3> = (0..12).map(|_| random.vector(0.5)).collect();
    let triangles: Vec<[u32; 3]> = (0..10).map(|k| [k, k + 1, k + 2]).collect();
    let shapes = [
        Shape::Mesh { vertices: corners.clone(), triangles },
        Shape::ConvexHull { points: corners },
        Shape::Box { half: Vec3::new(0.2, 0.4, 0.3) },
        Shape::Sphere { radius: 0.4 },
        Shape::Capsule { radius: 0.2, half_length: 0.3 },
        Shape::Cylinder { radius: 0.2, half_length: 0.3 },
    ];
    let targets: Vec<Target> = shapes.iter().map(|s| Target::new(s).unwrap()).collect();
    let mut poses = vec![];
    for k in 0..120 {
        let X = Pose::new(Quat::from_scaled_axis(random.vector(2.0)), random.vector(5.0));
        let id = scene.add("x", &shapes[k % 6], Look::plain([0.5; 3]), Pose::identity()).unwrap();
        scene.set_pose(id, X).unwrap();
        poses.push(X);
    }
    scene.settle();
    let mut hits = 0;
    for _ in 0..5000 {
        let o = random.vector(7.0);
        let d = (random.vector(4.0) - o).normalize();
        let each = poses.iter().enumerate().filter_map(|(k, X)| {
            let back = X.inverse();
            let (t, _) =
                targets[k % 6].cast(&back.transform_point(&o), &back.transform_vector(&d), FAR)?;
            Some((t, k as u16 + 2))
        });
        let want = each.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let got = scene.cast(&o, &d, FAR).map(|h| (h.distance, h.object));
        assert_eq!(got, want, "{o} {d}");
        hits += usize::from(got.is_some());
    }
    assert!(hits > 1000, "{hits}");
}
