//! Spacecraft over a site of a rotating planet: wheels, gyros, star trackers, sunlight, coils and orbits behave as in inertial axes.
use linkwork_runtime::Simulation;
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Quat, Vec3};
use linkwork_world::planet::rotation::FixedRate;
use linkwork_world::planet::{Ellipsoid, Geodetic, PointMotion, Rotation, Site};

use crate::common::{Worst, get, list, rotation, scene, seconds, velocity};

/// Rotation rate of a planet with the gravity and size of Mars that rotates once in 52 minutes, so that omissions are visible, rad/s.
const RATE: f64 = 2e-3;
const MU: f64 = 4.282_837e13;
const RADIUS: f64 = 3_396_190.0;

/// Heading of the site, rad; as in `planet`.
const HEADING: f64 = 0.4;

fn site() -> Site {
    let place = Geodetic { latitude: 0.6, longitude: -1.1, altitude: -2000.0 };
    Site::new(&Ellipsoid::mars(), place, HEADING)
}

fn turning() -> Rotation {
    Rotation::Fixed(FixedRate::about_z(0.3, RATE).unwrap())
}

fn planet(from: From) -> String {
    let here = "site: (latitude: 0.6, longitude: -1.1, height: -2000, heading: 0.4)";
    let here = if from == From::Site { here } else { "" };
    format!("(body: \"mars\", mu: {MU:?}, turns: \"fixed\", rate: {RATE:?}, angle: 0.3, {here})")
}

/// Kind of W.
#[derive(Clone, Copy, PartialEq)]
enum From {
    Site,
    Inertial,
}

fn quaternion(q: &Quat) -> String {
    let c = q.coords;
    list(&[c.x, c.y, c.z, c.w])
}

fn triple(v: &Vec3) -> String {
    list(v.as_slice())
}

fn quat(sim: &Simulation, name: &str) -> Quat {
    let [w, x, y, z] = ["w", "x", "y", "z"].map(|c| sim.get(&format!("{name}.{c}")).unwrap());
    Quat::from_quaternion(Quaternion::new(w, x, y, z))
}

/// Position, velocity, attitude and rate (body axes) of a body, inertial.
struct Start {
    point: PointMotion,
    attitude: Quat,
    rate: Vec3,
}

impl Start {
    /// Returns the `initial` of a body, in W.
    fn initial(&self, from: From) -> String {
        let (mut point, mut R, mut rate) = (self.point, self.attitude, self.rate);
        if from == From::Site {
            let m = site().motion(&turning().at(0.0));
            point = m.to_inner(&point);
            R = m.pose.rotation.inverse() * R;
            rate -= self.attitude.inverse() * m.velocity.angular;
        }
        format!(
            "(position: {}, velocity: {}, rotation: (quat: {}), angular: {})",
            triple(&point.position),
            triple(&point.velocity),
            quaternion(&R),
            triple(&rate)
        )
    }
}

/// An orbit 400 km high that enters the shadow after some 9 minutes.
fn start() -> Start {
    let r = Vec3::new(RADIUS + 4e5, 0.0, 0.0);
    let speed = (MU / r.norm()).sqrt();
    Start {
        point: PointMotion { position: r, velocity: Vec3::new(0.0, 0.8, 0.6) * speed },
        attitude: Quat::from_euler_angles(0.3, -0.7, 1.2),
        rate: Vec3::new(0.004, -0.006, 0.008),
    }
}

/// Gravity, and a Sun fixed in inertial space: ahead beyond the orbit, and to the side.
fn environment(from: From) -> String {
    let mut sun = Vec3::new(-0.1, -0.8, -0.5).normalize();
    if from == From::Site {
        sun = site().motion(&turning().at(0.0)).pose.rotation.inverse() * sun;
    }
    let place = match from {
        From::Site => {
            // The azimuth is measured from north; the heading rotates x from east towards north.
            let east = Vec3::new(HEADING.cos(), -HEADING.sin(), 0.0);
            let azimuth = sun.dot(&east).atan2(sun.dot(&Vec3::z().cross(&east)));
            format!("\"azimuth\": {azimuth:?}, \"elevation\": {:?}", sun.z.asin())
        }
        From::Inertial => format!("\"direction\": {}", triple(&sun)),
    };
    format!(
        r#""Gravity": (model: "environment.zonal_gravity", params: {{ "j2": 0.00196 }}),
        "Sun": (model: "environment.fixed_sun", params: {{ {place}, "distance_au": 1.524 }}),"#
    )
}

/// Control of the spacecraft's attitude.
#[derive(Clone, Copy, PartialEq)]
enum Control {
    /// None: wheels and gyro run freely.
    None,
    /// Gyros, star tracker and filter, pointing, wheels, coils.
    Pointing,
}

