//! Launch to orbit: compares two stages with a trajectory from an independent program (DOP853, relative 1e-12).
use linkwork_environment::planet_air::{StandardAtmosphere, Us76Params};
use linkwork_environment::world::PlanetWorld;
use linkwork_runtime::Files;
use linkwork_surroundings::prelude::*;
use serde_json::Value;

use crate::common;
use common::{Worst, get, num, reference, row, rows, seconds, vec3, velocity};

/// The reference's atmosphere: the standard to 86 km, then an exponential with the speed of sound of 86 km.
struct CutStandard {
    standard: StandardAtmosphere,
    world: PlanetWorld,
    top: linkwork_world::atmosphere::Air,
}

const TOP: f64 = 86_000.0;

impl Atmosphere for CutStandard {
    fn air(&self, t: f64, p: Vec3) -> Air {
        let below = self.standard.air(t, p);
        let height = self.world.planet.place(t, p).1.map_or(f64::NAN, |g| g.altitude);
        if height < TOP {
            return below;
        }
        let (thin, top) = ((-(height - TOP) / 7000.0).exp(), &self.top);
        Air {
            density: top.density * thin,
            pressure: top.pressure * thin,
            temperature: top.temperature,
            speed_of_sound: top.sound_speed,
            wind: below.wind,
        }
    }
}

/// US76 to 86 km and an exponential above, as in the reference.
#[service("test.cut_standard", Atmosphere)]
impl Service for CutStandard {
    type Params = Us76Params;
    fn build(p: Us76Params, files: &Files) -> Result<Self, BuildError> {
        let top = linkwork_world::atmosphere::Us76::new().at(TOP - 1e-6);
        Ok(CutStandard {
            world: PlanetWorld::of(&p.world)?,
            standard: StandardAtmosphere::build(p, files)?,
            top,
        })
    }
}

