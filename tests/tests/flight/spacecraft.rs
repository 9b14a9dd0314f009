//! Spacecraft beside trajectories that an independent program computed (DOP853): wheels and slosh, a stack that
//! separates twice, a guided descent, a touch and go at an asteroid.
use linkwork_runtime::prelude::*;
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

fn matrix(v: &Value) -> Mat3 {
    let i = rows(v);
    Mat3::from_fn(|a, b| i[a][b])
}

#[test]
fn wheels_and_slosh_under_thrust() {
    let Some(all) = reference("slosh_wheels.json") else { return };
    let input = &all["inputs"];
    let w0 = vec3(&row(&input["w0"]));
    let mut body_inertia = matrix(&input["hub"]["I"]);
    let (mut bodies, mut parts, mut wires) = (String::new(), String::new(), Vec::new());
    let mut nodes = format!("\"thrust\": (position: {}), ", list(&row(&input["thrust"]["point"])));
    for (k, wheel) in input["wheels"].as_array().unwrap().iter().enumerate() {
        let (g, inertia) = (vec3(&row(&wheel["g"])), num(&wheel["Js"]));
        // The file's hub has the wheels locked; here each is a state of its own.
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
    let text = format!(
        r#"Simulation(
        bodies: {{
            "hub": (parent: "world", hinge: Free, mass: {:?}, inertia: {}, initial: (angular: {}), nodes: {{ {nodes} }}),
            {bodies}
        }},
        parts: {{ {parts}
            "Thrust": (model: "flight.body_load", params: {{ "rows": [{}] }}, bind: {{ "body": "node:hub/thrust" }}),
        }},
        wires: [{}], {})"#,
        num(&input["hub"]["mass"]),
        inertia(&body_inertia),
        triple(&w0),
        program.join(", "),
        wires.join(", "),
        tight(num(&input["t_end"])),
    );
    let mut sim = common::scene(&text, &[]).unwrap();
    let [mut r, mut q, mut v, mut w, mut th, mut speeds] = [Worst(0.0); 6];
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
    }
    // The file asks for 1e-6 and is itself right to 2e-10.
    r.below(1e-6, "slosh and wheels, position, m");
    q.below(1e-7, "slosh and wheels, attitude, rad");
    v.below(1e-7, "slosh and wheels, velocity, m/s");
    w.below(1e-7, "slosh and wheels, rates, rad/s");
    th.below(1e-6, "slosh and wheels, pendulums, rad and rad/s");
    speeds.below(1e-6, "slosh and wheels, wheels, rad/s");
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
    text += &format!(
        r#"}}, start: "whole", phases: {{
            "whole": (to: {{ "first": "time > {:?} s" }}),
            "first": (bodies: {{ "B": ({free}) }}, parts: {{ {} }}, to: {{ "second": "time > {:?} s" }}),
            "second": (like: "first", bodies: {{ "C": ({free}) }}, parts: {{ {} }}),
        }}, {})"#,
        num(&sequence["t1_A_released"]),
        parts[0],
        num(&sequence["t2_B_and_C_part"]),
        parts[1],
        tight(num(&sequence["t_end"]))
    );
    let mut sim = common::scene(&text, &[]).unwrap();
    let [mut r, mut v, mut q, mut w] = [Worst(0.0); 4];
    // Of a body that hangs on another only the pose as a node is told: free ones are compared.
    let t = [0.0, num(&sequence["t1_A_released"]), num(&sequence["t2_B_and_C_part"])];
    let mut compared = 0;
    for want in rows(&all["rows"]) {
        sim.run_until(seconds(want[0])).unwrap();
        for (k, name) in ["A", "B", "C"].iter().enumerate() {
            if k > 0 && want[0] <= t[k] {
                continue;
            }
            let at = 1 + 13 * k;
            r.take((get(&sim, &format!("{name}.position")) - vec3(&want[at..])).norm());
            let turned = rotation(&sim, name);
            let velocity = turned * get(&sim, &format!("{name}.velocity"));
            v.take((velocity - vec3(&want[at + 3..])).norm());
            q.take(turned.angle_to(&quat(&want[at + 6..])));
            w.take((get(&sim, &format!("{name}.angular")) - vec3(&want[at + 10..])).norm());
            compared += 1;
        }
    }
    assert!(compared > 20, "{compared}");
    // The file asks for 1e-6.
    r.below(1e-8, "three bodies, positions, m");
    v.below(1e-8, "three bodies, velocities, m/s");
    q.below(1e-8, "three bodies, attitudes, rad");
    w.below(1e-8, "three bodies, rates, rad/s");
    for (name, count) in [("A_to_B", 4), ("B_to_C", 3)] {
        for k in 0..count {
            assert_eq!(sim.get(&format!("{name}{k}.over")).unwrap(), 1.0, "{name}{k}");
        }
    }
}

