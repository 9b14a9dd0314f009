//! Entry, parachute and powered descent compared with results of independent programs (DOP853 at 1e-12 relative; a conic solver).
use linkwork_flight::guidance::convex::{Descent, Node, plan};
use linkwork_flight::parachute::inflation::{terminal_speed, wrist_modes};
use linkwork_spatial::nalgebra::{Matrix3, Quaternion, Rotation3, Vector3};
use linkwork_spatial::{Quat, Vec3};
use serde_json::Value;

use crate::common;
use common::{Worst, get, list, num, reference, rotation, row, seconds, vec3, velocity};
use linkwork_runtime::Simulation;

fn pairs(x: &Value, y: &Value, scale: f64) -> String {
    let rows = row(x).into_iter().zip(row(y));
    format!("[{}]", rows.map(|(a, b)| list(&[a, b * scale])).collect::<Vec<_>>().join(", "))
}

/// Gravity and air of the reference's Mars; writes the table of the air into `folder`.
fn mars(all: &Value, folder: &std::path::Path) -> String {
    let p = &all["planet"];
    let rows: Vec<Vec<f64>> =
        all["atmosphere"]["table"].as_array().unwrap().iter().map(row).collect();
    let mut table = String::from("HgtMOLA Denkgm3 Temp\n");
    let mut winds = Vec::new();
    for r in &rows {
        table += &format!("{:?} {:?} {:?}\n", r[0] / 1000.0, r[1], r[2]);
        winds.push(format!("(altitude: {:?}, east: {:?}, north: {:?})", r[0], r[3], r[4]));
    }
    let file = folder.join("mars.txt");
    std::fs::write(&file, table).unwrap();
    let (gm, radius, j2, omega) =
        (num(&p["GM"]), num(&p["R_ref"]), num(&p["J2"]), num(&p["omega"]));
    format!(
        r#""Place": (
            world: (body: "mars", mu: {gm:?}, rate: {omega:?}, radius: {radius:?}, flattening: 0),
            parts: {{
                "Gravity": (model: "environment.zonal_gravity", params: {{ "j2": {j2:?} }}),
                "Air": (model: "environment.mars_air", params: {{ "table": {:?}, "winds": [{}] }}),
            }},
        ),"#,
        file.display().to_string(),
        winds.join(", ")
    )
}

const TIGHT: &str = "step: \"250 ms\", integrator: \"dormand_prince_54\", accuracy: (relative: 1e-12, absolute: 1e-10), until: \"400 s\"";

/// Returns the entry of `mars_entry_3dof.json` with these settings.
fn entry(all: &Value, folder: &std::path::Path, settings: &str) -> String {
    let (input, aero, bank) = (&all["inputs"], &all["aero"], &all["bank"]);
    let (radius, omega) = (num(&all["planet"]["R_ref"]), num(&all["planet"]["omega"]));
    let place = row(&input["lat_lon_deg"]);
    let [lat, lon] = [place[0].to_radians(), place[1].to_radians()];
    let up = Vec3::new(lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin());
    let east = Vec3::new(-lon.sin(), lon.cos(), 0.0);
    let north = up.cross(&east);
    let angle = |name: &str| num(&input[name]).to_radians();
    let (fpa, azimuth) = (angle("fpa_deg"), angle("azimuth_deg"));
    let r = up * (radius + num(&input["h0_m"]));
    let along = (north * azimuth.cos() + east * azimuth.sin()) * fpa.cos() + up * fpa.sin();
    let v = along * num(&input["V0_rel_ms"]) + (Vec3::z() * omega).cross(&r);
    format!(
        r#"Simulation(
        bodies: {{ "capsule": (parent: "world", hinge: Free, mass: {:?}, inertia: [5000, 5000, 5000],
            initial: (position: {}, velocity: {})) }},
        parts: {{ {}
            "Time": (model: "basics.ramp"),
            "Bank": (model: "basics.lookup", params: {{ "table": {} }}),
            "Aero": (model: "flight.entry_aerodynamics", params: {{ "area": {:?}, "nose_radius": 1.125,
                "drag": {}, "lift_to_drag": {} }}, bind: {{ "body": "node:capsule" }}),
        }},
        wires: ["Time.y -> Bank.u", "Bank.y -> Aero.bank"], {settings})"#,
        num(&input["mass"]),
        list(r.as_slice()),
        list(v.as_slice()),
        mars(all, folder),
        pairs(&bank["t_s"], &bank["bank_deg"], 1f64.to_radians()),
        num(&input["S"]),
        pairs(&aero["Mach"], &aero["CD"], 1.0),
        pairs(&aero["Mach"], &aero["L_over_D"], 1.0),
    )
}

