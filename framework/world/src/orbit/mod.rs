//! Two bodies: where an orbit goes, its elements, and motion near a circular orbit.

mod clohessy_wiltshire;
mod elements;
mod two_body;

pub use clohessy_wiltshire::{ClohessyWiltshire, Relative};
pub use elements::Elements;
pub use two_body::propagate;
