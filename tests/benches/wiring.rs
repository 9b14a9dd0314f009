//! Overhead of connections: chains of gain, integrator and hold; a six-wheel drive; compile time; checkpoint.
//!
//! If `LINKWORK_PEERS` is the folder of `tests/benches/peers/install.sh --drake`, the same systems run in Drake and the table has the ratio. One
//! command runs all benches: tests/benches/run.
#![allow(missing_docs, clippy::disallowed_methods, clippy::unwrap_used)]
#[path = "wiring/drive.rs"]
mod drive;

use linkwork_runtime::prelude::*;
use linkwork_runtime::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

#[derive(Ports, Clone, Copy)]
pub struct Y {
    /// Value.
    #[port("1")]
    pub y: f64,
}
#[derive(Ports, Clone, Copy)]
pub struct U {
    /// Value.
    #[port("1", default = 1.0)]
    pub u: f64,
}
#[derive(State, Clone, Copy)]
pub struct X {
    /// Value.
    #[port("1")]
    pub x: f64,
}
#[derive(Params)]
pub struct K {
    /// Factor.
    #[param(default = 0.01)]
    pub k: f64,
}
pub struct Gain {
    p: K,
}
/// y = k u.
#[model("bench.gain")]
impl Model for Gain {
    type Params = K;
    type FeedthroughInputs = U;
    type FeedthroughOutputs = Y;
    fn feedthrough(&self, u: &U) -> Y {
        Y { y: self.p.k * u.u }
    }
}
pub struct Integrator {
    p: K,
}
/// ẋ = k u.
#[model("bench.integrator")]
impl Model for Integrator {
    type Params = K;
    type Inputs = U;
    type Outputs = Y;
    type State = X;
    fn outputs(&self, x: &X) -> Y {
        Y { y: x.x }
    }
    fn derivatives(&self, u: &U) -> X {
        X { x: self.p.k * u.u }
    }
}
pub struct Hold {
    p: K,
}
/// d₊ = k u.
#[model("bench.hold")]
impl Model for Hold {
    type Params = K;
    type Inputs = U;
    type Outputs = Y;
    type DiscreteState = X;
    fn outputs(&self, d: &X) -> Y {
        Y { y: d.x }
    }
    fn update(&self, u: &U) -> X {
        X { x: self.p.k * u.u }
    }
}

fn part(path: &str, model: &str, rate: Option<Seconds>) -> PartSpec {
    PartSpec {
        path: path.into(),
        model: model.into(),
        model_origin: Origin::NONE,
        params: Value::Map(vec![]).into(),
        rate,
        rate_origin: Origin::NONE,
        offset: Seconds::ZERO,
        origin: Origin::NONE,
        folder: None,
    }
}

fn end(part: String, port: &str) -> PortRef {
    PortRef { part, port: port.into(), index: None }
}

fn chain(n: usize, integrator: linkwork_runtime::Integrator) -> Spec {
    let kinds = ["bench.gain", "bench.integrator", "bench.hold"];
    let mut spec = Spec { integrator, ..Spec::default() };
    for k in 0..n {
        let model = kinds[k % 3];
        let rate = (model == "bench.hold").then_some(Seconds { num: 1, den: 1000 });
        spec.parts.push(part(&format!("p{k:04}"), model, rate));
        if k > 0 {
            spec.wires.push(WireSpec {
                timing: Default::default(),
                from: end(format!("p{:04}", k - 1), "y"),
                to: end(format!("p{k:04}"), "u"),
                text: String::new(),
                origin: Origin::NONE,
            });
        }
    }
    spec
}

/// Returns the shortest of several repeats, in ns per call.
fn best(repeats: usize, calls: usize, mut f: impl FnMut()) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..repeats {
        let start = Instant::now();
        for _ in 0..calls {
            f();
        }
        least = least.min(start.elapsed().as_nanos() as f64 / calls as f64);
    }
    least
}

