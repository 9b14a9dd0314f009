//! Mechanisms in RON without loss of a bit, files of other formats in an assembly, and companion files.
use crate::common::*;
use crate::splitmix::splitmix;
use linkwork_assembly::form::AssemblyForm;
use linkwork_assembly::machine::{apply_companion, read_machine};
use linkwork_assembly::*;
use linkwork_collision::VisualShape;
use linkwork_formats::{
    Description, Geometry, Initial, ReadOptions, Root, ShapeRole, WheelRole, read_urdf,
};
use linkwork_multibody::{
    BodySpec, Builder, Coordinate, Coupling, Friction, Hinge, HingeCoordinate, Limits, LoopClosure,
    Multibody, Stop, Subhinge, SubhingeKind, Term,
};
use linkwork_plant::SpecExt;
use linkwork_spatial::{InertiaCheck, MassProperties, Mat3, Pose, Quat, Vec3};
use std::path::Path;

/// A seeded generator of numbers without zeros (splitmix64).
struct Rng(u64);

impl Rng {
    fn bits(&mut self) -> u64 {
        splitmix(&mut self.0)
    }
    /// Numbers of all magnitudes: ±(0.1 … 1) · 10^(−8 … 8).
    fn signed(&mut self) -> f64 {
        let x = 0.1 + 0.9 * (self.bits() >> 11) as f64 / (1u64 << 53) as f64;
        let x = x * 10f64.powi((self.bits() % 17) as i32 - 8);
        if self.bits() & 1 == 0 { x } else { -x }
    }
    fn vec3(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
    fn pose(&mut self) -> Pose {
        let turn = match self.bits() % 3 {
            0 => Quat::identity(),
            _ => Quat::from_scaled_axis(self.vec3()),
        };
        Pose::new(turn, self.vec3())
    }
    fn mass(&mut self) -> MassProperties {
        let s = self.vec3().abs();
        let principal = Mat3::from_diagonal(&Vec3::new(s.y + s.z, s.x + s.z, s.x + s.y));
        let R = Quat::from_scaled_axis(self.vec3()).to_rotation_matrix().into_inner();
        let mass = self.signed().abs();
        match self.bits() % 4 {
            0 => MassProperties { com: self.vec3(), ..MassProperties::massless() },
            1 => MassProperties::new(mass, self.vec3(), principal),
            // Because of round-off, this product is not exactly symmetric.
            2 => MassProperties::new(mass, self.vec3(), R * principal * R.transpose()),
            _ => {
                let lumped = Mat3::from_diagonal(&Vec3::new(1.0, 1.0, 5.0));
                MassProperties::new(mass, self.vec3(), lumped)
                    .with_check(InertiaCheck::PositiveMoments)
            }
        }
    }
    fn subhinge(&mut self) -> Subhinge {
        let kind = match self.bits() % 6 {
            0 => SubhingeKind::Pin { axis: self.vec3() },
            1 => SubhingeKind::Slider { axis: self.vec3() },
            2 => SubhingeKind::Screw { axis: self.vec3(), pitch: self.signed() },
            3 => SubhingeKind::Ball,
            4 => SubhingeKind::Free,
            _ => SubhingeKind::Locked,
        };
        let mut s = Subhinge::from(kind);
        if self.bits().is_multiple_of(3) {
            s.coordinate = Coordinate::Prescribed;
        }
        if self.bits().is_multiple_of(2)
            && !matches!(kind, SubhingeKind::Free | SubhingeKind::Locked)
        {
            s.armature = self.signed().abs();
        }
        if self.bits().is_multiple_of(2) {
            s.gear = self.signed();
        }
        if kind.nv() == 1 && self.bits().is_multiple_of(2) {
            let (a, b) = (self.signed(), self.signed());
            s.limits = Limits {
                lower: a.min(b),
                upper: a.max(b),
                rate: self.signed().abs(),
                effort: f64::INFINITY,
            };
        }
        self.resistances(&mut s);
        s
    }

    fn resistances(&mut self, s: &mut Subhinge) {
        let barred = matches!(s.kind, SubhingeKind::Free | SubhingeKind::Locked);
        if !barred && self.bits().is_multiple_of(2) {
            s.damping = self.signed().abs();
        }
        if s.kind.nv() != 1 {
            return;
        }
        if self.bits().is_multiple_of(2) {
            let rate = if self.bits().is_multiple_of(2) { self.signed().abs() } else { 0.0 };
            s.friction = Friction { force: self.signed().abs(), rate };
        }
        s.stop = match self.bits() % 3 {
            0 => Stop::Usual,
            1 => Stop::Off,
            _ => Stop::Soft { stiffness: self.signed().abs(), damping: self.signed().abs() },
        };
    }
}

/// Random chains of random subhinges, with all digits in all numbers. Names are those of an assembly `M`.
fn machine(seed: u64) -> Multibody {
    let mut r = Rng(seed);
    let mut b = Builder::new();
    for i in 0..15u64 {
        let parent = if i == 0 || r.bits().is_multiple_of(5) {
            "world".into()
        } else {
            format!("M/b{:02}", r.bits() % i)
        };
        let links = (0..r.bits() % 4).map(|_| r.subhinge()).collect();
        let name = format!("M/b{i:02}");
        b.node(format!("{name}/tip"), &name, r.pose());
        b.body(
            BodySpec::new(name, parent)
                .hinge_in_parent(r.pose())
                .hinge_in_body(r.pose())
                .hinge(Hinge { subhinges: links })
                .mass(r.mass()),
        );
    }
    constrain(&mut r, &mut b);
    b.build().unwrap_or_else(|e| panic!("seed {seed}: {e}"))
}

/// A loop of every kind and couplings of coordinates in any order.
fn constrain(r: &mut Rng, b: &mut Builder) {
    let slider = |r: &mut Rng| SubhingeKind::Slider { axis: r.vec3() };
    let pin = |r: &mut Rng| SubhingeKind::Pin { axis: r.vec3() };
    let screw = SubhingeKind::Screw { axis: r.vec3(), pitch: r.signed() };
    let mut hinges = vec![
        Hinge::locked(),
        Hinge::ball(),
        Hinge::chain([slider(r), SubhingeKind::Locked, pin(r)]),
        Hinge::chain([pin(r)]),
        Hinge::chain([screw]),
    ];
    let last = hinges[2].subhinges.len() - 1;
    hinges[2].subhinges[0].coordinate = Coordinate::Prescribed;
    hinges[2].subhinges[last].coordinate = Coordinate::Prescribed;
    for (i, hinge) in hinges.into_iter().enumerate() {
        let body_a = if i == 2 { "world".into() } else { format!("M/b{i:02}") };
        b.loop_closure(LoopClosure {
            name: format!("M/l{i}"),
            body_a,
            frame_a: r.pose(),
            body_b: format!("M/b{:02}", i + 7),
            frame_b: r.pose(),
            hinge,
        });
    }
    let mut all = Vec::new();
    for spec in b.bodies() {
        let chain = spec.hinge.subhinges.iter().enumerate().filter(|(_, s)| s.kind.nv() == 1);
        all.extend(
            chain.map(|(subhinge, _)| HingeCoordinate { body: spec.name.clone(), subhinge }),
        );
    }
    for i in 0..all.len() / 3 {
        let first = (r.bits() % all.len() as u64) as usize;
        let mut terms: Vec<Term> = (0..1 + i.min(2))
            .map(|k| Term {
                coordinate: all[(first + k * (1 + i)) % all.len()].clone(),
                factor: r.signed(),
            })
            .collect();
        let same = |a: &Term, b: &Term| a.coordinate == b.coordinate;
        terms.dedup_by(|a, b| same(a, b));
        if (1..terms.len()).all(|k| terms[..k].iter().all(|t| !same(t, &terms[k]))) {
            b.coupling(Coupling::linear(format!("M/c{i}"), terms, r.signed()));
        }
    }
}

#[test]
fn flexible_machines_come_back_bit_for_bit() {
    use linkwork_multibody::modes::{Beam, BeamModes, Plate};
    let beam = Beam { damping_ratio: 0.01, ..Beam::tube(1.3, 0.05, 0.04, 7e10, 0.33, 2700.0) };
    let count = BeamModes { bending_y: 2, bending_z: 1, twist: 1, stretch: 0 };
    let plate = Plate {
        length: 0.7,
        width: 0.4,
        thickness: 0.003,
        young: 7e10,
        poisson: 0.3,
        density: 2700.0,
        damping_ratio: 0.0,
        attach: vec![[0.3, 0.1]],
    };
    let mut b = Builder::new();
    b.body(
        BodySpec::new("M/boom", "world")
            .hinge(Hinge::pin(Vec3::z()))
            .modes(beam.modes(count).unwrap()),
    );
    b.body(
        BodySpec::new("M/panel", "M/boom")
            .hinge_in_parent(Pose::translation(1.3, 0.0, 0.0))
            .modes(plate.modes(3).unwrap()),
    );
    let mbs = b.build().unwrap();
    let made = AssemblyForm::from_description("M", &Description::from(&mbs));
    assert!(made.left_out.is_empty(), "{:?}", made.left_out);
    let catalogue = catalogue();
    let loaded = load_text("m.ron", &made.assembly.to_ron(), &Options::new(&catalogue));
    let loaded = loaded.unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(format!("{:?}", mechanism(&loaded)), format!("{mbs:?}"));
}

fn mechanism(loaded: &Loaded) -> &Multibody {
    &loaded.spec.mechanism().unwrap().multibody
}

#[test]
fn any_mechanism_comes_back_from_its_ron_bit_for_bit() {
    for seed in 0..60 {
        let mbs = machine(seed);
        let made = AssemblyForm::from_description("M", &Description::from(&mbs));
        assert!(made.left_out.is_empty(), "{:?}", made.left_out);
        let catalogue = catalogue();
        let text = made.assembly.to_ron();
        let loaded = load_text("m.ron", &text, &Options::new(&catalogue));
        let loaded = loaded.unwrap_or_else(|f| panic!("seed {seed}: {f}\n{text}"));
        assert_eq!(mechanism(&loaded), &mbs, "seed {seed}");
        // A comparison of floats treats −0 as 0, so compare texts, which distinguish them.
        assert_eq!(format!("{:?}", mechanism(&loaded)), format!("{mbs:?}"), "seed {seed}");
        // Load the mechanism again from the resolved text, which refers to no other file.
        let again = load_text("r.ron", &loaded.resolved, &Options::new(&catalogue)).unwrap();
        assert_eq!(mechanism(&again), &mbs, "seed {seed}, resolved");
    }
}

const ROVER: &str = r#"<robot name="rover">
  <link name="base"><inertial><mass value="10"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual name="deck"><origin xyz="0 0 0.1" rpy="0 0 1"/><geometry><box size="1 2 0.1"/></geometry><material name="m"><color rgba="1 0 0 1"/></material></visual>
    <visual><geometry><mesh filename="../meshes/deck.stl" scale="0.001 0.001 0.001"/></geometry></visual>
    <collision><geometry><sphere radius="0.5"/></geometry></collision></link>
  <link name="left"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="right"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="left_joint" type="revolute"><parent link="base"/><child link="left"/><origin xyz="0 0.5 0"/><axis xyz="0 1 0"/>
    <limit lower="-0.5" upper="0.5" velocity="1" effort="20"/></joint>
  <joint name="right_joint" type="continuous"><parent link="base"/><child link="right"/><origin xyz="0 -0.5 0"/><axis xyz="0 1 0"/></joint>
</robot>"#;

/// Creates a folder with the rover in `urdf/` and its mesh in `meshes/`.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for sub in ["urdf", "meshes"] {
        std::fs::create_dir(dir.path().join(sub)).unwrap();
    }
    std::fs::write(dir.path().join("urdf/rover.urdf"), ROVER).unwrap();
    std::fs::write(dir.path().join("meshes/deck.stl"), "solid").unwrap();
    dir
}

