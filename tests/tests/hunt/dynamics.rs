//! Dynamics and contact. The log is `tests/hunt/dynamics.md`.
use super::{Case, hold};

const CASES: &[Case] = &[
    Case {
        report: "rapier #137, cannon.js #148: friction depends on the direction of sliding",
        text: r#"bodies: {
            "floor": (parent: "world", shapes: [(shape: Box([20, 20, 0.2]), collide: true, at: (position: [0, 0, -0.1]))]),
            "box": (parent: "world", hinge: Free, mass: 2, inertia: Box([0.2, 0.2, 0.2]), shapes: [(shape: Box([0.2, 0.2, 0.2]), collide: true)],
                initial: (position: [0, 0, 0.1], velocity: [2.4, 1.8, 0])),
        },
        parts: { EARTH }, contact: (friction: 0.5), step: "1 ms", until: "2 s",
        metrics: { "x": (of: "box.position.x"), "y": (of: "box.position.y") }"#,
        want: &[("x", 0.733_945, 3e-3), ("y", 0.550_459, 3e-3)],
    },
    Case {
        report: "reactphysics3d #85: a box that slides along x drifts to the side",
        text: r#"bodies: {
            "floor": (parent: "world", shapes: [(shape: Box([20, 20, 0.2]), collide: true, at: (position: [0, 0, -0.1]))]),
            "box": (parent: "world", hinge: Free, mass: 2, inertia: Box([0.4, 0.2, 0.2]), shapes: [(shape: Box([0.4, 0.2, 0.2]), collide: true)],
                initial: (position: [0, 0, 0.1], velocity: [3, 0, 0])),
        },
        parts: { EARTH }, contact: (friction: 0.2), step: "1 ms", until: "2 s",
        metrics: { "x": (of: "box.position.x"), "y": (of: "box.position.y", take: "max_abs"), "turn": (of: "box.rotation.z", take: "max_abs") }"#,
        want: &[("x", 2.293_578, 4e-3), ("y", 0.0, 1e-5), ("turn", 0.0, 1e-5)],
    },
    Case {
        report: "newton #1138, matter-js #613: boxes creep down slopes that friction should hold",
        text: r#"bodies: {
            "slope": (parent: "world", at: (rotation: (rpy: [0, "20 deg", 0])), shapes: [
                (shape: Box([20, 4, 0.2]), collide: true, at: (position: [0, 0, -0.1]), name: "box"),
                (shape: Box([20, 4, 0.2]), collide: (shape: Mesh(vertices: [[-10, -2, 0], [10, -2, 0], [10, 2, 0], [-10, 2, 0]], triangles: [[0, 1, 2], [0, 2, 3]])), at: (position: [0, 6, 0]), visible: false, name: "mesh")]),
            "a": (parent: "world", hinge: Free, mass: 2, inertia: Box([0.2, 0.2, 0.2]), shapes: [(shape: Box([0.2, 0.2, 0.2]), collide: true)],
                initial: (position: [0.034202, 0, 0.093969], rotation: (rpy: [0, "20 deg", 0]))),
            "b": (parent: "world", hinge: Free, mass: 2, inertia: Box([0.2, 0.2, 0.2]), shapes: [(shape: Box([0.2, 0.2, 0.2]), collide: true)],
                initial: (position: [0.034202, 6, 0.093969], rotation: (rpy: [0, "20 deg", 0]))),
        },
        parts: { EARTH }, contact: (friction: 1), step: "2 ms", until: "20 s",
        metrics: { "a": (of: "a.position.x"), "b": (of: "b.position.x"), "aside": (of: "a.position.y"), "bside": (of: "b.position.y") }"#,
        want: &[
            ("a", 0.034_202, 2e-4),
            ("b", 0.034_202, 2e-4),
            ("aside", 0.0, 1e-5),
            ("bside", 6.0, 1e-5),
        ],
    },
    Case {
        report: "gazebo-classic #989, #1000: boxes of different friction slide alike",
        text: r#"bodies: {
            "slope": (parent: "world", at: (rotation: (rpy: [0, "20 deg", 0])), shapes: [(shape: Box([40, 40, 0.2]), collide: (friction: 1), at: (position: [0, 0, -0.1]), name: "box")]),
            "a": (parent: "world", hinge: Free, mass: 2, inertia: Box([0.2, 0.2, 0.2]), shapes: [(shape: Box([0.2, 0.2, 0.2]), collide: (friction: 0.01))],
                initial: (position: [0.034202, -2, 0.093969], rotation: (rpy: [0, "20 deg", 0]))),
            "b": (parent: "world", hinge: Free, mass: 2, inertia: Box([0.2, 0.2, 0.2]), shapes: [(shape: Box([0.2, 0.2, 0.2]), collide: (friction: 0.04))],
                initial: (position: [0.034202, 0, 0.093969], rotation: (rpy: [0, "20 deg", 0]))),
            "c": (parent: "world", hinge: Free, mass: 2, inertia: Box([0.2, 0.2, 0.2]), shapes: [(shape: Box([0.2, 0.2, 0.2]), collide: (friction: 0.25))],
                initial: (position: [0.034202, 2, 0.093969], rotation: (rpy: [0, "20 deg", 0]))),
        },
        parts: { EARTH }, contact: (), step: "1 ms", until: "1 s",
        metrics: { "a": (of: "a.position.x"), "b": (of: "b.position.x"), "c": (of: "c.position.x") }"#,
        // The positions are 0.034202 + g (sin 20 - mu cos 20) t^2 / 2 cos 20 with mu = 0.1, 0.2 and
        // 0.5.
        want: &[("a", 1.177_56, 3e-3), ("b", 0.744_44, 3e-3), ("c", 0.034_202, 2e-4)],
    },
    Case {
        report: "drake PR 18039, PR 18019: a screw joint that falls",
        text: r#"bodies: { "nut": (parent: "world", hinge: Screw(axis: [0, 0, 1], pitch: "0.1 m/rev"), mass: 2, inertia: [0.01, 0.01, 0.003]) },
        parts: { EARTH, "M": (model: "sensors.motion", bind: { "mount": "node:nut" }) }, step: "1 ms", until: "1 s",
        metrics: { "z": (of: "M.position.z"), "rate": (of: "nut.rate") }"#,
        // The acceleration is z'' = -m g / (m + I (2 pi / p)^2).
        want: &[("z", -0.708_634_53, 1e-7), ("rate", -89.049_641, 1e-4)],
    },
    Case {
        report: "drake PR 8194, curobo PR 724: Coriolis term of a slider on an arm that rotates",
        text: r#"bodies: {
            "arm": (parent: "world", hinge: Pin(axis: [0, 0, 1], prescribed: true), initial: (rate: 2)),
            "bead": (parent: "arm", hinge: Slider([1, 0, 0]), mass: 3, inertia: [1e-3, 1e-3, 1e-3], initial: (position: 0.1)),
        },
        parts: { "T": (model: "basics.hinge_trajectory", params: { "profile": [[0, 2], [10, 2]], "gives": rate }, bind: { "hinge": "hinge:arm" }) },
        gravity: "none", step: "1 ms", until: "1 s",
        metrics: { "r": (of: "bead.displacement") }"#,
        want: &[("r", 0.376_219_6, 1e-7)],
    },
    Case {
        report: "idyntree #1279: bias acceleration of a spherical joint (a conical pendulum keeps its height)",
        text: r#"bodies: {
            "bob": (parent: "world", hinge: Ball, mass: 1, com: [0, 0, -1], inertia: [1e-9, 1e-9, 1e-9], inertia_check: PositiveMoments,
                initial: (rotation: (rpy: [0, "30 deg", 0]), angular: [-1.682825918, 0, 2.914739990]), nodes: { "end": (position: [0, 0, -1]) }),
        },
        parts: { EARTH, "M": (model: "sensors.motion", bind: { "mount": "node:bob/end" }) }, step: "1 ms", until: "5 s",
        metrics: { "low": (of: "M.position.z", take: "min"), "high": (of: "M.position.z", take: "max"), "x": (of: "M.position.x") }"#,
        // The rate is w = sqrt(g / (l cos 30)) = 3.3656518 rad/s, and x = -sin 30 cos(5 w).
        want: &[("low", -0.866_025_4, 1e-6), ("high", -0.866_025_4, 1e-6), ("x", 0.217_708, 1e-6)],
    },
    Case {
        report: "drake PR 4965: free symmetric body, closed form",
        text: r#"bodies: { "top": (parent: "world", hinge: Free, mass: 1, inertia: [0.04, 0.04, 0.06], initial: (angular: [1, 0, 3])) },
        gravity: "none", step: "1 ms", until: "4 s",
        metrics: { "x": (of: "top.angular.x"), "y": (of: "top.angular.y"), "z": (of: "top.angular.z") }"#,
        // The transverse rate rotates at (I_z - I_x) / I_x w_z = 1.5 rad/s.
        want: &[("x", 0.960_170_286_65, 1e-9), ("y", -0.279_415_498_2, 1e-9), ("z", 3.0, 1e-12)],
    },
    Case {
        report: "box3d #83: a box with restitution 1 on a smaller box bounces higher than it fell",
        text: r#"bodies: {
            "floor": (parent: "world", shapes: [(shape: Box([0.75, 0.75, 1]), collide: true, at: (position: [0, 0, -0.5]))]),
            "box": (parent: "world", hinge: Free, mass: 2, inertia: Box([1, 1, 1]), shapes: [(shape: Box([1, 1, 1]), collide: true)],
                initial: (position: [0, 0, 1.5])),
        },
        parts: { EARTH }, contact: (restitution: 1), step: "1 ms", until: "4 s",
        metrics: { "highest": (of: "box.position.z", take: "max"), "apex": (of: "box.position.z", at: "time >= 0.9030476 s"), "tilt": (of: "box.rotation.y", take: "max_abs") }"#,
        want: &[("highest", 1.5, 1e-3), ("apex", 1.5, 1e-3), ("tilt", 0.0, 1e-9)],
    },
    Case {
        report: "rapier #974: balls return too little of their height",
        text: r#"bodies: {
            "floor": (parent: "world", shapes: [(shape: Box([20, 20, 1]), collide: true, at: (position: [0, 0, -0.5]))]),
            "a": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: (restitution: 0.3))], initial: (position: [0, 0, 2.1])),
            "b": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: (restitution: 0.5))], initial: (position: [1, 0, 2.1])),
            "c": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: (restitution: 0.8))], initial: (position: [2, 0, 2.1])),
            "d": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: (restitution: 0.95))], initial: (position: [3, 0, 2.1])),
        },
        parts: { EARTH }, contact: (), step: "1 ms", until: "1.5 s",
        metrics: {
            "a": (of: "a.position.z", at: "time >= 0.830121 s"), "b": (of: "b.position.z", at: "time >= 0.957832 s"),
            "c": (of: "c.position.z", at: "time >= 1.149398 s"), "d": (of: "d.position.z", at: "time >= 1.245182 s") }"#,
        want: &[("a", 0.28, 2e-3), ("b", 0.6, 3e-3), ("c", 1.38, 5e-3), ("d", 1.905, 6e-3)],
    },
    Case {
        report: "PhysX #351: the last bounces of a ball are lost",
        text: r#"bodies: {
            "floor": (parent: "world", shapes: [(shape: Box([20, 20, 1]), collide: true, at: (position: [0, 0, -0.5]))]),
            "a": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: (restitution: 0.5))], initial: (position: [0, 0, 0.6])),
        },
        parts: { EARTH }, contact: (), step: "0.2 ms", until: "1.2 s",
        // h = 0.5 m, e = 0.5: apexes after T (1 + 2 e + ... + e^n), T = 0.319275 s, of heights h e^2n; rest after 3 T.
        metrics: {
            "first": (of: "a.position.z", at: "time >= 0.478913 s"), "second": (of: "a.position.z", at: "time >= 0.718370 s"),
            "third": (of: "a.position.z", at: "time >= 0.838098 s"), "fourth": (of: "a.position.z", at: "time >= 0.897962 s"),
            "rest": (of: "a.position.z"), "speed": (of: "a.velocity.z") }"#,
        want: &[
            ("first", 0.225, 1e-3),
            ("second", 0.131_25, 5e-4),
            ("third", 0.107_812_5, 3e-4),
            ("fourth", 0.101_953, 2e-4),
            ("rest", 0.1, 1.1e-4),
            ("speed", 0.0, 1e-4),
        ],
    },
    Case {
        report: "godot #21487: a pendulum that is struck turns at constant speed",
        text: r#"bodies: { "arm": (parent: "world", hinge: Pin([0, 1, 0]), mass: 2, com: [0, 0, -0.5], inertia: [0.1, 0.1, 0.1], initial: (rate: 3)) },
        parts: { EARTH }, step: "1 ms", until: "5 s",
        metrics: { "max": (of: "arm.angle", take: "max", unit: "deg"), "min": (of: "arm.angle", take: "min", unit: "deg") }"#,
        // The energy gives (I + m l^2) w^2 / 2 = m g l (1 - cos).
        want: &[("max", 43.550_229, 1e-3), ("min", -43.550_229, 1e-3)],
    },
    Case {
        report: "orocos_kinematics_dynamics PR 155, openrave PR 600, mujoco #1904: inertia of the rotor through the gear",
        text: r#"bodies: { "arm": (parent: "world", hinge: Pin([0, 1, 0]), armature: 1e-4, gear: 50, mass: 2, com: [0, 0, -0.5], inertia: [0.1, 0.1, 0.1], initial: (angle: 1e-3)) },
        parts: { EARTH }, step: "1 ms", until: "2 s",
        // T = 2 pi sqrt((I + m l^2 + n^2 J) / (m g l)) = 1.848967 s.
        metrics: { "half": (of: "arm.angle", take: "time_of_min"), "angle": (of: "arm.angle", take: "min") }"#,
        want: &[("half", 0.924_751_1, 1e-6), ("angle", -1e-3, 1e-9)],
    },
    Case {
        report: "mujoco #989: a small model is unstable",
        text: r#"bodies: { "arm": (parent: "world", hinge: Pin([0, 1, 0]), mass: 1e-6, com: [0, 0, -1e-3], inertia: [1e-13, 1e-13, 1e-13], initial: (angle: "1 mrad")) },
        parts: { EARTH }, step: "1 ms", until: "1 s",
        metrics: { "half": (of: "arm.angle", at: "time >= 0.0332699 s"), "max": (of: "arm.angle", take: "max_abs") }"#,
        want: &[("half", -1e-3, 1e-8), ("max", 1e-3, 1e-8)],
    },
    Case {
        report: "basilisk #1484: damping of a spherical pendulum does not take energy",
        text: r#"bodies: { "bob": (parent: "world", hinge: Ball, damping: 0.4, mass: 2, com: [0, 0, -0.5], inertia: [0.1, 0.1, 0.1], initial: (rotation: (axis: [0, 1, 0], angle: 1e-3))) },
        parts: { EARTH }, step: "1 ms", until: "4 s",
        metrics: { "y": (of: "bob.rotation.y", at: "time >= 2 s") }"#,
        // The body is a damped oscillator with I = 0.6, d = 0.4, k = 9.81; the quaternion has half
        // of the angle.
        want: &[("y", -3.160_037_6e-5, 1e-9)],
    },
    Case {
        report: "avian PR 745, PR 485: gyroscopic torque with products of inertia",
        text: r#"bodies: {
            "a": (parent: "world", hinge: Free, mass: 1, inertia: [0.1, 0.2, 0.25], initial: (rotation: (rpy: [0, 0, "30 deg"]), angular: [1, 2, 3]), nodes: { "p": (position: [1, 0, 0]) }),
            "b": (parent: "world", hinge: Free, mass: 1, inertia: [0.125, 0.175, 0.25, -0.043_301_270_189, 0, 0], initial: (angular: [-0.133_974_596_2, 2.232_050_807_6, 3]), nodes: { "p": (position: [0.866_025_403_784, 0.5, 0]) }),
        },
        parts: { "A": (model: "sensors.motion", bind: { "mount": "node:a/p" }), "B": (model: "sensors.motion", bind: { "mount": "node:b/p" }) },
        gravity: "none", step: "1 ms", until: "10 s",
        metrics: { "same": (when: "abs(A.position.x - B.position.x) + abs(A.position.y - B.position.y) + abs(A.position.z - B.position.z) < 1e-7 m") }"#,
        want: &[("same", 1.0, 0.0)],
    },
    Case {
        report: "GoblinPhysics PR 74: a ball that rolls bounces",
        text: r#"bodies: {
            "floor": (parent: "world", shapes: [(shape: Box([40, 40, 1]), collide: true, at: (position: [0, 0, -0.5]))]),
            "a": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: (restitution: 0.5))], initial: (position: [0, 0, 0.1], velocity: [2, 1, 0], rotation: (rpy: [0.3, 0.2, 0.1]))),
        },
        parts: { EARTH, "M": (model: "sensors.motion", bind: { "mount": "node:a" }) }, contact: (friction: 0.5), step: "1 ms", until: "5 s",
        metrics: { "height": (of: "a.position.z", take: "range"), "vx": (of: "M.velocity.x"), "vy": (of: "M.velocity.y") }"#,
        // The ball ends with 5/7 of its initial speed, for any friction.
        want: &[("height", 0.0, 1.1e-4), ("vx", 1.428_571, 2e-3), ("vy", 0.714_286, 1e-3)],
    },
    Case {
        report: "gazebo-classic #1107: strong damping of a light joint",
        text: r#"bodies: { "arm": (parent: "world", hinge: Pin([0, 0, 1]), damping: 100, mass: 0.01, inertia: [1e-3, 1e-3, 1e-3], initial: (rate: 10)) },
        gravity: "none", step: "1 ms", integrator: "rodas4p", until: "1 s",
        metrics: { "rate": (of: "arm.rate"), "angle": (of: "arm.angle") }"#,
        want: &[("rate", 0.0, 1e-9), ("angle", 1e-4, 1e-8)],
    },
    Case {
        report: "rapier #142, qu3e #58, p2.js #173: a box that slides over a seam between two floor boxes catches",
        text: r#"bodies: {
            "floor": (parent: "world", shapes: [
                (shape: Box([2, 2, 0.2]), collide: true, at: (position: [0, 0, -0.1]), name: "a"), (shape: Box([2, 2, 0.2]), collide: true, at: (position: [2, 0, -0.1]), name: "b"),
                (shape: Box([2, 2, 0.2]), collide: true, at: (position: [4, 0, -0.1]), name: "c"), (shape: Box([2, 2, 0.2]), collide: true, at: (position: [6, 0, -0.1]), name: "d")]),
            "box": (parent: "world", hinge: Free, mass: 2, inertia: Box([0.3, 0.2, 0.2]), shapes: [(shape: Box([0.3, 0.2, 0.2]), collide: true)],
                initial: (position: [0, 0, 0.1], velocity: [3, 0, 0])),
        },
        parts: { EARTH }, contact: (friction: 0), step: "1 ms", until: "1.9 s",
        metrics: { "x": (of: "box.position.x"), "speed": (of: "box.velocity.x", take: "min"), "height": (of: "box.position.z", take: "max"), "y": (of: "box.position.y") }"#,
        want: &[("x", 5.7, 1e-4), ("speed", 3.0, 1e-5), ("height", 0.1, 1e-4), ("y", 0.0, 1e-4)],
    },
    Case {
        report: "avian #612, bounce #13: a box that slides over a triangle mesh catches at internal edges",
        text: r#"bodies: {
            "floor": (parent: "world", shapes: [(shape: Mesh(vertices: [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [3, -1, 0], [3, 1, 0], [5, -1, 0], [5, 1, 0]], triangles: [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2], [4, 6, 7], [4, 7, 5]]), collide: true)]),
            "box": (parent: "world", hinge: Free, mass: 2, inertia: Box([0.3, 0.2, 0.2]), shapes: [(shape: Box([0.3, 0.2, 0.2]), collide: true)],
                initial: (position: [0, 0, 0.1], velocity: [3, 0.2, 0])),
        },
        parts: { EARTH }, contact: (friction: 0), step: "1 ms", until: "1.4 s",
        metrics: { "x": (of: "box.position.x"), "speed": (of: "box.velocity.x", take: "min"), "height": (of: "box.position.z", take: "max"), "y": (of: "box.position.y") }"#,
        want: &[("x", 4.2, 1e-3), ("speed", 3.0, 1e-5), ("height", 0.1, 1e-4), ("y", 0.28, 1e-4)],
    },
    Case {
        report: "cannon.js #202, gpu-physics.js #1: a fast ball passes a wall",
        text: r#"bodies: {
            "wall": (parent: "world", shapes: [(shape: Box([0.02, 4, 4]), collide: true, at: (position: [5, 0, 0]))]),
            "ball": (parent: "world", hinge: Free, mass: 0.1, inertia: Sphere(0.02), shapes: [(shape: Sphere(0.02), collide: true)], initial: (velocity: [200, 0, 0])),
        },
        gravity: "none", contact: (restitution: 0.5), step: "1 ms", until: "0.05 s",
        // It meets the wall at 4.97 m after 24.85 ms and comes back at 100 m/s.
        metrics: { "x": (of: "ball.position.x"), "furthest": (of: "ball.position.x", take: "max"), "v": (of: "ball.velocity.x") }"#,
        want: &[("x", 2.455, 2e-3), ("furthest", 4.97, 0.2), ("v", -100.0, 1e-6)],
    },
    Case {
        report: "phy #13, box2d #117, JoltPhysics PR 466: a platform that moves does not carry what stands on it",
        text: r#"bodies: {
            "platform": (parent: "world", hinge: Slider(axis: [1, 0, 0], prescribed: true), mass: 10, inertia: [1, 1, 1], shapes: [(shape: Box([2, 2, 0.2]), collide: true, at: (position: [0, 0, -0.1]))], initial: (rate: 0.5)),
            "box": (parent: "world", hinge: Free, mass: 2, inertia: Box([0.2, 0.2, 0.2]), shapes: [(shape: Box([0.2, 0.2, 0.2]), collide: true)], initial: (position: [0, 0, 0.1])),
        },
        parts: { EARTH, "T": (model: "basics.slider_trajectory", params: { "profile": [[0, 0.5], [10, 0.5]], "gives": rate }, bind: { "hinge": "hinge:platform" }) },
        contact: (friction: 0.5), step: "1 ms", until: "3 s",
        // It slips for v / (mu g) = 0.101937 s and loses v^2 / (2 mu g).
        metrics: { "v": (of: "box.velocity.x"), "x": (of: "box.position.x") }"#,
        want: &[("v", 0.5, 1e-6), ("x", 1.474_516, 1e-3)],
    },
    Case {
        report: "drake #17081: a massless body between the two pins of a universal joint",
        text: r#"bodies: {
            "cross": (parent: "world", hinge: Pin([1, 0, 0])),
            "arm": (parent: "cross", hinge: Pin([0, 1, 0]), mass: 1, com: [0, 0, -1], inertia: [0.1, 0.1, 0.1], initial: (angle: "20 deg", rate: 1)),
            "one": (parent: "world", at: (position: [5, 0, 0]), hinge: Universal([1, 0, 0], [0, 1, 0]), mass: 1, com: [0, 0, -1], inertia: [0.1, 0.1, 0.1], initial: (coordinates: [0, "20 deg"], rates: [0, 1])),
        },
        parts: { EARTH }, step: "1 ms", until: "3 s",
        metrics: { "same": (when: "abs(arm.angle - one[1].angle) < 1e-9 rad") }"#,
        want: &[("same", 1.0, 0.0)],
    },
    Case {
        report: "textbook: a ball that spins in place stops after I w/(c m g)",
        text: r#"bodies: { "g": (parent: "world", shapes: [(shape: Box([20, 4, 0.2]), at: (position: [0, 0, -0.1]), collide: true)]),
            "b": (parent: "world", hinge: Free, mass: 2, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: (spinning_friction: "5 mm"))], initial: (position: [0, 0, 0.1], angular: [0, 0, 20])) },
        parts: { EARTH }, contact: (), step: "1 ms", until: "4 s",
        metrics: { "rate": (of: "b.angular.z", at: "time >= 1 s"), "end": (of: "b.angular.z") }"#,
        // 5 mm g/(0.4 r^2) = 12.2625 rad/s^2: it stops after 1.63 s.
        want: &[("rate", 7.7375, 0.02), ("end", 0.0, 1e-9)],
    },
    Case {
        report: "textbook: a belt that changes its direction carries a box with it",
        text: r#"bodies: { "belt": (parent: "world", hinge: Locked, mass: 1, inertia: [1, 1, 1], shapes: [(shape: Box([60, 1, 0.2]), at: (position: [0, 0, -0.1]), collide: (friction: 0.5))]),
            "box": (parent: "world", hinge: Free, mass: 3, inertia: Box([0.2, 0.2, 0.2]), shapes: [(shape: Box([0.2, 0.2, 0.2]), collide: (friction: 0.5))], initial: (position: [0, 0, 0.1])) },
        parts: { EARTH, "S": (model: "basics.step", params: { "time": 1, "before": 1, "after": -1 }), "B": (model: "actuators.belt", params: { "direction": [2, 0, 0] }, bind: { "belt": "node:belt" }) },
        wires: ["S.y -> B.speed"], contact: (), step: "1 ms", until: "2 s",
        metrics: { "early": (of: "box.velocity.x", at: "time >= 0.1 s"), "v": (of: "box.velocity.x", at: "time >= 0.9 s"), "turned": (of: "box.velocity.x", at: "time >= 1.2 s"), "end": (of: "box.velocity.x") }"#,
        // mu g t up to 1 m/s, then 1 m/s - mu g t.
        want: &[
            ("early", 0.4905, 0.01),
            ("v", 1.0, 1e-6),
            ("turned", 0.019, 0.01),
            ("end", -1.0, 1e-6),
        ],
    },
];

#[test]
fn dynamics() {
    hold(CASES);
}
