//! Time of one query for all contact points: `cargo bench -p linkwork-collision`.
#![allow(non_snake_case, clippy::unwrap_used)]

#[path = "../tests/support/mod.rs"]
mod support;

use divan::Bencher;
use divan::counter::ItemsCount;
use linkwork_collision::multibody::spatial::{Pose, Quat, Vec3};
use linkwork_collision::*;
use support::*;

fn main() {
    divan::main();
}

fn run(bencher: Bencher, mut s: Scene, poses: Vec<Pose>, margin: f64) {
    let mut out = Vec::new();
    s.colliders.contacts(&mut s.scratch, &Query::margin(margin), at(&poses), &mut out);
    println!("{} points", out.len());
    bencher.bench_local(|| {
        s.colliders.contacts(&mut s.scratch, &Query::margin(margin), at(&poses), &mut out);
        out.len()
    });
}

/// Twenty boxes in four layers, each slightly rotated and overlapping with its neighbours.
fn pile(ground: Shape) -> (Scene, Vec<Pose>) {
    let mut r = Random(11);
    let mut shapes = vec![ground];
    let mut poses = vec![Pose::identity()];
    for i in 0..20 {
        let (layer, place) = (i / 5, f64::from(i % 5));
        shapes.push(cube(0.1));
        let turn = Quat::from_scaled_axis(r.vec() * 1e-3 + Vec3::z() * 0.1 * r.signed());
        let shift = if layer % 2 == 0 { 0.0 } else { 0.1 };
        poses.push(Pose::new(
            turn,
            Vec3::new(0.24 * place + shift, 0.01 * r.signed(), 0.0995 + 0.1995 * f64::from(layer)),
        ));
    }
    (scene(&shapes), poses)
}

#[divan::bench]
fn twenty_boxes_in_a_pile_on_a_plane(bencher: Bencher) {
    let (s, X) = pile(Shape::HalfSpace);
    run(bencher, s, X, 0.002);
}

#[divan::bench]
fn twenty_boxes_in_a_pile_on_a_mesh(bencher: Bencher) {
    let (s, mut X) = pile(box_mesh(Vec3::new(3.0, 3.0, 0.5)));
    X[0] = Pose::translation(0.0, 0.0, -0.5);
    run(bencher, s, X, 0.002);
}

fn two(bencher: Bencher, a: Shape, b: Shape, X: Pose) {
    let mut s = scene(&[a, b]);
    let mut poses = vec![Pose::identity(), X];
    // Adjust to half a millimetre of overlap.
    let points = s.contacts(1.0, &poses);
    let c = deepest(&points).unwrap();
    poses[1].position -= c.normal * (c.gap + 5e-4);
    run(bencher, s, poses, 0.002);
}

#[divan::bench]
fn box_on_box(bencher: Bencher) {
    two(
        bencher,
        cube(0.1),
        cube(0.1),
        Pose::new(Quat::from_euler_angles(1e-3, 2e-3, 0.3), Vec3::new(0.03, 0.02, 0.1995)),
    );
}

#[divan::bench]
fn hull_on_hull(bencher: Bencher) {
    let hull = convex_shapes().pop().unwrap();
    two(
        bencher,
        hull.clone(),
        hull,
        Pose::new(Quat::from_euler_angles(1e-3, 2e-3, 0.3), Vec3::new(0.03, 0.02, 0.9)),
    );
}

#[divan::bench]
fn lying_cylinder_on_box(bencher: Bencher) {
    let wheel = Shape::Cylinder { radius: 0.25, half_length: 0.1 };
    let slab = Shape::Box { half: Vec3::new(2.0, 2.0, 0.1) };
    two(
        bencher,
        slab,
        wheel,
        Pose::new(Quat::from_euler_angles(0.0, 1.57, 0.3), Vec3::new(0.03, 0.02, 0.3495)),
    );
}