/// Continues to `until` (s). Returns the heat load (J/m²) in that time by Sutton and Graves alone, k √(ρ/r_n) V³, by Simpson's rule. At each of its
/// points the model's flux must be this flux bounded by the energy of the gas: q_c/√(1 + (q_c/q_f)²), q_f = ρ V³/2.
fn without_bound(sim: &mut Simulation, until: f64) -> f64 {
    let flux = |sim: &Simulation| {
        let number = |name: &str| sim.get(&format!("Aero.{name}")).unwrap();
        let (density, speed) = (number("density"), number("airspeed"));
        let continuous = 1.9027e-4 * (density / 1.125).sqrt() * speed.powi(3);
        let free = 0.5 * density * speed.powi(3);
        let want = continuous / (1.0 + (continuous / free).powi(2)).sqrt();
        assert!((number("heating") / want - 1.0).abs() < 1e-9, "{} {want}", number("heating"));
        continuous
    };
    let from = sim.time();
    let count = ((until - from) / 0.5).round() as usize;
    let (mut sum, mut last) = (0.0, flux(sim));
    for k in 0..count {
        let at = |share: f64| from + (until - from) * (k as f64 + share) / count as f64;
        sim.run_until(seconds(at(0.5))).unwrap();
        let middle = flux(sim);
        sim.run_until(seconds(at(1.0))).unwrap();
        let end = flux(sim);
        sum += (last + 4.0 * middle + end) * (at(1.0) - at(0.0)) / 6.0;
        last = end;
    }
    sim.run_until(seconds(until)).unwrap();
    sum
}

#[test]
fn mars_entry_with_three_degrees_of_freedom() {
    let Some(all) = reference("mars_entry_3dof.json") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (radius, omega) = (num(&all["planet"]["R_ref"]), num(&all["planet"]["omega"]));
    let text = entry(&all, folder.path(), TIGHT);
    let mut sim = common::scene(&text, &[]).unwrap();
    let [mut height, mut across, mut speed, mut heat, mut mach] = [Worst(0.0); 5];
    let [mut path, mut azimuth, mut density, mut last] = [Worst(0.0); 4];
    let end = row(&all["planet_fixed_state_at_end"]);
    let mut load = 0.0;
    let table: Vec<Vec<f64>> = all["rows"].as_array().unwrap().iter().map(row).collect();
    assert_eq!(table.len(), 14);
    for (k, want) in table.iter().enumerate() {
        let t = want[0];
        load += without_bound(&mut sim, t);
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), -omega * t);
        let r_W = get(&sim, "capsule.position");
        let r = turn * r_W;
        let v = turn * (velocity(&sim, "capsule") - (Vec3::z() * omega).cross(&r_W));
        height.take((r.norm() - radius - want[1]).abs());
        let (lat, lon) = ((r.z / r.norm()).asin(), r.y.atan2(r.x));
        across.take((lat - want[2].to_radians()).abs() * radius);
        across.take((lon - want[3].to_radians()).abs() * radius);
        speed.take((v.norm() - want[4]).abs());
        mach.take((sim.get("Aero.mach").unwrap() - want[7]).abs());
        heat.take((load / 1e4 - want[9]).abs());
        let up = r / r.norm();
        let east = Vec3::new(-r.y, r.x, 0.0) / r.x.hypot(r.y);
        path.take(((v.dot(&up) / v.norm()).asin().to_degrees() - want[5]).abs());
        let found = v.dot(&east).atan2(v.dot(&up.cross(&east))).to_degrees();
        azimuth.take((found - want[6]).abs());
        density.take((sim.get("Aero.density").unwrap() / want[8] - 1.0).abs());
        if k + 1 == table.len() {
            last.take((r - vec3(&end)).norm());
            speed.take((v - vec3(&end[3..])).norm());
        }
    }
    // The reference requires 0.1 m and 1e-3 m/s, and has an error of 6e-5 m.
    height.below(2e-3, "3 dof, height, m");
    across.below(2e-3, "3 dof, over the ground, m");
    speed.below(1e-4, "3 dof, speed, m/s");
    mach.below(1e-6, "3 dof, Mach number");
    // The reference and this sum use Sutton and Graves's flux at every height; the model limits it to the energy of
    // thin air.
    heat.below(0.05, "3 dof, heat load of Sutton and Graves, J/cm²");
    let bounded = sim.get("Aero.heat_load").unwrap();
    assert!(bounded < load && load - bounded < 13e4, "{bounded} {load} J/m²");
    path.below(1e-6, "3 dof, angle of the path, deg");
    azimuth.below(1e-6, "3 dof, azimuth, deg");
    density.below(1e-6, "3 dof, density, relative");
    last.below(2e-3, "3 dof, place at the end in the planet's axes, m");
    // The capsule is first faster than the last Mach number of the table. The number is clamped, which gives a warning
    // at the start, and an event where the capsule enters the table.
    assert_eq!(sim.get("Aero.outside").unwrap(), 1.0);
    assert!(sim.take_notices().is_empty());
}

