//! Recordings are written and read back: they do not change a run, contain every instant completely and in the order of time, and show contacts of a
//! machine. A silent viewer does not block.
#![cfg(feature = "viewer")]
#![allow(clippy::unwrap_used)]
use linkwork_collision::{Shape as Geometry, VisualShape};
use linkwork_dynamics::{Workspace, kinematics};
use linkwork_multibody::{BodySpec, Builder, Hinge};
use linkwork_plant::{MechanismSpec, PlanExt, SpecExt};
use linkwork_runtime::*;
use linkwork_spatial::nalgebra::Matrix3;
use linkwork_spatial::{MassProperties, Pose, Quat, Vec3};
use linkwork_viz::{
    Arrow, End, InUnit, Line, Marker, Panel, Planet, Player, Scene, Shape, View, read_recording,
};
use re_sdk::StoreKind;
use re_sdk::external::re_log_encoding::DecoderApp;
use re_sdk::log::{Chunk, LogMsg};
use re_sdk::time::TimeInt;
use re_sdk_types::blueprint::archetypes::{LineGrid3D, TimeAxis, ViewBlueprint};
use re_sdk_types::blueprint::components::{TimeRange, ViewClass};
use re_sdk_types::components::{TransformFrameId, Translation3D, Visible};
use re_sdk_types::datatypes::TimeRangeBoundary;
use std::collections::{BTreeMap, BTreeSet};
use std::io::BufReader;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

const PERIOD: Seconds = Seconds { num: 1, den: 100 };
const END: Seconds = Seconds { num: 3, den: 1 };

/// An arm and a ball-hinged weight, without gravity.
fn plan() -> Arc<Plan> {
    let mut b = Builder::new();
    let solid = |m: f64, c: [f64; 3]| {
        MassProperties::new(m, c.into(), Matrix3::from_diagonal(&Vec3::new(0.11, 0.23, 0.19)))
    };
    b.body(
        BodySpec::new("Robot.arm", "world")
            .hinge(Hinge::pin(Vec3::new(0.0, 1.0, 0.0)))
            .mass(solid(1.3, [0.1, 0.02, -0.6])),
    );
    b.body(
        BodySpec::new("Robot.arm/weight", "Robot.arm")
            .hinge_in_parent(Pose::translation(0.0, 0.0, -1.0))
            .hinge(Hinge::ball())
            .mass(solid(0.7, [0.05, -0.1, -0.3])),
    );
    b.node("tip", "Robot.arm", Pose::translation(0.0, 0.1, -1.0));
    let multibody = Arc::new(b.build().unwrap());
    let mut q = multibody.neutral_q();
    q[0] = 0.8;
    let v = vec![0.3, 1.0, -0.7, 0.4];
    let mut spec = Spec::default();
    spec.set_mechanism(MechanismSpec::new("Mechanism", multibody, q, v));
    let catalogue = Catalogue::new(Vec::<Vec<Entry>>::new());
    compile(&spec, &catalogue, &Files::default()).unwrap().into()
}

fn program(plan: &Arc<Plan>) -> Program {
    Program::single(plan.clone())
}

