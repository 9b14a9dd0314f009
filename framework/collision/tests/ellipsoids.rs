//! Ellipsoids: distances compared with MuJoCo, contact with planes, faces and terrain compared with the support function, rays compared with the
//! equation.
use crate::support::*;
use linkwork_collision::multibody::spatial::nalgebra::Quaternion;
use linkwork_collision::multibody::spatial::{Pose, Quat, Vec3};
use linkwork_collision::*;

const HALF: [f64; 3] = [0.4, 0.25, 0.15];

fn egg() -> Shape {
    Shape::Ellipsoid { half: Vec3::from(HALF) }
}

/// h(d) = |H d|, by definition.
fn reach(turn: &Quat, d: &Vec3) -> f64 {
    Vec3::from(HALF).component_mul(&(turn.inverse() * d)).norm()
}

type Row = (&'static str, [f64; 4], [f64; 3], [f64; 4], f64, [f64; 6]);

/// An ellipsoid of 0.4, 0.25, 0.15 m at the origin and another shape: kind, rotation of the ellipsoid (w, x, y, z; to be normalised), position and
/// rotation of the other, distance, nearest points on both. From `mj_geomDistance` of MuJoCo 4.0.0 with `ccd_tolerance` 1e-12.
#[rustfmt::skip]
const MUJOCO: [Row; 15] = [
    ("sphere", [0.001, 0.305, -0.28, -0.91], [-0.376, -0.474, 0.374], [-0.263, -0.573, 0.035, 0.775], 0.312522673, [-0.1454884, -0.1971926, 0.0838806, -0.3012432, -0.384229, 0.2799118]),
    ("sphere", [0.09, -0.798, -0.025, 0.596], [-0.506, -0.065, -0.348], [-0.498, -0.169, -0.704, -0.477], 0.296427341, [-0.1003958, -0.0392178, -0.1632897, -0.3697166, -0.0563372, -0.2859372]),
    ("sphere", [0.061, -0.072, -0.973, -0.208], [-0.442, -0.366, 0.48], [-0.03, 0.07, -0.952, -0.297], 0.355156989, [-0.2789981, -0.0794554, 0.0972388, -0.3935986, -0.2809142, 0.3663439]),
    ("box", [-0.031, 0.83, -0.547, -0.105], [0.489, -0.557, 0.309], [0.09, 0.052, -0.993, 0.062], 0.237943218, [0.1053331, -0.2814561, 0.0443, 0.1553902, -0.4004717, 0.2441663]),
    ("box", [-0.253, 0.789, 0.301, -0.473], [-0.035, 0.354, 0.763], [0.081, 0.629, -0.206, 0.745], 0.233096264, [-0.0551081, 0.0936127, 0.2305525, -0.0320279, 0.2059437, 0.4334883]),
    ("box", [0.157, -0.357, 0.098, -0.916], [-0.751, -0.451, 0.367], [-0.367, -0.124, 0.569, 0.725], 0.253903476, [-0.2736555, -0.181129, 0.2172089, -0.4706776, -0.324599, 0.2883822]),
    ("capsule", [-0.307, -0.064, 0.833, 0.457], [-0.646, -0.458, 0.532], [-0.202, -0.227, -0.154, 0.94], 0.198555274, [-0.3188725, -0.1735239, 0.1639916, -0.4636719, -0.286628, 0.2392566]),
    ("capsule", [-0.162, -0.917, -0.009, -0.365], [-0.188, 0.581, -0.003], [0.78, 0.437, -0.016, 0.447], 0.117128104, [0.0164134, 0.2076964, 0.0765189, -0.0346372, 0.296369, 0.1335278]),
    ("capsule", [-0.436, 0.117, -0.57, -0.687], [-0.582, -0.437, 0.144], [-0.125, -0.368, 0.067, 0.919], 0.322748264, [-0.1458224, -0.0972691, -0.0030541, -0.3200865, -0.3637704, -0.0557372]),
    ("cylinder", [-0.193, -0.225, 0.768, 0.568], [0.119, -0.393, 0.445], [-0.699, -0.054, 0.024, -0.713], 0.101404558, [-0.0287592, -0.1211159, 0.1598676, 0.0103988, -0.1926674, 0.2201164]),
    ("cylinder", [0.043, -0.283, -0.057, -0.956], [-0.617, 0.267, -0.299], [-0.438, 0.141, -0.825, 0.328], 0.232840146, [-0.1807444, 0.0998789, -0.0463689, -0.3314211, 0.1474901, -0.2173784]),
    ("cylinder", [0.053, -0.626, 0.509, 0.588], [0.685, -0.338, -0.032], [-0.064, -0.267, -0.156, -0.949], 0.323267952, [0.134201, -0.1064154, -0.159221, 0.4067292, -0.2791583, -0.1789797]),
    ("ellipsoid", [-0.329, -0.671, 0.66, -0.081], [-0.631, 0.009, -0.423], [0.783, 0.011, -0.563, -0.265], 0.300541568, [-0.1854821, 0.210494, -0.1564089, -0.4256201, 0.2151557, -0.3370668]),
    ("ellipsoid", [-0.576, -0.337, 0.691, -0.28], [-0.087, -0.264, -0.736], [-0.457, 0.146, 0.61, -0.63], 0.220987183, [0.0774764, -0.0664233, -0.3290873, 0.0654202, -0.2340636, -0.472568]),
    ("ellipsoid", [-0.027, 0.081, -0.853, 0.515], [0.871, -0.331, 0.19], [-0.31, -0.082, -0.638, -0.7], 0.508243764, [0.3622112, -0.0179179, 0.0673342, 0.7757632, -0.2835575, 0.196648]),
];

#[test]
fn distances_are_those_of_mujoco() {
    let other = |kind: &str| match kind {
        "sphere" => Shape::Sphere { radius: 0.15 },
        "box" => Shape::Box { half: Vec3::new(0.3, 0.2, 0.1) },
        "capsule" => Shape::Capsule { radius: 0.1, half_length: 0.3 },
        "cylinder" => Shape::Cylinder { radius: 0.2, half_length: 0.25 },
        _ => Shape::Ellipsoid { half: Vec3::new(0.1, 0.35, 0.2) },
    };
    let turn = |[w, x, y, z]: [f64; 4]| Quat::from_quaternion(Quaternion::new(w, x, y, z));
    let mut worst = [0.0_f64; 2];
    for (kind, of_a, place, of_b, distance, ends) in MUJOCO {
        let X = [Pose::new(turn(of_a), Vec3::zeros()), Pose::new(turn(of_b), Vec3::from(place))];
        let d = scene(&[egg(), other(kind)]).distance(&X).unwrap();
        let [a, b] = [
            d.point_a - Vec3::from_row_slice(&ends[..3]),
            d.point_b - Vec3::from_row_slice(&ends[3..]),
        ];
        worst = [worst[0].max((d.distance - distance).abs()), worst[1].max(a.norm()).max(b.norm())];
        assert!((d.distance - distance).abs() < 2e-9, "{kind}: {} {distance}", d.distance);
        assert!(a.norm() < 2e-5 && b.norm() < 2e-5, "{kind}: {a} {b}");
    }
    println!("worst distance {:.1e} m, worst point {:.1e} m", worst[0], worst[1]);
}

/// On a plane, a box face, a flat mesh and flat terrain the ellipsoid touches at one point, which the support function gives.
#[test]
fn flat_ground_of_every_kind_is_touched_at_one_point() {
    let mut r = Random(41);
    let heights: std::sync::Arc<[f64]> = vec![0.0; 21 * 21].into();
    let corner = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    let mesh = Shape::Mesh {
        vertices: vec![corner(-3.0, -3.0), corner(3.0, -3.0), corner(3.0, 3.0), corner(-3.0, 3.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let ground = [
        (Shape::HalfSpace, 0.0),
        (Shape::Box { half: Vec3::new(3.0, 3.0, 0.5) }, -0.5),
        (mesh, 0.0),
        (Shape::HeightField { x: 21, y: 21, spacing: [0.3, 0.3], heights }, 0.0),
    ];
    for (shape, z) in ground {
        let mut scene = scene(&[shape.clone(), egg()]);
        for k in 0..200 {
            let turn = r.rotation();
            let gap = [0.004, -0.001, -0.01][k % 3];
            let place = Vec3::new(r.signed(), r.signed(), reach(&turn, &Vec3::z()) + gap);
            let found =
                scene.contacts(0.01, &[Pose::translation(0.0, 0.0, z), Pose::new(turn, place)]);
            let [c] = &found[..] else { panic!("{shape:?} {k}: {found:?}") };
            assert!(
                (c.gap - gap).abs() < 1e-12 && (c.normal - Vec3::z()).norm() < 1e-12,
                "{shape:?}: {c:?}"
            );
            let low = turn.inverse() * -Vec3::z();
            let half = Vec3::from(HALF);
            let low =
                half.component_mul(&half.component_mul(&low)) / half.component_mul(&low).norm();
            let low = turn * low + place - Vec3::z() * (0.5 * gap);
            assert!((c.point - low).norm() < 1e-9, "{shape:?}: {} {low}", c.point);
        }
    }
}

/// The point hit by a ray is on the surface |H⁻¹ x| = 1, earlier points of the ray are outside, and the normal is the gradient.
#[test]
fn rays_meet_the_surface() {
    let mut r = Random(43);
    let target = Target::new(&egg()).unwrap();
    let level = |p: &Vec3| p.component_div(&Vec3::from(HALF)).norm();
    let (mut hits, mut misses) = (0, 0);
    for _ in 0..2000 {
        let origin = r.vec();
        let direction = (r.vec() * 0.5 - origin).normalize();
        let samples = || (0..=4000).map(|k| origin + direction * (f64::from(k) * 1e-3));
        match target.cast(&origin, &direction, 4.0) {
            Some((t, n)) if level(&origin) >= 1.0 => {
                hits += 1;
                let p = origin + direction * t;
                assert!((level(&p) - 1.0).abs() < 1e-12, "{p}");
                let half = Vec3::from(HALF);
                let gradient = p.component_div(&half).component_div(&half).normalize();
                assert!((n - gradient).norm() < 1e-12 && n.dot(&direction) <= 0.0);
                assert!(samples().take((t * 1e3) as usize).all(|p| level(&p) > 1.0 - 1e-12));
            }
            Some((t, n)) => assert!(t == 0.0 && (n + direction).norm() < 1e-15),
            None => {
                misses += 1;
                assert!(samples().all(|p| level(&p) > 1.0));
            }
        }
    }
    assert!(hits > 100 && misses > 100, "{hits} {misses}");
}