/// An asymmetric spacecraft with wheels, a control moment gyro, coils, panels in sunlight, gyros and a star tracker.
fn craft(from: From, control: Control) -> Simulation {
    let axes = [Vec3::new(0.8, 0.0, 0.6), Vec3::new(-0.6, 0.64, 0.48), Vec3::new(0.0, -0.6, 0.8)];
    let (mut nodes, mut wheels, mut wires) = (String::new(), String::new(), String::new());
    for (k, g) in axes.iter().enumerate() {
        let q = quaternion(&Quat::rotation_between(&Vec3::z(), g).unwrap());
        nodes += &format!("\"w{k}\": (position: [0.{k}, 0.2, -0.1], rotation: (quat: {q})), ");
        let speed = [250.0, -160.0, 120.0][k];
        wheels += &format!(
            r#""Wheel{k}": (model: "flight.reaction_wheel",
                params: {{ "inertia": 0.0796, "speed": {speed:?}, "torque_max": 0.2, "coulomb": 0.002, "viscous": 1e-4, "smoothing": 1 }},
                bind: {{ "wheel": "node:craft/w{k}" }}), "#
        );
        if control == Control::Pointing {
            wires += &format!(
                r#""Distribution.torques[{k}] -> Wheel{k}.torque", (wire: "Wheel{k}.momentum -> Distribution.momenta[{k}]", delay: 1), "#
            );
        }
    }
    let target = quaternion(&Quat::from_euler_angles(0.9, -0.2, 0.5));
    let target: Vec<&str> = target.trim_matches(['[', ']']).split(", ").collect();
    let target: String = ["x", "y", "z", "w"]
        .iter()
        .zip(target)
        .map(|(c, v)| {
            wires += &format!("\"Target{c}.y -> Pointing.target.{c}\", ");
            format!("\"Target{c}\": (model: \"basics.constant\", params: {{ \"value\": {v} }}), ")
        })
        .collect();
    let text = format!(
        r#"Simulation(
    bodies: {{
        "craft": (
            parent: "world", hinge: Free, mass: 600, com: [0.1, -0.2, 0.05], inertia: [150, 110, 90, 3, -2, 4], initial: {},
            nodes: {{ {nodes} "gyro": (position: [0.1, 0, 0.3], rotation: (rpy: [0.4, -0.9, 0.3])) }},
        ),
        "arm": (parent: "craft", at: (position: [0.5, 0.1, 0]), hinge: Pin([0.6, 0, 0.8]), damping: 1, mass: 8, com: [0.7, 0.2, -0.1], inertia: [0.5, 0.7, 0.6], initial: (rate: 0.02)),
    }},
    world: {},
    parts: {{
        {}
        {wheels}
        "Supply": (model: "power.ideal_supply", params: {{ "voltage": 28 }}),
        "Turn": (model: "basics.sine", params: {{ "amplitude": 0.01, "frequency": 0.02 }}),
        "Moment": (model: "flight.control_moment_gyro", params: {{ "momentum": 20, "angle": 0.4 }}, bind: {{ "gimbal": "node:craft/gyro" }}),
        "Field": (model: "flight.magnetic_field", params: {{ "dipole": [-1.4509e-6, 4.6525e-6, -2.94048e-5], "dipole_radius": "6371.2 km" }}, bind: {{ "body": "node:craft" }}),
        "Coils": (model: "flight.magnetic_torquer", params: {{ "dipole_max": 300 }}, bind: {{ "body": "node:craft" }}),
        "Light": (model: "flight.panel_radiation_pressure", bind: {{ "body": "node:craft" }}, params: {{
            "albedo": 0.25, "infrared": 0.75, "panels": [
                (area: 3000, normal: [1, 0.2, -0.3], centre: [1, 2, 0.5], specular: 0.3, diffuse: 0.2), (area: 3000, normal: [-1, 0.4, 0.3], centre: [-1, 2, 0.5]),
            ],
        }}),
        "Ball": (model: "flight.radiation_pressure", params: {{ "area": 5000 }}, bind: {{ "body": "node:craft" }}),
        "Panel": (model: "power.solar_panel", params: {{ "area": 10 }}, bind: {{ "panel": "node:craft/w1" }}),
        "Rates": (model: "sensors.imu", rate: "10 Hz", bind: {{ "mount": "node:craft" }}),
        "Stars": (model: "sensors.star_tracker", rate: "10 Hz", params: {{ "rate_max": 0.5 }}, bind: {{ "mount": "node:craft" }}),
        "Filter": (model: "control.attitude_filter", rate: "10 Hz", params: {{ "random_walk": 2.036e-5, "bias_walk": 1e-8, "bias_start": 2e-5 }}),
        {target}
        "Pointing": (model: "control.pointing", rate: "10 Hz", params: {{ "inertia": [150, 110, 90], "frequency": 0.3, "rate_max": "0.6 deg/s", "torque_max": 0.25 }}),
        "Distribution": (model: "control.wheel_distribution", rate: "10 Hz", params: {{ "axes": [{}] }}),
        "Desaturation": (model: "control.desaturation", rate: "1 Hz", params: {{ "gain": 2e-3 }}),
    }},
    connect: [("Wheel0.supply", "Wheel1.supply", "Wheel2.supply", "Moment.supply", "Coils.supply", "Supply.terminal")],
    wires: [
        "Turn.y -> Moment.rate",
        "Rates.rate -> Filter.gyro", "Stars.attitude -> Filter.star", "Stars.fix -> Filter.fix",
        "Filter.attitude -> Pointing.attitude", "Filter.rate -> Pointing.rate",
        (wire: "Pointing.torque -> Distribution.torque", delay: 1),
        "Distribution.momentum -> Desaturation.momentum", "Field.in_body -> Desaturation.field",
        "Field.field -> Coils.field", "Desaturation.dipole -> Coils.dipole", 
        {wires}
    ],
    step: "100 ms", integrator: "verner_87", accuracy: (relative: 1e-10, absolute: 1e-10), until: "700 s", seed: 3,
)"#,
        start().initial(from),
        planet(from),
        environment(from),
        axes.iter().map(triple).collect::<Vec<_>>().join(", "),
    );
    scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// A body flown from a site and in inertial axes at the same time.
