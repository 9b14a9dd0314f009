//! MJCF: compared with MuJoCo 4.0 (`data/lab.json` was computed by its Python package from `data/lab.xml`) and with values computed by hand, and
//! every error.

use linkwork_dynamics::{Tree, Workspace, kinematics, mass_matrix};
use linkwork_formats::multibody::{Hinge, SubhingeKind};
use linkwork_formats::spatial::nalgebra::Quaternion;
use linkwork_formats::spatial::{Mat3, Quat, Vec3};
use linkwork_formats::{
    Description, FormatError, Geometry, ReadOptions, Root, ShapeRole, Unphysical, read_file,
    read_mjcf,
};
use serde_json::Value;

fn lab() -> (Description, Value) {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data");
    let d = read_file(format!("{folder}/lab.xml"), &ReadOptions::default());
    let json = std::fs::read_to_string(format!("{folder}/lab.json")).unwrap();
    (d.unwrap_or_else(|e| panic!("{e}")), serde_json::from_str(&json).unwrap())
}

fn nums(v: &Value) -> Vec<f64> {
    v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn quat(v: &Value) -> Quat {
    let q = nums(v);
    Quat::new_unchecked(Quaternion::new(q[0], q[1], q[2], q[3]))
}

#[track_caller]
fn close(a: &[f64], b: &[f64], tol: f64, what: &str) {
    assert_eq!(a.len(), b.len());
    for (x, y) in a.iter().zip(b) {
        assert!((x - y).abs() <= tol, "{what}: {a:?} is not {b:?}");
    }
}

/// Converts MuJoCo's q of a state to our order.
fn our_q(d: &Description, json: &Value, state: &Value) -> Vec<f64> {
    let mbs = d.builder.build().unwrap();
    let (theirs, mut q) = (nums(&state["q"]), vec![f64::NAN; mbs.nq()]);
    for j in json["joints"].as_array().unwrap() {
        let joint = d.joint(j["name"].as_str().unwrap()).unwrap();
        let range = &mbs.get(mbs.body(&joint.body).unwrap()).subhinges()[joint.subhinge];
        let at = j["q"].as_u64().unwrap() as usize;
        let order: &[usize] = match range.subhinge.kind {
            SubhingeKind::Ball => &[1, 2, 3, 0],
            SubhingeKind::Free => &[0, 1, 2, 4, 5, 6, 3],
            _ => &[0],
        };
        for (i, from) in range.q.clone().zip(order) {
            q[i] = theirs[at + from];
        }
    }
    q
}

#[test]
fn kinematics_are_those_of_mujoco_with_several_joints_anchors_and_references() {
    let (d, json) = lab();
    let mbs = d.builder.build().unwrap();
    for state in json["states"].as_array().unwrap() {
        let poses = mbs.body_poses(&our_q(&d, &json, state));
        for (i, name) in json["bodies"].as_array().unwrap().iter().enumerate() {
            let name = name.as_str().unwrap();
            let X = poses[mbs.body(name).unwrap().index()];
            close(X.position.as_slice(), &nums(&state["xpos"][i]), 2e-15, name);
            let (R, S) = (X.rotation.to_rotation_matrix(), quat(&state["xquat"][i]));
            let S = S.to_rotation_matrix();
            close(R.matrix().as_slice(), S.matrix().as_slice(), 3e-15, name);
        }
        let grip = mbs.node("grip").map(|n| mbs.get_node(n)).unwrap();
        let X = poses[grip.body().index()] * grip.pose();
        close(X.position.as_slice(), &nums(&state["site_xpos"]), 2e-15, "grip");
    }
}

#[test]
fn masses_from_geoms_and_inertials_are_those_of_mujoco() {
    let (d, json) = lab();
    let mbs = d.builder.build().unwrap();
    for (i, name) in json["bodies"].as_array().unwrap().iter().enumerate() {
        let name = name.as_str().unwrap();
        let own = mbs.get(mbs.body(name).unwrap()).mass_properties();
        let mass = json["mass"][i].as_f64().unwrap();
        assert!((own.mass - mass).abs() <= 1e-14 * mass, "{name}: {} and {mass}", own.mass);
        close(own.com.as_slice(), &nums(&json["ipos"][i]), 1e-15, name);
        let R = quat(&json["iquat"][i]).to_rotation_matrix().into_inner();
        let J = R * Mat3::from_diagonal(&Vec3::from_vec(nums(&json["inertia"][i]))) * R.transpose();
        close(own.inertia_com.as_slice(), J.as_slice(), 2e-14, name);
    }
}

#[test]
fn the_mass_matrix_is_that_of_mujoco_with_armature() {
    let (d, json) = lab();
    let mbs = d.builder.build().unwrap();
    let (tree, nv) = (Tree::new(&mbs), mbs.nv());
    let mut ws = Workspace::new(&tree);
    // MuJoCo's first nine rates are the joints of the arm (scalar joints and a ball). They are the
    // same in Linkwork.
    let mut ours = Vec::new();
    for j in json["joints"].as_array().unwrap().iter().take(7) {
        let joint = d.joint(j["name"].as_str().unwrap()).unwrap();
        ours.extend(mbs.get(mbs.body(&joint.body).unwrap()).subhinges()[joint.subhinge].v.clone());
    }
    ours.truncate(9);
    for state in json["states"].as_array().unwrap() {
        kinematics(&tree, &mut ws, &our_q(&d, &json, state), &vec![0.0; nv]);
        let mut M = vec![0.0; nv * nv];
        mass_matrix(&tree, &mut ws, &mut M);
        for (row, i) in state["M"].as_array().unwrap().iter().zip(&ours) {
            let own: Vec<f64> = ours.iter().map(|j| M[i * nv + j]).collect();
            close(&own, &nums(row), 3e-14, "mass matrix");
        }
    }
}

#[test]
fn limits_constraints_and_shapes_are_kept() {
    let (d, json) = lab();
    let mbs = d.builder.build().unwrap();
    for j in json["joints"].as_array().unwrap() {
        let joint = d.joint(j["name"].as_str().unwrap()).unwrap();
        let s = mbs.get(mbs.body(&joint.body).unwrap()).subhinges()[joint.subhinge].subhinge;
        let range = nums(&j["range"]);
        if s.kind.nv() == 1 && range[0] != range[1] {
            close(&[s.limits.lower, s.limits.upper], &range, 1e-16, &joint.name);
        }
    }
    // The joints a and b share a hinge. The slide b is displaced by 0.1 m when its coordinate is 0, so c, whose anchor
    // is at b = 0.1, needs a massless body in between; d has its own anchor.
    let names: Vec<(&str, usize)> = ["a", "b", "c", "d"]
        .map(|n| d.joint(n).unwrap())
        .map(|j| (j.body.as_str(), j.subhinge))
        .into();
    assert_eq!(names, [("upper/c", 0), ("upper/c", 1), ("upper/d", 0), ("upper", 0)]);
    let w = d.joint("w").unwrap();
    assert_eq!((w.stiffness, w.damping), (2.0, 0.3));
    assert_eq!(w.spring_reference, 10f64.to_radians());
    // The coupling is y − y₀ = 0.05 + 0.5 (x − x₀). Linkwork uses MuJoCo's coordinates.
    let follow = &d.couplings[0];
    assert_eq!((follow.terms[0].factor, follow.terms[1].factor), (1.0, -0.5));
    let expected = 0.05 + 30f64.to_radians() - 0.5 * 15f64.to_radians();
    assert!((follow.constant - expected).abs() < 1e-16);
    let seen = d.shapes.iter().filter(|s| s.role == ShapeRole::Visual).count();
    assert_eq!((seen, d.shapes.len()), (6, 13));
    let rod = d.shapes.iter().find(|s| s.body == "upper").unwrap();
    let Geometry::Cylinder { radius, length } = rod.geometry else { panic!("{rod:?}") };
    assert_eq!(radius, 0.05);
    assert!((length - 0.14f64.sqrt()).abs() < 1e-16);
    assert_eq!(rod.color, Some([0.1, 0.2, 0.3, 1.0]));
}

#[test]
fn loops_close_in_the_configuration_of_the_file() {
    let (d, json) = lab();
    let mbs = d.builder.build().unwrap();
    let mut q = mbs.neutral_q();
    for i in &d.initial {
        q[mbs.get(mbs.body(&i.body).unwrap()).q()].copy_from_slice(&i.q);
    }
    close(&q, &our_q(&d, &json, &json["states"][0]), 1e-16, "reference configuration");
    let poses = mbs.body_poses(&q);
    assert_eq!(d.loops.len(), 2);
    for l in &d.loops {
        let place = |body: &str| poses[mbs.body(body).unwrap().index()];
        let (A, B) = (place(&l.body_a) * l.frame_a, place(&l.body_b) * l.frame_b);
        close(A.position.as_slice(), B.position.as_slice(), 3e-15, &l.name);
        assert!(A.rotation.angle_to(&B.rotation) < 1e-7, "{}", l.name);
    }
    assert_eq!(d.loops[0].hinge, Hinge::ball());
    assert_eq!(d.loops[1].hinge, Hinge::locked());
    assert_eq!(d.loops[0].frame_a.position, Vec3::new(0.1, 0.2, 0.3));
}

#[test]
fn what_is_not_used_is_listed() {
    let (d, _) = lab();
    let list: Vec<&str> = d.ignored.iter().map(|i| i.what.as_str()).collect();
    assert_eq!(list, ["a site on the world is not a node"], "{:#?}", d.ignored);
}

const HEAD: &str = "<mujoco><worldbody>\n";
const TAIL: &str = "\n</worldbody></mujoco>";

fn refused(inside: &str) -> FormatError {
    let strict = ReadOptions { unphysical: Unphysical::Refused, ..ReadOptions::default() };
    read_mjcf(&format!("{HEAD}{inside}{TAIL}"), &strict).expect_err("refused")
}

#[test]
fn all_mistakes_at_once() {
    let text = r#"<body name="a" pos="1 2"><geom size="0.1"/></body>
<body name="a"><geom type="boxx" size="1"/></body>
<body name="world"><geom/></body>
<body name="c" childclass="arm"><joint type="hinges"/><geom type="box" size="1 2"/></body>
<body name="d"><joint axis="0 0 0"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 5"/></body>
<body name="e"><joint range="3 1"/><joint type="free"/><geom type="mesh" mesh="wheel"/></body>
<body name="f"><body name="g"><freejoint/><geom size="-1"/></body></body>"#;
    let error = refused(text).to_string();
    for part in [
        ":2:16: body `a`: `pos` is `1 2`, not 3 finite numbers",
        ":3:7: body `a` is defined again; the first definition is at <text>:2:1",
        "is `boxx`, not a type of geom\n  help: did you mean `box`?",
        ":4:7: body name `world` is not allowed",
        "lacks `size`",
        "refers to the class `arm`, which does not exist",
        "joint `c_joint1` has the unknown type `hinges`\n  help: did you mean `hinge`?",
        "`size` is `1 2`, not 3 to 10 finite numbers",
        "`axis` is `0 0 0`, not a nonzero vector",
        "body `d`: <inertial>: largest principal moment 5",
        "`range` is `3 1`, not a range",
        "body `e` has a free joint and other joints",
        "refers to the mesh `wheel`, which does not exist",
        "is free, but body `g` is not in <worldbody>",
        "not positive lengths",
    ] {
        assert!(error.contains(part), "not there: {part}\n{error}");
    }
    assert_eq!(refused(text).faults.len(), 15, "{error}");
}

#[test]
fn classes_and_equalities_that_lead_nowhere_are_refused() {
    let text = r#"<mujoco>
<default><default><geom/></default><default class="x"/><default class="x"/></default>
<compiler angle="grad" eulerseq="xy" coordinate="global"/>
<worldbody><body name="a"><joint name="j"/><geom size="1"/></body></worldbody>
<equality><connect body1="a" body2="b" anchor="0 0 0"/><connect body1="a"/>
<weld site1="s" site2="t"/><joint joint1="k"/><joint/><tendon tendon1="t"/></equality></mujoco>"#;
    let error = read_mjcf(text, &ReadOptions::default()).expect_err("refused").to_string();
    for part in [
        "a nested <default> lacks `class`",
        "class `x` is defined again",
        "`angle` is `grad`",
        "`eulerseq` is `xy`, not three of",
        "`coordinate` is `global`",
        "refers to the body `b`",
        "lacks `anchor`",
        "refers to the site `s`",
        "refers to the hinge or slide joint `k`",
        "lacks `joint1`",
        "refers to the fixed tendon `t`",
    ] {
        assert!(error.contains(part), "not there: {part}\n{error}");
    }
}

/// Some editors begin a text with a byte order mark.
#[test]
fn a_byte_order_mark_is_skipped() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.xml");
    let text = "\u{feff}<mujoco><worldbody><body name=\"b\"><joint/><geom size=\"1\"/></body></worldbody></mujoco>";
    std::fs::write(&path, text).unwrap();
    assert_eq!(read_file(&path, &ReadOptions::default()).unwrap().builder.bodies().len(), 1);
    assert!(linkwork_formats::whole_text(&path).unwrap().starts_with("<mujoco>"));
    std::fs::write(&path, [0xef, 0xbb, 0xbf, 0xff]).unwrap();
    assert!(linkwork_formats::whole_text(&path).unwrap_err().contains("it is not a text"));
}