fn scene(plan: &Plan) -> Scene {
    let shape = |body: &str, name: &str, form: Geometry| Shape {
        body: body.into(),
        name: name.into(),
        pose: Pose::identity(),
        form: VisualShape::Shape(form),
        phases: Vec::new(),
        color: [200, 100, 50, 255],
    };
    let corners = |e: f64| {
        let signs = (0..8).map(|k| [k & 1, k >> 1 & 1, k >> 2].map(|b| e * (2.0 * b as f64 - 1.0)));
        signs.map(Vec3::from).collect::<Vec<_>>()
    };
    let field = Geometry::HeightField {
        x: 3,
        y: 2,
        spacing: [1.0, 1.0],
        heights: [0.0, 0.1, 0.2, 0.3, 0.4, 0.5].into(),
    };
    // The hull ignores a point in its inside.
    let hull = Geometry::ConvexHull { points: [corners(0.2), vec![Vec3::zeros()]].concat() };
    let variable = plan.variables.keys().find(|k| k.ends_with("arm.angle")).unwrap().clone();
    Scene {
        title: "test".into(),
        shapes: vec![
            shape("Robot.arm", "box", Geometry::Box { half: Vec3::new(0.05, 0.05, 0.5) }),
            shape("Robot.arm/weight", "hull", hull),
            shape("world", "ground", Geometry::HalfSpace),
            shape("world", "field", field),
            shape("world", "cloud", Geometry::PointCloud { points: vec![[0.1; 4]; 2], room: 0 }),
            shape(
                "world",
                "map",
                Geometry::VoxelMap { cells: [3; 3], edge: 0.1, occupied: vec![[1, 2, 0]] },
            ),
        ],
        arrows: vec![Arrow {
            path: "Robot.arm.push".into(),
            origin: [(); 3].map(|()| variable.clone()),
            vector: [(); 3].map(|()| variable.clone()),
            scale: 0.5,
            color: [1, 2, 3, 255],
        }],
        frames: vec!["tip".into()],
        trails: vec!["Robot.arm/weight".into()],
        panels: vec![Panel {
            title: "Angle".into(),
            series: vec![("arm".into(), variable, InUnit { offset: 0.0, factor: 57.3 })],
        }],
        follow: Some("Robot.arm".into()),
        ..Scene::default()
    }
}

fn room() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// Runs to the end with a recording; returns the hash.
fn recorded(plan: &Arc<Plan>, path: &Path) -> u64 {
    recorded_scene(plan, &scene(plan), path)
}

fn recorded_scene(plan: &Arc<Plan>, scene: &Scene, path: &Path) -> u64 {
    let mut sim = Simulation::new(plan.clone());
    let (view, groups) = View::new(&program(plan), scene, PERIOD).unwrap();
    let mut recorder =
        Recorder::start(&sim, groups, 16, Box::new(view.file(path).unwrap())).unwrap();
    recorder.sample(&sim).unwrap();
    while sim.before(END) {
        sim.step().unwrap();
        recorder.sample(&sim).unwrap();
    }
    recorder.finish().unwrap();
    sim.hash()
}

/// Returns the chunks of the recording, in the order of the file.
fn chunks(path: &Path) -> Vec<Chunk> {
    chunks_of(path, StoreKind::Recording)
}

fn chunks_of(path: &Path, kind: StoreKind) -> Vec<Chunk> {
    let file = BufReader::new(std::fs::File::open(path).unwrap());
    DecoderApp::decode_eager(file)
        .unwrap()
        .filter_map(|message| match message.unwrap() {
            LogMsg::ArrowMsg(store, arrow) if store.kind() == kind => {
                Some(Chunk::from_arrow_msg(&arrow).unwrap())
            }
            _ => None,
        })
        .collect()
}

fn times(chunk: &Chunk) -> Vec<i64> {
    assert!(chunk.timelines().len() <= 1, "{} has other times", chunk.entity_path());
    let column = chunk.timelines().get(&"sim_time".into());
    column.map_or(Vec::new(), |c| c.times().map(TimeInt::as_i64).collect())
}