pub(crate) fn load(dir: &Path, name: &str, text: &str) -> Result<Loaded, Failure> {
    std::fs::write(dir.join(name), text).unwrap();
    let catalogue = catalogue();
    load_file(dir.join(name), &Options::new(&catalogue))
}

#[test]
fn a_urdf_file_becomes_bodies_that_can_be_bound_and_overridden() {
    let dir = folder();
    let text = r#"Simulation(parts: {
        "Rover": (import: (file: "urdf/rover.urdf", root: Free), parts: {
            "Motor": (model: "test.motor", params: { "resistance": 1 }, bind: { "shaft": "hinge:left" }),
        }),
    }, overrides: { "Rover/left.armature": "0.25 kg m^2", "Rover/base.initial": (position: [1, 2, 3]) })"#;
    let loaded = load(dir.path(), "sim.ron", text).unwrap_or_else(|f| panic!("{f}"));
    let mbs = mechanism(&loaded);
    assert_eq!(mbs.nv(), 6 + 2);
    let left = mbs.get(mbs.body("Rover/left").unwrap());
    let s = left.subhinges()[0].subhinge;
    assert_eq!(s.limits, Limits { lower: -0.5, upper: 0.5, rate: 1.0, effort: 20.0 });
    assert_eq!((s.armature, left.hinge_in_parent().position), (0.25, Vec3::new(0.0, 0.5, 0.0)));
    assert_eq!(&loaded.spec.mechanism().unwrap().q[..3], [1.0, 2.0, 3.0]);
    assert_eq!(loaded.spec.binds.len(), 1);
    // The view contains the visual shapes, with the paths of the meshes that were found.
    assert_eq!(loaded.shapes.len(), 2);
    assert_eq!(
        (loaded.shapes[0].name.as_str(), loaded.shapes[0].body.as_str()),
        ("deck", "Rover/base")
    );
    assert_eq!(loaded.shapes[0].color, Some([1.0, 0.0, 0.0, 1.0]));
    let VisualShape::File { file, scale } = &loaded.shapes[1].shape else {
        panic!("{:?}", loaded.shapes)
    };
    assert!(Path::new(file).is_file() && *scale == Vec3::repeat(0.001), "{file}");
    let import = &loaded.imports[0];
    assert_eq!((import.path.as_str(), import.description.name.as_str()), ("Rover", "rover"));
    assert_eq!(import.bodies["left"], "Rover/left");
    assert_eq!(import.left_out, ["Collision shape of `base`"]);
    assert!(loaded.colliders.is_none());
    // The resolved text no longer needs the file.
    std::fs::remove_file(dir.path().join("urdf/rover.urdf")).unwrap();
    let catalogue = catalogue();
    let again = load_text("r.ron", &loaded.resolved, &Options::new(&catalogue))
        .unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(mechanism(&again), mbs);
    assert_eq!(again.shapes, loaded.shapes);
}