/// Steps of 1 s, as other programs use: tables, bank profile and winds have kinks within them, at which the integrator of order 8 has an error of 2.8
/// mm at the same accuracy.
#[test]
fn an_entry_in_steps_of_a_second_is_within_a_millimetre() {
    let Some(all) = reference("mars_entry_3dof.json") else { return };
    let folder = tempfile::tempdir().unwrap();
    let fly = |settings: &str| {
        let text = entry(&all, folder.path(), settings);
        let mut sim = common::scene(&text, &[]).unwrap();
        let places = (1..=30).map(|k| {
            sim.run_until(seconds(10.0 * f64::from(k))).unwrap();
            get(&sim, "capsule.position")
        });
        places.collect::<Vec<Vec3>>()
    };
    let converged = fly(TIGHT);
    let own = fly(
        r#"step: "1 s", integrator: "dormand_prince_54", accuracy: (relative: 1e-10, absolute: 1e-8), until: "400 s""#,
    );
    let mut worst = Worst(0.0);
    own.iter().zip(&converged).for_each(|(a, b)| worst.take((a - b).norm()));
    worst.below(1e-3, "steps of 1 s, from converged over 300 s, m");
}

#[test]
fn mars_entry_with_six_degrees_of_freedom() {
    let Some(all) = reference("mars_entry_6dof.json") else { return };
    let (input, aero) = (&all["inputs"], &all["aero"]);
    let folder = tempfile::tempdir().unwrap();
    let rows: Vec<Vec<f64>> = all["rows"].as_array().unwrap().iter().map(row).collect();
    let start = &rows[0];
    let column = |name: &str| {
        let all = row(&aero[name]);
        format!("[{}]", all.iter().map(|x| list(&[*x])).collect::<Vec<_>>().join(", "))
    };
    let i: Vec<Vec<f64>> = input["I"].as_array().unwrap().iter().map(row).collect();
    let inertia = list(&[i[0][0], i[1][1], i[2][2], i[0][1], i[0][2], i[1][2]]);
    let angles: Vec<f64> = row(&aero["alpha_total_deg"]).into_iter().map(f64::to_radians).collect();
    let nose: Vec<f64> = row(&aero["cg_from_nose_body"]).into_iter().map(|x| -x).collect();
    // Two rows with equal times describe a jump.
    let (times, torques) = (row(&all["roll_torque"]["t_s"]), row(&all["roll_torque"]["N_m"]));
    let program: Vec<String> = (0..times.len() - 1)
        .filter(|k| times[*k] < times[k + 1])
        .map(|k| format!("(time: {:?}, moment: [{:?}, 0, 0])", times[k], torques[k]))
        .collect();
    let text = format!(
        r#"Simulation(
        bodies: {{ "capsule": (parent: "world", hinge: Free, mass: {:?}, inertia: {inertia},
            initial: (position: {}, velocity: {}, rotation: (quat: {}), angular: {})) }},
        parts: {{ {}
            "Roll": (model: "flight.body_load", params: {{ "rows": [{}] }}, bind: {{ "body": "node:capsule" }}),
            "Aero": (model: "flight.axisymmetric_aerodynamics", params: {{ "area": {:?}, "length": {:?},
                "angles": {}, "axial": {}, "normal": {}, "pitch": {}, "reference": {},
                "damping": [{:?}, {:?}, {:?}] }}, bind: {{ "body": "node:capsule" }}),
        }}, {TIGHT})"#,
        num(&input["mass"]),
        list(&start[1..4]),
        list(&start[4..7]),
        list(&start[7..11]),
        list(&start[11..14]),
        mars(&all, folder.path()),
        program.join(", "),
        num(&input["S"]),
        num(&input["D"]),
        list(&angles),
        column("CA"),
        column("CN"),
        column("Cm_nose"),
        list(&nose),
        num(&input["Clp"]),
        num(&input["Cmq"]),
        num(&input["Cmq"]),
    );
    let mut sim = common::scene(&text, &[]).unwrap();
    let [mut r, mut v, mut q, mut w, mut alpha, mut g] = [Worst(0.0); 6];
    let [mut height, mut speed, mut mach] = [Worst(0.0); 3];
    let radius = num(&all["planet"]["R_ref"]);
    let mass = num(&input["mass"]);
    for want in &rows {
        sim.run_until(seconds(want[0])).unwrap();
        r.take((get(&sim, "capsule.position") - vec3(&want[1..])).norm());
        v.take((velocity(&sim, "capsule") - vec3(&want[4..])).norm());
        let turned = Quat::from_quaternion(Quaternion::new(want[10], want[7], want[8], want[9]));
        q.take(rotation(&sim, "capsule").angle_to(&turned));
        w.take((get(&sim, "capsule.angular") - vec3(&want[11..])).norm());
        alpha.take((sim.get("Aero.alpha").unwrap().to_degrees() - want[17]).abs());
        alpha.take((sim.get("Aero.beta").unwrap().to_degrees() - want[18]).abs());
        height.take((get(&sim, "capsule.position").norm() - radius - want[14]).abs());
        speed.take((sim.get("Aero.airspeed").unwrap() - want[15]).abs());
        mach.take((sim.get("Aero.mach").unwrap() - want[16]).abs());
        let felt = sim.get("Aero.force").unwrap() / mass;
        // The reference divides by standard gravity.
        g.take((felt / 9.80665 - want[19]).abs());
    }
    // The reference requires 0.05 m and 1e-4 of the quaternion.
    r.below(1e-3, "6 dof, position, m");
    v.below(1e-4, "6 dof, velocity, m/s");
    q.below(1e-5, "6 dof, attitude, rad");
    w.below(1e-5, "6 dof, rates, rad/s");
    alpha.below(1e-3, "6 dof, angles of attack and sideslip, deg");
    g.below(1e-5, "6 dof, deceleration, g");
    height.below(1e-3, "6 dof, height, m");
    speed.below(1e-4, "6 dof, speed through the air, m/s");
    mach.below(1e-6, "6 dof, Mach number");
    // The inertia tensor is about a centre of mass that is behind the nose and off the axis of the
    // shell.
    assert!(Matrix3::from_fn(|a, b| i[a][b]).determinant() > 0.0);
}

