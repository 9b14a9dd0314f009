//! Cameras of a simulation: images of moving bodies, their state in checkpoints, their output in logs and viewers.
use linkwork_record::{Entry, Log, LogSpec, walk_log};
use linkwork_render::Picture;
use linkwork_runtime::{Recorder, Seconds, Simulation};

use crate::common;

/// A ball on a string swings in front of a camera on a mast and a wall; a second camera sees only the wall.
const SWING: &str = r#"Simulation(
    doc: "A ball before two cameras.",
    parts: {
        "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -3.72076] }),
        "Camera": (model: "sensors.camera", rate: "50 ms", bind: { "mount": "node:mast/lens" },
            params: { "width": 80, "height": 60, "view": "50 deg" }),
        "Blind": (model: "sensors.camera", rate: "100 ms", bind: { "mount": "node:mast/lens" },
            params: { "width": 16, "height": 12, "sees": ["world"] }),
    },
    bodies: {
        "mast": (parent: "world", hinge: Locked, mass: 1, inertia: [1, 1, 1],
            nodes: { "lens": (position: [-5, 0, -1]) }),
        "ball": (parent: "world", hinge: Pin([1, 0, 0]), mass: 1, inertia: [1, 1, 1],
            com: [0, 0, -1], initial: (angle: "40 deg"),
            shapes: [(shape: Sphere(0.2), at: (position: [0, 0, -1]), color: [0.9, 0.2, 0.1])]),
    },
    colliders: { "wall": (on: "world", shape: Box([0.2, 20, 20]), at: (position: [3, 0, 0])) },
    step: "1 ms", integrator: "rk4", until: "2 s",
)"#;

fn seconds(milliseconds: u64) -> Seconds {
    Seconds { num: milliseconds, den: 1000 }
}

fn picture(sim: &Simulation, camera: &str) -> Picture {
    sim.seen::<Picture>(camera).unwrap().data.clone()
}

/// Returns the column of the middle of the object with a given number in the mask.
fn middle(picture: &Picture, object: u16) -> Option<f64> {
    let of = |(k, o): (usize, &u16)| (*o == object).then_some((k % picture.width) as f64);
    let columns: Vec<f64> = picture.objects.iter().enumerate().filter_map(of).collect();
    (!columns.is_empty()).then(|| columns.iter().sum::<f64>() / columns.len() as f64)
}

#[test]
fn a_camera_sees_bodies_where_they_are_at_its_samples() {
    let mut sim = common::scene(SWING, &[]).unwrap_or_else(|e| panic!("{e}"));
    let focal = 40.0 / 25.0_f64.to_radians().tan();
    for k in 0..40 {
        sim.run_until(seconds(50 * k)).unwrap();
        let angle = sim.get("ball.angle").unwrap();
        let seen = picture(&sim, "Camera");
        assert!(seen.number == k + 1 && (seen.time - 0.05 * k as f64).abs() < 1e-12);
        // The ball hangs 1 m below the hinge and rotates about x: y = sin θ, left is +y.
        let y = angle.sin();
        let want = 39.5 - focal * y / 5.0;
        let ball = middle(&seen, 2).unwrap();
        assert!((ball - want).abs() < 0.6, "{k}: column {ball}, not {want}");
        // The nearest range is 5 m to the wall behind the ball less half its thickness, or the
        // distance of the ball less its radius.
        let near = seen.range.iter().copied().fold(f32::INFINITY, f32::min);
        let of_ball = (25.0 + y * y + (1.0 - angle.cos()).powi(2)).sqrt() - 0.2;
        assert!((f64::from(near) - of_ball).abs() < 6e-3, "{near} {of_ball}");
        let blind = picture(&sim, "Blind");
        assert_eq!(blind.number, k / 2 + 1);
        assert!(blind.objects.iter().all(|o| *o == 2), "the wall alone, and all over");
    }
}

#[test]
fn split_equals_straight_with_cameras() {
    let new = || common::scene(SWING, &[]).unwrap_or_else(|e| panic!("{e}"));
    let mut straight = new();
    straight.run_until(seconds(700)).unwrap();
    let mut sim = new();
    for ms in [1, 49, 50, 51, 333] {
        sim.run_until(seconds(ms)).unwrap();
        let saved = sim.checkpoint("").unwrap();
        // A fork does not influence the run, and a stored image stays unchanged.
        let kept = sim.seen::<Picture>("Camera").unwrap();
        let before = kept.data.clone();
        let mut other = sim.fork();
        other.run_until(seconds(ms + 120)).unwrap();
        sim.run_until(seconds(ms + 60)).unwrap();
        assert_eq!(kept.data, before);
        sim = new();
        sim.restore(&saved).unwrap();
        assert_eq!(picture(&sim, "Camera"), before, "a picture is in the checkpoint");
    }
    sim.run_until(seconds(700)).unwrap();
    assert_eq!(sim.hash(), straight.hash());
    assert_eq!(picture(&sim, "Camera"), picture(&straight, "Camera"));
}

#[test]
fn a_log_has_every_picture_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut sim = common::scene(SWING, &[]).unwrap_or_else(|e| panic!("{e}"));
    let program = sim.program().clone();
    let (log, groups) = Log::create(&path, &program, &LogSpec::default()).unwrap();
    let mut recorder = Recorder::start(&sim, groups, 8, Box::new(log)).unwrap();
    recorder.sample(&sim).unwrap();
    let mut last = None;
    for ms in 1..=400 {
        sim.run_until(seconds(ms)).unwrap();
        recorder.sample(&sim).unwrap();
        if ms == 400 {
            last = Some(picture(&sim, "Camera").image);
        }
    }
    recorder.finish().unwrap();
    let mut found: Vec<(u64, String, Vec<u8>)> = Vec::new();
    walk_log::<linkwork_record::LogError>(&path, |entry| {
        if let Entry::Picture { ns, camera, png } = entry {
            found.push((ns / 1_000_000, camera, png));
        }
        Ok(())
    })
    .unwrap();
    let times =
        |name: &str| -> Vec<u64> { found.iter().filter(|f| f.1 == name).map(|f| f.0).collect() };
    assert_eq!(times("Camera"), (0..=8).map(|k| 50 * k).collect::<Vec<_>>());
    assert_eq!(times("Blind"), [0, 100, 200, 300, 400]);
    // The file equals the image, pixel by pixel.
    let png = &found.iter().rfind(|f| f.1 == "Camera").unwrap().2;
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    let image = last.unwrap();
    assert_eq!(bytes, image.data.iter().map(|v| *v as u8).collect::<Vec<_>>());
}

#[test]
fn who_sees_nothing_is_refused() {
    let text = SWING.replace("[\"world\"]", "[\"bal\"]");
    let told = common::scene(&text, &[]).err().unwrap();
    for part in ["`Blind.sees`: no body with a shape is `bal`", "did you mean `ball`?"] {
        assert!(told.contains(part), "{told}");
    }
    // An invalid camera is one error: its readers do not additionally report it as missing.
    let set = "Rover.NavigationSoftware.Camera.sees=[\"nobody\"]";
    let told = common::repository("rover_navigation/sim.ron", &[set]).err().unwrap();
    assert!(told.contains("no body with a shape") && !told.contains("no field"), "{told}");
    let text = SWING.replace("\"sees\": [\"world\"]", "\"baseline\": 0.1, \"radial\": [0.1, 0, 0]");
    let told = common::scene(&text, &[]).err().unwrap();
    assert!(told.contains("stereo matching does not support lens distortion"), "{told}");
}
