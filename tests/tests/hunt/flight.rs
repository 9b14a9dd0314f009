//! Flight and orbit. The log is `tests/hunt/flight.md`.
use super::{Case, Refused, hold, refuse};

const CASES: &[Case] = &[
    Case {
        report: "textbook: elements of Mars refer to its equator or to inertial axes, and flight.orbit gives them back in both",
        text: r#"world: (body: "mars", epoch: "2030-01-01 00:00:00 UTC"),
        bodies: {
            "polar": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (elements: (frame: equator, semi_major_axis: "3800 km", eccentricity: 0.05, inclination: "93 deg", ascending_node: "40 deg", pericentre: "270 deg", anomaly: "10 deg"))),
            "other": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (elements: (frame: inertial, semi_major_axis: "3800 km", eccentricity: 0.05, inclination: "93 deg", ascending_node: "40 deg", pericentre: "270 deg", anomaly: "10 deg"))),
        },
        parts: {
            "Gravity": (model: "environment.point_mass_gravity"),
            "A": (model: "flight.orbit", bind: { "body": "node:polar" }),
            "B": (model: "flight.orbit", params: { "axes": inertial }, bind: { "body": "node:other" }),
            "Ground": (model: "flight.ground_motion", bind: { "body": "node:polar" }),
        },
        step: "10 s", integrator: "verner_87", until: "2 h",
        metrics: {
            "a": (of: "A.semi_major_axis", unit: "km"), "i": (of: "A.inclination", unit: "deg"), "node": (of: "A.ascending_node", unit: "deg"),
            "pericentre": (of: "A.argument_of_pericentre", unit: "deg"), "anomaly": (of: "A.anomaly", unit: "deg", at: "time >= 0 s"),
            "other i": (of: "B.inclination", unit: "deg"), "other node": (of: "B.ascending_node", unit: "deg"), "other pericentre": (of: "B.argument_of_pericentre", unit: "deg"),
            "south": (of: "Ground.latitude", take: "min", unit: "deg"),
        }"#,
        // The geodetic latitude at the southernmost point of an orbit of 93 degrees is 87 degrees plus 2e-2 degrees of flattening.
        want: &[
            ("a", 3800.0, 1e-6),
            ("i", 93.0, 1e-8),
            ("node", 40.0, 1e-8),
            ("pericentre", 270.0, 1e-6),
            ("anomaly", 10.0, 1e-6),
            ("other i", 93.0, 1e-8),
            ("other node", 40.0, 1e-8),
            ("other pericentre", 270.0, 1e-6),
            ("south", -87.0, 0.1),
        ],
    },
    Case {
        report: "textbook: a pass through the zenith lasts for acos(R cos e/a) - e of half an orbit",
        text: r#"world: (body: "earth", turns: still),
        bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "7378.137 km", anomaly: "200 deg"))) },
        parts: {
            "Gravity": (model: "environment.point_mass_gravity"),
            "Station": (model: "flight.ground_station", params: { "latitude": 0, "longitude": "30 deg", "elevation_min": "10 deg" }, bind: { "body": "node:a" }),
        },
        step: "60 s", integrator: "verner_87", until: "6360 s", stop_when: "time >= 6307.1194 s",
        metrics: { "share": (when: "Station.visible", take: "mean"), "high": (of: "Station.elevation", take: "max", unit: "deg"), "near": (of: "Station.range", take: "min", unit: "km"), "rises in": (of: "Station.azimuth", at: "Station.visible", unit: "deg") }"#,
        // The arc is 2 (31.6432 - 10) degrees of 360.
        want: &[
            ("share", 0.120_24, 2e-4),
            ("high", 90.0, 1e-1),
            ("near", 1000.0, 1e-3),
            ("rises in", 270.0, 1e-6),
        ],
    },
    Case {
        report: "SatelliteToolbox.jl #25, jorbit PR 63, anise #718: a circular orbit in the equator",
        text: r#"world: (body: "earth"),
        bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "7000 km", anomaly: "90 deg"))) },
        parts: { "Gravity": (model: "environment.point_mass_gravity"), "Orbit": (model: "flight.orbit", bind: { "body": "node:a" }) },
        step: "60 s", integrator: "verner_87", until: "2 h",
        metrics: { "x": (of: "a.position.x", at: "time >= 0 s"), "y": (of: "a.position.y", at: "time >= 0 s"), "e": (of: "Orbit.eccentricity", take: "max"), "i": (of: "Orbit.inclination", take: "max_abs"), "height": (of: "Orbit.height", take: "range"),
            "back": (of: "a.position.y", at: "time >= 5828.5166 s"), "node": (when: "abs(Orbit.ascending_node) < 7 rad") }"#,
        want: &[
            ("x", 0.0, 1e-6),
            ("y", 7e6, 1e-6),
            ("e", 0.0, 1e-8),
            ("i", 0.0, 1e-12),
            ("height", 0.0, 0.05),
            ("back", 7e6, 1.0),
            ("node", 1.0, 0.0),
        ],
    },
    Case {
        report: "orbital PR 48, kOS_scripts #146: an orbit that is retrograde in the equator",
        text: r#"world: (body: "earth"),
        bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "8000 km", eccentricity: 0.1, inclination: "180 deg"))) },
        parts: { "Gravity": (model: "environment.point_mass_gravity"), "Orbit": (model: "flight.orbit", bind: { "body": "node:a" }) },
        step: "60 s", integrator: "verner_87", until: "1 h",
        metrics: { "x": (of: "a.position.x", at: "time >= 0 s"), "v": (of: "a.velocity.y", at: "time >= 0 s"), "i": (of: "Orbit.inclination", unit: "deg"), "e": (of: "Orbit.eccentricity"), "low": (of: "Orbit.pericentre", unit: "km"), "high": (of: "Orbit.apocentre", unit: "km") }"#,
        // The speed is v = sqrt(mu (1 + e) / (a (1 - e))).
        want: &[
            ("x", 7.2e6, 1e-6),
            ("v", -7_803.671_554, 1e-5),
            ("i", 180.0, 1e-6),
            ("e", 0.1, 1e-9),
            ("low", 821.863, 1e-6),
            ("high", 2421.863, 1e-6),
        ],
    },
    Case {
        report: "anise #821, poliastro #383: elements after a while are those of the start (argument of the pericentre 0)",
        text: r#"world: (body: "earth"),
        bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "26560 km", eccentricity: 0.02, inclination: "55 deg", ascending_node: "120 deg", pericentre: 0, anomaly: "240 deg"))) },
        parts: { "Gravity": (model: "environment.point_mass_gravity"), "Orbit": (model: "flight.orbit", bind: { "body": "node:a" }) },
        step: "600 s", integrator: "verner_87", until: "30 h",
        metrics: { "e": (of: "Orbit.eccentricity"), "i": (of: "Orbit.inclination", unit: "deg"), "node": (of: "Orbit.ascending_node", unit: "deg") }"#,
        want: &[("e", 0.02, 1e-9), ("i", 55.0, 1e-8), ("node", 120.0, 1e-8)],
    },
    Case {
        report: "poliastro #275, #347, rebound PR 866: a hyperbola (energy, excess speed, no apocentre)",
        text: r#"world: (body: "earth"),
        bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "-20000 km", eccentricity: 1.5))) },
        parts: { "Gravity": (model: "environment.point_mass_gravity"), "Orbit": (model: "flight.orbit", bind: { "body": "node:a" }) },
        step: "1 h", integrator: "verner_87", until: "1000 h",
        metrics: { "energy": (of: "Orbit.energy"), "e": (of: "Orbit.eccentricity"), "speed": (of: "Orbit.speed"), "low": (of: "Orbit.pericentre", unit: "km"), "high": (of: "Orbit.apocentre") }"#,
        // The speed follows from v^2 = mu (2/r + 1/20000 km).
        want: &[
            ("energy", 9_965_011.0, 1.0),
            ("e", 1.5, 1e-8),
            ("speed", 4471.9, 8.0),
            ("low", 3621.863, 1e-3),
            ("high", 1e30, 0.0),
        ],
    },
    Case {
        report: "pious_squid #2, CoordRefSystems.jl #358, IRBEM #29, skyfield PR 842: height at the poles",
        text: r#"world: (body: "earth"),
        bodies: {
            "n": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (geodetic: (latitude: "90 deg", longitude: 0, height: 100))),
            "s": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (geodetic: (latitude: "-90 deg", longitude: "20 deg", height: -100))) },
        parts: { "N": (model: "flight.ground_motion", bind: { "body": "node:n" }), "S": (model: "flight.ground_motion", bind: { "body": "node:s" }) }, gravity: "none",
        step: "1 s", until: "1 s",
        metrics: { "n": (of: "n.position.z", at: "time >= 0 s"), "lat": (of: "N.latitude", unit: "deg", at: "time >= 0 s"), "high": (of: "N.altitude", at: "time >= 0 s"), "slat": (of: "S.latitude", unit: "deg", at: "time >= 0 s"), "low": (of: "S.altitude", at: "time >= 0 s"), "lon": (when: "abs(S.longitude) < 4 rad") }"#,
        want: &[
            ("n", 6_356_852.314_2, 1e-3),
            ("lat", 90.0, 1e-7),
            ("high", 100.0, 1e-6),
            ("slat", -90.0, 1e-7),
            ("low", -100.0, 1e-6),
            ("lon", 1.0, 0.0),
        ],
    },
    Case {
        report: "pymap3d #20, #21, pyorbital PR 247: heights below the ellipsoid and far above it",
        text: r#"world: (body: "earth"),
        bodies: {
            "a": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (geodetic: (latitude: "31.5 deg", longitude: "35.5 deg", height: -430))),
            "b": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (geodetic: (latitude: "-45 deg", longitude: "-170 deg", height: "36000 km"))) },
        parts: { "A": (model: "flight.ground_motion", bind: { "body": "node:a" }), "B": (model: "flight.ground_motion", bind: { "body": "node:b" }) }, gravity: "none",
        step: "1 s", until: "1 s",
        metrics: { "h": (of: "A.altitude", at: "time >= 0 s"), "lat": (of: "A.latitude", unit: "deg", at: "time >= 0 s"), "lon": (of: "A.longitude", unit: "deg", at: "time >= 0 s"), "speed": (of: "A.speed", at: "time >= 0 s"),
            "H": (of: "B.altitude", at: "time >= 0 s"), "Lat": (of: "B.latitude", unit: "deg", at: "time >= 0 s"), "Lon": (of: "B.longitude", unit: "deg", at: "time >= 0 s") }"#,
        want: &[
            ("h", -430.0, 1e-6),
            ("lat", 31.5, 1e-9),
            ("lon", 35.5, 1e-9),
            ("speed", 0.0, 1e-6),
            ("H", 3.6e7, 1e-5),
            ("Lat", -45.0, 1e-9),
            ("Lon", -170.0, 1e-9),
        ],
    },
    Case {
        report: "RocketPy #930: under a parachute a rocket drifts against the wind",
        text: r#"bodies: { "a": (parent: "world", hinge: Free, mass: 10, inertia: [1, 1, 1], initial: (position: [0, 0, 1000])) },
        parts: { EARTH, "Air": (model: "environment.exponential_atmosphere", params: { "density": 1.2, "scale_height": "8000 km", "temperature": 288, "gas_constant": 287, "heat_ratio": 1.4, "heating_constant": 0, "wind": [5, -3, 0] }),
            "Drag": (model: "flight.drag", params: { "coefficient": 1, "area": 0.01 }, bind: { "body": "node:a" }),
            "Canopy": (model: "flight.canopy", params: { "diameter": 4, "drag_coefficient": 0.8, "porosity": 12.5, "start": 5 }, bind: { "canopy": "node:a" }), "M": (model: "sensors.motion", bind: { "mount": "node:a" }) },
        step: "10 ms", until: "60 s",
        metrics: { "x": (of: "M.velocity.x"), "y": (of: "M.velocity.y"), "z": (of: "M.velocity.z"), "back": (of: "M.velocity.x", take: "min") }"#,
        // The terminal speed is sqrt(2 m g / (rho (C_D S)) with C_D S = 0.8 pi 4 + 0.01.
        want: &[("x", 5.0, 1e-3), ("y", -3.0, 1e-3), ("z", -4.031, 0.01), ("back", 0.0, 1e-9)],
    },
    Case {
        report: "RocketPy #1186, basilisk #474: sign of the moment of a force, and of drag, beside the centre of mass",
        text: r#"bodies: {
            "a": (parent: "world", hinge: Free, mass: 1e6, inertia: [10, 10, 10], inertia_check: PositiveMoments, nodes: { "p": (position: [0.5, 0, 0]) }),
            "b": (parent: "world", hinge: Free, mass: 1e6, inertia: [1e6, 1e6, 1e6], initial: (velocity: [100, 0, 0]), nodes: { "p": (position: [0, 0, 0.5]) }) },
        parts: { "Air": (model: "environment.exponential_atmosphere", params: { "density": 1, "scale_height": "8000 km", "temperature": 288, "gas_constant": 287, "heat_ratio": 1.4, "heating_constant": 0 }),
            "F": (model: "flight.body_load", params: { "rows": [(time: 0, force: [0, 0, 20])] }, bind: { "body": "node:a/p" }),
            "D": (model: "flight.drag", params: { "coefficient": 1, "area": 2 }, bind: { "body": "node:b/p" }) },
        gravity: "none", step: "1 ms", until: "0.1 s",
        metrics: { "a": (of: "a.angular.y"), "b": (of: "b.angular.y"), "drag": (of: "D.drag") }"#,
        // The rates follow from r x F: -0.5 x 20 / 10 and -0.5 x 10 kN / 1e6, for 0.1 s.
        want: &[("a", -0.1, 1e-4), ("b", -5e-4, 1e-7), ("drag", 10_000.0, 30.0)],
    },
    Case {
        report: "Pulsar4x #304, FlightPlan #10: a Hohmann transfer by burns that take minutes",
        text: r#"world: (body: "earth"),
        bodies: { "a": (parent: "world", hinge: Free, mass: 800, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "6778.137 km", eccentricity: 0))) },
        parts: { "Gravity": (model: "environment.point_mass_gravity"),
            "Tank": (model: "flight.propellant_tank", params: { "propellant": 250, "radius": "10 um", "density": 1e20 }, bind: { "bottom": "node:a" }),
            "Mass": (model: "basics.gain", params: { "k": 1, "offset": 800 }),
            "Plan": (model: "flight.orbit_burns", rate: "1 Hz", params: { "burns": [(time: 500, opposite: "7178.137 km"), (at: apoapsis, opposite: "7178.137 km")], "thrust": 800 }, bind: { "body": "node:a" }),
            "Engine": (model: "flight.vector_thrust", params: { "specific_impulse": "318 s" }, bind: { "body": "node:a" }), "Orbit": (model: "flight.orbit", bind: { "body": "node:a" }) },
        wires: ["Tank.propellant -> Mass.u", "Mass.y -> Plan.mass", "Plan.force -> Engine.command"], connect: [("Engine.propellant", "Tank.outlet")],
        step: "1 s", integrator: "dormand_prince_54", until: "6000 s",
        metrics: { "low": (of: "Orbit.pericentre", unit: "km"), "high": (of: "Orbit.apocentre", unit: "km"), "done": (of: "Plan.done") }"#,
        // Each burn takes 140 s, in which the craft moves by 8 degrees of the orbit.
        want: &[("low", 800.0, 1.0), ("high", 800.0, 1.0), ("done", 2.0, 0.0)],
    },
    Case {
        report: "RemoteTech #255, #243: the velocity that a burn gives while much of the mass is burnt",
        text: r#"world: (body: "earth"),
        bodies: { "a": (parent: "world", hinge: Free, mass: 500, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "42164 km", eccentricity: 0))) },
        parts: { "Gravity": (model: "environment.point_mass_gravity"),
            "Tank": (model: "flight.propellant_tank", params: { "propellant": 500, "radius": "10 um", "density": 1e20 }, bind: { "bottom": "node:a" }),
            "Mass": (model: "basics.gain", params: { "k": 1, "offset": 500 }),
            "Plan": (model: "flight.orbit_burns", rate: "20 Hz", params: { "burns": [(time: 60, delta_v: [0, 0, 1500])], "thrust": 50000 }, bind: { "body": "node:a" }),
            "Engine": (model: "flight.vector_thrust", params: { "specific_impulse": "300 s" }, bind: { "body": "node:a" }) },
        wires: ["Tank.propellant -> Mass.u", "Mass.y -> Plan.mass", "Plan.force -> Engine.command"], connect: [("Engine.propellant", "Tank.outlet")],
        step: "10 ms", integrator: "rk4", until: "120 s",
        metrics: { "left": (of: "Tank.propellant") }"#,
        // The remaining propellant is 1000 kg e^(-1500/(300 x 9.80665)) - 500 kg.
        want: &[("left", 100.581, 0.02)],
    },
    Case {
        report: "tudat #13: along the motion is horizontal and not along the velocity, which is 31 degrees above it here",
        text: r#"world: (body: "earth"),
        bodies: {
            "a": (parent: "world", hinge: Free, mass: 1000, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "26560 km", eccentricity: 0.6, inclination: "40 deg", anomaly: "90 deg"))),
            "b": (parent: "world", hinge: Free, mass: 1000, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "26560 km", eccentricity: 0.6, inclination: "40 deg", anomaly: "90 deg"))) },
        parts: { "Gravity": (model: "environment.point_mass_gravity"), "M": (model: "basics.constant", params: { "value": 1000 }), "Feed": (model: "flight.ideal_feed"),
            "A": (model: "flight.orbit_burns", rate: "100 Hz", params: { "burns": [(time: 0.005, delta_v: [0, 500, 0])], "thrust": 1e9 }, bind: { "body": "node:a" }),
            "B": (model: "flight.orbit_burns", rate: "100 Hz", params: { "burns": [(time: 0.005, delta_v: [300, 0, 0])], "thrust": 1e9 }, bind: { "body": "node:b" }),
            "EA": (model: "flight.vector_thrust", params: { "specific_impulse": 1e9 }, bind: { "body": "node:a" }), "EB": (model: "flight.vector_thrust", params: { "specific_impulse": 1e9 }, bind: { "body": "node:b" }),
            "OA": (model: "flight.orbit", bind: { "body": "node:a" }), "OB": (model: "flight.orbit", bind: { "body": "node:b" }) },
        wires: ["M.y -> A.mass", "M.y -> B.mass", "A.force -> EA.command", "B.force -> EB.command"], connect: [("EA.propellant", "EB.propellant", "Feed.outlet")],
        step: "1 ms", integrator: "rk4", until: "1 s",
        metrics: { "ahead": (of: "OA.energy"), "out": (of: "OB.energy") }"#,
        // The energy is ((v_r + dv_r)^2 + (v_t + dv_t)^2)/2 - mu/r with r = p, v_r = 0.6 sqrt(mu/p), v_t
        // = sqrt(mu/p).
        want: &[("ahead", -4_957_549.936, 10.0), ("out", -6_587_132.939, 10.0)],
    },
    Case {
        report: "SymbolicAWEModels.jl #263, mujoco #520: a slack line exerts nothing, also while its damper would push, and holds again",
        text: r#"bodies: { "post": (parent: "world"), "load": (parent: "world", hinge: Slider([1, 0, 0]), mass: 2, inertia: [1, 1, 1], initial: (position: 1)) },
        gravity: "none",
        parts: { "Line": (model: "flight.line", params: { "length": 1, "stiffness": 100, "damping": 200 }, bind: { "a": "node:post", "b": "node:load" }),
            "Pull": (model: "flight.body_load", params: { "rows": [(time: 0, force: [50, 0, 0]), (time: 2, force: [-50, 0, 0]), (time: 2.05, force: [50, 0, 0])] }, bind: { "body": "node:load" }) },
        step: "1 ms", integrator: "rk4", until: "30 s",
        metrics: { "least": (of: "Line.tension", take: "min"), "last": (of: "Line.tension"), "long": (of: "Line.extension") }"#,
        want: &[("least", 0.0, 0.0), ("last", 50.0, 0.01), ("long", 0.5, 1e-4)],
    },
    Case {
        report: "42 #123: a deputy on the closed ellipse of Clohessy and Wiltshire, in the turning axes of its chief",
        text: r#"world: (body: "earth", mu: 3.986004418e14),
        bodies: { "chief": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (position: [7e6, 0, 0], velocity: [0, 7546.053290107542, 0])),
            "deputy": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (position: [7000010, 0, 5], velocity: [0, 7546.042510031413, 0])) },
        parts: { "Gravity": (model: "environment.point_mass_gravity"), "VisualShape": (model: "flight.station_keeping", params: { "mass": 1, "force_max": 0 }, bind: { "chief": "node:chief", "deputy": "node:deputy" }) },
        step: "10 s", integrator: "verner_87", until: "5830 s",
        metrics: { "vy": (of: "VisualShape.velocity.y", at: "time >= 0 s"), "x": (of: "VisualShape.position.x", at: "time >= 1457.129 s"), "y": (of: "VisualShape.position.y", at: "time >= 1457.129 s"), "z": (of: "VisualShape.position.z", at: "time >= 1457.129 s"), "far": (of: "VisualShape.position.y", take: "max_abs") }"#,
        // With n = sqrt(mu/r^3) = 1.0780076e-3 rad/s the velocity is v_y = -2 n x, and after a quarter of the
        // orbit the position is (0, -2 x, 0).
        want: &[
            ("vy", -0.021_560_15, 1e-7),
            ("x", 0.0, 1e-3),
            ("y", -20.0, 1e-3),
            ("z", 0.0, 1e-3),
            ("far", 20.0, 1e-3),
        ],
    },
    Case {
        report: "KMAT #1: gravity that does not fall with height; a throw to a great height",
        text: r#"world: (body: "other", mu: "398600.4418 km^3/s^2", radius: "6378.137 km", turns: still),
        bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (position: ["6378.137 km", 0, 0], velocity: [3000, 0, 0])) },
        parts: { "Gravity": (model: "environment.point_mass_gravity") },
        step: "1 s", integrator: "dormand_prince_54", until: "500 s",
        metrics: { "top": (of: "a.position.x", take: "max", unit: "km") }"#,
        want: &[("top", 6_873.0, 1.0)],
    },
    Case {
        report: "Ferram #113, poliastro #1335, hapsira #23: density of the standard atmosphere from sea level to 1000 km (US Standard Atmosphere 1976, tables)",
        text: r#"world: (body: "earth"),
        bodies: {
            "a": (parent: "world", at: (position: ["6376.137 km", 0, 0])), "b": (parent: "world", at: (position: ["6378.137 km", 0, 0])), "c": (parent: "world", at: (position: ["6388.137 km", 0, 0])),
            "d": (parent: "world", at: (position: ["6428.137 km", 0, 0])), "e": (parent: "world", at: (position: ["6458.137 km", 0, 0])), "f": (parent: "world", at: (position: ["6578.137 km", 0, 0])),
            "g": (parent: "world", at: (position: ["6778.137 km", 0, 0])), "h": (parent: "world", at: (position: ["7378.137 km", 0, 0])) },
        parts: { "Air": (model: "environment.us76"),
            "A": (model: "flight.drag", params: { "coefficient": 1, "area": 1 }, bind: { "body": "node:a" }), "B": (model: "flight.drag", params: { "coefficient": 1, "area": 1 }, bind: { "body": "node:b" }),
            "C": (model: "flight.drag", params: { "coefficient": 1, "area": 1 }, bind: { "body": "node:c" }), "D": (model: "flight.drag", params: { "coefficient": 1, "area": 1 }, bind: { "body": "node:d" }),
            "E": (model: "flight.drag", params: { "coefficient": 1, "area": 1 }, bind: { "body": "node:e" }), "F": (model: "flight.drag", params: { "coefficient": 1, "area": 1 }, bind: { "body": "node:f" }),
            "G": (model: "flight.drag", params: { "coefficient": 1, "area": 1 }, bind: { "body": "node:g" }), "H": (model: "flight.drag", params: { "coefficient": 1, "area": 1 }, bind: { "body": "node:h" }) },
        gravity: "none", step: "1 s", until: "1 s",
        metrics: { "a": (of: "A.density"), "b": (of: "B.density"), "c": (of: "C.density"), "d": (of: "D.density"), "e": (of: "E.density"), "f": (of: "F.density"), "g": (of: "G.density"), "h": (of: "H.density") }"#,
        want: &[
            ("a", 1.4782, 1e-4),
            ("b", 1.225, 1e-6),
            ("c", 0.413_51, 1e-5),
            ("d", 1.0269e-3, 1e-7),
            ("e", 1.8458e-5, 1e-9),
            ("f", 2.541e-10, 1.5e-12),
            ("g", 2.803e-12, 1.5e-14),
            ("h", 3.561e-15, 2e-17),
        ],
    },
    Case {
        report: "SSAPy PR 123: sunlight presses in the shadow, and what counts as behind the Earth",
        text: r#"world: (body: "earth"),
        bodies: {
            "front": (parent: "world", at: (position: ["7000 km", 0, 0])), "behind": (parent: "world", at: (position: ["-7000 km", 0, 0])), "above": (parent: "world", at: (position: ["-7000 km", "6800 km", 0])), "edge": (parent: "world", at: (position: ["-7000 km", "6378.137 km", 0])) },
        parts: { "Sun": (model: "environment.fixed_sun", params: { "direction": [1, 0, 0], "distance_au": 1 }),
            "A": (model: "flight.radiation_pressure", params: { "area": 1 }, bind: { "body": "node:front" }), "B": (model: "flight.radiation_pressure", params: { "area": 1 }, bind: { "body": "node:behind" }),
            "C": (model: "flight.radiation_pressure", params: { "area": 1 }, bind: { "body": "node:above" }), "D": (model: "flight.radiation_pressure", params: { "area": 1 }, bind: { "body": "node:edge" }) },
        gravity: "none", step: "1 s", until: "1 s",
        metrics: { "a": (of: "A.visible"), "b": (of: "B.visible"), "c": (of: "C.visible"), "d": (of: "D.visible"), "p": (of: "A.pressure") }"#,
        want: &[
            ("a", 1.0, 0.0),
            ("b", 0.0, 0.0),
            ("c", 1.0, 0.0),
            ("d", 0.5, 0.01),
            ("p", 1361.0 / 299_792_458.0 * 1.000_093_592, 1e-13),
        ],
    },
    Case {
        report: "poliastro #1244: share of an orbit that is in the shadow",
        text: r#"world: (body: "earth", turns: still),
        bodies: { "a": (parent: "world", hinge: Free, mass: 1000, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "7000 km"))) },
        parts: { "Gravity": (model: "environment.point_mass_gravity"), "Sun": (model: "environment.fixed_sun", params: { "direction": [1, 0, 0], "distance_au": 1 }), "P": (model: "flight.radiation_pressure", params: { "area": 1 }, bind: { "body": "node:a" }) },
        step: "1 s", integrator: "dormand_prince_54", accuracy: (step_max: "1 s"), until: "5828.516 s",
        metrics: { "lit": (of: "P.visible", take: "mean") }"#,
        // The lit share is 1 - asin(R / a) / pi.
        want: &[("lit", 0.635_186, 2e-4)],
    },
    Case {
        report: "textbook: precession of the node by J2 (a Sun-synchronous orbit)",
        text: r#"world: (body: "earth"),
        bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "7178.137 km", inclination: "98.6 deg", ascending_node: "10 deg"))) },
        parts: { "Gravity": (model: "environment.zonal_gravity", params: { "j2": 1.08262668e-3 }), "Orbit": (model: "flight.orbit", bind: { "body": "node:a" }) },
        step: "60 s", integrator: "verner_87", until: "86400 s",
        metrics: { "node": (of: "Orbit.ascending_node", unit: "deg") }"#,
        // The node moves by -1.5 n J2 (R / a)^2 cos i, which is 0.985 deg a day eastwards.
        want: &[("node", 10.985_3, 0.01)],
    },
    Case {
        report: "textbook: total impulse of a thrust curve, and nothing after its end",
        text: r#"bodies: { "a": (parent: "world", hinge: Slider([0, 0, 1]), mass: 2, inertia: [1, 1, 1]) },
        parts: { "M": (model: "flight.solid_motor", params: { "curve": [[0, 0], [0.1, 60], [1.55, 20], [2, 0]], "specific_impulse": 200, "start": 0.333 }, bind: { "nozzle": "node:a" }), "F": (model: "flight.ideal_feed") },
        connect: [("M.propellant", "F.outlet")], gravity: "none", step: "0.5 s", until: "4 s",
        // 3 + 58 + 4.5 N s over 2 kg.
        metrics: { "v": (of: "a.speed"), "burnt": (of: "F.drawn"), "thrust": (of: "M.thrust") }"#,
        want: &[
            ("v", 32.75, 1e-6),
            ("burnt", 65.5 / (200.0 * 9.806_65), 1e-9),
            ("thrust", 0.0, 0.0),
        ],
    },
    Case {
        report: "openrocket PR 519, PR 1221: a thrust curve that begins and ends with a thrust, and nothing after its end",
        text: r#"bodies: { "a": (parent: "world", hinge: Slider([0, 0, 1]), mass: 2, inertia: [1, 1, 1]) },
        parts: { "M": (model: "flight.solid_motor", params: { "curve": [[0, 100], [1, 100], [2, 40]], "specific_impulse": 200, "start": 0.125 }, bind: { "nozzle": "node:a" }), "F": (model: "flight.ideal_feed") },
        connect: [("M.propellant", "F.outlet")], gravity: "none", step: "0.5 s", until: "4 s",
        // 100 + 70 N s over 2 kg.
        metrics: { "v": (of: "a.speed"), "burnt": (of: "F.drawn"), "thrust": (of: "M.thrust") }"#,
        want: &[
            ("v", 85.0, 1e-6),
            ("burnt", 170.0 / (200.0 * 9.806_65), 1e-9),
            ("thrust", 0.0, 0.0),
        ],
    },
    Case {
        report: "FlexibleSpacecraft.jl #63, PR 28, PASEOS PR 200: gravity gradient, sign and frequency of libration",
        text: r#"world: (body: "earth", turns: still),
        bodies: { "a": (parent: "world", hinge: Free, mass: 100, inertia: [10, 60, 60], initial: (elements: (semi_major_axis: "7000 km"), rotation: (rpy: [0, 0, 0.01]), angular: [0, 0, 1.078007612e-3])) },
        parts: { "Gravity": (model: "environment.point_mass_gravity"), "G": (model: "flight.gravity_gradient", bind: { "body": "node:a" }), "M": (model: "sensors.motion", bind: { "mount": "node:a" }) },
        step: "10 s", integrator: "verner_87", until: "4000 s", stop_when: "time >= 3686.2776 s",
        // Pitch: sqrt(3 (I_y - I_x) / I_z) n = 1.58114 n; half of it after 1/3.16228 of an orbit, on the other side of the vertical. A whole one after 5828.5166 s / 1.58114.
        metrics: { "rate": (of: "a.angular.z"), "torque": (of: "G.torque.z", at: "time >= 0 s") }"#,
        want: &[
            ("rate", 1.078_007_6e-3, 2e-7),
            ("torque", -1.5 * 1.162_100_4e-6 * 50.0 * 0.019_998_67, 1e-10),
        ],
    },
    Case {
        report: "orts PR 319: sign of the eastern component of the IGRF, normalisation of its middle orders",
        text: r#"world: (body: "earth", epoch: "2025-01-01 00:00:00 UTC", site: (latitude: 0, longitude: 0)),
        bodies: { "a": (parent: "world") },
        parts: { "Gravity": (model: "environment.point_mass_gravity"), "B": (model: "flight.magnetic_field", params: { "degree": 13 }, bind: { "body": "node:a" }) },
        step: 1, until: 1,
        // East, north, up by ppigrf 2.1 for 2025.0.
        metrics: { "x": (of: "B.field.x", unit: "nT", at: "time >= 0 s"), "y": (of: "B.field.y", unit: "nT", at: "time >= 0 s"), "z": (of: "B.field.z", unit: "nT", at: "time >= 0 s") }"#,
        want: &[("x", -1_926.548_58, 1e-3), ("y", 27_456.621_76, 1e-3), ("z", 15_997.352_90, 1e-3)],
    },
    Case {
        report: "textbook: eclipse of a geostationary satellite at the equinox, umbra and penumbra",
        text: r#"world: (body: "earth", turns: still), bodies: { "a": (parent: "world", hinge: Free, mass: 1000, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "42164 km"))) },
        parts: { "Gravity": (model: "environment.point_mass_gravity"), "Sun": (model: "environment.fixed_sun", params: { "direction": [1, 0, 0], "distance_au": 1 }), "P": (model: "flight.radiation_pressure", params: { "area": 1e-9 }, bind: { "body": "node:a" }) },
        step: "60 s", integrator: "dormand_prince_54", accuracy: (step_max: "30 s"), until: "86160 s",
        metrics: { "dark": (when: "P.visible <= 0", take: "mean"), "part": (when: "P.visible < 1", take: "mean") }"#,
        // (asin(R/a) -+ 0.2664 deg)/pi for one orbit of 86 164 s.
        want: &[("dark", 0.046_858, 1e-4), ("part", 0.049_819, 1e-4)],
    },
    Case {
        report: "textbook: drag lowers a circular orbit by da/dt = -rho C_D A/m sqrt(mu a)",
        text: r#"world: (body: "other", mu: "398600.4418 km^3/s^2", radius: "6378.137 km", turns: still), bodies: { "a": (parent: "world", hinge: Free, mass: 100, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "6778 km"))) },
        parts: { "Gravity": (model: "environment.point_mass_gravity"), "Air": (model: "environment.exponential_atmosphere", params: { "density": 1e-11, "scale_height": "1e9 km", "temperature": 800, "gas_constant": 287, "heat_ratio": 1.4, "heating_constant": 0 }),
            "D": (model: "flight.drag", params: { "coefficient": 2.2, "area": 2 }, bind: { "body": "node:a" }), "O": (model: "flight.orbit", bind: { "body": "node:a" }) },
        step: "60 s", integrator: "dormand_prince_54", until: "86400 s", metrics: { "energy": (of: "O.energy") }"#,
        // -mu/2a with sqrt(a) smaller by rho C_D A/(2 m) sqrt(mu) per second.
        want: &[("energy", -29_412_560.603, 2.0)],
    },
    Case {
        report: "textbook: the node of an eccentric orbit at the critical inclination",
        text: r#"world: (body: "earth"), bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "12000 km", eccentricity: 0.2, inclination: "63.4349488 deg", ascending_node: "50 deg", pericentre: "270 deg"))) },
        parts: { "Gravity": (model: "environment.zonal_gravity", params: { "j2": 1.08262668e-3 }), "O": (model: "flight.orbit", bind: { "body": "node:a" }) },
        step: "60 s", integrator: "verner_87", until: "432000 s", metrics: { "node": (of: "O.ascending_node", unit: "deg"), "e": (of: "O.eccentricity") }"#,
        // -1.5 n J2 (R/p)^2 cos i: -0.5293 deg a day.
        want: &[("node", 47.353_5, 0.02), ("e", 0.2, 3e-4)],
    },
    Case {
        report: "textbook: the rocket equation, until the tank is dry between two samples",
        text: r#"bodies: { "a": (parent: "world", hinge: Slider([0, 0, 1]), mass: 600, inertia: [1, 1, 1]) },
        parts: { "Tank": (model: "flight.propellant_tank", params: { "propellant": 400, "radius": "10 um", "density": 1e20 }, bind: { "bottom": "node:a" }), "E": (model: "flight.engine", params: { "thrust": 10000, "specific_impulse": 300 }, bind: { "nozzle": "node:a" }), "One": (model: "basics.constant", params: { "value": 1.5 }) },
        wires: ["One.y -> E.throttle"], connect: [("E.propellant", "Tank.outlet")], gravity: "none", step: "10 s", integrator: "dormand_prince_54", until: "300 s",
        metrics: { "v": (of: "a.speed"), "left": (of: "Tank.propellant"), "dry": (of: "Tank.propellant", take: "time_of_min") }"#,
        // 300 s g0 ln(1000/600); 400 kg at 10 kN/(300 s g0), because a throttle above 1 is 1.
        want: &[("v", 1_502.846_43, 1e-4), ("left", 0.0, 1e-9), ("dry", 117.679_8, 1e-3)],
    },
];