#[test]
fn a_parachute_opens_behind_a_payload() {
    let Some(all) = reference("parachute_two_body.json") else { return };
    let input = &all["inputs"];
    let (load, chute, riser) = (&input["payload"], &input["chute"], &input["riser"]);
    let rows: Vec<Vec<f64>> = all["rows"].as_array().unwrap().iter().map(row).collect();
    let s = &rows[0];
    let i: Vec<Vec<f64>> = load["I"].as_array().unwrap().iter().map(row).collect();
    let inertia = list(&[i[0][0], i[1][1], i[2][2], i[0][1], i[0][2], i[1][2]]);
    // There is only one gas constant, so that the speed of sound equals the reference's.
    let sound = num(&input["sound"]);
    let text = format!(
        r#"Simulation(
        bodies: {{
            "payload": (parent: "world", hinge: Free, mass: {:?}, inertia: {inertia},
                initial: (position: {}, velocity: {}, rotation: (quat: {}), angular: {}),
                nodes: {{ "riser": (position: {}) }}),
            "chute": (parent: "world", hinge: Free, mass: {:?}, inertia: [100, 100, 100],
                initial: (position: {}, velocity: {})),
        }},
        parts: {{
            "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, {:?}] }}),
            "Air": (model: "environment.exponential_atmosphere", params: {{ "density": {:?},
                "scale_height": {:?}, "temperature": 200, "heat_ratio": 1.25, "gas_constant": {:?}, "wind": {} }}),
            "Drag": (model: "flight.drag", params: {{ "coefficient": {:?}, "area": 1, "heating_constant": 0 }},
                bind: {{ "body": "node:payload" }}),
            "Damping": (model: "flight.rate_damping", params: {{ "damping": {} }}, bind: {{ "body": "node:payload" }}),
            "Riser": (model: "flight.line", params: {{ "length": {:?}, "stiffness": {:?}, "damping": {:?} }},
                bind: {{ "a": "node:payload/riser", "b": "node:chute" }}),
            "Canopy": (model: "flight.canopy", params: {{ "diameter": {:?}, "drag_coefficient": {:?}, "start": {:?},
                "packed": {:?}, "filling_time": {:?}, "exponent": {:?}, "breathing": {:?},
                "breathing_frequency": {:?}, "apparent": {:?} }}, bind: {{ "canopy": "node:chute" }}),
        }},
        step: "10 ms", integrator: "dormand_prince_54", accuracy: (relative: 1e-11, absolute: 1e-10), until: "60 s")"#,
        num(&load["mass"]),
        list(&s[1..4]),
        list(&s[4..7]),
        list(&s[7..11]),
        list(&s[11..14]),
        list(&row(&load["attach"])),
        num(&chute["mass"]),
        list(&s[14..17]),
        list(&s[17..20]),
        -num(&input["g"]),
        num(&input["rho0"]),
        num(&input["H"]),
        sound * sound / (1.25 * 200.0),
        list(&row(&input["wind_enu"])),
        num(&load["CDS"]),
        list(&row(&load["rot_damping"])),
        num(&riser["L0"]),
        num(&riser["k"]),
        num(&riser["c"]),
        num(&chute["D0"]),
        num(&chute["CD0"]),
        num(&chute["t0"]),
        num(&chute["f_min"]),
        num(&chute["tinf"]),
        num(&chute["n"]),
        num(&chute["osc_amp"]),
        num(&chute["osc_Hz"]),
        num(&chute["ka"]),
    );
    let mut sim = common::scene(&text, &[]).unwrap();
    let [mut r, mut v, mut q, mut w, mut extension, mut tension] = [Worst(0.0); 6];
    for want in &rows {
        sim.run_until(seconds(want[0])).unwrap();
        for (body, at) in [("payload", 1), ("chute", 14)] {
            r.take((get(&sim, &format!("{body}.position")) - vec3(&want[at..])).norm());
            v.take((velocity(&sim, body) - vec3(&want[at + 3..])).norm());
        }
        let turned = Quat::from_quaternion(Quaternion::new(want[10], want[7], want[8], want[9]));
        q.take(rotation(&sim, "payload").angle_to(&turned));
        w.take((get(&sim, "payload.angular") - vec3(&want[11..])).norm());
        extension.take((sim.get("Riser.extension").unwrap() - want[20]).abs());
        tension.take((sim.get("Riser.tension").unwrap() - want[21]).abs());
    }
    // The reference requires 0.02 m, and has errors of 3e-5 m and 7e-5 m/s.
    r.below(1e-3, "parachute, positions, m");
    v.below(1e-3, "parachute, velocities, m/s");
    q.below(1e-5, "parachute, attitude, rad");
    w.below(1e-5, "parachute, rates, rad/s");
    extension.below(1e-4, "parachute, length of the riser, m");
    // The limit is 62 kN/m and 900 N s/m times the errors of the lengths and their rates.
    tension.below(10.0, "parachute, tension of the riser, N");
    let changes = all["number_of_slack_taut_events"].as_f64().unwrap();
    assert_eq!(sim.get("Riser.changes").unwrap(), changes);
    // The reference speed is √(2 m g/(ρ C_D S)) of payload and canopy at the payload's final
    // position; the payload still decelerates there.
    let areas = num(&chute["CD0"]) * num(&chute["S0"]) + num(&load["CDS"]);
    let height = get(&sim, "payload.position").z;
    let density = num(&input["rho0"]) * (-height / num(&input["H"])).exp();
    let of_both = num(&load["mass"]) + num(&chute["mass"]);
    let terminal = terminal_speed(of_both, num(&input["g"]), density, areas);
    let off = (terminal - num(&all["quasi_static_terminal_speed_at_end"])).abs();
    assert!(off < 1e-4, "{terminal} m/s");
    let sinks = -velocity(&sim, "payload").z;
    println!("sinks at {sinks} m/s, without changes it would at {terminal} m/s");
    assert!((sinks / terminal - 1.0).abs() < 0.03, "{sinks} {terminal}");
    // The run stops after every event, which gives the times of the changes. The reference takes the peak from the
    // integrator's own steps, "about 0.1 % low at most".
    let mut sim = common::scene(&text, &[]).unwrap();
    let mut found = Vec::new();
    let (mut changes, mut peak) = (0.0, (0.0, 0.0));
    while sim.time() < 3.0 {
        sim.step_event().unwrap();
        let pull = sim.get("Riser.tension").unwrap();
        if pull > peak.0 {
            peak = (pull, sim.time());
        }
        let now = sim.get("Riser.changes").unwrap();
        if now != changes {
            found.push(sim.time());
            changes = now;
        }
    }
    let events = all["first_events"].as_array().unwrap();
    assert_eq!(found.len(), events.len());
    for (a, b) in found.iter().zip(events) {
        assert!((a - num(&b[0])).abs() < 1e-6, "{found:?}");
    }
    let told = &all["peak_tension"];
    println!("peak {} N at {} s", peak.0, peak.1);
    assert!((peak.0 / num(&told["N"]) - 1.0).abs() < 1e-3, "{peak:?}");
    assert!((peak.1 - num(&told["t"])).abs() < 0.011, "{peak:?}");
}