/// EDL.md h: four springs of 1800 N/m, 0.15 m, between 1200 and 385 kg.
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
    // Half of it is propellant in a tank without size.
    let (dry, drag) = (0.5 * mass, &input["drag"]);
    let text = format!(
        r#"Simulation(
        bodies: {{ "lander": (parent: "world", hinge: Free, mass: {dry:?}, inertia: [500, 500, 500],
            initial: (position: {}, velocity: {})) }},
        parts: {{
            "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": {} }}),
            "Air": (model: "environment.exponential_atmosphere", params: {{ "planet_radius": 0, "density": {:?}, "scale_height": {:?} }}),
            "Drag": (model: "flight.drag", params: {{ "coefficient": {:?}, "area": 1, "heating_constant": 0 }}, bind: {{ "body": "node:lander" }}),
            "Tank": (model: "flight.propellant_tank", params: {{ "propellant": {dry:?}, "radius": "10 um", "density": 1e20 }}, bind: {{ "bottom": "node:lander" }}),
            "Mass": (model: "basics.gain", params: {{ "k": 1, "offset": {dry:?} }}),
            "Guidance": (model: "flight.powered_descent", rate: "{:?} Hz", params: {{ "position": {}, "velocity": {}, "acceleration": {},
                "arrival": {:?}, "freeze": {:?}, "thrust_min": {:?}, "thrust_max": {:?} }}, bind: {{ "body": "node:lander" }}),
            "Engines": (model: "flight.vector_thrust", params: {{ "specific_impulse": {:?}, "lag": {:?}, "start": {} }}, bind: {{ "body": "node:lander" }}),
        }},
        wires: ["Tank.propellant -> Mass.u", "Mass.y -> Guidance.mass", "Guidance.force -> Engines.command",
            "Engines.flow -> Tank.flow", "Tank.supplies -> Engines.supply"],
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
    // The file asks for 1e-4 m.
    r.below(1e-4, "guided descent, position, m");
    v.below(1e-4, "guided descent, velocity, m/s");
    m.below(1e-4, "guided descent, mass, kg");
    f.below(0.1, "guided descent, thrust, N");
}

/// The springy foot and the engine of the touch and go, as its file gives them.
#[derive(Params, Clone, Debug)]
struct TouchParams {
    /// A point of the face, asteroid's axes.
    centroid: Vec3,
    /// Its normal, unit, asteroid's axes.
    normal: Vec3,
    /// Rate of the asteroid about z.
    #[param(unit = "rad/s")]
    rate: f64,
    /// Stiffness, N/m, and damping, N s/m.
    spring: [f64; 2],
    /// Thrust, N; delay after the first contact, s; how long, s.
    engine: [f64; 3],
}
/// The craft.
#[derive(Ports, Clone, Copy, Debug)]
struct TouchIn {
    /// Its centre.
    #[port(bind = "craft")]
    craft: NodeState,
}
/// What acts on it.
#[derive(Ports, Clone, Copy, Debug)]
struct TouchOut {
    /// On the craft.
    #[port(bind = "craft")]
    load: Wrench,
}
/// Where it is in its sequence.
#[derive(State, Clone, Copy, Debug)]
struct Touched {
    /// Time of the first contact; none yet: below 0.
    #[port("s")]
    contact: f64,
    /// Time of the release.
    #[port("s")]
    release: f64,
    /// The foot is in the ground.
    #[port]
    presses: bool,
    /// The engine burns.
    #[port]
    burns: bool,
}
/// What ends one part of the sequence and begins the next.
#[derive(Ports, Clone, Copy, Debug)]
struct TouchGuards {
    /// Height over the face.
    #[port("m", falling)]
    height: f64,
    /// Force of the foot while it presses.
    #[port("N", falling)]
    force: f64,
    /// Time to ignition.
    #[port("s", rising)]
    ignition: f64,
    /// Time to the end of the burn.
    #[port("s", rising)]
    end: f64,
}
struct Touch {
    p: TouchParams,
}
impl Touch {
    /// Normal in W, height over the face (m), speed away from it (m/s), at time t.
    fn face(&self, t: f64, craft: &NodeState) -> (Vec3, f64, f64) {
        let p = &self.p;
        let R = Quat::from_axis_angle(&Vec3::z_axis(), p.rate * t);
        let n = R * p.normal;
        let relative = craft.velocity - Vec3::z().cross(&craft.position) * p.rate;
        (n, n.dot(&(craft.position - R * p.centroid)), n.dot(&relative))
    }
    fn force(&self, height: f64, speed: f64) -> f64 {
        -self.p.spring[0] * height - self.p.spring[1] * speed
    }
}
/// A springy foot against a plane that turns, and an engine that lifts off after the first contact.
#[model("test.touch_and_go")]
impl Model for Touch {
    type Params = TouchParams;
    type Ud = TouchIn;
    type Yd = TouchOut;
    type D = Touched;
    type G = TouchGuards;
    fn init_d(&self) -> Touched {
        Touched { contact: -1.0, release: -1.0, presses: false, burns: false }
    }
    fn direct(&self, c: &Clock, _: &(), d: &Touched, u: &TouchIn) -> TouchOut {
        let (n, height, speed) = self.face(c.t, &u.craft);
        let foot = if d.presses { self.force(height, speed) } else { 0.0 };
        let engine = if d.burns { self.p.engine[0] } else { 0.0 };
        TouchOut { load: Wrench { moment: Vec3::zeros(), force: n * (foot + engine) } }
    }
    fn guards(&self, c: &Clock, _: &(), d: &Touched, _: &(), u: &TouchIn) -> TouchGuards {
        let (_, height, speed) = self.face(c.t, &u.craft);
        let force = if d.presses { self.force(height, speed) } else { 1.0 };
        let [_, delay, burn] = self.p.engine;
        let since = if d.contact < 0.0 { -1.0 } else { c.t - d.contact - delay };
        TouchGuards { height, force, ignition: since, end: since - burn }
    }
    fn fired(&self, c: &Clock, which: usize, _: &(), d: &Touched) -> ((), Touched) {
        let next = match which {
            0 if d.contact < 0.0 => Touched { contact: c.t, presses: true, ..*d },
            1 => Touched { release: c.t, presses: false, ..*d },
            2 => Touched { burns: true, ..*d },
            3 => Touched { burns: false, ..*d },
            _ => *d,
        };
        ((), next)
    }
}

