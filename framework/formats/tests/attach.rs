//! `<attach>` of MJCF: models of other files and copies within a file, compared with MuJoCo 4.0, and files that are rejected.

use linkwork_formats::multibody::Subhinge;
use linkwork_formats::{
    Description, DeviceKind, Length, ReadOptions, Sensor, read_file, read_mjcf,
};
use std::path::Path;

/// A model with its own compiler, defaults, tendon, equality, actuators, sensors and keyframe. The reference numbers are those of MuJoCo for this text.
const CHILD: &str = r#"<mujoco model="child">
<compiler angle="radian" eulerseq="zyx"/>
<default><joint damping="0.3"/><motor gear="5"/><default class="k"><geom density="500"/><joint damping="0.7"/></default></default>
<worldbody>
 <body name="a" pos="0.1 0 0" euler="0.3 0.2 0.1"><joint name="j" range="-1 2"/><geom name="g" size=".1"/>
  <body name="c" childclass="k" pos="0 0.2 0"><joint name="i" axis="0 1 0"/><geom name="h" type="box" size=".1 .2 .3"/><site name="s" pos="0 0 .1"/></body>
 </body>
 <body name="o" pos="0 1 0"><joint name="oj"/><geom name="go" size=".2"/></body>
</worldbody>
<contact><exclude body1="a" body2="o"/></contact>
<tendon><fixed name="t"><joint joint="j" coef="1"/><joint joint="i" coef="2"/></fixed></tendon>
<equality><joint joint1="j" joint2="i" polycoef="0 2 0 0 0"/><weld body1="a"/></equality>
<actuator><motor name="m" joint="j"/><position name="p" joint="i" kp="4"/><motor name="mt" tendon="t"/><motor name="mo" joint="oj"/></actuator>
<sensor><jointpos name="jp" joint="i"/><tendonpos name="tp" tendon="t"/><gyro name="gy" site="s"/></sensor>
<keyframe><key name="k1" qpos="0.1 0.2 0.3"/></keyframe>
</mujoco>"#;

fn main_file(inside: &str) -> String {
    format!(
        r#"<mujoco model="main"><compiler angle="degree"/><default><joint damping="9"/><motor gear="7"/></default>
<asset><model name="mod" file="parts/child.xml"/></asset><worldbody>{inside}</worldbody></mujoco>"#
    )
}

const TWICE: &str = r#"<body name="base" pos="0 0 1"><joint name="bj" ref="30"/><geom size=".3"/><attach model="mod" body="a" prefix="p_"/></body>
<frame pos="2 0 0" euler="0 0 90"><attach model="mod" body="c" prefix="q_"/></frame>"#;

/// Writes the files and reads the main one.
fn with(main: &str, child: &str, options: &ReadOptions) -> Result<Description, String> {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("parts")).unwrap();
    std::fs::write(dir.path().join("parts/child.xml"), child).unwrap();
    std::fs::write(dir.path().join("main.xml"), main).unwrap();
    read_file(dir.path().join("main.xml"), options).map_err(|e| e.to_string())
}

fn read(inside: &str) -> Description {
    with(&main_file(inside), CHILD, &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn names<'d>(d: &'d Description, what: &str) -> Vec<&'d str> {
    match what {
        "bodies" => d.builder.bodies().iter().map(|b| b.name.as_str()).collect(),
        "joints" => d.joints.iter().map(|j| j.name.as_str()).collect(),
        _ => d.devices.iter().map(|x| x.name.as_str()).collect(),
    }
}

fn subhinge(d: &Description, joint: &str) -> Subhinge {
    let j = d.joint(joint).unwrap();
    let body = d.builder.bodies().iter().find(|b| b.name == j.body).unwrap();
    body.hinge.subhinges[j.subhinge]
}

/// The copies have the settings and the defaults of their file, and the poses of MuJoCo: `q_c` loses the frames around it in its file.
#[test]
fn an_attached_model_keeps_its_settings_and_gets_the_prefix() {
    let d = read(TWICE);
    assert_eq!(names(&d, "bodies"), ["base", "p_a", "p_c", "q_c"]);
    let parents: Vec<&str> = d.builder.bodies().iter().map(|b| b.parent.as_str()).collect();
    assert_eq!(parents, ["world", "base", "p_a", "world"]);
    let masses = [113.09733552923255, 4.1887902047863905, 24.0, 24.0];
    for (b, mass) in d.builder.bodies().iter().zip(masses) {
        assert!((b.mass.mass - mass).abs() < 1e-12 * mass, "{}: {}", b.name, b.mass.mass);
    }
    // `body_quat` of `p_a` and `body_pos` of `q_c`.
    let turn = d.builder.bodies()[1].hinge_in_parent.rotation;
    let quat = [0.9833474432563559, 0.03427079855048211, 0.10602051106179562, 0.14357217502739192];
    for (own, x) in [turn.w, turn.i, turn.j, turn.k].into_iter().zip(quat) {
        assert!((own - x).abs() < 1e-15, "{turn:?}");
    }
    let p = d.builder.bodies()[3].hinge_in_parent.position;
    assert!((p.x - 1.8).abs() < 1e-15 && p.y.abs() < 1e-15 && p.z == 0.0, "{p:?}");
    let damping = ["bj", "p_j", "p_i", "q_i"].map(|j| subhinge(&d, j).damping);
    assert_eq!(damping, [9.0, 0.3, 0.7, 0.7]);
    // Radians in the model, degrees in the main file.
    let limits = subhinge(&d, "p_j").limits;
    assert_eq!((limits.lower, limits.upper), (-1.0, 2.0));
    assert_eq!(d.initial.iter().find(|i| i.body == "base").unwrap().q, [30f64.to_radians()]);
}

