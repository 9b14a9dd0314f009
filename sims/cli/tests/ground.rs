//! Overlays of parts on the ground are in the recording of a run and in a recording from its log, and do not change the run.
#![cfg(feature = "viewer")]
use crate::common::{Lab, sim};
use linkwork_record::{Entry, LogError, walk_log};
use linkwork_runtime::OverlayValues;
use std::collections::{BTreeMap, BTreeSet};

/// Runs a simulation with and without a log and a recording: the runs are equal bit for bit, and a recording from the log shows the same as that of
/// the run. Returns how often each number was recorded.
fn seen(lab: &Lab, simulation: &str, until: &str, more: &[&str]) -> BTreeMap<String, usize> {
    let run = |out: &str, also: &[&str]| {
        let head = ["run", simulation, "--until", until, "--out", out];
        lab.linkwork(&[&head[..], more, also].concat()).code(0);
    };
    run("out", &[]);
    run("alone", &["--no-log", "--save-rrd", "off"]);
    assert_eq!(lab.hash("out"), lab.hash("alone"));
    lab.linkwork(&["view", "out/run.mcap", "--out", "view.rrd"]).code(0);
    let said = lab.linkwork(&["diff", "out/run.rrd", "view.rrd"]);
    // A log contains images as PNG files, but not the positions of the camera.
    let differ = |line: &&str| line.starts_with("  ") && !line.contains("  /cameras/");
    assert!(!said.out.lines().any(|line| differ(&line)), "{}", said.out);
    let shown = linkwork_viz::read_recording(&lab.path("view.rrd")).unwrap();
    shown.into_iter().map(|(name, (t, _))| (name, t.len())).collect()
}

/// Returns the last values of the tiles in a log, by part and corner.
fn tiles(lab: &Lab) -> BTreeMap<(String, String), OverlayValues> {
    let mut all = BTreeMap::new();
    walk_log::<LogError>(&lab.path("out/run.mcap"), |entry| {
        if let Entry::Tile { part, tile, .. } = entry {
            all.insert((part.to_string(), format!("{:?}", tile.corner)), tile.seen);
        }
        Ok(())
    })
    .unwrap();
    all
}

fn changes(lab: &Lab, part: &str) -> Vec<f32> {
    let mut out = Vec::new();
    for ((of, _), seen) in tiles(lab) {
        assert_eq!(of, part);
        let OverlayValues::Change(values) = seen else { panic!("{seen:?}") };
        out.extend(values);
    }
    out
}

/// Returns the number of tiles that were drawn again.
fn redrawn(shown: &BTreeMap<String, usize>, what: &str) -> usize {
    let of = |name: &str| name.contains("/Terrain/tile") && name.ends_with(what);
    shown.iter().filter(|(name, times)| of(name) && **times > 1).count()
}

#[test]
fn ruts_are_seen() {
    let lab = Lab::new();
    let shown = seen(&lab, &sim("dunes"), "3s", &[]);
    assert!(redrawn(&shown, "Mesh3D:vertex_positions[0]") > 0, "{:#?}", shown.keys());
    let changes = changes(&lab, "Rover.Environment.Ruts.Tracks");
    let deepest = changes.iter().copied().fold(0.0, f32::min);
    assert!((-0.1..-0.002).contains(&deepest), "{deepest}");
    assert!(changes.iter().all(|c| *c <= 0.0));
}

#[test]
fn heaps_are_seen() {
    let lab = Lab::new();
    let scm = [
        "--set",
        "Rover.contact=mobility.wheel_scm",
        "--set",
        "Rover.world_params={\"ruts\": \"scm\", \"height\": \"0.2 m\"}",
    ];
    let shown = seen(&lab, &sim("dunes"), "2s", &scm);
    assert!(redrawn(&shown, "Mesh3D:vertex_positions[0]") > 0, "{:#?}", shown.keys());
    let changes = changes(&lab, "Rover.Environment.Ruts.Ground");
    let ends = changes.iter().fold((0.0_f32, 0.0_f32), |(l, h), c| (l.min(*c), h.max(*c)));
    assert!(ends.0 < -0.002 && ends.1 > 0.0005, "{ends:?}");
}

#[test]
fn hazards_and_the_way_are_seen() {
    let lab = Lab::new();
    let shown = seen(&lab, &sim("rover_navigation"), "4s", &[]);
    assert!(redrawn(&shown, "Mesh3D:albedo_texture_buffer[0]") > 3, "{:#?}", shown.keys());
    let way =
        shown.iter().find(|(name, _)| name.starts_with("/ways/Rover/NavigationSoftware/AutoNav "));
    assert!(way.is_some_and(|(_, times)| *times > 1), "{:#?}", shown.keys());
    let colors: BTreeSet<[u8; 4]> = (tiles(&lab).into_iter())
        .filter(|((part, _), _)| part == "Rover.NavigationSoftware.AutoNav")
        .flat_map(|(_, seen)| match seen {
            OverlayValues::Colors(colors) => colors,
            OverlayValues::Change(values) => panic!("{values:?}"),
        })
        .collect();
    // The picture contains hazards, good ground, and unseen ground.
    let has = |r: u8, g: u8| colors.iter().any(|c| c[0].abs_diff(r) < 12 && c[1].abs_diff(g) < 12);
    assert!(has(235, 55) && has(80, 225) && colors.contains(&[0; 4]), "{colors:?}");
}
