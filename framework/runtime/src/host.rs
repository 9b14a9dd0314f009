//! Items for authors of a [`Host`](crate::Host) and of parts that solve for the states of many others, such as a multibody mechanism.
//!
//! [`Prototype`](crate::Prototype) and [`Block`](crate::Block) are the part; [`Host`](crate::Host) converts bindings of other parts to ports
//! of it. A host that places something finds its start with [`settle`].
pub use crate::block::{OldState, copy_store};
pub use crate::model::Turning;
pub use crate::step::{SettleGroup, settle};