#[test]
fn includes_are_replaced_and_rings_are_found() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    let main = |inside: &str| format!("<mujoco><worldbody>{inside}</worldbody></mujoco>");
    write(
        "main.xml",
        &main("<body name=\"a\"><geom size=\"1\"/><include file=\"arm.xml\"/></body>"),
    );
    write(
        "arm.xml",
        "<mujocoinclude><body name=\"b\" poz=\"1\"><joint/><geom size=\"1\"/></body></mujocoinclude>",
    );
    let d = read_file(dir.path().join("main.xml"), &ReadOptions::default()).unwrap();
    assert_eq!(d.builder.bodies().len(), 2);
    assert!(
        d.ignored[0].file.ends_with("arm.xml")
            && d.ignored[0].what.starts_with("attribute poz=\"1\"")
    );
    // A mistake in an included file is reported with the name of that file.
    write("arm.xml", "<mujocoinclude>\n<body name=\"b\" pos=\"x\"/></mujocoinclude>");
    let error = read_file(dir.path().join("main.xml"), &ReadOptions::default()).expect_err("pos");
    assert!(error.to_string().contains("arm.xml:2:16: body `b`: `pos` is `x`"), "{error}");
    write("arm.xml", "<mujocoinclude><include file=\"main.xml\"/></mujocoinclude>");
    let error = read_file(dir.path().join("main.xml"), &ReadOptions::default()).expect_err("ring");
    assert!(error.to_string().contains("include each other in a circle"), "{error}");
    write(
        "main.xml",
        &main("<include file=\"none.xml\"/><include file=\"w.xml\"/><include file=\"w.xml\"/>"),
    );
    write("w.xml", "<mujocoinclude/>");
    let error = read_file(dir.path().join("main.xml"), &ReadOptions::default()).expect_err("none");
    assert!(error.to_string().contains("refers to the file `none.xml`"), "{error}");
    assert!(error.to_string().contains("`w.xml` is included a second time"), "{error}");
    let error = read_mjcf(&main("<include file=\"a.xml\"/>"), &ReadOptions::default());
    assert!(error.expect_err("no file").to_string().contains("does not have a file"));
}

