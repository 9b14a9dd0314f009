//! Touch sensors and range finders of an MJCF file, compared with MuJoCo 4.0 and with the statics of a stool.
use crate::common::in_folder;
use linkwork_runtime::{Seconds, Simulation};

const STOOL: &str = r#"<mujoco><option timestep="0.001" gravity="0 0 -9.81"/><worldbody><geom name="floor" type="plane" size="5 5 0.1"/>
<body name="stool" pos="0 0 0.42"><freejoint/><geom name="seat" type="box" size="0.3 0.25 0.02" mass="3" pos="0.02 -0.03 0"/><geom name="load" type="sphere" size="0.05" mass="2" pos="0.08 0.06 0.1"/>
 <geom name="a" type="sphere" size="0.02" mass="0.1" pos="0.25 0 -0.4"/><geom name="b" type="sphere" size="0.02" mass="0.1" pos="-0.2 0.2 -0.4"/><geom name="c" type="sphere" size="0.02" mass="0.1" pos="-0.2 -0.22 -0.4"/>
 <site name="sa" pos="0.25 0 -0.4" size="0.025"/><site name="sb" type="box" pos="-0.2 0.2 -0.4" euler="0 0 30" size="0.03 0.03 0.03"/><site name="sc" type="cylinder" pos="-0.2 -0.22 -0.41" size="0.03 0.02"/>
 <site name="sbc" type="capsule" pos="-0.2 0 -0.4" euler="90 0 0" size="0.05 0.25"/><site name="out" type="ellipsoid" pos="-0.2 -0.22 -0.6" size="0.1 0.05 0.04"/><site name="side" type="box" pos="-0.2 -0.3 -0.42" size="0.03 0.03 0.03"/></body>
</worldbody><sensor><touch name="ta" site="sa"/><touch name="tb" site="sb"/><touch name="tc" site="sc"/><touch name="tbc" site="sbc"/><touch name="below" site="out"/><touch name="beside" site="side"/></sensor></mujoco>"#;

/// MuJoCo's readings at 4 s (1 ms). Its contacts are soft, so the stool is tilted by 0.0003 rad.
const PRESSED: [(&str, f64); 6] = [
    ("ta", 27.58945127),
    ("tb", 13.43926333),
    ("tc", 10.96428534),
    ("tbc", 24.40354867),
    ("below", 10.96428534),
    ("beside", 0.0),
];

const TURRET: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.0005" integrator="RK4"/><worldbody>
<body name="turret" pos="0 0 1"><joint name="spin" axis="0 0 1" stiffness="0.5" springref="2.5" damping="0.02"/><geom type="sphere" size="0.2" mass="1" contype="0" conaffinity="0"/>
 <site name="level" pos="0.05 0 0.02" zaxis="1 0 0"/><site name="down" pos="0.05 0 0.02" zaxis="1 0.2 -0.3"/><site name="back" pos="-0.1 0.02 0" zaxis="-1 0.3 0.1"/>
 <body name="tip" pos="0.4 -0.1 0.05"><joint name="nod" axis="0 1 0" stiffness="0.3" springref="0.8" damping="0.01"/><geom type="capsule" fromto="0 0 -0.1 0.1 0.02 0.15" size="0.03" mass="0.3" contype="0" conaffinity="0"/></body></body>
<body name="box" pos="1.2 0.5 1"><geom type="box" size="0.2 0.4 0.5" euler="0.1 0.2 0.3" contype="0" conaffinity="0"/></body>
<body name="ball" pos="-0.3 1.4 1"><geom type="sphere" size="0.45" contype="0" conaffinity="0"/></body>
<body name="egg" pos="-1.5 0.3 0.9"><geom type="ellipsoid" size="0.4 0.7 0.5" euler="0.3 0.1 0.4" contype="0" conaffinity="0"/></body>
<body name="can" pos="-0.6 -1.3 0.9"><geom type="cylinder" size="0.5 0.4" euler="0.4 0.2 0" contype="0" conaffinity="0"/></body>
<body name="slab" pos="0.5 0.3 0.2"><geom type="box" size="3 3 0.1" contype="0" conaffinity="0"/></body>
</worldbody><sensor><rangefinder name="r1" site="level"/><rangefinder name="r2" site="down"/><rangefinder name="r3" site="back"/><jointpos name="q" joint="spin"/></sensor></mujoco>"#;