/// Returns the reference's flight in the axes of its launch site, with the atmosphere of the service `air`.
fn flight(all: &Value, air: &str) -> String {
    let (planet, input, phases) = (&all["planet"], &all["inputs"], &all["phases"]["times"]);
    let of = |v: &Value, name: &str| num(&v[name]);
    let (one, two) = (&input["stage1"], &input["stage2"]);
    let booster = of(one, "m0_total") - of(one, "m_prop") - of(two, "m0_total");
    let dry = of(two, "m0_total") - of(two, "m_prop");
    let cd = row(&all["CD"]["Mach"]).into_iter().zip(row(&all["CD"]["CD"]));
    let cd: Vec<String> = cd.map(|(m, c)| format!("[{m:?}, {c:?}]")).collect();
    let kick =
        row(&input["kick"]["t"]).into_iter().zip(row(&input["kick"]["pitch_from_vertical_deg"]));
    let kick: Vec<String> =
        kick.map(|(t, deg)| format!("(time: {t:?}, pitch: \"{deg:?} deg\")")).collect();
    let tank = |name: &str, stage: &Value| {
        format!(
            r#""{name}": (model: "flight.propellant_tank", params: {{ "propellant": {:?}, "radius": "10 um", "density": 1e20 }},
                bind: {{ "bottom": "node:vehicle" }}),"#,
            of(stage, "m_prop")
        )
    };
    let engine = |stage: &Value| {
        format!(
            r#""Engine": (model: "flight.vector_thrust", params: {{ "specific_impulse": {:?}, "exit_area": {:?} }},
                bind: {{ "body": "node:vehicle" }}),"#,
            of(stage, "Isp_vac"),
            of(stage, "Ae")
        )
    };
    let wires = |tank: &str| {
        format!(
            r#"wires: ["Steering.force -> Engine.command", "Aero.ambient_pressure -> Engine.pressure"], connect: [("Engine.propellant", "{tank}.outlet")],"#
        )
    };
    let turn = |stage: &Value| {
        format!(
            r#""Steering": (model: "flight.gravity_turn", params: {{ "thrust": {:?} }}, bind: {{ "body": "node:vehicle" }}),"#,
            of(stage, "thrust_vac")
        )
    };
    // Later rows of the reference are not at ticks. A phase begins at each, so that the run stops there.
    let at: Vec<f64> =
        rows(&all["rows"]).iter().map(|r| r[0]).filter(|t| *t > of(phases, "ignition2")).collect();
    let end = of(phases, "burnout2");
    let looks: Vec<String> = at
        .iter()
        .enumerate()
        .map(|(k, _)| match at.get(k + 1) {
            None => format!("\"row{k}\": (like: \"second\")"),
            Some(t) if *t == end => format!(
                "\"row{k}\": (like: \"second\", to: {{ \"row{}\": \"Tank2.outlet.available < 0.5\" }})",
                k + 1
            ),
            Some(t) => format!(
                "\"row{k}\": (like: \"second\", to: {{ \"row{}\": \"time > {t:?} s\" }})",
                k + 1
            ),
        })
        .collect();
    let looks = looks.join(", ");
    format!(
        r#"Simulation(
        world: (body: "earth", turns: "fixed", rate: {:?}, radius: {:?}, flattening: {:?},
            site: (latitude: "{:?} deg", longitude: "{:?} deg", height: {:?}), mu: {:?}),
        bodies: {{
            "vehicle": (parent: "world", hinge: Free, mass: {dry:?}, inertia: [1e5, 1e5, 1e4]),
            "booster": (parent: "vehicle", mass: {booster:?}, inertia: [1e5, 1e5, 1e4]),
        }},
        parts: {{
            "Gravity": (model: "environment.zonal_gravity", params: {{ "j2": {:?} }}),
            "Air": (model: "{air}"),
            {} {}
            "Aero": (model: "flight.entry_aerodynamics", params: {{ "area": {:?}, "drag": [{}], "lift_to_drag": [[0, 0]],
                "heating_constant": 1.7415e-4 }}, bind: {{ "body": "node:vehicle" }}),
        }},
        step: "500 ms", integrator: "dormand_prince_54", accuracy: (relative: 1e-12, absolute: 1e-9), until: "500 s",
        start: "programme",
        phases: {{
            "programme": (
                parts: {{ {}
                    "Steering": (model: "flight.pitch_program", params: {{ "rows": [{}], "azimuth": "{:?} deg", "thrust": {:?} }}),
                }},
                {}
                to: {{ "turn": "time > {:?} s" }},
            ),
            "turn": (parts: {{ {} {} }}, {} to: {{ "coast": "Tank1.outlet.available < 0.5" }}),
            "coast": (
                bodies: {{ "booster": (parent: "world", hinge: Free) }}, remove: ["Tank1"],
                to: {{ "second": "time > {:?} s" }},
            ),
            "second": (remove: ["Tank1", "booster"], parts: {{ {} {} }}, {} to: {{ "row0": "time > {:?} s" }}),
            {looks}
        }},
        )"#,
        of(planet, "omega"),
        of(planet, "a"),
        1.0 / of(planet, "inv_f"),
        of(input, "lat_deg"),
        of(input, "lon_deg"),
        of(input, "h0"),
        of(planet, "GM"),
        of(planet, "J2"),
        tank("Tank1", one),
        tank("Tank2", two),
        of(one, "S"),
        cd.join(", "),
        engine(one),
        kick.join(", "),
        of(input, "azimuth_deg"),
        of(one, "thrust_vac"),
        wires("Tank1"),
        of(input, "gravity_turn_from"),
        engine(one),
        turn(one),
        wires("Tank1"),
        of(phases, "ignition2"),
        engine(two),
        turn(two),
        wires("Tank2"),
        at[0],
    )
}

/// Largest errors over the rows, and the last position.
struct Flown {
    /// Position, m, and velocity, m/s.
    position: Worst,
    velocity: Worst,
    /// Geodetic latitude and longitude, deg; height, m.
    place: [Worst; 2],
    height: Worst,
    /// Relative to the air: m/s, Mach number, and dynamic pressure divided by that of the reference.
    air: [Worst; 3],
    last: Vec3,
}

