//! Wiring overhead: chains of gain, integrator and hold; compile time; checkpoint in memory.
#![allow(missing_docs, clippy::disallowed_methods, clippy::unwrap_used)]
use linkwork_runtime::prelude::*;
use linkwork_runtime::*;
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
    type Ud = U;
    type Yd = Y;
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &U) -> Y {
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
    type U = U;
    type Ym = Y;
    type X = X;
    fn moore(&self, _: &Clock, x: &X, _: &()) -> Y {
        Y { y: x.x }
    }
    fn deriv(&self, _: &Clock, _: &X, _: &(), u: &U) -> X {
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
    type U = U;
    type Ym = Y;
    type D = X;
    fn moore(&self, _: &Clock, _: &(), d: &X) -> Y {
        Y { y: d.x }
    }
    fn update(&self, _: &Clock, _: &(), _: &X, u: &U) -> X {
        X { x: self.p.k * u.u }
    }
}

fn chain(n: usize, integrator: linkwork_runtime::Integrator) -> Spec {
    let kinds = ["bench.gain", "bench.integrator", "bench.hold"];
    let mut spec = Spec { integrator, ..Spec::default() };
    for k in 0..n {
        let model = kinds[k % 3];
        spec.parts.push(PartSpec {
            path: format!("p{k:04}"),
            model: model.into(),
            model_origin: Origin::NONE,
            params: Value::Map(vec![]).into(),
            rate: (model == "bench.hold").then_some(Seconds { num: 1, den: 1000 }),
            rate_origin: Origin::NONE,
            offset: Seconds::ZERO,
            origin: Origin::NONE,
            folder: None,
        });
        if k > 0 {
            let end = |part: String, port: &str| PortRef { part, port: port.into(), index: None };
            spec.wires.push(WireSpec {
                from: end(format!("p{:04}", k - 1), "y"),
                to: end(format!("p{k:04}"), "u"),
                text: String::new(),
                origin: Origin::NONE,
            });
        }
    }
    spec
}

/// The least of several repeats, in ns per call.
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

fn main() {
    let catalogue = Catalogue::new([vec![
        Entry::model::<Gain>(),
        Entry::model::<Integrator>(),
        Entry::model::<Hold>(),
    ]]);
    let files = Files::default();
    for (name, integrator) in [
        ("semi-implicit Euler", linkwork_runtime::Integrator::SemiImplicitEuler),
        ("RK4", linkwork_runtime::Integrator::Rk4),
    ] {
        for n in [100, 1000] {
            let plan = Arc::new(compile(&chain(n, integrator), &catalogue, &files).unwrap());
            // Operations evaluated per step: outputs, derivatives, updates, stages counted each.
            let stages = if integrator == linkwork_runtime::Integrator::Rk4 { 3 } else { 0 };
            let ops = plan.ops.len() + n / 3 + n / 3 + stages * (plan.stage_ops.len() + n / 3);
            let mut sim = Simulation::new(plan);
            let ns = best(20, 20_000 / (n / 100), || sim.step().unwrap());
            println!(
                "chain N = {n:4}, {name:20}: {:6.2} ns per block and step, {:5.2} ns per operation",
                ns / n as f64,
                ns / ops as f64
            );
        }
    }
    let spec = chain(100, linkwork_runtime::Integrator::Rk4);
    let us = best(20, 20, || drop(compile(&spec, &catalogue, &files).unwrap())) / 1e3;
    println!("compile 100 models: {us:.0} µs");
    let plan = Arc::new(compile(&chain(760, linkwork_runtime::Integrator::Rk4), &catalogue, &files).unwrap());
    let lanes = plan.sizes.x + plan.sizes.d + plan.sizes.sig;
    let sim = Simulation::new(plan);
    let mut snapshot = Snapshot::default();
    let ns = best(20, 10_000, || sim.save_into(&mut snapshot).unwrap());
    println!("checkpoint of {lanes} lanes in memory: {ns:.0} ns");
}