#[test]
fn an_import_hangs_where_it_is_told_and_may_be_embedded() {
    let catalogue = catalogue();
    let options = Options::new(&catalogue).embed("r.urdf", ROVER);
    let text = r#"Assembly(name: "A", params: { "file": (default: "r.urdf") }, mounts: { "deck": "what carries it" },
        import: [(file: "$file", parent: "deck", at: (position: [0, 0, 2], rotation: (rpy: [0, 0, "90 deg"])))])"#;
    let loaded = load_text("a.ron", text, &options).unwrap_or_else(|f| panic!("{f}"));
    let mbs = mechanism(&loaded);
    let X = mbs.body_poses(&mbs.neutral_q())[mbs.body("A/left").unwrap().index()];
    assert!((X.position - Vec3::new(-0.5, 0.0, 2.0)).amax() < 1e-15, "{X:?}");
    // The import's pose is applied first, and then the body's own: (0, 0, 2), rotated by 90°, then 1 along the
    // rotated x axis.
    let own =
        "<mujoco><worldbody><body name=\"b\" pos=\"1 0 0\" euler=\"90 0 0\"/></worldbody></mujoco>";
    let turned = text.replace("r.urdf", "r.xml");
    let loaded = load_text("a.ron", &turned, &options.embed("r.xml", own));
    let loaded = loaded.unwrap_or_else(|f| panic!("{f}"));
    let X = mechanism(&loaded).body_poses(&[])[0];
    assert!((X.position - Vec3::new(0.0, 1.0, 2.0)).amax() < 1e-15, "{X:?}");
    assert!((X.transform_vector(&Vec3::y()) - Vec3::z()).amax() < 1e-15, "{X:?}");
    // The form still contains the import.
    let form = AssemblyForm::from_ron("a.ron", text).unwrap();
    assert_eq!(AssemblyForm::from_ron("a.ron", &form.to_ron()).unwrap().to_ron(), form.to_ron());
    assert!(form.to_ron().contains("import:"));
}