/// A height field with waves of 2 cm.
fn waves() -> Shape {
    let n = 101;
    let heights = (0..n * n)
        .map(|i| 0.02 * ((i % n) as f64 * 0.7).sin() * ((i / n) as f64 * 0.5).cos())
        .collect();
    Shape::HeightField { x: n, y: n, spacing: [0.1, 0.1], heights }
}

fn lying(height: f64) -> Pose {
    Pose::new(Quat::from_euler_angles(0.0, 1.57, 0.3), Vec3::new(0.03, 0.02, height))
}

#[divan::bench]
fn wheel_on_terrain(bencher: Bencher) {
    two(bencher, waves(), Shape::Cylinder { radius: 0.25, half_length: 0.1 }, lying(0.255));
}

#[divan::bench]
fn capsule_on_terrain(bencher: Bencher) {
    two(bencher, waves(), Shape::Capsule { radius: 0.1, half_length: 0.2 }, lying(0.105));
}

#[divan::bench]
fn box_on_terrain(bencher: Bencher) {
    let half = Vec3::new(0.1, 0.2, 0.15);
    two(bencher, waves(), Shape::Box { half }, lying(0.105));
}

/// The six wheels of a rover on waves, at positions where each penetrates by 50 µm; the argument is the margin in mm. An item is a wheel.
#[divan::bench(args = [1, 10])]
fn wheels_on_waves(bencher: Bencher, margin_mm: u32) {
    let (wheels, n, d) = (6, 81, 0.1);
    let height = |i: usize, j: usize| {
        let (x, y) = (d * i as f64 - 4.0, d * j as f64 - 4.0);
        0.1 * (1.0 + 0.5 * (2.0 * x).sin() + 0.5 * (1.7 * y + x).sin())
    };
    let heights = (0..n * n).map(|k| height(k % n, k / n)).collect();
    let field = Shape::HeightField { x: n, y: n, spacing: [d, d], heights };
    let wheel = Shape::Cylinder { radius: 0.1, half_length: 0.06 };
    let mut alone = scene(&[field.clone(), wheel.clone()]);
    let mut r = Random(17);
    let mut sets = Vec::new();
    for _ in 0..20 {
        let mut poses = vec![Pose::identity()];
        for _ in 0..wheels {
            let turn = Quat::from_euler_angles(0.0, 0.0, 3.0 * r.signed())
                * Quat::from_euler_angles(1.57 + 0.1 * r.signed(), 0.0, 0.0)
                * Quat::from_euler_angles(0.0, 0.0, 3.0 * r.signed());
            let place = Vec3::new(3.0 * r.signed(), 3.0 * r.signed(), 0.3);
            let mut X = [Pose::identity(), Pose::new(turn, place)];
            for _ in 0..3 {
                let points = alone.contacts(1.0, &X);
                let c = deepest(&points).unwrap();
                X[1].position -= c.normal * (c.gap + 5e-5);
            }
            poses.push(X[1]);
        }
        sets.push(poses);
    }
    let bodies = free_bodies(wheels + 1);
    let specs = (0..=wheels)
        .map(|i| {
            let shape = if i == 0 { field.clone() } else { wheel.clone() };
            let mut s = ColliderSpec::new(format!("a{i:02}"), format!("a{i:02}"), shape);
            (s.groups, s.collides_with) = if i == 0 { (2, 1) } else { (1, 2) };
            s
        })
        .collect();
    let mut s = scene_of(specs, bodies);
    let mut out = Vec::new();
    let margin = f64::from(margin_mm) * 1e-3;
    bencher.counter(ItemsCount::new(wheels * sets.len())).bench_local(|| {
        let mut points = 0;
        for poses in &sets {
            s.colliders.contacts(&mut s.scratch, &Query::margin(margin), at(poses), &mut out);
            points += out.len();
        }
        points
    });
}

#[divan::bench]
fn ball_on_terrain(bencher: Bencher) {
    let ball = Shape::Sphere { radius: 0.2 };
    two(bencher, waves(), ball, Pose::translation(0.03, 0.02, 0.2));
}
