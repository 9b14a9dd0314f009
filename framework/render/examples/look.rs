//! Renders rocks, a pole and a sphere on hilly terrain as a stereo pair of cameras sees them.
//! ```text
//! cargo run --release -p linkwork-render --example look -- FOLDER
//! ```
//! Writes `left.png` and `right.png` (12 bits grey, with noise), `colour.png` (8 bits), `objects.png` (masks), and `depth.png` of the stereo matching
//! (bright is near; black: no depth found), and prints the error of the depth.
#![allow(non_snake_case)]

use linkwork_render::collision::Shape;
use linkwork_render::spatial::{Mat3, Pose, Vec3, quat};
use linkwork_render::stereo::{Matcher, right_of};
use linkwork_render::*;
use std::path::Path;
use std::sync::Arc;

/// Image size in pixels, and the distance of the two cameras, m.
const SIZE: [usize; 2] = [640, 480];
const BASELINE: f64 = 0.2;
/// Depth that is shown as black, m.
const FARTHEST: f64 = 20.0;

fn scene() -> Result<Scene, RenderError> {
    let sun = Vec3::new(0.2, 0.75, 0.5).normalize();
    let mut scene = Scene::new(Light { sun, ..Light::default() });
    let (n, spacing) = (401, 0.1);
    let at = |k: usize| k as f64 * spacing - 20.0;
    let height = |x: f64, y: f64| {
        0.4 * (0.21 * x).sin() * (0.17 * y + 1.0).cos() + 0.05 * (1.3 * x + 0.9 * y).sin()
    };
    let heights = (0..n * n).map(|k| height(at(k % n), at(k / n)) as f32).collect();
    let map = Arc::new(HeightMap::new(Surface {
        origin: [-20.0; 2],
        spacing: [spacing; 2],
        nx: n,
        ny: n,
        heights,
    })?);
    scene.set_ground(map.clone(), Look::soil())?;
    let rock = Look { contrast: 0.4, grain: 0.1, class: 2, ..Look::plain([0.2, 0.15, 0.12]) };
    for k in 0..160 {
        let s = f64::from(k);
        let (x, y) = (19.0 * (2.4 * s).sin(), 19.0 * (1.7 * s + 0.3).cos());
        let size = 0.12 + 0.35 * (0.5 + 0.5 * (5.1 * s).sin()).powi(3);
        let corner = |c: i32| {
            let a = f64::from(c) + 7.0 * s;
            Vec3::new((1.9 * a).sin(), (2.7 * a).cos(), 0.7 * (3.1 * a).sin()) * size
        };
        let points = (0..14).map(corner).collect();
        let Some(z) = map.height(x, y).filter(|_| x.hypot(y + 14.0) > 2.0) else { continue };
        scene.add(
            &format!("rock {k}"),
            &Shape::ConvexHull { points },
            rock,
            Pose::translation(x, y, z + 0.2 * size),
        )?;
    }
    let on_ground =
        |x: f64, y: f64, up: f64| Pose::translation(x, y, map.height(x, y).unwrap_or(0.0) + up);
    let metal = Look { class: 3, ..Look::plain([0.7; 3]) };
    scene.add(
        "pole",
        &Shape::Cylinder { radius: 0.04, half_length: 1.0 },
        metal,
        on_ground(1.2, -8.5, 1.0),
    )?;
    let blue = Look { class: 3, contrast: 0.6, grain: 0.1, ..Look::plain([0.15, 0.25, 0.5]) };
    scene.add("ball", &Shape::Sphere { radius: 0.45 }, blue, on_ground(-1.0, -9.0, 0.45))?;
    scene.settle();
    Ok(scene)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("give the folder for the images")?;
    let folder = Path::new(&folder);
    let scene = scene()?;
    let z = Vec3::new(0.0, 1.0, -0.22).normalize();
    let R = Mat3::from_columns(&[Vec3::x(), z.cross(&Vec3::x()), z]);
    let left = Pose::new(quat(&R), Vec3::new(0.0, -14.0, 2.0));
    let lens = Lens::Brown(Brown::ideal(SIZE[0], SIZE[1], 45f64.to_radians()));
    let camera = Camera::new(lens, SIZE[0], SIZE[1], 2)?;
    let threads = std::thread::available_parallelism()?.get();
    let frames =
        [left, right_of(&left, BASELINE)].map(|X| camera.look(&scene, &X, Want::Radiance, threads));
    let [left, right] = frames;
    let (left, right) = (left?, right?);
    let detector = Detector { exposure: 0.02, ..Detector::default() };
    let (a, b) = (detector.read(&left, 1, 0)?, detector.read(&right, 2, 0)?);
    a.write_png(&folder.join("left.png"))?;
    b.write_png(&folder.join("right.png"))?;
    let colour =
        Detector { channels: Channels::Rgb, bits: 8, gain: detector.well / 255.0, ..detector };
    colour.read(&left, 3, 0)?.write_png(&folder.join("colour.png"))?;
    let grey =
        |data: Vec<u16>| Image { width: SIZE[0], height: SIZE[1], channels: 1, bits: 8, data };
    let number = |o: &u16| if *o == 0 { 0 } else { 40 + o % 8 * 30 };
    grey(left.objects.iter().map(number).collect()).write_png(&folder.join("objects.png"))?;
    let found = Matcher::default().match_pair(&a, &b)?;
    let depth = found.depth(&lens, BASELINE)?;
    let light = |z: &f64| if z.is_finite() { 255.0 * (1.0 - (z / FARTHEST).min(1.0)) } else { 0.0 };
    grey(depth.iter().map(|z| light(z) as u16).collect()).write_png(&folder.join("depth.png"))?;
    let mut off: Vec<f64> = depth
        .iter()
        .zip(&left.depth)
        .filter(|(z, t)| z.is_finite() && t.is_finite())
        .map(|(z, t)| ((z - t) / t).abs())
        .collect();
    off.sort_by(f64::total_cmp);
    if let Some(median) = off.get(off.len() / 2) {
        let share = 100.0 * off.len() as f64 / depth.len() as f64;
        println!(
            "{share:.0} % of the pixels have a depth; half of them have an error of less than {:.2} %",
            100.0 * median
        );
    }
    Ok(())
}
