//! Ray rate on terrain like that of the rover's traverse: 100 m × 100 m at 0.1 m resolution with relief and 300 rocks in the heights. The mast camera
//! is 2 m above it. One thread and two threads are measured.
//!
//! Prints millions of rays per second, of the fastest of several frames. On one thread the CPU time of the thread is used, on two threads the wall
//! clock, which other programs on the machine slow down. `primary` computes depth and masks with one ray per pixel. `image` adds a shadow ray and a
//! texture. `lone` casts the primary rays one by one, without the bounds of tiles.
//!
//! Measured on a virtual machine with two cores of an Intel Xeon at 2.7 GHz, while other programs were running: primary 4.8 to 5.8 on one thread and
//! up to 8.4 on two, image 1.0 to 1.2 on one, lone 1.9 to 2.4. The target of the project is 20 on two threads.
#![allow(clippy::disallowed_methods, clippy::unwrap_used, missing_docs, non_snake_case)]

use linkwork_render::collision::Shape;
use linkwork_render::spatial::{Mat3, Pose, Quat, Vec3, quat};
use linkwork_render::*;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

const N: usize = 1001;
const SPACING: f64 = 0.1;

fn ground() -> HeightMap {
    let at = |k: usize| k as f64 * SPACING - 50.0;
    let waves = [(40.0, 0.35), (17.0, 0.15), (7.3, 0.06), (2.9, 0.025), (1.1, 0.01)];
    let mut heights = vec![0.0f32; N * N];
    for j in 0..N {
        for i in 0..N {
            let (x, y) = (at(i), at(j));
            let h = waves.iter().enumerate().map(|(k, (length, size))| {
                let (s, c) = (0.7 + 1.9 * k as f64).sin_cos();
                let w = std::f64::consts::TAU / length;
                size * ((w * (c * x - s * y)).sin() + (w * 0.83 * (s * x + c * y) + 1.0).sin())
            });
            heights[j * N + i] = h.sum::<f64>() as f32;
        }
    }
    for k in 0..300u32 {
        let place = |a: u32| f64::from(k.wrapping_mul(a) % 9973) / 9973.0 * 96.0 - 48.0;
        let (x, y, r) = (place(7919), place(104_729), 0.15 + 0.35 * f64::from(k % 7) / 7.0);
        let around =
            |v: f64| (((v - r + 50.0) / SPACING) as usize, ((v + r + 50.0) / SPACING) as usize + 1);
        let ((i0, i1), (j0, j1)) = (around(x), around(y));
        for j in j0..=j1.min(N - 1) {
            for i in i0..=i1.min(N - 1) {
                let rho = (at(i) - x).hypot(at(j) - y) / r;
                heights[j * N + i] += (r * (1.0 - rho * rho).max(0.0).sqrt()) as f32;
            }
        }
    }
    HeightMap::new(Surface { origin: [-50.0; 2], spacing: [SPACING; 2], nx: N, ny: N, heights })
        .unwrap()
}

/// Returns the CPU time of this thread, s, where Linux reports it, so that other programs do not affect it; otherwise the wall-clock time.
fn worked(since: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let own = told.and_then(|t| t.split(' ').next()?.parse::<f64>().ok());
    own.map_or_else(|| since.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// Returns the rate in millions per second: the best of several, by wall-clock time or by the CPU time of this thread.
fn rate(rays: usize, threads: usize, mut f: impl FnMut()) -> f64 {
    let start = Instant::now();
    let now = || if threads == 1 { worked(start) } else { start.elapsed().as_secs_f64() };
    let best = (0..15)
        .map(|_| {
            let before = now();
            f();
            now() - before
        })
        .fold(f64::INFINITY, f64::min);
    rays as f64 / best / 1e6
}

fn main() {
    let map = ground();
    let eye = Vec3::new(-12.0, 3.0, map.height(-12.0, 3.0).unwrap() + 2.0);
    let mut scene = Scene::new(Light::default());
    scene.set_ground(Arc::new(map), Look::soil()).unwrap();
    // Add the rover's deck, mast and wheels in front of the lens.
    for k in 0..6 {
        let at = eye + Vec3::new(0.8 * f64::from(k % 3) - 0.6, 1.2 * f64::from(k / 3) - 0.6, -1.7);
        let X = Pose::new(Quat::from_scaled_axis(Vec3::x() * 1.57), at);
        let wheel = Shape::Cylinder { radius: 0.25, half_length: 0.2 };
        scene.add(&format!("wheel {k}"), &wheel, Look::plain([0.3; 3]), X).unwrap();
    }
    let deck = Shape::Box { half: Vec3::new(0.8, 0.5, 0.1) };
    let at = eye - Vec3::z() * 1.1;
    scene.add("deck", &deck, Look::plain([0.7; 3]), Pose::translation(at.x, at.y, at.z)).unwrap();
    scene.settle();
    let z = Vec3::new(0.93, 0.2, -0.28).normalize();
    let x = z.cross(&Vec3::z()).normalize();
    let R = Mat3::from_columns(&[x, z.cross(&x), z]);
    let X_WC = Pose::new(quat(&R), eye);
    for (width, height) in [(160, 120), (640, 480), (1024, 1024)] {
        let lens = Lens::Brown(Brown::ideal(width, height, 45f64.to_radians()));
        let camera = Camera::new(lens, width, height, 1).unwrap();
        let frame = camera.look(&scene, &X_WC, Want::Geometry, 1).unwrap();
        let hits = frame.objects.iter().filter(|o| **o > 0).count();
        print!(
            "{width:>4} × {height:<4} hits {:3.0} %",
            100.0 * hits as f64 / frame.objects.len() as f64
        );
        for (name, want) in [("primary", Want::Depth), ("image", Want::Radiance)] {
            for threads in [1, 2] {
                let rate = rate(width * height, threads, || {
                    black_box(camera.look(&scene, &X_WC, want, threads).unwrap());
                });
                print!("   {name} on {threads}: {rate:6.2}");
            }
        }
        let rays: Vec<Vec3> = (0..width * height)
            .map(|k| R * lens.ray([(k % width) as f64, (k / width) as f64]).unwrap().direction)
            .collect();
        let lone = rate(rays.len(), 1, || {
            rays.iter().for_each(|d| {
                black_box(scene.cast(&eye, d, FAR));
            });
        });
        println!("   lone: {lone:6.2}");
    }
}
