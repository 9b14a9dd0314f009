//! The short ways against the general one, triangle by triangle: the same points, where the answer is one.

use super::{SHALLOW, TOUCH, Tile, general, short};
use crate::core::{Core, Placed};
use crate::manifold::{EQUAL, Point, Room, SLACK, least};
use crate::shape::Shape;
use crate::solid::{Kind, Solid};
use crate::surface::{LEAN, Surface};
use linkwork_multibody::spatial::nalgebra::Quaternion;
use linkwork_multibody::spatial::{Pose, Quat, Vec3};

/// SplitMix64.
struct Random(u64);

impl Random {
    fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn vec(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }

    fn rotation(&mut self) -> Quat {
        let (v, w) = (self.vec(), self.signed());
        Quat::from_quaternion(Quaternion::new(w, v.x, v.y, v.z))
    }
}

fn solids() -> Vec<Shape> {
    let mut r = Random(5);
    let points = (0..14).map(|_| r.vec().component_mul(&Vec3::new(0.2, 0.15, 0.12))).collect();
    vec![
        Shape::Cylinder { radius: 0.1, half_length: 0.06 },
        Shape::Cylinder { radius: 0.13, half_length: 0.015 },
        Shape::Cylinder { radius: 0.05, half_length: 0.25 },
        Shape::Capsule { radius: 0.08, half_length: 0.15 },
        Shape::Box { half: Vec3::new(0.2, 0.09, 0.06) },
        Shape::ConvexHull { points },
    ]
}

/// Height fields: flat, waves, stones; and a mesh made of stones.
fn grounds() -> Vec<Shape> {
    let (x, y, spacing) = (41, 37, [0.1, 0.12]);
    let field = |height: &mut dyn FnMut(f64, f64) -> f64| Shape::HeightField {
        x,
        y,
        spacing,
        heights: (0..x * y)
            .map(|k| height((k % x) as f64 * spacing[0], (k / x) as f64 * spacing[1]))
            .collect(),
    };
    let mut r = Random(9);
    let mut stones = |size: f64| field(&mut |_, _| size * r.signed());
    let mut all = vec![stones(0.0), stones(0.02), stones(0.1)];
    let rough = all[1].clone();
    all.push(field(&mut |x, y| 0.1 * (1.0 + 0.5 * (2.0 * x).sin() + 0.5 * (1.7 * y + x).sin())));
    let Shape::HeightField { heights, .. } = rough else { return all };
    let at = |k: usize| {
        Vec3::new((k % x) as f64 * spacing[0] - 2.0, (k / x) as f64 * spacing[1] - 2.2, heights[k])
    };
    let vertices = (0..x * y).map(at).collect();
    let cells = (0..y - 1).flat_map(|j| (0..x - 1).map(move |i| (j * x + i) as u32));
    let w = x as u32;
    let triangles = cells.flat_map(|k| [[k, k + 1, k + w], [k + 1, k + w + 1, k + w]]).collect();
    all.push(Shape::Mesh { vertices, triangles });
    all
}

fn surface(shape: &Shape) -> Solid {
    Solid::new(shape).unwrap()
}

struct Case<'a> {
    tiles: Vec<Tile<'a>>,
    k: usize,
    core: Placed<'a>,
    limit: f64,
    size: f64,
}

