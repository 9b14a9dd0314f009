//! Many colliders: broad phase compared with brute force, order, rules, hiding, detail, rebuilding, rays, no allocation.

use crate::support::*;
use linkwork_collision::multibody::spatial::{Pose, Vec3};
use linkwork_collision::multibody::{BodySpec, Builder, Hinge, Multibody};
use linkwork_collision::*;

/// `n` colliders of all kinds on free bodies, and ground.
fn crowd(n: usize, r: &mut Random) -> (Vec<ColliderSpec>, Multibody, Vec<Pose>) {
    let bodies = free_bodies(n);
    let shapes = convex_shapes();
    let mut specs = vec![ColliderSpec::new("ground", "world", Shape::HalfSpace)];
    for i in 0..n {
        let mut s = ColliderSpec::new(
            format!("s{:02}", (i * 7) % n),
            format!("a{i:02}"),
            shapes[i % shapes.len()].clone(),
        )
        .at(r.pose(0.1));
        s.padding = r.between(0.0, 0.02);
        (s.groups, s.collides_with) = (1 << (i % 3), if i % 4 == 0 { 0b101 } else { u128::MAX });
        s.material = Material { friction: r.between(0.1, 1.0), restitution: r.between(0.0, 0.9) };
        specs.push(s);
    }
    specs[0].groups = u128::MAX;
    let poses = (0..n)
        .map(|_| Pose::new(r.rotation(), r.vec().component_mul(&Vec3::new(2.0, 2.0, 1.0))))
        .collect();
    (specs, bodies, poses)
}

#[test]
fn the_broad_phase_finds_what_brute_force_finds() {
    let mut r = Random(21);
    for _ in 0..20 {
        let (specs, bodies, poses) = crowd(25, &mut r);
        let all = Colliders::new(specs, Rules::default(), &bodies).unwrap();
        let (mut scratch, mut out, margin) = (Scratch::new(&all), Vec::new(), 0.05);
        all.contacts(&mut scratch, &Query::margin(margin), at(&poses), &mut out);
        let ids: Vec<ColliderId> = all.ids().collect();
        let (mut touching, mut nearest) = (0, f64::INFINITY);
        for a in &ids {
            for b in ids.iter().filter(|b| *b > a) {
                let d =
                    all.distance(&mut scratch, *a, *b, Detail::Fine, at(&poses)).unwrap().distance;
                let found: Vec<ContactPoint> =
                    out.iter().filter(|c| (c.a, c.b) == (*a, *b)).copied().collect();
                assert_eq!(all.meet(*a, *b) && d <= margin, !found.is_empty(), "{a:?} {b:?} {d}");
                if let Some(c) = deepest(&found) {
                    assert!((c.gap - d).abs() < 1e-9);
                    touching += 1;
                }
                if all.meet(*a, *b) {
                    nearest = nearest.min(d);
                }
            }
        }
        assert!(touching > 10);
        let closest = all.closest(&mut scratch, &Query::margin(f64::INFINITY), at(&poses)).unwrap();
        assert!((closest.distance.distance - nearest).abs() < 1e-9);
    }
}

/// Two colliders on one body, one on another, and the world: the distance of bodies is that of their nearest colliders.
#[test]
fn bodies_are_as_near_as_their_nearest_colliders() {
    let bodies = free_bodies(2);
    let ball = Shape::Sphere { radius: 0.1 };
    let specs = vec![
        ColliderSpec::new("ground", "world", Shape::HalfSpace),
        ColliderSpec::new("left", "a00", ball.clone()).at(Pose::translation(-1.0, 0.0, 0.0)),
        ColliderSpec::new("right", "a00", ball.clone()).at(Pose::translation(1.0, 0.0, 0.1)),
        ColliderSpec::new("other", "a01", ball),
    ];
    let all = Colliders::new(specs, Rules::default(), &bodies).unwrap();
    let mut scratch = Scratch::new(&all);
    let poses = [Pose::translation(0.0, 0.0, 2.0), Pose::translation(1.5, 0.0, 2.1)];
    let (a, b) = (bodies.body("a00"), bodies.body("a01"));
    let far = Query::margin(f64::INFINITY);
    let mut near = |p, q| all.distance_of_bodies(&mut scratch, &far, [p, q], at(&poses));
    let found = near(b, a).unwrap();
    assert_eq!([&all.spec(found.a).name, &all.spec(found.b).name], ["other", "right"]);
    assert!((found.distance.distance - 0.3).abs() < 1e-12);
    assert!((near(None, a).unwrap().distance.distance - 1.9).abs() < 1e-12);
    assert!(near(a, a).is_none());
    let close = Query::margin(0.2);
    assert!(all.distance_of_bodies(&mut scratch, &close, [a, b], at(&poses)).is_none());
}

