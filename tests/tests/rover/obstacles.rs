//! The rover of Curiosity's class on single obstacles that are bodies: each axle climbs a step with the friction that statics requires and stalls
//! with less; on a block under one wheel all six wheels keep their loads.
use linkwork_runtime::Simulation;

use crate::common;

/// Radius of the wheels, and height of the step, m.
const R: f64 = 0.25;
/// Points of the left side in the chassis' frame, x and z, m: the bogie's hinge, then the hubs of the front, middle and rear wheel.
const PIVOT: [f64; 2] = [-0.54, -0.1067];
const HUB_Z: f64 = -0.501;
const HUB_X: [f64; 3] = [1.095, -0.089, -1.163];

/// A planar pose of the rover, nose up for positive angles (rad), in which the wheels of each axle are at given heights.
struct Stance {
    chassis: [f64; 2],
    pitch: f64,
    bogie: f64,
    /// x of the hubs, m.
    hubs: [f64; 3],
}

/// Returns `v` rotated nose up.
fn turned([x, z]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    [x * cos - z * sin, x * sin + z * cos]
}

/// Returns the pose with hubs of front, middle and rear at z = `R` + `heights` (m).
fn stance(heights: [f64; 3]) -> Stance {
    let [front, middle, rear] = heights.map(|h| h + R);
    let arm = |k: usize| [HUB_X[k] - PIVOT[0], HUB_Z - PIVOT[1]];
    let bogie = ((middle - rear) / (HUB_X[1] - HUB_X[2])).asin();
    let pivot = middle - turned(arm(1), bogie)[1];
    let [x, z] = arm(0);
    let pitch = ((front - pivot) / x.hypot(z)).asin() + (-z).atan2(x);
    let at = turned(PIVOT, pitch);
    let along = |k: usize| at[0] + turned(arm(k), if k == 0 { pitch } else { bogie })[0];
    Stance {
        chassis: [0.0, pivot - at[1]],
        pitch,
        bogie: bogie - pitch,
        hubs: [0, 1, 2].map(along),
    }
}

