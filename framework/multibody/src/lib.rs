//! The structure of a mechanism: bodies, hinges made of subhinges, nodes.
/// The structure of a mechanism.
pub struct Multibody {}