#[test]
fn a_recording_changes_no_bits_and_holds_every_instant_whole() {
    let (plan, folder) = (plan(), room());
    let path = folder.path().join("run.rrd");
    let mut plain = Simulation::new(plan.clone());
    plain.run_until(END).unwrap();
    assert_eq!(recorded(&plan, &path), plain.hash());

    let trail = "tf#/trails/Robot/arm/weight";
    let frames = ["tf#/Robot/arm", "tf#/Robot/arm/weight", "tf#/tip/axes", trail, "tf#/view/eye"];
    let (child, translation) = (
        re_sdk_types::archetypes::Transform3D::descriptor_child_frame().component,
        re_sdk_types::archetypes::Transform3D::descriptor_translation().component,
    );
    let (mut rows, mut latest) = (Vec::new(), i64::MIN);
    for chunk in chunks(&path) {
        let t = times(&chunk);
        if chunk.entity_path().to_string() == "/transforms" {
            assert!(
                t.is_sorted() && t[0] > latest,
                "poses go back in time: {} after {latest}",
                t[0]
            );
            let names = chunk.iter_component::<TransformFrameId>(child);
            let places = chunk.iter_component::<Translation3D>(translation);
            let names: Vec<String> = names.map(|n| n[0].to_string()).collect();
            let places: Vec<[f32; 3]> = places.map(|p| p[0].0.0).collect();
            assert_eq!((names.len(), places.len()), (t.len(), t.len()));
            // A chunk begins and ends with a complete instant.
            assert_eq!((names[0].as_str(), names[t.len() - 1].as_str()), (frames[0], frames[4]));
            latest = t[t.len() - 1];
            rows.extend(t.into_iter().zip(names).zip(places));
        } else if let Some(last) =
            t.last().filter(|_| !chunk.entity_path().to_string().contains("tile"))
        {
            assert!(*last <= latest, "{} is ahead of the poses", chunk.entity_path());
        }
    }
    assert_eq!(rows.len(), 301 * frames.len());
    let mut sim = Simulation::new(plan.clone());
    let m = plan.mechanism().unwrap();
    let (mb, tree, mut ws) = (&m.multibody, &m.tree, Workspace::new(&m.tree));
    for (k, instant) in rows.chunks(frames.len()).enumerate() {
        sim.run_until(Seconds { num: k as u64, den: 100 }).unwrap();
        let x = &sim.state().x;
        kinematics(tree, &mut ws, &x[..mb.nq()], &x[mb.nq()..mb.nq() + mb.nv()]);
        let body = |n: &str| ws.body_pose(tree, mb.body(n).unwrap()).position;
        let tip = ws.node_pose(tree, mb.node("tip").unwrap()).position;
        // The view follows the arm, so moving objects are relative to it, and the arm itself is in W. The frame of the
        // trail is at rest in W.
        let eye = body("Robot.arm");
        let wanted = [Vec3::zeros(), body("Robot.arm/weight") - eye, tip - eye, -eye, eye];
        for (((t, name), place), (frame, p)) in instant.iter().zip(frames.iter().zip(wanted)) {
            assert_eq!((*t, name.as_str()), (10_000_000 * k as i64, *frame));
            let p = [p.x, p.y, p.z].map(|v| v as f32);
            assert_eq!(*place, p, "{name} at instant {k}");
        }
    }
}

/// A viewer keeps showing the last value: an arrow that a phase does not have is shortened once.
#[test]
fn an_arrow_ends_where_its_numbers_do() {
    let (plan, folder) = (plan(), room());
    let path = folder.path().join("run.rrd");
    let (view, _) = View::new(&program(&plan), &scene(&plan), PERIOD).unwrap();
    let variable = plan.variables.keys().find(|k| k.ends_with("arm.angle")).unwrap();
    let mut player = Player::open(view, &path).unwrap();
    let told = [1.0, 2.0, f64::NAN, f64::NAN, 3.0];
    for (k, value) in told.into_iter().enumerate() {
        player.value(1000 * k as u64, variable, value).unwrap();
    }
    player.finish().unwrap();
    let vectors = re_sdk_types::archetypes::Arrows3D::descriptor_vectors().component;
    let mut all = Vec::new();
    for chunk in chunks(&path) {
        if chunk.entity_path().to_string() == "/Robot/arm/push" && !times(&chunk).is_empty() {
            let v = chunk.iter_component::<re_sdk_types::components::Vector3D>(vectors);
            all.extend(times(&chunk).into_iter().zip(v.map(|v| v[0].0.0)));
        }
    }
    let wanted = [(0, 0.5), (1000, 1.0), (2000, 0.0), (4000, 1.5)];
    assert_eq!(all, wanted.map(|(t, x)| (t, [x; 3])));
}