#[test]
fn mistakes_of_an_import_are_told_with_both_places() {
    let dir = folder();
    let fails = |import: &str| {
        let text = format!(
            "Simulation(\n  bodies: {{ \"own\": (parent: \"world\") }},\n  import: {import})"
        );
        load(dir.path(), "sim.ron", &text).err().unwrap().to_string()
    };
    let has = |import: &str, parts: &[&str]| {
        let error = fails(import);
        for part in parts {
            assert!(error.contains(part), "not there: {part}\n{error}");
        }
    };
    has("(root: Free)", &["`import` has no `file`"]);
    has("(file: \"none.urdf\")", &["there is no file `none.urdf`", "sim.ron:3"]);
    has("(file: \"urdf/rover.urdf\", rot: Free)", &["has no field `rot`", "`root`"]);
    has("(file: \"urdf/rover.urdf\", root: Fre)", &["`root`: there is no word `Fre`", "Free"]);
    has(
        "(file: \"urdf/rover.urdf\", leave_out: [\"gears\"])",
        &["`leave_out`: item 1: there is no word `gears`"],
    );
    has("(file: \"urdf/rover.urdf\", collide: 1)", &["`collide` must be true or false"]);
    has("(file: \"urdf/rover.urdf\", parent: \"onw\")", &["no body `onw`", "own"]);
    std::fs::write(dir.path().join("bad.urdf"), ROVER.replace("revolute", "revolt")).unwrap();
    has(
        "(file: \"bad.urdf\")",
        &["bad.urdf:8:28", "unknown type `revolt`", "did you mean `revolute`?"],
    );
    std::fs::write(dir.path().join("own.urdf"), ROVER.replace("\"left\"", "\"own\"")).unwrap();
    has("(file: \"own.urdf\")", &["a body `own`, which already exists"]);
}

