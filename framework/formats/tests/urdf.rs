//! URDF: its contents, and every error with its position.

use linkwork_formats::multibody::{Friction, Hinge, Limits};
use linkwork_formats::spatial::{InertiaCheck, Pose, Quat, Vec3};
use linkwork_formats::{
    Description, FaultKind, FormatError, Geometry, HingeCoordinate, ReadOptions, Root, ShapeRole,
    Unphysical, read_file, read_text, read_urdf,
};

const ARM: &str = include_str!("data/arm.urdf");

fn refused(text: &str) -> FormatError {
    let strict = ReadOptions { unphysical: Unphysical::Refused, ..ReadOptions::default() };
    read_urdf(text, &strict).expect_err("must be refused")
}

#[test]
fn every_joint_type_becomes_its_hinge() {
    let d = read_urdf(ARM, &ReadOptions::default()).unwrap();
    let mbs = d.builder.build().unwrap();
    assert_eq!(d.name, "arm");
    let hinge = |body: &str| mbs.spec(mbs.body(body).unwrap()).hinge;
    assert_eq!(hinge("base"), Hinge::locked());
    let limits = Limits { lower: -1.5, upper: 2.0, rate: 3.0, effort: 40.0 };
    let upper = Hinge::pin(Vec3::new(0.0, 0.6, 0.8)).limits(limits);
    let friction = Friction { force: 0.2, rate: 0.0 };
    assert_eq!(hinge("upper"), upper.damping(0.7).friction(friction));
    assert_eq!(hinge("finger"), Hinge::pin(Vec3::z()));
    assert_eq!(hinge("slide"), Hinge::slider(Vec3::x()));
    assert_eq!(hinge("drone"), Hinge::free());
    assert_eq!(hinge("puck"), Hinge::planar());
    // URDF rotates about fixed axes by roll, pitch and yaw: Rz Ry Rx.
    let upper = mbs.get(mbs.body("upper").unwrap());
    let turn = Quat::from_axis_angle(&Vec3::z_axis(), 0.6)
        * Quat::from_axis_angle(&Vec3::y_axis(), -0.5)
        * Quat::from_axis_angle(&Vec3::x_axis(), 0.4);
    assert!(upper.hinge_in_parent().rotation.angle_to(&turn) < 1e-7);
    assert_eq!(upper.hinge_in_parent().position, Vec3::new(0.1, 0.2, 0.3));
    // A quarter turn about z swaps the first two moments.
    let mass = upper.mass_properties();
    assert!(
        (mass.inertia_com
            - linkwork_formats::spatial::Mat3::from_diagonal(&Vec3::new(0.02, 0.01, 0.025)))
        .amax()
            < 1e-17
    );
    assert_eq!(mass.com, Vec3::new(0.0, 0.2, 0.0));
}

#[test]
fn joints_couplings_and_shapes_are_kept() {
    let d = read_urdf(ARM, &ReadOptions::default()).unwrap();
    let shoulder = d.joint("shoulder").unwrap();
    assert_eq!((shoulder.body.as_str(), shoulder.damping, shoulder.friction), ("upper", 0.7, 0.2));
    let grip = &d.couplings[0];
    let at = |body: &str| HingeCoordinate { body: body.into(), subhinge: 0 };
    assert_eq!(grip.terms[0].coordinate, at("finger"));
    assert_eq!(grip.terms[1].coordinate, at("upper"));
    assert_eq!((grip.terms[0].factor, grip.terms[1].factor, grip.constant), (1.0, 0.5, 0.1));
    assert_eq!(d.shapes.len(), 2);
    assert_eq!(d.shapes[0].name, "plate");
    assert_eq!(d.shapes[0].color, Some([0.7, 0.3, 0.1, 1.0]));
    assert_eq!(d.shapes[1].role, ShapeRole::Collision);
    assert_eq!(d.shapes[1].geometry, Geometry::Capsule { radius: 0.1, length: 0.2 });
}

