//! Constraint islands: found from contacts, solved separately, bit-identical independent of other bodies and of order.

use crate::scene::{Run, Scene, solid_box, turned};
use linkwork_collision::{ColliderSpec, Material, Shape};
use linkwork_dynamics::multibody::{BodySpec, Coupling, Hinge, HingeCoordinate};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Vec3};

const ROUGH: Material = Material { friction: 0.6, restitution: 0.0 };
const HALF: Vec3 = Vec3::new(0.1, 0.12, 0.08);

/// Eight boxes that fall on a heap at x; their names start with `name`.
fn heap(s: &mut Scene, name: &str, x: f64, order: impl Iterator<Item = u32>) {
    for i in order {
        let f = f64::from(i);
        let at = Pose::new(
            turned(Vec3::new(0.2, 0.1 * f, 1.0), 0.3 * f),
            Vec3::new(x + 0.05 * f.sin(), 0.05 * f.cos(), 0.2 + 0.25 * f),
        );
        let name = format!("{name}{i}");
        s.body(&name, solid_box(1.5, HALF), Shape::Box { half: HALF }, ROUGH, at, [0.0; 6]);
    }
}

fn bits(run: &mut Run, name: &str) -> Vec<u64> {
    let poses = (0..8).map(|i| run.pose(&format!("{name}{i}")));
    let numbers = poses.flat_map(|X| {
        let (p, r) = (X.position, X.rotation.coords);
        [p.x, p.y, p.z, r.x, r.y, r.z, r.w]
    });
    numbers.map(f64::to_bits).collect()
}

#[test]
fn an_island_moves_as_if_it_were_alone() {
    let ends = [false, true].map(|both| {
        let mut s = Scene::default();
        s.ground(ROUGH);
        heap(&mut s, "a", 0.0, 0..8);
        if both {
            // Faster than the first heap, because the accuracy of one must not depend on the speed of the other.
            heap(&mut s, "b", 40.0, 0..8);
            s.start[8].2 = [3.0, 1.0, 2.0, 5.0, 0.0, 4.0];
        }
        let mut run = s.run();
        let mut most = 0;
        for _ in 0..700 {
            most = most.max(run.step(2e-3).islands);
        }
        assert!(most >= if both { 4 } else { 2 }, "{most}");
        bits(&mut run, "a")
    });
    assert_eq!(ends[0], ends[1]);
}

#[test]
fn the_order_of_the_file_changes_no_bit() {
    let mut ends = Vec::new();
    for turn in 0..3 {
        let mut s = Scene::default();
        s.ground(ROUGH);
        let mut order: Vec<u32> = (0..8).collect();
        order.rotate_left(3 * turn as usize);
        if turn == 2 {
            order.reverse();
        }
        heap(&mut s, "a", 0.0, order.into_iter());
        if turn > 0 {
            s.colliders.reverse();
        }
        let mut run = s.run();
        for _ in 0..700 {
            run.step(2e-3);
        }
        ends.push(bits(&mut run, "a"));
    }
    assert_eq!(ends[0], ends[1]);
    assert_eq!(ends[0], ends[2]);
}

/// Separate boxes are separate islands, a touching pair is one, and a coupling joins otherwise separate ones.
#[test]
fn islands_are_what_rows_connect() {
    let count = |gap: f64, coupled: bool| {
        let mut s = Scene::default();
        // The boxes on sliders and the ground have the same parent, the world. Neighbours must
        // collide, because otherwise the boxes would not touch the ground.
        s.rules.neighbours = linkwork_collision::Neighbours::Collide;
        s.ground(ROUGH);
        for k in 0..3 {
            let x = if k == 2 { 5.0 } else { (0.2 + gap) * f64::from(k) };
            let at = Pose::translation(x, 0.0, 0.08);
            let name = format!("box{k}");
            s.body(&name, solid_box(1.0, HALF), Shape::Box { half: HALF }, ROUGH, at, [0.0; 6]);
        }
        for k in 0..2 {
            let mass = MassProperties::new(1.0, Vec3::zeros(), Mat3::identity() * 0.01);
            let body = BodySpec::new(format!("slider{k}"), "world").hinge(Hinge::slider(Vec3::z()));
            let at = Pose::translation(10.0 + 3.0 * f64::from(k), 0.0, 0.1);
            s.builder.body(body.hinge_in_parent(at).mass(mass));
            let name = format!("slider{k}");
            let ball = Shape::Sphere { radius: 0.1 };
            s.colliders.push(ColliderSpec::new(&name, &name, ball));
        }
        if coupled {
            let of = |body: &str| HingeCoordinate { body: body.into(), subhinge: 0 };
            s.builder.coupling(Coupling::mimic("together", of("slider0"), of("slider1"), 1.0, 0.0));
        }
        let report = s.run().step(1e-3);
        assert!(report.converged, "{report:?}");
        report.islands
    };
    assert_eq!(count(0.1, false), 5);
    assert_eq!(count(0.0, false), 4);
    assert_eq!(count(0.1, true), 4);
}

/// A heap that becomes one island with more degrees of freedom than a dense matrix may have is solved to 1e-6.
#[test]
fn a_large_island_is_solved_to_what_is_asked() {
    let mut s = Scene::default();
    s.settings.solver.tolerance = 1e-6;
    s.ground(ROUGH);
    for i in 0..27_u32 {
        let f = f64::from(i);
        let place = [i % 3, i / 3 % 3, i / 9].map(|k| 0.21 * f64::from(k));
        let at = Pose::new(
            turned(Vec3::new(0.3, f, 1.0), 0.4 * f.sin()),
            Vec3::new(place[0], 1.3 * place[1], 0.2 + 1.2 * place[2]),
        );
        let name = format!("box{i:02}");
        s.body(&name, solid_box(1.5, HALF), Shape::Box { half: HALF }, ROUGH, at, [0.0; 6]);
    }
    let mut run = s.run();
    let (mut short, mut newton, mut worst) = (0, 0, 0.0_f64);
    for _ in 0..400 {
        let report = run.step(2e-3);
        short += usize::from(!report.converged);
        newton += usize::from(report.method == linkwork_solvers::contact::Method::Newton);
        worst = worst.max(report.measure.residual);
    }
    println!("27 boxes: {newton} steps by Newton, {short} short, worst {worst:e}");
    assert!(newton > 10, "{newton}");
    assert!(short <= 4, "{short} of 400, worst {worst:e}");
}
