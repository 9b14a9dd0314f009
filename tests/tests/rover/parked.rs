//! The rocker-bogie rover compared with statics: parked on slopes, its weight, the loads of its axles, its differential.
use linkwork_plant::PlanExt;
use linkwork_runtime::{Seconds, Simulation};

use crate::common;

const GRAVITY: f64 = 3.72076;

/// The rover at rest on an even slope (deg), nose uphill for positive angles.
fn on_slope(angle: f64, soil: bool) -> Simulation {
    made(angle, soil, "", &[])
}

/// With further parameters of the rover, and of its parts.
fn made(angle: f64, soil: bool, params: &str, set: &[&str]) -> Simulation {
    made_with(angle, soil, params, set, "")
}

/// With further bodies next to the rover or on it.
fn made_with(angle: f64, soil: bool, params: &str, set: &[&str], bodies: &str) -> Simulation {
    let uphill = if angle < 0.0 { 180 } else { 0 };
    let contact = if soil { "mobility.wheel_soil" } else { "mobility.wheel_rigid" };
    let text = format!(
        r#"Simulation(
    parts: {{ "Rover": (assembly: "rovers/rocker_bogie.ron", params: {{
        "world": "worlds/slope.ron", "waypoints": [[0, 0]], "contact": "{contact}",
        "world_params": {{ "slope": "{} deg", "uphill": "{uphill} deg" }}, {params}
    }}) }},
    bodies: {{ {bodies} }},
    step: "1 ms", integrator: "semi_implicit_euler", until: "100 s", seed: 1,
    place: (
        body: "Rover.Hardware.Chassis/chassis", at: [0, 0], heading: "0 rad",
        wheels: ["Rover.Hardware.Wheels.*/wheel"], radius: "0.25 m",
        joints: ["Rover.Hardware.Chassis/rocker_*", "Rover.Hardware.Chassis/bogie_*"],
    ),
)"#,
        angle.abs()
    );
    common::scene(&text, set).unwrap_or_else(|e| panic!("{e}"))
}

fn run(sim: &mut Simulation, until: u64) {
    sim.run_until(Seconds { num: until, den: 1 }).unwrap();
}

fn chassis(sim: &Simulation) -> [f64; 3] {
    ["x", "y", "z"]
        .map(|a| sim.get(&format!("Rover.Hardware.Chassis/chassis.position.{a}")).unwrap())
}

fn contact(sim: &Simulation, wheel: usize, port: &str) -> f64 {
    sim.get(&format!("Rover.Hardware.Wheels.Wheel{wheel}.SurfaceContact.{port}")).unwrap()
}

/// Normal and tangential (uphill along +x) force of an axle: front, middle, rear; N.
fn axles(sim: &Simulation, slope: f64) -> [[f64; 2]; 3] {
    let (sin, cos) = slope.to_radians().sin_cos();
    [0, 2, 4].map(|k| {
        let sum = |port: &str| contact(sim, k + 1, port) + contact(sim, k + 2, port);
        let (fx, fz) = (sum("contact_force.x"), sum("contact_force.z"));
        [fz * cos - fx * sin, fx * cos + fz * sin]
    })
}

/// Distance of two positions, m.
fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// Speed of creep between two times, m/s.
fn creep(sim: &mut Simulation, from: u64, to: u64) -> f64 {
    run(sim, from);
    let a = chassis(sim);
    run(sim, to);
    apart(a, chassis(sim)) / (to - from) as f64
}

#[test]
fn parked_it_does_not_creep() {
    // MuJoCo 4.0 creeps by 1050, 3350, 7850 µm/s with its default cone, and by 54, 162, 266 µm/s at
    // best.
    for (soil, bound) in [(false, 1e-6), (true, 1e-5)] {
        for slope in [5.0, 10.0, 15.0, 20.0, 25.0, 30.0] {
            let mut sim = on_slope(slope, soil);
            let start = chassis(&sim);
            let speed = creep(&mut sim, 8, 12);
            let went = apart(start, chassis(&sim));
            println!(
                "soil {soil} slope {slope}°: creep {speed:.3e} m/s, {:.4} mm from the start",
                1e3 * went
            );
            assert!(speed < bound, "soil {soil} slope {slope}: {speed} m/s");
            if soil && slope <= 20.0 {
                // The creep decays.
                let later = creep(&mut sim, 28, 32);
                assert!(
                    later <= speed.max(1e-9) && later < 1e-6,
                    "slope {slope}: later {later} m/s"
                );
            }
            // The rover used to roll 60 to 94 mm with manually set brakes.
            assert!(went < 1e-3, "soil {soil} slope {slope}: {went} m from the start");
        }
    }
}

