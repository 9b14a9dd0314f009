//! Point clouds and voxel maps compared with the same spheres and cubes as separate colliders: every contact is found, and distances are those of the
//! nearest.

use crate::support::Random;
use linkwork_collision::multibody::spatial::{Pose, Vec3};
use linkwork_collision::multibody::{BodyId, BodySpec, Builder, Hinge};
use linkwork_collision::*;

const EDGE: f64 = 0.05;

fn cloud(rng: &mut Random, n: usize) -> Vec<[f64; 4]> {
    let one = |rng: &mut Random| {
        let p = rng.vec() * 0.5;
        [p.x, p.y, p.z, rng.between(0.0, 0.02)]
    };
    (0..n).map(|_| one(rng)).collect()
}

fn cells(rng: &mut Random, n: [usize; 3], count: usize) -> Vec<[u32; 3]> {
    let index = |rng: &mut Random, n: usize| (rng.between(0.0, 0.999_999) * n as f64) as u32;
    let mut all: Vec<_> = (0..count).map(|_| n.map(|n| index(rng, n))).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// A solid of pieces and its pieces one by one, all on body `many`.
fn pieces(name: &str, shape: &Shape) -> Vec<ColliderSpec> {
    let one = |k: usize, shape: Shape, p: Vec3| {
        ColliderSpec::new(format!("{name}{k:05}"), "many", shape)
            .at(Pose::translation(p.x, p.y, p.z))
    };
    match shape {
        Shape::PointCloud { points, .. } => (points.iter().enumerate())
            .map(|(k, p)| one(k, Shape::Sphere { radius: p[3] }, Vec3::new(p[0], p[1], p[2])))
            .collect(),
        Shape::VoxelMap { edge, occupied, .. } => (occupied.iter().enumerate())
            .map(|(k, c)| {
                let p = Vec3::from(c.map(|i| (f64::from(i) + 0.5) * edge));
                one(k, Shape::Box { half: Vec3::repeat(0.5 * edge) }, p)
            })
            .collect(),
        _ => unreachable!(),
    }
}

/// Shapes of robots and scenes.
fn others(rng: &mut Random) -> Vec<(&'static str, Shape)> {
    let hull = (0..20).map(|_| rng.unit() * 0.1).collect();
    let (a, b) = (0.2, 0.15);
    let vertices = vec![
        Vec3::new(a, 0.0, 0.0),
        Vec3::new(-a, b, 0.0),
        Vec3::new(-a, -b, 0.0),
        Vec3::new(0.0, 0.0, a),
    ];
    let heights = (0..20).map(|_| rng.between(-0.1, 0.1)).collect();
    let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    vec![
        ("ball", Shape::Sphere { radius: 0.07 }),
        ("box", Shape::Box { half: Vec3::new(0.2, 0.03, 0.06) }),
        ("capsule", Shape::Capsule { radius: 0.04, half_length: 0.15 }),
        ("cylinder", Shape::Cylinder { radius: 0.05, half_length: 0.12 }),
        ("hull", Shape::ConvexHull { points: hull }),
        ("mesh", Shape::Mesh { vertices, triangles }),
        ("ground", Shape::HalfSpace),
        ("terrain", Shape::HeightField { x: 5, y: 4, spacing: [0.3, 0.4], heights }),
    ]
}

/// A scene of `many`, a solid of pieces with its pieces, and of `other`.
fn scene(many: &Shape, other: &Shape) -> (Colliders, [BodyId; 2]) {
    let mut builder = Builder::new();
    for name in ["many", "other"] {
        builder.body(BodySpec::new(name, "world").hinge(Hinge::free()));
    }
    let multibody = builder.build().unwrap();
    let mut specs = pieces("piece", many);
    // Spheres without a radius are not pieces.
    specs.retain(|s| !matches!(s.fine, Shape::Sphere { radius } if radius <= 0.0));
    specs.push(ColliderSpec::new("all", "many", many.clone()));
    specs.push(ColliderSpec::new("one", "other", other.clone()));
    let colliders = Colliders::new(specs, Rules::default(), &multibody).unwrap();
    (colliders, ["many", "other"].map(|n| multibody.body(n).unwrap()))
}

/// Returns the smallest distance of the pieces, one by one.
fn brute(probe: &mut Probe, colliders: &Colliders, one: ColliderId) -> f64 {
    let all = colliders.find("all").unwrap();
    let pieces = colliders.ids().filter(|id| *id != all && *id != one);
    let each = pieces.filter_map(|id| probe.distance(colliders, id, one, f64::INFINITY));
    // A mesh does not detect bodies inside it.
    each.map(|d| d.distance).fold(f64::INFINITY, f64::min)
}

#[test]
fn answers_are_those_of_the_pieces_one_by_one() {
    let mut rng = Random(7);
    let n = [20, 17, 9];
    let points = cloud(&mut rng, 300);
    let occupied = cells(&mut rng, n, 150);
    let solids =
        [Shape::PointCloud { points, room: 0 }, Shape::VoxelMap { cells: n, edge: EDGE, occupied }];
    for many in &solids {
        for (name, other) in others(&mut rng) {
            let (colliders, [body, _]) = scene(many, &other);
            let [all, one] = ["all", "one"].map(|n| colliders.find(n).unwrap());
            let mut probe = Probe::new(&colliders);
            for id in colliders.ids().filter(|id| *id != all) {
                probe.set_meet(all, id, id == one);
            }
            // Hide the single pieces, so that only the pair of the whole and the other shape can be
            // hit.
            for id in colliders.ids().filter(|id| ![all, one].contains(id)) {
                probe.set_visibility(id, Visibility::Hidden);
            }
            let (mut hits, mut worst, mut found) = (0, 0.0_f64, Vec::new());
            for k in 0..120 {
                let poses = [rng.pose(2.0), rng.pose(if k < 60 { 1.0 } else { 0.4 })];
                // In the frame of the map, the other body is anywhere in and around the grid.
                let at = poses[0] * Pose::translation(0.25, 0.2, 0.1) * poses[1];
                let place = |b: Option<BodyId>| if b == Some(body) { poses[0] } else { at };
                probe.place(&colliders, place);
                let low = brute(&mut probe, &colliders, one);
                let Some(d) = probe.distance(&colliders, all, one, f64::INFINITY) else {
                    // The shape is entirely below a terrain, or inside a mesh.
                    assert!(low == f64::INFINITY && probe.first_hit(&colliders).is_none());
                    continue;
                };
                // Overlapping cylinders are solved by expanding polytopes, whose depth depends slightly on the frame.
                worst = worst.max((d.distance - low).abs());
                let between = d.point_b - d.point_a;
                assert!((between.norm() - d.distance.abs()).abs() < 1e-9, "{name}");
                assert_eq!(d.distance <= 0.0, low <= 0.0, "{name} {k}: {} {low}", d.distance);
                let hit = probe.first_hit(&colliders);
                assert_eq!(hit.is_some(), low <= 0.0, "{name} {k}: {hit:?} {low}");
                probe.hits(&colliders, &mut found);
                assert_eq!(found.len(), usize::from(low <= 0.0));
                hits += found.len();
                let closest = probe.closest(&colliders, f64::INFINITY).unwrap();
                assert!((closest.distance.distance - d.distance).abs() < 1e-12);
                // Padding is subtracted from the distance and turns a near miss into a hit, except for a mesh or
                // terrain, which also has more material behind the surface.
                if low > 1e-6 && low < 0.3 && !["mesh", "terrain"].contains(&name) {
                    probe.set_padding(one, 0.5 * low);
                    probe.set_padding(all, 0.5 * low * 1.000_001);
                    assert!(probe.first_hit(&colliders).is_some(), "{name} {k}");
                    probe.set_padding(all, 0.5 * low * 0.999_999);
                    assert!(probe.first_hit(&colliders).is_none(), "{name} {k}");
                    let left = probe.distance(&colliders, all, one, f64::INFINITY).unwrap();
                    assert!((left.distance - low * 0.5e-6).abs() < 1e-8, "{left:?} {low}");
                    probe.set_padding(all, 0.0);
                    probe.set_padding(one, 0.0);
                }
            }
            println!("{name}: {hits} of 120 hit, distances within {worst:.1e} m");
            assert!(hits > 5 && worst < 1e-6, "{name}: {hits} {worst}");
        }
    }
}

#[test]
fn two_of_them_meet_as_their_pieces_do() {
    let mut rng = Random(23);
    let n = [8, 9, 7];
    let small = Shape::PointCloud { points: cloud(&mut rng, 25), room: 0 };
    let map =
        |rng: &mut Random| Shape::VoxelMap { cells: n, edge: EDGE, occupied: cells(rng, n, 40) };
    let map = [map(&mut rng), map(&mut rng)];
    for (a, b) in [(&map[0], &small), (&small, &map[0]), (&map[0], &map[1])] {
        let mut builder = Builder::new();
        for name in ["many", "other"] {
            builder.body(BodySpec::new(name, "world").hinge(Hinge::free()));
        }
        let multibody = builder.build().unwrap();
        let mut specs = pieces("a", a);
        let more = pieces("b", b).into_iter();
        specs.extend(more.map(|s| ColliderSpec { body: "other".into(), ..s }));
        specs.push(ColliderSpec::new("x", "many", a.clone()));
        specs.push(ColliderSpec::new("y", "other", b.clone()));
        let colliders = Colliders::new(specs, Rules::default(), &multibody).unwrap();
        let [x, y] = ["x", "y"].map(|n| colliders.find(n).unwrap());
        let of = |c: char| {
            let named = |id: &ColliderId| colliders.spec(*id).name.starts_with(c);
            colliders.ids().filter(named).collect::<Vec<_>>()
        };
        let (of_a, of_b) = (of('a'), of('b'));
        let mut probe = Probe::new(&colliders);
        for id in of_a.iter().chain(&of_b) {
            probe.set_visibility(*id, Visibility::Hidden);
        }
        let body = multibody.body("many");
        let (mut hits, mut misses) = (0, 0);
        for _ in 0..40 {
            let poses = [rng.pose(1.0), rng.pose(0.25)];
            let place = |b: Option<BodyId>| if b == body { poses[0] } else { poses[0] * poses[1] };
            probe.place(&colliders, place);
            let mut low = f64::INFINITY;
            for i in &of_a {
                for j in &of_b {
                    let d = probe.distance(&colliders, *i, *j, f64::INFINITY).unwrap();
                    low = low.min(d.distance);
                }
            }
            let d = probe.distance(&colliders, x, y, f64::INFINITY).unwrap();
            assert!((d.distance - low).abs() < 1e-9, "{} {low}", d.distance);
            assert_eq!(probe.first_hit(&colliders).is_some(), low <= 0.0);
            if low <= 0.0 { hits += 1 } else { misses += 1 }
        }
        assert!(hits > 3 && misses > 3, "{hits} {misses}");
    }
}

/// Where numbers are exact, touching counts as a hit: faces on faces, on every side of a block's border.
#[test]
fn cells_that_touch_are_hits() {
    let edge = 0.25;
    for k in 0..10u32 {
        let map = Shape::VoxelMap { cells: [10; 3], edge, occupied: vec![[k, 5, 3]] };
        let (colliders, [body, _]) = scene(&map, &Shape::Box { half: Vec3::repeat(0.5) });
        let [all, one] = ["all", "one"].map(|n| colliders.find(n).unwrap());
        let mut probe = Probe::new(&colliders);
        probe.set_visibility(colliders.find("piece00000").unwrap(), Visibility::Hidden);
        let centre = Vec3::new(f64::from(k) + 0.5, 5.5, 3.5) * edge;
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                for (off, hit) in [(0.0, true), (1e-9, false)] {
                    let p = centre + Vec3::ith(axis, side * (0.5 + 0.5 * edge + off));
                    probe.place(&colliders, |b| {
                        if b == Some(body) {
                            Pose::identity()
                        } else {
                            Pose::translation(p.x, p.y, p.z)
                        }
                    });
                    assert_eq!(
                        probe.first_hit(&colliders).is_some(),
                        hit,
                        "{k} {axis} {side} {off}"
                    );
                    let d = probe.distance(&colliders, all, one, 1.0).unwrap();
                    assert!((d.distance - off).abs() < 1e-15, "{d:?}");
                }
            }
        }
    }
}