#[test]
fn what_a_machine_meets_is_shown() {
    let (plan, folder) = (plan(), room());
    let path = folder.path().join("run.rrd");
    recorded(&plan, &path);
    let mut seen: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for chunk in chunks(&path).iter().filter(|c| c.is_static()) {
        let components = chunk.components().component_descriptors();
        let names = components.map(|d| d.component.as_str().to_string());
        seen.entry(chunk.entity_path().to_string()).or_default().extend(names);
    }
    for (shape, what) in [
        ("/Robot/arm/shapes/box", "Boxes3D:half_sizes"),
        ("/Robot/arm/weight/shapes/hull", "Mesh3D:triangle_indices"),
        ("/world/shapes/ground", "Mesh3D:triangle_indices"),
        ("/world/shapes/field", "Mesh3D:triangle_indices"),
        ("/world/shapes/cloud", "Points3D:radii"),
        ("/world/shapes/map", "Boxes3D:half_sizes"),
        ("/Robot/arm/push", "Arrows3D:colors"),
    ] {
        let found = seen.get(shape).unwrap_or_else(|| panic!("`{shape}` is not shown: {seen:#?}"));
        assert!(found.contains(what), "`{shape}` has no `{what}`: {found:?}");
    }
    // A hull is shown as its surface: six faces of a cube with two triangles each, which do not
    // share corners.
    let positions = re_sdk_types::archetypes::Mesh3D::descriptor_vertex_positions().component;
    let corners: Vec<re_sdk_types::components::Position3D> = chunks(&path)
        .iter()
        .filter(|c| c.entity_path().to_string().ends_with("hull"))
        .flat_map(|c| c.iter_component(positions).flat_map(|c| c.to_vec()).collect::<Vec<_>>())
        .collect();
    assert_eq!(corners.len(), 36);
    assert!(corners.iter().all(|c| [c.x(), c.y(), c.z()].iter().all(|v| v.abs() == 0.2)));
}

/// A grid is not part of the simulation: without ground or planet, the blueprint also has none.
#[test]
fn there_is_no_grid() {
    let (plan, folder) = (plan(), room());
    let path = folder.path().join("run.rrd");
    recorded(&plan, &path);
    let visible = LineGrid3D::descriptor_visible().component;
    let told: Vec<bool> = chunks_of(&path, StoreKind::Blueprint)
        .iter()
        .flat_map(|c| {
            c.iter_component::<Visible>(visible).flat_map(|v| v.to_vec()).collect::<Vec<_>>()
        })
        .map(|v| *v.0)
        .collect();
    assert_eq!(told, [false]);
}

/// A viewer that follows the end would show the last half minute of curves, and hide curves that ended before.
#[test]
fn curves_are_shown_from_beginning_to_end() {
    let (plan, folder) = (plan(), room());
    let path = folder.path().join("run.rrd");
    recorded(&plan, &path);
    let range = TimeAxis::descriptor_view_range().component;
    let told: Vec<TimeRange> = chunks_of(&path, StoreKind::Blueprint)
        .iter()
        .flat_map(|c| {
            c.iter_component::<TimeRange>(range).flat_map(|v| v.to_vec()).collect::<Vec<_>>()
        })
        .collect();
    let [one] = told[..] else { panic!("{told:?}, and there is one panel") };
    assert_eq!([one.0.start, one.0.end], [TimeRangeBoundary::Infinite; 2]);
}

#[test]
fn a_recording_that_cannot_be_written_says_so() {
    let plan = plan();
    let open = |path: PathBuf| {
        View::new(&program(&plan), &scene(&plan), PERIOD).unwrap().0.file(&path).err()
    };
    let e = open("/nowhere/at/all.rrd".into()).expect("it was written").to_string();
    assert!(e.contains("/nowhere/at/all.rrd"), "{e}");
    if Path::new("/dev/full").exists() {
        let e = open("/dev/full".into()).expect("a full disk was written").to_string();
        assert!(e.contains("/dev/full") && e.contains("space"), "{e}");
    }
    let e =
        View::new(&program(&plan), &scene(&plan), PERIOD).unwrap().0.live(Some("nonsense")).err();
    assert!(e.expect("it is an address").to_string().contains("nonsense"));
}

