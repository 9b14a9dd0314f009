//! `stowed: (..)` as written.
use crate::schema::kind::text;
use crate::schema::record::{Presence, of, record};
use crate::text::value::Text;
use linkwork_spatial::Pose;

record! {
    /// Where an assembly is stowed as cargo.
    pub(crate) struct StowedForm: "stowed" {
        /// The body or node that carries it, looked up as the parent of a body.
        on: Text = text().need("write stowed: (on: \"the body that carries it\"), or `None`"),
        /// Pose on it of the body that otherwise hangs on the world.
        at: Pose = of::<Pose>().or(Pose::identity()),
    }
}
