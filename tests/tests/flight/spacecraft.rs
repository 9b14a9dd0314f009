//! Spacecraft compared with trajectories from an independent program (DOP853): wheels and slosh, a stack that separates twice, a guided descent.
use linkwork_flight::guidance::powered_descent::{Target, quadratic, quadratic_coefficients};
use linkwork_runtime::Simulation;
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Mat3, Quat, Vec3};
use serde_json::Value;

use crate::common;
use common::{Worst, get, list, num, reference, rotation, row, rows, seconds, vec3, velocity};

fn triple(v: &Vec3) -> String {
    list(v.as_slice())
}

fn inertia(i: &Mat3) -> String {
    list(&[i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]])
}

fn quat(v: &[f64]) -> Quat {
    Quat::from_quaternion(Quaternion::new(v[3], v[0], v[1], v[2]))
}

fn tight(until: f64) -> String {
    format!(
        "gravity: \"none\", step: \"100 ms\", integrator: \"dormand_prince_54\", \
         accuracy: (relative: 1e-12, absolute: 1e-12), until: \"{until} s\""
    )
}

/// Reads a rotation from the outputs of a part.
fn rotation_of(sim: &Simulation, name: &str) -> Quat {
    let [w, x, y, z] = ["w", "x", "y", "z"].map(|c| sim.get(&format!("{name}.{c}")).unwrap());
    Quat::from_quaternion(Quaternion::new(w, x, y, z))
}

fn matrix(v: &Value) -> Mat3 {
    let i = rows(v);
    Mat3::from_fn(|a, b| i[a][b])
}

/// Hub, two pendulums and three wheels of `slosh_wheels.json`.
fn slosh_scene(input: &Value) -> String {
    let w0 = vec3(&row(&input["w0"]));
    let mut body_inertia = matrix(&input["hub"]["I"]);
    let (mut bodies, mut parts, mut wires) = (String::new(), String::new(), Vec::new());
    let mut supplies = String::new();
    let mut nodes = format!("\"thrust\": (position: {}), ", list(&row(&input["thrust"]["point"])));
    for (k, wheel) in input["wheels"].as_array().unwrap().iter().enumerate() {
        let (g, inertia) = (vec3(&row(&wheel["g"])), num(&wheel["Js"]));
        // The reference's hub has the wheels locked; here each is a separate state.
        body_inertia -= g * g.transpose() * inertia;
        let q = Quat::rotation_between(&Vec3::z(), &g).unwrap();
        nodes += &format!("\"w{k}\": (rotation: (quat: {})), ", list(&[q.i, q.j, q.k, q.w]));
        let speed = num(&wheel["Om0"]) + g.dot(&w0);
        let torque: Vec<String> =
            row(&wheel["t"]).iter().zip(row(&wheel["u"])).map(|(t, u)| list(&[*t, u])).collect();
        parts += &format!(
            r#""Torque{k}": (model: "flight.sequence", params: {{ "rows": [{}] }}),
            "Wheel{k}": (model: "flight.reaction_wheel", params: {{ "inertia": {inertia:?}, "speed": {speed:?} }},
                bind: {{ "wheel": "node:hub/w{k}" }}), "#,
            torque.join(", ")
        );
        wires.push(format!("\"Torque{k}.y -> Wheel{k}.torque\""));
        supplies += &format!("\"Wheel{k}.supply\", ");
    }
    for (k, tank) in input["tanks"].as_array().unwrap().iter().enumerate() {
        let axis = vec3(&row(&tank["axis"])).normalize();
        let down = vec3(&row(&tank["down"]));
        let down = (down - axis * axis.dot(&down)).normalize() * num(&tank["L"]);
        bodies += &format!(
            r#""tank{k}": (parent: "hub", at: (position: {}), hinge: Pin({}), mass: {:?}, com: {}, inertia: [0, 0, 0],
                damping: {:?}, initial: (angle: {:?}, rate: {:?})), "#,
            list(&row(&tank["pivot"])),
            triple(&axis),
            num(&tank["m"]),
            triple(&down),
            num(&tank["c"]),
            num(&tank["th0"]),
            num(&tank["thd0"]),
        );
    }
    let thrust = &input["thrust"];
    let program: Vec<String> = row(&thrust["t"])
        .iter()
        .zip(rows(&thrust["F"]))
        .map(|(t, f)| format!("(time: {t:?}, force: {})", list(&f)))
        .collect();
    format!(
        r#"Simulation(
        bodies: {{
            "hub": (parent: "world", hinge: Free, mass: {:?}, inertia: {}, initial: (angular: {}), nodes: {{ {nodes} }}),
            {bodies}
        }},
        parts: {{ {parts}
            "Thrust": (model: "flight.body_load", params: {{ "rows": [{}] }}, bind: {{ "body": "node:hub/thrust" }}),
            "Supply": (model: "power.ideal_supply", params: {{ "voltage": 28 }}),
        }},
        connect: [({supplies} "Supply.terminal")],
        wires: [{}], {})"#,
        num(&input["hub"]["mass"]),
        inertia(&body_inertia),
        triple(&w0),
        program.join(", "),
        wires.join(", "),
        tight(num(&input["t_end"])),
    )
}

