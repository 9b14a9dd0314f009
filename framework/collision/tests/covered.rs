//! Adjacent shapes of one rigid piece form one solid: faces between them have no contact points.

use crate::support::*;
use linkwork_collision::multibody::spatial::{Pose, Quat, Vec3};
use linkwork_collision::multibody::{BodySpec, Builder, Hinge};
use linkwork_collision::*;

fn boxed(name: &str, body: &str, half: [f64; 3], at: [f64; 3]) -> ColliderSpec {
    ColliderSpec::new(name, body, Shape::Box { half: Vec3::from(half) })
        .at(Pose::translation(at[0], at[1], at[2]))
}

/// Returns the contact points of a box of 0.2 m on a given floor, with the middle of its bottom face at `foot`, rotated about the vertical.
fn points(floor: Vec<ColliderSpec>, foot: Vec3, turn: f64) -> Vec<ContactPoint> {
    let mut specs = floor;
    specs.push(boxed("box", "a00", [0.1, 0.1, 0.1], [0.0; 3]));
    let all = Colliders::new(specs, Rules::default(), &free_bodies(1)).unwrap();
    let (mut scratch, mut out) = (Scratch::new(&all), Vec::new());
    let pose = Pose::new(Quat::from_axis_angle(&Vec3::z_axis(), turn), foot + Vec3::z() * 0.1);
    let poses = |b: Option<_>| b.map_or_else(Pose::identity, |_| pose);
    all.contacts(&mut scratch, &Query::margin(4e-3), poses, &mut out);
    out
}

fn tiles() -> Vec<ColliderSpec> {
    let tile = |k: f64| boxed(&format!("tile{k}"), "world", [0.5, 0.5, 0.1], [k, 0.0, -0.1]);
    vec![tile(-0.5), tile(0.5)]
}

/// A box anywhere over the seam, slightly sunk in, has only vertical normals; a single box as floor gives the same depth.
#[test]
fn a_seam_between_two_boxes_has_no_points() {
    for turn in [0.0, 0.3, std::f64::consts::FRAC_PI_4] {
        for k in 0..=200 {
            let foot = Vec3::new(-0.25 + 0.0025 * f64::from(k), 0.03, -1e-4);
            let on = points(tiles(), foot, turn);
            assert!(on.len() >= 4, "{foot} {turn}: {}", on.len());
            for c in &on {
                let n = c.normal.z.abs();
                assert!(n > 1.0 - 1e-9 && (c.gap + 1e-4).abs() < 1e-9, "{foot} {turn}: {c:?}");
            }
        }
    }
}

/// Tiles that are separate bodies welded to the world form one piece, too; moving tiles do not.
#[test]
fn welded_bodies_are_one_piece_and_bodies_on_hinges_are_not() {
    let side = |hinge: Hinge| {
        let mut builder = Builder::new();
        builder.body(BodySpec::new("a00", "world").hinge(Hinge::free()));
        builder.body(
            BodySpec::new("left", "world").hinge_in_parent(Pose::translation(-0.5, 0.0, 0.0)),
        );
        builder.body(BodySpec::new("right", "world").hinge(hinge));
        let bodies = builder.build().unwrap();
        let specs = vec![
            boxed("l", "left", [0.5, 0.5, 0.1], [0.0, 0.0, -0.1]),
            boxed("r", "right", [0.5, 0.5, 0.1], [0.5, 0.0, -0.1]),
            boxed("box", "a00", [0.1, 0.1, 0.1], [0.0, 0.0, 0.1]),
        ];
        let all = Colliders::new(specs, Rules::default(), &bodies).unwrap();
        let (mut scratch, mut out) = (Scratch::new(&all), Vec::new());
        let free = bodies.body("a00").unwrap();
        let left = bodies.body("left").unwrap();
        let poses = |b: Option<_>| match b {
            Some(b) if b == free => Pose::translation(-0.101, 0.0, -1e-4),
            Some(b) if b == left => Pose::translation(-0.5, 0.0, 0.0),
            _ => Pose::identity(),
        };
        all.contacts(&mut scratch, &Query::margin(4e-3), poses, &mut out);
        out.iter().filter(|c| c.normal.x.abs() > 0.5).count()
    };
    assert_eq!(side(Hinge::locked()), 0);
    assert!(side(Hinge::pin(Vec3::z())) > 0);
}

/// A wall keeps its face: where it stands on the floor, where the floor continues under it, and where it begins below the floor's top.
#[test]
fn a_wall_on_a_floor_and_the_floor_at_its_foot_stay() {
    for bottom in [0.0, -0.05] {
        let mut floor = vec![boxed("floor", "world", [1.0, 1.0, 0.1], [0.0, 0.0, -0.1])];
        let half = (0.5 - bottom) / 2.0;
        floor.push(boxed("wall", "world", [0.1, 1.0, half], [0.3, 0.0, bottom + half]));
        // The box is pressed against the wall and into the floor by the contact slop.
        let on = points(floor, Vec3::new(0.1001, 0.0, -1e-4), 0.0);
        let count = |n: Vec3| on.iter().filter(|c| c.normal.dot(&n).abs() > 0.999).count();
        assert_eq!((count(Vec3::z()), count(Vec3::x())), (4, 4), "{bottom}: {on:#?}");
    }
}

/// A step of a millimetre counts as a step; a crack of a twentieth of a millimetre does not.
#[test]
fn a_step_stays_and_a_crack_does_not_stop_a_box() {
    let with = |gap: f64, step: f64| {
        let floor = vec![
            boxed("l", "world", [0.5, 0.5, 0.1], [-0.5, 0.0, -0.1]),
            boxed("r", "world", [0.5, 0.5, 0.1], [0.5 + gap, 0.0, step - 0.1]),
        ];
        let on = points(floor, Vec3::new(-0.101, 0.0, -1e-4), 0.0);
        on.iter().filter(|c| c.normal.x.abs() > 0.5).count()
    };
    assert!(with(0.0, 1e-3) > 0);
    assert_eq!(with(5e-5, 0.0), 0);
}

/// The sliding box may consist of several shapes, too, and overlapping shapes keep only their outline.
#[test]
fn shapes_that_overlap_in_a_body_touch_with_their_outline() {
    let specs = vec![
        boxed("edge", "world", [0.5, 0.5, 0.1], [0.5, 0.0, -0.1]),
        boxed("front", "a00", [0.1, 0.1, 0.05], [-0.1, 0.0, 0.0]),
        boxed("rear", "a00", [0.1, 0.1, 0.05], [-0.3, 0.0, 0.0]),
        boxed("keel", "a00", [0.2, 0.02, 0.05], [-0.2, 0.0, 0.0]),
    ];
    let all = Colliders::new(specs, Rules::default(), &free_bodies(1)).unwrap();
    let (mut scratch, mut out) = (Scratch::new(&all), Vec::new());
    // The seam between front and rear is above the edge of the block, and the body has sunk into
    // the block.
    let pose = Pose::translation(0.2 - 1e-3, 0.0, 0.05 - 1e-4);
    let poses = |b: Option<_>| b.map_or_else(Pose::identity, |_| pose);
    all.contacts(&mut scratch, &Query::margin(4e-3), poses, &mut out);
    assert!(!out.is_empty());
    assert!(out.iter().all(|c| c.normal.z.abs() > 0.999), "{out:#?}");
}