#[test]
fn couplings_and_loops_of_a_file_are_simulated() {
    let dir = folder();
    let mimic = ROVER.replace(
        "<axis xyz=\"0 1 0\"/></joint>",
        "<axis xyz=\"0 1 0\"/><mimic joint=\"left_joint\" multiplier=\"-2\" offset=\"0.5\"/></joint>",
    );
    std::fs::write(dir.path().join("urdf/rover.urdf"), mimic).unwrap();
    let load = |more: &str| {
        let text =
            format!("Simulation(parts: {{ \"R\": (import: (file: \"urdf/rover.urdf\"{more})) }})");
        load(dir.path(), "sim.ron", &text).unwrap_or_else(|f| panic!("{f}"))
    };
    let loaded = load("");
    let c = &mechanism(&loaded).couplings()[0].coupling;
    let terms: Vec<_> = c.terms.iter().map(|t| (t.coordinate.body.as_str(), t.factor)).collect();
    assert_eq!(c.name, "R/right_joint");
    assert_eq!((terms, c.constant), (vec![("R/right", 1.0), ("R/left", 2.0)], 0.5));
    // The start is projected onto the coupling.
    let sim = run(&loaded.spec, 0.0);
    let of = |side: &str| sim.get(&format!("R/{side}.angle")).unwrap();
    assert!((of("right") + 2.0 * of("left") - 0.5).abs() < 1e-12);
    let without = load(", leave_out: [\"couplings\", \"loops\"]");
    assert!(mechanism(&without).couplings().is_empty());
    assert!(without.imports[0].left_out.contains(&"coupling `right_joint`".to_string()));
}

#[test]
fn collision_shapes_come_back_to_the_last_digit() {
    use linkwork_collision::Shape as Solid;
    let mut r = Rng(7);
    let mut b = Builder::new();
    b.body(BodySpec::new("M/a", "world").hinge(Hinge::free()).mass(MassProperties::new(
        1.0,
        Vec3::zeros(),
        Mat3::identity(),
    )));
    let size = |r: &mut Rng| r.signed().abs();
    let box_size = [size(&mut r), size(&mut r), size(&mut r)];
    let (radius, length) = (size(&mut r), size(&mut r));
    let mut d = Description { builder: b, ..Description::default() };
    let all = [
        ("M/a", "box", ShapeRole::Collision, Geometry::Box { size: box_size }),
        ("M/a", "foot", ShapeRole::Contact, Geometry::Capsule { radius, length }),
        ("world", "", ShapeRole::Collision, Geometry::Plane { size: [0.0, 0.0] }),
        ("M/a", "egg", ShapeRole::Collision, Geometry::Ellipsoid { radii: [1.0, 2.0, 3.0] }),
        ("M/a", "flat", ShapeRole::Collision, Geometry::Ellipsoid { radii: [1.0, 2.0, 0.0] }),
    ];
    for (body, name, role, geometry) in all {
        let shape = linkwork_formats::BodyShape::new(body, role, r.pose(), geometry);
        d.shapes.push(linkwork_formats::BodyShape { name: name.into(), ..shape });
    }
    let made = AssemblyForm::from_description("M", &d);
    assert_eq!(made.left_out.len(), 1, "{:?}", made.left_out);
    assert!(made.left_out[0].contains("sizes are not all positive"), "{:?}", made.left_out);
    let catalogue = catalogue();
    let loaded = load_text("m.ron", &made.assembly.to_ron(), &Options::new(&catalogue));
    let loaded = loaded.unwrap_or_else(|f| panic!("{f}"));
    let colliders = loaded.colliders.as_ref().unwrap();
    let of = |name: &str| colliders.spec(colliders.find(name).unwrap());
    let wants = [
        ("M/a/box", Solid::Box { half: 0.5 * Vec3::from(box_size) }),
        ("M/a/foot", Solid::Capsule { radius, half_length: 0.5 * length }),
        ("M/ground", Solid::HalfSpace),
        ("M/a/egg", Solid::Ellipsoid { half: Vec3::new(1.0, 2.0, 3.0) }),
    ];
    for ((name, shape), written) in wants.into_iter().zip(&d.shapes) {
        assert_eq!((&of(name).fine, &of(name).pose), (&shape, &written.pose), "{name}");
    }
    assert!(loaded.shapes.is_empty(), "what collides is not shown");
}

