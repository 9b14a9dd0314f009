//! SDF: poses relative to anything, joints, loops, gearboxes, and every error.

use linkwork_formats::multibody::{Hinge, Limits, Multibody, SubhingeKind};
use linkwork_formats::spatial::{Pose, Quat, Vec3};
use linkwork_formats::{
    Description, FormatError, Geometry, ReadOptions, Root, ShapeRole, read_sdf, read_urdf,
};

const INERTIAL: &str = "<inertial><mass>2</mass><inertia><ixx>0.2</ixx><iyy>0.3</iyy><izz>0.4</izz></inertia></inertial>";

fn read(text: &str) -> Description {
    let text = text.replace("@", INERTIAL);
    read_sdf(&text, &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(text: &str) -> FormatError {
    read_sdf(&text.replace("@", INERTIAL), &ReadOptions::default()).expect_err("refused")
}

fn at(mbs: &Multibody, q: &[f64], body: &str) -> Pose {
    mbs.body_poses(q)[mbs.body(body).unwrap().index()]
}

#[track_caller]
fn same(a: &Pose, b: &Pose) {
    assert!((a.position - b.position).amax() < 2e-15, "{a:?} is not {b:?}");
    assert!(
        (a.rotation.to_rotation_matrix().matrix() - b.rotation.to_rotation_matrix().matrix())
            .amax()
            < 2e-15
    );
}

/// One mechanism with everything relative to the model, and with everything relative to something else.
const PLAIN: &str = r#"<sdf version="1.9"><model name="m"><pose>1 2 3 0 0 0.5</pose><static>true</static>
<link name="a"><pose>0 0 1 0.1 0.2 0.3</pose>@</link>
<link name="b"><pose>0.5 0.6 0.7 -0.4 0.5 0.6</pose>@</link>
<joint name="j" type="revolute"><pose>0.1 0 0.2 0.3 0 0</pose><parent>a</parent><child>b</child>
  <axis><xyz>0 0.6 0.8</xyz><limit><lower>-1</lower><upper>2</upper><effort>-1</effort><velocity>5</velocity></limit>
  <dynamics><damping>0.3</damping><friction>0.2</friction></dynamics></axis></joint>
</model></sdf>"#;

#[test]
fn hinge_frames_are_where_the_file_shows_them() {
    let d = read(PLAIN);
    let mbs = d.builder.build().unwrap();
    let rpy = |r, p, y, x: [f64; 3]| Pose::new(Quat::from_euler_angles(r, p, y), Vec3::from(x));
    let model = rpy(0.0, 0.0, 0.5, [1.0, 2.0, 3.0]);
    let (a, b) = (rpy(0.1, 0.2, 0.3, [0.0, 0.0, 1.0]), rpy(-0.4, 0.5, 0.6, [0.5, 0.6, 0.7]));
    let j = rpy(0.3, 0.0, 0.0, [0.1, 0.0, 0.2]);
    same(&at(&mbs, &[0.0], "a"), &(model * a));
    same(&at(&mbs, &[0.0], "b"), &(model * b));
    // Compute the pose by hand: X_Wb(q) = X_WJ R(q) X_bJ⁻¹.
    let turn = Quat::from_scaled_axis(Vec3::new(0.0, 0.6, 0.8) * 0.7);
    same(&at(&mbs, &[0.7], "b"), &(model * b * j * Pose::rotation(turn) * j.inverse()));
    let s = mbs.get(mbs.body("b").unwrap()).subhinges()[0].subhinge;
    assert_eq!(s.limits, Limits { lower: -1.0, upper: 2.0, rate: 5.0, effort: f64::INFINITY });
    assert_eq!((d.joints[0].damping, d.joints[0].friction), (0.3, 0.2));
    assert!(d.ignored.is_empty(), "{:?}", d.ignored);
}

#[test]
fn frames_of_any_kind_may_carry_a_pose() {
    // The pose of a is relative to a frame, and the pose of b is relative to the joint, whose own pose is
    // relative to a. The axis is given in the frame of a.
    let text = r#"<sdf version="1.9"><world name="w"><model name="m" canonical_link="a"><static>1</static>
<frame name="start" attached_to="a"><pose relative_to="__model__">0 0 0.25 0 0 0</pose></frame>
<link name="a"><pose relative_to="start" degrees="true">0 0 0.75 0 0 90</pose>@</link>
<link name="b"><pose relative_to="j" rotation_format="quat_xyzw">0 1 0  0 0 0 1</pose>@</link>
<joint name="j" type="prismatic"><pose relative_to="a">2 0 0 0 0 0</pose><parent>a</parent><child>tip</child>
  <axis><xyz expressed_in="__model__">1 0 0</xyz></axis></joint>
<frame name="tip" attached_to="b"><pose>0 0 1 0 0 0</pose></frame>
</model></world></sdf>"#;
    let d = read(text);
    let mbs = d.builder.build().unwrap();
    same(
        &at(&mbs, &[0.0], "a"),
        &Pose::new(Quat::from_euler_angles(0.0, 0.0, 90f64.to_radians()), Vec3::z()),
    );
    // The x axis of a is the model's y axis: j is at (0, 2, 1), and b is 1 m further along y of a,
    // which is −x.
    let b = at(&mbs, &[0.0], "b").position;
    assert!((b - Vec3::new(-1.0, 2.0, 1.0)).amax() < 1e-15, "{b}");
    let moved = at(&mbs, &[0.5], "b").position;
    assert!((moved - Vec3::new(-0.5, 2.0, 1.0)).amax() < 1e-15, "{moved}");
    let tip = mbs.get_node(mbs.node("tip").unwrap());
    assert_eq!((mbs.get(tip.body()).name(), tip.pose()), ("b", Pose::translation(0.0, 0.0, 1.0)));
    assert_eq!(mbs.get(mbs.get_node(mbs.node("start").unwrap()).body()).name(), "a");
}

#[test]
fn every_joint_type_becomes_its_hinge() {
    let joint = |kind: &str, inside: &str| {
        let text = format!(
            "<sdf version=\"1.10\"><model name=\"m\"><link name=\"a\">@</link><link name=\"b\">@</link>\
             <joint name=\"j\" type=\"{kind}\"><parent>a</parent><child>b</child>{inside}</joint></model></sdf>"
        );
        let mbs = read(&text).builder.build().unwrap();
        mbs.spec(mbs.body("b").unwrap()).hinge
    };
    let axis =
        "<axis><xyz>0 0 2</xyz><limit><lower>-1e16</lower><upper>1e16</upper></limit></axis>";
    let axis2 = "<axis2><xyz>0 1 0</xyz></axis2>";
    assert_eq!(joint("fixed", ""), Hinge::locked());
    assert_eq!(joint("ball", ""), Hinge::ball());
    assert_eq!(joint("revolute", axis), Hinge::pin(Vec3::z()));
    assert_eq!(joint("continuous", axis), Hinge::pin(Vec3::z()));
    assert_eq!(joint("prismatic", axis), Hinge::slider(Vec3::z()));
    let both = format!("{axis}{axis2}");
    assert_eq!(joint("universal", &both), Hinge::universal(Vec3::z(), Vec3::y()));
    assert_eq!(joint("revolute2", &both), Hinge::universal(Vec3::z(), Vec3::y()));
    // 0.5 m per revolution, right-handed. The older element expresses the same as −4π rad/m.
    let turn = 2.0 * std::f64::consts::PI;
    let screw = joint("screw", &format!("{axis}<screw_thread_pitch>0.5</screw_thread_pitch>"));
    assert_eq!(screw, Hinge::screw(Vec3::z(), 0.5 / turn));
    let old = joint("screw", &format!("{axis}<thread_pitch>{}</thread_pitch>", -2.0 * turn));
    let SubhingeKind::Screw { pitch, .. } = old.subhinges[0].kind else { panic!("{old:?}") };
    assert!((pitch - 0.5 / turn).abs() < 1e-17);
}

#[test]
fn links_without_joints_float_unless_static() {
    let text = "<sdf version=\"1.9\"><model name=\"m\"><pose>1 2 3 0 0 0</pose><link name=\"a\">@</link></model></sdf>";
    let d = read(text);
    let mbs = d.builder.build().unwrap();
    assert_eq!((mbs.nv(), &d.initial[0].q[..]), (6, &[1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0][..]));
    let text = text.replace("@", INERTIAL);
    for (root, nv) in [(Root::Fixed, 0), (Root::Free, 6), (Root::Planar, 3)] {
        let d = read_sdf(&text, &ReadOptions { root, ..ReadOptions::default() }).unwrap();
        assert_eq!(d.builder.build().unwrap().nv(), nv);
    }
    let held = text.replace(
        "</model>",
        "<joint name=\"j\" type=\"fixed\"><parent>world</parent><child>a</child></joint></model>",
    );
    let mbs = read(&held).builder.build().unwrap();
    assert_eq!(mbs.nv(), 0);
    same(&at(&mbs, &[], "a"), &Pose::translation(1.0, 2.0, 3.0));
}

#[test]
fn several_and_nested_models_have_their_names_in_front() {
    let text = r#"<sdf version="1.9"><world name="w">
<model name="x"><static>true</static><link name="a">@</link>
  <model name="n"><pose>0 0 1 0 0 0</pose><link name="a">@</link><frame name="f"><pose>0 1 0 0 0 0</pose></frame></model>
  <joint name="j" type="ball"><parent>a</parent><child>n::a</child></joint></model>
<model name="y"><link name="a">@</link><include><uri>model://sun</uri></include></model>
</world></sdf>"#;
    let d = read(text);
    let mbs = d.builder.build().unwrap();
    let names: Vec<&str> = mbs.bodies().iter().map(|b| b.name()).collect();
    assert_eq!(names, ["x::a", "x::n::a", "y::a"]);
    assert_eq!(d.joints[0].name, "x::j");
    assert_eq!(mbs.get_node(mbs.node("x::n::f").unwrap()).pose().position, Vec3::y());
    assert_eq!(d.ignored.len(), 1);
    assert!(d.ignored[0].what.starts_with("the include of `model://sun` was not found: "));
}

#[test]
fn a_second_joint_to_a_link_closes_a_loop() {
    let text = r#"<sdf version="1.9"><model name="m"><static>true</static>
<link name="a">@</link><link name="b"><pose>1 0 0 0 0 0</pose>@</link><link name="c"><pose>0 1 0 0 0 0</pose>@</link>
<joint name="ab" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz></axis></joint>
<joint name="ac" type="revolute"><parent>a</parent><child>c</child><axis><xyz>0 0 1</xyz></axis></joint>
<joint name="bc" type="ball"><pose>0.5 0 0 0 0 0</pose><parent>b</parent><child>c</child></joint></model></sdf>"#;
    let d = read(text);
    let mbs = d.builder.build().unwrap();
    assert_eq!((mbs.nv(), d.loops.len(), d.joints.len()), (2, 1, 2));
    let l = &d.loops[0];
    assert_eq!((l.name.as_str(), &l.hinge), ("bc", &Hinge::ball()));
    let A = at(&mbs, &[0.0, 0.0], &l.body_a) * l.frame_a;
    same(&A, &(at(&mbs, &[0.0, 0.0], &l.body_b) * l.frame_b));
    assert_eq!(A.position, Vec3::new(0.5, 1.0, 0.0));
}

#[test]
fn mimics_and_gearboxes_become_couplings() {
    let text = r#"<sdf version="1.11"><model name="m"><static>true</static>
<link name="base">@</link><link name="in">@</link><link name="out">@</link>
<joint name="i" type="revolute"><parent>base</parent><child>in</child><axis><xyz>0 0 1</xyz></axis></joint>
<joint name="o" type="revolute"><parent>base</parent><child>out</child><axis><xyz>0 0 -1</xyz>
  <mimic joint="i"><multiplier>2</multiplier><offset>0.5</offset><reference>0.1</reference></mimic></axis></joint>
<joint name="g" type="gearbox"><parent>in</parent><child>out</child><axis><xyz>0 0 1</xyz></axis>
  <axis2><xyz>0 0 1</xyz></axis2><gearbox_ratio>3</gearbox_ratio><gearbox_reference_body>base</gearbox_reference_body></joint>
</model></sdf>"#;
    let d = read(text);
    let terms = |i: usize| -> Vec<(&str, f64)> {
        d.couplings[i].terms.iter().map(|t| (t.coordinate.body.as_str(), t.factor)).collect()
    };
    // The mimic is q_o = 2 (q_i − 0.1) + 0.5.
    assert_eq!((terms(0), d.couplings[0].constant), (vec![("out", 1.0), ("in", -2.0)], 0.3));
    // The gearbox is θ_out = −3 θ_in about +z, and o rotates about −z, so −q_o + 3 q_i = 0.
    assert_eq!((terms(1), d.couplings[1].constant), (vec![("out", -1.0), ("in", 3.0)], 0.0));
}

#[test]
fn shapes_are_read() {
    let text = r#"<sdf version="1.9"><model name="m"><static>true</static><link name="a">@
<visual name="v"><pose>1 0 0 0 0 0</pose><geometry><box><size>1 2 3</size></box></geometry><material><diffuse>1 0 0</diffuse></material></visual>
<visual name="e"><geometry><ellipsoid><radii>1 2 3</radii></ellipsoid></geometry></visual>
<collision name="c"><geometry><cylinder><radius>0.1</radius><length>2</length></cylinder></geometry></collision>
<collision name="p"><geometry><plane><normal>1 0 0</normal><size>4 5</size></plane></geometry></collision>
<collision name="mesh"><geometry><mesh><uri>model://a/b.stl</uri><scale>1 2 3</scale></mesh></geometry></collision>
</link></model></sdf>"#;
    let d = read(text);
    assert_eq!(d.shapes.len(), 5);
    assert_eq!(d.shapes[0].color, Some([1.0, 0.0, 0.0, 1.0]));
    assert_eq!(d.shapes[0].pose, Pose::translation(1.0, 0.0, 0.0));
    assert_eq!(d.shapes[1].geometry, Geometry::Ellipsoid { radii: [1.0, 2.0, 3.0] });
    assert_eq!(d.shapes[2].role, ShapeRole::Collision);
    assert_eq!(d.shapes[3].geometry, Geometry::Plane { size: [4.0, 5.0] });
    assert!((d.shapes[3].pose.transform_vector(&Vec3::z()) - Vec3::x()).amax() < 1e-15);
    assert!(d.ignored[0].path.contains("`model://a/b.stl`"), "{:?}", d.ignored);
}

#[test]
fn urdf_and_sdf_of_one_machine_are_one_mechanism() {
    let urdf = r#"<robot name="m"><link name="a"><inertial><mass value="2"/><inertia ixx="0.2" iyy="0.3" izz="0.4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="b"><inertial><origin xyz="0.1 0 0"/><mass value="2"/><inertia ixx="0.2" iyy="0.3" izz="0.4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><origin xyz="1 2 3" rpy="0.1 0.2 0.3"/><parent link="a"/><child link="b"/><axis xyz="0 0.6 0.8"/>
<limit lower="-1" upper="1" velocity="2" effort="3"/></joint></robot>"#;
    let sdf = r#"<sdf version="1.9"><model name="m"><static>true</static><link name="a">@</link>
<link name="b"><pose relative_to="j"/>$</link>
<joint name="j" type="revolute"><pose relative_to="a">1 2 3 0.1 0.2 0.3</pose><parent>a</parent><child>b</child>
<axis><xyz>0 0.6 0.8</xyz><limit><lower>-1</lower><upper>1</upper><velocity>2</velocity><effort>3</effort></limit></axis></joint></model></sdf>"#;
    let sdf = sdf.replace('$', &INERTIAL.replace("<mass>", "<pose>0.1 0 0 0 0 0</pose><mass>"));
    let (sdf, urdf) = (read(&sdf), read_urdf(urdf, &ReadOptions::default()).unwrap());
    let (one, two) = (sdf.builder.build().unwrap(), urdf.builder.build().unwrap());
    for (a, b) in one.body_ids().map(|i| (one.spec(i), two.spec(i))) {
        same(&a.hinge_in_parent, &b.hinge_in_parent);
        same(&a.hinge_in_body, &b.hinge_in_body);
        assert_eq!((a.name, a.parent, a.hinge, a.mass), (b.name, b.parent, b.hinge, b.mass));
    }
}

#[test]
fn defaults_of_the_format_are_used_and_listed() {
    let d = read("<sdf version=\"1.9\"><model name=\"m\"><link name=\"a\"/></model></sdf>");
    assert_eq!(d.builder.bodies()[0].mass.mass, 1.0);
    assert!(d.ignored[0].what.contains("default of 1 kg"), "{:?}", d.ignored);
}

#[test]
fn all_mistakes_at_once() {
    let text = r#"<sdf version="1.9"><model name="m">
<link name="a"><inertial><mass>-1</mass></inertial></link>
<link name="b"><pose>1 2 3</pose>@<visual><geometry><sphere/></geometry></visual></link>
<joint name="j" type="revolut"><parent>a</parent><child>b</child></joint>
<joint name="k" type="screw"><parent>world</parent><child>a</child><axis><xyz>0 0 0</xyz></axis></joint>
<joint name="n" type="ball"><parent>a</parent></joint>
</model></sdf>"#;
    let error = refused(text).to_string();
    for part in ["link `b`: <pose> is `1 2 3`, not 6 finite numbers", "joint `n` lacks <child>"] {
        assert!(error.contains(part), "not there: {part}\n{error}");
    }
    let text = text
        .replace("<pose>1 2 3</pose>", "")
        .replace("<joint name=\"n\" type=\"ball\"><parent>a</parent></joint>", "");
    let error = refused(&text).to_string();
    for part in [
        ":2:16: link `a`: <inertial>: mass -1 kg is negative",
        "<sphere> lacks <radius>",
        "joint `j` has the unknown type `revolut`\n  help: did you mean `revolute`?",
        "joint `k` lacks <screw_thread_pitch>",
        "is `0 0 0`, not a nonzero vector",
    ] {
        assert!(error.contains(part), "not there: {part}\n{error}");
    }
}

#[test]
fn names_that_lead_nowhere_and_rings_are_refused() {
    let model =
        |inside: &str| format!("<sdf version=\"1.9\"><model name=\"m\">{inside}</model></sdf>");
    let has = |inside: &str, part: &str| {
        let error = refused(&model(inside)).to_string();
        assert!(error.contains(part), "not there: {part}\n{error}");
    };
    has(
        "<link name=\"a\"><pose relative_to=\"bb\"/></link><link name=\"b\"/>",
        "refers to the frame `bb`",
    );
    has("<link name=\"a\"/><link name=\"a\"/>", "link `a` is defined again");
    has("<link name=\"a\"/><frame name=\"a\"/>", "frame `a` is defined again");
    has("<link name=\"__a__\"/>", "not allowed");
    has("<link name=\"world\"/>", "not allowed");
    has("", "lacks <model> with a <link>");
    has(
        "<link name=\"a\"><pose relative_to=\"b\"/></link><link name=\"b\"><pose relative_to=\"a\"/></link>",
        "relative to each other in a circle: m::a -> m::b -> m::a",
    );
    has(
        "<link name=\"a\"/><frame name=\"f\" attached_to=\"g\"><pose relative_to=\"a\"/></frame>\
         <frame name=\"g\" attached_to=\"f\"><pose relative_to=\"a\"/></frame>",
        "attached to each other in a circle",
    );
    has(
        "<link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"ball\"><parent>a</parent><child>b</child></joint>\
         <joint name=\"k\" type=\"ball\"><parent>b</parent><child>a</child></joint>",
        "links form a circle: a -> b -> a",
    );
    has(
        "<link name=\"a\"/><joint name=\"j\" type=\"ball\"><parent>a</parent><child>a</child></joint>",
        "connects `a` and `a`",
    );
    has(
        "<link name=\"a\"/><joint name=\"j\" type=\"ball\"><parent>a</parent><child>c</child></joint>",
        "joint `j`: <child> refers to the frame `c`",
    );
}

#[test]
fn a_model_of_every_kind_of_pose_moves_as_in_drake() {
    use linkwork_dynamics::{Tree, Workspace, kinematics, mass_matrix};
    use linkwork_formats::spatial::Mat3;
    // `data/lab_sdf.json` was computed by Drake's Python package from `data/lab.sdf`.
    let d = read(include_str!("data/lab.sdf"));
    let json: serde_json::Value = serde_json::from_str(include_str!("data/lab_sdf.json")).unwrap();
    let nums = |v: &serde_json::Value| -> Vec<f64> {
        v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let mbs = d.builder.build().unwrap();
    // Every joint has the same number of coordinates and rates.
    let mut order = Vec::new();
    for j in json["joints"].as_array().unwrap() {
        let body = mbs.body(&d.joint(j.as_str().unwrap()).unwrap().body).unwrap();
        order.extend(mbs.get(body).q());
    }
    let (tree, n) = (Tree::new(&mbs), mbs.nv());
    assert_eq!((order.len(), n), (6, 6));
    for state in json["states"].as_array().unwrap() {
        let mut q = vec![0.0; n];
        order.iter().zip(nums(&state["q"])).for_each(|(i, x)| q[*i] = x);
        for (i, name) in json["bodies"].as_array().unwrap().iter().enumerate() {
            let X = at(&mbs, &q, name.as_str().unwrap());
            let R = X.rotation.to_rotation_matrix().into_inner();
            let turn = (R - Mat3::from_row_slice(&nums(&state["R"][i]))).amax();
            let away = (X.position - Vec3::from_vec(nums(&state["p"][i]))).amax();
            assert!(turn < 2e-15 && away < 2e-15, "{name}: {turn:e}, {away:e}");
        }
        let mut ws = Workspace::new(&tree);
        kinematics(&tree, &mut ws, &q, &vec![0.0; n]);
        let mut M = vec![0.0; n * n];
        mass_matrix(&tree, &mut ws, &mut M);
        for (row, i) in state["M"].as_array().unwrap().iter().zip(&order) {
            for (x, j) in nums(row).iter().zip(&order) {
                let e = (M[i * n + j] - x).abs();
                assert!(e < 1e-14, "mass matrix: {e:e}");
            }
        }
    }
}

#[test]
fn damping_friction_and_springs_are_not_negative() {
    for tag in ["damping", "friction", "spring_stiffness"] {
        let text = format!(
            "<sdf version=\"1.9\"><model name=\"m\"><link name=\"a\"/><link name=\"b\"/>\n\
             <joint name=\"j\" type=\"revolute\"><parent>a</parent><child>b</child>\
             <axis><xyz>0 0 1</xyz><dynamics>\n<{tag}>-0.3</{tag}></dynamics></axis></joint>\
             </model></sdf>"
        );
        let error = refused(&text).to_string();
        assert!(error.contains(&format!("<{tag}>")) && error.contains(":3:"), "{error}");
        assert!(error.contains("-0.3") && error.contains("help: write 0 or more"), "{error}");
    }
}