#[test]
fn whatever_is_not_used_is_listed_with_its_line() {
    let d = read_urdf(ARM, &ReadOptions::default()).unwrap();
    let list: Vec<String> =
        d.ignored.iter().map(|i| format!("{}: {}: {}", i.line, i.path, i.what)).collect();
    let has = |text: &str| assert!(list.iter().any(|l| l == text), "{text} is not in {list:#?}");
    has("24: robot/joint[shoulder]/safety_controller: element <safety_controller>");
    has("14: robot/link[finger]: `finger` moves but has no mass (no inertial)");
    has("30: robot/joint[lift]: no <limit>: its motion is not limited");
    assert_eq!(list.len(), 6, "{list:#?}");
}

#[test]
fn roots_are_held_as_asked() {
    for (root, nv) in [(Root::AsWritten, 0), (Root::Fixed, 0), (Root::Free, 6), (Root::Planar, 3)] {
        let d = read_urdf(ARM, &ReadOptions { root, ..ReadOptions::default() }).unwrap();
        let mbs = d.builder.build().unwrap();
        assert_eq!(mbs.get(mbs.body("base").unwrap()).v().len(), nv);
    }
}

#[test]
fn a_root_link_named_world_is_the_world() {
    let text = r#"<robot name="r"><link name="world"/><link name="a"/>
        <joint name="j" type="fixed"><parent link="world"/><child link="a"/><origin xyz="1 2 3"/></joint></robot>"#;
    let mbs = read_urdf(text, &ReadOptions::default()).unwrap().builder.build().unwrap();
    assert_eq!(mbs.bodies().len(), 1);
    let a = mbs.get(mbs.body("a").unwrap());
    assert_eq!((a.parent(), a.hinge_in_parent()), (None, Pose::translation(1.0, 2.0, 3.0)));
    let free = ReadOptions { root: Root::Free, ..ReadOptions::default() };
    let error = read_urdf(text, &free).expect_err("world cannot float").to_string();
    assert!(error.contains("the root link is `world`"), "{error}");
}

#[test]
fn all_mistakes_at_once_each_with_place_fact_and_remedy() {
    let text = r#"<robot name="bad">
  <link name="a"/>
  <link name="a"/>
  <link name="b"><inertial><mass value="1"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="5"/></inertial></link>
  <link name="c"><visual><geometry><box size="1 2"/></geometry></visual></link>
  <joint name="j1" type="revolut"><parent link="a"/><child link="b"/></joint>
  <joint name="j2" type="fixed"><parent link="a"/><child link="cc"/></joint>
  <joint name="j3" type="fixed"><child link="c"/></joint>
  <joint name="j4" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 0"/>
    <limit lower="x" upper="1"/></joint>
</robot>"#;
    let error = refused(text).to_string();
    for part in [
        "<text>:3:9: link `a` is defined again; the first definition is at <text>:2:3\n  help: use different names",
        "<text>:4:18: link `b`: <inertial>: largest principal moment 5 kg m² exceeds",
        "<text>:6:41: link `c`: <visual>: <box>: `size` is `1 2`, not 3 finite numbers",
        "<text>:7:20: joint `j1` has the unknown type `revolut`\n  help: did you mean `revolute`?",
        "<text>:8:58: joint `j2`: <child> refers to the link `cc`, which does not exist",
        "<text>:9:3: joint `j3` lacks <parent>\n  help: write <parent link=\"..\"/>",
        "<text>:10:77: joint `j4`: <axis> is `0 0 0`, not a nonzero vector",
        "<text>:11:12: joint `j4`: <limit>: `lower` is `x`, not a finite number",
    ] {
        assert!(error.contains(part), "not there: {part}\n{error}");
    }
    assert_eq!(refused(text).faults.len(), 8, "{error}");
}