/// Elements that refer to a part that is not copied are left out, as in MuJoCo: of `o` and of the joint `j`, which `q_` lacks.
#[test]
fn sections_of_an_attached_model_are_copied_with_what_they_refer_to() {
    let d = read(TWICE);
    let own = ["p_t", "p_m", "p_mt", "p_p", "q_p", "p_gy", "p_jp", "p_tp", "q_gy", "q_jp"];
    let mut devices = names(&d, "devices");
    devices.sort_unstable();
    let mut expected = own.to_vec();
    expected.sort_unstable();
    assert_eq!(devices, expected);
    let kind = |name: &str| &d.devices.iter().find(|x| x.name == name).unwrap().kind;
    let DeviceKind::Actuator(m) = kind("p_m") else { panic!() };
    let Length::Joints(terms) = &m.length else { panic!() };
    // `actuator_gear` of `p_m` comes from the defaults of the model.
    assert_eq!((terms[0].factor, terms[0].coordinate.body.as_str()), (5.0, "p_a"));
    assert!(
        matches!(kind("p_tp"), DeviceKind::Sensor(Sensor::Of { device, .. }) if device == "p_t")
    );
    assert_eq!(d.couplings.len(), 1);
    assert_eq!(d.couplings[0].terms[0].coordinate.body, "p_a");
    // The weld to the world holds at the reference configuration.
    assert_eq!(d.loops.iter().filter(|l| l.body_a == "p_a" || l.body_b == "p_a").count(), 1);
    assert!(d.exclusions.is_empty());
}

/// A keyframe of the model sets the copied joints; the others stay at their reference. `key_qpos` of MuJoCo: p_k1 = 0.5236 0.1 0.2 0, q_k1 = 0.5236 0 0 0.2.
#[test]
fn a_keyframe_of_an_attached_model_sets_its_joints() {
    for (key, expected) in [
        ("p_k1", [30f64.to_radians(), 0.1, 0.2, 0.0]),
        ("q_k1", [30f64.to_radians(), 0.0, 0.0, 0.2]),
    ] {
        let options = ReadOptions { keyframe: Some(key.into()), ..ReadOptions::default() };
        let d = with(&main_file(TWICE), CHILD, &options).unwrap();
        let mbs = d.builder.build().unwrap();
        let q = d.configuration(&mbs);
        let at = |j: &str| q[mbs.get(mbs.body(&d.joint(j).unwrap().body).unwrap()).q().start];
        assert_eq!(["bj", "p_j", "p_i", "q_i"].map(at), expected, "{key}");
    }
}

/// Everything in the model's `<worldbody>`, a frame of it, and an empty prefix: names, parents and positions of MuJoCo.
#[test]
fn worlds_frames_and_empty_prefixes_are_attached() {
    let d = read(
        r#"<frame pos="2 0 0" euler="0 0 90"><attach model="mod" prefix="y_"/></frame><body name="b"><joint name="bj"/><geom size="1"/></body>"#,
    );
    assert_eq!(names(&d, "bodies"), ["y_a", "y_c", "y_o", "b"]);
    let p = d.builder.bodies()[2].hinge_in_parent.position;
    assert!((p.x - 1.0).abs() < 1e-15 && p.y.abs() < 1e-15, "{p:?}");
    assert_eq!(d.exclusions, [["y_a".to_owned(), "y_o".to_owned()]]);
    let d = read(
        r#"<body name="b"><joint name="bj"/><geom size="1"/><attach model="mod" body="a" prefix=""/></body>"#,
    );
    assert_eq!(names(&d, "joints"), ["bj", "j", "i"]);
    assert_eq!(["bj", "j", "i"].map(|j| subhinge(&d, j).damping), [9.0, 0.3, 0.7]);
    let child = r#"<mujoco><worldbody><frame name="f" pos="0 0 5"><body name="a"><joint/><geom size="0.1"/></body><geom size="0.2" pos="1 0 0"/></frame></worldbody></mujoco>"#;
    let main = main_file(
        r#"<body name="b"><joint/><geom size="0.1"/><attach model="mod" frame="f" prefix="p_"/></body>"#,
    );
    let d = with(&main, child, &ReadOptions::default()).unwrap();
    assert_eq!(d.builder.bodies()[1].hinge_in_parent.position.z, 5.0);
    // The geom of the frame belongs to `b`: `body_mass` is 37.699.
    let b = &d.builder.bodies()[0].mass;
    assert!((b.mass - 37.69911184307752).abs() < 1e-12, "{}", b.mass);
    assert!((b.com.z - 5.0 * 8.0 / 9.0).abs() < 1e-14);
}

