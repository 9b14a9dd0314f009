//! Invalid input is rejected, with all faults at once, their location and remedy.

use crate::support::*;
use linkwork_collision::multibody::spatial::{Pose, Vec3};
use linkwork_collision::*;

fn faults(shape: Shape) -> Vec<ColliderFault> {
    let spec = ColliderSpec::new("it", "a00", shape);
    Colliders::new(vec![spec], Rules::default(), &free_bodies(1))
        .map_or_else(|e| e.faults, |_| vec![])
}

fn shape_faults(shape: Shape) -> Vec<ShapeFault> {
    let only = |f| if let ColliderFault::Shape { fault, .. } = f { fault } else { panic!("{f:?}") };
    faults(shape).into_iter().map(only).collect()
}

#[test]
fn sizes_must_be_positive_and_finite() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let shapes = [
            (Shape::Sphere { radius: bad }, 1),
            (Shape::Box { half: Vec3::new(bad, 1.0, bad) }, 2),
            (Shape::Capsule { radius: bad, half_length: bad }, 2),
            (Shape::Ellipsoid { half: Vec3::new(1.0, bad, bad) }, 2),
            (Shape::Cylinder { radius: 1.0, half_length: bad }, 1),
            (Shape::HeightField { x: 2, y: 2, spacing: [bad, 1.0], heights: [0.0; 4].into() }, 1),
        ];
        for (shape, count) in shapes {
            let found = shape_faults(shape.clone());
            assert!(
                found.iter().all(|f| matches!(f, ShapeFault::Size { .. })) && found.len() == count,
                "{shape:?} {found:?}"
            );
        }
    }
}

#[test]
fn hulls_must_span_a_volume() {
    let plane: Vec<Vec3> = (0..9)
        .map(|i| Vec3::new(f64::from(i % 3), f64::from(i / 3), 0.3 * f64::from(i % 3) + 1.0))
        .collect();
    for points in [vec![], vec![Vec3::x(); 5], plane[..3].to_vec(), plane.clone()] {
        let count = points.len();
        assert_eq!(shape_faults(Shape::ConvexHull { points }), [ShapeFault::Flat { count }]);
    }
    let mut nan = plane;
    nan[4].y = f64::NAN;
    assert_eq!(
        shape_faults(Shape::ConvexHull { points: nan }),
        [ShapeFault::NotFinite { what: "point", index: 4 }]
    );
}

#[test]
fn meshes_and_height_fields_must_be_sound() {
    let vertices = vec![
        Vec3::zeros(),
        Vec3::x(),
        Vec3::y(),
        Vec3::x() * 2.0,
        Vec3::new(0.0, f64::INFINITY, 0.0),
    ];
    let mesh = |triangles| Shape::Mesh { vertices: vertices.clone(), triangles };
    let found = shape_faults(mesh(vec![[0, 1, 2], [0, 1, 3], [0, 7, 1], [1, 1, 2]]));
    assert_eq!(
        found,
        [
            ShapeFault::NotFinite { what: "vertex", index: 4 },
            ShapeFault::NoArea { triangle: 1 },
            ShapeFault::Index { triangle: 2, index: 7, count: 5 },
            ShapeFault::NoArea { triangle: 3 },
        ]
    );
    assert!(shape_faults(mesh(vec![])).contains(&ShapeFault::Empty));
    let grid = |x, y, heights: Vec<f64>| {
        let heights = heights.into();
        Shape::HeightField { x, y, spacing: [1.0, 1.0], heights }
    };
    for (x, y, n) in [(1, 4, 4), (2, 2, 5), (0, 0, 0), (usize::MAX, usize::MAX, 1)] {
        assert_eq!(shape_faults(grid(x, y, vec![0.0; n])), [ShapeFault::Grid { x, y, heights: n }]);
    }
    assert_eq!(
        shape_faults(grid(2, 2, vec![0.0, 0.0, f64::INFINITY, 0.0])),
        [ShapeFault::NotFinite { what: "height", index: 2 }]
    );
}

#[test]
fn all_mistakes_are_reported_at_once_with_a_remedy_each() {
    let mut specs: Vec<ColliderSpec> =
        (0..2).map(|_| ColliderSpec::new("twin", "a00", cube(0.1))).collect();
    specs[0].padding = -0.1;
    specs[1].material = Material { friction: f64::NAN, restitution: -1.0 };
    specs.push(ColliderSpec::new("lost", "a0O", cube(0.1)).at(Pose::translation(
        f64::NAN,
        0.0,
        0.0,
    )));
    specs[2].coarse = Some(Shape::Sphere { radius: -1.0 });
    let rules = Rules {
        ignore: vec![["twin".into(), "lots".into()]],
        joined: vec![["a00".into(), "twin".into()]],
        apart: vec![vec!["a00".into(), "a01".into(), "twin".into()]],
        laws: vec![PairLaw {
            materials: ["steal".into(), "terrain".into()],
            friction: Some(f64::NAN),
            restitution: Some(0.1),
            rolling: None,
            spinning: None,
        }],
        ..Rules::default()
    };
    specs[1].material_name = Some("steel".into());
    let error = Colliders::new(specs, rules, &free_bodies(2)).unwrap_err();
    let text = error.to_string();
    println!("{text}");
    assert_eq!(error.faults.len(), 12, "{text}");
    assert_eq!(text.matches("help:").count(), 12, "{text}");
    for part in [
        "`twin` is defined 2 times",
        "padding is -0.1",
        "did you mean `a00`?",
        "did you mean `lost`?",
        "coarse shape: radius is -1",
        "rule joined 0",
        "rule apart 0",
        "no collider has the material `steal`",
        "did you mean `steel`?",
        "pair law 0: friction is NaN",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

/// Coincident corners count as one, so a triangle soup does not have inner borders.
#[test]
fn a_soup_of_triangles_is_a_surface() {
    let Shape::Mesh { vertices, triangles } = box_mesh(Vec3::new(1.0, 1.0, 0.1)) else { panic!() };
    let corners: Vec<Vec3> = triangles.iter().flatten().map(|i| vertices[*i as usize]).collect();
    let soup = Shape::Mesh {
        triangles: (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        vertices: corners,
    };
    let X = [Pose::identity(), Pose::translation(0.1, 0.13, 0.19)];
    let points = scene(&[soup, cube(0.1)]).contacts(0.0, &X);
    assert_eq!(points.len(), 4);
    assert!(points.iter().all(|c| (c.normal - Vec3::z()).norm() < 1e-12));
}