/// A socket that accepts the connection and never sends anything.
#[test]
fn a_silent_viewer_holds_nobody_up() {
    let plan = plan();
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("rerun+http://{}/proxy", silent.local_addr().unwrap());
    let mut sim = Simulation::new(plan.clone());
    let (view, groups) = View::new(&program(&plan), &scene(&plan), PERIOD).unwrap();
    let live = view.live(Some(&url)).unwrap();
    let mut recorder = Recorder::with(&sim, groups, 4, Overflow::Drop, Box::new(live)).unwrap();
    while sim.before(END) {
        sim.step().unwrap();
        recorder.sample(&sim).unwrap();
    }
    // The rows wait in the stream or were dropped, and the end of the recording does not wait for
    // them.
    let ended = recorder.finish_within(Duration::from_millis(300));
    assert!(ended.is_err(), "the silent viewer is said to have taken everything");
}

/// Curves alone fill the window: an empty room next to them would be useless.
#[test]
fn a_simulation_of_no_machine_has_no_room() {
    let folder = room();
    let views = |plan: &Arc<Plan>, scene: &Scene, name: &str| {
        let path = folder.path().join(name);
        recorded_scene(plan, scene, &path);
        let class = ViewBlueprint::descriptor_class_identifier().component;
        let chunks = chunks_of(&path, StoreKind::Blueprint);
        let told = chunks.iter().flat_map(|c| {
            c.iter_component::<ViewClass>(class).flat_map(|v| v.to_vec()).collect::<Vec<_>>()
        });
        told.map(|v| v.0.to_string()).collect::<BTreeSet<_>>()
    };
    let whole = views(&plan(), &scene(&plan()), "machine.rrd");
    assert_eq!(whole.iter().collect::<Vec<_>>(), ["3D", "TimeSeries"]);
    let catalogue = Catalogue::new(Vec::<Vec<Entry>>::new());
    let empty: Arc<Plan> = compile(&Spec::default(), &catalogue, &Files::default()).unwrap().into();
    let curves = Panel { title: "Nothing".into(), series: Vec::new() };
    let mut scene = Scene { title: "test".into(), panels: vec![curves], ..Scene::default() };
    let alone = views(&empty, &scene, "curves.rrd");
    assert_eq!(alone.iter().collect::<Vec<_>>(), ["TimeSeries"]);
    scene.markers.push(Marker { at: Vec3::x(), label: "here".into() });
    assert_eq!(views(&empty, &scene, "marker.rrd").len(), 2);
}

/// Initial position of a craft from the centre of the Earth (m), and another position relative to it.
const FAR: [f64; 3] = [4.1e6, -3.3e6, 3.6e6];
const BESIDE: [f64; 3] = [0.02, -0.01, 0.02];
const SPEED: [f64; 3] = [5600.0, 4100.0, -2600.0];

/// Two crafts without gravity, 3 cm apart.
fn far_plan() -> Arc<Plan> {
    let mut b = Builder::new();
    for name in ["craft", "beside"] {
        let inertia = Matrix3::from_diagonal(&Vec3::new(0.11, 0.23, 0.19));
        let mass = MassProperties::new(1.3, Vec3::zeros(), inertia);
        b.body(BodySpec::new(name, "world").hinge(Hinge::free()).mass(mass));
    }
    let multibody = Arc::new(b.build().unwrap());
    let mut q = multibody.neutral_q();
    for (name, from) in [("craft", [0.0; 3]), ("beside", BESIDE)] {
        let first = multibody.get(multibody.body(name).unwrap()).q().start;
        for k in 0..3 {
            q[first + k] = FAR[k] + from[k];
        }
    }
    let v = [[0.0; 3], SPEED, [0.0; 3], SPEED].concat();
    let mut spec = Spec::default();
    spec.set_mechanism(MechanismSpec::new("Mechanism", multibody, q, v));
    compile(&spec, &Catalogue::new(Vec::<Vec<Entry>>::new()), &Files::default()).unwrap().into()
}

fn three(of: &str) -> [String; 3] {
    ["x", "y", "z"].map(|k| format!("{of}.{k}"))
}