/// A body of the same file is copied with its actuators and tendons: MuJoCo names them m, p_m, t and p_t.
#[test]
fn a_body_of_the_same_file_is_copied() {
    let text = r#"<mujoco><default><default class="c"><joint damping="2"/></default></default><worldbody><body name="a" childclass="c"><joint name="j"/><geom size=".1"/></body>
<body name="z"><geom size=".1"/><attach body="a" prefix="p_"/></body></worldbody>
<tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon><actuator><motor tendon="t" name="m"/></actuator></mujoco>"#;
    let d = read_mjcf(text, &ReadOptions::default()).unwrap();
    assert_eq!(names(&d, "bodies"), ["a", "z", "p_a"]);
    assert_eq!(["j", "p_j"].map(|j| subhinge(&d, j).damping), [2.0, 2.0]);
    let mut devices = names(&d, "devices");
    devices.sort_unstable();
    assert_eq!(devices, ["m", "p_m", "p_t", "t"]);
}

/// Models attach others, whose folders, angles and prefixes add up: names and poses of MuJoCo.
#[test]
fn models_attach_models_with_their_meshes() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write(
        "sub/deep/m/b.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
    );
    write(
        "sub/deep/inner.xml",
        r#"<mujoco model="inner"><compiler angle="radian" meshdir="m"/><asset><mesh file="b.obj"/></asset><worldbody>
<body name="x" euler="0.3 0 0"><joint name="jx" range="-1 1"/><geom name="g" type="mesh" mesh="b"/></body></worldbody><keyframe><key name="k" qpos="7"/></keyframe></mujoco>"#,
    );
    write(
        "sub/outer.xml",
        r#"<mujoco model="outer"><asset><model name="in" file="deep/inner.xml"/></asset><worldbody>
<body name="a" euler="90 0 0"><joint name="j"/><geom size=".1"/><attach model="in" body="x" prefix="q_"/></body></worldbody></mujoco>"#,
    );
    // A `<model>` without `name` takes the name that its file contains.
    let main = r#"<mujoco><asset><model file="sub/outer.xml"/></asset><worldbody><attach model="outer" body="a" prefix="p_"/></worldbody></mujoco>"#;
    write("main.xml", main);
    let options = ReadOptions { keyframe: Some("p_q_k".into()), ..ReadOptions::default() };
    let d = read_file(dir.path().join("main.xml"), &options).unwrap();
    assert_eq!(names(&d, "joints"), ["p_j", "p_q_jx"]);
    let (turn, mass) =
        (&d.builder.bodies()[1].hinge_in_parent.rotation, &d.builder.bodies()[1].mass);
    assert!(
        (turn.w - 0.9887710779360422).abs() < 1e-15 && (turn.i - 0.14943813247359922).abs() < 1e-15
    );
    assert!((mass.mass - 1000.0 / 6.0).abs() < 1e-5, "{}", mass.mass);
    assert_eq!(subhinge(&d, "p_q_jx").limits.upper, 1.0);
    assert_eq!(d.initial.iter().find(|i| i.body == "p_q_x").unwrap().q, [7.0]);
}