/// A rover with light links and its centre of mass 0.75 m up, at a pose, driving along x among bodies; one friction coefficient for wheels, ground
/// and bodies.
fn rover(
    pose: &Stance,
    [friction, width]: [f64; 2],
    waypoint: f64,
    bodies: &str,
    more: &str,
) -> Simulation {
    let poses: String = (1..=6)
        .map(|k| {
            let (wheel, mount) = (format!("Hub{k}"), format!("node:Rover.Hardware.Wheels.Wheel{k}/wheel"));
            format!(r#""{wheel}": (model: "sensors.pose", rate: "100 Hz", bind: {{ "mount": "{mount}" }}),"#)
        })
        .collect();
    let text = format!(
        r#"Simulation(
    parts: {{ "Rover": (assembly: "rovers/rocker_bogie.ron", params: {{
        "world": "worlds/slope.ron", "waypoints": [[{waypoint:?}, 0]], "speed": 0.1,
        "chassis_mass": 899, "mast_mass": 0.01, "rocker_mass": 1, "bogie_mass": 1, "yoke_mass": 0.5, "wheel_mass": 3, "wheel_width": {width:?},
        "tyres": {{ "terrain": false, "discs": 5, "friction": {friction:?} }},
    }}),
        {poses}
    }},
    bodies: {{ {bodies} }},
    overrides: {{
        "Rover.Hardware.Wheels.Wheel*.SurfaceContact.friction": {friction:?},
        "Rover.Hardware.Chassis/chassis.initial": (position: [{:?}, 0, {:?}], rotation: (rpy: [0, {:?}, 0])),
        "Rover.Hardware.Chassis/bogie_left.initial": (angle: {:?}),
        "Rover.Hardware.Chassis/bogie_right.initial": (angle: {:?}), {more}
    }},
    step: "1 ms", integrator: "semi_implicit_euler", until: "200 s", seed: 1,
)"#,
        pose.chassis[0],
        pose.chassis[1] + 5e-4,
        -pose.pitch,
        -pose.bogie,
        -pose.bogie,
    );
    common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn until(sim: &mut Simulation, t: f64) {
    sim.run_until(common::seconds(t)).unwrap();
}

/// x, y or z of a wheel's hub, m.
fn hub(sim: &Simulation, wheel: usize, axis: &str) -> f64 {
    sim.get(&format!("Hub{wheel}.{axis}")).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns how high the wheels of an axle climb on a step in front of them, m: the lower of left and right, in 20 s.
fn climbs(axle: usize, friction: f64) -> f64 {
    let before = [[0.0; 3], [R, 0.0, 0.0], [R, R, 0.0]][axle];
    let pose = stance(before);
    let face = pose.hubs[axle] + R + 0.02;
    let step = format!(
        r#""step": (parent: "world", at: (position: [{:?}, 0, {:?}]),
            shapes: [(shape: Box([5, 3.6, {R:?}]), name: "block", collide: (friction: {friction:?}))]),"#,
        face + 2.5,
        R / 2.0
    );
    let mut sim = rover(&pose, [friction, 0.4], 6.0, &step, "");
    let wheels = [2 * axle + 1, 2 * axle + 2];
    let mut best = f64::NEG_INFINITY;
    for second in 1..=20 {
        until(&mut sim, f64::from(second));
        best =
            best.max(wheels.map(|k| hub(&sim, k, "z")).into_iter().fold(f64::INFINITY, f64::min));
    }
    best - R
}

#[test]
fn each_axle_climbs_a_step_with_the_friction_that_statics_asks_for_and_stalls_with_less() {
    // These values are for the quasi-static climb of a vertical face with all wheels at their limit of
    // friction: front, middle, rear.
    let asked = [0.797, 0.737, 0.816];
    for (axle, friction) in asked.into_iter().enumerate() {
        let (more, less) = (climbs(axle, 1.2 * friction), climbs(axle, 0.8 * friction));
        println!(
            "axle {axle}: up {more:.3} m with 1.2 of the friction asked, {less:.3} m with 0.8 of it"
        );
        assert!(more > R - 0.01, "axle {axle}: {more} m");
        assert!(less < 0.2 * R, "axle {axle}: {less} m");
    }
}

#[test]
fn on_a_block_under_one_wheel_all_wheels_keep_their_loads() {
    // The block is 0.2 m high, under a front wheel. The rockers rotate against each other, and the
    // chassis by half as much.
    let block = format!(
        r#""block": (parent: "world", at: (position: [{:?}, 1.063, 0.1]),
            shapes: [(shape: Box([0.7, 0.7, 0.2]), name: "block", collide: (friction: 0.1))]),"#,
        HUB_X[0]
    );
    let load = |sim: &Simulation, k: usize| {
        let wheel = format!("Rover.Hardware.Wheels.Wheel{k}");
        let ground = sim.get(&format!("{wheel}.SurfaceContact.contact_force.z")).unwrap();
        ground + sim.get(&format!("{wheel}/wheel.contact_force.z")).unwrap()
    };
    let loads = |bodies: &str, drop: f64| {
        let mut pose = stance([0.0; 3]);
        pose.chassis[1] += drop;
        let mut sim = rover(
            &pose,
            [0.1, 0.1],
            0.0,
            bodies,
            r#""Rover.Hardware.Wheels.Wheel*.Motor.brake": 0"#,
        );
        until(&mut sim, 12.0);
        let angle =
            |side: &str| sim.get(&format!("Rover.Hardware.Chassis/rocker_{side}.angle")).unwrap();
        let lifted = hub(&sim, 1, "z") - hub(&sim, 2, "z");
        ([1, 2, 3, 4, 5, 6].map(|k| load(&sim, k)), [angle("left"), angle("right")], lifted)
    };
    let (level, _, _) = loads("", 0.0);
    // The rover is lowered onto the block from above, on rolling wheels and slippery ground, because tractions would
    // remain and load the bogies. The wheels are narrow, because wide ones would stand on their edges while the body
    // leans by 2 degrees.
    let (on_block, rockers, lifted) = loads(&block, 0.2);
    println!(
        "level {level:.1?} N, on the block {on_block:.1?} N; rockers {rockers:.4?} rad, lifted by {lifted:.3} m"
    );
    assert!((lifted - 0.2).abs() < 0.01 && rockers[0].abs() > 0.05, "{lifted} {rockers:?}");
    assert!((rockers[0] + rockers[1]).abs() < 1e-9, "{rockers:?}");
    let weight: f64 = level.iter().sum();
    let off: Vec<f64> = level.iter().zip(on_block).map(|(a, b)| b / a - 1.0).collect();
    println!("off by {off:.3?}");
    assert!((on_block.iter().sum::<f64>() / weight - 1.0).abs() < 1e-3);
    assert!(off.iter().all(|o| o.abs() < 0.1), "{off:?}");
}