#[test]
fn it_starts_in_balance() {
    // Initial loads used to be from 253 to 1782 N, because every wheel just touched.
    let loads = |sim: &Simulation| [1, 2, 3, 4, 5, 6].map(|k| contact(sim, k, "normal_force"));
    for (slope, soil) in [(0.0, false), (0.0, true), (20.0, false), (-15.0, true), (25.0, true)] {
        let mut sim = on_slope(slope, soil);
        let start = loads(&sim);
        let mut most = 0.0_f64;
        for k in 1..=20 {
            sim.run_until(Seconds { num: k, den: 10 }).unwrap();
            for (now, then) in loads(&sim).iter().zip(start) {
                most = most.max((now / then - 1.0).abs());
            }
        }
        println!("slope {slope}°, soil {soil}: {start:.1?} N, changing by {most:.2e}");
        assert!(most < 0.03, "slope {slope}, soil {soil}: {most}");
    }
    // The same holds on rough ground of several seeds; the rover starts to drive after a tenth of a
    // second.
    for (contact_model, seed) in
        [("mobility.wheel_rigid", 7), ("mobility.wheel_rigid", 9), ("mobility.wheel_soil", 8)]
    {
        let set =
            [format!("Rover.contact={contact_model}"), format!("Rover.Environment.seed={seed}")];
        let mut sim = common::traverse(&set.each_ref().map(|s| s.as_str())).unwrap();
        let start = loads(&sim);
        sim.run_until(Seconds { num: 1, den: 10 }).unwrap();
        let end = loads(&sim);
        println!("{contact_model}, seed {seed}: {start:.0?} N, then {end:.0?} N");
        for (a, b) in start.iter().zip(end) {
            assert!((a / b - 1.0).abs() < 0.03, "{contact_model}, seed {seed}: {start:?} {end:?}");
        }
    }
}

#[test]
fn what_does_not_rest_where_it_is_put_down_is_told() {
    let told = |sim: &Simulation| {
        let warnings = &sim.plan().warnings;
        warnings.iter().find(|w| w.message.contains("does not rest")).cloned()
    };
    assert!(told(&on_slope(25.0, false)).is_none());
    // The slope is too steep for a friction of 0.7.
    let sim = on_slope(40.0, false);
    let warning = told(&sim).unwrap();
    assert!(warning.message.contains("chassis") && warning.help.is_some(), "{warning:?}");
    // The wheels are locked while a rover without brakes settles: it starts in balance and then rolls away.
    let brakes =
        [1, 2, 3, 4, 5, 6].map(|k| format!("Rover.Hardware.Wheels.Wheel{k}.Motor.brake=0"));
    let mut sim = made(25.0, false, "", &brakes.each_ref().map(String::as_str));
    assert!(told(&sim).is_none());
    let start = chassis(&sim);
    run(&mut sim, 2);
    assert!(apart(start, chassis(&sim)) > 0.01);
}

