//! Spheres, planes, cylinders and shadows compared with closed forms; threads; errors.

use linkwork_render::collision::Shape;
use linkwork_render::spatial::{Pose, Quat, Vec3, quat};
use linkwork_render::*;
use std::sync::Arc;

/// A grid of heights.
fn map(
    origin: [f64; 2],
    spacing: [f64; 2],
    nx: usize,
    ny: usize,
    heights: Vec<f32>,
) -> Result<HeightMap, RenderError> {
    HeightMap::new(Surface { origin, spacing, nx, ny, heights })
}

fn camera(view: f64) -> Camera {
    Camera::new(Lens::Brown(Brown::ideal(321, 241, view)), 321, 241, 1).unwrap()
}

/// A camera at a position in W that points at another, with y of its image down.
fn looking(from: Vec3, at: Vec3) -> Pose {
    let z = (at - from).normalize();
    let x = z.cross(&Vec3::z()).normalize();
    let y = z.cross(&x);
    let R = linkwork_render::spatial::Mat3::from_columns(&[x, y, z]);
    Pose::new(quat(&R), from)
}

fn seen(shape: &Shape, X_WO: Pose, X_WC: &Pose, camera: &Camera) -> Frame {
    let mut scene = Scene::new(Light::default());
    scene.add("it", shape, Look::plain([0.5; 3]), X_WO).unwrap();
    scene.settle();
    camera.look(&scene, X_WC, Want::Radiance, 1).unwrap()
}

/// Returns where hits of a row begin and end, in pixels, by bisection of rays through the lens.
fn edges(shape: &Shape, X_WO: Pose, X_WC: &Pose, lens: &Lens, row: f64, middle: f64) -> [f64; 2] {
    let mut scene = Scene::new(Light::default());
    scene.add("it", shape, Look::plain([0.5; 3]), X_WO).unwrap();
    scene.settle();
    let hit = |x: f64| {
        let r = lens.ray([x, row]).unwrap();
        let (o, d) = (X_WC.transform_point(&r.origin), X_WC.transform_vector(&r.direction));
        scene.cast(&o, &d, FAR).is_some()
    };
    [-1.0, 321.0].map(|outside: f64| {
        let (mut a, mut b) = (middle, outside);
        assert!(hit(a) && !hit(b));
        for _ in 0..60 {
            let m = 0.5 * (a + b);
            if hit(m) { a = m } else { b = m }
        }
        0.5 * (a + b)
    })
}

/// The silhouette of a sphere is a cone of half angle asin(r/d).
#[test]
fn a_sphere_has_its_silhouette_and_its_depth() {
    let (r, centre) = (0.7, Vec3::new(0.4, -0.3, 4.0));
    let lens = Lens::Brown(Brown::ideal(321, 241, 1.0));
    let ball = Shape::Sphere { radius: r };
    let at = Pose::translation(centre.x, centre.y, centre.z);
    let f = 160.5 / 0.5f64.tan();
    let row = 120.0 + f * centre.y / centre.z;
    // The plane of the row contains the camera's x axis and n = (0, y, z)/|·|, so its rays are (a,
    // y/z, 1).
    let n = Vec3::new(0.0, centre.y, centre.z).normalize();
    let (along, across) = (n.dot(&centre), centre.x);
    let d = along.hypot(across);
    let (turn, half) = (across.atan2(along), (r / d).asin());
    let want = [-half, half].map(|a| 160.0 + f * (turn + a).tan() / n.z);
    let got = edges(&ball, at, &Pose::identity(), &lens, row, 160.0 + f * centre.x / centre.z);
    assert!((0..2).all(|k| (got[k] - want[k]).abs() < 1e-6), "{got:?} {want:?}");
    // Compare depths, and the edges of the mask, which must be within half a pixel of the same
    // outline.
    let frame = seen(&ball, at, &Pose::identity(), &camera(1.0));
    let mut count = 0;
    for (k, depth) in frame.depth.iter().enumerate() {
        let p = Vec3::new(((k % 321) as f64 - 160.0) / f, ((k / 321) as f64 - 120.0) / f, 1.0);
        let (b, c) = (p.dot(&centre), centre.norm_squared() - r * r);
        let root = b * b - p.norm_squared() * c;
        assert_eq!(depth.is_finite(), root >= 0.0, "{k}");
        if root >= 0.0 {
            let z = (b - root.sqrt()) / p.norm_squared();
            assert!((depth - z).abs() < 1e-9, "{k}: {depth} {z}");
            assert!((frame.range[k] - z * p.norm()).abs() < 1e-9);
            let normal = (p * z - centre) / r;
            let got = Vec3::from(frame.normals[k].map(f64::from));
            assert!((got - normal).norm() < 1e-6);
            count += 1;
        }
    }
    assert!(count > 5000 && frame.objects.iter().filter(|o| **o == 2).count() == count);
}

