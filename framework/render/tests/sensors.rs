//! Detectors, lidar and stereo: statistics of their noise, closed forms, errors.

use linkwork_render::collision::Shape;
use linkwork_render::lidar::{Echo, Lidar, flash, middles, spinning};
use linkwork_render::spatial::{Pose, Quat, Vec3};
use linkwork_render::stereo::{Matcher, right_of};
use linkwork_render::*;

/// A frame of uniform radiance.
fn grey(level: f32, n: usize) -> Frame {
    Frame { width: n, height: n, radiance: vec![[level; 3]; n * n], ..Frame::default() }
}

fn moments(image: &Image) -> [f64; 2] {
    let n = image.data.len() as f64;
    let mean = image.data.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
    [mean, image.data.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / (n - 1.0)]
}

/// Photon transfer: variance of the numbers against their mean is a line of slope 1/g.
#[test]
fn photons_and_reading_have_their_variances() {
    let n = 200;
    for (level, exposure) in
        [(0.0f32, 0.01), (0.03, 0.01), (2.0, 0.01), (60.0, 0.01), (60.0, 0.002)]
    {
        let d = Detector {
            bits: 16,
            gain: 0.9,
            offset: 600.0,
            exposure,
            dark_current: 300.0,
            ..Detector::default()
        };
        let electrons = (d.sensitivity * f64::from(level) + d.dark_current) * exposure;
        let [mean, variance] = moments(&d.read(&grey(level, n), 5, 0).unwrap());
        // Quantization adds a variance of 1/12. The bounds are four standard errors of mean and
        // variance.
        let want = (electrons + d.read_noise.powi(2)) / d.gain.powi(2) + 1.0 / 12.0;
        let count = (n * n) as f64;
        let off = mean - d.offset - electrons / d.gain;
        assert!(off.abs() < 4.0 * (want / count).sqrt(), "{level}: {mean}");
        assert!(
            (variance / want - 1.0).abs() < 4.0 * (2.0 / count).sqrt(),
            "{level}: {variance} {want}"
        );
    }
    // Without noise the value is exact, saturates above full well, and is half as large for half the exposure
    // time.
    let quiet = Detector { noise: Noise::Off, dark_current: 0.0, ..Detector::default() };
    let one = |d: &Detector, level: f32| d.read(&grey(level, 1), 0, 0).unwrap().data[0];
    assert_eq!(one(&quiet, 130.0), 4095);
    assert_eq!(one(&quiet, 1e9), 4095);
    assert_eq!(one(&quiet, 65.0), 2048);
    assert_eq!(one(&Detector { exposure: 0.005, ..quiet }, 65.0), 1024);
    let rgb = Detector { channels: Channels::Rgb, bits: 8, gain: 50_000.0 / 255.0, ..quiet };
    let frame =
        Frame { width: 1, height: 1, radiance: vec![[130.0, 66.0, 0.0]], ..Frame::default() };
    assert_eq!(rgb.read(&frame, 0, 0).unwrap().data, [255, 129, 0]);
}

#[test]
fn a_png_comes_back_as_it_was() {
    let data: Vec<u16> = (0..12).map(|k| k * 340).collect();
    for (bits, channels) in [(12, 1), (12, 3), (8, 3), (16, 1)] {
        let top = (1u32 << bits) - 1;
        let data: Vec<u16> =
            data.iter().map(|v| (u32::from(*v) * top / 4095).min(top) as u16).collect();
        let image = Image {
            width: 4 / channels.min(2),
            height: 12 / channels / (4 / channels.min(2)),
            channels,
            bits,
            data,
        };
        let mut file = vec![];
        image.png(&mut file).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&file)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((info.width as usize, info.height as usize), (image.width, image.height));
        let back: Vec<u16> = match info.bit_depth {
            png::BitDepth::Eight => bytes.iter().map(|b| u16::from(*b)).collect(),
            _ => bytes.chunks(2).map(|b| u16::from_be_bytes([b[0], b[1]]) >> (16 - bits)).collect(),
        };
        assert_eq!(back, image.data, "{bits} {channels}");
    }
    let image = Image { width: 1, height: 1, channels: 1, bits: 8, data: vec![3] };
    for bits in [4, 17] {
        let e = Image { bits, ..image.clone() }.png(&mut vec![]).unwrap_err();
        assert!(e.contains("8 to 16"), "{e}");
    }
    let e = image.write_png(std::path::Path::new("/no/such/folder/a.png")).unwrap_err();
    assert!(e.to_string().contains("/no/such/folder/a.png"));
}

fn lidar(beams: Vec<Vec3>) -> Lidar {
    Lidar { beams, limits: [0.3, 60.0], reach: 200.0, sigma: 0.0, resolution: 0.0, drop_out: 0.0 }
}

fn room() -> Scene {
    let mut scene = Scene::new(Light::default());
    let white = Look::plain([0.8; 3]);
    scene.add("floor", &Shape::HalfSpace, white, Pose::identity()).unwrap();
    let wall = Pose::new(
        Quat::from_scaled_axis(-Vec3::y() * std::f64::consts::FRAC_PI_2),
        Vec3::x() * 10.0,
    );
    scene.add("wall", &Shape::HalfSpace, white, wall).unwrap();
    scene.settle();
    scene
}