#[test]
fn differentials_of_fixed_tendons_become_couplings() {
    let text = r#"<mujoco><worldbody><body name="a"><joint name="p"/><geom size="1"/></body>
<body name="b"><joint name="q" type="slide"/><geom size="1"/></body></worldbody>
<tendon><fixed name="sum"><joint joint="p" coef="2"/><joint joint="q" coef="-3"/></fixed></tendon>
<equality><tendon name="t" tendon1="sum" polycoef="0.5 0 0 0 0"/></equality></mujoco>"#;
    let d = read_mjcf(text, &ReadOptions::default()).unwrap();
    let c = &d.couplings[0];
    let factors: Vec<(&str, f64)> =
        c.terms.iter().map(|t| (t.coordinate.body.as_str(), t.factor)).collect();
    assert_eq!((factors, c.constant), (vec![("a", 2.0), ("b", -3.0)], 0.5));
}

#[test]
fn roots_without_joints_are_held_as_asked() {
    let text = format!(
        "{HEAD}<body name=\"a\"><geom size=\"1\"/></body><body name=\"b\"><joint/><geom size=\"1\"/></body>{TAIL}"
    );
    for (root, a) in [(Root::AsWritten, 0), (Root::Fixed, 0), (Root::Free, 6), (Root::Planar, 3)] {
        let d = read_mjcf(&text, &ReadOptions { root, ..ReadOptions::default() }).unwrap();
        let mbs = d.builder.build().unwrap();
        let nv = |name: &str| mbs.get(mbs.body(name).unwrap()).v().len();
        assert_eq!((nv("a"), nv("b")), (a, 1));
    }
}