/// The outline of an upright cylinder is a pair of planes through the camera that touch it.
#[test]
fn a_cylinder_has_its_silhouette() {
    let r = 0.35;
    let pole = Shape::Cylinder { radius: r, half_length: 6.0 };
    let X_WC = looking(Vec3::new(0.0, 0.0, 1.0), Vec3::new(5.0, 0.2, 1.0));
    let lens = Lens::Brown(Brown::ideal(321, 241, 1.0));
    let f = 160.5 / 0.5f64.tan();
    let at = Vec3::new(4.2, 0.5, 1.0);
    let got = edges(&pole, Pose::translation(at.x, at.y, 1.0), &X_WC, &lens, 120.0, {
        let p = X_WC.inverse().transform_point(&at);
        160.0 + f * p.x / p.z
    });
    let p = X_WC.inverse().transform_point(&at);
    let (turn, half) = (p.x.atan2(p.z), (r / p.x.hypot(p.z)).asin());
    let want = [-half, half].map(|a| 160.0 + f * (turn + a).tan());
    assert!((0..2).all(|k| (got[k] - want[k]).abs() < 1e-6), "{got:?} {want:?}");
}

/// The radiance of a pixel on an edge is the mean over the area covered.
#[test]
fn an_edge_is_covered_by_parts_of_a_pixel() {
    let fine = Camera::new(Lens::Brown(Brown::ideal(41, 31, 0.2)), 41, 31, 8).unwrap();
    let mut scene = Scene::new(Light {
        sun: Vec3::new(0.0, 0.0, -1.0),
        horizon: [0.0; 3],
        zenith: [0.0; 3],
        sky_irradiance: [0.0; 3],
        ..Light::default()
    });
    let f = 20.5 / 0.1f64.tan();
    // The right edge of the sheet is in the plane z = 2, at pixel 20.3.
    let edge = 2.0 * (20.3 - 20.0) / f;
    let sheet = Shape::Box { half: Vec3::new(5.0, 5.0, 0.5) };
    scene
        .add("sheet", &sheet, Look::plain([1.0; 3]), Pose::translation(edge - 5.0, 0.0, 2.5))
        .unwrap();
    scene.settle();
    let frame = fine.look(&scene, &Pose::identity(), Want::Radiance, 2).unwrap();
    let row: f64 = frame.radiance[15 * 41..16 * 41].iter().map(|v| f64::from(v[0])).sum();
    let full = f64::from(frame.radiance[15 * 41 + 3][0]);
    assert!((full - 400.0 / std::f64::consts::PI).abs() < 1e-3, "Lambert: {full}");
    // The sheet covers the row from pixel −0.5 to 20.3.
    assert!((row / full - 20.8).abs() < 0.1, "{}", row / full);
}

#[test]
fn a_plane_has_its_depth_near_and_far() {
    let X_WC = looking(Vec3::new(1.0, -2.0, 1.7), Vec3::new(9.0, 3.0, 0.4));
    let frame = seen(&Shape::HalfSpace, Pose::identity(), &X_WC, &camera(1.1));
    let f = 160.5 / 0.55f64.tan();
    for (k, depth) in frame.depth.iter().enumerate() {
        let d = Vec3::new(((k % 321) as f64 - 160.0) / f, ((k / 321) as f64 - 120.0) / f, 1.0);
        let fall = X_WC.transform_vector(&d).z;
        match fall < 0.0 {
            true => assert!((depth + 1.7 / fall).abs() < 1e-9 * depth.max(1.0), "{k}: {depth}"),
            false => assert!(depth.is_infinite(), "{k}"),
        }
    }
}