#[derive(Clone, Copy)]
struct Apart {
    place: Worst,
    speed: Worst,
    turn: Worst,
    rate: Worst,
}

impl Apart {
    fn none() -> Apart {
        let none = Worst(0.0);
        Apart { place: none, speed: none, turn: none, rate: none }
    }

    fn look(&mut self, here: &Simulation, there: &Simulation, body: &str) {
        let m = site().motion(&turning().at(here.time()));
        let position = get(here, &format!("{body}.position"));
        let want = m.to_outer(&PointMotion { position, velocity: velocity(here, body) });
        self.place.take((want.position - get(there, &format!("{body}.position"))).norm());
        self.speed.take((want.velocity - velocity(there, body)).norm());
        let R = m.pose.rotation * rotation(here, body);
        self.turn.take(R.angle_to(&rotation(there, body)));
        let angular = |s: &Simulation| get(s, &format!("{body}.angular"));
        let inertial = angular(here) + R.inverse() * m.velocity.angular;
        self.rate.take((inertial - angular(there)).norm());
    }
}

/// Flies both, and compares the outputs of instruments and actuators.
fn same(control: Control) -> Apart {
    let (mut here, mut there) = (craft(From::Site, control), craft(From::Inertial, control));
    let mut apart = Apart::none();
    let mut told = [Worst(0.0); 6];
    let (mut light, mut dark) = (false, false);
    for k in 1..=70 {
        here.run_until(seconds(f64::from(10 * k))).unwrap();
        there.run_until(seconds(f64::from(10 * k))).unwrap();
        apart.look(&here, &there, "craft");
        let number = |s: &Simulation, name: &str| s.get(name).unwrap();
        let differ = |name: &str| (number(&here, name) - number(&there, name)).abs();
        let [wheels, light_power, stars, gyro, field, arm] = &mut told;
        for k in 0..3 {
            wheels.take(differ(&format!("Wheel{k}.speed")) / 250.0);
        }
        for name in ["Light.visible", "Ball.visible"] {
            light_power.take(differ(name));
        }
        light_power.take(differ("Panel.power") / 1e3);
        stars.take(quat(&here, "Stars.attitude").angle_to(&quat(&there, "Stars.attitude")));
        assert!(number(&here, "Stars.fix") == 1.0 && number(&there, "Stars.fix") == 1.0);
        let both = |name: &str| (get(&here, name) - get(&there, name)).norm();
        gyro.take(both("Rates.rate"));
        field.take(both("Field.in_body") / get(&there, "Field.in_body").norm());
        arm.take(differ("arm.angle"));
        light |= number(&there, "Light.visible") == 1.0;
        dark |= number(&there, "Light.visible") == 0.0;
        // The tracker measures the attitude in W, with its noise of 4e-5 and 2e-4 rad.
        let W = quat(&here, "Stars.in_world").angle_to(&rotation(&here, "craft"));
        assert!(W < 1.5e-3 && quat(&there, "Stars.in_world") == quat(&there, "Stars.attitude"));
    }
    assert!(light && dark, "it goes into the shadow");
    let [wheels, light_power, stars, gyro, field, arm] = told;
    wheels.below(1e-9, "speeds of wheels, of 250 rad/s");
    light_power.below(1e-8, "visible part of the Sun, power of a panel over 1 kW");
    stars.below(1e-7, "star tracker, rad");
    gyro.below(1e-9, "gyroscopes, rad/s");
    field.below(1e-7, "magnetic field in the body, of itself");
    arm.below(1e-8, "arm, rad");
    apart
}