#[test]
fn trees_that_are_none_are_refused() {
    let link = |n: &str| format!("<link name=\"{n}\"/>\n");
    let joint = |n: &str, p: &str, c: &str| {
        format!(
            "<joint name=\"{n}\" type=\"fixed\"><parent link=\"{p}\"/><child link=\"{c}\"/></joint>\n"
        )
    };
    let robot = |inside: &str| format!("<robot name=\"r\">\n{inside}</robot>");
    let kind = |text: String| refused(&text).faults.remove(0).kind;

    let two = robot(&(link("a") + &link("b") + &link("c") + &joint("j", "a", "b")));
    assert_eq!(kind(two), FaultKind::SeveralRoots { roots: vec!["a".into(), "c".into()] });
    let ring = link("a") + &link("b") + &link("c") + &joint("j", "a", "b") + &joint("k", "b", "a");
    let FaultKind::Cycle { path } = kind(robot(&ring)) else { panic!("no ring") };
    assert_eq!(path, ["a", "b", "a"]);
    let own = robot(&(link("a") + &joint("j", "a", "a")));
    assert!(matches!(kind(own), FaultKind::Cycle { .. }));
    let diamond =
        link("a") + &link("b") + &link("c") + &joint("j", "a", "c") + &joint("k", "b", "c");
    let error = refused(&robot(&diamond));
    assert!(matches!(error.faults[0].kind, FaultKind::TwoParents { .. }), "{error}");
    assert!(matches!(kind(robot("")), FaultKind::Missing { .. }));
    let world = robot(&(link("a") + &link("world") + &joint("j", "a", "world")));
    assert!(matches!(kind(world), FaultKind::BadName { .. }));
}

#[test]
fn malformed_xml_has_line_and_column() {
    let error = refused("<robot name=\"r\">\n  <link name=\"a\">\n</robot>");
    assert!(error.to_string().starts_with("<text>:3:"), "{error}");
    assert!(matches!(error.faults[0].kind, FaultKind::Xml { .. }));
    for text in
        ["", "<", "<robot", "<robot name='r'><drake:x></robot>", "\u{0}", "<!DOCTYPE a><robot/>"]
    {
        let error = refused(text);
        assert!(matches!(error.faults[0].kind, FaultKind::Xml { .. }), "{text}: {error}");
    }
    for tag in ["<a>", "<a b=\"/>\">", "<a b='<!--'>"] {
        let deep = tag.repeat(200_000) + &"</a>".repeat(200_000);
        assert!(matches!(
            refused(&deep).faults[0].kind,
            FaultKind::TooDeep { .. } | FaultKind::Xml { .. }
        ));
        let open = tag.repeat(200_000);
        assert!(matches!(refused(&open).faults[0].kind, FaultKind::Xml { .. }));
    }
    let deep = "<a>".repeat(101) + &"</a>".repeat(101);
    assert!(matches!(refused(&deep).faults[0].kind, FaultKind::TooDeep { .. }));
    // A long text without an end is rejected at once.
    let endless = "<".repeat(2_000_000) + "/";
    assert!(matches!(refused(&endless).faults[0].kind, FaultKind::Xml { .. }));
    let deep = "<a>".repeat(99) + &"</a>".repeat(99);
    assert!(matches!(refused(&deep).faults[0].kind, FaultKind::WrongRoot { .. }));
}

#[test]
fn xacro_is_refused_with_the_command_to_run() {
    let text = "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n<xacro:macro name=\"m\"/>\n\
                <link name=\"${prefix}_base\"/></robot>";
    let error = refused(text);
    assert_eq!(error.faults.len(), 2, "{error}");
    assert!(error.to_string().contains("`<xacro:macro>` requires xacro"), "{error}");
    assert!(error.to_string().contains("xacro robot.urdf.xacro > robot.urdf"), "{error}");
    // xacro itself removes everything but this declaration, so it is accepted.
    let text = "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\"><link name=\"a\"/></robot>";
    read_urdf(text, &ReadOptions::default()).unwrap();
}