/// Rovers on a slope of 25 degrees, at y = 0, 6, ..: whether the wheels of each have brakes.
fn side_by_side(brakes: &[bool]) -> Simulation {
    let (mut parts, mut places, mut overrides) = (String::new(), String::new(), String::new());
    for (k, brake) in brakes.iter().enumerate() {
        let y = 6 * k;
        parts += &format!(
            r#""R{k}": (assembly: "rovers/rocker_bogie.ron", params: {{
                "world": "worlds/outside.ron", "contact": "mobility.wheel_rigid", "waypoints": [[0, {y}]], "start": [0, {y}, 0] }}),"#
        );
        places += &format!(
            r#"(body: "R{k}.Hardware.Chassis/chassis", at: [0, {y}], wheels: ["R{k}.Hardware.Wheels.*/wheel"], radius: "0.25 m",
                joints: ["R{k}.Hardware.Chassis/rocker_*", "R{k}.Hardware.Chassis/bogie_*"]),"#
        );
        if !brake {
            overrides += &format!(r#""R{k}.Hardware.Wheels.Wheel*.Motor.brake": 0,"#);
        }
    }
    let text = format!(
        r#"Simulation(
    parts: {{ "Site": (assembly: "worlds/slope.ron", params: {{ "slope": "25 deg" }}), {parts} }},
    overrides: {{ {overrides} }},
    contact: (compliant: (stiffness: 3e5, bristle_stiffness: 3e5, bristle_damping: 3e3)),
    step: "1 ms", integrator: "semi_implicit_euler", until: "100 s", seed: 1, place: [{places}],
)"#
    );
    common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// The time for settling several rovers one after the other grew with the square of their number. All in one run, each comes to rest as it does
/// alone, also if another one needs locked wheels.
#[test]
fn machines_settled_together_rest_as_each_does_alone() {
    let height = |sim: &Simulation, k: usize| {
        let mut all = vec![sim.get(&format!("R{k}.Hardware.Chassis/chassis.position.z")).unwrap()];
        all.extend((1..=6).map(|w| {
            sim.get(&format!("R{k}.Hardware.Wheels.Wheel{w}.SurfaceContact.normal_force")).unwrap()
        }));
        all
    };
    let alone = [true, false].map(|brake| height(&side_by_side(&[brake]), 0));
    let together = side_by_side(&[true, false, true]);
    assert!(together.plan().warnings.iter().all(|w| !w.message.contains("rest")));
    for (k, wanted) in [(0, &alone[0]), (1, &alone[1]), (2, &alone[0])] {
        let found = height(&together, k);
        println!("{k}: {found:?}, alone {wanted:?}");
        for (a, b) in found.iter().zip(wanted) {
            // The slope rises along x and the rovers are side by side along y, so their heights are equal.
            assert!((a - b).abs() < 1e-6 * b.abs().max(1.0), "{k}: {a} and alone {b}");
        }
    }
}

#[test]
fn placing_one_machine_moves_no_other_and_tells_what_gave_way() {
    let drone = r#""drone": (parent: "world", hinge: Free, mass: 2, inertia: [0.1, 0.1, 0.1],
        initial: (position: [3, 0, 30], velocity: [1, 0, 2], angular: [0, 0, 0.5])),"#;
    let gave_way = |sim: &Simulation| {
        let warnings = &sim.plan().warnings;
        warnings
            .iter()
            .filter(|w| w.message.contains("came to rest before the run"))
            .cloned()
            .collect::<Vec<_>>()
    };
    let sim = made_with(10.0, false, "", &[], drone);
    for (variable, wanted) in [
        ("position.x", 3.0),
        ("position.z", 30.0),
        ("velocity.x", 1.0),
        ("velocity.z", 2.0),
        ("angular.z", 0.5),
    ] {
        assert_eq!(sim.get(&format!("drone.{variable}")).unwrap(), wanted, "{variable}");
    }
    assert!(gave_way(&sim).is_empty());
    // A boom without a motor drops before the run starts, which is reported.
    let boom = r#""boom": (parent: "Rover.Hardware.Chassis/chassis", at: (position: [1, 0, 1]), hinge: Pin([0, 1, 0]),
        mass: 1, com: [0.2, 0, 0], inertia: [0.01, 0.01, 0.01]),"#;
    let sim = made_with(0.0, false, "", &[], boom);
    let told = gave_way(&sim);
    assert!(sim.get("boom.angle").unwrap().abs() > 1.0);
    assert!(
        told.len() == 1 && told[0].message.contains("the hinge of `boom` moved by 1."),
        "{told:?}"
    );
}

