//! Attitude and control. The log is `tests/hunt/attitude.md`.
use super::{Case, hold};

const CASES: &[Case] = &[
    Case {
        report: "PX4 PR 4286, multicalc-rust #287: an attitude error beyond half a turn goes the short way",
        text: r#"bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [2, 2, 2], initial: (rotation: (axis: [0, 0, 1], angle: "200 deg"))) },
        parts: { "M": (model: "sensors.motion", bind: { "mount": "node:a" }),
            "Zero": (model: "basics.constant", params: { "value": 0 }), "One": (model: "basics.constant", params: { "value": 1 }),
            "P": (model: "control.pointing", params: { "inertia": [2, 2, 2], "frequency": 0.5 }) },
        wires: ["M.attitude -> P.attitude", "M.rate -> P.rate", "Zero.y -> P.target.x", "Zero.y -> P.target.y", "Zero.y -> P.target.z", "One.y -> P.target.w"],
        gravity: "none", step: "10 ms", until: "0.1 s",
        metrics: { "error": (of: "P.error", unit: "deg"), "torque": (of: "P.torque.z") }"#,
        // An error of 160 degrees in the positive direction remains.
        want: &[("error", 160.0, 1e-6), ("torque", 1.4, 1e9)],
    },
    Case {
        report: "multicalc-rust #287: a body that is exactly half a turn off is not stuck",
        text: r#"bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [2, 2, 2], initial: (rotation: (quat: [0, 0, 1, 0]))) },
        parts: { "M": (model: "sensors.motion", bind: { "mount": "node:a" }),
            "Zero": (model: "basics.constant", params: { "value": 0 }), "One": (model: "basics.constant", params: { "value": 1 }),
            "P": (model: "control.pointing", params: { "inertia": [2, 2, 2], "frequency": 0.5 }) },
        wires: ["M.attitude -> P.attitude", "M.rate -> P.rate", "Zero.y -> P.target.x", "Zero.y -> P.target.y", "Zero.y -> P.target.z", "One.y -> P.target.w"],
        gravity: "none", step: "10 ms", until: "0.1 s",
        metrics: { "error": (of: "P.error", unit: "deg"), "pushes": (when: "abs(P.torque.z) > 0.1 N m") }"#,
        want: &[("error", 180.0, 1e-6), ("pushes", 1.0, 0.0)],
    },
    Case {
        report: "Quadrotor-NMPC-Control #1: a target of the other sign is the same attitude",
        text: r#"bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [2, 2, 2], initial: (rotation: (axis: [0, 0, 1], angle: "60 deg"))) },
        parts: { "M": (model: "sensors.motion", bind: { "mount": "node:a" }),
            "Zero": (model: "basics.constant", params: { "value": 0 }), "W": (model: "basics.constant", params: { "value": -0.866025403784 }), "Z": (model: "basics.constant", params: { "value": -0.5 }),
            "P": (model: "control.pointing", params: { "inertia": [2, 2, 2], "frequency": 0.5 }) },
        wires: ["M.attitude -> P.attitude", "M.rate -> P.rate", "Zero.y -> P.target.x", "Zero.y -> P.target.y", "Z.y -> P.target.z", "W.y -> P.target.w"],
        gravity: "none", step: "10 ms", until: "0.1 s",
        metrics: { "error": (of: "P.error"), "torque": (of: "P.torque.z", take: "max_abs") }"#,
        want: &[("error", 0.0, 1e-9), ("torque", 0.0, 1e-9)],
    },
    Case {
        report: "kornia #3950, nalgebra #1482, PX4 #18713, libgdx #4919: roll, pitch, yaw at the singularity",
        text: r#"bodies: {
            "a": (parent: "world", at: (rotation: (rpy: ["30 deg", "90 deg", "45 deg"]))), "b": (parent: "world", at: (rotation: (rpy: [0, "-90 deg", "45 deg"]))), "c": (parent: "world", at: (rotation: (rpy: [0, 0, "90 deg"]))) },
        parts: { "A": (model: "sensors.motion", bind: { "mount": "node:a" }), "B": (model: "sensors.motion", bind: { "mount": "node:b" }), "C": (model: "sensors.motion", bind: { "mount": "node:c" }),
            "P": (model: "sensors.pose", rate: "10 Hz", bind: { "mount": "node:c" }), "Q": (model: "sensors.pose", rate: "10 Hz", bind: { "mount": "node:b" }) },
        step: "100 ms", until: "1 s",
        // yaw 45, pitch 90, roll 30: equal to yaw 15 and pitch 90.
        metrics: { "aw": (of: "A.attitude.w"), "ay": (of: "A.attitude.y"), "bw": (of: "B.attitude.w"), "bx": (of: "B.attitude.x"), "by": (of: "B.attitude.y"), "bz": (of: "B.attitude.z"), "c": (of: "P.heading", unit: "deg"), "tilt": (of: "Q.tilt", unit: "deg"), "finite": (when: "abs(Q.heading) < 7 rad") }"#,
        want: &[
            ("aw", 0.701_057_4, 1e-6),
            ("ay", 0.701_057_4, 1e-6),
            ("bw", 0.653_281_5, 1e-6),
            ("bx", 0.270_598_05, 1e-6),
            ("by", -0.653_281_5, 1e-6),
            ("bz", 0.270_598_05, 1e-6),
            ("c", 90.0, 1e-9),
            ("tilt", 90.0, 1e-6),
            ("finite", 1.0, 0.0),
        ],
    },
    Case {
        report: "pidctrl PR 5, ArduPID #1, simple-pid #38: an integral part that is wound up holds the output too long",
        text: r#"parts: {
            "T": (model: "basics.step", params: { "time": 100, "before": 10, "after": -1 }), "Zero": (model: "basics.constant", params: { "value": 0 }),
            "C": (model: "control.rate_controller", rate: "10 Hz", params: { "kp": 0.5, "ki": 1, "limit": 5 }) },
        wires: ["T.y -> C.target", "Zero.y -> C.rate"], step: "0.1 s", until: "120 s",
        metrics: { "full": (of: "C.volts", at: "time >= 99 s"), "soon": (of: "C.volts", at: "time >= 111 s"), "least": (of: "C.volts", take: "min"), "most": (of: "C.volts", take: "max") }"#,
        // At most 5 V + 5 V of the integral part have to decay at 1 V/s, less the proportional part.
        want: &[
            ("full", 5.0, 1e-9),
            ("soon", -5.0, 0.7),
            ("least", -5.0, 1e-9),
            ("most", 5.0, 1e-9),
        ],
    },
    Case {
        report: "Arduino-PID-Library PR 81: derivative kick of a step of the target and of the first sample",
        text: r#"parts: {
            "T": (model: "basics.step", params: { "time": 1, "before": 0, "after": 1 }), "X": (model: "basics.constant", params: { "value": 3 }),
            "C": (model: "control.position_controller", rate: "100 Hz", params: { "kp": 1, "kd": 1, "limit": 1000 }) },
        wires: ["T.y -> C.target", "X.y -> C.angle"], step: "10 ms", until: "2 s",
        metrics: { "low": (of: "C.volts", take: "min"), "high": (of: "C.volts", take: "max"), "end": (of: "C.volts") }"#,
        want: &[("low", -3.0, 1e-9), ("high", 0.0, 1e-9), ("end", -2.0, 1e-9)],
    },
    Case {
        report: "basilisk PR 945: a wheel without a limit on a light spacecraft; momentum of body and wheel",
        text: r#"bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [0.01, 0.01, 0.01], nodes: { "w": () }) },
        parts: { "W": (model: "flight.reaction_wheel", params: { "inertia": 0.0016 }, bind: { "wheel": "node:a/w" }), "S": (model: "power.ideal_supply", params: { "voltage": 28 }), "T": (model: "basics.step", params: { "time": 10, "before": 0.1, "after": 0 }) },
        wires: ["T.y -> W.torque"], connect: [("W.supply", "S.terminal")], gravity: "none", step: "0.1 s", until: "20 s",
        // Inertia of the body without the wheel's: the documentation states whether the body includes it.
        metrics: { "body": (of: "a.angular.z"), "momentum": (of: "W.momentum") }"#,
        want: &[("body", -100.0, 1e-6), ("momentum", 1.0, 1e-9)],
    },
    Case {
        report: "crazyflow PR 86: sign of gyroscopic moments (a heavy gyroscope precesses)",
        text: r#"bodies: { "g": (parent: "world", hinge: Chain(Pin([0, 0, 1]), Pin([0, 1, 0]), Pin([1, 0, 0])), mass: 1, com: [0.2, 0, 0], inertia: [0.01, 0.006, 0.006], initial: (coordinates: [0, 0, 0], rates: [0.49111, 0, 400])) },
        parts: { EARTH }, step: "0.1 ms", until: "2 s",
        // m g l / (I w), steady for the rate that it starts with.
        metrics: { "turn": (of: "g[0].angle"), "dip": (of: "g[1].angle", take: "max_abs") }"#,
        want: &[("turn", 0.981, 2e-3), ("dip", 0.0, 1e-3)],
    },
    Case {
        report: "ros_controllers #493, moveit2 #1859: a move between two positions does not overshoot and stops at both",
        text: r#"bodies: { "a": (parent: "world", hinge: Pin(axis: [0, 0, 1], prescribed: true), mass: 1, inertia: [1, 1, 1]) },
        parts: { "T": (model: "basics.hinge_trajectory", params: { "profile": [[1, 0], [2, 1], [2.1, 1], [4, -0.5]], "between": stops }, bind: { "hinge": "hinge:a" }) },
        gravity: "none", step: "10 ms", until: "6 s",
        metrics: { "high": (of: "a.angle", take: "max"), "low": (of: "a.angle", take: "min"), "at": (of: "a.angle", at: "time >= 2 s"), "rate": (of: "a.rate", at: "time >= 2.05 s"), "end": (of: "a.angle") }"#,
        want: &[
            ("high", 1.0, 1e-6),
            ("low", -0.5, 1e-6),
            ("at", 1.0, 1e-6),
            ("rate", 0.0, 1e-6),
            ("end", -0.5, 1e-6),
        ],
    },
    Case {
        report: "openobsw #70, PASEOS PR 202: no torque along the field, sign of m x B",
        text: r#"bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (rotation: (axis: [0, 0, 1], angle: "90 deg"))) },
        parts: { "B": (model: "basics.constant", params: { "value": 3e-5 }), "D": (model: "basics.constant", params: { "value": 10 }), "Zero": (model: "basics.constant", params: { "value": 0 }),
            "S": (model: "power.ideal_supply", params: { "voltage": 28 }), "T": (model: "flight.magnetic_torquer", params: { "dipole_max": 5 }, bind: { "body": "node:a" }) },
        wires: ["B.y -> T.field.x", "Zero.y -> T.field.y", "Zero.y -> T.field.z", "D.y -> T.dipole.x", "Zero.y -> T.dipole.y", "Zero.y -> T.dipole.z"], connect: [("T.supply", "S.terminal")],
        gravity: "none", step: "10 ms", until: "1 s",
        // The dipole (5 A m2, saturated) points along y of W: m x B = -z.
        metrics: { "x": (of: "a.angular.x"), "z": (of: "a.angular.z"), "given": (of: "T.given.x") }"#,
        want: &[("x", 0.0, 1e-12), ("z", -1.5e-4, 1e-8), ("given", 5.0, 0.0)],
    },
    Case {
        report: "textbook: a demand below the shortest pulse is not lost, one above the jet is cut off",
        text: r#"parts: {
            "T": (model: "basics.step", params: { "time": 100, "before": -0.01, "after": 5 }), "P": (model: "control.pulse_width", rate: "10 Hz", params: { "jet": 1, "minimum": 0.02 }),
            "F": (model: "basics.gain", params: { "k": 10 }), "B": (model: "basics.gain", params: { "k": 10 }) },
        wires: ["T.y -> P.torque", "P.forward -> F.u", "P.backward -> B.u"], step: "0.1 s", until: "200 s",
        // Means over time: 0.01 N m for half of the time, all of the time for the other half.
        metrics: { "back": (of: "B.y", take: "mean"), "forth": (of: "F.y", take: "mean"), "most": (of: "P.forward", take: "max") }"#,
        want: &[("back", 0.005, 2e-4), ("forth", 0.5, 2e-3), ("most", 0.1, 1e-9)],
    },
    Case {
        report: "textbook: torques of the wheels add up to the torque that is wanted",
        text: r#"parts: {
            "T": (model: "basics.constant", params: { "value": 0.3 }), "Zero": (model: "basics.constant", params: { "value": 0 }),
            "D": (model: "control.wheel_distribution", params: { "axes": [[0.57735026919, 0.57735026919, 0.57735026919], [-0.57735026919, 0.57735026919, 0.57735026919], [-0.57735026919, -0.57735026919, 0.57735026919], [0.57735026919, -0.57735026919, 0.57735026919]] }) },
        wires: ["T.y -> D.torque.x", "Zero.y -> D.torque.y", "Zero.y -> D.torque.z"], step: "0.1 s", until: "1 s",
        // The torque on the body is opposite to that on the wheels.
        metrics: { "one": (of: "D.torques[0]"), "two": (of: "D.torques[1]"), "five": (of: "D.torques[4]") }"#,
        want: &[("one", -0.129_903_8, 1e-7), ("two", 0.129_903_8, 1e-7), ("five", 0.0, 0.0)],
    },
    Case {
        report: "RoboManipBaselines PR 11, scipy PR 17334: order and sign of the quaternion of a yaw of 90 degrees, and no fix at a rate",
        text: r#"bodies: { "a": (parent: "world", at: (rotation: (rpy: [0, 0, "90 deg"]))), "b": (parent: "world", hinge: Pin([0, 0, 1]), mass: 1, inertia: [1, 1, 1], initial: (rate: 0.1)) },
        parts: { "A": (model: "sensors.star_tracker", rate: "10 Hz", params: { "sigma": [0, 0, 0] }, bind: { "mount": "node:a" }), "B": (model: "sensors.star_tracker", rate: "10 Hz", bind: { "mount": "node:b" }) },
        gravity: "none", step: "0.1 s", until: "1 s",
        metrics: { "z": (of: "A.attitude.z"), "w": (of: "A.attitude.w"), "fix": (of: "A.fix"), "none": (of: "B.fix", take: "max"), "identity": (of: "B.attitude.w", take: "min") }"#,
        want: &[
            ("z", std::f64::consts::FRAC_1_SQRT_2, 1e-8),
            ("w", std::f64::consts::FRAC_1_SQRT_2, 1e-8),
            ("fix", 1.0, 0.0),
            ("none", 0.0, 0.0),
            ("identity", 1.0, 0.0),
        ],
    },
    Case {
        report: "ros_controllers #626, Universal_Robots_Client_Library PR 195: rates that go straight from row to row, and jumps between segments",
        text: r#"bodies: {
            "a": (parent: "world", hinge: Pin(axis: [0, 0, 1], prescribed: true), mass: 1, inertia: [1, 1, 1]),
            "b": (parent: "world", hinge: Pin(axis: [0, 0, 1], prescribed: true), mass: 1, inertia: [1, 1, 1]) },
        parts: {
            "T": (model: "basics.hinge_trajectory", params: { "profile": [[0, 0], [1, 2], [3, 2], [4, 0]], "gives": rate, "between": straight }, bind: { "hinge": "hinge:a" }),
            "S": (model: "basics.hinge_trajectory", params: { "profile": [[0, 0], [1, 2], [1.5, 2.2], [4, 0]], "between": smooth }, bind: { "hinge": "hinge:b" }) },
        gravity: "none", step: "10 ms", until: "5 s",
        // The trapezium has 6 rad; the smooth one meets its rows.
        metrics: { "way": (of: "a.angle"), "rate": (of: "a.rate"), "one": (of: "b.angle", at: "time >= 1 s"), "two": (of: "b.angle", at: "time >= 1.5 s"), "end": (of: "b.angle"), "rest": (of: "b.rate") }"#,
        want: &[
            ("way", 6.0, 1e-6),
            ("rate", 0.0, 1e-6),
            ("one", 2.0, 1e-6),
            ("two", 2.2, 1e-6),
            ("end", 0.0, 1e-6),
            ("rest", 0.0, 1e-6),
        ],
    },
    Case {
        report: "aica control-libraries #54: an angle beyond pi flips the axis of a rotation",
        text: r#"bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (rotation: (axis: [1, 2, 3], angle: "270 deg")), nodes: { "p": (position: [1, 0.5, -2]) }), "b": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (rotation: (axis: [-1, -2, -3], angle: "90 deg")), nodes: { "p": (position: [1, 0.5, -2]) }) },
        parts: { "A": (model: "sensors.motion", bind: { "mount": "node:a/p" }), "B": (model: "sensors.motion", bind: { "mount": "node:b/p" }) },
        gravity: "none", step: "10 ms", until: "0.1 s",
        metrics: { "same": (when: "abs(A.position.x - B.position.x) + abs(A.position.y - B.position.y) + abs(A.position.z - B.position.z) < 1e-12 m") }"#,
        want: &[("same", 1.0, 0.0)],
    },
];

#[test]
fn attitude() {
    hold(CASES);
}