fn far_scene(follow: Option<&str>) -> Scene {
    let [craft, beside] = ["craft", "beside"].map(|of| three(&format!("{of}.position")));
    Scene {
        title: "far".into(),
        arrows: vec![Arrow {
            path: "push".into(),
            origin: beside.clone(),
            vector: three("beside.velocity"),
            scale: 1e-3,
            color: [1, 2, 3, 255],
        }],
        lines: vec![Line {
            path: "line".into(),
            ends: [End::Point(craft), End::Point(beside)],
            pull: None,
            color: [1, 2, 3, 255],
        }],
        trails: vec!["beside".into()],
        follow: follow.map(String::from),
        planet: Some(Planet { centre: Vec3::zeros(), radius: 6.371e6, color: [60, 90, 140] }),
        ..Scene::default()
    }
}

/// Returns three numbers of a recording at all times, `first` of them before.
fn points(
    shown: &BTreeMap<String, linkwork_viz::RecordedSeries>,
    what: &str,
    first: usize,
) -> Vec<Vec3> {
    let lane = |k: usize| {
        let name = format!("{what}[{}]", first + k);
        &shown.get(&name).unwrap_or_else(|| panic!("`{name}`: {:#?}", shown.keys())).1
    };
    (0..lane(0).len()).map(|k| Vec3::from([0, 1, 2].map(|i| lane(i)[k]))).collect()
}

/// Returns frame and parent of all poses of a recording, and the frames of entities.
fn frames_of(path: &Path) -> (BTreeSet<[String; 2]>, BTreeMap<String, String>) {
    use re_sdk_types::archetypes::{CoordinateFrame, Transform3D};
    let of = [Transform3D::descriptor_child_frame(), Transform3D::descriptor_parent_frame()];
    let (mut parents, mut entities) = (BTreeSet::new(), BTreeMap::new());
    for chunk in chunks(path) {
        let [child, parent] = of.each_ref().map(|d| {
            let names = chunk.iter_component::<TransformFrameId>(d.component);
            names.map(|n| n[0].to_string()).collect::<Vec<_>>()
        });
        parents.extend(child.into_iter().zip(parent).map(|(child, parent)| [child, parent]));
        let frame = CoordinateFrame::descriptor_frame().component;
        for name in chunk.iter_component::<TransformFrameId>(frame) {
            entities.insert(chunk.entity_path().to_string(), name[0].to_string());
        }
    }
    (parents, entities)
}

/// Positions relative to the eye are correct to a micrometre, 6.4e6 m away from the origin of W.
fn beside_is_beside(path: &Path, instants: usize) {
    let shown = read_recording(path).unwrap();
    let turn = shown["tf#/view/eye Transform3D:quaternion[0]"].1.len();
    assert_eq!(turn, instants);
    let turn = |k: usize| {
        let q =
            [0, 1, 2, 3].map(|i| shown[&format!("tf#/view/eye Transform3D:quaternion[{i}]")].1[k]);
        Quat::from_quaternion(linkwork_spatial::nalgebra::Quaternion::new(q[3], q[0], q[1], q[2]))
    };
    let vector = Vec3::from(SPEED) * 1e-3;
    for (what, first, wanted, tolerance) in [
        ("tf#/craft Transform3D:translation", 0, Vec3::zeros(), 0.0),
        ("tf#/beside Transform3D:translation", 0, Vec3::from(BESIDE), 1e-6),
        ("/push Arrows3D:origins", 0, Vec3::from(BESIDE), 1e-6),
        ("/push Arrows3D:vectors", 0, vector, 1e-5),
        ("/lines/line LineStrips3D:strips", 0, Vec3::zeros(), 1e-6),
        ("/lines/line LineStrips3D:strips", 3, Vec3::from(BESIDE), 1e-6),
    ] {
        let all = points(&shown, what, first);
        assert_eq!(all.len(), instants, "{what}");
        for (k, p) in all.iter().enumerate() {
            let off = (turn(k) * p - wanted).norm();
            assert!(off <= tolerance, "{what} at instant {k}: {p:?}, {off} off");
        }
    }
    let ends = trail_ends(path);
    let frame = points(&shown, "tf#/trails/beside Transform3D:translation", 0);
    assert_eq!((ends.len(), frame.len()), (instants, instants));
    for (k, end) in ends.iter().enumerate() {
        // The axes of the trail's frame are parallel to W.
        let off = (turn(k) * frame[k] + end - Vec3::from(BESIDE)).norm();
        assert!(off < 2e-3, "the trail at instant {k} ends {off} m away from its body");
    }
    let (parents, entities) = frames_of(path);
    let eye = "tf#/view/eye";
    let of = |child: &str| [child.to_string(), eye.to_string()];
    let mut wanted: BTreeSet<_> = ["tf#/craft", "tf#/beside", "tf#/trails/beside"].map(of).into();
    wanted.insert([eye.into(), "tf#/".into()]);
    assert_eq!(parents, wanted);
    assert_eq!([&entities["/push"], &entities["/lines/line"]], [eye; 2]);
}