#[test]
fn it_drives_to_its_last_waypoint_with_its_wheels_on_the_ground() {
    for (contact_model, load_max, sunk_max) in
        [("mobility.wheel_rigid", 2500.0, 0.020), ("mobility.wheel_soil", 1800.0, 0.05)]
    {
        let mut sim = common::traverse(&[&format!("Rover.contact={contact_model}")])
            .unwrap_or_else(|e| panic!("{e}"));
        let done = sim.variable("Rover.NavigationSoftware.Follower.done").unwrap().place;
        let places = |port: &str| {
            [1, 2, 3, 4, 5, 6].map(|k| {
                let path = format!("Rover.Hardware.Wheels.Wheel{k}.SurfaceContact.{port}");
                sim.variable(&path).unwrap().place
            })
        };
        let (loads, sinkages) = (places("normal_force"), places("sinkage"));
        let rockers = ["left", "right"].map(|side| {
            sim.variable(&format!("Rover.Hardware.Chassis/rocker_{side}.angle")).unwrap().place
        });
        let (mut load, mut sunk) = (0.0f64, 0.0f64);
        while sim.value(done) < 0.5 {
            assert!(sim.time() < 400.0, "{contact_model}: still on its way at {:?}", chassis(&sim));
            sim.step().unwrap_or_else(|e| panic!("{e}"));
            let sum = rockers.map(|p| sim.value(p)).iter().sum::<f64>();
            assert!(sum.abs() <= 1e-12, "{contact_model}: rockers apart by {sum:e}");
            for k in 0..6 {
                load = load.max(sim.value(loads[k]));
                sunk = sunk.max(sim.value(sinkages[k]));
            }
        }
        let [x, y, _] = chassis(&sim);
        println!(
            "{contact_model}: ({x:.3}, {y:.3}) at {:.1} s, {load:.0} N, {sunk:.4} m",
            sim.time()
        );
        // The last waypoint is (17, 7), its tolerance 0.4 m.
        // Measured: rigid 1485 N, 9.6 mm; soil 972 N, 31.7 mm.
        assert!((x - 17.0).hypot(y - 7.0) < 0.5, "{contact_model}: ends at ({x}, {y})");
        assert!(load < load_max && sunk < sunk_max, "{contact_model}: {load} N, {sunk} m");
    }
}

#[test]
fn level_it_weighs_what_it_weighs() {
    let mut sim = on_slope(0.0, false);
    run(&mut sim, 6);
    let plan = sim.plan().clone();
    let mass = plan.mechanism().unwrap().multibody.total_mass();
    let load: f64 = (1..=6).map(|k| contact(&sim, k, "normal_force")).sum();
    let off = load / (mass * GRAVITY) - 1.0;
    println!("mass {mass} kg, loads {load} N, off by {off:e}");
    assert!(off.abs() < 1e-3, "{off}");
    assert!((1..=6).all(|k| contact(&sim, k, "sinkage") < 0.005));
}

#[test]
fn with_light_links_its_axle_loads_are_the_published_ones() {
    // The values are planar statics of this geometry on level ground, with massless links: shares of front, middle,
    // rear axle. The wheels roll freely, because brakes would keep tractions that load the bogies.
    let brakes =
        [1, 2, 3, 4, 5, 6].map(|k| format!("Rover.Hardware.Wheels.Wheel{k}.Motor.brake=0"));
    for (x, shares) in [(0.0, [0.3303, 0.3885, 0.2812]), (-0.1, [0.2691, 0.4240, 0.3069])] {
        let mut sim = made(
            0.0,
            false,
            &format!(
                r#""chassis_mass": 899, "chassis_com": [{x}, 0, 0], "mast_mass": 0.01, "rocker_mass": 1,
                "bogie_mass": 1, "yoke_mass": 0.5, "wheel_mass": 3,"#
            ),
            &brakes.each_ref().map(String::as_str),
        );
        run(&mut sim, 20);
        let loads = axles(&sim, 0.0).map(|l| l[0]);
        let total: f64 = loads.iter().sum();
        let off: Vec<f64> =
            loads.iter().zip(shares).map(|(l, s)| (l / total / s - 1.0).abs()).collect();
        println!("x_c = {x}: shares {:?}, off {off:?}", loads.map(|l| l / total));
        // Measured: at most 1.2 %, because the friction of drives and gears leaves tractions of some newtons, which load the bogies. Even lighter
        // links would need a smaller step.
        assert!(off.iter().all(|o| *o < 0.015), "x_c = {x}: {off:?}");
    }
}

