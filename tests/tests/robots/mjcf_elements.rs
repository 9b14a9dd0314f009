//! Elements of MJCF files in simulations: polynomial couplings, actuators on sites and with activations, sensors of force and torque, height fields.
//! The numbers are those of MuJoCo 4.0 (RK4, 0.5 ms) where nothing else is written.
use crate::common::in_folder;
use linkwork_runtime::{Seconds, Simulation};

/// The file in a simulation with gravity; `more` are fields of the simulation.
fn simulation(text: &str, more: &str) -> Result<Simulation, String> {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("machine.xml"), text).unwrap();
    let sim = format!(
        r#"Simulation(import: (file: "machine.xml", collide: true), parts: {{ "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}) }},
            {more} until: "2 s")"#
    );
    let file = dir.path().join("sim.ron");
    std::fs::write(&file, sim).unwrap();
    in_folder(&file)
}

const RK4: &str = r#"step: "0.5 ms", integrator: "rk4","#;

fn one(sim: &Simulation, name: &str) -> f64 {
    sim.get(name).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[track_caller]
fn agree(sim: &Simulation, names: &[&str], want: &[f64], tolerance: f64) {
    let found: Vec<f64> = names.iter().map(|n| one(sim, n)).collect();
    for ((name, x), y) in names.iter().zip(&found).zip(want) {
        assert!((x - y).abs() < tolerance * y.abs().max(1.0), "{name}: {x} {y}\n{found:?}");
    }
}

const CAM: &str = r#"<mujoco><compiler angle="radian"/><worldbody>
 <body name="cam" pos="0 0 1"><joint name="x" axis="0 1 0" ref="0.2"/><geom type="box" size="0.3 0.05 0.04" pos="0.25 0.1 0" mass="1.2" contype="0" conaffinity="0"/></body>
 <body name="follower" pos="0.5 0.3 1"><joint name="y" axis="0.2 1 0.3" ref="-0.1" damping="0.05"/><geom type="box" size="0.1 0.04 0.2" pos="0 0.05 -0.2" mass="0.7" contype="0" conaffinity="0"/>
  <body name="bob" pos="0 0 -0.4"><joint name="z" axis="1 0 0"/><geom size="0.06" pos="0 0.02 -0.2" mass="0.3" contype="0" conaffinity="0"/></body></body>
</worldbody><equality><joint name="law" joint1="y" joint2="x" polycoef="0.15 0.6 -0.7 0.25 0.3"/></equality></mujoco>"#;

/// MuJoCo's own constraint is soft and omits J̇ν. The reference integrates MuJoCo's mass matrix and forces in the coordinates x and z, with y and its
/// derivatives from the polynomial, by RK4 with 0.5 ms.
#[test]
fn a_polynomial_coupling_moves_as_the_exact_constraint_of_mujocos_model() {
    let at = r#"overrides: { "cam.initial": (angle: 0.2) }, step: "0.5 ms", integrator: "rk4","#;
    let mut sim = simulation(CAM, at).unwrap_or_else(|e| panic!("{e}"));
    // The other coordinate follows by the polynomial.
    agree(&sim, &["cam.angle", "follower.angle"], &[0.2, 0.05], 1e-12);
    let names =
        ["cam.angle", "follower.angle", "bob.angle", "cam.rate", "follower.rate", "bob.rate"];
    for (half, want) in [
        (
            1,
            [
                1.5335314984072415,
                1.146873314302069,
                -0.2628281458908264,
                0.9620787332800322,
                2.802052852727585,
                2.2958400316813217,
            ],
        ),
        (
            2,
            [
                1.1479995031818553,
                0.44500023037220093,
                -0.10230283765214453,
                -3.585926750945334,
                -3.4754517064225197,
                -1.7586144548048042,
            ],
        ),
    ] {
        sim.run_until(Seconds { num: half, den: 2 }).unwrap();
        agree(&sim, &names, &want, 1e-7);
    }
}

/// Without a second joint, the first is held at the constant of the polynomial.
#[test]
fn an_equality_of_one_joint_holds_it() {
    let alone = CAM.replace(r#" joint2="x""#, "");
    let mut sim = simulation(&alone, RK4).unwrap_or_else(|e| panic!("{e}"));
    sim.run_until(Seconds { num: 1, den: 10 }).unwrap();
    agree(&sim, &["follower.angle", "follower.rate"], &[0.05, 0.0], 1e-10);
}

const ARM: &str = r#"<mujoco><compiler angle="radian"/>
<worldbody><site name="stand" pos="0.1 -0.2 0.4" euler="0.3 0.2 -0.1"/>
 <body name="base" pos="0 0 1"><joint name="yaw" axis="0 0.1 1" damping="0.3" stiffness="2"/><geom type="box" size="0.1 0.08 0.05" mass="1.5" contype="0" conaffinity="0"/><site name="hub" pos="0.02 0.05 0.1" euler="0.1 -0.3 0.2"/>
  <body name="link" pos="0.1 0.05 0.1" euler="0.2 0 0.3"><joint name="pitch" axis="0 1 0.2" pos="0.02 0 0" ref="0.15" damping="0.2" stiffness="3" springref="0.4"/><geom type="capsule" size="0.03" fromto="0 0 0 0.4 0 0" mass="0.8" contype="0" conaffinity="0"/><site name="wrist" pos="0.35 0.01 0.02" euler="0.4 0.1 -0.2"/>
   <body name="tool" pos="0.4 0.02 0" euler="0 0.3 0"><geom type="box" size="0.05 0.03 0.1" pos="0.02 0 -0.08" mass="0.4" contype="0" conaffinity="0"/><site name="grip" pos="0.01 0.02 -0.1" euler="0.2 0.5 0"/></body></body></body>
 <body name="cart" pos="1 0 0"><joint name="rail" type="slide" axis="1 0 0" damping="1.2" range="-2 3"/><geom size="0.1" mass="2" contype="0" conaffinity="0"/></body>
</worldbody>
<actuator>
 <general name="push" site="grip" gear="0.6 -0.4 0.8 0.05 0.02 -0.03" ctrlrange="-3 3"/>
 <general name="hold" site="wrist" refsite="hub" gear="1 0.5 -0.7 0.2 0.1 0.3" gainprm="2" biastype="affine" biasprm="0.1 -1.5 -0.2"/>
 <general name="guide" site="grip" refsite="stand" gear="0.3 0.2 0.9" dyntype="filter" dynprm="0.15"/>
 <cylinder name="ram" joint="rail" diameter="0.4" timeconst="0.2" bias="0.3 -2 -0.5" ctrlrange="-20 20"/>
 <intvelocity name="drift" joint="pitch" kp="1.5" kv="0.1" actrange="-0.2 0.25"/>
 <position name="soft" joint="yaw" kp="2" kv="0.1" timeconst="0.3"/>
 <general name="sum" joint="rail" dyntype="integrator" gainprm="1.5" actlimited="true" actrange="-1 0.4"/>
</actuator>
<sensor><force name="f0" site="grip"/><torque name="t0" site="grip"/><force name="f1" site="wrist"/><torque name="t1" site="wrist"/><force name="f2" site="hub"/><torque name="t2" site="hub"/></sensor>
</mujoco>"#;

const MOTION: [&str; 6] =
    ["base.angle", "link.angle", "cart.displacement", "base.rate", "link.rate", "cart.speed"];
const ACTIVATIONS: [&str; 5] = [
    "guide.state.activation",
    "ram.state.activation",
    "drift.state.activation",
    "soft.state.activation",
    "sum.state.activation",
];
const LENGTHS: [&str; 6] = [
    "push.length",
    "hold.length",
    "guide.length",
    "push.velocity",
    "hold.velocity",
    "guide.velocity",
];
const FORCES: [&str; 7] = [
    "push.force",
    "hold.force",
    "guide.force",
    "ram.force",
    "drift.force",
    "soft.force",
    "sum.force",
];
const LOADS: [&str; 18] = [
    "f0.force.x",
    "f0.force.y",
    "f0.force.z",
    "t0.torque.x",
    "t0.torque.y",
    "t0.torque.z",
    "f1.force.x",
    "f1.force.y",
    "f1.force.z",
    "t1.torque.x",
    "t1.torque.y",
    "t1.torque.z",
    "f2.force.x",
    "f2.force.y",
    "f2.force.z",
    "t2.torque.x",
    "t2.torque.y",
    "t2.torque.z",
];

/// Wrenches on sites, with and without `refsite`; activations that integrate and that lag, with bounds; and a cylinder.
#[test]
fn wrenches_and_activations_are_those_of_mujoco() {
    let mut sim = simulation(ARM, RK4).unwrap_or_else(|e| panic!("{e}"));
    for (name, x) in [
        ("push", 1.1),
        ("hold", -0.7),
        ("guide", 2.0),
        ("ram", 5.0),
        ("drift", 0.2),
        ("soft", 0.0),
        ("sum", 0.35),
    ] {
        sim.set(&format!("{name}.control"), x).unwrap();
    }
    agree(&sim, &LENGTHS, &[0.0, 0.6031586170795507, 0.6659361701728571, 0.0, 0.0, 0.0], 1e-12);
    agree(
        &sim,
        &FORCES,
        &[1.1, -2.204737925619326, 0.0, 0.3, -0.22499999999999998, 0.0, 0.0],
        1e-12,
    );
    for (half, motion, activations, lengths, forces) in [
        (
            1,
            [
                -0.03697542410477942,
                0.6624975638214398,
                0.03796867084319555,
                0.5495358778577578,
                -0.6203092394695411,
                0.16911436688878484,
            ],
            [1.928652013305249, 4.58957500688017, 0.10000000000000184, 0.0, 0.1750000000000009],
            [
                0.0,
                0.7002278440835807,
                0.4894929449226354,
                -0.07527055734572184,
                -0.11268175828601708,
                0.11819190251419896,
            ],
            [
                1.1,
                -2.3278054144681675,
                1.928652013305249,
                0.7162484798577792,
                -0.7817154217852027,
                0.01899726042378306,
                0.26250000000000134,
            ],
        ),
        (
            2,
            [
                -0.08478820888493846,
                0.5405151764527104,
                0.1671037890999773,
                -0.39956038978692116,
                0.19299957786152316,
                0.33738462246709244,
            ],
            [1.997454732397304, 4.966310265004516, 0.1999999999999943, 0.0, 0.34999999999999354],
            [
                0.0,
                0.687480335813787,
                0.541247555573648,
                0.09606320736763282,
                0.045187173667902245,
                0.00032829493198348325,
            ],
            [
                1.1,
                -2.3402579384542608,
                1.997454732397304,
                0.4211850643259299,
                -0.5300727224652266,
                0.20953245674856905,
                0.5249999999999904,
            ],
        ),
    ] {
        sim.run_until(Seconds { num: half, den: 2 }).unwrap();
        agree(&sim, &MOTION, &motion, 1e-6);
        agree(&sim, &ACTIVATIONS, &activations, 1e-9);
        agree(&sim, &LENGTHS, &lengths, 1e-6);
        agree(&sim, &FORCES, &forces, 1e-6);
    }
    // A `timeconst` is a lag: the activation is 0.6 (1 − exp(−t / 0.3 s)). MuJoCo's RK4 has an error of 2e-4 here, and
    // in its stages activations pass their bounds.
    let mut sim = simulation(ARM, RK4).unwrap_or_else(|e| panic!("{e}"));
    sim.set("soft.control", 0.6).unwrap();
    sim.set("drift.control", 0.9).unwrap();
    sim.set("sum.control", -4.0).unwrap();
    sim.run_until(Seconds { num: 1, den: 2 }).unwrap();
    agree(&sim, &["soft.state.activation"], &[0.6 * (1.0 - (-0.5_f64 / 0.3).exp())], 1e-12);
    // The bounds are 0.25 and −1; a step may pass them by its length times the rate.
    agree(&sim, &["drift.state.activation", "sum.state.activation"], &[0.25, -1.0], 2.1e-3);
    let pull = 1.5 * (0.25 - one(&sim, "link.angle")) - 0.1 * one(&sim, "link.rate");
    agree(&sim, &["drift.force", "sum.force"], &[pull, -1.5], 1e-12);
}

/// What a tool on a locked hinge, a link and a base feel from their parents, at the start and in motion. MuJoCo leaves the wrenches of actuators on
/// sites out of these loads, so the arm has none here.
#[test]
fn loads_of_hinges_are_those_of_mujoco() {
    let plain: Vec<&str> =
        ARM.lines().filter(|l| !l.contains("site=\"") || !l.contains("gear=")).collect();
    let mut sim = simulation(&plain.join("\n"), RK4).unwrap_or_else(|e| panic!("{e}"));
    assert!(sim.get("hold.force").is_err());
    for (name, x) in [("ram", 5.0), ("drift", 0.2), ("soft", 0.0), ("sum", 0.35)] {
        sim.set(&format!("{name}.control"), x).unwrap();
    }
    let (at_rest, moving) = (
        [
            0.28792830338221687,
            -0.3990949587269909,
            -1.4650354790616353,
            0.03885292365370407,
            0.06061229382095129,
            -0.005720889702690839,
            -0.6054376770207197,
            0.6055339925795004,
            1.461821218271529,
            -0.1998444001126116,
            0.9689033006548028,
            -0.4723745919846935,
            4.661612835617291,
            0.35773353222488846,
            15.662060133920594,
            -0.7660874029773341,
            0.7867272882995816,
            0.1777074083054378,
        ],
        [
            -4.245915165633167,
            0.5026873844290666,
            0.7081922559169318,
            -0.015192818641639794,
            -0.11285642365862616,
            -0.06330977384165516,
            -9.080770498560906,
            2.537315432435367,
            8.416961288894997,
            -0.15111733589957088,
            0.9655678592903306,
            -0.5858240968363597,
            8.668859532730929,
            -1.311901443340339,
            25.748118222640834,
            -0.384549402523061,
            -3.0097167554123074,
            -0.6710007710189786,
        ],
    );
    agree(&sim, &LOADS, &at_rest, 1e-9);
    sim.run_until(Seconds { num: 1, den: 2 }).unwrap();
    agree(&sim, &LOADS, &moving, 1e-5);
}

/// A ball slides without friction down a field that is a tilted plane, turned by 30° about z: its acceleration is the part of gravity along the
/// plane. The rows of `elevation` begin at the largest y.
#[test]
fn a_ball_slides_down_a_height_field_as_on_its_plane() {
    // The heights are z = 0.1 x + 0.2 y over x = −4 … 4 m, y = −3 … 3 m, from 0 m to 2 m.
    let (columns, rows) = (5, 4);
    let heights: Vec<String> = (0..rows)
        .rev()
        .flat_map(|j| {
            (0..columns).map(move |i| format!("{}", 0.2 * f64::from(i) + 0.4 * f64::from(j)))
        })
        .collect();
    // The ball touches the middle of the field, where z is 1 m above the frame of the geom.
    let length = (0.1_f64 * 0.1 + 0.2 * 0.2 + 1.0).sqrt();
    let n = [-0.1, -0.2, 1.0].map(|x| x / length);
    let start = [0.2 * n[0], 0.2 * n[1], 1.0 + 0.2 * n[2]];
    let [x, y, z] = turned(start);
    let text = format!(
        r#"<mujoco><asset><hfield name="hill" nrow="{rows}" ncol="{columns}" size="4 3 2 0.1" elevation="{}"/></asset>
        <default><geom condim="1"/></default>
        <worldbody><geom name="hill" type="hfield" hfield="hill" euler="0 0 30"/>
        <body name="ball" pos="{x} {y} {z}"><freejoint/><geom size="0.2" mass="1"/></body></worldbody></mujoco>"#,
        heights.join(" "),
    );
    let mut sim =
        simulation(&text, r#"step: "1 ms", contact: (),"#).unwrap_or_else(|e| panic!("{e}"));
    sim.run_until(Seconds { num: 3, den: 5 }).unwrap();
    let names = ["ball.position.x", "ball.position.y", "ball.position.z"];
    let found = names.map(|name| one(&sim, name));
    // The acceleration is a = g − (g · n) n.
    let a = [9.81 * n[2] * n[0], 9.81 * n[2] * n[1], 9.81 * (n[2] * n[2] - 1.0)];
    let want = turned(std::array::from_fn(|k| start[k] + 0.5 * a[k] * 0.36));
    for (own, want) in found.iter().zip(want) {
        assert!((own - want).abs() < 2e-3, "{found:?} {want}");
    }
    // The ball has moved by 0.39 m.
    assert!((found[0] - x).hypot(found[1] - y) > 0.3, "{found:?}");
}

/// Turns a vector by 30° about z.
fn turned([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (s, c) = 30f64.to_radians().sin_cos();
    [c * x - s * y, s * x + c * y, z]
}