/// MuJoCo's readings of the three range finders every 0.25 s (RK4, 0.5 ms).
const RANGES: [[f64; 3]; 7] = [
    [-1.0, 1.05257930975, 1.07898481742],
    [1.06212053465, 1.11122034161, -1.0],
    [0.949035695234, 1.10205544809, 0.964585073881],
    [1.02427606805, 1.07523468157, -1.0],
    [0.912357874547, 0.887488853394, -1.0],
    [1.07534014423, 2.55123499506, -1.0],
    [0.899255206821, 0.914186423715, -1.0],
];

fn simulation(robot: &str, more: &str) -> Simulation {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("robot.xml"), robot).unwrap();
    let sim = format!(
        r#"Simulation({more}, parts: {{ "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}) }}, until: "4 s")"#
    );
    let file = dir.path().join("sim.ron");
    std::fs::write(&file, sim).unwrap();
    in_folder(&file).unwrap_or_else(|e| panic!("{e}"))
}

/// The forces on three feet follow from equilibrium. `below` is outside of the stool, where the normal of the contact of foot c points; `beside`
/// has no contact.
#[test]
fn touch_sensors_read_the_normal_forces_in_their_zones() {
    let weight = 5.3 * 9.81;
    let x = (3.0 * 0.02 + 2.0 * 0.08 + 0.1 * (0.25 - 0.4)) / 5.3;
    let y = (3.0 * -0.03 + 2.0 * 0.06 + 0.1 * (0.2 - 0.22)) / 5.3;
    let a = weight * (x + 0.2) / 0.45;
    let b = (weight * y + 0.22 * (weight - a)) / 0.42;
    let c = weight - a - b;
    let statics = [a, b, c, b + c, c, 0.0];
    let compliant =
        "compliant: (stiffness: 1e6, damping: 1, bristle_stiffness: 1e5, bristle_damping: 100)";
    for (contact, integrator) in [("friction: 0.8", ""), (compliant, r#", integrator: "rk4""#)] {
        let more = format!(
            r#"import: (file: "robot.xml", collide: true), contact: ({contact}), step: "0.2 ms"{integrator}"#
        );
        let mut sim = simulation(STOOL, &more);
        sim.run_until(Seconds { num: 4, den: 1 }).unwrap();
        for ((name, mujoco), want) in PRESSED.iter().zip(statics) {
            let found = sim.get(&format!("{name}.force")).unwrap();
            println!("{contact:.9} {name}: {found}, statics {want}, MuJoCo {mujoco}");
            assert!((found - want).abs() < 1e-2, "{name}: {found}, statics {want}");
            assert!((found - mujoco).abs() < 4e-2, "{name}: {found}, MuJoCo {mujoco}");
        }
    }
    // Without contact the file is accepted, and the sensors read nothing.
    let mut sim = simulation(STOOL, r#"import: (file: "robot.xml"), step: "1 ms""#);
    sim.run_until(Seconds { num: 1, den: 10 }).unwrap();
    assert_eq!(sim.get("ta.force").unwrap(), 0.0);
}

/// Rays of a turret pass through its own body, and meet other bodies: boxes, a sphere, an ellipsoid, a cylinder, and the tip that the turret carries.
#[test]
fn range_finders_read_the_distances_of_mujoco() {
    let more = r#"import: (file: "robot.xml"), step: "0.5 ms", integrator: "rk4""#;
    let mut sim = simulation(TURRET, more);
    for (k, row) in RANGES.iter().enumerate() {
        sim.run_until(Seconds { num: k as u64, den: 4 }).unwrap();
        for (name, want) in ["r1", "r2", "r3"].iter().zip(row) {
            let found = sim.get(&format!("{name}.distance")).unwrap();
            assert!((found - want).abs() < 1e-7, "{name}, row {k}: {found}, MuJoCo {want}");
        }
    }
}
