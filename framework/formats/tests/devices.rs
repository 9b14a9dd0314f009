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

/// MuJoCo 4.0 reads a positive b₂ as a damping ratio also if the gain is affine, and two equal bounds as no bounds. A length that no joint changes has no
/// damping ratio. Found by random files (`tests/differential`).
#[test]
fn damping_ratios_and_equal_bounds_are_read_as_in_mujoco() {
    let body = r#"<worldbody><body><joint name="j"/><geom size="0.2"/><site name="a" pos="0.3 0 0"/><site name="b" pos="0 0.3 0"/></body></worldbody>
<tendon><spatial name="stiff"><site site="a"/><site site="b"/></spatial></tendon>"#;
    let of = |text: &str| read(&format!("<mujoco>{body}<actuator>{text}</actuator></mujoco>"));
    for kind in ["fixed", "affine"] {
        let d = of(&format!(
            r#"<general name="x" joint="j" gaintype="{kind}" gainprm="2" biastype="affine" biasprm="0 -2 0.5" ctrlrange="1 1"/>"#
        ));
        let a = actuator(&d, "x");
        // Number of MuJoCo: sphere of 0.2 m and 1000 kg/m3.
        assert!((a.bias[2] + 1.03553382).abs() < 1e-8, "{kind}: {:?}", a.bias);
        assert_eq!(a.control, None, "{kind}");
    }
    let d = of(r#"<position name="x" tendon="stiff" dampratio="1"/>"#);
    assert_eq!(actuator(&d, "x").bias[2], 0.0);
    assert!(
        d.ignored.iter().any(|i| i.to_string().contains("no joint changes the length")),
        "{:?}",
        d.ignored
    );
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
        <tendon><spatial name="line" stiffness="5" range="0 1"><site site="s"/><pulley divisor="2"/><site site="fixed"/></spatial></tendon>
        <actuator><muscle name="i" joint="p"/><motor name="pull" tendon="line"/><motor name="turn" joint="ball" gear="1 0 0"/><general name="jet" body="a"/>
        <general name="slow" joint="p" dyntype="muscle"/></actuator>
        <sensor><actuatorfrc name="f" actuator="pull"/><touch name="t" site="fixed"/><gyro name="g" site="s"/><gyro name="h" site="fixed"/><framequat objtype="body" objname="a"/><force site="fixed"/></sensor></mujoco>"#;
    let d = read(text);
    let listed: Vec<String> = d.ignored.iter().map(ToString::to_string).collect();
    for part in [
        "muscle",
        "a spatial tendon with a <pulley> is not supported, because tendons are straight from site to site, so its spring and its limit have no force",
        "its tendon `line` is not supported",
        "it acts on a ball or free joint",
        "an actuator on a body",
        "`dyntype`",
        "a sensor of the actuator `pull`, which is not supported",
        "element <muscle>: it exerts no force",
        "a touch sensor at a site of the world",
        "site of the world, which has no hinge",
        "the principal axes of a body are not supported",
    ] {
        assert!(listed.iter().any(|l| l.contains(part)), "{part}: {listed:#?}");
    }
    let kinds: Vec<&DeviceKind> = d.devices.iter().map(|x| &x.kind).collect();
    let gyro = |at| DeviceKind::Sensor(Sensor::Motion(at));
    let on_body = gyro(DeviceFrame::Node("s".into()));
    assert_eq!(kinds, [&on_body, &gyro(DeviceFrame::Body("fixed".into()))]);
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

const SITES: &str = r#"<mujoco><worldbody><body name="base"><joint name="x"/><geom size="0.1"/><site name="hub"/>
<body name="link" pos="0 0 1"><joint name="y" ref="20"/><geom size="0.1"/><site name="tip" pos="0.1 0 0" euler="0 0 90"/></body></body>
<body name="cart"><joint name="z" type="slide"/><geom size="0.1"/><site name="aside"/></body></worldbody>"#;

/// MuJoCo moves only the joints between the two bodies, which is not an opposite wrench if `refsite` is on another branch.
#[test]
fn an_actuator_on_a_site_needs_a_reference_that_carries_it() {
    let on = |more: &str| {
        read(&format!(
            r#"{SITES}<actuator><general name="a" site="tip" gear="1 2 3" {more}/></actuator></mujoco>"#
        ))
    };
    let tip = || DeviceFrame::Node("tip".into());
    let gear = [1.0, 2.0, 3.0, 0.0, 0.0, 0.0];
    for (more, reference) in [("", None), (r#"refsite="hub""#, Some("hub"))] {
        let reference = reference.map(|r: &str| DeviceFrame::Node(r.into()));
        let want = Length::Wrench { gear, site: tip(), reference };
        assert_eq!(actuator(&on(more), "a").length, want);
    }
    let d = on(r#"refsite="aside""#);
    assert!(d.devices.is_empty());
    let listed = "`cart` does not carry the body of `tip`";
    assert!(d.ignored.iter().any(|i| i.what.contains(listed)), "{:?}", d.ignored);
}

/// MuJoCo 4.0 rejects `actrange` without an activation, too.
#[test]
fn activations_have_their_time_constant_and_range() {
    let text = |attributes: &str| format!(r#"{SITES}<actuator>{attributes}</actuator></mujoco>"#);
    for (element, time_constant, range) in [
        (
            r#"<general name="a" joint="x" dyntype="filter" dynprm="0.4" actrange="-1 2"/>"#,
            Some(0.4),
            Some([-1.0, 2.0]),
        ),
        (r#"<general name="a" joint="x" dyntype="filterexact"/>"#, Some(1.0), None),
        (
            r#"<general name="a" joint="x" dyntype="integrator" actlimited="false" actrange="-1 2"/>"#,
            None,
            None,
        ),
        (r#"<position name="a" joint="x" timeconst="0.2"/>"#, Some(0.2), None),
        (r#"<cylinder name="a" joint="x" timeconst="0.3"/>"#, Some(0.3), None),
        (r#"<intvelocity name="a" joint="x" actrange="-1 2"/>"#, None, Some([-1.0, 2.0])),
    ] {
        let own = actuator(&read(&text(element)), "a").activation.unwrap();
        assert_eq!((own.time_constant, own.range), (time_constant, range), "{element}");
    }
    for (element, message) in [
        (r#"<motor name="a" joint="x"/><general joint="x" actrange="-1 1"/>"#, "no activation"),
        (r#"<intvelocity joint="x"/>"#, "`actrange` is `0 0`, not a range"),
        (r#"<cylinder joint="x" timeconst="-1"/>"#, "a positive time constant"),
    ] {
        let found = read_mjcf(&text(element), &ReadOptions::default()).unwrap_err().to_string();
        assert!(found.contains(message), "{found}");
    }
    // A position servo takes the activation of `filterexact` from its class, and no other activation.
    for (kind, time) in [("filterexact", Some(0.4)), ("filter", None), ("integrator", None)] {
        let default =
            format!(r#"<mujoco><default><general dyntype="{kind}" dynprm="0.4"/></default>"#);
        let d = read(&text(r#"<position name="a" joint="x"/>"#).replace("<mujoco>", &default));
        assert_eq!(actuator(&d, "a").activation.and_then(|w| w.time_constant), time, "{kind}");
        assert_eq!(actuator(&d, "a").activation.is_some(), time.is_some(), "{kind}");
    }
    let d = read(&text(r#"<general joint="x" dyntype="muscle"/>"#));
    assert!(d.ignored.iter().any(|i| i.what.contains("`dyntype` is not none")), "{:?}", d.ignored);
}

/// y − y₀ = Σ aₖ (x − x₀)ᵏ, here with x as a tendon of one joint, too.
#[test]
fn polynomials_are_expanded_about_zero_and_those_of_several_joints_listed() {
    let tendons = r#"<tendon><fixed name="one"><joint joint="y" coef="2"/></fixed><fixed name="two"><joint joint="x" coef="1"/><joint joint="z" coef="1"/></fixed></tendon>"#;
    let with = |law: &str| read(&format!("{SITES}{tendons}<equality>{law}</equality></mujoco>"));
    let r = 20f64.to_radians();
    let a = [0.1, 0.5, -0.3, 0.2, 0.7];
    for (law, scale) in [
        (r#"<joint joint1="x" joint2="y" polycoef="0.1 0.5 -0.3 0.2 0.7"/>"#, 1.0),
        (r#"<tendon tendon1="two" tendon2="one" polycoef="0.1 0.5 -0.3 0.2 0.7"/>"#, 2.0),
    ] {
        let d = with(law);
        let mut builder = d.builder.clone();
        builder.couplings_mut().extend(d.couplings.clone());
        let mbs = builder.build().unwrap();
        let at = |body: &str| mbs.get(mbs.body(body).unwrap()).q().start;
        let mut q = mbs.neutral_q();
        (q[at("base")], q[at("link")]) = (0.4, 1.3);
        let s: f64 = scale * (1.3 - r);
        let p = a.iter().rev().fold(0.0, |sum, c| sum * s + c);
        assert!((mbs.couplings()[0].error(&q) - (0.4 - p)).abs() < 1e-13, "{law}");
    }
    let d = with(r#"<tendon tendon1="one" tendon2="two" polycoef="0 1 2"/>"#);
    assert!(d.couplings.is_empty());
    assert!(d.ignored.iter().any(|i| i.what.contains("in a tendon over several joints")));
}

/// The load of a hinge is read in the frame of the site.
#[test]
fn sensors_of_force_and_torque_are_loads_of_the_hinge_of_their_body() {
    let d = read(&format!(
        r#"{SITES}<sensor><force name="f" site="tip"/><torque name="t" site="tip"/></sensor></mujoco>"#
    ));
    for name in ["f", "t"] {
        let device = d.devices.iter().find(|x| x.name == name).unwrap();
        let DeviceKind::Sensor(Sensor::HingeLoad { body, frame }) = &device.kind else {
            panic!("{device:?}")
        };
        assert_eq!(body, "link");
        // `ref` rotates the frame of the hinge on the body backwards.
        let (p, turn) = (frame.position, frame.rotation.angle());
        let r = 20f64.to_radians();
        assert!((p.x - 0.1 * r.cos()).abs() < 1e-15 && (p.y + 0.1 * r.sin()).abs() < 1e-15, "{p}");
        assert!((turn - 70f64.to_radians()).abs() < 1e-12, "{turn}");
    }
}
