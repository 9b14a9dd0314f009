//! The supplied rovers: each carries its weight as statics predict, drives as commanded, and the mirrored path mirrored.
use linkwork_runtime::Simulation;

use crate::common;

/// A rover, and its data for statics: wheels as x and count, masses as kg and x.
struct Vehicle {
    name: &'static str,
    gravity: f64,
    radius: f64,
    /// Half of its look-ahead distance is its unit of length, m.
    unit: f64,
    wheels: usize,
    joints: &'static str,
    /// Foot of its mast, m.
    mast: [f64; 3],
    /// Time limit of the course, s.
    longest: f64,
}

const MARS: f64 = 3.72076;
const MOON: f64 = 1.62;
const BOGIES: &str = r#"["Rover.Hardware.Chassis/rocker_*", "Rover.Hardware.Chassis/bogie_*"]"#;

fn vehicles() -> [Vehicle; 6] {
    let bogies = |name, radius, unit, mast, longest| Vehicle {
        name,
        gravity: MARS,
        radius,
        unit,
        wheels: 6,
        joints: BOGIES,
        mast,
        longest,
    };
    [
        bogies("rocker_bogie", 0.25, 2.0, [0.75, 0.35, 0.39], 60.0),
        bogies("mer", 0.13, 1.0, [0.4, 0.1, 0.24], 150.0),
        bogies("sojourner", 0.065, 0.4, [0.22, 0.05, 0.02], 280.0),
        Vehicle {
            name: "four_wheeler",
            gravity: MOON,
            radius: 0.25,
            unit: 1.2,
            wheels: 4,
            joints: "[]",
            mast: [0.45, 0.0, 0.3],
            longest: 60.0,
        },
        Vehicle {
            name: "eight_wheeler",
            gravity: MOON,
            radius: 0.255,
            unit: 1.5,
            wheels: 8,
            joints: "[]",
            mast: [0.6, 0.0, 0.4],
            longest: 90.0,
        },
        Vehicle {
            name: "articulated",
            gravity: MARS,
            radius: 0.25,
            unit: 1.5,
            wheels: 4,
            joints: r#"["Rover.Hardware.Chassis/rear"]"#,
            mast: [0.15, 0.0, 0.16],
            longest: 90.0,
        },
    ]
}

impl Vehicle {
    /// On an even slope (deg) that rises to its left, or its mirror image; it is commanded to drive a bend.
    fn at_rest(&self, slope: f64, mirrored: bool) -> Simulation {
        let side = if mirrored { -1.0 } else { 1.0 };
        let Vehicle { name, gravity, radius, unit, joints, .. } = self;
        let [[a, b], [c, d]] = [[2.0, 0.6 * side], [3.2, -0.4 * side]].map(|p| p.map(|x| unit * x));
        let [x, y, z] = self.mast;
        let text = format!(
            r#"Simulation(
    parts: {{ "Rover": (assembly: "rovers/{name}.ron", params: {{
        "world": "worlds/slope.ron", "waypoints": [[{a}, {b}], [{c}, {d}]], "mast_at": [{x}, {}, {z}],
        "world_params": {{ "slope": "{slope} deg", "uphill": "{} deg", "gravity": {gravity} }},
    }}) }},
    step: "1 ms", integrator: "semi_implicit_euler", until: "1000 s", seed: 1,
    place: (
        body: "Rover.Hardware.Chassis/chassis", at: [0, 0], heading: 0,
        wheels: ["Rover.Hardware.Wheels.*/wheel"], radius: {radius}, joints: {joints},
    ),
)"#,
            side * y,
            90.0 * side,
        );
        common::scene(&text, &[]).unwrap_or_else(|e| panic!("{name}: {e}"))
    }
}

fn get(sim: &Simulation, name: &str) -> f64 {
    sim.get(name).unwrap_or_else(|e| panic!("{e}"))
}

fn chassis(sim: &Simulation) -> [f64; 3] {
    ["x", "y", "z"].map(|a| get(sim, &format!("Rover.Hardware.Chassis/chassis.position.{a}")))
}

fn until(sim: &mut Simulation, t: f64) {
    sim.run_until(common::seconds(t)).unwrap();
}