/// The descent of `gfold_socp.json`.
fn fuel_optimal(input: &Value) -> Descent {
    let vector = |name: &str| vec3(&row(&input[name]));
    let throttle = row(&input["throttle"]);
    Descent {
        gravity: vector("g"),
        mass: num(&input["m0"]),
        dry: num(&input["mdry"]),
        specific_impulse: num(&input["Isp"]),
        thrust: num(&input["Tmax"]),
        throttle: [throttle[0], throttle[1]],
        cant: num(&input["cant"]),
        start: [vector("r0"), vector("v0")],
        end: [vector("rT"), vector("vT")],
        glide: num(&input["glide_deg"]).to_radians(),
        pointing: std::f64::consts::PI,
    }
}

/// Time (s), intervals and fuel (kg) of the same conic problem by ECOS 2.0 through CVXPY 1.9 at tolerances of 1e-10.
const ECOS: [(f64, usize, f64); 4] = [
    (39.0, 100, 221.90240852877832),
    (60.0, 60, 266.72374608488485),
    (90.0, 60, 352.7805425694885),
    (39.0, 200, 221.8977061932842),
];
/// Positions (m) at nodes of the last of them.
const ECOS_PLACES: [(usize, [f64; 3]); 3] = [
    (50, [1459.7604105064322, 432.66847695057123, 955.3488037439333]),
    (100, [787.7548449139636, 265.75559533474376, 477.2530171827676]),
    (150, [223.07167888770948, 84.36319293525438, 105.07908076783896]),
];