#[test]
fn shapes_of_the_world_and_of_mujoco_collide() {
    let text = r#"<mujoco><worldbody>
        <geom name="floor" type="plane" size="0 0 1" pos="0 0 -0.5"/>
        <body name="b" pos="0 0 1"><freejoint/><geom type="sphere" size="0.1" mass="1"/></body>
    </worldbody></mujoco>"#;
    let catalogue = catalogue();
    let options = Options::new(&catalogue).embed("m.xml", text);
    let load = |collide: &str| {
        let text = format!(
            "Simulation(bodies: {{ \"deck\": (parent: \"world\") }}, contact: (),
              import: (file: \"m.xml\", parent: \"deck\", at: (position: [0, 0, 2]){collide}))"
        );
        load_text("s.ron", &text, &options).unwrap_or_else(|f| panic!("{f}"))
    };
    assert!(load("").colliders.is_none());
    let loaded = load(", collide: true");
    let colliders = loaded.colliders.as_ref().unwrap();
    let floor = colliders.spec(colliders.find("floor").unwrap());
    assert_eq!((floor.body.as_str(), floor.pose.position.z), ("deck", 1.5));
    assert_eq!(floor.fine, linkwork_collision::Shape::HalfSpace);
    assert_eq!(colliders.len(), 2);
    let again = load_text("r.ron", &loaded.resolved, &options).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(digest(&again.spec), digest(&loaded.spec));
}

const COMPANION: &str = r#"Companion(
    joints: { "left_joint": (armature: "2 g m^2", gear: 50, limits: (lower: "-10 deg", upper: "10 deg", effort: "3 N m"), damping: 0.5) },
    couplings: { "differential": (terms: { "left_joint": 1, "right_joint": 1 }, constant: "90 deg") },
    loops: { "rod": (a: (body: "left", position: [0, 0, "10 cm"]), b: (body: "right"), hinge: Ball) },
    wheels: { "right": (radius: "20 cm", width: 0.1, role: Idle, steering: "left_joint") },
    contacts: { "left": [(shape: Sphere(0.05), at: (position: [0, 0, -0.1]))] },
    nodes: { "imu": (body: "base", position: [0, 0, "5 cm"]) },
)"#;

#[test]
fn a_companion_file_adds_what_urdf_cannot_express() {
    let mut d = read_urdf(ROVER, &ReadOptions::default()).unwrap();
    apply_companion("rover.linkwork.ron", COMPANION, &mut d).unwrap_or_else(|f| panic!("{f}"));
    let mbs = d.builder.build().unwrap();
    let s = mbs.get(mbs.body("left").unwrap()).subhinges()[0].subhinge;
    assert_eq!((s.armature, s.gear, s.reflected_inertia()), (0.002, 50.0, 5.0));
    let ten = 10f64.to_radians();
    assert_eq!((s.limits.lower, s.limits.upper, s.limits.effort), (-ten, ten, 3.0));
    assert_eq!(d.joint("left_joint").unwrap().damping, 0.5);
    let c = &d.couplings[0];
    assert_eq!((c.terms.len(), c.constant), (2, 90f64.to_radians()));
    assert_eq!((d.loops[0].frame_a.position.z, &d.loops[0].hinge), (0.1, &Hinge::ball()));
    let w = &d.wheels[0];
    assert_eq!((w.radius, w.axis, w.role), (0.2, Vec3::y(), WheelRole::Idle));
    let foot = d.shapes.iter().find(|s| s.role == ShapeRole::Contact).unwrap();
    assert_eq!((&foot.geometry, foot.pose.position.z), (&Geometry::Sphere { radius: 0.05 }, -0.1));
    assert_eq!(mbs.get_node(mbs.node("imu").unwrap()).pose().position.z, 0.05);
}

#[test]
fn a_companion_file_next_to_the_file_is_found() {
    let dir = folder();
    std::fs::write(dir.path().join("urdf/rover.linkwork.ron"), COMPANION).unwrap();
    let d = read_machine(dir.path().join("urdf/rover.urdf"), &ReadOptions::default()).unwrap();
    assert_eq!(d.loops.len(), 1);
    let text = "Simulation(import: (file: \"urdf/rover.urdf\", collide: true))";
    let loaded = load(dir.path(), "sim.ron", text).unwrap_or_else(|f| panic!("{f}"));
    let mbs = mechanism(&loaded);
    assert_eq!((mbs.loops()[0].closure.name.as_str(), mbs.couplings().len()), ("rod", 1));
    // Two colliders are expected: the collision shape of the URDF file and the contact sphere of the companion file.
    let colliders = loaded.colliders.as_ref().unwrap();
    let names: Vec<_> = colliders.ids().map(|c| colliders.spec(c).name.as_str()).collect();
    assert_eq!(names, ["base/shape3", "left/shape1"]);
    assert_eq!(loaded.shapes.len(), 2, "they are not shown");
    assert_eq!(mbs.get(mbs.body("left").unwrap()).subhinges()[0].subhinge.gear, 50.0);
    assert!(mbs.node("base/imu").is_some());
    std::fs::write(dir.path().join("other.ron"), "Companion(nodes: { \"x\": (body: \"left\") })")
        .unwrap();
    let text = "Simulation(import: (file: \"urdf/rover.urdf\", companion: \"other.ron\"))";
    let loaded = load(dir.path(), "sim.ron", text).unwrap_or_else(|f| panic!("{f}"));
    assert!(mechanism(&loaded).node("left/x").is_some());
}