#[test]
fn lumped_rotors_are_accepted_when_asked() {
    let text = r#"<robot name="r"><link name="w"><inertial><mass value="1"/>
        <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.9" iyz="0" izz="0.1"/></inertial></link></robot>"#;
    let strict = ReadOptions { unphysical: Unphysical::Refused, ..ReadOptions::default() };
    let error = read_urdf(text, &strict).expect_err("refused").to_string();
    assert!(error.contains("link `w`: <inertial>") && error.contains("PositiveMoments"), "{error}");
    let options = ReadOptions { inertia: InertiaCheck::PositiveMoments, ..ReadOptions::default() };
    read_urdf(text, &options).unwrap();
}

#[test]
fn moments_that_no_body_has_are_read_and_told_or_refused_when_asked() {
    let urdf = |mass: &str, [x, y, z, xy]: [&str; 4]| {
        format!(
            r#"<robot name="r"><link name="w"><inertial><mass value="{mass}"/>
            <inertia ixx="{x}" ixy="{xy}" ixz="0" iyy="{y}" iyz="0" izz="{z}"/></inertial></link></robot>"#
        )
    };
    let read = ReadOptions::default();
    let strict = ReadOptions { unphysical: Unphysical::Refused, ..ReadOptions::default() };
    let moments = |d: &Description| {
        let mut found: Vec<f64> = d.builder.bodies()[0]
            .mass
            .inertia_com
            .symmetric_eigenvalues()
            .iter()
            .copied()
            .collect();
        found.sort_by(f64::total_cmp);
        found
    };
    let told = |text: &str, words: &str, want: [f64; 3]| {
        assert!(read_urdf(text, &strict).is_err(), "refused on request");
        let d = read_urdf(text, &read).unwrap();
        let [line] = &d.doubtful[..] else { panic!("{:?}", d.doubtful) };
        let line = line.to_string();
        assert!(line.contains("link `w`") && line.contains(words), "{line}");
        let off = moments(&d).iter().zip(want).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-12, "{:?}", moments(&d));
        d.builder.build().unwrap();
    };
    told(&urdf("1", ["0.1", "0.9", "0.1", "0"]), "used unchanged", [0.1, 0.1, 0.9]);
    told(&urdf("1", ["-3.5e-8", "1e-3", "1e-3", "0"]), "-0.000000035", [0.0, 1e-3, 1e-3]);
    // These moments are negative in rotated axes: the eigenvalues −0.1, 0.2 and 0.3 are rotated
    // about z.
    told(&urdf("1", ["0.05", "0.05", "0.3", "0.15"]), "replaced by 0", [0.0, 0.2, 0.3]);
    told(&urdf("0", ["0.1", "0.1", "0.1", "0"]), "ignored", [0.0; 3]);
    // The hip of iCub has rounding errors of a zero inertia.
    told(&urdf("0.526", ["-5.42101e-20", "-5.42101e-20", "0", "0"]), "replaced by 0", [0.0; 3]);
    let bare = urdf("2", ["1", "1", "1", "0"]);
    let (from, to) = (bare.find("<inertia ").unwrap(), bare.find("</inertial>").unwrap());
    told(&format!("{}{}", &bare[..from], &bare[to..]), "no <inertia>: a point mass", [0.0; 3]);
    for bad in [
        urdf("-1", ["0.1", "0.1", "0.1", "0"]),
        urdf("1", ["-0.1", "-0.1", "-0.2", "0"]),
        urdf("1", ["-2e-12", "0", "0", "0"]),
    ] {
        assert!(read_urdf(&bad, &read).is_err());
    }
    let good = read_urdf(&urdf("1", ["0.1", "0.1", "0.1", "0"]), &read).unwrap();
    assert!(good.doubtful.is_empty());
}