/// Checks every constraint of the reference's formulation at every node.
fn keeps_its_constraints(d: &Descent, p: &[Node]) {
    let flow = 1.0 / (d.specific_impulse * 9.80665 * d.cant.cos());
    let [low, high] = d.throttle.map(|t| t * d.thrust * d.cant.cos());
    for n in p {
        let (s, z0) = (n.thrust.norm() + n.gap, d.mass - flow * high * n.time);
        let below = (n.mass / z0).ln();
        let least = low / z0 * (1.0 - below + 0.5 * below * below);
        assert!(n.gap > -1e-7 && s > least - 1e-7 && s < high / z0 * (1.0 - below) + 1e-7, "{n:?}");
        let most = d.mass - flow * low * n.time;
        assert!(n.mass > z0 - 1e-4 && n.mass < most + 1e-4 && n.mass >= d.dry, "{n:?}");
        let goal = n.position - d.end[0];
        assert!(goal.z > goal.x.hypot(goal.y) * d.glide.tan() - 1e-3, "{n:?}");
    }
    for w in p.windows(2) {
        let (a, b, h) = (&w[0], &w[1], w[1].time - w[0].time);
        let v = a.velocity + (a.thrust + b.thrust) * (0.5 * h) + d.gravity * h;
        let turned = a.thrust / 3.0 + b.thrust / 6.0 + d.gravity / 2.0;
        let r = a.position + a.velocity * h + turned * (h * h);
        let s = a.thrust.norm() + a.gap + b.thrust.norm() + b.gap;
        assert!((v - b.velocity).norm() < 1e-6 && (r - b.position).norm() < 1e-5, "{b:?}");
        assert!(((a.mass / b.mass).ln() - 0.5 * h * flow * s).abs() < 1e-8, "{b:?}");
    }
    for (n, [place, rate]) in [(&p[0], d.start), (&p[p.len() - 1], d.end)] {
        assert!((n.position - place).norm() < 1e-5 && (n.velocity - rate).norm() < 1e-6, "{n:?}");
    }
}