/// Returns the last point of a trail, for each time that it was recorded.
fn trail_ends(path: &Path) -> Vec<Vec3> {
    use re_sdk_types::components::LineStrip3D;
    let strips = re_sdk_types::archetypes::LineStrips3D::descriptor_strips().component;
    let of = |chunk: &Chunk| {
        let told = chunk.iter_component::<LineStrip3D>(strips);
        let end =
            |s: &[LineStrip3D]| Vec3::from(s.last().unwrap().0.last().unwrap().0.map(f64::from));
        told.map(|s| end(&s)).collect::<Vec<_>>()
    };
    let all = chunks(path);
    all.iter().filter(|c| c.entity_path().to_string() == "/trails/beside").flat_map(of).collect()
}

#[test]
fn far_from_the_origin_what_is_beside_the_followed_body_is_told_beside_it() {
    let (plan, folder) = (far_plan(), room());
    let path = folder.path().join("run.rrd");
    recorded_scene(&plan, &far_scene(Some("craft")), &path);
    beside_is_beside(&path, 301);
    // If no body is followed, all poses are in W.
    recorded_scene(&plan, &far_scene(None), &path);
    let (parents, entities) = frames_of(&path);
    let root = |child: &str| [child.to_string(), "tf#/".to_string()];
    assert_eq!(parents, ["tf#/craft", "tf#/beside"].map(root).into());
    assert_eq!([&entities["/push"], &entities["/lines/line"]], ["tf#/"; 2]);
    let shown = read_recording(&path).unwrap();
    for what in ["tf#/craft Transform3D:translation", "/push Arrows3D:origins"] {
        assert!((points(&shown, what, 0)[0] - Vec3::from(FAR)).norm() < 1.0, "{what}");
    }
}

/// A log contains values of an instant before or after its poses: an arrow is relative to the position of the eye at the same instant.
#[test]
fn a_recording_from_a_log_is_told_from_the_eye_of_its_instant() {
    let (plan, folder) = (far_plan(), room());
    for poses_first in [false, true] {
        let path = folder.path().join("view.rrd");
        let (view, _) = View::new(&program(&plan), &far_scene(Some("craft")), PERIOD).unwrap();
        let mut player = Player::open(view, &path).unwrap();
        for k in 0..50_u64 {
            let ns = 10_000_000 * k;
            let at = Vec3::from(FAR) + Vec3::from(SPEED) * (0.01 * k as f64);
            let beside = at + Vec3::from(BESIDE);
            let bodies = [("craft", at), ("beside", beside)]
                .map(|(name, p)| (name.to_string(), Pose::translation(p.x, p.y, p.z)));
            if poses_first {
                player.poses(ns, &bodies).unwrap();
            }
            for (of, v) in [("craft", at), ("beside", beside)] {
                for (name, value) in three(&format!("{of}.position")).iter().zip(v.iter()) {
                    player.value(ns, name, *value).unwrap();
                }
            }
            for (name, value) in three("beside.velocity").iter().zip(SPEED) {
                player.value(ns, name, value).unwrap();
            }
            if !poses_first {
                player.poses(ns, &bodies).unwrap();
            }
        }
        player.finish().unwrap();
        beside_is_beside(&path, 50);
    }
}
