//! Rover and terrain. The log is `tests/hunt/rover.md`.
use super::{Case, hold};

const CASES: &[Case] = &[
    Case {
        report: "AirSim #3531, subt PR 569: a car whose wheels are locked slides down a slope that its friction holds",
        text: r#"bodies: { "car": (parent: "world", hinge: Free, mass: 500, inertia: Box([2, 1.2, 0.5]), initial: (position: [0, 0, 0.36], rotation: (rpy: [0, "-20 deg", 0])),
            nodes: { "a": (position: [0.8, 0.5, -0.1]), "b": (position: [0.8, -0.5, -0.1]), "c": (position: [-0.8, 0.5, -0.1]), "d": (position: [-0.8, -0.5, -0.1]) }) },
        parts: { EARTH, "Ground": (model: "environment.flat", params: { "slope": "20 deg", "size": 40, "soil": { "kind": "dry_sand" } }),
            "Wheel": (model: "mobility.wheel_rigid", params: { "radius": 0.2, "width": 0.15, "stiffness": 4e5 }, array: [(bind: { "hub": "node:car/a" }), (bind: { "hub": "node:car/b" }), (bind: { "hub": "node:car/c" }), (bind: { "hub": "node:car/d" })]),
            "M": (model: "sensors.motion", bind: { "mount": "node:car" }) },
        step: "1 ms", until: "30 s",
        metrics: { "speed": (of: "M.velocity.x", at: "time >= 20 s"), "across": (of: "M.velocity.y", at: "time >= 20 s"), "end": (of: "M.velocity.x") }"#,
        // The friction mu = 0.7 exceeds tan 20 deg = 0.364.
        want: &[("speed", 0.0, 1e-9), ("across", 0.0, 1e-9), ("end", 0.0, 1e-9)],
    },
    Case {
        report: "gz-sim #2314, ros2_controllers #878, open-source-rover #175: the inner wheel steers more, and odometry agrees with the commands",
        text: r#"parts: {
            "V": (model: "basics.constant", params: { "value": 1 }), "W": (model: "basics.constant", params: { "value": 0.5 }),
            "A": (model: "control.ackermann", rate: "100 Hz", params: { "radius": 0.1, "acceleration": 1000, "steer_rate": 1000, "wheels": WHEELS }),
            "O": (model: "control.odometry", rate: "100 Hz", params: { "radius": 0.1, "wheels": WHEELS }) },
        wires: ["V.y -> A.speed", "W.y -> A.turn_rate", "A.wheels[*].drive.rate -> O.wheels[*].rate", "A.wheels[*].steer -> O.wheels[*].steer"],
        step: "10 ms", until: "20 s",
        metrics: { "left": (of: "A.wheels[0].steer", unit: "deg"), "right": (of: "A.wheels[1].steer", unit: "deg"), "rate": (of: "A.wheels[2].drive.rate"), "speed": (of: "O.speed"), "turn": (of: "O.turn_rate") }"#,
        want: &[
            ("left", 30.465_545, 1e-5),
            ("right", 23.498_565, 1e-5),
            ("rate", 8.5, 1e-9),
            ("speed", 1.0, 1e-9),
            ("turn", 0.5, 1e-9),
        ],
    },
    Case {
        report: "teb_local_planner PR 101, Resurgence PR 165: steering while it drives backwards",
        text: r#"parts: {
            "V": (model: "basics.constant", params: { "value": -1 }), "W": (model: "basics.constant", params: { "value": 0.5 }),
            "A": (model: "control.ackermann", rate: "100 Hz", params: { "radius": 0.1, "acceleration": 1000, "steer_rate": 1000, "wheels": WHEELS }),
            "O": (model: "control.odometry", rate: "100 Hz", params: { "radius": 0.1, "wheels": WHEELS }) },
        wires: ["V.y -> A.speed", "W.y -> A.turn_rate", "A.wheels[*].drive.rate -> O.wheels[*].rate", "A.wheels[*].steer -> O.wheels[*].steer"],
        step: "10 ms", until: "20 s",
        metrics: { "left": (of: "A.wheels[0].steer", unit: "deg"), "right": (of: "A.wheels[1].steer", unit: "deg"), "speed": (of: "O.speed"), "turn": (of: "O.turn_rate") }"#,
        want: &[
            ("left", -23.498_565, 1e-5),
            ("right", -30.465_545, 1e-5),
            ("speed", -1.0, 1e-9),
            ("turn", 0.5, 1e-9),
        ],
    },
    Case {
        report: "gz-sim PR 1849, ros_controllers #328: turning on the spot, both ways, and the angle of odometry",
        text: r#"parts: {
            "V": (model: "basics.constant", params: { "value": 0 }), "W": (model: "basics.step", params: { "time": 10, "before": 0.5, "after": -0.25 }),
            "A": (model: "control.ackermann", rate: "100 Hz", params: { "radius": 0.1, "acceleration": 1000, "steer_rate": 1000, "wheels": WHEELS }),
            "O": (model: "control.odometry", rate: "100 Hz", params: { "radius": 0.1, "wheels": WHEELS }) },
        wires: ["V.y -> A.speed", "W.y -> A.turn_rate", "A.wheels[*].drive.rate -> O.wheels[*].rate", "A.wheels[*].steer -> O.wheels[*].steer"],
        step: "10 ms", until: "20 s",
        metrics: { "one": (of: "O.turn_rate", at: "time >= 5 s"), "other": (of: "O.turn_rate"), "x": (of: "O.x", take: "max_abs"), "heading": (of: "O.heading") }"#,
        want: &[
            ("one", 0.5, 1e-9),
            ("other", -0.25, 1e-9),
            ("x", 0.0, 1e-6),
            ("heading", 2.5, 0.02),
        ],
    },
    Case {
        report: "dg-commons #119, pathplanner #695, PX4 PR 24084: waypoints that are equal, that are where it starts, or behind it",
        text: r#"parts: {
            "F": (model: "control.waypoint_follower", rate: "50 Hz", params: { "waypoints": [[0, 0], [3, 0], [3, 0], [-3, 0]], "speed": 1, "spot_rate": 1, "tolerance": 0.05 }),
            "A": (model: "control.ackermann", rate: "50 Hz", params: { "radius": 0.1, "acceleration": 10, "steer_rate": 10, "wheels": WHEELS }),
            "O": (model: "control.odometry", rate: "50 Hz", params: { "radius": 0.1, "wheels": WHEELS }) },
        wires: ["F.speed -> A.speed", "F.turn_rate -> A.turn_rate", "A.wheels[*].drive.rate -> O.wheels[*].rate", "A.wheels[*].steer -> O.wheels[*].steer",
            "O.x -> F.x", "O.y -> F.y", "O.heading -> F.heading"],
        step: "10 ms", until: "60 s",
        metrics: { "done": (of: "F.done"), "x": (of: "O.x"), "y": (of: "O.y"), "far": (of: "O.x", take: "max"), "speed": (of: "O.speed") }"#,
        want: &[
            ("done", 1.0, 0.0),
            ("x", -3.0, 0.1),
            ("y", 0.0, 0.1),
            ("far", 3.0, 0.1),
            ("speed", 0.0, 1e-9),
        ],
    },
    Case {
        report: "pure_pursuit #6: a rover that misses its goal drives on for ever",
        text: r#"parts: {
            "F": (model: "control.waypoint_follower", rate: "50 Hz", params: { "waypoints": [[0.2, 0.2]], "speed": 1, "spot_rate": 1, "tolerance": 0.02 }),
            "A": (model: "control.ackermann", rate: "50 Hz", params: { "radius": 0.1, "acceleration": 10, "steer_rate": 10, "wheels": WHEELS }),
            "O": (model: "control.odometry", rate: "50 Hz", params: { "radius": 0.1, "wheels": WHEELS }) },
        wires: ["F.speed -> A.speed", "F.turn_rate -> A.turn_rate", "A.wheels[*].drive.rate -> O.wheels[*].rate", "A.wheels[*].steer -> O.wheels[*].steer",
            "O.x -> F.x", "O.y -> F.y", "O.heading -> F.heading"],
        step: "10 ms", until: "60 s",
        metrics: { "done": (of: "F.done"), "far": (of: "F.distance", take: "max") }"#,
        want: &[("done", 1.0, 0.0), ("far", 0.5, 0.7)],
    },
    Case {
        report: "cannon.js #170, #301, raisimLib #241: the edges of a height field, rows and columns",
        text: r#"bodies: {
            "ground": (parent: "world", shapes: [(shape: Box([0.1, 0.1, 0.1]), visible: false, collide: (shape: HeightField(spacing: 0.5, heights: [[0, 0, 0, 0, 0], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0.25]])))]),
            "e": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.05), shapes: [(shape: Sphere(0.05), collide: (group: "e", meets: ["default"]))], initial: (position: [0.98, -0.2, 0.1])),
            "w": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.05), shapes: [(shape: Sphere(0.05), collide: (group: "e", meets: ["default"]))], initial: (position: [-0.98, 0, 0.1])),
            "n": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.05), shapes: [(shape: Sphere(0.05), collide: (group: "e", meets: ["default"]))], initial: (position: [0, 0.48, 0.1])),
            "s": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.05), shapes: [(shape: Sphere(0.05), collide: (group: "e", meets: ["default"]))], initial: (position: [0, -0.48, 0.1])),
            "o": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.05), shapes: [(shape: Sphere(0.05), collide: (group: "e", meets: ["default"]))], initial: (position: [1.1, 0, 0.1])),
            "p": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.05), shapes: [(shape: Sphere(0.05), collide: (group: "e", meets: ["default"]))], initial: (position: [0, 0.6, 0.1])),
            "rod": (parent: "world", at: (position: [0.99, 0.49, 1]), hinge: Slider([0, 0, 1]), mass: 1, inertia: Sphere(0.005), shapes: [(shape: Sphere(0.005), collide: (group: "e", meets: ["default"]))]),
        },
        parts: { EARTH }, contact: (neighbours: Collide), step: "1 ms", until: "1 s",
        metrics: { "e": (of: "e.position.z"), "w": (of: "w.position.z"), "n": (of: "n.position.z"), "s": (of: "s.position.z"), "o": (of: "o.position.z", take: "max"), "p": (when: "p.position.z < -1 m"), "q": (when: "o.position.z < -1 m"), "corner": (of: "rod.displacement") }"#,
        want: &[
            ("e", 0.05, 2e-4),
            ("w", 0.05, 2e-4),
            ("n", 0.05, 2e-4),
            ("s", 0.05, 2e-4),
            ("o", 0.1, 0.0),
            ("p", 1.0, 0.0),
            ("q", 1.0, 0.0),
            ("corner", -0.755, 0.012),
        ],
    },
    Case {
        report: "chrono PR 139: the normal force of a wheel drives it on slopes; a wheel that rolls down freely",
        text: r#"bodies: {
            "wheel": (parent: "world", hinge: Free, mass: 10, inertia: Cylinder(radius: 0.25, length: 0.2, axis: [0, 1, 0]), initial: (position: [0, 0, 0.25385])),
        },
        parts: { EARTH, "Ground": (model: "environment.flat", params: { "slope": "10 deg", "uphill": 0 }),
            "W": (model: "mobility.wheel_rigid", params: { "radius": 0.25, "width": 0.2, "friction": 0.8 }, bind: { "hub": "node:wheel" }), "M": (model: "sensors.motion", bind: { "mount": "node:wheel" }) },
        step: "1 ms", until: "2 s",
        // a = 2/3 g sin 10 along the slope.
        metrics: { "x": (of: "M.velocity.x"), "y": (of: "M.velocity.y", take: "max_abs"), "slip": (of: "W.slip") }"#,
        want: &[("x", -2.2368, 0.02), ("y", 0.0, 1e-6), ("slip", 0.0, 0.01)],
    },
    Case {
        report: "chrono #565: slip of a driven, a braked and a locked wheel",
        text: r#"bodies: {
            "cart": (parent: "world", at: (position: [0, 0, 0.2499]), hinge: Slider(axis: [1, 0, 0], prescribed: true), initial: (rate: 0.1)),
            "wheel": (parent: "cart", hinge: Pin(axis: [0, 1, 0], prescribed: true), mass: 1, inertia: [1, 1, 1], initial: (rate: 0.8)),
        },
        parts: { EARTH, "Ground": (model: "environment.flat"),
            "C": (model: "basics.slider_trajectory", params: { "profile": [[0, 0.1], [10, 0.1]], "gives": rate }, bind: { "hinge": "hinge:cart" }),
            "T": (model: "basics.hinge_trajectory", params: { "profile": [[0, 0.8], [1, 0.8], [1.1, 0.2], [2, 0.2], [2.1, 0], [3, 0]], "gives": rate, "between": straight }, bind: { "hinge": "hinge:wheel" }),
            "W": (model: "mobility.wheel_rigid", params: { "radius": 0.25, "width": 0.2, "friction": 0.8 }, bind: { "hub": "node:wheel" }) },
        step: "1 ms", until: "3 s",
        metrics: { "driven": (of: "W.slip", at: "time >= 0.9 s"), "braked": (of: "W.slip", at: "time >= 1.9 s"), "locked": (of: "W.slip"), "pull": (of: "W.contact_force.x", at: "time >= 0.9 s"), "drag": (of: "W.contact_force.x") }"#,
        want: &[
            ("driven", 0.5, 1e-6),
            ("braked", -0.5, 1e-6),
            ("locked", -1.0, 1e-6),
            ("pull", 32.0, 3.0),
            ("drag", -32.0, 3.0),
        ],
    },
    Case {
        report: "chrono #356: a wheel that is set down on soil comes to rest where the soil carries its weight",
        text: r#"bodies: { "wheel": (parent: "world", at: (position: [0, 0, 0.25]), hinge: Chain(Slider([0, 0, 1])), mass: 20, inertia: [1, 1, 1]) },
        parts: { EARTH, "Ground": (model: "environment.flat", params: { "soil": { "kind": "dry_sand" } }),
            "W": (model: "mobility.wheel_soil", params: { "radius": 0.25, "width": 0.2 }, bind: { "hub": "node:wheel" }) },
        step: "1 ms", until: "5 s",
        metrics: { "load": (of: "W.normal_force"), "pull": (of: "W.contact_force.x"), "rest": (when: "wheel.speed < 1 um/s"), "slip": (of: "W.slip") }"#,
        want: &[("load", 196.2, 0.02), ("pull", 0.0, 1e-6), ("slip", 0.0, 0.0), ("rest", 1.0, 0.0)],
    },
    Case {
        report: "gazebo-classic PR 3164, ZephyrCab #4: rolling resistance of soft soil opposes motion both ways (that the wheel does not come to rest is listed in limits.md)",
        text: r#"bodies: {
            "cart": (parent: "world", at: (position: [0, 0, 0.25]), hinge: Slider([1, 0, 0]), mass: 1, inertia: [1, 1, 1], initial: (rate: 0.3)),
            "yoke": (parent: "cart", hinge: Slider([0, 0, 1]), mass: 20, inertia: [1, 1, 1]),
            "wheel": (parent: "yoke", hinge: Pin([0, 1, 0]), mass: 5, inertia: [0.2, 0.3, 0.2], initial: (rate: 1.2)),
            "cart2": (parent: "world", at: (position: [0, 5, 0.25]), hinge: Slider([1, 0, 0]), mass: 1, inertia: [1, 1, 1], initial: (rate: -0.3)),
            "yoke2": (parent: "cart2", hinge: Slider([0, 0, 1]), mass: 20, inertia: [1, 1, 1]),
            "wheel2": (parent: "yoke2", hinge: Pin([0, 1, 0]), mass: 5, inertia: [0.2, 0.3, 0.2], initial: (rate: -1.2)),
        },
        parts: { EARTH, "Ground": (model: "environment.flat", params: { "soil": { "kind": "dry_sand" } }),
            "A": (model: "mobility.wheel_soil", params: { "radius": 0.25, "width": 0.2 }, bind: { "hub": "node:wheel" }),
            "B": (model: "mobility.wheel_soil", params: { "radius": 0.25, "width": 0.2 }, bind: { "hub": "node:wheel2" }) },
        step: "1 ms", until: "5 s",
        metrics: { "mirror": (when: "abs(cart.displacement + cart2.displacement) < 1 um"), "way": (when: "cart.displacement > 1 cm") }"#,
        want: &[("mirror", 1.0, 0.0), ("way", 1.0, 0.0)],
    },
    Case {
        report: "gz-sim #2529: what the greatest steering angle means for the radius",
        text: r#"parts: {
            "V": (model: "basics.constant", params: { "value": 1 }), "W": (model: "basics.constant", params: { "value": 2 }),
            "A": (model: "control.ackermann", rate: "100 Hz", params: { "radius": 0.1, "acceleration": 1000, "steer_rate": 1000, "steer_max": "30 deg", "wheels": WHEELS }),
            "O": (model: "control.odometry", rate: "100 Hz", params: { "radius": 0.1, "wheels": WHEELS }) },
        wires: ["V.y -> A.speed", "W.y -> A.turn_rate", "A.wheels[*].drive.rate -> O.wheels[*].rate", "A.wheels[*].steer -> O.wheels[*].steer"],
        step: "10 ms", until: "5 s",
        // The inner wheel is at 30 degrees: R = 1 / tan 30 + 0.3.
        metrics: { "inner": (of: "A.wheels[0].steer", unit: "deg"), "speed": (of: "O.speed"), "turn": (of: "O.turn_rate") }"#,
        want: &[("inner", 30.0, 1e-6), ("speed", 1.0, 1e-9), ("turn", 0.492_113_7, 1e-6)],
    },
    Case {
        report: "raisimLib #33, gazebo-classic #245: a height field that is moved and turned",
        text: r#"bodies: {
            "ground": (parent: "world", at: (position: [10, 5, 2], rotation: (rpy: [0, 0, "90 deg"])), shapes: [(shape: Box([0.1, 0.1, 0.1]), visible: false, collide: (shape: HeightField(spacing: 0.5, heights: [[0, 0, 0, 0, 0], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0.25]])))]),
            // The corner at (1, 0.5) of the field is at (9.5, 6) of the world.
            "corner": (parent: "world", at: (position: [9.51, 5.99, 4]), hinge: Slider([0, 0, 1]), mass: 1, inertia: Sphere(0.005), shapes: [(shape: Sphere(0.005), collide: (group: "e", meets: ["default"]))]),
            "flat": (parent: "world", at: (position: [10.4, 4.1, 4]), hinge: Slider([0, 0, 1]), mass: 1, inertia: Sphere(0.005), shapes: [(shape: Sphere(0.005), collide: (group: "e", meets: ["default"]))]),
        },
        parts: { EARTH }, contact: (neighbours: Collide), step: "1 ms", until: "1.5 s",
        metrics: { "corner": (of: "corner.displacement"), "flat": (of: "flat.displacement") }"#,
        want: &[("corner", -1.755, 0.012), ("flat", -1.995, 3e-4)],
    },
    Case {
        report: "chrono PR 652, #678: torque at the axle of a wheel that slips is the force times the radius",
        text: r#"bodies: {
            "yoke": (parent: "world", at: (position: [0, 0, 0.25]), hinge: Slider([0, 0, 1]), mass: 20, inertia: [1, 1, 1]),
            "wheel": (parent: "yoke", hinge: Pin([0, 1, 0]), mass: 5, inertia: [0.2, 0.3, 0.2]),
        },
        parts: { EARTH, "Ground": (model: "environment.flat"), "Rate": (model: "basics.constant", params: { "value": 2 }), "Supply": (model: "power.ideal_supply", params: { "voltage": 24 }),
            "Servo": (model: "actuators.rate_servo", params: { "gain": 100 }, bind: { "shaft": "hinge:wheel" }),
            "W": (model: "mobility.wheel_rigid", params: { "radius": 0.25, "width": 0.2, "friction": 0.5 }, bind: { "hub": "node:wheel" }) },
        wires: ["Rate.y -> Servo.rate"], connect: [("Servo.supply", "Supply.terminal")], step: "1 ms", until: "3 s",
        // mu m g = 122.625 N, 0.25 m less the penetration.
        metrics: { "force": (of: "W.contact_force.x"), "torque": (of: "Servo.torque"), "load": (of: "W.normal_force") }"#,
        want: &[("force", 122.625, 0.3), ("torque", 30.62, 0.2), ("load", 245.25, 0.01)],
    },
    Case {
        report: "godot_heightmap_plugin #189, #194: what touches a slope of a height field stands beside it",
        text: r#"bodies: {
            "ground": (parent: "world", shapes: [(shape: Box([0.1, 0.1, 0.1]), visible: false, collide: (friction: 0, shape: HeightField(spacing: 1, heights: [[0, 0.5, 1], [0, 0.5, 1], [0, 0.5, 1]])))]),
            "ball": (parent: "world", at: (position: [0.25, 0.3, 4]), hinge: Slider([0, 0, 1]), mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: (friction: 0))]),
        },
        parts: { EARTH }, contact: (neighbours: Collide), step: "1 ms", until: "2 s",
        // z = 0.5 + x / 2 and r / cos of the slope.
        metrics: { "z": (of: "ball.displacement") }"#,
        want: &[("z", 0.625 + 0.111_803_4 - 4.0, 3e-4)],
    },
    Case {
        report: "chrono #370, ODE users: the force of a wheel that is set in motion has no jumps",
        text: r#"bodies: {
            "cart": (parent: "world", at: (position: [0, 0, 0.25]), hinge: Slider([1, 0, 0]), mass: 20, inertia: [1, 1, 1]),
            "yoke": (parent: "cart", hinge: Slider([0, 0, 1]), mass: 1, inertia: [1, 1, 1]),
            "wheel": (parent: "yoke", hinge: Pin([0, 1, 0]), mass: 5, inertia: [0.2, 0.3, 0.2]),
        },
        parts: { EARTH, "Ground": (model: "environment.flat"), "Torque": (model: "basics.ramp", params: { "time": 1, "slope": 0.5 }), "Supply": (model: "power.ideal_supply", params: { "voltage": 24 }),
            "Drive": (model: "actuators.torque_drive", bind: { "shaft": "hinge:wheel" }),
            "W": (model: "mobility.wheel_rigid", params: { "radius": 0.25, "width": 0.2, "friction": 0.8 }, bind: { "hub": "node:wheel" }), "Pull": (model: "basics.differentiator", rate: "100 Hz") },
        wires: ["Torque.y -> Drive.torque", "W.contact_force.x -> Pull.u"], connect: [("Drive.supply", "Supply.terminal")], step: "1 ms", until: "4 s",
        // a = T / r / (m + I / r^2) with m = 26 kg; the wheel carries 6 kg.
        metrics: { "speed": (of: "cart.speed"), "force": (of: "W.contact_force.x"), "jump": (of: "Pull.y", take: "max_abs") }"#,
        want: &[
            ("speed", 0.5 * 4.5 / 0.25 / 30.8, 0.004),
            ("force", 1.5 / 0.25 * 26.0 / 30.8, 0.03),
            ("jump", 2.0, 1.5),
        ],
    },
];

#[test]
fn rover() {
    hold(CASES);
}
