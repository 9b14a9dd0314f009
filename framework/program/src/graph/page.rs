//! The graph as one page: the data of `page.html` are inserted as JSON.
use super::edges;
use linkwork_runner::Ready;
use linkwork_runtime::doc::first_sentence;
use linkwork_runtime::{Fires, Plan, PortSpec, Via};
use serde::Serialize;

/// The page; the program replaces `DATA` by the graph's data.
const PAGE: &str = include_str!("page.html");

#[derive(Serialize)]
struct Simulation {
    /// Name of the file.
    name: String,
    doc: String,
    /// The step, s.
    step: f64,
    integrator: String,
    phases: Vec<Phase>,
}

#[derive(Serialize)]
struct Phase {
    name: String,
    parts: Vec<Part>,
    wires: Vec<Wire>,
    /// Transitions: target phase and condition.
    to: Vec<(String, String)>,
}

#[derive(Serialize)]
struct Part {
    path: String,
    model: String,
    doc: String,
    /// Sample period, s; `None`: continuous.
    period: Option<f64>,
    /// Numbers of continuous and discrete states.
    states: (usize, usize),
    inputs: Vec<Port>,
    outputs: Vec<Port>,
}

#[derive(Serialize)]
struct Port {
    name: String,
    unit: String,
    doc: String,
}

#[derive(Serialize)]
struct Wire {
    /// Part and port; without a part: a node, body or hinge of the mechanism.
    from: (Option<String>, String),
    to: (Option<String>, String),
    /// A continuous reader holds the sample.
    hold: bool,
    /// The connection is a binding, not a wire in the file.
    bound: bool,
}

fn port(p: &PortSpec) -> Port {
    Port { name: p.name.to_string(), unit: p.unit.to_string(), doc: first_sentence(&p.doc) }
}

fn phase(name: &str, plan: &Plan, names: &[String]) -> Phase {
    let part = |p: &linkwork_runtime::PartPlan| {
        let d = p.prototype.description();
        let lanes = p.lanes();
        Part {
            path: p.path.clone(),
            model: d.name.to_string(),
            doc: first_sentence(&d.doc),
            period: p.rate.map(|r| r.seconds()),
            states: (lanes.x, lanes.d),
            inputs: d.all_inputs().map(port).collect(),
            outputs: d.all_outputs().map(port).collect(),
        }
    };
    let end = |e: super::End| match e.known {
        true => (Some(e.part), e.port),
        false => (None, e.part),
    };
    let wire = |e: super::Edge| Wire {
        from: end(e.from),
        to: end(e.to),
        hold: e.hold,
        bound: e.via == Via::Bind,
    };
    let transition = |g: &linkwork_runtime::GuardPlan| match g.fires {
        Fires::Transition { to } => Some((names.get(to as usize)?.clone(), g.name.clone())),
        Fires::Part { .. } | Fires::Watch { .. } => None,
    };
    Phase {
        name: name.into(),
        parts: plan.parts.iter().map(part).collect(),
        wires: edges(plan).into_iter().map(wire).collect(),
        to: plan.guards.iter().filter_map(transition).collect(),
    }
}

/// Returns the page of a simulation with this name.
pub fn page(name: &str, ready: &Ready) -> String {
    let names: Vec<String> = ready.program.phases.iter().map(|p| p.name.clone()).collect();
    let plan = ready.plan();
    let data = Simulation {
        name: name.into(),
        doc: ready.loaded.simulation.doc.clone(),
        step: plan.step.seconds(),
        integrator: plan.integration.method.name().into(),
        phases: ready.program.phases.iter().map(|p| phase(&p.name, &p.plan, &names)).collect(),
    };
    // The data contain only numbers and texts, so serialization cannot fail. `<` is escaped, so that a text cannot end
    // the script.
    let json = serde_json::to_string(&data).unwrap_or_default().replace('<', "\\u003c");
    PAGE.replacen("\"DATA\"", &json, 1)
}