/// The peers' lines `drake <row> <scheme> <ns>`, by row and scheme; empty without LINKWORK_PEERS.
fn peers() -> BTreeMap<(String, String), f64> {
    let Some(folder) = std::env::var_os("LINKWORK_PEERS") else { return BTreeMap::new() };
    let python = ["venv/bin/python", "bin/python"]
        .map(|p| std::path::Path::new(&folder).join(p))
        .into_iter()
        .find(|p| p.exists());
    let Some(python) = python else {
        eprintln!(
            "no Python environment in {folder:?}: run tests/benches/peers/install.sh --drake"
        );
        return BTreeMap::new();
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/drake_wiring.py");
    let output = std::process::Command::new(python).arg(script).output().unwrap();
    if !output.status.success() {
        eprintln!("{}", String::from_utf8_lossy(&output.stderr));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    let row = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [_, row, scheme, ns] = words[..] else { return None };
        Some(((row.to_string(), scheme.to_string()), ns.parse().ok()?))
    };
    text.lines().filter_map(row).collect()
}

fn print(what: &str, target: f64, ours: f64, theirs: Option<&f64>) {
    let peer =
        theirs.map_or("       –        –".into(), |p| format!("{p:8.0} {:7.0}×", p / ours));
    println!("{what:<52} {ours:8.2} {target:7.1} {peer}");
}

fn main() {
    let library =
        vec![Entry::model::<Gain>(), Entry::model::<Integrator>(), Entry::model::<Hold>()];
    let catalogue = Catalogue::new([library, drive::catalogue()]);
    let files = Files::default();
    let theirs = peers();
    let peer = |row: &str, scheme: &str| theirs.get(&(row.to_string(), scheme.to_string()));
    println!("{:<52} {:>8} {:>7} {:>8} {:>8}", "ns", "linkwork", "target", "Drake", "ratio");
    for (name, integrator, scheme) in [
        ("Euler", linkwork_runtime::Integrator::SemiImplicitEuler, "explicit_euler"),
        ("RK4 (Drake: RK3)", linkwork_runtime::Integrator::Rk4, "runge_kutta3"),
    ] {
        for (n, target) in [(100, 6.0), (1000, 8.0)] {
            let plan = Arc::new(compile(&chain(n, integrator), &catalogue, &files).unwrap());
            // The operations evaluated per step are outputs, derivatives and updates; stages count
            // separately.
            let stages = if integrator == linkwork_runtime::Integrator::Rk4 { 3 } else { 0 };
            let ops = plan.ops.len() + n / 3 + n / 3 + stages * (plan.stage_ops.len() + n / 3);
            let mut sim = Simulation::new(plan);
            let ns = best(20, 20_000 / (n / 100), || sim.step().unwrap());
            let what = format!("chain of {n}, {name}, per block and step");
            print(&what, target, ns / n as f64, peer(&format!("chain{n}"), scheme));
            println!("    {:.2} ns an operation", ns / ops as f64);
        }
    }
    let plan = Arc::new(compile(&drive::six_wheels(), &catalogue, &files).unwrap());
    assert_eq!(plan.parts.len(), 25);
    let mut sim = Simulation::new(plan);
    let ns = best(20, 20_000, || sim.step().unwrap());
    assert!((sim.get("w3.wheel.rate").unwrap() - 2.0).abs() < 1e-3, "the drive has settled");
    print("six-wheel drive, 25 models, RK4, a tick", 1500.0, ns, peer("drive", "runge_kutta3"));

    let spec = chain(100, linkwork_runtime::Integrator::Rk4);
    let ns = best(20, 20, || drop(compile(&spec, &catalogue, &files).unwrap()));
    print("compile 100 models", 1e6, ns, None);
    let spec = chain(760, linkwork_runtime::Integrator::Rk4);
    let plan = Arc::new(compile(&spec, &catalogue, &files).unwrap());
    let lanes = plan.sizes.x + plan.sizes.d + plan.sizes.sig;
    let sim = Simulation::new(plan);
    let mut snapshot = Snapshot::default();
    let ns = best(20, 10_000, || sim.save_into(&mut snapshot));
    print(&format!("checkpoint of {lanes} lanes in memory"), 300.0, ns, None);
}