fn fly(all: &Value, air: &str) -> Flown {
    let own = vec![Entry::service::<CutStandard>()];
    let mut sim = common::scene_with(own, &flight(all, air)).unwrap();
    let input = &all["inputs"];
    let place = linkwork_world::planet::Geodetic {
        latitude: num(&input["lat_deg"]).to_radians(),
        longitude: num(&input["lon_deg"]).to_radians(),
        altitude: num(&input["h0"]),
    };
    let planet = &all["planet"];
    let shape =
        linkwork_world::planet::Ellipsoid::new(num(&planet["a"]), 1.0 / num(&planet["inv_f"]))
            .unwrap();
    let pose = linkwork_world::planet::Site::new(&shape, place, 0.0).pose;
    let rate = num(&planet["omega"]);
    let mut mass = Worst(0.0);
    let none = [Worst(0.0); 3];
    let mut f = Flown {
        position: none[0],
        velocity: none[0],
        place: [none[0]; 2],
        height: none[0],
        air: none,
        last: Vec3::zeros(),
    };
    for want in rows(&all["rows"]) {
        let t = want[0];
        let phase = sim.phase().to_string();
        if (2.0 * t).fract() == 0.0 {
            sim.run_until(seconds(t)).unwrap();
        } else {
            while sim.phase() == phase {
                sim.step_event().unwrap();
            }
            assert!((sim.time() - t).abs() < 1e-8, "{} s, not {t} s: {}", sim.time(), sim.phase());
        }
        let turn = Quat::from_scaled_axis(Vec3::z() * (rate * t));
        let p = pose.transform_point(&get(&sim, "vehicle.position"));
        let over = pose.rotation * velocity(&sim, "vehicle");
        f.last = turn * p;
        f.position.take((f.last - vec3(&want[1..])).norm());
        let inertial = turn * (over + (Vec3::z() * rate).cross(&p));
        f.velocity.take((inertial - vec3(&want[4..])).norm());
        let g = shape.geodetic(&p).unwrap();
        f.place[0].take((g.latitude.to_degrees() - want[8]).abs());
        f.place[1].take((g.longitude.to_degrees() - want[9]).abs());
        f.height.take((g.altitude - want[10]).abs());
        let aero = |name: &str| sim.get(&format!("Aero.{name}")).unwrap();
        f.air[0].take((aero("airspeed") - want[11]).abs());
        f.air[1].take((aero("mach") - want[12]).abs());
        f.air[2].take((aero("dynamic_pressure") - want[13]).abs() / want[13].max(1e-30));
        let tank = |name: &str| sim.get(&format!("{name}.propellant")).unwrap_or(0.0);
        let dry = num(&input["stage2"]["m0_total"]) - num(&input["stage2"]["m_prop"]);
        let booster = num(&input["stage1"]["m0_total"])
            - num(&input["stage1"]["m_prop"])
            - num(&input["stage2"]["m0_total"]);
        let carried = if ["programme", "turn"].contains(&sim.phase()) { booster } else { 0.0 };
        mass.take((dry + carried + tank("Tank1") + tank("Tank2") - want[7]).abs());
        println!("{t:8.3} s {:<10} {:.2e} m {:.2e} kg", sim.phase(), f.position.0, mass.0);
    }
    mass.below(1e-7, "mass, kg");
    f
}

#[test]
fn two_stages_with_a_gravity_turn() {
    let Some(all) = reference("two_stage_ascent.json") else { return };
    let f = fly(&all, "test.cut_standard");
    // The reference requires 1 m and has an error of 5e-4 m.
    f.position.below(2e-3, "ascent, position, m");
    f.velocity.below(1e-5, "ascent, velocity, m/s");
    f.place[0].below(1e-8, "ascent, geodetic latitude, deg");
    f.place[1].below(1e-8, "ascent, longitude, deg");
    f.height.below(2e-3, "ascent, height over the ellipsoid, m");
    f.air[0].below(1e-5, "ascent, speed through the air, m/s");
    f.air[1].below(1e-6, "ascent, Mach number");
    f.air[2].below(1e-6, "ascent, dynamic pressure, relative");
    // The README states the altitude reached.
    let top = num(&all["rows"].as_array().unwrap().last().unwrap()[10]);
    assert!((top / 1e3 - 797.0).abs() < 0.5, "{top}");
    // Above 86 km the air is the real one; in the reference it is an exponential.
    let thin = fly(&all, "environment.us76").last;
    let worth = (thin - f.last).norm();
    println!("the air above 86 km is worth {worth:.3} m");
    assert!((worth - 0.137).abs() < 5e-3, "{worth} m");
}