#[test]
fn prefixes_that_nobody_declared_are_read_and_change_no_place() {
    let text = |more: &str| {
        format!(
            r#"<?xml version="1.0"?><!-- <a> --> <robot name="r"><link name="a"/><drake:group name="g"/>
<link name="b"/><joint name="turn" type="revolute"><parent link="a"/><child link="b"/>{more}
<limit drake:acceleration="2" hsb:x="1" lower="-1" upper="1" velocity="2" effort="3"/></joint></robot>"#
        )
    };
    let d = read_urdf(&text(""), &ReadOptions::default()).unwrap();
    let ignored: Vec<String> = d.ignored.iter().map(ToString::to_string).collect();
    let about = |what: &str| ignored.iter().find(|i| i.contains(what)).unwrap();
    assert!(about("element <drake:group>").contains(":1:"), "{ignored:?}");
    assert!(about("attribute drake:acceleration=\"2\"").contains(":3:"), "{ignored:?}");
    about("attribute hsb:x=\"1\"");
    // Positions refer to the original text, also on the line of the outermost element.
    let plain = text("").replace("drake:", "").replace("hsb:", "");
    let place = |text: &str| refused(text).faults[0].place.clone();
    for (from, to) in [("name=\"a\"", "nome=\"a\""), ("type=\"revolute\"", "type=\"revolt\"")] {
        assert_eq!(place(&text("").replacen(from, to, 1)), place(&plain.replacen(from, to, 1)));
    }
    assert_eq!(place(&text("<axis xyz=\"0 0\"/>")).line, 2);
    // Other errors in the XML are reported at their own positions.
    let broken = text("").replace("</joint>", "</jont>");
    let (there, here) = (place(&plain.replace("</joint>", "</jont>")), place(&broken));
    let prefixes = "drake:hsb:".len() as u32;
    assert_eq!((here.line, here.column), (there.line, there.column + prefixes));
}

#[test]
fn mimics_of_nothing_and_of_themselves_are_refused() {
    let text = |other: &str| {
        format!(
            r#"<robot name="r"><link name="a"/><link name="b"/><joint name="turn" type="continuous">
            <parent link="a"/><child link="b"/><mimic joint="{other}"/></joint></robot>"#
        )
    };
    assert!(refused(&text("trun")).to_string().contains("did you mean `turn`?"));
    assert!(refused(&text("turn")).to_string().contains("not another joint"));
}

