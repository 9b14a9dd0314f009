//! What can be wrong with a mechanism's description: place, fact, remedy, all at once.

use crate::constraint::LoopFault;
use crate::modes::{AttachmentFault, ModesFault};
use linkwork_spatial::InertiaError;
use thiserror::Error;

/// One fault in a description.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MechanismFault {
    /// A body hangs on a body that does not exist.
    #[error("body `{body}`: no parent `{parent}`{}", suggest(suggestion))]
    UnknownParent {
        /// The body.
        body: String,
        /// The parent it names.
        parent: String,
        /// The nearest existing name.
        suggestion: Option<String>,
    },
    /// A node sits on a body that does not exist.
    #[error("node `{node}`: no body `{body}`{}", suggest(suggestion))]
    UnknownBody {
        /// The node.
        node: String,
        /// The body it names.
        body: String,
        /// The nearest existing name.
        suggestion: Option<String>,
    },
    /// Two bodies, nodes, loops or couplings have one name.
    #[error("{what} `{name}` is defined {count} times\n  help: give each its own name")]
    Duplicate {
        /// "body", "node", "loop" or "coupling".
        what: &'static str,
        /// The name.
        name: String,
        /// How often it occurs.
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
    /// Bodies that hang on each other in a ring.
    #[error(
        "bodies form a ring: {}\n  help: hang one of them on `world` and close the loop with a \
         constraint",
        path.join(" -> ")
    )]
    Cycle {
        /// Body, its parent, its parent's parent, … and the first again.
        path: Vec<String>,
    },
    /// An axis without a direction.
    #[error(
        "{body}, subhinge {subhinge}: axis has no direction\n  help: give a non-zero, finite vector"
    )]
    BadAxis {
        /// What carries the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Which link of the chain, from the parent's side.
        subhinge: usize,
    },
    /// A rotor inertia that is impossible or out of place.
    #[error(
        "{body}, subhinge {subhinge}: armature {armature} is not usable\n  help: it must be \
         finite and ≥ 0, and 0 on a free or locked subhinge"
    )]
    BadArmature {
        /// What carries the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Which link of the chain.
        subhinge: usize,
        /// The value, kg m² or kg.
        armature: f64,
    },
    /// A gear ratio that turns nothing.
    #[error(
        "{body}, subhinge {subhinge}: gear ratio {gear} is not usable\n  help: it must be \
         finite and not 0"
    )]
    BadGear {
        /// What carries the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Which link of the chain.
        subhinge: usize,
        /// The value.
        gear: f64,
    },
    /// Limits that nothing can keep, or on a subhinge that has no single coordinate.
    #[error(
        "{body}, subhinge {subhinge}: limits {limits:?} are not usable\n  help: they need \
         lower ≤ upper, rate ≥ 0, effort ≥ 0, and belong on pins, sliders and screws"
    )]
    BadLimits {
        /// What carries the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Which link of the chain.
        subhinge: usize,
        /// The values.
        limits: crate::Limits,
    },
    /// Viscous damping that is impossible or out of place.
    #[error(
        "{body}, subhinge {subhinge}: damping {damping} is not usable\n  help: it must be finite \
         and ≥ 0, and 0 on a free or locked subhinge"
    )]
    BadDamping {
        /// What carries the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Which link of the chain.
        subhinge: usize,
        /// The value, N m s/rad or N s/m.
        damping: f64,
    },
    /// Dry friction that is impossible or out of place.
    #[error(
        "{body}, subhinge {subhinge}: friction {friction:?} is not usable\n  help: force and rate \
         must be finite and ≥ 0, and friction belongs on pins, sliders and screws"
    )]
    BadFriction {
        /// What carries the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Which link of the chain.
        subhinge: usize,
        /// The values.
        friction: crate::Friction,
    },
    /// A stop that is impossible or out of place.
    #[error(
        "{body}, subhinge {subhinge}: stop {stop:?} is not usable\n  help: stiffness must be > 0 \
         and damping ≥ 0, both finite, and stops belong on pins, sliders and screws"
    )]
    BadStop {
        /// What carries the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Which link of the chain.
        subhinge: usize,
        /// The values.
        stop: crate::Stop,
    },
    /// A spring, a limit of a ball or a restitution that is impossible or out of place.
    #[error("{body}, subhinge {subhinge}: {what} is not usable\n  help: {wanted}")]
    BadDrive {
        /// What carries the hinge: ``body `NAME` `` or ``loop `NAME` ``.
        body: String,
        /// Which link of the chain.
        subhinge: usize,
        /// What is wrong.
        what: &'static str,
        /// What it must be.
        wanted: &'static str,
    },
    /// Damping, friction, a spring or a stop on the hinge of a loop.
    #[error(
        "{body}, subhinge {subhinge}: damping, friction, springs and stops do not act on the hinge of a \
         loop\n  help: write them on hinges of bodies"
    )]
    NotOnLoop {
        /// What carries the hinge: ``loop `NAME` ``.
        body: String,
        /// Which link of the chain.
        subhinge: usize,
    },
    /// A constraint on a body that does not exist.
    #[error("{what}: no body `{body}`{}", suggest(suggestion))]
    UnknownEnd {
        /// The constraint.
        what: String,
        /// The body it names.
        body: String,
        /// The nearest existing name.
        suggestion: Option<String>,
    },
    /// Both ends of a loop on one body.
    #[error("loop `{name}`: both ends are on `{body}`\n  help: a loop joins two bodies")]
    LoopOnItself {
        /// The loop.
        name: String,
        /// The body.
        body: String,
    },
    /// A hinge that cannot close a loop.
    #[error("loop `{name}`: its hinge {error}")]
    Loop {
        /// The loop.
        name: String,
        /// Why.
        error: LoopFault,
    },
    /// A coupling of nothing.
    #[error(
        "coupling `{name}` has no term that is not zero\n  help: give it a coordinate and a factor"
    )]
    EmptyCoupling {
        /// The coupling.
        name: String,
    },
    /// A coupling of what is not a single coordinate.
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
    /// One coordinate in two terms.
    #[error(
        "coupling `{name}`: subhinge {subhinge} of `{body}` comes twice\n  help: add the factors up"
    )]
    CoordinateTwice {
        /// The coupling.
        name: String,
        /// The body.
        body: String,
        /// The subhinge.
        subhinge: usize,
    },
    /// A pose or pitch with a NaN or infinity.
    #[error("{place}: a number is NaN or infinite\n  help: give finite numbers")]
    NotFinite {
        /// Where.
        place: String,
    },
    /// Modes that no body has.
    #[error("body `{body}`, modes: {error}")]
    Modes {
        /// The body.
        body: String,
        /// What is wrong.
        error: ModesFault,
    },
    /// Nothing carries a frame that hangs on a flexible body.
    #[error("{place} on flexible body `{body}`: {error}")]
    Attachment {
        /// The body or node that hangs.
        place: String,
        /// The flexible body.
        body: String,
        /// Why.
        error: AttachmentFault,
    },
    /// Mass properties of a body that cannot exist.
    #[error("body `{body}`: {error}")]
    Inertia {
        /// The body.
        body: String,
        /// What is wrong and by how much.
        error: InertiaError,
    },
}

fn suggest(name: &Option<String>) -> String {
    name.as_ref().map_or_else(String::new, |n| format!("\n  help: did you mean `{n}`?"))
}

/// Everything that is wrong with a description.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildError {
    /// The faults, in the order bodies and nodes were added; at least one.
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
