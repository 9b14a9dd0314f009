//! Actuators, tendons, sensors and `gravcomp` of an MJCF file as parts, compared with simulations of MuJoCo 4.0 (RK4, 0.5 ms).
use crate::common::in_folder;
use linkwork_runtime::{Seconds, Simulation};

const ARM: &str = r#"<mujoco><compiler angle="radian"/>
<default><joint damping="0.05"/><position kp="8" ctrlrange="-0.6 0.6"/><default class="soft"><general gear="2" forcerange="-1.5 1.5"/></default></default>
<worldbody>
 <body name="upper" pos="0 0 1"><joint name="shoulder" axis="0 1 0" range="-3 3" springref="0.2"/><geom type="capsule" size="0.03" fromto="0 0 0 0.4 0 0" density="900" contype="0" conaffinity="0"/>
  <body name="lower" pos="0.4 0 0" gravcomp="0.6"><joint name="elbow" axis="0 1 0" ref="0.1"/><geom type="box" size="0.15 0.02 0.03" pos="0.15 0 0" mass="0.5" contype="0" conaffinity="0"/>
   <site name="imu" pos="0.3 0.01 0" euler="0.2 0 0.1"/>
   <body name="tip" pos="0.3 0 0"><joint name="slider" type="slide" axis="1 0 0" actuatorfrcrange="-0.8 0.8"/><geom size="0.04" mass="0.2" contype="0" conaffinity="0"/></body></body></body>
</worldbody>
<tendon><fixed name="belt" stiffness="6" damping="0.3" springlength="-0.05 0.02"><joint joint="shoulder" coef="0.7"/><joint joint="elbow" coef="-1.2"/></fixed>
 <fixed name="rest" stiffness="3"><joint joint="shoulder" coef="1"/></fixed></tendon>
<actuator>
 <motor name="push" joint="shoulder" gear="1.5" ctrlrange="-2 2"/>
 <position name="hold" joint="elbow" dampratio="0.5"/>
 <velocity name="pull" tendon="belt" kv="0.4" class="soft"/>
 <general name="spring" joint="slider" gainprm="4" biastype="affine" biasprm="0.1 -40 -1.5"/>
 <damper name="brake" joint="shoulder" kv="0.2" ctrlrange="0 1"/>
</actuator>
<sensor><jointpos name="q" joint="elbow"/><jointvel name="v" joint="elbow"/><gyro name="w" site="imu"/><accelerometer name="a" site="imu"/><velocimeter name="vel" site="imu"/><framepos name="at" objtype="xbody" objname="tip"/><tendonpos name="L" tendon="belt"/><actuatorfrc name="F" actuator="pull"/></sensor>
</mujoco>"#;

/// The file in a simulation with gravity; `more` are fields of the import.
fn arm(text: &str, more: &str) -> Result<Simulation, String> {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("arm.xml"), text).unwrap();
    let sim = format!(
        r#"Simulation(import: (file: "arm.xml"{more}), parts: {{ "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}) }},
            step: "0.5 ms", integrator: "rk4", until: "1 s")"#
    );
    let file = dir.path().join("sim.ron");
    std::fs::write(&file, sim).unwrap();
    in_folder(&file)
}