#[test]
fn contacts_and_rays_see_the_pieces() {
    let mut rng = Random(5);
    let n = [12, 10, 6];
    let solids = [
        Shape::PointCloud { points: cloud(&mut rng, 120), room: 0 },
        Shape::VoxelMap { cells: n, edge: EDGE, occupied: cells(&mut rng, n, 80) },
    ];
    for many in &solids {
        let (colliders, [body, _]) =
            scene(many, &Shape::Capsule { radius: 0.05, half_length: 0.1 });
        let all = colliders.find("all").unwrap();
        let one = colliders.find("one").unwrap();
        let mut scratch = Scratch::new(&colliders);
        let (mut points, mut seen, mut rays) = (Vec::new(), 0, 0);
        for _ in 0..200 {
            let (pose, at) = (rng.pose(1.0), rng.pose(0.5));
            let at = pose * Pose::translation(0.25, 0.25, 0.1) * at;
            let place = |b: Option<BodyId>| if b == Some(body) { pose } else { at };
            colliders.contacts(&mut scratch, &Query::margin(0.02), place, &mut points);
            let gaps = |of_all: bool| {
                let mine = points.iter().filter(|c| (c.a == all || c.b == all) == of_all);
                let mut gaps: Vec<f64> = mine.map(|c| c.gap).collect();
                gaps.sort_by(f64::total_cmp);
                gaps
            };
            let (whole, single) = (gaps(true), gaps(false));
            assert!(points.iter().all(|c| c.a == one || c.b == one));
            // Each contact of the whole is a contact of a piece, but at most eight are returned for each
            // direction.
            assert_eq!(whole.is_empty(), single.is_empty());
            if let (Some(a), Some(b)) = (whole.first(), single.first()) {
                assert!((a - b).abs() < 1e-9, "{a} {b}");
                seen += 1;
            }
            let direction = rng.unit();
            let origin = pose.transform_point(&(Vec3::new(0.23, 0.27, 0.11) - direction));
            let direction = pose.transform_vector(&direction);
            let ray = Ray { origin, direction, max: 3.0 };
            let cast = |of_all: bool| {
                let wanted = |id| id != one && (id == all) == of_all;
                colliders.cast_ray(&ray, &Query::margin(0.0), place, wanted)
            };
            match (cast(true), cast(false)) {
                (None, None) => {}
                (Some(a), Some(b)) => {
                    assert!((a.distance - b.distance).abs() < 1e-9, "{a:?} {b:?}");
                    assert!((a.normal - b.normal).norm() < 1e-6 || a.distance == 0.0);
                    rays += 1;
                }
                (a, b) => panic!("{a:?} {b:?}"),
            }
        }
        assert!(seen > 10 && rays > 5, "{seen} {rays}");
    }
}

