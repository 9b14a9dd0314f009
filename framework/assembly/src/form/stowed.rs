//! `stowed: (..)` as written.
use crate::schema::kind::{flag, text};
use crate::schema::record::{Presence, of, record};
use crate::text::value::Text;
use linkwork_spatial::Pose;

record! {
    /// Where an assembly is stowed as cargo.
    pub(crate) struct StowedForm: "stowed" {
        /// The body or node that carries it, looked up as the parent of a body.
        on: Option<Text> = text().maybe(),
        /// Pose on it of the body that otherwise hangs on the world.
        at: Pose = of::<Pose>().or(Pose::identity()),
        /// Nothing carries it: its bodies stay where they are, at rest, every hinge as it stands.
        held: bool = flag().or(false),
    }
}
