//! `derivatives` that reads the model's own feedthrough outputs: order of evaluation, order of the integrator, checkpoint.
use linkwork_runtime::prelude::*;
use linkwork_runtime::{
    Catalogue, Description, Entry, Integrator, Located, Origin, PartSpec, PortRef, Seconds,
    Simulation, Spec, Value, WireSpec, compile,
};
use std::sync::Arc;

#[derive(State, Clone, Copy, Debug)]
struct Angle {
    /// Value.
    #[port("1")]
    s: f64,
}
#[derive(Ports, Clone, Copy, Debug)]
struct Rate {
    /// Rate that is wanted.
    #[port("1", default = 0.0)]
    u: f64,
}
#[derive(Ports, Clone, Copy, Debug)]
struct Out {
    /// Square of the state plus the input; also the rate.
    #[port("1")]
    y: f64,
}

/// ṡ = −s² + u, the right side once, as an output.
struct Riccati {}
/// Riccati's equation, its right side as an output.
#[model("test.riccati")]
impl Model for Riccati {
    type FeedthroughInputs = Rate;
    type FeedthroughOutputs = Out;
    type State = Angle;
    fn init_x(&self) -> Angle {
        Angle { s: 1.0 }
    }
    fn feedthrough(&self, x: &Angle, u: &Rate) -> Out {
        Out { y: u.u - x.s * x.s }
    }
    fn derivatives(&self, y: &Out) -> Angle {
        Angle { s: y.y }
    }
}

/// The same, computed twice.
struct Twice {}
/// Riccati's equation without the short cut.
#[model("test.twice")]
impl Model for Twice {
    type FeedthroughInputs = Rate;
    type State = Angle;
    type Outputs = Out;
    fn init_x(&self) -> Angle {
        Angle { s: 1.0 }
    }
    fn outputs(&self, x: &Angle) -> Out {
        Out { y: x.s }
    }
    fn derivatives(&self, x: &Angle, u: &Rate) -> Angle {
        Angle { s: u.u - x.s * x.s }
    }
}

/// A wave above zero.
struct Wave {}
/// 1 + sin t.
#[model("test.wave")]
impl Model for Wave {
    type FeedthroughOutputs = Out;
    fn feedthrough(&self, clock: &Clock) -> Out {
        Out { y: 1.0 + clock.t.sin() }
    }
}

fn run(wired: bool, step: Seconds, integrator: Integrator) -> Simulation {
    let catalogue = Catalogue::new([vec![
        Entry::model::<Riccati>(),
        Entry::model::<Twice>(),
        Entry::model::<Wave>(),
    ]]);
    // The name of the wave is last in the alphabet, so only the wires determine that it is
    // evaluated first.
    let parts = [("A", "test.riccati"), ("B", "test.twice"), ("Z", "test.wave")];
    let mut spec = Spec { step, integrator, ..Spec::default() };
    for (path, model) in parts {
        spec.parts.push(PartSpec {
            path: path.into(),
            model: model.into(),
            model_origin: Origin::NONE,
            params: Located::from(Value::Map(vec![])),
            rate: None,
            rate_origin: Origin::NONE,
            offset: Seconds { num: 0, den: 1 },
            origin: Origin::NONE,
            folder: None,
        });
    }
    let end =
        |part: &str, port: &str| PortRef { part: part.into(), port: port.into(), index: None };
    for to in ["A", "B"].into_iter().filter(|_| wired) {
        spec.wires.push(WireSpec {
            timing: Default::default(),
            from: end("Z", "y"),
            to: end(to, "u"),
            text: format!("Z.y -> {to}.u"),
            origin: Origin::NONE,
        });
    }
    let plan = compile(&spec, &catalogue, &Default::default()).unwrap();
    Simulation::new(Arc::new(plan))
}

#[test]
fn the_macro_tells_that_outputs_are_read() {
    assert!(Description::of::<Riccati>().functions.derivatives_read_outputs);
    assert!(!Description::of::<Twice>().functions.derivatives_read_outputs);
}

#[test]
fn outputs_are_those_of_the_same_evaluation() {
    // For both integrators, the run is bit-identical to the run of the model that computes its right side
    // in `derivatives`.
    for integrator in [Integrator::Rk4, Integrator::SemiImplicitEuler] {
        let mut sim = run(true, Seconds { num: 1, den: 50 }, integrator);
        for k in 1..=100 {
            sim.run_until(Seconds { num: k, den: 10 }).unwrap();
            assert_eq!(
                sim.get("A.state.s").unwrap().to_bits(),
                sim.get("B.state.s").unwrap().to_bits(),
                "{k}"
            );
        }
        // The next step uses a state that was edited.
        sim.set("A.state.s", 0.5).unwrap();
        sim.set("B.state.s", 0.5).unwrap();
        sim.run_until(Seconds { num: 11, den: 1 }).unwrap();
        assert_eq!(
            sim.get("A.state.s").unwrap().to_bits(),
            sim.get("B.state.s").unwrap().to_bits()
        );
    }
}

#[test]
fn rk4_keeps_its_order() {
    // Without an input the solution is s = 1/(1 + t).
    let error = |den: u64| {
        let mut sim = run(false, Seconds { num: 1, den }, Integrator::Rk4);
        sim.run_until(Seconds { num: 2, den: 1 }).unwrap();
        (sim.get("A.state.s").unwrap() - 1.0 / 3.0).abs()
    };
    let (coarse, fine) = (error(5), error(10));
    let order = (coarse / fine).log2();
    assert!(order > 3.7 && order < 4.6, "order {order}: {coarse} {fine}");
}

#[test]
fn forks_and_checkpoints_go_on_bit_for_bit() {
    let mut sim = run(true, Seconds { num: 1, den: 50 }, Integrator::Rk4);
    sim.run_until(Seconds { num: 3, den: 1 }).unwrap();
    let saved = sim.checkpoint("").unwrap();
    let mut copy = sim.fork();
    let mut again = run(true, Seconds { num: 1, den: 50 }, Integrator::Rk4);
    again.restore(&saved).unwrap();
    for s in [&mut sim, &mut copy, &mut again] {
        s.run_until(Seconds { num: 6, den: 1 }).unwrap();
    }
    assert_eq!(sim.state(), copy.state());
    assert_eq!(sim.state(), again.state());
}