#[test]
fn what_changes_at_run_time_is_seen_and_undone() {
    let mut rng = Random(11);
    let n = [12, 10, 6];
    let (points, occupied) = (cloud(&mut rng, 60), cells(&mut rng, n, 50));
    let mut builder = Builder::new();
    builder.body(BodySpec::new("other", "world").hinge(Hinge::free()));
    let multibody = builder.build().unwrap();
    let specs = vec![
        ColliderSpec::new("cloud", "world", Shape::PointCloud { points: vec![], room: 60 }),
        ColliderSpec::new(
            "map",
            "world",
            Shape::VoxelMap { cells: n, edge: EDGE, occupied: vec![] },
        ),
        ColliderSpec::new("one", "other", Shape::Box { half: Vec3::repeat(0.1) }),
    ];
    let empty = Colliders::new(specs.clone(), Rules::default(), &multibody).unwrap();
    let filled = |points: Vec<[f64; 4]>, occupied: Vec<[u32; 3]>| {
        let mut specs = specs.clone();
        specs[0].fine = Shape::PointCloud { points, room: 60 };
        specs[1].fine = Shape::VoxelMap { cells: n, edge: EDGE, occupied };
        Colliders::new(specs, Rules::default(), &multibody).unwrap()
    };
    let full = filled(points.clone(), occupied.clone());
    let [cloud, map, one] = ["cloud", "map", "one"].map(|n| empty.find(n).unwrap());
    let (mut live, mut fixed, mut none) =
        (Probe::new(&empty), Probe::new(&full), Probe::new(&empty));
    live.set_points(&empty, cloud, &points).unwrap();
    live.set_cells(&empty, map, &occupied, Occupancy::Occupied).unwrap();
    assert_eq!((live.count(cloud), live.count(map)), (Some(60), Some(occupied.len())));
    assert_eq!(live.count(one), None);
    let mut fork = live.fork(&empty);
    let mut undone = live.fork(&empty);
    undone.set_points(&empty, cloud, &[]).unwrap();
    undone.set_cells(&empty, map, &occupied, Occupancy::Free).unwrap();
    let mut hits = 0;
    for _ in 0..200 {
        let pose = rng.pose(0.8);
        let place = |_| pose;
        let ask = |probe: &mut Probe, colliders: &Colliders| {
            probe.place(colliders, |b| b.map_or(Pose::identity(), |b| place(Some(b))));
            let mut out = Vec::new();
            probe.hits(colliders, &mut out);
            (out, probe.closest(colliders, 10.0))
        };
        let expected = ask(&mut fixed, &full);
        assert_eq!(ask(&mut live, &empty), expected, "to the bit");
        assert_eq!(ask(&mut fork, &empty), expected);
        assert_eq!(ask(&mut none, &empty), (vec![], None));
        assert_eq!(ask(&mut undone, &empty), (vec![], None));
        hits += expected.0.len();
    }
    assert!(hits > 20);
    // An error does not change anything.
    let before = live.count(cloud);
    let many = vec![[0.0; 4]; 61];
    assert_eq!(
        live.set_points(&empty, cloud, &many),
        Err(ShapeFault::Points { count: 61, most: 60 })
    );
    assert!(matches!(
        live.set_points(&empty, cloud, &[[0.0, f64::NAN, 0.0, 0.1]]),
        Err(ShapeFault::NotFinite { what: "point", index: 0 })
    ));
    assert!(matches!(
        live.set_points(&empty, cloud, &[[0.0; 4], [0.0, 0.0, 0.0, -0.1]]),
        Err(ShapeFault::Radius { index: 1, .. })
    ));
    assert!(matches!(live.set_points(&empty, map, &[]), Err(ShapeFault::Kind { .. })));
    let cell = [0, 10, 0];
    let outside = ShapeFault::Outside { index: 1, cell, cells: n };
    let list = [[0, 0, 0], cell];
    assert_eq!(live.set_cells(&empty, map, &list, Occupancy::Occupied), Err(outside));
    assert_eq!(live.count(cloud), before);
    assert_eq!(live.count(map), Some(occupied.len()));
    let (first, status) = (occupied[0], Occupancy::Occupied);
    assert_eq!(live.cell(map, first), Ok(status));
    live.set_cells(&empty, map, &[first], Occupancy::Free).unwrap();
    assert_eq!(live.cell(map, first), Ok(Occupancy::Free));
    live.clear_cells(&empty, map).unwrap();
    assert_eq!(live.count(map), Some(0));
    let wrong = |fine: Shape| {
        let specs = vec![ColliderSpec::new("x", "world", fine)];
        Colliders::new(specs, Rules::default(), &multibody).unwrap_err().to_string()
    };
    let map = |cells, edge, occupied| wrong(Shape::VoxelMap { cells, edge, occupied });
    assert!(map([3, 0, 3], 0.1, vec![]).contains("at least one along each"));
    assert!(map([1 << 20; 3], 0.1, vec![]).contains("at most"));
    assert!(map([usize::MAX; 3], 0.1, vec![]).contains("at most"));
    assert!(map([3; 3], 0.0, vec![]).contains("edge of a cell"));
    assert!(map([3; 3], 0.1, vec![[3, 0, 0]]).contains("indices count from 0"));
    let cloud = |room| wrong(Shape::PointCloud { points: vec![], room });
    assert!(cloud(usize::MAX).contains("room"));
}

