//! `sims/lunar_landing`: descent to the rotating Moon, avoidance of hazards, and the final stand.

use crate::common::{get, repository, rotation, seconds};
use linkwork_runtime::Simulation;
use linkwork_spatial::Vec3;

/// Moon: m³/s², rad/s (IAU 2009), m at the site; the site's latitude, rad.
const MU: f64 = 4.9028e12;
const RATE: f64 = 2.661_699_5e-6;
const RADIUS: f64 = 1_735_400.0;
const LATITUDE: f64 = 0.352_382;

/// Start of a phase: name, s, height over the sphere of the site (m), speed over the ground (m/s).
type Told = Vec<(String, f64, f64, f64)>;

/// Flies until `end` (s). Returns the phases, and the largest thrust and leg force, N.
fn fly(sim: &mut Simulation, end: f64) -> (Told, f64, f64) {
    let (mut told, mut thrust, mut force) = (Told::new(), 0.0_f64, 0.0_f64);
    while sim.before(seconds(end)) {
        sim.step_event().unwrap();
        thrust = thrust.max(sim.get("Engine.thrust").unwrap_or(0.0));
        force = force.max(sim.get("Leg1.force").unwrap_or(0.0));
        if told.last().is_none_or(|t| t.0 != sim.phase()) {
            let row = (sim.get("Ground.height").unwrap(), sim.get("Ground.speed").unwrap());
            println!("{:<12} {:8.2} s {:10.2} m {:9.3} m/s", sim.phase(), sim.time(), row.0, row.1);
            told.push((sim.phase().to_string(), sim.time(), row.0, row.1));
        }
    }
    (told, thrust, force)
}

/// Angle of the lander's axis from the vertical of the site, rad.
fn tilt(sim: &Simulation) -> f64 {
    (rotation(sim, "lander") * Vec3::z()).z.acos()
}

/// Returns slope (rad) and roughness (m) of the map at the chosen position, and the lander's distance (m) from there.
fn chosen(sim: &Simulation) -> (f64, f64, f64) {
    let number = |name: &str| sim.get(name).unwrap();
    let off = (get(sim, "lander.position") - get(sim, "Map.place")).xy().norm();
    println!(
        "place {}, slope {:.4}, roughness {:.3} m, {:.3} of the map is safe; {off:.3} m from it, tilted by {:.4}",
        get(sim, "Map.place"),
        number("Map.slope"),
        number("Map.roughness"),
        number("Map.safe"),
        tilt(sim),
    );
    (number("Map.slope"), number("Map.roughness"), off)
}