#[test]
fn meshes_are_found_and_missing_ones_reported() {
    let dir = tempfile::tempdir().unwrap();
    let package = dir.path().join("rover_description");
    std::fs::create_dir_all(package.join("meshes")).unwrap();
    std::fs::create_dir_all(package.join("urdf")).unwrap();
    for name in ["a.stl", "b.stl"] {
        std::fs::write(package.join("meshes").join(name), "solid").unwrap();
    }
    let mesh = |file: &str| {
        format!("<visual><geometry><mesh filename=\"{file}\" scale=\"1 1 2\"/></geometry></visual>")
    };
    let text = format!(
        "<robot name=\"r\"><link name=\"l\">\n{}\n{}\n{}</link></robot>",
        mesh("package://rover_description/meshes/a.stl"),
        mesh("../meshes/b.stl"),
        mesh("package://elsewhere/c.stl"),
    );
    let file = package.join("urdf/r.urdf");
    std::fs::write(&file, &text).unwrap();
    let d = read_file(&file, &ReadOptions::default()).unwrap();
    let found: Vec<bool> = (d.shapes.iter())
        .map(|s| match &s.geometry {
            Geometry::Mesh { path, scale, .. } => {
                assert_eq!(*scale, [1.0, 1.0, 2.0]);
                path.is_some()
            }
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(found, [true, true, false]);
    assert_eq!((d.ignored.len(), d.ignored[0].line), (1, 4), "{:?}", d.ignored);
    // For a text that is not in a file, only the listed folders are searched.
    let options = ReadOptions { package_paths: vec![dir.path().into()], ..ReadOptions::default() };
    let d = read_text(&text, &options).unwrap();
    assert_eq!(d.ignored.len(), 2, "{:?}", d.ignored);
}

#[test]
fn files_that_are_not_there_or_of_another_kind_are_refused() {
    let error = read_file("nowhere/robot.urdf", &ReadOptions::default()).expect_err("no file");
    assert!(error.to_string().starts_with("nowhere/robot.urdf: cannot be read"), "{error}");
    let error = read_file("robot.urdf.xacro", &ReadOptions::default()).expect_err("xacro");
    assert!(matches!(error.faults[0].kind, FaultKind::Xacro { .. }));
    let error = read_text("<html/>", &ReadOptions::default()).expect_err("html");
    assert!(error.to_string().contains("<html>, not <robot>, <mujoco> or <sdf>"), "{error}");
}

#[test]
fn limits_that_are_none_are_none() {
    let text = |limit: &str| {
        format!(
            r#"<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute">
            <parent link="a"/><child link="b"/><limit {limit}/></joint></robot>"#
        )
    };
    let of = |limit: &str| {
        let d = read_urdf(&text(limit), &ReadOptions::default()).unwrap();
        d.builder.bodies().iter().find(|b| b.name == "b").unwrap().hinge.subhinges[0].limits
    };
    let half = Limits { lower: f64::NEG_INFINITY, upper: 1.5, ..Limits::NONE };
    assert_eq!(of("lower='-inf' upper='1.5' effort='inf' velocity='inf'"), half);
    assert_eq!(of("lower='-1.7976931348623157e308' upper='1.5'"), half);
    // The format's default of both limits is 0.
    assert_eq!(of("effort='1'"), Limits { lower: 0.0, upper: 0.0, effort: 1.0, ..Limits::NONE });
    for limit in ["lower='2' upper='1'", "lower='inf' upper='inf'", "effort='-1'", "velocity='nan'"]
    {
        assert_eq!(refused(&text(limit)).faults.len(), 1, "{limit}");
    }
}

/// URDF 1.1 has quaternions, as `liburdfdom_model` 6.0 reads them; it ignores them in files of version 1.0, which is an error here.
#[test]
fn quaternions_belong_to_version_1_1() {
    let robot = |version: &str, origin: &str| {
        format!(
            r#"<robot{version}><link name="a"/><link name="b"/><joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="1 2 3" {origin}/></joint></robot>"#
        )
    };
    let new = r#" version="1.1""#;
    // The rotation is a quarter turn about z, also as a quaternion that is not of unit length.
    for origin in [r#"rpy="0 0 1.5707963267948966""#, r#"quat_xyzw="0 0 2 2""#] {
        let d = read_urdf(&robot(new, origin), &ReadOptions::default()).unwrap();
        let mbs = d.builder.build().unwrap();
        let pose = mbs.get(mbs.body("b").unwrap()).hinge_in_parent();
        let turn = Quat::from_axis_angle(&Vec3::z_axis(), std::f64::consts::FRAC_PI_2);
        assert!(pose.rotation.angle_to(&turn) < 1e-7, "{origin}");
        assert_eq!(pose.position, Vec3::new(1.0, 2.0, 3.0));
    }
    let told = |text: &str| refused(text).to_string();
    let both = told(&robot(new, r#"rpy="0 0 1" quat_xyzw="0 0 0 1""#));
    assert!(both.contains("the only orientation"), "{both}");
    let zero = told(&robot(new, r#"quat_xyzw="0 0 0 0""#));
    assert!(zero.contains("not a quaternion"), "{zero}");
    for version in ["", r#" version="1.0""#] {
        let old = told(&robot(version, r#"quat_xyzw="0 0 0 1""#));
        assert!(old.contains("not part of version 1.0") && old.contains("1.1"), "{old}");
    }
    let future = told(&robot(r#" version="2.0""#, ""));
    assert!(future.contains("not a supported version"), "{future}");
}
