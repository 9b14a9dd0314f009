//! Motions from points that were made up with noise, and from pictures that were rendered.
use super::*;
use linkwork_render::stereo::{Matcher, right_of};
use linkwork_render::{
    Brown, Camera, Detector, HeightMap, Lens, Light, Look, Noise, Scene, Surface, Want,
};
use std::sync::Arc;

const FEATURES: Features =
    Features { spacing: 16, strength: 3.0, half_patch: 5, search: 5, least: 0.8 };

fn vo(pixel: f64, inverse_depth: f64) -> VisualOdometry {
    VisualOdometry { features: FEATURES, pixel, inverse_depth, tries: 60, fewest: 12 }
}

fn motion() -> Pose {
    Pose::new(Quat::from_scaled_axis(Vec3::new(0.02, -0.09, 0.03)), Vec3::new(0.05, -0.11, 0.21))
}

/// Matches of points 1 to 8 m away with the noise that the estimate is told, some of them wrong.
fn made_up(vo: &VisualOdometry, n: u32, wrong: u32, trial: u64) -> Vec<[Observation; 2]> {
    let X_10 = motion().inverse();
    let noise = |k: u32, lane: u32| noise::normal(trial, u64::from(k), lane);
    let uniform = |k: u32, lane: u32| noise::uniform(trial, u64::from(k), 20 + lane);
    (0..n)
        .map(|k| {
            let (a, b) = (1.6 * uniform(k, 0) - 0.8, 1.2 * uniform(k, 1) - 0.6);
            let z0 = [a, b, 1.0 / (1.0 + 7.0 * uniform(k, 2))];
            let mut z1 = seen(&X_10.transform_point(&point(&z0))).unwrap();
            for (i, sigma) in [vo.pixel, vo.pixel, vo.inverse_depth].into_iter().enumerate() {
                z1[i] += sigma * noise(k, i as u32);
            }
            if k < wrong {
                (0..2).for_each(|i| z1[i] += 0.1 + 0.3 * uniform(k, 5 + i as u32));
            }
            [[a, b, z0[2] + vo.inverse_depth * noise(k, 3)], z1]
        })
        .collect()
}

/// (τ, φ) of a motion beside the true one.
fn error(found: &Motion, truth: &Pose) -> Vector6<f64> {
    let t = truth.position - found.X_01.position;
    let r = (truth.rotation * found.X_01.rotation.inverse()).scaled_axis();
    Vector6::new(t.x, t.y, t.z, r.x, r.y, r.z)
}

#[test]
fn without_noise_it_is_exact_from_any_guess() {
    let vo = vo(1e-3, 1e-3);
    let exact = VisualOdometry { pixel: 0.0, inverse_depth: 0.0, ..vo };
    let pairs = made_up(&exact, 40, 0, 3);
    for guess in [Pose::identity(), motion(), Pose::translation(0.4, -0.3, 0.2)] {
        let found = vo.motion(&pairs, &guess, 1).unwrap();
        assert!(error(&found, &motion()).norm() < 1e-9 && found.agree == 40);
    }
}

#[test]
fn its_covariance_is_that_of_its_errors_and_wrong_matches_do_not_move_it() {
    let vo = vo(2e-3, 8e-3);
    for wrong in [0, 15] {
        let (mut sum, trials) = (0.0, 300);
        let mut worst = 0.0_f64;
        for trial in 0..trials {
            let pairs = made_up(&vo, 60, wrong, trial);
            let found = vo.motion(&pairs, &Pose::identity(), trial).unwrap();
            let e = error(&found, &motion());
            sum += e.dot(&(found.covariance.try_inverse().unwrap() * e));
            let off = e.fixed_rows::<3>(0).norm();
            worst = if off <= worst { worst } else { off };
            assert!(found.agree <= 61 - wrong as usize, "wrong matches agree: {}", found.agree);
        }
        // The normalised error is χ² with six degrees of freedom; the mean of 300 has a standard
        // deviation of √(12/300) = 0.2.
        let nees = sum / f64::from(trials as u32);
        println!("{wrong} wrong: normalised error squared {nees:.2}, at most {worst:.4} m off");
        assert!((5.0..7.0).contains(&nees) && worst < 0.05, "{nees} {worst}");
    }
}

#[test]
fn too_few_or_too_different_matches_are_no_motion() {
    let vo = vo(2e-3, 8e-3);
    assert!(vo.motion(&made_up(&vo, 11, 0, 1), &motion(), 1).is_none());
    assert!(vo.motion(&made_up(&vo, 40, 30, 1), &motion(), 1).is_none());
    // All matches are at one place, so they do not determine the rotation.
    let one = made_up(&vo, 1, 0, 1)[0];
    let found = vo.motion(&vec![one; 20], &Pose::identity(), 1);
    assert!(found.is_none_or(|m| m.covariance.trace() > 1.0), "{found:?}");
}

