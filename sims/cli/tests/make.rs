//! Projects from `linkwork new` are complete; impossible ones are rejected.
use crate::common::{Lab, Said, names, root};
use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Stdio};

/// Runs Cargo in a folder without the network: this test has already downloaded everything.
fn cargo(folder: &Path, args: &[&str]) -> Said {
    let mut c = Command::new(env!("CARGO"));
    c.args(args).env("CARGO_NET_OFFLINE", "true").current_dir(folder).stdin(Stdio::null());
    // Environment variables of Cargo for this test must not affect another workspace.
    for (key, _) in std::env::vars().filter(|(k, _)| k.starts_with("CARGO_PKG_")) {
        c.env_remove(key);
    }
    c.env_remove("CARGO_MANIFEST_DIR");
    c.output().unwrap().into()
}

/// Checks by Cargo without compiling: all packages and their dependencies exist, in the same versions as in Linkwork, and the sources are formatted.
/// `.ci/library` compiles, tests and runs it.
#[test]
fn a_new_library_is_a_whole_workspace() {
    let lab = Lab::new();
    let made = lab.linkwork(&["new", "library", "own/windmill"]).code(0).out;
    let files = ["Cargo.toml", "src/motor.rs", "program/src/main.rs", "unit/src/lib.rs"];
    let python = ["src/lib.rs", "pyproject.toml", "windmill/__init__.py", "tests/test_windmill.py"];
    for file in files.map(String::from).into_iter().chain(python.map(|f| format!("python/{f}"))) {
        assert!(made.contains(&format!("own/windmill/{file}\n")), "{made}");
    }
    let folder = lab.path("own/windmill");
    cargo(&folder, &["fmt", "--all", "--check"]).code(0);
    for package in ["windmill", "windmill-program", "windmill-unit", "windmill-python"] {
        let tree = cargo(&folder, &["tree", "-p", package, "--depth", "1", "--prefix", "none"]);
        let tree = tree.code(0).out;
        assert!(tree.contains("linkwork"), "{package} does not depend on Linkwork:\n{tree}");
    }
    // No version is newer than in Linkwork's own Cargo.lock, and the profiles are equal.
    let versions = |path: &Path| -> BTreeSet<String> {
        let text = std::fs::read_to_string(path).unwrap();
        let blocks = text.split("[[package]]").filter(|b| b.contains("checksum = "));
        blocks.map(|b| b.lines().skip(1).take(2).collect()).collect()
    };
    let (own, all) = (versions(&folder.join("Cargo.lock")), versions(&root().join("Cargo.lock")));
    assert!(own.len() > 100 && own.is_subset(&all), "{:?}", own.difference(&all));
    let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap();
    assert!(manifest.contains("linkwork-dynamics = { opt-level = 3, codegen-units = 1 }"));
    assert!(manifest.contains("[profile.release.package]\n"));
    // Only versions of crates contain the character around words of a template.
    let signs = manifest.lines().filter(|l| l.contains('@'));
    assert!(
        signs.into_iter().all(|l| l.starts_with('"') && l.matches('@').count() == 1),
        "{manifest}"
    );
    // The Python files of the package are exactly Linkwork's files.
    let theirs = root().join("sims/python/python/linkwork");
    let own = folder.join("python/windmill");
    let sources = names(&theirs)
        .into_iter()
        .filter(|f| [".py", ".pyi", ".typed"].iter().any(|e| f.ends_with(e)));
    let sources: Vec<String> = sources.collect();
    assert_eq!(names(&own), sources);
    for file in sources {
        assert_eq!(
            std::fs::read(own.join(&file)).unwrap(),
            std::fs::read(theirs.join(&file)).unwrap(),
            "{file}"
        );
    }

    let more = ["new", "model", "relief_valve", "--library", "own/windmill"];
    let more = lab.linkwork(&more).code(0);
    assert_eq!(more.out, "own/windmill/src/relief_valve.rs\nown/windmill/src/lib.rs\n");
    let list = std::fs::read_to_string(folder.join("src/lib.rs")).unwrap();
    assert!(list.contains("pub mod motor;\npub mod relief_valve;\n"), "{list}");
    assert!(list.contains("Entry::model::<relief_valve::ReliefValve>()"), "{list}");
}