/// Clouds of all sizes around the border of a tree's leaves, with coincident points and points of zero size.
#[test]
fn small_clouds_have_the_distance_of_their_nearest_ball() {
    let mut builder = Builder::new();
    builder.body(BodySpec::new("other", "world").hinge(Hinge::free()));
    let multibody = builder.build().unwrap();
    let specs = vec![
        ColliderSpec::new("cloud", "world", Shape::PointCloud { points: vec![], room: 70 }),
        ColliderSpec::new("one", "other", Shape::Sphere { radius: 0.1 }),
    ];
    let colliders = Colliders::new(specs, Rules::default(), &multibody).unwrap();
    let [all, one] = ["cloud", "one"].map(|n| colliders.find(n).unwrap());
    let mut probe = Probe::new(&colliders);
    let mut rng = Random(17);
    for n in 0..=70 {
        let mut points = cloud(&mut rng, n);
        for k in 0..n / 3 {
            points[3 * k] = points[0];
            points[3 * k + 1][3] = 0.0;
        }
        probe.set_points(&colliders, all, &points).unwrap();
        for _ in 0..20 {
            let at = rng.vec();
            let pose = Pose::translation(at.x, at.y, at.z);
            probe.place(&colliders, |b| b.map_or(Pose::identity(), |_| pose));
            let gap = |p: &[f64; 4]| (Vec3::new(p[0], p[1], p[2]) - at).norm() - p[3] - 0.1;
            let low = points.iter().map(gap).fold(f64::INFINITY, f64::min);
            let d = probe.distance(&colliders, all, one, f64::INFINITY);
            assert!(d.map_or(low == f64::INFINITY, |d| (d.distance - low).abs() < 1e-14), "{n}");
            assert_eq!(probe.first_hit(&colliders).is_some(), low <= 0.0, "{n}");
        }
    }
}
