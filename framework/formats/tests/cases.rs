//! Cases from public reports of users of other simulators, with the values of the reference program: MuJoCo 4.0, Drake 1.51, trimesh 5.2 or a closed
//! form.

use linkwork_formats::multibody::{Builder, Spring, Subhinge, SubhingeKind};
use linkwork_formats::spatial::{Mat3, Quat, Vec3};
use linkwork_formats::{
    Description, Device, DeviceKind, Filter, ReadOptions, ShapeRole, mesh_corners, read_file,
    read_mjcf, read_sdf, read_urdf,
};
use std::path::Path;

fn mjcf(text: &str) -> Description {
    read_mjcf(text, &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(text: &str) -> String {
    read_mjcf(text, &ReadOptions::default()).expect_err("refused").to_string()
}

/// Returns the subhinge of a joint.
fn subhinge(d: &Description, joint: &str) -> Subhinge {
    let j = d.joint(joint).unwrap_or_else(|| panic!("{joint}"));
    let body = d.builder.bodies().iter().find(|b| b.name == j.body).unwrap();
    body.hinge.subhinges[j.subhinge]
}

fn mass(b: &Builder, body: &str) -> (f64, Vec3, Mat3) {
    let m = b.bodies().iter().find(|b| b.name == body).unwrap().mass;
    (m.mass, m.com, m.inertia_com)
}

#[track_caller]
fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance * b.abs().max(1e-300), "{a} is not {b}");
}

const BAR: &str = r#"<worldbody><body name="bar"><joint name="swing" axis="0 1 0"/>
<geom type="box" size="0.05 0.05 0.25" pos="0 0 -0.25"/></body></worldbody>"#;

/// Public reports on readers of other engines (newton PR 3030): sections are merged, and later ones override earlier ones.
#[test]
fn sections_of_the_main_class_merge() {
    let defaults = r#"<default><joint damping="0.3"/><geom density="1000"/></default>
        <default><geom density="500"/><joint armature="0.02"/></default>"#;
    let d = mjcf(&format!("<mujoco>{defaults}{BAR}</mujoco>"));
    let s = subhinge(&d, "swing");
    assert_eq!((s.damping, s.armature), (0.3, 0.02));
    close(mass(&d.builder, "bar").0, 2.5, 1e-15);
    assert!(d.ignored.is_empty(), "{:?}", d.ignored);
}

/// A class is a copy of the class that contains it, made at its position: MuJoCo 4.0 has damping 1, stiffness 0, armature 2 here.
#[test]
fn a_class_does_not_see_sections_that_follow_it() {
    let defaults = r#"<default><default class="x"><joint armature="2"/></default><joint damping="1"/></default>
        <default><joint damping="5" stiffness="3"/></default>"#;
    let body = BAR.replace("name=\"swing\"", "name=\"swing\" class=\"x\"");
    let s = subhinge(&mjcf(&format!("<mujoco>{defaults}{body}</mujoco>")), "swing");
    assert_eq!((s.damping, s.armature, s.spring), (1.0, 2.0, Spring::NONE));
}