/// Masses (kg) with x and height (m) above the ground; the second list belongs to the bogies.
struct Statics {
    upper: Vec<[f64; 3]>,
    bogie: Vec<[f64; 3]>,
}

/// Wheels' x: front, middle, rear; the bogies' pivot, m.
const X: [f64; 3] = [1.095, -0.089, -1.163];
const PIVOT: [f64; 2] = [-0.54, 0.6443];

impl Statics {
    /// The assembly's masses.
    fn rover() -> Statics {
        Statics {
            upper: vec![
                [708.0, 0.0, 0.751],
                [15.0, 0.75, 0.751 + 0.39 + 0.7],
                [50.0, 0.214 + 0.06, 0.751 + 0.1254 - 0.1],
                [12.0, X[0], 0.40],
                [24.0, X[0], 0.25],
            ],
            bogie: vec![
                [30.0, PIVOT[0] - 0.08, PIVOT[1] - 0.1],
                [24.0, X[1], 0.25],
                [12.0, X[2], 0.40],
                [24.0, X[2], 0.25],
            ],
        }
    }

    /// Normal loads of the axles (N) on a slope (deg): balance of the whole, and of the bogies about their pivot, with the traction `t` (uphill) of
    /// middle and rear given as `t[0] + t[1] N` for each.
    fn loads(&self, slope: f64, traction: [[f64; 2]; 2]) -> [f64; 3] {
        let (sin, cos) = slope.to_radians().sin_cos();
        let (mut weight, mut moment, mut own) = (0.0, 0.0, 0.0);
        for (k, [m, x, h]) in
            self.upper.iter().map(|b| (0, b)).chain(self.bogie.iter().map(|b| (1, b)))
        {
            weight += m * GRAVITY;
            moment += m * GRAVITY * (x * cos - h * sin);
            if k == 1 {
                own += m * GRAVITY * ((x - PIVOT[0]) * cos - (h - PIVOT[1]) * sin);
            }
        }
        // The balance about the pivot is a N_m + b N_r = c; the sum gives N_f; the moments are
        // about x = 0 on the ground.
        let [[m0, m1], [r0, r1]] = traction;
        let a = X[1] - PIVOT[0] + PIVOT[1] * m1;
        let b = X[2] - PIVOT[0] + PIVOT[1] * r1;
        let c = own - PIVOT[1] * (m0 + r0);
        let sum = moment - X[0] * weight * cos;
        let (d, e) = (X[1] - X[0], X[2] - X[0]);
        let det = a * e - b * d;
        let (middle, rear) = ((c * e - b * sum) / det, (a * sum - d * c) / det);
        [weight * cos - middle - rear, middle, rear]
    }
}

#[test]
fn the_equations_are_those_of_the_reference() {
    // The reference is a body of weight 1 without links, with its centre of mass at x = 0 and 0.75 m; its
    // loads are proportional to traction.
    let body = Statics { upper: vec![[1.0 / GRAVITY, 0.0, 0.75]], bogie: vec![] };
    for (slope, want) in [
        (0.0, [0.3303, 0.3885, 0.2812]),
        (10.0, [0.2936, 0.3278, 0.3634]),
        (20.0, [0.2521, 0.2487, 0.4389]),
        (30.0, [0.2067, 0.1541, 0.5052]),
        (-10.0, [0.3616, 0.4274, 0.1958]),
        (-20.0, [0.3881, 0.4404, 0.1112]),
        (-30.0, [0.4121, 0.4205, 0.0334]),
    ] {
        let t = f64::to_radians(slope).tan();
        let got = body.loads(slope, [[0.0, t]; 2]);
        for (g, w) in got.iter().zip(want) {
            assert!((g - w).abs() < 2e-4, "{slope}: {got:?} {want:?}");
        }
    }
}

