//! The short ways against the general one: the same gaps and points, where the answer is one.
#![allow(clippy::unwrap_used)]

use super::{TOUCH, Tile, general, short};
use crate::contact_points::{Point, Room};
use crate::core::{Core, Placed};
use crate::pairs::{Want, surface};
use crate::shape::Shape;
use crate::solid::{Kind, Solid};
use crate::surface::Surface;
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

/// A core at a place near a surface.
struct Case<'a> {
    surface: &'a Surface,
    tiles: Vec<Tile<'a>>,
    core: Placed<'a>,
    limit: f64,
    size: f64,
}

impl std::fmt::Debug for Case<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "size {} at {:?}, {:?}", self.size, self.core.p, self.core.R)
    }
}

/// Every triangle near cores that touch surfaces or nearly do: some lie, some stand, some are anyhow.
fn each(count: usize, visit: &mut impl FnMut(&Case, &mut Room)) {
    let mut r = Random(1);
    let mut room = Room::default();
    for ground in grounds() {
        let solid = Solid::new(&ground).unwrap();
        let Kind::Surface(s) = &solid.kind else { panic!("a surface") };
        for shape in solids() {
            let solid = Solid::new(&shape).unwrap();
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
                let case = Case { surface: s, tiles, core, limit, size: solid.size };
                visit(&case, &mut room);
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

fn deepest(points: &[Point]) -> Option<&Point> {
    points.iter().min_by(|p, q| p.gap.total_cmp(&q.gap))
}

/// What a normal shows between a triangle and a core: never more than their distance.
fn separation(t: &Tile, b: &Placed, n: &Vec3) -> f64 {
    b.range(n).0 - t.facet.v.iter().fold(f64::NEG_INFINITY, |m, v| m.max(v.dot(n)))
}

/// The smallest gap of a pose, over all triangles. The two ways may differ only where the short one is shown to be right: apart, its normal shows its
/// gap, and more than the general way's gap where that is from; overlapping, it says no less than the general way.
#[test]
fn short_ways_agree_with_the_general_one() {
    let (mut cases, mut touching, mut differ) = (0, 0, 0);
    each(150, &mut |c, room| {
        room.points.clear();
        for t in &c.tiles {
            general(t, &c.core, c.limit, c.size, room);
        }
        let theirs = std::mem::take(&mut room.points);
        surface(c.surface, &c.core, (c.limit, c.size, Want::All), room);
        cases += 1;
        let (Some(p), Some(q)) = (deepest(&room.points), deepest(&theirs)) else {
            // If the general method has no contacts, a shape under the terrain is pushed up as a whole.
            assert!(theirs.is_empty() && room.points.iter().all(|p| p.gap < 0.0), "{c:?}");
            return;
        };
        touching += 1;
        assert!((p.n.norm() - 1.0).abs() < 1e-12 && (p.pb - p.pa - p.n * p.gap).norm() < 1e-9);
        if (p.gap - q.gap).abs() < 1e-9 {
            return;
        }
        differ += 1;
        println!("{} instead of {} in {c:?}", p.gap, q.gap);
        if p.gap < 0.0 {
            assert!(p.gap <= q.gap && q.gap < 0.0);
        } else {
            let shows = |t: &&Tile, gap: f64| (separation(t, &c.core, &p.n) - gap).abs() < 1e-9;
            let (p, q) = (*p, *q);
            assert!(p.gap > q.gap && c.tiles.iter().any(|t| shows(&t, p.gap)), "{p:?} {q:?}");
            // For the triangle from which the general method takes its contact, the normal of the
            // short method has a greater separation.
            let from_it = |t: &&Tile| {
                room.points.clear();
                general(t, &c.core, c.limit, c.size, room);
                deepest(&room.points).is_some_and(|r| (r.gap - q.gap).abs() < 1e-12)
            };
            let mut its = c.tiles.iter().filter(from_it);
            assert!(its.all(|t| separation(t, &c.core, &p.n) > q.gap + 1e-10), "{p:?} {q:?}");
        }
    });
    println!("{differ} of {touching} differ");
    assert!(cases == 4500 && touching > 1000, "{touching}");
    assert!(differ * 200 < touching, "{differ} of {touching}");
}

/// Triangle by triangle and point by point, where the triangle's own normal or none is the answer of both; and the general way is seldom needed.
#[test]
fn points_over_triangles_are_those_of_the_general_way() {
    let (mut told, mut left, mut compared) = (0, 0, 0);
    each(20, &mut |c, room| {
        for t in &c.tiles {
            room.points.clear();
            general(t, &c.core, c.limit, c.size, room);
            let theirs = std::mem::take(&mut room.points);
            if short(t, &c.core, c.limit, c.size, room).is_none() {
                left += usize::from(!theirs.is_empty());
                continue;
            }
            told += usize::from(!theirs.is_empty());
            let own = |p: &Point| p.n.dot(&t.facet.n) > 1.0 - 1e-14;
            let ours = &room.points;
            if !theirs.iter().all(own) || !ours.iter().all(own) {
                continue;
            }
            let within = |p: &Point, all: &[Point]| {
                all.iter().any(|q| (p.gap - q.gap).abs() < 1e-9 && (p.pb - q.pb).norm() < 1e-9)
            };
            // Points behind the plane by less than this may count as touching: the general method leaves them out if none is deeper.
            let slight = |p: &Point| (-TOUCH * c.size..0.0).contains(&p.gap);
            compared += ours.len();
            assert!(ours.iter().all(|p| within(p, &theirs) || slight(p)), "{ours:?} {theirs:?}");
            assert!(theirs.iter().all(|p| within(p, ours)), "{ours:?} {theirs:?}");
        }
    });
    println!("{told} told, {left} left, {compared} points compared");
    assert!(compared > 1000 && told > 500, "{told} {left} {compared}");
}

/// Holes, and the blocks that tell where nothing is high enough, leave the same triangles as looking at each.
#[test]
fn a_field_with_holes_gives_the_triangles_that_a_box_meets() {
    let (x, y, spacing) = (53, 41, [0.1, 0.2]);
    let mut r = Random(5);
    let heights: Vec<f64> = (0..x * y)
        .map(|k| if r.signed() > 0.9 { f64::NAN } else { 0.5 * r.signed() + (k / x) as f64 * 0.05 })
        .collect();
    let shape = Shape::HeightField { x, y, spacing, heights: heights.into() };
    let solid = Solid::new(&shape).unwrap();
    let Kind::Surface(s) = &solid.kind else { panic!("a surface") };
    let count = 2 * (x - 1) * (y - 1);
    let (mut near, mut kept, mut some, mut none) = (Vec::new(), Vec::new(), 0, 0);
    for _ in 0..2000 {
        let middle = Vec3::new(2.8 * r.signed(), 4.2 * r.signed(), 1.0 + 1.4 * r.signed());
        let half = Vec3::new(r.signed().abs(), r.signed().abs(), 0.3 * r.signed().abs());
        let (lo, hi) = (middle - half, middle + half);
        near.clear();
        s.near(&lo, &hi, &mut near);
        s.near_if(&lo, &hi, |_| false, |_, _| true, &mut kept);
        assert_eq!(near, kept);
        // Every whole triangle that reaches the box is found, and no hole is.
        for i in 0..count as u32 {
            let v = s.facet(i).v;
            let whole = v.iter().all(|p| !p.z.is_nan());
            let inside = (0..2).all(|k| v.iter().all(|p| p[k] >= lo[k] && p[k] <= hi[k]));
            if !whole {
                assert!(!near.contains(&i), "{i}");
            } else if inside && v.iter().any(|p| p.z >= lo.z) {
                assert!(near.contains(&i), "{i}");
            }
        }
        if near.is_empty() { none += 1 } else { some += 1 }
    }
    assert!(some > 500 && none > 200, "{some} {none}");
    // A triangle next to a hole has a border there, and a ray through a hole hits nothing.
    let (mut borders, mut through) = (0, 0);
    for i in 0..count as u32 {
        let t = s.facet(i);
        if t.v.iter().any(|p| p.z.is_nan()) {
            let at = (t.v[0] + t.v[1] + t.v[2]) / 3.0;
            let hit = s.cast(&Vec3::new(at.x, at.y, 9.0), &-Vec3::z(), 20.0);
            through += usize::from(hit.is_none());
            continue;
        }
        borders += (0..3).filter(|k| s.lean(i, &t, *k, &t.across(*k)) == 1.0).count();
    }
    assert!(through > 100 && borders > 100, "{through} {borders}");
}
