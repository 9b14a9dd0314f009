//! What missions ask of the runtime: guards where nothing fires, moves between plans of the rover, loading of
//! many parts. One command for all benches: tests/benches/run.
#![allow(missing_docs, clippy::disallowed_methods, clippy::unwrap_used)]
#[path = "../common/mod.rs"]
mod common;

use linkwork_assembly::{Options, load_text};
use linkwork_runtime::prelude::*;
use linkwork_runtime::*;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

#[derive(State, Clone, Copy)]
pub struct X {
    /// Value.
    #[port("1")]
    pub x: f64,
}
#[derive(Ports, Clone, Copy)]
pub struct Y {
    /// Value.
    #[port("1")]
    pub y: f64,
}
#[derive(Params)]
pub struct K {
    /// Rate.
    #[param(default = 0.01)]
    pub k: f64,
}
#[derive(Ports, Clone, Copy)]
pub struct Far {
    /// Never zero.
    #[port("1", falling)]
    pub far: f64,
}
pub struct Plain {
    p: K,
}
/// ẋ = k.
#[model("bench.plain")]
impl Model for Plain {
    type Params = K;
    type Outputs = Y;
    type State = X;
    fn outputs(&self, x: &X) -> Y {
        Y { y: x.x }
    }
    fn derivatives(&self) -> X {
        X { x: self.p.k }
    }
}
pub struct Watched {
    p: K,
}
/// ẋ = k, watched.
#[model("bench.watched")]
impl Model for Watched {
    type Params = K;
    type Outputs = Y;
    type State = X;
    type Guards = Far;
    fn outputs(&self, x: &X) -> Y {
        Y { y: x.x }
    }
    fn derivatives(&self) -> X {
        X { x: self.p.k }
    }
    fn guards(&self, x: &X) -> Far {
        Far { far: 1e6 - x.x }
    }
    fn handle_event(&self, x: &X) -> (X, ()) {
        (*x, ())
    }
}

/// Median of seven.
fn median(mut run: impl FnMut() -> f64) -> f64 {
    let mut all: Vec<f64> = (0..7).map(|_| run()).collect();
    all.sort_by(f64::total_cmp);
    all[3]
}

fn steps(model: &str, n: usize) -> Simulation {
    let parts = (0..n).map(|k| PartSpec::new(format!("p{k:04}"), model, Value::Map(Vec::new())));
    let spec = Spec { parts: parts.collect(), ..Spec::default() };
    let catalogue = Catalogue::new([vec![Entry::model::<Plain>(), Entry::model::<Watched>()]]);
    Simulation::new(Arc::new(compile(&spec, &catalogue, &Files::default()).unwrap()))
}

fn guards() {
    const N: usize = 100;
    const STEPS: usize = 5000;
    let time = |model: &str| {
        let mut sim = steps(model, N);
        median(|| {
            let begin = Instant::now();
            (0..STEPS).for_each(|_| sim.step().unwrap());
            begin.elapsed().as_secs_f64()
        })
    };
    let (plain, watched) = (time("bench.plain"), time("bench.watched"));
    let each = 1e9 / (N * STEPS) as f64;
    println!(
        "guards: a part and RK4 step {:.1} ns, with a guard that does not fire {:.1} ns: {:.1} ns a guard (target 20)",
        plain * each,
        watched * each,
        (watched - plain) * each
    );
}

/// The rover of sims/rover_traverse in ten phases, each like the file.
fn moves() {
    let file = linkwork_tests::root().join("sims/rover_traverse/sim.ron");
    let text = std::fs::read_to_string(file).unwrap();
    let end = text.rfind(')').unwrap();
    let phase = |k: usize| match k {
        9 => "\"p9\": (),".to_string(),
        _ => format!("\"p{k}\": (to: {{ \"p{}\": \"time > 0.{}05 s\" }}),", k + 1, k),
    };
    let phases: String = (0..10).map(phase).collect();
    let text = format!("{} start: \"p0\", phases: {{ {phases} }},\n)", &text[..end]);
    let mut sim = common::scene(&text, &["Rover.Environment.spacing=0.5"]).unwrap();
    let mut times = Vec::new();
    while sim.before(Seconds { num: 1, den: 1 }) {
        let (phase, begin) = (sim.phase().to_string(), Instant::now());
        sim.step_event().unwrap();
        if sim.phase() != phase {
            times.push(begin.elapsed().as_secs_f64());
        }
    }
    // The step to the instant of the transition lies in it: two evaluations of RK4 and the search.
    times.sort_by(f64::total_cmp);
    println!(
        "moves: {} transitions of the rover, with the step to them: median {:.0} µs, most {:.0} µs (target 100)",
        times.len(),
        times[times.len() / 2] * 1e6,
        times[times.len() - 1] * 1e6
    );
}