#[test]
fn a_chain_of_hundreds_of_bodies_is_read() {
    let n = 900;
    let text = format!(
        "{HEAD}{}{}{TAIL}",
        "<body><joint/><geom size=\"0.1\"/>".repeat(n),
        "</body>".repeat(n)
    );
    let d = read_mjcf(&text, &ReadOptions::default()).unwrap();
    assert_eq!(d.builder.build().unwrap().nv(), n);
}

/// Sensors and actuators without a model are listed by name, with a remedy where another model has the reading.
#[test]
fn other_sensors_and_adhesion_are_listed_by_name() {
    let text = format!(
        "{HEAD}<body name=\"b\"><joint/><geom size=\"1\"/><site name=\"s\"/></body></worldbody>{}</mujoco>",
        r#"<sensor><touch name="pad" site="s"/><magnetometer name="compass" site="s"/><rangefinder name="ray" camera="s"/><insidesite name="in" objtype="site" objname="s"/></sensor>
<actuator><adhesion name="glue" body="b" ctrlrange="0 1"/></actuator>"#
    );
    let d = read_mjcf(&text, &ReadOptions::default()).unwrap();
    let listed: Vec<String> = d.ignored.iter().map(ToString::to_string).collect();
    // The touch sensor is read.
    assert_eq!(listed.len(), 4, "{listed:#?}");
    assert_eq!(d.devices.len(), 1);
    for (name, line, remedy) in [
        ("magnetometer[compass]", 2, "`sensors.magnetometer`"),
        ("sensor `ray`", 2, "`sensors.lidar`"),
        ("insidesite[in]", 2, "`framepos`"),
        ("adhesion[glue]", 3, "no model pulls a body"),
    ] {
        let here = |l: &&String| l.contains(name) && l.contains(remedy);
        assert!(listed.iter().any(|l| here(&l)), "{name}: {listed:#?}");
        assert!(d.ignored.iter().any(|i| i.path.contains(name) && i.line == line), "{name}");
    }
}