/// Momentum, angular momentum about W's origin and energy by the model described in the reference: its hub has the wheels locked, and pendulums are
/// particles.
fn slosh_books(sim: &Simulation, input: &Value) -> (Vec3, Vec3, f64) {
    let number = |name: String| sim.get(&name).unwrap();
    let (R, r, v, w) = (
        rotation(sim, "hub"),
        get(sim, "hub.position"),
        velocity(sim, "hub"),
        get(sim, "hub.angular"),
    );
    let mass = num(&input["hub"]["mass"]);
    let spin = matrix(&input["hub"]["I"]) * w;
    let (mut p, mut h) = (v * mass, r.cross(&v) * mass + R * spin);
    let mut energy = 0.5 * mass * v.norm_squared() + 0.5 * w.dot(&spin);
    for (k, wheel) in input["wheels"].as_array().unwrap().iter().enumerate() {
        let (g, inertia) = (vec3(&row(&wheel["g"])), num(&wheel["Js"]));
        let speed = number(format!("Wheel{k}.speed"));
        h += R * g * (inertia * speed);
        energy += inertia * speed * (0.5 * speed + g.dot(&w));
    }
    for (k, tank) in input["tanks"].as_array().unwrap().iter().enumerate() {
        let axis = vec3(&row(&tank["axis"])).normalize();
        let down = vec3(&row(&tank["down"]));
        let down = (down - axis * axis.dot(&down)).normalize() * num(&tank["L"]);
        let arm = Quat::from_scaled_axis(axis * number(format!("tank{k}.angle"))) * down;
        let at = vec3(&row(&tank["pivot"])) + arm;
        let moves = v + R * (w.cross(&at) + axis.cross(&arm) * number(format!("tank{k}.rate")));
        let m = num(&tank["m"]);
        p += moves * m;
        h += (r + R * at).cross(&moves) * m;
        energy += 0.5 * m * moves.norm_squared();
    }
    (p, h, energy)
}

#[test]
fn wheels_and_slosh_under_thrust() {
    let Some(all) = reference("slosh_wheels.json") else { return };
    let input = &all["inputs"];
    let mut sim = common::scene(&slosh_scene(input), &[]).unwrap();
    let [mut r, mut q, mut v, mut w, mut th, mut speeds] = [Worst(0.0); 6];
    let [mut momentum, mut angular] = [Worst(0.0); 2];
    for want in rows(&all["rows"]) {
        sim.run_until(seconds(want[0])).unwrap();
        r.take((get(&sim, "hub.position") - vec3(&want[1..])).norm());
        q.take(rotation(&sim, "hub").angle_to(&quat(&want[4..])));
        v.take((get(&sim, "hub.velocity") - vec3(&want[8..])).norm());
        w.take((get(&sim, "hub.angular") - vec3(&want[11..])).norm());
        for k in 0..2 {
            th.take((sim.get(&format!("tank{k}.angle")).unwrap() - want[14 + k]).abs());
            th.take((sim.get(&format!("tank{k}.rate")).unwrap() - want[16 + k]).abs());
        }
        for k in 0..3 {
            speeds.take((sim.get(&format!("Wheel{k}.speed")).unwrap() - want[18 + k]).abs());
        }
        let (p, h, _) = slosh_books(&sim, input);
        momentum.take((p - vec3(&want[21..])).norm());
        angular.take((h - vec3(&want[24..])).norm() / h.norm());
    }
    // The reference requires 1e-6 and has an error of 2e-10.
    r.below(1e-6, "slosh and wheels, position, m");
    q.below(1e-7, "slosh and wheels, attitude, rad");
    v.below(1e-7, "slosh and wheels, velocity, m/s");
    w.below(1e-7, "slosh and wheels, rates, rad/s");
    th.below(1e-6, "slosh and wheels, pendulums, rad and rad/s");
    speeds.below(1e-6, "slosh and wheels, wheels, rad/s");
    momentum.below(1e-7, "slosh and wheels, momentum, kg m/s");
    angular.below(1e-10, "slosh and wheels, angular momentum about W's origin, relative");
}