/// google-deepmind/mujoco #633. Three sliders along the axes of the world and a ball have the coordinates of a free joint.
#[test]
fn a_free_joint_takes_damping_and_armature_of_its_class() {
    let text = r#"<mujoco><default><joint damping="0.5" armature="0.2"/></default><worldbody>
        <body name="hull" pos="0 0 1" euler="0 0 90"><joint name="root" type="free"/><geom size="1"/></body></worldbody></mujoco>"#;
    let d = mjcf(text);
    let body = &d.builder.bodies()[0];
    let kinds: Vec<SubhingeKind> = body.hinge.subhinges.iter().map(|s| s.kind).collect();
    assert!(matches!(
        kinds[..],
        [
            SubhingeKind::Slider { .. },
            SubhingeKind::Slider { .. },
            SubhingeKind::Slider { .. },
            SubhingeKind::Ball
        ]
    ));
    assert!(body.hinge.subhinges.iter().all(|s| (s.damping, s.armature) == (0.5, 0.2)));
    let half = 0.5_f64.sqrt();
    let q = &d.initial[0].q;
    assert!(
        q.iter().zip([0.0, 0.0, 1.0, 0.0, 0.0, half, half]).all(|(a, b)| (a - b).abs() < 1e-15),
        "{q:?}"
    );
    // A `freejoint` does not have a class.
    let d =
        mjcf(&text.replace(r#"<joint name="root" type="free"/>"#, r#"<freejoint name="root"/>"#));
    assert_eq!(subhinge(&d, "root").kind, SubhingeKind::Free);
    // Invalid attributes of a free joint are listed.
    let d = mjcf(&text.replace("damping=\"0.5\"", "stiffness=\"3\""));
    assert!(
        d.ignored.iter().any(|i| i.what.contains("stiffness=\"3\" of a free joint")),
        "{:?}",
        d.ignored
    );
}

/// MuJoCo 4.0: `jnt_limited` is false for equal numbers, and so is a decreasing range with `autolimits`.
#[test]
fn a_range_from_a_number_to_itself_takes_the_limits_of_the_class_away() {
    let text = |joint: &str| {
        let body = BAR.replace("name=\"swing\"", &format!("name=\"swing\" {joint}"));
        format!("<mujoco><default><joint range=\"-10 20\"/></default>{body}</mujoco>")
    };
    let limits = |joint: &str| subhinge(&mjcf(&text(joint)), "swing").limits;
    assert_eq!(limits("").upper, 20f64.to_radians());
    assert_eq!(limits("range=\"0 0\"").upper, f64::INFINITY);
    assert_eq!(limits("limited=\"false\"").upper, f64::INFINITY);
    assert!(
        refused(&text("range=\"0 0\" limited=\"true\"")).contains("`range` is `0 0`, not a range")
    );
    let no_auto = text("").replace("<mujoco>", "<mujoco><compiler autolimits=\"false\"/>");
    assert!(refused(&no_auto).contains("`range` but no `limited`"), "{}", refused(&no_auto));
    // The range of a ball gives its largest angle.
    assert_eq!(
        subhinge(&mjcf(&text("type=\"ball\" range=\"0 40\"")), "swing").ball.angle,
        40f64.to_radians()
    );
    assert!(refused(&text("type=\"ball\"")).contains("0 and an angle"));
}

/// Moments of inertia about z of a capsule of 1 kg at x = 0.3 m (`mj_fullM` of MuJoCo 4.0).
#[test]
fn an_orientation_replaces_that_of_the_class_in_every_form() {
    let defaults = r#"<default><geom euler="0 90 0"/><default class="v"><geom quat="0.7071068 0 0.7071068 0"/></default></default>"#;
    for (geom, expected) in [
        ("", 0.12284723),
        (r#"euler="0 0 0""#, 0.0901983),
        (r#"class="v" euler="0 45 0""#, 0.10652277),
        (r#"quat="1 0 0 0""#, 0.0901983),
        (r#"axisangle="1 0 0 30""#, 0.09836053),
    ] {
        let d = mjcf(&format!(
            r#"<mujoco>{defaults}<worldbody><body name="p"><joint axis="0 0 1"/>
            <geom type="capsule" size="0.02 0.3" mass="1" pos="0.3 0 0" {geom}/></body></worldbody></mujoco>"#
        ));
        let (m, c, J) = mass(&d.builder, "p");
        close(J[(2, 2)] + m * (c.x * c.x + c.y * c.y), expected, 1e-7);
        // No body uses all of the classes.
        assert!(d.ignored.iter().all(|i| i.path.contains("default")), "{geom}: {:?}", d.ignored);
    }
    let two = r#"<mujoco><worldbody><body quat="1 0 0 0" euler="0 0 0"><geom size="1"/></body></worldbody></mujoco>"#;
    assert!(refused(two).contains("has `quat` and `euler`"));
}

/// `jnt_stiffness` and `dof_damping` of MuJoCo 4.0.
#[test]
fn springs_and_spring_dampers_are_those_of_mujoco() {
    let text = r#"<mujoco><compiler angle="radian"/><worldbody><body><joint name="j" stiffness="3" springref="0.4"/>
        <geom size="1"/></body></worldbody></mujoco>"#;
    assert_eq!(subhinge(&mjcf(text), "j").spring, Spring { stiffness: 3.0, rest: 0.4 });
    let text = r#"<mujoco><worldbody><body><joint name="a" springdamper="0.1 0.5" axis="0 1 0"/><geom size="0.1" pos="1 0 0"/>
        <body pos="2 0 0"><joint name="b" springdamper="1 2" axis="1 1 0" damping="3"/><geom size="0.1" pos="0.5 0.2 0"/></body></body>
        <body><joint name="c" type="ball" springdamper="0.1 0.5"/><geom size="0.1" pos="1 0 0"/></body></worldbody></mujoco>"#;
    let d = mjcf(text);
    for (joint, stiffness, damping) in [
        ("a", 2440.919183497723, 122.04595917488618),
        ("b", 0.010299414438497898, 0.08239531550798318),
        ("c", 19.947250745955117, 0.9973625372977559),
    ] {
        let s = subhinge(&d, joint);
        close(s.spring.stiffness, stiffness, 1e-12);
        close(s.damping, damping, 1e-12);
    }
}

/// Names and positions of `<replicate>` in MuJoCo 4.0.
#[test]
fn replications_are_expanded() {
    let text = |attributes: &str| {
        format!(
            r#"<mujoco><worldbody><replicate {attributes}><body name="b" pos="0 1 0"><joint name="j"/><geom size="0.1"/></body></replicate></worldbody></mujoco>"#
        )
    };
    let d = mjcf(&text(r#"count="3" offset="1 0 0" euler="0 0 30""#));
    let places = [
        ("b0", Vec3::new(0.0, 1.0, 0.0)),
        ("b1", Vec3::new(0.5, 0.75f64.sqrt(), 0.0)),
        ("b2", Vec3::new(1.0, 1.0, 0.0)),
    ];
    for (body, (name, p)) in d.builder.bodies().iter().zip(places) {
        assert_eq!(body.name, name);
        assert!((body.hinge_in_parent.position - p).amax() < 1e-15, "{:?}", body.hinge_in_parent);
    }
    let d = mjcf(&text(r#"count="10" offset="1 0 0" sep="-""#));
    assert_eq!((d.joints[0].name.as_str(), d.joints[9].name.as_str()), ("j-00", "j-09"));
    for (attributes, why) in [
        ("offset=\"1 0 0\"", "lacks `count`"),
        ("count=\"2.5\"", "not a positive integer"),
        ("count=\"1e9\"", "creates more than 1000000 elements"),
    ] {
        assert!(refused(&text(attributes)).contains(why), "{attributes}");
    }
    let nested = r#"<mujoco><worldbody><body name="p"><replicate count="2" sep="-"><replicate count="2"><body name="q"><geom size="1"/></body></replicate></replicate></body></worldbody></mujoco>"#;
    let names: Vec<String> = mjcf(nested).builder.bodies().iter().map(|b| b.name.clone()).collect();
    assert_eq!(names, ["p", "q0-0", "q1-0", "q0-1", "q1-1"]);
}

/// Unsupported bodies are an error, not a smaller machine.
#[test]
fn elements_that_stand_for_bodies_are_refused() {
    for inside in ["<composite type=\"cable\"/>", "<flexcomp type=\"grid\"/>"] {
        let error = refused(&format!(
            "<mujoco><worldbody><body><geom size=\"1\"/>{inside}</body></worldbody></mujoco>"
        ));
        assert!(error.contains("is not supported\n  help: "), "{error}");
    }
    let error = refused(
        "<mujoco><worldbody><body><geom size=\"1\"/></body></worldbody><deformable><flex/></deformable></mujoco>",
    );
    assert!(
        error.contains("<flex> is not supported")
            || error.contains("<deformable> is not supported"),
        "{error}"
    );
}

const TETRA: &str = r#"face="0 2 1 0 1 3 0 3 2 1 2 3" vertex="0 0 0 1 0 0 0 1 0 0 0 1""#;

/// `body_mass`, `body_ipos` and `body_inertia` of MuJoCo 4.0. The L shape is not completely visible from its centroid, so its default ("legacy")
/// mass, 4.161, differs from its exact mass, 4.
#[test]
fn meshes_have_the_mass_that_mujoco_gives_them() {
    let of = |mesh: &str, compiler: &str| {
        let text = format!(
            r#"<mujoco>{compiler}<asset><mesh name="m" {mesh}/></asset><worldbody><body name="b"><joint/><geom type="mesh" mesh="m"/></body></worldbody></mujoco>"#
        );
        mass(&mjcf(&text).builder, "b")
    };
    let (m, c, J) = of(TETRA, "");
    close(m, 1000.0 / 6.0, 1e-14);
    close(c.x, 0.25, 1e-14);
    let mut moments: Vec<f64> = J.symmetric_eigenvalues().iter().copied().collect();
    moments.sort_by(f64::total_cmp);
    close(moments[0], 10.41666667, 1e-9);
    close(moments[2], 16.66666667, 1e-9);
    let (m, c, J) = of(&format!(r#"inertia="shell" {TETRA}"#), "");
    close(m, 2366.02540378, 1e-11);
    close(c.x, 0.26289171, 1e-7);
    close(J.trace(), 394.3375673 + 2.0 * 245.28130608, 1e-9);
    // The mesh is an L of two boxes: 0.2 × 0.1 × 0.1 at the origin and 0.1 × 0.2 × 0.1 on its end.
    let l = r#"vertex="0 0 0 0.2 0 0 0.2 0.1 0 0.1 0.1 0 0.1 0.3 0 0 0.3 0 0 0 0.1 0.2 0 0.1 0.2 0.1 0.1 0.1 0.1 0.1 0.1 0.3 0.1 0 0.3 0.1"
        face="0 2 1 0 3 2 0 5 3 5 4 3 6 7 8 6 8 9 6 9 11 11 9 10 0 1 7 0 7 6 1 2 8 1 8 7 2 3 9 2 9 8 3 4 10 3 10 9 4 5 11 4 11 10 5 0 6 5 6 11""#;
    close(of(&format!(r#"inertia="exact" {l}"#), "").0, 4.0, 1e-12);
    assert!(of(l, "").0 > 4.01, "{}", of(l, "").0);
    // The convex hull of the L fills its inner corner, which adds 1 kg. A mesh without faces is its
    // hull, too.
    close(of(&format!(r#"inertia="convex" {l}"#), "").0, 5.0, 1e-12);
    let alone = r#"vertex="0 0 0 1 0 0 0 1 0 0 0 1 0.1 0.1 0.1 0.5 0.5 0""#;
    close(of(alone, "").0, 1000.0 / 6.0, 1e-12);
    // The compiler sets lower bounds of mass and inertia.
    let (m, _, J) = of(TETRA, r#"<compiler boundmass="200" boundinertia="12"/>"#);
    close(m, 200.0, 1e-15);
    let least = J.symmetric_eigenvalues().min();
    close(least, 12.0, 1e-12);
    // The default type of a geom is `sphere`, even if it has a mesh.
    let fitted = format!(
        r#"<mujoco><asset><mesh name="m" {TETRA}/></asset><worldbody><body name="b"><joint/><geom mesh="m"/></body></worldbody></mujoco>"#
    );
    assert!(
        mjcf(&fitted).ignored.iter().any(|i| i.what.contains("a sphere that is fitted to a mesh"))
    );
    // A body without geoms keeps its inertial.
    let text = r#"<mujoco><compiler inertiafromgeom="true"/><worldbody><body name="b"><joint/><inertial mass="3" pos="0 0 0" diaginertia="1 1 1"/></body></worldbody></mujoco>"#;
    assert_eq!(mass(&mjcf(text).builder, "b").0, 3.0);
    // Masses that cannot be computed are listed.
    let text = r#"<mujoco><asset><mesh name="m" file="none.stl"/></asset><worldbody><body><joint/><geom type="mesh" mesh="m" mass="1"/></body></worldbody></mujoco>"#;
    let why: Vec<String> = mjcf(text).ignored.iter().map(|i| i.what.clone()).collect();
    assert!(
        why.iter().any(|w| w.contains(
            "this geom adds no mass: its mesh cannot be used: there is no file `none.stl`"
        )),
        "{why:?}"
    );
}

/// `body_mass` and `body_inertia` of MuJoCo 4.0 for thin shells of density 1000 kg/m².
#[test]
fn shells_of_primitives_have_the_mass_that_mujoco_gives_them() {
    for (geom, m, moments) in [
        (
            r#"type="sphere" size="0.3""#,
            1130.9733552923256,
            [67.85840131753953, 67.85840131753953, 67.85840131753953],
        ),
        (
            r#"type="box" size="0.1 0.2 0.3""#,
            880.0,
            [54.13333333333334, 42.13333333333334, 24.266666666666673],
        ),
        (
            r#"type="cylinder" size="0.1 0.2""#,
            314.1592653589793,
            [7.278022980816355, 7.278022980816355, 2.827433388230814],
        ),
        (
            r#"type="ellipsoid" size="0.1907 0.1228 0.2608""#,
            453.3978903193308,
            [11.574889193987474, 14.220214431989007, 7.966637757839635],
        ),
        (
            r#"type="capsule" size="0.1 0.2""#,
            376.9911184307752,
            [12.985249634837814, 12.985249634837814, 3.351032163829113],
        ),
    ] {
        let d = mjcf(&format!(
            r#"<mujoco><worldbody><body name="b"><joint/><geom shellinertia="true" {geom}/></body></worldbody></mujoco>"#
        ));
        let own = mass(&d.builder, "b");
        close(own.0, m, 1e-14);
        for (k, x) in moments.into_iter().enumerate() {
            // MuJoCo computes the difference of two ellipsoids, which loses digits.
            close(own.2[(k, k)], x, if geom.contains("ellipsoid") { 1e-5 } else { 1e-13 });
        }
    }
}

/// Genesis #3267, newton PR 3104: bit masks, exclusions and pairs.
#[test]
fn collision_masks_are_masks() {
    let text = r#"<mujoco><default><geom contype="1" conaffinity="0"/></default><worldbody>
        <geom name="floor" type="plane" size="5 5 0.1" contype="0" conaffinity="1"/>
        <body name="a"><freejoint/><geom name="ga" size="0.1"/></body><body name="b"><freejoint/><geom name="gb" size="0.1"/></body>
        <body name="c"><freejoint/><geom name="gc" size="0.1" conaffinity="1"/></body>
        <body name="d"><freejoint/><geom name="gd" size="0.1" contype="4" conaffinity="8"/></body></worldbody>
        <contact><exclude body1="c" body2="d"/><pair geom1="gd" geom2="ga"/></contact></mujoco>"#;
    let d = mjcf(text);
    let classes = d.collision_classes();
    let at = |name: &str| {
        d.shapes.iter().position(|s| s.name == name && s.role == ShapeRole::Collision).unwrap()
    };
    let meet = |a: &str, b: &str| classes.meets[classes.of[at(a)]].contains(&classes.of[at(b)]);
    let pairs = [
        ("floor", "ga", true),
        ("ga", "gb", false),
        ("ga", "gc", true),
        ("gc", "floor", true),
        ("gd", "ga", true),
        ("gd", "gb", false),
        ("gd", "gc", false),
    ];
    for (a, b, expected) in pairs {
        assert_eq!((meet(a, b), meet(b, a)), (expected, expected), "{a} {b}");
    }
    assert_eq!(d.exclusions, [["c".to_owned(), "d".to_owned()]]);
    assert_eq!(d.shapes[at("gd")].filter, Filter { category: 4, meets: 8 });
    assert!(
        refused(&text.replace("contype=\"4\"", "contype=\"0.5\"")).contains("a mask of 32 bits")
    );
    assert!(
        refused(&text.replace("body2=\"d\"", "body2=\"e\"")).contains("refers to the body `e`")
    );
}

#[test]
fn friction_of_surfaces_is_read() {
    let text = r#"<mujoco><worldbody><geom type="plane" size="1 1 1" friction="0.05"/><body><freejoint/><geom size="1" condim="6" friction="0.3 0.02 0.01"/></body>
        <body><freejoint/><geom size="1"/></body></worldbody></mujoco>"#;
    let d = mjcf(text);
    let surfaces: Vec<_> =
        d.shapes.iter().filter(|s| s.role == ShapeRole::Collision).map(|s| s.surface).collect();
    assert_eq!(
        surfaces.iter().map(|s| s.friction).collect::<Vec<_>>(),
        [Some(0.05), Some(0.3), Some(1.0)]
    );
    assert_eq!(
        (surfaces[1].spinning, surfaces[1].rolling, surfaces[0].rolling),
        (Some(0.02), Some(0.01), None)
    );
    assert!(d.ignored.iter().any(|i| i.what.contains("geometric mean")), "{:?}", d.ignored);
}

#[test]
fn a_keyframe_may_be_the_start() {
    let text = r#"<mujoco><worldbody><body name="a"><joint name="p"/><joint name="q" type="slide"/><geom size="1"/>
        <body name="b"><joint type="ball"/><geom size="1"/></body></body></worldbody>
        <keyframe><key name="home" qpos="0.1 0.2 0 0 0 2"/></keyframe></mujoco>"#;
    let read = |key: &str, text: &str| {
        read_mjcf(text, &ReadOptions { keyframe: Some(key.into()), ..ReadOptions::default() })
    };
    let d = read("home", text).unwrap_or_else(|e| panic!("{e}"));
    let q = |body: &str| d.initial.iter().find(|i| i.body == body).unwrap().q.clone();
    assert_eq!((q("a"), q("b")), (vec![0.1, 0.2], vec![0.0, 0.0, 1.0, 0.0]));
    assert!(
        mjcf(text).ignored[0]
            .what
            .contains("keyframes home: the start is the reference configuration")
    );
    assert!(read("hom", text).expect_err("name").to_string().contains("did you mean `home`?"));
    let short = text.replace("0.1 0.2 0 0 0 2", "0.1 0.2");
    assert!(read("home", &short).expect_err("length").to_string().contains("not 6 finite numbers"));
}

const INERTIAL: &str = "<inertial><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.02</iyy><izz>0.02</izz></inertia></inertial>";

fn sdf(text: &str) -> Description {
    read_sdf(&text.replace('@', INERTIAL), &ReadOptions::default())
        .unwrap_or_else(|e| panic!("{e}"))
}

/// gazebosim/sdformat #219: before 1.5, axes are in the frame of the model, and 1.10 is later than 1.9.
#[test]
fn versions_are_compared_as_versions() {
    for (version, axis) in [
        ("1.4", Vec3::x()),
        ("1.5", -Vec3::z()),
        ("1.9", -Vec3::z()),
        ("1.10", -Vec3::z()),
        ("1.11", -Vec3::z()),
        ("1.12", -Vec3::z()),
    ] {
        let d = sdf(&format!(
            r#"<sdf version="{version}"><model name="m"><link name="a">@</link><link name="b"><pose>0 0 0 0 1.5707963267948966 0</pose>@</link>
            <joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz></axis></joint></model></sdf>"#
        ));
        let b = d.builder.bodies().iter().find(|b| b.name == "b").unwrap();
        let own = b.hinge.subhinges[0].kind.axis().unwrap();
        let shown = b.hinge_in_parent.rotation * own;
        assert!((shown - axis).amax() < 1e-15, "{version}: {shown:?}");
    }
    let odd = sdf(r#"<sdf version="1.13"><model name="m"><link name="a">@</link></model></sdf>"#);
    assert!(odd.ignored[0].what.contains("version 1.13: versions 1.0 to 1.12 are supported"));
    let wrong = read_sdf(
        r#"<sdf version="new"><model name="m"><link name="a"/></model></sdf>"#,
        &ReadOptions::default(),
    );
    assert!(wrong.expect_err("version").to_string().contains("`version` is `new`"));
}

fn included(main: &str) -> Result<Description, String> {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text.replace('@', INERTIAL)).unwrap();
    };
    write(
        "pair/model.config",
        r#"<model><sdf version="1.4">old.sdf</sdf><sdf version="1.10">model.sdf</sdf></model>"#,
    );
    write(
        "pair/model.sdf",
        r#"<sdf version="1.9"><model name="pair"><link name="a">@</link><link name="b"><pose>0.3 0 0 0 0 0</pose>@</link>
        <frame name="f"><pose>0 0 2 0 0 0.5</pose></frame>
        <joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz expressed_in="__model__">0 1 0</xyz></axis></joint></model></sdf>"#,
    );
    write(
        "nest/model.sdf",
        r#"<sdf version="1.12"><model name="nest"><model name="in"><link name="x">@</link></model><model name="in2"><pose>0 2 0 0 0 0</pose><link name="x">@</link></model>
        <frame name="f" attached_to="in"/><joint name="j" type="fixed"><parent>in::x</parent><child>in2::x</child></joint></model></sdf>"#,
    );
    write(
        "ring/model.sdf",
        r#"<sdf version="1.9"><model name="ring"><link name="a">@</link><include><uri>model://ring</uri></include></model></sdf>"#,
    );
    write("main.sdf", main);
    let options = ReadOptions { package_paths: vec![dir.path().into()], ..ReadOptions::default() };
    read_file(dir.path().join("main.sdf"), &options).map_err(|e| e.to_string())
}

/// gazebosim/gz-sim #479: includes in worlds, with name and pose.
#[test]
fn included_models_are_read() {
    let d = included(r#"<sdf version="1.9"><world name="w">
        <include><uri>model://pair</uri><name>one</name><pose>0 0 0.5 0 0 0</pose></include>
        <include><uri>pair/model.sdf</uri><name>two</name><static>true</static></include></world></sdf>"#).unwrap();
    let mbs = d.builder.build().unwrap();
    assert_eq!(mbs.nv(), 6 + 1 + 1);
    let q = d.configuration(&mbs);
    let at = |body: &str| mbs.body_poses(&q)[mbs.body(body).unwrap().index()];
    assert_eq!(at("one::b").position, Vec3::new(0.3, 0.0, 0.5));
    assert_eq!(at("two::a").position, Vec3::zeros());
    let error = included(
        r#"<sdf version="1.9"><model name="m"><include><uri>model://ring</uri></include></model></sdf>"#,
    );
    assert!(error.unwrap_err().contains("include each other in a circle"));
    let error = included(
        r#"<sdf version="1.9"><world name="w"><include><uri>model://none</uri></include></world></sdf>"#,
    );
    assert!(error.unwrap_err().contains("the include of `model://none` was not found"));
}

/// The pose of an include is that of its placement frame; the name of a merged model disappears. Values: poses computed by hand.
#[test]
fn placement_frames_and_merged_models_are_where_the_file_says() {
    let d = included(r#"<sdf version="1.11"><model name="m"><static>true</static><link name="base">@</link>
        <include><uri>model://pair</uri><name>n</name><pose>5 0 0 0 0 0</pose><placement_frame>f</placement_frame></include></model></sdf>"#).unwrap();
    let mbs = d.builder.build().unwrap();
    let at = |body: &str| mbs.body_poses(&mbs.neutral_q())[mbs.body(body).unwrap().index()];
    let turn = Quat::from_euler_angles(0.0, 0.0, -0.5);
    assert!((at("n::a").position - Vec3::new(5.0, 0.0, -2.0)).amax() < 1e-15);
    assert!(at("n::a").rotation.angle_to(&turn) < 1e-7);
    let d = included(r#"<sdf version="1.11"><model name="m"><static>true</static><link name="base">@</link>
        <include merge="true"><uri>model://pair</uri><pose>0 0 1 1.5707963267948966 0 0</pose></include>
        <joint name="k" type="fixed"><parent>base</parent><child>a</child></joint></model></sdf>"#).unwrap();
    let mbs = d.builder.build().unwrap();
    let at = |body: &str| mbs.body_poses(&mbs.neutral_q())[mbs.body(body).unwrap().index()];
    assert!((at("b").position - Vec3::new(0.3, 0.0, 1.0)).amax() < 1e-15);
    // The y axis of the merged model is the z axis of the containing model.
    let b = d.builder.bodies().iter().find(|b| b.name == "b").unwrap();
    let axis =
        at("b").rotation * b.hinge_in_body.rotation * b.hinge.subhinges[0].kind.axis().unwrap();
    assert!((axis - Vec3::z()).amax() < 1e-15, "{axis:?}");
    assert!(d.builder.nodes().iter().all(|n| !n.name.contains("_merged__")));
}

/// The contents of a merged model are contents of the world: bodies and positions of Drake 1.51. A model with links cannot be merged into a world.
#[test]
fn models_are_merged_into_worlds() {
    let world = |model: &str| {
        included(&format!(
            r#"<sdf version="1.12"><world name="w"><include merge="true"><uri>model://{model}</uri><pose>0 0 1 1.5707963267948966 0 0</pose></include></world></sdf>"#
        ))
        .unwrap()
    };
    let d = world("nest");
    let mbs = d.builder.build().unwrap();
    let q = d.configuration(&mbs);
    let at = |body: &str| mbs.body_poses(&q)[mbs.body(body).unwrap().index()].position;
    assert!((at("in::x") - Vec3::new(0.0, 0.0, 1.0)).amax() < 1e-15);
    assert!((at("in2::x") - Vec3::new(0.0, 0.0, 3.0)).amax() < 1e-15);
    assert!(d.ignored.is_empty(), "{:?}", d.ignored);
    let d = world("pair");
    assert!(d.ignored.iter().any(|i| i.what.contains("a world has no links")), "{:?}", d.ignored);
    // The names of the only model of a world have no prefix.
    assert!(d.builder.bodies().iter().any(|b| b.name == "a"));
}

/// Drake 1.51: 3000 kg for a box of 1 × 2 × 3 m with 500 kg/m³, and 1466.08 kg for a cylinder and a sphere with 200.
#[test]
fn automatic_inertia_is_that_of_the_collisions() {
    let link = |inside: &str| {
        let d = sdf(&format!(
            r#"<sdf version="1.11"><model name="m"><static>true</static><link name="a">{inside}</link></model></sdf>"#
        ));
        mass(&d.builder, "a")
    };
    let (m, _, J) = link(
        r#"<inertial auto="true"/><collision name="c"><density>500</density><geometry><box><size>1 2 3</size></box></geometry></collision>"#,
    );
    assert_eq!((m, J[(0, 0)], J[(1, 1)], J[(2, 2)]), (3000.0, 3250.0, 2500.0, 1250.0));
    let two = r#"<inertial auto="true"><density>200</density></inertial><collision name="c"><pose>1 0 0 0 0 0</pose><geometry><cylinder><radius>1</radius><length>1</length></cylinder></geometry></collision>
        <collision name="d"><geometry><sphere><radius>1</radius></sphere></geometry></collision>"#;
    let (m, c, _) = link(two);
    close(m, 1466.0765716752367, 1e-14);
    close(c.x, 0.42857142857142855, 1e-7);
    let (m, ..) = link(&two.replace("<density>200</density>", "<mass>7</mass>"));
    close(m, 7.0, 1e-15);
}

#[test]
fn springs_and_surfaces_of_sdf_are_read() {
    let d = sdf(
        r#"<sdf version="1.9"><model name="m"><link name="a">@</link><link name="b">@<gravity>false</gravity>
        <collision name="c"><geometry><sphere><radius>1</radius></sphere></geometry><surface><friction><ode><mu>0.2</mu><mu2>0.3</mu2></ode></friction>
        <bounce><restitution_coefficient>0.4</restitution_coefficient></bounce><contact><collide_bitmask>0x02</collide_bitmask></contact></surface></collision></link>
        <joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz><dynamics><spring_stiffness>3</spring_stiffness>
        <spring_reference>0.5</spring_reference></dynamics></axis></joint></model></sdf>"#,
    );
    assert_eq!(subhinge(&d, "j").spring, Spring { stiffness: 3.0, rest: 0.5 });
    let s = &d.shapes[0];
    assert_eq!((s.surface.friction, s.surface.restitution), (Some(0.2), Some(0.4)));
    assert_eq!(s.filter, Filter { category: 2, meets: 2 });
    let listed: Vec<&str> = d.ignored.iter().map(|i| i.what.as_str()).collect();
    assert!(listed.iter().any(|l| l.contains("<mu2> 0.3")), "{listed:?}");
    let weightless = DeviceKind::GravityCompensation { body: "b".into(), share: 1.0 };
    assert_eq!(d.devices, [Device { name: "b_weightless".into(), kind: weightless }]);
}

#[test]
fn blocks_of_gazebo_and_limits_without_bounds_of_a_urdf() {
    let text = r#"<robot name="r"><link name="a"/><link name="b"><collision><geometry><sphere radius="1"/></geometry></collision></link>
        <joint name="j" type="revolute"><parent link="a"/><child link="b"/><limit effort="1" velocity="1"/></joint>
        <gazebo reference="b"><mu1>0.3</mu1><mu2>0.3</mu2><kp>5</kp></gazebo>
        <gazebo reference="j"><springStiffness>2</springStiffness><springReference>0.1</springReference></gazebo></robot>"#;
    let d = read_urdf(text, &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(d.shapes[0].surface.friction, Some(0.3));
    assert_eq!(subhinge(&d, "j").spring, Spring { stiffness: 2.0, rest: 0.1 });
    let listed: Vec<&str> = d.ignored.iter().map(|i| i.what.as_str()).collect();
    for part in ["element <kp>", "according to the format, the joint cannot move"] {
        assert!(listed.iter().any(|l| l.contains(part)), "{part}: {listed:?}");
    }
}

/// The same box (1 × 2 × 3 about 1, 2, 3) in every format, written by trimesh 5.2. In a glTF file y is up: (x, y, z) of the file is (x, −z, y) of a
/// robot.
#[test]
fn meshes_of_every_kind_have_the_corners_of_the_box() {
    let dir = tempfile::tempdir().unwrap();
    let (low, high) = (Vec3::new(0.5, 1.0, 1.5), Vec3::new(1.5, 3.0, 4.5));
    let corner = |k: usize| {
        Vec3::new([low.x, high.x][k & 1], [low.y, high.y][k >> 1 & 1], [low.z, high.z][k >> 2])
    };
    let faces: [[usize; 3]; 12] = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    let list = |scale: f64| {
        (0..8)
            .map(|k| {
                let p = corner(k) * scale;
                format!("{} {} {}", p.x, p.y, p.z)
            })
            .collect::<Vec<_>>()
            .join(" ")
    };
    let obj = (0..8)
        .map(|k| {
            let p = corner(k);
            format!("v {} {} {}\n", p.x, p.y, p.z)
        })
        .collect::<String>()
        + &faces.map(|f| format!("f {}//1 {} {}\n", f[0] + 1, f[1] + 1, f[2] as i64 - 8)).concat();
    let indices = faces.iter().flatten().map(usize::to_string).collect::<Vec<_>>().join(" ");
    let dae = format!(
        r##"<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset><unit meter="0.01"/><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id="g"><mesh><source id="p"><float_array id="pa" count="24">{}</float_array><technique_common><accessor source="#pa" count="8" stride="3"/></technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>{indices}</p></triangles></mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node><translate>-100 0 0</translate><node><translate>100 0 0</translate><instance_geometry url="#g"/></node></node></visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"##,
        list(100.0)
    );
    let mut data: Vec<u8> = (0..8)
        .flat_map(|k| {
            let p = corner(k);
            [p.x, p.z, -p.y]
        })
        .flat_map(|x| (x as f32).to_le_bytes())
        .collect();
    data.extend(faces.iter().flatten().flat_map(|k| (*k as u16).to_le_bytes()));
    let json = |buffer: &str| {
        format!(r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0,"scale":[2,2,2],"children":[]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3"}},{{"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"}}],"bufferViews":[{{"buffer":0,"byteLength":96}},{{"buffer":0,"byteOffset":96,"byteLength":72}}],"buffers":[{{{buffer}"byteLength":168}}]}}"#).replace("\"scale\":[2,2,2],", "\"scale\":[1,1,1],")
    };
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    let mut text = json("").into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    glb.extend((12 + 8 + text.len() as u32 + 8 + data.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &data)] {
        glb.extend((chunk.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(chunk);
    }
    let files: [(&str, Vec<u8>); 5] = [
        ("box.obj", obj.into_bytes()),
        ("box.dae", dae.into_bytes()),
        ("box.gltf", json(r#""uri":"box.bin","#).into_bytes()),
        ("box.bin", data),
        ("box.glb", glb),
    ];
    for (name, bytes) in &files {
        std::fs::write(dir.path().join(name), bytes).unwrap();
    }
    let wanted: Vec<Vec3> = faces.iter().flatten().map(|k| corner(*k)).collect();
    for name in ["box.obj", "box.dae", "box.gltf", "box.glb"] {
        let corners =
            mesh_corners(&dir.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(corners.len(), wanted.len(), "{name}");
        let worst = corners
            .iter()
            .zip(&wanted)
            .map(|(a, b)| (a - b).amax())
            .fold(0.0, |m: f64, x| if x <= m { m } else { x });
        assert!(worst < 1e-14, "{name}: {worst}");
    }
    // Truncated files give messages, not a panic.
    for (name, bytes) in &files {
        for length in (0..bytes.len()).step_by(7) {
            let path = dir.path().join(format!("cut_{name}"));
            std::fs::write(&path, &bytes[..length]).unwrap();
            drop(mesh_corners(&path));
        }
    }
    for (name, text, why) in [
        ("a.ply", "ply", "`.ply` files are not supported"),
        ("a.obj", "v 1 2", "line 1: a vertex must have three numbers"),
        (
            "b.obj",
            "v 1 2 3\nf 1 2 3",
            "line 2: a face must refer to at least three existing vertices",
        ),
        ("a.dae", "<x/>", "not <COLLADA>"),
        ("a.gltf", "{}", "glTF version is none"),
        ("a.msh", "no counts at all", "do not match its length"),
    ] {
        let path = dir.path().join(name);
        std::fs::write(&path, text).unwrap();
        assert!(mesh_corners(&path).is_err_and(|e| e.contains(why)), "{name}");
    }
    assert!(mesh_corners(Path::new("none.obj")).is_err());
}