/// The reference's solver left a gap ‖u‖ < s of up to 5e-3 m/s², which costs propellant: 0.04 kg around the best time, where the reference requires
/// 0.1 kg, and 0.66 kg of 267 far from it. Our solution never needs more and satisfies every constraint, and a third solver confirms it.
#[test]
fn fuel_optimal_powered_descent() {
    let Some(all) = reference("gfold_socp.json") else { return };
    let d = fuel_optimal(&all["inputs"]);
    let planned = |time: f64, nodes: usize| {
        let p = plan(&d, time, nodes).unwrap();
        keeps_its_constraints(&d, &p);
        (d.mass - p[nodes].mass, p)
    };
    let [mut near, mut above, mut far, mut third] = [Worst(0.0); 4];
    for want in all["fine_N100"].as_array().unwrap().iter().map(row) {
        let (fuel, _) = planned(want[0], 100);
        near.take((fuel - want[1]).abs());
        above.take((fuel - want[1]).max(0.0));
    }
    for want in all["coarse"].as_array().unwrap().iter().map(row) {
        let (fuel, _) = planned(want[0], 60);
        far.take((fuel - want[1]).abs());
        above.take((fuel - want[1]).max(0.0));
    }
    near.below(0.04, "fuel within 5 s of the best time, kg");
    far.below(0.66, "fuel at other times, kg");
    above.below(1e-4, "fuel above that of the file, kg");
    for (time, nodes, want) in ECOS {
        third.take((planned(time, nodes).0 - want).abs());
    }
    third.below(1e-4, "fuel beside ECOS, kg");

    // At whole seconds the best time of flight agrees with the reference.
    let best = num(&all["best_tf_at_1s"]);
    let fuel = |time: f64| planned(time, 100).0;
    assert!(fuel(best) < fuel(best - 1.0) && fuel(best) < fuel(best + 1.0));
    let (fuel, p) = planned(best, 200);
    Worst((fuel - num(&all["fuel_N200"])).abs()).below(0.015, "fuel of 200 intervals, kg");
    let [mut beside, mut speeds, mut masses, mut third] = [Worst(0.0); 4];
    let mut thrusts = [Worst(0.0); 2];
    let rows: Vec<Vec<f64>> = all["nodes_N200"].as_array().unwrap().iter().map(row).collect();
    for want in &rows {
        let n = &p[(want[0] / best * 200.0).round() as usize];
        beside.take((n.position - vec3(&want[1..4])).norm());
        speeds.take((n.velocity - vec3(&want[4..7])).norm());
        // Rows at which both are at the throttle limit are separated from the two at which the reference's
        // solution is between the limits.
        let full = [9.75, 19.5].iter().all(|t| *t != want[0]);
        let thrust = if full { &mut thrusts[0] } else { &mut thrusts[1] };
        thrust.take((n.thrust - vec3(&want[7..10])).norm());
        masses.take((n.mass - want[10]).abs());
    }
    // The reference states 0.5 m, for a solution accurate to 0.003 kg; its own solution is 0.014 kg above ours, which a
    // third solver confirms (below). The optimum is flat: this corresponds to 4.4 m in the middle, 0.36 m/s, and a
    // different thrust where the throttle is about to switch.
    beside.below(4.5, "position beside the file's, m");
    speeds.below(0.4, "velocity beside the file's, m/s");
    thrusts[0].below(0.1, "full thrust over mass beside the file's, m/s²");
    thrusts[1].below(2.3, "thrust over mass at a change beside the file's, m/s²");
    masses.below(0.4, "mass beside the file's, kg");
    for (k, want) in ECOS_PLACES {
        third.take((p[k].position - Vec3::from(want)).norm());
    }
    third.below(0.5, "position beside ECOS, m");
}