#[test]
fn flight() {
    hold(CASES);
}

/// Angles of places, directions and orbits in degrees without their unit.
const BARE_DEGREES: &[Refused] = &[
    Refused {
        report: "textbook: an inclination of 98.6",
        text: r#"world: (body: "earth"),
        bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "7000 km", inclination: 98.6))) },
        parts: { "Gravity": (model: "environment.point_mass_gravity") },
        step: 1, until: 1"#,
        says: "is 98.6 rad",
    },
    Refused {
        report: "textbook: elements at the Moon without their axes",
        text: r#"world: (body: "moon", epoch: "2030-01-01 00:00:00 UTC"),
        bodies: { "a": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "1837 km", inclination: "90 deg"))) },
        parts: { "Gravity": (model: "environment.point_mass_gravity") },
        step: 1, until: 1"#,
        says: "frame: equator",
    },
    Refused {
        report: "textbook: a longitude of 77.45",
        text: r#"world: (body: "mars", turns: fixed, site: (latitude: 0, longitude: 77.45)),
        bodies: { "a": (parent: "world") },
        step: 1, until: 1"#,
        says: "longitude` = 77.45 rad is out of range",
    },
    Refused {
        report: "textbook: a yaw of 90",
        text: r#"bodies: { "a": (parent: "world", at: (rotation: (rpy: [0, 0, 90]))) },
        step: 1, until: 1"#,
        says: "is 90 rad",
    },
    Refused {
        report: "textbook: a turn of 90 about an axis",
        text: r#"bodies: { "a": (parent: "world", at: (rotation: (axis: [0, 0, 1], angle: 90))) },
        step: 1, until: 1"#,
        says: "is 90 rad",
    },
];

#[test]
fn angles_in_degrees_without_their_unit_are_refused() {
    refuse(BARE_DEGREES);
}
