//! A rover drives autonomously to its goal through rocks: its complete software, without dynamics.
//! ```text
//! ground     generated: relief of 0.2 m RMS, rocks of 0.2 to 1.8 m as Golombek's model with k = 0.08 has them, half as high as wide:
//!            those higher than the clearance are wider than 0.8 m
//! goal       80 m away; start and goal are clear of rocks
//! rover      a unicycle that does what it is told; its rectangle is 2.8 m × 2.8 m, as of Curiosity's class
//! camera     160 × 120 pixels, 90° wide, 2 m up on the front of the body, 35° below the horizon; rendered, a picture every 0.4 m
//! ```
use linkwork_environment::generator::{MadeRock, Recipe, make};
use linkwork_navigation::arcs::{Arcs, Body, Place};
use linkwork_navigation::assess::{Assessor, Limits};
use linkwork_navigation::map::Grid;
use linkwork_navigation::rover::{Knowledge, Memory, Pose, Rover, Status};
use linkwork_render::{Brown, Camera, HeightMap, Lens, Light, Look, Picture, Scene, Surface, Want};
use linkwork_spatial::{Pose as Frame, Quat, Vec3};
use std::sync::Arc;

const START: Place = [-40.0, 0.0, 0.0];
const GOAL: [f64; 2] = [40.0, 0.0];
/// Higher rocks touch the rover's body.
const CLEARANCE: f64 = 0.4;
/// Seconds between samples, and samples between images.
const SAMPLE: f64 = 0.4;
const EVERY: u32 = 4;

fn rover() -> Rover {
    let body = Body { length: 2.8, width: 2.8, discs: 2 };
    let arcs = Arcs {
        count: 23,
        curvature_max: 0.4,
        length: 4.0,
        step: 0.2,
        near: 1.0,
        leave: 0.3,
        share: 0.4,
        scale: 4.0,
        turn_cost: 1.0,
        stop_cost: 1.0,
        back_cost: 3.0,
        hysteresis: 0.03,
        body,
    };
    Rover {
        goal: GOAL,
        tolerance: 0.5,
        speed: 0.25,
        spot_rate: 0.12,
        tilt_max: 0.6,
        slip_max: 2.0,
        patience: 20.0,
        progress: 400.0,
        weight: 2.0,
        unknown: 0.7,
        coarse: 3,
        margin: 15.0,
        // The ground ends at 55 m and 25 m.
        keep_in: [-53.0, -23.0, 53.0, 23.0],
        look_ahead: 3.0,
        body_margin: 0.1,
        sight: 9.0,
        keep_out: vec![],
        free: vec![[START[0], START[1], 3.0]],
        grid: Grid { cell: 0.1, memory: f64::INFINITY },
        arcs,
    }
}

fn judge(rover: &Rover) -> Assessor {
    let limits = Limits {
        radius: rover.arcs.body.radius() + 0.15,
        step_width: 0.5,
        tilt: 25f64.to_radians(),
        roughness: 0.25,
        step: 0.3,
        seen: 0.4,
    };
    Assessor::new(rover.grid.cell, limits).unwrap()
}

struct World {
    scene: Scene,
    ground: Arc<HeightMap>,
    rocks: Vec<MadeRock>,
}

fn world(seed: u64) -> World {
    let recipe = Recipe {
        seed,
        size: [110.0, 50.0],
        spacing: 0.1,
        slope: [0.0; 2],
        relief: 0.2,
        hurst: 0.8,
        wavelength: 40.0,
        craters: 0,
        crater_diameters: [1.5, 9.0],
        crater_age: 0.0,
        crater_diffusivity: 5.5,
        dunes: None,
        landforms: vec![],
        rock_cover: 0.08,
        rock_diameters: [0.2, 1.8],
        rock_burial: [0.5, 0.5],
        clear: vec![[START[0], START[1], 4.0], [GOAL[0], GOAL[1], 3.0]],
    };
    let (field, rocks) = make(&recipe).unwrap();
    let [nx, ny] = field.size();
    let (origin, spacing) = (field.origin(), field.spacing());
    let heights = field.heights().to_vec();
    let ground = Arc::new(HeightMap::new(Surface { origin, spacing, nx, ny, heights }).unwrap());
    let mut scene = Scene::new(Light::default());
    scene.set_ground(ground.clone(), Look::plain([0.3; 3])).unwrap();
    scene.settle();
    World { scene, ground, rocks }
}

/// Returns the overlap (m) of the rover with the rock above its clearance that overlaps most; negative if it touches none.
fn overlap(w: &World, [x, y, heading]: Place, half: [f64; 2]) -> f64 {
    let (s, c) = heading.sin_cos();
    let depth = |r: &MadeRock| {
        let (dx, dy) = (r.x - x, r.y - y);
        let (along, left) = ((c * dx + s * dy).abs() - half[0], (c * dy - s * dx).abs() - half[1]);
        let off = along.max(0.0).hypot(left.max(0.0)) + along.max(left).min(0.0);
        0.5 * r.diameter - off
    };
    let high = w.rocks.iter().filter(|r| r.height > CLEARANCE);
    high.map(depth).fold(f64::NEG_INFINITY, f64::max)
}