/// Models can also be added to Linkwork's own libraries.
#[test]
fn a_model_in_a_library_of_the_project_imports_the_runtime() {
    let lab = Lab::new();
    for file in ["Cargo.toml", "src/lib.rs"] {
        let text = std::fs::read_to_string(root().join("components/power").join(file)).unwrap();
        lab.write(&format!("power/{file}"), &text);
    }
    lab.linkwork(&["new", "model", "fuel_cell", "--library", "power"]).code(0);
    let model = std::fs::read_to_string(lab.path("power/src/fuel_cell.rs")).unwrap();
    assert!(model.contains("use linkwork_runtime::prelude::*;"), "{model}");
    assert!(model.contains("#[model(\"power.fuel_cell\")]"), "{model}");
    let list = std::fs::read_to_string(lab.path("power/src/lib.rs")).unwrap();
    assert!(list.contains("pub mod fuel_cell;") && list.contains("fuel_cell::FuelCell>()"));
}

#[test]
fn what_cannot_be_made_is_refused_and_leaves_nothing() {
    let lab = Lab::new();
    let refused = |args: &[&str], wanted: &[&str]| {
        lab.linkwork(&[&["new"], args].concat()).code(2).tells(wanted).tells(&["help: "]);
    };
    for name in ["Windmill", "2mills", "wind-mill", "mill_"] {
        refused(&["library", name], &["cannot be the name of a library", "lower-case letters"]);
    }
    refused(&["library", "fn"], &["it is reserved in Rust"]);
    refused(&["library", "actuators"], &["`linkwork` already has one with that name"]);
    refused(&["library", "ray"], &["it is reserved in Rust or Python"]);
    refused(&["library", "lambda"], &["it is reserved in Rust or Python"]);
    refused(&["library", ".."], &["does not have a name that a library can use"]);
    refused(
        &["library", "mill", "--linkwork", "here"],
        &["the sources of Linkwork are not in `here`"],
    );
    assert_eq!(lab.files(), [""; 0], "something was made");
    lab.write("mill/note", "");
    refused(&["library", "mill"], &["`mill` already exists"]);
    assert_eq!(names(&lab.path("mill")), ["note"]);

    refused(&["model", "pump"], &["`.` is not a model library", "new library NAME"]);
    lab.write("own/Cargo.toml", "[package]\nname = \"own\"\n");
    lab.write("own/src/lib.rs", "//! Nothing.\n");
    let own = ["--library", "own"];
    refused(&[&["model", "pump"], &own[..]].concat(), &["depends neither on `linkwork` nor"]);
    lab.write("own/Cargo.toml", "[package]\nname = \"own\"\n[dependencies]\nlinkwork = \"1\"\n");
    refused(&[&["model", "pump"], &own[..]].concat(), &["lacks a function `catalogue`"]);
    let list = "//! One.\n\npub mod pump;\n\npub fn catalogue() -> Vec<Entry> {\n    vec![]\n}\n";
    lab.write("own/src/lib.rs", list);
    refused(&[&["model", "pump"], &own[..]].concat(), &["the library already has `pump`"]);
    refused(&[&["model", "Pump"], &own[..]].concat(), &["cannot be the name of a model"]);
    assert_eq!(std::fs::read_to_string(lab.path("own/src/lib.rs")).unwrap(), list);
    assert_eq!(names(&lab.path("own/src")), ["lib.rs"]);
}

/// Returns the folder of a generated rover, with the output of `check` and of a run of some seconds.
fn made_rover(lab: &Lab, name: &str, file: &Path) -> (String, String, String) {
    let from = file.to_str().unwrap();
    lab.linkwork(&["new", "rover", name, "--from", from]).code(0);
    let checked = lab.linkwork(&["check", name]).code(0);
    let said =
        lab.linkwork(&["run", name, "--until", "12s", "--no-log", "--save-rrd", "off"]).code(0);
    let readme = std::fs::read_to_string(lab.path(&format!("{name}/README.md"))).unwrap();
    (readme, checked.out + &checked.err, said.out + &said.err)
}

/// Returns the number after a name in the output of a run.
fn metric(said: &str, name: &str) -> f64 {
    let line = said.lines().find(|l| l.contains(name)).unwrap_or_else(|| panic!("{name}: {said}"));
    line.split(name).nth(1).unwrap().split_whitespace().next().unwrap().parse().unwrap()
}