/// `check_values`: without thrust, wheel torques and damping, the drift of P, H and energy in the reference's own program.
#[test]
fn wheels_and_slosh_left_alone_keep_their_books() {
    let Some(all) = reference("slosh_wheels.json") else { return };
    let mut input = all["inputs"].clone();
    for wheel in input["wheels"].as_array_mut().unwrap() {
        wheel["u"] = serde_json::json!([0.0, 0.0, 0.0]);
    }
    for tank in input["tanks"].as_array_mut().unwrap() {
        tank["c"] = serde_json::json!(0.0);
    }
    for force in input["thrust"]["F"].as_array_mut().unwrap() {
        *force = serde_json::json!([0.0, 0.0, 0.0]);
    }
    let mut sim = common::scene(&slosh_scene(&input), &[]).unwrap();
    let (p0, h0, e0) = slosh_books(&sim, &input);
    let [mut p, mut h, mut e] = [Worst(0.0); 3];
    for t in 1..=60 {
        sim.run_until(seconds(f64::from(t))).unwrap();
        let now = slosh_books(&sim, &input);
        p.take((now.0 - p0).norm());
        h.take((now.1 - h0).norm());
        e.take((now.2 / e0 - 1.0).abs());
    }
    let told = row(&all["check_values"]);
    println!("the file's own: {told:?}");
    p.below(1e-9, "left alone, momentum, kg m/s");
    h.below(1e-9, "left alone, angular momentum, kg m²/s");
    e.below(1e-12, "left alone, energy, relative");
}