#[test]
fn unknown_names_in_a_companion_file_are_reported_together() {
    let text = r#"Companion(
    joints: { "left_jont": (gear: 2), "right_joint": (gear: 0, armature: -1, limits: (lower: 1, upper: 0), gaer: 1) },
    couplings: { "a": (terms: { "right_jiont": 1 }), "b": (constant: 1), "c": (terms: { "left_joint": "1 m" }) },
    loops: { "l": (a: (body: "lfet")), },
    wheels: { "rihgt": (radius: 1, width: 0), "left": (radius: 1, width: 1, role: Lazy, steering: "x") },
    contacts: { "bas": [] , "left": [Mesh(file: "x.stl")] },
    nodes: { "a/b": (body: "left"), "w": (body: "world"), "n": (position: [0, 0]) },
    extra: 1,
)"#;
    let mut d = read_urdf(ROVER, &ReadOptions::default()).unwrap();
    let error = apply_companion("s.ron", text, &mut d).err().unwrap().to_string();
    for part in [
        "no joint `left_jont`",
        "`left_joint`",
        "the gear ratio is 0",
        "the armature is negative or not finite",
        "the limits are not valid",
        "no field `gaer`",
        "no joint `right_jiont`",
        "coupling `b` has no `terms`",
        "`1 m` is in m",
        "no link `lfet`",
        "loop `l` has no `b`",
        "no link `rihgt`",
        "`width` is 0 m",
        "`role`: there is no word `Lazy`",
        "no joint `x`",
        "no link `bas`",
        "cannot be used here",
        "`a/b` cannot be the name of a node",
        "node `w` is attached to the world",
        "`nodes`",
        "no field `extra`",
    ]
    .iter()
    .filter(|p| **p != "`nodes`")
    {
        assert!(error.contains(part), "not there: {part}\n{error}");
    }
    let error = apply_companion("s.ron", "Assembly()", &mut d).err().unwrap().to_string();
    assert!(error.contains("begin the file with `Companion(`"), "{error}");
    let error = apply_companion("s.ron", "SideCar()", &mut d).err().unwrap().to_string();
    assert!(error.contains("`SideCar` was renamed\n"), "{error}");
    let text = "Simulation(import: (file: \"urdf/rover.urdf\", sidecar: \"other.ron\"))";
    let error = load(folder().path(), "sim.ron", text).err().unwrap().to_string();
    assert!(error.contains("`sidecar` was renamed: write `companion`"), "{error}");
}

#[test]
fn descriptions_keep_their_picture_and_odd_names() {
    let mut b = Builder::new();
    let chain = Hinge::chain([SubhingeKind::Slider { axis: Vec3::x() }, SubhingeKind::Ball]);
    b.body(BodySpec::new("x::a", "world").hinge(Hinge::free()));
    b.body(BodySpec::new("x::a/1", "x::a").hinge(Hinge::pin(Vec3::x())));
    b.body(BodySpec::new("x__a", "x::a/1").hinge(chain));
    let q = vec![1.0, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5];
    let (turn, both) = (vec![0.25], vec![0.125, 0.6, 0.0, 0.0, 0.8]);
    let initial = |body: &str, q: &Vec<f64>| Initial { body: body.into(), q: q.clone() };
    let d = Description {
        builder: b,
        initial: vec![initial("x::a", &q), initial("x::a/1", &turn), initial("x__a", &both)],
        ..Description::default()
    };
    let made = AssemblyForm::from_description("M", &d);
    assert_eq!(made.bodies["x__a"], "x__a");
    assert_eq!((made.bodies["x::a"].as_str(), made.bodies["x::a/1"].as_str()), ("x__a_", "x__a_1"));
    let catalogue = catalogue();
    let loaded = load_text("m.ron", &made.assembly.to_ron(), &Options::new(&catalogue));
    let loaded = loaded.unwrap_or_else(|f| panic!("{f}"));
    let mbs = mechanism(&loaded);
    assert_eq!(mbs.get(mbs.body("M/x__a").unwrap()).parent(), mbs.body("M/x__a_1"));
    assert_eq!(loaded.spec.mechanism().unwrap().q, [q, turn, both].concat());
}

