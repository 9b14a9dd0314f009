//! Sensors of an MJCF file for bodies together, relative frames, ball joints and the world, compared with MuJoCo 4.0 (RK4, 0.5 ms).
use crate::common::in_folder;
use linkwork_runtime::{Seconds, Simulation};

const ROBOT: &str = r#"<mujoco><compiler angle="radian"/>
<worldbody><site name="dock" pos="0.3 -0.2 0.5" euler="0.3 0.2 -0.1"/><geom name="rock" type="box" size="0.1 0.2 0.1" pos="1 0.5 0.2" euler="0.1 0.4 0" contype="0" conaffinity="0"/>
 <body name="base" pos="0 0 1" euler="0.1 0 0.2"><joint name="rail" type="slide" axis="1 0.2 0" damping="0.3"/><geom type="box" size="0.1 0.08 0.05" mass="1.5" pos="0.03 0 0.02" contype="0" conaffinity="0"/><site name="hub" pos="0.02 0.05 0.1" euler="0.1 -0.3 0.2"/>
  <body name="arm" pos="0.1 0.05 0.1" euler="0.2 0 0.3"><joint name="shoulder" type="ball" pos="0.02 0.01 0" damping="0.05"/><geom name="tube" type="capsule" size="0.03" fromto="0 0 0 0.4 0.1 0" mass="0.8" contype="0" conaffinity="0"/>
   <body name="tool" pos="0.4 0.02 0" euler="0 0.3 0"><joint name="wrist" axis="0 1 0.3" damping="0.02" stiffness="0.5" springref="0.4"/><geom type="box" size="0.05 0.03 0.1" pos="0.02 0 -0.08" mass="0.4" contype="0" conaffinity="0"/><site name="grip" pos="0.01 0.02 -0.1" euler="0.2 0.5 0"/></body></body></body>
 <body name="other" pos="-1 0 2"><joint name="spin" axis="0.3 0.2 1" stiffness="2" springref="1"/><geom type="box" size="0.2 0.1 0.05" pos="0.1 0.1 0" mass="0.6" contype="0" conaffinity="0"/></body>
</worldbody>
<sensor>
 <subtreecom name="c" body="arm"/><subtreelinvel name="cv" body="arm"/><subtreeangmom name="ch" body="arm"/><subtreecom name="all" body="world"/><subtreelinvel name="allv" body="world"/><subtreeangmom name="allh" body="base"/>
 <framepos name="p" objtype="site" objname="grip" reftype="site" refname="hub"/><framequat name="r" objtype="site" objname="grip" reftype="xbody" refname="other"/><framexaxis name="x" objtype="xbody" objname="tool" reftype="site" refname="dock"/><frameyaxis name="y" objtype="geom" objname="tube" reftype="xbody" refname="base"/><framezaxis name="z" objtype="geom" objname="tube"/>
 <framelinvel name="v" objtype="site" objname="grip" reftype="xbody" refname="other"/><frameangvel name="w" objtype="body" objname="tool" reftype="geom" refname="tube"/><framelinvel name="vc" objtype="body" objname="tool"/><framepos name="to" objtype="geom" objname="rock" reftype="site" refname="grip"/><framelinvel name="vto" objtype="geom" objname="rock" reftype="site" refname="grip"/>
 <ballquat name="q" joint="shoulder"/><ballangvel name="qv" joint="shoulder"/><framelinacc name="a" objtype="body" objname="arm"/><gyro name="still" site="dock"/>
</sensor></mujoco>"#;