#[test]
fn order_of_giving_and_old_scratch_leave_no_trace() {
    let mut r = Random(22);
    let (specs, bodies, poses) = crowd(25, &mut r);
    let run = |specs: Vec<ColliderSpec>, used: bool| {
        let all = Colliders::new(specs, Rules::default(), &bodies).unwrap();
        let (mut scratch, mut out) = (Scratch::new(&all), Vec::new());
        if used {
            let mut other = Random(99);
            let elsewhere: Vec<Pose> = poses.iter().map(|_| other.pose(1.0)).collect();
            all.contacts(&mut scratch, &Query::margin(0.3), at(&elsewhere), &mut out);
        }
        all.contacts(&mut scratch, &Query::margin(0.05), at(&poses), &mut out);
        out.iter().map(|c| format!("{c:?}")).collect::<Vec<_>>()
    };
    let first = run(specs.clone(), false);
    let mut turned = specs.clone();
    turned.reverse();
    turned.swap(3, 11);
    assert!(first.len() > 10);
    assert_eq!(first, run(turned, false));
    assert_eq!(first, run(specs, true));
}

/// A floating base, an arm of two links on it, a hand welded to the second, a finger on the hand, and a free box.
fn arm(with_box: bool) -> Multibody {
    let mut b = Builder::new();
    b.body(BodySpec::new("base", "world").hinge(Hinge::free()));
    b.body(BodySpec::new("upper", "base").hinge(Hinge::pin(Vec3::y())));
    b.body(BodySpec::new("lower", "upper").hinge(Hinge::pin(Vec3::y())));
    b.body(BodySpec::new("hand", "lower").hinge(Hinge::locked()));
    b.body(BodySpec::new("finger", "hand").hinge(Hinge::pin(Vec3::x())));
    if with_box {
        b.body(BodySpec::new("box", "world").hinge(Hinge::free()));
    }
    b.build().unwrap()
}

fn arm_specs() -> Vec<ColliderSpec> {
    let mut all = vec![ColliderSpec::new("ground", "world", Shape::HalfSpace)];
    for b in ["base", "upper", "lower", "hand", "finger", "box"] {
        all.push(ColliderSpec::new(format!("{b} shape"), b, cube(0.1)));
    }
    all
}

fn meeting(c: &Colliders) -> Vec<String> {
    let short = |i| c.spec(i).name.trim_end_matches(" shape").to_string();
    let mut found = Vec::new();
    for a in c.ids() {
        found.extend(
            c.ids()
                .filter(|b| *b > a && c.meet(a, *b))
                .map(|b| format!("{}-{}", short(a), short(b))),
        );
    }
    found
}