/// Checks the phases of `sims/ascent` against its README.
#[test]
fn a_launcher_reaches_its_orbit_phase_by_phase() {
    let mut sim = common::repository("ascent/sim.ron", &[]).unwrap();
    let mut told = Vec::new();
    let (mut phase, mut pressure) = (String::new(), 0.0_f64);
    let look = |sim: &linkwork_runtime::Simulation, name: &str| sim.get(name).unwrap();
    while sim.before(seconds(410.0)) {
        sim.step_event().unwrap();
        pressure = pressure.max(look(&sim, "Aero.dynamic_pressure"));
        if sim.phase() != phase {
            phase = sim.phase().to_string();
            let row = [
                sim.time(),
                look(&sim, "Orbit.height") / 1e3,
                look(&sim, "Orbit.speed"),
                look(&sim, "Orbit.path_angle").to_degrees(),
            ];
            println!(
                "{phase:<14} {:8.2} s {:8.2} km {:8.1} m/s {:7.3} deg",
                row[0], row[1], row[2], row[3]
            );
            told.push((phase.clone(), row));
            if phase == "closed_loop" {
                let ahead = common::rotation(&sim, "stage2") * Vec3::z();
                let turn = ahead.angle(&common::get(&sim, "Guidance.force")).to_degrees();
                println!("the second stage is to turn by {turn} deg");
                assert!((turn - 52.5).abs() < 0.1, "{turn}");
            }
            if phase == "orbit" {
                let [low, high] =
                    ["pericentre", "apocentre"].map(|n| look(&sim, &format!("Orbit.{n}")));
                let tilt = look(&sim, "Orbit.inclination").to_degrees();
                let left = look(&sim, "Tank2.propellant");
                println!("{low} m by {high} m, {tilt} deg, {left} kg left");
                // The target is 200 km by 200 km.
                assert!((low / 1e3 - 194.9).abs() < 0.2 && (high / 1e3 - 205.1).abs() < 0.2);
                assert!((tilt - 28.343).abs() < 2e-3 && (left - 4880.0).abs() < 20.0);
                // The vehicle descends at the cutoff, which explains the ten kilometres between the
                // apses.
                let sinks = -row[2] * row[3].to_radians().sin();
                println!("{sinks} m/s downwards");
                assert!((sinks - 6.0).abs() < 0.05, "{sinks}");
                // The engine is cut off at the target energy, to the picosecond, so the semi-major
                // axis is exact.
                assert!((0.5 * (low + high) - 200e3).abs() < 0.01, "{low} {high}");
            }
        }
    }
    // The columns are time, height, inertial speed and flight path angle.
    let want = [
        // The first row is at 0.1 s.
        ("programme", [0.1, -4.80, 409.05, 0.058]),
        ("gravity_turn", [22.0, -3.66, 435.6, 14.58]),
        ("staging", [136.61, 66.89, 2664.3, 30.28]),
        ("closed_loop", [140.61, 72.20, 2645.3, 29.644]),
        ("fairing_off", [179.02, 115.0, 2842.8, 18.689]),
        ("orbit", [403.28, 199.99, 7784.3, -0.044]),
    ];
    assert_eq!(told.len(), want.len(), "{told:?}");
    for ((phase, row), (name, w)) in told.iter().zip(want) {
        assert_eq!(phase, name);
        for (k, tolerance) in [0.01, 0.01, 0.1, 0.005].into_iter().enumerate() {
            assert!((row[k] - w[k]).abs() < tolerance, "{name}: {row:?} {w:?}");
        }
    }
    println!("greatest dynamic pressure {pressure} Pa");
    assert!((pressure / 39.0e3 - 1.0).abs() < 0.01);
}

/// With a path as steep as the reference, the propellant is exhausted, and the run enters the phase that reports this.
#[test]
fn a_launcher_that_runs_dry_says_so() {
    let mut sim = common::repository("ascent/sim.ron", &["kick=4.3 deg"]).unwrap();
    sim.run_until(seconds(600.0)).unwrap();
    assert_eq!(sim.phase(), "dry");
    // The missing velocity for a circular orbit of 200 km when the propellant is exhausted, m/s, follows from the
    // energy.
    let (mu, wanted) = (3.986_004_418e14, 6_578_137.0);
    let mut sim_again = common::repository("ascent/sim.ron", &["kick=4.3 deg"]).unwrap();
    while sim_again.phase() != "dry" {
        sim_again.step_event().unwrap();
    }
    let at = |name: &str| sim_again.get(&format!("Orbit.{name}")).unwrap();
    let (speed, energy) = (at("speed"), at("energy"));
    let lacks = (speed * speed + 2.0 * (-mu / (2.0 * wanted) - energy)).sqrt() - speed;
    println!("dry {lacks} m/s before the orbit, at {} s", sim_again.time());
    assert!((lacks - 102.0).abs() < 0.5, "{lacks}");
    assert!(sim.get("Orbit.pericentre").unwrap() < 0.0);
}