/// Readers of deep files run in threads with small stacks, in builds of every optimization.
#[test]
fn the_stack_does_not_limit_the_depth_of_a_file() {
    let nested = |n: usize, open: &str, inside: &str, close: &str| {
        format!("{HEAD}{}{inside}{}{TAIL}", open.repeat(n), close.repeat(n))
    };
    let body = "<body><joint/><geom size=\"0.1\"/>";
    let ball = format!("{body}</body>");
    let chain = "<replicate count=\"2\">".to_owned()
        + &body.repeat(900)
        + &"</body>".repeat(900)
        + "</replicate>";
    let cases = [
        (nested(900, body, "", "</body>"), 900),
        (nested(900, "<frame>", &ball, "</frame>"), 1),
        (
            nested(900, body, "<replicate count=\"3\"><geom size=\"0.1\"/></replicate>", "</body>"),
            900,
        ),
        (format!("{HEAD}{chain}{TAIL}"), 1800),
        (
            format!(
                "<mujoco>{}{}<worldbody>{ball}{TAIL}",
                (0..900).map(|k| format!("<default class=\"c{k}\">")).collect::<String>(),
                "</default>".repeat(900)
            ),
            1,
        ),
        (nested(900, "<unknown>", "", "</unknown>"), 0),
    ];
    let read = move || {
        for (text, n) in cases {
            let d = read_mjcf(&text, &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(d.builder.bodies().len(), n);
        }
        let error = read_mjcf(&nested(1001, body, "", "</body>"), &ReadOptions::default());
        assert!(matches!(
            error.unwrap_err().faults[0].kind,
            linkwork_formats::FaultKind::TooDeep { limit: 1000 }
        ));
    };
    let small = std::thread::Builder::new().stack_size(256 * 1024).spawn(read);
    small.unwrap().join().unwrap();
}

#[test]
fn the_total_mass_may_be_set() {
    let text = r#"<mujoco><compiler settotalmass="6"/><worldbody>
<body name="a"><joint/><geom type="box" size="0.5 1 1.5" mass="1"/></body>
<body name="b"><joint/><inertial pos="1 0 0" mass="2" diaginertia="3 4 5"/></body></worldbody></mujoco>"#;
    let d = read_mjcf(text, &ReadOptions::default()).unwrap();
    let mass = |i: usize| d.builder.bodies()[i].mass;
    assert_eq!((mass(0).mass, mass(1).mass), (2.0, 4.0));
    assert_eq!(mass(1).inertia_com, Mat3::from_diagonal(&Vec3::new(6.0, 8.0, 10.0)));
    // A box of 1 kg with sides 1, 2, 3 has moments (4 + 9) / 12 and so on; the total mass is 2 kg.
    let sides = Vec3::new(13.0, 10.0, 5.0) / 6.0;
    assert!((mass(0).inertia_com - Mat3::from_diagonal(&sides)).amax() < 1e-15);
    assert!(d.ignored.is_empty(), "{:?}", d.ignored);
}