#[test]
fn a_stack_of_three_comes_apart() {
    let Some(all) = reference("three_body_separation.json") else { return };
    let (bodies, springs, sequence) =
        (all["bodies"].as_array().unwrap(), &all["springs"], &all["sequence"]);
    let start = &rows(&all["rows"])[0];
    let cm: Vec<Vec3> = bodies.iter().map(|b| vec3(&row(&b["cm_in_stack_m"]))).collect();
    let pairs = [("A_to_B", "A", "B"), ("B_to_C", "B", "C")];
    let (mut nodes, mut parts) = ([const { String::new() }; 3], [const { String::new() }; 2]);
    for (j, (name, first, second)) in pairs.iter().enumerate() {
        for (k, s) in springs[name].as_array().unwrap().iter().enumerate() {
            let place = |end: &str| list(&row(&s[end]));
            nodes[j] += &format!("\"{second}{k}\": (position: {}), ", place("p_first"));
            nodes[j + 1] += &format!("\"{first}{k}\": (position: {}), ", place("p_second"));
            parts[j] += &format!(
                r#""{name}{k}": (model: "flight.kickoff_spring", params: {{ "stiffness": {:?}, "length": {:?} }},
                    bind: {{ "a": "node:{first}/{second}{k}", "b": "node:{second}/{first}{k}" }}), "#,
                num(&s["k"]),
                num(&s["L0"]),
            );
        }
    }
    let mut text = String::from("Simulation(bodies: {");
    for (k, name) in ["A", "B", "C"].iter().enumerate() {
        let hinge = if k == 0 {
            format!(
                "parent: \"world\", hinge: Free, initial: (position: {}, velocity: {}, angular: {})",
                list(&start[1..4]),
                list(&start[4..7]),
                list(&start[11..14])
            )
        } else {
            let above = ["A", "B"][k - 1];
            let at = triple(&(cm[k] - cm[k - 1]));
            format!("parent: \"{above}\", at: (position: {at}), hinge: Locked")
        };
        text += &format!(
            "\"{name}\": ({hinge}, mass: {:?}, inertia: {}, nodes: {{ {} }}), ",
            num(&bodies[k]["mass"]),
            inertia(&matrix(&bodies[k]["I_about_cm"])),
            nodes[k]
        );
    }
    let free = "parent: \"world\", at: (position: [0, 0, 0]), hinge: Free";
    let motions = ["A", "B", "C"].map(|n| {
        format!(r#""Motion{n}": (model: "sensors.motion", bind: {{ "mount": "node:{n}" }})"#)
    });
    text += &format!(
        r#"}}, parts: {{ {} }}, start: "whole", phases: {{
            "whole": (to: {{ "first": "time > {:?} s" }}),
            "first": (bodies: {{ "B": ({free}) }}, parts: {{ {} }}, to: {{ "second": "time > {:?} s" }}),
            "second": (like: "first", bodies: {{ "C": ({free}) }}, parts: {{ {} }}),
        }}, {})"#,
        motions.join(", "),
        num(&sequence["t1_A_released"]),
        parts[0],
        num(&sequence["t2_B_and_C_part"]),
        parts[1],
        tight(num(&sequence["t_end"]))
    );
    let mut sim = common::scene(&text, &[]).unwrap();
    let [mut r, mut v, mut q, mut w, mut momentum, mut angular] = [Worst(0.0); 6];
    // The momentum P, and H about the common centre of mass, are equal in both rows.
    let books = rows(&all["momentum"]);
    let table = rows(&all["rows"]);
    assert!(table.len() == 13 && books.len() == 2);
    for want in &table {
        sim.run_until(seconds(want[0])).unwrap();
        let (mut p, mut h, mut first, mut mass) =
            (Vec3::zeros(), Vec3::zeros(), Vec3::zeros(), 0.0);
        for (k, name) in ["A", "B", "C"].iter().enumerate() {
            // A sensor on the body measures its motion, attached or free.
            let at = 1 + 13 * k;
            let place = get(&sim, &format!("Motion{name}.position"));
            let turned = rotation_of(&sim, &format!("Motion{name}.attitude"));
            let speed = get(&sim, &format!("Motion{name}.velocity"));
            let rate = get(&sim, &format!("Motion{name}.rate"));
            r.take((place - vec3(&want[at..])).norm());
            v.take((speed - vec3(&want[at + 3..])).norm());
            q.take(turned.angle_to(&quat(&want[at + 6..])));
            w.take((rate - vec3(&want[at + 10..])).norm());
            let m = num(&bodies[k]["mass"]);
            mass += m;
            first += place * m;
            p += speed * m;
            h += place.cross(&speed) * m + turned * (matrix(&bodies[k]["I_about_cm"]) * rate);
        }
        h -= first.cross(&p) / mass;
        for book in &books {
            momentum.take((p - vec3(&book[1..])).norm());
            angular.take((h - vec3(&book[4..])).norm());
        }
    }
    momentum.below(1e-9, "three bodies, momentum, kg m/s");
    angular.below(1e-9, "three bodies, angular momentum about the common centre, kg m²/s");
    // The reference requires 1e-6.
    r.below(1e-8, "three bodies, positions, m");
    v.below(1e-8, "three bodies, velocities, m/s");
    q.below(1e-8, "three bodies, attitudes, rad");
    w.below(1e-8, "three bodies, rates, rad/s");
    // The run gives the times at which the springs release, in the order of the reference.
    let mut sim = common::scene(&text, &[]).unwrap();
    let mut found: Vec<(String, f64)> = Vec::new();
    while sim.before(seconds(num(&sequence["t_end"]))) {
        sim.step_event().unwrap();
        for (name, count) in [("A_to_B", 4), ("B_to_C", 3)] {
            for spring in (0..count).map(|k| format!("{name}{k}")) {
                let over = sim.get(&format!("{spring}.over")).is_ok_and(|x| x == 1.0);
                if over && found.iter().all(|(known, _)| *known != spring) {
                    found.push((spring, sim.time()));
                }
            }
        }
    }
    let told = ["A_to_B", "B_to_C"].into_iter().flat_map(|name| {
        rows(&all["releases_t"][name]).into_iter().map(move |x| (format!("{name}{}", x[0]), x[1]))
    });
    let told: Vec<(String, f64)> = told.collect();
    assert_eq!(found.len(), 7);
    let mut late = Worst(0.0);
    for ((name, t), (want, at)) in found.iter().zip(&told) {
        assert_eq!(name, want);
        late.take((t - at).abs());
    }
    late.below(1e-9, "three bodies, releases of the springs, s");
}