/// Published vehicles become rovers that drive: a rigid one with skid steering, and one whose axles point in both directions.
#[test]
fn a_urdf_becomes_a_rover_that_drives() {
    let robots = root().join("../shared/reference/robots");
    for (name, radius, ahead) in [("husky", "0.1651", 3.0), ("leo", "0.0625", 1.0)] {
        let file = robots.join(format!("{name}.urdf"));
        if !file.is_file() {
            assert!(std::env::var("CI").is_err(), "{name}.urdf is not there");
            println!("SKIPPED: no reference file {name}.urdf");
            continue;
        }
        let lab = Lab::new();
        let (readme, checked, said) = made_rover(&lab, name, &file);
        assert_eq!(readme.matches(&format!("| {radius} m,")).count(), 4, "{readme}");
        assert!(!checked.contains("does not rest"), "{checked}");
        // Deliberate choices need no remark; unused content of the file gives one.
        assert_eq!(checked.matches("warning: ").count(), 1, "{checked}");
        assert!(checked.contains("that are not used:"), "{checked}");
        let driven = metric(&said, "distance by odometry");
        assert!(driven > ahead && metric(&said, "greatest tilt") < 15.0, "{said}");
    }
}

/// Six wheels on bogies and rockers on uneven ground: motors drive and are driven, and their energy balance closes. It once missed 1.7 to 2.1 J of 33
/// to 44 J, because each step bent the bristle of a motor's friction far beyond the limit of a lightly loaded gear.
#[test]
fn the_motors_of_a_made_rover_keep_their_energy() {
    let lab = Lab::new();
    let link = |name: &str, mass: f64, more: &str| {
        let i = 0.004 * mass;
        format!(
            r#"<link name="{name}"><inertial><mass value="{mass}"/><inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial>{more}</link>"#
        )
    };
    let joint = |name: &str, kind: &str, parent: &str, xyz: &str| {
        let limit = if kind == "revolute" {
            r#"<limit lower="-0.6" upper="0.6" effort="100" velocity="5"/>"#
        } else {
            ""
        };
        format!(
            r#"<joint name="{name}_joint" type="{kind}"><parent link="{parent}"/><child link="{name}"/><origin xyz="{xyz}"/><axis xyz="0 1 0"/>{limit}</joint>"#
        )
    };
    let tyre = r#"<collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.125" length="0.15"/></geometry></collision>"#;
    let mut text = String::from(r#"<robot name="six">"#) + &link("chassis", 40.0, "");
    for (side, y) in [("left", 0.3), ("right", -0.3)] {
        let (rocker, bogie) = (format!("{side}_rocker"), format!("{side}_bogie"));
        let out = 0.13 * f64::signum(y);
        text +=
            &(link(&rocker, 4.0, "") + &joint(&rocker, "revolute", "chassis", &format!("0 {y} 0")));
        text += &(link(&bogie, 2.0, "") + &joint(&bogie, "revolute", &rocker, "-0.25 0 -0.1"));
        for (wheel, parent, at) in [
            ("front", &rocker, format!("0.5 {out} -0.15")),
            ("middle", &bogie, format!("0.22 {out} -0.05")),
            ("rear", &bogie, format!("-0.22 {out} -0.05")),
        ] {
            let name = format!("{side}_{wheel}_wheel");
            text += &(link(&name, 3.0, tyre) + &joint(&name, "continuous", parent, &at));
        }
    }
    lab.write("six.urdf", &(text + "</robot>"));
    let (_, checked, said) = made_rover(&lab, "six", &lab.path("six.urdf"));
    assert!(metric(&said, "distance by odometry") > 2.0, "{checked}{said}");
    assert!(!said.contains("is not closed"), "{said}");
}

/// Steering, a rocker, axles of both directions, an arm; then a companion file that names the wheels.
#[test]
fn wheels_steering_and_suspension_are_found() {
    let lab = Lab::new();
    let link = |name: &str, more: &str| {
        format!(
            r#"<link name="{name}"><inertial><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>{more}</link>"#
        )
    };
    let joint = |name: &str, kind: &str, parent: &str, xyz: &str, axis: &str| {
        let limit = if kind == "revolute" {
            r#"<limit lower="-1" upper="1" effort="50" velocity="2"/>"#
        } else {
            ""
        };
        format!(
            r#"<joint name="{name}_joint" type="{kind}"><parent link="{parent}"/><child link="{name}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/>{limit}</joint>"#
        )
    };
    let tyre = r#"<collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.1" length="0.06"/></geometry></collision>"#;
    let wheels = [
        ("fl", "rocker_l", "0.4 0.1 -0.1", "0 1 0"),
        ("rl", "rocker_l", "-0.4 0.1 -0.1", "0 -1 0"),
        ("fr", "yoke", "0 0 -0.1", "0 1 0"),
        ("rr", "rocker_r", "-0.4 -0.1 -0.1", "0 1 0"),
    ];
    let mut text = String::from(r#"<robot name="scout">"#);
    text += &link("base", "").replace("value=\"2\"", "value=\"20\"");
    for (name, xyz) in [("rocker_l", "0 0.3 0"), ("rocker_r", "0 -0.3 0")] {
        text += &(link(name, "") + &joint(name, "revolute", "base", xyz, "0 1 0"));
    }
    text += &(link("yoke", "") + &joint("yoke", "revolute", "rocker_r", "0.4 -0.1 0", "0 0 -1"));
    text += &(link("mast", "") + &joint("mast", "revolute", "base", "0 0 0.3", "0 0 1"));
    for (name, parent, xyz, axis) in wheels {
        text += &(link(name, tyre) + &joint(name, "continuous", parent, xyz, axis));
    }
    text += "</robot>";
    lab.write("scout.urdf", &text);
    let (readme, _, said) = made_rover(&lab, "scout", &lab.path("scout.urdf"));
    for part in [
        "Joints that adapt to the ground: `rocker_l`, `rocker_r`.",
        "A differential, which the file does not have, connects `rocker_l` and `rocker_r`",
        "Joints without an actuator, which are held: `mast`.",
        "| `fr` | 0.1 m, 0.06 m | [0.4, -0.4, -0.1] | yes | yoke |",
    ] {
        assert!(readme.contains(part), "{part}: {readme}");
    }
    assert!(metric(&said, "distance by odometry") > 1.0, "{said}");
    // A companion file names them instead; one of them is idle.
    let wheel = |name: &str, more: &str| format!("\"{name}\": (radius: 0.1, width: 0.06{more}), ");
    let side = ["fl", "rl", "fr"].map(|w| wheel(w, "")).concat() + &wheel("rr", ", role: Idle");
    lab.write("scout.linkwork.ron", &format!("Companion(wheels: {{ {side} }})"));
    let (readme, checked, _) = made_rover(&lab, "three", &lab.path("scout.urdf"));
    assert!(readme.contains("| `rr` | 0.1 m, 0.06 m | [-0.4, -0.4, -0.1] | no | – |"), "{readme}");
    assert!(!checked.contains("wheel `"), "{checked}");
}

#[test]
fn what_is_no_rover_is_refused() {
    let lab = Lab::new();
    lab.write("arm.urdf", r#"<robot name="arm"><link name="base"/></robot>"#);
    let told = lab.linkwork(&["new", "rover", "arm", "--from", "arm.urdf"]).code(2).err;
    assert!(told.contains("there is no wheel") && told.contains("companion file"), "{told}");
    assert!(!lab.path("arm").exists());
    let told = lab.linkwork(&["new", "rover", "none", "--from", "none.urdf"]).code(2).err;
    assert!(told.contains("`none.urdf` cannot be read"), "{told}");
    lab.write("bad.urdf", "<robot name=");
    let told = lab.linkwork(&["new", "rover", "bad", "--from", "bad.urdf"]).code(2).err;
    assert!(told.contains("`bad.urdf` is rejected"), "{told}");
    // The robot has two wheels and casters, like TIAGo.
    let link = |name: &str, shape: &str| {
        format!(
            r#"<link name="{name}"><inertial><mass value="5"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>{shape}</link>"#
        )
    };
    let tyre = r#"<collision><origin rpy="1.5708 0 0" xyz="0 0 0"/><geometry><cylinder radius="0.1" length="0.05"/></geometry></collision>"#;
    let joint = |name: &str, y: f64| {
        format!(
            r#"<joint name="{name}_joint" type="continuous"><parent link="base"/><child link="{name}"/><origin xyz="0 {y} 0"/><axis xyz="0 1 0"/></joint>"#
        )
    };
    let two = link("base", "")
        + &link("l", tyre)
        + &link("r", tyre)
        + &joint("l", 0.2)
        + &joint("r", -0.2);
    lab.write("two.urdf", &format!("<robot name=\"two\">{two}</robot>"));
    let told = lab.linkwork(&["new", "rover", "two", "--from", "two.urdf"]).code(2).err;
    assert!(
        told.contains("2 wheels") && told.contains("caster") && !told.contains("couple the joints"),
        "{told}"
    );
    // The message has only one remedy, for the position.
    lab.write("welded.urdf", r#"<robot name="welded"><link name="world"/></robot>"#);
    let told = lab.linkwork(&["new", "rover", "welded", "--from", "welded.urdf"]).code(2).err;
    assert!(told.contains("remove the link `world`"), "{told}");
    assert_eq!(told.matches("help:").count(), 1, "{told}");
}