#[test]
fn each_drives_its_course_and_mirrored_the_mirrored_path() {
    for vehicle in vehicles() {
        let name = vehicle.name;
        let [mut sim, mut image] = [false, true].map(|mirrored| vehicle.at_rest(5.0, mirrored));
        assert!(sim.plan().warnings.is_empty(), "{name}: {:?}", sim.plan().warnings);
        let mut worst = common::Worst(0.0);
        let follower = "Rover.NavigationSoftware.Follower";
        while get(&sim, &format!("{follower}.done")) < 0.5 && sim.time() < vehicle.longest {
            let t = sim.time() + 1.0;
            until(&mut sim, t);
            until(&mut image, t);
            let ([x, y, z], [u, v, w]) = (chassis(&sim), chassis(&image));
            worst.take((x - u).abs().max((y + v).abs()).max((z - w).abs()));
            let grounded = |k| {
                get(&sim, &format!("Rover.Hardware.Wheels.Wheel{k}.SurfaceContact.normal_force"))
            };
            assert!((1..=vehicle.wheels).all(|k| grounded(k) > 0.0), "{name}: a wheel hangs");
        }
        let [x, y, _] = chassis(&sim);
        let limited = get(&sim, "Rover.LocomotionSoftware.Ackermann.limited");
        println!("{name}: at ({x:.2}, {y:.2}) m after {:.0} s, limited {limited}", sim.time());
        let off = (x - 3.2 * vehicle.unit).hypot(y + 0.4 * vehicle.unit);
        assert!(off < 0.25 * vehicle.unit, "{name}: {off} m from where it was told to go");
        worst.below(1e-9, name);
    }
}

/// Weight (N) and its moment (N m) about the body's origin of masses (kg) at x (m).
fn weight(masses: &[[f64; 2]], gravity: f64) -> [f64; 2] {
    masses.iter().fold([0.0, 0.0], |[w, m], [mass, x]| [w + mass * gravity, m + mass * gravity * x])
}

/// A bogie: its weight (N) with its moment (N m), its hinge, and the hinge's height above the ground; m.
struct Bogie {
    weight: [f64; 2],
    hinge: f64,
    above: f64,
}

/// Loads of the rocker's, the inner and the outer wheels by statics: balances of the rover and of its bogies about their hinges, N of both sides;
/// `along`: the forces along x that the braked wheels exert against each other.
fn on_bogies(all: [f64; 2], bogie: &Bogie, [r, i, o]: [f64; 3], along: &[f64]) -> Vec<f64> {
    // The balances are N_r + N_i + N_o = W, Σ N x = M, and N_i (i − h) + N_o (o − h) = M_b − W_b h −
    // above (F_i + F_o).
    let [weight, moment] = all;
    let about_hinge = bogie.weight[1] - bogie.weight[0] * bogie.hinge;
    // Without N_r they give N_i (i − r) + N_o (o − r) = M − W r.
    let (a, b, c) = (i - r, o - r, moment - weight * r);
    let (d, e) = (i - bogie.hinge, o - bogie.hinge);
    let f = about_hinge - bogie.above * (along[1] + along[2]);
    let det = a * e - b * d;
    let (inner, outer) = ((c * e - b * f) / det, (a * f - c * d) / det);
    vec![weight - inner - outer, inner, outer]
}

/// Loads of axles at x on equal springs: N = W/n + M x/Σx².
fn on_springs<const N: usize>([weight, moment]: [f64; 2], x: [f64; N]) -> [f64; N] {
    let squares: f64 = x.iter().map(|x| x * x).sum();
    x.map(|x| weight / N as f64 + moment * x / squares)
}

/// Compares the axle loads of the rover at rest on level ground, N, with statics including the forces along x.
fn loads_agree(vehicle: &Vehicle, wanted: impl Fn(&[f64]) -> Vec<f64>, tolerance: f64) {
    let mut sim = vehicle.at_rest(0.0, false);
    until(&mut sim, 0.05);
    let axle = |axle: usize, what: &str| -> f64 {
        let of = |k: usize| {
            format!("Rover.Hardware.Wheels.Wheel{k}.SurfaceContact.contact_force.{what}")
        };
        [1, 2].iter().map(|side| get(&sim, &of(2 * axle + side))).sum()
    };
    let along: Vec<f64> = (0..vehicle.wheels / 2).map(|k| axle(k, "x")).collect();
    for (k, wanted) in wanted(&along).into_iter().enumerate() {
        let (load, held) = (axle(k, "z"), along[k]);
        let name = vehicle.name;
        println!("{name}: axle {k} {load:.3} N, statics {wanted:.3} N; {held:.3} N along x");
        assert!((load / wanted - 1.0).abs() < tolerance, "{name}, axle {k}: {load} N, {wanted} N");
    }
}