/// The two modes in which a payload swings under a fixed canopy: `inflation::wrist_modes`. The simulation starts in each mode separately.
/// At the small amplitude of 1e-4 rad, it returns after the period of the closed form.
#[test]
fn a_payload_on_a_riser_swings_in_its_two_modes() {
    let (mass, inertia, arm, length, gravity, stiffness) = (2850.0, 4600.0, 1.6, 50.0, 3.71, 1e6);
    let tension = mass * gravity;
    let slack = length - tension / stiffness;
    for omega in wrist_modes(tension, length, mass, inertia, arm) {
        // The amplitude follows from −m ω² y = −T (y + a θ)/l.
        let theta = 1e-4;
        let y = -(tension * arm / length) / (tension / length - mass * omega * omega) * theta;
        let half = 0.5 * theta;
        let text = format!(
            r#"Simulation(
    bodies: {{
        "canopy": (parent: "world", nodes: {{ "hook": (position: [0, 0, {top:?}]) }}),
        "payload": (
            parent: "world", hinge: Free, mass: {mass}, inertia: [{inertia}, {inertia}, 5000],
            initial: (position: [{y:?}, 0, 0], rotation: (quat: [0, {sine:?}, 0, {cosine:?}])),
            nodes: {{ "bridle": (position: [0, 0, {arm}]) }},
        ),
    }},
    parts: {{
        "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -{gravity}] }}),
        "Line": (
            model: "flight.line", params: {{ "length": {slack:?}, "stiffness": {stiffness:?}, "taut": true }},
            bind: {{ "a": "node:canopy/hook", "b": "node:payload/bridle" }},
        ),
    }},
    step: "5 ms", until: "1000 s", integrator: "rk4",
)"#,
            top = arm + length,
            sine = half.sin(),
            cosine = half.cos(),
        );
        let mut sim = common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
        let period = std::f64::consts::TAU / omega;
        let mut at = |t: f64| {
            sim.run_until(seconds((t * 1e3).round() * 1e-3)).unwrap();
            let c = (omega * sim.time()).cos();
            let lean = 2.0 * rotation(&sim, "payload").j;
            let place = get(&sim, "payload.position").x;
            // Measured: 6e-8 of the amplitudes.
            let off = ((lean - theta * c) / theta).abs().max(((place - y * c) / y).abs());
            assert!(off < 2e-7 && lean.is_finite() && place.is_finite(), "{omega} at {t}: {off}");
        };
        for k in 1..=8 {
            at(0.25 * f64::from(k) * period);
        }
    }
}

/// `flight.convex_descent` in a simulation of rotating Mars, with W at the landing site: the plan assumes flat ground and uniform gravity, and
/// feedback corrects the difference. Another instance continues from the middle, bit-identical.
#[test]
fn a_convex_plan_is_flown_over_a_planet_that_turns() {
    let text = r#"Simulation(
    bodies: { "lander": (
        parent: "world", hinge: Free, mass: 1505, inertia: [1500, 1500, 1800],
        initial: (position: [2000, 450, 1500], velocity: [-40, 12, -65]),
    ) },
    world: (body: "mars", mu: 4.2828e13, site: (latitude: "20 deg", longitude: "77 deg", height: -2500)),
    parts: {
        "Gravity": (model: "environment.point_mass_gravity"),
        "Tank": (model: "flight.propellant_tank", params: { "propellant": 400, "radius": "10 um", "density": 1e20 }, bind: { "bottom": "node:lander" }),
        "Mass": (model: "basics.gain", params: { "k": 1, "offset": 1505 }),
        "Guidance": (
            model: "flight.convex_descent", rate: "10 Hz", bind: { "body": "node:lander" },
            params: { "dry": 1505, "specific_impulse": 225, "thrust": 18600, "throttle": [0.2, 0.9], "glide": "15 deg", "velocity": [0, 0, -0.5], "times": [30, 70], "nodes": 30 },
        ),
        "Engine": (model: "flight.vector_thrust", params: { "specific_impulse": 225, "lag": "50 ms" }, bind: { "body": "node:lander" }),
    },
    wires: [
        "Tank.propellant -> Mass.u", "Mass.y -> Guidance.mass", "Guidance.force -> Engine.command",
    ],
    connect: [("Engine.propellant", "Tank.outlet")],
    step: "20 ms", until: "80 s", integrator: "rk4",
)"#;
    let scene = || common::scene(text, &[]).unwrap_or_else(|e| panic!("{e}"));
    let mut sim = scene();
    sim.run_until(seconds(0.2)).unwrap();
    assert!(sim.get("Guidance.planned").unwrap() > 0.5);
    sim.run_until(seconds(20.0)).unwrap();
    assert!(sim.get("Guidance.off").unwrap() < 3.0, "{}", sim.get("Guidance.off").unwrap());
    let mut other = scene();
    other.restore(&sim.checkpoint("").unwrap()).unwrap();
    for sim in [&mut sim, &mut other] {
        while sim.get("Guidance.to_go").unwrap() > 0.02 {
            let t = sim.time() + 0.1;
            sim.run_until(seconds((t * 10.0).round() / 10.0)).unwrap();
        }
    }
    assert_eq!(sim.hash(), other.hash());
    let (place, speed) = (get(&sim, "lander.position"), velocity(&sim, "lander"));
    // Measured: 9 cm and 0.28 m/s, mostly because the force is constant during the last second.
    assert!(place.norm() < 0.3 && (speed + Vec3::z() * 0.5).norm() < 0.5, "{place} {speed}");
}
