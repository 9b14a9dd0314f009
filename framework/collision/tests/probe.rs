//! Yes or no agrees with the distance, within 1e-9 of a size: a contact is never missed.
#![allow(clippy::unwrap_used, non_snake_case)]

mod support;

use linkwork_collision::multibody::spatial::Vec3;
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