/// The shadow of a pole points away from the Sun, with the length that the Sun's elevation gives.
#[test]
fn a_pole_and_a_ball_throw_their_shadows_where_the_sun_says() {
    let (azimuth, elevation) = (0.6f64, 0.5f64);
    let sun = Vec3::new(
        azimuth.cos() * elevation.cos(),
        azimuth.sin() * elevation.cos(),
        elevation.sin(),
    );
    let light = Light { sun, sky_irradiance: [0.0; 3], ..Light::default() };
    let mut scene = Scene::new(light);
    let map = map([-20.0, -20.0], [0.5, 0.5], 81, 81, vec![0.0; 81 * 81]).unwrap();
    scene.set_ground(Arc::new(map), Look::plain([0.4; 3])).unwrap();
    let (height, r) = (1.5, 0.05);
    let pole = Shape::Cylinder { radius: r, half_length: 0.5 * height };
    scene
        .add("pole", &pole, Look::plain([0.4; 3]), Pose::translation(0.0, 0.0, 0.5 * height))
        .unwrap();
    let ball = Vec3::new(-6.0, 3.0, 2.0);
    scene
        .add(
            "ball",
            &Shape::Sphere { radius: 0.8 },
            Look::plain([0.4; 3]),
            Pose::translation(ball.x, ball.y, ball.z),
        )
        .unwrap();
    scene.settle();
    let dark = |x: f64, y: f64| scene.blocked(&Vec3::new(x, y, 1e-6), &sun, FAR);
    let length = height / elevation.tan();
    let away = Vec3::new(-azimuth.cos(), -azimuth.sin(), 0.0);
    // Find the tip of the shadow by bisection along its middle. The disc at the end of the pole
    // adds r.
    let (mut a, mut b) = (0.5 * length, 2.0 * length);
    for _ in 0..50 {
        let m = 0.5 * (a + b);
        if dark(away.x * m, away.y * m) { a = m } else { b = m }
    }
    assert!((a - length - r).abs() < 1e-5, "{a} {length}");
    // The shadow is as wide as the pole.
    let side = Vec3::new(-away.y, away.x, 0.0);
    for off in [-1.01, -0.99, 0.99, 1.01] {
        let p = away * (0.5 * length) + side * (off * r);
        assert_eq!(dark(p.x, p.y), off.abs() < 1.0, "{off}");
    }
    // The sphere's shadow is an ellipse about the shadow of its centre.
    let foot = ball - sun * (ball.z / sun.z);
    for (along, across, want) in
        [(0.99, 0.0, true), (1.01, 0.0, false), (0.0, 0.99, true), (0.0, -1.01, false)]
    {
        let p = foot + away * (along * 0.8 / elevation.sin()) + side * (across * 0.8);
        assert_eq!(dark(p.x, p.y), want, "{along} {across}");
    }
    // The image agrees: lit ground has Lambert's radiance, and shadowed ground is black.
    let X_WC = looking(Vec3::new(-3.0, -9.0, 4.0), Vec3::new(-3.0, 0.0, 0.0));
    let camera = camera(1.2);
    let frame = camera.look(&scene, &X_WC, Want::Radiance, 2).unwrap();
    let lit = 0.4 * 400.0 * elevation.sin() / std::f64::consts::PI;
    for (p, want) in [(foot, 0.0), (away * (0.5 * length), 0.0), (Vec3::new(-3.0, 1.0, 0.0), lit)] {
        let at = camera.lens().project(&X_WC.inverse().transform_point(&p)).unwrap();
        let k = at[1].round() as usize * 321 + at[0].round() as usize;
        assert_eq!(frame.objects[k], GROUND);
        assert!(
            (f64::from(frame.radiance[k][0]) - want).abs() < 1e-3,
            "{p}: {:?}",
            frame.radiance[k]
        );
    }
}