#[test]
fn axle_loads_are_those_of_statics() {
    // The distribution of traction depends on the settling history if the wheels are locked, so the measured traction of the bogies' wheels enters
    // the equations.
    for slope in [0.0, 10.0, 20.0, 30.0, -10.0, -20.0, -30.0] {
        let mut sim = on_slope(slope, false);
        run(&mut sim, 8);
        let found = axles(&sim, slope);
        let t = [[found[1][1], 0.0], [found[2][1], 0.0]];
        let want = Statics::rover().loads(slope, t);
        let tan = f64::to_radians(slope).tan();
        let proportional = Statics::rover().loads(slope, [[0.0, tan]; 2]);
        println!("{slope}°: N and T of front, middle, rear {found:.1?}");
        println!(
            "     statics with that traction {want:.1?}, with proportional traction {proportional:.1?}"
        );
        for (f, w) in found.iter().zip(want) {
            assert!((f[0] / w - 1.0).abs() < 0.01, "{slope}: {found:?} {want:?}");
        }
    }
}

/// Shares of front, middle and rear axle of a rover with light links that is about to slide on a slope (deg): tractions are then proportional to
/// loads. Also the required ratio of traction to load.
fn shares_about_to_slide(angle: f64) -> [f64; 3] {
    // The friction is slightly below the required value, so each wheel slides slowly.
    let friction = 0.998 * angle.to_radians().tan().abs();
    let set = [
        format!("Rover.Hardware.Wheels.Wheel*.SurfaceContact.friction={friction}"),
        // The brakes transmit all tractions to the ground.
        "Rover.Hardware.Wheels.Wheel*.Motor.brake=2000".to_string(),
    ];
    let light = r#""chassis_mass": 899, "mast_mass": 0.01, "rocker_mass": 1, "bogie_mass": 1, "yoke_mass": 0.5, "wheel_mass": 3,"#;
    let mut sim = made(angle, false, light, &set.each_ref().map(|s| s.as_str()));
    run(&mut sim, 3);
    let found = axles(&sim, angle);
    let total: f64 = found.iter().map(|l| l[0]).sum();
    println!("{angle}°: N and T of front, middle, rear {found:.1?}");
    for [n, t] in found {
        assert!(((t / n).abs() / friction - 1.0).abs() < 0.02, "not sliding: {found:?}");
    }
    found.map(|l| l[0] / total)
}

#[test]
fn on_slopes_its_axle_loads_are_those_of_the_table() {
    for (slope, want) in [
        (10.0, [0.2936, 0.3278, 0.3634]),
        (20.0, [0.2521, 0.2487, 0.4389]),
        (30.0, [0.2067, 0.1541, 0.5052]),
        (-10.0, [0.3616, 0.4274, 0.1958]),
        (-20.0, [0.3881, 0.4404, 0.1112]),
        (-30.0, [0.4121, 0.4205, 0.0334]),
    ] {
        // The table's loads are in weights; their sum is the cosine of the slope.
        let cos = f64::to_radians(slope).cos();
        let shares = shares_about_to_slide(slope);
        println!("{slope}°: {shares:.4?}, in the table {:.4?}", want.map(|w| w / cos));
        // The difference is due to the links, which have a few per cent of the mass at their own
        // heights.
        assert!(
            shares.iter().zip(want).all(|(s, w)| (s - w / cos).abs() < 0.01),
            "{slope}: {shares:?}"
        );
    }
}

#[test]
fn bogie_wheels_lift_at_the_slopes_of_the_reference() {
    // With tractions proportional to loads the bogie's hinge is above the line of the other wheel's force at tan α = (x_b − x_r)/h_b = 44.0 deg
    // uphill (middle wheel) and (x_m − x_b)/h_b = 35.0 deg downhill (rear wheel).
    for (sign, lifts, k, near) in [(1.0, 44.0, 1, [41.0, 42.5]), (-1.0, 35.0, 2, [32.0, 33.5])] {
        let shares = near.map(|angle: f64| shares_about_to_slide(sign * angle)[k]);
        let zero = near[0] + shares[0] / (shares[0] - shares[1]) * (near[1] - near[0]);
        println!("shares {shares:.4?} at {near:?}°: none at {zero:.2}°, {lifts}° asked");
        assert!(shares[1] > 0.0 && (zero - lifts).abs() < 1.0, "{shares:?}: {zero}");
    }
}