/// Actuators, sensors and tendons of replicated joints are copied with the suffix; MuJoCo has the actuators z, x, y0 and y1 here.
#[test]
fn elements_that_refer_to_replicated_names_are_copied() {
    let of = |sections: &str| {
        read_mjcf(
            &format!(
                r#"<mujoco><worldbody><body name="b"><joint name="bj"/><geom name="bg" size=".1"/></body><replicate count="2" offset="1 0 0"><body name="a"><joint name="j"/><geom name="g" size=".1"/>
<body name="c"><joint name="k"/><geom size=".1"/></body></body></replicate></worldbody>{sections}</mujoco>"#
            ),
            &ReadOptions::default(),
        )
        .unwrap_or_else(|e| panic!("{e}"))
    };
    let d = of(
        r#"<actuator><motor joint="bj" name="z"/><motor joint="j" name="y"/><motor joint="bj" name="x"/></actuator>"#,
    );
    assert_eq!(names(&d, "devices"), ["z", "x", "y0", "y1"]);
    // A tendon may also refer to joints outside of the replication.
    let d = of(
        r#"<tendon><fixed name="t"><joint joint="j" coef="1"/><joint joint="bj" coef="2"/></fixed></tendon><actuator><motor tendon="t" name="m"/></actuator><sensor><tendonpos name="s" tendon="t"/></sensor><contact><exclude body1="b" body2="a"/></contact>"#,
    );
    assert_eq!(names(&d, "devices"), ["t0", "t1", "m0", "m1", "s0", "s1"]);
    assert_eq!(d.exclusions, [["b".to_owned(), "a0".into()], ["b".into(), "a1".into()]]);
    let d = of(r#"<equality><joint joint1="j" joint2="k"/></equality>"#);
    assert_eq!(d.couplings.len(), 2);
    // MuJoCo has no equality here.
    let d = of(r#"<equality><joint joint1="j" joint2="bj"/></equality>"#);
    assert!(d.couplings.is_empty());
    assert!(d.ignored.iter().any(|i| i.what.contains("MuJoCo omits it")), "{:?}", d.ignored);
}

#[test]
fn attachments_that_lead_nowhere_are_refused() {
    let error = |inside: &str, child: &str| {
        with(&main_file(inside), child, &ReadOptions::default()).expect_err("refused")
    };
    for (inside, fact) in [
        (r#"<attach model="mod" body="zz" prefix="p"/>"#, "<attach> refers to the body `zz`"),
        (r#"<attach model="mod" frame="zz" prefix="p"/>"#, "<attach> refers to the frame `zz`"),
        (r#"<attach model="no" body="a" prefix="p"/>"#, "<attach> refers to the model `no`"),
        (r#"<attach model="mod" body="a"/>"#, "<attach> lacks `prefix`"),
        (
            r#"<attach model="mod" body="a" frame="f" prefix="p"/>"#,
            "<attach> has `body` and `frame`",
        ),
        (r#"<attach prefix="p"/>"#, "<attach> lacks `model`, `body` or `frame`"),
        (
            r#"<attach model="mod" body="a" prefix="p"/><attach model="mod" body="a" prefix="p"/>"#,
            "body `pa` is defined again",
        ),
        (
            r#"<body name="a"><geom size="1"/><attach body="a" prefix="p"/></body>"#,
            "a part of this file that contains an <attach>",
        ),
    ] {
        let told = error(inside, CHILD);
        assert!(told.contains(fact), "{inside}: {told}");
    }
    let one = r#"<attach model="mod" body="a" prefix="p_"/>"#;
    // A mistake in a model has the position in its file.
    let told = error(one, &CHILD.replace("0.1 0 0\" euler", "x\" euler"));
    assert!(told.contains("child.xml:5:17: body `p_a`: `pos` is `x`"), "{told}");
    assert!(error(one, "<robot name=\"r\"/>").contains("not <mujoco>"));
    let ring = r#"<mujoco><asset><model name="mod" file="../main.xml"/></asset><worldbody><body name="a"><attach model="mod" prefix="q"/></body></worldbody></mujoco>"#;
    assert!(error(one, ring).contains("include each other in a circle"));
    let told = read_mjcf(&main_file(one), &ReadOptions::default()).unwrap_err().to_string();
    assert!(told.contains("does not have a file whose folder can be searched"), "{told}");
    let told = read_file(Path::new("none.xml"), &ReadOptions::default()).unwrap_err().to_string();
    assert!(told.contains("none.xml"), "{told}");
}

/// A model that attaches the next one ten times in each of ten files stands for 10¹⁰ bodies.
#[test]
fn attachments_without_end_are_limited() {
    let dir = tempfile::tempdir().unwrap();
    for k in 0..10 {
        let inside: String = match k {
            9 => "<geom size=\"1\"/>".into(),
            _ => (0..10)
                .map(|n| format!("<attach model=\"m\" body=\"b\" prefix=\"p{n}\"/>"))
                .collect(),
        };
        let text = format!(
            "<mujoco><asset><model name=\"m\" file=\"{}.xml\"/></asset><worldbody><body name=\"b\">{inside}</body></worldbody></mujoco>",
            k + 1
        );
        let text =
            if k == 9 { text.replace("<model name=\"m\" file=\"10.xml\"/>", "") } else { text };
        std::fs::write(dir.path().join(format!("{k}.xml")), text).unwrap();
    }
    let told =
        read_file(dir.path().join("0.xml"), &ReadOptions::default()).unwrap_err().to_string();
    assert!(told.contains("creates more than 1000000 elements"), "{told}");
}