fn busy() -> Scene {
    let n = 90;
    let height = |i: usize, j: usize| 0.4 * ((0.31 * i as f64).sin() + (0.23 * j as f64).cos());
    let heights = (0..n * n).map(|k| height(k % n, k / n) as f32).collect();
    let mut scene = Scene::new(Light::default());
    let map = map([-9.0, -9.0], [0.2, 0.2], n, n, heights).unwrap();
    scene.set_ground(Arc::new(map), Look::soil()).unwrap();
    for k in 0..40 {
        let s = k as f64;
        let at = Vec3::new(7.0 * (1.3 * s).sin(), 7.0 * (2.1 * s).cos(), 0.3 + 0.02 * s);
        let X = Pose::new(Quat::from_scaled_axis(Vec3::new(0.3 * s, 1.0, -0.2 * s)), at);
        let shape = match k % 4 {
            0 => Shape::Sphere { radius: 0.3 },
            1 => Shape::Box { half: Vec3::new(0.2, 0.4, 0.3) },
            2 => Shape::Capsule { radius: 0.15, half_length: 0.3 },
            _ => Shape::Cylinder { radius: 0.25, half_length: 0.2 },
        };
        scene
            .add(&format!("thing {k}"), &shape, Look { class: 3, ..Look::plain([0.6; 3]) }, X)
            .unwrap();
    }
    scene.settle();
    scene
}

#[test]
fn any_number_of_threads_gives_the_same_bits_and_so_does_each_ray_alone() {
    let scene = busy();
    let lens = Lens::Brown(Brown { radial: [-0.1, 0.02, 0.0], ..Brown::ideal(149, 101, 1.4) });
    let camera = Camera::new(lens, 149, 101, 2).unwrap();
    let X_WC = looking(Vec3::new(-8.0, -7.0, 2.4), Vec3::new(0.0, 0.0, 0.2));
    let one = camera.look(&scene, &X_WC, Want::Radiance, 1).unwrap();
    for threads in [2, 3, 4, 50] {
        assert_eq!(one, camera.look(&scene, &X_WC, Want::Radiance, threads).unwrap(), "{threads}");
    }
    assert!(!one.inside);
    // Requesting one output does not affect the others.
    let depth = camera.look(&scene, &X_WC, Want::Depth, 2).unwrap();
    assert!(depth.normals.is_empty() && depth.radiance.is_empty());
    assert!(depth.depth == one.depth && depth.range == one.range && depth.objects == one.objects);
    let geometry = camera.look(&scene, &X_WC, Want::Geometry, 2).unwrap();
    assert!(geometry.normals == one.normals && geometry.radiance.is_empty());
    let detector = Detector::default();
    let image = detector.read(&one, 7, 3).unwrap();
    assert_eq!(image, detector.read(&one, 7, 3).unwrap());
    assert_ne!(image.data, detector.read(&one, 7, 4).unwrap().data);
    // Each tile must see all objects: compare with each ray alone, cast through the whole scene.
    let R = X_WC.rotation.to_rotation_matrix();
    let (mut ground, mut things) = (0, 0);
    for (k, object) in one.objects.iter().enumerate() {
        let r = lens.ray([(k % 149) as f64, (k / 149) as f64]).unwrap();
        let hit = scene.cast(&X_WC.position, &(R * r.direction), FAR);
        assert_eq!(hit.map_or(0, |h| h.object), *object, "pixel {k}");
        assert_eq!(hit.map_or(f64::INFINITY, |h| h.distance), one.range[k], "pixel {k}");
        ground += usize::from(*object == GROUND);
        things += usize::from(*object > GROUND);
    }
    assert!(ground > 2000 && things > 300, "{ground} {things}");
    assert!((0..one.objects.len()).all(|k| one.classes[k] == scene.class(one.objects[k])));
}