/// Angle of a rocker.
fn rocker(sim: &Simulation, side: &str) -> f64 {
    sim.get(&format!("Rover.Hardware.Chassis/rocker_{side}.angle")).unwrap()
}

#[test]
fn the_rockers_turn_by_equal_and_opposite_angles() {
    // The differential is an embedded coupling: its error is zero at every step of a drive over rough ground.
    let mut sim = common::traverse(&[]).unwrap();
    let places = ["left", "right"].map(|side| {
        sim.variable(&format!("Rover.Hardware.Chassis/rocker_{side}.angle")).unwrap().place
    });
    let (mut most, mut error) = (0.0_f64, 0.0_f64);
    while sim.time() < 30.0 {
        let [left, right] = places.map(|p| sim.value(p));
        most = most.max(left.abs());
        error = if (left + right).abs() <= error { error } else { (left + right).abs() };
        sim.step().unwrap_or_else(|e| panic!("{e}"));
    }
    println!("greatest rocker angle {most} rad, sum of both {error:e} rad");
    assert!(most > 0.02 && error <= 1e-12, "{most} {error:e}");
}

#[test]
fn coupling_and_spring_drive_the_same_traverse() {
    // The spring deflects by its moment divided by its stiffness. The moment is at most the moment of the chassis behind the rockers' axis plus the
    // wheels' contribution; the coupling does not deflect. The effect on the rover's position has the same size.
    let mut exact = common::traverse(&[]).unwrap();
    let mut elastic = common::traverse(&["Rover.differential=spring"]).unwrap();
    let (mut gives, mut apart, mut angles) = (0.0_f64, 0.0_f64, 0.0_f64);
    let done = exact.variable("Rover.NavigationSoftware.Follower.done").unwrap().place;
    for k in 1..=400 {
        if exact.value(done) > 0.5 {
            break;
        }
        run(&mut exact, k);
        run(&mut elastic, k);
        gives = gives.max((rocker(&elastic, "left") + rocker(&elastic, "right")).abs());
        // A rocker gets half of the deflection, in addition to the pitch of the chassis by the same amount.
        angles = angles.max((rocker(&exact, "left") - rocker(&elastic, "left")).abs());
        let (a, b) = (chassis(&exact), chassis(&elastic));
        apart = apart.max((0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt());
    }
    println!(
        "the spring gives {gives} rad; rockers differ by {angles} rad, the rover by {apart} m"
    );
    // Measured over the whole traverse: 3.3 mrad, 1.7 mrad, 0.9 mm.
    assert!(gives > 1e-3 && gives < 0.01, "{gives}");
    assert!(angles < gives && apart < gives, "{gives} {angles} {apart}");
}

#[test]
fn a_wrong_differential_is_told_with_the_file_that_is_not_there() {
    let error = common::traverse(&["Rover.differential=sprong"]).err().unwrap();
    assert!(error.contains("no assembly file `parts/differential_sprong.ron`"), "{error}");
    assert!(error.contains("parts/differential_spring.ron"), "{error}");
}

#[test]
fn the_chassis_pitches_by_the_mean_of_the_rockers() {
    // On rough ground the rockers rotate against each other by equal angles relative to the chassis, except for the twist of the elastic differential
    // (1e5 N m/rad on each side) by the weight of the chassis behind the rockers' axis.
    let moment = GRAVITY * (708.0 * 0.214 - 15.0 * (0.75 - 0.214));
    let wound = moment / (2.0 * 1e5) / 2.0;
    let mut sim = common::traverse(&["Rover.differential=spring"]).unwrap();
    let (mut most, mut error) = (0.0_f64, 0.0_f64);
    for k in 1..=20 {
        run(&mut sim, k);
        let (left, right) = (rocker(&sim, "left"), rocker(&sim, "right"));
        most = most.max(left.abs());
        error = error.max(((left + right).abs() / 2.0 - wound).abs());
    }
    println!(
        "greatest rocker angle {most} rad, chassis pitch off the mean by {error} rad ({wound} wound up)"
    );
    assert!(most > 0.01 && error < 0.01 * most, "{most} {error}");
}
