//! A touch and go at an asteroid compared with a trajectory from an independent program (DOP853).
use linkwork_spatial::{Quat, Vec3};
use linkwork_surroundings::prelude::*;
use linkwork_world::gravity::polyhedron::Polyhedron;

use crate::common;
use common::{Worst, get, list, num, reference, row, rows, seconds, vec3, velocity};

/// The sprung foot and the engine of the touch and go, as in the reference.
#[derive(Params, Clone, Debug)]
struct TouchParams {
    /// A point of the surface facet, asteroid's axes.
    centroid: Vec3,
    /// Its normal, unit, asteroid's axes.
    normal: Vec3,
    /// Rate of the asteroid about z.
    #[param(unit = "rad/s")]
    rate: f64,
    /// Stiffness, N/m, and damping, N s/m.
    spring: [f64; 2],
    /// Thrust, N; delay after the first contact, s; duration, s.
    engine: [f64; 3],
}
/// Inputs of the foot and engine.
#[derive(Ports, Clone, Copy, Debug)]
struct TouchIn {
    /// State of the spacecraft's centre.
    #[port(bind = "craft")]
    craft: NodeState,
}
/// Outputs of the foot and engine.
#[derive(Ports, Clone, Copy, Debug)]
struct TouchOut {
    /// Load on the spacecraft.
    #[port(bind = "craft")]
    load: Wrench,
}
/// State of the sequence.
#[derive(State, Clone, Copy, Debug)]
struct Touched {
    /// Time of the first contact; negative before.
    #[port("s")]
    contact: f64,
    /// Time of the release.
    #[port("s")]
    release: f64,
    /// Whether the foot is in the ground.
    #[port]
    presses: bool,
    /// Whether the engine burns.
    #[port]
    burns: bool,
}
/// Guards that end one part of the sequence and start the next.
#[derive(Ports, Clone, Copy, Debug)]
struct TouchGuards {
    /// Height over the surface facet.
    #[port("m", falling)]
    height: f64,
    /// Force of the foot in contact.
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
    /// Returns the normal in W, height over the facet (m) and speed away from it (m/s) at time t.
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
/// A sprung foot against a rotating plane, and an engine that lifts off after the first contact.
#[model("test.touch_and_go")]
impl Model for Touch {
    type Params = TouchParams;
    type FeedthroughInputs = TouchIn;
    type FeedthroughOutputs = TouchOut;
    type DiscreteState = Touched;
    type Guards = TouchGuards;
    fn init_d(&self) -> Touched {
        Touched { contact: -1.0, release: -1.0, presses: false, burns: false }
    }
    fn feedthrough(&self, clock: &Clock, d: &Touched, u: &TouchIn) -> TouchOut {
        let (n, height, speed) = self.face(clock.t, &u.craft);
        let foot = if d.presses { self.force(height, speed) } else { 0.0 };
        let engine = if d.burns { self.p.engine[0] } else { 0.0 };
        TouchOut { load: Wrench { moment: Vec3::zeros(), force: n * (foot + engine) } }
    }
    fn guards(&self, clock: &Clock, d: &Touched, u: &TouchIn) -> TouchGuards {
        let (_, height, speed) = self.face(clock.t, &u.craft);
        let force = if d.presses { self.force(height, speed) } else { 1.0 };
        let [_, delay, burn] = self.p.engine;
        let since = if d.contact < 0.0 { -1.0 } else { clock.t - d.contact - delay };
        TouchGuards { height, force, ignition: since, end: since - burn }
    }
    fn handle_event(&self, clock: &Clock, fired: Fired<'_>, d: &Touched) -> ((), Touched) {
        let next = match () {
            () if fired.fell(0) && d.contact < 0.0 => {
                Touched { contact: clock.t, presses: true, ..*d }
            }
            () if fired.fell(1) => Touched { release: clock.t, presses: false, ..*d },
            () if fired.rose(2) => Touched { burns: true, ..*d },
            () if fired.rose(3) => Touched { burns: false, ..*d },
            () => *d,
        };
        ((), next)
    }
}

/// The reference's axes rotate with the asteroid; here the asteroid rotates in W.
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
        world: (body: "other", radius: 1, rate: {rate:?}),
        parts: {{
            "Gravity": (model: "environment.polyhedral_gravity", params: {{ "file": {:?}, "density": {:?} }}),
            "Touch": (model: "test.touch_and_go", bind: {{ "craft": "node:craft" }}, params: {{
                "centroid": {}, "normal": {}, "rate": {rate:?}, "spring": {}, "engine": {} }}),
        }},
        gravity: "Gravity", step: "100 ms", integrator: "dormand_prince_54",
        accuracy: (relative: 1e-12, absolute: 1e-12), until: "{:?} s")"#,
        num(&craft["mass"]),
        list(r0.as_slice()),
        list(v0.as_slice()),
        file.display().to_string(),
        num(&body["density"]),
        list(&row(&contact["centroid"])),
        list(&row(&contact["normal"])),
        list(&[num(&craft["k"]), num(&craft["c"])]),
        list(&[num(&craft["thrust_N"]), num(&craft["delay"]), num(&craft["burn"])]),
        num(&craft["t_end"]),
    );
    let touch = vec![Entry::model::<Touch>()];
    let mut sim = common::scene_with(touch, &text).unwrap();
    let [mut r, mut v, mut height, mut potential] = [Worst(0.0); 4];
    let (centroid, normal) = (vec3(&row(&contact["centroid"])), vec3(&row(&contact["normal"])));
    // The reference has its own value of G; the polyhedron is from the simulation.
    let shape = Polyhedron::new(
        rows(&body["vertices_m"]).iter().map(|v| vec3(v)).collect(),
        &faces.iter().map(|f| [0, 1, 2].map(|k| f[k] as u32)).collect::<Vec<_>>(),
        num(&body["G"]) * num(&body["density"]),
    )
    .unwrap();
    for want in &wanted {
        sim.run_until(seconds(want[0])).unwrap();
        let back = turn(want[0]).inverse();
        let position = get(&sim, "craft.position");
        height.take((normal.dot(&(back * position - centroid)) - want[7]).abs());
        potential.take((shape.gravity(&(back * position)).potential / want[8] - 1.0).abs());
        r.take((back * position - vec3(&want[1..])).norm());
        let relative = velocity(&sim, "craft") - Vec3::z().cross(&position) * rate;
        v.take((back * relative - vec3(&want[4..])).norm());
    }
    // The reference is accurate to 6e-10 m.
    r.below(1e-7, "touch and go, position, m");
    v.below(1e-9, "touch and go, velocity, m/s");
    height.below(1e-7, "touch and go, height over the face, m");
    potential.below(1e-9, "touch and go, potential, relative");
    // The state is the speed away from the facet, which is zero at both events; the run stops
    // there.
    let touch = vec![Entry::model::<Touch>()];
    let mut sim = common::scene_with(touch, &text).unwrap();
    for (event, name) in all["events"].as_array().unwrap().iter().zip(["contact", "release"]) {
        while sim.get(&format!("Touch.state.{name}")).unwrap() < 0.0 {
            sim.step_event().unwrap();
        }
        let (at, position) = (sim.time(), get(&sim, "craft.position"));
        assert!((at - num(&event[0])).abs() < 1e-7, "{name}: {at} {event}");
        let relative = velocity(&sim, "craft") - Vec3::z().cross(&position) * rate;
        let speed = normal.dot(&(turn(at).inverse() * relative));
        println!("{name}: {speed} m/s");
        assert!((speed - num(&event[2])).abs() < 1e-8, "{name}: {speed} {event}");
    }
}