fn loading() {
    let catalogue = common::catalogue();
    for (n, target) in [(1000, "50 ms"), (20_000, "1 s")] {
        let mut text = String::from("Simulation(until: \"1 s\", parts: {\n");
        for k in 0..n {
            text += &format!("\"G{k}\": (model: \"basics.gain\", params: {{ \"k\": 0.5 }}),\n");
        }
        text += "\"S\": (model: \"basics.constant\", params: { \"value\": 1 }),\n}, wires: [\"S.y -> G0.u\",\n";
        for k in 1..n {
            text += &format!("\"G{}.y -> G{k}.u\",\n", k - 1);
        }
        text += "])";
        let mut parts = [0.0; 2];
        let total = median(|| {
            let begin = Instant::now();
            let loaded = load_text("sim.ron", &text, &Options::new(&catalogue));
            let loaded = loaded.unwrap_or_else(|f| panic!("{}", f.render(false)));
            let read = begin.elapsed().as_secs_f64();
            let program = loaded.compile(&catalogue, &Files::default()).unwrap();
            black_box(Simulation::of(Arc::new(program)));
            let all = begin.elapsed().as_secs_f64();
            parts = [read, all - read];
            all
        });
        println!(
            "loading: {n} parts {:.1} ms (text {:.1}, compile {:.1}; target {target})",
            total * 1e3,
            parts[0] * 1e3,
            parts[1] * 1e3
        );
    }
}

/// An arm of twelve joints with a motor each: a step of the stiff method, and how many evaluations it is worth.
fn stiff() {
    const JOINTS: usize = 12;
    let (mut bodies, mut parts) = (String::new(), String::new());
    let (mut wires, mut connect) = (String::new(), String::new());
    for k in 0..JOINTS {
        let parent = if k == 0 { "world".to_string() } else { format!("l{}", k - 1) };
        let axis = if k % 2 == 0 { "[0, 1, 0]" } else { "[1, 0, 0]" };
        bodies += &format!(
            "\"l{k}\": (parent: \"{parent}\", at: (position: [0, 0, 0.2]), hinge: Pin({axis}), mass: 1, com: [0, 0, 0.1], \
             inertia: [0.01, 0.01, 0.005], damping: 0.1, initial: (rate: 0.3)),\n"
        );
        parts += &format!(
            "\"M{k}\": (model: \"actuators.dc_motor\", params: {{ \"resistance\": 0.6, \"inductance\": \"0.1 mH\", \
             \"torque_constant\": 0.05, \"gear\": 50, \"coulomb\": 0.1 }}, bind: {{ \"shaft\": \"hinge:l{k}\" }}),\n"
        );
        wires += &format!("\"V.y -> M{k}.volts\", ");
        connect += &format!("(\"M{k}.supply\", \"Supply.terminal\"), ");
    }
    let text = |method: &str, step: &str| {
        format!(
            "Simulation(bodies: {{ {bodies} }}, parts: {{ {parts} \"Supply\": (model: \"power.ideal_supply\", params: {{ \"voltage\": 24 }}), \"V\": (model: \"basics.constant\", params: {{ \"value\": 1 }}), \
             \"G\": (model: \"environment.uniform_gravity\", params: {{ \"acceleration\": [0, 0, -9.81] }}) }}, wires: [{wires}], connect: [{connect}], \
             integrator: \"{method}\", accuracy: \"fixed\", step: \"{step}\", until: \"100 s\")"
        )
    };
    let time = |method: &str, step: &str| {
        let mut sim = common::scene(&text(method, step), &[]).unwrap_or_else(|e| panic!("{e}"));
        let n = sim.state().x.len();
        let each = median(|| {
            let begin = Instant::now();
            (0..200).for_each(|_| sim.step().unwrap());
            begin.elapsed().as_secs_f64() / 200.0
        });
        (each, n)
    };
    let ((stiff, n), (four, _)) = (time("rodas4p", "1 ms"), time("rk4", "10 us"));
    println!(
        "stiff: {JOINTS} joints with motors, {n} states: a step of rodas4p {:.1} µs, worth {:.1} evaluations \
         ({} when its Jacobian is made of differences of the whole)",
        stiff * 1e6,
        4.0 * stiff / four,
        6 + n
    );
}

/// All, or those that are named: `cargo bench --bench missions -- stiff`.
fn main() {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let all: [(&str, fn()); 4] =
        [("guards", guards), ("stiff", stiff), ("moves", moves), ("loading", loading)];
    for (name, bench) in all {
        if asked.is_empty() || asked.iter().any(|a| a == name) {
            bench();
        }
    }
}