/// Reference: four springs of 1800 N/m, 0.15 m, between 1200 and 385 kg.
#[test]
fn four_springs_part_two_bodies_with_the_speeds_of_the_closed_form() {
    let at = [[1, 1], [1, -1], [-1, 1], [-1, -1]];
    let nodes = (0..4).map(|k| format!("\"n{k}\": (position: [{}, {}, 0])", at[k][0], at[k][1]));
    let nodes = nodes.collect::<Vec<_>>().join(", ");
    let springs = (0..4).map(|k| {
        format!(
            r#""Spring{k}": (model: "flight.separation_spring", params: {{ "stiffness": 1800, "stroke": 0.15, "axis": [0, 0, 1] }},
                bind: {{ "a": "node:a/n{k}", "b": "node:b/n{k}" }})"#
        )
    });
    let springs = springs.collect::<Vec<_>>().join(", ");
    let text = format!(
        r#"Simulation(bodies: {{
            "a": (parent: "world", hinge: Free, mass: 1200, inertia: [900, 800, 700], nodes: {{ {nodes} }}),
            "b": (parent: "world", hinge: Free, mass: 385, inertia: [300, 250, 200], nodes: {{ {nodes} }}),
        }}, parts: {{ {springs} }}, {})"#,
        tight(1.0)
    );
    let mut sim = common::scene(&text, &[]).unwrap();
    let mut over = None;
    while over.is_none() {
        sim.step_event().unwrap();
        over = (sim.get("Spring0.force").unwrap() == 0.0).then(|| sim.time());
    }
    sim.run_until(seconds(1.0)).unwrap();
    let [a, b] = ["a", "b"].map(|body| velocity(&sim, body).z);
    println!("{a} m/s, {b} m/s, apart {} m/s, at {over:?} s", b - a);
    assert!((a + 0.18108505765870225).abs() < 1e-6 && (b - 0.5644209589362148).abs() < 1e-6);
    assert!((b - a - 0.745506016594917).abs() < 1e-6, "{}", b - a);
    assert!((over.unwrap() - 0.31605304823081287).abs() < 1e-6, "{over:?}");
    assert!((1200.0 * a + 385.0 * b).abs() < 1e-9, "{a} {b}");
}

#[test]
fn a_descent_guided_by_a_quadratic_with_limits_lag_and_sampling() {
    let Some(all) = reference("powered_descent_quadratic.json") else { return };
    let input = &all["inputs"];
    let flown = rows(&all["flown"]["rows"]);
    let vector = |name: &str| list(&row(&input[name]));
    let mass = num(&input["mass0"]);
    // Half of the mass is propellant in a tank of zero size.
    let (dry, drag) = (0.5 * mass, &input["drag"]);
    let text = format!(
        r#"Simulation(
        bodies: {{ "lander": (parent: "world", hinge: Free, mass: {dry:?}, inertia: [500, 500, 500],
            initial: (position: {}, velocity: {})) }},
        parts: {{
            "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": {} }}),
            "Air": (model: "environment.exponential_atmosphere", params: {{ "density": {:?}, "scale_height": {:?}, "temperature": 210, "gas_constant": 191.8, "heat_ratio": 1.33 }}),
            "Drag": (model: "flight.drag", params: {{ "coefficient": {:?}, "area": 1, "heating_constant": 0 }}, bind: {{ "body": "node:lander" }}),
            "Tank": (model: "flight.propellant_tank", params: {{ "propellant": {dry:?}, "radius": "10 um", "density": 1e20 }}, bind: {{ "bottom": "node:lander" }}),
            "Mass": (model: "basics.gain", params: {{ "k": 1, "offset": {dry:?} }}),
            "Guidance": (model: "flight.powered_descent", rate: "{:?} Hz", params: {{ "position": {}, "velocity": {}, "acceleration": {},
                "arrival": {:?}, "freeze": {:?}, "thrust_min": {:?}, "thrust_max": {:?} }}, bind: {{ "body": "node:lander" }}),
            "Engines": (model: "flight.vector_thrust", params: {{ "specific_impulse": {:?}, "lag": {:?}, "start": {} }}, bind: {{ "body": "node:lander" }}),
        }},
        wires: ["Tank.propellant -> Mass.u", "Mass.y -> Guidance.mass", "Guidance.force -> Engines.command"],
        connect: [("Engines.propellant", "Tank.outlet")],
        step: "50 ms", integrator: "dormand_prince_54", accuracy: (relative: 1e-12, absolute: 1e-10), until: "62 s")"#,
        vector("r0"),
        vector("v0"),
        vector("g"),
        num(&drag["rho0"]),
        num(&drag["H"]),
        num(&drag["CDS"]),
        1.0 / num(&input["period"]),
        vector("rT"),
        vector("vT"),
        vector("aT"),
        num(&input["tf"]),
        num(&input["freeze_tgo"]),
        num(&input["T_min"]),
        num(&input["T_max"]),
        num(&input["Isp"]),
        num(&input["lag"]),
        list(&flown[0][8..11]),
    );
    let mut sim = common::scene(&text, &[]).unwrap();
    let [mut r, mut v, mut m, mut f] = [Worst(0.0); 4];
    for want in flown {
        sim.run_until(seconds(want[0])).unwrap();
        r.take((get(&sim, "lander.position") - vec3(&want[1..])).norm());
        v.take((velocity(&sim, "lander") - vec3(&want[4..])).norm());
        m.take((dry + sim.get("Tank.propellant").unwrap() - want[7]).abs());
        f.take((sim.get("Engines.thrust").unwrap() - vec3(&want[8..]).norm()).abs());
    }
    // The reference requires 1e-4 m.
    r.below(1e-4, "guided descent, position, m");
    v.below(1e-4, "guided descent, velocity, m/s");
    m.below(1e-4, "guided descent, mass, kg");
    f.below(0.1, "guided descent, thrust, N");
}

