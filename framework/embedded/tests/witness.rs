//! Nearest points of the pairs of the reference: equal where they are unique, otherwise points of both surfaces at the reported distance. The
//! surfaces are computed here from the definition of each shape, independently of the search.

use crate::support::*;
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge};
use linkwork_embedded::spatial::{Pose, Vec3};
use linkwork_embedded::*;

/// Returns the distance from a point to a triangle.
fn to_triangle(p: &Vec3, t: &[Vec3; 3]) -> f64 {
    let n = (t[1] - t[0]).cross(&(t[2] - t[0])).normalize();
    let inside = (0..3).all(|i| (t[(i + 1) % 3] - t[i]).cross(&(p - t[i])).dot(&n) >= 0.0);
    if inside {
        return (p - t[0]).dot(&n).abs();
    }
    let edge = |i: usize| {
        let (a, d) = (t[i], t[(i + 1) % 3] - t[i]);
        (p - a - d * ((p - a).dot(&d) / d.norm_squared()).clamp(0.0, 1.0)).norm()
    };
    (0..3).map(edge).fold(f64::INFINITY, f64::min)
}

/// Returns triangles of three points with all other points on one side: those of a hull, whose larger faces are covered by several.
fn faces(points: &[Vec3]) -> Vec<[Vec3; 3]> {
    let mut out = Vec::new();
    for i in 0..points.len() {
        for j in i + 1..points.len() {
            for k in j + 1..points.len() {
                let [a, b, c] = [i, j, k].map(|i| points[i]);
                let n = (b - a).cross(&(c - a));
                if n.norm() < 1e-12 {
                    continue;
                }
                let n = n.normalize();
                let side: Vec<f64> = points.iter().map(|p| (p - a).dot(&n)).collect();
                if side.iter().all(|s| *s < 1e-9) || side.iter().all(|s| *s > -1e-9) {
                    out.push([a, b, c]);
                }
            }
        }
    }
    out
}

/// Returns the distance of a point, in a shape's axes, from its surface.
fn from_surface(shape: &Shape, p: &Vec3) -> f64 {
    // Compute the signed distance from a box, given the distance beyond each of its faces.
    let beyond = |d: &[f64]| {
        let out = d.iter().map(|d| d.max(0.0).powi(2)).sum::<f64>().sqrt();
        out + d.iter().fold(f64::NEG_INFINITY, |m, d| m.max(*d)).min(0.0)
    };
    let nearest =
        |t: &[[Vec3; 3]]| t.iter().map(|t| to_triangle(p, t)).fold(f64::INFINITY, f64::min);
    match shape {
        Shape::Sphere { radius } => (p.norm() - radius).abs(),
        Shape::Capsule { radius, half_length } => {
            let axis = Vec3::z() * p.z.clamp(-half_length, *half_length);
            ((p - axis).norm() - radius).abs()
        }
        Shape::Box { half } => beyond(&[0, 1, 2].map(|i| p[i].abs() - half[i])).abs(),
        Shape::Cylinder { radius, half_length } => {
            beyond(&[p.x.hypot(p.y) - radius, p.z.abs() - half_length]).abs()
        }
        Shape::ConvexHull { points } => nearest(&faces(points)),
        Shape::Mesh { vertices, triangles } => {
            let t: Vec<[Vec3; 3]> =
                triangles.iter().map(|t| t.map(|i| vertices[i as usize])).collect();
            nearest(&t)
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn surfaces_of_the_test_are_where_they_are_said_to_be() {
    let half = Vec3::new(0.1, 0.2, 0.3);
    let b = Shape::Box { half };
    assert!((from_surface(&b, &Vec3::new(0.09, 0.0, 0.0)) - 0.01).abs() < 1e-15);
    assert!((from_surface(&b, &Vec3::new(0.13, 0.24, 0.0)) - 0.05).abs() < 1e-15);
    let corner = |k: usize| {
        let s = [0, 1, 2].map(|i| if k >> i & 1 == 0 { -1.0 } else { 1.0 });
        Vec3::new(s[0] * half.x, s[1] * half.y, s[2] * half.z)
    };
    let hull = Shape::ConvexHull { points: (0..8).map(corner).collect() };
    let c = Shape::Cylinder { radius: 0.1, half_length: 0.2 };
    assert!((from_surface(&c, &Vec3::new(0.13, 0.0, 0.24)) - 0.05).abs() < 1e-15);
    let mut rng = Rng(3);
    for _ in 0..200 {
        let p = Vec3::from_fn(|_, _| rng.within(-0.5, 0.5));
        assert!((from_surface(&b, &p) - from_surface(&hull, &p)).abs() < 1e-12, "{p}");
    }
}

#[test]
fn nearest_points_are_those_of_the_reference_where_they_are_unique() {
    let Some(json) = reference("robodarts/pair_distances.json") else { return };
    let (mut unique, mut all) = (0, 0);
    for (k, case) in json["cases"].as_array().unwrap().iter().enumerate() {
        let Some(golden) = case["distance"].as_f64() else { continue };
        let at = |k: &str| {
            let x = &case[k];
            pose(&[numbers(&x["position"]), numbers(&x["quaternion"])].concat())
        };
        let kinds = ["a", "b"].map(|k| case[k].as_str().unwrap());
        let shapes = kinds.map(|k| shape(&json["shapes"][k]));
        let X: [Pose; 2] = [at("pose_a"), at("pose_b")];
        let mut mechanism = Builder::new();
        mechanism.body(BodySpec::new("mover", "world").hinge(Hinge::free()));
        let colliders = vec![
            ColliderSpec::new("a", "mover", shapes[0].clone()).at(X[0]),
            ColliderSpec::new("b", "world", shapes[1].clone()).at(X[1]),
        ];
        let spec = ModelSpec { mechanism, colliders, ..ModelSpec::default() };
        let model = RobotModel::new(&spec).unwrap();
        let [a, b] = ["a", "b"].map(|n| model.collider(n).unwrap());
        let found = Robot::new(&model).distance(&model.multibody().neutral_q(), a, b);
        let found = found.unwrap().unwrap();
        let points = [found.point_a, found.point_b];
        let between = (points[1] - points[0]).norm();
        assert!((between - golden.abs()).abs() < 2e-6, "{k} {kinds:?}: {between} {golden}");
        // Measured: 7e-16 m.
        for i in 0..2 {
            let off = from_surface(&shapes[i], &X[i].inverse().transform_point(&points[i]));
            assert!(off < 1e-9, "{k} {kinds:?}: {off:e} from the surface of {}", kinds[i]);
        }
        all += 1;
        // Spheres have one nearest point, and so do capsules and hulls in general position. Boxes and cylinders may
        // have a whole nearest edge or face.
        if kinds.iter().all(|k| ["sphere", "capsule", "hull"].contains(k)) {
            let theirs =
                ["point_a", "point_b"].map(|k| Vec3::from_column_slice(&numbers(&case[k])));
            let off = [0, 1].map(|i| (points[i] - theirs[i]).norm());
            // Measured: 3e-16 m.
            assert!(off.iter().all(|off| *off < 1e-9), "{k} {kinds:?}: {off:?}");
            unique += 1;
        }
    }
    assert_eq!((unique, all), (36, 149));
}