/// Controls, and MuJoCo's results at 0.5 s and 1 s: coordinates, rates, gyro, accelerometer, velocimeter, position of the tip, length of the belt,
/// force of `pull`.
#[test]
fn an_arm_with_actuators_and_tendons_moves_as_in_mujoco() {
    let mut sim = arm(ARM, "").unwrap_or_else(|e| panic!("{e}"));
    for (name, x) in [("push", 1.2), ("hold", 0.9), ("pull", 0.5), ("spring", 3.0), ("brake", 0.7)]
    {
        sim.set(&format!("{name}.control"), x).unwrap();
    }
    let want: [[f64; 20]; 2] = [
        [
            1.16711890001,
            0.614519285003,
            1.517296508484,
            1.168751588732,
            0.318043254492,
            7.067062793343,
            0.14547305514,
            1.449878213749,
            -0.295380536533,
            -12.287249327955,
            2.062414651782,
            4.071989259836,
            0.211996886143,
            -0.191588742283,
            -0.836008058036,
            -0.043899176981,
            0.0,
            -1.173993440582,
            0.079560088003,
            -0.149179365377,
        ],
        [
            1.321329233983,
            0.67809393031,
            5.757345824207,
            -0.010863868166,
            0.016476124813,
            9.41369823043,
            5.491222439171e-04,
            5.472906150024e-03,
            -1.114983272152e-03,
            -9.373334956031,
            3.682306247940e-01,
            -2.808844895882,
            -2.323878580949e-03,
            6.236627304315e-04,
            1.916758955344e-03,
            -1.856214887882,
            0.0,
            -5.120813185813,
            1.112177474164e-01,
            2.219008459932e-01,
        ],
    ];
    for (k, want) in want.iter().enumerate() {
        sim.run_until(Seconds { num: k as u64 + 1, den: 2 }).unwrap();
        let one = |name: &str| sim.get(name).unwrap_or_else(|e| panic!("{name}: {e}"));
        let three = |name: &str| ["x", "y", "z"].map(|c| one(&format!("{name}.{c}")));
        let mut found = vec![one("upper.angle"), one("q.angle"), one("tip.displacement")];
        found.extend([one("upper.rate"), one("v.rate"), one("tip.speed")]);
        found.extend(three("w.rate"));
        found.extend(three("a.force"));
        found.extend(three("vel.body_velocity"));
        found.extend(three("at.position"));
        found.extend([one("belt.length"), one("pull.force")]);
        for (i, (x, y)) in found.iter().zip(want).enumerate() {
            assert!((x - y).abs() < 1e-8, "{i} at {k}: {x} {y}\n{found:?}");
        }
    }
}

const FRAMES: &str = r#"<mujoco><compiler angle="radian"/>
<worldbody><body name="upper" pos="0 0 1"><joint name="yaw" axis="0.2 0.1 1" damping="0.05"/><geom type="capsule" size="0.03" fromto="0 0 0 0.4 0 0.1" density="900" contype="0" conaffinity="0"/>
<body name="lower" pos="0.4 0 0.1" euler="0.3 0 0.2"><joint name="pitch" axis="0 1 0"/><geom type="box" size="0.15 0.02 0.03" pos="0.15 0 0" mass="0.5" contype="0" conaffinity="0"/><site name="tip" pos="0.3 0.01 0" euler="0.2 0 0.1"/></body></body></worldbody>
<sensor><frameangvel name="w" objtype="site" objname="tip"/><framexaxis name="x" objtype="site" objname="tip"/><frameyaxis name="y" objtype="xbody" objname="lower"/><framezaxis name="z" objtype="site" objname="tip"/><framelinacc name="a" objtype="site" objname="tip"/><frameangacc name="e" objtype="xbody" objname="lower"/></sensor></mujoco>"#;

/// MuJoCo's readings of frames in world axes at 0.5 s and 1 s: angular velocity, axes, and the accelerations, of which the linear one has gravity in it.
#[test]
fn frames_read_in_world_axes_as_in_mujoco() {
    let mut sim = arm(FRAMES, "").unwrap_or_else(|e| panic!("{e}"));
    let want: [[f64; 18]; 2] = [
        [
            -7.745283731252e-01,
            1.720052575638e+00,
            2.519954903180e+00,
            -8.736588182208e-01,
            -4.851005263598e-01,
            -3.738647710819e-02,
            -5.441800286603e-01,
            7.492743386927e-01,
            3.774335196877e-01,
            -6.068151690094e-02,
            1.848828956598e-01,
            -9.808853492631e-01,
            -7.858047361869e-01,
            5.152717036268e+00,
            -3.091934589060e+00,
            2.207517461060e+01,
            -3.739700921201e+01,
            -2.016072456255e+01,
        ],
        [
            3.243587563347e+00,
            -1.610465327590e+00,
            -1.462275450115e+00,
            3.295654783746e-01,
            9.420207756172e-01,
            -6.311460820841e-02,
            -7.874906309280e-01,
            4.101885199908e-01,
            4.600042220114e-01,
            6.165792854114e-01,
            -1.641208292582e-01,
            7.699963235011e-01,
            -5.702279083660e+00,
            -4.879813683154e+00,
            -2.532931280987e+00,
            -3.787719404813e+01,
            2.037104226905e+01,
            1.661122289585e+01,
        ],
    ];
    let names = [
        "w.angular_velocity",
        "x.x_axis",
        "y.y_axis",
        "z.z_axis",
        "a.world_force",
        "e.angular_acceleration",
    ];
    for (k, want) in want.iter().enumerate() {
        sim.run_until(Seconds { num: k as u64 + 1, den: 2 }).unwrap();
        let lanes = names.iter().flat_map(|n| ["x", "y", "z"].map(|c| format!("{n}.{c}")));
        for (name, y) in lanes.zip(want) {
            let x = sim.get(&name).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert!((x - y).abs() < 1e-7 * y.abs().max(1.0), "{name} at {k}: {x} {y}");
        }
    }
}