#[test]
fn neighbours_pass_unless_asked() {
    let pair = |a: &str, b: &str| [a.to_string(), b.to_string()];
    let make = |rules: Rules| meeting(&Colliders::new(arm_specs(), rules, &arm(true)).unwrap());
    let plain = make(Rules::default());
    // Free hinges do not make neighbours. The hand is welded to the lower arm, so the neighbours of the lower arm
    // (finger and upper arm) are neighbours of the hand, too.
    assert_eq!(
        plain,
        [
            "base-box",
            "base-finger",
            "base-ground",
            "base-hand",
            "base-lower",
            "box-finger",
            "box-ground",
            "box-hand",
            "box-lower",
            "box-upper",
            "finger-ground",
            "finger-upper",
            "ground-hand",
            "ground-lower",
            "ground-upper"
        ]
    );
    let with = make(Rules { collide: vec![pair("base", "upper shape")], ..Rules::default() });
    assert!(with.contains(&"base-upper".into()) && with.len() == plain.len() + 1);
    let without = make(Rules {
        ignore: vec![pair("box shape", "ground"), pair("world", "hand")],
        ..Rules::default()
    });
    assert_eq!(without.len(), plain.len() - 2);
    let looped = make(Rules { joined: vec![pair("finger", "base")], ..Rules::default() });
    assert!(!looped.contains(&"base-finger".into()) && looped.len() == plain.len() - 1);
    // The bodies of this machine do not collide with each other, and the hand does not collide with
    // the box.
    let bodies = |all: &[&str]| all.iter().map(|b| (*b).to_string()).collect::<Vec<_>>();
    let apart =
        vec![bodies(&["base", "upper", "lower", "hand", "finger"]), bodies(&["hand", "box"])];
    let own = make(Rules { apart: apart.clone(), ..Rules::default() });
    let left = ["base-box", "base-ground", "box-finger", "box-ground", "box-lower", "box-upper"];
    assert_eq!(own[..6], left);
    assert_eq!(own.len(), 10, "and each other body with the ground: {own:?}");
    let but = Rules { apart, collide: vec![pair("base", "finger")], ..Rules::default() };
    assert_eq!(make(but.clone()).len(), 11);
    let ignore = vec![pair("finger", "base")];
    assert_eq!(make(Rules { ignore, ..but }), own, "`ignore` goes before");
    let all = make(Rules { neighbours: Neighbours::Collide, ..Rules::default() });
    assert_eq!(all.len(), 7 * 6 / 2 - 1, "all but the two that are welded");
}

#[test]
fn rules_follow_bodies_that_leave_and_return() {
    let rules = Rules { ignore: vec![["box".into(), "ground".into()]], ..Rules::default() };
    let first = Colliders::new(arm_specs(), rules, &arm(true)).unwrap();
    let mut hiding = first.hiding();
    hiding.set(first.find("hand shape").unwrap(), Visibility::Hidden);
    let gone = first.rebuild(&arm(false));
    assert_eq!(gone.dropped, ["box shape"]);
    assert_eq!(gone.colliders.len(), first.len() - 1);
    let carried = gone.colliders.carry_hiding(&first, &hiding);
    for i in gone.colliders.ids() {
        let hidden = carried.of(i) == Visibility::Hidden;
        assert_eq!(hidden, gone.colliders.spec(i).name == "hand shape");
    }
    let back = gone.colliders.rebuild(&arm(true));
    assert!(back.dropped.is_empty());
    assert_eq!(meeting(&back.colliders), meeting(&first));
    assert!(!meeting(&first).contains(&"box-ground".to_string()));
}

#[test]
fn hiding_detail_and_materials_are_heeded() {
    let bodies = free_bodies(2);
    let mut a = ColliderSpec::new("a", "a00", Shape::Sphere { radius: 0.2 });
    a.coarse = Some(cube(0.5));
    a.material = Material { friction: 0.9, restitution: 0.3 };
    let mut b = ColliderSpec::new("b", "a01", Shape::Sphere { radius: 0.2 });
    b.hidden = Visibility::Hidden;
    b.material = Material { friction: 0.4, restitution: 0.1 };
    let all = Colliders::new(vec![a, b], Rules::default(), &bodies).unwrap();
    let poses = [Pose::identity(), Pose::translation(0.6, 0.01, 0.02)];
    let mut scratch = Scratch::new(&all);
    let mut count = |detail, hiding: Option<&Hiding>, margin| {
        let mut out = Vec::new();
        all.contacts(
            &mut scratch,
            &Query { detail, hiding, ..Query::margin(margin) },
            at(&poses),
            &mut out,
        );
        out
    };
    let mut shown = all.hiding();
    assert!(
        count(Detail::Coarse, None, 0.1).is_empty()
            && count(Detail::Coarse, Some(&shown), 0.1).is_empty()
    );
    shown.set(all.find("b").unwrap(), Visibility::Shown);
    assert!(count(Detail::Fine, Some(&shown), 0.1).is_empty());
    let fine = count(Detail::Fine, Some(&shown), 0.3);
    let coarse = count(Detail::Coarse, Some(&shown), 0.1);
    assert_eq!((fine.len(), coarse.len()), (1, 1));
    assert!((coarse[0].gap + 0.1).abs() < 1e-12 && fine[0].gap > 0.19);
    assert!((fine[0].friction - 0.6).abs() < 1e-12 && (fine[0].restitution - 0.3).abs() < 1e-12);
}