/// Uneven ground with the soil's texture.
fn ground() -> Scene {
    let heights = (0..121 * 121)
        .map(|k| {
            let (x, y) = (f64::from(k % 121) * 0.1, f64::from(k / 121) * 0.1);
            (0.08 * ((1.3 * x).sin() + (1.7 * y + 0.4 * x).cos())) as f32
        })
        .collect();
    let (origin, spacing) = ([-3.0, -6.0], [0.1; 2]);
    let map = HeightMap::new(Surface { origin, spacing, nx: 121, ny: 121, heights }).unwrap();
    let mut scene = Scene::new(Light::default());
    scene.set_ground(Arc::new(map), Look::soil()).unwrap();
    scene.settle();
    scene
}

const BASELINE: f64 = 0.3;

/// What a pair sees from a pose, its ranges found by matching.
fn pair(scene: &Scene, X_WC: Pose, number: u64, threads: usize) -> Picture {
    let (width, height) = (320, 240);
    let lens = Lens::Brown(Brown::ideal(width, height, 90f64.to_radians()));
    let camera = Camera::new(lens, width, height, 1).unwrap();
    let detector = Detector { noise: Noise::On, ..Detector::default() };
    let look = |pose: &Pose, key: u64| {
        let frame = camera.look(scene, pose, Want::Radiance, threads).unwrap();
        detector.read(&frame, key, number).unwrap()
    };
    let image = look(&X_WC, 5);
    let right = look(&right_of(&X_WC, BASELINE), 6);
    let matched = Matcher::default().match_pair(&image, &right).unwrap();
    let depth = matched.depth(&lens, BASELINE).unwrap();
    let range = depth.iter().enumerate().map(|(k, depth)| {
        let d = lens.ray([(k % width) as f64, (k / width) as f64]).unwrap().direction;
        let range = depth / d.z;
        if range < 12.0 { range as f32 } else { f32::NAN }
    });
    let range = range.collect();
    Picture { number, pose: X_WC, lens, width, height, range, image, ..Picture::default() }
}

/// A camera 2 m up that looks 35° down along a heading.
fn eye(x: f64, y: f64, heading: f64) -> Pose {
    let pitch = 35f64.to_radians();
    let forward = Vec3::new(heading.cos() * pitch.cos(), heading.sin() * pitch.cos(), -pitch.sin());
    let right = forward.cross(&Vec3::z()).normalize();
    let axes = Quat::from_basis_unchecked(&[right, forward.cross(&right), forward]);
    Pose::new(axes, Vec3::new(x, y, 2.0))
}

#[test]
fn pictures_of_a_drive_tell_its_motions_to_millimetres_in_any_number_of_threads() {
    let scene = ground();
    // Matches have a deviation of 0.15 pixels, disparities one of 0.25 pixels, and the focal length
    // is 160 pixels.
    let vo = vo(0.15 / 160.0, 0.25 / (160.0 * BASELINE));
    let drive = [
        eye(0.0, 0.0, 0.0),
        eye(0.25, 0.0, 0.0),
        eye(0.49, 0.03, 0.08),
        eye(0.49, 0.03, 0.2),
        eye(0.72, 0.07, 0.15),
        eye(0.72, 0.07, 0.15),
    ];
    let run = |threads: usize| {
        let pictures = drive.iter().enumerate();
        let pictures: Vec<_> =
            pictures.map(|(k, at)| pair(&scene, *at, k as u64 + 1, threads)).collect();
        let motion = |w: &[Picture]| {
            let old = vo.scenery(&w[0]);
            // The initial guess is 7 % short, like the odometry of wheels that slip.
            let truth = w[0].pose.inverse() * w[1].pose;
            let guess = Pose::new(truth.rotation, truth.position * 0.93);
            let pairs = vo.matches(&old, &w[1], &guess);
            (vo.motion(&pairs, &guess, 9), old.corners.len())
        };
        pictures.windows(2).map(motion).collect::<Vec<_>>()
    };
    let found = run(1);
    let mut sum = 0.0;
    for ((found, corners), w) in found.iter().zip(drive.windows(2)) {
        let found = found.unwrap();
        let e = error(&found, &(w[0].inverse() * w[1]));
        let nees = e.dot(&(found.covariance.try_inverse().unwrap() * e));
        let (t, r) = (e.fixed_rows::<3>(0).norm(), e.fixed_rows::<3>(3).norm());
        println!(
            "{corners} corners, {} of {} matches agree, {:.2} mm, {:.2} mrad, NEES {nees:.1}",
            found.agree,
            found.matches,
            1e3 * t,
            1e3 * r
        );
        sum += nees;
        assert!(found.agree > 50 && t < 0.01 && r < 0.003, "{t} {r}");
    }
    println!("mean NEES {:.1} of 6", sum / 5.0);
    assert!(sum / 5.0 < 20.0);
    assert_eq!(run(3), found);
}