#[test]
fn limits_and_gears_are_written_with_units() {
    let text = r#"Simulation(bodies: {
        "arm": (parent: "world", hinge: Pin([0, 0, 1]), gear: -50, armature: "10 g m^2",
            limits: (lower: "-90 deg", upper: "90 deg", rate: "30 rpm", effort: "5 N m")),
        "lift": (parent: "arm", hinge: Chain(Slider(axis: [0, 0, 1], limits: (upper: "20 cm", effort: "1 kN")), Locked, Ball)),
    })"#;
    let loaded = good(text);
    let mbs = mechanism(&loaded);
    let of = |body: &str, i: usize| mbs.get(mbs.body(body).unwrap()).subhinges()[i].subhinge;
    let (arm, lift) = (of("arm", 0), of("lift", 0));
    assert_eq!((arm.gear, arm.armature, arm.limits.effort), (-50.0, 0.01, 5.0));
    assert_eq!(arm.limits.lower, -90f64.to_radians());
    assert!((arm.limits.rate - std::f64::consts::PI).abs() < 1e-15);
    assert_eq!((lift.limits.lower, lift.limits.upper), (f64::NEG_INFINITY, 0.2));
    assert_eq!((lift.limits.effort, of("lift", 1).kind), (1000.0, SubhingeKind::Locked));
    for (field, part) in [
        ("gear: 0", "gear ratio 0 is not usable"),
        ("limits: (lower: 1, upper: 0)", "are not usable"),
        ("limits: (lower: \"1 m\")", "but rad is expected"),
        ("limits: (lowr: 1)", "no field `lowr`"),
    ] {
        let text = format!(
            "Simulation(bodies: {{ \"a\": (parent: \"world\", hinge: Pin([0, 0, 1]), {field}) }})"
        );
        let error =
            load_text("t.ron", &text, &Options::new(&catalogue())).err().unwrap().to_string();
        assert!(error.contains(part), "not there: {part}\n{error}");
    }
}

#[test]
fn published_robots_are_imported_as_they_are_read() {
    let robots = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference/robots");
    for name in ["husky", "leo", "ur5", "iiwa7", "solo12_ff", "double_pendulum", "chain10_rand"] {
        let file = Path::new(robots).join(format!("{name}.urdf"));
        if !file.is_file() {
            assert!(
                std::env::var_os("CI").is_none(),
                "reference data robots/{name}.urdf are missing"
            );
            println!("skipped: reference data robots/{name}.urdf are not here");
            continue;
        }
        let file = file.canonicalize().unwrap();
        let dir = tempfile::tempdir().unwrap();
        // The root link of the ur5 is the world itself.
        let root = if name == "ur5" { Root::Fixed } else { Root::Planar };
        let text = format!(
            "Simulation(import: (file: {:?}, root: {root:?}, inertia_check: PositiveMoments))",
            file.display().to_string()
        );
        let loaded = load(dir.path(), "sim.ron", &text).unwrap_or_else(|f| panic!("{f}"));
        let options =
            ReadOptions { root, inertia: InertiaCheck::PositiveMoments, ..ReadOptions::default() };
        let d = linkwork_formats::read_file(&file, &options).unwrap();
        let mut named = d.builder.clone();
        // In an assembly, the names of nodes include their bodies; URDF does not have nodes.
        assert!(named.nodes().is_empty());
        named.bodies_mut().sort_by(|a, b| a.name.cmp(&b.name));
        assert_eq!(mechanism(&loaded), &named.build().unwrap(), "{name}");
        assert_eq!(loaded.imports[0].description.ignored, d.ignored);
    }
}

#[test]
fn moments_that_no_body_has_are_told_or_refused() {
    let dir = tempfile::tempdir().unwrap();
    // The finger has a small negative moment, as in TIAGo's file.
    let urdf = r#"<robot name="r"><link name="base"/><link name="finger"><inertial><mass value="0.1"/>
        <inertia ixx="-3.5e-8" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="turn" type="continuous"><parent link="base"/><child link="finger"/></joint></robot>"#;
    std::fs::write(dir.path().join("r.urdf"), urdf).unwrap();
    let import = |more: &str| {
        load(dir.path(), "sim.ron", &format!("Simulation(import: (file: \"r.urdf\"{more}))"))
    };
    let read = import("").unwrap_or_else(|f| panic!("{f}"));
    let told: Vec<String> =
        read.warnings().iter().map(|w| format!("{} {:?}", w.message, w.help)).collect();
    assert!(
        told.iter().any(|t| t.contains("link `finger`")
            && t.contains("-0.000000035")
            && t.contains("inertia_check: Physical")),
        "{told:?}"
    );
    assert_eq!(import(", inertia_check: Warn").unwrap().warnings().len(), told.len());
    let refused =
        import(", inertia_check: Physical").err().expect("refused on request").to_string();
    assert!(refused.contains("link `finger`"), "{refused}");
    let positive =
        import(", inertia_check: PositiveMoments").err().expect("a moment is below zero");
    assert!(positive.to_string().contains("link `finger`"), "{positive}");
}
