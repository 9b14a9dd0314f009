//! What can be wrong with a mechanism's description: place, fact, remedy, all at once.

use crate::modes::{AttachmentFault, ModesFault};
use linkwork_spatial::InertiaError;
use thiserror::Error;

/// One fault in a description.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Fault {
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
    /// Two bodies, or two nodes, have one name.
    #[error("{what} `{name}` is defined {count} times\n  help: give each its own name")]
    Duplicate {
        /// "body" or "node".
        what: &'static str,
        /// The name.
        name: String,
        /// How often it occurs.
        count: usize,
    },
    /// A name that cannot be used.
    #[error("{what} name `{name}` is not usable\n  help: it must not be empty or `world`")]
    BadName {
        /// "body" or "node".
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
        "body `{body}`, subhinge {subhinge}: axis has no direction\n  help: give a non-zero, finite vector"
    )]
    BadAxis {
        /// The body.
        body: String,
        /// Which link of the chain, from the parent's side.
        subhinge: usize,
    },
    /// A rotor inertia that is impossible or out of place.
    #[error(
        "body `{body}`, subhinge {subhinge}: armature {armature} is not usable\n  help: it must be \
         finite and ≥ 0, and 0 on a free or locked subhinge"
    )]
    BadArmature {
        /// The body.
        body: String,
        /// Which link of the chain.
        subhinge: usize,
        /// The value, kg m² or kg.
        armature: f64,
    },
    /// A gear ratio that turns nothing.
    #[error(
        "body `{body}`, subhinge {subhinge}: gear ratio {gear} is not usable\n  help: it must be \
         finite and not 0"
    )]
    BadGear {
        /// The body.
        body: String,
        /// Which link of the chain.
        subhinge: usize,
        /// The value.
        gear: f64,
    },
    /// Limits that nothing can keep, or on a subhinge that has no single coordinate.
    #[error(
        "body `{body}`, subhinge {subhinge}: limits {limits:?} are not usable\n  help: they need \
         lower ≤ upper, rate ≥ 0, effort ≥ 0, and belong on pins, sliders and screws"
    )]
    BadLimits {
        /// The body.
        body: String,
        /// Which link of the chain.
        subhinge: usize,
        /// The values.
        limits: crate::Limits,
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
    pub faults: Vec<Fault>,
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