/// `continuous`: without limits, drag and lag the guidance flies a polynomial, from which ln m = ln m₀ − ∫ |a − g| dt/(I_sp g₀).
#[test]
fn a_descent_guided_at_every_instant_is_the_polynomial() {
    let Some(all) = reference("powered_descent_quadratic.json") else { return };
    let (input, part) = (&all["inputs"], &all["continuous"]);
    let vector = |name: &str| vec3(&row(&input[name]));
    let (r0, v0, g, end) = (vector("r0"), vector("v0"), vector("g"), num(&input["tf"]));
    let target =
        Target { position: vector("rT"), velocity: vector("vT"), acceleration: vector("aT") };
    let c = quadratic_coefficients(&r0, &v0, &target, end);
    let [mut coefficients, mut r, mut v, mut m, mut again] = [Worst(0.0); 5];
    for (found, want) in c.iter().zip(rows(&part["c"])) {
        coefficients.take((found - vec3(&want)).norm());
    }
    let acceleration = |t: f64| c[0] + c[1] * t + c[2] * (t * t);
    let (mut t, mut spent) = (0.0, 0.0);
    let table = rows(&part["rows"]);
    assert_eq!(table.len(), 5);
    for want in &table {
        // The integral uses Simpson's rule.
        let h = (want[0] - t) / 2000.0;
        for _ in 0..2000 {
            let thrust = |t: f64| (acceleration(t) - g).norm();
            spent += h / 6.0 * (thrust(t) + 4.0 * thrust(t + 0.5 * h) + thrust(t + h));
            t += h;
        }
        t = want[0];
        let speed = v0 + c[0] * t + c[1] * (t * t / 2.0) + c[2] * (t.powi(3) / 3.0);
        let place = r0
            + v0 * t
            + c[0] * (t * t / 2.0)
            + c[1] * (t.powi(3) / 6.0)
            + c[2] * (t.powi(4) / 12.0);
        let mass = num(&input["mass0"]) * (-spent / (num(&input["Isp"]) * 9.80665)).exp();
        r.take((place - vec3(&want[1..])).norm());
        v.take((speed - vec3(&want[4..])).norm());
        m.take((mass - want[7]).abs());
        // Starting from the reference's row, the acceleration is the polynomial's.
        if end - t > 1.0 {
            let a = quadratic(&vec3(&want[1..]), &vec3(&want[4..]), &target, end - t);
            again.take((a - acceleration(t)).norm());
        }
    }
    coefficients.below(3e-14, "coefficients of the acceleration");
    r.below(1e-9, "guided at every instant, position, m");
    v.below(1e-11, "guided at every instant, velocity, m/s");
    m.below(1e-7, "guided at every instant, mass, kg");
    again.below(1e-11, "guided again from a row, acceleration, m/s²");
}