/// Variable, and MuJoCo's readings at 0.5 s and 1 s; quaternions are x, y, z, w.
const WANT: &[(&str, [&[f64]; 2])] = &[
    (
        "c.centre",
        [
            &[0.0806090908035, 0.025066363123, 0.938104485659],
            &[0.0615159324702, 0.0332710342937, 0.845477249872],
        ],
    ),
    (
        "cv.velocity",
        [
            &[-0.341586798095, -0.454176894666, 0.784117487544],
            &[-0.0170395963764, 0.617595597514, 0.112726182588],
        ],
    ),
    (
        "ch.angular_momentum",
        [
            &[-0.0961431454592, 0.0929474824133, 0.00216420188799],
            &[0.115106289954, -0.106904686897, 0.0391085063416],
        ],
    ),
    (
        "all.centre",
        [
            &[-0.0738958659425, 0.0598638931385, 1.17311852032],
            &[-0.204910745882, 0.0147565410013, 1.14228796228],
        ],
    ),
    (
        "allv.velocity",
        [
            &[0.0695056476509, -0.21677566997, 0.237118314483],
            &[-0.246939331529, 0.18009209135, -0.0280005300884],
        ],
    ),
    (
        "allh.angular_momentum",
        [
            &[-0.139601002001, 0.153049086411, 0.0180707399602],
            &[0.229238504568, -0.206117373892, 0.0858184182156],
        ],
    ),
    (
        "p.position",
        [
            &[-0.276486332632, -0.112884222851, -0.125697820615],
            &[-0.0152199499822, -0.123565172372, -0.451418579895],
        ],
    ),
    (
        "r.attitude",
        [
            &[-0.0374353856197, 0.946619844766, -0.256133739068, 0.192106660762],
            &[0.117575355977, 0.324243174895, -0.702603206976, 0.622407529476],
        ],
    ),
    (
        "x.x_axis",
        [
            &[-0.272188067577, -0.763009956248, -0.586284455307],
            &[0.92138053236, -0.208939702197, -0.327722619656],
        ],
    ),
    (
        "y.y_axis",
        [
            &[-0.0653555678394, 0.97129806747, -0.228710983301],
            &[0.137287063452, 0.989458389285, 0.0460907591769],
        ],
    ),
    (
        "z.z_axis",
        [
            &[0.573047706469, 0.262445200678, 0.77636257171],
            &[-0.2466438324, -0.156321717104, 0.956415359925],
        ],
    ),
    (
        "v.velocity",
        [
            &[3.69043529197, 9.48078983068, -1.47624989333],
            &[10.0581465834, 1.24183894521, -2.88563631454],
        ],
    ),
    (
        "w.angular_velocity",
        [
            &[0.309216431427, 6.38116777153, -2.11804499167],
            &[-0.0743881846818, -1.53511727848, 0.509537999899],
        ],
    ),
    (
        "vc.velocity",
        [
            &[-0.448685154982, -0.46808773017, 1.6087046738],
            &[0.633106626281, 1.19640493948, -0.00590661713051],
        ],
    ),
    (
        "to.position",
        [
            &[-0.891142852253, 0.223747667323, 1.00109997505],
            &[0.703491129871, 0.605242638122, 0.690882282112],
        ],
    ),
    (
        "vto.velocity",
        [
            &[-10.0490355111, 1.73160017576, -7.73536928724],
            &[5.17302285658, -3.39338131663, -4.12601305453],
        ],
    ),
    (
        "q.attitude",
        [
            &[-0.145583361217, 0.90410307597, -0.173818909489, 0.3622017389],
            &[-0.0984971761015, 0.613237162196, -0.236458425222, 0.747212086588],
        ],
    ),
    (
        "qv.rate",
        [
            &[1.27708137965, 3.56108887011, -1.45690844805],
            &[-0.751091139083, -3.66341664533, 2.76447016612],
        ],
    ),
    (
        "a.world_force",
        [
            &[0.258069520501, 0.331414504576, 9.45025397979],
            &[-0.470362858625, -0.236488677916, 13.0935230039],
        ],
    ),
    ("still.rate", [&[0.0, 0.0, 0.0], &[0.0, 0.0, 0.0]]),
];

fn simulation() -> Simulation {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("robot.xml"), ROBOT).unwrap();
    let sim = r#"Simulation(import: (file: "robot.xml"), parts: { "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }) },
        step: "0.5 ms", integrator: "rk4", until: "1 s")"#;
    let file = dir.path().join("sim.ron");
    std::fs::write(&file, sim).unwrap();
    in_folder(&file).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn readings_of_bodies_and_relative_frames_are_those_of_mujoco() {
    let mut sim = simulation();
    for half in 0..2 {
        sim.run_until(Seconds { num: half as u64 + 1, den: 2 }).unwrap();
        for (variable, want) in WANT {
            let want = want[half];
            let axes = ["x", "y", "z", "w"];
            let one = |c: &str| {
                let name = format!("{variable}.{c}");
                sim.get(&name).unwrap_or_else(|e| panic!("{name}: {e}"))
            };
            let mut found: Vec<f64> = axes[..want.len()].iter().map(|c| one(c)).collect();
            // A quaternion and its negative are the same attitude.
            let product: f64 = found.iter().zip(want).map(|(x, y)| x * y).sum();
            if want.len() == 4 && product < 0.0 {
                found.iter_mut().for_each(|x| *x = -*x);
            }
            for (x, y) in found.iter().zip(want) {
                assert!((x - y).abs() < 1e-7 * y.abs().max(1.0), "{variable}: {found:?} {want:?}");
            }
        }
    }
}