const ROPES: &str = r#"<mujoco>
<worldbody><site name="wall" pos="0.5 0.1 1.4"/>
 <body name="upper" pos="0 0 1"><joint name="a" axis="0 1 0" damping="0.1"/><geom type="capsule" size="0.03" fromto="0 0 0 0.4 0 0" density="900" contype="0" conaffinity="0"/><site name="via" pos="0.3 0.02 0.05"/>
  <body name="lower" pos="0.4 0 0"><joint name="b" axis="0 1 0.2" damping="0.05" springref="20"/><geom type="box" size="0.15 0.02 0.03" pos="0.15 0 0" mass="0.5" contype="0" conaffinity="0"/><site name="end" pos="0.25 0 -0.04"/></body></body>
 <body name="ball" pos="0 1 1"><freejoint/><geom size="0.1" mass="0.8" contype="0" conaffinity="0"/><site name="hook" pos="0.05 0 0.08"/></body>
</worldbody>
<tendon><spatial name="rope" stiffness="20" damping="0.8"><site site="wall"/><site site="via"/><site site="end"/></spatial>
<spatial name="string" stiffness="30" damping="0.5" springlength="0 0.5"><site site="hook"/><site site="end"/></spatial></tendon>
<actuator><motor name="winch" tendon="rope" gear="-2"/><position name="ratio" tendon="string" kp="3" dampratio="0.6"/></actuator>
</mujoco>"#;

/// A rope from the wall over a site to the end of an arm, and a string from there to a free ball: coordinates, lengths and forces.
#[test]
fn ropes_over_sites_pull_as_in_mujoco() {
    let mut sim = arm(ROPES, "").unwrap_or_else(|e| panic!("{e}"));
    for (name, x) in [("winch", 1.5), ("ratio", 0.4)] {
        sim.set(&format!("{name}.control"), x).unwrap();
    }
    let want: [[f64; 9]; 2] = [
        [
            0.42895575069279257,
            1.5959211324698261,
            0.2723643154693054,
            0.5570213738789417,
            0.655137733440622,
            0.8293123612869846,
            0.5372237538808454,
            1.5,
            1.6325472233398175,
        ],
        [
            1.655816020564053,
            -0.08657683867832147,
            0.5572995895426837,
            -0.09194063106534783,
            -0.2527501364193854,
            1.2125926224384047,
            0.8131255030687133,
            1.5,
            -2.7746634859183543,
        ],
    ];
    for (k, want) in want.iter().enumerate() {
        sim.run_until(Seconds { num: k as u64 + 1, den: 4 }).unwrap();
        let names = [
            "upper.angle",
            "lower.angle",
            "ball.position.x",
            "ball.position.y",
            "ball.position.z",
            "rope.length",
            "string.length",
            "winch.force",
            "ratio.force",
        ];
        let found = names.map(|name| sim.get(name).unwrap_or_else(|e| panic!("{name}: {e}")));
        for ((name, x), y) in names.iter().zip(&found).zip(want) {
            assert!((x - y).abs() < 1e-7, "{name} at {k}: {x} {y}\n{found:?}");
        }
    }
}

#[test]
fn devices_can_be_left_out_and_exports_carry_the_names_of_sensors() {
    let sim = arm(ARM, "").unwrap_or_else(|e| panic!("{e}"));
    assert!(sim.get("pull.force").is_ok() && sim.get("belt.length").is_ok());
    let sim = arm(ARM, ", leave_out: [\"actuators\", \"tendons\", \"sensors\"]")
        .unwrap_or_else(|e| panic!("{e}"));
    for name in ["pull.force", "belt.length", "w.rate.x"] {
        assert!(sim.get(name).is_err(), "{name}");
    }
}
