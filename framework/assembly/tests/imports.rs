//! Collision masks, exclusions and meshes of imported files.
use crate::common::*;
use crate::machine::load;
use linkwork_assembly::*;
use linkwork_runtime::{Files, compile};

/// Genesis #3267, MuJoCo #2444: bit masks and exclusions of an MJCF file. In MuJoCo 4.0, only the floor has contacts.
#[test]
fn bit_masks_and_exclusions_of_a_file_say_who_meets_whom() {
    let text = r#"<mujoco><default><geom contype="1" conaffinity="0"/></default><worldbody>
        <geom name="floor" type="plane" size="5 5 0.1" contype="0" conaffinity="1" friction="0.05"/>
        <body name="a"><freejoint/><geom name="ga" size="0.1"/></body><body name="b"><freejoint/><geom name="gb" size="0.1"/></body>
        <body name="c"><freejoint/><geom name="gc" size="0.1" conaffinity="1"/></body>
        <body name="d"><freejoint/><geom name="gd" size="0.1" conaffinity="1"/></body></worldbody>
        <contact><exclude body1="c" body2="d"/></contact></mujoco>"#;
    let catalogue = catalogue();
    let options = Options::new(&catalogue).embed("m.xml", text);
    let sim = "Simulation(bodies: { \"crate\": (parent: \"world\", hinge: Free, mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: true, name: \"own\")]) },
        contact: (), import: (file: \"m.xml\", collide: true))";
    let loaded = load_text("s.ron", sim, &options).unwrap_or_else(|f| panic!("{f}"));
    let again = load_text("r.ron", &loaded.resolved, &options).unwrap_or_else(|f| panic!("{f}"));
    for loaded in [&loaded, &again] {
        let all = loaded.colliders.as_ref().unwrap();
        let meet = |a: &str, b: &str| {
            // Collision shapes have the names of visual shapes with a suffix.
            let find = |n: &str| all.find(&format!("{n}_")).or(all.find(n));
            let [a, b] = [a, b].map(|n| find(n).unwrap_or_else(|| panic!("{n}")));
            all.meet(a, b)
        };
        for (a, b, expected) in [
            ("floor", "a/ga", true),
            ("a/ga", "b/gb", false),
            ("a/ga", "c/gc", true),
            ("floor", "c/gc", true),
            ("c/gc", "d/gd", false),
            // Shapes outside of the file have the usual masks.
            ("a/ga", "crate/own", true),
            ("crate/own", "floor", true),
        ] {
            assert_eq!((meet(a, b), meet(b, a)), (expected, expected), "{a} {b}");
        }
        assert_eq!(all.spec(all.find("floor").unwrap()).material.friction, 0.05);
        assert_eq!(all.spec(all.find("a/ga_").unwrap()).material.friction, 1.0);
    }
}

#[test]
fn an_assembly_says_which_of_its_pairs_do_not_meet() {
    let text = |ignore: &str| {
        format!(
            "Simulation(contact: (), {ignore} bodies: {{
              \"a\": (parent: \"world\", hinge: Free, mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: true, name: \"s\")]),
              \"b\": (parent: \"world\", hinge: Free, mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: true, name: \"s\")]) }})"
        )
    };
    let catalogue = catalogue();
    let options = Options::new(&catalogue);
    let meet = |ignore: &str| {
        let loaded = load_text("s.ron", &text(ignore), &options).unwrap_or_else(|f| panic!("{f}"));
        let all = loaded.colliders.as_ref().unwrap();
        all.meet(all.find("a/s").unwrap(), all.find("b/s").unwrap())
    };
    assert!(meet(""));
    assert!(!meet("ignore: [[\"a\", \"b\"]],"));
    let wrong = load_text("s.ron", &text("ignore: [[\"a\", \"c\"]],"), &options);
    assert!(wrong.err().unwrap().to_string().contains('c'));
}

/// bullet3 #1109, drake #7725: COLLADA, and files that are not meshes, among the visual shapes of a robot.
#[test]
fn meshes_that_cannot_be_shown_are_warnings_of_an_import() {
    let dir = tempfile::tempdir().unwrap();
    let dae = r##"<COLLADA><asset/><library_geometries><geometry id="g"><mesh><source id="p"><float_array>0 0 0 1 0 0 0 1 0 0 0 1</float_array></source><vertices><input semantic="POSITION" source="#p"/></vertices><triangles><input semantic="VERTEX" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry></library_geometries></COLLADA>"##;
    std::fs::write(dir.path().join("tri.dae"), dae).unwrap();
    std::fs::write(dir.path().join("broken.dae"), "no mesh").unwrap();
    let visual = |file: &str| {
        format!(
            "<visual><geometry><mesh filename=\"{file}\"/></geometry></visual><collision><geometry><mesh filename=\"{file}\"/></geometry></collision>"
        )
    };
    let robot = format!(
        "<robot name=\"r\"><link name=\"a\">{}{}</link></robot>",
        visual("tri.dae"),
        visual("broken.dae")
    );
    std::fs::write(dir.path().join("r.urdf"), robot).unwrap();
    let text = "Simulation(import: (file: \"r.urdf\", collide: true))";
    let loaded = load(dir.path(), "sim.ron", text).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!((loaded.shapes.len(), loaded.colliders.as_ref().unwrap().len()), (2, 1));
    let warnings: String = loaded.warnings().iter().map(|w| w.message.clone()).collect();
    assert!(warnings.contains("mesh `broken.dae`"), "{warnings}"); // this mesh collides
    assert!(warnings.contains("broken.dae` of `a` cannot be shown"), "{warnings}");
    let text =
        "Simulation(bodies: { \"b\": (parent: \"world\", shapes: [Mesh(file: \"broken.dae\")]) })";
    let loaded = load(dir.path(), "own.ron", text).unwrap_or_else(|f| panic!("{f}"));
    let warnings: String = loaded.warnings().iter().map(|w| w.message.clone()).collect();
    assert!(warnings.contains("broken.dae` of `b` cannot be shown"), "{warnings}");
}

/// A warning about an element of an included file has the name of this file and the line there.
#[test]
fn warnings_name_the_file_in_which_an_element_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    let more = "<mujocoinclude>\n<sensor>\n<magnetometer name=\"pad\" site=\"s\"/></sensor></mujocoinclude>";
    write("more.xml", more);
    let robot = r#"<mujoco><include file="more.xml"/><worldbody><body name="b"><joint/><geom size="0.1" bogus="1"/><site name="s"/></body></worldbody></mujoco>"#;
    write("robot.xml", robot);
    let text = "Simulation(import: (file: \"robot.xml\"))";
    let loaded = load(dir.path(), "sim.ron", text).unwrap_or_else(|f| panic!("{f}"));
    let warnings: Vec<String> = loaded.warnings().iter().map(|w| w.message.clone()).collect();
    let unused = warnings.iter().find(|w| w.contains("that are not used")).unwrap();
    let line = |part: &str| unused.lines().find(|l| l.contains(part)).unwrap().to_owned();
    assert!(line("magnetometer").contains("sensor/magnetometer[pad] ("), "{unused}");
    assert!(line("magnetometer").contains("more.xml:3)"), "{unused}");
    assert!(line("bogus").contains("(line 1)"), "{unused}");
}

