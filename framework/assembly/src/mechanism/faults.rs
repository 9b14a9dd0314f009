//! Positions of faults of a mechanism: where their bodies and loops are written.
use crate::mechanism::anchor::Bodies;
use linkwork_multibody::MechanismFault;
use linkwork_runtime::Origin;
use std::collections::BTreeMap;

/// Returns the name after a word: ``body `NAME` ``.
fn named<'t>(text: &'t str, kind: &str) -> Option<&'t str> {
    text.strip_prefix(kind)?.strip_prefix(" `")?.split('`').next()
}

pub(crate) fn fault_origin(
    fault: &MechanismFault,
    bodies: &Bodies,
    constraints: &BTreeMap<String, Origin>,
) -> Option<Origin> {
    let body = |name: &str| bodies.get(name).map(|(b, _)| b);
    let constraint = |name: &str| constraints.get(name).copied();
    // Finds the origin of a body or of a node on a body.
    let hanging = |place: &str| {
        let node = named(place, "node").and_then(|n| n.rsplit_once('/'));
        let of_node = node.and_then(|(b, n)| body(b)?.nodes.iter().find(|x| x.0 == n).map(|x| x.2));
        of_node.or_else(|| body(named(place, "body")?).map(|b| b.origin))
    };
    // Finds the origin of a loop, a coupling, or the body whose hinge or number is faulty.
    let any = |what: &str| {
        let kinds = ["loop", "coupling"];
        let loops = kinds.iter().find_map(|kind| constraint(named(what, kind)?));
        loops.or_else(|| body(named(what, "body")?).map(|b| b.origin))
    };
    match fault {
        MechanismFault::Inertia { body: name, .. } => body(name).map(|b| b.inertia_origin),
        MechanismFault::UnknownParent { body: name, .. } => body(name).map(|b| b.origin),
        MechanismFault::BadAxis { body: what, .. }
        | MechanismFault::BadArmature { body: what, .. }
        | MechanismFault::BadGear { body: what, .. }
        | MechanismFault::BadLimits { body: what, .. }
        | MechanismFault::BadDamping { body: what, .. }
        | MechanismFault::BadFriction { body: what, .. }
        | MechanismFault::BadStop { body: what, .. }
        | MechanismFault::BadDrive { body: what, .. }
        | MechanismFault::NotOnLoop { body: what, .. }
        | MechanismFault::UnknownEnd { what, .. }
        | MechanismFault::NotFinite { place: what } => any(what),
        MechanismFault::Loop { name, .. }
        | MechanismFault::LoopOnItself { name, .. }
        | MechanismFault::EmptyCoupling { name }
        | MechanismFault::NoCoordinate { name, .. }
        | MechanismFault::PowersWithoutTerm { name, .. }
        | MechanismFault::CoordinateTwice { name, .. } => constraint(name),
        MechanismFault::Cycle { path } => body(path.first()?).map(|b| b.parent.origin),
        MechanismFault::Duplicate { what, name, .. } | MechanismFault::BadName { what, name } => {
            match *what {
                "loop" | "coupling" => constraint(name),
                _ => body(name).map(|b| b.origin),
            }
        }
        MechanismFault::UnknownBody { body: name, .. } => body(name).map(|b| b.origin),
        MechanismFault::Modes { body: name, .. } => body(name).map(|b| b.modes_origin),
        MechanismFault::Attachment { place, body: name, .. } => {
            hanging(place).or_else(|| body(name).map(|b| b.modes_origin))
        }
    }
}

/// A fault with a remedy in the terms of the file.
pub(crate) struct Placed(pub MechanismFault);

impl std::fmt::Display for Placed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.0)?;
        match self.0 {
            MechanismFault::Inertia { .. } => f.write_str(
                "\n  help: inertia is about the centre of mass in body axes; a solid such as \
                 Cylinder(radius: .., length: ..) computes it from the mass",
            ),
            _ => Ok(()),
        }
    }
}