fn scan(lidar: &Lidar, scene: &Scene, X: &Pose, count: u64) -> Vec<Echo> {
    lidar.check().unwrap();
    let mut out = vec![];
    lidar.scan(scene, X, 9, count, &mut out).unwrap();
    out
}

#[test]
fn ranges_to_a_floor_and_a_wall_are_exact() {
    let scene = room();
    let X = Pose::new(Quat::from_scaled_axis(Vec3::z() * 0.3), Vec3::new(0.0, 0.0, 1.5));
    let all = spinning(&middles(-3.0, 3.0, 121), &middles(-0.4, 0.2, 16));
    let all = [all, flash(64, 48, 0.8)].concat();
    let echoes = scan(&lidar(all.clone()), &scene, &X, 0);
    let (mut floor, mut wall) = (0, 0);
    for (beam, echo) in all.iter().zip(&echoes) {
        let d = X.rotation * beam;
        let to_floor = if d.z < 0.0 { 1.5 / -d.z } else { f64::INFINITY };
        let to_wall = if d.x > 0.0 { 10.0 / d.x } else { f64::INFINITY };
        let want = to_floor.min(to_wall);
        match want <= 60.0 {
            true => assert!((echo.range - want).abs() < 1e-9, "{d}: {} {want}", echo.range),
            false => assert!(echo.range.is_infinite() && echo.object == 0 && echo.strength == 0.0),
        }
        floor += usize::from(echo.object == 2);
        wall += usize::from(echo.object == 3);
        if echo.object == 3 {
            let strength = 0.8 * d.x * (200.0 / want).powi(2);
            assert!((echo.strength / strength - 1.0).abs() < 1e-9);
        }
    }
    assert!(floor > 500 && wall > 500, "{floor} {wall}");
    // Test range limits at which the echo of the wall is barely detected or missed: ρ cos (R/r)² =
    // 1 at R = 10/√0.8.
    let ahead = |reach: f64| {
        let l = Lidar { reach, ..lidar(vec![Vec3::x()]) };
        scan(&l, &scene, &Pose::translation(0.0, 0.0, 1.0), 0)[0].range
    };
    let just = 10.0 / 0.8f64.sqrt();
    assert!(ahead(just * 1.001).is_finite() && ahead(just * 0.999).is_infinite());
}

