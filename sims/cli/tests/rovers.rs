//! Rovers that `linkwork new rover` creates from a URDF alone: their rest on the ground compared with statics, their speed with their wheels.
use crate::common::Lab;
use linkwork_runtime::{Seconds, Simulation};
use std::sync::Arc;

const G: f64 = 9.81;

fn link(name: &str, mass: f64, com: &str, inertia: f64, shapes: &str) -> String {
    format!(
        r#"<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/><inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/></inertial>{shapes}</link>"#
    )
}

fn joint(kind: &str, parent: &str, child: &str, origin: &str, axis: &str) -> String {
    let limit = match kind {
        "revolute" => r#"<limit lower="-0.8" upper="0.8" effort="60" velocity="2"/>"#,
        _ => "",
    };
    format!(
        r#"<joint name="{child}_joint" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin {origin}/><axis xyz="{axis}"/>{limit}</joint>"#
    )
}

fn shape(origin: &str, geometry: &str) -> String {
    format!("<collision><origin {origin}/><geometry><{geometry}/></geometry></collision>")
}

fn tyre(radius: f64, width: f64) -> String {
    shape(
        r#"xyz="0 0 0" rpy="1.5707963267948966 0 0""#,
        &format!(r#"cylinder radius="{radius}" length="{width}""#),
    )
}

/// Two wheels and a caster, in the way of the TurtleBot3 Burger: a root link without mass, axles along z of the wheels' links, a fixed caster link.
fn burger(caster: &str) -> String {
    let mut t = String::from(r#"<robot name="burger"><link name="base_footprint"/>"#);
    t += &joint("fixed", "base_footprint", "base_link", r#"xyz="0 0 0.010""#, "1 0 0");
    t += &link(
        "base_link",
        0.8257,
        "-0.02 0 0.06",
        0.002,
        &shape(r#"xyz="-0.032 0 0.070""#, r#"box size="0.140 0.140 0.143""#),
    );
    for (side, y) in [("left", 0.08), ("right", -0.08)] {
        let name = format!("wheel_{side}_link");
        let origin = format!(r#"xyz="0 {y} 0.023" rpy="-1.5707963267948966 0 0""#);
        t += &joint("continuous", "base_link", &name, &origin, "0 0 1");
        t += &link(
            &name,
            0.0285,
            "0 0 0",
            1.1e-5,
            &shape("", r#"cylinder radius="0.033" length="0.018""#),
        );
    }
    t += &joint(
        "fixed",
        "base_link",
        "caster_back_link",
        r#"xyz="-0.081 0 -0.004" rpy="-1.5707963267948966 0 0""#,
        "1 0 0",
    );
    t += &link("caster_back_link", 0.005, "0 0 0", 1e-6, caster);
    t + "</robot>"
}

/// A created rover on level ground, at rest before its run.
struct Made {
    sim: Simulation,
    readme: String,
    /// Output of `check`.
    checked: String,
}

fn made(lab: &Lab, name: &str, urdf: &str, set: &[&str]) -> Made {
    let file = format!("{name}.urdf");
    lab.write(&file, urdf);
    lab.linkwork(&["new", "rover", name, "--from", &file]).code(0);
    let set: Vec<String> = ["Terrain.relief=0"].iter().chain(set).map(|s| s.to_string()).collect();
    let ready = linkwork_cli::library().file(&lab.path(name), &set, None);
    let ready = ready.map_err(|f| f.render(false)).unwrap();
    let checked = lab.linkwork(&["check", name]).code(0);
    let checked = checked.out + &checked.err;
    let readme = std::fs::read_to_string(lab.path(&format!("{name}/README.md"))).unwrap();
    Made { sim: Simulation::of(Arc::new(ready.program)), readme, checked }
}

impl Made {
    fn get(&self, path: &str) -> f64 {
        self.sim.get(path).unwrap_or_else(|e| panic!("{path}: {e}"))
    }

    fn run(&mut self, seconds: u64) {
        self.sim.run_until(Seconds { num: seconds, den: 1 }).unwrap();
    }

    /// Normal force of a wheel or support, N.
    fn load(&self, part: &str) -> f64 {
        self.get(&format!("Rover.{part}.SurfaceContact.normal_force"))
    }

    /// Asserts the loads of three supports: two at the same x and one at another x, for a mass with its centre at `com` (m).
    fn carries(
        &self,
        [pair, single]: [[&str; 2]; 2],
        [pair_x, single_x]: [f64; 2],
        mass: f64,
        com: f64,
    ) {
        let one = mass * G * (com - pair_x) / (single_x - pair_x);
        let two = 0.5 * (mass * G - one);
        for (part, want) in [(single[0], one), (pair[0], two), (pair[1], two)] {
            let found = self.load(part);
            let off = (found / want - 1.0).abs();
            assert!(off < 4e-3, "{part}: {found} N instead of {want} N");
        }
    }
}

/// The distance that a body has moved ahead while the odometry has counted wheel radius times angle, both in m.
fn driven(rover: &mut Made, root: &str, from: u64, to: u64) -> [f64; 2] {
    let paths = [format!("Rover/{root}.position.x"), "Rover.Software.Odometry.path".to_string()];
    rover.run(from);
    let before = paths.each_ref().map(|p| rover.get(p));
    rover.run(to);
    let after = paths.each_ref().map(|p| rover.get(p));
    [0, 1].map(|k| after[k] - before[k])
}

const AHEAD: &str = "Rover.waypoints=[[50, 0]]";

/// Mass 0.8877 kg, centre of mass at x = −0.019059 m; the caster is 81 mm behind the axle.
#[test]
fn two_wheels_and_a_fixed_caster_rest_and_drive() {
    let ball = shape(r#"xyz="0 0.001 0""#, r#"sphere radius="0.005""#);
    let foot = shape(r#"xyz="0 0.001 0""#, r#"box size="0.030 0.009 0.020""#);
    for (name, caster, gap) in [("ball", &ball, 0.0), ("foot", &foot, 0.5e-3)] {
        let lab = Lab::new();
        let mut rover = made(&lab, name, &burger(caster), &[AHEAD]);
        assert!(rover.readme.contains("| no | slides with friction 0.1 |"), "{}", rover.readme);
        // Unused content of the file is the only remark.
        let unused = rover.checked.contains("that are not used:");
        assert!(unused && rover.checked.matches("warning: ").count() == 1, "{}", rover.checked);
        let (mass, com) = (0.8877, -0.019_059);
        // The rover is pitched by the gap and by unequal penetration; the centre of mass is 0.034 m
        // above the axle.
        let pitch = rover.get("Rover.Pose.pitch");
        let com = com + 0.034 * pitch;
        rover.carries([["Wheel1", "Wheel2"], ["Idle1", ""]], [0.0, -0.081], mass, com);
        // The stiffness of the contact is a third of the weight over 0.5 % of the wheel's radius.
        let stiffness = mass * G / 3.0 / (0.005 * 0.033);
        let sunk = rover.load("Wheel1") / stiffness;
        let z = rover.get("Rover/base_footprint.position.z");
        assert!((z + sunk).abs() < 1e-5, "{z} {sunk}");
        let behind = rover.load("Idle1") / stiffness;
        let want = (sunk - behind - gap) / 0.081;
        assert!((pitch - want).abs() < 2e-5, "{pitch} {want}");
        let [moved, rolled] = driven(&mut rover, "base_footprint", 4, 6);
        assert!(moved > 0.1 && (moved / rolled - 1.0).abs() < 0.01, "{moved} {rolled}");
    }
}

/// A wheel on a swivel that nothing drives, 30 mm behind the swivel's axis: mass 28.1 kg, centre of mass at x = −0.078719 m. It trails after a
/// turn, on a straight line on which the rover weaves a little.
#[test]
fn a_caster_with_a_wheel_swivels_behind_its_axis() {
    let lab = Lab::new();
    let mut t = String::from(r#"<robot name="amr">"#);
    t += &link("base", 25.0, "-0.08 0 0.08", 0.9, "");
    for (name, y) in [("l_wheel", 0.22), ("r_wheel", -0.22)] {
        t += &joint("continuous", "base", name, &format!(r#"xyz="0 {y} 0""#), "0 1 0");
        t += &link(name, 1.2, "0 0 0", 0.006, &tyre(0.1, 0.04));
    }
    t += &joint("continuous", "base", "swivel", r#"xyz="-0.3 0 0.02""#, "0 0 1");
    t += &link("swivel", 0.4, "0 0 0", 5e-4, "");
    t += &joint("continuous", "swivel", "caster_wheel", r#"xyz="-0.03 0 -0.07""#, "0 1 0");
    t += &link("caster_wheel", 0.3, "0 0 0", 3e-4, &tyre(0.05, 0.03));
    t += "</robot>";
    let mut rover =
        made(&lab, "amr", &t, &["Rover.waypoints=[[2, 0], [2, 2], [50, 2]]", "Rover.speed=0.2"]);
    assert!(rover.readme.contains("| no | turns freely on `swivel` |"), "{}", rover.readme);
    assert!(!rover.checked.contains("does not rest"), "{}", rover.checked);
    let com = (25.0 * -0.08 + 0.4 * -0.3 + 0.3 * -0.33) / 28.1;
    rover.carries([["Wheel1", "Wheel2"], ["Idle1", ""]], [0.0, -0.33], 28.1, com);
    rover.run(22);
    let turned = rover.get("Rover/swivel.angle");
    let [moved, rolled] = driven(&mut rover, "base", 32, 36);
    let straight = rover.get("Rover/swivel.angle");
    println!("swivel {turned} rad in the turn, {straight} rad behind it; {moved} m, {rolled} m");
    assert!(turned.abs() > 1.0 && straight.sin().abs() < 0.2 && straight.cos() > 0.9, "{straight}");
    assert!(moved > 0.3 && (moved / rolled - 1.0).abs() < 0.01, "{moved} {rolled}");
    // The caster's wheel has half the radius, so it turns twice as fast.
    let [left, right, caster] =
        ["l_wheel", "r_wheel", "caster_wheel"].map(|w| rover.get(&format!("Rover/{w}.rate")));
    assert!((caster / (left + right) - 1.0).abs() < 0.01, "{left} {right} {caster}");
}

/// The robot of a file whose forward direction is y, like many that were drawn as mechanical parts: its wheels roll along y of the root link. With the
/// root link that the message describes it drives ahead.
#[test]
fn wheels_that_roll_sideways_are_rejected_with_a_remedy() {
    let lab = Lab::new();
    let body = |extra: &str| {
        let mut t = format!(r#"<robot name="sideways">{extra}"#);
        t += &link("base", 20.0, "0 0 0", 0.9, "");
        for (name, at) in
            [("fl", "-0.3 0.3"), ("fr", "0.3 0.3"), ("rl", "-0.3 -0.3"), ("rr", "0.3 -0.3")]
        {
            let origin = format!(r#"xyz="{at} 0" rpy="0 1.5707963267948966 0""#);
            t += &joint("continuous", "base", name, &origin, "0 0 1");
            let tyre = shape("", r#"cylinder radius="0.1" length="0.05""#);
            t += &link(name, 1.0, "0 0 0", 0.006, &tyre);
        }
        t + "</robot>"
    };
    lab.write("bad.urdf", &body(""));
    let told =
        ["`bad.urdf`: its wheel", "to x of `base`", "add a root link", "rpy=\"0 0 -1.5707963\""];
    lab.linkwork(&["new", "rover", "bad", "--from", "bad.urdf"]).code(2).tells(&told);
    assert!(!lab.path("bad").exists());
    let root = r#"<link name="ahead"/>"#.to_string()
        + &joint("fixed", "ahead", "base", r#"rpy="0 0 -1.5707963""#, "1 0 0");
    let mut rover = made(&lab, "good", &body(&root), &[AHEAD]);
    let [moved, rolled] = driven(&mut rover, "ahead", 4, 6);
    assert!(moved > 0.1 && (moved / rolled - 1.0).abs() < 0.01, "{moved} {rolled}");
    // The metric of slip, and the end of a run of a rover that is tilted too much.
    assert!(rover.get("Rover.Wheel1.SurfaceContact.slip").abs() < 0.1);
}

/// Three wheels, of which the front one has 2.5 times the radius of the others and steers by ±0.8 rad. Within that it cannot turn on the spot.
#[test]
fn a_tricycle_with_a_large_front_wheel_drives_circles() {
    let lab = Lab::new();
    let mut t = String::from(r#"<robot name="trike">"#);
    t += &link("base", 30.0, "0.35 0 0.1", 1.8, "");
    t += &joint("revolute", "base", "fork", r#"xyz="0.8 0 0.25""#, "0 0 1");
    t += &link("fork", 2.0, "0 0 0", 0.03, "");
    t += &joint("continuous", "fork", "front", r#"xyz="0 0 -0.1""#, "0 1 0");
    t += &link("front", 3.0, "0 0 0", 0.05, &tyre(0.25, 0.08));
    for (name, y) in [("rear_l", 0.3), ("rear_r", -0.3)] {
        t += &joint("continuous", "base", name, &format!(r#"xyz="0 {y} 0""#), "0 1 0");
        t += &link(name, 1.0, "0 0 0", 0.005, &tyre(0.1, 0.05));
    }
    t += "</robot>";
    let mut rover = made(&lab, "trike", &t, &["Rover.waypoints=[[4, 0], [4, 5], [-50, 5]]"]);
    assert!(!rover.checked.contains("does not rest"), "{}", rover.checked);
    let com = (30.0 * 0.35 + 5.0 * 0.8) / 37.0;
    rover.carries([["Wheel2", "Wheel3"], ["Wheel1", ""]], [0.0, 0.8], 37.0, com);
    let z = rover.get("Rover/base.position.z");
    assert!((z - 0.1).abs() < 2e-3, "{z}");
    let [moved, rolled] = driven(&mut rover, "base", 4, 6);
    assert!(moved > 0.3 && (moved / rolled - 1.0).abs() < 0.01, "{moved} {rolled}");
    let rates = ["front", "rear_l"].map(|w| rover.get(&format!("Rover/{w}.rate")));
    assert!((rates[1] / rates[0] - 2.5).abs() < 0.03, "{rates:?}");
    let mut most = 0.0_f64;
    for second in 7..30 {
        rover.run(second);
        most = most.max(rover.get("Rover/fork.angle").abs());
    }
    assert!(most > 0.3 && most < 0.8, "{most}");
    assert!(
        rover.get("Rover.Software.Follower.waypoint") >= 2.0,
        "it turned at the second waypoint"
    );
}

/// A front caster that swivels does not carry a mass behind the axle: the ball at the rear does, and is found as well.
#[test]
fn a_ball_carries_what_a_swivel_does_not() {
    let lab = Lab::new();
    let ball = shape(r#"xyz="0 0.001 0""#, r#"sphere radius="0.005""#);
    let mut t = burger(&ball).replace("</robot>", "");
    t += &joint("continuous", "base_link", "swivel", r#"xyz="0.09 0 0.02""#, "0 0 1");
    t += &link("swivel", 0.01, "0 0 0", 1e-5, "");
    t += &joint("continuous", "swivel", "front_wheel", r#"xyz="-0.015 0 -0.02""#, "0 1 0");
    t += &link("front_wheel", 0.01, "0 0 0", 1e-6, &tyre(0.01, 0.01));
    let rover = made(&lab, "both", &(t + "</robot>"), &[]);
    assert!(rover.readme.contains("| no | turns freely on `swivel` |"), "{}", rover.readme);
    assert!(rover.readme.contains("| no | slides with friction 0.1 |"), "{}", rover.readme);
    assert!(!rover.checked.contains("does not rest"), "{}", rover.checked);
}

/// Machines that fall over: without a third support, and with the centre of mass ahead of the axle.
#[test]
fn machines_that_tip_over_are_rejected() {
    let lab = Lab::new();
    let high = shape(r#"xyz="0 -0.02 0""#, r#"sphere radius="0.005""#);
    let ball = shape(r#"xyz="0 0.001 0""#, r#"sphere radius="0.005""#);
    let ahead = burger(&ball).replace(r#"xyz="-0.02 0 0.06""#, r#"xyz="0.02 0 0.06""#);
    for (name, urdf, facts) in [
        ("high", burger(&high), ["2 wheels and no fixed shape that reaches the ground", "0.008 m"]),
        ("ahead", ahead, ["it would tip over: its centre of mass [0.0181", "0.0181 m outside"]),
    ] {
        let file = format!("{name}.urdf");
        lab.write(&file, &urdf);
        let told = lab.linkwork(&["new", "rover", name, "--from", &file]).code(2).err;
        assert!(facts.iter().all(|f| told.contains(f)), "{told}");
        assert!(!lab.path(name).exists());
    }
}

/// Two radii for three wheels, and two radii for one wheel, are rejected where they are written.
#[test]
fn radii_of_place_belong_to_its_entries() {
    let lab = Lab::new();
    let ball = shape(r#"xyz="0 0.001 0""#, r#"sphere radius="0.005""#);
    lab.write("burger.urdf", &burger(&ball));
    lab.linkwork(&["new", "rover", "burger", "--from", "burger.urdf"]).code(0);
    let sim = std::fs::read_to_string(lab.path("burger/sim.ron")).unwrap();
    let written = "radius: [0.033, 0.033, 0.005]";
    assert!(sim.contains(written), "{sim}");
    for (radius, wheels, fact) in [
        ("[0.033, 0.005]", "", "`radius` has 2 values, but `wheels` has 3 entries"),
        (
            "[0.033, 0.033, 0.005]",
            "\"Rover.Wheel*/hub\", \"Rover.Wheel2/hub\", \"Rover.Idle1/hub\"",
            "",
        ),
        (
            "[0.033, 0.04, 0.005]",
            "\"Rover.Wheel*/hub\", \"Rover.Wheel2/hub\", \"Rover.Idle1/hub\"",
            "two entries of `wheels` match `Rover.Wheel2/hub`, with the radii 0.033 m and 0.04 m",
        ),
    ] {
        let mut text = sim.replace(written, &format!("radius: {radius}"));
        if !wheels.is_empty() {
            let names = "\"Rover.Wheel1/hub\", \"Rover.Wheel2/hub\", \"Rover.Idle1/hub\"";
            assert!(text.contains(names), "{text}");
            text = text.replace(names, wheels);
        }
        lab.write("burger/sim.ron", &text);
        let said = lab.linkwork(&["check", "burger"]);
        match fact {
            "" => drop(said.code(0)),
            fact => drop(said.code(2).tells(&[fact, "help: "])),
        }
    }
}