#[test]
fn a_lander_comes_down_on_the_moon_and_stays() {
    let mut sim = repository("lunar_landing/sim.ron", &[]).unwrap();
    let (told, thrust, force) = fly(&mut sim, 700.0);
    // The columns are phase, s, m and m/s, as in the README.
    let want = [
        ("braking", 0.0, 15_000.0, 1670.0),
        ("approach", 438.0, 2406.0, 136.8),
        ("survey", 512.0, 305.7, 40.13),
        ("divert", 512.6, 298.3, 39.27),
        ("vertical", 556.3, 30.18, 1.529),
        ("drop", 576.02, 0.57, 1.4997),
        ("standing", 600.0, -0.71, 0.0),
    ];
    assert_eq!(told.len(), want.len(), "{told:?}");
    for ((phase, t, height, speed), w) in told.iter().zip(want) {
        assert_eq!(phase, w.0);
        assert!((t - w.1).abs() < 0.1, "{phase}: {t} s");
        assert!((height - w.2).abs() < 1e-3 * w.2 + 0.01, "{phase}: {height} m");
        assert!((speed - w.3).abs() < 1e-3 * w.3 + 5e-3, "{phase}: {speed} m/s");
    }
    let place = get(&sim, "lander.position");
    let left = sim.get("Tank.propellant").unwrap();
    println!("at {place}, {left} kg left, thrust {thrust} N, a leg {force} N");
    assert!((left - 341.8).abs() < 1.0);
    assert!((thrust / 11.0e3 - 1.0).abs() < 0.01 && (force / 9.0e3 - 1.0).abs() < 0.01);
    let (slope, rough, off) = chosen(&sim);
    assert!((slope.to_degrees() - 2.2).abs() < 0.05 && (rough - 0.18).abs() < 0.005, "{slope}");
    assert!((off - 0.13).abs() < 0.005, "{off}");
    let (safe, chosen) = (sim.get("Map.safe").unwrap(), get(&sim, "Map.place"));
    assert!((safe - 0.10).abs() < 0.005, "{safe}");
    assert!((chosen.x + 15.0).abs() < 0.5 && chosen.y.abs() < 3.0, "{chosen}");
    let (mass, g) = (1450.0 + left, MU / RADIUS.powi(2) - (RATE * LATITUDE.cos()).powi(2) * RADIUS);
    let crushed = |k: u32| sim.get(&format!("Leg{k}.crushed")).unwrap();
    let taken: f64 = (1..=4).map(|k| sim.get(&format!("Leg{k}.taken")).unwrap()).sum();
    // The honeycomb absorbed the energy of the fall, from engine cutoff to the final stand.
    let fallen = 0.5 * mass * told[5].3.powi(2) + mass * g * (told[5].2 - told[6].2);
    println!("honeycomb {} m, {taken} J of {fallen} J", crushed(1));
    // The rest of the energy went into struts and friction.
    assert!((0.7..1.0).contains(&(taken / fallen)));
    sim.run_until(seconds(800.0)).unwrap();
    let drift = (get(&sim, "lander.position") - place).norm() / 100.0;
    let carried: f64 = (1..=4).map(|k| sim.get(&format!("Leg{k}.load.force.z")).unwrap()).sum();
    println!("drift {drift:e} m/s, carried {carried} N of {}", mass * g);
    assert!(drift < 1e-6 && (carried / (mass * g) - 1.0).abs() < 1e-4);
    // The tilt is at most the slope of the site plus a decimetre of honeycomb and ground over 4.8 m.
    assert!(tilt(&sim) < slope + 0.05, "{} {slope}", tilt(&sim));
}

/// Without hazard avoidance it lands in the middle of the site, which is unsafe: this is reported, and it stands there.
#[test]
fn without_the_divert_it_stands_where_it_is_dangerous() {
    let mut sim = repository("lunar_landing/sim.ron", &["reach=0.01"]).unwrap();
    let (told, ..) = fly(&mut sim, 620.0);
    assert!(told.iter().any(|t| t.0 == "least_danger") && !told.iter().any(|t| t.0 == "divert"));
    let (slope, rough, off) = chosen(&sim);
    assert!(get(&sim, "Map.place").xy().norm() < 1e-9);
    assert!((slope.to_degrees() - 16.6).abs() < 0.05 && (rough - 1.0).abs() < 0.1, "{rough}");
    // The lander slides downhill from the touchdown point, and stops at a boulder.
    let lean = tilt(&sim).to_degrees();
    assert!((lean - 32.0).abs() < 0.5 && (off - 1.9).abs() < 0.05, "{lean} {off}");
}

/// If no position is safe, here because the map itself is rougher than allowed, a separate phase goes to the least dangerous position.
#[test]
fn where_no_place_is_safe_the_least_danger_is_taken_and_told() {
    let mut sim =
        repository("lunar_landing/sim.ron", &["roughness_max=1 cm", "slope_max=0.2 deg"]).unwrap();
    let (told, ..) = fly(&mut sim, 620.0);
    let names: Vec<&str> = told.iter().map(|t| &*t.0).collect();
    let want = ["braking", "approach", "survey", "least_danger", "vertical", "drop", "standing"];
    assert_eq!(names, want);
    let (slope, rough, off) = chosen(&sim);
    assert!(sim.get("Map.safe").unwrap() == 0.0 && rough > 0.01 && off < 0.5);
    // The slope is far less than in the middle, where it is 16.6°, and the lander stands.
    assert!(slope < 4f64.to_radians() && sim.get("Ground.speed").unwrap() < 1e-6);
}