#[test]
fn wheels_carry_what_statics_say() {
    let [curiosity, mer, sojourner, four, eight, articulated] = vehicles();
    // The arguments are body, mast, two rockers; a bogie; yoke and wheel; hinge of the bogie and its height above the
    // ground; places of the wheels.
    let bogies = |v: &Vehicle,
                  own: [[f64; 2]; 3],
                  [m, x]: [f64; 2],
                  [yoke, wheel]: [f64; 2],
                  [hinge, above]: [f64; 2],
                  at: [f64; 3]| {
        let [r, i, o] = at;
        let hung = [[2.0 * m, x], [2.0 * wheel, i], [2.0 * (yoke + wheel), o]];
        let all = [&own[..], &hung, &[[2.0 * (yoke + wheel), r]]].concat();
        let bogie = Bogie { weight: weight(&hung, v.gravity), hinge, above };
        let all = weight(&all, v.gravity);
        loads_agree(v, |along| on_bogies(all, &bogie, at, along), 0.005);
    };
    let own = [[708.0, 0.0], [15.0, 0.75], [50.0, 0.214 + 0.06]];
    let at = [1.095, -0.089, -1.163];
    bogies(&curiosity, own, [15.0, -0.62], [6.0, 12.0], [-0.54, 0.75 - 0.1067], at);
    let own = [[125.0, 0.02], [8.0, 0.4], [12.0, 0.13 + 0.036]];
    bogies(&mer, own, [4.0, -0.398], [2.0, 3.5], [-0.35, 0.5 - 0.1], [0.72, -0.02, -0.69]);
    let own = [[6.5, 0.0], [0.2, 0.22], [0.6, -0.03 + 0.0156]];
    let at = [-0.25, 0.02, 0.25];
    bogies(&sojourner, own, [0.25, 0.1092], [0.15, 0.35], [0.13, 0.19 - 0.045], at);
    // The load of the arms is on their wheels; the centre of mass of trailing arms is in front of
    // their wheels.
    let wheels = [4.0 * (6.0 + 4.0 + 4.0 + 12.0), 0.0];
    let all = weight(&[[310.0, 0.0], [16.0, 0.45], wheels], MOON);
    loads_agree(&four, |_| on_springs(all, [0.6418, -0.6418]).to_vec(), 0.02);
    let all = weight(&[[576.0, 0.0], [12.0, 0.6], [8.0 * 17.0, 0.0], [32.0, 0.125]], MOON);
    let axles = [0.85, 0.85 / 3.0, -0.85 / 3.0, -0.85];
    loads_agree(&eight, |_| on_springs(all, axles).to_vec(), 0.02);
    // The two bodies pitch as one, because their joint does not allow relative pitch.
    let masses = [[70.0, 0.65], [6.0, 0.65 + 0.15], [16.0, 0.65], [6.0, 0.0], [96.0, -0.65]];
    let all = weight(&masses, MARS);
    loads_agree(&articulated, |_| on_springs(all, [0.65, -0.65]).to_vec(), 0.005);
}

#[test]
fn a_rover_that_bends_drives_the_circle_of_its_joint() {
    let text = r#"Simulation(
    parts: { "Rover": (assembly: "rovers/articulated.ron", params: {
        "world": "worlds/slope.ron", "world_params": { "slope": 0 }, "waypoints": [], "navigation": "plan",
        "plan": [(name: "turn", set: { "speed": 0.1, "turn_rate": 0.05 }, duration: "1000 s")],
    }) },
    step: "1 ms", integrator: "semi_implicit_euler", until: "1000 s",
    place: (
        body: "Rover.Hardware.Chassis/chassis", at: [0, 0], heading: 0,
        wheels: ["Rover.Hardware.Wheels.*/wheel"], radius: 0.25, joints: ["Rover.Hardware.Chassis/rear"],
    ),
)"#;
    let mut sim = common::scene(text, &[]).unwrap();
    until(&mut sim, 20.0);
    // The radius of the front axle is ρ = v/ω = 2 m; the joint is 0.65 m behind that axle.
    let bend = get(&sim, "Rover.Hardware.Chassis/joint.angle");
    let wanted = -2.0 * (0.65_f64 / 2.0).atan();
    let at = |sim: &Simulation, wheel: usize| {
        ["x", "y"].map(|a| {
            get(
                sim,
                &format!("Rover.Hardware.Wheels.Wheel{wheel}.SurfaceContact.contact_point.{a}"),
            )
        })
    };
    let axle = |sim: &Simulation, first: usize| {
        let (a, b) = (at(sim, first), at(sim, first + 1));
        [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
    };
    // The centre of the circle follows from the positions of the front axle during one turn.
    let turn = std::f64::consts::TAU / 0.05;
    let mut ways = Vec::new();
    for share in [0.0, 0.25, 0.5, 0.75] {
        until(&mut sim, 20.0 + share * turn);
        ways.push([axle(&sim, 1), axle(&sim, 3)]);
    }
    let middle = [0, 1].map(|k| ways.iter().map(|w| w[0][k]).sum::<f64>() / 4.0);
    let radius = |p: [f64; 2]| (p[0] - middle[0]).hypot(p[1] - middle[1]);
    println!(
        "bent by {bend:.4} rad, {wanted:.4} wanted; radii {:?}",
        ways.iter().map(|w| w.map(radius)).collect::<Vec<_>>()
    );
    assert!((bend - wanted).abs() < 0.01, "{bend} {wanted}");
    for axle in ways.iter().flatten() {
        assert!((radius(*axle) - 2.0).abs() < 0.05, "{} m", radius(*axle));
    }
}