/// A pose with NaN removes its body, and nothing else.
#[test]
fn poses_that_are_not_numbers_give_no_points() {
    let mut s = scene(&[Shape::HalfSpace, cube(0.1), cube(0.1)]);
    let bad = Pose::translation(f64::NAN, 0.0, 0.0);
    let points = s.contacts(0.01, &[Pose::identity(), bad, Pose::translation(0.0, 0.0, 0.1)]);
    assert_eq!(points.len(), 4);
    assert!(s.distance(&[Pose::identity(), bad, bad]).is_none());
}

#[test]
fn nothing_is_allocated_after_a_first_query() {
    let mut r = Random(23);
    let (specs, bodies, poses) = crowd(25, &mut r);
    let mut sets = vec![(specs, bodies, poses)];
    let ground = |shape: Shape| {
        let mut all = vec![ColliderSpec::new("ground", "world", shape)];
        all.extend(
            convex_shapes()
                .into_iter()
                .enumerate()
                .map(|(i, s)| ColliderSpec::new(format!("s{i}"), format!("a{i:02}"), s)),
        );
        let poses =
            (0..6).map(|i| Pose::translation(0.9 * f64::from(i) - 2.2, 0.03, 0.41)).collect();
        (all, free_bodies(6), poses)
    };
    sets.push(ground(box_mesh(Vec3::new(3.0, 3.0, 0.05))));
    let heights = (0..40 * 40).map(|i| 0.01 * f64::from(i % 7)).collect();
    sets.push(ground(Shape::HeightField { x: 40, y: 40, spacing: [0.15, 0.15], heights }));
    for (specs, bodies, poses) in sets {
        let all = Colliders::new(specs, Rules::default(), &bodies).unwrap();
        let (mut scratch, mut out) = (Scratch::new(&all), Vec::new());
        let mut query = || {
            all.contacts(&mut scratch, &Query::margin(0.05), at(&poses), &mut out);
            out.len()
        };
        let n = query();
        assert!(n > 8, "{n}");
        let counted = allocation_counter::measure(|| {
            query();
        });
        assert_eq!(counted.count_total, 0, "{n} points");
    }
}