/// An error that the compiler finds in an imported body names the line of its element, in the included file. Each body is a point mass on its hinge.
#[test]
fn errors_of_the_compiler_name_the_line_of_an_imported_body() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    write(
        "robot.xml",
        r#"<mujoco><worldbody><body name="a"><joint name="j"/><geom size="0.1"/></body></worldbody><include file="more.xml"/></mujoco>"#,
    );
    write(
        "more.xml",
        "<mujocoinclude><worldbody>\n <!-- ü --> <body name=\"late\"><joint name=\"k\"/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"0 0 0\"/></body></worldbody></mujocoinclude>",
    );
    let inertia = r#"ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0""#;
    write(
        "robot.urdf",
        &format!(
            "<robot name=\"r\">\n<link name=\"base\"/>\n  <link name=\"late\"><inertial><mass value=\"1\"/><inertia {inertia}/></inertial></link>\n<joint name=\"j\" type=\"continuous\"><parent link=\"base\"/><child link=\"late\"/></joint></robot>"
        ),
    );
    write(
        "robot.sdf",
        "<sdf version=\"1.9\"><model name=\"m\">\n<link name=\"late\"><inertial><mass>1</mass><inertia><ixx>0</ixx><iyy>0</iyy><izz>0</izz></inertia></inertial></link>\n<joint name=\"j\" type=\"revolute\"><parent>world</parent><child>late</child><axis><xyz>0 0 1</xyz></axis></joint></model></sdf>",
    );
    for (file, place) in [
        ("robot.xml", "more.xml:2:13"),
        ("robot.urdf", "robot.urdf:3:3"),
        ("robot.sdf", "robot.sdf:2:1"),
    ] {
        let text = format!("Simulation(import: (file: {file:?}), gravity: \"none\")");
        let loaded = load(dir.path(), "sim.ron", &text).unwrap_or_else(|f| panic!("{f}"));
        let faults = match compile(&loaded.spec, &catalogue(), &Files::default()) {
            Err(faults) => faults.0,
            Ok(_) => panic!("{file}: compiled"),
        };
        let error = Failure { faults, sources: loaded.sources.clone() }.show(Look::Plain);
        assert!(error.contains("`late`: its hinge moves no mass"), "{file}: {error}");
        assert!(error.contains(place), "{file}: {error}");
    }
}
