//! `stowed: (..)` as written in a file.
use crate::schema::kind::{flag, text};
use crate::schema::record::{Presence, of, record};
use crate::text::value::Text;
use linkwork_spatial::Pose;

record! {
    /// Placement of an assembly as cargo.
    pub(crate) struct StowedForm: "stowed" {
        /// The body or node that carries it, resolved like the parent of a body.
        on: Option<Text> = text().maybe(),
        /// Pose of the assembly's root body on it.
        at: Pose = of::<Pose>().or(Pose::identity()),
        /// No body carries it: its bodies stay at their poses, at rest, with all hinges fixed.
        held: bool = flag().or(false),
    }
}
