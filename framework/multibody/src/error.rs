//! Faults of a mechanism's description. Each names the location, the fact and the remedy; all are reported at once.

use crate::constraint::LoopFault;
use crate::modes::{AttachmentFault, ModesFault};
use linkwork_spatial::InertiaError;
use thiserror::Error;

/// One fault in a description.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MechanismFault {
    /// The parent of a body does not exist.
    #[error("body `{body}`: no parent `{parent}`{}", suggest(suggestion))]
    UnknownParent {
        /// The body.
        body: String,
        /// The parent it names.
        parent: String,
        /// The nearest existing name.
        suggestion: Option<String>,
    },
    /// The body of a node does not exist.
    #[error("node `{node}`: no body `{body}`{}", suggest(suggestion))]
    UnknownBody {
        /// The node.
        node: String,
        /// The body it names.
        body: String,
        /// The nearest existing name.
        suggestion: Option<String>,
    },
    /// Two bodies, nodes, loops or couplings share a name.
    #[error("{what} `{name}` is defined {count} times\n  help: give each its own name")]
    Duplicate {
        /// "body", "node", "loop" or "coupling".
        what: &'static str,
        /// The name.
        name: String,
        /// Number of occurrences.
        count: usize,
    },
    /// A name that cannot be used.
    #[error("{what} name `{name}` is not usable\n  help: it must not be empty or `world`")]
    BadName {
        /// "body", "node", "loop" or "coupling".
        what: &'static str,
        /// The name.
        name: String,
    },
    /// Bodies are each other's parents in a cycle.
    #[error(
        "bodies form a cycle: {}\n  help: attach one of them to `world` and close the loop with a \
         constraint",
        path.join(" -> ")
    )]
    Cycle {
        /// Body, its parent, its parent's parent, … and the first body again.
        path: Vec<String>,
    },
    /// An axis without a direction.
    #[error(
        "{body}, subhinge {subhinge}: axis has no direction\n  help: give a non-zero, finite vector"
    )]
    BadAxis {
        /// Owner of the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Index of the subhinge, counted from the parent's side.
        subhinge: usize,
    },
    /// A rotor inertia is invalid or not allowed here.
    #[error(
        "{body}, subhinge {subhinge}: armature {armature} is not usable\n  help: it must be \
         finite and ≥ 0, and 0 on a free or locked subhinge"
    )]
    BadArmature {
        /// Owner of the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Index of the subhinge.
        subhinge: usize,
        /// The value, kg m² or kg.
        armature: f64,
    },
    /// A gear ratio is zero or not finite.
    #[error(
        "{body}, subhinge {subhinge}: gear ratio {gear} is not usable\n  help: it must be \
         finite and not 0"
    )]
    BadGear {
        /// Owner of the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Index of the subhinge.
        subhinge: usize,
        /// The value.
        gear: f64,
    },
    /// Limits are contradictory, or the subhinge does not have a single coordinate.
    #[error(
        "{body}, subhinge {subhinge}: limits {limits:?} are not usable\n  help: they need \
         lower ≤ upper, rate ≥ 0, effort ≥ 0, and belong on pins, sliders and screws"
    )]
    BadLimits {
        /// Owner of the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Index of the subhinge.
        subhinge: usize,
        /// The values.
        limits: crate::Limits,
    },
    /// Viscous damping is invalid or not allowed here.
    #[error(
        "{body}, subhinge {subhinge}: damping {damping} is not usable\n  help: it must be finite \
         and ≥ 0, and 0 on a free or locked subhinge"
    )]
    BadDamping {
        /// Owner of the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Index of the subhinge.
        subhinge: usize,
        /// The value, N m s/rad or N s/m.
        damping: f64,
    },
    /// Dry friction is invalid or not allowed here.
    #[error(
        "{body}, subhinge {subhinge}: friction {friction:?} is not usable\n  help: force and rate \
         must be finite and ≥ 0, and friction belongs on pins, sliders and screws"
    )]
    BadFriction {
        /// Owner of the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Index of the subhinge.
        subhinge: usize,
        /// The values.
        friction: crate::Friction,
    },
    /// A stop is invalid or not allowed here.
    #[error(
        "{body}, subhinge {subhinge}: stop {stop:?} is not usable\n  help: stiffness must be > 0 \
         and damping ≥ 0, both finite, and stops belong on pins, sliders and screws"
    )]
    BadStop {
        /// Owner of the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Index of the subhinge.
        subhinge: usize,
        /// The values.
        stop: crate::Stop,
    },
    /// A spring, a ball limit or a restitution is invalid or not allowed here.
    #[error("{body}, subhinge {subhinge}: {what} is not usable\n  help: {wanted}")]
    BadDrive {
        /// Owner of the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Index of the subhinge.
        subhinge: usize,
        /// The invalid item.
        what: &'static str,
        /// Requirement.
        wanted: &'static str,
    },
    /// The hinge of a loop has damping, friction, a spring or a stop.
    #[error(
        "{body}, subhinge {subhinge}: damping, friction, springs and stops do not act on the hinge of a \
         loop\n  help: write them on hinges of bodies"
    )]
    NotOnLoop {
        /// Owner of the hinge: ``loop `NAME` ``.
        body: String,
        /// Index of the subhinge.
        subhinge: usize,
    },
    /// The body of a constraint does not exist.
    #[error("{what}: no body `{body}`{}", suggest(suggestion))]
    UnknownEnd {
        /// The constraint.
        what: String,
        /// The body it names.
        body: String,
        /// The nearest existing name.
        suggestion: Option<String>,
    },
    /// Both ends of a loop are on one body.
    #[error("loop `{name}`: both ends are on `{body}`\n  help: a loop joins two bodies")]
    LoopOnItself {
        /// The loop.
        name: String,
        /// The body.
        body: String,
    },
    /// The hinge of a loop cannot close it.
    #[error("loop `{name}`: its hinge {error}")]
    Loop {
        /// The loop.
        name: String,
        /// Reason.
        error: LoopFault,
    },
    /// A coupling without terms.
    #[error("coupling `{name}` has no nonzero term\n  help: give it a coordinate and a factor")]
    EmptyCoupling {
        /// The coupling.
        name: String,
    },
    /// A term of a coupling is not a single coordinate.
    #[error(
        "coupling `{name}`: body `{body}` has no one-dof subhinge {subhinge}\n  help: couple pins, \
         sliders and screws; subhinges count from 0 at the parent's side"
    )]
    NoCoordinate {
        /// The coupling.
        name: String,
        /// The body.
        body: String,
        /// The subhinge it names.
        subhinge: usize,
    },
    /// A coordinate has higher powers, but no term.
    #[error(
        "coupling `{name}`: subhinge {subhinge} of `{body}` has higher powers and no term\n  help: add a term; its factor may be 0"
    )]
    PowersWithoutTerm {
        /// The coupling.
        name: String,
        /// The body.
        body: String,
        /// The subhinge.
        subhinge: usize,
    },
    /// A coordinate appears in two terms.
    #[error(
        "coupling `{name}`: subhinge {subhinge} of `{body}` appears twice\n  help: add the factors"
    )]
    CoordinateTwice {
        /// The coupling.
        name: String,
        /// The body.
        body: String,
        /// The subhinge.
        subhinge: usize,
    },
    /// A pose or pitch contains NaN or infinity.
    #[error("{place}: a number is NaN or infinite\n  help: give finite numbers")]
    NotFinite {
        /// Location.
        place: String,
    },
    /// Invalid modes of a flexible body.
    #[error("body `{body}`, modes: {error}")]
    Modes {
        /// The body.
        body: String,
        /// Fault.
        error: ModesFault,
    },
    /// No station carries a frame on a flexible body.
    #[error("{place} on flexible body `{body}`: {error}")]
    Attachment {
        /// The attached body or node.
        place: String,
        /// The flexible body.
        body: String,
        /// Reason.
        error: AttachmentFault,
    },
    /// Invalid mass properties of a body.
    #[error("body `{body}`: {error}")]
    Inertia {
        /// The body.
        body: String,
        /// Faults and their sizes.
        error: InertiaError,
    },
}

fn suggest(name: &Option<String>) -> String {
    name.as_ref().map_or_else(String::new, |n| format!("\n  help: did you mean `{n}`?"))
}

/// All faults of a description.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildError {
    /// Faults, in the order in which bodies and nodes were added; at least one.
    pub faults: Vec<MechanismFault>,
}

impl std::fmt::Display for BuildError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (i, fault) in self.faults.iter().enumerate() {
            write!(f, "{}error: {fault}", if i == 0 { "" } else { "\n" })?;
        }
        Ok(())
    }
}

impl std::error::Error for BuildError {}
