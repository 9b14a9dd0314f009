//! Actuators, tendons and sensors of MJCF files, compared with MuJoCo 4.0 (`actuator_gainprm`, `actuator_biasprm`, `tendon_lengthspring` of the
//! compiled model). The public reports are listed in `tests/hunt/files.md`.
use linkwork_formats::{
    Actuator, Description, DeviceFrame, DeviceKind, Length, ReadOptions, Sensor, Tendon, read_mjcf,
};

fn read(text: &str) -> Description {
    read_mjcf(text, &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn actuator(d: &Description, name: &str) -> Actuator {
    match &d.devices.iter().find(|x| x.name == name).unwrap().kind {
        DeviceKind::Actuator(a) => a.clone(),
        other => panic!("{other:?}"),
    }
}

fn tendon(d: &Description, name: &str) -> Tendon {
    match &d.devices.iter().find(|x| x.name == name).unwrap().kind {
        DeviceKind::Tendon(t) => t.clone(),
        other => panic!("{other:?}"),
    }
}

/// All kinds share one set of defaults, and a class without a gain keeps that of the class that contains it. newton PR 1786, PR 1727, #107;
/// UnrealRoboticsLab PR 75; Genesis #619, PR 940; newton #3127.
const ARM: &str = r#"<mujoco><default><general gainprm="7"/><position kp="3" ctrlrange="-1 1"/><default class="m"><motor gear="4" forcerange="-2 2"/></default><default class="big"><position kp="2000" kv="50"/></default></default>
<worldbody><body><joint name="a" range="-30 90" ref="10" springref="20"/><geom size="0.1"/><body name="welded" pos="0 0 1"><geom size="0.1"/><body pos="0.3 0 0"><joint name="b" axis="0 1 0" ref="5"/><geom size="0.1"/><body pos="0.3 0 0"><joint name="c" type="slide" axis="1 0 0" springref="0.2"/><geom size="0.1"/></body></body></body></body></worldbody>
<tendon><fixed name="three" stiffness="2"><joint joint="a" coef="1"/><joint joint="b" coef="-2"/><joint joint="c" coef="3"/></fixed></tendon>
<actuator><motor name="m" joint="a"/><position name="p" joint="a" kv="2"/><position name="p2" joint="a" class="m"/><velocity name="v" joint="a"/><velocity name="v2" joint="a" kv="3"/><general name="g" joint="a"/><general name="g2" joint="a" biastype="affine" biasprm="1 2 3"/><damper name="d" joint="a" kv="3" ctrlrange="0 1"/><position name="ratio" joint="b" dampratio="0.7" kp="4"/><position name="wide" joint="a" inheritrange="0.5"/><position name="big" joint="a" class="big"/><motor name="long" tendon="three" gear="-2"/></actuator></mujoco>"#;

#[test]
fn gains_come_from_classes_as_in_mujoco() {
    let d = read(ARM);
    let none = [0.0; 3];
    let one = [-1.0, 1.0];
    for (name, gain, bias, control, force, gear) in [
        ("m", [1.0, 0.0, 0.0], none, Some(one), None, 1.0),
        ("p", [3.0, 0.0, 0.0], [0.0, -3.0, -2.0], Some(one), None, 1.0),
        ("p2", [3.0, 0.0, 0.0], [0.0, -3.0, 0.0], Some(one), Some([-2.0, 2.0]), 4.0),
        ("v", [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], Some(one), None, 1.0),
        ("v2", [3.0, 0.0, 0.0], [0.0, 0.0, -3.0], Some(one), None, 1.0),
        ("g", [3.0, 0.0, 0.0], [0.0, -3.0, 0.0], Some(one), None, 1.0),
        ("g2", [3.0, 0.0, 0.0], [1.0, 2.0, 3.0], Some(one), None, 1.0),
        ("d", [0.0, 0.0, -3.0], none, Some([0.0, 1.0]), None, 1.0),
        ("big", [2000.0, 0.0, 0.0], [0.0, -2000.0, -50.0], Some(one), None, 1.0),
        ("long", [1.0, 0.0, 0.0], none, Some(one), None, -2.0),
    ] {
        let a = actuator(&d, name);
        assert_eq!((a.gain, a.bias, a.control, a.force), (gain, bias, control, force), "{name}");
        let Length::Joints(terms) = &a.length else { panic!("{name}") };
        assert_eq!(terms[0].factor, gear, "{name}");
    }
}

/// MuJoCo 4.0 uses the gain of a class for the same kind and from `general`, but not that of another kind.
#[test]
fn the_law_of_one_kind_is_not_a_default_for_another() {
    for (class, kind, gain, bias) in [
        (r#"position kp="3" kv="4""#, "velocity", [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]),
        (
            r#"general gainprm="7" biastype="affine" biasprm="0 0 -5""#,
            "velocity",
            [7.0, 0.0, 0.0],
            [0.0, 0.0, -7.0],
        ),
        (r#"velocity kv="5""#, "velocity", [5.0, 0.0, 0.0], [0.0, 0.0, -5.0]),
        (r#"velocity kv="5""#, "position", [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]),
        (r#"velocity kv="5""#, "motor", [1.0, 0.0, 0.0], [0.0; 3]),
        (r#"general gaintype="affine" gainprm="1 2 -3""#, "damper", [0.0, 0.0, -3.0], [0.0; 3]),
        (r#"general gainprm="1 2 -3""#, "damper", [0.0, 0.0, -0.0], [0.0; 3]),
        (r#"position kp="3""#, "general", [3.0, 0.0, 0.0], [0.0, -3.0, 0.0]),
        (r#"position kp="3"/><motor gear="4""#, "position", [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]),
        (r#"position kp="3"/><general gear="5""#, "velocity", [3.0, 0.0, 0.0], [0.0, 0.0, -3.0]),
    ] {
        let d = read(&format!(
            r#"<mujoco><default><{class}/></default><worldbody><body><joint name="a"/><geom size="0.1"/></body></worldbody>
            <actuator><{kind} name="x" joint="a" ctrlrange="0 1"/></actuator></mujoco>"#
        ));
        let a = actuator(&d, "x");
        assert_eq!((a.gain, a.bias), (gain, bias), "{class} {kind}");
    }
}

#[test]
fn damping_ratios_and_inherited_ranges_are_those_of_mujoco() {
    let d = read(ARM);
    let ratio = actuator(&d, "ratio");
    assert!((ratio.bias[2] + 1.793_970_816_412_986_8).abs() < 1e-12, "{}", ratio.bias[2]);
    let [lower, upper] = actuator(&d, "wide").control.unwrap();
    assert!(
        (lower - 0.0).abs() < 1e-15 && (upper - std::f64::consts::FRAC_PI_3).abs() < 1e-15,
        "{lower} {upper}"
    );
    let t = tendon(&d, "three");
    assert!(
        (t.rest[0] - 0.949_065_850_398_866).abs() < 1e-15 && t.rest[0] == t.rest[1],
        "{:?}",
        t.rest
    );
    let Length::Joints(terms) = &t.length else { panic!("{t:?}") };
    let factors: Vec<f64> = terms.iter().map(|t| t.factor).collect();
    assert_eq!(factors, [1.0, -2.0, 3.0]);
}

/// newton #3747: unsupported actuators and sensors are named, and devices that depend on them are listed.
#[test]
fn devices_that_are_not_read_are_named() {
    let text = r#"<mujoco><worldbody><site name="fixed"/><body name="a"><joint name="p"/><geom size="1"/><site name="s"/></body>
        <body name="b"><joint name="ball" type="ball"/><geom size="1"/></body></worldbody>
        <tendon><spatial name="line"><site site="s"/><pulley divisor="2"/><site site="fixed"/></spatial></tendon>
        <actuator><intvelocity name="i" joint="p"/><motor name="pull" tendon="line"/><motor name="turn" joint="ball" gear="1 0 0"/><motor name="jet" site="s"/>
        <general name="slow" joint="p" dyntype="filter"/><position name="lag" joint="p" timeconst="0.1"/></actuator>
        <sensor><actuatorfrc name="f" actuator="pull"/><touch name="t" site="s"/><gyro name="g" site="s"/><gyro name="h" site="fixed"/><framepos objtype="body" objname="a"/></sensor></mujoco>"#;
    let d = read(text);
    let listed: Vec<String> = d.ignored.iter().map(ToString::to_string).collect();
    for part in [
        "intvelocity",
        "a spatial tendon with a <pulley>",
        "its tendon `line` is not supported",
        "it acts on a ball or free joint",
        "an actuator on a site",
        "`dyntype`",
        "`timeconst`",
        "a sensor of the actuator `pull`, which is not supported",
        "touch",
        "site of the world, which does not move",
        "neither a site nor an xbody",
    ] {
        assert!(listed.iter().any(|l| l.contains(part)), "{part}: {listed:#?}");
    }
    let kinds: Vec<&DeviceKind> = d.devices.iter().map(|x| &x.kind).collect();
    let gyro = DeviceKind::Sensor(Sensor::Motion(DeviceFrame::Node("s".into())));
    assert_eq!(kinds, [&gyro]);
}

#[test]
fn devices_that_lead_nowhere_are_refused() {
    let text = r#"<mujoco><worldbody><body><joint name="p"/><geom size="1"/></body></worldbody>
        <tendon><fixed name="t" springlength="2 1"><joint joint="q" coef="1"/></fixed><fixed name="e"/></tendon>
        <actuator><motor joint="q"/><motor/><motor tendon="u"/><motor joint="p" ctrllimited="true"/></actuator>
        <sensor><jointpos joint="q"/><gyro site="s"/></sensor></mujoco>"#;
    let error = read_mjcf(text, &ReadOptions::default()).unwrap_err().to_string();
    for part in [
        "tendon `t` refers to the hinge or slide joint `q`",
        "`springlength` is `2 1`",
        "tendon `e` lacks <joint>",
        "actuator `motor1` refers to the hinge or slide joint `q`",
        "actuator `motor2` lacks `joint` or `tendon`",
        "refers to the tendon `u`",
        "`ctrlrange` is `0 0`, not a range",
        "sensor `jointpos1` refers to the hinge or slide joint `q`",
        "refers to the site `s`",
    ] {
        assert!(error.contains(part), "{part}\n{error}");
    }
}