/// The file's axes turn with the asteroid; here the asteroid turns in W.
#[test]
fn a_touch_and_go_at_an_asteroid_that_turns() {
    let Some(all) = reference("asteroid_touch_and_go.json") else { return };
    let (body, craft, contact) = (&all["asteroid"], &all["spacecraft"], &all["contact"]);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("asteroid.obj");
    let mut mesh = String::new();
    rows(&body["vertices_m"])
        .iter()
        .for_each(|v| mesh += &format!("v {:?} {:?} {:?}\n", v[0], v[1], v[2]));
    let faces = rows(&body["faces_outward_0based"]);
    faces.iter().for_each(|f| mesh += &format!("f {} {} {}\n", f[0] + 1.0, f[1] + 1.0, f[2] + 1.0));
    std::fs::write(&file, mesh).unwrap();

    let rate = std::f64::consts::TAU / num(&body["period_s"]);
    let turn = |t: f64| Quat::from_axis_angle(&Vec3::z_axis(), rate * t);
    let wanted = rows(&all["rows"]);
    let (r0, v0) = (vec3(&wanted[0][1..]), vec3(&wanted[0][4..]));
    let v0 = v0 + Vec3::z().cross(&r0) * rate;
    let text = format!(
        r#"Simulation(
        bodies: {{ "craft": (parent: "world", hinge: Free, mass: {:?}, inertia: [300, 300, 300],
            initial: (position: {}, velocity: {})) }},
        parts: {{
            "Gravity": (model: "environment.polyhedral_gravity",
                params: {{ "file": {:?}, "density": {:?}, "rate": {rate:?} }}),
            "Touch": (model: "test.touch_and_go", bind: {{ "craft": "node:craft" }}, params: {{
                "centroid": {}, "normal": {}, "rate": {rate:?}, "spring": {}, "engine": {} }}),
        }},
        gravity: "Gravity", {})"#,
        num(&craft["mass"]),
        triple(&r0),
        triple(&v0),
        file.display().to_string(),
        num(&body["density"]),
        list(&row(&contact["centroid"])),
        list(&row(&contact["normal"])),
        list(&[num(&craft["k"]), num(&craft["c"])]),
        list(&[num(&craft["thrust_N"]), num(&craft["delay"]), num(&craft["burn"])]),
        tight(num(&craft["t_end"])).replace("gravity: \"none\", ", ""),
    );
    let touch = vec![Entry::model::<Touch>()];
    let mut sim = common::scene_with(touch, &text).unwrap();
    let [mut r, mut v] = [Worst(0.0); 2];
    for want in &wanted {
        sim.run_until(seconds(want[0])).unwrap();
        let back = turn(want[0]).inverse();
        let position = get(&sim, "craft.position");
        r.take((back * position - vec3(&want[1..])).norm());
        let relative = velocity(&sim, "craft") - Vec3::z().cross(&position) * rate;
        v.take((back * relative - vec3(&want[4..])).norm());
    }
    // The file is good to 6e-10 m.
    r.below(1e-7, "touch and go, position, m");
    v.below(1e-9, "touch and go, velocity, m/s");
    for (event, name) in all["events"].as_array().unwrap().iter().zip(["contact", "release"]) {
        let at = sim.get(&format!("Touch.state.{name}")).unwrap();
        assert!((at - num(&event[0])).abs() < 1e-7, "{name}: {at} {event}");
    }
}