#[test]
fn a_camera_in_a_rock_or_below_the_ground_says_so() {
    let scene = busy();
    let camera = camera(1.0);
    let rock = Pose::translation(7.0 * 0.0, 7.0, 0.3); // thing 0
    let frame = camera.look(&scene, &rock, Want::Radiance, 1).unwrap();
    assert!(frame.inside && frame.range.iter().all(|r| *r == 0.0));
    assert!(frame.radiance.iter().all(|r| r.iter().all(|v| v.is_finite())));
    let below = looking(Vec3::new(0.1, 0.2, -3.0), Vec3::new(1.0, 1.0, 0.0));
    let frame = camera.look(&scene, &below, Want::Radiance, 1).unwrap();
    assert!(frame.inside && frame.objects.contains(&GROUND));
}

#[test]
fn what_cannot_be_rendered_is_refused_with_the_reason() {
    let lens = Lens::Brown(Brown::ideal(64, 48, 1.0));
    let text = |e: RenderError| {
        let t = e.to_string();
        assert!(t.contains("help:"), "{t}");
        t
    };
    assert!(text(Camera::new(lens, 0, 48, 1).unwrap_err()).contains("0 by 48"));
    assert!(text(Camera::new(lens, 64, 48, 0).unwrap_err()).contains("at least 1 by 1"));
    assert!(text(Camera::new(lens, 1 << 20, 1 << 20, 1).unwrap_err()).contains("million"));
    assert!(
        text(Camera::new(lens, usize::MAX, usize::MAX, usize::MAX >> 32).unwrap_err())
            .contains("million")
    );
    let camera = Camera::new(lens, 64, 48, 1).unwrap();
    let mut scene = Scene::new(Light::default());
    let bad = Pose::translation(f64::NAN, 0.0, 0.0);
    assert!(text(camera.look(&scene, &bad, Want::Geometry, 1).unwrap_err()).contains("camera"));
    let ball = Shape::Sphere { radius: 1.0 };
    let plain = Look::plain([0.5; 3]);
    assert!(text(scene.add("b", &ball, plain, bad).unwrap_err()).contains("`b`"));
    assert!(
        text(scene.add("c", &Shape::Sphere { radius: -1.0 }, plain, Pose::identity()).unwrap_err())
            .contains("`c`")
    );
    assert!(
        text(scene.add("d", &ball, Look::plain([1.5; 3]), Pose::identity()).unwrap_err())
            .contains("albedo")
    );
    // A rejected object does not change the scene. After an object was moved, rendering is an error until the scene
    // is settled.
    let far = scene.add("far", &ball, plain, Pose::translation(0.0, 0.0, -50.0)).unwrap();
    scene.settle();
    scene.set_pose(far, Pose::translation(0.0, 0.0, -60.0)).unwrap();
    let e = camera.look(&scene, &Pose::identity(), Want::Geometry, 1).unwrap_err();
    assert!(text(e).contains("settle"));
    scene.settle();
    let frame = camera.look(&scene, &Pose::identity(), Want::Geometry, 1).unwrap();
    assert!(frame.objects.iter().all(|o| *o == 0) && frame.depth.iter().all(|d| d.is_infinite()));
    let dark = Light { sun: Vec3::zeros(), ..Light::default() };
    scene.set_light(dark);
    assert!(
        text(camera.look(&scene, &Pose::identity(), Want::Geometry, 1).unwrap_err())
            .contains("Sun")
    );
    for (nx, ny, n, word) in [(1, 5, 5, "no cell"), (3, 3, 8, "8 heights")] {
        let e = map([0.0; 2], [1.0; 2], nx, ny, vec![0.0; n]).unwrap_err();
        assert!(text(e).contains(word));
    }
    assert!(text(map([0.0; 2], [1.0, 0.0], 2, 2, vec![0.0; 4]).unwrap_err()).contains("positive"));
    assert!(
        text(map([0.0; 2], [1.0; 2], 2, 2, vec![f32::INFINITY; 4]).unwrap_err()).contains("finite")
    );
    let nowhere = Vec3::new(f64::NAN, 0.0, 0.0);
    assert!(scene.cast(&nowhere, &Vec3::x(), 1.0).is_none());
    let e = Detector { bits: 7, ..Detector::default() }.read(&frame, 0, 0).unwrap_err();
    assert!(text(e).contains("bits"));
    assert!(text(Detector::default().read(&frame, 0, 0).unwrap_err()).contains("radiance"));
}