/// Result of a drive.
struct Outcome {
    status: Status,
    /// Deepest overlap with a rock higher than the clearance, m.
    deepest: f64,
    /// Distance driven, m.
    way: f64,
    time: f64,
    place: Place,
}

fn drive(seed: u64) -> Outcome {
    let (w, rover) = (world(seed), rover());
    let judge = judge(&rover);
    let lens = Lens::Brown(Brown::ideal(160, 120, 90f64.to_radians()));
    let camera = Camera::new(lens, 160, 120, 1).unwrap();
    let (mut k, mut memory) = (Knowledge::default(), Memory::default());
    let mut at = START;
    let half = [rover.arcs.body.length, rover.arcs.body.width].map(|l| 0.5 * l);
    let (mut deepest, mut way) = (f64::NEG_INFINITY, 0.0);
    let mut time = 0.0;
    for n in 0..4000u32 {
        time = f64::from(n) * SAMPLE;
        if n % EVERY == 0 {
            let height = w.ground.height(at[0], at[1]).unwrap();
            let eye = Vec3::new(at[0] + 0.7 * at[2].cos(), at[1] + 0.7 * at[2].sin(), height + 2.0);
            let (turn, pitch) = (at[2], 35f64.to_radians());
            let forward =
                Vec3::new(turn.cos() * pitch.cos(), turn.sin() * pitch.cos(), -pitch.sin());
            let right = forward.cross(&Vec3::z()).normalize();
            let axes = Quat::from_basis_unchecked(&[right, forward.cross(&right), forward]);
            let X_WC = Frame::new(axes, eye);
            let frame = camera.look(&w.scene, &X_WC, Want::Depth, 1).unwrap();
            let near = |r: &f64| if *r <= rover.sight + 2.0 { *r as f32 } else { f32::NAN };
            let range = frame.range.iter().map(near).collect();
            let [width, height] = camera.size();
            let picture = Picture { pose: X_WC, lens, width, height, range, ..Picture::default() };
            let points: Vec<Vec3> = picture.points().collect();
            rover.see(&judge, &mut k, &points, at, time);
        }
        let pose = Pose { place: at, tilt: 0.0, slip: 0.0 };
        let [speed, turn] = rover.decide(&judge, &mut k, &mut memory, &pose, time, true);
        if !memory.status.goes_on() {
            break;
        }
        // The command moves the rover along an arc of a circle.
        if let Some(mv) = memory.doing {
            at = rover.after(at, mv, SAMPLE);
            way += speed.abs() * SAMPLE;
        } else {
            assert_eq!([speed, turn], [0.0; 2]);
        }
        deepest = deepest.max(overlap(&w, at, half));
    }
    Outcome { status: memory.status, deepest, way, time, place: at }
}

/// Number of fields: 4, or `LINKWORK_FIELDS`. Of 100 all lead to the goal, after 97 m in the median and at most 209 m; the smallest distance to a
/// rock that is too high is 0.08 m. They take ten minutes of processor time.
fn fields() -> u64 {
    std::env::var("LINKWORK_FIELDS").map_or(4, |n| n.parse().unwrap())
}

/// Drives several seeds, in as many threads as there are cores.
fn drives(seeds: std::ops::RangeInclusive<u64>) -> Vec<(u64, Outcome)> {
    let next = std::sync::atomic::AtomicU64::new(*seeds.start());
    let some = || {
        let mut out = vec![];
        loop {
            let seed = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            if !seeds.contains(&seed) {
                return out;
            }
            let o = drive(seed);
            println!(
                "seed {seed}: {:?}, {:.1} m in {:.0} s, at {:.1?}, rocks {:.3} m",
                o.status, o.way, o.time, o.place, o.deepest
            );
            out.push((seed, o));
        }
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|s| {
        let threads: Vec<_> = (0..cores).map(|_| s.spawn(some)).collect();
        threads.into_iter().flat_map(|t| t.join().unwrap()).collect()
    })
}

#[test]
fn it_reaches_its_goal_and_touches_no_rock_that_is_too_high() {
    let drives = drives(1..=fields());
    let failed: Vec<_> = drives.iter().filter(|(_, o)| o.status != Status::Arrived).collect();
    for (seed, o) in &failed {
        println!("seed {seed}: {:?} at {:.1?} after {:.1} m", o.status, o.place, o.way);
    }
    println!("{} of {} arrive", drives.len() - failed.len(), drives.len());
    let deepest = drives.iter().map(|(_, o)| o.deepest).fold(f64::NEG_INFINITY, f64::max);
    println!("nearest to a rock that is too high: {:.3} m", -deepest);
    // At least 95 of 100 drives must reach the goal.
    assert!(!drives.is_empty() && failed.len() * 20 <= drives.len());
    assert!(drives.iter().all(|(_, o)| o.deepest < 0.0));
}
