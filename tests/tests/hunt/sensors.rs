//! Sensors and power. The log is `tests/hunt/sensors.md`.
use super::{Case, hold};

const CASES: &[Case] = &[
    Case {
        report: "o3de-extras PR 564, hector_gazebo #8, #11, robot_localization #501: sign of an accelerometer at rest, upside down and in free fall",
        text: r#"bodies: {
            "up": (parent: "world"), "down": (parent: "world", at: (rotation: (rpy: ["180 deg", 0, 0]))),
            "falls": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (angular: [1, 2, 3])),
        },
        parts: { EARTH,
            "A": (model: "sensors.imu", rate: "100 Hz", params: { "grade": ideal }, bind: { "mount": "node:up" }),
            "B": (model: "sensors.imu", rate: "100 Hz", params: { "grade": ideal }, bind: { "mount": "node:down" }),
            "C": (model: "sensors.imu", rate: "100 Hz", params: { "grade": ideal }, bind: { "mount": "node:falls" }) },
        step: "10 ms", until: "1 s",
        metrics: { "up": (of: "A.force.z", take: "min"), "down": (of: "B.force.z", take: "max"), "x": (of: "C.force.x", take: "max_abs"), "z": (of: "C.force.z", take: "max_abs") }"#,
        want: &[("up", 9.81, 1e-12), ("down", -9.81, 1e-12), ("x", 0.0, 1e-12), ("z", 0.0, 1e-12)],
    },
    Case {
        report: "genesis-world PR 1962: acceleration of an IMU that is not at the axis of rotation",
        text: r#"bodies: {
            "arm": (parent: "world", hinge: Pin([0, 0, 1]), mass: 1, inertia: [1, 1, 1], initial: (rate: 3), nodes: { "end": (position: [0.5, 0, 0], rotation: (rpy: [0, 0, "90 deg"])) }),
        },
        parts: { "A": (model: "sensors.imu", rate: "100 Hz", params: { "grade": ideal }, bind: { "mount": "node:arm/end" }), "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, 0] }) },
        step: "10 ms", until: "1 s",
        // Inwards: -x of the arm is +y of the node.
        metrics: { "x": (of: "A.force.x", take: "max_abs"), "y": (of: "A.force.y", take: "min"), "rate": (of: "A.rate.z", take: "min") }"#,
        want: &[("x", 0.0, 1e-9), ("y", 4.5, 1e-9), ("rate", 3.0, 1e-9)],
    },
    Case {
        report: "bsk_rl #59: a battery that runs flat and is charged again within one row is not seen to have been flat",
        text: r#"parts: {
            "Battery": (model: "power.battery", params: { "capacity_ah": 1, "charge": 0.5, "curve": [[0, 12], [1, 12.000001]], "resistance": 0, "charge_efficiency": 1 }),
            "Sun": (model: "flight.sequence", params: { "rows": [[0, 0], [1200, 48], [2400, 0]] }), "Panel": (model: "power.source"),
            "Load": (model: "power.load", params: { "power_on": 24, "volts_rated": 12, "volts_min": 5 }), "Zero": (model: "basics.constant", params: { "value": 0 }), "One": (model: "basics.constant", params: { "value": 1 }), "On": (model: "basics.comparator") },
        wires: ["One.y -> On.a", "Zero.y -> On.b", "On.y -> Load.on", "Sun.y -> Panel.power"], connect: [("Load.supply", "Battery.terminal"), ("Panel.output", "Battery.charger")],
        step: "3600 s", integrator: "dormand_prince_54", until: "3600 s",
        metrics: { "flat": (of: "Battery.empty", take: "mean"), "end": (of: "Battery.charge"), "when": (of: "Battery.charge", take: "time_of_min") }"#,
        // The battery of 0.5 Ah is empty after 900 s at 2 A. From 1200 s on, 4 A charge 5 % in 45 s; then the load
        // draws 2 A of it until 2400 s, and all after that.
        want: &[("flat", 345.0 / 3600.0, 1e-4), ("end", 0.025, 1e-4), ("when", 900.0, 1.0)],
    },
    Case {
        report: "gz-sim #225: time to discharge is capacity times voltage over power, and the charge at the start is used",
        text: r#"parts: {
            "Battery": (model: "power.battery", params: { "capacity_ah": 2, "charge": 0.5, "curve": [[0, 12], [1, 12.000001]], "resistance": 0 }),
            "Load": (model: "power.load", params: { "power_on": 24, "volts_rated": 12, "volts_min": 5 }), "Zero": (model: "basics.constant", params: { "value": 0 }), "One": (model: "basics.constant", params: { "value": 1 }), "On": (model: "basics.comparator") },
        wires: ["One.y -> On.a", "Zero.y -> On.b", "On.y -> Load.on"], connect: [("Load.supply", "Battery.terminal")],
        step: "1 s", integrator: "dormand_prince_54", until: "2000 s",
        metrics: { "start": (of: "Battery.charge", take: "max"), "empty": (of: "Battery.charge", take: "time_of_min"), "half": (of: "Battery.charge", at: "time >= 900 s"), "least": (of: "Battery.charge", take: "min") }"#,
        // A charge of 1 Ah lasts 1800 s at 2 A.
        want: &[
            ("start", 0.5, 1e-12),
            ("empty", 1800.0, 0.2),
            ("half", 0.25, 1e-4),
            ("least", 0.0, 1e-9),
        ],
    },
    Case {
        report: "diyBMS-CurrentShunt #12: the state of charge leaves 0 to 1; gz-sim #2685: sign of the current",
        text: r#"parts: {
            "Battery": (model: "power.battery", params: { "capacity_ah": 1, "charge": 0.9, "curve": [[0, 12], [1, 12.5]], "resistance": 0.01, "charge_efficiency": 1 }),
            "Wave": (model: "basics.sine", params: { "amplitude": 60, "frequency": "0.05 Hz", "offset": 40 }), "Source": (model: "power.source") },
        wires: ["Wave.y -> Source.power"], connect: [("Source.output", "Battery.charger")],
        step: "0.1 s", until: "600 s",
        metrics: { "high": (of: "Battery.charge", take: "max"), "low": (of: "Battery.charge", take: "min"), "current": (of: "Battery.current", take: "min") }"#,
        want: &[("high", 1.0, 1e-6), ("low", 0.9, 0.01), ("current", -8.0, 0.5)],
    },
    Case {
        report: "CompliantJointToolbox #77, IEEE-MVC-2023 #9: back-EMF and the balance of a motor's power",
        text: r#"bodies: { "rotor": (parent: "world", hinge: Pin([0, 0, 1]), mass: 1, inertia: [1e-4, 1e-4, 1e-4]) },
        parts: {
            "Motor": (model: "actuators.dc_motor", params: { "resistance": 2, "torque_constant": 0.05, "viscous": 1e-4 }, bind: { "shaft": "hinge:rotor" }),
            "Supply": (model: "power.ideal_supply", params: { "voltage": 24 }), "V": (model: "basics.constant", params: { "value": 12 }) },
        wires: ["V.y -> Motor.volts"], connect: [("Motor.supply", "Supply.terminal")], gravity: "none",
        step: "1 ms", until: "5 s",
        // w = k u / (k^2 + R d), i = d w / k, heat R i^2.
        metrics: { "rate": (of: "rotor.rate"), "current": (of: "Motor.current"), "power": (of: "Motor.power"), "heat": (of: "Motor.case.heat") }"#,
        want: &[
            ("rate", 222.222_222, 1e-5),
            ("current", 0.444_444_4, 1e-7),
            ("power", 5.333_333, 1e-6),
            ("heat", 0.395_061_7, 1e-7),
        ],
    },
    Case {
        report: "wos-issues #227: a panel that faces away from the Sun drains power",
        text: r#"bodies: { "panel": (parent: "world", hinge: Pin(axis: [1, 0, 0], prescribed: true)) },
        parts: {
            "Sun": (model: "environment.fixed_sun", params: { "azimuth": 0, "elevation": "90 deg", "distance_au": 1 }),
            "Turn": (model: "basics.hinge_trajectory", params: { "profile": [[0, 0], ["4 s", "360 deg"]], "between": smooth, "gives": position }, bind: { "hinge": "hinge:panel" }),
            "Panel": (model: "power.solar_panel", params: { "area": 2, "efficiency": 0.25 }, bind: { "panel": "node:panel" }),
            "Meter": (model: "basics.energy_meter") },
        wires: ["Panel.power -> Meter.power"], step: "10 ms", until: "4 s",
        metrics: { "low": (of: "Panel.power", take: "min"), "high": (of: "Panel.power", take: "max") }"#,
        want: &[("low", 0.0, 0.0), ("high", 680.5, 0.01)],
    },
    Case {
        report: "rotors_simulator #335: noise of an IMU depends on the sample rate as its density says",
        text: r#"bodies: { "up": (parent: "world") },
        parts: { EARTH,
            "A": (model: "sensors.imu", rate: "100 Hz", params: { "grade": ideal, "gyro_white": 0.001, "accel_white": 0.002 }, bind: { "mount": "node:up" }),
            "B": (model: "sensors.imu", rate: "1 kHz", params: { "grade": ideal, "gyro_white": 0.001, "accel_white": 0.002 }, bind: { "mount": "node:up" }) },
        step: "1 ms", until: "100 s",
        metrics: { "a": (of: "A.rate.x", take: "std"), "b": (of: "B.rate.x", take: "std"), "c": (of: "A.force.x", take: "std"), "mean": (of: "A.force.z", take: "mean") }"#,
        // The deviation is N sqrt(rate).
        want: &[("a", 0.01, 3e-4), ("b", 0.031_623, 4e-4), ("c", 0.02, 6e-4), ("mean", 9.81, 1e-3)],
    },
    Case {
        report: "PX4-SITL_gazebo-classic PR 82, gz-sensors: a sensor whose period is not a multiple of the step",
        text: r#"bodies: { "arm": (parent: "world", hinge: Pin([0, 0, 1]), mass: 1, inertia: [1, 1, 1], initial: (rate: 1)) },
        parts: { "E": (model: "sensors.encoder", rate: "30 Hz", params: { "ticks": 1e9 }, bind: { "shaft": "hinge:arm" }), "S": (model: "basics.statistics", rate: "30 Hz") },
        wires: ["E.angle -> S.u"], gravity: "none", step: "300 Hz", until: "10 s",
        metrics: { "count": (of: "S.count"), "angle": (of: "E.angle"), "rate": (of: "E.rate", take: "mean") }"#,
        want: &[("count", 300.0, 0.0), ("angle", 10.0, 0.04), ("rate", 1.0, 0.01)],
    },
    Case {
        report: "textbook: an encoder rounds towards zero, so that forwards and backwards differ",
        text: r#"bodies: {
            "a": (parent: "world", hinge: Pin([0, 0, 1]), mass: 1, inertia: [1, 1, 1], initial: (rate: 1)),
            "b": (parent: "world", hinge: Pin([0, 0, 1]), mass: 1, inertia: [1, 1, 1], initial: (rate: -1)) },
        parts: { "A": (model: "sensors.encoder", rate: "100 Hz", params: { "ticks": 10 }, bind: { "shaft": "hinge:a" }), "B": (model: "sensors.encoder", rate: "100 Hz", params: { "ticks": 10 }, bind: { "shaft": "hinge:b" }) },
        gravity: "none", step: "10 ms", until: "6.5 s",
        metrics: { "a": (of: "A.count"), "b": (of: "B.count"), "once": (of: "A.count", at: "time >= 0.62 s"), "back": (of: "B.count", at: "time >= 0.02 s") }"#,
        want: &[("a", 10.0, 0.0), ("b", -11.0, 0.0), ("once", 0.0, 0.0), ("back", -1.0, 0.0)],
    },
    Case {
        report: "ModelicaStandardLibrary #360: heat is not balanced between two bodies",
        text: r#"parts: {
            "A": (model: "power.thermal_node", params: { "capacity": 100, "temperature": "100 degC" }),
            "B": (model: "power.thermal_node", params: { "capacity": 300, "temperature": "0 degC" }),
            "L": (model: "power.thermal_link", params: { "conductance": 5 }) },
        connect: [("L.a", "A.port"), ("L.b", "B.port")], step: "0.1 s", until: "30 s",
        // Mean 25 degC, time constant C_a C_b / (C_a + C_b) / G = 15 s.
        metrics: { "a": (of: "A.temperature", unit: "degC"), "b": (of: "B.temperature", unit: "degC") }"#,
        want: &[("a", 35.150_146, 1e-5), ("b", 21.616_618, 1e-5)],
    },
    Case {
        report: "textbook: a body that radiates cools with T^-3 (closed form)",
        text: r#"parts: { "A": (model: "power.thermal_node", params: { "capacity": 1000, "temperature": "26.85 degC", "area": 1, "emissivity": 0.8 }), "Space": (model: "basics.constant", params: { "value": 0 }) },
        wires: ["Space.y -> A.sky"], step: "1 s", until: "3600 s",
        metrics: { "T": (of: "A.temperature") }"#,
        // The temperature follows from T^-3 = T0^-3 + 3 e s A t / C.
        want: &[("T", 123.805_945, 1e-3)],
    },
    Case {
        report: "gazebo-classic #940, sdformat #130, drcsim #155, force_torque_tools PR 18: sign, frame and point of the wrench of a load",
        text: r#"bodies: { "arm": (parent: "world", at: (rotation: (rpy: ["90 deg", 0, 0])), reaction: true, mass: 2, com: [0.1, 0, 0], inertia: [0.01, 0.01, 0.01]) },
        parts: { EARTH, "F": (model: "sensors.force_torque", rate: "100 Hz", bind: { "tool": "node:arm" }) },
        step: "10 ms", until: "0.1 s",
        // The mount pushes up, along y of its axes; the moment is x cross force.
        metrics: { "y": (of: "F.force.y"), "z": (of: "F.force.z"), "moment": (of: "F.torque.z") }"#,
        want: &[("y", 19.62, 1e-9), ("z", 0.0, 1e-9), ("moment", 1.962, 1e-9)],
    },
    Case {
        report: "textbook: a potentiometer and a current sensor at the ends of their range",
        text: r#"bodies: { "arm": (parent: "world", hinge: Pin([0, 0, 1]), mass: 1, inertia: [1, 1, 1], initial: (angle: 1, rate: 1)) },
        parts: { "P": (model: "sensors.potentiometer", rate: "100 Hz", params: { "lower": -2, "upper": 2, "bits": 8 }, bind: { "shaft": "hinge:arm" }),
            "I": (model: "basics.ramp", params: { "slope": 1 }), "C": (model: "sensors.current", rate: "100 Hz", params: { "range": 2, "bits": 12 }) },
        wires: ["I.y -> C.current"], gravity: "none", step: "10 ms", until: "3 s",
        metrics: { "valid": (of: "P.valid"), "angle": (of: "P.angle", take: "max"), "ok": (of: "P.valid", at: "time >= 0.5 s"), "I": (of: "C.reading", take: "max"), "zero": (of: "C.reading", at: "time >= 0 s") }"#,
        want: &[
            ("valid", 0.0, 0.0),
            ("angle", 2.0, 0.016),
            ("ok", 1.0, 0.0),
            ("I", 2.0, 1e-3),
            ("zero", 0.0, 0.0),
        ],
    },
    Case {
        report: "textbook: an accelerometer beside the axis of an arm that is accelerated (centripetal and tangential)",
        text: r#"bodies: { "arm": (parent: "world", hinge: Pin([0, 0, 1]), mass: 1, inertia: [1, 1, 2], nodes: { "n": (position: [0.3, 0.4, 0]) }) },
        parts: { EARTH, "A": (model: "sensors.imu", rate: "100 Hz", params: { "grade": ideal }, bind: { "mount": "node:arm/n" }), "Supply": (model: "power.ideal_supply", params: { "voltage": 24 }),
            "T": (model: "actuators.torque_drive", bind: { "shaft": "hinge:arm" }), "C": (model: "basics.constant", params: { "value": 6 }) },
        wires: ["C.y -> T.torque"], connect: [("T.supply", "Supply.terminal")], step: "10 ms", until: "1 s",
        metrics: { "x": (of: "A.force.x", at: "time >= 0.5 s"), "y": (of: "A.force.y", at: "time >= 0.5 s"), "rate": (of: "A.rate.z", at: "time >= 0.5 s") }"#,
        // 3 rad/s^2, and 1.5 rad/s after 0.5 s: -x w^2 - y a, -y w^2 + x a.
        want: &[("x", -1.875, 1e-9), ("y", 0.0, 1e-9), ("rate", 1.5, 1e-9)],
    },
    Case {
        report: "textbook: a gyroscope at rest at a latitude of 30 degrees, in axes that are turned to the north",
        text: r#"world: (body: "earth", site: (latitude: "30 deg", longitude: 0)), bodies: { "b": (parent: "world", nodes: { "n": (rotation: (rpy: [0, 0, "90 deg"])) }) },
        parts: { "Gravity": (model: "environment.point_mass_gravity"), "A": (model: "sensors.imu", rate: "10 Hz", params: { "grade": ideal }, bind: { "mount": "node:b/n" }) },
        step: "0.1 s", until: "1 s", metrics: { "x": (of: "A.rate.x"), "y": (of: "A.rate.y"), "z": (of: "A.rate.z") }"#,
        // 7.292115e-5 rad/s: its cosine to the north, its sine upwards.
        want: &[("x", 6.315_156_84e-5, 1e-12), ("y", 0.0, 1e-15), ("z", 3.646_057_5e-5, 1e-12)],
    },
    Case {
        report: "textbook: share of the time for which a thermostat heats, and its extremes between samples",
        text: r#"parts: { "A": (model: "power.thermal_node", params: { "capacity": 1000, "temperature": "280 K" }), "B": (model: "power.thermal_boundary"), "T": (model: "basics.constant", params: { "value": 250 }),
            "L": (model: "power.thermal_link", params: { "conductance": 1 }), "Supply": (model: "power.ideal_supply", params: { "voltage": 28 }), "H": (model: "power.heater", params: { "power": 50, "on_below": 280, "band": 2 }) },
        wires: ["T.y -> B.temperature"], connect: [("L.a", "A.port"), ("L.b", "B.port"), ("H.node", "A.port"), ("H.supply", "Supply.terminal")],
        step: "600 s", integrator: "dormand_prince_54", until: "30000 s", stop_when: "time >= 16989.904 s",
        metrics: { "high": (of: "A.temperature", take: "max"), "low": (of: "A.temperature", take: "min"), "share": (of: "H.on", take: "mean") }"#,
        // Heating takes C/G ln(20/18), cooling C/G ln(32/30); the run has 100 of both.
        want: &[("high", 282.0, 1e-6), ("low", 280.0, 1e-6), ("share", 0.620136039, 1e-5)],
    },
];

#[test]
fn sensors() {
    hold(CASES);
}