#[test]
fn wheels_gyros_and_light_turn_a_craft_alike_in_inertial_axes_and_from_a_site() {
    let apart = same(Control::None);
    // An attitude error grows with the error of the rates.
    apart.place.below(1e-5, "tumbling, position, m");
    apart.speed.below(1e-7, "tumbling, velocity, m/s");
    apart.turn.below(1e-7, "tumbling, attitude, rad");
    apart.rate.below(1e-9, "tumbling, rates, rad/s");
}

#[test]
fn a_craft_points_by_its_stars_and_wheels_alike_in_inertial_axes_and_from_a_site() {
    let apart = same(Control::Pointing);
    apart.place.below(1e-6, "pointing, position, m");
    apart.speed.below(1e-9, "pointing, velocity, m/s");
    apart.turn.below(1e-9, "pointing, attitude, rad");
    apart.rate.below(1e-10, "pointing, rates, rad/s");
}

/// A chief, and a deputy 200 m behind it that a guidance law moves.
fn rendezvous(from: From, law: &str) -> Simulation {
    let chief = start();
    let mut deputy = start();
    deputy.point.position += Vec3::new(20.0, -150.0, -110.0);
    deputy.point.velocity += Vec3::new(0.05, 0.1, -0.05);
    let text = format!(
        r#"Simulation(
    bodies: {{
        "chief": (parent: "world", hinge: Free, mass: 900, inertia: [90, 80, 70], initial: {}),
        "deputy": (parent: "world", hinge: Free, mass: 100, inertia: [9, 8, 7], initial: {}),
    }},
    world: {},
    parts: {{
        {}
        "Law": ({law}, bind: {{ "chief": "node:chief", "deputy": "node:deputy" }}),
        "Engine": (model: "flight.vector_thrust", params: {{ "specific_impulse": "220 s" }}, bind: {{ "body": "node:deputy" }}),
        "Feed": (model: "flight.ideal_feed"),
    }},
    wires: ["Law.force -> Engine.command"], connect: [("Engine.propellant", "Feed.outlet")],
    step: "100 ms", integrator: "verner_87", accuracy: (relative: 1e-12, absolute: 1e-10), until: "700 s",
)"#,
        chief.initial(from),
        deputy.initial(from),
        planet(from),
        environment(from),
    );
    scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn rendezvous_go_alike_in_inertial_axes_and_from_a_site() {
    // The glideslope ends before its goal, where its direction is undefined.
    let laws = [
        r#"model: "flight.station_keeping", params: { "place": [10, -30, 5], "mass": 100, "frequency": 0.02, "force_max": 5 }"#,
        r#"model: "flight.glideslope", params: { "place": [0, -20, 0], "mass": 100, "end_speed": 0.05, "slope": 0.01, "force_max": 10 }"#,
        r#"model: "flight.transfer", rate: "1 Hz", params: { "place": [0, -50, 0], "arrival": "600 s", "mass": 100, "force_max": 20, "deadband": 0.002 }"#,
    ];
    for (law, (times, held)) in laws.into_iter().zip([(14, 1.0), (6, 1.0), (12, 5e3)]) {
        let [mut here, mut there] = [From::Site, From::Inertial].map(|f| rendezvous(f, law));
        let mut apart = Apart::none();
        let mut force = Worst(0.0);
        let between =
            |s: &Simulation| (get(s, "deputy.position") - get(s, "chief.position")).norm();
        let far = between(&there);
        for k in 1..=times {
            here.run_until(seconds(f64::from(50 * k) - 0.5)).unwrap();
            there.run_until(seconds(f64::from(50 * k) - 0.5)).unwrap();
            apart.look(&here, &there, "deputy");
            let R = site().motion(&turning().at(here.time())).pose.rotation;
            force.take((R * get(&here, "Law.force") - get(&there, "Law.force")).norm());
        }
        assert!(between(&there) < 0.6 * far, "it comes nearer: {far} {}", between(&there));
        println!("{law}");
        // The precision of positions in inertial axes is 5e-10 m at each step, and they are integrated to 1e-12 of 4e6
        // m. The command of the transfer is constant in W for a second, in which the site rotates by 2 mrad; measured:
        // 5 cm.
        apart.place.below(3e-5 * held, "deputy, position, m");
        apart.speed.below(3e-7 * held, "deputy, velocity, m/s");
        force.below(1e-5 * held, "force, N");
    }
}