#[test]
fn a_lidars_noise_has_its_spread_its_steps_and_its_losses() {
    let scene = room();
    let noisy = Lidar { sigma: 0.03, drop_out: 0.2, ..lidar(vec![Vec3::x(); 20_000]) };
    let X = Pose::translation(2.0, 0.0, 1.0);
    let echoes = scan(&noisy, &scene, &X, 4);
    assert_eq!(echoes, scan(&noisy, &scene, &X, 4));
    assert_ne!(echoes, scan(&noisy, &scene, &X, 5));
    let found: Vec<f64> = echoes.iter().map(|e| e.range).filter(|r| r.is_finite()).collect();
    let n = found.len() as f64;
    // The bounds are four standard errors of a fraction, a mean and a variance.
    assert!((n / 20_000.0 - 0.8).abs() < 4.0 * (0.16f64 / 20_000.0).sqrt(), "{n}");
    let mean = found.iter().sum::<f64>() / n;
    let variance = found.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / n;
    assert!((mean - 8.0).abs() < 4.0 * 0.03 / n.sqrt(), "{mean}");
    assert!((variance / 9e-4 - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{variance}");
    let stepped = Lidar { resolution: 0.25, ..noisy };
    let steps = scan(&stepped, &scene, &X, 4);
    assert!(steps.iter().all(|e| !e.range.is_finite() || (e.range / 0.25).fract() == 0.0));
}

#[test]
fn what_is_no_lidar_and_no_pair_is_refused() {
    let good = lidar(vec![Vec3::x()]);
    for (bad, word) in [
        (lidar(vec![]), "number of beams"),
        (lidar(vec![Vec3::x() * 2.0]), "direction"),
        (Lidar { limits: [5.0, 1.0], ..good.clone() }, "greatest range"),
        (Lidar { drop_out: 1.5, ..good.clone() }, "drop-out"),
        (Lidar { sigma: f64::NAN, ..good.clone() }, "deviation"),
    ] {
        let e = bad.check().unwrap_err().to_string();
        assert!(e.contains(word) && e.contains("help:"), "{e}");
    }
    let nowhere = Pose::translation(0.0, f64::INFINITY, 0.0);
    assert!(
        good.scan(&room(), &nowhere, 0, 0, &mut vec![]).unwrap_err().to_string().contains("lidar")
    );
    let image = |w: usize, h: usize| Image {
        width: w,
        height: h,
        channels: 1,
        bits: 8,
        data: vec![0; w * h],
    };
    let m = Matcher::default();
    let refused = |r: Result<_, RenderError>, word: &str| {
        let e: RenderError = r.map(|_: stereo::Disparities| ()).unwrap_err();
        assert!(e.to_string().contains(word), "{e}");
    };
    refused(m.match_pair(&image(80, 60), &image(80, 61)), "80 by 61");
    refused(m.match_pair(&image(40, 60), &image(40, 60)), "disparities");
    refused(Matcher { half_window: 0, ..m }.match_pair(&image(80, 60), &image(80, 60)), "window");
    let colour = Image { channels: 3, data: vec![0; 3 * 4800], ..image(80, 60) };
    refused(m.match_pair(&colour, &colour.clone()), "colours");
    refused(
        m.match_pair(&Image { data: vec![0; 3], ..image(80, 60) }, &image(80, 60)),
        "number per pixel",
    );
    // Stripes with a period of six pixels match in many places, so none is certain.
    let stripes = |x: usize| if x % 6 < 3 { 900 } else { 200 };
    let data: Vec<u16> = (0..80 * 60).map(|p| stripes(p % 80)).collect();
    let striped = Image { data, ..image(80, 60) };
    let found = m.match_pair(&striped, &striped).unwrap();
    assert!(found.data.iter().all(|d| d.is_nan()), "{:?}", found.data.iter().find(|d| !d.is_nan()));
    // Uniform images do not match anywhere.
    let blank = m.match_pair(&image(80, 60), &image(80, 60)).unwrap();
    assert!(blank.data.iter().all(|d| d.is_nan()));
    let e = blank
        .depth(&Lens::Brown(Brown { radial: [0.1, 0.0, 0.0], ..Brown::ideal(80, 60, 1.0) }), 0.2);
    assert!(e.unwrap_err().to_string().contains("distortion"));
}

/// Returns the RMS depth error over pixels of a textured wall, from noisy images at a distance.
fn error_at(distance: f64) -> (f64, f64, f64) {
    let (width, height, baseline) = (320, 120, 0.3);
    let lens = Lens::Brown(Brown::ideal(width, height, 0.8));
    let camera = Camera::new(lens, width, height, 3).unwrap();
    let sun = Vec3::new(0.3, 0.2, -1.0).normalize();
    let mut scene = Scene::new(Light { sun, ..Light::default() });
    // The texture has the same size in pixels at each distance, on a rotated wall, so that all subpixel positions occur.
    let look = Look { contrast: 0.9, grain: 0.035 * distance, ..Look::plain([0.4; 3]) };
    let X = Pose::new(Quat::from_scaled_axis(Vec3::y() * 0.2), Vec3::new(0.0, 0.0, distance + 0.5));
    let wall = Shape::Box { half: Vec3::new(5.0 * distance, 5.0 * distance, 0.5) };
    scene.add("wall", &wall, look, X).unwrap();
    scene.settle();
    let left = Pose::identity();
    let right = right_of(&left, baseline);
    let frames = [left, right].map(|X| camera.look(&scene, &X, Want::Radiance, 2).unwrap());
    let detector = Detector { sensitivity: 30_000.0, read_noise: 30.0, ..Detector::default() };
    let images = [0, 1].map(|k| detector.read(&frames[k], 17 + k as u64, 0).unwrap());
    let found = Matcher::default().match_pair(&images[0], &images[1]).unwrap();
    let depth = found.depth(&lens, baseline).unwrap();
    let Lens::Brown(Brown { focal, .. }) = lens else { unreachable!() };
    let (mut n, mut square, mut pixels) = (0.0, 0.0, 0.0);
    for (k, z) in depth.iter().enumerate().filter(|(_, z)| z.is_finite()) {
        let truth = frames[0].depth[k];
        // Use the middle of the image, where the wall is near its nominal distance. Mismatches are counted
        // separately.
        let off = f64::from(found.data[k]) - focal[0] * baseline / truth;
        if (k % width).abs_diff(width / 2) < 60 && off.abs() < 1.0 {
            n += 1.0;
            square += (z - truth).powi(2);
            pixels += off * off;
        }
    }
    (f64::sqrt(square / n), f64::sqrt(pixels / n), n / (119.0 * 120.0))
}

#[test]
fn the_error_of_stereo_grows_with_the_square_of_distance() {
    let all = [4.0, 8.0, 16.0, 32.0].map(|z| (z, error_at(z)));
    for (z, (depth, pixels, share)) in &all {
        println!("{z:4} m: RMS {depth:.4} m, {pixels:.3} pixels, {:.0} % of pixels", 100.0 * share);
        assert!(*share > 0.7 && *pixels < 0.3, "{z}: {pixels} {share}");
    }
    // Fit the slope of log error over log distance by least squares.
    let points: Vec<[f64; 2]> = all.iter().map(|(z, e)| [f64::ln(*z), e.0.ln()]).collect();
    let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64;
    let (mx, my) = (mean(0), mean(1));
    let top: f64 = points.iter().map(|p| (p[0] - mx) * (p[1] - my)).sum();
    let slope = top / points.iter().map(|p| (p[0] - mx).powi(2)).sum::<f64>();
    println!("error grows as distance to the {slope:.2}");
    assert!((slope - 2.0).abs() < 0.2, "{slope}");
}
