//! Balances of energy, mass and electric charge: the terms of each part, found from its ports.
//!
//! ```text
//! connector   electrical  V i and i        heat  Q̇        propellant  ṁ          flows at a node add up to zero
//! work        τ q̇ and F · v + M · ω       of a torque or wrench, where the part reads the motion of what it is bound to
//! declared    `stored` (J, kg, C), `gained`, `lost` (W, kg/s, A) of `#[port(..)]`, and the accounts of a block
//! part        Σ connectors − Σ work + gained − lost = d/dt stored
//! ```
//! All terms are positive if they increase the amount in the part. A part without declared accounts and with only one kind of term is a boundary of
//! the simulation: its exchange (thrust, drag, the heat of a radiator) is a term of the balance and is not checked. The terms of every other part
//! must add up to zero.
pub use crate::author::account::{Account, OwnAccount, OwnAccounts, Quantity};
use crate::author::model::Description;
use crate::author::ports::{PortKind, PortSpec};
use crate::author::value::Origin;
use crate::plan::program::Program;
use std::collections::BTreeSet;

/// Origin of a term of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Through an electrical connector.
    Electrical,
    /// Through a heat connector.
    Heat,
    /// Through a propellant connector.
    Propellant,
    /// Work of its torques and wrenches on the mechanism, counted negative; for the mechanism: the work of all parts.
    Work,
    /// Change of the stored amount, counted negative.
    Stored,
    /// Declared as gained.
    Gained,
    /// Declared as lost, counted negative.
    Lost,
}

/// A product of variables: factor, path of a variable, path of a second one.
pub type Product = (f64, String, Option<String>);

/// A term of a part's balance.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// Path of the part.
    pub part: String,
    /// Quantity that it counts.
    pub quantity: Quantity,
    /// Origin of the term.
    pub kind: Kind,
    /// Name of the connector, binding or port.
    pub name: String,
    /// Products whose sum is the rate of the term, or the amount of a stored quantity. Empty for an account of a block, which reports it itself.
    pub of: Vec<Product>,
}

/// The terms of a part.
#[derive(Clone, Debug, PartialEq)]
pub struct PartTerms {
    /// Path of the part.
    pub part: String,
    /// Position in the file.
    pub origin: Origin,
    /// Terms from its ports.
    pub terms: Vec<Term>,
    /// Terms that its block reports.
    pub own: OwnAccounts,
    /// Wrenches and torques whose work is unknown, because the part does not read the motion of the body on which they act.
    pub silent: Vec<String>,
}

impl PartTerms {
    /// Returns whether its terms of a quantity must add up to zero.
    pub fn has_to_close(&self, quantity: Quantity) -> bool {
        let of = || self.terms.iter().filter(|t| t.quantity == quantity);
        let declared = |t: &Term| matches!(t.kind, Kind::Stored | Kind::Gained | Kind::Lost);
        if of().any(declared) {
            return true;
        }
        let connectors: BTreeSet<&str> =
            of().filter(|t| t.kind != Kind::Work).map(|t| &*t.name).collect();
        let works = of().any(|t| t.kind == Kind::Work);
        // Charge is exempt, because the currents at the connectors of a converter differ although
        // it stores no charge.
        quantity != Quantity::Charge
            && connectors.len() + usize::from(works) > 1
            && !connectors.is_empty()
    }
}

/// Returns the terms of all parts of all phases, sorted by path. A part that several phases have counts once.
pub fn terms(program: &Program) -> Vec<PartTerms> {
    let (mut all, mut known) = (Vec::new(), BTreeSet::new());
    for part in program.phases.iter().flat_map(|phase| &phase.plan.parts) {
        if !known.insert(part.path.as_str()) {
            continue;
        }
        let (terms, silent) = of_part(&part.path, part.prototype.description());
        let mut own = part.prototype.accounts();
        if own.receives_work && program.phases.len() > 1 {
            own.unknown.push("parts and bodies that phases add or remove".to_string());
        }
        let (path, origin) = (part.path.clone(), part.origin);
        if !terms.is_empty() || !silent.is_empty() || own != OwnAccounts::default() {
            all.push(PartTerms { part: path, origin, terms, own, silent });
        }
    }
    all
}