/// Every triangle near cores that touch surfaces or nearly do: some lie, some stand, some are anyhow.
fn each(count: usize, visit: &mut impl FnMut(&Case, &mut Room)) {
    let mut r = Random(1);
    let mut room = Room::default();
    for ground in grounds() {
        let solid = surface(&ground);
        let Kind::Surface(s) = &solid.kind else { panic!("a surface") };
        for shape in solids() {
            let solid = surface(&shape);
            let Kind::Convex { core, round } = &solid.kind else { panic!("convex") };
            room.behind = *round;
            for k in 0..count {
                let quarter = Quat::from_euler_angles(std::f64::consts::FRAC_PI_2, 0.0, 0.0);
                let some = Quat::from_scaled_axis(r.vec() * 0.1);
                let turn = match k % 3 {
                    0 => r.rotation(),
                    1 => some * Quat::from_euler_angles(0.0, 0.0, 3.0 * r.signed()) * quarter,
                    _ => some,
                };
                let place = 1.5 * r.vec();
                let gap = [1e-3, -1e-3, -1e-4][k % 3] * (1.0 + r.signed()) + round;
                let start = Pose::new(turn, Vec3::new(place.x, place.y, 0.4));
                let X = brought(s, core, start, gap, solid.size, &mut room);
                let core = Placed::at(core, &X);
                let limit = [0.001, 0.01][k % 2] + round;
                let reach = Vec3::repeat(solid.size + limit);
                let mut list = Vec::new();
                s.near(&(X.position - reach), &(X.position + reach), &mut list);
                let tiles = list.iter().map(|i| Tile::new(s, *i)).collect();
                visit(&Case { tiles, core, limit, size: solid.size, k }, &mut room);
            }
        }
    }
}

/// The pose moved along the normal of its deepest contact until that has a gap.
fn brought(s: &Surface, core: &Core, X: Pose, gap: f64, size: f64, room: &mut Room) -> Pose {
    let (mut X, mut list) = (X, Vec::new());
    for _ in 0..3 {
        let reach = Vec3::repeat(2.0 * size);
        s.near(&(X.position - reach), &(X.position + reach), &mut list);
        room.points.clear();
        for i in &list {
            general(&Tile::new(s, *i), &Placed::at(core, &X), size, size, room);
        }
        let deepest = room.points.iter().min_by(|p, q| p.gap.total_cmp(&q.gap));
        let down = |p: &Point| p.n * (gap - p.gap);
        X.position += deepest.map_or(Vec3::z() * -size, down);
    }
    X
}

fn same(p: &Point, q: &Point) -> bool {
    (p.gap - q.gap).abs() < 1e-9 && (p.n - q.n).norm() < 1e-7 && (p.pb - q.pb).norm() < 1e-7
}

#[test]
fn whole() {
    let (mut told, mut left, mut cases, mut differ, mut normals) = (0, 0, 0, 0, 0);
    each(300, &mut |c, room| {
        room.points.clear();
        for t in &c.tiles {
            general(t, &c.core, c.limit, c.size, room);
        }
        let theirs = std::mem::take(&mut room.points);
        for t in &c.tiles {
            let from = room.points.len();
            if short(t, &c.core, c.limit, c.size, room).is_none() {
                room.points.truncate(from);
                general(t, &c.core, c.limit, c.size, room);
                left += 1;
            } else {
                told += 1;
            }
        }
        cases += 1;
        let low = |p: &[Point]| p.iter().min_by(|p, q| p.gap.total_cmp(&q.gap)).copied();
        let (p, q) = (low(&room.points), low(&theirs));
        let name = match c.core.core {
            Core::Cylinder { r, h } => format!("cyl {r} {h}"),
            Core::Segment { .. } => "seg".into(),
            _ => "poly".into(),
        };
        match (p, q) {
            (Some(p), Some(q)) => {
                if (p.gap - q.gap).abs() > 1e-9 {
                    differ += 1;
                    println!(
                        "{} {name}: ours {:.3e} theirs {:.3e} diff {:.3e} names {} {} n {:.4}",
                        c.k,
                        p.gap,
                        q.gap,
                        p.gap - q.gap,
                        p.name % 1000,
                        q.name % 1000,
                        (p.n - q.n).norm()
                    );
                } else if (p.n - q.n).norm() > 1e-6 {
                    normals += 1;
                }
            }
            (None, None) => {}
            (p, q) => {
                differ += 1;
                println!(
                    "{} {name}: ours {:?} theirs {:?}",
                    c.k,
                    p.map(|p| p.gap),
                    q.map(|p| p.gap)
                );
            }
        }
    });
    println!(
        "{told} told, {left} left to the general way, {cases} cases, {normals} normals, {differ} differ"
    );
    let _ = (SHALLOW, TOUCH, EQUAL, SLACK, LEAN, least(&[]), same);
}