#[test]
fn rays_stop_at_the_first_surface() {
    let mut shapes = convex_shapes();
    shapes.push(box_mesh(Vec3::new(0.4, 0.5, 0.3)));
    shapes.push(Shape::HalfSpace);
    let heights = (0..12 * 15).map(|i| 0.1 * (f64::from(i) * 0.7).sin()).collect();
    shapes.push(Shape::HeightField { x: 12, y: 15, spacing: [0.15, 0.1], heights });
    let mut r = Random(31);
    let mut hits = 0;
    for shape in shapes {
        let mut s = scene(&[shape.clone(), Shape::Sphere { radius: 1e-9 }]);
        for _ in 0..150 {
            let X = r.pose(1.0);
            let origin = X.transform_point(&(r.unit() * 2.0));
            let target = X.transform_point(&(r.vec() * 0.4));
            let ray = Ray { origin, direction: (target - origin) * 3.0, max: 10.0 };
            let query = Query::margin(0.0);
            let ids: Vec<ColliderId> = s.colliders.ids().collect();
            let cast = |s: &Scene, ray: &Ray| {
                s.colliders.cast_ray(ray, &query, at(&[X, X]), |i| i == ids[0])
            };
            let Some(hit) = cast(&s, &ray) else { continue };
            let (d, end) =
                (ray.direction.normalize(), ray.origin + ray.direction.normalize() * hit.distance);
            if hit.distance == 0.0 {
                assert!((hit.normal + d).norm() < 1e-12);
                continue;
            }
            hits += 1;
            assert!(
                hit.normal.dot(&d) <= 1e-12 && (hit.normal.norm() - 1.0).abs() < 1e-9,
                "{shape:?} {hit:?}"
            );
            // A tiny sphere at the hit touches, and one before it does not. One-sided shapes and flat shapes from
            // behind are left out.
            let mut gap = |p: Vec3| s.distance(&[X, Pose::new(X.rotation, p)]).map(|d| d.distance);
            let surface = matches!(shape, Shape::Mesh { .. } | Shape::HeightField { .. });
            if let Some(touch) = gap(end) {
                assert!(
                    surface && ray_from_below(&X, &origin, &shape) || touch.abs() < 1e-7,
                    "{shape:?}: {touch}"
                );
            }
            if !surface {
                assert!(gap(ray.origin + d * (hit.distance * 0.99)).unwrap() > 0.0, "{shape:?}");
            }
            let short = Ray { max: hit.distance * 0.999, ..ray };
            assert!(cast(&s, &short).is_none());
        }
    }
    assert!(hits > 500, "{hits}");
    let s = scene(&[cube(0.1)]);
    for (origin, direction, max) in [
        (Vec3::x(), Vec3::zeros(), 1.0),
        (Vec3::x() * f64::NAN, Vec3::x(), 1.0),
        (Vec3::x(), -Vec3::x(), f64::NAN),
    ] {
        let ray = Ray { origin, direction, max };
        assert!(
            s.colliders
                .cast_ray(&ray, &Query::margin(0.0), at(&[Pose::identity()]), |_| true)
                .is_none()
        );
    }
}

fn ray_from_below(X: &Pose, origin: &Vec3, shape: &Shape) -> bool {
    matches!(shape, Shape::HeightField { .. }) && X.inverse().transform_point(origin).z < 0.1
}

/// Two of three spheres in a row move: pairs are checked up to the sum of their own reaches.
#[test]
fn reach_is_each_colliders_own() {
    let bodies = free_bodies(3);
    let ball = |i: usize| {
        ColliderSpec::new(format!("b{i}"), format!("a{i:02}"), Shape::Sphere { radius: 0.1 })
    };
    let all = Colliders::new((0..3).map(ball).collect(), Rules::default(), &bodies).unwrap();
    let poses = [0.0, 0.5, 1.1].map(|x| Pose::translation(x, 0.03, -0.2));
    let mut scratch = Scratch::new(&all);
    let mut pairs = |margin: f64, reach: &[f64]| {
        let mut out = Vec::new();
        let query = Query { reach, ..Query::margin(margin) };
        all.contacts(&mut scratch, &query, at(&poses), &mut out);
        out.iter().map(|c| (c.a.index(), c.b.index())).collect::<Vec<_>>()
    };
    // The gaps are 0.3, 0.4 and 0.9 m.
    assert!(pairs(0.1, &[]).is_empty());
    assert!(pairs(0.1, &[0.1, 0.09, 0.0]).is_empty());
    assert_eq!(pairs(0.1, &[0.1, 0.11, 0.0]), [(0, 1)]);
    assert_eq!(pairs(0.1, &[0.0, 0.0, 0.31]), [(1, 2)]);
    assert_eq!(pairs(0.1, &[0.5, 0.0, 0.31]), [(0, 1), (0, 2), (1, 2)]);
    for i in all.ids() {
        assert!((all.extent(i) - 0.1 * 3.0_f64.sqrt()).abs() < 0.08, "{}", all.extent(i));
    }
}