/// Returns the terms of a part, and the wrenches and torques whose work is unknown.
fn of_part(path: &str, d: &Description) -> (Vec<Term>, Vec<String>) {
    let mut terms = connectors(path, d);
    let mut silent = Vec::new();
    for port in d.all_outputs() {
        match work(path, d, port) {
            Some(Ok(term)) => terms.push(term),
            Some(Err(name)) => silent.push(name),
            None => {}
        }
    }
    let states = || d.continuous.iter().chain(&d.discrete).map(|p| (p, "state."));
    let ports = d.all_inputs().chain(d.all_outputs()).map(|p| (p, ""));
    for (port, prefix) in ports.chain(states()) {
        let Some(account) = port.account else { continue };
        let Some((quantity, amount)) = Quantity::of(&port.unit) else { continue };
        let (kind, sign) = match account {
            Account::Stored => (Kind::Stored, -1.0),
            Account::Gained => (Kind::Gained, 1.0),
            Account::Lost => (Kind::Lost, -1.0),
        };
        if amount != (account == Account::Stored) {
            continue;
        }
        let of = vec![(sign, format!("{path}.{prefix}{}", port.name), None)];
        let (part, name) = (path.to_string(), port.name.to_string());
        terms.push(Term { part, quantity, kind, name, of });
    }
    (terms, silent)
}

/// Flows through connectors. A load has its flow among its outputs, a source among its inputs; heat counts from the load into the source.
fn connectors(path: &str, d: &Description) -> Vec<Term> {
    let ports = || {
        let inputs = d.all_inputs().map(|p| (p, false));
        inputs.chain(d.all_outputs().map(|p| (p, true)))
    };
    let mut terms = Vec::new();
    for (flow, output) in ports() {
        let Some(connector) = flow.connector.as_deref() else { continue };
        let (kind, quantity) = match &*flow.unit {
            "A" => (Kind::Electrical, Quantity::Charge),
            "W" => (Kind::Heat, Quantity::Energy),
            "kg/s" => (Kind::Propellant, Quantity::Mass),
            _ => continue,
        };
        let into = if output == (kind != Kind::Heat) { 1.0 } else { -1.0 };
        let own = format!("{path}.{}", flow.name);
        let mut add = |quantity, of| {
            let (part, name) = (path.to_string(), connector.to_string());
            terms.push(Term { part, quantity, kind, name, of: vec![of] });
        };
        add(quantity, (into, own.clone(), None));
        let other =
            ports().find(|(p, _)| p.connector.as_deref() == Some(connector) && p.unit == "V");
        if let (Kind::Electrical, Some((volts, _))) = (kind, other) {
            add(Quantity::Energy, (into, own, Some(format!("{path}.{}", volts.name))));
        }
    }
    terms
}

/// Returns the work of a torque or wrench; an error if the motion of the body on which it acts is unknown.
fn work(path: &str, d: &Description, port: &PortSpec) -> Option<Result<Term, String>> {
    let motion = match port.kind {
        PortKind::HingeTorque => PortKind::HingeState,
        PortKind::BallTorque => PortKind::BallState,
        PortKind::Wrench => PortKind::NodeState,
        _ => return None,
    };
    let bind = port.bind.as_deref()?;
    let seen = d.all_inputs().find(|p| p.kind == motion && p.bind.as_deref() == Some(bind));
    let Some(seen) = seen else { return Some(Err(port.name.to_string())) };
    let product = |a: &str, b: &str| {
        (-1.0, format!("{path}.{}{a}", port.name), Some(format!("{path}.{}{b}", seen.name)))
    };
    let of = match port.kind {
        PortKind::HingeTorque => vec![product("", ".rate")],
        PortKind::BallTorque => {
            ["x", "y", "z"].map(|c| product(&format!(".{c}"), &format!(".rate.{c}"))).to_vec()
        }
        _ => [(".moment", ".angular"), (".force", ".velocity")]
            .iter()
            .flat_map(|(a, b)| {
                ["x", "y", "z"].map(|c| product(&format!("{a}.{c}"), &format!("{b}.{c}")))
            })
            .collect(),
    };
    let (part, name) = (path.to_string(), bind.to_string());
    Some(Ok(Term { part, quantity: Quantity::Energy, kind: Kind::Work, name, of }))
}
